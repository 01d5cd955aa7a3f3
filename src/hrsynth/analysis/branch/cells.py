"""Cells of motor coordinates, with affine tubes in which the loops are proved to have exactly one closure each.

For q in a cell, |q − q_c| ≤ h, let x̃(q) = x_c + S (q − q_c). The derivatives of the equations G, by a block's own
unknowns (A), by those of the blocks before it, |δ| ≤ r' (D), and along x̃ (B), are enclosed over the tube |x − x̃(q)| ≤ r
by affine forms in the noise symbols ε = (q − q_c) / h. With Y about A⁻¹ Krawczyk's operator is, in mean value form,

    K = −Y (G(q_c, x_c) + ∫₀¹ B(tε) ε dt + D [−r', r']) + (1 − Y A) [−r, r]:

if it lies inside [−r, r] for all ε, there is for each q exactly one zero in the tube, analytic in q, and every matrix
in A is regular. Source: A. Neumaier, Interval Methods for Systems of Equations, 1990, section 5.2;
docs/pages/prove_a_branch.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...budgets import TUBE_RADII_COUNT, TUBE_WIDENING_FRACTION
from ...geometry.affine import AffineForms, combine, compute_dot_forms, make_affine, stack
from ...geometry.vectors import Array, times
from ...tolerances import AFFINE_ROUNDING, CELL_TUBE_RADIUS_MIN, TUBE_RADIUS_MIN
from .loop_parts import LoopBlock, LoopEquation, LoopPart
from .loops import CouplingEquation, JointLoop, LoopRow, evaluate_residuals, locate_rod_ends


@dataclass(frozen=True, eq=False)
class BranchTube:
    """A proved tube: q_c, h (n,), x_c (p,), S (p, n), r (p,), and a lower bound of the smallest singular value of each
    block of D_xG (characteristic lengths, radians), of the blocks that turn rods apart."""

    centre: Array
    half: Array
    x: Array
    slopes: Array
    radius: Array
    weakest: float

    def at(self, q: Array) -> Array:
        """The middle of the tube (p,) at q (n,)."""
        return np.asarray(self.x + self.slopes @ (q - self.centre))

    def is_inside(self, other: BranchTube) -> bool:
        """Return True if the tube lies inside another tube, whose cell contains its own."""
        off = np.abs(self.x - other.at(self.centre)) + np.abs(self.slopes - other.slopes) @ self.half + self.radius
        return bool(np.all(off < other.radius * (1 - AFFINE_ROUNDING)))


@dataclass(eq=False)
class TubeTrial:
    """Tubes over c cells while they are proved: ``alive`` (c,), radii (c, p) of the unknowns so far."""

    part: LoopPart
    centre: Array
    half: Array
    x: Array
    slopes: Array
    radius: Array
    weakest: Array
    alive: NDArray[np.bool_]

    def kept(self, which: Any) -> TubeTrial:
        """Return some of the cells."""
        return TubeTrial(
            self.part,
            *(
                each[which]
                for each in (self.centre, self.half, self.x, self.slopes, self.radius, self.weakest, self.alive)
            ),
        )

    @property
    def symbols(self) -> tuple[int, int]:
        """The number of motors, and of all noise symbols: one more for each angle of them and of the first blocks."""
        return len(self.part.driven), len(self.part.driven) + len(self.part.bent)

    def forms(self, radius: Array) -> list[AffineForms | None]:
        """Coordinates over the tubes; None for those that are constant."""
        n, count = self.symbols
        found: list[AffineForms | None] = [None] * len(self.part.system.coordinates)
        spread = np.zeros((*self.x.shape, count))
        spread[..., :n] = self.slopes * self.half[:, None, :]
        rounding = AFFINE_ROUNDING * np.abs(spread).sum(axis=-1)
        bend = {i: n + k + 1 for k, i in enumerate(self.part.bent)}
        for k, i in enumerate(self.part.driven):
            own = np.zeros((len(self.x), count))
            own[:, k] = self.half[:, k]
            found[i] = make_affine(self.centre[:, k], own, np.zeros(len(own)), bend.get(i))
        for k, i in enumerate(self.part.unknowns):
            found[i] = make_affine(self.x[:, k], spread[:, k], radius[:, k] + rounding[:, k], bend.get(i))
        return found


def prove_all(part: LoopPart, centres: Array, halves: Array, xs: Array) -> list[BranchTube | None]:
    """Tubes over cells (c, n) about closed configurations (c, p); None where the proof fails."""
    count, p = xs.shape
    trial = TubeTrial(
        part,
        centres,
        halves,
        xs,
        part.slopes(centres, xs),
        np.zeros((count, p)),
        np.full(count, np.inf),
        np.ones(count, dtype=bool),
    )
    for layer in group_blocks_by_depth(part.blocks):
        _prove_layer(trial, layer)
        if not trial.alive.any():
            break
    return [
        BranchTube(centres[k], halves[k], xs[k], trial.slopes[k], trial.radius[k], float(trial.weakest[k]))
        if trial.alive[k]
        else None
        for k in range(count)
    ]


def stack_tubes(part: LoopPart, tubes: Sequence[BranchTube]) -> TubeTrial:
    """Proved tubes together."""
    centre, half, x, slopes, radius = (
        np.array([getattr(tube, name) for tube in tubes]) for name in ("centre", "half", "x", "slopes", "radius")
    )
    weakest = np.array([tube.weakest for tube in tubes])
    return TubeTrial(part, centre, half, x, slopes, radius, weakest, np.ones(len(tubes), dtype=bool))


def group_blocks_by_depth(blocks: Sequence[LoopBlock]) -> list[list[LoopBlock]]:
    """Blocks in order; those that turn rods, which need not know of each other, together."""
    return [*([block] for block in blocks if block.loop is None), *([block] for block in blocks if block.loop)]


def _prove_layer(trial: TubeTrial, layer: Sequence[LoopBlock]) -> None:
    """Widen the tubes in the unknowns of blocks until Krawczyk's condition holds, or give the cells up."""
    for block in layer:
        which = np.flatnonzero(trial.alive)
        if not len(which):
            return
        part = trial.kept(which)
        with np.errstate(all="ignore"):
            _prove_block(part, block)
        trial.radius[which], trial.weakest[which], trial.alive[which] = part.radius, part.weakest, part.alive


