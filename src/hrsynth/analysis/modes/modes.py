"""All assembly modes of a hidden robot, or of the real one: every pose of the platform with the same measurements."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...batch.reach import reach
from ...budgets import EFFORT
from ...constraints.pattern import moved
from ...errors import (
    BadRequest,
    HrsynthError,
    LoopsNotClosed,
    MissingExtra,
    NotConfined,
    PoseNotReached,
    TooLarge,
    Unsolved,
)
from ...geometry.vectors import Array, pose_difference
from ...kinematics.assembly import NOT_FOUND, Assembler, Assembly, of_links
from ...kinematics.closures import Miss
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import outside
from ...kinematics.pinocchio_model import PinocchioModel
from ...kinematics.relation import Measurement
from ...kinematics.tasks import Held, Task
from ...mechanism.observations.encoder import Encoder
from ...mechanism.pose import ModeNumber, Pose, PoseLike, asked_pose
from ...mechanism.sensors import encoders
from ...progress import tell
from ...results import Result
from ...tolerances import SAME_RELATION
from ..formation import Formation
from ..measured import MeasuredRobot
from ..observed import CameraLike, LegsLike, ObservedRobot, RobotLike, SeeLike
from ..question import question
from ..singularity.agreement import weakest
from .branches import Model, solve_all
from .carried import CarriedPlatform, solve_carried
from .conditions import AtAngle
from .drift import drift
from .formed import formed
from .motions import SelfMotion, self_motion
from .planar_loops import PlanarLoops, solve_loops
from .posed import PosedPlatform, most_posed, solve_posed
from .search import FoundMode, leaves_free, search
from .sighted import all_loci, behind, opposite, sights
from .single_loop import solve_loop
from .solve import SystemMode, SystemModes, continuum
from .tips import TipLoci

WITHIN = {"formation": "configurations up to trivial motions",
          "translations": "poses turned as this one", "bodies": "poses whose bodies are turned as at this one",
          "planar": "poses in the plane of motion", "spatial": "poses in space", "oriented": "poses in space"}
"""Among which poses the modes are listed, for each way in which the platform moves."""


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyMode:
    """A pose of the platform with the measurements of the goal.

    The exact pose, of the file's decimals, is within ``shift`` (m) and ``turn`` (rad) of ``pose``, infinite where
    nothing was proved: its position and its turn, or those of the bodies on which legs end where ``enclosed`` names
    them; ``residual``: the largest distance of a tip from its curve (characteristic lengths). ``goal``: whether it is
    the pose itself from which the measurements were taken. ``reachable`` and ``assembly``: whether the whole real
    robot, legs that are not watched included, closes there within its joints' limits, as of :class:`Assembly` (the
    first None where neither was found); ``open`` names the legs that were not closed, ``beyond`` the joints,
    ``misses`` what proves of legs that they cannot be closed. ``type2_distance``: the smallest singular value of Mᵀ
    there, as ``check`` gives it; None where the robot was not closed.
    """

    pose: Pose
    shift: float
    turn: float
    residual: float
    goal: bool
    reachable: bool | None
    type2_distance: float | None
    assembly: str = NOT_FOUND
    open: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    misses: tuple[tuple[str, Miss], ...] = ()
    configuration: ClosedConfiguration | None = None
    multiplicity: int = 1
    proved: bool = False
    """Whether there is exactly one mode within the radius, for all that the file's decimals and closed loops allow."""
    rounded: bool = False
    """Whether that is proved for the rounded geometry alone, of which the radius then speaks."""
    fits: float | None = None
    """How well all legs fit (characteristic lengths) where more is observed than needed and that is all that is known;
    the radius is then that of the mode, if it is one."""
    enclosed: tuple[str, ...] = ()
    length: float = 1.0
    """The robot's characteristic length (m)."""
    bodies: dict[str, Array] | None = None
    """Poses (4, 4) of the bodies on which legs end, where need be of the controlled one; of a formation of all bodies,
    moved by a trivial motion to where they are nearest to the goal's."""
    opposite: tuple[str, ...] = ()
    """What is seen there as the opposite value: then it is *antipodal* and no mode."""
    behind: tuple[str, ...] | None = None
    """What is not in front of the camera by which it is seen; None where no camera with a name sees a point."""

    def __repr__(self) -> str:
        said = "the pose itself" if self.goal else f"assembled: {self.assembly}"
        return f"<{type(self).__name__}: {self.pose}, {said}>"

    @property
    def radius(self) -> float:
        """The larger of the shift (characteristic lengths) and the turn (rad)."""
        return max(self.shift / self.length, self.turn)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        known = bool(np.isfinite(self.radius))
        return {"pose": self.pose.to_dict(), "radius": self.radius if known else None,
                "radius_m": self.shift if known else None, "radius_rad": self.turn if known else None,
                "bodies": list(self.enclosed),
                "residual": self.residual, "goal": self.goal, "reachable": self.reachable,
                "assembly": self.assembly, "open": list(self.open), "beyond": list(self.beyond),
                "reasons": [{"leg": leg, **miss.to_dict()} for leg, miss in self.misses],
                "type2_distance": self.type2_distance,
                "multiplicity": self.multiplicity, "proved": self.proved, "rounded": self.rounded,
                "fits": self.fits, "opposite": list(self.opposite),
                "behind": None if self.behind is None else list(self.behind)}


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyModes(Result, shown_as="modes"):
    """All assembly modes with the measurements of one pose, the goal.

    ``complex``, ``complete``, ``proof``, ``degenerate`` and ``continuum`` as for :class:`SystemModes`; ``kind`` is
    ``hidden`` or ``real``; ``motions`` are continua of modes, with what moves, as far as they were followed, and
    ``modes`` those that lie on none; ``confined`` holds the curves of the tips (None where the measurements never
    decide the pose, or where the modes were searched for because no such curves are known).
    """

    setting: ObservedRobot
    kind: str
    goal: ClosedConfiguration
    pose: Pose
    found: SystemModes
    modes: tuple[AssemblyMode, ...]
    near: tuple[AssemblyMode, ...]
    confined: TipLoci | None = None
    model: Model | None = None
    motions: tuple[SelfMotion, ...] = ()
    antipodal: tuple[AssemblyMode, ...] = ()
    """Solutions of the same equations at which something is seen as the opposite value."""
    formation: Formation | None = None
    """Of several bodies: what is not seen of them at the goal."""

    @property
    def within(self) -> str | None:
        """Among which poses the modes are all."""
        if self.formation is not None:
            return WITHIN["formation"]
        if self.confined is not None:
            return WITHIN[self.confined.motion]
        system = None if self.model is None else self.model.system
        motion = (system.poses.motion if isinstance(system, PosedPlatform) else
                  "planar" if isinstance(system, PlanarLoops) else
                  "spatial" if isinstance(system, CarriedPlatform) else None)
        return None if motion is None else WITHIN[motion]

    @property
    def labels(self) -> tuple[str, ...]:
        """The legs whose ends are confined."""
        return () if self.confined is None else tuple(tip.leg for tip in self.confined.tips)

    def headline(self) -> str:
        """The robot and how many modes there are."""
        if self.formation is not None:
            return f"{self.setting.headline()}: {self.count} (formation)"
        return f"{self.setting.headline()}: {self.count} ({self.kind} robot) at {self.pose}"

    @property
    def count(self) -> str:
        """How many there are, in words."""
        if self.found.continuum is not None and (self.found.complex is not None or self.formation is not None):
            return "a continuum"
        if self.motions:
            return (f"{len(self.motions)} self-motion{'s' * (len(self.motions) > 1)}, and {len(self.modes)} real that "
                    f"{'lies' if len(self.modes) == 1 else 'lie'} on none")
        other = f" and {len(self.antipodal)} antipodal" if self.antipodal else ""
        return f"{len(self.modes)} real{other}" + (
            "" if self.found.complex is None else f" of {self.found.complex} complex")

    def pose_of(self, motion: SelfMotion) -> Pose:
        """A pose on a self-motion, from which it was followed."""
        return self.setting.motion.pose(motion.configuration.pose(self.setting.motion.link))

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        found = self.found
        return {"kind": self.kind, "at": self.pose.to_dict(), "within": self.within,
                "observed": [o.to_dict() for o in self.setting.observed],
                "complex": None if found.continuum else found.complex, "complete": found.complete,
                "bound": found.bound, "proof": found.proof,
                **({} if self.formation is None else {"formation": self.formation.to_dict()}),
                "modes": [self._record(each) for each in self.modes], "near": [each.to_dict() for each in self.near],
                "antipodal": [self._record(each) for each in self.antipodal],
                "degenerate": found.degenerate, "continuum": found.continuum,
                "motions": [{"pose": self.pose_of(each).to_dict(), **each.to_dict()} for each in self.motions],
                "meant": [each.to_dict(self.labels) for each in found.meant]}

    def _record(self, mode: AssemblyMode) -> dict[str, Any]:
        places = [] if self.formation is None else [
            {"link": link, "pose": Pose.of(X).to_dict()} for link, X in (mode.bodies or {}).items()]
        return {**mode.to_dict(), **({"places": places} if places else {})}


