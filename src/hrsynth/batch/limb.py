"""Legs as known subproblems, recognised from their joints and verified at closed configurations.

The observed link is a rod from B to the leg's tip C on the platform; B is fixed in the base (the leg's length is free),
or lies on the circle or the line that the leg's first joint draws, at a fixed distance from C: circle-sphere or
line-sphere. A direction that never changes, or turns with the platform, needs neither. What is proposed counts only if
it gives the directions of all configurations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import partial

import numpy as np

from ..geometry.lines import foot
from ..geometry.vectors import Array, inverse
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.normal import centre_pair
from ..mechanism.observation import Direction
from ..tolerances import SAME_GEOMETRY
from .stage import Frames, Stage

DRIVING = (JointType.REVOLUTE, JointType.PRISMATIC)


class Kind(IntEnum):
    """What a leg's direction follows from."""

    CONSTANT = 0
    TURNING = 1
    DISTANCE = 2
    CIRCLE = 3
    LINE = 4


@dataclass(frozen=True, eq=False)
class Limb:
    """A leg as a subproblem: its tip is p + R b + c; B is ``centre`` (DISTANCE), on the circle of ``radius`` about
    (``centre``, ``axis``), or on the line through ``centre`` along ``axis``; |BC| = ``rod``; u = ``sense`` (C − B) /
    |BC|.

    ``side`` tells the two solutions apart (the working mode). TURNING: u = R ``axis``; where there is a ``radius``, B
    is on the circle about ``centre`` and on the line through the tip along u. CONSTANT: u = ``axis``.
    """

    label: str
    kind: Kind
    axis: Array = field(default_factory=lambda: np.zeros(3))
    b: Array = field(default_factory=lambda: np.zeros(3))
    c: Array = field(default_factory=lambda: np.zeros(3))
    centre: Array = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0
    rod: float = 0.0
    side: float = 1.0
    sense: float = 1.0
    crank: str = ""
    """The link that carries B, of CIRCLE and LINE."""
    place: Array = field(default_factory=lambda: np.zeros(3))
    """B at the zero configuration."""
    pivot: Array = field(default_factory=lambda: np.zeros(3))
    """The axis of the circle."""

    def row(self) -> Array:
        """The numbers of the subproblem, (16,): axis, b, c, centre, radius, rod, side, sense."""
        return np.concatenate([self.axis, self.b, self.c, self.centre,
                               [self.radius, self.rod, self.side, self.sense]])

    def tip(self, p: Array, R: Array) -> Array:
        """C at poses, (m, 3)."""
        return np.asarray(p + R @ self.b + self.c)


def recognised(anatomy: LegDecomposition, leg: Leg, seen: Direction, stage: Stage, frames: Frames) -> Limb | None:
    """The subproblem that the leg is, or None; ``seen`` is the direction observed in it."""
    X = frames[anatomy.mechanism.platform]
    p, R = stage.place(X)
    u = frames[seen.link][:, :3, :3] @ seen.direction
    for limb in _candidates(anatomy, leg, stage, frames, p, R, u):
        if limb is not None and _holds(limb, p, R, u):
            fixed = not stage.spins.shape[1] and limb.kind is not Kind.TURNING
            return replace(limb, b=np.zeros(3), c=R[0] @ limb.b + limb.c) if fixed else limb
    return None


def _holds(limb: Limb, p: Array, R: Array, u: Array) -> bool:
    from .plain import Poses, rod, turning

    if limb.kind is Kind.CONSTANT:
        return bool(np.max(np.abs(u - limb.axis)) <= SAME_GEOMETRY)
    if limb.kind is Kind.TURNING:
        return bool(np.max(np.abs(u - R @ limb.axis)) <= SAME_GEOMETRY) and bool(
            np.all(turning(limb, Poses.of(p, R))[1]))
    poses = Poses.of(p, R)
    errors = []
    for side in (limb.side, -limb.side):
        found = rod(replace(limb, side=side), poses)
        errors.append(np.where(found.reached, np.max(np.abs(found.u.T - u), axis=1), np.inf))
    return bool(errors[0][0] <= 10 * SAME_GEOMETRY and np.all(np.min(errors, axis=0) <= 10 * SAME_GEOMETRY))


def _candidates(anatomy: LegDecomposition, leg: Leg, stage: Stage, frames: Frames, p: Array, R: Array, u: Array
                ) -> Iterator[Limb | None]:
    mechanism = anatomy.mechanism
    joints = [mechanism.joints[name] for name in leg.joints]
    feet = [joint for joint in joints if mechanism.base in joint.links]
    if sum(joint.type.slides for joint in joints) >= 2:
        yield Limb(leg.label, Kind.CONSTANT, u[0])
        yield Limb(leg.label, Kind.TURNING, R[0].T @ u[0])
    if leg.takes_platform:
        yield Limb(leg.label, Kind.TURNING, R[0].T @ u[0])
    for one in feet:
        for joint in joints:
            yield _crossing(anatomy, leg, stage, one, joint, frames, R, u)
    for tip, ends in _tips(anatomy, leg, stage):
        for one in feet:
            for start in dict.fromkeys(map(tuple, (one.point, ends(one)[0]))):
                yield _spring(leg.label, tip(ends(one)[1]), np.array(start), p, R, u)
        for one in feet:
            crank = one.other(mechanism.base)
            for joint in joints:
                if joint is one or crank not in joint.links or one.type not in DRIVING:
                    continue
                near, far = ends(joint)
                start = tip(far)
                C = (p + R @ start[0] + start[1])[0]
                for place in (near, joint.point):
                    yield _crank(leg.label, start, one, crank, place, displacement(frames, mechanism, crank), C, u[0])


