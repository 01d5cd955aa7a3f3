"""A rigid pose in Study's coordinates: a quaternion e and a second one, g, normal to it, with p = 2 g ē / |e|².

For a point b of the body |e|² b_tip and |e|² |b_tip|² are of degree two in (e, g), for |p|² = 4 |g|² / |e|². A linear
form of e is made 1, so that each pose is found once and e = 0, which is no pose, is not found at all; nor are complex
e with |e|² = 0 poses.
(M. Husty, Mech. Mach. Theory 31, 1996.)
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...geometry.so3 import logarithm
from ...geometry.vectors import Array
from .certify import Quadric
from .conics import UNIT, Numbers, spatial_frame
from .curves import Reach, cross
from .quadrics import Chart, Moving

COUNT = 7
"""Unknowns: three of the quaternion, four of g."""


def study(reaches: tuple[Reach, ...], b: Array, size: float, number: int) -> Chart:
    """The chart of a number for tips b (n, 3)."""
    frame = spatial_frame(reaches, size)
    E = _quaternions(number)
    e, g = E, np.eye(8, dtype=int).astype(object)[4:]
    w = sum(_product(v, v) for v in e)
    R = _rotation(e)
    shift, back = 2 * _vector(e, g, 1), 2 * _vector(e, g, -1)
    gg = sum(_product(v, v) for v in g)

    def tips(numbers: Numbers) -> list[Moving]:
        found = []
        for tip in b:
            v = numbers.vector(tip / frame.size)
            Q = 4 * UNIT * UNIT * gg + 2 * UNIT * (back @ v) + (v @ v) * w
            found.append(Moving(UNIT * shift + R @ v, Q, w))
        return found

    def place(x: Sequence[float]) -> Array:
        ends = np.array([1.0, *x])
        q, t = (ends @ rows.astype(float).T for rows in (e, g))
        norm = float(q @ q)
        p = 2.0 * (q[0] * t[1:] - t[0] * q[1:] + cross(q[1:], t[1:])) / norm
        turned = frame.R.T @ rotation_of(q / math.sqrt(norm))
        return np.array([*(frame.origin + frame.size * (p @ frame.R)), *logarithm(turned)])

    normal = sum(_product(u, v) for u, v in zip(e, g, strict=True))
    return Chart(frame, COUNT, reaches, tips, (normal,), place, Quadric(w))


def _quaternions(number: int) -> Any:
    """Four linear forms of (1, x), shape (4, 8), of the first three unknowns; their coefficients are small."""
    rng = random.Random(number)
    while True:
        E = np.array([[rng.randint(-3, 3) for _ in range(4)] for _ in range(4)], dtype=float)
        if np.linalg.svd(E, compute_uv=False)[-1] > 2.0:
            return np.hstack([E.astype(int), np.zeros((4, 4), dtype=int)]).astype(object)


def _product(u: Any, v: Any) -> Any:
    return np.multiply.outer(u, v)


def _vector(e: Any, g: Any, sign: int) -> Any:
    """The vector part of g ē, or of ē g where ``sign`` is −1; shape (8, 8, 3)."""
    parts = []
    for k in range(1, 4):
        i, j = k % 3 + 1, (k + 1) % 3 + 1
        turned = _product(e[i], g[j]) - _product(e[j], g[i])
        parts.append(_product(e[0], g[k]) - _product(e[k], g[0]) + sign * turned)
    return np.stack(parts, axis=-1)


def _rotation(e: Any) -> Any:
    """|e|² R; shape (8, 8, 3, 3)."""
    a, b, c, d = e
    s = _product
    rows = [[s(a, a) + s(b, b) - s(c, c) - s(d, d), 2 * (s(b, c) - s(a, d)), 2 * (s(b, d) + s(a, c))],
            [2 * (s(b, c) + s(a, d)), s(a, a) - s(b, b) + s(c, c) - s(d, d), 2 * (s(c, d) - s(a, b))],
            [2 * (s(b, d) - s(a, c)), 2 * (s(c, d) + s(a, b)), s(a, a) - s(b, b) - s(c, c) + s(d, d)]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotation_of(q: Array) -> Array:
    """The rotation of a unit quaternion (w, x, y, z); shape (3, 3)."""
    w, x, y, z = q.tolist()
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
