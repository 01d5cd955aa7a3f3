"""Basins of attraction: outcomes of the runs to one goal from each start of a line, plane or box of poses. Runs are
batched if the closed forms cover the robot, else simulated separately."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...analysis.accuracy.error_map import Mapper
from ...analysis.accuracy.measurement_bounds import MeasurementBounds
from ...analysis.analysis_declaration import analysis
from ...analysis.observation_inputs import CameraLike, Jobs, LegsLike, Seed, SensorLike
from ...analysis.observed import ObservedRobot, RobotLike
from ...analysis.pose_requests import solve_configurations
from ...batch.grids import list_grid_poses
from ...batch.pose_continuation import sweep
from ...errors import BadRequest, HrsynthError, NoReachablePose
from ...geometry.so3 import turn_about
from ...geometry.vectors import Array, compare_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism.pose import SCALARS, Grid, Pose, PoseLike, convert_to_pose, parse_pose
from ...options import option
from ...processes import run_shared
from ...progress import report
from ...records import FLAT, As, Number, Recorded, Shown, Table, recorded
from ...results import Result, Value
from ...tolerances import RUN_END_DIFFERENCE_TOL, VISIBLE_SINE_MIN
from ..law import Depth, measure_all
from ..outcome import ENDINGS, GOAL, SIGHT, TIME, UNDECIDED, OutcomeClassifier, RunOutcome
from ..run import AWAY, EFFORT, LOST, POISED, REST, RUN_ESCAPE_DISTANCE_MAX, SERVED_AT
from ..run import TIME as OVER
from ..servo import Conditions, ServoTask
from .attraction_radius import AttractionRadius, prove_attraction_radius
from .batched_runs import BatchedRuns
from .equilibrium import Equilibria
from .flow import Flags, Flow, Places
from .outcomes import Outcome, OutcomeCount, Outcomes

FLOW_STARTS, FLOW_STARTS_ONE_BY_ONE = 100_000, 2_500
"""Largest number of starts, batched, and simulated one by one."""
FLOW_PART, FLOW_FEW, FLOW_SINGLE = 5_000, 2_000, 1
"""Starts per batch, last starts that continue together, and single runs per task of a process."""
FLOW_FOLLOWED, FLOW_CHECKED, FLOW_NAMED = 24, 6, 16
"""Runs of a batch that are simulated one by one because they stopped, as a check, and named equilibria."""
FLOW_EXAMPLES_MAX = 8
"""Starts with one end among which an example is chosen that is reached by small steps."""

SIDE, SIDE_ONE_BY_ONE = 100, 15
"""Starts along each side of a plane: batched, and simulated separately."""
REGION, REGION_SIDE = 1.1, (0, 401, 81, 25)
"""Half the width over which the proved attraction radius is drawn, in radii, and the poses along each side, by the
number of parts that vary."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""Letters of the outcomes in text and figure."""
NOT_REACHED = -1
"""Index of a start at which the robot cannot be."""


@dataclass(frozen=True, eq=False, repr=False)
class BasinEnd(Value):
    """Outcome of some runs, that of one simulated separately; the platform's pose X (4, 4) and ‖e‖ if they converge to
    one pose; their number and fraction; ``example`` is the pose of one of the starts, as ``servo`` takes it."""

    run_outcome: Annotated[RunOutcome, FLAT]
    pose: Recorded[Pose | None]
    X: Array | None
    size: float
    count: Annotated[int, As("starts")]
    share: Recorded[float]
    example: Recorded[Pose]

    error = Shown(Number, lambda self: None if self.X is None else self.size, "‖e‖")


class CertifiedPart(NamedTuple):
    """Proved attraction radius: every start in the goal's working mode within this distance is proved to end at the
    goal; the fraction of the goal's basin that it covers; the larger radius while the law is not damped, if any."""

    radius: Annotated[AttractionRadius, FLAT]
    covered: float


