"""Affine forms: quantities that depend on n noise symbols ε in [−1, 1], as c + s · ε ± r, for many boxes at once.

What is first order in ε is kept exactly, so that a formula's enclosure is off by second order only (J. Stolfi, L. H. de
Figueiredo, Self-Validated Numerical Methods, 1997). Every rounding of the floats is added to r. Arrays of floats that
are met count as a geometry's numbers, known to ``tolerances.CHAIN_ROUNDING`` except 0 and ±1; single numbers count as
exact.

The arithmetic of sums of slopes and of radii is written once, in functions of numbers: of arrays here, of one box after
the other where :mod:`..equations.box_machine` has them compiled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from ..tolerances import AFFINE_ROUNDING, CHAIN_ROUNDING
from .vectors import Array, cross

Numbers = TypeVar("Numbers", Array, Any)
HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624871116645580e-21)
"""π/2 as a sum: the first two have 33 bits each, so that products with whole numbers below 2²⁰ are exact."""
EXACT_SINE_ANGLE_MAX_RAD = 1e6
"""Angles above which sines come from balls: whole quarters of a turn are below 2²⁰ up to here."""
SINE_SERIES = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(9))
COSINE_SERIES = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(10))


class AffineForms:
    """Forms v[0] + Σ v[k] ε_k ± r: ``v`` has shape (n + 1, …), ``r`` (…). Of an angle ``bend`` may be the symbol that
    stands for what is of second order in its sine and cosine, so that this is the same wherever the angle occurs."""

    __array_ufunc__ = None

    def __init__(self, v: Array, r: Array, bend: int | None = None) -> None:
        self.v, self.r, self.bend = v, r, bend

    @property
    def spread(self) -> Array:
        """Upper bound (…) of the distance of a value from the centre v[0]."""
        return spread(np.abs(self.v[1:]).sum(axis=0), self.r)

    @property
    def size(self) -> Array:
        """Upper bound of |value| (…)."""
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
        return _add_rounding(v, self.r + other.r, np.abs(v).sum(axis=0))

    __radd__ = __add__

    def __sub__(self, other: Any) -> AffineForms:
        return self + (-other)

    def __rsub__(self, other: Any) -> AffineForms:
        return (-self) + other

    def __mul__(self, other: Any) -> AffineForms:
        if isinstance(other, int | float):
            return _add_rounding(self.v * other, self.r * abs(other), np.abs(self.v).sum(axis=0) * abs(other))
        if not isinstance(other, AffineForms):
            k = np.asarray(other)
            size = np.abs(self.v).sum(axis=0)
            return _add_rounding(
                self.v * k, self.r * np.abs(k) + _bound_input_error(k) * (size + self.r), size * np.abs(k)
            )
        a, b = self.v, other.v
        v, both = a * b[0] + b * a[0], a[1:] * b[1:]
        # ε_k² is ½ ± ½, other products of two symbols are 0 ± 1
        v[0] = a[0] * b[0] + 0.5 * both.sum(axis=0)
        slopes_a, slopes_b, shared = (np.abs(each).sum(axis=0) for each in (a[1:], b[1:], both))
        return AffineForms(v, bound_product(a[0], slopes_a, self.r, b[0], slopes_b, other.r, shared))

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
        return AffineForms(self.v * factor, bound_scaled(np.abs(self.v).sum(axis=0), self.r, factor, doubt))

    def shifted(self, term: float, doubt: float) -> AffineForms:
        """The values and a number that is known to ``doubt``."""
        v = self.v.copy()
        v[0] += term
        return _add_rounding(v, self.r + doubt, np.abs(v[0]))

    def inverse(self) -> AffineForms:
        """1 / value; not finite where the values may vanish."""
        with np.errstate(all="ignore"):
            return self._along(*bound_inverse(self.v[0], self.spread))

    def sqrt(self) -> AffineForms:
        """√value for those values that are not negative; no number where all are negative."""
        with np.errstate(all="ignore"):
            return self._along(*bound_root(self.v[0], self.spread))

    def _along(self, slope: Array, shift: Array, off: Array, size: Array) -> AffineForms:
        """slope · values + shift ± off, for results of a ``size``."""
        v = self.v * slope
        v[0] += shift
        return AffineForms(v, bound_line(self.r, slope, off, size, np.abs(v).sum(axis=0)))

    def padded(self, count: int) -> AffineForms:
        """Return the forms with more symbols, on which they do not depend."""
        return AffineForms(np.concatenate([self.v, np.zeros((count - len(self.v), *self.r.shape))]), self.r)

    def transposed(self) -> AffineForms:
        """Return the forms with the last two dimensions transposed."""
        return AffineForms(np.swapaxes(self.v, -1, -2), np.swapaxes(self.r, -1, -2))

    def reshaped(self, *sides: int) -> AffineForms:
        """Return the forms with the last dimension laid out in several, or the last ones in one, of these sides."""
        kept = self.r.ndim - 1 if len(sides) > 1 else self.r.ndim - 2
        return AffineForms(
            self.v.reshape(*self.v.shape[: kept + 1], *sides), self.r.reshape(*self.r.shape[:kept], *sides)
        )

    def sum(self, axis: int = -1) -> AffineForms:
        """The sum along one of the last dimensions."""
        return _add_rounding(self.v.sum(axis=axis), self.r.sum(axis=axis), np.abs(self.v).sum(axis=0).sum(axis=axis))

    def sines(self) -> tuple[AffineForms, AffineForms]:
        """Sine and cosine."""
        sine, cosine = enclose_sines(self.v[0])
        w, found = self.spread, []
        for value, rate in ((sine, cosine), (cosine, -sine)):
            v = self.v * rate
            v[0], along, r = bound_sine(value, rate, self.r, w, self.bend is not None)
            if self.bend is not None:
                v[self.bend] += along
            found.append(AffineForms(v, r))
        return found[0], found[1]

    def _like(self, other: Any) -> AffineForms:
        """Another number, or array of them, as forms that are constant."""
        if isinstance(other, AffineForms):
            return other
        k = np.asarray(other, dtype=float)
        k = k.reshape((1,) * (self.r.ndim - k.ndim) + k.shape)
        v = np.zeros((len(self.v), *k.shape))
        v[0] = k
        return AffineForms(v, np.zeros(k.shape) if isinstance(other, int | float) else _bound_input_error(k))


def make_affine(centre: Array, slopes: Array, radius: Array, bend: int | None = None) -> AffineForms:
    """Forms of floats that are exact: centres (…), slopes (…, n), radii (…)."""
    # symbols first in memory too: sums over them then have one order
    return AffineForms(np.ascontiguousarray(np.concatenate([centre[None], np.moveaxis(slopes, -1, 0)])), radius, bend)


def stack(parts: Sequence[Any], axis: int = -1) -> Any:
    """Numbers or forms put together along a new dimension, the last or (−2) the last but one."""
    like = next((each for each in parts if isinstance(each, AffineForms)), None)
    if like is None:
        return np.stack(np.broadcast_arrays(*parts), axis=axis)
    every = [like._like(each) for each in parts]
    return AffineForms(
        np.stack(np.broadcast_arrays(*(each.v for each in every)), axis=axis),
        np.stack(np.broadcast_arrays(*(each.r for each in every)), axis=axis),
    )


def compute_cross_forms(a: Any, b: Any) -> Any:
    """a × b along the last dimension."""
    if not isinstance(a, AffineForms) and not isinstance(b, AffineForms):
        return cross(a, b)
    (a0, a1, a2), (b0, b1, b2) = ([x[..., k] for k in range(3)] for x in (a, b))
    return stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def compute_dot_forms(a: Any, b: Any) -> Any:
    """a · b along the last dimension."""
    return (a * b).sum(-1)


def combine(Y: Array, forms: AffineForms) -> AffineForms:
    """Y F for exact floats Y (c, p, k) and forms F (c, k) or (c, k, m)."""
    flat = forms.r.ndim == 2
    v, r = (forms.v[..., None], forms.r[..., None]) if flat else (forms.v, forms.r)
    size = np.abs(Y) @ np.abs(v).sum(axis=0)
    found = _add_rounding(Y @ v, np.abs(Y) @ r, size * Y.shape[-1])
    return AffineForms(found.v[..., 0], found.r[..., 0]) if flat else found


def compute_matrix_product(A: AffineForms, B: AffineForms) -> AffineForms:
    """A B for matrices of forms (…, k, m) and (…, m, n), of few symbols and columns (64 roundings are enough)."""
    a, b = A.v, B.v
    v, size_a, size_b = a @ b[0] + a[0] @ b, np.abs(a), np.abs(b)
    v[0] = a[0] @ b[0] + 0.5 * (a[1:] @ b[1:]).sum(axis=0)
    shared = (size_a[1:] @ size_b[1:]).sum(axis=0)
    slopes_a, slopes_b = size_a[1:].sum(axis=0), size_b[1:].sum(axis=0)
    whole_a, whole_b = size_a[0] + slopes_a, size_b[0] + slopes_b
    r = whole_a @ B.r + A.r @ (whole_b + B.r) + slopes_a @ slopes_b - 0.5 * shared
    return _add_rounding(v, r, 2 * whole_a @ whole_b)


def compute_right_product(forms: AffineForms, Z: Array) -> AffineForms:
    """F Z for forms F (…, k, m) and exact floats Z (…, m, n)."""
    size = np.abs(forms.v).sum(axis=0) @ np.abs(Z)
    return _add_rounding(forms.v @ Z, forms.r @ np.abs(Z), size * Z.shape[-2])


def _add_rounding(v: Array, r: Array, size: Array) -> AffineForms:
    """Forms with the rounding of numbers of a ``size`` added to their radius."""
    return AffineForms(v, round_radius(r, size))


def _bound_input_error(k: Array) -> Array:
    """Error of a geometry's numbers."""
    size = np.abs(k)
    return np.where((size == 0) | (size == 1), 0.0, CHAIN_ROUNDING * (1 + size))


