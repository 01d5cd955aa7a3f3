"""Conditions of degree two on a tip, with integer coordinates: exact where exactness decides how many there are.

A tip is N/w and its square |tip|² is Q/w, all of degree two in the unknowns: in the parameter t of its curve (w = 1 and
t = s/size on a line, w = 1 + t² with t the tangent of a half angle on a circle), or in the coordinates x of the whole
pose. Then *on a plane* and *on a sphere* are of degree two, a line is two planes, a circle a plane and a sphere, a
point three planes, and for two curves

    |tip₁ − tip₂|² w₁ w₂ = Q₁ w₂ + Q₂ w₁ − 2 N₁·N₂.

Coordinates are counted in units of size·2⁻⁵². Directions that agree to ``EXACT_PARALLEL_SINE_TOL`` are made equal, in a
frame whose third axis is theirs: so circles in parallel planes meet at infinity exactly, and parallel lines stay
parallel. The same builders give integers or, with what rounding and this may have changed as radius, arb balls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.loci import Circle, Curve, Line, Plane, Point, Reach, Sphere, length
from ...geometry.vectors import Array, build_plane_axes, cross
from .polynomials import Quadric

EXACT_PARALLEL_SINE_TOL = 1e-13
"""Sine of the angle below which two directions of loci are exactly parallel: it decides the solutions at infinity."""

COORDINATE_BITS_COUNT = 52
"""Coordinates are integers in units of the size times 2 to the minus this."""

UNIT = 1 << COORDINATE_BITS_COUNT
WORKING_FRAME_ROUNDING_TOL = 8.0
"""Units by which a coordinate may be wrong after turning into the working frame: sixteen roundings of a float."""


@dataclass(frozen=True, eq=False)
class Conic:
    """N, shape (3, d), Q and w, shape (3,): row or entry k is the coefficient of tᵏ; objects are integers or balls."""

    N: Any
    Q: Any
    w: Any


@dataclass(frozen=True, eq=False)
class WorkingFrame:
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


def choose_frame(curves: Sequence[Reach], size: float) -> WorkingFrame:
    """A frame whose third axis is the direction that most share, circles first; size rounded to a power of 2."""
    directions = [curve.axis for curve in curves if isinstance(curve, Circle)]
    directions += [curve.direction for curve in curves if isinstance(curve, Line)]
    directions += [curve.normal for curve in curves if isinstance(curve, Plane)]
    shared = [sum(_is_parallel(a, b) for b in directions) for a in directions]
    n = directions[int(np.argmax(shared))] if directions else np.array([0.0, 0.0, 1.0])
    return WorkingFrame(_compute_middle(curves), np.array([*build_plane_axes(n), n]), _round_to_power(size), n)


def choose_planar_frame(curves: Sequence[Reach], X_plane: Array, size: float) -> WorkingFrame:
    """Two axes in the plane of X_plane (4, 4), the first along the direction that most lines share."""
    lines = [curve.direction for curve in curves if isinstance(curve, Line)]
    shared = [sum(_is_parallel(a, b) for b in lines) for a in lines]
    first = lines[int(np.argmax(shared))] if lines else X_plane[:3, 0]
    n = X_plane[:3, 2]
    axes = build_plane_axes(n, first)
    return WorkingFrame(_compute_middle(curves), axes, _round_to_power(size), axes[0])


class RoundedConic:
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


Balls = Within(WORKING_FRAME_ROUNDING_TOL)
"""The balls of input that is known as exactly as floats allow."""

Numbers = type[RoundedConic] | Within


def build_conic(curve: Curve, frame: WorkingFrame, turn: float, numbers: Numbers = RoundedConic) -> Conic:
    """A curve in a working frame; t = 0 is at θ = ``turn`` on a circle, at s = 0 on a line."""
    c = numbers.vector(frame.point(curve.centre))
    zero = c * 0
    if isinstance(curve, Line):
        d = convert_direction(curve.direction, frame, numbers)
        return Conic(np.array([c, d, zero]), np.array([c @ c, 2 * (c @ d), d @ d]), np.array([1, 0, 0], dtype=object))
    if isinstance(curve, Circle):
        a, b = build_spokes(curve, frame, turn, numbers)
        rho = a @ a
        Q = [c @ c + rho + 2 * (c @ a), 4 * (c @ b), c @ c + rho - 2 * (c @ a)]
        return Conic(np.array([c + a, 2 * b, c - a]), np.array(Q), np.array([1, 0, 1], dtype=object))
    nothing = zero @ zero
    return Conic(np.array([c, zero, zero]), np.array([c @ c, nothing, nothing]), np.array([1, 0, 0], dtype=object))


def convert_direction(along: Array, frame: WorkingFrame, numbers: Numbers) -> Any:
    """A unit direction as numbers, made exact where it nearly is the frame's own or normal to that."""
    d = frame.R @ along
    if _is_parallel(along, frame.special):
        return numbers.vector(np.round(d), EXACT_PARALLEL_SINE_TOL * UNIT * (not _is_equal(along, frame.special)))
    if abs(float(along @ frame.special)) < EXACT_PARALLEL_SINE_TOL:
        return numbers.vector(np.where(np.abs(d) < EXACT_PARALLEL_SINE_TOL, 0.0, d), EXACT_PARALLEL_SINE_TOL * UNIT)
    return numbers.vector(d)


