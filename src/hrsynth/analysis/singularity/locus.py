"""The locus of singular poses over a plane of poses: what is reached, and where the condition vanishes there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ...batch.pose_continuation import explain_grid_dependence, sweep, track_to_pose, track_to_request
from ...errors import BadRequest, NoReachablePose, PoseReachFailure
from ...geometry.so3 import turn_about
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import FileCoordinates, list_coordinate_joints, read_joints
from ...kinematics.limits import mark_beyond_limits
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Mechanism
from ...mechanism.pose import TURNS, FixedParts, Grid, GridValues, JointPose, Pose, compute_rpy, convert_to_pose
from ...progress import report
from ...records import BEYOND_LIMITS, As, Number, Recorded, Shown, Table, recorded
from ...results import Value
from ...tolerances import RELATION_ANGLE_TOL, SINGULAR_POSE_DISTANCE_TOL
from ..measured import MeasuredRobot
from ..observation_inputs import CameraLike, SensorLike
from ..observed import ObservedRobot
from .batch_spectrum import Quick
from .condition_check import compute_smallest_value, compute_spectrum, descend
from .rank_curve import PlaneOfPoses

ON_PLANE = 10**-4.5
"""Deviation (characteristic lengths, radians) up to which a singular pose lies in a plane of poses."""
COARSE_GRID_SIDE_COUNT = 25
"""Poses per side of the grid that finds the reach in a plane."""
BOUNDARY_REFINEMENT_COUNT = 4
"""Refinement of the border of that grid."""
LOCUS_SIDES = (2.5, 5.0)
"""Half-sides of that grid (characteristic lengths); the second if the robot reaches the border of the first."""

ISOLATED_POSE_STARTS_COUNT = 8
"""Valleys of the smallest singular value from which an isolated singular pose is sought."""

PLANE_SIDE_POSES_COUNT = 51
"""Poses a side of a drawn plane."""


@dataclass(frozen=True, eq=False, repr=False)
class SingularityMap(Value):
    """Singularity map of a robot over a plane. It has the expression's value, the smallest singular value (Type 2 where
    zero) and the inverse of the largest (Type 1 where zero), each (nx, ny), NaN where no pose is reached; if the
    expression has no sign, ``spots`` are singular poses (k, 2) that were found, and ``curve`` pieces (k, 2, 2) of the
    curve; ``never`` if the condition cannot vanish, ``everywhere`` if it applies to all poses."""

    value: Annotated[Array, list[list[Number]], As("expression"), "null: not reached"]
    signed: bool
    type2: Annotated[Array, list[list[Number]]]
    type1: Annotated[Array, list[list[Number]]]
    spots: Annotated[Array, list[list[float]], As("poses")]
    curve: Annotated[Array, list[list[list[float]]]]
    never: bool
    everywhere: bool


@dataclass(frozen=True, eq=False, repr=False)
class Locus(Value):
    """The fields of the hidden and, where it has motors that determine its platform, the real robot over a plane."""

    grid: Grid
    hidden: Recorded[SingularityMap]
    real: Recorded[SingularityMap | None]
    beyond: Annotated[NDArray[np.bool_] | None, Table | None, As("beyond_limits", optional=True), BEYOND_LIMITS] = None

    @property
    @recorded()
    def reached(self) -> int:
        """Number of its poses that the robot reaches."""
        return int(np.sum(np.isfinite(self.hidden.type2)))

    axes = Shown(GridValues, lambda self: self.grid.values_record)
    fixed = Shown(Pose | FixedParts, lambda self: self.grid.fixed_record if self.grid.joints else self.grid.fixed)


def compute_locus(
    robot: Mechanism | ObservedRobot,
    observe: Sequence[str] | str | None = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    plane: Pose | str | None = None,
    grid: Grid | str | None = None,
    steps: int = PLANE_SIDE_POSES_COUNT,
    seed: int = 0,
) -> Locus:
    """Singularity loci of the hidden and the real robot (with its motors) over a plane of poses, or over a ``grid`` of
    two parts of the pose, joints or motors.

    ``plane`` fixes parts of the pose so that two are free; a robot that is only partially controllable has no locus
    (``BadRequest``). Raises ``NoReachablePose`` if no pose of the plane is reached.
    """
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed)
    hidden = _require_controllable(setup)
    real = None
    if any(joint.is_actuated for joint in setup.mechanism.joints.values()):
        driven = MeasuredRobot.of(setup, real=True)
        real = driven if driven.rank == setup.dof else None
    return _compute_both_loci(
        hidden, real, None if plane is None else convert_to_pose(plane), _parse_locus_grid(grid, plane), steps
    )


def _parse_locus_grid(grid: Grid | str | None, plane: Pose | str | None) -> Grid | None:
    """Return the grid of a locus; raises ``BadRequest`` unless it has two ranges and no plane is given."""
    cells = None if grid is None else Grid.parse(grid)
    if cells is not None and plane is not None:
        raise BadRequest("--plane and --grid", f"{plane} and {cells}", "one of them")
    if cells is not None and cells.ndim != 2:
        raise BadRequest(f"--grid {cells}: number of ranges of a locus", cells.ndim, "two")
    return cells


def require_plane(setup: ObservedRobot, plane: Pose | str | None, grid: Grid | str | None = None) -> None:
    """Raise what ``locus`` would raise of the robot or of the plane: before long work, not after it."""
    hidden = _require_controllable(setup)
    if _parse_locus_grid(grid, plane) is not None:
        return
    _start_plane(
        setup.all_samples.start,
        hidden.observation_model,
        setup.motion,
        None if plane is None else convert_to_pose(plane),
    )


def _require_controllable(setup: ObservedRobot) -> MeasuredRobot:
    """The hidden robot; raises ``BadRequest`` where it has no locus."""
    hidden = MeasuredRobot.of(setup)
    if hidden.verdict.rank < setup.dof:
        raise BadRequest(
            f"{setup.robot.name} has no singularity locus: a platform dof is unobserved at every pose",
            remedy="Observe legs that make it controllable (hrsynth legs).",
        )
    return hidden


def _compute_both_loci(
    hidden: MeasuredRobot, real: MeasuredRobot | None, plane: Pose | None, grid: Grid | None, steps: int
) -> Locus:
    """Both robots over the grid, or the plane that ``plane`` fixes (default: of three parts the third as at the zero
    configuration).

    Raises ``NoReachablePose`` where no pose of it is reached, ``BadRequest`` where it does not leave two parts free.
    """
    observation_model, motion, start = hidden.observation_model, hidden.setup.motion, hidden.setup.all_samples.start
    placer = hidden.setup.placer

    def met(first: ClosedConfiguration, coarse: Grid) -> NDArray[np.bool_]:
        return np.array([at is not None for at in sweep(first, observation_model, coarse, motion, placer)])

    grid = grid or choose_plane_grid(start, observation_model, motion, plane, steps, met)
    configurations = sweep(start, observation_model, grid, motion, placer)
    if not any(configurations):
        raise NoReachablePose(
            start.model.mechanism.name,
            f"the plane {grid.fixed}",
            "none of its poses is reached",
            explain_grid_dependence(start, motion, grid),
        )

    def field(measured: MeasuredRobot) -> SingularityMap:
        report("locus")
        condition = measured.condition
        reached = [(i, at) for i, at in enumerate(configurations) if at is not None]
        places, here = [i for i, _ in reached], [at for _, at in reached]
        quick = Quick.of(placer, measured.observation_model)
        smallest, largest = (
            compute_spectrum(here, measured.observation_model)
            if quick is None
            else quick.spectrum(here, compute_spectrum)
        )
        value = condition.evaluate(measured.pattern.values_at(here))
        tables = []
        for column in (value, smallest, 1 / np.where(largest > 0, largest, np.nan)):
            table = np.full(len(configurations), np.nan)
            table[places] = column
            tables.append(table.reshape(grid.shape))
        spots, curve = np.zeros((0, 2)), np.zeros((0, 2, 2))
        if not (condition.signed or condition.never):
            spots = _find_isolated_poses(grid, [here[places.index(i)] for i in _find_valleys(tables[1])], measured)
            curve = PlaneOfPoses(measured.observation_model, motion, grid).curve(configurations)
            spots = _drop_near_curve(spots, curve, grid)
        return SingularityMap(
            tables[0], condition.signed, tables[1], tables[2], spots, curve, condition.never, not measured.unexamined
        )

    beyond = mark_beyond_limits(configurations)
    return Locus(
        grid,
        field(hidden),
        None if real is None else field(real),
        None if beyond is None else beyond.reshape(grid.shape),
    )


def choose_plane_grid(
    start: ClosedConfiguration,
    observation_model: ObservationModel,
    motion: PlatformMotion,
    plane: Pose | None,
    steps: int,
    met: Callable[[ClosedConfiguration, Grid], NDArray[np.bool_]],
) -> Grid:
    """Return the grid around the reached part of a plane; ``met`` is the mask of reached cells of a coarse one, (n,).
    Raises ``NoReachablePose`` if the plane is out of reach, ``BadRequest`` unless two parts are free."""
    plane, names, first = _start_plane(start, observation_model, motion, plane)
    centre = _read_coordinates(motion, first, names)
    centre = [0.0 if name == "phi" else c for name, c in zip(names, centre, strict=True)]
    for wide in LOCUS_SIDES:
        half = [np.pi if name == "phi" else wide * start.model.length for name in names]
        axes = [
            (name, np.linspace(c - h, c + h, COARSE_GRID_SIDE_COUNT))
            for name, c, h in zip(names, centre, half, strict=True)
        ]
        coarse = Grid(tuple(axes), plane)
        cells = np.argwhere(met(first, coarse).reshape(coarse.shape))
        if not len(cells):
            cells = np.array([[COARSE_GRID_SIDE_COUNT // 2, COARSE_GRID_SIDE_COUNT // 2]])
        if cells.min() > 0 and cells.max() < COARSE_GRID_SIDE_COUNT - 1:
            break
    steps_apart = np.array([values[1] - values[0] for _, values in axes])
    found = np.array(
        [
            [values[low], values[high]]
            for (_, values), low, high in zip(axes, cells.min(axis=0), cells.max(axis=0), strict=True)
        ]
    )
    beside = {}
    for axis, end in product(range(2), range(2)):
        (pose,) = coarse.poses_at([cells[np.argsort(cells[:, axis], kind="stable")[-end]]])
        try:
            beside[axis, end] = track_to_pose(first, observation_model, pose, motion)
        except PoseReachFailure:
            beside[axis, end] = first
    moved = np.inf
    while moved > 1:
        before = found.copy()
        for (axis, end), near in beside.items():
            found[axis, end] = _find_plane_end(coarse, found, axis, end, partial(met, near))
        moved = float(np.max(np.abs(found - before) / steps_apart[:, None]))
    window = found + 0.75 * steps_apart[:, None] * [-1, 1]
    return Grid(
        tuple((name, np.linspace(low, high, steps)) for (name, _), (low, high) in zip(axes, window, strict=True)), plane
    )


def _start_plane(
    start: ClosedConfiguration, observation_model: ObservationModel, motion: PlatformMotion, plane: Pose | None
) -> tuple[Pose, tuple[str, ...], ClosedConfiguration]:
    """The plane's fixed parts, the two that vary, and a configuration in it; raises as ``framed``."""
    plane, names = _choose_axes(start, motion, plane)
    try:
        return plane, names, track_to_pose(start, observation_model, plane, motion) if plane.given else start
    except PoseReachFailure as error:
        name = start.model.mechanism.name
        raise NoReachablePose(name, f"the plane {plane}", error.problem.removeprefix(f"{name}: ")) from None


