"""Natural view of a robot's loops: of each link a point and the directions that its joints use, in the base frame.

A joint that only rotates and a held direction are linear in them, a slide is bilinear, and scalar products of a link's
directions are constant (J. García de Jalón and E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems, 1994,
chapter 2). Lengths are in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import UnsupportedLocus
from ..geometry.vectors import Array, invert_pose, transform
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Direction, Joint, JointType, Observation
from ..mechanism.observations.encoder import Encoder
from ..results import Value
from ..tolerances import CHAIN_ROUNDING

SPANNED_DIRECTION_MIN = 1e-6
"""Directions of a link that differ by less are one; by how much they differ is part of the equations' error."""
RIGID = frozenset({JointType.PRISMATIC, JointType.FIXED})
"""Joints whose two links have one rotation."""
SLIDE_REACH = 100.0
"""Bound of what only slides reach (characteristic lengths): solutions beyond are not sought."""
LINEAR = frozenset({JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL, JointType.FIXED})
"""Joints whose two links share a point."""


@dataclass(frozen=True, eq=False, repr=False)
class NaturalView(Value):
    """Loops and held values as equations (1, x) M (1, x) = 0 in n unknowns, each with a bound of its error.

    Parameters
    ----------
    matrices
        Symmetric M, shape (N, n + 1, n + 1).
    errors
        Bounds (N,) of |(1, x) M (1, x)| at each exact configuration with the held values: the goal's error and rounding.
    goal
        The unknowns at the goal, shape (n,).
    farthest
        Bounds (n,) of their absolute values: directions have length 1, points are within the reach of the links, and
        within ``SLIDE_REACH`` where slides bound nothing.
    links
        Of each link: its rotation's group, the point (3,) that is its unknown, both at the goal, and the unknowns'
        places; None for the base.
    groups
        Of each group of links that have one rotation: an orthonormal basis (3, d), at the goal, of the directions used,
        and the places (d, 3) of their images; None for the base's.
    """

    matrices: Array
    errors: Array
    goal: Array
    farthest: Array
    links: dict[str, tuple[str, Array, Array | None]]
    groups: dict[str, tuple[Array, Array | None]]

    def direction(self, link: str, vector: Array) -> Array:
        """Rows (3, n + 1) of the image of a direction of a link, given at the goal."""
        return self._turned(self.links[link][0], vector)

    def point(self, link: str, place: Array) -> Array:
        """Rows (3, n + 1) of the image of a point of a link, given at the goal."""
        group, origin, places = self.links[link]
        return _rows(places, origin, len(self.goal)) + self._turned(group, place - origin)

    def _turned(self, group: str, vector: Array) -> Array:
        basis, places = self.groups[group]
        return turn_rows(basis, places, vector, len(self.goal))


def _rows(places: Array | None, value: Array, n: int) -> Array:
    """Affine rows (3, n + 1) of unknowns, or of a vector that does not move."""
    rows = np.zeros((3, n + 1))
    if places is None:
        rows[:, 0] = value
    else:
        rows[np.arange(3), places + 1] = 1.0
    return rows


def turn_rows(basis: Array, places: Array | None, vector: Array, n: int) -> Array:
    """Rows (3, n + 1) of the image of a vector in a basis (3, d) whose images are unknowns."""
    if places is None:
        return _rows(None, vector, n)
    rows = np.zeros((3, n + 1))
    for part, each in zip(basis.T @ vector, places, strict=True):
        rows[np.arange(3), each + 1] = part
    return rows


def multiply_rows(a: Array, b: Array) -> Array:
    """Symmetric matrix (n + 1, n + 1) of the sum of the products of rows a and b (k, n + 1)."""
    M = a.T @ b
    return np.asarray((M + M.T) / 2)