def convert_parameter(curve: Curve, frame: WorkingFrame, turn: float, t: Any) -> Any:
    """The curve's own parameter, s in metres or θ in radians, of the conic's t: a ball of a ball."""
    from flint import arb

    return 2 * t.atan() + arb(turn) if isinstance(curve, Circle) else t * arb(frame.size)


def build_spokes(circle: Circle, frame: WorkingFrame, turn: float, numbers: Numbers) -> tuple[Any, Any]:
    """Spokes a ⟂ b of equal length with tip = c + a cos φ + b sin φ, φ = θ − ``turn``, exactly so where planes are
    shared."""
    assert circle.start is not None
    cos, sin = np.cos(turn) * circle.radius, np.sin(turn) * circle.radius
    first, second = cos * circle.start + sin * circle.across, cos * circle.across - sin * circle.start
    a, b = frame.vector(first), frame.vector(second)
    if len(a) == 2 or _is_parallel(circle.axis, frame.special):
        more = EXACT_PARALLEL_SINE_TOL * UNIT * (len(a) == 3 and not _is_equal(circle.axis, frame.special))
        sign = 1 if a[0] * b[1] - a[1] * b[0] > 0 else -1
        a = numbers.vector(np.where(np.arange(len(a)) < 2, a, 0.0), more)
        a[2:] = a[2:] * 0
        b = a * 0
        b[0], b[1] = -sign * a[1], sign * a[0]
        return a, b
    return numbers.vector(a), numbers.vector(b)


def build_distance(one: Conic, other: Conic, squared: Any) -> Any:
    """The table of |tip₁ − tip₂|² = ``squared``."""
    return (
        np.outer(one.Q, other.w)
        + np.outer(one.w, other.Q)
        - 2 * (one.N @ other.N.T)
        - squared * np.outer(one.w, other.w)
    )


def put_on_plane(one: Conic, normal: Any, offset: Any) -> Any:
    """The quadratic of normal · tip = ``offset``."""
    return one.N @ normal - offset * one.w


def put_on_sphere(one: Conic, centre: Any, squared: Any) -> Any:
    """The quadratic of |tip − centre|² = ``squared``."""
    return one.Q - 2 * (one.N @ centre) + (centre @ centre - squared) * one.w


def sum_on_plane(one: Conic, other: Conic, sign: int, normal: Any, offset: Any) -> Any:
    """The table of normal · (tip₁ ± tip₂) = ``offset``."""
    return np.outer(one.N @ normal - offset * one.w, other.w) + sign * np.outer(one.w, other.N @ normal)


def sum_on_sphere(one: Conic, other: Conic, sign: int, centre: Any, squared: Any) -> Any:
    """The table of |tip₁ ± tip₂ − centre|² = ``squared``."""
    return (
        np.outer(put_on_sphere(one, centre, squared), other.w)
        + np.outer(one.w, other.Q - sign * 2 * (other.N @ centre))
        + sign * 2 * (one.N @ other.N.T)
    )


def _compute_middle(curves: Sequence[Reach]) -> Array:
    return np.asarray(sum(curve.centre for curve in curves) / len(curves))


def _is_parallel(a: Array, b: Array) -> bool:
    return length(cross(a, b)) < EXACT_PARALLEL_SINE_TOL


def _is_equal(a: Array, b: Array) -> bool:
    return length(cross(a, b)) < 1e-15


def _round_to_power(size: float) -> float:
    """The power of two next above a size."""
    return float(2.0 ** np.ceil(np.log2(size)))


@dataclass(frozen=True, eq=False)
class MovingPoint(Conic):
    """A point of a moving body: N, shape (n + 1, n + 1, d), Q and w, shape (n + 1, n + 1).

    Entry i, j is the coefficient of xᵢ xⱼ with x₀ = 1. N/w is in units of size·2⁻⁵², lengths among the x in sizes."""


@dataclass(frozen=True, eq=False)
class PoseParametrization:
    """Coordinates of a pose.

    ``reaches`` are what the ``tips`` can reach; ``own`` the equations that the coordinates themselves satisfy;
    ``place`` turns coordinates (n,) into the system's; ``nonzero`` vanishes at no pose, though it may at complex
    coordinates that are none; ``study`` (8, 8) times (1, x) are Study's coordinates, where x are such.
    """

    frame: WorkingFrame
    count: int
    reaches: tuple[Reach, ...]
    tips: Callable[[Numbers], list[MovingPoint]]
    own: tuple[Any, ...]
    place: Callable[[Sequence[float]], Array]
    nonzero: Quadric | None = None
    study: Array | None = None


