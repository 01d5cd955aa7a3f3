"""Error maxima over a grid of poses: by the batch if every leg is a known subproblem, else from pose to pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ...batch.engine import Batch, Evaluation
from ...batch.grids import list_grid_poses
from ...batch.pose_continuation import explain_grid_dependence, sweep, track_to_pose
from ...errors import BadRequest, Disagreement, HrsynthError, NoReachablePose
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import has_limits, mark_beyond_limits
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism.pose import GRID_CELLS_MAX, Grid, JointPose, Pose
from ...progress import report
from ...records import BEYOND_LIMITS, DEG, FLAT, MM, As, Recorded, Table, recorded
from ...results import Value
from ...tolerances import RELATION_ANGLE_TOL
from ..observed import ObservedRobot
from ..singularity.locus import choose_plane_grid
from ..singularity.rank_curve import PlaneOfPoses
from .measurement_bounds import MeasurementBounds, find_invisible
from .pose_errors import bound_pose_errors, compute_rates_and_twists

CHECKED_ERROR_MAX_FRACTION = 100.0
"""Multiple of the median error of a field up to which a pose is checked with longer numbers."""
NUMBA_SINGLE_BATCH_POSES_MIN = 500_000
"""Poses of a single batch from which compiled kernels are faster."""

Flags = NDArray[np.bool_]
ERROR_MAP_CHUNK_COUNT = 25_000
"""Poses, at least, that are evaluated between two signs of progress."""
ERROR_MAP_CHECKED_POSES_COUNT = 10
"""Number of poses of a grid at which the batch is compared with Pinocchio."""
FINE, LIMITED, COARSE = 201, 101, 41
"""Poses a side of a plane by the batch, by the batch with joint limits, and one by one."""


@dataclass(frozen=True, eq=False, repr=False)
class ErrorField(Value):
    """Errors at poses of a sweep, all (n,), NaN where not reached: position (m), orientation (rad), determinant of the
    directions' rates (None unless there are as many as dof), smallest singular value of Mᵀ. ``gap`` bounds the relative
    overestimate; ``curve`` has pieces (k, 2, 2) of the singular curve for poses of a plane that were solved one by one
    (else None)."""

    reached: Flags
    position: Array
    orientation: Array
    determinant: Callable[[], Array | None]
    smallest: Callable[[], Array]
    gap: float
    curve: Callable[[], Array] | None = None
    beyond: Flags | None = None
    """Mask of the poses with joints beyond their limits; None without limits, or where they are not checked."""


@dataclass(frozen=True, eq=False, repr=False)
class SpotChecks(Value, all_recorded=True):
    """Random poses of a grid at which Pinocchio's relation gave the same error maxima: how many, and the largest
    difference (relative)."""

    count: Annotated[int, As("poses")]
    difference: float


@dataclass(frozen=True, eq=False, repr=False)
class ErrorMap(Value):
    """Error maxima over a grid, in its shape: position (m) and orientation (rad), NaN where no pose is reached,
    infinite where a platform dof is unobserved. ``smallest_at`` evaluates the smallest singular value of Mᵀ (n,) at
    other poses of the grid (values of its axes (n, ndim)); None for poses solved one by one.
    ``dependent`` states that parts of these poses depend on each other, if some are not reached."""

    grid: Annotated[Grid, FLAT]
    reached: Annotated[Flags, Table]
    position: Annotated[Array, Table, As("position_mm", scale=MM)]
    orientation: Annotated[Array, Table, As("orientation_deg", scale=DEG)]
    gap: Recorded[float]
    seen: ErrorField
    spots: Annotated[SpotChecks | None, As("checked")]
    smallest_at: Callable[[Array], Array] | None
    dependent: str | None = None

    @cached_property
    @recorded(As("beyond_limits", optional=True), Table | None, BEYOND_LIMITS)
    def beyond(self) -> Flags | None:
        """Mask of the poses with joints beyond their limits, in the grid's shape; None where limits are not checked."""
        return None if self.seen.beyond is None else self.seen.beyond.reshape(self.grid.shape)

    @cached_property
    def determinant(self) -> Array | None:
        """The determinant whose sign changes at a Type 2 singularity, in the grid's shape; None where there is none."""
        found = self.seen.determinant()
        return None if found is None else found.reshape(self.grid.shape)

    @cached_property
    def curve(self) -> Array | None:
        """Pieces (k, 2, 2) of the curve of singular poses in a plane, by its two parts; None where poses were not found
        one by one."""
        return None if self.seen.curve is None else self.seen.curve()

    @cached_property
    def smallest(self) -> Array:
        """The smallest singular value of Mᵀ, in the grid's shape."""
        return self.seen.smallest().reshape(self.grid.shape)

    def worst(self, count: int) -> list[Pose | JointPose]:
        """The poses of the largest finite position errors (orientation errors where there are no others)."""
        errors = self.position if np.nanmax(self.position, initial=0.0) > 0 else self.orientation
        flat = np.where(np.isfinite(errors), errors, -1.0).ravel()
        cells = [int(i) for i in np.argsort(-flat, kind="stable")[:count] if flat[i] > 0]
        return list(self.grid.requests_at([tuple(map(int, np.unravel_index(i, self.grid.shape))) for i in cells]))


