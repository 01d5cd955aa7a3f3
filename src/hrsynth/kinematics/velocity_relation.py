"""Velocity relation ρ between the platform's twist and the rates of the observations.

Source: docs/pages/theory.md, section 2; as a graph, MMT eq. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..geometry.ranks import Rank, compute_matrix_spectra, compute_range_bases, compute_range_basis
from ..geometry.screws import compute_point_velocity
from ..geometry.vectors import Array
from ..mechanism.observation import Observation
from ..results import Value
from ..tolerances import PSEUDOINVERSE_CUTOFF_FRACTION
from .configuration import ClosedConfiguration, measure, measure_together
from .tasks import PoseAndValuesTask


@dataclass(frozen=True, eq=False, repr=False)
class ObservationModel(Value):
    """Observation model of a mechanism: the twist t of ``platform`` and the rates of ``observations`` from
    ``reference``; ``bodies`` are further links whose twists count too. In a formation t is the twists of the platform
    and of ``others``, one below the other.

    If ``point`` is given, t is the velocity of that point alone, in the platform's frame (a point body).
    """

    platform: str
    point: Array | None
    reference: str
    observations: tuple[Observation, ...]
    bodies: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    @property
    def twist_rows(self) -> int:
        """Rows of t: 3 for a point body, else 6 for each link."""
        return 6 * (1 + len(self.others)) if self.point is None else 3

    @property
    def of_platform(self) -> ObservationModel:
        """Model of the platform's own twist alone, nothing observed."""
        return replace(self, observations=(), bodies=(), others=())

    def target(self, at: ClosedConfiguration) -> PoseAndValuesTask:
        """Return the platform pose and the measured values of a configuration."""
        X, _, values, _ = measure(at.model, at.q, self.reference, self.observations, (self.platform,))
        return PoseAndValuesTask(
            self.platform, X[0], self.point, self.reference, tuple(zip(self.observations, values, strict=True))
        )

    def targets(self, at: Sequence[ClosedConfiguration]) -> list[PoseAndValuesTask]:
        """Return :meth:`target` of several configurations of one model."""
        *_, X, _, values, _ = measure_together(
            at[0].model, [each.q for each in at], self.reference, self.observations, (self.platform,)
        )
        ends = np.cumsum(self.sizes, dtype=int)
        return [
            PoseAndValuesTask(
                self.platform,
                x[0],
                self.point,
                self.reference,
                tuple(zip(self.observations, np.split(own, ends)[:-1], strict=True)),
            )
            for x, own in zip(X, values, strict=True)
        ]

    def rows(self, at: ClosedConfiguration, *, blind: frozenset[str] = frozenset()) -> Array:
        """Return the map from joint rates to (t, measured rates, twists of ``bodies``), shape (rows, nv); links in
        ``blind`` are not in the mechanism, their rates are zero."""
        seen = tuple(o for o in self.observations if o.link not in blind)
        X, V, _, rates = measure(at.model, at.q, self.reference, seen, (self.platform, *self.others, *self.bodies))
        found, own = iter(rates), 1 + len(self.others)
        parts = (
            [*V[:own]]
            if self.point is None
            else [compute_point_velocity(V[0], X[0][:3, :3] @ self.point / at.model.length)]
        )
        parts += [np.zeros((o.size, at.model.nv)) if o.link in blind else next(found) for o in self.observations]
        return np.vstack([*parts, *V[own:]])

    def rows_together(self, at: Sequence[ClosedConfiguration], blind: frozenset[str] = frozenset()) -> list[Array]:
        """Return :meth:`error_and_jacobian` at several configurations of one model."""
        if len(at) < 2:
            return [self.rows(each, blind=blind) for each in at]
        model, links = at[0].model, (self.platform, *self.others, *self.bodies)
        seen = [o for o in self.observations if o.link not in blind]
        *_, X, V, _, rates = measure_together(model, [each.q for each in at], self.reference, seen, links)
        own, n = 1 + len(self.others), len(at)
        t = (
            V[:, :own].reshape(n, -1, model.nv)
            if self.point is None
            else np.array(
                [
                    compute_point_velocity(v, x[:3, :3] @ self.point / model.length)
                    for v, x in zip(V[:, 0], X[:, 0], strict=True)
                ]
            )
        )
        if len(seen) < len(self.observations):
            shown = np.repeat([o.link not in blind for o in self.observations], self.sizes)
            rates, some = np.zeros((n, len(shown), model.nv)), rates
            rates[:, shown] = some
        return list(np.concatenate([t, rates, V[:, own:].reshape(n, -1, model.nv)], axis=1))

    @property
    def sizes(self) -> tuple[int, ...]:
        """Rows of each observation."""
        return tuple(o.size for o in self.observations)

    @property
    def size(self) -> int:
        """Number of rows of ρ."""
        return self.twist_rows + sum(self.sizes) + 6 * len(self.bodies)


class _UnobservedMotion(NamedTuple):
    """Motion in ρ that one side of it does not show."""

    twists: Array
    RO: Rank
    seen: Rank
    RI: int


