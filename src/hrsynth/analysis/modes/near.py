"""Poses that match almost, and how many dimensions a continuum of poses has: what only minimisation finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mechanism.vectors import Array
from ...tolerances import LOCUS, NEAR_MODE, VANISHES
from .squares import Square
from .systems import System

STARTS = 40
"""Random places on the curves from which a pose of a continuum is looked for."""

APART = 1e-6
"""Distance of coordinates (m or rad over sizes) below which two stationary poses are one."""


def stationary(system: System, starts: Sequence[Array], known: Sequence[Array]) -> list[Array]:
    """Poses with a small residual that is stationary, nearest to ``starts``, without those ``known``, best first."""
    found: list[tuple[float, Array]] = []
    seen = [np.asarray(q) for q in known]
    for start in starts:
        q = _minimised(system, start)
        miss = float(np.linalg.norm(system.misses(q), axis=1).max()) / system.size
        if VANISHES < miss <= NEAR_MODE and all(_apart(q, other) > APART for other in seen):
            found.append((miss, q))
            seen.append(q)
    return [q for _, q in sorted(found, key=lambda each: each[0])]


def dimension(system: System, squares: Sequence[Square]) -> int | None:
    """The largest dimension of the real poses about one that closes; None where none is found."""
    rng = np.random.default_rng(0)
    found = []
    for square in squares:
        for _ in range(STARTS // len(squares) + 1):
            scale = [np.pi if half else system.size for half in square.round]
            q = _minimised(system, square.place(list(rng.uniform(-1, 1, len(scale)) * scale)))
            if float(np.linalg.norm(system.misses(q), axis=1).max()) <= VANISHES * system.size:
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


def _apart(one: Array, other: Array) -> float:
    return float(np.abs(one - other).max())
