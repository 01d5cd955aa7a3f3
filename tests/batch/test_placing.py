"""Configurations of many poses: closed for Pinocchio, at the pose asked for, in the working mode of zero."""

from __future__ import annotations

import numpy as np
import pytest

from batch.test_batch import SOLVED, check_law, poses_near, shipped_batch
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity.batch_spectrum import Quick
from hrsynth.analysis.singularity.condition_check import compute_spectrum
from hrsynth.batch.configuration_builder import ConfigurationBuilder, compute_coordinates, compute_rates
from hrsynth.batch.pose_continuation import sweep, track_to_pose
from hrsynth.description import load
from hrsynth.errors import Disagreement
from hrsynth.mechanism.pose import Grid
from hrsynth.tolerances import CLOSURE_RESIDUAL_TOL
from kinematics.robots import ROBOTS
from strategies import planar

WITHOUT = SOLVED | {"i4l", "prrrp_parallel_point"}
"""Robots whose legs are solved by iteration, or that have a link that goes with no pose of the platform."""


def placer_of(robot: str) -> tuple[ObservedRobot, ConfigurationBuilder]:
    setup, _ = shipped_batch(robot)
    assert setup.placer is not None
    return setup, setup.placer


@pytest.mark.some(5)
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_pose_that_is_reached_becomes_a_closed_configuration(robot: str) -> None:
    setup, batch = shipped_batch(robot)
    assert (setup.placer is None) == (robot in WITHOUT)
    if setup.placer is None:
        return
    X = np.concatenate([batch.home[None], poses_near(batch, 30, 0.3)])
    found = batch.evaluate(X)
    met = setup.placer.configurations(X)
    assert [at is not None for at in met] == found.reached.tolist()
    assert found.reached.sum() >= 3
    for i, at in enumerate(met):
        if at is None:
            continue
        assert at.residual <= CLOSURE_RESIDUAL_TOL
        assert np.max(np.abs(at.pose(batch.coordinates.link) - X[i])) < 1e-9
        u = [at.pose(o.link)[:3, :3] @ o.direction for o in setup.placer.seen.values()]
        assert np.max(np.abs(np.array(u) - found.directions[i])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_rod_that_slides_beside_an_axis_is_a_closed_form(seed: int) -> None:
    """Of a planar RPR leg whose slide misses the foot: its directions are Pinocchio's, its poses become closed."""
    setup = ObservedRobot.of(planar(["RPR", "RRR", "RPR"], np.random.default_rng(seed), [{0}] * 3), samples=3)
    batch = setup.batch
    assert batch is not None
    assert [leg is not None and leg.slides and not leg.can_reverse for leg in batch.legs.values()] == [1, 0, 1]
    assert check_law(setup, batch.known, 6) >= 3
    X = np.concatenate([batch.home[None], poses_near(batch, 20, 0.1)])
    met = [at for at in setup.placer.configurations(X) if at is not None]
    assert len(met) == batch.evaluate(X).reached.sum() > 10
    assert all(at.residual <= CLOSURE_RESIDUAL_TOL for at in met)


@pytest.mark.parametrize("robot", ["quattro", "6pus", "3upu", "3rrp", "gough_stewart"])
def test_coordinates_are_those_of_the_poses_of_all_links(robot: str) -> None:
    setup, _ = shipped_batch(robot)
    model = setup.all_samples.model
    for member in setup.all_samples.members:
        at = member.configuration
        q = compute_coordinates(model, {name: at.pose(name)[None] for name in model.mechanism.links})[0]
        assert np.max(np.abs(model.residual(q))) < 1e-9
        for name in model.mechanism.links:
            assert np.max(np.abs(model.pose(q, name) - at.pose(name))) < 1e-9


@pytest.mark.parametrize("robot", ["quattro", "6pus", "3upu", "3rrp", "gough_stewart"])
def test_what_velocities_do_is_what_pinocchio_says(robot: str) -> None:
    placer = ObservedRobot.of(robot).placer
    model = placer.model
    closed = [at for at in placer.configurations(poses_near(placer.batch, 10)) if at is not None]
    names = tuple(model.mechanism.links)
    X = np.array([model.poses(at.q, names) for at in closed])
    assert len(closed) > 3
    for link in names:
        for at, J, V in zip(
            closed, *compute_rates(model, {name: X[:, i] for i, name in enumerate(names)}, link), strict=True
        ):
            theirs, (_, moves) = model.jacobian(at.q), model.frames(at.q, (link,), whole=0)
            # the rates of a ball are told in one frame or another
            ours, other = (
                rows @ (np.eye(model.nv) - np.linalg.pinv(loops, rcond=1e-9) @ loops) @ rows.T
                for rows, loops in ((V, J), (moves[0], theirs))
            )
            np.testing.assert_allclose(ours, other, atol=1e-8)


@pytest.mark.some(2)
@pytest.mark.parametrize("robot", ["orthoglide", "3prr_m1", "hexa"])
def test_walks_give_as_many_different_configurations_as_asked_for(robot: str) -> None:
    setup, placer = placer_of(robot)
    walk = list(placer.random_walk(60, seed=2))
    assert len(walk) == 60
    assert all(at.residual <= CLOSURE_RESIDUAL_TOL for at in walk)
    places = [at.pose(setup.mechanism.platform)[:3, 3] for at in walk]
    assert np.std(places, axis=0).max() > 0.02 * placer.batch.length
    again = list(placer.random_walk(60, seed=2))
    assert all(np.array_equal(one.q, two.q) for one, two in zip(walk, again, strict=True))


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "grid"),
    [
        ("orthoglide", "x=-0.35:0.35:5,y=-0.3:0.3:5,z=0.04"),
        ("quattro", "x=-0.7:0.7:6,y=-0.1:0.4:4,z=-0.7"),
        ("3rrr_m1", "x=-0.2:0.2:4,y=-0.2:0.2:4,phi=0.3"),
    ],
)
def test_a_grid_is_the_same_with_and_without_closed_forms(robot: str, grid: str) -> None:
    setup, placer = placer_of(robot)
    all_samples, cells = setup.all_samples, Grid.parse(grid)
    slow = sweep(all_samples.start, all_samples.observation_model, cells, setup.motion)
    fast = sweep(all_samples.start, all_samples.observation_model, cells, setup.motion, placer)
    assert [at is None for at in slow] == [at is None for at in fast]
    assert any(at is not None for at in slow)
    for one, two in zip(slow, fast, strict=True):
        if one is not None and two is not None:
            for name in setup.decomposition.platform:
                assert np.max(np.abs(one.pose(name) - two.pose(name))) < 1e-6


