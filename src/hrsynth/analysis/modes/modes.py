"""All assembly modes of a hidden robot, or of the real one: every pose of the platform with the same measurements."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...batch.pose_continuation import reach
from ...budgets import EFFORT
from ...constraints.pattern import placing_links
from ...errors import BadRequest, MissingExtra, PoseNotReached, SystemNotSolved, TooLarge, UnsupportedLocus
from ...kinematics.assembly import Assembly, of_links
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import reach_joints
from ...kinematics.limits import outside
from ...kinematics.tasks import Task
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism.observation import Observation
from ...mechanism.pose import JointPose, ModeNumber, Pose, PoseLike, asked_pose
from ...options import option
from ...progress import report
from ...records import FLAT, OPTIONAL, As, Shown, recorded
from ...results import Result
from ...tolerances import MEASUREMENT_BOUND, SAME_NEAR_POSE
from ..analysis_declaration import analysis
from ..formation import Formation
from ..measured import MeasuredRobot
from ..observed import POINTS, UNLIMITED, CameraLike, LegsLike, ObservedRobot, RobotLike, Seed, SeeLike
from .assembly_mode import AssemblyMode, ModeReader, found_mode
from .branches import Model
from .carrying_leg_modes import solve_carried
from .carrying_leg_system import CarriedPlatform
from .formation_modes import formation_modes
from .goal_error import drift
from .methods import better_ways, solve_tips, without_couplings
from .near import NearMode, measurement_bound, near_modes, poses_alike
from .planar_loops import PlanarLoops
from .planar_modes import solve_loops
from .pose_conditions_solver import PosedPlatform, solve_posed
from .search import FoundMode, leaves_free, search
from .self_motions import SelfMotion, self_motion
from .single_loop import solve_loop
from .solve import SystemModes, continuum
from .tips import TipLoci

WITHIN = {
    "formation": "configurations up to trivial motions",
    "translations": "poses turned as this one",
    "bodies": "poses whose bodies are turned as at this one",
    "planar": "poses in the plane of motion",
    "spatial": "poses in space",
    "oriented": "poses in space",
}
"""Among which poses the modes are listed, for each way in which the platform moves."""


class BodyPlace(NamedTuple):
    """Where a body of a formation is."""

    link: str
    pose: Pose


class ListedMode(NamedTuple):
    """An assembly mode."""

    mode: Annotated[AssemblyMode, FLAT]
    places: Annotated[
        list[BodyPlace] | None,
        list[BodyPlace],
        OPTIONAL,
        "of a formation: all bodies, moved by a trivial motion to where they are nearest to the file's",
    ]


class FollowedMotion(NamedTuple):
    """A motion that leaves the measurements unchanged, as far as it was followed from a pose."""

    pose: Pose
    motion: Annotated[SelfMotion, FLAT]


class MeantLegs(NamedTuple):
    """Legs whose joint centres are taken to coincide."""

    where: str
    legs: list[str]
    defect_m: float


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyModes(Result, shown_as="modes"):
    """All assembly modes with the measurements of one pose, the goal.

    ``complex``, ``complete``, ``proof``, ``degenerate`` and ``continuum`` are as for :class:`SystemModes`; ``kind`` is
    ``hidden`` or ``real``; ``motions`` are continua of modes, with what moves, as far as they were followed, and
    ``modes`` those that lie on none.
    """

    setup: ObservedRobot
    kind: Annotated[str, Literal["hidden", "real", "formation"]]
    goal: ClosedConfiguration
    pose: Pose
    found: SystemModes
    modes: tuple[AssemblyMode, ...]
    candidates: tuple[AssemblyMode, ...] = ()
    """Where near modes are sought: working material, none once they are."""
    near_modes: Annotated[tuple[NearMode, ...], As("near_modes"), "found, not proved to be all"] = ()
    """Other poses at which what is measured differs by no more than ``bound`` (rad)."""
    measurement_bound: Annotated[float, As("measurement_bound"), "error (rad) up to which near modes are sought"] = 0.0
    model: Model | None = None
    self_motions: tuple[SelfMotion, ...] = ()
    antipodal: tuple[AssemblyMode, ...] = ()
    """Solutions of the same equations at which something is seen as the opposite value."""
    formation: Annotated[Formation | None, Formation, OPTIONAL] = None
    """Of several bodies: what is not seen of them at the goal."""

    @property
    def confined(self) -> TipLoci | None:
        """The curves of the tips; None if the measurements never decide the pose, or if no such curves are known."""
        return None if self.model is None else self.model.confined

    @property
    @recorded()
    def within(self) -> str | None:
        """The poses among which these modes are all."""
        if self.formation is not None:
            return WITHIN["formation"]
        if self.confined is not None:
            return WITHIN[self.confined.motion]
        system = None if self.model is None else self.model.system
        motion = (
            system.poses.motion
            if isinstance(system, PosedPlatform)
            else "planar"
            if isinstance(system, PlanarLoops)
            else "spatial"
            if isinstance(system, CarriedPlatform)
            else None
        )
        return None if motion is None else WITHIN[motion]

    @property
    def labels(self) -> tuple[str, ...]:
        """The legs whose ends are confined."""
        return () if self.confined is None else tuple(tip.leg for tip in self.confined.tips)

    def headline(self) -> str:
        """The robot and how many modes there are."""
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
        """How many poses a measurement with an error does not tell from each other, in words."""
        return poses_alike(self.modes, self.near_modes)

    @property
    def count(self) -> str:
        """How many there are, in words."""
        if self.found.continuous_family is not None and (self.found.complex is not None or self.formation is not None):
            return "a continuum"
        if self.self_motions:
            count = len(self.self_motions)
            return (
                f"{count} self-motion{'s' * (count > 1)}, and {len(self.modes)} real that "
                f"{'lies' if len(self.modes) == 1 else 'lie'} on none"
            )
        other = f" and {len(self.antipodal)} antipodal" if self.antipodal else ""
        return f"{len(self.modes)} real{other}" + (
            "" if self.found.complex is None else f" of {self.found.complex} complex"
        )

    def pose_of(self, motion: SelfMotion) -> Pose:
        """A pose on a self-motion, from which it was followed."""
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
        lambda self: [FollowedMotion(self.pose_of(each), each) for each in self.self_motions],
        As("motions"),
    )
    snapped = Shown(
        list[MeantLegs],
        lambda self: [
            MeantLegs(each.where, [self.labels[k] for k in each.legs], each.defect) for each in self.found.snapped
        ],
    )
    limits_ignored = Shown(list[str], lambda self: self.setup.limits_ignored, UNLIMITED)

    def _listed(self, modes: Iterable[AssemblyMode]) -> list[ListedMode]:
        """Modes with where all bodies of a formation are."""
        return [
            ListedMode(
                mode,
                None
                if self.formation is None or not mode.bodies
                else [BodyPlace(link, Pose.of(X)) for link, X in mode.bodies.items()],
            )
            for mode in modes
        ]


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
    sensor: SeeLike = None,
    at: Annotated[
        PoseLike | ClosedConfiguration | None,
        option(
            "Pose whose measurements are held, such as x=0.02,y=0.1,z=-0.7; or mode:2 of the list "
            "printed without --at (default: the zero configuration).",
            "POSE",
        ),
    ] = None,
    real: Annotated[bool, option("Hold the real robot's own motors instead.")] = False,
    cone: Annotated[
        float | str,
        option("Error of a measurement: poses that differ by no more are near modes; 0 for none.", "ANGLE"),
    ] = MEASUREMENT_BOUND,
    as_written: bool = False,
    time_limit: Annotated[
        float,
        option(
            "Time limit for a list (estimated seconds on one core); what needs more is left out, and reported.",
            "SECONDS",
            low=0,
        ),
    ] = EFFORT,
    seed: Seed = 0,
) -> AssemblyModes:
    """Assembly modes: poses of the platform with the same measurements, and whether they are proved to be all.

    All poses with what is observed at ``at`` (default: the zero configuration), or with ``real`` the motors'
    coordinates: complex solutions counted, real ones enclosed (proofs.md 8; MMT 3.3, 4.1.2, 4.2).

    A Π stays a parallelogram, never crossed (except in planar mechanisms that are closed loop by loop, and in
    searches); if legs or measurements keep the platform from turning, turned poses (another operation mode) are not
    searched for. Poses that a measurement with an error up to ``cone`` (rad, or as ``"0.1deg"``; 0 for none) does not
    tell from the goal are listed too, as ``near``: found, not proved. ``observe``, ``camera`` and ``sensor`` are as for
    ``derive``; ``at`` may be a closed configuration of an observed robot. Joint centres that nearly coincide, and
    solutions nearly at infinity, are taken to be so if that is clearly meant, unless ``as_written`` is true.
    ``time_limit`` is the time limit for a list (seconds on one core), estimated from its size before it starts. For a
    formation: all configurations, trivial motions aside, with what is measured at the zero configuration.

    If the tips' paths are of no known kind, or the solver that they need gives up or is not installed, the whole robot
    is closed from random starts (:mod:`.search`): these modes are found, for any kind of closing, and nothing says that
    they are all. The same is done if modes lie on a self-motion: the equations then have infinitely many solutions, or
    rounding makes some of them seem isolated.

    Raises ``BadRequest`` for unknown names, ``PoseNotReached`` for a pose out of reach, ``GeometryAmbiguous`` if it is
    not clear whether special geometry is meant.

    >>> hrsynth.modes("3rrr_m1", at="x=0,y=0,phi=0")
    <AssemblyModes: 3rrr_m1, watching 1, 2, 3: 2 real of 6 complex (hidden robot) at x=0,y=0,z=0,phi=0deg>
    """
    if real and (observe not in (None, "all", ["all"]) or sensor is not None):
        raise BadRequest(
            "the motors are held instead of what is observed", f"real with {observe or sensor}", "one of the two"
        )
    bound = measurement_bound(cone)
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed, driven=real)
    if setup.robot.formation:
        return _modes_of_formation(setup, at, real)
    asked = None if at is None or isinstance(at, ClosedConfiguration) else asked_pose(at)
    if isinstance(asked, ModeNumber):
        at, asked = at_mode(modes(setup), asked), None
    elif isinstance(asked, JointPose):
        at, asked = reach_joints(setup.all_samples.start, setup.motion, asked), None
    setup = setup if asked is None else setup.telling([asked])
    motion, wanted = setup.motion, None
    goal = at if isinstance(at, ClosedConfiguration) else setup.all_samples.start
    if asked is not None:
        wanted = motion.goal(asked, setup.robot.name)
        goal = reach(goal, setup.all_samples.observation_model, asked, motion)
    measured = MeasuredRobot.of(setup, real)
    found = _list_modes(setup, measured, goal, wanted, real, as_written, time_limit)
    near = near_modes(setup, goal, measured.observation_model, found.modes, found.candidates, bound)
    return replace(found, candidates=(), near_modes=near, measurement_bound=bound)


def _list_modes(
    setup: ObservedRobot,
    measured: MeasuredRobot,
    goal: ClosedConfiguration,
    wanted: Task | None,
    real: bool,
    as_written: bool,
    time_limit: float,
) -> AssemblyModes:
    """The modes of the numbers as they are, and where near ones are sought."""
    motion = setup.motion
    pose = motion.pose(goal.pose(motion.link))
    kind = "real" if real else "hidden"
    free = setup.dof - measured.rank
    if free:
        text = f"the {'motors' if real else 'measurements'} leave {free} of the platform's freedoms undetermined"
        own = self_motion(goal, measured.observation_model, placing_links(setup.decomposition), goal=True)
        return AssemblyModes(
            setup,
            kind,
            goal,
            pose,
            continuum(f"{text}: a continuum of dimension {free}", free),
            (),
            self_motions=() if own is None else (own,),
        )
    report("modes")
    try:
        if not as_written and _moves(setup, measured.observation_model, goal):
            return _modes_by_search(
                setup, measured.observation_model, goal, pose, kind, "the pose lies on a self-motion"
            )
        listed = _modes_by_system(setup, measured, goal, wanted, pose, kind, as_written, time_limit)
    except (UnsupportedLocus, SystemNotSolved, TooLarge, MissingExtra) as error:
        return _modes_by_search(setup, measured.observation_model, goal, pose, kind, error.reason)
    moving = (
        not listed.found.complete
        and not as_written
        and any(
            mode.configuration is not None and _moves(setup, measured.observation_model, mode.configuration)
            for mode in listed.modes
        )
    )
    if not moving and not listed.found.open:
        return listed
    why = (
        "some of the solutions lie on a self-motion"
        if moving
        else "the equations depend on each other"
        if listed.found.continuous_family is not None
        else str(listed.found.singular_solutions)
    )
    found = _modes_by_search(setup, measured.observation_model, goal, pose, kind, why)
    return (
        found
        if moving or not any(mode.proved for mode in listed.modes)
        else replace(listed, self_motions=found.self_motions)
    )


def _modes_of_formation(setup: ObservedRobot, where: object, real: bool) -> AssemblyModes:
    """The modes of a formation; refuses poses and motors, which are those of one platform."""
    if where is not None or real:
        raise BadRequest(
            f"{setup.robot.name}: poses and motors belong to one platform, and this is a formation",
            "real" if real else str(where),
            "nothing: what is measured at the file's configuration is held",
        )
    report("modes")
    found, goal = formation_modes(setup), setup.all_samples.start
    system = SystemModes(
        found.complex,
        (),
        found.complete,
        found.proof,
        singular_solutions=found.degenerate,
        continuous_family=found.continuum,
        bound=found.bound,
    )
    first = setup.samples.observation_model.platform
    listed = list[AssemblyMode]()
    for each in found.modes:
        at = each.configuration
        whole = Assembly(at, (), tuple(outside(at.model, at.q)))
        listed.append(
            AssemblyMode(
                Pose.of(each.bodies[first]),
                np.inf,
                np.pi,
                each.residual,
                at is goal,
                whole.reachable,
                None,
                whole.verdict,
                (),
                whole.beyond,
                (),
                at,
                proved=found.complete,
                length=goal.model.length,
                bodies=each.bodies,
                opposite=each.opposite,
            )
        )
    return AssemblyModes(
        setup,
        "formation",
        goal,
        Pose.of(goal.pose(first)),
        system,
        tuple(mode for mode in listed if not mode.opposite),
        formation=found.formation,
        antipodal=tuple(mode for mode in listed if mode.opposite),
    )


def at_mode(listed: AssemblyModes | None, asked: ModeNumber) -> ClosedConfiguration:
    """The robot assembled at one of its modes, its coordinates counted from the zero configuration; raises
    ``BadRequest``, ``PoseNotReached``."""
    assert listed is not None
    name, count = listed.setup.robot.name, len(listed.modes)
    if not 1 <= asked.number <= count:
        raise BadRequest(
            f"{name}: a mode at {listed.pose}",
            str(asked),
            f"mode:1 to mode:{count}"
            if count
            else "no mode"
            if listed.found.continuous_family is None
            else "poses that do not form a continuum",
        )
    mode = listed.modes[asked.number - 1]
    at = listed.goal if mode.goal else mode.configuration
    if at is None:
        left = " and ".join(f"{noun} {', '.join(names)}" for noun, names in mode.left_open)
        raise PoseNotReached(
            name,
            f"{asked} ({mode.pose})",
            0.0,
            str(listed.pose),
            reason=f"the robot was not found assembled there: {left} stayed open",
        )
    return at if at.model is listed.goal.model else of_links(listed.goal.model, at.pose)


def _moves(setup: ObservedRobot, observation_model: ObservationModel, at: ClosedConfiguration) -> bool:
    """Whether a closing lies on a self-motion that can be followed."""
    return (
        leaves_free(at, observation_model)
        and self_motion(at, observation_model, placing_links(setup.decomposition)) is not None
    )


def _modes_by_search(
    setup: ObservedRobot,
    observation_model: ObservationModel,
    goal: ClosedConfiguration,
    pose: Pose,
    kind: str,
    reason: str,
) -> AssemblyModes:
    """The modes that a search finds, and why there is no list that could be complete."""
    done = search(goal, observation_model, placing_links(setup.decomposition))
    size = max((motion.dimension for motion in done.self_motions), default=None)
    found = SystemModes(
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
        found,
        tuple(_read_found(setup, observation_model, mode, mode.configuration is goal) for mode in done.modes),
        tuple(_read_found(setup, observation_model, mode) for mode in done.near),
        self_motions=done.self_motions,
    )


def _read_found(
    setup: ObservedRobot, observation_model: ObservationModel, mode: FoundMode, goal: bool = False
) -> AssemblyMode:
    return found_mode(setup, observation_model, mode.configuration, mode.bodies, mode.residual, goal)


def _modes_by_system(
    setup: ObservedRobot,
    measured: MeasuredRobot,
    goal: ClosedConfiguration,
    wanted: Task | None,
    pose: Pose,
    kind: str,
    as_written: bool,
    time_limit: float,
) -> AssemblyModes:
    """The modes as the solutions of the system that the tips' curves and surfaces give, or else of the conditions that
    the legs' joints give."""
    reasons, large = list[UnsupportedLocus | SystemNotSolved | TooLarge | MissingExtra](), None
    answers = list[tuple[Model, SystemModes]]()
    exact, better = drift(goal, wanted, setup.normal.moved), None
    free = without_couplings(measured, goal)
    tips, asked = (
        partial(solve_tips, as_written=as_written, time_limit=time_limit),
        partial(solve_posed, time_limit=time_limit),
    )
    first = (tips, asked, solve_loops) if free is None else (solve_loops, tips, asked)
    for listed in (*first, solve_carried, solve_loop):
        if better is not None and listed not in better:
            continue
        if listed is not solve_loops and not setup.decomposition.decided:
            reasons.append(UnsupportedLocus(setup.robot.name, "joints inside its platform allow several poses of it"))
            continue
        try:
            answers.append(listed(*((measured, goal) if free is None or listed is solve_loops else free), exact))
        except (UnsupportedLocus, SystemNotSolved, TooLarge, MissingExtra) as error:
            reasons.append(error)
            large = error if listed is solve_loops and isinstance(error, SystemNotSolved) else large
        else:
            if answers[-1][1].complete:
                better = () if better else better_ways(answers[-1][0])
    if not answers:
        raise large or reasons[0]
    # what is measured leaves no freedom: a continuum is that of legs which tips alone do not show
    made, found = max(
        answers, key=lambda each: (each[1].complete, each[1].continuous_family is None, not better_ways(each[0]))
    )
    if free is not None and made.closing is None:
        found = replace(found, proof=f"without couplings, which can only rule poses out: {found.proof}")
    reader = ModeReader(setup, measured.observation_model if free is None else free[0].observation_model, goal, made)
    at_goal = min(found.modes, key=reader.away, default=None)
    ordered = sorted(found.modes, key=lambda mode: mode is not at_goal)
    read = [reader.read(mode, mode is at_goal) for mode in ordered]
    near = [reader.read(mode, False) for mode in found.near if reader.away(mode) > SAME_NEAR_POSE]
    return AssemblyModes(
        setup,
        kind,
        goal,
        pose,
        found,
        tuple(mode for mode in read if not mode.opposite),
        tuple(mode for mode in near if not mode.opposite),
        model=made,
        antipodal=tuple(mode for mode in read if mode.opposite),
    )
