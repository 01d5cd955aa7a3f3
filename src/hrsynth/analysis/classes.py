"""Kinds of singularities: Zlatanov's six counts, relative to their generic values (theory 4)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..geometry.ranks import range_basis
from ..geometry.vectors import Array
from ..kinematics.relation import Relation


@dataclass(frozen=True)
class Counts:
    """Dimensions at one configuration: mobility, ρ, its projections on t and on the rates, RO, RI."""

    mobility: int
    relation: int
    dof: int
    seen: int
    unseen: int
    unexplained: int

    @classmethod
    def of(cls, found: Relation) -> Counts:
        """The counts of a relation."""
        seen = range_basis(found.rates, 1.0)[1].value
        return cls(found.mobility, found.dimension, found.dof.value, seen, found.lost_rank.value, found.unexplained)


def generic(counts: Sequence[Counts]) -> Counts:
    """The most frequent counts; of equally frequent ones those of the smallest mobility, then of the highest rank."""
    often = Counter(counts)
    return max(often, key=lambda each: (often[each], -each.mobility, each.relation, each.seen))


def gap_of(found: Relation) -> float:
    """The smallest gap of all ranks that the counts rest on."""
    return min(found.gap, found.dof.gap, found.lost_rank.gap, range_basis(found.rates, 1.0)[1].gap)


@dataclass(frozen=True)
class Classes:
    """Zlatanov's six: RI, RO, RPM, IIM as excess, II, IO as deficit over the generic values.

    RO = dim {t : (t, 0) ∈ ρ}, RI = dim {u̇ : (0, u̇) ∈ ρ}, RPM = dim {q̇ : t = 0, u̇ = 0}, IIM = mobility,
    IO = dim proj_t ρ, II = dim proj_u̇ ρ. Then IO = RI + RPM − IIM and II = RO + RPM − IIM.
    """

    RI: int
    RO: int
    II: int
    IO: int
    RPM: int
    IIM: int

    @classmethod
    def of(cls, here: Counts, usual: Counts) -> Classes:
        """The counts here against the usual ones."""
        passive = (here.mobility - here.relation) - (usual.mobility - usual.relation)
        return cls(RI=here.unexplained - usual.unexplained, RO=here.unseen - usual.unseen, II=usual.seen - here.seen,
                   IO=usual.dof - here.dof, RPM=passive, IIM=here.mobility - usual.mobility)

    @property
    def type1(self) -> bool:
        """What is measured moves while the platform rests (RI > 0)."""
        return self.RI > 0

    @property
    def type2(self) -> bool:
        """The platform moves while what is measured rests (RO > 0)."""
        return self.RO > 0

    @property
    def type3(self) -> bool:
        """Both."""
        return self.type1 and self.type2

    def to_dict(self) -> dict[str, int]:
        """The record of the command line."""
        return asdict(self)


def interaction_matrix(found: Relation) -> Array | None:
    """Mᵀ (rates, dof) on the basis ``found.twists`` of the feasible twists (MMT eq. 7; lengths in characteristic
    lengths); None where it does not exist."""
    if found.unexplained:
        return None
    return found.rates @ np.asarray(np.linalg.lstsq(found.twist_part, found.twists, rcond=None)[0])
