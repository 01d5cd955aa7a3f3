"""Search for singular poses of a plane without a determinant: zeros of the smallest singular value of Mᵀ."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...geometry.vectors import Array
from .error_map import ErrorMap

VALLEY_DEPTH_FRACTION = 0.5
"""Fraction of the median below which a valley of the smallest singular value is searched."""
VALLEY_ZERO_FRACTION = 1e-5
"""Part of the median at which the smallest singular value in a valley counts as zero."""
VALLEY_NARROWING_FRACTION = 0.5
"""Fraction of its reach that the search in a valley keeps per step."""
LINE_VALLEYS_MAX = 600
"""Largest number of valleys searched along lines."""
PLANE_VALLEYS_MAX = 12
"""Largest number of valleys searched in the plane."""

SINGULAR_SEARCH_ROUNDS_COUNT = 28
"""Times the search is narrowed."""


def find_singular_poses(field: ErrorMap) -> Array:
    """Singular poses (n, 2) of a plane, as values of its two parts: along the lines of its cells, and isolated ones."""
    if field.smallest_at is None or field.grid.ndim != 2:
        return np.zeros((0, 2))
    smallest_at = field.smallest_at

    def value(places: Array) -> Array:
        found = smallest_at(places)
        return np.where(np.isfinite(found), found, np.inf)

    table = np.where(np.isfinite(field.smallest), field.smallest, np.inf)
    usual = float(np.median(table[np.isfinite(table)]))
    axes = [values for _, values in field.grid.axes]
    steps = np.array([values[1] - values[0] for values in axes])
    found = [np.zeros((0, 2))]
    for across in ([0], [1], [0, 1]):
        most = PLANE_VALLEYS_MAX if len(across) == 2 else LINE_VALLEYS_MAX
        cells = _find_valleys(table, across, VALLEY_DEPTH_FRACTION * usual)[:most]
        if len(cells):
            start = np.stack([axes[k][cells[:, k]] for k in range(2)], axis=1)
            places, depth = _find_deepest(value, start, steps, across)
            found.append(places[depth <= VALLEY_ZERO_FRACTION * usual])
    return np.concatenate(found)


def _find_valleys(table: Array, across: list[int], limit: float) -> NDArray[np.int64]:
    """Cells (n, 2) no higher than their neighbours along some axes, the deepest first."""
    padded = np.pad(table, 1, constant_values=np.inf)
    nx, ny = table.shape
    ways = [
        (i, j)
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        if (i, j) != (0, 0) and (0 in across or not i) and (1 in across or not j)
    ]
    around = np.min([padded[1 + i : 1 + i + nx, 1 + j : 1 + j + ny] for i, j in ways], axis=0)
    cells = np.argwhere((table <= around) & (table < limit))
    return cells[np.argsort(table[tuple(cells.T)], kind="stable")]


def _find_deepest(
    value: Callable[[Array], Array], start: Array, steps: Array, across: list[int]
) -> tuple[Array, Array]:
    """The lowest places (n, 2) around starts, along some axes, and the values there (n,)."""
    offsets = np.zeros((5 ** len(across), 2))
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * len(across), indexing="ij"), -1)
    offsets[:, across] = grid.reshape(-1, len(across))
    best, reach = start.copy(), steps.copy()
    depth = value(best)
    for _ in range(SINGULAR_SEARCH_ROUNDS_COUNT):
        places = best[:, None] + offsets * reach
        found = value(places.reshape(-1, 2)).reshape(len(best), -1)
        chosen = np.argmin(found, axis=1)
        rows = np.arange(len(best))
        best, depth, reach = places[rows, chosen], found[rows, chosen], VALLEY_NARROWING_FRACTION * reach
    return best, depth
