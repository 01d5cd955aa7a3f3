"""Critical points of the error on closed loops, from many starts at once: to minima, saddles of each index and maxima.

About a configuration the columns of Z span the motions of the closed loops; the step Z s + p closes them (p, normal to
Z) and solves ZᵀHZ s = −Zᵀ(∇E + H p), H the Hessian of E + μ · G: Newton's method on ∇E + DGᵀ μ = 0 beside G = 0. Along
the eigenvectors of ZᵀHZ with the k lowest eigenvalues it goes up instead, along all others down, which leads to
critical points of index k (C. J. Cerjan, W. H. Miller, J. Chem. Phys. 75, 1981). Nothing here proves anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot, restricted
from ...budgets import (
    ENDING_DESCENTS,
    ENDING_EFFORT,
    ENDING_LATE,
    ENDING_LATE_DESCENT,
    ENDING_LEAST,
    ENDING_ROUNDS,
    ENDING_STARTS,
    ENDING_STEPS,
    ENDING_WALK,
    FARTHEST_ENDING,
    POSE_WALKS,
)
from ...constraints.pattern import moved
from ...errors import LoopsNotClosed
from ...geometry.vectors import Array, times
from ...kinematics.assembly import of_links
from ...kinematics.branch import Signature
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import outside
from ...kinematics.relation import relation
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import SeenAxis
from ...progress import tell
from ...results import Value
from ...tolerances import (
    COMMAND_CUTOFF,
    COMMAND_STEP,
    CRITICAL,
    CRITICAL_FLAT,
    DEPENDENT,
    ERROR_ROUNDING,
    SAME_ENDING,
    SEEN_ABOVE,
)
from ..law import Law
from .carried import SweptChains
from .error import DirectionTerm, RestEquations, RestSystem

LONGEST_STEP = 0.25
"""Longest change of a coordinate in a step (characteristic lengths, radians)."""
SHARPENING_STEPS = 4
"""Newton's steps from a critical point that was found."""
WALK_STEP = 0.3
"""The same of a random step between starts."""
BESIDE = 0.5
"""So many times as many starts lie a few random steps beside rests that were found, where there are no closed forms."""
WIDEST_SLIDE = 2.5
"""Coordinate of a slide (characteristic lengths) up to which one is drawn."""
FAMILY_TRIES = 8
"""Points of one continuum, at most, of which one is to lie in the operation mode of the zero configuration."""
NEARBY = 0.02
"""Step (characteristic lengths, radians) to a configuration that shows the operation mode in which a point lies."""


class Equations(Protocol):
    """Equations G (c, m) with derivatives DG (c, m, N), and E (c,) with its gradient (c, N)."""

    G: Any
    DG: Any
    E: Any
    slope: Any

    def bend(self, multipliers: Any) -> Any:
        """The Hessian (c, N, N) of E + μ · G."""


