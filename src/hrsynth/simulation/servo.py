"""Simulated servo run: from one pose to the measured values of another, and its outcome (MMT 2.3, 5.1.3)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ..analysis.accuracy.accuracy import require_full_observation
from ..analysis.accuracy.measurement_bounds import IN_SIGHT
from ..analysis.analysis_declaration import analysis
from ..analysis.configuration_report import REGULAR, UNDECIDED, ConfigurationAnalysis
from ..analysis.observation_inputs import POINTS, CameraLike, LegsLike, Seed, SensorLike, StartPose
from ..analysis.observed import ObservedRobot, RobotLike
from ..analysis.pose_requests import solve_configurations
from ..errors import BadRequest, UndecidedRank
from ..geometry.so3 import compute_rotation_angle
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.limits import list_joints_beyond
from ..mechanism.noise import Noise
from ..mechanism.observation import Observation
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.observations.point import ImagePoint
from ..mechanism.pose import PoseLike, parse_pose
from ..options import option
from ..progress import report
from ..results import by_name
from ..tolerances import RANK_GAP_MIN, VISIBLE_SINE_MIN
from .camera import Camera, Edges, cylinders, place_camera
from .crossings import track_run
from .dynamics import DynamicSimulation
from .law import Depth, FixedDirections, Law, Sense, Trajectory, measure_all, straight, supposed_planes
from .noise import NoiseSamples, Sensors
from .outcome import OutcomeClassifier
from .rendered_images import LegRenderer, RenderedImages, drawing, vision
from .result import Scatter, Servo
from .run import AWAY, EFFORT, LIMIT, RUN_EVALUATIONS_MAX, UNMEASURED, UNSEEN, Loop, Run

RUN_DURATION_MAX_S = 10_000.0
"""Longest run (s) with noise, in dynamic simulation or along a path; these continue to their end."""

SERVO_GAIN_PER_S = 0.8
"""λ of MMT 5.1.1."""
LASTS, NOISY_LASTS = 60.0, 16.0
"""Duration of a run in time constants 1 / λ: longest one; that with noisy measurements."""
NOISY_RUN_SKIPPED_FRACTION = 0.5
"""Fraction of a noisy run after which its errors are counted."""
OVER = (LIMIT, UNSEEN, UNMEASURED, AWAY)
"""Reasons after which the loop without noise does not continue a run."""
EXACT, EDGES, IMAGES = "exact", "edges", "images"
ALLOWED_NOISE = {
    EXACT: "Give an angle, such as 0.1deg.",
    EDGES: "Give pixels, such as 0.3px.",
    IMAGES: "Omit it: the images have their own errors.",
}
"""Methods of measuring directions, and the noise that each takes."""
DIRECTIONS, ANGLES, PIXELS = ("directions", " degrees"), ("angles", " degrees"), ("image points", " px")
LENGTHS, VALUES = ("lengths", " mm"), ("values", "")
"""Quantities with measurement errors, and their units."""


@dataclass(frozen=True)
class Conditions:
    """Conditions of a servo run; :func:`format_run` takes each of these by its name. Raises ``BadRequest``."""

    gain: Annotated[float, option("λ of the control law (1/s).", high=1e6)] = SERVO_GAIN_PER_S
    """λ of the control law (1/s)."""
    sense: Annotated[
        str,
        option(
            "How directions are sensed: exact, edges (of the legs in a camera's image) or images (rendered).",
            "SENSE",
            words=("exact", "edges", "images"),
        ),
    ] = EXACT
    """Source of the measured values: ``exact`` (with ``noise``, directions in a cone about the true ones); for leg
    directions also ``edges`` (of the legs in a camera image, their ends wrong by ``noise``) or ``images`` (edges in
    rendered images)."""
    noise: Annotated[
        Noise | str | None, option("Measurement noise, such as 0.1deg, 0.3px (in images) or 1mm.", "AMOUNT")
    ] = None
    """Measurement errors: angles as ``0.1deg``, image points as ``0.3px``, lengths as ``1mm``; or several, as
    ``0.3px,1mm``."""
    bias: Annotated[bool, option("Keep the error of each measurement constant.")] = False
    """Keep the errors of ``noise`` constant."""
    lens: Camera | None = None
    """Camera of ``edges`` and ``images``, its pose in the link that carries it (default: one that sees all legs)."""
    dynamics: Annotated[bool, option("Drive a simulated MuJoCo model with rods, masses and velocity servos.")] = False
    """Simulate the robot's dynamics in MuJoCo."""
    depth: Depth = "exact"
    """Depth of image features that the law assumes: ``exact``, ``desired`` (that at the goal) or
    ``constant:0.5`` (m)."""
    duration: Annotated[
        float | None,
        option("Move the desired measurements along the straight line in this time (default: at once).", "SECONDS"),
    ] = None
    """Time (s) in which the desired values move along the straight path of poses; None: at once."""
    time: Annotated[float | None, option("Longest duration of the run.", "SECONDS")] = None
    """Longest duration (s)."""

    def __post_init__(self) -> None:
        noise = Noise.read(self.noise)
        if self.bias and noise is None:
            raise BadRequest("--bias: no noise is given", remedy="Give an amount, such as --noise 0.1deg.")
        if noise is not None:
            noise = replace(noise, bias=noise.bias or self.bias)
        object.__setattr__(self, "noise", noise)
        if self.sense not in ALLOWED_NOISE:
            raise BadRequest("--sense", self.sense, tuple(ALLOWED_NOISE))
        units = () if noise is None else tuple(unit for unit, _ in noise.amounts)
        if noise is not None and (self.sense == IMAGES or (self.sense == EDGES and units != ("px",))):
            raise BadRequest(
                f"--noise {noise}: not possible with --sense {self.sense}", remedy=ALLOWED_NOISE[self.sense]
            )
        for what, value in (("gain", self.gain), ("duration", self.duration)):
            if value is not None and not 0 < value < math.inf:
                raise BadRequest(f"--{what}", value, "a positive number")
        if self.duration is not None and self.duration > RUN_DURATION_MAX_S:
            raise BadRequest("--duration", self.duration, f"at most {RUN_DURATION_MAX_S:g} s")
        if self.time is not None and not 0 < self.time < math.inf:
            raise BadRequest("--time", self.time, "a positive number of seconds")
        if self.horizon > RUN_DURATION_MAX_S and (self.has_noise or self.dynamics):
            raise BadRequest(
                "duration in s of a run with noise or dynamics",
                self.horizon,
                f"at most {RUN_DURATION_MAX_S:g}",
                remedy="Choose a shorter --time or a larger --gain.",
            )

    @property
    def amount(self) -> Noise | None:
        """Parsed noise."""
        assert not isinstance(self.noise, str)
        return self.noise

    @property
    def has_noise(self) -> bool:
        """Return True if measurements have errors."""
        return self.sense != EXACT or self.noise is not None

    @property
    def horizon(self) -> float:
        """Longest duration of the run (s)."""
        lasts = NOISY_LASTS if self.has_noise or self.dynamics else LASTS
        return self.time or (self.duration or 0.0) + lasts / self.gain


