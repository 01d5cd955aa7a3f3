"""Conventions of tools for closures that URDF cannot express: each is a function that the reader calls.

A new convention is one more function and its line in ``CONVENTIONS``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ....geometry.vectors import Array, build_plane_axes, build_pose, freeze_array, invert_pose
from ....mechanism.model import JointType
from ... import xml
from ...jointgraph import LOOP_TYPES, FrameSpec, JointGraph, Z, build_spanning_tree, compute_zero_poses
from ..extensions import read_drake, read_plugins
from ..paired import join_named_pairs, join_onshape_pairs
from ..sdf import joint as sdf
from .elements import UrdfReader

Ends = tuple[FrameSpec, FrameSpec]


@dataclass(frozen=True)
class Convention:
    """Tool that writes such closures, and the function that adds those of a document to its graph; ``tag``: their
    elements, None for links with certain names (only used if the file closes no loops otherwise)."""

    tool: str
    read: Callable[[UrdfReader, JointGraph], None]
    tag: str | None = None


def _has_known_ends(reader: UrdfReader, what: str, element: xml.Element, ends: Ends) -> bool:
    """Return True if the ends of a closure are two existing links; anything else is a defect."""
    if not all(reader.is_known_link(end.link, end.line, f"{what}: unknown link") for end in ends):
        return False
    if ends[0].link == ends[1].link:
        reader.defect(xml.get_line(element), f"{what} connects a link to itself", ends[0].link)
        return False
    return True


def read_gazebo_joints(reader: UrdfReader, graph: JointGraph) -> None:
    """Add the joints of ``<gazebo><joint>``: joints of SDFormat (in the conventions of 1.6) close a loop where their
    child is at zero; plugins that connect two links do so too."""
    found = [joint for element in reader.root.findall("gazebo") for joint in element.findall("joint")]
    plugins = [plugin for element in reader.root.findall("gazebo") for plugin in element.findall("plugin")]
    if not found and not plugins:
        return
    poses = _compute_zero_poses(graph)
    added = {link.get("name") for element in reader.root.findall("gazebo") for link in element.findall("link")}
    for element in found:
        parent, child = (sdf.read_text(element, tag) for tag in ("parent", "child"))
        if more := {parent, child} & added:
            what = "joint of <gazebo> to a link that <gazebo> adds, which is not supported"
            reader.defect(
                xml.get_line(element), what, more.pop(), "a link of the robot: declare it there, with a joint"
            )
            return
        if parent is None or child is None or parent == child:
            reader.defect(xml.get_line(element), "joint of <gazebo> without two links", element.get("name"))
            continue
        what = "joint of <gazebo>: unknown link"
        if not all(reader.is_known_link(link, xml.get_line(element), what) for link in (parent, child)):
            continue
        if parent not in poses or child not in poses:
            reader.defect(xml.get_line(element), "joint of <gazebo>: unconnected link", element.get("name"))
            continue
        X_MJ = poses[child] @ sdf.read_pose(reader, element.find("pose"))
        frames = sdf.JointFrames(invert_pose(poses[parent]) @ X_MJ, invert_pose(poses[child]) @ X_MJ, X_MJ, np.eye(3))
        sdf.add(reader, graph, element, (parent, child), frames, (1, 6), in_tree=False)
    sdf.name_gears(reader, graph)
    graph.note_assumed()
    read_plugins(graph, plugins, poses, ())


def _compute_zero_poses(graph: JointGraph) -> dict[str, Array]:
    """Return the poses (4, 4) of the links in the tree of the first root, all joints at zero."""
    carried = {joint.links[1] for joint in graph.joints.values()}
    base = next((link for link in graph.links if link not in carried), next(iter(graph.links)))
    return compute_zero_poses(
        base, build_spanning_tree(base, (joint for joint in graph.joints.values() if joint.in_tree))
    )


CONSTRAINTS = {**LOOP_TYPES, "ball": JointType.SPHERICAL, "weld": JointType.FIXED, "point": JointType.SPHERICAL}
_SIDES = ("parent", "child")


def _get_constraint_type(element: xml.Element, default: str = "") -> JointType | None:
    """Return the type of a closure, with or without the suffix ``_joint`` or ``_constraint``; None if unknown."""
    bare = element.get("type", default).strip().lower().removesuffix("_constraint").removesuffix("_joint")
    return CONSTRAINTS.get(bare)


def read_constraint(reader: UrdfReader, graph: JointGraph) -> None:
    """Add the closure of ``<constraint name type>`` as proposed for urdfdom: parent and child, each with its own origin
    and axis."""
    for element in reader.root.findall("constraint"):
        name, kind = reader.attribute(element, "name"), _get_constraint_type(element)
        if kind is None:
            reader.defect(xml.get_line(element), "unknown constraint type", element.get("type"), ", ".join(CONSTRAINTS))
            continue
        one, two = (_read_constraint_end(reader, element, side, kind) for side in _SIDES)
        if one.link is None or two.link is None:
            reader.defect(xml.get_line(element), "constraint without two links", name)
        elif name is not None and _has_known_ends(reader, "constraint", element, (one, two)):
            axes = [Z] if kind.axes < 2 else [_read_constraint_axis(reader, element, side) for side in _SIDES]
            graph.close(graph.fresh(name), kind, (one, two), axes, xml.get_line(element), reader.motors.get(name))


def _read_constraint_end(reader: UrdfReader, element: xml.Element, side: str, kind: JointType) -> FrameSpec:
    """Return the joint's frame on one link, its z axis along the axis that the element gives for it."""
    link = element.find(side)
    name = element.get(side) if link is None else link.get("link", link.text)
    origin = element.find(f"{side}_origin")
    if origin is None and link is not None:
        origin = link.find("origin")
    X = reader.pose(origin)
    if kind.axes == 1:
        z = _read_constraint_axis(reader, element, side)
        X = X @ build_pose(rotation=np.column_stack((*build_plane_axes(z), z)))
    return FrameSpec(None if name is None else name.strip(), freeze_array(X), xml.get_line(element))