@dataclass(frozen=True, eq=False, repr=False)
class Basins(Result, shown_as="basins"):
    """Outcome of the run from each pose of a grid.

    Attributes
    ----------
    ends
        Outcomes with their poses and numbers of starts.
    cells
        Index of the outcome of each start, in the grid's shape; −1 if the robot cannot start there.
    damped
        Starts whose runs meet a singularity, where the law is damped.
    batched
        Flag: runs were integrated together; ``followed`` of them were then simulated separately because that could not
        continue, and of ``checked`` others ``agreed`` ended at the same pose.
    certified
        Proved attraction radius of the goal.
    """

    setup: Annotated[ObservedRobot, FLAT]
    goal: Recorded[Pose]
    target: ClosedConfiguration
    grid: Grid
    ends: Recorded[tuple[BasinEnd, ...]]
    cells: Annotated[Places, Table, "indices of ``ends``, from 0; -1 where no run starts"]
    damped: Flags
    batched: Recorded[bool]
    followed: Recorded[int] = 0
    checked: Recorded[int] = 0
    agreed: Recorded[int] = 0
    certified: AttractionRadius | None = None
    """Proved attraction radius of the goal."""

    @property
    @recorded()
    def starts(self) -> int:
        """Number of poses of the grid at which the robot can start."""
        return int(np.sum(self.cells != NOT_REACHED))

    @cached_property
    def region(self) -> tuple[Grid, Flags] | None:
        """Poses around the goal, and which of them are within the proved attraction radius; None if none is, or if the
        radius is that of another platform point than the drawn one."""
        found = self.certified
        if found is None or not found.length or found.aside:
            return None
        motion, goal = self.setup.motion, self.target.pose(self.setup.motion.link)
        half = [(found.angle or 0.0) if name == "phi" else found.length for name in self.grid.names]
        middle = place_of(motion, goal, self.grid.names)
        near = Grid(
            tuple(
                (name, np.linspace(m - REGION * h, m + REGION * h, REGION_SIDE[self.grid.ndim]))
                for name, m, h in zip(self.grid.names, middle, half, strict=True)
            ),
            self.grid.fixed,
        )
        X, possible = list_grid_poses(motion, near, self.setup.robot.name, near.places())
        inside = np.array([met and found.has_start(each) for met, each in zip(possible, X, strict=True)])
        return (near, inside.reshape(near.shape)) if inside.any() else None

    @property
    def covered(self) -> float:
        """Return the fraction of the goal's basin, as far as the grid covers it, that is proved."""
        goal = next((i for i, each in enumerate(self.ends) if each.run_outcome.name == GOAL), None)
        if self.region is None or goal is None:
            return 0.0
        sizes = [
            np.sum(inside) * math.prod(float(v[1] - v[0]) for _, v in grid.axes)
            for grid, inside in (self.region, (self.grid, self.cells == goal))
        ]
        return float(sizes[0] / sizes[1])

    def members(self, listed: Equilibria) -> tuple[int | None, ...]:
        """Return the index of each outcome in a list of equilibria with the same goal; None if it is not on the list,
        or no equilibrium."""
        length, link = self.target.model.length, self.setup.motion.link
        rests = [(rest.configuration.pose(link), rest.error) for rest in listed.points]
        return tuple(
            next(
                (
                    i
                    for i, (X, size) in enumerate(rests)
                    if each.X is not None
                    and abs(size - each.size) <= RUN_END_DIFFERENCE_TOL
                    and compare_poses(X, each.X, length) <= RUN_END_DIFFERENCE_TOL
                ),
                None,
            )
            for each in self.ends
        )

    def headline(self) -> str:
        """Return the robot and the share of the starts that ends at the goal."""
        share = next((each.share for each in self.ends if each.run_outcome.name == GOAL), 0.0)
        return f"{self.setup.headline()}: {100 * share:.3g} % of {self.starts:,} starts end at the goal {self.goal}"

    poses = Shown(str, lambda self: str(self.grid))
    axes = Shown(dict[str, list[float]], lambda self: dict(self.grid.axes))
    damped_record = Shown(int, lambda self: np.sum(self.damped), As("damped"))

    @property
    @recorded(As("certified"))
    def certified_record(self) -> CertifiedPart | None:
        """Proved part; null if no proof was tried."""
        return None if self.certified is None else CertifiedPart(self.certified, self.covered)


