"""The way back, from the platform to the motors: whether two places of the motors in a box can give it one pose.

The pose y (12,) is a point of the platform and its rotation matrix. On the branch it is a function F of the motors with
F' = y_q + y_x φ', and A φ' = −B with the matrices of :mod:`.cells`: for the slopes S of a tube

    φ' = S + E,   A E = −(B + A S),   |E| ≤ |1 − Y A| |E| + |Y (B + A S)|.

For q, q' in a convex box F(q) − F(q') = M (q − q'), each row of M a mean of F' along the way. So if |1 − Z F'| v < v
for a fixed Z, some v > 0 and all F' over the box, no two motors in it have one pose, and no F' loses rank (Type 1).
Where a box is too large for this it is halved, and the poses of both halves are kept apart. Source: A. Neumaier,
Interval Methods for Systems of Equations, 1990, sections 5.1 and 5.2; docs/pages/prove_a_branch.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...equations.joint_equations import LoopSystem, rotate
from ...equations.loop_parts import LoopPart
from ...geometry.affine import AffineForms, combine, make_affine, stack
from ...geometry.vectors import Array
from ...solving.krawczyk import bound_contraction, bound_image
from ...tolerances import AFFINE_ROUNDING
from .cells import (
    BranchTube,
    TubeTrial,
    evaluate_derivatives,
    list_rotating_equations,
    prove_all,
    split_cells,
    stack_tubes,
)
from .growth import BRANCH_CELLS_BATCH_COUNT, Growth, find_largest_box

INJECTIVITY_CELLS_MAX = 256
"""Cells of all motors in the proof that the inverse map is unique."""
INJECTIVITY_TRIALS_MAX = 5000
"""Sets and pairs of cells tried in that proof."""
INJECTIVITY_BOXES_MAX = 12
"""Boxes tried for the inverse map, each 0.7 of the one before."""
INJECTIVITY_SIDE_STEPS_COUNT = 6
"""Enlargements of a side of such a box."""

Places = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PosedCells:
    """Cells low ≤ q ≤ high (c, n) of all motors that fill a box, with the platform's poses (c, 12) over them and their
    derivatives (c, 12, n)."""

    low: Array
    high: Array
    poses: AffineForms
    rates: AffineForms

    def within(self, low: Array, high: Array) -> Places:
        """The numbers of the cells that have room in common with a box."""
        return np.flatnonzero(np.all((self.low < high) & (self.high > low), axis=1))

    @cached_property
    def ends(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the poses (c, 12)."""
        wide = self.poses.spread + AFFINE_ROUNDING * (1 + np.abs(self.poses.v[0]))
        return self.poses.v[0] - wide, self.poses.v[0] + wide

    def has_regular_slopes(self, which: Places) -> bool:
        """Return True if |1 − Z F'| v < v with fixed Z, v > 0 over some cells together."""
        part = AffineForms(self.rates.v[:, which], self.rates.r[which])
        low, high = (part.v[0] + sign * part.spread for sign in (-1, 1))
        if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
            return False
        Z = np.linalg.pinv((low.min(axis=0) + high.max(axis=0)) / 2)
        one = np.eye(len(Z))
        N = bound_contraction(Z[None], part).max(axis=0)
        if not np.all(np.isfinite(N)) or np.abs(np.linalg.eigvals(N)).max() >= 1:
            return False
        v = np.linalg.solve(one - N, np.ones(len(one)))
        return bool(np.all(v > 0) and np.all(bound_image(0 * v, N, v) < v))


