"""Reaching poses: the pose is the one asked for, the branch is kept, free parts are nearest, misses are named."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.pose_continuation import find_generic_motion, sweep, track_to_pose
from hrsynth.description import load
from hrsynth.errors import BadRequest, PoseReachFailure, SamplingFailure
from hrsynth.geometry.so3 import convert_rotations_to_vectors, turn_about
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.leg_reach import find_beyond_rods
from hrsynth.kinematics.platform_motion import PlatformMotion
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism.pose import Grid, Pose
from hrsynth.tolerances import CLOSURE_RESIDUAL_TOL
from kinematics.robots import ROBOTS, setting_of, state_of
from oracle import Oracle, exponential
from strategies import parallel_robots, planar, random_rotation, transformed

quick = settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def motion_of(setup: ObservedRobot) -> PlatformMotion:
    return PlatformMotion.of((m.configuration for m in setup.all_samples.members), setup.all_samples.observation_model)


def had(motion: PlatformMotion, X: Array) -> Pose:
    """The parts of a platform pose that the platform can change."""
    full = motion.pose(X)
    return replace(full, **{name: None for name in full.given if name not in motion.parts})


def check_reached(setup: ObservedRobot, motion: PlatformMotion, X: Array) -> ClosedConfiguration:
    all_samples = setup.all_samples
    at = track_to_pose(all_samples.start, all_samples.observation_model, had(motion, X), motion)
    assert at.residual <= CLOSURE_RESIDUAL_TOL
    found = at.pose(motion.link)
    assert np.linalg.norm(motion.position(found) - motion.position(X)) < 1e-9
    if motion.body:
        assert np.linalg.norm(found[:3, :3] - X[:3, :3]) < 1e-9
    oracle = Oracle(all_samples.model.mechanism)
    assert oracle.error(state_of(at.model, at.q)) < 1e-9
    return at


@pytest.mark.some(6)
@pytest.mark.parametrize("robot", ROBOTS)
def test_poses_of_samples_are_reached_again(robot: str) -> None:
    """The pose is that of the sample; one step away from zero, where no other working mode is near, so are the
    directions."""
    setup = setting_of(robot)
    motion = motion_of(setup)
    for member in setup.all_samples.members:
        check_reached(setup, motion, member.way[-1].pose)
        first = member.way[0]
        at = check_reached(setup, motion, first.pose)
        if member.relation.RI:
            continue  # observed links move while the platform rests: the pose does not tell their directions
        found = setup.all_samples.observation_model.target(at)
        for (_, value), (_, wanted) in zip(found.measured, first.measured, strict=True):
            np.testing.assert_allclose(value, wanted, atol=1e-8)


def check_printed(setup: ObservedRobot) -> None:
    motion, all_samples = motion_of(setup), setup.all_samples
    for member in setup.all_samples.members[:3]:
        printed = Pose.parse(str(motion.pose(member.way[0].pose)))
        at = track_to_pose(all_samples.start, all_samples.observation_model, printed, motion)
        apart = motion.position(at.pose(motion.link)) - motion.position(member.way[0].pose)
        assert np.linalg.norm(apart) < 1e-5 * max(1.0, float(np.abs(motion.position(motion.home)).max()))
        assert at.residual <= CLOSURE_RESIDUAL_TOL


@pytest.mark.some(12)
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_pose_can_be_typed_as_it_is_printed(robot: str) -> None:
    check_printed(setting_of(robot))


@pytest.mark.parametrize("robot", ["3rrr_m1", "rrrrr_m1", "delta", "3rps", "quattro"])
def test_a_pose_of_a_robot_that_stands_aslant_can_be_typed_as_it_is_printed(robot: str) -> None:
    rng = np.random.default_rng(7)
    check_printed(ObservedRobot.of(transformed(load(robot), random_rotation(rng), rng.normal(size=3)), samples=4))


@pytest.mark.parametrize(
    ("robot", "parts"),
    [
        ("delta", ("x", "y", "z")),
        ("quattro", ("x", "y", "z", "phi", "rpy")),
        ("3rrr_m1", ("x", "y", "phi", "rpy")),
        ("prrrp_parallel_point", ("x", "y")),
        ("gough_stewart", ("x", "y", "z", "phi", "rpy")),
        ("3upu", ("x", "y", "z")),
    ],
)
def test_what_a_platform_can_change(robot: str, parts: tuple[str, ...]) -> None:
    setup = setting_of(robot)
    all_samples = setup.all_samples
    assert (
        motion_of(setup).parts == find_generic_motion(all_samples.start, all_samples.observation_model).parts == parts
    )
    for name in {"x", "y", "z", "phi", "rpy"} - set(parts):
        pose = Pose(rpy=(0.1, 0, 0)) if name == "rpy" else Pose(**{name: 0.123})
        with pytest.raises(BadRequest, match=f"cannot change {name}") as caught:
            track_to_pose(all_samples.start, all_samples.observation_model, pose)
        assert caught.value.expected == ", ".join(parts)


def test_a_part_that_never_changes_may_be_given_as_it_is() -> None:
    """What is printed can be given back: z of a planar robot, the orientation of one that only translates."""
    for robot, text in (("3rrr_m1", "x=0.01,y=0.02,z=0,rpy=0/0/0.05"), ("delta", "x=0.05,y=0,z=-0.6,rpy=0/0/0")):
        all_samples = setting_of(robot).all_samples
        wanted = Pose.parse(text)
        at = track_to_pose(all_samples.start, all_samples.observation_model, wanted)
        X = at.pose(all_samples.observation_model.platform)
        assert np.allclose(X[:3, 3], [wanted.x, wanted.y, wanted.z], atol=1e-9)
        assert np.allclose(X[:3, :3], wanted.rotation, atol=1e-9)
    all_samples = setting_of("3rrr_m1").all_samples
    with pytest.raises(BadRequest, match="one axis only"):
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse("rpy=0.1/0/0"))


@pytest.mark.parametrize(
    ("robot", "text"),
    [
        ("gough_stewart", "x=0.05"),
        ("gough_stewart", "phi=20deg"),
        ("quattro", "x=0.2,y=-0.1"),
        ("delta", "z=-0.65"),
        ("3rrr_m1", "x=0.02"),
        ("rrrrr_m1", "y=0.27"),
        ("hexa", "rpy=0.1/0.05/0"),
    ],
)
def test_free_parts_are_nearest_to_zero(robot: str, text: str) -> None:
    """No configuration nearby with the same given parts lies nearer to the zero pose."""
    setup = setting_of(robot)
    all_samples, motion, pose = setup.all_samples, motion_of(setup), Pose.parse(text)
    at = track_to_pose(all_samples.start, all_samples.observation_model, pose, motion)
    goal, model = motion.goal(pose), at.model
    assert np.linalg.norm(goal.error_and_jacobian(model, at.q)[0]) < CLOSURE_RESIDUAL_TOL

    def distance(q: Array) -> float:
        X = model.pose(q, motion.link)
        shift = (motion.position(X) - motion.position(motion.home)) / model.length
        turn = convert_rotations_to_vectors(X[:3, :3] @ motion.home[:3, :3].T) if motion.body else np.zeros(3)
        return float(np.linalg.norm([*shift, *turn]))

    rng = np.random.default_rng(1)
    least, compared = distance(at.q), 0
    for _ in range(20):
        kernel, _ = at.kernel()
        q, residual = solve(model, model.integrate(at.q, 1e-2 * kernel @ rng.normal(size=kernel.shape[1])), goal)
        if residual <= CLOSURE_RESIDUAL_TOL:
            compared += 1
            assert distance(q) >= least - 1e-9
    assert compared > 10


def test_the_empty_pose_is_the_zero_configuration() -> None:
    all_samples = setting_of("3rrr_m1").all_samples
    at = track_to_pose(all_samples.start, all_samples.observation_model, Pose())
    np.testing.assert_allclose(at.q, all_samples.start.q, atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, -0.15]))
@quick
def test_phi_of_a_planar_robot_is_about_its_normal(seed: int, angle: float) -> None:
    mechanism = planar(["RRR", "RPR", "RRR"], np.random.default_rng(seed), [{0}, {0}, {0}])
    normal = next(joint.axis for joint in mechanism.joints.values() if joint.type.value == "R")
    setup = ObservedRobot.of(mechanism, samples=3)
    motion = motion_of(setup)
    assert abs(abs(normal @ motion.normal) - 1) < 1e-9
    assert motion.normal[np.argmax(np.abs(motion.normal))] > 0
    at = track_to_pose(setup.all_samples.start, setup.all_samples.observation_model, Pose(phi=angle), motion)
    turn = at.pose("platform")[:3, :3] @ motion.home[:3, :3].T
    np.testing.assert_allclose(turn, exponential(angle * motion.normal), atol=1e-9)


def test_the_manner_of_a_platform_is_what_it_never_changes() -> None:
    """A planar robot keeps to its plane and its normal; a shift or a tilt out of it is an error."""
    mechanism = planar(["RRR", "RPR", "RRR"], np.random.default_rng(5), [{0}, {0}, {0}])
    setup = ObservedRobot.of(mechanism, samples=3)
    motion, model = motion_of(setup), setup.all_samples.model
    manner = motion.manner()
    normal = next(joint.axis for joint in mechanism.joints.values() if joint.type.value == "R")
    np.testing.assert_allclose(np.abs(manner.directions @ normal), [1], atol=1e-9)
    for member in setup.all_samples.members:
        assert np.linalg.norm(manner.error_and_jacobian(model, member.configuration.q)[0]) < 1e-9
    shifted = replace(manner, values=manner.values + 0.1)
    assert np.linalg.norm(shifted.error_and_jacobian(model, model.q0)[0]) == pytest.approx(0.1 / model.length)
    tilted = replace(manner, zero=manner.zero @ exponential(np.array([0.1, -0.2, 0.15])))
    assert np.linalg.norm(tilted.error_and_jacobian(model, model.q0)[0]) > 0.05
    assert motion_of(setting_of("delta")).manner().rotation is not None
    assert len(motion_of(setting_of("gough_stewart")).manner().values) == 0


@given(parallel_robots())
@quick
def test_random_robots_reach_the_poses_of_their_samples(mechanism) -> None:
    setup = ObservedRobot.of(mechanism, samples=3)
    motion = motion_of(setup)
    for member in setup.all_samples.members:
        check_reached(setup, motion, member.way[0].pose)


@pytest.mark.some(6)
@pytest.mark.parametrize("robot", ROBOTS)
def test_what_rods_keep_away_is_not_reached(robot: str) -> None:
    """No pose that the robot takes is said to be beyond its rods; far away all are, where a chain has only centres."""
    setup = setting_of(robot)
    motion = motion_of(setup)
    poses = [motion.goal(had(motion, member.configuration.pose(motion.link))) for member in setup.all_samples.members]
    assert find_beyond_rods(setup.mechanism, motion, poses) == set()
    if robot in ("rrrrr_m1", "3rrr_m1", "delta", "quattro"):
        far = motion.goal(replace(had(motion, motion.home), x=9.0))
        assert find_beyond_rods(setup.mechanism, motion, [*poses, far]) == {len(poses)}


@pytest.mark.parametrize("seed", range(3))
def test_beyond_rods_is_beyond_the_circles_of_a_five_bar(seed: int) -> None:
    """Where its end is, two cranks and two rods tell by hand: both distances to the base joints."""
    rng = np.random.default_rng(seed)
    five = transformed(planar(["RRR", "RRR"], rng, [{0}, {0}], point=True), random_rotation(rng), rng.normal(size=3))
    setup = ObservedRobot.of(five)
    motion = motion_of(setup)
    joints = [[setup.mechanism.joints[name].point for name in leg.joints] for leg in setup.decomposition.legs]
    end = motion.position(motion.home)
    across = motion.translations @ rng.uniform(-1.5, 1.5, (motion.translations.shape[1], 200))
    goals = [replace(motion.at_home(), values=end + each, phi=None, rotation=None) for each in across.T]
    inside = np.ones(200, dtype=bool)
    for a, b, *_ in joints:
        crank, rod = np.linalg.norm(b - a), np.linalg.norm(end - b)
        far = np.linalg.norm(end + across.T - a, axis=1)
        inside &= (far <= crank + rod) & (far >= abs(crank - rod))
    assert find_beyond_rods(setup.mechanism, motion, goals) == set(np.flatnonzero(~inside))
    assert 0 < inside.sum() < 200


def test_the_turn_about_an_axis() -> None:
    """A turn about the axis itself is found whole, and its rate is the row times the angular velocity."""
    rng, h = np.random.default_rng(0), 1e-6
    for _ in range(30):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = rng.uniform(-3.1, 3.1)
        assert turn_about(axis, exponential(angle * axis))[0] == pytest.approx(angle, abs=1e-9)
        R, omega = exponential(rng.normal(size=3)), rng.normal(size=3)
        ahead, behind = (turn_about(axis, exponential(step * omega) @ R)[0] for step in (h, -h))
        assert turn_about(axis, R)[1] @ omega == pytest.approx((ahead - behind) / (2 * h), abs=1e-6)


FEET, CRANK, ROD = (np.array([-0.1, 0.0]), np.array([0.1, 0.0])), 0.16, 0.2
"""The dimensions of the five-bar robot: feet of its legs, lengths of cranks and rods."""


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("x", "y", "leg"), [(-0.2, 0.28, "2"), (0.9, 0.1, "1"), (0.2, 0.28, "1"), (0.02, 0.5, "1"), (-0.03, 0.6, "2")]
)
def test_the_leg_that_misses_is_named(x: float, y: float, leg: str) -> None:
    all_samples = setting_of("rrrrr_m1").all_samples
    misses = {label: np.linalg.norm([x, y] - foot) - (CRANK + ROD) for label, foot in zip("12", FEET, strict=True)}
    assert max(misses, key=misses.__getitem__) == leg
    with pytest.raises(PoseReachFailure) as caught:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose(x, y))
    error = caught.value
    assert error.leg == leg
    assert error.millimetres == pytest.approx(1e3 * misses[leg], rel=1e-4)
    # far away the lengths alone tell it
    assert ("at least" in str(error)) == (misses[leg] > CRANK + ROD)
    assert error.degrees < 1e-6
    assert 0 < error.came < 1
    assert error.exit_status == 3
    last = Pose.parse(error.last)
    assert max(np.linalg.norm([last.x, last.y] - foot) for foot in FEET) == pytest.approx(CRANK + ROD, abs=1e-3)


@pytest.mark.some(1)
@pytest.mark.parametrize(("x", "y", "z"), [(0.6, 0.1, -0.7), (0.02, 0.03, -0.3), (0, 0, -0.95), (-0.5, 0.3, -0.6)])
def test_the_miss_of_a_leg_whose_platform_only_translates(x: float, y: float, z: float) -> None:
    """The rod's two ends: the elbow somewhere on its circle, the tip carried along without a turn."""
    setup = setting_of("delta")
    mechanism, misses = setup.mechanism, {}
    for leg in setup.decomposition.legs:
        joints = [mechanism.joints[name] for name in leg.joints]
        (shoulder,) = (joint for joint in joints if mechanism.base in joint.links)
        elbow = np.mean([joint.point for joint in joints if shoulder.successor == joint.predecessor], axis=0)
        tip = np.mean([joint.point for joint in joints if mechanism.platform in joint.links], axis=0)
        wanted = tip + [x, y, z] - mechanism.links[mechanism.platform].pose[:3, 3]
        circle = [
            shoulder.point + exponential(a * shoulder.axis) @ (elbow - shoulder.point)
            for a in np.linspace(0, 2 * np.pi, 4001)
        ]
        distances, rod = np.linalg.norm(np.array(circle) - wanted, axis=1), np.linalg.norm(tip - elbow)
        misses[leg.label] = max(distances.min() - rod, rod - distances.max(), 0.0)
    with pytest.raises(PoseReachFailure) as caught:
        track_to_pose(setup.all_samples.start, setup.all_samples.observation_model, Pose(x, y, z))
    assert caught.value.degrees < 1e-6
    assert caught.value.millimetres == pytest.approx(1e3 * max(misses.values()), rel=1e-4)
    assert misses[caught.value.leg] == pytest.approx(max(misses.values()), rel=1e-4)