@question(formations=True)
def modes(robot: RobotLike, observe: LegsLike = None, camera: CameraLike = None, *, see: SeeLike = None,
          at: PoseLike | ClosedConfiguration | None = None, real: bool = False, as_written: bool = False,
          effort: float = EFFORT, seed: int = 0) -> AssemblyModes:
    """All poses with what is observed at ``at`` (default: the zero configuration), or with ``real`` the motors'
    coordinates: complex solutions counted, real ones enclosed (theory.md 8; MMT 3.3, 4.1.2, 4.2).

    A Π counts as a parallelogram throughout, never crossed; where legs or measurements keep the platform from turning,
    poses that are turned all the same (another operation mode) are not looked for. ``observe``, ``camera`` and ``see``
    as for ``derive``; ``at`` may be a closed configuration of an observed robot. Joint centres that nearly coincide and
    solutions nearly at infinity, are taken to be so where that is clearly meant, unless ``as_written`` is true.
    ``effort``: seconds of one core that a list may need, told by its size before it starts. Of a formation all
    configurations, trivial motions taken out, with what is measured at the zero configuration.

    Where the tips' paths are none of those known, or the solver that they need gives up or is not installed, the whole
    robot is closed from random starts (:mod:`.search`): modes that are found, of any kind of closing, and nothing says
    that they are all. So it is where modes lie on a self-motion: there the equations have infinitely many solutions, or
    rounding makes some of them seem isolated.

    Raises ``BadRequest`` for names that there are not, ``PoseNotReached`` for a pose out of reach, ``MeaningUndecided``
    where special geometry may be meant or not.

    >>> hrsynth.modes("3rrr_m1", at="x=0,y=0,phi=0")
    <AssemblyModes: 3rrr_m1, watching 1, 2, 3: 2 real of 6 complex (hidden robot) at x=0,y=0,z=0,phi=0deg>
    """
    if real and (observe not in (None, "all", ["all"]) or see is not None):
        raise BadRequest("the motors are held instead of what is observed", f"real with {observe or see}",
                         "one of the two")
    setting = ObservedRobot.of(robot, observe, camera, see=see, seed=seed)
    if setting.robot.formation:
        return _formed(setting, at, real)
    asked = None if at is None or isinstance(at, ClosedConfiguration) else asked_pose(at)
    if isinstance(asked, ModeNumber):
        at, asked = at_mode(modes(setting), asked), None
    setting = setting if asked is None else setting.telling([asked])
    motion, wanted = setting.motion, None
    goal = at if isinstance(at, ClosedConfiguration) else setting.everything.start
    if asked is not None:
        wanted = motion.goal(asked, setting.robot.name)
        goal = reach(goal, setting.everything.question, asked, motion)
    measured = MeasuredRobot.driven(setting) if real else MeasuredRobot.watched(setting)
    pose = motion.pose(goal.pose(motion.link))
    kind = "real" if real else "hidden"
    free = setting.dof - measured.rank
    if free:
        text = f"the {'motors' if real else 'measurements'} leave {free} of the platform's freedoms undetermined"
        own = self_motion(goal, measured.question, moved(setting.anatomy), goal=True)
        return AssemblyModes(setting, kind, goal, pose, continuum(f"{text}: a continuum of dimension {free}", free),
                             (), (), motions=() if own is None else (own,))
    tell("modes")
    try:
        if not as_written and _moves(setting, measured.question, goal):
            return _searched(setting, measured.question, goal, pose, kind, "the pose lies on a self-motion")
        listed = _listed(setting, measured, goal, wanted, pose, kind, as_written, effort)
    except (NotConfined, Unsolved, TooLarge, MissingExtra) as error:
        return _searched(setting, measured.question, goal, pose, kind, error.reason)
    moving = not listed.found.complete and not as_written and any(
        mode.configuration is not None and _moves(setting, measured.question, mode.configuration)
        for mode in listed.modes)
    if not moving and not listed.found.open:
        return listed
    why = ("some of the solutions lie on a self-motion" if moving else "the equations depend on each other"
           if listed.found.continuum is not None else str(listed.found.degenerate))
    found = _searched(setting, measured.question, goal, pose, kind, why)
    return found if moving or not any(mode.proved for mode in listed.modes) else replace(listed, motions=found.motions)


