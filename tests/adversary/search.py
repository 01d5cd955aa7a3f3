"""Brute force on the whole robot: many starts, tangent spaces, small steps, ranks by singular values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from adversary.robot import Array, Items, Robot, Rows, State, joined, things

CLEAR, TINY = 1e-5, 1e-9
"""Singular values above are not zero, below are; between them nothing is said."""
SOLVED = 1e-11


def solve(
    robot: Robot, rows: Rows, at: State, free: NDArray[np.bool_] | None = None, *, steps: int = 60
) -> tuple[State, Array]:
    """Levenberg-Marquardt from every configuration at once; the states and their residuals (N,).

    ``free`` says which coordinates may move. Starts that come to rest far from a solution are given up.
    """
    columns = np.arange(robot.size) if free is None else np.flatnonzero(free)
    count = len(at)
    theta, quats = at.theta.copy(), at.quats.copy()
    left = np.arange(count)
    size = np.full(count, np.inf)
    damping = np.full(count, 1e-2)
    if not len(columns):
        steps = 0
    per_start = rows.values.ndim == 3
    F, J = _evaluated(robot, rows, State(theta, quats), left if per_start else None)
    cost = np.sum(F * F, 1)
    size = np.sqrt(cost)
    J = J[:, :, columns]
    for step in range(steps):
        if not len(left):
            break
        A = np.swapaxes(J, 1, 2) @ J
        g = np.einsum("nri,nr->ni", J, F)
        A += (damping[left, None] * np.maximum(np.einsum("nii->ni", A), 1e-3))[:, :, None] * np.eye(len(columns))
        move = np.zeros((len(left), robot.size))
        move[:, columns] = -np.linalg.solve(A + 1e-13 * np.eye(len(columns)), g[:, :, None])[:, :, 0]
        # no start leaps farther than half a turn at once
        move *= np.minimum(
            1.0, 1.5 / np.maximum(np.abs(np.where(robot.slides, move / robot.length, move)).max(1), 1e-9)
        )[:, None]
        tried = robot.moved(State(theta[left], quats[left]), move)
        F2, J2 = _evaluated(robot, rows, tried, left if per_start else None)
        cost2 = np.sum(F2 * F2, 1)
        better = cost2 < cost
        damping[left] = np.where(better, damping[left] * 0.2, damping[left] * 6)
        damping[left] = np.clip(damping[left], 1e-12, 1e8)
        took = left[better]
        theta[took], quats[took] = tried.theta[better], tried.quats[better]
        F, J = np.where(better[:, None], F2, F), np.where(better[:, None, None], J2[:, :, columns], J)
        slow = (cost2 > 0.9 * cost) & (step > 25) & (cost > 1e-6)
        cost = np.where(better, cost2, cost)
        size[left] = np.sqrt(cost)
        stay = (cost > SOLVED**2 * 1e-4) & (damping[left] < 1e7) & ~slow
        left, F, J, cost = left[stay], F[stay], J[stay], cost[stay]
    return State(theta, quats), size


def _evaluated(robot: Robot, rows: Rows, at: State, which: NDArray[np.intp] | None) -> tuple[Array, Array]:
    if which is not None and rows.values.ndim == 3:
        from dataclasses import replace

        rows = replace(rows, values=rows.values[which])
    F, J = robot.rows(rows, robot.frames(at))
    assert J is not None
    return F, J


def polished(
    robot: Robot, rows: Rows, at: State, *, free: NDArray[np.bool_] | None = None, steps: int = 4
) -> tuple[State, Array]:
    """A few Gauss-Newton steps of least norm on each configuration (for sums of squares that are zero)."""
    columns = np.arange(robot.size) if free is None else np.flatnonzero(free)
    for _ in range(steps):
        F, J = _evaluated(robot, rows, at, np.arange(len(at)))
        move = np.zeros((len(at), robot.size))
        move[:, columns] = -np.einsum("nij,nj->ni", np.linalg.pinv(J[:, :, columns], rcond=1e-10), F)
        at = robot.moved(at, move)
    F, _ = _evaluated(robot, rows, at, np.arange(len(at)))
    return at, np.sqrt(np.sum(F * F, 1))


def scattered(robot: Robot, rng: np.random.Generator, count: int, around: State, wide: float = np.pi) -> State:
    """Random configurations: a third near ``around``, the rest anywhere."""
    scale = np.where(np.arange(count) % 3 == 0, 0.35, 1.0)[:, None]
    span = np.where(robot.slides, 0.8 * robot.length, wide)
    return robot.moved(
        State(np.repeat(around.theta[:1], count, 0), np.repeat(around.quats[:1], count, 0)),
        scale * span * rng.uniform(-1, 1, (count, robot.size)),
    )


def split(values: Array, scale: float = 1.0) -> tuple[int, bool]:
    """How many singular values are not zero, and whether that is clear."""
    values = np.asarray(values) / scale
    return int(np.sum(values > CLEAR)), not bool(np.any((values > TINY) & (values < CLEAR)))


@dataclass(frozen=True)
class Local:
    """First order at one configuration: a basis of the velocities (n, mobility), whether the rank is clear, the weakest
    singular value of the loops; twists (6, mobility) of the platform (velocity of its point, characteristic lengths;
    angular velocity)."""

    N: Array
    clear: bool
    weakest: float
    T: Array

    def sees(self, U: Array) -> tuple[int, int, bool]:
        """Freedoms of the platform, how many of them the rates U (r, n) show, whether the ranks are clear: the lost
        ones are the twists of ker U."""
        dof, clear = split(np.linalg.svd(self.T, compute_uv=False))
        rates = U @ self.N
        r, clear_u = split(np.linalg.svd(rates, compute_uv=False))
        kernel = np.linalg.svd(rates)[2][r:].T if len(rates) else np.eye(self.N.shape[1])
        lost, clear_l = split(np.linalg.svd(self.T @ kernel, compute_uv=False)) if kernel.size else (0, True)
        return dof, dof - lost, clear and clear_u and clear_l and self.clear


class Study:
    """A robot under study: what its platform does, what is observed. ``point``: a point body moves as its point."""

    def __init__(self, robot: Robot, point: Array | None = None) -> None:
        self.robot, self.point = robot, point
        rows = robot.loops
        self.loops = rows
        self.platform = things(
            robot,
            [
                (robot.platform, np.zeros(3) if point is None else point, True),
                *((robot.platform, e, False) for e in np.eye(3)),
            ],
        )

    def closed(self, at: State) -> Array:
        """Residuals of the loops (N,)."""
        F = self.robot.rows(self.loops, self.robot.frames(at), False)[0]
        return np.sqrt(np.sum(F * F, 1)) if F.shape[1] else np.zeros(len(at))

    def poses(self, at: State) -> tuple[Array, Array]:
        """The platform's point (N, 3) and rotation (N, 3, 3)."""
        x, _ = self.robot.items(self.platform, self.robot.frames(at))
        return x[:, 0], np.swapaxes(x[:, 1:], 1, 2)

    def twists(self, at: State) -> Array:
        """Rows of the platform's twist (N, 6, n) (N, 3, n) of a point body; lengths in characteristic lengths."""
        frames = self.robot.frames(at)
        _, J = self.robot.items(self.platform, frames)
        v = np.swapaxes(J[:, 0], 1, 2) / self.robot.length
        if self.point is not None:
            return v
        k = self.robot.number(self.robot.platform)
        w = np.swapaxes(frames[2][:, :, :3] * self.robot.carried[k][None, :, None], 1, 2)
        return np.concatenate([v, w], 1)

    def locals(self, at: State) -> list[Local]:
        """First order at each configuration."""
        J = self.robot.rows(self.loops, self.robot.frames(at))[1]
        assert J is not None
        T = self.twists(at)
        metric = np.where(self.robot.slides, self.robot.length, 1.0)
        found = []
        for Jk, Tk in zip(J, T, strict=True):
            Jk, Tk = np.asarray(Jk * metric, dtype=float), np.asarray(Tk * metric, dtype=float)
            if len(Jk):
                _, s, V = np.linalg.svd(Jk)
                r, clear = split(s)
                N = V[r:].T
                weakest = float(s[r - 1]) if r else np.inf
            else:
                N, clear, weakest = np.eye(self.robot.size), True, np.inf
            found.append(Local(N, clear, weakest, Tk @ N))
        return found

    def rates(self, items: Items, at: State) -> Array:
        """Rates (N, 3 k, n) of directions, in the metric of :class:`LocalDerivatives`."""
        J = self.robot.items(items, self.robot.frames(at))[1]
        metric = np.where(self.robot.slides, self.robot.length, 1.0)
        return np.swapaxes(J, 2, 3).reshape(len(at), -1, self.robot.size) * metric

    def walk(
        self, rng: np.random.Generator, start: State, count: int = 6, steps: int = 12, step: float = 0.04
    ) -> tuple[State, NDArray[np.bool_]]:
        """Random walks by small tangent steps, each corrected; the last configurations, and which of them stayed on a
        sheet: steps a small part of the weakest singular value, loops closed, mobility unchanged all the way."""
        robot = self.robot
        metric = np.where(robot.slides, robot.length, 1.0)
        at = State(np.repeat(start.theta[:1], count, 0), np.repeat(start.quats[:1], count, 0))
        heading = rng.normal(size=(count, robot.size))
        good = np.ones(count, dtype=bool)
        mobility = self.locals(at[:1])[0].N.shape[1]
        for _ in range(steps):
            here = self.locals(at)
            move = np.zeros((count, robot.size))
            for k, local in enumerate(here):
                good[k] &= local.clear and local.N.shape[1] == mobility and local.weakest > 1e-3
                heading[k] = local.N @ (local.N.T @ (heading[k] + 0.3 * rng.normal(size=robot.size)))
                size = float(np.linalg.norm(heading[k]))
                if size == 0 or not good[k]:
                    continue
                heading[k] /= size
                move[k] = metric * heading[k] * min(step * np.sqrt(mobility), 0.3 * local.weakest)
            old = at
            at = robot.moved(at, move)
            at, residual = polished(robot, self.loops, at, steps=3)
            off = ~(residual < 1e-9) | ~good
            good &= ~off
            at = State(np.where(off[:, None], old.theta, at.theta), np.where(off[:, None, None], old.quats, at.quats))
        for k, local in enumerate(self.locals(at)):
            good[k] &= local.clear and local.N.shape[1] == mobility
        return at, good


def distinct(x: Array, R: Array, length: float, apart: float = 1e-5) -> NDArray[np.intp]:
    """Of poses (points (N, 3), rotations (N, 3, 3)) one of each that differ."""
    keys = np.concatenate([x / length, R.reshape(len(x), 9)], 1)
    kept: list[int] = []
    for i, key in enumerate(keys):
        if not kept or np.min(np.max(np.abs(keys[kept] - key), axis=1)) > apart:
            kept.append(i)
    return np.array(kept, dtype=np.intp)


__all__ = ["CLEAR", "TINY", "Local", "State", "Study", "distinct", "joined", "polished", "scattered", "solve", "split"]
