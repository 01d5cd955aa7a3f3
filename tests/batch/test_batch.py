"""A batch says at every pose what Pinocchio's relation says there: for all shipped robots and for random ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from time import process_time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity_indices import compute_interaction_matrix
from hrsynth.batch.engine import Batch, Evaluation
from hrsynth.batch.iterative_leg import IterativeLeg
from hrsynth.batch.leg_wrenches import compute_free_twists
from hrsynth.description import load
from hrsynth.errors import BadRequest, HrsynthError, MissingExtra
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism.observations.direction import Direction
from kinematics.robots import ROBOTS
from strategies import parallel_robots

CLOSE = 1e-9
POSES = 8
BOUND = 1e-4
"""How far the upper bounds of the two engines may be apart where three cones leave a gap (relative)."""
SOLVED = {"3rps", "prrrp_m1", "prrrp_m2", "prrrp_parallel", "rprpr_m1", "rprpr_m2", "rrrrr_m1", "rrrrr_m2"}
"""Robots whose platform has other freedoms at each pose: what their legs forbid, in closed form, says which."""


@cache
def shipped_batch(robot: str) -> tuple[ObservedRobot, Batch]:
    setup = ObservedRobot.of(load(robot), samples=4)
    assert setup.batch is not None
    return setup, setup.batch


def poses_near(batch: Batch, count: int, size: float = 0.2, seed: int = 0) -> Array:
    """Poses of the platform's own freedoms around its home."""
    from hrsynth.geometry.so3 import convert_vectors_to_rotations

    rng = np.random.default_rng(seed)
    coordinates = batch.coordinates
    X = np.tile(batch.home, (count, 1, 1))
    spins = rng.uniform(-size, size, (count, coordinates.rotations.shape[1])) @ coordinates.rotations.T
    shifts = rng.uniform(-size, size, (count, coordinates.translations.shape[1])) @ coordinates.translations.T
    X[:, :3, 3] += batch.length * shifts
    X[:, :3, :3] = convert_vectors_to_rotations(spins) @ X[:, :3, :3]
    return X


def check_law(setup: ObservedRobot, legs: Sequence[str], count: int, seed: int = 3) -> int:
    """Directions, Mᵀ and singular values are Pinocchio's where the working mode is that of the zero configuration; at
    how many poses."""
    batch = setup.batch
    assert batch is not None
    all_samples = setup.all_samples
    watched = tuple(
        o
        for o in all_samples.observation_model.observations[: setup.defaults]
        if isinstance(o, Direction) and o.leg in legs
    )
    observation_model = replace(all_samples.observation_model, observations=watched)
    walk = list(walk_randomly(all_samples.start, count, seed=seed, steps=4))
    found = batch.evaluate([at.pose(observation_model.platform) for at in walk], [o.leg for o in watched])
    compared = 0
    for i, at in enumerate(walk):
        u = np.array([at.pose(o.link)[:3, :3] @ o.direction for o in watched])
        if not found.reached[i] or np.max(np.abs(u - found.directions[i])) > 1e-3:
            continue
        theirs = compute_relation(at, observation_model)
        M = compute_interaction_matrix(theirs)
        if M is None:
            continue
        scale = float(np.linalg.norm(M, 2)) if M.any() else 1.0
        assert np.max(np.abs(u - found.directions[i])) < CLOSE
        twists = found.twists if found.twists.ndim == 2 else found.twists[i]
        twists = twists / np.repeat([batch.length, 1.0], 3)[:, None]
        change = theirs.twists.T @ twists[: theirs.twist_rows]
        assert np.max(np.abs(change.T @ change - np.eye(len(change)))) < CLOSE
        assert np.max(np.abs(M @ change - found.interaction_matrix[i])) < CLOSE * scale
        values = np.linalg.svd(M, compute_uv=False)
        assert np.max(np.abs(values - found.singular_values[i])) < CLOSE * scale
        compared += 1
    return compared


@pytest.mark.some(5)
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_batch_is_the_relation_at_every_pose(robot: str) -> None:
    setup, batch = shipped_batch(robot)
    known = batch.known
    assert batch.is_complete or robot == "i4l"
    assert batch.coordinates.has_constant_twists == (robot not in SOLVED) == (not batch.holds)
    assert not batch.iterative
    assert check_law(setup, known, POSES) >= POSES // 2
    assert check_law(setup, known[-2:], 3) >= 1


