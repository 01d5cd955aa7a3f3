"""Outcome of a run, in the words of docs/pages/proofs.md, section 11: goal, assembly mode, antipodal, local minimum,
limit reached, out of view, time, undecided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ..analysis.configuration_report import ConfigurationAnalysis
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.observed import ObservedRobot
from ..errors import HrsynthError
from ..geometry.vectors import Array, compare_poses
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.observations.direction import SeenAxis
from ..records import As, Recorded
from ..results import Value
from ..tolerances import CONTROLLER_DAMPING_MIN, NEAR_MODE_DISTANCE_MAX, NEAR_POSE_DIFFERENCE_TOL, RELATION_ANGLE_TOL
from .law import Command, Measures
from .run import AWAY, EFFORT, LIMIT, LOST, OPEN, POISED, REST, RUN_EVALUATIONS_MAX, SERVED_AT, UNMEASURED, UNSEEN, Run

GOAL, MODE, ANTIPODAL, MINIMUM = "goal", "assembly mode", "antipodal", "local minimum"
BOUNDARY, SIGHT, TIME, UNDECIDED = "limit reached", "out of view", "time", "undecided"
ENDINGS = (GOAL, MODE, ANTIPODAL, MINIMUM, BOUNDARY, SIGHT, TIME, UNDECIDED)


@dataclass(frozen=True, eq=False, repr=False)
class RunOutcome(Value):
    """Outcome of a run and its reason; ``matched`` is the number of the assembly mode, counted from 1 in the list of
    all modes of the goal's directions (None if it is none of them, or if they cannot be listed)."""

    name: Annotated[str, As("outcome")]
    reason: Recorded[str]
    matched: Annotated[int | None, As("matched_mode")] = None
    modes: AssemblyModes | None = None


@dataclass(frozen=True, eq=False, repr=False)
class OutcomeClassifier(Value):
    """Classifier of outcomes by the goal's configuration and measured values."""

    setup: ObservedRobot
    goal: ClosedConfiguration
    wanted: Measures

    def classify(self, run: Run, values: Measures) -> RunOutcome:
        """Return the outcome of a run with these values measured at its end."""
        last = run.commands[-1]
        if run.stopped == SERVED_AT:
            return self._serve(run.last, values)
        if run.stopped in (REST, POISED):
            ending = rest(self.setup, run.last, last)
            loose = "" if run.stopped == REST else "; this equilibrium was not found to be stable"
            return replace(ending, reason=ending.reason + loose + self._near(run.last, last.size))
        if run.stopped == LIMIT:
            return RunOutcome(BOUNDARY, f"joint {run.joint} is at its limit")
        if run.stopped == UNSEEN:
            return RunOutcome(SIGHT, f"{self._unseen(run.last)}: the error is undefined")
        if run.stopped == UNMEASURED:
            return RunOutcome(
                SIGHT,
                "a point or line reaches the camera centre, or the camera enters a cylinder: the measured value is "
                "undefined there",
            )
        if run.stopped == OPEN:
            return RunOutcome(BOUNDARY, "the loops lose rank here, and the integrator could not continue")
        if run.stopped == LOST:
            return RunOutcome(UNDECIDED, "the integrator could not continue: the end of the run is undecided")
        if run.stopped == AWAY:
            return RunOutcome(BOUNDARY, "the platform runs away: no joint limit stops it")
        over = (
            f"more than {RUN_EVALUATIONS_MAX:,} configurations would be needed"
            if run.stopped == EFFORT
            else "the time ran out"
        )
        way = ""
        if run.ahead is not None:
            there, slow = run.ahead
            goal = self.is_at_pose(there, self.goal.pose(self.setup.motion.link))
            pose = "the goal" if goal else str(self.setup.motion.pose(there.pose(self.setup.motion.link)))
            way = f"; it was still approaching a stable equilibrium at {pose}, with the time constant {slow:.3g} s"
        return RunOutcome(TIME, f"{over}, with ‖e‖ = {last.size:.3g}{way}")

    def _near(self, at: ClosedConfiguration, size: float) -> str:
        """Return a text on the near mode of the goal at an equilibrium, if any."""
        motion = self.setup.motion
        try:
            listed = (
                modes(self.setup, at=motion.pose(self.goal.pose(motion.link)))
                if size < NEAR_MODE_DISTANCE_MAX
                else None
            )
        except HrsynthError:
            return ""
        return next(
            (
                f"; it is near mode {k} of the goal: the measured values differ {mode.differs}"
                for k, mode in enumerate(() if listed is None else listed.near_modes, 1)
                if mode.bodies
                and all(
                    compare_poses(at.pose(body), X, at.model.length) <= NEAR_POSE_DIFFERENCE_TOL
                    for body, X in mode.bodies.items()
                )
            ),
            "",
        )

    def _unseen(self, at: ClosedConfiguration) -> str:
        """Return a text on the observation that leaves its camera's field of view."""
        reference = self.setup.mechanism.reference
        first = min(self.setup.observed, key=lambda o: o.in_front(at.pose(o.seen_from or reference), at.pose(o.link)))
        return f"{first.text} leaves the field of view"

    def _serve(self, at: ClosedConfiguration, values: Measures) -> RunOutcome:
        opposite = [
            float(value @ wanted) < 0
            for o, value, wanted in zip(self.setup.observed, values, self.wanted, strict=True)
            if isinstance(o, SeenAxis)
        ]
        word = "directions" if len(opposite) == len(self.setup.observed) else "measurements"
        if any(opposite):
            there = "; the pose is the goal's" if self.is_at_pose(at, self.goal.pose(self.setup.motion.link)) else ""
            return RunOutcome(
                ANTIPODAL,
                f"{sum(opposite)} of {len(opposite)} directions are opposite to the desired ones, where the error "
                f"vanishes as well{there}",
            )
        if self.is_at_pose(at, self.goal.pose(self.setup.motion.link)):
            return RunOutcome(GOAL, f"the {word} and the pose are those of the goal")
        try:
            motion = self.setup.motion
            listed = modes(self.setup, at=motion.pose(self.goal.pose(motion.link)))
        except HrsynthError as error:
            return RunOutcome(MODE, f"the {word} are the goal's, the pose is not; assembly modes not listed: {error}")
        for number, mode in enumerate(listed.modes, 1):
            bodies = mode.bodies or {}
            if bodies and all(self._is_same_pose(at.pose(body), X, None) for body, X in bodies.items()):
                return RunOutcome(
                    MODE,
                    f"the {word} are the goal's, the pose is its assembly mode {number} of {len(listed.modes)}",
                    number,
                    listed,
                )
        return RunOutcome(
            MODE, f"the {word} are the goal's, the pose is none of the listed assembly modes", None, listed
        )

    def is_at_pose(self, at: ClosedConfiguration, X: Array) -> bool:
        """Return True if the platform of a configuration is at X (4, 4), to ``RELATION_ANGLE_TOL``."""
        return self._is_same_pose(at.pose(self.setup.motion.link), X, self.setup.decomposition.point)

    def _is_same_pose(self, X: Array, other: Array, point: Array | None) -> bool:
        return compare_poses(X, other, self.goal.model.length, point) <= RELATION_ANGLE_TOL


