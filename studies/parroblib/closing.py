"""Many symmetric robots at once: closed by damped Gauss-Newton, with the screws of all their factors.

Robots of one batch have the same number of legs and of joints in a leg. Each is closed at one or several poses of its
platform. Unknown are the joints, the poses and, to find a first configuration, the dimensions, which all poses share:
what is found is a random member of the geometries that can be assembled there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hrsynth.geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from hrsynth.geometry.vectors import Array, cross
from hrsynth.tolerances import CLOSURE_SOLVER_TOL

from .limits import DAMPED, FAR, LONGEST_STEP, STEPS, STIFF
from .motions import TURN, TX, LegFactor, dimensions


@dataclass(frozen=True, eq=False)
class RobotBatch:
    """Factors of B robots with n legs, in S slots: kinds (S,), constants (S, B, n), turns by slot (B, n, 3, 3), which
    dimension is added (S, B), ``count`` for none, its signs (S, B, n), the joint that is added (S,), −1 for none, and
    in which robots (S, B)."""

    kinds: list[int]
    constants: Array
    turns: dict[int, Array]
    dimension: Array
    signs: Array
    joint: list[int]
    moved: Array
    count: int
    joints: int

    def of(self, some: Array) -> RobotBatch:
        """Those robots of the batch."""
        return replace(
            self,
            constants=self.constants[:, some],
            turns={s: R[some] for s, R in self.turns.items()},
            dimension=self.dimension[:, some],
            signs=self.signs[:, some],
            moved=self.moved[:, some],
        )

    def at_poses(self, count: int) -> RobotBatch:
        """The same robots at so many poses: their legs as often."""
        return replace(
            self,
            constants=np.tile(self.constants, count),
            signs=np.tile(self.signs, count),
            turns={s: np.concatenate([R] * count, axis=1) for s, R in self.turns.items()},
        )


@dataclass(frozen=True, eq=False)
class BatchState:
    """Dimensions (B, K + 1), the last one 0, joints (B, poses · n, m), and the platform's poses: (B, poses, 3),
    (B, poses, 3, 3)."""

    lengths: Array
    q: Array
    p: Array
    R: Array

    def of(self, some: Array) -> BatchState:
        """Those robots."""
        return BatchState(self.lengths[some], self.q[some], self.p[some], self.R[some])


def batch(robots: Sequence[Sequence[LegFactor]], joints: int) -> RobotBatch:
    """Robots with the same slots as one batch; slots that do nothing are left out."""
    names = [dimensions(parts) for parts in robots]
    count, n = max(map(len, names)), len(robots[0][0].constant)
    kept: list[tuple[int, Array, Array, Array, int, Array]] = []
    turns: dict[int, Array] = {}
    for slot in zip(*robots, strict=True):
        kind, values = slot[0].kind, np.stack([part.constant for part in slot])
        which = np.array(
            [
                count if part.dimension is None else own.index(part.dimension)
                for part, own in zip(slot, names, strict=True)
            ]
        )
        moves = np.array([part.joint is not None for part in slot])
        if kind == TURN:
            if np.array_equal(values, np.broadcast_to(np.eye(3), values.shape)):
                continue
            turns[len(kept)], values = values, np.zeros(values.shape[:2])
        elif not values.any() and (which == count).all() and not moves.any():
            continue
        signs = np.stack([np.zeros(n) if part.signs is None else part.signs for part in slot])
        kept.append((kind, values, which, signs, max(-1 if part.joint is None else part.joint for part in slot), moves))
    kinds, constants, dimension, signed, joint, moved = zip(*kept, strict=True)
    return RobotBatch(
        list(kinds),
        np.stack(constants),
        turns,
        np.stack(dimension),
        np.stack(signed),
        list(joint),
        np.stack(moved),
        count,
        joints,
    )


def forward(of: RobotBatch, at: BatchState) -> tuple[Array, Array, Array, Array]:
    """Poses of the ends of the legs, (B, n, 3) and (B, n, 3, 3), and the screws (v, ω) at the base's origin of the
    joints (B, n, m, 6) and dimensions (B, n, K + 1, 6)."""
    B, n = at.q.shape[:2]
    columns = [np.broadcast_to(axis, (B, n, 3)).copy() for axis in np.eye(3)]
    p = np.zeros((B, n, 3))
    of_joints, of_lengths = np.zeros((B, n, of.joints, 6)), np.zeros((B, n, of.count + 1, 6))
    every = np.arange(B)
    for s, kind in enumerate(of.kinds):
        if kind == TURN:
            R = np.stack(columns, axis=-1) @ of.turns[s]
            columns = [R[..., k] for k in range(3)]
            continue
        axis, shift = kind % 3, kind >= TX
        value = of.constants[s] + of.signs[s] * at.lengths[every, of.dimension[s]][:, None]
        moved, sized = of.moved[s].any(), (of.dimension[s] < of.count).any()
        a = columns[axis]
        if moved or sized:
            screw = np.concatenate([a, np.zeros_like(a)] if shift else [cross(p, a), a], axis=-1)
        if moved:
            value = value + of.moved[s][:, None] * at.q[:, :, of.joint[s]]
            of_joints[:, :, of.joint[s]] += of.moved[s][:, None, None] * screw
        if sized:
            of_lengths[every, :, of.dimension[s]] += of.signs[s][..., None] * screw
        if shift:
            p = p + value[..., None] * a
        else:
            c, d = np.cos(value)[..., None], np.sin(value)[..., None]
            i, j = ((1, 2), (2, 0), (0, 1))[axis]
            columns[i], columns[j] = c * columns[i] + d * columns[j], c * columns[j] - d * columns[i]
    return p, np.stack(columns, axis=-1), of_joints, of_lengths


def at_point(screws: Array, points: Array) -> Array:
    """Screws (..., k, 6) at the base's origin, told at points (..., 3): v + ω × P."""
    return np.concatenate([screws[..., :3] + cross(screws[..., 3:], points[..., None, :]), screws[..., 3:]], axis=-1)


