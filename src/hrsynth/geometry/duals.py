"""Numbers with their rates: a formula on components gives its derivatives along some directions as well (forward
differentiation). Values and rates are anything that components are: floats, arrays, symbols of a tape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .components import cosine, sine, sqrt


@dataclass(frozen=True, eq=False)
class Dual:
    """A value and its rates, one for each direction."""

    value: Any
    rates: Sequence[Any]

    def _like(self, other: Any) -> Dual:
        return other if isinstance(other, Dual) else Dual(other, [0.0] * len(self.rates))

    def __add__(self, other: Any) -> Dual:
        other = self._like(other)
        return Dual(self.value + other.value, [a + b for a, b in zip(self.rates, other.rates, strict=True)])

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, [-a for a in self.rates])

    def __sub__(self, other: Any) -> Dual:
        other = self._like(other)
        return Dual(self.value - other.value, [a - b for a, b in zip(self.rates, other.rates, strict=True)])

    def __rsub__(self, other: Any) -> Dual:
        return self._like(other) - self

    def __mul__(self, other: Any) -> Dual:
        other = self._like(other)
        return Dual(
            self.value * other.value,
            [a * other.value + self.value * b for a, b in zip(self.rates, other.rates, strict=True)],
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        other = self._like(other)
        inverse = 1.0 / other.value
        ratio = self.value * inverse
        return Dual(ratio, [(a - ratio * b) * inverse for a, b in zip(self.rates, other.rates, strict=True)])

    def __rtruediv__(self, other: Any) -> Dual:
        return self._like(other) / self

    def sqrt(self) -> Dual:
        """Its square root."""
        root = sqrt(self.value)
        half = 0.5 / root
        return Dual(root, [a * half for a in self.rates])

    def sin(self) -> Dual:
        """Its sine."""
        rate = cosine(self.value)
        return Dual(sine(self.value), [a * rate for a in self.rates])

    def cos(self) -> Dual:
        """Its cosine."""
        rate = -sine(self.value)
        return Dual(cosine(self.value), [a * rate for a in self.rates])
