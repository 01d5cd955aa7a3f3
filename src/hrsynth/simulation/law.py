"""The control law that servoes leg directions (MMT 2.3.2, eqs. 9-12), for any robot and any observed legs.

e_i = u_i × u_di, L_iᵀ = −[u_di]ₓ M_iᵀ, τ = −λ L^{T+} e and q̇ = J_inv τ are solved at once on the tangent space of the
closed loops: with B a basis of it and U B the rates of the directions, q̇ = −λ B (L U B)⁺ e, where L stacks −[u_di]ₓ.
Where the robot sees all of its platform's twist this is the same velocity of least norm; and it stays finite where Mᵀ
does not exist because a watched leg is stretched (Type 1), as the motion through such a pose is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array, cross, hat
from ..kinematics.configuration import ClosedConfiguration, measure
from ..kinematics.relation import Measurement
from ..tolerances import DAMPED

Desired = Callable[[float], tuple[Array, Array]]
"""Desired directions (k, 3) and their rates (k, 3) at a time."""
Poses = Callable[[str], Array]
"""The pose X_BL (4, 4) of each link."""
Sense = Callable[[float, Poses, Array], Array]
"""What is measured (k, 3) at a time where the links are at their poses and the true directions are (k, 3)."""


@dataclass(frozen=True, eq=False)
class Command:
    """What the law commands at a configuration: joint velocities (nv,), the true error and directions, the measured
    directions (k, 3), and the singular values of the rows that it inverts, as many as the platform has freedoms,
    largest first."""

    velocity: Array
    error: Array
    directions: Array
    seen: Array
    values: Array
    weak: Array
    """The joint velocity (nv,), of unit norm, that the measured errors show least."""

    @property
    def size(self) -> float:
        """‖e‖ of the true error."""
        return float(np.linalg.norm(self.error))

    @property
    def speed(self) -> float:
        """Norm of the joint velocities (characteristic lengths, radians, seconds)."""
        return float(np.linalg.norm(self.velocity))


@dataclass(frozen=True, eq=False)
class Law:
    """The law of one robot: ``question`` holds what is observed, ``dof`` its platform's freedoms, ``gain`` is λ."""

    question: Measurement
    dof: int
    gain: float

    def at(self, configuration: ClosedConfiguration, desired: tuple[Array, Array], sensed: Sense | None = None,
           time: float = 0.0) -> Command:
        """The command at a configuration (of the joint velocities of its twin)."""
        u, rates = directions(configuration, self.question)
        wanted, moving = desired
        true = cross(u.T, wanted.T, axis=-2).T
        seen = u if sensed is None else sensed(time, configuration.pose, u)
        error = true if sensed is None else cross(seen, wanted)
        kernel, _ = configuration.kernel()
        rows = np.vstack([-hat(w) @ r for w, r in zip(wanted, rates, strict=True)]) @ kernel
        left, values, right = np.linalg.svd(rows, full_matrices=False)
        left, values, right = left[:, : self.dof], values[: self.dof], right[: self.dof]
        asked = self.gain * error.ravel() + cross(seen, moving).ravel()
        velocity = -kernel @ (right.T @ (inverted(values) * (left.T @ asked)))
        return Command(velocity, true, u, seen, values, kernel @ right[-1])


def inverted(values: Array) -> Array:
    """The singular values (descending) of a damped pseudo-inverse: exact but where a value is below ``DAMPED``, then
    σ / (σ² + μ²), μ² growing from 0 to ``DAMPED``² as σ vanishes."""
    damping = np.maximum(DAMPED**2 - values**2, 0.0)
    return np.asarray(values / (values**2 + damping))


def directions(configuration: ClosedConfiguration, question: Measurement) -> tuple[Array, list[Array]]:
    """The observed directions (k, 3) and, of each, the rates (3, nv)."""
    _, _, values, rates = measure(configuration.twin, configuration.q, question.reference, question.observations)
    return np.array(values), rates
