"""Joint limits: their reserves are those of the joints' coordinates, and certified paths keep to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analysis.aspects.certified import check_certified, followed
from hrsynth.analysis.aspects.joint_limits import SlideLimit, TurnLimit
from hrsynth.analysis.aspects.leg_forms import LegPattern
from hrsynth.analysis.aspects.path import PathPlanner
from hrsynth.analysis.aspects.verdicts import SAME, SEPARATED, UNDECIDED
from hrsynth.description import load
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import JointType, Limits, Mechanism
from strategies import planar

KNOWN = [
    ("3rrr_m1", None),
    ("3rpr_m1", None),
    ("3prr_m1", None),
    ("rrrrr_m1", None),
    ("gough_stewart", "1,2,3"),
    ("quattro", "1,4"),
    ("quattro_rigid", None),
    ("3puu", None),
    ("hexa", None),
]


def with_limits(robot: Mechanism, limits: Mapping[str, Limits]) -> Mechanism:
    joints = {name: replace(joint, limits=limits.get(name)) for name, joint in robot.joints.items()}
    return replace(robot, joints=joints)


def single(robot: Mechanism) -> list[str]:
    """Its R and P joints."""
    return [joint.name for joint in robot.joints.values() if joint.type in (JointType.REVOLUTE, JointType.PRISMATIC)]


def coordinates(at: ClosedConfiguration, joint: str) -> float:
    """A joint's coordinate: radians, or metres."""
    (place,) = at.model.coordinates[joint]
    found = float(at.model.difference(at.model.q0, at.q)[place])
    return found * at.model.length if at.model.mechanism.joints[joint].type is JointType.PRISMATIC else found


@cache
def limited(robot: str, observe: str | None) -> PathPlanner:
    """A robot with limits on all its R and P joints, not in the middle of their zero."""
    mechanism = load(robot)
    rng = np.random.default_rng(0)
    return PathPlanner.of(
        with_limits(mechanism, {name: Limits(*(rng.uniform(0.05, 0.5, 2) * [-1, 1])) for name in single(mechanism)}),
        observe,
    )


@pytest.mark.some(1)
@pytest.mark.parametrize(("robot", "observe"), KNOWN)
def test_a_reserve_tells_how_far_a_coordinate_is_from_its_limits(robot: str, observe: str | None):
    aspects = limited(robot, observe)
    assert isinstance(aspects.pattern, LegPattern)
    assert {bound.joint for bound in aspects.pattern.bounds} == set(single(aspects.setup.mechanism))
    beyond = 0
    for at in walk_randomly(aspects.setup.samples.start, 12, 1):
        chart = aspects.enclosure(at).forms
        reserves = chart.at(*aspects.pattern.coordinates.of([at])).reach_margins[0, len(chart.subchains) :]
        for bound, reserve in zip(chart.bounds, reserves, strict=True):
            joint = at.model.mechanism.joints[bound.joint]
            assert joint.limits is not None
            middle, half = np.array([[0.5, 0.5], [-0.5, 0.5]]) @ [joint.limits.lower, joint.limits.upper]
            away = coordinates(at, bound.joint) - middle
            beyond += int(reserve < 0)
            if isinstance(bound, TurnLimit):
                assert reserve == pytest.approx(bound.size * (np.cos(away) - np.cos(half)), abs=1e-6)
            else:
                assert isinstance(bound, SlideLimit)
                assert reserve == pytest.approx((half**2 - away**2) / at.model.length**2, abs=1e-6)
    assert beyond


