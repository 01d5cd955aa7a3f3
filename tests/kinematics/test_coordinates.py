"""A platform's own coordinates: as many as its freedoms, independent, with the Jacobian of their errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.pose_continuation import track_to_pose
from hrsynth.description import load
from hrsynth.geometry.vectors import convert_rpy_to_rotation
from hrsynth.kinematics.continuation import track
from hrsynth.kinematics.coordinates import Coordinates
from hrsynth.mechanism.pose import Pose
from oracle import exponential
from strategies import planar, transformed

EXPECTED = {
    "rrrrr_m1": ("x", "y"),
    "3rrr_m1": ("x", "y", "phi"),
    "3rps": ("z", "turn about x", "turn about y"),
    "delta": ("x", "y", "z"),
    "quattro": ("x", "y", "z", "phi"),
    "gough_stewart": ("x", "y", "z", "turn about x", "turn about y", "turn about z"),
}


def made(name: str) -> tuple[Coordinates, ObservedRobot]:
    setup = ObservedRobot.of(load(name))
    start = setup.all_samples.start
    return Coordinates.of(start, setup.all_samples.observation_model, setup.motion), setup


@pytest.mark.parametrize("name", EXPECTED)
def test_a_platform_has_as_many_coordinates_as_freedoms(name: str):
    coordinates, setup = made(name)
    assert coordinates.names == EXPECTED[name]
    assert len(coordinates.names) == setup.dof


@pytest.mark.parametrize(("name", "index"), [("3rrr_m1", 0), ("delta", 2), ("quattro", 2)])
def test_from_the_edge_of_the_reach_a_coordinate_goes_back(name: str, index: int):
    """All steps of its way, though at a stretched leg only the smallest ones find it."""
    coordinates, setup = made(name)
    start, far = setup.all_samples.start, coordinates.values.copy()
    far[index] += 5 * start.model.length
    edge, came = track(start, setup.motion, replace(coordinates, values=far))
    assert came < 1
    here = Coordinates.of(edge, setup.all_samples.observation_model, setup.motion)
    index = here.places.index(coordinates.places[index])
    way = here.along(edge, index, (0.1 * start.model.length, 0.0), 4)
    assert len(way) == 5
    assert [value for value, _ in way] == pytest.approx(
        here.values[index] - np.linspace(0.1, 0, 5) * start.model.length, abs=1e-9
    )


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", range(4))
def test_the_turn_of_a_planar_robot_is_its_angle_about_the_normal(seed: int):
    """Wherever its plane lies: no component of the turn, which is less."""
    setup = ObservedRobot.of(planar(["RRR", "RPR", "RPR"], np.random.default_rng(seed), [{0}, {1}, {1}]), samples=3)
    start, motion = setup.all_samples.start, setup.motion
    coordinates = Coordinates.of(start, setup.all_samples.observation_model, motion)
    assert coordinates.names[2] == "phi"
    for value, at in coordinates.along(start, 2, (0.3, 0.3), 3):
        turn = at.pose(motion.link)[:3, :3] @ motion.home[:3, :3].T
        assert turn == pytest.approx(exponential(value * motion.normal), abs=1e-8)
        assert (
            track_to_pose(start, setup.all_samples.observation_model, motion.pose(at.pose(motion.link)), motion)
            is not None
        )


def test_the_turn_about_a_tilted_axis_is_its_angle():
    """A robot that turns about one axis in space, which is not the base's z."""
    R = convert_rpy_to_rotation(0.5, 0.3, 0.2)
    setup = ObservedRobot.of(transformed(load("quattro"), R, np.zeros(3)), samples=3)
    start, motion = setup.all_samples.start, setup.motion
    coordinates = Coordinates.of(start, setup.all_samples.observation_model, motion)
    assert coordinates.names[3] == "phi"
    for value, at in coordinates.along(start, 3, (0.3, 0.3), 3):
        turn = at.pose(motion.link)[:3, :3] @ motion.home[:3, :3].T
        assert turn == pytest.approx(exponential(value * R[:, 2]), abs=1e-8)
        written = motion.pose(at.pose(motion.link))
        assert Pose.parse(str(written)).phi == pytest.approx(value, abs=1e-7)
        again = track_to_pose(start, setup.all_samples.observation_model, Pose.parse(str(written)), motion)
        assert again.pose(motion.link) == pytest.approx(at.pose(motion.link), abs=2e-6)


def test_an_angle_is_the_same_after_a_whole_turn():
    coordinates, setup = made("3rrr_m1")
    X = setup.all_samples.start.pose(setup.motion.link)
    turned = replace(coordinates, values=coordinates.values + [0, 0, 2 * np.pi])
    assert turned.apart(X) == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize("name", ["quattro", "gough_stewart", "3rps", "3rrr_m1"])
def test_the_jacobian_is_that_of_the_error(name: str):
    coordinates, setup = made(name)
    step = 1e-6
    for at in setup.configurations[:3]:
        rows = coordinates.error_and_jacobian(at.model, at.q)[1]
        for k, direction in enumerate(np.eye(at.model.nv)):
            ahead, behind = (
                coordinates.error_and_jacobian(at.model, at.model.integrate(at.q, s * direction))[0]
                for s in (step, -step)
            )
            assert rows[:, k] == pytest.approx((ahead - behind) / (2 * step), abs=1e-7)


def test_half_the_way_has_half_the_coordinates():
    coordinates, setup = made("gough_stewart")
    X = setup.configurations[0].pose(setup.motion.link)
    half = coordinates.towards(X, 0.5)
    assert half.values == pytest.approx((coordinates.read(X) + coordinates.values) / 2)
    assert coordinates.towards(X, 1.0).values == pytest.approx(coordinates.values)


@pytest.mark.parametrize("name", ["rrrrr_m1", "3rps"])
def test_one_coordinate_changes_in_equal_steps_and_the_others_stay(name: str):
    coordinates, setup = made(name)
    start = setup.all_samples.start
    for index, place in enumerate(coordinates.places):
        way = coordinates.along(start, index, (0.05, 0.1), 4)
        values = np.array([value for value, _ in way])
        home = int(np.argmin(np.abs(values - coordinates.values[index])))
        for side in (values[: home + 1], values[home:]):
            assert np.ptp(np.diff(side)) < 1e-9
        for value, at in way:
            wanted = coordinates.values.copy()
            wanted[index] = value
            assert coordinates.read(at.pose(setup.motion.link)) == pytest.approx(wanted, abs=1e-8), place
