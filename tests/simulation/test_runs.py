"""Runs: near starts end at the goal, every ending is what its name says, crossings are reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from os import environ
from typing import Any

import numpy as np
import pytest

from hrsynth.analysis.aspects.path import PathPlanner
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.batch.pose_continuation import track_to_pose
from hrsynth.description import load
from hrsynth.errors import BadRequest, PoseReachFailure
from hrsynth.geometry.ranks import compute_range_basis
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism.model import Limits
from hrsynth.mechanism.pose import parse_poses
from hrsynth.simulation.crossings import track_run
from hrsynth.simulation.outcome import BOUNDARY, GOAL, MODE
from hrsynth.simulation.run import LIMIT
from hrsynth.simulation.servo import servo
from hrsynth.tolerances import CONTROLLER_DAMPING_MIN
from simulation.far import run_between, untold, untrue
from simulation.listed import APART, OUTSIDE, Listed
from simulation.scenes import BLIND, CONTROLLABLE, far_pairs, regular, setting

FEW = ["3rpr_m1", "delta", "quattro"]
REST = [name for name in CONTROLLABLE if name not in FEW]


def near(name: str) -> tuple[ClosedConfiguration, ClosedConfiguration]:
    """A goal away from singularities, and a start 0.05 characteristic lengths and radians from it."""
    found = setting(name)
    goal = next(regular(name, 2, 0.5))
    kernel, _ = goal.kernel()
    moves = compute_range_basis((found.all_samples.observation_model.rows(goal) @ kernel).T, 1.0)[0]
    step = kernel @ moves @ np.full(moves.shape[1], 0.05 / np.sqrt(moves.shape[1]))
    q, _ = solve(goal.model, goal.model.integrate(goal.q, step), tolerance=1e-12)
    return ClosedConfiguration.of(goal.model, q), goal


def check_near(name: str) -> None:
    start, goal = near(name)
    found = run_between(name, start, goal)
    assert found.outcome == GOAL
    assert found.track.crossings("type2") == ()
    assert max(found.from_goal) < 1e-6
    assert np.all(np.diff([command.size for command in found.run.commands]) < 1e-9)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", FEW)
def test_starts_near_the_goal_end_there(name: str):
    check_near(name)


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("name", REST)
def test_starts_near_the_goal_end_there_for_the_other_robots(name: str):
    check_near(name)


def check_far(name: str, seed: int, count: int) -> None:
    aspects = PathPlanner.of(load(name))
    for start, goal in far_pairs(name, seed, count):
        found = run_between(name, start, goal)
        listed = Listed.of(found)
        assert [*untrue(found), *untold(found, aspects), *listed.untrue(found)] == []
        assert listed.member != OUTSIDE
        assert replace(listed, nearest=None, continuum=False).member in (OUTSIDE, APART)


@pytest.mark.slow
def test_far_runs_end_as_they_are_named():
    check_far("3rpr_m1", 3, 1)


@pytest.mark.long
@pytest.mark.parametrize("name", CONTROLLABLE)
def test_more_far_runs_end_as_they_are_named(name: str):
    """``PAIRS`` of each robot (environment; 5)."""
    check_far(name, 4, int(environ.get("PAIRS", "5")))


def test_a_crossing_is_told_where_the_side_changes():
    """Next to where the smallest singular value is least, though sides are told apart only a centimetre away."""
    found = setting("quattro", ("1", "4"))
    along = -0.1757 + np.array([-2e-2, -1e-2, -1e-3, -1e-4, -2e-5, 2e-5, 1e-4, 2e-4, 1e-3, 1e-2, 2e-2])
    at = solve_configurations(found, parse_poses([f"x={x},y=-0.1931,z=-0.6481,phi=0.262" for x in along]))
    track = track_run(at, found.samples.observation_model, found.all_samples.observation_model, found.dof)
    (crossing,) = track.crossings("type2")
    assert track.passages == (crossing,)
    assert abs(crossing.place - int(np.argmin(track.smallest))) <= 1
    assert track.smallest[crossing.place + 1] < CONTROLLER_DAMPING_MIN


@pytest.mark.parametrize("kind", ["type1", "type2"])
@pytest.mark.parametrize("bend", np.linspace(-0.15, 0.15, 12))
def test_a_crossing_is_told_where_a_configuration_lies_on_it(kind: str, bend: float):
    """A five-bar's second leg is stretched (Type 1), or its cranks are parallel (Type 2), exactly at the middle one of
    the configurations."""
    found = setting("rrrrr_m1")
    at = [five_bar(found, kind, bend, step) for step in np.linspace(-0.3, 0.3, 13)]
    track = track_run(at, found.samples.observation_model, found.all_samples.observation_model, found.dof)
    assert [each.kind for each in track.passages] == [kind]


def five_bar(found, kind, bend, step):
    """The five-bar whose second leg is bent by ``step`` from where it is stretched, or whose cranks make that angle."""
    A, B, C = (
        np.array([-0.1, 0.1]),
        np.array([-0.15813199329137 + 0.14906599664569j, 0.18896249413879 + 0.13298749804626j]),
        0.02 + 0.24j,
    )
    (l1, l2), (r1, r2) = abs(B - A), abs(C - B)
    cranks, rods = np.angle(B - A), np.angle(C - B)
    if kind == "type1":
        rod = rods[1] + bend
        elbow = A[1] + l2 * np.exp(1j * (rod - step))
        tip = elbow + r2 * np.exp(1j * rod)
        elbows = np.array([met(tip, r1, A[0], l1), elbow])
    else:
        elbows = A + np.array([l1, l2]) * np.exp(1j * (0.9 + bend + np.array([0, step])))
        tip = met(elbows[1], r2, elbows[0], r1)
    turned, swung = np.angle(elbows - A) - cranks, np.angle(tip - elbows) - rods
    model = found.all_samples.model
    step = np.zeros(model.model.nv)
    for name, value in {
        "shoulder_1": turned[0],
        "shoulder_2": turned[1],
        "elbow_1": swung[0] - turned[0],
        "elbow_2": swung[1] - turned[1],
        "end": swung[1] - swung[0],
    }.items():
        step[model.coordinates[name][0]] = value
    return ClosedConfiguration.of(model, model.q0 + step)


def met(one, far, two, near):
    """Where a circle of radius ``far`` about one point meets one of radius ``near`` about another, on the left of the
    way from the second to the first."""
    apart = abs(one - two)
    along = (near**2 - far**2 + apart**2) / (2 * apart)
    return two + (along + 1j * np.sqrt(near**2 - along**2)) * (one - two) / apart


@pytest.mark.parametrize(
    ("name", "given", "made", "said"),
    [
        pytest.param(
            "rrrrr_m1",
            {"start": "x=0", "goal": "x=0.02"},
            {"motor": None},
            "1 motor for 2 platform dof: too few for the commanded motion",
            marks=pytest.mark.slow,
        ),
        (
            "3rpr_m1",
            {"start": "x=0,y=0,phi=0.1", "goal": "x=0,y=0,phi=0"},
            {"limits": Limits(-1e-3, 1e-3)},
            "the start is beyond the limits of ",
        ),
    ],
)
def test_a_run_says_what_it_leaves_out(name: str, given: dict[str, str], made: dict[str, Any], said: str):
    robot = load(name)
    driven = next(joint for joint in robot.joints.values() if joint.is_actuated)
    assert servo(robot.changed(joints=[replace(driven, **made)]), **given).notes[0].startswith(said)
    assert not servo(robot, **given).notes


# ---- the papers' cases (docs/pages/papers.md: what their geometry gives)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("legs", "ended", "z"), [("1,4", MODE, -0.9019), pytest.param("2,3", GOAL, -0.56, marks=pytest.mark.slow)]
)
def test_two_legs_of_the_robot_with_an_articulated_platform(legs: str, ended: str, z: float):
    found = servo(load("quattro"), legs, start="x=0,y=0,z=-0.75,phi=0", goal="x=-0.2,y=0,z=-0.56,phi=0")
    assert (found.outcome, found.pose.z) == (ended, pytest.approx(z, abs=1e-4))
    assert (found.run_outcome.matched is not None) == (ended == MODE)
    assert list(untrue(found)) == []


@pytest.mark.some(1)
@pytest.mark.parametrize(("legs", "ended", "z"), [("1,2", MODE, -0.7023), ("1,3", GOAL, -0.7)])
def test_two_legs_of_the_robot_with_a_rigid_platform(legs: str, ended: str, z: float):
    found = servo(load("quattro_rigid"), legs, start="x=0.1,y=0.04,z=-0.93", goal="x=0,y=-0.25,z=-0.7", gain=5)
    assert (found.outcome, found.pose.z) == (ended, pytest.approx(z, abs=1e-4))
    assert list(untrue(found)) == []


# ---- noise, trajectories, limits


@pytest.mark.slow
def test_noise_keeps_the_platform_about_the_goal_and_more_of_it_further_away():
    def far(noise: str, seed: int = 0) -> float:
        found = servo(
            load("rrrrr_m1"), start="x=0.02,y=0.2195", goal="x=0.02,y=0.22", gain=4, noise=noise, time=3.0, seed=seed
        )
        assert found.outcome == GOAL
        assert found.spread is not None
        return found.spread.rms_metres

    small = far("0.01deg")
    assert small == far("0.01deg")
    assert small != far("0.01deg", seed=1)
    assert 5 < far("0.1deg") / small < 20


@pytest.mark.slow
def test_a_trajectory_is_followed_with_a_small_error():
    robot, ends = load("delta"), {"start": "x=0,y=0,z=-0.6", "goal": "x=0.1,y=0.1,z=-0.65"}
    led, at_once = servo(robot, duration=4.0, **ends), servo(robot, **ends)
    assert (led.outcome, at_once.outcome) == (GOAL, GOAL)
    assert led.errors.max() < 0.01 * at_once.errors.max()
    assert led.run.times[-1] > 4


@pytest.mark.parametrize(
    ("name", "start", "goal"),
    [("rrrrr_m1", "x=0.02,y=0.2195", "x=0.03,y=0.23"), ("3rps", "x=0,y=0,z=0.3", "x=0,y=0,z=0.4")],
)
def test_a_trajectory_is_followed_where_parts_of_the_pose_depend_on_each_other(name: str, start: str, goal: str):
    found = servo(load(name), start=start, goal=goal, duration=2.0)
    assert found.outcome == GOAL
    assert found.errors.max() < 1e-3


def test_a_blocked_trajectory_tells_that_it_began_at_the_start(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("hrsynth.kinematics.continuation.track", lambda here, motion, goal: (here, 0.5))
    with pytest.raises(PoseReachFailure, match="from the start the robot gets"):
        servo(load("delta"), start="x=0,y=0,z=-0.6", goal="x=0.1,y=0,z=-0.6", duration=2.0)


@pytest.mark.slow
def test_a_bias_holds_the_platform_where_the_measured_directions_are_the_desired_ones():
    found = servo(
        load("delta"), start="x=0,y=0,z=-0.6", goal="x=0.1,y=0.05,z=-0.65", noise="1deg", bias=True, gain=4, time=5.0
    )
    last = found.run.commands[-1]
    assert found.outcome == GOAL
    assert found.spread is not None
    assert found.spread.has_bias
    assert found.spread.metres > 1e-3
    assert last.speed < 1e-4 < last.size
    assert "constant over time" in str(found.noise)


def test_a_joint_limit_is_a_boundary():
    robot = load("delta")
    free = servo(robot, start="x=0,y=0,z=-0.6", goal="x=0.1,y=0.1,z=-0.65")
    joint = next(j for j in robot.joints.values() if j.is_actuated)
    model = free.run.last.model
    way = [model.difference(model.q0, at.q)[model.coordinates[joint.name][0]] for at in free.run.configurations]
    half = (way[0] + way[-1]) / 2
    limits = Limits(lower=half) if way[-1] < way[0] else Limits(upper=half)
    kept = robot.changed(joints=[replace(joint, limits=limits)])
    found = servo(kept, start="x=0,y=0,z=-0.6", goal="x=0.1,y=0.1,z=-0.65")
    assert found.outcome == BOUNDARY
    assert joint.name in found.run_outcome.reason
    last, model = found.run.last, found.run.last.model
    assert model.difference(model.q0, last.q)[model.coordinates[joint.name][0]] == pytest.approx(half, abs=1e-8)


def limited(spans):
    """The five-bar whose joints have these limits."""
    robot = load("rrrrr_m1")
    return robot.changed(joints=[replace(robot.joints[name], limits=Limits(*span)) for name, span in spans.items()])


def angles(run, joint):
    """A joint's angle along a run, (n,)."""
    model = run.last.model
    return np.array([model.difference(model.q0, at.q)[model.coordinates[joint][0]] for at in run.configurations])


