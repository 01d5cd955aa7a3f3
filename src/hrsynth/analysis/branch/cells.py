"""Cells of motor coordinates, with affine tubes in which the loops are proved to have exactly one closure each.

For q in a cell, |q − q_c| ≤ h, let x̃(q) = x_c + S (q − q_c): with the noise symbols ε = (q − q_c) / h the coordinates
move by Z ε. Let A and D be the derivatives of the equations G by a block's own unknowns and by those of the blocks
before it, |δ| ≤ r', over the tube |x − x̃(q)| ≤ r. With Y about A⁻¹ Krawczyk's operator is

    K = −Y (G(q_c, x_c) + G' Z ε + ½ (Z ε)ᵀ H (Z ε) + D [−r', r']) + (1 − Y A) [−r, r]:

if it lies inside [−r, r] for all ε, there is for each q exactly one zero in the tube, analytic in q, and every matrix
in A is regular. The second derivatives H are enclosed over the tube by affine forms, and the equations are combined,
Y H, before anything of them is bounded: what two rods of a parallelogram have in common is gone then. A and D follow,
Y A = Y A_c + Y H (Z ε ± r). Source: A. Neumaier, Interval Methods for Systems of Equations, 1990, section 5.2;
docs/pages/prove_a_branch.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...equations.carried_vectors import SweptChains, Total, add_row_bend
from ...equations.joint_equations import JointLoop, LoopRow, locate_rod_ends
from ...equations.loop_parts import LoopBlock, LoopEquation, LoopPart, evaluate_by_vectors
from ...geometry.affine import AffineForms, combine, compute_dot_forms, compute_right_product, make_affine, stack
from ...geometry.vectors import Array, times
from ...solving.krawczyk import bound_contraction, bound_image
from ...tolerances import AFFINE_ROUNDING, TUBE_RADII_COUNT, TUBE_RADIUS_MIN, TUBE_WIDENING_FRACTION

CELL_TUBE_RADIUS_MIN = 1e-11
"""Smallest radius of a tube over a cell (characteristic lengths, radians)."""


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

    def is_within(self, other: BranchTube, which: Any = slice(None)) -> bool:
        """Return True if a tube over a point lies in another one over a cell that has this point, in some unknowns."""
        off = np.abs(self.x - other.at(self.centre)) + self.radius
        return bool(np.all((off < other.radius * (1 - AFFINE_ROUNDING))[which]))

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

    def tube(self, k: int) -> BranchTube:
        """Return one of them, proved."""
        return BranchTube(
            self.centre[k], self.half[k], self.x[k], self.slopes[k], self.radius[k], float(self.weakest[k])
        )

    @property
    def symbols(self) -> tuple[int, int]:
        """The number of motors, and of all noise symbols: one more for each angle of them and of the first blocks; none
        where all cells are points."""
        n = len(self.part.driven)
        return (n, n + len(self.part.bent)) if self.half.any() else (0, 0)

    def forms(self, radius: Array) -> list[AffineForms | None]:
        """Coordinates over the tubes; None for those that are constant."""
        n, count = self.symbols
        found: list[AffineForms | None] = [None] * len(self.part.system.coordinates)
        spread = np.zeros((*self.x.shape, count))
        spread[..., :n] = (self.slopes * self.half[:, None, :])[..., :n]
        rounding = AFFINE_ROUNDING * np.abs(spread).sum(axis=-1)
        bend = {i: n + k + 1 for k, i in enumerate(self.part.bent)} if n else {}
        for k, i in enumerate(self.part.driven):
            own = np.zeros((len(self.x), count))
            own[:, k : k + 1] = self.half[:, k : k + 1][:, :n]
            found[i] = make_affine(self.centre[:, k], own, np.zeros(len(own)), bend.get(i))
        for k, i in enumerate(self.part.unknowns):
            found[i] = make_affine(self.x[:, k], spread[:, k], radius[:, k] + rounding[:, k], bend.get(i))
        return found


def prove_all(part: LoopPart, centres: Array, halves: Array, xs: Array) -> list[BranchTube | None]:
    """Tubes over cells (c, n) about closed configurations (c, p); None where the proof fails."""
    count, p = xs.shape
    slopes, radius, weakest = part.slopes(centres, xs), np.zeros((count, p)), np.full(count, np.inf)
    trial = TubeTrial(part, centres, halves, xs, slopes, radius, weakest, np.ones(count, dtype=bool))
    for block in part.blocks:
        trial.alive &= _find_proved(trial, block, trial.alive)
    return [trial.tube(k) if alive else None for k, alive in enumerate(trial.alive)]


def prove_turned(part: LoopPart, tubes: Sequence[BranchTube], xs: Array) -> list[BranchTube]:
    """Tubes of a part about closed configurations (c, p) from those of its core: joints that turn rods follow. Where
    these are not proved to have one value each, their radius is infinite."""
    if not tubes:
        return []
    core, known = part.core, stack_tubes(part, tubes)
    places, blocks = core.places_in(part), part.blocks[len(core.blocks) :]
    x, slopes, radius = xs.copy(), part.slopes(known.centre, xs), np.zeros(xs.shape)
    x[:, places], slopes[:, places], radius[:, places] = known.x, known.slopes, known.radius
    known.x, known.slopes, known.radius = x, slopes, radius
    unsure = np.zeros(xs.shape, dtype=bool)
    for block in blocks:
        needed = [part.place[i] for i in block.needed if i in part.place]
        proved = _find_proved(known, block, np.logical_not(unsure[:, needed].any(axis=-1)))
        unsure[:, part.list_places(block)] |= ~proved[:, None]
    known.radius[unsure] = np.inf
    return [known.tube(k) for k in range(len(xs))]


def _find_proved(trial: TubeTrial, block: LoopBlock, which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask (c,) of those of some cells over which a block is proved; its radii are kept."""
    places = np.flatnonzero(which)
    proved = np.zeros(len(trial.x), dtype=bool)
    if len(places):
        some = trial.kept(places)
        with np.errstate(all="ignore"):
            _prove_block(some, block)
        trial.radius[places], trial.weakest[places], proved[places] = some.radius, some.weakest, some.alive
    return proved


