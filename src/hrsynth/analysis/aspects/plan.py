"""Ways around singular loci and through legs' limits: the straight one where it is proved, else one over a road map."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...progress import tell
from .carriage import Place
from .crossing import crossing
from .proof import Proof, Reading, Way
from .region import Region
from .roads import RoadMap

ROUNDS = ((60, 1.0), (240, 1.5), (960, 2.0))
"""Poses that are added to the map in each round, and how much wider than at first their region is; of several working
modes each has its part."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A way from start to goal: its parts with their proofs (all proved, or the last is not; none where nothing leads
    to the goal's working mode), and intervals used."""

    ways: tuple[Way, ...]
    proofs: tuple[Proof, ...]
    boxes: int

    @property
    def proved(self) -> bool:
        """Whether the whole way is proved."""
        return bool(self.proofs) and all(proof.proved for proof in self.proofs)

    @property
    def margin(self) -> float:
        """The smallest enclosed value along the way."""
        return min(proof.margin for proof in self.proofs)


def plan(readings: tuple[Reading, Reading], region: Region, start: Place, goal: Place, *, seed: int, budget: int
         ) -> Plan:
    """A way between two places in the working modes of two readings, with at most ``budget`` intervals.

    In the first round only those limbs pass their limits that differ; then any that can.
    """
    roads = RoadMap.between(readings, region, start, goal, budget)
    straight = roads.sheets[1] == 0 and roads.proof(0, 1).proved
    if straight:
        return _planned(roads, [0, 1])
    rng = np.random.default_rng(seed)
    limbs = readings[0].chart.limbs
    crossed = [number for number, (limb, other) in enumerate(zip(limbs, readings[1].chart.limbs, strict=True))
               if limb.branch != other.branch]
    able = [number for number, limb in enumerate(limbs)
            if crossing(region.carriage, limb, number, start) is not None]
    if not set(crossed) <= set(able):
        return Plan((), (), roads.spent)
    for size, factor in ROUNDS:
        if roads.spent >= budget:
            break
        tell("road map")
        roads.open(crossed)
        roads.add(region.wider(factor), rng, int(np.ceil(size / np.sqrt(len(roads.readings)))))
        found = roads.way()
        if found is not None:
            return _planned(roads, roads.shortened(found))
        crossed = [int(i) for i in rng.permutation(crossed)] + [i for i in able if i not in crossed]
    return _planned(roads, roads.nearest())


def _planned(roads: RoadMap, way: list[int]) -> Plan:
    proofs = tuple(roads.proof(*road) for road in pairwise(way))
    return Plan(tuple(roads.road(*road) for road in pairwise(way)), proofs, roads.spent)
