"""Platforms held by points that legs keep in planes (3-RPS): poses, rates and rests against formulas by hand, over the
three points themselves with their distances as equations."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load
from hrsynth.geometry.affine import make_affine
from hrsynth.geometry.so3 import convert_vectors_to_rotations
from hrsynth.simulation.equilibria.critical_poses import CriticalPoses, PoseToJoints
from hrsynth.simulation.equilibria.descent import CriticalPoint
from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch
from hrsynth.simulation.equilibria.exhaustive_search import cover
from hrsynth.simulation.equilibria.points_in_planes_error import PlaneError, factors
from hrsynth.simulation.equilibria.pose_error import EnclosureFailure
from hrsynth.simulation.equilibria.search import DistinctPoints
from simulation import scenes

WAYS = np.array([[np.cos(a), np.sin(a), 0.0] for a in 2 * np.pi / 3 * np.arange(3)])
TANGENTS = np.cross([0.0, 0.0, 1.0], WAYS)
BASE, PLATFORM = 0.4, 0.15
PAIRS = [(0, 1), (1, 2), (2, 0)]
STEP = 1e-6


@cache
def families():
    return PlaneError.families(scenes.setting("3rps"), scenes.goal("3rps"))


def points(p, R):
    """Where the platform's three points are (…, 3, 3) (m)."""
    return p[..., None, :] + PLATFORM * WAYS @ np.swapaxes(R, -1, -2)


def rods(p, R):
    return points(p, R) - BASE * WAYS


@cache
def wanted():
    """The directions at the goal, in their planes: outwards and up."""
    X = scenes.goal("3rps").pose("platform")
    found = rods(X[:3, 3], X[:3, :3])
    found = np.stack([(found * WAYS).sum(axis=1), found[:, 2]], axis=1)
    return found / np.linalg.norm(found, axis=1)[:, None]


def level(s):
    """E of rods s (…, 3, 2), outwards and up."""
    return 0.5 * (1 - (s * wanted()).sum(axis=-1) ** 2 / (s * s).sum(axis=-1)).sum(axis=-1)


def at(formula, y):
    forms = [make_affine(x, np.zeros((len(y), 0)), 0 * x) for x in y.T]
    return np.array([np.broadcast_to(each.v[0], len(y)) for each in formula.at(forms)]).T


def drawn(error, rng, count=4):
    """Coordinates (count, n) of closures, rods pointing either way."""
    y = rng.uniform(0.2, 1.0, (count, error.size[0]))
    p, R = error.pose(y)
    found = rods(error.error.length * p, R)
    for i in range(3):
        limb = error.error.limbs[i]
        one = np.linalg.svd(limb.axis[None])[2][1]
        two = np.cross(limb.axis, one)
        either = np.pi * rng.integers(2, size=count)
        y[:, error.freedoms + i] = np.arctan2(found[:, i] @ two, found[:, i] @ one) + either
    return y


def test_poses_keep_their_points_in_the_planes():
    """Of both families, in all charts; one has the goal among its poses, the other has half turns alone."""
    rng = np.random.default_rng(0)
    assert len(families()) == 2
    R = scenes.goal("3rps").pose("platform")[:3, :3]
    assert [each.has_rotation(R) for each in families()].count(True) == 1
    for family in families():
        assert len(family.charts) == 6
        for error in family.charts:
            y = drawn(error, rng)
            p, R = error.pose(y)
            assert np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() < 1e-12
            tips = points(error.error.length * p, R)
            assert np.abs((tips * TANGENTS).sum(axis=2)).max() < 1e-9
            assert np.abs(at(error.closing, y)).max() < 1e-12
            if not family.has_rotation(scenes.goal("3rps").pose("platform")[:3, :3]):
                assert np.abs(np.trace(R, axis1=1, axis2=2) + 1).max() < 1e-12


def test_rates_are_those_of_differences():
    """Of the equations and of E, nearby and far away, and with the product of the factors as an equation; far away
    those by turns are rates over w."""
    rng = np.random.default_rng(0)
    one, other = (np.linalg.svd(each.span.T)[2][3] for each in families())
    whole = replace(
        families()[0],
        span=np.linalg.qr(rng.normal(size=(4, 4)))[0],
        forms=(np.outer(one, other) + np.outer(other, one))[None],
    )
    for error in (chart for family in (*families(), whole) for chart in family.charts[::5]):
        (n, k), y = error.size, drawn(error, rng)
        told, own = at(error.slopes, y), k - len(error.forms)
        for j in range(n):
            step = STEP * np.eye(n)[j]
            rate = np.ones((len(y), k))
            if error.far is not None and 1 <= j < error.freedoms:
                rate[:, :own] = y[:, error.far, None]
            g = (at(error.closing, y + step) - at(error.closing, y - step)) / (2 * STEP)
            assert np.allclose(g, told[:, k : k + k * n].reshape(-1, k, n)[..., j] * rate, atol=1e-7)
            u = [at(error.directions, y + sign * step).reshape(-1, 3, 3) for sign in (1, -1)]
            c = [(each * np.array(error.wanted, dtype=float)).sum(axis=2) for each in u]
            slope = (0.5 * (c[1] ** 2 - c[0] ** 2)).sum(axis=1) / (2 * STEP)
            assert np.allclose(slope, told[:, k + k * n : k + k * n + n][:, j] * rate[:, 0], atol=1e-7)


