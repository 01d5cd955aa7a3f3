"""Natural view of a robot's loops: of each link a point and the directions that its joints use, in the base frame.

A joint that only rotates, and a direction or image point seen from the base, are linear in them; a slide is bilinear;
scalar products of a link's directions are constant (J. García de Jalón and E. Bayo, Kinematic and Dynamic Simulation of
Multibody Systems, 1994, chapter 2). Two coupled rotations have one power of their complex units each, z₁ᵖ = z₂^q with
p / q the ratio. Lengths are in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ..errors import UnsupportedLocus
from ..geometry.vectors import Array, find_perpendicular, invert_pose, transform
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Direction, Joint, JointType, Mechanism, Observation
from ..mechanism.cameras import CameraObservation, FixedValueLocus
from ..mechanism.model import Coupling
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.observations.encoder import Encoder
from ..results import Value
from ..tolerances import CHAIN_ROUNDING, GEAR_RATIO_MAX, GEOMETRY_DIFFERENCE_TOL

SPANNED_DIRECTION_MIN = 1e-6
"""Directions of a link that differ by less are one; by how much they differ is part of the equations' error."""
REACH_MARGIN_FRACTION = 1e-6
"""By how much bounds are larger, relative to them: more than errors of the geometry add."""
RIGID = frozenset({JointType.PRISMATIC, JointType.FIXED})
"""Joints whose two links have one rotation."""
SLIDE_REACH_MAX = 100.0
"""Bound of what only slides reach (characteristic lengths): solutions beyond are not sought."""
CENTRE_DISTANCE_MIN = 1e-6
"""Least distance of an observed point from a camera's centre (characteristic lengths) for bounds of errors."""
LINEAR = frozenset({JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL, JointType.FIXED})
"""Joints whose two links share a point."""

Places = NDArray[np.intp]
"""Places of unknowns among all of them."""
NaturalLink = tuple[str, Array, Places | None]
"""Of a link: its rotation's group, the point (3,) that is its unknown at the goal, and the unknowns' places; None for
the base."""


@dataclass(frozen=True, eq=False, repr=False)
class NaturalView(Value):
    """Loops and held values as equations (1, x) M (1, x) = 0 in n unknowns, each with a bound of its error.

    Parameters
    ----------
    matrices
        Symmetric M, shape (N, n + 1, n + 1).
    errors
        Bounds (N,) of |(1, x) M (1, x)| at each exact configuration with the held values, from the goal's error and
        rounding.
    goal
        The unknowns at the goal, shape (n,).
    farthest
        Bounds (n,) of their absolute values: directions have length 1, points are within the reach of the links, and
        within ``SLIDE_REACH_MAX`` where slides bound nothing.
    links
        All links, by name.
    groups
        Of each group of links that have one rotation: an orthonormal basis (3, d), at the goal, of the directions used,
        and the places (d, 3) of their images; None for the base's.
    is_length
        True for unknowns that are coordinates of points, shape (n,).
    size
        Bound of the distance of two points.
    """

    matrices: Array
    errors: Array
    goal: Array
    farthest: Array
    links: dict[str, NaturalLink]
    groups: dict[str, tuple[Array, Places | None]]
    is_length: NDArray[np.bool_]
    size: float

    @property
    def has_products_of_lengths(self) -> NDArray[np.bool_]:
        """Return True for each equation with a product of a point, shape (N,)."""
        return np.any(self.matrices[:, 1:, 1:][:, self.is_length], axis=(1, 2))

    def narrow(self, farthest: Array) -> NaturalView:
        """Return the view with smaller bounds (n,) of the unknowns."""
        farthest = np.minimum(self.farthest, farthest)
        size = self.size - float(self.farthest.max(initial=1.0) - farthest.max(initial=1.0))
        errors = self.errors * np.where(self.has_products_of_lengths, size / self.size, 1.0)
        return replace(self, farthest=farthest, errors=errors, size=size)

    def direction(self, link: str, vector: Array) -> Array:
        """Rows (3, n + 1) of the image of a direction of a link, given at the goal."""
        return self._turned(self.links[link][0], vector)

    def point(self, link: str, place: Array) -> Array:
        """Rows (3, n + 1) of the image of a point of a link, given at the goal."""
        group, origin, places = self.links[link]
        return write_rows(places, origin, len(self.goal)) + self._turned(group, place - origin)

    def _turned(self, group: str, vector: Array) -> Array:
        basis, places = self.groups[group]
        return turn_rows(basis, places, vector, len(self.goal))