def test_limits_a_whole_turn_away_stop_where_they_are():
    ends = {"start": "x=0.05,y=0.2", "goal": "x=-0.05,y=0.2"}
    way = angles(servo("rrrrr_m1", **ends).run, "shoulder_1")
    assert np.all(np.diff(way) * np.sign(way[-1] - way[0]) > -1e-9)
    turn, low, high = 2 * np.pi, way.min() - 0.1, way.max() + 0.1
    assert servo(limited({"shoulder_1": (low + turn, high + turn)}), **ends).outcome == GOAL
    # wider than a whole turn: the start lies between the limits after a whole turn alone, and one limit is on the way
    half = (way[0] + way[-1]) / 2
    span = sorted([(way[0] + half) / 2, half + np.copysign(turn, half - way[0])])
    found = servo(limited({"shoulder_1": span}), **ends)
    assert (found.outcome, found.run_outcome.reason) == (BOUNDARY, "joint shoulder_1 is at its limit")
    assert angles(found.run, "shoulder_1")[-1] == pytest.approx(half, abs=1e-8)


def test_a_joint_that_starts_beyond_its_limit_hides_no_other():
    ends = {"start": "x=0.05,y=0.2", "goal": "x=-0.05,y=0.2"}
    free = servo("rrrrr_m1", **ends).run
    one, two = (angles(free, name) for name in ("shoulder_1", "shoulder_2"))
    half = (two[0] + two[-1]) / 2
    # the first joint starts beyond its limit by more than the second one comes beyond its own
    near = one[0] + 0.9 * (one[-1] - one[0])
    assert abs(near - one[0]) > abs(two[-1] - half)
    found = servo(
        limited(
            {
                "shoulder_1": sorted([near, near + one[-1] - one[0]]),
                "shoulder_2": sorted([half, half + two[0] - two[-1]]),
            }
        ),
        **ends,
    )
    assert (found.outcome, found.run_outcome.reason) == (BOUNDARY, "joint shoulder_2 is at its limit")
    assert angles(found.run, "shoulder_2")[-1] == pytest.approx(half, abs=1e-8)
    assert any("beyond the limits of shoulder_1" in each for each in found.notes)


