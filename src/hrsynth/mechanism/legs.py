"""Legs and platform, identified by structure, never by names.

The platform is the smallest set of links around the platform link that leaves the greatest number of legs, each
connected to the base and to one link of the platform (an articulated platform has several links). A link whose segment
the file observes is part of a leg: it is in the platform only if it is the platform link. In a single loop in which one
chain has one dof more than the other, the platform link is the last segment of the shorter one: the legs share the end
joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise

from ..errors import BadMechanism, BadRequest, BadRobotFile, Defect
from ..geometry import lines
from ..geometry.vectors import Array
from ..results import Value, with_value
from ..tolerances import POINT_DISTANCE_TOL
from . import graphs
from .composites import WordEdge, WordGraph
from .model import Joint, JointType, Mechanism
from .notation import Architecture, Bar, Carrier, Letter, Word
from .observations.direction import Direction


@dataclass(frozen=True)
class Leg:
    """Leg: its label, its links (base and platform excluded), its joints, the platform link it ends on.

    ``takes_platform``: the platform link itself is its last segment; its end joint is then not among its joints.
    """

    label: str
    links: tuple[str, ...]
    joints: tuple[str, ...]
    platform_link: str
    takes_platform: bool = False

    @property
    def has_loops(self) -> bool:
        """The leg is not a chain of joints: it contains loops."""
        return len(self.joints) > len(self.links) + 1

    def loop_joints(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return its joints in loops inside it, all other links taken as two: the base and the platform."""
        if not self.has_loops:
            return ()
        own = {*self.links, mechanism.base}
        pairs = [
            (one if one in own else self.platform_link, other if other in own else self.platform_link)
            for one, other in (mechanism.joints[name].links for name in self.joints)
        ]
        return tuple(name for k, name in enumerate(self.joints) if not graphs.is_bridge(pairs, k))


