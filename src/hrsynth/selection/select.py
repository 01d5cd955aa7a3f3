"""Ranking of sets of observed legs for one displacement (MMT A.2), by other stable equilibria and by accuracy at the
goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, islice
from typing import Annotated, NamedTuple, TypedDict

import numpy as np

from ..analysis.accuracy.accuracy import compute_errors_at
from ..analysis.accuracy.measurement_bounds import Cones, MeasurementBounds, find_invisible
from ..analysis.accuracy.pose_errors import PoseErrors
from ..analysis.analysis_declaration import analysis
from ..analysis.aspects.path import PathPlanner
from ..analysis.aspects.verdicts import SEPARATED
from ..analysis.configuration_report import ConfigurationAnalysis, ConfigurationReport
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.observation_inputs import CameraLike, LegsLike, NoiseLike, Seed, SensorLike, StartPose
from ..analysis.observed import ObservedRobot, RobotLike
from ..analysis.pose_requests import solve_configurations
from ..analysis.setup_records import LIMITS_IGNORED
from ..analysis.verdict import CONTROLLABLE, compute_verdict
from ..errors import BadRequest, HrsynthError
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.limits import list_joints_beyond
from ..mechanism.observation import list_labels
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.pose import Pose, PoseLike, parse_pose
from ..options import list_options, option, require_range
from ..progress import report, report_part
from ..records import DEG, MM, As, Number, Record, Recorded, Shown, Word, recorded
from ..results import ComparableValue, Result, Value, by_name
from ..simulation.camera import cylinders, place_camera
from ..simulation.equilibria.equilibria import EquilibriumSearch
from ..simulation.equilibria.search import starts
from ..simulation.outcome import GOAL
from ..simulation.servo import servo
from .loop_ends import LoopEnds, explain_smaller_set
from .sight import CameraView, make_camera, parse_camera_pose

SELECT_EQUILIBRIUM_ROUNDS_COUNT = 4
"""Rounds for each set of legs of which the best is selected."""
VISIBLE_AXIS_MIN_FRACTION = 0.5
"""Fraction of a leg's axis that must be visible."""

SELECT_PATH_INTERVALS_MAX = 2_000
"""Largest number of intervals of a path's certificate."""
CONE = "0.1deg"
"""Default half-angle of the cones about directions."""
SELECT_FOCAL_PIXELS_COUNT = 800.0
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
    """Criteria of :func:`select`, which takes each of them by its name. Raises ``BadRequest``."""

    size: Annotated[int, option("Largest number of legs in a set.", low=1)] = 4
    """Legs of the largest sets."""
    examine: Annotated[
        int,
        option("Number of sets, most accurate first, for which modes, aspects and runs are computed.", low=1),
    ] = 20
    """Number of sets, most accurate first, with modes and aspects."""
    runs: Annotated[int, option("Number of sets, best first, that must pass a simulated run.", low=0)] = 3
    """Number of sets that must pass a simulated run."""
    equilibria: Annotated[
        int,
        option(
            "Number of examined sets, most accurate first, for which to search for other equilibria.",
            low=0,
        ),
    ] = 20
    """Number of examined sets, most accurate first, with other equilibria."""
    visible_from: Annotated[
        str | None,
        option(
            "Pose of the camera on the link that carries it (x right, y down, z ahead), such as "
            "x=0,y=0,z=0.5,rpy=180deg/0/0; or auto.",
            "POSE",
        ),
    ] = None
    """The pose of a camera on the link that carries it, or ``auto`` for one that sees all legs well."""
    focal: Annotated[float, option("Focal length of the camera, for images of 640 × 480 pixels.", "PIXELS")] = (
        SELECT_FOCAL_PIXELS_COUNT
    )
    """Its focal length (pixels)."""

    def __post_init__(self) -> None:
        if self.visible_from is None and self.focal != SELECT_FOCAL_PIXELS_COUNT:
            raise BadRequest(f"--focal {self.focal:g}: there is no camera", remedy="Give its pose with --visible-from.")
        for each in list_options(Criteria):
            if each.kind is int:
                require_range(each.name, getattr(self, each.name), "an integer", each.low, each.high)


