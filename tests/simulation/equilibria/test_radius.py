"""The certified radius: the enclosures hold what they enclose, and runs from all over it end at the goal, integrated
with directions and rates of the batch engine, which reads the legs in another way."""

from dataclasses import replace

import numpy as np
import pytest

from hrsynth import load
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.equations.box_formula import trace_formula
from hrsynth.geometry.affine import make_affine
from hrsynth.geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism.model import Limits
from hrsynth.mechanism.pose import Pose
from hrsynth.simulation.equilibria.attraction_radius import CERTIFIED, UNDECIDED, prove_attraction_radius
from hrsynth.simulation.equilibria.cones import ConeProver
from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch
from hrsynth.simulation.equilibria.inward_flow import InwardProver, inward_radius
from hrsynth.simulation.equilibria.pose_error import PoseError
from hrsynth.simulation.law import FixedDirections, damped_inverses
from hrsynth.simulation.run import Loop
from hrsynth.solving.exhaust import SETTLED
from strategies import random_rotation, transformed


@pytest.mark.slow
def test_the_point_is_told_where_poses_tell_another():
    """A rod of a five-bar is the platform, its frame at the elbow: that stays where the crank does, however far the rod
    turns, so that the radius cannot be one of the elbow."""
    setup = ObservedRobot.of(load("rrrrr_m1", platform="dist_2"))
    start, link = setup.all_samples.start, setup.motion.link
    found = prove_attraction_radius(setup, start)
    goal = start.pose(link)
    assert found.verdict == CERTIFIED
    turned = goal.copy()
    turned[:3, :3] = convert_vectors_to_rotations(np.array([0.0, 0.0, 1.0])) @ goal[:3, :3]
    assert not found.has_start(turned)
    for words in (found.words, found.undamped_words):
        assert words is None or words.endswith("measured at the point (-0.169 0.107 0) m of dist_2")
    assert "measured" not in prove_attraction_radius(ObservedRobot.of(load("3rrr_m1")), start_of("3rrr_m1")).words


def start_of(name):
    return ObservedRobot.of(load(name)).all_samples.start


def starts(found, rng, count):
    """Platform poses (count, 4, 4) of a region, half of them on its boundary."""
    motion, X = found.motion, found.goal.pose(found.motion.link)
    p = X[:3, :3] @ motion.point + X[:3, 3]

    def ball(basis, radius):
        v = rng.normal(size=(count, basis.shape[1]))
        size = np.where(rng.uniform(size=(count, 1)) < 0.5, 1.0, rng.uniform(size=(count, 1)) ** (1 / v.shape[1]))
        return (v / np.linalg.norm(v, axis=1, keepdims=True) * size * radius) @ basis.T

    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = X[:3, :3]
    if found.angle is not None:
        poses[:, :3, :3] = convert_vectors_to_rotations(ball(motion.rotations, found.angle)) @ X[:3, :3]
    poses[:, :3, 3] = p + ball(motion.translations, found.length) - poses[:, :3, :3] @ motion.point
    return poses


def ends(setup, found, poses, steps=120, step=0.25):
    """How far from the goal's pose runs of the damped law end (metres and radians together), by the midpoint rule."""
    batch, motion, goal = setup.batch, found.motion, found.goal.pose(found.motion.link)
    legs = list(setup.labels)
    wanted = batch.evaluate(goal[None], legs).directions

    def rate(X):
        at = batch.evaluate(X, legs, compiled=False)
        u, M = at.directions, at.interaction_matrix.reshape(len(X), len(legs), 3, -1)
        rows = np.cross(M, wanted[..., None], axis=2).reshape(len(X), 3 * len(legs), -1)
        left, values, right = np.linalg.svd(np.nan_to_num(rows), full_matrices=False)
        e = np.nan_to_num(np.cross(u, wanted)).reshape(len(X), -1)
        shares = np.einsum("nij,ni->nj", left, e) * np.array([damped_inverses(v) for v in values])
        return -np.einsum("ij,nkj,nk->ni", at.twists, right, shares)

    def moved(X, v, h):
        new = X.copy()
        p = X[:, :3, :3] @ motion.point + X[:, :3, 3]
        new[:, :3, :3] = convert_vectors_to_rotations(h * v[:, 3:]) @ X[:, :3, :3]
        new[:, :3, 3] = p + h * v[:, :3] - new[:, :3, :3] @ motion.point
        return new

    X = poses
    for _ in range(steps):
        X = moved(X, rate(moved(X, rate(X), step / 2)), step)
    turn = np.linalg.norm(convert_rotations_to_vectors(X[:, :3, :3] @ goal[:3, :3].T), axis=1)
    return np.linalg.norm(X[:, :3, 3] - goal[:3, 3], axis=1) + turn


