"""How many random starts inside what is certified end at the goal, and what part of the goal's basin that is, for the
table in studies/equilibria/README.md: PYTHONPATH=src:tests python -m simulation.equilibria.inside quattro:1,4 delta: …

Runs are followed abreast; the basin is that of starts drawn in all that the legs reach, in the goal's working mode.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.so3 import convert_rotations_to_vectors
from hrsynth.simulation.equilibria.attraction_radius import prove_attraction_radius
from hrsynth.simulation.equilibria.batched_runs import BatchedRuns
from hrsynth.simulation.equilibria.flow import Flow
from hrsynth.simulation.run import RUN_ESCAPE_DISTANCE_MAX, SERVED_AT
from hrsynth.simulation.servo import ServoTask

PART = 5_000


class Inside:
    """Starts about a goal, the zero configuration, with some legs watched."""

    def __init__(self, name: str, legs: str | None) -> None:
        self.setting = ObservedRobot.of(name, legs)
        self.goal = self.setting.all_samples.start
        self.found = prove_attraction_radius(self.setting, self.goal)
        task = ServoTask.between(self.setting, self.goal, self.goal)
        assert self.setting.placer is not None
        self.flow = Flow(self.setting.placer, tuple(self.setting.labels), task.directions)
        self.shifts = self.flow.batch.coordinates.translations.shape[1]
        self.turns = self.flow.batch.coordinates.rotations.shape[1]
        self.rng = np.random.default_rng(0)

    def ball(self, count: int, n: int, radius: float) -> np.ndarray:
        v = self.rng.normal(size=(count, n))
        return v / np.linalg.norm(v, axis=1)[:, None] * radius * self.rng.uniform(size=(count, 1)) ** (1 / max(n, 1))

    def within(self, count: int, radius: float) -> np.ndarray:
        """Poses whose shift (characteristic lengths) and turn are at most a radius, evenly."""
        y = np.concatenate([self.ball(count, self.shifts, radius), self.ball(count, self.turns, radius)], axis=1)
        return self.flow.move(np.repeat(self.flow.batch.home[None], count, axis=0), y)

    def reached(self, count: int) -> tuple[np.ndarray, float]:
        """Poses evenly in what the legs reach, and its volume (characteristic lengths, radians)."""
        wide, met, tried = self.span(), [], 0
        while sum(map(len, met)) < count:
            y = self.rng.uniform(wide[0], wide[1], (20_000, len(wide[0])))
            X = self.flow.move(np.repeat(self.flow.batch.home[None], len(y), axis=0), y)
            there = self.flow.batch.reaches(X)
            met.append(X[there])
            tried += len(y)
            if tried > 4_000_000:
                break
        X = np.concatenate(met)
        volume = np.prod(wide[1] - wide[0]) * len(X) / tried
        return X[:count], float(volume)

    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """A box that holds all poses that random ones show to be reached, some wider."""
        d = self.shifts + self.turns
        low, high = np.full(d, -3.0), np.full(d, 3.0)
        low[self.shifts :], high[self.shifts :] = -np.pi, np.pi
        for _ in range(3):
            y = self.rng.uniform(low, high, (200_000, d))
            home = np.repeat(self.flow.batch.home[None], len(y), axis=0)
            there = y[self.flow.batch.reaches(self.flow.move(home, y))]
            gap = 0.1 * (there.max(axis=0) - there.min(axis=0))
            low, high = np.maximum(low, there.min(axis=0) - gap), np.minimum(high, there.max(axis=0) + gap)
        return low, high

    def ending_there(self, X: np.ndarray) -> int:
        """How many of the starts end at the goal."""
        count, length = 0, self.flow.batch.length
        for k in range(0, len(X), PART):
            runs = BatchedRuns(self.flow, X[k : k + PART], RUN_ESCAPE_DISTANCE_MAX * length).run(60.0)
            home = self.flow.batch.home
            gap = np.linalg.norm(runs.X[:, :3, 3] - home[:3, 3], axis=1) / length
            gap += np.linalg.norm(convert_rotations_to_vectors(runs.X[:, :3, :3] @ home[:3, :3].T), axis=1)
            count += int(np.sum((runs.stopped == SERVED_AT) & (gap < 1e-5)))
        return count

    def weakest(self, X: np.ndarray) -> float:
        """The smallest singular value of what the law inverts at poses; it is damped below 0.001."""
        none = np.zeros((len(X), len(self.flow.legs)), dtype=bool)
        return float(self.flow.at(X, none, none, self.flow.roots(X, none)[0]).weakest.min())

    def volume(self, radius: float) -> float:
        """Of all poses within a radius, as ``reached`` counts it."""
        ball = {0: 1.0, 1: 2.0, 2: np.pi, 3: 4 * np.pi / 3}
        return ball[self.shifts] * ball[self.turns] * radius ** (self.shifts + self.turns)


def main(cases: list[str]) -> None:
    """A line of the table for each robot."""
    for case in cases:
        name, _, legs = case.partition(":")
        began = time.process_time()
        inside = Inside(name, legs or None)
        found, length = inside.found, inside.flow.batch.length
        said = []
        whole, room = inside.reached(2_000)
        basin = room * inside.ending_there(whole) / len(whole)
        for radius in (found.length / length, found.undamped):
            X = inside.within(10_000, radius)
            said.append(
                f"{inside.ending_there(X)} of {len(X)} within {1e3 * length * radius:.3g} mm, "
                f"{np.degrees(radius) if inside.turns else 0:.2g}°, "
                f"smallest value {inside.weakest(X[:1000]):.2g}, share {inside.volume(radius) / basin:.2g}"
            )
        print(f"{case}: {'; '.join(said)}; {time.process_time() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
