"""Cells of a box found by halves: a tree of planes, none of which cuts a cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import Array

OUTSIDE = -2147483647
"""Stands for no cell."""
Node = tuple[int, float, int, int]
"""Axis, value, and where to go on below it and from it on: a node, or ~cell, or ``OUTSIDE``."""


def build_cell_tree(lower: Array, upper: Array, cells: Sequence[tuple[Array, Array]]) -> tuple[int, list[Node]]:
    """Root and nodes for cells (lower, upper), (m,) each, within a box from ``lower`` to ``upper``; what no cell fills
    is outside. Cells may touch, and lie as halving leaves them. What lies on a plane may be on either side of it."""
    nodes: list[Node] = []

    def of(low: Array, high: Array, inside: list[int]) -> int:
        if not inside:
            return OUTSIDE
        if len(inside) == 1:
            one, other = cells[inside[0]]
            open_ = [
                (k, value, side)
                for side, (edge, wall) in enumerate(((one, low), (other, high)))
                for k, value in enumerate(edge)
                if value != wall[k]
            ]
            if not open_:
                return ~inside[0]
            axis, value, side = open_[0]
            value = float(np.nextafter(value, np.inf)) if side else float(value)
            place = len(nodes)
            nodes.append((axis, value, 0, 0))
            low, high = low.copy(), high.copy()
            (high if side else low)[axis] = cells[inside[0]][side][axis]
            found = of(low, high, inside)
            nodes[place] = (axis, value, *((found, OUTSIDE) if side else (OUTSIDE, found)))
            return place
        axis, value = _choose_cut([cells[i] for i in inside])
        place = len(nodes)
        nodes.append((axis, value, 0, 0))
        below = [i for i in inside if cells[i][1][axis] <= value]
        above = [i for i in inside if cells[i][0][axis] >= value]
        middle_high, middle_low = high.copy(), low.copy()
        middle_high[axis] = middle_low[axis] = value
        nodes[place] = (axis, value, of(low, middle_high, below), of(middle_low, high, above))
        return place

    root = of(np.asarray(lower, dtype=float), np.asarray(upper, dtype=float), list(range(len(cells))))
    return root, nodes


def compute_tree_depth(root: int, nodes: Sequence[Node]) -> int:
    """Return the number of nodes on the longest path from the root."""
    depth, level = 0, [root] if root >= 0 else []
    while level:
        depth, level = depth + 1, [each for at in level for each in nodes[at][2:] if each >= 0]
    return depth


def _choose_cut(cells: Sequence[tuple[Array, Array]]) -> tuple[int, float]:
    """The plane that cuts no cell and parts them most evenly."""
    low, high = (np.array([cell[side] for cell in cells]) for side in (0, 1))
    best: tuple[int, int, float] | None = None
    for axis in range(low.shape[1]):
        for value in np.unique(low[:, axis]):
            above, below = low[:, axis] >= value, high[:, axis] <= value
            if np.all(above | below) and below.any() and above.any():
                uneven = abs(int(below.sum()) - int(above.sum()))
                if best is None or uneven < best[0]:
                    best = uneven, axis, float(value)
    if best is None:
        raise BadRequest("cells of a branch that no plane parts", len(cells), "cells made by halving")
    return best[1], best[2]
