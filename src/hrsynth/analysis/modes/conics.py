"""Lines and circles as conics with integer coordinates, exact where exactness decides how many solutions there are.

A curve's tip is N(t)/w(t), its square |tip|² is Q(t)/w(t), all three of degree two in t: w = 1 and t = s/size on a
line, w = 1 + t² with t the tangent of a half angle on a circle. Distances are then of degree two in each parameter,

    |tip₁ − tip₂|² w₁ w₂ = Q₁ w₂ + Q₂ w₁ − 2 N₁·N₂.

Coordinates are counted in units of size·2⁻⁵². Directions that agree to ``PARALLEL`` are made equal, in a frame whose
third axis is theirs: so circles in parallel planes meet at infinity exactly, and parallel lines stay parallel. The same
builders give integers or, with what rounding and this may have changed as radius, arb balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.vectors import Array, perpendicular
from ...tolerances import PARALLEL
from .curves import Circle, Curve, Line, Plane, Reach, cross, length

BITS = 52
"""Coordinates are integers in units of the size times 2 to the minus this."""

UNIT = 1 << BITS
SLACK = 8.0
"""Units by which a coordinate may be wrong after turning into the working frame: sixteen roundings of a float."""


@dataclass(frozen=True, eq=False)
class Conic:
    """N, shape (3, d), Q and w, shape (3,): row or entry k is the coefficient of tᵏ; objects are integers or balls."""

    N: Any
    Q: Any
    w: Any


@dataclass(frozen=True, eq=False)
class Frame:
    """The working frame: tip = origin + Rᵀ x, with coordinates x in units of ``size``·2⁻⁵².

    ``R`` has shape (d, 3); ``special`` (3,) is the direction that is made exact.
    """

    origin: Array
    R: Array
    size: float
    special: Array

    def vector(self, v: Array) -> Array:
        """A vector in working coordinates, in units of size."""
        return self.R @ v / self.size

    def point(self, p: Array) -> Array:
        """A point in working coordinates, in units of size."""
        return self.vector(p - self.origin)


def spatial_frame(curves: Sequence[Reach], size: float) -> Frame:
    """A frame whose third axis is the direction that most share, circles first; size rounded to a power of 2."""
    directions = [curve.axis for curve in curves if isinstance(curve, Circle)]
    directions += [curve.direction for curve in curves if isinstance(curve, Line)]
    directions += [curve.normal for curve in curves if isinstance(curve, Plane)]
    shared = [sum(_parallel(a, b) for b in directions) for a in directions]
    n = directions[int(np.argmax(shared))] if directions else np.array([0.0, 0.0, 1.0])
    e = perpendicular(n)
    return Frame(_middle(curves), np.array([e, cross(n, e), n]), _power(size), n)


def planar_frame(curves: Sequence[Reach], X_plane: Array, size: float) -> Frame:
    """Two axes in the plane of X_plane (4, 4), the first along the direction that most lines share."""
    lines = [curve.direction for curve in curves if isinstance(curve, Line)]
    shared = [sum(_parallel(a, b) for b in lines) for a in lines]
    first = lines[int(np.argmax(shared))] if lines else X_plane[:3, 0]
    n = X_plane[:3, 2]
    first = perpendicular(n, first)
    return Frame(_middle(curves), np.array([first, cross(n, first)]), _power(size), first)


class Rounded:
    """Numbers of a conic as integers: what the count of solutions is proved for."""

    @staticmethod
    def vector(x: Array, more: float = 0.0) -> Any:
        """Coordinates in units of size, shape (d,), as numbers."""
        return np.array([round(float(value) * UNIT) for value in x], dtype=object)


@dataclass(frozen=True)
class Within:
    """Numbers of a conic as arb balls that hold the exact input: what enclosures are proved for."""

    slack: float
    """Radius of the balls in units."""

    def vector(self, x: Array, more: float = 0.0) -> Any:
        """Coordinates in units of size, shape (d,), as balls with the radius ``slack + more`` units."""
        from flint import arb

        return np.array([arb(round(float(value) * UNIT), self.slack + more) for value in x], dtype=object)


Balls = Within(SLACK)
"""The balls of input that is known as exactly as floats allow."""

Numbers = type[Rounded] | Within


def conic(curve: Curve, frame: Frame, turn: float, numbers: Numbers = Rounded) -> Conic:
    """A curve in a working frame; t = 0 is at θ = ``turn`` on a circle, at s = 0 on a line."""
    c = numbers.vector(frame.point(curve.centre))
    zero = c * 0
    if isinstance(curve, Line):
        d = direction(curve.direction, frame, numbers)
        return Conic(np.array([c, d, zero]), np.array([c @ c, 2 * (c @ d), d @ d]), np.array([1, 0, 0], dtype=object))
    if isinstance(curve, Circle):
        a, b = spokes(curve, frame, turn, numbers)
        rho = a @ a
        Q = [c @ c + rho + 2 * (c @ a), 4 * (c @ b), c @ c + rho - 2 * (c @ a)]
        return Conic(np.array([c + a, 2 * b, c - a]), np.array(Q), np.array([1, 0, 1], dtype=object))
    nothing = zero @ zero
    return Conic(np.array([c, zero, zero]), np.array([c @ c, nothing, nothing]), np.array([1, 0, 0], dtype=object))


def direction(along: Array, frame: Frame, numbers: Numbers) -> Any:
    """A unit direction as numbers, made exact where it nearly is the frame's own or normal to that."""
    d = frame.R @ along
    if _parallel(along, frame.special):
        return numbers.vector(np.round(d), PARALLEL * UNIT * (not _same(along, frame.special)))
    if abs(float(along @ frame.special)) < PARALLEL:
        return numbers.vector(np.where(np.abs(d) < PARALLEL, 0.0, d), PARALLEL * UNIT)
    return numbers.vector(d)


