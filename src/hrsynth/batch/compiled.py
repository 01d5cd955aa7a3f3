"""The batch compiled by numba: the same closed forms as in NumPy, pose by pose. Imported only where it is used.

What is compiled is kept between runs. It is one file because numba notices changes only in the file of what it kept.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, cos, isfinite, pi, sqrt
from typing import Any

import numpy as np

from ..tolerances import CONES_MET, CONES_TIGHT, FLAT_CONE, RANK_CUTOFF
from .cones import BISECTIONS, CLIMBS, HALVINGS, MEETING, NEWTON, ROUNDS, STARTS
from .limb import Kind

CONSTANT, TURNING, DISTANCE, CIRCLE, LINE = (int(kind) for kind in list(Kind)[:5])
NEIGHBOUR = 0.04
"""Square of the slope, in parts of the maximum, up to which the answer at the pose before is a start."""


def _jit(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled when it is first called, or read from the cache of an earlier run."""
    from numba import njit

    return njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, **options)(function)


def _threads() -> int:
    """The cores that the process may use, or fewer if NUMBA_NUM_THREADS says so."""
    from numba import config

    return int(vars(config)["NUMBA_NUM_THREADS"])


def _inlined(function: Callable[..., Any]) -> Any:
    """The same, written out where it is called: an array that is handed over costs numba more than a few products."""
    return _jit(function, inline="always")


THREADS = _threads()
"""Threads that go through a sweep."""


@_jit
def along(B, w):  # type: ignore[no-untyped-def]
    """√(wᵀ B w)."""
    x, y, z = w[0], w[1], w[2]
    return sqrt(max(B[0] * x * x + B[1] * y * y + B[2] * z * z + 2 * (B[3] * x * y + B[4] * x * z + B[5] * y * z), 0.0))


@_jit
def normalise(w):  # type: ignore[no-untyped-def]
    """Make ``w`` a unit vector; a zero one becomes the first axis."""
    size = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    if size > 0.0:
        w[0], w[1], w[2] = w[0] / size, w[1] / size, w[2] / size
    else:
        w[0], w[1], w[2] = 1.0, 0.0, 0.0


@_jit
def null(x, y, z, f, g, h, w):  # type: ignore[no-untyped-def]
    """``w`` becomes the unit null vector of a singular symmetric matrix (``cones._null``)."""
    xx, yy, zz = y * z - h * h, x * z - g * g, x * y - f * f
    if abs(xx) >= abs(yy) and abs(xx) >= abs(zz):
        w[0], w[1], w[2] = xx, g * h - f * z, f * h - g * y
    elif abs(yy) >= abs(zz):
        w[0], w[1], w[2] = g * h - f * z, yy, f * g - h * x
    else:
        w[0], w[1], w[2] = f * h - g * y, f * g - h * x, zz
    normalise(w)


@_jit
def top(B, w):  # type: ignore[no-untyped-def]
    """The largest eigenvalue; ``w`` becomes its eigenvector (``cones.top``)."""
    mean = (B[0] + B[1] + B[2]) / 3
    x, y, z, f, g, h = B[0] - mean, B[1] - mean, B[2] - mean, B[3], B[4], B[5]
    spread = sqrt((x * x + y * y + z * z + 2 * (f * f + g * g + h * h)) / 6)
    if spread == 0.0:
        w[0], w[1], w[2] = 1.0, 0.0, 0.0
        return mean
    third = min(1.0, max(-1.0, (x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)) / (2 * spread**3)))
    turn = acos(third) / 3
    if third >= MEETING:
        above = 2 * spread * cos(turn)
        null(x - above, y - above, z - above, f, g, h, w)
        return mean + above
    smallest = mean + 2 * spread * cos(turn + 2 * pi / 3)
    null(B[0] - smallest, B[1] - smallest, B[2] - smallest, f, g, h, w)
    vx, vy, vz = w[0], w[1], w[2]
    if abs(vz) < 0.7:
        size = 1 / sqrt(vx * vx + vy * vy)
        ex, ey, ez = -vy * size, vx * size, 0.0
    else:
        size = 1 / sqrt(vy * vy + vz * vz)
        ex, ey, ez = 0.0, -vz * size, vy * size
    fx, fy, fz = vy * ez - vz * ey, vz * ex - vx * ez, vx * ey - vy * ex
    bx, by, bz = B[0] * ex + f * ey + g * ez, f * ex + B[1] * ey + h * ez, g * ex + h * ey + B[2] * ez
    ee, ef = ex * bx + ey * by + ez * bz, fx * bx + fy * by + fz * bz
    half = (ee - (B[0] + B[1] + B[2] - smallest - ee)) / 2
    size = sqrt(half * half + ef * ef)
    cosine, sine = (half + size, ef) if half >= 0 else (ef, size - half)
    w[0], w[1], w[2] = ex * cosine + fx * sine, ey * cosine + fy * sine, ez * cosine + fz * sine
    normalise(w)
    return ee - half + size


