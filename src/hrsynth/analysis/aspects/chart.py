"""What a pose decides: whether each leg reaches it in its working mode, and the vectors that the condition names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...mechanism.vectors import Array
from .balls import Field, cross, normed
from .carriage import Rigid
from .limbs import Limb


@dataclass(frozen=True, eq=False)
class Borne:
    """A vector that a limb carries: ``sense`` · its vector + ``offset``."""

    limb: int
    sense: float
    offset: Array


@dataclass(frozen=True, eq=False)
class Made:
    """The unit vector from ``start`` to ``end``, or of ``axis`` × it."""

    start: Rigid | Borne
    end: Rigid | Borne
    axis: Rigid | Borne | None


@dataclass(frozen=True, eq=False)
class Found:
    """Reserves (n, limbs) and the condition's vectors by symbol, (n, 3), at poses; points from the first leg's tip."""

    reserves: Field
    values: Mapping[str, Field]


@dataclass(frozen=True, eq=False)
class Chart:
    """Limbs of all legs in their working modes, and how the condition's vectors follow from them."""

    limbs: tuple[Limb, ...]
    vectors: Mapping[str, Rigid | Borne | Made]
    points: tuple[str, ...] = ()
    """Symbols of points; the first is where they are measured from."""

    @property
    def modes(self) -> tuple[float, ...]:
        """The working mode of each limb, ±1."""
        return tuple(limb.branch for limb in self.limbs)

    def flipped(self, limb: int) -> Chart:
        """The chart with one limb in its other working mode."""
        other = replace(self.limbs[limb], branch=-self.limbs[limb].branch)
        return replace(self, limbs=(*self.limbs[:limb], other, *self.limbs[limb + 1 :]))

    def at(self, p: Field, R: Field, leading: tuple[int, Field] | None = None) -> Found:
        """What poses (n, 3), (n, 3, 3) decide, for numbers or balls; of a limb that leads, what it carries is given."""
        with np.errstate(invalid="ignore"):
            solved = [(0 * p[:, 0] + 1.0, leading[1]) if leading is not None and leading[0] == number
                      else limb.solve(limb.tip.value(p, R), limb.branch) for number, limb in enumerate(self.limbs)]
            carried = [vector for _, vector in solved]
            values = {symbol: _value(each, p, R, carried) for symbol, each in self.vectors.items()}
        values.update({symbol: values[symbol] - values[self.points[0]] for symbol in self.points[::-1]})
        return Found(np.stack([reserve for reserve, _ in solved], axis=1), values)


def _value(each: Rigid | Borne | Made, p: Field, R: Field, carried: Sequence[Field]) -> Field:
    if isinstance(each, Rigid):
        return each.value(p, R)
    if isinstance(each, Borne):
        return np.asarray(each.sense * carried[each.limb] + each.offset)
    along = _value(each.end, p, R, carried) - _value(each.start, p, R, carried)
    return normed(along if each.axis is None else cross(_value(each.axis, p, R, carried), along))

