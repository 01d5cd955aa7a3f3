"""Small vector helpers shared by all rooms: unit vectors, rotations, homogeneous poses (SI, radians)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..tolerances import NAMED_TWIST_TOL

Array = NDArray[np.float64]
Numbers = NDArray[Any]
"""Floats, or objects: whole and rational numbers, balls, duals."""


def freeze_array(values: ArrayLike) -> Array:
    """A read-only copy of ``values`` as floats."""
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def scale_to_whole(vector: Numbers) -> tuple[Numbers, int]:
    """The first multiple of a rational vector that has whole entries, and how many times it is taken."""
    scale = lcm(*(int(x.q) for x in vector))
    return np.array([x.p * (scale // x.q) for x in vector], dtype=object), scale


def normalise_vector(vector: ArrayLike) -> Array:
    """``vector`` divided by its length; shape (3,). Raises ``ValueError`` for a zero vector."""
    array = np.asarray(vector, dtype=float)
    length = math.sqrt(array @ array)
    if not 0 < length < math.inf:
        raise ValueError("a zero or infinite vector has no direction")
    return array / length


def orient_axis(axis: Array) -> Array:
    """Return an axis (3,) in its canonical sense: its largest component positive, of equal ones the first."""
    sizes = np.abs(axis)
    return axis if axis[np.argmax(sizes > (1 - NAMED_TWIST_TOL) * sizes.max())] >= 0 else -axis


def dot(a: Numbers, b: Numbers, axis: int = -1) -> Numbers:
    """a · b along one dimension."""
    return np.asarray((a * b).sum(axis))


def cross(a: Numbers, b: Numbers, axis: int = -1) -> Numbers:
    """a × b along one dimension (counted from the last), without the bookkeeping of ``numpy.cross``, slow for few
    vectors."""
    kind = a.dtype if a.dtype == b.dtype else np.result_type(a, b)
    if a.ndim == b.ndim == 1:
        (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
        found = np.empty(3, kind)
        found[0], found[1], found[2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        return found
    found = np.empty(np.broadcast(a, b).shape, kind)
    x, y, z = ((..., i, *[slice(None)] * (-1 - axis)) for i in range(3))
    turns: Any = ((x, y, z), (y, z, x), (z, x, y))
    for i, j, k in turns:
        found[i] = a[j] * b[k] - a[k] * b[j]
    return found


def triple(a: Numbers, b: Numbers, c: Numbers) -> Numbers:
    """a · (b × c) along the last dimension."""
    return dot(a, cross(b, c))


def times(M: Any, v: Any) -> Array:
    """M v of matrices (..., k, l) and vectors (..., l)."""
    return np.asarray((M @ v[..., None])[..., 0])


def solve_definite(A: Array, B: Array) -> Array:
    """A⁻¹ B (n, d, k) of many small positive definite A (n, d, d): Gauss-Jordan elimination of all at once; LAPACK
    takes a call for each."""
    d = A.shape[1]
    rows = np.concatenate([A, B], axis=2).transpose(1, 2, 0).copy()
    for p in range(d):
        rows[p, p + 1 :] /= rows[p, p]
        for r in (*range(p), *range(p + 1, d)):
            rows[r, p + 1 :] -= rows[r, p] * rows[p, p + 1 :]
    return np.ascontiguousarray(rows[:, d:].transpose(2, 0, 1))


def hat(vectors: ArrayLike) -> Array:
    """The matrices [v]ₓ (..., 3, 3) of vectors (..., 3): [v]ₓ w = v × w."""
    v = np.asarray(vectors, dtype=float)
    if v.ndim == 1:
        x, y, z = v
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found = np.zeros((*v.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., k, j] = v[..., i]
        found[..., j, k] = -v[..., i]
    return found


def measure_angle(one: Array, other: Array) -> float:
    """The angle of two vectors, 0 to π."""
    return float(np.arctan2(np.linalg.norm(cross(one, other)), one @ other))


def build_pose(position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> Array:
    """The homogeneous pose X_AB with p_AB and R_AB; shape (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, 3] = position
    if rotation is not None:
        matrix[:3, :3] = rotation
    return matrix


def transform(X_AB: Array, p_B: Array) -> Array:
    """p_A of a point p_B (3,)."""
    return np.asarray(X_AB[:3, :3] @ p_B + X_AB[:3, 3])


def invert_pose(X_AB: Array) -> Array:
    """X_BA of X_AB; shape (4, 4)."""
    rotation = X_AB[:3, :3].T
    return build_pose(-rotation @ X_AB[:3, 3], rotation)


def compare_poses(X: Array, other: Array, length: float, point: Array | None = None) -> float:
    """Return the difference of two poses (4, 4): the larger of the shift (in lengths) and the difference of the
    rotations, each by its largest entry; of a ``point`` (3,) of the body, if it is given, the shift alone."""
    if point is not None:
        return float(np.max(np.abs(transform(X, point) - transform(other, point)))) / length
    gap = np.abs(X - other)
    return float(max(np.max(gap[:3, 3]) / length, np.max(gap[:3, :3])))


def rotate_about_axis(axis: ArrayLike, angle: float) -> Array:
    """Rodrigues: the rotation by ``angle`` about the unit vector along ``axis``; shape (3, 3)."""
    K = hat(normalise_vector(axis))
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


def convert_rpy_to_rotation(roll: float, pitch: float, yaw: float) -> Array:
    """URDF's fixed-axis roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll); shape (3, 3)."""
    return rotate_about_axis((0, 0, 1), yaw) @ rotate_about_axis((0, 1, 0), pitch) @ rotate_about_axis((1, 0, 0), roll)


def find_perpendicular(axis: ArrayLike, near: ArrayLike | None = None) -> Array:
    """A unit vector normal to ``axis``: the part of ``near`` normal to it where that is not (nearly) zero."""
    n = normalise_vector(axis)
    candidates: Iterable[ArrayLike] = ([] if near is None else [near]) + [np.eye(3)[i] for i in np.argsort(np.abs(n))]
    for candidate in candidates:
        rest = np.asarray(candidate, dtype=float) - n * float(n @ np.asarray(candidate, dtype=float))
        if np.linalg.norm(rest) > 1e-6:
            return normalise_vector(rest)
    raise AssertionError("three coordinate axes cannot all be parallel to one vector")


def build_plane_axes(normal: Array, near: ArrayLike | None = None) -> Array:
    """Two unit vectors that make a right-handed triad with a unit normal, the first one as :func:`find_perpendicular`
    finds it; shape (2, 3)."""
    first = find_perpendicular(normal, near)
    return np.array([first, cross(normal, first)])


def convert_to_lists(values: Array) -> list[Any]:
    """Nested lists of numbers, None where they are not finite."""
    found = values.astype(object)
    found[~np.isfinite(values)] = None
    return list(found.tolist())


def sort_rows(rows: Array, apart: float) -> list[int]:
    """The lexicographic order of rows (n, k) that no last digit decides: in a column, values between which lie only
    gaps of at most ``apart`` count as equal."""
    places = [np.empty(len(rows), dtype=int) for _ in range(rows.shape[1])]
    for place, column in zip(places, rows.T, strict=True):
        order = np.argsort(column, kind="stable")
        place[order] = np.cumsum(np.diff(column[order], prepend=column[order][:1]) > apart)
    return np.lexsort([*reversed(places)]).tolist() if places else list(range(len(rows)))
