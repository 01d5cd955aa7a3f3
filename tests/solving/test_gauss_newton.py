"""The one descent, against SciPy and on errors that have no zero."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from hrsynth.geometry.vectors import Array
from hrsynth.solving.gauss_newton import DampingFactor, Residual, descend

DAMPING = DampingFactor(start=1.0, eased=0.1, least=1e-9, most=1e8)


def circles(x: Array) -> tuple[Array, Array]:
    """Distances from three centres, less what is wanted: they do not agree."""
    centres, wanted = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]]), np.array([1.0, 1.4, 2.6])
    arms = x - centres
    lengths = np.linalg.norm(arms, axis=1)
    return lengths - wanted, arms / lengths[:, None]


def levenberg(x: Array, at: Residual, factor: float) -> Array:
    return x - np.linalg.solve(at.J.T @ at.J + factor * np.eye(len(x)), at.J.T @ at.error)


@pytest.mark.parametrize("seed", range(5))
def test_it_finds_the_least_squares(seed: int) -> None:
    start = np.random.default_rng(seed).normal(size=2) + 0.5
    there, left = descend(start, circles, levenberg, DAMPING, 200, lambda at: np.linalg.norm(at.J.T @ at.error) < 1e-13)
    found = least_squares(lambda x: circles(x)[0], there)
    assert there == pytest.approx(found.x, abs=1e-6)
    assert left.size == pytest.approx(np.linalg.norm(found.fun))
    assert left.size <= np.linalg.norm(circles(start)[0])


def test_a_step_that_does_not_help_is_never_taken() -> None:
    factors: list[float] = []

    def uphill(x: Array, at: Residual, factor: float) -> Array:
        factors.append(factor)
        return x + 1.0

    there, left = descend(np.zeros(1), lambda x: (x + 1.0, np.eye(1)), uphill, DAMPING, 200, lambda at: False)
    assert there == 0.0
    assert left.size == 1.0
    assert factors == [10.0**k for k in range(9)]


def test_nowhere_is_no_step() -> None:
    there, _ = descend(np.ones(2), circles, lambda x, at, factor: None, DAMPING, 5, lambda at: False)
    assert np.array_equal(there, np.ones(2))
