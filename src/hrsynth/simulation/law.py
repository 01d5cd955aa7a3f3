"""The control law that servoes leg directions (MMT 2.3.2, eqs. 9-12), for any robot and any observed legs; and the
desired directions in time: those of the goal at once, or led along the straight way of poses.

e_i = u_i × u_di, L_iᵀ = −[u_di]ₓ M_iᵀ, τ = −λ L^{T+} e and q̇ = J_inv τ are solved at once on the tangent space of the
closed loops: with B a basis of it and U B the rates of the directions, q̇ = −λ B (L U B)⁺ e, where L stacks −[u_di]ₓ.
Where the robot sees all of its platform's twist this is the same velocity of least norm; and it stays finite where Mᵀ
does not exist because a watched leg is stretched (Type 1), as the motion through such a pose is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import PoseNotReached
from ..geometry.vectors import Array, cross, hat
from ..kinematics.configuration import ClosedConfiguration, measure
from ..kinematics.platform_motion import Goal, PlatformMotion
from ..kinematics.relation import Measurement
from ..kinematics.steps import nearest, track
from ..results import Value
from ..tolerances import DAMPED, NEAREST

Desired = Callable[[float], tuple[Array, Array]]
"""Desired directions (k, 3) and their rates (k, 3) at a time."""
Poses = Callable[[str], Array]
"""The pose X_BL (4, 4) of each link."""
Sense = Callable[[float, Poses, Array], Array]
"""What is measured (k, 3) at a time where the links are at their poses and the true directions are (k, 3)."""
POSES = 24
"""Poses between start and goal at which the directions of a trajectory are taken."""


@dataclass(frozen=True, eq=False, repr=False)
class Command(Value):
    """What the law commands at a configuration: joint velocities (nv,), the true error and directions, the measured
    directions (k, 3), and the singular values of the rows that it inverts, as many as the platform has freedoms,
    largest first."""

    velocity: Array
    error: Array
    directions: Array
    seen: Array
    values: Array
    weak: Array
    """The joint velocity (nv,), of unit norm, that the measured errors show least."""
    pull: float
    """Norm of the gradient of ½ ‖e‖², e as measured, along the motions of the loops."""

    @property
    def size(self) -> float:
        """‖e‖ of the true error."""
        return float(np.linalg.norm(self.error))

    @property
    def speed(self) -> float:
        """Norm of the joint velocities (characteristic lengths, radians, seconds)."""
        return float(np.linalg.norm(self.velocity))


@dataclass(frozen=True, eq=False, repr=False)
class Law(Value):
    """The law of one robot: ``question`` holds what is observed, ``dof`` its platform's freedoms, ``gain`` is λ."""

    question: Measurement
    dof: int
    gain: float

    def at(self, configuration: ClosedConfiguration, desired: tuple[Array, Array], sensed: Sense | None = None,
           time: float = 0.0) -> Command:
        """The command at a configuration (of the joint velocities of its twin)."""
        u, rates = directions(configuration, self.question)
        wanted, moving = desired
        true = cross(u.T, wanted.T, axis=-2).T
        seen = u if sensed is None else sensed(time, configuration.pose, u)
        error = true if sensed is None else cross(seen, wanted)
        kernel, _ = configuration.kernel()
        rows = np.vstack([-hat(w) @ r for w, r in zip(wanted, rates, strict=True)]) @ kernel
        left, values, right = np.linalg.svd(rows, full_matrices=False)
        left, values, right = left[:, : self.dof], values[: self.dof], right[: self.dof]
        asked = self.gain * error.ravel() + cross(seen, moving).ravel()
        velocity = -kernel @ (right.T @ (inverted(values) * (left.T @ asked)))
        pull = float(np.linalg.norm(rows.T @ error.ravel()))
        return Command(velocity, true, u, seen, values, kernel @ right[-1], pull)


def inverted(values: Array) -> Array:
    """The singular values (descending) of a damped pseudo-inverse: exact but where a value is below ``DAMPED``, then
    σ / (σ² + μ²), μ² growing from 0 to ``DAMPED``² as σ vanishes."""
    damping = np.maximum(DAMPED**2 - values**2, 0.0)
    return np.asarray(values / (values**2 + damping))


def directions(configuration: ClosedConfiguration, question: Measurement) -> tuple[Array, list[Array]]:
    """The observed directions (k, 3) and, of each, the rates (3, nv)."""
    _, _, values, rates = measure(configuration.twin, configuration.q, question.reference, question.observations)
    return np.array(values), rates


@dataclass(frozen=True, eq=False, repr=False)
class FixedDirections(Value):
    """The directions (k, 3) of the goal from the first moment on."""

    goal: Array

    def __call__(self, time: float) -> tuple[Array, Array]:
        return self.goal, np.zeros_like(self.goal)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Value):
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
