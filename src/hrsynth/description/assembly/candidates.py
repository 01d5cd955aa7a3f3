"""Candidates for loop closures: frames that a file may intend to connect."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array
from ...mechanism import graphs
from ...mechanism.model import JointType
from ...tolerances import INCIDENCE_TOL
from ..jointgraph import JointGraph, join_names
from .loops import LoopAssembly, Values

CLOSURE_CANDIDATE_DISTANCE_MAX = 2e-2
"""Distance (characteristic lengths) up to which two frames of a foreign file are candidates for a closure."""
CLOSURE_CANDIDATES_MAX = 12
"""Largest number of frame pairs reported as possible closures."""


@dataclass(frozen=True)
class ClosureCandidate:
    """Two links of different bodies whose frames (almost) coincide while all joints are at zero, but not when they
    move: distance (m), and True if it is due to rounding."""

    links: tuple[str, str]
    distance: float
    coincides: bool

    @property
    def wish(self) -> str:
        """Value for ``--close``: the frames meet in a point."""
        return ":".join(self.links)

    def __str__(self) -> str:
        return f"{self.wish} ({1000 * self.distance:.3g} mm)"


def closure_candidates(graph: JointGraph, base: str) -> tuple[ClosureCandidate, ...]:
    """Return pairs of frames of the tree of ``base`` that a closure could connect, the nearest first; of frames of the
    same two bodies at the same point the frame on a fixed joint."""
    joints = [joint for joint in graph.joints.values() if joint.in_tree]
    assembly = LoopAssembly(base, joints)
    links = [base, *(link for _, _, link in assembly.tree)]
    if len(links) < 2:
        return ()
    bonds = graphs.build_adjacency(
        links, (j.links for j in joints if j.type is JointType.FIXED and j.links[0] in links)
    )
    body = {link: number for number, group in enumerate(graphs.list_components(bonds)) for link in group}
    joined = {frozenset(body[x] for x in j.links) for j in graph.joints.values() if set(j.links) <= set(links)}
    zero, step = assembly.zero(), np.random.default_rng(0).uniform(0.4, 1.0, assembly.model.nv)
    size = assembly.size
    points, moved = (
        _points(assembly, links, values) for values in (zero, assembly.step(zero, step[:size], step[size:]))
    )
    apart = np.linalg.norm(points[:, None] - points, axis=2) / assembly.length
    apart_moved = np.linalg.norm(moved[:, None] - moved, axis=2) / assembly.length
    # near at zero, and farther apart elsewhere: joints that rotate about the point itself do not separate frames there
    near = np.argwhere(
        np.triu(
            (apart <= CLOSURE_CANDIDATE_DISTANCE_MAX) & (apart_moved > apart + CLOSURE_CANDIDATE_DISTANCE_MAX / 2), 1
        )
    )
    busy = Counter(link for joint in joints for link in joint.links)
    ranked = sorted(
        near.tolist(),
        key=lambda pair: (apart[*pair] > INCIDENCE_TOL, sum(busy[links[i]] > 1 for i in pair), apart[*pair], *pair),
    )
    found: list[ClosureCandidate] = []
    taken: dict[frozenset[int], list[Array]] = {}
    for i, j in ranked:
        bodies = frozenset((body[links[i]], body[links[j]]))
        places = taken.setdefault(bodies, [])
        if bodies in joined or any(
            np.linalg.norm(points[i] - p) <= CLOSURE_CANDIDATE_DISTANCE_MAX * assembly.length for p in places
        ):
            continue
        if len(found) == CLOSURE_CANDIDATES_MAX:
            break
        places.append(points[i])
        found.append(
            ClosureCandidate(
                (links[i], links[j]), float(apart[i, j] * assembly.length), bool(apart[i, j] <= INCIDENCE_TOL)
            )
        )
    return tuple(found)


def without_loop(graph: JointGraph, base: str) -> str | None:
    """Return the note on a graph without loops: it is an open chain, and these closures are possible."""
    if graph.gears or len(graph.joints) >= len(graph.links):
        return None
    text = "no element of the file closes a loop: it is read as an open chain"
    if found := closure_candidates(graph, base):
        text += (
            f"; frames close to each other: {join_names(map(str, found), CLOSURE_CANDIDATES_MAX)} (--close "
            f"{found[0].wish} connects the first two in a point)"
        )
    if graph.arguments:
        values = join_names(f"{name}:={value}" for name, value in graph.arguments.items())
        text += f"; the file has arguments, now {values} (--arg NAME:=VALUE changes one)"
    return text


def _points(assembly: LoopAssembly, links: list[str], values: Values) -> Array:
    """Return the origins of the links' frames, (count, 3), in metres."""
    poses = assembly.poses(values)
    return np.array([poses[link][:3, 3] for link in links])
