"""Ways around singular loci: a road map of random poses on one side of the locus, its roads proved when needed.

Nearest neighbours by SciPy, shortest ways by NetworkX; a road that cannot be proved is taken off the map.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ...kinematics.parts import exponential, rotation_vector
from ...mechanism.vectors import Array
from .carriage import Carriage, Stretch
from .proof import FIRST, Proof, Reading, Way, prove

if TYPE_CHECKING:
    import networkx as nx

Place = tuple[Array, Array]

ROUNDS = (60, 240, 960)
"""Poses that are added to the map in each round."""
DRAWS = 30
"""Random poses that are drawn for each that is added, at most."""
NEIGHBOURS = 8
WIDER = 1.5
"""How much wider than the known poses the region is from which poses are drawn."""
ROAD = 400
"""Largest number of intervals for one road."""


@dataclass(frozen=True, eq=False)
class Region:
    """Where poses are drawn: boxes of shifts along, and turns about, what the platform can do, around a pose."""

    carriage: Carriage
    centre: Place
    shift: Array
    turn: Array

    @classmethod
    def around(cls, carriage: Carriage, p: Array, R: Array) -> Region:
        """The region that is wider than known poses (n, 3), (n, 3, 3), around the first."""
        motion = carriage.motion
        shifts = (p - p[0]) @ motion.shifts
        turns = np.array([rotation_vector(each @ R[0].T) for each in R]) @ motion.spins
        middle = p[0] + motion.shifts @ ((shifts.max(axis=0) + shifts.min(axis=0)) / 2)
        limit = np.pi / max(1.0, np.sqrt(motion.spins.shape[1]))
        return cls(carriage, (middle, R[0]), WIDER * np.ptp(shifts, axis=0) / 2,
                   np.minimum(WIDER * np.max(np.abs(turns), axis=0, initial=0.0), limit))

    def draw(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Random poses (count, 3), (count, 3, 3)."""
        motion = self.carriage.motion
        p = self.centre[0] + (rng.uniform(-1, 1, (count, len(self.shift))) * self.shift) @ motion.shifts.T
        turns = (rng.uniform(-1, 1, (count, len(self.turn))) * self.turn) @ motion.spins.T
        return p, np.array([exponential(turn) @ self.centre[1] for turn in turns])


@dataclass(frozen=True, eq=False)
class Plan:
    """A way from start to goal: stretches with their proofs (all proved, or the last is not), and intervals used."""

    ways: tuple[Way, ...]
    proofs: tuple[Proof, ...]
    boxes: int

    @property
    def proved(self) -> bool:
        """Whether the whole way is proved."""
        return all(proof.proved for proof in self.proofs)

    @property
    def margin(self) -> float:
        """The smallest enclosed value along the way."""
        return min(proof.margin for proof in self.proofs)


def plan(reading: Reading, region: Region, start: Place, goal: Place, *, seed: int, budget: int,
         progress: Callable[[], None] | None = None) -> Plan:
    """The straight way where it is proved, else one over a road map, with at most ``budget`` intervals."""
    roads = _Map(reading, budget, [start, goal])
    straight = roads.proof(0, 1)
    rng = np.random.default_rng(seed)
    side = float(np.sign(reading.at(start[0][None], start[1][None])[1][0]))
    for size in ROUNDS:
        if straight.proved or roads.spent >= budget:
            break
        if progress is not None:
            progress()
        roads.add(_drawn(reading, region, rng, size, side))
        found = roads.way()
        if found is not None:
            return roads.plan(roads.shortened(found))
    return roads.plan([0, 1] if straight.proved else roads.nearest())


def _drawn(reading: Reading, region: Region, rng: np.random.Generator, count: int, side: float) -> list[Place]:
    """Up to ``count`` reachable poses on one side of the locus."""
    p, R = region.draw(rng, DRAWS * count)
    reached, values = reading.at(p, R)
    kept = np.flatnonzero(reached & (np.sign(values) == side))[:count]
    return [(p[i], R[i]) for i in kept]


@dataclass(eq=False)
class _Map:
    """Poses, and the roads between neighbours with their proofs where they were tried."""

    reading: Reading
    budget: int
    places: list[Place]
    proofs: dict[tuple[int, int], Proof] = field(default_factory=dict)
    spent: int = 0

    def proof(self, one: int, two: int) -> Proof:
        """The proof of a road, tried once."""
        key = (min(one, two), max(one, two))
        if key not in self.proofs:
            allowed = min(ROAD, self.budget - self.spent)
            self.proofs[key] = prove(self.reading, self.road(*key), allowed)
            self.spent += self.proofs[key].boxes + FIRST
        return self.proofs[key]

    def road(self, one: int, two: int) -> Stretch:
        return Stretch.between(self.places[one], self.places[two])

    def add(self, places: Sequence[Place]) -> None:
        self.places.extend(places)

    def graph(self) -> nx.Graph:
        """Roads between neighbours that were not refused; longer where the condition is weak."""
        import networkx as nx
        from scipy.spatial import cKDTree

        p, R = (np.array(part) for part in zip(*self.places, strict=True))
        quality = np.abs(self.reading.at(p, R)[1])
        quality = quality / (quality + np.median(quality))
        flat = np.hstack([p, R.reshape(len(R), 9) / np.sqrt(2)])
        distances, neighbours = cKDTree(flat).query(flat, k=min(NEIGHBOURS + 1, len(flat)))
        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(range(len(flat)))
        for one, (far, others) in enumerate(zip(distances, neighbours, strict=True)):
            for distance, two in zip(far, others, strict=True):
                key = (min(one, int(two)), max(one, int(two)))
                if one != two and (key not in self.proofs or self.proofs[key].proved):
                    graph.add_edge(*key, weight=float(distance) / float(min(quality[one], quality[two])))
        return graph

    def way(self) -> list[int] | None:
        """The shortest way from the first place to the second whose roads are all proved."""
        import networkx as nx

        graph = self.graph()
        while self.spent < self.budget and nx.has_path(graph, 0, 1):
            found = [int(i) for i in nx.shortest_path(graph, 0, 1, weight="weight")]
            refused = next((road for road in pairwise(found) if not self.proof(*road).proved), None)
            if refused is None:
                return found
            graph.remove_edge(*refused)
        return None

    def shortened(self, way: list[int]) -> list[int]:
        """The way with places left out where the road past them is proved too."""
        kept, here = [way[0]], 0
        while here < len(way) - 1:
            here = next(j for j in range(len(way) - 1, here, -1) if self.proof(way[here], way[j]).proved)
            kept.append(way[here])
        return kept

    def nearest(self) -> list[int]:
        """Over proved roads as near to the second place as they lead, then straight on."""
        import networkx as nx

        graph: nx.Graph = nx.Graph([road for road, proof in self.proofs.items() if proof.proved])
        graph.add_node(0)
        reached = nx.single_source_shortest_path(graph, 0)
        last = min(reached, key=lambda i: self.road(i, 1).size)
        return [int(i) for i in reached[last]] + [1]

    def plan(self, way: Sequence[int]) -> Plan:
        proofs = tuple(self.proof(*road) for road in pairwise(way))
        return Plan(tuple(self.road(*road) for road in pairwise(way)), proofs, self.spent)