class Critically(Protocol):
    """Whose critical points are sought."""

    def at(self, values: Sequence[Any]) -> Equations:
        """Its equations at values (N,) of (c,) each."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoint(Value):
    """A critical point of E: coordinates (N,) and multipliers (m,), ∇E on the loops and G as they are left
    (``residual``), and the eigenvalues of the Hessian along the motions of the loops, ascending, without those of
    motions that are idle there; ``value`` is E."""

    q: Array
    multipliers: Array
    residual: float
    curvatures: Array
    value: float

    @property
    def vanishes(self) -> bool:
        """Whether e = 0, as far as E = ½ ‖e‖², a difference of numbers of size one, tells it."""
        return self.value < ERROR_ROUNDING


@dataclass(frozen=True, eq=False)
class Tangents:
    """The motions of the loops at configurations (c,): Z (c, N, d), Y (c, N, m) normal to them, R (c, m, m) with DGᵀ =
    Y R."""

    Z: Array
    Y: Array
    R: Array

    @classmethod
    def of(cls, DG: Array) -> Tangents:
        """Those of DG (c, m, N)."""
        m = DG.shape[-2]
        Q, R = np.linalg.qr(np.swapaxes(DG, -1, -2), mode="complete")
        R = R[..., :m, :]
        # a row that is lost counts as a faint one
        faint = np.abs(np.diagonal(R, axis1=-2, axis2=-1)) < 1e-12
        R = R + np.where(faint, 1e-12, 0.0)[..., None] * np.eye(m)
        return cls(Q[..., m:], Q[..., :m], R)

    def closing(self, G: Array) -> Array:
        """p (c, N), normal to Z, with DG p = −G."""
        return -1.0 * times(self.Y, np.linalg.solve(np.swapaxes(self.R, -1, -2), G[..., None])[..., 0])

    def multipliers(self, slope: Array) -> Array:
        """μ (c, m) with ∇E + DGᵀ μ in the span of Z."""
        return np.asarray(-np.linalg.solve(self.R, times(np.swapaxes(self.Y, -1, -2), slope)[..., None])[..., 0])


@dataclass(frozen=True, eq=False)
class Expansion:
    """E on the loops to second order at configurations (c,): the closing step p (c, N), multipliers μ (c, m), gradient
    (c, d) and Hessian along Z: its eigenvalues (c, d) and directions (c, N, d), the last ``idle`` of them those of the
    motions that are most nearly idle."""

    E: Array
    closing: Array
    multipliers: Array
    slope: Array
    curvatures: Array
    directions: Array
    residual: Array
    idle: int

    @property
    def freedoms(self) -> int:
        """d without idle motions."""
        return self.curvatures.shape[-1] - self.idle

    def told(self, k: int) -> Array:
        """The curvatures of the k-th configuration, ascending: of idle motions none but those that are not idle there,
        as where an arm with a joint more than freedoms is stretched."""
        values, d = self.curvatures[k], self.freedoms
        return np.sort(np.concatenate([values[:d], values[d:][np.abs(values[d:]) > CRITICAL_FLAT]]))

    @classmethod
    def of(cls, system: Critically, q: Array, idle: int) -> Expansion:
        """That at q (c, N)."""
        with np.errstate(all="ignore"):
            at = system.at(list(q.T))
            tangents = Tangents.of(at.DG)
            p, mu = tangents.closing(at.G), tangents.multipliers(np.nan_to_num(at.slope))
            H = at.bend(mu)
        Z = tangents.Z
        back = np.swapaxes(Z, -1, -2)
        # where nothing is measured there is no way to go
        lost = ~np.isfinite(H).all(axis=(-1, -2))
        H, p = np.where(lost[:, None, None], 0.0, H), np.where(lost[:, None], np.nan, p)
        flat = times(back, at.slope)
        slope = flat + times(back, times(H, p))
        values, vectors = np.linalg.eigh(back @ H @ Z)
        along = times(np.swapaxes(vectors, -1, -2), slope)
        still = np.argsort(np.argsort(np.abs(values) + np.abs(along), axis=-1), axis=-1) < idle
        order = np.argsort(np.where(still, np.inf, values), axis=-1, kind="stable")
        values, along = (np.take_along_axis(each, order, -1) for each in (values, along))
        vectors = np.take_along_axis(vectors, order[..., None, :], -1)
        return cls(at.E, p, mu, along, values, Z @ vectors,
                   np.maximum(np.linalg.norm(at.G, axis=-1), np.linalg.norm(flat, axis=-1)), idle)


def _shortened(step: Array, longest: float) -> Array:
    """Steps (c, N), none of whose changes is longer."""
    size = np.abs(step).max(axis=-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, longest / np.maximum(size, longest)))


def closed(system: RestSystem, q: Array, steps: int = 12) -> Array:
    """Configurations (c, N) moved to the nearest closed ones, as far as Gauss and Newton's method does it."""
    for _ in range(steps):
        G, DG = system.closures(q)
        if np.linalg.norm(G, axis=-1).max(initial=0.0) < CRITICAL:
            break
        back = np.swapaxes(DG, -1, -2)
        # all equations, of which some may depend on others: the shortest step
        gram = DG @ back
        gram += DEPENDENT * np.maximum(1.0, np.trace(gram, axis1=-2, axis2=-1))[:, None, None] * np.eye(G.shape[-1])
        q = q + _shortened(times(back, -np.linalg.solve(gram, G[..., None])[..., 0]), LONGEST_STEP)
    return q


def are_closed(system: RestSystem, q: Array, within: float = CRITICAL) -> NDArray[np.bool_]:
    """At which configurations (c, N) all equations of the loops hold, to a residual."""
    return np.asarray(np.linalg.norm(system.closures(q)[0], axis=-1) < within)