Place = Callable[[Array], tuple[Array, Array]]
Centres = Callable[[Joint], tuple[Array, Array]]


def _tips(anatomy: LegDecomposition, leg: Leg, stage: Stage) -> Iterator[tuple[Place, Centres]]:
    """For each joint on the platform: what makes (b, c) of a point of it, and what gives the centres of another joint
    and of this one, as a segment sees them."""
    mechanism = anatomy.mechanism
    if anatomy.point is not None:
        frame = mechanism.links[mechanism.platform].pose
        place = frame[:3, :3] @ anatomy.point + frame[:3, 3]
        end = mechanism.joints_of(mechanism.platform)[0]
        yield (lambda point: (np.zeros(3), point - place)), (lambda other: centre_pair(other, end))
        return
    body = stage.bodies.get(leg.attach)
    if body is None:
        return
    to_body = inverse(mechanism.links[leg.attach].pose)
    for name in leg.joints:
        if leg.attach in mechanism.joints[name].links:
            yield ((lambda point: body.point(to_body[:3, :3] @ point + to_body[:3, 3])),
                   partial(_centres, mechanism.joints[name]))


def _centres(tip: Joint, other: Joint) -> tuple[Array, Array]:
    return centre_pair(other, tip)


def displacement(frames: Frames, mechanism: Mechanism, link: str) -> Array:
    """The motion (4, 4) of a link from the zero configuration to the first one."""
    return frames[link][0] @ inverse(mechanism.links[link].pose)


def _crossing(anatomy: LegDecomposition, leg: Leg, stage: Stage, first: Joint, second: Joint, frames: Frames, R: Array,
              u: Array) -> Limb | None:
    """A crank whose end slides along a line of the platform: an R at the base, an R, a P."""
    mechanism, body = anatomy.mechanism, stage.bodies.get(leg.attach)
    kinds = "".join(mechanism.joints[name].type.value for name in leg.joints)
    crank = first.other(mechanism.base)
    if body is None or sorted(kinds) != ["P", "R", "R"] or first is second or {first.type, second.type} != {
            JointType.REVOLUTE} or crank not in second.links or not body.turns:
        return None

    def moved(link: str) -> Array:
        X = displacement(frames, mechanism, link)
        return np.asarray(X[:3, :3] @ second.point + X[:3, 3])

    B, tip = moved(crank), body.point(inverse(mechanism.links[leg.attach].pose)[:3] @ np.append(second.point, 1.0))
    C = moved(leg.attach)
    centre = foot(second.point, first.point, first.axis)
    if np.linalg.norm(np.cross(B - C, u[0])) > SAME_GEOMETRY * mechanism.length:
        return None
    radius = float(np.linalg.norm(second.point - centre))
    return Limb(leg.label, Kind.TURNING, R[0].T @ u[0], *tip, centre=centre, radius=radius, crank=crank,
                place=second.point, pivot=first.axis, side=_sign(float((B - centre) @ u[0])))


def _spring(label: str, tip: tuple[Array, Array], start: Array, p: Array, R: Array, u: Array) -> Limb:
    limb = Limb(label, Kind.DISTANCE, b=tip[0], c=tip[1], centre=start)
    return replace(limb, sense=_sign(float((limb.tip(p, R)[0] - start) @ u[0])))


def _crank(label: str, tip: tuple[Array, Array], first: Joint, crank: str, place: Array, moved: Array, C: Array,
           u: Array) -> Limb | None:
    """The rod to C from the point that was at ``place`` on the link that the leg's first joint carries; C, u and the
    link's displacement are those of the first configuration."""
    B = moved[:3, :3] @ place + moved[:3, 3]
    rod = float(np.linalg.norm(C - B))
    if rod == 0:
        return None
    limb = Limb(label, Kind.LINE, first.axis, *tip, centre=place, rod=rod, sense=_sign(float((C - B) @ u)),
                crank=crank, place=place)
    if first.type is JointType.PRISMATIC:
        return replace(limb, side=_sign(float((C - B) @ first.axis)))
    centre = foot(place, first.point, first.axis)
    radius = float(np.linalg.norm(place - centre))
    return replace(limb, kind=Kind.CIRCLE, centre=centre, pivot=first.axis, radius=radius,
                   side=_sign(float(np.cross(first.axis, C - centre) @ (B - centre))))


def _sign(value: float) -> float:
    return -1.0 if value < 0 else 1.0
