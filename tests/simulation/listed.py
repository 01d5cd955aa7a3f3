"""Which of the rests that are listed for a goal a run ended at. The lists are made from goals alone, of many goals of a
robot at once, by descent, which finds what attracts: from random starts that are drawn once for each robot, and from
what was found for the goals next to it, until that adds nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import combinations, islice
from typing import Any

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.verdict import CONTROLLABLE, compute_verdict
from hrsynth.constraints.pattern import list_leg_ends
from hrsynth.equations.measured_error import DirectionTerm, ErrorSystem
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.simulation.equilibria.descent import (
    CRITICAL_CURVATURE_TOL,
    DESCENT_STEP_MAX,
    EQUILIBRIUM_COORDINATE_MAX,
    EQUILIBRIUM_START_STEPS_MAX,
    CriticalPoint,
    Expansion,
    are_closed,
    walk_at_random,
)
from hrsynth.simulation.equilibria.descent import CRITICAL_GRADIENT_TOL as AT_ZERO
from hrsynth.simulation.equilibria.equilibria import MODE_WALK_FIRST_STEP_FRACTION, EquilibriumSearch
from hrsynth.simulation.equilibria.equilibrium import CRITICAL, Equilibrium
from hrsynth.simulation.equilibria.search import CountedCriticalPoint, in_mode, marks, starts
from hrsynth.simulation.outcome import ANTIPODAL, BOUNDARY, GOAL, MINIMUM, MODE
from hrsynth.simulation.result import Servo
from hrsynth.tolerances import CRITICAL_POINT_DISTANCE_TOL
from simulation.scenes import Legs, setting

SINGULAR, CONTINUUM, APART, OUTSIDE = "singular", "family", "apart", "outside"
MEMBER = (GOAL, MODE, ANTIPODAL, CRITICAL, SINGULAR, BOUNDARY, CONTINUUM, APART, OUTSIDE)
"""What a run ended at: a rest of that kind where all velocities are seen; a singular one, or one at a leg's reach; one
of those that fill curves; ``apart``: a run to a boundary, or without an ending, that is none of these; ``outside``:
another run that is none of these."""
NEAR = 1e-5
"""Distance (characteristic lengths, directions) of a rest that is the end of a run."""
ROUNDS, NEIGHBOURS, ABREAST = 3, 2, 1000
"""Rounds of random starts of a robot, of which a goal takes as many as one has; nearest goals whose rests are starts as
well; descents at once."""


@cache
def pool(name: str) -> Array:
    """Random starts (c, N) of a robot, whatever its goal."""
    found = setting(name)
    system = EquilibriumSearch.of(found, found.all_samples.start).system
    homes = np.array([system.system.read(at.pose) for at in found.configurations])
    return np.concatenate(list(islice(starts(system, homes, 0, found), ROUNDS)))


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
        if compute_verdict(watching, legs, watching.samples).verdict == CONTROLLABLE:
            sets += 1
            yield legs


def known(places: Sequence[Array], place: Array) -> bool:
    """Whether one of some places is the same."""
    return bool(places) and bool(np.abs(np.array(places) - place).max(axis=1).min() < CRITICAL_POINT_DISTANCE_TOL)


@dataclass(frozen=True, eq=False)
class Rests:
    """What was found of a goal: the rests that are told apart, each with what tells it apart (a row of ``places``), and
    those that fill curves, as (‖e‖, place). A flat one that two starts come to is one by itself."""

    search: EquilibriumSearch
    points: list[CriticalPoint] = field(default_factory=list)
    places: list[Array] = field(default_factory=list)
    continua: list[tuple[float, Array]] = field(default_factory=list)

    def add(self, point: CriticalPoint, place: Array) -> bool:
        """Whether a point is an isolated one that was not known."""
        if known(self.places, place):
            return False
        flat = [each for _, each in self.continua]
        if np.any(np.abs(point.curvatures) < CRITICAL_POINT_DISTANCE_TOL) and not known(flat, place):
            self.continua.append((float(np.sqrt(2 * max(point.value, 0.0))), place))
            return False
        self.points.append(point)
        self.places.append(place)
        return True

    def read(self, number: int) -> Equilibrium | None:
        """A rest as a pose of the robot, in its operation mode."""
        system, found, q = self.search.system, self.search.setup, self.points[number].q[None]
        nearby = walk_at_random(system, q, np.random.default_rng(0), 2, MODE_WALK_FIRST_STEP_FRACTION)
        return (
            self.search.read(CountedCriticalPoint(self.points[number], 0))
            if in_mode(system, found, nearby)[0]
            else None
        )


class Lists:
    """The lists of many goals of a robot; ``idle`` of its motions move nothing that counts."""

    def __init__(self, found: ObservedRobot) -> None:
        self.setting, self.every = found, list[Rests]()
        seen = found.samples.members[0].relation
        self.idle, self.rng = seen.mobility - seen.dimension, np.random.default_rng(1)

    def add(self, goals: Sequence[ClosedConfiguration]) -> list[Rests]:
        """Those of more goals: from random starts, then from what was found for the goals next to each, as long as that
        finds something."""
        drawn, first = pool(self.setting.robot.name), len(self.every)
        many = len(drawn) // ROUNDS
        self.every += [Rests(EquilibriumSearch.of(self.setting, goal)) for goal in goals]
        own = range(first, len(self.every))
        desired = np.array([each.search.desired.ravel() for each in self.every])
        order = [np.argsort(np.linalg.norm(desired - desired[k], axis=1))[1 : NEIGHBOURS + 1] for k in own]
        pairs = [
            (q, k)
            for k, goal in zip(own, goals, strict=True)
            for q in (
                self.every[k].search.system.system.read(goal.pose),
                *drawn[self.rng.choice(len(drawn), many, replace=False)],
            )
        ]
        self._lead(pairs)
        news = {k: each.points for k, each in enumerate(self.every)}
        while any(news.values()):
            news = self._lead(
                [
                    (point.q, k)
                    for k, near in zip(own, order, strict=True)
                    for other in near
                    for point in news.get(int(other), [])
                ]
            )
        return self.every[first:]

    def _lead(self, pairs: Sequence[tuple[Array, int]]) -> dict[int, list[CriticalPoint]]:
        """The rests that are new to which starts lead, by the numbers of the goals: those that leave no loop open."""
        systems = [each.search.system for each in self.every]
        found = descents(systems, [q for q, _ in pairs], [k for _, k in pairs], self.idle)
        good = (
            are_closed(systems[0], np.array([point.q for _, point in found]), CRITICAL_POINT_DISTANCE_TOL)
            if found
            else ()
        )
        found = [each for each, kept in zip(found, good, strict=True) if kept]
        news: dict[int, list[CriticalPoint]] = {}
        for (k, point), place in zip(found, self.places([point.q for _, point in found]), strict=True):
            if self.every[k].add(point, place):
                news.setdefault(k, []).append(point)
        return news

    def places(self, q: Sequence[Array]) -> Array:
        """What tells rests q (n, N) apart, (n, m): the observed directions, the poses of the platform's bodies."""
        found, system = self.setting, self.every[0].search.system
        points = [CriticalPoint(each, each, 0.0, each, 0.0) for each in q]
        every, seen = found.all_samples.observation_model.observations, {(o.leg, o.link) for o in found.observed}
        told = marks(system, found, list_leg_ends(found.decomposition), points)
        if not len(points):
            return told
        bodies = told.shape[1] - 3 * len(every)
        return told[:, [True] * bodies + [(o.leg, o.link) in seen for o in every for _ in range(3)]]


