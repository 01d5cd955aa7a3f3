"""Poses that match almost, and how many dimensions a continuum of poses has: what only minimisation finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import LOCUS, NEAR_MODE, NO_NEAR_MODE, SAME_NEAR_MODE, VANISHES
from .systems import System

STARTS = 40
"""Random poses from which a pose of a continuum is looked for."""


def residual(system: System, q: Array) -> float:
    """The largest distance of a tip from its curve, in sizes of the mechanism."""
    return system.residual(system.reached(q))


def stationary(system: System, starts: Sequence[Array], known: Sequence[Array]) -> list[Array]:
    """Poses with a small residual that is stationary, nearest to ``starts``, without those ``known``, best first."""
    found: list[tuple[float, Array]] = []
    seen = [np.asarray(q) for q in known]
    for start in starts:
        if residual(system, start) > NO_NEAR_MODE:
            continue
        q = _minimised(system, start)
        miss = residual(system, q)
        if VANISHES < miss <= NEAR_MODE and all(_apart(system, q, other) > SAME_NEAR_MODE for other in seen):
            found.append((miss, q))
            seen.append(q)
    return [q for _, q in sorted(found, key=lambda each: each[0])]


def dimension(system: System) -> int | None:
    """The largest dimension of the real poses about one that closes; None where none is found."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(STARTS):
        q = _minimised(system, system.somewhere(rng))
        if residual(system, q) <= VANISHES:
            values = np.linalg.svd(_slopes(system, q), compute_uv=False)
            found.append(int(len(q) - np.sum(values > np.sqrt(LOCUS) * values[0])))
    return max(found, default=None)


def _minimised(system: System, start: Array) -> Array:
    """The pose of least squared misses next to a start."""
    from scipy.optimize import least_squares

    result = least_squares(lambda q: system.misses(q).ravel() / system.size, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(result.x)


def _slopes(system: System, q: Array, step: float = 1e-6) -> Array:
    """Central differences of the misses; shape (3 legs, coordinates)."""
    columns = [(system.misses(q + e) - system.misses(q - e)).ravel() / (2 * step) for e in step * np.eye(len(q))]
    return np.column_stack(columns)


def _apart(system: System, one: Array, other: Array) -> float:
    """How far two poses, or the tips of two bodies, are from each other (sizes, pure numbers)."""
    X, Y = system.pose(one), system.pose(other)
    moved = (X[:3, 3] - Y[:3, 3], system.misses(one) - system.misses(other))
    turned = float(np.abs(X[:3, :3] - Y[:3, :3]).max())
    return max(max(float(np.abs(each).max()) for each in moved) / system.size, turned)
