"""Lists of critical points by subdivision: the members are zeros, no other is met by Newton's method from anywhere, and
on a closed surface their kinds sum up to what its shape asks for."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hrsynth import load
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.closed_forms.legs import OnRail, OnRod
from hrsynth.equations.joint_equations import build_loop_system, evaluate_residuals
from hrsynth.equations.loop_parts import DISTANCE
from hrsynth.geometry.affine import make_affine
from hrsynth.geometry.so3 import turn_about
from hrsynth.geometry.vectors import Array, hat
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.pose import parse_pose
from hrsynth.simulation.equilibria.exhaustive_search import (
    LOCKED_PLACE_EDGE_FRACTION,
    SubdivisionResult,
    _cut_long,
    _places,
    cover,
    join_boxes,
    reachable_box,
)
from hrsynth.simulation.equilibria.flow import Places
from hrsynth.simulation.equilibria.joint_bounds import narrow_angle, narrow_travel
from hrsynth.simulation.equilibria.joint_error import JointError
from hrsynth.simulation.equilibria.pose_error import PoseError
from hrsynth.simulation.equilibria.subdivision import POSE_BOX_MIN_FRACTION, Subdivision, forms_of
from hrsynth.tolerances import SUBDIVISION_BOXES_MAX
from simulation import scenes
from strategies import random_rotation, transformed

STEP = 1e-6


def levels(error, modes, x):
    """Whether all legs reach (n,), and E, at coordinates (n, size), in some working modes, to the directions in those
    of the goal."""
    other = replace(error, limbs=tuple(replace(limb, mode=mode) for limb, mode in zip(error.limbs, modes, strict=True)))
    with np.errstate(all="ignore"):
        own, there = (
            np.array(
                [
                    [np.broadcast_to(c, len(x)) for c in each.u]
                    for each in one.at(list(at.T), [], lambda value: value).seen
                ]
            )
            for one, at in ((error, 0 * x), (other, x))
        )
        reached = np.all([margin > 0 for margin in other.at(list(x.T), [], lambda value: value).margins], axis=0)
    return reached, 0.5 * (1 - (own * there).sum(axis=1) ** 2).sum(axis=0)


def slopes(error, modes, x):
    """∇E (n, size) at coordinates, by differences of E alone; no number out of reach."""
    found = []
    for axis in np.eye(error.size):
        (one, up), (other, down) = (levels(error, modes, x + sign * STEP * axis) for sign in (1, -1))
        found.append(np.where(one & other, up - down, np.nan) / (2 * STEP))
    return np.array(found).T


def newton(error, modes, x, steps=20):
    """Zeros of ∇E that Newton's method meets from places (n, size)."""
    for _ in range(steps):
        g = slopes(error, modes, x)
        H = np.array(
            [
                (slopes(error, modes, x + 1e-4 * axis) - slopes(error, modes, x - 1e-4 * axis)) / 2e-4
                for axis in np.eye(error.size)
            ]
        ).transpose(1, 0, 2)
        good = np.isfinite(H).all(axis=(1, 2)) & np.isfinite(g).all(axis=1)
        good[good] = np.abs(np.linalg.det(H[good])) > 1e-9
        x, g, H = x[good], g[good], H[good]
        if not len(x):
            break
        step = np.linalg.solve(H, g[..., None])[..., 0]
        x = x - step * np.minimum(1, 0.3 / (np.linalg.norm(step, axis=1) + 1e-300))[:, None]
    return x[np.linalg.norm(slopes(error, modes, x), axis=1) < 1e-7] if len(x) else x


def unlisted(setup, found, rng, count=40, goal=None):
    """Zeros that Newton's method meets in reach, in all working modes, farther than 1e-4 from all members and from open
    boxes; the goal by default is the zero configuration."""
    error = PoseError.of(setup, goal or setup.all_samples.start)
    missed = []
    listed = np.array([each.x[: error.size] for each in found.found]).reshape(-1, error.size)
    for modes in product(*((-1.0, 1.0) if isinstance(limb, OnRod) else (limb.mode,) for limb in error.limbs)):
        for x in newton(error, modes, rng.uniform(-4, 4, (count, error.size))):
            left = any(np.all((low - 1e-3 < x) & (x < high + 1e-3)) for low, high in found.open)
            if not np.any(np.linalg.norm(listed - x, axis=1) < 1e-4) and not left and np.all(np.abs(x) < 3):
                missed.append((modes, x))
    return missed


@pytest.mark.parametrize("name", ["3rrr_m1", "3rpr_m1", "prrrp_m1", "quattro"])
def test_rates_by_pose_and_joints_are_those_of_differences(name):
    """Of the equations and of E, in all charts; far away those by the turn are rates over w."""
    setup, rng = ObservedRobot.of(name), np.random.default_rng(0)
    whole = JointError.of(PoseError.of(setup, setup.all_samples.start))
    for error in whole.charts:
        n, k = error.size
        y = rng.uniform(0.2, 1.0, (3, n))

        def at(formula, y):
            forms = [make_affine(x, np.zeros((len(y), 0)), 0 * x) for x in y.T]
            return np.array([each.v[0] for each in formula.at(forms)]).T

        told = at(error.slopes, y)
        for j in range(n):
            step = STEP * np.eye(n)[j]
            rate = 1.0 if error.far is None or j != 2 else y[:, error.far]
            g = (at(error.closing, y + step) - at(error.closing, y - step)) / (2 * STEP)
            own = told[:, k : k + k * n].reshape(3, k, n)[..., j]
            assert np.allclose(g, own * np.reshape(rate, (-1, 1)), atol=1e-7)
            # E of directions that are of length one where g vanishes: by the cosines
            u = [np.array(at(error.directions, y + sign * step)).reshape(3, -1, 3) for sign in (1, -1)]
            c = [(each * np.array(error.wanted, dtype=float)).sum(axis=2) for each in u]
            slope = (0.5 * (c[1] ** 2 - c[0] ** 2)).sum(axis=1) / (2 * STEP)
            assert np.allclose(slope, told[:, k + k * n : k + k * n + n][:, j] * rate, atol=1e-7)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", ["3rpr_m1", "3rrr_m1", "delta", "orthoglide", "prrrp_m1", "quattro"])
