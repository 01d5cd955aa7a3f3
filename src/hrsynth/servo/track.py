"""What a run passed: how near it came to Type 2 singularities, and which kinds of singular poses it crossed.

Side by side along the run, the rates of the directions and the twists of the platform are determinants on one tangent
space. Where the first alone changes its sign the run crossed a Type 2 singularity of the hidden robot, where the second
alone does a watched leg passed its limit (Type 1) into another working mode, where both do a leg that is not watched
did.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kinematics.chart import Chart
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.relation import Question
from ..mechanism.vectors import Array
from ..tolerances import DAMPED, INVERTED

TYPE_2, TYPE_1, LIMIT = "type2", "type1", "limit"


@dataclass(frozen=True)
class Passage:
    """A crossing: its kind and the place along the run before which it happened."""

    kind: str
    place: int


@dataclass(frozen=True, eq=False)
class Track:
    """Smallest singular value of Mᵀ at each configuration (n,), NaN where Mᵀ does not exist, and the passages; None
    where the robot has motions that its platform and watched legs do not show, so that no sign is defined."""

    smallest: Array
    passages: tuple[Passage, ...] | None

    def crossings(self, kind: str) -> tuple[Passage, ...]:
        """The passages of one kind."""
        return tuple(each for each in self.passages or () if each.kind == kind)

    def to_dict(self, times: Sequence[float]) -> dict[str, Any]:
        """The record of the command line."""
        seen = np.isfinite(self.smallest)
        least = int(np.nanargmin(self.smallest)) if seen.any() else None
        return {"smallest": None if least is None else float(self.smallest[least]),
                "at": None if least is None else times[least],
                "crossings": None if self.passages is None else [
                    {"kind": each.kind, "time": times[each.place]} for each in self.passages]}


@dataclass(frozen=True, eq=False)
class _Mark:
    """A tangent space (nv, n), and on it the rates of directions (rows, n) and the twists (rows, n)."""

    basis: Array
    rates: Array
    twists: Array

    @property
    def clear(self) -> bool:
        """Whether neither map is singular, so that sides can be told."""
        return all(float(np.linalg.svd(part, compute_uv=False)[-1]) > DAMPED for part in (self.rates, self.twists))

    def smallest(self, dof: int) -> float:
        """The smallest singular value of Mᵀ."""
        left, values, _ = np.linalg.svd(self.twists, full_matrices=False)
        if values[dof - 1] <= INVERTED * values[0]:
            return np.nan
        inverse = np.linalg.pinv(self.twists, rcond=INVERTED) @ left[:, :dof]
        return float(np.linalg.svd(self.rates @ inverse, compute_uv=False)[dof - 1])


def tracked(configurations: Sequence[ClosedConfiguration], question: Question, moving: Question, dof: int) -> Track:
    """The track of a run; ``question`` holds what is observed, ``moving`` everything that counts as motion."""
    marks = [_mark(at, question, moving) for at in configurations]
    smallest = np.array([mark.smallest(dof) for mark in marks])
    if any(mark.basis.shape[1] != dof for mark in marks):
        return Track(smallest, None)
    passages, before = [], np.array([1.0, 1.0])
    here = before.copy()
    for place in range(1, len(marks)):
        here = here * _turned(marks[place - 1], marks[place])
        if marks[place].clear and np.any(here != before):
            rates, twists = here != before
            passages.append(Passage(LIMIT if rates and twists else TYPE_2 if rates else TYPE_1, place))
            before = here.copy()
    return Track(smallest, tuple(passages))


def _mark(at: ClosedConfiguration, question: Question, moving: Question) -> _Mark:
    basis = Chart.around(at, moving).basis
    rows = question.rows(at) @ basis
    return _Mark(basis, rows[question.twist_rows :], rows[: question.twist_rows])


def _turned(a: _Mark, b: _Mark) -> Array:
    """−1 for each of the two maps whose orientation changes between two configurations, else 1."""
    between = b.basis.T @ a.basis
    return np.array([np.sign(np.linalg.det(x.T @ y @ between)) or 1.0
                     for x, y in ((a.rates, b.rates), (a.twists, b.twists))])
