"""Continuation by small steps from a configuration to a goal for the platform, in one working mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..geometry.ranks import compute_kernel_basis, compute_range_basis
from ..geometry.vectors import Array
from ..solving.gauss_newton import UNDAMPED, Residual, descend
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    PRINTED_POSE_TOL,
    RANK_CUTOFF_FRACTION,
    WAYPOINT_RESIDUAL_TOL,
)
from .branch_tests import is_on_branch, is_on_branch_at_end
from .configuration import ClosedConfiguration
from .limits import list_tilts_beyond
from .pinocchio_model import PinocchioModel
from .platform_motion import PlatformMotion, PoseTask
from .tasks import GuidedTask, Task, shorten_step, solve, stack_task

NEAREST_POSE_GRADIENT_TOL = 1e-10
"""Projected gradient (characteristic lengths, radians) at which a pose counts as the nearest one."""
GOAL_DIRECTION_CUTOFF_FRACTION = 1e-3
"""Relative singular value below which a direction is not used to bypass a blocked straight path."""
FOLD_SINGULAR_VALUE_TOL = 1e-5
"""Relative singular value of loops and goal below which a fold is searched."""
POSE_PATH_STEP_MAX = 0.3
"""Largest change of a coordinate per step on the path to a pose (characteristic lengths, radians)."""

CONTINUATION_STEP_MAX = 0.1
"""Longest step along the path to a pose (characteristic lengths, radians)."""
CONTINUATION_HALVINGS_MAX = 10
"""Number of times that a step that fails is halved before the path is given up."""
JUMP_CORRECTION_MIN = 0.01
"""Length of corrections that are never jumps: on the edge of the workspace even exact steps need them."""
GOAL_CORRECTION_STEPS_MAX = 30
"""Further steps at a goal's own place if the path to it was not straight."""


def track(
    here: ClosedConfiguration,
    motion: PlatformMotion,
    goal: GuidedTask,
    halvings: int = CONTINUATION_HALVINGS_MAX,
    home: Task | None = None,
) -> tuple[ClosedConfiguration, float]:
    """Lead a configuration to a goal by small steps.

    Returns the last configuration and the part of the path that was followed (1: all of it). A goal of more parts than
    dof is met if it is missed by no more than printed digits. What the goal leaves free stays near ``home`` (default:
    the platform's pose at the zero configuration).
    """
    X = here.pose(motion.link)
    home = home or motion.at_home()
    error, rows = goal.error_and_jacobian(here.model, here.q)
    longest = 1 / max(1, int(np.ceil(np.linalg.norm(error) / CONTINUATION_STEP_MAX)))
    if is_goal_dependent(here, rows):
        here = _ease_towards(here, goal, X, longest)
        there = _step_to(here, goal, home)
        miss = float(np.linalg.norm(goal.error_and_jacobian(here.model, here.q)[0]))
        if there is None and miss <= PRINTED_POSE_TOL:
            there = here
        left = miss / max(float(np.linalg.norm(error)), CLOSURE_SOLVER_TOL)
        return (here, max(0.0, 1 - left)) if there is None else (there, 1.0)
    came, step = 0.0, longest
    while came < 1:
        ahead = min(1.0, came + step)
        ahead = 1.0 if ahead > 1 - CLOSURE_SOLVER_TOL else ahead
        there = _step_to(here, goal.towards(X, ahead), home, last=ahead == 1)
        if there is not None:
            here, came, step = there, ahead, min(longest, 2 * step)
        elif step < longest * 0.5**halvings:
            return here, came
        else:
            step /= 2
    return here, 1.0


def is_goal_dependent(here: ClosedConfiguration, rows: Array) -> bool:
    """Return True if the parts of a goal with Jacobian ``rows`` (k, nv) are not independent with closed loops."""
    return compute_range_basis(rows @ here.kernel()[0], 1.0)[1].value < len(rows)


def lead_to(
    here: ClosedConfiguration, motion: PlatformMotion, goal: PoseTask, last: bool
) -> tuple[ClosedConfiguration, bool]:
    """Return the configuration at a goal of the whole pose nearby, and whether it was reached: if parts of the pose
    depend on each other the nearest one, which must be the goal's only at the ``last``."""
    if motion.dof >= motion.translations.shape[1] + motion.rotations.shape[1]:
        there, came = track(here, motion, goal)
        return there, came == 1
    there = find_nearest(here, replace(goal, directions=np.zeros((0, 3)), values=np.zeros(0), rotation=None), goal)
    return there, not last or float(
        np.linalg.norm(goal.error_and_jacobian(there.model, there.q)[0])
    ) < NEAREST_POSE_GRADIENT_TOL


