"""Where a loop with steady, exact directions comes to rest: a zero of its velocity that draws the state to itself.

That a command is small proves nothing: near a fold of a leg, where the law is stiff, an integrator's own errors keep it
from vanishing. So the zero itself is found, from the state and not from the time that a run was given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import LoopsNotClosed
from ..geometry.vectors import Array
from ..tolerances import INVERTED, NEAR_REST, NEUTRAL_GROWTH, REST_SLOPE, RESTED

ITERATIONS = 8
PERSISTS = 0.9
"""Part of an error that is left a time constant later where a rest is looked for: of one that vanishes, 1 / e is."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A zero y (n,) of ẏ, and the largest growth of a motion about it (1/s)."""

    y: Array
    growth: float


class Patience:
    """Tells when it is time to look for a rest: once a time constant, where the error persists."""

    def __init__(self, constant: float, time: float, size: float) -> None:
        self.constant, self._time, self._size = constant, time, size

    def over(self, time: float, size: float) -> bool:
        """Whether to look for a rest now."""
        if time - self._time < self.constant:
            return False
        persists = size > PERSISTS * self._size
        self._time, self._size = time, size
        return persists


def rest_near(rate: Callable[[Array], Array], y: Array) -> Rest | None:
    """The rest next to y (n,) by Newton's method on ẏ = rate(y); None where none was found near."""
    try:
        for _ in range(ITERATIONS):
            steps = REST_SLOPE * np.eye(len(y))
            J = np.array([(rate(y + each) - rate(y - each)) / (2 * REST_SLOPE) for each in steps]).T
            here = rate(y)
            step = np.asarray(np.linalg.lstsq(J, -here, rcond=INVERTED)[0], dtype=float)
            size = float(np.linalg.norm(step))
            # where J is singular, a velocity outside of its range goes on for ever
            if not size <= NEAR_REST or np.linalg.norm(here + J @ step) > NEUTRAL_GROWTH:
                return None
            y = y + step
            if size <= RESTED:
                return Rest(y, float(np.linalg.eigvals(J).real.max()))
    except LoopsNotClosed:
        return None
    return None
