"""One cell of motor coordinates: an affine tube in which the loops are proved to have exactly one closure each.

For q in the cell, |q − q_c| ≤ h, and x in the tube, |x − x_c − S (q − q_c)| ≤ r, let A hold D_xG and B the slope
D_qG + D_xG S of G along the tube. With Y about A⁻¹ Krawczyk's operator is, in the mean value form,

    K = −Y (G(q_c, x_c) + B [−h, h] + D [−s, s]) + (1 − Y A) [−r, r],

D the derivatives by the unknowns of the blocks before and s their radii. If K lies inside [−r, r] there is, for every q
of the cell, exactly one zero in the tube, it depends analytically on q, and A is regular. Source: docs/pages/theory.md
(branches), A. Neumaier, Interval Methods for Systems of Equations, 1990, theorem 5.4.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.balls import Field
from ...geometry.vectors import Array, dot
from ...tolerances import THINNEST_TUBE
from .loops import GearEquation, Swept, residuals
from .part import LoopBlock, LoopEquation, LoopPart, tangents

TUBES = 4
"""Radii of a tube that are tried, each after the one before was too narrow."""
WIDER = 1.25
"""How much wider than what a linear estimate asks for a tube is tried."""


@dataclass(frozen=True, eq=False)
class BranchTube:
    """A proved tube: half widths h (n,), x_c (p,), S (p, n), r (p,), and a lower bound of the smallest singular value
    of D_xG, of the distances' block by block (characteristic lengths, radians)."""

    centre: Array
    half: Array
    x: Array
    slopes: Array
    radius: Array
    weakest: float

    def at(self, q: Array) -> Array:
        """The middle of the tube (p,) at q (n,)."""
        return np.asarray(self.x + self.slopes @ (q - self.centre))


@dataclass(frozen=True, eq=False)
class _Trial:
    """The tube of a cell while it is proved: radii of the unknowns so far."""

    part: LoopPart
    centre: Array
    half: Array
    x: Array
    slopes: Array
    radius: Array

    def boxes(self, radius: Array, spread: bool = True) -> list[Any]:
        """All coordinates as balls: over the tube, or at its middle."""
        from flint import arb

        found: list[Any] = [arb(0)] * len(self.part.system.coordinates)
        for i, c, h in zip(self.part.driven, self.centre.tolist(), self.half.tolist(), strict=True):
            found[i] = arb(c, h) if spread else arb(c)
        reach = np.abs(self.slopes) @ self.half + radius
        reach *= 1 + 1e-12
        for i, c, r in zip(self.part.unknowns, self.x.tolist(), reach.tolist(), strict=True):
            found[i] = arb(c, r) if spread else arb(c)
        return found


def prove_all(part: LoopPart, centres: Array, halves: Array, xs: Array) -> list[BranchTube | None]:
    """Tubes over cells (c, n) about closed configurations (c, p); None where the proof fails."""
    return [prove(part, centre, half, x) for centre, half, x in zip(centres, halves, xs, strict=True)]


def prove(part: LoopPart, centre: Array, half: Array, x: Array) -> BranchTube | None:
    """A tube over a cell about a closed configuration (``centre``, ``x``), or None where the proof fails."""
    slopes = part.slopes(centre, x)
    trial = _Trial(part, centre, half, x, slopes, np.zeros(len(x)))
    weakest = np.inf
    for block in part.blocks:
        bound = _block(trial, block)
        if bound is None:
            return None
        weakest = min(weakest, bound) if block.loop is None else weakest
    return BranchTube(centre, half, x, slopes, trial.radius.copy(), weakest)


def _block(trial: _Trial, block: LoopBlock) -> float | None:
    """Widen the tube in the unknowns of a block until Krawczyk's condition holds; a lower bound of the smallest
    singular value of the block, None where it fails."""
    part = trial.part
    own = [part.place[i] for i in block.unknowns]
    equations = block.equations if block.loop is None else _turning(trial, block)
    residual, A_c, *_ = _matrices(trial, equations, own, trial.boxes(trial.radius, spread=False))
    A = np.array([[float(v) for v in row] for row in A_c])
    if not np.all(np.isfinite(A)):
        return None
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        return None
    Y = _exact(inverse)
    step = Y @ residual
    radius = trial.radius.copy()
    for attempt in range(TUBES):
        boxes = trial.boxes(radius)
        _, A_x, B, D = _matrices(trial, equations, own, boxes)
        M = _sizes(np.eye(len(own), dtype=int) - Y @ A_x)
        drift = _sizes(Y @ B) @ trial.half + _sizes(Y @ D) @ trial.radius if len(own) else np.zeros(0)
        e = (drift + _sizes(step)) * (1 + 1e-12)
        r = radius[own]
        if not (np.all(np.isfinite(M)) and np.all(np.isfinite(e))):
            return None
        if attempt and np.all((e + M @ r) * (1 + 1e-12) < r):
            trial.radius[own] = r
            if block.loop is not None and not _same_side(trial, block):
                return None
            beta = float(np.max((M @ r) / r))
            norm = float(np.max(np.abs(inverse).sum(axis=1) / r)) * float(np.max(r)) * np.sqrt(len(own))
            return (1 - beta) / norm * (1 - 1e-12)
        if np.max(np.abs(np.linalg.eigvals(M)), initial=0.0) >= 1:
            return None
        wanted = np.linalg.solve(np.eye(len(own)) - M, e)
        radius[own] = np.maximum(WIDER * wanted, THINNEST_TUBE)
    return None


