"""All real solutions of quadratic equations within bounds, in boxes: linear combinations eliminate unknowns, equations
in one unknown give cases, and combinations of the equations confine what is left."""

from __future__ import annotations

import cmath
import math
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from ..errors import ExternalSolverFailure
from ..geometry.vectors import Array
from ..results import Value
from .linear_elimination import Reduction, eliminate_linear
from .solution_boxes import AlgebraEvidence, enclose_all_solutions, find_solutions
from .uniqueness import enclose_unique, is_excluded

CASES_MAX = 512
"""Largest number of cases."""
OTHER_TERMS_MAX = 1e-9
"""Size of other terms below which an equation has none; they count as error."""
LEADING_MIN = 1e-3
"""Smallest coefficient of the square in an equation of length one with one unknown."""
ROOT_ROUNDING = 2.0**-48
"""Relative error of the coefficients of a square equation: more than sixteen roundings."""


@dataclass(frozen=True, eq=False, repr=False)
class SolutionBox(Value):
    """All real solutions in one case: x is within ``radii`` of ``middle``, both (n,); it may hold none."""

    middle: Array
    radii: Array


@dataclass(eq=False)
class SolvingStep:
    """Record of a case: an elimination, then cases of one unknown (by its number from 1, with the weights of the
    equation that has it alone), or algebra."""

    reduced: Reduction
    contradictory: bool = False
    unknown: int = 0
    weights: Array | None = None
    cases: list[tuple[float, float, SolvingStep]] = field(default_factory=list)
    """Value of the unknown, its error, and what solved the case."""
    algebra: AlgebraEvidence | None = None
    points: list[tuple[int, Array]] = field(default_factory=list)
    """Numbers of eigenvalues, and the solutions (m,) to which their boxes were shrunk."""


class QuadricSolver:
    """Solver of a system, with what it did.

    Attributes
    ----------
    cases, solved
        Number of real cases, and of all.
    left
        Unknowns that linear equations leave in the first one.
    degree
        Largest degree of the combinations.
    last
        What solved the last case, after :meth:`solve` the whole.
    """

    def __init__(self) -> None:
        self.cases, self.left, self.degree, self.solved = 0, 0, 0, 0
        self.last: SolvingStep | None = None

    def solve(self, matrices: Array, errors: Array, farthest: Array) -> tuple[list[SolutionBox], Array]:
        """Return boxes that hold all real solutions x within bounds, and other solutions (k, n), without proof.

        Parameters
        ----------
        matrices, errors
            Symmetric matrices (N, n + 1, n + 1), and bounds (N,) of |(1, x) M (1, x)| at each solution. With complex
            matrices all solutions are others.
        farthest
            Bounds (n,) of |x| at each real solution.

        Raises
        ------
        ExternalSolverFailure
            If the solutions are not confined.
        """
        self.cases += not np.iscomplexobj(matrices)
        self.solved += 1
        if self.cases > CASES_MAX or self.solved > 4 * CASES_MAX:
            raise ExternalSolverFailure("natural coordinates", f"more than {CASES_MAX} cases")
        reduced = eliminate_linear(matrices, errors, farthest)
        if self.solved == 1:
            self.left = len(reduced.farthest)
        step = SolvingStep(reduced, _is_contradictory(reduced))
        boxes, others = list[SolutionBox](), np.zeros((0, len(reduced.farthest)))
        if not step.contradictory:
            boxes, others = self._solve_reduced(step)
        self.last, T = step, reduced.T[1:]
        return (
            [
                SolutionBox(T @ np.append(1.0, box.middle), reduced.slack + np.abs(T[:, 1:]) @ box.radii)
                for box in boxes
            ],
            T[:, 0] + others @ T[:, 1:].T,
        )

    def _solve_reduced(self, step: SolvingStep) -> tuple[list[SolutionBox], Array]:
        """Return boxes of the unknowns that remain (m,), and other solutions (k, m)."""
        reduced = step.reduced
        m, is_complex = len(reduced.farthest), np.iscomplexobj(reduced.table)
        if m == 0:
            return ([], np.zeros((1, 0))) if is_complex else ([SolutionBox(np.zeros(0), np.zeros(0))], np.zeros((0, 0)))
        if not len(reduced.table):
            raise ExternalSolverFailure("natural coordinates", f"nothing holds {m} unknowns")
        matrices, errors, boxes = expand(reduced.table, m), reduced.errors, list[SolutionBox]()
        single = _find_single_unknown(reduced)
        if single is not None:
            k, step.weights, cases = single
            step.unknown, others = k, np.zeros((0, m))
            for value, off in cases:
                fixed = np.zeros((1, m + 1, m + 1), dtype=type(value))
                fixed[0, 0, 0], fixed[0, 0, k], fixed[0, k, 0] = -value, 0.5, 0.5
                more, besides = self.solve(np.vstack([matrices, fixed]), np.append(errors, off), reduced.farthest)
                if not isinstance(value, complex) and self.last is not None:
                    step.cases.append((value, off, self.last))
                    if self.last.contradictory:  # nothing real within bounds, but there may be complex solutions
                        known = np.vstack([matrices, fixed]).astype(complex)
                        with suppress(ExternalSolverFailure):
                            besides = self.solve(known, np.append(errors, off), reduced.farthest)[1]
                boxes, others = boxes + more, np.vstack([others, besides])
            return boxes, others
        if is_complex:
            points = find_solutions(reduced.table, m)
            if points is None:
                raise ExternalSolverFailure("natural coordinates", f"{m} unknowns are not isolated")
            return [], points
        enclosed = enclose_all_solutions(reduced.table, errors, reduced.farthest)
        if enclosed is None:
            raise ExternalSolverFailure("natural coordinates", f"{m} unknowns are not confined")
        self.degree, step.algebra = max(self.degree, enclosed.degree), enclosed.evidence
        for k, middle, radii in zip(enclosed.evidence.real, enclosed.middles, enclosed.radii, strict=True):
            if is_excluded(matrices, errors, middle, radii):
                continue
            smaller = enclose_unique(matrices, errors, middle, radii)
            boxes.append(SolutionBox(*(smaller or (middle, radii))))
            if smaller is not None:
                step.points.append((k, smaller[0]))
        return boxes, enclosed.others