def test_a_pose_that_each_leg_alone_can_take() -> None:
    """The planes of the three legs together keep a level platform from turning about z; one plane alone does not."""
    all_samples = setting_of("3rps").all_samples
    with pytest.raises(PoseReachFailure) as caught:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose(z=0.4, phi=0.02))
    assert caught.value.leg is None
    assert "each leg alone can close there" in str(caught.value)
    assert 0 <= caught.value.came < 1


def bend(at: ClosedConfiguration, leg: str) -> float:
    """The sine of the angle from crank to rod: its sign is the working mode of a leg."""
    joints = at.model.mechanism.joints
    foot, elbow = joints[f"shoulder_{leg}"].point, at.pose(f"dist_{leg}")[:2, 3]
    tip = at.pose("dist_1")[:2, 3]
    elbow = (
        at.pose(f"prox_{leg}")
        @ np.linalg.inv(at.model.mechanism.links[f"prox_{leg}"].pose)
        @ np.append(joints[f"elbow_{leg}"].point, 1)
    )[:2]
    a, b = elbow - foot[:2], tip - elbow
    return float((a[0] * b[1] - a[1] * b[0]) / (CRANK * ROD))


def test_a_sweep_covers_the_workspace_in_one_working_mode() -> None:
    """What is reached lies within both rings; what is not has a neighbour out of them or lies on the rings' edge; no
    leg passes its stretched or folded position."""
    all_samples = setting_of("rrrrr_m1").all_samples
    start = all_samples.start
    np.testing.assert_allclose(motion_of(setting_of("rrrrr_m1")).position(start.pose("dist_1"))[:2], [0.02, 0.24])
    grid = Grid.parse("x=-0.3:0.3:17,y=0.06:0.4:11")
    found = sweep(start, all_samples.observation_model, grid)
    assert len(found) == 17 * 11
    signs = [np.sign(bend(start, leg)) for leg in "12"]
    reached = 0
    for pose, at in zip(grid.poses(), found, strict=True):
        radii = [np.linalg.norm([pose.x, pose.y] - foot) for foot in FEET]
        assert (at is not None) == all(ROD - CRANK < radius < CRANK + ROD for radius in radii), pose
        if at is not None:
            reached += 1
            np.testing.assert_allclose(at.pose("dist_1")[:2, 3], [pose.x, pose.y], atol=1e-9)
            assert [np.sign(bend(at, leg)) for leg in "12"] == signs
    assert 60 < reached < 120


