"""Screws: a twist (v, ω) is that of a body at the *origin of the base frame*, base axes; a wrench (f, m) is the linear
form f·v + m·ω on it. Numbers may be floats or exact (object arrays): nothing here divides or takes roots.
"""

from __future__ import annotations

import numpy as np

from .vectors import Array, Numbers, cross, hat


def find_normals(axis: Numbers) -> tuple[Numbers, Numbers]:
    """Two independent vectors normal to ``axis`` (not unit vectors)."""
    smallest = min(range(3), key=lambda i: abs(axis[i]))
    first = cross(axis, np.array([int(i == smallest) for i in range(3)], dtype=axis.dtype))
    return first, cross(axis, first)


def force(direction: Numbers, point: Numbers) -> Numbers:
    """The wrench of a pure force through a point, (f, P × f)."""
    return np.concatenate([direction, cross(point, direction)])


def make_couple(direction: Numbers) -> Numbers:
    """The wrench of a pure couple, (0, m)."""
    return np.concatenate([0 * direction, direction])


def make_rotation_twist(axis: Numbers, point: Numbers) -> Numbers:
    """The twist of a rotation about an axis through a point, (P × a, a)."""
    return np.concatenate([cross(point, axis), axis])


def make_translation_twist(direction: Numbers) -> Numbers:
    """The twist of a translation, (d, 0)."""
    return np.concatenate([direction, 0 * direction])


def compute_point_velocity(V: Array, arm: Array) -> Array:
    """Return v + ω × r, (3, n): the velocities of the point at ``arm`` (3,) from the reference point of twists V (6,
    n)."""
    return V[:3] - hat(arm) @ V[3:]
