"""Seeded measurement errors: of directions inside a cone about each true one (MMT A.1); of other kinds as their classes
define; independent from image to image, or constant along a run (a bias, as of an uncorrected lens distortion)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array
from ..mechanism.noise import Noise, count_vectors
from ..mechanism.observation import Observation
from ..results import Value

NOISE_PERIOD_S = 0.04
"""Seconds between two independent errors (25 images per second); in between they change linearly."""


@dataclass(frozen=True, eq=False, repr=False)
class NoiseSamples(Value):
    """Random vectors in the unit ball, ``table`` (samples, k, 3), one of them each ``NOISE_PERIOD_S``, linear in
    between, the last one from then on."""

    table: Array

    @classmethod
    def draw(cls, count: int, horizon: float, seed: int, bias: bool = False) -> NoiseSamples:
        """Draw samples of ``count`` quantities until ``horizon`` (s), uniform in the ball; one each for a bias."""
        rng = np.random.default_rng(seed)
        shape = (1 if bias else math.ceil(horizon / NOISE_PERIOD_S) + 2, count)
        vectors = rng.normal(size=(*shape, 3))
        return cls(vectors / np.linalg.norm(vectors, axis=2, keepdims=True) * rng.uniform(size=(*shape, 1)) ** (1 / 3))

    def at(self, time: float) -> Array:
        """The vectors (k, 3) at a time."""
        place = min(max(time / NOISE_PERIOD_S, 0.0), len(self.table) - 1.0)
        first = int(place)
        part, after = place - first, min(first + 1, len(self.table) - 1)
        return np.asarray((1 - part) * self.table[first] + part * self.table[after])


@dataclass(frozen=True, eq=False, repr=False)
class Sensors(Value):
    """Simulated sensors of some observations, each with the noise that its kind has; ``length`` (m) is the unit of
    the values' lengths."""

    observations: tuple[Observation, ...]
    amounts: Mapping[str, float]
    shocks: NoiseSamples
    length: float

    @classmethod
    def of(cls, observations: Sequence[Observation], noise: Noise, horizon: float, seed: int, length: float) -> Sensors:
        """Build the sensors for a seed, until ``horizon`` (s); raises ``BadRequest`` for noise that none of them has,
        and for pixels of a camera without a focal length."""
        amounts = noise.amounts_for(observations)
        count = sum(count_vectors(each) for each in observations)
        return cls(tuple(observations), amounts, NoiseSamples.draw(count, horizon, seed, noise.bias), length)

    def __call__(self, time: float, poses: Callable[[str], Array], values: Sequence[Array] | Array) -> list[Array]:
        """Return the measurements of true values."""
        shocks, first, found = self.shocks.at(time), 0, []
        for each, value in zip(self.observations, values, strict=True):
            own = shocks[first : first + count_vectors(each)]
            first += len(own)
            unit = self.length ** np.broadcast_to(each.dimension, each.size)
            noisy = each.found_by & self.amounts.keys()
            found.append(each.sense(value * unit, own, self.amounts) / unit if noisy else value)
        return found
