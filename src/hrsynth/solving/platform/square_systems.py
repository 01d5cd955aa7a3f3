"""As many equations as unknowns: the polynomials of one choice of legs, as tables of integers or of balls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.loci import Circle, Curve, Line, Plane, Sphere, Surface, extent, length
from ...geometry.vectors import Array, cross, normalise_vector
from .polynomials import Equation
from .quadrics import (
    UNIT,
    Conic,
    Numbers,
    RoundedConic,
    WorkingFrame,
    build_conic,
    choose_frame,
    convert_direction,
    put_on_plane,
    put_on_sphere,
)

TURNS = (0.7, 1.9, 2.6)
"""Origin t = 0 on the circles of the first, second and third unknown (rad): nowhere special."""


@dataclass(frozen=True, eq=False)
class SquareSystem:
    """One choice of legs with as many equations as unknowns.

    ``unknowns`` are the curves whose parameters are solved for; ``build`` gives the equations from their conics;
    ``place`` turns parameters (n,) into the coordinates of the system's pose; ``whole``: no other equation is
    left; ``exact`` gives the points that the unknowns stand for, where these are not those of the curves.
    """

    legs: tuple[int, ...]
    unknowns: tuple[Curve, ...]
    frame: WorkingFrame | None
    build: Callable[[Sequence[Conic], Numbers], list[Equation]]
    place: Callable[[Sequence[float]], Array]
    whole: bool
    exact: Callable[[Numbers], list[Conic]] | None = None

    def conics(self, turn: float = 0.0, numbers: Numbers = RoundedConic) -> list[Conic]:
        """The unknowns' curves, circles counted from ``turn`` on."""
        assert self.frame is not None
        return [
            build_conic(curve, self.frame, t, numbers) for curve, t in zip(self.unknowns, self.turns(turn), strict=True)
        ]

    def equations(self, turn: float = 0.0, numbers: Numbers = RoundedConic) -> list[Equation]:
        """The equations with circles counted from ``turn`` on."""
        return [] if self.frame is None else self.build(self.conics(turn, numbers), numbers)

    def turns(self, turn: float) -> list[float]:
        """Origins of the circles of each unknown (rad)."""
        return [angle + turn for angle in TURNS[: len(self.unknowns)]]

    @property
    def round(self) -> list[bool]:
        """Unknowns that are half-angle tangents."""
        return [isinstance(curve, Circle) for curve in self.unknowns]


def make_single(quadratic: Any) -> Equation:
    """A quadratic in the only unknown as an equation."""
    table = np.outer(quadratic, np.array([1, 0, 0], dtype=object))
    return Equation(table, 0, 0)


def make_fixed_square(legs: tuple[int, ...], q: Array, whole: bool) -> SquareSystem:
    """A pose that a fixed tip determines: nothing to solve."""
    return SquareSystem(legs, (), None, lambda conics, numbers: [], lambda parameters: q, whole)


