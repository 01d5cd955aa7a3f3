"""A rigid platform in space."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...geometry.so3 import exponential, logarithm
from ...geometry.vectors import Array, pose
from ...tolerances import SAME_POINT
from .certify import Equation
from .conics import Conic, Numbers, spatial_frame
from .curves import Line, Plane, Point, Sphere, Surface, cross, curves_of, extent, length
from .quadrics import Chart
from .squares import Square, distance, on_sphere, single
from .study import study
from .systems import System, registered


@dataclass(frozen=True, eq=False)
class Spatial(System):
    """A rigid platform in space: q = (p, rotation vector); ``tips`` has shape (n, 3), no three used on one line."""

    freedoms = 6

    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""
        return pose(q[:3], exponential(q[3:]))

    def reached(self, q: Array) -> Array:
        """Where the tips are at a pose; shape (legs, 3), metres."""
        X = self.pose(q)
        return np.asarray(X[:3, 3] + self.tips @ X[:3, :3].T)

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """How far the platform's frame (m) and turn (rad) can be from those at q; see ``registered``."""
        return registered(self.tips, apart)

    def bound(self, legs: Sequence[int]) -> tuple[int, str] | None:
        """Six conditions *on a sphere or plane* are linear in (1, R, p, Rᵀp, |p|²), in which poses are of degree 40
        (M. Gallet, G. Nawratil, J. Schicho, J. Geom. 106, 2015; F. Ronga, T. Vust 1995): at most 40, and no curve
        besides 40. With a tip at rest, or six planes that leave p to R, three quadrics of the quaternion are left: 8;
        three rods in one ball let it be in two places.
        """
        curves = [self.curves[k] for k in legs]
        if sum(self.forbids[k] for k in legs) != self.freedoms:
            return None
        if any(isinstance(curve, Point) for curve in curves):
            return 8, "three quadrics of the quaternion (Bézout)"
        if all(isinstance(curve, Line | Plane) for curve in curves):
            return 8, "three quadrics of the quaternion (Bézout)"
        balls = [Counter(tuple(point) for point in points) for points in (
            (self.tips[k] for k in legs), (self.curves[k].centre for k in legs))]
        if all(isinstance(curve, Sphere) for curve in curves) and max(max(each.values()) for each in balls) > 2:
            return 16, "two places of a ball with three rods, three quadrics of the quaternion for each (Bézout)"
        return 40, "six conditions on points of a rigid body (degree of the poses among 16 coordinates)"

    def chart(self, number: int) -> Chart:
        """Study's coordinates, with a linear form of the quaternion that depends on the number made 1."""
        return study(self.curves, self.tips, self.size, number)

    def squares(self) -> Iterator[Square]:
        """Three tips at rest; two, one or none and as many curves as make three, with tips not on one line."""
        points = [k for k, curve in enumerate(self.curves) if isinstance(curve, Point)]
        moving = [k for k in curves_of(self.curves) if k not in points]
        choices = list(combinations(points, 3)) + [(i, j, k) for j, k in combinations(points, 2) for i in moving]
        choices += [(i, j, k) for k in points for i, j in combinations(moving, 2)] + list(combinations(moving, 3))
        for legs in choices:
            a, b, c = self.tips[list(legs)]
            if length(cross(b - a, c - a)) > SAME_POINT * self.size ** 2:
                yield self._square(legs, len(moving) == len(self.curves) == 3)

    def _square(self, legs: tuple[int, ...], whole: bool) -> Square:
        """Three distances between three tips; with tips at rest, given last, those that decide the others."""
        curves = tuple(curve for k in legs if not isinstance(curve := self.curves[k], Surface))
        b = self.tips[list(legs)]
        unknowns = tuple(curve for curve in curves if not isinstance(curve, Point))
        frame = spatial_frame(curves, extent(curves, b))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            tips = [numbers.vector(tip / frame.size) for tip in b]
            arms = [(i, j, tips[j] - tips[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
            if not unknowns:
                return []
            if len(unknowns) == 1:
                held = numbers.vector(frame.point(curves[1].centre))
                return [single(on_sphere(conics[0], held, arms[0][2] @ arms[0][2]))]
            if len(unknowns) == 2:
                held = numbers.vector(frame.point(curves[2].centre))
                reach = on_sphere(conics[1], held, arms[1][2] @ arms[1][2])
                return [Equation(distance(conics[0], conics[1], arms[0][2] @ arms[0][2]), 0, 1),
                        Equation(np.outer(np.array([1, 0, 0], dtype=object), reach), 0, 1)]
            return [Equation(distance(conics[i], conics[j], v @ v), i, j) for i, j, v in arms]

        def place(parameters: Sequence[float]) -> Array:
            free = iter(parameters)
            three = np.array([curve.at(0.0 if isinstance(curve, Point) else next(free)) for curve in curves])
            R = _triad(three) @ _triad(b).T
            return np.array([*(three.mean(axis=0) - R @ b.mean(axis=0)), *logarithm(R)])

        return Square(legs, unknowns, frame, build, place, whole)


def _triad(points: Array) -> Array:
    """A right-handed triad of three points, equal for congruent ones; its columns, shape (3, 3)."""
    first, second = points[1] - points[0], points[2] - points[0]
    e = first / length(first)
    n = cross(first, second)
    n = n / length(n)
    return np.column_stack([e, cross(n, e), n])
