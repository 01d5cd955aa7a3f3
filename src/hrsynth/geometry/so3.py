"""The rotations of space: exponential and logarithm of SO(3), right at every angle up to and including half a turn.

Rotations are read through unit quaternions, from the largest of their four components (S. W. Shepperd, J. Guid. Control
1, 1978): the skew part of a rotation, its axis times the sine of its angle, vanishes at half a turn as it does at none.
"""

from __future__ import annotations

import math

import numpy as np

from .vectors import Array, cross, find_perpendicular, hat


def convert_vectors_to_rotations(vectors: Array) -> Array:
    """The rotations (..., 3, 3) of rotation vectors (..., 3): I + sin θ / θ [v]ₓ + (1 − cos θ) / θ² [v]ₓ²."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None] / np.pi
    K = hat(vectors)
    return np.asarray(np.eye(3) + np.sinc(angle) * K + 0.5 * np.sinc(0.5 * angle) ** 2 * (K @ K))


def convert_rotations_to_vectors(R: Array) -> Array:
    """The rotation vectors (..., 3) of rotations (..., 3, 3), no longer than π; either of the two at half a turn."""
    if R.ndim == 2:
        w, x, y, z = _convert_to_quaternion(R)
        sine = math.hypot(x, y, z)
        factor = 2.0 * math.copysign(math.atan2(sine, abs(w)), w) / sine if sine > 0.0 else 0.0
        return np.array([factor * x, factor * y, factor * z])
    q = convert_to_quaternions(R)
    sines = np.linalg.norm(q[..., 1:], axis=-1)
    factors = 2.0 * np.arctan2(sines, q[..., 0]) / np.where(sines > 0.0, sines, 1.0)
    return np.asarray(factors[..., None] * q[..., 1:])


def compute_rotation_angle(R: Array) -> float:
    """The angle by which a rotation (3, 3) turns, from 0 to π."""
    return float(np.linalg.norm(convert_rotations_to_vectors(R)))


def compute_rotation_vector_rate(vector: Array) -> Array:
    """The map (3, 3) from the angular velocity to the rate of the rotation vector, shorter than 2π:
    I − [v]ₓ/2 + (1/θ² − cot(θ/2) / 2θ) [v]ₓ²."""
    angle, K = float(np.linalg.norm(vector)), hat(vector)
    factor = 1 / 12 if angle < 1e-3 else 1 / angle**2 - 1 / (2 * angle * math.tan(angle / 2))
    return np.asarray(np.eye(3) - 0.5 * K + factor * K @ K)


def find_smallest_rotations(a: Array, b: Array) -> Array:
    """The rotation vectors (..., 3) of the smallest turns that bring unit vectors a (..., 3) to b (..., 3); of opposite
    ones half a turn about some normal."""
    across = cross(a, b)
    size = np.abs(across).max(axis=-1)[..., None]
    size = np.where(size > np.finfo(float).tiny, size, 0.0)
    sines = np.linalg.norm(across, axis=-1)[..., None]
    # the square of a small sine has no digits left
    scaled = size * np.linalg.norm(across / np.where(size > 0.0, size, 1.0), axis=-1)[..., None]
    sines = np.where(size > np.finfo(float).tiny ** 0.25, sines, scaled)
    cosines = np.sum(a * b, axis=-1)[..., None]
    normals = cross(a, np.eye(3)[np.argmin(np.abs(a), axis=-1)])
    opposite = (sines == 0.0) & (cosines < 0.0)
    ways = np.where(opposite, normals / np.linalg.norm(normals, axis=-1)[..., None], across)
    return np.asarray(ways * np.arctan2(sines, cosines) / np.where(sines > 0.0, sines, 1.0))


def turn_about(normal: Array, R: Array) -> tuple[float, Array]:
    """The turn of a rotation about ``normal`` (its twist, the swing left out), in (−π, π], and the row (3,) that makes
    its rate of the angular velocity; not a number where the swing is half a turn, which leaves no twist."""
    w, *vector = _convert_to_quaternion(R)
    v = np.array(vector)
    along, size = float(normal @ v), math.sqrt(w * w + v @ v)
    w, v, along = w / size, v / size, along / size
    both = w * w + along * along
    if both == 0.0:
        return math.nan, np.zeros(3)
    return wrap_angle(2 * math.atan2(along, w)), (w * w * normal + w * cross(v, normal) + along * v) / both


def decompose_rotation(axes: Array, R: Array) -> Array:
    """The angles (…, k) about up to three axes (k, 3), at right angles to each other, of which rotations (…, 3, 3) are
    made: R = exp θ₁[a₁]ₓ exp θ₂[a₂]ₓ …; the second one within a quarter turn where there are three."""
    a, b, c = _extend_to_frame(axes)
    E = np.array([a, b, c])
    R = E @ R @ E.T
    if len(axes) < 3:
        # R a₂ is turned by the first alone, Rᵀ a₁ by the second alone
        both = np.arctan2(R[..., 2, 1], R[..., 1, 1]), np.arctan2(R[..., 0, 2], R[..., 0, 0])
        return np.stack(both[: len(axes)], -1)
    angles = [
        np.arctan2(-R[..., 1, 2], R[..., 2, 2]),
        np.arctan2(R[..., 0, 2], np.hypot(R[..., 1, 2], R[..., 2, 2])),
        np.arctan2(-R[..., 0, 1], R[..., 0, 0]),
    ]
    return np.stack(angles, -1) * [1.0, 1.0, np.sign(np.linalg.det(E))]


def _extend_to_frame(axes: Array) -> tuple[Array, Array, Array]:
    """Three axes at right angles to each other, those of ``axes`` (k, 3) first."""
    a = axes[0]
    b = axes[1] if len(axes) > 1 else find_perpendicular(a)
    return a, b, axes[2] if len(axes) > 2 else cross(a, b)


def wrap_angle(angle: float) -> float:
    """An angle modulo 2π, in (−π, π]."""
    return angle if -np.pi < angle <= np.pi else float(-((np.pi - angle) % (2 * np.pi)) + np.pi)


def convert_to_quaternions(R: Array) -> Array:
    """Unit quaternions (..., 4) as (w, x, y, z) of rotations (..., 3, 3), w not negative."""
    trace = np.trace(R, axis1=-2, axis2=-1)
    products = np.empty((*R.shape[:-2], 4, 4))
    products[..., 0, 0] = 1 + trace
    skew = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1)
    products[..., 0, 1:] = products[..., 1:, 0] = skew
    products[..., 1:, 1:] = R + np.swapaxes(R, -1, -2) + (1 - trace)[..., None, None] * np.eye(3)
    best = np.argmax(np.diagonal(products, axis1=-2, axis2=-1), axis=-1)
    found = np.take_along_axis(products, best[..., None, None], axis=-2)[..., 0, :]
    found /= np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(found * np.where(found[..., :1] < 0, -1.0, 1.0))


def convert_from_quaternion(q: Array) -> Array:
    """The rotation (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _convert_to_quaternion(R: Array) -> tuple[float, float, float, float]:
    """A quaternion (w, x, y, z) of one rotation, of any length: faster than :func:`convert_to_quaternions`."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    squares = 1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i
    match squares.index(max(squares)):
        case 0:
            return squares[0], h - f, c - g, d - b
        case 1:
            return h - f, squares[1], b + d, c + g
        case 2:
            return c - g, b + d, squares[2], f + h
        case _:
            return d - b, c + g, f + h, squares[3]
