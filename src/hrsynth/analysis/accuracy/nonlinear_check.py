"""Check of the linear errors: equilibria of the servo loop with finite measurement errors.

To first order such a pose differs by M^{T+} δu. Near a singularity, and for large errors, the two differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from ...geometry.so3 import compute_rotation_angle
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.velocity_relation import ObservationModel
from ...progress import report
from ...records import DEG, MM, As, Number
from ...results import Value
from .best_fit import ENDS, NOT_FOUND, compute_smallest_value, measure_values, track_best_fits
from .measurement_bounds import MeasurementBounds
from .pose_errors import PoseErrors


@dataclass(frozen=True, eq=False, repr=False)
class NonlinearCheck(Value, all_recorded=True):
    """Largest position (m) and orientation error (rad) for ``count`` finite errors on the borders of the cones, the
    linearly worst ones first, each increased from zero. ``ended`` holds the fractions of the error at which best fits
    become flat; ``not_found`` counts failed solutions. ``smallest_singular_value`` is that of Mᵀ on the way, ``usual``
    that at the pose."""

    count: Annotated[int, As("samples")]
    position: Annotated[float, As("position_mm", scale=MM)]
    orientation: Annotated[float, As("orientation_deg", scale=DEG)]
    ended: Annotated[tuple[float, ...], As("ended_at")]
    not_found: int
    smallest_singular_value: Annotated[float, Number, As("smallest_singular_value")]
    usual: Annotated[float, Number, As("singular_value_at_pose")]

    @property
    def missed(self) -> int:
        """Number of errors that were not followed to their full size."""
        return len(self.ended) + self.not_found


def sample_true_errors(
    at: ClosedConfiguration,
    observation_model: ObservationModel,
    motion: PlatformMotion,
    blur: MeasurementBounds,
    linear: PoseErrors,
    count: int,
    seed: int = 0,
) -> NonlinearCheck:
    """The true errors at a configuration for ``count`` samples, seeded."""
    values, length = measure_values(at, observation_model)[0], at.model.length
    balls = blur.at(at, observation_model)
    ways = _list_extreme_errors(linear)
    rng = np.random.default_rng(seed)
    axes = np.array([values[i] if blur.cones[i] else np.zeros(3) for i, _ in balls.balls])
    radii = blur.radii(balls.balls)[:, None]
    ways += [radii * _sample_tangents(rng, axes) for _ in range(max(0, count - len(ways)))]

    def wrong(way: Array, part: float) -> list[Array]:
        return blur.wrong(observation_model.observations, values, length, balls, way, part)

    home = at.pose(motion.link)
    position, orientation, usual = 0.0, 0.0, compute_smallest_value(at, observation_model)
    least, ended, not_found = usual, [], 0
    for number, way in enumerate(ways, 1):
        report("samples", number, len(ways))
        fit = track_best_fits(at, observation_model, partial(wrong, way))
        least = min(least, fit.weakest)
        if fit.outcome == ENDS:
            ended.append(fit.reached)
        not_found += fit.outcome == NOT_FOUND
        for there in fit.way:
            X = there.pose(motion.link)
            position = max(position, float(np.linalg.norm(motion.position(X) - motion.position(home))))
            if motion.body:
                orientation = max(orientation, compute_rotation_angle(X[:3, :3] @ home[:3, :3].T))
    return NonlinearCheck(len(ways), position, orientation, tuple(sorted(ended)), not_found, least, usual)


def _list_extreme_errors(linear: PoseErrors) -> list[Array]:
    """The errors (k, 3) that are the worst to first order, of both signs."""
    found = [each.errors for each in (linear.position, linear.orientation) if each.errors is not None]
    return [sign * errors for errors in found for sign in (1.0, -1.0)]


def _sample_tangents(rng: np.random.Generator, u: Array) -> Array:
    """Random unit vectors (k, 3) normal to u (k, 3), of unit vectors or zero."""
    vectors = rng.normal(size=u.shape)
    vectors -= np.sum(vectors * u, axis=1, keepdims=True) * u
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
