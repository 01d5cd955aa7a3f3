"""The whole pose as the unknown: coordinates in which every condition on a tip is of degree two.

A tip is N/w and its square |tip|² is Q/w, all of degree two in the coordinates x: then *on a plane* and *on a sphere*
are quadrics, a line is two planes, a circle a plane and a sphere, a point three planes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.vectors import Array, perpendicular
from .certify import Quadric
from .conics import UNIT, Conic, Frame, Numbers, Rounded, direction
from .curves import Circle, Line, Plane, Point, Reach, Sphere, cross
from .squares import on_plane, on_sphere


@dataclass(frozen=True, eq=False)
class Moving(Conic):
    """A point of a moving body: N, shape (n + 1, n + 1, d), Q and w, shape (n + 1, n + 1).

    Entry i, j is the coefficient of xᵢ xⱼ with x₀ = 1. N/w is in units of size·2⁻⁵², lengths among the x in sizes."""


@dataclass(frozen=True, eq=False)
class Chart:
    """Coordinates of a pose.

    ``reaches`` are what the ``tips`` can reach; ``own`` the equations that the coordinates themselves satisfy;
    ``place`` turns coordinates (n,) into the system's; ``nonzero`` vanishes at no pose, though it may at complex
    coordinates that are none.
    """

    frame: Frame
    count: int
    reaches: tuple[Reach, ...]
    tips: Callable[[Numbers], list[Moving]]
    own: tuple[Any, ...]
    place: Callable[[Sequence[float]], Array]
    nonzero: Quadric | None = None


@dataclass(frozen=True, eq=False)
class Whole:
    """One choice of legs with as many equations as unknowns, the pose's own coordinates.

    Equations of the last leg that are too many are replaced by as many random combinations of them as are needed;
    ``whole`` says that no other equation is left.
    """

    legs: tuple[int, ...]
    chart: Chart
    whole: bool

    def place(self, parameters: Sequence[float]) -> Array:
        """The coordinates of the system's pose."""
        return self.chart.place(parameters)

    def equations(self, numbers: Numbers = Rounded) -> list[Quadric]:
        """The quadrics, first those of the coordinates themselves."""
        chart = self.chart
        tips = chart.tips(numbers)
        groups = [conditions(tips[k], chart.reaches[k], chart.frame, numbers) for k in self.legs]
        needed = chart.count - len(chart.own) - sum(map(len, groups[:-1]))
        return [Quadric(A) for A in (*chart.own, *(A for group in groups[:-1] for A in group),
                                     *_combined(groups[-1], needed))]


def conditions(tip: Conic, reach: Reach, frame: Frame, numbers: Numbers) -> list[Any]:
    """The forms that vanish where a tip is within its reach."""
    centre = numbers.vector(frame.point(reach.centre))
    if isinstance(reach, Point):
        return [on_plane(tip, axis, axis @ centre) for axis in np.eye(len(centre), dtype=int).astype(object)]
    if isinstance(reach, Sphere):
        return [_at_distance(tip, reach.radius, centre, frame, numbers)]
    flat = len(centre) == 2
    if isinstance(reach, Circle):
        sphere = _at_distance(tip, reach.radius, centre, frame, numbers)
        return [sphere] if flat else [_across(tip, reach.axis, centre, frame, numbers), sphere]
    if isinstance(reach, Line):
        if flat:
            d = direction(reach.direction, frame, numbers)
            normal = np.array([-d[1], d[0]], dtype=object)
            return [on_plane(tip, normal, normal @ centre)]
        return [_across(tip, n, centre, frame, numbers) for n in normals(reach)]
    return [_across(tip, reach.normal, centre, frame, numbers)]


def normals(reach: Line | Circle | Plane) -> tuple[Array, ...]:
    """The normal of a plane or of a circle's, or of two planes that hold a line."""
    if isinstance(reach, Line):
        first = perpendicular(reach.direction)
        return first, cross(reach.direction, first)
    return (reach.axis if isinstance(reach, Circle) else reach.normal,)


def _across(tip: Conic, normal: Array, centre: Any, frame: Frame, numbers: Numbers) -> Any:
    n = direction(normal, frame, numbers)
    return on_plane(tip, n, n @ centre)


def _at_distance(tip: Conic, radius: float, centre: Any, frame: Frame, numbers: Numbers) -> Any:
    rho = numbers.vector(np.array([radius / frame.size]))[0]
    return on_sphere(tip, centre, rho * rho)


def _combined(forms: Sequence[Any], needed: int) -> list[Any]:
    """All forms where so many are needed, else that many combinations with small odd coefficients."""
    if needed == len(forms):
        return list(forms)
    return [sum((2 * ((k + 1) * (row + 2) % 5) + 1) * form for k, form in enumerate(forms)) for row in range(needed)]


def linear(count: int, slopes: Sequence[tuple[int, Any]], offset: Any) -> Any:
    """The form offset + Σ slope · x_k (vectors allowed), k from 1 on; shape (count + 1, count + 1, ...)."""
    offset = np.asarray(offset, dtype=object)
    form = np.zeros((count + 1, count + 1, *offset.shape), dtype=object)
    form[0, 0] = offset
    for k, slope in slopes:
        form[0, k] = slope
    return form


def shifting(count: int, offset: Any, turns: Sequence[tuple[int, Any]] = ()) -> Moving:
    """The tip UNIT p + offset + Σ x_k v_k, with p the first coordinates and (k, v_k) the turns; where there are two of
    them, x_k² + x_l² = 1 and they are spokes, normal to each other and of one length."""
    d = len(offset)
    axes = np.eye(d, dtype=int).astype(object) * UNIT
    moves = [*((k + 1, axis) for k, axis in enumerate(axes)), *turns]
    N = linear(count, moves, offset)
    square = offset @ offset + (turns[0][1] @ turns[0][1] if turns else 0)
    Q = linear(count, [(k, 2 * (v @ offset)) for k, v in moves], square)
    for k in range(1, d + 1):
        Q[k, k] = UNIT * UNIT
        for other, v in turns:
            Q[k, other] = 2 * UNIT * v[k - 1]
    return Moving(N, Q, linear(count, (), 1))


def on_circle(count: int, cosine: int, sine: int) -> Any:
    """cos² + sin² = 1."""
    form = linear(count, (), -1)
    form[cosine, cosine] = form[sine, sine] = 1
    return form
