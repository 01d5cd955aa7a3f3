"""Affine forms: quantities that depend on n noise symbols ε in [−1, 1], as c + s · ε ± r, for many boxes at once.

What is first order in ε is kept exactly, so that a formula's enclosure is off by second order only (J. Stolfi, L. H. de
Figueiredo, Self-Validated Numerical Methods, 1997). Every rounding of the floats is added to r; sines come from balls.
Arrays of floats that are met count as a geometry's numbers, known to ``tolerances.CHAIN_ROUNDING`` except 0 and ±1;
single numbers count as exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..tolerances import AFFINE_ROUNDING, CHAIN_ROUNDING
from .vectors import Array, cross


class AffineForms:
    """Forms v[0] + Σ v[k] ε_k ± r: ``v`` has shape (n + 1, …), ``r`` (…). Of an angle ``bend`` may be the symbol that
    stands for what is of second order in its sine and cosine, so that this is the same wherever the angle occurs."""

    __array_ufunc__ = None

    def __init__(self, v: Array, r: Array, bend: int | None = None) -> None:
        self.v, self.r, self.bend = v, r, bend

    @property
    def spread(self) -> Array:
        """How far a value can be from the centre v[0], an upper bound (…)."""
        return (np.abs(self.v[1:]).sum(axis=0) + self.r) * (1 + AFFINE_ROUNDING)

    @property
    def size(self) -> Array:
        """An upper bound of |value| (…)."""
        return (np.abs(self.v).sum(axis=0) + self.r) * (1 + AFFINE_ROUNDING)

    def __getitem__(self, index: Any) -> AffineForms:
        where = index if isinstance(index, tuple) else (index,)
        if where[0] is not Ellipsis:
            raise IndexError("the first dimension counts boxes")
        return AffineForms(self.v[index], self.r[index])

    def __neg__(self) -> AffineForms:
        return AffineForms(-self.v, self.r)

    def __add__(self, other: Any) -> AffineForms:
        other = self._like(other)
        v = self.v + other.v
        return _rounded(v, self.r + other.r, np.abs(v).sum(axis=0))

    __radd__ = __add__

    def __sub__(self, other: Any) -> AffineForms:
        return self + (-other)

    def __rsub__(self, other: Any) -> AffineForms:
        return (-self) + other

    def __mul__(self, other: Any) -> AffineForms:
        if isinstance(other, int | float):
            return _rounded(self.v * other, self.r * abs(other), np.abs(self.v).sum(axis=0) * abs(other))
        if not isinstance(other, AffineForms):
            k = np.asarray(other)
            size = np.abs(self.v).sum(axis=0)
            return _rounded(self.v * k, self.r * np.abs(k) + _doubt(k) * (size + self.r), size * np.abs(k))
        a, b = self.v, other.v
        slopes_a, slopes_b = np.abs(a[1:]).sum(axis=0), np.abs(b[1:]).sum(axis=0)
        middle_a, middle_b = np.abs(a[0]), np.abs(b[0])
        v = a * b[0] + b * a[0]
        both = a[1:] * b[1:]
        # ε_k² is ½ ± ½, other products of two symbols are 0 ± 1
        v[0] = a[0] * b[0] + 0.5 * both.sum(axis=0)
        r = ((middle_a + slopes_a) * other.r + (middle_b + slopes_b) * self.r + self.r * other.r
             + slopes_a * slopes_b - 0.5 * np.abs(both).sum(axis=0))
        return _rounded(v, r, (middle_a + slopes_a) * (middle_b + slopes_b))

    __rmul__ = __mul__

    @property
    def low(self) -> Array:
        """A lower bound of the values (…)."""
        return self.v[0] - self.spread - AFFINE_ROUNDING * np.abs(self.v[0])

    @property
    def high(self) -> Array:
        """An upper bound of the values (…)."""
        return self.v[0] + self.spread + AFFINE_ROUNDING * np.abs(self.v[0])

    def scaled(self, factor: float, doubt: float) -> AffineForms:
        """The values times a number that is known to ``doubt``."""
        size = np.abs(self.v).sum(axis=0)
        return _rounded(self.v * factor, self.r * abs(factor) + doubt * (size + self.r), size * abs(factor))

    def shifted(self, term: float, doubt: float) -> AffineForms:
        """The values and a number that is known to ``doubt``."""
        v = self.v.copy()
        v[0] += term
        return _rounded(v, self.r + doubt, np.abs(v[0]))

    def inverse(self) -> AffineForms:
        """1 / value: on [a, b], a > 0, it lies between its secant and the tangent of the same slope −1 / (a b). Not
        finite where the values may vanish."""
        sign = np.sign(self.v[0])
        a, b = np.abs(self.v[0]) - self.spread, np.abs(self.v[0]) + self.spread
        with np.errstate(all="ignore"):
            a = np.where(a > AFFINE_ROUNDING * b, a, np.nan)
            top, least = 1 / a + 1 / b, 2 / np.sqrt(a * b)
            return self._along(-1 / (a * b), sign * (top + least) / 2, np.abs(top - least) / 2, top)

    def sqrt(self) -> AffineForms:
        """√value for those values that are not negative: on [a, b] it lies between its secant and the tangent of the
        same slope 1 / (√a + √b). No number where all are negative."""
        with np.errstate(all="ignore"):
            a, b = np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(self.high)
            both = a + b
            least, top = a * b / both, both / 4
            return self._along(1 / both, (top + least) / 2, (top - least) / 2, both)

    def _along(self, slope: Array, shift: Array, off: Array, size: Array) -> AffineForms:
        """slope · values + shift ± off, for results of a ``size``."""
        v = self.v * slope
        v[0] += shift
        return _rounded(v, self.r * np.abs(slope) + off, 4 * (size + np.abs(v).sum(axis=0)))

    def padded(self, count: int) -> AffineForms:
        """The same with more symbols, on which it does not depend."""
        return AffineForms(np.concatenate([self.v, np.zeros((count - len(self.v), *self.r.shape))]), self.r)

    def sum(self, axis: int = -1) -> AffineForms:
        """The sum along one of the last dimensions."""
        return _rounded(self.v.sum(axis=axis), self.r.sum(axis=axis), np.abs(self.v).sum(axis=0).sum(axis=axis))

    def sines(self) -> tuple[AffineForms, AffineForms]:
        """Sine and cosine: with d = s · ε ± r and |d| ≤ w, cos d is 1 − w²/4 + ε w²/4 for some ε, and sin d is
        d ± w³/6."""
        sine, cosine = _sines(self.v[0])
        w = self.spread
        bend, skew = w * w / 4, w**3 / 6
        found = []
        for value, rate in ((sine, cosine), (cosine, -sine)):
            v = self.v * rate
            v[0] = value * (1 - bend)
            r = np.abs(rate) * (self.r + skew)
            if self.bend is None:
                r = r + np.abs(value) * bend
            else:
                v[self.bend] += value * bend
            found.append(_rounded(v, r + AFFINE_ROUNDING, 1 + w))
        return found[0], found[1]

    def _like(self, other: Any) -> AffineForms:
        """Another number, or array of them, as forms that are constant."""
        if isinstance(other, AffineForms):
            return other
        k = np.asarray(other, dtype=float)
        k = k.reshape((1,) * (self.r.ndim - k.ndim) + k.shape)
        v = np.zeros((len(self.v), *k.shape))
        v[0] = k
        return AffineForms(v, np.zeros(k.shape) if isinstance(other, int | float) else _doubt(k))


def affine(centre: Array, slopes: Array, radius: Array, bend: int | None = None) -> AffineForms:
    """Forms of floats that are exact: centres (…), slopes (…, n), radii (…)."""
    return AffineForms(np.concatenate([centre[None], np.moveaxis(slopes, -1, 0)]), radius, bend)


def stacked(parts: Sequence[Any], axis: int = -1) -> Any:
    """Numbers or forms put together along a new dimension, the last or (−2) the last but one."""
    like = next((each for each in parts if isinstance(each, AffineForms)), None)
    if like is None:
        return np.stack(np.broadcast_arrays(*parts), axis=axis)
    every = [like._like(each) for each in parts]
    return AffineForms(np.stack(np.broadcast_arrays(*(each.v for each in every)), axis=axis),
                       np.stack(np.broadcast_arrays(*(each.r for each in every)), axis=axis))


def crossed(a: Any, b: Any) -> Any:
    """a × b along the last dimension."""
    if not isinstance(a, AffineForms) and not isinstance(b, AffineForms):
        return cross(a, b)
    (a0, a1, a2), (b0, b1, b2) = ([x[..., k] for k in range(3)] for x in (a, b))
    return stacked([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def dotted(a: Any, b: Any) -> Any:
    """a · b along the last dimension."""
    return (a * b).sum(-1)


def combined(Y: Array, forms: AffineForms) -> AffineForms:
    """Y F for exact floats Y (c, p, k) and forms F (c, k) or (c, k, m)."""
    flat = forms.r.ndim == 2
    v, r = (forms.v[..., None], forms.r[..., None]) if flat else (forms.v, forms.r)
    size = np.abs(Y) @ np.abs(v).sum(axis=0)
    found = _rounded(Y @ v, np.abs(Y) @ r, size * Y.shape[-1])
    return AffineForms(found.v[..., 0], found.r[..., 0]) if flat else found


def _rounded(v: Array, r: Array, size: Array) -> AffineForms:
    """Forms with the rounding of numbers of a ``size`` added to their radius."""
    return AffineForms(v, (r + AFFINE_ROUNDING * size) * (1 + AFFINE_ROUNDING))


def _doubt(k: Array) -> Array:
    """How far a geometry's numbers may be from what is meant."""
    size = np.abs(k)
    return np.where((size == 0) | (size == 1), 0.0, CHAIN_ROUNDING * (1 + size))


def _sines(x: Array) -> tuple[Array, Array]:
    """Sines and cosines of floats, to half a unit in the last place."""
    from flint import arb

    pairs = [arb(v).sin_cos() for v in x.ravel().tolist()]
    sine, cosine = (np.array([float(pair[k].mid()) for pair in pairs]).reshape(x.shape) for k in (0, 1))
    return sine, cosine