def test_a_way_that_touches_a_fold_does_not_pass_it() -> None:
    """The column x = -0.06 touches the circle on which the first leg is folded; smooth motion would unfold it."""
    all_samples = setting_of("rrrrr_m1").all_samples
    signs = [np.sign(bend(all_samples.start, leg)) for leg in "12"]
    found = sweep(all_samples.start, all_samples.observation_model, Grid.parse("x=-0.08:-0.04:3,y=-0.05:0.2:15"))
    assert sum(at is not None for at in found) > 25
    for at in found:
        assert at is None or [np.sign(bend(at, leg)) for leg in "12"] == signs


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("length", [1.1, 1.25, 1.3, 1.45])
def test_a_straight_way_that_touches_a_fold_does_not_pass_it(length: float, side: int) -> None:
    """The way from zero touches the circle on which the first leg is folded and goes on: the elbow came to the other
    side in a step that ended on the fold, beyond it by rounding."""
    all_samples = setting_of("rrrrr_m1").all_samples
    home, least = np.array([0.02, 0.24]), ROD - CRANK
    far = np.linalg.norm(home - FEET[0])
    turned = exponential(side * np.arcsin(least / far) * np.array([0.0, 0.0, 1.0]))[:2, :2]
    x, y = home + length * np.sqrt(far**2 - least**2) / far * turned @ (FEET[0] - home)
    with pytest.raises(PoseReachFailure) as refused:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose(float(x), float(y)))
    assert refused.value.came == pytest.approx(1 / length, abs=1e-2)


