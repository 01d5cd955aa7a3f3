"""Outcomes of single runs, and comparison of outcomes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array, compare_poses
from ...results import Value
from ...tolerances import RUN_END_DIFFERENCE_TOL
from ..outcome import BOUNDARY, RunOutcome
from .attraction_radius import AttractionRadius
from .flow import Flags, Places


@dataclass(frozen=True, eq=False, repr=False)
class Outcome(Value):
    """Outcome of a run that was simulated separately; if it converged, the platform's pose X (4, 4) and ‖e‖."""

    ending: RunOutcome
    X: Array | None = None
    size: float = np.inf

    def is_same_outcome(self, other: Outcome, length: float) -> bool:
        """Return True if two runs have the same outcome: one pose, or one reason."""
        if self.X is None or other.X is None or self.ending.name != other.ending.name:
            said = [
                (each.ending.name, each.ending.reason if each.ending.name == BOUNDARY else "", each.X is None)
                for each in (self, other)
            ]
            return said[0] == said[1]
        return compare_poses(self.X, other.X, length) <= RUN_END_DIFFERENCE_TOL


@dataclass(frozen=True, eq=False)
class OutcomeCount:
    """The outcomes of starts (n,) by their numbers; X (n, 4, 4) are the platform's poses there."""

    outcomes: list[Outcome]
    cells: Places
    damped: Flags
    X: Array
    followed: int = 0
    checked: int = 0
    agreed: int = 0
    certified: AttractionRadius | None = None


class Outcomes:
    """Distinct outcomes."""

    def __init__(self, length: float) -> None:
        self.all: list[Outcome] = []
        self.length = length

    def number(self, outcome: Outcome) -> int:
        """The number of an outcome, a new one if need be."""
        for number, each in enumerate(self.all):
            if each.is_same_outcome(outcome, self.length):
                return number
        self.all.append(outcome)
        return len(self.all) - 1
