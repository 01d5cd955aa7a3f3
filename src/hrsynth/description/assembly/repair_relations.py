"""Relations that nearly hold between joints: axes parallel, perpendicular, coaxial, through one point; centres in a
plane, in line with an axis; rods equal.

All axes that are nearly parallel are one direction, all lines and spherical joints that nearly meet share one
point (a *place*): so spherical and planar loops, U joints and S of several R need no relation of their own. Lengths in
characteristic lengths; a *defect* is the residual of a relation (characteristic lengths, radians).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...geometry import lines
from ...geometry.vectors import Array, normalise_vector
from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism

COMPLEX_STEP_MAX = 1e-20
"""Imaginary step of the slope of a polynomial, exact because nothing cancels."""
AXIS_MEETING_SINE_MIN = 0.1
"""Sine of the angle between two axes below which their intersection is not computed."""
LINK_INCIDENCE_JOINTS_MAX = 40
"""Joints of one link above which their incidences are not searched."""

LINES = (JointType.REVOLUTE, JointType.CYLINDRICAL)
BALLS = (JointType.SPHERICAL, JointType.UNIVERSAL)
Vectors = NDArray[Any]
"""Vectors (..., 3), real or complex."""


@dataclass(frozen=True, eq=False)
class RepairRelation:
    """Equation f(v₁, v₂, …) = 0 of points and directions; f is a polynomial, (..., 3) → (..., m), real or complex.
    ``at`` is the first coordinate of each of its vectors; ``kind`` and ``of`` name it."""

    kind: str
    of: tuple[str, ...]
    function: Callable[..., Vectors]
    at: tuple[int, ...]
    defect: float

    def value(self, x: Array) -> Array:
        """Return f, shape (m,)."""
        return np.asarray(self.function(*(x[i : i + 3] for i in self.at)))

    def gradient(self, x: Array) -> Array:
        """Return its derivative (m, len(x)), by a complex step: Im f(x + ih e) / h, without differences."""
        count = 3 * len(self.at)
        steps = np.array([x[i : i + 3] for i in self.at]) + 1j * COMPLEX_STEP_MAX * np.eye(count).reshape(count, -1, 3)
        by_coordinate = self.function(*np.moveaxis(steps, 1, 0)).imag.T / COMPLEX_STEP_MAX
        J = np.zeros((len(by_coordinate), len(x)))
        for number, start in enumerate(self.at):
            J[:, start : start + 3] += by_coordinate[:, 3 * number : 3 * number + 3]
        return J


def _normal(u: Vectors, v: Vectors) -> Vectors:
    return np.sum(u * v, axis=-1)[..., None]


def _length(u: Vectors) -> Vectors:
    return (_normal(u, u) - 1) / 2


def _on_line(p: Vectors, q: Vectors, a: Vectors) -> Vectors:
    return np.cross(p - q, a)


def _across(p: Vectors, q: Vectors, a: Vectors) -> Vectors:
    return _normal(p - q, a)


def _coplanar(p: Vectors, q: Vectors, r: Vectors, s: Vectors) -> Vectors:
    return _normal(p - s, np.cross(q - s, r - s))


def _equal(p: Vectors, q: Vectors, r: Vectors, s: Vectors) -> Vectors:
    return q - p - s + r


def _equal_across(p: Vectors, q: Vectors, r: Vectors, s: Vectors, a: Vectors) -> Vectors:
    return np.cross(q - p - s + r, a)


class Bodies:
    """Bodies of links connected by joints of types ``held``; ``on`` are the joints on each."""

    def __init__(self, mechanism: Mechanism, held: Container[JointType] = (JointType.FIXED,)) -> None:
        fixed = (j.links for j in mechanism.joints.values() if j.type in held)
        groups = graphs.list_components(graphs.build_adjacency(mechanism.links, fixed))
        self.of = {link: number for number, group in enumerate(groups) for link in group}
        self.on: dict[int, list[Joint]] = defaultdict(list)
        for joint in mechanism.joints.values():
            if joint.type not in (JointType.FIXED, JointType.FREE):
                for body in {self.of[link] for link in joint.links}:
                    self.on[body].append(joint)

    def pairs(self) -> Iterator[tuple[Joint, Joint]]:
        """Yield two joints on one body, of bodies with few joints."""
        for joints in self.on.values():
            if len(joints) <= LINK_INCIDENCE_JOINTS_MAX:
                yield from combinations(joints, 2)


class JointCoordinates:
    """Directions, centres and points of a mechanism in one vector ``start``, each with its weight; points or axes
    ``within`` each other are one."""

    def __init__(self, mechanism: Mechanism, bodies: Bodies, within: float) -> None:
        self.mechanism, self.within = mechanism, within
        joints = list(mechanism.joints.values())
        self._vectors: list[Array] = []
        self.weights: list[float] = []
        axes = [(joint.name, k) for joint in joints for k in range(len(joint.axes))]
        vectors = np.array([mechanism.joints[name].axes[k] for name, k in axes]).reshape(-1, 3)
        self.direction: dict[tuple[str, int], tuple[int, float]] = {}
        """Coordinate of the direction of each axis, and the axis' sense along it."""
        self.members: dict[int, list[tuple[str, int]]] = {}
        for group in _clusters(np.linalg.norm(np.cross(vectors[:, None], vectors[None]), axis=2), within):
            senses = [1.0 if vectors[i] @ vectors[group[0]] > 0 else -1.0 for i in group]
            at = self._add(
                normalise_vector(np.sum([s * vectors[i] for s, i in zip(senses, group, strict=True)], axis=0)),
                len(group) ** 0.5,
            )
            self.members[at] = [axes[i] for i in group]
            self.direction.update({axes[i]: (at, s) for s, i in zip(senses, group, strict=True)})
        self.point = {joint.name: self._add(joint.point / mechanism.length) for joint in joints}
        self.places: dict[int, list[str]] = {}
        """Coordinate of each point and the joints whose lines or centres it is on."""
        self._find_places(bodies)

    @property
    def start(self) -> Array:
        """Return the coordinates of the mechanism as it is, directions in the middle of their groups."""
        return np.concatenate(self._vectors)

    @property
    def scale(self) -> Array:
        """Return the weight of each coordinate."""
        return np.repeat(self.weights, 3)

    def _add(self, vector: Array, weight: float = 1.0) -> int:
        self._vectors.append(vector)
        self.weights.append(weight)
        return 3 * len(self._vectors) - 3

    def axis_of(self, joint: Joint) -> int:
        """Return the coordinate of the direction of a joint's axis."""
        return self.direction[joint.name, 0][0]

    def _find_places(self, bodies: Bodies) -> None:
        """Merge nearly coincident intersections of axes on one body and spherical joints to one point, with all axes
        through it."""
        length = self.mechanism.length
        found: list[Array] = []
        for one, two in bodies.pairs():
            if (
                one.type in LINES
                and two.type in LINES
                and self.axis_of(one) != self.axis_of(two)
                and float(np.linalg.norm(np.cross(one.axis, two.axis))) > AXIS_MEETING_SINE_MIN
            ):
                ends = lines.find_common_perpendicular(one.point, one.axis, two.point, two.axis)
                if float(np.linalg.norm(ends[1] - ends[0])) <= self.within * length:
                    found.append((ends[0] + ends[1]) / 2 / length)
        balls = [joint for joint in self.mechanism.joints.values() if joint.type in BALLS]
        straight = [joint for joint in self.mechanism.joints.values() if joint.type in LINES]
        points = np.array([*(ball.point / length for ball in balls), *found]).reshape(-1, 3)
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)
        for group in _clusters(apart, 2 * self.within):
            centres = [balls[i] for i in group if i < len(balls)]
            middle = np.mean(points[group], axis=0)
            through = [
                j
                for j in straight
                if lines.measure_line_distance(length * middle, j.point, j.axis) <= self.within * length
            ]
            if len(centres) + len(through) > 1:
                at = self.point[centres[0].name] if centres else self._add(middle, 0.1)
                self.places[at] = [joint.name for joint in (*centres, *through)]

    def mechanism_of(self, x: Array) -> Mechanism:
        """Return the mechanism with other centres and axes."""
        joints, centre = {}, dict(self.point)
        for place, names in self.places.items():
            centre.update(
                {
                    name: place
                    for name in names
                    if np.linalg.norm(
                        self.start[place : place + 3] - self.mechanism.joints[name].point / self.mechanism.length
                    )
                    <= self.within
                }
            )
        for name, joint in self.mechanism.joints.items():
            axes = tuple(
                sense * x[at : at + 3] for at, sense in (self.direction[name, k] for k in range(len(joint.axes)))
            )
            at = centre[name]
            joints[name] = replace(joint, point=x[at : at + 3] * self.mechanism.length, axes=axes)
        return replace(self.mechanism, joints=joints)