@dataclass(frozen=True)
class ModeCount(Record):
    """Number of assembly modes, near ones included, at the directions of a pose; how many are reachable; whether the
    list is proved complete; ``why`` they are not listed."""

    count: Recorded[int | None]
    reachable: Recorded[int | None]
    complete: Recorded[bool]
    why: str = ""

    @classmethod
    def of(cls, found: AssemblyModes) -> ModeCount:
        """Return the count of a list of modes."""
        alike = (*found.modes, *found.near_modes)
        return cls(len(alike), sum(mode.reachable is True for mode in alike), found.found.complete)

    reason = Shown(str | None, lambda self: self.why or None)


@dataclass(frozen=True, eq=False, repr=False)
class Decision(ComparableValue, all_recorded=True):
    """Verdict and its reason."""

    verdict: str
    reason: str


class EndCounts(NamedTuple):
    """Modes at start and goal; null if they were not requested."""

    start: ModeCount | None
    goal: ModeCount | None


@dataclass(frozen=True, eq=False, repr=False)
class Candidate(Value):
    """Set of legs with its results; None for what was not computed, because the set was discarded or not ``examined``.
    A set that was not examined is neither kept nor discarded."""

    legs: Recorded[tuple[str, ...]]
    verdict: Annotated[str, Word]
    discarded: Recorded[str | None] = None
    errors: PoseErrors | None = None
    seen: Recorded[Mapping[str, float] | None] = None
    """Smallest visible fraction of each leg at start and goal; after a run, along it."""
    start_modes: ModeCount | None = None
    goal_modes: ModeCount | None = None
    aspect: Recorded[Decision | None] = None
    equilibria: Annotated[LoopEnds | None, As("equilibria")] = None
    run: Recorded[Decision | None] = None
    examined: Recorded[bool] = True

    @property
    def rank(self) -> tuple[float, ...]:
        """Sort key of examined sets: other stable equilibria, proved attraction radius, then ``order``; sets without a
        search for equilibria come last."""
        return (*(LoopEnds(None, None) if self.equilibria is None else self.equilibria).order, *self.order)

    @property
    def order(self) -> tuple[float, float, int]:
        """Sort key: position error, orientation error, number of legs."""
        if self.errors is None:
            return np.inf, np.inf, len(self.legs)
        return self.errors.position.largest, self.errors.orientation.largest, len(self.legs)

    position_mm = Shown(Number, lambda self: self.errors and self.errors.position.largest, As(scale=MM))
    position_gap = Shown(Number, lambda self: self.errors and self.errors.position.gap)
    orientation_deg = Shown(Number, lambda self: self.errors and self.errors.orientation.largest, As(scale=DEG))
    orientation_gap = Shown(Number, lambda self: self.errors and self.errors.orientation.gap)
    modes = Shown(EndCounts, lambda self: EndCounts(self.start_modes, self.goal_modes))


class SightRecord(NamedTuple):
    """Camera: link that carries it, pose in the link's frame, focal length (pixels)."""

    link: str
    pose: Annotated[Array, list[list[float]]]
    focal: float


