"""A joint of SDFormat: where its frame is, in which frame its axes are given in which version, what its type means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array, pose, rotation_from_rpy, unit
from ...mechanism.model import JointType, Limits, Link, Motor
from ...tolerances import NOISE
from .. import numerals, xml
from ..draft import Edge, End
from ..elements import Elements
from .graph import Gear, Graph

TYPES = {"revolute": "R", "continuous": "R", "hinge": "R", "prismatic": "P", "ball": "S", "fixed": "F",
         "universal": "U", "revolute2": "U", "screw": "H", "gearbox": "G", "piston": "C"}

FrameOf = Callable[[str], Array | None]
"""The pose of a named frame in the model, None for an unknown one."""


@dataclass(frozen=True, eq=False)
class Places:
    """The joint's frame in the parent link, in the child link and in the model; the model's axes in the frame in which
    axes "of the model" are given (3, 3)."""

    X_parent: Array
    X_child: Array
    X_model: Array
    R_model: Array


def text(element: xml.Element, tag: str) -> str | None:
    """The text of a child element, None where it is empty or not there."""
    found = element.find(tag)
    content = None if found is None else found.text
    return content.strip() or None if content else None


def numbers(reader: Elements, element: xml.Element | None, count: int, default: tuple[float, ...]) -> Array:
    """The numbers that an element holds, the default where it holds none."""
    if element is None or not (element.text or "").strip():
        return np.array(default, dtype=float)
    try:
        return numerals.parsed(element.text or "", count)
    except ValueError as error:
        reader.defect(xml.line(element), f"<{element.tag}>", (element.text or "").strip(), str(error))
        return np.array(default, dtype=float)


def pose_of(reader: Elements, element: xml.Element | None) -> Array:
    """The pose (4, 4) that a ``<pose>`` gives: x y z roll pitch yaw, degrees or a quaternion where it says so."""
    if element is None:
        return np.eye(4)
    if element.get("rotation_format") == "quat_xyzw":
        values = numbers(reader, element, 7, (0, 0, 0, 0, 0, 0, 1))
        return pose(values[:3], rotation_of(reader, element, np.roll(values[3:], 1)))
    values = numbers(reader, element, 6, (0,) * 6)
    angles = np.radians(values[3:]) if element.get("degrees") in ("true", "1") else values[3:]
    return pose(values[:3], rotation_from_rpy(*angles)) if np.any(angles) else pose(values[:3])


def rotation_of(reader: Elements, element: xml.Element, quaternion: Array) -> Array:
    """The rotation (3, 3) of a quaternion w x y z of any length."""
    size = float(np.linalg.norm(quaternion))
    if not size > 1e-9:
        reader.defect(xml.line(element), "a quaternion of length zero")
        return np.eye(3)
    w, x, y, z = quaternion / size
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def add(reader: Elements, graph: Graph, element: xml.Element, links: tuple[str, str], places: Places,
        version: tuple[int, int], *, in_tree: bool, prefix: str = "", frame: FrameOf | None = None) -> None:
    """Add what a ``<joint>`` means to the graph: one joint, or a chain of them, or a gear."""
    name = reader.attribute(element, "name")
    kind = TYPES.get(element.get("type", ""))
    if kind is None:
        reader.defect(xml.line(element), "unknown joint type", element.get("type"), ", ".join(TYPES))
    if name is None or kind is None:
        return
    name = prefix + name
    if name in graph.edges:
        reader.defect(xml.line(element), "second joint of the same name", name)
        return
    axes = [_axis(reader, graph, element, tag, places, version, name, frame) for tag in
            (("axis", "axis2") if kind == "U" else ("axis",) if kind in "RPHC" else ())]
    ends = (End(links[0], places.X_parent, xml.line(element)), End(links[1], places.X_child, xml.line(element)))
    line = xml.line(element)
    if kind == "G":
        _gear(reader, graph, element, links, name)
    elif kind == "H" or (kind == "U" and abs(float(axes[0] @ axes[1])) > NOISE):
        first, second = (JointType.REVOLUTE, JointType.REVOLUTE if kind == "U" else JointType.PRISMATIC)
        middle = graph.fresh(f"{name}__1")
        graph.links[middle] = Link(middle, line=xml.line(element))
        halves = (f"{name}__1", f"{name}__2")
        joint = End(middle, np.eye(4), xml.line(element))
        graph.edges[halves[0]] = Edge(halves[0], first, (ends[0], joint), (axes[0],), line=line)
        graph.edges[halves[1]] = Edge(halves[1], second, (joint, ends[1]), (axes[-1],), line=line, in_tree=in_tree)
        if kind == "H":
            graph.gears.append(Gear(f"{name}__thread", halves[0], halves[1], _lead(reader, element, name),
                                    line=xml.line(element)))
    else:
        type_ = JointType(kind)
        graph.edges[name] = Edge(name, type_, ends, tuple(axes), _limits(element), (), line, None, in_tree)


def _axis(reader: Elements, graph: Graph, joint: xml.Element, tag: str, places: Places, version: tuple[int, int],
          name: str, frame_of: FrameOf | None) -> Array:
    """An axis in the joint's frame: up to 1.4 it is given in the model's, later in the joint's unless the file says."""
    element = joint.find(tag)
    if element is None:
        graph.assumed.setdefault(f"<{tag}> 0 0 1 as the format's default, of joints that have none", []).append(name)
        vector, frame = np.array([0.0, 0.0, 1.0]), None
    else:
        vector = numbers(reader, element.find("xyz"), 3, (0, 0, 1))
        frame = None if element.find("xyz") is None else element.find("xyz").get("expressed_in")  # type: ignore[union-attr]
    if not np.linalg.norm(vector) > 1e-9:
        reader.defect(xml.line(joint), f"<{tag}> of joint {name!r}", "0 0 0", "a non-zero vector")
        return np.array([0.0, 0.0, 1.0])
    vector = unit(vector)
    parent = element is not None and text(element, "use_parent_model_frame") in ("1", "true")
    if frame == "__model__" or parent or (version <= (1, 4) and frame is None):
        return np.asarray(places.X_model[:3, :3].T @ places.R_model @ vector)
    if frame:
        X = None if frame_of is None else frame_of(frame)
        if X is None:
            reader.defect(xml.line(joint), f"axis of joint {name!r}: expressed in an unknown frame", frame)
            return vector
        return np.asarray(places.X_model[:3, :3].T @ X[:3, :3] @ vector)
    return vector


