"""Errors of what is measured, seeded: of directions inside a cone about each true one (MMT A.1); of other kinds as each
says; from picture to picture, or the same all along a run (a bias, as of a lens whose distortion is not corrected)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..budgets import WIDEST_NOISE
from ..errors import BadRequest
from ..geometry.vectors import Array
from ..mechanism.observation import Observation
from ..mechanism.sights import CameraObservation
from ..results import Value

PERIOD = 0.04
"""Seconds between two independent errors (25 pictures a second); in between they change linearly."""

EXAMPLE = "0.1deg or 0.002 (radians), 0.3px in a picture, 1mm of lengths; several with commas"
UNITS = {"px": ("px", 1.0), "deg": ("rad", math.radians(1)), "mm": ("m", 1e-3), "m": ("m", 1.0), "": ("rad", 1.0)}
"""Endings of amounts, the longer ones first: what they are told in, and how much of it one is."""
MOST = {"px": WIDEST_NOISE, "rad": math.pi / 2, "m": math.inf}


@dataclass(frozen=True)
class Noise:
    """How large errors are, by what they are told in: half-angles of cones (``rad``), errors in the picture (``px``),
    of lengths (``m``); of a ``bias`` each error stays the same all along a run."""

    amounts: tuple[tuple[str, float], ...]
    bias: bool = False

    @classmethod
    def parse(cls, text: str) -> Noise:
        """The amounts that ``0.1deg``, ``0.002``, ``0.3px`` or ``0.3px,1mm`` says; raises ``BadRequest``."""
        found: dict[str, float] = {}
        for word in map(str.strip, text.split(",")):
            ending = next(each for each in UNITS if word.endswith(each))
            unit, one = UNITS[ending]
            try:
                value = float(word.removesuffix(ending)) * one
            except ValueError:
                raise BadRequest("noise: not a number", text, EXAMPLE) from None
            if not 0 < value < MOST[unit] or unit in found:
                raise BadRequest("noise", text, "each unit once, more than zero; cones of less than 90deg, less than "
                                                f"{WIDEST_NOISE:g}px")
            found[unit] = value
        return cls(tuple(found.items()))

    def of(self, unit: str) -> float:
        """The amount in a unit, 0 where none is."""
        return dict(self.amounts).get(unit, 0.0)

    def __str__(self) -> str:
        words = {"px": "{:g}px", "m": "{:g}m"}
        every = [f"{math.degrees(value):.4g}deg" if unit == "rad" else words[unit].format(value)
                 for unit, value in self.amounts]
        return ", ".join(every) + (", constant over time" if self.bias else "")


@dataclass(frozen=True, eq=False, repr=False)
class Shocks(Value):
    """Random vectors in the unit ball, ``table`` (samples, k, 3), one of them each ``PERIOD``, linear in between, the
    last one from then on."""

    table: Array

    @classmethod
    def drawn(cls, count: int, horizon: float, seed: int, bias: bool = False) -> Shocks:
        """Shocks of ``count`` quantities until ``horizon`` (s), uniform in the ball; of a bias only one for each."""
        rng = np.random.default_rng(seed)
        shape = (1 if bias else math.ceil(horizon / PERIOD) + 2, count)
        vectors = rng.normal(size=(*shape, 3))
        return cls(vectors / np.linalg.norm(vectors, axis=2, keepdims=True) * rng.uniform(size=(*shape, 1)) ** (1 / 3))

    def at(self, time: float) -> Array:
        """The vectors (k, 3) at a time."""
        place = min(max(time / PERIOD, 0.0), len(self.table) - 1.0)
        first = int(place)
        part, after = place - first, min(first + 1, len(self.table) - 1)
        return np.asarray((1 - part) * self.table[first] + part * self.table[after])


@dataclass(frozen=True, eq=False, repr=False)
class Sensors(Value):
    """Simulated sensors of some observations, each with the noise that its kind has; ``length`` (m) is the unit of
    the values' lengths."""

    observations: tuple[Observation, ...]
    amounts: Mapping[str, float]
    shocks: Shocks
    length: float

    @classmethod
    def of(cls, observations: Sequence[Observation], noise: Noise, horizon: float, seed: int, length: float) -> Sensors:
        """Of a seed, until ``horizon`` (s); raises ``BadRequest`` for noise that none of them has, and for pixels of a
        camera without a focal length."""
        known = frozenset().union(*(each.found_by for each in observations))
        for unit, _ in noise.amounts:
            if unit not in known:
                raise BadRequest(f"noise of what is observed in {unit}", str(noise), sorted(known))
        amounts = dict(noise.amounts)
        for each in observations:
            if "px" in amounts and "px" in each.found_by and not (
                    isinstance(each, CameraObservation) and each.camera and each.camera.focal):
                raise BadRequest(f"noise in pixels: the focal length of the camera of {each.kind} {each.leg}", "none",
                                 "a camera with one (--camera NAME=LINK@x,y,z/r,p,y/FOCAL)")
        count = sum(_vectors(each) for each in observations)
        return cls(tuple(observations), amounts, Shocks.drawn(count, horizon, seed, noise.bias), length)

    def __call__(self, time: float, poses: Callable[[str], Array], values: Sequence[Array] | Array) -> list[Array]:
        """What is measured where the true values are these."""
        shocks, first, found = self.shocks.at(time), 0, []
        for each, value in zip(self.observations, values, strict=True):
            own = shocks[first : first + _vectors(each)]
            first += len(own)
            unit = self.length ** np.broadcast_to(each.dimension, each.size)
            noisy = each.found_by & self.amounts.keys()
            found.append(each.sensed(value * unit, own, self.amounts) / unit if noisy else value)
        return found


def _vectors(seen: Observation) -> int:
    """How many random vectors an observation's noise takes."""
    return 1 if seen.size <= 3 else 2
