"""What a pose decides: whether each leg reaches it in its working mode, whether joints are within their limits, and the
vectors that the condition names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.balls import Field
from ...geometry.vectors import Array
from .limbs import Limb
from .limits import Bound
from .sources import Source, traced


@dataclass(frozen=True, eq=False)
class Found:
    """Reserves (n, limbs + bounds) and the condition's vectors by symbol, (n, 3), at poses; points from the
    first leg's tip."""

    reserves: Field
    values: Mapping[str, Field]


@dataclass(frozen=True, eq=False)
class Chart:
    """Limbs of all legs in their working modes, and how the condition's vectors follow from them."""

    limbs: tuple[Limb, ...]
    vectors: Mapping[str, Source]
    points: tuple[str, ...] = ()
    """Symbols of points; the first is where they are measured from."""
    bounds: tuple[Bound, ...] = ()
    """Limits of joints; each has a reserve too."""

    @property
    def modes(self) -> tuple[float, ...]:
        """The working mode of each limb, ±1."""
        return tuple(limb.branch for limb in self.limbs)

    def flipped(self, limb: int) -> Chart:
        """The chart with one limb in its other working mode."""
        other = replace(self.limbs[limb], branch=-self.limbs[limb].branch)
        return replace(self, limbs=(*self.limbs[:limb], other, *self.limbs[limb + 1 :]))

    def beyond(self, p: Array, R: Array) -> tuple[str, ...]:
        """The joints that are not within their limits at one pose (3,), (3, 3)."""
        within = self.at(p[None], R[None]).reserves[0, len(self.limbs) :] > 0
        return tuple(bound.joint for bound, held in zip(self.bounds, within, strict=True) if not held)

    def at(self, p: Field, R: Field, leading: tuple[int, Field] | None = None) -> Found:
        """What poses (n, 3), (n, 3, 3) decide, for numbers or balls; of a limb that leads, what it carries is given."""
        with np.errstate(invalid="ignore"):
            solved = [(0 * p[:, 0] + 1.0, leading[1]) if leading is not None and leading[0] == number
                      else limb.solve(limb.tip.value(p, R), limb.branch) for number, limb in enumerate(self.limbs)]
            carried = [vector for _, vector in solved]
            values = {symbol: traced(each, p, R, carried) for symbol, each in self.vectors.items()}
            within = [bound.reserve(lambda each: traced(each, p, R, carried)) for bound in self.bounds]
        values.update({symbol: values[symbol] - values[self.points[0]] for symbol in self.points[::-1]})
        return Found(np.stack([*(reserve for reserve, _ in solved), *within], axis=1), values)
