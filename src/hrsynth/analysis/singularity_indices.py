"""Kinds of singularities: Zlatanov's six counts against their generic values, and redundant constraints of loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..geometry.ranks import Rank, compute_range_basis, rank_of
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.velocity_relation import VelocityRelation
from ..records import Record
from ..tolerances import RANK_GAP_MIN


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
    def of(cls, found: VelocityRelation) -> Counts:
        """The counts of a relation."""
        seen = compute_range_basis(found.rates, 1.0)[1].value
        return cls(found.mobility, found.dimension, found.dof.value, seen, found.RO.value, found.RI)


def find_generic_counts(counts: Sequence[Counts]) -> Counts:
    """The most frequent counts; of equally frequent ones those of the smallest mobility, then of the highest rank."""
    often = Counter(counts)
    return max(often, key=lambda each: (often[each], -each.mobility, each.relation, each.seen))


def find_smallest_gap(found: VelocityRelation) -> float:
    """Smallest rank gap of the indices."""
    return min(found.gap, found.dof.gap, found.RO.gap, compute_range_basis(found.rates, 1.0)[1].gap)


@dataclass(frozen=True)
class SingularityIndices(Record, all_recorded=True):
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
    def of(cls, here: Counts, usual: Counts) -> SingularityIndices:
        """The counts here against the usual ones."""
        passive = (here.mobility - here.relation) - (usual.mobility - usual.relation)
        return cls(
            RI=here.unexplained - usual.unexplained,
            RO=here.unseen - usual.unseen,
            II=usual.seen - here.seen,
            IO=usual.dof - here.dof,
            RPM=passive,
            IIM=here.mobility - usual.mobility,
        )

    @property
    def is_type1(self) -> bool:
        """Measured values change while the platform is fixed (RI > 0)."""
        return self.RI > 0

    @property
    def is_type2(self) -> bool:
        """The platform moves while the measured values are constant (RO > 0)."""
        return self.RO > 0

    @property
    def is_type3(self) -> bool:
        """Both."""
        return self.is_type1 and self.is_type2


def compute_interaction_matrix(found: VelocityRelation) -> Array | None:
    """Mᵀ (rates, dof) on the basis ``found.twists`` of the feasible twists (MMT eq. 7; lengths in characteristic
    lengths); None where it does not exist."""
    if found.RI:
        return None
    return found.rates @ np.asarray(np.linalg.lstsq(found.twist_part, found.twists, rcond=None)[0])


@dataclass(frozen=True)
class Redundancy(Record, all_recorded=True):
    """Redundant equations of a loop, which depend on those of earlier loops. There are ``rows`` of the loop ``loop``,
    at generic configurations if ``generic``."""

    loop: str
    rows: int
    generic: bool


Rows = tuple[tuple[str, int], ...]
"""Name of each loop with its number of redundant rows, in the order of the model's loops."""


def count_redundant_rows(at: ClosedConfiguration) -> Rows:
    """Redundant rows of each loop, counted greedily in the order of ``PinocchioModel.loops``: all rows of a loop but
    those by which it raises the rank of the loops before it. Empty where a rank is not decided."""
    J = at.model.jacobian(at.q)
    names, sizes = at.model.blocks
    scale = float(np.linalg.norm(J, 2)) if J.size else 1.0
    ranks = [Rank(0, np.inf)]
    ranks += [rank_of(np.asarray(np.linalg.svd(J[:end], compute_uv=False)), scale) for end in np.cumsum(sizes)]
    if min(rank.gap for rank in ranks) < RANK_GAP_MIN:
        return ()
    return tuple(
        (name, size - (after.value - before.value))
        for name, size, (before, after) in zip(names, sizes, pairwise(ranks), strict=True)
    )


def find_generic_rows(configurations: Iterable[ClosedConfiguration]) -> Rows:
    """The redundant rows of each loop at most of the configurations."""
    found = Counter(rows for at in configurations if (rows := count_redundant_rows(at)))
    return max(found, key=lambda rows: found[rows], default=())


def subtract_generic_rows(here: Rows, usual: Rows) -> Rows:
    """The rows that are redundant here and not in general: as many as the loops lose rank, each with the loop from
    which on the loss stays."""
    more = np.cumsum([count - often for (_, count), (_, often) in zip(here, usual, strict=False)])
    lasting = np.maximum(np.minimum.accumulate(more[::-1])[::-1], 0)
    return tuple((name, int(count)) for (name, _), count in zip(here, np.diff(lasting, prepend=0), strict=False))


def list_redundant(rows: Rows, *, generic: bool) -> tuple[Redundancy, ...]:
    """The loops with redundant rows."""
    return tuple(Redundancy(name, count, generic) for name, count in rows if count > 0)