@analysis(
    100,
    examples=(
        "quattro --observe 1,4 --start x=0.1 --goal x=-0.05 -o run.png",
        "delta --start x=0 --goal x=0.05 --noise 0.1deg --json",
        f"gough_stewart {POINTS} --start x=0.02 --goal x=0",
    ),
)
@by_name(Conditions, "conditions")
def servo(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    start: StartPose,
    goal: Annotated[PoseLike, option("Pose whose measured values are desired.", "POSE")],
    conditions: Conditions,
    seed: Seed = 0,
) -> Servo:
    """Simulate a run of the servo loop: its outcome, and the singularities that it crosses.

    Parameters
    ----------
    robot
        Robot, file or name.
    observe, camera, sensor
        Observations, as for ``derive``; each kind of observation has its own error.
    start
        Start pose (m, rad, in the base frame).
    goal
        Pose whose measured values are desired (m, rad, in the base frame).
    conditions
        Fields of :class:`Conditions`, given by name: ``gain``, ``sense``, ``noise``, ``bias``, ``lens``,
        ``dynamics``, ``depth``, ``duration``, ``time``.
    seed
        Seed of samples and noise.

    Returns
    -------
    Servo
        Run, outcome and crossings.

    Raises
    ------
    BadRequest
        Unknown name, a platform dof that is not observed, a singular pose, or a feature behind its camera.
    PoseReachFailure
        Start or goal is out of reach.
    MissingExtra
        An optional package is not installed.

    Notes
    -----
    The law is q̇ = −λ B (L U B)⁺ e, B a basis of the motions of the closed loops, U B the rates of the measured values
    (MMT 2.3.2, eqs. 9-12; docs/pages/proofs.md, section 11).

    Examples
    --------
    >>> hrsynth.servo("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=0", gain=0.8)
    <Servo: 3rrr_m1, observing 1, 2, 3: goal at x=0.02,y=0,z=0,phi=0deg>
    """
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed)
    if conditions.dynamics or conditions.sense != EXACT:
        setup.by_segments(f"servo with {'dynamics' if conditions.dynamics else f'sense {conditions.sense}'}")
    task = ServoTask.of(setup, start=start, goal=goal, conditions=conditions, seed=seed)
    report("run")
    return task.run()


