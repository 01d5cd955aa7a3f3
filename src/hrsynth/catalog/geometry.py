"""Mechanism of a key: generic dimensions drawn from the key itself, so that it is always the same.

Legs start on a ring of the base and end on a smaller one (planar robots: in one plane); the centres between are random.
Only the key makes a dimension special, so a mechanism that moves does so because of its architecture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from typing import cast

import numpy as np

from ..description.observation_text import ObservationSpec, add_observations
from ..errors import BadRequest
from ..geometry.vectors import Array, build_pose, find_perpendicular, normalise_vector, rotate_about_axis
from ..mechanism.builder import Builder
from ..mechanism.cameras import CameraObservation, NamedCamera
from ..mechanism.legs import decompose
from ..mechanism.model import Mechanism
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.observations import list_kinds
from ..mechanism.observations.direction import Direction
from ..mechanism.sensors import choose_default_segment, observe_segment
from .architecture_key import COMPOSITE, ArchitectureKey, JointSymbol, LegKey

U_JOINT_COSINE_TOL = 1e-9
"""Cosine below which the axes of a U in the catalog are perpendicular."""

Z = np.array([0.0, 0.0, 1.0])


@lru_cache(maxsize=8)
def build_mechanism(word: ArchitectureKey, attempt: int = 0) -> Mechanism:
    """The mechanism of a word: geometry from the word without its motors and the number of the attempt, metres.

    Raises ``BadRequest`` where the axes of a U cannot be at right angles.
    """
    drawn = _Draft(word.unseen, attempt).build()
    return _add_observations(drawn, word, attempt) if word.seen else drawn


def _add_observations(drawn: Mechanism, word: ArchitectureKey, attempt: int) -> Mechanism:
    """Add the sensors of a key: points, axes and cameras in general position.

    The cameras see upwards from below the platform.
    """
    rng = np.random.default_rng(np.frombuffer(sha256(f"{word.unmoved} {attempt} seen".encode()).digest(), np.uint32))
    centre = drawn.links["platform"].pose[:3, 3]
    cameras, specs = dict[str, NamedCamera](), list[ObservationSpec]()
    for number, each in enumerate(word.seen, 1):
        kind, name = list_kinds()[each.kind], f"camera_{number}" if each.own else "camera"
        by_camera = issubclass(kind, CameraObservation)
        if by_camera and name not in cameras:
            at = centre + [*rng.uniform(-0.3, 0.3, size=2), -rng.uniform(0.5, 0.7)]
            cameras[name] = NamedCamera(name, "base", build_pose(at, rotate_about_axis(rng.normal(size=3), 0.2)))
        at, axis = 0.12 * rng.normal(size=3), normalise_vector(rng.normal(size=3))
        specs.append(
            ObservationSpec(
                each.kind,
                "platform",
                f"{each.kind}_{number}",
                name if by_camera else None,
                tuple(at.tolist()) if "at" in kind.needs else None,
                tuple(axis.tolist()) if "axis" in kind.needs else None,
                0.03 if "radius" in kind.needs else None,
            )
        )
    return add_observations(replace(drawn, observations=()), specs, cameras.values())


def is_planar_key(word: ArchitectureKey) -> bool:
    """Return True if all joints of a key move in the plane normal to z."""
    return all(_is_planar_symbol(joint) for leg in word.legs for joint in leg.joints)


def _is_planar_symbol(joint: JointSymbol) -> bool:
    names = {"R": "z", "Pi": "z", "P": "xytrhjml"}.get(joint.letter, "")
    return bool(names) and set(joint.axes) <= set(names)


class _Draft:
    """A mechanism in the making."""

    def __init__(self, word: ArchitectureKey, attempt: int) -> None:
        self.word = word
        seed = sha256(f"{word.unmoved} {attempt}".encode()).digest()
        self.rng = np.random.default_rng(np.frombuffer(seed, dtype=np.uint32))
        self.flat = is_planar_key(word)
        self.centre = np.append(self.rng.normal(scale=0.05, size=2), 0.0)
        if not self.flat:
            self.centre[2] = self.rng.uniform(0.7, 0.9)
        self.common = self.centre * [1, 1, 0] + [0.03, -0.04, 1.3]
        self.builder = Builder(str(word))
        self.builder.link("base")
        self.places: dict[str, Array] = {}

    def build(self) -> Mechanism:
        ends = self._platform()
        number = 0
        watched: dict[str, Direction] = {}
        count = len(self.word.legs)
        turn = self.rng.uniform(0, 2 * np.pi)
        for end, body in zip(ends, self.word.bodies, strict=True):
            for leg in body:
                number += 1
                angle = turn + 2 * np.pi * (number - 1 + self.rng.uniform(-0.2, 0.2)) / count
                _Limb(self, leg, number, angle, end).add(watched)
        return _add_segments(self.builder.build(platform="platform"), self.word, watched)

    def _platform(self) -> tuple[str, ...]:
        """Add the platform; return the links on which legs end."""
        b = self.builder
        match self.word.platform:
            case "bar":
                along = 0.1 * normalise_vector([*self.rng.normal(size=2), 0.0])
                offset = 0.08 * normalise_vector(np.cross(Z, along) + 0.3 * along)
                one, two = self.centre - along, self.centre + along
                for name, at in (("plate_1", one), ("platform", self.centre), ("plate_2", two), ("twin", one + offset)):
                    b.link(name, at=at)
                self.places = {"plate_1": one, "plate_2": two}
                b.joint("hinge_1", "R", "plate_1", "platform", at=one, axis=Z)
                b.joint("hinge_2", "R", "platform", "plate_2", at=two, axis=Z)
                b.joint("twin_1", "R", "plate_1", "twin", at=one + offset, axis=Z)
                b.joint("twin_2", "R", "twin", "plate_2", at=two + offset, axis=Z, loop=True)
                return "plate_1", "plate_2"
            case "slide":
                self.places = {"plate": self.centre, "platform": self.centre}
                b.link("plate", at=self.centre)
                b.link("platform", at=self.centre)
                b.joint(
                    "slide",
                    "P",
                    "plate",
                    "platform",
                    at=self.centre,
                    axis=normalise_vector([*self.rng.normal(size=2), 0.0]),
                )
                return "plate", "platform"
            case _:
                self.places = {"platform": self.centre}
                b.link("platform", at=self.centre)
                return ("platform",)


def _add_segments(drawn: Mechanism, word: ArchitectureKey, chords: Mapping[str, Direction]) -> Mechanism:
    """The mechanism with the segments that the word marks, and the chord of the last link (``chords``, by leg) where
    a leg has no segment by the rules, since its axes meet in a point."""
    decomposition = decompose(reduce_to_normal_form(drawn).mechanism)
    found: list[Direction] = []
    for (label, chord), leg, limb in zip(chords.items(), word.legs, decomposition.legs, strict=True):
        try:
            segment = (
                choose_default_segment(decomposition, limb, last=True)
                if leg.observed is None
                else observe_segment(decomposition, chord.link)
            )
        except BadRequest:
            found.append(chord)
            continue
        if leg.observed is not None:
            found.append(replace(segment, leg=label))
    if not found:
        return drawn
    told = {each.leg: each for each in found}
    return replace(
        drawn,
        observations=tuple(
            told.get(leg.label) or choose_default_segment(decomposition, leg) for leg in decomposition.legs
        ),
    )


class _Limb:
    """Builder of a leg: its centres from base to platform, then its joints."""

    def __init__(self, draft: _Draft, leg: LegKey, number: int, angle: float, end: str) -> None:
        self.draft, self.leg, self.number, self.end, self.rng = draft, leg, number, end, draft.rng
        self.radius = np.array([np.cos(angle), np.sin(angle), 0.0])
        self.tangent = np.cross(Z, self.radius)
        self.own: dict[str, Array] = {}
        lift = np.zeros(3) if draft.flat else 0.05 * self.rng.normal() * Z
        self.foot = 0.5 * self.rng.uniform(0.8, 1.2) * self.radius + lift
        at = draft.places[end]
        reach = 0.0 if draft.word.platform == "point" else 0.2 * self.rng.uniform(0.8, 1.2)
        self.tip = at + reach * rotate_about_axis(Z, self.rng.uniform(-0.3, 0.3)) @ self.radius
        if not draft.flat:
            self.tip = self.tip + 0.04 * self.rng.normal() * Z

    def add(self, watched: dict[str, Direction]) -> None:
        """Adds links and joints; ``watched`` gets the chord of the link that the word marks, else of the last one."""
        starts, ends = self._centres()
        b, k = self.draft.builder, self.number
        before, marked = "base", cast("Direction | None", None)
        last, last_axis = len(self.leg.joints) - 1, self.tangent
        for i, joint in enumerate(self.leg.joints):
            after = self.end if i == last else f"link_{k}_{i + 1}"
            if i != last:
                b.link(after, at=ends[i])
            line = self._line(i, starts, ends)
            axes = self._axes(joint, starts[i], line)
            if (joint.letter, joint.axes) == ("Pi", "n"):
                axes = [normalise_vector(np.cross(last_axis, ends[i] - starts[i]))]
            last_axis = axes[-1] if axes else last_axis
            loop = i == last and self.number > 1
            if joint.letter in COMPOSITE:
                inside = self._rods(joint, i, before, after, starts[i], ends[i], axes[0], loop)
                if joint.watched or (marked is None and i >= last - 1):
                    marked = Direction(str(k), inside, ends[i] - starts[i])
            else:
                b.joint(
                    f"joint_{k}_{i + 1}",
                    joint.letter,
                    before,
                    after,
                    starts[i],
                    axis=axes[0] if axes else None,
                    axis2=axes[1] if len(axes) > 1 else None,
                    motor=f"motor_{k}_{i + 1}" if joint.motor else False,
                    loop=loop,
                )
                is_last = i == last - 1 and self.leg.joints[last].letter not in COMPOSITE
                if joint.watched or (marked is None and is_last):
                    marked = Direction(str(k), after, starts[i + 1] - ends[i])
            before = after
        assert marked is not None
        watched[str(k)] = marked

    def _centres(self) -> tuple[list[Array], list[Array]]:
        """Return start and end of each joint (one point except for composites), from base to platform."""
        joints = self.leg.joints
        gaps = len(joints) - 1 + sum(joint.letter in COMPOSITE for joint in joints)
        along = self.tip - self.foot
        places = [self.foot]
        for step in range(1, gaps):
            aside = self.rng.normal(size=3) * ([1, 1, 0] if self.draft.flat else [1, 1, 1])
            sideways = normalise_vector(aside - 0.7 * (aside @ normalise_vector(along)) * normalise_vector(along))
            places.append(
                self.foot
                + along * (step + self.rng.uniform(-0.2, 0.2)) / gaps
                + 0.35 * float(np.linalg.norm(along)) * sideways
            )
        places.append(self.tip)
        starts, ends, place = list[Array](), list[Array](), 0
        for joint in joints:
            start = places[place]
            starts.append(start)
            if joint.letter in COMPOSITE:
                place += 1
                if joint.letter == "Pi" and joint.axes != "n" and place < len(places) - 1:
                    normal = self._vector(joint.axes, start)
                    places[place] = places[place] - (places[place] - start) @ normal * normal
            ends.append(places[min(place, len(places) - 1)])
            place += 1
        for i, joint in enumerate(joints):
            if joint.axes == "l" and 0 < i < len(joints) - 1:
                starts[i] = ends[i] = (ends[i - 1] + starts[i + 1]) / 2
        return starts, ends

    def _line(self, i: int, starts: Sequence[Array], ends: Sequence[Array]) -> Array:
        """The line of centres at a joint: past a telescopic P, from the joint before it or to the joint after it."""
        joints = self.leg.joints
        if joints[i].axes == "l" and joints[i].letter not in COMPOSITE:
            return starts[min(i + 1, len(joints) - 1)] - ends[max(i - 1, 0)]
        if i + 1 < len(joints):
            return starts[i + 1] - ends[i]
        return starts[i] - ends[i - 1]

    def _axes(self, joint: JointSymbol, at: Array, line: Array) -> list[Array]:
        """The axes of a joint, unit vectors."""
        if joint.letter != "U":
            return [normalise_vector(line) if name in "ln" else self._vector(name, at) for name in joint.axes]
        names = joint.axes
        known = {
            name: normalise_vector(line) if name == "l" else self._vector(name, at)
            for name in names
            if name not in "nq"
        }
        if not known:
            raise BadRequest(f"key {self.draft.word}: axes of a U", names, remedy="Name one other than n or q.")
        found = []
        for name, other in zip(names, reversed(names), strict=True):
            if name == "n":
                found.append(normalise_vector(np.cross(known[other], line)))
            elif name == "q":
                found.append(
                    rotate_about_axis(known[other], self.rng.uniform(0, 2 * np.pi)) @ find_perpendicular(known[other])
                )
            else:
                found.append(known[name])
        if abs(found[0] @ found[1]) > U_JOINT_COSINE_TOL:
            raise BadRequest(f"key {self.draft.word}: axes of U{names} not at right angles", remedy="Use n or q.")
        return found

    def _vector(self, name: str, at: Array) -> Array:
        """The direction of a name, a unit vector."""
        match name:
            case "x" | "y" | "z":
                return np.eye(3)["xyz".index(name)]
            case "t":
                return self.tangent
            case "r":
                return self.radius
            case "o":
                return normalise_vector(self.draft.common - at)
        if name not in self.own:
            self.own[name] = self._random(name)
        return self.own[name]

    def _random(self, name: str) -> Array:
        """A direction of the leg's own; those in a plane keep well away from each other."""
        if name == "k":
            return rotate_about_axis(self.tangent, self.rng.uniform(-1.2, -0.4)) @ self.radius
        if name in "hjm":
            turn = self.rng.uniform(0.4, 0.6) + "hjm".index(name) * np.pi / 3
            return rotate_about_axis(Z, turn + self.rng.uniform(0, 0.3)) @ self.radius
        return normalise_vector(self.rng.normal(size=3) + 0.5 * self.tangent)

    def _rods(
        self, joint: JointSymbol, i: int, before: str, after: str, start: Array, end: Array, axis: Array, loop: bool
    ) -> str:
        """Adds two equal parallel rods, a parallelogram or spatial ones; gives the first."""
        b, k, rod = self.draft.builder, self.number, end - start
        side = 0.06 * (
            normalise_vector(np.cross(axis, rod)) + 0.4 * normalise_vector(rod) if joint.letter == "Pi" else axis
        )
        upper = {"2SS": "S", "2US": "U", "Pi": "R"}[joint.letter]
        lower = "R" if joint.letter == "Pi" else "S"
        along = {"S": (), "R": (axis,), "U": (axis, np.cross(axis, rod))}
        for letter, offset in (("a", side), ("b", -side)):
            name = f"rod_{k}_{i + 1}{letter}"
            b.link(name, at=start + offset)
            for end_name, kind, links, at in (
                ("upper", upper, (before, name), start + offset),
                ("lower", lower, (name, after), end + offset),
            ):
                axes = (*along[kind], None, None)[:2]
                b.joint(
                    f"{end_name}_{k}_{i + 1}{letter}",
                    kind,
                    *links,
                    at,
                    axis=axes[0],
                    axis2=axes[1],
                    loop=end_name == "lower" and (loop or letter == "b"),
                )
        return f"rod_{k}_{i + 1}a"
