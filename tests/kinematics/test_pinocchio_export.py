"""What Pinocchio is given closes, moves and weighs as the robot does: against the twin, against Pinocchio's own reader
of the file's tree, and against MuJoCo, which reads what this project writes for it."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hrsynth
from description.foreign.test_models import FIGURES, MODELS, model
from hrsynth.description.contents import Inertial, collect_content, write_fragments
from hrsynth.geometry.so3 import convert_rotations_to_vectors
from hrsynth.geometry.vectors import Array, build_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import set_zero
from hrsynth.kinematics.pinocchio_export import PinocchioExport
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import Coupling, JointType, Limits, Mechanism
from hrsynth.mechanism.builder import Builder
from kinematics.robots import ROBOTS, walked
from kinematics.test_twin import CYCLES, cycle
from strategies import random_rotation

AGREE = 1e-9
TORQUES = 1e-6
ROWS = 1e-8
"""Part of the largest singular value below which rows depend on others."""


GRAVITY = np.array([2.0, -3.0, -9.0])
"""So turned that robots in a horizontal plane carry something too (m/s²)."""


def robot_named(name: str) -> Mechanism:
    return model(name) if name in FIGURES else hrsynth.load(name)


def kernel(J: Array) -> Array:
    """A basis of what the rows leave free, (nv, freedoms)."""
    values, V = np.linalg.svd(J)[1:] if len(J) else (np.zeros(0), np.eye(J.shape[1]))
    return V[int(np.sum(values > ROWS * values.max(initial=0.0))) :].T


class Pinned:
    """An export, asked by means of Pinocchio alone."""

    def __init__(self, export: PinocchioExport) -> None:
        self.export, self.model = export, export.model
        self.data = self.model.createData()
        self.own = [each.createData() for each in export.constraint_models]
        self.links = {each.name: i for i, each in enumerate(self.model.frames) if each.type == pin.FrameType.BODY}

    def constraints(self, q: Array) -> tuple[Array, Array]:
        """What the loops and gears miss, and the derivative of that."""
        model, data, loops = self.model, self.data, self.export.constraint_models
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        missed = [self.export.couplings @ pin.difference(model, self.export.q0, q)]
        for each, own in zip(loops, self.own, strict=True):
            each.calc(model, data, own)
            ball = each.type == pin.ContactType.CONTACT_3D
            missed.append(own.c1Mc2.translation if ball else pin.log6(own.c1Mc2).vector)
        J = -pin.getConstraintsJacobian(model, data, loops, self.own) if loops else np.zeros((0, model.nv))
        return np.concatenate(missed), np.vstack([self.export.couplings, J])

    def twists(self, q: Array, links: list[str]) -> Array:
        """The Jacobians of the links' origins, base axes, (6 links, nv)."""
        axes = pin.LOCAL_WORLD_ALIGNED
        return np.vstack([pin.computeFrameJacobian(self.model, self.data, q, self.links[link], axes) for link in links])

    def reach(self, q: Array, poses: dict[str, Array]) -> Array:
        """The configuration near q at which the loops are closed and the links have these poses."""
        for _ in range(30):
            missed, J = self.constraints(q)
            X = {link: self.data.oMf[i].homogeneous for link, i in self.links.items()}
            step = np.linalg.lstsq(
                np.vstack([J, self.twists(q, list(poses))]), np.concatenate([-missed, *apart(X, poses)]), rcond=ROWS
            )[0]
            q = pin.integrate(self.model, q, step)
            if np.abs(step).max(initial=0.0) < 1e-13:
                break
        return q


def apart(X: dict[str, Array], poses: dict[str, Array]) -> list[Array]:
    """The twist from where each link is to where it should be."""
    return [
        np.concatenate(
            [wanted[:3, 3] - X[link][:3, 3], convert_rotations_to_vectors(wanted[:3, :3] @ X[link][:3, :3].T)]
        )
        for link, wanted in poses.items()
    ]


