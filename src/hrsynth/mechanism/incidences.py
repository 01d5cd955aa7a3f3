"""Incidences of a mechanism: special relations of its geometry that persist in motion, as its architecture prescribes.

Instantaneous kinematics depends on joint centres, joint axes and observed directions alone. An incidence between them
is proposed if it holds at every given configuration (docs/pages/proofs.md, section 12), not at one of them by accident.
:mod:`.structural_incidences` and :mod:`hrsynth.analysis.loop_invariants` decide which of them follow from the file. All
are of two kinds, so that geometry can be sampled in linear steps: a direction is normal to earlier ones, or in the
plane of two earlier ones; a sum of centres ±P_j is zero, parallel to a direction, or normal to one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..geometry import lines
from ..geometry.incidences import Incidence, Sieve, find_incidences, list_choices
from ..geometry.vectors import Array, cross, dot, invert_pose, normalise_vector, transform, triple
from ..tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL, RANK_GAP_MIN
from . import graphs
from .model import Joint, JointType, Mechanism
from .observations.direction import SeenAxis

DRAWING_PLANE_SINE_TOL = 1e-4
"""Sine of the angle between two planes below which they count as one when directions are put in order for drawing."""

AXIAL = (JointType.REVOLUTE, JointType.CYLINDRICAL)
"""Joints whose centre may move along their axis without consequence."""
CENTRED = (*AXIAL, JointType.UNIVERSAL, JointType.SPHERICAL)
"""Joints whose centre matters; that of a P or E may be anywhere."""


@dataclass(frozen=True)
class DirectionSource:
    """Source of an observed direction: a ``class`` of directions; ``between`` two centres; the ``foot``: between two
    centres, normal to a class; the common ``normal`` of two classes."""

    kind: Literal["class", "between", "foot", "normal"]
    points: tuple[int, ...] = ()
    classes: tuple[int, ...] = ()


@dataclass(frozen=True)
class Incidences:
    """Directions in classes of parallels, centres, and their incidences."""

    axes: Mapping[str, tuple[int, ...]]
    """Class of each axis of each joint."""
    tower: tuple[tuple[tuple[int, ...], ...], ...]
    """Incidence of each class: normal to an earlier class (a,), in the plane of two earlier ones (a, b)."""
    centres: Mapping[str, int]
    """Number of each joint's centre, if it matters."""
    point: int | None
    """Number of the platform's point, for a point body."""
    count: int
    """Number of all centres: of joints, of points where axes meet, the platform's point."""
    incidences: tuple[Incidence, ...]
    sights: tuple[DirectionSource, ...]
    """Source of each observation's direction."""
    hosts: tuple[str, ...]
    """Link in which each centre is fixed (that of a C: its predecessor)."""
    fixed: tuple[tuple[str, ...], ...]
    """Link in which each direction of each class is fixed, joint by joint, observed ones last."""
    watched: tuple[str, ...]
    """Link of each observation."""
    directions: Array = field(compare=False)
    """Direction of each class at each configuration (classes, configurations, 3)."""
    doubt: str = ""
    """Reason why the incidences are not reliable; empty if they are."""
    held: float = 0.0
    """Largest defect (sines, characteristic lengths) of an incidence that holds."""
    missed: float = float("inf")
    """Smallest defect of one that does not, if it is at most ``RANK_GAP_MIN`` tolerances."""

    def members(self, number: int) -> str:
        """Return the joints with an axis in a class as a text."""
        joints = [name for name, classes in self.axes.items() if number in classes]
        return "axes of " + ", ".join(joints) if joints else "an observed direction"