def _formed(setting: ObservedRobot, where: object, real: bool) -> AssemblyModes:
    """The modes of a formation; refuses poses and motors, which are those of one platform."""
    if where is not None or real:
        raise BadRequest(f"{setting.robot.name}: poses and motors are those of one platform, and this is a formation",
                         "real" if real else str(where),
                         "nothing: what is measured at the file's configuration is held")
    tell("modes")
    found, goal = formed(setting), setting.everything.start
    system = SystemModes(found.complex, (), found.complete, found.proof, degenerate=found.degenerate,
                         continuum=found.continuum, bound=found.bound)
    first = setting.samples.question.platform
    listed = list[AssemblyMode]()
    for each in found.modes:
        at = each.configuration
        whole = Assembly(at, (), tuple(outside(at.twin, at.q)))
        listed.append(AssemblyMode(
            Pose.of(each.bodies[first]), np.inf, np.pi, each.residual, at is goal, whole.reachable, None, whole.verdict,
            (), whole.beyond, (), at, proved=found.complete, length=goal.twin.length, bodies=each.bodies,
            opposite=each.opposite))
    return AssemblyModes(setting, "formation", goal, Pose.of(goal.pose(first)), system,
                         tuple(mode for mode in listed if not mode.opposite), (), formation=found.formation,
                         antipodal=tuple(mode for mode in listed if mode.opposite))


