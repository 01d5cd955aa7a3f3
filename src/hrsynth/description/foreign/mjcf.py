"""MJCF: bodies and joints as a tree; ``<equality>`` closes its loops, ``<actuator>`` names its motors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...errors import BadRobotFile
from ...geometry.vectors import Array, frozen, inverse, pose
from ...mechanism.model import JointType, Limits, Link, Motor
from .. import numerals, xml
from ..draft import ORIGIN, Edge, End
from ..elements import Elements
from . import annotations as own
from .graph import Gear, Graph
from .mjcf_defaults import Defaults
from .mjcf_pose import Compiler

WORLD = "world"
_TYPES = {"hinge": JointType.REVOLUTE, "slide": JointType.PRISMATIC, "ball": JointType.SPHERICAL,
          "free": JointType.FREE}


def read(root: xml.Element, file: str) -> Graph:
    """The joint graph of an MJCF document whose includes are in place; raises ``BadRobotFile`` with all its defects."""
    return Reader(file, root).graph()


@dataclass
class Reader(Elements):
    """Bodies, sites and joints met on the way through the document."""

    placed: dict[str, Array] = field(default_factory=dict)
    """X_WB of each body at the model's zero pose."""
    sites: dict[str, tuple[str, Array]] = field(default_factory=dict)
    zeros: dict[str, float] = field(default_factory=dict)
    """The coordinate that MuJoCo gives each joint at that pose (``ref``)."""

    def graph(self) -> Graph:
        """The joint graph of the document."""
        root = self.root
        self.compiler = Compiler.of(self, root)
        self.defaults = Defaults(self, root)
        graph = self.result = Graph(root.get("model") or "robot", self.file, "MJCF")
        graph.links[WORLD] = Link(WORLD)
        graph.base = WORLD
        self.placed[WORLD] = ORIGIN
        for world in root.findall("worldbody"):
            self._children(world, WORLD, None, np.eye(4))
        if len(graph.links) == 1:
            self.defect(xml.line(root), "no bodies")
        if self.defects:
            raise BadRobotFile(self.defects)
        for section in root.findall("equality"):
            for element in xml.children(section):
                self._equality(element)
        for section in root.findall("actuator"):
            for element in xml.children(section):
                self._actuator(element)
        for element in root.iterfind("custom/text"):
            name = element.get("name", "")
            if name.startswith(own.PREFIX + "_"):
                wrong = own.apply(graph, name.split("_")[1], element.get("data", ""))
                if wrong is not None:
                    self.defect(xml.line(element), wrong, element.get("data"))
        if self.defects:
            raise BadRobotFile(self.defects)
        return own.world_dropped(graph)

    def _children(self, element: xml.Element, link: str, childclass: str | None, X: Array) -> None:
        """The sites, frames and bodies in a body or frame; ``X`` is the frame's pose in the body ``link``."""
        for child in xml.children(element):
            if child.tag == "site" and child.get("name"):
                self.sites[child.get("name", "")] = (link, X @ self.compiler.pose(self, child))
            elif child.tag == "frame":
                self._children(child, link, child.get("childclass", childclass),
                               X @ self.compiler.pose(self, child))
            elif child.tag == "body":
                self._body(child, link, child.get("childclass", childclass), X @ self.compiler.pose(self, child))
            elif child.tag in ("replicate", "attach", "composite", "flexcomp"):
                self.defect(xml.line(child), f"<{child.tag}> is not read", None, "bodies written out")

    def _body(self, element: xml.Element, parent: str, childclass: str | None, X_PB: Array) -> None:
        graph = self.result
        name = element.get("name") or graph.fresh("body")
        if name in graph.links:
            self.defect(xml.line(element), "second body of the same name", name)
            return
        graph.links[name] = Link(name, line=xml.line(element))
        self.placed[name] = self.placed[parent] @ X_PB
        joints = [child for child in xml.children(element) if child.tag in ("joint", "freejoint")]
        if not joints:
            title = graph.fresh(f"{name}_fixed")
            graph.edges[title] = Edge(title, JointType.FIXED, (End(parent, X_PB), End(name, ORIGIN)),
                                      line=xml.line(element))
        before, X = parent, X_PB
        for number, joint in enumerate(joints):
            before, X = self._joint(joint, before, X, name, childclass, last=number == len(joints) - 1)
        self._children(element, name, childclass, np.eye(4))

    def _joint(self, element: xml.Element, before: str, X: Array, body: str, childclass: str | None, *, last: bool
               ) -> tuple[str, Array]:
        """One joint of a body: from the link before it to the body, or to a link in between."""
        graph = self.result
        given = self.defaults.of(element, childclass)
        name = element.get("name") or graph.fresh(f"{body}_joint")
        kind = JointType.FREE if element.tag == "freejoint" else _TYPES.get(given.get("type", "hinge"))
        if kind is None:
            self.defect(xml.line(element), "unknown joint type", given.get("type"), ", ".join(_TYPES))
            return before, X
        if name in graph.edges:
            self.defect(xml.line(element), "second joint of the same name", name)
            return before, X
        after = body
        if not last:
            after = graph.fresh(name)
            graph.links[after] = Link(after, line=xml.line(element))
            self.placed[after] = self.placed[body]
        centre = self._numbers(element, given, "pos", (0, 0, 0)) if kind is not JointType.FREE else np.zeros(3)
        axes: tuple[Array, ...] = ()
        if kind.axes:
            vector = self._numbers(element, given, "axis", (0, 0, 1))
            size = float(np.linalg.norm(vector))
            if not size > 1e-9:
                self.defect(xml.line(element), f"axis of joint {name!r}", "0 0 0", "a non-zero vector")
                size, vector = 1.0, np.array([0.0, 0.0, 1.0])
            axes = (vector / size,)
        at = pose(centre)
        self.zeros[name] = self._angle(element, given, "ref", kind)
        graph.edges[name] = Edge(name, kind, (End(before, frozen(X @ at), xml.line(element)), End(after, frozen(at))),
                                 axes, self._limits(element, given, name, kind), line=xml.line(element))
        return after, np.eye(4)

    def _numbers(self, element: xml.Element, given: dict[str, str], key: str, default: tuple[float, ...]) -> Array:
        try:
            return numerals.parsed(given[key], len(default)) if key in given else np.array(default, dtype=float)
        except ValueError as error:
            self.defect(xml.line(element), f"{key} of <{element.tag}>", given[key], str(error))
            return np.array(default, dtype=float)

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
        name = graph.fresh(element.get("name") or str(element.tag))
        if given.get("active", "true") == "false":
            graph.note("ignored", f"the equality {name!r}, which is not active")
        elif element.tag in ("connect", "weld"):
            ends = self._ends(element, given)
            if ends is not None and ends[0].link != ends[1].link:
                kind = JointType.SPHERICAL if element.tag == "connect" else JointType.FIXED
                graph.edges[name] = Edge(name, kind, ends, line=xml.line(element), in_tree=False)
            elif ends is not None:
                self.defect(xml.line(element), f"{element.tag} {name!r} holds a body to itself", ends[0].link)
        elif element.tag == "joint":
            self._gear(element, given, name)
        else:
            graph.note("ignored", f"the equality {name!r} of type {element.tag}")

    def _ends(self, element: xml.Element, given: dict[str, str]) -> tuple[End, End] | None:
        line = xml.line(element)
        if "site1" in given or "site2" in given:
            sites = [self.sites.get(given.get(key, "")) for key in ("site1", "site2")]
            if sites[0] is None or sites[1] is None:
                self.defect(line, f"{element.tag} of unknown sites", " ".join(given.get(k, "?") for k in
                                                                             ("site1", "site2")))
                return None
            return End(*sites[0], line), End(*sites[1], line)
        names = [given.get("body1"), given.get("body2", WORLD)]
        for body in names:
            if body not in self.placed:
                self.defect(line, f"{element.tag} of an unknown body", body)
        if any(body not in self.placed for body in names):
            return None
        one, two = (self.placed[str(body)] for body in names)
        if element.tag == "connect":
            X = pose(self._numbers(element, given, "anchor", (0, 0, 0)))
            Y = pose((inverse(two) @ one @ X)[:3, 3])
        else:
            relative = self._numbers(element, given, "relpose", (0, 1, 0, 0, 0, 0, 0))
            Y = pose(self._numbers(element, given, "anchor", (0, 0, 0)))
            X = inverse(one) @ two @ Y
            if np.any(relative[3:]):
                X = pose(relative[:3], self.compiler.rotation(self, element, relative[3:]))
        return End(str(names[0]), frozen(X), line), End(str(names[1]), frozen(Y), line)

    def _gear(self, element: xml.Element, given: dict[str, str], name: str) -> None:
        """y − y₀ = a₀ + a₁ (x − x₀): a gear; without a second joint the first is held."""
        graph, line = self.result, xml.line(element)
        driven, driver = given.get("joint1"), given.get("joint2")
        words = given.get("polycoef", "0 1 0 0 0").split()
        coefficients = self._numbers(element, {"polycoef": " ".join((words + ["0"] * 5)[:5])}, "polycoef", (0,) * 5)
        for joint in (driven, driver):
            if joint is not None and joint not in graph.edges:
                self.defect(line, f"joint equality {name!r}: unknown joint", joint)
        if driven not in graph.edges or (driver is not None and driver not in graph.edges):
            return
        if driver is None:
            graph.note("merged", f"joint {driven!r} is held by an equality")
            held = graph.edges[str(driven)]
            graph.edges[str(driven)] = Edge(held.name, JointType.FIXED, held.ends, line=held.line)
        elif np.any(coefficients[2:]):
            self.defect(line, f"joint equality {name!r}: a curve", given.get("polycoef"), "a straight line")
        else:
            graph.gears.append(Gear(name, driver, str(driven), float(coefficients[1]), float(coefficients[0]), line))

    def _actuator(self, element: xml.Element) -> None:
        graph = self.result
        joint = element.get("joint") or element.get("jointinparent")
        name = element.get("name") or f"motor_{joint}"
        if joint is None:
            graph.note("ignored", f"the actuator {element.get('name')!r}, which drives no joint")
        elif joint not in graph.edges:
            self.defect(xml.line(element), "actuator of an unknown joint", joint)
        elif graph.edges[joint].motor is None:
            edge = graph.edges[joint]
            graph.edges[joint] = Edge(edge.name, edge.type, edge.ends, edge.axes, edge.limits, edge.xml, edge.line,
                                      Motor(name), edge.in_tree)
