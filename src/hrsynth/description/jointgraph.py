"""Joint graph of a robot file before assembly: links, and joints with a frame on each of their two links."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import Polynomial

from ..geometry.vectors import Array, freeze_array, invert_pose
from ..mechanism import graphs
from ..mechanism.cameras import NamedCamera
from ..mechanism.model import JointType, Limits, Link, Motor, Note, make_fresh_name
from ..mechanism.observations.direction import Direction
from ..mechanism.screws import list_transmitted_wrenches
from ..tolerances import VECTOR_LENGTH_MIN
from .numerals import Digits
from .observation_text import ObservationSpec

ORIGIN = freeze_array(np.eye(4))
Z = freeze_array([0.0, 0.0, 1.0])
LOOP_TYPES = {
    "revolute": JointType.REVOLUTE,
    "continuous": JointType.REVOLUTE,
    "prismatic": JointType.PRISMATIC,
    "cylindrical": JointType.CYLINDRICAL,
    "universal": JointType.UNIVERSAL,
    "spherical": JointType.SPHERICAL,
    "planar": JointType.PLANAR,
    "fixed": JointType.FIXED,
}
"""Names of joint types in a ``<loop>``."""


@dataclass(frozen=True, eq=False)
class FrameSpec:
    """Joint frame on one of its links: the link, the frame's pose in it (4, 4), the line."""

    link: str | None
    X: Array = field(default_factory=lambda: ORIGIN)
    line: int | None = None


@dataclass(frozen=True, eq=False)
class JointSpec:
    """Joint as a file gives it; ``type`` None if unknown. The first axis is fixed in the predecessor's joint frame (R,
    P, C, E: the same vector in both), the second (U) in the successor's."""

    name: str
    type: JointType | None
    ends: tuple[FrameSpec, FrameSpec]
    axes: tuple[Array, ...] = ()
    limits: Limits | None = None
    xml: tuple[str, ...] = ()
    line: int | None = None
    motor: Motor | None = None
    in_tree: bool = True

    @property
    def kind(self) -> JointType:
        """Type of the joint; a joint without one is a defect, so a complete graph has none."""
        return self.type or JointType.FIXED

    @cached_property
    def links(self) -> tuple[str, str]:
        """Predecessor and successor."""
        return str(self.ends[0].link), str(self.ends[1].link)

    @cached_property
    def wrenches(self) -> Array:
        """Unit wrenches that the joint transmits, (6 − dof, 6), in its predecessor's frame where both frames
        coincide."""
        found = np.array(list_transmitted_wrenches(self.kind, np.zeros(3), self.axes)).reshape(-1, 6)
        return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), VECTOR_LENGTH_MIN))

    def frames(self, poses: Mapping[str, Array]) -> tuple[Array, Array]:
        """Return the poses (4, 4) of both joint frames for the links' ``poses``."""
        one, two = self.ends
        return poses[str(one.link)] @ one.X, poses[str(two.link)] @ two.X


@dataclass(frozen=True)
class CouplingSpec:
    """Coupling as a file gives it: coordinate of joint ``driven`` = offset + ratio × that of ``driver``, and terms of
    its square, cube … (``curve``)."""

    name: str
    driver: str
    driven: str
    ratio: float
    offset: float = 0.0
    line: int | None = None
    curve: tuple[float, ...] = ()

    @property
    def polynomial(self) -> Polynomial:
        """Coordinate of the driven joint by that of its driver."""
        return Polynomial((self.offset, self.ratio, *self.curve))

    def scaled(self, driver: float, driven: float) -> CouplingSpec:
        """Return the coupling with the coordinates of both joints multiplied by factors."""
        offset, ratio, *curve = (
            value * driven / driver**power for power, value in enumerate((self.offset, self.ratio, *self.curve))
        )
        return replace(self, ratio=ratio, offset=offset, curve=tuple(curve))


Posture = Mapping[str, Array]
"""Values of some joints, by name, as in :mod:`.jointmotion`; all others are at zero."""


def find_first_body(
    links: Iterable[str], joined: Iterable[tuple[str, str]], base: str, told: Iterable[str]
) -> tuple[str | None, int]:
    """Return the first body of a formation and the number of its parts. A formation has two or more parts, joined only
    by the base, with links that observe or are observed (``told``)."""
    some = set(told) - {base}
    names = [name for name in links if name != base]
    parts = graphs.list_components(graphs.build_adjacency(names, (pair for pair in joined if base not in pair)))
    count = sum(1 for part in parts if some & part)
    return next((name for name in names if name in some), None) if count > 1 else None, count


