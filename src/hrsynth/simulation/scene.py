"""A servo run before it happens: start, goal, law, what is desired, how it is measured; and what came of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis.controllability import verdict_of
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.observed import ObservedRobot, prepare
from ..analysis.posture import REGULAR, UNDECIDED, Examiner
from ..batch.reach import reach
from ..budgets import LONGEST_RUN, RUN_EVALUATIONS
from ..errors import BadRequest, PoseNotReached, RankUndecided
from ..geometry.so3 import angle_of
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from ..tolerances import RANK_GAP
from .camera import Camera, Edges, cylinders, placed
from .desired import Step, Trajectory, straight, whole
from .ending import Referee
from .law import Law, Sense, directions
from .noise import Amount, Cones, Shocks
from .pictures import Pictures, Stage, drawing, vision
from .result import Servo, Spread
from .run import EFFORT, Loop, Run
from .track import tracked

LASTS, NOISY_LASTS = 60.0, 16.0
"""Time constants 1 / λ that a run may take; that it takes where measurements are noisy."""
SETTLED = 0.5
"""Part of a noisy run after which its errors are counted."""
EXACT, EDGES, PICTURES = "exact", "edges", "pictures"
SENSES = (EXACT, EDGES, PICTURES)


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot that is about to be servoed: its start and goal configurations and poses, its law, what is desired."""

    setting: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    law: Law
    desired: Step | Trajectory
    modes: Callable[[], AssemblyModes]

    @classmethod
    def of(cls, robot: Mechanism, observe: Sequence[str] | str | None, camera: str | None, *, start: Pose | str,
           goal: Pose | str, gain: float, duration: float | None = None, seed: int = 0) -> Scene:
        """The scene of a request; raises what :func:`servo` raises."""
        for what, value in (("gain", gain), ("duration", duration)):
            if value is not None and not 0 < value < math.inf:
                raise BadRequest(what, value, "a positive number")
        if duration is not None and duration > LONGEST_RUN:
            raise BadRequest("duration", duration, f"at most {LONGEST_RUN:g} seconds")
        wanted = [Pose.parse(each) if isinstance(each, str) else each for each in (start, goal)]
        setting = prepare(robot, observe, camera, seed=seed)
        _sees(setting)
        question, motion = setting.everything.question, setting.motion
        ends = []
        try:
            for pose in wanted:
                ends.append(reach(setting.everything.start, question, pose, motion))
            law = Law(setting.samples.question, setting.dof, gain)
            desired: Step | Trajectory = Step(directions(ends[1], law.question)[0])
            if duration is not None:
                goal_pose = whole(motion, ends[1].pose(motion.link))
                desired, ends[1] = straight(ends[0], motion, goal_pose, law.question, duration)
        except PoseNotReached as error:
            error.exit_status = 2
            raise
        examiner = Examiner(setting)
        for name, at in zip(("start", "goal"), ends, strict=True):
            _regular(examiner, name, at)

        def listed() -> AssemblyModes:
            return modes(robot, observe, camera, at=motion.pose(ends[1].pose(motion.link)), seed=seed)

        return cls(setting, ends[0], ends[1], law, desired, listed)

    @property
    def directions(self) -> Array:
        """The directions (k, 3) of the goal."""
        return directions(self.goal, self.law.question)[0]

    def horizon(self, time: float | None, noisy: bool) -> float:
        """How long a run may take (s)."""
        if time is not None and not 0 < time < math.inf:
            raise BadRequest("time", time, "a positive number of seconds")
        steady = self.desired.duration if isinstance(self.desired, Trajectory) else 0.0
        found = time or steady + (NOISY_LASTS if noisy else LASTS) / self.law.gain
        if noisy and found > LONGEST_RUN:
            raise BadRequest("seconds of a run with noise or physics", found,
                             f"at most {LONGEST_RUN:g}: a shorter time, a larger gain")
        return found

    def loop(self, sensed: Sense | None = None, smooth: bool = True) -> Loop:
        """The closed loop with what is sensed, smoothly or not."""
        steady = self.desired.duration if isinstance(self.desired, Trajectory) else 0.0
        return Loop(self.law, self.setting.everything.question, self.desired, steady, sensed, smooth)

    def sense(self, kind: str, amount: Amount | None, lens: Camera | None, horizon: float, seed: int) -> Sense:
        """What measures the directions, and how wrong."""
        if kind == EXACT and amount is not None:
            return Cones(amount.value, Shocks.drawn(len(self.directions), horizon, seed, amount.bias))
        mechanism, question = self.setting.mechanism, self.law.question
        rods = cylinders(mechanism, question.observations)
        eye = lens or placed(rods, question.reference, (self.start.pose, self.goal.pose))
        if kind == EDGES:
            edge = amount or Amount(0.0, pixels=True)
            shocks = Shocks.drawn(2 * len(rods), horizon, seed, edge.bias)
            return Edges(eye, question.reference, rods, edge.value, shocks)
        drawing()
        vision()
        return Pictures(Stage(mechanism, eye, question.reference, rods))

    def told(self, run: Run, sense: str, amount: Amount | None, simulated: Array | None = None) -> Servo:
        """What is told of a run; ``simulated`` is the displacement (4, 4) of the platform on the physics bench."""
        setting, motion = self.setting, self.setting.motion
        still, noisy = run, sense != EXACT or amount is not None
        if noisy or simulated is not None:
            still = Loop(self.law, setting.everything.question, Step(self.directions)).simulate(
                run.last, LASTS / self.law.gain)
        referee = Referee(self.goal, self.directions, motion.link, setting.anatomy.point, self.modes,
                          Examiner(setting).glance)
        ending = referee.judge(still, directions(still.last, self.law.question)[0])
        track = tracked(run.configurations, self.law.question, setting.everything.question, setting.dof)
        return Servo(setting, motion.pose(self.start.pose(motion.link)), motion.pose(self.goal.pose(motion.link)),
                     self.directions, self.law.gain, sense, amount, run, track, ending, still.last, self.goal,
                     self._spread(run, still.last) if noisy else None, tuple(self._notes(run, still, noisy, simulated)))

    def _notes(self, run: Run, still: Run, noisy: bool, simulated: Array | None) -> Iterator[str]:
        """What was measured on the benches."""
        if run.stopped == EFFORT:
            yield f"the run was broken off after {RUN_EVALUATIONS:,} configurations, at {run.times[-1]:.3g} s"
        if noisy:
            angles = np.degrees(np.array([np.arccos(np.clip(np.sum(each.directions * each.seen, axis=1), -1, 1))
                                          for each in run.commands]))
            rms = ", ".join(f"{value:.2g}" for value in np.sqrt(np.mean(angles**2, axis=0)))
            yield f"measured directions were wrong by {rms} degrees root mean square, at most {angles.max():.2g}"
        if simulated is not None:
            motion, X = self.setting.motion, simulated @ self.start.pose(self.setting.motion.link)
            there = still.last.pose(motion.link)
            apart = 1e3 * float(np.linalg.norm(motion.position(X) - motion.position(there)))
            yield f"the simulated platform stopped {apart:.2g} mm from there"

    def _spread(self, run: Run, settled: ClosedConfiguration) -> Spread:
        motion = self.setting.motion
        X = settled.pose(motion.link)
        late = [at.pose(motion.link) for time, at in zip(run.times, run.configurations, strict=True)
                if time >= SETTLED * run.times[-1]]
        moved = np.array([motion.position(each) for each in late]) - motion.position(X)
        lengths, middle = np.linalg.norm(moved, axis=1), moved.mean(axis=0)
        x, y, z = map(float, motion.position(X) + middle)
        turns = np.array([angle_of(each[:3, :3] @ X[:3, :3].T) if motion.body else 0.0
                          for each in late])
        return Spread(float(lengths.max()), float(turns.max()), float(np.sqrt(np.mean(lengths**2))),
                      float(np.sqrt(np.mean(turns**2))), (x, y, z), float(np.linalg.norm(middle)))


