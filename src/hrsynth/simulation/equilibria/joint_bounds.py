"""Bounds of a leg's joint, in closed form, while its tip is in a box.

From the joint's centre the tip is at height x along the joint's axis, at a distance h across it, at an angle φ. A
slider is at x ± √(rod² − h²). A crank is at φ ± arccos((x² + h² + radius² − rod²) / (2 radius h)). A rod that slides
points to φ − arcsin(aside / h), or the other way and to the other side.
"""

from __future__ import annotations

import numpy as np

from ...closed_forms.legs import ClosedFormLeg, OnCrank, OnRail, SlidingRod
from ...geometry.affine import AffineForms
from ...geometry.vectors import Array
from ...tolerances import BOX_EDGE_ROUNDING_TOL
from .joint_error import JointError

Bounds = tuple[Array, Array]
"""Lower and upper bounds (c,)."""


def narrow_joints(error: JointError, forms: list[AffineForms], low: Array, high: Array) -> Bounds:
    """The corners (c, n) of boxes, whose coordinates are ``forms``, with the joints where the legs can have them; the
    lower above the upper one where a leg has them nowhere. Charts of their own are as they were."""
    if error.far is not None or error.short is not None:
        return low, high
    low, high, pose = low.copy(), high.copy(), error.freedoms
    ways = error.ways.at(forms[:pose])
    for place, i in enumerate(error.joints):
        along, one, two = ((each.low, each.high) for each in ways[3 * place : 3 * place + 3])
        at = pose + place
        low[:, at], high[:, at] = narrow_joint(error.error.limbs[i], along, one, two, (low[:, at], high[:, at]))
    return low, high


def narrow_joint(limb: ClosedFormLeg, along: Bounds, one: Bounds, two: Bounds, own: Bounds) -> Bounds:
    """The bounds ``own`` of a joint, narrowed to where it can be while the tip is between bounds, from the centre along
    the axis and in the two directions across."""
    shifts = [0.0] if isinstance(limb, OnRail) else list(2 * np.pi * np.arange(-2, 3))
    met = [
        (
            np.maximum(own[0], a + shift - BOX_EDGE_ROUNDING_TOL * (1 + np.abs(a))),
            np.minimum(own[1], b + shift + BOX_EDGE_ROUNDING_TOL * (1 + np.abs(b))),
        )
        for a, b in _places(limb, along, one, two)
        for shift in shifts
    ]
    return (
        np.min([np.where(a <= b, a, np.inf) for a, b in met], axis=0),
        np.max([np.where(a <= b, b, -np.inf) for a, b in met], axis=0),
    )


def _places(limb: ClosedFormLeg, along: Bounds, one: Bounds, two: Bounds) -> list[Bounds]:
    """Bounds of the joint's two solutions, but for whole turns; no numbers where there is no solution."""
    far = _root(*(a + b for a, b in zip(_square(one), _square(two), strict=True)))
    with np.errstate(all="ignore"):
        if isinstance(limb, OnRail):
            aside = _root(limb.rod**2 - far[1] ** 2, limb.rod**2 - far[0] ** 2)
            return [(along[0] + aside[0], along[1] + aside[1]), (along[0] - aside[1], along[1] - aside[0])]
        angle = _angle(one, two)
        if isinstance(limb, OnCrank):
            low, high = _square(along)
            doubt = BOX_EDGE_ROUNDING_TOL * (high + limb.radius**2 + limb.rod**2)
            share = (
                _share(low + limb.radius**2 - limb.rod**2 - doubt, far, limb.radius, least=True),
                _share(high + limb.radius**2 - limb.rod**2 + doubt, far, limb.radius, least=False),
            )
            a, b = _turn(share[1]), _turn(share[0])
            none = (share[0] > 1 + BOX_EDGE_ROUNDING_TOL) | (share[1] < -1 - BOX_EDGE_ROUNDING_TOL)
            a, b = np.where(none, np.nan, a), np.where(none, np.nan, b)
            return [(angle[0] + a, angle[1] + b), (angle[0] - b, angle[1] - a)]
        assert isinstance(limb, SlidingRod)
        none = far[1] < abs(limb.aside) * (1 - BOX_EDGE_ROUNDING_TOL)
        sides = [np.pi / 2 - _turn(limb.aside / np.maximum(each, 1e-300)) for each in far]
        a, b = np.where(none, np.nan, np.minimum(*sides)), np.maximum(*sides)
        return [(angle[0] - b, angle[1] - a), (angle[0] + a - np.pi, angle[1] + b - np.pi)]


def _square(x: Bounds) -> Bounds:
    low, high = np.abs(x[0]), np.abs(x[1])
    return np.where((x[0] <= 0) & (x[1] >= 0), 0.0, np.minimum(low, high) ** 2), np.maximum(low, high) ** 2


def _root(low: Array, high: Array) -> Bounds:
    """Return the root of those that are not negative; NaN where all are."""
    doubt = BOX_EDGE_ROUNDING_TOL * (1 + np.abs(high))
    return np.sqrt(np.maximum(low - doubt, 0.0)), np.sqrt(high + doubt)


def _turn(cosine: Array) -> Array:
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _angle(one: Bounds, two: Bounds) -> Bounds:
    """Return the angle of points (one, two) in rectangles, about the centre's; all angles where the origin may be among
    them."""
    middle = (one[0] + one[1]) / 2 + 1j * (two[0] + two[1]) / 2
    off = [np.angle((x + 1j * y) / middle) for x in one for y in two]
    all_round = (one[0] <= 0) & (one[1] >= 0) & (two[0] <= 0) & (two[1] >= 0)
    low, high = np.where(all_round, -np.pi, np.min(off, axis=0)), np.where(all_round, np.pi, np.max(off, axis=0))
    return np.angle(middle) + low, np.angle(middle) + high


def _share(rest: Array, far: Bounds, radius: float, *, least: bool) -> Array:
    """Return a bound of (``rest`` + h²) / (2 radius h), h in ``far``: convex in h with the least at ``√rest``, or
    growing; widened."""
    ends = [(rest + h * h) / (2 * radius * h) for h in far]
    if not least:
        found = np.maximum(*ends)
        return np.asarray(np.where(np.isnan(found), np.inf, found) + BOX_EDGE_ROUNDING_TOL)
    turn = np.sqrt(np.maximum(rest, 0.0))
    found = np.where((turn >= far[0]) & (turn <= far[1]) & (rest > 0), turn / radius, np.minimum(*ends))
    return np.asarray(np.where(np.isnan(found), -np.inf, found) - BOX_EDGE_ROUNDING_TOL)