@dataclass
class JointGraph:
    """Content of a file. With every tree joint at zero its frames on both links coincide."""

    name: str
    file: str
    dialect: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, JointSpec] = field(default_factory=dict)
    gears: list[CouplingSpec] = field(default_factory=list)
    base: str | None = None
    platform: str | None = None
    formation: bool = False
    """The platform is only the first of the controlled bodies."""
    turns: bool | None = None
    """The platform's rotation is controlled; None: decided by the joints."""
    camera: str | None = None
    observations: list[Direction] = field(default_factory=list)
    sights: list[ObservationSpec] = field(default_factory=list)
    """Observations of other kinds, or by named cameras."""
    cameras: list[NamedCamera] = field(default_factory=list)
    rest: list[str] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    digits: Digits = field(default_factory=Digits)
    frames: dict[str, FrameSpec] = field(default_factory=dict)
    """Frames of the file besides those of its links; closures may be given at them."""
    arguments: Mapping[str, str] = field(default_factory=dict)
    """Arguments that a xacro file declares, and their values."""
    is_articulated: bool = False
    """A simulator is to treat the joints of the file's tree as one articulation, which must be a tree."""
    closing: set[str] = field(default_factory=set)
    """Frames that only mark where a loop closes."""
    assumed: dict[str, list[str]] = field(default_factory=dict)
    """Assumptions of one kind about many joints: the text, and the joints."""
    postures: dict[str, Posture] = field(default_factory=dict)
    """Keyframes of the file."""
    start: dict[str, Array] = field(default_factory=dict)
    """Values of joints in the configuration that the file shows."""
    unit: float = 1.0
    """Metres in the file's unit of length, which keyframes keep."""
    is_complete: bool = False
    """The file gives everything: base, platform, a tree directed outward, and a zero configuration that is closed."""

    def note(self, kind: str, text: str, *, base: bool = False) -> None:
        """Record what reading assumed, solved or ignored; ``base``: it is about the choice of the base."""
        self.notes.append(Note(kind, text, base))

    def note_assumed(self) -> None:
        """Record the assumptions about many joints, one note for each kind."""
        for what, names in self.assumed.items():
            self.note("assumption", f"{what}: {join_names(names)}")
        self.assumed.clear()

    def fresh(self, name: str) -> str:
        """Return ``name``, or ``name_2``, ``name_3`` … if it is taken."""
        return make_fresh_name(name, self.links, self.joints, {gear.name for gear in self.gears})

    @property
    def named(self) -> tuple[set[str | None], set[str]]:
        """Links and joints that the file names for more than their place in the tree."""
        links = {self.base, self.platform, self.camera, *(each.link for each in self.cameras)}
        links |= {name for each in self.observations for name in (each.link, each.seen_from)}
        joints = {name for gear in self.gears for name in (gear.driver, gear.driven)}
        seen = {each.link for each in self.sights}
        return links | seen, joints | (seen - self.links.keys())

    @property
    def watched(self) -> list[str]:
        """Links and joints that observations of other kinds name, and links with named cameras."""
        return [*(each.link for each in self.sights), *(each.link for each in self.cameras)]

    def close(
        self,
        name: str,
        kind: JointType,
        ends: tuple[FrameSpec, FrameSpec],
        axes: Sequence[Array] = (Z,),
        line: int | None = None,
        motor: Motor | None = None,
    ) -> None:
        """Add a joint that closes a loop, with as many of ``axes`` as its type has."""
        self.joints[name] = JointSpec(name, kind, ends, tuple(axes[: kind.axes]), None, (), line, motor, in_tree=False)

    def follow(self, gears: Iterable[CouplingSpec]) -> None:
        """Add the couplings of ``<mimic>``, once all joints are known: one R or P joint follows another."""
        for gear in gears:
            ends = [self.joints.get(name) for name in (gear.driver, gear.driven)]
            if all(joint is not None and joint.type in (JointType.REVOLUTE, JointType.PRISMATIC) for joint in ends):
                self.gears.append(replace(gear, name=self.fresh(gear.name)))
            elif ends[0] is None:
                self.note("ignored", f"the mimic of joint {gear.driven!r}, as there is no joint {gear.driver!r}")

    def scale(self, factor: float) -> None:
        """Scale all lengths: frames on links, limits and couplings of prismatic joints."""
        self.unit *= factor
        slides = {name for name, joint in self.joints.items() if joint.type is JointType.PRISMATIC}
        self.frames = {name: scale_frame(frame, factor) for name, frame in self.frames.items()}
        for name, joint in self.joints.items():
            one, two = (scale_frame(end, factor) for end in joint.ends)
            limits = joint.limits
            if limits is not None and name in slides:
                lower, upper, velocity = (
                    None if value is None else factor * value for value in (limits.lower, limits.upper, limits.velocity)
                )
                limits = replace(limits, lower=lower, upper=upper, velocity=velocity)
            self.joints[name] = replace(joint, ends=(one, two), limits=limits)
        self.sights = [
            replace(
                each,
                at=each.at and (factor * each.at[0], factor * each.at[1], factor * each.at[2]),
                radius=each.radius and factor * each.radius,
            )
            for each in self.sights
        ]
        self.cameras = [replace(each, pose=scale_pose(each.pose, factor)) for each in self.cameras]
        units = {name: factor if name in slides else 1.0 for name in self.joints}
        self.gears = [gear.scaled(units[gear.driver], units[gear.driven]) for gear in self.gears]

    def in_metres(self, posture: Posture) -> Posture:
        """Return a keyframe of the file with its lengths in metres."""
        if self.unit == 1:
            return posture
        slides = (JointType.PRISMATIC, JointType.FREE)
        return {
            name: scale_pose(value, self.unit)
            if value.ndim == 2
            else self.unit * value
            if name in self.joints and self.joints[name].type in slides
            else value
            for name, value in posture.items()
        }

    def prune(self, base: str) -> None:
        """Remove links that no chain of joints connects to ``base``, and record them."""
        kept = graphs.find_component(
            graphs.build_adjacency(self.links, (joint.links for joint in self.joints.values())), base
        )
        lost = [link for link in self.links if link not in kept]
        if lost:
            what = f"{len(lost)} links that no joint connects to the base {base!r}"
            self.note("ignored", f"{what}: {join_names(lost, 5)}")
            self.links = {name: link for name, link in self.links.items() if name in kept}
            self.joints = {name: joint for name, joint in self.joints.items() if set(joint.links) <= kept}
            self.gears = [gear for gear in self.gears if {gear.driver, gear.driven} <= set(self.joints)]