@pytest.mark.slow
def test_nothing_is_reached_from_a_pose_on_a_fold() -> None:
    """At x=±0.06, y=0 a rod lies along its crank, 0.04 m from the base joint, to the last digit: the sweep came to it
    and went on with the elbow on the other side."""
    all_samples = ObservedRobot.of("rrrrr_m1").all_samples
    found = sweep(all_samples.start, all_samples.observation_model, Grid.parse("x=-0.12:0.12:9,y=-0.12:0.06:13"))
    bends = np.array([[bend(at, leg) for leg in "12"] for at in found if at is not None])
    usual = [bend(all_samples.start, leg) for leg in "12"]
    folded = np.abs(bends) < 1e-4 * np.abs(usual)
    assert folded.any(axis=0).all()
    assert np.all(folded | (np.sign(bends) == np.sign(usual)))


def test_a_sweep_finds_what_single_poses_find() -> None:
    all_samples = setting_of("delta").all_samples
    grid = Grid.parse("x=-0.2:0.2:5,y=-0.2:0.2:4,z=-0.6")
    found = sweep(all_samples.start, all_samples.observation_model, grid)
    for pose, at in zip(grid.poses(), found, strict=True):
        alone = track_to_pose(all_samples.start, all_samples.observation_model, pose)
        assert at is not None
        for link in at.model.mechanism.links:
            if link.startswith("arm"):
                np.testing.assert_allclose(at.pose(link), alone.pose(link), atol=1e-8)


