"""The simulated servo run: from one pose towards the directions of another, and where it ended (MMT 2.3, 5.1.3)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.asked import configurations_at
from ..analysis.observed import CameraLike, LegsLike, ObservedRobot, RobotLike
from ..analysis.posture import REGULAR, UNDECIDED, ConfigurationAnalysis
from ..analysis.question import question
from ..analysis.verdict import verdict_of
from ..budgets import LONGEST_RUN, RUN_EVALUATIONS
from ..errors import BadRequest, RankUndecided
from ..geometry.so3 import angle_of
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.pose import PoseLike, asked_pose
from ..progress import tell
from ..results import by_name
from ..tolerances import RANK_GAP
from .bench import Bench
from .camera import Camera, Edges, cylinders, placed
from .ending import EndingClassifier
from .law import FixedDirections, Law, Sense, Trajectory, directions, straight, whole
from .noise import Cones, Noise, Shocks
from .pictures import LegRenderer, Pictures, drawing, vision
from .result import Scatter, Servo
from .run import EFFORT, Loop, Run
from .track import tracked

GAIN = 0.8
"""λ of MMT 5.1.1."""
LASTS, NOISY_LASTS = 60.0, 16.0
"""Time constants 1 / λ that a run may take; that it takes where measurements are noisy."""
SETTLED = 0.5
"""Part of a noisy run after which its errors are counted."""
EXACT, EDGES, PICTURES = "exact", "edges", "pictures"
ALLOWED_NOISE = {EXACT: "an angle, such as 0.1deg", EDGES: "pixels, such as 0.3px",
                 PICTURES: "none: the pictures have their own"}
"""How directions are measured, and the noise of each."""


@dataclass(frozen=True)
class Conditions:
    """How a robot is servoed; :func:`servo` takes each of these by its name. Raises ``BadRequest``."""

    gain: float = GAIN
    """λ of the control law (1/s)."""
    sense: str = EXACT
    """How the directions are measured: ``exact`` (or with ``noise`` in a cone about the true ones), ``edges`` (from the
    edges of the legs before a camera, their ends wrong by ``noise``) or ``pictures`` (from rendered ones)."""
    noise: Noise | str | None = None
    """How wrong they are, as ``0.1deg``, of edges as ``0.3px``."""
    bias: bool = False
    """Whether the errors of ``noise`` stay as they are at first."""
    lens: Camera | None = None
    """The camera of ``edges`` and ``pictures``, its pose in the link that carries it (default: where it sees all legs
    well)."""
    physics: bool = False
    """Whether a mock-up in MuJoCo is driven, with dynamics."""
    duration: float | None = None
    """Leads the desired directions along the straight way of poses in so many seconds instead of at once."""
    time: float | None = None
    """Longest run (s)."""

    def __post_init__(self) -> None:
        noise = Noise.parse(self.noise) if isinstance(self.noise, str) else self.noise
        if self.bias and noise is None:
            raise BadRequest("a bias without noise", "none", "an amount of noise, such as 0.1deg")
        if noise is not None:
            noise = replace(noise, bias=noise.bias or self.bias)
        object.__setattr__(self, "noise", noise)
        if self.sense not in ALLOWED_NOISE:
            raise BadRequest("sense", self.sense, tuple(ALLOWED_NOISE))
        if noise is not None and (self.sense == PICTURES or noise.pixels != (self.sense == EDGES)):
            raise BadRequest(f"noise with sense {self.sense}", str(noise), ALLOWED_NOISE[self.sense])
        for what, value in (("gain", self.gain), ("duration", self.duration)):
            if value is not None and not 0 < value < math.inf:
                raise BadRequest(what, value, "a positive number")
        if self.duration is not None and self.duration > LONGEST_RUN:
            raise BadRequest("duration", self.duration, f"at most {LONGEST_RUN:g} seconds")
        if self.time is not None and not 0 < self.time < math.inf:
            raise BadRequest("time", self.time, "a positive number of seconds")
        if self.horizon > LONGEST_RUN and (self.noisy or self.physics):
            raise BadRequest("seconds of a run with noise or physics", self.horizon,
                             f"at most {LONGEST_RUN:g}: a shorter time, a larger gain")

    @property
    def amount(self) -> Noise | None:
        """The noise, read."""
        assert not isinstance(self.noise, str)
        return self.noise

    @property
    def noisy(self) -> bool:
        """Whether measured directions are wrong."""
        return self.sense != EXACT or self.noise is not None

    @property
    def horizon(self) -> float:
        """How long a run may take (s)."""
        lasts = NOISY_LASTS if self.noisy or self.physics else LASTS
        return self.time or (self.duration or 0.0) + lasts / self.gain


@question()
@by_name(Conditions, "conditions")
def servo(robot: RobotLike, observe: LegsLike = None, camera: CameraLike = None, *,
          start: PoseLike, goal: PoseLike, conditions: Conditions, seed: int = 0) -> Servo:
    """The servo loop of MMT 2.3 from the pose ``start`` towards the directions at ``goal``.

    ``observe`` and ``camera`` as for ``derive``. The fields of :class:`Conditions` can be given by their names:
    ``gain``, ``sense``, ``noise``, ``bias``, ``lens``, ``physics``, ``duration``, ``time``.

    Raises ``BadRequest`` for names that there are not, legs that do not see the platform, singular poses;
    ``PoseNotReached`` for poses out of reach; ``MissingExtra``.

    >>> hrsynth.servo("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=0", gain=0.8)
    <Servo: 3rrr_m1, watching 1, 2, 3: ended at x=0.02,y=0,z=0,phi=0, goal>
    """
    setting = ObservedRobot.of(robot, observe, camera, seed=seed).by_segments("servo")
    task = ServoTask.of(setting, start=start, goal=goal, conditions=conditions, seed=seed)
    tell("run")
    return task.run()


@dataclass(frozen=True, eq=False)
class ServoTask:
    """A robot that is about to be servoed: its start and goal configurations, its law, what is desired."""

    setting: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    law: Law
    desired: FixedDirections | Trajectory
    conditions: Conditions = Conditions()
    seed: int = 0

    @classmethod
    def of(cls, setting: ObservedRobot, *, start: PoseLike, goal: PoseLike, conditions: Conditions = Conditions(),
           seed: int = 0) -> ServoTask:
        """The task of a request; raises what :func:`servo` raises."""
        wanted = [asked_pose(each) for each in (start, goal)]
        setting = setting.telling(wanted)
        require_seen(setting)
        first, last = configurations_at(setting, wanted)
        return cls.between(setting, first, last, conditions, seed)

    @classmethod
    def between(cls, setting: ObservedRobot, start: ClosedConfiguration, goal: ClosedConfiguration,
                conditions: Conditions = Conditions(), seed: int = 0) -> ServoTask:
        """The same between two configurations."""
        require_seen(setting)
        motion, ends = setting.motion, [start, goal]
        law = Law(setting.samples.question, setting.dof, conditions.gain)
        desired: FixedDirections | Trajectory = FixedDirections(directions(ends[1], law.question)[0])
        if conditions.duration is not None:
            goal_pose = whole(motion, ends[1].pose(motion.link))
            desired, ends[1] = straight(ends[0], motion, goal_pose, law.question, conditions.duration)
        analysis = ConfigurationAnalysis.of(setting)
        for name, at in zip(("start", "goal"), ends, strict=True):
            require_regular(analysis, name, at)
        return cls(setting, ends[0], ends[1], law, desired, conditions, seed)

    @property
    def directions(self) -> Array:
        """The directions (k, 3) of the goal."""
        return directions(self.goal, self.law.question)[0]

    def run(self) -> Servo:
        """What comes of it."""
        given = self.conditions
        sensed = self.sense() if given.noisy else None
        loop = self.loop(sensed, smooth=not given.noisy or (given.amount is not None and given.amount.bias))
        if not given.physics:
            return self.result(loop.simulate(self.start, given.horizon))
        return self.result(*Bench.of(self.setting, self.start).run(loop, given.horizon))

    def loop(self, sensed: Sense | None = None, smooth: bool = True) -> Loop:
        """The closed loop with what is sensed, smoothly or not."""
        return Loop(self.law, self.setting.everything.question, self.desired, self.conditions.duration or 0.0, sensed,
                    smooth)

    def sense(self) -> Sense:
        """What measures the directions, and how wrong."""
        given, question = self.conditions, self.law.question
        noise = given.amount
        if given.sense == EXACT and noise is not None:
            return Cones(noise.value, Shocks.drawn(len(self.directions), given.horizon, self.seed, noise.bias))
        mechanism = self.setting.mechanism
        rods = cylinders(mechanism, question.observations)
        eye = given.lens or placed(rods, question.reference, (self.start.pose, self.goal.pose))
        if given.sense == EDGES:
            edge = noise or Noise(0.0, pixels=True)
            shocks = Shocks.drawn(2 * len(rods), given.horizon, self.seed, edge.bias)
            return Edges(eye, question.reference, rods, edge.value, shocks)
        drawing()
        vision()
        return Pictures(LegRenderer(mechanism, eye, question.reference, rods))

    def result(self, run: Run, simulated: Array | None = None) -> Servo:
        """What came of a run; ``simulated`` is the displacement (4, 4) of the platform on the physics bench."""
        setting, motion, given = self.setting, self.setting.motion, self.conditions
        still = run
        if given.noisy or simulated is not None:
            # where the loop without noise and dynamics goes on to: its ending is the one that is told
            still = Loop(self.law, setting.everything.question, FixedDirections(self.directions)).simulate(
                run.last, LASTS / self.law.gain)
        classifier = EndingClassifier(setting, self.goal, self.directions)
        ending = classifier.classify(still, directions(still.last, self.law.question)[0])
        track = tracked(run.configurations, self.law.question, setting.everything.question, setting.dof)
        return Servo(setting, motion.pose(self.start.pose(motion.link)), motion.pose(self.goal.pose(motion.link)),
                     self.directions, self.law.gain, given.sense, given.amount, run, track, ending, still.last,
                     self.goal, self._scatter(run, still.last) if given.noisy else None,
                     tuple(self._notes(run, still, simulated)))

    def _notes(self, run: Run, still: Run, simulated: Array | None) -> Iterator[str]:
        """What was measured on the benches."""
        if run.stopped == EFFORT:
            yield f"the run was stopped after {RUN_EVALUATIONS:,} configurations, at {run.times[-1]:.3g} s"
        if self.conditions.noisy:
            angles = np.degrees(np.array([np.arccos(np.clip(np.sum(each.directions * each.seen, axis=1), -1, 1))
                                          for each in run.commands]))
            rms = ", ".join(f"{value:.2g}" for value in np.sqrt(np.mean(angles**2, axis=0)))
            yield f"measured directions were wrong by {rms} degrees root mean square, at most {angles.max():.2g}"
        if simulated is not None:
            motion, X = self.setting.motion, simulated @ self.start.pose(self.setting.motion.link)
            there = still.last.pose(motion.link)
            apart = 1e3 * float(np.linalg.norm(motion.position(X) - motion.position(there)))
            yield f"the simulated platform stopped {apart:.2g} mm from there"

    def _scatter(self, run: Run, settled: ClosedConfiguration) -> Scatter:
        motion = self.setting.motion
        X = settled.pose(motion.link)
        late = [at.pose(motion.link) for time, at in zip(run.times, run.configurations, strict=True)
                if time >= SETTLED * run.times[-1]]
        moved = np.array([motion.position(each) for each in late]) - motion.position(X)
        lengths, middle = np.linalg.norm(moved, axis=1), moved.mean(axis=0)
        x, y, z = map(float, motion.position(X) + middle)
        turns = np.array([angle_of(each[:3, :3] @ X[:3, :3].T) if motion.body else 0.0
                          for each in late])
        return Scatter(float(lengths.max()), float(turns.max()), float(np.sqrt(np.mean(lengths**2))),
                       float(np.sqrt(np.mean(turns**2))), (x, y, z), float(np.linalg.norm(middle)))


def require_seen(setting: ObservedRobot) -> None:
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


def require_regular(analysis: ConfigurationAnalysis, name: str, at: ClosedConfiguration) -> None:
    """Raise ``BadRequest`` where a pose is singular."""
    posture = analysis.classify(at)
    robot, pose = analysis.setting.robot.name, str(posture.pose)
    if posture.hidden.state == UNDECIDED:
        raise RankUndecided(f"{robot} at the {name} {pose}", posture.hidden.gap, RANK_GAP)
    if posture.hidden.state != REGULAR:
        kind = {"type1": "a Type 1", "type2": "a Type 2", "type3": "a Type 3"}.get(posture.hidden.state, "a constraint")
        raise BadRequest(f"{robot}: the {name} is {kind} singularity", pose, "a regular pose")