def test_joints_are_narrowed_to_where_the_legs_close(name):
    """Of poses in a box, each zero of an equation along its own joint, met by signs of that equation alone, stays
    within what closed forms leave of the box; of one pose that ends at zeros."""
    setup, rng = ObservedRobot.of(name), np.random.default_rng(0)
    error = JointError.of(PoseError.of(setup, setup.all_samples.start))
    (n, k), (low, high) = error.size, error.box(*reachable_box(error.error, 1.0)[:2], 1.0)
    places, met, cut = np.linspace(0, 1, 1000), 0, 0
    for half in [0.0, 0.0, 0.0, 0.01, 0.01, 0.01, 0.1, 0.1, 0.1]:
        pose, room = rng.uniform(low, high)[: n - k], half * (high - low)[: n - k]
        a, b = np.concatenate([pose - room, low[n - k :]]), np.concatenate([pose + room, high[n - k :]])
        if half:
            a[n - k :], b[n - k :] = np.sort(rng.uniform(a, b, (2, n)), axis=0)[:, n - k :]
        forms = [
            make_affine(x[None], each[None], np.zeros(1))
            for x, each in zip((a + b) / 2, np.diag((b - a) / 2), strict=True)
        ]
        inner, outer = error.narrow(forms, a[None], b[None])
        for i in range(n - k, n):
            for _ in range(3):
                y = np.tile(pose + room * rng.uniform(-1, 1, n - k), (len(places), 1))
                y = np.hstack([y, np.zeros((len(y), k))])
                y[:, i] = a[i] + places * (b[i] - a[i])
                g = error.closing.at([make_affine(x, np.zeros((len(y), 0)), 0 * x) for x in y.T])[i - n + k].v[0]
                zeros = y[:-1, i][g[:-1] * g[1:] < 0]
                met += len(zeros)
                step = (b[i] - a[i]) / len(places)
                assert np.all((inner[0, i] <= zeros + step) & (zeros - step <= outer[0, i]))
                if not half:
                    ends = [inner[0, i], outer[0, i]] if len(zeros) else []
                    assert all(np.abs(zeros - end).min() < 2 * step for end in ends)
            cut += inner[0, i] > outer[0, i] or outer[0, i] - inner[0, i] < 0.9 * (b[i] - a[i])
    assert met > 20
    assert cut > 6


class Looked(Subdivision):
    """Boxes, with all tubes that were looked at."""

    tubes: list

    def _settle(self, tube, P, N):
        self.tubes.append((np.array([each.v for each in tube]), np.array([each.r for each in tube]), P, N))
        return super()._settle(tube, P, N)


def closed(error, y, P):
    """Coordinates (c, n), those of P (c, k) so that the equations hold; no numbers where Newton's method does not
    meet them."""
    n, k = error.size
    y = y.copy()
    for _ in range(12):
        told = np.array(
            [each.v[0] for each in error.slopes.at([make_affine(x, np.zeros((len(y), 0)), 0 * x) for x in y.T])]
        ).T
        g, M = told[:, :k], told[:, k : k + k * n].reshape(-1, k, n)
        step = np.linalg.pinv(np.take_along_axis(M, P[:, None], 2)) @ g[..., None]
        np.put_along_axis(y, P, np.take_along_axis(y, P, 1) - step[..., 0], 1)
    return np.where(np.abs(g).max(axis=1, keepdims=True) < 1e-10, y, np.nan)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["3rpr_m1", "3rrr_m1", "orthoglide", "quattro"])
