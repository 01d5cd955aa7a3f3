"""Export of a mechanism to Pinocchio alone: the file's tree in metres, its loops as Pinocchio's own constraints.

The frame of a joint lies at its centre, turned as the link that it carries. :mod:`.pinocchio_model`, with which this
project computes, has a tree, a zero and a unit of length of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ..description import load
from ..description.chains import list_chain_joints
from ..description.contents import collect_content
from ..description.tree import build_spanning_mechanism
from ..geometry.so3 import decompose_rotation
from ..geometry.vectors import Array, invert_pose, transform
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.model import Link
from ..mechanism.screws import split_elementary
from ..results import with_spelling

_WHOLE = {JointType.SPHERICAL: pin.JointModelSpherical, JointType.FREE: pin.JointModelFreeFlyer}


class PinocchioExport(NamedTuple):
    """Pinocchio model of a mechanism with its constraint models (metres, kilograms, radians)."""

    model: pin.Model
    """Tree, and a leaf for each loop that is cut through its joint; links are BODY frames. Bodies without a mass in
    the file, such as leaves and the parts of U, C and E between two axes, have none: their forward dynamics need
    ``model.armature``."""
    constraint_models: list[pin.RigidConstraintModel]
    """One for each loop: ``CONTACT_3D`` for a spherical joint, ``CONTACT_6D`` welds a leaf to its link."""
    q0: Array
    """Zero configuration of the mechanism, at which all loops are closed, relative to the file's zero (nq,)."""
    joints: dict[str, tuple[str, ...]]
    """Joints of the file with the names of their joints in the model: one for S and floating joints, none for fixed
    joints and spherical loop closures, one for each axis of others."""
    motors: tuple[str, ...]
    """Names of the model's actuated joints."""
    closures: tuple[str, ...]
    """Names of the file's joints that the constraint models represent."""
    couplings: Array
    """Couplings, for which there is no constraint model, (couplings, nv): ``couplings @ v = 0``, and
    ``couplings @ pin.difference(model, q0, q) = 0``."""


@with_spelling
def to_pinocchio(robot: Mechanism | str | Path) -> PinocchioExport:
    """Export a robot with its loops to Pinocchio; also as ``Mechanism.to_pinocchio()``.

    Parameters
    ----------
    robot
        Mechanism, path of a file, or name of a shipped robot.

    Returns
    -------
    PinocchioExport
        Model, constraint models, zero configuration (nq,), names and couplings (metres, kilograms, radians).

    Raises
    ------
    BadRobotFile, LoopClosureFailure
        If the robot is not readable, or its loops do not close.

    Notes
    -----
    Coordinates are relative to the file's zero, in the file's sense; joints and links have the file's names. Bounds,
    masses and inertias are set if the file has them. A U is two revolute joints (``hip__1``, ``hip__2``), C and E are
    such chains too. Gravity is 9.81 m/s² against the z axis of the base link; ``model.gravity`` sets another.

    Examples
    --------
    >>> model, constraints, q0, *names = hrsynth.to_pinocchio("3rrr_m1")
    >>> model.nq, len(constraints)
    (9, 2)
    """
    mechanism = load(robot)
    return _Export(mechanism, build_spanning_mechanism(mechanism)).result()


