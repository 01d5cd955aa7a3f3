"""Random instances of every family: how many modes are complex, how many real at most, how near the goal is listed.

``python -m analysis.modes.bounds 10000`` (from ``tests/``) prints the table for as many instances a family; further
arguments name families.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass

from analysis.modes.draws import FAMILIES
from analysis.modes.laws import among, draw
from hrsynth.solving.platform.solve import solve

GOAL = 1e-10
"""Distance at which the pose that generated the directions is among the modes."""


@dataclass(frozen=True)
class Seen:
    """What was seen in the instances of one family; seeds are listed where something is wrong."""

    instances: int
    real: Counter[int]
    """How often there were so many real modes."""
    seed: int
    """An instance with the largest number of real modes."""
    over: tuple[int, ...]
    """More complex modes than the family has, or fewer."""
    unproved: tuple[int, ...]
    far: tuple[int, ...]
    """The goal is farther than ``GOAL`` from every mode, and than a hundred radii of the modes' enclosures."""
    ill: tuple[int, ...]
    """The goal is farther than ``GOAL``, but within what the enclosures allow: a nearly singular pose."""

    @property
    def most(self) -> int:
        return max(self.real)


def seen(name: str, seeds: range) -> Seen:
    """All instances of a family."""
    real, first, wrong = Counter[int](), dict[int, int](), {key: [] for key in ("over", "unproved", "far", "ill")}
    for seed in seeds:
        system, goal = draw(name, seed)
        found = solve(system)
        count = len(found.modes)
        real[count] += 1
        first.setdefault(count, seed)
        apart = among(goal, found)
        allowed = max(GOAL, 100 * max((mode.radius for mode in found.modes), default=0.0))
        flags = {
            "over": found.complex != FAMILIES[name].count or count > FAMILIES[name].count,
            "unproved": not found.complete,
            "far": apart >= allowed,
            "ill": GOAL <= apart < allowed,
        }
        for key, flag in flags.items():
            wrong[key] += [seed] if flag else []
    lists = {key: tuple(seeds) for key, seeds in wrong.items()}
    return Seen(len(seeds), real, first[max(real)], **lists)


def row(name: str, result: Seen) -> str:
    """One line of the table."""
    shares = ", ".join(f"{count}: {times}" for count, times in sorted(result.real.items()))
    cells = (
        name,
        FAMILIES[name].count,
        result.most,
        result.seed,
        shares,
        len(result.over),
        len(result.unproved),
        len(result.far),
        len(result.ill),
    )
    return f"| {' | '.join(map(str, cells))} |"


HEADS = (
    "family",
    "complex",
    "most real",
    "seed",
    "instances with so many real modes",
    "other counts",
    "unproved",
    "goal missing",
    "goal ill-conditioned",
)

if __name__ == "__main__":
    size, names = int(sys.argv[1]), sys.argv[2:] or sorted(FAMILIES)
    print(f"| {' | '.join(HEADS)} |\n|{' --- |' * len(HEADS)}")
    for each in names:
        print(row(each, seen(each, range(size))), flush=True)
