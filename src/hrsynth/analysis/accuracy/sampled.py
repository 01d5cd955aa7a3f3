"""The check of the linear law: directions that are truly off, and the poses at which the robot shows them best.

The pose that a controller rests at minimises Σ ‖u_i − û_i‖² over the measured directions û_i; to first order it is
M^{T+} δu. Near a singularity the two part, and there may be no such pose near.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...kinematics.configuration import ClosedConfiguration, closed, limited, measure
from ...kinematics.parts import PlatformMotion, rotation_vector
from ...kinematics.relation import Question
from ...mechanism.vectors import Array, rotation_about
from ...tolerances import CLOSED, FOLLOWED, INVERTED
from .gauge import PoseErrors

PARTS = 2
"""Parts in which directions are led to their measured values."""
ITERATIONS = 25
"""Gauss-Newton steps for each part."""
LONGEST = 0.1
"""Longest such step (characteristic lengths, radians)."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """What the robot truly does with ``count`` errors on the cones' borders, the linearly worst ones first: the largest
    position (m) and orientation error (rad) found, and for how many there is no pose near."""

    count: int
    missed: int
    position: float
    orientation: float

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"samples": self.count, "no_pose_near": self.missed, "position_mm": 1e3 * self.position,
                "orientation_deg": float(np.degrees(self.orientation))}


def sampled(at: ClosedConfiguration, question: Question, motion: PlatformMotion, cones: Array, linear: PoseErrors,
            count: int, seed: int = 0, progress: Callable[[], None] | None = None) -> Sampled:
    """The true errors at a configuration for ``count`` samples, seeded."""
    u = _directions(at.twin, at.q, question)[0]
    ways = _extremes(linear)
    rng = np.random.default_rng(seed)
    ways += [cones[:, None] * _tangents(rng, u) for _ in range(max(0, count - len(ways)))]
    home = at.pose(motion.link)
    missed, position, orientation = 0, 0.0, 0.0
    for way in ways:
        if progress is not None:
            progress()
        there = _rested(at, question, u, way)
        if there is None:
            missed += 1
            continue
        X = at.twin.pose(there, motion.link)
        position = max(position, float(np.linalg.norm(motion.position(X) - motion.position(home))))
        if motion.body:
            orientation = max(orientation, float(np.linalg.norm(rotation_vector(X[:3, :3] @ home[:3, :3].T))))
    return Sampled(len(ways), missed, position, orientation)


def _extremes(linear: PoseErrors) -> list[Array]:
    """The errors of directions (k, 3) that are the worst to first order, of both signs."""
    found = [each.errors for each in (linear.position, linear.orientation) if each.errors is not None]
    return [sign * errors for errors in found for sign in (1.0, -1.0)]


def _tangents(rng: np.random.Generator, u: Array) -> Array:
    """Random unit vectors (k, 3) normal to u (k, 3)."""
    vectors = rng.normal(size=u.shape)
    vectors -= np.sum(vectors * u, axis=1, keepdims=True) * u
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _directions(twin: Any, q: Array, question: Question) -> tuple[Array, Array]:
    """u (k, 3) and its rates (3 k, nv)."""
    _, _, values, rates = measure(twin, q, question.reference, question.observations)
    return np.array(values), np.vstack(rates)


def _tilted(u: Sequence[Array] | Array, way: Array) -> Array:
    """u (k, 3), each turned by the angle ‖way‖ towards its way (k, 3), which is normal to it."""
    return np.array([rotation_about(np.cross(a, b), float(np.linalg.norm(b))) @ a if np.any(b) else a
                     for a, b in zip(u, way, strict=True)])


def _rested(at: ClosedConfiguration, question: Question, u: Array, way: Array) -> Array | None:
    """The q near a configuration whose directions are nearest to the measured ones; None where the search ends
    elsewhere."""
    twin, q = at.twin, at.q
    for part in range(1, PARTS + 1):
        wanted = _tilted(u, way * (part / PARTS))
        for _ in range(ITERATIONS):
            here, rates = _directions(twin, q, question)
            basis = ClosedConfiguration(twin, q, 0.0).kernel()[0]
            step = basis @ np.linalg.pinv(rates @ basis, rcond=INVERTED) @ (wanted - here).ravel()
            if np.linalg.norm(step) <= FOLLOWED:
                break
            q, residual = closed(twin, twin.moved(q, limited(np.asarray(step), LONGEST)))
            if residual > CLOSED:
                return None
        else:
            return None
    return q
