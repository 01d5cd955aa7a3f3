"""Geometry that is meant but rounded: relations that nearly hold within a link are made exact.

Printed digits and CAD leave axes parallel to 1e-6 and rods equal to 1e-7 m. Such noise changes ranks (a loop with
redundant constraints becomes rigid) and hides what a link is (a U, two equal rods). The least change of joint centres
and axes that satisfies every relation that holds to ``tolerances.NOISE`` is found by Gauss-Newton.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...budgets import LARGEST_RELATED, MOST_RELATED_ON_LINK
from ...errors import LoopsNotClosed, RankUndecided
from ...geometry.vectors import Array
from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism, Note
from ...tolerances import COMPLEX_STEP, EXACT, FAINT, NOISE, RANK_GAP, SAME_GEOMETRY
from .loops import LoopAssembly

_LINES = (JointType.REVOLUTE, JointType.CYLINDRICAL)
_BALLS = (JointType.SPHERICAL, JointType.UNIVERSAL)

Vectors = NDArray[Any]
"""Vectors (..., 3), real or complex."""


@dataclass(frozen=True, eq=False)
class ExactGeometry:
    """The mechanism with exact relations, how many of them held only nearly, and the largest change (characteristic
    lengths, pure numbers)."""

    mechanism: Mechanism
    mended: int
    change: float


class GeometricRelation:
    """An equation f(v₁, v₂, …) = 0 of centres and axes; f is a polynomial, (..., 3) → (..., m), real or complex."""

    def __init__(self, function: Callable[..., Vectors], *at: int) -> None:
        self.function, self.at = function, at
        """``at``: the first coordinate of each of its vectors."""

    def value(self, x: Array) -> Array:
        """f, shape (m,)."""
        return np.asarray(self.function(*(x[i : i + 3] for i in self.at)))

    def gradient(self, x: Array) -> Array:
        """Its derivative (m, len(x)), by a complex step: Im f(x + ih e) / h, which takes no differences."""
        count = 3 * len(self.at)
        steps = np.array([x[i : i + 3] for i in self.at]) + 1j * COMPLEX_STEP * np.eye(count).reshape(count, -1, 3)
        by_coordinate = self.function(*np.moveaxis(steps, 1, 0)).imag.T / COMPLEX_STEP
        J = np.zeros((len(by_coordinate), len(x)))
        for number, start in enumerate(self.at):
            J[:, start : start + 3] += by_coordinate[:, 3 * number : 3 * number + 3]
        return J


def _normal(u: Vectors, v: Vectors) -> Vectors:
    return np.sum(u * v, axis=-1)[..., None]


def _length(u: Vectors) -> Vectors:
    return (_normal(u, u) - 1) / 2


def _along(p: Vectors, q: Vectors, a: Vectors) -> Vectors:
    return np.cross(p - q, a)


def _coaxial(p: Vectors, q: Vectors, a: Vectors, b: Vectors) -> Vectors:
    return np.concatenate([np.cross(p - q, a), np.cross(a, b)], axis=-1)


def _meeting(p: Vectors, q: Vectors, a: Vectors, b: Vectors) -> Vectors:
    return _normal(p - q, np.cross(a, b))


def _equal(p: Vectors, q: Vectors, r: Vectors, s: Vectors) -> Vectors:
    return q - p - s + r


def _equal_across(p: Vectors, q: Vectors, r: Vectors, s: Vectors, a: Vectors) -> Vectors:
    return np.cross(q - p - s + r, a)


class _JointCoordinates:
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


def as_meant(mechanism: Mechanism, residual: float) -> Mechanism:
    """The mechanism, its loops open by ``residual``, with exact relations in place of nearly held ones; the gap of the
    singular values is the evidence. Raises ``LoopsNotClosed`` or ``RankUndecided`` where it is none."""
    written = LoopAssembly.of(mechanism)
    found = exact_geometry(mechanism)
    if found is None:
        if residual > SAME_GEOMETRY:
            raise LoopsNotClosed(str(mechanism.file), residual, SAME_GEOMETRY, written.worst(written.zero())[0])
        return mechanism
    meant = LoopAssembly.of(found.mechanism)
    rank = meant.rank(meant.zero())
    before, loose = written.rank(written.zero()), written.rank(written.zero(), FAINT)
    text = (f"{found.mended} relations of joints (parallel, perpendicular, meeting, equal) that hold to {NOISE:g} are "
            f"made exact, largest change {found.change:.1e}")
    if before.value != rank.value or residual > SAME_GEOMETRY:
        if loose.value != rank.value or loose.gap < RANK_GAP:
            raise RankUndecided(f"{mechanism.file}: loops with rounded numbers", loose.gap, RANK_GAP)
        text += f"; the loops' singular values as written leave a gap of {loose.gap:.1e} (needed {RANK_GAP:g})"
    return replace(found.mechanism, notes=(*mechanism.notes, Note("merged", text)))


def exact_geometry(mechanism: Mechanism) -> ExactGeometry | None:
    """Make nearly held relations exact; None where there are none, or where they contradict each other."""
    if not 1 < len(mechanism.joints) <= LARGEST_RELATED:
        return None
    coordinates = _JointCoordinates(mechanism)
    x = start = coordinates.values
    misses = [(relation, float(np.max(np.abs(relation.value(start)))))
              for relation in _relations(mechanism, coordinates)]
    held = [relation for relation, miss in misses if miss <= NOISE]
    mended = sum(EXACT < miss <= NOISE for _, miss in misses)
    if not mended:
        return None
    held += [GeometricRelation(_length, i) for own in coordinates.axes.values() for i in own]
    for _ in range(8):
        error = np.concatenate([relation.value(x) for relation in held])
        if np.max(np.abs(error)) <= 1e-15:
            break
        J = np.vstack([relation.gradient(x) for relation in held])
        x = x - np.linalg.lstsq(J, error, rcond=1e-9)[0]
    change = float(np.max(np.abs(x - start)))
    if max(np.max(np.abs(relation.value(x))) for relation in held) > EXACT or change > 3 * NOISE:
        return None
    return ExactGeometry(coordinates.mechanism_of(x), mended, change)


def _relations(mechanism: Mechanism, at: _JointCoordinates) -> Iterator[GeometricRelation]:
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
            yield GeometricRelation(_normal, *at.axes[joint.name])
    for joints in on.values():
        if len(joints) <= MOST_RELATED_ON_LINK:
            yield from _within(joints, at)
    yield from _rods(body, on, at)


def _within(joints: list[Joint], at: _JointCoordinates) -> Iterator[GeometricRelation]:
    for one, two in combinations(joints, 2):
        centres = at.point[one.name], at.point[two.name]
        for a in at.axes[one.name]:
            for b in at.axes[two.name]:
                yield GeometricRelation(np.cross, a, b)
                yield GeometricRelation(_normal, a, b)
        if one.type in _BALLS and two.type in _BALLS:
            yield GeometricRelation(np.subtract, *centres)
            for other in joints:
                for axis in at.axes[other.name]:
                    yield GeometricRelation(_along, *centres, axis)
        elif one.type in _LINES and two.type in _LINES:
            yield GeometricRelation(_meeting, *centres, at.axes[one.name][0], at.axes[two.name][0])
            yield GeometricRelation(_coaxial, *centres, at.axes[one.name][0], at.axes[two.name][0])
        elif {one.type, two.type} <= {*_LINES, *_BALLS}:
            line = one if one.type in _LINES else two
            yield GeometricRelation(_along, *centres, at.axes[line.name][0])


def _rods(body: dict[str, int], on: dict[int, list[Joint]], at: _JointCoordinates) -> Iterator[GeometricRelation]:
    """Two links of two joints each between the same two bodies: equal from centre to centre."""
    table: dict[frozenset[int], list[Sequence[Joint]]] = defaultdict(list)
    for own, joints in on.items():
        if len(joints) == 2:
            far = [next((body[x] for x in j.links if body[x] != own), own) for j in joints]
            if far[0] != far[1]:
                table[frozenset(far)].append(joints if far[0] < far[1] else joints[::-1])
    for rods in table.values():
        for one, two in combinations(rods, 2):
            joints = [*one, *two]
            points = [at.point[joint.name] for joint in joints]
            if all(joint.type in _BALLS for joint in joints):
                yield GeometricRelation(_equal, *points)
            elif all(joint.type is JointType.REVOLUTE for joint in joints):
                yield GeometricRelation(_equal_across, *points, at.axes[joints[0].name][0])
