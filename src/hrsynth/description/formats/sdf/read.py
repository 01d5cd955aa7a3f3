"""SDFormat 1.4 to 1.12: the joint graph itself, with frames, poses and axes in the conventions of each version."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ....errors import BadRequest, BadRobotFile
from ....geometry.vectors import Array, freeze_array, invert_pose
from ....mechanism.model import Link
from ....tolerances import GEOMETRY_DIFFERENCE_TOL
from ... import xml
from ...annotations import NAMESPACE, drop_world, read_annotation
from ...elements import XmlReader
from ...file_format import RobotFile
from ...jointgraph import ORIGIN, FrameSpec, JointGraph, join_names
from ...keyframes import read_joint_value
from ..extensions import read_drake, read_plugins
from ..paired import join_named_pairs, join_onshape_pairs
from .content import read_content
from .includes import include_models
from .joint import JointFrames, add, infer_motors, name_gears, read_couplings, read_numbers, read_pose, read_text
from .names import NAMES

NESTED_MODELS_MAX = 20
"""Models in models above which an SDFormat file is refused."""

MODEL, WORLD = "__model__", "world"
VERSIONS = "1.4 to 1.12"


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of an SDFormat document. Raises ``BadRobotFile`` with all its defects."""
    root = file.document
    missing = include_models(root, str(file.path))
    defects, notes = NAMES.check(root, file)
    graph = _SdfReader(str(file.path), root, defects=defects, wanted=file.model).graph()
    graph.notes[:0] = [*missing, *notes]
    return graph


@dataclass(frozen=True, eq=False)
class _FrameElement:
    """Frame: the element that gives its pose, the name that the pose is relative to, the link or frame it is fixed
    to."""

    element: xml.Element | None
    relative_to: str
    fixed_to: str | None = None
    kind: str = "frame"


