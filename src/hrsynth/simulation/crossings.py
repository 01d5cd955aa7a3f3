"""Singularities along a run: the smallest distance to a Type 2 singularity, and the singularities that the run crosses.

On one tangent space the rates of the directions and the twists of the platform are determinants. They are compared at
successive configurations. If only the first changes its sign, the run crosses a Type 2 singularity of the hidden robot.
If only the second does, an observed leg passes a Type 1 singularity into another working mode. If both do, an
unobserved leg does so. If the loop constraints change their sign, the run crosses a constraint singularity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..kinematics.chart import TangentChart
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.velocity_relation import ObservationModel
from ..records import Number
from ..results import Value
from ..tolerances import CONTROLLER_DAMPING_MIN, PSEUDOINVERSE_CUTOFF_FRACTION

TYPE_2, TYPE_1, LIMIT, CONSTRAINT = "type2", "type1", "limit", "constraint"
LOOP_MAP_INDEX = 2
"""Index of the loops among the three maps."""


@dataclass(frozen=True)
class RunCrossing:
    """Singularity crossed by a run. ``place`` is the first configuration on the far side; sides are compared at regular
    configurations."""

    kind: str
    place: int


class RunCrossingRecord(NamedTuple):
    """Singularity crossed by the run, and its time (s)."""

    kind: str
    time: float


class TrackRecord(NamedTuple):
    """Smallest singular value along the run, its time (s), and the crossings."""

    smallest: Number
    at: Number
    crossings: list[RunCrossingRecord] | None


@dataclass(frozen=True, eq=False, repr=False)
class SingularityTrack(Value):
    """Smallest singular value of Mᵀ at each configuration (n,), NaN where Mᵀ does not exist, and the crossings; None if
    motions of the robot change neither platform nor observed legs, so that no sign is defined."""

    smallest: Array
    passages: tuple[RunCrossing, ...] | None

    def crossings(self, kind: str) -> tuple[RunCrossing, ...]:
        """Return the crossings of one kind."""
        return tuple(each for each in self.passages or () if each.kind == kind)

    def timed(self, times: Array) -> TrackRecord:
        """Return the smallest singular value and the crossings with their times (n,)."""
        passed = [RunCrossingRecord(each.kind, times[each.place]) for each in self.passages or ()]
        crossings = None if self.passages is None else passed
        if not np.isfinite(self.smallest).any():
            return TrackRecord(None, None, crossings)
        least = int(np.nanargmin(self.smallest))
        return TrackRecord(self.smallest[least], times[least], crossings)


@dataclass(frozen=True, eq=False)
class _Mark:
    """Tangent space (nv, n) of a configuration: the rates of directions (rows, n) and the twists (rows, n) on it, the
    loop rows (rows, nv) with a basis of their range, and their smallest singular value relative to the largest."""

    basis: Array
    rates: Array
    twists: Array
    loops: Array
    span: Array
    weakest: float

    @cached_property
    def least(self) -> Array:
        """Smallest singular values (3,) of rates, twists and loops (a part of the largest)."""
        return np.array(
            [*(np.linalg.svd(each, compute_uv=False)[-1] for each in (self.rates, self.twists)), self.weakest]
        )

    def smallest(self, dof: int) -> float:
        """Smallest singular value of Mᵀ."""
        left, values, _ = np.linalg.svd(self.twists, full_matrices=False)
        if len(values) < dof or values[dof - 1] <= PSEUDOINVERSE_CUTOFF_FRACTION * values[0]:
            return np.nan
        inverse = np.linalg.pinv(self.twists, rcond=PSEUDOINVERSE_CUTOFF_FRACTION) @ left[:, :dof]
        return float(np.linalg.svd(self.rates @ inverse, compute_uv=False)[dof - 1])


def track_run(
    configurations: Sequence[ClosedConfiguration],
    observation_model: ObservationModel,
    moving: ObservationModel,
    dof: int,
) -> SingularityTrack:
    """Track the singularities of a run; ``moving`` has all motions that count."""
    marks = [_mark(at, observation_model, moving) for at in configurations]
    smallest = np.array([mark.smallest(dof) for mark in marks])
    if any(mark.basis.shape[1] != dof for mark in marks):
        return SingularityTrack(smallest, None)
    passages: list[RunCrossing] = []
    before = np.ones(3)
    here, last = before.copy(), np.zeros(3, dtype=int)
    # of each map the last mark at which its sign is more than rounding, and how the tangent space has turned since then
    known, since = [0, 0, 0], np.ones(3)
    for place in range(1, len(marks)):
        since = since * _sign(marks[place].basis.T @ marks[place - 1].basis)
        for i in np.flatnonzero(marks[place].least > PSEUDOINVERSE_CUTOFF_FRACTION):
            turned = _turned_maps(marks[known[i]], marks[place])[i] * (1.0 if i == LOOP_MAP_INDEX else since[i])
            here[i], last[i] = here[i] * turned, place if turned < 0 else last[i]
            known[i], since[i] = place, 1.0
        # where no map is singular, the sides can be compared
        if np.all(marks[place].least > CONTROLLER_DAMPING_MIN) and np.any(here != before):
            rates, twists, loops = here != before
            if loops:
                passages.append(RunCrossing(CONSTRAINT, int(last[2])))
            if rates or twists:
                passages.append(
                    RunCrossing(
                        LIMIT if rates and twists else TYPE_2 if rates else TYPE_1,
                        int(np.where(here != before, last, 0)[:2].max()),
                    )
                )
            before = here.copy()
    return SingularityTrack(smallest, tuple(passages))


def _mark(at: ClosedConfiguration, observation_model: ObservationModel, moving: ObservationModel) -> _Mark:
    basis = TangentChart.around(at, moving).basis
    rows = observation_model.rows(at) @ basis
    loops = at.model.jacobian(at.q)
    return _Mark(
        basis,
        rows[observation_model.twist_rows :],
        rows[: observation_model.twist_rows],
        loops,
        compute_range_basis(loops)[0],
        at.kernel()[1].weakest,
    )


def _turned_maps(a: _Mark, b: _Mark) -> Array:
    """−1 for each of the three maps whose orientation changes between two configurations, else 1: of rates and twists
    up to the turn of the tangent space."""
    return np.array(
        [_sign(a.rates.T @ b.rates), _sign(a.twists.T @ b.twists), _sign(a.span.T @ a.loops @ b.loops.T @ a.span)]
    )


def _sign(matrix: Array) -> float:
    """Return the sign of a determinant, 1 if it is zero."""
    return float(np.linalg.slogdet(matrix)[0]) or 1.0