def parameter(curve: Curve, frame: Frame, turn: float, t: Any) -> Any:
    """The curve's own parameter, s in metres or θ in radians, of the conic's t: a ball of a ball."""
    from flint import arb

    return 2 * t.atan() + arb(turn) if isinstance(curve, Circle) else t * arb(frame.size)


def spokes(circle: Circle, frame: Frame, turn: float, numbers: Numbers) -> tuple[Any, Any]:
    """Spokes a ⟂ b of equal length with tip = c + a cos φ + b sin φ, φ = θ − ``turn``, exactly so where planes are
    shared."""
    assert circle.start is not None
    cos, sin = np.cos(turn) * circle.radius, np.sin(turn) * circle.radius
    first, second = cos * circle.start + sin * circle.across, cos * circle.across - sin * circle.start
    a, b = frame.vector(first), frame.vector(second)
    if len(a) == 2 or _parallel(circle.axis, frame.special):
        more = PARALLEL * UNIT * (len(a) == 3 and not _same(circle.axis, frame.special))
        sign = 1 if a[0] * b[1] - a[1] * b[0] > 0 else -1
        a = numbers.vector(np.where(np.arange(len(a)) < 2, a, 0.0), more)
        a[2:] = a[2:] * 0
        b = a * 0
        b[0], b[1] = -sign * a[1], sign * a[0]
        return a, b
    return numbers.vector(a), numbers.vector(b)


def _middle(curves: Sequence[Reach]) -> Array:
    return np.asarray(sum(curve.centre for curve in curves) / len(curves))


def _parallel(a: Array, b: Array) -> bool:
    return length(cross(a, b)) < PARALLEL


def _same(a: Array, b: Array) -> bool:
    return length(cross(a, b)) < 1e-15


def _power(size: float) -> float:
    """The power of two next above a size."""
    return float(2.0 ** np.ceil(np.log2(size)))