def at_mode(listed: AssemblyModes | None, asked: ModeNumber) -> ClosedConfiguration:
    """The robot assembled at one of its modes, its coordinates counted from the zero configuration; raises
    ``BadRequest``, ``PoseNotReached``."""
    assert listed is not None
    name, count = listed.setting.robot.name, len(listed.modes)
    if not 1 <= asked.number <= count:
        raise BadRequest(f"{name}: a mode at {listed.pose}", str(asked),
                         f"mode:1 to mode:{count}" if count else "no mode" if listed.found.continuum is None else
                         "poses that are no continuum")
    mode = listed.modes[asked.number - 1]
    at = listed.goal if mode.goal else mode.configuration
    if at is None:
        raise PoseNotReached(name, f"{asked} ({mode.pose})", 0.0, str(listed.pose), reason="the robot was not found "
                             f"assembled there without leg {', '.join(mode.open)}")
    return at if at.twin is listed.goal.twin else of_links(listed.goal.twin, at.pose)


def _moves(setting: ObservedRobot, question: Measurement, at: ClosedConfiguration) -> bool:
    """Whether a closing lies on a self-motion that can be followed."""
    return leaves_free(at, question) and self_motion(at, question, moved(setting.anatomy)) is not None


def _searched(setting: ObservedRobot, question: Measurement, goal: ClosedConfiguration, pose: Pose, kind: str,
              reason: str) -> AssemblyModes:
    """The modes that a search finds, and why there is no list that could be complete."""
    done = search(goal, question, moved(setting.anatomy))
    size = max((motion.dimension for motion in done.motions), default=None)
    found = SystemModes(None, (), False, f"{done.words}; not counted: {reason}", degenerate=done.degenerate,
                        continuum=size)
    return AssemblyModes(setting, kind, goal, pose, found,
                         tuple(_closed(setting, question, mode, mode.configuration is goal) for mode in done.modes),
                         (), motions=done.motions)