@dataclass
class _SdfReader(XmlReader):
    """Reader of the links, frames and joints of one model, nested models included (their names are ``model::name``)."""

    frames: dict[str, _FrameElement] = field(default_factory=dict)
    joints: list[tuple[str, xml.Element]] = field(default_factory=list)
    poses: dict[str, Array] = field(default_factory=dict)
    carried: set[str] = field(default_factory=set)
    wanted: str | None = None
    """Name of the model to read."""

    def graph(self) -> JointGraph:
        """Return the joint graph of the document's model."""
        self.version = self._version()
        model, others = self._model()
        graph = self.result = JointGraph(model.get("name") or "robot", self.file, "SDF", digits=self.digits)
        if others:
            graph.note("ignored", f"{len(others)} other models in the file: {join_names(others)}")
        self.frames[MODEL] = _FrameElement(model.find("pose"), WORLD, WORLD, "model")
        self._collect(model, "", 0)
        self.require_some(graph.links, "links", model)
        self.require_sound()
        for prefix, element in self.joints:
            self._joint(prefix, element)
        graph.note_assumed()
        name_gears(self, graph)
        graph.follow(read_couplings(self, self.joints))
        infer_motors(graph)
        self._states(model.get("name"))
        self._closures(model)
        self.require_sound()
        if any(WORLD in joint.links for joint in graph.joints.values()):
            graph.links = {WORLD: Link(WORLD), **graph.links}
            graph.base = WORLD
        space = f"{{{NAMESPACE}}}"
        for element in [each for each in xml.list_children(model) if each.tag.startswith(space)]:
            wrong = read_annotation(graph, element.tag.removeprefix(space), element.text or "")
            if wrong is not None:
                self.defect(xml.get_line(element), wrong, element.text)
        self.require_sound()
        return drop_world(graph)

    def _states(self, model: str | None) -> None:
        """Read the joints' coordinates in the states of the document's worlds, by ``world_name``."""
        for state in self.root.iterfind("world/state"):
            joints = [
                joint for each in state.findall("model") if each.get("name") == model for joint in each.findall("joint")
            ]
            found = {}
            for joint in joints:
                known = self.result.joints.get(joint.get("name", ""))
                angles = [float(read_numbers(self, angle, (0,))[0]) for angle in joint.findall("angle")]
                value = None if known is None else read_joint_value(known.kind, angles)
                if known is not None and value is not None:
                    found[known.name] = value
            if found:
                self.result.postures[state.get("world_name") or state.get("name") or "state"] = found

    def _closures(self, model: xml.Element) -> None:
        """Add the frames, and the closures of other tools' extensions."""
        found = {name: self._frame_spec(name) for name, frame in self.frames.items() if frame.kind == "frame"}
        self.result.frames = {name: frame for name, frame in found.items() if frame is not None}
        read_drake(self, self.result, model, self._frame_spec)
        plugins = [*model.findall("plugin"), *self.root.findall("world/plugin")]
        if plugins:
            poses = {link: self._pose(link, None) for link in self.result.links}
            others = [name for each in self.root.iter("model") if each is not model for name in [each.get("name")]]
            read_plugins(self.result, plugins, poses, tuple(map(str, others)))
        if all(joint.in_tree for joint in self.result.joints.values()):
            join_onshape_pairs(self, self.result, self.result.frames)
            join_named_pairs(self.result, self.result.frames)

    def _frame_spec(self, name: str) -> FrameSpec | None:
        """Return the link that a link or frame of that name is fixed to, and its pose; None for an unknown name."""
        frame = self.frames.get(name)
        line = None if frame is None or frame.element is None else xml.get_line(frame.element)
        link = None if frame is None else self._link(name, line)
        if link is None:
            return None
        return FrameSpec(link, freeze_array(invert_pose(self._pose(link, line)) @ self._pose(name, line)), line)

    def _version(self) -> tuple[int, int]:
        text = self.root.get("version", "1.6")
        parts = text.split(".")
        if (
            len(parts) != 2
            or not all(part.isascii() and part.isdigit() for part in parts)
            or len(text) > 8
            or not ((1, 4) <= (int(parts[0]), int(parts[1])) <= (1, 12))
        ):
            self.defect(xml.get_line(self.root), "version of <sdf>", text, VERSIONS)
            raise BadRobotFile(self.defects)
        return int(parts[0]), int(parts[1])

    def _model(self) -> tuple[xml.Element, list[str]]:
        """Return the named model, else the only one with joints, and the names of the others."""
        models = [*self.root.findall("model"), *self.root.findall("world/model")]
        jointed = [model for model in models if model.find(".//joint") is not None] or models
        names = [model.get("name", "") for model in models]
        if self.wanted is not None:
            jointed = [model for model in models if model.get("name") == self.wanted]
        if self.wanted is not None and not jointed:
            raise BadRequest("--model: no such model", self.wanted, join_names(names, like=self.wanted))
        if len(jointed) != 1:
            given = join_names(model.get("name", "") for model in jointed)
            self.defect(
                xml.get_line(self.root),
                "several models with joints" if jointed else "no model",
                given or None,
                "one (--model NAME)" if jointed else "a <model>",
            )
            raise BadRobotFile(self.defects)
        return jointed[0], [name for name, model in zip(names, models, strict=True) if model is not jointed[0]]

    def _collect(self, model: xml.Element, prefix: str, depth: int) -> None:
        """Collect the frames of a model and of those in it; ``prefix`` begins the names in it."""
        if depth > NESTED_MODELS_MAX:
            self.defect(xml.get_line(model), "models nested too deeply", None, f"{NESTED_MODELS_MAX} levels")
            return
        for element in xml.list_children(model):
            if element.tag not in ("link", "frame", "joint", "model"):
                continue
            bare = self.attribute(element, "name")
            if bare is None:
                continue
            name = prefix + bare
            fixed_to = None
            if element.tag == "joint":
                fixed_to = prefix + (read_text(element, "child") or "")
                self.joints.append((prefix, element))
            elif element.tag == "frame":
                host = element.get("attached_to")
                fixed_to = host if host == WORLD else prefix + (host or MODEL)
            frame = _FrameElement(
                element.find("pose"),
                self._host(prefix, element) or fixed_to or prefix + MODEL,
                fixed_to,
                str(element.tag),
            )
            if name in self.frames and not (element.tag == "joint" and self.frames[name].kind != "joint"):
                self.defect(xml.get_line(element), f"second <{element.tag}> of the same name", name)
                continue
            if element.tag == "link":
                self.result.links[name] = Link(name, xml=read_content(self, element), line=xml.get_line(element))
            if element.tag == "model":
                self.frames[name + "::" + MODEL] = frame
                self._collect(element, name + "::", depth + 1)
            self.frames.setdefault(name, frame)

    def _host(self, prefix: str, element: xml.Element) -> str | None:
        """Return the frame that the pose of an element is relative to."""
        position = element.find("pose")
        given = None if position is None else position.get("relative_to") or position.get("frame")
        return prefix + given if given and given != WORLD else given

    def _pose(self, name: str, line: int | None) -> Array:
        """Return X_WN of a frame (4, 4), by the chain of frames that it is relative to."""
        chain: list[str] = []
        while name != WORLD and name not in self.poses:
            if name in chain or name not in self.frames:
                cycle = ("frames relative to each other in a cycle", name, "a frame placed relative to the model")
                unknown = ("unknown frame", name, join_names(self.frames, like=name))
                self.defect(line, *(cycle if name in chain else unknown))
                return ORIGIN
            chain.append(name)
            name = self.frames[name].relative_to
        X = ORIGIN if name == WORLD else self.poses[name]
        for each in reversed(chain):
            X = X @ read_pose(self, self.frames[each].element)
            self.poses[each] = X
        return X

    def _link(self, name: str, line: int | None) -> str | None:
        """Return the link that a frame is fixed to."""
        links, passed = self.result.links, set()
        while name != WORLD and name not in links:
            frame = self.frames.get(name)
            if frame is None or name in passed:
                self.defect(line, "unknown link or frame", name, join_names(self.frames, like=name))
                return None
            passed.add(name)
            if frame.kind == "model":
                inner = name.removesuffix(MODEL).removesuffix("::")
                name = next((link for link in links if link.startswith(f"{inner}::") or not inner), WORLD)
            else:
                name = frame.fixed_to or WORLD
        return name

    def _joint(self, prefix: str, element: xml.Element) -> None:
        line, names = xml.get_line(element), []
        for tag in ("parent", "child"):
            name = read_text(element, tag)
            if name is None:
                self.defect(line, f"joint without <{tag}>", element.get("name"))
                return
            names.append(name if name == WORLD else prefix + name)
        parent, child = (self._link(name, line) for name in names)
        title = prefix + (element.get("name") or "")
        if parent is None or child is None:
            return
        if parent == child:
            self.defect(line, f"joint {title!r} connects a link to itself", parent)
            return
        X_J = self._pose(self._host(prefix, element) or names[1], line) @ read_pose(self, element.find("pose"))
        X_PW, X_CW = invert_pose(self._pose(parent, line)), invert_pose(self._pose(child, line))
        frames = JointFrames(
            X_PW @ X_J,
            X_CW @ X_J,
            X_J,
            self._pose(prefix + MODEL, line)[:3, :3],
            lambda name: self._pose(prefix + name, line) if prefix + name in self.frames else None,
        )
        explicit = self.frames.get(names[0])
        if explicit is not None and explicit.kind == "frame":
            X_F = self._pose(names[0], line)
            if np.linalg.norm(X_F[:3, 3] - X_J[:3, 3]) > GEOMETRY_DIFFERENCE_TOL:
                self.result.assumed.setdefault(
                    "joints connect the frames that they name, which do not coincide in the file's configuration", []
                ).append(title)
                frames = replace(frames, X_parent=X_PW @ X_F)
        in_tree = child not in self.carried and element.get("type") != "gearbox"
        if in_tree:
            self.carried.add(child)
        add(self, self.result, element, (parent, child), frames, self.version, in_tree=in_tree, prefix=prefix)
