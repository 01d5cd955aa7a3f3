"""Where poses of a platform are drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...budgets import REGION_WIDER
from ...geometry.so3 import exponential, logarithm
from ...geometry.vectors import Array
from .carriage import Carriage, Place


@dataclass(frozen=True, eq=False)
class Region:
    """Where poses are drawn: boxes of shifts along, and turns about, what the platform can do, around a pose."""

    carriage: Carriage
    centre: Place
    shift: Array
    turn: Array

    @classmethod
    def around(cls, carriage: Carriage, p: Array, R: Array) -> Region:
        """The region that is wider than known poses (n, 3), (n, 3, 3), around the first."""
        motion = carriage.motion
        shifts = (p - p[0]) @ motion.translations
        turns = logarithm(R @ R[0].T) @ motion.rotations
        middle = p[0] + motion.translations @ ((shifts.max(axis=0) + shifts.min(axis=0)) / 2)
        exact = cls(carriage, (middle, R[0]), np.ptp(shifts, axis=0) / 2,
                    np.max(np.abs(turns), axis=0, initial=0.0))
        return exact.wider(REGION_WIDER)

    def wider(self, factor: float) -> Region:
        """The region grown by a factor; no turn is longer than π."""
        limit = np.pi / max(1.0, np.sqrt(len(self.turn)))
        return replace(self, shift=factor * self.shift, turn=np.minimum(factor * self.turn, limit))

    def draw(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Random poses (count, 3), (count, 3, 3)."""
        motion = self.carriage.motion
        p = self.centre[0] + (rng.uniform(-1, 1, (count, len(self.shift))) * self.shift) @ motion.translations.T
        turns = (rng.uniform(-1, 1, (count, len(self.turn))) * self.turn) @ motion.rotations.T
        return p, exponential(turns) @ self.centre[1]
