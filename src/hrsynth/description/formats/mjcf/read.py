"""MJCF: bodies and joints as a tree; ``<equality>`` closes its loops, ``<actuator>`` names its motors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ....errors import Defect
from ....geometry.vectors import Array, build_pose, freeze_array, invert_pose
from ....mechanism import graphs
from ....mechanism.model import JointType, Limits, Link, Motor, Note, make_fresh_name
from ... import numerals, xml
from ...annotations import PREFIX, drop_world, read_annotation
from ...conversion import move_along_joint
from ...elements import XmlReader
from ...file_format import RobotFile
from ...jointgraph import ORIGIN, CouplingSpec, FrameSpec, JointGraph, JointSpec, join_names
from ...keyframes import convert_keyframe
from ..paired import join_named_pairs, join_onshape_pairs
from .content import BodyContents
from .defaults import Compiler, Defaults
from .expand import MODEL, ModelFiles
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
    defects, notes = list[Defect](), list[Note]()

    def check(root: xml.Element) -> None:
        wrong, unknown = NAMES.check(root, file)
        defects.extend(wrong)
        notes.extend(unknown)

    files = ModelFiles(file.path, check)
    root = files.expand(file.document, file.path)
    try:
        graph = _MjcfReader(str(file.path), root, defects=defects, files=files).graph()
    except RecursionError:
        raise xml.make_file_error(file.path, "attached models too deep in others", "fewer") from None
    graph.notes[:0] = notes
    return graph


@dataclass(frozen=True)
class Scope:
    """Conventions of the document that elements are from, and the class of those without one."""

    compiler: Compiler
    defaults: Defaults
    contents: BodyContents
    childclass: str | None = None

    @classmethod
    def of(cls, reader: XmlReader, root: xml.Element, folder: str = "") -> Scope:
        """Return the conventions of a document in a folder."""
        compiler, defaults = Compiler.of(reader, root), Defaults(reader, root)
        return cls(compiler, defaults, BodyContents(reader, compiler, defaults, root, folder))

    def inside(self, element: xml.Element) -> Scope:
        """Return the scope of what a body or frame holds."""
        return replace(self, childclass=element.get("childclass", self.childclass))

    def attributes(self, element: xml.Element, tag: str | None = None) -> dict[str, str]:
        """Return the attributes of an element with those of its class."""
        return self.defaults.of(element, self.childclass, tag)


@dataclass
class _MjcfReader(XmlReader):
    """Reader of bodies, sites and joints in the order of the document."""

    files: ModelFiles = field(kw_only=True)
    placed: dict[str, Array] = field(default_factory=dict)
    """X_WB of each body at the model's zero pose."""
    sites: dict[str, tuple[str, Array]] = field(default_factory=dict)
    tendons: dict[str, dict[str, float]] = field(default_factory=dict)
    """Coefficients of the joints of each fixed tendon."""
    zeros: dict[str, float] = field(default_factory=dict)
    """Coordinate that MuJoCo gives each joint at that pose (``ref``)."""

    def graph(self) -> JointGraph:
        """Return the joint graph of the document."""
        root = self.root
        folder = self.files.main.resolve().parent
        self.scopes = {
            key: Scope.of(self, model, str(file.relative_to(folder).parent))
            for key, (file, model) in self.files.models.items()
        }
        self.scope = Scope.of(self, root)
        graph = self.result = JointGraph(root.get("model") or "robot", self.file, "MJCF", digits=self.digits)
        self.bodies = {str(each.get("name")) for each in root.iter("body")}
        self.named = self.bodies.union(str(each.get("name")) for each in root.iter("joint", "freejoint"))
        graph.links[WORLD] = Link(WORLD)
        graph.base = WORLD
        self.placed[WORLD] = ORIGIN
        for world in root.findall("worldbody"):
            self._children(world, WORLD, self.scope, ORIGIN)
        self.require_some(graph.links.keys() - {WORLD}, "bodies", root)
        self.require_sound()
        self._keyframes()
        self._tendons()
        for section in root.findall("equality"):
            scope = self.scopes.get(section.get(MODEL, ""), self.scope)
            for element in xml.list_children(section):
                self._equality(element, scope.attributes(element, "equality"))
        if all(joint.in_tree for joint in graph.joints.values()):
            frames = {name: FrameSpec(link, freeze_array(X)) for name, (link, X) in self.sites.items()}
            join_onshape_pairs(self, graph, frames)
            join_named_pairs(graph, frames)
        for section in root.findall("actuator"):
            for element in xml.list_children(section):
                self._actuator(element)
        for element in root.iterfind("custom/text"):
            name, data = element.get("name", ""), element.get("data", "")
            if name.startswith(PREFIX + "_") and (wrong := read_annotation(graph, name.split("_")[1], data)):
                self.defect(xml.get_line(element), wrong, data)
        self.require_sound()
        return drop_world(graph)

    def _children(self, element: xml.Element, link: str, scope: Scope, X: Array) -> None:
        """Read the sites, frames and bodies in a body or frame; ``X`` is the frame's pose in the body ``link``."""
        for child in xml.list_children(element):
            if child.tag == "site" and child.get("name"):
                self.sites[child.get("name", "")] = (link, X @ scope.compiler.pose(child))
            elif child.tag == "frame":
                within = self.scopes.get(child.get(MODEL, ""), scope).inside(child)
                self._children(child, link, within, X @ scope.compiler.frame(child))
            elif child.tag == "body":
                self._body(child, link, scope.inside(child), X @ scope.compiler.pose(child))
            elif child.tag in ("composite", "flexcomp"):
                self.defect(xml.get_line(child), f"<{child.tag}> is not read", None, "bodies written out")

    def _body(self, element: xml.Element, parent: str, scope: Scope, X_PB: Array) -> None:
        graph = self.result
        name = element.get("name") or self._fresh("body")
        if name in graph.links:
            self.defect(xml.get_line(element), "second body of the same name", name)
            return
        graph.links[name] = Link(name, xml=scope.contents.of(element, scope.childclass), line=xml.get_line(element))
        self.placed[name] = self.placed[parent] @ X_PB
        joints = [child for child in xml.list_children(element) if child.tag in ("joint", "freejoint")]
        if not joints:
            title = self._fresh(f"{name}_fixed")
            ends = FrameSpec(parent, X_PB), FrameSpec(name)
            graph.joints[title] = JointSpec(title, JointType.FIXED, ends, line=xml.get_line(element))
        before, X = parent, X_PB
        for number, joint in enumerate(joints):
            before, X = self._joint(joint, before, X, name, scope, last=number == len(joints) - 1)
        self._children(element, name, scope, ORIGIN)

    def _joint(
        self, element: xml.Element, before: str, X: Array, body: str, scope: Scope, *, last: bool
    ) -> tuple[str, Array]:
        """Add one joint of a body: from the link before it to the body, or to a link in between."""
        graph = self.result
        given = scope.attributes(element)
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
        unit = scope.compiler.angle(1.0) if kind is JointType.REVOLUTE else 1.0
        self.zeros[name] = unit * float(self._numbers(element, given, "ref", (0,))[0])
        limits = self._limits(element, given, unit, self.zeros[name]) if kind.freedoms == 1 else None
        ends = FrameSpec(before, freeze_array(X @ at), xml.get_line(element)), FrameSpec(after, freeze_array(at))
        graph.joints[name] = JointSpec(name, kind, ends, axes, limits, line=xml.get_line(element))
        return after, ORIGIN

    def _fresh(self, name: str) -> str:
        """Return a name that nothing in the document has."""
        return make_fresh_name(name, self.result.links, self.result.joints, self.named)

    def _numbers(self, element: xml.Element, given: dict[str, str], key: str, default: tuple[float, ...]) -> Array:
        return self.values(given.get(key), default, xml.get_line(element), f"{key} of <{element.tag}>")

    def _limits(self, element: xml.Element, given: dict[str, str], unit: float, zero: float) -> Limits | None:
        if "range" not in given or given.get("limited", "auto") == "false":
            return None
        lower, upper = unit * self._numbers(element, given, "range", (0, 0))
        return Limits(float(lower - zero), float(upper - zero)) if lower < upper else None

    def _equality(self, element: xml.Element, given: dict[str, str]) -> None:
        graph = self.result
        said = element.get("name")  # which bodies and equalities may share
        taken = graph.joints, {gear.name for gear in graph.gears}
        name = make_fresh_name(said, *taken) if said else graph.fresh(str(element.tag))
        if given.get("active", "true") == "false" or self.disabled:
            graph.note("ignored", f"the inactive equality {name!r}{self._wish(element, given)}")
        elif element.tag in ("connect", "weld"):
            ends = self._ends(element, given)
            if ends is not None and ends[0].link != ends[1].link:
                scale = self._numbers(element, given, "torquescale", (1,))[0] if element.tag == "weld" else 0.0
                kind = JointType.FIXED if scale else JointType.SPHERICAL
                graph.close(name, kind, ends, line=xml.get_line(element))
            elif ends is not None:
                self.defect(xml.get_line(element), f"{element.tag} {name!r} connects a body to itself", ends[0].link)
        elif element.tag == "joint" or (
            element.tag == "tendon" and not self.spatial & {given.get("tendon1"), given.get("tendon2")}
        ):
            self._relate(element, given, name)
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

    def _length(self, element: xml.Element, given: dict[str, str], key: str) -> dict[str, float] | None:
        """Return the coefficient of each joint in one side of an equality, None if one of its names is unknown."""
        known, kind = (self.tendons, "tendon") if element.tag == "tendon" else (self.result.joints, "joint")
        name = given.get(key)
        if name is not None and name not in known:
            title = f"{element.tag} equality {given.get('name', '')!r}: unknown {kind}"
            self.defect(xml.get_line(element), title, name, join_names(known, like=name))
            return None
        return {} if name is None else self.tendons[name] if known is self.tendons else {name: 1.0}

    def _relate(self, element: xml.Element, given: dict[str, str], name: str) -> None:
        """y − y₀ = a₀ + a₁ (x − x₀) + …, of joints or lengths of fixed tendons: add a coupling of two joints, or fix
        one joint."""
        graph, line, tag = self.result, xml.get_line(element), str(element.tag)
        left, right = (self._length(element, given, f"{tag}{number}") for number in (1, 2))
        words = given.get("polycoef", "0 1 0 0 0").split()
        coefficients = self._numbers(element, {"polycoef": " ".join((words + ["0"] * 5)[:5])}, "polycoef", (0,) * 5)
        if left is None or right is None:
            return
        offset, ratio, *curve = (float(value) for value in (coefficients if right else coefficients[:1].tolist() + [0]))
        terms = {joint: left.get(joint, 0.0) - ratio * right.get(joint, 0.0) for joint in {**right, **left}}
        driver, *driven = names = [joint for joint, factor in terms.items() if factor or any(curve)] or [""]
        if any(graph.joints[joint].kind.freedoms != 1 for joint in terms):
            self.defect(line, f"{tag} equality {name!r}: joints", join_names(terms), "those of one dof")
        elif len(names) > 2 or (any(curve) and {len(names), len(left) + len(right)} != {2}):
            self.defect(line, f"{tag} equality {name!r}: a relation of joints", join_names(names), "one or two joints")
        elif driven:
            a, b = terms[driver], terms[driven[0]]
            powers = tuple(value * right[driver] ** k / b for k, value in enumerate(curve, 2)) if any(curve) else ()
            graph.gears.append(CouplingSpec(name, driver, driven[0], -a / b, offset / b, line, powers))
        elif driver:
            graph.note("merged", f"joint {driver!r} is fixed by an equality")
            joint = graph.joints[driver]
            X = joint.ends[0].X @ move_along_joint(joint, offset / terms[driver])
            ends = replace(joint.ends[0], X=freeze_array(X)), joint.ends[1]
            graph.joints[driver] = replace(joint, type=JointType.FIXED, axes=(), limits=None, ends=ends)

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
        """Put a motor on a joint; that of a fixed tendon drives the first of its joints, which couplings connect."""
        graph, joint = self.result, element.get("joint") or element.get("jointinparent")
        title = f"the actuator {element.get('name')!r}" if element.get("name") else f"an unnamed <{element.tag}>"
        tendon = self.tendons.get(element.get("tendon", ""), {})
        if pulled := [name for name in tendon if graph.joints[name].kind is not JointType.FIXED]:
            coupled = graphs.build_adjacency(pulled, ((gear.driver, gear.driven) for gear in graph.gears))
            followers = {gear.driven for gear in graph.gears}
            group = graphs.find_component(coupled, pulled[0])
            if not group.issuperset(pulled):
                what = f"{title}, whose tendon pulls {join_names(pulled)}: a motor drives one joint, or coupled ones"
                graph.note("ignored", what)
                return
            joint = next((name for name in graph.joints if name in group - followers), pulled[0])
        if joint is None:
            graph.note("ignored", f"{title}, which drives no joint")
        elif joint not in graph.joints:
            self.defect(
                xml.get_line(element), "actuator of an unknown joint", joint, join_names(graph.joints, like=joint)
            )
        elif graph.joints[joint].motor is None:
            motor = Motor(element.get("name") or f"motor_{joint}")
            graph.joints[joint] = replace(graph.joints[joint], motor=motor)

    def _tendons(self) -> None:
        """Read fixed tendons: the coefficient of each of their joints."""
        flags = [flag.get("equality") for flag in self.root.iterfind("option/flag")]
        self.disabled = flags[-1:] == ["disable"]
        self.spatial = {element.get("name") for element in self.root.iterfind("tendon/spatial")} - {None}
        for element in self.root.iterfind("tendon/fixed"):
            pulled = self.tendons.setdefault(element.get("name", ""), {})
            for child in element.findall("joint"):
                joint = child.get("joint", "")
                if joint not in self.result.joints:
                    known = join_names(self.result.joints, like=joint)
                    self.defect(xml.get_line(child), "fixed tendon of an unknown joint", joint, known)
                elif coefficient := float(self.numbers(child, "coef", (0,))[0]):
                    pulled[joint] = coefficient
