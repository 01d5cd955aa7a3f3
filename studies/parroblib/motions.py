"""A symmetric robot as elementary motions: each leg is one product of turns and shifts, from base to platform.

    T_i = Rz(β_i) Tx(r_A) Ty(±d_A/2) C_A Rx(−α) · Π_j [Rz(β) Tz(b) Rx(α) Tx(a) Rz(θ) Tz(d)] · C_E ·
          Rz(−φ₃) Ry(−φ₂) Rx(−φ₁) · C_B⁻¹ Ty(∓d_B/2) Tx(−r_B) Rz(−β_i)

with leg i of n at β_i = 2π (i − 1)/n, or in three pairs. The robot is closed where all T_i are one pose of the
platform. Each factor is a constant turn, a joint (one of its own in each leg) or a dimension (the same in all legs):
so the rate of the pose with any of them is one screw.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hrsynth.geometry.vectors import Array

from .tables import BASE_PAIRS, PLATFORM_PAIRS, PublishedRobot

RX, RY, RZ, TX, TY, TZ, TURN = range(7)
"""Kinds of factors: about and along x, y, z; a constant turn of each leg."""
PLANAR = 3
"""Joints of a leg up to which the turn of its end belongs to the coupling; of longer legs the coupling's frame is that
of the last joint: so their own figures say."""
PARALLEL = "p"
SQUARE = "o"
"""What a letter says of a free angle: 0, a right angle; any other leaves it free."""


@dataclass(frozen=True)
class LegFactor:
    """One factor: its kind; a constant (n,) or for turns (n, 3, 3), one a leg; the dimension that is added, with its
    sign in each leg (n,); whether it is a joint."""

    kind: int
    constant: Array
    dimension: str | None = None
    signs: Array | None = None
    joint: int | None = None


def turn(kind: int, angle: float) -> Array:
    """The turn (3, 3) about x, y or z."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[kind]
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


def euler(x: float, y: float, z: float) -> Array:
    """Rx(x) Ry(y) Rz(z)."""
    return turn(RX, x) @ turn(RY, y) @ turn(RZ, z)


def places(legs: int, pairs: bool) -> list[tuple[float, float]]:
    """The angle of each leg, and on which side of its pair it is (0: none)."""
    if not pairs:
        return [(2 * math.pi * i / legs, 0.0) for i in range(legs)]
    return [(2 * math.pi * (i // 2) / 3, float((-1) ** (i + 1))) for i in range(legs)]


def base_turn(method: int, beta: float) -> Array:
    """Base coupling: the frame of the first joint, but for the cone's inclination."""
    q = math.pi / 2
    return {
        1: euler(0, 0, q + beta),
        2: euler(-q, -beta, -q),
        3: euler(-q, -q - beta, 0),
        4: euler(0, 0, q + beta),
        9: euler(q, 0, q),
        10: np.eye(3),
    }[method if method not in BASE_PAIRS else method - 4]


def platform_turn(method: int, beta: float, base: Array) -> Array:
    """Platform coupling: the frame of the leg's end, but for free angles; 7 keeps that of the leg's base."""
    q = math.pi / 2
    if method == 7:
        return base
    return {
        1: euler(0, 0, q + beta),
        2: euler(-q, -beta, -q),
        3: euler(-q, -q - beta, 0),
        8: turn(RY, q),
        9: euler(-q, -q - beta, 0),
        10: turn(RX, -q) @ turn(RY, -beta) @ turn(RZ, -q),
    }[method if method not in PLATFORM_PAIRS else method - 3]


def free_angles(robot: PublishedRobot, letters: str) -> dict[str, float]:
    """The free angles of the chain that are held, by what is said of them."""
    return {
        name: math.pi / 2 if letter == SQUARE else 0.0
        for name, letter in zip(robot.chain.angles, letters, strict=False)
        if letter in (PARALLEL, SQUARE)
    }


def factors(robot: PublishedRobot, letters: str = "") -> list[LegFactor]:
    """The factors of a robot's legs; ``letters`` say which free angles are held (p, o)."""
    n = robot.legs
    held = free_angles(robot, letters)
    base, platform = places(n, robot.base in BASE_PAIRS), places(n, robot.platform in PLATFORM_PAIRS)
    bases = [base_turn(robot.base, beta) for beta, _ in base]
    ends = [platform_turn(robot.platform, beta, A) for (beta, _), A in zip(platform, bases, strict=True)]
    zero, ones = np.zeros(n), np.ones(n)
    cone = "cone" if robot.base in (4, 8) else None
    found = [
        _turn(turn(RZ, beta) for beta, _ in base),
        LegFactor(TX, zero, "r_A", ones),
        LegFactor(TY, zero, "d_A" if robot.base in BASE_PAIRS else None, np.array([side for _, side in base])),
        _turn(turn(RZ, -beta) @ A for (beta, _), A in zip(base, bases, strict=True)),
        LegFactor(RX, zero, cone, -ones),
    ]
    for i, joint in enumerate(robot.chain.joints):
        own = 4 if joint.kind == "R" else 5
        for k, (kind, value) in enumerate(zip((RZ, TZ, RX, TX, RZ, TZ), joint.cells, strict=True)):
            if k == own:
                found.append(LegFactor(kind, zero, joint=i))
            elif isinstance(value, str) and value not in held:
                found.append(LegFactor(kind, zero, value, ones))
            else:
                found.append(LegFactor(kind, np.full(n, held[value] if isinstance(value, str) else value)))
    found.append(_turn([euler(*(robot.chain.end if len(robot.chain.joints) <= PLANAR else (0.0, 0.0, 0.0)))] * n))
    found += [
        LegFactor(kind, zero, name, -ones)
        for kind, name in zip((RZ, RY, RX), PLATFORM_ANGLES.get(robot.platform, (None,) * 3), strict=True)
    ]
    pairs = "d_B" if robot.platform in PLATFORM_PAIRS else None
    return [
        *found,
        LegFactor(RX, zero, cone if robot.platform == 7 else None, ones),
        _turn((turn(RZ, -beta) @ B).T for (beta, _), B in zip(platform, ends, strict=True)),
        LegFactor(TY, zero, pairs, -np.array([side for _, side in platform])),
        LegFactor(TX, zero, "r_B", -ones),
        _turn(turn(RZ, -beta) for beta, _ in platform),
    ]


def _turn(turns: Iterable[Array]) -> LegFactor:
    return LegFactor(TURN, np.stack(list(turns)))


PLATFORM_ANGLES = {
    7: ("phi_3", "phi_2", "phi_1"),
    8: (None, None, "psi"),
    9: (None, None, "phi"),
    10: (None, "phi", None),
}
"""The free angles of a platform coupling, about z, y, x."""


def dimensions(parts: Sequence[LegFactor]) -> list[str]:
    """The names of the dimensions, in order."""
    return list(dict.fromkeys(part.dimension for part in parts if part.dimension is not None))
