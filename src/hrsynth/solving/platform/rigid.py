"""A rigid platform, in a plane or in space."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ...errors import BadRequest
from ...geometry.loci import Circle, Curve, Line, Point, Surface, curves_of, extent, length
from ...geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ...geometry.vectors import Array, build_pose, cross
from ...tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL
from .constrained_platform import System, register
from .polynomials import Equation
from .quadrics import (
    Conic,
    MovingPoint,
    Numbers,
    PoseParametrization,
    WorkingFrame,
    build_distance,
    build_shifting,
    choose_frame,
    choose_planar_frame,
    convert_direction,
    put_on_circle,
    put_on_sphere,
)
from .square_systems import SquareSystem, make_fixed_square, make_single
from .study_coordinates import build_study_chart


@dataclass(frozen=True, eq=False, repr=False)
class Planar(System):
    """A platform that moves in the plane of ``X_plane`` (4, 4), whose z axis is the normal: q = (x, y, φ).

    ``tips`` are their coordinates in the platform's frame, shape (n, 2); X_platform = X_plane · (turn φ, shift (x, y)).
    """

    X_plane: Array

    freedoms = 3
    space = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        n = self.X_plane[:3, 2]
        for curve in self.curves:
            off = (
                length(cross(n, curve.axis))
                if isinstance(curve, Circle)
                else abs(float(n @ curve.direction))
                if isinstance(curve, Line)
                else 0.0
            )
            if off > DIRECTION_SINE_TOL:
                raise BadRequest(
                    "sine of a locus's angle with the plane of motion", off, f"at most {DIRECTION_SINE_TOL}"
                )
        if self.has_surface_loci:
            raise BadRequest("the loci of tips in a plane", "a surface", "points, lines and circles")

    def position(self, origin: Array) -> Array:
        """The coordinates (2,) of a platform whose origin is at a point (3,)."""
        return np.asarray((origin - self.X_plane[:3, 3]) @ self.X_plane[:3, :2])

    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""
        c, s = math.cos(q[2]), math.sin(q[2])
        return np.asarray(self.X_plane @ np.array([[c, -s, 0, q[0]], [s, c, 0, q[1]], [0, 0, 1, 0], [0, 0, 0, 1]]))

    def tips_at(self, q: Array) -> Array:
        """Return the positions of the tips at a pose, each in the plane of its own curve; shape (legs, 3), metres."""
        X, n = self.pose(q), self.X_plane[:3, 2]
        tips = []
        for curve, tip in zip(self.curves, self.tips, strict=True):
            at = X[:3, 3] + X[:3, :2] @ tip
            tips.append(at - n * float(n @ (at - curve.centre)))
        return np.array(tips)

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """Return how far the platform's frame (m) and rotation (rad) can be from those at q; see ``registered``."""
        return register(self.tips, apart)

    @cached_property
    def frame(self) -> WorkingFrame:
        """A working frame in the plane of motion."""
        return choose_planar_frame(self.curves, self.X_plane, self.size)

    def chart(self, number: int) -> PoseParametrization:
        """x, y, cos and sin of the turn from the working frame to the platform's."""
        frame = self.frame

        def tips(numbers: Numbers) -> list[MovingPoint]:
            points = []
            for tip in self.tips:
                b = numbers.vector(tip / frame.size)
                points.append(build_shifting(4, b * 0, ((3, b), (4, np.array([-b[1], b[0]], dtype=object)))))
            return points

        def place(x: Sequence[float]) -> Array:
            at = frame.origin + frame.size * (np.array(x[:2]) @ frame.R)
            first = self.X_plane[:3, :2].T @ (np.array(x[2:]) @ frame.R)
            return np.array([*self.position(at), math.atan2(first[1], first[0])])

        return PoseParametrization(frame, 4, self.curves, tips, (put_on_circle(4, 3, 4),), place)

    def squares(self) -> Iterator[SquareSystem]:
        """Two pivots, a pivot and a curve, or three curves in each order that two tips apart allow."""
        points = [k for k, curve in enumerate(self.curves) if isinstance(curve, Point)]
        moving = [k for k in range(len(self.curves)) if k not in points]
        apart = POINT_DISTANCE_TOL * self.size
        for i, j in combinations(points, 2):
            if length(self.tips[i] - self.tips[j]) > apart:
                yield make_fixed_square((i, j), self._square((i, j), False).place(()), False)
        for i, j in ((i, j) for i in points for j in moving):
            if length(self.tips[i] - self.tips[j]) > apart:
                yield self._square((i, j), len(self.curves) == 2)
        for legs in combinations(moving, 3):
            for i, j, k in (legs, (legs[1], legs[2], legs[0]), (legs[2], legs[0], legs[1])):
                if length(self.tips[i] - self.tips[j]) > apart:
                    yield self._square((i, j, k), len(self.curves) == 3)

    def _square(self, legs: tuple[int, ...], whole: bool) -> SquareSystem:
        curves = tuple(curve for k in legs if not isinstance(curve := self.curves[k], Surface))
        b = self.tips[list(legs)]
        frame = choose_planar_frame(curves, self.X_plane, extent(curves, b))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            tips = [numbers.vector(tip / frame.size) for tip in b]
            arm = tips[1] - tips[0]
            if len(legs) == 2:
                held = numbers.vector(frame.point(curves[0].centre))
                return [make_single(put_on_sphere(conics[0], held, arm @ arm))]
            f = build_distance(conics[0], conics[1], arm @ arm)
            return [Equation(f, 0, 1), Equation(_build_third(conics, tips, curves[2], frame, numbers), 0, 1)]

        def place(parameters: Sequence[float]) -> Array:
            free = iter(parameters)
            two = np.array([curve.centre if isinstance(curve, Point) else curve.at(next(free)) for curve in curves[:2]])
            flat = self.position(two)
            turn = complex(*(flat[1] - flat[0])) / complex(*(b[1] - b[0]))
            at = flat[0] - _turn_vector(turn / abs(turn), b[0])
            return np.array([*at, cmath.phase(turn)])

        unknowns = tuple(curve for curve in curves[:2] if not isinstance(curve, Point))
        return SquareSystem(legs, unknowns, frame, build, place, whole)


