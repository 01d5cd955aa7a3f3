"""SDFormat 1.4 to 1.12: the joint graph itself, with frames, poses and axes in the conventions of each version."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import BadRobotFile
from ...geometry.vectors import Array, inverse
from ...mechanism.model import Link
from ...tolerances import SAME_GEOMETRY
from .. import xml
from ..elements import Elements
from . import annotations as own
from . import sdf_joint
from .graph import Graph

MODEL, WORLD = "__model__", "world"
VERSIONS = "1.4 to 1.12"


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame: the element that gives its pose, what the pose is relative to, the link or frame it is fixed to."""

    element: xml.Element | None
    relative_to: str
    fixed_to: str | None = None
    kind: str = "frame"


def read(root: xml.Element, file: str) -> Graph:
    """The joint graph of an SDFormat document; raises ``BadRobotFile`` with all its defects."""
    return Reader(file, root).graph()


@dataclass
class Reader(Elements):
    """Links, frames and joints of one model, nested models included (their names are ``model::name``)."""

    frames: dict[str, Frame] = field(default_factory=dict)
    joints: list[tuple[str, xml.Element]] = field(default_factory=list)
    poses: dict[str, Array] = field(default_factory=dict)
    carried: set[str] = field(default_factory=set)

    def graph(self) -> Graph:
        """The joint graph of the document's model."""
        self.version = self._version()
        model = self._model()
        graph = Graph(model.get("name") or "robot", self.file, "SDF")
        self.frames[MODEL] = Frame(model.find("pose"), WORLD, WORLD, "model")
        self._collect(model, "", graph, 0)
        if not graph.links:
            self.defect(xml.line(model), "no links")
        if self.defects:
            raise BadRobotFile(self.defects)
        for prefix, element in self.joints:
            self._joint(prefix, element, graph)
        graph.note_assumed()
        sdf_joint.gears_named(self, graph)
        sdf_joint.motors_from_efforts(graph)
        if self.defects:
            raise BadRobotFile(self.defects)
        if any(WORLD in edge.links for edge in graph.edges.values()):
            graph.links = {WORLD: Link(WORLD), **graph.links}
            graph.base = WORLD
        own.read_sdf(self, model, graph)
        if self.defects:
            raise BadRobotFile(self.defects)
        return own.world_dropped(graph)

    def _version(self) -> tuple[int, int]:
        text = self.root.get("version", "1.6")
        parts = text.split(".")
        if len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts) or len(text) > 8 or not (
                (1, 4) <= (int(parts[0]), int(parts[1])) <= (1, 12)):
            self.defect(xml.line(self.root), "version of <sdf>", text, VERSIONS)
            raise BadRobotFile(self.defects)
        return int(parts[0]), int(parts[1])

    def _model(self) -> xml.Element:
        models = [*self.root.findall("model"), *self.root.findall("world/model")]
        jointed = [model for model in models if model.find(".//joint") is not None] or models
        if len(jointed) != 1:
            self.defect(xml.line(self.root), "number of models with joints", str(len(jointed)), "1")
            raise BadRobotFile(self.defects)
        return jointed[0]

    def _collect(self, model: xml.Element, prefix: str, graph: Graph, depth: int) -> None:
        if depth > 20:
            self.defect(xml.line(model), "models nested too deeply", None, "20 levels")
            return
        own_frame = prefix + MODEL
        for element in xml.children(model):
            if element.tag == "include":
                self.defect(xml.line(element), "an <include>: other files are not fetched",
                            sdf_joint.text(element, "uri"))
            if element.tag not in ("link", "frame", "joint", "model"):
                continue
            bare = self.attribute(element, "name")
            if bare is None:
                continue
            name = prefix + bare
            position = element.find("pose")
            given = None if position is None else position.get("relative_to") or position.get("frame")
            relative = prefix + given if given and given != WORLD else given or own_frame
            if element.tag == "joint":
                child = sdf_joint.text(element, "child") or ""
                relative = relative if given else prefix + child
                self.joints.append((prefix, element))
                frame = Frame(position, relative, prefix + child, "joint")
            elif element.tag == "frame":
                host = element.get("attached_to")
                fixed = host if host == WORLD else prefix + host if host else own_frame
                frame = Frame(position, relative if given else fixed, fixed)
            elif element.tag == "link":
                frame = Frame(position, relative, None, "link")
            else:
                frame = Frame(position, relative, None, "model")
            if name in self.frames and not (element.tag == "joint" and self.frames[name].kind != "joint"):
                self.defect(xml.line(element), f"second <{element.tag}> of the same name", name)
                continue
            if element.tag == "link":
                graph.links[name] = Link(name, line=xml.line(element))
            if element.tag == "model":
                self.frames[name + "::" + MODEL] = frame
                self._collect(element, name + "::", graph, depth + 1)
            self.frames.setdefault(name, frame)

    def pose(self, name: str, line: int | None) -> Array:
        """X_WN of a frame (4, 4), by the chain of frames that it is relative to."""
        chain: list[str] = []
        while name != WORLD and name not in self.poses:
            if name in chain or name not in self.frames:
                what = "frames relative to each other in a ring" if name in chain else "unknown frame"
                self.defect(line, what, name)
                return np.eye(4)
            chain.append(name)
            name = self.frames[name].relative_to
        X = np.eye(4) if name == WORLD else self.poses[name]
        for each in reversed(chain):
            X = X @ sdf_joint.pose_of(self, self.frames[each].element)
            self.poses[each] = X
        return X

    def body(self, name: str, graph: Graph, line: int | None) -> str | None:
        """The link that a frame is fixed to."""
        seen: set[str] = set()
        while name != WORLD and name not in graph.links:
            frame = self.frames.get(name)
            if frame is None or name in seen:
                self.defect(line, "unknown link or frame", name)
                return None
            seen.add(name)
            if frame.kind == "model":
                inner = name.removesuffix(MODEL).removesuffix("::")
                first = [link for link in graph.links if link.startswith(f"{inner}::") or not inner]
                name = first[0] if first else WORLD
            else:
                name = frame.fixed_to or WORLD
        return name

    def _joint(self, prefix: str, element: xml.Element, graph: Graph) -> None:
        line = xml.line(element)
        names = []
        for tag in ("parent", "child"):
            name = sdf_joint.text(element, tag)
            if name is None:
                self.defect(line, f"joint without <{tag}>", element.get("name"))
                return
            names.append(name if name == WORLD else prefix + name)
        links = [self.body(name, graph, line) for name in names]
        title = prefix + (element.get("name") or "")
        if None in links:
            return
        if links[0] == links[1]:
            self.defect(line, f"joint {title!r} joins a link to itself", links[0])
            return
        parent, child = str(links[0]), str(links[1])
        X_J = self.pose(names[1], line) if element.find("pose") is None else self._joint_pose(prefix, element, names[1])
        places = sdf_joint.Places(inverse(self.pose(parent, line)) @ X_J, inverse(self.pose(child, line)) @ X_J, X_J,
                                  self.pose(prefix + MODEL, line)[:3, :3])
        explicit = self.frames.get(names[0])
        if explicit is not None and explicit.kind == "frame":
            X_F = self.pose(names[0], line)
            if np.linalg.norm(X_F[:3, 3] - X_J[:3, 3]) > SAME_GEOMETRY:
                graph.assumed.setdefault("joints join the frames that they name, which do not coincide at the file's "
                                         "pose", []).append(title)
                places = replace(places, X_parent=inverse(self.pose(parent, line)) @ X_F)
        in_tree = child not in self.carried and element.get("type") != "gearbox"
        if in_tree:
            self.carried.add(child)
        sdf_joint.add(self, graph, element, (parent, child), places, self.version, in_tree=in_tree, prefix=prefix,
                      frame=lambda name: self.pose(prefix + name, line) if prefix + name in self.frames else None)

    def _joint_pose(self, prefix: str, element: xml.Element, child: str) -> Array:
        position = element.find("pose")
        given = None if position is None else position.get("relative_to") or position.get("frame")
        host = child if not given else given if given == WORLD else prefix + given
        return self.pose(host, xml.line(element)) @ sdf_joint.pose_of(self, position)
