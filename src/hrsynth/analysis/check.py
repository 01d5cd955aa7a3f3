"""Mobility, ranks, singularities and redundant constraints of a robot at given poses, and over a grid of poses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..batch.pose_continuation import explain_grid_dependence, sweep
from ..errors import (
    BadMechanism,
    NoPlatform,
    NoReachablePose,
    NoSegment,
    PoseReachFailure,
    SamplingFailure,
    UndecidedRank,
)
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.limits import mark_beyond_limits
from ..kinematics.operation_modes import SAMPLE_PATH_STEPS_COUNT, choose_firmest, require_motions
from ..kinematics.pinocchio_model import PinocchioModel
from ..kinematics.walking import walk_randomly
from ..mechanism import Mechanism
from ..mechanism.pose import Grid, PoseLike, parse_poses
from ..options import option
from ..progress import report
from ..records import BEYOND_LIMITS, FLAT, GAP, OPTIONAL, As, Recorded, Shown, Table, recorded
from ..results import Result, Value
from ..tolerances import RANK_GAP_MIN
from .analysis_declaration import analysis
from .configuration_report import ConfigurationAnalysis, ConfigurationReport
from .observation_inputs import POINTS, POSES, CameraLike, LegsLike, Seed, SensorLike
from .observed import Mobility, ObservedRobot, RobotLike
from .pose_requests import require_platform, solve_requested_poses
from .setup_records import LIMITS_IGNORED, MOBILITY, OBSERVATIONS, compute_mobility_as_written
from .singularity_indices import Redundancy, find_generic_rows, list_redundant

UNREACHABLE = "unreachable"
MEASURES = ("type2", "type1", "constraints", "condition", "mm_per_degree", "degrees_per_degree")


@dataclass(frozen=True, eq=False, repr=False)
class GridCheck(Value):
    """Configurations over a grid of poses, in its order; None where a pose is not reached."""

    grid: Annotated[Grid, FLAT]
    postures: tuple[ConfigurationReport | None, ...]
    free: Recorded[tuple[str, ...]]
    """Parts of the pose that are neither varied nor fixed."""
    dependent: str | None = None
    """Statement that parts of its poses depend on each other, if some are not reached."""

    @property
    def states(self) -> tuple[str, ...]:
        """The kind of singularity of each cell in one word, or that it is not reached or not decided."""
        return tuple(UNREACHABLE if each is None else each.hidden.state for each in self.postures)

    def values(self, measure: str) -> tuple[float | None, ...]:
        """One of ``MEASURES`` at each cell; None where the pose is not reached or the value is infinite."""
        return tuple(None if each is None else each.distances.to_dict()[measure] for each in self.postures)

    @cached_property
    def beyond(self) -> NDArray[np.bool_] | None:
        """Mask of the cells at which joints are beyond their limits, in the grid's shape; None without limits."""
        marked = mark_beyond_limits([None if posture is None else posture.configuration for posture in self.postures])
        return None if marked is None else marked.reshape(self.grid.shape)

    def nested(self, values: Sequence[Any]) -> Table:
        """A value of each cell, nested in the order of ``axes``."""
        told: Table = np.array(values, dtype=object).reshape(self.grid.shape).tolist()
        return told

    state = Shown(Table, lambda self: self.nested(self.states))
    type2 = Shown(Table, lambda self: self.nested(self.values("type2")))
    type1 = Shown(Table, lambda self: self.nested(self.values("type1")))
    constraints = Shown(Table, lambda self: self.nested(self.values("constraints")))
    condition = Shown(Table, lambda self: self.nested(self.values("condition")))
    mm_per_degree = Shown(Table, lambda self: self.nested(self.values("mm_per_degree")))
    degrees_per_degree = Shown(Table, lambda self: self.nested(self.values("degrees_per_degree")))
    beyond_limits = Shown(Table | None, lambda self: self.beyond, OPTIONAL, BEYOND_LIMITS)