def _prove_block(trial: TubeTrial, block: LoopBlock) -> None:
    """As above for one block."""
    own = [trial.part.place[i] for i in block.unknowns]
    equations = block.equations if block.loop is None else list_rotating_equations(trial, block)
    at = evaluate_derivatives(trial, equations, own, trial.radius)
    A = at.by_own
    Y = invert_matrices(A.v[0])
    # Y G along x̃, as a whole and in mean value form: both hold, the sharper one counts
    e = (
        combine(Y, evaluate_residual(trial, equations)).size
        + bound_drift(combine(Y, at.along))
        + times(combine(Y, at.by_others).size, trial.radius)
    )
    e = np.fmin(e, combine(Y, at.values).size)
    one = np.eye(len(own))
    done = np.zeros(len(e), dtype=bool)
    radius = trial.radius.copy()
    thinnest = np.where(trial.half.any(axis=-1), CELL_TUBE_RADIUS_MIN, TUBE_RADIUS_MIN)[:, None]
    for attempt in range(TUBE_RADII_COUNT):
        if attempt:
            at = evaluate_derivatives(trial, equations, own, radius)
        M = (one - combine(Y, at.by_own)).size
        r = radius[:, own]
        Mr = times(M, r)
        fits = np.all((e + Mr) * (1 + AFFINE_ROUNDING) < r, axis=-1) & ~done
        if fits.any():
            trial.radius[np.ix_(fits, own)] = r[fits]
            if block.loop is None:
                trial.weakest[fits] = np.minimum(
                    trial.weakest[fits], _bound_smallest_value(Y[fits], M[fits], r[fits], Mr[fits])
                )
            done |= fits
        good = np.all(np.isfinite(M), axis=(-1, -2)) & np.all(np.isfinite(e), axis=-1) & ~done
        possible = good & (np.abs(np.linalg.eigvals(np.where(good[:, None, None], M, one))).max(axis=-1) < 1)
        if not possible.any():
            break
        wanted = np.linalg.solve(one - M[possible], e[possible][..., None])[..., 0]
        radius[np.ix_(possible, own)] = np.maximum(TUBE_WIDENING_FRACTION * wanted, thinnest[possible])
    trial.alive &= done
    if block.loop is not None:
        trial.alive &= _check_same_side(trial, block)


