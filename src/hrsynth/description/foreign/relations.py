"""Geometry that is meant but rounded: relations that nearly hold within a link are made exact.

Printed digits and CAD leave axes parallel to 1e-6 and rods equal to 1e-7 m. Such noise changes ranks (a loop with
redundant constraints becomes rigid) and hides what a link is (a U, two equal rods). The least change of joint centres
and axes that satisfies every relation that holds to ``tolerances.NOISE`` is found by Gauss-Newton.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...budgets import LARGEST_RELATED
from ...geometry.vectors import Array
from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism
from ...tolerances import EXACT, NOISE

_LINES = (JointType.REVOLUTE, JointType.CYLINDRICAL)
_BALLS = (JointType.SPHERICAL, JointType.UNIVERSAL)
Rows = list[tuple[float, list[tuple[int, Array]]]]
"""Equations: value, and gradient blocks (first coordinate, (3,))."""
Relation = Callable[[Array], Rows]


@dataclass(frozen=True, eq=False)
class Exact:
    """The mechanism with exact relations, how many of them held only nearly, and the largest change (characteristic
    lengths, pure numbers)."""

    mechanism: Mechanism
    mended: int
    change: float


class _Coordinates:
    """Centres and axes of all joints in one vector; centres in characteristic lengths."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.point: dict[str, int] = {}
        self.axes: dict[str, list[int]] = {}
        values: list[Array] = []
        for joint in mechanism.joints.values():
            self.point[joint.name] = 3 * len(values)
            values.append(joint.point / mechanism.length)
            self.axes[joint.name] = [3 * (len(values) + k) for k in range(len(joint.axes))]
            values.extend(joint.axes)
        self.values = np.concatenate(values)

    def mechanism_of(self, x: Array) -> Mechanism:
        """The mechanism with other centres and axes."""
        joints = {}
        for name, joint in self.mechanism.joints.items():
            axes = tuple(x[i : i + 3] for i in self.axes[name])
            at = self.point[name]
            joints[name] = replace(joint, point=x[at : at + 3] * self.mechanism.length, axes=axes)
        return replace(self.mechanism, joints=joints)


def exact(mechanism: Mechanism) -> Exact | None:
    """Make nearly held relations exact; None where there are none, or where they contradict each other."""
    if not 1 < len(mechanism.joints) <= LARGEST_RELATED:
        return None
    coordinates = _Coordinates(mechanism)
    start = coordinates.values
    held = [(relation, miss) for relation in _relations(mechanism, coordinates)
            if (miss := _miss(relation, start)) <= NOISE]
    mended = sum(miss > EXACT for _, miss in held)
    if not mended:
        return None
    held += [(_length(i), 0.0) for own in coordinates.axes.values() for i in own]
    x = start
    for _ in range(8):
        error, J = _stacked([relation for relation, _ in held], x)
        if np.max(np.abs(error)) <= 1e-15:
            break
        x = x - np.linalg.lstsq(J, error, rcond=1e-9)[0]
    change = float(np.max(np.abs(x - start)))
    if max(_miss(relation, x) for relation, _ in held) > EXACT or change > 3 * NOISE:
        return None
    return Exact(coordinates.mechanism_of(x), mended, change)


def _relations(mechanism: Mechanism, at: _Coordinates) -> Iterator[Relation]:
    """Relations that links could be meant to have, held or not."""
    bonds = graphs.adjacency(mechanism.links, (j.links for j in mechanism.joints.values() if j.type is JointType.FIXED))
    body = {link: number for number, group in enumerate(graphs.components(bonds)) for link in group}
    on: dict[int, list[Joint]] = defaultdict(list)
    for joint in mechanism.joints.values():
        if joint.type not in (JointType.FIXED, JointType.FREE):
            for link in joint.links:
                on[body[link]].append(joint)
    for joint in mechanism.joints.values():
        if joint.type is JointType.UNIVERSAL:
            yield _normal(*at.axes[joint.name])
    for joints in on.values():
        if len(joints) <= 40:
            yield from _within(joints, at)
    yield from _rods(mechanism, body, on, at)


def _within(joints: list[Joint], at: _Coordinates) -> Iterator[Relation]:
    for one, two in combinations(joints, 2):
        p, q = at.point[one.name], at.point[two.name]
        for a in at.axes[one.name]:
            for b in at.axes[two.name]:
                yield _parallel(a, b)
                yield _normal(a, b)
        if one.type in _BALLS and two.type in _BALLS:
            yield _same(p, q)
            for other in joints:
                for axis in at.axes[other.name]:
                    yield _along(p, q, axis)
        elif one.type in _LINES and two.type in _LINES:
            yield _meeting(p, q, at.axes[one.name][0], at.axes[two.name][0])
            yield _coaxial(p, q, at.axes[one.name][0], at.axes[two.name][0])
        elif {one.type, two.type} <= {*_LINES, *_BALLS}:
            line = one if one.type in _LINES else two
            yield _along(p, q, at.axes[line.name][0])


