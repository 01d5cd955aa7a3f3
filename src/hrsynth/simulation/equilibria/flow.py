"""The law of servoing (:mod:`..law`) as a velocity of platform poses, for many poses at once.

With ẋ coordinates of the platform's twist and e_i = u_i × u_di, the command moves the platform with ẋ = −S V max(Σ²,
DAMPED²)⁻¹ Vᵀ S Lᵀ e in time constants 1 / λ: S² is the response of the platform to unit joint velocities, V Σ² Vᵀ = S
Lᵀ L S. S counts only where a singular value is below ``DAMPED``, and does not change the equilibria.

A stretched unobserved leg constrains the platform (``active``): there ẋ minimises ‖L ẋ + e‖ over the twists that keep
the leg's reach margin, as the law does on the closed loops.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...batch.configuration_builder import ConfigurationBuilder, compute_rates
from ...batch.engine import Batch
from ...geometry.so3 import convert_vectors_to_rotations
from ...geometry.vectors import Array, cross, hat, solve_definite, times
from ...kinematics.configuration import ClosedConfiguration
from ...results import Value
from ...tolerances import CLOSURE_SOLVER_TOL, CONTROLLER_DAMPING_MIN

FLOW_SLOPE_STEP_MAX = 1e-6
"""Step of the differences of velocities and reach margins of batched runs."""
FLOW_DAMPING_FRACTION = 3.0
"""Multiple of ``DAMPED`` below which the map from joints to platform is computed at each step."""

Flags = NDArray[np.bool_]
Places = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class CommandedMotion(Value):
    """Command at n poses: ẋ (n, d), ‖e‖ (n,), the smallest singular value of L S (n,; as ``damped`` gives it), the
    legs' reach margins (n, legs) relative to the zero configuration, a flag that all but active legs reach (n,), and
    the active legs that constrain the platform (n, legs). NaN if a leg does not reach."""

    velocity: Array
    size: Array
    weakest: Array
    margins: Array
    reached: Flags
    held: Flags
    u: Array
    """Observed directions (n, k, 3)."""

    @property
    def moves(self) -> Array:
        """The velocity, none where nothing is commanded."""
        return np.where(self.reached[:, None], self.velocity, 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class Flow(Value):
    """Law of a robot with desired directions ``desired`` (k, 3) of its observed legs; all its legs are closed forms.
    ``flipped`` (n, legs) are those in the other working mode than at the zero configuration."""

    placer: ConfigurationBuilder
    watched: tuple[str, ...]
    desired: Array
    modes: dict[int, ConfigurationBuilder] = field(default_factory=dict)
    """The robot in each working mode that was met, by the bits of the legs that are flipped."""

    @property
    def batch(self) -> Batch:
        """Robot in the working mode of the zero configuration."""
        return self.placer.batch

    @property
    def legs(self) -> tuple[str, ...]:
        """All legs."""
        return tuple(self.batch.legs)

    @cached_property
    def seen(self) -> Flags:
        """Flags of the observed legs."""
        return np.isin(self.legs, self.watched)

    @cached_property
    def points(self) -> Flags:
        """Flags of the legs that slide along a line through a fixed point, at which they reverse: no limit of reach."""
        return np.array([leg is not None and leg.can_reverse for leg in self.batch.legs.values()])

    @cached_property
    def pointed(self) -> Flags:
        """Flags of the observed ones of these."""
        return np.array([self.points[self.legs.index(name)] for name in self.watched])

    def at(self, X: Array, flipped: Flags, active: Flags, root: Array) -> CommandedMotion:
        """The command at poses X (n, 4, 4), with S (n, d, d)."""
        n, d, k = len(X), root.shape[1], len(self.watched)
        margins, u, M = np.empty((n, len(self.legs))), np.empty((n, k, 3)), np.empty((n, k, 3, d))
        for bits, some in _groups(flipped):
            margins[some], u[some], M[some] = self.mode_placer(bits).batch.rows_at(X[some], self.watched)
        margins /= self._home
        reached = np.all((margins > 0) | active, axis=1) & np.isfinite(M).all(axis=(1, 2, 3))
        u[~reached], M[~reached] = self.desired, 0.0
        error = cross(u, self.desired).reshape(n, 3 * k, 1)
        # L_iᵀ = −[u_di]ₓ M_iᵀ
        L = -(hat(self.desired) @ M).reshape(n, 3 * k, d)
        scaled = L @ root
        back = np.ascontiguousarray(scaled.transpose(0, 2, 1))
        A, g = back @ scaled, back @ error
        velocity, weakest = damped_inverse(A, g[..., 0])
        held = np.zeros_like(active)
        slid = np.flatnonzero(active.any(axis=1) & reached)
        if len(slid):
            normals = np.where(active[slid, :, None], self.slopes(X[slid], flipped[slid]), 0.0) @ root[slid]
            velocity[slid], weakest[slid], push = _along(normals, A[slid], g[slid, :, 0])
            held[slid] = active[slid] & (push >= 0)
        velocity, size = times(root, velocity), np.linalg.norm(error, axis=(1, 2))
        for each in (velocity, size, weakest, u):
            each[~reached] = np.nan
        return CommandedMotion(velocity, size, weakest, margins, reached, held, u)

    def margins(self, X: Array, flipped: Flags) -> Array:
        """Return the legs' reach margins (n, legs) relative to the zero configuration."""
        found = np.empty((len(X), len(self.legs)))
        for bits, some in _groups(flipped):
            found[some] = self.mode_placer(bits).batch.rows_at(X[some], ())[0]
        return found / self._home

    def slopes(self, X: Array, flipped: Flags) -> Array:
        """The rates of the margins (n, legs, d)."""
        n, d = len(X), self.batch.span.shape[1]
        steps = FLOW_SLOPE_STEP_MAX * np.concatenate([np.eye(d), -np.eye(d)])
        around = self.margins(
            self.move(np.tile(X, (2 * d, 1, 1)), np.repeat(steps, n, axis=0)), np.tile(flipped, (2 * d, 1))
        ).reshape(2, d, n, len(self.legs))
        return np.asarray((around[0] - around[1]).transpose(1, 2, 0) / (2 * FLOW_SLOPE_STEP_MAX))

    def move(self, X: Array, y: Array) -> Array:
        """The poses (n, 4, 4) with coordinates y (n, d) in the chart about X: the point moved, the frame turned."""
        platform, span = self.batch.coordinates, self.batch.span
        p, R = platform.place(X)
        found = X.copy()
        found[:, :3, :3] = convert_vectors_to_rotations(y @ span[3:].T) @ R
        found[:, :3, 3] = p + y @ span[:3].T - found[:, :3, :3] @ platform.point
        return found

    def rate(self, y: Array, velocity: Array) -> Array:
        """ẏ (n, d) of the chart's coordinates y for twists' coordinates (n, d): the same where the platform turns about
        one axis, else by the inverse of the exponential's differential, to third order."""
        if self._turns.shape[1] < 3:
            return velocity
        turn, spin = y @ self.batch.span[3:].T, velocity @ self.batch.span[3:].T
        once = np.cross(turn, spin)
        return velocity + (np.cross(turn, once) / 12 - once / 2) @ self.batch.span[3:]

    def roots(self, X: Array, flipped: Flags) -> tuple[Array, Flags]:
        """S (n, d, d) at poses: S² = P Pᵀ, P the platform's coordinates for joint velocities that keep the loops
        closed; and where the robot was found closed."""
        model, coordinates, inverse = self.placer.model, self.batch.coordinates, np.linalg.pinv(self.batch.span)
        square, closed = np.empty((len(X), len(inverse), len(inverse))), np.zeros(len(X), dtype=bool)
        for bits, some in _groups(flipped):
            frames, closed[some] = self.mode_placer(bits).frames(X[some])
            J, V = compute_rates(model, frames, coordinates.link)
            arms = hat(coordinates.place(X[some])[0] / model.length)
            V = inverse @ np.concatenate([(V[:, :3] - arms @ V[:, 3:]) * model.length, V[:, 3:]], axis=1)
            inner = J @ J.transpose(0, 2, 1) + CLOSURE_SOLVER_TOL * np.eye(J.shape[1])
            across = J @ V.transpose(0, 2, 1)
            square[some] = V @ V.transpose(0, 2, 1) - across.transpose(0, 2, 1) @ np.linalg.solve(inner, across)
        values, Q = np.linalg.eigh(square)
        return Q * np.sqrt(np.maximum(values, 0.0))[:, None] @ Q.transpose(0, 2, 1), closed

    def configurations(self, X: Array, flipped: Flags) -> list[ClosedConfiguration | None]:
        """The closed configurations at poses."""
        found: list[ClosedConfiguration | None] = [None] * len(X)
        for bits, some in _groups(flipped):
            for i, at in zip(some, self.mode_placer(bits).configurations(X[some]), strict=True):
                found[i] = at
        return found

    def bare(self) -> Flow:
        """Return a copy without traced programs, to be sent to another process."""
        return replace(self, placer=replace(self.placer, batch=replace(self.batch, programs={})), modes={})

    def mode_placer(self, bits: int) -> ConfigurationBuilder:
        """The robot in a working mode."""
        if bits not in self.modes:
            legs = {
                name: replace(leg, mode=-leg.mode) if bits >> place & 1 else leg
                for place, (name, leg) in enumerate(self.batch.legs.items())
                if leg is not None
            }
            self.modes[bits] = replace(self.placer, batch=replace(self.batch, legs=legs, programs={}))
        return self.modes[bits]

    @cached_property
    def _home(self) -> Array:
        return self.batch.rows_at(self.batch.home[None], ())[0]

    @property
    def _turns(self) -> Array:
        return self.batch.coordinates.rotations


