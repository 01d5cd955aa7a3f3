"""Study's coordinates of poses: a quaternion e and a g with e·g = 0, up to a common factor.

R is the turn of e and p = 2 vec(g ē) / |e|², so that all conditions on points of the body are quadrics.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...geometry.loci import Reach
from ...geometry.so3 import convert_from_quaternion, convert_rotations_to_vectors
from ...geometry.vectors import Array, cross
from .polynomials import Quadric
from .quadrics import UNIT, MovingPoint, Numbers, PoseParametrization, choose_frame

STUDY_UNKNOWNS_COUNT = 7
"""Unknowns: three of the quaternion, four of g."""


def build_study_chart(
    reaches: tuple[Reach, ...], b: Array, size: float, number: int, arrows: int, hub: Array
) -> PoseParametrization:
    """The chart of a number for tips b (n, 3), the last of them arrows from a hub (3,)."""
    frame = choose_frame(reaches, size)
    E = _draw_quaternions(number)
    e, g = E, np.eye(8, dtype=int).astype(object)[4:]
    w = sum(_expand(v, v) for v in e)
    R = _compute_rotation(e)
    shift, back = 2 * _compute_vector(e, g, 1), 2 * _compute_vector(e, g, -1)
    gg = sum(_expand(v, v) for v in g)

    def tips(numbers: Numbers) -> list[MovingPoint]:
        tips = []
        for k, tip in enumerate(b):
            v = numbers.vector(tip / frame.size)
            if k < len(b) - arrows:
                Q = 4 * UNIT * UNIT * gg + 2 * UNIT * (back @ v) + (v @ v) * w
                tips.append(MovingPoint(UNIT * shift + R @ v, Q, w))
            else:
                o = numbers.vector(frame.point(hub))
                N = R @ v + np.multiply.outer(w, o)
                tips.append(MovingPoint(N, (v @ v - o @ o) * w + 2 * (N @ o), w))
        return tips

    def place(x: Sequence[float]) -> Array:
        ends = np.array([1.0, *x])
        q, t = (ends @ rows.astype(float).T for rows in (e, g))
        norm = float(q @ q)
        p = 2.0 * (q[0] * t[1:] - t[0] * q[1:] + cross(q[1:], t[1:])) / norm
        turned = frame.R.T @ convert_from_quaternion(q / math.sqrt(norm))
        return np.array([*(frame.origin + frame.size * (p @ frame.R)), *convert_rotations_to_vectors(turned)])

    normal = sum(_expand(u, v) for u, v in zip(e, g, strict=True))
    return PoseParametrization(
        frame, STUDY_UNKNOWNS_COUNT, reaches, tips, (normal,), place, Quadric(w), np.vstack([e, g]).astype(float)
    )


def list_pose_forms() -> tuple[Array, Array]:
    """e·g, shape (8, 8), and the quadrics that are h, M, y, x, r of a pose (:mod:`.root_bound`), shape (17, 8, 8), of
    (e, g)."""
    e, g = np.eye(8)[:4], np.eye(8)[4:]
    R, shift, back = _compute_rotation(e), 2 * _compute_vector(e, g, 1), 2 * _compute_vector(e, g, -1)
    parts = [
        sum(_expand(v, v) for v in e),
        *np.moveaxis(R.reshape(8, 8, 9), 2, 0),
        *np.moveaxis(shift, 2, 0),
        *np.moveaxis(back, 2, 0),
        4 * sum(_expand(v, v) for v in g),
    ]
    quadrics = np.array(parts)
    normal = sum(_expand(u, v) for u, v in zip(e, g, strict=True))
    return (normal + normal.T) / 2, (quadrics + quadrics.transpose(0, 2, 1)) / 2


def _draw_quaternions(number: int) -> Any:
    """Four linear forms of (1, x), shape (4, 8), of the first three unknowns; their coefficients are small."""
    rng = random.Random(number)
    while True:
        E = np.array([[rng.randint(-3, 3) for _ in range(4)] for _ in range(4)], dtype=float)
        if np.linalg.svd(E, compute_uv=False)[-1] > 2.0:
            return np.hstack([E.astype(int), np.zeros((4, 4), dtype=int)]).astype(object)


def _expand(u: Any, v: Any) -> Any:
    return np.multiply.outer(u, v)


def _compute_vector(e: Any, g: Any, sign: int) -> Any:
    """The vector part of g ē, or of ē g where ``sign`` is −1; shape (8, 8, 3)."""
    parts = []
    for k in range(1, 4):
        i, j = k % 3 + 1, (k + 1) % 3 + 1
        turned = _expand(e[i], g[j]) - _expand(e[j], g[i])
        parts.append(_expand(e[0], g[k]) - _expand(e[k], g[0]) + sign * turned)
    return np.stack(parts, axis=-1)


def _compute_rotation(e: Any) -> Any:
    """|e|² R; shape (8, 8, 3, 3)."""
    a, b, c, d = e
    s = _expand
    rows = [
        [s(a, a) + s(b, b) - s(c, c) - s(d, d), 2 * (s(b, c) - s(a, d)), 2 * (s(b, d) + s(a, c))],
        [2 * (s(b, c) + s(a, d)), s(a, a) - s(b, b) + s(c, c) - s(d, d), 2 * (s(c, d) - s(a, b))],
        [2 * (s(b, d) - s(a, c)), 2 * (s(c, d) + s(a, b)), s(a, a) - s(b, b) - s(c, c) + s(d, d)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