@dataclass(eq=False)
class _Reading:
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
    idle: Collection[str],
    resting: Collection[tuple[str, Array]],
    error: float,
) -> NaturalView:
    """Return the natural view of a robot with the values of observations at a goal held.

    Parameters
    ----------
    goal
        Closed configuration, within ``error`` (m) of the exact one.
    observations
        Directions seen from the base, and encoders of all coordinates of a joint.
    idle
        Joints of legs that hold nothing, which are left out.
    resting
        Links and directions (3,), at the goal, that are held besides.
    error
        How far points of links may be from their places at the exact goal (m).

    Raises
    ------
    UnsupportedLocus
        If a joint or an observation has no such equations.
    """
    mechanism, length = goal.model.mechanism, goal.model.length
    reading = _read(goal, observations, idle)
    reading.held += [(link, direction) for link, direction in resting if link in reading.names]
    unite = {link: link for link in reading.names}
    for joint in reading.joints:
        if joint.type in RIGID or joint.name in reading.locked:
            one, other = (unite[link] for link in joint.links)
            keep, gone = (other, one) if other == unite[reading.base] else (one, other)
            unite = {link: keep if group == gone else group for link, group in unite.items()}
    used, spinning = _used_directions(reading, unite)
    groups, places, miss, n = dict[str, tuple[Array, Array | None]](), list[Array](), 0.0, 0
    for group, vectors in used.items():
        basis = _orthonormal_basis(vectors)
        miss = max([miss, *(float(np.linalg.norm(v - basis @ (basis.T @ v))) for v in vectors)])
        if group == unite[reading.base]:
            groups[group] = basis, None
            continue
        d = basis.shape[1]
        groups[group] = basis, n + np.arange(3 * d).reshape(d, 3)
        places.append(basis.T.ravel())
        n += 3 * d
    links = dict[str, tuple[str, Array, Array | None]]()
    for link in reading.names:
        origin = next(at for (_, name), at in reading.points.items() if name == link)
        links[link] = unite[link], origin, None if link == reading.base else n + np.arange(3)
        if link != reading.base:
            places.append(origin)
            n += 3
    reach = _reach(reading, links)
    farthest = np.ones(n)
    for link, (_, _, own) in links.items():
        if own is not None:
            farthest[own] = reach[link]
    farthest[~np.isfinite(farthest)] = SLIDE_REACH
    size = 1.0 + float(farthest.max(initial=1.0))
    view = NaturalView(np.zeros((0, n + 1, n + 1)), np.zeros(0), np.concatenate(places), farthest, links, groups)
    matrices = np.array(list(_equations(view, reading, unite, spinning)))
    off = error / length + goal.residual + CHAIN_ROUNDING + miss
    # two points and two directions; in products they are multiplied by what they are within
    linear = ~np.any(matrices[:, 1:, 1:], axis=(1, 2))
    errors = off * np.where(linear, 4.0, 4.0 * size)
    return NaturalView(matrices, errors, view.goal, farthest, links, groups)


def _read(goal: ClosedConfiguration, observations: Collection[Observation], idle: Collection[str]) -> _Reading:
    """Read joints at the goal, in each of their links; raises ``UnsupportedLocus``."""
    mechanism, length = goal.model.mechanism, goal.model.length
    if mechanism.couplings:
        raise UnsupportedLocus(mechanism.name, "couplings are not linear in points and directions")
    joints = [joint for joint in mechanism.joints.values() if joint.name not in idle]
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
    for each in observations:
        if isinstance(each, Encoder):
            counts[each.joint] = counts.get(each.joint, 0) + 1
        elif isinstance(each, Direction) and (each.seen_from or mechanism.base) == mechanism.base:
            held.append((each.link, goal.pose(each.link)[:3, :3] @ each.direction))
        else:
            raise UnsupportedLocus(mechanism.name, "an observation is not a direction seen from the base")
    part = [name for name, count in counts.items() if count < mechanism.joints[name].type.freedoms]
    if part or any(link not in names for link, _ in held):
        raise UnsupportedLocus(mechanism.name, "an observation holds a part of a joint")
    for joint in joints:
        if joint.name in counts or joint.type is JointType.FIXED:  # one place of two links that move together
            points[joint.name, joint.successor] = points[joint.name, joint.predecessor]
    return _Reading(joints, names, mechanism.base, points, axes, held, set(counts))


def _used_directions(reading: _Reading, unite: dict[str, str]) -> tuple[dict[str, list[Array]], set[str]]:
    """Return the directions (3,) that joints and observations use of each group of links, and the U joints whose cross
    only turns a rod about itself, which nothing else feels."""
    used: dict[str, list[Array]] = {group: [] for group in unite.values()}
    origin = dict[str, Array]()
    for link, direction in reading.held:
        used[unite[link]].append(direction)
    for joint in reading.joints:
        for link in joint.links:
            at = reading.points[joint.name, link]
            used[unite[link]].append(at - origin.setdefault(link, at))
            if joint.type is not JointType.UNIVERSAL:
                used[unite[link]] += reading.axes[joint.name, link][:1]
    crosses = [
        (joint.name, unite[link], reading.axes[joint.name, link][k])
        for joint in reading.joints
        if joint.type is JointType.UNIVERSAL and joint.name not in reading.locked
        for k, link in enumerate(joint.links)
    ]
    groups, base = [group for _, group, _ in crosses], unite[reading.base]
    spinning = {
        name
        for name, group, _ in crosses
        if group != base and groups.count(group) == 1 and _orthonormal_basis(used[group]).shape[1] == 1
    }
    for name, group, axis in crosses:
        if name not in spinning:
            used[group].append(axis)
    return used, spinning


