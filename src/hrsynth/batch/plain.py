"""The batch in NumPy: components first, poses last, so that every operation runs over all poses at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array
from .limb import Kind, Limb

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Poses:
    """Positions (3, n) and rotations (3, 3, n) of a platform; these are laid out only where something turns."""

    p: Array
    rotations: Array
    """(n, 3, 3)."""

    @classmethod
    def of(cls, p: Array, R: Array) -> Poses:
        """From p (n, 3) and R (n, 3, 3)."""
        return cls(np.ascontiguousarray(p.T), R)

    @cached_property
    def R(self) -> Array:
        """Components first."""
        return np.ascontiguousarray(self.rotations.transpose(1, 2, 0))

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


def along(a: Array, b: Array) -> Array:
    """a·b for a constant vector a (3,), of which what vanishes is left out."""
    parts = [b[i] if a[i] == 1 else a[i] * b[i] for i in range(3) if a[i]]
    return np.asarray(sum(parts[1:], start=parts[0]))


def cross(a: Array, b: Array) -> Array:
    """a × b over the first index."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def _tip(limb: Limb, poses: Poses) -> tuple[Array, Array]:
    """The leg's tip (3, n), seen from its limb's centre, and R b."""
    C = poses.p + (limb.c - limb.centre)[:, None]
    if not limb.b.any():
        return C, np.zeros((3, 1))
    arm = poses.turned(limb.b)
    C += arm
    return C, arm


def rod(limb: Limb, poses: Poses) -> Rod:
    """The leg's inverse kinematics in closed form."""
    C, arm = _tip(limb, poses)
    if limb.kind is Kind.DISTANCE:
        shortness = 1 / np.sqrt(dot(C, C))
        u = C * (limb.sense * shortness)
        return Rod(u, u, shortness, arm, np.isfinite(shortness))
    a, height = limb.axis[:, None], along(limb.axis, C)
    inside, *found = _inside(limb, C, height)
    reached = inside > 0
    root = limb.side * np.sqrt(inside if reached.all() else np.where(reached, inside, np.nan))
    if limb.kind is Kind.LINE:
        tangent = a
        for i in np.flatnonzero(limb.axis):
            C[i] -= limb.axis[i] * (height - root)
    else:
        flat, share = found
        B = flat * share + cross(a, flat) * root
        tangent = cross(a, B)
        C -= B
    C *= limb.sense / limb.rod
    return Rod(C, tangent, 1 / limb.rod, arm, reached)


def _inside(limb: Limb, C: Array, height: Array) -> tuple[Array, ...]:
    """What is positive where the rod reaches the tip C, seen from the limb's centre, ``height`` along its axis; for a
    circle also C's foot in its plane, and the part of it at which B lies."""
    if limb.kind is Kind.LINE:
        return (limb.rod**2 - dot(C, C) + height * height,)
    flat = C - limb.axis[:, None] * height
    square = dot(flat, flat)
    share = (square + (height * height + (limb.radius**2 - limb.rod**2))) * (0.5 / square)
    return limb.radius**2 / square - share * share, flat, share


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
    if limb.kind is Kind.TURNING:
        return turning(limb, poses)[1]
    C = _tip(limb, poses)[0]
    return np.asarray((dot(C, C) if limb.kind is Kind.DISTANCE else _inside(limb, C, along(limb.axis, C))[0]) > 0)


def block(limb: Limb, twists: Array, poses: Poses, u: Array, M: Array) -> Flags:
    """Fill in u (3, n) and the leg's rows of Mᵀ, M (3, d, n), on the basis ``twists`` (6, d); where the leg reaches."""
    if limb.kind is Kind.CONSTANT:
        u[:], M[:] = limb.axis[:, None], 0.0
        return np.ones(u.shape[1], dtype=bool)
    if limb.kind is Kind.TURNING:
        u[:], reached, _ = turning(limb, poses)
        for j, w in enumerate(twists[3:].T):
            M[:, j] = cross(w, u)
        return reached
    found = rod(limb, poses)
    u[:] = found.u
    gain = found.shortness * limb.sense
    slip = found.tangent * (gain / (along(limb.axis, u) if limb.kind is Kind.LINE else dot(found.tangent, u)))
    for j, (v, w) in enumerate(zip(twists[:3].T, twists[3:].T, strict=True)):
        if w.any() and limb.b.any():
            y = v[:, None] + cross(w, found.arm)
            M[:, j] = y * gain - slip * dot(u, y)
            continue
        if not v.any():
            M[:, j] = 0.0
            continue
        push = along(v, u)
        for i in range(3):
            if limb.kind is Kind.LINE and not limb.axis[i]:
                M[i, j] = v[i] * gain
            else:
                np.multiply(slip[i], -push, out=M[i, j])
                if v[i]:
                    M[i, j] += v[i] * gain
    return found.reached
