"""The poses of a sweep by closed forms: which of its goals are reached, and which cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ..errors import HrsynthError
from ..geometry.so3 import exponential
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import Goal, PlatformMotion
from ..mechanism import JointType, Mechanism
from ..mechanism.graphs import adjacency, shortest_path
from ..mechanism.legs import decompose
from ..mechanism.pose import Grid
from ..tolerances import AS_PRINTED, FOLLOWED, RANK_CUTOFF
from .engine import Flags
from .placing import Placer

TURNS = 180
"""Values of a free turn that are tried before a pose counts as out of reach."""


def ready(placer: Placer, motion: PlatformMotion, goals: Sequence[Goal]
          ) -> tuple[dict[int, ClosedConfiguration], set[int]]:
    """The configurations at goals whose free parts are as at home, by their place; and the places of goals that no pose
    of the platform reaches in the working mode of the zero configuration."""
    X = np.array([pose_of(motion, goal) for goal in goals])
    found = {i: at for i, at in enumerate(placer.configurations(X))
             if at is not None and np.linalg.norm(goals[i].rows(placer.twin, at.q)[0]) <= RANK_CUTOFF}
    missed = [i for i in range(len(goals)) if i not in found]
    closed, turning = ([i for i in missed if _freedoms_left(motion, goals[i]) == left] for left in (0, 1))
    some = np.concatenate([placer.batch.reached(X[closed]), _some_turn(placer, motion, X[turning])])
    return found, {i for i, reached in zip([*closed, *turning], some, strict=True) if not reached}


def beyond_rods(mechanism: Mechanism, motion: PlatformMotion, goals: Sequence[Goal]) -> set[int]:
    """The places of goals whose point is farther from a joint of the base than the rods between them reach, or nearer.

    Centres of R, U and S joints keep their distances on each link. So along a chain of them the point is at most the
    sum of its distances away from the first one, and at least twice the longest less that sum."""
    placed = [i for i, goal in enumerate(goals) if _freedoms_left(motion, goal) <= motion.rotations.shape[1]]
    points = np.array([motion.position(pose_of(motion, goals[i])) for i in placed]).reshape(-1, 3)
    missed = np.zeros(len(placed), dtype=bool)
    for chain in _chains(mechanism, motion):
        rods = np.linalg.norm(np.diff(chain, axis=0), axis=1)
        most, least = rods.sum(), 2 * rods.max() - rods.sum()
        far = np.linalg.norm(points - chain[0], axis=1)
        missed |= (far > most + AS_PRINTED * (1 + most)) | (far < least - AS_PRINTED * (1 + most))
    return {i for i, out in zip(placed, missed, strict=True) if out}


def _chains(mechanism: Mechanism, motion: PlatformMotion) -> Iterator[Array]:
    """Through each leg the centres (n, 3) of the joints from the base to the platform's point, which comes last."""
    try:
        anatomy = decompose(mechanism)
    except HrsynthError:
        return
    centred = (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL)
    for leg in anatomy.legs:
        within = {mechanism.base, *anatomy.platform, motion.link, *leg.links}
        bonds = {frozenset(joint.links): joint for joint in mechanism.joints.values()
                 if joint.type in centred and within.issuperset(joint.links)}
        try:
            links = shortest_path(adjacency(within, bonds), mechanism.base, motion.link)
        except KeyError:
            continue
        yield np.array([*(bonds[frozenset(pair)].point for pair in pairwise(links)), motion.position(motion.home)])


def pose_of(motion: PlatformMotion, goal: Goal) -> Array:
    """The platform pose (4, 4) that a goal asks for, its free parts as near to home as they can be."""
    X = motion.home.copy()
    if goal.rotation is not None:
        X[:3, :3] = goal.rotation
    elif goal.phi is not None:
        X[:3, :3] = exponential(goal.phi * goal.normal) @ motion.home[:3, :3]
    home = motion.position(motion.home)
    along = goal.directions @ motion.translations
    way = motion.translations @ np.linalg.lstsq(along, goal.values - goal.directions @ home,
                                          rcond=RANK_CUTOFF)[0]
    X[:3, 3] = home + way - X[:3, :3] @ motion.point
    return X


def poses_over(motion: PlatformMotion, grid: Grid, robot: str, places: Array) -> tuple[Array, Flags]:
    """The platform poses (n, 4, 4) where the parts of a grid that vary have the values ``places`` (n, ndim); free parts
    are as at home. Also which of them the platform can have at all. Raises ``BadRequest`` for parts that it cannot
    change."""
    first = motion.goal(grid.poses_at([(0,) * grid.ndim])[0], robot)
    columns = dict(zip(grid.names, places.T, strict=True))
    X = np.tile(pose_of(motion, first), (len(places), 1, 1))
    if "phi" in columns:
        X[:, :3, :3] = exponential(columns["phi"][:, None] * motion.normal) @ motion.home[:3, :3]
    values = np.tile(first.values, (len(places), 1))
    for row, direction in enumerate(first.directions):
        values[:, row] = columns.get("xyz"[int(np.argmax(direction))], values[:, row])
    home, rows = motion.position(motion.home), first.directions @ motion.translations
    missing = (values - first.directions @ home).T
    way = np.linalg.lstsq(rows, missing, rcond=RANK_CUTOFF)[0]
    met = np.linalg.norm(rows @ way - missing, axis=0) <= FOLLOWED
    X[:, :3, 3] = home + (motion.translations @ way).T - X[:, :3, :3] @ motion.point
    return X, met


def _freedoms_left(motion: PlatformMotion, goal: Goal) -> int:
    """How many of the platform's turns a goal leaves free; more than there are where it leaves a translation free."""
    spins = motion.rotations.shape[1]
    placed = np.linalg.matrix_rank(goal.directions @ motion.translations, tol=RANK_CUTOFF) if len(goal.values) else 0
    if placed < motion.translations.shape[1]:
        return spins + 2
    if goal.rotation is not None:
        return 0
    return spins - (goal.phi is not None)


def _some_turn(placer: Placer, motion: PlatformMotion, X: Array) -> Flags:
    """Whether some turn about the platform's one axis makes each of the poses X (n, 4, 4) one that is reached, (n,)."""
    if len(X) == 0:
        return np.zeros(0, dtype=bool)
    turns = exponential(np.linspace(-np.pi, np.pi, TURNS)[:, None] * motion.rotations[:, 0])
    p = X[:, :3, 3] + X[:, :3, :3] @ motion.point
    poses = np.tile(np.eye(4), (len(X), TURNS, 1, 1))
    poses[..., :3, :3] = turns @ X[:, None, :3, :3]
    poses[..., :3, 3] = p[:, None] - poses[..., :3, :3] @ motion.point
    reached = placer.batch.reached(poses.reshape(-1, 4, 4)).reshape(len(X), TURNS)
    return np.asarray(reached.any(axis=1))
