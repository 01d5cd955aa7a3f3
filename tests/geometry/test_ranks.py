"""Ranks come with evidence, subspaces with angles, configurations with closed loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.errors import BadMechanism, LoopClosureFailure, UndecidedRank
from hrsynth.geometry.ranks import (
    CLEAN,
    Rank,
    compute_kernel_basis,
    compute_largest_angle,
    compute_matrix_spectra,
    compute_matrix_spectrum,
    compute_range_bases,
    compute_range_basis,
    compute_space_basis,
    decompose_matrix,
    rank_of,
)
from hrsynth.geometry.vectors import rotate_about_axis
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.sampling import sample
from hrsynth.kinematics.tasks import solve
from hrsynth.kinematics.velocity_relation import ObservationModel
from hrsynth.mechanism.builder import Builder
from hrsynth.tolerances import CLOSURE_RESIDUAL_TOL, RANK_GAP_MIN
from kinematics.robots import setting_of
from strategies import random_direction, random_rotation

quick = settings(max_examples=50, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize(
    ("values", "rank", "gap"),
    [
        ([3.0, 2.0, 1e-12], 2, 2e12),
        ([1.0, 1e-3, 1e-8], 2, 1e5),
        ([1.0, 1e-3, 1e-5], 3, 1e-5 / np.finfo(float).eps),
        ([5.0, 5.0], 2, CLEAN),
        ([1.0, 0.0, 0.0], 1, CLEAN),
        ([0.0, 0.0], 0, CLEAN),
        ([], 0, CLEAN),
    ],
)
def test_rank_and_gap(values: list[float], rank: int, gap: float) -> None:
    found = rank_of(np.array(values))
    assert found.value == rank
    assert found.gap == pytest.approx(gap)


def test_scale_says_what_zero_is_relative_to() -> None:
    assert rank_of(np.array([1e-9, 1e-9])).value == 2
    small = rank_of(np.array([1e-9, 1e-9]), 1.0)
    assert small.value == 0
    assert small.gap == pytest.approx(1e9)


def test_weakest_is_the_last_kept_value() -> None:
    assert rank_of(np.array([4.0, 2.0, 1e-13])).weakest == pytest.approx(0.5)


@quick
@given(st.floats(1.01, 1e14))
def test_a_verdict_needs_a_gap(gap: float) -> None:
    rank = Rank(3, gap)
    if gap >= RANK_GAP_MIN:
        assert rank.decided("it") == 3
    else:
        with pytest.raises(UndecidedRank, match="the dof") as caught:
            rank.decided("the dof")
        assert caught.value.gap == gap
        assert caught.value.needed == RANK_GAP_MIN


def test_an_unclear_rank_is_refused() -> None:
    with pytest.raises(UndecidedRank):
        rank_of(np.array([1.0, 2e-7, 0.9e-7])).decided("it")


@quick
@given(seeds, st.integers(1, 6), st.integers(1, 6), st.integers(0, 6))
def test_range_and_kernel(seed: int, rows: int, columns: int, rank: int) -> None:
    rng = np.random.default_rng(seed)
    rank = min(rank, rows, columns)
    U, V = np.linalg.qr(rng.normal(size=(rows, rows)))[0], np.linalg.qr(rng.normal(size=(columns, columns)))[0]
    A = U[:, :rank] @ np.diag(rng.uniform(0.5, 2, rank)) @ V[:, :rank].T
    image, kernel = compute_range_basis(A, 1.0), compute_kernel_basis(A, 1.0)
    assert image[1].value == kernel[1].value == rank
    assert min(image[1].gap, kernel[1].gap) > 1e10
    assert kernel[0].shape == (columns, columns - rank)
    assert np.linalg.norm(A @ kernel[0]) < 1e-12
    assert compute_largest_angle(image[0], U[:, :rank]) < 1e-12
    np.testing.assert_allclose(kernel[0].T @ kernel[0], np.eye(columns - rank), atol=1e-12)


def test_several_matrices_together_are_those_apart() -> None:
    """Of one shape, of several, empty ones among them."""
    rng = np.random.default_rng(3)
    for shapes in ([(4, 6)] * 3, [(6, 4)] * 3, [(5, 3), (3, 5)], [(0, 4)] * 2, [(4, 0)] * 2, [(3, 2), (3, 0), (3, 2)]):
        matrices = [rng.normal(size=(rows, 2)) @ rng.normal(size=(2, columns)) for rows, columns in shapes]
        for matrix, found, (basis, rank) in zip(
            matrices, compute_matrix_spectra(matrices), compute_range_bases(matrices), strict=True
        ):
            alone, (own, own_rank) = compute_matrix_spectrum(matrix), compute_range_basis(matrix)
            np.testing.assert_array_equal(found.kernel, alone.kernel)
            np.testing.assert_array_equal(basis, own)
            assert (found.rank, rank) == (alone.rank, own_rank)
            assert rank.value == min(2, *matrix.shape)
            np.testing.assert_allclose(matrix @ found.kernel, 0.0, atol=1e-12)


def test_empty_matrices() -> None:
    assert compute_kernel_basis(np.zeros((0, 4)))[0].shape == (4, 4)
    assert compute_range_basis(np.zeros((5, 0)))[0].shape == (5, 0)


@quick
@given(seeds, st.integers(1, 5), st.floats(1e-7, 1.5))
def test_largest_angle(seed: int, dimension: int, angle: float) -> None:
    """It is zero for any basis of the same space, the angle of a known turn, symmetric, and the same after a turn."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(7, 7)))[0]
    A = Q[:, :dimension]
    mixed = A @ np.linalg.qr(rng.normal(size=(dimension, dimension)))[0]
    assert compute_largest_angle(A, mixed) < 1e-12
    B = mixed.copy()
    B[:, 0] = np.cos(angle) * mixed[:, 0] + np.sin(angle) * Q[:, dimension]
    assert compute_largest_angle(A, B) == pytest.approx(angle, rel=1e-6)
    assert compute_largest_angle(B, A) == pytest.approx(angle, rel=1e-6)
    W = np.linalg.qr(rng.normal(size=(7, 7)))[0]
    assert compute_largest_angle(W @ A, W @ B) == pytest.approx(angle, rel=1e-6)
    assert compute_largest_angle(A, Q[:, : dimension + 1]) == pytest.approx(np.pi / 2)


