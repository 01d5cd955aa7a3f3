"""Links, joints and mechanisms: a frozen multigraph, its geometry given at the zero configuration.

All points and directions are in the base link's frame *at the zero configuration*, where every loop is closed. A joint
therefore needs no frames of its own: a centre and its axes suffice. SI units, radians.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadMechanism, BadRequest, NoPlatform
from ..geometry.vectors import Array, freeze_array, invert_pose, normalise_vector
from ..results import Result, Value, freeze_content
from ..tolerances import GEOMETRY_DIFFERENCE_TOL
from .cameras import NamedCamera
from .graphs import Adjacency, build_adjacency, build_spanning_forest, find_component
from .observation import Observation
from .tilt_limit import TiltLimit

CENTRE_SPREAD_MIN_FRACTION = 1e-12
"""Relative mean distance of joint centres from their centroid below which they are one point."""


class JointType(StrEnum):
    """Joint types, by their letter (docs/pages/theory.md, section 1); the value is what notation prints."""

    REVOLUTE = "R"
    PRISMATIC = "P"
    UNIVERSAL = "U"
    SPHERICAL = "S"
    CYLINDRICAL = "C"
    PLANAR = "E"
    FIXED = "F"
    FREE = "6"

    @property
    def freedoms(self) -> int:
        """Dof of the joint's two links relative to each other."""
        return {"R": 1, "P": 1, "U": 2, "S": 3, "C": 2, "E": 3, "F": 0, "6": 6}[self.value]

    @property
    def axes(self) -> int:
        """Number of axes that the type needs."""
        return {"R": 1, "P": 1, "U": 2, "S": 0, "C": 1, "E": 1, "F": 0, "6": 0}[self.value]

    @property
    def has_translation(self) -> bool:
        """The joint lets its two links translate along its axis (P and C)."""
        return self.value in ("P", "C")


@dataclass(frozen=True)
class Limits:
    """Limits of a joint's coordinate, kept for writing back; None if the file gives none."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None


class JointRange(NamedTuple):
    """Range (m, rad) of a joint's coordinate, infinite without limits, and the index of that coordinate."""

    joint: str
    place: int
    lower: float
    upper: float


@dataclass(frozen=True)
class Motor:
    """Actuator: the name of its transmission; ``xml`` keeps the element of the file it came from."""

    name: str
    xml: str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Link(Value):
    """Rigid body: its frame's pose X_BL at the zero configuration (4, 4); ``xml`` keeps unknown child elements."""

    name: str
    pose: Array = field(default_factory=lambda: freeze_array(np.eye(4)))
    xml: tuple[str, ...] = ()
    line: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", freeze_array(self.pose))

    @cached_property
    def inverse(self) -> Array:
        """X_LB at the zero configuration."""
        return invert_pose(self.pose)


