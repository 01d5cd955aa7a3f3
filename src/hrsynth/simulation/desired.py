"""Desired directions in time: those of the goal at once (a step), or led along the straight way of poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import PoseNotReached
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import Goal, PlatformMotion
from ..kinematics.relation import Measurement
from ..kinematics.steps import nearest, track
from ..tolerances import NEAREST
from .law import directions

POSES = 24
"""Poses between start and goal at which the directions of a trajectory are taken."""


@dataclass(frozen=True, eq=False)
class Step:
    """The directions (k, 3) of the goal from the first moment on."""

    goal: Array

    def __call__(self, time: float) -> tuple[Array, Array]:
        return self.goal, np.zeros_like(self.goal)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Directions through ``marks`` (n, k, 3) in ``duration`` (s), at rest at both ends, then those of the last mark."""

    marks: Array
    duration: float

    @cached_property
    def _curve(self) -> tuple[Any, Any]:
        from scipy.interpolate import CubicSpline

        curve = CubicSpline(np.linspace(0, 1, len(self.marks)), self.marks)
        return curve, curve.derivative()

    def __call__(self, time: float) -> tuple[Array, Array]:
        if time >= self.duration:
            return self.marks[-1], np.zeros_like(self.marks[-1])
        x = time / self.duration
        part = x**3 * (10 - 15 * x + 6 * x**2)
        speed = 30 * x**2 * (1 - x) ** 2 / self.duration
        curve, slope = self._curve
        raw = curve(part)
        size = np.linalg.norm(raw, axis=1, keepdims=True)
        u, moving = raw / size, speed * slope(part) / size
        return u, moving - np.sum(u * moving, axis=1, keepdims=True) * u


def straight(start: ClosedConfiguration, motion: PlatformMotion, goal: Goal, question: Measurement,
             duration: float) -> tuple[Trajectory, ClosedConfiguration]:
    """The trajectory of the directions on the straight way from ``start`` to a goal of the whole pose (where parts of
    the pose depend on each other, along the poses nearest to it), and the configuration at its end; raises
    ``PoseNotReached`` where the way is blocked."""
    X = start.pose(motion.link)
    here, marks = start, [directions(start, question)[0]]
    for fraction in np.linspace(0, 1, POSES + 1)[1:]:
        here, came = _towards(here, motion, goal.towards(X, float(fraction)), last=fraction == 1)
        if not came:
            at = motion.pose(here.pose(motion.link))
            raise PoseNotReached(start.twin.mechanism.name, str(motion.pose(goal_pose(goal))), float(fraction), str(at),
                                 origin="the start")
        marks.append(directions(here, question)[0])
    return Trajectory(np.array(marks), duration), here


def _towards(here: ClosedConfiguration, motion: PlatformMotion, goal: Goal, last: bool
             ) -> tuple[ClosedConfiguration, bool]:
    """The configuration at a goal of the whole pose nearby, and whether it was reached: where parts of the pose depend
    on each other the nearest one, which is to be the goal's only at the ``last``."""
    if motion.dof >= motion.translations.shape[1] + motion.rotations.shape[1]:
        there, came = track(here, motion, goal)
        return there, came == 1
    there = nearest(here, replace(goal, directions=np.zeros((0, 3)), values=np.zeros(0), rotation=None), goal)
    return there, not last or float(np.linalg.norm(goal.rows(there.twin, there.q)[0])) < NEAREST


def whole(motion: PlatformMotion, X: Array) -> Goal:
    """The goal of the whole platform pose X (4, 4), as far as the platform's pose counts."""
    home = motion.at_home()
    return Goal(home.link, home.point, home.zero, home.directions, motion.position(X), home.normal,
                rotation=X[:3, :3] if motion.body else None)


def goal_pose(goal: Goal) -> Array:
    """The platform pose (4, 4) of a goal of the whole pose."""
    X = np.eye(4)
    X[:3, :3] = goal.zero if goal.rotation is None else goal.rotation
    X[:3, 3] = goal.values - X[:3, :3] @ goal.point
    return X
