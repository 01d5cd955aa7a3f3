"""What watching legs shows of a published robot, from the screws of its joints at one closed configuration.

Watched is the default segment of each leg (docs/pages/theory.md, section 1): along a slide between two moving links,
else the last segment before the platform. The motions of leg i that keep its direction u are those with ω_ℓ × u = 0;
the platform's freedoms that every leg can make, watched ones keeping u, are unseen.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hrsynth.geometry.vectors import Array, cross, hat
from hrsynth.tolerances import DIRECTION_SINE_TOL, RANK_GAP_MIN

from .freedoms import count_ranks, denied_freedoms


@dataclass(frozen=True)
class WatchedLegs:
    """How many freedoms all legs show together, and how many legs at least show as many."""

    seen: int
    fewest: int


def watching(screws: Array, kinds: str, dof: int) -> WatchedLegs | None:
    """What the legs of a robot, screws (n, m, 6) about one point, show of its ``dof`` freedoms; None where a leg has no
    such segment or a rank is no verdict."""
    n, m = screws.shape[:2]
    kept = []
    for leg in screws:
        segment = _segment(leg, kinds)
        if segment is None:
            return None
        last, u = segment
        rates = np.zeros((3, m))
        rates[:, : last + 1] = -hat(u) @ leg[: last + 1, 3:].T  # u̇ = ω × u, slides do not turn
        _, s, Vt = np.linalg.svd(rates)
        rank, gap = count_ranks(s)
        if gap < RANK_GAP_MIN:
            return None
        kept.append(np.pad(Vt[rank:] @ leg, ((0, int(rank)), (0, 0))))
    free, gaps, _ = denied_freedoms(screws)
    held, more, _ = denied_freedoms(np.stack(kept))
    if min(gaps.min(), more.min()) < RANK_GAP_MIN:
        return None
    best: int | None = None
    for size in [n, *range(n)]:
        sets = list(combinations(range(n), size))
        chosen = np.array([[leg in each for leg in range(n)] for each in sets])[..., None, None]
        stacked = np.where(chosen, held, free).reshape(len(sets), 6 * n, 6)
        ranks, clear = count_ranks(np.asarray(np.linalg.svd(stacked, compute_uv=False)))
        if clear.min() < RANK_GAP_MIN:
            return None
        if best is None:
            best = int(ranks[0])
        elif ranks.max() == best:
            return WatchedLegs(best - 6 + dof, size)
    return WatchedLegs((best or 0) - 6 + dof, n)


def _segment(leg: Array, kinds: str) -> tuple[int, Array] | None:
    """The number of the joint before the watched segment and its direction, None where it has none."""
    m = len(kinds)
    for j in range(m - 2, 0, -1):
        if kinds[j] == "P":
            return j, leg[j, :3] / np.linalg.norm(leg[j, :3])
    if kinds[-1] == "P":
        return m - 1, leg[-1, :3] / np.linalg.norm(leg[-1, :3])
    size = _together(leg, kinds, m - 1)
    last = m - 1 - size
    if last < 0:
        return None
    if kinds[last] == "P":
        return last, leg[last, :3] / np.linalg.norm(leg[last, :3])
    u = _between(leg[last - _together(leg, kinds, last) + 1 : last + 1], leg[m - size :])
    length = np.linalg.norm(u)
    return (last, u / length) if length > DIRECTION_SINE_TOL else None


def _together(leg: Array, kinds: str, last: int) -> int:
    """How many turning joints up to ``last`` are one: three through a point, two that are perpendicular too."""
    if (
        last >= 2
        and kinds[last - 2 : last + 1] == "RRR"
        and all(_meet(leg[a], leg[b]) for a, b in combinations(range(last - 2, last + 1), 2))
    ):
        points = [_point(leg[a : a + 2]) for a in (last - 2, last - 1)]
        if np.linalg.norm(points[0] - points[1]) < DIRECTION_SINE_TOL:
            return 3
    if (
        last >= 1
        and kinds[last - 1 : last + 1] == "RR"
        and _meet(leg[last - 1], leg[last])
        and (abs(leg[last - 1, 3:] @ leg[last, 3:]) < DIRECTION_SINE_TOL)
    ):
        return 2
    return 1


def _meet(a: Array, b: Array) -> bool:
    """Whether two axes meet and are not parallel."""
    return bool(abs(a[:3] @ b[3:] + b[:3] @ a[3:]) < DIRECTION_SINE_TOL < np.linalg.norm(cross(a[3:], b[3:])))


def _foot(a: Array) -> Array:
    """The point of an axis that is nearest to the origin, ω × v for unit ω."""
    return np.asarray(cross(a[3:], a[:3]))


def _point(axes: Array) -> Array:
    """The point where two axes meet."""
    a, b = axes[0, 3:], axes[1, 3:]
    p, q, normal = _foot(axes[0]), _foot(axes[1]), cross(axes[0, 3:], axes[1, 3:])
    return np.asarray(p + a * (cross(q - p, b) @ normal) / (normal @ normal))


def _between(before: Array, after: Array) -> Array:
    """From the centre of one joint to that of the next: of an axis the foot of the perpendicular."""
    start, end = (_point(axes[:2]) if len(axes) > 1 else _foot(axes[0]) for axes in (before, after))
    a, b = before[0, 3:], after[0, 3:]
    normal, apart = cross(a, b), end - start
    if len(before) > 1 or len(after) > 1:
        for axes in (before, after):
            if len(axes) == 1:
                apart = apart - axes[0, 3:] * (axes[0, 3:] @ apart)
        return np.asarray(apart)
    if np.linalg.norm(normal) < DIRECTION_SINE_TOL:
        return np.asarray(apart - a * (a @ apart))
    return np.asarray(normal * (normal @ apart) / (normal @ normal))
