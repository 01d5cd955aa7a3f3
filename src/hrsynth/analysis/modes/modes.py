"""Assembly modes of a hidden robot, or of the real one: every pose of the platform with the same measured values."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...batch.pose_continuation import track_to_pose
from ...constraints.pattern import list_placing_links
from ...equations.natural_view import SLIDE_REACH_MAX
from ...errors import BadRequest, ExternalSolverFailure, MissingExtra, PoseReachFailure, TooLarge, UnsupportedLocus
from ...kinematics.assembly import Assembly, build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.goal_error import drift
from ...kinematics.limits import list_joints_beyond
from ...kinematics.self_motions import SelfMotion, self_motion
from ...kinematics.tasks import Task
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism.legs import LegDecomposition
from ...mechanism.notation import Rods
from ...mechanism.observation import Observation
from ...mechanism.pose import JointPose, ModeNumber, Pose, PoseLike, parse_pose
from ...options import option
from ...progress import report
from ...records import FLAT, OPTIONAL, As, Shown, recorded
from ...results import Result
from ...solving.platform.solve import SystemModes, make_family
from ...tolerances import MEASUREMENT_BOUND, NEAR_POSE_DIFFERENCE_TOL
from ..analysis_declaration import analysis
from ..branch.joint_line import follow_line
from ..formation import Formation
from ..loci.tips import TipLoci
from ..measured import MeasuredRobot
from ..observation_inputs import POINTS, CameraLike, LegsLike, Seed, SensorLike
from ..observed import ObservedRobot, RobotLike
from ..setup_records import LIMITS_IGNORED
from .assembly_mode import AssemblyMode, ModeReader, build_mode
from .condition_modes import PosedPlatform, solve_posed
from .formation_modes import list_formation_modes
from .mode_search import FoundMode, has_unobserved_motion, search
from .natural_modes import NaturalPlatform, prove_existence, solve_natural
from .near_modes import NearMode, describe_poses_alike, find_near_modes, parse_measurement_bound
from .tip_modes import drop_couplings, may_count_more, solve_tips
from .tip_systems import MODES_TIME_LIMIT_S, Model

WITHIN = {
    "formation": "configurations up to trivial motions",
    "translations": "poses with the rotation of this one",
    "bodies": "poses whose links have the rotations of this one",
    "planar": "poses in the plane of motion",
    "spatial": "poses in space",
    "oriented": "poses in space",
    "kept": "poses at which links keep the directions that they keep in this operation mode",
}
"""Poses among which the modes are listed, for each kind of the platform's motion."""


class BodyPlace(NamedTuple):
    """Pose of a link of a formation."""

    link: str
    pose: Pose


class ListedMode(NamedTuple):
    """An assembly mode."""

    mode: Annotated[AssemblyMode, FLAT]
    places: Annotated[
        list[BodyPlace] | None,
        list[BodyPlace],
        OPTIONAL,
        "of a formation: all links, moved by a trivial motion to where they are nearest to the file's",
    ]


class FollowedMotion(NamedTuple):
    """Self-motion: measured values are constant along it, as far as it was followed from a pose."""

    pose: Pose
    motion: Annotated[SelfMotion, FLAT]


class TriedWay(NamedTuple):
    """A way to list the modes that was tried, and what came of it."""

    way: Annotated[str, "loci of tips, conditions on the pose, natural coordinates, or random starts"]
    outcome: Annotated[str, "what this way gave, or why it gave nothing"]


