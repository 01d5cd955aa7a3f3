"""Closures that tools add to URDF and SDFormat alike: Drake's constraints and bushings, plugins of Gazebo.

Those that are complete become closures; for others a note gives the ``--close`` that adds them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np
from lxml import etree

from ...geometry.vectors import Array, build_pose, freeze_array, invert_pose
from ...mechanism.model import JointType
from ...tolerances import INCIDENCE_TOL
from .. import xml
from ..elements import XmlReader
from ..jointgraph import FrameSpec, JointGraph

Frames = Callable[[str], FrameSpec | None]
"""Map from the name of a link or frame to the link with the frame's pose in it; None for unknown names."""

_ATTACHER = re.compile(r"attach|clos\w*.?loop|loop.?clos", re.IGNORECASE)
_ENDS = re.compile(r"link|parent|child|body", re.IGNORECASE)
"""Elements of a plugin that may name the links that it connects."""
_DETACHABLE = re.compile(r"detachable.?joint", re.IGNORECASE)
_BUSHING = "bushing_"
DRAKE = ("ball_constraint", "linear_bushing_rpy", "weld_constraint")
"""Elements of Drake that are closures."""


def strip_namespace(element: xml.Element) -> str:
    """Return the name of an element without its namespace or prefix."""
    return etree.QName(element).localname.rpartition(":")[2]


def is_drake(element: xml.Element) -> bool:
    """Return True if an element is one of Drake's, by its namespace, whatever that is."""
    space = etree.QName(element).namespace or ""
    return "drake" in space or str(element.tag).startswith("drake:")


def _read_child_text(element: xml.Element, tag: str) -> str | None:
    """Return the value of a child element: its ``value`` or ``name`` in URDF, its text in SDFormat."""
    child = next((each for each in xml.list_children(element) if strip_namespace(each) == tag), None)
    if child is None:
        return None
    return (child.get("value") or child.get("name") or child.text or "").strip() or None


def _read_ends(
    reader: XmlReader, element: xml.Element, tags: tuple[str, str], frame_of: Frames
) -> tuple[FrameSpec, FrameSpec] | None:
    """Return the two frames that child elements name; an unknown name, or one link twice, is a defect."""
    line, found = xml.get_line(element), []
    for tag in tags:
        name = _read_child_text(element, tag)
        frame = None if name is None else frame_of(name)
        if frame is None:
            reader.defect(line, f"<{strip_namespace(element)}>: unknown link or frame in <{tag}>", name)
        else:
            found.append(frame)
    if len(found) < 2:
        return None
    if found[0].link == found[1].link:
        reader.defect(line, f"<{strip_namespace(element)}>: connects a link to itself", found[0].link)
        return None
    return found[0], found[1]


def read_drake(reader: XmlReader, graph: JointGraph, root: xml.Element, frame_of: Frames) -> None:
    """Add Drake's ball constraints, as points, its welds, and its bushings, by the directions of their stiffness."""
    for element in filter(is_drake, xml.list_children(root)):
        match strip_namespace(element):
            case "ball_constraint":
                _read_ball_constraint(reader, graph, element, frame_of)
            case "linear_bushing_rpy":
                _read_bushing(reader, graph, element, frame_of)
            case name if name.endswith("_constraint"):
                _read_other_constraint(graph, element, frame_of)


def _read_other_constraint(graph: JointGraph, element: xml.Element, frame_of: Frames) -> None:
    """Add a weld of two frames, if it holds nothing else; note another constraint, with the links or frames in it."""
    name, line, children = strip_namespace(element), xml.get_line(element), xml.list_children(element)
    texts = [(child.get("value") or child.get("name") or child.text or "").strip() for child in children]
    ends = {text: frame for text in texts if (frame := frame_of(text)) is not None}
    if name == "weld_constraint" and len(texts) == len(ends) == 2 and len({end.link for end in ends.values()}) == 2:
        first, second = ends.values()
        graph.close(graph.fresh("weld_constraint"), JointType.FIXED, (first, second), line=line)
        return
    what = f"to close a loop there, use --close {':'.join(ends)}:fixed (or another type)"
    graph.note(
        "open",
        f"<drake:{name}> (line {line}) is not read" + (f"; {what}" if len(ends) == 2 else ": it names no two links"),
    )


def _read_ball_constraint(reader: XmlReader, graph: JointGraph, element: xml.Element, frame_of: Frames) -> None:
    ends = _read_ends(reader, element, ("ball_constraint_body_A", "ball_constraint_body_B"), frame_of)
    if ends is None:
        return
    points = (_read_vector(reader, element, f"ball_constraint_{point}") for point in ("p_AP", "p_BQ"))
    one, two = (
        FrameSpec(end.link, freeze_array(end.X @ build_pose(point)), end.line)
        for end, point in zip(ends, points, strict=True)
    )
    graph.close(graph.fresh("ball_constraint"), JointType.SPHERICAL, (one, two), line=xml.get_line(element))