def certified(setup, at=None):
    found = prove_attraction_radius(setup, setup.all_samples.start if at is None else at)
    assert found.verdict == CERTIFIED, found.words
    return found


@pytest.mark.parametrize(("name", "legs"), [("quattro", "1,4"), ("3rpr_m1", None), ("delta", None)])
def test_enclosures_hold_the_error_and_its_rates(name, legs):
    setup = ObservedRobot.of(name, legs)
    error = PoseError.of(setup, setup.configurations[0])
    n, rng = error.size, np.random.default_rng(0)
    W = rng.normal(size=(n, n)) / 4
    prover = ConeProver.of(error, W)
    middle, half = rng.uniform(-0.8, 0.8, (40, n)), rng.uniform(0, 0.2, (40, n))
    face = rng.integers(n, size=40)
    middle[range(40), face], half[range(40), face] = 1.0, 0.0
    low = rng.uniform(0.05, 0.2, 40)
    high = low * rng.uniform(1.0, 1.3, 40)
    bounds = prover.slices(middle, half, low, high)
    assert bounds.reached.sum() > 20
    for _ in range(20):
        w, t = middle + half * rng.uniform(-1, 1, (40, n)), rng.uniform(low, high)
        x = t[:, None] * (w @ W.T)
        e, rates = error.numbers(x, np.eye(n))
        E, slope = np.sum(e * e, axis=1) / 2, np.einsum("nr,nrj,nj->n", e, rates, w @ W.T)
        kept = bounds.reached
        assert np.all(bounds.low[kept] <= E[kept] * (1 + 1e-9))
        assert np.all(E[kept] <= bounds.high[kept] * (1 + 1e-9))
        assert np.all(bounds.rise[kept] <= slope[kept] / t[kept] + 1e-9)


@pytest.mark.parametrize(("name", "legs"), [("quattro", "1,4"), ("3rpr_m1", None), ("delta", None)])
def test_boxes_that_lead_inwards_do_so_at_all_their_poses(name, legs):
    setup = ObservedRobot.of(name, legs)
    error = PoseError.of(setup, setup.all_samples.start)
    n, rng = error.size, np.random.default_rng(0)
    middle, half = rng.normal(size=(300, n)) / 5, rng.uniform(0, 0.02, (300, n))
    proved = InwardProver.of(error).inwards(middle, half) == SETTLED
    assert 10 < proved.sum() < 300
    for _ in range(20):
        x = (middle + half * rng.uniform(-1, 1, (300, n)))[proved]
        for pose, miss, rows in zip(x, *error.numbers(x, np.eye(n)), strict=True):
            assert pose @ np.linalg.lstsq(rows, miss)[0] > 0


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    ("name", "legs", "least"),
    [("quattro", "1,4", 0.017), ("delta", None, 0.11), ("3rrr_m1", None, 0.010), ("gough_stewart", None, 0.0033)],
)
def test_the_law_without_damping_leads_inwards(name, legs, least):
    """From all over the ball runs end at the goal, on whose way nothing is damped."""
    setup = ObservedRobot.of(name, legs)
    found = certified(setup)
    reach = found.goal.model.length * found.undamped
    assert reach > max(least, found.length)
    assert found.undamped_words is not None
    wide = replace(found, length=reach, angle=None if found.angle is None else found.undamped)
    assert np.all(ends(setup, wide, starts(wide, np.random.default_rng(4), 200)) < 1e-6)


@pytest.mark.slow
def test_a_ball_ends_before_the_law_leads_away():
    """The first pose along many rays at which it does is a little beyond the ball that is proved."""
    setup = ObservedRobot.of("rrrrr_m1")
    error = PoseError.of(setup, setup.all_samples.start)
    radius = inward_radius(error)
    turn = np.linspace(0, 2 * np.pi, 400)
    rays = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    first = np.inf
    for t in np.linspace(0.01, 1, 200):
        e, J = error.numbers(t * rays, np.eye(2))
        if not error.levels(t * rays)[0].all() or np.any(np.einsum("ni,nij,nj->n", rays, np.linalg.pinv(J), e) <= 0):
            first = t
            break
    assert 0.7 * first < radius < first


