"""A mechanism as shapes on its links, made from the joint graph alone: rods, plates and a symbol for every joint.

All points are in the base frame at the zero configuration (m), so that a link's displacement from there moves its
shapes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ...geometry.vectors import Array
from ...mechanism import Joint, JointType, Mechanism
from ...results import Value
from ...tolerances import POINT_DISTANCE_TOL
from ..skeleton import trace_link_outline

BASE, LEG, PLATFORM, VIRTUAL = "base", "leg", "platform", "virtual"
JOINT, MOTOR, ACTUATOR = "joint", "motor", "actuator"
"""What a link is, and what a joint is: passive, driven by the robot's motor, or a virtual actuator."""
ROD_RADIUS_FRACTION = 0.022
"""Of rods (characteristic lengths); the other shapes are multiples of it."""
OUTER, INNER, PLAIN = 1.5, 0.7, 1.0
"""Of a rod in which another slides, of what slides in it, and of the others."""
PAGE_DIGITS_COUNT = 7
"""Digits of metres that the page is given."""


@dataclass(frozen=True, eq=False, repr=False)
class Shape(Value):
    """A shape on a link, its ``points`` (n, 3) and half-width ``size`` (m).

    ``kind``: rod, rail and span run from the first point to the second, a span from a point of ``link`` to one of
    ``other``; a plate is the polygon of its points; a ball has one point; ``hinge`` is a cylinder along its axis, a
    slider a box, a cross has two axes (four points), a disc lies across its axis; a mesh has ``faces`` (m, 3).
    """

    kind: str
    link: str
    points: Array
    size: float
    role: str
    joint: str | None = None
    other: str | None = None
    faces: Array | None = None

    def scene(self, places: dict[str, int]) -> dict[str, Any]:
        """Return the data for the page, links by their ``places``."""
        record: dict[str, Any] = {
            "kind": self.kind,
            "link": places[self.link],
            "role": self.role,
            "size": self.size,
            "points": np.round(self.points, PAGE_DIGITS_COUNT).tolist(),
        }
        if self.other is not None:
            record["other"] = places[self.other]
        if self.faces is not None:
            record["faces"] = self.faces.tolist()
        return record if self.joint is None else {**record, "joint": self.joint}


@dataclass(frozen=True, eq=False, repr=False)
class Drawer(Value):
    """A mechanism to be drawn beside the ``real`` robot (or that itself), whose links keep their form: which links are
    the platform's, and the ``meshes`` that stand for the rods of their links; ``radius`` is that of rods (m)."""

    mechanism: Mechanism
    real: Mechanism
    platform: Collection[str]
    radius: float
    meshes: tuple[Shape, ...] = ()

    def shapes(self, travels: dict[str, tuple[float, float]]) -> tuple[Shape, ...]:
        """All shapes; ``travels`` are the ways (m) that sliders on the base go, from their places at zero."""
        meshed = {shape.link for shape in self.meshes}
        links = [shape for link in self.mechanism.links if link not in meshed for shape in self._rods(link)]
        joints = [
            shape
            for joint in map(self._from_base, self.mechanism.joints.values())
            for shape in (*self._symbol(joint), *self._way(joint, travels))
        ]
        return (*links, *self.meshes, *joints)

    def sliders(self) -> Iterator[Joint]:
        """The joints that slide on the base."""
        for joint in map(self._from_base, self.mechanism.joints.values()):
            if joint.type.has_translation and joint.predecessor == self.mechanism.base:
                yield joint

    def _from_base(self, joint: Joint) -> Joint:
        return joint.turned() if joint.successor == self.mechanism.base else joint

    def role(self, link: str) -> str:
        """Return the role of a link."""
        if link == self.mechanism.base:
            return BASE
        if link in self.platform:
            return PLATFORM
        return LEG if link in self.real.links else VIRTUAL

    def _rods(self, link: str) -> Iterator[Shape]:
        """A rod between two joint centres, the sides of the polygon through more, filled where it is base or platform;
        a virtual rod to each joint that the real robot does not have there."""
        role, size = self.role(link), self.radius * self._thickness(link)
        shown = self.real if link in self.real.links else self.mechanism
        ring = trace_link_outline(shown, link, shown.links[link].pose) if shown.joints_of(link) else np.zeros((0, 3))
        if (
            len(ring) > 3
            and role in (BASE, PLATFORM)
            and _compute_area(ring) > POINT_DISTANCE_TOL * self.real.length**2
        ):
            yield Shape("plate", link, ring[:-1], size, role)
        for start, end in [(ring[0], ring[1])] if len(ring) == 3 else list(pairwise(ring)) if len(ring) > 3 else []:
            yield Shape("rod", link, np.array([start, end]), size, role)
        for joint in self.mechanism.joints_of(link) if len(ring) else ():
            nearest = min(ring, key=lambda corner, joint=joint: float(np.linalg.norm(corner - joint.point)))  # type: ignore[misc]
            if np.linalg.norm(nearest - joint.point) > POINT_DISTANCE_TOL * self.real.length:
                yield Shape("rod", link, np.array([nearest, joint.point]), self.radius, VIRTUAL)

    def _thickness(self, link: str) -> float:
        for joint in self.mechanism.joints_of(link):
            if joint.type.has_translation and self.mechanism.base not in joint.links:
                return OUTER if link == joint.predecessor else INNER
        return PLAIN

    def _symbol(self, joint: Joint) -> Iterator[Shape]:
        """The symbol of a joint, once: on the link that slides where it slides, else on the first."""
        r, point, type = self.radius, joint.point, joint.type
        role = JOINT if not joint.is_actuated else ACTUATOR if joint.name not in self.real.joints else MOTOR

        def made(kind: str, half: float, size: float, axes: Iterable[Array]) -> Shape:
            ends = [point + side * half * r * axis for axis in axes for side in (-1, 1)]
            link = joint.successor if type.has_translation else joint.predecessor
            return Shape(kind, link, np.array(ends or [point]), size * r, role, joint.name)

        if type is JointType.REVOLUTE:
            yield made("hinge", 2.4, 1.7, joint.axes)
        elif type is JointType.PRISMATIC:
            yield made("slider", 3.2, 2.1, joint.axes)
        elif type is JointType.CYLINDRICAL:
            yield made("hinge", 3.6, 2.1, joint.axes)
        elif type is JointType.UNIVERSAL:
            yield made("cross", 3.0, 1.0, joint.axes)
        elif type is JointType.PLANAR:
            yield made("disc", 0.5, 4.0, joint.axes)
        elif type is JointType.SPHERICAL:
            yield made("ball", 0.0, 2.1, ())

    def _way(self, joint: Joint, travels: dict[str, tuple[float, float]]) -> Iterator[Shape]:
        """Return the rail of a prismatic joint on the base, or the extended part between two moving links."""
        role = VIRTUAL if joint.name not in self.real.joints else LEG
        if joint.name in travels:
            ends = np.array([joint.point + way * joint.axis for way in travels[joint.name]])
            yield Shape("rail", joint.predecessor, ends, 0.6 * self.radius, BASE if role is LEG else role)
        elif joint.type.has_translation:
            yield Shape(
                "span", joint.predecessor, np.array([joint.point] * 2), INNER * self.radius, role, other=joint.successor
            )


def _compute_area(ring: Array) -> float:
    """Twice the area of a closed polygon (n, 3)."""
    v = ring - ring[0]
    return float(np.linalg.norm(np.cross(v[:-1], v[1:]).sum(axis=0)))
