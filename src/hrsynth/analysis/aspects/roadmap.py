"""Paths around singular loci and through legs' limits: the straight one if it is proved, else one over a road map.

The road map has random poses on one side of the locus in several working modes, with roads between neighbours and
crossings where a leg passes its limit; roads are proved when they are needed. Nearest neighbours by SciPy, shortest
paths by NetworkX; a road that cannot be proved is removed from the map.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ...geometry.vectors import Array
from ...progress import report
from .condition_enclosure import PATH_FIRST_INTERVALS_COUNT, ConditionEnclosure, PathSegment, Proof, prove
from .path_segments import (
    PathCoordinates,
    Place,
    StraightSegment,
    WorkingModeChange,
    build_mode_change,
    interpolate_poses,
)

if TYPE_CHECKING:
    import networkx as nx

ROADMAP_REGION_FRACTION = 1.5
"""Enlargement of the region of the known poses from which a roadmap is sampled."""


@dataclass(frozen=True, eq=False)
class PoseRegion:
    """Region of sampled poses: boxes of shifts along, and rotations about, the directions of the platform's motion,
    around a pose."""

    coordinates: PathCoordinates
    centre: Place
    shift: Array
    turn: Array

    @classmethod
    def around(cls, coordinates: PathCoordinates, p: Array, R: Array) -> PoseRegion:
        """Return the region that is wider than known poses (n, 3), (n, 3, 3), around the first."""
        motion = coordinates.motion
        shifts = (p - p[0]) @ motion.translations
        turns = convert_rotations_to_vectors(R @ R[0].T) @ motion.rotations
        middle = p[0] + motion.translations @ ((shifts.max(axis=0) + shifts.min(axis=0)) / 2)
        exact = cls(coordinates, (middle, R[0]), np.ptp(shifts, axis=0) / 2, np.max(np.abs(turns), axis=0, initial=0.0))
        return exact.wider(ROADMAP_REGION_FRACTION)

    def wider(self, factor: float) -> PoseRegion:
        """Return the region grown by a factor; no rotation is longer than π."""
        limit = np.pi / max(1.0, np.sqrt(len(self.turn)))
        return replace(self, shift=factor * self.shift, turn=np.minimum(factor * self.turn, limit))

    def draw(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Return random poses (count, 3), (count, 3, 3)."""
        motion = self.coordinates.motion
        p = self.centre[0] + (rng.uniform(-1, 1, (count, len(self.shift))) * self.shift) @ motion.translations.T
        turns = (rng.uniform(-1, 1, (count, len(self.turn))) * self.turn) @ motion.rotations.T
        return p, convert_vectors_to_rotations(turns) @ self.centre[1]


ROADMAP_DRAWS_MAX = 30
"""Largest number of random poses for each that is added to a working mode."""
ROADMAP_NEIGHBOURS_COUNT = 8
ROADMAP_WORKING_MODES_MAX = 16
"""Largest number of working modes in one map."""
MODE_CROSSINGS_PER_ROUND_MAX = 12
"""Largest number of crossings that are added between two working modes in each round."""
MODE_CHANGE_LENGTH_FRACTION = 2.0
"""Length of a change of working mode (characteristic lengths, radians)."""
ROADMAP_SEGMENT_INTERVALS_MAX = 400
"""Largest number of intervals for one road."""
GLANCES = np.linspace(0, 1, 10)
"""Fractions of a road at which it is evaluated in floats before it is added to the map."""

Road = tuple[int, int]


