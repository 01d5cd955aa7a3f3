"""The relation ρ between the platform's twist and the rates of what is observed (theory 1; MMT eq. 7 where it is a graph)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..mechanism.observation import Observation
from ..mechanism.vectors import Array
from .configuration import ClosedConfiguration, Target
from .ranks import Rank, kernel_basis, range_basis


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked of a mechanism: the twist t of ``platform`` (of its origin alone where ``point``) and the rates of
    ``observations`` seen from ``reference``; ``bodies`` are further links whose twists count too."""

    platform: str
    point: bool
    reference: str
    observations: tuple[Observation, ...]
    bodies: tuple[str, ...] = ()

    @property
    def twist_rows(self) -> int:
        """Rows of t: 3 for a point body, else 6."""
        return 3 if self.point else 6

    def target(self, at: ClosedConfiguration) -> Target:
        """The platform pose and the measured values of a configuration."""
        X_reference = at.pose(self.reference)
        return Target(self.platform, at.pose(self.platform), self.point, self.reference,
                      tuple((o, o.value(X_reference, at.pose(o.link))) for o in self.observations))

    def rows(self, at: ClosedConfiguration, *, blind: frozenset[str] = frozenset()) -> Array:
        """The map from joint rates to (t, measured rates, twists of ``bodies``), shape (rows, nv); links in ``blind``
        are not in the mechanism, their rates are zero."""
        V = at.velocity(self.platform)
        parts = [V[: self.twist_rows]]
        X_reference, V_reference = at.pose(self.reference), at.velocity(self.reference)
        for observation in self.observations:
            if observation.link in blind:
                parts.append(np.zeros((3, at.twin.nv)))
            else:
                parts.append(observation.rate(X_reference, at.pose(observation.link), V_reference,
                                              at.velocity(observation.link)))
        parts.extend(at.velocity(body) for body in self.bodies)
        return np.vstack(parts)


@dataclass(frozen=True, eq=False)
class Relation:
    """ρ(q) as an orthonormal basis (rows: t, then measured rates, then bodies), with mobility and the smallest gap."""

    basis: Array
    twist_rows: int
    measured_rows: int
    mobility: int
    gap: float

    @property
    def dimension(self) -> int:
        """dim ρ."""
        return self.basis.shape[1]

    def _twists(self) -> Array:
        return self.basis[: self.twist_rows]

    def _rates(self) -> Array:
        return self.basis[self.twist_rows : self.twist_rows + self.measured_rows]

    @cached_property
    def dof(self) -> Rank:
        """dim of the platform's twists: the robot's dof."""
        return range_basis(self._twists(), 1.0)[1]

    @cached_property
    def twists(self) -> Array:
        """An orthonormal basis of the platform's twists."""
        return range_basis(self._twists(), 1.0)[0]

    @cached_property
    def lost(self) -> Array:
        """A basis of {t : (t, 0) ∈ ρ}, the twists that no observation sees, shape (twist rows, RO)."""
        kernel, _ = kernel_basis(self._rates(), 1.0)
        return range_basis(self._twists() @ kernel, 1.0)[0]

    @cached_property
    def unexplained(self) -> int:
        """RI = dim {u̇ : (0, u̇) ∈ ρ}: where it is not zero, Mᵀ does not exist."""
        kernel, _ = kernel_basis(self._twists(), 1.0)
        return range_basis(self._rates() @ kernel, 1.0)[1].value

    @cached_property
    def rank(self) -> int:
        """Freedoms of the platform that the observations see: dof − RO."""
        return self.dof.value - self.lost.shape[1]


def relation(at: ClosedConfiguration, question: Question, *, blind: frozenset[str] = frozenset()) -> Relation:
    """ρ at a closed configuration."""
    kernel, constraints = at.kernel()
    basis, rank = range_basis(question.rows(at, blind=blind) @ kernel, 1.0)
    measured = 3 * len(question.observations)
    result = Relation(basis, question.twist_rows, measured, kernel.shape[1], min(constraints.gap, rank.gap))
    return result
