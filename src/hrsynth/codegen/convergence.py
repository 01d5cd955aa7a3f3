"""Proved bounds, cell by cell: Newton steps that a generated program needs, and the error of its results.

Let R be somewhat more than the radius of a cell's tube about x̃(q). With Y(q), of first order in the motors, about
(D_xG)⁻¹, let |1 − Y D_xG| ≤ M and |Y D²_xG(·, v)| ≤ Q(v) in |x − x̃| ≤ R (componentwise, affine forms), let the program
compute G to δ, and its steps as those of a matrix within ΔJ of D_xG (N. J. Higham, Accuracy and Stability of Numerical
Algorithms, 2002, theorem 9.5); F = |Y| ΔJ. Then

1. the closure x* has |x* − x̃| ≤ a, the smaller of the tube's radius and (1 − M)⁻¹ |Y G(x̃)|; where it is not known that
   the tube holds one, it does if the latter is at most R (Brouwer), and it is the only one there;
2. a step with the matrix at z from x, |x − x*| ≤ e, |z − x*| ≤ b, leads to within
   (1 − M − F)⁻¹ (Q(b + e / 2) e + F e + |Y| δ) of x*, with Q(e / 2) where z = x, as long as this and e are at most
   R − a;
3. from e = a the bounds of the steps follow one another, until those of the program's tests are met;
4. where the program's last step was at most s, the result is within (1 − M)⁻¹ (Q(r + s') s + F s + |Y| δ) of x*, s' its
   step before and r = (1 − M)⁻¹ ((1 + M + F) s + |Y| δ) its error before the last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.branch.carried_vectors import SweptChains, Total, add_bend, build_row_product
from ..analysis.branch.cells import (
    TubeTrial,
    bound_drift,
    evaluate_derivatives,
    evaluate_residual,
    invert_matrices,
    split_cells,
)
from ..analysis.branch.loop_parts import LoopBlock, LoopEquation, LoopPart
from ..analysis.branch.loops import JointLoop
from ..budgets import (
    BOUND_CELL_PARTS_MAX,
    BOUND_SIDE_HALVINGS_MAX,
    BOUNDED_CELLS_BATCH_COUNT,
    BOUNDED_PARTS_COUNT,
    BOUNDED_SLOPES_COUNT,
    GENERATED_NEWTON_STEPS_MAX,
)
from ..geometry.affine import AffineForms, combine, stack
from ..geometry.vectors import Array
from ..results import Value
from ..tolerances import (
    AFFINE_ROUNDING,
    BOUND_RADIUS_FRACTION,
    BOUND_ROUNDING,
    FREE_WIDER,
    FREEST_WIDER,
    GENERATED_LAST_STEP_MAX,
    GENERATED_NEWTON_STEP_TOL,
    GENERATED_RESULT_ERROR_MAX,
    PART_TUBE_RADIUS_FRACTION,
    UNIT_ROUNDOFF,
)
from .branch_cells import TubeCell, TubedBranch, TubePart
from .rounding import RoundedNumber, round_function
from .trace import TracedFunction


@dataclass(frozen=True, eq=False, repr=False)
class BoundedCell(Value):
    """A cell with the steps that are enough in it, 0 where that is not proved, and how far the unknowns of an answer
    are from the closure at most (p,), rounding included, infinite where no bound is proved; ``inner``: how far the
    closure is from the middle of the tube (p,); ``alone``: the equations that are solved have no other zero in it."""

    cell: TubeCell
    steps: int
    error: Array
    inner: Array
    alone: bool

    def is_convergence_proved(self, units: Array) -> bool:
        """Return True if everything required is proved."""
        return bool(self.steps and np.all(self.error <= GENERATED_RESULT_ERROR_MAX * units))

    def is_of(self, parent: BoundedCell) -> bool:
        """Return True if it is proved that there is a closure in its tube, that of the cell of which this is a part."""
        cell, whole = self.cell, parent.cell
        off = (
            np.abs(cell.middle - whole.middle - whole.slopes @ (cell.centre - whole.centre))
            + np.abs(cell.slopes - whole.slopes) @ (cell.upper - cell.centre)
            + self.inner
        )
        inside = np.all(off < whole.radius * (1 - AFFINE_ROUNDING))
        return bool(parent.alone and np.all(self.inner <= cell.radius) and inside)

    def trial_cell(self, units: Array) -> TubeCell:
        """The cell as a program has it: where its steps are bounded, an answer in its tube counts though it is off."""
        widened = np.maximum(self.cell.radius, self.inner) + GENERATED_NEWTON_STEP_TOL * units
        return replace(self.cell, radius=widened) if self.steps else self.cell

    @property
    def can_halve_all_sides(self) -> bool:
        """Return True if it has few enough sides to halve them all."""
        return bool(2 ** len(self.cell.lower) <= BOUND_CELL_PARTS_MAX)

    def split(self, loops: LoopPart, known: bool) -> _Parts:
        """Its parts when all its sides are halved: with its own tube, which is ``known`` to hold a closure, or with
        tubes about their own closures that are still to be proved."""
        cell = self.cell
        upper = np.array(list(product((False, True), repeat=len(cell.lower))))
        ends = np.stack([np.where(upper, cell.centre, cell.lower), np.where(upper, cell.upper, cell.centre)], axis=1)
        centres = ends.mean(axis=1)
        x = cell.middle + (centres - cell.centre) @ cell.slopes.T
        slopes = np.broadcast_to(cell.slopes, (len(centres), *cell.slopes.shape))
        if not known:
            x = loops.close(centres, x)[0]
            slopes = loops.slopes(centres, x)
        radius = (
            (cell.radius + AFFINE_ROUNDING * np.abs(x).max(axis=0))
            if known
            else PART_TUBE_RADIUS_FRACTION * cell.radius
        )
        return _Parts(
            self,
            [
                TubeCell(low, high, middle, rates, radius)
                for (low, high), middle, rates in zip(ends, x, slopes, strict=True)
            ],
            known,
        )


@dataclass(frozen=True, eq=False)
class _Parts:
    """The parts of a cell, or one that is whole; ``known``: there is a closure in each tube."""

    whole: BoundedCell
    cells: list[TubeCell]
    known: bool


def bound_cells(
    branch: TubedBranch,
    part: TubePart,
    solved: Sequence[int],
    rows: Sequence[int],
    equations: TracedFunction,
    closure: TracedFunction,
) -> list[BoundedCell]:
    """The cells of a program that solves equations with places ``solved`` among all, ``rows`` in its closure, by its
    own formulas. Where a cell is too large for a bound it is halved, with thinner tubes inside its own."""
    system = branch.system
    among: list[LoopEquation] = [LoopEquation(loop, row) for loop in system.loops for row in loop.rows]
    among += [LoopEquation(gear) for gear in system.gears]
    block = LoopBlock(part.unknowns, tuple(among[i] for i in solved))
    loops = LoopPart(system, part.driven, part.unknowns, (block,), system.loops, system.gears)
    code = _Code(branch, part, loops, equations, closure, list(rows), branch.closing_tolerance(solved))
    found: list[BoundedCell] = []
    most = min(BOUNDED_PARTS_COUNT, BOUNDED_SLOPES_COUNT // (len(part.driven) * len(part.unknowns)))
    nothing = np.full(len(rows), np.inf)
    left = [_Parts(BoundedCell(cell, 0, nothing, cell.radius, False), [cell], True) for cell in part.cells]
    for depth in range(BOUND_SIDE_HALVINGS_MAX + 1):
        again: list[_Parts] = []
        smaller: list[_Parts] = []
        for some in (left, again):
            for parts, made in zip(some, code.bound_parts(some), strict=True):
                if not parts.known and not all(each.is_of(parts.whole) for each in made):
                    again.append(parts.whole.split(loops, True))
                    continue
                for each in made:
                    if (
                        each.is_convergence_proved(code.units)
                        or depth == BOUND_SIDE_HALVINGS_MAX
                        or not each.can_halve_all_sides
                        or len(smaller) * 2 ** len(part.driven) >= most
                    ):
                        found.append(each)
                    else:
                        smaller.append(each.split(loops, False))
        left = smaller
    return found


@dataclass(frozen=True, eq=False)
class _Code:
    """Computation of a part by a program: the solved equations, ``rows`` of its closure, with their derivatives."""

    branch: TubedBranch
    part: TubePart
    loops: LoopPart
    equations: TracedFunction
    closure: TracedFunction
    rows: list[int]
    closed: Array
    """Residuals of the solved equations below which their loops count as closed."""

    @property
    def solved(self) -> Sequence[LoopEquation]:
        """The equations that it solves."""
        return self.loops.blocks[0].equations

    @cached_property
    def units(self) -> Array:
        """Units of the unknowns (p,)."""
        return np.array([self.branch.unit(i) for i in self.part.unknowns])

    def bound_parts(self, every: Sequence[_Parts]) -> Iterator[list[BoundedCell]]:
        """All parts with their bounds."""
        pairs = [(cell, each.known) for each in every for cell in each.cells]
        made = iter(
            [
                each
                for k in range(0, len(pairs), BOUNDED_CELLS_BATCH_COUNT)
                for each in self._together(*map(list, zip(*pairs[k : k + BOUNDED_CELLS_BATCH_COUNT], strict=True)))
            ]
        )
        return (list(islice(made, len(each.cells))) for each in every)

    def _together(self, cells: list[TubeCell], known: list[bool]) -> list[BoundedCell]:
        """Some cells with their bounds, by the first width of the tubes that gives one."""
        found: list[BoundedCell] = []
        for wider in (BOUND_RADIUS_FRACTION, *(() if self.part.is_square else (FREE_WIDER, FREEST_WIDER))):
            now = _bound_steps(self, cells, known, wider)
            found = [
                old
                if old.is_convergence_proved(self.units) or (old.alone and not new.is_convergence_proved(self.units))
                else new
                for old, new in zip(found or now, now, strict=True)
            ]
        return found

    @cached_property
    def growth(self) -> float:
        """Rounding error of LU factors, relative to the matrix's largest row sum (theorem 9.5): a row at most doubles
        whenever another is subtracted from it, which happens where it can have an entry in the column."""
        p = len(self.rows)
        pattern = [
            {place[1] for array, place, _ in self.equations.stores if array == "J" and place[0] == i} for i in range(p)
        ]
        times = [0] * p
        left = set(range(p))
        for column in range(p):
            candidates = sorted((i for i in left if column in pattern[i]), key=lambda i: times[i])
            if not candidates:
                return float("inf")
            together = set().union(*(pattern[i] for i in candidates))
            highest = max(times[i] for i in candidates)
            for i in candidates[1:]:  # whichever is the pivot
                pattern[i], times[i] = set(together), highest + 1
            left.discard(candidates[0])
        return 4 * p**3 * 2.0 ** max(times) * UNIT_ROUNDOFF

    def compute(self, trial: TubeTrial, radius: Array) -> tuple[Array, Array, Array]:
        """Errors of the solved equations (c, p), of each entry of a matrix (c,) with what its factors add, and the
        largest sizes of the unknowns (c, p): by running errors over tubes."""
        c, p = trial.x.shape
        q = [RoundedNumber.of(0.0)] * len(self.branch.motors)
        x = [RoundedNumber.of(0.0)] * len(self.branch.passive)
        for k, i in enumerate(self.part.driven):
            q[self.branch.motors.index(i)] = RoundedNumber.between(
                trial.centre[:, k] - trial.half[:, k], trial.centre[:, k] + trial.half[:, k]
            )
        reach = (np.abs(trial.slopes) @ trial.half[..., None])[..., 0] + radius
        for k, i in enumerate(self.part.unknowns):
            x[self.branch.passive.index(i)] = RoundedNumber.between(
                trial.x[:, k] - reach[:, k], trial.x[:, k] + reach[:, k]
            )
        once, again = round_function(self.equations, q, x), round_function(self.closure, q, x)
        solved, sums, doubt = np.zeros((c, p)), np.zeros((c, p)), np.zeros(c)
        for k, row in enumerate(self.rows):
            for each in (once.get(("G", (k,))), again.get(("E", (row,)))):
                if each is not None:
                    solved[:, k] = np.maximum(solved[:, k], each.error)
        for (array, place), each in once.items():
            if array == "J":
                sums[:, place[0]] += each.size
                doubt = np.maximum(doubt, each.error)
        return solved, self.growth * sums.max(axis=1) + doubt, np.abs(trial.x) + reach


def _stack_cells(loops: LoopPart, cells: Sequence[TubeCell]) -> TubeTrial:
    """Cells as the enclosures take them."""
    lower, upper, x, slopes, radius = (
        np.array([getattr(cell, name) for cell in cells]) for name in ("lower", "upper", "middle", "slopes", "radius")
    )
    return TubeTrial(
        loops, *split_cells(lower, upper), x, slopes, radius, np.zeros(len(x)), np.ones(len(x), dtype=bool)
    )


def _bound_steps(code: _Code, cells: Sequence[TubeCell], known: Sequence[bool], wider: float) -> list[BoundedCell]:
    """Steps 1 to 4 of the head of this file; ``known``: which tubes hold a closure,
    ``wider`` the radius R, as part of the tube's."""
    trial, solved = _stack_cells(code.loops, cells), code.solved
    (c, p), units = trial.x.shape, code.units
    own, one, near, last = list(range(p)), np.eye(p), GENERATED_NEWTON_STEP_TOL * units, GENERATED_LAST_STEP_MAX * units
    with np.errstate(all="ignore"):
        # 1. where the closure is
        largest = (trial.radius / units).max(axis=-1)[:, None] * units
        wide = wider * (largest if wider == FREEST_WIDER else trial.radius) + 4 * near
        J = evaluate_derivatives(trial, solved, own, wide).by_own
        Y = invert_matrices(J.v[0])
        P, M = _bound_matrices(combine(Y, J), trial.symbols[0])
        size, Q = P @ np.abs(Y), _bound_curvature(solved, trial, wide, Y, P)
        inside = evaluate_derivatives(trial, solved, own, 0.0 * trial.radius)
        g = combine(Y, evaluate_residual(trial, solved)).size + bound_drift(combine(Y, inside.along))
        back = _bound_inverse(M)
        a = _bound_product(back @ P, np.fmin(g, combine(Y, inside.values).size))
        if code.part.is_square:
            a = np.where(np.array(known)[:, None], np.fmin(trial.radius, a), a)
        errors, matrix, sizes = code.compute(trial, wide)
        F = size.sum(axis=-1, keepdims=True) * matrix[:, None, None] * np.ones(p)
        noise, rates = _bound_product(size, errors), J.size
        rounding = (4 + len(trial.part.driven)) * UNIT_ROUNDOFF * sizes
        outer = _bound_inverse(M + F)

        def step(e: Array, off: Array) -> Array:
            """Return the error e after a step; ``off``: the distance of the matrix's place from those between."""
            return _bound_product(outer, _bound_product(_weigh(Q, off) + F, e) + noise) + rounding

        # 2, 3. one step after another, each with a second one by the same matrix; whether equations that are not solved
        # hold is left to the program
        steps, alive = np.zeros(c, dtype=int), np.all(a <= wide, axis=-1)
        e = a + rounding
        for count in range(1, GENERATED_NEWTON_STEPS_MAX + 1):
            first = step(e, e / 2)
            second = step(first, e + first / 2)
            alive &= _check_within(first, wide - a) & _check_within(second, wide - a)
            ends = (
                _check_within(e + first, near)
                & _check_within(first + second, last)
                & np.all(_bound_product(rates, first) + errors <= code.closed, axis=-1)
            )
            steps[alive & ends & (steps == 0)] = count
            e = np.maximum(first, second)
        # 4. what an answer is worth: the program's tube is wider by a step that is near
        s = np.broadcast_to(last, e.shape)
        off = _bound_product(back, _bound_product(one + M + F, s) + noise) + near
        error = _bound_product(back, _bound_product(_weigh(Q, off) + F, s) + noise) + rounding
        tube = np.maximum(trial.radius, a) + near
        error[~(np.all(a <= wide, axis=-1) & _check_within(tube + off, wide - last))] = np.inf
        error[~np.isfinite(error)] = np.inf
        alone = np.all(np.isfinite(back), axis=(-1, -2))
    inner = np.where(a <= wide, a, np.inf)
    return [BoundedCell(*each) for each in zip(cells, steps.tolist(), error, inner, alone.tolist(), strict=True)]


