"""Legs that are not watched hold the platform as well: where they keep it from a translation, that is not lost."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.geometry.vectors import Array, hat, normalise_vector
from hrsynth.kinematics.walking import walk_randomly
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
        inner = normalise_vector(np.cross(across, tip - knee))
        made.joint(f"crank_{k}", "R", "base", f"arm_{k}", foot, axis=across, motor=True)
        made.joint(f"knee_{k}", "U", f"arm_{k}", f"rod_{k}", knee, axis=across, axis2=inner)
        made.joint(f"end_{k}", "U", f"rod_{k}", "platform", tip, axis=inner, axis2=across, loop=True)
        made.observe(f"rod {k}", f"rod_{k}", tip - knee)
    return made.build("platform")


def tangent(robot: Mechanism, state: Array, oracle: Oracle, k: int) -> Array:
    """Of the path of a crank's end, by link poses."""
    knee = (oracle.pose(state, f"arm_{k}") @ np.append(robot.joints[f"knee_{k}"].point, 1.0))[:3]
    return normalise_vector(np.cross(robot.joints[f"crank_{k}"].axis, knee - robot.joints[f"crank_{k}"].point))


@pytest.mark.slow
def test_a_common_translation_that_another_leg_forbids_is_not_lost() -> None:
    """Both tangents are vertical at this pose, and the platform moves in a level plane."""
    robot = on_a_table()
    there = check(robot, ["rod_1", "rod_2"], at=f"x={SHIFT[0]},y={SHIFT[1]}").postures[0].configuration
    oracle, state = Oracle(robot), np.array([there.pose(link) for link in robot.links])
    assert oracle.error(state) < 1e-9
    assert np.linalg.norm(np.cross(tangent(robot, state, oracle, 1), tangent(robot, state, oracle, 2))) < 1e-6
    basis = oracle.relation(state, list(robot.observations))
    assert np.linalg.svd(basis[6:], compute_uv=False)[-1] > 0.01  # both freedoms are seen
    answer = singularities(robot, ["rod_1", "rod_2"], points=60)
    assert answer.condition is not None
    assert answer.condition.evaluate(answer.pattern.values_at([there]))[0] > 0.01


@pytest.mark.some(1)
@pytest.mark.parametrize("legs", [["rod_1"], ["rod_2"]])
def test_one_watched_leg_of_a_platform_on_a_table_has_a_condition(legs: list[str]) -> None:
    """Its tip moves on a circle that is not in the plane: one direction shows both freedoms."""
    answer = singularities(on_a_table(), legs, points=60)
    assert answer.checked is not None
    assert (answer.verdict.rank, answer.checked.disagreements) == (2, 0)


def turning_on_a_table(turns: tuple[float, ...]) -> Mechanism:
    """A platform on two sliders and an upright R, with R-US legs, whose cranks turn in upright planes."""
    made = Builder("turntable")
    for link in ("base", "cross", "slide", "platform"):
        made.link(link)
    made.joint("x", "P", "base", "cross", axis=(1, 0, 0))
    made.joint("y", "P", "cross", "slide", axis=(0, 1, 0))
    made.joint("turn", "R", "slide", "platform", axis=(0, 0, 1))
    for k, turn in enumerate(turns, 1):
        made.link(f"arm_{k}")
        made.link(f"rod_{k}")
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        across = np.cross(UP, out)
        foot, tip = 0.3 * out, 0.1 * np.array([np.cos(turn + 0.4), np.sin(turn + 0.4), 5.0 + k])
        knee = foot + 0.4 * (np.cos(0.3 + 0.2 * k) * out + np.sin(0.3 + 0.2 * k) * UP)
        made.joint(f"crank_{k}", "R", "base", f"arm_{k}", foot, axis=across, motor=True)
        made.joint(
            f"knee_{k}",
            "U",
            f"arm_{k}",
            f"rod_{k}",
            knee,
            axis=across,
            axis2=normalise_vector(np.cross(across, tip - knee)),
        )
        made.joint(f"end_{k}", "S", f"rod_{k}", "platform", tip, loop=True)
        made.observe(f"rod {k}", f"rod_{k}", tip - knee)
    return made.build("platform")