def descents(
    systems: Sequence[ErrorSystem], starts: Sequence[Array], goals: Sequence[int], idle: int
) -> list[tuple[int, CriticalPoint]]:
    """The critical points to which starts (n, N) lead that go down all along, each with the number of its system; so
    many at once, whatever their systems, which differ in the desired directions alone."""
    base, found = systems[0], list[tuple[int, CriticalPoint]]()
    directed = [[each for each in system.terms if isinstance(each, DirectionTerm)] for system in systems]
    wanted = [np.array([each.wanted for each in column]) for column in zip(*directed, strict=True)]
    waiting = list(zip(starts, goals, [0] * len(goals), strict=True))[::-1]
    live = list[tuple[Array, int, int]]()
    while waiting or live:
        live += [waiting.pop() for _ in range(min(len(waiting), ABREAST - len(live)))]
        q, k = np.array([each for each, _, _ in live]), np.array([number for _, number, _ in live])
        terms = tuple(replace(each, wanted=w[k]) for each, w in zip(directed[0], wanted, strict=True))
        at = Expansion.of(replace(base, terms=terms), q, idle)
        done = at.residual < AT_ZERO
        found += [
            (int(k[i]), CriticalPoint(q[i], at.multipliers[i], float(at.residual[i]), at.curvatures[i], float(at.E[i])))
            for i in np.flatnonzero(done)
        ]
        size = np.maximum(np.abs(at.curvatures), CRITICAL_CURVATURE_TOL)
        near = (at.residual < 1e-3) & (np.abs(at.slope / size).max(axis=-1) < 0.05)
        sign = np.where(near[:, None], -np.sign(at.curvatures), -1.0)
        step = (at.directions @ (sign * at.slope / size)[..., None])[..., 0]
        ahead = q + shortened(step) + shortened(at.closing)
        going = ~done & np.isfinite(ahead).all(axis=-1) & (np.abs(ahead).max(axis=-1) < EQUILIBRIUM_COORDINATE_MAX)
        live = [
            (ahead[i], number, steps + 1)
            for i, (_, number, steps) in enumerate(live)
            if going[i] and steps + 1 < EQUILIBRIUM_START_STEPS_MAX
        ]
    return found


