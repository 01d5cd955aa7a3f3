"""A mechanism as MJCF: bodies, joints, equality constraints, motors; MuJoCo loads it as it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from lxml import etree

from ....geometry.so3 import convert_to_quaternions
from ....geometry.vectors import Array, invert_pose
from ....mechanism.model import Joint, JointType, Mechanism, Note, make_fresh_name
from ... import numerals, xml
from ...annotations import PREFIX, list_annotations
from ...chains import SECOND
from ...contents import SIZES, list_unsupported_content
from ...file_format import Written
from ...jointgraph import join_names
from ...reduction import reduce, require_free_world
from ...tree import list_outward_joints
from .content import build_elements

_TREE = (JointType.REVOLUTE, JointType.PRISMATIC, JointType.SPHERICAL, JointType.FIXED)
_LOOPS = (JointType.SPHERICAL, JointType.FIXED, JointType.REVOLUTE)
_NAMES = {JointType.REVOLUTE: "hinge", JointType.PRISMATIC: "slide", JointType.SPHERICAL: "ball"}
WORLD = "world"
BODY_MASS_MIN = 0.001
"""Mass (kg) that a written file makes MuJoCo give to bodies with less: it refuses moving bodies without mass."""


def write(mechanism: Mechanism) -> Written:
    """Return the MJCF text of a mechanism, and warnings of losses.

    A revolute loop is two points on its axis; other loops are cut at the joint. Raises ``BadRequest`` for a mechanism
    that MJCF cannot express.
    """
    floats = all(
        joint.predecessor == mechanism.base for joint in mechanism.joints.values() if joint.type is JointType.FREE
    )
    robot, lost = reduce(mechanism, (*_TREE, JointType.FREE) if floats else _TREE, _LOOPS)
    require_free_world(robot, WORLD, "MJCF")
    custom = [
        xml.create_element("text", name=f"{PREFIX}_{key}_{number}", data=text)
        for number, (key, text) in enumerate(list_annotations(robot), 1)
    ]
    loops = [
        element for joint in robot.joints.values() if not joint.in_tree for element in _build_closure(robot, joint)
    ]
    motors = dict[str, xml.Element]()
    for joint in robot.joints.values():
        if joint.motor is not None and joint.type is not JointType.FIXED:
            name = make_fresh_name(joint.motor.name, motors)  # a transmission may drive several joints
            motors[name] = xml.create_element("motor", name=name, joint=joint.name)
    inner, assets, odd = build_elements(robot)
    sections = {
        "custom": custom,
        "asset": assets,
        "worldbody": _build_bodies(robot, inner),
        "equality": [*loops, *_build_couplings(robot)],
        "actuator": [*motors.values()],
    }
    root = xml.create_element(
        "mujoco",
        xml.create_element("compiler", angle="radian", boundmass=str(BODY_MASS_MIN), boundinertia="0.000001"),
        *(xml.create_element(tag, *elements) for tag, elements in sections.items() if elements),
        model=robot.name,
    )
    return Written(
        (xml.format_document(root),),
        (
            *lost,
            *_list_losses(robot),
            *_list_light_links(inner),
            *odd,
            *list_unsupported_content(robot, SIZES, dialect="MJCF"),
        ),
    )


def _list_losses(robot: Mechanism) -> list[Note]:
    """Return notes of what MJCF cannot express: one-sided limits, limits of loops, of velocity and force, names of
    fixed joints."""
    found = []
    bounded = [(joint, joint.limits) for joint in robot.joints.values() if joint.limits is not None]
    lost = {
        "limits of closures": [
            joint for joint, own in bounded if not joint.in_tree and (own.lower, own.upper) != (None, None)
        ],
        "one-sided limits": [
            joint for joint, own in bounded if joint.in_tree and (own.lower is None) != (own.upper is None)
        ],
        "limits of velocity and force or torque": [
            joint for joint, own in bounded if (own.velocity, own.effort) != (None, None)
        ],
    }
    for what, joints in lost.items():
        if joints:
            found.append(Note("warning", f"{what} are not written: {join_names([joint.name for joint in joints])}"))
    fixed = [joint.name for joint in robot.joints.values() if joint.in_tree and joint.type is JointType.FIXED]
    if fixed:
        found.append(Note("warning", "the names of fixed joints are not written: " + join_names(fixed)))
    return found


def _list_light_links(inner: Mapping[str, list[xml.Element]]) -> list[Note]:
    """Return the note of the mass that MuJoCo adds to links without mass and shapes, if others have a mass."""
    masses = {
        link: [float(part.get("mass", 0.0)) for part in elements if part.tag == "inertial"]
        for link, elements in inner.items()
        if link != WORLD
    }
    light = [
        link
        for link, values in masses.items()
        if sum(values) < BODY_MASS_MIN and (values or not any(part.tag == "geom" for part in inner[link]))
    ]
    if not light or not any(masses.values()):
        return []
    added = sum(BODY_MASS_MIN - sum(masses[link]) for link in light)
    text = f"{len(light)} links get the least mass of {BODY_MASS_MIN} kg (boundmass), {added:.3g} kg are added"
    return [Note("warning", f"{text}: {join_names(light)}")]


def _build_bodies(robot: Mechanism, inner: Mapping[str, list[xml.Element]]) -> list[xml.Element]:
    """Return the bodies that the world carries, each holding its own elements and the bodies that it carries."""
    world = xml.create_element("worldbody")
    bodies = {robot.base: world}
    if robot.base != WORLD:
        bodies[robot.base] = etree.SubElement(world, "body", name=robot.base)
    bodies[robot.base].extend(each for each in inner[robot.base] if robot.base != WORLD or each.tag == "geom")
    for joint in list_outward_joints(robot):
        X = invert_pose(robot.links[joint.predecessor].pose) @ robot.links[joint.successor].pose
        body = xml.create_element("body", name=joint.successor)
        if np.any(X[:3, 3]):
            body.set("pos", numerals.format_exact_vector(X[:3, 3]))
        if not np.array_equal(X[:3, :3], np.eye(3)):
            body.set("quat", numerals.format_exact_vector(convert_to_quaternions(X[:3, :3])))
        if joint.type is not JointType.FIXED:
            body.append(_build_joint(robot, joint))
        body.extend(inner[joint.successor])
        (world if joint.type is JointType.FREE else bodies[joint.predecessor]).append(body)
        bodies[joint.successor] = body
    return list(world)


def _build_joint(robot: Mechanism, joint: Joint) -> xml.Element:
    if joint.type is JointType.FREE:
        return xml.create_element("freejoint", name=joint.name)
    element = xml.create_element(
        "joint", name=joint.name, type=_NAMES[joint.type], pos=_format_point(robot, joint.successor, joint.point)
    )
    if joint.axes:
        element.set("axis", numerals.format_exact_vector(robot.links[joint.successor].pose[:3, :3].T @ joint.axis))
    limits = joint.limits
    if limits is not None and limits.lower is not None and limits.upper is not None and limits.lower < limits.upper:
        element.set("range", numerals.format_exact_vector((limits.lower, limits.upper)))
    return element


def _format_point(robot: Mechanism, link: str, point: Array) -> str:
    """Return a point in the frame of a link."""
    X = invert_pose(robot.links[link].pose)
    return numerals.format_exact_vector(X[:3, :3] @ point + X[:3, 3])


def _build_closure(robot: Mechanism, joint: Joint) -> list[xml.Element]:
    """Return a rigid closure as a weld, a point as a point, a revolute joint as two points."""
    one, two = joint.links
    if joint.type is JointType.FIXED:
        relative = invert_pose(robot.links[one].pose) @ robot.links[two].pose
        turn = numerals.format_exact_vector(convert_to_quaternions(relative[:3, :3]))
        relpose = f"{_format_point(robot, one, joint.point)} {turn}"
        return [
            xml.create_element(
                "weld",
                name=joint.name,
                body1=one,
                body2=two,
                relpose=relpose,
                anchor=_format_point(robot, two, joint.point),
            )
        ]
    points = {joint.name: joint.point}
    if joint.type is JointType.REVOLUTE:
        points[joint.name + SECOND] = joint.point + robot.length * joint.axis
    return [
        xml.create_element("connect", name=name, body1=one, body2=two, anchor=_format_point(robot, one, point))
        for name, point in points.items()
    ]


def _build_couplings(robot: Mechanism) -> list[xml.Element]:
    return [
        xml.create_element(
            "joint",
            name=each.name,
            joint1=each.driven,
            joint2=each.driver,
            polycoef=numerals.format_exact_vector((0, each.ratio, 0, 0, 0)),
        )
        for each in robot.couplings
    ]


def write_keyframes(text: str, file: Path, keyframes: Mapping[str, Mapping[str, Array]]) -> dict[Path, str]:
    """Return the text of a file with a key for each of the joint values, by the names of the joints as written."""
    root = xml.parse_document(text.encode(), str(file))
    joints = [joint for tree in root.iterfind("worldbody") for joint in tree.iter("joint", "freejoint")]
    section = etree.SubElement(root, "keyframe")
    for name, values in keyframes.items():
        numbers = [_list_coordinates(joint, values[joint.get("name", "")]) for joint in joints]
        section.append(xml.create_element("key", name=name, qpos=numerals.format_exact_vector(np.concatenate(numbers))))
    return {file: xml.format_document(root)}


def _list_coordinates(joint: xml.Element, value: Array) -> Array:
    """Return MuJoCo's coordinates of a joint."""
    if joint.tag == "freejoint":
        return np.concatenate([value[:3, 3], convert_to_quaternions(value[:3, :3])])
    return convert_to_quaternions(value[:3, :3]) if joint.get("type") == "ball" else value
