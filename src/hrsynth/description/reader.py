"""From the text of a robot file in the native dialect to a mechanism, or to all the defects of the file."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from lxml import etree

from ..errors import BadRobotFile
from ..mechanism.model import Joint, JointType, Mechanism
from ..mechanism.observation import Direction
from ..tolerances import SAME_DIRECTION, SAME_GEOMETRY
from . import chains, xml
from .closure import LoopEnds, require_closed
from .draft import ORIGIN, Edge
from .urdf import Urdf

OWN_TAGS = ("platform", "camera", "observe")
"""What an ``<hrsynth>`` element is read for; other children are kept, unless they look like one of these."""
ELSEWHERE = ("link", "joint", "loop", "coupling", "transmission")
"""Elements that belong directly into ``<robot>``."""


def parse(text: bytes | str, file: str = "<text>") -> Mechanism:
    """The mechanism that a robot file describes; ``file`` is what defects are reported under.

    Raises
    ------
    BadRobotFile
        With every defect of the file and its line.
    LoopsNotClosed
        Where a loop is open at the zero configuration.
    """
    return native(xml.document(text, file), file)


def native(root: xml.Element, file: str) -> Mechanism:
    """The same for a document that has been parsed."""
    return _Reader(file, root).mechanism()


@dataclass
class _Reader(Urdf):
    observations: list[Direction] = field(default_factory=list)
    platform: str | None = None
    camera: str | None = None
    serial: bool = False
    rest: list[str] = field(default_factory=list)

    def mechanism(self) -> Mechanism:
        root = self.root
        if root.tag != "robot":
            self.defect(xml.line(root), "root element", str(root.tag), "robot")
            raise BadRobotFile(self.defects)
        name = self.attribute(root, "name") or "robot"
        readers = {"link": self.link, "joint": self.joint, "loop": self.loop, "hrsynth": None,
                   "transmission": None, "coupling": None}
        for element in xml.children(root):
            read = readers.get(element.tag)
            if read is not None:
                read(element)
        for element in root.findall("transmission"):
            self.transmission(element)
        gears: set[str] = set()
        for element in root.findall("coupling"):
            self.coupling(element, gears)
        self.own(root.findall("hrsynth"))
        self.rest[:0] = xml.unknown(root, ["name"], readers)
        base = self.structure()
        if self.defects or base is None or self.platform is None:
            raise BadRobotFile(self.defects)
        return self.assembled(name, base, self.platform)

    def own(self, elements: list[xml.Element]) -> None:
        """The ``<hrsynth>`` element: platform, camera, observations."""
        for extra in elements[1:]:
            self.defect(xml.line(extra), "second <hrsynth>")
        if not elements:
            self.defect(xml.line(self.root), "no <hrsynth> element, so no <platform>")
            return
        element = elements[0]
        self.serial = element.get("serial") == "true"
        platform = self.only(element, "platform")
        if platform is None:
            self.defect(xml.line(element), "no <platform>")
        else:
            link = self.attribute(platform, "link")
            if self.known(link, xml.line(platform), "platform: unknown link"):
                self.platform = link
        camera = self.only(element, "camera")
        if camera is not None:
            link = self.attribute(camera, "link")
            if self.known(link, xml.line(camera), "camera: unknown link"):
                self.camera = link
        for observe in element.findall("observe"):
            self.observe(observe)
        for child in element:
            if isinstance(child.tag, str) and child.tag not in OWN_TAGS and (
                    child.tag in ELSEWHERE or difflib.get_close_matches(child.tag, OWN_TAGS, n=1, cutoff=0.75)):
                self.defect(xml.line(child), "an element that has no meaning inside <hrsynth>", f"<{child.tag}>",
                            ", ".join(f"<{tag}>" for tag in OWN_TAGS))
        rest = xml.unknown(element, ["serial"], OWN_TAGS)
        if rest:
            bare = etree.Element("hrsynth")
            xml.restore(bare, rest)
            self.rest.append(xml.kept(bare))

    def observe(self, element: xml.Element) -> None:
        leg, link = self.attribute(element, "leg"), self.attribute(element, "link")
        self.known(link, xml.line(element), "observe: unknown link")
        if leg is not None and (leg == "all" or "," in leg):
            self.defect(xml.line(element), "observe: a leg's label that no list of legs could name", leg,
                        "a label without commas, other than all")
        if self.attribute(element, "axis") is None:
            return
        direction = self.direction(element, "axis", (0, 0, 1))
        if leg is not None and link is not None:
            self.observations.append(Direction(leg, link, direction, line=xml.line(element)))

    def structure(self) -> str | None:
        """The base; whatever keeps the tree joints from being one tree is a defect."""
        root_line = xml.line(self.root)
        if not self.links:
            self.defect(root_line, "no links")
            return None
        for edge in (*self.tree.values(), *self.loops.values()):
            kind = "loop" if edge.name in self.loops else "joint"
            for end in edge.ends:
                self.known(end.link, end.line, f"{kind} {edge.name!r}: unknown link")
            if edge.ends[0].link is not None and edge.ends[0].link == edge.ends[1].link:
                self.defect(edge.line, f"{edge.name!r} joins a link to itself", edge.ends[0].link)
        if not self.loops and not self.root.findall("loop") and not self.serial:
            self.defect(root_line, "no loop: not a parallel robot")
        carriers: dict[str, Edge] = {}
        for edge in self.tree.values():
            child = edge.ends[1].link
            if child is None or child == edge.ends[0].link:
                continue
            if child in carriers:
                self.defect(edge.line, f"joint {edge.name!r}: its child has a parent already, by joint "
                                       f"{carriers[child].name!r} (a loop is written as <loop>)", child)
            else:
                carriers[child] = edge
        self.cycles(carriers)
        roots = [name for name in self.links if name not in carriers]
        for name in roots[1:]:
            self.defect(self.links[name].line, f"second root beside {roots[0]!r}: no joint's child", name)
        if not roots:
            return None
        self.placed(roots[0])
        return roots[0]

    def cycles(self, carriers: Mapping[str, Edge]) -> None:
        """Report every ring of tree joints, at its last joint in the file."""
        place = {name: number for number, name in enumerate(self.tree)}
        done: set[str] = set()
        for start in carriers:
            path: dict[str, Edge] = {}
            link: str | None = start
            while link is not None and link in carriers and link not in done and link not in path:
                path[link] = carriers[link]
                link = carriers[link].ends[0].link
            if link in path:
                ring = list(path.values())[list(path).index(str(link)):]
                last = max(ring, key=lambda edge: place[edge.name])
                self.defect(last.line, "tree joints that make a ring (a loop is written as <loop>)",
                            " ".join(sorted((edge.name for edge in ring), key=place.__getitem__)))
            done |= set(path)

    def placed(self, base: str) -> None:
        """The platform is another link than the base and hangs together with it."""
        line = next((xml.line(each) for each in self.root.iterfind("hrsynth/platform")), None)
        if self.platform is None:
            return
        if self.platform == base:
            self.defect(line, "the platform is the base", base)
            return
        near: dict[str, list[str]] = {}
        for edge in (*self.tree.values(), *self.loops.values()):
            a, b = edge.ends[0].link, edge.ends[1].link
            if a is not None and b is not None:
                near.setdefault(a, []).append(b)
                near.setdefault(b, []).append(a)
        reached, pending = {base}, [base]
        while pending:
            fresh = set(near.get(pending.pop(), ())) - reached
            reached |= fresh
            pending.extend(fresh)
        if self.platform not in reached:
            self.defect(line, f"platform not reachable from the base {base!r}", self.platform)

    def assembled(self, name: str, base: str, platform: str) -> Mechanism:
        """The mechanism, all geometry in the base frame at the zero configuration; its loops must be closed there."""
        joints: dict[str, Joint] = {}
        poses = {base: ORIGIN}
        hanging: dict[str | None, list[Edge]] = {}
        for edge in self.tree.values():
            hanging.setdefault(edge.ends[0].link, []).append(edge)
        reached = [base]
        for link in reached:
            for edge in hanging.get(link, ()):
                child = str(edge.ends[1].link)
                X = edge.ends[0].X
                poses[child] = poses[link] if X is ORIGIN else poses[link] @ X
                reached.append(child)
        loops = []
        for edge in (*self.tree.values(), *self.loops.values()):
            predecessor, successor = str(edge.ends[0].link), str(edge.ends[1].link)
            X_p, X_s = poses[predecessor] @ edge.ends[0].X, poses[successor] @ edge.ends[1].X
            kind = edge.type or JointType.FIXED
            ends = LoopEnds(edge.name, kind, X_p, X_s, edge.axes, edge.line)
            if edge.name in self.loops:
                loops.append(ends)
            joints[edge.name] = Joint(edge.name, kind, predecessor, successor, ends.point, ends.directions,
                                      self.motors.get(edge.name), edge.limits, edge.name in self.tree, edge.xml,
                                      edge.line)
        links = {key: replace(link, pose=poses[key]) for key, link in self.links.items()}
        mechanism = Mechanism(name, links, joints, base, platform, tuple(self.observations), tuple(self.couplings),
                              self.camera, tuple(self.rest), self.file)
        for loop in loops:
            if loop.type is JointType.UNIVERSAL:
                self.perpendicular(loop, mechanism.length)
        if self.defects:
            raise BadRobotFile(self.defects)
        require_closed(self.file, loops, mechanism.length)
        return chains.merged(mechanism)

    def perpendicular(self, loop: LoopEnds, length: float) -> None:
        a, b = loop.directions
        gap = np.linalg.norm(loop.X_successor[:3, 3] - loop.point)
        if gap <= SAME_GEOMETRY * length and not abs(a @ b) <= SAME_DIRECTION:
            self.defect(loop.line, f"universal loop {loop.name!r}: cosine between axis and axis2", f"{a @ b:.3g}", "0")
