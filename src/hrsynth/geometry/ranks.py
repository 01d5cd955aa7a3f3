"""Ranks with their evidence: the gap between the last kept and the first dropped singular value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import UndecidedRank
from ..tolerances import DIRECTION_SINE_TOL, NAMED_TWIST_TOL, RANK_CUTOFF_FRACTION, RANK_GAP_MIN
from .vectors import Array

EPSILON, TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)
CLEAN = 1 / EPSILON
"""The gap of a rank that nothing contradicts: no singular value is dropped, or all are exactly zero."""


@dataclass(frozen=True)
class Rank:
    """A rank, the ratio of the last kept to the first dropped singular value (a clean zero counts as ε), and the last
    kept singular value as a fraction of the largest."""

    value: int
    gap: float
    weakest: float = 1.0

    @property
    def dropped(self) -> float:
        """The first dropped singular value, at least ε, as a fraction of the largest."""
        return self.weakest / self.gap

    def decided(self, what: str) -> int:
        """The rank, if the gap is large enough for a verdict; raises ``UndecidedRank`` otherwise."""
        if self.gap < RANK_GAP_MIN:
            raise UndecidedRank(what, self.gap, RANK_GAP_MIN)
        return self.value


def rank_of(singular_values: Array, scale: float | None = None, cutoff: float = RANK_CUTOFF_FRACTION) -> Rank:
    """The rank that descending singular values show: those above ``cutoff`` × ``scale`` (default: the largest)."""
    values = np.asarray(singular_values, dtype=float).tolist()
    if not values:
        return Rank(0, CLEAN)
    largest = values[0] if scale is None else max(scale, values[0])
    if largest <= TINY:
        return Rank(0, CLEAN)
    floor, least = EPSILON * largest, cutoff * largest
    kept = len(values)
    while kept and not values[kept - 1] > least:
        kept -= 1
    last = values[kept - 1] if kept else largest
    dropped = max(values[kept], floor) if kept < len(values) else floor
    return Rank(kept, last / dropped, last / largest)


def decompose_matrix(matrix: Array, full_matrices: bool = False) -> tuple[Array, Array, Array]:
    """U, s, Vᵀ of a matrix (rows, columns). LAPACK's divide and conquer gives up on some matrices with many equal
    singular values; QR iteration, which is slower, does these."""
    try:
        return np.linalg.svd(matrix, full_matrices=full_matrices)
    except np.linalg.LinAlgError:
        if not np.all(np.isfinite(matrix)):
            raise
        from scipy.linalg import svd

        U, s, Vt = svd(matrix, full_matrices=full_matrices, lapack_driver="gesvd")
        return U, s, Vt


def decompose_matrices(matrices: Sequence[Array], full_matrices: bool = False) -> list[tuple[Array, Array, Array]]:
    """:func:`decompose_matrix` of several matrices, those of one shape in one call: the same digits."""
    if len({matrix.shape for matrix in matrices}) == 1:
        try:
            return list(zip(*np.linalg.svd(np.array(matrices), full_matrices=full_matrices), strict=True))
        except np.linalg.LinAlgError:
            pass
    return [decompose_matrix(matrix, full_matrices) for matrix in matrices]


def compute_range_basis(matrix: Array, scale: float | None = None) -> tuple[Array, Rank]:
    """An orthonormal basis (rows of ``matrix`` long) of the column space, with the rank."""
    return compute_range_bases([matrix], scale)[0]


def compute_range_bases(matrices: Sequence[Array], scale: float | None = None) -> list[tuple[Array, Rank]]:
    """:func:`compute_range_basis` of several matrices."""
    if any(0 in matrix.shape for matrix in matrices):
        return [
            compute_range_basis(matrix, scale) if matrix.size else (np.zeros((matrix.shape[0], 0)), Rank(0, CLEAN))
            for matrix in matrices
        ]
    ranks = [(U, rank_of(s, scale)) for U, s, _ in decompose_matrices(matrices)]
    return [(U[:, : rank.value], rank) for U, rank in ranks]


def draw_in_space(basis: Array, rng: np.random.Generator) -> Array:
    """A random vector (rows,) of the space that an orthonormal basis (rows, k) spans, whichever basis that is: a normal
    one, projected."""
    return np.asarray(basis @ (basis.T @ rng.normal(size=len(basis))))


def compute_space_basis(matrix: Array, scale: float | None = None) -> Array:
    """An orthonormal basis (rows, rank) of the column space that depends on the space alone, not on its columns or the
    last digit: coordinate axes where these span it, else those that lie nearest to it, one after the other, as they
    are in it (a Cholesky decomposition of the projector with pivots; of equal ones the first)."""
    found = compute_range_basis(matrix, scale)[0]
    onto = found @ found.T
    along = np.diag(onto) > 0.5
    if np.max(np.abs(onto - np.diag(along)), initial=0.0) < DIRECTION_SINE_TOL:
        return np.eye(len(matrix))[:, along]
    basis = np.zeros_like(found)
    for k in range(found.shape[1]):
        near = np.diag(onto)
        i = int(np.argmax(near > (1 - NAMED_TWIST_TOL) * near.max()))
        basis[:, k] = onto[i] / np.sqrt(onto[i, i])
        onto = onto - np.outer(basis[:, k], basis[:, k])
    return basis


def compute_kernel_basis(matrix: Array, scale: float | None = None) -> tuple[Array, Rank]:
    """An orthonormal basis of the kernel, shape (columns, nullity), with the rank of the matrix."""
    found = compute_matrix_spectrum(matrix, scale)
    return found.kernel, found.rank


@dataclass(frozen=True, eq=False)
class Spectrum:
    """A matrix taken apart: a basis of its kernel (columns, nullity), its rank, the singular values that count,
    descending (rank,), and their left (rows, rank) and right (columns, rank) vectors."""

    kernel: Array
    rank: Rank
    values: Array
    left: Array
    right: Array


def compute_matrix_spectrum(matrix: Array, scale: float | None = None) -> Spectrum:
    """The spectrum of a matrix; ``scale`` as in :func:`rank_of`."""
    return compute_matrix_spectra([matrix], scale)[0]


def compute_matrix_spectra(matrices: Sequence[Array], scale: float | None = None) -> list[Spectrum]:
    """:func:`compute_matrix_spectrum` of several matrices."""
    if len({matrix.shape for matrix in matrices}) != 1:
        return [compute_matrix_spectrum(matrix, scale) for matrix in matrices]
    rows, columns = matrices[0].shape
    if 0 in (rows, columns):
        return [
            Spectrum(np.eye(columns), Rank(0, CLEAN), np.zeros(0), np.zeros((rows, 0)), np.zeros((columns, 0)))
            for _ in matrices
        ]
    found = []
    for U, s, Vt in decompose_matrices(matrices, full_matrices=rows < columns):
        rank = rank_of(s, scale)
        r = rank.value
        found.append(Spectrum(Vt[r:].T, rank, s[:r], U[:, :r], Vt[:r].T))
    return found


def compute_singular_values(matrices: Array) -> Array:
    """The singular values of each matrix (k, rows, columns), divided by the largest where that is above one; (k, n)."""
    values = np.linalg.svd(matrices, compute_uv=False)
    return np.asarray(values / np.maximum(values.max(axis=1, initial=1.0), 1.0)[:, None])


def compute_largest_angle(A: Array, B: Array) -> float:
    """The largest principal angle (radians) between two column spaces given by orthonormal bases; π/2 where their
    dimensions differ."""
    if A.shape[1] != B.shape[1]:
        return float(np.pi / 2)
    if A.shape[1] == 0:
        return 0.0
    outside = B - A @ (A.T @ B)
    return float(np.arcsin(min(1.0, float(np.linalg.norm(outside, 2)))))