def _clusters(apart: Array, within: float) -> list[list[int]]:
    """Return groups of numbers joined by distances (n, n) up to ``within``."""
    if not len(apart):
        return []
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(apart <= within, directed=False)
    return [np.flatnonzero(label == k).tolist() for k in range(count)]


def list_definitions(at: JointCoordinates) -> Iterator[RepairRelation]:
    """Yield the relations that hold by definition: directions have length one, the axes of a U are perpendicular."""
    for i in at.members:
        yield RepairRelation("unit", (), _length, (i,), 0.0)
    for joint in at.mechanism.joints.values():
        if joint.type is JointType.UNIVERSAL:
            yield _perpendicular(
                at, joint.name, joint.name, at.direction[joint.name, 0][0], at.direction[joint.name, 1][0]
            )


def list_axis_relations(at: JointCoordinates, bodies: Bodies) -> Iterator[RepairRelation]:
    """Yield candidates among axes and centres: parallel, perpendicular on a body, coaxial on a body, through a
    point."""
    x, length = at.start, at.mechanism.length
    for i, members in at.members.items():
        if len(members) > 1:
            worst = max(
                float(np.linalg.norm(np.cross(at.mechanism.joints[name].axes[k], x[i : i + 3]))) for name, k in members
            )
            yield RepairRelation("parallel", tuple(dict.fromkeys(name for name, _ in members)), _length, (i,), worst)
    seen = set()
    for one, two in Bodies(
        at.mechanism, (JointType.FIXED, JointType.PRISMATIC)
    ).pairs():  # prismatic joints keep directions
        for k in range(len(one.axes)):
            for m in range(len(two.axes)):
                i, j = sorted((at.direction[one.name, k][0], at.direction[two.name, m][0]))
                if i != j and (i, j) not in seen:
                    seen.add((i, j))
                    yield _perpendicular(at, one.name, two.name, i, j)
    for one, two in bodies.pairs():
        if one.type in LINES and two.type in LINES and at.axis_of(one) == at.axis_of(two):
            miss = lines.measure_line_distance(one.point, two.point, two.axis) / length
            yield RepairRelation(
                "coaxial",
                (one.name, two.name),
                _on_line,
                (at.point[one.name], at.point[two.name], at.axis_of(one)),
                miss,
            )
    for i, names in at.places.items():
        for name in names:
            joint, place = at.mechanism.joints[name], x[i : i + 3]
            if joint.type in LINES:
                miss = lines.measure_line_distance(place, joint.point / length, joint.axis)
                yield RepairRelation(
                    "through one point", tuple(names), _on_line, (i, at.point[name], at.axis_of(joint)), miss
                )
            elif at.point[name] != i:
                miss = float(np.linalg.norm(place - joint.point / length))
                yield RepairRelation("through one point", tuple(names), np.subtract, (i, at.point[name]), miss)