def check_closed(robot: Mechanism, steps: int = 4) -> None:
    """The zero configuration and some others, on a walk from there, are those of the twin."""
    model, pinned = PinocchioModel(robot), Pinned(robot.to_pinocchio())
    start, q = ClosedConfiguration.of(model, model.q0), pinned.export.q0
    assert set(pinned.links) == set(robot.links)
    assert pinned.export.closures == tuple(each.name for each in pinned.export.constraint_models)
    for at in (start, *walk_randomly(start, steps, steps=steps)):
        poses = {link: at.pose(link) for link in robot.links}
        q = q if at is start else pinned.reach(q, poses)
        missed, J = pinned.constraints(q)
        assert np.abs(missed).max(initial=0.0) < AGREE
        assert kernel(J).shape[1] == at.kernel()[0].shape[1]
        for link, wanted in poses.items():
            np.testing.assert_allclose(pinned.data.oMf[pinned.links[link]].homogeneous, wanted, atol=AGREE)


@pytest.mark.some(5)
@pytest.mark.parametrize("name", [*ROBOTS, *FIGURES])
def test_it_closes_and_moves_as_the_robot(name: str):
    check_closed(robot_named(name))


@pytest.mark.parametrize("letter", CYCLES)
def test_loops_of_every_type(letter: str):
    robot = cycle(CYCLES[letter], np.random.default_rng(3), welded=letter == "F")
    check_closed(robot, steps=2)
    check_closed(set_zero(walked(PinocchioModel(robot), seed=1)), steps=2)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", [*ROBOTS, *(name for name in FIGURES if name.endswith(".urdf"))])
def test_coordinates_are_those_of_the_file(name: str):
    """Joints by joints of the tree that Pinocchio reads: placements, names, sense; balls at rest, which a file says as
    three joints."""
    robot = robot_named(name)
    export, theirs = robot.to_pinocchio(), pin.buildModelFromUrdf(str(hrsynth.list_robots().get(name, MODELS / name)))
    rng, q, their_q = np.random.default_rng(0), export.q0.copy(), pin.neutral(theirs)
    for joint in export.model.joints[1:]:
        if joint.nq == 1 and theirs.existJointName(export.model.names[joint.id]):
            value = rng.uniform(-2, 2)
            q[joint.idx_q] = value
            model = theirs.joints[theirs.getJointId(export.model.names[joint.id])]
            their_q[model.idx_q : model.idx_q + model.nq] = value if model.nq == 1 else [np.cos(value), np.sin(value)]
    data, their_data = export.model.createData(), theirs.createData()
    pin.framesForwardKinematics(export.model, data, q)
    pin.framesForwardKinematics(theirs, their_data, their_q)
    for link in robot.links:
        mine, other = (
            d.oMf[m.getFrameId(link, pin.FrameType.BODY)] for m, d in ((export.model, data), (theirs, their_data))
        )
        np.testing.assert_allclose(mine.homogeneous, other.homogeneous, atol=AGREE)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", ROBOTS)
def test_coordinates_count_from_the_zero_of_the_file(name: str):
    """Whatever configuration is the mechanism's zero, the model is the same, and q0 is that configuration."""
    robot = hrsynth.load(name)
    bounded = [
        replace(joint, limits=Limits(-0.5, 2.0, 3.0, 4.0))
        for joint in robot.joints.values()
        if joint.type in (JointType.REVOLUTE, JointType.PRISMATIC)
    ]
    robot = robot.changed(joints=bounded)
    at = walked(PinocchioModel(robot), seed=2)
    one, other = robot.to_pinocchio(), set_zero(at).to_pinocchio()
    assert list(one.model.names) == list(other.model.names)
    for mine, theirs in zip(one.model.jointPlacements, other.model.jointPlacements, strict=True):
        np.testing.assert_allclose(mine.homogeneous, theirs.homogeneous, atol=AGREE)
    for joint in bounded:
        own = other.model.joints[other.model.getJointId(*other.joints[joint.name])]
        i, k = own.idx_q, own.idx_v
        assert (other.model.lowerPositionLimit[i], other.model.upperPositionLimit[i]) == pytest.approx((-0.5, 2.0))
        assert (other.model.velocityLimit[k], other.model.effortLimit[k]) == (3.0, 4.0)
    there = Pinned(one)
    there.constraints(other.q0)
    for link in robot.links:
        np.testing.assert_allclose(there.data.oMf[there.links[link]].homogeneous, at.pose(link), atol=AGREE)


