"""Paths between two poses: joined by a certified path, separated by a proof, or undecided (proofs.md 9)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import combinations
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...constraints.condition import Condition, NamedCondition
from ...constraints.pattern import ConstraintPattern
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.continuation import lead_to, track
from ...kinematics.joint_coordinates import OfConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism.observation import Observation
from ...mechanism.pose import AskedPose, Pose, PoseLike, parse_pose
from ...options import option
from ...progress import report
from ...records import As, Recorded, Shown, recorded
from ...results import Result, Value
from ...tolerances import CLOSURE_SOLVER_TOL, PRINTED_POSE_TOL, RANK_CUTOFF_FRACTION, RANK_GAP_MIN
from ..accuracy.measurement_bounds import find_invisible
from ..analysis_declaration import analysis
from ..measured import MeasuredRobot
from ..observation_inputs import CameraLike, LegsLike, Seed, SensorLike, StartPose
from ..observed import ObservedRobot, RobotLike
from ..pose_requests import solve_configurations
from ..singularity.condition_check import compute_smallest_value, compute_smallest_values
from .condition_enclosure import ConditionEnclosure, PathSegment, enclose_value, has_sign_change, is_beyond
from .leg_forms import LegForms, LegPattern, build_leg_pattern
from .path_segments import PathCoordinates, Place, WorkingModeChange, list_path_coordinates
from .roadmap import PlannedPath, PoseRegion, plan
from .vector_expressions import NoLegForm, collect_subchains
from .verdicts import SAME, SEPARATED, UNDECIDED


@dataclass(frozen=True, eq=False, repr=False)
class PathEnd(OfConfiguration, Value):
    """Requested pose: the whole pose that is reached, its configuration, and the value of the condition there; at the
    goal the value in the working modes in which the path ends."""

    pose: Recorded[Pose]
    configuration: ClosedConfiguration
    value: Recorded[float]


@dataclass(frozen=True, eq=False, repr=False)
class SampledRoute(Value, all_recorded=True):
    """Condition at ``count`` poses on the straight path between two poses: the smallest |value|, and ``at`` which pose;
    number of sign changes from one to the next (None for a value without sign); the part of the path that was
    ``reached``, and the first feature that leaves the field of view. Nothing is known between the poses."""

    count: Annotated[int, As("poses")]
    least: float
    at: Pose
    changes: int | None
    reached: float
    out_of_view: str | None


class LegModeChange(NamedTuple):
    """Leg that changes its working mode, and the pose of the path at which it does."""

    leg: str
    at: int


@dataclass(frozen=True, eq=False, repr=False)
class PathAnswer(Result, shown_as="path"):
    """Verdict on two poses: same aspect (with a certified path), separated or undecided, and the reason.

    Between its poses the path moves one point of the platform on straight lines and rotates the platform about one
    axis. Where a leg passes from one working mode to the other (``crossings``), it goes to its limit and back.

    Parameters
    ----------
    setup
        Robot with its observations.
    verdict
        ``same aspect``, ``separated`` or ``undecided``.
    certified
        True if the verdict is proved by interval arithmetic.
    poses
        Poses of the platform along the path (metres, radians, base frame).
    margin
        Lower bound of the condition's |value| along a certified path, at both ends if they are separated.
    boxes
        Number of intervals of all proofs tried.
    start, goal
        Requested poses, with the value of the condition there.
    reason
        Reason of the verdict.
    """

    setup: ObservedRobot
    verdict: Annotated[str, Literal["same aspect", "separated", "undecided"]]
    certified: Recorded[bool]
    poses: Annotated[tuple[Pose, ...], As("path")]
    margin: Recorded[float | None]
    boxes: Recorded[int]
    start: Recorded[PathEnd]
    goal: Recorded[PathEnd]
    reason: Recorded[str]
    signed: bool
    coordinates: PathCoordinates | None = None
    segments: tuple[PathSegment, ...] = ()
    limits: Recorded[tuple[str, ...]] = ()
    """Joints whose limits are met all along a certified path."""
    limits_ignored: tuple[str, ...] = ()
    """Joints whose limits are not considered."""
    any_mode: bool = False
    """True if the goal is a pose, in any working modes of its legs, and not a configuration."""
    goal_modes: tuple[tuple[float, ...], ...] = ()
    """Working modes of all subchains at the goal in which the sign is proved to be opposite to the start's, if they are
    separated."""
    road: Annotated[SampledRoute | None, As("sampled")] = None
    """Straight path, sampled; given if neither a path nor a separation was enclosed."""

    def headline(self) -> str:
        """Return the robot and the verdict."""
        return f"{self.setup.headline()}: {self.verdict}"

    @property
    def is_at_goal(self) -> bool:
        """True if start and goal are one pose of the platform, to the digits printed."""
        one, other = (at.pose(self.setup.motion.link) for at in (self.start.configuration, self.goal.configuration))
        return bool(np.max(np.abs(one - other)) <= PRINTED_POSE_TOL)

    @property
    @recorded(As("not_considered"))
    def not_proved(self) -> str:
        """Facts that a certificate does not cover."""
        joints = f"limits of joints {', '.join(self.limits_ignored)}; " if self.limits_ignored else ""
        if not all(o.is_segment_direction for o in self.setup.observed):
            joints += "points behind a camera or out of its image; "
        return f"{joints}collisions and constraint singularities of the loops are not considered"

    @property
    def where(self) -> str:
        """Restriction of the paths: all that is observed has a value on them (no point is in a camera's centre)."""
        return (
            ""
            if all(o.is_segment_direction for o in self.setup.observed)
            else "on which all that is observed has a value "
        )

    @property
    @recorded()
    def crossings(self) -> tuple[LegModeChange, ...]:
        """Legs that change their working mode, each with the index of its limit in ``poses``."""
        found, place = [], 0
        for way in self.segments:
            if isinstance(way, WorkingModeChange):
                found.append(LegModeChange(way.leg, place + 1))
            place += len(_list_marks(way))
        return tuple(found)

    observed = Shown(tuple[Observation, ...], lambda self: self.setup.observed)
    point = Shown(list[float] | None, lambda self: None if self.coordinates is None else self.coordinates.motion.point)
    value = Shown(
        Literal["expression", "smallest singular value"],
        lambda self: "expression" if self.signed else "smallest singular value",
    )


def list_segment_poses(answer: PathAnswer, coordinates: PathCoordinates, ways: Sequence[PathSegment]) -> list[Pose]:
    """Return the platform's poses between the segments, and the pose at a leg's limit in the middle of a change of
    working mode."""
    motion = coordinates.motion
    here = answer.start.configuration
    found = []
    for p, R in [place for way in ways for place in _list_marks(way)][:-1]:
        if coordinates.turning:
            found.append(motion.pose(coordinates.frame(p, R)))
            continue
        here = _lead_to(here, coordinates, p)
        found.append(motion.pose(here.pose(motion.link)))
    return found


def _list_marks(way: PathSegment) -> list[tuple[Array, Array]]:
    if not isinstance(way, WorkingModeChange):
        return [way.end]
    p, R, _ = way.at(np.array([0.5]))
    return [(p[0], R[0]), way.end]


def _lead_to(here: ClosedConfiguration, coordinates: PathCoordinates, p: Array) -> ClosedConfiguration:
    """Return the configuration in which the point of the coordinates is at ``p``."""
    motion = coordinates.motion
    directions = motion.translations.T
    goal = replace(motion.at_home(), directions=directions, values=coordinates.length * directions @ p)
    return track(here, motion, goal)[0]


PATH_SAMPLES_COUNT = 33
"""Number of poses at which a path that cannot be enclosed is sampled."""
PATH_INTERVALS_MAX = 10_000
"""Largest number of intervals for one path."""
CLEAR = RANK_CUTOFF_FRACTION * RANK_GAP_MIN
"""Smallest |value| of a condition that counts as nonzero."""


@dataclass(frozen=True, eq=False, repr=False)
class PathPlanner(Value):
    """Path planner of a robot, with its Type 2 condition."""

    setup: ObservedRobot
    motion: PlatformMotion
    structure: ConstraintPattern
    condition: Condition
    lost: str
    """Unobserved twists, as text; empty if there are none. With them every pose is singular."""

    @classmethod
    def of(
        cls,
        robot: RobotLike,
        observe: LegsLike = None,
        camera: CameraLike = None,
        *,
        sensor: SensorLike = None,
        seed: int = 0,
    ) -> PathPlanner:
        """Return the planner of a robot, its condition from random samples of its motion."""
        setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed)
        seen = MeasuredRobot.of(setup)
        return cls(
            setup, setup.motion, seen.pattern, seen.condition, seen.verdict.never if seen.verdict.unobserved else ""
        )

    @property
    def members(self) -> list[ClosedConfiguration]:
        """Zero configuration and samples."""
        return [self.setup.all_samples.start, *self.setup.configurations]

    @cached_property
    def pattern(self) -> LegPattern | str:
        """Forms of legs and vectors, or the reason why there are none."""
        if not isinstance(self.condition, NamedCondition):
            return "the condition has no named vectors"
        used = {str(symbol) for symbol in self.condition.expression.free_symbols}
        features = [f for f in self.structure.features if not has_sign_change(self.condition) or f.symbol in used]
        many = self.motion.translations.shape[1] + self.motion.rotations.shape[1]
        reason = (
            f"the {many} parts of the platform's pose that change depend on each other, {self.setup.dof} are "
            "free: a straight path of a point with rotation about one axis does not keep the others"
        )
        if many == self.setup.dof:
            reason = "the platform has another dof at the zero configuration than elsewhere"
        observation_model = self.setup.samples.observation_model
        for each in list_path_coordinates(self.setup.decomposition, observation_model, self.setup.dof, self.members):
            try:
                return build_leg_pattern(self.setup.decomposition, features, each, self.members)
            except NoLegForm as why:
                reason = str(why)
        return reason

    def enclosure(self, at: ClosedConfiguration) -> ConditionEnclosure:
        """Return the condition as a function of the pose, in the working mode of a configuration; raises
        ``NoLegForm``."""
        if isinstance(self.pattern, str) or not isinstance(self.condition, NamedCondition):
            raise NoLegForm(str(self.pattern))
        return ConditionEnclosure(self.condition, self.pattern.forms(at))

    def join(
        self,
        start: ClosedConfiguration,
        goal: ClosedConfiguration,
        *,
        seed: int = 0,
        budget: int = PATH_INTERVALS_MAX,
        any_mode: bool = False,
    ) -> PathAnswer:
        """Search for a path without Type 2 singularity from a configuration to another, where legs that are not
        observed may be in any working mode; with ``any_mode`` to the other's pose, all legs in any working mode."""
        found, scene = self.condition, self.structure.values_at([start, goal])
        values = found.evaluate(scene) if found.signed else compute_smallest_values(found.rows(scene))
        ends = [
            PathEnd(self.motion.pose(at.pose(self.motion.link)), at, float(value))
            for at, value in zip((start, goal), values, strict=True)
        ]
        answer = PathAnswer(
            self.setup,
            UNDECIDED,
            False,
            tuple(end.pose for end in ends),
            None,
            0,
            ends[0],
            ends[1],
            "",
            found.signed,
            any_mode=any_mode,
        )
        if self.lost:
            return replace(answer, reason=f"every pose is singular, {self.lost}")
        if min(abs(end.value) for end in ends) < CLEAR:
            least = min(ends, key=lambda end: abs(end.value))
            told = "a pose is singular, or too near to the singular locus to be distinguished"
            if (
                abs(least.value) < CLOSURE_SOLVER_TOL
                and compute_smallest_value(least.configuration, self.setup.samples.observation_model) > CLEAR
            ):
                told = "the condition vanishes where no twist is unobserved: it is not this robot's"
            return replace(answer, reason=told)
        try:
            enclosures = [self.enclosure(end.configuration) for end in ends]
        except NoLegForm as why:
            answer = _compare_end_points(answer, str(why))
            return answer if answer.verdict == SEPARATED else replace(answer, road=self.road(start, goal))
        return self._decide(answer, enclosures, seed, budget)

    def road(self, start: ClosedConfiguration, goal: ClosedConfiguration) -> SampledRoute:
        """Sample the platform's straight path from a configuration to the pose of another."""
        motion, observation_model = self.motion, self.setup.samples.observation_model
        target, X = motion.whole(goal.pose(motion.link)), start.pose(motion.link)
        way = [start]
        fractions = np.linspace(0, 1, PATH_SAMPLES_COUNT)
        for fraction in fractions[1:]:
            there, came = lead_to(way[-1], motion, target.towards(X, float(fraction)), last=fraction == 1)
            if not came:
                break
            way.append(there)
        scene = self.structure.values_at(way)
        values = (
            self.condition.evaluate(scene)
            if self.condition.signed
            else compute_smallest_values(self.condition.rows(scene))
        )
        worst = int(np.argmin(np.abs(values)))
        changes = int(np.sum(values[1:] * values[:-1] < 0)) if self.condition.signed else None
        lost = next((o.text for at in way if (o := find_invisible(at, observation_model)) is not None), None)
        return SampledRoute(
            len(way),
            float(abs(values[worst])),
            motion.pose(way[worst].pose(motion.link)),
            changes,
            float(fractions[len(way) - 1]),
            lost,
        )

    def _decide(
        self, answer: PathAnswer, enclosures: Sequence[ConditionEnclosure], seed: int, budget: int
    ) -> PathAnswer:
        """Decide where the pose determines the legs."""
        assert isinstance(self.pattern, LegPattern)
        coordinates = self.pattern.coordinates
        p, R = coordinates.of([answer.start.configuration, answer.goal.configuration, *self.members])
        sure, values = zip(*(enclose_value(enclosures[i].unlimited, p[i], R[i]) for i in range(2)), strict=True)
        margin = min(map(abs, values))
        fitted = self.pattern.fitted
        forms = f", for forms that are fitted to samples: {', '.join(fitted)}" if fitted else ""
        if not all(sure) or margin == 0:
            return replace(answer, reason="at a pose reach or value cannot be enclosed away from zero")
        if enclosures[0].has_sign and values[0] * values[1] < 0:
            seen = () if answer.any_mode else {o.leg for o in self.setup.observed}
            across, others, margin = self._across(enclosures[1], (p[1], R[1]), values, seen)
            if not others:
                return replace(
                    answer,
                    verdict=SEPARATED,
                    certified=not fitted,
                    margin=margin,
                    boxes=1 + len(across),
                    goal_modes=across,
                    reason=(
                        f"the expression is enclosed with opposite signs at the two {_describe_ends(answer.any_mode)}: "
                        f"every path between them {answer.where}crosses its zeros{forms}"
                    ),
                )
            return self._lead_to_other_modes(answer, enclosures[0], others, (p, R), seed, budget)
        if answer.signed and answer.start.value * answer.goal.value < 0:
            return _compare_end_points(answer, "its sign is that of a determinant")
        return self._lead(answer, enclosures, (p, R), seed, budget)

    def _across(
        self, goal: ConditionEnclosure, place: Place, values: Sequence[float], seen: Collection[str]
    ) -> tuple[tuple[tuple[float, ...], ...], list[ConditionEnclosure], float]:
        """Classify the working modes of the goal, of legs that are not ``seen``: those in which the value's sign is
        proved to be opposite to the start's; all others without a joint proved to be beyond its limits, first those
        nearest to the goal's; and the smallest |value| at the start and in the former."""
        limbs, across, others, margin = goal.forms.subchains, [goal.forms.modes], [], min(map(abs, values))
        able = [k for k in sorted(collect_subchains(tuple(goal.forms.vectors.values()))) if limbs[k].label not in seen]
        for k in range(1, len(able) + 1):
            for part in combinations(able, k):
                there = replace(goal, forms=reduce(LegForms.flipped, part, goal.forms))
                sure, value = enclose_value(there.unlimited, *place)
                if sure and value * values[0] < 0:
                    across.append(there.forms.modes)
                    margin = min(margin, abs(value))
                elif not is_beyond(there, *place):
                    others.append(there)
        return tuple(across), others, margin

    def _lead_to_other_modes(
        self,
        answer: PathAnswer,
        start: ConditionEnclosure,
        others: Sequence[ConditionEnclosure],
        poses: tuple[Array, Array],
        seed: int,
        budget: int,
    ) -> PathAnswer:
        """Search for a path to the goal in a working mode with the start's sign; ``undecided`` if none is found."""
        spent, limbs = 0, self.enclosure(answer.goal.configuration).forms.subchains
        for there in others:
            legs = [
                one.label for one, other in zip(limbs, there.forms.subchains, strict=True) if one.mode != other.mode
            ]
            (p, R), modes = poses, f"in the other working mode of leg {', '.join(dict.fromkeys(legs))}"
            if spent < budget and there.at(p[1:2], R[1:2])[1][0] * answer.start.value > 0:
                found = self._lead(answer, (start, there), poses, seed, budget - spent)
                spent += found.boxes
                if found.verdict == SAME:
                    value = float(there.at(p[1:2], R[1:2])[1][0])
                    return replace(
                        found,
                        goal=replace(answer.goal, value=value),
                        boxes=spent,
                        reason=(f"{found.reason}; at the goal the robot is then {modes}"),
                    )
        able = dict.fromkeys(
            one.label
            for there in others
            for one, other in zip(limbs, there.forms.subchains, strict=True)
            if one.mode != other.mode
        )
        return replace(
            answer,
            boxes=spent,
            reason=(
                "the expression has opposite signs at the start and at the goal in the reached working modes, so every "
                "path between these crosses its zeros; not so in other working modes of leg "
                f"{', '.join(able)} at the goal, and no path to these was proved"
            ),
        )

    def _lead(
        self,
        answer: PathAnswer,
        enclosures: Sequence[ConditionEnclosure],
        poses: tuple[Array, Array],
        seed: int,
        budget: int,
    ) -> PathAnswer:
        """Decide by a path between the first two poses."""
        assert isinstance(self.pattern, LegPattern)
        (p, R), coordinates, fitted = poses, self.pattern.coordinates, self.pattern.fitted
        for end, enclosure, place, turn in zip(("start", "goal"), enclosures, p, R, strict=False):
            beyond = enclosure.forms.beyond(place, turn)
            if beyond:
                return replace(answer, reason=f"the {end} is at or beyond a limit of joint {', '.join(beyond)}")
        region = PoseRegion.around(coordinates, p, R)
        found = plan((enclosures[0], enclosures[1]), region, (p[0], R[0]), (p[1], R[1]), seed=seed, budget=budget)
        answer = self._add_ways(answer, found, self.pattern)
        if not found.is_proved:
            return replace(answer, reason=_explain_undecided(found, enclosures, budget))
        if not is_connected_path(found.ways, (p[0], R[0]), (p[1], R[1]), enclosures):
            return replace(answer, reason="no path was proved: the path found does not join the two poses")
        if self.pattern.loose:
            ends = answer.start.configuration, answer.goal.configuration
            return replace(
                answer,
                road=self.road(*ends),
                reason=(
                    "the condition and the reach of all rods are enclosed along the path; not proved that the loops "
                    f"inside leg {', '.join(self.pattern.loose)} close on it"
                ),
            )
        forms = f", for forms that are fitted to samples: {', '.join(fitted)}" if fitted else ""
        return replace(
            answer,
            verdict=SAME,
            certified=not fitted,
            margin=found.margin,
            reason=(f"the condition and the reach of all legs are enclosed away from zero along the path{forms}"),
        )

    def _add_ways(self, answer: PathAnswer, found: PlannedPath, known: LegPattern) -> PathAnswer:
        """Return the answer with a plan's segments, and the joints whose limits these keep."""
        kept = tuple(bound.joint for bound in known.bounds)
        answer = replace(
            answer,
            boxes=found.boxes,
            limits=kept,
            limits_ignored=(
                *(name for name in self.setup.robot.joint_ranges if name not in kept),
                *self.setup.mechanism.tilt_limits,
            ),
        )
        if not found.ways:
            return answer
        poses = answer.start.pose, *list_segment_poses(answer, known.coordinates, found.ways), answer.goal.pose
        return replace(answer, coordinates=known.coordinates, segments=found.ways, poses=poses)


