"""Poses by the number of a mode: the robot is there, assembled, with the directions of the pose that was asked for."""

from __future__ import annotations

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest, PoseReachFailure
from hrsynth.kinematics.configuration import measure
from hrsynth.mechanism.pose import ModeNumber, Pose, parse_pose

ROBOTS = [
    ("3rrr_m1", None, "x=0.01,y=0.01,phi=5deg"),
    ("gough_stewart", "1,3,5", "x=0.02,y=0,z=0.31,rpy=0/0.1/0"),
    ("quattro", "1,4", "x=0.05,y=0.02,z=-0.7"),
    ("3rps", None, "z=0.65"),
]


@pytest.mark.parametrize(("name", "legs", "about"), ROBOTS)
def test_a_mode_by_its_number_is_the_robot_assembled_there(name: str, legs: str | None, about: str):
    setup = hrsynth.observe(load(list_robots()[name]), legs)
    listed = hrsynth.modes(setup, at=about)
    numbers = [k for k, mode in enumerate(listed.modes, 1) if mode.configuration is not None]
    assert len(numbers) > 1
    first, *found = solve_configurations(setup, [Pose.parse(about), *(ModeNumber(k) for k in numbers)])
    observation_model = setup.samples.observation_model
    wanted = np.concatenate(
        measure(first.model, first.q, observation_model.reference, observation_model.observations)[2]
    )
    for k, at in zip(numbers, found, strict=True):
        assert at.model is first.model
        assert str(listed.setup.motion.pose(at.pose(setup.motion.link))) == str(listed.modes[k - 1].pose)
        got = np.concatenate(measure(at.model, at.q, observation_model.reference, observation_model.observations)[2])
        assert np.abs(got - wanted).max() < 1e-9


def test_every_command_takes_a_mode():
    robot = load(list_robots()["gough_stewart"])
    listed = hrsynth.modes(robot, "1,3,5")
    (posture,) = hrsynth.check(robot, "1,3,5", at=["mode:2"]).postures
    assert str(posture.pose) == str(listed.modes[1].pose)
    assert posture.distances.type2 == pytest.approx(listed.modes[1].type2_distance, rel=1e-9)
    found = hrsynth.accuracy(robot, "1,3,5", cone="0.1deg", at=["mode:2"])
    assert str(found.poses[0].pose) == str(listed.modes[1].pose)
    answer = hrsynth.path(robot, "1,3,5", start="mode:1", goal="mode:2")
    assert [str(end.pose) for end in (answer.start, answer.goal)] == [str(mode.pose) for mode in listed.modes]
    run = hrsynth.servo(robot, "1,3,5", start="mode:2", goal=str(listed.pose))
    assert (run.run_outcome.name, run.run_outcome.matched) == ("assembly mode", 2)


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "watched"), [("3rrr_m1", None), ("gough_stewart", "1,3,5"), ("quattro", "1,4")])
def test_a_robot_is_observed_from_a_mode_on(name: str, watched: str | None):
    """The mode is its zero configuration: what ``derive`` and ``legs`` say holds about there, in the file's numbers."""
    robot = load(list_robots()[name])
    setup = hrsynth.observe(robot, watched)
    number = next(k for k, mode in enumerate(hrsynth.modes(setup).modes, 1) if mode.configuration and not mode.goal)
    begun = hrsynth.observe(robot, watched, at=f"mode:{number}")
    start, (there,) = begun.all_samples.start, solve_configurations(setup, [ModeNumber(number)])
    assert all(np.abs(start.pose(link) - there.pose(link)).max() < 1e-9 for link in setup.mechanism.links)
    assert hrsynth.derive(robot, watched, at=f"mode:{number}").to_dict() == hrsynth.derive(begun).to_dict()
    assert begun.robot.file == robot.file


def test_legs_are_counted_from_a_mode_on():
    robot = load(list_robots()["3rrr_m1"])
    assert hrsynth.legs(robot, at="mode:2").to_dict() == hrsynth.legs(hrsynth.observe(robot, at="mode:2")).to_dict()
    with pytest.raises(BadRequest, match="mode:1 to mode:2"):
        hrsynth.legs(robot, at="mode:3")
    with pytest.raises(BadRequest, match="mode:1 to mode:2"):
        hrsynth.modes(robot, at="mode:3")
    with pytest.raises(BadRequest, match="mode:1, mode:2, …"):
        hrsynth.derive(robot, at="mode:0")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("mode:0", "mode:1, mode:2"),
        ("mode:", "mode:1, mode:2"),
        ("mode:two", "mode:1, mode:2"),
        ("mode:9", "mode:1 to mode:2"),
    ],
)
def test_a_mode_that_there_is_not_is_refused(text: str, match: str):
    with pytest.raises(BadRequest, match=match):
        hrsynth.check(load(list_robots()["gough_stewart"]), "1,3,5", at=[text])


def test_a_mode_that_is_not_assembled_is_not_reached():
    setup = hrsynth.observe(load(list_robots()["quattro"]), "1,4")
    listed = hrsynth.modes(setup)
    lost = next((k for k, mode in enumerate(listed.modes, 1) if mode.configuration is None), None)
    if lost is not None:
        with pytest.raises(PoseReachFailure, match="was not found assembled"):
            solve_configurations(setup, [ModeNumber(lost)])


def test_texts_without_a_number_are_poses():
    assert parse_pose("x=0.1") == Pose(x=0.1)
    assert parse_pose(" mode:12 ") == ModeNumber(12)
    assert str(ModeNumber(3)) == "mode:3"
    with pytest.raises(BadRequest):
        parse_pose("modes:1")
