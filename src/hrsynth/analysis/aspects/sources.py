"""Where a vector comes from: the pose, a limb that carries it, or both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.balls import Field, normed
from ...geometry.vectors import Array, cross
from .carriage import Rigid


class NoChart(Exception):
    """Why a pose does not decide what the legs do: the reason, for the answer."""


@dataclass(frozen=True, eq=False)
class Borne:
    """A vector that a limb carries: ``sense`` · its vector + ``offset``."""

    limb: int
    sense: float
    offset: Array
    fitted: bool = False


@dataclass(frozen=True, eq=False)
class Made:
    """The unit vector from ``start`` to ``end``, or of ``axis`` × it."""

    start: Rigid | Borne
    end: Rigid | Borne
    axis: Rigid | Borne | None

    @property
    def fitted(self) -> bool:
        """Whether one of its parts was."""
        return any(part is not None and part.fitted for part in (self.start, self.end, self.axis))


Source = Rigid | Borne | Made


def traced(each: Source, p: Field, R: Field, carried: Sequence[Field]) -> Field:
    if isinstance(each, Rigid):
        return each.value(p, R)
    if isinstance(each, Borne):
        return np.asarray(each.sense * carried[each.limb] + each.offset)
    along = traced(each.end, p, R, carried) - traced(each.start, p, R, carried)
    return normed(along if each.axis is None else cross(traced(each.axis, p, R, carried), along))

