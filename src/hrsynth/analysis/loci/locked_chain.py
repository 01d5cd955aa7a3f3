"""A leg with its measurements held, read from its joints: bodies that turn one against the next, and what they carry.

All directions and points are those at the configuration whose measurements are held (the goal), in the base frame (m);
the orientation Q of a body is counted from there. So Q_i = Q_{i-1} R(a_i, θ_i), with a_i the axis at the goal, and the
leg's end is at p₁ + Σ Q_i w_i plus what slides. A planar parallelogram carries a body without turning it; parallel rods
are one rod. A joint that a motor holds joins two bodies to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np

from ...geometry import lines
from ...geometry.screws import find_normals
from ...geometry.vectors import Array, cross, normalise_vector
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.locked_twists import carry_joint
from ...mechanism import Joint, JointType, Observation
from ...mechanism.composites import WordEdge
from ...mechanism.legs import Leg, LegDecomposition
from ...mechanism.notation import Rods
from ...mechanism.observations.direction import Direction
from ...mechanism.observations.encoder import Encoder
from ...tolerances import CHAIN_ROUNDING, DIRECTION_SINE_TOL, POINT_DISTANCE_TOL, RANK_GAP_MIN


class LocusDerivationFailure(Exception):
    """Locus of a locked leg's end that is not derived from its joints by the known laws; the text is the reason."""


@dataclass(frozen=True, eq=False)
class Crank:
    """Crank of a parallelogram on a link: its axis, from pivot to pivot, the observed directions in it, and whether a
    motor fixes it."""

    axis: Array
    vector: Array
    observed: tuple[Array, ...] = ()
    held: bool = False


@dataclass(frozen=True, eq=False)
class ChainBody:
    """A body that turns against the one before about ``axis`` (None: about all, in a ball; the base: not at all).

    ``point`` is on that axis; ``shift`` leads from there to the next body's, cranks left out; ``slides`` are directions
    fixed in it along which it carries the next part; ``observed`` those that are fixed.
    """

    axis: Array | None
    point: Array
    shift: Array = field(default_factory=lambda: np.zeros(3))
    slides: tuple[Array, ...] = ()
    cranks: tuple[Crank, ...] = ()
    observed: tuple[Array, ...] = ()
    angles: tuple[tuple[float, float], ...] = ()
    """The angles about the axis that a drive leaves to it, each with what it makes of an error; none if it is free."""

    @property
    def is_rigid(self) -> bool:
        """True if the next part is fixed in it."""
        return not self.slides and not self.cranks


@dataclass(frozen=True, eq=False)
class Chain:
    """The bodies from the base to the leg's end, the base first; the end's ``tip`` is at the last one's shift.

    ``kept``: whether the last body keeps the orientation that it has at the goal; ``length`` is the robot's.
    """

    bodies: tuple[ChainBody, ...]
    kept: bool
    length: float
    off: float = 0.0
    """How far axes and centres were moved so that they meet, all together (m)."""

    @property
    def extent(self) -> float:
        """The robot's length and those of all shifts: a lever for the leg's turns (m)."""
        return self.length + sum(float(np.linalg.norm(body.shift)) for body in self.bodies)

    @property
    def moved(self) -> float:
        """Distance that axes and centres were moved so that they meet, coincide or are parallel, all together (m)."""
        return self.off + self.extent * _measure_parallel_angles(self.bodies)


def build_chain(
    decomposition: LegDecomposition,
    leg: Leg,
    held: Sequence[Observation],
    goal: ClosedConfiguration,
    tip: Array,
    end: Array | str,
) -> Chain:
    """The chain of a leg to its ``tip`` (3,); ``end`` is ``free``, ``kept`` (its body's orientation) or the normal of
    the plane in which that turns. Raises :class:`LocusDerivationFailure`."""
    bodies, off = _Walk(decomposition, leg, held, goal).bodies(tip)
    if not isinstance(end, str):
        bodies = (*bodies, ChainBody(end, tip))
    for body, after in pairwise(bodies):
        if body.axis is not None and after.axis is not None:
            sine = float(np.linalg.norm(cross(body.axis, after.axis)))
            if DIRECTION_SINE_TOL / RANK_GAP_MIN < sine < DIRECTION_SINE_TOL:
                raise LocusDerivationFailure(f"two of its axes are only {sine:.1e} from parallel")
    return Chain(bodies, end != "free" if isinstance(end, str) else True, goal.model.length, off)


def _measure_parallel_angles(bodies: Sequence[ChainBody]) -> float:
    """The angles (rad) of all pairs of directions of a chain that count as parallel, and are not but for rounding."""
    directions = [
        d
        for body in bodies
        for d in (
            *([] if body.axis is None else [body.axis]),
            *body.slides,
            *body.observed,
            *(d for crank in body.cranks for d in (crank.axis, *crank.observed)),
        )
    ]
    angles = [float(np.linalg.norm(cross(a, b))) for a, b in combinations(directions, 2) if lines.is_parallel(a, b)]
    return sum(angle for angle in angles if angle > CHAIN_ROUNDING)


