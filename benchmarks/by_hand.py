"""Closed forms of single robots, written by hand in vectorised NumPy, without the package.

Quattro (MMT Appendix B.1) with its articulated platform, two legs observed, one on each half: inverse kinematics of
all four legs, Mᵀ (6 × 4), and the exact maxima of position and orientation error for two cones. The rigid Quattro,
the Gough-Stewart platform, the Orthoglide and the 3-RRR: Mᵀ alone.

Arrays are (poses, …); Mᵀ in SI units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ANGLES = np.array([-3, -1, 1, 3]) * np.pi / 4
L1, L2 = 0.380, 0.825


def arms(C: Array, A: Array, angle: float, l1: float = L1, l2: float = L2) -> tuple[Array, Array]:
    """u (n, 3) and the tangent of the elbow (n, 3) of an arm in the vertical plane at ``angle`` through A."""
    radial, across = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    D = C - A
    x, y, z = D @ radial, D @ across, D[:, 2]
    square = x * x + z * z
    along = (square + y * y + l1 * l1 - l2 * l2) / (2 * square)
    beside = np.sqrt(l1 * l1 / square - along * along)
    bx, bz = x * along - z * beside, z * along + x * beside
    B = bx[:, None] * radial + bz[:, None] * np.array([0.0, 0.0, 1.0])
    tangent = bx[:, None] * np.array([0.0, 0.0, 1.0]) - bz[:, None] * radial
    return (D - B) / l2, tangent


def rates(u: Array, tangent: Array, length: float) -> Array:
    """M_i (n, 3, 3) of u̇ = M_i v_C for a rod whose other end moves along ``tangent``."""
    v = tangent / np.einsum("ni,ni->n", u, tangent)[:, None]
    return (np.eye(3) - np.einsum("ni,nj->nij", v, u)) / length


def quattro_tips(x: Array, y: Array, z: Array, phi: Array) -> tuple[list[Array], Array]:
    """C_1 … C_4 (n, 3), and D1 − P (n, 3)."""
    P = np.stack([x, y, z], axis=1)
    half = 0.043 * np.stack([np.sin(phi), -np.cos(phi), np.zeros_like(phi)], axis=1)
    offsets = np.array([[-0.066, -0.048, 0], [0.066, -0.048, 0], [0.066, 0.048, 0], [-0.066, 0.048, 0]])
    return [P + (half if i < 2 else -half) + offsets[i] for i in range(4)], half


def quattro(x: Array, y: Array, z: Array, phi: Array, legs: tuple[int, int]) -> Array:
    """Mᵀ (n, 6, 4) of the 4-dof Quattro for (vx, vy, vz, φ̇); legs from 0, one below and one above 2."""
    tips, half = quattro_tips(x, y, z, phi)
    M = np.empty((len(x), 6, 4))
    for i in range(4):
        A = 0.275 * np.array([np.cos(ANGLES[i]), np.sin(ANGLES[i]), 0.0])
        u, tangent = arms(tips[i], A, ANGLES[i])
        if i in legs:
            rows = slice(3 * legs.index(i), 3 * legs.index(i) + 3)
            arm = half if i < 2 else -half
            turned = np.stack([-arm[:, 1], arm[:, 0], np.zeros(len(arm))], axis=1)
            N = rates(u, tangent, L2)
            M[:, rows, :3] = N
            M[:, rows, 3] = np.einsum("nij,nj->ni", N, turned)
    return M


def maxima(M: Array, cone: float) -> tuple[Array, Array]:
    """The exact maxima (n,) of the position (m) and the orientation error (rad) for two cones: the position's by its
    dual, min over t of λmax(B₁ / t + B₂ / (1 − t)), whose slope changes its sign at the minimum."""
    J = np.linalg.solve(M.transpose(0, 2, 1) @ M, M.transpose(0, 2, 1))
    turn = J[:, 3].reshape(-1, 2, 3)
    orientation = cone * np.linalg.norm(turn, axis=2).sum(axis=1)
    A1, A2 = J[:, :3, :3], J[:, :3, 3:]
    return cone * largest(A1 @ A1.transpose(0, 2, 1), A2 @ A2.transpose(0, 2, 1)), orientation


def maxima_tuned(M: Array, cone: float) -> tuple[Array, Array]:
    """Tuned version of :func:`largest`: Gram and Schmidt, and eigenvalues in closed form, components first."""
    Q, R = np.ascontiguousarray(M.transpose(1, 2, 0)), np.zeros((4, 4, len(M)))
    for j in range(4):
        R[j, j] = np.sqrt(np.einsum("rn,rn->n", Q[:, j], Q[:, j]))
        Q[:, j] /= R[j, j]
        for i in range(j + 1, 4):
            R[j, i] = np.einsum("rn,rn->n", Q[:, j], Q[:, i])
            Q[:, i] -= R[j, i] * Q[:, j]
    turn = Q[:, 3] / R[3, 3]
    orientation = cone * (np.sqrt(np.sum(turn[:3] ** 2, axis=0)) + np.sqrt(np.sum(turn[3:] ** 2, axis=0)))
    J = np.empty((3, 6, len(M)))
    J[2] = (Q[:, 2] - R[2, 3] * turn) / R[2, 2]
    J[1] = (Q[:, 1] - R[1, 2] * J[2] - R[1, 3] * turn) / R[1, 1]
    J[0] = (Q[:, 0] - R[0, 1] * J[1] - R[0, 2] * J[2] - R[0, 3] * turn) / R[0, 0]
    B, C = (
        np.array(
            [np.einsum("rn,rn->n", J[a, rows], J[b, rows]) for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        )
        for rows in (slice(3), slice(3, 6))
    )
    return cone * two_cones(B, C), orientation


def two_cones(B: Array, C: Array) -> Array:
    """As :func:`largest`, for entries xx, yy, zz, xy, xz, yz (6, n)."""
    value, live = np.full(B.shape[1], np.inf), np.arange(B.shape[1])
    a, b = np.sqrt(B[0] + B[1] + B[2]), np.sqrt(C[0] + C[1] + C[2])
    t, low, high, below, above = a / (a + b), np.zeros_like(a), np.ones_like(a), a, -b
    for step in range(60):
        S = B / t + C / (1 - t)
        mean = (S[0] + S[1] + S[2]) / 3
        x, y, z, f, g, h = S[0] - mean, S[1] - mean, S[2] - mean, S[3], S[4], S[5]
        spread = np.sqrt((x * x + y * y + z * z + 2 * (f * f + g * g + h * h)) / 6)
        third = (x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)) / (2 * spread**3)
        size = 2 * spread * np.cos(np.arccos(np.clip(third, -1, 1)) / 3)
        x, y, z = x - size, y - size, z - size
        xy, xz, yz = g * h - f * z, f * h - g * y, f * g - h * x
        columns = np.array([[y * z - h * h, xy, xz], [xy, x * z - g * g, yz], [xz, yz, x * y - f * f]])
        best = np.argmax(np.abs(np.array([columns[0, 0], columns[1, 1], columns[2, 2]])), axis=0)
        x, y, z = np.take_along_axis(columns, best[None, None], axis=0)[0]
        scale = 1 / (x * x + y * y + z * z)
        a, b = (
            np.sqrt(
                scale * (G[0] * x * x + G[1] * y * y + G[2] * z * z + 2 * (G[3] * x * y + G[4] * x * z + G[5] * y * z))
            )
            for G in (B, C)
        )
        value[live] = np.minimum(value[live], np.sqrt(mean + size))
        off = a * (1 - t) - b * t
        up = off > 0
        low, high = np.where(up, t, low), np.where(up, high, t)
        below, above = np.where(up, off, below / 2), np.where(up, above / 2, off)
        more = (off * off > 1e-14 * t * (1 - t) * (a + b) ** 2) & (high - low > 1e-15)
        if not more.any():
            break
        fixed = a / (a + b)
        t = np.where(
            (fixed > low) & (fixed < high) & (step % 3 == 0), fixed, low + (high - low) * below / (below - above)
        )
        live, B, C, t = live[more], B[:, more], C[:, more], t[more]
        low, high, below, above = low[more], high[more], below[more], above[more]
    return value


def largest(B: Array, C: Array) -> Array:
    """The maximum over unit w of √(wᵀBw) + √(wᵀCw), (n,): the fixed point t = a / (a + b), kept in a bracket, poses
    that are done left out."""
    value = np.full(len(B), np.inf)
    live = np.arange(len(B))
    a, b = np.sqrt(np.trace(B, axis1=1, axis2=2)), np.sqrt(np.trace(C, axis1=1, axis2=2))
    t = a / (a + b)
    low, high, below, above = np.zeros(len(B)), np.ones(len(B)), a, -b
    for step in range(60):
        values, vectors = np.linalg.eigh(B / t[:, None, None] + C / (1 - t)[:, None, None])
        w = vectors[:, :, -1]
        a = np.sqrt(np.einsum("ni,nij,nj->n", w, B, w))
        b = np.sqrt(np.einsum("ni,nij,nj->n", w, C, w))
        value[live] = np.minimum(value[live], np.sqrt(values[:, -1]))
        off = a * (1 - t) - b * t
        up = off > 0
        low, high = np.where(up, t, low), np.where(up, high, t)
        below, above = np.where(up, off, below / 2), np.where(up, above / 2, off)
        more = (off * off > 1e-14 * t * (1 - t) * (a + b) ** 2) & (high - low > 1e-15)
        if not more.any():
            break
        fixed = a / (a + b)
        t = np.where(
            (fixed > low) & (fixed < high) & (step % 3 == 0), fixed, low + (high - low) * below / (below - above)
        )
        live, B, C, t = live[more], B[more], C[more], t[more]
        low, high, below, above = low[more], high[more], below[more], above[more]
    return value


def quattro_rigid(x: Array, y: Array, z: Array, legs: tuple[int, int]) -> Array:
    """Mᵀ (n, 6, 3) of the rigid Quattro (IROS IV-A); all four legs are solved."""
    P = np.stack([x, y, z], axis=1)
    M = np.empty((len(x), 6, 3))
    for i in range(4):
        radial = np.array([np.cos(ANGLES[i]), np.sin(ANGLES[i]), 0.0])
        u, tangent = arms(P + 0.102 * radial, 0.296 * radial, ANGLES[i])
        if i in legs:
            rows = slice(3 * legs.index(i), 3 * legs.index(i) + 3)
            M[:, rows] = rates(u, tangent, L2)
    return M


def pods(p: Array, R: Array, base: Array, tips: Array) -> Array:
    """Mᵀ (n, 3 k, 6) of k UPS legs from ``base`` (k, 3) to ``tips`` (k, 3) in the platform's frame."""
    M = np.empty((len(p), 3 * len(base), 6))
    for i, (A, b) in enumerate(zip(base, tips, strict=True)):
        arm = R @ b
        D = p + arm - A
        length = np.linalg.norm(D, axis=1)
        u = D / length[:, None]
        N = (np.eye(3) - u[:, :, None] * u[:, None, :]) / length[:, None, None]
        M[:, 3 * i : 3 * i + 3, :3] = N
        M[:, 3 * i : 3 * i + 3, 3:] = -N @ hats(arm)
    return M