def _sees(setting: ObservedRobot) -> None:
    """Raise ``BadRequest`` where the observed legs do not see all of the platform's freedoms."""
    robot, name = setting.robot.name, ", ".join(setting.labels)
    verdict = verdict_of(setting, setting.labels, setting.samples)
    if verdict.lost:
        lost = "; ".join(freedom.name for freedom in verdict.lost)
        raise BadRequest(f"{robot}: the legs do not see {lost}", name,
                         "legs that make it controllable (hrsynth legs lists them)")
    if any(member.relation.RI for member in setting.samples.members):
        raise BadRequest(f"{robot}: observed links move while the platform rests, there is no interaction matrix", name,
                         "other legs")


def _regular(examiner: Examiner, name: str, at: ClosedConfiguration) -> None:
    """Raise ``BadRequest`` where a pose is singular."""
    posture = examiner.glance(at)
    robot, pose = examiner.setting.robot.name, str(posture.pose)
    if posture.hidden.state == UNDECIDED:
        raise RankUndecided(f"{robot} at the {name} {pose}", posture.hidden.gap, RANK_GAP)
    if posture.hidden.state != REGULAR:
        kind = {"type1": "a Type 1", "type2": "a Type 2", "type3": "a Type 3"}.get(posture.hidden.state, "a constraint")
        raise BadRequest(f"{robot}: the {name} is {kind} singularity", pose, "a regular pose")
