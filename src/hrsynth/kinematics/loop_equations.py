"""The loops of a mechanism as equations in the coordinates of a spanning tree's joints, on components: for numbers,
arrays, balls, or symbols of a tape.

The tree is the file's, with the motors in it; a joint of several freedoms is the chain of single ones that files write
(:mod:`..description.chains`). Each loop is cut at its joint: points coincide, axes stay perpendicular. Metres, radians,
base axes; all coordinates are 0 at the zero configuration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..description.chains import part_names, parts
from ..errors import BadMechanism
from ..geometry.components import Components, cosine, cross, dot, minus, plus, sine, transformed
from ..geometry.vectors import Array, frozen
from ..mechanism import Joint, JointType, Mechanism, graphs
from ..results import Value
from ..tolerances import ROUNDED_AXIS


@dataclass(frozen=True, eq=False, repr=False)
class TreeCoordinate(Value):
    """A coordinate of a tree joint: its ``name`` in a file, whether it ``slides``; the link that it moves is on the
    body that ``parent`` moves (−1: the base). At zero, ``axis`` and a ``point`` on it."""

    name: str
    joint: str
    slides: bool
    actuated: bool
    parent: int
    axis: Array
    point: Array

    @cached_property
    def basis(self) -> Array:
        """A right-handed triad with the axis as its third column, of base axes where it is one (3, 3)."""
        place = int(np.argmin(np.abs(self.axis)))
        first = np.cross(self.axis, np.eye(3)[place])
        first /= np.linalg.norm(first)
        return _sharpened(np.stack([first, np.cross(self.axis, first), self.axis], axis=1))


@dataclass(frozen=True, eq=False, repr=False)
class MovedBody:
    """A body moved from zero: rotation (9 components, row by row) and origin; at zero those are ``basis``, ``centre``.
    """

    R: Components
    o: Components
    basis: Array
    centre: Array

    def direction(self, d: Array) -> list[object]:
        """Where a direction of the body at zero points now."""
        return transformed(self.R, _sharpened(self.basis.T @ d))

    def point(self, x: Array) -> list[object]:
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
Row = tuple[object, dict[int, object]]
"""An equation's left side, and its derivatives by the coordinates that it depends on."""


@dataclass(frozen=True, eq=False, repr=False)
class LoopEquations(Value):
    """The coordinates of a mechanism's tree and the equations of its loops."""

    mechanism: Mechanism
    coordinates: tuple[TreeCoordinate, ...]
    carriers: dict[str, int]
    """The last coordinate that moves each link; −1 for what is fixed to the base."""
    loops: tuple[Joint, ...]

    @classmethod
    def of(cls, mechanism: Mechanism) -> LoopEquations:
        """The tree of the file, but with every motor in it; raises ``BadMechanism`` for links that nothing holds."""
        joints = [joint for joint in mechanism.joints.values() if joint.type is not JointType.FREE]
        weights = [0.0 if joint.type is JointType.FIXED else 1.0 if joint.actuated else 2.0 if joint.in_tree else 3.0
                   for joint in joints]
        tree = graphs.outward(mechanism.base, graphs.spanning_forest(mechanism.links, joints, weights))
        missing = sorted(set(mechanism.links) - {mechanism.base, *(far for _, _, far in tree)})
        if missing:
            raise BadMechanism(f"{mechanism.name}: links that no joint with limited freedoms holds", ", ".join(missing))
        carriers, made = {mechanism.base: -1}, []
        for joint, near, far in tree:
            parent = carriers[near]
            for name, slides, axis in _steps(mechanism, joint, near):
                made.append(TreeCoordinate(name, joint.name, slides, joint.actuated, parent, frozen(axis), joint.point))
                parent = len(made) - 1
            carriers[far] = parent
        used = {joint.name for joint, _, _ in tree}
        return cls(mechanism, tuple(made), carriers, tuple(j for j in joints if j.name not in used))

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
            parent, B = found.bodies[coordinate.parent], coordinate.basis
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

    def pose(self, at: TreeConfiguration, link: str) -> tuple[list[object], list[object]]:
        """Rotation (9 components) and origin of a link's frame."""
        body, X = at.bodies[self.carriers[link]], self.mechanism.links[link].pose
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
            one, other = (self.ways[self.carriers[link]] for link in joint.links)
            root = max({-1, *one} & {-1, *other})
            if root not in seen:
                seen[root] = self.moved(values, root)
            found += self._of_loop(seen[root], joint)
        for coupling in self.mechanism.couplings:
            led, lead = (self._single(coupling.name, link) for link in (coupling.successor, coupling.predecessor))
            found.append((values[led] - coupling.ratio * values[lead], {led: 1.0, lead: -coupling.ratio}))
        return found

    def _single(self, name: str, link: str) -> int:
        """The coordinate of the one joint that carries a link."""
        for i, coordinate in enumerate(self.coordinates):
            joint = self.mechanism.joints[coordinate.joint]
            if joint.successor == link and joint.type.freedoms == 1:
                return i
        raise BadMechanism(f"coupling {name!r}: no single joint of the tree carries the link", link)

    def _of_loop(self, at: TreeConfiguration, joint: Joint) -> Iterator[Row]:
        """The equations of a cut joint: ``joint.point`` of both links along directions of the first, and directions of
        the first perpendicular to some of the second."""
        near, far = (self.carriers[link] for link in joint.links)
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


def _steps(mechanism: Mechanism, joint: Joint, near: str) -> list[tuple[str, bool, Array]]:
    """The single joints of a joint from its near link on: name, whether it slides, axis at zero."""
    R = mechanism.links[joint.predecessor].pose[:3, :3]
    single = [(kind is JointType.PRISMATIC, R @ axis)
              for kind, axis in parts(joint.type, [R.T @ axis for axis in joint.axes])]
    found = [(name, slides, _sharpened(axis)) for name, (slides, axis) in
             zip(part_names(joint.name, len(single)), single, strict=True)]
    return found if near == joint.predecessor else [(name, slides, -axis) for name, slides, axis in reversed(found)]


def _sharpened(directions: Array) -> Array:
    """Directions whose components that are zero but for rounding are zero."""
    return np.where(np.abs(directions) < ROUNDED_AXIS, 0.0, np.asarray(directions, dtype=float))
