"""Platform whose tips are confined, as the solver needs it.

A system knows its poses, q, how far the tips of a pose miss what they can reach, its *squares*: the choices of legs on
curves that give as many equations as unknowns, and its *chart*: coordinates of the pose in which all conditions are of
degree two. All curves and surfaces are in one frame, the base frame; ``tips`` are in the platform's frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np

from ...errors import BadRequest
from ...geometry.loci import Point, Reach, curves_of, extent, length, shift_reach
from ...geometry.vectors import Array, build_pose, freeze_array
from ...results import Value
from ...tolerances import SOLUTION_DISTANCE_MAX, TIP_ROUNDING
from .quadrics import UNIT, WORKING_FRAME_ROUNDING_TOL, Balls, PoseParametrization, Within, WorkingFrame, choose_frame
from .square_systems import SquareSystem

ELIMINATION_SECONDS, HOMOTOPY_SECONDS, MSOLVE_SECONDS = 0.02, 0.4, 2.0
"""Estimated time of one system (s): exact resultant, forty paths, external program."""


@dataclass(frozen=True, eq=False, repr=False)
class System(Value):
    """A platform of which ``tips`` (n, d) are confined to ``curves`` (or surfaces), one a leg."""

    curves: tuple[Reach, ...]
    tips: Array
    error: float = field(default=0.0, kw_only=True)
    """Distance of a point from that of the exact input (m), besides rounding: closed loops."""
    as_written: bool = field(default=False, kw_only=True)
    """True if the numbers count as they are, without special geometry."""

    freedoms: ClassVar[int]
    """Number of coordinates of a pose; the first d are lengths (m), the others angles (rad)."""
    space: ClassVar[int] = 3
    """d: number of directions in which a tip moves."""
    rigid: ClassVar[bool] = True
    """True if all tips are those of one body that rotates, and the points solved for theirs."""

    def __post_init__(self) -> None:
        tips = freeze_array(self.tips)
        if tips.shape != (len(self.curves), self.space) or not np.all(np.isfinite(tips)):
            raise BadRequest(
                "shape of a platform's tips", list(tips.shape), f"{len(self.curves)} by {self.space} finite numbers"
            )
        object.__setattr__(self, "tips", tips)

    @cached_property
    def size(self) -> float:
        """Unit of residuals (m)."""
        return extent(self.curves, self.tips)

    @cached_property
    def forbids(self) -> tuple[int, ...]:
        """Number of equations of each leg."""
        return tuple(self.space - curve.freedoms for curve in self.curves)

    @property
    def seconds(self) -> float:
        """Estimated time of its list on one core (s)."""
        if not self.has_surface_loci:
            return ELIMINATION_SECONDS
        return HOMOTOPY_SECONDS if self.rigid else MSOLVE_SECONDS

    @property
    def missing(self) -> int:
        """Dof that too few legs leave: the dimension of the continuous family, 0 if there are enough legs."""
        return self.freedoms_left(range(len(self.curves)))

    def freedoms_left(self, legs: Sequence[int]) -> int:
        """Return the dof that some legs leave."""
        return max(0, self.freedoms - sum(self.forbids[k] for k in legs))

    @property
    def has_surface_loci(self) -> bool:
        """True if a tip is confined to a surface only."""
        return len(curves_of(self.curves)) < len(self.curves)

    @property
    def farthest(self) -> float:
        """Beyond which a solution is at infinity but for rounding (sizes)."""
        return math.inf if self.as_written else SOLUTION_DISTANCE_MAX

    def balls(self, frame: WorkingFrame | None) -> Within:
        """Balls that hold the exact input in a working frame; the finest where it is not known how far it is."""
        if frame is None or not np.isfinite(self.error):
            return Balls
        return Within(WORKING_FRAME_ROUNDING_TOL + UNIT * self.error / min(frame.size, self.size))

    @cached_property
    def frame(self) -> WorkingFrame:
        """A working frame for all tips and what they can reach."""
        return choose_frame(self.curves, self.size)

    def apart(
        self, q: Array, at: Array, legs: Sequence[int], points: Sequence[tuple[Array, float]]
    ) -> dict[int, float]:
        """Return how far the tips of some legs can be from those at q (m), which are ``at`` (legs, 3), with the point
        on each leg's curve and how far the exact one is from it (m); a fixed tip has no such point."""
        error = self.error + TIP_ROUNDING * self.size
        return {k: miss + length(point - at[k]) + error for k, (point, miss) in self.known_tips(legs, points).items()}

    def known_tips(self, legs: Sequence[int], points: Sequence[tuple[Array, float]]) -> dict[int, tuple[Array, float]]:
        """Return the ``points`` of those of some legs that are not fixed, in their order, and the indices of those that
        are."""
        resting = [k for k in legs if isinstance(self.curves[k], Point)]
        known = {k: (self.curves[k].centre, 0.0) for k in resting}
        return known | dict(zip((k for k in legs if k not in resting), points, strict=False))

    def spread(self, q: Array, apart: Mapping[int, float]) -> tuple[float, float]:
        """Return how far the platform's frame (m) and rotation (rad) can be from those at q, with tips within the
        distances ``apart`` from theirs (m)."""
        raise NotImplementedError

    def misses(self, q: Array) -> Array:
        """Return the difference between each tip and its locus at a pose; shape (legs, 3), metres."""
        return self.off(self.tips_at(q))

    def off(self, at: Array) -> Array:
        """Return the difference between tips ``at`` (legs, 3) and their loci; shape (legs, 3), metres."""
        return np.array([curve.miss(tip) for curve, tip in zip(self.curves, at, strict=True)])

    def residual(self, at: Array) -> float:
        """The largest distance of tips ``at`` (legs, 3) from their curves, in sizes of the mechanism."""
        return float(np.linalg.norm(self.off(at), axis=1).max()) / self.size

    def somewhere(self, rng: np.random.Generator) -> Array:
        """A random pose within the size of the system."""
        middle = sum(curve.centre for curve in self.curves) / len(self.curves)
        at = self.position(np.asarray(middle)) + self.size * rng.uniform(-1.0, 1.0, self.space)
        return np.array([*at, *rng.uniform(-np.pi, np.pi, self.freedoms - self.space)])

    def position(self, origin: Array) -> Array:
        """The coordinates (d,) of a platform whose origin is at a point (3,)."""
        return origin

    def tips_at(self, q: Array) -> Array:
        """Return the positions of the tips at a pose; shape (legs, 3), metres."""
        raise NotImplementedError

    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""
        raise NotImplementedError

    def squares(self) -> Iterator[SquareSystem]:
        """The choices of legs that can be solved by elimination, best first."""
        raise NotImplementedError

    def chart(self, number: int) -> PoseParametrization:
        """Coordinates of the pose; where there are many charts, that of a number."""
        raise NotImplementedError


