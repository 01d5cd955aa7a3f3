"""All real solutions of quadratic equations within bounds, in boxes: linear combinations eliminate unknowns, equations
in one unknown give cases, and combinations of the equations confine what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..equations.reduction import Reduction, eliminate_linear
from ..errors import ExternalSolverFailure
from ..geometry.vectors import Array
from ..results import Value
from .confine import confine_solutions
from .uniqueness import enclose_unique, is_excluded

CASES_MAX = 512
"""Largest number of cases."""
OTHER_TERMS_MAX = 1e-9
"""Size of other terms below which an equation has none; they count as error."""
LEADING_MIN = 1e-3
"""Smallest coefficient of the square in an equation of length one with one unknown."""
ROOT_ROUNDING = 2.0**-48


@dataclass(frozen=True, eq=False, repr=False)
class SolutionBox(Value):
    """All real solutions in one case: x is within ``radii`` of ``middle``, both (n,); it may hold none."""

    middle: Array
    radii: Array


class QuadricSolver:
    """Solver of a system, with what it did: the number of cases, the unknowns left in the first one, and the largest
    degree of the combinations."""

    def __init__(self) -> None:
        self.cases, self.left, self.degree = 0, 0, 0

    def solve(self, matrices: Array, errors: Array, farthest: Array) -> list[SolutionBox]:
        """Return boxes that hold all real solutions x within bounds.

        Parameters
        ----------
        matrices, errors
            Symmetric matrices (N, n + 1, n + 1), and bounds (N,) of |(1, x) M (1, x)| at each solution.
        farthest
            Bounds (n,) of |x| at each solution.

        Raises
        ------
        ExternalSolverFailure
            If the solutions are not confined.
        """
        self.cases += 1
        if self.cases > CASES_MAX:
            raise ExternalSolverFailure("natural coordinates", f"more than {CASES_MAX} cases")
        reduced = eliminate_linear(matrices, errors, farthest)
        if self.cases == 1:
            self.left = len(reduced.farthest)
        if _is_contradictory(reduced):
            return []
        T = reduced.T[1:]
        return [
            SolutionBox(T @ np.append(1.0, box.middle), reduced.slack + np.abs(T[:, 1:]) @ box.radii)
            for box in self._solve_reduced(reduced)
        ]

    def _solve_reduced(self, reduced: Reduction) -> list[SolutionBox]:
        """Return boxes of the unknowns that remain (m,)."""
        m = len(reduced.farthest)
        if m == 0:
            return [SolutionBox(np.zeros(0), np.zeros(0))]
        matrices, errors, boxes = expand(reduced.table, m), reduced.errors, list[SolutionBox]()
        cases = _find_cases(reduced)
        if cases is not None:
            for k, value, off in cases:
                fixed = np.zeros((1, m + 1, m + 1))
                fixed[0, 0, 0], fixed[0, 0, k], fixed[0, k, 0] = -value, 0.5, 0.5
                boxes += self.solve(np.vstack([matrices, fixed]), np.append(errors, off), reduced.farthest)
            return boxes
        found = confine_solutions(reduced.table, errors, reduced.farthest)
        if found is None:
            raise ExternalSolverFailure("natural coordinates", f"{m} unknowns are not confined")
        self.degree = max(self.degree, found.degree)
        for middle, radii in zip(found.middles, found.radii, strict=True):
            if not is_excluded(matrices, errors, middle, radii):
                boxes.append(SolutionBox(*(enclose_unique(matrices, errors, middle, radii) or (middle, radii))))
        return boxes


def expand(table: Array, m: int) -> Array:
    """Return the symmetric matrices (N, m + 1, m + 1) of coefficients (N, terms)."""
    upper = np.triu_indices(m + 1)
    matrices = np.zeros((len(table), m + 1, m + 1))
    matrices[:, upper[0], upper[1]] = table / 2
    return np.asarray(matrices + matrices.transpose(0, 2, 1))


def _is_contradictory(reduced: Reduction) -> bool:
    """Return True if an equation's value cannot be as small as its error."""
    others = np.abs(reduced.table[:, 1:]) @ reduced.sizes[1:]
    return bool(np.any(np.abs(reduced.table[:, 0]) > others + reduced.errors))


def _find_cases(reduced: Reduction) -> list[tuple[int, float, float]] | None:
    """Return the values of an unknown, by its number from 1, and their errors, by an equation without others; None
    without one."""
    m = len(reduced.farthest)
    i, j = np.triu_indices(m + 1)
    for k in range(1, m + 1):
        own = np.isin(i, (0, k)) & np.isin(j, (0, k))
        U, s, _ = np.linalg.svd(reduced.table[:, ~own])
        weights = U[:, int(np.sum(s > OTHER_TERMS_MAX)) :].T
        rows = weights @ reduced.table
        if not len(rows):
            continue
        best = int(np.argmax(np.abs(rows[:, own][:, 2])))
        c, b, a = rows[best, own]
        if abs(a) < LEADING_MIN:
            continue
        off = np.abs(weights[best]) @ reduced.errors + np.abs(rows[best, ~own]) @ reduced.sizes[~own]
        return [(k, value, error) for value, error in enclose_square_roots(b / a, c / a, float(off / abs(a)))]
    return None


def enclose_square_roots(b: float, c: float, off: float) -> list[tuple[float, float]]:
    """Return middles and radii of intervals that hold all real y at which |y² + b y + c| is at most ``off``."""
    off = off + ROOT_ROUNDING * (1.0 + b * b + abs(c))
    middle, square = -b / 2, b * b / 4 - c
    if square < -off:
        return []
    if square <= 4 * off:
        return [(middle, float(np.sqrt(square + off)))]
    # the farther of the two factors y − r is at least half of their difference
    half = float(np.sqrt(square))
    return [(middle + half, off / half), (middle - half, off / half)]
