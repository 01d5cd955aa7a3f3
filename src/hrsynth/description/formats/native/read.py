"""Reader of the native format: from a robot file to a mechanism, or to all the defects of the file."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from lxml import etree

from ....errors import BadRobotFile
from ....geometry.vectors import Array
from ....mechanism import graphs
from ....mechanism.cameras import NamedCamera
from ....mechanism.model import FIRST, NAMED, Joint, JointType, Limits, Mechanism, Motor
from ....mechanism.observations.direction import Direction
from ....tolerances import DIRECTION_SINE_TOL, GEOMETRY_DIFFERENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION
from ... import chains, xml
from ...elements import LIMITS, TURNS
from ...file_format import RobotFile
from ...jointgraph import JointSpec, TreeJoint, compute_zero_poses, find_first_body
from ...jointmotion import compute_closure_residual, require_closed
from ...observation_text import ObservationSpec, add_file_observations
from ..urdf.elements import INTERFACE, UrdfReader, build_transmission, is_sight
from ..urdf.names import NAMES

OWN_TAGS = ("platform", "camera", "observe")
"""Elements that an ``<hrsynth>`` is read for; other children are kept unless they resemble these."""
ELSEWHERE = ("link", "joint", "loop", "coupling", "transmission")
"""Elements that belong directly into ``<robot>``."""


def read(file: RobotFile) -> Mechanism:
    """Return the mechanism of a robot file.

    Raises
    ------
    BadRobotFile
        With every defect of the file and its line.
    LoopClosureFailure
        If a loop is open at the zero configuration.
    """
    root = file.document
    defects, notes = NAMES.check(root, file)
    robot = _NativeReader(
        str(file.path), root, defects, tolerance=file.tolerance, as_written=file.as_written
    ).mechanism()
    return replace(robot, notes=(*notes, *robot.notes)) if notes else robot


def parse(text: bytes | str, file: str = "<text>") -> Mechanism:
    """Return the mechanism of a text; ``file`` is named in its defects."""
    return _NativeReader(file, xml.parse_document(text, file)).mechanism()


@dataclass
class _NativeReader(UrdfReader):
    observations: list[Direction] = field(default_factory=list)
    platform: str | None = None
    formation: bool = False
    turns: bool | None = None
    seen: list[ObservationSpec] = field(default_factory=list)
    cameras: list[NamedCamera] = field(default_factory=list)
    camera: str | None = None
    serial: bool = False
    rest: list[str] = field(default_factory=list)
    tolerance: float | None = None
    as_written: bool = False

    def mechanism(self) -> Mechanism:
        root = self.root
        if root.tag != "robot":
            self.defect(xml.get_line(root), "root element", str(root.tag), "robot")
            raise BadRobotFile(self.defects)
        name = self.attribute(root, "name") or "robot"
        self.elements()
        self.own(root.findall("hrsynth"))
        self.rest[:0] = xml.list_unknown(root, ["name"], [*ELSEWHERE, "hrsynth"])
        base = self.structure()
        if self.defects or base is None or self.platform is None:
            raise BadRobotFile(self.defects)
        return self.assemble(name, base, self.platform)

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

    def own(self, elements: list[xml.Element]) -> None:
        """Read the ``<hrsynth>`` element: platform, camera, observations."""
        for extra in elements[1:]:
            self.defect(xml.get_line(extra), "second <hrsynth>")
        if not elements:
            self.defect(xml.get_line(self.root), "no <hrsynth> element, so no <platform>")
            return
        element = elements[0]
        self.serial = element.get("serial") == "true"
        self.seen, self.cameras = self.sights(element)
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
                    setattr(self, role, link)
                if role == "platform":
                    if (text := child.get("turns", "true")) not in TURNS:
                        self.defect(xml.get_line(child), "turns of <platform>", text, "true, false")
                    self.turns = TURNS.get(child.get("turns", ""))
            elif role == "platform":
                self.formation = bool(self.seen)
                if not self.formation:
                    self.defect(
                        xml.get_line(element),
                        "no <platform>",
                        None,
                        "a <platform>, or <observe> between the bodies of a formation",
                    )
        for observe in element.findall("observe"):
            self.observe(observe)
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
            self.rest.append(xml.format_canonical(bare))

    def observe(self, element: xml.Element) -> None:
        """Read an ``<observe>`` of a direction."""
        if is_sight(element):
            return
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
            self.observations.append(Direction(leg, link, direction, line=xml.get_line(element)))

    def structure(self) -> str | None:
        """Return the base; tree joints that do not form one tree are defects."""
        root_line = xml.get_line(self.root)
        if not self.links:
            self.require_some(self.links, "links", self.root)
            return None
        self.check_ends()
        watched = self.cameras or self.root.findall("hrsynth/observe[@kind]")
        if not (self.loops or self.root.findall("loop") or self.serial or watched):
            self.defect(
                root_line,
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
        if not roots:
            return None
        self.check_platform(roots[0])
        return roots[0]

    def check_platform(self, base: str) -> None:
        """Check that the platform differs from the base and is connected to it; that of a formation is its first
        body."""
        line = next((xml.get_line(each) for each in self.root.iterfind("hrsynth/platform")), None)
        whole = [joint.links for joint in self.joints.values() if None not in (joint.ends[0].link, joint.ends[1].link)]
        if self.formation:
            told = [*(each.link for each in self.seen), *(each.link for each in self.cameras)]
            self.platform, count = find_first_body(self.links, whole, base, told)
            if self.platform is None:
                self.defect(
                    line,
                    f"no <platform>, and no formation: {count} of the bodies that only the base connects "
                    "observe or are observed",
                    None,
                    "a <platform>, or two such bodies",
                )
        if self.platform is None:
            return
        if self.platform == base:
            self.defect(line, "the platform is the base", base)
        elif self.platform not in graphs.find_component(graphs.build_adjacency(self.links, whole), base):
            self.defect(line, f"platform not connected to the base {base!r}", self.platform)

    def assemble(self, name: str, base: str, platform: str) -> Mechanism:
        """Return the mechanism, all geometry in the base frame at the zero configuration; its loops must be closed
        there."""
        tree: list[TreeJoint] = graphs.order_outward(base, self.tree.values())
        poses = compute_zero_poses(base, tree)
        joints, loops = {}, []
        for joint in self.joints.values():
            X_P, X_S = joint.frames(poses)
            if not joint.in_tree:
                loops.append((joint, X_P, X_S))
            axes = tuple(X[:3, :3] @ axis for X, axis in zip((X_P, X_S), joint.axes, strict=False))
            joints[joint.name] = Joint(
                joint.name,
                joint.kind,
                *joint.links,
                X_P[:3, 3],
                axes,
                self.motors.get(joint.name),
                joint.limits,
                joint.in_tree,
                joint.xml,
                joint.line,
            )
        links = {key: replace(link, pose=poses[key]) for key, link in self.links.items()}
        mechanism = Mechanism(
            name,
            links,
            joints,
            base,
            platform,
            tuple(self.observations),
            tuple(self.couplings),
            self.camera,
            tuple(self.rest),
            self.file,
            formation=self.formation,
            turns=self.turns,
            choice=FIRST if self.formation else NAMED,
        )
        found = None if self.as_written or not loops else self.repair_rounding(mechanism, loops, poses)
        if found is not None:
            return found
        for joint, X_P, X_S in loops:
            if joint.type is JointType.UNIVERSAL:
                cosine = float(X_P[:3, :3] @ joint.axes[0] @ (X_S[:3, :3] @ joint.axes[1]))
                gap = np.linalg.norm(X_S[:3, 3] - X_P[:3, 3])
                if gap <= GEOMETRY_DIFFERENCE_TOL * mechanism.length and not abs(cosine) <= DIRECTION_SINE_TOL:
                    self.defect(
                        joint.line,
                        f"universal loop {joint.name!r}: cosine between axis and axis2",
                        f"{cosine:.3g}",
                        "0",
                    )
        self.require_sound()
        require_closed(self.file, loops, mechanism.length)
        return self.with_sensors(chains.merge(mechanism))

    def with_sensors(self, mechanism: Mechanism) -> Mechanism:
        """Return the mechanism with its cameras and observations of all kinds."""
        return add_file_observations(mechanism, self.seen, self.cameras, self.file)

    def repair_rounding(
        self, mechanism: Mechanism, loops: Sequence[tuple[JointSpec, Array, Array]], poses: Mapping[str, Array]
    ) -> Mechanism | None:
        """Return the mechanism with repaired geometry if its numbers are rounded; None otherwise."""
        if not (self.tolerance or self.digits.last_place):
            return None
        from ...assembly.build import joint_at, rounding
        from ...assembly.geometry_repair import snap_geometry

        opening = max(compute_closure_residual(joint, X_P, X_S, mechanism.length) for joint, X_P, X_S in loops)
        tolerance = self.tolerance or rounding(self.digits, mechanism.length, opening)
        if not (tolerance and opening <= TOLERANCE_AMBIGUITY_FRACTION * tolerance):
            return None
        self.require_sound()
        between = [replace(joint_at(joint, poses, False), motor=self.motors.get(joint.name)) for joint, _, _ in loops]
        return snap_geometry(self.with_sensors(chains.merge(mechanism.changed(joints=between))), opening, tolerance)
