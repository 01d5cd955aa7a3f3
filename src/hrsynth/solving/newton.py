"""Newton's method from many starts at once, real or complex."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array

LAST_NEWTON_STEP_TOL = 1e-10
"""Step, relative to 1 plus the unknowns, from which on a zero is approached."""


@dataclass(frozen=True, eq=False)
class ApproachedZeros:
    """Places (c, n) where Newton's steps ended, the norms (c,) of the equations where they were last evaluated, and for
    which (c,) places they hold."""

    x: Array
    errors: Array
    converged: NDArray[np.bool_]


def solve_squares(J: Array, F: Array) -> Array:
    """Return d (…, n) with J d = F; where J (…, n, n) is singular, the shortest of least squares."""
    try:
        return np.asarray(np.linalg.solve(J, F[..., None])[..., 0])
    except np.linalg.LinAlgError:  # NumPy does not report which one
        return np.array(
            np.linalg.lstsq(J, F)[0] if J.ndim == 2 else [solve_squares(*pair) for pair in zip(J, F, strict=True)]
        )


def approach_zeros(
    evaluate: Callable[..., tuple[Array, Array]],
    starts: Array,
    *given: Array,
    steps: int,
    longest: float = np.inf,
    error_tol: float = 0.0,
    step_tol: float = LAST_NEWTON_STEP_TOL,
    solve: Callable[[Array, Array], Array] = solve_squares,
) -> ApproachedZeros:
    """Take Newton's steps from each start until its equations hold, or are no numbers any more.

    Parameters
    ----------
    evaluate
        Equations (c, m) and their derivatives (c, m, n) at places (c, n), and with the rows of what is ``given``.
    starts
        Places (c, n), real or complex as the equations are.
    given
        Of each start, what its equations depend on besides (c, …).
    steps
        The most steps that a start takes.
    longest
        The largest change of an unknown; longer steps are shortened.
    error_tol
        Norm of the equations below which they hold; 0: they do where a step is short.
    step_tol
        Largest change of an unknown in a short step, relative to 1 plus the unknowns.
    solve
        Steps (c, n) of derivatives and equations, by default of as many equations as unknowns.
    """
    x, live = starts.copy(), np.flatnonzero(np.isfinite(starts).all(axis=1))
    errors, converged = np.full(len(x), np.inf), np.zeros(len(x), dtype=bool)
    with np.errstate(all="ignore"):
        for left in range(steps, -1, -1):
            if not len(live):
                break
            F, J = evaluate(x[live], *(values[live] for values in given))
            errors[live] = np.linalg.norm(F, axis=1)
            far = np.isfinite(J).all(axis=(1, 2)) & (error_tol <= errors[live]) & (errors[live] < np.inf)
            live = live[far]
            if left and len(live):
                step = solve(J[far], F[far])
                size = np.abs(step).max(axis=1, initial=0.0)
                x[live] -= step / np.maximum(1.0, size / longest)[:, None]
                short = size < step_tol * (1.0 + np.abs(x[live]).max(axis=1, initial=0.0))
                converged[live] = short & (error_tol == 0.0)
                live = live[np.isfinite(size) & ~converged[live]]
    return ApproachedZeros(x, errors, converged | (errors < error_tol))
