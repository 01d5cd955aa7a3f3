"""The Pinocchio twin and the oracle, which shares nothing with it, agree: closure, mobility, relation, derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from hrsynth.description import load
from hrsynth.errors import BadMechanism
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.velocity_relation import ObservationModel, compute_relation
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Joint, JointType, Mechanism, Motor
from kinematics.robots import ROBOTS, seen_by_oracle, setting_of, state_of, walked
from oracle import Oracle, same_relation
from strategies import deltas, planar, pods, random_direction, random_normal, random_rotation, recut, transformed

AGREE = 1e-9

CYCLES = {
    "R": "RRRRRRR",
    "P": "PPPP",
    "U": "UUUU",
    "C": "CCCC",
    "E": "ERUUR",
    "S": "SRSR",
    "F": "RRRRRRR",
}
"""Joints of one loop whose last one to be cut is of each type."""


def cycle(letters: str, rng: np.random.Generator, welded: bool = False) -> Mechanism:
    """A loop of joints in general position; ``welded``: one of its links is three links in a triangle of welds."""
    builder = Builder("loop_" + letters)
    builder.link("base")
    names = ["base"]
    for number in range(1, len(letters)):
        names.append(f"link_{number}")
        builder.link(names[-1], rng.normal(size=3), random_rotation(rng))
    ends = [*names, "base"]
    starts = list(names)
    if welded:
        for extra in ("half", "third"):
            builder.link(extra, rng.normal(size=3), random_rotation(rng))
        builder.joint("weld_1", "F", "link_3", "half")
        builder.joint("weld_2", "F", "half", "third")
        builder.joint("weld_3", "F", "link_3", "third", loop=True)
        starts[3] = "third"
    for number, letter in enumerate(letters):
        first = random_direction(rng)
        axis = first if JointType(letter).axes else None
        axis2 = random_normal(rng, first) if letter == "U" else None
        builder.joint(
            f"joint_{number}",
            letter,
            starts[number],
            ends[number + 1],
            0.7 * rng.normal(size=3),
            axis=axis,
            axis2=axis2,
            loop=number == len(letters) - 1,
        )
    for leg, link in enumerate((names[1], names[-1]), 1):
        builder.observe(str(leg), link, random_direction(rng))
    return builder.build(platform=names[2])


def agrees(at: ClosedConfiguration, observation_model: ObservationModel) -> None:
    """Closure, mobility and relation are the same for the twin and for the oracle at one configuration."""
    oracle = Oracle(at.model.mechanism)
    state = state_of(at.model, at.q)
    assert oracle.error(state) < AGREE
    kernel, rank = at.kernel()
    assert rank.gap > 1e3
    assert oracle.mobility(state) == kernel.shape[1]
    ours = compute_relation(at, observation_model)
    assert ours.mobility == kernel.shape[1]
    theirs = seen_by_oracle(oracle, state, observation_model, at.model.length)
    assert same_relation(ours.basis, theirs) < AGREE
    values = [o.value(at.pose(observation_model.reference), at.pose(o.link)) for o in observation_model.observations]
    np.testing.assert_allclose(
        np.reshape(values, (-1, 3)), oracle.directions(state, observation_model.observations), atol=1e-12
    )


def question_of(mechanism: Mechanism) -> ObservationModel:
    return ObservationModel(mechanism.platform, None, mechanism.reference, mechanism.observations)


@pytest.mark.some(17)
@pytest.mark.parametrize("robot", ROBOTS)
def test_twin_and_oracle_agree_on_every_robot(robot: str) -> None:
    all_samples = setting_of(robot).all_samples
    agrees(all_samples.start, all_samples.observation_model)
    for member in all_samples.members:
        assert np.linalg.norm(all_samples.model.residual(member.configuration.q)) < 1e-10
        assert np.max(np.abs(member.configuration.q - all_samples.start.q)) > 0.01
        agrees(member.configuration, all_samples.observation_model)


@pytest.mark.parametrize("camera", ["platform", "arm_2"])
def test_twin_and_oracle_agree_with_a_carried_camera(camera: str) -> None:
    all_samples = setting_of("delta", None, camera).all_samples
    assert all_samples.observation_model.reference == camera
    for member in all_samples.members:
        agrees(member.configuration, all_samples.observation_model)


@pytest.mark.parametrize("letter", CYCLES)
@pytest.mark.parametrize("seed", [1, 2])
def test_every_type_of_loop(letter: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mechanism = cycle(CYCLES[letter], rng, welded=letter == "F")
    model = PinocchioModel(mechanism)
    assert letter in {joint.type.value for joint in model.spanned[1]}
    assert set(model.loops) <= set(mechanism.joints)
    assert np.linalg.norm(model.residual(model.q0)) < 1e-12
    agrees(ClosedConfiguration.of(model, model.q0), question_of(mechanism))
    agrees(walked(model, seed), question_of(mechanism))


def constrained(robot_model: PinocchioModel, q: Array) -> tuple[Array, Array]:
    """The loops' errors and Jacobian by Pinocchio's own constraints, between the frames that the twin has for them."""
    model, data = robot_model.model, robot_model.model.createData()
    constraints, datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
    for number, joint in enumerate(robot_model.spanned[1]):
        near, far = model.frames[2 * number + 1], model.frames[2 * number + 2]
        kind = pin.PointAnchorConstraintModel if joint.type is JointType.SPHERICAL else pin.FrameAnchorConstraintModel
        constraints.append(
            pin.ConstraintModel(kind(model, near.parentJoint, near.placement, far.parentJoint, far.placement))
        )
        datas.append(constraints[number].createData())
    pin.computeJointJacobians(model, data, q)
    for constraint, each in zip(constraints, datas, strict=True):
        constraint.calc(model, data, each)
    errors = [each.extract().constraint_position_error.copy() for each in datas]
    return np.concatenate(errors), pin.getConstraintsJacobian(model, data, constraints, datas)


@pytest.mark.parametrize("letter", [*CYCLES, "quattro"])
def test_loops_are_the_constraints_of_pinocchio(letter: str) -> None:
    """At any configuration, far from closure too, and whichever of two twins was asked last; as do many at once."""
    rng = np.random.default_rng(3)
    twins = [
        setting_of(letter).all_samples.model
        if letter in ROBOTS
        else PinocchioModel(cycle(CYCLES[letter], rng, welded=letter == "F"))
        for _ in range(2)
    ]
    twins[1] = PinocchioModel(twins[1].mechanism, 0.3)
    for size in (0.0, 0.01, 0.3, 1.0):
        places = [model.integrate(model.q0, size * rng.normal(size=model.nv)) for model in twins]
        for model, q in zip(twins, places, strict=True):
            model.at(q)
        for model, q in zip(twins, places, strict=True):
            errors, J = constrained(model, q)
            assert np.any(J)
            assert size == 0.0 or np.linalg.norm(errors) > 1e-3
            np.testing.assert_allclose(model.residual(q), errors, rtol=0, atol=1e-12)
            np.testing.assert_allclose(model.jacobian(q), J, rtol=0, atol=1e-12)
            several = model.states([model.q0, q], (model.mechanism.platform,))
            np.testing.assert_array_equal(several[0][1], model.residual(q))
            np.testing.assert_array_equal(several[1][1], model.jacobian(q))
            np.testing.assert_array_equal(several[2][1, 0], model.poses(q, (model.mechanism.platform,))[0])
            np.testing.assert_allclose(several[2][1, 0], model.pose(q, model.mechanism.platform), rtol=0, atol=1e-14)


@pytest.mark.parametrize("letters", ["RRRRRRR", "UUUU", "CCCC", "ERUUR", "SRSR", "UPSR", "CRSP"])
def test_mobility_of_a_loop_is_its_freedoms_less_six(letters: str) -> None:
    model = PinocchioModel(cycle(letters, np.random.default_rng(5)))
    assert walked(model).kernel()[0].shape[1] == sum(JointType(each).freedoms for each in letters) - 6


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["planar", "pods", "deltas"])
def test_random_robots_in_any_cut(kind: str, seed: int) -> None:
    """Which joints a file writes as loops, and where the robot stands, change neither mobility nor agreement."""
    rng = np.random.default_rng(seed)
    robot = (
        planar(["RRR", "RPR", "PRR"], rng, [{0}, {1}, {0}])
        if kind == "planar"
        else pods(["UPS", "RPS", "UPS"], rng)
        if kind == "pods"
        else deltas(["R", "P", "R"], ["2-SS", "US", "SS"], rng, seed == 0)
    )
    mobilities = set()
    for each in (robot, recut(robot, rng), transformed(robot, random_rotation(rng), rng.normal(size=3))):
        model = PinocchioModel(each)
        at = walked(model, seed, size=0.05)
        agrees(at, question_of(each))
        mobilities.add(at.kernel()[0].shape[1])
    assert len(mobilities) == 1


def central(values: Array, others: Array, h: float) -> Array:
    return (values - others) / (2 * h)


@pytest.mark.parametrize("robot", ["delta", "quattro", "3upu", "3rrr_m1", "prrrp_parallel_point", "i4l", "3rps"])
def test_derivatives_of_residual_pose_and_target(robot: str) -> None:
    """Jacobians are what finite differences give: the loops' at closure, poses and targets at any configuration."""
    all_samples = setting_of(robot).all_samples
    model, observation_model = all_samples.model, all_samples.observation_model
    at = all_samples.members[0].configuration
    h = 1e-6
    J, V = model.jacobian(at.q), at.velocity(observation_model.platform)
    target = observation_model.target(at)
    _, rows = target.error_and_jacobian(model, at.q)
    assert J.shape == (model.residual(at.q).size, model.nv)
    for column in range(model.nv):
        step = np.zeros(model.nv)
        step[column] = h
        up, down = model.integrate(at.q, step), model.integrate(at.q, -step)
        np.testing.assert_allclose(central(model.residual(up), model.residual(down), h), J[:, column], atol=1e-8)
        np.testing.assert_allclose(
            central(target.error_and_jacobian(model, up)[0], target.error_and_jacobian(model, down)[0], h),
            rows[:, column],
            atol=1e-8,
        )
        X, Y = model.pose(up, observation_model.platform), model.pose(down, observation_model.platform)
        np.testing.assert_allclose(central(X[:3, 3], Y[:3, 3], h) / model.length, V[:3, column], atol=1e-8)
        spin = central(X[:3, :3], Y[:3, :3], h) @ at.pose(observation_model.platform)[:3, :3].T
        np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], V[3:, column], atol=1e-8)