def recognise(
    mechanism: Mechanism,
    poses: Mapping[str, Array],
    observations: Sequence[SeenAxis] = (),
    point: Array | None = None,
    points: Sequence[tuple[str, Sequence[float]]] = (),
) -> Incidences:
    """Return the incidences that hold at all configurations; ``poses`` are X_BL (configurations, 4, 4) of every link.

    ``point`` is the platform's point in the platform's frame, for a point body; ``points`` are further ones, with their
    links, in whose frames they are: they are the last centres.
    """
    drawn, sieve = _SampledGeometry(mechanism, poses, point), Sieve()
    for link, at in points:
        drawn.add_point(link, np.asarray(at))
    classes, members = _group_parallels(sieve, np.array(drawn.directions).reshape(-1, drawn.size, 3))
    axes = {name: tuple(members[i] for i in numbers) for name, numbers in drawn.axes.items()}
    centres = np.array(drawn.points).reshape(len(drawn.points), drawn.size, 3) / mechanism.length
    further = len(points)
    fixed: list[list[str]] = [[] for _ in classes]
    for name, numbers in axes.items():
        for number, link in zip(numbers, mechanism.joints[name].links, strict=False):
            fixed[number].append(link)
    for link, normal in drawn.planes():
        if not any(np.max(np.abs(cross(normal, each))) < DIRECTION_SINE_TOL for each in classes):
            classes = np.concatenate([classes, normal[None]])
            fixed.append([link])
    sights: list[DirectionSource] = []
    for observation in observations:
        u = drawn.turned(observation)
        own = [i for i, links in enumerate(drawn.hosts) if observation.link in links]
        near = sorted({c for joint in mechanism.joints_of(observation.link) for c in axes[joint.name]})
        sight = _find_direction_source(u, classes, centres, own, near)
        if sight is None:
            sight = DirectionSource("class", classes=(len(classes),))
            classes = np.concatenate([classes, u[None]])
            fixed.append([])
        if sight.kind == "class":
            fixed[sight.classes[0]].append(observation.link)
        sights.append(sight)
    tower, place = _order_classes(sieve, classes)
    owns = [set(axes[name]) for name in drawn.centres]
    slides = [
        own if mechanism.joints[name].type in AXIAL else set() for name, own in zip(drawn.centres, owns, strict=True)
    ]
    bare = [set[int]()] * (len(centres) - len(owns))
    found = find_incidences(sieve, classes, centres, drawn.together(), owns + bare, slides + bare)
    order = sorted(place, key=place.__getitem__)

    def placed(numbers: Iterable[int]) -> tuple[int, ...]:
        return tuple(place[i] for i in numbers)

    return Incidences(
        {name: placed(numbers) for name, numbers in axes.items()},
        tower,
        drawn.centres,
        None if point is None else len(centres) - 1 - further,
        len(centres),
        tuple(replace(each, classes=placed(each.classes)) for each in found),
        tuple(replace(each, classes=placed(each.classes)) for each in sights),
        tuple(drawn.carriers),
        tuple(tuple(fixed[i]) for i in order),
        tuple(o.link for o in observations),
        classes[order],
        _explain_doubt(sieve),
        sieve.accepted,
        sieve.rejected,
    )


def _explain_doubt(sieve: Sieve) -> str:
    """Return the reason why the result is not reliable (docs/pages/proofs.md, section 12)."""
    if sieve.mixed is not None:
        return (
            "the samples are of several operation modes: an incidence of its geometry holds at zero and at "
            "{} of {} of them".format(*sieve.mixed)
        )
    if sieve.rejected < RANK_GAP_MIN * sieve.accepted:
        return (
            f"its geometry is nearly special: an incidence that holds has a defect of {sieve.accepted:.1e}, one "
            f"that does not of {sieve.rejected:.1e}, needed: {RANK_GAP_MIN:.0e} times as much"
        )
    return ""