def _perpendicular(at: JointCoordinates, one: str, two: str, i: int, j: int) -> RepairRelation:
    x = at.start
    return RepairRelation(
        "perpendicular", tuple(dict.fromkeys((one, two))), _normal, (i, j), abs(float(x[i : i + 3] @ x[j : j + 3]))
    )


def list_centre_relations(at: JointCoordinates, normal: Mechanism, x: Array) -> Iterator[RepairRelation]:
    """Yield candidates among the spherical joints of the ``normal`` form of a mechanism with coordinates ``x``: in line
    with an axis or normal to it, in one plane; rods between the same bodies equal."""
    bodies = Bodies(normal)
    balls_of_one = [at.point[joint.name] for joint in at.mechanism.joints.values() if joint.type in BALLS]
    spots = list(dict.fromkeys((*at.places, *balls_of_one)))
    points, ways = (np.array([x[i : i + 3] for i in each]) for each in (spots, list(at.members)))

    def spot(joint: Joint) -> int:
        """Return the coordinate of a joint's centre."""
        if joint.type not in BALLS:
            return at.point[joint.name]
        return spots[int(np.argmin(np.linalg.norm(points - joint.point / at.mechanism.length, axis=1)))]

    def way(axis: Array) -> int:
        """Return the coordinate of an axis."""
        return list(at.members)[int(np.argmin(np.linalg.norm(np.cross(ways, axis), axis=1)))]

    def vector(i: int) -> Array:
        return start[i : i + 3]

    start = at.start
    for joints in bodies.on.values():
        if len(joints) > LINK_INCIDENCE_JOINTS_MAX:
            continue
        balls = [joint for joint in joints if joint.type in BALLS]
        axes = {way(axis): joint.name for joint in joints for axis in joint.axes}
        for one, two in combinations(balls, 2):
            i, j = spot(one), spot(two)
            arm = vector(i) - vector(j)
            size = float(np.linalg.norm(arm))
            if size <= at.within / AXIS_MEETING_SINE_MIN:
                continue
            for a, name in axes.items():
                names = (one.name, two.name, name)
                yield RepairRelation(
                    "in line with an axis", names, _on_line, (i, j, a), float(np.linalg.norm(np.cross(arm, vector(a))))
                )
                yield RepairRelation("normal to an axis", names, _across, (i, j, a), abs(float(arm @ vector(a))))
        yield from _flat([(joint.name, spot(joint)) for joint in balls], vector, at.within)
    for slide in normal.joints.values():
        ends = [[each for each in bodies.on[bodies.of[link]] if each.type in BALLS] for link in slide.links]
        for one, two in product(*ends) if slide.type is JointType.PRISMATIC else ():  # a rod that spins
            places = (spot(one), spot(two), way(slide.axis))
            arm = vector(places[0]) - vector(places[1])
            size = float(np.linalg.norm(arm))
            if size > at.within / AXIS_MEETING_SINE_MIN:
                miss = float(np.linalg.norm(np.cross(arm, vector(places[2])))) / max(1.0, size)
                names = (one.name, two.name, slide.name)
                yield RepairRelation("in line with an axis", names, _on_line, places, miss)
    yield from _rods(bodies, spot, at, vector)


