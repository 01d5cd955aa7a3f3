"""The certificate of a path, or of what separates two poses (docs/pages/certificates.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from ..analysis.aspects.path import PathAnswer, PathPlanner, plan_between_poses
from ..analysis.aspects.path_segments import StraightSegment
from ..analysis.aspects.vector_expressions import DerivedVector, LegVector, VectorExpression, collect_subchains
from ..analysis.aspects.verdicts import SEPARATED
from ..analysis.observed import ObservedRobot
from ..closed_forms.legs import ClosedFormLeg
from ..closed_forms.platform_points import PlatformPoint
from ..constraints.condition import NamedCondition
from ..errors import NoCertificate
from ..geometry.so3 import convert_from_quaternion, convert_to_quaternions
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from ..tolerances import HIDDEN_ROBOT_RESIDUAL_TOL
from .closures import write_numbers
from .verify_path import PathRejection, condition, digest, node, place, sign, verify

TWIST_PIVOT_MIN = 0.1
"""Smallest part along an axis of the base by which a vector of a platform's motions is scaled to one there."""
PATH_PIECES_MAX = 4096
"""Pieces into which a way is cut at most."""

Node = list[Any]
"""A pose in the coordinates of the platform's motions, as the checker reads it."""


def certificate(found: PathAnswer) -> dict[str, Any]:
    """The certificate of a proved answer; raises ``NoCertificate``."""
    name = found.setup.robot.name
    if not found.certified:
        raise NoCertificate(name, found.reason or "no path was proved")
    if not all(o.is_segment_direction for o in found.setup.observed):
        raise NoCertificate(name, "an observation is not the direction of a segment")
    aspects = PathPlanner.of(found.setup)
    assert not isinstance(aspects.pattern, str)
    assert isinstance(aspects.condition, NamedCondition)
    forms, motion = aspects.enclosure(found.start.configuration).forms, WrittenMotions.of(aspects)
    try:
        record = {
            "format": "hrsynth-certificate-1",
            "claim": "path",
            "robot": name,
            "verdict": found.verdict,
            "observed": [[o.leg, o.link] for o in found.setup.observed],
            "any_mode": found.any_mode,
            "start": found.start.pose.to_dict(),
            "goal": found.goal.pose.to_dict(),
            "motion": motion.to_dict(),
            "legs": [_leg(limb) for limb in forms.subchains],
            "modes": [list(map(int, forms.modes))],
            "vectors": {symbol: _vector(each) for symbol, each in sorted(forms.vectors.items())},
            "points": list(forms.points),
            "condition": _tree(aspects.condition.expression),
        }
        if found.verdict == SEPARATED:
            used = collect_subchains(tuple(forms.vectors.values()))
            record["modes"] += sorted(
                {
                    modes
                    for known in found.goal_modes
                    for modes in product(
                        *([int(mode)] if k in used or not found.any_mode else [-1, 1] for k, mode in enumerate(known))
                    )
                }
            )
            ends = aspects.pattern.coordinates.of([found.start.configuration, found.goal.configuration])
            record["path"] = [motion.node(p, R, None) for p, R in zip(*ends, strict=True)]
        else:
            ways = [way for way in found.segments if isinstance(way, StraightSegment)]
            record["path"] = _cut(record, motion, ways, len(found.segments))
        record["modes"] = [list(modes) for modes in record["modes"]]
        record["ends"] = [record["path"][0], record["path"][-1]]
        record["sha256"] = digest(record)
        verify(record)
    except PathRejection as reason:
        raise NoCertificate(name, str(reason)) from None
    return record


@dataclass(frozen=True, eq=False)
class WrittenMotions:
    """The motions of a platform as the checker reads them: its point starts from ``origin`` (3,) and moves ``along``
    vectors (k, 3), the platform turns from ``home``, a quaternion (4,), ``about`` axes (m, 3), m = 0, 1 or 3."""

    origin: Array
    along: Array
    home: Array
    about: Array

    @classmethod
    def of(cls, aspects: PathPlanner) -> WrittenMotions:
        """The motions that the robot shows."""
        assert not isinstance(aspects.pattern, str)
        coordinates = aspects.pattern.coordinates
        p, R = coordinates.of(aspects.members[:1])
        turns = coordinates.motion.rotations[:, : 3 * coordinates.turning]
        home = np.eye(4)[0] if turns.shape[1] == 3 else convert_to_quaternions(R[0])
        return cls(p[0], _reduced(coordinates.motion.translations.T), home, _reduced(turns.T))

    def node(self, p: Array, R: Array, before: Node | None) -> Node:
        """A pose, its quaternion on the side of the one before."""
        shift = np.linalg.lstsq(self.along.T, p - self.origin, rcond=None)[0]
        w, *v = convert_to_quaternions(R @ convert_from_quaternion(self.home).T)
        turn = np.array([w, *np.linalg.lstsq(self.about.T, np.array(v), rcond=None)[0]])
        if before is not None and sum(float(Fraction(x)) * y for x, y in zip(before[1], turn, strict=True)) < 0:
            turn = -turn
        return [write_numbers(shift), write_numbers(turn)]

    def to_dict(self) -> dict[str, Any]:
        """As the checker reads it."""
        return {key: write_numbers(getattr(self, key)) for key in ("origin", "along", "home", "about")}


