"""Platforms that translate on struts (3-UPU): rests in the coordinates of the struts' joints, written by hand, where
rods have no length and where joints lock too; the turns at which such a platform translates."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import sympy

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.progress import on_progress
from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch
from hrsynth.simulation.equilibria.exhaustive_search import cover
from hrsynth.simulation.equilibria.pose_error import PoseError
from hrsynth.simulation.equilibria.subdivision import Subdivision
from hrsynth.simulation.equilibria.upu_legs import Struts, has_coincident_lines, meetings, parallel
from simulation import scenes
from strategies import random_rotation

TURNS = {"as at the goal": 1, "by half a turn": -1}
WAYS = np.array([[np.cos(a), np.sin(a), 0.0] for a in 2 * np.pi / 3 * np.arange(3)])
AXES = np.cross([0.0, 0.0, 1.0], WAYS)
"""The outer axes: along the tangents of the base's circle (0.3 m) and of the platform's (0.12 m)."""


def ends(turn):
    """Where the platform's point is as each rod has no length, (3, 3)."""
    return (0.3 - turn * 0.12) * WAYS


@cache
def asked():
    """The robot, a goal, and the desired directions by hand."""
    setup, goal = scenes.setting("3upu"), scenes.goal("3upu")
    rods = goal.pose(setup.motion.link)[:3, 3] - ends(1)
    return setup, goal, rods / np.linalg.norm(rods, axis=1)[:, None]


@cache
def covered():
    return cover(*asked()[:2])


def listed(turn):
    """The critical points with the platform turned."""
    return [each for each in covered().found if each.R[0, 0] * turn > 0]


def directions(z):
    """u (…, 3, 3), and how it changes with the turn q about the outer axis and with the angle ε to it, of coordinates
    (…, 3, 3): q, ε and the length d of each rod."""
    q, angle = z[..., 0, None], z[..., 1, None]
    up = np.array([0.0, 0.0, 1.0])
    n, b = np.cos(q) * up + np.sin(q) * WAYS, np.cos(q) * WAYS - np.sin(q) * up
    return np.cos(angle) * AXES + np.sin(angle) * n, np.sin(angle) * b, np.cos(angle) * n - np.sin(angle) * AXES


def pulled(x, turn):
    """∇(E + μ · g) and g (…, 15) at coordinates and multipliers (…, 15), g = 0 where all rods end at one point."""
    wanted = asked()[2]
    z, mu = x[..., :9].reshape(*x.shape[:-1], 3, 3), x[..., 9:].reshape(*x.shape[:-1], 2, 3)
    u, by_q, by_angle = directions(z)
    tips = ends(turn) + z[..., 2, None] * u
    force = np.concatenate([-mu.sum(axis=-2, keepdims=True), mu], axis=-2)
    own = -(u * wanted).sum(axis=-1, keepdims=True) * wanted + z[..., 2, None] * force
    slopes = np.stack([(own * by_q).sum(-1), (own * by_angle).sum(-1), (force * u).sum(-1)], axis=-1)
    return np.concatenate(
        [slopes.reshape(*x.shape[:-1], 9), (tips[..., 1:, :] - tips[..., :1, :]).reshape(*x.shape[:-1], 6)], axis=-1
    )


def bent(x, turn):
    """The derivatives (…, 15, 15), by complex steps."""
    return np.stack([pulled(x + 1e-30j * step, turn).imag / 1e-30 for step in np.eye(15)], axis=-1)


def newton(x, turn, steps=100):
    """Zeros by themselves that Newton's method meets from coordinates (n, 15)."""
    for _ in range(steps):
        r, J = pulled(x, turn), bent(x, turn)
        good = np.isfinite(J).all(axis=(1, 2)) & (np.abs(x[:, [2, 5, 8]]).max(axis=1) < 30)
        x, r, J = x[good], r[good], J[good]
        step = (np.linalg.pinv(J, rcond=1e-13) @ r[..., None])[..., 0]
        x = x - step * np.minimum(1, 0.3 / (np.abs(step).max(axis=1) + 1e-300))[:, None]
    x = x[np.abs(pulled(x, turn)).max(axis=1) < 1e-12]
    return x[np.linalg.svd(bent(x, turn), compute_uv=False)[:, -1] > 1e-7]