@dataclass(eq=False)
class InjectivityProof:
    """The proof for a box of cells, by halves."""

    cells: PosedCells
    tried: int = 0
    known: dict[bytes, bool] = field(default_factory=dict)

    def is_injective(self, low: Array, high: Array) -> bool:
        """Return True if different motor values in a box are proved to have different poses."""
        own = self.cells.within(low, high)
        if not len(own):
            return False
        if self._has_regular_slopes(own):
            return True
        halves = self._halves(own, low, high)
        return (
            halves is not None and all(self.is_injective(*half) for half in halves) and self.has_distinct_poses(*halves)
        )

    def has_distinct_poses(self, one: tuple[Array, Array], other: tuple[Array, Array]) -> bool:
        """Return True if no motor values in one box have a pose of others in the other box."""
        own = [self.cells.within(*box) for box in (one, other)]
        self.tried += 1
        if not all(map(len, own)):
            return False
        (low, high), (low_, high_) = (
            (self.cells.ends[0][each].min(axis=0), self.cells.ends[1][each].max(axis=0)) for each in own
        )
        if np.any(low > high_) or np.any(low_ > high):
            return True
        if self._has_regular_slopes(self.cells.within(np.minimum(one[0], other[0]), np.maximum(one[1], other[1]))):
            return True
        first = len(own[0]) >= len(own[1])
        halves = self._halves(own[0 if first else 1], *(one if first else other))
        return halves is not None and all(self.has_distinct_poses(half, other if first else one) for half in halves)

    def _has_regular_slopes(self, which: Places) -> bool:
        key = which.tobytes()
        if key not in self.known and self.tried < INJECTIVITY_TRIALS_MAX:
            self.tried += 1
            self.known[key] = self.cells.has_regular_slopes(which)
        return self.known.get(key, False)

    def _halves(self, own: Places, low: Array, high: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]] | None:
        """A box cut at a face of its cells, near the middle; None where it is part of one cell."""
        best: tuple[float, int, float] | None = None
        for k in range(len(low)):
            faces = np.unique([self.cells.low[own, k], self.cells.high[own, k]])
            for face in faces[(faces > low[k]) & (faces < high[k])]:
                uneven = abs(2 * face - low[k] - high[k]) / (high[k] - low[k])
                best = min(best or (uneven, k, face), (uneven, k, face))
        if best is None or self.tried >= INJECTIVITY_TRIALS_MAX:
            return None
        _, k, face = best
        below, above = high.copy(), low.copy()
        below[k] = above[k] = face
        return (low, below), (above, high)


def prove_injective_box(system: LoopSystem, grown: Sequence[Growth]) -> tuple[tuple[Array, Array] | None, bool]:
    """A box of all motors, low and high (n,), about the zero configuration in which no two of them are proved to have
    one pose, the proved box or a part of it, None where none was found; and whether no cell of the proved box has a
    Type 1 singularity, as far as is proved. Not looked at where a motor drives no loop, or loops that have no
    unknown in common."""
    order = [i for growth in grown for i in growth.part.driven]
    if sorted(order) != list(system.driven) or any(not growth.proved for growth in grown):
        return None, False
    low, high = (
        np.concatenate(ends)
        for ends in zip(*(map(growth.grid.point, find_largest_box(growth)) for growth in grown), strict=True)
    )
    way = system.way(system.body[system.mechanism.platform])
    firsts = [0, *accumulate(len(growth.q0) for growth in grown)]
    sides = [slice(*pair) for pair in pairwise(firsts)]
    parts = [TubedCells.of(growth).within(low[own], high[own]) for growth, own in zip(grown, sides, strict=True)]
    place = np.argsort(order)
    home, free = np.concatenate([growth.q0 for growth in grown]), False
    cells: PosedCells | None = None
    while _count(parts) <= INJECTIVITY_CELLS_MAX:
        cells = _bound_pose_cells(system, way, parts)
        free = free or all(cells.has_regular_slopes(np.array([k])) for k in range(len(cells.low)))
        if free and InjectivityProof(cells).is_injective(low, high):
            return (low[place], high[place]), True
        if _count(parts) * 2 ** len(home) > INJECTIVITY_CELLS_MAX:
            break
        parts = [each.halved() for each in parts]
    box = None if cells is None else _find_injective_box(InjectivityProof(cells), home, low, high)
    for size in 0.7 ** np.arange(1, INJECTIVITY_BOXES_MAX) if box is None else ():  # fewer cells, which may be smaller
        a, b = home + size * (low - home), home + size * (high - home)
        parts = [each.within(a[own], b[own]) for each, own in zip(parts, sides, strict=True)]
        while box is None and _count(parts) <= INJECTIVITY_CELLS_MAX:
            cells = _bound_pose_cells(system, way, parts)
            box = (a, b) if InjectivityProof(cells).is_injective(a, b) else None
            if _count(parts) * 2 ** len(home) > INJECTIVITY_CELLS_MAX:
                break
            parts = [each.halved() for each in parts]
        if box is not None:
            break
    return None if box is None else (box[0][place], box[1][place]), free


def _count(parts: Sequence[TubedCells]) -> int:
    """Return the number of cells of all motors that those of the parts make."""
    return int(np.prod([len(each.tubes) for each in parts]))


