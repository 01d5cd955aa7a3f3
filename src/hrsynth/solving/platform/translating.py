"""A platform that only translates, and one of two such bodies, the second on a circle about the first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from ...errors import BadRequest
from ...geometry.loci import Circle, Curve, Line, Plane, Point, Reach, Sphere, Surface, extent, length, shift_reach
from ...geometry.vectors import Array, cross
from ...tolerances import LOCUS_DISTANCE_TOL, TIP_ROUNDING
from .constrained_platform import TranslatingBodies
from .polynomials import Equation
from .quadrics import (
    EXACT_PARALLEL_SINE_TOL,
    Conic,
    MovingPoint,
    Numbers,
    PoseParametrization,
    build_shifting,
    build_spokes,
    choose_frame,
    convert_direction,
    list_normals,
    put_on_circle,
    put_on_plane,
    put_on_sphere,
    sum_on_plane,
    sum_on_sphere,
)
from .square_systems import SquareSystem, build_three_surfaces, make_fixed_square, make_single


@dataclass(frozen=True, eq=False, repr=False)
class TranslatingPlatform(TranslatingBodies):
    """A platform that only translates: q = p, shape (3,). ``tips`` has shape (n, 3).

    The locus of each tip, moved by −b_i, contains the point p. Two curves of one plane meet as often as their degrees
    allow; two others do not meet at all unless one condition holds, so there one is met with a plane of the other, and
    the remaining condition is checked.
    """

    freedoms = 3

    def tips_at(self, q: Array) -> Array:
        """Return the positions of the tips at a pose; shape (legs, 3), metres."""
        return np.asarray(q + self.tips)

    def apart(
        self, q: Array, at: Array, legs: Sequence[int], points: Sequence[tuple[Array, float]]
    ) -> dict[int, float]:
        """As for any system; the points are places of p."""
        error = self.error + TIP_ROUNDING * self.size
        return dict.fromkeys(legs, max((miss + length(point - q) for point, miss in points), default=0.0) + error)

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """Return how far the platform can be from its place at q (m); it does not rotate."""
        return min(apart.values()), 0.0

    def chart(self, number: int) -> PoseParametrization:
        """The position."""
        frame = choose_frame(self.paths, self.size)

        def tips(numbers: Numbers) -> list[MovingPoint]:
            return [build_shifting(3, numbers.vector(np.zeros(3)))] * len(self.paths)

        return PoseParametrization(
            frame, 3, self.paths, tips, (), lambda x: frame.origin + frame.size * (np.array(x) @ frame.R)
        )

    def squares(self) -> Iterator[SquareSystem]:
        """A fixed tip; pairs of paths that are curves, those of one plane first; a curve and a surface; three surfaces,
        those that meet most squarely first."""
        curves = {k: path for k, path in enumerate(self.paths) if not isinstance(path, Surface)}
        surfaces = {k: path for k, path in enumerate(self.paths) if isinstance(path, Surface)}
        for k, path in curves.items():
            if isinstance(path, Point):
                yield make_fixed_square((k,), path.centre, len(self.paths) == 1)
        moving = [k for k, path in curves.items() if not isinstance(path, Point)]
        pairs = sorted(
            combinations(moving, 2), key=lambda two: not is_coplanar(curves[two[0]], curves[two[1]], self.size)
        )
        for i, j in pairs:
            if isinstance(curves[j], Line) and isinstance(curves[i], Circle):
                i, j = j, i
            flat = isinstance(curves[j], Circle) and is_coplanar(curves[i], curves[j], self.size)
            whole = len(self.curves) == 2 and flat
            yield self._on_curve((i, j), curves[i], curves[j], whole)
        for i in moving:
            for j, surface in surfaces.items():
                yield self._on_curve((i, j), curves[i], surface, len(self.curves) == 2)
        triples = [
            build_three_surfaces([(k, surfaces[k]) for k in legs], len(self.curves) == 3)
            for legs in combinations(surfaces, 3)
        ]
        yield from (square for _, square in sorted(triples, key=lambda triple: -triple[0]))

    def _on_curve(self, legs: tuple[int, int], one: Curve, other: Reach, whole: bool) -> SquareSystem:
        """The curve's points at which the other is met."""
        both = (one, other)
        frame = choose_frame(both, extent(both, np.zeros((1, 3))))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            centre = numbers.vector(frame.point(other.centre))
            if isinstance(other, Sphere) or (isinstance(other, Circle) and is_coplanar(one, other, self.size)):
                rho = numbers.vector(np.array([other.radius / frame.size]))[0]
                return [make_single(put_on_sphere(conics[0], centre, rho * rho))]
            normal = convert_direction(find_met_normal(one, other), frame, numbers)
            return [make_single(put_on_plane(conics[0], normal, normal @ centre))]

        return SquareSystem(legs, (one,), frame, build, lambda parameters: one.at(parameters[0]), whole)


