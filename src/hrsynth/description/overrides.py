"""What a user says of a file that the file does not say, or says otherwise."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from numbers import Real

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import frozen, pose
from ..mechanism.legs import decompose
from ..mechanism.model import JointType, Mechanism, Motor
from ..mechanism.normal import normal_form
from ..mechanism.sensors import observation_of
from ..tolerances import EXACT, LARGEST_NOISE
from . import numerals
from .contents import scaled_shapes
from .jointgraph import LOOP_TYPES, FrameSpec, JointGraph, comma_list

CLOSURES = {"3d": JointType.SPHERICAL, "6d": JointType.FIXED, **LOOP_TYPES}
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
"""Units of length (m)."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_END = rf"(?:[^:,@]|::)+(?:@{_NUMBER},{_NUMBER},{_NUMBER})?"
_CLOSURE = re.compile(rf"(?P<one>{_END}):(?P<two>{_END})(?::(?P<kind>\w+))?", re.ASCII)


@dataclass(frozen=True)
class Overrides:
    """Base, platform, the motors' joints, closures ``A:B[:type]`` (A, B links, or points ``A@x,y,z`` in them), joints
    to freeze, links to observe, the posture that is the zero pose, the unit of the file's lengths; None or empty where
    the file (or a guess) decides. Up to which ``tolerance`` relations of joints are made exact, or that they stay
    ``as_written``."""

    base: str | None = None
    platform: str | None = None
    motors: tuple[str, ...] | None = None
    close: tuple[str, ...] = ()
    freeze: tuple[str, ...] = ()
    observe: tuple[str, ...] | None = None
    keyframe: str | None = None
    unit: str | None = None
    tolerance: float | None = None
    as_written: bool = False

    @classmethod
    def said(
        cls,
        *,
        motors: str | Iterable[str] | None = None,
        close: str | Iterable[str] = (),
        freeze: str | Iterable[str] = (),
        observe: str | Iterable[str] | None = None,
        tolerance: float | None = None,
        as_written: bool = False,
        **more: str | None,
    ) -> Overrides:
        """What a user says, lists also as texts with commas."""
        if tolerance is not None and as_written:
            raise BadRequest(
                "--as-written keeps the numbers, --tolerance says how far they are changed",
                f"{tolerance:g}",
                "one of the two",
            )
        number = isinstance(tolerance, Real)
        if tolerance is not None and not (number and EXACT < tolerance <= LARGEST_NOISE):
            raise BadRequest(
                "tolerance",
                f"{tolerance:g}" if number else tolerance,
                f"{EXACT:g} to {LARGEST_NOISE:g} (characteristic lengths, radians)",
            )
        return cls(
            motors=names(motors),
            close=closures(close),
            freeze=names(freeze or ()) or (),
            observe=names(observe),
            tolerance=tolerance,
            as_written=as_written,
            **more,
        )

    @property
    def any(self) -> bool:
        """Whether anything is given that changes what the file says."""
        return bool(self.close or self.freeze) or any(
            each is not None for each in (self.platform, self.motors, self.unit, self.keyframe)
        )

    @property
    def named(self) -> tuple[set[str | None], set[str]]:
        """The links and the joints that are named."""
        ends = [
            match[end].partition("@")[0]
            for each in self.close
            if (match := _CLOSURE.fullmatch(each))
            for end in ("one", "two")
        ]
        return {self.base, self.platform, *(self.observe or ()), *ends}, {*(self.motors or ()), *self.freeze}

    @property
    def words(self) -> tuple[str, ...]:
        """The options of the command line that say the same; ``--observe`` is left to what is watched."""
        found: list[str] = []
        for each in fields(self):
            value, flag = getattr(self, each.name), f"--{each.name.replace('_', '-')}"
            if each.name == "close":
                found += [word for closure in value for word in (flag, closure)]
            elif each.name != "observe" and value not in (None, (), False):
                words = [",".join(value) if isinstance(value, tuple) else str(value)]
                found += [flag, *([] if value is True else words)]
        return tuple(found)

    def apply(self, graph: JointGraph) -> None:
        """Unit, closures, frozen joints and motors, in the graph of a file."""
        if self.unit is not None:
            if self.unit not in UNITS:
                raise BadRequest("--unit", self.unit, ", ".join(UNITS))
            graph.scale(UNITS[self.unit])
            graph.links = {name: scaled_shapes(link, UNITS[self.unit]) for name, link in graph.links.items()}
            if any("<inertial" in text for link in graph.links.values() for text in link.xml):
                graph.note("open", f"inertias are taken as they are written, lengths of the file as {self.unit}")
        for closure in self.close:
            _close(graph, closure)
        for name in self.freeze:
            if name not in graph.joints:
                raise BadRequest("--freeze: no such joint", name, comma_list(graph.joints, like=name))
            _freeze(graph, name)
        if self.motors is not None:
            _drive(graph, self.motors)