@_inlined
def direct(B, C, w, warm):  # type: ignore[no-untyped-def]
    """The maximum of two cones by Newton's method on the sphere from ``w``, which becomes where it ended, if it is
    proved to be the maximum (``cones._direct``); −1 otherwise, and, where the start is ``warm`` (a neighbour's answer),
    if that is far from here."""
    B0, B1, B2, B3, B4, B5 = B[0], B[1], B[2], B[3], B[4], B[5]
    C0, C1, C2, C3, C4, C5 = C[0], C[1], C[2], C[3], C[4], C[5]
    least_a, least_b = FLAT_CONE * (B0 + B1 + B2), FLAT_CONE * (C0 + C1 + C2)
    x, y, z = w[0], w[1], w[2]
    for _ in range(NEWTON):
        bx, by, bz = B0 * x + B3 * y + B4 * z, B3 * x + B1 * y + B5 * z, B4 * x + B5 * y + B2 * z
        cx, cy, cz = C0 * x + C3 * y + C4 * z, C3 * x + C1 * y + C5 * z, C4 * x + C5 * y + C2 * z
        a, b = x * bx + y * by + z * bz, x * cx + y * cy + z * cz
        if a <= least_a or b <= least_b:
            return -1.0
        a, b = sqrt(a), sqrt(b)
        total = a + b
        if abs(z) < 0.7:
            size = 1 / sqrt(x * x + y * y)
            ex, ey, ez = -y * size, x * size, 0.0
        else:
            size = 1 / sqrt(y * y + z * z)
            ex, ey, ez = 0.0, -z * size, y * size
        fx, fy, fz = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
        ia, ib = 1 / a, 1 / b
        be, bf = (bx * ex + by * ey + bz * ez) * ia, (bx * fx + by * fy + bz * fz) * ia
        ce, cf = (cx * ex + cy * ey + cz * ez) * ib, (cx * fx + cy * fy + cz * fz) * ib
        S0, S1, S2 = B0 * ia + C0 * ib, B1 * ia + C1 * ib, B2 * ia + C2 * ib
        S3, S4, S5 = B3 * ia + C3 * ib, B4 * ia + C4 * ib, B5 * ia + C5 * ib
        sx, sy, sz = S0 * ex + S3 * ey + S4 * ez, S3 * ex + S1 * ey + S5 * ez, S4 * ex + S5 * ey + S2 * ez
        see, sef = sx * ex + sy * ey + sz * ez, sx * fx + sy * fy + sz * fz
        sff = S0 * fx * fx + S1 * fy * fy + S2 * fz * fz + 2 * (S3 * fx * fy + S4 * fx * fz + S5 * fy * fz)
        ge, gf = be + ce, bf + cf
        if warm and ge * ge + gf * gf > NEIGHBOUR * total * total:
            return -1.0
        warm = False
        hee = see - be * be * ia - ce * ce * ib - total
        hef = sef - be * bf * ia - ce * cf * ib
        hff = sff - bf * bf * ia - cf * cf * ib - total
        det = hee * hff - hef * hef
        if det > 0.0 and hee < 0.0:
            short = 1 / det
            along_e, along_f = (hef * gf - hff * ge) * short, (hef * ge - hee * gf) * short
            if along_e * ge + along_f * gf <= CONES_MET * total:
                w[0], w[1], w[2] = x, y, z
                proved = (total - see) * (total - sff) >= sef * sef and total >= see
                return total if proved else -1.0
            x, y, z = (x + along_e * ex + along_f * fx, y + along_e * ey + along_f * fy,
                       z + along_e * ez + along_f * fz)
        else:
            x, y, z = bx * ia + cx * ib, by * ia + cy * ib, bz * ia + cz * ib
        size = 1 / sqrt(x * x + y * y + z * z)
        x, y, z = x * size, y * size, z * size
    w[0], w[1], w[2] = x, y, z
    return -1.0


