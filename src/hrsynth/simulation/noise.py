"""Errors of measured directions, seeded: inside a cone about each true direction (MMT A.1); from picture to picture,
or the same all along a run (a bias, as of a lens whose distortion is not corrected)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..budgets import WIDEST_NOISE
from ..errors import BadRequest
from ..geometry.vectors import Array
from ..results import Value

PERIOD = 0.04
"""Seconds between two independent errors (25 pictures a second); in between they change linearly."""

EXAMPLE = "0.1deg or 0.002 (radians), with edges a number of pixels such as 0.3px"


@dataclass(frozen=True)
class Noise:
    """How large errors are: the half-angle of a cone (radians) or an error of edges in the picture (pixels); of a
    ``bias`` each error stays the same all along a run."""

    value: float
    pixels: bool = False
    bias: bool = False

    @classmethod
    def parse(cls, text: str) -> Noise:
        """The amount that ``0.1deg``, ``0.002`` or ``0.3px`` says; raises ``BadRequest``."""
        cleaned = text.strip()
        pixels, degrees = cleaned.endswith("px"), cleaned.endswith("deg")
        digits = cleaned.removesuffix("px").removesuffix("deg").strip()
        try:
            value = float(digits)
        except ValueError:
            raise BadRequest("noise: not a number", text, EXAMPLE) from None
        value = math.radians(value) if degrees else value
        if not 0 < value < (WIDEST_NOISE if pixels else math.pi / 2):
            raise BadRequest("noise", text, "more than zero; cones of less than 90deg, edges less than "
                                            f"{WIDEST_NOISE:g}px")
        return cls(value, pixels)

    def __str__(self) -> str:
        return ((f"{self.value:g}px" if self.pixels else f"{math.degrees(self.value):.4g}deg")
                + (", constant over time" if self.bias else ""))


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
class Cones(Value):
    """Measured directions inside cones of the given half-angle (rad) about the true ones."""

    half_angle: float
    shocks: Shocks

    def __call__(self, time: float, poses: Callable[[str], Array], directions: Array) -> Array:
        """The measured directions (k, 3) where the true ones are ``directions`` (k, 3)."""
        shock = self.shocks.at(time)
        across = shock - np.sum(shock * directions, axis=1, keepdims=True) * directions
        tilted = directions + math.tan(self.half_angle) * across
        return np.asarray(tilted / np.linalg.norm(tilted, axis=1, keepdims=True))