def test_boxes_hold_the_poses_that_are_told():
    """What a box is said to hold, holds the poses of its points."""
    rng = np.random.default_rng(0)
    goal = families()[0].error
    for error in (chart for family in families() for chart in family.charts):
        y, half = drawn(error, rng), rng.uniform(0, 0.05, (4, error.size[0]))
        low, high = error.enclose_chart(y, half)
        for _ in range(20):
            p, R = error.pose(y + rng.uniform(-1, 1, y.shape) * half)
            turn = R @ goal.R.T
            axis = (
                np.stack(
                    [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]],
                    axis=1,
                )
                / 2
            )
            x = np.concatenate([(p - goal.p) @ goal.shifts, axis], axis=1)
            assert np.all((low[:, :6] <= x) & (x <= high[:, :6]))


def test_forms_of_rank_two_are_factors():
    """A product of two linear forms vanishes where one does; another form stays."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 4))
    spaces = list(factors(np.eye(4), [np.outer(a, b) + np.outer(b, a)]))
    assert [span.shape for span, _ in spaces] == [(4, 3), (4, 3)]
    assert min(np.abs(a @ span).max() for span, _ in spaces) < 1e-12
    assert min(np.abs(b @ span).max() for span, _ in spaces) < 1e-12
    form = np.diag([1.0, 2.0, -1.0, -0.5])
    ((span, left),) = factors(np.eye(4), [form])
    assert span.shape == (4, 4)
    assert left[0] is form
    assert list(factors(np.eye(4), [np.eye(4)])) == []
    for touching in (np.outer(a, a), np.outer(a, a) + np.outer(b, b)):
        with pytest.raises(EnclosureFailure):
            list(factors(np.eye(4), [touching]))


def test_where_closures_meet_a_slope_along_one_of_them_is_no_rest():
    """Half turns about axes of the base's plane are of both families: E has slopes of 0.1 and more along one, by
    differences, which no multiplier holds; a rest without an error is kept there as elsewhere."""
    setup, goal = scenes.setting("3rps"), scenes.goal("3rps")
    search = EquilibriumSearch.of(setup, goal)
    axis = 3.0631801519497515 / 2
    R = convert_vectors_to_rotations(np.pi * np.array([np.cos(axis), np.sin(axis), 0.0]))
    p = np.array([0.0, 0.0, 0.3328])
    offsets = PLATFORM * np.einsum("ij,ij->i", WAYS @ R.T, TANGENTS)
    p[:2] = -np.linalg.lstsq(TANGENTS[:, :2], offsets, rcond=None)[0]
    family = next(each for each in families() if each.has_rotation(goal.pose("platform")[:3, :3]))
    assert all(each.has_rotation(R) for each in families())

    def along(turn):
        """E on the goal's family, its turns about axes of the base's plane."""
        own = convert_vectors_to_rotations(np.pi * np.array([np.cos(axis), np.sin(axis), 0.0]) * (1 + turn / np.pi))
        off = PLATFORM * np.einsum("ij,ij->i", WAYS @ own.T, TANGENTS)
        way = rods(np.array([*-np.linalg.lstsq(TANGENTS[:, :2], off, rcond=None)[0], 0.3328]), own)
        assert np.abs((way * TANGENTS).sum(axis=1)).max() < 1e-12
        return level(np.stack([(way * WAYS).sum(axis=1), way[:, 2]], axis=1))

    assert family.has_rotation(convert_vectors_to_rotations(3.0 * np.array([np.cos(axis), np.sin(axis), 0.0])))
    assert abs(along(STEP) - along(-STEP)) / (2 * STEP) > 0.05
    u = rods(p, R) / np.linalg.norm(rods(p, R), axis=1)[:, None]
    none = np.zeros(1, dtype=np.intp)
    home = search.system.system.read(goal.pose)
    pool = home + np.random.default_rng(0).normal(size=(400, len(home)))
    (q,), (done,) = PoseToJoints(search.system, search.law.observation_model.observations, family.error)(
        CriticalPoses(p[None], R[None], u[None], none, none), pool
    )
    assert done
    point = CriticalPoint(q, np.zeros(search.system.size[1]), 0.0, np.array([0.1, 0.2, 1e4]), 0.04)
    assert DistinctPoints(search.system, setup).add([point]) == 0
    there = CriticalPoint(home, point.multipliers, 0.0, np.array([0.1, 0.2, 0.3]), 0.0)
    assert DistinctPoints(search.system, setup).add([there]) == 1


def lagrange(y):
    """∇(E + μ · g), g and its derivative (…, 9, 9) at y (…, 9): points outwards r and up z in their planes, multipliers
    μ of their squared distances. The derivative by differences."""
    s, mu = np.stack([y[..., :3] - BASE, y[..., 3:6]], axis=-1), y[..., 6:]
    size = (s * s).sum(axis=-1, keepdims=True)
    c = (s * wanted()).sum(axis=-1, keepdims=True)
    pull = -c * wanted() / size + c * c * s / size**2
    B = y[..., :3, None] * WAYS + y[..., 3:6, None] * np.array([0.0, 0.0, 1.0])
    g = []
    for k, (i, j) in enumerate(PAIRS):
        way = B[..., i, :] - B[..., j, :]
        g.append(0.5 * ((way * way).sum(axis=-1) - 3 * PLATFORM**2))
        for one, sign in ((i, 1.0), (j, -1.0)):
            pull[..., one, 0] += sign * mu[..., k] * (way @ WAYS[one])
            pull[..., one, 1] += sign * mu[..., k] * way[..., 2]
    return np.concatenate([pull[..., 0], pull[..., 1], np.stack(g, axis=-1)], axis=-1)


def zeros(x, steps=60):
    """Those of Lagrange's equations that Newton's method meets from points (n, 6), multipliers at first as they fit."""
    y = np.concatenate([x, np.zeros((len(x), 3))], axis=1)
    pull, rates = lagrange(y), np.stack([lagrange(y + e) for e in np.eye(9)[6:]], axis=-1)
    back = np.linalg.pinv((rates - pull[..., None])[:, :6])
    y[:, 6:] = -(back @ pull[:, :6, None])[..., 0]
    with np.errstate(all="ignore"):
        for _ in range(steps):
            J = np.stack([(lagrange(y + STEP * e) - lagrange(y - STEP * e)) / (2 * STEP) for e in np.eye(9)], axis=-1)
            step = np.linalg.solve(J + 1e-14 * np.eye(9), lagrange(y)[..., None])[..., 0]
            y = y - step * np.minimum(1, 0.3 / np.abs(step[:, :6]).max(axis=1))[:, None]
            y = y[np.isfinite(y).all(axis=1)]
        return y[(np.abs(lagrange(y)).max(axis=1) < 1e-11) & (np.abs(y[:, :6]).max(axis=1) < 100)]


@pytest.mark.long
def test_all_rests_of_the_two_families_are_listed():
    """18 poses at which the platform is turned about axes of the base's plane, 22 half turns: Newton's method on
    Lagrange's equations over the three points meets all of them and no other; their kinds sum up to nothing in each of
    the families, which are closed but for where E is the same all over."""
    found = cover(scenes.setting("3rps"), scenes.goal("3rps"))
    assert found.is_complete
    assert found.bounded
    assert not found.locked
    assert len(found.found) == 8 * 40
    poses = found.found[:40]
    tips = np.array([points(each.p, each.R) for each in poses])
    listed = np.concatenate([(tips * WAYS).sum(axis=2), tips[..., 2]], axis=1)
    told = np.array([np.mean(each.error) for each in poses])
    levels = level(np.stack([listed[:, :3] - BASE, listed[:, 3:]], axis=-1))
    assert np.abs(np.sqrt(2 * np.maximum(levels, 0)) - told).max() < 1e-6
    half = np.array([abs(np.trace(each.R) + 1) < 1e-9 for each in poses])
    for family, kinds in ((~half, [4, 5, 5, 4]), (half, [3, 8, 8, 3])):
        falling = [each.falling for each, own in zip(poses, family, strict=True) if own]
        assert [falling.count(k) for k in range(4)] == kinds
    rng, met = np.random.default_rng(0), np.zeros(40, dtype=int)
    for _ in range(4):
        away = rng.choice([0.003, 0.03, 0.3], (1500, 1))
        some = listed[rng.integers(40, size=1500)] + rng.normal(size=(1500, 6)) * away
        for y in zeros(some):
            away = np.abs(listed - y[:6]).max(axis=1)
            if np.abs(y[6:]).max() < 1e4:
                assert away.min() < 1e-6
                met[away.argmin()] += 1
    assert np.all(met > 0)


@pytest.mark.long
def test_rests_of_a_robot_without_symmetry_are_one_family(tmp_path):
    """A leg of the 3-RPS and its ball moved by 3 and 2 cm: the form of turns is no product; kinds sum up to nothing."""
    text = list_robots()["3rps"].read_text()
    for old, new in (
        ("-0.2 0.34641016151378 0", "-0.17 0.36641016151378 0"),
        ("-0.075 0.12990381056767 0", "-0.045 0.14990381056767 0"),
    ):
        assert text.count(f'"{old}"') == 1
        text = text.replace(f'"{old}"', f'"{new}"')
    (tmp_path / "robot.urdf").write_text(text)
    setup = ObservedRobot.of(load(tmp_path / "robot.urdf"))
    (family,) = PlaneError.families(setup, setup.all_samples.start)
    assert len(family.forms) == 1
    found = cover(setup, setup.all_samples.start)
    assert found.is_complete
    assert not found.locked
    falling = [each.falling for each in found.found]
    assert [falling.count(k) for k in range(4)] == [56, 120, 128, 64]