@pytest.mark.parametrize("robot", sorted(SOLVED))
def test_what_legs_forbid_in_closed_form_is_what_their_joints_forbid(robot: str) -> None:
    """The twists of the closed forms are those of the legs' own links, closed by Newton's method, at other poses."""
    setup, batch = shipped_batch(robot)
    mechanism, decomposition = setup.mechanism, setup.decomposition
    seen = dict(zip(decomposition.labels, setup.segments, strict=True))
    X = np.array([at.pose(mechanism.platform) for at in walk_randomly(setup.all_samples.start, 12, seed=5, steps=4)])
    chains = [IterativeLeg.of(mechanism, leg, seen[leg.label], None) for leg in decomposition.legs]  # type: ignore[arg-type]
    rows = np.concatenate(
        [each.follow_from_zero(batch.coordinates, batch.home, X, batch.span).wrenches() for each in chains], axis=1
    )
    basis = np.linalg.pinv(batch.span) @ batch.evaluate(X).twists
    assert np.max(np.abs(basis.swapaxes(1, 2) @ basis - np.eye(batch.coordinates.dof))) < 1e-12
    assert np.max(np.abs(rows @ basis)) < CLOSE
    assert np.linalg.matrix_rank(rows[0], 1e-6) == batch.span.shape[1] - batch.coordinates.dof


def test_freedoms_are_normal_to_all_rows_and_never_turn_over() -> None:
    """Of random rows, and of one that goes once round: the sense of rows and freedoms together stays."""
    rng = np.random.default_rng(1)
    for k, D in ((1, 3), (2, 3), (3, 6), (5, 6)):
        rows = rng.normal(size=(k, D, 50))
        basis, least = compute_free_twists(rows)
        whole = np.concatenate([rows, basis.swapaxes(0, 1)]).transpose(2, 0, 1)
        assert np.max(np.abs(np.einsum("kdn,din->kin", rows, basis))) < 1e-12
        assert np.max(np.abs(np.einsum("din,djn->nij", basis, basis) - np.eye(D - k))) < 1e-12
        assert len(set(np.sign(np.linalg.det(whole)))) == 1
        values = np.linalg.svd(rows.transpose(2, 0, 1), compute_uv=False)
        assert np.all(values[:, -1] <= least * (1 + 1e-12))
    angle = np.linspace(0.0, 2 * np.pi, 721)
    basis, _ = compute_free_twists(np.array([[np.cos(angle), np.sin(angle), 0.3 + 0 * angle]]))
    sense = np.einsum("in,in->n", np.cross(basis[:, 0].T, basis[:, 1].T).T, [np.cos(angle), np.sin(angle), 0 * angle])
    assert np.all(sense > 0) or np.all(sense < 0)
    assert compute_free_twists(np.zeros((1, 3, 2)))[1] == pytest.approx([0.0, 0.0], abs=1e-100)


@pytest.mark.parametrize("robot", ["3rps", "rrrrr_m1"])
def test_other_twists_at_each_pose_cost_no_more_than_three_times_a_constant_platform(robot: str) -> None:
    """Poses a second beside those of a platform on six legs, in turns, the best of three."""

    def seconds(batch: Batch) -> float:
        X = np.repeat(batch.home[None], 20_000, axis=0)
        start = process_time()
        batch.evaluate(X, compiled=False)
        return process_time() - start

    one, six = (shipped_batch(name)[1] for name in (robot, "gough_stewart"))
    both = [(seconds(one), seconds(six)) for _ in range(4)][1:]
    assert min(ours for ours, _ in both) < 3 * min(theirs for _, theirs in both)


@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(parallel_robots())
def test_a_batch_of_a_random_robot_is_its_relation(mechanism) -> None:
    try:
        setup = ObservedRobot.of(mechanism, samples=3)
    except HrsynthError:
        return
    batch = setup.batch
    assert batch is not None
    known = batch.known
    if known:
        check_law(setup, known, 4)


