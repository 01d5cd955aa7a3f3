"""Rests of a loop counted again: gradient descent and Newton's method in the oracle's maximal coordinates.

E = ½ Σ (1 − (u_i · u_di)²) depends on link poses alone; the constraints are the oracle's wrenches. A step is projected
onto the motions that these allow. Nothing is shared with what is under test but the description of the robot.

``python -m simulation.endings.count 1000 3rpr_m1 quattro:1,4`` (from ``tests/``) counts and compares.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.simulation.endings.endings import endings
from hrsynth.simulation.endings.rests import Endings
from oracle import Oracle

EPS = 1e-13
FOUND, CLOSED, SAME = 1e-9, 1e-9, 1e-4


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

    def __init__(self, found: Endings) -> None:
        setting = found.setting
        self.oracle = Oracle(setting.mechanism)
        self.seen = [(self.oracle.index[o.link], o.direction) for o in setting.samples.question.observations
                     if isinstance(o, Direction)]
        self.desired = found.desired
        self.place = {number: 6 * k for k, number in enumerate(self.oracle.moving)}
        self.size = 6 * len(self.place)
        self.scale = np.tile([self.oracle.length] * 3 + [1.0] * 3, len(self.place))

    def constraints(self, state: Array) -> tuple[Array, Array]:
        """Residual and its derivative by the scaled velocities of all links but the base."""
        residual, J = self.oracle.rows.evaluate(state)
        return residual, J[:, self.oracle.moving].reshape(len(residual), -1) * self.scale

    def error(self, state: Array) -> tuple[float, Array]:
        """E and its derivative."""
        value, slope = 0.0, np.zeros(self.size)
        for (link, d), w in zip(self.seen, self.desired, strict=True):
            u = state[link, :3, :3] @ d
            c = u @ w
            value += 0.5 * (1 - c * c)
            slope[self.place[link] + 3 : self.place[link] + 6] -= c * np.cross(u, w)
        return value, slope

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
            if left < CLOSED:
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
                if left < CLOSED and self.error(there)[0] < value + 1e-3 * abs(value) * (last is not None):
                    break
                step = step / 3
            else:
                break
            last, value, state = (step, slope), self.error(there)[0], there
        return state

    def newton(self, state: Array, steps: int = 40) -> tuple[Array, float]:
        """Newton's method on ∇E + Jᵀ μ = 0 beside the loops, the derivative by differences."""
        mu, left = None, np.inf
        for _ in range(steps):
            (r, J), g = self.constraints(state), self.error(state)[1]
            if mu is None or left > 1e-4:
                mu = -np.linalg.solve(J @ J.T + EPS * np.eye(len(r)), J @ g)
            pull = g + J.T @ mu
            left = max(float(np.linalg.norm(pull)), float(np.linalg.norm(r)))
            if left < FOUND:
                break
            H = np.empty((self.size, self.size))
            for k in range(self.size):
                there = self.moved(state, 1e-6 * np.eye(self.size)[k])
                H[:, k] = (self.error(there)[1] + self.constraints(there)[1].T @ mu - pull) / 1e-6
            K = np.block([[H + 1e-10 * np.eye(self.size), J.T], [J, -1e-12 * np.eye(len(r))]])
            step = np.linalg.solve(K, -np.concatenate([pull, r]))
            way = step[: self.size]
            short = min(1.0, 0.3 / np.abs(way).max())
            state, mu = self.moved(state, short * way), mu + short * step[self.size :]
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
        return np.concatenate([X[:3, 3] / self.oracle.length, X[:3, :3].ravel(),
                               *(state[link, :3, :3] @ d for link, d in self.seen)])


def counted(found: Endings, starts: int, seed: int = 1) -> Counted:
    """So many starts, each led by gradient descent and by Newton's method, and what of their ends is in the list."""
    scene, rng = Descent(found), np.random.default_rng(seed)
    home = scene.oracle.zero()
    usual = scene.manner(home, rng)
    members = np.array([scene.told(np.array([each.configuration.pose(link) for link in scene.oracle.index]))
                        for each in found.rests])
    result, state, known = Counted(starts), home, {}
    for number in range(starts):
        state = scene.start(home if number % 20 == 0 else state, rng)
        for method, end in (("descent", scene.descend(state)), ("newton", state)):
            end, left = scene.newton(end)
            if left >= 1e-7:
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
                known[key] = ("another mode" if scene.manner(end, rng) != usual else
                              "not isolated" if scene.flat(end, rng) else "stranger")
            result.ends[method, known[key]] += 1
            if known[key] == "stranger":
                X = end[scene.oracle.index[scene.oracle.mechanism.platform]]
                result.strangers.append(f"{method}: E = {scene.error(end)[0]:.6g} at {X[:3, 3].round(5)}, {left:.1e}")
    return result


def main() -> None:
    for name in sys.argv[2:]:
        robot, _, legs = name.partition(":")
        setting = ObservedRobot.of(robot, legs.split(",") if legs else None)
        at = setting.motion.pose(setting.configurations[3].pose(setting.motion.link))
        began = time.time()
        found = endings(setting, at=str(at))
        listed = time.time()
        result = counted(found, int(sys.argv[1]))
        print(name, f"listed {len(found.rests)} ({len(found.attracting)} stable) in {listed - began:.0f} s; "
              f"{result.starts} starts in {time.time() - listed:.0f} s:", dict(result.ends),
              f"met {len(result.met)} of the list; strangers: {len(result.strangers)}", flush=True)
        for each in sorted(set(result.strangers))[:20]:
            print("   ", each)


if __name__ == "__main__":
    main()
