"""Reader of the native format: the joint graph of a robot file, or all the defects of the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....mechanism import graphs
from ....mechanism.model import JointType, Limits, Mechanism, Motor
from ... import xml
from ...elements import LIMITS
from ...file_format import RobotFile
from ...jointgraph import JointGraph, JointSpec, find_first_body
from ...overrides import Overrides
from ..urdf.elements import ELSEWHERE, INTERFACE, UrdfReader, build_transmission
from ..urdf.names import NAMES


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of a robot file. Raises ``BadRobotFile`` with every defect of the file and its line."""
    root = file.document
    defects, notes = NAMES.check(root, file)
    graph = _NativeReader(str(file.path), root, defects=defects).graph()
    graph.notes[:0] = notes
    return graph


def parse(text: bytes | str, file: str = "<text>") -> Mechanism:
    """Return the mechanism of a text; ``file`` is named in its defects."""
    from ...assembly.assemble import assemble

    return assemble(_NativeReader(file, xml.parse_document(text, file)).graph(), Overrides())


@dataclass
class _NativeReader(UrdfReader):
    def graph(self) -> JointGraph:
        """Return all links, joints, closures and observations."""
        root = self.root
        if root.tag != "robot":
            self.defect(xml.get_line(root), "root element", str(root.tag), "robot")
            self.require_sound()
        name = self.attribute(root, "name") or "robot"
        self.elements()
        graph = self.graph_of(name, "native", [*ELSEWHERE, "hrsynth"])
        graph.is_complete = True
        self.own(graph)
        self.structure(graph)
        self.require_sound()
        self.couple(graph)
        self.require_sound()
        return graph

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        limit = self.only(element, "limit")
        if limit is None:
            return None
        free = limit.get("free", "").split()
        values: dict[str, float] = {}
        for key in LIMITS:
            if limit.get(key) is not None and key not in free:
                values[key] = float(self.numbers(limit, key, (0,))[0])
        for key in ("velocity", "effort"):
            if values.get(key, 0.0) < 0:
                self.defect(xml.get_line(limit), f"{key} of <limit>", limit.get(key), "a number of at least 0")
        if kind == "continuous":
            values.pop("lower", None)
            values.pop("upper", None)
        elif element.tag == "joint" and kind in ("revolute", "prismatic") and {"lower", "upper"} & set(values):
            for key in ("lower", "upper"):
                if key not in free:
                    values.setdefault(key, 0.0)
        if values.get("lower", -np.inf) > values.get("upper", np.inf):
            self.defect(xml.get_line(limit), "lower limit", f"{values['lower']:g}", f"up to {values['upper']:g}")
        return Limits(**values) if values else None

    def transmission(self, element: xml.Element) -> None:
        name = self.attribute(element, "name")
        targets = element.findall("joint")
        if not targets:
            self.defect(xml.get_line(element), "transmission without <joint>", element.get("name"))
        joints = self.joints
        for joint in targets:
            target = self.attribute(joint, "name")
            if target is None:
                continue
            planar = self.planar_parts(target)
            if not planar and not self.is_known_link(
                target, xml.get_line(joint), "transmission of an unknown joint", joints
            ):
                continue
            for each in planar or [target]:
                if joints[each].type is JointType.FIXED:
                    self.defect(xml.get_line(joint), "transmission of a fixed joint", target)
                elif each in self.motors:
                    self.defect(xml.get_line(joint), "second transmission of a joint", target)
                elif name is not None and planar:
                    self.motors[each] = Motor(name + each.removeprefix(target))
                elif name is not None:
                    text = xml.format_canonical(element)
                    simple = [
                        xml.format_canonical(build_transmission(name, target, each)) for each in (INTERFACE, None)
                    ]
                    self.motors[each] = Motor(name, None if text in simple else text)

    def structure(self, graph: JointGraph) -> None:
        """Set the base; tree joints that do not form one tree are defects."""
        self.require_some(self.links, "links", self.root)
        self.check_ends()
        own = self.root.find("hrsynth")
        is_serial = own is not None and own.get("serial") == "true"
        if own is None:
            self.defect(xml.get_line(self.root), "no <hrsynth> element, so no <platform>")
        elif own.find("platform") is None and not graph.formation:
            self.defect(
                xml.get_line(own),
                "no <platform>",
                None,
                "a <platform>, or <observe> between the bodies of a formation",
            )
        watched = graph.cameras or self.root.findall("hrsynth/observe[@kind]")
        if self.links and not (self.root.findall("loop") or is_serial or watched):
            self.defect(
                xml.get_line(self.root),
                "no loop: not a parallel robot",
                None,
                'a <loop>; for a serial arm or a free body <hrsynth serial="true">',
            )
        carriers: dict[str, JointSpec] = {}
        for joint in self.tree.values():
            child = joint.ends[1].link
            if child is None or child == joint.ends[0].link:
                continue
            if child in carriers:
                self.defect(
                    joint.line,
                    f"joint {joint.name!r}: its child already has a parent, through joint "
                    f"{carriers[child].name!r} (a loop is written as <loop>)",
                    child,
                )
            else:
                carriers[child] = joint
        order = list(self.tree)
        for ring in self.rings():
            names = sorted((joint.name for joint in ring), key=order.index)
            self.defect(
                self.tree[names[-1]].line,
                "tree joints that form a cycle (a loop is written as <loop>)",
                " ".join(names),
            )
        roots = [name for name in self.links if name not in carriers]
        for name in roots[1:]:
            self.defect(self.links[name].line, f"second root besides {roots[0]!r}: not the child of any joint", name)
        graph.base = roots[0] if roots else None
        if graph.base is not None:
            self.check_platform(graph, graph.base)

    def check_platform(self, graph: JointGraph, base: str) -> None:
        """Check that the platform differs from the base and is connected to it; that of a formation is its first
        body."""
        line = next((xml.get_line(each) for each in self.root.iterfind("hrsynth/platform")), None)
        whole = [joint.links for joint in self.joints.values() if None not in (joint.ends[0].link, joint.ends[1].link)]
        if graph.formation:
            graph.platform, count = find_first_body(self.links, whole, base, graph.watched)
            if graph.platform is None:
                self.defect(
                    line,
                    f"no <platform>, and no formation: {count} of the bodies that only the base connects "
                    "observe or are observed",
                    None,
                    "a <platform>, or two such bodies",
                )
        if graph.platform == base:
            self.defect(line, "the platform is the base", base)
        elif graph.platform is not None and graph.platform not in graphs.find_component(
            graphs.build_adjacency(self.links, whole), base
        ):
            self.defect(line, f"platform not connected to the base {base!r}", graph.platform)