def names(value: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """A list of names, also as one text set apart by commas."""
    if value is None:
        return None
    parts = value.split(",") if isinstance(value, str) else [*value] if isinstance(value, Iterable) else [value]
    if not all(isinstance(name, str) for name in parts):
        raise BadRequest("names", value, "texts in a list, or one text with commas")
    return tuple(name.strip() for name in parts)


def closures(value: str | Iterable[str]) -> tuple[str, ...]:
    """A list of closures, also as one text set apart by commas, of which points have some of their own."""
    if not isinstance(value, str):
        return names(value) or ()
    whole = re.fullmatch(rf"\s*{_CLOSURE.pattern}(?:\s*,\s*{_CLOSURE.pattern.replace('?P<', '?P<_')})*\s*", value)
    return tuple(match[0].strip() for match in _CLOSURE.finditer(value)) if whole else names(value) or ()


def _freeze(graph: JointGraph, name: str) -> None:
    """Hold a joint at zero, and with it those that gears join to it."""
    graph.joints[name] = replace(graph.joints[name], type=JointType.FIXED, axes=(), motor=None, limits=None)
    geared = [gear for gear in graph.gears if name in (gear.driver, gear.driven)]
    graph.gears = [gear for gear in graph.gears if gear not in geared]
    for gear in geared:
        other = gear.driven if name == gear.driver else gear.driver
        if gear.offset:
            raise BadRequest(
                f"--freeze: joint {name!r} at zero, and with it {other!r} away from zero by the gear {gear.name!r}",
                gear.offset,
                "joints that gears without an offset join",
            )
        if gear.ratio or other == gear.driven:
            graph.note("merged", f"joint {other!r} is held by the gear {gear.name!r}: {name!r} is frozen")
            _freeze(graph, other)


def _close(graph: JointGraph, wish: str) -> None:
    """A closure ``A:B[:type]``: the frames of links A and B, or those frames shifted to points ``A@x,y,z``, meet in all
    that the type does not leave free (its axis is the z axis of A's frame); a point where no type is given. What closes
    the same two frames in the file gives way to it."""
    match = _CLOSURE.fullmatch(wish)
    kind = None if match is None else CLOSURES.get(match["kind"] or "spherical")
    if match is None or kind is None or kind is JointType.UNIVERSAL:
        raise BadRequest(
            "--close",
            wish,
            "A:B or A:B:TYPE, A and B links or points A@x,y,z in them (metres), TYPE one "
            "of " + ", ".join(name for name in CLOSURES if name != "universal"),
        )
    ends = []
    for end in (match["one"], match["two"]):
        link, at, point = end.partition("@")
        if link not in graph.links:
            raise BadRequest("--close: no such link", link, comma_list(graph.links, like=link))
        try:
            ends.append(
                FrameSpec(link, frozen(pose(numerals.parse(point.replace(",", " "), 3)))) if at else FrameSpec(link)
            )
        except ValueError as error:
            raise BadRequest("--close: a point", end, str(error)) from None
    one, two = ends
    if one.link == two.link:
        raise BadRequest("--close: a link cannot meet itself", wish, "two links")
    for name, joint in list(graph.joints.items()):
        if not joint.in_tree and _same_ends(joint.ends, (one, two)):
            del graph.joints[name]
    graph.close(graph.fresh(f"close_{one.link}_{two.link}"), kind, (one, two))


def _same_ends(ends: tuple[FrameSpec, FrameSpec], others: tuple[FrameSpec, FrameSpec]) -> bool:
    """Whether two closures join the same two places."""
    table = {end.link: end.X[:3, 3] for end in others}
    return {end.link for end in ends} == set(table) and all(
        np.array_equal(table[end.link], end.X[:3, 3]) for end in ends
    )


def _drive(graph: JointGraph, wanted: Iterable[str]) -> None:
    """Motors on the named joints alone; both joints of a pair N__1, N__2 may be named as N."""
    chosen = set()
    for name in wanted:
        own = [each for each in graph.joints if name and name in (each, each.rpartition("__")[0])]
        if not own or all(graph.joints[each].type is JointType.FIXED for each in own):
            moving = [each for each, joint in graph.joints.items() if joint.type is not JointType.FIXED]
            raise BadRequest("--motors: no such joint that moves", name, comma_list(moving, like=name))
        chosen.update(own)
    for name, joint in graph.joints.items():
        motor = (joint.motor or Motor(f"motor_{name}")) if name in chosen else None
        graph.joints[name] = replace(joint, motor=motor)


def observe_links(mechanism: Mechanism, links: Iterable[str]) -> Mechanism:
    """The mechanism with the default segments of the named links as its observed directions."""
    normal = normal_form(mechanism)
    legs = decompose(normal.mechanism)
    found = []
    for link in links:
        if normal.into.get(link) not in normal.mechanism.links:
            raise BadRequest(
                f"{mechanism.name}: no link of a leg to observe", link, comma_list(normal.mechanism.links, like=link)
            )
        default = observation_of(legs, normal.into[link])
        turn = mechanism.links[link].pose[:3, :3].T @ normal.mechanism.links[default.link].pose[:3, :3]
        found.append(replace(default, link=link, direction=turn @ default.direction))
    return replace(mechanism, observations=tuple(found))