def _find_injective_box(trial: InjectivityProof, home: Array, low: Array, high: Array) -> tuple[Array, Array] | None:
    """Return a large box about ``home``, part of another, in which different motor values have different poses: shrunk
    until it is proved, then enlarged side by side."""
    whole = np.array([low, high])
    boxes = (home + size * (whole - home) for size in 0.7 ** np.arange(1, INJECTIVITY_BOXES_MAX))
    box = next((each for each in boxes if trial.is_injective(each[0], each[1])), None)
    if box is None:
        return None

    def moved(side: int, k: int, part: float) -> float:
        return float(whole[side, k] if part == 1.0 else box[side, k] + part * (whole[side, k] - box[side, k]))

    for side, k in np.ndindex(*whole.shape):
        least, most = 0.0, 2.0
        for _ in range(INJECTIVITY_SIDE_STEPS_COUNT):
            wider, part = box.copy(), (least + most) / 2
            wider[side, k] = moved(side, k, part)
            if trial.is_injective(wider[0], wider[1]):
                least = part
            else:
                most = part
            if least == 1.0:
                break
        box[side, k] = moved(side, k, least)
    return box[0], box[1]


@dataclass(frozen=True, eq=False)
class TubedCells:
    """Cells low ≤ q ≤ high (c, n) of a part, each with a proved tube over it."""

    part: LoopPart
    low: Array
    high: Array
    tubes: list[BranchTube]

    @classmethod
    def of(cls, growth: Growth) -> TubedCells:
        """Return the cells that were grown."""
        return cls(
            growth.part,
            np.array([growth.grid.point(leaf.low) for leaf in growth.proved]),
            np.array([growth.grid.point(leaf.high) for leaf in growth.proved]),
            [leaf.tube for leaf in growth.proved if leaf.tube is not None],
        )

    def within(self, low: Array, high: Array) -> TubedCells:
        """Return the cells that intersect a box."""
        room = np.flatnonzero(np.all((self.low < high) & (self.high > low), axis=1))
        return TubedCells(self.part, self.low[room], self.high[room], [self.tubes[k] for k in room])

    def halved(self) -> TubedCells:
        """Each cell halved along all its sides, with the narrower tube that is proved there where it lies in that of
        the cell, so that both hold the same closure; else with a part of that."""
        sides = np.indices([2] * self.low.shape[1]).reshape(self.low.shape[1], -1).T
        middle = (self.low + self.high) / 2
        low, high = (
            np.where(sides == side, end[:, None], middle[:, None]).reshape(-1, self.low.shape[1])
            for side, end in ((0, self.low), (1, self.high))
        )
        old = [tube for tube in self.tubes for _ in sides]
        centre, half = split_cells(low, high)
        x = np.array([tube.at(q) for tube, q in zip(old, centre, strict=True)])
        new = prove_all(self.part, centre, half, self.part.close(centre, x)[0])
        return TubedCells(
            self.part,
            low,
            high,
            [
                one
                if one is not None and one.is_inside(tube)
                else BranchTube(c, h, at, tube.slopes, tube.radius + AFFINE_ROUNDING * (1 + np.abs(at)), tube.weakest)
                for one, tube, c, h, at in zip(new, old, centre, half, x, strict=True)
            ],
        )


def _bound_pose_cells(system: LoopSystem, way: Sequence[int], cells: Sequence[TubedCells]) -> PosedCells:
    """Cells of all motors together."""
    parts = [SlopedPart.of(each.part, each.tubes) for each in cells]
    places = np.indices([len(each.tubes) for each in cells]).reshape(len(parts), -1)
    found = [
        _evaluate_poses(system, way, parts, places[:, k : k + BRANCH_CELLS_BATCH_COUNT])
        for k in range(0, places.shape[1], BRANCH_CELLS_BATCH_COUNT)
    ]
    poses, rates = (
        AffineForms(
            np.concatenate([each[k].v for each in found], axis=1), np.concatenate([each[k].r for each in found])
        )
        for k in (0, 1)
    )
    return PosedCells(
        np.hstack([each.low[which] for each, which in zip(cells, places, strict=True)]),
        np.hstack([each.high[which] for each, which in zip(cells, places, strict=True)]),
        poses,
        rates,
    )