@dataclass(frozen=True, eq=False)
class ServoTask:
    """Task of a servo run: start and goal configurations, control law, desired values."""

    setup: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    law: Law
    desired: FixedDirections | Trajectory
    conditions: Conditions = Conditions()
    seed: int = 0

    @classmethod
    def of(
        cls,
        setup: ObservedRobot,
        *,
        start: PoseLike,
        goal: PoseLike,
        conditions: Conditions = Conditions(),
        seed: int = 0,
    ) -> ServoTask:
        """Build the task of a request; raises what :func:`format_run` raises."""
        wanted = [parse_pose(each) for each in (start, goal)]
        setup = setup.printing_like(wanted)
        require_seen(setup)
        first, last = solve_configurations(setup, wanted)
        return cls.between(setup, first, last, conditions, seed)

    @classmethod
    def between(
        cls,
        setup: ObservedRobot,
        start: ClosedConfiguration,
        goal: ClosedConfiguration,
        conditions: Conditions = Conditions(),
        seed: int = 0,
    ) -> ServoTask:
        """Build the task between two configurations."""
        require_seen(setup)
        motion, ends = setup.motion, [start, goal]
        observation_model = setup.samples.observation_model
        law = Law(
            observation_model, setup.dof, conditions.gain, supposed_planes(conditions.depth, goal, observation_model)
        )
        for name, at in _name_ends(ends):
            require_sight(setup, law, name, at)
        desired: FixedDirections | Trajectory = FixedDirections(measure_all(ends[1], observation_model)[0])
        if conditions.duration is not None:
            goal_pose = motion.whole(ends[1].pose(motion.link))
            desired, ends[1] = straight(ends[0], motion, goal_pose, observation_model, conditions.duration)
        analysis = ConfigurationAnalysis.of(setup)
        for name, at in _name_ends(ends):
            require_regular(analysis, name, at)
        return cls(setup, ends[0], ends[1], law, desired, conditions, seed)

    @property
    def wanted(self) -> tuple[Array, ...]:
        """Values at the goal."""
        return measure_all(self.goal, self.law.observation_model)[0]

    @property
    def directions(self) -> Array:
        """Desired directions (k, 3), if all are directions."""
        return np.array(self.wanted)

    def run(self) -> Servo:
        """Simulate the run."""
        given = self.conditions
        sensed = self.sense() if given.has_noise else None
        loop = self.loop(sensed, smooth=not given.has_noise or (given.amount is not None and given.amount.bias))
        if not given.dynamics:
            return self.result(loop.simulate(self.start, given.horizon))
        return self.result(*DynamicSimulation.of(self.setup, self.start).run(loop, given.horizon))

    def loop(self, sensed: Sense | None = None, smooth: bool = True) -> Loop:
        """Return the closed loop with a sensor, whose errors are smooth or not."""
        return Loop(
            self.law,
            self.setup.all_samples.observation_model,
            self.desired,
            self.conditions.duration or 0.0,
            sensed,
            smooth,
        )

    def sense(self) -> Sense:
        """Return the sensor with its errors."""
        given, observation_model = self.conditions, self.law.observation_model
        noise = given.amount
        if given.sense == EXACT and noise is not None:
            return Sensors.of(observation_model.observations, noise, given.horizon, self.seed, self.goal.model.length)
        mechanism = self.setup.mechanism
        rods = cylinders(mechanism, observation_model.observations)
        eye = given.lens or place_camera(rods, observation_model.reference, (self.start.pose, self.goal.pose))
        if given.sense == EDGES:
            edge = noise or Noise(())
            shocks = NoiseSamples.draw(2 * len(rods), given.horizon, self.seed, edge.bias)
            return Edges(eye, observation_model.reference, rods, edge.of("px"), shocks)
        drawing()
        vision()
        return RenderedImages(LegRenderer(mechanism, eye, observation_model.reference, rods))

    def result(self, run: Run, simulated: Array | None = None) -> Servo:
        """Build the result of a run; ``simulated`` is the displacement (4, 4) of the platform in the dynamic
        simulation."""
        setup, motion, given = self.setup, self.setup.motion, self.conditions
        still = run
        over = run.stopped in OVER
        if (given.has_noise or simulated is not None) and not over:
            # the loop without noise and dynamics continues from here: its outcome is reported
            still = Loop(self.law, setup.all_samples.observation_model, FixedDirections(self.wanted)).simulate(
                run.last, LASTS / self.law.gain
            )
        classifier = OutcomeClassifier(setup, self.goal, self.wanted)
        ending = classifier.classify(still, measure_all(still.last, self.law.observation_model)[0])
        track = track_run(
            run.configurations, self.law.observation_model, setup.all_samples.observation_model, setup.dof
        )
        return Servo(
            setup,
            motion.pose(self.start.pose(motion.link)),
            motion.pose(self.goal.pose(motion.link)),
            self.wanted,
            self.law.gain,
            given.sense,
            given.amount,
            run,
            track,
            ending,
            given.depth,
            still.last,
            self.goal,
            self._scatter(run, still.last) if given.has_noise and not over else None,
            tuple(self._notes(run, still, simulated)),
        )

    def _notes(self, run: Run, still: Run, simulated: Array | None) -> Iterator[str]:
        """Yield notes on what the run ignores, and on what noise and dynamics changed."""
        model = self.goal.model
        for name, at in (("start", self.start), ("goal", self.goal)):
            if beyond := list_joints_beyond(model, at.q):
                yield f"the {name} is beyond the limits of {', '.join(beyond)}"
        if self.setup.segments and (motors := len(model.actuated_indices())) < self.setup.dof:
            count = f"{motors} motor{'s' * (motors != 1)} for {self.setup.dof} platform dof"
            yield f"{count}: too few for the commanded motion"
        if run.stopped == EFFORT:
            yield f"the run was stopped after {RUN_EVALUATIONS_MAX:,} configurations, at {run.times[-1]:.3g} s"
        if self.conditions.has_noise:
            yield from self._wrong(run)
        if simulated is not None:
            motion, X = self.setup.motion, simulated @ self.start.pose(self.setup.motion.link)
            there = still.last.pose(motion.link)
            apart = 1e3 * float(np.linalg.norm(motion.position(X) - motion.position(there)))
            yield f"the simulated platform stopped {apart:.2g} mm from this pose"

    def _wrong(self, run: Run) -> Iterator[str]:
        """Yield the errors of measured values, in units of the noise; of lines and circles their errors."""
        every, amount = self.setup.observed, self.conditions.amount
        units = [_unit(o, None if amount is None else dict(amount.amounts).keys()) for o in every]
        for kind in dict.fromkeys(unit for unit in units if unit is not None):
            chosen = [i for i, unit in enumerate(units) if unit == kind]
            off = np.array(
                [[_off(kind, every[i], each.seen[i], each.true[i]) for i in chosen] for each in run.commands]
            ) * (self.goal.model.length if kind == LENGTHS else 1.0)
            rms = ", ".join(f"{value:.2g}" for value in np.sqrt(np.mean(off**2, axis=0)))
            word, unit = kind
            yield f"errors of the measured {word}: {rms}{unit} root mean square, at most {off.max():.2g}{unit}"

    def _scatter(self, run: Run, settled: ClosedConfiguration) -> Scatter:
        motion = self.setup.motion
        X = settled.pose(motion.link)
        late = [
            at.pose(motion.link)
            for time, at in zip(run.times, run.configurations, strict=True)
            if time >= NOISY_RUN_SKIPPED_FRACTION * run.times[-1]
        ]
        moved = np.array([motion.position(each) for each in late]) - motion.position(X)
        lengths, middle = np.linalg.norm(moved, axis=1), moved.mean(axis=0)
        x, y, z = map(float, motion.position(X) + middle)
        turns = np.array([compute_rotation_angle(each[:3, :3] @ X[:3, :3].T) if motion.body else 0.0 for each in late])
        return Scatter(
            float(lengths.max()),
            float(turns.max()),
            float(np.sqrt(np.mean(lengths**2))),
            float(np.sqrt(np.mean(turns**2))),
            (x, y, z),
            float(np.linalg.norm(middle)),
        )


