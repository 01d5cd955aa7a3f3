"""Newton's method, against zeros known by construction, quadratic convergence, and SciPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from hrsynth.geometry.vectors import Array, times
from hrsynth.solving.newton import approach_zeros, solve_squares


def powers(x: Array, wanted: Array) -> tuple[Array, Array]:
    """xₖ² + ½ xₖ xₖ₊₁ less what it is to be, of each row its own."""
    following = np.roll(x, -1, axis=1)
    J = np.zeros((*x.shape, x.shape[1]), dtype=x.dtype)
    k = np.arange(x.shape[1])
    J[:, k, k] = 2.0 * x + following / 2.0
    J[:, k, np.roll(k, -1)] += x / 2.0
    return x * x + x * following / 2.0 - wanted, J


@given(st.integers(2, 5), st.booleans(), st.integers(0, 2**32 - 1))
def test_it_goes_to_known_zeros(size: int, is_complex: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    zeros = rng.uniform(0.5, 2.0, (7, size)) * np.exp(0.3j * rng.normal(size=(7, size)) * is_complex)
    zeros = zeros if is_complex else zeros.real
    wanted = powers(zeros, np.zeros_like(zeros))[0]
    ends = approach_zeros(powers, zeros * (1.0 + 1e-3 * rng.normal(size=zeros.shape)), wanted, steps=20)
    assert np.all(ends.converged)
    assert ends.x == pytest.approx(zeros, rel=1e-9)
    assert np.isrealobj(ends.x) != is_complex


@given(st.integers(0, 2**32 - 1))
def test_it_converges_quadratically(seed: int) -> None:
    rng = np.random.default_rng(seed)
    zeros = rng.uniform(0.5, 2.0, (1, 3))
    wanted, J = powers(zeros, np.zeros_like(zeros))
    start = zeros * (1.0 + 1e-2 * rng.normal(size=zeros.shape))
    far = [np.abs(approach_zeros(powers, start, wanted, steps=k).x - zeros).max() for k in range(4)]
    # F is of degree two with second derivatives whose rows add up to 3
    bound = 2.0 * float(np.abs(np.linalg.inv(J)).sum(axis=2).max())
    assert all(after <= 2.0 * bound * before**2 + 1e-14 for before, after in pairwise(far))


@given(st.integers(0, 2**32 - 1))
def test_a_start_goes_its_way_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    starts, wanted = rng.normal(size=(2, 9, 3))
    together = approach_zeros(powers, starts, wanted, steps=25, longest=0.7)
    for k in range(len(starts)):
        alone = approach_zeros(powers, starts[k : k + 1], wanted[k : k + 1], steps=25, longest=0.7)
        assert np.array_equal(alone.x[0], together.x[k], equal_nan=True)
        assert alone.converged[0] == together.converged[k]


def test_no_step_is_longer_than_the_longest() -> None:
    wanted = np.full((1, 2), 1e6)
    places = [approach_zeros(powers, np.full((1, 2), 1e-3), wanted, steps=k, longest=0.25).x for k in range(6)]
    steps = [np.abs(after - before).max() for before, after in pairwise(places)]
    assert steps == pytest.approx([0.25] * 5)


def test_more_equations_than_unknowns_are_met_as_well_as_can_be() -> None:
    centres, lengths = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]]), np.array([1.3, 1.5, 2.4])

    def circles(x: Array) -> tuple[Array, Array]:
        arms = x[:, None] - centres
        long = np.linalg.norm(arms, axis=2)
        return long - lengths, arms / long[..., None]

    def solve(J: Array, F: Array) -> Array:
        return times(np.linalg.pinv(J), F)

    starts = np.array([[0.5, 0.9], [1.0, 0.6]])
    ends = approach_zeros(circles, starts, steps=60, solve=solve)
    wanted = least_squares(lambda x: circles(x[None])[0][0], starts[0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.all(ends.converged)
    assert ends.x == pytest.approx(np.array([wanted.x] * 2), abs=1e-7)
    # but they do not hold
    assert not np.any(approach_zeros(circles, starts, steps=60, solve=solve, error_tol=1e-9).converged)


def test_starts_without_numbers_are_left_out() -> None:
    def roots(x: Array) -> tuple[Array, Array]:
        return np.log(x) - 1.0, 1.0 / x[..., None]

    ends = approach_zeros(roots, np.array([[2.0], [-1.0], [np.nan], [np.inf], [3.0]]), steps=30)
    assert ends.converged.tolist() == [True, False, False, False, True]
    assert ends.x[[0, 4]] == pytest.approx(np.e)
    assert not len(approach_zeros(roots, np.zeros((0, 1)), steps=30).x)


def test_a_singular_matrix_does_not_spoil_the_others() -> None:
    rng = np.random.default_rng(3)
    J, F = rng.normal(size=(4, 3, 3)), rng.normal(size=(4, 3))
    J[2] = np.outer([1.0, 2.0, 2.0], [0.0, 1.0, 0.0])
    found = solve_squares(J, F)
    for k in (0, 1, 3):
        assert times(J[k], found[k]) == pytest.approx(F[k])
    assert found[2] == pytest.approx(np.linalg.pinv(J[2]) @ F[2])