@pytest.mark.slow
def test_a_noisy_run_that_meets_a_limit_is_over():
    """Noise of a degree leads a joint beyond a limit 0.004 rad past the goal; without it the run ends at the goal."""
    ends = {"start": "x=0.05,y=0.2", "goal": "x=-0.05,y=0.2"}
    way = angles(servo("rrrrr_m1", **ends).run, "shoulder_1")
    robot = limited({"shoulder_1": sorted([way[-1] + 0.004 * np.sign(way[-1] - way[0]), 3 * way[0] - 2 * way[-1]])})
    assert servo(robot, **ends).outcome == GOAL
    found = servo(robot, **ends, noise="1deg")
    assert (found.run.stopped, found.run.joint) == (LIMIT, "shoulder_1")
    assert (found.outcome, found.run_outcome.reason) == (BOUNDARY, "joint shoulder_1 is at its limit")
    assert found.spread is None


# ---- what is refused


REFUSED: list[tuple[str, Callable[[], object], type[Exception], str]] = [
    ("goal out of reach", lambda: servo(load("delta"), start="x=0", goal="x=9"), PoseReachFailure, "x=9"),
    ("start out of reach", lambda: servo(load("delta"), start="x=9", goal="x=0"), PoseReachFailure, "x=9"),
    ("too few legs", lambda: servo(load("delta"), "1", start="x=0", goal="x=0.1"), BadRequest, "do not determine"),
    ("unknown leg", lambda: servo(load("delta"), "7", start="x=0", goal="x=0.1"), BadRequest, "'7'"),
    ("no gain", lambda: servo(load("delta"), start="x=0", goal="x=0.1", gain=0.0), BadRequest, "gain"),
    ("wide cone", lambda: servo(load("delta"), start="x=0", goal="x=0.1", noise="90deg"), BadRequest, "90deg"),
    ("no cone", lambda: servo(load("delta"), start="x=0", goal="x=0.1", noise="0deg"), BadRequest, "more than 0"),
    ("pixels of directions", lambda: servo(load("delta"), start="x=0", goal="x=0.1", noise="1px"), BadRequest, "px"),
    (
        "edges as wide as pictures",
        lambda: servo(load("delta"), start="x=0", goal="x=0.1", sense="edges", noise="1e9px"),
        BadRequest,
        "50px",
    ),
    ("a bias of nothing", lambda: servo(load("delta"), start="x=0", goal="x=0.1", bias=True), BadRequest, "bias"),
    (
        "endless noise",
        lambda: servo(load("delta"), start="x=0,y=0,z=-0.6", goal="x=0.1,y=0,z=-0.6", noise="1deg", time=1e12),
        BadRequest,
        "at most 10000",
    ),
    (
        "endless physics",
        lambda: servo(load("delta"), start="x=0,y=0,z=-0.6", goal="x=0.1,y=0,z=-0.6", dynamics=True, gain=1e-9),
        BadRequest,
        "a larger --gain",
    ),
    ("no such sense", lambda: servo(load("delta"), start="x=0", goal="x=0.1", sense="touch"), BadRequest, "touch"),
]