def test_a_tube_holds_all_that_meets_the_equations_in_its_box(name):
    """In the box's own symbols and those of what each equation leaves open, one after the other."""
    setup, rng = ObservedRobot.of(name), np.random.default_rng(0)
    error = JointError.of(PoseError.of(setup, setup.all_samples.start))
    (n, k), (low, high) = error.size, error.box(*reachable_box(error.error, 1.0)[:2], 1.0)
    part, met = Looked(error, low, high), 0
    for times in np.repeat([0.1, 0.03, 0.01, 0.001], 8):
        y = np.full((1, n), np.nan)
        while np.isnan(y).any():
            y = closed(error, rng.uniform(low, high)[None], np.arange(n - k, n)[None])
        half = times * (high - low)[None] * rng.uniform(0.3, 1, (1, n))
        middle, part.tubes = y + half * rng.uniform(-0.9, 0.9, (1, n)), []
        part(middle, half)
        for v, r, P, N in part.tubes:
            x = np.repeat(middle, 60, axis=0) + half * rng.uniform(-1, 1, (60, n))
            x = closed(error, x, np.repeat(P, 60, axis=0))
            x = x[np.all(np.abs(x - middle) < half, axis=1)]
            met += len(x)
            d = n - k
            # the symbols of N, and what is left of P then
            at, own = v[N[0], 0, 0], v[N[0], 1 : 1 + d, 0]
            symbols = np.linalg.solve(own, (x[:, N[0]] - at).T).T
            assert np.all(np.abs(symbols) < 1 + 1e-9)
            left = x[:, P[0]] - v[P[0], 0, 0] - symbols @ v[P[0], 1 : 1 + d, 0].T
            doubt = v[P[0], 1 + d :, 0]
            assert np.all(np.abs(left) < np.abs(doubt).sum(axis=1) + r[P[0], 0] + 1e-9)
            if np.all(r[P[0], 0] < 1e-9) and np.linalg.cond(doubt) < 1e6:
                assert np.all(np.abs(np.linalg.solve(doubt, left.T)) < 1 + 1e-6)
    assert met > 200


@pytest.mark.slow
@pytest.mark.parametrize("name", ["3rpr_m1", "3rrr_m1", "quattro"])
def test_moments_about_a_tip_are_those_of_the_other_legs(name):
    """By differences of the other legs' part of E, in the closed forms of their working modes, while the platform turns
    about the tip."""
    setup, rng = ObservedRobot.of(name), np.random.default_rng(0)
    error = JointError.of(PoseError.of(setup, setup.all_samples.start))
    (n, k), (low, high) = error.size, error.box(*reachable_box(error.error, 1.0)[:2], 1.0)
    assert len(error.apart) == (2 if name == "quattro" else 3)
    # a leg that is not watched pushes where it is stretched
    assert not JointError.of(replace(error.error, seen=error.error.seen[1:])).apart
    pose, met = error.error, 0
    while met < 20:
        y = closed(error, rng.uniform(low, high)[None], np.arange(n - k, n)[None])
        if np.isnan(y).any():
            continue
        forms = [make_affine(x, np.zeros((1, 0)), 0 * x) for x in y.T]
        told = np.array([each.v[0, 0] for each in error.moments.at(forms)])
        M = np.array([each.v[0, 0] for each in error.slopes.at(forms)])[k : k + k * n].reshape(k, n)
        p, R = (each[0] for each in error.pose(y))
        for row, (at, rest) in zip(told, error.apart, strict=True):
            arm, wanted = (
                pose.limbs[at].tip.turned,
                dict(zip([each.limb for each in pose.seen], np.array(error.wanted, dtype=float), strict=True)),
            )
            levels, sides = [], error.directions.at(forms)
            here = np.array([each.v[0, 0] for each in sides]).reshape(-1, 3)
            for angle in (STEP, -STEP):
                turned = Rotation.from_rotvec(angle * pose.turns[:, 0]).as_matrix() @ R
                moved, E = p + R @ arm - turned @ arm, 0.0
                for place, each in enumerate(pose.seen):
                    if each.limb in rest:
                        limb, u = pose.limbs[each.limb], []
                        for mode in (1.0, -1.0):
                            found = replace(limb, mode=mode).pose(moved[None], turned[None])[0][0]
                            u.append(found * each.sense)
                        own = min(u, key=lambda each, there=here[place]: np.abs(each - there).max())
                        E += 0.5 * (1 - (own @ wanted[each.limb]) ** 2)
                levels.append(E)
            slopes_ = np.prod([M[error.joints.index(i), error.freedoms + error.joints.index(i)] for i in rest])
            if np.isfinite(levels).all() and abs(slopes_) > 0.05:
                assert np.isclose((levels[1] - levels[0]) / (2 * STEP) * slopes_, row, atol=1e-6)
                met += 1