def stack_tubes(part: LoopPart, tubes: Sequence[BranchTube]) -> TubeTrial:
    """Proved tubes together."""
    centre, half, x, slopes, radius = (
        np.array([getattr(tube, name) for tube in tubes]) for name in ("centre", "half", "x", "slopes", "radius")
    )
    weakest = np.array([tube.weakest for tube in tubes])
    return TubeTrial(part, centre, half, x, slopes, radius, weakest, np.ones(len(tubes), dtype=bool))


def _prove_block(trial: TubeTrial, block: LoopBlock) -> None:
    """Widen the tubes in the unknowns of a block until Krawczyk's condition holds, or give the cells up."""
    part = trial.part
    own = part.list_places(block)
    equations = block.equations or list_rotating_equations(trial, block)
    places = [i for i in (*block.unknowns, *part.driven, *part.unknowns) if i in block.needed]
    places = list(dict.fromkeys(places))
    size = len(own)
    before = [k for k, i in enumerate(places) if i in part.place and k >= size]
    indices = [part.place[places[k]] for k in before]
    Z = np.zeros((len(trial.x), len(places), trial.half.shape[1]))
    for k, i in enumerate(places):
        if i in part.place:
            Z[:, k] = trial.slopes[:, part.place[i]] * trial.half
        else:
            Z[:, k, part.driven.index(i)] = trial.half[:, part.driven.index(i)]
    still = trial.kept(slice(None))
    still.half = 0.0 * still.half
    G, slopes = evaluate_slopes(still, equations, places, 0.0 * trial.radius)
    Y = invert_matrices(slopes.v[0, ..., :size])
    slopes = combine(Y, slopes)
    spread = np.zeros((len(trial.x), len(places)))  # radii of the blocks before this one, then its own
    spread[:, before] = trial.radius[:, indices]
    bends = _combine_bends(trial, equations, places, trial.radius, Y)
    along, off = _bound_variation(bends, Z, spread)
    # the mean of tε along the way to ε is ½ ε, weighted by 1 − t it is a third of it
    along.v[1 : 1 + Z.shape[-1]] *= 2 / 3
    second = compute_right_product(along.transposed(), np.broadcast_to(Z[:, None], (*along.r.shape[:2], *Z.shape[1:])))
    e = combine(Y, G).size + compute_right_product(slopes, Z).size.sum(axis=-1) + second.size.sum(axis=(-1, -2)) / 2
    e += times((slopes.size + off)[..., before], spread[:, before]) + AFFINE_ROUNDING * np.abs(Z[:, :size]).sum(axis=-1)
    e *= 1 + AFFINE_ROUNDING
    start = bound_contraction(np.broadcast_to(np.eye(size), Y.shape), slopes[..., :size])
    done = np.zeros(len(e), dtype=bool)
    thinnest = np.where(trial.half.any(axis=-1), CELL_TUBE_RADIUS_MIN, TUBE_RADIUS_MIN)[:, None]
    live, r = np.arange(len(e)), np.zeros((len(e), size))
    for attempt in range(TUBE_RADII_COUNT):
        if attempt:
            some = trial.kept(live)
            some.radius[:, own] = spread[live, :size] = r[live]
            which = block.equations or list_rotating_equations(some, block)
            bends = _combine_bends(some, which, places, some.radius, Y[live])
            off[live] = _bound_variation(bends, Z[live], spread[live])[1]
        M = (start[live] + off[live][..., :size]) * (1 + AFFINE_ROUNDING)
        fits = np.all(bound_image(e[live], M, r[live]) < r[live], axis=-1)
        fit = live[fits]
        trial.radius[fit[:, None], own] = r[fit]
        if block.loop is None and len(fit):
            trial.weakest[fit] = np.minimum(trial.weakest[fit], _bound_smallest_value(Y[fit], M[fits], r[fit]))
        done[fit] = True
        good = np.all(np.isfinite(M), axis=(-1, -2)) & np.all(np.isfinite(e[live]), axis=-1) & ~fits
        good &= np.abs(np.linalg.eigvals(np.where(good[:, None, None], M, 0.0))).max(axis=-1) < 1
        live = live[good]
        if not len(live):
            break
        wanted = np.linalg.solve(np.eye(size) - M[good], e[live][..., None])[..., 0]
        r[live] = np.maximum(TUBE_WIDENING_FRACTION * wanted, thinnest[live])
    trial.alive &= done
    if not block.equations:
        trial.alive &= _check_same_side(trial, block)


