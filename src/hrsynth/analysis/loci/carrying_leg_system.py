"""A platform that one leg of R and P carries, the other legs being conditions on its pose, as that of an ankle whose
two axes do not meet (docs/pages/proofs.md, section 8).

With x = o + (c (1 - a aᵀ) + a aᵀ + s [a]ₓ)(y - o) for a turn about a through o, c² + s² = 1, a condition is a
polynomial of known degree d in each c, s: of degree 2 d in the tangent of the half-angle. As many conditions as the leg
has joints have at most as many isolated common zeros as the permanent of these degrees (Bézout in a product of lines).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, permutations, product
from math import prod
from typing import Any

import numpy as np

from ...geometry.vectors import Array, build_pose, cross, hat
from ...solving.platform.constrained_platform import System
from ...solving.platform.pose_boxes import Zero
from ...solving.platform.pose_conditions import (
    AtAngle,
    OnMovingPlane,
    OnMovingRevolution,
    OnPlane,
    OnRevolution,
    PoseCondition,
)
from ...solving.platform.pose_forms import Poses
from ...tolerances import CHAIN_ROUNDING, DIRECTION_SINE_TOL, INDEPENDENT_RATES_MIN
from .leg_conditions import OriginAndUnit
from .observation_loci import PlatformObservation


@dataclass(frozen=True, eq=False)
class Turn:
    """A turn about the ``axis`` through ``point`` (sizes) at the goal, or a slide along it."""

    axis: Array
    point: Array
    slides: bool

    def maps(self, of: Any) -> tuple[Any, Any, Any]:
        """Parts that do not depend on its angle, and that c and s multiply; shape (3, 3) each."""
        along = np.outer(self.axis, self.axis)
        return of(along), of(np.eye(3) - along), of(hat(self.axis))


@dataclass(frozen=True, eq=False)
class CarriedCondition:
    """A condition on the body that the first ``joints`` of the leg carry."""

    condition: PoseCondition
    joints: int
    idle: frozenset[int] = frozenset()
    """Joints that change nothing of it."""
    moved: float = 0.0
    """How far axes are off where they should be for that (sizes)."""

    @classmethod
    def of(cls, condition: PoseCondition, freedoms: Sequence[Turn]) -> CarriedCondition:
        """With the joints before which nothing rotates the base point, or after which nothing rotates the point of the
        body."""
        idle, off = set[int](), 0.0
        for order, misses in ((range(len(freedoms)), _measure_before), (range(len(freedoms))[::-1], _measure_after)):
            for k in order:
                miss = misses(condition, freedoms[k])
                if miss > DIRECTION_SINE_TOL:
                    break
                idle.add(k)
                off += miss if miss > CHAIN_ROUNDING else 0.0
        return cls(condition, len(freedoms), frozenset(idle), off)

    def degree(self, k: int, freedom: Turn) -> int:
        """In the tangent of half of joint k's angle, or in its slide. The square of a distance has degree one in c and
        s."""
        c = self.condition
        if k >= self.joints or k in self.idle:
            return 0
        if freedom.slides:
            return 0 if isinstance(c, AtAngle) else c.degree
        around = isinstance(c, OnRevolution | OnMovingRevolution)
        once = isinstance(c, OnMovingPlane) or (around and float(c.f[2]) == -1.0)  # type: ignore[attr-defined]
        return 2 * (1 if once else 2 if around else c.degree)


def _measure_before(c: PoseCondition, freedom: Turn) -> float:
    """Return how far a joint next to the base is from leaving a condition unchanged; infinite if it is of another
    kind."""
    a = freedom.axis
    if isinstance(c, OnPlane):
        return abs(float(c.n @ a)) if freedom.slides else float(np.linalg.norm(np.cross(c.n, a)))
    if isinstance(c, AtAngle):
        return 0.0 if freedom.slides else float(np.linalg.norm(np.cross(c.a, a)))
    if isinstance(c, OnRevolution) and not freedom.slides:
        tilt = 0.0 if _is_sphere_condition(c) else float(np.linalg.norm(np.cross(c.a, a)))
        return max(tilt, float(np.linalg.norm(np.cross(c.o - freedom.point, a))))
    return np.inf


def _measure_after(c: PoseCondition, freedom: Turn) -> float:
    """Return that distance for a joint next to the body."""
    a, turned = freedom.axis, float(np.linalg.norm(np.cross(c.c, freedom.axis)))
    if freedom.slides:
        return 0.0 if isinstance(c, AtAngle) else np.inf
    return turned if isinstance(c, AtAngle) else max(turned, float(np.linalg.norm(np.cross(c.b - freedom.point, a))))


def _is_sphere_condition(c: PoseCondition) -> bool:
    """Return True if it is a distance, not a height."""
    return isinstance(c, OnRevolution) and float(c.f[2]) == -1.0 and float(c.f[1]) == 0.0


@dataclass(frozen=True, eq=False)
class CarriedEquation(Zero):
    """A condition in all c, all s and slides t (0 and 1 besides), with numbers in balls."""

    freedoms: tuple[Turn, ...]
    joints: int

    @cached_property
    def _maps(self) -> list[tuple[Any, ...]]:
        return [(*freedom.maps(self.of), self.of(freedom.point), self.of(freedom.axis)) for freedom in self.freedoms]

    def point_and_arrow(self, x: Sequence[Any]) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """The point and the arrow, and their derivatives by the unknowns, by number."""
        n = len(self.freedoms)
        p, d = self.of(self.condition.b) + 0 * x[0], self.of(self.condition.c) + 0 * x[0]
        slopes: list[tuple[int, Any, Any]] = []
        for k in range(self.joints - 1, -1, -1):
            rest, c, s, o, a = self._maps[k]
            if self.freedoms[k].slides:
                slopes.append((2 * n + k, a + 0 * p, 0 * d))
                p = p + a * x[2 * n + k]
                continue
            turn = rest + c * x[k] + s * x[n + k]
            slopes = [(j, turn @ dp, turn @ dd) for j, dp, dd in slopes]
            slopes += [(k, c @ (p - o), c @ d), (n + k, s @ (p - o), s @ d)]
            p, d = o + turn @ (p - o), turn @ d
        return p, d, slopes

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        point, arrow, _ = self.point_and_arrow(x)
        return self.condition.value(point, arrow, self._of)

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        point, arrow, by = self.point_and_arrow(x)
        along, turned = self.condition.slopes(point, arrow, self._of)
        slopes = [0 * v for v in x]
        for j, dp, dd in by:
            slopes[j] = along @ dp + turned @ dd
        return slopes


@dataclass(frozen=True, eq=False, repr=False)
class CarriedPlatform(System):
    """A platform that a leg carries; q are its angles (rad) and slides (sizes) since the goal."""

    freedoms_: tuple[Turn, ...]
    """Joints, those that carry the platform first."""
    told: tuple[CarriedCondition, ...]
    middle: OriginAndUnit
    start: Array
    """The platform at the goal (4, 4)."""
    seen: tuple[PlatformObservation, ...] = field(default=(), kw_only=True)
    rows: Array = field(default_factory=lambda: np.eye(3), kw_only=True)
    """Rotations and conditions are relative to these axes (3, 3)."""

    @property
    def carrying(self) -> int:
        """Number of joints that carry the platform."""
        return len(self.freedoms_)

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.middle.size

    @property
    def home(self) -> Array:
        """The goal."""
        return np.zeros(len(self.freedoms_))

    def transform(self, q: Array, joints: int | None = None) -> tuple[Array, Array]:
        """R and p (..., 3) (sizes) of what the first joints carry, at complex coordinates (..., n) too."""
        q = np.asarray(q)
        R = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
        p = np.zeros((*q.shape[:-1], 3))
        for k in range(len(self.freedoms_) if joints is None else joints)[::-1]:
            freedom, by = self.freedoms_[k], q[..., k, None, None]
            if freedom.slides:
                p = p + freedom.axis * by[..., 0]
                continue
            rest, c, s = freedom.maps(np.asarray)
            turn = rest + c * np.cos(by) + s * np.sin(by)
            p = freedom.point + np.einsum("...ij,...j->...i", turn, p - freedom.point)
            R = turn @ R
        return R, p

    def pose(self, q: Array) -> Array:
        """The platform's pose (4, 4), m."""
        R, p = self.transform(q, self.carrying)
        R, p, o = self.rows.T @ R @ self.rows, self.rows.T @ p, self.middle.origin
        return np.asarray(build_pose(o + self.size * p - R @ o, R) @ self.start)

    def values(self, q: Array, chosen: Sequence[CarriedCondition]) -> tuple[Array, Array]:
        """The values (..., m) of conditions and their derivatives (..., m, n) by q."""
        values, slopes = [], []
        if not chosen:
            return np.zeros((*np.shape(q)[:-1], 0)), np.zeros((*np.shape(q)[:-1], 0, len(self.freedoms_)))
        for carried in chosen:
            c, columns = carried.condition, []
            R, p = self.transform(q, carried.joints)
            x, d = p + R @ c.b, R @ c.c
            values.append(c.value(x, d, np.asarray))
            along, turned = c.slopes(x, d, np.asarray)
            for k, freedom in enumerate(self.freedoms_):
                if k >= carried.joints:
                    columns.append(0 * values[-1])
                    continue
                Q, o = self.transform(q, k)
                axis, point = Q @ freedom.axis, o + Q @ freedom.point
                by_x = axis + 0 * x if freedom.slides else cross(axis, x - point)
                by_d = 0 * d if freedom.slides else cross(axis, d)
                columns.append(np.sum(along * by_x + turned * by_d, axis=-1))
            slopes.append(np.stack(columns, axis=-1))
        return np.stack(values, axis=-1), np.stack(slopes, axis=-2)

    def most(self, chosen: Sequence[CarriedCondition]) -> int:
        """Return a bound of the isolated common zeros of as many conditions as joints."""
        n = len(self.freedoms_)
        degrees = np.array([[carried.degree(k, f) for k, f in enumerate(self.freedoms_)] for carried in chosen])
        alike = [i for i, carried in enumerate(chosen) if _is_sphere_condition(carried.condition)]
        slides = [k for k, freedom in enumerate(self.freedoms_) if freedom.slides]
        tables = [degrees]
        for kept in alike if slides else ():  # the squares of slides are the same in all: differences have none
            tables.append(table := degrees.copy())
            for i in alike:
                if i != kept and chosen[i].joints == chosen[kept].joints:
                    table[i] = np.maximum(degrees[i], degrees[kept])
                    table[i, slides] = np.minimum(table[i, slides], 1)
        bounds = [compute_permanent(table) for table in tables]
        for (i, j), table in product(combinations(range(n), 2), tables):
            rest = [k for k in range(n) if k not in (i, j)]
            if self._has_common_point(chosen[i], chosen[j]) and not table[rest, 0].any():
                bent = np.where(degrees[[i, j], 1:].any(axis=0), 4, 0)
                bounds.append(compute_permanent(np.vstack([bent, table[rest, 1:]])))
        return min(bounds)

    def _has_common_point(self, one: CarriedCondition, other: CarriedCondition) -> bool:
        """Return True if two conditions fix one point, and give the rotation of the first joint about its axis: N R η =
        A with |R η| = |η|, so |N⁻¹ A|² = |η|², of degree two in the other joints' c and s, and one turn for each
        zero."""
        o, a = self.freedoms_[0].point, self.freedoms_[0].axis
        if self.freedoms_[0].slides or one.joints != other.joints or np.any(one.condition.b != other.condition.b):
            return False
        rows = [
            c.n if isinstance(c, OnPlane) else c.o - o
            for c in (one.condition, other.condition)
            if isinstance(c, OnPlane) or (isinstance(c, OnRevolution) and _is_sphere_condition(c))
        ]
        return len(rows) == 2 and abs(float(a @ np.cross(rows[0], rows[1]))) > DIRECTION_SINE_TOL

    @cached_property
    def square(self) -> tuple[CarriedCondition, ...]:
        """As many conditions as joints, independent at the goal, with the fewest zeros; none if there are no such."""
        best: tuple[int, tuple[CarriedCondition, ...]] | None = None
        for chosen in combinations(self.told, len(self.freedoms_)):
            most = self.most(chosen)
            if most and (best is None or most < best[0]):
                rows = self.values(self.home, chosen)[1]
                rows = rows / np.maximum(np.linalg.norm(rows, axis=1), INDEPENDENT_RATES_MIN)[:, None]
                if np.linalg.svd(rows, compute_uv=False)[-1] > INDEPENDENT_RATES_MIN:
                    best = most, chosen
        return () if best is None else best[1]

    def equation(self, each: CarriedCondition) -> CarriedEquation:
        """A condition in balls."""
        return CarriedEquation(each.condition, Poses.spatial(), self.error / self.size, self.freedoms_, each.joints)

    def unknowns(self, q: Array) -> Array:
        """All c, all s and slides t."""
        slides = np.array([freedom.slides for freedom in self.freedoms_])
        return np.concatenate(
            [np.where(slides, 1.0, np.cos(q)), np.where(slides, 0.0, np.sin(q)), np.where(slides, q, 0.0)]
        )


def compute_permanent(degrees: Array) -> int:
    """Bézout's number in a product of lines."""
    return sum(prod(int(degrees[i, j]) for i, j in enumerate(order)) for order in permutations(range(len(degrees))))