def _reduced(rows: Array) -> Array:
    """The rows (k, 3) of a space's basis in echelon form, which depends on the space alone; numbers that are nearly
    whole are."""
    found, done = np.array(rows, dtype=float), 0
    for column in range(3):
        if done < len(found):
            best = done + int(np.argmax(np.abs(found[done:, column])))
            if abs(found[best, column]) > TWIST_PIVOT_MIN:
                found[[done, best]] = found[[best, done]]
                found[done] /= found[done, column]
                others = np.arange(len(found)) != done
                found[others] -= np.outer(found[others, column], found[done])
                done += 1
    return np.where(np.abs(found - np.round(found)) < HIDDEN_ROBOT_RESIDUAL_TOL, np.round(found), found)


def again(record: dict[str, Any], robot: Mechanism) -> dict[str, Any]:
    """Return the certificate of the same claim about a robot."""
    setup = ObservedRobot.of(robot, [link for _, link in record["observed"]])
    ends = [_pose(record[end]) for end in ("start", "goal")]
    return certificate(plan_between_poses(setup, ends, any_mode=bool(record["any_mode"])))


def _pose(record: dict[str, Any]) -> Pose:
    parts: dict[str, Any] = {
        part: tuple(value) if part == "rpy" else value for part, value in record.items() if value is not None
    }
    return Pose(**parts)


def _cut(record: dict[str, Any], motion: WrittenMotions, ways: Sequence[StraightSegment], count: int) -> list[Node]:
    """Poses along straight ways, so near to each other that the checker's intervals prove each piece."""
    if not ways or len(ways) < count:
        raise PathRejection("a leg changes its working mode along the path")

    def at(way: StraightSegment, fraction: float, before: Node | None) -> Node:
        p, R = way.at(np.array([fraction]))
        return motion.node(p[0], R[0], before)

    found = [at(ways[0], 0.0, None)]
    for way in ways:
        ends, low = [1.0], 0.0
        while ends:
            new = at(way, ends[-1], found[-1])
            if _is_proved(record, found[-1], new):
                found.append(new)
                low = ends.pop()
            elif len(found) + len(ends) > PATH_PIECES_MAX or ends[-1] - low < 1.0 / PATH_PIECES_MAX:
                raise PathRejection("too many short pieces for the checker's intervals")
            else:
                ends.append((low + ends[-1]) / 2)
    return found


def _is_proved(record: dict[str, Any], one: Node, other: Node) -> bool:
    try:
        motion = record["motion"]
        sign(condition(record, record["modes"][0], *place(motion, node(one, motion), node(other, motion))))
    except PathRejection:
        return False
    return True


def _leg(limb: ClosedFormLeg) -> dict[str, Any]:
    """A leg without its working mode."""
    if not limb.record:
        raise PathRejection("a leg of a kind that the checker does not support")
    kind, *names = limb.record
    numbers = {name: None if (value := getattr(limb, name)) is None else write_numbers(value) for name in names}
    return {"kind": kind, **numbers, "tip": _rule(limb.tip), "centre": write_numbers(limb.centre)}


def _rule(point: PlatformPoint) -> list[Any]:
    return [bool(point.follows), write_numbers(point.turned), write_numbers(point.constant)]


def _vector(each: VectorExpression | None) -> list[Any]:
    """A vector as the checker reads it."""
    if isinstance(each, PlatformPoint):
        return ["point", *_rule(each)]
    if isinstance(each, LegVector):
        return ["leg", each.limb, int(each.sense), write_numbers(each.offset)]
    assert isinstance(each, DerivedVector)
    return ["unit", _vector(each.start), _vector(each.end), None if each.axis is None else _vector(each.axis)]


def _tree(expression: Any) -> Any:
    """An expression in vectors as nested lists."""
    if expression.is_Symbol:
        return str(expression)
    if expression.is_Rational:
        return str(Fraction(int(expression.p), int(expression.q)))
    if expression.is_Add or expression.is_Mul:
        return ["+" if expression.is_Add else "*", *map(_tree, expression.args)]
    if expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        return ["*", *[_tree(expression.base)] * int(expression.exp)]
    if type(expression).__name__ in ("dot", "cross", "det"):
        return [type(expression).__name__, *map(_tree, expression.args)]
    raise PathRejection("the condition is not a vector expression")
