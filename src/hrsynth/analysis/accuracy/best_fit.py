"""Equilibrium of a servo loop with wrong directions, followed from the pose at which they are right.

The equilibria are critical points of F = ½ Σ ‖u_i × û_i‖² over the closed configurations (proofs.md 11), for other
observations with the error e_i of each kind. û_i(s) is u_i rotated by the fraction s of its error. At s = 0 the pose
is a strict minimum, F = 0, if all platform dof are observed. By the implicit function theorem it continues as one
smooth curve of strict minima while the Hessian of F is positive definite. The curve is followed by Newton steps with
the whole Hessian; that of Gauss and Newton need not converge for large errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import LoopClosureFailure
from ...geometry.vectors import Array
from ...kinematics.chart import TangentChart
from ...kinematics.configuration import ClosedConfiguration, measure
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, PSEUDOINVERSE_CUTOFF_FRACTION
from ..singularity_indices import compute_interaction_matrix

HESSIAN_DIFFERENCE_STEP_MAX = 1e-4
"""Step of the differences of a best fit's Hessian."""
HESSIAN_CHANGE_MAX_FRACTION = 0.5
"""Largest relative change of a best fit's Hessian over a step; below 1 it stays definite."""
FLAT_CURVATURE_FRACTION = 0.05
"""Fraction of the initial curvature below which a best fit that cannot be continued is flat."""
BEST_FIT_FIRST_STEP_FRACTION = 0.25
"""First step along a best-fit curve, as a fraction of the direction error."""
BEST_FIT_SHORTEST_STEP = 2.0**-22
"""Smallest step along a best-fit curve, as a fraction of the error."""
BEST_FIT_STEPS_MAX = 200
"""Largest number of steps on one best-fit curve."""

FIT, ENDS, NOT_FOUND = "fit", "ends", "not found"
BEST_FIT_CORRECTIONS_MAX = 8
"""Newton steps within which a prediction is to be corrected."""
BEST_FIT_STEP_CHANGE_FRACTION = 0.35
"""The change at which the next step's length aims."""

Values = Sequence[Array] | Array
Wanted = Callable[[float], Values]
"""The values û at a part of the error, of each observation (size,)."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Curve of best fits: configurations up to the fraction ``reached`` of the error, smallest singular value of Mᵀ on
    it, and its end: the whole error (``fit``), a flat minimum from which a controller drifts away (``ends``), or a
    failed solver (``not found``)."""

    way: tuple[ClosedConfiguration, ...]
    reached: float
    weakest: float
    outcome: str


@dataclass(frozen=True, eq=False)
class _Bowl:
    """F around a configuration, in the coordinates y (n,) of a chart there."""

    at: ClosedConfiguration
    observation_model: ObservationModel

    @cached_property
    def chart(self) -> TangentChart:
        return TangentChart.around(self.at, self.observation_model)

    def errors(self, at: ClosedConfiguration, wanted: Values) -> tuple[Array, Array]:
        """All errors e at a configuration, and their rates J (rows, n) in y."""
        u, rates = measure_values(at, self.observation_model)
        every = list(zip(self.observation_model.observations, u, wanted, strict=True))
        kernel, _ = at.kernel()
        forth = kernel @ np.linalg.pinv(self.chart.slope(at.q) @ kernel, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)
        rows = np.vstack([o.error_slope(v, w) @ r for (o, v, w), r in zip(every, rates, strict=True)]) @ forth
        return np.concatenate([o.error(v, w) for o, v, w in every]), np.asarray(rows)

    def slope(self, at: ClosedConfiguration, wanted: Values) -> Array:
        """∇F = eᵀJ (n,) in y at a configuration."""
        e, J = self.errors(at, wanted)
        return np.asarray(e @ J)

    def hessian(self, wanted: Values) -> Array:
        """∇²F (n, n) at y = 0, by central differences of ∇F."""
        columns = []
        for step in HESSIAN_DIFFERENCE_STEP_MAX * np.eye(self.chart.basis.shape[1]):
            ahead, behind = (self.slope(self.chart.at(each, self.at.q), wanted) for each in (step, -step))
            columns.append((ahead - behind) / (2 * HESSIAN_DIFFERENCE_STEP_MAX))
        H = np.array(columns)
        return np.asarray((H + H.T) / 2)

    def minimum(self, H: Array, wanted: Values, guess: Array) -> ClosedConfiguration | None:
        """Return the critical point near ``guess`` (n,) by Newton steps with the Hessian H of y = 0, its part JᵀJ
        computed anew at each point; None if they do not contract, or lead further away than the start."""
        y, at, last = guess, self.chart.at(guess, self.at.q), float(np.linalg.norm(guess))
        J = self.errors(self.at, wanted)[1]
        rest = H - J.T @ J
        for _ in range(BEST_FIT_CORRECTIONS_MAX):
            e, J = self.errors(at, wanted)
            step = np.linalg.solve(rest + J.T @ J, -(e @ J))
            size = float(np.linalg.norm(step))
            if size <= HIDDEN_ROBOT_RESIDUAL_TOL:
                return at
            if size > HESSIAN_CHANGE_MAX_FRACTION * last:
                return None
            y, last = y + step, size
            at = self.chart.at(y, at.q)
        return None