class UnreachedPose(NamedTuple):
    """A requested pose, as it was written, and why it is not reached."""

    pose: str
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class Check(Result, shown_as="check"):
    """Results of a check at poses.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    postures
        Report on the configuration at each requested pose.
    redundant
        Loop constraints that are redundant at generic configurations.
    grid
        Results over a grid, if requested.
    unreached
        Requested poses that the robot does not reach.
    """

    setup: Annotated[ObservedRobot, FLAT]
    postures: Annotated[tuple[ConfigurationReport, ...], As("configurations")]
    redundant: Recorded[tuple[Redundancy, ...]]
    grid: Recorded[GridCheck | None] = None
    unreached: tuple[PoseReachFailure, ...] = ()
    """Requested poses that the robot does not reach, with the reason."""

    @property
    @recorded(As("characteristic_length"))
    def length(self) -> float:
        """The characteristic length (m) that makes lengths comparable with angles."""
        return self.setup.all_samples.model.length

    @property
    def as_written(self) -> Mobility | None:
        """The mobility of the file's own links and joints, None where no samples of them can be drawn."""
        return compute_mobility_as_written(self.setup)

    def require_answered(self, at: Any = None, **asked: Any) -> None:
        """Raise ``UndecidedRank`` or ``PoseReachFailure`` for requested poses."""
        for posture in self.postures if at else ():
            if not posture.has_decided_ranks:
                raise UndecidedRank(
                    f"{self.setup.robot.name} at {posture.pose}", posture.gap, RANK_GAP_MIN, "Choose another pose."
                )
        if self.unreached:
            raise PoseReachFailure.of_all(self.unreached)

    def headline(self) -> str:
        """The robot, and the state of its hidden robot at each pose."""
        dof, states = self.setup.dof, list[str]()
        for each in self.postures:
            rank = each.hidden.rank
            states.append(
                f"{each.pose} {each.hidden.state}" + ("" if rank == dof else f", observes {rank} of {dof} dof")
            )
        states += [f"{each.pose} not reached" for each in self.unreached]
        return f"{self.setup.headline()}: {'; '.join(states)}"

    unreached_record = Shown(
        list[UnreachedPose],
        lambda self: [UnreachedPose(each.pose, each.reason) for each in self.unreached],
        As("unreached"),
    )
    observations = OBSERVATIONS
    mobility = MOBILITY
    limits_ignored = LIMITS_IGNORED


class LoopMobility(NamedTuple):
    """Mobility of the mechanism as the file describes it."""

    total: int


class LoopRank(NamedTuple):
    """Rank of all loop constraints at a generic configuration, with its margins."""

    loops: Annotated[tuple[str, ...], "the loops, and the couplings of joints"]
    coordinates: Annotated[int, "joint coordinates, including those of joints at which loops are cut"]
    rows: Annotated[int, "constraints of the loops"]
    rank: Annotated[int, "number of independent ones"]
    gap: Annotated[float, GAP]
    smallest_kept: Annotated[float, "smallest singular value that counts, relative to the largest"]
    largest_dropped: Annotated[float, "largest one that does not count, relative to the largest: at least rounding"]


@dataclass(frozen=True, eq=False, repr=False)
class LoopCheck(Result, shown_as="loop_check"):
    """Loop check, for a mechanism without a known platform or segment.

    Parameters
    ----------
    robot
        Mechanism as read.
    mobility
        Mobility of its links and joints.
    constraints
        Rank of the loop constraints, with its margins.
    redundant
        Redundant constraints by loop.
    more
        What a full check needs.
    """

    robot: Mechanism
    mobility: Recorded[LoopMobility]
    constraints: Recorded[LoopRank]
    redundant: Recorded[tuple[Redundancy, ...]]
    more: Recorded[tuple[str, ...]]

    @property
    def command(self) -> str:
        """Command that prints the result."""
        return "check"

    @classmethod
    def of(cls, robot: Mechanism, why: str) -> LoopCheck:
        """Return the loop check of a mechanism, and ``why`` no more is possible; raises ``SamplingFailure``,
        ``UndecidedRank``, ``InfinitesimalMobility``."""
        model = PinocchioModel(robot)
        start = ClosedConfiguration.of(model, model.q0)
        names, sizes = model.blocks
        moves = bool(names) and start.kernel()[0].shape[1] > 0
        found = (
            list(walk_randomly(start, 2 * SAMPLE_PATH_STEPS_COUNT, steps=SAMPLE_PATH_STEPS_COUNT)) if moves else [start]
        )
        if moves:
            require_motions(found)
        kernel, rank = choose_firmest(found).kernel()
        rank.decided(f"{robot.name}: the constraints of its loops")
        told = LoopRank(names, model.nv, sum(sizes), rank.value, rank.gap, rank.weakest, rank.dropped)
        redundant = list_redundant(find_generic_rows(found), generic=True)
        more = (why, *([robot.proposed_motors] if robot.proposed_motors else []))
        return cls(robot, LoopMobility(kernel.shape[1]), told, redundant, more)

    @property
    @recorded(As("characteristic_length"))
    def length(self) -> float:
        """The characteristic length (m) that makes lengths comparable with angles."""
        return self.robot.length

    def said(self) -> tuple[Any, ...]:
        """Return what equality compares."""
        return self.robot, self.to_dict()

    def headline(self) -> str:
        """The robot, its mobility, and its redundant constraints."""
        rows = sum(each.rows for each in self.redundant)
        return f"{self.robot.name}: mobility {self.mobility.total}, {rows} redundant constraints"


