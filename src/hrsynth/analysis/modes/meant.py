"""Special geometry that is meant: joint centres that coincide but for rounding are made one (theory 9).

Counting the digits as they stand would count the general case, with solutions near infinity or near each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ...errors import MeaningUndecided
from ...tolerances import MEANT, RANK_GAP
from .curves import Sphere
from .spatial import Spatial
from .systems import System


@dataclass(frozen=True)
class Meant:
    """Joint centres of some legs (their places among all) that were made one: on the ``platform`` or the ``base``, and
    how far the one that was farthest from the others was (m)."""

    where: str
    legs: tuple[int, ...]
    defect: float

    def to_dict(self, labels: tuple[str, ...]) -> dict[str, Any]:
        """The record of the command line."""
        return {"where": self.where, "legs": [labels[k] for k in self.legs], "defect_m": self.defect}


def as_meant(system: System) -> tuple[System, tuple[Meant, ...]]:
    """A system with what is meant made exact, and what that is; its error grows by what was moved.

    Coinciding counts as meant where the largest distance accepted (at most ``MEANT`` sizes) is below the smallest one
    rejected by ``RANK_GAP``; raises ``MeaningUndecided`` where it lies in between.
    """
    if system.as_written or not isinstance(system, Spatial):
        return system, ()
    spheres = [k for k, curve in enumerate(system.curves) if isinstance(curve, Sphere)]
    points = {"platform": dict(enumerate(system.tips)), "base": {k: system.curves[k].centre for k in spheres}}
    apart = [(float(np.linalg.norm(at[i] - at[j])), where, i, j)
             for where, at in points.items() for i, j in combinations(at, 2)]
    accepted = [each for each in apart if each[0] <= MEANT * system.size]
    largest = max((each[0] for each in accepted), default=0.0)
    smallest = min((each[0] for each in apart if each not in accepted), default=np.inf)
    if largest * RANK_GAP > smallest:
        raise MeaningUndecided("joint centres that may be meant to be one", largest / system.size,
                               smallest / system.size, RANK_GAP)
    if largest == 0.0:
        return system, ()
    tips, curves, told = system.tips.copy(), list(system.curves), []
    for where, at in points.items():
        for group in _groups([(i, j) for _, side, i, j in accepted if side == where]):
            middle = np.mean([at[k] for k in group], axis=0)
            defect = max(d for d, side, i, _ in accepted if side == where and i in group)
            if defect > 0:
                told.append(Meant(where, group, defect))
            for k in group:
                if where == "platform":
                    tips[k] = middle
                else:
                    curves[k] = replace(curves[k], centre=middle)
    return replace(system, tips=tips, curves=tuple(curves), error=system.error + largest), tuple(told)


def _groups(pairs: list[tuple[int, int]]) -> list[tuple[int, ...]]:
    """Those that are joined by pairs, together."""
    groups: list[set[int]] = []
    for pair in pairs:
        joined = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in joined] + [set(pair).union(*joined)]
    return [tuple(sorted(group)) for group in groups]
