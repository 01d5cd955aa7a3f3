"""Error maxima: how far the platform can be off when each direction is off by up to a cone's half-angle (theory.md 10).

With B_i = ψ_i² A_i A_iᵀ (A_i: from the error of direction i to the platform's), the largest error is the maximum over
unit w of Σ √(wᵀ B_i w). For weights t of the simplex, √λmax(Σ B_i / t_i) is an upper bound, Σ √(wᵀ B_i w) at its
eigenvector w a lower one. For one cone and for two the least upper bound is the maximum itself: the bound is that over
the convex hull of the points (wᵀ B₁ w, wᵀ B₂ w), and on the unit sphere of ℝ³ these make up a convex set (L. Brickman,
On the field of values of a matrix, Proc. AMS 12, 1961).

Symmetric matrices are given by their six entries xx, yy, zz, xy, xz, yz, shape (6, n).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.vectors import Array
from ..tolerances import CONES_MET, CONES_TIGHT, FLAT_CONE

NEWTON = 12
"""Steps after which the direct way to the maximum of two cones is given up."""
STARTS = 3
"""Starts of that way: the later ones from the end of the one before, where another maximum is larger."""
HALVINGS = 60
"""Evaluations after which the search of two cones' weights ends."""
MEETING = -0.9
"""Cosine (of three times the angle of the eigenvalues' circle) below which the two largest ones count as close."""
ROUNDS = 30
"""Rounds in which the upper bound of three cones and more is lowered."""
BISECTIONS = 10
"""Halvings with which the way of a round is found."""
CLIMBS = 10
"""Steps of the ascent from each of its starts to the lower bound of three cones and more; four times as many follow."""


def largest(B: Sequence[Array]) -> tuple[Array, Array]:
    """The largest error and a lower bound of it, (n,) each; they are the same for one and two cones."""
    if len(B) == 1:
        found = np.sqrt(np.maximum(top(B[0])[0], 0.0))
        return found, found
    return _two(B[0], B[1]) if len(B) == 2 else _several(B)


def along(B: Array, w: Array) -> Array:
    """√(wᵀ B w), (n,)."""
    x, y, z = w
    square = B[0] * x * x + B[1] * y * y + B[2] * z * z + 2 * (B[3] * x * y + B[4] * x * z + B[5] * y * z)
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def top(B: Array) -> tuple[Array, Array]:
    """The largest eigenvalue (n,) and its eigenvector (3, n) of symmetric matrices, in closed form.

    Where the two largest nearly meet, they are found in the plane normal to the third one's eigenvector.
    """
    mean = (B[0] + B[1] + B[2]) / 3
    x, y, z = B[0] - mean, B[1] - mean, B[2] - mean
    f, g, h = B[3], B[4], B[5]
    spread = np.sqrt((x * x + y * y + z * z + 2 * (f * f + g * g + h * h)) / 6)
    safe = np.where(spread > 0, spread, 1.0)
    third = np.clip((x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)) / (2 * safe**3), -1.0, 1.0)
    turn = np.arccos(third) / 3
    above = 2 * spread * np.cos(turn)
    w = _null(x - above, y - above, z - above, f, g, h)
    value = mean + above
    close = third < MEETING
    if close.any():
        value[close], w[:, close] = _upper_two(B[:, close], (mean + 2 * spread * np.cos(turn + 2 * np.pi / 3))[close])
    return value, w


def _null(x: Array, y: Array, z: Array, f: Array, g: Array, h: Array) -> Array:
    """The unit null vector (3, n) of singular symmetric matrices: the longest column of the adjugate."""
    xx, yy, zz, xy, xz, yz = y * z - h * h, x * z - g * g, x * y - f * f, g * h - f * z, f * h - g * y, f * g - h * x
    sizes = np.abs(xx), np.abs(yy), np.abs(zz)
    first = (sizes[0] >= sizes[1]) & (sizes[0] >= sizes[2])
    second = ~first & (sizes[1] >= sizes[2])
    w = np.stack((np.where(first, xx, np.where(second, xy, xz)), np.where(first, xy, np.where(second, yy, yz)),
                  np.where(first, xz, np.where(second, yz, zz))))
    size = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    w[0] = np.where(size > 0, w[0], 1.0)
    return w / np.where(size > 0, size, 1.0)


def _upper_two(B: Array, smallest: Array) -> tuple[Array, Array]:
    """The largest eigenvalue and its eigenvector from the smallest eigenvalue."""
    v = _null(B[0] - smallest, B[1] - smallest, B[2] - smallest, B[3], B[4], B[5])
    e, f = tangents(v)
    Be = _times(B, e)
    ee, ef = _dot(e, Be), _dot(f, Be)
    half = (ee - (B[0] + B[1] + B[2] - smallest - ee)) / 2
    size = np.sqrt(half * half + ef * ef)
    cosine, sine = np.where(half >= 0, half + size, ef), np.where(half >= 0, ef, size - half)
    length = np.sqrt(cosine * cosine + sine * sine)
    cosine = np.where(length > 0, cosine, 1.0) / np.where(length > 0, length, 1.0)
    return ee - half + size, e * cosine + f * (sine / np.where(length > 0, length, 1.0))