def rest(setup: ObservedRobot, at: ClosedConfiguration, last: Command) -> RunOutcome:
    """Classify a configuration at which the command vanishes but the error does not: a singularity of the hidden robot,
    the limit of a leg's reach, or neither."""
    posture = ConfigurationAnalysis.of(setup).classify(at)
    where = f"‖e‖ = {last.size:.3g} and the command vanishes"
    weak = float(last.values[-1]) < CONTROLLER_DAMPING_MIN
    shifted = at.velocity(setup.motion.link) @ last.weak
    if weak and float(np.linalg.norm(shifted)) < CONTROLLER_DAMPING_MIN:
        tree = len(at.model.mechanism.joints) < len(at.model.mechanism.links)
        why = "the arm is singular, for example stretched" if tree else "an unobserved leg is at the limit of its reach"
        return RunOutcome(BOUNDARY, f"{where}: {why}")
    far = posture.distances
    if weak and far.type2 is not None and far.type2 < CONTROLLER_DAMPING_MIN:
        return RunOutcome(MINIMUM, f"{where} at a Type 2 singularity of the hidden robot")
    if (far.type1 is not None and far.type1 < CONTROLLER_DAMPING_MIN) or far.type2 is None:
        return RunOutcome(MINIMUM, f"{where} at a Type 1 singularity of the hidden robot")
    if weak and any(isinstance(each, SeenAxis) for each in setup.observed):
        return RunOutcome(
            MINIMUM,
            f"{where} off the singularities of the hidden robot: a direction is perpendicular to the desired one",
        )
    off = f"{where} off the singularities of the hidden robot"
    if weak:
        return RunOutcome(MINIMUM, f"{off}: the rows of the law, with the assumed depths, lose rank there")
    if sum(each.rank for each in setup.observed) > len(last.values):
        return RunOutcome(MINIMUM, f"{off}: the observation is redundant")
    return RunOutcome(MINIMUM, off)