def approach(here: ClosedConfiguration, goal: PoseTask, easing: int = GOAL_CORRECTION_STEPS_MAX) -> ClosedConfiguration:
    """Return the configuration as near to a goal as small steps with closed loops come, whether the platform can be
    there or not."""
    error = float(np.linalg.norm(goal.error_and_jacobian(here.model, here.q)[0]))
    return _ease_towards(
        here, goal, here.pose(goal.link), 1 / max(1, int(np.ceil(error / CONTINUATION_STEP_MAX))), easing
    )


def _ease_towards(
    here: ClosedConfiguration, goal: GuidedTask, X: Array, stride: float, easing: int = GOAL_CORRECTION_STEPS_MAX
) -> ClosedConfiguration:
    """Return the configuration as near as steps with closed loops come to a goal of more parts than platform dof: the
    straight path from the pose X need not be one that it can follow."""
    for fraction in (*np.arange(stride, 1, stride), *[1.0] * easing):
        ahead = goal.towards(X, float(fraction))
        if fraction == 1 and np.linalg.norm(ahead.error_and_jacobian(here.model, here.q)[0]) <= CLOSURE_SOLVER_TOL:
            break
        there = next(_approach_task(here, ahead, None, GOAL_DIRECTION_CUTOFF_FRACTION, 3 * CONTINUATION_STEP_MAX), None)
        if there is None:
            break
        here = there
    return here


def _step_to(here: ClosedConfiguration, goal: GuidedTask, home: Task, last: bool = True) -> ClosedConfiguration | None:
    """Return the configuration at a goal nearby, moved towards ``home`` where parts are free; None if it jumps or is
    beyond a fold, in another working mode, or on one and is not the ``last``."""
    model = here.model
    error, rows = stack_task(model, here.q, goal)
    step = np.asarray(np.linalg.lstsq(rows, -error, rcond=RANK_CUTOFF_FRACTION)[0])
    if np.max(np.abs(step), initial=0.0) > POSE_PATH_STEP_MAX:
        return None
    there = _refine_step(here, step, goal)
    if there is None or _is_beyond_fold(rows, stack_task(model, there.q, goal)[1], last):
        return None
    return _approach_home(there, goal, home, 1)


def _is_beyond_fold(before: Array, after: Array, last: bool) -> bool:
    """Return True if a fold is between two configurations, given the Jacobians of loops and goal at both: the
    determinant of their rows, on the range of the first, has changed its sign. The fold itself is reached only by the
    ``last`` step: working modes meet there, and the next step would continue in any."""
    span, _ = compute_range_basis(before)
    turned = bool(np.linalg.slogdet(span.T @ before @ after.T @ span)[0] < 0)
    if turned != last:
        return turned
    was, is_folded = (
        bool(np.min(np.linalg.svd(span.T @ rows, compute_uv=False), initial=np.inf) <= FOLD_SINGULAR_VALUE_TOL)
        for rows in (before, after)
    )
    return not is_folded if last else is_folded and not was


def _refine_step(here: ClosedConfiguration, step: Array, goal: GuidedTask | None) -> ClosedConfiguration | None:
    """Return the closed configuration at the goal after a step; None if there is none, the correction is a jump, the
    step does not follow the branch, or a tilt limit excludes the rotation."""
    model = here.model
    predicted = model.integrate(here.q, step)
    q, residual = solve(model, predicted, goal, tolerance=CLOSURE_SOLVER_TOL, iterations=15)
    allowed = max(0.5 * float(np.linalg.norm(step)), JUMP_CORRECTION_MIN)
    if not residual <= CLOSURE_RESIDUAL_TOL or np.linalg.norm(q - predicted) > allowed or list_tilts_beyond(model, q):
        return None
    there = ClosedConfiguration.of(model, q)
    return there if is_on_branch(here, step, there) or is_on_branch_at_end(here, step, there) else None