def _combine_bends(
    trial: TubeTrial, equations: Sequence[LoopEquation], places: Sequence[int], radius: Array, Y: Array
) -> AffineForms:
    """Y H, (c, k, m, m), over tubes with radii (c, p): second derivatives by coordinates ``places`` (m,)."""
    forms, zero = trial.forms(radius), _make_zero_form(trial)
    order = np.zeros(len(forms), dtype=np.intp)
    order[list(places)] = np.arange(len(places))
    moving = [form if i in places else None for i, form in enumerate(forms)]
    carrier, size = SweptChains(trial.part.system, moving, order), len(places)
    rows = []
    for each in equations:
        bend = Total(zero, (size, size))
        if each.row is not None and isinstance(each.of, JointLoop):  # gears are linear
            add_row_bend(bend, carrier, each.of, each.row)
        rows.append(bend.sum.reshaped(size * size))
    return combine(Y, stack(rows, axis=-2)).reshaped(size, size)


def _bound_variation(bends: AffineForms, Z: Array, spread: Array) -> tuple[AffineForms, Array]:
    """The mean of Y H Z (c, k, m, n) on the way from the middle, and how far Y G' (c, k, m) is from that at the middle
    over tubes with radii (c, m)."""
    bends.v[1 : 1 + Z.shape[-1]] /= 2
    along = compute_right_product(bends, np.broadcast_to(Z[:, None], (*bends.r.shape[:2], *Z.shape[1:])))
    return along, along.size.sum(axis=-1) + (bends.size @ spread[:, None, :, None])[..., 0]


def _bound_smallest_value(Y: Array, M: Array, r: Array) -> Array:
    """A lower bound (c,) of the smallest singular value of all A (c, k, k) with |1 − Y A| ≤ M, where M r < r.

    |A⁻¹| ≤ (1 − M)⁻¹ |Y| = Z + (1 − M)⁻¹ R, entry by entry, for any Z and R = |Y| − (1 − M) Z. Columns of |R| are at
    most ρ r, and (1 − M)⁻¹ r ≤ r / (1 − max M r / r).
    """
    size, r = np.abs(Y), r[..., None]
    Z = np.abs(np.linalg.solve(np.eye(Y.shape[-1]) - M, size))
    R = np.abs(size - Z + M @ Z) + AFFINE_ROUNDING * (size + Z + M @ Z)
    found = Z + r * (R / r).max(axis=-2, keepdims=True) / (1 - (M @ r / r).max(axis=-2, keepdims=True))
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


@dataclass(frozen=True, eq=False)
class TubeDerivatives:
    """For k equations over tubes: derivatives by the block's unknowns (c, k, k), and along the tube by the noise
    symbols (c, k, n)."""

    by_own: AffineForms
    along: AffineForms


def evaluate_slopes(
    trial: TubeTrial, equations: Sequence[LoopEquation], places: Sequence[int], radius: Array
) -> tuple[AffineForms, AffineForms]:
    """Equations (c, k) over tubes with radii (c, p), and their derivatives by coordinates ``places``, (c, k, m)."""
    forms, system = trial.forms(radius), trial.part.system
    values, slopes = evaluate_by_vectors(system, equations, forms, _make_zero_form(trial), places)
    return stack(values), stack(slopes, axis=-2)


def evaluate_derivatives(
    trial: TubeTrial, equations: Sequence[LoopEquation], own: Sequence[int], radius: Array
) -> TubeDerivatives:
    """The derivatives of equations over tubes with radii (c, p)."""
    part = trial.part
    slopes = evaluate_slopes(trial, equations, (*part.unknowns, *part.driven), radius)[1]
    motors = np.broadcast_to(np.eye(trial.half.shape[1]), (len(trial.x), *[trial.half.shape[1]] * 2))
    Z = np.concatenate([trial.slopes, motors], axis=1) * trial.half[:, None, :]
    return TubeDerivatives(slopes[..., list(own)], compute_right_product(slopes, Z))


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
