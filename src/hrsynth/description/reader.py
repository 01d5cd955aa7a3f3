"""From the text of a robot file in the native dialect to a mechanism, or to all the defects of the file."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from lxml import etree

from ..errors import BadRobotFile, Defect
from ..mechanism.model import Coupling, Joint, JointType, Limits, Link, Mechanism, Motor
from ..mechanism.observation import Direction
from ..mechanism.vectors import Array, frozen, perpendicular, unit
from ..tolerances import SAME_DIRECTION, SAME_GEOMETRY
from . import chains, numerals, xml
from .closure import LoopEnds, require_closed
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
_LIMITS = ("lower", "upper", "velocity", "effort")
_ORIGIN = frozen(np.eye(4))


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
    return _Reader(file, xml.document(text, file)).mechanism()


@dataclass(frozen=True, eq=False)
class _End:
    """One end of a joint: the link, the joint's frame in it (4, 4), the line."""

    link: str | None
    X: Array
    line: int | None


@dataclass(frozen=True, eq=False)
class _Edge:
    """A tree joint or loop as the file gives it; ``type`` None for an unknown type."""

    name: str
    type: JointType | None
    ends: tuple[_End, _End]
    axes: tuple[Array, ...] = ()
    limits: Limits | None = None
    xml: tuple[str, ...] = ()
    line: int | None = None