def _read_constraint_axis(reader: UrdfReader, element: xml.Element, side: str) -> Array:
    """Return the axis in the frame of one side: its own, else the common one, else x."""
    own = element.find(f"{side}_axis")
    axis = element.find("axis") if own is None else own
    return np.array([1.0, 0.0, 0.0]) if axis is None else reader.direction(axis, "xyz", (1, 0, 0))


def read_loop_joint(reader: UrdfReader, graph: JointGraph) -> None:
    """Add the closure of ``<loop_joint name type>``: of Isaac Sim with two ends that have ``xyz`` and ``rpy`` (real
    files write two ``<link1>``), of exporters for Fusion with ``<parent>`` and ``<child>`` like a ``<constraint>``."""
    for element in reader.root.findall("loop_joint"):
        name = reader.attribute(element, "name")
        kind = _get_constraint_type(element, "spherical")
        if kind is None or kind.axes > 1:
            reader.defect(
                xml.get_line(element),
                "unknown loop_joint type",
                element.get("type"),
                ", ".join(key for key in CONSTRAINTS if key != "universal"),
            )
            continue
        axis = element.find("axis")
        z = Z if axis is None else reader.direction(axis, "xyz", (0, 0, 1))
        if element.find("parent") is not None:
            one, two = _read_fusion_ends(reader, graph, element)
        else:
            found = [child for child in xml.list_children(element) if child.tag in ("link1", "link2", "link")]
            if len(found) != 2:
                reader.defect(xml.get_line(element), "loop_joint: number of links", str(len(found)), "2")
                continue
            one, two = (
                FrameSpec(reader.attribute(child, "link"), reader.pose(child), xml.get_line(child)) for child in found
            )
        if name is not None and _has_known_ends(reader, "loop_joint", element, (one, two)):
            graph.close(graph.fresh(name), kind, (one, two), [z], xml.get_line(element), reader.motors.get(name))


def _read_fusion_ends(reader: UrdfReader, graph: JointGraph, element: xml.Element) -> Ends:
    """Return the parent's joint frame, parallel to the parent's own, and the child's, parallel to it in the file's
    configuration: the axis is given in the parent, and each link has the joint's point."""
    links = [str(each.get("link", each.text)).strip() for side in _SIDES for each in element.findall(side)[:1]]
    if len(links) < 2:
        reader.defect(xml.get_line(element), "loop_joint without two links", element.get("name"))
        return FrameSpec(None), FrameSpec(None)
    one, two = (reader.pose(element.find(f"{side}_origin")) for side in _SIDES)
    poses = _compute_zero_poses(graph)
    if set(links) <= set(poses):
        two = two @ build_pose(rotation=poses[links[1]][:3, :3].T @ poses[links[0]][:3, :3])
    line = xml.get_line(element)
    return FrameSpec(links[0], freeze_array(one), line), FrameSpec(links[1], freeze_array(two), line)


def read_drake_elements(reader: UrdfReader, graph: JointGraph) -> None:
    """Add Drake's ball constraints and bushings between links and ``<frame>`` elements."""
    for element in reader.root.findall("frame"):
        name, link = element.get("name"), element.get("link")
        if name is not None and link in graph.links:
            graph.frames[name] = FrameSpec(link, freeze_array(reader.pose(element)), xml.get_line(element))
    read_drake(
        reader,
        graph,
        reader.root,
        lambda name: graph.frames.get(name) or (FrameSpec(name) if name in graph.links else None),
    )


def join_named_frames(reader: UrdfReader, graph: JointGraph) -> None:
    """Close pairs of links on one fixed joint that carry nothing and whose names mark where a loop closes."""
    carried = {joint.links[1]: joint for joint in graph.joints.values()}
    carriers = {joint.links[0] for joint in graph.joints.values()}
    frames = {name: FrameSpec(name, line=link.line) for name, link in graph.links.items()}
    join_onshape_pairs(reader, graph, frames)
    join_named_pairs(
        graph,
        {
            name: frame
            for name, frame in frames.items()
            if name not in carriers and name in carried and carried[name].type is JointType.FIXED
        },
    )


CONVENTIONS = (
    Convention("Gazebo", read_gazebo_joints, "gazebo"),
    Convention("urdfdom (proposed)", read_constraint, "constraint"),
    Convention("Isaac Sim", read_loop_joint, "loop_joint"),
    Convention("Drake", read_drake_elements, "drake"),
    Convention("onshape-to-robot and others", join_named_frames),
)
"""All conventions, in the order in which their closures are added."""
