"""Krawczyk's operator, for balls and for affine forms.

K(X) = m − Y F(m) + (1 − Y J(X)) (X − m), with m the middle of the box X and Y about J(m)⁻¹. If K(X) lies in the
interior of X, then X holds exactly one zero of F, and K(X) holds it. With intervals for the coefficients of F this
holds for every choice of coefficients in them (Neumaier, Interval Methods for Systems of Equations, 1990, 5.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from ..geometry.affine import AffineForms, combine
from ..geometry.vectors import Array, times
from ..tolerances import AFFINE_ROUNDING

FINEST_BOX = 2.0**-100
"""Radius of the smallest box around a solution, relative to 1 plus the unknown."""

ENCLOSURE_ATTEMPTS_MAX = 3
"""Boxes that are tried, each wider than the one before if that one was too narrow."""


class Polynomial(Protocol):
    """Equation in n unknowns, as the Krawczyk operator needs it."""

    def value(self, x: Sequence[Any]) -> Any:
        """The value at balls x (n,)."""

    def slopes(self, x: Sequence[Any]) -> Sequence[Any]:
        """The derivative by each unknown (n,) at balls x (n,)."""


def enclose_zero(equations: Sequence[Polynomial], start: Sequence[Any]) -> list[Any] | None:
    """Return a box about balls, all real or all complex, that is proved to hold exactly one zero, for all coefficients
    in their balls; None where the proof fails, as it does at a double zero.

    Parameters
    ----------
    equations
        As many as there are unknowns, n.
    start
        Balls (n,) about the zero that is expected.
    """
    from flint import acb, arb

    real = isinstance(start[0], arb)
    middle = [x.mid() for x in start]
    slope = np.array(_compute_jacobian(equations, middle), dtype=float if real else complex)
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
    for _ in range(ENCLOSURE_ATTEMPTS_MAX):
        offsets = np.array([arb(0, r) if real else acb(arb(0, r), arb(0, r)) for r in radii], dtype=object)
        slopes = np.array(
            _compute_jacobian(equations, [m + d for m, d in zip(middle, offsets, strict=True)]), dtype=object
        )
        image = -step + (np.eye(len(middle), dtype=int) - Y @ slopes) @ offsets
        if all(d.contains_interior(k) for d, k in zip(offsets, image, strict=True)):
            return [m + k for m, k in zip(middle, image, strict=True)]
        radii = [max(r, 4.0 * float(k.abs_upper())) for r, k in zip(radii, image, strict=True)]
    return None


def _compute_jacobian(equations: Sequence[Polynomial], x: Sequence[Any]) -> list[Sequence[Any]]:
    return [equation.slopes(x) for equation in equations]


def bound_contraction(Y: Array, J: AffineForms) -> Array:
    """Return bounds (c, n, n) of |1 − Y J|, entry by entry, for matrices Y (c, n, n) and slopes J (c, n, n)."""
    return np.asarray((np.eye(J.r.shape[-1]) - combine(Y, J)).size)


def bound_image(step: Array, contraction: Array, radius: Array) -> Array:
    """Return how far K(X) reaches from m: bounds (c, n) of |Y F(m)| + |1 − Y J(X)| r, rounded up.

    Where this is less than ``radius``, the box of that radius holds exactly one zero.

    Parameters
    ----------
    step
        Bounds (c, n) of |Y F(m)|.
    contraction
        Bounds (c, n, n) of |1 − Y J(X)|.
    radius
        Half edges (c, n) of X.
    """
    return np.asarray((step + times(contraction, radius)) * (1 + AFFINE_ROUNDING))
