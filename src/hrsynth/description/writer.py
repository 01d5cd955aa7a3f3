"""From a mechanism to the text of a robot file in the native dialect."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from lxml import etree

from ..budgets import LARGEST_NUMBER
from ..errors import BadRequest
from ..geometry.vectors import Array, frozen, inverse, pose, unit
from ..mechanism.model import Joint, JointType, Limits, Mechanism, Motor
from ..mechanism.observation import Direction
from ..tolerances import AT_ORIGIN, SAME_DIRECTION
from . import chains, numerals, xml
from .tree import outward, spanning

LOOP_TYPES = {
    JointType.REVOLUTE: "revolute", JointType.PRISMATIC: "prismatic", JointType.CYLINDRICAL: "cylindrical",
    JointType.UNIVERSAL: "universal", JointType.SPHERICAL: "spherical", JointType.PLANAR: "planar",
    JointType.FIXED: "fixed",
}
_OWN = re.compile(r"<hrsynth[\s/>]")
_NO_LIMIT = {"lower": -1000.0, "upper": 1000.0, "effort": 1000.0, "velocity": 1000.0}
INTERFACE = "hardware_interface/VelocityJointInterface"


def write(mechanism: Mechanism) -> str:
    """The robot file of a mechanism: reading it gives ``spanning(mechanism)`` again, writing that the same text.

    Raises
    ------
    BadRequest
        For what the dialect cannot say: an observation that is no direction, a universal joint whose axes are not
        perpendicular, a link that has the name of a link in between, numbers that are not finite.
    """
    return _Writer(spanning(mechanism)).text()


@dataclass
class _Written:
    """What is written of one joint: its elements, and the names of the joints that a transmission may name."""

    elements: list[xml.Element] = field(default_factory=list)
    names: list[str] = field(default_factory=list)


class _Writer:
    """Writes link by link outward from the base; every pose is relative to what reading the file will give."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        coordinates = [link.pose[:3, 3] for link in mechanism.links.values()]
        coordinates += [joint.point for joint in mechanism.joints.values()]
        scale = float(np.max(np.abs(coordinates)))
        if not scale <= LARGEST_NUMBER:
            raise BadRequest("coordinates of links and joints", scale, f"finite numbers up to {LARGEST_NUMBER:g}")
        self.decimals = numerals.length_decimals(scale)
        self.poses: dict[str, Array] = {mechanism.base: frozen(np.eye(4))}

    def text(self) -> str:
        mechanism = self.mechanism
        try:
            root = etree.Element("robot", name=mechanism.name)
            for link in mechanism.links.values():
                element = etree.SubElement(root, "link", name=link.name)
                xml.restore(element, link.xml)
            written = {joint.name: self._tree_joint(joint) for joint in outward(mechanism)}
            written |= {joint.name: self._loop(joint) for joint in mechanism.joints.values() if not joint.in_tree}
            order = sorted(mechanism.joints.values(), key=lambda joint: not joint.in_tree)
            for joint in order:
                root.extend(written[joint.name].elements)
            self._couplings(root)
            self._transmissions(root, order, written)
            inner = [fragment for fragment in mechanism.xml if _OWN.match(fragment)]
            xml.restore(root, [fragment for fragment in mechanism.xml if fragment not in inner])
            root.append(self._own(inner))
        except ValueError as error:  # lxml: characters that no XML document can hold
            raise BadRequest("a name cannot be written", mechanism.name, str(error)) from None
        return xml.text_of(root)

    def _origin(self, parent: xml.Element, X: Array) -> Array:
        """Append an ``<origin>`` unless it says nothing; the pose that reading it gives."""
        read, attributes = numerals.origin(X, self.decimals)
        if attributes:
            etree.SubElement(parent, "origin", attributes)
        return read

    def _tree_joint(self, joint: Joint) -> _Written:
        written = _Written()
        X_P, X_child = self.poses[joint.predecessor], self.mechanism.links[joint.successor].pose
        tip = bool(np.linalg.norm(X_child[:3, 3] - joint.point) > AT_ORIGIN)
        X_PJ, attributes = numerals.origin(inverse(X_P) @ pose(joint.point, X_child[:3, :3]), self.decimals)
        X_J = X_P @ X_PJ if attributes else X_P
        local = _local_axes(joint, X_J)
        parts: list[tuple[JointType, Array | None]] = [*chains.parts(joint.type, local)]
        parts = parts or [(joint.type, local[0] if local else None)]
        names = [joint.name] if len(parts) == 1 else [chains.part(joint.name, n + 1) for n in range(len(parts))]
        ends = [*names[:-1], joint.name + chains.TIP if tip else joint.successor]
        for number, (name, (kind, axis), end) in enumerate(zip(names, parts, ends, strict=True)):
            if end != joint.successor:
                written.elements.append(self._between(end, joint))
            element = etree.Element("joint", name=name, type=_tree_type(kind, joint.limits))
            etree.SubElement(element, "parent", link=ends[number - 1] if number else joint.predecessor)
            etree.SubElement(element, "child", link=end)
            if attributes and number == 0:
                etree.SubElement(element, "origin", attributes)
            if axis is not None:
                etree.SubElement(element, "axis", xyz=numerals.axis(axis))
            _limit(element, kind, joint.limits)
            if number == 0:
                xml.restore(element, joint.xml)
            written.elements.append(element)
        written.names = names
        if tip:
            element = etree.Element("joint", name=ends[-1], type="fixed")
            etree.SubElement(element, "parent", link=ends[-1])
            etree.SubElement(element, "child", link=joint.successor)
            offset = X_J[:3, :3].T @ (X_child[:3, 3] - X_J[:3, 3])
            X_J = X_J @ self._origin(element, pose(offset))
            written.elements.append(element)
        self.poses[joint.successor] = X_J
        return written

    def _between(self, name: str, joint: Joint) -> xml.Element:
        if name in self.mechanism.links or name in self.mechanism.joints:
            raise BadRequest(f"a link in between of joint {joint.name!r} would take the name of another part", name)
        return etree.Element("link", name=name)

    def _loop(self, joint: Joint) -> _Written:
        element = etree.Element("loop", name=joint.name, type=LOOP_TYPES[joint.type])
        X_P, X_S = self.poses[joint.predecessor], self.poses[joint.successor]
        end = etree.SubElement(element, "predecessor", link=joint.predecessor)
        X_J = X_P @ self._origin(end, pose(X_P[:3, :3].T @ (joint.point - X_P[:3, 3])))
        end = etree.SubElement(element, "successor", link=joint.successor)
        X_K = X_S @ self._origin(end, inverse(X_S) @ X_J)
        axes = [*_local_axes(joint, X_J)[:1], *_local_axes(joint, X_K)[1:]]
        for tag, axis in zip(("axis", "axis2"), axes, strict=False):
            etree.SubElement(element, tag, xyz=numerals.axis(axis))
        if joint.limits is not None:
            given = {key: getattr(joint.limits, key) for key in _NO_LIMIT}
            etree.SubElement(element, "limit", {k: numerals.exact(v) for k, v in given.items() if v is not None})
        xml.restore(element, joint.xml)
        return _Written([element], [joint.name])

    def _couplings(self, root: xml.Element) -> None:
        for coupling in self.mechanism.couplings:
            element = etree.SubElement(root, "coupling", name=coupling.name)
            etree.SubElement(element, "predecessor", link=coupling.predecessor)
            etree.SubElement(element, "successor", link=coupling.successor)
            etree.SubElement(element, "ratio", value=numerals.exact(coupling.ratio))

    def _transmissions(self, root: xml.Element, order: Sequence[Joint], written: dict[str, _Written]) -> None:
        names = {name for each in written.values() for name in each.names}
        shared: set[str] = set()
        for joint in order:
            if joint.motor is not None:
                for element in _motors(joint.motor, written[joint.name].names, names):
                    if len(element.findall("joint")) > 1:
                        text = xml.kept(element)
                        if text in shared:
                            continue
                        shared.add(text)
                    root.append(element)

    def _own(self, inner: Sequence[str]) -> xml.Element:
        mechanism = self.mechanism
        element = etree.Element("hrsynth")
        if all(joint.in_tree for joint in mechanism.joints.values()):
            element.set("serial", "true")
        etree.SubElement(element, "platform", link=mechanism.platform)
        if mechanism.camera is not None:
            etree.SubElement(element, "camera", link=mechanism.camera)
        for observation in mechanism.observations:
            if type(observation) is not Direction:
                raise BadRequest(f"observation of leg {observation.leg!r}", type(observation).__name__, "a direction")
            etree.SubElement(element, "observe", leg=observation.leg, link=observation.link,
                             axis=numerals.axis(observation.direction))
        for fragment in inner:
            whole = xml.parsed(fragment)
            for name, value in whole.attrib.items():
                element.set(name, value)
            element.extend(list(whole))
        return element


