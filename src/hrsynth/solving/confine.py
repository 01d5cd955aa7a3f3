"""Proof that all bounded real solutions of polynomial equations are in as many tiny boxes, from combinations of the
equations.

With b a basis of what is left of the polynomials modulo the equations f, each product y_i b_j is C b + h f, found by
least squares, so that the remainder and the errors of f are bounded at each solution. Then M b = r b but for that
bound, with M that of a random sum r of the unknowns. Of an eigenvalue λ of M with eigenvectors V and W = V⁻¹, the part
c = W b is nearly zero unless λ is near r. So r is near an eigenvalue, and y near what its eigenvector gives. Nothing
depends on a rank that is decided right: a wrong one leaves a remainder. (Eigenvalues of multiplication: D. A. Cox,
J. Little and D. O'Shea, Using Algebraic Geometry, 2005, chapter 2.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np

from ..geometry.vectors import Array
from ..results import Value
from ..tolerances import AFFINE_ROUNDING

MONOMIALS_MAX = 1300
"""Largest number of monomials of the combinations."""
DEGREE_MAX = 10
INDEPENDENT_MIN = 1e-9
"""Smallest singular value, over the largest, of multiples of the equations that are used."""
STABLE_MIN = 1e-6
"""Singular value from which values of monomials at solutions are independent."""
NOTHING = 1e-3
"""Largest bound, relative to 1, of what is to be nearly zero."""


@dataclass(frozen=True, eq=False, repr=False)
class Confinement(Value):
    """All real solutions within the bounds, each in a box of its own; ``complex`` counts eigenvalues, not proved.

    Parameters
    ----------
    middles, radii
        Boxes (k, m). A box may hold no solution, and nothing is known about how many it holds.
    complex
        Number of solutions, complex ones too, with multiplicity, if those at infinity are separated.
    degree
        Degree of the combinations.
    remainder
        Largest bound of what a combination leaves.
    """

    middles: Array
    radii: Array
    complex: int
    degree: int
    remainder: float


@lru_cache(maxsize=64)
def list_exponents(m: int, degree: int) -> Array:
    """Return the exponents (k, m) of all monomials up to a degree, by degree."""
    rows = [
        np.bincount(np.array(chosen, dtype=int), minlength=m)
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(m), d)
    ]
    return np.array(rows, dtype=int).reshape(-1, m)


class Multiples:
    """Multiples, up to a degree, of quadrics (N, terms) in m unknowns."""

    def __init__(self, table: Array, m: int, degree: int) -> None:
        self.m, self.degree = m, degree
        self.exponents = list_exponents(m, degree)
        self.index = {each.tobytes(): k for k, each in enumerate(self.exponents)}
        factors, unit = list_exponents(m, degree - 2), np.vstack([np.zeros(m, dtype=int), np.eye(m, dtype=int)])
        upper = np.triu_indices(m + 1)
        terms = unit[upper[0]] + unit[upper[1]]
        places = np.array([[self.index[(f + t).tobytes()] for t in terms] for f in factors])
        self.factors = np.tile(np.arange(len(factors)), len(table))
        self.quadrics = np.repeat(np.arange(len(table)), len(factors))
        self.rows = np.zeros((len(table) * len(factors), len(self.exponents)))
        self.rows[np.arange(len(self.rows))[:, None], places[self.factors]] = table[self.quadrics]

    def place(self, exponents: Array) -> int:
        """Return the place of a monomial."""
        return self.index[exponents.tobytes()]

    def count_up_to(self, degree: int) -> int:
        """Return the number of monomials up to a degree."""
        return int(np.sum(self.exponents.sum(axis=1) <= degree))


def confine_solutions(table: Array, errors: Array, farthest: Array) -> Confinement | None:
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
    m, degree = len(farthest), 2
    while degree <= DEGREE_MAX and len(list_exponents(m, degree)) <= MONOMIALS_MAX:
        multiples = Multiples(table, m, degree)
        found = _confine(multiples, errors, farthest)
        if found is not None:
            return found
        degree += 1
    return None


def _confine(multiples: Multiples, errors: Array, farthest: Array) -> Confinement | None:
    """Return boxes from combinations of one degree."""
    m, rows = multiples.m, multiples.rows
    Q, R = np.linalg.qr(rows)
    U, s, Vt = np.linalg.svd(R)
    rank = int(np.sum(s > INDEPENDENT_MIN * s[0]))
    kernel = Vt[rank:].T
    chosen = _choose_basis(multiples, kernel)
    if chosen is None:
        return None
    basis, others = chosen
    K = len(basis)
    values = np.linalg.pinv(kernel[basis])
    # targets: products of unknowns and basis monomials, then the unknowns
    unit = np.eye(m, dtype=int)
    places = [multiples.place(unit[i] + multiples.exponents[b]) for i in range(m) for b in basis]
    places += [multiples.place(unit[i]) for i in range(m)]
    C = kernel[places] @ values
    targets = np.zeros((len(places), rows.shape[1]))
    targets[np.arange(len(places)), places] = 1.0
    targets[:, basis] -= C
    weights = (targets @ Vt[:rank].T / s[:rank]) @ U[:, :rank].T @ Q.T
    with np.errstate(over="ignore"):
        sizes = np.prod(farthest ** multiples.exponents, axis=1)
    left = np.abs(weights @ rows - targets) + AFFINE_ROUNDING * (np.abs(weights) @ np.abs(rows))
    of_rows = errors[multiples.quadrics] * sizes[multiples.factors]
    off = left @ sizes + np.abs(weights) @ of_rows
    return _separate(C.reshape(-1, K), off, sizes[basis], m, multiples.degree)


def _choose_basis(multiples: Multiples, kernel: Array) -> tuple[Array, int] | None:
    """Return monomials that span all others up to one degree more, the constant first, and that degree; None where
    there are none below the largest degree."""
    ranks = list[int]()
    for degree in range(multiples.degree + 1):
        part = kernel[: multiples.count_up_to(degree)]
        ranks.append(int(np.sum(np.linalg.svd(part, compute_uv=False) > STABLE_MIN)) if part.size else 0)
    low = next((k for k in range(multiples.degree) if ranks[k] == ranks[k + 1] > 0), None)
    if low is None:
        return None
    from scipy.linalg import qr

    part = kernel[: multiples.count_up_to(low)]
    first = part[0] / np.linalg.norm(part[0])
    order = qr((part - np.outer(part @ first, first)).T, pivoting=True, mode="r")[1]
    rest = [int(k) for k in order if k][: ranks[low] - 1]
    return np.array([0, *rest]), low


def _separate(C: Array, off: Array, sizes: Array, m: int, degree: int) -> Confinement | None:
    """Return a box for each real eigenvalue; None where two cannot be told apart, or bounds are too large.

    C holds, row by row, products of each unknown with basis elements, then the unknowns, as sums of basis elements (K,)
    that are at most ``sizes``; ``off`` bounds what is neglected.
    """
    K = len(sizes)
    by_unknown, values = C[: m * K].reshape(m, K, K), C[m * K :]
    off_products, off_values = off[: m * K].reshape(m, K), off[m * K :]
    r = np.random.default_rng(0).normal(size=m)
    r /= np.linalg.norm(r)
    M, within = np.einsum("i,ijk->jk", r, by_unknown), np.abs(r) @ off_products
    eigenvalues, V = np.linalg.eig(M)
    try:
        W = np.linalg.inv(V)
    except np.linalg.LinAlgError:
        return None
    rounding = AFFINE_ROUNDING * K
    # (λ − r) c is at most this; b is V c within the other
    eta = np.abs(W) @ within + (
        np.abs(W @ M - eigenvalues[:, None] * W)
        + rounding * (np.abs(W) @ np.abs(M) + np.abs(eigenvalues)[:, None] * np.abs(W))
    ) @ sizes
    lost = (np.abs(np.eye(K) - V @ W) + rounding * (np.abs(V) @ np.abs(W))) @ sizes
    if not (np.all(np.isfinite(eta)) and lost[0] < NOTHING):
        return None
    # 1 = b_0 is V_0 c: one part of K is at least its share
    rho = K * np.abs(V[0]) * eta / (1.0 - lost[0])
    real = np.flatnonzero(np.abs(eigenvalues.imag) <= rho)
    apart = np.abs(eigenvalues[:, None] - eigenvalues[None, :]) + np.diag(np.full(K, np.inf))
    middles, radii = [], []
    for k in real:
        gaps = apart[k] - rho[k]
        if np.any(gaps <= rho):
            return None
        small = eta / np.where(np.isinf(gaps), np.inf, gaps)
        # c_k = (1 − Σ V_0l c_l) / V_0k
        part = float(np.abs(V[0]) @ small + lost[0])
        if part > NOTHING or abs(V[0, k]) == 0.0:
            return None
        b = (V[:, k] / V[0, k]).real
        b_off = np.abs((V[:, k] / V[0, k]).imag) + np.abs(V[:, k] / V[0, k]) * part + np.abs(V) @ small + lost
        middles.append(values @ b)
        radii.append(off_values + np.abs(values) @ (b_off + rounding * np.abs(b)))
    shape = (len(middles), m)
    return Confinement(
        np.array(middles).reshape(shape), np.array(radii).reshape(shape), K, degree, float(np.max(off, initial=0.0))
    )