@dataclass(frozen=True, eq=False)
class SlopedPart:
    """Proved tubes of a part (c,) with A (c, p, p), the equations' drift B + A S along them (c, p, n), and bounds |E|
    (c, p, n) of how far φ' is from S."""

    trial: TubeTrial
    A: AffineForms
    drift: AffineForms
    off: Array

    @classmethod
    def of(cls, part: LoopPart, tubes: Sequence[BranchTube]) -> SlopedPart:
        """Return those of tubes; infinite bounds where none is found."""
        trial = stack_tubes(part, tubes)
        equations = [
            each for block in part.blocks for each in (block.equations or list_rotating_equations(trial, block))
        ]
        at = evaluate_derivatives(trial, equations, range(len(part.unknowns)), trial.radius)
        drift = AffineForms(
            at.along.v / trial.half[:, None, :], (at.along.r + AFFINE_ROUNDING * at.along.size) / trial.half[:, None, :]
        )
        Y = np.linalg.pinv(at.by_own.v[0])
        M, w = bound_contraction(Y, at.by_own), combine(Y, drift).size
        # A E = −(B + A S): |E| ≤ M |E| + w, so |E| ≤ v for each v > M v + w
        v = 1.01 * np.linalg.pinv(np.eye(Y.shape[-1]) - M) @ (w + AFFINE_ROUNDING)
        good = np.all((v > 0) & ((M @ v + w) * (1 + AFFINE_ROUNDING) < v), axis=(1, 2), keepdims=True)
        return cls(trial, at.by_own, drift, np.where(good, v, np.inf))


def _evaluate_poses(
    system: LoopSystem, way: Sequence[int], parts: Sequence[SlopedPart], places: Places
) -> tuple[AffineForms, AffineForms]:
    """The platform's poses (c, 12) over cells of all motors, cell ``places`` (parts, c) of each part, and F'
    (c, 12, n); each part has noise symbols of its own."""
    count = places.shape[1]
    firsts = [0, *accumulate(each.trial.symbols[1] for each in parts)]

    def padded(form: AffineForms, k: int) -> AffineForms:
        v = np.zeros((1 + firsts[-1], count, *form.r.shape[1:]))
        v[0], v[1 + firsts[k] : 1 + firsts[k + 1]] = form.v[0][places[k]], form.v[1:][:, places[k]]
        return AffineForms(v, form.r[places[k]], None if form.bend is None else form.bend + firsts[k])

    forms: list[AffineForms | None] = [None] * len(system.coordinates)
    for k, each in enumerate(parts):
        for i, form in enumerate(each.trial.forms(each.trial.radius)):
            forms[i] = padded(form, k) if form is not None else forms[i]
    swept = system.displacement(way, forms)
    centre = np.mean([joint.point for joint in system.mechanism.joints_of(system.mechanism.platform)], axis=0)
    p, columns = swept.at(centre / system.length), [rotate(swept.R, e) for e in np.eye(3)]
    zero = make_affine(np.zeros(count), np.zeros((count, firsts[-1])), np.zeros(count))

    def pose(vectors: Sequence[Any]) -> AffineForms:
        made: AffineForms = stack([zero + v[..., k] for v in vectors for k in range(3)])
        return made

    rates = {}
    for place, i in enumerate(way):
        turned = [swept.turned(place, column) for column in columns]
        rates[i] = pose([swept.rate(place, p), *(np.zeros(3) if each is None else each for each in turned)])
    still = stack([zero] * 12)
    found = []
    for k, each in enumerate(parts):
        part, S = each.trial.part, each.trial.slopes[places[k]]
        y_x = _stack_columns([rates.get(i, still) for i in part.unknowns])
        along = _stack_columns([rates.get(i, still) for i in part.driven])
        for i in set(part.unknowns).intersection(way):
            along = along + rates[i][..., None] * S[:, part.place[i]][:, None, :]
        # F' = y_q + y_x (S + E) − K (A (S + E) + B) for any K: with y_x A⁻¹ at the middle E counts in second order
        A = padded(each.A, k)
        K = y_x.v[0] @ np.linalg.pinv(A.v[0])
        rate = along - combine(K, padded(each.drift, k))
        with np.errstate(invalid="ignore"):
            rest = (y_x - combine(K, A)).size @ each.off[places[k]]
        found.append(AffineForms(rate.v, (rate.r + rest) * (1 + AFFINE_ROUNDING)))
    return pose([p, *columns]), AffineForms(
        np.concatenate([each.v for each in found], axis=-1), np.concatenate([each.r for each in found], axis=-1)
    )


def _stack_columns(vectors: Sequence[AffineForms]) -> AffineForms:
    """Vectors (c, 12) side by side, (c, 12, k)."""
    made: AffineForms = stack(vectors)
    return made
