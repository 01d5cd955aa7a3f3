"""A rigid platform in space."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from ...mechanism.vectors import Array, pose, rotation_about
from ...tolerances import SAME_POINT
from .certify import Equation
from .conics import Conic, Numbers, spatial_frame
from .curves import Curve, Point, cross, extent, length
from .squares import Square, distance, on_sphere
from .systems import alike


@dataclass(frozen=True, eq=False)
class Spatial:
    """A rigid platform in space: q = (p, rotation vector); ``tips`` has shape (n, 3), no three used on one line."""

    curves: tuple[Curve, ...]
    tips: Array

    def __post_init__(self) -> None:
        alike(self.curves, self.tips, 3)

    @cached_property
    def size(self) -> float:
        """What residuals are divided by (m)."""
        return extent(self.curves, self.tips)

    @property
    def missing(self) -> int:
        """Freedoms that too few legs leave."""
        return max(0, 6 - sum(3 - curve.freedoms for curve in self.curves))

    def pose(self, q: Array) -> Array:
        """The platform\'s frame in the base frame; shape (4, 4)."""
        angle = length(q[3:])
        return pose(q[:3], rotation_about(q[3:], angle) if angle > 0 else None)

    def misses(self, q: Array) -> Array:
        """What separates each tip from its curve; shape (legs, 3), metres."""
        X = self.pose(q)
        return np.array([curve.miss(X[:3, 3] + X[:3, :3] @ tip)
                         for curve, tip in zip(self.curves, self.tips, strict=True)])

    def squares(self) -> Iterator[Square]:
        """A tip at rest and two curves, or three curves, with tips not on one line."""
        points = [k for k, curve in enumerate(self.curves) if isinstance(curve, Point)]
        moving = [k for k in range(len(self.curves)) if k not in points]
        choices = [(i, j, k) for k in points for i, j in combinations(moving, 2)] + list(combinations(moving, 3))
        for legs in choices:
            a, b, c = self.tips[list(legs)]
            if length(cross(b - a, c - a)) > SAME_POINT * self.size ** 2:
                yield self._square(legs, len(moving) == len(self.curves) == 3)

    def _square(self, legs: tuple[int, ...], whole: bool) -> Square:
        """Three distances between three tips; with a tip at rest, given last, the two that decide the others."""
        curves = tuple(self.curves[k] for k in legs)
        b = self.tips[list(legs)]
        unknowns = tuple(curve for curve in curves if not isinstance(curve, Point))
        frame = spatial_frame(curves, extent(curves, b))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            tips = [numbers.vector(tip / frame.size) for tip in b]
            arms = [(i, j, tips[j] - tips[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
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
            return np.array([*(three.mean(axis=0) - R @ b.mean(axis=0)), *_rotation_vector(R)])

        return Square(legs, unknowns, frame, build, place, whole)


def _triad(points: Array) -> Array:
    """A right-handed triad of three points, equal for congruent ones; its columns, shape (3, 3)."""
    first, second = points[1] - points[0], points[2] - points[0]
    e = first / length(first)
    n = cross(first, second)
    n = n / length(n)
    return np.column_stack([e, cross(n, e), n])


def _rotation_vector(R: Array) -> Array:
    """The axis of a rotation times its angle in [0, π], by the best of four forms of its quaternion; shape (3,)."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    w, x, y, z = max(((1 + a + e + i, h - f, c - g, d - b), (h - f, 1 + a - e - i, b + d, c + g),
                      (c - g, b + d, 1 - a + e - i, f + h), (d - b, c + g, f + h, 1 - a - e + i)),
                     key=lambda form: sum(v * v for v in form))
    sine = math.hypot(x, y, z)
    if sine == 0.0:
        return np.zeros(3)
    angle = 2.0 * math.atan2(sine, abs(w))
    return np.array([x, y, z]) * (math.copysign(angle, w) / sine)