def joints(each, turn):
    """Coordinates (9,) of a critical point: of a rod along its leg's axis the turn that makes it one."""
    wanted, u = asked()[2], each.directions
    d = ((each.p - ends(turn)) * u).sum(axis=1)
    q, angle = np.arctan2((u * WAYS).sum(axis=1), u[:, 2]), np.arccos(np.clip((u * AXES).sum(axis=1), -1, 1))
    for i in np.flatnonzero(np.linalg.norm(np.cross(u, AXES), axis=1) < 1e-7):
        cosines = (u * wanted).sum(axis=1)[:, None]
        parts = -cosines * (wanted - cosines * u) / np.where(np.arange(3) == i, 1.0, d)[:, None]
        w = d[i] * (parts.sum(axis=0) - parts[i]) + parts[i]
        q[i], angle[i] = np.arctan2(-w[2], w @ WAYS[i]), np.arccos(np.sign(u[i] @ AXES[i]))
    return np.stack([q, angle, d], axis=1).ravel()


@pytest.mark.parametrize(
    ("axes", "count"),
    [
        (AXES, 2),
        (AXES[:2], 2),
        (np.eye(3), 4),
        (np.eye(3)[:2], 4),
        (np.eye(3)[[0, 0]], 1),
        (np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.6, 0.8]]), 1),
    ],
)
def test_turns_carry_each_axis_along_itself(axes, count):
    """All that do: in a plane the half turn about its normal, of three at right angles three, otherwise none."""
    axes = axes @ random_rotation(np.random.default_rng(0)).T
    turns = list(parallel(axes))
    assert len(turns) == count
    for turn in turns:
        assert np.allclose(np.cross(axes @ turn.T, axes), 0)
        assert np.allclose(turn @ turn.T, np.eye(3))
        assert np.isclose(np.linalg.det(turn), 1)


@pytest.mark.slow
@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_on_the_lines_on_which_a_rod_lies_along_its_axis_all_are_found(turn):
    """As many as Sturm's sequence counts of the slope's numerator, exactly, for the digits of the desired directions;
    none where the other rods alone would not rest."""
    setup, goal, wanted = asked()
    struts = Struts.of(setup, goal, PoseError.of(setup, goal))
    assert np.abs(np.cross(struts.axes, AXES)).max() < 1e-12
    family = struts.locked_errors()[0 if turn > 0 else 3 :][:3]
    s = sympy.Symbol("s")
    for i, error in enumerate(family):
        found = []
        for chart in error.charts:
            part = Subdivision(chart, *chart.box(np.full(1, -3.0), np.full(1, 3.0), 3.0))
            part.run(10_000)
            assert not part.left
            found += [float(AXES[i] @ (each.p - ends(turn)[i])) for each in part.zeros()]
        (N, Q), (M, P) = (
            (
                sum(
                    sympy.Rational(w) * (sympy.Rational(x) + s * sympy.Rational(a))
                    for w, x, a in zip(wanted[j], ends(turn)[i] - ends(turn)[j], AXES[i], strict=True)
                ),
                sum(
                    (sympy.Rational(x) + s * sympy.Rational(a)) ** 2
                    for x, a in zip(ends(turn)[i] - ends(turn)[j], AXES[i], strict=True)
                ),
            )
            for j in range(3)
            if j != i
        )
        slope = sympy.Poly(
            (2 * N.diff(s) * Q - N * Q.diff(s)) * N * P**2 + (2 * M.diff(s) * P - M * P.diff(s)) * M * Q**2, s
        )
        found = [x for k, x in enumerate(found) if np.abs(np.array(found[:k]) - x).min(initial=1.0) > 1e-6 * abs(x)]
        assert len(found) == slope.count_roots() > 0
        # lead coefficients that are rounded to zero only would add roots at no finite place
        roots = np.sort([float(sympy.re(each)) for each in slope.nroots() if abs(sympy.im(each)) < 1e-12])
        assert np.allclose(np.sort(found), roots, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "turn",
    [
        pytest.param(turn, id=name, marks=pytest.mark.long) if name == "as at the goal" else pytest.param(turn, id=name)
        for name, turn in TURNS.items()
    ],
)
def test_rests_are_those_of_the_joints_by_hand(turn):
    """At each of 24 points, 11 with the rods as they like, 3 with one of no length, 10 with one along its axis, and
    each choice of reversed rods, the gradient over the joints vanishes; each zero by itself that Newton's method meets
    from anywhere is a member."""
    found = listed(turn)
    assert covered().is_complete
    assert len(found) == 8 * 24
    assert max(np.abs(each.p).max() for each in found) > 20
    coordinates = np.array([joints(each, turn) for each in found])
    x = np.concatenate([coordinates, np.zeros((len(found), 6))], axis=1)
    J, r = bent(x, turn), pulled(x, turn)
    x[:, 9:] = -(np.linalg.pinv(J[:, :9, 9:]) @ r[:, :9, None])[..., 0]
    assert np.abs(pulled(x, turn)).max() < 1e-9
    angles, d = coordinates.reshape(-1, 3, 3)[..., 1], coordinates.reshape(-1, 3, 3)[..., 2]
    locked, short = (np.abs(np.sin(angles)) < 1e-9).any(axis=1), (np.abs(d) < 1e-9).any(axis=1)
    assert [int(np.sum(each)) for each in (locked, short, ~locked & ~short)] == [80, 24, 88]
    rng = np.random.default_rng(0)
    z = np.stack(
        [rng.uniform(-np.pi, np.pi, (600, 3)), rng.uniform(-np.pi, np.pi, (600, 3)), rng.uniform(-1, 1, (600, 3))],
        axis=2,
    ).reshape(600, 9)
    z[::3, 1] = rng.normal(0, 0.1, 200)
    z[1::3, 5] = rng.normal(0, 0.1, 200)
    z = newton(np.concatenate([z, rng.normal(0, 0.3, (600, 6))], axis=1), turn)[:, :9].reshape(-1, 3, 3)
    u = directions(z)[0]
    told = np.concatenate([ends(turn)[0] + z[:, 0, 2, None] * u[:, 0], u.reshape(-1, 9)], axis=1)
    members = np.array([[*each.p, *each.directions.ravel()] for each in found])
    away = np.abs(told[:, None] - members).max(axis=2)
    assert away.min(axis=1).max() < 1e-5
    met = np.unique(away.argmin(axis=1))
    assert len(met) > 20
    assert locked[met].any()
    assert short[met].any()


