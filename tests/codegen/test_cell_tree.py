"""Cells in a tree: each point is found in the cell that holds it, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.codegen.cell_tree import OUTSIDE, build_cell_tree, compute_tree_depth
from hrsynth.geometry.vectors import Array


def halved(rng: np.random.Generator, low: Array, high: Array, depth: int) -> list[tuple[Array, Array]]:
    """Cells by random halving, some of them left out."""
    if depth == 0 or rng.random() < 0.1:
        return [] if rng.random() < 0.3 else [(low, high)]
    axis = int(rng.integers(len(low)))
    upper, lower = high.copy(), low.copy()
    upper[axis] = lower[axis] = (low[axis] + high[axis]) / 2
    return halved(rng, low, upper, depth - 1) + halved(rng, lower, high, depth - 1)


@pytest.mark.some(4)
@pytest.mark.parametrize("seed", range(12))
def test_a_point_is_found_in_the_cell_that_holds_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = 1 + seed % 4
    low, high = -rng.uniform(0.1, 2, m), rng.uniform(0.1, 2, m)
    cells = halved(rng, low, high, 7)
    root, nodes = build_cell_tree(low, high, cells)
    points = rng.uniform(low, high, (400, m))
    corners = np.array([corner for cell in cells for corner in cell]).reshape(-1, m)
    for q in [*points, *corners]:
        at, waiting = OUTSIDE, [root]
        while waiting and at == OUTSIDE:
            at = waiting.pop()
            while at >= 0:
                axis, value, below, above = nodes[at]
                if q[axis] == value:
                    waiting.append(below)
                at = below if q[axis] < value else above
            assert len(waiting) <= compute_tree_depth(root, nodes)
        holding = [i for i, (a, b) in enumerate(cells) if np.all(a <= q) and np.all(q <= b)]
        assert (at == OUTSIDE) == (not holding)
        assert at == OUTSIDE or ~at in holding
