"""Polynomial conditions of a leg on the pose of a rigid platform, read from its joints, all branches of it.

A pose is (R, p): the platform's point b is at x = p + R b, its direction c at d = R c; at the goal R = 1, p = 0. A
condition is a polynomial in x and d, so one in (R, p), of the given *degree*, where the entries of R and p count one.
Lengths are in sizes of the robot, counted from its middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.vectors import Array

Convert = Callable[[Array], Any]
"""From floats to the numbers in which a condition is evaluated."""


@dataclass(frozen=True, eq=False)
class PoseCondition:
    """A condition of leg ``leg`` on the platform's point ``b`` and its direction ``c``."""

    leg: str
    b: Array
    c: Array

    degree = 2

    @property
    def rates(self) -> Array:
        """The derivative at the goal by p and by the angles of a turn, of length one; shape (6,)."""
        along, turned = self.slopes(self.b, self.c, np.asarray)
        rates = np.hstack([along, np.cross(self.b, along) + np.cross(self.c, turned)])
        return np.asarray(rates / np.linalg.norm(rates))

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        """Value at x and d, shape (..., 3), of numbers made from floats by ``of``."""
        raise NotImplementedError

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        """The gradients by x and by d, shape (..., 3)."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class OnPlane(PoseCondition):
    """n · x = h."""

    n: Array
    h: float

    degree = 1

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        return x @ of(self.n) - of(np.array(self.h))

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        return of(self.n) + x * 0, d * 0


@dataclass(frozen=True, eq=False)
class AtAngle(PoseCondition):
    """a · d = h."""

    a: Array
    h: float

    degree = 1

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        return d @ of(self.a) - of(np.array(self.h))

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        return x * 0, of(self.a) + d * 0


@dataclass(frozen=True, eq=False)
class OnRevolution(PoseCondition):
    """A surface about an axis: |y|² − z² = f₀ + f₁ z + f₂ z² with y = x − o, z = a · y."""

    o: Array
    a: Array
    f: Array

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        y = x - of(self.o)
        z = y @ of(self.a)
        f = of(self.f)
        return np.sum(y * y, axis=-1) - z * z - f[0] - f[1] * z - f[2] * z * z

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        y, a, f = x - of(self.o), of(self.a), of(self.f)
        z = y @ a
        return 2 * y - np.multiply.outer(2 * z + f[1] + 2 * f[2] * z, a), d * 0


@dataclass(frozen=True, eq=False)
class OnCylinder(PoseCondition):
    """x − o is a spoke of a circle about n with the radius r, and a multiple of d: |v y − z d|² = v² r² with
    y = x − o, z = n · y, v = n · d."""

    o: Array
    n: Array
    r: Array
    d: Array

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        v, _, u = self._across(x, of)
        return np.sum(u * u, axis=-1) - (v * of(self.r)) ** 2

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        v, along, u = self._across(x, of)
        return 2 * (v * u - np.multiply.outer(u @ along, of(self.n))), d * 0

    def _across(self, x: Any, of: Convert) -> tuple[Any, Any, Any]:
        """v, d and v y − z d."""
        y, n, along = x - of(self.o), of(self.n), of(self.d)
        v = n @ along
        return v, along, v * y - np.multiply.outer(y @ n, along)


@dataclass(frozen=True, eq=False)
class OnTwoCircles(PoseCondition):
    """x − o is the sum of spokes of circles about n and m with the radii r and s.

    With e = n × m, f = n × e, w = |e|² the first spoke is r/√w (C e + S f); m · y = z gives r √w S = −z, and
    |y − spoke|² = s² then 2 r √w C e·y = w (|y|² + r² − s²) + 2 z f·y = Q: Q² = 4 (e·y)² (r² w − z²).
    """

    o: Array
    n: Array
    r: Array
    m: Array
    s: Array

    degree = 4

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        left, _, along, _, square, *_ = self._parts(x, of)
        return square * square - 4 * along * along * left

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        left, z, along, across, square, y, e, f = self._parts(x, of)
        outer, m = np.multiply.outer, of(self.m)
        by_square = 2 * (e @ e) * y + 2 * (outer(across, m) + outer(z, f))
        bent = outer(8 * along * left, e) - outer(8 * along * along * z, m)
        return np.asarray(2 * square)[..., None] * by_square - bent, d * 0

    def _parts(self, x: Any, of: Convert) -> tuple[Any, ...]:
        """r² w − z², z, e · y, f · y, Q, y, e, f."""
        y, n, m = x - of(self.o), of(self.n), of(self.m)
        e = np.array([n[j] * m[k] - n[k] * m[j] for _, j, k in CYCLES])
        f = np.array([n[j] * e[k] - n[k] * e[j] for _, j, k in CYCLES])
        w, z, r, s = e @ e, y @ m, of(self.r), of(self.s)
        square = w * (np.sum(y * y, axis=-1) + r * r - s * s) + 2 * z * (y @ f)
        return r * r * w - z * z, z, y @ e, y @ f, square, y, e, f


@dataclass(frozen=True, eq=False)
class OnMovingRevolution(PoseCondition):
    """A point o of the base on a surface about an axis d through x of the platform: as above with y = o − x."""

    o: Array
    f: Array

    degree = 4

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        y, f = of(self.o) - x, of(self.f)
        z = np.sum(y * d, axis=-1)
        return np.sum(y * y, axis=-1) - z * z - f[0] - f[1] * z - f[2] * z * z

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        y, f = of(self.o) - x, of(self.f)
        z = np.sum(y * d, axis=-1, keepdims=True)
        by_z = 2 * z + f[1] + 2 * f[2] * z
        return by_z * d - 2 * y, y * (-by_z)


@dataclass(frozen=True, eq=False)
class OnMovingPlane(PoseCondition):
    """A point o of the base in a plane of the platform: (o − x) · d = h."""

    o: Array
    h: float

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        return np.sum((of(self.o) - x) * d, axis=-1) - of(np.array(self.h))

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        return d * (-1), of(self.o) - x


@dataclass(frozen=True, eq=False)
class Coplanar(PoseCondition):
    """t, x − o and d lie in one plane: d · (t × (x − o)) = 0."""

    o: Array
    t: Array

    def value(self, x: Any, d: Any, of: Convert) -> Any:
        y, t = x - of(self.o), of(self.t)
        return sum(d[..., i] * (t[j] * y[..., k] - t[k] * y[..., j]) for i, j, k in CYCLES)

    def slopes(self, x: Any, d: Any, of: Convert) -> tuple[Any, Any]:
        y, t = x - of(self.o), of(self.t)
        return (
            np.stack([d[..., j] * t[k] - d[..., k] * t[j] for _, j, k in CYCLES], axis=-1),
            np.stack([t[j] * y[..., k] - t[k] * y[..., j] for _, j, k in CYCLES], axis=-1),
        )


CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
