"""Elimination of what is linear in quadratic equations, with a bound of what it neglects.

Combinations of quadrics whose quadratic parts cancel are linear; they eliminate unknowns, and what remains may have new
ones. To drop an equation, or a combination that is nearly none, only adds solutions: no rank has to be decided right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array
from ..results import Value

CANCELLED_MAX = 1e-7
"""Singular value of quadratic parts below which they cancel; what is left of them counts as error."""
LINEAR_MIN = 1e-6
"""Smallest singular value of linear equations that eliminate an unknown."""


@dataclass(frozen=True, eq=False, repr=False)
class Reduction(Value):
    """Equations in the unknowns y that remain of x.

    Parameters
    ----------
    T
        x is within ``slack`` of T (1, y), shape (n + 1, m + 1), for each exact solution.
    slack
        Bounds (n,).
    table
        Coefficients (N, (m + 1)(m + 2) / 2) of quadrics in (1, y), the upper triangle row by row.
    errors
        Bounds (N,) of their absolute values at each exact solution.
    farthest
        Bounds (m,) of |y| at each exact solution.
    rounds
        Of each elimination: the unknowns, by their places among those that were left, and the weights (k, given
        equations) of the sums that give them.
    picks
        Weights (N, given equations) of the equations of ``table``.
    """

    T: Array
    slack: Array
    table: Array
    errors: Array
    farthest: Array
    rounds: tuple[tuple[list[int], Array], ...]
    picks: Array

    @property
    def sizes(self) -> Array:
        """Bounds (terms,) of the terms."""
        return bound_terms(self.farthest)


def bound_terms(farthest: Array) -> Array:
    """Return bounds of the products of 1 and unknowns, the upper triangle row by row."""
    extent = np.append(1.0, farthest)
    i, j = np.triu_indices(len(extent))
    return np.asarray(extent[i] * extent[j])


def eliminate_linear(matrices: Array, errors: Array, farthest: Array) -> Reduction:
    """Return the equations without the unknowns that linear combinations eliminate; y are some of x.

    Parameters
    ----------
    matrices, errors
        Symmetric matrices (N, n + 1, n + 1): |(1, x) M (1, x)| is at most its error (N,) at each exact solution x.
    farthest
        Bounds (n,) of |x| at each exact solution.
    """
    n = matrices.shape[1] - 1
    T, slack, reach, magnitudes = np.eye(n + 1), np.zeros(n), farthest, np.abs(matrices)
    rounding, rounds = bound_rounding(2 * n), list[tuple[list[int], Array]]()
    while True:
        m = T.shape[1] - 1
        most, off = np.append(1.0, farthest + slack), np.append(0.0, slack)
        square, sizes = np.triu_indices(m + 1)[0] > 0, bound_terms(reach)
        summed = np.abs(T) @ np.append(1.0, reach)
        # of each equation after the substitution: what was neglected, and rounding of it and of its combinations
        missed = errors + magnitudes @ off @ (2 * most) + rounding * (1.0 + magnitudes @ summed @ summed)
        table = list_coefficients(T.T @ matrices @ T)
        # those that reach farthest are eliminated, so that the others stay small
        weights = _pick_linear_equations(table, square)
        if not (out := _choose_pivots((weights @ table)[:, ~square][:, 1:] * (1.0 + reach))):
            independent = _pick_independent_equations(table, missed)
            used = independent @ table
            weights = _find_cancelling_weights(used[:, square]) @ independent
            if not (out := _choose_pivots((weights @ table)[:, ~square][:, 1:] * (1.0 + reach))):
                return Reduction(T, slack, used, np.abs(independent) @ missed, reach, tuple(rounds), independent)
        kept, A = np.setdiff1d(np.arange(m), out), (weights @ table)[:, ~square][:, 1:][:, out]
        picked = _choose_pivots(A.T, len(out))
        weights = np.linalg.inv(A[picked]) @ weights[picked]
        rounds.append((out, weights))
        rows = weights @ table
        linear = rows[:, ~square]
        # an eliminated unknown is minus what its row has besides, but for equations' values and what does not cancel
        shift, places = np.zeros((m + 1, len(kept) + 1), dtype=matrices.dtype), 1 + np.array(out)
        shift[0, 0] = 1.0
        shift[1 + kept, 1 + np.arange(len(kept))] = 1.0
        shift[places] = -linear[:, np.append(0, 1 + kept)]
        remainder = rows.copy()
        remainder[:, ~square] = 0.0
        remainder[:, np.flatnonzero(~square)[places]] = linear[:, places] - np.eye(len(out))
        moved = T[1:, places]
        slack = slack + np.abs(moved @ weights) @ missed + np.abs(moved @ remainder) @ sizes
        summing = np.abs(weights) @ (missed + np.abs(table) @ sizes)
        reach = reach[kept]
        slack += rounding * (np.abs(moved) @ summing + np.abs(T[1:]) @ np.abs(shift) @ np.append(1.0, reach))
        T = T @ shift


def bound_rounding(count: int) -> float:
    """Return a bound of the relative error of sums of so many products, and of sixteen roundings more."""
    return float((count + 16) * np.finfo(float).eps)


def list_coefficients(matrices: Array) -> Array:
    """Return coefficients (N, terms) of symmetric matrices (N, m + 1, m + 1), the upper triangle row by row."""
    m = matrices.shape[-1]
    upper = np.triu_indices(m)
    return np.asarray((matrices * (2 - np.eye(m)))[:, upper[0], upper[1]])


def _pick_linear_equations(table: Array, square: NDArray[np.bool_]) -> Array:
    """Return weights (k, N) that pick the equations that are linear as they stand."""
    quadratic = np.abs(table[:, square]).max(axis=1, initial=0.0)
    linear = np.abs(table[:, ~square][:, 1:]).max(axis=1, initial=0.0)
    return np.eye(len(table))[(linear > LINEAR_MIN) & (quadratic <= CANCELLED_MAX * linear)]


def _pick_independent_equations(table: Array, missed: Array) -> Array:
    """Return weights (k, N) that pick independent equations, those with the least errors first, at length one."""
    chosen = _choose_pivots((table * (missed.min() / missed)[:, None]).T)
    weights = np.zeros((len(chosen), len(table)))
    weights[np.arange(len(chosen)), chosen] = 1.0 / np.linalg.norm(table[chosen], axis=1)
    return weights


def _find_cancelling_weights(squares: Array) -> Array:
    """Return weights (k, N) of combinations whose quadratic parts cancel."""
    if not squares.size:
        return np.eye(len(squares))
    U, s, _ = np.linalg.svd(squares)
    return np.asarray(U[:, int(np.sum(s > CANCELLED_MAX)) :].conj().T)


def _choose_pivots(matrix: Array, count: int | None = None) -> list[int]:
    """Return independent columns of a matrix, the most independent first; ``count`` if it is given."""
    if not matrix.size:
        return []
    from scipy.linalg import qr

    R, order = qr(matrix, pivoting=True, mode="r")
    sizes = np.abs(np.diag(R))
    return [int(k) for k in order[: count or int(np.sum(sizes > LINEAR_MIN * max(1.0, sizes[0])))]]