@pytest.mark.slow
def test_kinds_sum_up_to_nothing_and_turned_platforms_are_farther_away():
    """Three dimensions, closed at infinity: the numbers of rests that are falling in 0, 1, 2 and 3 directions sum up to
    0, signs alternating, and so do those of curves of rests. Turned by half a turn the platform, similar to the base,
    rests at all points 0.42 / 0.18 times as far away, with the same directions. None with a rod along its axis
    attracts."""
    one, other = listed(1), listed(-1)
    for found in (one, other):
        assert sum((-1) ** each.falling for each in found) == 0
    for each in one:
        away = [
            np.abs(0.42 / 0.18 * each.p - model.p).max() / (1 + np.abs(model.p).max())
            + np.abs(each.directions - model.directions).max()
            for model in other
            if model.falling == each.falling
        ]
        assert min(away) < 1e-6
    lock = [np.linalg.norm(np.cross(each.directions, AXES), axis=1).min() < 1e-9 for each in covered().found]
    assert 0 < sum(lock) == sum(own and each.falling in (1, 2) for own, each in zip(lock, covered().found, strict=True))


@pytest.mark.long
def test_the_list_of_a_platform_on_struts_is_all():
    """Each rest that was found is one of those that boxes prove, and each of these is closed and enclosed."""
    setup, goal, _ = asked()
    found = EquilibriumSearch.of(setup, goal).answer(complete=True)
    assert found.complete
    assert len(found.points) == len(found.subdivision.result.found) == 2 * 8 * 24
    assert all(each.proved and each.decided for each in found.points)
    assert (found.subdivision.only_found, found.subdivision.outside_searched, found.subdivision.rotated_outside) == (
        0,
        0,
        0,
    )
    assert found.subdivision.crossings == 6
    for each in found.families:
        place = each.configuration.pose(setup.motion.link)[:3, 3]
        turn = np.sign(each.configuration.pose(setup.motion.link)[0, 0])
        along = np.linalg.norm(np.cross(place - ends(turn), AXES), axis=1)
        assert np.sum(along < 1e-6) == 2


def test_how_far_boxes_are_is_told():
    setup, stages = ObservedRobot.of("prrrp_m1"), list[str]()
    with on_progress(stages.append):
        cover(setup, setup.configurations[0], vanishing=True)
    told = [int(each.split()[1]) for each in stages if each.startswith("boxes")]
    assert len(told) > 3
    assert all(0 <= one <= other <= 100 for one, other in pairwise(told))


def test_lines_on_which_legs_lock_meet_in_points_or_are_one():
    """Three lines through a point meet once; of two that are one no points are told, and such legs are not struts."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        centre, R = rng.normal(size=3), random_rotation(rng)
        through = [(centre + rng.normal() * axis, axis) for axis in R]
        (met,) = meetings(through)
        assert np.abs(met - centre).max() < 1e-12
        assert not has_coincident_lines(through)
        apart = [(p + 0.3 * k * R[(k + 1) % 3], axis) for k, (p, axis) in enumerate(through)]
        assert len(meetings(apart[:2])) == 0
        point, axis = through[0]
        beside = [(point, axis), (point + rng.normal() * axis, -axis)]
        assert has_coincident_lines([*through, *beside[1:]])
        assert meetings(beside) == []
        assert not has_coincident_lines([beside[0], (beside[1][0] + 0.1 * R[1], axis)])