def build_three_surfaces(legs: Sequence[tuple[int, Surface]], whole: bool) -> tuple[float, SquareSystem]:
    """The points on the surfaces of three legs, and the sine of the angle between the two planes: where that vanishes
    the surfaces have no point in common, or a curve of them."""
    first, second, last = _sort_surfaces([surface for _, surface in legs])
    all_three = (first, second, last)
    frame = choose_frame(all_three, extent(all_three, np.zeros((1, 3))))
    normals = [_find_normal(surface, last) for surface in (first, second)]
    along = cross(normals[0], normals[1])
    sine = length(along)
    d = normalise_vector(along) if sine > 0 else np.array([0.0, 0.0, 1.0])
    offset = frame.origin
    line = Line(
        _find_foot(normals, [_compute_offset(surface, last, offset) for surface in (first, second)], d) + offset, d
    )

    def point(numbers: Numbers) -> Conic:
        exact = RoundedConic.vector(frame.R @ d)
        start = RoundedConic.vector(np.array([float(d @ (line.centre - frame.origin)) / frame.size]))[0] * UNIT
        (n, h), (m, k) = (_convert_plane(surface, last, frame, numbers) for surface in (first, second))
        across = np.cross(n, m)
        at, slope = h * np.cross(m, exact) + k * np.cross(exact, n) + start * across, UNIT * UNIT * across
        return _build_affine(at, slope, exact @ across)

    def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
        centre = numbers.vector(frame.point(last.centre))
        if isinstance(last, Plane):
            normal = convert_direction(last.normal, frame, numbers)
            return [make_single(put_on_plane(point(numbers), normal, normal @ centre))]
        rho = numbers.vector(np.array([last.radius / frame.size]))[0]
        return [make_single(put_on_sphere(point(numbers), centre, rho * rho))]

    return sine, SquareSystem(
        tuple(k for k, _ in legs),
        (line,),
        frame,
        build,
        lambda s: line.at(s[0]),
        whole,
        lambda numbers: [point(numbers)],
    )


def _sort_surfaces(surfaces: Sequence[Surface]) -> list[Surface]:
    """A sphere last where there is one; of several candidates the one that leaves the others most apart."""

    def apart(last: int) -> tuple[bool, float]:
        first, two = (_find_normal(surface, surfaces[last]) for k, surface in enumerate(surfaces) if k != last)
        return isinstance(surfaces[last], Sphere), length(cross(first, two))

    last = max(range(3), key=apart)
    return [*(surface for k, surface in enumerate(surfaces) if k != last), surfaces[last]]


def _find_normal(surface: Surface, last: Surface) -> Array:
    """The unit normal of a plane, or of the one in which two spheres meet; zero where they have one centre."""
    if isinstance(surface, Plane):
        return surface.normal
    between = surface.centre - last.centre
    size = length(between)
    return between / size if size > 0 else between


def _compute_offset(surface: Surface, last: Surface, origin: Array) -> float:
    """h of a surface's plane n·(p − origin) = h."""
    if isinstance(surface, Plane):
        return float(surface.normal @ (surface.centre - origin))
    assert isinstance(last, Sphere)
    size = length(surface.centre - last.centre)
    power = (
        last.radius**2
        - surface.radius**2
        + float((surface.centre - origin) @ (surface.centre - origin))
        - float((last.centre - origin) @ (last.centre - origin))
    )
    return power / (2.0 * size) if size > 0 else 0.0


def _find_foot(normals: Sequence[Array], offsets: Sequence[float], d: Array) -> Array:
    """The point of two planes nearest to the origin."""
    foot = np.linalg.lstsq(np.array([*normals, d]), np.array([*offsets, 0.0]), rcond=None)[0]
    return np.asarray(foot)


def _convert_plane(surface: Surface, last: Surface, frame: Any, numbers: Numbers) -> tuple[Any, Any]:
    """n and h of the plane n·p = h, in working numbers: a plane's own, or the difference of two spheres."""
    centre = numbers.vector(frame.point(surface.centre))
    if isinstance(surface, Plane):
        n = convert_direction(surface.normal, frame, numbers)
        return n, n @ centre
    assert isinstance(last, Sphere)
    last_centre = numbers.vector(frame.point(last.centre))
    rho, radius = numbers.vector(np.array([last.radius, surface.radius]) / frame.size)
    return 2 * (centre - last_centre), rho * rho - radius * radius + centre @ centre - last_centre @ last_centre


def _build_affine(at: Any, slope: Any, w: Any) -> Conic:
    """The point (at + t slope) / w, with all of it multiplied by w."""
    zero = at * 0
    Q = [at @ at, 2 * (at @ slope), slope @ slope]
    N = np.array([at * w, slope * w, zero], dtype=object)
    return Conic(N, np.array(Q, dtype=object), np.array([w * w, 0, 0], dtype=object))
