"""The curve of singular poses in a plane where no expression of the condition has a sign.

Between two poses of the plane the smallest singular value passes through zero where its two vectors, σ u = M v,
followed from one pose to the other come back with opposite signs. Such edges of the grid are halved until the value
there is small beside that at their ends; an isolated singular pose next to an edge turns the vectors too, but leaves
the value as large as the edge is away from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...batch.pose_continuation import track_to_request
from ...errors import PoseReachFailure, UndefinedValue
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism.pose import Grid
from .rank_descent import measure_twists

HALVINGS, LEFT, FALLS = 6, 0.1, 0.75
"""Largest number of bisections of an edge, and the fractions of the end values that may remain: at the end, and in the
middle (half for a linear change)."""


@dataclass(frozen=True, eq=False)
class _Weakest:
    """The smallest singular value of M at a place of the plane (2,), and its vectors."""

    at: ClosedConfiguration
    place: Array
    sigma: float
    u: Array
    v: Array

    def has_zero_before(self, other: _Weakest) -> bool:
        """Return True if the value passes through zero on the path to another pose, where the vectors change little."""
        return float(self.u @ other.u) * float(self.v @ other.v) < 0


@dataclass(frozen=True)
class PlaneOfPoses:
    """A grid of poses and what is measured at them."""

    observation_model: ObservationModel
    motion: PlatformMotion
    grid: Grid

    def curve(self, configurations: Sequence[ClosedConfiguration | None]) -> Array:
        """Pieces (k, 2, 2) of the curve, from edge to edge of a cell, by the two coordinates that vary."""
        (_, x), (_, y) = self.grid.axes
        weak = {
            cell: found
            for cell, at in zip(np.ndindex(len(x), len(y)), configurations, strict=True)
            if at is not None and (found := self._weakest(at, np.array([x[cell[0]], y[cell[1]]]))) is not None
        }
        crossed: dict[tuple[int, int, int], Array] = {}
        for (i, j), one in weak.items():
            for along, beside in enumerate(((i + 1, j), (i, j + 1))):
                other = weak.get(beside)
                place = None if other is None or not one.has_zero_before(other) else self._zero(one, other)
                if place is not None:
                    crossed[i, j, along] = place
        pieces: list[Any] = []
        for i, j in np.ndindex(len(x) - 1, len(y) - 1):
            ends = [crossed[edge] for edge in ((i, j, 0), (i, j, 1), (i + 1, j, 1), (i, j + 1, 0)) if edge in crossed]
            pieces += [ends[k : k + 2] for k in range(0, len(ends) - 1, 2)]
        return np.array(pieces).reshape(-1, 2, 2)

    def _weakest(self, at: ClosedConfiguration, place: Array) -> _Weakest | None:
        try:
            U, sizes, V = np.linalg.svd(measure_twists(at, self.observation_model), full_matrices=False)
        except UndefinedValue:
            return None
        return _Weakest(at, place, float(sizes[-1]), U[:, -1], V[-1])

    def _zero(self, one: _Weakest, other: _Weakest) -> Array | None:
        """Return the zero of the value between two poses; None without one."""
        least = LEFT * max(one.sigma, other.sigma)
        for _ in range(HALVINGS):
            if max(one.sigma, other.sigma) <= least:
                break
            middle = self._between(one, other)
            if middle is None or middle.sigma > FALLS * max(one.sigma, other.sigma):
                return None
            one, other = (one, middle) if one.has_zero_before(middle) else (middle, other)
        if max(one.sigma, other.sigma) > least or not one.has_zero_before(other):
            return None
        part = one.sigma / (one.sigma + other.sigma) if one.sigma + other.sigma > 0 else 0.5
        return np.asarray(one.place + part * (other.place - one.place))

    def _between(self, one: _Weakest, other: _Weakest) -> _Weakest | None:
        place = (one.place + other.place) / 2
        try:
            at = track_to_request(one.at, self.observation_model, self.grid.request(place.tolist()), self.motion)
        except PoseReachFailure:
            return None
        return self._weakest(at, place)