def _bound_matrices(B: AffineForms, motors: int) -> tuple[Array, Array]:
    """Return for matrices B = 1 + Σ N_k ε_k + … (c, p, p), the first symbols those of the motors: P B with P = 1 − Σ
    N_k ε_k, a bound of |P|, and one of |1 − P B|."""
    p = B.r.shape[-1]
    v = np.zeros_like(B.v)
    v[0] = np.eye(p)
    v[1 : 1 + motors] = -B.v[1 : 1 + motors]
    P = AffineForms(v, np.zeros_like(B.r))
    made = stack([(P[..., i, :, None] * B).sum(-2) for i in range(p)], axis=-2)
    return P.size, (np.eye(p) - made).size


def _bound_curvature(solved: Sequence[LoopEquation], trial: TubeTrial, radius: Array, Y: Array, P: Array) -> Array:
    """Bounds (c, p, p, p) of |Y D²_xG|, the last two dimensions the unknowns."""
    forms, unknowns = trial.forms(radius), np.array(trial.part.unknowns, dtype=np.intp)
    carrier, like, p = SweptChains(trial.part.system, forms), forms[unknowns[0]] * 0.0, len(unknowns)
    (i, j), rows = np.triu_indices(p), list[Any]()
    for each in solved:
        bend = Total(like, (len(forms), len(forms)))
        if each.row is not None and isinstance(each.of, JointLoop):  # gears are linear
            add_bend(bend, build_row_product(carrier, each.of, each.row))
        rows.append(bend.sum[..., unknowns[i], unknowns[j]])
    found = np.empty((len(trial.x), p, p, p))
    found[..., i, j] = found[..., j, i] = P @ combine(Y, stack(rows, axis=-2)).size
    return found


