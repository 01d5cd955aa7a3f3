"""Exact verdicts of an architecture: ranks over the rationals at random instances (docs/pages/proofs.md, section 12).

F is the irreducible family of geometries with all incidences that persist in the robot's motion, an instance one of its
rational members. With A the constraints, X the platform's twist and Y the rates of the directions, the observed rank of
the platform is rank X − rank [X; Y] + rank Y, ranks on ker A.

*Proved*: almost all members of F are controllable. Its premises, numbered as in section 12:
1. every incidence of F holds on the robot's branch, structural or loop-invariant (:attr:`ExactArchitecture.basis`;
   merely *sampled* ones are listed, and the verdict is not *proved*);
2. rank [A; Y] = rank [A; Y; X] at one instance: exact (:meth:`ExactArchitecture._rank`);
3. rank [A; Y; X] there is the largest on F, except for a chance (:meth:`ExactArchitecture._chance`);
4. the robot is a regular member of F: numerical (:meth:`ExactArchitecture._has_full_column_rank`).

A *deficient* verdict has the largest rank of several instances: it is probabilistic. What a single link's dimensions
make special (three centres on a line) belongs to a robot, not to its architecture; its rank may be lower, never higher.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np

from ..batch.platform_coordinates import collect_frames
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.velocity_relation import ObservationModel, VelocityRelation
from ..mechanism import Mechanism, Observation
from ..mechanism.incidences import Incidences, recognise
from ..mechanism.model import JointType
from ..mechanism.observation import list_labels
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.structural_incidences import GeometricIncidence, find_structural_incidences, list_incidences
from ..records import OPTIONAL, As, Record, Recorded, Word
from ..results import ComparableValue, drop_infinite
from ..tolerances import CACHED_OBSERVED_ROBOTS_COUNT, CLOSURE_RESIDUAL_TOL
from .formation import SENSED_POINTS_COUNT, evaluate_formation_rows, measure_links
from .formation import name_rigidity as formation_word
from .instances import (
    LARGEST_RANDOM,
    Instance,
    RecognitionFailure,
    build_instance,
    compute_exact_kernel,
    compute_float_ranks,
    draw,
    draw_whole_numbers,
    rank,
)
from .loop_invariants import bound_degree, find_invariant_incidences
from .observed import ObservedRobot
from .sensor_rows import WRENCH_DEGREE_MAX, SensorPlaces, has_exact_rates
from .verdict import name_controllability

EXACT_RANK_INSTANCES_COUNT = 5
"""Random instances at which a deficient rank is confirmed."""
IDENTITY_INSTANCES_COUNT = 3
"""Random instances at which identities are tested."""


@dataclass(frozen=True)
class Basis(Record):
    """Basis of the incidences of an architecture: number of structural and of loop-invariant ones, and the sampled ones
    in words."""

    structural: Recorded[int]
    loop_invariant: Recorded[int]
    sampled: Recorded[tuple[str, ...]]
    largest_defect_held: Annotated[float, As("largest_defect_held")] = 0.0
    """Largest defect (sines, characteristic lengths) of an incidence that counts."""
    smallest_defect_not_held: Annotated[float | None, As("smallest_defect_not_held")] = None
    """Smallest defect of an incidence that does not count."""

    @property
    def nearly(self) -> str:
        """Describe incidences that nearly hold; empty without any."""
        text = (
            f"; incidences with a defect up to {self.largest_defect_held:.1e} count"
            if self.largest_defect_held > CLOSURE_RESIDUAL_TOL
            else ""
        )
        return text + (
            ""
            if self.smallest_defect_not_held is None
            else f"; an incidence with a defect of {self.smallest_defect_not_held:.1e} does not count"
        )


@dataclass(frozen=True, eq=False, repr=False)
class ExactVerdict(ComparableValue):
    """Verdict for the generic geometry of an architecture with some legs observed.

    ``verdict`` and ``rank`` are None unless it is ``exact``; ``reason`` explains it. ``instances`` counts the random
    instances behind the verdict: one if it is controllable. ``chance`` bounds the probability of an error if it is
    ``proved`` by identities that were tested at random instances.
    """

    legs: tuple[str, ...]
    verdict: Annotated[str | None, Word | None]
    rank: Recorded[int | None]
    dof: int
    exact: Recorded[bool]
    instances: Recorded[int]
    reason: Recorded[str]
    proved: Recorded[bool] = False
    chance: Recorded[float] = 0.0
    basis: Annotated[Basis | None, As("relations")] = None
    trivial: Annotated[
        int | None, int, OPTIONAL, "of a formation: number of trivial motions among the unobserved ones"
    ] = None
    """For a formation: number of independent unobserved motions that are trivial."""


class ExactArchitecture:
    """Exact architecture of a mechanism: verdicts for any set of its observed directions.

    ``relation`` is ρ at a generic configuration for all ``observations``: what an instance must reproduce; ``start``
    is the mobility at the first configuration of the relations, the zero configuration.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        relations: Incidences,
        observations: Sequence[Observation],
        relation: VelocityRelation,
        start: int | None = None,
    ) -> None:
        self.mechanism = mechanism
        self.relations = relations
        self.observations = tuple(observations)
        self.relation = relation
        self.start = relation.mobility if start is None else start
        self.dof = relation.dof.value
        self.obstacle = "couplings are not part of exact geometry" if mechanism.couplings else relations.doubt
        """Reason why there are no instances; empty if there are."""
        self._places = {o.key: i for i, o in enumerate(self.observations)}
        self._instances: list[Instance] = []
        self._answers: dict[tuple[tuple[str, ...], ...], ExactVerdict] = {}
        self._random = random.Random(0)

    def instance(self, number: int) -> Instance:
        """The instance of this number, from 0; raises ``RecognitionFailure`` where it is not one of the
        architecture."""
        while len(self._instances) <= number:
            if self.obstacle:
                raise RecognitionFailure(self.obstacle)
            try:
                drawn = draw(self.relations, self._random)
                found = build_instance(self.mechanism, self.relations, self.observations, drawn)
                self._check(found)
            except RecognitionFailure as error:
                self.obstacle = str(error)
                raise
            self._instances.append(found)
        return self._instances[number]

    def _check(self, found: Instance) -> None:
        _require_same("mobility", found.mobility, self.relation.mobility)
        _require_same("dof", found.dof, self.dof)
        _require_same("dim ρ", found.ranks(range(len(self.observations)))[0], self.relation.dimension)

    def verdict(self, observed: Sequence[Observation]) -> ExactVerdict:
        """The verdict for some of the observations."""
        asked = tuple(o.key for o in observed)
        if asked not in self._answers:
            self._answers[asked] = self._verdict(observed)
        return self._answers[asked]

    def _verdict(self, observed: Sequence[Observation]) -> ExactVerdict:
        legs = list_labels(observed)
        try:
            seen, instances = self._rank(observed)
            basis = self.basis
            trivial = self._trivial(observed) if self.mechanism.formation else None
            chance = self._chance(observed) if seen == self.dof > 0 and not basis.sampled else 0.0
        except RecognitionFailure as error:
            return ExactVerdict(legs, None, None, self.dof, False, 0, str(error))
        proved = seen == self.dof and not basis.sampled and (self.dof > 0 or trivial is not None)
        random = f"exact at {instances} random instance" + "s" * (instances > 1)
        reason = "proved in exact arithmetic" if proved else random
        if chance:
            reason += f", except for a chance below {round_up_power(chance)}"
        if basis.sampled:
            reason += f" of geometry with {len(basis.sampled)} sampled incidences ({basis.sampled[0]})"
        reason += basis.nearly
        said = name_controllability(seen, self.dof) if trivial is None else formation_word(self.dof - seen - trivial)
        return ExactVerdict(legs, said, seen, self.dof, True, instances, reason, proved, chance, basis, trivial)

    def _trivial(self, observed: Sequence[Observation]) -> int:
        """Return the number of independent trivial motions: the least of several instances."""
        places = [self._places[o.key] for o in observed]
        return min(self._count_similarities(self.instance(i), places) for i in range(EXACT_RANK_INSTANCES_COUNT))

    def _count_similarities(self, found: Instance, places: Sequence[int]) -> int:
        """Return the number of independent similarities that move all observed points together, at an instance, in
        unobserved motions."""
        draws = [
            (draw_whole_numbers(3, self._random), draw_whole_numbers(3, self._random))
            for _ in range(SENSED_POINTS_COUNT)
        ]
        parts = [
            part
            for i in places
            if (at := found.sightings[i]) is not None
            for part in measure_links(self.observations[i], self.mechanism.reference, at, draws)
        ]
        if not parts:
            return 0
        unseen = compute_exact_kernel(np.vstack([found.rates[i] for i in places]))
        motions, common = evaluate_formation_rows(
            parts, {link: twist @ unseen for link, twist in found.twists().items()}
        )
        return rank(motions) + rank(common) - rank(np.hstack([motions, common]))

    @cached_property
    def basis(self) -> Basis:
        """Return the basis of the incidences; raises ``RecognitionFailure`` if the robot is no regular member of its
        family."""
        every = list_incidences(self.relations)
        known = find_structural_incidences(self.mechanism, self.relations, every)
        left = [tie for tie, holds in zip(every, known, strict=True) if not holds]
        regular = self._is_zero_regular()
        if left and not (regular and self.start == self.instance(0).mobility and self._has_invariant_incidences(every)):
            kept_too, observed = 0, tuple(tie.words(self.relations) for tie in left)
        else:
            kept_too, observed = len(left), ()
        missed = self.relations.missed
        return Basis(len(every) - len(left), kept_too, observed, self.relations.held, drop_infinite(missed))

    def _is_zero_regular(self) -> bool:
        """Return True if the zero configuration is a regular member of the family, as the instance is; a sample must
        be."""
        ranks = self.instance(0).geometry.ranks
        if compute_float_ranks(self.relations, 0) == ranks:
            return True
        if compute_float_ranks(self.relations, -1) != ranks:
            raise RecognitionFailure("its geometry is not recognised: it is more special than its incidences imply")
        return False

    def _has_invariant_incidences(self, every: Sequence[GeometricIncidence]) -> bool:
        """Return True if the motions of each of some instances preserve all incidences."""
        return all(
            all(find_invariant_incidences(every, self.relations, self.instance(i)))
            for i in range(IDENTITY_INSTANCES_COUNT)
        )

    def _chance(self, observed: Sequence[Observation]) -> float:
        """Bound of the probability that an identity on which *proved* depends is false (0: none is tested)."""
        places = [self._places[o.key] for o in observed]
        found = [self.instance(0)]
        spins = sum(self._is_spinning_rod(link, places) for link in self.mechanism.links)
        tested = self.basis.loop_invariant + bool(
            self.basis.loop_invariant
        )  # each relation, and that the rank of A is the largest on F
        if found[0].mobility - found[0].ranks(places)[0] != spins:
            tested += 1
            found += [self.instance(i) for i in range(1, IDENTITY_INSTANCES_COUNT)]
            for each in found:
                _require_same("dim ρ of these legs", each.ranks(places)[0], found[0].ranks(places)[0])
        rows = sum(each.size for each in self.observations if not isinstance(each, SeenAxis))
        return (
            tested
            * (bound_degree(self.relations, len(found[0].free) + WRENCH_DEGREE_MAX * rows) / (2 * LARGEST_RANDOM))
            ** IDENTITY_INSTANCES_COUNT
        )

    def _is_spinning_rod(self, link: str, places: Sequence[int]) -> bool:
        """Return True if a link is a rod between two S joints that can spin unobserved."""
        joints = self.mechanism.joints_of(link)
        if (
            len(joints) != 2
            or {joint.type for joint in joints} != {JointType.SPHERICAL}
            or link in (self.mechanism.base, self.mechanism.platform, self.mechanism.reference)
        ):
            return False
        others = (self.observations[i] for i in places if not self.observations[i].is_segment_direction)
        if any(link in (o.link, o.seen_from) for o in others):
            return False
        ends = {self.relations.centres[joint.name] for joint in joints}
        sights = dict(
            zip(
                (i for i, o in enumerate(self.observations) if isinstance(o, SeenAxis)),
                self.relations.sights,
                strict=False,
            )
        )
        return all(
            sights[i].kind == "between" and set(sights[i].points) == ends
            for i in places
            if self.observations[i].link == link
        )

    def _rank(self, observed: Sequence[Observation]) -> tuple[int, int]:
        """The largest rank seen, and the instances looked at: one that sees everything is enough."""
        unknown = [o for o in observed if o.key not in self._places]
        if unknown:
            odd = unknown[0]
            raise RecognitionFailure(
                f"the observation of link {odd.link} is not a direction and not requested"
                if has_exact_rates(odd)
                else f"the measured value of {odd.text} is not rational"
            )
        places = [self._places[o.key] for o in observed]
        dimension = self.relation.select(places).dimension
        best = 0
        for number in range(EXACT_RANK_INSTANCES_COUNT):
            together, rates = self.instance(number).ranks(places)
            _require_same("dim ρ of these legs", together, dimension)
            best = max(best, self.dof - together + rates)
            if best == self.dof > 0:  # another instance may have motions where this one has none
                return best, 1
        return best, EXACT_RANK_INSTANCES_COUNT


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def get_architecture(setup: ObservedRobot) -> ExactArchitecture:
    """The architecture of a robot, from its zero configuration and its samples."""
    all_samples = setup.all_samples
    at = [all_samples.start, *setup.configurations]
    return build_architecture(setup.mechanism, all_samples.observation_model, at, all_samples.members[0].relation)


def build_architecture(
    mechanism: Mechanism,
    observation_model: ObservationModel,
    at: Sequence[ClosedConfiguration],
    relation: VelocityRelation,
) -> ExactArchitecture:
    """The architecture of a mechanism from configurations ``at`` which relations must persist, and ρ at one of them."""
    places = [i for i, o in enumerate(observation_model.observations) if has_exact_rates(o)]
    observed = [observation_model.observations[i] for i in places]
    sensors = SensorPlaces.of(observed, mechanism)
    directions = [*(o for o in observed if isinstance(o, SeenAxis)), *sensors.as_observed()]
    relations = recognise(mechanism, collect_frames(at), directions, observation_model.point, sensors.points)
    return ExactArchitecture(mechanism, relations, observed, relation.select(places), at[0].kernel()[0].shape[1])


def round_up_power(chance: float) -> str:
    """The power of ten next above a chance."""
    return f"1e{math.ceil(math.log10(chance))}"


def _require_same(what: str, here: int, there: int) -> None:
    if here != there:
        raise RecognitionFailure(
            f"its geometry is not recognised: {what} is {there}, but {here} with only the incidences that "
            "persist in motion"
        )