class _Walk:
    """The path from the base to a leg's end, step by step."""

    def __init__(
        self, decomposition: LegDecomposition, leg: Leg, held: Sequence[Observation], goal: ClosedConfiguration
    ) -> None:
        self.decomposition, self.leg, self.goal = decomposition, leg, goal
        self.observed: dict[str, list[Array]] = {}
        self.coordinates: dict[str, int] = {}
        """Return the number of coordinates of a joint that a motor fixes."""
        base = decomposition.mechanism.base
        for observation in held:
            if isinstance(observation, Encoder):
                self.coordinates[observation.joint] = self.coordinates.get(observation.joint, 0) + 1
            elif (
                isinstance(observation, Direction)
                and (observation.seen_from or decomposition.mechanism.reference) == base
            ):
                self.observed.setdefault(observation.link, []).append(
                    goal.pose(observation.link)[:3, :3] @ observation.direction
                )
            else:
                raise LocusDerivationFailure("an observation is not a direction from the base")

    def bodies(self, tip: Array) -> tuple[tuple[ChainBody, ...], float]:
        """The bodies, shifts included, and how far their points were moved to meet (m); every measurement must be met
        on the way."""
        at = self.decomposition.mechanism.base
        bodies = [ChainBody(None, np.zeros(3), observed=self._sight(at))]
        path = self.decomposition.path(self.leg)
        self.beside = set(self.leg.joints).difference(*(edge.joints for edge in path))
        for edge in path:
            end = edge.other(at)
            if len(edge.joints) == 1:
                self._joint(bodies, self.decomposition.mechanism.joints[edge.joints[0]], at)
            elif isinstance(edge.word.items[0], Rods):
                self._rods(bodies, edge, at)
            else:
                self._parallelogram(bodies, edge, at)
            bodies[-1] = replace(bodies[-1], observed=bodies[-1].observed + self._sight(end))
            at = end
        for what in (*self.observed, *self.coordinates):
            raise LocusDerivationFailure(f"the observation at {what} is not on the path from the base to the leg's end")
        return _shift_bodies(bodies, tip, POINT_DISTANCE_TOL * self.goal.model.length)

    def _sight(self, link: str) -> tuple[Array, ...]:
        return tuple(self.observed.pop(link, ()))

    def _geometry(self, joint: Joint, at: str) -> tuple[Array, list[Array]]:
        """Centre (m) and axes of a joint, in the order in which they are met from the link ``at``."""
        point, axes = carry_joint(self.decomposition.mechanism, joint, self.goal.pose)
        return point, axes if joint.predecessor == at else axes[::-1]

    def _joint(self, found: list[ChainBody], joint: Joint, at: str) -> None:
        point, axes = self._geometry(joint, at)
        held = self.coordinates.pop(joint.name, 0)
        if held:
            if held != len(axes) + (joint.type is JointType.CYLINDRICAL):
                raise LocusDerivationFailure(f"a motor fixes a part of joint {joint.name}")
            return
        if joint.type is JointType.SPHERICAL:
            found.append(ChainBody(None, point))
            return
        if joint.type not in _TURNS:
            raise LocusDerivationFailure(f"joint {joint.name} of type {joint.type.value}")
        slides = axes if joint.type.has_translation else find_normals(axes[0]) if joint.type is JointType.PLANAR else ()
        found[-1] = replace(found[-1], slides=(*found[-1].slides, *(normalise_vector(s) for s in slides)))
        found.extend(ChainBody(axis, point) for axis in axes if _TURNS[joint.type])
        if joint.type is JointType.REVOLUTE and self.beside:
            found[-1] = replace(found[-1], angles=self._rod_angles(joint, at))

    def _rod_angles(self, joint: Joint, at: str) -> tuple[tuple[float, float], ...]:
        """The two angles of an R that a rod leaves, between points C and D of bodies that are fixed to its links: D is
        where it is, or its mirror image in the plane of C and the axis (a four-bar with its crank held, a strut of held
        length)."""
        near, far = self._links_fixed_to(at), self._links_fixed_to(joint.other(at))
        o, (a, *_) = self._geometry(joint, at)
        joints = self.decomposition.mechanism.joints
        for link in self.leg.links:
            rod = self._links_fixed_to(link)
            ends = [self._centre(rod, end) for end in (near, far)]
            if rod & (near | far) or ends[0] is None or ends[1] is None:
                continue
            c, d = (C - o - a * float(a @ (C - o)) for C in ends if C is not None)
            least = min(np.linalg.norm(c), np.linalg.norm(d)) / self.goal.model.length
            if least > POINT_DISTANCE_TOL:
                for name in [name for name in self.coordinates if name in self.beside]:
                    if any(part.issuperset(joints[name].links) for part in (rod, near, far)):
                        del self.coordinates[name]
                return (0.0, 1.0), (2 * float(np.arctan2(a @ cross(d, c), d @ c)), 3.0 + 8.0 / float(least))
        return ()

    def _centre(self, one: set[str], other: set[str]) -> Array | None:
        """The centre (m) of a joint beside the way that joins two groups of links and is fixed in both, or None."""
        kinds = (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL)
        for name in sorted(self.beside):
            joint = self.decomposition.mechanism.joints[name]
            a, b = joint.links
            if joint.type in kinds and ((a in one and b in other) or (b in one and a in other)):
                return self._geometry(joint, a)[0]
        return None

    def _links_fixed_to(self, link: str) -> set[str]:
        """A link with those that held joints beside the way fix to it."""
        mechanism, links, new = self.decomposition.mechanism, {link}, [link]
        while new:
            at = new.pop()
            for joint in mechanism.joints_of(at):
                held = joint.name in self.beside and self.coordinates.get(joint.name) == joint.type.freedoms
                if held and joint.other(at) not in links:
                    links.add(joint.other(at))
                    new.append(joint.other(at))
        return links

    def _parallelogram(self, found: list[ChainBody], edge: WordEdge, at: str) -> None:
        """Both cranks are one: they stay parallel (a parallelogram is not crossed)."""
        joints = [self.decomposition.mechanism.joints[name] for name in edge.joints]
        near, far = joints[:2] if edge.tail == at else joints[1::-1]
        (start, axes), (end, _) = self._geometry(near, at), self._geometry(far, at)
        held = any([self.coordinates.pop(joint.name, 0) for joint in joints])
        axis, way = axes[0], end - start
        observed = tuple(d for link in edge.inside for d in self._sight(link))
        crank = Crank(axis, way - axis * float(axis @ way), observed, held)
        found[-1] = replace(found[-1], cranks=(*found[-1].cranks, crank))

    def _rods(self, found: list[ChainBody], edge: WordEdge, at: str) -> None:
        """Add the observed one of parallel rods, or the first: all have one direction."""
        if any(name in self.coordinates for name in edge.joints):
            raise LocusDerivationFailure("a motor fixes a rod")
        number = next((k for k, link in enumerate(edge.inside) if link in self.observed), 0)
        joints = [self.decomposition.mechanism.joints[name] for name in edge.joints[2 * number : 2 * number + 2]]
        near, far = joints if edge.tail == at else joints[::-1]
        observed = tuple(d for link in edge.inside for d in self._sight(link))
        found.append(ChainBody(None, self._geometry(near, at)[0], observed=observed))
        found.append(ChainBody(None, self._geometry(far, at)[0]))