class MeantLegs(NamedTuple):
    """Legs whose joint centres are snapped to one point."""

    where: str
    legs: list[str]
    defect_m: float


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyModes(Result, shown_as="modes"):
    """Assembly modes with the measured values of one pose, the goal.

    Parameters
    ----------
    setup
        Robot with its observations.
    kind
        ``hidden``, ``real`` (motors fixed) or ``formation``.
    goal, pose
        Configuration and pose at which the values were measured.
    found
        Count of complex solutions, completeness and proof, as of :class:`SystemModes`.
    modes
        Assembly modes that are not on a self-motion.
    near_modes
        Poses within the measurement bound: found, not proved.
    self_motions
        Continuous families of modes, as far as they were followed.
    ways
        Ways to list the modes, in the order in which they were tried: the last one that gives a list is used.
    antipodal
        Solutions with the opposite value of an observation.
    """

    setup: ObservedRobot
    kind: Annotated[str, Literal["hidden", "real", "formation"]]
    goal: ClosedConfiguration
    pose: Pose
    found: SystemModes
    modes: tuple[AssemblyMode, ...]
    candidates: tuple[AssemblyMode, ...] = ()
    """Starts of the search for near modes; none in a result."""
    near_modes: Annotated[tuple[NearMode, ...], As("near_modes"), "found, not proved to be all"] = ()
    """Other poses whose measured values differ by no more than ``bound`` (rad)."""
    measurement_bound: Annotated[float, As("measurement_bound"), "error (rad) up to which near modes are sought"] = 0.0
    model: Model | None = None
    self_motions: tuple[SelfMotion, ...] = ()
    ways: Annotated[tuple[TriedWay, ...], As("ways"), "ways to list the modes, in the order tried"] = ()
    antipodal: tuple[AssemblyMode, ...] = ()
    """Solutions of the same equations with the opposite value of an observation."""
    formation: Annotated[Formation | None, Formation, OPTIONAL] = None
    """Unobserved motions of a formation at the goal."""

    @property
    def confined(self) -> TipLoci | None:
        """Loci of the tips; None if the measured values never determine the pose, or if the loci are not known."""
        return None if self.model is None else self.model.confined

    @property
    @recorded()
    def within(self) -> str | None:
        """Poses among which these modes are all."""
        if self.formation is not None:
            return WITHIN["formation"]
        if self.model is None:
            return None
        system = self.model.system
        if isinstance(system, NaturalPlatform):
            reach = f", within {SLIDE_REACH_MAX:g} characteristic lengths" * system.is_reach_assumed
            return WITHIN[system.motion] + reach
        motion = self.confined.motion if self.confined is not None else "spatial"
        within = WITHIN[system.poses.motion if isinstance(system, PosedPlatform) else motion]
        return within + ", parallelograms not crossed" * _has_inner_parallelogram(self.setup.decomposition)

    @property
    def labels(self) -> tuple[str, ...]:
        """Legs whose ends are confined."""
        return () if self.confined is None else tuple(tip.leg for tip in self.confined.tips)

    def headline(self) -> str:
        """Return the robot and the number of modes."""
        if self.formation is not None:
            return f"{self.setup.headline()}: {self.count} (formation)"
        said = (
            f"{self.count} ({self.kind} robot)"
            if not self.near_modes
            else (f"{self.alike} ({self.count}, {self.kind} robot)")
        )
        return f"{self.setup.headline()}: {said} at {self.pose}"

    @property
    def alike(self) -> str:
        """Number of poses that a measurement with an error does not distinguish, as text."""
        return describe_poses_alike(self.modes, self.near_modes)

    @property
    def count(self) -> str:
        """Number of modes, as text."""
        if self.found.continuous_family is not None and (self.found.complex is not None or self.formation is not None):
            return "a continuous family"
        if self.self_motions:
            count = len(self.self_motions)
            return (
                f"{count} self-motion{'s' * (count > 1)}, and {len(self.modes)} real that "
                f"{'lies' if len(self.modes) == 1 else 'lie'} on none"
            )
        antipodal = f" and {len(self.antipodal)} antipodal" if self.antipodal else ""
        return f"{len(self.modes)} real{antipodal}" + (
            "" if self.found.complex is None else f" of {self.found.complex} complex"
        )

    def pose_of(self, motion: SelfMotion) -> Pose:
        """Return a pose on a self-motion, from which it was followed."""
        return self.setup.motion.pose(motion.configuration.pose(self.setup.motion.link))

    at = Shown(Pose, lambda self: self.pose)
    observed = Shown(tuple[Observation, ...], lambda self: self.setup.observed)
    complex = Shown(int | None, lambda self: None if self.found.continuous_family else self.found.complex)
    complete = Shown(bool, lambda self: self.found.complete)
    bound_record = Shown(str, lambda self: self.found.bound, As("bound"))
    proof = Shown(str, lambda self: self.found.proof)
    modes_record = Shown(list[ListedMode], lambda self: self._listed(self.modes), As("modes"))
    antipodal_record = Shown(list[ListedMode], lambda self: self._listed(self.antipodal), As("antipodal"))
    singular_solutions = Shown(str | None, lambda self: self.found.singular_solutions)
    continuous_family = Shown(int | None, lambda self: self.found.continuous_family)
    motions_record = Shown(
        list[FollowedMotion],
        lambda self: [FollowedMotion(self.pose_of(motion), motion) for motion in self.self_motions],
        As("self_motions"),
    )
    snapped = Shown(
        list[MeantLegs],
        lambda self: [
            MeantLegs(snapped.where, [self.labels[k] for k in snapped.legs], snapped.defect)
            for snapped in self.found.snapped
        ],
    )
    limits_ignored = LIMITS_IGNORED

    def _listed(self, modes: Iterable[AssemblyMode]) -> list[ListedMode]:
        """Return modes with the poses of all links of a formation."""
        return [
            ListedMode(
                mode,
                None
                if self.formation is None or not mode.bodies
                else [BodyPlace(link, Pose.of(X)) for link, X in mode.bodies.items()],
            )
            for mode in modes
        ]


