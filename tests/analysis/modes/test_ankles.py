"""A platform that legs keep from some turns: ankles, whose modes are counted independently, and passive legs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hrsynth
from analysis.modes.ankles import LEGS, ankle, carried, counted
from analysis.modes.test_robots import check_completeness, check_modes, same_modes
from analysis.modes.test_surfaces import needs_msolve
from hrsynth.geometry.vectors import build_pose
from strategies import random_rotation, transformed


def check_motors_held(kind: str, seed: int, offset: float = 0.0) -> int:
    """Eight complex modes, proved to be all, and as many real ones as the independent count has."""
    mechanism, joint, rods = ankle(kind, seed, two_turns=bool(seed % 2 or offset), offset=offset)
    found = hrsynth.modes(mechanism, real=True)
    assert (found.found.complex, found.found.complete) == (8, True)
    assert (8, len(found.modes)) == counted(joint, rods)
    check_modes(found)
    check_completeness(found, 20)
    return len(found.modes)


def check_one_leg_watched(kind: str, seed: int, offset: float = 0.0) -> None:
    """One rod decides the foot: four complex modes, proved to be all."""
    mechanism, _, _ = ankle(kind, seed, two_turns=bool(seed % 2 or offset), offset=offset)
    found = hrsynth.modes(mechanism, "1")
    assert (found.found.complex, found.found.complete) == (4, True)
    check_modes(found)
    check_completeness(found, 20)


@pytest.mark.some(1)
@needs_msolve
@pytest.mark.parametrize("kind", LEGS)
def test_an_ankle_has_eight_modes_with_its_motors_held_and_four_with_one_rod_watched(kind: str):
    check_motors_held(kind, 1)
    check_one_leg_watched(kind, 2)


@pytest.mark.parametrize("kind", ["RSU", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("SPU", "RUS"))])
def test_an_ankle_whose_axes_do_not_meet_has_as_many(kind: str):
    check_motors_held(kind, 3, offset=0.02)
    check_one_leg_watched(kind, 4, offset=0.02)


@pytest.mark.long
@pytest.mark.parametrize("kind", LEGS)
def test_twenty_ankles_whose_axes_do_not_meet(kind: str):
    real = [check_motors_held(kind, seed, offset=0.03) for seed in range(20)]
    assert len(set(real)) > 1
    for seed in range(20):
        check_one_leg_watched(kind, seed, offset=0.03)


@needs_msolve
@pytest.mark.some(0, 1)
@pytest.mark.parametrize("kind", LEGS)
def test_twenty_ankles(kind: str):
    real = [check_motors_held(kind, seed) for seed in range(20)]
    assert len(set(real)) > 1
    for seed in range(20):
        check_one_leg_watched(kind, seed)


@pytest.mark.some(1)
@pytest.mark.parametrize(("word", "count"), [("RR", 8), ("RP", 6), ("PR", 6)])
def test_a_platform_that_a_random_leg_carries_has_its_number_of_modes(word: str, count: int):
    real = []
    for seed in range(3, 8):
        found = hrsynth.modes(carried(word, seed), real=True)
        assert (found.found.complex, found.found.complete) == (count, True)
        check_modes(found)
        check_completeness(found, 20)
        real.append(len(found.modes))
    assert len(set(real)) > 1


@pytest.mark.some(1)
@pytest.mark.parametrize(("word", "end"), [("RP", "foot"), ("PR", "end"), ("RR", "foot"), ("RR", "end")])
@pytest.mark.parametrize("leg", [0, 1])
def test_a_ball_on_a_joint_of_the_leg_that_carries_halves_them(word: str, end: str, leg: int):
    """Its distance tells the other joint alone: two values of that, and for each two of the joint."""
    found = hrsynth.modes(carried(word, 3, (leg, end)), real=True)
    assert (found.found.complex, found.found.complete) == (4, True)
    check_modes(found)
    check_completeness(found, 20)


@pytest.mark.slow
@pytest.mark.parametrize("word", ["RRR", "PRR"])
def test_what_three_joints_and_three_balls_leave_is_found(word: str):
    """With 40 and 28 complex modes: not confined, and not proved."""
    found = hrsynth.modes(carried(word, 0), real=True)
    assert (found.found.complex, found.found.complete) == (None, False)
    assert any(mode.goal for mode in found.modes)
    check_modes(found)


@pytest.mark.long
def test_lists_of_parallel_hinges_do_not_depend_on_how_a_robot_stands():
    robot, rng = carried("RR", 3), np.random.default_rng(1)
    robot = robot.changed(joints=[replace(robot.joints[f"joint_{k}"], axes=(np.eye(3)[2],)) for k in range(2)])
    R, p = random_rotation(rng), rng.normal(size=3)
    one, other = hrsynth.modes(robot, real=True), hrsynth.modes(transformed(robot, R, p), real=True)
    assert (one.found.complex, one.found.complete) == (6, True)
    same_modes(one, other, build_pose(p, R))
    check_completeness(other, 20)


def test_a_leg_without_a_segment_is_not_watched():
    mechanism, _, _ = ankle("SPU", 1)
    assert hrsynth.observe(mechanism).labels == ("1", "2")
    verdict = hrsynth.derive(mechanism).verdict
    assert (verdict.verdict, verdict.dof) == ("controllable", 2)


@needs_msolve
@pytest.mark.parametrize("both", [False, True])
def test_both_rods_watched_leave_the_pose_itself(both: bool):
    mechanism, _, _ = ankle("RSU", 3)
    found = hrsynth.modes(mechanism, "1,2" if both else "2")
    assert sum(mode.goal for mode in found.modes) == 1
    assert not both or len(found.modes) == 1
    assert np.isfinite(found.modes[0].radius)
