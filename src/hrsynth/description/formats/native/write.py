"""Writer of the native format: from a mechanism to the text of a robot file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from lxml import etree

from ....errors import BadRequest
from ....geometry.vectors import Array, build_pose, invert_pose, normalise_vector
from ....mechanism.model import Joint, JointType, Limits, Mechanism, Motor
from ....mechanism.screws import split_elementary
from ....tolerances import DIRECTION_SINE_TOL
from ... import chains, numerals, xml
from ...annotations import IMAGE, list_camera_attributes
from ...file_format import Written
from ...jointgraph import LOOP_TYPES, ORIGIN
from ...keyframes import SRDF
from ...numerals import FILE_NUMBER_MAX
from ...observation_text import list_observe_attributes
from ...tree import build_spanning_mechanism, list_outward_joints
from ..urdf.elements import build_transmission

ORIGIN_DISTANCE_TOL = 1e-12
"""Distance (m) below which a joint's centre is the origin of the link that it carries, where a file is written."""

_LOOP_NAMES = {kind: name for name, kind in LOOP_TYPES.items() if name != "continuous"}
_OWN = re.compile(r"<hrsynth[\s/>]")
NO_LIMIT = {"lower": -1000.0, "upper": 1000.0, "effort": 1000.0, "velocity": 1000.0}


def write(mechanism: Mechanism) -> Written:
    """Return the robot file of a mechanism, in which nothing is lost."""
    return Written((write_text(mechanism),))


def write_text(mechanism: Mechanism) -> str:
    """Return the text of that file: reading it gives ``spanning(mechanism)`` again, writing that the same text.

        Raises
        ------
        BadRequest
    For what the format cannot express: an observation by a link without a named camera, a universal joint whose
            axes are not perpendicular, a link that has the name of a link in between, numbers that are not finite.
    """
    return _NativeWriter(build_spanning_mechanism(mechanism)).text()


def list_joint_names(joint: Joint) -> list[str]:
    """Return the names of the file's joints for a tree joint: one for each coordinate, but one for a free joint."""
    return chains.list_chain_joints(joint.name, 1 if joint.type is JointType.FREE else joint.type.freedoms)