def _build_third(
    conics: Sequence[Conic], tips: Sequence[Any], curve: Curve, frame: WorkingFrame, numbers: Numbers
) -> Any:
    """The table of *tip₃ on its curve*, with γ tip₃ = α tip₁ + β tip₂ in complex numbers: α = b₂ − b₃, β = b₃ − b₁."""
    alpha, beta, gamma = (_build_multiplication(v) for v in (tips[1] - tips[2], tips[2] - tips[0], tips[1] - tips[0]))
    first, second = conics
    scale = (gamma.T @ gamma)[0, 0]
    centre = numbers.vector(frame.point(curve.centre))
    if isinstance(curve, Line):
        # n · (γ̄ γ tip₃) = |γ|² n · c, with n normal to the line through c
        d = convert_direction(curve.direction, frame, numbers)
        normal = np.array([-d[1], d[0]])
        a, b = alpha.T @ gamma @ normal, beta.T @ gamma @ normal
        return (
            np.outer(first.N @ a, second.w)
            + np.outer(first.w, second.N @ b)
            - scale * (normal @ centre) * np.outer(first.w, second.w)
        )
    assert isinstance(curve, Circle)
    # |α tip₁ + β tip₂ − γ c|² = |γ|² ρ²
    rho = numbers.vector(np.array([curve.radius / frame.size]))[0]
    a, b = alpha.T @ gamma @ centre, beta.T @ gamma @ centre
    return (
        np.outer((alpha.T @ alpha)[0, 0] * first.Q - 2 * (first.N @ a), second.w)
        + np.outer(first.w, (beta.T @ beta)[0, 0] * second.Q - 2 * (second.N @ b))
        + 2 * (first.N @ (alpha.T @ beta) @ second.N.T)
        + scale * (centre @ centre - rho * rho) * np.outer(first.w, second.w)
    )


def _turn_vector(turn: complex, v: Array) -> tuple[float, float]:
    """A vector of the plane multiplied by a complex number."""
    product = turn * complex(*v)
    return product.real, product.imag


def _build_multiplication(v: Any) -> Any:
    """Multiplication by the complex number v, as a matrix; shape (2, 2)."""
    return np.array([[v[0], -v[1]], [v[1], v[0]]], dtype=object)


