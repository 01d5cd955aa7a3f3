"""The cells of a box that are proved and connected to the zero configuration: grown from it, face by face, halved where
the proof fails.

A cell is started from a point that it shares with a proved one, and counts only if at this point both tubes hold the
same closure. Cells are boxes of whole numbers, 2^FINEST_BRANCH_CELL to a side of the box, so that faces and volumes
are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...budgets import FINEST_BRANCH_CELL
from ...geometry.vectors import Array
from .cells import BranchTube, prove_all
from .part import LoopPart

AT_ONCE = 64
"""Cells that are tried together."""
Corner = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A box low ≤ q ≤ high (n,), its sides cut into 2^FINEST_BRANCH_CELL."""

    low: Array
    high: Array

    def point(self, at: Any) -> Array:
        """The motor coordinates (n,) of a point given in whole numbers, or halves of them; ends of the box exactly."""
        part = np.asarray(at, dtype=float) / 2.0**FINEST_BRANCH_CELL
        return np.asarray(np.where(part == 1.0, self.high, self.low + part * (self.high - self.low)))


@dataclass(eq=False)
class GrownCell:
    """A cell of the box in whole numbers, not yet cut: proved (``tube``), given up (``failed``), or waiting."""

    low: Corner
    high: Corner
    depth: int = 0
    tube: BranchTube | None = None
    failed: bool = False
    asked: bool = False
    number: int = -1
    neighbours: set[int] = field(default_factory=set)

    @property
    def volume(self) -> float:
        """Its part of the box."""
        return float(np.prod((self.high - self.low) / 2.0**FINEST_BRANCH_CELL))


@dataclass(frozen=True, eq=False)
class BranchEnd:
    """A cell that could not be proved nor cut any more, with the point and closure that it was started from."""

    leaf: GrownCell
    q: Array
    x: Array