@given(st.integers(0, 2**32 - 1))
def test_no_place_of_a_joint_is_lost(seed):
    """An angle z solves a quadratic in exp(iz), a travel one of its own; of coefficients in bounds each zero that is
    between the joint's bounds stays between the narrowed ones. Where a bound is no number, nothing is narrowed."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-6, 0.5)
    low = rng.normal(size=3) * rng.choice([0, 1e-6, 0.1, 1.0], 3)
    high = low + size * rng.uniform(size=3) * rng.choice([0, 1], 3)
    A, B, C = low + (high - low) * rng.uniform(size=3)
    bounds = [(low[[i]], high[[i]]) for i in range(3)]
    with np.errstate(all="ignore"):
        ratio = np.sort(-A / np.hypot(B, C) + size * np.array([rng.normal(), 0.0]))[:, None]
    ratio = ratio if rng.integers(2) else np.full((2, 1), np.nan)
    squares = np.sort([B * B - 2 * A, B * B - 2 * A + size * rng.normal()])[:, None]
    kinds: list[tuple[Any, ...]] = [
        (narrow_angle, [*bounds, (ratio[0], ratio[1])], np.roots([(B - 1j * C) / 2, A, (B + 1j * C) / 2]), np.pi),
        (narrow_travel, [bounds[1], (squares[0], squares[1])], np.roots([0.5, B, A]), 5.0),
    ]
    for narrow, told, roots, whole in kinds:
        turning = narrow is narrow_angle
        met = np.abs(np.abs(roots) - 1) < 1e-12 if turning else np.abs(roots.imag) < 1e-12
        own = np.sort(rng.uniform(-whole, whole, 2)) if rng.integers(2) else np.array([-whole, whole])
        edges = own[[0]], own[[1]]
        inner, outer = narrow(told, edges)
        for place in np.angle(roots[met]) if turning else roots[met].real:
            if own[0] + 1e-9 < place < own[1] - 1e-9:
                assert inner[0] - 1e-9 <= place <= outer[0] + 1e-9
        assert narrow([(low[[0]], np.array([np.nan])), *told[1:]], edges) == edges


def read_coordinates(setup, error, system, at):
    """Coordinates of the platform's pose, and of the joints at the base as the joint graph has them."""
    base, legs, pose = setup.mechanism.base, {each.label: each for each in setup.decomposition.legs}, error.error
    (p, R), q0 = (each[0] for each in pose.coordinates.of([at])), system.read(setup.all_samples.start.pose)
    y = [*(pose.shifts.T @ (p - pose.p)), *(turn_about(axis, R @ pose.R.T)[0] for axis in pose.turns.T)]
    for i, joint in zip(error.joints, error.feet, strict=True):
        limb = pose.limbs[i]
        (foot,) = (each for each in legs[limb.label].joints if base in setup.mechanism.joints[each].links)
        (place,) = (place for place, each in enumerate(system.coordinates) if each.joint == foot)
        start = limb.solve(limb.tip.value(pose.p[None], pose.R[None]), limb.mode)[1][0]
        start = start - limb.centre if isinstance(limb, OnRod) else start
        way = (system.read(at.pose) - q0)[place] * np.sign(joint.axis @ system.coordinates[place].axis)
        y.append(
            joint.axis @ start + way
            if joint.start is None
            else np.arctan2(joint.ahead @ start, joint.start @ start) + way
        )
    return y


@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["delta", "orthoglide", "3prr_m1", "linear_delta", "quattro_rigid"])
def test_equations_of_rods_are_those_of_the_joint_graph(name):
    """Of robots whose graph leaves out the joint at a rod's near end: also where they do not hold, at any place of the
    free platform and of the joints, each rod's distance between its ends is off by as much."""
    setup, rng = scenes.setting(name), np.random.default_rng(0)
    error = JointError.of(PoseError.of(setup, setup.all_samples.start))
    system = build_loop_system(setup.mechanism, (), free=True)
    rods = {loop.name: loop for loop in system.loops if loop.swung is not None}
    free = [i for i, each in enumerate(system.coordinates) if setup.mechanism.platform in each.joint]
    for _ in range(5):
        values = rng.uniform(-0.5, 0.5, len(system.coordinates))
        values[free[error.freedoms :]] = 0.0
        at = SimpleNamespace(pose=lambda link, values=values: system.pose(link, values))
        y = read_coordinates(setup, error, system, at)
        forms = [make_affine(np.array([each]), np.zeros((1, 0)), np.zeros(1)) for each in y]
        told = error.closing.together(forms).v[0, 0]
        off = [evaluate_residuals(system, loop, values, [DISTANCE])[0][0] for loop in rods.values()]
        assert len(off) in (len(told), 2 * len(told))
        assert np.abs(np.array(off).reshape(len(told), -1) - told[:, None]).max() < 1e-10
        assert np.abs(told).min() > 1e-6


@pytest.mark.some(4)
@pytest.mark.parametrize(
    "name",
    [
        "3puu",
        "quattro",
        "rrrrr_m1",
        "3rpr_m1",
        "3prr_m1",
        "3rrr_m1",
        "delta",
        "linear_delta",
        "orthoglide",
        "prrrp_m1",
        "quattro_rigid",
        "rprpr_m1",
    ],
)
def test_equations_hold_where_the_joint_graph_is_closed(name):
    """At configurations of the whole mechanism, with the coordinates of the joints at the base that its joint graph
    has: a rod that has a joint inside, or a rod too many, does not hold there; and no equation depends on the others.
    Directions are those that are measured."""
    setup = scenes.setting(name)
    pose = PoseError.of(setup, setup.all_samples.start)
    error, system = JointError.of(pose), build_loop_system(setup.mechanism, ())
    n, k = error.size
    assert n - k == pose.size
    for at in setup.configurations[:6]:
        y = read_coordinates(setup, error, system, at)
        forms = [make_affine(np.array([each]), np.zeros((1, 0)), np.zeros(1)) for each in y]
        told = error.slopes.together(forms).v[0, 0]
        assert np.abs(told[:k]).max() < 1e-10
        assert np.linalg.matrix_rank(told[k : k + k * n].reshape(k, n), 1e-6) == k
        u = error.directions.together(forms).v[0].reshape(-1, 3)
        seen = [at.pose(each.link)[:3, :3] @ each.direction for each in setup.observed if isinstance(each, Direction)]
        assert np.abs(u - seen).max() < 1e-10


@pytest.mark.slow
def test_a_closed_surface_of_poses_has_the_kinds_that_its_shape_asks_for():
    """The PRRRP, two rods on two rails, also in a tilted base: its closures make up a torus, on which the numbers of
    minima, saddles and maxima sum up to nothing, signs alternating."""
    rng = np.random.default_rng(0)
    setup = ObservedRobot.of(transformed(load("prrrp_m1"), random_rotation(rng), rng.normal(size=3)))
    found = cover(setup, setup.all_samples.start)
    assert found.is_complete
    assert found.bounded
    assert [sum(each.falling == k for each in found.found) for k in range(3)] == [4, 8, 4]
    assert sum(each.error[0] < 1e-5 for each in found.found) == 4
    assert unlisted(setup, found, rng) == []