def round_radius(r: Numbers, size: Numbers) -> Numbers:
    """A radius with the rounding of numbers of a ``size``."""
    return (r + AFFINE_ROUNDING * size) * (1 + AFFINE_ROUNDING)


def spread(slopes: Numbers, r: Numbers) -> Numbers:
    """Return the largest distance of a value from its centre: the sum of its ``slopes``' sizes and its radius."""
    return (slopes + r) * (1 + AFFINE_ROUNDING)


def bound_product(
    a: Numbers, slopes_a: Numbers, r_a: Numbers, b: Numbers, slopes_b: Numbers, r_b: Numbers, both: Numbers
) -> Numbers:
    """The radius of a product: of centres, sums of slopes' sizes, radii, and the sum of the sizes of products of slopes
    of the same symbol, half of which is in the centre."""
    size_a, size_b = abs(a) + slopes_a, abs(b) + slopes_b
    return round_radius(size_a * r_b + size_b * r_a + r_a * r_b + slopes_a * slopes_b - 0.5 * both, size_a * size_b)


def bound_scaled(size: Numbers, r: Numbers, factor: float, doubt: float) -> Numbers:
    """The radius of values, the sum of whose centre's and slopes' sizes is ``size``, times a number known to
    ``doubt``."""
    return round_radius(r * abs(factor) + doubt * (size + r), size * abs(factor))