Checked = Check | LoopCheck


@analysis(
    30,
    examples=(
        "quattro --at x=0.02,phi=30deg",
        "quattro --grid x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 -o map.png",
        f"gough_stewart {POINTS} --at x=0.02",
    ),
    formations=True,
)
def check(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    at: Annotated[
        PoseLike | Iterable[PoseLike],
        option(f"A pose, such as x=0.02,y=0.1,z=-0.7,phi=10deg; {POSES}", "POSE", kind=list[str]),
    ] = (),
    grid: Annotated[
        Grid | str | None,
        option(
            "A line, plane or box of poses, such as x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 (from:to:count) or "
            "motors:NAME=-0.5:0.5:21.",
            "GRID",
        ),
    ] = None,
    seed: Seed = 0,
) -> Checked:
    """Mobility, ranks, singularities and redundant constraints at poses, and over a grid of poses.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    at
        Poses (m, rad, base coordinates); default: the zero configuration.
    grid
        Line, plane or box of poses, such as ``x=-0.3:0.3:21,y=0`` (from:to:count) or ``motors:arm_1=-0.5:0.5:21``.
    seed
        Seed of the random configurations that define generic values.

    Returns
    -------
    Check or LoopCheck
        Mobility, ranks with gaps, Type 1, 2, 3, singularity indices, constraint singularities and redundant
        constraints; poses out of reach in ``unreached``. A ``LoopCheck`` (mobility and loop constraints only) if the
        file names no platform or no leg has a segment, and neither poses nor observations are requested.

    Raises
    ------
    BadRequest
        For unknown names, and for parts of a pose that the platform cannot change.
    PoseReachFailure, NoReachablePose
        If no pose, or none of the grid, is reached.

    Notes
    -----
    Statements about the hidden robot use the real robot's velocity relation with the observed directions, which is that
    of the exact lift at every closed configuration (theory.md 3), not the form of ``derive``. Those about the real
    robot use its motor coordinates as measured values (docs/pages/theory.md, section 7).

    Examples
    --------
    >>> hrsynth.check("3rrr_m1", at=["x=0,y=0,phi=0", [0.01, 0, 0]])
    <Check: 3rrr_m1, observing 1, 2, 3: x=0,y=0,z=0,phi=0deg regular; x=0.01,y=0,z=0,phi=0deg regular>
    """
    poses = parse_poses(at)
    cells = None if grid is None else Grid.parse(grid)
    try:
        setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).printing_like(poses)
    except (NoPlatform, NoSegment, BadMechanism, SamplingFailure) as error:
        if (
            not isinstance(robot, Mechanism)
            or poses
            or any(each is not None for each in (cells, observe, camera, sensor))
        ):
            raise
        return LoopCheck.of(robot, str(error).removeprefix(f"{robot.file or robot.name}: "))
    examiner = ConfigurationAnalysis.of(setup)
    start, observation_model, motion = setup.all_samples.start, setup.all_samples.observation_model, setup.motion
    found = solve_requested_poses(setup, poses) or [start]
    configurations = [each for each in found if isinstance(each, ClosedConfiguration)]
    unreached = tuple(each for each in found if isinstance(each, PoseReachFailure))
    if not configurations:
        raise PoseReachFailure.of_all(unreached)
    report("poses")
    postures = tuple(map(examiner.examine, configurations))
    swept = None
    if cells is not None:
        require_platform(setup.robot, cells)
        places = sweep(start, observation_model, cells, motion, setup.placer)
        dependent = None if all(places) else explain_grid_dependence(start, motion, cells)
        if not any(places):
            raise NoReachablePose(setup.robot.name, f"the grid {cells}", f"none of {len(places)} is", dependent)
        swept = GridCheck(
            cells,
            tuple(None if each is None else examiner.classify(each) for each in places),
            () if cells.joints else motion.free(cells.parts),
            dependent,
        )
    return Check(setup, postures, list_redundant(examiner.redundant, generic=True), swept, unreached)