def write_rows(places: Places | None, value: Array, n: int) -> Array:
    """Affine rows (3, n + 1) of unknowns, or of a vector that does not move."""
    rows = np.zeros((3, n + 1))
    if places is None:
        rows[:, 0] = value
    else:
        rows[np.arange(3), places + 1] = 1.0
    return rows


def turn_rows(basis: Array, places: Places | None, vector: Array, n: int) -> Array:
    """Rows (3, n + 1) of the image of a vector in a basis (3, d) whose images are unknowns."""
    if places is None:
        return write_rows(None, vector, n)
    rows = np.zeros((3, n + 1))
    for part, triple in zip(basis.T @ vector, places, strict=True):
        rows[np.arange(3), triple + 1] = part
    return rows


def build_product(a: Array, b: Array) -> Array:
    """Symmetric matrix (n + 1, n + 1) of the sum of the products of rows a and b (k, n + 1)."""
    M = a.T @ b
    return np.asarray((M + M.T) / 2)


@dataclass(eq=False)
class _JointGeometry:
    """Joints and links of a robot at a goal, as they are read."""

    joints: list[Joint]
    names: list[str]
    base: str
    points: dict[tuple[str, str], Array]
    origins: dict[str, Array]
    axes: dict[tuple[str, str], list[Array]]
    held: list[tuple[str, Array, str]]
    loci: list[tuple[str, FixedValueLocus, str, float]]
    locked: set[str]
    length: float
    gears: list[_Gear] = field(default_factory=list)


@dataclass(frozen=True)
class _Gear:
    """Coupling of two slides, or of two rotations with the ratio p / q; ``units``: a direction (3,) of both links of
    each, at the goal, across its axis."""

    driver: Joint
    driven: Joint
    ratio: float
    p: int
    q: int
    units: tuple[Array, Array]

    @property
    def is_of_slides(self) -> bool:
        """True for two slides."""
        return self.driver.type is JointType.PRISMATIC

    @property
    def count(self) -> int:
        """Number of unknowns: of each power of both units the real and the imaginary part."""
        return 0 if self.is_of_slides else 2 * (abs(self.p) + self.q)


