"""Legs that are not watched hold the platform as well: where they keep it from a translation, that is not lost."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.singular import singular
from hrsynth.geometry.vectors import Array, unit
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from oracle import Oracle

UP, SHIFT = np.array([0.0, 0.0, 1.0]), np.array([0.12, 0.05, 0.0])


def on_a_table() -> Mechanism:
    """A platform on two sliders, x and y, with two R-UU legs; at ``SHIFT`` both cranks are level."""
    made = Builder("table")
    for link in ("base", "cross", "platform", "arm_1", "arm_2", "rod_1", "rod_2"):
        made.link(link)
    made.joint("x", "P", "base", "cross", axis=(1, 0, 0))
    made.joint("y", "P", "cross", "platform", axis=(0, 1, 0))
    for k, (turn, lean) in enumerate(((0.3, 0.5), (2.5, 0.4)), 1):
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        across = np.cross(UP, out)
        foot, tip = 0.3 * out, 0.1 * out
        knee, level = foot + 0.4 * (np.cos(lean) * out + np.sin(lean) * UP), foot + 0.4 * out - SHIFT
        tip[2] = (level @ level - knee @ knee - 2 * tip @ (level - knee)) / (2 * (level - knee)[2])
        inner = unit(np.cross(across, tip - knee))
        made.joint(f"crank_{k}", "R", "base", f"arm_{k}", foot, axis=across, motor=True)
        made.joint(f"knee_{k}", "U", f"arm_{k}", f"rod_{k}", knee, axis=across, axis2=inner)
        made.joint(f"end_{k}", "U", f"rod_{k}", "platform", tip, axis=inner, axis2=across, loop=True)
        made.observe(f"rod {k}", f"rod_{k}", tip - knee)
    return made.build("platform")


def tangent(robot: Mechanism, state: Array, oracle: Oracle, k: int) -> Array:
    """Of the path of a crank's end, by link poses."""
    knee = (oracle.pose(state, f"arm_{k}") @ np.append(robot.joints[f"knee_{k}"].point, 1.0))[:3]
    return unit(np.cross(robot.joints[f"crank_{k}"].axis, knee - robot.joints[f"crank_{k}"].point))


def test_a_common_translation_that_another_leg_forbids_is_not_lost() -> None:
    """Both tangents are vertical at this pose, and the platform moves in a level plane."""
    robot = on_a_table()
    there = check(robot, ["rod_1", "rod_2"], at=f"x={SHIFT[0]},y={SHIFT[1]}").postures[0].configuration
    oracle, state = Oracle(robot), np.array([there.pose(link) for link in robot.links])
    assert oracle.error(state) < 1e-9
    assert np.linalg.norm(np.cross(tangent(robot, state, oracle, 1), tangent(robot, state, oracle, 2))) < 1e-6
    basis = oracle.relation(state, list(robot.observations))
    assert np.linalg.svd(basis[6:], compute_uv=False)[-1] > 0.01  # both freedoms are seen
    answer = singular(robot, ["rod_1", "rod_2"], points=60)
    assert answer.condition is not None
    assert answer.condition.expressed(answer.pattern.values_at([there]))[0] > 0.01


@pytest.mark.parametrize("legs", [["rod_1"], ["rod_2"]])
def test_one_watched_leg_of_a_platform_on_a_table_has_a_condition(legs: list[str]) -> None:
    """Its tip moves on a circle that is not in the plane: one direction shows both freedoms."""
    answer = singular(on_a_table(), legs, points=60)
    assert answer.checked is not None
    assert (answer.verdict.rank, answer.checked.disagreements) == (2, 0)
