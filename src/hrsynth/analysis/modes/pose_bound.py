"""At most how many poses meet conditions: ranks modulo a prime (docs/pages/theory.md, section 8).

I_t are the multiples of the conditions among the forms of degree t, and w = q · q. If wᵏ S_{t-2k} lies in
wᵏ⁺¹ S_{t-2k-2} + I_t, S the forms, then each function of the pose is, modulo the conditions, one of the degree
t - 2k - 2, so there are at most D = dim (wᵏ S + I_t) - dim I_t poses, multiple ones counted so often. Forms are known
by their values at random points modulo the prime. A rank modulo a prime is at most that over ℚ: enough for dim I_t;
that of wᵏ S + I_t is the same unless the prime divides one certain minor, which fewer than 10⁶ of the 10¹⁷ primes of
62 bits do.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from ...budgets import LARGEST_FORMS, MOST_INFINITE
from ...geometry.vectors import Array
from .pose_forms import ROTATION, SquareForms, exponents

PRIME = (1 << 62) - 57


def residues(values: Array) -> Any:
    """Floats as residues, exactly."""
    ratios = [float(v).as_integer_ratio() for v in np.ravel(values)]
    flat = np.array([n * pow(d, -1, PRIME) % PRIME for n, d in ratios], dtype=object)
    return flat.reshape(np.shape(values)) if np.shape(values) else flat[0]


@lru_cache(maxsize=16)
def _points(shape: tuple[int, int], t: int) -> tuple[Any, Any]:
    """Random residues y (n, a) and s (n, m), as many as forms of the degree."""
    count = len(exponents(shape, t))
    values = np.random.default_rng(0).integers(1, PRIME, size=(count, sum(shape))).astype(object)
    return values[:, :shape[0]], values[:, shape[0]:]


@lru_cache(maxsize=32)
def _values(shape: tuple[int, int], t: int, at: int) -> Any:
    """The monomials of degree t at the points for degree ``at``; shape (forms, points)."""
    x = np.hstack(_points(shape, at)).T
    powers = [np.array([v * 0 + 1 for v in x])]
    for _ in range(t):
        powers.append(powers[-1] * x % PRIME)
    found = []
    for each in exponents(shape, t):
        value = x[0] * 0 + 1
        for i, e in enumerate(each):
            value = value * powers[e][i] % PRIME if e else value
        found.append(value)
    return np.array(found, dtype=object)


def dimensions(forms: SquareForms, t: int, most: int) -> list[int]:
    """dim (wᵏ S + I_t) - dim I_t for k = 1 … ``most``, modulo the prime."""
    from flint import nmod_mat

    y, s = _points(forms.shape, t)
    q = y @ residues(forms.poses.turns).T % PRIME
    w = np.sum(q * q, axis=1) % PRIME
    inverse = np.array([pow(int(v), -1, PRIME) for v in w], dtype=object)
    R = np.einsum("ikab,na,nb->nik", ROTATION.astype(int).astype(object), q, q) * inverse[:, None, None] % PRIME
    s = s * inverse[:, None] % PRIME
    heights = [(residues(np.array(c.h)) - (R @ residues(c.b)) @ residues(c.n)) % PRIME for c in forms.planes]
    matrix = nmod_mat([[int(v) for v in row] for row in residues(forms.system)], PRIME).inv()
    solved = np.array([[int(v) for v in row] for row in matrix.table()], dtype=object)
    p = np.column_stack([*heights, *s.T]) @ solved.T @ residues(forms.poses.moves).T % PRIME
    rows = []
    for c in forms.others:
        value = c.value((p + R @ residues(c.b)) % PRIME, R @ residues(c.c) % PRIME, residues) % PRIME
        for _ in range(c.degree):
            value = value * w % PRIME
        rows.append(_values(forms.shape, t - 2 * c.degree, t) * value % PRIME)
    # what vanishes on I_t, on which wᵏ S has the rank that it has modulo I_t
    kernel, size = nmod_mat(np.vstack(rows).tolist(), PRIME).nullspace()
    columns = np.array([[int(v) for v in row[:size]] for row in kernel.table()], dtype=object)
    found = []
    for k in range(1, most + 1):
        columns = columns * w[:, None] % PRIME
        found.append((nmod_mat(_values(forms.shape, t - 2 * k, t).tolist(), PRIME)
                      * nmod_mat(columns.tolist(), PRIME)).rank())
    return found


def bound(forms: SquareForms) -> tuple[int, int, int] | None:
    """D, the degree t and k; None where there are infinitely many, or the forms would be too many."""
    t = forms.degree
    while forms.others and len(exponents(forms.shape, t)) <= LARGEST_FORMS:
        most = min(MOST_INFINITE, t // 2 - 1)
        found = dimensions(forms, t, most)
        for k, (one, next_) in enumerate(pairwise(found), 1):
            if one == next_:
                return one, t, k
        t += 2
    return None
