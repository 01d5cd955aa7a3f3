"""The loops' equations of :mod:`..analysis.branch.loops` on components: numbers, arrays, or symbols of a tape.

Each loop is cut at its joint: points coincide, axes stay perpendicular. Metres, radians, base axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.branch.loops import LoopSystem, TreeCoordinate
from ..geometry.components import Components, arctan2, cosine, cross, dot, minus, plus, sine, transformed
from ..geometry.vectors import Array, frozen, perpendicular
from ..mechanism import Joint, JointType, Mechanism
from ..results import Value
from ..tolerances import ROUNDED_AXIS


@dataclass(frozen=True, eq=False, repr=False)
class MovedBody:
    """A body moved from zero: rotation (9 components, row by row) and origin, at zero ``basis`` and ``centre``."""

    R: Components
    o: Components
    basis: Array
    centre: Array

    def direction(self, d: Array) -> list[Any]:
        """Where a direction of the body at zero points now."""
        return transformed(self.R, _sharpened(self.basis.T @ d))

    def point(self, x: Array) -> list[Any]:
        """Where a point of the body at zero is now."""
        return plus(self.o, transformed(self.R, self.basis.T @ (x - self.centre)))


@dataclass(frozen=True, eq=False, repr=False)
class TreeConfiguration:
    """What the coordinates beyond ``root`` move, in the axes and from the place that the body of ``root`` has at zero:
    by coordinate, the body that it moves last, its axis and a point on it."""

    root: int
    bodies: dict[int, MovedBody]
    axes: dict[int, Components]
    points: dict[int, Components]


BASE = MovedBody(np.eye(3).ravel(), np.zeros(3), np.eye(3), np.zeros(3))
Row = tuple[Any, dict[int, Any]]
"""An equation's left side, and its derivatives by the coordinates that it depends on."""


