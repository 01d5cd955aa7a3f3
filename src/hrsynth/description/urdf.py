"""The elements of URDF and its loops: links, joints, ``<loop>``, ``<transmission>``, ``<coupling>``."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..geometry.vectors import perpendicular
from ..mechanism.model import Coupling, JointType, Link, Motor
from . import xml
from .draft import ORIGIN, Edge, End
from .elements import Elements
from .writer import INTERFACE, simple_transmission

TREE_TYPES = {
    "revolute": JointType.REVOLUTE, "continuous": JointType.REVOLUTE, "prismatic": JointType.PRISMATIC,
    "fixed": JointType.FIXED, "floating": JointType.FREE, "planar": JointType.PLANAR,
}
LOOP_TYPES = {
    "revolute": JointType.REVOLUTE, "continuous": JointType.REVOLUTE, "prismatic": JointType.PRISMATIC,
    "cylindrical": JointType.CYLINDRICAL, "universal": JointType.UNIVERSAL, "spherical": JointType.SPHERICAL,
    "planar": JointType.PLANAR, "fixed": JointType.FIXED,
}


@dataclass
class Urdf(Elements):
    """The joint graph of a URDF document."""

    links: dict[str, Link] = field(default_factory=dict)
    tree: dict[str, Edge] = field(default_factory=dict)
    loops: dict[str, Edge] = field(default_factory=dict)
    motors: dict[str, Motor] = field(default_factory=dict)
    couplings: list[Coupling] = field(default_factory=list)

    def known(self, link: str | None, line: int | None, what: str, names: Mapping[str, object] | None = None) -> bool:
        """Whether a link (or another of ``names``) exists; None was reported before."""
        table = self.links if names is None else names
        if link is None:
            return False
        if link not in table:
            close = difflib.get_close_matches(link, table, n=3) if len(table) < 1000 else []
            self.defect(line, what, link, "a name that is there" + (", such as " + ", ".join(close) if close else ""))
        return link in table

    def link(self, element: xml.Element) -> None:
        name = self.attribute(element, "name")
        if name is None:
            return
        if name in self.links:
            self.defect(xml.line(element), "second link of the same name", name)
            return
        self.links[name] = Link(name, xml=xml.unknown(element, ["name"], []), line=xml.line(element))

    def joint(self, element: xml.Element) -> None:
        for mimic in element.findall("mimic"):
            self.defect(xml.line(mimic), "a <mimic> is a gear between two joints, which this dialect writes otherwise",
                        element.get("name"), "a <coupling> with predecessor, successor and ratio")
        X = self.origin(element)
        ends = []
        for tag in ("parent", "child"):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.line(element), f"joint without <{tag}>", element.get("name"))
            ends.append(End(None if end is None else self.attribute(end, "link"), X if tag == "parent" else ORIGIN,
                             xml.line(element) if end is None else xml.line(end)))
        self.edge(element, TREE_TYPES, (ends[0], ends[1]), ["origin", "parent", "child"])

    def loop(self, element: xml.Element) -> None:
        ends = []
        for tag in ("predecessor", "successor"):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.line(element), f"loop without <{tag}>", element.get("name"))
                ends.append(End(None, ORIGIN, xml.line(element)))
            else:
                ends.append(End(self.attribute(end, "link"), self.origin(end), xml.line(end)))
        self.edge(element, LOOP_TYPES, (ends[0], ends[1]), ["predecessor", "successor"])

    def edge(self, element: xml.Element, types: Mapping[str, JointType], ends: tuple[End, End],
             tags: list[str]) -> None:
        """What tree joints and loops have in common."""
        name, kind = self.attribute(element, "name"), self.attribute(element, "type")
        type_ = None if kind is None else types.get(kind)
        if kind is not None and type_ is None:
            self.defect(xml.line(element), f"unknown {element.tag} type", kind, ", ".join(types))
        axes = self.axes(element, type_)
        limits = self.limits(element, kind)
        if name is None:
            return
        if name in self.tree or name in self.loops:
            self.defect(xml.line(element), f"second joint or loop of the same name ({element.tag})", name)
            return
        table = self.tree if element.tag == "joint" else self.loops
        rest = xml.unknown(element, ["name", "type"], [*tags, "axis", "axis2", "limit"])
        edge = Edge(name, type_, ends, axes, limits, rest, xml.line(element))
        if element.tag == "joint" and type_ is JointType.PLANAR:
            self.planar(edge)
        else:
            table[name] = edge

    def planar(self, edge: Edge) -> None:
        """URDF's planar joint is P, P, R through two links of its own."""
        first = perpendicular(edge.axes[0])
        axes = (first, np.cross(edge.axes[0], first), edge.axes[0])
        names = [edge.name + suffix for suffix in ("__x", "__y", "__turn")]
        line = edge.line
        for name in names[:2]:
            if name in self.links:
                self.defect(line, "a planar joint's own link takes the name of a link", name)
            self.links.setdefault(name, Link(name, line=line))
        through = [End(name, ORIGIN, line) for name in names[:2]]
        pairs = [(edge.ends[0], through[0]), (through[0], through[1]), (through[1], edge.ends[1])]
        kinds = (JointType.PRISMATIC, JointType.PRISMATIC, JointType.REVOLUTE)
        for name, kind, ends, axis in zip(names, kinds, pairs, axes, strict=True):
            if name in self.tree or name in self.loops:
                self.defect(line, "a planar joint's own joint takes the name of a joint", name)
            self.tree[name] = Edge(name, kind, ends, (axis,), edge.limits, edge.xml if name == names[0] else (), line)

    def transmission(self, element: xml.Element) -> None:
        name = self.attribute(element, "name")
        joints = element.findall("joint")
        if not joints:
            self.defect(xml.line(element), "transmission without <joint>", element.get("name"))
        names = {**self.tree, **self.loops}
        for joint in joints:
            target = self.attribute(joint, "name")
            if target is None:
                continue
            parts = [target + suffix for suffix in ("__x", "__y", "__turn")]
            planar = target not in names and all(part in self.tree for part in parts)
            if not planar and not self.known(target, xml.line(joint), "transmission of an unknown joint", names):
                continue
            for each in parts if planar else [target]:
                if names[each].type is JointType.FIXED:
                    self.defect(xml.line(joint), "transmission of a fixed joint", target)
                elif each in self.motors:
                    self.defect(xml.line(joint), "second transmission of a joint", target)
                elif name is not None and planar:
                    self.motors[each] = Motor(name + each.removeprefix(target))
                elif name is not None:
                    text = xml.kept(element)
                    simple = text in [xml.kept(simple_transmission(name, target, each)) for each in (INTERFACE, None)]
                    self.motors[each] = Motor(name, None if simple else text)

    def coupling(self, element: xml.Element, names: set[str]) -> None:
        name = self.attribute(element, "name")
        if name in names:
            self.defect(xml.line(element), "second coupling of the same name", name)
        names.add(name or "")
        ends: list[str | None] = []
        for tag in ("predecessor", "successor"):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.line(element), f"coupling without <{tag}>", name)
            link = None if end is None else self.attribute(end, "link")
            if end is not None:
                self.known(link, xml.line(end), f"{tag} of a coupling: unknown link")
            ends.append(link)
        ratio = self.only(element, "ratio")
        if ratio is None:
            self.defect(xml.line(element), "coupling without <ratio>", name)
        elif self.attribute(ratio, "value") is not None:
            value = float(self.numbers(ratio, "value", (1,))[0])
            if name and ends[0] and ends[1]:
                self.couplings.append(Coupling(name, ends[0], ends[1], value, xml.line(element)))
