"""*Never* stands on axes that stay where they are; what is merely not found is called that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.singularity.found import found
from hrsynth.analysis.singularity.agreement import weakest
from hrsynth.analysis.singularity.singular import Singularity, singular
from hrsynth.geometry.vectors import Array, frozen, inverse
from hrsynth.kinematics.walking import random_walk
from hrsynth.mechanism.model import Mechanism
from hrsynth.present.text.poses import singularity
from strategies import deltas


def mixed(seed: int, off: float | None) -> Mechanism:
    """A translating robot in a random base: leg 1 on a rail, the others cranks; ``off`` is the cosine between the rail
    and the axis of crank 2 (None: random)."""
    robot = deltas(["P", "R", "R"], ["2-SS"] * 3, np.random.default_rng(seed), True)
    rail, crank = robot.joints["motor_joint_1"], robot.joints["motor_joint_2"]
    if off is None:
        return robot
    across = np.cross(crank.axes[0], rail.axes[0])
    p = off * crank.axes[0] + np.sqrt(1 - off**2) * across / np.linalg.norm(across)
    return replace(robot, joints={**robot.joints, rail.name: replace(rail, axes=(frozen(p),))})


def told(robot: Mechanism) -> Singularity:
    return singular(robot, ["1", "2"], points=60)


def tangents(answer: Singularity) -> tuple[Array, Array, Array]:
    """The rail's and the crank's axis, and the tangents (n, 3) of the crank's elbow on a walk, by link poses."""
    robot, start = answer.setting.mechanism, answer.setting.everything.start
    p, a = (robot.joints[f"motor_joint_{i}"].axes[0] for i in (1, 2))
    elbow, centre = robot.joints["elbow_2a"].point, robot.joints["motor_joint_2"].point
    arm = "arm_2"
    back = inverse(start.pose(arm)) @ np.append(elbow, 1.0)
    places = [(at.pose(arm) @ back)[:3] for at in random_walk(start, 80, seed=3)]
    tau = np.cross(a, np.array(places) - centre)
    return p, a, tau / np.linalg.norm(tau, axis=1, keepdims=True)


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("off", [None, 0.02])
def test_a_rail_that_is_not_normal_to_a_cranks_axis_is_never_parallel_to_its_tangent(seed: int, off: float | None):
    answer = told(mixed(seed, off))
    assert answer.words.startswith("never: ")
    assert answer.condition is not None
    assert answer.condition.never
    p, a, tau = tangents(answer)
    assert np.linalg.norm(np.cross(tau, p), axis=1).min() >= abs(p @ a) - 1e-9
    sizes = [weakest(at, answer.question) for at in random_walk(answer.setting.everything.start, 40, seed=5)]
    assert min(sizes) > 0


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_rail_normal_to_the_axis_can_be_parallel(seed: int):
    answer = told(mixed(seed, 0.0))
    assert answer.condition is not None
    assert not answer.condition.never
    assert not answer.words.startswith("never")


def test_near_misses_are_not_called_never():
    """A cosine of 1e-9 is rounding, one of 1e-3 is geometry."""
    answers = [told(mixed(0, off)).condition for off in (1e-9, 1e-3)]
    assert [each is not None and each.never for each in answers] == [False, True]


@pytest.mark.some(1)
@pytest.mark.parametrize(("robot", "legs"), [("orthoglide", "1,2"), ("quattro_rigid", "1,3")])
def test_robots_in_space_have_no_plane_of_motion(robot: str, legs: str):
    answer = found(robot, legs)
    assert answer.condition is not None
    assert answer.condition.where["n"] == "direction normal to the lines along which the tips move"


def test_planar_robots_have_one():
    answer = found("3rrr_m1")
    assert answer.condition is not None
    assert answer.condition.where["n"] == "normal of the plane of motion"


def test_what_is_not_found_is_not_said_not_to_be():
    answer = found("quattro_rigid", "1,3")
    assert answer.checked is not None
    text = singularity(replace(answer, examples=()))
    assert f"not found by {answer.checked.searches} searches, which does not mean that there are none" in text
    assert "no pose" not in text
