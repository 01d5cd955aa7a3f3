"""Joints of SDFormat: frame, frame of the axes in each version, and type."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ....geometry.vectors import Array, build_pose, convert_rpy_to_rotation
from ....mechanism.model import JointType, Link, Motor, make_fresh_name
from ....tolerances import INCIDENCE_TOL, VECTOR_LENGTH_MIN
from ... import xml
from ...chains import name_chain_joint
from ...elements import XmlReader, read_sound_limits
from ...jointgraph import ORIGIN, CouplingSpec, FrameSpec, JointGraph, JointSpec

TYPES = {
    "revolute": "R",
    "continuous": "R",
    "hinge": "R",
    "prismatic": "P",
    "ball": "S",
    "fixed": "F",
    "universal": "U",
    "revolute2": "U",
    "screw": "H",
    "gearbox": "G",
    "piston": "C",
}
_AXES = {"R": ("axis",), "P": ("axis",), "H": ("axis",), "C": ("axis",), "U": ("axis", "axis2")}


def read_text(element: xml.Element | None, tag: str) -> str | None:
    """Return the text of a child element, None if it is empty or absent."""
    return None if element is None else (element.findtext(tag) or "").strip() or None


def read_numbers(reader: XmlReader, element: xml.Element | None, default: tuple[float, ...]) -> Array:
    """Return the numbers of an element, as many as the default has; the default if it holds none."""
    if element is None:
        return np.array(default, dtype=float)
    return reader.values((element.text or "").strip() or None, default, xml.get_line(element), f"<{element.tag}>")


def read_pose(reader: XmlReader, element: xml.Element | None) -> Array:
    """Return the pose (4, 4) of a ``<pose>``: x y z roll pitch yaw, with its options for degrees or a quaternion."""
    if element is None:
        return ORIGIN
    if element.get("rotation_format") == "quat_xyzw":
        values = read_numbers(reader, element, (0, 0, 0, 0, 0, 0, 1))
        return build_pose(values[:3], reader.rotation(element, np.roll(values[3:], 1)))
    values = read_numbers(reader, element, (0,) * 6)
    angles = np.radians(values[3:]) if element.get("degrees") in ("true", "1") else values[3:]
    reader.digits.angles(angles)
    return build_pose(values[:3], convert_rpy_to_rotation(*angles)) if np.any(angles) else build_pose(values[:3])


@dataclass(frozen=True, eq=False)
class JointFrames:
    """Frames of a joint in the parent link, in the child link and in the model; the model's axes in the frame of axes
    "of the model" (3, 3); a function that returns the pose of a named frame in the model, None for an unknown one."""

    X_parent: Array
    X_child: Array
    X_model: Array
    R_model: Array
    named: Callable[[str], Array | None] = lambda name: None


def add(
    reader: XmlReader,
    graph: JointGraph,
    element: xml.Element,
    links: tuple[str, str],
    frames: JointFrames,
    version: tuple[int, int],
    *,
    in_tree: bool,
    prefix: str = "",
) -> None:
    """Add the joint of a ``<joint>`` to the graph: one joint, a chain of joints, or a coupling."""
    line, bare, kind = xml.get_line(element), reader.attribute(element, "name"), TYPES.get(element.get("type", ""))
    if kind is None:
        reader.defect(line, "unknown joint type", element.get("type"), ", ".join(TYPES))
    if bare is None or kind is None:
        return
    name = prefix + bare
    if name in graph.joints:
        reader.defect(line, "second joint of the same name", name)
        return
    axes = tuple(_read_axis(reader, graph, element, tag, frames, version, name) for tag in _AXES.get(kind, ()))
    one, two = FrameSpec(links[0], frames.X_parent, line), FrameSpec(links[1], frames.X_child, line)
    if kind == "G":
        _add_gear(reader, graph, element, links, name)
    elif kind == "H" or (kind == "U" and abs(float(axes[0] @ axes[1])) > INCIDENCE_TOL):
        taken = {prefix + str(each.get("name")) for each in reader.root.iter("joint", "link")} | set(graph.joints)
        first, second = (make_fresh_name(name_chain_joint(name, k), taken, graph.links) for k in (1, 2))
        link = first
        between = FrameSpec(link, ORIGIN, line)
        graph.links[link] = Link(link, line=line)
        graph.joints[first] = JointSpec(first, JointType.REVOLUTE, (one, between), axes[:1], line=line)
        kind_of_second = JointType.REVOLUTE if kind == "U" else JointType.PRISMATIC
        graph.joints[second] = JointSpec(second, kind_of_second, (between, two), axes[-1:], line=line, in_tree=in_tree)
        if kind == "H":
            graph.gears.append(CouplingSpec(f"{name}__thread", first, second, _lead(reader, element, name), line=line))
    else:
        limit = element.find("axis/limit")
        limits = read_sound_limits(lambda key: read_text(limit, key))
        graph.joints[name] = JointSpec(name, JointType(kind), (one, two), axes, limits, (), line, None, in_tree)


def read_couplings(reader: XmlReader, joints: Iterable[tuple[str, xml.Element]]) -> list[CouplingSpec]:
    """Yield the couplings of ``<mimic>``: q = multiplier × (q of the other joint − reference) + offset."""
    found = []
    for prefix, element in joints:
        for mimic in element.findall("axis/mimic"):
            name, driver = element.get("name"), reader.attribute(mimic, "joint")
            ratio, offset, start = (
                float(read_numbers(reader, mimic.find(tag), (default,))[0])
                for tag, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
            )
            if name is not None and driver is not None:
                found.append(
                    CouplingSpec(
                        f"mimic_{prefix}{name}",
                        prefix + driver,
                        prefix + name,
                        ratio,
                        offset - ratio * start,
                        xml.get_line(mimic),
                    )
                )
    return found


def _read_axis(
    reader: XmlReader,
    graph: JointGraph,
    joint: xml.Element,
    tag: str,
    frames: JointFrames,
    version: tuple[int, int],
    name: str,
) -> Array:
    """Return an axis in the joint's frame: up to 1.4 it is given in the model's, later in the joint's unless the file
    names another."""
    element, xyz = joint.find(tag), joint.find(f"{tag}/xyz")
    if element is None:
        graph.assumed.setdefault(f"<{tag}> 0 0 1, the format's default, for joints without one", []).append(name)
    vector = reader.unit(
        read_numbers(reader, xyz, (0, 0, 1)), xml.get_line(joint), f"<{tag}> of joint {name!r}", "0 0 0"
    )
    frame = None if xyz is None else xyz.get("expressed_in")
    of_model = read_text(element, "use_parent_model_frame") in ("1", "true")
    if frame == "__model__" or of_model or (version <= (1, 4) and frame is None):
        return np.asarray(frames.X_model[:3, :3].T @ frames.R_model @ vector)
    if frame:
        X = frames.named(frame)
        if X is None:
            reader.defect(xml.get_line(joint), f"axis of joint {name!r}: expressed in an unknown frame", frame)
            return vector
        return np.asarray(frames.X_model[:3, :3].T @ X[:3, :3] @ vector)
    return vector


def _lead(reader: XmlReader, element: xml.Element, name: str) -> float:
    """Return metres per radian: from metres per rotation (right-handed), or from the older radians per metre
    (left-handed)."""
    pitch = element.find("screw_thread_pitch")
    if pitch is not None:
        return float(read_numbers(reader, pitch, (1.0,))[0]) / (2 * np.pi)
    old = float(read_numbers(reader, element.find("thread_pitch"), (1.0,))[0])
    if not abs(old) > VECTOR_LENGTH_MIN:
        reader.defect(xml.get_line(element), f"thread_pitch of joint {name!r}", "0", "another number")
        return 1.0
    return -1.0 / old


def _add_gear(reader: XmlReader, graph: JointGraph, element: xml.Element, links: tuple[str, str], name: str) -> None:
    """Add the coupling of a gearbox, between the two revolute joints on its reference body: θ₂ = −ratio θ₁."""
    body = read_text(element, "gearbox_reference_body")
    ratio = -float(read_numbers(reader, element.find("gearbox_ratio"), (1.0,))[0])
    graph.gears.append(
        CouplingSpec(name, f"{body}\n{links[0]}", f"{body}\n{links[1]}", ratio, line=xml.get_line(element))
    )


def name_gears(reader: XmlReader, graph: JointGraph) -> None:
    """Replace the links that gearboxes name by the joints of these links."""
    found = []
    for gear in graph.gears:
        names = []
        for end in (gear.driver, gear.driven):
            body, _, link = end.partition("\n")
            own = (
                [
                    joint.name
                    for joint in graph.joints.values()
                    if joint.links == (body, link) and joint.type is JointType.REVOLUTE
                ]
                if link
                else [body]
            )
            if len(own) != 1:
                reader.defect(gear.line, f"gearbox {gear.name!r}: one revolute joint from its reference body", link)
                break
            names.append(own[0])
        if len(names) == 2:
            found.append(replace(gear, driver=names[0], driven=names[1]))
    graph.gears = found


def infer_motors(graph: JointGraph) -> None:
    """Assume that the joints with a nonzero effort limit are the motors, if only some limits are zero."""
    efforts = {
        name: joint.limits.effort
        for name, joint in graph.joints.items()
        if joint.limits is not None and joint.limits.effort is not None
    }
    driven = [name for name, effort in efforts.items() if effort > 0]
    if driven and any(effort == 0 for effort in efforts.values()):
        for name in driven:
            graph.joints[name] = replace(graph.joints[name], motor=Motor(f"motor_{name}"))
        graph.note(
            "assumption",
            "the motors are " + ", ".join(driven) + ": the joints whose ``effort`` limit is not zero "
            "(--motors changes them)",
        )
