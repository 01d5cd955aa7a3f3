"""Search for critical points of the error on closed loops, from many starts at once. Nothing here is a proof."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot
from ...constraints.pattern import list_placing_links
from ...equations.carried_vectors import SweptChains
from ...equations.measured_error import CriticalPointEquations, DirectionTerm, ErrorSystem
from ...errors import LoopClosureFailure
from ...geometry.vectors import Array, times
from ...kinematics.assembly import build_from_link_poses
from ...kinematics.branch_tests import Signature
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import list_joints_beyond
from ...kinematics.velocity_relation import compute_relation
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import SeenAxis
from ...progress import report
from ...results import Value
from ...tolerances import CRITICAL_POINT_DISTANCE_TOL, VISIBLE_SINE_MIN
from ..law import Law
from .descent import (
    CRITICAL_CURVATURE_TOL,
    EQUILIBRIUM_COORDINATE_MAX,
    CriticalPoint,
    are_closed,
    close_loops,
    descend,
    walk_at_random,
)

CLOSURE_CROSSING_VALUE_TOL = 1e-6
"""Relative singular value of the loop equations below which closures meet; largest slope of E along that motion."""
EQUILIBRIUM_STARTS_COUNT = 200
"""Starts of one round of the search of critical points."""
EQUILIBRIUM_ROUNDS_MAX = 12
"""Largest number of rounds for robots with many coordinates."""
EQUILIBRIUM_COORDINATES_MAX = 300
"""Sum of coordinates over all rounds up to which robots with few coordinates have more rounds."""
ENDING_DESCENTS, ENDING_LEAST = 3, 7
"""Least number of rounds when only stable equilibria are searched, and when all are."""
LATE_EQUILIBRIA_FRACTION = 0.005
"""Fraction of the critical points first found by the later half of the starts at which the search ends."""
LATE_STABLE_EQUILIBRIA_FRACTION = 0.02
"""The same fraction when only stable equilibria are searched."""
EQUILIBRIUM_WALK_STEPS_COUNT = 6
"""Random steps along the loops between the starts of two rounds."""
JOINT_ROUNDS_FRACTION = 0.17
"""Fraction of joint-space rounds that remains if critical poses are searched as well."""

NEARBY_STARTS_FRACTION = 0.5
"""Factor for the number of starts a few random steps beside equilibria already found, if there are no closed forms."""
PRISMATIC_START_MAX = 2.5
"""Coordinate of a slide (characteristic lengths) up to which one is drawn, or farther where its limits are."""
PRISMATIC_NEWTON_STEPS_COUNT = 3
"""Gauss and Newton's steps of slides alone: one does where the equations are linear in these."""
FAMILY_POINTS_MAX = 8
"""Largest number of points of one continuous family, of which one must lie in the operation mode of the zero
configuration."""


@dataclass(frozen=True, eq=False, repr=False)
class CountedCriticalPoint(Value):
    """A critical point, and how often it was met."""

    point: CriticalPoint
    met: int


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoints(Value):
    """Results of a search: isolated critical points, and of continuous families one for each value of E and signs of
    the curvatures; the number of ``starts``, how many of the isolated ones the last half of them found first
    (``late``), how many only the search over the platform's pose found (``posed``), and a lower bound of the number
    that such starts missed (``unmet``, None without such a search; an estimate)."""

    isolated: tuple[CountedCriticalPoint, ...]
    continua: tuple[CountedCriticalPoint, ...]
    idle: int
    starts: int
    late: int
    posed: int = 0
    unmet: int | None = None

    @property
    def words(self) -> str:
        """Return the number of starts and an estimate of the coverage."""
        also = f", {self.posed} more over the platform's pose" if self.posed else ""
        also += f"; estimated, by how often each was met: at least {self.unmet} more" if self.unmet else ""
        return (
            f"found from {self.starts:,} random starts, {self.late} of {len(self.isolated) - self.posed} "
            f"configurations first in the second half of these{also}"
        )