class _Export:
    """A model that grows outwards; ``_at`` has the pose (in the base) of each model joint at the zero configuration."""

    def __init__(self, given: Mechanism, robot: Mechanism) -> None:
        self._given, self._robot = given, robot
        self._model = pin.Model()
        self._model.name = robot.name
        self._at = [pin.SE3.Identity()]
        self._q0: list[float] = []
        self._joints: dict[str, tuple[str, ...]] = {}
        self._body: dict[str, tuple[int, int]] = {}
        self._leaf: dict[str, int] = {}
        self._add_link(robot.links[robot.base], 0, 0)
        pending = self._carried(robot.base)
        while pending:  # depth first: Pinocchio counts on it that a joint's descendants follow it
            joint = pending.pop()
            body, frame = self._add(joint)
            if joint.in_tree:
                self._add_link(robot.links[joint.successor], body, frame)
                pending += self._carried(joint.successor)
            else:
                self._leaf[joint.name] = body

    def result(self) -> PinocchioExport:
        """All of it; bounds and constraint models need the whole model."""
        self._bound()
        constraints = []
        for joint in (joint for joint in self._robot.joints.values() if not joint.in_tree):
            kind = pin.ContactType.CONTACT_3D if _is_ball(joint) else pin.ContactType.CONTACT_6D
            near, far = (self._body[link][0] for link in joint.links)
            ends = [
                part
                for body in (self._leaf.get(joint.name, near), far)
                for part in (body, self._at[body].actInv(self._frame(joint)))
            ]
            constraints.append(pin.RigidConstraintModel(kind, self._model, *ends, pin.ReferenceFrame.LOCAL))
            constraints[-1].name = joint.name
        driven = (name for name, joint in self._robot.joints.items() if joint.is_actuated)
        return PinocchioExport(
            self._model,
            constraints,
            np.array(self._q0),
            {name: self._joints.get(name, ())[:: self._order(joint)] for name, joint in self._robot.joints.items()},
            tuple(part for name in driven for part in self._joints[name]),
            tuple(each.name for each in constraints),
            self._gears(),
        )

    def _carried(self, link: str) -> list[Joint]:
        """Return the joints to be added on a link, the last one first: those of the tree and those that end in a
        leaf."""
        return [each for each in self._robot.joints_of(link)[::-1] if each.predecessor == link and not _is_ball(each)]

    def _order(self, joint: Joint) -> int:
        """Return -1 if a U is passed against its direction, from its second axis to its first."""
        given = self._given.joints.get(joint.name, joint)
        return -1 if joint.type is JointType.UNIVERSAL and given.predecessor != joint.predecessor else 1

    def _frame(self, joint: Joint) -> pin.SE3:
        """The frame of a joint at the zero configuration."""
        return pin.SE3(self._robot.links[joint.successor].pose[:3, :3], joint.point)

    def _add_link(self, link: Link, body: int, frame: int) -> None:
        """The frame of a link on a body, with its mass."""
        inertia, own = pin.Inertia.Zero(), collect_content(link, self._robot).inertial
        if own is not None:
            tensor = np.zeros((3, 3)) if own.inertia is None else own.inertia
            inertia = pin.SE3(own.X).act(pin.Inertia(own.mass, np.zeros(3), tensor))
        place = self._at[body].actInv(pin.SE3(link.pose))
        frame = self._model.addFrame(pin.Frame(link.name, body, frame, place, pin.FrameType.BODY, inertia))
        self._body[link.name] = body, frame

    def _add(self, joint: Joint) -> tuple[int, int]:
        """Add the joint models of a joint on its predecessor; body and frame that they end at."""
        body, frame = self._body[joint.predecessor]
        X = self._frame(joint)
        models: list[tuple[pin.JointModel, Array, pin.SE3]] = []
        if joint.type in _WHOLE:
            D = pin.SE3.Identity() if joint.offset is None else pin.SE3(joint.offset)
            start = pin.SE3(D.rotation @ X.rotation, joint.point)
            q = pin.SE3ToXYZQUAT(start.actInv(D.actInv(start)))
            models = [(_WHOLE[joint.type](), q[3:] if joint.type is JointType.SPHERICAL else q, D.actInv(start))]
        else:
            parts = list(zip(split_elementary(joint.type, joint.axes), _list_zero_values(joint), strict=True))
            slid = sum(value * axis for (kind, axis), value in parts if kind is JointType.PRISMATIC)
            start = pin.SE3(X.rotation, joint.point + slid)
            for (kind, axis), value in reversed(parts):
                own = start.rotation.T @ axis
                slides = kind is JointType.PRISMATIC
                model = (pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned)(own)
                models.insert(0, (model, np.array([value]), start))
                start *= pin.SE3(np.eye(3), -value * own) if slides else pin.SE3(pin.exp3(-value * own), np.zeros(3))
        names = [name for name, _ in joint.turns] or list_chain_joints(joint.name, len(models)) if models else []
        if not joint.turns:
            names = names[:: self._order(joint)]
        for name, (model, q, after) in zip(names, models, strict=True):
            body = self._model.addJoint(body, model, self._at[body].actInv(start), name)
            frame = self._model.addJointFrame(body, frame)
            self._q0.extend(q)
            self._at.append(after)
            start = after
        self._joints[joint.name] = tuple(names)
        return body, frame

    def _start(self, joint: str, place: int = 0) -> tuple[int, int]:
        """Return the start indices in q and in v of a part of a joint."""
        own = self._model.joints[self._model.getJointId(self._joints[joint][place])]
        return own.idx_q, own.idx_v

    def _bound(self) -> None:
        """Set the limits that the file has; those of a U, C or E, one for all its axes, count from the file's zero."""
        model = self._model
        for name, joint in self._robot.joints.items():
            for place in range(0 if joint.type in _WHOLE else len(self._joints.get(name, ()))):
                limits = joint.turns[place][1] if joint.turns else joint.limits
                if limits is None:
                    continue
                i, k = self._start(name, place)
                zero = self._q0[i] if joint.turns or joint.type.freedoms == 1 else 0.0
                for bounds, index, value, sign, start in (
                    (model.lowerPositionLimit, i, limits.lower, 1, zero),
                    (model.upperPositionLimit, i, limits.upper, 1, zero),
                    (model.lowerVelocityLimit, k, limits.velocity, -1, 0.0),
                    (model.upperVelocityLimit, k, limits.velocity, 1, 0.0),
                    (model.lowerEffortLimit, k, limits.effort, -1, 0.0),
                    (model.upperEffortLimit, k, limits.effort, 1, 0.0),
                ):
                    if value is not None:
                        bounds[index] = start + sign * value

    def _gears(self) -> Array:
        """Return one row a coupling: the driven joint's rate − ratio × the driving one's."""
        rows = np.zeros((len(self._robot.couplings), self._model.nv))
        for row, coupling in zip(rows, self._robot.couplings, strict=True):
            for name, factor in ((coupling.driven, 1.0), (coupling.driver, -coupling.ratio)):
                row[self._start(name)[1]] += factor
        return rows


def _is_ball(joint: Joint) -> bool:
    """Return True if a loop joins two points, and no motor rotates it."""
    return joint.type is JointType.SPHERICAL and not joint.in_tree and not joint.is_actuated


def _list_zero_values(joint: Joint) -> Array:
    """The file's coordinates (m, rad) of a chain of R and P at the zero configuration."""
    if joint.offset is None:
        return np.zeros(joint.type.freedoms)
    if joint.type is not JointType.PLANAR:
        return joint.offset
    shift = transform(invert_pose(joint.offset), joint.point) - joint.point
    slides = [axis @ shift for _, axis in split_elementary(joint.type, joint.axes)[:2]]
    return np.array([*slides, *decompose_rotation(joint.axis[None], joint.offset[:3, :3].T)])
