"""Where a run ended, in the words of docs/pages/proofs.md, section 11: goal, mode, antipodal, local minimum, boundary,
lost from sight, time; or undecided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ..analysis.configuration_report import ConfigurationAnalysis
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.observed import ObservedRobot
from ..budgets import RUN_EVALUATIONS
from ..errors import HrsynthError
from ..geometry.vectors import Array, pose_difference
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.observations.direction import SeenAxis
from ..records import As, Recorded
from ..results import Value
from ..tolerances import DAMPED, NEAR_MODE, SAME_NEAR_POSE, SAME_RELATION
from .law import Command, Measures
from .run import AWAY, EFFORT, LIMIT, LOST, OPEN, POISED, REST, SERVED_AT, UNMEASURED, UNSEEN, Run

GOAL, MODE, ANTIPODAL, MINIMUM, BOUNDARY, TIME = "goal", "mode", "antipodal", "local minimum", "boundary", "time"
SIGHT, UNDECIDED = "lost from sight", "undecided"
ENDINGS = (GOAL, MODE, ANTIPODAL, MINIMUM, BOUNDARY, SIGHT, TIME, UNDECIDED)


@dataclass(frozen=True, eq=False, repr=False)
class RunOutcome(Value):
    """How a run ended and why that is its name; ``matched`` is the number of the assembly mode, counted from 1 in the
    list of all modes of the goal's directions (None if it is none of them, or if they cannot be listed)."""

    name: Annotated[str, As("outcome")]
    reason: Recorded[str]
    matched: Annotated[int | None, As("matched_mode")] = None
    modes: AssemblyModes | None = None


@dataclass(frozen=True, eq=False, repr=False)
class OutcomeClassifier(Value):
    """Names endings by the goal's configuration and measured values."""

    setup: ObservedRobot
    goal: ClosedConfiguration
    wanted: Measures

    def classify(self, run: Run, values: Measures) -> RunOutcome:
        """The ending of a run at whose end these values are measured."""
        last = run.commands[-1]
        if run.stopped == SERVED_AT:
            return self._serve(run.last, values)
        if run.stopped in (REST, POISED):
            ending = rest(self.setup, run.last, last)
            loose = "" if run.stopped == REST else "; this rest was not found to attract"
            return replace(ending, reason=ending.reason + loose + self._near(run.last, last.size))
        if run.stopped == LIMIT:
            return RunOutcome(BOUNDARY, f"joint {run.joint} is at its limit")
        if run.stopped == UNSEEN:
            return RunOutcome(SIGHT, f"{self._unseen(run.last)}: the loop has nothing to act on")
        if run.stopped == UNMEASURED:
            return RunOutcome(
                SIGHT,
                "a point or line comes to the camera's centre, or the camera into a cylinder: what is "
                "measured has no value there",
            )
        if run.stopped == OPEN:
            return RunOutcome(BOUNDARY, "the loops lose their rank here, and the integrator could not continue")
        if run.stopped == LOST:
            return RunOutcome(UNDECIDED, "the integrator could not continue, which says nothing about the robot")
        if run.stopped == AWAY:
            return RunOutcome(BOUNDARY, "the platform runs away, nothing limits its slides")
        over = (
            f"more than {RUN_EVALUATIONS:,} configurations would be needed"
            if run.stopped == EFFORT
            else "the time ran out"
        )
        way = ""
        if run.ahead is not None:
            there, slow = run.ahead
            goal = self.same_pose(there, self.goal.pose(self.setup.motion.link))
            pose = "the goal" if goal else str(self.setup.motion.pose(there.pose(self.setup.motion.link)))
            way = (
                f"; it was still on its way to a rest that attracts, found at {pose}, where the distance left falls "
                f"by a factor of e every {slow:.3g} s"
            )
        return RunOutcome(TIME, f"{over}, with ‖e‖ = {last.size:.3g}{way}")

    def _near(self, at: ClosedConfiguration, size: float) -> str:
        """Which near mode of the goal a rest is, if any."""
        motion = self.setup.motion
        try:
            listed = modes(self.setup, at=motion.pose(self.goal.pose(motion.link))) if size < NEAR_MODE else None
        except HrsynthError:
            return ""
        return next(
            (
                f"; it is near mode {k} of the goal: what is measured differs {mode.differs}"
                for k, mode in enumerate(() if listed is None else listed.near_modes, 1)
                if mode.bodies
                and all(
                    pose_difference(at.pose(body), X, at.model.length) <= SAME_NEAR_POSE
                    for body, X in mode.bodies.items()
                )
            ),
            "",
        )

    def _unseen(self, at: ClosedConfiguration) -> str:
        """What a camera has lost."""
        reference = self.setup.mechanism.reference
        first = min(self.setup.observed, key=lambda o: o.in_front(at.pose(o.seen_from or reference), at.pose(o.link)))
        return f"{first.kind} {first.leg} leaves the camera's sight"

    def _serve(self, at: ClosedConfiguration, values: Measures) -> RunOutcome:
        opposite = [
            float(value @ wanted) < 0
            for o, value, wanted in zip(self.setup.observed, values, self.wanted, strict=True)
            if isinstance(o, SeenAxis)
        ]
        word = "directions" if len(opposite) == len(self.setup.observed) else "measurements"
        if any(opposite):
            there = "; the pose is the goal's" if self.same_pose(at, self.goal.pose(self.setup.motion.link)) else ""
            return RunOutcome(
                ANTIPODAL,
                f"{sum(opposite)} of {len(opposite)} directions end opposite to the desired "
                f"ones, where the error vanishes as well{there}",
            )
        if self.same_pose(at, self.goal.pose(self.setup.motion.link)):
            return RunOutcome(GOAL, f"the {word} and the pose are those of the goal")
        try:
            motion = self.setup.motion
            listed = modes(self.setup, at=motion.pose(self.goal.pose(motion.link)))
        except HrsynthError as error:
            return RunOutcome(MODE, f"the {word} are the goal's, the pose is not; modes not listed: {error}")
        for number, mode in enumerate(listed.modes, 1):
            bodies = mode.bodies or {}
            if bodies and all(self._alike(at.pose(body), X, None) for body, X in bodies.items()):
                return RunOutcome(
                    MODE,
                    f"the {word} are the goal's, the pose is its assembly mode {number} of {len(listed.modes)}",
                    number,
                    listed,
                )
        return RunOutcome(
            MODE, f"the {word} are the goal's, the pose is none of the assembly modes that were listed", None, listed
        )

    def same_pose(self, at: ClosedConfiguration, X: Array) -> bool:
        """Whether the platform of a configuration is at X (4, 4), to ``SAME_RELATION``."""
        return self._alike(at.pose(self.setup.motion.link), X, self.setup.decomposition.point)

    def _alike(self, X: Array, other: Array, point: Array | None) -> bool:
        return pose_difference(X, other, self.goal.model.length, point) <= SAME_RELATION