def _has_inner_parallelogram(decomposition: LegDecomposition) -> bool:
    """Return True if a leg has a loop before its end: crossed, it can leave the platform's rotation as it is. A pair of
    rods that ends on the platform cannot."""
    for leg in decomposition.legs:
        path = [] if decomposition.is_free_body(leg) else [*decomposition.path(leg)]
        if any(
            len(edge.joints) > 1 and not (edge is path[-1] and isinstance(edge.word.items[0], Rods)) for edge in path
        ):
            return True
    return False


@analysis(
    70,
    examples=(
        "quattro --observe 1,3 --at x=0.05,y=0.1,z=-0.7",
        "3rrr_m1 --real -o modes.png",
        "quattro --observe 1,4 --certificate c.json",
        f"gough_stewart {POINTS}",
    ),
    formations=True,
)
def modes(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    at: Annotated[
        PoseLike | ClosedConfiguration | None,
        option(
            "Pose whose measured values are fixed, such as x=0.02,y=0.1,z=-0.7; or mode:2 of the list "
            "printed without --at (default: the zero configuration).",
            "POSE",
        ),
    ] = None,
    real: Annotated[bool, option("Fix the real robot's own motors instead.")] = False,
    cone: Annotated[
        float | str, option("Measurement bound: poses that differ by no more are near modes; 0 for none.", "ANGLE")
    ] = MEASUREMENT_BOUND,
    as_written: bool = False,
    time_limit: Annotated[
        float,
        option(
            "Time limit for a list (estimated seconds on one core); longer lists are left out, and reported.",
            "SECONDS",
            low=0,
        ),
    ] = MODES_TIME_LIMIT_S,
    seed: Seed = 0,
) -> AssemblyModes:
    """List assembly modes: poses of the platform with the same measured values, and whether they are proved to be all.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    at
        Goal: pose at which the values are measured (metres, radians, base frame), or a closed configuration of an
        observed robot (default: the zero configuration).
    real
        True to fix the motors' coordinates instead of the observed values.
    cone
        Measurement bound (rad, or as ``"0.1deg"``; 0 for none): poses within it of the goal are listed as near modes.
    as_written
        True to take all numbers as they are. By default joint centres that nearly coincide are snapped, and solutions
        nearly at infinity are taken to be at infinity.
    time_limit
        Time limit for a list (seconds on one core), estimated from its size before it starts.
    seed
        Seed of the random samples.

    Returns
    -------
    AssemblyModes
        Complex solutions counted, real ones enclosed, with the proof. For a formation: all configurations with the
        values at the zero configuration, up to trivial motions.

    Raises
    ------
    BadRequest
        If a name or a part of a pose is unknown.
    PoseReachFailure
        If the pose is out of reach.
    GeometryAmbiguous
        If it is not clear whether a geometry is special.

    Notes
    -----
    The modes are the solutions of the conditions y(x) = y(x₀) on the pose x, y the measured values, x₀ the goal
    (proofs.md 8; MMT 3.3, 4.1.2, 4.2). A Π stays a parallelogram, never crossed, except in natural coordinates and in
    searches. If legs or values keep the platform from rotating, poses with another rotation (another operation mode)
    are not sought.

    If loci are of an unknown kind, or a solver gives up or is not installed, the whole robot is closed from random
    starts (:mod:`.mode_search`): these modes are found, and may not be all. The same is done if modes are on a
    self-motion: the equations then have infinitely many solutions, or rounding makes some of them seem isolated.

    Examples
    --------
    >>> hrsynth.modes("3rrr_m1", at="x=0,y=0,phi=0").count
    '2 real of 6 complex'
    """
    if real and (observe not in (None, "all", ["all"]) or sensor is not None):
        given = "--observe" if sensor is None else "--sensor"
        raise BadRequest(f"--real: cannot be combined with {given}", remedy="Omit one.")
    bound = parse_measurement_bound(cone)
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed, driven=real)
    if setup.robot.formation:
        return _list_formation(setup, at, real)
    asked = None if at is None or isinstance(at, ClosedConfiguration) else parse_pose(at)
    if isinstance(asked, ModeNumber):
        at, asked = assemble_at_mode(modes(setup, real=real), asked), None
    elif isinstance(asked, JointPose):
        at, asked = follow_line(setup.all_samples.start, setup.motion, asked), None
    setup = setup if asked is None else setup.printing_like([asked])
    motion, wanted = setup.motion, None
    goal = at if isinstance(at, ClosedConfiguration) else setup.all_samples.start
    if asked is not None:
        wanted = motion.goal(asked, setup.robot.name)
        goal = track_to_pose(goal, setup.all_samples.observation_model, asked, motion)
    measured = MeasuredRobot.of(setup, real)
    tried = list[TriedWay]()
    listed = _list_modes(setup, measured, goal, wanted, real, as_written, time_limit, tried)
    near = find_near_modes(setup, goal, measured.observation_model, listed.modes, listed.candidates, bound)
    return replace(listed, candidates=(), near_modes=near, measurement_bound=bound, ways=tuple(tried))