@pytest.mark.slow
@pytest.mark.parametrize(("name", "budget"), [("rprpr_m1", None), ("rrrrr_m1", None), ("rrrrr_m1", 5_000)])
def test_no_other_critical_point_is_met(name, budget):
    """Where boxes are left open, they are told; away from them the list is whole."""
    setup = ObservedRobot.of(name)
    found = cover(setup, setup.all_samples.start, budget=budget or SUBDIVISION_BOXES_MAX, reach=3.0)
    assert found.is_complete is (budget is None)
    assert bool(found.open) is not found.is_complete
    assert unlisted(setup, found, np.random.default_rng(1)) == []


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    ("name", "number"),
    [
        pytest.param("rrrrr_m1", -6, marks=pytest.mark.slow),
        pytest.param("3prr_m1", 0, marks=pytest.mark.slow),
        pytest.param("3rrr_m1", 0, marks=pytest.mark.long),
    ],
)
def test_kinds_sum_up_to_the_number_of_the_closures(name, number):
    """The five-bar's closures make up a surface of genus 4, as those of an equilateral pentagon; of any that have three
    dimensions the number is 0."""
    setup = ObservedRobot.of(name)
    found = cover(setup, setup.all_samples.start)
    assert found.is_complete
    assert sum((-1) ** each.falling for each in found.found) == number


@pytest.mark.long
def test_the_rests_of_three_sliders_are_all_but_where_they_lock():
    """The Orthoglide: 80 critical poses, their kinds sum up to nothing; at six places two rods stand square to their
    rails, side by side."""
    setup = ObservedRobot.of("orthoglide")
    found = cover(setup, setup.all_samples.start)
    assert found.is_complete
    assert [sum(each.falling == k for each in found.found) for k in range(4)] == [8, 32, 32, 8]
    assert unlisted(setup, found, np.random.default_rng(1), 12) == []
    error = PoseError.of(setup, setup.all_samples.start)
    assert len(found.locked) == 6
    limbs = [limb for limb in error.limbs if isinstance(limb, OnRail)]
    for middle, half in found.locked:
        tips = [
            error.p + error.shifts @ middle + limb.tip.constant + error.R @ limb.tip.turned - limb.centre
            for limb in limbs
        ]
        across = [tip - limb.axis * (limb.axis @ tip) for tip, limb in zip(tips, limbs, strict=True)]
        square = [i for i, limb in enumerate(limbs) if abs(np.linalg.norm(across[i]) - limb.rod) < 1e-3]
        assert len(square) == 2
        assert np.linalg.norm(np.cross(*(across[i] for i in square))) < 5e-3
        assert np.linalg.norm(half) < 2e-3


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("name", "at", "kinds"),
    [
        ("linear_delta", "x=0.061,y=-0.0337", [2, 14, 20, 8]),
        ("3puu", "x=0.02,y=-0.03", [2, 14, 18, 8]),
        ("delta", "x=0.061,y=-0.0337,z=-0.63", [9, 71, 77, 15]),
        ("delta", "x=0,y=0", [9, 62, 75, 16]),
        ("quattro_rigid", "x=-0.0652662,y=-0.031127,z=-0.534986", [22, 230, 244, 36]),
    ],
)
def test_rests_of_platforms_that_translate_are_listed(name, at, kinds):
    """On inclined slides, and on cranks: nothing is left open but the places that lock, and no other rest is met. Half
    an hour for four legs."""
    setup = ObservedRobot.of(name)
    goal = solve_configurations(setup, [parse_pose(at)])[0]
    found = cover(setup, goal, budget=70_000_000)
    assert found.is_complete
    assert found.bounded
    assert [sum(each.falling == k for each in found.found) for k in range(4)] == kinds
    assert unlisted(setup, found, np.random.default_rng(1), 12, goal) == []


