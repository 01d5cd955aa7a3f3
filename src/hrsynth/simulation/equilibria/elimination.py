"""Gauss's elimination in affine forms of many boxes at once, and whether what is left can vanish."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import AffineForms, combine
from ...geometry.vectors import Array
from ...tolerances import AFFINE_ROUNDING

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]


def pivots(J: Array) -> tuple[Places, Places]:
    """Columns (c, k) of matrices (c, k, n), by elimination with the largest entries, and the others (c, n − k)."""
    A = np.where(np.isfinite(J), J, 0.0)
    c, k, n = A.shape
    rows, P = np.arange(c), np.zeros((c, k), dtype=np.intp)
    open_, used = np.ones((c, k), dtype=bool), np.zeros((c, n), dtype=bool)
    for step in range(k):
        free = open_[:, :, None] & ~used[:, None]
        r, p = np.divmod(np.where(free, np.abs(A), -1.0).reshape(c, k * n).argmax(axis=1), n)
        pivot = A[rows, r, p]
        factor = A[rows, :, p] / np.where(pivot == 0, 1.0, pivot)[:, None]
        A = A - factor[:, :, None] * A[rows, r][:, None] * open_[:, :, None]
        P[:, step], open_[rows, r], used[rows, p] = p, False, True
    return P, np.argsort(used, axis=1, kind="stable")[:, : n - k]


def columns(J: Array, P: Places) -> Array:
    """Columns (c, k, p) of matrices (c, k, n)."""
    return np.take_along_axis(J, P[:, None], 2)


def entries(forms: AffineForms, P: Places) -> AffineForms:
    """Some of the last places, others of each box."""
    index = P.reshape(len(P), *(1,) * (forms.r.ndim - 2), -1)
    return AffineForms(np.take_along_axis(forms.v, index[None], -1), np.take_along_axis(forms.r, index, -1))


def reduced_gradient(M: AffineForms, slope: AffineForms, P: Places, N: Places) -> tuple[AffineForms, AffineForms]:
    """∇E_N − ∇E_P (∇g_P)⁻¹ ∇g_N, (c, n − k), by Gauss's elimination; no number where a pivot may vanish. And the 2×2
    minors of what is left of g and E before the last step, which vanish with it and need no last pivot."""
    k, order = P.shape[1], np.concatenate([P, N], axis=1)
    A, rest = entries(M, order), entries(slope, order)
    A = combine(inverse(A.v[0, ..., :k]), A) if k else A
    n = order.shape[1]
    found = _eliminate(k, n).together(
        [*(A[..., i, j] for i in range(k) for j in range(n)), *(rest[..., j] for j in range(n))]
    )
    return found[..., : N.shape[1]], found[..., N.shape[1] :]


@lru_cache(maxsize=64)
def _eliminate(k: int, n: int) -> BoxFormula:
    """Return k rows of n numbers and one more after Gauss's elimination, and the minors before its last step."""

    def formula(y: Sequence[Any], number: Any) -> list[Any]:
        rows, rest = [list(y[n * i : n * i + n]) for i in range(k)], list(y[n * k :])
        minors = rest
        for r, (first, *own) in enumerate(rows):
            if r == k - 1:
                both = list(zip(rows[r], rest, strict=True))
                minors = [a * d - c * b for (a, b), (c, d) in combinations(both, 2)]
            tail = [each * (1.0 / first) for each in own]
            for later in [*rows[r + 1 :], rest]:
                head = later.pop(0)
                later[:] = [each - part * head for each, part in zip(later, tail, strict=True)]
        return [*rest, *minors]

    return trace_formula(formula, n * (k + 1))


def away(F: AffineForms, own: int) -> Flags:
    """Return True where F (c, d) is enclosed away from zero: a component of it, F along its own centre, or a component
    in the coordinates in which it is nearest to the first symbols, the box's ``own``."""
    with np.errstate(all="ignore"):
        found = np.any(np.abs(F.v[0]) > F.spread * (1 + AFFINE_ROUNDING), axis=1)
        found |= combine(np.nan_to_num(F.v[0])[:, None, :], F).low[:, 0] > 0
        near = combine(pseudo_inverse(np.moveaxis(F.v[1 : 1 + own], 0, -1)), F)
        found |= np.any(np.abs(near.v[0]) > near.spread * (1 + AFFINE_ROUNDING), axis=1)
    return np.asarray(found)


def inverse(A: Array) -> Array:
    """Inverses (c, k, k); no numbers where there is none."""
    good = np.asarray(np.isfinite(A).all(axis=(1, 2)))
    safe = A if good.all() else np.where(good[:, None, None], A, np.eye(A.shape[-1]))
    try:
        found = np.linalg.inv(safe)
    except np.linalg.LinAlgError:
        good &= np.abs(np.linalg.det(safe)) > 0
        found = np.linalg.inv(np.where(good[:, None, None], A, np.eye(A.shape[-1])))
    return np.asarray(found if good.all() else np.where(good[:, None, None], found, np.nan))


def pseudo_inverse(A: Array) -> Array:
    """Pseudo-inverses (c, n, m) of matrices (c, m, n), inverses where there are; zero where there are no numbers."""
    square = A.shape[1] == A.shape[2]
    found = inverse(A) if square else np.full((len(A), A.shape[2], A.shape[1]), np.nan)
    none = ~np.isfinite(found).all(axis=(1, 2))
    if none.any():
        # of zeros it is zero
        numbers = np.isfinite(A[none]).all(axis=(1, 2), keepdims=True)
        found[none] = np.linalg.pinv(np.where(numbers, A[none], 0.0))
    return found


def solution(A: Array, b: Array) -> Array:
    """A⁻¹ b."""
    return np.asarray((pseudo_inverse(A) @ np.nan_to_num(b)[..., None])[..., 0])