def hats(v: Array) -> Array:
    """[v]ₓ, (n, 3, 3)."""
    x, y, z = v.T
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def orthoglide(P: Array, length: float, offset: float, legs: tuple[int, ...]) -> Array:
    """Mᵀ (n, 3 k, 3) of the Orthoglide: slider i on axis i, rods of ``length`` on its positive side; all three legs are
    solved."""
    M = np.empty((len(P), 3 * len(legs), 3))
    for i in range(3):
        C = P + offset * np.eye(3)[i]
        others = [j for j in range(3) if j != i]
        D = np.zeros_like(C)
        D[:, others] = C[:, others]
        D[:, i] = -np.sqrt(length**2 - np.einsum("ni,ni->n", D, D))
        if i in legs:
            u = D / length
            rows = slice(3 * legs.index(i), 3 * legs.index(i) + 3)
            M[:, rows] = np.eye(3) / length
            M[:, rows.start + i] -= u / (u[:, i, None] * length)
    return M


def planar(p: Array, phi: Array, base: Array, tips: Array, cranks: Array, rods: Array, sides: Array) -> Array:
    """Mᵀ (n, 2 k, 3) of RRR legs in the plane for (vx, vy, φ̇)."""
    c, s = np.cos(phi), np.sin(phi)
    M = np.empty((len(p), 2 * len(base), 3))
    for i, (A, b) in enumerate(zip(base, tips, strict=True)):
        arm = np.stack([c * b[0] - s * b[1], s * b[0] + c * b[1]], axis=1)
        D = p + arm - A
        square = np.einsum("ni,ni->n", D, D)
        along = (square + cranks[i] ** 2 - rods[i] ** 2) / (2 * square)
        beside = sides[i] * np.sqrt(cranks[i] ** 2 / square - along * along)
        normal = np.stack([-D[:, 1], D[:, 0]], axis=1)
        B = along[:, None] * D + beside[:, None] * normal
        u = (D - B) / rods[i]
        v = np.stack([-B[:, 1], B[:, 0]], axis=1)
        N = (np.eye(2) - v[:, :, None] * u[:, None, :] / np.einsum("ni,ni->n", u, v)[:, None, None]) / rods[i]
        M[:, 2 * i : 2 * i + 2, :2] = N
        M[:, 2 * i : 2 * i + 2, 2] = np.einsum("nij,nj->ni", N, np.stack([-arm[:, 1], arm[:, 0]], axis=1))
    return M
