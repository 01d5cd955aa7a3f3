"""The largest box of motors about the zero configuration, in the proved cells, in which all joints keep their limits.

The box grows from the zero configuration, to both sides of each motor alike, then side by side, each by bisection. The
cells are halved first, as narrow tubes bound the joints better. Over the part of a cell that is in the box, a passive
coordinate is between its tube's ends there (:mod:`.analysis.branch.limits`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import AFFINE_ROUNDING
from .growth import Growth
from .injectivity import TubedCells

SAFE_BOX_HALVINGS_COUNT = 12
"""Bisections of the box, and of each of its sides."""
SAFE_BOX_CELLS_MAX = 512
"""Cells of a part into which those in the box are halved."""


@dataclass(frozen=True, eq=False)
class LimitedCells:
    """Cells low ≤ q ≤ high (c, n) with middles of the tubes x (c, k) at ``centre`` (c, n), slopes (c, k, n) and radii
    (c, k) of the k passive coordinates that have limits ``ends`` (k, 2)."""

    low: Array
    high: Array
    centre: Array
    x: Array
    slopes: Array
    radius: Array
    ends: Array

    @classmethod
    def of(cls, growth: Growth, limits: Mapping[int, tuple[float, float]], low: Array, high: Array) -> LimitedCells:
        """Return those of grown cells that intersect a box, for limits by coordinate."""
        part, cells = growth.part, TubedCells.of(growth).within(low, high)
        limited = [k for k, i in enumerate(part.unknowns) if i in limits]
        while limited and len(cells.tubes) * 2 ** len(low) <= SAFE_BOX_CELLS_MAX:
            cells = cells.halved()
        centre, x, slopes, radius = (
            np.array([getattr(tube, name) for tube in cells.tubes]) for name in ("centre", "x", "slopes", "radius")
        )
        ends = np.array([limits[part.unknowns[k]] for k in limited]).reshape(-1, 2)
        return cls(cells.low, cells.high, centre, x[:, limited], slopes[:, limited], radius[:, limited], ends)

    def is_within_limits(self, low: Array, high: Array) -> bool:
        """Return True if the passive joints are proved to be within their limits at all motors of a box."""
        a, b = np.maximum(low, self.low), np.minimum(high, self.high)
        here = np.all(a <= b, axis=1)
        a, b, slopes = a[here], b[here], self.slopes[here]
        x = self.x[here] + np.einsum("ckn,cn->ck", slopes, (a + b) / 2 - self.centre[here])
        wide = np.einsum("ckn,cn->ck", np.abs(slopes), (b - a) / 2) + self.radius[here]
        wide = wide + AFFINE_ROUNDING * (1 + np.abs(x) + wide)
        return bool(np.all(self.ends[:, 0] <= x - wide) and np.all(x + wide <= self.ends[:, 1]))


def find_safe_box(
    growth: Growth, limits: Mapping[int, tuple[float, float]], low: Array, high: Array
) -> tuple[Array, Array] | None:
    """A large box of the motors of a part, between ``low`` and ``high`` (n,), which proved cells fill, with all joints
    within their limits (by coordinate); None where no box about the zero configuration is proved to keep them."""
    limited = np.array([limits.get(i, (-np.inf, np.inf)) for i in growth.part.driven])
    low, high, home = np.maximum(low, limited[:, 0]), np.minimum(high, limited[:, 1]), growth.q0
    if not growth.proved or np.any(low > home) or np.any(home > high):
        return None
    cells = LimitedCells.of(growth, limits, low, high)
    if not cells.is_within_limits(home, home):
        return None
    reach = np.minimum(home - low, high - home)
    size = _find_largest_share(lambda share: cells.is_within_limits(home - share * reach, home + share * reach))
    box, outer = np.array([home - size * reach, home + size * reach]), np.array([low, high])
    for side in np.ndindex(*box.shape):
        widen: Callable[[float], Array] = partial(_move_side, box, outer, side)
        box = widen(_find_largest_share(lambda share, widen=widen: cells.is_within_limits(*widen(share))))
    return box[0], box[1]


def _move_side(box: Array, outer: Array, side: Sequence[int], share: float) -> Array:
    """The box (2, n) with one side moved by a share of the way to that of an outer box."""
    wider, place = box.copy(), tuple(side)
    wider[place] = outer[place] if share == 1.0 else box[place] + share * (outer[place] - box[place])
    return wider


def _find_largest_share(is_kept: Callable[..., bool]) -> float:
    """The largest share found, 1 at most, up to which a test is passed."""
    if is_kept(1.0):
        return 1.0
    least, most = 0.0, 1.0
    for _ in range(SAFE_BOX_HALVINGS_COUNT):
        middle = (least + most) / 2
        least, most = (middle, most) if is_kept(middle) else (least, middle)
    return least
