"""What turns about axes through one point can do: the angle between the first and the last axis stays in an interval.

Turns about a₁ … aₙ, neighbours γᵢ apart, make R = R₁ … Rₙ. As R₁ and Rₙ are free, all that limits R is the angle of a₁
and R aₙ: the distance of the ends of a chain of great arcs γᵢ on the unit sphere. It runs over all of [0, π] for three
axes only where neighbours are perpendicular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array, angle_between
from ..results import Value
from ..tolerances import SAME_DIRECTION

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class TiltLimit(Value):
    """A spherical joint that stands for turns about axes through its centre: the ``first``, fixed in the predecessor,
    and the ``last``, fixed in the successor, unit vectors at the zero configuration, are ``low`` to ``high`` (rad)
    apart. Where ``count`` axes are three, they lie in a plane at an end of the interval, and the turns lose a freedom;
    of more axes, only at an end that limits them."""

    first: Array
    last: Array
    low: float
    high: float
    count: int = 3

    @classmethod
    def of(cls, first: Array, last: Array, interval: Interval, count: int) -> TiltLimit | None:
        """None where every turn can be made, and in three ways at all of them."""
        wrist = cls(first, last, *interval, count)
        return wrist if wrist.limits or count == 3 else None

    @property
    def limits(self) -> bool:
        """Whether there are turns that cannot be made."""
        return self.lower is not None or self.upper is not None

    @property
    def lower(self) -> float | None:
        """The lower end (rad), where it limits anything."""
        return self.low if self.low > SAME_DIRECTION else None

    @property
    def upper(self) -> float | None:
        """The upper end (rad), where it limits anything."""
        return self.high if self.high < np.pi - SAME_DIRECTION else None

    def turned(self) -> TiltLimit:
        """The same with predecessor and successor exchanged."""
        return TiltLimit(self.last, self.first, self.low, self.high, self.count)

    def carried(self, predecessor: Array, successor: Array) -> TiltLimit:
        """With its axes where two links turned by these (3, 3) carry them."""
        return TiltLimit(predecessor @ self.first, successor @ self.last, self.low, self.high, self.count)

    def margin(self) -> float:
        """How far the angle is from the nearer end (rad); negative beyond it."""
        angle = angle_between(self.first, self.last)
        return min(
            np.inf if self.lower is None else angle - self.lower, np.inf if self.upper is None else self.upper - angle
        )

    def flatness(self) -> float:
        """How far the angle is from the nearer end at which the axes lie in a plane (rad)."""
        angle = angle_between(self.first, self.last)
        ends = (self.low, self.high) if self.count == 3 else (self.lower, self.upper)
        return min((abs(angle - end) for end in ends if end is not None), default=np.inf)


def chain_arcs(one: Interval, gap: float, other: Interval) -> Interval:
    """Distances of the ends of three arcs on the unit sphere, end to end: one of a length in ``one``, ``gap``, one of a
    length in ``other``; two sides leave |a − b| ≤ c ≤ π − |π − a − b| to the third."""
    return _third(_third(one, (gap, gap)), other)


def _third(a: Interval, b: Interval) -> Interval:
    low = max(a[0] - b[1], b[0] - a[1], 0.0)
    return low, np.pi - max(np.pi - a[1] - b[1], a[0] + b[0] - np.pi, 0.0)