def _bound_smallest_value(Y: Array, M: Array, r: Array, Mr: Array) -> Array:
    """A lower bound (c,) of the smallest singular value of all A (c, k, k) with |1 − Y A| ≤ M, where M r < r.

    |A⁻¹| ≤ (1 − M)⁻¹ |Y| = Z + (1 − M)⁻¹ R, entry by entry, for any Z and R = |Y| − (1 − M) Z. Columns of |R| are at
    most ρ r, and (1 − M)⁻¹ r ≤ r / (1 − max M r / r).
    """
    size, r = np.abs(Y), r[..., None]
    Z = np.abs(np.linalg.solve(np.eye(Y.shape[-1]) - M, size))
    R = np.abs(size - Z + M @ Z) + AFFINE_ROUNDING * (size + Z + M @ Z)
    found = Z + r * (R / r).max(axis=-2, keepdims=True) / (1 - (Mr[..., None] / r).max(axis=-2, keepdims=True))
    norm = np.sqrt(found.sum(axis=-1).max(axis=-1) * found.sum(axis=-2).max(axis=-1))
    return np.asarray((1 - AFFINE_ROUNDING) / norm)


def invert_matrices(A: Array) -> Array:
    """Approximate inverses (c, p, p), pseudo-inverses where one has none."""
    try:
        return np.asarray(np.linalg.inv(A))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(np.nan_to_num(A)))


def split_cells(low: Array, high: Array) -> tuple[Array, Array]:
    """The middles of cells and, rounded up, how far their sides are from these."""
    centre = (low + high) / 2
    half = np.maximum(high - centre, centre - low)
    return centre, half + 2 * np.spacing(np.abs(centre) + half)


def bound_drift(B: AffineForms) -> Array:
    """A bound (c, k) of ∫₀¹ B(tε) ε dt for forms B (c, k, n): of Σ (b_i + ½ Σ s_ij ε_j) ε_i ± r_i, j ≤ n; r_i holds
    the other symbols."""
    s = np.moveaxis(B.v[1 : 1 + B.r.shape[-1]], 0, -1)
    curved = np.abs(s + np.swapaxes(s, -1, -2)).sum(axis=(-1, -2)) / 4
    rest = np.abs(B.v[1 + B.r.shape[-1] :]).sum(axis=(0, -1)) + B.r.sum(axis=-1)
    return np.asarray((np.abs(B.v[0]).sum(axis=-1) + curved + rest) * (1 + AFFINE_ROUNDING))


@dataclass(frozen=True, eq=False)
class TubeDerivatives:
    """For k equations over tubes: values (c, k), derivatives by the block's unknowns (c, k, k), by the others of the
    part (c, k, p), and along the tube by the noise symbols (c, k, n)."""

    values: AffineForms
    by_own: AffineForms
    by_others: AffineForms
    along: AffineForms


def evaluate_equations(
    part: LoopPart, equations: Sequence[LoopEquation], forms: Sequence[AffineForms | None]
) -> tuple[list[Any], list[dict[int, Any]]]:
    """Values of equations, and their derivatives by the coordinates that are not constant."""
    values: list[Any] = [0.0] * len(equations)
    slopes: list[dict[int, Any]] = [{} for _ in equations]
    groups: dict[int, list[int]] = {}
    for k, each in enumerate(equations):
        if isinstance(each.of, CouplingEquation):
            for i, rate in ((each.of.second, 1.0), (each.of.first, -each.of.ratio)):
                form = forms[i]
                if form is not None:
                    values[k] = values[k] + part.system.coordinates[i].from_zero(form) * rate
                    slopes[k][i] = slopes[k].get(i, 0.0) + rate
        else:
            groups.setdefault(id(each.of), []).append(k)
    for members in groups.values():
        loop = equations[members[0]].of
        rows = [row for row in (equations[k].row for k in members) if row is not None]
        assert isinstance(loop, JointLoop)
        found = evaluate_residuals(part.system, loop, forms, rows)
        for k, value, slope in zip(members, *found, strict=True):
            values[k], slopes[k] = value, slope
    return values, slopes