def _closed(setting: ObservedRobot, question: Measurement, mode: FoundMode, goal: bool) -> AssemblyMode:
    """A closing that was found, as a mode of which nothing is proved."""
    at, motion = mode.configuration, setting.motion
    beyond = tuple(outside(at.twin, at.q))
    found = Assembly(at, (), beyond)
    return AssemblyMode(motion.pose(at.pose(motion.link)), np.inf, np.pi, mode.residual, goal, found.reachable,
                        weakest(at, question), found.verdict, (), beyond, (), at, length=at.twin.length,
                        bodies=mode.bodies, behind=behind(question.observations, at.pose))


def _listed(setting: ObservedRobot, measured: MeasuredRobot, goal: ClosedConfiguration, wanted: Task | None,
            pose: Pose, kind: str, as_written: bool, effort: float) -> AssemblyModes:
    """The modes as the solutions of the system that the tips' curves and surfaces give, or else of the conditions that
    the legs' joints give."""
    reasons, large = list[NotConfined | Unsolved | TooLarge | MissingExtra](), None
    answers = list[tuple[TipLoci | None, Model, SystemModes]]()
    exact, better = drift(goal, wanted, setting.normal.moved), None
    free = uncoupled(measured, goal)
    tips, asked = partial(_of_tips, as_written=as_written, effort=effort), partial(_of_conditions, effort=effort)
    ways = ((tips, asked, _of_loops, _of_carrier, _of_single) if free is None else
            (_of_loops, tips, asked, _of_carrier, _of_single))
    for listed in ways:
        if better is not None and listed not in better:
            continue
        if listed is not _of_loops and not setting.anatomy.decided:
            reasons.append(NotConfined(setting.robot.name, "joints inside its platform allow several poses of it"))
            continue
        try:
            answers.append(listed(*((measured, goal) if free is None or listed is _of_loops else free), exact))
        except (NotConfined, Unsolved, TooLarge, MissingExtra) as error:
            reasons.append(error)
            large = error if listed is _of_loops and isinstance(error, Unsolved) else large
        else:
            if answers[-1][2].complete:
                better = () if better else _better(answers[-1][1])
    if not answers:
        raise large or reasons[0]
    # what is measured leaves no freedom: a continuum is that of legs which tips alone do not show
    confined, made, found = max(answers, key=lambda each: (each[2].complete, each[2].continuum is None,
                                                           not _better(each[1])))
    if free is not None and made.closing is None:
        found = replace(found, proof=f"without couplings, which can only rule poses out: {found.proof}")
    reader = _ModeReader(setting, measured.question if free is None else free[0].question, goal, made)
    at_goal = min(found.modes, key=reader.away, default=None)
    ordered = sorted(found.modes, key=lambda mode: mode is not at_goal)
    read = [reader.read(mode, mode is at_goal) for mode in ordered]
    near = [reader.read(mode, False) for mode in found.near]
    return AssemblyModes(setting, kind, goal, pose, found, tuple(mode for mode in read if not mode.opposite),
                         tuple(mode for mode in near if not mode.opposite), confined, made,
                         antipodal=tuple(mode for mode in read if mode.opposite))


def uncoupled(measured: MeasuredRobot, goal: ClosedConfiguration) -> tuple[MeasuredRobot, ClosedConfiguration] | None:
    """The robot without its couplings, at the same place, and with what is measured held: so are joints that couplings
    tie to motors that are held. It has all modes of the robot, and those at which couplings cannot be closed besides.
    None where it has no couplings, sees less than all freedoms without them, or what is measured is of joints that are
    one without them."""
    mechanism, setting = goal.twin.mechanism, measured.setting
    if not mechanism.couplings:
        return None
    held = {each.joint for each in measured.question.observations if isinstance(each, Encoder)}
    ties = [{mechanism.carrier(each, link).name for link in (each.predecessor, each.successor)}
            for each in mechanism.couplings]
    tied = set(held)
    while more := set().union(*(tie for tie in ties if tie & tied)) - tied:
        tied |= more
    try:
        loose = ObservedRobot.of(replace(setting.mechanism, couplings=(), observations=()))
        at = of_links(PinocchioModel(loose.mechanism, goal.twin.length), goal.pose)
    except HrsynthError:
        return None
    links, joints = loose.mechanism.links, loose.mechanism.joints
    if not tied <= joints.keys() or any(link not in links for each in measured.question.observations
                                        for link in (each.link, each.seen_from or each.link)):
        return None  # without couplings what they hold apart is one joint
    of = {name: leg.label for leg in loose.anatomy.legs for name in leg.joints}
    seen = (*measured.question.observations, *(each for name in sorted(tied - held) for each in encoders(
        loose.mechanism, loose.mechanism.joints[name], of.get(name, ""))))
    found = MeasuredRobot(loose, loose.measuring(seen))
    return (found, at) if found.rank == loose.dof and loose.anatomy.labels == setting.anatomy.labels else None


