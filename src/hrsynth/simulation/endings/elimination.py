"""Gauss's elimination in affine forms of many boxes at once, and whether what is left can vanish."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry.affine import AffineForms, combined
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
    A = combined(inverse(A.v[0, ..., :k]), A) if k else A
    rows = [AffineForms(A.v[:, :, i], A.r[:, i]) for i in range(k)]
    minors = rest
    with np.errstate(all="ignore"):
        for r in range(k):
            if r == k - 1:
                one, other = np.triu_indices(N.shape[1] + 1, 1)
                minors = rows[r][..., one] * rest[..., other] - rows[r][..., other] * rest[..., one]
            tail = rows[r][..., 1:] * rows[r][..., 0].inverse()[..., None]
            rows[r + 1 :] = [each[..., 1:] - tail * each[..., 0][..., None] for each in rows[r + 1 :]]
            rest = rest[..., 1:] - tail * rest[..., 0][..., None]
    return rest, minors


def away(F: AffineForms) -> Flags:
    """Whether F (c, d) is enclosed away from zero: a component of it, F along its own middle, or a component in the
    coordinates in which it is nearest to the box's own."""
    with np.errstate(all="ignore"):
        found = np.any(np.abs(F.v[0]) > F.spread * (1 + AFFINE_ROUNDING), axis=1)
        found |= combined(np.nan_to_num(F.v[0])[:, None, :], F).low[:, 0] > 0
        near = combined(pseudo_inverse(np.moveaxis(F.v[1:], 0, -1)), F)
        found |= np.any(np.abs(near.v[0]) > near.spread * (1 + AFFINE_ROUNDING), axis=1)
    return np.asarray(found)


def inverse(A: Array) -> Array:
    """Inverses (c, k, k); no numbers where there is none."""
    good = np.asarray(np.isfinite(A).all(axis=(1, 2)))
    good &= np.abs(np.linalg.det(np.where(good[:, None, None], A, np.eye(A.shape[-1])))) > 0
    return np.where(good[:, None, None], np.linalg.inv(np.where(good[:, None, None], A, np.eye(A.shape[-1]))), np.nan)


def pseudo_inverse(A: Array) -> Array:
    """Pseudo-inverses (c, n, m) of matrices (c, m, n); zero where there is none."""
    good = np.isfinite(A).all(axis=(1, 2), keepdims=True)
    found = np.linalg.pinv(np.where(good, A, np.eye(*A.shape[1:])))
    return np.asarray(np.where(good, found, 0.0))


def solution(A: Array, b: Array) -> Array:
    """A⁻¹ b."""
    return np.asarray((pseudo_inverse(A) @ np.nan_to_num(b)[..., None])[..., 0])