def legs_at(of: RobotBatch, at: BatchState) -> Array:
    """The screws of the joints (B, n, m, 6), told at the ends of the legs."""
    p, _, screws, _ = forward(of, at)
    return at_point(screws, p)


def close(
    of: RobotBatch, start: BatchState, turning: Array, shifting: Array, *, sized: bool
) -> tuple[BatchState, NDArray[np.bool_]]:
    """The nearest closed states, and which were reached, (B,). ``turning`` (B, poses, 3): about which of its axes the
    platform may turn, ``shifting`` (B, poses, 3) along which it may move; ``sized``: whether dimensions may change."""
    B, n, m = start.q.shape
    state = BatchState(start.lengths.copy(), start.q.copy(), start.p.copy(), start.R.copy())
    poses = start.p.shape[1]
    done, work, part, at = np.zeros(B, dtype=bool), np.arange(B), of, start
    stiff = np.full(of.count, STIFF if sized else 0.0)
    for _ in range(STEPS):
        p, R, of_joints, of_lengths = forward(part, at)
        leg_R, leg_p = np.repeat(at.R, n // poses, axis=1), np.repeat(at.p, n // poses, axis=1)
        error = np.concatenate([p - leg_p, convert_rotations_to_vectors(R @ np.swapaxes(leg_R, -1, -2))], axis=-1)
        size = np.abs(error).max(axis=(1, 2))
        ready = size < CLOSURE_SOLVER_TOL
        for whole, some in ((state.lengths, at.lengths), (state.q, at.q), (state.p, at.p), (state.R, at.R)):
            whole[work[ready]] = some[ready]
        done[work[ready]] = True
        keep = ~ready & (size < FAR)
        if not keep.any():
            break
        work, part, at, p, of_joints, of_lengths, error = (
            work[keep],
            part.of(keep),
            at.of(keep),
            p[keep],
            of_joints[keep],
            of_lengths[keep],
            error[keep],
        )
        J = np.concatenate(
            [_rows(part, at, p, of_joints, of_lengths), _of_poses(at, turning[work], shifting[work], n)], axis=-1
        )
        x = _step(J, np.concatenate([stiff, np.ones(n * m + 6 * poses)]), error.reshape(len(work), -1))
        lengths = at.lengths.copy()
        lengths[:, : of.count] += x[:, : of.count]
        moves = x[:, of.count + n * m :].reshape(len(work), poses, 6)
        at = BatchState(
            lengths,
            at.q + x[:, of.count : of.count + n * m].reshape(len(work), n, m),
            at.p + shifting[work] * moves[..., :3],
            at.R @ convert_vectors_to_rotations(turning[work] * moves[..., 3:]),
        )
    return state, done


def _rows(of: RobotBatch, at: BatchState, p: Array, of_joints: Array, of_lengths: Array) -> Array:
    """The rates of the legs' ends with dimensions and joints, (B, n, 6, K + n m)."""
    B, n, m = at.q.shape
    J = np.zeros((B, n, 6, of.count + n * m))
    J[..., : of.count] = np.swapaxes(at_point(of_lengths[:, :, : of.count], p), -1, -2)
    own = np.swapaxes(at_point(of_joints, p), -1, -2)
    for i in range(n):
        J[:, i, :, of.count + i * m : of.count + (i + 1) * m] = own[:, i]
    return J


def _of_poses(at: BatchState, turning: Array, shifting: Array, n: int) -> Array:
    """The rates of the poses, negative, (B, n, 6, 6 poses)."""
    B, poses = at.p.shape[:2]
    J = np.zeros((B, n, 6, 6 * poses))
    for k in range(poses):
        legs = slice(k * n // poses, (k + 1) * n // poses)
        J[:, legs, :3, 6 * k : 6 * k + 3] = -(np.eye(3) * shifting[:, k, None, :])[:, None]
        J[:, legs, 3:, 6 * k + 3 : 6 * k + 6] = -(at.R[:, k] * turning[:, k, None, :])[:, None]
    return J


def _step(J: Array, weights: Array, error: Array) -> Array:
    """The damped step of least weighted length that cancels the error to first order, no longer than allowed."""
    A = (J * weights).reshape(len(J), error.shape[1], -1)
    damping = np.minimum(DAMPED, DAMPED * np.sum(error**2, axis=1)) + CLOSURE_SOLVER_TOL
    H = A @ np.swapaxes(A, -1, -2) + damping[:, None, None] * np.eye(error.shape[1])
    x = -weights * (np.swapaxes(A, -1, -2) @ np.linalg.solve(H, error[..., None]))[..., 0]
    return np.asarray(x * np.minimum(1.0, LONGEST_STEP / np.maximum(np.abs(x).max(axis=1), LONGEST_STEP))[:, None])
