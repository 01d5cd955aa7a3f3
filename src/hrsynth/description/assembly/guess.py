"""What a file leaves open, guessed by structure where that is safe: the base and the platform. Never by names, which
only order what is offered."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...budgets import LARGEST_GUESSED
from ...errors import BadRequest
from ...mechanism import graphs
from ...mechanism.model import JointType
from ..jointgraph import JointGraph, JointSpec, first_body

_FOOT = re.compile("foot|toe|sole|tool|flange|hand|plat", re.IGNORECASE)


def base(graph: JointGraph) -> str:
    """The link that no joint carries, or the first of them in the file."""
    carried = {joint.links[1] for joint in graph.joints.values() if joint.in_tree}
    free = [link for link in graph.links if link not in carried] or list(graph.links)
    if len(free) > 1:
        graph.note("guess", f"the base is link {free[0]!r}, the first of {len(free)} that no joint carries "
                            "(--base LINK to change it)")
    return free[0]


def standing(graph: JointGraph, base: str, wanted: str | None, platform: str | None = None) -> str:
    """The link from which a robot is read: its base; where the ``wanted`` one hangs on something else, the root of
    that; of a robot with loops that only a free joint holds (``<freejoint>``), the link that floats; where all hangs on
    one slide and the loops begin at what slides, that link: a rail is no leg. ``platform`` is the one that is given."""
    bonds = graphs.adjacency(graph.links, (joint.links for joint in graph.joints.values()))
    if wanted is not None and wanted in graph.links and wanted not in graphs.component(bonds, base):
        base = wanted
        carriers = {joint.links[1]: joint.links[0] for joint in graph.joints.values() if joint.in_tree}
        for _ in carriers:
            base = carriers.get(base, base)
    if all(joint.in_tree for joint in graph.joints.values()):
        return base
    while wanted != base:
        held = [joint for joint in graph.joints.values() if base in joint.links]
        if len(held) != 1:
            break
        (bearer,) = held
        trunk = next(link for link in bearer.links if link != base)
        if bearer.type is JointType.FREE:
            how = f"floats on the free joint {bearer.name!r}: it is the base, and what it floats in is left out"
        elif bearer.type is JointType.PRISMATIC and _is_rail(graph, bearer, trunk, platform):
            how = (f"slides on the rail {bearer.name!r}: it is the base, and what it slides on is left out "
                   f"(--base {base} to keep it)")
        else:
            break
        graph.note("guess", f"{trunk!r} {how}")
        del graph.joints[bearer.name], graph.links[base]
        base = trunk
    return base


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


def platform(graph: JointGraph, base: str) -> str:
    """The link that most ways connect to the base; else the only frame on a fixed joint; else the link farthest away.

    Raises ``BadRequest`` with the candidates where several are as good.
    """
    bodies = _RigidBodies(graph, base)
    if len(bodies.members) == 1:
        raise BadRequest(f"{graph.file}: no link moves relative to the base", base, "a joint that is not fixed")
    body, why, rivals = bodies.platform()
    if body is None:
        names = bodies.platform_candidates(rivals)
        chain = "".join(f"; {note.text}" for note in graph.notes if note.kind == "open")
        raise BadRequest(f"{graph.file}: the file does not say which link is the platform, and several could be{chain}",
                         None, "--platform LINK, such as " + ", ".join(names[:12]) + (" …" if names[12:] else ""))
    link = bodies.title(body)
    graph.note("guess", f"the platform is link {link!r}, {why} (--platform LINK to change it)")
    return link


def platforms(graph: JointGraph, base: str) -> tuple[list[str], str]:
    """The link that is guessed and why, or the links among which nothing decides, and no reason."""
    bodies = _RigidBodies(graph, base)
    body, why, rivals = bodies.platform()
    return bodies.platform_candidates(rivals) if body is None else [bodies.title(body)], why


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
        self.closing = graph.closing
        self.joints: dict[str, list[JointSpec]] = {link: [] for link in graph.links}
        for joint in joints:
            for link in joint.links:
                self.joints[link].append(joint)

    def platform(self) -> tuple[str | None, str, Sequence[str]]:
        """The platform's body and why, or None and the candidates."""
        others = [body for body in self.near if body != self.base]
        framed = [body for body in others if self._frames(body)]
        parts = sum(1 for _ in graphs.components(self.near))
        if sum(map(len, self.near.values())) == 2 * (len(self.near) - parts):  # a forest
            tips = [body for body in others if len(self.near[body]) == 1]
            if len(tips) == 1:
                return tips[0], "the end of the chain", ()
            return (framed[0], "the only frame on a fixed joint", ()) if len(framed) == 1 else (None, "", tips)
        ways = {body: self._ways(body) for body in others if len(self.near[body]) >= 3}
        most = max(ways.values(), default=0)
        best = [body for body in others if ways.get(body) == most]
        if most >= 3 and len(best) == 1:
            floats = sum(joint.type is JointType.FREE for link in self.members[best[0]] for joint in self.joints[link])
            return best[0], f"which {most - floats} ways connect to the base", ()
        if len(framed) == 1:
            return framed[0], "the only frame on a fixed joint", ()
        distance = graphs.distances(self.near, self.base)
        ends = [body for body in others if distance[body] == max(distance.values())]
        return (ends[0], "the farthest from the base", ()) if len(ends) == 1 else (None, "", ends)

    def platform_candidates(self, rivals: Sequence[str]) -> list[str]:
        """The links that may be the platform where nothing decides: open ends and what ends in a loop beside the
        ``rivals``; those first whose names are those of feet and tools."""
        import networkx as nx

        found = [self.title(each) for each in rivals]
        if len(self.near) <= LARGEST_GUESSED:
            graph: nx.Graph[str] = nx.Graph((a, b) for a, ends in self.near.items() for b in ends)
            joints = set(nx.articulation_points(graph))
            parts: list[set[str]] = list(map(set, nx.biconnected_components(graph)))  # type: ignore[arg-type]
            last = [part - joints for part in parts if len(part & joints) == 1 and self.base not in part]
            found += [self.title(body) for body in self.near if any(body in part for part in last)]
        names = dict.fromkeys(found)
        return sorted(names, key=lambda name: (0, len(name)) if _FOOT.search(name) else (1, 0))

    def title(self, body: str) -> str:
        """The link that stands for a body: its only frame, else the link with most joints."""
        frames = self._frames(body)
        if len(frames) == 1:
            return frames[0]
        return max(self.members[body], key=lambda link: len(self.joints[link]))

    def _ways(self, body: str) -> int:
        """The number of ways from a body to the base that share no body; not counted where there are too many."""
        import networkx as nx

        if len(self.near) > LARGEST_GUESSED:
            return 0
        graph: nx.Graph[str] = nx.Graph((a, b) for a, ends in self.near.items() for b in ends)
        direct = graph.has_edge(self.base, body)
        if direct:
            graph.remove_edge(self.base, body)
        return direct + int(nx.node_connectivity(graph, self.base, body))

    def _frames(self, body: str) -> list[str]:
        """Links of a body that hang on one fixed joint and carry nothing."""
        found = []
        for link in [each for each in self.members[body] if each not in self.closing]:
            own = self.joints[link]
            if len(own) == 1 and own[0].type is JointType.FIXED and own[0].links[1] == link:
                found.append(link)
        return found
