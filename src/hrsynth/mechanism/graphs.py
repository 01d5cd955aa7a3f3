"""Small undirected graphs: what a few dozen links need, without the import of a graph library.

A graph is its adjacency: node to the nodes next to it. The order of both is kept, so that every result is the same
in every run. ``within`` restricts a search to some of the nodes.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeVar

Adjacency = Mapping[str, Collection[str]]


class Bond(Protocol):
    """An edge: anything that names the two links it joins."""

    @property
    def links(self) -> tuple[str, str]: ...


B = TypeVar("B", bound=Bond)


def build_adjacency(nodes: Iterable[str], pairs: Iterable[Iterable[str]]) -> dict[str, dict[str, None]]:
    """The graph with these nodes and edges; ends of edges that are no nodes yet become nodes."""
    graph: dict[str, dict[str, None]] = {node: {} for node in nodes}
    for a, b in pairs:
        graph.setdefault(a, {})[b] = None
        graph.setdefault(b, {})[a] = None
    return graph


def count_edges(graph: Adjacency, start: str, within: Container[str] | None = None) -> dict[str, int]:
    """The number of edges from ``start`` to each node that can be reached, nearest first."""
    found = {start: 0}
    pending = [start]
    for node in pending:
        for other in graph[node]:
            if other not in found and (within is None or other in within):
                found[other] = found[node] + 1
                pending.append(other)
    return found


def find_component(graph: Adjacency, start: str, within: Container[str] | None = None) -> set[str]:
    """Return the nodes that can be reached from ``start``, itself included."""
    return set(count_edges(graph, start, within))


def list_components(graph: Adjacency, within: Container[str] | None = None) -> Iterator[set[str]]:
    """Return the connected parts, in the order of their first nodes."""
    seen: set[str] = set()
    for node in graph:
        if node not in seen and (within is None or node in within):
            part = find_component(graph, node, within)
            seen |= part
            yield part


def list_blocks(pairs: Iterable[tuple[str, str]]) -> list[set[str]]:
    """Return the nodes of each block of the graph with these edges: those on loops that share two nodes, or both ends
    of an edge on no loop."""
    import networkx as nx

    graph: nx.Graph[str] = nx.Graph(pairs)
    return list(map(set, nx.biconnected_components(graph)))  # type: ignore[arg-type]


def is_bridge(pairs: Sequence[tuple[str, str]], place: int) -> bool:
    """Return True if nothing else connects the two ends of the edge at this index among all edges."""
    one, other = pairs[place]
    rest = build_adjacency((one,), (pair for k, pair in enumerate(pairs) if k != place))
    return other not in find_component(rest, one)


def list_paths(graph: Adjacency, start: str, end: str, within: Container[str] | None = None) -> Iterator[list[str]]:
    """Yield all paths from ``start`` to ``end`` that visit no node twice, depth first."""
    way, ahead = [start], [iter(graph[start])]
    while ahead:
        node = next(ahead[-1], None)
        if node is None:
            way.pop()
            ahead.pop()
        elif node == end:
            yield [*way, end]
        elif node not in way and (within is None or node in within):
            way.append(node)
            ahead.append(iter(graph[node]))


def find_shortest_path(graph: Adjacency, start: str, end: str) -> list[str]:
    """Return a path from ``start`` to ``end`` with the fewest edges. Raises ``KeyError`` if there is none."""
    left = count_edges(graph, end)
    way = [start]
    for remaining in range(left[start] - 1, -1, -1):
        way.append(next(node for node in graph[way[-1]] if left[node] == remaining))
    return way


def build_spanning_forest(nodes: Iterable[str], bonds: Sequence[B], weights: Sequence[Any]) -> list[B]:
    """Return the bonds of a minimum spanning forest, lightest first (Kruskal); among equals that of the earlier node,
    then of the pair that is connected first."""
    place = {node: i for i, node in enumerate(nodes)}
    ends = [sorted((place[one], place[other])) for one, other in (bond.links for bond in bonds)]
    pairs: dict[tuple[int, int], int] = {}
    ranked = [(weights[i], a, pairs.setdefault((a, b), len(pairs)), i) for i, (a, b) in enumerate(ends)]
    tree = {node: node for node in place}
    chosen = []
    for *_, i in sorted(ranked):
        a, b = (_find_root(tree, link) for link in bonds[i].links)
        if a != b:
            tree[b] = a
            chosen.append(bonds[i])
    return chosen


def _find_root(tree: dict[str, str], node: str) -> str:
    while tree[node] != node:
        node = tree[node]
    return node


def order_outward(root: str, bonds: Iterable[B]) -> list[tuple[B, str, str]]:
    """Return the bonds of a tree breadth first from ``root``: each with its near and its far link."""
    table: dict[str, list[B]] = {}
    for bond in bonds:
        for link in bond.links:
            table.setdefault(link, []).append(bond)
    found: list[tuple[B, str, str]] = []
    pending = [root]
    for near in pending:
        for bond in table.get(near, ()):
            far = bond.links[1] if bond.links[0] == near else bond.links[0]
            if far not in pending:
                found.append((bond, near, far))
                pending.append(far)
    return found