def test_length_only_scales() -> None:
    """A twin in other units of length has the same poses, and the same relation once the unit is the same."""
    all_samples = setting_of("delta").all_samples
    mechanism, observation_model = all_samples.model.mechanism, all_samples.observation_model
    other = PinocchioModel(mechanism, 3 * mechanism.length)
    at = ClosedConfiguration.of(other, other.q0)
    np.testing.assert_allclose(at.pose("platform"), all_samples.start.pose("platform"), atol=1e-14)
    basis = seen_by_oracle(Oracle(mechanism), state_of(other, other.q0), observation_model, 3 * mechanism.length)
    assert same_relation(compute_relation(at, observation_model).basis, basis) < AGREE
    assert same_relation(compute_relation(all_samples.start, observation_model).basis, basis) > 0.1


def test_a_motor_on_a_floating_joint_that_others_hold_is_refused() -> None:
    robot = cycle("RRRR", np.random.default_rng(0))
    free = robot.changed(joints=[Joint("free", JointType.FREE, "base", "link_2", np.zeros(3))])
    assert PinocchioModel(free).model.nv == PinocchioModel(robot).model.nv
    with pytest.raises(BadMechanism, match="a motor on a floating joint whose link other joints hold: got 'free'"):
        PinocchioModel(free.changed(joints=[replace(free.joints["free"], motor=Motor("m"))]))


