"""A platform that only translates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import TIP_ROUNDING, VANISHES
from .certify import Equation
from .conics import Conic, Numbers, direction, spatial_frame
from .curves import Circle, Curve, Line, Plane, Point, Reach, Sphere, Surface, cross, extent, length
from .quadrics import Chart, Moving, shifting
from .squares import Square, on_plane, on_sphere, resting, single
from .surfaces import three_surfaces
from .systems import Shifting


@dataclass(frozen=True, eq=False)
class Translating(Shifting):
    """A platform that only translates: q = p, shape (3,). ``tips`` has shape (n, 3).

    What each tip can reach, moved by −b_i, holds the point p. Two curves of one plane meet as often as their degrees
    say; two others do not meet at all unless one condition holds, so there one is met with a plane of the other, and
    the rest checked.
    """

    freedoms = 3

    def reached(self, q: Array) -> Array:
        """Where the tips are at a pose; shape (legs, 3), metres."""
        return np.asarray(q + self.tips)

    def apart(self, q: Array, at: Array, legs: Sequence[int], points: Sequence[tuple[Array, float]]
              ) -> dict[int, float]:
        """As for any system; the points are places of p."""
        error = self.error + TIP_ROUNDING * self.size
        return dict.fromkeys(legs, max((miss + length(point - q) for point, miss in points), default=0.0) + error)

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """How far the platform can be from its place at q (m); it does not turn."""
        return min(apart.values()), 0.0

    def chart(self, number: int) -> Chart:
        """The position."""
        frame = spatial_frame(self.paths, self.size)

        def tips(numbers: Numbers) -> list[Moving]:
            return [shifting(3, numbers.vector(np.zeros(3)))] * len(self.paths)

        return Chart(frame, 3, self.paths, tips, (), lambda x: frame.origin + frame.size * (np.array(x) @ frame.R))

    def squares(self) -> Iterator[Square]:
        """A tip at rest; pairs of paths that are curves, those of one plane first; a curve and a surface; three
        surfaces, those that meet most squarely first."""
        curves = {k: path for k, path in enumerate(self.paths) if not isinstance(path, Surface)}
        surfaces = {k: path for k, path in enumerate(self.paths) if isinstance(path, Surface)}
        for k, path in curves.items():
            if isinstance(path, Point):
                yield resting((k,), path.centre, len(self.paths) == 1)
        moving = [k for k, path in curves.items() if not isinstance(path, Point)]
        pairs = sorted(combinations(moving, 2), key=lambda two: not coplanar(curves[two[0]], curves[two[1]], self.size))
        for i, j in pairs:
            if isinstance(curves[j], Line) and isinstance(curves[i], Circle):
                i, j = j, i
            flat = isinstance(curves[j], Circle) and coplanar(curves[i], curves[j], self.size)
            whole = len(self.curves) == 2 and flat
            yield self._on_curve((i, j), curves[i], curves[j], whole)
        for i in moving:
            for j, surface in surfaces.items():
                yield self._on_curve((i, j), curves[i], surface, len(self.curves) == 2)
        triples = [three_surfaces([(k, surfaces[k]) for k in legs], len(self.curves) == 3)
                   for legs in combinations(surfaces, 3)]
        yield from (square for _, square in sorted(triples, key=lambda each: -each[0]))

    def _on_curve(self, legs: tuple[int, int], one: Curve, other: Reach, whole: bool) -> Square:
        """The curve's points at which the other is met."""
        both = (one, other)
        frame = spatial_frame(both, extent(both, np.zeros((1, 3))))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            centre = numbers.vector(frame.point(other.centre))
            if isinstance(other, Sphere) or (isinstance(other, Circle) and coplanar(one, other, self.size)):
                rho = numbers.vector(np.array([other.radius / frame.size]))[0]
                return [single(on_sphere(conics[0], centre, rho * rho))]
            normal = direction(_normal(one, other), frame, numbers)
            return [single(on_plane(conics[0], normal, normal @ centre))]

        return Square(legs, (one,), frame, build, lambda parameters: one.at(parameters[0]), whole)


def _normal(one: Curve, other: Reach) -> Array:
    """The normal of the plane of ``other`` that ``one`` is met with."""
    if isinstance(other, Circle | Plane):
        return other.axis if isinstance(other, Circle) else other.normal
    assert isinstance(one, Line)
    assert isinstance(other, Line)
    n = cross(other.direction, cross(one.direction, other.direction))
    size = length(n)
    return n / size if size > 0 else n


def coplanar(one: Curve, other: Curve, size: float) -> bool:
    """Whether two curves lie in one plane, to ``VANISHES``."""
    between = (other.centre - one.centre) / size
    circles = [curve for curve in (one, other) if isinstance(curve, Circle)]
    lines = [curve.direction for curve in (one, other) if isinstance(curve, Line)]
    if not circles:
        return abs(float(cross(*lines) @ between)) < VANISHES
    n = circles[0].axis
    tilt = [length(cross(n, circle.axis)) for circle in circles[1:]] + [float(n @ d) for d in lines]
    return all(abs(value) < VANISHES for value in [*tilt, float(n @ between)])
