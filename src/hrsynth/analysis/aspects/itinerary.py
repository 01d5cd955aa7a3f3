"""Ways through several working modes: road maps in each, joined where a leg passes its limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice, permutations

import numpy as np

from .crossing import Crossing, crossing
from .plan import DRAWS, Place, Plan, Region, plan
from .proof import Proof, Reading, prove

ORDERS = 6
"""Orders of legs that are tried, at most."""
POSES = 60
"""Poses near a leg's limit at which a crossing is tried, at most."""
CROSSINGS = 4
"""Proved crossings to which a way is sought, at most."""


def itinerary(readings: tuple[Reading, Reading], region: Region, start: Place, goal: Place, *, seed: int, budget: int,
              progress: Callable[[], None] | None = None) -> Plan | None:
    """A proved way between two places in the working modes of two readings, or None; each limb that differs passes its
    limit once."""
    modes = [reading.chart.modes for reading in readings]
    apart = [number for number, (a, b) in enumerate(zip(*modes, strict=True)) if a != b]
    spent = 0
    for order in islice(permutations(apart), ORDERS):
        if spent >= budget:
            break
        here, reading, whole = start, readings[0], Plan((), (), 0)
        for limb in order:
            step = _step(reading, limb, region, here, seed, budget - spent, progress)
            spent += step.boxes
            if not step.proved or not step.ways:
                break
            whole, here = _joined(whole, step), step.ways[-1].end
            reading = replace(reading, chart=reading.chart.flipped(limb))
        else:
            assert reading.chart.modes == modes[1]
            last = plan(reading, region, here, goal, seed=seed, budget=budget - spent, progress=progress)
            spent += last.boxes
            if last.proved:
                return replace(_joined(whole, last), boxes=spent)
    return None


def _step(reading: Reading, limb: int, region: Region, here: Place, seed: int, budget: int,
          progress: Callable[[], None] | None) -> Plan:
    """A proved way from a place to a limit of a limb and through it; without ways where none is found."""
    spent = 0
    for across, proof in islice(_crossings(reading, limb, region, here, seed, budget), CROSSINGS):
        spent += proof.boxes
        way = plan(reading, region, here, across.end, seed=seed, budget=budget - spent, progress=progress)
        spent += way.boxes
        if way.proved:
            return Plan((*way.ways, across), (*way.proofs, proof), spent)
        if spent >= budget:
            break
    return Plan((), (), spent)


def _crossings(reading: Reading, limb: int, region: Region, here: Place, seed: int, budget: int
               ) -> Iterator[tuple[Crossing, Proof]]:
    """Proved crossings of a limb at random poses on the side of a place, those nearest to its limit first."""
    side = np.sign(reading.at(here[0][None], here[1][None])[1][0])
    other = replace(reading, chart=reading.chart.flipped(limb))
    p, R = region.draw(np.random.default_rng(seed), DRAWS * POSES)
    (reached, values), (_, beyond) = reading.at(p, R), other.at(p, R)
    near = np.flatnonzero(reached & (np.sign(values) == side) & (np.sign(beyond) == side))
    order = np.argsort(reading.chart.at(p[near], R[near]).reserves[:, limb], kind="stable")
    for i in near[order][:POSES]:
        found = crossing(region.carriage, reading.chart.limbs[limb], limb, (p[i], R[i]))
        proof = None if found is None else prove(reading, found, budget)
        if found is not None and proof is not None and proof.proved:
            yield found, proof


def _joined(one: Plan, two: Plan) -> Plan:
    return Plan(one.ways + two.ways, one.proofs + two.proofs, one.boxes + two.boxes)