@pytest.mark.some(1, 2)
@pytest.mark.parametrize("watched", [2, 3])
@pytest.mark.parametrize("robot", ["3prp", "quattro", "gough_stewart", "orthoglide", "3rrr_m1", "3puu", "hexa"])
def test_numba_gives_the_same_numbers(robot: str, watched: int) -> None:
    pytest.importorskip("numba")
    _, batch = shipped_batch(robot)
    legs = list(batch.legs)[:watched]
    X = poses_near(batch, 200, 0.6)
    plain, quick = (batch.evaluate(X, legs, 0.01, compiled=compiled) for compiled in (False, True))
    assert np.array_equal(plain.reached, quick.reached)
    assert plain.reached.any()
    here = plain.reached
    assert np.max(np.abs(plain.directions - quick.directions)[here]) < 1e-12
    M = plain.interaction_matrix
    assert np.max(np.abs(M - quick.interaction_matrix)[here]) < 1e-12 * np.max(np.abs(M[here]))
    for one, two in ((plain.position, quick.position), (plain.orientation, quick.orientation)):
        assert one is not None
        assert two is not None
        for ours, theirs in ((one.largest, two.largest), (one.lower, two.lower)):
            ill = plain.singular_values[:, 0] / np.maximum(plain.singular_values[:, -1], 1e-300)
            finite = here & np.isfinite(ours)
            assert np.array_equal(np.isfinite(ours), np.isfinite(theirs))
            proved = one.lower >= one.largest * (1 - 1e-9)
            allowed = np.where(proved, 1e-12 * np.maximum(ill, 1.0), BOUND) * ours
            assert np.all(np.abs(ours[finite] - theirs[finite]) <= allowed[finite])


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("compiled", "robot"),
    [
        *product([False], ["delta", "gough_stewart", "3rrr_m1", "rrrrr_m1"]),
        *(pytest.param(True, robot, marks=pytest.mark.slow) for robot in ("delta", "gough_stewart", "3rrr_m1")),
    ],
)
def test_a_pose_that_is_not_finite_is_not_reached(robot: str, compiled: bool) -> None:
    if compiled:
        pytest.importorskip("numba")
    _, batch = shipped_batch(robot)
    X = np.repeat(batch.home[None], 26, axis=0)
    for i, (bad, row, column) in enumerate(product([np.nan, np.inf], range(3), range(4))):
        X[i, row, column] = bad
    found = batch.evaluate(X, cones=0.01, compiled=compiled)
    assert found.position is not None
    assert found.reached.tolist() == 24 * [False] + 2 * [True]
    for values in (found.directions, found.interaction_matrix, found.position.largest):
        assert np.isnan(values[:24]).all()
        assert np.isfinite(values[24:]).all()


@pytest.mark.parametrize(
    ("legs", "cones", "word"),
    [
        ("1,4", [0.1, 0.1, 0.1], "number of half-angles"),
        ("1,4", -1.0, "more than 0"),
        ("1,4", 0.0, "more than 0"),
        ("1,4", np.pi / 2, "less than pi/2"),
        ("1,4", np.nan, "less than pi/2"),
        ("1,4", [0.1, np.inf], "less than pi/2"),
        (["1", "1"], 0.1, "twice"),
        ("14", 0.1, "unknown leg of the batch"),
        ([], 0.1, "nothing is observed"),
    ],
)
def test_legs_and_cones_that_are_none_are_refused(legs: str | list[str], cones: float | list[float], word: str) -> None:
    _, batch = shipped_batch("quattro")
    with pytest.raises(BadRequest, match=word):
        batch.evaluate(batch.home[None], legs, cones)


def test_threads_change_no_digit(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    _, batch = shipped_batch("quattro")
    X = poses_near(batch, 10_000, 0.6)
    found = []
    for count in (1, 3):
        monkeypatch.setattr("hrsynth.batch.program.count_threads", lambda count=count: count)
        found.append(batch.evaluate(X, ["1", "4"], 0.01, compiled=True))
    one, several = found
    assert one.position is not None
    assert several.position is not None
    assert 0 < one.reached.sum() < len(X)
    assert np.array_equal(one.interaction_matrix, several.interaction_matrix, equal_nan=True)
    assert np.array_equal(one.position.largest, several.position.largest, equal_nan=True)


def sampled_error(M: Array, rows: Array, u: Array, cone: float, rng: np.random.Generator) -> float:
    """The largest error over random admissible errors of the directions, by definition."""
    J = rows @ np.linalg.pinv(M)
    errors = rng.normal(size=(4000, *u.shape))
    errors -= np.sum(errors * u, axis=2, keepdims=True) * u
    errors *= cone / np.linalg.norm(errors, axis=2, keepdims=True)
    return float(np.max(np.linalg.norm(errors.reshape(len(errors), -1) @ J.T, axis=1)))


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"),
    [
        ("quattro", ("1", "4")),
        ("orthoglide", ("1", "2", "3")),
        ("gough_stewart", ("1", "2", "3")),
        ("3rrr_m1", ("1", "2", "3")),
        ("quattro_rigid", ("1", "3")),
    ],
)
def test_error_maxima_bound_all_admissible_errors_and_are_nearly_met(robot: str, legs: tuple[str, ...]) -> None:
    _, batch = shipped_batch(robot)
    found = batch.evaluate(poses_near(batch, 12), legs, 0.01)
    rng = np.random.default_rng(1)
    assert found.position is not None
    assert found.orientation is not None
    for i in np.flatnonzero(found.reached):
        for spread, rows in ((found.position, found.twists[:3]), (found.orientation, found.twists[3:])):
            met = sampled_error(found.interaction_matrix[i], rows, found.directions[i], 0.01, rng)
            assert met <= spread.largest[i] * (1 + 1e-9)
            assert met >= 0.7 * spread.lower[i]
            assert spread.lower[i] <= spread.largest[i]
            if len(legs) == 2:
                assert spread.lower[i] == spread.largest[i]


