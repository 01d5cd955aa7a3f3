"""Lines of joint coordinates: a proved one leads where 500 plain Newton steps lead; one that crosses a fold, or ends on
another branch, is never proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from hrsynth.analysis.branch import joint_line
from hrsynth.analysis.branch.joint_line import follow_line, prove_line
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.errors import BadRequest, HrsynthError, PoseReachFailure
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.joint_coordinates import JointLine, list_coordinate_joints, read_joints, track_to_joints
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.pose import JointPose, parse_pose
from kinematics.robots import ROBOTS
from kinematics.test_joint_coordinates import along_line
from strategies import parallel_robots, random_rotation, split, transformed

STEPS = 500
UNPROVED = {
    "prrrp_parallel_point": "do not determine the platform",
    "quattro": "redundant constraints of loop",
    "quattro_rigid": "do not determine the platform",
    "i4l": "redundant constraints of loop",
}


def draw_goal(robot: Mechanism, rng: np.random.Generator, size: float) -> JointPose:
    """Random values of all motors, up to a part of a radian or characteristic length."""
    goal = []
    for joint in list_coordinate_joints(robot, motors=True):
        unit = robot.length if joint.type.has_translation else 1.0
        goal.append((joint.name, tuple((unit * rng.uniform(-size, size, joint.type.freedoms)).tolist())))
    return JointPose(True, tuple(goal))


def follow(setup: ObservedRobot, goals: Sequence[JointPose]) -> list[str]:
    """What is said of the lines that are followed to their ends; proved ones lead where small steps lead."""
    start, link, said = setup.all_samples.start, setup.motion.link, []
    for goal in goals:
        try:
            reached = follow_line(start, setup.motion, goal)
        except (PoseReachFailure, BadRequest):
            continue
        assert reached.line is not None
        said.append(reached.line)
        if reached.line == "proved":
            home = track_to_joints(start, setup.motion, goal)[1].steps[0]
            q = along_line(home, [name for name, _ in goal.values], dict(goal.values), STEPS)
            assert np.abs(reached.pose(link) - home.model.pose(q, link)).max() < 1e-7
    return said


@pytest.mark.some(6, 16)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_proved_line_leads_where_small_steps_lead(name: str) -> None:
    setup, rng = ObservedRobot.of(name), np.random.default_rng(8)
    near = follow(setup, [draw_goal(setup.robot, rng, 0.02) for _ in range(3)])
    if name in UNPROVED:
        assert all(UNPROVED[name] in each for each in near)
    else:
        assert near == 3 * ["proved"]
        far = follow(setup, [draw_goal(setup.robot, rng, 0.7) for _ in range(5)])
        assert all(each == "proved" or each.startswith("found, proved up to ") for each in far)


def forge(home: ClosedConfiguration, line: JointLine, end: ClosedConfiguration) -> JointLine:
    """A line of the same joints that claims to lead from one configuration to another."""
    ends = [
        np.concatenate(
            [at.model.difference(at.model.q0, at.q)[list(at.model.coordinates[name])] for name, _ in line.axes]
        )
        for at in (home, end)
    ]
    return replace(line, reach=ends[1] - ends[0], fractions=np.array([0.0, 1.0]), steps=(home, end))


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["rrrrr_m1", "3prr_m1", "3rpr_m2", "3rps", "gough_stewart"])
def test_a_line_that_leads_elsewhere_is_never_proved(name: str) -> None:
    """Lines to where a random walk leads are proved only if the straight line leads there, which ends at a fold, or
    arrives on another branch, for some."""
    setup = ObservedRobot.of(name)
    start, link, motors = setup.all_samples.start, setup.motion.link, list_coordinate_joints(setup.robot, True)
    line = track_to_joints(start, setup.motion, draw_goal(setup.robot, np.random.default_rng(0), 0.01))[1]
    proved = elsewhere = 0
    for at in [*walk_randomly(start, 160, seed=1)][9::15]:
        wanted = {joint.name: read_joints(at)[joint.name] for joint in motors}
        q = along_line(start, list(wanted), wanted, STEPS)
        arrives = bool(
            np.linalg.norm(start.model.residual(q)) < 1e-9
            and np.abs(start.model.pose(q, link) - at.pose(link)).max() < 1e-6
        )
        said = prove_line(forge(start, line, at))
        assert arrives or said != "proved"
        proved, elsewhere = proved + (said == "proved"), elsewhere + (not arrives)
    assert proved > 0
    assert elsewhere > 2


def test_other_modes_with_the_same_motors_are_never_proved() -> None:
    """A line of no length leads to where it starts alone; one of half the length does not lead to the same pose."""
    setup = ObservedRobot.of("3rrr_m1")
    start = setup.all_samples.start
    line = track_to_joints(start, setup.motion, parse_pose("motors:0.01,0.01,0.01"))[1]
    ends = [mode.configuration for mode in hrsynth.modes(setup.robot, real=True).modes]
    said = [prove_line(forge(start, line, end)) for end in ends if end is not None]
    assert said.count("proved") == 1 < len(said)
    assert prove_line(line) == "proved" != prove_line(replace(line, reach=line.reach / 2))


def test_a_bounded_number_of_pieces_is_tried(monkeypatch) -> None:
    """What is not proved with few pieces says so, and how far it is proved; with more it is proved."""
    setup = ObservedRobot.of("rrrrr_m1")
    goal = parse_pose("motors:0.195,-0.195")  # beside a fold
    monkeypatch.setattr(joint_line, "LINE_ROUNDS_MAX", 1)
    few = follow_line(setup.all_samples.start, setup.motion, goal).line
    assert few is not None
    assert few.startswith("found, proved up to ")
    assert "budget (least singular value 0." in few
    monkeypatch.undo()
    assert follow_line(setup.all_samples.start, setup.motion, goal).line == "proved"


@pytest.mark.parametrize(
    ("at", "said"),
    [
        ("motors:0.3", "proved"),
        ("joints:elbow_1=0.1,elbow_2=0.1,elbow_3=0.1", "proved"),
        ("joints:elbow_1=0.1", "found, not proved: these joints alone do not determine the platform"),
        ("motors:0,0,0", "proved"),
        ("phi=0.1", None),
    ],
)
def test_results_tell_it(at: str, said: str | None) -> None:
    at = at.replace("motors:0.3", "motors:shoulder_2=0.3")
    told = hrsynth.check("3rrr_m1", at=at).to_dict()["configurations"][0]["coordinates"]
    assert told.get("line") == said


@pytest.mark.parametrize("seed", range(3))
def test_the_joints_of_the_file_count_where_the_normal_form_has_others(seed: int) -> None:
    """Also from a zero configuration that was moved."""
    rng = np.random.default_rng(seed)
    robot = split(hrsynth.load("delta"), rng, ("spherical",))
    assert follow(ObservedRobot.of(robot), [draw_goal(robot, rng, 0.3) for _ in range(2)]) == 2 * ["proved"]
    moved = hrsynth.observe(robot, at="motors:0.2,0,0.1")
    assert follow_line(moved.all_samples.start, moved.motion, parse_pose("motors:0,0,0")).line == "proved"


@settings(max_examples=25)
@given(parallel_robots(), st.integers(0, 10**6))
@pytest.mark.slow
def test_lines_of_random_tilted_robots(robot: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    try:
        setup = ObservedRobot.of(transformed(robot, random_rotation(rng), rng.normal(size=3)))
        setup.robot.require_motors()
    except HrsynthError:
        return
    said = follow(setup, [draw_goal(setup.robot, rng, size) for size in (0.05, 0.5)])
    assert all(each == "proved" or each.startswith("found, ") for each in said)
