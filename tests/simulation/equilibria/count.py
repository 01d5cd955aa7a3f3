"""Rests of a loop counted again: gradient descent and Newton's method in the oracle's maximal coordinates.

E = ½ Σ (1 − (u_i · u_di)²), of image points ½ Σ ‖x_i − x_di‖², depends on link poses alone; the constraints are the
oracle's wrenches. A step is projected onto the motions that these allow. Nothing is shared with what is under test but
the description of the robot.

``python -m simulation.equilibria.count 1000 3rpr_m1 quattro:1,4`` (from ``tests/``) counts and compares.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.observations.point import ImagePoint
from hrsynth.simulation.equilibria.equilibria import equilibria
from hrsynth.simulation.equilibria.equilibrium import Equilibria
from oracle import Oracle
from simulation.scenes import GOALS

EPS = 1e-13
FOUND, CLOSED, SAME = 1e-9, 1e-9, 1e-4
LOST, FLAT = 1e-9, 1e-7
"""Relative sizes of singular values and curvatures below which they vanish."""


@dataclass
class Counted:
    """What so many starts led to: ends of each method that are members, that are of other modes or no isolated rests,
    and those that are neither; the numbers of the members that were met."""

    starts: int
    ends: Counter = field(default_factory=Counter)
    strangers: list[str] = field(default_factory=list)
    met: set[int] = field(default_factory=set)


class Descent:
    """E on the closed loops of a robot in maximal coordinates."""

    def __init__(self, found: Equilibria) -> None:
        setup = found.setup
        self.oracle = Oracle(setup.mechanism)
        every = list(zip(setup.samples.observation_model.observations, found.desired, strict=True))
        self.seen = [(self.oracle.index[o.link], o.direction, w) for o, w in every if isinstance(o, Direction)]
        self.points = [
            (
                self.oracle.index[o.link],
                o.at,
                self.oracle.index[o.seen_from or setup.mechanism.reference],
                o.view,
                w[:2] / w[2],
            )
            for o, w in every
            if isinstance(o, ImagePoint)
        ]
        assert len(self.seen) + len(self.points) == len(every)
        self.place = {number: 6 * k for k, number in enumerate(self.oracle.moving)}
        self.size = 6 * len(self.place)
        self.scale = np.tile([self.oracle.length] * 3 + [1.0] * 3, len(self.place))

    def constraints(self, state: Array) -> tuple[Array, Array]:
        """Residual and its derivative by the scaled velocities of all links but the base."""
        residual, J = self.oracle.rows.evaluate(state)
        return residual, J[:, self.oracle.moving].reshape(len(residual), self.size) * self.scale

    def error(self, state: Array) -> tuple[float, Array]:
        """E and its derivative."""
        value, slope = 0.0, np.zeros(self.size)
        for link, d, w in self.seen:
            u = state[link, :3, :3] @ d
            c = u @ w
            value += 0.5 * (1 - c * c)
            slope[self.place[link] + 3 : self.place[link] + 6] -= c * np.cross(u, w)
        for link, at, eye, view, wanted in self.points:
            p, R, B = self.ray(state, link, at, eye, view)
            e = p[:2] / p[2] - wanted
            value += 0.5 * float(e @ e)
            pull = R @ np.append(e, -(p[:2] @ e) / p[2]) / p[2]
            for body, sign in ((link, 1.0), (eye, -1.0)):
                if body in self.place:
                    row = np.append(pull, np.cross(B - state[body, :3, 3], pull)) * self.scale[:6]
                    slope[self.place[body] : self.place[body] + 6] += sign * row
        return value, slope

    def ray(self, state: Array, link: int, at: Array, eye: int, view: Array) -> tuple[Array, Array, Array]:
        """A point in the camera's frame, the turn of that frame, and the point in the base's."""
        X, B = state[eye] @ view, state[link, :3, :3] @ at + state[link, :3, 3]
        return X[:3, :3].T @ (B - X[:3, 3]), X[:3, :3], B

    def sighted(self, state: Array) -> bool:
        """Whether all points are in front of their cameras."""
        return all(self.ray(state, *each[:4])[0][2] > 1e-3 for each in self.points)

    def moved(self, state: Array, step: Array) -> Array:
        return self.oracle.moved(state, step * self.scale)

    def closed(self, state: Array, steps: int = 8) -> tuple[Array, float]:
        """The state next to one at which the loops close, and what is left of them."""
        for _ in range(steps):
            r, J = self.constraints(state)
            if np.linalg.norm(r) < EPS:
                break
            state = self.moved(state, -J.T @ np.linalg.solve(J @ J.T + EPS * np.eye(len(r)), r))
        return state, float(np.linalg.norm(self.constraints(state)[0]))

    def along(self, J: Array, v: Array) -> Array:
        """v without what opens the loops."""
        for _ in range(2):
            v = v - J.T @ np.linalg.solve(J @ J.T + EPS * np.eye(len(J)), J @ v)
        return v

    def start(self, state: Array, rng: np.random.Generator, steps: int = 6) -> Array:
        """A random closed state some steps away."""
        for _ in range(steps):
            way = self.along(self.constraints(state)[1], rng.normal(size=self.size))
            there, left = self.closed(self.moved(state, 0.4 * rng.uniform(0.2, 1) * way / np.abs(way).max()))
            if left < CLOSED and self.sighted(there):
                state = there
        return state

    def descend(self, state: Array, steps: int = 300) -> Array:
        """Gradient descent with the step lengths of Barzilai and Borwein."""
        last: tuple[Array, Array] | None = None
        value = self.error(state)[0]
        for _ in range(steps):
            slope = self.along(self.constraints(state)[1], self.error(state)[1])
            if np.linalg.norm(slope) < 1e-5:
                break
            length = 1.0
            if last is not None:
                change = slope - last[1]
                length = abs(float(last[0] @ last[0]) / float(last[0] @ change or 1.0))
            step = -length * slope
            step *= min(1.0, 0.2 / np.abs(step).max())
            for _ in range(12):
                there, left = self.closed(self.moved(state, step))
                lower = self.error(there)[0] < value + 1e-3 * abs(value) * (last is not None)
                if left < CLOSED and self.sighted(there) and lower:
                    break
                step = step / 3
            else:
                break
            last, value, state = (step, slope), self.error(there)[0], there
        return state

    def newton(self, state: Array, steps: int = 40) -> tuple[Array, float]:
        """Newton's method for ∇E + Jᵀ μ = 0 along the kernel of J, the derivative by differences, closed again after
        each step; motions along which nothing changes are left alone."""
        left = np.inf
        for number in range(steps):
            state, open_ = self.closed(state, 20)
            (_, J), g = self.constraints(state), self.error(state)[1]
            U, values, right = np.linalg.svd(J)
            rank = int(np.sum(values > LOST * values.max(initial=1.0)))
            Z = right[rank:].T
            mu = -U[:, :rank] @ ((right[:rank] @ g) / values[:rank])
            left = max(float(np.linalg.norm(Z.T @ g)), open_)
            if left < FOUND or not np.isfinite(left) or number == steps - 1:
                break
            H = np.empty((Z.shape[1],) * 2)
            for k, way in enumerate(1e-6 * Z.T):
                ends = [self.moved(state, sign * way) for sign in (1, -1)]
                pulls = [self.error(end)[1] + self.constraints(end)[1].T @ mu for end in ends]
                H[:, k] = Z.T @ (pulls[0] - pulls[1]) / 2e-6
            values, V = np.linalg.eigh((H + H.T) / 2)
            kept = np.abs(values) > FLAT * np.abs(values).max(initial=1.0)
            way = -Z @ (V[:, kept] @ ((V[:, kept].T @ (Z.T @ g)) / values[kept]))
            state = self.moved(state, min(1.0, 0.3 / max(np.abs(way).max(), 1e-300)) * way)
        return state, left

    def manner(self, state: Array, rng: np.random.Generator) -> tuple[int, int, int]:
        """Mobility, and the ranks of the platform's twist and of its turn, at a closed state nearby."""
        state = self.start(state, rng, 2)
        _, J = self.constraints(state)
        _, values, right = np.linalg.svd(J)
        kernel = right[int(np.sum(values > 1e-7)) :].T
        place = self.place[self.oracle.index[self.oracle.mechanism.platform]]
        twist = kernel[place : place + 6]
        return kernel.shape[1], int(np.linalg.matrix_rank(twist, 1e-6)), int(np.linalg.matrix_rank(twist[3:], 1e-6))

    def flat(self, state: Array, rng: np.random.Generator) -> bool:
        """Whether rests lie beside it: Newton's method from nearby ends elsewhere, as near."""
        there, left = self.newton(self.start_near(state, rng))
        apart = np.abs(self.told(there) - self.told(state)).max()
        return bool(left < 1e-7 and 1e-6 < apart < 0.05)

    def start_near(self, state: Array, rng: np.random.Generator) -> Array:
        way = self.along(self.constraints(state)[1], rng.normal(size=self.size))
        return self.closed(self.moved(state, 0.01 * way / np.abs(way).max()))[0]

    def told(self, state: Array) -> Array:
        """What a rest is known by: the platform's pose and the directions."""
        X = state[self.oracle.index[self.oracle.mechanism.platform]]
        return np.concatenate(
            [X[:3, 3] / self.oracle.length, X[:3, :3].ravel(), *(state[link, :3, :3] @ d for link, d, _ in self.seen)]
        )