@analysis(
    90,
    examples=(
        "quattro --observe 1,4 --start x=0.05 --goal x=-0.05,phi=20deg",
        "3rrr_m1 --start x=0,y=0 --goal mode:2 --certificate c.json",
    ),
)
def path(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    start: StartPose,
    goal: Annotated[PoseLike, option("Goal pose; mode:2 is a mode with the directions at the start.", "POSE")],
    seed: Seed = 0,
    budget: int = PATH_INTERVALS_MAX,
) -> PathAnswer:
    """Find a path without Type 2 singularity between two poses, with a proof: same aspect, separated or undecided.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    start
        Start pose, or joint coordinates, in the working modes in which it is reached.
    goal
        Goal pose, in any working modes; ``mode:2`` is an assembly mode of the start, with its observed directions.
    seed
        Seed of the random samples and of the road map.
    budget
        Largest number of intervals.

    Returns
    -------
    PathAnswer
        ``same aspect``, ``separated`` or ``undecided``, with the path and the reason.

    Raises
    ------
    BadRequest
        If a name or a part of a pose is unknown.
    PoseReachFailure
        If start or goal is not reached.

    Notes
    -----
    The condition is that of the real robot's velocity relation, which is the exact lift's (theory.md 3). A certified
    path encloses, by interval arithmetic, the condition's value away from zero, the reach of every leg and the limits
    of R and P joints, for all poses within ``tolerances.HIDDEN_ROBOT_RESIDUAL_TOL`` of the path. Legs may pass their
    limits into other working modes (Type 1), but no rod length zero. All that is observed has a value on the path, in
    front of the camera or not. Opposite signs of an expression, at the start and in all working modes of the goal that
    joint limits allow, separate the two. If nothing can be enclosed, the straight path is sampled. Source: proofs.md 9.

    Both poses are reached from the zero configuration in its working mode. If small steps do not lead to a pose that is
    a mode of the other, it is the assembled mode that ``modes`` finds.

    Examples
    --------
    >>> hrsynth.path("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=5deg").verdict
    'same aspect'
    """
    wanted = [parse_pose(each) for each in (start, goal)]
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed)
    return plan_between_poses(setup, wanted, any_mode=isinstance(wanted[1], Pose), seed=seed, budget=budget)