def measure_values(at: ClosedConfiguration, observation_model: ObservationModel) -> tuple[list[Array], list[Array]]:
    """The value (size,) of each observation and its rates (size, nv)."""
    return measure(at.model, at.q, observation_model.reference, observation_model.observations)[2:]


def compute_smallest_value(at: ClosedConfiguration, observation_model: ObservationModel) -> float:
    """The smallest singular value of Mᵀ (characteristic lengths), infinite where Mᵀ does not exist."""
    M = compute_interaction_matrix(compute_relation(at, observation_model))
    return np.inf if M is None else float(np.linalg.svd(M, compute_uv=False)[-1])


def track_best_fits(at: ClosedConfiguration, observation_model: ObservationModel, wanted: Wanted) -> Fit:
    """The curve of best fits from a configuration whose directions are ``wanted(0)``, led to ``wanted(1)``."""
    way, done, step = [at], 0.0, BEST_FIT_FIRST_STEP_FRACTION
    bowl = _Bowl(at, observation_model)
    H = first = bowl.hessian(wanted(0.0))
    if _find_least_curvature(H) <= 0:
        return Fit((at,), 0.0, compute_smallest_value(at, observation_model), NOT_FOUND)
    for _ in range(BEST_FIT_STEPS_MAX):
        if done == 1.0 or step < BEST_FIT_SHORTEST_STEP:
            break
        ahead = min(1.0, done + step)
        found = _take_newton_step(bowl, H, wanted, ahead)
        change = np.inf if found is None else _change(bowl, H, *found)
        if found is not None and change <= HESSIAN_CHANGE_MAX_FRACTION:
            (bowl, H), done = found, ahead
            way.append(bowl.at)
        step *= float(np.clip(BEST_FIT_STEP_CHANGE_FRACTION / max(change, 1e-12), 0.25, 2.0))
    outcome = (
        FIT
        if done == 1.0
        else ENDS
        if _find_least_curvature(H) < FLAT_CURVATURE_FRACTION * _find_least_curvature(first)
        else NOT_FOUND
    )
    return Fit(tuple(way), done, min(compute_smallest_value(each, observation_model) for each in way), outcome)


def _take_newton_step(bowl: _Bowl, H: Array, wanted: Wanted, ahead: float) -> tuple[_Bowl, Array] | None:
    """The bowl around the best fit a step further, and its Hessian; None where Newton steps do not contract near the
    prediction."""
    try:
        guess = np.asarray(np.linalg.solve(H, -bowl.slope(bowl.at, wanted(ahead))), dtype=float)
        found = bowl.minimum(H, wanted(ahead), guess)
        if found is None:
            return None
        there = _Bowl(found, bowl.observation_model)
        return there, there.hessian(wanted(ahead))
    except LoopClosureFailure:
        return None


def _change(bowl: _Bowl, H: Array, there: _Bowl, other: Array) -> float:
    """‖H^{-1/2} (H′ − H) H^{-T/2}‖, H′ the Hessian a step further in the same coordinates: where it stays below 1 all
    along, so does every Hessian definite."""
    across = there.chart.basis.T @ bowl.chart.basis
    if across.shape[0] != across.shape[1] or _find_least_curvature(other) <= 0:
        return np.inf
    back = np.linalg.inv(np.linalg.cholesky(H))
    return float(np.linalg.norm(back @ (across.T @ other @ across - H) @ back.T, 2))


def _find_least_curvature(H: Array) -> float:
    """The least curvature."""
    return float(np.linalg.eigvalsh(H)[0])
