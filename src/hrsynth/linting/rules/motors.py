"""Motors of a file that do not move the platform, or more motors than its mobility."""

from __future__ import annotations

from collections.abc import Iterator

from ...mechanism.model import Mechanism
from ..findings import LintRule, RuleHit
from ..freedoms import Pair
from ..linted_file import LintedFile
from .loops import is_watched, sample_nearby


def _find_held_joints(robot: Mechanism) -> list[Pair]:
    return [joint.links for joint in robot.joints.values() if joint.is_actuated]


def _find_none(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is not None and not _find_held_joints(robot) and not is_watched(robot):
        yield RuleHit(None, "no joint has a motor")


def _find_too_few(file: LintedFile) -> Iterator[RuleHit]:
    robot, found = file.mechanism, sample_nearby(file)
    if robot is None or found is None or not _find_held_joints(robot) or robot.has_open_platform:
        return
    whole, rest = found.platform(), found.platform(_find_held_joints(robot))
    if whole and rest:
        yield RuleHit(None, f"with all motors locked, the platform {robot.platform!r} keeps {rest} of its {whole} dof")


def _find_too_many(file: LintedFile) -> Iterator[RuleHit]:
    robot, found = file.mechanism, sample_nearby(file)
    if robot is None or found is None or not _find_held_joints(robot):
        return
    driven = sum(joint.type.freedoms for joint in robot.joints.values() if joint.is_actuated)
    whole, rest = found.count(), found.count(held=_find_held_joints(robot))
    if whole is not None and rest is not None and driven > whole - rest:
        yield RuleHit(None, f"{driven} coordinates have motors, but only {whole - rest} of them are independent")


def _find_floating(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is None:
        return
    for name in robot.idle:
        if robot.joints[name].is_actuated:
            yield RuleHit(None, f"motor on the floating joint {name!r}, whose link other joints carry")


RULES = (
    LintRule(
        "motor-none",
        "note",
        "no motor",
        "The Type 2 singularities of the real robot depend on which joints have motors; URDF+ and plain URDF "
        "often do not name them.",
        "name them: a <transmission> for each, a <command_interface> in <ros2_control>, or --motors JOINTS",
        _find_none,
    ),
    LintRule(
        "motors-few",
        "warning",
        "motors that do not determine the platform",
        "With all motors locked the platform can still move, near the zero configuration.",
        "name the missing motor, or fix or actuate the free joint",
        _find_too_few,
    ),
    LintRule(
        "motors-many",
        "warning",
        "more coordinates with motors than the mobility",
        "Tools put an actuator on every joint, passive ones too. The motors then work against each other.",
        "remove the motors of passive joints, or name the motors: --motors JOINTS",
        _find_too_many,
    ),
    LintRule(
        "motor-floating",
        "error",
        "a motor on a floating joint whose link other joints carry",
        "The joint constrains nothing and has no coordinates of its own: commands that move the robot refuse the file.",
        "put motors on the joints that carry the link, and remove this one",
        _find_floating,
    ),
)