@analysis(
    120,
    examples=(
        "quattro --observe 1,4 --goal z=-0.7 --plane z=-0.7,phi=0 -o basins.png",
        "3rrr_m1 --goal x=0,y=0,phi=0 --grid x=-0.1:0.1:50,y=0,phi=0",
    ),
)
def basins(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    goal: Annotated[PoseLike, option("Pose whose measured values are desired.", "POSE")],
    plane: Annotated[
        PoseLike | None,
        option(
            "Plane of starts, such as z=-0.7, as far as it is reached (default: one through the goal).", "PART=VALUE"
        ),
    ] = None,
    grid: Annotated[
        str | None,
        option("Line, plane or box of starts, such as x=-0.3:0.3:50,y=-0.3:0.3:50,z=-0.7 (from:to:count).", "GRID"),
    ] = None,
    steps: Annotated[
        int | None,
        option(
            "Starts along each side of the plane (default: 100; 15 if each is simulated separately).", low=2, high=300
        ),
    ] = None,
    jobs: Jobs = None,
    depth: Depth = "exact",
    seed: Seed = 0,
) -> Basins:
    """Basins of attraction: the outcome of the servo loop from each start of a line, plane or box of poses.

    Parameters
    ----------
    robot
        Robot, file or name.
    observe, camera, sensor
        Observations, as for ``derive``.
    goal
        Pose whose measured values are desired (m, rad, in the base frame).
    plane
        Plane of start poses, as far as it is reached, with ``steps`` poses a side (default: one through the goal).
    grid
        Line, plane or box of start poses, such as ``x=-0.3:0.3:50,y=-0.3:0.3:50,z=-0.7``.
    steps
        Number of poses along each side of the plane.
    jobs
        Number of processes, by default one per core; the result does not depend on it.
    depth
        Depth of image features that the law assumes, as for ``servo``.
    seed
        Seed of samples.

    Returns
    -------
    Basins
        Outcomes, and the index of the outcome of each start, in the shape of the grid.

    Raises
    ------
    BadRequest
        Unknown name, a platform dof that is not observed, a singular goal, or too many starts.
    PoseReachFailure, NoReachablePose
        The goal, or all starts are out of reach.

    Notes
    -----
    The law is that of ``servo`` with exact measurements. Runs of robots whose legs have closed forms are batched if
    leg directions are observed; other runs are simulated separately. The proved attraction radius is that of
    docs/pages/proofs.md, section 14.

    Examples
    --------
    >>> hrsynth.basins("3rrr_m1", goal="x=0,y=0,phi=0", grid="x=-0.02:0.02:5,y=-0.02:0.02:5,phi=0")
    <Basins: 3rrr_m1, observing 1, 2, 3: 100 % of 25 starts end at the goal x=0,y=0,z=0,phi=0deg>
    """
    asked = parse_pose(goal)
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).printing_like([asked])
    if plane is not None and grid is not None:
        raise BadRequest(f"--grid {grid}: cannot be combined with --plane", remedy="Omit one.")
    (target,) = solve_configurations(setup, [asked])
    task = ServoTask.between(setup, target, target, Conditions(depth=depth))
    search = BasinSearch(setup, target, task, jobs or os.cpu_count() or 1)
    starts = search.plane(plane, steps) if grid is None else Grid.parse(grid, FLOW_STARTS)
    if not {*starts.names} <= {*SCALARS}:
        raise BadRequest(f"--grid {grid}: parts of the starts that vary", starts.names, SCALARS)
    return search.over(starts, seed)


