"""Critical points of the error over the platform's pose, where legs have closed forms, and the joints that go there.

A pose and the working modes of the watched legs decide the error (:mod:`.pose_error`), so that starts are as cheap as
they are few coordinates: from all that the legs reach, in all working modes, with the platform turned at random. Rests
at legs' limits are none of these. Nothing here proves anything.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot
from ...budgets import POSE_LATE, POSE_MIRRORS, POSE_ROUNDS, POSE_STARTS, POSE_STEPS, POSE_THINNED, POSE_TRIES
from ...closed_forms.legs import OnRod, SlidingRod
from ...geometry.so3 import exponential
from ...geometry.vectors import Array, transform
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import SeenAxis
from ...progress import tell
from ...results import Value
from ...tolerances import COVER_REACH, CRITICAL_POSE, FOLLOWED, POSE_MARGIN_STEP, POSE_STEP, SAME_ENDING
from .carried import CarriedVector, SweptChains
from .cover import bounds
from .error import RestEquations, RestSystem
from .pose_error import NotEnclosed, PoseError
from .search import CriticalPoint, descend

LONGEST_STEP = 0.25
"""Longest change of a coordinate in a step."""
FARTHER = 3.0
"""Where legs do not end it, the box of starts is this many times as wide as that which is covered."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoses(Value):
    """Poses p (k, 3) (m), R (k, 3, 3), the observed directions u (k, legs, 3) there, and the numbers (k,) of directions
    in which E falls."""

    p: Array
    R: Array
    directions: Array
    falling: NDArray[np.intp]

    def some(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> CriticalPoses:
        """Some of them."""
        return CriticalPoses(*(each[which] for each in vars(self).values()))

    def __len__(self) -> int:
        return len(self.p)

    @property
    def marks(self) -> Array:
        """What tells them apart, (k, n)."""
        return np.concatenate([self.p, *np.moveaxis(self.R, 1, 0), *np.moveaxis(self.directions, 1, 0)], axis=1)


def critical_poses(setting: ObservedRobot, goal: ClosedConfiguration, seed: int = 0) -> tuple[
        PoseError, CriticalPoses] | None:
    """What is found, in rounds until these add little; None where the error is no closed form of the pose."""
    try:
        error = PoseError.of(setting, goal)
    except NotEnclosed:
        return None
    rng, found = np.random.default_rng([seed, 2]), _none(len(error.seen))
    fresh: list[int] = []
    held = _held(error)
    for number in range(POSE_ROUNDS * len(held)):
        tell("poses")
        with np.errstate(all="ignore"):
            drawn = _round(error, rng, held[number % len(held)])
        marks, known = drawn.marks, found.marks
        kept: list[int] = []
        for k, mark in enumerate(marks):
            if not any(np.any(np.abs(each - mark).max(axis=1) < SAME_ENDING) for each in (known, marks[kept])):
                kept.append(k)
        found = _joined([found, drawn.some(np.array(kept, dtype=np.intp))])
        fresh.append(len(kept))
        if len(fresh) > len(held) and sum(fresh[len(fresh) // 2 :]) <= POSE_LATE * len(found):
            break
    return error, _mirrored(error, found)


def _held(error: PoseError) -> list[tuple[int, ...]]:
    """The sets of limbs that may be at their limits at a rest, none first: those that are not watched, as E does not
    know how far they are from it."""
    watched = {each.limb for each in error.seen}
    free = [i for i, limb in enumerate(error.limbs) if i not in watched and isinstance(limb, OnRod)]
    return [chosen for size in range(min(len(free), error.size - 1) + 1) for chosen in combinations(free, size)]


def _round(error: PoseError, rng: np.random.Generator, held: tuple[int, ...]) -> CriticalPoses:
    """Starts about one turn of the platform, in random working modes; up along the k lowest eigenvectors of the
    Hessian, down along the others: of E + μ · margins where limbs are ``held`` at their limits, along what that
    leaves."""
    low, high, _ = bounds(error, FARTHER * COVER_REACH)
    k, turns = error.shifts.shape[1], error.turns.shape[1]
    turn = error.turns @ (rng.normal(size=turns) if turns > 1 else rng.uniform(-np.pi, np.pi, turns))
    watched = {each.limb for each in error.seen}
    centre = exponential(turn) @ error.R

    def placed(modes: Array) -> PoseError:
        return error.elsewhere(error.p, centre, list(modes))

    count = POSE_THINNED * POSE_STARTS // (1 + 3 * len(held))
    x = rng.uniform(low, high, (count, error.size))
    x[:, k:] *= rng.uniform(0.0, 1.0, (count, 1))
    modes = np.array([rng.choice([-1.0, 1.0], count) if i in watched and isinstance(limb, OnRod)
                      else np.full(count, limb.mode) for i, limb in enumerate(error.limbs)])
    chosen = np.flatnonzero(placed(modes).levels(x)[0])[: POSE_STARTS // (1 + 3 * len(held))]
    x, modes = x[chosen], modes[:, chosen]
    falling = rng.integers(error.size + 1, size=len(x))
    longest = np.full(len(x), LONGEST_STEP)
    found: list[CriticalPoses] = []
    for _ in range(POSE_STEPS):
        if not len(x):
            break
        values, vectors, along, closing, known = _expanded(placed, modes, x, held)
        size = np.abs(values)
        done = known & (np.linalg.norm(along, axis=1) < CRITICAL_POSE) & (size.min(axis=1) > SAME_ENDING)
        done &= np.linalg.norm(closing, axis=1) < CRITICAL_POSE
        if done.any():
            found.append(_told(placed(modes[:, done]), x[done], (values[done] < 0).sum(axis=1)))
        near = np.abs(along / np.maximum(size, 1e-9)).max(axis=1) < 0.02
        up = np.arange(values.shape[1]) < falling[:, None]
        sign = np.where(near[:, None], -np.sign(values), np.where(up, 1.0, -1.0))
        step = np.einsum("cij,cj->ci", vectors, sign * along / np.maximum(size, 1e-9)) + closing
        step *= np.minimum(1.0, longest / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        there = x + step
        reached = _reached(placed(modes), there, held) & known
        # at a leg's limit: shorter steps, then none
        x = np.where(reached[:, None], there, x)
        longest = np.where(reached, np.minimum(2 * longest, LONGEST_STEP), longest / 4)
        going = ~done & (longest > 1e-3) & (np.abs(x[:, k:]).max(axis=1, initial=0.0) < 1 / SAME_ENDING)
        x, modes, falling, longest = x[going], modes[:, going], falling[going], longest[going]
    return _joined([_none(len(error.seen)), *found])


def _reached(error: PoseError, x: Array, held: tuple[int, ...]) -> NDArray[np.bool_]:
    """Whether all limbs but those that are held reach at coordinates (c, n)."""
    margins = error.at(list(x.T), [], lambda value: value).margins
    return np.logical_and.reduce([np.broadcast_to(each > 0, len(x)) for i, each in enumerate(margins)
                                  if i not in held])


def _expanded(placed: Callable[[Array], PoseError], modes: Array, x: Array, held: tuple[int, ...]) -> tuple[
        Array, Array, Array, Array, NDArray[np.bool_]]:
    """Along what the held limits leave: the curvatures (c, d), their directions (c, n, d), E's slopes (c, d) along
    them; the step (c, n) to these limits; whether (c,) all are numbers. By differences, of margins of the second order.
    """
    n, m = x.shape[1], len(held)
    ways = POSE_STEP * np.concatenate([np.zeros((1, n)), np.eye(n), -np.eye(n)])
    error, there = placed(np.tile(modes, len(ways))), (x + ways[:, None]).reshape(-1, n)
    e, rates = error.numbers(there, np.eye(n))
    slopes = np.einsum("ck,ckj->cj", e, rates).reshape(len(ways), -1, n)
    H = (slopes[1 : n + 1] - slopes[n + 1 :]).transpose(1, 0, 2) / (2 * POSE_STEP)
    H, slope = (H + np.swapaxes(H, 1, 2)) / 2, slopes[0]
    known = np.isfinite(H).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1)
    H, slope = np.nan_to_num(H), np.nan_to_num(slope)
    closing, Z = np.zeros_like(slope), np.broadcast_to(np.eye(n), H.shape)
    if m:
        G, DG, bends = _margins(placed, modes, x, held)
        U, sizes, V = np.linalg.svd(DG)
        faint = np.maximum(sizes, 1e-9)
        closing = -np.einsum("cki,ck->ci", V[:, :m], np.einsum("cik,ci->ck", U, G) / faint)
        mu = -np.einsum("cik,ck->ci", U, np.einsum("cki,ci->ck", V[:, :m], slope) / faint)
        H = H + np.einsum("ci,cijk->cjk", mu, bends)
        Z = np.swapaxes(V[:, m:], 1, 2)
    values, W = np.linalg.eigh(np.swapaxes(Z, 1, 2) @ H @ Z)
    vectors = Z @ W
    slope = slope + np.einsum("cij,cj->ci", H, closing)
    return values, vectors, np.einsum("cij,ci->cj", vectors, slope), closing, known


def _margins(placed: Callable[[Array], PoseError], modes: Array, x: Array, held: tuple[int, ...]) -> tuple[
        Array, Array, Array]:
    """Reach margins of limbs (c, m), their first and second derivatives (c, m, n), (c, m, n, n), by differences."""
    n, h = x.shape[1], POSE_MARGIN_STEP
    eye = h * np.eye(n)
    ways = np.concatenate([np.zeros((1, n)), *(sign * eye[:, None] + other * eye for sign in (1, -1)
                                               for other in (1, -1))], axis=None).reshape(-1, n)
    error = placed(np.tile(modes, len(ways)))
    there = (x + ways[:, None]).reshape(-1, n)
    margins = error.at(list(there.T), [], lambda value: value).margins
    values = np.array([np.broadcast_to(margins[i], len(there)) for i in held]).reshape(len(held), len(ways), len(x))
    both, mixed, other, back = values[:, 1:].reshape(len(held), 4, n, n, len(x)).swapaxes(0, 1)
    places = np.arange(n)
    rates = (both - back)[:, places, places] / (4 * h)
    bends = (both - mixed - other + back) / (4 * h * h)
    return values[:, 0].T, rates.transpose(2, 0, 1), bends.transpose(3, 0, 1, 2)


def _told(error: PoseError, x: Array, falling: NDArray[np.intp]) -> CriticalPoses:
    """Poses at coordinates x (c, n)."""
    p, R = error.pose(list(x.T), lambda value: value)
    seen = error.at(list(x.T), [], lambda value: value).seen
    shape = (len(x),)
    u = np.array([[np.broadcast_to(part, shape) for part in each.u] for each in seen])
    return CriticalPoses(error.length * np.array([np.broadcast_to(each, shape) for each in p]).T,
                         np.array([np.broadcast_to(each, shape) for each in R]).T.reshape(-1, 3, 3),
                         u.transpose(2, 0, 1), falling)


def _none(legs: int) -> CriticalPoses:
    return CriticalPoses(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, legs, 3)), np.zeros(0, dtype=np.intp))


def _joined(parts: list[CriticalPoses]) -> CriticalPoses:
    return CriticalPoses(*(np.concatenate(each) for each in zip(*(vars(part).values() for part in parts), strict=True)))


def _mirrored(error: PoseError, found: CriticalPoses) -> CriticalPoses:
    """A rod that slides through a base point has its direction either way at a pose, and E is the same: all choices of
    that, where these are few."""
    both = [k for k, each in enumerate(error.seen) if each.limb is not None
            and isinstance(leg := error.limbs[each.limb], SlidingRod) and leg.aside == 0]
    if not both or len(both) > POSE_MIRRORS:
        return found
    signs = np.ones((2 ** len(both), len(error.seen), 1))
    signs[:, both, 0] = list(product((1.0, -1.0), repeat=len(both)))
    return _joined([replace(found, directions=found.directions * each) for each in signs])


class Lift:
    """Coordinates of joints at which the platform and the observed directions are where they are to be."""

    def __init__(self, system: RestSystem, observations: tuple[Observation, ...], error: PoseError) -> None:
        assert error.coordinates is not None
        self.system, self.turning = system, error.coordinates.turning
        loops, motion = system.system, error.coordinates.motion
        links = loops.mechanism.links
        self.body, zero = loops.way(loops.body[motion.link]), links[motion.link].pose
        self.point, self.axes = transform(zero, motion.point) / loops.length, zero[:3, :3].T
        self.seen = [(loops.way(loops.body[each.link]), links[each.link].pose[:3, :3] @ each.direction)
                     for each in observations if isinstance(each, SeenAxis)]

    def vectors(self, carrier: SweptChains) -> list[CarriedVector]:
        """Where the platform's point is, how it is turned, and the directions."""
        turns = [carrier.direction(self.body, axis) for axis in self.axes] if self.turning else []
        return [carrier.point(self.body, self.point), *turns, *(carrier.direction(*each) for each in self.seen)]

    def told(self, q: Array) -> Array:
        """The same at coordinates (c, N), (c, k)."""
        vectors = self.vectors(SweptChains(self.system.system, list(q.T)))
        return np.concatenate([np.broadcast_to(each.value, (len(q), 3)) for each in vectors], axis=1)

    def wanted(self, poses: CriticalPoses) -> Array:
        """What they are to be, (c, k)."""
        turns = [poses.R[:, :, i] for i in range(3)] if self.turning else []
        return np.concatenate([poses.p / self.system.system.length, *turns,
                               *np.moveaxis(poses.directions, 1, 0)], axis=1)

    def __call__(self, poses: CriticalPoses, pool: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Coordinates (c, N), and for which (c,) poses some were found, by Gauss and Newton's steps from the nearest
        ones of a pool (n, N); then from those that were found."""
        q, done = self._from(poses, pool)
        if done.any() and not done.all():
            q[~done], again = self._from(poses.some(~done), q[done])
            done[~done] = again
        return q, done

    def _from(self, poses: CriticalPoses, pool: Array) -> tuple[Array, NDArray[np.bool_]]:
        wanted, told = self.wanted(poses), self.told(pool)
        nearest = np.array([np.argsort(np.abs(told - each).max(axis=1))[:POSE_TRIES] for each in wanted])
        found, done = np.zeros((len(poses), pool.shape[1])), np.zeros(len(poses), dtype=bool)
        for place in nearest.T if len(nearest) else ():
            left = np.flatnonzero(~done)
            if not len(left):
                break
            q, good = self._led(pool[place[left]], wanted[left])
            found[left[good]], done[left[good]] = q[good], True
        return found, done

    def _led(self, q: Array, wanted: Array, steps: int = 40) -> tuple[Array, NDArray[np.bool_]]:
        size = q.shape[1]
        good = np.zeros(len(q), dtype=bool)
        for _ in range(steps):
            at = RestEquations(self.system, list(q.T))
            vectors = self.vectors(at.carrier)
            J = np.zeros((len(q), 3 * len(vectors), size))
            off = -wanted
            for k, each in enumerate(vectors):
                rows = slice(3 * k, 3 * k + 3)
                off[:, rows] += each.value
                for part in each.parts:
                    J[:, rows, part.places] += part.sign * np.swapaxes(part.columns, -1, -2)
            J, off = np.concatenate([at.DG, J], axis=1), np.concatenate([at.G, off], axis=1)
            r = np.abs(off).max(axis=1)
            good = r < FOLLOWED
            if good.all():
                break
            back = np.swapaxes(J, 1, 2)
            damped = back @ J + (1e-13 + 1e-3 * np.minimum(r, 1.0) ** 2)[:, None, None] * np.eye(size)
            step = np.linalg.solve(damped, -back @ off[..., None])[..., 0]
            q = q + step * np.minimum(1.0, 2 * LONGEST_STEP / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        return q, good


@dataclass(frozen=True, eq=False)
class Further:
    """The critical points at critical poses: those that configurations of a pool (n, N) lead to."""

    lift: Lift
    poses: CriticalPoses
    idle: int

    def __call__(self, pool: Array) -> list[CriticalPoint]:
        q, done = self.lift(self.poses, pool)
        return descend(self.lift.system, q[done], self.poses.falling[done], self.idle)
