"""Coordinates of the platform's pose that a leg has at its limit, where the pose alone is none.

Where a rod of constant length lies at right angles to the way of its crank's or its slider's end (Type 1), the leg's
two working modes meet: the error is not smooth in the pose, but it is in the joints. Coordinates are half the tangent
of the crank's turn (or the slider's way) and γ, the Cayley vector of the rod's turn, in the place of the shifts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...closed_forms.legs import Number, OnCrank, OnRail, OnRod
from ...geometry.components import Components, cayley, cross, dot, plus, scaled, spin
from ...geometry.vectors import Array
from ...results import Value
from ...tolerances import FOLLOWED


@dataclass(frozen=True, eq=False, repr=False)
class LegChart(Value):
    """Coordinates x (k,) of a limb: its crank's or slider's end is turned or shifted along ``axis`` from ``spoke``,
    seen from ``centre``; its rod is turned about ``ways`` (3, k − 1) from ``rod``."""

    limb: int
    centre: Array
    axis: Array
    spoke: Array
    rod: Array
    ways: Array
    turns: bool

    def start(self, x: Components, number: Number) -> Components:
        """From the centre to the rod's start."""
        spoke, axis = number(self.spoke), number(self.axis)
        return cayley(scaled(x[0], axis), spoke) if self.turns else plus(spoke, scaled(x[0], axis))

    def along(self, x: Components, number: Number) -> Components:
        """From the rod's start to its tip."""
        return cayley(combination(x[1:], self.ways, number), number(self.rod))

    def tip(self, x: Components, number: Number) -> Components:
        """The limb's tip."""
        return plus(number(self.centre), plus(self.start(x, number), self.along(x, number)))

    def rates(self, x: Components, rates: Components, number: Number) -> tuple[Components, Components]:
        """Velocity of the tip and angular velocity of the rod along rates of the coordinates."""
        axis = number(self.axis)
        moved = scaled(rates[0], axis)
        if self.turns:
            moved = cross(scaled(2.0 / (x[0] * x[0] * dot(axis, axis) + 1.0), moved), self.start(x, number))
        turn = spin(combination(x[1:], self.ways, number), combination(rates[1:], self.ways, number),
                    self.ways.shape[1] == 1)
        return plus(moved, cross(turn, self.along(x, number))), turn

    def mode(self, x: Sequence[float]) -> float:
        """The limb's working mode."""
        start = np.array(self.start(x, _plain), dtype=float)
        slip = np.cross(self.axis, start) if self.turns else self.axis
        return -1.0 if float(slip @ np.array(self.along(x, _plain), dtype=float)) > 0 else 1.0


def leg_charts(number: int, limb: OnRod, shifts: Array, carried: Array, tip: Array, room: float
               ) -> Iterator[tuple[LegChart, Array]]:
    """Charts (with half the edges of a box about 0 of each) that together hold all that a limb can do where its tip
    moves along ``shifts`` (3, k); ``carried`` and ``tip`` are where its rod starts and ends somewhere, ``room`` how far
    a slider can be from there. None where the limb's axis does not lie as its tip moves."""
    axis, k = limb.axis, shifts.shape[1]
    if k not in (2, 3) or not isinstance(limb, OnCrank | OnRail):
        return
    rod, turning = tip - carried, isinstance(limb, OnCrank)
    if k == 2:
        normal = np.cross(shifts[:, 0], shifts[:, 1])
        if abs(abs(float(axis @ normal)) - (1.0 if turning else 0.0)) > FOLLOWED:
            return
        ways = normal[:, None]
        turned = rod - 2 * (rod - normal * float(normal @ rod))
        rods = [rod, turned]
    else:
        across = np.linalg.svd(rod[None])[2][1:]
        ways, rods = across.T, [rod, -rod]
    spoke = carried - limb.centre
    spokes = [spoke, spoke - 2 * (spoke - axis * float(axis @ spoke))] if turning else [spoke]
    half = np.array([1.0 if turning else room, *np.ones(k - 1)])
    for one, other in product(spokes, rods):
        yield LegChart(number, limb.centre, axis, one, other, ways, turning), half


def combination(x: Components, ways: Array, number: Number) -> Components:
    """Σ x_i w_i of the columns w_i of ``ways``."""
    found: Components = [0.0, 0.0, 0.0]
    for i, (each, way) in enumerate(zip(x, ways.T, strict=True)):
        part = scaled(each, number(way))
        found = plus(found, part) if i else part
    return found


def _plain(value: Any) -> Any:
    return value
