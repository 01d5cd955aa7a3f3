"""Findings from reading a file: refusals, assumptions, solved loops and content that is left out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from ...errors import BadRequest, LoopClosureFailure
from ...tolerances import INCIDENCE_TOL
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile, list_defects
from .geometry import ROUNDED


def _report_refused(file: LintedFile) -> Iterator[RuleHit]:
    error = file.refusal
    if error is None or isinstance(error, BadRequest):
        return
    if isinstance(error, LoopClosureFailure) and error.residual > INCIDENCE_TOL:  # another rule reports it
        return
    for line, text in list_defects(error):
        yield RuleHit(line, text)


def _report_assumptions(file: LintedFile) -> Iterator[RuleHit]:
    if isinstance(file.refusal, BadRequest):
        yield RuleHit(None, " ".join(str(file.refusal).removeprefix(f"{file.file}: ").split()))
    elif file.mechanism is not None and file.mechanism.has_open_platform:
        yield RuleHit(None, str(file.mechanism.choice))


def find_notes(*kinds: str, text: str = "") -> Callable[[LintedFile], Iterator[RuleHit]]:
    """Return a function that yields the reader's notes of some kinds whose text begins with a pattern."""

    def find(file: LintedFile) -> Iterator[RuleHit]:
        robot = file.mechanism
        for note in () if robot is None else robot.notes:
            if note.kind in kinds and re.match(text, note.text):
                yield RuleHit(None, note.text)

    return find


_unread = find_notes(
    "open", text=r"(?!\d+ coordinates have motors|the robot's char|no element of the file closes|the closure .* locks)"
)
_left_out = find_notes(
    "ignored", text=r"(?!\d+ links that no joint|unknown (element|attribute))"
)  # these have rules of their own


RULES = (
    LintRule(
        "refused",
        "error",
        "content that hrsynth refuses",
        "Every command refuses this file with this message.",
        "correct the defect in the message",
        _report_refused,
    ),
    LintRule(
        "option-missing",
        "warning",
        "information that neither the file nor its structure gives",
        "Commands need it as an option.",
        "give the option named in the message",
        _report_assumptions,
    ),
    LintRule(
        "assumed",
        "note",
        "an assumption from the structure of the file",
        "An assumption is made only if the structure leaves one choice; the results depend on it.",
        "state it in the file, or with the option named in the message",
        find_notes("assumption"),
    ),
    LintRule(
        "ignored",
        "warning",
        "content that the reader leaves out",
        "No result takes it into account.",
        "remove it, or correct the name in it",
        _left_out,
    ),
    LintRule(
        "closure-unread",
        "warning",
        "a possible loop closure that is not read",
        "Simulator plugins and elements that connect links, but with incomplete data.",
        "close the loop with the option in the message",
        _unread,
    ),
    LintRule(
        "closure-locks",
        "warning",
        "a closure that locks its loop",
        "No joint of the loop can move. Tools write rigid (6D) closures for revolute and spherical joints.",
        "close the loop with the option in the message, or with the joint that the robot has: --close A:B:TYPE",
        find_notes("open", text="the closure .* locks"),
    ),
    LintRule(
        "merged",
        "note",
        "elements that are read as an equivalent",
        "Closures and joints that are equivalent to one joint are read as that joint, and relations that hold up to "
        "printed digits are corrected.",
        "nothing, if this is intended",
        find_notes("merged", text=rf"(?!{ROUNDED.pattern})"),
    ),
    LintRule(
        "zero-singular",
        "warning",
        "a singular zero configuration",
        "Ranks there differ from those nearby: motors are at a dead point, or the loops gain mobility. "
        "hrsynth uses a nearby configuration as zero.",
        "choose another zero configuration (hrsynth convert writes the one in use)",
        find_notes("solved", text="the zero configuration"),
    ),
)