class _NativeWriter:
    """Writer of link after link outward from the base; every pose is relative to what reading the file will give."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        coordinates = [link.pose[:3, 3] for link in mechanism.links.values()]
        coordinates += [joint.point for joint in mechanism.joints.values()]
        scale = float(np.max(np.abs(coordinates)))
        if not scale <= FILE_NUMBER_MAX:
            raise BadRequest("coordinates of links and joints", scale, f"finite numbers up to {FILE_NUMBER_MAX:g}")
        self.decimals = numerals.count_length_decimals(scale)
        self.poses: dict[str, Array] = {mechanism.base: ORIGIN}

    def text(self) -> str:
        robot = self.mechanism
        try:
            written = {joint.name: self._tree_joint(joint) for joint in list_outward_joints(robot)}
            written |= {joint.name: [self._loop(joint)] for joint in robot.joints.values() if not joint.in_tree}
            order = sorted(robot.joints.values(), key=lambda joint: not joint.in_tree)
            root = xml.create_element("robot", name=robot.name)
            for link in robot.links.values():
                element = etree.SubElement(root, "link", name=link.name)
                xml.restore(element, link.xml)
            for joint in order:
                root.extend(written[joint.name])
            for each in robot.couplings:
                carried = (robot.joints[name].successor for name in (each.driver, each.driven))
                tags = zip(("predecessor", "successor"), carried, strict=True)
                ends = (xml.create_element(tag, link=link) for tag, link in tags)
                ratio = xml.create_element("ratio", value=numerals.format_exact(each.ratio))
                root.append(xml.create_element("coupling", *ends, ratio, name=each.name))
            self._transmissions(root, order)
            inner = [fragment for fragment in robot.xml if _OWN.match(fragment)]
            xml.restore(root, [fragment for fragment in robot.xml if fragment not in inner])
            _remove_passive_commands(root)
            if len(own := self._own(inner)) or not self.mechanism.has_open_platform:
                root.append(own)
        except ValueError as error:  # lxml: characters that no XML document can hold
            raise BadRequest("a name cannot be written", robot.name, str(error)) from None
        return xml.format_document(root)

    def _origin(self, parent: xml.Element, X: Array) -> Array:
        """Append an ``<origin>`` unless it is the identity; return the pose that reading it gives."""
        read, attributes = numerals.format_origin(X, self.decimals)
        if attributes:
            etree.SubElement(parent, "origin", attributes)
        return read

    def _tree_joint(self, joint: Joint) -> list[xml.Element]:
        """Return the chain of links and joints that a tree joint is written as."""
        X_P, X_child = self.poses[joint.predecessor], self.mechanism.links[joint.successor].pose
        tip = bool(np.linalg.norm(X_child[:3, 3] - joint.point) > ORIGIN_DISTANCE_TOL)
        X_PJ, attributes = numerals.format_origin(
            invert_pose(X_P) @ build_pose(joint.point, X_child[:3, :3]), self.decimals
        )
        X_J = X_P @ X_PJ if attributes else X_P
        parts: list[tuple[JointType, Array | None]] = [(joint.type, None)]
        if joint.type not in (JointType.FREE, JointType.FIXED):
            parts = [*split_elementary(joint.type, _compute_local_axes(joint, X_J))]
        names = list_joint_names(joint)
        links = [joint.predecessor, *names[:-1], joint.name + chains.TIP if tip else joint.successor]
        elements = []
        for name in names[1:]:
            chains.require_free(name, joint, self.mechanism.joints)
        for number, (name, (kind, axis)) in enumerate(zip(names, parts, strict=True)):
            if links[number + 1] != joint.successor:
                elements.append(self._between(links[number + 1], joint))
            element = _build_tree_element(name, _choose_tree_type(kind, joint.limits), links[number], links[number + 1])
            if attributes and number == 0:
                etree.SubElement(element, "origin", attributes)
            if axis is not None:
                etree.SubElement(element, "axis", xyz=numerals.format_axis(axis))
            _limit(element, kind, joint.limits)
            if number == 0:
                xml.restore(element, joint.xml)
            elements.append(element)
        if tip:
            element = _build_tree_element(links[-1], "fixed", links[-1], joint.successor)
            X_J = X_J @ self._origin(element, build_pose(X_J[:3, :3].T @ (X_child[:3, 3] - X_J[:3, 3])))
            elements.append(element)
        self.poses[joint.successor] = X_J
        return elements

    def _between(self, name: str, joint: Joint) -> xml.Element:
        chains.require_free(name, joint, self.mechanism.links, self.mechanism.joints)
        return xml.create_element("link", name=name)

    def _loop(self, joint: Joint) -> xml.Element:
        X_P, X_S = self.poses[joint.predecessor], self.poses[joint.successor]
        one, two = (
            xml.create_element("predecessor", link=joint.predecessor),
            xml.create_element("successor", link=joint.successor),
        )
        X_J = X_P @ self._origin(one, build_pose(X_P[:3, :3].T @ (joint.point - X_P[:3, 3])))
        X_K = X_S @ self._origin(two, invert_pose(X_S) @ X_J)
        element = xml.create_element("loop", one, two, name=joint.name, type=_LOOP_NAMES[joint.type])
        axes = [*_compute_local_axes(joint, X_J)[:1], *_compute_local_axes(joint, X_K)[1:]]
        for tag, axis in zip(("axis", "axis2"), axes, strict=False):
            etree.SubElement(element, tag, xyz=numerals.format_axis(axis))
        if joint.limits is not None:
            etree.SubElement(
                element, "limit", {k: numerals.format_exact(v) for k, v in _list_known_limits(joint.limits).items()}
            )
        xml.restore(element, joint.xml)
        return element

    def _transmissions(self, root: xml.Element, order: Sequence[Joint]) -> None:
        names = {joint.name: list_joint_names(joint) if joint.in_tree else [joint.name] for joint in order}
        every = {name for own in names.values() for name in own}
        shared: set[str] = set()
        for joint in order:
            for element in _build_transmissions(joint.motor, names[joint.name], every):
                if len(element.findall("joint")) > 1:
                    text = xml.format_canonical(element)
                    if text in shared:
                        continue
                    shared.add(text)
                root.append(element)

    def _own(self, inner: Sequence[str]) -> xml.Element:
        robot = self.mechanism
        element = etree.Element("hrsynth")
        if all(joint.in_tree for joint in robot.joints.values()):
            element.set("serial", "true")
        if not robot.formation and not robot.has_open_platform:
            said = {} if robot.turns is None else {"turns": str(robot.turns).lower()}
            etree.SubElement(element, "platform", said, link=robot.platform)
        if robot.camera is not None:
            etree.SubElement(element, "camera", link=robot.camera)
        for camera in robot.cameras:
            said = list_camera_attributes(camera, self.decimals)
            eye = etree.SubElement(element, "camera", name=camera.name, link=camera.link)
            for tag, keys in (("origin", ("xyz", "rpy")), ("image", IMAGE)):
                if inside := {key: said[key] for key in keys if key in said}:
                    etree.SubElement(eye, tag, inside)
        for seen in dict.fromkeys(
            tuple(list_observe_attributes(o, robot, self.decimals).items()) for o in robot.observations
        ):
            etree.SubElement(element, "observe", dict(seen))
        for fragment in inner:
            whole = xml.parse_fragment(fragment)
            for name, value in whole.attrib.items():
                element.set(name, value)
            element.extend(list(whole))
        return element


def _remove_passive_commands(root: xml.Element) -> None:
    """Remove the command interfaces of joints without a motor from ``<ros2_control>``: they would be read as motors."""
    driven = {joint.get("name") for joint in root.findall("transmission/joint")}
    for element in root.findall("ros2_control/joint"):
        for command in element.findall("command_interface") if element.get("name") not in driven else ():
            element.remove(command)


def _compute_local_axes(joint: Joint, X_J: Array) -> list[Array]:
    """Return the joint's axes in its frame, exactly as they will be read."""
    if joint.type is JointType.UNIVERSAL:
        cosine = float(joint.axes[0] @ joint.axes[1])
        if not abs(cosine) <= DIRECTION_SINE_TOL:
            raise BadRequest(f"cosine between the axes of the universal joint {joint.name!r}", cosine, "0")
    return [normalise_vector(numerals.parse(numerals.format_axis(X_J[:3, :3].T @ axis), 3)) for axis in joint.axes]