@pytest.mark.some(5)
@pytest.mark.parametrize(("call", "error", "words"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_what_does_not_fit_is_refused_in_one_line(call: Callable[[], object], error: type[Exception], words: str):
    with pytest.raises(error, match=words) as raised:
        call()
    assert getattr(raised.value, "exit_status", None) == (3 if error is PoseReachFailure else 2)
    assert len(str(raised.value).splitlines()) == 1


def test_a_singular_pose_is_refused():
    z = -np.sqrt(0.825**2 - (0.296 + 0.38 - 0.102) ** 2)
    with pytest.raises(BadRequest, match="the start is a Type 2 singularity"):
        servo(load("quattro_rigid"), start=f"x=0,y=0,z={float(z)!r}", goal="x=0.1,y=0,z=-0.7")


@pytest.mark.parametrize("name", BLIND)
def test_robots_that_are_not_controllable_are_refused(name: str):
    found = setting(name)
    pose = found.motion.pose(found.motion.home)
    with pytest.raises(BadRequest, match="do not determine"):
        servo(load(name), start=pose, goal=pose)


def test_every_reached_pose_is_a_start():
    found = setting("delta")
    at = track_to_pose(
        found.all_samples.start, found.all_samples.observation_model, found.motion.pose(found.motion.home), found.motion
    )
    assert run_between("delta", at, at).outcome == GOAL


def test_a_run_whose_time_ends_tells_the_rest_it_is_on_its_way_to():
    """Near the goal ė = −λe: what is left falls by e every 1/λ. A longer run ends at the rest that is told."""
    asked = {"start": "x=0.01,y=0", "goal": "x=0,y=0", "gain": 0.5}
    short = servo("3rrr_m1", time=6.0, **asked)
    assert short.outcome == "time"
    assert short.run_outcome.reason.endswith(
        "; it was still approaching a stable equilibrium at the goal, with the time constant 2 s"
    )
    assert servo("3rrr_m1", **asked).outcome == "goal"
    far = servo("3rrr_m1", start="x=0.05,y=0", goal="x=0,y=0", time=1.0)
    assert "equilibrium" not in far.run_outcome.reason
