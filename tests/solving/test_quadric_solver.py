"""Real solutions of quadrics lie in the boxes that are said to hold all of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.errors import ExternalSolverFailure
from hrsynth.geometry.vectors import Array
from hrsynth.solving.linear_elimination import eliminate_linear
from hrsynth.solving.quadric_solver import QuadricSolver, enclose_square_roots, expand
from hrsynth.solving.uniqueness import enclose_unique, evaluate_quadrics, is_excluded

SEEDS = st.integers(0, 10**6)


def through(points: Array, count: int, rng: np.random.Generator) -> Array:
    """Matrices (count, n + 1, n + 1) of random quadrics that vanish at all points (k, n)."""
    n = points.shape[1]
    i, j = np.triu_indices(n + 1)
    full = np.column_stack([np.ones(len(points)), points])
    _, s, Vt = np.linalg.svd(full[:, i] * full[:, j])
    kernel = Vt[int(np.sum(s > 1e-12)) :]
    return expand(rng.normal(size=(count, len(kernel))) @ kernel, n)


def holds(boxes: list, x: Array) -> bool:
    """Whether a box holds a point."""
    return any(np.all(np.abs(box.middle - x) <= box.radii) for box in boxes)


@given(SEEDS, st.integers(1, 4), st.integers(1, 3))
def test_points_of_random_quadrics_are_in_their_boxes(seed: int, n: int, count: int):
    """Quadrics through points that were drawn first, each with an error that is drawn too."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, size=(count, n))
    matrices = through(points, n + 2, rng)
    if len(matrices) == 0 or np.abs(matrices).max() < 1e-9:
        return
    errors = np.full(len(matrices), 1e-12)
    matrices[:, 0, 0] += rng.uniform(-1e-12, 1e-12, size=len(matrices))
    solver = QuadricSolver()
    try:
        boxes, _ = solver.solve(matrices, errors, np.ones(n))
    except ExternalSolverFailure:
        return
    for x in points:
        assert holds(boxes, x)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_as_many_quadrics_as_unknowns_have_bezouts_number(n: int):
    """With the complex ones there are 2ⁿ, each as often as Newton's method from random starts ends there."""
    rng = np.random.default_rng(n)
    matrices = rng.normal(size=(n, n + 1, n + 1))
    matrices = matrices + matrices.transpose(0, 2, 1)
    boxes, others = QuadricSolver().solve(matrices, np.full(n, 1e-14), np.full(n, 3.0))
    assert len(boxes) + len(others) == 2**n
    for x in others:
        values = np.array([np.append(1, x) @ M @ np.append(1, x) for M in matrices])
        assert np.abs(values).max() < 1e-6 * (1 + np.abs(x).max()) ** 2
    for _ in range(300):
        x = rng.uniform(-3, 3, size=n)
        for _ in range(30):
            value, J = evaluate_quadrics(matrices, x)
            x = x - np.linalg.solve(J, value)
        if np.abs(evaluate_quadrics(matrices, x)[0]).max() < 1e-12 and np.abs(x).max() < 3.0:
            assert holds(boxes, x)


@given(SEEDS, st.integers(2, 6), st.integers(0, 4))
def test_elimination_loses_no_solution(seed: int, n: int, linear: int):
    """A point on random planes and quadrics, equations repeated: what remains holds there, within its errors."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1, 1, size=n)
    rows = rng.normal(size=(linear, n))
    matrices = list(through(x[None], n, rng))
    for row in rows:
        M = np.zeros((n + 1, n + 1))
        M[0, 1:] = M[1:, 0] = row / 2
        M[0, 0] = -row @ x
        matrices.append(M)
    # sums of equations, whose quadratic parts cancel again
    mixed = rng.normal(size=(len(matrices) + 2, len(matrices))) @ np.array(matrices).reshape(len(matrices), -1)
    system = mixed.reshape(-1, n + 1, n + 1)
    system[:, 0, 0] += rng.uniform(-1e-13, 1e-13, size=len(system))
    reduced = eliminate_linear(system, np.full(len(system), 2e-13), np.ones(n))
    kept = np.flatnonzero([np.sum(reduced.T[1 + k, 1:] != 0) == 1 and reduced.T[1 + k, 0] == 0 for k in range(n)])
    T = reduced.T[1:]
    y = np.array([x[next(k for k in kept if T[k, 1 + j] == 1.0)] for j in range(T.shape[1] - 1)])
    assert np.all(np.abs(y) <= reduced.farthest)
    assert np.all(np.abs(T @ np.append(1.0, y) - x) <= reduced.slack + 1e-15)
    i, j = np.triu_indices(len(y) + 1)
    full = np.append(1.0, y)
    assert np.all(np.abs(reduced.table @ (full[i] * full[j])) <= reduced.errors)


@given(SEEDS, st.integers(1, 5))
def test_a_box_about_a_solution_is_never_excluded(seed: int, n: int):
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1, 1, size=n)
    matrices = through(x[None], n + 1, rng)
    errors, middle = np.full(n + 1, 1e-13), x + rng.uniform(-1e-3, 1e-3, size=n)
    radii = np.abs(middle - x) + 1e-15
    assert not is_excluded(matrices, errors, middle, radii)
    found = enclose_unique(matrices, errors, middle, radii)
    if found is not None:
        assert np.all(np.abs(found[0] - x) <= found[1])


def test_two_solutions_in_a_box_are_not_one():
    """x² = 1/16 in a box that holds both roots."""
    matrices = np.array([[[-1 / 16, 0.0], [0.0, 1.0]]])
    assert enclose_unique(matrices, np.zeros(1), np.array([0.01]), np.array([0.5])) is None
    assert enclose_unique(matrices, np.zeros(1), np.array([0.26]), np.array([0.05])) is not None


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 1e-2), st.floats(-1, 1))
def test_square_roots_hold_all_that_nearly_solve(b: float, c: float, off: float, part: float):
    """Roots of y² + b y + c = part · off, whatever the part."""
    found = [(y, r) for y, r in enclose_square_roots(b, c, off) if not isinstance(y, complex)]
    square = b * b / 4 - c + part * off
    if square >= 0:
        for y in (-b / 2 + np.sqrt(square), -b / 2 - np.sqrt(square)):
            assert any(abs(y - at) <= r * (1 + 1e-12) + 1e-15 for at, r in found)


def test_what_nothing_holds_is_refused():
    with pytest.raises(ExternalSolverFailure, match="nothing holds 2 unknowns"):
        QuadricSolver().solve(np.zeros((1, 3, 3)), np.zeros(1), np.ones(2))
    circle = np.diag([-1.0, 1.0, 1.0])[None]
    with pytest.raises(ExternalSolverFailure, match="not confined"):
        QuadricSolver().solve(circle, np.zeros(1), np.ones(2))


def test_a_double_solution_is_not_separated():
    """Two circles that touch."""
    one = np.diag([-1.0, 1.0, 1.0])
    other = np.array([[3.0, -2.0, 0.0], [-2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # (x − 2)² + y² = 1
    boxes, _ = QuadricSolver().solve(np.array([one, other]), np.full(2, 1e-15), np.full(2, 2.0))
    assert all(enclose_unique(np.array([one, other]), np.zeros(2), box.middle, box.radii) is None for box in boxes)
