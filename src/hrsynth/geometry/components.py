"""Vectors as lists of components: the same formulas for numbers, arrays of them, balls and symbols of a tape.

A symmetric matrix is given by its six entries xx, yy, zz, xy, xz, yz.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Components = Sequence[Any] | NDArray[Any]


def sqrt(x: Any) -> Any:
    """√x."""
    return x.sqrt() if hasattr(x, "sqrt") else np.sqrt(x)


def sine(x: Any) -> Any:
    """sin x."""
    return x.sin() if hasattr(x, "sin") else np.sin(x)


def cosine(x: Any) -> Any:
    """cos x."""
    return x.cos() if hasattr(x, "cos") else np.cos(x)


def arctan2(y: Any, x: Any) -> Any:
    """The angle of (x, y)."""
    return y.atan2(x) if hasattr(y, "atan2") else np.arctan2(y, x)


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where a condition holds, ``no`` elsewhere."""
    return condition.select(yes, no) if hasattr(condition, "select") else np.where(condition, yes, no)


def dot(a: Components, b: Components) -> Any:
    """a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Components, b: Components) -> list[Any]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def plus(a: Components, b: Components) -> list[Any]:
    """a + b."""
    return [x + y for x, y in zip(a, b, strict=True)]


def minus(a: Components, b: Components) -> list[Any]:
    """a − b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def scale(factor: Any, a: Components) -> list[Any]:
    """The vector times a number."""
    return [factor * x for x in a]


def normalise(a: Components) -> list[Any]:
    """a / |a|."""
    size = sqrt(dot(a, a))
    return [x / size for x in a]


def combine_columns(x: Components, ways: NDArray[Any], number: Callable[[Any], Any]) -> Components:
    """Σ x_i w_i of the columns w_i of ``ways``, which ``number`` makes components."""
    found: Components = [0.0, 0.0, 0.0]
    for i, (each, way) in enumerate(zip(x, ways.T, strict=True)):
        part = scale(each, number(way))
        found = plus(found, part) if i else part
    return found


def transform_vector(R: Components, b: Components) -> list[Any]:
    """R b of a matrix given by its nine entries, row by row."""
    return [dot(R[3 * i : 3 * i + 3], b) for i in range(3)]


def cayley(gamma: Components, v: Components) -> list[Any]:
    """v turned by tan(θ/2) = |γ| about γ: v + 2 (γ × v + γ × (γ × v)) / (1 + γ·γ)."""
    w = cross(gamma, v)
    return plus(v, scale(2.0 / (dot(gamma, gamma) + 1.0), plus(w, cross(gamma, w))))


def spin(gamma: Components, rate: Components, one_axis: bool) -> list[Any]:
    """Angular velocity 2 (γ̇ + γ × γ̇) / (1 + γ·γ) of what γ turns (:func:`cayley`), γ × γ̇ = 0 about one axis."""
    return scale(2.0 / (dot(gamma, gamma) + 1.0), rate if one_axis else plus(rate, cross(gamma, rate)))


def times(B: Components, w: Components) -> list[Any]:
    """B w of a symmetric matrix."""
    x, y, z = w
    return [B[0] * x + B[3] * y + B[4] * z, B[3] * x + B[1] * y + B[5] * z, B[4] * x + B[5] * y + B[2] * z]


def build_tangents(v: Components) -> tuple[list[Any], list[Any]]:
    """Two unit vectors that make a right-handed triad with a unit vector."""
    x, y, z = v
    flat = abs(z) < 0.7
    e = normalise([where(flat, -y, 0.0), where(flat, x, -z), where(flat, 0.0, y)])
    return e, cross(v, e)