def require_seen(setup: ObservedRobot) -> None:
    """Raise ``BadRequest`` unless all platform dof are observed."""
    require_full_observation(setup, "")
    if any(member.relation.RI for member in setup.samples.members):
        raise BadRequest(
            f"{setup.robot.name}: observed links can move while the platform is fixed, so no interaction matrix exists",
            ", ".join(setup.labels),
            remedy="Observe other legs.",
        )


def _unit(seen: Observation, noise: Set[str] | None) -> tuple[str, str] | None:
    """Return the quantity and unit of an observation's measurement error; None if it is exact."""
    own = seen.found_by if noise is None else seen.found_by & noise
    if not own:
        return None
    if isinstance(seen, ImagePoint) and "px" in own:
        return PIXELS
    if isinstance(seen, SeenAxis):
        return DIRECTIONS
    if np.ndim(seen.dimension) == 0 and seen.dimension == 1:
        return LENGTHS
    return ANGLES if own == {"rad"} and seen.angular and seen.size in (1, 3) else VALUES


def _off(kind: tuple[str, str], seen: Observation, value: Array, true: Array) -> float:
    """Return the deviation of a measured value from the true one, lengths over a characteristic length."""
    if kind in (DIRECTIONS, ANGLES) and seen.size == 3:
        return math.degrees(np.arccos(np.clip(value @ true, -1, 1)))
    off = float(np.linalg.norm(seen.error(value, true)))
    if kind == PIXELS:
        assert isinstance(seen, ImagePoint)
        return off / seen.pixels({"px": 1.0})
    return {ANGLES: math.degrees(off), LENGTHS: 1e3 * off}.get(kind, off)