@dataclass(frozen=True, eq=False, repr=False)
class VelocityRelation(Value):
    """ρ(q) as an orthonormal basis (rows: t, then measured rates, then bodies), with mobility and the smallest gap."""

    basis: Array
    twist_rows: int
    sizes: tuple[int, ...]
    """Rows of each observation's rate."""
    mobility: int
    gap: float

    @property
    def dimension(self) -> int:
        """dim ρ."""
        return self.basis.shape[1]

    @property
    def twist_part(self) -> Array:
        """The rows of t, shape (twist rows, dim ρ)."""
        return self.basis[: self.twist_rows]

    @property
    def rates(self) -> Array:
        """The rows of the measured rates, shape (measured rows, dim ρ)."""
        return self.basis[self.twist_rows : self.twist_rows + sum(self.sizes)]

    def rows_of(self, place: int) -> slice:
        """The rows of one observation's rate in ``basis``."""
        start = self.twist_rows + sum(self.sizes[:place])
        return slice(start, start + self.sizes[place])

    def select(self, places: Sequence[int]) -> VelocityRelation:
        """Return ρ for some of the observations: the projection of ρ for all."""
        return select_observations([self], places)[0]

    @cached_property
    def _platform(self) -> tuple[Array, Rank]:
        return compute_range_basis(self.twist_part, 1.0)

    @property
    def dof(self) -> Rank:
        """dim of the platform's twists: the robot's dof."""
        return self._platform[1]

    @property
    def twists(self) -> Array:
        """An orthonormal basis of the platform's twists."""
        return self._platform[0]

    @cached_property
    def _unobserved(self) -> _UnobservedMotion:
        return _find_unobserved_motions([self])[0]

    @property
    def seen(self) -> Rank:
        """Rank of the measured rates on ρ: it decides which twists are unobserved."""
        return self._unobserved.seen

    @property
    def unobserved_twists(self) -> Array:
        """Basis of {t : (t, 0) ∈ ρ}, the unobserved twists, shape (twist rows, RO)."""
        return self._unobserved.twists

    @property
    def RO(self) -> Rank:
        """RO = dim {t : (t, 0) ∈ ρ}, with its gap."""
        return self._unobserved.RO

    @property
    def RI(self) -> int:
        """RI = dim {u̇ : (0, u̇) ∈ ρ}: where it is not zero, Mᵀ does not exist."""
        return self._unobserved.RI

    @cached_property
    def rank(self) -> int:
        """Platform dof that the observations show: dof − RO."""
        return self.dof.value - self.unobserved_twists.shape[1]


def select_observations(relations: Sequence[VelocityRelation], places: Sequence[int]) -> list[VelocityRelation]:
    """Return several ρ for some of the observations."""
    rows = [np.vstack([rho.twist_part, *(rho.basis[rho.rows_of(place)] for place in places)]) for rho in relations]
    return [
        VelocityRelation(
            basis, rho.twist_rows, tuple(rho.sizes[i] for i in places), rho.mobility, min(rho.gap, rank.gap)
        )
        for rho, (basis, rank) in zip(relations, compute_range_bases(rows, 1.0), strict=True)
    ]


def decompose_relations(relations: Sequence[VelocityRelation]) -> None:
    """Compute the unobserved motions of several relations together, which costs less than one by one."""
    for rho, motion in zip(relations, _find_unobserved_motions(relations), strict=True):
        rho.__dict__["_unobserved"] = motion


def _find_unobserved_motions(relations: Sequence[VelocityRelation]) -> list[_UnobservedMotion]:
    """Return the unobserved twists of each relation, and what moves while the platform is fixed."""
    still = compute_matrix_spectra([rho.rates for rho in relations], 1.0)
    twists = compute_range_bases([rho.twist_part @ at.kernel for rho, at in zip(relations, still, strict=True)], 1.0)
    fixed = compute_matrix_spectra([rho.twist_part for rho in relations], 1.0)
    rates = compute_range_bases([rho.rates @ at.kernel for rho, at in zip(relations, fixed, strict=True)], 1.0)
    return [
        _UnobservedMotion(basis, Rank(rank.value, min(rank.gap, at.rank.gap)), at.rank, free.value)
        for at, (basis, rank), (_, free) in zip(still, twists, rates, strict=True)
    ]


def compute_platform_motions(at: ClosedConfiguration, observation_model: ObservationModel) -> Array:
    """Return joint velocities (nv, dof), without internal motions, that move the platform by an orthonormal basis of
    its twists (characteristic lengths)."""
    kernel, _ = at.kernel()
    image = observation_model.rows(at)[: observation_model.twist_rows] @ kernel
    moves, _ = compute_range_basis(image, 1.0)
    return np.asarray(kernel @ np.linalg.lstsq(image, moves, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0])


def compute_relation(
    at: ClosedConfiguration, observation_model: ObservationModel, *, blind: frozenset[str] = frozenset()
) -> VelocityRelation:
    """ρ at a closed configuration."""
    return compute_relations([at], observation_model, [observation_model.rows(at, blind=blind)])[0]


def compute_relations(
    at: Sequence[ClosedConfiguration], observation_model: ObservationModel, rows: Sequence[Array]
) -> list[VelocityRelation]:
    """Return ρ at several closed configurations of one model, from the rows that the observation model has there."""
    return _compute_relations(at, rows, observation_model.twist_rows, observation_model.sizes)


def compute_relation_of_rows(
    at: ClosedConfiguration, observation_model: ObservationModel, rows: Array
) -> VelocityRelation:
    """Return ρ between the platform's twist and ``rows`` (measured, nv) of the joint rates, each a measured value of
    its own: the motors' coordinates, for one."""
    twist = replace(observation_model, observations=(), bodies=()).rows(at)
    return _compute_relations([at], [np.vstack([twist, rows])], observation_model.twist_rows, (1,) * len(rows))[0]


def _compute_relations(
    at: Sequence[ClosedConfiguration], rows: Sequence[Array], twist_rows: int, sizes: tuple[int, ...]
) -> list[VelocityRelation]:
    kernels = [each.kernel() for each in at]
    bases = compute_range_bases([moved @ kernel for moved, (kernel, _) in zip(rows, kernels, strict=True)], 1.0)
    return [
        VelocityRelation(basis, twist_rows, sizes, kernel.shape[1], min(constraints.gap, rank.gap))
        for (kernel, constraints), (basis, rank) in zip(kernels, bases, strict=True)
    ]