@pytest.mark.parametrize("name", ["3rrr_m1", "3puu", "delta"])
def test_joints_that_are_passed_backwards_keep_their_sense(name: str):
    """Each R, P and U given the other way round, which exchanges the axes of a U."""
    robot = hrsynth.load(name)
    turned = [each.turned() for each in robot.joints.values() if each.type is not JointType.SPHERICAL]
    mine, other = Pinned(robot.to_pinocchio()), Pinned(robot.changed(joints=turned).to_pinocchio())
    rng = np.random.default_rng(1)
    q, their_q = mine.export.q0.copy(), other.export.q0.copy()
    for joint in turned:
        parts, theirs = mine.export.joints[joint.name], other.export.joints[joint.name]
        for part, same in zip(parts, theirs[::-1], strict=True) if joint.in_tree else ():
            value = rng.uniform(-1, 1)
            q[mine.model.joints[mine.model.getJointId(part)].idx_q] = value
            their_q[other.model.joints[other.model.getJointId(same)].idx_q] = value
            assert (part == same) == (len(parts) == 1)
    mine.constraints(q)
    other.constraints(their_q)
    for link in robot.links:
        X, Y = (each.data.oMf[each.links[link]].homogeneous for each in (mine, other))
        np.testing.assert_allclose(X, Y, atol=AGREE)


def test_gears_are_rows():
    builder = Builder("geared")
    for number, name in enumerate(("base", "one", "two")):
        builder.link(name, (0.0, 0.0, 0.1 * number))
    builder.joint("turn", "R", "base", "one", (0, 0, 0), axis=(0, 0, 1))
    builder.joint("slide", "P", "one", "two", (0, 0, 0.1), axis=(1, 0, 0))
    robot = builder.build(platform="two").changed(couplings=(Coupling("gear", "turn", "slide", 0.3),))
    check_closed(robot)
    np.testing.assert_array_equal(robot.to_pinocchio().couplings, [[-0.3, 1.0]])


def weighed(robot: Mechanism, seed: int = 0) -> Mechanism:
    """The robot with random masses of links that have none, and random inertias where no body can have the file's,
    which are not written for MuJoCo."""
    rng, links = np.random.default_rng(seed), []
    for link in robot.links.values():
        content = collect_content(link, robot)
        place = build_pose(rng.uniform(-0.3, 0.3, 3), random_rotation(rng))
        own, A = content.inertial, rng.normal(size=(3, 3))
        if own is None or own.mass == 0:
            own = Inertial(rng.uniform(0.1, 2), place)
        moments = np.linalg.eigvalsh(np.zeros((3, 3)) if own.inertia is None else own.inertia)
        if not moments[0] > 0 or 2 * moments[2] > moments.sum():
            own = replace(own, inertia=0.01 * (A @ A.T + np.trace(A @ A.T) * np.eye(3)))
        links.append(replace(link, xml=write_fragments(replace(content, inertial=own))))
    return robot.changed(links=links)


