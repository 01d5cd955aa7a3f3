"""Overrides: user data that replaces or completes what a robot file gives."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real

import numpy as np

from ..errors import BadRequest
from ..geometry.so3 import convert_vectors_to_rotations, find_smallest_rotations
from ..geometry.vectors import Array, build_pose, freeze_array, invert_pose, normalise_vector
from ..mechanism.legs import decompose
from ..mechanism.model import JointType, Mechanism, Motor
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.sensors import observe_segment
from ..tolerances import EXACT_INCIDENCE_TOL, INCIDENCE_TOL_MAX, VECTOR_LENGTH_MIN
from . import numerals
from .contents import scale_shapes
from .jointgraph import LOOP_TYPES, FrameSpec, JointGraph, build_spanning_tree, compute_zero_poses, join_names

CLOSURES = {"3d": JointType.SPHERICAL, "6d": JointType.FIXED, **LOOP_TYPES}
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
"""Units of length (m)."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_VECTOR = rf"{_NUMBER},{_NUMBER},{_NUMBER}"
_END = rf"(?:[^:,@]|::)+(?:@{_VECTOR})?"
_KIND = rf"(?::(?P<kind>\w+)(?P<axes>(?:/{_VECTOR})*))?"
_CLOSURE = re.compile(rf"(?P<one>{_END}):(?P<two>{_END}){_KIND}", re.ASCII)


@dataclass(frozen=True)
class Overrides:
    """Overrides of a robot file: base, platform, joints of motors, closures ``A:B[:type[/axis]]`` (A, B links or
    frames, or points ``A@x,y,z`` in them), joints to freeze, links to observe, the keyframe that is the zero
    configuration, the unit of the file's lengths, arguments ``name:=value`` of a xacro file, one of several models;
    None or empty if the file (or an assumption) decides. Relations of joints up to ``tolerance`` are made exact; with
    ``as_written`` none is."""

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
    args: tuple[str, ...] = ()
    model: str | None = None

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
        args: Mapping[str, object] | str | Iterable[str] | None = (),
        **more: str | None,
    ) -> Overrides:
        """Return the overrides of these options; lists may be texts with commas."""
        if tolerance is not None and as_written:
            raise BadRequest(
                f"--tolerance {tolerance:g}: cannot be combined with --as-written",
                remedy="Omit one.",
            )
        number = isinstance(tolerance, Real)
        if tolerance is not None and not (number and EXACT_INCIDENCE_TOL < tolerance <= INCIDENCE_TOL_MAX):
            raise BadRequest(
                "tolerance",
                f"{tolerance:g}" if number else tolerance,
                f"{EXACT_INCIDENCE_TOL:g} to {INCIDENCE_TOL_MAX:g} (characteristic lengths, radians)",
            )
        return cls(
            motors=parse_names(motors),
            close=parse_closures(close),
            freeze=parse_names(freeze or ()) or (),
            observe=parse_names(observe),
            tolerance=tolerance,
            as_written=as_written,
            args=parse_arguments(args or ()),
            **more,
        )

    @property
    def has_any(self) -> bool:
        """An option is given that changes the content of the file."""
        return bool(self.close or self.freeze) or any(
            each is not None for each in (self.platform, self.motors, self.unit, self.keyframe)
        )

    @property
    def ends(self) -> set[str]:
        """Links and frames at the ends of closures."""
        matches = filter(None, map(_CLOSURE.fullmatch, self.close))
        return {match[end].partition("@")[0] for match in matches for end in ("one", "two")}

    @property
    def named(self) -> tuple[set[str | None], set[str]]:
        """Links and joints that are named."""
        return {self.base, self.platform, *(self.observe or ()), *self.ends}, {*(self.motors or ()), *self.freeze}

    @property
    def words(self) -> tuple[str, ...]:
        """Options of the command line for these overrides, except ``--observe``."""
        found: list[str] = []
        for each in fields(self):
            value, flag = getattr(self, each.name), f"--{each.name.replace('_', '-')}"
            if each.name in ("close", "args"):
                found += [word for text in value for word in (flag.removesuffix("s"), text)]
            elif each.name != "observe" and (value if isinstance(value, tuple | bool) else value is not None):
                words = [",".join(value) if isinstance(value, tuple) else str(value)]
                found += [flag, *([] if value is True else words)]
        return tuple(found)

    def apply(self, graph: JointGraph) -> None:
        """Apply unit, closures, frozen joints and motors to the graph of a file."""
        if self.unit is not None:
            if self.unit not in UNITS:
                raise BadRequest("--unit", self.unit, ", ".join(UNITS))
            graph.scale(UNITS[self.unit])
            graph.links = {name: scale_shapes(link, UNITS[self.unit]) for name, link in graph.links.items()}
            if any("<inertial" in text for link in graph.links.values() for text in link.xml):
                graph.note("open", f"masses and inertias are not scaled with the unit {self.unit}")
        for closure in self.close:
            _close(graph, closure)
        for name in self.freeze:
            if name not in graph.joints:
                raise BadRequest("--freeze: no such joint", name, join_names(graph.joints, like=name))
            _freeze(graph, name)
        if self.motors is not None:
            _drive(graph, self.motors)