def _list_modes(
    setup: ObservedRobot,
    measured: MeasuredRobot,
    goal: ClosedConfiguration,
    wanted: Task | None,
    real: bool,
    as_written: bool,
    time_limit: float,
    tried: list[TriedWay],
) -> AssemblyModes:
    """List the modes of the numbers as they are, with starts of near ones."""
    motion = setup.motion
    pose = motion.pose(goal.pose(motion.link))
    kind = "real" if real else "hidden"
    free = setup.dof - measured.rank
    if free:
        text = f"the {'motors' if real else 'measured values'} leave {free} of the platform's dof undetermined"
        goal_motion = self_motion(goal, measured.observation_model, list_placing_links(setup.decomposition), goal=True)
        return AssemblyModes(
            setup,
            kind,
            goal,
            pose,
            make_family(f"{text}: a continuous family of dimension {free}", free),
            (),
            self_motions=() if goal_motion is None else (goal_motion,),
        )
    report("modes")

    def search_all(reason: str) -> AssemblyModes:
        tried.append(TriedWay("random starts of the whole robot", reason))
        return _list_by_search(setup, measured.observation_model, goal, pose, kind, reason)

    try:
        if not as_written and _is_on_self_motion(setup, measured.observation_model, goal):
            return search_all("the pose lies on a self-motion")
        listed = _list_by_system(setup, measured, goal, wanted, pose, kind, as_written, time_limit, tried)
    except (UnsupportedLocus, ExternalSolverFailure, TooLarge, MissingExtra) as error:
        return search_all(error.reason)
    moving = (
        not listed.found.complete
        and not as_written
        and any(
            mode.configuration is not None and _is_on_self_motion(setup, measured.observation_model, mode.configuration)
            for mode in listed.modes
        )
    )
    if not moving and not listed.found.open:
        return listed
    searched = search_all(
        "some of the solutions lie on a self-motion"
        if moving
        else "the equations depend on each other"
        if listed.found.continuous_family is not None
        else str(listed.found.singular_solutions)
    )
    return (
        searched
        if moving or not any(mode.proved for mode in listed.modes)
        else replace(listed, self_motions=searched.self_motions)
    )


