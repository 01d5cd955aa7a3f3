"""Modes of any closed loop by search: the whole robot is closed from random starts with its measured values fixed.

Nothing is assumed of the legs, so every robot has an answer; and nothing is proved: what is listed was found, and there
may be more. The number of hits of each mode shows how well the search has covered them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import UndefinedValue
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import list_joints_beyond
from ...kinematics.pinocchio_model import PinocchioModel
from ...kinematics.self_motions import SelfMotion, bodies_apart, self_motion
from ...kinematics.tasks import FixedValuesTask, solve
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...progress import report
from ...tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    MODE_SEARCH_ITERATIONS_MAX,
    MODE_SEARCH_QUIET_STARTS_COUNT,
    MODE_SEARCH_STARTS_MAX,
    NEAR_MODE_DISTANCE_MAX,
    NONZERO_SINGULAR_VALUE_MIN,
    RELATION_ANGLE_TOL,
)

SEARCH_SELF_MOTIONS_MAX = 12
"""Largest number of self-motions followed by one search."""


@dataclass(frozen=True, eq=False)
class FoundMode:
    """Closed configuration of the whole robot with the measured values of the goal, the poses (4, 4) of the platform's
    bodies, the residual of loops and values, and the number of starts that led to that pose."""

    configuration: ClosedConfiguration
    bodies: dict[str, Array]
    residual: float
    met: int


@dataclass(frozen=True, eq=False)
class ModeSearch:
    """Modes found from random starts, at which the measured values determine the pose, the goal first if it is one;
    ``motions``: self-motions; how many of the ``starts`` ``closed``, and how many of those ended elsewhere where the
    values leave the platform a dof (``loose``)."""

    modes: tuple[FoundMode, ...]
    self_motions: tuple[SelfMotion, ...]
    starts: int
    closed: int
    loose: int
    near: tuple[FoundMode, ...] = ()
    """Closed configurations with nearly the measured values of the goal, each pose once."""

    @property
    def words(self) -> str:
        """Description of the search, and how well it covers the modes."""
        once = sum(mode.met == 1 for mode in self.modes[0 if any(motion.goal for motion in self.self_motions) else 1 :])
        rare = f"; {once} of the modes {'was' if once == 1 else 'were'} found only once" if once else ""
        moving = sum(motion.hits for motion in self.self_motions)
        on = f", {moving} of them on self-motions" if moving else ""
        return f"found from {self.starts} random starts of the whole robot, of which {self.closed} closed{on}{rare}"

    @property
    def degenerate(self) -> str | None:
        """Closed configurations at which the platform can move to first order, as text."""
        if not self.loose:
            return None
        return (
            f"{self.loose} starts ended at poses, not listed, at which the measured values leave the platform a "
            "dof, and from which no self-motion was followed: singular poses"
        )


def search(goal: ClosedConfiguration, observation_model: ObservationModel, bodies: Sequence[str]) -> ModeSearch:
    """All closings with the measurements at the goal that random starts lead to, each pose of the bodies once; of the
    closings at one pose the first within the joints' limits, where there is one. From closings at which the platform
    is free, self-motions are followed."""
    model, rng = goal.model, np.random.default_rng(0)
    held = FixedValuesTask.at(model, goal.q, observation_model.reference, observation_model.observations)
    goal_motion = (
        self_motion(goal, observation_model, bodies, goal=True)
        if has_unobserved_motion(goal, observation_model)
        else None
    )
    listed = [FoundMode(goal, _collect_poses(goal, bodies), goal.residual, 1)] if goal_motion is None else []
    motions = [] if goal_motion is None else [goal_motion]
    starts = closed = loose = quiet = 0
    near = list[FoundMode]()
    while starts < MODE_SEARCH_STARTS_MAX and quiet < MODE_SEARCH_QUIET_STARTS_COUNT:
        number, starts = starts, starts + 1
        report("starts")
        far = np.pi if number % 2 else rng.uniform(0.0, np.pi)
        start = model.integrate(model.q0, rng.uniform(-far, far, model.nv))
        try:
            q, residual = solve(model, start, held, tolerance=CLOSURE_SOLVER_TOL, iterations=MODE_SEARCH_ITERATIONS_MAX)
        except UndefinedValue:  # along the path a point came to a camera's centre
            continue
        if residual > CLOSURE_RESIDUAL_TOL:
            if residual <= NEAR_MODE_DISTANCE_MAX:
                _add_near(near, model, q, residual, bodies, observation_model)
            continue
        closed, quiet = closed + 1, quiet + 1
        at = ClosedConfiguration.of(model, model.remove_turns(q))
        poses = _collect_poses(at, bodies)
        known = next(
            (
                k
                for k, mode in enumerate(listed)
                if bodies_apart(mode.bodies, poses, observation_model, model.length) <= RELATION_ANGLE_TOL
            ),
            None,
        )
        if known is not None:
            mode = listed[known]
            better = (
                mode.configuration is not goal
                and list_joints_beyond(model, mode.configuration.q)
                and not list_joints_beyond(model, q)
            )
            listed[known] = FoundMode(at if better else mode.configuration, mode.bodies, mode.residual, mode.met + 1)
        elif not has_unobserved_motion(at, observation_model):
            listed.append(FoundMode(at, poses, residual, 1))
            quiet = 0
        elif (
            on := next((k for k, motion in enumerate(motions) if motion.has_visited(at, observation_model)), None)
        ) is not None:
            motions[on] = replace(motions[on], hits=motions[on].hits + 1)
        else:
            motion = (
                self_motion(at, observation_model, bodies, motions) if len(motions) < SEARCH_SELF_MOTIONS_MAX else None
            )
            if motion is None:
                loose += 1
            elif motion in motions:
                on = motions.index(motion)
                motions[on] = replace(motion, hits=motion.hits + 1)
            else:
                motions.append(replace(motion, hits=1))
                quiet = 0
    return ModeSearch(tuple(listed), tuple(motions), starts, closed, loose, tuple(near))


def _add_near(
    near: list[FoundMode],
    model: PinocchioModel,
    q: Array,
    residual: float,
    bodies: Sequence[str],
    observation_model: ObservationModel,
) -> None:
    """Close the loops where a start ended that met loops and measurements nearly, and add that pose if it is new."""
    q, left = solve(model, q, tolerance=CLOSURE_SOLVER_TOL)
    if left > CLOSURE_RESIDUAL_TOL:
        return
    at = ClosedConfiguration.of(model, model.remove_turns(q))
    poses = _collect_poses(at, bodies)
    if all(
        bodies_apart(known.bodies, poses, observation_model, model.length) > NEAR_MODE_DISTANCE_MAX for known in near
    ):
        near.append(FoundMode(at, poses, residual, 1))


def has_unobserved_motion(at: ClosedConfiguration, observation_model: ObservationModel) -> bool:
    """Return True if the measured values leave the platform a dof, to first order or nearly: then rounding makes closed
    configurations about one that is not."""
    relation = compute_relation(at, observation_model)
    return relation.rank < relation.dof.value or relation.seen.weakest < NONZERO_SINGULAR_VALUE_MIN


def _collect_poses(at: ClosedConfiguration, bodies: Sequence[str]) -> dict[str, Array]:
    return {body: at.pose(body) for body in bodies}
