"""Which legs to watch for one displacement (MMT A.2): all sets, ranked by where else the loop may end and by the
accuracy at the goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, islice
from typing import Annotated, NamedTuple, TypedDict

import numpy as np

from ..analysis.accuracy.accuracy import errors_at
from ..analysis.accuracy.measurement_bounds import Cones, MeasurementBounds, unseen
from ..analysis.accuracy.pose_errors import PoseErrors
from ..analysis.analysis_declaration import analysis
from ..analysis.aspects.path import PathPlanner
from ..analysis.aspects.verdicts import SEPARATED
from ..analysis.configuration_report import ConfigurationAnalysis, ConfigurationReport
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.observed import (
    UNLIMITED,
    CameraLike,
    LegsLike,
    NoiseLike,
    ObservedRobot,
    RobotLike,
    Seed,
    SeeLike,
    StartPose,
)
from ..analysis.pose_requests import configurations_at
from ..analysis.verdict import CONTROLLABLE, verdict_of
from ..budgets import AXIS_SEEN, SELECT_ROUNDS
from ..errors import BadRequest, HrsynthError
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.limits import outside
from ..mechanism.observation import labels_of
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.pose import Pose, PoseLike, asked_pose
from ..options import option, options_of, require_range
from ..progress import part, report
from ..records import DEG, MM, As, Number, Record, Recorded, Shown, Word, recorded
from ..results import Compared, Result, Value, by_name
from ..simulation.camera import cylinders, place_camera
from ..simulation.equilibria.equilibria import EquilibriumSearch
from ..simulation.equilibria.search import starts
from ..simulation.outcome import GOAL
from ..simulation.servo import servo
from .loop_ends import LoopEnds, fewer_are_better
from .sight import CameraView, camera_at, of_focal

BUDGET = 2_000
"""Intervals that a path's certificate may take."""
CONE = "0.1deg"
"""Half-angle of the cones about directions where nothing is said."""
FOCAL = 800.0
"""Focal length of the camera (pixels)."""
AUTO = "auto"
TYPES = {
    "type1": "a Type 1 singularity",
    "type2": "a Type 2 singularity",
    "type3": "a Type 3 singularity",
    "constraint": "a constraint singularity",
    "undecided": "too close to a singularity to decide",
}


@dataclass(frozen=True)
class Criteria:
    """The criteria of :func:`select`, which takes each of them by its name. Raises ``BadRequest``."""

    size: Annotated[int, option("Largest number of legs in a set.", low=1)] = 4
    """Legs of the largest sets."""
    examine: Annotated[
        int,
        option("For how many sets, the most accurate first, to compute modes, aspects and runs.", low=1),
    ] = 20
    """Sets, the most accurate first, of which modes and aspects are asked."""
    runs: Annotated[int, option("How many sets, best first, must pass a simulated run.", low=0)] = 3
    """Sets that a simulated run is to lead to the goal."""
    equilibria: Annotated[
        int,
        option(
            "For how many of the examined sets, the most accurate first, to compute where else the loop may end.",
            low=0,
        ),
    ] = 20
    """Sets, of those that are examined and the most accurate first, whose endings are sought."""
    visible_from: Annotated[
        str | None,
        option(
            "Pose of the camera on the link that carries it (x right, y down, z ahead), such as "
            "x=0,y=0,z=0.5,rpy=180deg/0/0; or auto.",
            "POSE",
        ),
    ] = None
    """The pose of a camera on the link that carries it, or ``auto`` for one that sees all legs well."""
    focal: Annotated[float, option("Focal length of the camera, for pictures of 640 × 480 pixels.", "PIXELS")] = FOCAL
    """Its focal length (pixels)."""

    def __post_init__(self) -> None:
        if self.visible_from is None and self.focal != FOCAL:
            raise BadRequest("focal length without a camera", self.focal, "together with --visible-from")
        for each in options_of(Criteria):
            if each.kind is int:
                require_range(each.name, getattr(self, each.name), "an integer", each.low, each.high)