def test_largest_angle_of_nothing() -> None:
    assert compute_largest_angle(np.zeros((6, 0)), np.zeros((6, 0))) == 0.0
    assert compute_largest_angle(np.zeros((6, 0)), np.eye(6)[:, :1]) == pytest.approx(np.pi / 2)


def test_planes_that_share_a_line() -> None:
    rng = np.random.default_rng(4)
    axis = random_direction(rng)
    plane = np.linalg.svd(axis[None])[2][1:].T
    tilted = rotate_about_axis(plane[:, 0], 0.3) @ plane
    R = random_rotation(rng)
    assert compute_largest_angle(R @ plane, R @ tilted) == pytest.approx(0.3)


@pytest.mark.parametrize("robot", ["delta", "3rrr_m1", "gough_stewart", "3upu"])
def test_an_open_loop_is_no_configuration(robot: str) -> None:
    model = setting_of(robot).all_samples.model
    step = np.random.default_rng(0).normal(scale=0.05, size=model.nv)
    q = model.integrate(model.q0, step)
    with pytest.raises(LoopClosureFailure) as caught:
        ClosedConfiguration.of(model, q)
    worst, miss = model.worst_loop(q)
    assert caught.value.loop == worst
    assert worst in model.mechanism.joints
    assert repr(worst) in str(caught.value)
    assert caught.value.residual >= miss > CLOSURE_RESIDUAL_TOL
    assert caught.value.exit_status == 3


def test_the_loop_that_misses_is_named() -> None:
    """Only the joints of leg 2 are moved, so a loop of leg 2 is open."""
    model = setting_of("3rrr_m1").all_samples.model
    arms = [name for name in model.coordinates if name.endswith("_2") and name not in model.loops]
    step = np.zeros(model.nv)
    for name in arms:
        step[list(model.coordinates[name])] = 0.1
    with pytest.raises(LoopClosureFailure) as caught:
        ClosedConfiguration.of(model, model.integrate(model.q0, step))
    assert arms
    assert caught.value.loop == model.worst_loop(model.integrate(model.q0, step))[0]


def test_not_a_number_is_no_configuration() -> None:
    model = setting_of("delta").all_samples.model
    with pytest.raises(LoopClosureFailure):
        ClosedConfiguration.of(model, np.full_like(model.q0, np.nan))


def test_configurations_are_read_only() -> None:
    at = setting_of("delta").all_samples.start
    with pytest.raises(ValueError):
        at.q[0] = 1.0


@pytest.mark.parametrize("robot", ["delta", "quattro", "hexa", "3puu"])
def test_open_loops_nearby_are_closed(robot: str) -> None:
    model = setting_of(robot).all_samples.model
    q, residual = solve(model, model.integrate(model.q0, np.random.default_rng(3).normal(scale=0.02, size=model.nv)))
    assert residual < CLOSURE_RESIDUAL_TOL
    assert ClosedConfiguration.of(model, q).residual < CLOSURE_RESIDUAL_TOL
    assert np.max(np.abs(q - model.q0)) > 1e-3


