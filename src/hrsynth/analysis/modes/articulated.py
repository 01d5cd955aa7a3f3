"""A platform of two bodies that translate, the second on a circle about the first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...errors import BadRequest
from ...mechanism.vectors import Array, frozen, pose
from ...tolerances import PARALLEL
from .certify import Equation
from .conics import Conic, Numbers, direction, spatial_frame
from .curves import Circle, Curve, Line, Point, cross, extent, length, shifted
from .squares import Square, on_plane, single, sum_on_plane, sum_on_sphere


@dataclass(frozen=True, eq=False)
class Articulated:
    """Two bodies that translate: q = (p, θ), p (3,) the first body's origin, θ where the second is on ``slide``.

    tip_i = p + b_i on the first body, p + slide(θ) + b_i on the second; ``bodies`` says which, 0 or 1, for each
    leg. The square systems take one leg of each body: with the tip of one as p, the sum (or difference) of two circles
    lies on the third curve.
    """

    curves: tuple[Curve, ...]
    tips: Array
    bodies: tuple[int, ...]
    slide: Circle

    def __post_init__(self) -> None:
        object.__setattr__(self, "tips", frozen(self.tips))
        if self.tips.shape != (len(self.curves), 3) or len(self.bodies) != len(self.curves):
            raise BadRequest("tips of a platform", list(self.tips.shape), f"{len(self.curves)} by 3, a body each")
        if not set(self.bodies) <= {0, 1}:
            raise BadRequest("bodies of an articulated platform", self.bodies, "0 or 1 for each leg")

    @cached_property
    def size(self) -> float:
        """What residuals are divided by (m)."""
        return max(extent(self.curves, self.tips), self.slide.radius)

    @property
    def missing(self) -> int:
        """Freedoms that too few legs leave."""
        sides = [[3 - curve.freedoms for curve, side in zip(self.curves, self.bodies, strict=True) if side == body]
                 for body in (0, 1)]
        return max(0, 4 - sum(map(sum, sides)), *(1 for side in sides if not side))

    @cached_property
    def paths(self) -> tuple[Curve, ...]:
        """The curves of each leg's own body's origin."""
        return tuple(shifted(curve, -tip) for curve, tip in zip(self.curves, self.tips, strict=True))

    def pose(self, q: Array) -> Array:
        """The first body's frame in the base frame; shape (4, 4)."""
        return pose(q[:3])

    def misses(self, q: Array) -> Array:
        """What separates each tip from its curve; shape (legs, 3), metres."""
        origins = (q[:3], q[:3] + self.slide.at(float(q[3])))
        return np.array([path.miss(origins[body]) for path, body in zip(self.paths, self.bodies, strict=True)])

    def squares(self) -> Iterator[Square]:
        """The pairs of legs, one on each body, each in both roles; first those where no plane is the slide's own."""
        one, two = ([k for k, side in enumerate(self.bodies) if side == body] for body in (0, 1))
        roles = [legs for i in one for j in two for legs in ((i, j), (j, i))]
        for legs in sorted(roles, key=lambda legs: self._along_slide(self.curves[legs[1]])):
            if not isinstance(self.curves[legs[1]], Point):
                yield self._square(legs)

    def _along_slide(self, curve: Curve) -> bool:
        """Whether a circle lies in a plane parallel to the slide's."""
        return isinstance(curve, Circle) and length(cross(curve.axis, self.slide.axis)) < PARALLEL

    def _square(self, legs: tuple[int, int]) -> Square:
        """The first leg's tip carries the slide to the second leg's curve."""
        first, onto = (self.paths[k] for k in legs)
        sign = 1 if self.bodies[legs[0]] == 0 else -1
        size = max(extent((first, onto), np.zeros((1, 3))), self.slide.radius, length(self.slide.centre))
        middle = (first.centre + onto.centre) / 2
        start, end = shifted(first, -middle), shifted(onto, -middle)
        frame = replace(spatial_frame((start, end, self.slide), size), origin=np.zeros(3))
        resting = isinstance(first, Point)

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            centre = numbers.vector(frame.point(end.centre))
            normals = [direction(n, frame, numbers) for n in _normals(onto)]
            if resting:
                left = centre - numbers.vector(frame.point(start.centre))
                quadratics = [on_plane(conics[0], sign * n, n @ left) for n in normals]
                return [single(quadratics[0])]
            tables = [sum_on_plane(conics[0], conics[1], sign, n, n @ centre) for n in normals]
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
        return Square(legs, unknowns, frame, build, place, whole)


def _normals(curve: Curve) -> tuple[Array, ...]:
    """The plane of a circle, or two planes that hold a line: their normals."""
    if isinstance(curve, Line):
        first = np.linalg.svd(curve.direction[None])[2][1]
        return first, cross(curve.direction, first)
    assert isinstance(curve, Circle)
    return (curve.axis,)
