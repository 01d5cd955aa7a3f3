"""The loops of a mechanism as equations in joint coordinates, with derivatives: for many floats or affine forms at
once, or for arrays of one symbol of a tape each.

Every joint of the spanning tree is cut into coordinates of one axis each, in the order of the file: U its two axes, C
slide then turn, planar two slides then the turn, spherical turns about the base's axes x, y, z (as they lie at zero).
A body behind a coordinate is displaced from the zero configuration by the product of the exponentials of the
coordinates before it, p ↦ R p + t. A loop is closed by a joint that is cut; it is seen from the last body that both of
its chains share, so that what lies before that body does not matter to it. Lengths in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import BadMechanism
from ..geometry import lines
from ..geometry.affine import AffineForms, compute_cross_forms, compute_dot_forms
from ..geometry.so3 import decompose_rotation
from ..geometry.vectors import Array, build_plane_axes, cross, freeze_array, hat, invert_pose, times
from ..mechanism import Joint, JointType, Mechanism, graphs
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.screws import split_elementary
from ..results import Value
from ..tolerances import CHAIN_ROUNDING, POINT_DISTANCE_TOL

AXIS_COMPONENT_ROUNDING_TOL = 1e-15
"""Component of a unit vector below which it is zero."""

_PREFERRED = {"F": 0, "6": 1, "P": 2, "R": 3, "C": 4, "U": 5, "E": 6, "S": 7}
"""Priority of joint types in the spanning tree."""


@dataclass(frozen=True, eq=False, repr=False)
class TreeCoordinate(Value):
    """Coordinate of a joint: a rotation (rad) about, or a translation (characteristic lengths) along an ``axis`` (3,)
    through ``point`` (3,), both as they lie at zero; ``parent`` is the coordinate before it, −1 at the base; ``zero``
    is its value there; ``acts`` is the joint of the normal form that it is part of."""

    name: str
    joint: str
    slides: bool
    axis: Array
    point: Array
    parent: int
    driven: bool = False
    acts: str = ""
    zero: float = 0.0

    def from_zero(self, value: Any) -> Any:
        """Values, floats or forms, counted from the zero configuration; an angle keeps the symbol of its bend."""
        if not self.zero:
            return value
        found = value - self.zero
        if isinstance(value, AffineForms):
            found.bend = value.bend
        return found


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
    planar: bool = False
    """True if all its links move in a plane, so that at most three equations are independent."""
    tips: tuple[int, ...] = ()
    """The coordinates of a ball that is cut in one of its R: they follow from the loop that closes it in a point."""

    @property
    def coordinates(self) -> tuple[int, ...]:
        """The coordinates of both chains."""
        return self.chains[0] + self.chains[1]


@dataclass(frozen=True, eq=False, repr=False)
class CouplingEquation(Value):
    """A coupling: coordinate ``second`` − ``ratio`` · coordinate ``first``, each from the zero configuration, = 0
    (characteristic lengths, radians)."""

    name: str
    first: int
    second: int
    ratio: float

    @property
    def coordinates(self) -> tuple[int, int]:
        """Both coordinates."""
        return self.first, self.second

    @property
    def slope(self) -> dict[int, float]:
        """Its derivatives by the coordinates; the equation is linear."""
        return {self.second: 1.0, self.first: -self.ratio}


@dataclass(frozen=True, eq=False, repr=False)
class LoopSystem(Value):
    """Coordinates of a mechanism's spanning tree, parents first, the loops between them and the couplings;
    ``body[link]`` is the coordinate that carries a link, −1 for fixed links; ``length`` the unit (m)."""

    mechanism: Mechanism
    length: float
    coordinates: tuple[TreeCoordinate, ...]
    body: Mapping[str, int]
    loops: tuple[JointLoop, ...]
    gears: tuple[CouplingEquation, ...]

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

    @property
    def zero(self) -> Array:
        """The coordinates (N,) of the zero configuration."""
        return np.array([each.zero for each in self.coordinates])

    @property
    def as_filed(self) -> LoopSystem:
        """Return the system with coordinates from the zero of the file; those of spherical, planar and free joints from
        the zero configuration."""
        joints, length, found = self.mechanism.joints, self.length, list(self.coordinates)
        for name in {each.joint for each in found if each.joint in joints}:
            offset, own = joints[name].offset, [i for i, each in enumerate(found) if each.joint == name]
            if offset is not None and offset.ndim == 1:
                for i, zero in zip(sorted(own, key=lambda i: found[i].name), offset.tolist(), strict=True):
                    found[i] = replace(found[i], zero=zero / (length if found[i].slides else 1.0))
        return replace(self, coordinates=tuple(found))

    @property
    def metric(self) -> LoopSystem:
        """Return the system in metres; values that are zero up to rounding are zero."""
        return self.in_units(1.0)

    def in_units(self, length: float) -> LoopSystem:
        """Return the system with another unit of lengths (m); values that are zero up to rounding are zero."""
        scale = self.length / length

        def point(p: Array) -> Array:
            return freeze_array(_drop_rounding(p * scale))

        def row(each: LoopRow) -> LoopRow:
            return replace(
                each,
                one=None if each.one is None else _drop_rounding(each.one),
                other=None if each.other is None else _drop_rounding(each.other),
            )

        units = np.array([scale if coordinate.slides else 1.0 for coordinate in self.coordinates])
        return replace(
            self,
            length=length,
            coordinates=tuple(
                replace(
                    each,
                    axis=freeze_array(_drop_rounding(each.axis)),
                    point=point(each.point),
                    zero=each.zero * (scale if each.slides else 1.0),
                )
                for each in self.coordinates
            ),
            loops=tuple(replace(each, point=point(each.point), rows=tuple(map(row, each.rows))) for each in self.loops),
            gears=tuple(
                replace(each, ratio=float(each.ratio * units[each.second] / units[each.first])) for each in self.gears
            ),
        )

    def way(self, body: int) -> tuple[int, ...]:
        """The coordinates from the base to a body."""
        found = []
        while body >= 0:
            found.append(body)
            body = self.coordinates[body].parent
        return tuple(reversed(found))

    def displacement(self, chain: Sequence[int], values: Any) -> Swept:
        """Evaluate a chain of coordinates: see :class:`Swept`; ``values`` are those of all, None for those at zero."""
        return Swept.of([self.coordinates[i] for i in chain], [values[i] for i in chain])

    def read(self, pose: Callable[[str], Array]) -> Array:
        """The coordinates (…, N) at which the links have their poses X_BL (…, 4, 4), m; turns within half a one."""
        D = {i: pose(link) @ invert_pose(self.mechanism.links[link].pose) for link, i in self.body.items()}
        found = np.zeros((*np.shape(D[-1])[:-2], len(self.coordinates)))
        for end in (i for i in D if i >= 0):
            own = [i for i in self.way(end) if self.coordinates[i].joint == self.coordinates[end].joint]
            before, after = D[self.coordinates[own[0]].parent], D[end]
            centre, back = self.coordinates[end].point * self.length, np.swapaxes(before[..., :3, :3], -1, -2)
            shift = times(back, after[..., :3, :3] @ centre + after[..., :3, 3] - before[..., :3, 3]) - centre
            for i in own:
                if self.coordinates[i].slides:
                    found[..., i] = shift @ self.coordinates[i].axis / self.length
            turns = [i for i in own if not self.coordinates[i].slides]
            if turns:
                axes = np.array([self.coordinates[i].axis for i in turns])
                found[..., turns] = decompose_rotation(axes, back @ after[..., :3, :3])
        return found + self.zero

    def pose(self, link: str, values: Sequence[float] | Array) -> Array:
        """X_BL (…, 4, 4), m, of a link for coordinates (N, …)."""
        values = np.asarray(values, dtype=float)
        swept = self.displacement(self.way(self.body[link]), values)
        X = np.zeros((*values.shape[1:], 4, 4))
        X[..., :3, :3], X[..., :3, 3], X[..., 3, 3] = swept.R, swept.at(np.zeros(3)) * self.length, 1.0
        return np.asarray(X @ self.mechanism.links[link].pose)


@dataclass(frozen=True, eq=False)
class Swept:
    """The displacement p ↦ o + R (p − c) behind a chain of coordinates, c the last point that it turned about, and the
    places of their axes: the direction, and a point of it (of a slide none)."""

    R: Any
    o: Any
    c: Array
    axes: list[Any]
    points: list[Any]

    @classmethod
    def of(cls, chain: Sequence[TreeCoordinate], values: Sequence[Any]) -> Swept:
        """The product of the exponentials of coordinates with ``values`` (…), floats or forms."""
        R: Any = np.eye(3)
        c = chain[0].point if chain else np.zeros(3)
        o: Any = c
        axes: list[Any] = []
        points: list[Any] = []
        # turns about parallel axes add up: R = R_before exp([a]ₓ (θ_k + …)), enclosed more sharply than their product
        before, about, angle = R, None, None
        for each, value in zip(chain, values, strict=True):
            if np.any(each.point != c):
                o = o + rotate(R, each.point - c)
                c = each.point
            axes.append(rotate(R, each.axis))
            points.append(None if each.slides else o)
            if value is None:
                continue
            value = each.from_zero(value)
            if each.slides:
                o = o + axes[-1] * value[..., None]
                continue
            along = 0.0 if about is None else float(about @ each.axis)
            if about is not None and abs(along) == 1.0 and np.array_equal(each.axis, along * about):
                angle = angle + value if along > 0 else angle - value
            else:
                before, about, angle = R, each.axis, value
            R = _turn_frame(before, about, angle)
        return cls(R, o, c, axes, points)

    def at(self, p: Array) -> Any:
        """Return the position of a point (3,) of the end, given as it lies at zero."""
        return self.o + rotate(self.R, p - self.c)

    def rate(self, k: int, p: Any) -> Any:
        """The velocity (…, 3) of a place p with the k-th coordinate."""
        at = self.points[k]
        return self.axes[k] if at is None else compute_cross_forms(self.axes[k], p - at)

    def turned(self, k: int, v: Any) -> Any:
        """The rate (…, 3) of a direction v with the k-th coordinate, None where it is zero."""
        return None if self.points[k] is None else compute_cross_forms(self.axes[k], v)


def _drop_rounding(directions: Array) -> Array:
    """Directions or points whose components that are zero but for rounding are zero."""
    return np.where(np.abs(directions) < AXIS_COMPONENT_ROUNDING_TOL, 0.0, directions)


def rotate(R: Any, p: Any) -> Any:
    """R p (…, 3)."""
    if _is_float_data(R) and _is_float_data(p):
        return np.matmul(R, p[..., None])[..., 0]
    return (R * p[..., None, :]).sum(-1)


def _turn_frame(R: Any, axis: Array, angle: Any) -> Any:
    """R exp([a]ₓ θ) = R + R [a]ₓ sin θ + R [a]ₓ² (1 − cos θ)."""
    sine, cosine = angle.sines() if hasattr(angle, "sines") else (np.sin(angle), np.cos(angle))
    K = hat(axis)
    once = _compute_product(R, K)
    return R + once * sine[..., None, None] + _compute_product(R, K @ K) * (1 - cosine)[..., None, None]


def _is_float_data(x: Any) -> bool:
    return isinstance(x, np.ndarray) and x.dtype.kind == "f"


def _compute_product(R: Any, K: Array) -> Any:
    """R K for a matrix of numbers (3, 3)."""
    if _is_float_data(R):
        return R @ K
    return (R[..., :, :, None] * K).sum(-2)


def evaluate_residuals(
    system: LoopSystem, loop: JointLoop, values: Any, rows: Sequence[LoopRow]
) -> tuple[list[Any], list[dict[int, Any]]]:
    """The values (…) of some equations of a loop, and of each the derivatives by the coordinates of its chains that are
    not None."""
    one, two = (system.displacement(chain, values) for chain in loop.chains)
    moving = [[(place, i) for place, i in enumerate(chain) if values[i] is not None] for chain in loop.chains]
    a, b = one.at(loop.point), two.at(loop.point)
    found: list[Any] = []
    slopes: list[dict[int, Any]] = []
    for row in rows:
        slope: dict[int, Any] = {}
        if row.kind == "point":
            assert row.one is not None
            k = rotate(one.R, row.one) if row.carried else row.one
            found.append(compute_dot_forms(b - a, k))
            for place, i in moving[0]:
                slope[i] = -compute_dot_forms(one.rate(place, a), k)
                turned = one.turned(place, k) if row.carried else None
                if turned is not None:
                    slope[i] = slope[i] + compute_dot_forms(turned, b - a)
            for place, i in moving[1]:
                slope[i] = compute_dot_forms(two.rate(place, b), k)
        elif row.kind == "direction":
            u, v = rotate(one.R, row.one), rotate(two.R, row.other)
            found.append(compute_dot_forms(u, v) - np.asarray(row.one @ row.other))  # type: ignore[operator]
            for chain, swept, own, far in ((moving[0], one, u, v), (moving[1], two, v, u)):
                for place, i in chain:
                    turned = swept.turned(place, own)
                    slope[i] = compute_dot_forms(turned, far) if turned is not None else 0.0
        else:
            found.append(_evaluate_distance(system, loop, values, one, a, slope))
        slopes.append(slope)
    return found, slopes


def locate_rod_ends(system: LoopSystem, loop: JointLoop, values: Any) -> tuple[Any, Any, Any]:
    """Return the ends a and b of a loop with a joint that is left out, and the centre A of that joint (…, 3)."""
    assert loop.swung is not None
    one, two = (system.displacement(chain, values) for chain in loop.chains)
    before = system.displacement(loop.chains[1][: loop.swung], values)
    return one.at(loop.point), two.at(loop.point), before.at(system.coordinates[loop.chains[1][loop.swung]].point)


def _evaluate_distance(
    system: LoopSystem, loop: JointLoop, values: Any, one: Swept, a: Any, slope: dict[int, Any]
) -> Any:
    """(|a − A|² − |b − A|²) / 2 and its derivatives: A and b are seen without the joint that is left out."""
    assert loop.swung is not None
    before, after = loop.chains[1][: loop.swung], loop.chains[1][loop.swung + loop.swings :]
    centre = system.coordinates[loop.chains[1][loop.swung]].point
    near, far = system.displacement(before, values), system.displacement(after, values)
    A, b = near.at(centre), far.at(loop.point)
    reach, rod = a - A, b - centre
    for chain, swept, v, p, sign in (
        (loop.chains[0], one, reach, a, 1),
        (before, near, reach, A, -1),
        (after, far, rod, b, -1),
    ):
        for place, i in enumerate(chain):
            if values[i] is not None:
                slope[i] = compute_dot_forms(swept.rate(place, p), v) * sign
    return (compute_dot_forms(reach, reach) - compute_dot_forms(rod, rod)) * 0.5


def build_loop_system(mechanism: Mechanism, driven: Sequence[str], free: bool = False) -> LoopSystem:
    """The loops of a mechanism, the coordinates of the joints ``driven`` given; ``free``: the pose of the platform is
    part of the coordinates, so that all its legs are loops.

    Raises ``BadMechanism`` where a joint that is driven cannot be part of the tree.
    """
    length = mechanism.length
    joints = list(mechanism.joints.values())
    normal = find_motion_plane(joints)
    acts = _list_merged_joints(mechanism) if driven else dict(mechanism.joints)
    if free:
        joints = [_make_free_joint(mechanism, normal), *joints]
    weights = [
        -2.0 if free and not k else _weigh_joint(joint, acts[joint.name], mechanism, driven)
        for k, joint in enumerate(joints)
    ]
    tree = graphs.build_spanning_forest(mechanism.links, joints, weights)
    coordinates: list[TreeCoordinate] = []
    body = {mechanism.base: -1}
    for joint, near, far in graphs.order_outward(mechanism.base, tree):
        own = joint if joint.predecessor == near else joint.turned()
        one = acts.get(joint.name, joint)
        parent = body[near]
        cut = list_joint_parts(own)
        if own is not joint and joint.type is JointType.UNIVERSAL:
            cut = [(other[0], each[1], each[2]) for other, each in zip(reversed(cut), cut, strict=True)]
        for name, slides, axis in cut:
            coordinates.append(
                TreeCoordinate(
                    name,
                    joint.name,
                    slides,
                    freeze_array(axis),
                    freeze_array(one.point / length),
                    parent,
                    joint.name in driven,
                    one.name,
                )
            )
            parent = len(coordinates) - 1
        body[far] = parent
    kept = {joint.name for joint in tree}
    missing = [name for name in (*driven, *sorted(mechanism.coupled_joints)) if name not in kept]
    if missing:
        what = "motors" if set(missing) & set(driven) else "couplings"
        raise BadMechanism(f"{mechanism.name}: {what} form a kinematic loop by themselves", ", ".join(missing))
    system = LoopSystem(
        mechanism, length, tuple(coordinates), body, (), _list_couplings(mechanism, coordinates, length)
    )
    loops = [
        _build_loop(system, joint, acts[joint.name].point, normal)
        for joint in joints
        if joint.name not in kept and joint.type is not JointType.FREE
    ]
    return replace(system, loops=tuple(part for loop in loops for part in _shorten_loop(system, acts, loops, loop)))


def _list_merged_joints(mechanism: Mechanism) -> dict[str, Joint]:
    """Return for each joint the U or ball that it makes with others, R whose axes meet but for rounding, or itself."""
    near = CHAIN_ROUNDING * mechanism.length
    normal = reduce_to_normal_form(mechanism)
    found = dict(mechanism.joints)
    for name, parts in normal.made_of.items():
        joint = normal.mechanism.joints.get(name)
        if joint is None or joint.type not in (JointType.UNIVERSAL, JointType.SPHERICAL):
            continue
        every = (found[part] for part in parts)
        if all(
            lines.measure_line_distance(joint.point, each.point, each.axes[0]) <= near for each in every if each.axes
        ):
            found |= dict.fromkeys(parts, joint)
    return found


def find_motion_plane(joints: Sequence[Joint]) -> Array | None:
    """The normal of the plane in which all of a robot's links move, as its joints are directed; None where there is
    none."""
    turning = [joint.axis for joint in joints if joint.type in (JointType.REVOLUTE, JointType.PLANAR)]
    allowed = (JointType.REVOLUTE, JointType.PLANAR, JointType.PRISMATIC, JointType.FIXED)
    if not turning or any(joint.type not in allowed for joint in joints):
        return None
    normal = turning[0]
    sliding = [joint.axis for joint in joints if joint.type is JointType.PRISMATIC]
    planar = all(lines.is_parallel(normal, axis) for axis in turning) and all(
        lines.is_perpendicular(normal, axis) for axis in sliding
    )
    return normal if planar else None


def _make_free_joint(mechanism: Mechanism, normal: Array | None) -> Joint:
    """A joint that lets the platform go where it likes, in its plane where there is one, about the middle of its own
    joints."""
    centre = np.mean([joint.point for joint in mechanism.joints_of(mechanism.platform)], axis=0)
    name = mechanism.platform
    while name in mechanism.joints:
        name += "_pose"
    kind = JointType.FREE if normal is None else JointType.PLANAR
    return Joint(name, kind, mechanism.base, mechanism.platform, centre, () if normal is None else (normal,))


def _weigh_joint(joint: Joint, acts: Joint, mechanism: Mechanism, driven: Sequence[str]) -> float:
    """Sort key of the spanning tree: motors and couplings first, then joints with few dof, as they act; joints of the
    platform last."""
    if joint.name in driven or joint.name in mechanism.coupled_joints:
        return -1.0
    return _PREFERRED[acts.type.value] + (0.5 if mechanism.platform in joint.links else 0.0)


def list_joint_parts(joint: Joint) -> list[tuple[str, bool, Array]]:
    """The coordinates of a joint in their order: name, whether it slides, axis."""
    found = split_elementary(joint.type, joint.axes)
    return [
        (f"{joint.name}.{k}" if len(found) > 1 else joint.name, kind is JointType.PRISMATIC, axis)
        for k, (kind, axis) in enumerate(found, 1)
    ]


def _list_couplings(
    mechanism: Mechanism, coordinates: Sequence[TreeCoordinate], length: float
) -> tuple[CouplingEquation, ...]:
    found = []
    for coupling in mechanism.couplings:
        names = coupling.driver, coupling.driven
        first, second = pair = [next(i for i, each in enumerate(coordinates) if each.joint == name) for name in names]
        scale = [length if coordinates[i].slides else 1.0 for i in pair]
        found.append(CouplingEquation(coupling.name, first, second, coupling.ratio * scale[0] / scale[1]))
    return tuple(found)


def _build_loop(system: LoopSystem, joint: Joint, centre: Array, normal: Array | None) -> JointLoop:
    """The loop that a joint closes which is cut at its centre, its equations as its type has them."""
    a, b = (system.way(system.body[link]) for link in joint.links)
    shared = sum(1 for i, k in zip(a, b, strict=False) if i == k)
    return JointLoop(
        joint.name,
        joint.links,
        (a[shared:], b[shared:]),
        freeze_array(centre / system.length),
        tuple(list_joint_equations(joint)),
        planar=normal is not None,
    )


def _shorten_loop(
    system: LoopSystem, acts: Mapping[str, Joint], loops: Sequence[JointLoop], loop: JointLoop
) -> tuple[JointLoop, ...]:
    """The loop without a joint that only it has, where it is closed in a point: that the distance of the ball that is
    cut from this joint's centre is right is all that the others have to do with it (a rod). Of a ball that is cut in
    one of its R the equations of directions are a loop of their own, in which the others of its R follow."""
    if acts[loop.name].type is not (JointType.REVOLUTE if loop.planar else JointType.SPHERICAL):
        return (loop,)
    turning = (JointType.REVOLUTE,) if loop.planar else (JointType.UNIVERSAL, JointType.SPHERICAL)
    others = {i for each in loops if each is not loop for i in each.coordinates}
    others |= {i for gear in system.gears for i in gear.coordinates}
    cut = acts[loop.name].name
    tips = tuple(i for i in loop.coordinates if system.coordinates[i].acts == cut)
    if any(i in others or system.coordinates[i].driven for i in tips):
        return (loop,)
    points, aligned = (
        tuple(row for row in loop.rows if (row.kind == "point") is is_point) for is_point in (True, False)
    )
    rod = loop
    if tips:
        near, far = (tuple(i for i in each if i not in tips) for each in loop.chains)
        rod = replace(loop, rows=points, chains=(near, far))
    for side in (0, 1):
        chain = rod.chains[side]
        for place, i in enumerate(chain):
            own = system.coordinates[i]
            if own.joint not in acts or acts[own.joint].type not in turning or own.driven or i in others:
                continue
            swings = sum(each.acts == own.acts for each in system.coordinates)
            reach = loop.point - own.point
            length = np.linalg.norm(cross(own.axis, reach) if loop.planar else reach)
            if (
                length < POINT_DISTANCE_TOL
                or sum(system.coordinates[k].acts == own.acts for k in chain[place : place + swings]) < swings
            ):
                continue
            ends, chains = (rod.ends, rod.chains) if side else (rod.ends[::-1], rod.chains[::-1])
            rod = replace(rod, ends=ends, chains=chains, swung=place, swings=swings)
            return (rod, replace(loop, rows=aligned, tips=tips)) if tips else (rod,)
    return (loop,)


def list_joint_equations(joint: Joint) -> list[LoopRow]:
    """Return the equations of a joint that is cut, (6 − its dof): positions first."""
    E = np.eye(3)
    if joint.type is JointType.SPHERICAL:
        return [LoopRow("point", e) for e in E]
    if joint.type is JointType.FIXED:
        return [LoopRow("point", e) for e in E] + [LoopRow("direction", E[k], E[(k + 1) % 3]) for k in range(3)]
    axis = joint.axis
    across = build_plane_axes(axis)
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
