"""The loops of a mechanism as equations in joint coordinates: for floats and for balls, with their derivatives.

Every joint of the spanning tree is cut into coordinates of one axis each, in the order of the file: U its two axes, C
slide then turn, planar two slides then the turn, spherical turns about the base's axes x, y, z (as they lie at zero).
A body behind a coordinate is displaced from the zero configuration by the product of the exponentials of the
coordinates before it, p ↦ R p + t. A loop is closed by a joint that is cut; it is seen from the last body that both of
its chains share, so that what lies before that body does not matter to it. Lengths in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import BadMechanism
from ...geometry.balls import Field, around
from ...geometry.vectors import Array, cross, dot, frozen, hat, perpendicular
from ...mechanism import Joint, JointType, Mechanism, graphs
from ...results import Value
from ...tolerances import CHAIN_ROUNDING, SAME_POINT

_PREFERRED = {"F": 0, "6": 1, "P": 2, "R": 3, "C": 4, "U": 5, "E": 6, "S": 7}
"""Which joints the spanning tree takes first."""


@dataclass(frozen=True, eq=False, repr=False)
class TreeCoordinate(Value):
    """One coordinate of a joint: a turn (rad) about, or a slide (characteristic lengths) along an ``axis`` (3,) through
    ``point`` (3,), both as they lie at zero; ``parent`` is the coordinate before it, −1 at the base."""

    name: str
    joint: str
    slides: bool
    axis: Array
    point: Array
    parent: int
    driven: bool = False

    @cached_property
    def turning(self) -> tuple[Array, Array]:
        """[a]ₓ and [a]ₓ²: the turn by θ is I + sin θ [a]ₓ + (1 − cos θ) [a]ₓ²."""
        K = hat(self.axis)
        return K, K @ K

    @cached_property
    def balls(self) -> tuple[Field, Field, tuple[Field, Field]]:
        """Axis, point and turning in balls that hold what the file's decimals mean."""
        K, K2 = self.turning
        return thick(self.axis), thick(self.point), (thick(K), thick(K2))


@dataclass(frozen=True)
class LoopRow:
    """One equation of a loop between points a and b or directions u and v of its two ends: ``point``: k · (b − a) = 0
    with k (``one``) fixed before the loop, or where ``carried`` in the end of a; ``direction``: u · v = u₀ · v₀;
    ``distance``: |a − A|² = |b − A|², A the centre of the joint that the equation leaves out."""

    kind: str
    one: Array | None = None
    other: Array | None = None
    carried: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class JointLoop(Value):
    """A loop: the joint that is cut, the chains of coordinates to its two ends from the body that both share, the
    points a, b there (3,) at zero, the equations that close it; ``swung`` is the place in the second chain of the
    first coordinate of a joint whose turn follows from the ends' places, with ``swings`` coordinates, or None."""

    name: str
    ends: tuple[str, str]
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    point: Array
    rows: tuple[LoopRow, ...]
    swung: int | None = None
    swings: int = 0

    @property
    def coordinates(self) -> tuple[int, ...]:
        """The coordinates of both chains."""
        return self.chains[0] + self.chains[1]


@dataclass(frozen=True, eq=False, repr=False)
class GearEquation(Value):
    """A coupling: coordinate ``second`` − ``ratio`` · coordinate ``first`` = 0 (characteristic lengths, radians)."""

    name: str
    first: int
    second: int
    ratio: float


def thick(x: Any) -> Field:
    """Balls around numbers that were computed from a file's decimals."""
    found = np.empty(np.shape(x), dtype=object)
    for place, value in np.ndenumerate(x):
        exact = value in (0.0, 1.0, -1.0)
        found[place] = around(np.array(value), 0.0 if exact else CHAIN_ROUNDING * (1 + abs(float(value))))
    return found