def _local_axes(joint: Joint, X_J: Array) -> list[Array]:
    """The joint's axes in its frame, exactly as they will be read."""
    if joint.type is JointType.UNIVERSAL:
        cosine = float(joint.axes[0] @ joint.axes[1])
        if not abs(cosine) <= SAME_DIRECTION:
            raise BadRequest(f"cosine between the axes of the universal joint {joint.name!r}", cosine, "0")
    return [unit(numerals.parsed(numerals.axis(X_J[:3, :3].T @ axis), 3)) for axis in joint.axes]


def _tree_type(kind: JointType, limits: Limits | None) -> str:
    if kind is JointType.REVOLUTE:
        bounded = limits is not None and (limits.lower is not None or limits.upper is not None)
        return "revolute" if bounded else "continuous"
    return {JointType.PRISMATIC: "prismatic", JointType.FREE: "floating"}.get(kind, "fixed")


def _limit(element: xml.Element, kind: JointType, limits: Limits | None) -> None:
    """Append a ``<limit>`` with all that URDF demands; ``free`` names the values that stand for no limit."""
    given = {} if limits is None else {key: getattr(limits, key) for key in _NO_LIMIT}
    known = {key: value for key, value in given.items() if value is not None}
    if kind is JointType.PRISMATIC or (kind is JointType.REVOLUTE and {"lower", "upper"} & set(known)):
        needed = list(_NO_LIMIT)
    elif known:
        needed = ["effort", "velocity"]
    else:
        return
    free = [key for key in needed if key not in known]
    values = known | {key: _NO_LIMIT[key] for key in free}
    attributes = {key: numerals.exact(values[key]) for key in _NO_LIMIT if key in values}
    if free:
        attributes["free"] = " ".join(free)
    etree.SubElement(element, "limit", attributes)