def _flat(balls: Sequence[tuple[str, int]], vector: Callable[[int], Array], within: float) -> Iterator[RepairRelation]:
    """Yield the relations that put all centres of a body in one plane with the three that span the largest triangle."""

    def area(three: Iterable[tuple[str, int]]) -> float:
        p, q, r = (vector(i) for _, i in three)
        return float(np.linalg.norm(np.cross(q - p, r - p)))

    if len(balls) < 4:
        return
    three = max(combinations(balls, 3), key=area)
    size = area(three)
    if size <= (within / AXIS_MEETING_SINE_MIN) ** 2:
        return
    corners = [i for _, i in three]
    for name, i in balls:
        if i not in corners:
            miss = abs(float(_coplanar(*(vector(j) for j in (*corners, i)))[0])) / size
            yield RepairRelation("in one plane", (*(other for other, _ in three), name), _coplanar, (*corners, i), miss)


def _rods(
    bodies: Bodies, spot: Callable[[Joint], int], at: JointCoordinates, vector: Callable[[int], Array]
) -> Iterator[RepairRelation]:
    """Yield the relation of two links of two joints between the same two bodies: equal from centre to centre."""
    table: dict[frozenset[int], list[Sequence[Joint]]] = defaultdict(list)
    for own, joints in bodies.on.items():
        if len(joints) == 2:
            far = [next((bodies.of[x] for x in j.links if bodies.of[x] != own), own) for j in joints]
            if far[0] != far[1]:
                table[frozenset(far)].append(joints if far[0] < far[1] else joints[::-1])
    for rods in table.values():
        for one, two in combinations(rods, 2):
            joints = [*one, *two]
            names, points = tuple(j.name for j in joints), tuple(spot(joint) for joint in joints)
            if all(joint.type in BALLS for joint in joints):
                miss = float(np.linalg.norm(_equal(*(vector(i) for i in points))))
                yield RepairRelation("equal rods", names, _equal, points, miss)
            elif all(joint.type is JointType.REVOLUTE for joint in joints):
                at_all = (*points, at.axis_of(joints[0]))
                miss = float(np.linalg.norm(_equal_across(*(vector(i) for i in at_all))))
                yield RepairRelation("equal rods", names, _equal_across, at_all, miss)