def test_a_grid_out_of_reach_is_empty() -> None:
    all_samples = setting_of("rrrrr_m1").all_samples
    assert set(sweep(all_samples.start, all_samples.observation_model, Grid.parse("x=2:3:3,y=2:3:3"))) == {None}


@pytest.mark.parametrize("degrees", [108, 110, 115])
def test_on_the_edge_of_the_workspace_a_leg_is_stretched(degrees: float) -> None:
    all_samples = setting_of("rrrrr_m1").all_samples
    x, y = FEET[1] + (CRANK + ROD) * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    at = track_to_pose(all_samples.start, all_samples.observation_model, Pose(float(x), float(y)))
    assert abs(bend(at, "2")) < 1e-9
    assert abs(bend(at, "1")) > 0.1


def test_parts_that_depend_on_each_other_are_said_to() -> None:
    """Roll and pitch of the 3-RPS decide its yaw: half of tan ψ is known from the planes of its legs (M. Z. Huang,
    1987); the nearest pose that is told is one of these, and can be asked for."""
    setup = setting_of("3rps")
    all_samples = setup.all_samples
    words = "has 3 dof, and at zero and at a random configuration parts of this pose depend on each other"
    with pytest.raises(PoseReachFailure, match=words) as refused:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse("z=0.32,rpy=0.1/0.05/0"))
    assert "blocked" not in str(refused.value)
    near = track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse(refused.value.last))
    R = near.pose(motion_of(setup).link)[:3, :3] @ motion_of(setup).home[:3, :3].T
    assert abs(R[0, 1] - R[1, 0]) < 1e-6