def bound_platform_error(
    branch: TubedBranch, ranges: Array, errors: Array, function: TracedFunction
) -> tuple[float, float]:
    """Return the largest difference of the platform's rotation (entries) and position (m) from those at the closure:
    ``ranges`` (2, p) of the unknowns, ``errors`` (p,) of them."""
    q = [RoundedNumber.between(low, high) for low, high in zip(branch.lower, branch.upper, strict=True)]
    x = [RoundedNumber.between(low, high, off) for low, high, off in zip(*ranges, errors, strict=True)]
    made = round_function(function, q, x)
    rotation, position = (
        max(float(each.error) for (array, _), each in made.items() if array == name) for name in ("R", "p")
    )
    return rotation, position


def _bound_product(M: Array, v: Array) -> Array:
    """M v for matrices (c, k, p) and vectors (c, p) of bounds, rounded up."""
    return np.asarray((M @ v[..., None])[..., 0] * BOUND_ROUNDING)


def _weigh(Q: Array, v: Array) -> Array:
    """Q(v), (c, p, p)."""
    return np.asarray((Q @ v[:, None, :, None])[..., 0])


def _check_within(e: Array, limit: Array) -> NDArray[np.bool_]:
    """Return True for rows (c,) of a bound (c, p) that are at most a limit."""
    return np.asarray(np.all(e * BOUND_ROUNDING <= limit, axis=-1))


def _bound_inverse(M: Array) -> Array:
    """A bound (c, p, p) of |(1 − E)⁻¹| for all |E| ≤ M, nan where there is none: with v > 0 and M v < v it is at most
    N = (1 − M)⁻¹ ≥ 0, and with S ≥ 0 in floats and |1 − (1 − M) S| ≤ D, ‖D‖ = d < 1, N ≤ S (1 − D)⁻¹."""
    p = M.shape[-1]
    one = np.eye(p)
    good = np.all(np.isfinite(M), axis=(-1, -2))
    safe = np.where(good[:, None, None], M, 0.0)
    S = np.abs(invert_matrices(one - safe))
    v = S.sum(axis=-1)
    good &= np.all(_bound_product(safe, v) * (1 + AFFINE_ROUNDING) < v, axis=-1)
    D = np.abs(one - (one - safe) @ S) + AFFINE_ROUNDING * p * (one + safe) @ S
    d = D.sum(axis=-1).max(axis=-1)
    good &= d < 0.5
    found = S + v[..., None] * (d / (1 - d))[:, None, None] * (1 + AFFINE_ROUNDING)
    return np.where(good[:, None, None], found, np.nan)
