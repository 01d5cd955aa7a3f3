"""Elements of URDF and its loops: links, joints, ``<loop>``, ``<transmission>``, ``<coupling>``."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from lxml import etree

from ....errors import BadRequest
from ....geometry.vectors import Array
from ....mechanism.cameras import NamedCamera
from ....mechanism.model import JointType, Limits, Link, Motor
from ....mechanism.observations.direction import Direction
from ....mechanism.screws import split_elementary
from ... import xml
from ...elements import TURNS, XmlReader
from ...jointgraph import LOOP_TYPES, ORIGIN, CouplingSpec, FrameSpec, JointGraph, JointSpec
from ...observation_text import ObservationSpec, parse_observe_attributes

TREE_TYPES = {
    "revolute": JointType.REVOLUTE,
    "continuous": JointType.REVOLUTE,
    "prismatic": JointType.PRISMATIC,
    "fixed": JointType.FIXED,
    "floating": JointType.FREE,
    "planar": JointType.PLANAR,
}
INTERFACE = "hardware_interface/VelocityJointInterface"
_PLANAR = ("__x", "__y", "__turn")
"""Suffixes of the names of the three joints of a planar one."""


OWN_TAGS = ("platform", "camera", "observe")
"""Elements that an ``<hrsynth>`` is read for; other children are kept unless they resemble these."""
ELSEWHERE = ("link", "joint", "loop", "coupling", "transmission")
"""Elements that belong directly into ``<robot>``."""


@dataclass
class UrdfReader(XmlReader):
    """Reader of the joint graph of a URDF document."""

    links: dict[str, Link] = field(default_factory=dict)
    tree: dict[str, JointSpec] = field(default_factory=dict)
    loops: dict[str, JointSpec] = field(default_factory=dict)
    motors: dict[str, Motor] = field(default_factory=dict)
    couplings: list[CouplingSpec] = field(default_factory=list)

    @property
    def joints(self) -> dict[str, JointSpec]:
        """Tree joints, then loops."""
        return {**self.tree, **self.loops}

    def elements(self) -> None:
        """Read links, joints and loops, then the elements that name them."""
        for element in xml.list_children(self.root):
            if element.tag == "link":
                self.link(element)
            elif element.tag == "joint":
                self.joint(element)
            elif element.tag == "loop":
                ends = self.ends(element, ("predecessor", "successor"))
                self.add(element, LOOP_TYPES, ends, ["predecessor", "successor"])
        for element in self.root.findall("transmission"):
            self.transmission(element)
        self.commands()
        names: set[str] = set()
        for element in self.root.findall("coupling"):
            self.coupling(element, names)

    def is_known_link(
        self, link: str | None, line: int | None, what: str, names: Mapping[str, object] | None = None
    ) -> bool:
        """Return True if a link (or another of ``names``) exists; None was reported before."""
        table = self.links if names is None else names
        if link is None:
            return False
        if link not in table:
            close = difflib.get_close_matches(link, table, n=3) if len(table) < 1000 else []
            self.defect(line, what, link, "an existing name" + (", such as " + ", ".join(close) if close else ""))
        return link in table

    def link(self, element: xml.Element) -> None:
        """Read a ``<link>``."""
        name = self.attribute(element, "name")
        if name is None:
            return
        if name in self.links:
            self.defect(xml.get_line(element), "second link of the same name", name)
            return
        self.links[name] = Link(name, xml=xml.list_unknown(element, ["name"], []), line=xml.get_line(element))

    def joint(self, element: xml.Element) -> None:
        """Read a ``<joint>`` of the tree."""
        for mimic in element.findall("mimic"):
            self.defect(
                xml.get_line(mimic),
                "<mimic>: the native format has <coupling> instead; joint",
                element.get("name"),
                "a <coupling> with predecessor, successor and ratio",
            )
        self.add(element, TREE_TYPES, self.tree_ends(element), ["origin", "parent", "child"])

    def tree_ends(self, element: xml.Element) -> tuple[FrameSpec, FrameSpec]:
        """Return parent and child of a ``<joint>``, whose frame is the child's."""
        return self.ends(element, ("parent", "child"), (self.origin(element), ORIGIN))

    def ends(
        self, element: xml.Element, tags: tuple[str, str], frames: Sequence[Array] = ()
    ) -> tuple[FrameSpec, FrameSpec]:
        """Return the two ends of a joint, each in a child element that names its link; the frames in them are
        ``frames``, or those of their ``<origin>``."""
        found = []
        for number, tag in enumerate(tags):
            end = self.only(element, tag)
            if end is None:
                self.defect(xml.get_line(element), f"{element.tag} without <{tag}>", element.get("name"))
                found.append(FrameSpec(None, ORIGIN, xml.get_line(element)))
            else:
                X = frames[number] if frames else self.origin(end)
                found.append(FrameSpec(self.attribute(end, "link"), X, xml.get_line(end)))
        return found[0], found[1]

    def add(
        self, element: xml.Element, types: Mapping[str, JointType], ends: tuple[FrameSpec, FrameSpec], tags: list[str]
    ) -> None:
        """Read the common parts of tree joints and loops."""
        name, kind = self.attribute(element, "name"), self.attribute(element, "type")
        type_ = None if kind is None else types.get(kind)
        if kind is not None and type_ is None:
            self.defect(xml.get_line(element), f"unknown {element.tag} type", kind, ", ".join(types))
        axes = self.axes(element, type_)
        limits = self.limits(element, kind)
        if name is None:
            return
        if name in self.tree or name in self.loops:
            self.defect(xml.get_line(element), f"second joint or loop of the same name ({element.tag})", name)
            return
        rest = xml.list_unknown(element, ["name", "type"], [*tags, "axis", "axis2", "limit"])
        joint = JointSpec(name, type_, ends, axes, limits, rest, xml.get_line(element), in_tree=element.tag == "joint")
        if not joint.in_tree:
            self.loops[name] = joint
        elif type_ is JointType.PLANAR:
            self.planar(joint)
        else:
            self.tree[name] = joint

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        """Return the ``<limit>`` of a joint of the type ``kind``."""
        raise NotImplementedError

    def transmission(self, element: xml.Element) -> None:
        """Read a ``<transmission>``: its joints are motors."""
        raise NotImplementedError

    def commands(self) -> None:
        """Read ``<ros2_control>``: joints with a command interface have motors, unless they follow another joint."""
        joints = self.joints
        followers = {joint.get("name") for joint in self.root.findall("joint") if joint.find("mimic") is not None}
        for element in self.root.findall("ros2_control/joint"):
            name = element.get("name", "")
            commanded = element.find("command_interface") is not None
            follows = name in followers or element.find("param[@name='mimic']") is not None
            if commanded and not follows and name in joints and joints[name].type is not JointType.FIXED:
                self.motors.setdefault(name, Motor(f"motor_{name}"))

    def planar(self, joint: JointSpec) -> None:
        """Add the P, P, R and two links that URDF's planar joint is."""
        names = [joint.name + suffix for suffix in _PLANAR]
        for name in names[:2]:
            if name in self.links:
                self.defect(joint.line, "link name already used by a planar joint", name)
            self.links.setdefault(name, Link(name, line=joint.line))
        ends = [joint.ends[0], *(FrameSpec(name, ORIGIN, joint.line) for name in names[:2]), joint.ends[1]]
        for number, (kind, axis) in enumerate(split_elementary(JointType.PLANAR, joint.axes)):
            name = names[number]
            if name in self.tree or name in self.loops:
                self.defect(joint.line, "joint name already used by a planar joint", name)
            self.tree[name] = JointSpec(
                name,
                kind,
                (ends[number], ends[number + 1]),
                (axis,),
                joint.limits,
                joint.xml if number == 0 else (),
                joint.line,
            )

    def planar_parts(self, name: str) -> list[str]:
        """Return the joints that the planar joint of that name is."""
        parts = [name + suffix for suffix in _PLANAR]
        return parts if name not in self.joints and all(part in self.tree for part in parts) else []

    def coupling(self, element: xml.Element, names: set[str]) -> None:
        """Read a ``<coupling>``; ``names`` are those of the ones before it."""
        name = self.attribute(element, "name")
        if name in names:
            self.defect(xml.get_line(element), "second coupling of the same name", name)
        names.add(name or "")
        tags = ("predecessor", "successor")
        one, two = self.ends(element, tags, (ORIGIN, ORIGIN))
        for end, tag in zip((one, two), tags, strict=True):
            self.is_known_link(end.link, end.line, f"{tag} of a coupling: unknown link")
        if one.link and one.link == two.link:
            self.defect(two.line, "successor of a coupling is its predecessor", two.link, "another link")
        ratio = self.only(element, "ratio")
        if ratio is None:
            self.defect(xml.get_line(element), "coupling without <ratio>", name)
        elif self.attribute(ratio, "value") is not None:
            value = float(self.numbers(ratio, "value", (1,))[0])
            if value == 0:
                self.defect(
                    xml.get_line(ratio),
                    "ratio of a coupling would fix its second joint",
                    ratio.get("value"),
                    "a number other than 0",
                )
            if name and one.link and two.link:
                self.couplings.append(CouplingSpec(name, one.link, two.link, value, line=xml.get_line(element)))

    def graph_of(self, name: str, dialect: str, known: Sequence[str]) -> JointGraph:
        """Return the graph of all links, joints and motors, with the elements that are not ``known``."""
        graph = JointGraph(name, self.file, dialect, self.links, digits=self.digits)
        graph.joints = {name: replace(joint, motor=self.motors.get(name)) for name, joint in self.joints.items()}
        graph.rest = list(xml.list_unknown(self.root, ["name"], known))
        return graph

    def couple(self, graph: JointGraph) -> None:
        """Add the couplings to the graph: they name links, which may be fixed to the links that joints carry."""
        carrier = {joint.ends[1].link: joint for joint in self.tree.values()}
        for coupling in self.couplings:
            joints = []
            for link in (coupling.driver, coupling.driven):
                while (joint := carrier.get(link)) is not None and joint.type is JointType.FIXED:
                    link = joint.links[0]
                joints.append(None if joint is None else joint.name)
            if None in joints:
                self.defect(coupling.line, f"coupling {coupling.name!r}: a link that no joint carries")
            else:
                one, two = map(str, joints)
                graph.gears.append(replace(coupling, driver=one, driven=two))

    def sights(self, own: xml.Element) -> tuple[list[ObservationSpec], list[NamedCamera]]:
        """Return the observations in ``<hrsynth>`` other than directions by its own camera, and the named cameras."""
        specs, cameras = list[ObservationSpec](), list[NamedCamera]()
        for element in own.findall("camera"):
            if element.get("name") is not None:
                name, link = self.attribute(element, "name"), self.attribute(element, "link")
                X, image = self.origin(element), self.only(element, "image")
                size: list[float | None] = [None, None, None]
                for number, key in enumerate(("focal", "width", "height")):
                    if image is not None and image.get(key) is not None:
                        size[number] = float(self.numbers(image, key, (1,))[0])
                        if not size[number] > 0:  # type: ignore[operator]
                            self.defect(xml.get_line(image), f"{key} of <image>", image.get(key), "more than 0")
                if name is not None and link is not None:
                    width, height = (None if each is None else int(each) for each in size[1:])
                    cameras.append(NamedCamera(name, link, X, size[0], width, height, xml.get_line(element)))
        for element in own.findall("observe"):
            if is_sight(element):
                try:
                    said = {str(key): str(value) for key, value in element.attrib.items()}
                    specs.append(parse_observe_attributes(said, xml.get_line(element)))
                    for key in ("at", "axis", "radius"):
                        self.digits.read(element.get(key, ""))
                except BadRequest as error:
                    value = None if error.got is None else str(error.got)
                    self.defect(xml.get_line(element), error.problem, value, error.expected)
        return specs, cameras

    def own(self, graph: JointGraph) -> None:
        """Read the ``<hrsynth>`` element, if there is one: platform, camera, observations."""
        element = self.only(self.root, "hrsynth")
        if element is None:
            return
        graph.sights, graph.cameras = self.sights(element)
        for role in ("platform", "camera"):
            found = [each for each in element.findall(role) if role == "platform" or each.get("name") is None]
            for extra in found[1:]:
                self.defect(
                    xml.get_line(extra), f"second <{role}> in <hrsynth>" + " without a name" * (role == "camera")
                )
            if found:
                child = found[0]
                link = self.attribute(child, "link")
                if self.is_known_link(link, xml.get_line(child), f"{role}: unknown link"):
                    setattr(graph, role, link)
                if role == "platform":
                    if (text := child.get("turns", "true")) not in TURNS:
                        self.defect(xml.get_line(child), "turns of <platform>", text, "true, false")
                    graph.turns = TURNS.get(child.get("turns", ""))
        graph.formation = graph.platform is None and bool(graph.sights)
        for observe in element.findall("observe"):
            if not is_sight(observe):
                self.observe(graph, observe)
        for child in xml.list_children(element):
            if child.tag not in OWN_TAGS and (
                child.tag in ELSEWHERE or difflib.get_close_matches(child.tag, OWN_TAGS, n=1, cutoff=0.75)
            ):
                self.defect(
                    xml.get_line(child),
                    "unknown element in <hrsynth>",
                    f"<{child.tag}>",
                    ", ".join(f"<{tag}>" for tag in OWN_TAGS),
                )
        rest = xml.list_unknown(element, ["serial"], OWN_TAGS)
        if rest:
            bare = etree.Element("hrsynth")
            xml.restore(bare, rest)
            graph.rest.append(xml.format_canonical(bare))

    def observe(self, graph: JointGraph, element: xml.Element) -> None:
        """Read an ``<observe>`` of a direction."""
        leg, link = self.attribute(element, "leg"), self.attribute(element, "link")
        self.is_known_link(link, xml.get_line(element), "observe: unknown link")
        if leg is not None and (leg == "all" or "," in leg):
            self.defect(
                xml.get_line(element),
                "observe: label not usable in a list",
                leg,
                "a label without commas, other than all",
            )
        if self.attribute(element, "axis") is None:
            return
        direction = self.direction(element, "axis", (0, 0, 1))
        if leg is not None and link is not None:
            graph.observations.append(Direction(leg, link, direction, line=xml.get_line(element)))

    def check_ends(self, loop: str = "loop") -> None:
        """Record a defect for every end on an unknown link and every joint from a link to itself; loops are called
        ``loop``."""
        for name, joint in self.joints.items():
            for end in joint.ends:
                self.is_known_link(end.link, end.line, f"{'joint' if joint.in_tree else loop} {name!r}: unknown link")
            if joint.ends[0].link is not None and joint.ends[0].link == joint.ends[1].link:
                self.defect(joint.line, f"{name!r} connects a link to itself", joint.ends[0].link)

    def rings(self) -> Iterator[list[JointSpec]]:
        """Yield the tree joints that form a cycle, each cycle once, from the base's side outward."""
        carrier: dict[str | None, JointSpec] = {}
        for joint in self.tree.values():
            if joint.ends[1].link not in (None, joint.ends[0].link):
                carrier.setdefault(joint.ends[1].link, joint)
        clear: set[str | None] = set()
        for start in carrier:
            way: list[str | None] = []
            link = start
            while link in carrier and link not in clear and link not in way:
                way.append(link)
                link = carrier[link].ends[0].link
            if link in way:
                yield [carrier[each] for each in reversed(way[way.index(link) :])]
            clear.update(way)


def is_sight(element: xml.Element) -> bool:
    """Return True if an ``<observe>`` is not the direction of a segment by the reference link."""
    return element.get("kind") is not None or element.get("camera") is not None


def build_transmission(title: str, joint: str, interface: str | None = INTERFACE) -> xml.Element:
    """Return the transmission of a motor known by its name only; other parsers require an interface."""
    element = etree.Element("transmission", name=title)
    etree.SubElement(element, "type").text = "transmission_interface/SimpleTransmission"
    target = etree.SubElement(element, "joint", name=joint)
    if interface is not None:
        etree.SubElement(target, "hardwareInterface").text = interface
    etree.SubElement(element, "actuator", name=title)
    return element