class UnexaminedSets(TypedDict):
    """Number of sets that were not examined, and the reason."""

    count: int
    reason: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Selection(Result, shown_as="select"):
    """Sets of legs up to a size, ranked for one displacement.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    start, goal
        Poses (m, rad, base coordinates).
    candidates
        Sets: the kept ones by rank, those not examined (most accurate first), the discarded ones.
    bounds
        Measurement bounds of the observations.
    visible_from
        Camera, None without one.
    left
        Reason why sets were not examined, None if all were.
    """

    setup: Annotated[ObservedRobot, As(flat=True, without=("observed",))]
    start: Recorded[Pose]
    goal: Recorded[Pose]
    candidates: Annotated[tuple[Candidate, ...], As("sets")]
    bounds: MeasurementBounds
    """Measurement bounds of the observations."""
    visible_from: CameraView | None
    left: str | None
    """Reason why sets were not examined, None if all were."""

    def headline(self) -> str:
        """Robot and best set."""
        best = f"best {', '.join(self.kept[0].legs)}" if self.kept else "none is kept"
        more = f", {len(self.unexamined)} not examined" if self.unexamined else ""
        return f"{self.setup.robot.name}: {len(self.candidates)} sets, {len(self.kept)} kept{more}, {best}"

    @property
    def kept(self) -> tuple[Candidate, ...]:
        """Sets that were examined and not discarded."""
        return tuple(each for each in self.candidates if each.examined and each.discarded is None)

    @property
    def unexamined(self) -> tuple[Candidate, ...]:
        """Sets that were neither kept nor discarded."""
        return tuple(each for each in self.candidates if not each.examined)

    @property
    @recorded()
    def fewer(self) -> str | None:
        """Explanation why the best set ranks above one with more legs, None if it does not."""
        known = [(each.legs, each.equilibria) for each in self.kept if each.equilibria is not None]
        return explain_smaller_set(known[0], known[1:]) if known and known[0][0] == self.kept[0].legs else None

    @property
    @recorded(As("cones"))
    def cones_record(self) -> dict[str, float]:
        """The half-angles of the cones by leg, in degrees."""
        angles = np.degrees(self.bounds.cones).tolist()
        return {o.leg: cone for o, cone in zip(self.setup.observed, angles, strict=True) if cone}

    @property
    @recorded(As("sight"))
    def sight_record(self) -> SightRecord | None:
        """Camera, None without one."""
        eye = self.visible_from
        return None if eye is None else SightRecord(eye.reference, eye.camera.place, eye.camera.focal)

    noise = Shown(dict[str, float], lambda self: self.bounds.amounts, "by its unit (px, m, rad)")
    best = Shown(list[str] | None, lambda self: self.kept[0].legs if self.kept else None)
    not_examined = Shown(UnexaminedSets, lambda self: {"count": len(self.unexamined), "reason": self.left})
    limits_ignored = LIMITS_IGNORED


@analysis(
    140,
    examples=("quattro --start x=0.1 --goal x=-0.05,phi=20deg",),
)
@by_name(Criteria, "criteria")
def select(
    robot: RobotLike,
    camera: CameraLike = None,
    *,
    observe: LegsLike = None,
    sensor: SensorLike = None,
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
    """Legs to observe for a motion from start to goal: sets ranked by other stable equilibria and by accuracy.

    A set is discarded if it leaves platform dof unobserved; if start or goal is singular, beyond joint limits or
    behind a camera; if the camera of ``visible_from`` sees too little of a leg; if start and goal are proved to lie
    in different aspects; or if the outcome of a simulated run is not the goal.

    Parameters
    ----------
    robot
        Mechanism, observed robot, path or name.
    observe, camera, sensor
        As for :func:`hrsynth.observe`; the sets are taken from these observations (default: all legs).
    start, goal
        Poses, such as ``x=0.1,phi=20deg`` (m, rad), in base coordinates.
    cone
        Half-angle of the cones about the directions (rad, or text with ``deg``), for all or one per leg; default 0.1°.
    noise
        Largest errors of other observations, such as ``0.3px,1mm,0.1deg``.
    criteria
        Fields of :class:`Criteria`, also by their names: ``size``, ``examine``, ``equilibria``, ``runs``,
        ``visible_from``, ``focal``.
    seed
        Seed of the random configurations.

    Returns
    -------
    Selection
        Sets: the kept ones by rank, those not examined, the discarded ones with the reason.

    Raises
    ------
    BadRequest
        For invalid options.
    PoseReachFailure
        If start or goal is not reached.

    Notes
    -----
    Rank (MMT A.2): number of stable equilibria found besides the goal; proved attraction radius (radii within one
    power of two are equal); largest position error at the goal. Modes, aspects and equilibria are computed for the
    ``examine`` most accurate sets, the radius for directions of segments only. Runs start with the best set and stop
    after ``runs`` of them have reached the goal.

    Examples
    --------
    >>> hrsynth.select("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=0")
    <Selection: 3rrr_m1: 7 sets, 1 kept, best 1, 2, 3>
    """
    wanted = [parse_pose(each) for each in (start, goal)]
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).printing_like(wanted)
    others = not all(o.is_segment_direction for o in setup.observed)
    if others and criteria.visible_from is not None:
        setup.by_segments("select with --visible-from")
    if observe is None and not others:
        setup = replace(setup, observed=setup.all_legs)
    directed = any(isinstance(o, SeenAxis) for o in setup.observed)
    blur = MeasurementBounds.of(
        CONE if cone is None and directed and (noise is None or not others) else cone, noise, setup.observed
    )
    ends = solve_configurations(setup, wanted)
    work = _Work(
        setup,
        ends[0],
        ends[1],
        blur,
        _place_camera(setup, ends, criteria),
        criteria,
        seed,
    )
    labels = list_labels(setup.observed)
    sets = [legs for count in range(1, min(criteria.size, len(labels)) + 1) for legs in combinations(labels, count)]
    looked = []
    for number, legs in enumerate(sets, 1):
        with report_part(f"set {number} of {len(sets)}"):
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