def _motors(motor: Motor, names: Sequence[str], all_names: set[str]) -> list[xml.Element]:
    """The transmissions of one motor: those of the file it came from where they still fit, else simple ones."""
    titles = [motor.name] if len(names) == 1 else [chains.part(motor.name, n + 1) for n in range(len(names))]
    if motor.xml is not None:
        found = list(xml.parsed(f"<motors>{motor.xml}</motors>"))
        if len(found) == len(names) and all(len(element.findall("joint")) == 1 for element in found):
            for element, title, name in zip(found, titles, names, strict=True):
                element.set("name", title)
                element.findall("joint")[0].set("name", name)
            return found
        named = {joint.get("name") for element in found for joint in element.findall("joint")}
        if set(names) <= named <= all_names:
            return found
    return [simple_transmission(title, name) for title, name in zip(titles, names, strict=True)]


def simple_transmission(title: str, joint: str, interface: str | None = INTERFACE) -> xml.Element:
    """The transmission of a motor of which nothing is known but its name; other parsers demand an interface."""
    element = etree.Element("transmission", name=title)
    etree.SubElement(element, "type").text = "transmission_interface/SimpleTransmission"
    target = etree.SubElement(element, "joint", name=joint)
    if interface is not None:
        etree.SubElement(target, "hardwareInterface").text = interface
    etree.SubElement(element, "actuator", name=title)
    return element