def _list_formation(setup: ObservedRobot, where: object, real: bool) -> AssemblyModes:
    """List the modes of a formation; poses and motors are refused, which are those of one platform."""
    if where is not None or real:
        raise BadRequest(
            "--real: a formation has no motors to fix" if real else f"--at {where}: a formation has no single platform",
            remedy="Omit the option: the values at the file's configuration are fixed.",
        )
    report("modes")
    formed, goal = list_formation_modes(setup), setup.all_samples.start
    system = SystemModes(
        formed.complex,
        (),
        formed.complete,
        formed.proof,
        singular_solutions=formed.degenerate,
        continuous_family=formed.continuum,
        bound=formed.bound,
    )
    first = setup.samples.observation_model.platform
    listed = list[AssemblyMode]()
    for formed_mode in formed.modes:
        at = formed_mode.configuration
        whole = Assembly(at, (), tuple(list_joints_beyond(at.model, at.q)))
        listed.append(
            AssemblyMode(
                Pose.of(formed_mode.bodies[first]),
                np.inf,
                np.pi,
                formed_mode.residual,
                at is goal,
                whole.reachable,
                None,
                whole.verdict,
                (),
                whole.beyond,
                (),
                at,
                proved=formed.complete,
                length=goal.model.length,
                bodies=formed_mode.bodies,
                opposite=formed_mode.opposite,
            )
        )
    return AssemblyModes(
        setup,
        "formation",
        goal,
        Pose.of(goal.pose(first)),
        system,
        tuple(mode for mode in listed if not mode.opposite),
        formation=formed.formation,
        antipodal=tuple(mode for mode in listed if mode.opposite),
    )


def assemble_at_mode(listed: AssemblyModes | None, asked: ModeNumber) -> ClosedConfiguration:
    """Return the robot assembled at one of its modes, its coordinates relative to the zero configuration; raises
    ``BadRequest``, ``PoseReachFailure``."""
    assert listed is not None
    name, count = listed.setup.robot.name, len(listed.modes)
    if not 1 <= asked.number <= count:
        raise BadRequest(
            f"{asked}: {name} has {count} mode{'s' * (count != 1)} at {listed.pose}",
            remedy=f"Use mode:1{f' to mode:{count}' * (count > 1)}."
            if count
            else "Use another pose."
            if listed.found.continuous_family is None
            else "Observe more: the modes are a continuous family.",
        )
    mode = listed.modes[asked.number - 1]
    at = listed.goal if mode.goal else mode.configuration
    if at is None:
        left = " and ".join(f"{noun} {', '.join(names)}" for noun, names in mode.left_open)
        raise PoseReachFailure(
            name,
            f"{asked} ({mode.pose})",
            0.0,
            str(listed.pose),
            reason=f"the robot was not found assembled there: {left} not closed",
        )
    return at if at.model is listed.goal.model else build_from_link_poses(listed.goal.model, at.pose)


def _is_on_self_motion(setup: ObservedRobot, observation_model: ObservationModel, at: ClosedConfiguration) -> bool:
    """Return True if a closed configuration is on a self-motion that can be followed."""
    return (
        has_unobserved_motion(at, observation_model)
        and self_motion(at, observation_model, list_placing_links(setup.decomposition)) is not None
    )