def evaluate_residual(trial: TubeTrial, equations: Sequence[LoopEquation]) -> AffineForms:
    """G(q_c, x_c), (c, k)."""
    still = trial.kept(slice(None))
    still.half = 0.0 * still.half
    return stack(
        [
            _make_zero_form(trial) + each
            for each in evaluate_equations(trial.part, equations, still.forms(0.0 * trial.radius))[0]
        ]
    )


def evaluate_derivatives(
    trial: TubeTrial, equations: Sequence[LoopEquation], own: Sequence[int], radius: Array
) -> TubeDerivatives:
    """The derivatives of equations over tubes with radii (c, p)."""
    part = trial.part
    zero = _make_zero_form(trial)
    values, slopes = evaluate_equations(part, equations, trial.forms(radius))
    by_own = [stack([zero + slope.get(part.unknowns[k], 0.0) for k in own]) for slope in slopes]
    others = [i for k, i in enumerate(part.unknowns) if k not in own]
    by_others, along = [], []
    spread = trial.slopes * trial.half[:, None, :]
    for slope in slopes:
        row = [zero] * len(part.unknowns)
        drift = stack([zero] * trial.half.shape[1])
        for i, rate in slope.items():
            if i in part.place:
                # along the tube x_i moves by S_i h ε
                drift = drift + (zero + rate)[..., None] * spread[:, part.place[i]]
                if i in others:
                    row[part.place[i]] = zero + rate
            elif i in part.driven:
                k = part.driven.index(i)
                drift = drift + (zero + rate)[..., None] * (np.eye(trial.half.shape[1])[k] * trial.half[:, k : k + 1])
        by_others.append(stack(row))
        along.append(drift)
    made = stack([zero + each for each in values])
    return TubeDerivatives(made, stack(by_own, axis=-2), stack(by_others, axis=-2), stack(along, axis=-2))


def _make_zero_form(trial: TubeTrial) -> AffineForms:
    """Zero for all cells."""
    return make_affine(np.zeros(len(trial.x)), np.zeros((len(trial.x), trial.symbols[1])), np.zeros(len(trial.x)))


def list_rotating_equations(trial: TubeTrial, block: LoopBlock) -> tuple[LoopEquation, ...]:
    """The equations that turn a rod to where its loop closes: none across its direction at the cell's middle."""
    loop = block.loop
    assert loop is not None
    a, _, A = locate_rod_ends(trial.part.system, loop, trial.part.values(trial.centre, trial.x))
    direction = np.broadcast_to(a - A, (len(trial.x), 3))
    if len(block.unknowns) == 1:
        axis = trial.part.system.coordinates[block.unknowns[0]].axis
        return (LoopEquation(loop, LoopRow("point", np.cross(axis, direction)), swings=True),)
    across = np.linalg.svd(direction[:, None, :])[2]
    return tuple(LoopEquation(loop, LoopRow("point", across[:, k]), swings=True) for k in (1, 2))


def _check_same_side(trial: TubeTrial, block: LoopBlock) -> NDArray[np.bool_]:
    """Mask (c,) of tubes over which both ends of a rod's loop lie on one side of its centre: two points equally far
    from it and equal across one direction then coincide."""
    assert block.loop is not None
    system = trial.part.system
    a, _, A = locate_rod_ends(system, block.loop, trial.part.values(trial.centre, trial.x))
    direction = a - A
    ends = locate_rod_ends(system, block.loop, trial.forms(trial.radius))
    found = np.ones(len(trial.x), dtype=bool)
    for end in ends[:2]:
        along = compute_dot_forms(end - ends[2], direction)
        found &= along.v[0] - along.spread > 0
    return found
