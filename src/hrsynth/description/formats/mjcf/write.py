"""A mechanism as MJCF: bodies, joints, equality constraints, motors; MuJoCo loads it as it is."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from lxml import etree

from ....geometry.so3 import quaternions
from ....geometry.vectors import Array, inverse
from ....mechanism.model import Joint, JointType, Mechanism, Note
from ... import numerals, xml
from ...annotations import PREFIX, annotations_of
from ...chains import SECOND
from ...dialect import Written
from ...jointgraph import listed
from ...reduction import reduce, require_free_world
from ...tree import outward

_TREE = (JointType.REVOLUTE, JointType.PRISMATIC, JointType.SPHERICAL, JointType.FIXED)
_LOOPS = (JointType.SPHERICAL, JointType.FIXED, JointType.REVOLUTE)
_NAMES = {JointType.REVOLUTE: "hinge", JointType.PRISMATIC: "slide", JointType.SPHERICAL: "ball"}
WORLD = "world"


def write(mechanism: Mechanism) -> Written:
    """The MJCF text of a mechanism, and warnings of what is lost.

    A revolute loop is two points on its axis; other loops are cut through the joint. Raises ``BadRequest`` for what
    cannot be said.
    """
    floats = all(joint.predecessor == mechanism.base for joint in mechanism.joints.values()
                 if joint.type is JointType.FREE)
    robot, lost = reduce(mechanism, (*_TREE, JointType.FREE) if floats else _TREE, _LOOPS, content=False)
    require_free_world(robot, WORLD, "MJCF")
    root = etree.Element("mujoco", model=robot.name)
    etree.SubElement(root, "compiler", angle="radian", boundmass="0.001", boundinertia="0.000001")
    custom = etree.SubElement(root, "custom")
    for number, (key, text) in enumerate(annotations_of(robot), 1):
        etree.SubElement(custom, "text", name=f"{PREFIX}_{key}_{number}", data=text)
    _bodies(root, robot)
    equality = etree.Element("equality")
    for joint in robot.joints.values():
        if not joint.in_tree:
            _closure(equality, robot, joint)
    _gears(equality, robot)
    if len(equality):
        root.append(equality)
    actuator = etree.Element("actuator")
    for joint in robot.joints.values():
        if joint.motor is not None and joint.type is not JointType.FIXED:
            etree.SubElement(actuator, "motor", name=joint.motor.name, joint=joint.name)
    if len(actuator):
        root.append(actuator)
    return Written((xml.text_of(root),), (*lost, *_lost(robot)))


def _lost(robot: Mechanism) -> list[Note]:
    """What MJCF has no words for: one-sided limits, limits of loops, of velocity and effort; names of fixed joints."""
    found = []
    cut = [joint.name for joint in robot.joints.values() if joint.limits is not None
           and (not joint.in_tree or None in (joint.limits.lower, joint.limits.upper)
                or joint.limits.velocity is not None or joint.limits.effort is not None)]
    if cut:
        found.append(Note("warning", "limits that are one-sided, of loops, of velocity or effort are not written: "
                                     + listed(cut)))
    fixed = [joint.name for joint in robot.joints.values() if joint.in_tree and joint.type is JointType.FIXED]
    if fixed:
        found.append(Note("warning", "the names of fixed joints are not written: " + listed(fixed)))
    return found


def _bodies(root: xml.Element, robot: Mechanism) -> None:
    world = etree.SubElement(root, "worldbody")
    elements = {robot.base: world}
    if robot.base != WORLD:
        elements[robot.base] = etree.SubElement(world, "body", name=robot.base)
    for joint in outward(robot):
        X = inverse(robot.links[joint.predecessor].pose) @ robot.links[joint.successor].pose
        parent = world if joint.type is JointType.FREE else elements[joint.predecessor]
        body = etree.SubElement(parent, "body", {"name": joint.successor, **_pose(X)})
        elements[joint.successor] = body
        if joint.type is not JointType.FIXED:
            body.append(_joint(robot, joint))


def _pose(X: Array) -> dict[str, str]:
    found = {}
    if np.any(X[:3, 3]):
        found["pos"] = _text(X[:3, 3])
    if not np.array_equal(X[:3, :3], np.eye(3)):
        found["quat"] = _text(quaternions(X[:3, :3]))
    return found


def _text(values: Array | tuple[float, ...]) -> str:
    return " ".join(numerals.exact(float(value)) for value in values)


def _joint(robot: Mechanism, joint: Joint) -> xml.Element:
    if joint.type is JointType.FREE:
        return etree.Element("freejoint", name=joint.name)
    X = inverse(robot.links[joint.successor].pose)
    element = etree.Element("joint", name=joint.name, type=_NAMES[joint.type],
                            pos=_text(X[:3, :3] @ joint.point + X[:3, 3]))
    if joint.axes:
        element.set("axis", _text(X[:3, :3] @ joint.axis))
    limits = joint.limits
    if limits is not None and limits.lower is not None and limits.upper is not None and limits.lower < limits.upper:
        element.set("range", _text((limits.lower, limits.upper)))
    return element


def _closure(equality: xml.Element, robot: Mechanism, joint: Joint) -> None:
    one, two = joint.links
    X = inverse(robot.links[one].pose)
    names = {"body1": one, "body2": two}
    if joint.type is JointType.FIXED:
        relative = X @ robot.links[two].pose
        relpose = _text((*(X[:3, :3] @ joint.point + X[:3, 3]), *quaternions(relative[:3, :3])))
        Y = inverse(robot.links[two].pose)
        etree.SubElement(equality, "weld", {"name": joint.name, **names, "relpose": relpose,
                                            "anchor": _text(Y[:3, :3] @ joint.point + Y[:3, 3])})
        return
    points = [joint.point]
    if joint.type is JointType.REVOLUTE:
        points.append(joint.point + robot.length * joint.axis)
    for point, suffix in zip(points, ("", SECOND), strict=False):
        anchor = _text(X[:3, :3] @ point + X[:3, 3])
        etree.SubElement(equality, "connect", {"name": joint.name + suffix, **names, "anchor": anchor})


def _gears(equality: xml.Element, robot: Mechanism) -> None:
    carrier: dict[str, list[str]] = defaultdict(list)
    for joint in robot.joints.values():
        if joint.in_tree:
            carrier[joint.successor].append(joint.name)
    for coupling in robot.couplings:
        etree.SubElement(equality, "joint", name=coupling.name, joint1=carrier[coupling.successor][0],
                         joint2=carrier[coupling.predecessor][0],
                         polycoef=_text((0.0, coupling.ratio, 0.0, 0.0, 0.0)))