def _find_plane_end(coarse: Grid, found: Array, axis: int, end: int, met: Callable[[Grid], NDArray[np.bool_]]) -> float:
    """Return the reached extent of a plane along one axis, to half a step of the coarse grid: ``found`` (2, 2) by it,
    and thinner tips beyond, of which cells are ``BOUNDARY_REFINEMENT_COUNT``."""
    (_, along), (_, across) = coarse.axes[axis], coarse.axes[1 - axis]
    step, apart, last = (along[1] - along[0]) * (2 * end - 1), across[1] - across[0], float(found[axis, end])
    low, high = found[1 - axis]
    columns = np.arange(low - apart, high + apart, apart / BOUNDARY_REFINEMENT_COUNT)
    while (along[-end] - last) / step > 0.5:
        rows = last + step * np.arange(0, 2, 0.5)
        axes = ((coarse.names[axis], rows), (coarse.names[1 - axis], columns))
        there = met(Grid(axes if axis == 0 else axes[::-1], coarse.fixed))
        cells = there.reshape((len(rows), -1) if axis == 0 else (-1, len(rows)))
        reached = np.flatnonzero(np.any(cells, axis=1 - axis))
        if not (reached > 0).any():
            break
        last = float(rows[reached[-1]])
    return last


def _choose_axes(
    start: ClosedConfiguration, motion: PlatformMotion, plane: Pose | None
) -> tuple[Pose, tuple[str, ...]]:
    """The plane's fixed parts, without those that never change, and the two that vary."""
    plane = plane or Pose()
    name = start.model.mechanism.name
    motion.goal(plane, name)
    plane = plane.without(part for part in plane.given if part not in motion.parts)
    fixed = set(plane.given)
    turned = bool(fixed & {"phi", "rpy"})
    parts = [part for part in motion.parts if part != "rpy" and not (part == "phi" and turned)]
    if not fixed and motion.is_planar:
        plane, turned = replace(plane, phi=0.0), True
    places = [part for part in parts if part in "xyz" and part not in fixed]
    count = motion.shifts - len(fixed & set("xyz"))
    if count == 3:
        plane, places, count = replace(plane, z=round(_read_coordinates(motion, start, ("z",))[0], 9)), places[:2], 2
    if count == 2:
        return plane, max(combinations(places, 2), key=lambda pair: _spread(motion, pair))
    if count == 1 and "phi" in parts and not turned and motion.dof > motion.shifts:
        return plane, (places[0], "phi")
    left = [part for part in parts if part in places or (part == "phi" and motion.dof > motion.shifts)]
    told = " and ".join(left) + (", which depend on each other" if len(left) > 1 else "")
    allowed = ["fewer fixed parts"] if fixed else []
    allowed += [f"--grid {left[0]}=-0.1:0.1:9 of check, accuracy or basins for a line of poses"] if left else []
    motors = [joint.name for joint in list_coordinate_joints(start.model.mechanism, motors=True)]
    allowed += [f"--grid motors:{motors[0]}=-0.5:0.5:41,{motors[1]}=-0.5:0.5:41"] if len(motors) > 1 else []
    raise BadRequest(
        f"{f'--plane {plane}'.strip()}: two parts of the pose of {name} must be free, here {told or 'none'}",
        remedy=f"Use {', or '.join(allowed) or 'single poses'}.",
    )


