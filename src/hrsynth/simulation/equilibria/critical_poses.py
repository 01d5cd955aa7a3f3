"""Critical points of the error over the platform's pose, where legs have closed forms, and the joints that reach them.

A pose and the working modes of the observed legs determine the error (:mod:`.pose_system`), so that a start is cheap:
few coordinates. Starts are everywhere within the legs' reach, in all working modes, with random rotations of the
platform, and beside poses already found, as equilibria lie near each other. Nothing here is a proof.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot
from ...equations.carried_vectors import CarriedVector, SweptChains
from ...equations.measured_error import ErrorSystem
from ...geometry.so3 import convert_to_quaternions
from ...geometry.vectors import Array, transform
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import SeenAxis
from ...progress import report
from ...results import Value
from ...tolerances import CRITICAL_POINT_DISTANCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .descent import CriticalPoint, descend
from .exhaustive_search import POSITION_BOX_HALF_WIDTH_FRACTION, reachable_box
from .pose_error import EnclosureFailure, PoseError
from .pose_system import LegSystem

POSE_STARTS, POSE_ROUNDS = 800, 60
"""Starts of one round of the search of critical poses with closed-form legs, and rounds per choice of locked legs."""
NEARBY_POSE_STARTS_FRACTION = 0.6
"""Fraction of these starts near poses found before."""
POSE_NEWTON_FRACTION = 0.5
"""Fraction of the latter that uses Newton's method throughout."""
POSE_DRAWS_PER_START_COUNT = 16
"""Largest ratio of poses drawn to poses in reach."""
POSE_LATE, POSE_QUIET = 0.001, 8
"""Fraction of the critical poses first found in the last rounds, and their number, at which the search ends."""
POSE_CONFIGURATIONS_MAX = 12
"""Nearest configurations from which one at a critical pose is searched."""
MIRRORED_RODS_MAX = 3
"""Largest number of rods sliding through a base point with both directions listed at each pose."""