def test_a_lost_freedom_has_an_infinite_error_and_the_others_a_finite_one() -> None:
    _, parallel = shipped_batch("uranesx")
    found = parallel.evaluate(poses_near(parallel, 5), cones=0.01)
    assert found.position is not None
    assert found.orientation is not None
    assert np.all(np.isinf(found.position.largest))
    assert np.all(found.orientation.largest == 0)
    _, planar = shipped_batch("3prp")
    found = planar.evaluate(poses_near(planar, 5), cones=0.01)
    assert found.position is not None
    assert found.orientation is not None
    assert np.all(np.isinf(found.position.largest))
    assert found.orientation.largest == pytest.approx(np.full(5, 0.01), rel=1e-9)


@pytest.mark.parametrize("robot", ["3rpr_m1", "3rrr_m1", "3rps", "rrrrr_m1"])
def test_the_determinant_has_the_size_of_the_singular_values_and_one_sign_around_home(robot: str) -> None:
    _, batch = shipped_batch(robot)
    X = poses_near(batch, 6, 0.02) if batch.coordinates.has_constant_twists else np.repeat(batch.home[None], 3, axis=0)
    found = batch.evaluate(X)
    assert found.determinant is not None
    assert found.reached.all()
    volume = found.singular_values.prod(axis=1)
    assert np.abs(found.determinant) == pytest.approx(volume, rel=1e-9)
    assert len(set(np.sign(found.determinant))) == 1


def test_the_determinant_changes_its_sign_where_a_singular_value_vanishes() -> None:
    _, batch = shipped_batch("3rpr_m1")
    X = np.tile(batch.home, (400, 1, 1))
    from hrsynth.geometry.so3 import convert_vectors_to_rotations

    X[:, :3, :3] = (
        convert_vectors_to_rotations(np.linspace(0, np.pi, 400)[:, None] * batch.coordinates.rotations[:, 0])
        @ X[:, :3, :3]
    )
    found = batch.evaluate(X)
    assert found.determinant is not None
    flips = np.flatnonzero(np.diff(np.sign(found.determinant)))
    assert len(flips) >= 1
    smallest = found.singular_values[:, -1]
    for flip in flips:
        assert smallest[flip : flip + 2].min() < 0.02 * smallest[0]


def test_parts_of_a_sweep_are_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    _, batch = shipped_batch("quattro")
    X = poses_near(batch, 40, 0.5)
    whole = batch.evaluate(X, cones=0.01)
    monkeypatch.setattr("hrsynth.batch.program.POSE_CHUNK_COUNT", 7)
    check_same(whole, batch.evaluate(X, cones=0.01))
    for i, part in enumerate(batch.sweep((X[:15], X[15:]), cones=0.01)):
        rows = whole.interaction_matrix[15 * i : 15 if i == 0 else 40]
        assert np.array_equal(part.interaction_matrix, rows, equal_nan=True)


def check_same(one: Evaluation, two: Evaluation) -> None:
    for name in ("reached", "directions", "interaction_matrix", "singular_values"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True)
    assert one.position is not None
    assert two.position is not None
    assert np.array_equal(one.position.largest, two.position.largest, equal_nan=True)


@pytest.mark.parametrize("compiled", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_no_pose_one_pose_and_poses_out_of_reach(compiled: bool) -> None:
    if compiled:
        pytest.importorskip("numba")
    _, batch = shipped_batch("quattro")
    none = batch.evaluate(np.zeros((0, 4, 4)), cones=0.01, compiled=compiled)
    assert none.interaction_matrix.shape == (0, 12, 4)
    assert none.singular_values.shape == (0, 4)
    one = batch.evaluate(batch.home[None], cones=0.01, compiled=compiled)
    assert one.reached.all()
    assert np.isfinite(one.interaction_matrix).all()
    far = np.tile(batch.home, (3, 1, 1))
    far[:, :3, 3] += 10.0
    away = batch.evaluate(far, cones=0.01, compiled=compiled)
    assert not away.reached.any()
    assert away.position is not None
    assert np.isnan(away.interaction_matrix).all()
    assert np.isnan(away.position.largest).all()


def test_what_a_batch_refuses() -> None:
    _, batch = shipped_batch("i4l")
    with pytest.raises(BadRequest, match="unknown leg of the batch"):
        batch.evaluate(batch.home[None], ["1"])
    with pytest.raises(BadRequest, match="nothing is observed"):
        batch.evaluate(batch.home[None], [])
    with pytest.raises(BadRequest, match="shape"):
        batch.evaluate(batch.home)
    with pytest.raises(BadRequest, match="memory"):
        batch.evaluate(np.broadcast_to(batch.home, (100_000_000, 4, 4)), ["3"])
    _, solved = shipped_batch("3rps")
    with pytest.raises((BadRequest, MissingExtra), match=r"not compiled|compiled=True.*optional package"):
        solved.evaluate(solved.home[None], compiled=True)