@dataclass(frozen=True, eq=False, repr=False)
class Spatial(System):
    """A rigid platform in space: q = (p, rotation vector); ``tips`` has shape (n, 3), no three used on one line.

    The last ``arrows`` of the tips are none of its points but vectors that turn with it; they start at ``hub`` (3,) in
    the base frame, and their curves are planes: what keeps an angle.
    """

    arrows: int = 0
    hub: Array = field(default_factory=lambda: np.zeros(3))

    freedoms = 6

    @property
    def points(self) -> Array:
        """The tips that are points of the platform, shape (n - arrows, 3)."""
        return self.tips[: len(self.tips) - self.arrows]

    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""
        return build_pose(q[:3], convert_vectors_to_rotations(q[3:]))

    def tips_at(self, q: Array) -> Array:
        """Return the positions of the tips at a pose; shape (legs, 3), metres."""
        X = self.pose(q)
        at = self.tips @ X[:3, :3].T
        return np.vstack([X[:3, 3] + at[: len(self.points)], self.hub + at[len(self.points) :]])

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """Return how far the platform's frame (m) and rotation (rad) can be from those at q; see ``registered``."""
        return register(self.tips, apart, self.arrows)

    def chart(self, number: int) -> PoseParametrization:
        """Study's coordinates, with a linear form of the quaternion that depends on the number made 1."""
        return build_study_chart(self.curves, self.tips, self.size, number, self.arrows, self.hub)

    def squares(self) -> Iterator[SquareSystem]:
        """Yield three fixed tips; two, one or none and as many curves as make three, with tips not on one line."""
        points = [k for k, curve in enumerate(self.curves) if isinstance(curve, Point)]
        moving = [k for k in curves_of(self.curves) if k not in points]
        choices = list(combinations(points, 3)) + [(i, j, k) for j, k in combinations(points, 2) for i in moving]
        choices += [(i, j, k) for k in points for i, j in combinations(moving, 2)] + list(combinations(moving, 3))
        for legs in choices:
            a, b, c = self.tips[list(legs)]
            if length(cross(b - a, c - a)) > POINT_DISTANCE_TOL * self.size**2:
                yield self._square(legs, len(moving) == len(self.curves) == 3)

    def _square(self, legs: tuple[int, ...], whole: bool) -> SquareSystem:
        """Return the system of three distances between three tips; with fixed tips, given last, those that determine
        the others."""
        curves = tuple(curve for k in legs if not isinstance(curve := self.curves[k], Surface))
        b = self.tips[list(legs)]
        unknowns = tuple(curve for curve in curves if not isinstance(curve, Point))
        frame = choose_frame(curves, extent(curves, b))

        def build(conics: Sequence[Conic], numbers: Numbers) -> list[Equation]:
            tips = [numbers.vector(tip / frame.size) for tip in b]
            arms = [(i, j, tips[j] - tips[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
            if not unknowns:
                return []
            if len(unknowns) == 1:
                held = numbers.vector(frame.point(curves[1].centre))
                return [make_single(put_on_sphere(conics[0], held, arms[0][2] @ arms[0][2]))]
            if len(unknowns) == 2:
                held = numbers.vector(frame.point(curves[2].centre))
                reach = put_on_sphere(conics[1], held, arms[1][2] @ arms[1][2])
                return [
                    Equation(build_distance(conics[0], conics[1], arms[0][2] @ arms[0][2]), 0, 1),
                    Equation(np.outer(np.array([1, 0, 0], dtype=object), reach), 0, 1),
                ]
            return [Equation(build_distance(conics[i], conics[j], v @ v), i, j) for i, j, v in arms]

        def place(parameters: Sequence[float]) -> Array:
            free = iter(parameters)
            three = np.array([curve.at(0.0 if isinstance(curve, Point) else next(free)) for curve in curves])
            R = _build_triad(three) @ _build_triad(b).T
            return np.array([*(three.mean(axis=0) - R @ b.mean(axis=0)), *convert_rotations_to_vectors(R)])

        return SquareSystem(legs, unknowns, frame, build, place, whole)


def _build_triad(points: Array) -> Array:
    """A right-handed triad of three points, equal for congruent ones; its columns, shape (3, 3)."""
    first, second = points[1] - points[0], points[2] - points[0]
    e = first / length(first)
    n = cross(first, second)
    n = n / length(n)
    return np.column_stack([e, cross(n, e), n])