def rest(setup: ObservedRobot, at: ClosedConfiguration, last: Command) -> RunOutcome:
    """What a configuration is at which the command vanishes but the error does not: a singularity of the hidden robot,
    the limit of a leg's reach, or neither."""
    posture = ConfigurationAnalysis.of(setup).classify(at)
    where = f"‖e‖ = {last.size:.3g} and the command vanishes"
    weak = float(last.values[-1]) < DAMPED
    shifted = at.velocity(setup.motion.link) @ last.weak
    if weak and float(np.linalg.norm(shifted)) < DAMPED:
        tree = len(at.model.mechanism.joints) < len(at.model.mechanism.links)
        why = (
            "the arm is at a singularity of its own, as where it is stretched"
            if tree
            else "a leg that is not watched is stretched to its limit"
        )
        return RunOutcome(BOUNDARY, f"{where}: {why}")
    far = posture.distances
    if weak and far.type2 is not None and far.type2 < DAMPED:
        return RunOutcome(MINIMUM, f"{where} at a Type 2 singularity of the hidden robot")
    if (far.type1 is not None and far.type1 < DAMPED) or far.type2 is None:
        return RunOutcome(MINIMUM, f"{where} at a Type 1 singularity of the hidden robot")
    if weak and any(isinstance(each, SeenAxis) for each in setup.observed):
        return RunOutcome(
            MINIMUM,
            f"{where} off the singularities of the hidden robot: a direction is perpendicular to the desired one",
        )
    off = f"{where} off the singularities of the hidden robot"
    if weak:
        return RunOutcome(MINIMUM, f"{off}: the law's own rows, with the depths that it supposes, lose rank there")
    if sum(each.rank for each in setup.observed) > len(last.values):
        return RunOutcome(MINIMUM, f"{off}: more is measured than the robot has freedoms")
    return RunOutcome(MINIMUM, off)