def damped_inverse(A: Array, g: Array) -> tuple[Array, Array]:
    """Return −V max(Σ², DAMPED²)⁻¹ Vᵀ g (n, d) for A = V Σ² Vᵀ (n, d, d), as ``law.damped_inverses``; and the smallest
    of Σ (n,), or a lower bound of it from ``FLOW_DAMPING_FRACTION`` times ``DAMPED`` on."""
    d = A.shape[1]
    with np.errstate(all="ignore"):
        found = solve_definite(A, np.concatenate([g[..., None], np.broadcast_to(np.eye(d), A.shape)], axis=2))
        # the norm of A⁻¹ is at least 1 / λ for the least eigenvalue λ of A
        least = 1 / np.sqrt(np.square(found[..., 1:]).sum(axis=(1, 2)))
    weak = ~(least >= (FLOW_DAMPING_FRACTION * CONTROLLER_DAMPING_MIN) ** 2)
    velocity, weakest = -found[..., 0], np.sqrt(least)
    values, V = np.linalg.eigh(A[weak])
    inside = V.transpose(0, 2, 1) @ g[weak, :, None] / np.maximum(values, CONTROLLER_DAMPING_MIN**2)[..., None]
    velocity[weak], weakest[weak] = -(V @ inside)[..., 0], np.sqrt(np.maximum(values[:, 0], 0.0))
    return velocity, weakest