@dataclass(frozen=True, eq=False, repr=False)
class Joint(Value):
    """Joint: ``point`` its centre (3,), ``axes`` unit vectors (R, P, C: one; planar: the normal; U: the first fixed in
    the predecessor, the second in the successor); its coordinate is the successor's motion seen from the
    predecessor."""

    name: str
    type: JointType
    predecessor: str
    successor: str
    point: Array
    axes: tuple[Array, ...] = ()
    motor: Motor | None = None
    limits: Limits | None = None
    in_tree: bool = True
    """A file writes it as a tree joint (else as a loop)."""
    xml: tuple[str, ...] = ()
    line: int | None = field(default=None, compare=False)
    wrist: TiltLimit | None = None
    """Tilt limit of a spherical joint that stands for several R, if they are limited or three (normal form)."""
    turns: tuple[tuple[str, Limits | None], ...] = ()
    """Names and limits of the two R that a U stands for, in the order of its axes (normal form)."""
    offset: Array | None = None
    """Coordinates of the file at the zero configuration (m, rad) of R, P, U and C; of others the displacement (4, 4),
    in the base's frame with a fixed predecessor, that brings the successor to the file's zero. None if they are
    zero."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "type", JointType(self.type))
        object.__setattr__(self, "point", freeze_array(self.point))
        if len(self.axes) != self.type.axes:
            raise BadMechanism(
                f"joint {self.name!r} of type {self.type.value}: number of axes", len(self.axes), str(self.type.axes)
            )
        try:
            object.__setattr__(self, "axes", tuple(freeze_array(normalise_vector(axis)) for axis in self.axes))
        except ValueError as error:
            raise BadMechanism(f"joint {self.name!r}: axis", str(error), "a non-zero vector") from None

    @property
    def axis(self) -> Array:
        """First or only axis."""
        return self.axes[0]

    @property
    def is_actuated(self) -> bool:
        """A motor drives the joint."""
        return self.motor is not None

    @property
    def links(self) -> tuple[str, str]:
        """Predecessor and successor."""
        return self.predecessor, self.successor

    def other(self, link: str) -> str:
        """Return the link at the other end."""
        return self.successor if link == self.predecessor else self.predecessor

    def turned(self) -> Joint:
        """Return the joint with predecessor and successor exchanged (its coordinate keeps its sign)."""
        return self._turned

    @cached_property
    def _turned(self) -> Joint:
        axes = tuple(-axis for axis in reversed(self.axes))
        wrist = None if self.wrist is None else self.wrist.turned()
        offset = self.offset
        if offset is not None and self.type is not JointType.CYLINDRICAL:
            offset = offset[::-1] if offset.ndim == 1 else invert_pose(offset)
        return replace(
            self,
            predecessor=self.successor,
            successor=self.predecessor,
            axes=axes,
            wrist=wrist,
            turns=self.turns[::-1],
            offset=offset,
        )

    def relinked(self, old: str, new: str) -> Joint:
        """Return the joint with its end on ``old`` moved to ``new``."""
        if old == self.predecessor:
            return replace(self, predecessor=new)
        return replace(self, successor=new)


@dataclass(frozen=True)
class Coupling:
    """Coupling: coordinate of the joint ``driven`` = ratio × that of the joint ``driver``, both of one dof."""

    name: str
    driver: str
    driven: str
    ratio: float
    line: int | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Note:
    """Note of reading a file: an ``assumption`` that an option overrides, or what was ``solved``, ``merged``,
    ``ignored`` or left ``open``."""

    kind: str
    text: str
    base: bool = False
    """The note is about the assumed base."""
    count: int = 1
    """Number of elements or relations that are read in another way; 0 for the details of another note."""
    change: float = 0.0
    """Largest change of the geometry (characteristic lengths, rad)."""

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}"


@dataclass(frozen=True)
class PlatformChoice:
    """Choice of the platform: by the ``file``, an ``option`` or an ``assumption``; and the reason. If it is ``open``,
    the reason names the option."""

    chosen: str
    reason: str

    def __str__(self) -> str:
        return f"assumed: {self.reason}" if self.chosen == "assumption" else self.reason


NAMED = PlatformChoice("file", "named in the file")
GIVEN = PlatformChoice("option", "given by --platform")
FIRST = PlatformChoice("file", "the first of the bodies that observe or are observed")
"""Choice of a formation."""


OPEN_MOTORS_MAX = 12
"""Number of joints of an open chain above which they are not proposed as motors: its loops are probably not closed."""
UNCLOSED_MOTORS_MAX = 6
"""The same number where frames are close to each other, which a closure may join."""


def infer_motors(base: str, joints: Sequence[Any]) -> tuple[list[str], str]:
    """Return the joints that could have motors, and which these are: those at the base and links fixed to it; without a
    loop all."""
    fixed = find_component(
        build_adjacency((base,), (joint.links for joint in joints if joint.type is JointType.FIXED)), base
    )
    moving = (joint for joint in joints if joint.type not in (JointType.FIXED, JointType.FREE))
    if len(joints) < len({link for joint in joints for link in joint.links}):
        return [joint.name for joint in moving], "all joints: no loop is closed"
    return [joint.name for joint in moving if fixed & {*joint.links}], "the joints at the base"


def _count_from_zero(bound: float, joint: Joint) -> float:
    """Return a limit from the file's zero, to the digits of its addition."""
    return bound if joint.offset is None or joint.offset.size > 1 else float(f"{bound + joint.offset[0]:.15g}")