def find_nearest(here: ClosedConfiguration, goal: GuidedTask, home: Task) -> ClosedConfiguration:
    """Return the configuration at ``goal`` nearest to ``home`` (a pose of the platform, other values): the projected
    gradient vanishes, the loops are closed as well as floating point can; ``here`` itself if the goal is met but for
    its printed digits."""
    if np.linalg.norm(goal.error_and_jacobian(here.model, here.q)[0]) > CLOSURE_SOLVER_TOL:
        return here
    return polish(_approach_home(here, goal, home, 100), goal)


def _approach_home(here: ClosedConfiguration, goal: GuidedTask, home: Task, iterations: int) -> ClosedConfiguration:
    """Minimise the error of ``home`` with the goal fixed."""
    for _ in range(iterations):
        size = np.linalg.norm(home.error_and_jacobian(here.model, here.q)[0]) + CLOSURE_SOLVER_TOL
        there = next(
            (
                each
                for each in _approach_task(
                    here, home, goal, RANK_CUTOFF_FRACTION, CONTINUATION_STEP_MAX, NEAREST_POSE_GRADIENT_TOL
                )
                if np.linalg.norm(home.error_and_jacobian(here.model, each.q)[0]) <= size
            ),
            None,
        )
        if there is None:
            break
        here = there
    return here


def _approach_task(
    here: ClosedConfiguration, task: Task, held: GuidedTask | None, cutoff: float, longest: float, least: float = 0.0
) -> Iterator[ClosedConfiguration]:
    """Yield Gauss-Newton steps on a task's error, in the tangent space of the loops and of ``held``, in ever smaller
    parts; nothing if the projected gradient is no more than ``least``."""
    kernel = here.kernel()[0]
    if held is not None:
        kernel, _ = compute_kernel_basis(
            np.vstack([here.model.jacobian(here.q), held.error_and_jacobian(here.model, here.q)[1]])
        )
    error, rows = task.error_and_jacobian(here.model, here.q)
    free = rows @ kernel
    if np.linalg.norm(error @ free) <= least:
        return
    step = shorten_step(kernel @ np.linalg.lstsq(free, -error, rcond=cutoff)[0], longest)
    for part in (1.0, 0.5, 0.25, 0.1, 0.02):
        there = _refine_step(here, part * step, held)
        if there is not None:
            yield there


def polish(here: ClosedConfiguration, goal: GuidedTask) -> ClosedConfiguration:
    """Make Newton steps of minimum norm until the residual no longer falls: on the edge of the workspace a
    configuration is only as exact as the square root of its residual."""
    model = here.model

    def advance(q: Array, at: Residual, factor: float) -> Array:
        step = np.linalg.lstsq(at.J, -at.error, rcond=HIDDEN_ROBOT_RESIDUAL_TOL)[0]
        return model.integrate(q, np.asarray(step, dtype=float))

    q, _ = descend(here.q, lambda q: stack_task(model, q, goal), advance, UNDAMPED, 20, lambda at: at.size == 0.0)
    return ClosedConfiguration.of(model, _find_fold(model, q, goal))


def _find_fold(model: PinocchioModel, q: Array, goal: GuidedTask) -> Array:
    """Return the configuration on a fold of the path (the edge of the workspace) if ``q`` is not distinguishable from
    it: where the smallest singular value of loops and goal vanishes, if the residual stays within
    ``CLOSURE_SOLVER_TOL`` there."""
    rows = stack_task(model, q, goal)[1]
    left, values, right = np.linalg.svd(rows, full_matrices=False)
    weak = np.nonzero((values < FOLD_SINGULAR_VALUE_TOL) & (values > HIDDEN_ROBOT_RESIDUAL_TOL))[0]
    if len(weak) != 1:
        return q
    across, along, size = left[:, weak[0]], right[weak[0]], float(values[weak[0]])
    ahead = stack_task(model, model.integrate(q, WAYPOINT_RESIDUAL_TOL * along), goal)[1]
    slope = (float(across @ ahead @ along) - size) / WAYPOINT_RESIDUAL_TOL
    if abs(slope) * WAYPOINT_RESIDUAL_TOL < size:
        return q
    there = model.integrate(q, -size / slope * along)
    return there if np.linalg.norm(stack_task(model, there, goal)[0]) <= CLOSURE_SOLVER_TOL else q