class Simulated:
    """The same robot in MuJoCo, without limits and shapes, its bodies without a mass all but so."""

    def __init__(self, robot: Mechanism) -> None:
        self.mujoco = mujoco = pytest.importorskip("mujoco")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.xml"
            hrsynth.save(robot, file)
            root = ET.parse(file).getroot()
        root.find("compiler").attrib.update(boundmass="1e-12", boundinertia="1e-12")
        for each in list(root.iter()):
            each.attrib.pop("range", None)
            for child in (*each.findall("geom"), *each.findall("asset")):
                each.remove(child)
        ET.SubElement(root, "option", jacobian="dense")
        self.model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
        self.data = mujoco.MjData(self.model)

    def constraints(self) -> tuple[Array, Array]:
        """What the loops and gears miss, and the derivative of that, where MuJoCo is."""
        self.mujoco.mj_forward(self.model, self.data)
        return self.data.efc_pos.copy(), self.data.efc_J.reshape(-1, self.model.nv).copy()

    def twists(self, links: list[str]) -> Array:
        """The Jacobians of the links' origins, base axes, (6 links, nv)."""
        found = np.zeros((len(links), 6, self.model.nv))
        for J, link in zip(found, links, strict=True):
            self.mujoco.mj_jacBody(self.model, self.data, J[:3], J[3:], self.data.body(link).id)
        return found.reshape(-1, self.model.nv)

    def reach(self, poses: dict[str, Array]) -> None:
        """Go to where the loops are closed and the links have these poses."""
        for _ in range(30):
            missed, J = self.constraints()
            own = {link: self.data.body(link) for link in poses}
            X = {link: build_pose(each.xpos, each.xmat.reshape(3, 3)) for link, each in own.items()}
            step = np.linalg.lstsq(
                np.vstack([J, self.twists(list(poses))]), np.concatenate([-missed, *apart(X, poses)]), rcond=ROWS
            )[0]
            self.mujoco.mj_integratePos(self.model, self.data.qpos, step, 1.0)
            if np.abs(step).max(initial=0.0) < 1e-12:
                break
        self.constraints()

    def inertia(self) -> Array:
        """The matrix of inertia where MuJoCo is, (nv, nv)."""
        M = np.zeros((self.model.nv,) * 2)
        self.mujoco.mj_fullM(self.model, self.data, M)
        return M

    def accelerate(self, Y: Array, v: Array, force: Array) -> Array:
        """The accelerations at which the loops stay closed (Y: a basis of the motions that they allow), by Lagrange's
        equations, with differences of fourth order for the derivative of the constraints."""
        start, step = self.data.qpos.copy(), 1e-3

        def shifted(time: float) -> Array:
            self.data.qpos[:] = start
            self.mujoco.mj_integratePos(self.model, self.data.qpos, v, time)
            return self.constraints()[1]

        near, far = (shifted(n * step) - shifted(-n * step) for n in (1, 2))
        self.data.qpos[:], self.data.qvel[:] = start, v
        forced = np.linalg.lstsq(self.constraints()[1], -(8 * near - far) @ v / (12 * step))[0]
        M, bias = self.inertia(), self.data.qfrc_bias.copy()
        self.data.qvel[:] = 0
        return forced + Y @ np.linalg.solve(Y.T @ M @ Y, Y.T @ (force - bias - M @ forced))


def walk_in_both(robot: Mechanism, pinned: Pinned, other: Simulated) -> Iterator[tuple[Array, Array, Array]]:
    """At some closed configurations the coordinates, and in both models bases of the same motions of links that
    the loops allow."""
    pinned.model.gravity.linear, other.model.opt.gravity = GRAVITY, GRAVITY
    model = PinocchioModel(robot)
    links = [link for link in robot.links if link != robot.base]
    q, start = pinned.export.q0, ClosedConfiguration.of(model, model.q0)
    for at in (start, *walk_randomly(start, 3, steps=3)):
        poses = {link: at.pose(link) for link in robot.links}
        q = pinned.reach(q, poses)
        other.reach(poses)
        Z, Y = kernel(pinned.constraints(q)[1]), kernel(other.constraints()[1])
        V, W = pinned.twists(q, links), other.twists(links)
        basis = np.linalg.svd(V @ Z, full_matrices=False)[0]
        Z, Y = Z @ np.linalg.lstsq(V @ Z, basis)[0], Y @ np.linalg.lstsq(W @ Y, basis)[0]
        assert Z.shape == (pinned.model.nv, at.kernel()[0].shape[1])
        np.testing.assert_allclose(W @ Y, basis, atol=1e-7)
        yield q, Z, Y


