"""The simulated servo run: from one pose towards the directions of another, and where it ended (MMT 2.3, 5.1.3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.controllability import verdict_of
from ..analysis.posture import REGULAR, UNDECIDED, Examiner
from ..analysis.setting import Setting, prepare, silent
from ..errors import BadRequest, PoseNotReached, RankUndecided
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.parts import rotation_vector
from ..kinematics.reach import reach
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from ..mechanism.vectors import Array
from ..tolerances import RANK_GAP
from .bench import Bench
from .camera import Camera, Edges, cylinders, placed
from .desired import Step, Trajectory, straight, whole
from .ending import Ending, Referee
from .law import Law, Sense, directions
from .noise import Amount, Cones, Shocks
from .pictures import Pictures, Stage, vision
from .run import Loop, Run
from .track import Track, tracked

if TYPE_CHECKING:
    from ..analysis.modes.modes import AssemblyModes

GAIN = 0.8
"""λ of MMT 5.1.1."""
LASTS, NOISY_LASTS = 60.0, 16.0
"""Time constants 1 / λ that a run may take; that it takes where measurements are noisy."""
SETTLED = 0.5
"""Part of a noisy run after which its errors are counted."""
EXACT, EDGES, PICTURES = "exact", "edges", "pictures"
SENSES = (EXACT, EDGES, PICTURES)


@dataclass(frozen=True)
class Spread:
    """How far the platform was from the pose at which it settled, over the second half of a noisy run: metres and radians,
    largest and root mean square."""

    metres: float
    radians: float
    rms_metres: float
    rms_radians: float

    def to_dict(self) -> dict[str, float]:
        """The record of the command line."""
        return {"position_mm": 1e3 * self.metres, "orientation_deg": math.degrees(self.radians),
                "rms_position_mm": 1e3 * self.rms_metres, "rms_orientation_deg": math.degrees(self.rms_radians)}


@dataclass(frozen=True, eq=False)
class Servo:
    """A servo run: what was asked, the run, its ending, what it passed.

    With noise the ending is that of the same loop without noise, run on from where the noisy one stopped; ``spread`` is
    how far the noisy one kept from there.
    """

    setting: Setting
    start: Pose
    goal: Pose
    desired: Array
    gain: float
    sense: str
    noise: Amount | None
    run: Run
    track: Track
    ending: Ending
    settled: ClosedConfiguration
    target: ClosedConfiguration
    """The goal's configuration."""
    spread: Spread | None = None
    notes: tuple[str, ...] = ()
    """What a bench measured, in words."""

    @property
    def ended(self) -> str:
        """Where it ended: one of ``ending.ENDINGS``."""
        return self.ending.name

    @property
    def pose(self) -> Pose:
        """The pose at which it ended."""
        return self.pose_of(self.settled)

    def pose_of(self, at: ClosedConfiguration) -> Pose:
        """The platform's pose at a configuration."""
        motion = self.setting.motion
        return motion.pose(at.pose(motion.link))

    @property
    def errors(self) -> Array:
        """‖e_i‖ of the true errors, (n, k)."""
        return np.array([np.linalg.norm(command.error, axis=1) for command in self.run.commands])

    @property
    def way(self) -> Array:
        """The platform's position, that of its point, along the run, (n, 3)."""
        motion = self.setting.motion
        return np.array([motion.position(at.pose(motion.link)) for at in self.run.configurations])

    @property
    def turns(self) -> Array:
        """How far the platform is turned away from the goal along the run (rad), (n,); of a point body zero."""
        return np.array([self._turn(at) for at in self.run.configurations])

    @property
    def goal_position(self) -> Array:
        """The position of the platform's point at the goal, (3,)."""
        motion = self.setting.motion
        return motion.position(self.target.pose(motion.link))

    @property
    def from_goal(self) -> tuple[float, float]:
        """How far the pose at which it ended is from the goal: metres, radians."""
        motion = self.setting.motion
        moved = motion.position(self.settled.pose(motion.link)) - self.goal_position
        return float(np.linalg.norm(moved)), self._turn(self.settled)

    def _turn(self, at: ClosedConfiguration) -> float:
        motion = self.setting.motion
        R = at.pose(motion.link)[:3, :3] @ self.target.pose(motion.link)[:3, :3].T
        return float(np.linalg.norm(rotation_vector(R))) if motion.body else 0.0

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        found = self.ending
        return {**self.setting.to_dict(), "from": self.start.to_dict(), "to": self.goal.to_dict(), "gain": self.gain,
                "sense": self.sense, "noise": None if self.noise is None else str(self.noise),
                "ended": self.ended, "reason": found.reason, "pose": self.pose.to_dict(), "matched_mode": found.matched,
                "modes": None if found.modes is None else [each.to_dict() for each in found.modes.modes],
                "type2": self.track.to_dict(self.run.times.tolist()),
                "notes": list(self.notes), "spread": None if self.spread is None else self.spread.to_dict(),
                "times": self.run.times.tolist(), "error": self.errors.tolist(),
                "poses": [self.pose_of(at).to_dict() for at in self.run.configurations]}