def walked(system: RestSystem, q: Array, rng: np.random.Generator, steps: int, longest: float = WALK_STEP) -> Array:
    """Closed configurations (c, N), each led so many random steps along the loops; those that do not close stay."""
    for _ in range(steps):
        tangents = Tangents.of(RestEquations(system, list(q.T)).DG)
        way = times(tangents.Z, rng.normal(size=(len(q), tangents.Z.shape[-1])))
        there = closed(system, q + longest * rng.uniform(0.2, 1.0, (len(q), 1)) * way / np.abs(way).max(
            axis=-1, keepdims=True), 6)
        good = are_closed(system, there)
        good &= np.abs(there - q).max(axis=-1) < 2 * longest
        q = np.where(good[:, None], there, q)
    return q


def descend(system: Critically, q: Array, index: NDArray[np.intp], idle: int, farthest: float = FARTHEST_ENDING
            ) -> list[CriticalPoint]:
    """The critical points to which starts (c, N) lead, each sought as one of an index (c,), or (−1) by Newton's method
    whatever it is; none with a coordinate beyond ``farthest``."""
    if isinstance(system, RestSystem) and system.supposes:
        return settle(system, q, index, idle)
    found: list[CriticalPoint] = []
    for _ in range(ENDING_STEPS):
        if not len(q):
            break
        at = Expansion.of(system, q, idle)
        done = at.residual < CRITICAL
        found += [CriticalPoint(q[k], at.multipliers[k], float(at.residual[k]), at.told(int(k)), float(at.E[k]))
                  for k in np.flatnonzero(done)]
        up = np.arange(at.curvatures.shape[-1]) < np.minimum(index, at.freedoms)[:, None]
        size = np.maximum(np.abs(at.curvatures), CRITICAL_FLAT)
        # near a critical point: Newton's method, whatever it is
        near = (at.residual < 1e-3) & (np.abs(at.slope / size)[:, : at.freedoms].max(axis=-1, initial=0.0) < 0.05)
        near |= index < 0
        sign = np.where(near[:, None], -np.sign(at.curvatures), np.where(up, 1.0, -1.0))
        sign[:, at.freedoms :] *= np.abs(at.curvatures[:, at.freedoms :]) > CRITICAL_FLAT
        step = _shortened(times(at.directions, sign * at.slope / size), LONGEST_STEP)
        q = q + step + _shortened(at.closing, LONGEST_STEP)
        going = ~done & np.isfinite(q).all(axis=-1) & (np.abs(q).max(axis=-1) < farthest)
        q, index = q[going], index[going]
    return found


def sharpened(system: Critically, points: Sequence[CriticalPoint], idle: int) -> list[CriticalPoint]:
    """Critical points after a few more of Newton's steps: where E is nearly flat, as far away, it is known where they
    are to fewer digits than ∇E."""
    if not points:
        return []
    q = np.array([each.q for each in points])
    for _ in range(SHARPENING_STEPS):
        at = Expansion.of(system, q, idle)
        size = np.where(np.abs(at.curvatures) > CRITICAL, at.curvatures, np.inf)
        q = q + times(at.directions, -at.slope / size) + at.closing
    at = Expansion.of(system, q, idle)
    return [CriticalPoint(q[k], at.multipliers[k], float(at.residual[k]), at.told(k), float(at.E[k]))
            for k in range(len(q)) if at.residual[k] < CRITICAL]


