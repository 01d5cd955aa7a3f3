"""The cells of a box that are proved and connected to the zero configuration: grown from it, face by face, halved where
the proof fails.

A cell is started from a point that it shares with a proved one, and counts only if at this point both tubes hold the
same closure. Cells are boxes of whole numbers, 2^FINEST_BRANCH_CELL to a side of the box, so that faces and volumes
are exact.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...equations.loop_parts import LoopPart
from ...geometry.vectors import Array
from ...progress import report
from .cells import BranchTube, prove_all, prove_turned, split_cells

BRANCH_CELL_INDEX_HALVINGS_MAX = 40
"""Largest number of halvings of a side, limited by the integer cell index."""

BRANCH_CELLS_BATCH_COUNT = 64
"""Cells that are tried together."""
BRANCH_POINTS_BATCH_COUNT = 512
"""Points of common faces that are proved together."""
Corner = NDArray[np.int64]
Waiting = tuple["GrownCell", Array, Array]
"""A cell with a point of it and the closure there, from which it is started."""


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A box low ≤ q ≤ high (n,), its sides cut into 2^FINEST_BRANCH_CELL."""

    low: Array
    high: Array

    def point(self, at: Any) -> Array:
        """The motor coordinates (n,) of a point given in whole numbers, or halves of them; ends of the box exactly."""
        part = np.asarray(at, dtype=float) / 2.0**BRANCH_CELL_INDEX_HALVINGS_MAX
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
    beyond: bool = False
    """True if the cell is too large to be tried and is not cut."""
    number: int = -1
    neighbours: set[int] = field(default_factory=set)

    @property
    def volume(self) -> float:
        """Fraction of the box."""
        return float(np.prod((self.high - self.low) / 2.0**BRANCH_CELL_INDEX_HALVINGS_MAX))


def make_whole_cell(n: int) -> list[GrownCell]:
    """The box of n motors as one cell."""
    return [GrownCell(np.zeros(n, dtype=np.int64), np.full(n, 2**BRANCH_CELL_INDEX_HALVINGS_MAX, dtype=np.int64))]


