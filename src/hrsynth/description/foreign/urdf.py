"""URDF as the world writes it: URDF+ (``<loop>``, ``<coupling>``), ``<mimic>``, two joints with one child, closures of
other tools; what does not concern kinematics may be wrong."""

from __future__ import annotations

import numpy as np

from ...errors import BadRobotFile
from ...mechanism.model import JointType, Limits, Motor
from ...mechanism.observation import Direction
from .. import numerals, xml
from ..draft import ORIGIN, Edge, End
from ..urdf import TREE_TYPES, Urdf
from . import gazebo, isaac, onshape, urdfdom
from .graph import Gear, Graph, listed

TYPES = {**TREE_TYPES, "spherical": JointType.SPHERICAL, "ball": JointType.SPHERICAL}
_LIMITS = ("lower", "upper", "velocity", "effort")


def read(root: xml.Element, file: str, *, frames: bool = True) -> Graph:
    """The joint graph of a URDF document; raises ``BadRobotFile`` with all its defects.

    ``frames`` says whether links may be closing frames by their names: not where loops are given in other words.
    """
    return Reader(file, root).graph(frames and root.find("hrsynth") is None)


class Reader(Urdf):
    """The tolerant reader."""

    def graph(self, frames: bool) -> Graph:
        """All links, joints and closures."""
        root = self.root
        graph = Graph(root.get("name") or "robot", self.file, "URDF")
        self.result = graph
        self.gears: list[tuple[str, str, float, float, int | None]] = []
        self.carried: set[str | None] = set()
        for element in xml.children(root):
            if element.tag == "link":
                self.link(element)
            elif element.tag == "joint":
                self.joint(element)
            elif element.tag == "loop":
                self.loop(element)
        names: set[str] = set()
        for element in root.findall("coupling"):
            self.coupling(element, names)
        for element in root.findall("transmission"):
            self.transmission(element)
        self._complete()
        graph.links, graph.edges = self.links, self._edges()
        graph.rest = list(xml.unknown(root, ["name"], ["link", "joint", "loop", "coupling", "transmission", "gazebo",
                                                        "constraint", "loop_joint", "hrsynth"]))
        self._gears()
        for closures in (gazebo, urdfdom, isaac, *((onshape,) if frames else ())):
            closures.read(self, graph)
        self._own()
        if self.defects:
            raise BadRobotFile(self.defects)
        return graph

    def joint(self, element: xml.Element) -> None:
        kind = element.get("type", "")
        child = element.find("child")
        second = child is not None and child.get("link") in self.carried
        name = element.get("name")
        X = self.origin(element)
        ends = []
        for tag in ("parent", "child"):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.line(element), f"joint without <{tag}>", name)
            ends.append(End(None if end is None else self.attribute(end, "link"), X if tag == "parent" else ORIGIN,
                            xml.line(element) if end is None else xml.line(end)))
        self.edge(element, TYPES, (ends[0], ends[1]), ["origin", "parent", "child", "mimic"])
        if second and name in self.tree:
            self.loops[name] = self.tree.pop(name)
            self.result.note("merged", f"joint {name!r} is a second one with the child {child.get('link')!r}: "  # type: ignore[union-attr]
                                       "it closes a loop")
        elif child is not None:
            self.carried.add(child.get("link"))
        for mimic in element.findall("mimic")[:1]:
            self._mimic(mimic, name, kind)

    def _mimic(self, mimic: xml.Element, name: str | None, kind: str) -> None:
        driver = self.attribute(mimic, "joint")
        ratio, offset = (float(self.numbers(mimic, key, (default,))[0]) for key, default in
                         (("multiplier", 1.0), ("offset", 0.0)))
        if name is not None and driver is not None:
            self.gears.append((driver, name, ratio, offset, xml.line(mimic)))

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        """Limits that are numbers in order; anything else is no limit."""
        limit = element.find("limit")
        values: dict[str, float] = {}
        free = "" if limit is None else limit.get("free", "")
        for key in _LIMITS if limit is not None else ():
            try:
                value = float(numerals.parsed(limit.get(key, ""), 1)[0])  # type: ignore[union-attr]
            except ValueError:
                continue
            if key in free.split():
                continue
            if key in ("lower", "upper") or value >= 0:
                values[key] = value
        bounds = values.get("lower"), values.get("upper")
        both = bounds[0] is not None and bounds[1] is not None
        if kind == "continuous" or (both and not bounds[0] < bounds[1]):  # type: ignore[operator]
            values.pop("lower", None)
            values.pop("upper", None)
        return Limits(**values) if values else None

    def transmission(self, element: xml.Element) -> None:
        name = element.get("name") or "motor"
        for joint in element.findall("joint"):
            target = joint.get("name")
            known = {**self.tree, **self.loops}
            if target in known and known[target].type is not JointType.FIXED:
                self.motors.setdefault(target, Motor(name))
            elif target is not None:
                self.result.note("ignored", f"transmission {name!r}: no joint {target!r} that moves")

    def _complete(self) -> None:
        """Every end of every joint is a link that is there, and no joints carry each other in a ring."""
        if self.defects and len(self.links) < len(self.root.findall("link")):
            raise BadRobotFile(self.defects)
        for edge in (*self.tree.values(), *self.loops.values()):
            for end in edge.ends:
                self.known(end.link, end.line, f"joint {edge.name!r}: unknown link")
            if edge.ends[0].link is not None and edge.ends[0].link == edge.ends[1].link:
                self.defect(edge.line, f"{edge.name!r} joins a link to itself", edge.ends[0].link)
        if not self.links:
            self.defect(xml.line(self.root), "no links")
        self._no_ring()
        if self.defects:
            raise BadRobotFile(self.defects)

    def _no_ring(self) -> None:
        carrier = {edge.ends[1].link: edge for edge in self.tree.values()}
        clear: set[str | None] = set()
        for start in carrier:
            way: list[str | None] = []
            link = start
            while link in carrier and link not in clear and link not in way:
                way.append(link)
                link = carrier[link].ends[0].link
            if link in way and len(way) - way.index(link) > 1:
                ring = [carrier[each] for each in reversed(way[way.index(link):])]
                self.defect(ring[0].line, "joints that carry each other in a ring",
                            listed(str(edge.name) for edge in ring), "a tree that hangs on one link")
            clear.update(way)

    def _edges(self) -> dict[str, Edge]:
        edges = {}
        for table, in_tree in ((self.tree, True), (self.loops, False)):
            for name, edge in table.items():
                edges[name] = Edge(edge.name, edge.type, edge.ends, edge.axes, edge.limits, edge.xml, edge.line,
                                   self.motors.get(name), in_tree)
        return edges

    def _gears(self) -> None:
        graph = self.result
        carrier = {edge.links[1]: name for name, edge in graph.edges.items() if edge.in_tree}
        for coupling in self.couplings:
            ends = [carrier.get(link) for link in (coupling.predecessor, coupling.successor)]
            if None in ends:
                self.defect(coupling.line, f"coupling {coupling.name!r}: a link that no joint carries")
            else:
                graph.gears.append(Gear(coupling.name, str(ends[0]), str(ends[1]), coupling.ratio, 0.0, coupling.line))
        for driver, driven, ratio, offset, line in self.gears:
            if driver not in graph.edges:
                graph.note("ignored", f"the mimic of joint {driven!r}: there is no joint {driver!r}")
            elif all(_single(graph.edges[name]) for name in (driver, driven)):
                graph.gears.append(Gear(graph.fresh(f"mimic_{driven}"), driver, driven, ratio, offset, line))

    def _own(self) -> None:
        """Platform, camera and observations where the file has an ``<hrsynth>`` element all the same."""
        graph = self.result
        for own in self.root.findall("hrsynth")[:1]:
            for tag in ("platform", "camera"):
                element = own.find(tag)
                if element is not None and self.known(element.get("link"), xml.line(element), f"{tag}: unknown link"):
                    setattr(graph, tag, element.get("link"))
            for element in own.findall("observe"):
                link, leg = element.get("link"), element.get("leg")
                if self.known(link, xml.line(element), "observe: unknown link") and leg and link:
                    axis = self.direction(element, "axis", (0, 0, 1))
                    graph.observations.append(Direction(leg, link, np.asarray(axis), line=xml.line(element)))


def _single(edge: Edge) -> bool:
    return edge.type in (JointType.REVOLUTE, JointType.PRISMATIC)