@dataclass(frozen=True)
class ModeCount(Record):
    """How many assembly modes, near ones too, there are with the directions of a pose, in how many of them the robot
    was found assembled, and whether these are proved to be all; ``why`` they are not listed, otherwise empty."""

    count: Recorded[int | None]
    reachable: Recorded[int | None]
    complete: Recorded[bool]
    why: str = ""

    @classmethod
    def of(cls, found: AssemblyModes) -> ModeCount:
        """Of a list of modes."""
        alike = (*found.modes, *found.near_modes)
        return cls(len(alike), sum(mode.reachable is True for mode in alike), found.found.complete)

    reason = Shown(str | None, lambda self: self.why or None)


@dataclass(frozen=True, eq=False, repr=False)
class Decision(Compared, all_recorded=True):
    """A verdict in a word, and its reason."""

    verdict: str
    reason: str


class EndCounts(NamedTuple):
    """The modes of the two ends; null if they were not requested."""

    start: ModeCount | None
    goal: ModeCount | None


@dataclass(frozen=True, eq=False, repr=False)
class Candidate(Value):
    """What is known about a set of legs; None for what was not computed, because the set was discarded before or was
    not ``examined``: then it is neither kept nor discarded."""

    legs: Recorded[tuple[str, ...]]
    verdict: Annotated[str, Word]
    discarded: Recorded[str | None] = None
    errors: PoseErrors | None = None
    seen: Recorded[Mapping[str, float] | None] = None
    """The least part of each of its legs that the camera sees at start and goal, after a run all along it."""
    start_modes: ModeCount | None = None
    goal_modes: ModeCount | None = None
    aspect: Recorded[Decision | None] = None
    equilibria: Annotated[LoopEnds | None, As("equilibria")] = None
    run: Recorded[Decision | None] = None
    examined: Recorded[bool] = True

    @property
    def rank(self) -> tuple[float, ...]:
        """What the best of the examined sets has least of: other poses that attract, certified radius, then ``order``;
        sets whose endings were not sought come last."""
        return (*(LoopEnds(None, None) if self.equilibria is None else self.equilibria).order, *self.order)

    @property
    def order(self) -> tuple[float, float, int]:
        """What the best set has least of: position error, orientation error, legs."""
        if self.errors is None:
            return np.inf, np.inf, len(self.legs)
        return self.errors.position.largest, self.errors.orientation.largest, len(self.legs)

    position_mm = Shown(Number, lambda self: self.errors and self.errors.position.largest, As(scale=MM))
    position_gap = Shown(Number, lambda self: self.errors and self.errors.position.gap)
    orientation_deg = Shown(Number, lambda self: self.errors and self.errors.orientation.largest, As(scale=DEG))
    orientation_gap = Shown(Number, lambda self: self.errors and self.errors.orientation.gap)
    modes = Shown(EndCounts, lambda self: EndCounts(self.start_modes, self.goal_modes))


class SightRecord(NamedTuple):
    """A camera: the link that carries it, its pose in the link's frame, its focal length (pixels)."""

    link: str
    pose: Annotated[Array, list[list[float]]]
    focal: float


class Unexamined(TypedDict):
    """How many sets were not examined, and why."""

    count: int
    reason: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Selection(Result, shown_as="select"):
    """All sets of legs up to a size for one displacement: the kept ones by their ``rank``, those not examined, the most
    accurate at the goal first, then the discarded ones."""

    setup: Annotated[ObservedRobot, As(flat=True, without=("observed",))]
    start: Recorded[Pose]
    goal: Recorded[Pose]
    candidates: Annotated[tuple[Candidate, ...], As("sets")]
    bounds: MeasurementBounds
    """How wrong each measurement may be."""
    visible_from: CameraView | None
    left: str | None
    """Why sets were not examined, None where all were."""

    def headline(self) -> str:
        """The robot, and the set that is best."""
        best = f"best {', '.join(self.kept[0].legs)}" if self.kept else "none is kept"
        more = f", {len(self.unexamined)} not examined" if self.unexamined else ""
        return f"{self.setup.robot.name}: {len(self.candidates)} sets, {len(self.kept)} kept{more}, {best}"

    @property
    def kept(self) -> tuple[Candidate, ...]:
        """The sets that were examined and not discarded."""
        return tuple(each for each in self.candidates if each.examined and each.discarded is None)

    @property
    def unexamined(self) -> tuple[Candidate, ...]:
        """The sets for which it is not known whether they would be kept."""
        return tuple(each for each in self.candidates if not each.examined)

    @property
    @recorded()
    def fewer(self) -> str | None:
        """Why the best set serves better than one with more legs, None if that is not seen."""
        known = [(each.legs, each.equilibria) for each in self.kept if each.equilibria is not None]
        return fewer_are_better(known[0], known[1:]) if known and known[0][0] == self.kept[0].legs else None

    @property
    @recorded(As("cones"))
    def cones_record(self) -> dict[str, float]:
        """The half-angles of the cones by leg, in degrees."""
        angles = np.degrees(self.bounds.cones).tolist()
        return {o.leg: cone for o, cone in zip(self.setup.observed, angles, strict=True) if cone}

    @property
    @recorded(As("sight"))
    def sight_record(self) -> SightRecord | None:
        """The camera; None where none was asked for."""
        eye = self.visible_from
        return None if eye is None else SightRecord(eye.reference, eye.camera.place, eye.camera.focal)

    noise = Shown(dict[str, float], lambda self: self.bounds.amounts, "by its unit (px, m, rad)")
    best = Shown(list[str] | None, lambda self: self.kept[0].legs if self.kept else None)
    not_examined = Shown(Unexamined, lambda self: {"count": len(self.unexamined), "reason": self.left})
    limits_ignored = Shown(list[str], lambda self: self.setup.limits_ignored, UNLIMITED)


