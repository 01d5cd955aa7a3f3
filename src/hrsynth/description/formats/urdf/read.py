"""URDF of other tools: URDF+ (``<loop>``, ``<coupling>``), ``<mimic>``, two joints with one child, closures of other
tools; errors outside of the kinematics are tolerated."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ....mechanism.model import JointType, Limits, Link, Motor
from ... import xml
from ...elements import read_sound_limits
from ...file_format import RobotFile
from ...jointgraph import CouplingSpec, JointGraph, join_names
from ..extensions import DRAKE, is_drake, strip_namespace
from .conventions import CONVENTIONS
from .elements import ELSEWHERE, TREE_TYPES, UrdfReader
from .names import NAMES

WORLD = "world"
TYPES = {**TREE_TYPES, "spherical": JointType.SPHERICAL, "ball": JointType.SPHERICAL}
_KNOWN = (*ELSEWHERE, "hrsynth", *(convention.tag for convention in CONVENTIONS if convention.tag is not None))


def read(file: RobotFile, *, frames: bool = True) -> JointGraph:
    """Return the joint graph of a URDF document. Raises ``BadRobotFile`` with all its defects.

    ``frames``: links may be closing frames by their names, if loops are not given otherwise.
    """
    root = file.document
    defects, notes = NAMES.check(root, file)
    graph = _TolerantReader(str(file.path), root, defects=defects).graph(frames and root.find("hrsynth") is None)
    graph.notes[:0] = notes
    return graph


@dataclass
class _TolerantReader(UrdfReader):
    notes: list[tuple[str, str]] = field(default_factory=list)
    mimics: list[CouplingSpec] = field(default_factory=list)
    carried: set[str | None] = field(default_factory=set)

    def graph(self, frames: bool) -> JointGraph:
        """Return all links, joints and closures."""
        self.elements()
        self.check_structure()
        closing = [
            str(each.tag) for each in xml.list_children(self.root) if is_drake(each) and strip_namespace(each) in DRAKE
        ]
        graph = self.graph_of(self.root.get("name") or "robot", "URDF", [*_KNOWN, *closing])
        for kind, text in self.notes:
            graph.note(kind, text)
        self.couple(graph)
        graph.follow(self.mimics)
        for convention in CONVENTIONS:
            if convention.tag is not None or frames:
                convention.read(self, graph)
        self.own(graph)
        self.require_sound()
        return graph

    def joint(self, element: xml.Element) -> None:
        child = element.find("child")
        link = None if child is None else child.get("link")
        name = element.get("name")
        self.add(element, TYPES, self.tree_ends(element), ["origin", "parent", "child", "mimic"])
        if child is not None and link in self.carried and name in self.tree:
            self.loops[name] = replace(self.tree.pop(name), in_tree=False)
            self.notes.append(("merged", f"joint {name!r} is the second with the child {link!r}: it closes a loop"))
        elif child is not None:
            self.carried.add(link)
        for mimic in element.findall("mimic")[:1]:
            driver = self.attribute(mimic, "joint")
            ratio, offset = (
                float(self.numbers(mimic, key, (default,))[0])
                for key, default in (("multiplier", 1.0), ("offset", 0.0))
            )
            if name is not None and driver is not None:
                self.mimics.append(CouplingSpec(f"mimic_{name}", driver, name, ratio, offset, xml.get_line(mimic)))

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        limit = element.find("limit")
        if limit is None:
            return None
        free = limit.get("free", "").split()
        return read_sound_limits(lambda key: None if key in free else limit.get(key), bounded=kind != "continuous")

    def transmission(self, element: xml.Element) -> None:
        name, joints = element.get("name") or "motor", self.joints
        for joint in element.findall("joint"):
            target = joint.get("name")
            if target in joints and joints[target].type is not JointType.FIXED:
                self.motors.setdefault(target, Motor(name))
            elif target is not None:
                self.notes.append(("ignored", f"transmission {name!r}: no movable joint {target!r}"))

    def check_structure(self) -> None:
        """Check that every end of every joint is a known link, and that no joints form a cycle."""
        if len(self.links) < len(self.root.findall("link")):
            self.require_sound()
        if WORLD not in self.links and any(end.link == WORLD for joint in self.joints.values() for end in joint.ends):
            self.links = {WORLD: Link(WORLD), **self.links}
            self.notes.append(("assumption", f"no link {WORLD!r} is declared: it is read as the ground"))
        self.check_ends("joint")
        self.require_some(self.links, "links", self.root)
        for ring in self.rings():
            names = join_names(joint.name for joint in ring)
            self.defect(ring[0].line, "joints that form a cycle", names, "a tree with one root")
        self.require_sound()