CRITICAL_POSE_STEP_MAX = 0.25
"""Longest change of a coordinate in a step."""
Fit = Callable[[Array], NDArray[np.bool_]]
"""Test of configurations (c, N)."""
BESIDE = (0.1, 0.3, 0.6, 1.0)
"""Distance (characteristic lengths, components of a quaternion) of starts from poses already found, about."""
START_BOX_WIDTH_FRACTION = 3.0
"""Factor of the box of starts over the searched one, if legs do not bound it."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoses(Value):
    """Poses p (k, 3) (m), R (k, 3, 3), the observed directions u (k, legs, 3) there, the numbers (k,) of directions in
    which E falls, and how many (k,) starts from anywhere met each."""

    p: Array
    R: Array
    directions: Array
    falling: NDArray[np.intp]
    met: NDArray[np.intp]

    def some(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> CriticalPoses:
        """Some of them."""
        return CriticalPoses(*(each[which] for each in vars(self).values()))

    def __len__(self) -> int:
        return len(self.p)

    @property
    def unmet(self) -> int:
        """An estimate of how many more there are, at least: f₁ (f₁ − 1) / 2 (f₂ + 1), f₁ met once and f₂ twice, less
        those that were found otherwise (A. Chao, Scand. J. Statist. 11, 1984)."""
        never, once, twice = (int(np.sum(self.met == count)) for count in range(3))
        return max(0, round(once * (once - 1) / (2 * (twice + 1))) - never)

    @property
    def marks(self) -> Array:
        """Return the values that distinguish them, (k, n)."""
        return np.concatenate([self.p, *np.moveaxis(self.R, 1, 0), *np.moveaxis(self.directions, 1, 0)], axis=1)


def critical_poses(
    setup: ObservedRobot, goal: ClosedConfiguration, seed: int = 0
) -> tuple[PoseError, CriticalPoses, CriticalPoses, int] | None:
    """The isolated ones that are found, with each choice of held legs in rounds until these add little, one each of
    those that fill curves, and an estimate of how many were not met; None where the error is no closed form of the
    pose."""
    try:
        error = PoseError.of(setup, goal)
    except EnclosureFailure:
        return None
    rng, systems = np.random.default_rng([seed, 2]), [LegSystem.of(error, held) for held in _held_sets(error)]
    found, continua = _none(systems[0]), dict[tuple[int, ...], CriticalPoses]()
    for system in systems:
        fresh: list[int] = []
        while len(fresh) < POSE_ROUNDS and (
            len(fresh) < POSE_QUIET or sum(fresh[-POSE_QUIET:]) > POSE_LATE * len(found)
        ):
            report("poses")
            before = len(found)
            drawn, flat = _round(system, found, rng)
            found, continua = _apart(found, drawn), flat | continua
            fresh.append(len(found) - before)
    return error, _mirror(error, found), _join([_none(systems[0]), *continua.values()]), found.unmet


def _apart(found: CriticalPoses, drawn: CriticalPoses) -> CriticalPoses:
    """Both, each pose once."""
    every = _join([found, drawn])
    marks, met, kept = every.marks, every.met.copy(), list(range(len(found)))
    for k in range(len(found), len(marks)):
        alike = np.flatnonzero(np.abs(marks[kept] - marks[k]).max(axis=1) < CRITICAL_POINT_DISTANCE_TOL)
        if len(alike):
            met[kept[alike[0]]] += met[k]
        else:
            kept.append(k)
    return replace(every, met=met).some(np.array(kept, dtype=np.intp))


def _held_sets(error: PoseError) -> list[tuple[int, ...]]:
    """Return the sets of legs that are fixed, the empty set first: unobserved ones at their limits, as E does not
    depend on their distance from it; of observed sliding rods one that is free, as it may be short."""
    watched = {each.limb for each in error.seen}
    idle = [i for i, limb in enumerate(error.limbs) if i not in watched and not limb.slides]
    held = [chosen for size in range(min(len(idle), error.size - 1) + 1) for chosen in combinations(idle, size)]
    return [
        (*chosen, *free)
        for free in ((), *((i,) for i in watched if i is not None and error.limbs[i].is_free))
        for chosen in held
    ]


def _beside(system: LegSystem, found: CriticalPoses, count: int, rng: np.random.Generator) -> Array:
    """Coordinates of poses (count, k) beside some that were found."""
    error, k, n = system.error, system.quaternion.start, system.quaternion.stop
    some = rng.integers(len(found), size=count)
    x = np.zeros((count, n))
    x[:, :k] = (found.p[some] / error.length - error.p) @ error.shifts
    if n > k:
        x[:, k:] = convert_to_quaternions(found.R[some] @ error.R.T) @ system.span
    return x + rng.normal(size=x.shape) * rng.choice(BESIDE, size=(count, 1))


def _round(
    system: LegSystem, old: CriticalPoses, rng: np.random.Generator
) -> tuple[CriticalPoses, dict[tuple[int, ...], CriticalPoses]]:
    """Starts led to critical points of each index: those at which the legs that are not looked at reach, and whose held
    legs hold them, isolated; of others one for each value of E and signs of the curvatures. Some starts lie beside
    poses that are known; half of the others are random poses, of half a leg's joints are so, which are more often near
    its limits."""
    error = system.error
    low, high, _ = reachable_box(error, START_BOX_WIDTH_FRACTION * POSITION_BOX_HALF_WIDTH_FRACTION)
    k, n = error.shifts.shape[1], system.quaternion.stop
    count = POSE_STARTS
    x = np.concatenate(
        [
            rng.uniform(low[:k], high[:k], (POSE_DRAWS_PER_START_COUNT * count, k)),
            rng.normal(size=(POSE_DRAWS_PER_START_COUNT * count, n - k)),
        ],
        axis=1,
    )
    own = system.draw(system.about_legs(x[: len(x) // 4], START_BOX_WIDTH_FRACTION, rng), rng)[: count // 2]
    y = np.concatenate([own, system.draw(x, rng)])[:count]
    if len(old):
        near = system.draw(_beside(system, old, 4 * round(NEARBY_POSE_STARTS_FRACTION * count), rng), rng)[
            : round(NEARBY_POSE_STARTS_FRACTION * count)
        ]
        beside, families = _lead_starts(system, near, rng)
        some, more = _lead_starts(system, rng.permutation(y)[: len(y) - len(near)], rng)
        return _join([some, replace(beside, met=0 * beside.met)]), families | more
    return _lead_starts(system, y, rng)


def _lead_starts(
    system: LegSystem, y: Array, rng: np.random.Generator
) -> tuple[CriticalPoses, dict[tuple[int, ...], CriticalPoses]]:
    """Return the results of starts (c, N)."""
    error = system.error
    with np.errstate(all="ignore"):
        index = rng.integers(system.size[0] - system.size[1] + 1, size=len(y))
        points = descend(system, y, np.where(rng.random(len(y)) < POSE_NEWTON_FRACTION, -1, index), 0)
        kept = [
            each
            for each in points
            if all(abs(each.multipliers[row]) > CRITICAL_POINT_DISTANCE_TOL for row in system.holding)
        ]
        y = np.array([each.q for each in kept]).reshape(len(kept), system.size[0])
        falling = np.array([np.sum(each.curvatures < -CRITICAL_POINT_DISTANCE_TOL) for each in kept], dtype=np.intp)
        flat = np.array(
            [np.sum(np.abs(each.curvatures) <= CRITICAL_POINT_DISTANCE_TOL) for each in kept], dtype=np.intp
        )
        found = CriticalPoses(
            error.length * system.point(y),
            system.rotation(y),
            system.directions(y),
            falling,
            np.ones(len(y), dtype=np.intp),
        )
        reached = system.is_reached(y)
        across = np.abs(np.einsum("cla,la->cl", found.directions, system.wanted)) < CRITICAL_POINT_DISTANCE_TOL
    families: dict[tuple[int, ...], CriticalPoses] = {}
    for k in np.flatnonzero(reached & (flat > 0)):
        families[
            int(falling[k]), int(flat[k]), round(kept[k].value / CRITICAL_POINT_DISTANCE_TOL), *across[k].astype(int)
        ] = found.some(np.array([k]))
    return found.some(reached & (flat == 0)), families


def _none(system: LegSystem) -> CriticalPoses:
    return CriticalPoses(
        np.zeros((0, 3)),
        np.zeros((0, 3, 3)),
        np.zeros((0, len(system.error.seen), 3)),
        *np.zeros((2, 0), dtype=np.intp),
    )


def _join(parts: list[CriticalPoses]) -> CriticalPoses:
    return CriticalPoses(*(np.concatenate(each) for each in zip(*(vars(part).values() for part in parts), strict=True)))


def _mirror(error: PoseError, found: CriticalPoses) -> CriticalPoses:
    """With all choices of directions under which E is the same, where these are few."""
    signs = error.mirrors
    if not 1 < len(signs) <= 2**MIRRORED_RODS_MAX:
        return found
    others = _join([replace(found, directions=found.directions * each) for each in signs[1:]])
    return _apart(found, replace(others, met=0 * others.met))


class PoseToJoints:
    """Coordinates of joints at which the platform and the observed directions are where they are to be."""

    def __init__(self, system: ErrorSystem, observations: tuple[Observation, ...], error: PoseError) -> None:
        assert error.coordinates is not None
        self.system, self.turning = system, error.coordinates.turning
        loops, motion = system.system, error.coordinates.motion
        links = loops.mechanism.links
        self.body, zero = loops.way(loops.body[motion.link]), links[motion.link].pose
        self.point, self.axes = transform(zero, motion.point) / loops.length, zero[:3, :3].T
        self.seen = [
            (loops.way(loops.body[each.link]), links[each.link].pose[:3, :3] @ each.direction)
            for each in observations
            if isinstance(each, SeenAxis)
        ]

    def vectors(self, carrier: SweptChains) -> list[CarriedVector]:
        """Return the platform's point, its rotation, and the directions, as vectors."""
        turns = [carrier.direction(self.body, axis) for axis in self.axes] if self.turning else []
        return [carrier.point(self.body, self.point), *turns, *(carrier.direction(*each) for each in self.seen)]

    def values_at(self, q: Array) -> Array:
        """Return their values at coordinates (c, N), (c, k)."""
        vectors = self.vectors(SweptChains(self.system.system, list(q.T)))
        return np.concatenate([np.broadcast_to(each.value, (len(q), 3)) for each in vectors], axis=1)

    def desired_values(self, poses: CriticalPoses) -> Array:
        """Return their desired values, (c, k)."""
        turns = [poses.R[:, :, i] for i in range(3)] if self.turning else []
        return np.concatenate(
            [poses.p / self.system.system.length, *turns, *np.moveaxis(poses.directions, 1, 0)], axis=1
        )

    def __call__(self, poses: CriticalPoses, pool: Array, fit: Fit | None = None) -> tuple[Array, NDArray[np.bool_]]:
        """Coordinates (c, N), and for which (c,) poses some were found that ``fit``, by Gauss and Newton's steps from a
        pool (n, N); then from those that were found. Each leg starts where it is nearest in the pool, whatever the
        others do."""
        q, done = self._from(poses, pool, fit)
        if done.any() and not done.all():
            q[~done], again = self._from(poses.some(~done), q[done], fit)
            done[~done] = again
        return q, done

    def _from(self, poses: CriticalPoses, pool: Array, fit: Fit | None) -> tuple[Array, NDArray[np.bool_]]:
        wanted, told = self.desired_values(poses), self.values_at(pool)
        found, done = np.zeros((len(poses), pool.shape[1])), np.zeros(len(poses), dtype=bool)
        if not len(poses):
            return found, done
        near = [
            (
                group,
                np.array(
                    [
                        np.argsort(np.abs(told[:, rows] - each[rows]).max(axis=1))[:POSE_CONFIGURATIONS_MAX]
                        for each in wanted
                    ]
                ),
            )
            for group, rows in self._groups()
        ]
        for k in range(near[0][1].shape[1]):
            left = np.flatnonzero(~done)
            if not len(left):
                break
            start = np.zeros((len(left), pool.shape[1]))
            for group, nearest in near:
                start[:, group] = pool[nearest[left, k]][:, group]
            q, good = self._lead(start, wanted[left])
            if fit is not None and good.any():
                good[good] = fit(q[good])
            found[left[good]], done[left[good]] = q[good], True
        return found, done

    def _groups(self) -> list[tuple[list[int], list[int]]]:
        """Return groups of coordinates that loops couple behind the platform's pose, each with the values that it
        determines."""
        loops = self.system.system
        trunk, own = set(self.body), list[set[int]]()
        for loop in loops.loops:
            tied = set(loop.coordinates) - trunk
            own = [each for each in own if not each & tied] + [tied.union(*(each for each in own if each & tied))]
        own = [trunk, *own]
        own[0] |= set(range(len(loops.coordinates))) - set().union(*own)
        pose = list(range(3 * (len(self.axes) if self.turning else 0) + 3))
        return [
            (
                sorted(each),
                pose
                + [len(pose) + 3 * k + i for k, (way, _) in enumerate(self.seen) if each & set(way) for i in range(3)],
            )
            for each in own
            if each
        ]

    def _lead(self, q: Array, wanted: Array, steps: int = 40) -> tuple[Array, NDArray[np.bool_]]:
        size, q = q.shape[1], q.copy()
        good, going = np.zeros(len(q), dtype=bool), np.arange(len(q))
        # poses far away are to be reached as well
        longest = np.maximum(2 * CRITICAL_POSE_STEP_MAX, 4 * np.abs(wanted).max(axis=1) / steps)
        for _ in range(steps):
            here = q[going]
            G, DG = self.system.closures(here)
            vectors = self.vectors(SweptChains(self.system.system, list(here.T)))
            J = np.zeros((len(here), 3 * len(vectors), size))
            off = -wanted[going]
            for k, each in enumerate(vectors):
                rows = slice(3 * k, 3 * k + 3)
                off[:, rows] += each.value
                for part in each.parts:
                    J[:, rows, part.places] += part.sign * np.swapaxes(part.columns, -1, -2)
            J, off = np.concatenate([DG, J], axis=1), np.concatenate([G, off], axis=1)
            r = np.abs(off).max(axis=1)
            good[going] = r < HIDDEN_ROBOT_RESIDUAL_TOL
            left = ~good[going]
            going, here, J, off, r = going[left], here[left], J[left], off[left], r[left]
            if not len(going):
                break
            back = np.swapaxes(J, 1, 2)
            damped = back @ J + (1e-13 + 1e-3 * np.minimum(r, 1.0) ** 2)[:, None, None] * np.eye(size)
            step = np.linalg.solve(damped, -back @ off[..., None])[..., 0]
            q[going] = (
                here + step * np.minimum(1.0, longest[going] / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
            )
        return q, good


@dataclass(frozen=True, eq=False)
class WidenedSearch:
    """The critical points at critical poses, ``continua`` among them: those that configurations of a pool (n, N) lead
    to, and that ``fit``."""

    lift: PoseToJoints
    poses: CriticalPoses
    continua: CriticalPoses
    unmet: int
    idle: int
    fit: Fit

    def __call__(self, pool: Array) -> list[CriticalPoint]:
        q, done = self.lift(_join([self.poses, self.continua]), pool, self.fit)
        return descend(self.lift.system, q[done], np.full(int(done.sum()), -1), self.idle)