def counted(found: Equilibria, starts: int, seed: int = 1) -> Counted:
    """So many starts, each led by gradient descent and by Newton's method, and what of their ends is in the list."""
    scene, rng = Descent(found), np.random.default_rng(seed)
    home = scene.oracle.zero()
    usual = scene.manner(home, rng)
    members = np.array(
        [scene.told(np.array([each.configuration.pose(link) for link in scene.oracle.index])) for each in found.points]
    )
    result, state, known = Counted(starts), home, {}
    for number in range(starts):
        state = scene.start(home if number % 20 == 0 else state, rng)
        for method, end in (("descent", scene.descend(state)), ("newton", state)):
            end, left = scene.newton(end)
            if left >= 1e-7 or not scene.sighted(end):
                result.ends[method, "no rest"] += 1
                continue
            told = scene.told(end)
            apart = np.abs(members - told).max(axis=1)
            if apart.min() < SAME:
                result.ends[method, "member"] += 1
                result.met.add(int(apart.argmin()))
                continue
            key = tuple(np.round(told, 3) + 0.0)
            if key not in known:
                known[key] = (
                    "another mode"
                    if scene.manner(end, rng) != usual
                    else "not isolated"
                    if scene.flat(end, rng)
                    else "stranger"
                )
            result.ends[method, known[key]] += 1
            if known[key] == "stranger":
                X = end[scene.oracle.index[scene.oracle.mechanism.platform]]
                result.strangers.append(f"{method}: E = {scene.error(end)[0]:.6g} at {X[:3, 3].round(5)}, {left:.1e}")
    return result


def main() -> None:
    for name in sys.argv[2:]:
        robot, _, legs = name.partition(":")
        began = time.time()
        found = equilibria(robot, legs or None, goal=GOALS[robot])
        listed = time.time()
        result = counted(found, int(sys.argv[1]))
        print(
            name,
            f"listed {len(found.points)} ({len(found.stable)} stable) in {listed - began:.0f} s; "
            f"{result.starts} starts in {time.time() - listed:.0f} s:",
            dict(result.ends),
            f"met {len(result.met)} of the list; strangers: {len(result.strangers)}",
            flush=True,
        )
        for each in sorted(set(result.strangers))[:20]:
            print("   ", each)


if __name__ == "__main__":
    main()