def split_box(grid: CellGrid, start: Array, half: Array, most: int) -> list[GrownCell]:
    """The box as at most so many equal cells of sides 2 half (n,) about a start, as far as they go, the first with the
    start in its middle, and what lies beyond them on each side."""
    n = len(start)
    scale = 2.0**BRANCH_CELL_INDEX_HALVINGS_MAX / (grid.high - grid.low)
    middle, reach = np.rint((start - grid.low) * scale).astype(np.int64), np.floor(half * scale).astype(np.int64)

    def edges(k: int, rings: int) -> list[int]:
        every = {int(middle[k] + j * reach[k]) for j in range(-2 * rings - 1, 2 * rings + 2, 2)}
        return sorted({min(max(item, 0), 2**BRANCH_CELL_INDEX_HALVINGS_MAX) for item in every})

    rings = [0] * n
    for ring in range(1, most):
        for k in range(n):
            wider = [*rings[:k], ring, *rings[k + 1 :]]
            if math.prod(len(edges(i, item)) - 1 for i, item in enumerate(wider)) <= most:
                rings = wider
        if max(rings) < ring or all(edges(k, ring) == edges(k, ring + 1) for k in range(n)):
            break
    sides = [list(pairwise(edges(k, item))) for k, item in enumerate(rings)]
    cells = [GrownCell(*np.array(item, dtype=np.int64).T) for item in product(*sides)]
    cells.sort(key=lambda cell: bool(np.any(cell.low > middle) or np.any(cell.high < middle)))
    low, high = np.array([side[0][0] for side in sides]), np.array([side[-1][1] for side in sides])
    outer_low, outer_high = np.zeros(n, dtype=np.int64), np.full(n, 2**BRANCH_CELL_INDEX_HALVINGS_MAX, dtype=np.int64)
    for k in range(n):
        for a, b in ((0, low[k]), (high[k], 2**BRANCH_CELL_INDEX_HALVINGS_MAX)):
            if a < b:
                beyond = GrownCell(outer_low.copy(), outer_high.copy(), beyond=True)
                beyond.low[k], beyond.high[k] = a, b
                cells.append(beyond)
        outer_low[k], outer_high[k] = low[k], high[k]
    return cells


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
    coarsest: float
    """Part of a side of the box above which a cell is halved without a trial."""
    leaves: list[GrownCell]
    """The cells of the box; the first holds the start."""
    proved: list[GrownCell] = field(default_factory=list)
    endings: list[BranchEnd] = field(default_factory=list)
    tried: int = 0

    def run(self, time_limit: float) -> Growth:
        """Grow until nothing is left to try, or as many cells were tried, or seconds have passed, as are allowed."""
        end = time.monotonic() + time_limit
        waiting: list[Waiting] = [(self.leaves[0], self.q0, self.x0)]
        self.leaves[0].asked = True
        while waiting and self.tried < self.most and (not self.proved or time.monotonic() < end):
            waiting.sort(key=lambda item: (item[0].depth, item[0].low.tolist()))
            batch, waiting = waiting[:BRANCH_CELLS_BATCH_COUNT], waiting[BRANCH_CELLS_BATCH_COUNT:]
            coarse = [item for item in batch if self._is_too_coarse(item[0])]
            if coarse:
                waiting += [item for item in batch if not self._is_too_coarse(item[0])]
                waiting += self._cut(coarse)
                continue
            self.tried += len(batch)
            report("batches of cells")
            tubes, cut = self._tubes(batch), list[Waiting]()
            joined = self._join(batch, tubes)
            for (leaf, q, x), tube in zip(batch, tubes, strict=True):
                if tube is not None and leaf in joined:
                    waiting += self._around(leaf)
                elif leaf.depth >= self.depth:
                    leaf.failed = True
                    self.endings.append(BranchEnd(leaf, q, x))
                else:
                    cut.append((leaf, q, x))
            waiting += self._cut(cut)
        self.endings += [BranchEnd(leaf, q, x) for leaf, q, x in waiting]
        return self

    @property
    def share(self) -> float:
        """The volume of all proved cells, as part of the box: 1.0 for all of it alone."""
        volume, whole = sum(_compute_volume(leaf.high - leaf.low) for leaf in self.proved), self.whole ** len(self.q0)
        return 1.0 if volume == whole else min(volume / whole, 1 - 2.0**-50)

    def _is_too_coarse(self, leaf: GrownCell) -> bool:
        return bool(np.max(leaf.high - leaf.low) / self.whole > self.coarsest) and leaf.depth < self.depth

    def _tubes(self, batch: Sequence[Waiting]) -> list[BranchTube | None]:
        """The tubes of cells, each about the closure at its middle that its start leads to."""
        low = np.array([self.grid.point(leaf.low) for leaf, *_ in batch])
        high = np.array([self.grid.point(leaf.high) for leaf, *_ in batch])
        centre, half = split_cells(low, high)
        q = np.array([q for _, q, _ in batch])
        x, closed = self.part.close(q, np.array([x for *_, x in batch]))
        starts, good = self.part.follow(q, x, centre)
        return self._prove(centre, half, starts, np.logical_and(good, closed))

    def _prove(self, centre: Array, half: Array, x: Array, which: Array) -> list[BranchTube | None]:
        """The tubes over those cells (c, n) for which there is a closed configuration (c, p)."""
        found: list[BranchTube | None] = [None] * len(centre)
        there = np.flatnonzero(which)
        if len(there):
            for k, tube in zip(there, prove_all(self.part, centre[there], half[there], x[there]), strict=True):
                found[k] = tube
        return found

    def _join(self, batch: Sequence[Waiting], tubes: Sequence[BranchTube | None]) -> set[GrownCell]:
        """Number those cells whose tubes hold the closure at their starts, and agree with every numbered cell beside
        them; these cells."""
        own = [(leaf, q, x, tube) for (leaf, q, x), tube in zip(batch, tubes, strict=True) if tube is not None]
        # of a cell beside a proved one the common face decides
        alone = [k for k, (leaf, *_) in enumerate(own) if not any(item.number >= 0 for item in self._beside(leaf))]
        at_start = [True] * len(own)
        for k, same in zip(alone, self._same([(*own[k][1:], None) for k in alone]), strict=True):
            at_start[k] = same
        own = [item for item, same in zip(own, at_start, strict=True) if same]
        # samples: equations that were left out may depend on the others at zero alone
        for way in (-1.0, 1.0) if self.part.left_out else ():
            corners = [(tube.centre + way * tube.half, tube) for *_, tube in own]
            closed = self._same([(q, tube.at(q), tube, None) for q, tube in corners])
            own = [item for item, same in zip(own, closed, strict=True) if same]
        for leaf, _, _, tube in own:
            leaf.tube = tube
        pairs = []
        for place, (leaf, *_) in enumerate(own):
            later = {id(item[0]) for item in own[place + 1 :]}
            pairs += [
                (leaf, other) for other in self._beside(leaf) if other.tube is not None and id(other) not in later
            ]
        asked = []
        for one, other in pairs:
            assert one.tube is not None
            assert other.tube is not None
            face = self._face(one, other)
            asked.append((face, other.tube.at(face), one.tube, other.tube))
        beside: dict[int, list[tuple[GrownCell, bool]]] = {}
        for (one, other), same in zip(pairs, self._same(asked), strict=True):
            beside.setdefault(id(one), []).append((other, same))
        found = set()
        for leaf, *_ in own:
            others = [(other, same) for other, same in beside.get(id(leaf), []) if other.tube is not None]
            if not all(same for _, same in others):
                leaf.tube = None
                continue
            leaf.number = len(self.proved)
            self.proved.append(leaf)
            found.add(leaf)
            for other, _ in others:
                leaf.neighbours.add(other.number)
                other.neighbours.add(leaf.number)
        return found

    def _same(self, asked: Sequence[tuple[Array, Array, BranchTube, BranchTube | None]]) -> list[bool]:
        """Return True if at q the zero near x is enclosed, and its enclosure lies in the interior of one tube (or of
        both): it is then the only zero in them."""
        if not asked:
            return []
        q = np.array([item[0] for item in asked])
        x, good = self.part.close(q, np.array([item[1] for item in asked]))
        points = self._prove(q, np.zeros(q.shape), x, good)
        return [
            point is not None and all(item is None or point.is_within(item) for item in tubes)
            for point, (_, _, *tubes) in zip(points, asked, strict=True)
        ]

    @property
    def whole(self) -> int:
        """The side of the box in whole numbers."""
        return int(2**BRANCH_CELL_INDEX_HALVINGS_MAX)

    def opposite(self, k: int, one: GrownCell, other: GrownCell) -> list[Array]:
        """The middle of what the far face of one cell and the near face of another have in common a whole turn apart,
        on the far face; none where that is nothing."""
        low, high = np.maximum(one.low, other.low), np.minimum(one.high, other.high)
        low[k] = high[k] = self.whole
        sides = np.delete(high - low, k)
        return [self.grid.point((low + high) / 2)] if np.all(sides > 0) else []

    def is_face_covered(self, k: int, cells: Sequence[GrownCell]) -> bool:
        """Return True if cells at a face across side k fill it."""
        return sum(_compute_volume(np.delete(leaf.high - leaf.low, k)) for leaf in cells) == self.whole ** (
            len(self.q0) - 1
        )

    def _face(self, one: GrownCell, other: GrownCell) -> Array:
        """The middle of what two cells have in common."""
        return self.grid.point((np.maximum(one.low, other.low) + np.minimum(one.high, other.high)) / 2)

    def _beside(self, leaf: GrownCell) -> list[GrownCell]:
        """The cells that have a face, or part of one, in common with a cell."""
        low = np.array([item.low for item in self.leaves])
        high = np.array([item.high for item in self.leaves])
        common = np.minimum(high, leaf.high) - np.maximum(low, leaf.low)
        touching = np.all(common >= 0, axis=1) & (np.sum(common == 0, axis=1) == 1)
        return [self.leaves[k] for k in np.flatnonzero(touching)]

    def _around(self, leaf: GrownCell) -> list[Waiting]:
        """Return the neighbours of a proved cell that were not tried yet, each started at the middle of the common
        face."""
        found = []
        for other in self._beside(leaf):
            if other.tube is None and not other.asked:
                other.asked = True
                if other.beyond:
                    self.endings.append(BranchEnd(*self._start(leaf, other)))
                else:
                    found.append(self._start(leaf, other))
        return found

    def _start(self, leaf: GrownCell, other: GrownCell) -> Waiting:
        """A cell with a point of its face to a proved one and the closure there."""
        assert leaf.tube is not None
        face = self._face(leaf, other)
        return other, face, leaf.tube.at(face)

    def _cut(self, leaves: Sequence[Waiting]) -> list[Waiting]:
        """Halve cells where the loops change most; the halves that can be started are."""
        found: list[Waiting] = []
        for (leaf, q, x), k in zip(leaves, self._widest(leaves), strict=True):
            middle = (leaf.low[k] + leaf.high[k]) // 2
            halves = []
            for side in (0, 1):
                low, high = leaf.low.copy(), leaf.high.copy()
                (high if side == 0 else low)[k] = middle
                halves.append(GrownCell(low, high, leaf.depth + 1))
            self.leaves.remove(leaf)
            self.leaves += halves
            for half in halves:
                if np.all(self.grid.point(half.low) <= q) and np.all(q <= self.grid.point(half.high)):
                    half.asked = True
                    found.append((half, q, x))
                    continue
                beside = [item for item in self._beside(half) if item.tube is not None]
                if beside:
                    half.asked = True
                    found.append(self._start(max(beside, key=lambda item: item.volume), half))
        return found

    def _widest(self, leaves: Sequence[Waiting]) -> list[int]:
        """The side of each cell over which the Jacobian changes most, by the slopes at its start."""
        if not leaves:
            return []
        width = np.array([self.grid.point(leaf.high) - self.grid.point(leaf.low) for leaf, _, _ in leaves])
        slopes = self.part.slopes(np.array([q for _, q, _ in leaves]), np.array([x for _, _, x in leaves]))
        return np.argmax(width * (np.abs(slopes).sum(axis=1) + 1.0), axis=-1).tolist()

    def extend(self, part: LoopPart) -> None:
        """Give the proved tubes of a core the joints of the whole part that turn rods: from the start on, one cell from
        the other. Where the joints of a cell are not those of one before it, their radius is infinite."""
        core = part.core.places_in(part)
        if len(core) == len(part.unknowns):
            return
        turned = [k for k in range(len(part.unknowns)) if k not in core]
        x0 = part.system.zero[list(part.unknowns)]
        x0[core] = self.x0
        layer, reached = [(self.proved[0], self.q0, x0)] if self.proved else [], {0}
        while layer:
            tubes = [leaf.tube for leaf, _, _ in layer if leaf.tube is not None]
            q, x = np.array([q for _, q, _ in layer]), np.array([x for _, _, x in layer])
            centre = np.array([tube.centre for tube in tubes])
            x = part.follow(q, part.close(q, x)[0], centre)[0]
            x[:, core] = [tube.x for tube in tubes]
            ahead = []
            for (leaf, _, _), tube in zip(layer, prove_turned(part, tubes, x), strict=True):
                leaf.tube = tube
                for number in sorted(leaf.neighbours - reached):
                    reached.add(number)
                    face = self._face(leaf, self.proved[number])
                    ahead.append((self.proved[number], face, tube.at(face)))
            layer = ahead
        pairs = [
            (leaf, self.proved[number])
            for leaf in self.proved
            for number in leaf.neighbours
            if number < leaf.number and leaf.tube is not None and np.isfinite(leaf.tube.radius[turned]).any()
        ]
        for k in range(0, len(pairs), BRANCH_POINTS_BATCH_COUNT):
            some = pairs[k : k + BRANCH_POINTS_BATCH_COUNT]
            q = np.array([self._face(*pair) for pair in some])
            both = [(one.tube, other.tube) for one, other in some if one.tube is not None and other.tube is not None]
            x, _ = part.close(q, np.array([tubes[0].at(at) for tubes, at in zip(both, q, strict=True)]))
            known = {
                place: item
                for place, item in enumerate(prove_all(part.core, q, np.zeros(q.shape), x[:, core]))
                if item is not None
            }
            points = dict(zip(known, prove_turned(part, list(known.values()), x[list(known)]), strict=True))
            for place, (one, other) in enumerate(both):
                sure = np.isfinite(one.radius) & np.isfinite(other.radius)
                if place not in points or not all(points[place].is_within(item, sure) for item in (one, other)):
                    one.radius[turned] = np.inf
        self.part, self.x0 = part, x0

    def complete(self, q: Array, x: Array) -> Array:
        """The unknowns of the whole part at closed configurations (c, n), (c, p) of its core, from the nearest
        cells."""
        x_all = np.tile(self.x0, (len(q), 1))
        if self.proved:
            tubes = [leaf.tube for leaf in self.proved if leaf.tube is not None]
            centres = np.array([tube.centre for tube in tubes])
            nearest = [int(np.argmin(np.linalg.norm(centres - at, axis=1))) for at in q]
            x_all = np.array([tubes[k].x for k in nearest])
        x_all[:, self.part.core.places_in(self.part)] = x
        return self.part.close(q, x_all)[0]


def find_largest_box(growth: Growth) -> tuple[Corner, Corner]:
    """A large box about the start in the union of the proved cells: grown side by side, as long as it is covered."""
    cells = [leaf for leaf in growth.proved]
    first = cells[0]
    low, high = first.low.copy(), first.high.copy()
    lows = np.array([item.low for item in cells])
    highs = np.array([item.high for item in cells])

    def covered(a: Corner, b: Corner) -> bool:
        common = np.minimum(highs, b) - np.maximum(lows, a)
        inside = np.all(common > 0, axis=1)
        return sum(_compute_volume(row) for row in common[inside]) == _compute_volume(b - a)

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


def _compute_volume(sides: Corner) -> int:
    found = 1
    for side in sides.tolist():
        found *= int(side)
    return found