def servo(robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
          start: Pose | str, goal: Pose | str, gain: float = GAIN, noise: Amount | str | None = None,
          physics: bool = False, sense: str = EXACT, lens: Camera | None = None, duration: float | None = None,
          time: float | None = None, seed: int = 0, progress: Callable[[str], None] | None = None) -> Servo:
    """The servo loop of MMT 2.3 from the pose ``start`` towards the directions at ``goal``.

    Without dynamics, or with ``physics`` on a mock-up in MuJoCo. ``sense`` is how the directions are measured: ``exact`` (or
    with ``noise`` such as ``0.1deg`` in a cone about the true ones), ``edges`` (from the edges of the legs before a camera, their
    ends wrong by ``noise`` such as ``0.3px``) or ``pictures`` (from rendered ones); ``lens`` is that camera, its pose in the
    link that carries it (default: where it sees all legs well). ``duration`` leads the desired directions along the
    straight way of poses in so many seconds instead of at once, ``time`` (s) bounds the run. ``observe`` and ``camera`` as
    for ``derive``.

    Raises ``BadRequest`` for names that there are not, legs that do not see the platform, singular poses;
    ``PoseNotReached`` (exit status 2) for poses out of reach; ``MissingExtra``.
    """
    amount = Amount.parse(noise) if isinstance(noise, str) else noise
    _fits(sense, amount)
    tell = progress or silent
    tell("sampling")
    scene = Scene.of(robot, observe, camera, start=start, goal=goal, gain=gain, duration=duration, seed=seed)
    noisy = sense != EXACT or amount is not None
    horizon = scene.horizon(time, noisy=noisy or physics)
    loop = scene.loop(scene.sense(sense, amount, lens, horizon, seed) if noisy else None)
    tell("run")
    if not physics:
        return scene.told(loop.simulate(scene.start, horizon), sense, amount)
    run, moved = Bench.of(scene.setting, scene.start).run(loop, horizon)
    return scene.told(run, sense, amount, moved)


def _fits(sense: str, amount: Amount | None) -> None:
    """Raise ``BadRequest`` where there is no such sense, or the noise is not its own."""
    if sense not in SENSES:
        raise BadRequest("sense", sense, SENSES)
    if amount is not None and (sense == PICTURES or amount.pixels != (sense == EDGES)):
        allowed = {EXACT: "an angle, such as 0.1deg", EDGES: "pixels, such as 0.3px",
                   PICTURES: "none: the pictures have their own"}
        raise BadRequest(f"noise with sense {sense}", str(amount), allowed[sense])


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot that is about to be servoed: its start and goal configurations and poses, its law, what is desired."""

    setting: Setting
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
            from ..analysis.modes.modes import modes

            return modes(robot, observe, camera, at=motion.pose(ends[1].pose(motion.link)), seed=seed)

        return cls(setting, *ends, law, desired, listed)

    @property
    def directions(self) -> Array:
        """The directions (k, 3) of the goal."""
        return directions(self.goal, self.law.question)[0]

    def horizon(self, time: float | None, noisy: bool) -> float:
        """How long a run may take (s)."""
        if time is not None:
            if not 0 < time < math.inf:
                raise BadRequest("time", time, "a positive number of seconds")
            return time
        steady = self.desired.duration if isinstance(self.desired, Trajectory) else 0.0
        return steady + (NOISY_LASTS if noisy else LASTS) / self.law.gain

    def loop(self, sensed: Sense | None = None) -> Loop:
        """The closed loop with what is sensed."""
        steady = self.desired.duration if isinstance(self.desired, Trajectory) else 0.0
        return Loop(self.law, self.setting.everything.question, self.desired, steady, sensed)

    def sense(self, kind: str, amount: Amount | None, lens: Camera | None, horizon: float, seed: int) -> Sense:
        """What measures the directions, and how wrong."""
        if kind == EXACT and amount is not None:
            return Cones(amount.value, Shocks.drawn(len(self.directions), horizon, seed))
        mechanism, question = self.setting.mechanism, self.law.question
        rods = cylinders(mechanism, question.observations)
        eye = lens or placed(rods, question.reference, (self.start.pose, self.goal.pose))
        if kind == EDGES:
            shocks = Shocks.drawn(2 * len(rods), horizon, seed)
            return Edges(eye, question.reference, rods, 0.0 if amount is None else amount.value, shocks)
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
        lengths = np.array([np.linalg.norm(motion.position(each) - motion.position(X)) for each in late])
        turns = np.array([np.linalg.norm(rotation_vector(each[:3, :3] @ X[:3, :3].T)) if motion.body else 0.0
                          for each in late])
        return Spread(float(lengths.max()), float(turns.max()), float(np.sqrt(np.mean(lengths**2))),
                      float(np.sqrt(np.mean(turns**2))))


def _sees(setting: Setting) -> None:
    """Raise ``BadRequest`` where the observed legs do not see all of the platform's freedoms."""
    robot, name = setting.robot.name, ", ".join(setting.labels)
    verdict = verdict_of(setting, setting.labels, setting.samples)
    if verdict.lost:
        lost = "; ".join(freedom.name for freedom in verdict.lost)
        raise BadRequest(f"{robot}: the legs do not see {lost}", name,
                         "legs that make it controllable (hrsynth legs lists them)")
    if any(member.relation.unexplained for member in setting.samples.members):
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
