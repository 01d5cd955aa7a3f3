"""Published robots studied at random: does a robot of a chain and its couplings move as its table says, how else can
its platform move, and what is left when its motors are held?

For each robot: random dimensions are closed at a random pose of the stated motion, then changed at random and closed
again without changing them. So ranks are those of generic dimensions, and the motion persists. Where that fails, the
same dimensions are asked to close at several poses of the stated motion at once: then dimensions obey a relation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from hrsynth.geometry.ranks import CLEAN
from hrsynth.geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from hrsynth.geometry.vectors import Array
from hrsynth.tolerances import RANK_GAP_MIN

from .closing import BatchState, RobotBatch, batch, close, legs_at
from .freedoms import PlatformFreedoms, freedoms, freedoms_left, within
from .limits import BATCH, CHANGED, POSES, SLIGHT, TRIALS, TURNED
from .motions import LegFactor, dimensions, factors
from .tables import ANGLES, Held, PublishedRobot
from .watching import WatchedLegs, watching

FREE_ANGLES = (*ANGLES, "cone")
"""Names of dimensions that are angles and must not be special."""
COUPLED = ("phi", "psi")
"""Names of the angles of a platform's coupling, which may have to be special."""
DEGREES = "aop"
"""What a free angle that is not stated may be: any, a right angle, none."""


@dataclass(frozen=True)
class StudyCase:
    """A robot with its free angles as they are stated for some of its choices of motors (letters; empty: not
    stated)."""

    robot: PublishedRobot
    letters: str

    def letters_of(self, trial: int) -> str:
        """The letters of a trial: those stated, or all in turn."""
        free = len(self.robot.chain.angles)
        if self.letters or not free:
            return self.letters
        every = list(product(DEGREES, repeat=free))
        return "".join(every[trial % len(every)])


@dataclass(frozen=True)
class HeldMotors:
    """With these joints of each leg held: freedoms that are left to the platform, and those among them that belong to
    the stated motion."""

    left: int
    stated: int


@dataclass(frozen=True)
class Studied:
    """What a robot does at random dimensions that are closed in the stated motion.

    ``stated``: the freedoms of the stated motion that it has (all of them, or it does not ``move`` so); ``motion``: all
    freedoms of its platform to first order, translations and rotations; ``finite``: whether a motion beyond the stated
    one was followed (None where there is none); ``motors``: of each choice that was asked for; ``related``: whether
    dimensions obey a relation; ``letters``: the free angles; ``gap``: the smallest of all ranks."""

    moves: bool
    motion: tuple[int, int] | None = None
    finite: bool | None = None
    idle: int = 0
    motors: dict[Held, HeldMotors] = field(default_factory=dict)
    related: bool = False
    letters: str = ""
    gap: float = CLEAN
    watched: WatchedLegs | None = None
    others: tuple[tuple[int, int], ...] = ()
    """Motions that were found instead, where it does not move as stated."""
    screws: Array | None = field(default=None, repr=False, compare=False)
    """Of its joints, (n, m, 6), told at the platform's point, where its dimensions are generic."""


def axes_of(robot: PublishedRobot) -> Array:
    """About which axes of the base (3,) the stated motion turns, at most: a single one is the normal."""
    return np.array({0: (0.0, 0.0, 0.0), 1: (0.0, 0.0, 1.0)}.get(robot.motion[1], (1.0, 1.0, 1.0)))


def motor_choices(robot: PublishedRobot) -> list[Held]:
    """The choices of motors of a robot: those listed, and those of the same joint in each leg."""
    same = [((joint,),) * robot.legs for joint in range(len(robot.chain.joints))]
    return list(dict.fromkeys([*same, *(drive.driven for drive in robot.drives)]))


def study(cases: Sequence[StudyCase], seed: int) -> Iterator[tuple[StudyCase, Studied]]:
    """What each robot does, in batches of those alike."""
    alike: dict[tuple[int, int, tuple[int, int]], list[StudyCase]] = {}
    for case in cases:
        alike.setdefault((case.robot.legs, len(case.robot.chain.joints), case.robot.motion), []).append(case)
    for (legs, joints, _), some in alike.items():
        for k in range(0, len(some), BATCH):
            part = some[k : k + BATCH]
            yield from zip(part, _batch(part, np.random.default_rng([seed, legs, joints, k])), strict=True)