@dataclass(frozen=True, eq=False)
class BasinSearch:
    """Search of the outcomes of many starts of the loop to a goal, by ``jobs`` processes."""

    setup: ObservedRobot
    goal: ClosedConfiguration
    task: ServoTask
    jobs: int

    @cached_property
    def flow(self) -> Flow | None:
        """Batched law; None if something prevents it."""
        setup = self.setup
        if setup.placer is None or hindrances(setup):
            return None
        return Flow(setup.placer, tuple(setup.labels), self.task.directions)

    def plane(self, plane: PoseLike | None, steps: int | None) -> Grid:
        """Return the reached poses of a plane, by default one through the goal."""
        motion, X = self.setup.motion, self.goal.pose(self.setup.motion.link)
        if plane is not None:
            fixed = convert_to_pose(plane)
        elif motion.is_planar:
            fixed = Pose(phi=float(place_of(motion, X, ("phi",))[0]))
        else:
            fixed = Pose(z=float(motion.position(X)[2])) if motion.shifts == 3 else Pose()
        return Mapper(self.setup, MeasurementBounds(np.zeros(0))).plane(
            fixed, steps or (SIDE if self.flow else SIDE_ONE_BY_ONE)
        )

    def over(self, grid: Grid, seed: int) -> Basins:
        """Return the outcomes of the runs from all poses of a grid."""
        name, motion = self.setup.robot.name, self.setup.motion
        most, count = FLOW_STARTS if self.flow else FLOW_STARTS_ONE_BY_ONE, math.prod(grid.shape)
        if count > most:
            how = "" if self.flow else ", which are simulated separately"
            raise BadRequest(
                f"{name}: number of starts{how}",
                count,
                f"at most {most:,}",
                remedy="Choose fewer --steps or a coarser --grid.",
            )
        X, possible = list_grid_poses(motion, grid, name, grid.places())
        found = self._abreast(X, possible, seed) if self.flow else self._one_by_one(X, grid)
        if not len(found.outcomes):
            raise NoReachablePose(name, f"the grid {grid}", f"{count} were tried")
        counts = np.bincount(found.cells[found.cells != NOT_REACHED], minlength=len(found.outcomes))
        order = sorted(np.flatnonzero(counts), key=lambda i: (ENDINGS.index(found.outcomes[i].ending.name), -counts[i]))
        ends, cells = [], np.full(count, NOT_REACHED)
        for number, i in enumerate(order):
            outcome, here = found.outcomes[i], np.flatnonzero(found.cells == i)
            cells[here] = number
            example = self._example(found.X[here])
            ends.append(
                BasinEnd(
                    outcome.ending,
                    None if outcome.X is None else motion.pose(outcome.X),
                    outcome.X,
                    outcome.size,
                    len(here),
                    len(here) / counts.sum(),
                    example,
                )
            )
        return Basins(
            self.setup,
            motion.pose(self.goal.pose(motion.link)),
            self.goal,
            grid,
            tuple(ends),
            cells.reshape(grid.shape),
            found.damped.reshape(grid.shape),
            self.flow is not None,
            found.followed,
            found.checked,
            found.agreed,
            found.certified,
        )

    def _example(self, X: Array) -> Pose:
        """Return one of the starts X (n, 4, 4) with the same outcome: the nearest to their centre, if small steps lead
        there from the zero configuration; else the nearest of the first few to which they do."""
        away = np.linalg.norm(X[:, :3, 3] - np.median(X[:, :3, 3], axis=0), axis=1)
        near = [self.setup.motion.pose(each) for each in X[np.argsort(away, kind="stable")[:FLOW_EXAMPLES_MAX]]]
        return next(filter(self._can_start, near), near[0])

    def _can_start(self, pose: Pose) -> bool:
        """Return True if a single run can start at a pose with its printed digits."""
        try:
            (at,) = solve_configurations(self.setup, [Pose.parse(str(pose))])
            ServoTask.between(self.setup, at, self.goal)
        except HrsynthError:
            return False
        return True

    def _abreast(self, X: Array, possible: Flags, seed: int) -> OutcomeCount:
        """Return the outcomes of starts X (n, 4, 4) in a batch."""
        flow, length = self.flow, self.goal.model.length
        assert flow is not None
        starts = np.flatnonzero(possible & flow.batch.reaches(X))
        cells, damped = np.full(len(X), NOT_REACHED), np.zeros(len(X), dtype=bool)
        if not len(starts):
            return OutcomeCount([], cells, damped, X)
        horizon = self.task.conditions.horizon * self.task.law.gain
        # each part from all over the grid, so that all take as long
        count = -(-len(starts) // FLOW_PART)
        shares = [starts[k::count] for k in range(count)]
        starts = np.concatenate(shares)
        # a step of few runs takes as long as one of a thousand: the last of all parts go on together
        first, *others = self._run_all(
            [
                partial(
                    _follow_flow, flow.bare(), horizon, RUN_ESCAPE_DISTANCE_MAX * length, X[share], FLOW_FEW // count
                )
                for share in shares
            ]
        )
        checked = np.random.default_rng(seed).choice(len(starts), min(FLOW_CHECKED, len(starts)), replace=False)
        runs, certified, *alone = self._run_all(
            [
                partial(first.together(others).run, horizon),
                partial(prove_attraction_radius, self.setup, self.goal),
                *self._single(self._start(X[starts[checked]])),
            ]
        )
        damped[starts] = runs.weak
        groups = runs.groups(length, flow.seen)
        shown = groups[:FLOW_NAMED]
        away, open_ = (np.flatnonzero(np.isin(runs.stopped, words)) for words in ((AWAY,), (LOST, EFFORT)))
        followed = open_[np.unique(np.linspace(0, len(open_) - 1, FLOW_FOLLOWED).astype(int))] if len(open_) else open_
        at = flow.configurations(runs.X[[group[0] for group in shown]], runs.flipped[[group[0] for group in shown]])
        told = list(chain(*self._run_all(self._single(at + self._start(X[starts[[*away[:1], *followed]]])))))
        numbers, outcomes = np.full(len(starts), -1), Outcomes(length)
        for group, outcome in zip(shown, told, strict=False):
            numbers[group] = outcomes.number(_at(outcome, runs.X[group[0]], length))
        told = told[len(shown) :]
        if len(away):
            numbers[away] = outcomes.number(told[0])
        numbers[runs.stopped == OVER] = outcomes.number(Outcome(RunOutcome(TIME, "the time ran out")))
        same = [
            outcome.is_same_outcome(outcomes.all[numbers[run]], length)
            for run, outcome in zip(checked, chain(*alone), strict=True)
            if numbers[run] >= 0
        ]
        for run, outcome in zip(followed, told[min(len(away), 1) :], strict=True):
            numbers[run] = outcomes.number(outcome)
        numbers[numbers < 0] = outcomes.number(Outcome(RunOutcome(UNDECIDED, "not simulated to the end")))
        cells[starts] = numbers
        return OutcomeCount(outcomes.all, cells, damped, X, len(followed), len(same), sum(same), certified)

    def _one_by_one(self, X: Array, grid: Grid) -> OutcomeCount:
        """Return the outcomes of the starts of a grid, each simulated; X (n, 4, 4) are its poses, free parts as at the
        zero configuration."""
        all_samples = self.setup.all_samples
        at = sweep(all_samples.start, all_samples.observation_model, grid, self.setup.motion, self.setup.placer)
        starts = np.array([i for i, each in enumerate(at) if each is not None], dtype=int)
        cells, outcomes = np.full(len(at), NOT_REACHED), Outcomes(self.goal.model.length)
        certified, *told = self._run_all(
            [partial(prove_attraction_radius, self.setup, self.goal), *self._single([at[i] for i in starts])]
        )
        for i, outcome in zip(starts, chain(*told), strict=True):
            cells[i] = outcomes.number(outcome)
        reached = np.array(
            [there if each is None else each.pose(self.setup.motion.link) for each, there in zip(at, X, strict=True)]
        )
        return OutcomeCount(
            outcomes.all, cells, np.zeros(len(at), dtype=bool), reached, len(starts), certified=certified
        )

    def _start(self, X: Array) -> list[ClosedConfiguration | None]:
        """The configurations at starts X (n, 4, 4)."""
        assert self.flow is not None
        return self.flow.configurations(X, np.zeros((len(X), len(self.flow.legs)), dtype=bool))

    def _single(self, starts: Sequence[ClosedConfiguration | None]) -> list[Callable[[], list[Outcome]]]:
        """Pieces of work that give the outcomes of single runs, undecided where there is no start."""
        return [partial(_simulate, self.task, starts[k : k + FLOW_SINGLE]) for k in range(0, len(starts), FLOW_SINGLE)]

    def _run_all(self, works: Sequence[Callable[[], Any]]) -> list[Any]:
        """Return the results of pieces of work, in their order."""
        jobs, found = min(self.jobs, len(works)), []
        for each in run_shared(works, jobs):
            found.append(each)
            if jobs > 1:
                report("runs", len(found), len(works))
        return found


def hindrances(setup: ObservedRobot) -> tuple[str, ...]:
    """Return the reasons why runs of a robot cannot be batched."""
    own = set(map(id, setup.segments))
    kinds = dict.fromkeys(
        "" if each.is_segment_direction else each.kind for each in setup.observed if id(each) not in own
    )
    found = [f"observations of kind {kind}" if kind else "observed links other than the default ones" for kind in kinds]
    if setup.mechanism.stops:
        found.append("a joint has limits")
    return tuple(found) or (("a leg has no closed form",) if setup.placer is None else ())


def place_of(motion: PlatformMotion, X: Array, names: Sequence[str]) -> Array:
    """The values (m, rad) of parts of a platform pose X (4, 4)."""
    turn = turn_about(motion.normal, X[:3, :3] @ motion.home[:3, :3].T)[0]
    return np.array([turn if name == "phi" else motion.position(X)["xyz".index(name)] for name in names])


def _at(outcome: Outcome, X: Array, length: float) -> Outcome:
    """Return the outcome of batched runs that end at X (4, 4), of which one was continued from there."""
    if outcome.X is not None and compare_poses(outcome.X, X, length) <= RUN_END_DIFFERENCE_TOL:
        return outcome
    return Outcome(RunOutcome(UNDECIDED, "a single run does not stay at the end of these"))


def _follow_flow(flow: Flow, horizon: float, farthest: float, X: Array, few: int) -> BatchedRuns:
    found = BatchedRuns(flow, X, farthest).follow(horizon, few)
    found.flow = flow.bare()
    return found


def _simulate(task: ServoTask, starts: Sequence[ClosedConfiguration | None]) -> list[Outcome]:
    classifier = OutcomeClassifier(task.setup, task.goal, task.wanted)
    loop, found = task.loop(), []
    for start in starts:
        if start is None:
            found.append(Outcome(RunOutcome(UNDECIDED, "no closed configuration was found there")))
            continue
        if task.law.in_front(start) < VISIBLE_SINE_MIN:
            found.append(Outcome(RunOutcome(SIGHT, "an observed feature is out of view at the start")))
            continue
        run = loop.simulate(start, task.conditions.horizon)
        ending = classifier.classify(run, measure_all(run.last, task.law.observation_model)[0])
        rests = run.stopped in (SERVED_AT, REST, POISED)
        found.append(
            Outcome(ending, run.last.pose(task.setup.motion.link), run.commands[-1].size) if rests else Outcome(ending)
        )
    return found
