"""Which of the rests that are listed for a goal a run ended at. The list is made from the goal alone: from starts that
are drawn once for each robot, by descent, which finds what attracts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations, count
from typing import Any

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import CONTROLLABLE, verdict_of
from hrsynth.constraints.pattern import attached
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.simulation.ending import ANTIPODAL, BOUNDARY, GOAL, MINIMUM, MODE
from hrsynth.simulation.endings.endings import CRITICAL, RestPoint, RestSearch
from hrsynth.simulation.endings.search import starts
from hrsynth.simulation.result import Servo
from simulation.scenes import Legs, setting

SINGULAR, CONTINUUM, APART, OUTSIDE = "singular", "continuum", "apart", "outside"
MEMBER = (GOAL, MODE, ANTIPODAL, CRITICAL, SINGULAR, BOUNDARY, CONTINUUM, APART, OUTSIDE)
"""What a run ended at: a rest of that kind where all velocities are seen; a singular one, or one at a leg's reach; one
of those that fill curves; ``apart``: a run to a boundary, or without an ending, that is none of these; ``outside``:
another run that is none of these."""
NEAR = 1e-5
"""Distance (characteristic lengths, directions) of a rest that is the end of a run."""


class Starts:
    """Rounds of starts of a robot, whatever its goal, each drawn once."""

    def __init__(self, name: str) -> None:
        found = setting(name)
        system = RestSearch.of(found, found.everything.start).system
        self.more = starts(system, np.array([system.system.read(at.pose) for at in found.configurations]), 0, found)
        self.drawn: list[np.ndarray] = []

    def __iter__(self) -> Iterator[np.ndarray]:
        for number in count():
            if number == len(self.drawn):
                self.drawn.append(next(self.more))
            yield self.drawn[number]


pool = cache(Starts)


def random_sets(name: str, wanted: int) -> Iterator[Legs]:
    """Random sets of legs that see all freedoms, of each size as many as of the others."""
    found, rng = setting(name), np.random.default_rng(6)
    sets = 0
    for _ in range(50 * wanted):
        if sets == wanted:
            return
        size = int(rng.integers(1, len(found.labels) + 1))
        choice = list(combinations(found.labels, size))
        legs = choice[int(rng.integers(len(choice)))]
        watching = setting(name, legs)
        if verdict_of(watching, legs, watching.samples).verdict == CONTROLLABLE:
            sets += 1
            yield legs


def mark(at: ClosedConfiguration, found: ObservedRobot) -> np.ndarray:
    """What tells rests apart: the observed directions, the poses of the platform's bodies."""
    question = found.samples.question
    seen = [o.value(at.pose(question.reference), at.pose(o.link)) for o in question.observations]
    for body in attached(found.anatomy):
        X = at.pose(body)
        seen.append(X[:3, 3] / at.twin.length)
        if found.motion.body:
            seen += list(X[:3, :2].T)
    return np.concatenate(seen)


@dataclass(frozen=True)
class Listed:
    """The nearest of all rests of a run's goal to its end, how far that is, and how many attract."""

    ended: str
    nearest: RestPoint | None
    distance: float
    attracting: int
    continuum: bool

    @classmethod
    def of(cls, found: Servo) -> Listed:
        """That of a run."""
        name = found.setting.robot.name
        listed = RestSearch.of(found.setting, found.target).answer(minima=True, rounds=pool(name))
        last, end = found.settled, found.run.commands[-1]
        here = mark(last, found.setting)
        away = [float(np.abs(mark(each.configuration, found.setting) - here).max()) for each in listed.rests]
        near = int(np.argmin(away)) if away else None
        return cls(found.ended, None if near is None else listed.rests[near], np.inf if near is None else away[near],
                   len(listed.attracting), any(abs(each.error - end.size) < NEAR for each in listed.continua))

    @property
    def member(self) -> str:
        """One of ``MEMBER``."""
        if self.nearest is not None and self.distance < NEAR:
            return (BOUNDARY if self.nearest.boundary else self.nearest.kind if self.nearest.singular is None
                    else SINGULAR)
        if self.continuum:
            return CONTINUUM
        return OUTSIDE if self.ended in (GOAL, MODE, ANTIPODAL, MINIMUM) else APART

    def untrue(self, found: Servo) -> Iterator[str]:
        """What does not fit together: the list's name of the rest and the run's."""
        if self.member in (GOAL, MODE, ANTIPODAL) and self.member != found.ended:
            yield f"{found.ended}, listed as {self.member}"
        if self.member in (CRITICAL, SINGULAR) and found.ended in (GOAL, MODE, ANTIPODAL):
            yield f"{found.ended}, listed as {self.member}"
        if self.nearest is not None and self.distance < NEAR and self.nearest.stable is False:
            yield f"{found.ended} at a rest that is listed as {self.nearest.stability}"

    def to_dict(self) -> dict[str, Any]:
        return {"member": self.member, "distance": self.distance, "attracting": self.attracting}