def _spread(motion: PlatformMotion, pair: tuple[str, str]) -> float:
    """Volume of the rows of two position coordinates."""
    rows = motion.translations[["xyz".index(name) for name in pair]]
    return round(float(np.linalg.svd(rows, compute_uv=False).prod()), 9)


def _read_coordinates(motion: PlatformMotion, at: ClosedConfiguration, names: Sequence[str]) -> list[float]:
    X = at.pose(motion.link)
    position, turn = motion.position(X), X[:3, :3] @ motion.home[:3, :3].T
    return [
        turn_about(motion.normal, turn)[0] if name == "phi" else float(position["xyz".index(name)]) for name in names
    ]


def _read_place(grid: Grid, motion: PlatformMotion, at: ClosedConfiguration) -> list[float]:
    """The values of what varies in a grid at a configuration."""
    if grid.joints:
        joints = read_joints(at)
        return [joints[name][0] for name in grid.names]
    if {*TURNS} & {*grid.names}:
        X = at.pose(motion.link)
        values = dict(zip(TURNS, compute_rpy(X[:3, :3] @ motion.home[:3, :3].T), strict=True))
        values |= dict(zip("xyz", motion.position(X).tolist(), strict=True))
        return [values[name] for name in grid.names]
    return _read_coordinates(motion, at, grid.names)