def plan_between_poses(
    setup: ObservedRobot,
    wanted: Sequence[AskedPose],
    *,
    any_mode: bool,
    seed: int = 0,
    budget: int = PATH_INTERVALS_MAX,
) -> PathAnswer:
    """Search for a path between the configurations at a start and a goal, see :meth:`PathPlanner.join`."""
    aspects = PathPlanner.of(setup.printing_like(wanted), seed=seed)
    report("poses")
    first, last = solve_configurations(aspects.setup, wanted, by_modes=True)
    return aspects.join(first, last, seed=seed, budget=budget, any_mode=any_mode)


def is_connected_path(
    ways: Sequence[PathSegment], start: Place, goal: Place, enclosures: Sequence[ConditionEnclosure]
) -> bool:
    """Return True if segments lead from pose to pose and from working mode to working mode without a gap."""
    here, modes = start, list(enclosures[0].forms.modes)
    for way in ways:
        if _measure_gap(here, (way.p, way.R)) > CLOSURE_SOLVER_TOL:
            return False
        here = way.end
        if isinstance(way, WorkingModeChange):
            modes[way.limb] *= -1
    return _measure_gap(here, goal) <= CLOSURE_SOLVER_TOL and tuple(modes) == enclosures[1].forms.modes


def _measure_gap(one: Place, other: Place) -> float:
    return max(float(np.max(np.abs(a - b))) for a, b in zip(one, other, strict=True))


