"""Exact verdicts of an architecture: ranks over the rationals at random instances of its geometry (theory 3.4).

Instantaneous kinematics depends on joint centres, joint axes and observed directions alone, and any choice of them *is*
an assembled mechanism; link lengths do not matter. With A the constraints, X the platform's twist and Y the rates of
the directions, an instance (:mod:`.instances`) is believed only if dim ker A, rank X and rank [X; Y] on ker A are the
robot's own mobility, dof and dim ρ. The legs see rank X − rank [X; Y] + rank Y of the platform's freedoms.

*Controllable* at one instance is proved for the architecture: T_qC ⊂ ker A, over-constrained mechanisms included, and
rank Y can only grow from there. A *deficient* verdict holds the largest rank of several instances: it is probabilistic,
wrong only if all of them are special by chance. What a single link's dimensions make special (three centres on a line)
belongs to a robot, not to its architecture; it may see less than its architecture, never more.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..kinematics.batch.stage import frames_at
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.relation import Question, Relation
from ..mechanism import Mechanism, Observation
from ..mechanism.observation import Direction, labels_of
from ..mechanism.relations import Relations, recognise
from .instances import Instance, NotRecognised, draw, instance
from .setting import Setting, selected
from .verdict import word

INSTANCES = 5
"""Random instances at which a deficient rank is confirmed."""


@dataclass(frozen=True)
class ExactVerdict:
    """What an architecture's generic geometry sees with some legs observed.

    ``verdict`` and ``rank`` are None where it is not ``exact``; ``reason`` says why. ``instances`` counts the random
    instances that carry the verdict: one where it is proved.
    """

    legs: tuple[str, ...]
    verdict: str | None
    rank: int | None
    dof: int
    exact: bool
    instances: int
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"verdict": self.verdict, "exact": self.exact, "rank": self.rank, "instances": self.instances,
                "reason": self.reason}


class ExactArchitecture:
    """The architecture of a mechanism: answers for any set of its observed directions.

    ``relation`` is ρ at a generic configuration for all ``observations``: what an instance must reproduce.
    """

    def __init__(self, mechanism: Mechanism, relations: Relations, observations: Sequence[Direction],
                 relation: Relation) -> None:
        self.mechanism = mechanism
        self.relations = relations
        self.observations = tuple(observations)
        self.relation = relation
        self.dof = relation.dof.value
        self.obstacle = "gears are not part of exact geometry" if mechanism.couplings else ""
        """Why there are no instances; empty as long as there are."""
        self._places = {o.key: i for i, o in enumerate(self.observations)}
        self._instances: list[Instance] = []
        self._random = random.Random(0)

    def instance(self, number: int) -> Instance:
        """The instance of this number, from 0; raises ``NotRecognised`` where it is not one of the architecture."""
        while len(self._instances) <= number:
            if self.obstacle:
                raise NotRecognised(self.obstacle)
            try:
                drawn = draw(self.relations, self._random)
                found = instance(self.mechanism, self.relations, self.observations, drawn)
                self._check(found)
            except NotRecognised as error:
                self.obstacle = str(error)
                raise
            self._instances.append(found)
        return self._instances[number]

    def _check(self, found: Instance) -> None:
        _same("mobility", found.mobility, self.relation.mobility)
        _same("dof", found.dof, self.dof)
        _same("dim ρ", found.ranks(range(len(self.observations)))[0], self.relation.dimension)

    def verdict(self, observed: Sequence[Observation]) -> ExactVerdict:
        """The verdict for some of the observations."""
        legs = labels_of(observed)
        try:
            rank, instances = self._rank(observed)
        except NotRecognised as error:
            return ExactVerdict(legs, None, None, self.dof, False, 0, str(error))
        reason = ("proved in exact arithmetic" if rank == self.dof else
                  f"exact at {instances} random instances")
        return ExactVerdict(legs, word(rank, self.dof), rank, self.dof, True, instances, reason)

    def _rank(self, observed: Sequence[Observation]) -> tuple[int, int]:
        """The largest rank seen, and the instances looked at: one that sees everything is enough."""
        unknown = [o for o in observed if o.key not in self._places]
        if unknown:
            raise NotRecognised(f"the measurement of link {unknown[0].link} is not a direction")
        places = [self._places[o.key] for o in observed]
        dimension = selected(self.relation, places).dimension
        best = 0
        for number in range(INSTANCES):
            together, rates = self.instance(number).ranks(places)
            _same("dim ρ of these legs", together, dimension)
            best = max(best, self.dof - together + rates)
            if best == self.dof:
                return best, 1
        return best, INSTANCES


def architecture(setting: Setting) -> ExactArchitecture:
    """The architecture of a robot, from its zero configuration and its samples."""
    everything = setting.everything
    at = [everything.start, *setting.configurations]
    return architecture_of(setting.mechanism, everything.question, at, everything.members[0].relation)


def architecture_of(mechanism: Mechanism, question: Question, at: Sequence[ClosedConfiguration], relation: Relation
                    ) -> ExactArchitecture:
    """The architecture of a mechanism from configurations ``at`` which relations must persist, and ρ at one of them."""
    places = [i for i, o in enumerate(question.observations) if type(o) is Direction]
    directions = [o for o in question.observations if type(o) is Direction]
    relations = recognise(mechanism, frames_at(at), directions, question.point)
    return ExactArchitecture(mechanism, relations, directions, selected(relation, places))


def _same(what: str, here: int, there: int) -> None:
    if here != there:
        raise NotRecognised(f"its geometry is not recognised: {what} is {there}, but {here} where only what persists "
                            "in motion is kept")