@pytest.mark.slow
def test_rests_are_listed_however_far_away_they_are():
    """Of the 3-RPR, whose rods slide without end: at each of 28 poses the gradient by hand over (x, y, ψ) is small
    beside its parts; one is 274 lengths away. Each zero of it that least squares meets is a member."""
    setup, goal = scenes.setting("3rpr_m1"), scenes.goal("3rpr_m1")
    found = cover(setup, goal)
    assert found.is_complete
    assert found.bounded
    error = PoseError.of(setup, goal)
    hips = np.array([limb.centre[:2] for limb in error.limbs])
    arms = np.array([(error.R @ limb.tip.turned)[:2] for limb in error.limbs])
    offsets = np.array([limb.tip.constant[:2] for limb in error.limbs])
    aim = np.array([(error.p[:2] + offset + arm - hip) for offset, arm, hip in zip(offsets, arms, hips, strict=True)])
    wanted = np.arctan2(aim[:, 1], aim[:, 0])

    def pulled(pose):
        """E's gradient over (x, y, ψ) from the goal; and what its parts are of size."""
        x, y, turn = pose
        c, s = np.cos(turn), np.sin(turn)
        arm = arms @ np.array([[c, s], [-s, c]])
        r = error.p[:2] + [x, y] + offsets + arm - hips
        size = np.linalg.norm(r, axis=1)
        kappa = 0.5 * np.sin(2 * (np.arctan2(r[:, 1], r[:, 0]) - wanted))
        across = np.column_stack([-r[:, 1], r[:, 0]]) / size[:, None]
        along = np.column_stack([-arm[:, 1], arm[:, 0]])
        parts = np.column_stack([across, (across * along).sum(axis=1)]) * (kappa / size)[:, None]
        return parts.sum(axis=0), np.abs(parts).sum(axis=0) + 1e-12

    poses = np.unique(np.round([each.x[:3] for each in found.found], 6), axis=0)
    assert len(found.found) == 8 * len(poses) == 224
    assert np.linalg.norm(poses[:, :2], axis=1).max() > 200
    for each in found.found:
        g, size = pulled(each.x[:3])
        assert np.all(np.abs(g) < 1e-5 * size + 1e-12)
    rng, met = np.random.default_rng(0), set()
    for start in np.column_stack([rng.uniform(-4, 4, (60, 2)), rng.uniform(-np.pi, np.pi, 60)]):
        end = least_squares(lambda pose: pulled(pose)[0], start, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        if np.abs(pulled(end)[0]).max() < 1e-12 and np.abs(end[:2]).max() < 20:
            away = np.abs(poses - end)
            away[:, 2] = np.abs((away[:, 2] + np.pi) % (2 * np.pi) - np.pi)
            assert away.max(axis=1).min() < 1e-4
            met.add(int(away.max(axis=1).argmin()))
    assert len(met) > 10


@pytest.mark.slow
def test_a_saddle_near_a_limit_is_found():
    """The middle of this box of poses is out of the second leg's reach, one of its corners is a saddle (3prr_m1, the
    first leg in its other working mode)."""
    setup = ObservedRobot.of("3prr_m1")
    error = JointError.of(PoseError.of(setup, setup.all_samples.start))
    low, high = error.box(*reachable_box(error.error, 1.0)[:2], 1.0)
    middle, half = np.array([0.35488091, 0.31337551, -0.7187]), np.array([0.078, 0.052, 0.25])
    saddle = np.array([0.279589, 0.33178293, 2 * np.arctan(-0.45761711)])
    assert np.all(np.abs(saddle - middle) < half)
    low[:3], high[:3] = middle - half, middle + half
    part = Subdivision(error, low, high)
    part.run(100_000)
    assert not part.left
    assert min(np.linalg.norm(each.x[:3] - saddle) for each in part.zeros()) < 1e-6


def test_only_short_places_are_told_as_ones_that_lock(monkeypatch):
    """Boxes in which equations may be dependent, made up: small ones, one without an end, which is open by itself,
    and a chain through the whole."""
    setup = ObservedRobot.of("3rpr_m1")

    def made(part, *_):
        ways = [0.0] if part.error.far is None else [-0.1, 0.1] if part.error.far else [0.0]
        part.lost += [(np.full(len(part.whole), way), 1e-5 * part.whole) for way in ways]

    monkeypatch.setattr(Subdivision, "run", made)
    found = cover(setup, setup.all_samples.start)
    assert not found.is_complete
    assert len(found.locked) == 3
    assert all(np.isfinite(each).all() for place in found.locked for each in place)
    assert len(found.open) == 1

    def chain(part, *_):
        if part.error.far is None:
            part.lost += [(way * part.whole, 1e-2 * part.whole) for way in np.arange(-0.5, 0.5, 0.01)]

    monkeypatch.setattr(Subdivision, "run", chain)
    monkeypatch.setattr(Subdivision, "cut_lost", lambda *_: None)
    found = cover(setup, setup.all_samples.start)
    assert not found.is_complete
    assert (len(found.locked), len(found.open)) == (0, 1)


@pytest.mark.slow
def test_smallest_boxes_about_a_flat_zero_are_settled():
    """Two legs of this 3-PUU are nearly dependent at a rest: F hardly grows along one way from it. Each of the smallest
    boxes there is settled by the one zero nearby, which Newton's method on differences of E meets as well."""
    setup = ObservedRobot.of("3puu")
    error = PoseError.of(setup, setup.all_samples.start)
    low, high, _ = reachable_box(error, 1.0)
    part = Subdivision(JointError.of(error), *JointError.of(error).box(low, high, 1.0))
    at = np.array([[-0.551676, -0.515349, 0.087138, -1.183327, -1.023015, -1.190909]])
    x = np.concatenate([at, part._multipliers(at, 0 * at, np.array([[3, 4, 5]]))[0].v[0]], axis=1)
    x = part._approach(part._approach(part._approach(x)))
    way = np.linalg.svd(part._equations(x, forms_of(x, 0 * x))[1].v[0, 0])[2][-1, :6]
    middle = x[:, :6] + 4e-6 * np.linspace(-1, 1, 12)[:, None] * way / np.abs(way).max()
    half = np.broadcast_to(POSE_BOX_MIN_FRACTION * part.whole, middle.shape)
    assert part._near_zero(middle, half, np.broadcast_to([3, 4, 5], (12, 3))).all()
    assert 0 < len(part.flat) < 5
    assert len(part(middle, half)[0]) == 0
    (zero,) = {tuple(np.round(each.x, 5)) for each in part.zeros()}
    modes = [limb.mode for limb in error.limbs]
    met = [
        x
        for mode in product((-1.0, 1.0), repeat=3)
        for x in newton(error, [own * sign for own, sign in zip(modes, mode, strict=True)], np.array([zero[:3]]) + 1e-4)
    ]
    assert min(np.abs(x - zero[:3]).max() for x in met) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("p", "falling"), [((-0.129945, -1.045162, 3.455622), 2), ((-0.168081, -0.870224, -0.598767), 1)]
)
def test_a_rest_beside_a_place_that_locks_is_one_zero(p: tuple[float, ...], falling: int) -> None:
    """Three or five millimetres from a place at which two rods of a Quattro's plate are parallel, and both square to
    what their cranks do, K has a singular value of 1e-10, and the numbers of the file leave the pose open by 1e-6:
    boxes find one rest, and so does Newton's method on differences of E in 50 digits."""
    error = PoseError.of(scenes.setting("quattro"), scenes.goal("quattro"))
    joints = JointError.of(error)
    part = Subdivision(joints, *joints.box(*reachable_box(error, 1.0)[:2], 1.0))
    middle, half = (part.low + part.high) / 2, part.whole.copy()
    middle[:3], half[:3] = p, 4e-3
    part._run(middle[None], half[None], 100_000, 1, "")
    assert not part.left
    (zero,) = part.zeros()
    assert len(part.flat) == 1
    assert zero.falling == falling
    with mpmath.workdps(50):
        level = exact_level(error, zero.x)
        x = mpmath.matrix(zero.x[:4].tolist())
        for _ in range(4):
            slope, bend = differences(level, x)
            x -= mpmath.lu_solve(bend, slope)
        slope, bend = differences(level, x)
        assert mpmath.norm(slope) < 1e-20
        assert all(abs(x[i] - zero.x[i]) < zero.radius[i] for i in range(4))
        assert sum(value < 0 for value in mpmath.eigsy(bend, eigvals_only=True)) == falling
        assert zero.error[0] < mpmath.sqrt(2 * level(x)) < zero.error[1]