def expand(table: Array, m: int) -> Array:
    """Return the symmetric matrices (N, m + 1, m + 1) of coefficients (N, terms)."""
    upper = np.triu_indices(m + 1)
    matrices = np.zeros((len(table), m + 1, m + 1), dtype=table.dtype)
    matrices[:, upper[0], upper[1]] = table / 2
    return np.asarray(matrices + matrices.transpose(0, 2, 1))


def _is_contradictory(reduced: Reduction) -> bool:
    """Return True if an equation's value cannot be as small as its error; complex solutions have no bounds."""
    others = np.abs(reduced.table[:, 1:])
    if np.iscomplexobj(reduced.table):
        return bool(np.any(others.max(axis=1, initial=0.0) < OTHER_TERMS_MAX * np.abs(reduced.table[:, 0])))
    return bool(np.any(np.abs(reduced.table[:, 0]) > others @ reduced.sizes[1:] + reduced.errors))


def _find_single_unknown(reduced: Reduction) -> tuple[int, Array, list[tuple[float | complex, float]]] | None:
    """Return an unknown, by its number from 1, the weights of an equation without others, and the values that it gives
    with errors of real ones; None without one."""
    m = len(reduced.farthest)
    i, j = np.triu_indices(m + 1)
    for k in range(1, m + 1):
        alone = np.isin(i, (0, k)) & np.isin(j, (0, k))
        U, s, _ = np.linalg.svd(reduced.table[:, ~alone])
        weights = U[:, int(np.sum(s > OTHER_TERMS_MAX)) :].conj().T
        rows = weights @ reduced.table
        if not len(rows):
            continue
        best = int(np.argmax(np.abs(rows[:, alone][:, 2])))
        c, b, a = rows[best, alone].tolist()
        if abs(a) < LEADING_MIN:
            continue
        off = np.abs(weights[best]) @ reduced.errors + np.abs(rows[best, ~alone]) @ reduced.sizes[~alone]
        return k, weights[best], enclose_square_roots(b / a, c / a, float(off / abs(a)))
    return None


def enclose_square_roots(b: float | complex, c: float | complex, off: float) -> list[tuple[float | complex, float]]:
    """Return middles and radii of intervals that hold all real y at which |y² + b y + c| is at most ``off``; where both
    roots are complex these, as complex numbers."""
    off = off + ROOT_ROUNDING * (1.0 + abs(b * b) + abs(c))
    square = b * b / 4 - c
    if isinstance(square, complex) or square < -off:
        half = cmath.sqrt(square)
        return [(-b / 2 + half, off), (-b / 2 - half, off)]
    if square <= 4 * off:
        return [(-b / 2, math.sqrt(max(square, 0.0) + off))]
    # the farther of the two factors y − r is at least half of their difference
    root = math.sqrt(square)
    return [(-b / 2 + root, off / root), (-b / 2 - root, off / root)]
