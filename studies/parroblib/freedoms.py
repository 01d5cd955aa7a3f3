"""What legs leave a platform, from the screws of their joints: freedoms, their kind, what is left when motors are held.

T = ∩ span(J_i): the platform's twists are those that every leg can make. Held motors are columns less. Ranks are those
of singular values with their gap; arrays have the robots first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrsynth.geometry.vectors import Array
from hrsynth.tolerances import RANK_CUTOFF_FRACTION


@dataclass(frozen=True, eq=False)
class PlatformFreedoms:
    """Of B robots: a basis of the platform's twists in the first ``dof`` of 6 columns (B, 6, 6), freedoms of the
    platform (B,), translations and rotations among them (B,), idle freedoms of the legs (B,), the smallest gap of
    these ranks (B,)."""

    twists: Array
    dof: Array
    translations: Array
    idle: Array
    gap: Array

    @property
    def rotations(self) -> Array:
        """Independent angular velocities of the platform."""
        return np.asarray(self.dof - self.translations)


def count_ranks(values: Array, scale: Array | float = 1.0) -> tuple[Array, Array]:
    """How many descending singular values (..., k) are above the cutoff, and the gap that says so."""
    size = np.maximum(values[..., :1], scale)
    relative = np.maximum(values / np.where(size > 0, size, 1.0), np.finfo(float).eps)
    rank = np.sum(relative > RANK_CUTOFF_FRACTION, axis=-1)
    padded = np.concatenate(
        [np.ones_like(relative[..., :1]), relative, np.full_like(relative[..., :1], np.finfo(float).eps)], axis=-1
    )
    last = np.take_along_axis(padded, rank[..., None], -1)[..., 0]
    first = np.take_along_axis(padded, rank[..., None] + 1, -1)[..., 0]
    return rank, last / first


def common(legs: Array) -> tuple[Array, Array, Array, Array]:
    """The twists that all legs (B, n, m, 6) can make: the right singular vectors (B, 6, 6), those of zero first, how
    many they are (B,), the ranks of the legs (B, n), the smallest gap (B,)."""
    refused, gaps, rank = denied_freedoms(legs)
    _, values, Vt = np.linalg.svd(refused.reshape(len(legs), -1, 6), full_matrices=False)
    held, gap = count_ranks(values)
    return np.swapaxes(Vt, -1, -2)[..., ::-1], 6 - held, rank, np.minimum(gap, gaps.min(axis=1))


def denied_freedoms(legs: Array) -> tuple[Array, Array, Array]:
    """Of legs (..., m, 6) the projectors (..., 6, 6) onto what they do not leave, the gaps and the ranks (...)."""
    U, s, _ = np.linalg.svd(np.swapaxes(legs, -1, -2), full_matrices=False)
    rank, gaps = count_ranks(s)
    Q = U * (np.arange(s.shape[-1]) < rank[..., None])[..., None, :]
    return np.eye(6) - Q @ np.swapaxes(Q, -1, -2), gaps, rank


def freedoms(legs: Array) -> PlatformFreedoms:
    """The freedoms that legs (B, n, m, 6) leave."""
    twists, dof, ranks, gap = common(legs)
    turns = twists[:, 3:] * (np.arange(6) < dof[:, None])[:, None, :]
    turned, clear = count_ranks(np.asarray(np.linalg.svd(turns, compute_uv=False)))
    idle = np.sum(legs.shape[2] - ranks, axis=1)
    return PlatformFreedoms(twists, dof, dof - turned, idle, np.minimum(gap, clear))


def freedoms_left(legs: Array, driven: NDArray[np.bool_], axes: Array) -> tuple[Array, Array, Array]:
    """The platform's freedoms with motors held, ``driven`` (B, n, m), those of them that turn about no other than the
    stated ``axes`` (3,), and the gap, (B,) each."""
    twists, dof, _, gap = common(legs * ~driven[..., None])
    return dof, *within(twists, dof, axes, gap)


def within(twists: Array, dof: Array, axes: Array, gap: Array) -> tuple[Array, Array]:
    """How many of the first ``dof`` twists (B, 6, 6), combined, turn about no other than the stated axes of the base
    (3,), and the smallest gap, (B,) each."""
    turns = twists[:, 3:] * (np.arange(6) < dof[:, None])[:, None, :] * (1 - axes)[:, None]
    turned, clear = count_ranks(np.asarray(np.linalg.svd(turns, compute_uv=False)))
    return dof - turned, np.minimum(gap, clear)