@dataclass
class _Reader:
    file: str
    root: xml.Element
    defects: list[Defect] = field(default_factory=list)
    links: dict[str, Link] = field(default_factory=dict)
    tree: dict[str, _Edge] = field(default_factory=dict)
    loops: dict[str, _Edge] = field(default_factory=dict)
    motors: dict[str, Motor] = field(default_factory=dict)
    couplings: list[Coupling] = field(default_factory=list)
    observations: list[Direction] = field(default_factory=list)
    platform: str | None = None
    camera: str | None = None
    serial: bool = False
    rest: list[str] = field(default_factory=list)

    # ---- defects

    def defect(self, line: int | None, what: str, value: str | None = None, allowed: str | None = None) -> None:
        if value is not None and len(value) > 80:
            value = value[:77] + "..."
        self.defects.append(Defect(self.file, line, what, value, allowed))

    def attribute(self, element: xml.Element, name: str) -> str | None:
        """An attribute that must be there and not be empty."""
        value = element.get(name)
        if value is None or not value.strip():
            self.defect(xml.line(element), f"<{element.tag}> without {name}")
            return None
        return value

    def numbers(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """The numbers of an attribute, the default where it is not there or not right."""
        fallback = np.array(list(default), dtype=float)
        text = element.get(name)
        if text is None:
            return fallback
        try:
            return numerals.parsed(text, len(fallback))
        except ValueError as error:
            self.defect(xml.line(element), f"{name} of <{element.tag}>", text, str(error))
            return fallback

    def only(self, element: xml.Element, tag: str) -> xml.Element | None:
        """The child element of that name; a second one is a defect."""
        found = element.findall(tag)
        for extra in found[1:]:
            self.defect(xml.line(extra), f"second <{tag}> in <{element.tag}>", element.get("name"))
        return found[0] if found else None

    def known(self, link: str | None, line: int | None, what: str, names: Mapping[str, object] | None = None) -> bool:
        """Whether a link (or another of ``names``) exists; None was reported before."""
        table = self.links if names is None else names
        if link is None:
            return False
        if link not in table:
            close = difflib.get_close_matches(link, table, n=3) if len(table) < 1000 else []
            self.defect(line, what, link, "a name that is there" + (", such as " + ", ".join(close) if close else ""))
        return link in table

    # ---- elements

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
            ends.append(_End(None if end is None else self.attribute(end, "link"), X if tag == "parent" else _ORIGIN,
                             xml.line(element) if end is None else xml.line(end)))
        self.edge(element, TREE_TYPES, (ends[0], ends[1]), ["origin", "parent", "child"])

    def loop(self, element: xml.Element) -> None:
        ends = []
        for tag in ("predecessor", "successor"):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.line(element), f"loop without <{tag}>", element.get("name"))
                ends.append(_End(None, _ORIGIN, xml.line(element)))
            else:
                ends.append(_End(self.attribute(end, "link"), self.origin(end), xml.line(end)))
        self.edge(element, LOOP_TYPES, (ends[0], ends[1]), ["predecessor", "successor"])

    def edge(self, element: xml.Element, types: Mapping[str, JointType], ends: tuple[_End, _End],
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
        edge = _Edge(name, type_, ends, axes, limits, rest, xml.line(element))
        if element.tag == "joint" and type_ is JointType.PLANAR:
            self.planar(edge)
        else:
            table[name] = edge

    def planar(self, edge: _Edge) -> None:
        """URDF's planar joint is P, P, R through two links of its own."""
        first = perpendicular(edge.axes[0])
        axes = (first, np.cross(edge.axes[0], first), edge.axes[0])
        names = [edge.name + suffix for suffix in ("__x", "__y", "__turn")]
        line = edge.line
        for name in names[:2]:
            if name in self.links:
                self.defect(line, "a planar joint's own link takes the name of a link", name)
            self.links.setdefault(name, Link(name, line=line))
        through = [_End(name, _ORIGIN, line) for name in names[:2]]
        pairs = [(edge.ends[0], through[0]), (through[0], through[1]), (through[1], edge.ends[1])]
        kinds = (JointType.PRISMATIC, JointType.PRISMATIC, JointType.REVOLUTE)
        for name, kind, ends, axis in zip(names, kinds, pairs, axes, strict=True):
            if name in self.tree or name in self.loops:
                self.defect(line, "a planar joint's own joint takes the name of a joint", name)
            self.tree[name] = _Edge(name, kind, ends, (axis,), edge.limits, edge.xml if name == names[0] else (), line)

    def origin(self, element: xml.Element) -> Array:
        origin = self.only(element, "origin")
        if origin is None:
            return _ORIGIN
        return numerals.from_origin(self.numbers(origin, "xyz", (0, 0, 0)), self.numbers(origin, "rpy", (0, 0, 0)))

    def axes(self, element: xml.Element, type_: JointType | None) -> tuple[Array, ...]:
        """The axes that the type needs, unit vectors; axes of types that need none are not looked at."""
        axes = []
        for tag in ("axis", "axis2")[:0 if type_ is None else type_.axes]:
            axis = self.only(element, tag)
            if axis is None and tag == "axis2":
                self.defect(xml.line(element), "universal loop without <axis2>", element.get("name"))
            axes.append(np.array([1.0, 0.0, 0.0]) if axis is None else self.direction(axis, "xyz", (1, 0, 0)))
        return tuple(axes)

    def direction(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """A unit vector; a zero vector is a defect."""
        values = self.numbers(element, name, default)
        if not np.linalg.norm(values) > 1e-9:
            self.defect(xml.line(element), f"{name} of <{element.tag}>", element.get(name), "a non-zero vector")
            return np.array([1.0, 0.0, 0.0])
        return unit(values)

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        limit = self.only(element, "limit")
        if limit is None:
            return None
        free = limit.get("free", "").split()
        values: dict[str, float] = {}
        for key in _LIMITS:
            if limit.get(key) is not None and key not in free:
                values[key] = float(self.numbers(limit, key, (0,))[0])
        for key in ("velocity", "effort"):
            if values.get(key, 0.0) < 0:
                self.defect(xml.line(limit), f"{key} of <limit>", limit.get(key), "no negative number")
        if kind == "continuous":
            values.pop("lower", None)
            values.pop("upper", None)
        elif element.tag == "joint" and kind in ("revolute", "prismatic") and {"lower", "upper"} & set(values):
            for key in ("lower", "upper"):
                if key not in free:
                    values.setdefault(key, 0.0)
        if values.get("lower", -np.inf) > values.get("upper", np.inf):
            self.defect(xml.line(limit), "lower limit", f"{values['lower']:g}", f"up to {values['upper']:g}")
        return Limits(**values) if values else None

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

    # ---- structure

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
        carriers: dict[str, _Edge] = {}
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

    def cycles(self, carriers: Mapping[str, _Edge]) -> None:
        """Report every ring of tree joints, at its last joint in the file."""
        place = {name: number for number, name in enumerate(self.tree)}
        done: set[str] = set()
        for start in carriers:
            path: dict[str, _Edge] = {}
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

    # ---- geometry

    def assembled(self, name: str, base: str, platform: str) -> Mechanism:
        """The mechanism, all geometry in the base frame at the zero configuration; its loops must be closed there."""
        joints: dict[str, Joint] = {}
        poses = {base: _ORIGIN}
        hanging: dict[str | None, list[_Edge]] = {}
        for edge in self.tree.values():
            hanging.setdefault(edge.ends[0].link, []).append(edge)
        reached = [base]
        for link in reached:
            for edge in hanging.get(link, ()):
                child = str(edge.ends[1].link)
                X = edge.ends[0].X
                poses[child] = poses[link] if X is _ORIGIN else poses[link] @ X
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