@dataclass(eq=False)
class Growth:
    """The growing of cells over a box of a part's motors from a closed configuration (q0, x0)."""

    part: LoopPart
    grid: CellGrid
    q0: Array
    x0: Array
    depth: int
    most: int
    leaves: list[GrownCell] = field(default_factory=list)
    proved: list[GrownCell] = field(default_factory=list)
    endings: list[BranchEnd] = field(default_factory=list)
    tried: int = 0

    def run(self) -> Growth:
        """Grow until nothing is left to try, or as many cells were tried as are allowed."""
        n = len(self.q0)
        root = GrownCell(np.zeros(n, dtype=np.int64), np.full(n, 2**FINEST_BRANCH_CELL, dtype=np.int64))
        self.leaves.append(root)
        waiting: list[tuple[GrownCell, Array, Array]] = [(root, self.q0, self.x0)]
        root.asked = True
        while waiting and self.tried < self.most:
            waiting.sort(key=lambda each: (each[0].depth, each[0].low.tolist()))
            batch, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
            self.tried += len(batch)
            for (leaf, q, x), tube in zip(batch, self._tubes(batch), strict=True):
                if tube is not None and self._joined(leaf, tube, q, x):
                    waiting += self._around(leaf)
                elif leaf.depth >= self.depth * n:
                    leaf.failed = True
                    self.endings.append(BranchEnd(leaf, q, x))
                else:
                    waiting += self._cut(leaf, q, x)
        self.endings += [BranchEnd(leaf, q, x) for leaf, q, x in waiting]
        return self

    def _tubes(self, batch: Sequence[tuple[GrownCell, Array, Array]]) -> list[BranchTube | None]:
        """The tubes of cells, each about the closure at its middle that its start leads to."""
        low = np.array([self.grid.point(leaf.low) for leaf, *_ in batch])
        high = np.array([self.grid.point(leaf.high) for leaf, *_ in batch])
        centre = (low + high) / 2
        starts = [self.part.followed(q, x, goal) for (_, q, x), goal in zip(batch, centre, strict=True)]
        there = [k for k, x in enumerate(starts) if x is not None]
        found: list[BranchTube | None] = [None] * len(batch)
        if there:
            half = np.maximum(high - centre, centre - low)[there]
            half = half + np.spacing(np.abs(centre[there]) + half) * (half > 0)
            tubes = prove_all(self.part, centre[there], half, np.array([starts[k] for k in there]))
            for k, tube in zip(there, tubes, strict=True):
                found[k] = tube
        return found

    def _joined(self, leaf: GrownCell, tube: BranchTube, q: Array, x: Array) -> bool:
        """Number a cell if its tube holds the closure near ``x`` at its start ``q``, and agrees with every proved cell
        beside it."""
        if not self._same([(q, x, tube, None)])[0]:
            return False
        beside = [each for each in self._beside(leaf) if each.tube is not None]
        asked = []
        for other in beside:
            face = self._face(leaf, other)
            assert other.tube is not None
            asked.append((face, other.tube.at(face), tube, other.tube))
        if not all(self._same(asked)):
            return False
        leaf.tube, leaf.number = tube, len(self.proved)
        self.proved.append(leaf)
        for other in beside:
            leaf.neighbours.add(other.number)
            other.neighbours.add(leaf.number)
        return True

    def _same(self, asked: Sequence[tuple[Array, Array, BranchTube, BranchTube | None]]) -> list[bool]:
        """Whether at a point q the zero near x is enclosed, and its enclosure lies in the interior of one tube (or of
        both): it is then the only zero in them."""
        closed = [self.part.closed(q, x) for q, x, *_ in asked]
        there = [k for k, x in enumerate(closed) if x is not None]
        found = [False] * len(asked)
        if not there:
            return found
        points = np.array([asked[k][0] for k in there])
        tubes = prove_all(self.part, points, np.zeros(points.shape), np.array([closed[k] for k in there]))
        for k, point in zip(there, tubes, strict=True):
            found[k] = point is not None and all(
                each is None or bool(np.all(np.abs(point.x - each.at(point.centre)) + point.radius
                                            < each.radius * (1 - 1e-9))) for each in asked[k][2:])
        return found

    def _face(self, one: GrownCell, other: GrownCell) -> Array:
        """The middle of what two cells have in common."""
        return self.grid.point((np.maximum(one.low, other.low) + np.minimum(one.high, other.high)) / 2)

    def _beside(self, leaf: GrownCell) -> list[GrownCell]:
        """The cells that have a face, or part of one, in common with a cell."""
        low = np.array([each.low for each in self.leaves])
        high = np.array([each.high for each in self.leaves])
        common = np.minimum(high, leaf.high) - np.maximum(low, leaf.low)
        touching = np.all(common >= 0, axis=1) & (np.sum(common == 0, axis=1) == 1)
        return [self.leaves[k] for k in np.flatnonzero(touching)]

    def _around(self, leaf: GrownCell) -> list[tuple[GrownCell, Array, Array]]:
        """The cells beside a proved one that were not asked for yet, each started at the middle of the common face."""
        found = []
        for other in self._beside(leaf):
            if other.tube is None and not other.asked:
                other.asked = True
                found.append(self._start(leaf, other))
        return found

    def _start(self, leaf: GrownCell, other: GrownCell) -> tuple[GrownCell, Array, Array]:
        """A cell with a point of its face to a proved one and the closure there."""
        assert leaf.tube is not None
        face = self._face(leaf, other)
        x = self.part.closed(face, leaf.tube.at(face))
        return other, face, leaf.tube.at(face) if x is None else x

    def _cut(self, leaf: GrownCell, q: Array, x: Array) -> list[tuple[GrownCell, Array, Array]]:
        """Halve a cell where the loops change most; the halves that can be started are."""
        k = self._widest(leaf, x, q)
        middle = (leaf.low[k] + leaf.high[k]) // 2
        halves = []
        for side in (0, 1):
            low, high = leaf.low.copy(), leaf.high.copy()
            (high if side == 0 else low)[k] = middle
            halves.append(GrownCell(low, high, leaf.depth + 1))
        self.leaves.remove(leaf)
        self.leaves += halves
        found = []
        for half in halves:
            if np.all(self.grid.point(half.low) <= q) and np.all(q <= self.grid.point(half.high)):
                half.asked = True
                found.append((half, q, x))
                continue
            beside = [each for each in self._beside(half) if each.tube is not None]
            if beside:
                half.asked = True
                found.append(self._start(max(beside, key=lambda each: each.volume), half))
        return found

    def _widest(self, leaf: GrownCell, x: Array, q: Array) -> int:
        """The side of a cell over which the Jacobian changes most, by the slopes at its start."""
        width = self.grid.point(leaf.high) - self.grid.point(leaf.low)
        slopes = np.abs(self.part.slopes(q, x)).sum(axis=0) + np.array(
            [1.0] * len(self.part.driven))
        return int(np.argmax(width * slopes))


def largest_box(growth: Growth) -> tuple[Corner, Corner]:
    """A large box about the start in the union of the proved cells: grown side by side, as long as it is covered."""
    cells = [leaf for leaf in growth.proved]
    first = cells[0]
    low, high = first.low.copy(), first.high.copy()
    lows = np.array([each.low for each in cells])
    highs = np.array([each.high for each in cells])

    def covered(a: Corner, b: Corner) -> bool:
        common = np.minimum(highs, b) - np.maximum(lows, a)
        inside = np.all(common > 0, axis=1)
        return sum(_volume(row) for row in common[inside]) == _volume(b - a)

    moved = True
    while moved:
        moved = False
        for k in range(len(low)):
            for side, edges in ((0, lows), (1, highs)):
                current = low[k] if side == 0 else high[k]
                further = edges[:, k][edges[:, k] < current] if side == 0 else edges[:, k][edges[:, k] > current]
                if not len(further):
                    continue
                a, b = low.copy(), high.copy()
                (a if side == 0 else b)[k] = further.max() if side == 0 else further.min()
                if covered(a, b):
                    low, high, moved = a, b, True
    return low, high


def _volume(sides: Corner) -> int:
    found = 1
    for side in sides.tolist():
        found *= int(side)
    return found