def _name_ends(ends: Sequence[ClosedConfiguration]) -> list[tuple[str, ClosedConfiguration]]:
    """Return the start and the goal with their names; the goal alone if both are one."""
    return list(zip(("start", "goal"), ends, strict=True))[ends[0] is ends[1] :]


def require_sight(setup: ObservedRobot, law: Law, name: str, at: ClosedConfiguration) -> None:
    """Raise ``BadRequest`` if an observed feature is behind its camera, or outside of its image."""
    for seen in setup.observed:
        X = at.pose(seen.seen_from or law.observation_model.reference)
        if seen.in_front(X, at.pose(seen.link)) < VISIBLE_SINE_MIN:
            pose = setup.motion.pose(at.pose(setup.motion.link))
            raise BadRequest(
                f"{setup.robot.name}: {seen.text} is not in front of its camera at the {name}",
                str(pose),
                remedy=IN_SIGHT,
            )


def require_regular(analysis: ConfigurationAnalysis, name: str, at: ClosedConfiguration) -> None:
    """Raise ``BadRequest`` if a pose is singular."""
    posture = analysis.classify(at)
    robot, pose = analysis.setup.robot.name, str(posture.pose)
    if posture.hidden.state == UNDECIDED:
        raise UndecidedRank(f"{robot} at the {name} {pose}", posture.hidden.gap, RANK_GAP_MIN, "Choose another pose.")
    if posture.hidden.state != REGULAR:
        kind = {"type1": "a Type 1", "type2": "a Type 2", "type3": "a Type 3"}.get(posture.hidden.state, "a constraint")
        raise BadRequest(f"{robot}: the {name} is {kind} singularity", pose, remedy="Choose a regular pose.")