class _SampledGeometry:
    """Directions and centres of a mechanism at all configurations."""

    def __init__(self, mechanism: Mechanism, poses: Mapping[str, Array], point: Array | None) -> None:
        self.mechanism = mechanism
        moved = {name: poses[name] @ invert_pose(link.pose) for name, link in mechanism.links.items()}
        self.turns = {name: X[:, :3, :3] for name, X in moved.items()}
        self.shifts = {name: X[:, :3, 3] for name, X in moved.items()}
        self.size = len(next(iter(poses.values())))
        self.directions: list[Array] = []
        self.axes: dict[str, list[int]] = {}
        self.points: list[Array] = []
        self.centres: dict[str, int] = {}
        self.hosts: list[tuple[str, ...]] = []
        self.carriers: list[str] = []
        for joint in mechanism.joints.values():
            self._add(joint)
        for link, centre in self._meetings():
            self.points.append(centre)
            self.hosts.append(())
            self.carriers.append(link)
        if point is not None:
            self.add_point(mechanism.platform, point)

    def add_point(self, link: str, place: Array) -> None:
        """Add a further point, in the frame of its link."""
        self.points.append(self._at(link, transform(self.mechanism.links[link].pose, place)))
        self.hosts.append((link,))
        self.carriers.append(link)

    def _add(self, joint: Joint) -> None:
        self.axes[joint.name] = []
        for axis, link in zip(joint.axes, joint.links, strict=False):
            self.axes[joint.name].append(len(self.directions))
            self.directions.append(self.turns[link] @ axis)
        if joint.type in CENTRED:
            self.centres[joint.name] = len(self.points)
            self.points.append(self._at(joint.predecessor, joint.point))
            self.hosts.append(joint.links)
            self.carriers.append(joint.predecessor)

    def _meetings(self) -> list[tuple[str, Array]]:
        """Return points (configurations, 3) at which the axes of three or more R or C meet, and the link of two of
        them."""
        mechanism, near = self.mechanism, POINT_DISTANCE_TOL * self.mechanism.length
        turning = [joint for joint in mechanism.joints.values() if joint.type in AXIAL]

        def on_axis(point: Array, joint: Joint) -> bool:
            arm, axis = point - self.points[self.centres[joint.name]], self.directions[self.axes[joint.name][0]]
            return bool(np.max(np.abs(cross(arm, axis))) < near)

        found: list[tuple[str, Array]] = []
        for a, b in combinations(turning, 2):
            centre = lines.find_meeting_point([(a.point, a.axis), (b.point, b.axis)], near)
            for link in sorted({*a.links} & {*b.links}) if centre is not None else ():
                moved = self._at(link, np.asarray(centre))
                known = any(np.max(np.abs(moved - other)) < near for _, other in found)
                if not known and sum(on_axis(moved, joint) for joint in turning) > 2:
                    found.append((link, moved))
        return found

    def turned(self, observation: SeenAxis) -> Array:
        """Return the observed direction in base axes (configurations, 3)."""
        link = self.mechanism.links[observation.link]
        return np.asarray(self.turns[link.name] @ link.pose[:3, :3] @ observation.direction)

    def _at(self, link: str, point: Array) -> Array:
        return np.asarray(self.turns[link] @ point + self.shifts[link])

    @cached_property
    def sliding(self) -> list[set[str]]:
        """Return the sets of links that only translate relative to each other."""
        return list(
            graphs.list_components(
                graphs.build_adjacency(
                    self.mechanism.links,
                    (joint.links for joint in self.mechanism.joints.values() if joint.type is JointType.PRISMATIC),
                )
            )
        )

    def planes(self) -> Iterator[tuple[str, Array]]:
        """Yield a link, and the normal (configurations, 3), of each plane in which links translate relative to each
        other: a direction of its own, to which differences of their points are normal."""
        for body in self.sliding:
            slides = [
                self.directions[self.axes[joint.name][0]]
                for joint in self.mechanism.joints.values()
                if joint.type is JointType.PRISMATIC and joint.predecessor in body
            ]
            for u in slides[1:]:
                normal = cross(slides[0], u)
                size = np.linalg.norm(normal, axis=1, keepdims=True)
                if np.min(size) > DRAWING_PLANE_SINE_TOL:
                    normal = normal / size
                    if all(np.max(np.abs(dot(normal, each))) < DIRECTION_SINE_TOL for each in slides):
                        yield next(link for link in self.mechanism.links if link in body), normal
                    break

    def together(self) -> NDArray[np.bool_]:
        """Return which centres lie on one link, or on links that only translate relative to each other (n, n)."""
        bodies = self.sliding
        on = np.array([[not body.isdisjoint(links) for body in bodies] for links in self.hosts], dtype=bool)
        return np.asarray(on @ on.T) if len(on) else np.zeros((0, 0), dtype=bool)