def bound_inverse(centre: Numbers, width: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Slope, shift, error and size of a line near 1 / value: on [a, b], a > 0, it lies between its secant and the
    tangent of the same slope −1 / (a b). No numbers where the values may vanish."""
    sign, middle = np.sign(centre), abs(centre)
    a, b = middle - width, middle + width
    a = np.where(a > AFFINE_ROUNDING * b, a, np.nan)
    top, least = 1 / a + 1 / b, 2 / np.sqrt(a * b)
    return -1 / (a * b), sign * (top + least) / 2, abs(top - least) / 2, top


def bound_root(centre: Numbers, width: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return slope, shift, error and size of a line near √value, of those values that are not negative: on [a, b] it is
    between its secant and the tangent of the same slope 1 / (√a + √b). No numbers where all are negative."""
    off = AFFINE_ROUNDING * abs(centre)
    a, b = np.sqrt(np.maximum(centre - width - off, 0.0)), np.sqrt(centre + width + off)
    both = a + b
    least, top = a * b / both, both / 4
    return 1 / both, (top + least) / 2, (top - least) / 2, both


def bound_line(r: Numbers, slope: Numbers, off: Numbers, size: Numbers, found: Numbers) -> Numbers:
    """The radius of slope · values + shift ± off, for results of a ``size``, and ``found`` of centre and slopes."""
    return round_radius(r * abs(slope) + off, 4 * (size + found))


def bound_sine(value: Numbers, rate: Numbers, r: Numbers, w: Numbers, bent: bool) -> tuple[Numbers, Numbers, Numbers]:
    """Centre, what is along the symbol of the bend if it has one, and radius of a sine with a ``rate`` at the centre:
    with d = s · ε ± r and |d| ≤ w, cos d is 1 − w²/4 + ε w²/4 for some ε, and sin d is d ± w³/6."""
    bend = w * w / 4
    along = value * bend
    r = abs(rate) * (r + w * w * w / 6)
    return value * (1 - bend), along, round_radius((r if bent else r + abs(along)) + AFFINE_ROUNDING, 1 + w)


def reduce_sines(x: Numbers) -> tuple[Numbers, Numbers]:
    """Sine and cosine of angles up to ``EXACT_SINE_ANGLE_MAX_RAD``, each within 2⁻⁵⁰: the angle less whole quarters k
    of a turn, the first part of π/2 exactly and each of the others with one rounding (2⁻⁵⁴), then Taylor's series,
    which are off by 10⁻¹⁹, with a dozen roundings of numbers below 1 of which the last three count (W. J. Cody, W.
    Waite, Software Manual for the Elementary Functions, 1980, chapter 8)."""
    k = np.rint(x / HALF_PI[0])
    y = ((x - k * HALF_PI[0]) - k * HALF_PI[1]) - k * HALF_PI[2]
    z = y * y
    s, c = z * SINE_SERIES[8], z * COSINE_SERIES[9]
    for n in range(7, 0, -1):
        s, c = z * (SINE_SERIES[n] + s), z * (COSINE_SERIES[n + 1] + c)
    s, c = y + y * s, 1.0 + z * (COSINE_SERIES[1] + c)
    quarter = k - 4 * np.floor(k / 4)
    odd = quarter - 2 * np.floor(quarter / 2)
    return (
        (1 - 2 * np.floor(quarter / 2)) * ((1 - odd) * s + odd * c),
        (1 - quarter * (3 - quarter)) * ((1 - odd) * c + odd * s),
    )


def enclose_sines(x: Array) -> tuple[Array, Array]:
    """Sines and cosines of floats, each within 2⁻⁵⁰."""
    with np.errstate(invalid="ignore"):
        sine, cosine = reduce_sines(x)
    far = np.abs(x) > EXACT_SINE_ANGLE_MAX_RAD
    if np.any(far):
        from flint import arb

        pairs = [arb(v).sin_cos() for v in x[far].tolist()]
        sine[far], cosine[far] = ([float(pair[k].mid()) for pair in pairs] for k in range(2))
    return sine, cosine