def _read_bushing(reader: XmlReader, graph: JointGraph, element: xml.Element, frame_of: Frames) -> None:
    """Add the loop joint that constrains the directions in which a bushing is stiff, if there is one."""
    ends = _read_ends(reader, element, (_BUSHING + "frameA", _BUSHING + "frameC"), frame_of)
    if ends is None:
        return
    force, torque = (_read_vector(reader, element, f"{_BUSHING}{what}_stiffness") > 0 for what in ("force", "torque"))
    free = tuple(int(k) for k in np.flatnonzero(~force)), tuple(int(k) for k in np.flatnonzero(~torque))
    name, links = graph.fresh("bushing"), f"{ends[0].link}:{ends[1].link}"
    kind = {
        (0, 0): JointType.FIXED,
        (0, 1): JointType.REVOLUTE,
        (0, 3): JointType.SPHERICAL,
        (1, 0): JointType.PRISMATIC,
        (1, 1): JointType.CYLINDRICAL,
    }.get((len(free[0]), len(free[1])))
    if kind is None or (kind is JointType.CYLINDRICAL and free[0] != free[1]):
        graph.note(
            "open",
            f"the bushing between {ends[0].link!r} and {ends[1].link!r} is not stiff against "
            f"{len(free[0])} translations and {len(free[1])} rotations, unlike any loop joint, and is left "
            f"out (--close {links}:spherical, or another type, adds a joint)",
        )
        return
    axis = np.eye(3)[(free[1] or free[0] or (2,))[0]]
    graph.close(name, kind, ends, [axis], xml.get_line(element))
    graph.note(
        "assumption",
        f"{name!r} between {ends[0].link!r} and {ends[1].link!r} is read as a {kind.name.lower()} "
        "joint: it constrains the motions with nonzero stiffness",
    )


def _read_vector(reader: XmlReader, element: xml.Element, tag: str) -> Array:
    return reader.values(_read_child_text(element, tag), (0, 0, 0), xml.get_line(element), f"<{tag}>")


def read_plugins(
    graph: JointGraph, plugins: list[xml.Element], poses: Mapping[str, Array], models: tuple[str, ...]
) -> None:
    """Add Gazebo's detachable joints: they fix two links at their relative pose at zero (``poses`` in the model's
    frame); links of a model of another name only if their frames coincide. Plugins that attach links during the
    simulation are noted. ``models``: the other models of the file."""
    for plugin in plugins:
        title = f"{plugin.get('name', '')} {plugin.get('filename', '')}".strip()
        label = title.partition(" ")[0] or "plugin"
        named = [
            text
            for child in plugin.iter()
            if isinstance(child.tag, str) and _ENDS.search(child.tag)
            for text in [(child.text or "").strip()]
            if text in poses
        ]
        if _DETACHABLE.search(title):
            _read_detachable(graph, plugin, poses, models)
        elif len(dict.fromkeys(named)) == 2:
            pair = ":".join(dict.fromkeys(named))
            graph.note(
                "open",
                f"the plugin {label!r} names two links; if it connects them, "
                f"use --close {pair}:fixed (or another type)",
            )
        elif _ATTACHER.search(title):
            graph.note(
                "open",
                f"the plugin {label!r} can attach links during the simulation; "
                "the file does not name them: use --close A:B:TYPE if that closes a loop",
            )


def _read_detachable(
    graph: JointGraph, plugin: xml.Element, poses: Mapping[str, Array], models: tuple[str, ...]
) -> None:
    parent, child = ((plugin.findtext(f"{end}_link") or "").strip() for end in ("parent", "child"))
    model = (plugin.findtext("child_model") or "").strip()
    X = invert_pose(poses[child]) @ poses[parent] if {parent, child} <= set(poses) and parent != child else None
    if (
        X is not None
        and model not in ("", "__model__", graph.name, *models)
        and np.max(np.abs(X - np.eye(4))) > INCIDENCE_TOL
    ):
        graph.note(
            "open",
            f"the detachable joint from {parent!r} to {child!r} of the model {model!r}, which may be "
            f"this robot or another: left out (--close {parent}:{child}:fixed adds it)",
        )
        return
    if X is None or model in models:
        graph.note(
            "ignored",
            f"the detachable joint from {parent!r} to {child!r} of the model {model!r}, which are "
            "not two links of this robot",
        )
        return
    ends = FrameSpec(parent), FrameSpec(child, freeze_array(X))
    graph.close(graph.fresh("detachable_joint"), JointType.FIXED, ends, line=xml.get_line(plugin))
    graph.note(
        "assumption",
        f"the detachable joint of Gazebo fixes {parent!r} and {child!r} at their pose at zero: read as a rigid closure",
    )
