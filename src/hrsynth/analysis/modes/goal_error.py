"""Distance of a closed configuration from the exact one."""

from __future__ import annotations

import numpy as np

from ...geometry.ranks import compute_range_basis
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import Task, stack_task
from ...tolerances import CHAIN_ROUNDING, MOVED_AXIS_LEVER_MAX

ROTATION_LEVER_MIN = 2.0
"""Least lever (characteristic lengths) of a turn: directions are compared with the size of the tips' curves."""


def drift(goal: ClosedConfiguration, pose: Task | None = None, moved: float = 0.0) -> float:
    """Return how far a point of a link can be from its position at the exact goal (m), within the robot's extent;
    infinite where that is not proved. ``moved``: how far axes and centres are from those of the file (m), all together.

    Newton and Kantorovich: with σ the smallest singular value of the rows J that count and L a Lipschitz constant of J,
    L ‖F‖ ≤ σ²/2 gives an exact goal within 2 ‖J⁺ F‖. Rows that depend on the others are taken as consistent.
    """
    model = goal.model
    F, J = stack_task(model, goal.q, pose)
    links = tuple(model.mechanism.links)
    mechanism, V = model.mechanism, model.frames(goal.q, links)[1]
    points = [*(mechanism.links[link].pose[:3, 3] for link in links), *(j.point for j in mechanism.joints.values())]
    extent = 1.0 + float(np.ptp(np.array(points), axis=0).max()) / model.length
    miss = float(np.linalg.norm(F)) + CHAIN_ROUNDING * extent + MOVED_AXIS_LEVER_MAX * moved / model.length
    if not len(J):
        return model.length * miss
    rank = compute_range_basis(J, 1.0)[1].value
    left, values, right = np.linalg.svd(J, full_matrices=False)
    sigma, bends = float(values[rank - 1]) if rank else np.inf, model.nv * extent
    if bends * miss > sigma**2 / 2:
        return float("inf")
    inverse: Array = right[:rank].T / values[:rank] @ left[:, :rank].T
    return MOVED_AXIS_LEVER_MAX * moved + 2.0 * model.length * miss * max(
        float(np.linalg.norm(moved[:3], 2) + _lever(goal, link) * np.linalg.norm(moved[3:], 2))
        for link, moved in zip(links, V @ inverse, strict=True)
    )


def _lever(goal: ClosedConfiguration, link: str) -> float:
    """Return how far a link's joint centres are from its origin (characteristic lengths)."""
    mechanism = goal.model.mechanism
    origin = mechanism.links[link].pose[:3, 3]
    return max(
        [
            ROTATION_LEVER_MIN,
            *(
                float(np.linalg.norm(joint.point - origin)) / goal.model.length
                for joint in mechanism.joints.values()
                if link in joint.links
            ),
        ]
    )
