"""What a file leaves open, guessed where it hints at one choice only: the base and the platform, by structure, then by
names of feet and tools. A sensor is never the platform, nor a rod that a name or two ball joints tell."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from ...budgets import LARGEST_GUESSED
from ...errors import BadRequest
from ...geometry.vectors import Array, inverse
from ...mechanism import graphs
from ...mechanism.model import JointType, PlatformChoice
from ...tolerances import SAME_DIRECTION, SAME_POINT
from ..jointgraph import JointGraph, JointSpec, first_body

_WORD = re.compile("[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_END = re.compile("(.*(foot|hand|flange|gripper|effector|platform))|feet|toe|sole|tool|tcp|eef?")
"""Words in the names of links that end a robot: feet, tools."""
_SENSOR = re.compile("imu|gyro(scope)?|accelerometer|magnetometer|.*camera|lidar|laser|.*sensor|gps|rgbd?|microphone")
_ROD = re.compile(".*rod|strut")
_DRIVE = re.compile(".*rod|strut|crank|motor|actuator|rotor|reference")
"""Words in the names of what moves a foot or tool."""
_PLATE = re.compile("plat", re.IGNORECASE)


def base(graph: JointGraph) -> str:
    """The link that no joint carries, or the first of them in the file."""
    carried = {joint.links[1] for joint in graph.joints.values() if joint.in_tree}
    free = [link for link in graph.links if link not in carried] or list(graph.links)
    if len(free) > 1:
        graph.note(
            "guess",
            f"the base is link {free[0]!r}, the first of {len(free)} that no joint carries (--base LINK to change it)",
            base=True,
        )
    return free[0]


def standing(graph: JointGraph, base: str, wanted: str | None, platform: str | None = None) -> str:
    """The link from which a robot is read: its base; where the ``wanted`` one hangs on something else, the root of
    that; of a robot that only a free joint holds (``<freejoint>``), or three slides and three turns that place it, the
    link that floats; where all hangs on one slide and the loops begin at what slides, that link: a rail is no leg.
    ``platform`` is the one that is given."""
    bonds = graphs.adjacency(graph.links, (joint.links for joint in graph.joints.values()))
    if wanted is not None and wanted in graph.links and wanted not in graphs.component(bonds, base):
        base = wanted
        carriers = {joint.links[1]: joint.links[0] for joint in graph.joints.values() if joint.in_tree}
        for _ in carriers:
            base = carriers.get(base, base)
    if wanted != base:
        base = _without_float(graph, base, {wanted, platform})
    loops = not all(joint.in_tree for joint in graph.joints.values())
    while wanted != base:
        held = [joint for joint in graph.joints.values() if base in joint.links]
        if len(held) != 1:
            break
        (bearer,) = held
        trunk = next(link for link in bearer.links if link != base)
        if bearer.type is JointType.FREE and (loops or (platform != trunk and _moving(graph, trunk) > 2)):
            how = f"floats on the free joint {bearer.name!r}: it is the base, and what it floats in is left out"
        elif loops and bearer.type is JointType.PRISMATIC and _is_rail(graph, bearer, trunk, platform):
            how = (
                f"slides on the rail {bearer.name!r}: it is the base, and what it slides on is left out "
                f"(--base {base} to keep it)"
            )
        else:
            break
        graph.note("guess", f"{trunk!r} {how}", base=True)
        del graph.joints[bearer.name], graph.links[base]
        base = trunk
    return base


def _without_float(graph: JointGraph, base: str, named: set[str | None]) -> str:
    """The link that floats on three slides and three turns about one point, where several joints hang on it and nothing
    drives or names what is in between, which is then left out; else ``base``."""
    chain, link, X = list[JointSpec](), base, np.eye(4)
    kinds, axes, centres = "", list[Array](), list[Array]()
    while len(kinds) < 6:
        more = [joint for joint in graph.joints.values() if link in joint.links and joint not in chain]
        if len(more) != 1 or more[0].links[0] != link:
            return base
        (joint,) = more
        X = X @ joint.ends[0].X
        if joint.kind is not JointType.FIXED:
            kinds += str(joint.kind)
            axes += [X[:3, :3] @ axis for axis in joint.axes]
            centres += [X[:3, 3]] * (joint.kind is JointType.REVOLUTE)
        X, link = X @ inverse(joint.ends[1].X), joint.links[1]
        chain.append(joint)
    left = {each.links[0] for each in chain}
    slides, turns = ([axis for axis, kind in zip(axes, kinds, strict=False) if kind == each] for each in "PR")
    geared = {name for gear in graph.gears for name in (gear.driver, gear.driven)}
    if (
        sorted(kinds) != list("PPPRRR")
        or _moving(graph, link) < 3
        or graph.platform in left
        or named & left
        or any(each.motor is not None or each.name in geared for each in chain)
    ):
        return base
    ranks = [np.linalg.matrix_rank(np.array(each), SAME_DIRECTION) for each in (slides, turns)]
    if ranks != [3, 3] or np.max(np.abs(np.array(centres) - centres[0])) > SAME_POINT:
        return base
    names = ", ".join(each.name for each in chain)
    graph.note(
        "guess",
        f"{link!r} floats on the joints {names}, which place it: it is the base, and what it floats in "
        f"is left out (--base {base} to keep it)",
        base=True,
    )
    for each in chain:
        del graph.joints[each.name], graph.links[each.links[0]]
    return link


def _moving(graph: JointGraph, link: str) -> int:
    """How many joints of a link are not fixed."""
    return sum(link in joint.links and joint.kind is not JointType.FIXED for joint in graph.joints.values())


def _is_rail(graph: JointGraph, slide: JointSpec, trunk: str, platform: str | None) -> bool:
    """Whether the loops begin at what slides, or at what slides on that; a file that names its platform, and gears, are
    taken at their word."""
    if graph.platform is not None or platform == trunk or any(slide.name in (g.driver, g.driven) for g in graph.gears):
        return False
    import networkx as nx

    on = [joint for joint in graph.joints.values() if trunk in joint.links and joint is not slide]
    if len(on) == 1 and on[0].type is JointType.PRISMATIC:
        return _is_rail(graph, on[0], next(link for link in on[0].links if link != trunk), platform)
    bodies = _RigidBodies(graph, trunk)
    rest: nx.Graph[str] = nx.Graph((a, b) for a, ends in bodies.near.items() for b in ends)
    loops: list[set[str]] = list(map(set, nx.biconnected_components(rest)))  # type: ignore[arg-type]
    return any(bodies.base in loop for loop in loops if len(loop) > 2)


def formation(graph: JointGraph, base: str) -> str | None:
    """The first body of a formation, None where it is none, which the graph is told."""
    told = [*(each.link for each in graph.sights), *(each.link for each in graph.cameras)]
    found, _ = first_body(graph.links, (joint.links for joint in graph.joints.values()), base, told)
    graph.formation = found is not None
    return found


def platform(graph: JointGraph, base: str) -> tuple[str, PlatformChoice]:
    """The link that is guessed, and why: the one that most ways connect to the base; else the only one with the name of
    a foot or tool; else the one that several loops close; else the only frame on a fixed joint; else the link farthest
    away. Where several are as good, it stays open: the first of the candidates.

    Raises ``BadRequest`` where no link moves.
    """
    bodies = _RigidBodies(graph, base)
    if len(bodies.members) == 1:
        raise BadRequest(f"{graph.file}: no link moves relative to the base", base, "a joint that is not fixed")
    link, why, rivals = bodies.platform()
    if link is None:
        names = bodies.platform_candidates(rivals)
        chain = "".join(f"; {note.text}" for note in graph.notes if note.kind == "open")
        such = ", ".join(names[:12]) + (" …" if names[12:] else "")
        why = f"the file does not say which link is the platform, and several could be{chain}"
        return names[0], PlatformChoice("open", f"{why}, allowed: --platform LINK, such as {such}")
    graph.note("guess", f"the platform is link {link!r}, {why} (--platform LINK to change it)")
    return link, PlatformChoice("guess", why)


def platforms(graph: JointGraph, base: str) -> tuple[list[str], str]:
    """The link that is guessed and why, or the links among which nothing decides, and no reason."""
    bodies = _RigidBodies(graph, base)
    link, why, rivals = bodies.platform()
    return bodies.platform_candidates(rivals) if link is None else [link], why


def has_word(name: str, words: re.Pattern[str]) -> bool:
    """Whether one of the words of a name is one of ``words``."""
    return any(words.fullmatch(word.casefold()) for word in _WORD.findall(name))


def _ends_robot(name: str) -> bool:
    return has_word(name, _END) and not has_word(name, _SENSOR) and not has_word(name, _DRIVE)


def _common(bodies: list[str], *hints: list[str]) -> list[str]:
    """Those of several bodies that further hints name as well, where one does."""
    for hint in hints:
        bodies = [body for body in bodies if body in hint] or bodies
    return bodies


class _RigidBodies:
    """Links held together by fixed joints are one body, named by its first link."""

    def __init__(self, graph: JointGraph, base: str) -> None:
        joints = list(graph.joints.values())
        bonds = graphs.adjacency(graph.links, (j.links for j in joints if j.type is JointType.FIXED))
        order = {link: i for i, link in enumerate(graph.links)}
        groups = [sorted(group, key=order.__getitem__) for group in graphs.components(bonds)]
        self.members = {group[0]: group for group in groups}
        into = {link: group[0] for group in groups for link in group}
        self.base = into[base]
        pairs = [(into[a], into[b]) for a, b in (joint.links for joint in joints)]
        self.near = graphs.adjacency(self.members, (pair for pair in pairs if pair[0] != pair[1]))
        parts = sum(1 for _ in graphs.components(self.near))
        self.loops = sum(map(len, self.near.values())) > 2 * (len(self.near) - parts)
        self.closing = graph.closing
        self.joints: dict[str, list[JointSpec]] = {link: [] for link in graph.links}
        for joint in joints:
            for link in joint.links:
                self.joints[link].append(joint)

    def platform(self) -> tuple[str | None, str, Sequence[str]]:
        """The platform's link and why, or None and the bodies that could be the platform."""
        moving = [body for body in self.near if body != self.base]
        others = [body for body in moving if not self._is_never(body)] or moving
        framed = [body for body in others if self._frames(body)]
        named = self._named(others)
        if not self.loops:
            rivals = [body for body in others if len(self.near[body]) == 1]
            if len(rivals) == 1:
                return self.title(rivals[0]), "the end of the chain", ()
            closed, why = list[str](), ""
        else:
            found, most = self._most_ways(others, self.base, set(self.near))
            if len(found) == 1:
                floats = sum(
                    joint.type is JointType.FREE for link in self.members[found[0]] for joint in self.joints[link]
                )
                return self.title(found[0]), f"which {most - floats} ways connect to the base", ()
            distance = graphs.distances(self.near, self.base)
            rivals = [body for body in distance if distance[body] == max(distance.values())]
            closed, why = self._closed(others, distance)
        if named and closed and not {*named} & {*closed}:
            return None, "", [*named, *closed]
        if named:
            named = _common(named, closed, framed)
            return (
                (self._end_of(named[0]), "whose name is that of a foot or tool", ())
                if len(named) == 1
                else (None, "", named)
            )
        if closed:
            closed = _common(closed, framed)
            return (self.title(closed[0]), why, ()) if len(closed) == 1 else (None, "", closed)
        if len(framed) == 1:
            return self.title(framed[0]), "the only frame on a fixed joint", ()
        if len(rivals) == 1 and self._is_outermost(rivals[0]) and rivals[0] in others:
            return self.title(rivals[0]), "the farthest from the base", ()
        near = {body for block in self._blocks() for body in block if block & {*rivals}}
        return None, "", rivals if len(rivals) > 1 else [*(body for body in others if body in near), *rivals]

    def platform_candidates(self, rivals: Sequence[str]) -> list[str]:
        """The links that may be the platform where nothing decides: open ends and what ends in a loop beside the
        ``rivals``; those first whose names are those of feet, tools and plates, without sensors and rods."""
        blocks = self._blocks()
        often = Counter(body for block in blocks for body in block)
        last = [block for block in blocks if self.base not in block and sum(often[body] > 1 for body in block) == 1]
        ends = [body for body in self.near if often[body] == 1 and any(body in block for block in last)]
        every = list(dict.fromkeys([*rivals, *ends]))
        found = [body for body in every if not self._is_never(body)]
        names = map(self._end_of, found or every)
        return sorted(names, key=lambda name: (0, len(name)) if _ends_robot(name) or _PLATE.search(name) else (1, 0))

    def title(self, body: str) -> str:
        """The link that stands for a body: its only frame, else the link with most joints."""
        frames = self._frames(body)
        if len(frames) == 1:
            return frames[0]
        return max(self.members[body], key=lambda link: len(self.joints[link]))

    def _named(self, others: Sequence[str]) -> list[str]:
        """The bodies with a name of a foot or tool, beyond which no other one has."""
        named = [body for body in others if any(map(_ends_robot, self.members[body]))]
        return [body for body in named if self._inward(body).issuperset(named)]

    def _inward(self, body: str) -> set[str]:
        """The bodies that ``body`` does not separate from the base, and itself."""
        rest = {one: [two for two in ends if two != body] for one, ends in self.near.items() if one != body}
        return {body, *graphs.component(rest, self.base)}

    def _end_of(self, body: str) -> str:
        """The link of a body that has a name of a foot or tool, where one has; else the one that stands for it."""
        title = self.title(body)
        return min(filter(_ends_robot, self.members[body]), key=lambda link: link != title, default=title)

    def _is_never(self, body: str) -> bool:
        """Whether a body is a sensor, or in a loop a rod: by its name, or as it turns freely about a line of two ball
        joints."""
        name = self.title(body)
        kinds = {joint.type for link in self.members[body] for joint in self.joints[link]} - {JointType.FIXED}
        return has_word(name, _SENSOR) or (
            len(self.near[body]) == 2
            and (
                has_word(name, _ROD)
                or (JointType.SPHERICAL in kinds and kinds <= {JointType.SPHERICAL, JointType.UNIVERSAL})
            )
        )

    def _blocks(self) -> list[set[str]]:
        """The bodies of each loop, of several loops where they share two bodies, and of each bond in no loop; none
        where there are too many bodies."""
        import networkx as nx

        if len(self.near) > LARGEST_GUESSED:
            return []
        graph: nx.Graph[str] = nx.Graph((a, b) for a, ends in self.near.items() for b in ends)
        return list(map(set, nx.biconnected_components(graph)))  # type: ignore[arg-type]

    def _closed(self, others: Sequence[str], distance: Mapping[str, int]) -> tuple[list[str], str]:
        """The bodies that several loops away from the base close, and why the last one could be the platform."""
        found, why = list[str](), ""
        for block in self._blocks():
            root = min(block, key=distance.__getitem__)
            if root != self.base:
                inside = [body for body in others if body in block and body != root]
                bodies, most = self._most_ways(inside, root, block)
                found += bodies
                why = f"which {most} ways connect to {self.title(root)!r}" if bodies else why
        return found, why

    def _is_outermost(self, body: str) -> bool:
        """Whether a body ends a chain, or is in a loop with the base."""
        return len(self.near[body]) == 1 or any({body, self.base} <= block for block in self._blocks())

    def _most_ways(self, others: Sequence[str], root: str, within: set[str]) -> tuple[list[str], int]:
        """The bodies that most ways connect to ``root``, three at least, that share no body; and how many. Not counted
        where there are too many bodies."""
        import networkx as nx

        if len(self.near) > LARGEST_GUESSED:
            return [], 0
        ways = dict[str, int]()
        for body in (each for each in others if len(self.near[each]) >= 3):
            graph: nx.Graph[str] = nx.Graph((a, b) for a in within for b in self.near[a] if b in within)
            direct = graph.has_edge(root, body)
            if direct:
                graph.remove_edge(root, body)
            ways[body] = direct + int(nx.node_connectivity(graph, root, body))
        most = max(ways.values(), default=0)
        return [body for body, count in ways.items() if count == most >= 3], most

    def _frames(self, body: str) -> list[str]:
        """Links of a body that hang on one fixed joint and carry nothing, without sensors."""
        found = []
        for link in [each for each in self.members[body] if each not in self.closing]:
            own = self.joints[link]
            if (
                len(own) == 1
                and own[0].type is JointType.FIXED
                and own[0].links[1] == link
                and not has_word(link, _SENSOR)
            ):
                found.append(link)
        return found
