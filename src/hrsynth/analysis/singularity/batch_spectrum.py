"""Mᵀ of many configurations by the batch, with the relation of Pinocchio at random ones of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...batch.configuration_builder import ConfigurationBuilder
from ...errors import Disagreement
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...mechanism.observations.direction import Direction
from ...tolerances import RELATION_ANGLE_TOL
from ..singularity_indices import compute_interaction_matrix

Spectrum = Callable[[Sequence[ClosedConfiguration], ObservationModel], tuple[Array, Array]]
SPECTRUM_CHECKED_POSES_COUNT = 10
"""Number of configurations of each sweep at which the batch is compared with Pinocchio."""


@dataclass(frozen=True, eq=False)
class Quick:
    """Batch for an observation model of directions, one per leg."""

    placer: ConfigurationBuilder
    observation_model: ObservationModel

    @classmethod
    def of(cls, placer: ConfigurationBuilder | None, observation_model: ObservationModel) -> Quick | None:
        """Return the batch, None without one or if other directions are requested."""
        if placer is None or not all(
            isinstance(o, Direction) and o is placer.seen.get(o.leg) for o in observation_model.observations
        ):
            return None
        return cls(placer, observation_model)

    def spectrum(
        self, configurations: Sequence[ClosedConfiguration], others: Spectrum, seed: int = 0
    ) -> tuple[Array, Array]:
        """The smallest and the largest singular value of Mᵀ at each configuration, (n,) each; by ``others`` where one
        is in another working mode than the batch's, or on the edge between two.

        Raises ``Disagreement`` where Pinocchio differs."""
        seen = [o for o in self.observation_model.observations if isinstance(o, Direction)]
        links = (self.observation_model.platform, *(o.link for o in seen))
        X = np.array([at.model.poses(at.q, links) for at in configurations])
        found = self.placer.batch.evaluate(X[:, 0], [o.leg for o in self.observation_model.observations])
        u = np.stack([X[:, i, :3, :3] @ o.direction for i, o in enumerate(seen, 1)], axis=1)
        away = np.where(found.reached, np.max(np.abs(u - found.directions), axis=(1, 2)), np.inf)
        same = away <= RELATION_ANGLE_TOL
        d = found.interaction_matrix.shape[2]
        values = np.zeros((len(X), d))
        values[:, : found.singular_values.shape[1]] = found.singular_values
        here = np.flatnonzero(same)
        for i in np.random.default_rng(seed).choice(here, min(SPECTRUM_CHECKED_POSES_COUNT, len(here)), replace=False):
            self._check(configurations[int(i)], values[i])
        smallest, largest = values[:, -1].copy(), values[:, 0].copy()
        if not same.all():
            elsewhere = [configurations[int(i)] for i in np.flatnonzero(~same)]
            smallest[~same], largest[~same] = others(elsewhere, self.observation_model)
        return smallest, largest

    def _check(self, at: ClosedConfiguration, values: Array) -> None:
        theirs = compute_relation(at, self.observation_model)
        M = compute_interaction_matrix(theirs)
        if M is None or theirs.dof.value != len(values):
            return
        expected = np.zeros(len(values))
        found = np.linalg.svd(M, compute_uv=False)
        expected[: len(found)] = found
        apart = float(np.max(np.abs(expected - values)))
        if apart > RELATION_ANGLE_TOL * max(1.0, float(values[0])):
            raise Disagreement(self.placer.model.mechanism.name, 1, apart)