def tangents(v: Array) -> tuple[Array, Array]:
    """Two unit vectors (3, n) that make a right-handed triad with unit vectors v."""
    flat = np.abs(v[2]) < 0.7
    zero = np.zeros_like(v[0])
    e = np.stack((np.where(flat, -v[1], zero), np.where(flat, v[0], -v[2]), np.where(flat, zero, v[1])))
    e /= np.sqrt(_dot(e, e))
    return e, np.stack((v[1] * e[2] - v[2] * e[1], v[2] * e[0] - v[0] * e[2], v[0] * e[1] - v[1] * e[0]))


def _dot(v: Array, w: Array) -> Array:
    return np.asarray(v[0] * w[0] + v[1] * w[1] + v[2] * w[2])


def _times(B: Array, w: Array) -> Array:
    """B w, (3, n)."""
    x, y, z = w
    return np.stack((B[0] * x + B[3] * y + B[4] * z, B[3] * x + B[1] * y + B[5] * z, B[4] * x + B[5] * y + B[2] * z))


def _two(B: Array, C: Array) -> tuple[Array, Array]:
    """The exact maximum of two cones: by Newton's method, started again where another maximum is larger, and by the
    weights of its dual where that proves nothing."""
    value, rest, here, there = np.full(B.shape[1], np.nan), np.arange(B.shape[1]), B, C
    a, b = np.sqrt(B[0] + B[1] + B[2]), np.sqrt(C[0] + C[1] + C[2])
    for _ in range(STARTS):
        w = top(here / np.where(a > 0, a, 1.0) + there / np.where(b > 0, b, 1.0))[1]
        value[rest], w = _direct(here, there, w)
        open_ = np.isnan(value[rest])
        if not open_.any():
            return value, value
        rest, here, there, w = rest[open_], here[:, open_], there[:, open_], w[:, open_]
        a, b = along(here, w), along(there, w)
    value[rest] = _weighed(here, there)
    return value, value


@np.errstate(divide="ignore", invalid="ignore")
def _direct(B: Array, C: Array, w: Array) -> tuple[Array, Array]:
    """The maximum of two cones by Newton's method on the sphere from w (3, n), NaN where it is not proved, and the w
    where it ended; where the sum is not concave, a step of the ascent is made instead.

    A stationary w is an eigenvector of S = B / a + C / b, a = √(wᵀBw) and b = √(wᵀCw), to the eigenvalue a + b; it is
    the maximum if no other is larger.
    """
    value, ends, live = np.full(B.shape[1], np.nan), w.copy(), np.arange(B.shape[1])
    for _ in range(NEWTON):
        Bw, Cw = _times(B, w), _times(C, w)
        aa, bb = _dot(w, Bw), _dot(w, Cw)
        sound = (aa > FLAT_CONE * (B[0] + B[1] + B[2])) & (bb > FLAT_CONE * (C[0] + C[1] + C[2]))
        a, b = np.sqrt(aa), np.sqrt(bb)
        total, S, (e, f) = a + b, B / a + C / b, tangents(w)
        be, bf, ce, cf = _dot(Bw, e) / a, _dot(Bw, f) / a, _dot(Cw, e) / b, _dot(Cw, f) / b
        Se = _times(S, e)
        ee, ef, ff = _dot(Se, e) - total, _dot(Se, f), _dot(_times(S, f), f) - total
        hee, hef, hff = ee - be * be / a - ce * ce / b, ef - be * bf / a - ce * cf / b, ff - bf * bf / a - cf * cf / b
        ge, gf, det = be + ce, bf + cf, hee * hff - hef * hef
        onto_e, onto_f = (hef * gf - hff * ge) / det, (hef * ge - hee * gf) / det
        rising = sound & (det > 0) & (hee < 0)
        there = rising & (onto_e * ge + onto_f * gf <= CONES_MET * total)
        proved = there & (ee * ff >= ef * ef) & (ee <= 0)
        value[live[proved]] = total[proved]
        open_ = sound & ~there
        if not open_.any():
            break
        w = np.where(rising, w + onto_e * e + onto_f * f, Bw / a + Cw / b)
        w = w / np.sqrt(_dot(w, w))
        ends[:, live] = w
        if not open_.all():
            live, B, C, w = live[open_], B[:, open_], C[:, open_], w[:, open_]
    return value, ends


