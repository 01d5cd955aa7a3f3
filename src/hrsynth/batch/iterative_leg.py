"""A leg that is no known subproblem: damped Gauss-Newton on its joints' coordinates, for many poses at once.

Lengths are characteristic ones, twists those of the end's origin, base axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..equations.carried_vectors import SweptChains
from ..equations.joint_equations import LoopSystem, build_loop_system
from ..equations.loop_parts import evaluate_all_equations
from ..geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ..geometry.vectors import Array, hat
from ..mechanism import JointType, Mechanism
from ..mechanism.legs import Leg
from ..mechanism.observations.direction import Direction
from ..results import Value
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL, RANK_CUTOFF_FRACTION
from .platform_coordinates import PlatformCoordinates

CHAIN_CLOSURE_STEP_MAX = 0.5
"""Longest step of a coordinate of a chain closed in a batch (characteristic lengths, radians)."""
CHAIN_CLOSURE_STEPS_COUNT = 4
"""Steps of such a chain at each waypoint."""

LEG_FINAL_STEPS_COUNT = 25
"""Steps at the end of the way to a pose."""
LEG_PATH_STEP_MAX = 0.2
"""Length of the way from one place to the next (characteristic lengths, radians)."""


@dataclass(frozen=True, eq=False, repr=False)
class IterativeLeg(Value):
    """A leg as a mechanism of its own, from the base to the link on which it ends; of a point body only the place of
    its ``point`` (in its frame, m) is given. A state is the coordinates q (n, N) of its joints."""

    system: LoopSystem
    seen: Direction
    point: Array | None

    @classmethod
    def of(cls, mechanism: Mechanism, leg: Leg, seen: Direction, point: Array | None) -> IterativeLeg:
        """The chain of a leg; ``point`` where the platform is a point body."""
        names = dict.fromkeys((mechanism.base, leg.platform_link, *leg.links, seen.link))
        links = {name: mechanism.links[name] for name in names}
        joints = {name: mechanism.joints[name] for name in leg.joints}
        own = Mechanism(leg.label, links, joints, mechanism.base, leg.platform_link, scale=mechanism.length)
        return cls(build_loop_system(own, ()), seen, point)

    @property
    def end_link(self) -> str:
        """The link on which the chain ends."""
        return self.system.mechanism.platform

    def start(self, n: int) -> Array:
        """The zero configuration, n times."""
        return np.repeat(self.system.zero[None], n, axis=0)

    def _equations(self, q: Array) -> tuple[list[Array], Array]:
        """The inner loops (n, m), the end's place (n, 3), its rotation (n, 3, 3) but of a point body, and the observed
        direction (n, 3); and the rates of all together (n, rows, N)."""
        system, carrier, n = self.system, SweptChains(self.system, list(q.T)), len(q)
        X, way = system.mechanism.links[self.end_link].pose, system.way(system.body[self.end_link])
        place = X[:3, 3] if self.point is None else X[:3, :3] @ self.point + X[:3, 3]
        zero = system.mechanism.links[self.seen.link].pose[:3, :3] @ self.seen.direction
        at = carrier.point(way, place / system.length)
        u = carrier.direction(system.way(system.body[self.seen.link]), zero)
        errors, loops = evaluate_all_equations(system, system.loops, (), list(q.T), (n,))
        moves, turns, drift = np.zeros((3, n, 3, q.shape[1]))
        for part in at.parts:
            moves[:, :, part.places], turns[:, :, part.places] = (
                each.swapaxes(-1, -2) for each in (part.columns, part.axes)
            )
        for part in u.parts:
            drift[:, :, part.places] = part.columns.swapaxes(-1, -2)
        R = [np.broadcast_to(carrier.rotation(way) @ X[:3, :3], (n, 3, 3))] * (self.point is None)
        found = [errors, np.broadcast_to(at.value, (n, 3)), *R, np.broadcast_to(u.value, (n, 3))]
        return found, np.concatenate([loops, moves, *[turns] * len(R), drift], axis=1)

    def close(self, q: Array, ends: Array, iterations: int, wanted: Array | None = None) -> tuple[Array, Array]:
        """Coordinates nearest to q (n, N) with the end at ``ends`` (n, 4, 4) and, if it is given, the direction
        ``wanted`` (n, 3); and the residuals left (n,), infinite where a joint's axis has turned over."""
        q = q.copy()
        live, size = np.arange(len(q)), np.full(len(q), np.inf)
        for _ in range(iterations):
            (errors, place, *R, u), J = self._equations(q[live])
            away = [errors, place - ends[live, :3, 3]]
            away += [-convert_rotations_to_vectors(ends[live, :3, :3] @ each.swapaxes(-1, -2)) for each in R]
            residual = np.concatenate([*away, 0 * u if wanted is None else u - wanted[live]], axis=1)
            size[live] = np.linalg.norm(residual, axis=1)
            keep = size[live] > CLOSURE_SOLVER_TOL / 10
            if not keep.any():
                break
            count = J.shape[1] - (3 if wanted is None else 0)
            live, residual, J = live[keep], residual[keep, :count], J[keep, :count]
            damping = np.maximum(size[live] ** 2, 1e-14)
            A = J.transpose(0, 2, 1) @ J + damping[:, None, None] * np.eye(J.shape[2])
            step = -np.linalg.solve(A, J.transpose(0, 2, 1) @ residual[:, :, None])[..., 0]
            q[live] += step * np.minimum(1.0, CHAIN_CLOSURE_STEP_MAX / np.maximum(np.abs(step).max(1), 1e-300))[:, None]
        return q, np.where(self._stands(q), size, np.inf)

    def _stands(self, q: Array) -> NDArray[np.bool_]:
        """Return True where no axis of a joint that closes an inner loop has turned over, (n,)."""
        carrier, kept = SweptChains(self.system, list(q.T)), np.ones(len(q), dtype=bool)
        for loop in self.system.loops:
            joint = self.system.mechanism.joints[loop.name]
            turning = joint.type in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR)
            slipping = joint.type in (JointType.PRISMATIC, JointType.FIXED)
            for axis in joint.axes if turning else np.eye(3) if slipping else ():
                one, two = (carrier.direction(chain, axis).value for chain in loop.chains)
                kept = kept & (np.sum(one * two, axis=-1) > 0)
        return kept

    def answers(self, q: Array) -> tuple[Array, Array, Array]:
        """u (n, 3); its rate by the twist of the end (n, 3, 6); the wrenches that the leg transmits to the end, as an
        orthonormal set padded with zeros (n, 6, 6)."""
        (*_, u), J = self._equations(q)
        J, drift = J[:, :-3], J[:, -3:]
        size = 6 if self.point is None else 3
        end = np.zeros((J.shape[1], 6))
        end[-size:, :size] = np.eye(size)
        left, s, right = np.linalg.svd(J, full_matrices=True)
        rank = int(np.median(np.sum(s > RANK_CUTOFF_FRACTION * s[:, :1], axis=1)))
        back = (right[:, :rank].swapaxes(-1, -2) / s[:, None, :rank]) @ left[:, :, :rank].swapaxes(-1, -2) @ end
        wrenches = left[:, :, rank:].swapaxes(-1, -2) @ end
        _, s, right = np.linalg.svd(np.concatenate([wrenches, np.zeros((len(q), 6, 6))], axis=1), full_matrices=False)
        return u, drift @ back, right * (s > RANK_CUTOFF_FRACTION)[:, :, None]

    def frames(self, links: Sequence[str], q: Array) -> dict[str, Array]:
        """The poses (n, 4, 4) of some of its links, m."""
        return {name: self.system.pose(name, q.T) for name in links}

    def follow_from_zero(
        self, coordinates: PlatformCoordinates, home: Array, X: Array, span: Array
    ) -> IterativeLegStates:
        """Return the chain at platform poses X (n, 4, 4), followed from ``home`` in small steps, all poses at once."""
        p, R = coordinates.place(X)
        (p0,), (R0,) = coordinates.place(home[None])
        turned = self.end_link in coordinates.links
        turn = convert_rotations_to_vectors(R @ R0.T) if turned else np.zeros_like(p)
        far = np.linalg.norm(p - p0, axis=1) / self.system.length + np.linalg.norm(turn, axis=1)
        steps = max(1, int(np.ceil(np.max(far, initial=0.0) / LEG_PATH_STEP_MAX)))
        state, residual = self.start(len(X)), np.zeros(len(X))
        for step in range(1, steps + 1):
            part = step / steps
            there = self.end(
                coordinates, p0 + part * (p - p0), convert_vectors_to_rotations(part * turn) @ R0 if step < steps else R
            )
            state, residual = self.close(
                state, there, LEG_FINAL_STEPS_COUNT if step == steps else CHAIN_CLOSURE_STEPS_COUNT
            )
        return IterativeLegStates(self, coordinates, state, residual, R, span)

    def end(self, coordinates: PlatformCoordinates, p: Array, R: Array) -> Array:
        """Poses (n, 4, 4) of what the platform gives: the end, or its point; characteristic lengths."""
        link = coordinates.links.get(self.end_link)
        X = np.tile(np.eye(4), (len(p), 1, 1)) if link is None else link.poses(p, R)
        X[:, :3, 3] = (p if link is None else X[:, :3, 3]) / self.system.length
        return X


