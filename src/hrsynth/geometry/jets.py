"""Numbers with their first and second derivatives by a few variables: for many floats or affine forms at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..tolerances import AFFINE_ROUNDING
from .affine import AffineForms


class Jet:
    """A number (c,) with its gradient ``slope`` (c, n) and Hessian ``bend`` (c, n, n), n the number of variables."""

    __array_ufunc__ = None

    def __init__(self, value: Any, slope: Any, bend: Any) -> None:
        self.value, self.slope, self.bend = value, slope, bend

    @classmethod
    def variable(cls, value: Any, place: int, count: int) -> Jet:
        """The variable at a place among so many."""
        flat = value * 0.0
        return cls(
            value,
            flat[..., None] * np.zeros(count) + np.eye(count)[place],
            flat[..., None, None] * np.zeros((count, count)),
        )

    def __add__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.slope, self.bend)
        return Jet(self.value + other.value, self.slope + other.slope, self.bend + other.bend)

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Jet | float) -> Jet:
        return self + other * -1.0

    def __rsub__(self, other: float) -> Jet:
        return self * -1.0 + other

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            k = float(other)
            return Jet(self.value * k, self.slope * k, self.bend * k)
        a, b = self.value, other.value
        return Jet(
            a * b,
            self.slope * b[..., None] + other.slope * a[..., None],
            self.bend * b[..., None, None]
            + other.bend * a[..., None, None]
            + _add_transposed_product(self.slope, other.slope),
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return self * (1 / float(other))
        b = other.value
        f = b.inverse() if isinstance(b, AffineForms) else 1 / b
        square = f * f
        return self * other._map(f, -1.0 * square, f * square * 2.0)

    def sqrt(self) -> Jet:
        """Its square root."""
        root = self.value.sqrt() if isinstance(self.value, AffineForms) else np.sqrt(self.value)
        slope = (root * 2.0).inverse() if isinstance(root, AffineForms) else 1 / (2 * root)
        return self._map(root, slope, slope * slope * slope * -2.0)

    def _map(self, value: Any, first: Any, second: Any) -> Jet:
        """f of it, where f, f' and f'' are given."""
        return Jet(
            value,
            self.slope * first[..., None],
            self.bend * first[..., None, None] + _compute_tensor(self.slope, self.slope) * second[..., None, None],
        )


def turn(s: Jet, c: Jet) -> Jet:
    """The angle θ = atan2(s, c): ∇θ = (c ∇s − s ∇c) / r², r² = s² + c²."""
    size = s * s + c * c
    a, b = c / size, s / size
    slope = s.slope * a.value[..., None] - c.slope * b.value[..., None]
    bend = (
        s.bend * a.value[..., None, None]
        - c.bend * b.value[..., None, None]
        + _compute_tensor(s.slope, a.slope)
        - _compute_tensor(c.slope, b.slope)
    )
    return Jet(compute_jet_angle(s.value, c.value), slope, bend)


def compute_jet_angle(s: Any, c: Any) -> Any:
    """atan2(s, c); of forms an enclosure, not a number where both may vanish, or the angle may pass half a turn."""
    if not isinstance(s, AffineForms):
        return np.arctan2(s, c)
    far, near = np.hypot(s.spread, c.spread), np.hypot(s.v[0], c.v[0])
    middle = np.zeros_like(s.v)
    middle[0] = np.arctan2(s.v[0], c.v[0])
    with np.errstate(invalid="ignore", divide="ignore"):
        # asin x ≤ π x / 2
        doubt = np.where(far < near, np.pi / 2 * far / near, np.nan) + 4 * AFFINE_ROUNDING
        doubt = np.where(np.abs(middle[0]) + doubt < np.pi, doubt, np.nan)
    return AffineForms(middle, doubt)


def _compute_tensor(a: Any, b: Any) -> Any:
    return a[..., :, None] * b[..., None, :]


def _add_transposed_product(a: Any, b: Any) -> Any:
    return _compute_tensor(a, b) + _compute_tensor(b, a)
