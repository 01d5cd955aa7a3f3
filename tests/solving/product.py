"""A judge of intervals for tests of the box driver: worker processes import it too."""

from __future__ import annotations

from typing import Any

import numpy as np

from hrsynth.geometry.vectors import Array
from hrsynth.solving.exhaust import SETTLED, Boxes

FINEST = SETTLED - 1


class Product:
    """(x − a)(x − b)… over intervals of x: settled where it has a sign, which is ``proved`` with the interval, given up
    where these are finest."""

    def __init__(self, roots: list[float], finest: float = 2.0**-7) -> None:
        self.roots, self.finest, self.proved = roots, finest, list[Any]()

    def fresh(self) -> Product:
        return Product(self.roots, self.finest)

    def __call__(self, middle: Array, half: Array) -> Boxes:
        x, r = middle[:, 0], half[:, 0]
        low = high = np.ones(len(x))
        for root in self.roots:
            ends = [one * other for one in (low, high) for other in (x - r - root, x + r - root)]
            low, high = np.min(ends, axis=0), np.max(ends, axis=0)
        signed = (low > 0) | (high < 0)
        self.proved += zip(x[signed].tolist(), r[signed].tolist(), (low > 0)[signed].tolist(), strict=True)
        return middle, half, np.where(signed, SETTLED, np.where(r <= self.finest, FINEST, 0))
