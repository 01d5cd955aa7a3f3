"""Root bound of poses that meet conditions: ranks modulo a prime (docs/pages/proofs.md, section 8).

I_t are the multiples of the conditions among the forms of degree t, and w = q · q. If wᵏ S_{t-2k} lies in
wᵏ⁺¹ S_{t-2k-2} + I_t, S the forms, then each function of the pose is, modulo the conditions, one of the degree
t - 2k - 2, so there are at most D = dim (wᵏ S + I_t) - dim I_t poses, multiple ones counted so often. Forms are known
by their values at random points modulo the prime. A rank modulo a prime is at most that over ℚ: enough for dim I_t;
that of wᵏ S + I_t is the same unless the prime divides one certain minor, which fewer than 10⁶ of the 10¹⁷ primes of
62 bits do.

If a condition is a form of degree 2 all is computed modulo it: of forms without the powers of an unknown that it gives
by the others, at points that meet it. They are known there if so many points separate all of them: it is checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from ...geometry.vectors import Array
from .pose_conditions import PoseCondition
from .pose_forms import ROTATION, SquareForms, list_exponents

LARGEST_FORMS, FORMS_SECONDS, FEW_FORMS_SECONDS = 1100, 46.0, 0.1
"""Largest number of forms of a degree in linear algebra, and estimated time (s) for that many, and for few."""
QUATERNION_POWERS_MAX = 4
"""Powers of q · q tried to exclude extraneous solutions."""

PRIME = (1 << 62) - 57


def reduce_mod(values: Array) -> Any:
    """Floats as residues, exactly."""
    ratios = [float(v).as_integer_ratio() for v in np.ravel(values)]
    flat = np.array([n * pow(d, -1, PRIME) % PRIME for n, d in ratios], dtype=object)
    return flat.reshape(np.shape(values)) if np.shape(values) else flat[0]


@lru_cache(maxsize=64)
def _sample_residues(shape: tuple[int, int], count: int) -> Any:
    """Random residues y and s; shape (count, a + m)."""
    return np.random.default_rng(0).integers(1, PRIME, size=(count, sum(shape))).astype(object)


def _evaluate_monomials(x: Any, exponents: Array) -> Any:
    """Monomials at points x (points, unknowns); shape (forms, points)."""
    powers = [x.T * 0 + 1]
    for _ in range(int(exponents.max(initial=0))):
        powers.append(powers[-1] * x.T % PRIME)
    by = {(): x[:, 0] * 0 + 1}
    for i in range(x.shape[1]):
        by = {
            e: by[e[:-1]] * powers[e[-1]][i] % PRIME if e[-1] else by[e[:-1]]
            for e in dict.fromkeys(map(tuple, exponents[:, : i + 1].tolist()))
        }
    return np.array(list(by.values()), dtype=object).reshape(-1, len(x))


@lru_cache(maxsize=32)
def _sample_monomials(shape: tuple[int, int], t: int, at: int) -> Any:
    """The monomials of degree t at the random points for degree ``at``; shape (forms, points)."""
    return _evaluate_monomials(_sample_residues(shape, len(list_exponents(shape, at))), list_exponents(shape, t))


def _evaluate_conditions(forms: SquareForms, x: Any, others: Sequence[PoseCondition]) -> tuple[Any, list[Any]]:
    """w and conditions, as forms, at points x; shape (points,) each."""
    y, s = x[:, : forms.shape[0]], x[:, forms.shape[0] :]
    q = y @ reduce_mod(forms.poses.turns).T % PRIME
    w = np.sum(q * q, axis=1) % PRIME
    inverse = np.array([pow(int(v), -1, PRIME) for v in w], dtype=object)
    R = np.einsum("ikab,na,nb->nik", ROTATION.astype(int).astype(object), q, q) * inverse[:, None, None] % PRIME
    s = s * inverse[:, None] % PRIME
    heights = [(reduce_mod(np.array(c.h)) - (R @ reduce_mod(c.b)) @ reduce_mod(c.n)) % PRIME for c in forms.planes]
    matrix = build_nmod(reduce_mod(forms.system)).inv()
    solved = np.array([[int(v) for v in row] for row in matrix.table()], dtype=object)
    p = np.column_stack([*heights, *s.T]) @ solved.T @ reduce_mod(forms.poses.moves).T % PRIME
    values = []
    for c in others:
        value = c.value((p + R @ reduce_mod(c.b)) % PRIME, R @ reduce_mod(c.c) % PRIME, reduce_mod) % PRIME
        for _ in range(c.degree):
            value = value * w % PRIME
        values.append(value)
    return w, values


def build_nmod(rows: Any) -> Any:
    """A matrix of residues."""
    from flint import nmod_mat

    return nmod_mat(rows.tolist(), PRIME)


@dataclass(frozen=True, eq=False)
class _Quotient:
    """The forms modulo a condition of degree 2: those without the ``power`` of the unknown ``place``, at points
    (points, unknowns) where the condition holds."""

    place: int
    power: int
    points: Any

    @classmethod
    def of(cls, forms: SquareForms, t: int) -> _Quotient | None:
        """Return the forms modulo the first condition, for degrees up to t; None if it gives no unknown, or if points
        do not separate the forms."""
        (a, m), condition = forms.shape, forms.others[0]
        if condition.degree > 1 or len(forms.others) < 2:
            return None
        for place in (*range(a, a + m), *range(a)):
            power = 1 if place >= a else 2
            kept = list_exponents(forms.shape, t)
            kept = kept[kept[:, place] < power]
            x, parts = _sample_residues(forms.shape, len(kept) if power == 1 else 3 * len(kept) + 20), list[Any]()
            c, b, d = _fit_parabola(forms, x, place, condition)
            if not c[0] if power == 2 else not b[0]:
                continue
            for row, *of in zip(x, c, b, d, strict=True):
                if (root := _find_root(*map(int, of))) is not None:
                    parts.append([*row[:place], root, *row[place + 1 :]])
            points = np.array(parts[: len(kept)], dtype=object).reshape(-1, a + m)
            full = len(points) == len(kept) and build_nmod(_evaluate_monomials(points, kept)).rank() == len(kept)
            return cls(place, power, points) if full else None
        return None

    def values(self, forms: SquareForms, t: int) -> Any:
        """The forms of a degree that are left, at the points."""
        every = list_exponents(forms.shape, t)
        return _evaluate_monomials(self.points, every[every[:, self.place] < self.power])


def _fit_parabola(forms: SquareForms, x: Any, place: int, condition: PoseCondition) -> tuple[Any, Any, Any]:
    """c, b, d of a condition c v² + b v + d of degree 2 in an unknown v, the others as they are at points."""
    d, plus, minus = (
        _evaluate_conditions(forms, np.hstack([x[:, :place], x[:, :1] * 0 + v, x[:, place + 1 :]]), [condition])[1][0]
        for v in (0, 1, PRIME - 1)
    )
    half = (PRIME + 1) // 2
    return ((plus + minus) * half - d) % PRIME, (plus - minus) * half % PRIME, d


def _find_root(c: int, b: int, d: int) -> int | None:
    """A root of c v² + b v + d, where there is one; the prime is 3 modulo 4."""
    if not c:
        return -d * pow(b, -1, PRIME) % PRIME if b else None
    square = (b * b - 4 * c * d) % PRIME
    root = pow(square, (PRIME + 1) // 4, PRIME)
    return (root - b) * pow(2 * c, -1, PRIME) % PRIME if root * root % PRIME == square else None


def compute_dimensions(forms: SquareForms, t: int, most: int) -> list[int]:
    """dim (wᵏ S + I_t) - dim I_t for k = 1 … ``most``, modulo the prime."""
    quotient = _Quotient.of(forms, t)
    points, others = _sample_residues(forms.shape, len(list_exponents(forms.shape, t))), forms.others
    if quotient is not None:
        points, others = quotient.points, others[1:]

    def values(degree: int) -> Any:
        return _sample_monomials(forms.shape, degree, t) if quotient is None else quotient.values(forms, degree)

    w, conditions = _evaluate_conditions(forms, points, others)
    rows = [values(t - 2 * c.degree) * value % PRIME for c, value in zip(others, conditions, strict=True)]
    # what vanishes on I_t, on which wᵏ S has the rank that it has modulo I_t
    kernel, size = build_nmod(np.vstack(rows)).nullspace()
    columns = np.array([[int(v) for v in row[:size]] for row in kernel.table()], dtype=object)
    ranks = []
    for k in range(1, most + 1):
        columns = columns * w[:, None] % PRIME
        ranks.append((build_nmod(values(t - 2 * k)) * build_nmod(columns)).rank())
    return ranks


def bound(forms: SquareForms) -> tuple[int, int, int] | None:
    """D, the degree t and k; None where there are infinitely many, or the forms would be too many."""
    t = forms.degree
    while forms.others and len(list_exponents(forms.shape, t)) <= LARGEST_FORMS:
        most = min(QUATERNION_POWERS_MAX, t // 2 - 1)
        dimensions = compute_dimensions(forms, t, most)
        for k, (dimension, next_) in enumerate(pairwise(dimensions), 1):
            if dimension == next_:
                return dimension, t, k
        t += 2
    return None
