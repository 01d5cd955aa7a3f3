"""What one set of observed legs sees of the platform (docs/pages/theory.md, section 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

from ..errors import RankUndecided
from ..geometry.ranks import Rank
from ..kinematics.sampling import Samples
from ..kinematics.velocity_relation import VelocityRelation, look, relation
from ..records import GAP, OPTIONAL, Recorded, Shown, Word, recorded
from ..results import Result
from ..tolerances import RANK_CUTOFF, RANK_GAP, SURELY_SOMETHING, SURELY_ZERO
from .formation import Formation, formation_at
from .freedoms import Freedom, name_freedoms, point_text
from .observed import ObservedRobot

CONTROLLABLE, PARTIAL, BLIND = "controllable", "partially controllable", "uncontrollable"
AT_REST = "nothing to control"
"""Of a platform that does not move, whatever its legs do."""
ELSEWHERE = "with the platform at"
"""What the name of a lost freedom has where the zero configuration is not a generic one."""


def word(rank: int, dof: int) -> str:
    """The verdict where ``rank`` of the platform's ``dof`` freedoms are seen."""
    if not dof:
        return AT_REST
    return CONTROLLABLE if rank == dof else PARTIAL if rank else BLIND


class Margin(NamedTuple):
    """The smallest singular value that counts, the largest that does not, and where the cut is."""

    smallest_kept: float
    largest_dropped: float
    cutoff: float


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Result, shown_as="verdict"):
    """What one set of observed legs sees of the platform, at generic configurations."""

    legs: Recorded[tuple[str, ...]]
    verdict: Annotated[str, Word]
    dof: int
    rank: Recorded[int]
    unobserved: Recorded[tuple[Freedom, ...]]
    gap: Annotated[float, GAP]
    has_interaction_matrix: Recorded[bool] = True
    """Whether Mᵀ exists: no observed direction moves while the platform rests."""
    smallest_kept: float = 1.0
    """The smallest singular value of the measured rates on ρ that counts as seen, at the sample where it is largest:
    single samples may lie near a singularity, whatever the dimensions."""
    largest_dropped: float = 0.0
    """The largest that does not, at the sample where it is least."""
    formation: Annotated[Formation | None, Formation, OPTIONAL] = None
    """Of a formation: what is not seen, trivial motions and flexes; ``dof`` are the freedoms of all bodies."""
    rank_at_zero: Annotated[
        int | None, int, OPTIONAL, "at a zero configuration that shows fewer freedoms than others do"
    ] = None
    """How many freedoms the zero configuration shows, where these are fewer than elsewhere (it is singular); None
    where they are as many, the number is not decided, or several bodies are asked of."""

    @property
    def near(self) -> bool:
        """Whether a singular value lies so near to the cutoff that slightly other geometry has another verdict."""
        return (self.rank > 0 and self.smallest_kept < SURELY_SOMETHING) or self.largest_dropped > SURELY_ZERO

    @property
    def named(self) -> str:
        """The lost freedoms, and where they have these names: at other configurations others are lost."""
        names = "; ".join(each.name for each in self.unobserved)
        return names if ELSEWHERE in names else f"{names} (at the zero configuration)"

    @property
    def never(self) -> str:
        """How many freedoms are lost at all configurations, and which at one of them."""
        count = len(self.unobserved)
        return f"{count} of {self.dof} freedoms {'is' if count == 1 else 'are'} never seen: {self.named}"

    def headline(self) -> str:
        """The legs, the verdict and the rank."""
        return f"legs {', '.join(self.legs)}: {self.verdict}, rank {self.rank} of {self.dof}"

    interaction_matrix = Shown(bool, lambda self: self.has_interaction_matrix)

    @property
    @recorded()
    def margin(self) -> Margin:
        """The smallest singular value that counts, the largest that does not, and where the cut is."""
        return Margin(self.smallest_kept, self.largest_dropped, RANK_CUTOFF)


def verdict_of(setup: ObservedRobot, legs: Sequence[str], samples: Samples) -> Verdict:
    """The verdict for ``samples``, whose observations are those of ``legs``.

    All samples are of one operation mode and must show one rank. Raises ``RankUndecided`` where its gap is too small at
    a sample, or between what counts at one sample and what does not at another.
    """
    found = [member.relation for member in samples.members]
    look(found)
    rank = max(each.rank for each in found)
    what = f"what legs {', '.join(legs)} see"
    if any(each.rank != rank for each in found):
        between = min(each.seen.weakest for each in found) / max(each.seen.dropped for each in found)
        raise RankUndecided(f"{what} is not the same at all configurations", between, RANK_GAP)
    gap = min(min(each.gap, each.RO.gap) for each in found)
    Rank(rank, gap).decided(what)
    dof = setup.dof
    lost, formation, at_zero = tuple[Freedom, ...](), None, None
    start = relation(samples.start, samples.observation_model)
    if setup.mechanism.formation:
        formation = _formation(setup, samples, start, dof - rank)
    else:
        shown = max(dof - start.unobserved_twists.shape[1], 0)
        at_zero = shown if shown < rank and start.gap >= RANK_GAP else None
        lost = _lost_freedoms(setup, samples, start, tuple(legs), dof - rank) if rank < dof else ()
    graph = not any(each.RI for each in found)
    said = word(rank, dof) if formation is None else formation.verdict
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


def _formation(setup: ObservedRobot, samples: Samples, start: VelocityRelation, count: int) -> Formation:
    """What is not seen of a formation, at the zero configuration (ρ there: ``start``) where it is as at a sample, else
    there."""
    member = samples.members[0]
    usual = formation_at(member.configuration, samples.observation_model, member.relation, setup.decomposition)
    if start.unobserved_twists.shape[1] != count or start.gap < RANK_GAP:
        return usual
    found = formation_at(samples.start, samples.observation_model, start, setup.decomposition)
    return found if len(found.trivial) == len(usual.trivial) else usual


def _lost_freedoms(
    setup: ObservedRobot, samples: Samples, start: VelocityRelation, legs: tuple[str, ...], count: int
) -> tuple[Freedom, ...]:
    """The lost freedoms at the zero configuration (ρ there: ``start``) where it is generic, else at a sample."""
    position = None
    found = start.unobserved_twists
    if found.shape[1] != count or start.gap < RANK_GAP:
        member = next(member for member in samples.members if member.relation.unobserved_twists.shape[1] == count)
        found, position = (
            member.relation.unobserved_twists,
            member.configuration.pose(samples.observation_model.platform)[:3, 3],
        )
    named = name_freedoms(found, setup.decomposition, legs, position)
    if position is None:
        return named
    return tuple(replace(each, name=f"{each.name} ({ELSEWHERE} {point_text(position)} m)") for each in named)
