"""Bounds by ranks of multiples: the count of products of planes, of circles, none where there is a curve."""

from __future__ import annotations

import numpy as np
import pytest

import hrsynth
from analysis.modes.laws import needs_msolve
from hrsynth.description import list_robots, load
from hrsynth.solving.platform.modular_root_bound import bound_zeros, combine_quadrics
from hrsynth.solving.platform.polynomials import Quadric
from strategies import random_rotation, transformed

HEIGHT = 1000
"""Largest coefficient."""


def pairs_of_planes(rng, n):
    """n quadrics that are products of two linear forms: they meet in 2ⁿ points."""
    rows = rng.integers(-HEIGHT, HEIGHT, size=(n, 2, n + 1)).astype(object)
    return [Quadric(np.outer(a, b)) for a, b in rows]


def sphere(centre, squared):
    """|x - c|² = r² with integers."""
    A = np.eye(len(centre) + 1, dtype=int).astype(object)
    A[0, 1:] = [-2 * int(c) for c in centre]
    A[0, 0] = sum(int(c) ** 2 for c in centre) - squared
    return Quadric(A)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_products_of_planes_meet_in_as_many_points_as_can_be_picked(n, seed):
    assert bound_zeros(pairs_of_planes(np.random.default_rng(seed), n), 2**n) == 2**n


@pytest.mark.parametrize("n", [2, 3])
def test_spheres_meet_in_two_points_though_all_hold_one_conic_at_infinity(n):
    rng = np.random.default_rng(n)
    spheres = [sphere(rng.integers(-HEIGHT, HEIGHT, size=n), int(rng.integers(1, HEIGHT))) for _ in range(n)]
    assert bound_zeros(spheres, 2) == 2


def test_what_holds_a_curve_has_no_bound():
    one, other = pairs_of_planes(np.random.default_rng(4), 2)
    assert bound_zeros([one, Quadric(3 * one.A)], 1) is None
    a = np.array([1, 2, -3], dtype=object)
    both = [Quadric(np.outer(a, row)) for row in np.array([[1, 5, 7], [2, -1, 4]], dtype=object)]
    assert bound_zeros(both, 1) is None
    assert bound_zeros([one, other], 3) == 4


def test_combinations_have_the_same_zeros():
    x = [3, -2, 5]
    centres = ([1, 1, 0], [4, 0, 2], [0, 7, 9])
    quadrics = [sphere(c, sum((a - b) ** 2 for a, b in zip(c, x, strict=True))) for c in centres]
    found = combine_quadrics(quadrics)
    assert [each.value(x) for each in found] == [0, 0, 0]
    assert sum(not np.any(each.A[1:, 1:]) for each in found) == 2
    assert any(each.value([1, 2, 3]) for each in found)


@pytest.mark.some(1)
@needs_msolve
@pytest.mark.parametrize(
    ("name", "count", "seed"),
    [
        ("quattro", 4, None),
        ("i4l", 2, 1),
        pytest.param("quattro", 4, 2, marks=pytest.mark.slow),
        pytest.param("quattro", 4, 1, marks=pytest.mark.slow),
    ],
)
def test_motors_of_two_bodies_that_translate_have_a_proved_list(name, count, seed):
    """Their arms are symmetric: solutions lie at infinity, or far away but for rounding in a turned base."""
    robot = load(list_robots()[name])
    if seed is not None:
        rng = np.random.default_rng(seed)
        robot = transformed(robot, random_rotation(rng), rng.normal(size=3))
    found = hrsynth.modes(robot, real=True)
    assert (found.found.complex, found.found.complete) == (count, True), found.found.proof
    assert found.found.bound in ("rank", "class")
    assert sum(mode.goal for mode in found.modes) == 1