@dataclass(frozen=True, eq=False, repr=False)
class LegDecomposition(Value):
    """Decomposition of a mechanism: platform links and legs, in the order of the mechanism's links."""

    mechanism: Mechanism
    platform: tuple[str, ...]
    legs: tuple[Leg, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the legs, in order."""
        return tuple(leg.label for leg in self.legs)

    def leg(self, label: str) -> Leg:
        """Return the leg with this label. Raises ``BadRequest`` with the known labels."""
        for leg in self.legs:
            if leg.label == label:
                return leg
        raise BadRequest(f"{self.mechanism.name}: unknown leg", label, self.labels)

    def leg_of(self, link: str) -> Leg | None:
        """Return the leg with a link, or None."""
        for leg in self.legs:
            if link in leg.links or (leg.takes_platform and link == self.mechanism.platform):
                return leg
        return None

    @cached_property
    def point(self) -> Array | None:
        """Point of the platform if it is a point body (two or more joints, all coaxial R, or one passive S), in the
        platform's frame, (3,); on a common axis the point nearest to the frame's origin. None for any other platform: a
        tool on a single R rotates, and its rotation counts, unless the robot excludes it."""
        joints = self.mechanism.joints_of(self.mechanism.platform)
        frame = self.mechanism.links[self.mechanism.platform].pose
        first = joints[0]
        tolerance, turns = POINT_DISTANCE_TOL * self.mechanism.length, self.mechanism.turns
        if turns or (turns is None and len(joints) == 1 and (first.type is JointType.REVOLUTE or first.is_actuated)):
            return None
        if len(joints) == 1 and first.type is JointType.SPHERICAL:
            centre = first.point
        elif all(
            j.type is JointType.REVOLUTE
            and lines.is_parallel(j.axis, first.axis)
            and lines.measure_line_distance(j.point, first.point, first.axis) <= tolerance
            for j in joints
        ):
            centre = lines.project_to_line(frame[:3, 3], first.point, first.axis)
        else:
            return None
        return frame[:3, :3].T @ (centre - frame[:3, 3])

    @cached_property
    def is_platform_decided(self) -> bool:
        """The links on which legs end determine the pose of the platform link: it is one of them, or carried by such
        links with two joints R or P, neither coaxial nor along one direction. Other joints may leave several poses."""
        mechanism = self.mechanism
        known, waiting = {mechanism.base, *(leg.platform_link for leg in self.legs)}, set[str]()
        while waiting != (waiting := set(self.platform) - known):
            known |= {
                link
                for link in waiting
                if any(
                    self._is_held_by(one, other)
                    for one, other in combinations(mechanism.joints_of(link), 2)
                    if {one.other(link), other.other(link)} <= known
                )
            }
        return mechanism.platform in known

    def _is_held_by(self, one: Joint, other: Joint) -> bool:
        """Return True if two joints with fixed links leave a link one pose."""
        if not {one.type, other.type} <= {JointType.REVOLUTE, JointType.PRISMATIC}:
            return False
        if one.type is not other.type or not lines.is_parallel(one.axis, other.axis):
            return True
        apart = lines.measure_line_distance(other.point, one.point, one.axis)
        return one.type is JointType.REVOLUTE and apart > POINT_DISTANCE_TOL * self.mechanism.length

    def is_free_body(self, leg: Leg) -> bool:
        """Return True if a leg is only the free joint of a body without other joints."""
        return not leg.links and any(
            self.mechanism.joints[name].type is JointType.FREE for name in leg.joints if name in self.mechanism.joints
        )

    def word(self, leg: Leg) -> Word:
        """Return the leg's architecture notation, from the base to the platform (without the end joint if it takes the
        platform).

        A virtual chain from a camera on another leg is written as if it began at the base.
        """
        mechanism = self.mechanism
        if self.is_free_body(leg):
            return Word((Letter(JointType.FREE.value),))
        links = {mechanism.base, leg.platform_link, *leg.links}
        kept = {mechanism.base, leg.platform_link}
        if mechanism.reference not in links:
            hung = [
                j.relinked(mechanism.reference, mechanism.base)
                for j in mechanism.joints_of(mechanism.reference)
                if j.name in leg.joints
            ]
            mechanism = mechanism.changed(joints=hung)
        graph = WordGraph(mechanism, kept, links)
        graph.keep(leg.joints)
        graph.reduce()
        edges = [edge for _, edge in graph.between(mechanism.base, leg.platform_link)]
        if len(graph) == 2 and len(edges) == 1:
            return edges[0].word_from(mechanism.base)
        return _describe_paths(graph, mechanism.base, leg.platform_link)

    def architecture(self) -> Architecture:
        """Sum of the legs' notations; a single loop whose legs share their end joint is one term."""
        if len(self.legs) == 2:
            loop = self._loop_word(*self.legs)
            if loop is not None:
                return Architecture.of([loop])
        return Architecture.of([self.word(leg) for leg in self.legs])

    def _loop_word(self, one: Leg, two: Leg) -> Word | None:
        if one.takes_platform or two.takes_platform:
            return self.word(one) + self.word(two).reversed()
        if self.point is not None and one.platform_link == two.platform_link == self.mechanism.platform:
            first, second = self.word(one), self.word(two)
            if first.items[-1] == second.items[-1] == Letter("R"):
                return first + Word(second.items[:-1]).reversed()
        return None

    def path(self, leg: Leg) -> list[WordEdge]:
        """Return the shortest chain of edges from the base to the leg's end, composites contracted."""
        mechanism = self.mechanism
        graph = WordGraph(
            mechanism, {mechanism.base, leg.platform_link}, {mechanism.base, leg.platform_link, *leg.links}
        )
        graph.recognise()
        graph.keep(leg.joints)
        nodes = graphs.find_shortest_path(graph.adjacency(), mechanism.base, leg.platform_link)
        return [graph.between(a, b)[0][1] for a, b in pairwise(nodes)]


def _describe_paths(graph: WordGraph, start: str, end: str) -> Word:
    """Return the notation of a graph that neither series nor parallel reduces: its simple paths side by side."""
    words = []
    for path in graphs.list_paths(graph.adjacency(), start, end):
        word = Word(())
        for here, there in pairwise(path):
            word += graph.between(here, there)[0][1].word_from(here)
        words.append(word)
    branches = tuple(dict.fromkeys(words))
    return Word((Bar(branches),)) if len(branches) > 1 else branches[0]


