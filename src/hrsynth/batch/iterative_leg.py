"""A leg that is no known subproblem: damped Gauss-Newton on the poses of its links, for many poses at once.

A state holds the poses X_BL (n, links, 4, 4) of the leg's links, positions in characteristic lengths; twists are those
of the link frames' origins, base axes. A joint is what it forbids: forces n (fixed in one link) between two points, and
products α·β of directions fixed in its two links.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..budgets import CHAIN_CLOSURE_STEP_MAX, CHAIN_CLOSURE_STEPS_COUNT
from ..geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ..geometry.vectors import Array, build_plane_axes, cross, hat, invert_pose, times
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg
from ..mechanism.observations.direction import Direction
from ..results import Value
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL, RANK_CUTOFF_FRACTION
from .platform_coordinates import PlatformCoordinates

LEG_FINAL_STEPS_COUNT = 25
"""Steps at the end of the way to a pose."""
LEG_PATH_STEP_MAX = 0.2
"""Length of the way from one place to the next (characteristic lengths, radians)."""

_FORCES = {"R": (0, 1, 2), "P": (0, 1), "C": (0, 1), "E": (2,), "S": (0, 1, 2), "U": (0, 1, 2), "F": (0, 1, 2)}
_TURNS = {
    "R": ((0, 2), (1, 2)),
    "P": ((0, 2), (1, 2), (0, 1)),
    "C": ((0, 2), (1, 2)),
    "E": ((0, 2), (1, 2)),
    "F": ((0, 2), (1, 2), (0, 1)),
}
"""For each type, axis 2 along its own: the axes of its forces, and the pairs of axes (of predecessor and successor)
that stay perpendicular."""


@dataclass(frozen=True, eq=False, repr=False)
class ClosureRows(Value):
    """Rows of joints: forces (i, j, n in i, point in i, point in j), moments (i, j, α in i, β in j, level); and
    directions that coincide (i, j, α in i, β in j), which moments alone do not distinguish from opposite ones."""

    forces: list[tuple[int, int, Array, Array, Array]] = field(default_factory=list)
    moments: list[tuple[int, int, Array, Array, float]] = field(default_factory=list)
    upright: list[tuple[int, int, Array, Array]] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.forces) + len(self.moments)

    def add(self, joint: Joint, i: int, j: int, X_i: Array, X_j: Array, length: float) -> None:
        """The rows of a joint between links numbered i and j, whose poses at zero (metres) are given."""
        frame = np.eye(4)
        frame[:3, 3] = joint.point
        if joint.axes:
            frame[:3, :3] = np.column_stack((*build_plane_axes(joint.axis), joint.axis))
        a, b = invert_pose(X_i) @ frame, invert_pose(X_j) @ frame
        kind = joint.type.value
        self.forces.extend((i, j, a[:3, k], a[:3, 3] / length, b[:3, 3] / length) for k in _FORCES.get(kind, ()))
        self.moments.extend((i, j, a[:3, k], b[:3, m], 0.0) for k, m in _TURNS.get(kind, ()))
        kept = (2,) if len(_TURNS.get(kind, ())) == 2 else (0, 2) if kind in _TURNS else ()
        self.upright.extend((i, j, a[:3, k], b[:3, k]) for k in kept)
        if joint.type is JointType.UNIVERSAL:
            first, second = joint.axes
            self.moments.append((i, j, X_i[:3, :3].T @ first, X_j[:3, :3].T @ second, float(first @ second)))

    def pin(self, i: int, j: int, at_i: Array, at_j: Array) -> None:
        """The rows that keep two points together."""
        self.forces.extend((i, j, axis, at_i, at_j) for axis in np.eye(3))

    def stand(self, X: Array) -> NDArray[np.bool_]:
        """Return True where no direction has the opposite sign, (n,)."""
        R = X[..., :3, :3]
        signs = [np.sum((R[:, i] @ alpha) * (R[:, j] @ beta), axis=1) > 0 for i, j, alpha, beta in self.upright]
        return np.all(signs, axis=0) if signs else np.ones(len(X), dtype=bool)

    @cached_property
    def _stacked(self) -> tuple[list[Any], list[Any]]:
        """Forces and moments, each of their parts of all rows in one array; once all joints are there."""

        def stacked(rows: Sequence[tuple[Any, ...]], vectors: int) -> list[Any]:
            columns = list(zip(*rows, strict=True)) or [()] * 5
            shapes = [(-1, 3) if 2 <= k < 2 + vectors else (-1,) for k in range(5)]
            return [
                np.array(column, dtype=int if k < 2 else float).reshape(shape)
                for k, (column, shape) in enumerate(zip(columns, shapes, strict=True))
            ]

        return stacked(self.forces, 3), stacked(self.moments, 2)

    def residual(self, X: Array) -> Array:
        """Return the residual of each row, (n, rows)."""
        (i, j, normal, at_i, at_j), (k, m, alpha, beta, level) = self._stacked
        R, o = X[..., :3, :3], X[..., :3, 3]
        way = o[:, j] + times(R[:, j], at_j) - o[:, i] - times(R[:, i], at_i)
        return np.concatenate(
            [
                np.sum(times(R[:, i], normal) * way, axis=2),
                np.sum(times(R[:, k], alpha) * times(R[:, m], beta), axis=2) - level,
            ],
            axis=1,
        )

    def rates(self, X: Array) -> Array:
        """Return the derivatives by the twists of all links, (n, rows, links, 6)."""
        (i, j, normal, _, at_j), (k, m, alpha, beta, _) = self._stacked
        R, o = X[..., :3, :3], X[..., :3, 3]
        J = np.zeros((len(X), self.count, X.shape[1], 6))
        rows, force, arm = np.arange(len(i)), times(R[:, i], normal), times(R[:, j], at_j)
        J[:, rows, i, :3], J[:, rows, j, :3] = -force, force
        J[:, rows, i, 3:], J[:, rows, j, 3:] = cross(force, o[:, j] + arm - o[:, i]), cross(arm, force)
        rows, moment = np.arange(len(i), self.count), cross(times(R[:, m], beta), times(R[:, k], alpha))
        J[:, rows, k, 3:], J[:, rows, m, 3:] = -moment, moment
        return J


@dataclass(frozen=True, eq=False, repr=False)
class IterativeLeg(Value):
    """A leg between the base and the link on which it ends.

    ``links`` are the base, the end, then the leg's own; ``free`` numbers those whose poses are sought. Where the end is
    a point body only the place of its ``point`` (in its frame, characteristic lengths) is given.
    """

    label: str
    links: tuple[str, ...]
    free: NDArray[np.int64]
    zero: Array
    ties: ClosureRows
    seen: tuple[int, Array]
    """The number of the observed link, and the direction in its frame."""
    length: float

    @classmethod
    def of(cls, mechanism: Mechanism, leg: Leg, seen: Direction, point: Array | None) -> IterativeLeg:
        """The chain of a leg; ``point`` where the platform is a point body."""
        own = [
            link for link in dict.fromkeys((*leg.links, seen.link)) if link not in (mechanism.base, leg.platform_link)
        ]
        links = (mechanism.base, leg.platform_link, *own)
        place = {name: number for number, name in enumerate(links)}
        ties = ClosureRows()
        for name in leg.joints:
            joint = mechanism.joints[name]
            i, j = (place[link] for link in joint.links)
            X_i, X_j = (mechanism.links[link].pose for link in joint.links)
            ties.add(joint, i, j, X_i, X_j, mechanism.length)
        zero = np.array([mechanism.links[link].pose for link in links])
        zero[:, :3, 3] /= mechanism.length
        if point is not None:
            links = (*links, "point")
            zero = np.concatenate([zero, zero[1:2]])
            zero[-1, :3, 3] += zero[-1, :3, :3] @ point / mechanism.length
            ties.pin(len(links) - 1, 1, np.zeros(3), point / mechanism.length)
        given = {0, 1} if point is None else {0, len(links) - 1}
        free = np.array([i for i in range(len(links)) if i not in given], dtype=np.int64)
        return cls(leg.label, links, free, zero, ties, (place[seen.link], np.asarray(seen.direction)), mechanism.length)

    def start(self, n: int) -> Array:
        """The zero configuration, n times."""
        return np.repeat(self.zero[None], n, axis=0)

    def close(self, X: Array, ends: Array, iterations: int) -> tuple[Array, Array]:
        """States nearest to X (n, links, 4, 4) with the end at ``ends`` (n, 4, 4), characteristic lengths, and the
        residuals left (n,), infinite where a joint's axis has turned over."""
        X = X.copy()
        X[:, 1 if 1 not in self.free else -1] = ends
        live = np.arange(len(X))
        size = np.full(len(X), np.inf)
        for _ in range(iterations):
            residual = self.ties.residual(X[live])
            size[live] = np.linalg.norm(residual, axis=1)
            keep = size[live] > CLOSURE_SOLVER_TOL / 10
            if not keep.any() or len(self.free) == 0:
                break
            live, residual = live[keep], residual[keep]
            J = self.ties.rates(X[live])[:, :, self.free].reshape(len(live), self.ties.count, -1)
            damping = np.maximum(size[live] ** 2, 1e-14)
            A = J.transpose(0, 2, 1) @ J + damping[:, None, None] * np.eye(J.shape[2])
            step = -np.linalg.solve(A, J.transpose(0, 2, 1) @ residual[:, :, None])[..., 0]
            step *= np.minimum(1.0, CHAIN_CLOSURE_STEP_MAX / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
            X[live[:, None], self.free] = move_poses(X[live[:, None], self.free], step.reshape(len(live), -1, 6))
        return X, np.where(self.ties.stand(X), size, np.inf)

    def answers(self, X: Array) -> tuple[Array, Array, Array]:
        """u (n, 3); its rate by the twist of the end (n, 3, 6); the wrenches that the leg transmits to the end, as an
        orthonormal set padded with zeros (n, 6, 6)."""
        number, direction = self.seen
        u = X[:, number, :3, :3] @ direction
        J = self.ties.rates(X)
        given = 1 if 1 not in self.free else len(self.links) - 1
        own, end = J[:, :, self.free].reshape(len(X), self.ties.count, -1), J[:, :, given]
        left, s, right = np.linalg.svd(own, full_matrices=True)
        rank = int(np.median(np.sum(s > RANK_CUTOFF_FRACTION * s[:, :1], axis=1))) if s.size else 0
        wrenches = left[:, :, rank:].transpose(0, 2, 1) @ end
        back = (right[:, :rank].transpose(0, 2, 1) / s[:, None, :rank]) @ left[:, :, :rank].transpose(0, 2, 1)
        twists = np.zeros((len(X), len(self.links), 6, 6))
        twists[:, given] = np.eye(6)
        twists[:, self.free] = -(back @ end).reshape(len(X), len(self.free), 6, 6)
        minus = -hat(u)
        _, s, right = np.linalg.svd(np.concatenate([wrenches, np.zeros((len(X), 6, 6))], axis=1), full_matrices=False)
        return u, minus @ twists[:, number, 3:], right * (s > RANK_CUTOFF_FRACTION)[:, :, None]

    def follow_from_zero(
        self, coordinates: PlatformCoordinates, home: Array, X: Array, span: Array
    ) -> IterativeLegStates:
        """Return the chain at platform poses X (n, 4, 4), followed from ``home`` in small steps, all poses at once."""
        p, R = coordinates.place(X)
        (p0,), (R0,) = coordinates.place(home[None])
        turn = convert_rotations_to_vectors(R @ R0.T) if self.has_rotation(coordinates) else np.zeros_like(p)
        far = np.max(np.linalg.norm(p - p0, axis=1) / self.length + np.linalg.norm(turn, axis=1), initial=0.0)
        steps = max(1, int(np.ceil(far / LEG_PATH_STEP_MAX)))
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

    def has_rotation(self, coordinates: PlatformCoordinates) -> bool:
        """Return True if the end's rotation is given."""
        return self.end_link in coordinates.links

    @property
    def end_link(self) -> str:
        """The link on which the chain ends."""
        return self.links[1]

    def end(self, coordinates: PlatformCoordinates, p: Array, R: Array) -> Array:
        """Poses (n, 4, 4) of what the platform gives: the end, or its point; characteristic lengths."""
        link = coordinates.links.get(self.end_link)
        if link is not None:
            X = link.poses(p, R)
            X[:, :3, 3] /= self.length
            return X
        X = np.tile(np.eye(4), (len(p), 1, 1))
        X[:, :3, 3], X[:, :3, :3] = p / self.length, self.zero[-1, :3, :3]
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
        body = self.coordinates.links.get(self.leg.end_link)
        moves = np.broadcast_to(v, (len(self.R), *v.shape))
        if body is None:
            return np.concatenate([moves / self.leg.length, np.zeros_like(moves)], axis=1)
        moves = moves - hat(self.R @ body.b) @ w
        turns = np.broadcast_to(w if body.turns else np.zeros_like(w), moves.shape)
        return np.concatenate([moves / self.leg.length, turns], axis=1)

    def rows(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """u (3, n), the leg's rows of Mᵀ (3, D, n), and where the leg closes."""
        u, M, _ = self._answers
        return u.T, (M @ self._motions).transpose(1, 2, 0), self.residual <= CLOSURE_RESIDUAL_TOL

    def wrenches(self) -> Array:
        """Return the wrenches of the leg on the platform, (n, 6, D)."""
        return self._answers[2] @ self._motions


def move_poses(X: Array, twists: Array) -> Array:
    """Poses (..., 4, 4) after twists (..., 6) of their origins for a unit of time."""
    found = X.copy()
    found[..., :3, 3] += twists[..., :3]
    found[..., :3, :3] = convert_vectors_to_rotations(twists[..., 3:]) @ X[..., :3, :3]
    return found
