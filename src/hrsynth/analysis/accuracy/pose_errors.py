"""Error maxima at a closed configuration, from Pinocchio's relation there, with the directions that attain them.

The errors are those of directions in cones and of other observations (``cones``); the platform is at the equilibrium of
the servo loop.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...batch.error_bounds import bound_map_errors, find_error_direction
from ...geometry.ranks import compute_kernel_basis
from ...geometry.vectors import Array, orient_axis
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import FileCoordinates
from ...kinematics.limits import list_joints_beyond
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...mechanism.pose import Pose
from ...records import DEG, MM, SCALED, As, Number, recorded
from ...results import Value
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, PSEUDOINVERSE_CUTOFF_FRACTION, RANK_CUTOFF_FRACTION
from .measurement_bounds import MeasurementBounds

ERROR_VIEW_DIRECTIONS_COUNT = 2000
"""Directions on the half-sphere from which the largest and the least error are sought."""
ERROR_SEARCH_STEPS_MAX = 200
"""Steps of the ascent to the largest error, and of the descent to the least."""
LEAST_ERROR_STARTS_COUNT = 60
"""Views from which the least error is sought."""
LARGEST_ERROR_STARTS_COUNT = 16
"""Views, besides the best one, from which the largest error is sought."""


@dataclass(frozen=True, eq=False, repr=False)
class ErrorEllipsoid(Value):
    """Largest and least error over the directions of space: ``largest`` with its unit direction (3,), ``least`` with
    its own, among the directions in which there are errors at all. ``errors`` (k, 3) are the errors that give the
    largest one found, for directions in radians, else in the balls of :class:`.MeasurementBounds`. With three balls
    or more ``largest`` is an upper bound, at most ``gap`` (relative) above the attained error. If a platform dof is
    unobserved ``largest`` is infinite and ``errors`` is None; without errors both are zero and the directions are
    None."""

    largest: Annotated[float, Number, SCALED]
    direction: Annotated[Array | None, list[float] | None]
    least: Annotated[float, Number, SCALED]
    least_direction: Annotated[Array | None, list[float] | None]
    errors: Array | None
    gap: Annotated[float, "largest possible overestimate, relative to the attained error"] = 0.0
    single: bool = False
    """True if there are errors in one direction only."""

    @property
    @recorded()
    def anisotropy(self) -> float | None:
        """Ratio of the largest to the least error; None for one direction only, or no finite error."""
        if self.direction is None or self.single or not np.isfinite(self.largest):
            return None
        return self.largest / self.least


@dataclass(frozen=True, eq=False, repr=False)
class PoseErrors(Value, all_recorded=True):
    """The error maxima at a pose: position (m) and orientation (rad)."""

    pose: Pose
    position: Annotated[ErrorEllipsoid, As("position_mm", scale=MM)]
    orientation: Annotated[ErrorEllipsoid, As("orientation_deg", scale=DEG)]
    beyond_limits: tuple[str, ...] = ()
    """The joints that are beyond their limits at the pose."""
    coordinates: FileCoordinates | None = None


def compute_rates_and_twists(at: ClosedConfiguration, observation_model: ObservationModel) -> tuple[Array, Array]:
    """ρ as rates (3 k, r) of the directions and twists (6, r; m, rad) on the same basis: Mᵀ and its twists, where Mᵀ
    exists, and the least squares law of the measurements where it does not."""
    found = compute_relation(at, observation_model)
    twists = np.zeros((6, found.dimension))
    twists[: found.twist_rows] = found.twist_part
    twists[:3] *= at.model.length
    return found.rates, twists


def bound_pose_errors(at: ClosedConfiguration, observation_model: ObservationModel, blur: MeasurementBounds) -> Array:
    """Return upper and lower bounds (2, 2) of the largest position (m) and orientation error (rad) at a configuration,
    one in each column; infinite if a platform dof is unobserved."""
    return np.stack(
        [
            np.full(2, np.inf) if part is None else np.ravel(bound_map_errors(part.J[None], part.only))
            for part in _split_error_maps(at, observation_model, blur)
        ],
        axis=1,
    )


def search_largest_errors(
    at: ClosedConfiguration, observation_model: ObservationModel, blur: MeasurementBounds
) -> tuple[float, float]:
    """Return the largest position (m) and orientation error (rad) that an ascent from many views finds: a lower bound
    of :func:`bound_pose_errors`, in a sixth of the time for six legs."""
    position, orientation = (_list_error_axes(part, 1) for part in _split_error_maps(at, observation_model, blur))
    return _measure_longest_axis(position), _measure_longest_axis(orientation)


def compute_error_axes(
    at: ClosedConfiguration, observation_model: ObservationModel, blur: MeasurementBounds
) -> Array | None:
    """Return three axes (3, 3), by rows, as long as the largest position errors (m) along them, the first along the
    largest that an ascent finds, the next along the largest normal to it; None if an unobserved dof moves the
    position."""
    return _list_error_axes(next(_split_error_maps(at, observation_model, blur)), 3)


@dataclass(frozen=True, eq=False)
class ErrorMaps:
    """The maps J (3, 3 k) of k unit balls to the position or orientation error, each with what its unit is in ``radii``
    (k,); ``only`` is the one direction (3,) that the platform leaves, None where there are more; at most ``none`` is
    rounding."""

    J: Array
    radii: Array
    only: Array | None
    none: float

    @property
    def seen(self) -> tuple[Array, Array]:
        """The range (3, d) of J, and its blocks J_iᵀ (k, 3, 3)."""
        left, values, _ = np.linalg.svd(self.J)
        count = int(np.sum(values > PSEUDOINVERSE_CUTOFF_FRACTION * values[0])) if values[0] > self.none else 0
        return left[:, :count], self.J.reshape(3, -1, 3).transpose(1, 2, 0)


def _split_error_maps(
    at: ClosedConfiguration, observation_model: ObservationModel, blur: MeasurementBounds
) -> Iterator[ErrorMaps | None]:
    """Return the maps of position and orientation errors, None if an unobserved dof moves it: δt = T (E R)⁺ E δy for
    rates R of the values and twists T on one basis, E the slopes of the regulated vector."""
    rates, twists = compute_rates_and_twists(at, observation_model)
    errors = blur.at(at, observation_model)
    rows = errors.rows(rates)
    lost, _ = compute_kernel_basis(rows, 1.0)
    inverse = np.linalg.pinv(rows, rcond=RANK_CUTOFF_FRACTION)
    balls = np.hstack(errors.maps) if errors.maps else np.zeros((len(rows), 3))
    radii, none = blur.radii(errors.balls), PSEUDOINVERSE_CUTOFF_FRACTION * float(np.linalg.norm(balls))
    for part in (twists[:3], twists[3:]):
        gone = np.linalg.norm(part @ lost) > RANK_CUTOFF_FRACTION * np.linalg.norm(part)
        yield None if gone else ErrorMaps(part @ inverse @ balls, radii, find_error_direction(part), none)


def _list_error_axes(part: ErrorMaps | None, count: int) -> Array | None:
    """So many axes (count, 3) of the errors, zero where there are no more."""
    if part is None:
        return None
    (span, blocks), found = part.seen, np.zeros((count, 3))
    for row in found[: span.shape[1]]:
        w = span @ _search_largest(blocks @ span)
        row[:] = float(_evaluate_width(blocks, w[:, None])[0]) * w
        span = span @ compute_kernel_basis((w @ span)[None], 1.0)[0]
    return found


def _measure_longest_axis(axes: Array | None) -> float:
    return np.inf if axes is None else float(np.linalg.norm(axes[0]))


def compute_error_maxima(
    at: ClosedConfiguration, observation_model: ObservationModel, blur: MeasurementBounds, pose: Pose
) -> PoseErrors:
    """The error maxima at a configuration with their directions."""
    position, orientation = map(_compute_extremes, _split_error_maps(at, observation_model, blur))
    return PoseErrors(pose, position, orientation, tuple(list_joints_beyond(at.model, at.q)), FileCoordinates.of(at))


def _compute_extremes(part: ErrorMaps | None) -> ErrorEllipsoid:
    """The extremes of Σ ‖J_iᵀ w‖ over unit w in the range of J."""
    if part is None:
        return ErrorEllipsoid(np.inf, None, 0.0, None, None)
    span, blocks = part.seen
    if not span.shape[1]:
        return ErrorEllipsoid(0.0, None, 0.0, None, None)
    largest, lower = (float(bound[0]) for bound in bound_map_errors(part.J[None], part.only))
    inside = blocks @ span
    w = orient_axis(span @ _search_largest(inside))
    low = orient_axis(span @ _descend(inside))
    pulls = blocks @ w
    sizes = np.linalg.norm(pulls, axis=1)
    errors = part.radii[:, None] * pulls / np.where(sizes > 0, sizes, 1.0)[:, None]
    lower = max(lower, float(sizes.sum()))
    return ErrorEllipsoid(
        largest,
        w,
        float(_evaluate_width(blocks, low[:, None])[0]),
        low,
        errors,
        max(largest - lower, 0.0) / lower if lower else 0.0,
        span.shape[1] == 1,
    )


def _evaluate_width(blocks: Array, w: Array) -> Array:
    """Σ ‖A_i w‖ (n,) for blocks (k, 3, d) and directions (d, n)."""
    return np.asarray(np.linalg.norm(blocks @ w, axis=1).sum(axis=0))


def _spread_views(dimension: int) -> Array:
    """Unit vectors (d, n) of the half-sphere, evenly spread."""
    if dimension == 1:
        return np.ones((1, 1))
    if dimension == 2:
        turn = np.pi * np.arange(ERROR_VIEW_DIRECTIONS_COUNT) / ERROR_VIEW_DIRECTIONS_COUNT
        return np.stack([np.cos(turn), np.sin(turn)])
    height = (np.arange(ERROR_VIEW_DIRECTIONS_COUNT) + 0.5) / ERROR_VIEW_DIRECTIONS_COUNT
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(ERROR_VIEW_DIRECTIONS_COUNT)
    level = np.sqrt(1 - height**2)
    return np.stack([level * np.cos(turn), level * np.sin(turn), height])


def _search_largest(blocks: Array) -> Array:
    """The direction (d,) of the largest error: ascent from the best view and from some spread evenly (a convex function
    on the sphere, which may have several maxima)."""
    views = _spread_views(blocks.shape[2])
    best = int(np.argmax(_evaluate_width(blocks, views)))
    w = np.concatenate([views[:, [best]], views[:, :: max(1, views.shape[1] // LARGEST_ERROR_STARTS_COUNT)]], axis=1)
    for _ in range(ERROR_SEARCH_STEPS_MAX):
        pulls = blocks @ w
        sizes = np.linalg.norm(pulls, axis=1)[:, None]
        w = np.einsum("kcd,kcn->dn", blocks, pulls / np.where(sizes > 0, sizes, 1.0))
        w = w / np.linalg.norm(w, axis=0)
    reached = _evaluate_width(blocks, w)
    return np.asarray(w[:, 0 if reached[0] >= (1 - HIDDEN_ROBOT_RESIDUAL_TOL) * reached.max() else np.argmax(reached)])


def _descend(blocks: Array) -> Array:
    """The direction (d,) of the least error that was found: from views spread evenly and from the axes of each block,
    w ← the least eigenvector of Σ A_iᵀ A_i / ‖A_i w‖, which never makes Σ ‖A_i w‖ larger (Weiszfeld)."""
    d = blocks.shape[2]
    views = _spread_views(d)
    axes = np.linalg.svd(blocks)[2].reshape(-1, d)
    w = np.concatenate([views[:, :: max(1, views.shape[1] // LEAST_ERROR_STARTS_COUNT)].T, axes])
    squares = np.einsum("kcd,kce->kde", blocks, blocks)
    floor = np.finfo(float).eps * float(np.linalg.norm(blocks))
    for _ in range(ERROR_SEARCH_STEPS_MAX):
        sizes = np.linalg.norm(np.einsum("kcd,nd->nkc", blocks, w), axis=2)
        w = np.linalg.eigh(np.einsum("nk,kde->nde", 1 / np.maximum(sizes, floor), squares))[1][:, :, 0]
    w = np.concatenate([w, axes, views.T])
    return np.asarray(w[np.argmin(_evaluate_width(blocks, w.T))])
