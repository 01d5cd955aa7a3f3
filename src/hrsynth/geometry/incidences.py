"""Incidences of joint centres that hold at all configurations: differences of centres that vanish, or that are parallel
or normal to directions, and equal differences. Lengths here are in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..tolerances import POINT_DISTANCE_TOL, RANK_GAP_MIN
from .vectors import Array, cross, dot

INCIDENCE_SAMPLES_COUNT = 2
"""Samples besides the first at which an incidence must hold to count as structural."""

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Incidence:
    """A relation of the vector Σ sign · P: ``zero``; ``parallel`` to a class of directions; ``normal`` to one."""

    terms: tuple[tuple[int, int], ...]
    """Number of the centre, sign."""
    kind: Literal["zero", "parallel", "normal"]
    classes: tuple[int, ...] = ()


class Sieve:
    """Test of relations: which are true at the first configuration (zero) and at all others, and how clearly."""

    def __init__(self) -> None:
        self.accepted, self.rejected = 0.0, float("inf")
        """The largest defect of a relation that is taken as held, and the smallest of one that is not, if it is less
        than ``RANK_GAP_MIN`` tolerances."""
        self.mixed: tuple[int, int] | None = None
        """Of a relation that holds at the first configuration and at some of the others: at how many, of how many."""

    def keep(self, candidates: Indices, value: Callable[[Indices, slice], Array], tolerance: float) -> Indices:
        """The candidates (m, k) whose ``value`` (m, configurations, …) vanishes at all configurations."""
        near = candidates[self._sizes(candidates, value, slice(1)).max(axis=1, initial=0.0) < RANK_GAP_MIN * tolerance]
        sizes = self._sizes(near, value, slice(None))
        defects = sizes.max(axis=1, initial=0.0)
        kept = defects < tolerance
        self.accepted = max(self.accepted, float(np.max(defects, where=kept, initial=0.0)))
        close, far = ~kept & (defects < RANK_GAP_MIN * tolerance), defects >= RANK_GAP_MIN * tolerance
        self.rejected = min(self.rejected, float(np.min(defects, where=close, initial=np.inf)))
        here = sizes < tolerance
        for row in here[here[:, 0] & (here[:, 1:].sum(axis=1) >= INCIDENCE_SAMPLES_COUNT) & far]:
            self.mixed = int(row[1:].sum()), len(row) - 1
        return near[kept]

    @staticmethod
    def _sizes(candidates: Indices, value: Callable[[Indices, slice], Array], where: slice) -> Array:
        """The largest entry of each value at each configuration (m, configurations)."""
        if not len(candidates):
            return np.zeros((0, 1))
        found = np.abs(value(candidates, where))
        return np.asarray(found.reshape(*found.shape[:2], -1).max(axis=2))


def list_choices(n: int, k: int) -> Indices:
    """All sets of k of n numbers, one a row."""
    return convert_to_rows(combinations(range(n), k), k)


def convert_to_rows(tuples: Iterable[Sequence[int]], k: int) -> Indices:
    """Tuples of k numbers, one a row, even if there are none."""
    return np.array(list(tuples), dtype=np.intp).reshape(-1, k)


def find_incidences(
    sieve: Sieve,
    classes: Array,
    points: Array,
    together: NDArray[np.bool_],
    owns: Sequence[set[int]],
    slides: Sequence[set[int]],
) -> list[Incidence]:
    """All incidences of ``points`` (n, configurations, 3) towards ``classes`` of directions (m, configurations, 3).

    ``together`` (n, n) marks the points that keep their direction from each other; ``owns`` are the classes of the axes
    through each point, ``slides`` those along which it may be moved without consequence.
    """

    def between(c: Indices, s: slice) -> Array:
        return np.asarray(points[c[:, 1], s] - points[c[:, 0], s])

    def along(c: Indices, s: slice) -> Array:
        return cross(between(c, s), classes[c[:, 2], s])

    def across(c: Indices, s: slice) -> Array:
        return dot(between(c, s), classes[c[:, 2], s])

    count = range(len(classes))
    pairs = list_choices(len(points), 2)
    same = sieve.keep(pairs, between, POINT_DISTANCE_TOL).tolist()
    apart = [(j, k) for j, k in pairs.tolist() if [j, k] not in same]
    candidates = convert_to_rows(
        ((j, k, c) for j, k in apart for c in count if together[j, k] or c in owns[j] | owns[k]), 3
    )
    parallel = sieve.keep(candidates, along, POINT_DISTANCE_TOL).tolist()
    lined = {(j, k) for j, k, _ in parallel}
    rest = [(j, k) for j, k in apart if together[j, k] and (j, k) not in lined]
    normal = sieve.keep(
        convert_to_rows(((j, k, c) for j, k in rest for c in count), 3), across, POINT_DISTANCE_TOL
    ).tolist()
    return [
        *(Incidence(((k, 1), (j, -1)), "zero") for j, k in same),
        *(Incidence(((k, 1), (j, -1)), "parallel", (c,)) for j, k, c in parallel),
        *(Incidence(((k, 1), (j, -1)), "normal", (c,)) for j, k, c in normal),
        *_find_parallelograms(sieve, classes, points, together, slides),
    ]


def _find_parallelograms(
    sieve: Sieve, classes: Array, points: Array, together: NDArray[np.bool_], slides: Sequence[set[int]]
) -> list[Incidence]:
    """P_i − P_j = P_k − P_m, where ij, km, ik and jm are sides on links; up to a slide along an axis all four share."""

    def gap(c: Indices, s: slice) -> Array:
        return np.asarray(points[c[:, 0], s] - points[c[:, 1], s] - points[c[:, 2], s] + points[c[:, 3], s])

    def gap_across(c: Indices, s: slice) -> Array:
        return cross(gap(c, s), classes[c[:, 4], s])

    beside = [set(np.flatnonzero(each).tolist()) - {i} for i, each in enumerate(together)]
    quads = [
        (i, j, k, m)
        for i, near in enumerate(beside)
        for j, k in combinations(sorted(near), 2)
        for m in beside[j] & beside[k]
        if i < min(j, m) and not (together[i, m] and together[j, k])
    ]
    closed = sieve.keep(convert_to_rows(quads, 4), gap, POINT_DISTANCE_TOL).tolist()
    shared = ((*quad, c) for quad in quads for c in set.intersection(*(slides[i] for i in quad)))
    slid = [
        each
        for each in sieve.keep(convert_to_rows(shared, 5), gap_across, POINT_DISTANCE_TOL).tolist()
        if each[:4] not in closed
    ]

    def terms(quad: list[int]) -> tuple[tuple[int, int], ...]:
        return tuple(zip(quad[:4], (1, -1, -1, 1), strict=True))

    return [
        *(Incidence(terms(quad), "zero") for quad in closed),
        *(Incidence(terms(quad), "parallel", (quad[4],)) for quad in slid),
    ]