def _measure_deviation(
    start: ClosedConfiguration, at: ClosedConfiguration, asked: Pose | JointPose, motion: PlatformMotion
) -> float:
    """Deviation of a configuration from a requested pose (characteristic lengths, radians; of joints metres)."""
    if not isinstance(asked, JointPose):
        return float(np.linalg.norm(motion.goal(asked).error_and_jacobian(at.model, at.q)[0]))
    joints, at_zero = read_joints(at), read_joints(start)
    stay = FileCoordinates.of(start).motors if asked.motors else ()
    wanted = {**{name: at_zero[name] for name in stay}, **dict(asked.values)}
    return max(float(np.max(np.abs(np.subtract(joints[name], values)))) for name, values in wanted.items())


def _find_valleys(table: Array) -> list[int]:
    """The deepest cells that are lower than all their neighbours, by their flat index."""
    filled = np.where(np.isfinite(table), table, np.inf)
    padded = np.pad(filled, 1, constant_values=np.inf)
    nx, ny = table.shape
    around = [padded[i : i + nx, j : j + ny] for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    cells = np.flatnonzero((filled < np.inf) & (filled <= np.min(around, axis=0)))
    return sorted(map(int, cells), key=lambda cell: float(filled.flat[cell]))[:ISOLATED_POSE_STARTS_COUNT]


def _is_singular_in_same_mode(
    start: ClosedConfiguration, asked: Pose | JointPose, observation_model: ObservationModel, motion: PlatformMotion
) -> bool:
    """Return True if a requested pose is singular in the working mode of ``start``, too."""
    try:
        there = track_to_request(start, observation_model, asked, motion)
    except PoseReachFailure:
        return False
    return compute_smallest_value(there, observation_model) < RELATION_ANGLE_TOL


def _drop_near_curve(spots: Array, curve: Array, grid: Grid) -> Array:
    """The singular poses that are more than a cell away from a curve."""
    if not len(curve):
        return spots
    cell = np.array([values[1] - values[0] for _, values in grid.axes])
    away = np.abs((spots[:, None] - curve.reshape(-1, 2)) / cell).max(axis=2).min(axis=1)
    return np.asarray(spots[away > 1])


def _find_isolated_poses(grid: Grid, starts: Sequence[ClosedConfiguration], measured: MeasuredRobot) -> Array:
    """Singular poses in the plane, searched from its poses of smallest singular value."""
    motion, observation_model = measured.setup.motion, measured.observation_model
    found: list[list[float]] = []
    for start in starts:
        at = descend(start, observation_model, measured.pattern, measured.condition)
        if at is None:
            continue
        place = _read_place(grid, motion, at)
        asked = grid.request(place)
        new = all(np.linalg.norm(np.subtract(place, other)) > SINGULAR_POSE_DISTANCE_TOL for other in found)
        if new and _measure_deviation(start, at, asked, motion) < ON_PLANE:
            pose = asked if isinstance(asked, JointPose) else motion.pose(at.pose(motion.link))
            if _is_singular_in_same_mode(start, pose, observation_model, motion):
                found.append(place)
    return np.array(found).reshape(-1, 2)
