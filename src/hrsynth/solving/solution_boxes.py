"""Boxes that hold all bounded real solutions of polynomial equations, from combinations of the equations.

With b a basis of what is left of the polynomials modulo the equations f, least squares give each product y_i b_j as
C b + h f, so that the remainder and the errors of f are bounded at each solution. Then M b = r b but for that bound,
with M that of a random sum r of the unknowns. Of an eigenvalue λ of M with eigenvectors V and W = V⁻¹, the part c = W b
is nearly zero unless λ is near r. So r is near an eigenvalue, and y near what its eigenvector gives. Nothing depends on
a rank that is decided right: a wrong one leaves a remainder. (Eigenvalues of multiplication: D. A. Cox, J. Little and
D. O'Shea, Using Algebraic Geometry, 2005, chapter 2.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array
from ..results import Value
from .linear_elimination import bound_rounding

MONOMIALS_MAX = 1300
"""Largest number of monomials of the combinations."""
DEGREE_MAX = 10
INDEPENDENT_MIN = 1e-9
"""Smallest singular value, over the largest, of multiples of the equations that are used."""
STABLE_MIN = 1e-6
"""Singular value from which values of monomials at solutions are independent."""
INFLATION_FRACTION = 1e-6
"""By how much bounds are larger, relative to them: more than the rounding of their own sums."""
NEGLECTED_MAX = 1e-3
"""Largest bound, relative to 1, of what is to be nearly zero."""
SUMS_COUNT = 4
"""Random sums of the unknowns that are tried until one separates all real solutions."""


@dataclass(frozen=True, eq=False, repr=False)
class AlgebraEvidence(Value):
    """A basis, by its exponents (K, m), of polynomials modulo equations; products as sums of it, C; the multiples of
    equations that show them, as weights (targets, multiples) of quadrics times monomials; a random sum of the unknowns
    and the eigenvectors of its matrix."""

    basis: Array
    C: Array
    weights: Array
    quadrics: NDArray[np.intp]
    factors: Array
    sum: Array
    eigenvalues: Array
    V: Array
    W: Array
    real: tuple[int, ...]
    """Numbers of the eigenvalues that have a box."""


@dataclass(frozen=True, eq=False, repr=False)
class Confinement(Value):
    """All real solutions within the bounds, each in a box of its own.

    Parameters
    ----------
    middles, radii
        Boxes (k, m). A box may hold no solution, and nothing is known about how many it holds.
    others
        Solutions that are not real (l, m), as eigenvectors give them, without proof.
    degree
        Degree of the combinations.
    evidence
        What the boxes are computed from.
    """

    middles: Array
    radii: Array
    others: Array
    degree: int
    evidence: AlgebraEvidence


@lru_cache(maxsize=64)
def list_exponents(m: int, degree: int) -> Array:
    """Return the exponents (k, m) of all monomials up to a degree, by degree."""
    rows = [
        np.bincount(np.array(chosen, dtype=int), minlength=m)
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(m), d)
    ]
    return np.array(rows, dtype=int).reshape(-1, m)


@dataclass(frozen=True, eq=False, repr=False)
class _QuotientAlgebra(Value):
    """Polynomials modulo the equations: a basis of K monomials, by their places, the constant first, and, row by row,
    products of each unknown with these and then the unknowns as sums of them, C (m K + m, K)."""

    basis: Array
    C: Array
    places: list[int]
    weights: Callable[[Array], Array]
    """Weights of the multiples whose sum is nearest to polynomials (k, monomials)."""


class Multiples:
    """Multiples, up to a degree, of quadrics (N, terms) in m unknowns; ``is_inconsistent`` if 1 is a sum of them, to
    rounding."""

    def __init__(self, table: Array, m: int, degree: int) -> None:
        self.m, self.degree, self.is_inconsistent = m, degree, False
        self.exponents = list_exponents(m, degree)
        self.index = {row.tobytes(): k for k, row in enumerate(self.exponents)}
        factors, unit = list_exponents(m, degree - 2), np.vstack([np.zeros(m, dtype=int), np.eye(m, dtype=int)])
        upper = np.triu_indices(m + 1)
        terms = unit[upper[0]] + unit[upper[1]]
        places = np.array([[self.index[(f + t).tobytes()] for t in terms] for f in factors])
        self.factors = np.tile(np.arange(len(factors)), len(table))
        self.quadrics = np.repeat(np.arange(len(table)), len(factors))
        self.rows = np.zeros((len(table) * len(factors), len(self.exponents)), dtype=table.dtype)
        self.rows[np.arange(len(self.rows))[:, None], places[self.factors]] = table[self.quadrics]

    def quotient(self) -> _QuotientAlgebra | None:
        """Return polynomials modulo the equations, as far as the multiples show them; None where they do not."""
        Q, R = np.linalg.qr(self.rows)
        U, s, Vh = np.linalg.svd(R)
        rank = int(np.sum(s > INDEPENDENT_MIN * s[0]))
        kernel = Vh[rank:].conj().T
        self.is_inconsistent = rank == len(self.exponents)
        if (basis := self._choose_basis(kernel)) is None:
            return None
        unit = np.eye(self.m, dtype=int)
        places = [self.index[(row + self.exponents[b]).tobytes()] for row in unit for b in basis]
        places += [self.index[row.tobytes()] for row in unit]

        def weigh(polynomials: Array) -> Array:
            return np.asarray((polynomials @ Vh[:rank].conj().T / s[:rank]) @ U[:, :rank].conj().T @ Q.conj().T)

        return _QuotientAlgebra(basis, kernel[places] @ np.linalg.pinv(kernel[basis]), places, weigh)

    def _choose_basis(self, kernel: Array) -> Array | None:
        """Return monomials that span all others up to one degree more, the constant first; None where there are none
        below the largest degree."""
        counts = [int(np.sum(self.exponents.sum(axis=1) <= degree)) for degree in range(self.degree + 1)]
        ranks = list[int]()
        for count in counts:
            s = np.linalg.svd(kernel[:count], compute_uv=False)
            ranks.append(int(np.sum(s > STABLE_MIN)))
        low = next((k for k in range(self.degree) if ranks[k] == ranks[k + 1] > 0), None)
        if low is None:
            return None
        from scipy.linalg import qr

        part = kernel[: counts[low]]
        first = part[0] / np.linalg.norm(part[0])
        order = qr((part - np.outer(part @ first.conj(), first)).T, pivoting=True, mode="r")[1]
        return np.array([0, *[int(k) for k in order if k][: ranks[low] - 1]])


def enclose_all_solutions(table: Array, errors: Array, farthest: Array) -> Confinement | None:
    """Return boxes that hold all real solutions within bounds; None where no combination up to the degree that
    ``MONOMIALS_MAX`` allows proves them.

    Parameters
    ----------
    table, errors
        Quadrics (N, terms), the upper triangle of (1, y) (1, y)ᵀ row by row, and bounds (N,) of their absolute values
        at each solution.
    farthest
        Bounds (m,) of |y| at each solution.
    """
    sums = [_draw_sum(len(farthest), seed) for seed in range(SUMS_COUNT)]
    for multiples, quotient in _list_quotients(table, len(farthest)):
        boxes = None if quotient is None else _enclose_all(multiples, quotient, errors, farthest, sums)
        if boxes is not None:
            return boxes
    return None


def find_solutions(table: Array, m: int) -> Array | None:
    """Return all solutions (k, m) of quadrics with complex coefficients, from eigenvectors, without proof; None where
    they are not isolated."""
    for multiples, quotient in _list_quotients(table, m):
        if quotient is not None:
            return _read_points(quotient, np.linalg.eig(_sum_products(quotient, _draw_sum(m, 0)))[1])
        if multiples.is_inconsistent:
            return np.zeros((0, m))
    return None


def _list_quotients(table: Array, m: int) -> Iterator[tuple[Multiples, _QuotientAlgebra | None]]:
    """Yield multiples by their degree, and the quotient that they show."""
    for degree in range(2, DEGREE_MAX + 1):
        if comb(m + degree, m) > MONOMIALS_MAX:
            return
        multiples = Multiples(table, m, degree)
        yield multiples, multiples.quotient()


def _sum_products(quotient: _QuotientAlgebra, r: Array) -> Array:
    """Return the matrix (K, K) of multiplication by a sum of the unknowns."""
    K, m = len(quotient.basis), len(r)
    return np.asarray(np.einsum("i,ijk->jk", r, quotient.C[: m * K].reshape(m, K, K)))


def _draw_sum(m: int, seed: int) -> Array:
    """Return the weights (m,) of a random sum of the unknowns."""
    r = np.random.default_rng(seed).normal(size=m)
    return np.asarray(r / np.linalg.norm(r))


def _read_points(quotient: _QuotientAlgebra, V: Array) -> Array:
    """Return the solutions (k, m) that eigenvectors give."""
    K = len(quotient.basis)
    kept = np.abs(V[0]) > STABLE_MIN
    return np.asarray((quotient.C[-(len(quotient.C) // (K + 1)) :] @ (V[:, kept] / V[0, kept])).T)


def _enclose_all(
    multiples: Multiples, quotient: _QuotientAlgebra, errors: Array, farthest: Array, sums: list[Array]
) -> Confinement | None:
    """Return boxes from combinations of one degree, by the first of the sums of the unknowns that separates all
    real solutions; None where none does, or bounds are too large."""
    basis, C = quotient.basis, quotient.C
    targets = np.zeros((len(C), multiples.rows.shape[1]))
    targets[np.arange(len(C)), quotient.places] = 1.0
    targets[:, basis] -= C
    weights = quotient.weights(targets)
    sizes = np.prod(farthest**multiples.exponents, axis=1)
    summing = np.abs(weights) @ np.abs(multiples.rows) + np.abs(targets)
    left = np.abs(weights @ multiples.rows - targets) + bound_rounding(len(multiples.rows)) * summing
    off = left @ sizes + np.abs(weights) @ (errors[multiples.quadrics] * sizes[multiples.factors])
    off *= 1.0 + INFLATION_FRACTION
    return next(
        (boxes for r in sums if (boxes := _separate(multiples, quotient, weights, off, sizes[basis], r)) is not None),
        None,
    )


def _separate(
    multiples: Multiples, quotient: _QuotientAlgebra, weights: Array, off: Array, sizes: Array, r: Array
) -> Confinement | None:
    """Return boxes from the eigenvectors of multiplication by a sum of the unknowns; ``off``: bounds of products less
    their sums, ``sizes``: of the basis."""
    basis, C, m = quotient.basis, quotient.C, multiples.m
    K, values = len(basis), C[m * len(basis) :]
    M, within, off_values = _sum_products(quotient, r), np.abs(r) @ off[: m * K].reshape(m, K), off[m * K :]
    eigenvalues, V = np.linalg.eig(M)
    try:
        W = np.linalg.inv(V)
    except np.linalg.LinAlgError:
        return None
    rounding = bound_rounding(2 * K)
    # (λ − r) c is at most eta; b is V c within lost
    sides = np.abs(W) @ np.abs(M) + np.abs(eigenvalues)[:, None] * np.abs(W)
    eta = np.abs(W) @ within + (np.abs(W @ M - eigenvalues[:, None] * W) + rounding * sides) @ sizes
    lost = (np.abs(np.eye(K) - V @ W) + rounding * (np.abs(V) @ np.abs(W))) @ sizes
    if not (np.all(np.isfinite(eta)) and lost[0] < NEGLECTED_MAX):
        return None
    # 1 = b_0 is V_0 c: one part of K is at least its share
    rho = K * np.abs(V[0]) * eta / (1.0 - lost[0])
    real = np.abs(eigenvalues.imag) <= rho
    middles, radii = np.zeros((0, m)), np.zeros((0, m))
    for k in np.flatnonzero(real):
        gaps = np.abs(np.delete(eigenvalues, k) - eigenvalues[k]) - rho[k]
        if np.any(gaps <= rho[k]) or abs(V[0, k]) <= STABLE_MIN:
            return None
        small = np.insert(np.delete(eta, k) / gaps, k, 0.0)
        # c_k is (1 − Σ V_0l c_l) / V_0k
        part = float(np.abs(V[0]) @ small + lost[0])
        if part > NEGLECTED_MAX:
            return None
        b = V[:, k] / V[0, k]
        b_off = np.abs(b.imag) + np.abs(b) * part + np.abs(V) @ small + lost
        middles = np.vstack([middles, values @ b.real])
        radii = np.vstack([radii, off_values + np.abs(values) @ (b_off + rounding * np.abs(b))])
    others = _read_points(quotient, V[:, ~real])
    evidence = AlgebraEvidence(
        multiples.exponents[basis],
        C,
        weights,
        multiples.quadrics,
        multiples.exponents[multiples.factors],
        r,
        eigenvalues,
        V,
        W,
        tuple(int(k) for k in np.flatnonzero(real)),
    )
    return Confinement(middles, radii, others, multiples.degree, evidence)
