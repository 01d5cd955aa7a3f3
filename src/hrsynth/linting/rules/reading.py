"""What the readers of this program refuse, guess, solve and leave out, as findings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from ...errors import BadRequest, LoopsNotClosed
from ...tolerances import NOISE
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile, defects_of
from .geometry import ROUNDED


def _refused(file: LintedFile) -> Iterator[RuleHit]:
    error = file.refusal
    if error is None or isinstance(error, BadRequest):
        return
    if isinstance(error, LoopsNotClosed) and error.residual > NOISE:  # a rule of its own tells it
        return
    for line, text in defects_of(error):
        yield RuleHit(line, text)


def _asks(file: LintedFile) -> Iterator[RuleHit]:
    if isinstance(file.refusal, BadRequest):
        yield RuleHit(None, " ".join(str(file.refusal).removeprefix(f"{file.file}: ").split()))
    elif file.mechanism is not None and file.mechanism.open_platform:
        yield RuleHit(None, str(file.mechanism.choice))


def find_notes(*kinds: str, text: str = "") -> Callable[[LintedFile], Iterator[RuleHit]]:
    """What finds the reader's notes of some kinds whose text begins with a pattern."""

    def find(file: LintedFile) -> Iterator[RuleHit]:
        robot = file.mechanism
        for note in () if robot is None else robot.notes:
            if note.kind in kinds and re.match(text, note.text):
                yield RuleHit(None, note.text)

    return find


_unread = find_notes("open", text=r"(?!\d+ coordinates are driven|the robot's char|nothing in the file closes)")
_left_out = find_notes("ignored", text=r"(?!\d+ links that no joint|unknown (element|attribute))")  # they have rules


RULES = (
    LintRule(
        "refused",
        "error",
        "what this program refuses to read",
        "Every command answers this file with this message.",
        "correct what the message says",
        _refused,
    ),
    LintRule(
        "unsaid",
        "warning",
        "what the file does not say, and its structure does not show",
        "Commands need it as an option.",
        "give the option named in the message",
        _asks,
    ),
    LintRule(
        "guessed",
        "note",
        "what the file does not say, guessed from its structure",
        "A guess is made only where the structure leaves one choice; the answer still depends on it.",
        "say it in the file, or with the option named in the message",
        find_notes("assumption"),
    ),
    LintRule(
        "ignored",
        "warning",
        "what the reader leaves out",
        "No answer takes it into account.",
        "remove it, or correct the name that it gives",
        _left_out,
    ),
    LintRule(
        "closure-unread",
        "warning",
        "what may close a loop and is not read",
        "Simulator plugins and elements that hold links together, but about which the file does not say enough.",
        "close the loop as the message says",
        _unread,
    ),
    LintRule(
        "merged",
        "note",
        "what is read as something else",
        "Closures and joints that stand for one joint are read as that joint, and relations that hold up to "
        "printed digits are corrected.",
        "nothing, if that is intended",
        find_notes("merged", text=rf"(?!{ROUNDED.pattern})"),
    ),
    LintRule(
        "zero-singular",
        "warning",
        "a singular zero configuration",
        "Ranks at that pose differ from those nearby: motors are at a dead point, or the loops gain a freedom. "
        "This program uses a nearby pose as zero.",
        "choose another zero configuration (hrsynth convert writes the one that is used)",
        find_notes("solved", text="the zero pose"),
    ),
)
