"""A platform that only translates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from ...mechanism.vectors import Array, pose
from ...tolerances import VANISHES
from .certify import Equation
from .conics import Conic, Numbers, direction, spatial_frame
from .curves import Circle, Curve, Line, Point, cross, extent, length, shifted
from .squares import Square, on_plane, on_sphere, resting, single
from .systems import alike


@dataclass(frozen=True, eq=False)
class Translating:
    """A platform that only translates: q = p, shape (3,). ``tips`` has shape (n, 3).

    The curves moved by −b_i share the point p. Two curves of one plane meet as often as their degrees say; two others
    do not meet at all unless one condition holds, so there one is met with a plane of the other, and the rest checked.
    """

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
        return max(0, 3 - sum(3 - curve.freedoms for curve in self.curves))

    @cached_property
    def paths(self) -> tuple[Curve, ...]:
        """The curves of p, one a leg."""
        return tuple(shifted(curve, -tip) for curve, tip in zip(self.curves, self.tips, strict=True))

    def pose(self, q: Array) -> Array:
        """The platform\'s frame in the base frame; shape (4, 4)."""
        return pose(q[:3])

    def misses(self, q: Array) -> Array:
        """What separates each tip from its curve; shape (legs, 3), metres."""
        return np.array([path.miss(q) for path in self.paths])

    def squares(self) -> Iterator[Square]:
        """A tip at rest, or pairs of paths, those of one plane first."""
        paths = self.paths
        moving = [k for k, curve in enumerate(self.curves) if not isinstance(curve, Point)]
        for k, path in enumerate(paths):
            if isinstance(path, Point):
                yield resting((k,), path.centre, len(paths) == 1)
        pairs = sorted(combinations(moving, 2), key=lambda two: not _coplanar(paths[two[0]], paths[two[1]], self.size))
        for i, j in pairs:
            if isinstance(paths[j], Line) and isinstance(paths[i], Circle):
                i, j = j, i
            yield self._square((i, j), len(self.curves) == 2 and _coplanar(paths[i], paths[j], self.size))

    def _square(self, legs: tuple[int, ...], whole: bool) -> Square:
        one, other = (self.paths[k] for k in legs)
        both = (one, other)
        frame = spatial_frame(both, extent(both, np.zeros((1, 3))))
        together = _coplanar(one, other, self.size)

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            centre = numbers.vector(frame.point(other.centre))
            if isinstance(other, Circle) and together:
                rho = numbers.vector(np.array([other.radius / frame.size]))[0]
                return [single(on_sphere(conics[0], centre, rho * rho))]
            normal = direction(_normal(one, other), frame, numbers)
            return [single(on_plane(conics[0], normal, normal @ centre))]

        return Square(legs, (one,), frame, build, lambda parameters: one.at(parameters[0]), whole)


def _normal(one: Curve, other: Curve) -> Array:
    """The normal of the plane of ``other`` that ``one`` is met with."""
    if isinstance(other, Circle):
        return other.axis
    assert isinstance(one, Line)
    assert isinstance(other, Line)
    n = cross(other.direction, cross(one.direction, other.direction))
    size = length(n)
    return n / size if size > 0 else n


def _coplanar(one: Curve, other: Curve, size: float) -> bool:
    """Whether two curves lie in one plane, to ``VANISHES``."""
    between = (other.centre - one.centre) / size
    circles = [curve for curve in (one, other) if isinstance(curve, Circle)]
    lines = [curve.direction for curve in (one, other) if isinstance(curve, Line)]
    if not circles:
        return abs(float(cross(*lines) @ between)) < VANISHES
    n = circles[0].axis
    tilt = [length(cross(n, circle.axis)) for circle in circles[1:]] + [float(n @ d) for d in lines]
    return all(abs(value) < VANISHES for value in [*tilt, float(n @ between)])