def _build_tree_element(name: str, kind: str, parent: str, child: str) -> xml.Element:
    ends = xml.create_element("parent", link=parent), xml.create_element("child", link=child)
    return xml.create_element("joint", *ends, name=name, type=kind)


def _choose_tree_type(kind: JointType, limits: Limits | None) -> str:
    if kind is JointType.REVOLUTE:
        bounded = limits is not None and (limits.lower is not None or limits.upper is not None)
        return "revolute" if bounded else "continuous"
    return {JointType.PRISMATIC: "prismatic", JointType.FREE: "floating"}.get(kind, "fixed")


def _limit(element: xml.Element, kind: JointType, limits: Limits | None) -> None:
    """Append a ``<limit>`` with all attributes that URDF requires; ``free`` names the values that stand for no
    limit."""
    known = {} if limits is None else _list_known_limits(limits)
    if kind is JointType.PRISMATIC or (kind is JointType.REVOLUTE and {"lower", "upper"} & set(known)):
        needed = list(NO_LIMIT)
    elif known:
        needed = ["effort", "velocity"]
    else:
        return
    free = [key for key in needed if key not in known]
    values = known | {key: NO_LIMIT[key] for key in free}
    attributes = {key: numerals.format_exact(values[key]) for key in NO_LIMIT if key in values}
    if free:
        attributes["free"] = " ".join(free)
    etree.SubElement(element, "limit", attributes)


def _list_known_limits(limits: Limits) -> dict[str, float]:
    return {key: value for key in NO_LIMIT if (value := getattr(limits, key)) is not None}


def _build_transmissions(motor: Motor | None, names: Sequence[str], all_names: set[str]) -> list[xml.Element]:
    """Yield the transmissions of one motor: those of the file it came from if they still fit, else simple ones."""
    if motor is None:
        return []
    titles = chains.list_chain_joints(motor.name, len(names))
    if motor.xml is not None:
        found = list(xml.parse_fragment(f"<motors>{motor.xml}</motors>"))
        if len(found) == len(names) and all(len(element.findall("joint")) == 1 for element in found):
            for element, title, name in zip(found, titles, names, strict=True):
                element.set("name", title)
                element.findall("joint")[0].set("name", name)
            return found
        named = {joint.get("name") for element in found for joint in element.findall("joint")}
        if set(names) <= named <= all_names:
            return found
    return [build_transmission(title, name) for title, name in zip(titles, names, strict=True)]


def write_keyframes(text: str, file: Path, keyframes: Mapping[str, Mapping[str, Array]]) -> dict[Path, str]:
    """Return the text of a URDF and that of an SRDF file with a state for each of the joint values, by the names of the
    joints as written."""
    root = xml.parse_document(text.encode(), str(file))
    names = [
        joint.get("name", "") for joint in root.iterfind("joint") if joint.get("type") not in ("fixed", "floating")
    ]
    joints = [xml.create_element("joint", name=name) for name in names]
    states = [
        xml.create_element(
            "group_state",
            *(
                xml.create_element("joint", name=joint, value=numerals.format_exact(float(values[joint][0])))
                for joint in names
            ),
            name=name,
            group="all",
        )
        for name, values in keyframes.items()
    ]
    group = xml.create_element("group", *joints, name="all")
    return {
        file: text,
        file.with_suffix(SRDF): xml.format_document(
            xml.create_element("robot", group, *states, name=root.get("name", ""))
        ),
    }