def make_fresh_name(name: str, *taken: Container[str]) -> str:
    """Return ``name``, or ``name_2``, ``name_3`` … if it is taken; not the first of these if names between are free."""

    def free(number: int) -> bool:
        return not any(f"{name}_{number}" in each for each in taken)

    if not any(name in each for each in taken):
        return name
    low, high = 1, 2
    while not free(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if free(middle) else (middle, high)
    return f"{name}_{high}"


@dataclass(frozen=True, eq=False, repr=False)
class Mechanism(Result, shown_as="robot"):
    """Links, joints, a base, a platform, observations: a frozen value; every change returns a new one."""

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    base: str
    platform: str
    observations: tuple[Observation, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    camera: str | None = None
    """Reference link, which carries the camera; None means the base."""
    xml: tuple[str, ...] = ()
    file: str | None = field(default=None, compare=False)
    notes: tuple[Note, ...] = field(default=(), compare=False)
    """Notes of reading the file."""
    options: tuple[str, ...] = field(default=(), compare=False)
    """Options of the command line with which its file was read."""
    sha256: str | None = field(default=None, compare=False)
    """Hash of that file's bytes."""
    cameras: tuple[NamedCamera, ...] = ()
    """Named cameras, for observations with their own reference."""
    formation: bool = False
    """No platform is named: all :attr:`bodies` are controlled, up to trivial motions; ``platform`` is only the first of
    them."""
    turns: bool | None = None
    """The platform's rotation is controlled, as in the real robot of a hidden one; None: decided by the joints."""
    choice: PlatformChoice | None = field(default=None, compare=False)
    """Choice of the platform; None in a mechanism that was not read from a file."""
    scale: float | None = field(default=None, compare=False)
    """Characteristic length (m) of the robot whose zero configuration was moved; None if it was not."""
    written: Mechanism | None = field(default=None, compare=False)
    """Robot of the file, for a normal form; None if they are the same."""

    def headline(self) -> str:
        """Name and number of parts."""
        motors = sum(joint.is_actuated for joint in self.joints.values())
        return f"{self.name}, {len(self.links)} links, {len(self.joints)} joints, {motors} motors"

    def to_pinocchio(self) -> Any:
        """Return the robot as ``hrsynth.to_pinocchio`` does: model, constraint models, reference configuration,
        names."""
        return Result.public("to_pinocchio")(self)

    def to_mujoco(self) -> Any:
        """Return the robot as ``hrsynth.to_mujoco`` does, a ``mujoco.MjModel``."""
        return Result.public("to_mujoco")(self)

    def to_urdf(self) -> str:
        """Return the robot as ``hrsynth.to_urdf`` does, the text of its own file."""
        return str(Result.public("to_urdf")(self))

    def said(self) -> tuple[Any, ...]:
        """Everything except where it was read from: two mechanisms with the same links, joints and observations are
        equal."""
        return self._content

    @cached_property
    def _content(self) -> tuple[Any, ...]:
        return tuple(freeze_content(self))

    @cached_property
    def _hash(self) -> int:
        return hash(self._content)

    def __hash__(self) -> int:
        return self._hash

    def __post_init__(self) -> None:
        for key, joint in self.joints.items():
            if key != joint.name:
                raise BadMechanism(f"joint {joint.name!r} is filed under", key, joint.name)
            for link in joint.links:
                if link not in self.links:
                    raise BadMechanism(f"joint {joint.name!r}: unknown link", link, sorted(self.links))
            if joint.predecessor == joint.successor:
                raise BadMechanism(f"joint {joint.name!r} connects a link to itself", joint.predecessor)
        for name in self.coupled_joints:
            if name not in self.joints or not self.joints[name].in_tree or self.joints[name].type.freedoms != 1:
                raise BadMechanism("coupling of a joint", name, "one-dof joints of the spanning tree")
        for role, link in (("base", self.base), ("platform", self.platform), ("camera", self.reference)):
            if link not in self.links:
                raise BadMechanism(f"unknown {role} link", link, sorted(self.links))

    @classmethod
    def of(cls, name: str, links: Iterable[Link], joints: Iterable[Joint], **rest: object) -> Mechanism:
        """Return a mechanism of links and joints; the first link is the base unless ``base`` is given."""
        table = {link.name: link for link in links}
        rest.setdefault("base", next(iter(table)))
        return cls(name=name, links=table, joints={joint.name: joint for joint in joints}, **rest)  # type: ignore[arg-type]

    @property
    def reference(self) -> str:
        """Reference link: observed directions are relative to it."""
        return self.base if self.camera is None else self.camera

    @property
    def bodies(self) -> tuple[str, ...]:
        """Controlled links: the platform; of a formation all links that are observed, carry what observes, or end a
        chain, without the base, in the order of the links but the platform first."""
        if not self.formation:
            return (self.platform,)
        told = {self.base: False} | {link: len(self._joints_of[link]) == 1 for link in self.links if link != self.base}
        for seen in self.observations:
            told |= dict.fromkeys({seen.link, seen.seen_from or self.reference} - {self.base}, True)
        return (self.platform, *(link for link in self.links if told[link] and link != self.platform))

    @property
    def platform_words(self) -> str:
        """Platform, or bodies of a formation, and how it was chosen."""
        bodies = "none" if self.has_open_platform else ", ".join(self.bodies)
        return bodies + ("" if self.choice is None else f" ({self.choice})")

    @property
    def has_open_platform(self) -> bool:
        """The file names no platform and several links could be it: ``platform`` is only the first of these."""
        return self.choice is not None and self.choice.chosen == "open"

    def require_platform(self) -> None:
        """Raise ``NoPlatform`` if the platform is open."""
        if self.has_open_platform:
            raise NoPlatform(f"{self.file or self.name}: {self.choice}")

    @property
    def proposed_motors(self) -> str | None:
        """Message that no joint has a motor, and which could; None if there are motors, or no candidates."""
        names, which = infer_motors(self.base, list(self.joints.values()))
        if not names or any(joint.is_actuated for joint in self.joints.values()):
            return None
        unclosed = any(note.kind == "open" and "frames close to each other" in note.text for note in self.notes)
        most = UNCLOSED_MOTORS_MAX if unclosed else OPEN_MOTORS_MAX
        if all(joint.in_tree for joint in self.joints.values()) and len(names) > most:
            return f"no joint has a motor, and {len(names)} move independently: close the loops first (--close A:B)"
        return f"no joint has a motor: try --motors {','.join(names)} ({which})"

    def require_motors(self) -> None:
        """Raise ``BadRequest`` if no joint has a motor."""
        if not any(joint.is_actuated for joint in self.joints.values()):
            told = (self.proposed_motors or "").removeprefix("no joint has a motor").lstrip(":, ")
            raise BadRequest(f"{self.name}: no motor", remedy=f"Name one or more with --motors{told and f': {told}'}.")

    @cached_property
    def adjacency(self) -> Adjacency:
        """Links in order, each with its neighbours."""
        return build_adjacency(self.links, (joint.links for joint in self.joints.values()))

    @cached_property
    def coupled_joints(self) -> frozenset[str]:
        """Joints whose coordinates are coupled; none of them can be a part of another joint."""
        return frozenset(name for pair in self.couplings for name in (pair.driver, pair.driven))

    @property
    def coupled_links(self) -> set[str]:
        """Links of coupled joints."""
        return {link for name in self.coupled_joints for link in self.joints[name].links}

    @cached_property
    def joint_ranges(self) -> dict[str, tuple[float, float]]:
        """Joints with limits: lower and upper limit (m, rad), infinite if absent."""
        return {
            name: (lower, upper)
            for name, (joint, _, lower, upper) in self.stops.items()
            if not self.joints[joint].turns
        }

    @cached_property
    def stops(self) -> dict[str, JointRange]:
        """Joints with limits, and each R with limits that is joined with another into a U."""
        given = {
            name: (joint.name, place, limits.lower, limits.upper)
            for joint in self.joints.values()
            for place, (name, limits) in enumerate(joint.turns or ((joint.name, joint.limits),))
            if limits is not None and (limits.lower, limits.upper) != (None, None)
        }
        return {
            name: JointRange(joint, place, -np.inf if lower is None else lower, np.inf if upper is None else upper)
            for name, (joint, place, lower, upper) in given.items()
        }

    @cached_property
    def filed(self) -> dict[str, tuple[float, float]]:
        """Joints with limits as in :attr:`joint_ranges`, as the file counts."""
        return {
            name: (_count_from_zero(lower, self.joints[name]), _count_from_zero(upper, self.joints[name]))
            for name, (lower, upper) in self.joint_ranges.items()
        }

    @cached_property
    def idle(self) -> tuple[str, ...]:
        """Floating joints of links that other joints carry: they constrain nothing and have no coordinates."""
        joints = list(self.joints.values())
        floats = [joint.type is JointType.FREE for joint in joints]
        tree = (
            {joint.name for joint in build_spanning_forest(self.links, joints, floats)} if any(floats) else self.joints
        )
        return tuple(joint.name for joint in joints if joint.name not in tree and joint.type is JointType.FREE)

    @cached_property
    def tilt_limits(self) -> dict[str, TiltLimit]:
        """Spherical joints that cannot make every rotation."""
        return {
            name: joint.wrist
            for name, joint in self.joints.items()
            if joint.wrist is not None and joint.wrist.is_limiting
        }

    @cached_property
    def length(self) -> float:
        """Characteristic length (m): mean distance of the joint centres from their centroid; 1 if they coincide, up to
        rounding. It does not change with the zero configuration."""
        if self.scale is not None or not self.joints:
            return self.scale or 1.0
        points = np.array([joint.point for joint in self.joints.values()])
        spread = float(np.mean(np.linalg.norm(points - points.mean(axis=0), axis=1)))
        return spread if spread > CENTRE_SPREAD_MIN_FRACTION * float(np.abs(points).max()) else 1.0

    @cached_property
    def _joints_of(self) -> dict[str, tuple[Joint, ...]]:
        table: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            table[joint.predecessor].append(joint)
            table[joint.successor].append(joint)
        return {name: tuple(joints) for name, joints in table.items()}

    def joints_of(self, link: str) -> tuple[Joint, ...]:
        """Return the joints of a link, in the order of the mechanism."""
        return self._joints_of[link]

    def changed(
        self,
        *,
        remove_links: Iterable[str] = (),
        remove_joints: Iterable[str] = (),
        links: Iterable[Link] = (),
        joints: Iterable[Joint] = (),
        **fields: object,
    ) -> Mechanism:
        """Return a new mechanism: links removed with all their joints and couplings, joints removed, links and joints
        added or replaced."""
        gone = set(remove_links)
        new_links = {name: link for name, link in self.links.items() if name not in gone}
        new_links.update({link.name: link for link in links})
        dropped = set(remove_joints)
        new_joints = {
            name: joint for name, joint in self.joints.items() if name not in dropped and not gone & set(joint.links)
        }
        new_joints.update({joint.name: joint for joint in joints})
        kept = tuple(c for c in self.couplings if {c.driver, c.driven} <= set(new_joints))
        fields.setdefault("couplings", kept)
        return replace(self, links=new_links, joints=new_joints, **fields)  # type: ignore[arg-type]

    def fresh(self, name: str) -> str:
        """Return ``name``, or ``name_2``, ``name_3`` … if it is taken by a link or a joint."""
        return make_fresh_name(name, self.links, self.joints)

    def differences(self, other: Mechanism, tolerance: float = GEOMETRY_DIFFERENCE_TOL) -> list[str]:
        """Return the differences from ``other`` as texts; empty if they are the same mechanism (names, order,
        geometry)."""
        found: list[str] = []

        def compare(what: str, mine: object, theirs: object) -> None:
            if mine != theirs:
                found.append(f"{what}: {mine!r} / {theirs!r}")

        def near(what: str, mine: Iterable[float], theirs: Iterable[float]) -> None:
            gap = np.max(np.abs(np.asarray(mine) - np.asarray(theirs)), initial=0.0)
            if not gap <= tolerance:
                found.append(f"{what}: differs by {gap:.3g}")

        for role in ("base", "platform", "formation", "turns", "reference", "couplings"):
            compare(role, getattr(self, role), getattr(other, role))
        compare("links", set(self.links), set(other.links))
        compare("joints", set(self.joints), set(other.joints))
        compare(
            "observations", [(o.leg, o.link) for o in self.observations], [(o.leg, o.link) for o in other.observations]
        )
        for name in self.links.keys() & other.links.keys():
            near(f"pose of link {name}", self.links[name].pose, other.links[name].pose)
            compare(f"content of link {name}", self.links[name].xml, other.links[name].xml)
        for name in self.joints.keys() & other.joints.keys():
            a, b = self.joints[name], other.joints[name]
            for what in ("type", "links", "limits", "is_actuated", "in_tree", "xml"):
                compare(f"{what} of joint {name}", getattr(a, what), getattr(b, what))
            near(f"centre of joint {name}", a.point, b.point)
            if len(a.axes) == len(b.axes):
                near(f"axes of joint {name}", np.ravel(a.axes), np.ravel(b.axes))
        compare(
            "cameras",
            [(c.name, c.link, c.focal, c.width, c.height) for c in self.cameras],
            [(c.name, c.link, c.focal, c.width, c.height) for c in other.cameras],
        )
        for eye, other_eye in zip(self.cameras, other.cameras, strict=False):
            near(f"pose of camera {eye.name}", eye.pose, other_eye.pose)
        for mine, theirs in zip(self.observations, other.observations, strict=False):
            found.extend(mine.differences(theirs, tolerance))
        return found
