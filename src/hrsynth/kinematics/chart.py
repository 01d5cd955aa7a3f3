"""Coordinates on the closed configurations around one of them, in which an integrator works without drift.

A configuration q near q₀ has the coordinates y = Bᵀ (q ⊖ q₀), B an orthonormal basis of the tangent space at q₀ without
its internal motions. Going back, the loops are solved together with these n equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..errors import LoopClosureFailure
from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL
from .configuration import ClosedConfiguration
from .pinocchio_model import PinocchioModel
from .tasks import solve
from .velocity_relation import ObservationModel


@dataclass(frozen=True, eq=False)
class _Coordinates:
    """Desired coordinates y."""

    chart: TangentChart
    y: Array

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""
        basis = self.chart.basis
        return basis.T @ model.difference(self.chart.centre.q, q) - self.y, self.chart.slope(q)


@dataclass(frozen=True, eq=False)
class TangentChart:
    """Coordinates y (n,) around ``centre``; ``basis`` is B (nv, n)."""

    centre: ClosedConfiguration
    basis: Array

    @classmethod
    def around(cls, centre: ClosedConfiguration, observation_model: ObservationModel) -> TangentChart:
        """The chart whose directions are those that move the platform or anything that is observed."""
        kernel, _ = centre.kernel()
        image = observation_model.rows(centre) @ kernel
        return cls(centre, kernel @ compute_range_basis(image.T, 1.0)[0])

    def at(self, y: Array, near: Array, *, iterations: int = 15) -> ClosedConfiguration:
        """The configuration with the coordinates y that lies next to the configuration ``near`` (nq,); raises
        ``LoopClosureFailure``."""
        model = self.centre.model
        q, residual = solve(model, near, _Coordinates(self, y), tolerance=CLOSURE_SOLVER_TOL, iterations=iterations)
        if not residual <= CLOSURE_RESIDUAL_TOL:
            raise LoopClosureFailure(model.mechanism.name, residual, CLOSURE_RESIDUAL_TOL, model.worst_loop(q)[0])
        return ClosedConfiguration.of(model, q)

    def slope(self, q: Array) -> Array:
        """The map from joint velocities at q to ẏ, (n, nv)."""
        model = self.centre.model.model
        if model.nq == model.nv:
            return self.basis.T
        return np.asarray(self.basis.T @ pin.dDifference(model, self.centre.q, q, pin.ARG1))