def _list_by_search(
    setup: ObservedRobot,
    observation_model: ObservationModel,
    goal: ClosedConfiguration,
    pose: Pose,
    kind: str,
    reason: str,
) -> AssemblyModes:
    """List the modes that a search finds, with the reason why no list can be complete."""
    done = search(goal, observation_model, list_placing_links(setup.decomposition))
    size = max((motion.dimension for motion in done.self_motions), default=None)
    system_modes = SystemModes(
        None,
        (),
        False,
        f"{done.words}; not counted: {reason}",
        singular_solutions=done.degenerate,
        continuous_family=size,
    )
    return AssemblyModes(
        setup,
        kind,
        goal,
        pose,
        system_modes,
        tuple(_read_found(setup, observation_model, mode, mode.configuration is goal) for mode in done.modes),
        tuple(_read_found(setup, observation_model, mode) for mode in done.near),
        self_motions=done.self_motions,
    )


def _read_found(
    setup: ObservedRobot, observation_model: ObservationModel, mode: FoundMode, goal: bool = False
) -> AssemblyMode:
    return build_mode(setup, observation_model, mode.configuration, mode.bodies, mode.residual, goal)


def _list_by_system(
    setup: ObservedRobot,
    measured: MeasuredRobot,
    goal: ClosedConfiguration,
    wanted: Task | None,
    pose: Pose,
    kind: str,
    as_written: bool,
    time_limit: float,
    tried: list[TriedWay],
) -> AssemblyModes:
    """List the modes as the solutions of the system of the tips' loci, or else of the conditions of the legs'
    joints, or else in natural coordinates."""
    reasons = list[UnsupportedLocus | ExternalSolverFailure | TooLarge | MissingExtra]()
    answers = list[tuple[Model, SystemModes]]()
    exact = drift(goal, wanted, setup.normal.moved)
    free = drop_couplings(measured, goal)
    by_legs: dict[str, Callable[..., tuple[Model, SystemModes]]] = {
        "loci of tips": partial(solve_tips, as_written=as_written, time_limit=time_limit),
        "conditions on the pose": partial(solve_posed, time_limit=time_limit),
    }
    whole = {"natural coordinates": partial(solve_natural, time_limit=time_limit)}
    narrower = {"natural coordinates, directions kept": partial(solve_natural, time_limit=time_limit, keeps=True)}
    for name, way in ((whole | by_legs if free else by_legs | whole) | narrower).items():
        if name in narrower and any(answer[1].complete for answer in answers):
            break
        is_whole = name not in by_legs
        try:
            if not is_whole and not setup.decomposition.is_platform_decided:
                raise UnsupportedLocus(setup.robot.name, "joints inside its platform allow several poses of it")
            answers.append(way(*(free if free and not is_whole else (measured, goal)), exact))
        except (UnsupportedLocus, ExternalSolverFailure, TooLarge, MissingExtra) as error:
            reasons.append(error)
            tried.append(TriedWay(name, error.reason))
        else:
            outcome, more = answers[-1][1].outcome, may_count_more(answers[-1][0])
            tried.append(TriedWay(name, f"{outcome}; another way may count more complex ones" if more else outcome))
            if answers[-1][1].complete and not more:
                break
    if not answers:
        raise reasons[0]
    # all dof are observed: a continuous family is that of legs which tips alone do not show
    made, solved = max(
        answers,
        key=lambda answer: (answer[1].complete, answer[1].continuous_family is None, not may_count_more(answer[0])),
    )
    if free is not None and made.closing is None:
        solved = replace(solved, proof=f"without couplings, which only exclude poses: {solved.proof}")
    reader = ModeReader(setup, measured.observation_model if free is None else free[0].observation_model, goal, made)
    at_goal = min(solved.modes, key=reader.away, default=None)
    ordered = sorted(solved.modes, key=lambda mode: mode is not at_goal)
    read = [reader.read(mode, mode is at_goal) for mode in ordered]
    if isinstance(made.system, NaturalPlatform) and solved.enclosed:
        read = [prove_existence(mode, goal, measured.observation_model, setup.normal.moved) for mode in read]
    near = [reader.read(mode, False) for mode in solved.near if reader.away(mode) > NEAR_POSE_DIFFERENCE_TOL]
    return AssemblyModes(
        setup,
        kind,
        goal,
        pose,
        solved,
        tuple(mode for mode in read if not mode.opposite),
        tuple(mode for mode in near if not mode.opposite),
        model=made,
        antipodal=tuple(mode for mode in read if mode.opposite),
    )
