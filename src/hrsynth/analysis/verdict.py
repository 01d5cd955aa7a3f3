"""Verdict on one set of observed legs (docs/pages/theory.md, section 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

from ..errors import UndecidedRank
from ..geometry.ranks import Rank
from ..kinematics.sampling import Samples
from ..kinematics.velocity_relation import VelocityRelation, compute_relation, decompose_relations
from ..records import GAP, OPTIONAL, Recorded, Shown, Word, recorded
from ..results import Result
from ..tolerances import NONZERO_SINGULAR_VALUE_MIN, RANK_CUTOFF_FRACTION, RANK_GAP_MIN, ZERO_SINGULAR_VALUE_MAX
from .formation import Formation, analyze_formation
from .freedoms import Freedom, format_point, name_freedoms
from .observed import ObservedRobot

CONTROLLABLE, PARTIAL, BLIND = "controllable", "partially controllable", "uncontrollable"
AT_REST = "nothing to control"
"""Verdict on a platform that does not move."""
ELSEWHERE = "with the platform at"
"""Suffix of an unobserved dof's name if the zero configuration is not generic."""


def name_controllability(rank: int, dof: int) -> str:
    """Return the verdict for ``rank`` of ``dof`` observed platform dof."""
    if not dof:
        return AT_REST
    return CONTROLLABLE if rank == dof else PARTIAL if rank else BLIND


class Margin(NamedTuple):
    """Smallest singular value that counts, largest that does not, and the cutoff."""

    smallest_kept: float
    largest_dropped: float
    cutoff: float


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Result, shown_as="verdict"):
    """Verdict on one set of observed legs, at generic configurations."""

    legs: Recorded[tuple[str, ...]]
    verdict: Annotated[str, Word]
    dof: int
    rank: Recorded[int]
    unobserved: Recorded[tuple[Freedom, ...]]
    gap: Annotated[float, GAP]
    has_interaction_matrix: Recorded[bool] = True
    """True if Mᵀ exists: no observed direction changes while the platform is fixed."""
    smallest_kept: float = 1.0
    """Smallest singular value that counts of the measured rates on ρ, at the sample where it is largest: single samples
    may lie near a singularity."""
    largest_dropped: float = 0.0
    """The largest that does not, at the sample where it is least."""
    formation: Annotated[Formation | None, Formation, OPTIONAL] = None
    """For a formation: unobserved motions, trivial ones and flexes; ``dof`` are those of all links."""
    rank_at_zero: Annotated[int | None, int, OPTIONAL, "at a zero configuration with a lower rank than others"] = None
    """Rank at the zero configuration if it is lower than elsewhere (it is singular); None if it is equal, not decided,
    or for several platform links."""

    @property
    def is_near_cutoff(self) -> bool:
        """True if a singular value is so near the cutoff that slightly different geometry has another verdict."""
        return (
            self.rank > 0 and self.smallest_kept < NONZERO_SINGULAR_VALUE_MIN
        ) or self.largest_dropped > ZERO_SINGULAR_VALUE_MAX

    @property
    def named(self) -> str:
        """Unobserved dof, and the configuration at which they have these names: at others they differ."""
        names = "; ".join(each.name for each in self.unobserved)
        return names if ELSEWHERE in names else f"{names} (at the zero configuration)"

    @property
    def never(self) -> str:
        """Number of dof that are unobserved at all configurations, and their names at one of them."""
        count = len(self.unobserved)
        return f"{count} of {self.dof} dof never observed: {self.named}"

    def headline(self) -> str:
        """The legs, the verdict and the rank."""
        return f"legs {', '.join(self.legs)}: {self.verdict}, rank {self.rank} of {self.dof}"

    interaction_matrix = Shown(bool, lambda self: self.has_interaction_matrix)

    @property
    @recorded()
    def margin(self) -> Margin:
        """Smallest singular value that counts, largest that does not, and the cutoff."""
        return Margin(self.smallest_kept, self.largest_dropped, RANK_CUTOFF_FRACTION)


def compute_verdict(setup: ObservedRobot, legs: Sequence[str], samples: Samples) -> Verdict:
    """The verdict for ``samples``, whose observations are those of ``legs``.

    All samples are of one operation mode and must show one rank. Raises ``UndecidedRank`` where its gap is too small at
    a sample, or between what counts at one sample and what does not at another.
    """
    found = [member.relation for member in samples.members]
    decompose_relations(found)
    rank = max(each.rank for each in found)
    what = f"the rank of legs {', '.join(legs)}"
    if any(each.rank != rank for each in found):
        between = min(each.seen.weakest for each in found) / max(each.seen.dropped for each in found)
        raise UndecidedRank(f"{what} is not the same at all configurations", between, RANK_GAP_MIN)
    gap = min(min(each.gap, each.RO.gap) for each in found)
    Rank(rank, gap).decided(what)
    dof = setup.dof
    lost, formation, at_zero = tuple[Freedom, ...](), None, None
    start = compute_relation(samples.start, samples.observation_model)
    if setup.mechanism.formation:
        formation = _analyze_formation(setup, samples, start, dof - rank)
    else:
        shown = max(dof - start.unobserved_twists.shape[1], 0)
        at_zero = shown if shown < rank and start.gap >= RANK_GAP_MIN else None
        lost = _list_unobserved(setup, samples, start, tuple(legs), dof - rank) if rank < dof else ()
    graph = not any(each.RI for each in found)
    said = name_controllability(rank, dof) if formation is None else formation.verdict
    return Verdict(
        tuple(legs),
        said,
        dof,
        rank,
        lost,
        gap,
        graph,
        max(each.seen.weakest for each in found),
        min(each.seen.dropped for each in found),
        formation,
        at_zero,
    )


def _analyze_formation(setup: ObservedRobot, samples: Samples, start: VelocityRelation, count: int) -> Formation:
    """Return the unobserved motions of a formation, at the zero configuration (ρ there: ``start``) if it is generic,
    else at a sample."""
    member = samples.members[0]
    usual = analyze_formation(member.configuration, samples.observation_model, member.relation, setup.decomposition)
    if start.unobserved_twists.shape[1] != count or start.gap < RANK_GAP_MIN:
        return usual
    found = analyze_formation(samples.start, samples.observation_model, start, setup.decomposition)
    return found if len(found.trivial) == len(usual.trivial) else usual


def _list_unobserved(
    setup: ObservedRobot, samples: Samples, start: VelocityRelation, legs: tuple[str, ...], count: int
) -> tuple[Freedom, ...]:
    """Return the unobserved dof at the zero configuration (ρ there: ``start``) if it is generic, else at a sample."""
    position = None
    found = start.unobserved_twists
    if found.shape[1] != count or start.gap < RANK_GAP_MIN:
        member = next(member for member in samples.members if member.relation.unobserved_twists.shape[1] == count)
        found, position = (
            member.relation.unobserved_twists,
            member.configuration.pose(samples.observation_model.platform)[:3, 3],
        )
    named = name_freedoms(found, setup.decomposition, legs, position)
    if position is None:
        return named
    return tuple(replace(each, name=f"{each.name} ({ELSEWHERE} {format_point(position)} m)") for each in named)