def _group_parallels(sieve: Sieve, D: Array) -> tuple[Array, list[int]]:
    """Return one direction of each class of parallels (classes, configurations, 3), and the class of each direction."""
    pairs = sieve.keep(list_choices(len(D), 2), lambda c, s: cross(D[c[:, 0], s], D[c[:, 1], s]), DIRECTION_SINE_TOL)
    first = list(range(len(D)))
    for a, b in pairs.tolist():
        first[b] = min(first[b], first[a])
    leaders = sorted(set(first))
    return D[leaders], [leaders.index(i) for i in first]


def _order_classes(sieve: Sieve, classes: Array) -> tuple[tuple[tuple[tuple[int, ...], ...], ...], dict[int, int]]:
    """Return the incidence of each class with earlier ones, in an order in which each has a choice, and its place in
    it.

    The last is the one that lies in the fewest different planes, and so on with the others.
    """
    n = len(classes)
    normal = sieve.keep(
        list_choices(n, 2), lambda c, s: dot(classes[c[:, 0], s], classes[c[:, 1], s]), DIRECTION_SINE_TOL
    )
    planar = sieve.keep(
        list_choices(n, 3), lambda c, s: triple(*(classes[c[:, i], s] for i in range(3))), DIRECTION_SINE_TOL
    )
    obeyed: list[list[tuple[frozenset[int], int]]] = [[] for _ in range(n)]
    planes: list[list[Array]] = [[] for _ in range(n)]
    for related in (frozenset(each) for each in normal.tolist() + planar.tolist()):
        for c in related:
            obeyed[c].append(
                (related - {c}, _identify_normal(_compute_normal(related - {c}, classes[:, -1]), planes[c]))
            )
    left, reverse = set(range(n)), list[int]()
    while left:
        last = min(sorted(left, reverse=True), key=lambda c: len({plane for by, plane in obeyed[c] if by <= left}))
        left.remove(last)
        reverse.append(last)
        obeyed[last] = [each for each in obeyed[last] if each[0] <= left]
    place = {c: i for i, c in enumerate(reversed(reverse))}
    return tuple(tuple(tuple(sorted(place[c] for c in by)) for by, _ in obeyed[k]) for k in place), place


def _compute_normal(classes: frozenset[int], directions: Array) -> Array:
    """Return the normal of one or two classes."""
    first, *rest = (directions[c] for c in sorted(classes))
    return normalise_vector(cross(first, rest[0])) if rest else first


def _identify_normal(normal: Array, known: list[Array]) -> int:
    """Return the index of a normal among known ones, to which a new one is added."""
    for number, other in enumerate(known):
        if np.linalg.norm(cross(normal, other)) < DRAWING_PLANE_SINE_TOL:
            return number
    known.append(normal)
    return len(known) - 1


def _find_direction_source(
    u: Array, classes: Array, points: Array, own: Sequence[int], near: Sequence[int]
) -> DirectionSource | None:
    """Return the source of the observed direction (configurations, 3) among the directions of its link."""

    def along(vectors: Array) -> bool:
        sizes = np.linalg.norm(vectors, axis=1)
        return bool(
            np.min(sizes) > POINT_DISTANCE_TOL
            and np.max(np.linalg.norm(cross(vectors, u), axis=1) / sizes) < DIRECTION_SINE_TOL
        )

    for c, direction in enumerate(classes):
        if along(direction):
            return DirectionSource("class", classes=(c,))
    for j, k in combinations(own, 2):
        between = points[k] - points[j]
        if along(between):
            return DirectionSource("between", (j, k))
        for c in near:
            if along(between - classes[c] * np.sum(between * classes[c], axis=1, keepdims=True)):
                return DirectionSource("foot", (j, k), (c,))
    for a, b in combinations(near, 2):
        if along(cross(classes[a], classes[b])):
            return DirectionSource("normal", classes=(a, b))
    return None