def furthest(path: list[ClosedConfiguration], joints: list[str]) -> tuple[str, float, float]:
    """The joint that leaves the range of its values at a path's ends by most, and limits halfway to where it goes."""
    values = {name: np.array([coordinates(at, name) for at in path]) for name in joints}
    low, high = ({name: f(v[[0, -1]]) for name, v in values.items()} for f in (np.min, np.max))
    leaves = {name: max(low[name] - v.min(), v.max() - high[name]) for name, v in values.items()}
    joint = max(leaves, key=lambda name: leaves[name])
    room = leaves[joint] / 2
    return joint, float(low[joint] - room), float(high[joint] + room)


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot",
    [
        pytest.param(load("3rrr_m1"), id="3rrr_m1"),
        pytest.param(planar(["RRR"] * 3, np.random.default_rng(3), [{0}] * 3), id="random"),
    ],
)
def test_paths_are_led_around_the_limits_that_others_pass(robot: Mechanism):
    """Limits that a path without them leaves: another path keeps to them, or none is found."""
    free = PathPlanner.of(robot)
    places = list(walk_randomly(free.setup.samples.start, 40, 1))
    led = []
    for one, other in zip(places[:20:2], places[::-3], strict=False):
        plain = free.join(one, other)
        if plain.verdict != SAME:
            continue
        joint, low, high = furthest([one, *followed(free, plain, 40), other], single(robot))
        if high - low > 6:
            continue
        aspects = PathPlanner.of(with_limits(robot, {joint: Limits(low, high)}))
        answer = aspects.join(one, other)
        assert answer.verdict in (SAME, UNDECIDED)
        led.append(answer.verdict == SAME)
        if answer.verdict == SAME:
            assert answer.limits == (joint,)
            check_certified(aspects, answer, 40)
            assert all(low < coordinates(at, joint) < high for at in followed(aspects, answer, 60))
    assert any(led)


def test_a_pose_beyond_a_limit_is_named_and_still_separated():
    robot = load("3rrr_m1")
    free = PathPlanner.of(robot)
    places = list(walk_randomly(free.setup.samples.start, 120, 0))
    values = [coordinates(at, "elbow_1") for at in places]
    low, high = np.quantile(values, [0.2, 0.8])
    aspects = PathPlanner.of(with_limits(robot, {"elbow_1": Limits(low, high)}))
    inside = [at for at, value in zip(places, values, strict=True) if low < value < high]
    outside = [at for at, value in zip(places, values, strict=True) if not low <= value <= high]
    verdicts = []
    for start, goal in zip(inside, outside, strict=False):
        answer = aspects.join(start, goal)
        opposite = answer.start.value * answer.goal.value < 0
        verdicts.append(answer.verdict)
        assert answer.verdict == (SEPARATED if opposite else UNDECIDED)
        assert opposite or answer.reason == "the goal is at or beyond a limit of joint elbow_1"
    assert set(verdicts) == {SEPARATED, UNDECIDED}


@pytest.mark.parametrize("room", [None, 0.25])
def test_a_rod_may_pass_length_zero_unless_it_is_limited(room: float | None):
    """Each rod of a 3-RPR turned over changes the sign, so poses are separated only where slides cannot pass zero."""
    robot, slides = load("3rpr_m1"), ("slide_1", "slide_2", "slide_3")
    aspects = PathPlanner.of(
        robot if room is None else with_limits(robot, {name: Limits(-room, room) for name in slides})
    )
    near = [
        at
        for at in walk_randomly(aspects.setup.samples.start, 150, 1)
        if all(abs(coordinates(at, name)) < 0.24 for name in slides)
    ]
    values = aspects.condition.evaluate(aspects.structure.values_at(near))
    answer = aspects.join(near[int(np.argmin(values))], near[int(np.argmax(values))], any_mode=True, budget=20)
    assert answer.start.value * answer.goal.value < 0
    assert (answer.verdict, answer.certified) == ((UNDECIDED, False) if room is None else (SEPARATED, True))


@pytest.mark.some(1)
@pytest.mark.parametrize("limits", [Limits(-4.0, 4.0), Limits(lower=-1.0)])
def test_limits_that_are_not_considered_are_named(limits: Limits):
    aspects = PathPlanner.of(with_limits(load("3rrr_m1"), {"elbow_1": limits, "elbow_2": Limits(-3.0, 3.0)}))
    places = list(walk_randomly(aspects.setup.samples.start, 2, 0))
    answer = aspects.join(places[0], places[0])
    assert (answer.verdict, answer.limits) == (SAME, ("elbow_2",))
    assert answer.not_proved.startswith("limits of joints elbow_1; ")


def test_a_pose_on_a_limit_is_not_called_beyond_it():
    """A joint that rests on its stop where the path begins: nothing is proved, and it is not said to be beyond it."""
    aspects = PathPlanner.of(with_limits(load("3rrr_m1"), {"elbow_1": Limits(0.0, 1.0)}))
    others = walk_randomly(aspects.setup.samples.start, 40, 0)
    goal = next(at for at in others if 0.01 < coordinates(at, "elbow_1") < 0.9)
    answer = aspects.join(aspects.setup.samples.start, goal)
    assert answer.verdict == UNDECIDED
    assert answer.reason == "the start is at or beyond a limit of joint elbow_1"