@dataclass(frozen=True, eq=False, repr=False)
class LoopFormulas(Value):
    """The coordinates of a mechanism's tree, parents first, and the joints at which its loops are cut; ``body[link]``
    is the coordinate that carries a link, −1 for what stands still; ``gears``: one, the one it follows, ratio."""

    mechanism: Mechanism
    coordinates: tuple[TreeCoordinate, ...]
    body: dict[str, int]
    loops: tuple[Joint, ...]
    gears: tuple[tuple[int, int, float], ...]

    @classmethod
    def of(cls, system: LoopSystem) -> LoopFormulas:
        """Those of a system, in metres."""
        units = system.units
        return cls(system.mechanism, tuple(replace(each, point=frozen(each.point * system.length))
                                           for each in system.coordinates), dict(system.body),
                   tuple(system.mechanism.joints[loop.name] for loop in system.loops),
                   tuple((gear.second, gear.first, float(gear.ratio * units[gear.second] / units[gear.first]))
                         for gear in system.gears))

    @cached_property
    def ways(self) -> dict[int, tuple[int, ...]]:
        """The coordinates that move the body of each, itself last; none move the base, −1."""
        found: dict[int, tuple[int, ...]] = {-1: ()}
        for i, coordinate in enumerate(self.coordinates):
            found[i] = (*found[coordinate.parent], i)
        return found

    def moved(self, values: Components, root: int = -1) -> TreeConfiguration:
        """The bodies at values of all coordinates, seen from the body of ``root``."""
        found = TreeConfiguration(root, {root: BASE}, {}, {})
        for i, (coordinate, value) in enumerate(zip(self.coordinates, values, strict=True)):
            if coordinate.parent not in found.bodies:
                continue
            parent, B = found.bodies[coordinate.parent], _basis(coordinate.axis)
            axis, origin = parent.direction(coordinate.axis), parent.point(coordinate.point)
            x, y = parent.direction(B[:, 0]), parent.direction(B[:, 1])
            if coordinate.slides:
                origin = plus(origin, [value * each for each in axis])
            else:
                c, s = cosine(value), sine(value)
                x, y = ([c * a + s * b for a, b in zip(x, y, strict=True)],
                        [c * b - s * a for a, b in zip(x, y, strict=True)])
            R = [each for row in zip(x, y, axis, strict=True) for each in row]
            found.bodies[i] = MovedBody(R, origin, B, coordinate.point)
            found.axes[i], found.points[i] = axis, origin
        return found

    def pose(self, at: TreeConfiguration, link: str) -> tuple[list[Any], list[Any]]:
        """Rotation (9 components) and origin of a link's frame."""
        body, X = at.bodies[self.body[link]], self.mechanism.links[link].pose
        columns = [body.direction(X[:3, i]) for i in range(3)]
        return [each for row in zip(*columns, strict=True) for each in row], body.point(X[:3, 3])

    def velocity(self, at: TreeConfiguration, carrier: int, x: Components
                 ) -> dict[int, tuple[Components, Components]]:
        """By each coordinate that moves the body of ``carrier``: the velocity of its point x, the angular velocity."""
        zero = [0.0, 0.0, 0.0]
        return {i: (at.axes[i], zero) if self.coordinates[i].slides else
                (cross(at.axes[i], minus(x, at.points[i])), at.axes[i]) for i in self.ways[carrier] if i in at.axes}

    def rows(self, values: Components) -> list[Row]:
        """All equations at values of all coordinates, loop by loop, then gears; each loop is seen from the last body on
        the way to both of its ends."""
        found: list[Row] = []
        seen: dict[int, TreeConfiguration] = {}
        for joint in self.loops:
            one, other = (self.ways[self.body[link]] for link in joint.links)
            root = max({-1, *one} & {-1, *other})
            if root not in seen:
                seen[root] = self.moved(values, root)
            found += self._of_loop(seen[root], joint)
        for led, lead, ratio in self.gears:
            found.append((values[led] - ratio * values[lead], {led: 1.0, lead: -ratio}))
        return found

    def cut(self) -> list[tuple[str, Joint, int]]:
        """The coordinates of the cut joints that one or two axes give: name, joint, which."""
        found = []
        for joint in self.loops:
            count = 0 if joint.type in (JointType.SPHERICAL, JointType.PLANAR) else joint.type.freedoms
            found += [(joint.name if count == 1 else f"{joint.name}.{k + 1}", joint, k) for k in range(count)]
        return found

    def cut_coordinate(self, at: TreeConfiguration, joint: Joint, which: int) -> Row:
        """A coordinate of a cut joint, turns between −π and π, with its derivatives."""
        near, far = (self.body[link] for link in joint.links)
        one, other = at.bodies[near], at.bodies[far]
        A, B = one.point(joint.point), other.point(joint.point)
        of_A, of_B = self.velocity(at, near, A), self.velocity(at, far, B)
        still = ([0.0] * 3, [0.0] * 3)
        twists = {i: (of_A.get(i, still), of_B.get(i, still)) for i in sorted({*of_A, *of_B})}
        axis = one.direction(joint.axis)
        if joint.type.slides and which == 0:
            return dot(axis, minus(B, A)), {i: dot(axis, minus(v_B, v_A)) for i, ((v_A, _), (v_B, _)) in twists.items()}
        if joint.type is JointType.UNIVERSAL:
            first, second = joint.axes
            if which == 1:
                # seen from the second link, the first axis turns back about the second one
                axis, start, moved, flat = (other.direction(second), other.direction(first), one.direction(first),
                                            np.cross(first, second))
                across = other.direction(flat)
            else:
                start, moved, across = one.direction(second), other.direction(second), one.direction(
                    np.cross(first, second))
        else:
            normal = perpendicular(joint.axis)
            start, moved, across = one.direction(normal), other.direction(normal), one.direction(
                np.cross(joint.axis, normal))
        # d(turn) = axis·(ω_B − ω_A), the other axis of a U being normal to this one
        return arctan2(dot(across, moved), dot(start, moved)), {
            i: dot(axis, minus(w_B, w_A)) for i, ((_, w_A), (_, w_B)) in twists.items()}

    def _of_loop(self, at: TreeConfiguration, joint: Joint) -> Iterator[Row]:
        """The equations of a cut joint: ``joint.point`` of both links along directions of the first, and directions of
        the first perpendicular to some of the second."""
        near, far = (self.body[link] for link in joint.links)
        one, other = at.bodies[near], at.bodies[far]
        e = np.eye(3)
        across = [] if not joint.axes else list(np.linalg.svd(joint.axis[None])[2][1:])
        match joint.type:
            case JointType.SPHERICAL:
                spans, pairs = None, []
            case JointType.REVOLUTE:
                spans, pairs = None, [(joint.axis, each) for each in across]
            case JointType.UNIVERSAL:
                spans, pairs = None, [(joint.axes[0], joint.axes[1])]
            case JointType.PRISMATIC:
                spans, pairs = across, [(joint.axis, across[0]), (joint.axis, across[1]), (across[0], across[1])]
            case JointType.CYLINDRICAL:
                spans, pairs = across, [(joint.axis, each) for each in across]
            case JointType.PLANAR:
                spans, pairs = [joint.axis], [(joint.axis, each) for each in across]
            case _:
                spans, pairs = None, [(e[0], e[1]), (e[1], e[2]), (e[2], e[0])]
        # (1) the joint's centres coincide, along ``spans`` where it slides
        A, B = one.point(joint.point), other.point(joint.point)
        gap, still = minus(B, A), ([0.0] * 3, [0.0] * 3)
        of_A, of_B = self.velocity(at, near, B if spans else A), self.velocity(at, far, B)
        twists = {i: (of_A.get(i, still), of_B.get(i, still)) for i in sorted({*of_A, *of_B})}
        for place in range(3) if spans is None else ():
            yield gap[place], {i: v_B[place] - v_A[place] for i, ((v_A, _), (v_B, _)) in twists.items()}
        for n in spans or ():
            # d/dq n·(B − A) = n·(v_B − v_A'), A' the point of the first body at B: n turns with that body
            now = one.direction(n)
            yield dot(now, gap), {i: dot(now, minus(v_B, v_A)) for i, ((v_A, _), (v_B, _)) in twists.items()}
        # (2) a of the first ⟂ b of the second: d/dq a·b = (ω_A − ω_B)·(a × b)
        for a, b in pairs:
            a_now, b_now = one.direction(a), other.direction(b)
            normal = cross(a_now, b_now)
            yield dot(a_now, b_now), {i: dot(minus(w_A, w_B), normal)
                                      for i, ((_, w_A), (_, w_B)) in twists.items()}


def _basis(axis: Array) -> Array:
    """A right-handed triad with an axis as its third column, of base axes where it is one (3, 3)."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    return _sharpened(np.stack([first, np.cross(axis, first), axis], axis=1))


def _sharpened(directions: Array) -> Array:
    """Directions whose components that are zero but for rounding are zero."""
    return np.where(np.abs(directions) < ROUNDED_AXIS, 0.0, np.asarray(directions, dtype=float))