def join_names(names: Iterable[str], most: int = 8, like: str | None = None) -> str:
    """Return names separated by commas, the first ones of many; those most ``like`` a text come first."""
    every = list(names)
    if like is not None:
        close = difflib.get_close_matches(like, every, n=most)
        every = [*close, *(name for name in every if name not in close)]
    return ", ".join(every[:most]) + (" …" if every[most:] else "")


def scale_pose(X: Array, factor: float) -> Array:
    """Return a pose (4, 4) with its translation scaled."""
    if X is ORIGIN:
        return X
    larger = X.copy()
    larger[:3, 3] *= factor
    return freeze_array(larger)


def scale_frame(frame: FrameSpec, factor: float) -> FrameSpec:
    """Return a frame with its translation scaled."""
    return FrameSpec(frame.link, scale_pose(frame.X, factor), frame.line)


TreeJoint = tuple[JointSpec, str, str]
"""Joint of a tree, the link nearer to the base, the link that it carries."""


def build_spanning_tree(base: str, joints: Iterable[JointSpec]) -> list[TreeJoint]:
    """Return the joints of a tree rooted at ``base``, parents first; tree joints of the file come before others, joints
    with fewer dof before joints with more."""
    bonds = list(joints)
    links = dict.fromkeys([base, *(link for joint in bonds for link in joint.links)])
    weights = [(not joint.in_tree, joint.kind.freedoms) for joint in bonds]
    return graphs.order_outward(base, graphs.build_spanning_forest(links, bonds, weights))


def compute_zero_poses(base: str, tree: Iterable[TreeJoint]) -> dict[str, Array]:
    """Return the poses (4, 4) of a tree's links in the base frame, all joints at zero: their two frames coincide."""
    X = {base: ORIGIN}
    for joint, parent, child in tree:
        near, far = joint.ends if joint.links[0] == parent else joint.ends[::-1]
        X_J = X[parent] if near.X is ORIGIN else X[parent] @ near.X
        X[child] = X_J if far.X is ORIGIN else X_J @ invert_pose(far.X)
    return X