def _rods(mechanism: Mechanism, body: dict[str, int], on: dict[int, list[Joint]], at: _Coordinates
          ) -> Iterator[Relation]:
    """Two links of two joints each between the same two bodies: equal from centre to centre."""
    table: dict[frozenset[int], list[tuple[Joint, Joint, int]]] = defaultdict(list)
    for own, joints in on.items():
        if len(joints) == 2:
            far = [next((body[x] for x in j.links if body[x] != own), own) for j in joints]
            if far[0] != far[1]:
                near, end = joints if far[0] < far[1] else joints[::-1]
                table[frozenset(far)].append((near, end, own))
    for rods in table.values():
        for (a, b, _), (c, d, _) in combinations(rods, 2):
            points = at.point[a.name], at.point[b.name], at.point[c.name], at.point[d.name]
            if all(joint.type in _BALLS for joint in (a, b, c, d)):
                yield _equal(*points)
            elif all(joint.type is JointType.REVOLUTE for joint in (a, b, c, d)):
                yield _equal_across(*points, at.axes[a.name][0])


def _v(x: Array, i: int) -> Array:
    return x[i : i + 3]


def _cross_rows(u: Array, v: Array, by_u: list[tuple[int, float]], by_v: list[tuple[int, float]]) -> Rows:
    """u × v = 0, with u and v sums of coordinates (first index, sign)."""
    value = np.cross(u, v)
    rows: Rows = []
    for k, e in enumerate(np.eye(3)):
        blocks = [(i, sign * np.cross(v, e)) for i, sign in by_u] + [(i, sign * np.cross(e, u)) for i, sign in by_v]
        rows.append((float(value[k]), blocks))
    return rows


def _parallel(a: int, b: int) -> Relation:
    return lambda x: _cross_rows(_v(x, a), _v(x, b), [(a, 1.0)], [(b, 1.0)])


def _normal(a: int, b: int) -> Relation:
    return lambda x: [(float(_v(x, a) @ _v(x, b)), [(a, _v(x, b)), (b, _v(x, a))])]


def _length(a: int) -> Relation:
    return lambda x: [(float(_v(x, a) @ _v(x, a) - 1) / 2, [(a, _v(x, a))])]


def _same(p: int, q: int) -> Relation:
    return lambda x: [(float(x[p + k] - x[q + k]), [(p, e), (q, -e)]) for k, e in enumerate(np.eye(3))]


def _along(p: int, q: int, a: int) -> Relation:
    return lambda x: _cross_rows(_v(x, p) - _v(x, q), _v(x, a), [(p, 1.0), (q, -1.0)], [(a, 1.0)])


def _coaxial(p: int, q: int, a: int, b: int) -> Relation:
    return lambda x: _along(p, q, a)(x) + _parallel(a, b)(x)


def _meeting(p: int, q: int, a: int, b: int) -> Relation:
    def rows(x: Array) -> Rows:
        d, u, v = _v(x, p) - _v(x, q), _v(x, a), _v(x, b)
        n = np.cross(u, v)
        return [(float(d @ n), [(p, n), (q, -n), (a, np.cross(v, d)), (b, np.cross(d, u))])]
    return rows


def _equal(p: int, q: int, r: int, s: int) -> Relation:
    return lambda x: [(float(x[q + k] - x[p + k] - x[s + k] + x[r + k]), [(q, e), (p, -e), (s, -e), (r, e)])
                      for k, e in enumerate(np.eye(3))]


def _equal_across(p: int, q: int, r: int, s: int, a: int) -> Relation:
    signs = [(q, 1.0), (p, -1.0), (s, -1.0), (r, 1.0)]
    return lambda x: _cross_rows(_v(x, q) - _v(x, p) - _v(x, s) + _v(x, r), _v(x, a), signs, [(a, 1.0)])


def _miss(relation: Relation, x: Array) -> float:
    return max(abs(value) for value, _ in relation(x))


def _stacked(relations: list[Relation], x: Array) -> tuple[Array, Array]:
    rows = [row for relation in relations for row in relation(x)]
    J = np.zeros((len(rows), len(x)))
    for line, (_, blocks) in zip(J, rows, strict=True):
        for start, gradient in blocks:
            line[start : start + 3] += gradient
    return np.array([value for value, _ in rows]), J
