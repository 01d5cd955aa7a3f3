"""Modes of planar robots against an independent paving: the turn of the platform in balls, each cut until it holds no
root or, by the sign of the derivative, just one.

Legs are three R each. With its motor fixed a leg keeps one of its centres, on the platform, at a distance from another
one, on the base: p + R(φ) b at a distance r from a. The difference of two such equations is linear in p.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

import hrsynth
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Mechanism
from strategies import planar

LEGS = (0, 1, 2)
"""Motors of a leg: at the base, in the middle, at the platform."""
DEPTH_MAX = 40


class Dual(NamedTuple):
    """A ball and that of its derivative by φ."""

    value: Any
    slope: Any

    def __add__(self, other: Dual) -> Dual:  # type: ignore[override]
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Dual) -> Dual:
        return Dual(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Dual) -> Dual:  # type: ignore[override]
        return Dual(self.value * other.value, self.value * other.slope + self.slope * other.value)


def fix(value: float) -> Dual:
    """A constant."""
    from flint import arb

    return Dual(arb(value), arb(0))


def square(value: float) -> Dual:
    """The square of a constant."""
    return fix(float(value)) * fix(float(value))


def circles(robot: Mechanism, motors: Sequence[int]) -> list[tuple[Array, Array]]:
    """For each leg the centre on the base and that on the platform, in the plane of motion."""
    joints = [[robot.joints[f"joint_{leg}_{k}"] for k in (1, 2, 3)] for leg in (1, 2, 3)]
    normal = joints[0][0].axis
    U = np.linalg.svd(normal[None])[2][1:]
    pairs = []
    for leg, motor in zip(joints, motors, strict=True):
        a, b = (joint.point for k, joint in enumerate(leg) if k != motor)
        pairs.append((U @ a, U @ b))
    return pairs


def last_equation(pairs: Sequence[tuple[Array, Array]], phi: Any) -> Dual:
    """D² times the first equation on a ball of φ, with p from the differences to the others by Cramer's rule."""
    c, s = Dual(phi.cos(), -phi.sin()), Dual(phi.sin(), phi.cos())
    rows = []
    for a, b in pairs:
        x = c * fix(b[0]) - s * fix(b[1]) - fix(a[0])
        y = s * fix(b[0]) + c * fix(b[1]) - fix(a[1])
        rows.append((x, y, x * x + y * y - square(a[0] - b[0]) - square(a[1] - b[1])))
    (x1, y1, k1), (x2, y2, k2), (x3, y3, k3) = rows
    two = fix(2.0)
    A, B, C = two * (x2 - x1), two * (y2 - y1), k1 - k2
    E, F, G = two * (x3 - x1), two * (y3 - y1), k1 - k3
    D, px, py = A * F - B * E, C * F - B * G, A * G - C * E
    return px * px + py * py + two * D * (x1 * px + y1 * py) + D * D * k1


def pave(pairs: Sequence[tuple[Array, Array]]) -> list[float]:
    """Middles of balls with exactly one root each, which together hold all; those of a full turn."""
    from flint import arb

    roots, open_ = [], [(0.1, 0.1 + 2 * np.pi, 0)]
    while open_:
        low, high, depth = open_.pop()
        assert depth < DEPTH_MAX
        ball = arb((low + high) / 2, (high - low) / 2 * (1 + 1e-15) + 1e-300)
        at = last_equation(pairs, ball)
        if not at.value.contains(0):
            continue
        if not at.slope.contains(0):
            first, second = (last_equation(pairs, arb(end)).value for end in (low, high))
            if not first.contains(0) and not second.contains(0):
                if (first > 0) != (second > 0):
                    roots.append((low + high) / 2)
                continue
        middle = low + (high - low) * 0.497
        open_ += [(low, middle, depth + 1), (middle, high, depth + 1)]
    return roots


@pytest.mark.some(4)
@pytest.mark.parametrize("seed", range(12))
def test_a_paving_counts_the_modes_of_planar_robots(seed: int):
    """Robots of random dimensions with random motors: as many modes as turns at which all legs close."""
    rng = np.random.default_rng(seed)
    motors = [int(rng.choice(LEGS)) for _ in range(3)]
    robot = planar(["RRR"] * 3, rng, [{motor} for motor in motors])
    listed = hrsynth.modes(robot, real=True)
    assert listed.found.complete
    assert len(listed.modes) == len(pave(circles(robot, motors))) > 0
