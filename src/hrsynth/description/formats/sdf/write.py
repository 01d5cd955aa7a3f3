"""A mechanism as SDFormat 1.9: its joint graph, axes in the model's frame."""

from __future__ import annotations

import re

import numpy as np
from lxml import etree

from ....errors import BadRequest
from ....geometry.vectors import build_pose, invert_pose
from ....mechanism.model import Joint, JointType, Mechanism, Note
from ... import numerals, xml
from ...annotations import NAMESPACE, PREFIX, list_annotations
from ...chains import BODY
from ...contents import SIZES, collect_content, list_unsupported_content
from ...file_format import Written
from ...jointgraph import join_names
from ...reduction import reduce, require_free_world
from .content import write_content, write_pose

_NAMES = {
    JointType.REVOLUTE: "revolute",
    JointType.PRISMATIC: "prismatic",
    JointType.SPHERICAL: "ball",
    JointType.UNIVERSAL: "universal",
    JointType.FIXED: "fixed",
}
WORLD = "world"
_OWN = re.compile("__.*__", re.DOTALL)


def write(mechanism: Mechanism) -> Written:
    """Return the SDFormat text of a mechanism, and warnings of losses."""
    robot, lost = reduce(mechanism, tuple(_NAMES), tuple(_NAMES), tuple(_NAMES), BODY)
    require_free_world(robot, WORLD, "SDFormat")
    lost = (*lost, *_warn_names(robot))
    gears = {gear.driven: gear for gear in robot.couplings}
    if len(gears) < len(robot.couplings):
        more = join_names(gear.name for gear in robot.couplings if gear not in gears.values())
        lost = (*lost, Note("warning", f"a joint of SDFormat follows one other joint; not written: {more}"))
    root = etree.Element("sdf", version="1.11" if gears else "1.9")
    model = etree.SubElement(root, "model", name=robot.name, nsmap={PREFIX: NAMESPACE})
    for link in robot.links.values():
        if link.name != WORLD:
            element = etree.SubElement(model, "link", name=link.name)
            write_pose(element, link.pose)
            write_content(element, collect_content(link, robot))
    if robot.base != WORLD:
        weld = etree.SubElement(model, "joint", name=robot.fresh("to_world"), type="fixed")
        etree.SubElement(weld, "parent").text = WORLD
        etree.SubElement(weld, "child").text = robot.base
    for joint in sorted(robot.joints.values(), key=lambda each: not each.in_tree):
        gear = gears.get(joint.name)
        _write_joint(model, robot, joint, None if gear is None else (gear.driver, gear.ratio))
    for key, text in list_annotations(robot, motors=True):
        etree.SubElement(model, f"{{{NAMESPACE}}}{key}").text = text
    return Written((xml.format_document(root),), (*lost, *list_unsupported_content(robot, SIZES, dialect="SDFormat")))


def _warn_names(robot: Mechanism) -> list[Note]:
    """Return warnings of names that SDFormat's own readers refuse. Raises ``BadRequest`` for reserved names."""
    links, joints = robot.links.keys(), robot.joints.keys()
    own = sorted(name for name in {*links, *joints} if _OWN.fullmatch(name))
    if own:
        raise BadRequest(
            f"{robot.name}: SDFormat reserves names between double underscores",
            ", ".join(own),
            "other names of links and joints",
        )
    odd = [f"{name!r} (::)" for name in sorted({*links, *joints}) if "::" in name]
    odd += [f"{name!r} (of a link and a joint)" for name in sorted(links & joints)]
    return [Note("warning", "names that Gazebo refuses (rename them): " + join_names(odd))] if odd else []


def _write_joint(model: xml.Element, robot: Mechanism, joint: Joint, gear: tuple[str, float] | None) -> None:
    bounded = joint.limits is not None and (joint.limits.lower is not None or joint.limits.upper is not None)
    kind = "continuous" if joint.type is JointType.REVOLUTE and not bounded else _NAMES[joint.type]
    element = etree.SubElement(model, "joint", name=joint.name, type=kind)
    etree.SubElement(element, "parent").text = joint.predecessor
    if joint.successor == WORLD:
        raise BadRequest(f"{robot.name}: joint {joint.name!r} has the world as its child", WORLD, "a link")
    etree.SubElement(element, "child").text = joint.successor
    write_pose(element, build_pose((invert_pose(robot.links[joint.successor].pose) @ np.append(joint.point, 1.0))[:3]))
    for tag, axis in zip(("axis", "axis2"), joint.axes, strict=False):
        part = etree.SubElement(element, tag)
        etree.SubElement(part, "xyz", expressed_in="__model__").text = numerals.format_axis(axis)
        if gear is not None:
            mimic = etree.SubElement(part, "mimic", joint=gear[0])
            for key, value in (("multiplier", gear[1]), ("offset", 0.0), ("reference", 0.0)):
                etree.SubElement(mimic, key).text = numerals.format_exact(value)
        if joint.limits is not None and tag == "axis":
            limit = etree.SubElement(part, "limit")
            for key in ("lower", "upper", "effort", "velocity"):
                value = getattr(joint.limits, key)
                if value is not None:
                    etree.SubElement(limit, key).text = numerals.format_exact(value)