def _weighed(B: Array, C: Array) -> Array:
    """The exact maximum of two cones, the least upper bound: at the weight t where a (1 − t) − b t changes its sign, by
    the rule of false position on a bracket; a and b are the two terms at the eigenvector. Where the largest eigenvalue
    is double there, the sign changes by a jump."""
    n = B.shape[1]
    value = np.full(n, np.inf)
    live = np.arange(n)
    first, second = np.sqrt(B[0] + B[1] + B[2]), np.sqrt(C[0] + C[1] + C[2])
    t = first / np.where(first + second > 0, first + second, 1.0)
    low, high = np.zeros(n), np.ones(n)
    below, above = first, -second
    for step in range(HALVINGS):
        t = np.clip(t, 1e-12, 1 - 1e-12)
        square, w = top(B / t + C / (1 - t))
        a, b = along(B, w), along(C, w)
        total = a + b
        value[live] = np.minimum(value[live], np.sqrt(np.maximum(square, 0.0)))
        off = a * (1 - t) - b * t
        rising = off > 0
        low, high = np.where(rising, t, low), np.where(rising, high, t)
        below, above = np.where(rising, off, below / 2), np.where(rising, above / 2, off)
        open_ = (off * off > CONES_MET * t * (1 - t) * total * total) & (high - low > 1e-15)
        if not open_.any():
            break
        fixed = a / np.where(total > 0, total, 1.0)
        straight = low + (high - low) * below / np.where(below - above > 0, below - above, 1.0)
        inside = (fixed > low) & (fixed < high)
        t = np.where(inside & (step % 3 == 0), fixed, straight)
        if not open_.all():
            live, B, C = live[open_], B[:, open_], C[:, open_]
            t, low, high, below, above = t[open_], low[open_], high[open_], below[open_], above[open_]
    return value


def _several(B: Sequence[Array]) -> tuple[Array, Array]:
    """An upper and a lower bound for three cones and more: an ascent from several starts, and where it is not proved to
    have found the maximum, the least bound over weights.

    That bound is the maximum of Σ √tr(B_i Z) over Z ⪰ 0 of trace one; from Z = w wᵀ, each round goes as far towards the
    best dyad as raises it most.
    """
    stack = np.array(B)
    traces = np.maximum(stack[:, :3].sum(axis=1), 1e-300)
    starts = [top(_weighted(stack, 1 / np.sqrt(traces)))[1], *np.eye(3)[..., None]]
    best, lower = np.zeros(starts[0].shape), np.full(stack.shape[2], -1.0)
    for start in starts:
        w = np.broadcast_to(start, best.shape)
        for _ in range(CLIMBS):
            w = _climbed(stack, w)
        total = sum(along(each, w) for each in stack)
        best, lower = np.where(total > lower, w, best), np.maximum(total, lower)
    for _ in range(4 * CLIMBS):
        best = _climbed(stack, best)
    terms = np.array([along(each, best) for each in stack])
    lower = np.maximum(terms.sum(axis=0), lower)
    upper, live = np.full(lower.shape, np.inf), np.arange(len(lower))
    for _ in range(ROUNDS):
        roots = np.maximum(terms, 1e-12 * terms.sum(axis=0) + 1e-300)
        total = roots.sum(axis=0)
        square, w = top(_weighted(stack, total / roots))
        upper[live] = np.minimum(upper[live], np.sqrt(np.maximum(square, 0.0)))
        open_ = upper[live] > lower[live] * (1 + CONES_TIGHT)
        if not open_.any():
            break
        live, stack, roots, w = live[open_], stack[..., open_], roots[:, open_], w[:, open_]
        ahead = np.array([along(each, w) for each in stack])
        share = _share(roots**2, ahead**2)
        terms = np.sqrt(roots**2 + share * (ahead**2 - roots**2))
    return np.maximum(upper, lower), lower


def _weighted(stack: Array, weights: Array) -> Array:
    """Σ weight_i B_i, (6, n)."""
    return np.asarray(np.einsum("kcn,kn->cn", stack, weights))


def _share(here: Array, there: Array) -> Array:
    """The γ of [0, 1] that makes Σ √(here + γ (there − here)) largest, by halving: its slope falls."""
    low, high = np.zeros(here.shape[1]), np.ones(here.shape[1])
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        slope = np.sum((there - here) / np.sqrt(here + middle * (there - here)), axis=0)
        low, high = np.where(slope > 0, middle, low), np.where(slope > 0, high, middle)
    return low


def _climbed(stack: Array, w: Array) -> Array:
    """One step of the ascent, w ← Σ B_i w / √(wᵀ B_i w), normalised."""
    pull = np.zeros(w.shape)
    for each in stack:
        gain = along(each, w)
        share = 1 / np.where(gain > 0, gain, np.inf)
        pull += share * np.stack((each[0] * w[0] + each[3] * w[1] + each[4] * w[2],
                                  each[3] * w[0] + each[1] * w[1] + each[5] * w[2],
                                  each[4] * w[0] + each[5] * w[1] + each[2] * w[2]))
    size = np.sqrt(pull[0] ** 2 + pull[1] ** 2 + pull[2] ** 2)
    return np.where(size > 0, pull / np.where(size > 0, size, 1.0), w)
