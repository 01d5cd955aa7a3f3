"""Krawczyk's operator: existence and uniqueness of a solution of polynomials of degree two in each unknown.

K(X) = m − Y F(m) + (1 − Y J(X)) (X − m), with m the middle of the box X and Y about J(m)⁻¹: if K(X) lies in the
interior of X, then X holds exactly one solution, and K(X) holds it. With balls for coefficients this holds for every
choice of coefficients in the balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

ATTEMPTS = 3
"""Boxes that are tried, each wider than the one before."""

FINEST = 2.0 ** -100
"""Radius of the smallest box that is tried, relative to 1 plus the unknown."""


class Equation(NamedTuple):
    """Σ table[a, b] x_iᵃ x_jᵇ = 0; ``table`` has shape (3, 3); integers or balls."""

    table: Any
    i: int
    j: int


def krawczyk(equations: Sequence[Equation], start: Sequence[Any]) -> list[Any] | None:
    """A box about the balls ``start`` that is proved to hold exactly one solution, for all coefficients in their balls.

    None where the proof fails, as it does at a double solution.
    """
    from flint import arb

    middle = [x.mid() for x in start]
    slope = np.array(_jacobian(equations, middle), dtype=float)
    scale = np.abs(slope).max(axis=1, initial=0.0)
    if not np.all(scale > 0) or not np.all(np.isfinite(slope)):
        return None
    try:
        inverse = np.linalg.inv(slope / scale[:, None]) / scale
    except np.linalg.LinAlgError:
        return None
    Y = np.array([[arb(float(v)) for v in row] for row in inverse], dtype=object)
    step = Y @ np.array(_values(equations, middle), dtype=object)
    least = [FINEST * (1.0 + abs(float(m))) for m in middle]
    radii = [4.0 * float(s.abs_upper()) + tiny for s, tiny in zip(step, least, strict=True)]
    for _ in range(ATTEMPTS):
        offsets = np.array([arb(0, r) for r in radii], dtype=object)
        slopes = np.array(_jacobian(equations, [m + d for m, d in zip(middle, offsets, strict=True)]), dtype=object)
        image = -step + (np.eye(len(middle), dtype=int) - Y @ slopes) @ offsets
        if all(d.contains_interior(k) for d, k in zip(offsets, image, strict=True)):
            return [m + k for m, k in zip(middle, image, strict=True)]
        radii = [4.0 * max(r, float(k.abs_upper())) for r, k in zip(radii, image, strict=True)]
    return None


def _powers(x: Any) -> Any:
    return np.array([1, x, x * x], dtype=object)


def _slopes(x: Any) -> Any:
    return np.array([0, 1, 2 * x], dtype=object)


def _values(equations: Sequence[Equation], x: Sequence[Any]) -> list[Any]:
    powers = [_powers(each) for each in x]
    return [powers[i] @ table @ powers[j] for table, i, j in equations]


def _jacobian(equations: Sequence[Equation], x: Sequence[Any]) -> list[list[Any]]:
    powers, slopes = [_powers(each) for each in x], [_slopes(each) for each in x]
    rows = []
    for table, i, j in equations:
        row = [0.0] * len(x)
        half = table @ powers[j]
        row[i] = row[i] + slopes[i] @ half
        row[j] = row[j] + powers[i] @ table @ slopes[j]
        rows.append(row)
    return rows