def differences(robot: Mechanism) -> tuple[float, float, bool]:
    """At some closed configurations the largest difference of gravity's loads on the motions of links that the loops
    allow, and of the torques by which motors hold the robot (N, Nm); that of the inertia that these motions meet (to
    the largest); whether motors were compared: where no motor is told by the others."""
    pinned, other = Pinned(robot.to_pinocchio()), Simulated(robot)
    model, data = pinned.model, pinned.data
    driven, acted = list_motors(pinned, other)
    torques, inertias, held = 0.0, 0.0, False
    for q, Z, Y in walk_in_both(robot, pinned, other):
        M = np.triu(pin.crba(model, data, q, pin.Convention.WORLD))
        M, N = Z.T @ (M + np.triu(M, 1).T) @ Z, Y.T @ other.inertia() @ Y
        inertias = max(inertias, np.abs(M - N).max() / np.abs(N).max())
        load, theirs = Z.T @ pin.computeGeneralizedGravity(model, data, q), Y.T @ other.data.qfrc_bias
        torques = max(torques, np.abs(load - theirs).max())
        if driven and np.linalg.matrix_rank(Z[driven], 1e-6) == len(driven):
            held = True
            tau, their_tau = np.linalg.lstsq(Z[driven].T, load)[0], np.linalg.lstsq(Y[acted].T, theirs)[0]
            torques = max(torques, np.abs(tau - their_tau).max())
    return torques, inertias, held


def list_motors(pinned: Pinned, other: Simulated) -> tuple[list[int], list[int]]:
    """The rates of the motors in both models."""
    names = pinned.export.motors
    driven = [pinned.model.joints[pinned.model.getJointId(name)].idx_v for name in names]
    return driven, [other.model.joint(name).dofadr[0] for name in names]


@pytest.mark.some(4)
@pytest.mark.parametrize("name", [*ROBOTS, *FIGURES])
def test_motors_carry_what_they_carry_in_mujoco(name: str):
    torques, inertias, _ = differences(weighed(robot_named(name)))
    assert torques < TORQUES
    assert inertias < TORQUES


@pytest.mark.some(5)
@pytest.mark.parametrize("name", [*ROBOTS, *FIGURES])
def test_robots_accelerate_as_in_mujoco(name: str):
    """In motion and under random torques of the motors, for which inverse dynamics ask."""
    accelerations, torques = compare_motions(weighed(robot_named(name)))
    assert accelerations < TORQUES
    assert torques < TORQUES


def compare_motions(robot: Mechanism) -> tuple[float, float]:
    """At some closed configurations with random rates that the loops allow, and random torques: the largest difference
    of accelerations of joints (to the largest), and of the torques and those of Pinocchio's inverse dynamics, both as
    loads of these motions. Pinocchio needs a small armature for bodies without a mass: it is far below all inertias."""
    pinned, other = Pinned(robot.to_pinocchio()), Simulated(robot)
    model, data = pinned.model, pinned.data
    moments = np.concatenate([np.linalg.eigvalsh(each.inertia) for each in model.inertias])
    model.armature = np.full(model.nv, min(1e-9, 1e-6 * moments[moments > 1e-12].min()))
    driven, acted = list_motors(pinned, other)
    loops, rng = pinned.export.constraint_models, np.random.default_rng(0)
    settings = pin.ProximalSettings(1e-14, 1e-10, 100)
    accelerations, torques = 0.0, 0.0
    for q, Z, Y in walk_in_both(robot, pinned, other):
        rates, loads = rng.normal(size=Z.shape[1]), rng.normal(size=len(driven))
        v, tau, force = Z @ rates, np.zeros(model.nv), np.zeros(other.model.nv)
        tau[driven], force[acted] = loads, loads
        pin.initConstraintDynamics(model, data, loops, pinned.own)
        found = pin.constraintDynamics(model, data, q, v, tau, loops, pinned.own, settings).copy()
        theirs = other.accelerate(Y, Y @ rates, force)
        for number in range(other.model.njnt):
            joint = other.model.joint(number)
            if model.existJointName(joint.name):  # none of a loop
                own = model.joints[model.getJointId(joint.name)]
                at, start = own.idx_v, joint.dofadr[0]
                missed = found[at : at + own.nv] - theirs[start : start + own.nv]
                accelerations = max(accelerations, np.abs(missed).max() / np.abs(theirs).max())
        needed = Z.T @ pin.rnea(model, data, q, v, found)
        torques = max(torques, np.abs(needed - Z[driven].T @ loads).max())
    return accelerations, torques
