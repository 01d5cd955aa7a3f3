"""The check of the linear law: directions that are truly off, and the poses at which a controller rests with them.

To first order such a pose is M^{T+} δu away. Near a singularity, and where errors are large, the two part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.so3 import angle_of
from ...geometry.vectors import Array, rotation_about
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.relation import Measurement
from ...progress import tell
from ...results import Value
from .best_fit import ENDS, NOT_FOUND, best_fits, seen, weakest
from .pose_errors import PoseErrors, finite


@dataclass(frozen=True, eq=False, repr=False)
class Sampled(Value):
    """What the robot truly does with ``count`` errors on the cones' borders, the linearly worst ones first, each led
    there from none: the largest position (m) and orientation error (rad) met on these ways.

    ``ended`` holds the part of its error at which each best fit becomes flat that does; ``not_found`` counts those that
    the solver lost before. ``weakest`` is the smallest singular value of Mᵀ met, ``usual`` that at the pose."""

    count: int
    position: float
    orientation: float
    ended: tuple[float, ...]
    not_found: int
    weakest: float
    usual: float

    @property
    def missed(self) -> int:
        """How many were not followed up to the whole error."""
        return len(self.ended) + self.not_found

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"samples": self.count, "position_mm": 1e3 * self.position,
                "orientation_deg": float(np.degrees(self.orientation)), "ended_at": list(self.ended),
                "not_found": self.not_found, "smallest_singular_value": finite(self.weakest),
                "singular_value_at_pose": finite(self.usual)}


def sampled(at: ClosedConfiguration, question: Measurement, motion: PlatformMotion, cones: Array, linear: PoseErrors,
            count: int, seed: int = 0) -> Sampled:
    """The true errors at a configuration for ``count`` samples, seeded."""
    u = seen(at, question)[0]
    ways = _extremes(linear)
    rng = np.random.default_rng(seed)
    ways += [cones[:, None] * _tangents(rng, u) for _ in range(max(0, count - len(ways)))]
    home = at.pose(motion.link)
    position, orientation, usual = 0.0, 0.0, weakest(at, question)
    least, ended, not_found = usual, [], 0
    for way in ways:
        tell("samples")
        fit = best_fits(at, question, lambda part, way=way: tilted(u, part * way))  # type: ignore[misc]
        least = min(least, fit.weakest)
        if fit.outcome == ENDS:
            ended.append(fit.reached)
        not_found += fit.outcome == NOT_FOUND
        for there in fit.way:
            X = there.pose(motion.link)
            position = max(position, float(np.linalg.norm(motion.position(X) - motion.position(home))))
            if motion.body:
                orientation = max(orientation, angle_of(X[:3, :3] @ home[:3, :3].T))
    return Sampled(len(ways), position, orientation, tuple(sorted(ended)), not_found, least, usual)


def _extremes(linear: PoseErrors) -> list[Array]:
    """The errors of directions (k, 3) that are the worst to first order, of both signs."""
    found = [each.errors for each in (linear.position, linear.orientation) if each.errors is not None]
    return [sign * errors for errors in found for sign in (1.0, -1.0)]


def _tangents(rng: np.random.Generator, u: Array) -> Array:
    """Random unit vectors (k, 3) normal to u (k, 3)."""
    vectors = rng.normal(size=u.shape)
    vectors -= np.sum(vectors * u, axis=1, keepdims=True) * u
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def tilted(u: Sequence[Array] | Array, way: Array) -> Array:
    """u (k, 3), each turned by the angle ‖way‖ towards its way (k, 3), which is normal to it."""
    return np.array([rotation_about(np.cross(a, b), float(np.linalg.norm(b))) @ a if np.any(b) else a
                     for a, b in zip(u, way, strict=True)])