@analysis(
    140,
    examples=("quattro --start x=0.1 --goal x=-0.05,phi=20deg",),
    cones="cone",
)
@by_name(Criteria, "criteria")
def select(
    robot: RobotLike,
    camera: CameraLike = None,
    *,
    observe: LegsLike = None,
    sensor: SeeLike = None,
    start: StartPose,
    goal: Annotated[PoseLike, option("Goal pose.", "POSE")],
    cone: Annotated[
        Cones | None,
        option(
            "Half-angle of the cone about each direction, or one per leg: 1=0.1deg,2=0.2deg,… (default: 0.1deg).",
            "ANGLE",
        ),
    ] = None,
    noise: NoiseLike = None,
    criteria: Criteria,
    seed: Seed = 0,
) -> Selection:
    """Which legs to watch for a motion from start to goal: all sets, ranked by where else the loop may end and by
    accuracy, and why the others are discarded.

    All sets of legs, or of what is observed, for the displacement from ``start`` to ``goal``, ranked by how many
    poses besides the goal were found to attract the loop, by the certified radius (radii within one power of two are
    equal), then by the largest position error at the goal for cones about the directions (``cone``: the half-angle for
    all, or one per leg, by default 0.1°; MMT A.2) and ``noise`` of other observations (as ``0.3px,1mm,0.1deg``).

    The fields of :class:`Criteria` can be given by their names: ``size``, ``examine``, ``endings``, ``runs``,
    ``visible_from``, ``focal``. The sets are those of the legs or links ``observe`` and of what else the file or
    ``sensor`` observes, by default of all legs. A set is discarded if it does not see every freedom, if an end is
    singular or beyond joint limits, or something is behind its camera there, if the camera (``sight``) sees too little
    of a leg, if start and goal are proved to lie in different aspects, or if a simulated run ends elsewhere. Modes,
    aspects and endings are computed for the ``examine`` most accurate sets (endings for ``endings`` of them; the radius
    only for directions of segments); the others are neither kept nor discarded. Runs are made from the best set on,
    until ``runs`` of them have ended at the goal.

    Raises ``BadRequest``, ``PoseNotReached``.

    >>> hrsynth.select("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=0")
    <Selection: 3rrr_m1: 7 sets, 1 kept, best 1, 2, 3>
    """
    wanted = [asked_pose(each) for each in (start, goal)]
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).telling(wanted)
    others = not all(o.by_segment for o in setup.observed)
    if others and criteria.visible_from is not None:
        setup.by_segments("select with --visible-from")
    if observe is None and not others:
        setup = replace(setup, observed=setup.all_legs)
    directed = any(isinstance(o, SeenAxis) for o in setup.observed)
    blur = MeasurementBounds.of(
        CONE if cone is None and directed and (noise is None or not others) else cone, noise, setup.observed
    )
    ends = configurations_at(setup, wanted)
    work = _Work(
        setup,
        ends[0],
        ends[1],
        blur,
        _sight(setup, ends, criteria),
        criteria,
        seed,
    )
    labels = labels_of(setup.observed)
    sets = [legs for count in range(1, min(criteria.size, len(labels)) + 1) for legs in combinations(labels, count)]
    looked = []
    for number, legs in enumerate(sets, 1):
        with part(f"set {number} of {len(sets)}"):
            looked.append(work.first(legs))
    found, left = work.examine(sorted(looked, key=lambda each: each.order))
    found.sort(
        key=lambda each: (
            each.discarded is not None,
            not each.examined,
            () if each.discarded is not None else each.rank,
        )
    )
    poses = [setup.motion.pose(at.pose(setup.motion.link)) for at in ends]
    return Selection(setup, poses[0], poses[1], tuple(found), blur, work.sight, left)