def _orthonormal_basis(vectors: list[Array]) -> Array:
    """Return an orthonormal basis (3, d) of what vectors span."""
    U, s, _ = np.linalg.svd(np.array([*vectors, np.zeros(3)]).T)
    return np.asarray(U[:, : int(np.sum(s > SPANNED_DIRECTION_MIN))])


def _reach(reading: _Reading, links: dict[str, tuple[str, Array, Array | None]]) -> dict[str, float]:
    """Return how far the point of each link can be from the frame's origin: shortest ways over joints without slides."""
    reach = dict.fromkeys(links, np.inf)
    reach[reading.base] = float(np.linalg.norm(links[reading.base][1]))
    for _ in links:
        for joint in reading.joints:
            if joint.type not in LINEAR and joint.name not in reading.locked:
                continue
            far = sum(float(np.linalg.norm(reading.points[joint.name, link] - links[link][1])) for link in joint.links)
            for one, other in (joint.links, joint.links[::-1]):
                reach[other] = min(reach[other], reach[one] + far)
    return reach


def _equations(view: NaturalView, reading: _Reading, unite: dict[str, str], spinning: set[str]) -> Iterator[Array]:
    """Yield the matrices of all equations."""
    n = len(view.goal)
    one = np.eye(1, n + 1)
    constant = multiply_rows(one, one)
    for joint in reading.joints:
        first, second = joint.links
        gap = view.point(first, reading.points[joint.name, first]) - view.point(
            second, reading.points[joint.name, second]
        )
        axes = [reading.axes[joint.name, link] for link in joint.links]
        if joint.type in LINEAR or joint.name in reading.locked:
            yield from (multiply_rows(one, row[None]) for row in gap)
        else:
            axis = view.direction(first, axes[0][0])
            if joint.type is JointType.PLANAR:
                yield multiply_rows(axis, gap)
            else:
                for i, j in ((0, 1), (1, 2), (2, 0)):
                    yield multiply_rows(axis[[i]], gap[[j]]) - multiply_rows(axis[[j]], gap[[i]])
        if unite[first] == unite[second] or joint.name in spinning:
            continue
        if joint.type is JointType.UNIVERSAL:
            a, b = axes[0][0], axes[1][1]
            yield multiply_rows(view.direction(first, a), view.direction(second, b)) - (a @ b) * constant
        elif joint.type is not JointType.SPHERICAL:
            same = view.direction(first, axes[0][0]) - view.direction(second, axes[1][0])
            yield from (multiply_rows(one, row[None]) for row in same)
    for link, direction in reading.held:
        same = view.direction(link, direction) - _rows(None, direction, n)
        yield from (multiply_rows(one, row[None]) for row in same)
    for basis, places in view.groups.values():
        if places is not None:
            yield from _rotation_equations(basis, [_rows(each, np.zeros(3), n) for each in places], one)


def _rotation_equations(basis: Array, columns: list[Array], one: Array) -> Iterator[Array]:
    """Yield: images of orthonormal vectors are orthonormal; of three, the rows too, and each is the product of two."""
    constant = multiply_rows(one, one)
    for i, a in enumerate(columns):
        for j, b in enumerate(columns[: i + 1]):
            yield multiply_rows(a, b) - float(i == j) * constant
    if len(columns) < 3:
        return
    sign = np.sign(np.linalg.det(basis))
    for k in range(3):
        a, b, c = columns[k - 2], columns[k - 1], columns[k]
        for i, j, r in ((1, 2, 0), (2, 0, 1), (0, 1, 2)):
            cross = multiply_rows(a[[i]], b[[j]]) - multiply_rows(a[[j]], b[[i]])
            yield cross - sign * multiply_rows(one, c[[r]])
    for i in range(3):
        for j in range(i + 1):
            rows = [np.array([each[r] for each in columns]) for r in (i, j)]
            yield multiply_rows(*rows) - float(i == j) * constant