def _batch(cases: Sequence[StudyCase], random: np.random.Generator) -> list[Studied]:
    found: list[Studied | None] = [None] * len(cases)
    others: list[set[tuple[int, int]]] = [set() for _ in cases]
    sparse = axes_of(cases[0].robot).sum() < 3
    for trial in range(TRIALS * (1 + sparse)):
        related = trial >= TRIALS
        todo = [i for i, each in enumerate(found) if each is None or (each.finite is not None and trial < TRIALS // 2)]
        if not todo:
            break
        letters = [cases[i].letters_of(trial) for i in todo]
        for i, each, other in zip(todo, *_trial([cases[i].robot for i in todo], letters, random, related), strict=True):
            if each is not None and (found[i] is None or each.finite is None):
                found[i] = each
            if other is not None:
                others[i].add(other)
    return [each or Studied(False, others=tuple(sorted(other))) for each, other in zip(found, others, strict=True)]


def _trial(
    robots: Sequence[PublishedRobot], letters: Sequence[str], random: np.random.Generator, related: bool
) -> tuple[list[Studied | None], list[tuple[int, int] | None]]:
    """One random start of each robot: what it does, None where it does not close or move as stated."""
    parts = [factors(robot, each) for robot, each in zip(robots, letters, strict=True)]
    of, axes, wanted = batch(parts, len(robots[0].chain.joints)), axes_of(robots[0]), sum(robots[0].motion)
    poses = POSES if related else 1
    state, closed = _close_at_random(of, len(robots), robots[0].legs, axes, poses, random)
    closed &= _plain(parts, state)
    again, persists = _close_elsewhere(of, state, robots[0].legs, axes, random, keep=related)
    legs, later = legs_at(of, _first(state, robots[0].legs)), legs_at(of, again)
    one, two = freedoms(legs), freedoms(later)
    kept, clear = within(one.twists, one.dof, axes, one.gap)
    kept_later, clear_later = within(two.twists, two.dof, axes, two.gap)
    same = closed & persists & (one.dof == two.dof) & (one.translations == two.translations) & (kept == kept_later)
    shifts = two.translations - robots[0].motion[0]
    kind = (shifts == 0) | ((shifts > 0) & (two.dof > wanted))
    good = same & (kept == wanted) & (one.idle == two.idle) & kind
    finite = _can_leave(of, again, two, axes, wanted, random)
    held = {driven: _freedoms_with_motors(legs, later, robots, driven, axes) for driven in _every(robots)}
    found: list[Studied | None] = []
    for b, robot in enumerate(robots):
        motors = {driven: held[driven] for driven in motor_choices(robot)}
        gap = min(float(clear[b]), float(clear_later[b]), *(float(each[2][b]) for each in motors.values()))
        steady = all(each[3][b] for each in motors.values()) and gap >= RANK_GAP_MIN
        if not (good[b] and steady):
            found.append(None)
            continue
        motion = (int(two.translations[b]), int(two.rotations[b]))
        found.append(
            Studied(
                True,
                motion,
                bool(finite[b]) if two.dof[b] > wanted else None,
                int(two.idle[b]),
                {driven: HeldMotors(int(each[0][b]), int(each[1][b])) for driven, each in motors.items()},
                related,
                letters[b],
                gap,
                watching(later[b], robot.chain.kinds, int(two.dof[b])),
                screws=later[b],
            )
        )
    instead = [
        (int(two.translations[b]), int(two.rotations[b])) if same[b] and not related else None
        for b in range(len(robots))
    ]
    return found, instead


def _close_at_random(
    of: RobotBatch, B: int, n: int, axes: Array, poses: int, random: np.random.Generator
) -> tuple[BatchState, NDArray[np.bool_]]:
    """Random dimensions closed at one random pose of the stated motion, or at several that are held."""
    lengths = random.uniform(0.3, 1.2, (B, of.count + 1))
    lengths[:, -1] = 0.0
    middle = random.uniform(-0.6, 0.6, (B, 1, 3))
    p = middle + (random.uniform(-0.15, 0.15, (B, poses, 3)) if poses > 1 else 0.0)
    turns = random.uniform(-0.6, 0.6, (B, poses, 3)) * axes
    q = np.tile(random.uniform(-2.0, 2.0, (B, n, of.joints)), (1, poses, 1))
    free = np.broadcast_to(axes if poses == 1 else np.zeros(3), (B, poses, 3))
    shifting = np.full((B, poses, 3), 1.0 if poses == 1 else 0.0)
    return close(
        of.at_poses(poses) if poses > 1 else of,
        BatchState(lengths, q, p, convert_vectors_to_rotations(turns)),
        free,
        shifting,
        sized=True,
    )


def _first(state: BatchState, n: int) -> BatchState:
    """The state at its first pose."""
    return BatchState(state.lengths, state.q[:, :n], state.p[:, :1], state.R[:, :1])


def _plain(parts: Sequence[Sequence[LegFactor]], state: BatchState) -> NDArray[np.bool_]:
    """Whether no dimension became a special one."""
    good = np.ones(len(parts), dtype=bool)
    for b, part in enumerate(parts):
        for k, name in enumerate(dimensions(part)):
            value = state.lengths[b, k]
            size = np.sin(2 * value) if name.startswith(FREE_ANGLES) else value
            good[b] &= name.startswith(COUPLED) or bool(abs(size) > SLIGHT)
    return good


def _close_elsewhere(
    of: RobotBatch, state: BatchState, n: int, axes: Array, random: np.random.Generator, *, keep: bool
) -> tuple[BatchState, NDArray[np.bool_]]:
    """Closed again in the stated motion, elsewhere, and (unless ``keep``) with other dimensions."""
    at = _first(state, n)
    B = len(at.q)
    lengths = at.lengths * (1 + (0.0 if keep else CHANGED) * random.standard_normal(at.lengths.shape))
    start = BatchState(
        lengths,
        at.q + CHANGED * random.standard_normal(at.q.shape),
        at.p + CHANGED * random.standard_normal(at.p.shape),
        at.R,
    )
    return close(of, start, np.broadcast_to(axes, (B, 1, 3)), np.ones((B, 1, 3)), sized=False)


def _can_leave(
    of: RobotBatch, at: BatchState, now: PlatformFreedoms, axes: Array, wanted: int, random: np.random.Generator
) -> Array:
    """Whether platforms with more freedoms than stated can leave the stated motion for good: moved along a random twist
    and closed with all freedoms, the turn is off the stated axes, and the freedoms are as many."""
    B = len(at.q)
    if not (now.dof > wanted).any() or axes.all():
        return np.zeros(B, dtype=bool)
    some = np.arange(6) < now.dof[:, None]
    V = np.einsum("bij,bj->bi", now.twists, some * random.standard_normal((B, 6)))
    V *= 3 * CHANGED / np.maximum(np.linalg.norm(V, axis=1), CHANGED)[:, None]
    legs = legs_at(of, at)
    rates = np.einsum("bnij,bj->bni", np.linalg.pinv(np.swapaxes(legs, -1, -2), rcond=1e-9), V)
    start = BatchState(
        at.lengths, at.q + rates, at.p + V[:, None, :3], convert_vectors_to_rotations(V[:, 3:])[:, None] @ at.R
    )
    end, done = close(of, start, np.ones((B, 1, 3)), np.ones((B, 1, 3)), sized=False)
    turn = convert_rotations_to_vectors(end.R[:, 0] @ np.swapaxes(at.R[:, 0], -1, -2))
    off = np.linalg.norm(turn * (1 - axes), axis=1)
    return np.asarray(done & (off > TURNED) & (freedoms(legs_at(of, end)).dof == now.dof))


def _every(robots: Sequence[PublishedRobot]) -> list[Held]:
    return list(dict.fromkeys(driven for robot in robots for driven in motor_choices(robot)))


def _freedoms_with_motors(
    legs: Array, later: Array, robots: Sequence[PublishedRobot], driven: Held, axes: Array
) -> tuple[Array, Array, Array, Array]:
    """PlatformFreedoms left with these motors held, of them stated ones, the gap, and whether both configurations
    agree."""
    mask = np.zeros(legs.shape[:3], dtype=bool)
    for i, joints in enumerate(driven):
        mask[:, i, list(joints)] = True
    one, two = freedoms_left(legs, mask, axes), freedoms_left(later, mask, axes)
    return two[0], two[1], np.minimum(one[2], two[2]), (one[0] == two[0]) & (one[1] == two[1])