def shortened(step: Array) -> Array:
    """Steps (c, N), none of whose changes is longer than ``LONGEST_STEP``."""
    size = np.abs(step).max(axis=-1, keepdims=True)
    return step * np.minimum(1.0, DESCENT_STEP_MAX / np.maximum(size, DESCENT_STEP_MAX))


@dataclass(frozen=True)
class Listed:
    """The nearest of all rests of a run's goal to its end, how far that is, and how many there are."""

    ended: str
    nearest: Equilibrium | None
    distance: float
    rests: int
    continuum: bool

    @classmethod
    def of(cls, found: Servo, lists: Lists | None = None, number: int = 0) -> Listed:
        """That of a run to the goal of so many in the lists; without them one is made."""
        if lists is None:
            lists = Lists(found.setup)
            lists.add([found.target])
        own, end = lists.every[number], found.run.commands[-1]
        here = lists.places([own.search.system.system.read(found.settled.pose)])
        away = np.abs(np.array(own.places).reshape(-1, here.shape[1]) - here).max(axis=1)
        near = int(np.argmin(away)) if len(away) else None
        rest = own.read(near) if near is not None and away[near] < NEAR else None
        return cls(
            found.outcome,
            rest,
            np.inf if near is None else float(away[near]),
            len(own.points),
            end.size > NEAR and any(abs(size - end.size) < NEAR for size, _ in own.continua),
        )

    @property
    def member(self) -> str:
        """One of ``MEMBER``."""
        if self.nearest is not None:
            return (
                BOUNDARY if self.nearest.boundary else self.nearest.kind if self.nearest.singular is None else SINGULAR
            )
        if self.continuum:
            return CONTINUUM
        return OUTSIDE if self.ended in (GOAL, MODE, ANTIPODAL, MINIMUM) else APART

    def untrue(self, found: Servo) -> Iterator[str]:
        """What does not fit together: the list's name of the rest and the run's."""
        if self.member in (GOAL, MODE, ANTIPODAL) and self.member != found.outcome:
            yield f"{found.outcome}, listed as {self.member}"
        if self.member in (CRITICAL, SINGULAR) and found.outcome in (GOAL, MODE, ANTIPODAL):
            yield f"{found.outcome}, listed as {self.member}"
        if self.nearest is not None and self.nearest.stable is False:
            yield f"{found.outcome} at a rest that is listed as {self.nearest.stability}"

    def to_dict(self) -> dict[str, Any]:
        return {"member": self.member, "distance": self.distance, "rests": self.rests}
