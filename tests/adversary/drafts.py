"""Robots written down in base coordinates at the zero configuration, as native files: what every kind of robot uses.

Shares nothing with the engine: points, axes and the format's own words are all there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
LOOP = {"R": "revolute", "P": "prismatic", "C": "cylindrical", "U": "universal", "S": "spherical"}
FREE = '<limit lower="-1000" upper="1000" effort="1000" velocity="1000" free="lower upper effort velocity"/>'


def unit(v: ArrayLike) -> Array:
    """v / ‖v‖."""
    v = np.asarray(v, dtype=float)
    return v / np.linalg.norm(v)


def turn(axis: ArrayLike, angle: float) -> Array:
    """The rotation (3, 3) about an axis (Rodrigues)."""
    x, y, z = unit(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def across(v: ArrayLike, rng: np.random.Generator) -> Array:
    """A random unit vector normal to v."""
    return unit(np.cross(v, rng.normal(size=3)))


@dataclass
class Made:
    """A robot in the making: joints (name, type, links, centre, axes, motor) in the order in which they build the tree;
    every leg ends on ``platform``, whose frame's origin is at ``at``."""

    name: str
    at: Array
    platform: str = "platform"
    joints: list[tuple[str, str, str, str, Array, tuple[Array, ...], bool]] = field(default_factory=list)
    observed: list[tuple[str, str, Array]] = field(default_factory=list)
    pairs: list[tuple[str, str]] = field(default_factory=list)
    """Links that are the two equal bars of a parallelogram."""
    turned: list[tuple[str, str]] = field(default_factory=list)
    """Links that a parallelogram keeps from turning against each other."""
    tags: set[str] = field(default_factory=set)
    """What is special in it."""
    placed: Array = field(default_factory=lambda: np.eye(4))
    """The rigid motion (4, 4) that was made of the whole robot."""

    def joint(
        self, name: str, kind: str, before: str, after: str, at: ArrayLike, *axes: ArrayLike, motor: bool = False
    ) -> None:
        """A joint of type R, P, C, U or S; U: the first axis fixed in ``before``, the second in ``after``."""
        self.joints.append((name, kind, before, after, np.asarray(at, dtype=float), tuple(map(unit, axes)), motor))

    def moved(self, R: Array, p: Array) -> None:
        """The whole robot turned by R, then shifted by p."""
        self.at = R @ self.at + p
        self.joints = [(*each[:4], R @ each[4] + p, tuple(R @ a for a in each[5]), each[6]) for each in self.joints]
        self.observed = [(leg, link, R @ u) for leg, link, u in self.observed]

    def text(self, rng: np.random.Generator | None = None, decimals: int | None = None) -> str:
        """The native file; with ``rng`` the links' frames are turned at random; ``decimals`` rounds lengths."""
        place = {"base": (np.eye(3), np.zeros(3))}
        lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(self.name)}>", '<link name="base"/>']
        loops, inner = [], []

        def numbers(v: ArrayLike) -> str:
            return " ".join(repr(float(x) + 0.0) for x in np.asarray(v))

        def origin(R: Array, p: Array) -> str:
            p = p if decimals is None else np.round(p, decimals)
            rpy = (
                np.arctan2(R[2, 1], R[2, 2]),
                np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])),
                np.arctan2(R[1, 0], R[0, 0]),
            )
            return f'<origin xyz="{numbers(p)}" rpy="{numbers(rpy)}"/>'

        for name, kind, before, after, at, axes, _ in self.joints:
            R0, p0 = place[before]
            if after in place:
                R1, p1 = place[after]
                ends = [
                    f'<predecessor link="{before}">{origin(np.eye(3), R0.T @ (at - p0))}</predecessor>',
                    f'<successor link="{after}">{origin(R1.T @ R0, R1.T @ (at - p1))}</successor>',
                ]
                axis = [f'<axis xyz="{numbers(R0.T @ axes[0])}"/>'] if axes else []
                axis += [f'<axis2 xyz="{numbers(R0.T @ axes[1])}"/>'] if len(axes) > 1 else []
                loops.append(f'<loop name="{name}" type="{LOOP[kind]}">{"".join(ends + axis)}</loop>')
                continue
            R1 = R0 if rng is None else turn(rng.normal(size=3), rng.uniform(0, 3)) @ R0
            chain = {"S": [np.eye(3)[i] for i in range(3)], "U": [R1.T @ a for a in axes]}.get(kind)
            chain = [R1.T @ axes[0]] if chain is None else chain
            shifted = after == self.platform and float(np.linalg.norm(self.at - at)) > 1e-9
            last = f"{name}__tip" if shifted else after
            parent, X = before, origin(R0.T @ R1, R0.T @ (at - p0))
            for i, axis in enumerate(chain):
                child = last if i == len(chain) - 1 else f"{name}__{i + 1}"
                own = name if len(chain) == 1 else f"{name}__{i + 1}"
                inner.append(f'<link name="{child}"/>')
                slides = kind == "P"
                lines.append(
                    f'<joint name="{own}" type="{"prismatic" if slides else "continuous"}">'
                    f'<parent link="{parent}"/><child link="{child}"/>{X}<axis xyz="{numbers(axis)}"/>'
                    f"{FREE if slides else ''}</joint>"
                )
                parent, X = child, ""
            place[after] = R1, at
            if shifted:
                inner.append(f'<link name="{after}"/>')
                lines.append(
                    f'<joint name="{name}__tip" type="fixed"><parent link="{last}"/><child link="{after}"/>'
                    f"{origin(np.eye(3), R1.T @ (self.at - at))}</joint>"
                )
                place[after] = R1, self.at
        motors = [name for name, *_, motor in self.joints if motor]
        moved = [
            f'<transmission name="motor_{n}"><type>transmission_interface/SimpleTransmission</type>'
            f'<joint name="{n}"/><actuator name="motor_{n}"/></transmission>'
            for n in motors
        ]
        seen = [
            f'<observe leg="{leg}" link="{link}" axis="{numbers(place[link][0].T @ u)}"/>'
            for leg, link, u in self.observed
        ]
        own = ["<hrsynth>", f'<platform link="{self.platform}"/>', *seen, "</hrsynth>", "</robot>"]
        return "\n".join([*lines, *inner, *loops, *moved, *own]) + "\n"


def parallel_rods(
    made: Made,
    name: str,
    before: str,
    after: str,
    start: Array,
    end: Array,
    side: Array,
    ends: Sequence[str] = ("S", "S"),
) -> None:
    """Two equal rods ``name``a, ``name``b from start to end, ± ``side`` apart: {2-SS}, {2-US} or (R, R) a Π."""
    normal = np.cross(side, end - start)
    axes = {"S": (), "R": (normal,), "U": (side, normal)}
    for letter, offset in (("a", side), ("b", -side)):
        made.joint(f"{name}{letter}_up", ends[0], before, name + letter, start + offset, *axes[ends[0]])
        made.joint(f"{name}{letter}_low", ends[1], name + letter, after, end + offset, *axes[ends[1]])
    made.pairs.append((f"{name}a", f"{name}b"))
