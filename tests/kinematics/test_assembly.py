"""Robots assembled at a pose leg by leg: the pose and the measured values are those asked for, or a leg is named."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import pose, unit
from hrsynth.kinematics.assembly import Assembler
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.kinematics.limits import SINGLE, CoordinateIntervals
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import JointType, Limits

ROBOTS = sorted(list_robots())


def prepared(name: str) -> ObservedRobot:
    return ObservedRobot.of(load(list_robots()[name]), samples=3)


def assembler(setup: ObservedRobot) -> Assembler:
    return Assembler(setup.decomposition, setup.all_samples.model.length, setup.all_samples.observation_model.reference)


def bodies(setup: ObservedRobot, at: ClosedConfiguration) -> dict[str, np.ndarray]:
    return {leg.platform_link: at.pose(leg.platform_link) for leg in setup.decomposition.legs}


def values(at: ClosedConfiguration, setup: ObservedRobot) -> list[np.ndarray]:
    observation_model = setup.all_samples.observation_model
    return measure(at.model, at.q, observation_model.reference, observation_model.observations)[2]


@pytest.mark.some(6)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_reachable_pose_is_assembled_with_its_directions(name: str):
    """At random configurations the robot is found again: bodies, platform and directions, loops closed."""
    setup = prepared(name)
    build = assembler(setup)
    for member in setup.all_samples.members:
        there = member.configuration
        wanted = values(there, setup)
        observations = setup.all_samples.observation_model.observations
        found = build.at(bodies(setup, there), list(zip(observations, wanted, strict=True)))
        assert found.reachable, found.open
        assert found.configuration is not None
        platform = setup.mechanism.platform
        if setup.decomposition.point is None:
            assert found.configuration.pose(platform) == pytest.approx(there.pose(platform), abs=1e-8)
        for mine, theirs in zip(values(found.configuration, setup), wanted, strict=True):
            assert mine == pytest.approx(theirs, abs=1e-8)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", ["3rrr_m1", "delta", "quattro", "rrrrr_m1", "orthoglide"])
def test_a_pose_far_away_names_the_legs_that_do_not_close(name: str):
    setup = prepared(name)
    far = {body: pose((50.0, 0.0, 0.0)) @ X for body, X in bodies(setup, setup.all_samples.start).items()}
    found = assembler(setup).at(far, ())
    assert not found.reachable
    assert found.configuration is None
    crowd = {leg.label for leg in setup.decomposition.legs}
    assert found.open
    assert set(found.open) <= crowd


def test_limits_of_joints_are_kept():
    """A slider that would have to leave its range is named; in a range that holds the pose it is not."""
    robot = load(list_robots()["gough_stewart"])
    sliders = [joint for joint in robot.joints.values() if joint.type is JointType.PRISMATIC]
    for upper, reachable in ((0.01, True), (-0.01, False)):
        limited = replace(sliders[0], limits=Limits(lower=-0.2, upper=upper))
        setup = ObservedRobot.of(robot.changed(joints=[limited]), samples=1)
        found = assembler(setup).at(bodies(setup, setup.all_samples.start), ())
        assert found.configuration is not None
        assert found.reachable is reachable
        assert found.beyond == (() if reachable else (limited.name,))


@pytest.mark.parametrize("name", ["quattro", "i4l"])
def test_limits_of_the_platforms_own_joints_are_kept(name: str):
    """A joint between the platform's bodies is on no leg; where its range does not hold the pose it is named, and no
    other value is possible, unless the pose is known too roughly for that."""
    setup = ObservedRobot.of(load(list_robots()[name]), samples=1)
    legs = {joint for leg in setup.decomposition.legs for joint in leg.joints}
    inside = [joint for joint in setup.mechanism.joints.values() if joint.name not in legs and joint.type in SINGLE]
    assert inside
    for upper, reachable in ((0.01, True), (-0.01, False)):
        limited = replace(inside[0], limits=Limits(lower=-0.2, upper=upper))
        changed = ObservedRobot.of(setup.robot.changed(joints=[limited]), samples=1)
        found = assembler(changed).at(bodies(changed, changed.all_samples.start), ())
        assert found.reachable is reachable
        assert found.beyond == (() if reachable else (limited.name,))
        rough = assembler(changed).at(bodies(changed, changed.all_samples.start), (), within=0.1)
        assert rough.reachable is (True if reachable else None)


def knuckles() -> tuple[Mechanism, np.ndarray, np.ndarray]:
    """Six legs of two R that meet, a slide and, the first of them, a ball of three R; the axis of the first R and the
    direction of the first leg."""
    b = Builder("knuckles")
    feet = [np.array([np.cos(a), np.sin(a), 0.0]) for a in 2 * np.pi / 6 * np.arange(6) + np.tile([0.1, -0.2], 3)]
    for link in (
        "base",
        *(f"{part}_{i}" for i in range(6) for part in ("knuckle", "barrel", "rod")),
        "ring",
        "cross",
        "platform",
    ):
        b.link(link)
    drawn = []
    for i, foot in enumerate(feet):
        tip = 0.5 * feet[(i + 1) % 6 if i % 2 else i - 1] + [0, 0, 1.0]
        first = np.cross(tip - foot, [0.3, 0.1, 1.0])
        drawn.append([unit(first), unit(tip - foot)])
        b.joint(f"a_{i}", "R", "base", f"knuckle_{i}", at=foot, axis=first)
        b.joint(f"b_{i}", "R", f"knuckle_{i}", f"barrel_{i}", at=foot, axis=np.cross(first, tip - foot))
        b.joint(f"p_{i}", "P", f"barrel_{i}", f"rod_{i}", at=(foot + tip) / 2, axis=tip - foot, motor=True)
        if i:
            b.joint(f"s_{i}", "S", f"rod_{i}", "platform", at=tip, loop=True)
    for axis, ends in zip(np.eye(3), pairwise(["rod_0", "ring", "cross", "platform"]), strict=True):
        b.joint(f"s_{ends[0]}", "R", *ends, at=0.5 * feet[-1] + [0, 0, 1.0], axis=axis)
    return b.build(platform="platform"), *drawn[0]


def test_limits_of_joints_that_are_joined_are_said_to_be_left_out():
    """Three R through one point are one S: their own limits are not looked at, and each answer says so."""
    robot, *_ = knuckles()
    bent = replace(robot.joints["s_ring"], limits=Limits(lower=-0.01, upper=0.01))
    free = hrsynth.modes(robot, ["1", "2", "3"])
    assert free.to_dict()["limits_ignored"] == []
    assert "as far as limits" not in str(free)
    asked = "x=0.3,y=0.1,z=1,rpy=0/0/0"
    for told in (
        hrsynth.modes(robot.changed(joints=[bent]), ["1", "2", "3"], at=asked),
        hrsynth.check(robot.changed(joints=[bent]), at=asked),
        hrsynth.accuracy(robot.changed(joints=[bent]), at=asked, cone=1e-3),
        hrsynth.select(robot.changed(joints=[bent]), observe=["1"], start=asked, goal=asked, cone=1e-3),
    ):
        words = " ".join(str(told).split())
        assert "ignored: s_ring" in words
        assert words.count("assembled there") == words.count("assembled there, some joint limits ignored")
        assert told.to_dict()["limits_ignored"] == ["s_ring"]
    run = hrsynth.servo(robot.changed(joints=[bent]), start="z=0.01", goal="z=0", time=0.1)
    assert run.to_dict()["limits_ignored"] == ["s_ring"]


@pytest.mark.slow
def test_limits_of_two_turns_that_are_one_joint_are_kept():
    """Two R that meet at right angles are one U, whose turns are computed here from how the barrel is turned."""
    robot, first, along = knuckles()
    second = np.cross(first, along)

    def turn(name: str, at: ClosedConfiguration | None) -> float:
        assert at is not None
        R = at.pose("barrel_0")[:3, :3] @ robot.links["barrel_0"].pose[:3, :3].T
        if name == "a_0":
            return float(np.arctan2(along @ -R @ second, second @ R @ second))
        return float(np.arctan2(first @ -R @ along, first @ R @ first))

    for name, upper in (("b_0", 0.01), ("a_0", 0.5)):
        bent = robot.changed(joints=[replace(robot.joints[name], limits=Limits(lower=-0.01, upper=upper))])
        setup = ObservedRobot.of(bent)
        assert setup.limits_ignored == ()
        assert CoordinateIntervals.of(setup.all_samples.model, setup.all_samples.model.q0).spans == {
            name: (-0.01, upper)
        }
        posed = hrsynth.check(bent, at="x=0.3,y=0.4,z=0.1,rpy=0/0/0").postures[0]
        told = [(posed.configuration, posed.beyond_limits)] + [
            (mode.configuration, mode.beyond_limits) for mode in hrsynth.modes(bent, ["2", "3", "4"]).modes
        ]
        for at, beyond in told:
            assert beyond == (() if -0.01 - 1e-7 <= turn(name, at) <= upper + 1e-7 else (name,))
        assert {beyond for _, beyond in told} == {(), (name,)}
