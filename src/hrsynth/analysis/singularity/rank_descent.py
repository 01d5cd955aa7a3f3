"""Descent to a pose at which the relation loses rank, independent of the condition."""

from __future__ import annotations

import numpy as np

from ...errors import UndefinedValue
from ...geometry.ranks import compute_kernel_basis, compute_range_basis
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import DAMPING, solve
from ...kinematics.velocity_relation import (
    ObservationModel,
    VelocityRelation,
    compute_platform_motions,
    compute_relation,
)
from ...kinematics.walking import WALK_STEP_NORM_FRACTION, step_along
from ...solving.gauss_newton import Residual, descend
from ...tolerances import (
    HIDDEN_ROBOT_RESIDUAL_TOL,
    PSEUDOINVERSE_CUTOFF_FRACTION,
    RANK_CUTOFF_FRACTION,
    SLOPE_STEP_MAX,
)

STEP_RESIDUAL_TOL = 1e-14
"""Closure residual (characteristic lengths, radians) at which a step's Newton iteration ends, just above rounding."""
RANK_DESCENTS, RANK_STEPS = 6, 40
"""Poses from which the smallest singular value is minimised, and steps of each."""


def descend_to_rank_loss(start: ClosedConfiguration, observation_model: ObservationModel) -> ClosedConfiguration | None:
    """Return a pose near ``start`` at which the relation loses its rank, on steps that follow the branch; None if there
    is none near.

    Gauss-Newton on M(s) x, with x the twist that M sees least where s = 0 and M that of :func:`measure_twists`: its
    norm is the smallest singular value, and at a zero its slope is that with x held."""

    def evaluate(at: ClosedConfiguration) -> tuple[Array, Array]:
        rows = measure_twists(at, observation_model)
        x = np.linalg.svd(rows)[2][-1]
        error = rows @ x
        aside = [step_from(at, SLOPE_STEP_MAX * motion) for motion in compute_platform_motions(at, observation_model).T]
        return error, np.column_stack(
            [(measure_twists(each, observation_model) @ x - error) / SLOPE_STEP_MAX for each in aside]
        )

    def advance(at: ClosedConfiguration, found: Residual, factor: float) -> ClosedConfiguration | None:
        normal = found.J.T @ found.J + factor * found.size**2 * np.eye(found.J.shape[1])
        step = np.linalg.lstsq(normal, -(found.J.T @ found.error), rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0]
        return step_along(at, compute_platform_motions(at, observation_model) @ step / WALK_STEP_NORM_FRACTION)

    try:
        there, left = descend(
            start, evaluate, advance, DAMPING, RANK_STEPS, lambda at: at.size <= HIDDEN_ROBOT_RESIDUAL_TOL
        )
    except UndefinedValue:
        return None
    return there if left.size <= HIDDEN_ROBOT_RESIDUAL_TOL else None


def measure_twists(at: ClosedConfiguration, observation_model: ObservationModel) -> Array:
    """Measured rates of each platform twist and, below, the part of the twist that the platform cannot have, (rows,
    twist rows): a matrix that changes continuously with the pose, of the rank of the relation."""
    M, basis = compute_twist_rates(compute_relation(at, observation_model))
    return np.vstack([M @ basis.T, np.eye(len(basis)) - basis @ basis.T])


def compute_twist_rates(found: VelocityRelation) -> tuple[Array, Array]:
    """Measured rates of an orthonormal basis of the platform's twists, (measured rows, dof), without the part of
    internal motions, and that basis (twist rows, dof)."""
    twists, rates = found.twist_part, found.rates
    U, s, Vt = np.linalg.svd(twists, full_matrices=False)
    kept = int(np.sum(s > RANK_CUTOFF_FRACTION))
    M = rates @ (Vt[:kept].T / s[:kept])
    if kept < found.dimension:
        still, _ = compute_kernel_basis(twists, 1.0)
        idle, _ = compute_range_basis(rates @ still, 1.0)
        M = M - idle @ (idle.T @ M)
    return M, U[:, :kept]


def step_from(here: ClosedConfiguration, step: Array) -> ClosedConfiguration:
    """Configuration after a step (nv,), closed as precisely as possible; its residual shows the closure."""
    q, residual = solve(here.model, here.model.integrate(here.q, step), tolerance=STEP_RESIDUAL_TOL)
    return ClosedConfiguration(here.model, q, residual)
