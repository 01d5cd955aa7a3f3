"""The small graphs answer what networkx answers, on random graphs."""

from __future__ import annotations

from dataclasses import dataclass

import networkx as nx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.mechanism import graphs


@dataclass(frozen=True)
class Bond:
    links: tuple[str, str]
    number: int


NODES = [f"n{i}" for i in range(7)]
pairs = st.tuples(st.sampled_from(NODES), st.sampled_from(NODES)).filter(lambda pair: pair[0] != pair[1])
edges = st.lists(pairs, max_size=14)
some = st.one_of(st.none(), st.sets(st.sampled_from(NODES)).map(lambda within: within | {"n0", "n1"}))


def both(joined: list[tuple[str, str]], within: set[str] | None) -> tuple[graphs.Adjacency, nx.Graph[str]]:
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(NODES)
    graph.add_edges_from(joined)
    return graphs.build_adjacency(NODES, joined), graph if within is None else graph.subgraph(within)


@given(edges, some)
def test_distances_and_components(joined, within):
    ours, theirs = both(joined, within)
    assert graphs.count_edges(ours, "n0", within) == nx.single_source_shortest_path_length(theirs, "n0")
    assert graphs.find_component(ours, "n0", within) == nx.node_connected_component(theirs, "n0")
    found = list(graphs.list_components(ours, within))
    assert sorted(map(sorted, found)) == sorted(map(sorted, nx.connected_components(theirs)))
    assert [min(part, key=NODES.index) for part in found] == sorted(
        (min(part, key=NODES.index) for part in found), key=NODES.index
    )


@given(edges, some)
def test_paths(joined, within):
    ours, theirs = both(joined, within)
    found = list(graphs.list_paths(ours, "n0", "n1", within))
    assert sorted(found) == sorted(nx.all_simple_paths(theirs, "n0", "n1"))


@given(edges)
def test_a_shortest_path(joined):
    ours, theirs = both(joined, None)
    if nx.has_path(theirs, "n0", "n1"):
        assert graphs.find_shortest_path(ours, "n0", "n1") in list(nx.all_shortest_paths(theirs, "n0", "n1"))
    else:
        with pytest.raises(KeyError):
            graphs.find_shortest_path(ours, "n0", "n1")


@given(st.lists(st.tuples(pairs, st.integers(0, 2)), max_size=14))
def test_the_same_spanning_tree_and_the_same_order(weighted):
    """Among equal weights too: files and twins do not depend on which of the two chooses."""
    bonds = [Bond(pair, number) for number, (pair, _) in enumerate(weighted)]
    graph: nx.MultiGraph[str] = nx.MultiGraph()
    graph.add_nodes_from(NODES)
    for bond, (_, weight) in zip(bonds, weighted, strict=True):
        graph.add_edge(*bond.links, key=bond.number, weight=weight)
    chosen = graphs.build_spanning_forest(NODES, bonds, [weight for _, weight in weighted])
    theirs = [key for _, _, key in nx.minimum_spanning_edges(graph, keys=True, data=False)]
    assert [bond.number for bond in chosen] == theirs
    tree: nx.Graph[str] = nx.Graph()
    tree.add_nodes_from(NODES)
    tree.add_edges_from(bond.links for bond in chosen)
    assert [(near, far) for _, near, far in graphs.order_outward("n0", chosen)] == list(nx.bfs_edges(tree, "n0"))
