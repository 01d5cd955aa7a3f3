"""Closed configurations at wanted poses, reached from the zero configuration by small steps in its working mode."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, cast

import numpy as np

from ..errors import PoseReachFailure, SamplingFailure
from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.continuation import (
    CONTINUATION_HALVINGS_MAX,
    FOLD_SINGULAR_VALUE_TOL,
    GOAL_DIRECTION_CUTOFF_FRACTION,
    find_nearest,
    is_goal_dependent,
    track,
)
from ..kinematics.joint_coordinates import track_to_joints
from ..kinematics.leg_reach import find_beyond_rods, find_worst_leg
from ..kinematics.limits import find_tilt_at_end, list_tilts_beyond
from ..kinematics.platform_motion import PlatformMotion, PoseTask
from ..kinematics.tasks import Task, stack_task
from ..kinematics.velocity_relation import ObservationModel
from ..kinematics.walking import walk_randomly
from ..mechanism.pose import Grid, JointPose, Pose
from ..progress import report
from ..tolerances import PRINTED_POSE_TOL

if TYPE_CHECKING:
    from .configuration_builder import ConfigurationBuilder

FIRST_GRID_CELLS_COUNT = 40
"""Nearest cells of a grid that are tried from zero before it counts as unreachable."""
SWEEP_STEP_HALVINGS_MAX = 4
"""Halvings of a step in a sweep that can reach a pose from several neighbours."""


def find_generic_motion(start: ClosedConfiguration, observation_model: ObservationModel) -> PlatformMotion:
    """Return the generic motion of the platform, from a few random configurations."""
    return PlatformMotion.of(walk_randomly(start, 4, steps=2), observation_model)


def track_to_pose(
    start: ClosedConfiguration, observation_model: ObservationModel, pose: Pose, motion: PlatformMotion | None = None
) -> ClosedConfiguration:
    """The configuration at ``pose`` that small steps lead to from ``start``; free parts are nearest to their values at
    the zero configuration (characteristic lengths, radians).

    ``motion`` is what the platform generically does (default: found by a random walk). Raises ``BadRequest`` for parts
    that it cannot change, ``PoseReachFailure`` where the way ends before the pose.
    """
    motion = motion or find_generic_motion(start, observation_model)
    robot = start.model.mechanism.name
    goal = motion.goal(pose, robot)
    here, came = _lead_from(start, lambda: _list_origins(start, motion, goal), motion, goal)
    found = find_nearest(here, goal, motion.at_home()) if came == 1 else here
    if came < 1 or not _has_arrived(found, goal):
        missed = find_worst_leg(start.model, motion, goal)
        last = str(motion.pose(here.pose(motion.link)))
        wrist = find_tilt_at_end(here)
        why = (
            None
            if missed or wrist
            else (explain_dependence(start, motion, goal, "this pose", came == 0) or _explain_rank_loss(start, here))
        )
        raise PoseReachFailure(robot, str(pose), came, last, missed, wrist=wrist, why=why)
    return found


def track_to_request(
    start: ClosedConfiguration, observation_model: ObservationModel, asked: Pose | JointPose, motion: PlatformMotion
) -> ClosedConfiguration:
    """The configuration at a pose by its parts, or by joints or motors, that small steps lead to from ``start``, joints
    beyond their limits too; raises as :func:`track_to_pose` and :func:`.track_to_joints`."""
    if isinstance(asked, JointPose):
        return track_to_joints(start, motion, asked, within_limits=False)[0]
    return track_to_pose(start, observation_model, asked, motion)


def explain_dependence(
    start: ClosedConfiguration, motion: PlatformMotion, goal: PoseTask, what: str, stuck: bool = False
) -> str | None:
    """Return a text on parts of desired poses (``what``) that depend on each other, at zero and elsewhere, or where the
    path is ``stuck`` at zero, there; None if they do not. A part alone depends on nothing: the platform does not change
    it."""
    rows = goal.error_and_jacobian(start.model, start.q)[1]
    if not is_goal_dependent(start, rows):
        return None
    there = any(is_goal_dependent(at, goal.error_and_jacobian(at.model, at.q)[1]) for at in _sample_beside(start)[-1:])
    if not (there or stuck):
        return None
    where = "at zero and at a random configuration" if there else "at zero, to first order,"
    why = (
        "none of them changes this part"
        if len(rows) == 1
        else f"parts of {what} depend on each other" + ": give fewer" * there
    )
    return f"the platform has {motion.dof} dof, and {where} {why}"


def explain_grid_dependence(start: ClosedConfiguration, motion: PlatformMotion, grid: Grid) -> str | None:
    """Return the text of :func:`explain_dependence` for the poses of a grid."""
    if grid.joints:
        return None
    goal = motion.goal(next(iter(grid.poses_at([(0,) * grid.ndim]))), start.model.mechanism.name)
    return explain_dependence(start, motion, goal, "these poses")


def _sample_beside(start: ClosedConfiguration) -> list[ClosedConfiguration]:
    """Random configurations beside ``start``; none where every step from it comes near a singularity."""
    try:
        return list(walk_randomly(start, 8, steps=2))
    except SamplingFailure:
        return []


def _list_origins(start: ClosedConfiguration, motion: PlatformMotion, goal: PoseTask) -> list[ClosedConfiguration]:
    """Return the configurations from which paths to goals with these parts may start besides ``start``: beside it, if
    the platform changes fewer of these parts at ``start`` than there, though it has all its dof (a rotation that two
    others make together)."""
    rows = goal.error_and_jacobian(start.model, start.q)[1]
    if not is_goal_dependent(start, rows):
        return []
    if _count_free_parts(start, motion.at_home().error_and_jacobian(start.model, start.q)[1]) < motion.dof:
        return []
    return [
        at
        for at in _sample_beside(start)
        if _count_free_parts(at, goal.error_and_jacobian(at.model, at.q)[1]) > _count_free_parts(start, rows)
    ]


def _count_free_parts(at: ClosedConfiguration, rows: Array) -> int:
    """Return the number of parts with Jacobian ``rows`` (k, nv) that change independently, with closed loops."""
    return compute_range_basis(rows @ at.kernel()[0], 1.0)[1].value


def _lead_from(
    here: ClosedConfiguration,
    beside: Callable[[], Sequence[ClosedConfiguration]],
    motion: PlatformMotion,
    goal: PoseTask,
    halvings: int = CONTINUATION_HALVINGS_MAX,
) -> tuple[ClosedConfiguration, float]:
    """Return the end of small steps to a goal, as :func:`.steps.track`: from ``here``, or else from the two ``beside``
    that are nearest to the goal."""
    led = track(here, motion, goal, halvings)
    if led[1] == 1:
        return led
    for at in sorted(beside(), key=lambda at: float(np.linalg.norm(goal.error_and_jacobian(at.model, at.q)[0])))[:2]:
        if (other := track(at, motion, goal, halvings))[1] == 1:
            return other
    return led


def _explain_rank_loss(start: ClosedConfiguration, here: ClosedConfiguration) -> str | None:
    """Return a text if the path ended where the loops lose rank."""
    kept, left = start.strengths, here.strengths
    if len(left) == len(kept) and (not len(kept) or left[-1] > GOAL_DIRECTION_CUTOFF_FRACTION * kept[-1]):
        return None
    return "on the straight path to it the loops lose rank (a constraint singularity), which small steps do not pass"


def _has_arrived(at: ClosedConfiguration, goal: PoseTask) -> bool:
    """Return True if a configuration is at the desired pose, by its matrix, and no tilt limit is exceeded."""
    return goal.is_met(at.pose(goal.link), PRINTED_POSE_TOL * max(1.0, at.model.length)) and not list_tilts_beyond(
        at.model, at.q
    )


def sweep(
    start: ClosedConfiguration,
    observation_model: ObservationModel,
    grid: Grid,
    motion: PlatformMotion | None = None,
    placer: ConfigurationBuilder | None = None,
) -> tuple[ClosedConfiguration | None, ...]:
    """Configurations at the poses of a grid, in its order, each reached from a neighbour; None where that fails from
    every neighbour. The first is the reachable one nearest to ``start``.

    A ``placer`` gives them at once where the legs are known subproblems and free parts can stay as they are at zero;
    only the others are led there step by step. A cell of joints is where the straight line from zero leads."""
    motion = motion or find_generic_motion(start, observation_model)
    if grid.joints:
        return tuple(_sweep_joints(start, motion, grid))
    goals = [motion.goal(pose, start.model.mechanism.name) for pose in grid.poses()]
    home = motion.at_home()
    from .grids import find_ready_configurations

    at_once, hopeless = (
        ({}, find_beyond_rods(start.model.mechanism, motion, goals))
        if placer is None
        else (find_ready_configurations(placer, motion, goals))
    )

    beside = cache(lambda: _list_origins(start, motion, goals[0]))

    def lead(cell: int, origin: ClosedConfiguration, halvings: int) -> ClosedConfiguration | None:
        if cell in hopeless:
            return None
        if cell in at_once:
            there, came = at_once[cell], 1.0
        else:
            there, came = _lead_from(origin, beside, motion, goals[cell], halvings)
            there = find_nearest(there, goals[cell], home) if came == 1 else there
        return there if came == 1 and _has_arrived(there, goals[cell]) else None

    return spread(start, grid.shape, goals, lead, at_once)


def _sweep_joints(
    start: ClosedConfiguration, motion: PlatformMotion, grid: Grid
) -> Iterator[ClosedConfiguration | None]:
    """Yield the configurations of a grid of joints or motors, each at the end of the straight line from zero, joints
    beyond their limits too."""
    for number, asked in enumerate(grid.requests_at(np.ndindex(grid.shape)), 1):
        report("poses", number, grid.size)
        try:
            yield track_to_joints(start, motion, cast(JointPose, asked), within_limits=False)[0]
        except PoseReachFailure:
            yield None


def spread(
    start: ClosedConfiguration,
    shape: tuple[int, ...],
    goals: Sequence[Task],
    lead: Callable[[int, ClosedConfiguration, int], ClosedConfiguration | None],
    at_once: Container[int] = (),
) -> tuple[ClosedConfiguration | None, ...]:
    """Configurations at the ``goals`` of a grid's cells, of a ``shape``: ``lead`` gives that of a cell from a
    configuration nearby with so many halvings, None where it does not come there. It begins at the goal nearest to
    ``start``, and at further ones where no neighbour is reached from it, and goes on to neighbours, but not from a
    fold: working modes meet there, and small steps go on in any. Cells ``at_once`` need no steps."""
    model = start.model
    found: dict[int, ClosedConfiguration] = {}
    queue: deque[tuple[int, int]] = deque()
    distance = [float(np.linalg.norm(goal.error_and_jacobian(model, start.q)[0])) for goal in goals]
    rank = compute_range_basis(stack_task(model, start.q, goals[0])[1])[1].value

    def settle(cell: int, origin: ClosedConfiguration, halvings: int) -> None:
        there = lead(cell, origin, halvings)
        if there is not None:
            found[cell] = there
            queue.extend((other, cell) for other in _list_neighbours(cell, shape) if other not in found)
            report("poses", len(found), len(goals))

    @cache
    def is_fold(cell: int) -> bool:
        J = stack_task(model, found[cell].q, goals[cell])[1]
        return bool(np.linalg.svd(J, compute_uv=False)[rank - 1] <= FOLD_SINGULAR_VALUE_TOL)

    alone = False
    for first in sorted(range(len(distance)), key=lambda i: (round(distance[i], 9), i))[:FIRST_GRID_CELLS_COUNT]:
        if first in found:
            continue
        before = len(found)
        settle(first, start, CONTINUATION_HALVINGS_MAX)
        while queue:
            cell, origin = queue.popleft()
            if cell not in found and (cell in at_once or not is_fold(origin)):
                settle(cell, found[origin], SWEEP_STEP_HALVINGS_MAX)
        alone |= len(found) == before + 1
        if found and not alone:
            break
    return tuple(found.get(cell) for cell in range(len(goals)))


def _list_neighbours(cell: int, shape: tuple[int, ...]) -> Iterator[int]:
    """The cells next to one, along each axis."""
    place = np.unravel_index(cell, shape)
    for axis, size in enumerate(shape):
        for side in (-1, 1):
            if 0 <= place[axis] + side < size:
                beside = [*place]
                beside[axis] += side
                yield int(np.ravel_multi_index(beside, shape))