@with_value
def decompose(mechanism: Mechanism) -> LegDecomposition:
    """Return platform and legs of a mechanism in normal form. Raises ``BadMechanism`` if there is no leg,
    ``BadRobotFile`` if the observations contradict the legs."""
    graph = WordGraph(mechanism, {mechanism.base, mechanism.platform}).recognise().recognise_carriers().adjacency()
    platform = _find_platform(mechanism, graph)
    order = {name: i for i, name in enumerate(mechanism.links)}
    legs: list[Leg] = []
    for part, joints, end in _split_parts(mechanism, platform):
        if end is not None:
            legs.append(Leg("", tuple(sorted(part, key=order.__getitem__)), tuple(j.name for j in joints), end))
    live = _list_live_joints(mechanism)
    for joint in live:
        if mechanism.base in joint.links and joint.other(mechanism.base) in platform:
            legs.append(Leg("", (), (joint.name,), joint.other(mechanism.base)))
    floating = [j for j in mechanism.joints.values() if j.type is JointType.FREE and mechanism.base in j.links]
    for joint in floating if not legs else ():
        if joint.other(mechanism.base) in platform:
            legs.append(Leg("", (), (joint.name,), joint.other(mechanism.base)))
    if not legs:
        raise BadMechanism(
            f"{mechanism.name}: no leg connects the base {mechanism.base!r} and the platform",
            mechanism.platform,
            "a platform with at least one leg",
        )
    legs = _choose_segment_platform(mechanism, platform, legs)
    joint_order = {name: i for i, name in enumerate(mechanism.joints)}
    legs.sort(
        key=lambda leg: (order[leg.links[0]] if leg.links else order[leg.platform_link], joint_order[leg.joints[0]])
    )
    return _label_legs(LegDecomposition(mechanism, tuple(sorted(platform, key=order.__getitem__)), tuple(legs)))


def _list_live_joints(mechanism: Mechanism) -> list[Joint]:
    """Return the joints except those of free bodies."""
    return [j for j in mechanism.joints.values() if j.type is not JointType.FREE]


def _split_parts(mechanism: Mechanism, platform: set[str]) -> list[tuple[set[str], list[Joint], str | None]]:
    """Yield the parts without base and platform: links, joints, and, for a leg (connected to the base and to one link
    of the platform), its platform link."""
    moving = {name for name in mechanism.links if name != mechanism.base and name not in platform}
    live, found = _list_live_joints(mechanism), []
    joined = graphs.build_adjacency(
        (name for name in mechanism.links if name in moving), (j.links for j in live if moving.issuperset(j.links))
    )
    for part in graphs.list_components(joined):
        joints = [j for j in live if part & set(j.links)]
        ends = {j.other(link) for j in joints for link in j.links if link in part} - part
        leg = mechanism.base in ends and len(ends) == 2
        found.append((part, joints, next(iter(ends - {mechanism.base})) if leg else None))
    return found


def _find_platform(mechanism: Mechanism, graph: graphs.Adjacency) -> set[str]:
    """Return the smallest set around the platform link that leaves the most legs (articulated platforms)."""
    base, root = mechanism.base, mechanism.platform
    if base not in graph or root not in graph:
        return {root}
    rest = {node: [other for other in graph[node] if other != base] for node in graph if node != base}
    contacts = set(graph[base])
    order = {name: i for i, name in enumerate(mechanism.links)}
    distance = graphs.count_edges(rest, root)
    reachable = set(distance)
    branching = sorted(
        (n for n in reachable - {root} if len(rest[n]) >= 3 and n not in contacts),
        key=lambda n: (distance[n], order[n]),
    )[:12]
    watched = {observation.link for observation in mechanism.observations if observation.is_segment_direction} - {
        base,
        root,
    }

    def legs_of(members: set[str]) -> int:
        count = sum(1 for part in graph[base] if part in members)
        for part in graphs.list_components(rest, set(rest) - members):
            if not part & contacts:
                continue
            ends = {n for link in part for n in rest[link] if n in members}
            if len(ends) > 1:
                return 0
            count += len(ends)
        return count

    best, score = {root}, legs_of({root})
    for size in range(1, min(4, len(branching)) + 1):
        for chosen in combinations(branching, size):
            members = {root, *chosen}
            members |= {
                n for n in reachable - members - contacts if len(rest[n]) == 2 and all(m in members for m in rest[n])
            }
            if graphs.find_component(rest, root, members) != members or (found := legs_of(members)) <= score:
                continue
            if watched <= {
                link for part, _, end in _split_parts(mechanism, members) if end is not None for link in part
            }:
                best, score = members, found
    return best


