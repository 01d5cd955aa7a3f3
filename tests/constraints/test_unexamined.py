"""Where the loops lose rank a condition in names can miss a freedom that is lost; the answer then says so."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.singularity.found import found
from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.locus import locus
from hrsynth.description import load
from hrsynth.geometry.vectors import Array, hat
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.present.maps import _drawn_locus
from hrsynth.present.text.poses import singularity
from oracle import Oracle

LOST = "x=0.1799995866409783,y=0.3117684294034798,z=1.490904856940507"


def rows(robot: Mechanism, oracle: Oracle, state: Array, seen: tuple[Direction, ...]) -> Array:
    """All wrenches of the joints, and the rates of directions, on the twists of all links."""
    found = [oracle.jacobian(state)]
    for each in seen:
        turn = oracle.twist(np.eye(6 * (len(robot.links) - 1)), each.link)[3:]
        found.append(-hat(oracle.pose(state, each.link)[:3, :3] @ each.direction) @ turn)
    return np.vstack(found)


def test_a_3_upu_loses_a_turn_where_its_two_watched_directions_are_not_parallel() -> None:
    answer = found("3upu", "1,2")
    assert answer.words == "the watched directions u1, u2 are parallel"
    posture = check("3upu", "1,2", at=LOST).postures[0]
    robot, there = answer.setting.mechanism, posture.configuration
    oracle, state = Oracle(robot), np.array([there.pose(link) for link in robot.links])
    seen = tuple(o for o in answer.question.observations if isinstance(o, Direction))
    u, v = (oracle.pose(state, each.link)[:3, :3] @ each.direction for each in seen)
    assert np.linalg.norm(np.cross(u, v)) > 0.1
    values, right = np.linalg.svd(rows(robot, oracle, state, seen))[1:]
    assert values[-1] < 1e-6 < 1e-2 < values[-2]
    assert np.linalg.norm(oracle.twist(right[-1], robot.platform)[3:]) > 0.1
    assert any("constraint singularities" in each for each in answer.unexamined)
    assert "constraint singularities" in singularity(answer)
    assert len(posture.gained) == posture.dof - answer.verdict.dof == 1


@pytest.mark.parametrize(("robot", "legs"), [("3rrr_m1", None), ("rrrrr_m1", None), ("3rps", None)])
def test_nothing_is_left_out_where_the_legs_leave_no_other_motion(robot: str, legs: str | None) -> None:
    assert found(robot, legs).unexamined == ()


@pytest.mark.parametrize(("robot", "legend"), [("3puu", "(never where examined)"), ("prrrp_m1", "(never)")])
def test_the_legend_of_a_locus_says_where_never_was_examined(robot: str, legend: str) -> None:
    field = locus(load(robot), steps=5).hidden
    assert _drawn_locus(None, None, field, "hidden robot").get_label().endswith(legend)
