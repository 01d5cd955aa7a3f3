"""Descent to a pose at which the relation loses rank, independent of the condition."""

from __future__ import annotations

import numpy as np

from ...budgets import RANK_STEPS
from ...errors import UndefinedValue
from ...geometry.gauss_newton import Residual, descend
from ...geometry.ranks import kernel_basis, range_basis
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import DAMPING, solve
from ...kinematics.velocity_relation import ObservationModel, VelocityRelation, platform_motions, relation
from ...kinematics.walking import STEP, step_along
from ...tolerances import FOLLOWED, INVERTED, NUDGE, RANK_CUTOFF, SHARP


def lose(start: ClosedConfiguration, observation_model: ObservationModel) -> ClosedConfiguration | None:
    """Return a pose near ``start`` at which the relation loses its rank, on steps that follow the branch; None if there
    is none near.

    Gauss-Newton on M(s) x, with x the twist that M sees least where s = 0 and M that of :func:`twists_seen`: its norm
    is the smallest singular value, and at a zero its slope is that with x held.
    """

    def evaluate(at: ClosedConfiguration) -> tuple[Array, Array]:
        rows = twists_seen(at, observation_model)
        x = np.linalg.svd(rows)[2][-1]
        error = rows @ x
        aside = [step_from(at, NUDGE * motion) for motion in platform_motions(at, observation_model).T]
        return error, np.column_stack([(twists_seen(each, observation_model) @ x - error) / NUDGE for each in aside])

    def advance(at: ClosedConfiguration, found: Residual, factor: float) -> ClosedConfiguration | None:
        normal = found.J.T @ found.J + factor * found.size**2 * np.eye(found.J.shape[1])
        step = np.linalg.lstsq(normal, -(found.J.T @ found.error), rcond=INVERTED)[0]
        return step_along(at, platform_motions(at, observation_model) @ step / STEP)

    try:
        there, left = descend(start, evaluate, advance, DAMPING, RANK_STEPS, lambda at: at.size <= FOLLOWED)
    except UndefinedValue:
        return None
    return there if left.size <= FOLLOWED else None


def twists_seen(at: ClosedConfiguration, observation_model: ObservationModel) -> Array:
    """Measured rates of each platform twist and, below, the part of the twist that the platform cannot have, (rows,
    twist rows): a matrix that changes continuously with the pose, of the rank of the relation."""
    M, basis = rates_of_twists(relation(at, observation_model))
    return np.vstack([M @ basis.T, np.eye(len(basis)) - basis @ basis.T])


def rates_of_twists(found: VelocityRelation) -> tuple[Array, Array]:
    """Measured rates of an orthonormal basis of the platform's twists, (measured rows, dof), without the part of
    internal motions, and that basis (twist rows, dof)."""
    twists, rates = found.twist_part, found.rates
    U, s, Vt = np.linalg.svd(twists, full_matrices=False)
    kept = int(np.sum(s > RANK_CUTOFF))
    M = rates @ (Vt[:kept].T / s[:kept])
    if kept < found.dimension:
        still, _ = kernel_basis(twists, 1.0)
        idle, _ = range_basis(rates @ still, 1.0)
        M = M - idle @ (idle.T @ M)
    return M, U[:, :kept]


def step_from(here: ClosedConfiguration, step: Array) -> ClosedConfiguration:
    """Configuration after a step (nv,), closed as precisely as possible; its residual shows the closure."""
    q, residual = solve(here.model, here.model.integrate(here.q, step), tolerance=SHARP)
    return ClosedConfiguration(here.model, q, residual)