def test_singular_values_are_pinocchios_also_where_another_working_mode_is_met() -> None:
    setup, placer = placer_of("3rrr_m1")
    all_samples, observation_model = setup.all_samples, setup.samples.observation_model
    walk = [
        track_to_pose(
            all_samples.start,
            all_samples.observation_model,
            setup.motion.pose(at.pose(setup.mechanism.platform)),
            setup.motion,
        )
        for at in placer.random_walk(6, seed=1)
    ]
    other = ObservedRobot.of(load("3rrr_m1"), samples=3, seed=7).all_samples.members[0].configuration
    quick = Quick.of(placer, observation_model)
    assert quick is not None
    for ours, theirs in zip(
        quick.spectrum([*walk, other], compute_spectrum),
        compute_spectrum([*walk, other], observation_model),
        strict=True,
    ):
        assert ours == pytest.approx(theirs, rel=1e-9)


def test_a_batch_that_disagrees_with_pinocchio_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    setup, placer = placer_of("orthoglide")
    quick = Quick.of(placer, setup.samples.observation_model)
    assert quick is not None
    monkeypatch.setattr(
        "hrsynth.analysis.singularity.batch_spectrum.compute_interaction_matrix", lambda found: 1.01 * found.rates
    )
    with pytest.raises(Disagreement):
        quick.spectrum([member.configuration for member in setup.all_samples.members], compute_spectrum)