@dataclass(eq=False)
class RoadMap:
    """Road map: poses, each in a working mode, and the roads between them with their proofs.

    The first pose is the start, the second the goal; ``enclosures`` are the condition in each working mode,
    ``modes_of`` the index in it for each pose.
    """

    region: PoseRegion
    enclosures: list[ConditionEnclosure]
    places: list[Place]
    modes_of: list[int]
    budget: int
    spent: int = 0
    scale: float = 0.0
    """Typical value of the condition."""
    proofs: dict[Road, Proof] = field(default_factory=dict)
    weights: dict[Road, float] = field(default_factory=dict)
    """Lengths of roads, longer where the condition is small; infinite where a road leaves reach or side."""
    crossings: dict[Road, WorkingModeChange] = field(default_factory=dict)

    @classmethod
    def between(
        cls,
        enclosures: tuple[ConditionEnclosure, ConditionEnclosure],
        region: PoseRegion,
        start: Place,
        goal: Place,
        budget: int,
    ) -> RoadMap:
        """Return a map of two poses in their working modes."""
        same = enclosures[0].forms.modes == enclosures[1].forms.modes
        return cls(region, list(enclosures[: 1 if same else 2]), [start, goal], [0, 0 if same else 1], budget)

    @property
    def side(self) -> float:
        """Sign of the condition's value at the start."""
        (p, R), enclosure = self.places[0], self.enclosures[self.modes_of[0]]
        return float(np.sign(enclosure.at(p[None], R[None])[1][0]))

    def open(self, limbs: Sequence[int]) -> None:
        """Add the working modes in which some of these subchains differ from the start's; if these are too many, those
        in which the first of them differ."""
        many = 2 ** len(limbs) > ROADMAP_WORKING_MODES_MAX
        chosen = (
            [limbs[:k] for k in range(len(limbs) + 1)]
            if many
            else [part for k in range(len(limbs) + 1) for part in combinations(limbs, k)]
        )
        known = {enclosure.forms.modes for enclosure in self.enclosures}
        for part in chosen:
            chart = self.enclosures[self.modes_of[0]].forms
            for limb in part:
                chart = chart.flipped(limb)
            if chart.modes not in known:
                self.enclosures.append(replace(self.enclosures[0], forms=chart))

    def add(self, region: PoseRegion, rng: np.random.Generator, count: int) -> None:
        """Add up to ``count`` random poses in each working mode, reachable and on the side of the start, with crossings
        where two working modes have a pose near a subchain's limit."""
        p, R = region.draw(rng, ROADMAP_DRAWS_MAX * count)
        reach_margins = self.enclosures[0].forms.at(p, R).reach_margins
        kept = (reach_margins[:, : len(self.enclosures[0].forms.subchains)] > 0).all(axis=1)
        p, R, reach_margins = p[kept], R[kept], reach_margins[kept]
        if not len(p):
            return
        fits = [enclosure.at(p, R) for enclosure in self.enclosures]
        beside = [reached & (np.sign(values) == self.side) for reached, values in fits]
        self.scale = self.scale or float(np.median(np.abs([values for _, values in fits])))
        for mode, fit in enumerate(beside):
            for i in np.flatnonzero(fit)[:count]:
                self._place((p[i], R[i]), mode)
        for one, two, limb in self._adjacent():
            near = np.flatnonzero(beside[one] & beside[two])
            for i in near[np.argsort(reach_margins[near, limb], kind="stable")][:MODE_CROSSINGS_PER_ROUND_MAX]:
                self._cross((p[i], R[i]), one, two, limb)

    def _adjacent(self) -> Iterator[tuple[int, int, int]]:
        """Yield working modes that differ in one subchain, and that subchain."""
        modes = np.array([enclosure.forms.modes for enclosure in self.enclosures])
        for one, two in combinations(range(len(modes)), 2):
            apart = np.flatnonzero(modes[one] != modes[two])
            if len(apart) == 1:
                yield one, two, int(apart[0])

    def _place(self, place: Place, mode: int) -> int:
        self.places.append(place)
        self.modes_of.append(mode)
        return len(self.places) - 1

    def _cross(self, place: Place, one: int, two: int, limb: int) -> None:
        enclosure = self.enclosures[one]
        ways = [
            build_mode_change(self.region.coordinates, self.enclosures[mode].forms.subchains[limb], limb, place)
            for mode in (one, two)
        ]
        if ways[0] is None or ways[1] is None:
            return
        weight = self._weights(np.array([MODE_CHANGE_LENGTH_FRACTION]), *enclosure.at(*ways[0].at(GLANCES)))[0]
        if np.isfinite(weight):
            here, there = self._place(place, one), self._place(place, two)
            self.crossings |= {(here, there): ways[0], (there, here): ways[1]}
            self.weights[here, there] = weight

    def road(self, one: int, two: int) -> PathSegment:
        """Return the segment from a pose to another: straight, or through a limit."""
        across = self.crossings.get((one, two))
        return StraightSegment.between(self.places[one], self.places[two]) if across is None else across

    def proof(self, one: int, two: int) -> Proof:
        """Return the proof of a road, tried once."""
        key = _make_road_key(one, two)
        if key not in self.proofs:
            allowed = min(ROADMAP_SEGMENT_INTERVALS_MAX, self.budget - self.spent)
            self.proofs[key] = prove(self.enclosures[self.modes_of[key[0]]], self.road(*key), allowed)
            self.spent += self.proofs[key].boxes + PATH_FIRST_INTERVALS_COUNT
        return self.proofs[key]

    def graph(self) -> nx.Graph:
        """Return roads between neighbours that are free in floats, and were not refused."""
        import networkx as nx

        modes_of = np.array(self.modes_of)
        for mode in range(len(self.enclosures)):
            self._survey(np.flatnonzero(modes_of == mode))
        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(range(len(modes_of)))
        graph.add_weighted_edges_from(
            (*road, weight)
            for road, weight in self.weights.items()
            if np.isfinite(weight) and (road not in self.proofs or self.proofs[road].proved)
        )
        return graph

    def _survey(self, members: NDArray[np.int_]) -> None:
        """Evaluate the roads between neighbours in one working mode."""
        from scipy.spatial import cKDTree

        if len(members) < 2:
            return
        p, R = self._at(members)
        flat = np.hstack([p, R.reshape(-1, 9) / np.sqrt(2)])
        around = cKDTree(flat).query(flat, k=min(ROADMAP_NEIGHBOURS_COUNT + 1, len(flat)))[1]
        roads = {
            _make_road_key(int(members[i]), int(members[j])) for i, row in enumerate(around) for j in row if i != j
        }
        self._look(sorted(roads - self.weights.keys()))

    def _look(self, roads: Sequence[Road]) -> None:
        """Compute the weights of straight roads in one working mode, from values along them."""
        if not roads:
            return
        one, two = np.array(roads).T
        places, turns, sizes = interpolate_poses(*self._at(one), *self._at(two), GLANCES)
        reached, values = self.enclosures[self.modes_of[one[0]]].at(places.reshape(-1, 3), turns.reshape(-1, 3, 3))
        found = self._weights(sizes, reached.reshape(len(roads), -1), values.reshape(len(roads), -1))
        self.weights.update(zip(roads, map(float, found), strict=True))

    def _weights(self, sizes: Array, reached: NDArray[np.bool_], values: Array) -> Array:
        """Return the weights of roads of these lengths (n,), from reach and values along them (n, k)."""
        open_ = np.atleast_2d(reached & (np.sign(values) == self.side)).all(axis=1)
        weakest = np.min(np.abs(np.atleast_2d(values)), axis=1)
        return np.where(open_, sizes * (weakest + self.scale) / weakest, np.inf)

    def _at(self, members: NDArray[np.int_]) -> tuple[Array, Array]:
        p, R = zip(*(self.places[i] for i in members), strict=True)
        return np.array(p), np.array(R)

    def way(self) -> list[int] | None:
        """Return the shortest path from the first pose to the second whose roads are all proved."""
        import networkx as nx

        graph = self.graph()
        while self.spent < self.budget and nx.has_path(graph, 0, 1):
            found = list(pairwise(map(int, nx.shortest_path(graph, 0, 1, weight="weight"))))
            hardest = sorted(found, key=lambda road: -self.weights[_make_road_key(*road)])
            refused = next((road for road in hardest if not self.proof(*road).proved), None)
            if refused is None:
                return [found[0][0], *(two for _, two in found)]
            graph.remove_edge(*refused)
        return None

    def shortened(self, way: list[int]) -> list[int]:
        """Return the path without the poses that a proved road can leave out."""
        kept, here = [way[0]], 0
        while here < len(way) - 1:
            here = next(
                j for j in range(len(way) - 1, here, -1) if j == here + 1 or self._is_shortcut_proved(way[here : j + 1])
            )
            kept.append(way[here])
        return kept

    def _is_shortcut_proved(self, part: Sequence[int]) -> bool:
        """Return True if the straight road from the first to the last of a part in one working mode is proved."""
        if any(self.modes_of[i] != self.modes_of[part[0]] for i in part):
            return False
        road = _make_road_key(part[0], part[-1])
        if road not in self.weights:
            self._look([road])
        return bool(np.isfinite(self.weights[road])) and self.proof(*road).proved

    def nearest(self) -> list[int]:
        """Return a path over proved roads to a pose in the goal's working mode, as near to it as they lead, then
        straight on; none if nothing is proved."""
        import networkx as nx

        graph: nx.Graph = nx.Graph([road for road, proof in self.proofs.items() if proof.proved])
        graph.add_node(0)
        reached = {
            i: way
            for i, way in nx.single_source_shortest_path(graph, 0).items()
            if self.modes_of[i] == self.modes_of[1]
        }
        if not reached:
            return []
        here = np.array(list(reached))
        goal = np.ones_like(here)
        last = here[np.argmin(interpolate_poses(*self._at(here), *self._at(goal), GLANCES)[2])]
        return [int(i) for i in reached[int(last)]] + [1]