def test_roots_and_inverses_of_forms_hold_those_of_numbers():
    rng = np.random.default_rng(1)
    formula = trace_formula(lambda x, number: [1.0 / (x[0] * number(0.3) - x[1]), (x[0] * x[1]).sqrt()], 2)
    middle, half = rng.uniform(0.3, 2, (500, 2)), rng.uniform(0, 0.3, (500, 2))
    found = formula.at([make_affine(middle[:, i], half[:, i, None] * np.eye(2)[i], np.zeros(500)) for i in range(2)])
    for _ in range(50):
        x = middle + half * rng.uniform(-1, 1, (500, 2))
        for form, value in zip(found, (1 / (0.3 * x[:, 0] - x[:, 1]), np.sqrt(x[:, 0] * x[:, 1])), strict=True):
            known = np.isfinite(form.r)
            assert known.sum() > 300
            assert np.all((form.low <= value + 1e-12)[known] & (value <= form.high + 1e-12)[known])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "led"),
    [
        ("3rpr_m1", True),
        pytest.param("rrrrr_m1", False, marks=pytest.mark.long),
        pytest.param("3rrr_m1", True, marks=pytest.mark.long),
    ],
)
def test_all_starts_within_it_end_at_the_goal(name, led):
    """Also where the base is tilted; of the five-bar, whose pose has parts that depend on each other, it is proved."""
    rng = np.random.default_rng(2)
    setup = ObservedRobot.of(transformed(load(name), random_rotation(rng), rng.normal(size=3)))
    found = certified(setup)
    assert found.length > 0.01 * setup.mechanism.length
    if led:
        assert np.all(ends(setup, found, starts(found, rng, 200)) < 1e-6)


@pytest.mark.slow
def test_a_start_in_another_working_mode_may_end_elsewhere():
    """A five-bar at the goal's pose whose legs are both bent the other way: the words are about one working mode."""
    setup = ObservedRobot.of("rrrrr_m1")
    goal, motion = setup.all_samples.start, setup.motion
    found = certified(setup)
    assert found.words.endswith("of the goal in its working mode")
    place, rng, apart = motion.position(goal.pose(motion.link)), np.random.default_rng(0), []
    there = motion.goal(Pose(x=float(place[0]), y=float(place[1])), "five-bar")
    while not apart:
        q, residual = solve(goal.model, goal.model.integrate(goal.q, rng.uniform(-3, 3, goal.model.nv)), there)
        at = ClosedConfiguration.of(goal.model, q)
        if residual < 1e-9 and np.abs(at.pose(motion.link) - goal.pose(motion.link)).max() > 0.1:
            apart.append(at)
    assert found.has_start(apart[0].pose(motion.link))
    search = EquilibriumSearch.of(setup, goal)
    run = Loop(
        replace(search.law, gain=0.8), setup.all_samples.observation_model, FixedDirections(search.desired)
    ).simulate(apart[0], 60.0)
    assert np.linalg.norm(motion.position(run.last.pose(motion.link)) - place) > 2 * found.length


def test_a_goal_that_the_directions_do_not_see_is_undecided():
    setup = ObservedRobot.of("quattro", "1")
    found = prove_attraction_radius(setup, setup.all_samples.start)
    assert found.verdict == UNDECIDED
    assert "do not determine" in found.words


def test_where_joints_have_limits_nothing_is_certified():
    """A run stops at a limit, however near to the goal it starts."""
    robot = load("rrrrr_m1")
    joint = replace(robot.joints["shoulder_1"], limits=Limits(-0.05, 0.05))
    setup = ObservedRobot.of(replace(robot, joints={**robot.joints, "shoulder_1": joint}))
    found = prove_attraction_radius(setup, setup.all_samples.start)
    assert found.verdict == UNDECIDED
    assert found.words.endswith("joint limit: shoulder_1")


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "legs", "least"),
    [
        ("quattro", "1,4", 4.5e-3),
        ("quattro", "2,3", 4.5e-3),
        ("quattro", None, 7.9e-3),
        ("quattro_rigid", None, 15e-3),
        ("3rpr_m1", None, 31e-3),
        ("delta", None, 38e-3),
        ("3upu", None, 98e-3),
    ],
)
def test_ten_thousand_starts_end_at_the_goal(name, legs, least):
    setup = ObservedRobot.of(name, legs)
    found = certified(setup)
    assert found.length > least
    poses = starts(found, np.random.default_rng(3), 10_000)
    assert np.max(ends(setup, found, poses)) < 1e-6