def exact_level(error, y):
    """E in many digits for cranks, as a function of the pose's coordinates, in the working modes of joints y."""
    legs = []
    for limb, angle, wanted in zip(error.limbs, y[error.size :], JointError.of(error).wanted, strict=True):
        one, two = (mpmath.matrix(each.tolist()) for each in (limb.joint.start, limb.joint.ahead))
        legs.append((limb, one, two, mpmath.matrix(np.asarray(wanted, dtype=float).tolist()), angle))

    def dot(a, b):
        return mpmath.fsum(v * w for v, w in zip(a, b, strict=True))

    def level(x):
        point, found = mpmath.matrix(error.p.tolist()), mpmath.mpf(0)
        for k, way in enumerate(error.shifts.T.tolist()):
            point += x[k] * mpmath.matrix(way)
        K = mpmath.matrix(hat(error.turns[:, 0]).tolist())
        turn = mpmath.eye(3) + mpmath.sin(x[3]) * K + (1 - mpmath.cos(x[3])) * K * K
        R = turn * mpmath.matrix(error.R.tolist())
        for limb, one, two, wanted, angle in legs:
            tip = R * mpmath.matrix(limb.tip.turned.tolist()) + mpmath.matrix(limb.tip.constant.tolist())
            way = point + tip - mpmath.matrix(limb.centre.tolist())
            a, b = dot(way, one), dot(way, two)
            half = mpmath.acos((dot(way, way) + limb.radius**2 - limb.rod**2) / (2 * limb.radius * mpmath.hypot(a, b)))
            middle = mpmath.atan2(b, a)
            at = middle + half if mpmath.sin(angle - middle) > 0 else middle - half
            u = (way - limb.radius * (mpmath.cos(at) * one + mpmath.sin(at) * two)) / limb.rod
            found += (1 - dot(u, wanted) ** 2) / 2
        return found

    return level


def differences(level, x):
    """First and second differences of a function in many digits."""
    step, n = mpmath.mpf(10) ** -15, len(x)
    ways = [mpmath.matrix([step * (i == j) for j in range(n)]) for i in range(n)]
    slope = mpmath.matrix([(level(x + way) - level(x - way)) / (2 * step) for way in ways])
    bend = mpmath.matrix(n, n)
    for i, one in enumerate(ways):
        for j, two in enumerate(ways[: i + 1]):
            bend[i, j] = bend[j, i] = (
                level(x + one + two) - level(x + one - two) - level(x - one + two) + level(x - one - two)
            ) / (4 * step**2)
    return slope, bend


@pytest.mark.parametrize(
    ("turn", "inside"), [(0.0, True), (2 * np.pi, True), (-2 * np.pi + 0.005, True), (0.1, False), (np.pi, False)]
)
def test_a_place_that_locks_is_at_a_turn(turn: float, inside: bool) -> None:
    """Only at its turn, whatever number of whole turns it is told with, a place excepts what is listed there."""
    error, goal = PoseError.of(scenes.setting("quattro"), scenes.goal("quattro")), scenes.goal("quattro")
    told = SubdivisionResult(
        (), (), 0.0, 0, True, error=error, locked=((np.array([0.0, 0.0, 0.0, turn]), np.full(4, 0.01)),)
    )
    assert told.has_searched(goal) is not inside