def test_a_grid_goes_on_where_the_nearest_pose_is_a_dead_end() -> None:
    """Level, the 3-RPS does not move its point sideways to first order; tilted by θ about one axis it is off by half
    its radius times 1 - cos θ (Huang), so poses aside are there: each is met alone, and by a grid about the level one.
    """
    all_samples, motion = setting_of("3rps").all_samples, motion_of(setting_of("3rps"))
    found = sweep(all_samples.start, all_samples.observation_model, Grid.parse("x=-0.1:0.1:3,y=0,z=0.9"))
    for x, at in zip((-0.1, 0.0, 0.1), found, strict=True):
        assert at is not None
        X = at.pose(motion.link)
        np.testing.assert_allclose(motion.position(X), [x, 0, 0.9], atol=1e-9)
        R = X[:3, :3] @ motion.home[:3, :3].T
        assert abs(R[0, 1] - R[1, 0]) < 1e-6
        assert abs(0.5 * 0.15 * (R[0, 0] - R[1, 1]) - x) < 1e-6


def test_one_part_does_not_depend_on_itself() -> None:
    """Huang: a 3-RPS does not turn about its normal at all."""
    all_samples = setting_of("3rps").all_samples
    with pytest.raises(PoseReachFailure, match="at a random configuration none of them changes this part") as refused:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse("phi=0.02"))
    assert "depend on each other" not in str(refused.value)