def _make_road_key(one: int, two: int) -> Road:
    return min(one, two), max(one, two)


ROUNDS = ((60, 1.0), (240, 1.5), (960, 2.0))
"""Number of poses that are added to the map in each round, and the factor by which their region grows; shared by
several working modes."""


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """Path from start to goal: its segments with their proofs (all proved, or the last is not; none if nothing leads to
    the goal's working mode), and intervals used."""

    ways: tuple[PathSegment, ...]
    proofs: tuple[Proof, ...]
    boxes: int

    @property
    def is_proved(self) -> bool:
        """True if the whole path is proved."""
        return bool(self.proofs) and all(proof.proved for proof in self.proofs)

    @property
    def margin(self) -> float:
        """Smallest enclosed value along the path."""
        return min(proof.margin for proof in self.proofs)


def plan(
    enclosures: tuple[ConditionEnclosure, ConditionEnclosure],
    region: PoseRegion,
    start: Place,
    goal: Place,
    *,
    seed: int,
    budget: int,
) -> PlannedPath:
    """Search for a path between two poses in the working modes of two enclosures, with at most ``budget`` intervals.

    In the first round only subchains that differ pass their limits; then any that can.
    """
    roads = RoadMap.between(enclosures, region, start, goal, budget)
    straight = roads.modes_of[1] == 0 and roads.proof(0, 1).proved
    if straight:
        return _plan(roads, [0, 1])
    rng = np.random.default_rng(seed)
    limbs = enclosures[0].forms.subchains
    crossed = [
        number
        for number, (limb, other) in enumerate(zip(limbs, enclosures[1].forms.subchains, strict=True))
        if limb.mode != other.mode
    ]
    able = [
        number
        for number, limb in enumerate(limbs)
        if build_mode_change(region.coordinates, limb, number, start) is not None
    ]
    if not set(crossed) <= set(able):
        return PlannedPath((), (), roads.spent)
    for size, factor in ROUNDS:
        if roads.spent >= budget:
            break
        report("road map")
        roads.open(crossed)
        roads.add(region.wider(factor), rng, int(np.ceil(size / np.sqrt(len(roads.enclosures)))))
        found = roads.way()
        if found is not None:
            return _plan(roads, roads.shortened(found))
        crossed = [int(i) for i in rng.permutation(crossed)] + [i for i in able if i not in crossed]
    return _plan(roads, roads.nearest())


def _plan(roads: RoadMap, way: list[int]) -> PlannedPath:
    proofs = tuple(roads.proof(*road) for road in pairwise(way))
    return PlannedPath(tuple(roads.road(*road) for road in pairwise(way)), proofs, roads.spent)