@_inlined
def two(B, C, S, w, near):  # type: ignore[no-untyped-def]
    """The exact maximum of two cones: directly from the pose before (``near``, made this one's w), directly from starts
    of its own (``cones._two``), or by false position on the weight (``cones._weighed``)."""
    value = direct(B, C, near, True)
    if value >= 0.0:
        return value
    first, second = sqrt(B[0] + B[1] + B[2]), sqrt(C[0] + C[1] + C[2])
    a, b = first, second
    for _ in range(STARTS):
        if a <= 0.0 or b <= 0.0:
            break
        for i in range(6):
            S[i] = B[i] / a + C[i] / b
        top(S, near)
        value = direct(B, C, near, False)
        if value >= 0.0:
            return value
        a, b = along(B, near), along(C, near)
    if first + second == 0.0:
        return 0.0
    t, low, high, below, above, value = first / (first + second), 0.0, 1.0, first, -second, np.inf
    for step in range(HALVINGS):
        t = min(1 - 1e-12, max(1e-12, t))
        for i in range(6):
            S[i] = B[i] / t + C[i] / (1 - t)
        value = min(value, sqrt(max(top(S, w), 0.0)))
        a, b = along(B, w), along(C, w)
        total = a + b
        off = a * (1 - t) - b * t
        if off > 0:
            low, below, above = t, off, above / 2
        else:
            high, above, below = t, off, below / 2
        if off * off <= CONES_MET * t * (1 - t) * total * total or high - low <= 1e-15:
            break
        fixed = a / total
        t = fixed if low < fixed < high and step % 3 == 0 else low + (high - low) * below / (below - above)
    return value


@_jit
def climb(B, w, steps):  # type: ignore[no-untyped-def]
    """Steps of the ascent from ``w`` (``cones._climbed``); the sum reached."""
    k = len(B)
    for _ in range(steps):
        x, y, z = 0.0, 0.0, 0.0
        for i in range(k):
            gain = along(B[i], w)
            if gain > 0.0:
                x += (B[i, 0] * w[0] + B[i, 3] * w[1] + B[i, 4] * w[2]) / gain
                y += (B[i, 3] * w[0] + B[i, 1] * w[1] + B[i, 5] * w[2]) / gain
                z += (B[i, 4] * w[0] + B[i, 5] * w[1] + B[i, 2] * w[2]) / gain
        if x * x + y * y + z * z > 0.0:
            w[0], w[1], w[2] = x, y, z
            normalise(w)
    total = 0.0
    for i in range(k):
        total += along(B[i], w)
    return total


@_jit
def several(B, S, w, here, there, starts):  # type: ignore[no-untyped-def]
    """An upper and a lower bound for three cones and more (``cones._several``)."""
    k = len(B)
    for j in range(6):
        S[j] = 0.0
        for i in range(k):
            S[j] += B[i, j] / sqrt(max(B[i, 0] + B[i, 1] + B[i, 2], 1e-300))
    top(S, w)
    starts[0] = w
    starts[1:] = np.eye(3)
    lower, best = -1.0, 0
    for start in range(4):
        total = climb(B, starts[start], CLIMBS)
        if total > lower:
            lower, best = total, start
    lower = max(climb(B, starts[best], 4 * CLIMBS), lower)
    for i in range(k):
        here[i] = along(B[i], starts[best])
    upper = np.inf
    for _ in range(ROUNDS):
        total = 0.0
        for i in range(k):
            total += here[i]
        floor, total = 1e-12 * total + 1e-300, 0.0
        for i in range(k):
            here[i] = max(here[i], floor)
            total += here[i]
        for j in range(6):
            S[j] = 0.0
            for i in range(k):
                S[j] += B[i, j] * (total / here[i])
        upper = min(upper, sqrt(max(top(S, w), 0.0)))
        if upper <= lower * (1 + CONES_TIGHT):
            break
        for i in range(k):
            here[i] *= here[i]
            there[i] = along(B[i], w)
            there[i] *= there[i]
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            slope = 0.0
            for i in range(k):
                slope += (there[i] - here[i]) / sqrt(here[i] + middle * (there[i] - here[i]))
            if slope > 0:
                low = middle
            else:
                high = middle
        for i in range(k):
            here[i] = sqrt(here[i] + low * (there[i] - here[i]))
    return max(upper, lower), lower