def _matrices(trial: _Trial, equations: Sequence[LoopEquation], own: Sequence[int], boxes: Sequence[Any]
              ) -> tuple[Field, Field, Field, Field]:
    """G (k,), D_xG by a block's own unknowns (k, k), its slope along the tube (k, n), D_xG by the unknowns of the part
    that are not its own (k, p)."""
    part, n = trial.part, len(trial.half)
    values: list[Any] = [0] * len(equations)
    slopes: list[dict[int, Any]] = [{} for _ in equations]
    groups: dict[int, list[int]] = {}
    for k, each in enumerate(equations):
        if isinstance(each.of, GearEquation):
            values[k] = boxes[each.of.second] - boxes[each.of.first] * each.of.ratio
            slopes[k] = {each.of.second: 1, each.of.first: -each.of.ratio}
        else:
            groups.setdefault(id(each.of), []).append(k)
    for members in groups.values():
        loop = equations[members[0]].of
        rows = [equations[k].row for k in members]
        found = residuals(part.system, loop, boxes, rows, True)  # type: ignore[arg-type]
        for k, value, slope in zip(members, *found, strict=True):
            values[k], slopes[k] = value, slope
    A = np.zeros((len(equations), len(own)), dtype=object)
    B = np.zeros((len(equations), n), dtype=object)
    D = np.zeros((len(equations), len(part.unknowns)), dtype=object)
    column = {part.unknowns[k]: place for place, k in enumerate(own)}
    place_q = {i: k for k, i in enumerate(part.driven)}
    for k, slope in enumerate(slopes):
        for i, value in slope.items():
            if i in place_q:
                B[k, place_q[i]] = B[k, place_q[i]] + value
            elif i in part.place:
                along = trial.slopes[part.place[i]]
                B[k] = B[k] + value * _exact(along)
                if i in column:
                    A[k, column[i]] = A[k, column[i]] + value
                else:
                    D[k, part.place[i]] = D[k, part.place[i]] + value
    return np.array(values, dtype=object), A, B, D


def _exact(x: Array) -> Field:
    """Floats as exact balls."""
    from flint import arb

    found = np.empty(np.shape(x), dtype=object)
    found.ravel()[:] = [arb(v) for v in np.ravel(x).tolist()]
    return found


def _sizes(v: Field) -> Array:
    """Upper bounds of |v|."""
    found = [float(x.abs_upper()) if hasattr(x, "abs_upper") else abs(float(x)) for x in v.flat]
    return np.nextafter(np.array(found), np.inf).reshape(v.shape)


def _ends(trial: _Trial, block: LoopBlock, boxes: Any, balls: bool) -> tuple[Field, Field, Field]:
    """Where the ends a, b of a rod's loop are, and the centre A of the joint that turns the rod."""
    loop, system = block.loop, trial.part.system
    assert loop is not None
    assert loop.swung is not None
    one, two = (system.displacement(chain, boxes, balls) for chain in loop.chains)
    before: Swept = system.displacement(loop.chains[1][: loop.swung], boxes, balls)
    return one.at(loop.point), two.at(loop.point), before.at(system.coordinates[loop.chains[1][loop.swung]].point)


def _turning(trial: _Trial, block: LoopBlock) -> tuple[LoopEquation, ...]:
    """The equations that turn a rod to where its loop closes: none across its direction at the cell's middle."""
    a, _, A = _ends(trial, block, trial.part.values(trial.centre, trial.x), False)
    assert block.loop is not None
    return tuple(LoopEquation(block.loop, row, swings=True) for row in tangents(a - A))


def _same_side(trial: _Trial, block: LoopBlock) -> bool:
    """Whether both ends of a rod's loop lie on one side of its centre over the tube: two points equally far from it and
    equal across one direction are then the same."""
    middle = _ends(trial, block, trial.part.values(trial.centre, trial.x), False)
    a, b, A = _ends(trial, block, trial.boxes(trial.radius), True)
    direction = _exact(middle[0] - middle[2])
    return bool(dot(direction, a - A) > 0 and dot(direction, b - A) > 0)