def settle(system: RestSystem, q: Array, index: NDArray[np.intp], idle: int) -> list[CriticalPoint]:
    """The zeros of J̃ᵀe along the motions of the loops, J̃ the rates that the law supposes, to which starts (c, N) lead:
    implicit steps of the loop s' = −(J̃ᵀJ̃)⁻¹ J̃ᵀe, which end where it does, or (``index`` not 0) Newton's method.
    ``curvatures`` are real parts of the eigenvalues of the loop, linearised, over −λ."""
    found: list[CriticalPoint] = []
    flows = index == 0
    for _ in range(ENDING_STEPS):
        if not len(q):
            break
        with np.errstate(all="ignore"):
            at = RestEquations(system, list(q.T))
            tangents = Tangents.of(at.DG)
            Z, back = tangents.Z, np.swapaxes(tangents.Z, -1, -2)
            E, pull, gram = at.commanded()
            lost = np.asarray(~np.isfinite(gram).all(axis=(-1, -2)) | ~np.isfinite(pull).all(axis=-1))
            pull, gram = np.where(lost[:, None], 0.0, pull), np.where(lost[:, None, None], 0.0, gram)
            mu, p, v, M = tangents.multipliers(pull), tangents.closing(at.G), times(back, pull), back @ gram @ Z
            there = (q[:, None] + COMMAND_STEP * back).reshape(-1, q.shape[1])
            turned = RestEquations(system, list(there.T)).commanded()[1].reshape(*back.shape) - pull[:, None]
            A = back @ (np.swapaxes(np.nan_to_num(turned), -1, -2) / COMMAND_STEP + at.bend(mu, error=False) @ Z)
        residual = np.maximum(np.linalg.norm(at.G, axis=-1), np.linalg.norm(v, axis=-1))
        done = (residual < CRITICAL) & ~lost
        inverse = np.linalg.pinv(M, rcond=COMMAND_CUTOFF, hermitian=True)
        for k in np.flatnonzero(done):
            values = np.linalg.eigvals(inverse[k] @ A[k])
            kept = values[np.argsort(np.abs(values))[idle:]].real
            found.append(CriticalPoint(q[k], mu[k], float(residual[k]), np.sort(kept), float(E[k])))
        # steps of half a unit of time where the loop is fast, longer ones where it slows down
        slow = np.where(flows, 2 * np.minimum(1.0, np.linalg.norm(times(inverse, v), axis=-1)), 0.0)
        step = -times(np.linalg.pinv(slow[:, None, None] * M + A, rcond=COMMAND_CUTOFF), v)
        q = q + _shortened(times(Z, step), LONGEST_STEP) + _shortened(p, LONGEST_STEP)
        going = ~done & ~lost & np.isfinite(q).all(axis=-1) & (np.abs(q).max(axis=-1) < FARTHEST_ENDING)
        q, flows = q[going], flows[going]
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Critical(Value):
    """A critical point, and how often it was met."""

    point: CriticalPoint
    met: int


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoints(Value):
    """What a search found: isolated critical points, and of those that fill curves or surfaces one for each value of E
    and signs of the curvatures; how many ``starts`` there were, and how many of the isolated ones the last half of them
    found first (``late``); how many only the search over the platform's pose found (``posed``), and an estimate of how
    many more there are at least that it did not meet (``unmet``, None where there was none)."""

    isolated: tuple[Critical, ...]
    continua: tuple[Critical, ...]
    idle: int
    starts: int
    late: int
    posed: int = 0
    unmet: int | None = None

    @property
    def words(self) -> str:
        """What was done, and how well it covers."""
        also = f", {self.posed} more over the platform's pose" if self.posed else ""
        also += "" if self.unmet is None else f"; an estimate, by how often each was met: {self.unmet or 'no'} more"
        return (f"found from {self.starts:,} random starts, {self.late} of {len(self.isolated) - self.posed} "
                f"configurations first in the second half of these{also}")


def starts(system: RestSystem, homes: Array, seed: int = 0, setting: ObservedRobot | None = None) -> Iterator[Array]:
    """Rounds of closed configurations (c, N), where random walks from some (n, N) have come to; with a ``setting`` also
    from random closings in its operation mode, and what has left that is called back."""
    rng = np.random.default_rng(seed)
    strict = False
    if setting is not None:
        drawn = anywhere(system, rng, ENDING_STARTS)
        good, kept = in_mode(system, setting, drawn), in_mode(system, setting, homes)
        kept[0] = True
        homes, strict = np.concatenate([homes[kept], drawn[good]]), not (good.all() and kept.all())
    q = homes[np.arange(ENDING_STARTS) % len(homes)]
    while True:
        q = walked(system, q, rng, ENDING_WALK)
        if strict and setting is not None:
            astray = ~in_mode(system, setting, q)
            q[astray] = homes[rng.integers(len(homes), size=int(astray.sum()))]
        yield q


