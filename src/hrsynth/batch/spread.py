"""From Mᵀ to the error maxima of position and orientation, for many poses at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array
from ..tolerances import RANK_CUTOFF
from .cones import along, largest


@dataclass(frozen=True, eq=False)
class Spread:
    """The largest error (n,) over all admissible errors of the directions, and a lower bound of it: the same for one
    cone and for two, and where the error has one freedom. Infinite where a freedom is lost."""

    largest: Array
    lower: Array


def spreads(M: Array, twists: Array, cones: Array) -> tuple[Spread, Spread]:
    """Position and orientation error for Mᵀ (3 k, d, n) on ``twists`` (6, d) or (n, 6, d), and half-angles of k cones
    (rad); the position error is in the unit of the twists' linear rows."""
    Q, R, lost = _orthogonal(M)
    rows = twists[:, :, None] if twists.ndim == 2 else twists.transpose(1, 2, 0)
    with np.errstate(all="ignore"):
        found = [_spread(_solved(part, R), Q, cones, freedom(part)) for part in (rows[:3], rows[3:])]
    if lost.any():
        for spread, infinite in zip(found, _deficient(M[..., lost], rows, lost, cones, found), strict=True):
            spread.largest[lost], spread.lower[lost] = infinite
    return found[0], found[1]


def _orthogonal(M: Array) -> tuple[Array, Array, Array]:
    """M = Q R by Gram and Schmidt, and where a column depends on those before it."""
    _, d, n = M.shape
    Q, R = M.copy(), np.zeros((d, d, n))
    for j in range(d):
        R[j, j] = np.sqrt(_dot(Q[:, j], Q[:, j]))
        Q[:, j] *= 1 / np.where(R[j, j] > 0, R[j, j], np.inf)
        for i in range(j + 1, d):
            R[j, i] = _dot(Q[:, j], Q[:, i])
            Q[:, i] -= R[j, i] * Q[:, j]
    size = np.array([R[j, j] for j in range(d)])
    lost = size.min(axis=0) <= RANK_CUTOFF * np.sqrt(np.sum(R * R, axis=(0, 1)))
    return Q, R, lost


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("rn,rn->n", a, b))


def _solved(rows: Array, R: Array) -> Array:
    """rows R⁻¹, (3, d, n)."""
    d, n = R.shape[1:]
    P = np.empty((3, d, n))
    for j in range(d):
        P[:, j] = rows[:, j]
        for i in range(j):
            P[:, j] -= P[:, i] * R[i, j]
        P[:, j] /= R[j, j]
    return P


def freedom(rows: Array) -> Array | None:
    """The one direction in which the error lies, where the twists leave no other; zero where they leave none."""
    if rows.shape[2] > 1:
        return None
    left, values, _ = np.linalg.svd(rows[..., 0])
    if values[0] == 0:
        return np.zeros(3)
    return None if len(values) > 1 and values[1] > RANK_CUTOFF * values[0] else left[:, 0]


def _spread(P: Array, Q: Array, cones: Array, only: Array | None) -> Spread:
    """The error's maxima for J = P Qᵀ (3, 3 k)."""
    B = []
    for i, cone in enumerate(cones):
        columns = [cone * sum(P[:, j] * Q[row, j] for j in range(Q.shape[1])) for row in range(3 * i, 3 * i + 3)]
        B.append(np.array([sum(a[k] * a[m] for a in columns)
                           for k, m in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]))
    if only is None:
        return Spread(*map(np.array, largest(B)))
    found = sum(along(each, only) for each in B)
    return Spread(np.array(found), np.array(found))


def _deficient(M: Array, rows: Array, lost: Array, cones: Array, found: Sequence[Spread]
               ) -> list[tuple[Array, Array]]:
    """The maxima where a freedom is lost: infinite where it moves what is asked for, else those of what is seen."""
    M = M.transpose(2, 0, 1)
    finite = np.asarray(np.isfinite(M).all(axis=(1, 2)))
    M = np.where(finite[:, None, None], M, 0.0)
    U, s, Vt = np.linalg.svd(M, full_matrices=True)
    d = M.shape[2]
    values = np.zeros((len(M), d))
    values[:, : s.shape[1]] = s
    seen = values > RANK_CUTOFF * np.maximum(values[:, :1], 1e-300)
    Q = np.zeros((len(M), M.shape[1], d))
    Q[:, :, : s.shape[1]] = U[:, :, : s.shape[1]]
    Q = (Q * seen[:, None]).transpose(1, 2, 0)
    answers = []
    for part in (rows[:3], rows[3:]):
        here = (part if part.shape[2] == 1 else part[..., lost])
        along_v = np.einsum("cdn,ned->cen", np.broadcast_to(here, (3, d, len(M))), Vt)
        gone = np.linalg.norm(along_v * ~seen.T, axis=(0, 1)) > RANK_CUTOFF * np.linalg.norm(along_v, axis=(0, 1))
        P = along_v * (seen / np.where(seen, values, 1.0)).T
        spread = _spread(P, Q, cones, freedom(part))
        largest, lower = (np.where(finite, np.where(gone, np.inf, each), np.nan)
                          for each in (spread.largest, spread.lower))
        answers.append((largest, lower))
    return answers
