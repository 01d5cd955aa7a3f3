"""Content without effect: elements and attributes that the format does not have, observed links that are in no leg."""

from __future__ import annotations

from collections.abc import Iterator

from ...description import formats
from ...errors import BadRobotFile, HrsynthError
from ...mechanism.legs import decompose
from ...mechanism.normal import reduce_to_normal_form
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile, list_defects


def _find_unknown(file: LintedFile) -> Iterator[RuleHit]:
    if file.root is None or file.dialect is None:
        return
    for each in formats.get_vocabulary(file.dialect).unknown(file.root):
        near, severity = each.remedy, "error" if each.meant else "warning" if each.remedy else None
        yield RuleHit(
            each.line,
            f"unknown {each.place}: got {each.found}{near and f', similar to {near}'}",
            advice=near and f"write {near}",
            severity=severity,
        )


def _find_leg_errors(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if file.refusal is not None or robot is None or not robot.observations:
        return
    try:
        decompose(reduce_to_normal_form(robot).mechanism)
    except BadRobotFile as error:
        for line, text in list_defects(error):
            yield RuleHit(line, text)
    except HrsynthError:  # reported by other rules, or by the analyses that need legs
        return


RULES = (
    LintRule(
        "element-unknown",
        "note",
        "an element or attribute that the format does not have",
        "Most readers ignore it silently and use the default of the intended name: an axis along "
        "x, no motor, no limit. hrsynth refuses one that is a misspelling (an error).",
        "nothing, if another program reads it",
        _find_unknown,
    ),
    LintRule(
        "observe-legs",
        "error",
        "observed directions that contradict the robot's legs",
        "A link that is in no leg, one label for two legs, two labels for one: the file is read, but commands "
        "that observe legs refuse it.",
        "correct the link or label named in the message",
        _find_leg_errors,
    ),
)
