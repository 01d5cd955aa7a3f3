"""Krawczyk's operator: existence and uniqueness of a solution of polynomials of degree two in each unknown.

K(X) = m − Y F(m) + (1 − Y J(X)) (X − m), with m the middle of the box X and Y about J(m)⁻¹: if K(X) lies in the
interior of X, then X holds exactly one solution, and K(X) holds it. With balls for coefficients this holds for every
choice of coefficients in the balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...budgets import FINEST_BOX

ATTEMPTS = 3
"""Boxes that are tried, each wider than the one before where that one was too narrow."""


class Polynomial(Protocol):
    """What the operator asks of an equation in n unknowns."""

    def value(self, x: Sequence[Any]) -> Any:
        """The value at balls x (n,)."""
    def slopes(self, x: Sequence[Any]) -> Sequence[Any]:
        """The derivative by each unknown (n,) at balls x (n,)."""


class Equation(NamedTuple):
    """Σ table[a, b] x_iᵃ x_jᵇ = 0; ``table`` has shape (3, 3); integers or balls."""

    table: Any
    i: int
    j: int

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return _powers(x[self.i]) @ self.table @ _powers(x[self.j])

    def slopes(self, x: Sequence[Any]) -> list[Any]:
        """The derivative by each unknown at x."""
        left, right = _powers(x[self.i]), _powers(x[self.j])
        row: list[Any] = [0.0] * len(x)
        row[self.i] = _slopes(x[self.i]) @ (self.table @ right)
        row[self.j] = row[self.j] + left @ self.table @ _slopes(x[self.j])
        return row


class Quadric(NamedTuple):
    """xᵀ A x = 0 with x = (1, x₁ … xₙ); ``A`` has shape (n + 1, n + 1); integers or balls."""

    A: Any

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        ends = np.array([1, *x], dtype=object)
        return ends @ self.A @ ends

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        ends = np.array([1, *x], dtype=object)
        return (self.A @ ends + ends @ self.A)[1:]


def krawczyk(equations: Sequence[Polynomial], start: Sequence[Any]) -> list[Any] | None:
    """A box about the balls ``start``, all real or all complex, that is proved to hold exactly one solution, for all
    coefficients in their balls.

    None where the proof fails, as it does at a double solution.
    """
    from flint import acb, arb

    real = isinstance(start[0], arb)
    middle = [x.mid() for x in start]
    slope = np.array(_jacobian(equations, middle), dtype=float if real else complex)
    scale = np.abs(slope).max(axis=1, initial=0.0)
    if not np.all(scale > 0) or not np.all(np.isfinite(slope)):
        return None
    try:
        inverse = np.linalg.inv(slope / scale[:, None]) / scale
    except np.linalg.LinAlgError:
        return None
    Y = np.array([[(arb if real else acb)(v) for v in row] for row in inverse.tolist()], dtype=object)
    step = Y @ np.array([equation.value(middle) for equation in equations], dtype=object)
    least = [FINEST_BOX * (1.0 + float(abs(m))) for m in middle]
    radii = [4.0 * float(s.abs_upper()) + tiny for s, tiny in zip(step, least, strict=True)]
    for _ in range(ATTEMPTS):
        offsets = np.array([arb(0, r) if real else acb(arb(0, r), arb(0, r)) for r in radii], dtype=object)
        slopes = np.array(_jacobian(equations, [m + d for m, d in zip(middle, offsets, strict=True)]), dtype=object)
        image = -step + (np.eye(len(middle), dtype=int) - Y @ slopes) @ offsets
        if all(d.contains_interior(k) for d, k in zip(offsets, image, strict=True)):
            return [m + k for m, k in zip(middle, image, strict=True)]
        radii = [max(r, 4.0 * float(k.abs_upper())) for r, k in zip(radii, image, strict=True)]
    return None


def _powers(x: Any) -> Any:
    return np.array([1, x, x * x], dtype=object)


def _slopes(x: Any) -> Any:
    return np.array([0, 1, 2 * x], dtype=object)


def _jacobian(equations: Sequence[Polynomial], x: Sequence[Any]) -> list[Sequence[Any]]:
    return [equation.slopes(x) for equation in equations]