def _better(made: Model) -> tuple[Any, ...]:
    """Ways that may count complex modes too where a list is that of a part of the conditions on the pose, as the sense
    of an axis is told besides."""
    system = made.system
    senses = sum(isinstance(c, AtAngle) and c.h == 1.0 for c in getattr(system, "conditions", ()))
    if not isinstance(system, PosedPlatform) or not senses:
        return ()
    few = len(system.conditions) - senses <= system.poses.freedoms
    return (_of_loops, _of_carrier) if few else (_of_loops,)


def _of_tips(measured: MeasuredRobot, goal: ClosedConfiguration, exact: float, as_written: bool,
             effort: float) -> tuple[TipLoci, Model, SystemModes]:
    confined, seen = all_loci(measured, goal)
    # a curve that was fitted to a leg's moves is not known to hold its exact tip
    fitted = confined.doubt is not None or any(tip.doubt is not None for tip in confined.tips)
    confined = replace(confined, error=np.inf if fitted else max([exact, *(each.error(exact, goal) for each in seen)])
                       + max([*(tip.moved for tip in confined.tips), *(angle.moved for angle in confined.angles)]),
                       as_written=as_written)
    return confined, *solve_all(confined, effort=effort)


def _of_conditions(measured: MeasuredRobot, goal: ClosedConfiguration, exact: float, effort: float
                   ) -> tuple[None, Model, SystemModes]:
    return None, *solve_posed(measured, goal, exact, effort)


def _of_carrier(measured: MeasuredRobot, goal: ClosedConfiguration, exact: float) -> tuple[None, Model, SystemModes]:
    return None, *solve_carried(measured, goal, exact)


def _of_single(measured: MeasuredRobot, goal: ClosedConfiguration, exact: float) -> tuple[None, Model, SystemModes]:
    return None, *solve_loop(measured, goal, exact)


def _of_loops(measured: MeasuredRobot, goal: ClosedConfiguration, exact: float) -> tuple[None, Model, SystemModes]:
    return None, *solve_loops(measured, goal, exact)


def expected(measured: MeasuredRobot, at: ClosedConfiguration) -> int:
    """How many modes, complex ones too, the degrees of the legs' conditions allow; the largest number where these are
    not known."""
    try:
        return most_posed(measured, at)
    except (NotConfined, Unsolved):
        return sys.maxsize


def counted(measured: MeasuredRobot, at: ClosedConfiguration) -> SystemModes:
    """The modes with the measurements at a configuration, without near ones, and not read as poses of the robot's legs:
    as :func:`modes`, for many configurations of one robot that sees all its freedoms."""
    found = None
    if measured.pattern.motion != "oriented":
        with suppress(NotConfined, Unsolved, TooLarge, MissingExtra):
            found = solve_all(all_loci(measured, at)[0], near=False)[1]
    if found is not None and found.complete:
        return found
    try:
        return solve_posed(measured, at)[1]
    except (NotConfined, Unsolved):
        if found is None:
            raise
        return found


