"""Where the loops lose rank a condition in names can miss a freedom that is lost; the answer then says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from adversary.robot import Items, Robot, State
from adversary.search import solve
from analysis.singularity.found import found
from analysis.singularity.test_never_in_loops import Z, joint, loop
from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.locus import compute_locus
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.constraints.condition import NamedCondition
from hrsynth.description import load
from hrsynth.geometry.vectors import Array, hat, normalise_vector
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.present.maps import _draw_locus_curve
from hrsynth.present.text.poses import format_singularity
from oracle import Oracle

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
TURNED = {
    "guide_1": -0.32956881178506797,
    "guide_2": 0.22019586075863637,
    "guide_3": 0.009321378487941519,
    "elbow_1__1": 0.3992829854782661,
    "elbow_2__1": 0.8042627383149855,
    "elbow_3__1": 0.6056722058486278,
    "elbow_1__2": 0.007883001322778025,
    "elbow_2__2": -0.392619284127817,
    "elbow_3__2": 0.7947630011795785,
    "wrist_1__1": -1.576940091041292,
    "wrist_1__2": -0.6610939500964069,
}
LOST = "x=0.1799995866409783,y=0.3117684294034798,z=1.490904856940507"


def rows(robot: Mechanism, oracle: Oracle, state: Array, seen: tuple[Direction, ...]) -> Array:
    """All wrenches of the joints, and the rates of directions, on the twists of all links."""
    found = [oracle.jacobian(state)]
    for each in seen:
        turn = oracle.twist(np.eye(6 * (len(robot.links) - 1)), each.link)[3:]
        found.append(-hat(oracle.pose(state, each.link)[:3, :3] @ each.direction) @ turn)
    return np.vstack(found)


@pytest.mark.slow
def test_a_3_upu_loses_a_turn_where_its_two_watched_directions_are_not_parallel() -> None:
    answer = found("3upu", "1,2")
    assert answer.words == "the observed directions u1, u2 are parallel"
    posture = check("3upu", "1,2", at=LOST).postures[0]
    robot, there = answer.setup.mechanism, posture.configuration
    oracle, state = Oracle(robot), np.array([there.pose(link) for link in robot.links])
    seen = tuple(o for o in answer.observation_model.observations if isinstance(o, Direction))
    u, v = (oracle.pose(state, each.link)[:3, :3] @ each.direction for each in seen)
    assert np.linalg.norm(np.cross(u, v)) > 0.1
    values, right = np.linalg.svd(rows(robot, oracle, state, seen))[1:]
    assert values[-1] < 1e-6 < 1e-2 < values[-2]
    assert np.linalg.norm(oracle.twist(right[-1], robot.platform)[3:]) > 0.1
    assert any("constraint singularities" in each for each in answer.unexamined)
    assert "constraint singularities" in format_singularity(answer)
    assert len(posture.gained) == posture.dof - answer.verdict.dof == 1


def placed(file: Robot, at: State, robot: Mechanism) -> Array:
    """The poses of a mechanism's links at a configuration of its file."""
    R, p, _ = file.frames(at)
    state = np.tile(np.eye(4), (len(robot.links), 1, 1))
    places = [file.number(link) for link in robot.links]
    state[:, :3, :3], state[:, :3, 3] = R[0, places], p[0, places]
    return state


def test_a_3_puu_whose_platform_has_turned_loses_a_freedom_though_its_rails_are_not_parallel() -> None:
    """In another operation mode, with loops of full rank: *never* does not speak of it, and the answer says so."""
    answer = found("3puu", "1,2")
    assert answer.condition is not None
    assert answer.condition.never
    file = Robot.read(ROBOTS / "3puu.urdf")
    zero = file.zero()
    turned = State(zero.theta.copy(), zero.quats)
    for name, value in TURNED.items():
        turned.theta[0, file.coordinates[name]] = value
    turned = solve(file, file.loops, turned)[0]
    robot = answer.setup.mechanism
    oracle, state = Oracle(robot), placed(file, turned, robot)
    seen = tuple(o for o in answer.observation_model.observations if isinstance(o, Direction))
    assert oracle.error(state) < 1e-9
    assert oracle.mobility(state) == oracle.mobility(oracle.zero()) == 3
    assert np.trace(oracle.pose(state, robot.platform)[:3, :3]) < 1  # by more than a right angle
    values = np.linalg.svd(rows(robot, oracle, state, seen), compute_uv=False)
    assert values[-1] < 1e-6 < 1e-2 < values[-2]
    assert any("and those at which it has turned" in each for each in answer.unexamined)


