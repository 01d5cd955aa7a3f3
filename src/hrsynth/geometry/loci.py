"""Loci of the tip of an observed leg with a fixed direction: point, curve or surface.

Lengths in metres, angles in radians, all coordinates in one frame that the caller chooses (the base frame).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadRequest
from ..results import Value
from ..tolerances import EXACT_INCIDENCE_TOL
from .vectors import Array, cross, find_perpendicular, freeze_array


class _CheckedLocus(Value):
    """Something through or about a ``centre``, whose vectors and radius are checked, directions of length one."""

    def __post_init__(self) -> None:
        for name, value in list(vars(self).items()):
            if name == "radius":
                object.__setattr__(self, name, _radius(type(self).__name__.lower(), value))
            elif name not in ("start", "profile", "other"):
                object.__setattr__(self, name, _vector(value) if name == "centre" else _unit(value))


@dataclass(frozen=True, eq=False, repr=False)
class Point(_CheckedLocus):
    """The tip is fixed at ``centre``, shape (3,)."""

    centre: Array
    freedoms = 0

    def at(self, parameter: float = 0.0) -> Array:
        """The tip; shape (3,)."""
        return self.centre

    def miss(self, tip: Array) -> Array:
        """Return the difference of ``tip`` and the curve; shape (3,), metres."""
        return tip - self.centre


@dataclass(frozen=True, eq=False, repr=False)
class Line(_CheckedLocus):
    """The tip is centre + s d, with d the unit vector along ``direction`` and s in metres."""

    centre: Array
    direction: Array
    freedoms = 1

    def at(self, parameter: float) -> Array:
        """The tip at s = ``parameter``; shape (3,)."""
        return self.centre + parameter * self.direction

    def miss(self, tip: Array) -> Array:
        """The part of tip − centre that is normal to the line; shape (3,), metres."""
        v = tip - self.centre
        return v - self.direction * float(self.direction @ v)


@dataclass(frozen=True, eq=False, repr=False)
class Circle(_CheckedLocus):
    """The tip is centre + ρ (cos θ e₁ + sin θ e₂), with e₁ the part of ``start`` normal to ``axis`` and e₂ = n × e₁."""

    centre: Array
    axis: Array
    radius: float
    start: Array | None = None
    freedoms = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "start", freeze_array(find_perpendicular(self.axis, self.start)))

    def at(self, parameter: float) -> Array:
        """The tip at θ = ``parameter``; shape (3,)."""
        assert self.start is not None
        return self.centre + self.radius * (np.cos(parameter) * self.start + np.sin(parameter) * self.across)

    @cached_property
    def across(self) -> Array:
        """e₂ = n × e₁; shape (3,)."""
        assert self.start is not None
        return cross(self.axis, self.start)

    def miss(self, tip: Array) -> Array:
        """From the nearest point of the circle to ``tip``; shape (3,), metres."""
        v = tip - self.centre
        along = self.axis * float(self.axis @ v)
        spoke = v - along
        reach = length(spoke)
        if reach == 0.0:
            assert self.start is not None
            return along - self.radius * self.start
        return along + spoke * (1.0 - self.radius / reach)


@dataclass(frozen=True, eq=False, repr=False)
class Sphere(_CheckedLocus):
    """The tip is at the distance ``radius`` from ``centre``."""

    centre: Array
    radius: float
    freedoms = 2

    def miss(self, tip: Array) -> Array:
        """From the nearest point of the sphere to ``tip``; shape (3,), metres."""
        v = tip - self.centre
        reach = length(v)
        return v * (1.0 - self.radius / reach) if reach > 0.0 else np.array([-self.radius, 0.0, 0.0])


@dataclass(frozen=True, eq=False, repr=False)
class Plane(_CheckedLocus):
    """The tip is in the plane through ``centre`` that the unit vector along ``normal`` is normal to."""

    centre: Array
    normal: Array
    freedoms = 2

    def miss(self, tip: Array) -> Array:
        """From the nearest point of the plane to ``tip``; shape (3,), metres."""
        return self.normal * float(self.normal @ (tip - self.centre))


@dataclass(frozen=True, eq=False)
class Revolution(_CheckedLocus):
    """The tip is at ``centre`` + y with |y|² − z² = f₀ + f₁ z + f₂ z², z = y · ``axis``: what a slide sweeps that is
    oblique to the axis about which it turns, a cone or a hyperboloid."""

    centre: Array
    axis: Array
    profile: tuple[float, float, float]
    freedoms = 2

    @classmethod
    def swept(cls, centre: Array, axis: Array, arm: Array, slide: Array) -> Revolution:
        """By ``arm`` + s ``slide``, which turns about an axis through the centre."""
        w, v = float(axis @ arm), float(axis @ slide)
        across, along = arm - w * axis, (slide - v * axis) / v
        f2, mixed = float(along @ along), 2.0 * float(across @ along)
        return cls(centre, axis, (float(across @ across) - mixed * w + f2 * w * w, mixed - 2.0 * f2 * w, f2))


@dataclass(frozen=True, eq=False)
class SweptCircle(_CheckedLocus):
    """The tip is ``centre`` + a spoke of a circle about ``axis`` + s ``direction``, oblique to it: a cylinder; with
    ``other`` not zero the last is a spoke of a circle of that radius about the direction."""

    centre: Array
    axis: Array
    radius: float
    direction: Array
    other: float = 0.0
    freedoms = 2

    def off(self, centre: Array) -> Array:
        """Return the distance of the centre from that of another; on a cylinder that slides."""
        v = self.centre - centre
        return v if self.other else v - self.direction * float(self.axis @ v) / float(self.axis @ self.direction)


Curve = Point | Line | Circle
Surface = Sphere | Plane
Reach = Curve | Surface
"""Locus of a tip."""
Quadrics = Revolution | SweptCircle
"""Surfaces that only conditions on the pose know."""


def curves_of(reaches: Iterable[Reach]) -> list[int]:
    """Indices of those that have one dof or none."""
    return [k for k, reach in enumerate(reaches) if not isinstance(reach, Surface)]


@overload
def shift_reach(reach: Curve, by: ArrayLike) -> Curve: ...
@overload
def shift_reach(reach: Reach, by: ArrayLike) -> Reach: ...
def shift_reach(reach: Reach, by: ArrayLike) -> Reach:
    """Return the locus moved by ``by`` (3,), with the same parameter at each point of a curve."""
    return replace(reach, centre=reach.centre + np.asarray(by, dtype=float))


def length(v: Array) -> float:
    """|v|."""
    return math.hypot(*v.tolist())


def extent(curves: Sequence[Reach], tips: Array) -> float:
    """The size that residuals are divided by: the largest spread of centres, radius, or spread of tips (m); 1 where
    these are no more than rounding."""
    spreads = []
    for points in ([curve.centre for curve in curves], list(tips)):
        middle = sum(points) / len(points)
        spreads += [length(point - middle) for point in points]
    radii = [curve.radius for curve in curves if isinstance(curve, Circle | Sphere)]
    size = max([*spreads, *radii])
    rounding = EXACT_INCIDENCE_TOL * max(length(curve.centre) for curve in curves)
    return size if size > rounding else 1.0


def _vector(values: ArrayLike) -> Array:
    array = freeze_array(values)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise BadRequest("vector of a locus", np.asarray(values).tolist(), "three finite numbers")
    return array


def _radius(what: str, value: float) -> float:
    radius = float(value)
    if not (radius > 0 and np.isfinite(radius)):
        raise BadRequest(f"radius of a {what}", radius, "a positive length in metres")
    return radius


def _unit(values: ArrayLike) -> Array:
    array = _vector(values)
    size = length(array)
    if not size > 0:
        raise BadRequest("direction of a locus", array.tolist(), "a nonzero vector")
    return array if abs(size - 1.0) < 1e-15 else freeze_array(array / size)
