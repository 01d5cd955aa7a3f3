"""Lists of critical points by subdivision: the members are zeros, no other is met by Newton's method from anywhere, and
on a closed surface their kinds sum up to what its shape asks for."""

from itertools import product

import numpy as np
import pytest

from hrsynth import load
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.budgets import COVER_BOXES
from hrsynth.simulation.endings.cover import cover
from hrsynth.simulation.endings.pose_error import PoseError
from hrsynth.simulation.endings.subdivision import Subdivision
from strategies import random_rotation, transformed

STEP = 1e-6


def slopes(error, x):
    """∇E (n, size) at coordinates, by differences of E alone; no number out of reach."""
    found = []
    for axis in np.eye(error.size):
        (one, up), (other, down) = (error.levels(x + sign * STEP * axis) for sign in (1, -1))
        found.append(np.where(one & other, up - down, np.nan) / (2 * STEP))
    return np.array(found).T


def newton(error, x, steps=20):
    """Zeros of ∇E that Newton's method meets from places (n, size)."""
    for _ in range(steps):
        g = slopes(error, x)
        H = np.array([(slopes(error, x + 1e-4 * axis) - slopes(error, x - 1e-4 * axis)) / 2e-4
                      for axis in np.eye(error.size)]).transpose(1, 0, 2)
        good = np.isfinite(H).all(axis=(1, 2)) & np.isfinite(g).all(axis=1)
        good[good] = np.abs(np.linalg.det(H[good])) > 1e-9
        x, g, H = x[good], g[good], H[good]
        if not len(x):
            break
        step = np.linalg.solve(H, g[..., None])[..., 0]
        x = x - step * np.minimum(1, 0.3 / (np.linalg.norm(step, axis=1) + 1e-300))[:, None]
    return x[np.linalg.norm(slopes(error, x), axis=1) < 1e-7] if len(x) else x


def unlisted(setting, found, rng, count=40):
    """Zeros that Newton's method meets in reach, farther than 1e-4 from all members and from open boxes."""
    error = PoseError.of(setting, setting.everything.start)
    missed = []
    for modes in found.modes:
        here = error.elsewhere(error.p, error.R, modes)
        listed = np.array([each.x for each in found.found if each.modes == modes]).reshape(-1, error.size)
        for x in newton(here, rng.uniform(-4, 4, (count, error.size))):
            near = np.any(np.linalg.norm(listed - x, axis=1) < 1e-4)
            left = any(np.all(np.abs(x - middle) < half + 1e-3) for middle, half in found.open)
            if not near and not left and np.all(np.abs(x) < 3):
                missed.append((modes, x))
    return missed


@pytest.mark.slow
def test_a_closed_surface_of_poses_has_the_kinds_that_its_shape_asks_for():
    """The PRRRP, two rods on two rails, also in a tilted base: its closures make up a torus, on which the numbers of
    minima, saddles and maxima sum up to nothing, signs alternating."""
    rng = np.random.default_rng(0)
    setting = ObservedRobot.of(transformed(load("prrrp_m1"), random_rotation(rng), rng.normal(size=3)))
    found = cover(setting, setting.everything.start, every_mode=True)
    assert found.complete
    assert found.bounded
    assert [sum(each.falling == k for each in found.found) for k in range(3)] == [4, 8, 4]
    assert set(found.modes) == set(product((-1.0, 1.0), repeat=2))
    assert sum(each.error[0] < 1e-5 for each in found.found) == 4
    assert unlisted(setting, found, rng) == []


@pytest.mark.slow
@pytest.mark.parametrize(("name", "budget"), [("rprpr_m1", None), ("rrrrr_m1", None), ("rrrrr_m1", 20_000)])
def test_no_other_critical_point_is_met(name, budget):
    """Where boxes are left open, they are told; away from them the list is whole."""
    setting = ObservedRobot.of(name)
    found = cover(setting, setting.everything.start, every_mode=True, budget=budget or COVER_BOXES, reach=3.0)
    assert found.complete is (budget is None)
    assert bool(found.open) is not found.complete
    assert unlisted(setting, found, np.random.default_rng(1)) == []


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [("rrrrr_m1", -6), ("3prr_m1", 0)])
def test_kinds_sum_up_to_the_number_of_the_closures(name, number):
    """The five-bar's closures make up a surface of genus 4, as those of an equilateral pentagon; of any that have three
    dimensions the number is 0."""
    setting = ObservedRobot.of(name)
    found = cover(setting, setting.everything.start, every_mode=True)
    assert found.complete
    assert sum((-1) ** each.falling for each in found.found) == number


def test_a_saddle_near_a_limit_is_left_open():
    """The middle of this box is out of the second leg's reach, one of its corners is a saddle: the sign with which E
    grows is not read off the middle (3prr_m1, the first leg in its other working mode)."""
    setting = ObservedRobot.of("3prr_m1")
    error = PoseError.of(setting, setting.everything.start)
    error = error.elsewhere(error.p, error.R, (-1.0, 1.0, 1.0))
    part = Subdivision.of(error, -np.ones(3), np.ones(3))
    middle, half = np.array([0.35488091, 0.31337551, -0.375]), np.array([0.078, 0.052, 0.125])
    saddle = np.array([0.279589, 0.33178293, -0.45761711])
    assert np.all(np.abs(saddle - middle) < half)
    assert np.linalg.norm(slopes(error, saddle[None])) < 1e-6
    assert part._open(middle[None], half[None])[0].all()


def test_the_goal_is_listed_as_a_minimum():
    setting = ObservedRobot.of("prrrp_m1")
    goal = setting.configurations[0]
    found = cover(setting, goal)
    (own,) = [each for each in found.found if np.linalg.norm(each.x) < 1e-5]
    assert (own.falling, found.modes) == (0, (own.modes,))
    assert own.error[0] <= 1e-9 < own.radius < own.half.min()


def test_what_is_not_covered_says_why():
    setting = ObservedRobot.of("gough_stewart")
    found = cover(setting, setting.everything.start)
    assert not found.complete
    assert "more than one axis" in found.reason
