"""Whatever configuration is made the zero configuration, the robot is the same: limits, turns of wrists, what the file
counts, and answers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.foreign.rounded import of_hinges
from hrsynth.description import list_robots
from hrsynth.description.assembly.loops import SINGLE, LoopAssembly
from hrsynth.description.assembly.zero_configuration import at_file_zero, with_zero_at, zeroed_at
from hrsynth.kinematics import limits
from hrsynth.kinematics.assembly import build_from_link_poses
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import set_zero
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.model import Limits
from hrsynth.mechanism.normal import reduce_to_normal_form
from kinematics.robots import walked


def limited(robot: Mechanism, seed: int = 0) -> Mechanism:
    """The robot with limits on each R and P, near enough for random configurations to be beyond some."""
    rng = np.random.default_rng(seed)
    return robot.changed(
        joints=[
            replace(joint, limits=Limits(-float(rng.uniform(0.05, 0.5)), float(rng.uniform(0.05, 0.5))))
            for joint in robot.joints.values()
            if joint.type in SINGLE
        ]
    )


def margins(model: PinocchioModel, at: ClosedConfiguration) -> dict[str, tuple[float, float]]:
    """How far each coordinate is from its two limits, turns within one."""
    found = {}
    for name, value in limits.list_limited_coordinates(model, at.q).items():
        joint, _, lower, upper = model.mechanism.stops[name]
        whole = np.inf if model.mechanism.joints[joint].type.has_translation else 2 * np.pi
        found[name] = tuple(
            float(np.angle(np.exp(1j * x))) if np.isfinite(whole) else x for x in (value - lower, upper - value)
        )
    return found


@pytest.mark.some(4, 12)
@pytest.mark.parametrize("name", list_robots())
def test_limits_and_wrists_move_with_the_zero(name: str):
    """Of balls and U joints as three and two R, in normal form, where these limit what is one joint."""
    robot = reduce_to_normal_form(limited(of_hinges(hrsynth.load(name)))).mechanism
    model = PinocchioModel(robot)
    home = walked(model, seed=1)
    moved = set_zero(home)
    other = PinocchioModel(moved, model.length)
    for seed in (1, 2, 3):
        there = walked(model, seed=seed, steps=2)
        same = build_from_link_poses(other, there.pose)
        assert limits.list_joints_beyond(model, there.q) == limits.list_joints_beyond(other, same.q)
        assert limits.compute_tilt_margins(model, there.q) == pytest.approx(
            limits.compute_tilt_margins(other, same.q), abs=1e-8
        )
        before, after = margins(model, there), margins(other, same)
        assert before.keys() == after.keys()
        for each, value in before.items():
            assert value == pytest.approx(after[each], abs=1e-8)


@pytest.mark.some(6, 12)
@pytest.mark.parametrize("name", list_robots())
def test_what_the_file_counts_is_remembered(name: str):
    """By one move, by two, and back to the file's zero; by link poses, and by the values of a tree."""
    robot = limited(hrsynth.load(name))
    model = PinocchioModel(robot)
    first, second = (walked(model, seed=seed) for seed in (1, 2))
    once = set_zero(first)
    twice = set_zero(build_from_link_poses(PinocchioModel(once, model.length), second.pose))
    values = LoopAssembly.of(twice).zero()
    for moved in (
        once,
        twice,
        with_zero_at(twice, LoopAssembly.of(twice), values),
        zeroed_at(once, {link: second.pose(link) for link in robot.links}),
    ):
        assert moved.filed.keys() == robot.filed.keys() == robot.joint_ranges.keys()
        for joint, ends in robot.joint_ranges.items():
            assert moved.filed[joint] == pytest.approx(ends, abs=1e-9)
        back = at_file_zero(moved)
        assert back is not None
        for link in robot.links:
            np.testing.assert_allclose(back.links[link].pose, robot.links[link].pose, atol=1e-8)
        for joint, ends in robot.joint_ranges.items():
            assert back.joint_ranges[joint] == pytest.approx(ends, abs=1e-8)


POSES = {
    "3rrr_m1": "x=0.01,phi=4deg",
    "3prr_m1": "x=0.01",
    "3rps": "z=0.72",
    "orthoglide": "x=0.02,y=0.01",
    "gough_stewart": "x=0.02,rpy=2deg/0/0",
}


def numbers(record: object) -> list[float]:
    """All numbers of a record, in order."""
    parts = record.values() if isinstance(record, dict) else record if isinstance(record, list) else ()
    return [record] if isinstance(record, float) else [x for part in parts for x in numbers(part)]


@pytest.mark.slow
@pytest.mark.parametrize("name", POSES)
def test_answers_are_those_of_the_same_robot(name: str):
    """At a pose, and of the robot whose zero it is: mobility, ranks, limits, modes, the verdict on a path from it."""
    robot, pose = limited(hrsynth.load(name), seed=4), POSES[name]
    moved = hrsynth.observe(robot, at=pose)
    one, two = (hrsynth.check(robot, at=pose).to_dict(), hrsynth.check(moved).to_dict())
    at, zero = (found["configurations"][0] for found in (one, two))
    for field in ("mobility", "dof", "rank", "beyond_limits", "singularity_indices"):
        assert at[field] == zero[field]
    assert numbers(one["characteristic_length"]) == numbers(two["characteristic_length"])
    assert numbers(at) == pytest.approx(numbers(zero), rel=1e-5, abs=1e-6)
    found, again = hrsynth.modes(robot, at=pose), hrsynth.modes(moved)
    assert [(mode.beyond_limits, mode.reachable) for mode in found.modes] == [
        (mode.beyond_limits, mode.reachable) for mode in again.modes
    ]
    for mode, other in zip(found.modes, again.modes, strict=True):
        assert numbers(mode.to_dict()["pose"]) == pytest.approx(numbers(other.to_dict()["pose"]), abs=1e-6)
    goal = str(hrsynth.observe(robot).motion.pose(robot.links[robot.platform].pose))
    verdicts = [hrsynth.path(each, start=pose, goal=goal).verdict for each in (robot, moved)]
    assert verdicts[0] == verdicts[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["prrrp_m1", "3rps", "rrrrr_m1"])
def test_the_ranges_of_motors_are_those_of_the_same_robot(name: str, tmp_path: Path):
    robot = limited(hrsynth.load(name), seed=4)
    moved = set_zero(walked(PinocchioModel(robot), seed=3, steps=1, size=0.03))
    one, two = hrsynth.branch(robot, max_cells=60), hrsynth.branch(moved, max_cells=60)
    for part, other in zip(one.parts, two.parts, strict=True):
        assert part.motors == other.motors
        np.testing.assert_allclose(part.requested_box, other.requested_box, atol=1e-9)
        assert np.abs(other.q0).max() > 1e-3