def test_actuated_coordinates_are_those_of_the_motors() -> None:
    model = setting_of("quattro").all_samples.model
    names = [joint.name for joint in model.mechanism.joints.values() if joint.is_actuated]
    assert len(names) == 4
    assert model.actuated_indices() == [i for name in names for i in model.coordinates[name]]
    assert len(set(model.actuated_indices())) == 4


def test_of_two_floating_joints_the_same_is_idle_with_gears() -> None:
    """Which of two floating joints holds two links that a hinge joins is said once, whatever gears weigh."""
    b = Builder("two floats")
    for link in ("base", "wheel", "one", "other"):
        b.link(link)
    b.joint("wheel", "R", "base", "wheel", axis=(0, 0, 1))
    b.joint("first", "6", "base", "one")
    b.joint("hinge", "R", "one", "other", axis=(0, 0, 1))
    b.joint("second", "6", "base", "other")
    b.coupling("gear", "wheel", "hinge", 2.0)
    robot = b.build("other")
    (idle,) = robot.idle
    for name in ("first", "second"):
        driven = robot.changed(joints=[replace(robot.joints[name], motor=Motor("m"))])
        if name == idle:
            with pytest.raises(BadMechanism, match=f"got '{name}'"):
                PinocchioModel(driven)
        else:
            assert PinocchioModel(driven).mechanism.joints[name].is_actuated


def test_motors_on_a_ball_at_which_a_loop_is_cut_hold_both_links_together() -> None:
    robot = load("gough_stewart", motors=["wrist_2", "wrist_5"])
    model = PinocchioModel(robot)
    at = ClosedConfiguration.of(model, model.q0)
    free, _ = at.kernel()
    turns = np.vstack([(at.velocity("platform") - at.velocity(rod))[3:] @ free for rod in ("rod_2", "rod_5")])
    driven = free[model.actuated_indices()]
    assert len(driven) == 6
    ranks = [np.linalg.matrix_rank(rows, tol=AGREE) for rows in (driven, turns, np.vstack((driven, turns)))]
    assert ranks[0] == ranks[1] == ranks[2] >= 3


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ROBOTS)
def test_whole_turns_are_removed_and_nothing_moves(name: str):
    model = setting_of(name).all_samples.model
    q = model.integrate(model.q0, np.random.default_rng(5).uniform(-20, 20, model.nv))
    bare = model.remove_turns(q)
    for link in model.mechanism.links:
        assert np.allclose(model.pose(q, link), model.pose(bare, link), atol=1e-9)
    step = model.difference(model.q0, bare)
    turned = [joint for joint in model.mechanism.joints.values() if joint.type in "RU" and joint.in_tree]
    assert all(abs(step[list(model.coordinates[joint.name])]).max() <= np.pi for joint in turned)
