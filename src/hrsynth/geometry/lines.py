"""Lines in space: perpendiculars and intersections. Points (3,), unit directions (3,), metres."""

from __future__ import annotations

import numpy as np

from ..tolerances import DIRECTION_SINE_TOL
from .vectors import Array, cross


def is_parallel(a: Array, b: Array) -> bool:
    """Return True if two unit vectors are parallel (of either sense)."""
    return bool(np.linalg.norm(cross(a, b)) < DIRECTION_SINE_TOL)


def is_perpendicular(a: Array, b: Array) -> bool:
    """Return True if two unit vectors are perpendicular."""
    return bool(abs(float(a @ b)) < DIRECTION_SINE_TOL)


def project_to_line(point: Array, on: Array, along: Array) -> Array:
    """Return the point nearest to ``point`` on the line through ``on`` with direction ``along``."""
    return on + along * float(along @ (point - on))


def measure_line_distance(point: Array, on: Array, along: Array) -> float:
    """Return the distance of ``point`` from the line through ``on`` with direction ``along``."""
    return float(np.linalg.norm(point - project_to_line(point, on, along)))


def find_common_perpendicular(p: Array, a: Array, q: Array, b: Array) -> tuple[Array, Array]:
    """Return the points, on the lines (p, a) and (q, b), of their common perpendicular (parallel lines: the one through
    p)."""
    if is_parallel(a, b):
        return p, project_to_line(p, q, b)
    cosine = float(a @ b)
    gap = q - p
    s = (float(gap @ a) - float(gap @ b) * cosine) / (1 - cosine**2)
    t = (float(gap @ a) * cosine - float(gap @ b)) / (1 - cosine**2)
    return p + s * a, q + t * b


def find_meeting_point(lines: list[tuple[Array, Array]], tolerance: float) -> Array | None:
    """The point common to lines (point, direction) that are not all parallel, or None; ``tolerance`` in metres."""
    first_point, first = lines[0]
    for point, direction in lines[1:]:
        if not is_parallel(first, direction):
            near, far = find_common_perpendicular(first_point, first, point, direction)
            centre = 0.5 * (near + far)
            break
    else:
        return None
    if all(measure_line_distance(centre, point, direction) <= tolerance for point, direction in lines):
        return centre
    return None