@_inlined
def rod(kind, limbs, leg, watched, x, y, z):  # type: ignore[no-untyped-def]
    """1 / |BC|, u and the tangent of B's path, for C at (x, y, z) seen from the limb's centre; a negative length where
    the leg does not reach (``plain.rod``); no more than that is worked out of a leg that is not watched."""
    ax, ay, az = limbs[leg, 0], limbs[leg, 1], limbs[leg, 2]
    radius, length, side, sense = limbs[leg, 12], limbs[leg, 13], limbs[leg, 14], limbs[leg, 15]
    square = x * x + y * y + z * z
    if kind == DISTANCE:
        if square == 0.0:
            return -1.0, x, y, z, ax, ay, az
        short = 1 / sqrt(square)
        gain = sense * short
        return short, x * gain, y * gain, z * gain, x, y, z
    height = ax * x + ay * y + az * z
    gain = sense / length
    if kind == LINE:
        inside = length * length - square + height * height
        if not inside > 0.0:
            return -1.0, x, y, z, ax, ay, az
        if not watched:
            return 1.0, x, y, z, ax, ay, az
        along = height - side * sqrt(inside)
        return 1 / length, (x - ax * along) * gain, (y - ay * along) * gain, (z - az * along) * gain, ax, ay, az
    fx, fy, fz = x - ax * height, y - ay * height, z - az * height
    flat = 1 / (fx * fx + fy * fy + fz * fz)
    along = 0.5 + 0.5 * flat * (height * height + (radius * radius - length * length))
    inside = radius * radius * flat - along * along
    if not inside > 0.0:
        return -1.0, x, y, z, ax, ay, az
    if not watched:
        return 1.0, x, y, z, ax, ay, az
    across = side * sqrt(inside)
    bx = fx * along + (ay * fz - az * fy) * across
    by = fy * along + (az * fx - ax * fz) * across
    bz = fz * along + (ax * fy - ay * fx) * across
    return (1 / length, (x - bx) * gain, (y - by) * gain, (z - bz) * gain,
            ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


@_inlined
def from_centre(limbs, leg, X, p, i):  # type: ignore[no-untyped-def]
    """The leg's tip at pose i, seen from its limb's centre."""
    bx, by, bz = limbs[leg, 3], limbs[leg, 4], limbs[leg, 5]
    return (p[0] + X[i, 0, 0] * bx + X[i, 0, 1] * by + X[i, 0, 2] * bz + (limbs[leg, 6] - limbs[leg, 9]),
            p[1] + X[i, 1, 0] * bx + X[i, 1, 1] * by + X[i, 1, 2] * bz + (limbs[leg, 7] - limbs[leg, 10]),
            p[2] + X[i, 2, 0] * bx + X[i, 2, 1] * by + X[i, 2, 2] * bz + (limbs[leg, 8] - limbs[leg, 11]))


@_inlined
def rows(kind, limbs, leg, span, p, X, U, M, i, place):  # type: ignore[no-untyped-def]
    """u and the leg's rows of Mᵀ at pose i, where it is watched (``place`` ≥ 0); False where the leg does not reach
    (``plain.block``)."""
    d = span.shape[1]
    row = 3 * place
    ax, ay, az = limbs[leg, 0], limbs[leg, 1], limbs[leg, 2]
    if kind == CONSTANT:
        if place >= 0:
            U[i, place, 0], U[i, place, 1], U[i, place, 2] = ax, ay, az
            for j in range(d):
                M[i, row, j] = M[i, row + 1, j] = M[i, row + 2, j] = 0.0
        return True
    if kind == TURNING:
        ux = X[i, 0, 0] * ax + X[i, 0, 1] * ay + X[i, 0, 2] * az
        uy = X[i, 1, 0] * ax + X[i, 1, 1] * ay + X[i, 1, 2] * az
        uz = X[i, 2, 0] * ax + X[i, 2, 1] * ay + X[i, 2, 2] * az
        if limbs[leg, 12] > 0.0:
            cx, cy, cz = from_centre(limbs, leg, X, p, i)
            away = cx * ux + cy * uy + cz * uz
            if not limbs[leg, 12] * limbs[leg, 12] - (cx * cx + cy * cy + cz * cz) + away * away > 0.0:
                return False
        if place >= 0:
            U[i, place, 0], U[i, place, 1], U[i, place, 2] = ux, uy, uz
            for j in range(d):
                wx, wy, wz = span[3, j], span[4, j], span[5, j]
                M[i, row, j] = wy * uz - wz * uy
                M[i, row + 1, j] = wz * ux - wx * uz
                M[i, row + 2, j] = wx * uy - wy * ux
        return True
    bx, by, bz = limbs[leg, 3], limbs[leg, 4], limbs[leg, 5]
    rx, ry, rz = 0.0, 0.0, 0.0
    if bx != 0.0 or by != 0.0 or bz != 0.0:
        rx = X[i, 0, 0] * bx + X[i, 0, 1] * by + X[i, 0, 2] * bz
        ry = X[i, 1, 0] * bx + X[i, 1, 1] * by + X[i, 1, 2] * bz
        rz = X[i, 2, 0] * bx + X[i, 2, 1] * by + X[i, 2, 2] * bz
    short, ux, uy, uz, tx, ty, tz = rod(kind, limbs, leg, place >= 0, p[0] + rx + (limbs[leg, 6] - limbs[leg, 9]),
                                        p[1] + ry + (limbs[leg, 7] - limbs[leg, 10]),
                                        p[2] + rz + (limbs[leg, 8] - limbs[leg, 11]))
    if short < 0.0:
        return False
    if place >= 0:
        U[i, place, 0], U[i, place, 1], U[i, place, 2] = ux, uy, uz
        gain = short * limbs[leg, 15]
        slip = 1 / (ux * tx + uy * ty + uz * tz)
        for j in range(d):
            wx, wy, wz = span[3, j], span[4, j], span[5, j]
            yx = span[0, j] + wy * rz - wz * ry
            yy = span[1, j] + wz * rx - wx * rz
            yz = span[2, j] + wx * ry - wy * rx
            push = (ux * yx + uy * yy + uz * yz) * slip
            M[i, row, j] = (yx - tx * push) * gain
            M[i, row + 1, j] = (yy - ty * push) * gain
            M[i, row + 2, j] = (yz - tz * push) * gain
    return True


@_inlined
def factor(M, pose, Q, T):  # type: ignore[no-untyped-def]
    """M[pose] = Q T by Gram and Schmidt, the rows of a leg at a time; False where a column depends on those before it
    (``spread._orthogonal``). The diagonal of T is left inverted."""
    m, d = Q.shape
    for i in range(m):
        for j in range(d):
            Q[i, j] = M[pose, i, j]
    whole, smallest = 0.0, np.inf
    for j in range(d):
        square = 0.0
        for i in range(0, m, 3):
            x, y, z = Q[i, j], Q[i + 1, j], Q[i + 2, j]
            square += x * x + y * y + z * z
        whole += square
        size = sqrt(square)
        smallest = min(smallest, size)
        short = 1 / size if size > 0.0 else 0.0
        T[j, j] = short
        for i in range(0, m, 3):
            Q[i, j] *= short
            Q[i + 1, j] *= short
            Q[i + 2, j] *= short
        for k in range(j + 1, d):
            push = 0.0
            for i in range(0, m, 3):
                push += Q[i, j] * Q[i, k] + Q[i + 1, j] * Q[i + 1, k] + Q[i + 2, j] * Q[i + 2, k]
            T[j, k] = push
            whole += push * push
            for i in range(0, m, 3):
                Q[i, k] -= push * Q[i, j]
                Q[i + 1, k] -= push * Q[i + 1, j]
                Q[i + 2, k] -= push * Q[i + 2, j]
    return smallest > RANK_CUTOFF * sqrt(whole)


@_inlined
def single_freedom(span, part, T, Q, cones, only, P):  # type: ignore[no-untyped-def]
    """The largest error where it lies along ``only[part]``: one row of the same."""
    d, total = T.shape[0], 0.0
    for j in range(d):
        value = (only[part, 0] * span[3 * part, j] + only[part, 1] * span[3 * part + 1, j]
                 + only[part, 2] * span[3 * part + 2, j])
        for m in range(j):
            value -= P[0, m] * T[m, j]
        P[0, j] = value * T[j, j]
    for leg in range(len(cones)):
        row, x, y, z = 3 * leg, 0.0, 0.0, 0.0
        for j in range(d):
            x, y, z = x + P[0, j] * Q[row, j], y + P[0, j] * Q[row + 1, j], z + P[0, j] * Q[row + 2, j]
        total += cones[leg] * sqrt(x * x + y * y + z * z)
    return total


@_inlined
def maxima(span, part, T, Q, cones, only, single, P, B, S, w, near, terms, weights, starts):  # type: ignore[no-untyped-def]
    """Largest error and its lower bound for the rows of position (``part`` 0) or of orientation (1)
    (``spread._spread``)."""
    d, k = T.shape[0], len(cones)
    if single[part] == 0:
        return 0.0, 0.0
    if single[part] == 1:
        total = single_freedom(span, part, T, Q, cones, only, P)
        return total, total
    for j in range(d):
        for i in range(3):
            value = span[3 * part + i, j]
            for m in range(j):
                value -= P[i, m] * T[m, j]
            P[i, j] = value * T[j, j]
    for leg in range(k):
        row = 3 * leg
        ax, ay, az, bx, by, bz, cx, cy, cz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(d):
            px, py, pz = P[0, j], P[1, j], P[2, j]
            a, b, c = Q[row, j], Q[row + 1, j], Q[row + 2, j]
            ax, ay, az = ax + px * a, ay + py * a, az + pz * a
            bx, by, bz = bx + px * b, by + py * b, bz + pz * b
            cx, cy, cz = cx + px * c, cy + py * c, cz + pz * c
        scale = cones[leg] * cones[leg]
        B[leg, 0] = scale * (ax * ax + bx * bx + cx * cx)
        B[leg, 1] = scale * (ay * ay + by * by + cy * cy)
        B[leg, 2] = scale * (az * az + bz * bz + cz * cz)
        B[leg, 3] = scale * (ax * ay + bx * by + cx * cy)
        B[leg, 4] = scale * (ax * az + bx * bz + cx * cz)
        B[leg, 5] = scale * (ay * az + by * bz + cy * cz)
    if k == 1:
        value = sqrt(max(top(B[0], w), 0.0))
        return value, value
    if k == 2:
        value = two(B[0], B[1], S, w, near[part])
        return value, value
    return several(B, S, w, terms, weights, starts)


@_jit
def swept(kinds, table, watched, span, X, point, cones, only, single, reached, clear, U, M, found):  # type: ignore[no-untyped-def]
    """All poses X (n, 4, 4): ``reached`` (n,), ``clear`` (n,) where no freedom is lost, directions U (n, k, 3),
    M (n, 3 k, d), and, where there are cones, maxima and lower bounds ``found`` (n, 4)."""
    n, d, k = len(X), span.shape[1], len(watched)
    Q, T, P = np.zeros((3 * k, d)), np.zeros((d, d)), np.zeros((3, d))
    B, S, w, terms, weights, starts = (np.zeros((k, 6)), np.zeros(6), np.zeros(3), np.zeros(k), np.zeros(k),
                                       np.zeros((4, 3)))
    p, near = np.zeros(3), np.eye(3)[:2].copy()
    slot = np.full(len(kinds), -1)
    for place in range(k):
        slot[watched[place]] = place
    for i in range(n):
        for row in range(3):
            p[row] = (X[i, row, 3] + X[i, row, 0] * point[0] + X[i, row, 1] * point[1] + X[i, row, 2] * point[2])
        there = isfinite(p[0] + p[1] + p[2])
        for leg in range(len(kinds) if there else 0):
            if not rows(kinds[leg], table, leg, span, p, X, U, M, i, slot[leg]):
                there = False
                break
        reached[i] = there
        if not there:
            U[i] = np.nan
            M[i] = np.nan
            found[i] = np.nan
            clear[i] = True
        elif len(cones):
            clear[i] = factor(M, i, Q, T)
            if clear[i]:
                for part in range(2):
                    value, lower = maxima(span, part, T, Q, cones, only, single, P, B, S, w, near, terms, weights,
                                          starts)
                    found[i, 2 * part], found[i, 2 * part + 1] = value, lower
