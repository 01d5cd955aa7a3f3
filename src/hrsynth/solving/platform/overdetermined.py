"""Solutions of a square part that fit the legs that it leaves out, with redundant observation (proofs.md 8).

A solution is *excluded* where the tips of its enclosure are off what a leg can reach, in ball arithmetic. That it is a
mode is proved only of the goal, at which all tips fit by construction: a match in floats proves nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...errors import GeometryAmbiguous
from ...geometry.loci import Sphere, length
from ...geometry.vectors import Array
from ...tolerances import LOCUS_DISTANCE_TOL, LOCUS_EXTENT_TOL, NEAR_MODE_DISTANCE_MAX, RANK_GAP_MIN, TIP_ROUNDING
from .constrained_platform import System
from .quadrics import UNIT, Conic, list_conditions
from .rigid import Spatial
from .roots import ROOT_ISOLATION_BITS_COUNT

NEAR_MODE_START_MISS_MAX = 0.3
"""Distance (characteristic lengths) beyond which a start leads to no near mode."""
NEAR_MODE_DIFFERENCE_TOL = 1e-6
"""Difference of poses and distances (characteristic lengths) below which two stationary poses are one."""
SNAP_DISTANCE_MAX = 1e-5
"""Distance (characteristic lengths) up to which joint centres are snapped, if the next one is ``RANK_GAP_MIN``
larger."""


def bound_tip_rounding(system: System, at: Array) -> float:
    """Return how far a tip that floats put at ``at`` (3,) can be from that of the exact input at the same pose (m)."""
    return system.error + TIP_ROUNDING * (system.size + length(at))


def bound_tip_error(system: System, k: int, at: Array, shift: float, turn: float) -> float:
    """Return how far the exact tip of a leg is from ``at`` (3,) at most (m), at a pose enclosed to ``shift`` and
    ``turn``."""
    return shift + turn * length(system.tips[k]) + bound_tip_rounding(system, at)


def may_be_goal(system: System, q: Array, goal: Array, shift: float, turn: float) -> bool:
    """Return True if the exact pose about ``q`` can be that about ``goal``: all its tips can."""
    return all(
        length(tip - goal_tip) <= bound_tip_error(system, k, tip, shift, turn) + bound_tip_rounding(system, goal_tip)
        for k, (tip, goal_tip) in enumerate(zip(system.tips_at(q), system.tips_at(goal), strict=True))
    )


def is_excluded(system: System, q: Array, shift: float, turn: float) -> bool:
    """Return True if no pose within ``shift`` and ``turn`` of q, one of which is exact, fits all legs: a condition on a
    tip is not zero anywhere in the ball that contains it. The worst legs are tried first."""
    from flint import ctx

    at, frame = system.tips_at(q), system.frame
    numbers = system.balls(frame)
    misses = np.linalg.norm(system.off(at), axis=1)
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        for k in np.argsort(-misses).tolist():
            radius = bound_tip_error(system, k, at[k], shift, turn)
            if misses[k] <= radius:
                return False
            place = numbers.vector(frame.point(at[k]), radius / frame.size * UNIT)
            tip = Conic(place, place @ place, 1)
            if any(not form.contains(0) for form in list_conditions(tip, system.curves[k], frame, numbers)):
                return True
    return False


def is_beyond_rigid_platform(system: System, places: Mapping[int, tuple[Array, float]]) -> bool:
    """Return True if tips of a rigid platform, at ``places`` (3,) known to a distance (m), are farther from or nearer
    to each other than they are on it: no pose brings them there."""
    from flint import ctx

    frame = system.frame
    numbers = system.balls(frame)
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        tips = {
            k: (
                numbers.vector(frame.point(at), (miss + bound_tip_rounding(system, at)) / frame.size * UNIT),
                numbers.vector(system.tips[k] / frame.size),
            )
            for k, (at, miss) in places.items()
        }
        arms = [(at - to, b - c) for (at, b), (to, c) in combinations(tips.values(), 2)]
        return any(not (arm @ arm - side @ side).contains(0) for arm, side in arms)


def describe_fits(goal: bool, lost: bool, fitting: Sequence[float], out: int, open_: int) -> str:
    """Verdict of the legs on all solutions: whether one is the goal, or it is ``lost`` among them, the residuals of
    those that fit, how many are excluded and how many are undecided."""
    parts = [f"{'none' if lost else 'one'} is the goal, at which all legs fit by construction"] if goal else []
    if fitting:
        parts.append(
            f"{len(fitting)} fit{'s' * (len(fitting) == 1)} all legs to {max(fitting):.1e} characteristic "
            "lengths, which does not prove it"
        )
    parts.append(f"{out} excluded by the legs in interval arithmetic" if out else "none excluded")
    if open_:
        parts.append(f"{open_} undecided")
    return ", ".join(parts)


CONTINUOUS_FAMILY_STARTS_COUNT = 40
"""Number of random poses from which a pose of a continuous family is sought."""


def compute_residual(system: System, q: Array) -> float:
    """The largest distance of a tip from its curve, in sizes of the mechanism."""
    return system.residual(system.tips_at(q))


def find_stationary(system: System, starts: Sequence[Array], known: Sequence[Array]) -> list[Array]:
    """Poses with a small residual that is stationary, nearest to ``starts``, without those ``known``, best first."""
    ranked: list[tuple[float, Array]] = []
    seen = [np.asarray(q) for q in known]
    for start in starts:
        if compute_residual(system, start) > NEAR_MODE_START_MISS_MAX:
            continue
        q = _fit_pose(system, start)
        miss = compute_residual(system, q)
        if miss <= NEAR_MODE_DISTANCE_MAX and all(
            _compare_poses(system, q, pose) > NEAR_MODE_DIFFERENCE_TOL for pose in seen
        ):
            ranked.append((miss, q))
            seen.append(q)
    return [q for _, q in sorted(ranked, key=lambda item: item[0])]


def find_dimension(system: System) -> int | None:
    """Return the largest dimension of the real poses about one that closes; None if none is found."""
    rng = np.random.default_rng(0)
    dimensions = []
    for _ in range(CONTINUOUS_FAMILY_STARTS_COUNT):
        q = _fit_pose(system, system.somewhere(rng))
        if compute_residual(system, q) <= LOCUS_DISTANCE_TOL:
            values = np.linalg.svd(_compute_slopes(system, q), compute_uv=False)
            dimensions.append(int(len(q) - np.sum(values > np.sqrt(LOCUS_EXTENT_TOL) * values[0])))
    return max(dimensions, default=None)


def _fit_pose(system: System, start: Array) -> Array:
    """The pose of least squared misses next to a start."""
    from scipy.optimize import least_squares

    result = least_squares(lambda q: system.misses(q).ravel() / system.size, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(result.x)


def _compute_slopes(system: System, q: Array, step: float = 1e-6) -> Array:
    """Central differences of the misses; shape (3 legs, coordinates)."""
    columns = [(system.misses(q + e) - system.misses(q - e)).ravel() / (2 * step) for e in step * np.eye(len(q))]
    return np.column_stack(columns)


def _compare_poses(system: System, q: Array, p: Array) -> float:
    """Return the difference of two poses, or of the tips of two bodies (sizes, pure numbers)."""
    X, Y = system.pose(q), system.pose(p)
    moved = (X[:3, 3] - Y[:3, 3], system.misses(q) - system.misses(p))
    turned = float(np.abs(X[:3, :3] - Y[:3, :3]).max())
    return max(max(float(np.abs(difference).max()) for difference in moved) / system.size, turned)


@dataclass(frozen=True)
class SnappedPoints:
    """Joint centres of some legs (their indices) that were snapped: on the ``platform`` or the ``base``, and the
    distance of the farthest one from the others (m)."""

    where: str
    legs: tuple[int, ...]
    defect: float


def snap_centres(system: System) -> tuple[System, tuple[SnappedPoints, ...]]:
    """Return a system with nearly coinciding centres snapped, and which were; its error grows by the distance moved.

    Centres are snapped if the largest distance accepted (at most ``SNAP_DISTANCE_MAX`` sizes) is below the smallest one
    rejected by ``RANK_GAP_MIN``; raises ``GeometryAmbiguous`` if it is in between."""
    if system.as_written or not isinstance(system, Spatial):
        return system, ()
    spheres = [k for k, curve in enumerate(system.curves) if isinstance(curve, Sphere)]
    points = {"platform": dict(enumerate(system.points)), "base": {k: system.curves[k].centre for k in spheres}}
    apart = [
        (float(np.linalg.norm(at[i] - at[j])), where, i, j)
        for where, at in points.items()
        for i, j in combinations(at, 2)
    ]
    accepted = [pair for pair in apart if pair[0] <= SNAP_DISTANCE_MAX * system.size]
    largest = max((pair[0] for pair in accepted), default=0.0)
    smallest = min((pair[0] for pair in apart if pair not in accepted), default=np.inf)
    if largest * RANK_GAP_MIN > smallest:
        raise GeometryAmbiguous(
            "joint centres that may coincide", largest / system.size, smallest / system.size, RANK_GAP_MIN
        )
    if largest == 0.0:
        return system, ()
    tips, curves, snapped = system.tips.copy(), list(system.curves), []
    for where, at in points.items():
        for group in _join_pairs([(i, j) for _, side, i, j in accepted if side == where]):
            middle = np.mean([at[k] for k in group], axis=0)
            defect = max(d for d, side, i, _ in accepted if side == where and i in group)
            if defect > 0:
                snapped.append(SnappedPoints(where, group, defect))
            for k in group:
                if where == "platform":
                    tips[k] = middle
                else:
                    curves[k] = replace(curves[k], centre=middle)
    return replace(system, tips=tips, curves=tuple(curves), error=system.error + largest), tuple(snapped)


def _join_pairs(pairs: list[tuple[int, int]]) -> list[tuple[int, ...]]:
    """Return those that are joined by pairs, together."""
    groups: list[set[int]] = []
    for pair in pairs:
        joined = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in joined] + [set(pair).union(*joined)]
    return [tuple(sorted(group)) for group in groups]
