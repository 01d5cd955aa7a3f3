"""Rounding in a program's formulas: bounds of its numbers, and of their errors, for many boxes.

Every operation gives its exact result but for half a unit in the last place, sines and cosines but for four of them
(running errors: N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.3). An operation that a
compiler fuses with the next rounds less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..tolerances import SINE_ERROR, UNIT_ROUNDOFF
from .trace import Place, TracedFunction


@dataclass(frozen=True, eq=False)
class RoundedNumber:
    """Numbers (c,) between ``low`` and ``high``, each computed with at most some ``error``."""

    low: Array
    high: Array
    error: Array

    @classmethod
    def between(cls, low: Any, high: Any, error: Any = 0.0) -> RoundedNumber:
        """The bounds made wider by their own rounding."""
        slack = 4 * UNIT_ROUNDOFF * np.maximum(np.abs(low), np.abs(high))
        return cls(low - slack, high + slack, np.asarray(error * (1 + 16 * UNIT_ROUNDOFF)))

    @classmethod
    def of(cls, value: RoundedNumber | float) -> RoundedNumber:
        """Numbers, or a constant of the program."""
        return value if isinstance(value, RoundedNumber) else cls(*map(np.asarray, (value, value, 0.0)))

    @property
    def size(self) -> Array:
        """Bound of the computed number."""
        return np.maximum(np.abs(self.low), np.abs(self.high)) + self.error

    def __neg__(self) -> RoundedNumber:
        return RoundedNumber(-self.high, -self.low, self.error)

    def __add__(self, other: RoundedNumber | float) -> RoundedNumber:
        far = self.of(other)
        return self._make(self.low + far.low, self.high + far.high, self.error + far.error)

    def __sub__(self, other: RoundedNumber | float) -> RoundedNumber:
        return self + (-self.of(other))

    def __rsub__(self, other: float) -> RoundedNumber:
        return self.of(other) - self

    def __mul__(self, other: RoundedNumber | float) -> RoundedNumber:
        far = self.of(other)
        ends = np.array(np.broadcast_arrays(*(a * b for a in (self.low, self.high) for b in (far.low, far.high))))
        return self._make(ends.min(axis=0), ends.max(axis=0), self.size * far.error + far.size * self.error)

    __radd__, __rmul__ = __add__, __mul__

    def _make(self, low: Array, high: Array, error: Array) -> RoundedNumber:
        """The result of an operation whose arguments make for an error."""
        found = self.between(low, high, error)
        return self.between(low, high, error + 2 * UNIT_ROUNDOFF * found.size)

    def sin(self) -> RoundedNumber:
        """Their sines: as far from that of the middle as the ends are, at most."""
        return self._apply(np.sin)

    def cos(self) -> RoundedNumber:
        """Their cosines."""
        return self._apply(np.cos)

    def _apply(self, function: Any) -> RoundedNumber:
        middle, half = function((self.low + self.high) / 2), (self.high - self.low) / 2 + SINE_ERROR
        return self.between(np.maximum(middle - half, -1.0), np.minimum(middle + half, 1.0), self.error + SINE_ERROR)


def round_function(
    function: TracedFunction, q: Sequence[RoundedNumber], x: Sequence[RoundedNumber]
) -> Mapping[tuple[str, Place], RoundedNumber]:
    """Return bounds of the numbers that a function of equations stores, at inputs between bounds."""
    names: dict[str, Any] = {"q": q, "x": x, "sin": RoundedNumber.sin, "cos": RoundedNumber.cos, "__builtins__": {}}
    exec("\n".join(f"{name} = {text}" for name, text in function.statements), names)
    return {
        (array, place): RoundedNumber.of(names[value] if value in names else float(value))
        for array, place, value in function.stores
    }
