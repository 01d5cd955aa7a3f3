"""Vectors of numbers or of balls: the same formulas for float arrays (..., 3) and for object arrays of ``flint.arb``.

A ball encloses a real number; a formula on balls encloses its values on all numbers in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .vectors import Array, dot

Field = NDArray[Any]
"""Floats, or objects that are balls."""


def normalise_balls(v: Field) -> Field:
    """v / |v| along the last axis."""
    return np.asarray(v / np.sqrt(dot(v, v))[..., None])


def enclose_intervals(low: Sequence[float] | Array, high: Sequence[float] | Array) -> Field:
    """Balls that enclose the intervals from ``low`` to ``high``, (n,)."""
    from flint import arb

    return np.array(
        [arb(a).union(arb(b)) for a, b in zip(map(float, low), map(float, high), strict=True)], dtype=object
    )


def enclose_around(x: Array, radius: float) -> Field:
    """Balls of a radius around numbers, in the same shape."""
    from flint import arb

    return np.array([arb(float(v), radius) for v in np.ravel(x)], dtype=object).reshape(np.shape(x))


def make_ball_jets(boxes: Field) -> Field:
    """Balls as variables: a formula on them gives its value and, by Taylor's first order, its derivative."""
    from flint import arb_series

    found = np.empty(len(boxes), dtype=object)
    for i, box in enumerate(boxes):
        found[i] = arb_series([box, 1], 2)
    return found


def evaluate_mean_value_form(middle: Field, jet: Field, reach: Field) -> Field:
    """Mean value form: f(m) + f'(X) (X − m) encloses f on the balls X, for f at the middles m, jets of f, and X − m."""
    slopes = np.array([x[1] for x in jet.flat], dtype=object).reshape(jet.shape)
    return np.asarray(middle + (slopes.T * reach).T)


def widen(v: Field, radius: float) -> Field:
    """Balls with a larger radius; floats as they are."""
    if v.dtype != object:
        return v
    from flint import arb

    return np.asarray(v + arb(0, radius))


def check_positive(v: Field) -> NDArray[np.bool_]:
    """Return True where a number, or every number in a ball, is positive (never where it is not a number)."""
    if v.dtype != object:
        return np.asarray(v > 0)
    return np.array([bool(x > 0) for x in v.flat], dtype=bool).reshape(v.shape)


def check_finite(v: Field) -> NDArray[np.bool_]:
    """Return True where a ball is bounded (formulas on it had no pole in it)."""
    return np.array([getattr(x, "is_finite", lambda: True)() for x in v], dtype=bool)


def bound_norm_below(v: Field) -> Array:
    """A lower bound of |v|, (n,): 0 where a ball holds zero or is no number."""
    if v.dtype != object:
        return np.abs(v)
    found = [float(x.abs_lower()) if x.is_finite() else 0.0 for x in v.flat]
    return np.nextafter(np.array(found), 0.0).reshape(v.shape)