def critical_points(system: RestSystem, setting: ObservedRobot, goal: ClosedConfiguration, seed: int = 0, *,
                    minima: bool = False, rounds: Iterable[Array] | None = None,
                    further: Callable[[Array], Sequence[CriticalPoint]] | None = None,
                    fit: Callable[[Array], NDArray[np.bool_]] | None = None) -> CriticalPoints:
    """The critical points to which random walks from the samples and from random closings lead, in rounds, until the
    later half of the starts finds few new ones; ``minima``: only descent, which finds what attracts; ``rounds``: of
    :func:`starts`, where they are known; ``further`` finds more of them, from configurations (n, N), beside those that
    ``fit``."""
    seen = setting.samples.members[0].relation
    idle, freedoms = seen.mobility - seen.dimension, seen.dimension
    homes = np.array([system.system.read(at.pose) for at in (goal, *setting.configurations)])
    rng = np.random.default_rng([seed, 1])
    known = ToldApart(system, setting)
    fresh: list[int] = []
    points = descend(system, homes[:1], np.zeros(1, dtype=np.intp), idle)
    most = max(ENDING_ROUNDS, ENDING_EFFORT // system.size[0])
    met = [homes]
    lies_near = not minima and further is None and all(isinstance(each, DirectionTerm) for each in system.terms)
    most = most if further is None else int(POSE_WALKS * most)
    for q in islice(rounds or starts(system, homes, seed, setting), most):
        tell("starts")
        if lies_near and known.count:
            # rests lie near each other
            own = np.array([each.point.q for each in known.isolated])
            some = own[rng.integers(len(own), size=round(BESIDE * len(q)))]
            q = np.concatenate([q, walked(system, some, rng, 1 + len(fresh) % 3)])
        # what attracts matters most: two of five starts go down all along
        index = rng.integers(freedoms + 1, size=len(q)) * (rng.random(len(q)) < (0.0 if minima else 0.6))
        points += descend(system, q, index, idle)
        fresh.append(known.add(points))
        points = []
        met.append(q)
        least, part = (ENDING_DESCENTS, ENDING_LATE_DESCENT) if minima else (ENDING_LEAST, ENDING_LATE)
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


class ToldApart:
    """Critical points, told apart; those that are not isolated by E and the signs of the curvatures. Where joints are
    free to move though the platform rests, one is kept that is beyond as few limits as any that was met."""

    def __init__(self, system: RestSystem, setting: ObservedRobot) -> None:
        self.system, self.setting, self.bodies = system, setting, moved(setting.anatomy)
        self.told, self.freedoms = told_by(setting), setting.samples.members[0].relation.dimension
        self.free = len(self.told) < len(setting.everything.question.observations)
        self.own: dict[tuple[int, ...], list[tuple[Array, CriticalPoint, int]]] = {}
        self.families: dict[tuple[int, ...], list[CriticalPoint]] = {}

    def add(self, points: Sequence[CriticalPoint]) -> int:
        """How many isolated ones are new, of those that leave no loop open."""
        new = 0
        if points:
            good = are_closed(self.system, np.array([each.q for each in points]), SAME_ENDING)
            points = [each for each, kept in zip(points, good, strict=True) if kept]
        told = marks(self.system, self.setting, self.bodies, points, self.told)
        for point, mark, across in zip(points, told, self._across(points), strict=True):
            more = len(point.curvatures) > self.freedoms
            least = CRITICAL_FLAT if more else SAME_ENDING * self.system.scale(point.curvatures)
            flat = np.abs(point.curvatures) < least
            key = (*(int(np.sum(each)) for each in (point.curvatures < -least, flat)),)
            if flat.any():
                key = (*key, round(point.value / SAME_ENDING), *across)
                self.families.setdefault(key, []).append(point)
                continue
            own = self.own.setdefault(key, [])
            near = next((k for k, each in enumerate(own) if np.abs(mark - each[0]).max() < SAME_ENDING), None)
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
        """Of each point, which of the observed directions are at right angles to the desired ones."""
        terms = [each for each in self.system.terms if isinstance(each, DirectionTerm)]
        if not terms or not points:
            return [[] for _ in points]
        carrier = SweptChains(self.system.system, list(np.array([each.q for each in points]).T))
        cosines = [np.broadcast_to(each.cosine(carrier).value, len(points)) for each in terms]
        return (np.abs(np.stack(cosines, axis=-1)) < SAME_ENDING).astype(int).tolist()

    def _beyond(self, point: CriticalPoint) -> int:
        """How many joints are beyond their limits."""
        twin = self.setting.everything.twin
        try:
            return len(outside(twin, of_links(twin, partial(self.system.system.pose, values=point.q.tolist())).q))
        except LoopsNotClosed:
            return len(twin.mechanism.joints)

    def keep(self, fit: Callable[[Array], NDArray[np.bool_]]) -> None:
        """Leave out those whose coordinates (c, N) do not fit."""
        for key, own in self.own.items():
            kept = fit(np.array([point.q for _, point, _ in own])) if own else ()
            self.own[key] = [each for each, good in zip(own, kept, strict=True) if good]
        for key, points in self.families.items():
            kept = fit(np.array([point.q for point in points[:FAMILY_TRIES]])) if points else ()
            self.families[key] = [each for each, good in zip(points, kept, strict=False) if good]

    @property
    def count(self) -> int:
        """How many are isolated."""
        return sum(map(len, self.own.values()))

    @property
    def continua(self) -> tuple[Critical, ...]:
        """One each of those that are not."""
        return tuple(Critical(points[0], len(points)) for points in self.families.values() if points)

    @property
    def isolated(self) -> tuple[Critical, ...]:
        """These, with how often each was met."""
        return tuple(Critical(point, met) for own in self.own.values() for _, point, met in own)


def anywhere(system: RestSystem, rng: np.random.Generator, count: int) -> Array:
    """Closed configurations (c, N) to which random coordinates lead, as many as close."""
    slides = np.array([each.slides for each in system.system.coordinates])
    q = rng.uniform(-1.0, 1.0, (count, len(slides))) * np.where(slides, WIDEST_SLIDE, np.pi)
    q = closed(system, q, 40)
    return q[are_closed(system, q)]


def in_mode(system: RestSystem, setting: ObservedRobot, q: Array) -> NDArray[np.bool_]:
    """Which of some closed configurations (c, N), regular ones, are of the operation mode of the zero configuration,
    with all that is to be seen in front of its camera."""
    drawn, kept = setting.everything, np.zeros(len(q), dtype=bool)
    law = Law(setting.samples.question, setting.dof, 1.0)
    poses = {link: system.system.pose(link, q.T) for link in drawn.twin.mechanism.links}
    for k in range(len(q)):
        try:
            at = of_links(drawn.twin, {link: X[k] for link, X in poses.items()}.__getitem__)
        except LoopsNotClosed:
            continue
        kept[k] = law.in_front(at) > SEEN_ABOVE and (
            not system.size[1] or drawn.signature.agrees(Signature.of(relation(at, drawn.question))))
    return kept


def marks(system: RestSystem, setting: ObservedRobot, bodies: Sequence[str], points: Sequence[CriticalPoint],
          told: Sequence[Observation] | None = None) -> Array:
    """What tells configurations (n, k) apart: the poses of the platform's bodies and the directions of all segments
    that have one for each of these poses and what is measured (an arm's elbow that is free to move has not)."""
    if not points:
        return np.zeros((0, 0))
    loops, links = system.system, system.system.mechanism.links
    carrier = SweptChains(loops, list(np.array([each.q for each in points]).T))
    parts = []
    for body in bodies:
        chain, X = loops.way(loops.body[body]), links[body].pose
        parts.append(carrier.point(chain, X[:3, 3] / loops.length).value)
        if setting.motion.body:
            parts += [carrier.direction(chain, axis).value for axis in X[:3, :2].T]
    for seen in told_by(setting) if told is None else told:
        if isinstance(seen, SeenAxis):
            parts.append(carrier.direction(loops.way(loops.body[seen.link]),
                                           links[seen.link].pose[:3, :3] @ seen.direction).value)
    return np.concatenate([np.broadcast_to(each, (len(points), 3)) for each in parts], axis=-1)


def told_by(setting: ObservedRobot) -> tuple[Observation, ...]:
    """What can be observed of the robot that does not move where the platform and what is observed are held."""
    every, own = setting.everything, [o.key for o in setting.observed]
    held = setting.samples.members[0].relation.dimension
    if every.members[0].relation.dimension == held:
        return every.question.observations
    return tuple(o for o in every.question.observations if o.key in own or
                 restricted(every, [*setting.observed, o], ways=False).members[0].relation.dimension == held)