def _sight(setup: ObservedRobot, ends: Sequence[ClosedConfiguration], criteria: Criteria) -> CameraView | None:
    if criteria.visible_from is None:
        return None
    rods = cylinders(setup.mechanism, setup.observed)
    reference = setup.mechanism.reference
    camera = (
        place_camera(rods, reference, [at.pose for at in ends], of_focal(criteria.focal))
        if criteria.visible_from == AUTO
        else camera_at(criteria.visible_from, criteria.focal)
    )
    return CameraView(camera, reference, {o.leg: rod for o, rod in zip(setup.observed, rods, strict=True)})


@dataclass(frozen=True, eq=False)
class _Work:
    """What examines sets of legs between two configurations; none is begun after a point in time."""

    setup: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    blur: MeasurementBounds
    sight: CameraView | None
    criteria: Criteria
    seed: int

    def watching(self, legs: Sequence[str]) -> ObservedRobot:
        """The setting with some of what is observed."""
        return replace(self.setup, observed=tuple(o for o in self.setup.observed if o.leg in legs))

    def first(self, legs: tuple[str, ...]) -> Candidate:
        """What is quickly said of a set: verdict, singular ends, sight, accuracy."""
        report("accuracy")
        setup = self.watching(legs)
        try:
            verdict = verdict_of(setup, legs, setup.samples)
            if verdict.verdict != CONTROLLABLE:
                lost = f", not seen: {verdict.named}" if verdict.unobserved else ""
                return Candidate(legs, verdict.verdict, verdict.verdict + lost)
            analysis = ConfigurationAnalysis.of(setup)
            ends = (("start", self.start), ("goal", self.goal))
            behind = [(name, unseen(at, setup.samples.observation_model)) for name, at in ends]
            reasons = [f"{o.kind} {o.leg} is not in front of its camera at the {name}" for name, o in behind if o]
            if reasons:
                return Candidate(legs, verdict.verdict, reasons[0])
            reasons = [
                f"the {name} is beyond the limits of {', '.join(joints)}"
                for name, at in ends
                if (joints := outside(at.model, at.q))
            ]
            reasons += [reason for name, at in ends if (reason := _singular_at(name, analysis.classify(at)))]
        except HrsynthError as error:
            return Candidate(legs, "undecided", str(error))
        blur = self.blur.select([i for i, o in enumerate(self.setup.observed) if o.leg in legs])
        found = Candidate(legs, verdict.verdict, next(iter(reasons), None), errors_at(setup, blur, self.goal))
        return self.look(found, (self.start, self.goal))

    def look(self, candidate: Candidate, configurations: Sequence[ClosedConfiguration]) -> Candidate:
        """The candidate with what the camera sees of its legs."""
        if self.sight is None or candidate.discarded:
            return candidate
        least = self.sight.least(configurations)
        seen = {leg: least[leg] for leg in candidate.legs}
        worst = min(seen, key=lambda leg: seen[leg])
        why = None if seen[worst] >= AXIS_SEEN else f"the camera sees {100 * seen[worst]:.0f} % of leg {worst}"
        return replace(candidate, seen=seen, discarded=why)

    def decide(self, candidate: Candidate) -> Candidate:
        """The candidate with its modes and whether start and goal lie in one aspect."""
        if candidate.discarded:
            return candidate
        setup = self.watching(candidate.legs)
        report("modes")
        start_modes, goal_modes = self._modes(setup, self.start), self._modes(setup, self.goal)
        report("aspects")
        try:
            answer = PathPlanner.of(setup).join(self.start, self.goal, seed=self.seed, budget=BUDGET)
            aspect = Decision(answer.verdict, answer.reason)
        except HrsynthError as error:
            aspect = Decision("undecided", str(error))
        why = (
            (f"start and goal, with the directions observed at them, lie in different aspects: {aspect.reason}")
            if aspect.verdict == SEPARATED
            else None
        )
        return replace(candidate, start_modes=start_modes, goal_modes=goal_modes, aspect=aspect, discarded=why)

    @staticmethod
    def _modes(setup: ObservedRobot, at: ClosedConfiguration) -> ModeCount:
        try:
            return ModeCount.of(modes(setup, at=at))
        except HrsynthError as error:
            return ModeCount(None, None, False, str(error))

    def examine(self, candidates: Sequence[Candidate]) -> tuple[list[Candidate], str | None]:
        """The candidates, of which as many as are to be examined, best first, have modes, aspects and endings, and from
        the best of these on simulated runs until enough ended at the goal; why the others were left, None where there
        are none."""
        most, runs = self.criteria.examine, self.criteria.runs
        found: list[Candidate] = []
        arrived = begun = 0
        left, every = None, min(most, sum(not each.discarded for each in candidates))
        for candidate in candidates:
            if candidate.discarded:
                found.append(candidate)
                continue
            if left is None and begun == most:
                left = f"the {begun} most accurate were"
            if left is not None:
                found.append(replace(candidate, examined=False))
                continue
            begun += 1
            with part(f"examined set {begun} of {every}"):
                found.append(self.find_endings(self.decide(candidate), begun))
        for place in sorted(range(len(found)), key=lambda i: found[i].rank):
            candidate = found[place]
            if candidate.examined and not candidate.discarded and arrived < runs:
                with part(f"run {arrived + 1} of {runs}"):
                    found[place] = self.ran(candidate)
                arrived += found[place].discarded is None
        return found, left

    def find_endings(self, candidate: Candidate, number: int) -> Candidate:
        """The candidate, the ``number``-th that is examined, with where its loop may end."""
        if candidate.discarded or number > self.criteria.equilibria:
            return candidate
        report("equilibria")
        setup = self.watching(candidate.legs)
        rounds = self.rounds if all(o.by_segment for o in self.setup.observed) else self._rounds(setup)
        return replace(candidate, equilibria=LoopEnds.of(setup, self.goal, rounds))

    @cached_property
    def rounds(self) -> tuple[Array, ...]:
        """Starts from which the endings of all sets of directions are sought."""
        return self._rounds(self.setup)

    def _rounds(self, setup: ObservedRobot) -> tuple[Array, ...]:
        """Starts at which all that a setting observes is in front of its camera."""
        system = EquilibriumSearch.of(setup, self.goal).system
        homes = np.array([system.system.read(at.pose) for at in (self.goal, *setup.configurations)])
        return tuple(islice(starts(system, homes, self.seed, setup), SELECT_ROUNDS))

    def ran(self, candidate: Candidate) -> Candidate:
        """The candidate with where its simulated run ends, and what the camera sees along it."""
        motion, mechanism = self.setup.motion, self.setup.mechanism
        start, goal = (motion.pose(at.pose(motion.link)) for at in (self.start, self.goal))
        camera = None if mechanism.reference == mechanism.base else mechanism.reference
        try:
            found = (
                servo(self.setup.robot, candidate.legs, camera, start=start, goal=goal, seed=self.seed)
                if all(o.by_segment for o in self.setup.observed)
                else servo(self.watching(candidate.legs), start=start, goal=goal, seed=self.seed)
            )
        except HrsynthError as error:
            return replace(candidate, run=Decision("refused", str(error)), discarded=f"the run is refused: {error}")
        run = Decision(found.outcome, found.run_outcome.reason)
        if found.outcome != GOAL:
            return replace(candidate, run=run, discarded=f"the simulated run ends in: {found.outcome} ({run.reason})")
        return self.look(replace(candidate, run=run), found.run.configurations)


def _singular_at(name: str, posture: ConfigurationReport) -> str | None:
    """Why a set is discarded whose hidden robot is singular at the start or the goal, None where it is regular."""
    kind = TYPES.get(posture.hidden.state)
    return None if kind is None else f"the {name} is {kind}"