def _along(normals: Array, A: Array, g: Array) -> tuple[Array, Array, Array]:
    """Return the same in the twists on which normals (n, legs, d) vanish; and the reaction of each leg (n, legs): A ẋ +
    g = Nᵀ μ."""
    found, weakest = np.zeros_like(g), np.zeros(len(g))
    _, values, right = np.linalg.svd(normals)
    ranks = np.sum(values > CONTROLLER_DAMPING_MIN * values[:, :1], axis=1)
    for rank in np.unique(ranks[ranks < g.shape[1]]):
        some = np.flatnonzero(ranks == rank)
        K = right[some, rank:].transpose(0, 2, 1)
        inside, weakest[some] = damped_inverse(K.transpose(0, 2, 1) @ A[some] @ K, (g[some, None] @ K)[:, 0])
        found[some] = times(K, inside)
    rest = times(A, found) + g
    push = np.linalg.pinv(normals.transpose(0, 2, 1), rcond=CONTROLLER_DAMPING_MIN) @ rest[..., None]
    return found, weakest, push[..., 0]


def _groups(flipped: Flags) -> list[tuple[int, Places]]:
    """The bits of each working mode, and the places where it is."""
    bits = flipped @ (1 << np.arange(flipped.shape[1]))
    return [(int(each), np.flatnonzero(bits == each)) for each in np.unique(bits)]