def read_natural_view(
    goal: ClosedConfiguration,
    observations: Collection[Observation],
    reference: str,
    left_out: Collection[str],
    kept_directions: Collection[tuple[str, Array]],
    error: float,
) -> NaturalView:
    """Return the natural view of a robot with the values of observations at a goal held.

    Parameters
    ----------
    goal
        Closed configuration, within ``error`` (m) of the exact one.
    observations, reference
        Observations with known loci, and encoders of all coordinates of a joint; the link from which they are measured.
    left_out
        Joints of legs that hold nothing, which are left out.
    kept_directions
        Links and directions (3,), at the goal, that are held besides.
    error
        How far points of links may be from their places at the exact goal (m).

    Raises
    ------
    UnsupportedLocus
        If a joint or an observation has no such equations.
    """
    length = goal.model.length
    geometry = _read(goal, observations, reference, left_out)
    geometry.held += [(link, direction, geometry.base) for link, direction in kept_directions if link in geometry.names]
    unite = {link: link for link in geometry.names}
    for joint in geometry.joints:
        if joint.type in RIGID or joint.name in geometry.locked:
            first, second = (unite[link] for link in joint.links)
            keep, gone = (second, first) if second == unite[geometry.base] else (first, second)
            unite = {link: keep if group == gone else group for link, group in unite.items()}
    used, spinning = _list_used_directions(geometry, unite)
    groups, places, miss, n = dict[str, tuple[Array, Places | None]](), list[Array](), 0.0, 0
    for group, vectors in used.items():
        basis = _build_orthonormal_basis(vectors)
        miss = max([miss, *(float(np.linalg.norm(v - basis @ (basis.T @ v))) for v in vectors)])
        if group == unite[geometry.base]:
            groups[group] = basis, None
            continue
        d = basis.shape[1]
        groups[group] = basis, n + np.arange(3 * d).reshape(d, 3)
        places.append(basis.T.ravel())
        n += 3 * d
    links = dict[str, NaturalLink]()
    for link in geometry.names:
        origin = geometry.origins[link]
        links[link] = unite[link], origin, None if link == geometry.base else n + np.arange(3)
        if link != geometry.base:
            places.append(origin)
            n += 3
    for gear in geometry.gears:
        places.append(np.tile([1.0, 0.0], gear.count // 2))
        n += gear.count
    reach = _bound_reach(geometry, links)
    farthest, is_length = np.ones(n), np.zeros(n, dtype=bool)
    for link, (_, _, triple) in links.items():
        if triple is not None:
            farthest[triple], is_length[triple] = reach[link], True
    farthest[~np.isfinite(farthest)] = SLIDE_REACH_MAX
    farthest *= 1.0 + REACH_MARGIN_FRACTION
    arms = [np.linalg.norm(at - links[link][1]) for (_, link), at in geometry.points.items()]
    size = 1.0 + float(farthest.max(initial=1.0)) + float(max(arms, default=0.0))
    view = NaturalView(
        np.zeros((0, n + 1, n + 1)), np.zeros(0), np.concatenate(places), farthest, links, groups, is_length, size
    )
    matrices = np.array(list(_list_equations(view, geometry, unite, spinning)))
    off = error / length + goal.residual + CHAIN_ROUNDING + miss
    view = replace(view, matrices=matrices)
    # two points and two directions; in products they are multiplied by what they are within
    return replace(view, errors=4.0 * off * np.where(view.has_products_of_lengths, size, 1.0))


def _read(
    goal: ClosedConfiguration, observations: Collection[Observation], reference: str, left_out: Collection[str]
) -> _JointGeometry:
    """Read joints at the goal, in each of their links; raises ``UnsupportedLocus``."""
    mechanism, length = goal.model.mechanism, goal.model.length
    joints = [joint for joint in mechanism.joints.values() if joint.name not in left_out]
    used = {mechanism.base, *(link for joint in joints for link in joint.links)}
    for seen in observations:
        used |= set() if isinstance(seen, Encoder) else {seen.link, seen.seen_from or reference}
    names = [link for link in mechanism.links if link in used]
    moved = {link: goal.pose(link) @ invert_pose(mechanism.links[link].pose) for link in names}
    points, axes = dict[tuple[str, str], Array](), dict[tuple[str, str], list[Array]]()
    for joint in joints:
        for link in joint.links:
            points[joint.name, link] = transform(moved[link], joint.point) / length
            axes[joint.name, link] = [moved[link][:3, :3] @ axis for axis in joint.axes]
    held, loci = list[tuple[str, Array, str]](), list[tuple[str, FixedValueLocus, str, float]]()
    counts = dict[str, int]()
    for seen in observations:
        if isinstance(seen, Encoder):
            counts[seen.joint] = counts.get(seen.joint, 0) + 1
            continue
        origin = seen.seen_from or reference
        if isinstance(seen, Direction):
            held.append((seen.link, goal.pose(seen.link)[:3, :3] @ seen.direction, origin))
            continue
        unknown = UnsupportedLocus(mechanism.name, f"the locus of {seen.text} is not known")
        if not isinstance(seen, CameraObservation | SeenAxis):
            raise unknown
        at = seen.sighting(goal.pose(origin), goal.pose(seen.link))
        if not (known := seen.loci(at)):
            raise unknown
        # rays and planes through a centre turn by the goal's error over its distance
        nearest = min(float(np.linalg.norm(place - at.C)) for place in (at.B, at.foot)) / length
        loci += [(seen.link, locus, origin, 1.0 + 1.0 / max(nearest, CENTRE_DISTANCE_MIN)) for locus in known]
    part = [name for name, count in counts.items() if count < mechanism.joints[name].type.freedoms]
    if part:
        raise UnsupportedLocus(mechanism.name, "an observation holds a part of a joint")
    locked = set(counts)
    pairs = [{gear.driver, gear.driven} for gear in mechanism.couplings]
    for _ in pairs:
        locked.update(*(pair for pair in pairs if locked & pair))
    for joint in joints:
        if joint.name in locked or joint.type is JointType.FIXED:  # one place of two links that move together
            points[joint.name, joint.successor] = points[joint.name, joint.predecessor]
    origins = {link: goal.pose(link)[:3, 3] / length for link in names}
    origins |= {link: at for (_, link), at in reversed(points.items())}
    geometry = _JointGeometry(joints, names, mechanism.base, points, origins, axes, held, loci, locked, length)
    geometry.gears = [
        _read_gear(geometry, mechanism, gear) for gear in mechanism.couplings if gear.driver not in locked
    ]
    return geometry


def _read_gear(geometry: _JointGeometry, mechanism: Mechanism, coupling: Coupling) -> _Gear:
    """Read a coupling of joints that are read; raises ``UnsupportedLocus``."""
    both = mechanism.joints[coupling.driver], mechanism.joints[coupling.driven]
    ratio = Fraction(coupling.ratio).limit_denominator(GEAR_RATIO_MAX)
    kinds = {joint.type for joint in both}
    if not {joint.name for joint in both} <= {joint.name for joint in geometry.joints}:
        raise UnsupportedLocus(mechanism.name, f"coupling {coupling.name} is of a leg that holds nothing")
    if kinds not in ({JointType.REVOLUTE}, {JointType.PRISMATIC}):
        raise UnsupportedLocus(mechanism.name, f"coupling {coupling.name} joins a rotation and a translation")
    is_whole = abs(float(ratio) - coupling.ratio) <= GEOMETRY_DIFFERENCE_TOL and 0 < abs(ratio) <= GEAR_RATIO_MAX
    if kinds == {JointType.REVOLUTE} and not is_whole:
        raise UnsupportedLocus(
            mechanism.name,
            f"coupling {coupling.name}: {coupling.ratio:g} is not a quotient of whole numbers up to {GEAR_RATIO_MAX}",
        )
    first, second = (find_perpendicular(geometry.axes[joint.name, joint.predecessor][0]) for joint in both)
    return _Gear(*both, coupling.ratio, ratio.numerator, ratio.denominator, (first, second))


def _list_used_directions(geometry: _JointGeometry, unite: dict[str, str]) -> tuple[dict[str, list[Array]], set[str]]:
    """Return the directions (3,) that joints and observations use of each group of links, and the U joints whose cross
    only turns a rod about itself, which nothing else feels."""
    used: dict[str, list[Array]] = {group: [] for group in unite.values()}
    origin = geometry.origins
    for link, direction, reference in geometry.held:
        used[unite[link]].append(direction)
        used[unite[reference]].append(direction)
    for joint in geometry.joints:
        for link in joint.links:
            at = geometry.points[joint.name, link]
            used[unite[link]].append(at - origin[link])
            if joint.type is not JointType.UNIVERSAL:
                used[unite[link]] += geometry.axes[joint.name, link][:1]
    for link, locus, reference, _ in geometry.loci:
        used[unite[reference]] += [*locus.normals]
        if locus.turns:
            used[unite[link]].append(locus.place)
        else:
            used[unite[link]].append(locus.place / geometry.length - origin[link])
            used[unite[reference]].append(locus.through / geometry.length - origin[reference])
    for gear in geometry.gears:
        for joint, unit in zip((gear.driver, gear.driven), gear.units, strict=True):
            used[unite[joint.successor]].append(unit)
            used[unite[joint.predecessor]] += [unit, np.cross(geometry.axes[joint.name, joint.predecessor][0], unit)]
    crosses = [
        (joint.name, unite[link], geometry.axes[joint.name, link][k])
        for joint in geometry.joints
        if joint.type is JointType.UNIVERSAL and joint.name not in geometry.locked
        for k, link in enumerate(joint.links)
    ]
    groups, base = [group for _, group, _ in crosses], unite[geometry.base]
    spinning = {
        name
        for name, group, _ in crosses
        if group != base and groups.count(group) == 1 and _build_orthonormal_basis(used[group]).shape[1] == 1
    }
    for name, group, axis in crosses:
        if name not in spinning:
            used[group].append(axis)
    return used, spinning


def _build_orthonormal_basis(vectors: list[Array]) -> Array:
    """Return an orthonormal basis (3, d) of what vectors span."""
    U, s, _ = np.linalg.svd(np.array([*vectors, np.zeros(3)]).T)
    return np.asarray(U[:, : int(np.sum(s > SPANNED_DIRECTION_MIN))])


def _bound_reach(geometry: _JointGeometry, links: dict[str, NaturalLink]) -> dict[str, float]:
    """Return how far the point of each link can be from the base frame's origin, over joints without slides."""
    reach = dict.fromkeys(links, np.inf)
    reach[geometry.base] = float(np.linalg.norm(links[geometry.base][1]))
    for _ in links:
        for joint in geometry.joints:
            if joint.type not in LINEAR and joint.name not in geometry.locked:
                continue
            far = sum(float(np.linalg.norm(geometry.points[joint.name, link] - links[link][1])) for link in joint.links)
            for near, next_link in (joint.links, joint.links[::-1]):
                reach[next_link] = min(reach[next_link], reach[near] + far)
    return reach


def _list_equations(
    view: NaturalView, geometry: _JointGeometry, unite: dict[str, str], spinning: set[str]
) -> Iterator[Array]:
    """Yield the matrices of all equations."""
    n = len(view.goal)
    unit = np.eye(1, n + 1)
    constant = build_product(unit, unit)
    for joint in geometry.joints:
        if joint.type is JointType.FREE:
            continue
        first, second = joint.links
        gap = view.point(first, geometry.points[joint.name, first]) - view.point(
            second, geometry.points[joint.name, second]
        )
        axes = [geometry.axes[joint.name, link] for link in joint.links]
        if joint.type in LINEAR or joint.name in geometry.locked:
            yield from (build_product(unit, row[None]) for row in gap)
        else:
            axis = view.direction(first, axes[0][0])
            if joint.type is JointType.PLANAR:
                yield build_product(axis, gap)
            else:
                for i, j in ((0, 1), (1, 2), (2, 0)):
                    yield build_product(axis[[i]], gap[[j]]) - build_product(axis[[j]], gap[[i]])
        if unite[first] == unite[second] or joint.name in spinning:
            continue
        if joint.type is JointType.UNIVERSAL:
            a, b = axes[0][0], axes[1][1]
            yield build_product(view.direction(first, a), view.direction(second, b)) - (a @ b) * constant
        elif joint.type is not JointType.SPHERICAL:
            same = view.direction(first, axes[0][0]) - view.direction(second, axes[1][0])
            yield from (build_product(unit, row[None]) for row in same)
    for link, direction, reference in geometry.held:
        same = view.direction(link, direction) - view.direction(reference, direction)
        yield from (build_product(unit, row[None]) for row in same)
    yield from _list_locus_equations(view, geometry)
    place = n - sum(gear.count for gear in geometry.gears)
    for gear in geometry.gears:
        yield from _list_gear_equations(view, geometry, gear, place)
        place += gear.count
    for basis, places in view.groups.values():
        if places is not None:
            yield from _list_rotation_equations(basis, [write_rows(triple, np.zeros(3), n) for triple in places], unit)


def _list_locus_equations(view: NaturalView, geometry: _JointGeometry) -> Iterator[Array]:
    """Yield that points stay in planes and on spheres, and that directions keep angles; over how much farther the
    error of a normal reaches."""
    unit = np.eye(1, len(view.goal) + 1)
    constant = build_product(unit, unit)
    for link, locus, reference, lever in geometry.loci:
        # a fixed plane is in no product, whose error would have the size of what it is multiplied by
        is_fixed = not locus.turns and view.groups[view.links[reference][0]][1] is None
        scale = 1.0 + lever * (view.size if is_fixed else 1.0) / 2
        if locus.turns:
            moved, value = view.direction(link, locus.place), locus.place
        else:
            place, through = locus.place / geometry.length, locus.through / geometry.length
            moved, value = view.point(link, place) - view.point(reference, through), place - through
        for normal in locus.normals:
            yield (build_product(view.direction(reference, normal), moved) - (normal @ value) * constant) / scale
        if locus.radius is not None:
            yield (build_product(moved, moved) - (value @ value) * constant) / 2


def _list_gear_equations(view: NaturalView, geometry: _JointGeometry, gear: _Gear, place: int) -> Iterator[Array]:
    """Yield that slides keep their ratio, or that powers of two rotations' complex units are one; unknowns from
    ``place`` on."""
    unit, rows = np.eye(1, len(view.goal) + 1), np.eye(len(view.goal) + 1)
    if gear.is_of_slides:
        moved = []
        for joint in (gear.driver, gear.driven):
            points = geometry.points[joint.name, joint.predecessor], geometry.points[joint.name, joint.successor]
            axis = geometry.axes[joint.name, joint.predecessor][0]
            gap = view.point(joint.successor, points[1]) - view.point(joint.predecessor, points[0])
            along = float(axis @ (points[1] - points[0]))
            moved.append(
                build_product(view.direction(joint.predecessor, axis), gap) - along * build_product(unit, unit)
            )
        yield (gear.ratio * moved[0] - moved[1]) / (1.0 + abs(gear.ratio))
        return
    ends = list[Array]()
    for joint, u, power in zip((gear.driver, gear.driven), gear.units, (abs(gear.p), gear.q), strict=True):
        axis = geometry.axes[joint.name, joint.predecessor][0]
        powers = [rows[[place + 1 + 2 * k, place + 2 + 2 * k]] for k in range(power)]  # cosine, sine
        place += 2 * power
        turned = view.direction(joint.successor, u)
        for across, row in zip((u, np.cross(axis, u)), powers[0], strict=True):
            yield build_product(view.direction(joint.predecessor, across), turned) - build_product(unit, row[None])
        flipped = np.array([[1.0], [-1.0]]) * powers[0]
        for before, after in zip([np.vstack([unit, 0 * unit]), *powers], powers, strict=False):
            yield build_product(after, after) - build_product(unit, unit)
            for factor, first, second in ((powers[0], before, after), (flipped, after, before)):
                yield build_product(factor * [[1.0], [-1.0]], first) - build_product(unit, second[:1])
                yield build_product(factor[::-1], first) - build_product(unit, second[1:])
        ends.append(powers[-1])
    yield build_product(unit, ends[0][:1] - ends[1][:1])
    yield build_product(unit, np.sign(gear.p) * ends[0][1:] - ends[1][1:])


def _list_rotation_equations(basis: Array, columns: list[Array], unit: Array) -> Iterator[Array]:
    """Yield that images of orthonormal vectors are orthonormal; of three, the rows too, and each the product of two."""
    constant = build_product(unit, unit)
    for i, a in enumerate(columns):
        for j, b in enumerate(columns[: i + 1]):
            yield build_product(a, b) - float(i == j) * constant
    if len(columns) < 3:
        return
    sign = np.sign(np.linalg.det(basis))
    for k in range(3):
        a, b, c = columns[k - 2], columns[k - 1], columns[k]
        for i, j, r in ((1, 2, 0), (2, 0, 1), (0, 1, 2)):
            cross = build_product(a[[i]], b[[j]]) - build_product(a[[j]], b[[i]])
            yield cross - sign * build_product(unit, c[[r]])
    for i in range(3):
        for j in range(i + 1):
            rows = [np.array([column[r] for column in columns]) for r in (i, j)]
            yield build_product(*rows) - float(i == j) * constant