@pytest.mark.slow
def test_boxes_that_fill_a_long_place_are_cut_finer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where two rods of a Quattro's plate are parallel the moment about their tip nearly vanishes over some degrees of
    its turn: boxes of a ten thousandth of the whole are too coarse to tell where, if places are to be this short."""
    shortest = 0.8 * LOCKED_PLACE_EDGE_FRACTION
    monkeypatch.setattr("hrsynth.simulation.equilibria.exhaustive_search.LOCKED_PLACE_EDGE_FRACTION", shortest)
    error = PoseError.of(scenes.setting("quattro"), scenes.goal("quattro"))
    joints, (low, high, _) = JointError.of(error), reachable_box(error, 1.0)
    part = Subdivision(joints, *joints.box(low, high, 1.0))
    middle, half = (part.low + part.high) / 2, part.whole.copy()
    middle[:3], half[:3] = (-0.0674, -0.9928, 3.4557), 0.012
    part._run(middle[None], half[None], 200_000, 1, "")
    size = (high - low)[:4]

    def longest() -> float:
        return max(
            float(((b - a) / size).max()) for a, b in join_boxes((m[:4] - h[:4], m[:4] + h[:4]) for m, h in part.lost)
        )

    assert part.lost
    assert not part.left
    assert longest() > shortest
    _cut_long([part], size, 500_000, 1)
    assert part.lost
    assert not part.left
    assert longest() < shortest / 2


@pytest.mark.slow
def test_nothing_depends_on_the_number_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts are dealt out as soon as there are some, and each goes on for a little: the boxes are the same, and so is
    what they hold."""
    setup = ObservedRobot.of("rrrrr_m1")
    alone = cover(setup, setup.all_samples.start)
    monkeypatch.setattr("hrsynth.solving.exhaust.SERIAL_BOXES_COUNT", 300)
    monkeypatch.setattr("hrsynth.solving.exhaust.BOXES_A_PART", 100)
    for jobs in (1, 2):
        shared = cover(setup, setup.all_samples.start, jobs=jobs)
        assert shared.is_complete
        assert shared.boxes == alone.boxes
        assert len(shared.found) == len(alone.found) == 30
        places = np.array([each.x for each in shared.found])
        assert all(np.abs(places - each.x).max(axis=1).min() < 1e-9 for each in alone.found)
    few = cover(setup, setup.all_samples.start, jobs=2, budget=2000)
    assert few.spent
    assert not few.is_complete
    assert few.boxes == 2000


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_small_open_boxes_belong_to_the_place_that_they_touch(seed):
    """A chain of small boxes that begins at a place is of it, while that is no longer than a place may be; what stands
    apart, or is larger, stays open."""
    rng = np.random.default_rng(seed)
    whole, steps = np.ones(3), int(rng.integers(1, 400))
    way = rng.normal(size=3)
    way /= np.abs(way).max()
    chain = [(x - 2e-5, x + 2e-5) for x in (k * 5e-5 * way for k in range(1, steps))]
    apart, large = (np.full(3, 0.5), np.full(3, 0.50001)), (np.full(3, -1e-3), np.full(3, 0.0))
    place, order = (np.full(3, -2e-5), np.full(3, 2e-5)), rng.permutation(len(chain) + 2)
    left = [[*chain, apart, large][i] for i in order]
    locked, others = _places([place], left, whole)
    if 5e-5 * (steps - 1) + 4e-5 <= LOCKED_PLACE_EDGE_FRACTION:
        ((middle, half),) = locked
        assert all(np.all(np.abs(each - middle) <= half + 1e-15) for corners in [place, *chain] for each in corners)
        assert len(others) == 2
        assert all(any(one is each for each in others) for one in (apart, large))
    else:
        assert locked == []
        assert len(others) == len(left) + 1


def test_the_goal_is_listed_as_a_minimum():
    setup = ObservedRobot.of("prrrp_m1")
    goal = setup.configurations[0]
    found = cover(setup, goal, vanishing=True)
    own = [each for each in found.found if np.linalg.norm(each.x[:2]) < 1e-5]
    assert [each.falling for each in own] == [0]
    assert own[0].error[0] == 0.0
    assert own[0].radius.max() < 1e-6


def test_what_is_not_covered_says_why():
    setup = ObservedRobot.of("gough_stewart")
    found = cover(setup, setup.all_samples.start)
    assert not found.is_complete
    assert "more than one axis" in found.reason


def test_progress_claims_no_more_than_is_settled(monkeypatch: pytest.MonkeyPatch):
    """Each round settles one of two halves: the space left is halved, and the boxes that were looked at are counted."""

    class Halved(Subdivision):
        def __call__(self, middle: Array, half: Array) -> tuple[Array, Array, Places]:
            return middle[-1:], half[-1:], np.zeros(1, dtype=np.intp)

    told: list[str] = []
    monkeypatch.setattr("hrsynth.solving.exhaust.report", told.append)
    Halved(None, -np.ones(2), np.ones(2)).run(12, 1, 3)  # type: ignore[arg-type]
    assert told[:3] == [
        "boxes of search 2 of 3: 0 % of the space settled, 0 processed of at most 12, 1 waiting",
        "boxes of search 2 of 3: 0 % of the space settled, 1 processed of at most 12, 2 waiting",
        "boxes of search 2 of 3: 50 % of the space settled, 3 processed of at most 12, 2 waiting",
    ]
    settled = 100 * (1 - 0.5 ** (len(told) - 2))
    assert told[-1].startswith(f"boxes of search 2 of 3: {int(settled)} % of the space settled")
