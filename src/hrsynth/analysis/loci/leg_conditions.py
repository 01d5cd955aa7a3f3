"""The conditions of a leg on a rigid platform, from its joints: one list a branch."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...constraints.pattern import list_leg_ends
from ...errors import UnsupportedLocus
from ...geometry import lines
from ...geometry.loci import Circle, Line, Plane, Point, Quadrics, Reach, Revolution, Sphere, SweptCircle
from ...geometry.ranks import compute_range_basis
from ...geometry.vectors import Array, build_plane_axes
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.locked_twists import carry_joint, compute_leg_twists
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import JointType, Observation
from ...mechanism.composites import WordEdge
from ...mechanism.legs import Leg, LegDecomposition
from ...mechanism.notation import Rods
from ...mechanism.observations.direction import Direction
from ...solving.platform.pose_conditions import (
    AtAngle,
    Coplanar,
    OnCylinder,
    OnMovingPlane,
    OnMovingRevolution,
    OnPlane,
    OnRevolution,
    OnTwoCircles,
    PoseCondition,
)
from ...tolerances import CHAIN_ROUNDING, POINT_DISTANCE_TOL, RELATION_ANGLE_TOL
from ..measured import MeasuredRobot
from .leg_orientations import Known, find_one_axis, find_two_axes, group_axes, list_orientations
from .loci_from_joints import compare_reaches, place
from .locked_chain import Chain, ChainBody, LocusDerivationFailure, build_chain

Branches = list[list[PoseCondition]]
_Read = tuple[Branches, float]
"""Branches, and how far radii were moved that count as zero (m)."""
_Reading = Callable[..., _Read]


@dataclass(frozen=True, eq=False)
class OriginAndUnit:
    """Origin (m) and unit (m) of lengths."""

    origin: Array
    size: float

    def point(self, at: Array) -> Array:
        """A point in these units."""
        return np.asarray((at - self.origin) / self.size)


def require_rigid_platform(measured: MeasuredRobot, goal: ClosedConfiguration) -> tuple[str, OriginAndUnit]:
    """The one body on which all legs end, and lengths from where it is at the goal. Raises ``UnsupportedLocus``."""
    decomposition = measured.setup.decomposition
    bodies = list_leg_ends(decomposition)
    if len(bodies) != 1 or decomposition.point is not None or decomposition.mechanism.couplings:
        raise UnsupportedLocus(
            measured.setup.robot.name, "its platform is not one rigid body whose pose the legs determine"
        )
    return bodies[0], OriginAndUnit(goal.pose(bodies[0])[:3, 3], goal.model.length)


def list_leg_conditions(
    decomposition: LegDecomposition,
    leg: Leg,
    observation_model: ObservationModel,
    goal: ClosedConfiguration,
    middle: OriginAndUnit,
    plane: Array | None = None,
    kept: bool = False,
) -> tuple[Branches, float]:
    """Return all leg solutions of the conditions of a locked leg on the platform, the goal's own first; and how far its
    geometry was moved (m). ``plane``: the normal of a motion in a plane; ``kept``: True if the platform does not
    rotate. Raises ``UnsupportedLocus``."""
    observed = [o for o in observation_model.observations if o.leg == leg.label]
    twists = compute_leg_twists(goal, leg, observed, observation_model.reference)
    count = (6 if plane is None else 3) - twists.shape[1]
    if kept:
        count = 3 - twists.shape[1] + compute_range_basis(twists[3:], 1.0)[1].value
    if count <= 0:
        return [[]], 0.0
    path = decomposition.path(leg)
    rods = _Rods.of(decomposition, path[-1], observed, goal)
    reasons = []
    for tip in _list_tips(decomposition, path, goal) if rods is None else (rods.tip,):
        try:
            chain = build_chain(decomposition, leg, observed, goal, tip, "free")
            ways: list[tuple[_Reading, Chain]] = [
                (partial(_restrict_tip, rods=rods), chain),
                (_restrict_foot, chain),
                (_read_in_plane, chain),
            ]
            if kept:
                ways = [(_restrict_tip, replace(chain, kept=True))]
            elif plane is not None:
                bodies = (*chain.bodies, ChainBody(plane, tip))
                ways = [(_restrict_tip, replace(chain, bodies=bodies, kept=True)), (_restrict_foot, chain)]
            for read, part in ways:
                try:
                    branches, radii = read(leg.label, part, count, tip, middle, plane)
                    return branches, chain.moved + (radii if radii > CHAIN_ROUNDING * chain.extent else 0.0)
                except LocusDerivationFailure as error:
                    reasons.append(str(error))
        except LocusDerivationFailure as error:
            reasons.append(str(error))
    raise UnsupportedLocus(
        decomposition.mechanism.name,
        f"the conditions of leg {leg.label} on the platform are not known: {'; '.join(dict.fromkeys(reasons))}",
    )


def _list_tips(decomposition: LegDecomposition, path: Sequence[WordEdge], goal: ClosedConfiguration) -> Iterator[Array]:
    """The centre of the last joint (m), and where its axis meets those of other joints: about these a leg turns."""
    joints = [decomposition.mechanism.joints[name] for edge in path for name in edge.joints]
    *others, (end, axes) = (carry_joint(decomposition.mechanism, joint, goal.pose) for joint in joints)
    yield end
    if joints[-1].type is JointType.REVOLUTE:
        met = (
            lines.find_meeting_point([(end, axes[0]), (at, axis)], POINT_DISTANCE_TOL * goal.model.length)
            for at, directions in others
            for axis in directions
            if not lines.is_parallel(axes[0], axis)
        )
        yield from (at for at in met if at is not None)


@dataclass(frozen=True, eq=False)
class _Rods:
    """Equal rods at the end of a leg: the ``tip`` of the observed one, the vector ``along`` it, and those ``across`` to
    the others, where they start and where they end (m)."""

    tip: Array
    along: Array
    across: tuple[tuple[Array, Array], ...]

    @classmethod
    def of(
        cls, decomposition: LegDecomposition, edge: WordEdge, own: Sequence[Observation], goal: ClosedConfiguration
    ) -> _Rods | None:
        """Return the rods of the last part of a leg, if it is of such rods."""
        if not isinstance(edge.word.items[0], Rods) or len(edge.joints) < 4:
            return None
        observed = {o.link for o in own if isinstance(o, Direction)}
        number = next((k for k, link in enumerate(edge.inside) if link in observed), 0)
        ends = [
            [
                carry_joint(decomposition.mechanism, decomposition.mechanism.joints[name], goal.pose)[0]
                for name in edge.joints[k : k + 2]
            ]
            for k in range(0, len(edge.joints), 2)
        ]
        ends = [pair if edge.joints and edge.head in decomposition.platform else pair[::-1] for pair in ends]
        near, far = ends[number]
        others = [pair for k, pair in enumerate(ends) if k != number]
        return cls(far, far - near, tuple((start - near, end - far) for start, end in others))

    def turns(self, found: Chain, known: Known) -> list[tuple[Array, Array, float]]:
        """With v along a rod, e and f across to another where they start and end, |v + R f - e| = |v| and |e| = |f|:
        (v - e) · R f = v · e - e · e, where what carries the rods keeps e."""
        carrier = len(found.bodies) - 3
        Q, axis = known[carrier], found.bodies[carrier].axis
        if Q is None and (axis is None or known[carrier - 1] is None):
            raise LocusDerivationFailure("the link that carries its rods rotates")
        if (Q is not None and np.abs(Q - np.eye(3)).max() > RELATION_ANGLE_TOL) or any(
            Q is None and axis is not None and not lines.is_parallel(e / np.linalg.norm(e), axis)
            for e, _ in self.across
        ):
            raise LocusDerivationFailure("the link that carries its rods rotates them")
        if any(abs(float(e @ e - f @ f)) > RELATION_ANGLE_TOL * found.length**2 for e, f in self.across):
            raise LocusDerivationFailure("its rods are not those of a parallelogram")
        return [
            ((self.along - e) / found.length, f / found.length, float((self.along - e) @ e) / found.length**2)
            for e, f in self.across
        ]


def _restrict_tip(
    leg: str,
    found: Chain,
    count: int,
    tip: Array,
    middle: OriginAndUnit,
    plane: Array | None,
    rods: _Rods | None = None,
) -> _Read:
    """A tip that is confined, and angles that are kept."""
    seen: list[tuple[Reach | Quadrics, list[tuple[Array, Array, float]]]] = []
    moved = 0.0
    for known, _ in list_orientations(found):
        reach, radii = place(found, known)
        moved = max(moved, radii)
        turns: list[tuple[Array, Array, float]] = []
        missing = count - ((3 if plane is None else 2) - reach.freedoms)
        if rods is not None and missing == len(rods.across):
            turns = rods.turns(found, known)
        elif missing == 1:
            turns = [_keep_angle(reach, *find_two_axes(found, known))]
        elif missing == 2:
            d, c = find_one_axis(found, known)
            turns = [*((a, c, 0.0) for a in build_plane_axes(d)), (d, c, 1.0)]
        elif missing:
            raise LocusDerivationFailure(f"{missing} conditions on the platform's rotation")
        if not any(
            _is_same_locus(reach, known_reach, found.length) and _has_same_rotations(turns, others)
            for known_reach, others in seen
        ):
            seen.append((reach, turns))
    b = middle.point(tip)
    return [
        [*_list_reach_conditions(leg, reach, tip, middle, plane), *(AtAngle(leg, b, c, a, h) for a, c, h in turns)]
        for reach, turns in seen
    ], moved


def _is_same_locus(one: Reach | Quadrics, other: Reach | Quadrics, length: float) -> bool:
    return compare_reaches(one, other, length) <= RELATION_ANGLE_TOL


def _keep_angle(reach: Reach | Quadrics, a: Array, c: Array, own: Array) -> tuple[Array, Array, float]:
    """a · R c = h, h that of the leg's own axes; a is exactly the direction of the tip's line where along that."""
    if isinstance(reach, Line) and lines.is_parallel(a, reach.direction):
        a = reach.direction * np.sign(a @ reach.direction)
    return a, c, float(own @ c)


def _has_same_rotations(one: list[tuple[Array, Array, float]], other: list[tuple[Array, Array, float]]) -> bool:
    return all(
        any(
            bool(np.abs(s * a - b).max() <= RELATION_ANGLE_TOL and np.abs(c - d).max() <= RELATION_ANGLE_TOL)
            and abs(s * h - k) <= RELATION_ANGLE_TOL
            for s in (1, -1)
        )
        for (a, c, h), (b, d, k) in zip(one, other, strict=True)
    )


def _list_reach_conditions(
    leg: str, reach: Reach | Quadrics, tip: Array, middle: OriginAndUnit, plane: Array | None
) -> list[PoseCondition]:
    """The conditions that a tip is within its reach."""
    b, none, o = middle.point(tip), np.zeros(3), middle.point(reach.centre)
    if plane is not None:
        return _restrict_in_motion(leg, reach, b, o, plane, middle)
    flat: list[Array] = []
    if isinstance(reach, Point):
        flat = list(np.eye(3))
    elif isinstance(reach, Line):
        flat = _list_normals(reach.direction)
    elif isinstance(reach, Plane):
        flat = [reach.normal]
    elif isinstance(reach, Circle):
        flat = [reach.axis]
    conditions: list[PoseCondition] = [OnPlane(leg, b, none, n, float(n @ o)) for n in flat]
    if isinstance(reach, Circle | Sphere):
        conditions.append(
            OnRevolution(
                leg, b, none, o, np.array([0.0, 0.0, 1.0]), np.array([(reach.radius / middle.size) ** 2, 0.0, -1.0])
            )
        )
    if isinstance(reach, Revolution):
        conditions.append(OnRevolution(leg, b, none, o, reach.axis, _scale_profile(reach, middle)))
    if isinstance(reach, SweptCircle):
        r, s = (np.array(radius / middle.size) for radius in (reach.radius, reach.other))
        conditions.append(
            OnTwoCircles(leg, b, none, o, reach.axis, r, reach.direction, s)
            if reach.other
            else OnCylinder(leg, b, none, o, reach.axis, r, reach.direction)
        )
    return conditions


def _list_normals(d: Array) -> list[Array]:
    """Two vectors normal to d, exactly."""
    skip = int(np.argmax(np.abs(d)))
    return [np.cross(d, e) for k, e in enumerate(np.eye(3)) if k != skip]


def _restrict_in_motion(
    leg: str, reach: Reach | Quadrics, b: Array, o: Array, n: Array, middle: OriginAndUnit
) -> list[PoseCondition]:
    """Return the conditions in a plane with the normal n, at any height."""
    none = np.zeros(3)
    if isinstance(reach, Point):
        return [OnPlane(leg, b, none, v, float(v @ o)) for v in _list_normals(n)]
    if isinstance(reach, Line):
        v = np.cross(n, reach.direction)
        return [OnPlane(leg, b, none, v, float(v @ o))]
    if isinstance(reach, Circle):
        return [OnRevolution(leg, b, none, o, n, np.array([(reach.radius / middle.size) ** 2, 0.0, 0.0]))]
    raise LocusDerivationFailure(f"a {type(reach).__name__.lower()} in a plane")


def _scale_profile(reach: Revolution, middle: OriginAndUnit) -> Array:
    return np.array(reach.profile) / [middle.size**2, middle.size, 1.0]


def _restrict_foot(leg: str, found: Chain, count: int, tip: Array, middle: OriginAndUnit, plane: Array | None) -> _Read:
    """Return the conditions of a point of the base that is confined in the platform's frame, by the part after the last
    fixed link."""
    seen: list[tuple[Reach | Quadrics, Array]] = []
    moved = 0.0
    for known, _ in list_orientations(found):
        foot, rest = reverse_chain(found, known)
        for turned, _ in list_orientations(rest):
            reach, radii = place(rest, turned)
            moved = max(moved, radii)
            if (3 if plane is None else 2) - reach.freedoms != count:
                raise LocusDerivationFailure("its proximal centre and its rotation of the platform")
            if not any(
                _is_same_locus(reach, known_reach, found.length)
                and np.linalg.norm(foot - at) <= RELATION_ANGLE_TOL * found.length
                for known_reach, at in seen
            ):
                seen.append((reach, foot))
    return [_list_foot_conditions(leg, reach, foot, middle, plane) for reach, foot in seen], moved


def _list_foot_conditions(
    leg: str, reach: Reach | Quadrics, foot: Array, middle: OriginAndUnit, plane: Array | None
) -> list[PoseCondition]:
    o, b, none = middle.point(foot), middle.point(reach.centre), np.zeros(3)
    if isinstance(reach, Revolution):
        return [OnMovingRevolution(leg, b, reach.axis, o, _scale_profile(reach, middle))]
    if isinstance(reach, Plane):
        return [OnMovingPlane(leg, b, reach.normal, o, 0.0)]
    if isinstance(reach, Line):
        across = _list_normals(reach.direction) if plane is None else [np.cross(plane, reach.direction)]
        return [OnMovingPlane(leg, b, n, o, 0.0) for n in across]
    if isinstance(reach, Circle) and plane is not None:
        return _restrict_in_motion(leg, reach, b, o, plane, middle)
    if isinstance(reach, Circle | Sphere):
        ball = OnRevolution(
            leg, b, none, o, np.array([0.0, 0.0, 1.0]), np.array([(reach.radius / middle.size) ** 2, 0.0, -1.0])
        )
        return [*([OnMovingPlane(leg, b, reach.axis, o, 0.0)] if isinstance(reach, Circle) else []), ball]
    raise LocusDerivationFailure(f"a {type(reach).__name__.lower()} of the platform that contains its proximal centre")


def reverse_chain(found: Chain, known: Known) -> tuple[Array, Chain]:
    """Return the proximal centre (m), the place of the part after the last link of known orientation, and the chain
    from the platform to it. Raises :class:`LocusDerivationFailure` if it contains an observation."""
    last = max(k for k, Q in enumerate(known) if Q is not None)
    bodies = found.bodies[last:]
    if (
        any(body.cranks or body.observed or body.angles for body in bodies[1:])
        or len(bodies) < 2
        or any(body.slides or body.cranks for body in found.bodies[: last + 1])
    ):
        raise LocusDerivationFailure("an observation or a carried link keeps it from being read from the platform")
    foot = found.bodies[0].point + sum(
        (Q @ body.shift for Q, body in zip(known[: last + 1], found.bodies, strict=False) if Q is not None), np.zeros(3)
    )
    if any(Q is None for Q in known[:last]):
        raise LocusDerivationFailure("a link that rotates before its proximal centre")
    end = bodies[-1]
    new = [ChainBody(None, end.point + end.shift, -end.shift, end.slides)]
    for before, after in zip(bodies[-2::-1], bodies[:0:-1], strict=True):
        new.append(ChainBody(after.axis, after.point, -before.shift, before.slides))
    new[-1] = ChainBody(new[-1].axis, new[-1].point, np.zeros(3))
    return foot, Chain(tuple(new), False, found.length, found.off)


def _read_in_plane(leg: str, found: Chain, count: int, tip: Array, middle: OriginAndUnit, plane: Array | None) -> _Read:
    """An axis t through the proximal centre, axes n normal to it between which all is in a plane, and an axis c through
    the tip normal to those: t, the line to the tip and c are in one plane."""
    bodies = found.bodies
    if (
        count != 1
        or any(body.observed or body.angles or body.cranks for body in bodies)
        or bodies[0].slides
        or any(body.axis is None for body in bodies[1:])
    ):
        raise LocusDerivationFailure("another chain of axes")
    parts = group_axes([(k, body.axis) for k, body in enumerate(found.bodies) if body.axis is not None])
    if [len(part) for part in parts] != [1, 2, 1]:
        raise LocusDerivationFailure("another chain of axes")
    (_, t), n, (_, c) = parts[0][0], parts[1][0][1], parts[2][0]
    first, *inner, last = found.bodies[1:]
    flat = [first.shift, *(v for body in (first, *inner) for v in body.slides), *(body.shift for body in inner)]
    small = RELATION_ANGLE_TOL * found.length
    if (
        not lines.is_perpendicular(n, t)
        or not lines.is_perpendicular(n, c)
        or any(abs(float(n @ v)) > small for v in flat)
        or np.linalg.norm(first.shift) > small
        or first.slides
        or last.slides
        or np.linalg.norm(last.shift) > small
        or sum(len(body.slides) for body in inner) != 1
    ):
        raise LocusDerivationFailure("axes that are not normal to each other")
    return [[Coplanar(leg, middle.point(tip), c, middle.point(first.point), t)]], 0.0
