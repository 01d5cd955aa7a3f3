"""The poses of a sweep by closed forms: which of its goals are reached, and which cannot be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.so3 import convert_vectors_to_rotations
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import PlatformMotion, PoseTask
from ..mechanism.pose import TURNS, Grid
from ..tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, RANK_CUTOFF_FRACTION
from .configuration_builder import ConfigurationBuilder
from .engine import Flags

FREE_ROTATION_VALUES_COUNT = 180
"""Values of a free turn that are tried before a pose counts as out of reach."""


def find_ready_configurations(
    placer: ConfigurationBuilder, motion: PlatformMotion, goals: Sequence[PoseTask]
) -> tuple[dict[int, ClosedConfiguration], set[int]]:
    """Return the configurations at goals whose free parts are as at the zero configuration, by index; and the indices
    of goals that no pose of the platform reaches in the working mode of the zero configuration."""
    X = np.array([motion.pose_of(goal) for goal in goals])
    found = {
        i: at
        for i, at in enumerate(placer.configurations(X))
        if at is not None and np.linalg.norm(goals[i].error_and_jacobian(placer.model, at.q)[0]) <= RANK_CUTOFF_FRACTION
    }
    missed = [i for i in range(len(goals)) if i not in found]
    closed, turning = (
        [i for i in missed if motion.is_placed(goals[i]) and motion.turns_left(goals[i]) == left] for left in (0, 1)
    )
    some = np.concatenate([placer.batch.reaches(X[closed]), _try_rotations(placer, motion, X[turning])])
    return found, {i for i, reached in zip([*closed, *turning], some, strict=True) if not reached}


def list_grid_poses(motion: PlatformMotion, grid: Grid, robot: str, places: Array) -> tuple[Array, Flags]:
    """Return the platform poses (n, 4, 4) where the parts of a grid that vary have the values ``places`` (n, ndim),
    free parts as at the zero configuration; and which of them the platform can have. Raises ``BadRequest`` for parts
    that it cannot change."""
    first = motion.goal(grid.poses_at([(0,) * grid.ndim])[0], robot)
    columns = dict(zip(grid.names, places.T, strict=True))
    X = np.tile(motion.pose_of(first), (len(places), 1, 1))
    if {*TURNS} & columns.keys():
        goals = (motion.goal(grid.pose(values), robot) for values in places)
        X[:, :3, :3] = [motion.pose_of(goal)[:3, :3] for goal in goals]
    if "phi" in columns:
        X[:, :3, :3] = convert_vectors_to_rotations(columns["phi"][:, None] * motion.normal) @ motion.home[:3, :3]
    values = np.tile(first.values, (len(places), 1))
    for row, direction in enumerate(first.directions):
        values[:, row] = columns.get("xyz"[int(np.argmax(direction))], values[:, row])
    home, rows = motion.position(motion.home), first.directions @ motion.translations
    missing = (values - first.directions @ home).T
    way = np.linalg.lstsq(rows, missing, rcond=RANK_CUTOFF_FRACTION)[0]
    met = np.linalg.norm(rows @ way - missing, axis=0) <= HIDDEN_ROBOT_RESIDUAL_TOL
    X[:, :3, 3] = home + (motion.translations @ way).T - X[:, :3, :3] @ motion.point
    return X, met


def _try_rotations(placer: ConfigurationBuilder, motion: PlatformMotion, X: Array) -> Flags:
    """Return True for poses X (n, 4, 4) that some rotation about the platform's one axis makes reachable, (n,)."""
    if len(X) == 0:
        return np.zeros(0, dtype=bool)
    turns = convert_vectors_to_rotations(
        np.linspace(-np.pi, np.pi, FREE_ROTATION_VALUES_COUNT)[:, None] * motion.rotations[:, 0]
    )
    p = X[:, :3, 3] + X[:, :3, :3] @ motion.point
    poses = np.tile(np.eye(4), (len(X), FREE_ROTATION_VALUES_COUNT, 1, 1))
    poses[..., :3, :3] = turns @ X[:, None, :3, :3]
    poses[..., :3, 3] = p[:, None] - poses[..., :3, :3] @ motion.point
    reached = placer.batch.reaches(poses.reshape(-1, 4, 4)).reshape(len(X), FREE_ROTATION_VALUES_COUNT)
    return np.asarray(reached.any(axis=1))