def _limits(joint: xml.Element) -> Limits | None:
    limit = joint.find("axis/limit")
    values: dict[str, float] = {}
    for tag in ("lower", "upper", "velocity", "effort") if limit is not None else ():
        try:
            value = float(numerals.parsed(text(limit, tag) or "", 1)[0])  # type: ignore[arg-type]
        except ValueError:
            continue
        if tag in ("lower", "upper") or value >= 0:
            values[tag] = value
    if "lower" in values and "upper" in values and not values["lower"] < values["upper"]:
        values = {key: value for key, value in values.items() if key not in ("lower", "upper")}
    return Limits(**values) if values else None


def _lead(reader: Elements, element: xml.Element, name: str) -> float:
    """Metres a radian: from metres a turn (right-handed), or from the older radians a metre (left-handed)."""
    pitch = element.find("screw_thread_pitch")
    if pitch is not None:
        return float(numbers(reader, pitch, 1, (1.0,))[0]) / (2 * np.pi)
    old = float(numbers(reader, element.find("thread_pitch"), 1, (1.0,))[0])
    if not abs(old) > 1e-9:
        reader.defect(xml.line(element), f"thread_pitch of joint {name!r}", "0", "another number")
        return 1.0
    return -1.0 / old


def _gear(reader: Elements, graph: Graph, element: xml.Element, links: tuple[str, str], name: str) -> None:
    """A gearbox couples the two revolute joints on its reference body: θ₂ = −ratio θ₁."""
    body = text(element, "gearbox_reference_body")
    ratio = -float(numbers(reader, element.find("gearbox_ratio"), 1, (1.0,))[0])
    graph.gears.append(Gear(name, f"{body}\n{links[0]}", f"{body}\n{links[1]}", ratio, line=xml.line(element)))


def gears_named(reader: Elements, graph: Graph) -> None:
    """Put the joints' names where gearboxes name the links that they join."""
    found = []
    for gear in graph.gears:
        names = []
        for end in (gear.driver, gear.driven):
            if "\n" not in end:
                names.append(end)
                continue
            body, link = end.split("\n")
            own = [edge.name for edge in graph.edges.values() if edge.links == (body, link)
                   and edge.type is JointType.REVOLUTE]
            if len(own) != 1:
                reader.defect(gear.line, f"gearbox {gear.name!r}: one revolute joint from its reference body", link)
                break
            names.append(own[0])
        if len(names) == 2:
            found.append(Gear(gear.name, names[0], names[1], gear.ratio, gear.offset, gear.line))
    graph.gears = found


def motors_from_efforts(graph: Graph) -> None:
    """Where some joints have the effort limit zero and others do not, the others are the motors."""
    efforts = {name: edge.limits.effort for name, edge in graph.edges.items()
               if edge.limits is not None and edge.limits.effort is not None}
    driven = [name for name, effort in efforts.items() if effort > 0]
    if driven and any(effort == 0 for effort in efforts.values()):
        for name in driven:
            edge = graph.edges[name]
            graph.edges[name] = Edge(name, edge.type, edge.ends, edge.axes, edge.limits, edge.xml, edge.line,
                                     Motor(f"motor_{name}"), edge.in_tree)
        graph.note("guess", "the motors are " + ", ".join(driven) + ": the joints whose effort limit is not zero "
                            "(--motors to change them)")
