"""Proof that a box holds at most one solution of quadratic equations, more of them than unknowns or as many.

With C about the pseudoinverse of the Jacobian J at the middle m, two solutions differ by (1 − C J(X)) times their
difference; if |1 − C J(X)| r < r, with r the box's radii, they are one. So x − m is at most d with
d ≥ |1 − C J(d)| d + |C| (|F(m)| + errors). (R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval
Analysis, 2009, 8.1.)
"""

from __future__ import annotations

import numpy as np

from ..geometry.vectors import Array
from .linear_elimination import bound_rounding

REFINEMENTS_COUNT = 12
"""Newton's steps to the middle, and steps of the bound."""
SLOPE_ERROR_MAX = 4.0
"""Error of an equation's slopes, over that of its value."""
BOX_PADDING_FRACTION = 1e-12
"""By how much a box is widened before it is shrunk, relative to 1 plus the unknown."""


def enclose_unique(matrices: Array, errors: Array, middle: Array, radii: Array) -> tuple[Array, Array] | None:
    """Return a smaller box that holds all solutions in a box, one at most; None if that is not proved.

    Parameters
    ----------
    matrices, errors
        Symmetric matrices (N, n + 1, n + 1), and bounds (N,) of |(1, x) M (1, x)| at each solution.
    middle, radii
        The box, both (n,).

    Returns
    -------
    tuple of ndarray
        Its middle, a least-squares solution, and its radii (n,).
    """
    x, n = middle, len(middle)
    for _ in range(REFINEMENTS_COUNT):
        value, J = evaluate_quadrics(matrices, x)
        step = np.linalg.lstsq(J, value, rcond=None)[0]
        x = x - step
        if np.abs(step).max(initial=0.0) < BOX_PADDING_FRACTION:
            break
    value, J = evaluate_quadrics(matrices, x)
    C, magnitudes = np.linalg.pinv(J), np.abs(matrices)
    extent, rounding = np.append(1.0, np.abs(x)), bound_rounding(max(magnitudes.shape))
    left = np.abs(C) @ (np.abs(value) + errors + rounding * (magnitudes @ extent @ extent))
    at_middle = np.abs(np.eye(n) - C @ J) + rounding * (1.0 + np.abs(C) @ (2 * magnitudes @ extent)[:, 1:])
    at_middle += (np.abs(C) @ (SLOPE_ERROR_MAX * errors))[:, None]
    bends = np.tensordot(np.abs(C), 2 * magnitudes[:, 1:, 1:], axes=1)
    r = radii + np.abs(x - middle) + BOX_PADDING_FRACTION * (1 + np.abs(x))

    def spread(r: Array) -> Array:
        """Bounds of |1 − C J| r for all J in the box of these radii."""
        return np.asarray((at_middle + bends @ r) @ r * (1 + BOX_PADDING_FRACTION * len(matrices)))

    if not np.all(spread(r) < r):
        return None
    for _ in range(REFINEMENTS_COUNT):
        r = np.minimum(r, (spread(r) + left) * (1 + BOX_PADDING_FRACTION * len(matrices)))
    return x, r


def evaluate_quadrics(matrices: Array, x: Array) -> tuple[Array, Array]:
    """Return the values (N,) and the Jacobian (N, n) of quadrics at x."""
    full = np.append(1.0, x)
    rows = matrices @ full
    return rows @ full, 2 * rows[:, 1:]


def is_excluded(matrices: Array, errors: Array, middle: Array, radii: Array) -> bool:
    """Return True if a box is proved to hold no solution, with the arguments of :func:`enclose_unique`."""
    value, J = evaluate_quadrics(matrices, middle)
    magnitudes, extent = np.abs(matrices), np.append(1.0, np.abs(middle))
    spread = np.abs(J) @ radii + magnitudes[:, 1:, 1:] @ radii @ radii
    rounding = bound_rounding(max(magnitudes.shape)) * (magnitudes @ extent @ extent)
    return bool(np.any(np.abs(value) > errors + spread * (1 + BOX_PADDING_FRACTION * len(matrices)) + rounding))