@pytest.mark.parametrize(("robot", "pose"), [("3rps", "x=0.5"), ("3rps", "x=0.5,z=0.8"), ("3rrp", "x=2")])
def test_what_is_too_far_does_not_depend(robot: str, pose: str) -> None:
    """The point of the 3-RPS is never more than its radius aside (Huang), whatever depends to first order at zero."""
    all_samples = setting_of(robot).all_samples
    with pytest.raises(PoseReachFailure, match="each leg alone can close there") as refused:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse(pose))
    assert "depend" not in str(refused.value)
    assert "changes this part" not in str(refused.value)


def test_a_leg_without_a_way_to_a_pose_is_tried_all_the_same() -> None:
    """Where a leg's Jacobian has no full rank and the damping has gone to nearly nothing."""
    all_samples = setting_of("3rps").all_samples
    with pytest.raises(PoseReachFailure):
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse("y=0.5,phi=0.05"))


def test_a_constraint_singularity_on_the_way_is_told() -> None:
    """The loops of the 3-UPU lose rank 0.36 m aside at this height; what is not reached is not 100 % of the way."""
    all_samples = setting_of("3upu").all_samples
    with pytest.raises(PoseReachFailure, match="the loops lose rank") as refused:
        track_to_pose(
            all_samples.start, all_samples.observation_model, Pose.parse("x=0.18,y=0.31176914536239791,z=1.2")
        )
    assert "more than 99.9 % of the path" in str(refused.value)
    assert "100 %" not in str(refused.value)


def test_a_pose_is_not_reached_though_no_walk_leads_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether parts depend on each other elsewhere is then not known, and not said."""

    def none(start: ClosedConfiguration, count: int, *, steps: int) -> Iterator[ClosedConfiguration]:
        raise SamplingFailure("", 0, count, 10)
        yield start

    setup = setting_of("3rps")
    all_samples, motion = setup.all_samples, motion_of(setup)
    monkeypatch.setattr("hrsynth.batch.pose_continuation.walk_randomly", none)
    with pytest.raises(PoseReachFailure) as refused:
        track_to_pose(all_samples.start, all_samples.observation_model, Pose.parse("phi=0.02"), motion)
    assert "random configuration" not in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("angles", ["-0.3:0.3:4", "-0.3:0.3:7", "0.1:0.3:3"])
def test_a_turn_that_two_others_make_together_is_reached(angles: str, tmp_path: Path) -> None:
    """Turned by a about x and then by b about y, a stem has turned about z by φ, tan(φ/2) = tan(a/2) tan(b/2), and no
    turn about x or y changes φ at zero; the least turns are equal or opposite."""
    file = tmp_path / "stem.urdf"
    hinges = "".join(
        f'<joint name="{name}" type="continuous"><parent link="{before}"/><child link="{after}"/>'
        f'<axis xyz="{axis}"/></joint>'
        for name, before, after, axis in (("a", "base", "cross", "1 0 0"), ("b", "cross", "stem", "0 1 0"))
    )
    file.write_text(
        '<robot name="stem"><link name="base"/><link name="cross"/><link name="stem"/>'
        + hinges
        + '<hrsynth serial="true"><platform link="stem"/>'
        '<observe kind="direction" link="stem" axis="1 2 3"/></hrsynth></robot>'
    )
    all_samples = ObservedRobot.of(str(file)).all_samples
    grid = Grid.parse(f"phi={angles}")
    for pose, at in zip(grid.poses(), sweep(all_samples.start, all_samples.observation_model, grid), strict=True):
        assert at is not None
        assert pose.phi is not None
        assert turn_about(np.array([0.0, 0.0, 1.0]), at.pose("stem")[:3, :3])[0] == pytest.approx(pose.phi, abs=1e-9)
        alone = track_to_pose(all_samples.start, all_samples.observation_model, pose).pose("stem")[:3, :3]
        least = 2 * np.arctan(np.sqrt(np.tan(abs(pose.phi) / 2)))
        for R in (at.pose("stem")[:3, :3], alone):
            np.testing.assert_allclose(
                np.abs([np.arctan2(R[2, 1], R[1, 1]), np.arctan2(R[0, 2], R[0, 0])]), least, atol=1e-4
            )