@dataclass(frozen=True, eq=False, repr=False)
class Mapper(Value):
    """Evaluation of the errors over grids."""

    setup: ObservedRobot
    blur: MeasurementBounds

    @property
    def observation_model(self) -> ObservationModel:
        """Observation model that is evaluated at each pose."""
        return self.setup.samples.observation_model

    @cached_property
    def batch(self) -> Batch | None:
        """The batch, where it knows all legs, all observed directions are its own, and any pose is one of the
        platform's."""
        defaults = set(map(id, self.setup.segments))
        if not all(id(o) in defaults for o in self.setup.observed):
            return None
        batch = self.setup.batch
        return batch if batch is not None and batch.is_complete and batch.coordinates.has_constant_twists else None

    def plane(self, plane: Pose, steps: int | None) -> Grid:
        """Return the grid over the reachable part of a plane."""
        all_samples, motion = self.setup.all_samples, self.setup.motion

        def met(first: ClosedConfiguration, coarse: Grid) -> Flags:
            if self.batch is not None:
                X, possible = list_grid_poses(motion, coarse, self.setup.robot.name, coarse.places())
                return possible & self.batch.evaluate(X).reached
            return np.array([at is not None for at in sweep(first, all_samples.observation_model, coarse, motion)])

        count = steps or (COARSE if self.batch is None else LIMITED if has_limits(self.setup.mechanism) else FINE)
        return choose_plane_grid(all_samples.start, all_samples.observation_model, motion, plane, count, met)

    def over(self, grid: Grid, seed: int, checked: int = ERROR_MAP_CHECKED_POSES_COUNT) -> ErrorMap:
        """The error maxima over a grid, by the batch ``checked`` at so many poses; raises ``NoReachablePose`` where no
        pose of it is reached, ``BadRequest`` where poses have to be found one by one and are too many for that."""
        name = self.setup.robot.name
        batch = None if grid.joints else self.batch
        if batch is None and grid.size > GRID_CELLS_MAX:
            raise BadRequest(
                f"{name}: the poses of this robot are solved one by one; number of poses",
                grid.size,
                f"at most {GRID_CELLS_MAX}",
            )
        seen = self._one_by_one(grid) if batch is None else self._together(grid)
        dependent = (
            None
            if seen.reached.all()
            else (explain_grid_dependence(self.setup.all_samples.start, self.setup.motion, grid))
        )
        if not seen.reached.any():
            raise NoReachablePose(name, f"the grid {grid}", f"none of {grid.size} is", dependent)
        spots = smallest_at = None
        if batch is not None:
            spots, smallest_at = self.spots(grid, seen, seed, checked), partial(self._smallest, grid)
        shape = grid.shape
        position, orientation = seen.position.reshape(shape), seen.orientation.reshape(shape)
        return ErrorMap(
            grid, seen.reached.reshape(shape), position, orientation, seen.gap, seen, spots, smallest_at, dependent
        )

    def _together(self, grid: Grid) -> ErrorField:
        """Poses by the batch; of a part of them no more is kept than their errors."""
        parts = [self.errors(*part) for part in self.parts(grid, self.blur.cones)]
        reached, position, orientation = (np.concatenate([part[i] for part in parts]) for i in range(3))
        return ErrorField(
            reached,
            position,
            orientation,
            partial(self._determinant, grid),
            partial(self._smallest, grid),
            max(part[3] for part in parts),
            beyond=self._mark_beyond(grid),
        )

    def _mark_beyond(self, grid: Grid) -> Flags | None:
        """Mask of the poses of a grid with joints beyond their limits; None without limits, of too many poses, and
        where the joints of a pose are found one by one."""
        if self.setup.placer is None or not has_limits(self.setup.mechanism) or grid.size > GRID_CELLS_MAX:
            return None
        configurations: list[ClosedConfiguration | None] = []
        for start in range(0, grid.size, ERROR_MAP_CHUNK_COUNT):
            report("joint limits")
            configurations += self._configurations(
                grid, np.arange(start, min(start + ERROR_MAP_CHUNK_COUNT, grid.size))
            )
        return mark_beyond_limits(configurations)

    @staticmethod
    def errors(possible: Flags, part: Evaluation) -> tuple[Flags, Array, Array, float]:
        """For a part: mask of the reached poses, position and orientation errors there (NaN elsewhere), and their
        gap."""
        reached, bounds = possible & part.reached, (part.position, part.orientation)
        largest = [np.where(reached, each.largest, np.nan) for each in bounds if each is not None]
        return (
            reached,
            largest[0],
            largest[1],
            max(_compute_bound_gap(each.largest, each.lower) for each in bounds if each),
        )

    def _determinant(self, grid: Grid) -> Array | None:
        """The determinant of the directions' rates by the batch."""
        found = []
        for possible, part in self.parts(grid, None):
            with np.errstate(invalid="ignore"):
                if part.determinant is None:
                    return None
            found.append(np.where(possible & part.reached, part.determinant, np.nan))
        return np.concatenate(found)

    def _smallest(self, grid: Grid, places: Array | None = None) -> Array:
        """The smallest singular value of Mᵀ by the batch, of the grid or at other places of it."""
        return np.concatenate(
            [
                np.where(possible, part.singular_values[:, -1], np.nan)
                for possible, part in self.parts(grid, None, places)
            ]
        )

    def parts(self, grid: Grid, cones: Array | None, places: Array | None = None) -> Iterator[tuple[Flags, Evaluation]]:
        """Return the poses of each part of a grid (or of other ``places`` of it) that the platform can have, with the
        results of the batch; in NumPy if they are too few for numba's start."""
        count = grid.size if places is None else len(places)
        size = -(-count // max(1, count // ERROR_MAP_CHUNK_COUNT))
        compiled = self.may_use_numba(count, cones)
        for start in range(0, count, size):
            report("poses", start, count)
            here = grid.places(start, start + size) if places is None else places[start : start + size]
            yield self.part(grid, here, cones, compiled)

    def may_use_numba(self, count: int, cones: Array | None) -> bool:
        """Return True if so many poses are evaluated by numba."""
        assert self.batch is not None
        return self.batch.may_use_numba(count, self.setup.labels, cones, NUMBA_SINGLE_BATCH_POSES_MIN)

    def part(self, grid: Grid, places: Array, cones: Array | None, compiled: bool) -> tuple[Flags, Evaluation]:
        """Return the poses at some places of a grid that the platform can have, with the results of the batch."""
        assert self.batch is not None
        X, possible = list_grid_poses(self.setup.motion, grid, self.setup.robot.name, places)
        return possible, self.batch.evaluate(X, self.setup.labels, cones, compiled=compiled)

    def _one_by_one(self, grid: Grid) -> ErrorField:
        all_samples = self.setup.all_samples
        found = sweep(all_samples.start, all_samples.observation_model, grid, self.setup.motion, self.setup.placer)
        table = np.full((5, len(found)), np.nan)
        for i, at in enumerate(found):
            if at is not None and find_invisible(at, self.observation_model) is None:
                report("errors", i + 1, len(found))
                rates, twists = compute_rates_and_twists(at, self.observation_model)
                table[:4, i] = bound_pose_errors(at, self.observation_model, self.blur).ravel()
                table[4, i] = _compute_smallest_change(rates, twists, at.model.length)
        for row, moved in enumerate((self.setup.motion.translations, self.setup.motion.rotations)):
            if not moved.shape[1]:
                table[[row, row + 2]] = np.where(np.isnan(table[[row, row + 2]]), np.nan, 0.0)
        plane = PlaneOfPoses(self.observation_model, self.setup.motion, grid)
        return ErrorField(
            np.isfinite(table[4]),
            table[0],
            table[1],
            lambda: None,
            lambda: table[4],
            _compute_bound_gap(table[:2], table[2:4]),
            partial(plane.curve, found) if grid.ndim == 2 else None,
            mark_beyond_limits(found),
        )

    def spots(
        self,
        grid: Grid,
        seen: ErrorField,
        seed: int,
        count: int = ERROR_MAP_CHECKED_POSES_COUNT,
        cells: NDArray[np.int64] | None = None,
    ) -> SpotChecks:
        """Compare the batch with Pinocchio at random poses of those that are ``seen``, all of a grid or those at some
        ``cells``; raises ``Disagreement``."""
        sizes = [np.where(np.isfinite(each), each, 0.0) for each in (seen.position, seen.orientation)]
        limits = [
            CHECKED_ERROR_MAX_FRACTION * np.median(each[each > 0]) if (each > 0).any() else np.inf for each in sizes
        ]
        finite = np.isfinite(seen.position) & np.isfinite(seen.orientation)
        usual = np.flatnonzero(seen.reached & finite & (sizes[0] <= limits[0]) & (sizes[1] <= limits[1]))
        chosen = np.random.default_rng(seed).choice(usual, min(count, len(usual)), replace=False)
        met, largest = 0, 0.0
        spots = chosen if cells is None else cells[chosen]
        for i, at in zip(chosen, self._configurations(grid, spots), strict=True):
            if at is None:
                continue
            met += 1
            for mine, theirs, all_of in zip(
                (seen.position[i], seen.orientation[i]),
                bound_pose_errors(at, self.observation_model, self.blur)[0],
                sizes,
                strict=True,
            ):
                scale = max(mine, float(np.median(all_of[all_of > 0])) if (all_of > 0).any() else 1.0)
                largest = max(largest, abs(mine - theirs) / scale)
        if largest > RELATION_ANGLE_TOL + seen.gap:
            raise Disagreement(self.setup.robot.name, met, largest)
        return SpotChecks(met, float(largest))

    def _configurations(self, grid: Grid, chosen: NDArray[np.int64]) -> list[ClosedConfiguration | None]:
        """The closed configurations at cells of a grid."""
        setup = self.setup
        X, _ = list_grid_poses(setup.motion, grid, setup.robot.name, grid.places_at(chosen))
        if setup.placer is not None:
            return setup.placer.configurations(X)
        found: list[ClosedConfiguration | None] = []
        for each in X:
            try:
                found.append(
                    track_to_pose(
                        setup.all_samples.start,
                        setup.all_samples.observation_model,
                        setup.motion.pose(each),
                        setup.motion,
                    )
                )
            except HrsynthError:
                found.append(None)
        return found


def _compute_bound_gap(largest: Array, lower: Array) -> float:
    """The largest gap between the bounds, as a part of the lower ones."""
    here = np.isfinite(largest) & (lower > 0)
    return float(np.max((largest[here] - lower[here]) / lower[here], initial=0.0))


def _compute_smallest_change(rates: Array, twists: Array, length: float) -> float:
    """The smallest change of the directions for a unit twist (characteristic lengths, radians)."""
    scaled = twists / np.repeat([length, 1.0], 3)[:, None]
    _, values, right = np.linalg.svd(scaled, full_matrices=False)
    kept = values > RELATION_ANGLE_TOL
    M = rates @ right[kept].T / values[kept]
    return float(np.linalg.svd(M, compute_uv=False)[-1]) if M.shape[0] >= M.shape[1] else 0.0