def parse_names(value: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """Return a list of names, given as such or as one text with commas."""
    if value is None:
        return None
    parts = value.split(",") if isinstance(value, str) else [*value] if isinstance(value, Iterable) else [value]
    if not all(isinstance(name, str) for name in parts):
        raise BadRequest("names", value, "texts in a list, or one text with commas")
    return tuple(name.strip() for name in parts)


def parse_arguments(value: Mapping[str, object] | str | Iterable[str]) -> tuple[str, ...]:
    """Return arguments of a xacro file as texts ``name:=value``, given as such or as a mapping."""
    if isinstance(value, Mapping):
        texts = {name: str(item).lower() if isinstance(item, bool) else str(item) for name, item in value.items()}
        value = [f"{name}:={text}" for name, text in texts.items()]
    wanted = (value,) if isinstance(value, str) else tuple(value)
    for text in wanted:
        if not isinstance(text, str) or not re.fullmatch(r"[\w.-]+:=.*", text, re.DOTALL) or "\0" in text:
            raise BadRequest("--arg", text, "NAME:=VALUE, as for xacro")
    return wanted


def parse_closures(value: str | Iterable[str]) -> tuple[str, ...]:
    """Return a list of closures, given as such or as one text with commas; points and axes have commas of their own.
    A closure may be a number with a type, for a pair of a numbered list."""
    if not isinstance(value, str):
        return parse_names(value) or ()
    closure = re.sub(r"\?P<\w+>", "", rf"(?:\d+{_KIND}(?=\s*(?:,|$))|{_CLOSURE.pattern})")
    if re.fullmatch(rf"\s*{closure}(?:\s*,\s*{closure})*\s*", value, re.ASCII):
        return tuple(match[0].strip() for match in re.finditer(closure, value, re.ASCII))
    return parse_names(value) or ()


def _freeze(graph: JointGraph, name: str) -> None:
    """Fix a joint at zero, and with it the joints that couplings connect to it."""
    graph.joints[name] = replace(graph.joints[name], type=JointType.FIXED, axes=(), motor=None, limits=None)
    geared = [gear for gear in graph.gears if name in (gear.driver, gear.driven)]
    graph.gears = [gear for gear in graph.gears if gear not in geared]
    for gear in geared:
        other = gear.driven if name == gear.driver else gear.driver
        if gear.offset:
            raise BadRequest(
                f"--freeze {name}: the coupling {gear.name!r} moves joint {other!r} away from zero; its offset",
                gear.offset,
                "an offset of 0",
            )
        if gear.ratio or other == gear.driven:
            graph.note("merged", f"joint {other!r} is fixed by the coupling {gear.name!r}: {name!r} is frozen")
            _freeze(graph, other)


def _close(graph: JointGraph, wish: str) -> None:
    """Add a closure ``A:B[:type[/axis]]``: the frames of links A and B (or frames of the file), or those frames shifted
    to points ``A@x,y,z``, meet in all directions that the type does not leave free; without a type in a point. It
    replaces closures of the file between the same two frames."""
    match = _CLOSURE.fullmatch(wish)
    kind = None if match is None else CLOSURES.get(match["kind"] or "spherical")
    if match is None or kind is None:
        raise BadRequest(
            "--close",
            wish,
            "A:B or A:B:TYPE or A:B:TYPE/x,y,z, A and B links, frames or points A@x,y,z in them (metres), x,y,z the "
            "axis in A's frame, TYPE one of " + ", ".join(CLOSURES),
        )
    one, two = _find_end(graph, match["one"]), _find_end(graph, match["two"])
    if one.link == two.link:
        raise BadRequest("--close: both ends are on one link", wish, "two links")
    axes = [_parse_vector(text, "axis") for text in match["axes"].split("/")[1:]] if match["axes"] else []
    two, axes = _place_axes(graph, wish, kind, (one, two), axes)
    for name, joint in list(graph.joints.items()):
        if not joint.in_tree and _is_same_closure(joint.ends, (one, two)):
            del graph.joints[name]
    graph.close(graph.fresh(f"close_{one.link}_{two.link}"), kind, (one, two), axes)


def _find_end(graph: JointGraph, text: str) -> FrameSpec:
    """Return the end of a given closure: a link, or a frame of the file, perhaps shifted to a point in it."""
    name, is_point, point = text.partition("@")
    end = FrameSpec(name) if name in graph.links else graph.frames.get(name)
    if end is None or end.link not in graph.links:
        raise BadRequest("--close: no such link or frame", name, join_names([*graph.links, *graph.frames], like=name))
    X = end.X @ build_pose(_parse_vector(point, "point")) if is_point else end.X
    return FrameSpec(end.link, freeze_array(X))


def _parse_vector(text: str, what: str) -> Array:
    try:
        return numerals.parse(text.replace(",", " "), 3)
    except ValueError as error:
        raise BadRequest(f"--close: {what}", text, str(error)) from None


def _place_axes(
    graph: JointGraph, wish: str, kind: JointType, ends: tuple[FrameSpec, FrameSpec], axes: list[Array]
) -> tuple[FrameSpec, list[Array]]:
    """Return B's end and the unit axes. One axis is given in A's frame, and B has it where the file's zero puts it; a
    second one is given in B's frame."""
    first, second = ends
    if not 1 <= len(axes) <= 2 if kind.axes == 1 else len(axes) != kind.axes:
        ask = (
            f"TYPE/x,y,z, the axis in {first.link}'s frame (and /x,y,z in {second.link}'s if zero leaves it open)",
            "TYPE/x,y,z/x,y,z, an axis in each frame",
        )
        expected = ask[kind.axes - 1].replace("TYPE", kind.name.lower()) if kind.axes else "no axis for this type"
        raise BadRequest(f"--close {wish}: axes", len(axes), expected)
    if not all(np.linalg.norm(axis) > VECTOR_LENGTH_MIN for axis in axes):
        raise BadRequest("--close: axis", wish, "a non-zero vector")
    axes = [normalise_vector(axis) for axis in axes]
    if kind.axes != 1:
        return second, axes
    tree = build_spanning_tree(str(first.link), (joint for joint in graph.joints.values() if joint.in_tree))
    poses = compute_zero_poses(str(first.link), tree)
    R = (invert_pose(poses[str(second.link)]) @ first.X if second.link in poses else second.X)[:3, :3]
    if len(axes) == 2:
        R = convert_vectors_to_rotations(find_smallest_rotations(R @ axes[0], second.X[:3, :3] @ axes[1])) @ R
    return FrameSpec(second.link, freeze_array(build_pose(second.X[:3, 3], R))), axes[:1]


def _is_same_closure(ends: tuple[FrameSpec, FrameSpec], others: tuple[FrameSpec, FrameSpec]) -> bool:
    """Return True if two closures join the same two points."""
    table = {end.link: end.X[:3, 3] for end in others}
    return {end.link for end in ends} == set(table) and all(
        np.array_equal(table[end.link], end.X[:3, 3]) for end in ends
    )


def _drive(graph: JointGraph, wanted: Iterable[str]) -> None:
    """Put motors on the named joints alone; both joints of a pair N__1, N__2 may be named as N."""
    chosen = set()
    for name in wanted:
        own = [each for each in graph.joints if name and name in (each, each.rpartition("__")[0])]
        if not own or all(graph.joints[each].type is JointType.FIXED for each in own):
            moving = [each for each, joint in graph.joints.items() if joint.type is not JointType.FIXED]
            raise BadRequest("--motors: no such movable joint", name, join_names(moving, like=name))
        chosen.update(own)
    for name, joint in graph.joints.items():
        motor = (joint.motor or Motor(f"motor_{name}")) if name in chosen else None
        graph.joints[name] = replace(joint, motor=motor)


def observe_links(mechanism: Mechanism, links: Iterable[str]) -> Mechanism:
    """Return the mechanism with the default segments of the named links as its observed directions."""
    normal = reduce_to_normal_form(mechanism)
    legs = decompose(normal.mechanism)
    found = []
    for link in links:
        if normal.into.get(link) not in normal.mechanism.links:
            raise BadRequest(
                f"{mechanism.name}: not a link of a leg", link, join_names(normal.mechanism.links, like=link)
            )
        default = observe_segment(legs, normal.into[link])
        turn = mechanism.links[link].pose[:3, :3].T @ normal.mechanism.links[default.link].pose[:3, :3]
        found.append(replace(default, link=link, direction=turn @ default.direction))
    return replace(mechanism, observations=tuple(found))
