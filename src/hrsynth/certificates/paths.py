"""The certificate of a path, or of what separates two poses (docs/pages/certificates.md)."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.aspects.path import Aspects, PathAnswer
from ..analysis.aspects.path import path as asked
from ..analysis.aspects.path_segments import StraightSegment
from ..analysis.aspects.vector_expressions import DerivedVector, LegVector, VectorExpression
from ..analysis.aspects.words import SEPARATED
from ..closed_forms.legs import ClosedFormLeg, OnCrank, OnRail, SlidingRod
from ..closed_forms.platform_points import PlatformPoint
from ..constraints.condition import Named
from ..errors import NoCertificate
from ..geometry.so3 import quaternions
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from .closures import write_numbers
from .verify_path import PathNotAccepted, condition, digest, interval, pose, sign, verify

PIECES = 4096
"""Pieces into which a way is cut at most."""

Node = list[Any]
"""A pose as the checker reads it: p (3,) and q (4,)."""


def certificate(found: PathAnswer) -> dict[str, Any]:
    """The certificate of a proved answer; raises ``NoCertificate``."""
    name = found.setting.robot.name
    if not found.certified:
        raise NoCertificate(name, found.reason or "no path was proved")
    if not all(o.by_segment for o in found.setting.observed):
        raise NoCertificate(name, "what is observed is not the direction of a segment")
    aspects = Aspects.of(found.setting)
    ends = [found.start, found.goal] if found.verdict == SEPARATED else [found.start]
    enclosures = [aspects.enclosure(end.configuration) for end in ends]
    assert isinstance(aspects.condition, Named)
    try:
        record = {"format": "hrsynth-certificate-1", "claim": "path", "robot": name, "verdict": found.verdict,
                  "observed": [[o.leg, o.link] for o in found.setting.observed],
                  "start": found.start.pose.to_dict(), "goal": found.goal.pose.to_dict(),
                  "legs": [[_leg(limb) for limb in each.forms.limbs] for each in enclosures],
                  "vectors": {symbol: _vector(each) for symbol, each in sorted(enclosures[0].forms.vectors.items())},
                  "points": list(enclosures[0].forms.points), "condition": _tree(aspects.condition.expression)}
        record["path"] = _separate(aspects, found) if found.verdict == SEPARATED else _cut(
            record, [way for way in found.ways if isinstance(way, StraightSegment)], len(found.ways))
        record["ends"] = [record["path"][0], record["path"][-1]]
        record["sha256"] = digest(record)
        verify(record)
    except PathNotAccepted as reason:
        raise NoCertificate(name, str(reason)) from None
    return record


def again(record: dict[str, Any], robot: Mechanism) -> dict[str, Any]:
    """The certificate of the same question about a robot."""
    start, goal = (_pose(record[end]) for end in ("start", "goal"))
    return certificate(asked(robot, [link for _, link in record["observed"]], start=start, goal=goal))


def _pose(record: dict[str, Any]) -> Pose:
    parts: dict[str, Any] = {part: tuple(value) if part == "rpy" else value for part, value in record.items()
                             if value is not None}
    return Pose(**parts)


def _cut(record: dict[str, Any], ways: Sequence[StraightSegment], count: int) -> list[Node]:
    """Poses along straight ways, so near to each other that the checker's intervals prove each piece."""
    if not ways or len(ways) < count:
        raise PathNotAccepted("a leg changes its working mode on the way")
    found = [_node(ways[0], 0.0, None)]
    for way in ways:
        ends, low = [1.0], 0.0
        while ends:
            new = _node(way, ends[-1], found[-1])
            if _is_proved(record, found[-1], new):
                found.append(new)
                low = ends.pop()
            elif len(found) + len(ends) > PIECES or ends[-1] - low < 1.0 / PIECES:
                raise PathNotAccepted("too many short pieces for the checker's intervals")
            else:
                ends.append((low + ends[-1]) / 2)
    return found


def _is_proved(record: dict[str, Any], one: Node, other: Node) -> bool:
    try:
        p, q = ([interval(x, y) for x, y in zip(*parts, strict=True)]
                for parts in zip(pose(one), pose(other), strict=True))
        sign(condition(record, record["legs"][0], p, q))
    except PathNotAccepted:
        return False
    return True


def _separate(aspects: Aspects, found: PathAnswer) -> list[Node]:
    """The two poses."""
    assert not isinstance(aspects.pattern, str)
    p, R = aspects.pattern.coordinates.of([found.start.configuration, found.goal.configuration])
    return [_write_node(*each, None) for each in zip(p, R, strict=True)]


def _node(way: StraightSegment, fraction: float, before: Node | None) -> Node:
    """A pose on a way, its quaternion on the side of the one before."""
    p, R = way.at(np.array([fraction]))
    return _write_node(p[0], R[0], before)


def _write_node(p: Array, R: Array, before: Node | None) -> Node:
    q = quaternions(R)
    if before is not None and sum(float(Fraction(x)) * float(y) for x, y in zip(before[1], q, strict=True)) < 0:
        q = -q
    return [write_numbers(p), write_numbers(q)]


def _leg(limb: ClosedFormLeg) -> dict[str, Any]:
    """A leg with its working mode."""
    found = {"mode": int(limb.mode), "tip": _rule(limb.tip), "centre": write_numbers(limb.centre)}
    if isinstance(limb, OnCrank):
        return {"kind": "crank", "axis": write_numbers(limb.axis), "radius": write_numbers(float(limb.radius)),
                "rod": write_numbers(float(limb.rod)), **found}
    if isinstance(limb, OnRail):
        return {"kind": "rail", "axis": write_numbers(limb.axis), "rod": write_numbers(float(limb.rod)), **found}
    if isinstance(limb, SlidingRod):
        return {"kind": "slide", "axis": None if limb.axis is None else write_numbers(limb.axis),
                "aside": write_numbers(float(limb.aside)), **found}
    raise PathNotAccepted("a leg of a kind that the checker does not know")


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
    raise PathNotAccepted("a condition that is not an expression in vectors")