def sliding_halves() -> str:
    """The Quattro with a slide between its halves, as text; a tool hangs on one half and, by a tie, on the other."""
    foot, pin, end = np.array([0.05, 0, 0]), np.array([0.083, 0.0226, 0]), np.array([0.04, 0.02, 0])
    root = ElementTree.parse(ROBOTS / "quattro.urdf").getroot()
    for each in list(root):
        if each.get("name", "").startswith(("hinge_", "side_", "platform")):
            root.remove(each)
    more = (
        f'<more><joint name="slide" type="prismatic"><parent link="plate_12"/><child link="plate_34"/>'
        f'<origin xyz="0 0.086 0"/><axis xyz="1 0 0"/></joint>'
        f"{joint('foot', 'continuous', 'plate_12', 'tool', foot, Z)}"
        f"{joint('pin', 'continuous', 'tool', 'tie', pin - foot, Z)}"
        f"{loop('end', 'tie', end + [0, 0.086, 0] - pin, 'plate_34', end, Z)}</more>"
    )
    root.extend(ElementTree.fromstring(more))
    next(root.iter("platform")).set("link", "tool")
    return ElementTree.tostring(root, "unicode")


@pytest.mark.slow
def test_a_tool_at_the_dead_point_of_its_tie_turns_though_the_halves_rest(tmp_path: Path) -> None:
    """The halves do not turn, det(e, τ1, τ4) is not zero, and a turn of the tool is not seen: no sentence about the
    halves says that."""
    path = tmp_path / "robot.urdf"
    path.write_text(sliding_halves())
    answer = singularities(str(path), "1,4", points=20)
    file = Robot.read(path)
    tool, tie = (np.subtract(*file.centres[link][1::-1]) for link in ("tool", "tie"))
    items, count = file.loops.items, len(file.loops.items.links)
    links, local = [file.number("tool"), file.number("tie")], [normalise_vector(tool), normalise_vector(tie)]
    line = replace(
        file.loops,
        same=np.vstack([file.loops.same, [count, count + 1]]),
        items=Items(np.append(items.links, links), np.vstack([items.local, *local]), np.append(items.point, [0, 0])),
    )
    robot = answer.setup.mechanism
    oracle, state = Oracle(robot), placed(file, solve(file, line, file.zero())[0], robot)
    assert oracle.error(state) < 1e-9
    assert oracle.mobility(state) == oracle.mobility(oracle.zero())
    assert all(np.allclose(oracle.pose(state, half)[:3, :3], np.eye(3)) for half in ("plate_12", "plate_34"))
    seen = tuple(o for o in answer.observation_model.observations if isinstance(o, Direction))
    basis = oracle.relation(state, seen)
    kernel = np.linalg.svd(basis[6:])[2][-1]
    assert np.linalg.norm(basis[6:] @ kernel) < 1e-9
    assert np.linalg.norm((basis[:6] @ kernel)[3:]) > 0.1
    assert not isinstance(answer.condition, NamedCondition)


@pytest.mark.parametrize(("robot", "legs"), [("3rrr_m1", None), ("rrrrr_m1", None), ("3rps", None)])
def test_nothing_is_left_out_where_the_legs_leave_no_other_motion(robot: str, legs: str | None) -> None:
    assert found(robot, legs).unexamined == ()


@pytest.mark.parametrize(
    ("robot", "legend"),
    [("3puu", "(never where examined)"), pytest.param("prrrp_m1", "(never)", marks=pytest.mark.slow)],
)
def test_the_legend_of_a_locus_says_where_never_was_examined(robot: str, legend: str) -> None:
    field = compute_locus(load(robot), steps=5).hidden
    assert _draw_locus_curve(None, None, field, "hidden robot").get_label().endswith(legend)