def as_printed(answer: Singularity, state: Array, oracle: Oracle) -> float:
    """The determinant of the matrices that the answer says there are, from the places of cranks and tips."""
    robot, where = answer.setup.mechanism, answer.to_dict()["where"]
    assert {where[name] for name in where if name[0] in "JN"} == {
        text
        for k in range(2, 2 + len(answer.observation_model.observations))
        for text in (f"[I, -[B{k}]x]", f"I - tau{k} tau{k}^T")
    }
    values = {}
    for k, each in enumerate(answer.observation_model.observations, 2):
        number = int(each.link[-1])
        B = (oracle.pose(state, "platform") @ np.append(robot.joints[f"end_{number}"].point, 1.0))[:3] / oracle.length
        tau = tangent(robot, state, oracle, number)
        values |= {f"J{k}": np.hstack([np.eye(3), -hat(B)]), f"N{k}": np.eye(3) - np.outer(tau, tau)}
    if "P" in where:
        assert where["P"] == "diag(n n^T, I - n n^T)"
        values["P"] = np.diag([0.0, 0, 1, 1, 1, 0])
    (total,) = sympy.sympify(answer.condition.expression).args
    terms = sympy.lambdify(sorted(total.free_symbols, key=str), total)
    return float(np.linalg.det(terms(*(values[str(each)] for each in sorted(total.free_symbols, key=str)))))


@pytest.mark.slow
@pytest.mark.parametrize("turns", [(0.3, 2.5), (0.3, 2.5, -1.9)])
def test_tips_that_leave_the_plane_of_motion_have_no_lines_in_it(turns: tuple[float, ...]) -> None:
    """The cranks' ends move in upright planes: what is printed vanishes with the rank of all screws, there alone."""
    robot = turning_on_a_table(turns)
    answer = singularities(robot, [f"rod_{k}" for k in range(1, 1 + len(turns))], points=20)
    assert answer.condition is not None
    assert "lines through" not in answer.words
    oracle = Oracle(robot)
    for at in [*walk_randomly(answer.setup.all_samples.start, 20, seed=1), *(e.configuration for e in answer.examples)]:
        state = np.array([at.pose(link) for link in robot.links])
        basis = oracle.relation(state, list(robot.observations))
        left = np.linalg.svd(basis[6:], compute_uv=False)[-1]
        found = as_printed(answer, state, oracle)
        assert (left < 1e-6) == (found < 1e-10), (left, found)


@pytest.mark.slow
def test_a_held_leg_that_stops_the_turn_in_the_plane_is_no_line_of_it() -> None:
    """An arm, a ball and a slide on the platform: with the slide held, in direction and length, the platform may turn
    about it, and not in its plane."""
    made = Builder("ball and slide")
    for link in ("base", "cross", "slide", "platform", "arm", "bar", "arm_1", "rod_1"):
        made.link(link)
    made.joint("x", "P", "base", "cross", axis=(1, 0, 0))
    made.joint("y", "P", "cross", "slide", axis=(0, 1, 0))
    made.joint("turn", "R", "slide", "platform", axis=(0, 0, 1))
    made.joint("hinge", "R", "base", "arm", (-1, -1, 0), axis=(0, 0, 1))
    made.joint("ball", "S", "arm", "bar", (-0.7, -0.2, 0))
    made.joint("rail", "P", "bar", "platform", (-0.3, 0, 0), axis=(0.8, 0.6, 0), loop=True)
    made.joint("crank", "R", "base", "arm_1", (1, 0.3, 0), axis=(0, 0, 1), motor=True)
    made.joint("knee", "R", "arm_1", "rod_1", (0.9, 0.7, 0), axis=(0, 0, 1))
    made.joint("end", "R", "rod_1", "platform", (0.2, 0.4, 0), axis=(0, 0, 1), loop=True)
    made.observe("bar", "bar", (0.8, 0.6, 0))
    made.observe("rod", "rod_1", (-0.7, -0.3, 0))
    answer = singularities(made.build("platform"), ["bar", "rod_1"], sensor=["encoder:rail"], points=20)
    assert answer.checked is not None
    assert (answer.verdict.rank, answer.checked.disagreements) == (3, 0)
