"""Distance of a closed configuration from the exact one."""

from __future__ import annotations

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..mechanism import Direction, JointType, Mechanism
from ..tolerances import CHAIN_ROUNDING, DIRECTION_SINE_TOL, MOVED_AXIS_LEVER_MAX
from .configuration import ClosedConfiguration
from .pinocchio_model import PinocchioModel
from .tasks import FixedValuesTask, Task, stack_task

ROTATION_LEVER_MIN = 2.0
"""Least lever (characteristic lengths) of a turn: directions are compared with the size of the tips' curves."""
OUT_OF_PLANE_COUNT = 3
"""Conditions of each loop of a planar mechanism that hold for all positions of its joints."""


def drift(goal: ClosedConfiguration, pose: Task | None = None, moved: float = 0.0) -> float:
    """Return how far a point of a link can be from its position at the exact goal (m), within the robot's extent;
    infinite where that is not proved. ``moved``: how far axes and centres are from those of the file (m), all together.

    Newton and Kantorovich: with σ the smallest singular value of the rows J that count and L a Lipschitz constant of J,
    L ‖F‖ ≤ σ²/2 gives an exact goal within 2 ‖J⁺ F‖. Rows that depend on the others are taken as consistent.
    """
    model, extent = goal.model, _measure_extent(goal.model)
    F, J = stack_task(model, goal.q, pose)
    links = tuple(model.mechanism.links)
    V = model.frames(goal.q, links)[1]
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


def is_proved_to_exist(at: ClosedConfiguration, held: FixedValuesTask, moved: float) -> bool:
    """Return True if an exact closed configuration with held values is proved near one: as :func:`drift`, with all rows
    independent but those that a unit vector repeats, and those that hold a planar mechanism in its plane."""
    model = at.model
    F, J = stack_task(model, at.q, held)
    rank = len(model.jacobian(at.q)) + sum(observation.rank for observation, _ in held.measured)
    if is_planar(model.mechanism):
        rank -= OUT_OF_PLANE_COUNT * len(model.loops) + sum(isinstance(each, Direction) for each, _ in held.measured)
    values, extent = np.linalg.svd(J, compute_uv=False), _measure_extent(model)
    miss = float(np.linalg.norm(F)) + CHAIN_ROUNDING * extent + MOVED_AXIS_LEVER_MAX * moved / model.length
    return 0 < rank <= len(values) and bool(model.nv * extent * miss <= values[rank - 1] ** 2 / 2)


def is_planar(mechanism: Mechanism) -> bool:
    """Return True if all rotations are about one direction, and all slides across it."""
    joints = [joint for joint in mechanism.joints.values() if joint.type is not JointType.FIXED]
    normal = next((joint.axis for joint in joints if joint.type is JointType.REVOLUTE), None)
    return normal is not None and all(
        (joint.type is JointType.REVOLUTE and float(np.linalg.norm(np.cross(joint.axis, normal))) <= DIRECTION_SINE_TOL)
        or (joint.type is JointType.PRISMATIC and abs(float(joint.axis @ normal)) <= DIRECTION_SINE_TOL)
        for joint in joints
    )


def _measure_extent(model: PinocchioModel) -> float:
    """Return 1 plus the robot's extent (characteristic lengths)."""
    mechanism = model.mechanism
    points = [*(link.pose[:3, 3] for link in mechanism.links.values()), *(j.point for j in mechanism.joints.values())]
    return 1.0 + float(np.ptp(np.array(points), axis=0).max()) / model.length


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