@dataclass(frozen=True, eq=False, repr=False)
class IterativeLegStates(Value):
    """A chain at n poses of its end; ``span`` (6, D) are the platform's twists (m, rad)."""

    leg: IterativeLeg
    coordinates: PlatformCoordinates
    state: Array
    residual: Array
    R: Array
    span: Array

    @cached_property
    def _answers(self) -> tuple[Array, Array, Array]:
        return self.leg.answers(self.state)

    @cached_property
    def _motions(self) -> Array:
        """The end's twists (n, 6, D), characteristic lengths, for those of the platform."""
        v, w = self.span[:3], self.span[3:]
        body, length = self.coordinates.links.get(self.leg.end_link), self.leg.system.length
        moves = np.broadcast_to(v, (len(self.R), *v.shape))
        if body is None:
            return np.concatenate([moves / length, np.zeros_like(moves)], axis=1)
        moves = moves - hat(self.R @ body.b) @ w
        turns = np.broadcast_to(w if body.turns else np.zeros_like(w), moves.shape)
        return np.concatenate([moves / length, turns], axis=1)

    def rows(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """u (3, n), the leg's rows of Mᵀ (3, D, n), and where the leg closes."""
        u, M, _ = self._answers
        return u.T, (M @ self._motions).transpose(1, 2, 0), self.residual <= CLOSURE_RESIDUAL_TOL

    def wrenches(self) -> Array:
        """Return the wrenches of the leg on the platform, (n, 6, D)."""
        return self._answers[2] @ self._motions
