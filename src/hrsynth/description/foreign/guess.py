"""What a file leaves open, guessed by structure where that is safe: the base and the platform. Never by names."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ...budgets import LARGEST_GUESSED
from ...errors import BadRequest
from ...mechanism import graphs
from ...mechanism.model import JointType
from ..draft import Edge
from .graph import Graph


def base(graph: Graph) -> str:
    """The link that no joint carries, or the first of them in the file."""
    carried = {edge.links[1] for edge in graph.edges.values() if edge.in_tree}
    free = [link for link in graph.links if link not in carried] or list(graph.links)
    if len(free) > 1:
        graph.note("guess", f"the base is link {free[0]!r}, the first of {len(free)} that no joint carries "
                            "(--base LINK to change it)")
    return free[0]


def platform(graph: Graph, base: str) -> str:
    """The link that most ways join to the base; else the only frame on a fixed joint; else the link farthest away.

    Raises ``BadRequest`` with the candidates where several are as good.
    """
    bodies = _Bodies(graph, base)
    body, why, rivals = bodies.platform()
    if len(bodies.members) == 1:
        raise BadRequest(f"{graph.file}: no link moves relative to the base", base, "a joint that is not fixed")
    if body is None:
        names = [bodies.title(each) for each in rivals]
        raise BadRequest(f"{graph.file}: the file does not say which link is the platform, and several could be",
                         None, "--platform LINK, such as " + ", ".join(names[:12]) + (" …" if names[12:] else ""))
    link = bodies.title(body)
    graph.note("guess", f"the platform is link {link!r}, {why} (--platform LINK to change it)")
    return link


class _Bodies:
    """Links held together by fixed joints are one body, named by its first link."""

    def __init__(self, graph: Graph, base: str) -> None:
        import networkx as nx

        bonds = graphs.adjacency(graph.links, (e.links for e in graph.edges.values() if e.type is JointType.FIXED))
        order = {link: i for i, link in enumerate(graph.links)}
        self.members = {min(group, key=order.__getitem__): sorted(group, key=order.__getitem__)
                        for group in graphs.components(bonds)}
        self.into = {link: name for name, group in self.members.items() for link in group}
        self.base = self.into[base]
        self.graph: nx.Graph[str] = nx.Graph()
        self.graph.add_nodes_from(self.members)
        self.graph.add_edges_from({(self.into[a], self.into[b]) for a, b in _moving(graph.edges.values())})
        self.graph.remove_edges_from(nx.selfloop_edges(self.graph))
        self.closing = graph.closing
        self.edges: dict[str, list[Edge]] = {link: [] for link in graph.links}
        for edge in graph.edges.values():
            for link in edge.links:
                self.edges[link].append(edge)

    def platform(self) -> tuple[str | None, str, Sequence[str]]:
        """The platform's body and why, or None and the candidates."""
        import networkx as nx

        others = [body for body in self.graph if body != self.base]
        if not others:
            return None, "", []
        if nx.is_forest(self.graph):
            tips = [body for body in others if self.graph.degree(body) == 1]
            frames = self._framed()
            if len(tips) == 1:
                return tips[0], "the end of the chain", ()
            return (frames[0], "the only frame on a fixed joint", ()) if len(frames) == 1 else (None, "", tips)
        ways = self._ways(others)
        most = max(ways.values(), default=0)
        best = [body for body in others if ways.get(body) == most]
        if most >= 3 and len(best) == 1:
            return best[0], f"which {most} ways join to the base", ()
        frames = self._framed()
        if len(frames) == 1:
            return frames[0], "the only frame on a fixed joint", ()
        distance = nx.single_source_shortest_path_length(self.graph, self.base)
        farthest = max(distance.values())
        ends = [body for body in others if distance[body] == farthest]
        return (ends[0], "the farthest from the base", ()) if len(ends) == 1 else (None, "", ends)

    def title(self, body: str) -> str:
        """The link that stands for a body: its only frame, else the link with most joints."""
        frames = self._frames(body)
        if len(frames) == 1:
            return frames[0]
        return max(self.members[body], key=lambda link: len(self.edges[link]))

    def _ways(self, others: Collection[str]) -> dict[str, int]:
        """The number of ways from each body to the base that share no body."""
        import networkx as nx

        if len(self.graph) > LARGEST_GUESSED:
            return {}
        found = {}
        for body in others:
            if self.graph.degree(body) >= 3:
                rest = self.graph.copy()
                direct = rest.has_edge(self.base, body)
                if direct:
                    rest.remove_edge(self.base, body)
                found[body] = direct + int(nx.node_connectivity(rest, self.base, body))
        return found

    def _frames(self, body: str) -> list[str]:
        """Links of a body that hang on one fixed joint and carry nothing."""
        found = []
        for link in [each for each in self.members[body] if each not in self.closing]:
            own = self.edges[link]
            if len(own) == 1 and own[0].type is JointType.FIXED and own[0].links[1] == link:
                found.append(link)
        return found

    def _framed(self) -> list[str]:
        """Bodies other than the base that have such a link."""
        return [body for body in self.members if body != self.base and self._frames(body)]


def _moving(edges: Collection[Edge]) -> list[tuple[str, str]]:
    return [edge.links for edge in edges if edge.type is not JointType.FIXED]