def _explain_undecided(found: PlannedPath, enclosures: Sequence[ConditionEnclosure], budget: int) -> str:
    """Return the reason why a plan decides nothing."""
    used = "limit of intervals reached" if found.boxes >= budget else "the road map does not join the poses"
    if found.ways:
        return f"no path was proved: {used}; the path shown is proved except for its last part"
    pairs = zip(*(enclosure.forms.subchains for enclosure in enclosures), strict=True)
    legs = dict.fromkeys(one.label for one, other in pairs if one.mode != other.mode)
    return f"no path was proved: {used}; leg {', '.join(legs)} is in different working modes at the two poses"


def _describe_ends(any_mode: bool) -> str:
    """Return which ends of a path a verdict is about."""
    return (
        "poses, at the goal in each working mode within joint limits"
        if any_mode
        else ("configurations, each in the working modes that its observed directions show")
    )


def _compare_end_points(answer: PathAnswer, why: str) -> PathAnswer:
    """Decide from the two configurations alone: opposite signs of a continuous expression separate them."""
    ends = answer.start.value, answer.goal.value
    if answer.signed and ends[0] * ends[1] < 0:
        found = (
            "the expression has opposite signs at the two configurations, every path between them "
            f"{answer.where}crosses its zeros; not certified by intervals: {why}"
        )
        if answer.any_mode:
            return replace(answer, reason=f"{found}; the goal was not tested in other working modes")
        return replace(answer, verdict=SEPARATED, margin=min(map(abs, ends)), reason=found)
    return replace(answer, reason=f"no path can be certified: {why}")