class _ModeReader:
    """Poses of a system read as poses of the robot."""

    def __init__(self, setting: ObservedRobot, question: Measurement, goal: ClosedConfiguration, made: Model) -> None:
        self.question, self.motion, self.made, self.goal = question, setting.motion, made, goal
        self.assembler = Assembler(setting.anatomy, goal.twin.length, question.reference)
        rest, self.seen = sights(setting.anatomy, question, goal)
        self.measured = Held.at(goal.twin, goal.q, question.reference, rest.observations).measured

    def away(self, mode: SystemMode) -> float:
        """How far a mode is from the goal (characteristic lengths, differences of rotation matrices)."""
        return max(pose_difference(X, self.goal.pose(body), self.goal.twin.length)
                   for body, X in self.made.bodies(mode.q).items())

    def read(self, mode: SystemMode, nearest: bool) -> AssemblyMode:
        """What a mode is for the robot; of all modes the ``nearest`` to the goal can be it."""
        bodies, size = self.made.bodies(mode.q), self.goal.twin.length
        at_goal = nearest and self.away(mode) <= SAME_RELATION
        near = mode.near
        held = () if near else self.measured
        scale = self.made.system.size / size
        base = self.goal.twin.mechanism.base
        pose = {base: self.goal.pose(base), **bodies}.__getitem__
        antipodal = opposite([each.seen for each in self.seen], self.goal, self.question.reference, pose)
        found = Assembly(self.goal)
        if antipodal:  # no mode: whether the robot can be assembled is not asked
            found = Assembly(None, platform=self.assembler.platform(bodies))
        elif self.made.closing is not None:
            at = self.made.closing(mode.q)
            found = Assembly(at, (), tuple(outside(at.twin, at.q)), held=True)
        elif not at_goal or near or outside(self.goal.twin, self.goal.q):
            found = self.assembler.at(bodies, held, 0.0 if near else self.known(mode))
        if found.configuration is not None and self.made.closing is None and not self.geared(found.configuration):
            found = Assembly(None, self.assembler.anatomy.labels, platform=self.assembler.platform(bodies))
        X = (found.platform[self.motion.link] if found.platform is not None else self.goal.pose(self.motion.link)
             if found.configuration is None else found.configuration.pose(self.motion.link))
        shift, turn = self.radius(mode, bodies, X)
        return AssemblyMode(
            self.motion.pose(X), shift, turn, mode.residual * scale, at_goal, found.reachable,
            None if found.configuration is None else weakest(found.configuration, self.question),
            found.verdict, found.open, found.beyond, found.misses, found.configuration, mode.multiplicity,
            mode.proved, mode.rounded, mode.residual * scale if mode.fits else None,
            () if self.motion.link in bodies else tuple(bodies), size, bodies,
            antipodal, behind([each.seen for each in self.seen], pose))

    def geared(self, at: ClosedConfiguration) -> bool:
        """Whether couplings close where legs do."""
        if not self.goal.twin.mechanism.couplings:
            return True
        try:
            whole = of_links(self.goal.twin, at.pose)
        except LoopsNotClosed:
            return False
        return all(pose_difference(whole.pose(link), at.pose(link), at.twin.length) <= SAME_RELATION
                   for link in at.twin.mechanism.links)

    def known(self, mode: SystemMode) -> float:
        """How far the bodies' exact poses can be from the system's (characteristic lengths, radians); 0 where nothing
        was proved of them: the told poses are meant."""
        length = self.goal.twin.length
        found = max(mode.shift / length, mode.turn) + self.made.system.error / length
        return found if np.isfinite(found) else 0.0

    def radius(self, mode: SystemMode, bodies: dict[str, Array], X: Array) -> tuple[float, float]:
        """How far the exact pose can be from the pose X (4, 4) that is told (m, rad): the system's, with what its frame
        at the goal may be off, and what the told pose is from the system's; of the bodies where X is none of theirs."""
        first, error = next(iter(bodies.values())), self.made.system.error
        shift, turn = mode.shift + error, mode.turn + error / self.goal.twin.length
        told = bodies.get(self.motion.link)
        if told is None:
            return shift, turn
        lever = float(np.linalg.norm(told[:3, 3] - first[:3, 3]))
        if self.made.back:  # the base's turn, as the platform sees it, is about a point of the platform
            lever += float(np.linalg.norm(told[:3, 3] - self.goal.pose(self.motion.link)[:3, 3]))
        return (shift + turn * lever + float(np.linalg.norm(X[:3, 3] - told[:3, 3])),
                turn + float(np.linalg.norm(X[:3, :3] - told[:3, :3])))
