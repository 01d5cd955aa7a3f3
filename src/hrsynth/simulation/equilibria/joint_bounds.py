"""Bounds of a leg's joint where the equation that closes the leg vanishes, in closed form.

Of an angle z the equation is A + B cos z + C sin z, zero at φ ± arccos(−A / h) with (B, C) = h (cos φ, sin φ); of a
travel z it is A + B z + z² / 2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...geometry.vectors import Array

BOX_EDGE_ROUNDING_TOL = 1e-12
"""Relative rounding of the edges of a box."""

Bounds = tuple[Array, Array]
"""Lower and upper bounds (c,)."""


def narrow_angle(coefficients: Sequence[Bounds], own: Bounds) -> Bounds:
    """The bounds ``own`` of an angle, narrowed to where its equation with A, B, C and −A / h, or no numbers for this,
    may vanish; the lower above the upper one where it does not."""
    A, B, C, ratio = coefficients
    sizes = [np.hypot(*pair) for pair in zip(_bound_sizes(B), _bound_sizes(C), strict=True)]
    with np.errstate(all="ignore"):
        ends = np.array([-each / h for each in A for h in sizes])
    # everywhere where both vanish
    share = np.where(np.isnan(ends).any(axis=0), [[-np.inf], [np.inf]], [ends.min(axis=0), ends.max(axis=0)])
    least, most = (
        np.fmax(share[0], ratio[0]) - BOX_EDGE_ROUNDING_TOL,
        np.fmin(share[1], ratio[1]) + BOX_EDGE_ROUNDING_TOL,
    )
    a, b = (np.where((least > 1) | (most < -1), np.nan, np.arccos(np.clip(each, -1, 1))) for each in (most, least))
    low, high = _bound_angle(B, C)
    turns = 2 * np.pi * np.arange(-2, 3)
    places = [(x + turn, y + turn) for x, y in ((low + a, high + b), (low - b, high - a)) for turn in turns]
    return _meet(places, own, [*A, *B, *C])


def narrow_travel(coefficients: Sequence[Bounds], own: Bounds) -> Bounds:
    """The bounds ``own`` of a travel, with B and B² − 2 A of its equation."""
    B, square = coefficients
    doubt = BOX_EDGE_ROUNDING_TOL * (1 + np.abs(square[1]))
    with np.errstate(invalid="ignore"):
        root = np.sqrt(np.maximum(square[0] - doubt, 0.0)), np.sqrt(square[1] + doubt)
    return _meet([(root[0] - B[1], root[1] - B[0]), (-root[1] - B[1], -root[0] - B[0])], own, [*B, *square])


def _meet(places: Sequence[Bounds], own: Bounds, known: Sequence[Array]) -> Bounds:
    """The least bounds of what places have in common with the ``own`` ones, or these where not all is known; places
    that are no numbers are nowhere."""
    met = [
        (
            np.maximum(own[0], a - BOX_EDGE_ROUNDING_TOL * (1 + np.abs(a))),
            np.minimum(own[1], b + BOX_EDGE_ROUNDING_TOL * (1 + np.abs(b))),
        )
        for a, b in places
    ]
    is_known = np.isfinite(known).all(axis=0)
    return (
        np.where(is_known, np.min([np.where(a <= b, a, np.inf) for a, b in met], axis=0), own[0]),
        np.where(is_known, np.max([np.where(a <= b, b, -np.inf) for a, b in met], axis=0), own[1]),
    )


def _bound_sizes(x: Bounds) -> Bounds:
    """The bounds of |x|."""
    low, high = np.abs(x)
    return np.where((x[0] <= 0) & (x[1] >= 0), 0.0, np.minimum(low, high)), np.maximum(low, high)


def _bound_angle(one: Bounds, two: Bounds) -> Bounds:
    """Return the angle of points (one, two) in rectangles, about the centre's; all angles where the origin may be among
    them."""
    middle = (one[0] + one[1]) / 2 + 1j * (two[0] + two[1]) / 2
    with np.errstate(all="ignore"):
        off = [np.angle((x + 1j * y) / middle) for x in one for y in two]
    all_round = (one[0] <= 0) & (one[1] >= 0) & (two[0] <= 0) & (two[1] >= 0)
    low, high = np.where(all_round, -np.pi, np.min(off, axis=0)), np.where(all_round, np.pi, np.max(off, axis=0))
    return np.angle(middle) + low, np.angle(middle) + high
