"""MJCF: bodies and joints as a tree; ``<equality>`` closes its loops, ``<actuator>`` names its motors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ....geometry.vectors import Array, build_pose, freeze_array, invert_pose
from ....mechanism.model import JointType, Limits, Link, Motor, make_fresh_name
from ... import numerals, xml
from ...annotations import PREFIX, drop_world, read_annotation
from ...elements import XmlReader
from ...file_format import RobotFile
from ...jointgraph import ORIGIN, CouplingSpec, FrameSpec, JointGraph, JointSpec, join_names
from ...keyframes import convert_keyframe
from ..paired import join_named_pairs, join_onshape_pairs
from .content import BodyContents
from .defaults import Compiler, Defaults, expand_includes
from .names import NAMES

WORLD = "world"
_TYPES = {
    "hinge": JointType.REVOLUTE,
    "slide": JointType.PRISMATIC,
    "ball": JointType.SPHERICAL,
    "free": JointType.FREE,
}


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of an MJCF document. Raises ``BadRobotFile`` with all its defects."""
    name = str(file.path)
    root = expand_includes(file.document, name)
    defects, notes = NAMES.check(root, file)
    graph = _MjcfReader(name, root, defects).graph()
    graph.notes[:0] = notes
    return graph


@dataclass
class _MjcfReader(XmlReader):
    """Reader of bodies, sites and joints in the order of the document."""

    placed: dict[str, Array] = field(default_factory=dict)
    """X_WB of each body at the model's zero pose."""
    sites: dict[str, tuple[str, Array]] = field(default_factory=dict)
    zeros: dict[str, float] = field(default_factory=dict)
    """Coordinate that MuJoCo gives each joint at that pose (``ref``)."""

    def graph(self) -> JointGraph:
        """Return the joint graph of the document."""
        root = self.root
        self.compiler = Compiler.of(self)
        self.defaults = Defaults(self)
        self.contents = BodyContents(self, self.compiler, self.defaults)
        graph = self.result = JointGraph(root.get("model") or "robot", self.file, "MJCF", digits=self.digits)
        self.bodies = {str(each.get("name")) for each in root.iter("body")}
        self.named = self.bodies.union(str(each.get("name")) for each in root.iter("joint", "freejoint"))
        graph.links[WORLD] = Link(WORLD)
        graph.base = WORLD
        self.placed[WORLD] = ORIGIN
        for world in root.findall("worldbody"):
            self._children(world, WORLD, None, ORIGIN)
        self.require_some(graph.links.keys() - {WORLD}, "bodies", root)
        self.require_sound()
        self._keyframes()
        for section in root.findall("equality"):
            for element in xml.list_children(section):
                self._equality(element)
        if all(joint.in_tree for joint in graph.joints.values()):
            frames = {name: FrameSpec(link, freeze_array(X)) for name, (link, X) in self.sites.items()}
            join_onshape_pairs(self, graph, frames)
            join_named_pairs(graph, frames)
        for section in root.findall("actuator"):
            for element in xml.list_children(section):
                self._actuator(element)
        for element in root.iterfind("custom/text"):
            name = element.get("name", "")
            if name.startswith(PREFIX + "_"):
                wrong = read_annotation(graph, name.split("_")[1], element.get("data", ""))
                if wrong is not None:
                    self.defect(xml.get_line(element), wrong, element.get("data"))
        self.require_sound()
        return drop_world(graph)

    def _children(self, element: xml.Element, link: str, childclass: str | None, X: Array) -> None:
        """Read the sites, frames and bodies in a body or frame; ``X`` is the frame's pose in the body ``link``."""
        for child in xml.list_children(element):
            if child.tag == "site" and child.get("name"):
                self.sites[child.get("name", "")] = (link, X @ self.compiler.pose(child))
            elif child.tag == "frame":
                self._children(child, link, child.get("childclass", childclass), X @ self.compiler.pose(child))
            elif child.tag == "body":
                self._body(child, link, child.get("childclass", childclass), X @ self.compiler.pose(child))
            elif child.tag in ("replicate", "attach", "composite", "flexcomp"):
                self.defect(xml.get_line(child), f"<{child.tag}> is not read", None, "bodies written out")

    def _body(self, element: xml.Element, parent: str, childclass: str | None, X_PB: Array) -> None:
        graph = self.result
        name = element.get("name") or self._fresh("body")
        if name in graph.links:
            self.defect(xml.get_line(element), "second body of the same name", name)
            return
        graph.links[name] = Link(name, xml=self.contents.of(element, childclass), line=xml.get_line(element))
        self.placed[name] = self.placed[parent] @ X_PB
        joints = [child for child in xml.list_children(element) if child.tag in ("joint", "freejoint")]
        if not joints:
            title = self._fresh(f"{name}_fixed")
            ends = FrameSpec(parent, X_PB), FrameSpec(name)
            graph.joints[title] = JointSpec(title, JointType.FIXED, ends, line=xml.get_line(element))
        before, X = parent, X_PB
        for number, joint in enumerate(joints):
            before, X = self._joint(joint, before, X, name, childclass, last=number == len(joints) - 1)
        self._children(element, name, childclass, ORIGIN)

    def _joint(
        self, element: xml.Element, before: str, X: Array, body: str, childclass: str | None, *, last: bool
    ) -> tuple[str, Array]:
        """Add one joint of a body: from the link before it to the body, or to a link in between."""
        graph = self.result
        given = self.defaults.of(element, childclass)
        name = element.get("name") or self._fresh(f"{body}_joint")
        kind = JointType.FREE if element.tag == "freejoint" else _TYPES.get(given.get("type", "hinge"))
        if kind is None:
            self.defect(xml.get_line(element), "unknown joint type", given.get("type"), ", ".join(_TYPES))
            return before, X
        if name in graph.joints:
            self.defect(xml.get_line(element), "second joint of the same name", name)
            return before, X
        after = body
        if not last:
            after = make_fresh_name(name, graph.links, self.bodies)
            graph.links[after] = Link(after, line=xml.get_line(element))
            self.placed[after] = self.placed[body]
        centre = self._numbers(element, given, "pos", (0, 0, 0)) if kind is not JointType.FREE else np.zeros(3)
        axes: tuple[Array, ...] = ()
        if kind.axes:
            vector = self._numbers(element, given, "axis", (0, 0, 1))
            axes = (self.unit(vector, xml.get_line(element), f"axis of joint {name!r}", "0 0 0"),)
        at = build_pose(centre)
        self.zeros[name] = self._angle(element, given, "ref", kind)
        ends = FrameSpec(before, freeze_array(X @ at), xml.get_line(element)), FrameSpec(after, freeze_array(at))
        graph.joints[name] = JointSpec(
            name, kind, ends, axes, self._limits(element, given, name, kind), line=xml.get_line(element)
        )
        return after, ORIGIN

    def _fresh(self, name: str) -> str:
        """Return a name that nothing in the document has."""
        return make_fresh_name(name, self.result.links, self.result.joints, self.named)

    def _numbers(self, element: xml.Element, given: dict[str, str], key: str, default: tuple[float, ...]) -> Array:
        return self.values(given.get(key), default, xml.get_line(element), f"{key} of <{element.tag}>")

    def _angle(self, element: xml.Element, given: dict[str, str], key: str, kind: JointType) -> float:
        value = float(self._numbers(element, given, key, (0,))[0])
        return self.compiler.angle(value) if kind is JointType.REVOLUTE else value

    def _limits(self, element: xml.Element, given: dict[str, str], name: str, kind: JointType) -> Limits | None:
        limited = given.get("limited", "auto")
        if kind.freedoms != 1 or "range" not in given or limited == "false":
            return None
        lower, upper = self._numbers(element, given, "range", (0, 0))
        if kind is JointType.REVOLUTE:
            lower, upper = self.compiler.angle(lower), self.compiler.angle(upper)
        zero = self.zeros[name]
        return Limits(float(lower - zero), float(upper - zero)) if lower < upper else None

    def _equality(self, element: xml.Element) -> None:
        graph, given = self.result, self.defaults.of(element, None, "equality")
        said = element.get("name")  # which bodies and equalities may share
        name = make_fresh_name(said, graph.joints) if said else graph.fresh(str(element.tag))
        if given.get("active", "true") == "false":
            graph.note("ignored", f"the inactive equality {name!r}{self._wish(element, given)}")
        elif element.tag in ("connect", "weld"):
            ends = self._ends(element, given)
            if ends is not None and ends[0].link != ends[1].link:
                kind = JointType.SPHERICAL if element.tag == "connect" else JointType.FIXED
                graph.close(name, kind, ends, line=xml.get_line(element))
            elif ends is not None:
                self.defect(xml.get_line(element), f"{element.tag} {name!r} connects a body to itself", ends[0].link)
        elif element.tag == "joint":
            self._gear(element, given, name)
        else:
            graph.note("ignored", f"the equality {name!r} of type {element.tag}")

    def _wish(self, element: xml.Element, given: dict[str, str]) -> str:
        """Return the ``--close`` of an inactive point between two bodies; nothing for other equalities."""
        sound = len(self.defects)
        ends = self._ends(element, given) if element.tag == "connect" else None
        del self.defects[sound:]
        if ends is None or ends[0].link == ends[1].link:
            return ""
        return (
            " (--close "
            + ":".join(f"{end.link}@{numerals.format_exact_vector(end.X[:3, 3]).replace(' ', ',')}" for end in ends)
            + " closes it)"
        )

    def _ends(self, element: xml.Element, given: dict[str, str]) -> tuple[FrameSpec, FrameSpec] | None:
        line = xml.get_line(element)
        if "site1" in given or "site2" in given:
            sites = [self.sites.get(given.get(key, "")) for key in ("site1", "site2")]
            if sites[0] is None or sites[1] is None:
                self.defect(
                    line,
                    f"{element.tag} of unknown sites",
                    " ".join(given.get(k, "?") for k in ("site1", "site2")),
                    join_names(self.sites) or "a <site> of each name",
                )
                return None
            return FrameSpec(*sites[0], line), FrameSpec(*sites[1], line)
        names = [given.get("body1"), given.get("body2", WORLD)]
        for body in names:
            if body not in self.placed:
                self.defect(line, f"{element.tag} of an unknown body", body, join_names(self.placed, like=body))
        if any(body not in self.placed for body in names):
            return None
        one, two = (self.placed[str(body)] for body in names)
        if element.tag == "connect":
            X = build_pose(self._numbers(element, given, "anchor", (0, 0, 0)))
            Y = build_pose((invert_pose(two) @ one @ X)[:3, 3])
        else:
            relative = self._numbers(element, given, "relpose", (0, 1, 0, 0, 0, 0, 0))
            Y = build_pose(self._numbers(element, given, "anchor", (0, 0, 0)))
            X = invert_pose(one) @ two @ Y
            if np.any(relative[3:]):
                X = build_pose(relative[:3], self.rotation(element, relative[3:]))
        return FrameSpec(str(names[0]), freeze_array(X), line), FrameSpec(str(names[1]), freeze_array(Y), line)

    def _gear(self, element: xml.Element, given: dict[str, str], name: str) -> None:
        """y − y₀ = a₀ + a₁ (x − x₀): add a coupling; without a second joint the first is fixed."""
        graph, line = self.result, xml.get_line(element)
        driven, driver = given.get("joint1"), given.get("joint2")
        words = given.get("polycoef", "0 1 0 0 0").split()
        coefficients = self._numbers(element, {"polycoef": " ".join((words + ["0"] * 5)[:5])}, "polycoef", (0,) * 5)
        for joint in (driven, driver):
            if joint is not None and joint not in graph.joints:
                self.defect(
                    line, f"joint equality {name!r}: unknown joint", joint, join_names(graph.joints, like=joint)
                )
        if driven not in graph.joints or (driver is not None and driver not in graph.joints):
            return
        if driver is None:
            graph.note("merged", f"joint {driven!r} is fixed by an equality")
            graph.joints[driven] = replace(graph.joints[driven], type=JointType.FIXED, axes=(), limits=None)
        elif np.any(coefficients[2:]):
            self.defect(line, f"joint equality {name!r}: not linear", given.get("polycoef"), "a straight line")
        else:
            offset, ratio = (float(value) for value in coefficients[:2])
            graph.gears.append(CouplingSpec(name, driver, driven, ratio, offset, line))

    def _keyframes(self) -> None:
        """Read the keyframes by name or number; those whose size differs from the model's coordinates are noted."""
        graph = self.result
        joints = [joint for name, joint in graph.joints.items() if name in self.zeros]
        for number, key in enumerate(self.root.iterfind("keyframe/key")):
            name, words = key.get("name") or str(number), key.get("qpos")
            try:
                qpos = None if words is None else numerals.parse(words, len(words.split()))
                found = {} if qpos is None else convert_keyframe(joints, self.zeros, qpos)
            except ValueError:
                found = None
            if found is None:
                graph.note("ignored", f"the keyframe {name!r}: its qpos does not match the joints' coordinates")
            else:
                graph.postures[name] = found

    def _actuator(self, element: xml.Element) -> None:
        graph = self.result
        joint = element.get("joint") or element.get("jointinparent")
        name = element.get("name") or f"motor_{joint}"
        if joint is None:
            graph.note("ignored", f"the actuator {element.get('name')!r}, which drives no joint")
        elif joint not in graph.joints:
            self.defect(
                xml.get_line(element), "actuator of an unknown joint", joint, join_names(graph.joints, like=joint)
            )
        elif graph.joints[joint].motor is None:
            graph.joints[joint] = replace(graph.joints[joint], motor=Motor(name))