@dataclass(frozen=True, eq=False)
class PoseSystem:
    """One choice of legs with as many equations as unknowns, the pose's own coordinates.

    Equations of the last leg that are too many are replaced by as many random combinations of them as are needed;
    ``whole``: no other equation is left.
    """

    legs: tuple[int, ...]
    chart: PoseParametrization
    whole: bool

    def place(self, parameters: Sequence[float]) -> Array:
        """The coordinates of the system's pose."""
        return self.chart.place(parameters)

    def equations(self, numbers: Numbers = RoundedConic) -> list[Quadric]:
        """The quadrics, first those of the coordinates themselves."""
        chart = self.chart
        tips = chart.tips(numbers)
        groups = [list_conditions(tips[k], chart.reaches[k], chart.frame, numbers) for k in self.legs]
        needed = chart.count - len(chart.own) - sum(map(len, groups[:-1]))
        return [
            Quadric(A)
            for A in (*chart.own, *(A for group in groups[:-1] for A in group), *_combine(groups[-1], needed))
        ]


def list_conditions(tip: Conic, reach: Reach, frame: WorkingFrame, numbers: Numbers) -> list[Any]:
    """The forms that vanish where a tip is within its reach."""
    centre = numbers.vector(frame.point(reach.centre))
    if isinstance(reach, Point):
        return [put_on_plane(tip, axis, axis @ centre) for axis in np.eye(len(centre), dtype=int).astype(object)]
    if isinstance(reach, Sphere):
        return [_put_at_distance(tip, reach.radius, centre, frame, numbers)]
    flat = len(centre) == 2
    if isinstance(reach, Circle):
        sphere = _put_at_distance(tip, reach.radius, centre, frame, numbers)
        return [sphere] if flat else [_put_across(tip, reach.axis, centre, frame, numbers), sphere]
    if isinstance(reach, Line):
        if flat:
            d = convert_direction(reach.direction, frame, numbers)
            normal = np.array([-d[1], d[0]], dtype=object)
            return [put_on_plane(tip, normal, normal @ centre)]
        return [_put_across(tip, n, centre, frame, numbers) for n in list_normals(reach)]
    return [_put_across(tip, reach.normal, centre, frame, numbers)]


def list_normals(reach: Line | Circle | Plane) -> tuple[Array, ...]:
    """The normal of a plane or of a circle's, or of two planes that hold a line."""
    if isinstance(reach, Line):
        return tuple(build_plane_axes(reach.direction))
    return (reach.axis if isinstance(reach, Circle) else reach.normal,)


def _put_across(tip: Conic, normal: Array, centre: Any, frame: WorkingFrame, numbers: Numbers) -> Any:
    n = convert_direction(normal, frame, numbers)
    return put_on_plane(tip, n, n @ centre)


def _put_at_distance(tip: Conic, radius: float, centre: Any, frame: WorkingFrame, numbers: Numbers) -> Any:
    rho = numbers.vector(np.array([radius / frame.size]))[0]
    return put_on_sphere(tip, centre, rho * rho)


def _combine(forms: Sequence[Any], needed: int) -> list[Any]:
    """All forms where so many are needed, else that many combinations with small odd coefficients."""
    if needed == len(forms):
        return list(forms)
    return [sum((2 * ((k + 1) * (row + 2) % 5) + 1) * form for k, form in enumerate(forms)) for row in range(needed)]


def build_linear(count: int, slopes: Sequence[tuple[int, Any]], offset: Any) -> Any:
    """The form offset + Σ slope · x_k (vectors allowed), k from 1 on; shape (count + 1, count + 1, ...)."""
    offset = np.asarray(offset, dtype=object)
    form = np.zeros((count + 1, count + 1, *offset.shape), dtype=object)
    form[0, 0] = offset
    for k, slope in slopes:
        form[0, k] = slope
    return form


def build_shifting(count: int, offset: Any, turns: Sequence[tuple[int, Any]] = ()) -> MovingPoint:
    """The tip UNIT p + offset + Σ x_k v_k, with p the first coordinates and (k, v_k) the turns; where there are two of
    them, x_k² + x_l² = 1 and they are spokes, normal to each other and of one length; one is a slide."""
    d = len(offset)
    axes = np.eye(d, dtype=int).astype(object) * UNIT
    moves = [*((k + 1, axis) for k, axis in enumerate(axes)), *turns]
    N = build_linear(count, moves, offset)
    square = offset @ offset + (turns[0][1] @ turns[0][1] if len(turns) == 2 else 0)
    Q = build_linear(count, [(k, 2 * (v @ offset)) for k, v in moves], square)
    if len(turns) == 1:
        Q[turns[0][0], turns[0][0]] = turns[0][1] @ turns[0][1]
    for k in range(1, d + 1):
        Q[k, k] = UNIT * UNIT
        for place, v in turns:
            Q[k, place] = 2 * UNIT * v[k - 1]
    return MovingPoint(N, Q, build_linear(count, (), 1))


def put_on_circle(count: int, cosine: int, sine: int) -> Any:
    """cos² + sin² = 1."""
    form = build_linear(count, (), -1)
    form[cosine, cosine] = form[sine, sine] = 1
    return form