def _choose_segment_platform(mechanism: Mechanism, platform: set[str], legs: list[Leg]) -> list[Leg]:
    """Move the platform to the last segment of the shorter leg, in a single loop with one dof more on one side."""
    if len(platform) != 1 or len(legs) != 2 or len(mechanism.joints_of(mechanism.platform)) != 2:
        return legs
    decomposition = LegDecomposition(mechanism, tuple(platform), tuple(legs))
    one, two = (_count_dof(decomposition.word(leg)) for leg in legs)
    if one is None or two is None or abs(one - two) != 1:
        return legs
    short, long = (0, 1) if one < two else (1, 0)
    end = next(name for name in legs[long].joints if mechanism.platform in mechanism.joints[name].links)
    if mechanism.joints[end].type is not JointType.REVOLUTE:
        return legs
    result = list(legs)
    result[short] = replace(legs[short], takes_platform=True)
    return result


def _count_dof(word: Word) -> int | None:
    """Return the dof of joints in series (a Π has one, a carrier those of its chain), or None for rods side by side."""
    total = 0
    for item in word.items:
        if isinstance(item, Letter):
            total += 1 if item.letter == "Pi" else JointType(item.letter).freedoms
        elif isinstance(item, Carrier) and (inner := _count_dof(item.chain)) is not None:
            total += inner
        else:
            return None
    return total


def _label_legs(decomposition: LegDecomposition) -> LegDecomposition:
    """Label the legs by their observations, otherwise by numbers."""
    given: dict[int, str] = {}
    watched: dict[str, Array] = {}
    defects: list[Defect] = []
    mechanism = decomposition.mechanism
    links = ", ".join(n for leg in decomposition.legs for n in leg.links) or "none"
    file = mechanism.file or mechanism.name
    for observation in (o for o in mechanism.observations if o.is_segment_direction):
        line = getattr(observation, "line", None)
        index = next(
            (i for i, leg in enumerate(decomposition.legs) if decomposition.leg_of(observation.link) == leg), None
        )
        if index is None:
            defects.append(
                Defect(
                    file,
                    line,
                    "observe: link not in a leg",
                    observation.link,
                    f'{links}; others as <observe kind="direction">',
                )
            )
        elif given.setdefault(index, observation.leg) != observation.leg:
            defects.append(
                Defect(
                    file,
                    line,
                    f"link {observation.link!r} is in the leg labelled {given[index]!r}; its label",
                    observation.leg,
                    given[index],
                )
            )
        elif any(label == observation.leg and i != index for i, label in given.items()):
            defects.append(
                Defect(
                    file,
                    line,
                    "label used for links of two legs",
                    observation.leg,
                    "one label per leg",
                )
            )
        elif isinstance(observation, Direction) and not lines.is_parallel(
            watched.setdefault(observation.link, observation.direction), observation.direction
        ):
            defects.append(
                Defect(
                    file,
                    line,
                    "second direction of a link",
                    observation.link,
                    'one per link; others as <observe kind="direction">',
                )
            )
    if defects:
        raise BadRobotFile(defects)
    numbers = [str(i + 1) for i in range(len(decomposition.legs))]
    free = [n for n in numbers if n not in given.values()]
    labels: list[str] = []
    for i, number in enumerate(numbers):
        if i in given:
            labels.append(given[i])
        elif number in free:
            free.remove(number)
            labels.append(number)
        else:
            labels.append(free.pop(0))
    return replace(
        decomposition,
        legs=tuple(replace(leg, label=label) for leg, label in zip(decomposition.legs, labels, strict=True)),
    )