def find_met_normal(one: Curve, other: Reach) -> Array:
    """The normal of the plane of ``other`` that ``one`` is met with."""
    if isinstance(other, Circle | Plane):
        return other.axis if isinstance(other, Circle) else other.normal
    assert isinstance(one, Line)
    assert isinstance(other, Line)
    n = cross(other.direction, cross(one.direction, other.direction))
    size = length(n)
    return n / size if size > 0 else n


def is_coplanar(one: Curve, other: Curve, size: float) -> bool:
    """Return True if two curves lie in one plane, to ``LOCUS_DISTANCE_TOL``."""
    between = (other.centre - one.centre) / size
    circles = [curve for curve in (one, other) if isinstance(curve, Circle)]
    lines = [curve.direction for curve in (one, other) if isinstance(curve, Line)]
    if not circles:
        return abs(float(cross(lines[0], lines[1]) @ between)) < LOCUS_DISTANCE_TOL
    n = circles[0].axis
    tilt = [length(cross(n, circle.axis)) for circle in circles[1:]] + [float(n @ d) for d in lines]
    return all(abs(value) < LOCUS_DISTANCE_TOL for value in [*tilt, float(n @ between)])


@dataclass(frozen=True, eq=False, repr=False)
class ArticulatedPlatform(TranslatingBodies):
    """Two bodies that translate: q = (p, θ), p (3,) the first body's origin, θ where the second is on ``slide``, a
    circle about it or (s for θ, in metres) a line.

    tip_i = p + b_i on the first body, p + slide(θ) + b_i on the second; ``bodies`` is 0 or 1 for each leg. The square
    systems take one leg of each body: with the tip of one as p, the sum (or difference) of two circles lies on the
    third curve.
    """

    bodies: tuple[int, ...]
    slide: Circle | Line
    freedoms = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.bodies) != len(self.curves) or not set(self.bodies) <= {0, 1}:
            raise BadRequest("bodies of an articulated platform", self.bodies, "0 or 1 for each leg")

    @cached_property
    def size(self) -> float:
        """Unit of residuals (m)."""
        return max(extent(self.curves, self.tips), self._radius)

    @property
    def _radius(self) -> float:
        return self.slide.radius if isinstance(self.slide, Circle) else 0.0

    def freedoms_left(self, legs: Sequence[int]) -> int:
        """Return the dof that some legs leave: of each body's three, and one at least if a body has no leg."""
        sides = [sum(self.forbids[k] for k in legs if self.bodies[k] == body) for body in (0, 1)]
        return max(4 - sum(min(3, side) for side in sides), *(int(side == 0) for side in sides), 0)

    def tips_at(self, q: Array) -> Array:
        """Return the positions of the tips at a pose; shape (legs, 3), metres."""
        origins = np.array([q[:3], q[:3] + self.slide.at(float(q[3]))])
        return np.asarray(origins[list(self.bodies)] + self.tips)

    def apart(
        self, q: Array, at: Array, legs: Sequence[int], points: Sequence[tuple[Array, float]]
    ) -> dict[int, float]:
        """As for any system; the points are a place of one body and one of the second relative to the first."""
        error = self.error + TIP_ROUNDING * self.size
        return dict.fromkeys(legs, sum(miss for _, miss in points) + error)

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """Return how far the bodies can be from their places at q (m); they do not rotate."""
        sides = [[distance for k, distance in apart.items() if self.bodies[k] == body] for body in (0, 1)]
        return max(min(side, default=math.inf) for side in sides), 0.0

    def chart(self, number: int) -> PoseParametrization:
        """p, cos θ and sin θ, or s."""
        middle = choose_frame(self.paths, self.size).origin
        frame = replace(choose_frame((*self.paths, self.slide), self.size), origin=middle)

        count = 5 if isinstance(self.slide, Circle) else 4

        def tips(numbers: Numbers) -> list[MovingPoint]:
            centre = numbers.vector(frame.vector(self.slide.centre))
            along = (
                build_spokes(self.slide, frame, 0.0, numbers)
                if isinstance(self.slide, Circle)
                else [convert_direction(self.slide.direction, frame, numbers)]
            )
            both = build_shifting(count, centre * 0), build_shifting(count, centre, tuple(enumerate(along, 4)))
            return [both[body] for body in self.bodies]

        def place(x: Sequence[float]) -> Array:
            along = math.atan2(x[4], x[3]) if count == 5 else frame.size * x[3]
            return np.array([*(frame.origin + frame.size * (np.array(x[:3]) @ frame.R)), along])

        return PoseParametrization(
            frame, count, self.paths, tips, (put_on_circle(5, 4, 5),) if count == 5 else (), place
        )

    def squares(self) -> Iterator[SquareSystem]:
        """The pairs of legs, one on each body, each in both roles; first those where no plane is the slide's own."""
        curves = [(k, path) for k, path in enumerate(self.paths) if not isinstance(path, Surface)]
        firsts, seconds = ([curve for curve in curves if self.bodies[curve[0]] == body] for body in (0, 1))
        roles = [roles for i in firsts for j in seconds for roles in ((i, j), (j, i))]
        for first, onto in sorted(roles, key=lambda roles: self._is_parallel_to_slider(roles[1][1])):
            if not isinstance(onto[1], Point):
                yield self._square((first[0], onto[0]), first[1], onto[1])

    def _is_parallel_to_slider(self, curve: Curve) -> bool:
        """Return True if a circle lies in a plane parallel to the slide's."""
        return (
            isinstance(curve, Circle)
            and isinstance(self.slide, Circle)
            and length(cross(curve.axis, self.slide.axis)) < EXACT_PARALLEL_SINE_TOL
        )

    def _square(self, legs: tuple[int, int], first: Curve, onto: Line | Circle) -> SquareSystem:
        """The first leg's tip carries the slide to the second leg's curve."""
        sign = 1 if self.bodies[legs[0]] == 0 else -1
        size = max(extent((first, onto), np.zeros((1, 3))), self._radius, length(self.slide.centre))
        middle = (first.centre + onto.centre) / 2
        start, end = shift_reach(first, -middle), shift_reach(onto, -middle)
        frame = replace(choose_frame((start, end, self.slide), size), origin=np.zeros(3))
        resting = isinstance(first, Point)

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            centre = numbers.vector(frame.point(end.centre))
            across = [convert_direction(n, frame, numbers) for n in list_normals(onto)]
            if resting:
                left = centre - numbers.vector(frame.point(start.centre))
                quadratics = [put_on_plane(conics[0], sign * n, n @ left) for n in across]
                return [make_single(quadratics[0])]
            tables = [sum_on_plane(conics[0], conics[1], sign, n, n @ centre) for n in across]
            if isinstance(onto, Circle):
                rho = numbers.vector(np.array([onto.radius / frame.size]))[0]
                tables.append(sum_on_sphere(conics[0], conics[1], sign, centre, rho * rho))
            return [Equation(table, 0, 1) for table in tables]

        def place(parameters: Sequence[float]) -> Array:
            tip = first.centre if isinstance(first, Point) else first.at(parameters[0])
            theta = float(parameters[-1])
            return np.array([*(tip if sign == 1 else tip - self.slide.at(theta)), theta])

        unknowns = (self.slide,) if resting else (start, self.slide)
        whole = len(self.curves) == 2 and not resting
        return SquareSystem(legs, unknowns, frame, build, place, whole)