_TURNS = {
    JointType.REVOLUTE: True,
    JointType.UNIVERSAL: True,
    JointType.CYLINDRICAL: True,
    JointType.PLANAR: True,
    JointType.PRISMATIC: False,
    JointType.FIXED: False,
}
"""Joints that are read axis by axis, and whether those are axes of turns."""


def _shift_bodies(bodies: Sequence[ChainBody], tip: Array, small: float) -> tuple[tuple[ChainBody, ...], float]:
    """Bodies with their shifts, counted from points of their axes that neighbours share where axes meet; and how far
    they are from meeting (m)."""
    points, moved = [bodies[0].point], 0.0
    for k, body in enumerate(bodies[1:], 1):
        before = bodies[k - 1] if bodies[k - 1].is_rigid and k > 1 else None
        after = bodies[k + 1] if k + 1 < len(bodies) and body.is_rigid else None
        point, off = (
            (body.point, 0.0)
            if body.axis is None
            else _find_meeting(body, before, after, tip if k + 1 == len(bodies) and body.is_rigid else None, small)
        )
        points.append(point)
        moved += off if off > CHAIN_ROUNDING * (small / POINT_DISTANCE_TOL) else 0.0
    shifted = []
    for body, start, end in zip(bodies, points, [*points[1:], tip], strict=True):
        cranks = sum((crank.vector for crank in body.cranks), np.zeros(3))
        shifted.append(replace(body, point=start, shift=end - start - cranks))
    return tuple(shifted), moved


def _find_meeting(
    body: ChainBody, before: ChainBody | None, after: ChainBody | None, tip: Array | None, small: float
) -> tuple[Array, float]:
    """The point of a body's axis at which a ball, the tip or a neighbour's axis is, else its own; and how far from the
    axis that is (m)."""
    assert body.axis is not None
    balls = [neighbour.point for neighbour in (before, after) if neighbour is not None and neighbour.axis is None]
    for point in [*balls, *([] if tip is None else [tip])]:
        off = lines.measure_line_distance(point, body.point, body.axis)
        if off <= small:
            return lines.project_to_line(point, body.point, body.axis), off
    for neighbour in (before, after):
        if neighbour is not None and neighbour.axis is not None:
            near, far = lines.find_common_perpendicular(body.point, body.axis, neighbour.point, neighbour.axis)
            off = float(np.linalg.norm(near - far))
            if not lines.is_parallel(body.axis, neighbour.axis) and off <= small:
                return near, off
    return body.point, 0.0
