"""The batch in NumPy: components first, poses last, so that every operation runs over all poses at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...mechanism.vectors import Array
from .limb import Kind, Limb

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Poses:
    """Positions (3, n) and rotations (3, 3, n) of a platform."""

    p: Array
    R: Array

    @classmethod
    def of(cls, p: Array, R: Array) -> Poses:
        """From p (n, 3) and R (n, 3, 3)."""
        return cls(np.ascontiguousarray(p.T), np.ascontiguousarray(R.transpose(1, 2, 0)))

    def turned(self, b: Array) -> Array:
        """R b, (3, n)."""
        R = self.R
        return R[:, 0] * b[0] + R[:, 1] * b[1] + R[:, 2] * b[2]


@dataclass(frozen=True, eq=False)
class Rod:
    """A rod at n poses: u (3, n), the tangent of B's path (3, n) (u itself where B rests), 1 / |BC|, R b and whether
    the leg reaches the pose."""

    u: Array
    tangent: Array
    shortness: Array | float
    arm: Array
    reached: Flags


def dot(a: Array, b: Array) -> Array:
    """a·b over the first index."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Array, b: Array) -> Array:
    """a × b over the first index."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def rod(limb: Limb, poses: Poses) -> Rod:
    """The leg's inverse kinematics in closed form."""
    arm = poses.turned(limb.b) if limb.b.any() else np.zeros((3, 1))
    C = poses.p + arm + (limb.c - limb.centre)[:, None]
    if limb.kind is Kind.DISTANCE:
        shortness = 1 / np.sqrt(dot(C, C))
        u = C * (limb.sense * shortness)
        return Rod(u, u, shortness, arm, np.isfinite(shortness))
    a = limb.axis[:, None]
    height = dot(a, C)
    if limb.kind is Kind.LINE:
        inside = limb.rod**2 - dot(C, C) + height * height
        reached = inside > 0
        B = a * (height - limb.side * np.sqrt(np.where(reached, inside, np.nan)))
        tangent = a
    else:
        flat = C - a * height
        square = dot(flat, flat)
        along = (square + (height * height + (limb.radius**2 - limb.rod**2))) * (0.5 / square)
        inside = limb.radius**2 / square - along * along
        reached = inside > 0
        B = flat * along + cross(a, flat) * (limb.side * np.sqrt(np.where(reached, inside, np.nan)))
        tangent = cross(a, B)
    return Rod((C - B) * (limb.sense / limb.rod), tangent, 1 / limb.rod, arm, reached)


def turning(limb: Limb, poses: Poses) -> tuple[Array, Flags, Array]:
    """u (3, n) of a direction that turns with the platform, where the leg reaches, and where its crank ends (3, n)."""
    u = poses.turned(limb.axis)
    C = poses.p + poses.turned(limb.b) + (limb.c - limb.centre)[:, None]
    if not limb.radius:
        return u, np.ones(u.shape[1], dtype=bool), C
    away = dot(C, u)
    inside = limb.radius**2 - dot(C, C) + away * away
    reached = inside > 0
    B = C + u * (limb.side * np.sqrt(np.where(reached, inside, np.nan)) - away)
    return u, reached, B + limb.centre[:, None]


def within(limb: Limb, poses: Poses) -> Flags:
    """Where the leg reaches, (n,)."""
    if limb.kind is Kind.CONSTANT:
        return np.ones(poses.p.shape[1], dtype=bool)
    return turning(limb, poses)[1] if limb.kind is Kind.TURNING else rod(limb, poses).reached


def block(limb: Limb, twists: Array, poses: Poses) -> tuple[Array, Array, Flags]:
    """u (3, n), the leg's rows of Mᵀ (3, d, n) on the basis ``twists`` (6, d), and where the leg reaches."""
    n, d = poses.p.shape[1], twists.shape[1]
    if limb.kind is Kind.CONSTANT:
        return np.broadcast_to(limb.axis[:, None], (3, n)), np.zeros((3, d, n)), np.ones(n, dtype=bool)
    M = np.empty((3, d, n))
    if limb.kind is Kind.TURNING:
        u, reached, _ = turning(limb, poses)
        for j in range(d):
            M[:, j] = cross(twists[3:, j], u)
        return u, M, reached
    found = rod(limb, poses)
    u, t = found.u, found.tangent
    gain = found.shortness * limb.sense
    slip = t * (1 / dot(u, t))
    for j in range(d):
        v, w = twists[:3, j, None], twists[3:, j]
        y = v + cross(w, found.arm) if w.any() and limb.b.any() else v
        M[:, j] = (y - slip * dot(u, y)) * gain
    return u, M, found.reached


def stacked(limbs: Sequence[Limb], twists: Array, poses: Poses) -> tuple[Array, Array, Flags]:
    """Directions (3 k, n), Mᵀ (3 k, d, n), reached (n,) of several legs."""
    parts = [block(limb, twists, poses) for limb in limbs]
    return (np.concatenate([u for u, _, _ in parts]), np.concatenate([M for _, M, _ in parts]),
            np.logical_and.reduce([reached for _, _, reached in parts]))