@dataclass(frozen=True, eq=False, repr=False)
class LoopSystem(Value):
    """The coordinates of a mechanism's spanning tree, parents first, the loops between them and the gears;
    ``body[link]`` is the coordinate that carries a link, −1 for what stands still; ``length`` the unit (m)."""

    mechanism: Mechanism
    length: float
    coordinates: tuple[TreeCoordinate, ...]
    body: Mapping[str, int]
    loops: tuple[JointLoop, ...]
    gears: tuple[GearEquation, ...]

    @property
    def units(self) -> Array:
        """Metres or radians of one unit of each coordinate, (N,)."""
        return np.array([self.length if each.slides else 1.0 for each in self.coordinates])

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the coordinates."""
        return tuple(each.name for each in self.coordinates)

    @property
    def driven(self) -> tuple[int, ...]:
        """The coordinates that are given."""
        return tuple(i for i, each in enumerate(self.coordinates) if each.driven)

    def way(self, body: int) -> tuple[int, ...]:
        """The coordinates from the base to a body."""
        found = []
        while body >= 0:
            found.append(body)
            body = self.coordinates[body].parent
        return tuple(reversed(found))

    def displacement(self, chain: Sequence[int], values: Sequence[Any], balls: bool) -> Swept:
        """What a chain of coordinates does: see :class:`Swept`; ``values`` are those of all coordinates."""
        return Swept.of([self.coordinates[i] for i in chain], [values[i] for i in chain], balls)

    def pose(self, link: str, values: Sequence[float]) -> Array:
        """X_BL (4, 4), m, of a link for coordinates (N,)."""
        swept = self.displacement(self.way(self.body[link]), values, False)
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = swept.R, swept.at(np.zeros(3)) * self.length
        return np.asarray(X @ self.mechanism.links[link].pose)


@dataclass(frozen=True, eq=False)
class Swept:
    """The displacement p ↦ o + R (p − c) behind a chain of coordinates, c the last point that it turned about, and the
    places of their axes, (k, 3) each: the direction, and a point of it (of a slide none)."""

    R: Field
    o: Field
    c: Array
    axes: list[Field]
    points: list[Field | None]
    balls: bool

    @classmethod
    def of(cls, chain: Sequence[TreeCoordinate], values: Sequence[Any], balls: bool) -> Swept:
        """The product of the exponentials of coordinates with ``values``."""
        R: Field = np.eye(3, dtype=int if balls else float).astype(object if balls else float)
        c = chain[0].point if chain else np.zeros(3)
        o: Field = thick(c) if balls else c
        axes: list[Field] = []
        points: list[Field | None] = []
        for each, value in zip(chain, values, strict=True):
            axis, _, (K, K2) = each.balls if balls else (each.axis, each.point, each.turning)
            if np.any(each.point != c):
                o = o + R @ (thick(each.point - c) if balls else each.point - c)
                c = each.point
            axes.append(R @ axis)
            points.append(None if each.slides else o)
            if each.slides:
                o = o + axes[-1] * value
                continue
            sine, cosine = value.sin_cos() if balls else (np.sin(value), np.cos(value))
            R = R @ (np.eye(3, dtype=int) + K * sine + K2 * (1 - cosine))
        return cls(R, o, c, axes, points, balls)

    def at(self, p: Array) -> Field:
        """Where a point (3,) of the end, as it lies at zero, is."""
        return np.asarray(self.o + self.R @ (thick(p - self.c) if self.balls else p - self.c))

    def rate(self, k: int, p: Field) -> Field:
        """The velocity (3,) of a place p with the k-th coordinate."""
        at = self.points[k]
        return self.axes[k] if at is None else cross(self.axes[k], p - at)

    def turned(self, k: int, v: Field) -> Field | None:
        """The rate (3,) of a direction v with the k-th coordinate, None where it is zero."""
        return None if self.points[k] is None else cross(self.axes[k], v)


def residuals(system: LoopSystem, loop: JointLoop, values: Any, rows: Sequence[LoopRow], balls: bool
              ) -> tuple[list[Any], list[dict[int, Any]]]:
    """The values of some equations of a loop, and of each the derivatives by the coordinates of its chains."""
    one, two = (system.displacement(chain, values, balls) for chain in loop.chains)
    fixed = thick if balls else np.asarray
    a, b = one.at(loop.point), two.at(loop.point)
    found: list[Any] = []
    slopes: list[dict[int, Any]] = []
    for row in rows:
        slope: dict[int, Any] = {}
        if row.kind == "point":
            k = fixed(row.one) if not row.carried else one.R @ fixed(row.one)
            found.append(dot(k, b - a))
            for place, i in enumerate(loop.chains[0]):
                slope[i] = -dot(k, one.rate(place, a))
                turned = one.turned(place, k) if row.carried else None
                if turned is not None:
                    slope[i] = slope[i] + dot(turned, b - a)
            for place, i in enumerate(loop.chains[1]):
                slope[i] = dot(k, two.rate(place, b))
        elif row.kind == "direction":
            u, v = one.R @ fixed(row.one), two.R @ fixed(row.other)
            found.append(dot(u, v) - dot(fixed(row.one), fixed(row.other)))
            for chain, swept, own, far in ((loop.chains[0], one, u, v), (loop.chains[1], two, v, u)):
                for place, i in enumerate(chain):
                    turned = swept.turned(place, own)
                    slope[i] = dot(turned, far) if turned is not None else 0
        else:
            found.append(_distance(system, loop, values, balls, one, a, slope))
        slopes.append(slope)
    return found, slopes


def _distance(system: LoopSystem, loop: JointLoop, values: Sequence[Any], balls: bool, one: Swept, a: Field,
              slope: dict[int, Any]) -> Any:
    """(|a − A|² − |b − A|²) / 2 and its derivatives: A and b are seen without the joint that is left out."""
    fixed = thick if balls else np.asarray
    assert loop.swung is not None
    before, after = loop.chains[1][: loop.swung], loop.chains[1][loop.swung + loop.swings :]
    centre = system.coordinates[loop.chains[1][loop.swung]].point
    near = system.displacement(before, values, balls)
    far = system.displacement(after, values, balls)
    A = near.at(centre)
    reach, b = a - A, far.at(loop.point)
    rod = b - fixed(centre)
    for place, i in enumerate(loop.chains[0]):
        slope[i] = dot(reach, one.rate(place, a))
    for place, i in enumerate(before):
        slope[i] = -dot(reach, near.rate(place, A))
    for place, i in enumerate(after):
        slope[i] = -dot(rod, far.rate(place, b))
    return ((dot(reach, reach) - dot(rod, rod)) / 2)


def loop_system(mechanism: Mechanism, driven: Sequence[str]) -> LoopSystem:
    """The loops of a mechanism, the coordinates of the joints ``driven`` given.

    Raises ``BadMechanism`` where a joint that is driven cannot be part of the tree.
    """
    length = mechanism.length
    joints = list(mechanism.joints.values())
    geared = {link for c in mechanism.couplings for link in (c.predecessor, c.successor)}
    weights = [_weight(joint, mechanism, driven, geared) for joint in joints]
    tree = graphs.spanning_forest(mechanism.links, joints, weights)
    coordinates: list[TreeCoordinate] = []
    body = {mechanism.base: -1}
    for joint, near, far in graphs.outward(mechanism.base, tree):
        own = joint if joint.predecessor == near else joint.turned()
        parent = body[near]
        cut = parts(own)
        if own is not joint and joint.type is JointType.UNIVERSAL:
            cut = [(other[0], each[1], each[2]) for other, each in zip(reversed(cut), cut, strict=True)]
        for name, slides, axis in cut:
            coordinates.append(TreeCoordinate(name, joint.name, slides, frozen(axis), frozen(own.point / length),
                                              parent, joint.name in driven))
            parent = len(coordinates) - 1
        body[far] = parent
    kept = {joint.name for joint in tree}
    missing = [name for name in driven if name not in kept]
    if missing:
        raise BadMechanism(f"{mechanism.name}: driven joints that close a loop among themselves", ", ".join(missing))
    system = LoopSystem(mechanism, length, tuple(coordinates), body, (), _gears(mechanism, coordinates, length))
    loops = [_loop(system, joint) for joint in joints if joint.name not in kept and joint.type is not JointType.FREE]
    return replace(system, loops=tuple(_shortened(system, loops, loop) for loop in loops))


def _weight(joint: Joint, mechanism: Mechanism, driven: Sequence[str], geared: set[str]) -> float:
    """What comes first into the tree: motors and gears, then joints with few freedoms; joints of the platform last."""
    if joint.name in driven or (joint.successor in geared and joint.type.freedoms == 1):
        return -1.0
    return _PREFERRED[joint.type.value] + (0.5 if mechanism.platform in joint.links else 0.0)


def parts(joint: Joint) -> list[tuple[str, bool, Array]]:
    """The coordinates of a joint in their order: name, whether it slides, axis."""
    name = joint.name
    match joint.type:
        case JointType.REVOLUTE:
            return [(name, False, joint.axis)]
        case JointType.PRISMATIC:
            return [(name, True, joint.axis)]
        case JointType.UNIVERSAL:
            return [(f"{name}.{k}", False, axis) for k, axis in enumerate(joint.axes, 1)]
        case JointType.CYLINDRICAL:
            return [(f"{name}.1", True, joint.axis), (f"{name}.2", False, joint.axis)]
        case JointType.SPHERICAL:
            return [(f"{name}.{k}", False, axis) for k, axis in enumerate(np.eye(3), 1)]
        case JointType.PLANAR:
            x = perpendicular(joint.axis)
            return [(f"{name}.1", True, x), (f"{name}.2", True, cross(joint.axis, x)), (f"{name}.3", False, joint.axis)]
        case JointType.FREE:
            return [(f"{name}.{k}", k < 4, np.eye(3)[(k - 1) % 3]) for k in range(1, 7)]
        case _:
            return []


def _gears(mechanism: Mechanism, coordinates: Sequence[TreeCoordinate], length: float) -> tuple[GearEquation, ...]:
    found = []
    for coupling in mechanism.couplings:
        pair = []
        for link in (coupling.predecessor, coupling.successor):
            carriers = [j.name for j in mechanism.joints.values()
                        if j.successor == link and j.in_tree and j.type.freedoms == 1]
            places = [i for i, each in enumerate(coordinates) if carriers and each.joint == carriers[0]]
            if not places:
                raise BadMechanism(f"coupling {coupling.name!r}: no single joint carries the link", link)
            pair.append(places[0])
        first, second = pair
        scale = [length if coordinates[i].slides else 1.0 for i in pair]
        found.append(GearEquation(coupling.name, first, second, coupling.ratio * scale[0] / scale[1]))
    return tuple(found)


def _loop(system: LoopSystem, joint: Joint) -> JointLoop:
    """The loop that a cut joint closes, its equations as its type has them."""
    a, b = (system.way(system.body[link]) for link in joint.links)
    shared = sum(1 for i, k in zip(a, b, strict=False) if i == k)
    point = joint.point / system.length
    return JointLoop(joint.name, joint.links, (a[shared:], b[shared:]), frozen(point), tuple(equations(joint)))


def _shortened(system: LoopSystem, loops: Sequence[JointLoop], loop: JointLoop) -> JointLoop:
    """The loop without a joint that only it has, where it is closed in a point: that the distance of the ball that is
    cut from this joint's centre is right is all that the others have to do with it (a rod)."""
    if [row.kind for row in loop.rows] != ["point"] * 3:
        return loop
    others = {i for each in loops if each is not loop for i in each.coordinates}
    others |= {i for gear in system.gears for i in (gear.first, gear.second)}
    joints = system.mechanism.joints
    for side in (0, 1):
        chain = loop.chains[side]
        for place, i in enumerate(chain):
            own = system.coordinates[i]
            if joints[own.joint].type not in (JointType.UNIVERSAL, JointType.SPHERICAL) or own.driven or i in others:
                continue
            swings = sum(system.coordinates[k].joint == own.joint for k in chain)
            rod = np.linalg.norm(loop.point - own.point)
            if rod < SAME_POINT or sum(system.coordinates[k].joint == own.joint for k in chain[place:]) < swings:
                continue
            ends, chains = (loop.ends, loop.chains) if side else (loop.ends[::-1], loop.chains[::-1])
            return replace(loop, ends=ends, chains=chains, swung=place, swings=swings)
    return loop


def equations(joint: Joint) -> list[LoopRow]:
    """The equations of a joint that is cut, (6 − its freedoms): positions first."""
    E = np.eye(3)
    if joint.type is JointType.SPHERICAL:
        return [LoopRow("point", e) for e in E]
    if joint.type is JointType.FIXED:
        return [LoopRow("point", e) for e in E] + [LoopRow("direction", E[k], E[(k + 1) % 3]) for k in range(3)]
    axis = joint.axis
    across = perpendicular(axis), cross(axis, perpendicular(axis))
    aligned = [LoopRow("direction", e, axis) for e in across]
    match joint.type:
        case JointType.REVOLUTE:
            return [LoopRow("point", e) for e in (*across, axis)] + aligned
        case JointType.UNIVERSAL:
            return [LoopRow("point", e) for e in E] + [LoopRow("direction", joint.axes[0], joint.axes[1])]
        case JointType.CYLINDRICAL:
            return [LoopRow("point", e, carried=True) for e in across] + aligned
        case JointType.PRISMATIC:
            return [LoopRow("point", e, carried=True) for e in across] + [*aligned, LoopRow("direction", *across)]
        case JointType.PLANAR:
            return [LoopRow("point", axis, carried=True), *aligned]
        case _:
            return []