@pytest.mark.parametrize("robot", ["delta", "3rrr_m2", "prrrp_parallel_point"])
def test_targets_are_reached(robot: str) -> None:
    """The pose and the directions of one configuration lead another start to it, idle motions apart."""
    all_samples = setting_of(robot).all_samples
    at = all_samples.members[0].configuration
    target = all_samples.members[0].way[-1]
    q, residual = all_samples.model.q0, 1.0
    for each in all_samples.members[0].way:
        q, residual = solve(all_samples.model, q, each, iterations=100)
    assert residual < CLOSURE_RESIDUAL_TOL
    reached = ClosedConfiguration.of(all_samples.model, q)
    for observation, wanted in target.measured:
        value = observation.value(reached.pose(target.reference), reached.pose(observation.link))
        np.testing.assert_allclose(value, wanted, atol=1e-9)
    if target.point is None:
        np.testing.assert_allclose(reached.pose(target.link), at.pose(target.link), atol=1e-9)
    else:
        np.testing.assert_allclose(reached.pose(target.link)[:3, 3], at.pose(target.link)[:3, 3], atol=1e-9)


def test_samples_are_the_same_for_the_same_seed() -> None:
    all_samples = setting_of("3rrr_m1").all_samples
    one, two, other = (sample(all_samples.model, all_samples.observation_model, 2, seed) for seed in (7, 7, 8))
    for a, b, c in zip(one.members, two.members, other.members, strict=True):
        np.testing.assert_array_equal(a.configuration.q, b.configuration.q)
        assert np.max(np.abs(a.configuration.q - c.configuration.q)) > 1e-3


def test_nothing_to_sample() -> None:
    """A triangle of R joints does not move: no sample is far from the start."""
    builder = Builder("triangle")
    for name in ("base", "left", "right"):
        builder.link(name)
    builder.joint("a", "R", "base", "left", (0, 0, 0), axis=(0, 0, 1))
    builder.joint("b", "R", "left", "right", (1, 1, 0), axis=(0, 0, 1))
    builder.joint("c", "R", "right", "base", (2, 0, 0), axis=(0, 0, 1), loop=True)
    builder.observe("1", "left", (1, 1, 0))
    mechanism = builder.build(platform="right")
    with pytest.raises(BadMechanism, match="let no link move"):
        sample(PinocchioModel(mechanism), ObservationModel("right", None, "base", mechanism.observations), 2)


@quick
@given(st.integers(1, 6), st.integers(1, 6), seeds)
def test_a_basis_of_a_space_depends_on_the_space_alone(rows, size, seed):
    """However it is spanned, to the last digits; the axes where they span it."""
    rng = np.random.default_rng(seed)
    size = min(size, rows)
    A = rng.normal(size=(rows, size))
    one, other = (
        compute_space_basis(A),
        compute_space_basis(A @ rng.normal(size=(size, size + 2)) * (1 + 1e-13 * rng.normal())),
    )
    assert one.shape == other.shape == (rows, size)
    assert np.allclose(one, other, atol=1e-7)
    assert np.allclose(one.T @ one, np.eye(size), atol=1e-12)
    assert np.allclose(one @ one.T @ A, A, atol=1e-9)
    axes = np.eye(rows)[:, np.sort(rng.permutation(rows)[:size])]
    assert np.array_equal(compute_space_basis(axes @ rng.normal(size=(size, size))), axes)


def test_of_directions_that_are_equally_near_the_first_is_taken():
    way = np.ones((2, 1)) / np.sqrt(2)
    for noise in (1e-15, -1e-15):
        assert np.allclose(compute_space_basis(way + noise * np.array([[1.0], [-1.0]])), way)
    assert np.allclose(compute_space_basis(-way), way)


@pytest.mark.parametrize("full", [False, True])
def test_a_matrix_that_lapack_gives_up_on_is_decomposed(full: bool, monkeypatch: pytest.MonkeyPatch):
    matrix = np.random.default_rng(0).normal(size=(4, 6)) * np.array([1, 1, 0, 2, 0, 1])
    expected = np.linalg.svd(matrix, compute_uv=False)

    def gives_up(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", gives_up)
    U, s, Vt = decompose_matrix(matrix, full)
    assert Vt.shape == ((6, 6) if full else (4, 6))
    np.testing.assert_allclose(s, expected, atol=1e-14)
    np.testing.assert_allclose(U * s @ Vt[:4], matrix, atol=1e-14)
    with pytest.raises(np.linalg.LinAlgError):
        decompose_matrix(np.full((2, 2), np.nan))
