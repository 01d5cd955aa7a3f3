"""Tilt limit of rotations about axes through one point: the angle between the first and the last axis stays in an
interval.

Rotations about a₁ … aₙ, with angles γᵢ between neighbours, make R = R₁ … Rₙ. As R₁ and Rₙ are free, R is limited by the
angle of a₁ and R aₙ alone: the distance of the ends of a chain of great arcs γᵢ on the unit sphere. It takes all values
of [0, π] for three axes only if neighbours are perpendicular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array, measure_angle
from ..results import Value
from ..tolerances import DIRECTION_SINE_TOL

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class TiltLimit(Value):
    """Tilt limit of a spherical joint that stands for rotations about axes through its centre: the angle of the
    ``first``, fixed in the predecessor, and the ``last``, fixed in the successor, unit vectors at the zero
    configuration, is between ``low`` and ``high`` (rad). If ``count`` is three, the axes lie in a plane at an end of
    the interval, and the rotations lose a dof; with more axes, only at an end that limits them."""

    first: Array
    last: Array
    low: float
    high: float
    count: int = 3

    @classmethod
    def of(cls, first: Array, last: Array, interval: Interval, count: int) -> TiltLimit | None:
        """Return the tilt limit; None if every rotation can be made, with three dof at all of them."""
        wrist = cls(first, last, *interval, count)
        return wrist if wrist.is_limiting or count == 3 else None

    @property
    def is_limiting(self) -> bool:
        """There are rotations that cannot be made."""
        return self.lower is not None or self.upper is not None

    @property
    def lower(self) -> float | None:
        """Lower end (rad), if it limits anything."""
        return self.low if self.low > DIRECTION_SINE_TOL else None

    @property
    def upper(self) -> float | None:
        """Upper end (rad), if it limits anything."""
        return self.high if self.high < np.pi - DIRECTION_SINE_TOL else None

    def turned(self) -> TiltLimit:
        """Return the tilt limit with predecessor and successor exchanged."""
        return TiltLimit(self.last, self.first, self.low, self.high, self.count)

    def carried(self, predecessor: Array, successor: Array) -> TiltLimit:
        """Return the tilt limit with its axes carried by two links rotated by these (3, 3)."""
        return TiltLimit(predecessor @ self.first, successor @ self.last, self.low, self.high, self.count)

    def margin(self) -> float:
        """Return the distance of the angle from the nearer end (rad); negative outside."""
        angle = measure_angle(self.first, self.last)
        return min(
            np.inf if self.lower is None else angle - self.lower, np.inf if self.upper is None else self.upper - angle
        )

    def flatness(self) -> float:
        """Return the distance of the angle from the nearer end at which the axes lie in a plane (rad)."""
        angle = measure_angle(self.first, self.last)
        ends = (self.low, self.high) if self.count == 3 else (self.lower, self.upper)
        return min((abs(angle - end) for end in ends if end is not None), default=np.inf)


def bound_arc_chain(one: Interval, gap: float, other: Interval) -> Interval:
    """Return the distances of the ends of three arcs on the unit sphere, end to end: one of a length in ``one``,
    ``gap``, one of a length in ``other``; two sides leave |a − b| ≤ c ≤ π − |π − a − b| to the third."""
    return _bound_third_side(_bound_third_side(one, (gap, gap)), other)


def _bound_third_side(a: Interval, b: Interval) -> Interval:
    low = max(a[0] - b[1], b[0] - a[1], 0.0)
    return low, np.pi - max(np.pi - a[1] - b[1], a[0] + b[0] - np.pi, 0.0)
