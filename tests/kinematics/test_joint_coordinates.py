"""Poses by joints: coordinates that a closed configuration has lead to it again, or to where the straight line of the
coordinates leads; what cannot be is refused, and says which joint stops it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_requested_poses
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest, PoseReachFailure
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.joint_coordinates import FileCoordinates, list_coordinate_joints, read_joints
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import Limits, Mechanism
from hrsynth.mechanism.pose import JointPose, parse_pose
from kinematics.robots import ROBOTS
from strategies import split

PIECES = 300


def along_line(
    start: ClosedConfiguration, names: list[str], wanted: dict[str, tuple[float, ...]], pieces: int = PIECES
) -> Array:
    """Where plain Newton steps of least norm lead, on a straight line of the coordinates in many pieces."""
    model = start.model
    places = [i for name in names for i in model.coordinates[name]]
    units = [model.length if model.mechanism.joints[name].type.has_translation else 1.0 for name in names]
    goal = np.concatenate([np.array(wanted[name]) / unit for name, unit in zip(names, units, strict=True)])
    begun, q = model.difference(model.q0, start.q)[places], start.q
    for k in range(1, pieces + 1):
        aim = begun + (goal - begun) * k / pieces
        for _ in range(8):
            error = np.concatenate([model.residual(q), model.difference(model.q0, q)[places] - aim])
            if np.linalg.norm(error) < 1e-11:
                break
            J = np.vstack([model.jacobian(q), np.eye(model.nv)[places]])
            q = model.integrate(q, np.asarray(-np.linalg.lstsq(J, error, rcond=1e-9)[0]))
    return np.asarray(q)


def determine(start: ClosedConfiguration, names: list[str], link: str) -> bool:
    """Whether these joints at rest hold the platform at rest."""
    T = start.kernel()[0]
    rows = np.eye(start.model.nv)[[i for name in names for i in start.model.coordinates[name]]] @ T
    both = np.vstack([rows, start.velocity(link) @ T])
    return bool(np.linalg.matrix_rank(rows, 1e-6) == np.linalg.matrix_rank(both, 1e-6))


@pytest.mark.some(4, 12)
@pytest.mark.parametrize("motors", [True, False])
@pytest.mark.parametrize("name", ROBOTS)
def test_a_configuration_is_found_again_by_its_joints(name: str, motors: bool) -> None:
    """Where the line leads elsewhere, an independent way along it leads there too."""
    setup = ObservedRobot.of(name)
    start, link = setup.all_samples.start, setup.motion.link
    names = [joint.name for joint in list_coordinate_joints(setup.robot) if joint.is_actuated == motors]
    if not names or not all(name in start.model.coordinates for name in names) or not determine(start, names, link):
        pytest.skip("these joints do not say where the platform is")
    for at in walk_randomly(start, 8, seed=3):
        wanted = {name: read_joints(at)[name] for name in names}
        (found,) = solve_requested_poses(setup, [JointPose(motors, tuple(wanted.items()))])
        if isinstance(found, PoseReachFailure):
            reasons = "a singularity lies ahead", "the loops lose rank", "with the other coordinates fixed"
            assert found.reason.startswith(reasons)
            continue
        told = read_joints(found)
        assert max(np.abs(np.subtract(told[name], wanted[name])).max() for name in names) < 1e-6
        if np.abs(found.pose(link) - at.pose(link)).max() > 1e-5:
            q = along_line(start, names, wanted)
            assert np.abs(found.pose(link) - start.model.pose(q, link)).max() < 1e-5


def test_coordinates_count_as_the_file_counts() -> None:
    """After the zero configuration has moved the same pose has the same coordinates."""
    moved = hrsynth.observe("delta", at="motors:0.1,0.2,0.3")
    told = FileCoordinates.of(moved.all_samples.start)
    assert told.motors == pytest.approx({"shoulder_1": 0.1, "shoulder_2": 0.2, "shoulder_3": 0.3}, abs=1e-9)
    (back,) = solve_requested_poses(moved, [parse_pose("motors:0,0,0")])
    assert isinstance(back, ClosedConfiguration)
    zero = ObservedRobot.of("delta").all_samples.start
    link = moved.motion.link
    assert np.abs(back.pose(link) - zero.pose(link)).max() < 1e-8


def test_the_file_counts_on_where_its_joints_were_joined_and_its_zero_has_moved() -> None:
    robot = hrsynth.load("delta")
    for seed in range(2):
        robot = split(robot, np.random.default_rng(seed), ("spherical",))
    moved = hrsynth.observe(robot, at="motors:0.1,0.2,0.3")
    told = FileCoordinates.of(moved.all_samples.start)
    assert {*told.joints} == {joint.name for joint in list_coordinate_joints(robot) if not joint.is_actuated} != set()
    assert told.motors == pytest.approx({"shoulder_1": 0.1, "shoulder_2": 0.2, "shoulder_3": 0.3}, abs=1e-9)
    same = solve_requested_poses(
        moved, [JointPose(False, tuple((name, (value,)) for name, value in told.joints.items()))]
    )
    assert isinstance(same[0], ClosedConfiguration)
    (back,) = solve_requested_poses(moved, [parse_pose("motors:0,0,0")])
    assert isinstance(back, ClosedConfiguration)
    zero, link = ObservedRobot.of(robot).all_samples.start, moved.motion.link
    assert np.abs(back.pose(link) - zero.pose(link)).max() < 1e-8
    found = hrsynth.check(moved, at="motors:shoulder_2=0").postures[0].coordinates
    assert found.motors == pytest.approx({"shoulder_1": 0.1, "shoulder_2": 0.0, "shoulder_3": 0.3}, abs=1e-9)


@pytest.mark.parametrize(
    "given",
    [
        "motors:0.1,0.05,-0.1",
        "motors:shoulder_1=0.1,shoulder_3=-0.1,shoulder_2=0.05",
        {"motors": [0.1, 0.05, -0.1]},
        {"motors": np.array([0.1, 0.05, -0.1])},
        {"joints": {"shoulder_1": 0.1, "shoulder_2": 0.05, "shoulder_3": -0.1}},
        {"motors": {"shoulder_1": f"{np.degrees(0.1):.15g}deg"} | {"shoulder_2": 0.05, "shoulder_3": -0.1}},
    ],
)
def test_all_ways_of_giving_them_are_one(given) -> None:
    pose = hrsynth.check("3rrr_m1", at=given).postures[0].pose
    assert str(pose) == str(hrsynth.check("3rrr_m1", at="motors:0.1,0.05,-0.1").postures[0].pose)


def test_motors_that_are_not_named_stay() -> None:
    found = hrsynth.check("delta", at="motors:shoulder_2=0.2").postures[0].coordinates
    assert found.motors == pytest.approx({"shoulder_1": 0.0, "shoulder_2": 0.2, "shoulder_3": 0.0}, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("motors:0.1", "number of motors"),
        ("motors:elbow_1=0.1", "unknown among its motors"),
        ("joints:nothing=0.1", "unknown among its joints"),
        ("joints:elbow_1=0.1/0.2", "coordinates of elbow_1"),
        ("joints:elbow_1=0.1,elbow_1=0.2", "given twice"),
        ("motors:0.1,shoulder_2=0.1", "motors of a pose"),
        ("motors:nan,0,0", "not a number"),
        ("motors:1e300,0,0", "not a number"),
        ({"motors": [10**400, 0, 0]}, "not a number"),
        ({"motors": [True, 0, 0]}, "not a number"),
        ({"motors": [0, 0, 0], "x": 0.1}, "one of them"),
        ("motor:0.1", "by joints or motors"),
        ("motors:", "motors of a pose"),
        ({"motors": "0.1,x,0.1"}, "motors of a pose"),
        ({"joints": 3}, "joints of a pose"),
        ({"joints": [[0.1, "a"]]}, "joints of a pose"),
    ],
)
def test_what_cannot_be_meant_is_refused(given, said: str) -> None:
    with pytest.raises(BadRequest) as refused:
        hrsynth.check("3rrr_m1", at=given)
    assert said in str(refused.value)


def limited(name: str, joint: str, upper: float) -> Mechanism:
    robot = hrsynth.load(name)
    return robot.changed(joints=[replace(robot.joints[joint], limits=Limits(-upper, upper))])


def test_a_value_beyond_its_limits_is_refused() -> None:
    with pytest.raises(BadRequest, match="shoulder_1 is beyond its limits"):
        hrsynth.check(limited("3rrr_m1", "shoulder_1", 0.05), at="motors:0.1,0,0")


def test_a_joint_at_its_limit_stops_the_way_and_is_named() -> None:
    free = hrsynth.check("3rrr_m1", at="motors:0.2,0.2,0.2").postures[0].coordinates
    assert free is not None
    joint, value = max(free.joints.items(), key=lambda each: abs(float(each[1])))
    with pytest.raises(PoseReachFailure, match=f"{joint} is at its limit") as refused:
        hrsynth.check(limited("3rrr_m1", joint, abs(float(value)) / 2), at="motors:0.2,0.2,0.2")
    assert 0.2 < refused.value.came < 0.8
    assert f"{100 * refused.value.came:.3g} % of the path" in str(refused.value)


def test_motors_that_no_assembly_allows_stop_at_a_singularity() -> None:
    """The last motor values, their part of the line and the singular value that vanishes are told."""
    with pytest.raises(PoseReachFailure, match=r"a singularity lies ahead, at which shoulder_\d stops") as refused:
        hrsynth.check("delta", at="motors:5,0.2,0.3")
    told = refused.value
    assert told.last == f"motors:{str(told).partition(', to ')[2].partition('. ')[0]}"
    start = hrsynth.observe("delta", at=told.last).all_samples.start
    aim = np.array([5.0, 0.2, 0.3])
    values = np.array([read_joints(start)[f"shoulder_{k}"][0] for k in (1, 2, 3)])
    assert values == pytest.approx(told.came * aim, abs=1e-4)
    places = [start.model.coordinates[f"shoulder_{k}"][0] for k in (1, 2, 3)]
    least = np.linalg.svd(start.kernel()[0][places], compute_uv=False).min()
    assert float(str(told).partition("singular value ")[2].partition(")")[0]) == pytest.approx(least, rel=0.1)
    assert least < 0.05


def test_coordinates_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(PoseReachFailure, match="with the other coordinates fixed"):
        hrsynth.check("3rrr_m1", at="joints:shoulder_1=0.1,shoulder_2=0,shoulder_3=0,elbow_1=0.4")


@pytest.mark.parametrize("command", ["check", "modes", "accuracy", pytest.param("equilibria", marks=pytest.mark.slow)])
def test_each_command_takes_them_and_tells_them(command: str, capsys) -> None:
    more = ["--cone", "0.1deg"] * (command == "accuracy")
    pose = "--goal" if command == "equilibria" else "--at"
    assert run_command([command, "3rrr_m1", pose, "motors:0.05,0,0", "--json", *more]) == 0
    told = capsys.readouterr().out
    first = next(each for each in json.loads(told).values() if isinstance(each, list) and "coordinates" in str(each))[0]
    assert first["coordinates"]["motors"] == pytest.approx(
        {"shoulder_1": 0.05, "shoulder_2": 0.0, "shoulder_3": 0.0}, abs=1e-8
    )


def test_joints_that_the_normal_form_has_joined_are_told() -> None:
    """The passive hinges of a U, and of a ball written as three R, have the coordinates that their file has."""
    setup = ObservedRobot.of("3upu")
    (at,) = solve_requested_poses(setup, [parse_pose("motors:0.02,-0.01,0.03")])
    assert isinstance(at, ClosedConfiguration)
    robot = setup.robot
    assert {*read_joints(at)} == {joint.name for joint in list_coordinate_joints(robot)}


def test_free_parts_stay_within_limits() -> None:
    robot = limited("i4l", "guide_2", 0.165)
    (found,) = solve_requested_poses(ObservedRobot.of(robot), [parse_pose("joints:guide_1=-0.2")])
    if isinstance(found, PoseReachFailure):
        assert "guide_2 is at its limit" in found.reason
    else:
        assert abs(read_joints(found)["guide_2"][0]) <= 0.165


@pytest.mark.parametrize("angle", [4.0, -4.0])
def test_turns_are_not_counted_modulo_a_whole_one(angle: float) -> None:
    """Also where the normal form has other joints than the file."""
    robot = hrsynth.load("rrrrr_m1")
    twisted = split(robot, np.random.default_rng(2))
    for each in (robot, twisted):
        crank = next(joint.name for joint in each.joints.values() if joint.is_actuated)
        try:
            at = hrsynth.check(each, at=f"joints:{crank}={angle}").postures[0]
        except PoseReachFailure:
            continue
        assert at.coordinates is not None
        assert at.coordinates.motors[crank] == pytest.approx(angle, abs=1e-8)


def test_degrees_of_a_slide_are_refused() -> None:
    for given in ("motors:10deg,0,0", "joints:slide_1=10deg"):
        with pytest.raises(BadRequest, match="unit of prismatic joint slide_1"):
            hrsynth.check("3rps", at=given)
