"""Random rational instances of an architecture, and their exact kinematics.

An instance is a random choice of axes, centres and observed directions that keeps all relations that persist in motion
(:mod:`hrsynth.mechanism.relations`). It is drawn in linear steps: the directions one after another, then all centres at
once, each from a solution space whose dimension is generically constant. The instances are therefore the rational
points of an irreducible family, to which the robot's own configurations belong.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import gcd, lcm
from typing import Any

import numpy as np

from ..mechanism import Joint, Mechanism
from ..mechanism.incidences import Incidence
from ..mechanism.observation import Direction
from ..mechanism.relations import Relations, Sight
from ..mechanism.screws import Numbers, constraints, cross, normals

LARGEST = 10**6
"""Range of the random whole numbers: two that should differ are equal once in a million draws."""


class NotRecognised(Exception):
    """The relations that were found do not describe the architecture: in what respect."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """Rational directions (3,), one a class, of any length, and centres (n, 3), that satisfy relations exactly."""

    directions: tuple[Numbers, ...]
    centres: Numbers


@dataclass(frozen=True, eq=False)
class Instance:
    """Exact maps on a basis of ker A, the velocities that all joints allow: the platform's twist (twist rows,
    mobility), and u × (ω − ω of the reference) for each observed direction (3, mobility)."""

    twist: Numbers
    rates: tuple[Numbers, ...]

    @property
    def mobility(self) -> int:
        """dim ker A."""
        return int(self.twist.shape[1])

    @property
    def dof(self) -> int:
        """Rank of the platform's twist."""
        return rank(self.twist)

    def ranks(self, places: Sequence[int]) -> tuple[int, int]:
        """For some of the observations: rank [X; Y], which is dim ρ, and rank Y."""
        rates = [self.rates[i] for i in places]
        return rank(np.vstack([self.twist, *rates])), rank(np.vstack(rates)) if rates else 0


def draw(relations: Relations, rng: random.Random) -> Geometry:
    """A random geometry; raises ``NotRecognised`` where the relations leave no direction to choose."""
    directions = _directions(relations, rng)
    return Geometry(directions, _centres(relations, directions, rng))


def instance(mechanism: Mechanism, relations: Relations, observations: Sequence[Direction], drawn: Geometry
             ) -> Instance:
    """The kinematics of a mechanism with this geometry."""
    from flint import fmpq

    directions, centres = drawn.directions, drawn.centres
    anywhere = np.array([fmpq(0)] * 3)

    def geometry(joint: Joint) -> tuple[Numbers, list[Numbers]]:
        number = relations.centres.get(joint.name)
        return (anywhere if number is None else centres[number],
                [directions[c] for c in relations.axes[joint.name]])

    place = {name: i for i, name in enumerate(n for n in mechanism.links if n != mechanism.base)}
    K = kernel(constraints(list(mechanism.joints.values()), place, geometry, dtype=object))

    def twist(link: str) -> Numbers:
        if link not in place:
            return np.array([[fmpq(0)] * K.shape[1]] * 6).reshape(6, -1)
        return K[6 * place[link] : 6 * place[link] + 6]

    t = twist(mechanism.platform)
    if relations.point is not None:
        t = t[:3] + cross(t[3:], centres[relations.point])
    rates = []
    for observation, sight in zip(observations, relations.sights, strict=True):
        turn = twist(observation.link)[3:] - twist(observation.seen_from or mechanism.reference)[3:]
        rates.append(cross(seen(sight, drawn), turn))
    return Instance(t, tuple(rates))


def _directions(relations: Relations, rng: random.Random) -> tuple[Numbers, ...]:
    """A direction for each class, one after another, whole numbers."""
    found: list[Numbers] = []
    for number, conditions in enumerate(relations.tower):
        rows = [found[c[0]] if len(c) == 1 else cross(found[c[0]], found[c[1]]) for c in conditions]
        basis = kernel(np.array(rows, dtype=object).reshape(-1, 3))
        if basis.shape[1] == 0:
            raise NotRecognised("no random direction fits all that is parallel, perpendicular or in one plane: "
                                + relations.members(number))
        found.append(_whole(basis @ _numbers(basis.shape[1], rng)))
    return tuple(found)


def _centres(relations: Relations, directions: Sequence[Numbers], rng: random.Random) -> Numbers:
    """Centres (n, 3) from the linear system of all incidences."""
    n = relations.count
    rows: dict[tuple[Any, ...], None] = {}
    for each in relations.incidences:
        for normal in _normals(each, directions):
            row = [0] * (3 * n)
            for point, sign in each.terms:
                row[3 * point : 3 * point + 3] = [sign * x for x in normal]
            rows[tuple(row)] = None
    basis = kernel(np.array(list(rows), dtype=object).reshape(len(rows), 3 * n))
    return np.asarray((basis @ _numbers(basis.shape[1], rng)).reshape(n, 3))


def _normals(incidence: Incidence, directions: Sequence[Numbers]) -> Sequence[Iterable[Any]]:
    """Vectors to which the vector of an incidence is normal."""
    match incidence.kind:
        case "zero":
            return [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        case "parallel":
            return normals(directions[incidence.classes[0]])
        case _:
            return [directions[incidence.classes[0]]]


def seen(sight: Sight, drawn: Geometry) -> Numbers:
    """An observed direction, of any length."""
    axes = [drawn.directions[c] for c in sight.classes]
    match sight.kind:
        case "class":
            return axes[0]
        case "normal":
            return cross(axes[0], axes[1])
        case _:
            j, k = sight.points
            between = drawn.centres[k] - drawn.centres[j]
            return between if sight.kind == "between" else cross(axes[0], cross(between, axes[0]))


def _numbers(count: int, rng: random.Random) -> Numbers:
    from flint import fmpq

    return np.array([fmpq(rng.choice((-1, 1)) * rng.randint(1, LARGEST)) for _ in range(count)], dtype=object)


def _whole(vector: Numbers) -> Numbers:
    """The shortest vector of whole numbers along a rational one."""
    from flint import fmpq

    scale = lcm(*(int(x.q) for x in vector))
    numbers = [int((x * scale).p) for x in vector]
    common = gcd(*numbers)
    return np.array([fmpq(x // common) for x in numbers], dtype=object)


def kernel(rows: Numbers) -> Numbers:
    """A basis of the exact kernel, rational, shape (columns, nullity)."""
    from flint import fmpq, fmpq_mat

    columns = rows.shape[1]
    reduced, found = fmpq_mat(len(rows), columns, list(rows.ravel())).rref()
    table = np.array(reduced.table(), dtype=object).reshape(rows.shape)[:found]
    pivots = [next(j for j, x in enumerate(row) if x != 0) for row in table]
    free = sorted(set(range(columns)) - set(pivots))
    basis = np.full((columns, len(free)), fmpq(0), dtype=object)
    basis[free, range(len(free))] = fmpq(1)
    basis[pivots] = -table[:, free]
    return basis


def rank(rows: Numbers) -> int:
    """The exact rank of a rational matrix."""
    from flint import fmpq_mat

    return int(fmpq_mat(rows.shape[0], rows.shape[1], list(rows.ravel())).rank())