def register(tips: Array, apart: Mapping[int, float], arrows: int = 0) -> tuple[float, float]:
    """Return how far the origin of a rigid body (m) can be moved and how far the body rotated (rad), at most, if its
    points ``tips`` (n, d) are moved by at most the distances ``apart`` (m); the last ``arrows`` only turn with it.

    With the points' mean c, a turn φ about a unit n moves b − c by 2 sin(φ/2) |n × (b − c)| against the mean, and an
    arrow as if it were b − c; the sum of |n × (b − c)|² is at least that of |b − c|² less the largest eigenvalue of
    Σ (b − c)(b − c)ᵀ (in the plane: all).
    """
    points = [k for k in apart if k < len(tips) - arrows]
    turned = [k for k in apart if k not in points]
    if not points:
        return math.inf, math.pi
    mean, seen = _spread(tuple(map(tuple, tips[points].tolist())), tuple(map(tuple, tips[turned].tolist())))
    moved = math.hypot(*apart.values()) / math.sqrt(seen) if seen > 0 else math.inf
    if not moved < 2.0:
        return math.inf, math.pi
    return sum(apart[k] for k in points) / len(points) + moved * mean, 2.0 * math.asin(moved / 2.0)


@lru_cache(maxsize=64)
def _spread(points: tuple[tuple[float, ...], ...], arrows: tuple[tuple[float, ...], ...]) -> tuple[float, float]:
    """Return how far the mean of points is from the origin, and the least sum of squared distances of the points to an
    axis through it (a point of the plane), and of arrows that start there."""
    b = np.array(points)
    mean = b.mean(axis=0)
    C = np.vstack([b - mean, np.reshape(arrows, (-1, b.shape[1]))])
    seen = float(np.sum(C * C)) - (float(np.linalg.eigvalsh(C.T @ C)[-1]) if C.shape[1] == 3 else 0.0)
    return length(mean), seen


@dataclass(frozen=True, eq=False, repr=False)
class TranslatingBodies(System):
    """A platform whose bodies only translate; q starts with the position p of the first."""

    rigid = False

    @cached_property
    def paths(self) -> tuple[Reach, ...]:
        """Loci of the origin of its own body for each leg."""
        return tuple(shift_reach(curve, -tip) for curve, tip in zip(self.curves, self.tips, strict=True))

    def pose(self, q: Array) -> Array:
        """The first body's frame in the base frame; shape (4, 4)."""
        return build_pose(q[:3])