def starts(system: ErrorSystem, homes: Array, seed: int = 0, setup: ObservedRobot | None = None) -> Iterator[Array]:
    """Rounds of closed configurations (c, N), where random walks from some (n, N) have come to; with a ``setting`` also
    from random closings in its operation mode, and what has left that is called back."""
    rng = np.random.default_rng(seed)
    strict = False
    if setup is not None:
        drawn = anywhere(system, rng, EQUILIBRIUM_STARTS_COUNT)
        good, kept = in_mode(system, setup, drawn), in_mode(system, setup, homes)
        kept[0] = True
        homes, strict = np.concatenate([homes[kept], drawn[good]]), not (good.all() and kept.all())
    q = homes[np.arange(EQUILIBRIUM_STARTS_COUNT) % len(homes)]
    while True:
        q = walk_at_random(system, q, rng, EQUILIBRIUM_WALK_STEPS_COUNT)
        if strict and setup is not None:
            astray = ~in_mode(system, setup, q)
            q[astray] = homes[rng.integers(len(homes), size=int(astray.sum()))]
        yield q


def critical_points(
    system: ErrorSystem,
    setup: ObservedRobot,
    goal: ClosedConfiguration,
    seed: int = 0,
    *,
    minima: bool = False,
    rounds: Iterable[Array] | None = None,
    further: Callable[[Array], Sequence[CriticalPoint]] | None = None,
    fit: Callable[[Array], NDArray[np.bool_]] | None = None,
) -> CriticalPoints:
    """The critical points to which random walks from the samples and from random closings lead, in rounds, until the
    later half of the starts finds few new ones; ``minima``: only descent, which finds what attracts; ``rounds``: of
    :func:`starts`, where they are known; ``further`` finds more of them, from configurations (n, N), beside those that
    ``fit``."""
    seen = setup.samples.members[0].relation
    idle, freedoms = seen.mobility - seen.dimension, seen.dimension
    homes = np.array([system.system.read(at.pose) for at in (goal, *setup.configurations)])
    rng = np.random.default_rng([seed, 1])
    known = DistinctPoints(system, setup)
    fresh: list[int] = []
    farthest = EQUILIBRIUM_COORDINATE_MAX + float(reaches(system).max(initial=0.0))
    points = descend(system, homes[:1], np.zeros(1, dtype=np.intp), idle, farthest)
    most = max(EQUILIBRIUM_ROUNDS_MAX, EQUILIBRIUM_COORDINATES_MAX // system.size[0])
    met = [homes]
    lies_near = not minima and further is None and all(isinstance(each, DirectionTerm) for each in system.terms)
    most = most if further is None else int(JOINT_ROUNDS_FRACTION * most)
    for q in islice(rounds or starts(system, homes, seed, setup), most):
        report("starts")
        if lies_near and known.count:
            # equilibria lie near each other
            own = np.array([each.point.q for each in known.isolated])
            some = own[rng.integers(len(own), size=round(NEARBY_STARTS_FRACTION * len(q)))]
            q = np.concatenate([q, walk_at_random(system, some, rng, 1 + len(fresh) % 3)])
        # what attracts matters most: two of five starts go down all along
        index = rng.integers(freedoms + 1, size=len(q)) * (rng.random(len(q)) < (0.0 if minima else 0.6))
        points += descend(system, q, index, idle, farthest)
        fresh.append(known.add(points))
        points = []
        met.append(q)
        least, part = (
            (ENDING_DESCENTS, LATE_STABLE_EQUILIBRIA_FRACTION) if minima else (ENDING_LEAST, LATE_EQUILIBRIA_FRACTION)
        )
        if len(fresh) > least and sum(fresh[len(fresh) // 2 :]) <= part * known.count:
            break
    late, posed = sum(fresh[len(fresh) // 2 :]), 0
    if further is not None:
        if fit is not None:
            known.keep(fit)
            late = min(late, known.count)
        pool = np.concatenate([*met, *(each.point.q[None] for each in known.isolated)])
        posed = known.add(further(pool))
    return CriticalPoints(known.isolated, known.continua, idle, sum(map(len, met[1:])), late, posed)


class DistinctPoints:
    """Distinct critical points; those that are not isolated by E and the signs of the curvatures. If joints are free to
    move while the platform does not, the one within most joint limits is kept."""

    def __init__(self, system: ErrorSystem, setup: ObservedRobot) -> None:
        self.system, self.setting, self.bodies = system, setup, list_placing_links(setup.decomposition)
        self.told, self.freedoms = told_by(setup), setup.samples.members[0].relation.dimension
        self.free = len(self.told) < len(setup.all_samples.observation_model.observations)
        self.own: dict[tuple[int, ...], list[tuple[Array, CriticalPoint, int]]] = {}
        self.families: dict[tuple[int, ...], list[CriticalPoint]] = {}

    def add(self, points: Sequence[CriticalPoint]) -> int:
        """Add points; return how many new isolated ones close all loops."""
        new = 0
        if points:
            q = np.array([each.q for each in points])
            good = are_closed(self.system, q, CRITICAL_POINT_DISTANCE_TOL) & along_all(self.system, q)
            points = [each for each, kept in zip(points, good, strict=True) if kept]
        told = marks(self.system, self.setting, self.bodies, points, self.told)
        for point, mark, across in zip(points, told, self._across(points), strict=True):
            more = len(point.curvatures) > self.freedoms
            least = (
                CRITICAL_CURVATURE_TOL if more else CRITICAL_POINT_DISTANCE_TOL * self.system.scale(point.curvatures)
            )
            flat = np.abs(point.curvatures) < least
            key = (*(int(np.sum(each)) for each in (point.curvatures < -least, flat)),)
            if flat.any():
                key = (*key, round(point.value / CRITICAL_POINT_DISTANCE_TOL), *across)
                self.families.setdefault(key, []).append(point)
                continue
            own = self.own.setdefault(key, [])
            near = next(
                (k for k, each in enumerate(own) if np.abs(mark - each[0]).max() < CRITICAL_POINT_DISTANCE_TOL), None
            )
            if near is None:
                own.append((mark, point, 1))
                new += 1
            else:
                mark, kept, met = own[near]
                if self.free and (most := self._beyond(kept)) and self._beyond(point) < most:
                    kept = point
                own[near] = (mark, kept, met + 1)
        return new

    def _across(self, points: Sequence[CriticalPoint]) -> list[list[int]]:
        """Return for each point the observed directions at right angles to the desired ones."""
        terms = [each for each in self.system.terms if isinstance(each, DirectionTerm)]
        if not terms or not points:
            return [[] for _ in points]
        carrier = SweptChains(self.system.system, list(np.array([each.q for each in points]).T))
        cosines = [np.broadcast_to(each.cosine(carrier).value, len(points)) for each in terms]
        return (np.abs(np.stack(cosines, axis=-1)) < CRITICAL_POINT_DISTANCE_TOL).astype(int).tolist()

    def _beyond(self, point: CriticalPoint) -> int:
        """Return the number of joints beyond their limits."""
        model = self.setting.all_samples.model
        try:
            return len(
                list_joints_beyond(
                    model, build_from_link_poses(model, partial(self.system.system.pose, values=point.q.tolist())).q
                )
            )
        except LoopClosureFailure:
            return len(model.mechanism.joints)

    def keep(self, fit: Callable[[Array], NDArray[np.bool_]]) -> None:
        """Leave out those whose coordinates (c, N) do not fit."""
        for key, own in self.own.items():
            kept = fit(np.array([point.q for _, point, _ in own])) if own else ()
            self.own[key] = [each for each, good in zip(own, kept, strict=True) if good]
        for key, points in self.families.items():
            kept = fit(np.array([point.q for point in points[:FAMILY_POINTS_MAX]])) if points else ()
            self.families[key] = [each for each, good in zip(points, kept, strict=False) if good]

    @property
    def count(self) -> int:
        """Number of isolated points."""
        return sum(map(len, self.own.values()))

    @property
    def continua(self) -> tuple[CountedCriticalPoint, ...]:
        """One each of those that are not."""
        return tuple(CountedCriticalPoint(points[0], len(points)) for points in self.families.values() if points)

    @property
    def isolated(self) -> tuple[CountedCriticalPoint, ...]:
        """These, with how often each was met."""
        return tuple(CountedCriticalPoint(point, met) for own in self.own.values() for _, point, met in own)


def anywhere(system: ErrorSystem, rng: np.random.Generator, count: int) -> Array:
    """Closed configurations (c, N) to which random coordinates lead, as many as close. From every other one the slides
    alone are moved at first, as far as random turns need: what slides reach ends at no other limit."""
    slides = np.array([each.slides for each in system.system.coordinates])
    q = rng.uniform(-1.0, 1.0, (count, len(slides))) * np.where(slides, PRISMATIC_START_MAX, np.pi)
    if slides.any():
        wide = np.minimum(reaches(system), EQUILIBRIUM_COORDINATE_MAX) / PRISMATIC_START_MAX
        q[::2] *= np.where(slides, 1 + rng.uniform(size=(len(q[::2]), 1)) * (wide - 1), 1.0)
        for _ in range(PRISMATIC_NEWTON_STEPS_COUNT):
            G, DG = system.closures(q[::2])
            q[::2, slides] -= times(np.linalg.pinv(DG[:, :, slides], rcond=CLOSURE_CROSSING_VALUE_TOL), G)
    q = close_loops(system, q, 40)
    return q[are_closed(system, q)]


def reaches(system: ErrorSystem) -> Array:
    """Return the range (characteristic lengths) of starts for each prismatic joint, (N,): to its limits if it has some;
    0 for rotations."""
    loops = system.system
    ends = {
        stop.joint: max((abs(end) for end in (stop.lower, stop.upper) if np.isfinite(end)), default=0.0)
        for stop in loops.mechanism.stops.values()
    }
    return np.array(
        [
            max(PRISMATIC_START_MAX, ends.get(each.joint, 0.0) / loops.length) if each.slides else 0.0
            for each in loops.coordinates
        ]
    )


def in_mode(system: ErrorSystem, setup: ObservedRobot, q: Array) -> NDArray[np.bool_]:
    """Return True for those closed, regular configurations (c, N) that are of the operation mode of the zero
    configuration, with all observed points in front of their camera."""
    drawn, kept = setup.all_samples, np.zeros(len(q), dtype=bool)
    law = Law(setup.samples.observation_model, setup.dof, 1.0)
    poses = {link: system.system.pose(link, q.T) for link in drawn.model.mechanism.links}
    for k in range(len(q)):
        try:
            at = build_from_link_poses(drawn.model, {link: X[k] for link, X in poses.items()}.__getitem__)
        except LoopClosureFailure:
            continue
        kept[k] = law.in_front(at) > VISIBLE_SINE_MIN and (
            not system.size[1]
            or drawn.signature.may_be_same_mode(Signature.of(compute_relation(at, drawn.observation_model)))
        )
    return kept


def along_all(system: ErrorSystem, q: Array) -> NDArray[np.bool_]:
    """Return True for critical points (c, N) at which E is critical along all motions that the loops leave to first
    order: where two families of closures meet, multipliers without bound would hold any slope across these."""
    rates = system.closures(q)[1]
    if system.has_assumed_depths or not rates.shape[1]:
        return np.ones(len(q), dtype=bool)
    _, sizes, ways = np.linalg.svd(rates, full_matrices=False)
    slopes = np.abs(times(ways, np.nan_to_num(CriticalPointEquations(system, list(q.T)).slope)))
    return ~np.any((sizes < CLOSURE_CROSSING_VALUE_TOL * sizes[:, :1]) & (slopes > CLOSURE_CROSSING_VALUE_TOL), axis=1)


def marks(
    system: ErrorSystem,
    setup: ObservedRobot,
    bodies: Sequence[str],
    points: Sequence[CriticalPoint],
    told: Sequence[Observation] | None = None,
) -> Array:
    """Return values that distinguish configurations (n, k): the poses of the platform's links, the directions of all
    segments that these poses and the measured values determine (not an arm's elbow that is free to move)."""
    if not points:
        return np.zeros((0, 0))
    loops, links = system.system, system.system.mechanism.links
    carrier = SweptChains(loops, list(np.array([each.q for each in points]).T))
    parts = []
    for body in bodies:
        chain, X = loops.way(loops.body[body]), links[body].pose
        parts.append(carrier.point(chain, X[:3, 3] / loops.length).value)
        if setup.motion.body:
            parts += [carrier.direction(chain, axis).value for axis in X[:3, :2].T]
    for seen in told_by(setup) if told is None else told:
        if isinstance(seen, SeenAxis):
            parts.append(
                carrier.direction(
                    loops.way(loops.body[seen.link]), links[seen.link].pose[:3, :3] @ seen.direction
                ).value
            )
    return np.concatenate([np.broadcast_to(each, (len(points), 3)) for each in parts], axis=-1)


def told_by(setup: ObservedRobot) -> tuple[Observation, ...]:
    """Return observations of the robot that do not change while the platform and the measured values are fixed."""
    every, own = setup.all_samples, [o.key for o in setup.observed]
    held = setup.samples.members[0].relation.dimension
    if every.members[0].relation.dimension == held:
        return every.observation_model.observations
    return tuple(
        o
        for o in every.observation_model.observations
        if o.key in own or every.restrict([*setup.observed, o], ways=False).members[0].relation.dimension == held
    )