def _place_camera(setup: ObservedRobot, ends: Sequence[ClosedConfiguration], criteria: Criteria) -> CameraView | None:
    if criteria.visible_from is None:
        return None
    rods = cylinders(setup.mechanism, setup.observed)
    reference = setup.mechanism.reference
    camera = (
        place_camera(rods, reference, [at.pose for at in ends], make_camera(criteria.focal))
        if criteria.visible_from == AUTO
        else parse_camera_pose(criteria.visible_from, criteria.focal)
    )
    return CameraView(camera, reference, {o.leg: rod for o, rod in zip(setup.observed, rods, strict=True)})


@dataclass(frozen=True, eq=False)
class _Work:
    """Examination of sets of legs between two configurations; none is begun after a deadline."""

    setup: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    blur: MeasurementBounds
    sight: CameraView | None
    criteria: Criteria
    seed: int

    def watching(self, legs: Sequence[str]) -> ObservedRobot:
        """Setup with some of the observations."""
        return replace(self.setup, observed=tuple(o for o in self.setup.observed if o.leg in legs))

    def first(self, legs: tuple[str, ...]) -> Candidate:
        """Evaluate the fast criteria of a set: verdict, singular ends, visibility, accuracy."""
        report("accuracy")
        setup = self.watching(legs)
        try:
            verdict = compute_verdict(setup, legs, setup.samples)
            if verdict.verdict != CONTROLLABLE:
                lost = f", not observed: {verdict.named}" if verdict.unobserved else ""
                return Candidate(legs, verdict.verdict, verdict.verdict + lost)
            analysis = ConfigurationAnalysis.of(setup)
            ends = (("start", self.start), ("goal", self.goal))
            behind = [(name, find_invisible(at, setup.samples.observation_model)) for name, at in ends]
            reasons = [f"{o.text} is not in front of its camera at the {name}" for name, o in behind if o]
            if reasons:
                return Candidate(legs, verdict.verdict, reasons[0])
            reasons = [
                f"the {name} is beyond the limits of {', '.join(joints)}"
                for name, at in ends
                if (joints := list_joints_beyond(at.model, at.q))
            ]
            reasons += [reason for name, at in ends if (reason := _explain_singularity(name, analysis.classify(at)))]
        except HrsynthError as error:
            return Candidate(legs, "undecided", str(error))
        blur = self.blur.select([i for i, o in enumerate(self.setup.observed) if o.leg in legs])
        found = Candidate(legs, verdict.verdict, next(iter(reasons), None), compute_errors_at(setup, blur, self.goal))
        return self.look(found, (self.start, self.goal))

    def look(self, candidate: Candidate, configurations: Sequence[ClosedConfiguration]) -> Candidate:
        """The candidate with what the camera sees of its legs."""
        if self.sight is None or candidate.discarded:
            return candidate
        least = self.sight.least(configurations)
        seen = {leg: least[leg] for leg in candidate.legs}
        worst = min(seen, key=lambda leg: seen[leg])
        why = (
            None
            if seen[worst] >= VISIBLE_AXIS_MIN_FRACTION
            else f"the camera sees {100 * seen[worst]:.0f} % of leg {worst}"
        )
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
            answer = PathPlanner.of(setup).join(self.start, self.goal, seed=self.seed, budget=SELECT_PATH_INTERVALS_MAX)
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
        """Examine the candidates, best first: modes, aspects, equilibria, then simulated runs until enough reach the
        goal. Also return why others were not examined, None without any."""
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
            with report_part(f"examined set {begun} of {every}"):
                found.append(self.find_endings(self.decide(candidate), begun))
        for place in sorted(range(len(found)), key=lambda i: found[i].rank):
            candidate = found[place]
            if candidate.examined and not candidate.discarded and arrived < runs:
                with report_part(f"run {arrived + 1} of {runs}"):
                    found[place] = self.ran(candidate)
                arrived += found[place].discarded is None
        return found, left

    def find_endings(self, candidate: Candidate, number: int) -> Candidate:
        """The candidate, the ``number``-th that is examined, with where its loop may end."""
        if candidate.discarded or number > self.criteria.equilibria:
            return candidate
        report("equilibria")
        setup = self.watching(candidate.legs)
        rounds = self.rounds if all(o.is_segment_direction for o in self.setup.observed) else self._rounds(setup)
        return replace(candidate, equilibria=LoopEnds.of(setup, self.goal, rounds))

    @cached_property
    def rounds(self) -> tuple[Array, ...]:
        """Starts of the search for equilibria of all sets of directions."""
        return self._rounds(self.setup)

    def _rounds(self, setup: ObservedRobot) -> tuple[Array, ...]:
        """Starts at which all observed points of a setup are in front of their cameras."""
        system = EquilibriumSearch.of(setup, self.goal).system
        homes = np.array([system.system.read(at.pose) for at in (self.goal, *setup.configurations)])
        return tuple(islice(starts(system, homes, self.seed, setup), SELECT_EQUILIBRIUM_ROUNDS_COUNT))

    def ran(self, candidate: Candidate) -> Candidate:
        """Add the outcome of the simulated run, and what the camera sees along it."""
        motion, mechanism = self.setup.motion, self.setup.mechanism
        start, goal = (motion.pose(at.pose(motion.link)) for at in (self.start, self.goal))
        camera = None if mechanism.reference == mechanism.base else mechanism.reference
        try:
            found = (
                servo(self.setup.robot, candidate.legs, camera, start=start, goal=goal, seed=self.seed)
                if all(o.is_segment_direction for o in self.setup.observed)
                else servo(self.watching(candidate.legs), start=start, goal=goal, seed=self.seed)
            )
        except HrsynthError as error:
            return replace(candidate, run=Decision("refused", str(error)), discarded=f"the run is refused: {error}")
        run = Decision(found.outcome, found.run_outcome.reason)
        if found.outcome != GOAL:
            return replace(
                candidate, run=run, discarded=f"the outcome of the simulated run is {found.outcome} ({run.reason})"
            )
        return self.look(replace(candidate, run=run), found.run.configurations)


def _explain_singularity(name: str, posture: ConfigurationReport) -> str | None:
    """Return why a set is discarded: its hidden robot is singular at start or goal; None where it is regular."""
    kind = TYPES.get(posture.hidden.state)
    return None if kind is None else f"the {name} is {kind}"
