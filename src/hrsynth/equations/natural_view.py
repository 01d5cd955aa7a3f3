"""Natural view of a robot's loops: of each link a point and the directions that its joints use, in the base frame.

A joint that only rotates and a held direction are linear in them, a slide is bilinear, and scalar products of a link's
directions are constant (J. García de Jalón and E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems, 1994,
chapter 2). Lengths are in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import UnsupportedLocus
from ..geometry.vectors import Array, invert_pose, transform
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Direction, Joint, JointType, Observation
from ..mechanism.observations.encoder import Encoder
from ..results import Value
from ..tolerances import CHAIN_ROUNDING

SPANNED_DIRECTION_MIN = 1e-6
"""Directions of a link that differ by less are one; by how much they differ is part of the equations' error."""
REACH_MARGIN_FRACTION = 1e-6
"""By how much bounds are larger, relative to them: more than errors of the geometry add."""
RIGID = frozenset({JointType.PRISMATIC, JointType.FIXED})
"""Joints whose two links have one rotation."""
SLIDE_REACH_MAX = 100.0
"""Bound of what only slides reach (characteristic lengths): solutions beyond are not sought."""
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
    """

    matrices: Array
    errors: Array
    goal: Array
    farthest: Array
    links: dict[str, NaturalLink]
    groups: dict[str, tuple[Array, Places | None]]

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
    axes: dict[tuple[str, str], list[Array]]
    held: list[tuple[str, Array]]
    locked: set[str]


def read_natural_view(
    goal: ClosedConfiguration,
    observations: Collection[Observation],
    left_out: Collection[str],
    kept_directions: Collection[tuple[str, Array]],
    error: float,
) -> NaturalView:
    """Return the natural view of a robot with the values of observations at a goal held.

    Parameters
    ----------
    goal
        Closed configuration, within ``error`` (m) of the exact one.
    observations
        Directions seen from the base, and encoders of all coordinates of a joint.
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
    geometry = _read(goal, observations, left_out)
    geometry.held += [(link, direction) for link, direction in kept_directions if link in geometry.names]
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
        origin = next(at for (_, name), at in geometry.points.items() if name == link)
        links[link] = unite[link], origin, None if link == geometry.base else n + np.arange(3)
        if link != geometry.base:
            places.append(origin)
            n += 3
    reach = _bound_reach(geometry, links)
    farthest = np.ones(n)
    for link, (_, _, triple) in links.items():
        if triple is not None:
            farthest[triple] = reach[link]
    farthest[~np.isfinite(farthest)] = SLIDE_REACH_MAX
    farthest *= 1.0 + REACH_MARGIN_FRACTION
    arms = [np.linalg.norm(at - links[link][1]) for (_, link), at in geometry.points.items()]
    size = 1.0 + float(farthest.max(initial=1.0)) + float(max(arms, default=0.0))
    view = NaturalView(np.zeros((0, n + 1, n + 1)), np.zeros(0), np.concatenate(places), farthest, links, groups)
    matrices = np.array(list(_list_equations(view, geometry, unite, spinning)))
    off = error / length + goal.residual + CHAIN_ROUNDING + miss
    # two points and two directions; in products they are multiplied by what they are within
    linear = ~np.any(matrices[:, 1:, 1:], axis=(1, 2))
    errors = off * np.where(linear, 4.0, 4.0 * size)
    return replace(view, matrices=matrices, errors=errors)


def _read(
    goal: ClosedConfiguration, observations: Collection[Observation], left_out: Collection[str]
) -> _JointGeometry:
    """Read joints at the goal, in each of their links; raises ``UnsupportedLocus``."""
    mechanism, length = goal.model.mechanism, goal.model.length
    if mechanism.couplings:
        raise UnsupportedLocus(mechanism.name, "couplings are not linear in points and directions")
    joints = [joint for joint in mechanism.joints.values() if joint.name not in left_out]
    names = [link for link in mechanism.links if any(link in joint.links for joint in joints)]
    moved = {link: goal.pose(link) @ invert_pose(mechanism.links[link].pose) for link in names}
    points, axes = dict[tuple[str, str], Array](), dict[tuple[str, str], list[Array]]()
    for joint in joints:
        if joint.type is JointType.FREE:
            raise UnsupportedLocus(mechanism.name, f"joint {joint.name} holds nothing")
        for link in joint.links:
            points[joint.name, link] = transform(moved[link], joint.point) / length
            axes[joint.name, link] = [moved[link][:3, :3] @ axis for axis in joint.axes]
    held, counts = list[tuple[str, Array]](), dict[str, int]()
    for seen in observations:
        if isinstance(seen, Encoder):
            counts[seen.joint] = counts.get(seen.joint, 0) + 1
        elif isinstance(seen, Direction) and (seen.seen_from or mechanism.base) == mechanism.base:
            held.append((seen.link, goal.pose(seen.link)[:3, :3] @ seen.direction))
        else:
            raise UnsupportedLocus(mechanism.name, "an observation is not a direction seen from the base")
    part = [name for name, count in counts.items() if count < mechanism.joints[name].type.freedoms]
    if part or any(link not in names for link, _ in held):
        raise UnsupportedLocus(mechanism.name, "an observation holds a part of a joint")
    for joint in joints:
        if joint.name in counts or joint.type is JointType.FIXED:  # one place of two links that move together
            points[joint.name, joint.successor] = points[joint.name, joint.predecessor]
    return _JointGeometry(joints, names, mechanism.base, points, axes, held, set(counts))


def _list_used_directions(geometry: _JointGeometry, unite: dict[str, str]) -> tuple[dict[str, list[Array]], set[str]]:
    """Return the directions (3,) that joints and observations use of each group of links, and the U joints whose cross
    only turns a rod about itself, which nothing else feels."""
    used: dict[str, list[Array]] = {group: [] for group in unite.values()}
    origin = dict[str, Array]()
    for link, direction in geometry.held:
        used[unite[link]].append(direction)
    for joint in geometry.joints:
        for link in joint.links:
            at = geometry.points[joint.name, link]
            used[unite[link]].append(at - origin.setdefault(link, at))
            if joint.type is not JointType.UNIVERSAL:
                used[unite[link]] += geometry.axes[joint.name, link][:1]
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
    for link, direction in geometry.held:
        same = view.direction(link, direction) - write_rows(None, direction, n)
        yield from (build_product(unit, row[None]) for row in same)
    for basis, places in view.groups.values():
        if places is not None:
            yield from _list_rotation_equations(basis, [write_rows(triple, np.zeros(3), n) for triple in places], unit)


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
