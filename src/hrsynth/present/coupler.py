"""Coupler curves and surfaces, to draw: traces of a platform point while two others slide on their curves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.loci import Circle, Curve, Line, Point
from ..geometry.vectors import Array, find_perpendicular, normalise_vector

COUPLER_CURVE_SAMPLES_COUNT = 1440
"""Places on the first curve at which the bar is tried, to find where it reaches the second."""
COUPLER_LINE_LENGTH_MAX = 12.0
"""A line is followed over this many lengths of the bar and radii at most."""

Chain = tuple[Array, Array]
"""The two ends of a bar along one branch of its motion, (n, 3) each."""


def evaluate_curve(curve: Curve, parameters: Array) -> Array:
    """The points of a curve at parameters (n,); shape (n, 3)."""
    return np.array([curve.at(float(value)) for value in parameters])


def trace_coupler_chains(one: Curve, other: Curve, length: float, samples: int) -> list[Chain]:
    """All branches of the motion of a bar of this ``length`` with its ends on two curves, ``samples`` places on each
    way along the first curve; a closed branch ends where it begins."""
    if isinstance(one, Point):
        middle, half = _find_partners(other, one.centre[None], length)
        signs = (1, -1) if np.isfinite(half[0]) else ()
        return [(one.centre[None], evaluate_curve(other, middle + sign * half)) for sign in signs]
    if isinstance(other, Point):
        return [(first, second) for second, first in trace_coupler_chains(other, one, length, samples)]
    found = []
    for low, high, whole in _list_intervals(one, other, length):
        s = np.linspace(low, high, samples) if whole else low + (high - low) * _ease(samples)
        middle, half = _find_partners(other, evaluate_curve(one, s), length)
        half = np.where(np.isfinite(half), half, 0.0)
        ways = [(evaluate_curve(one, s), evaluate_curve(other, middle + sign * half)) for sign in (1, -1)]
        if whole:
            found += ways
        else:
            (there, ahead), (_, back) = ways
            found.append((np.vstack([there, there[::-1]]), np.vstack([ahead, back[::-1]])))
    return found


def trace_coupler(chain: Chain, triangle: Array, normal: Array) -> Array:
    """The curve (n, 3) of a platform's third point in the plane with this ``normal``; ``triangle`` (3, 3) are the three
    points at one pose of the platform."""
    one, other = chain
    e = (triangle[1] - triangle[0]) / np.linalg.norm(triangle[1] - triangle[0])
    along, across = float((triangle[2] - triangle[0]) @ e), float((triangle[2] - triangle[0]) @ np.cross(normal, e))
    bar = (other - one) / np.linalg.norm(other - one, axis=1)[:, None]
    return np.asarray(one + along * bar + across * np.cross(normal, bar))


def sweep_third_point(chain: Chain, triangle: Array, samples: int) -> Array:
    """The surface (n, samples, 3) of a platform's third point in space: a circle about the bar at each place."""
    one, other = chain
    e = (triangle[1] - triangle[0]) / np.linalg.norm(triangle[1] - triangle[0])
    v = triangle[2] - triangle[0]
    along = float(v @ e)
    radius = float(np.linalg.norm(v - along * e))
    turn = np.linspace(0.0, 2 * np.pi, samples)[:, None]
    rings = []
    start = find_perpendicular(other[0] - one[0])
    for a, b in zip(one, other, strict=True):
        bar = normalise_vector(b - a)
        start = find_perpendicular(bar, start)
        rings.append(a + along * bar + radius * (np.cos(turn) * start + np.sin(turn) * np.cross(bar, start)))
    return np.array(rings)


def _find_partners(curve: Curve, ends: Array, length: float) -> tuple[Array, Array]:
    """The parameters middle ± half (n,) of the points of a curve at the distance ``length`` from each of ``ends``
    (n, 3); half is NaN where there are none."""
    v = ends - curve.centre
    squared = np.sum(v * v, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        if isinstance(curve, Line):
            middle = v @ curve.direction
            return middle, np.sqrt(length**2 - squared + middle**2)
        assert isinstance(curve, Circle)
        assert curve.start is not None
        x, y = v @ curve.start, v @ curve.across
        cosine = (squared + curve.radius**2 - length**2) / (2 * curve.radius * np.hypot(x, y))
        return np.arctan2(y, x), np.arccos(cosine)


def _list_intervals(one: Curve, other: Curve, length: float) -> Iterator[tuple[float, float, bool]]:
    """Intervals of the first curve's parameter over which the bar reaches the second curve, and whether each is all
    there is to follow: a full turn, or a line without end."""
    low, high = _bound_parameters(one, other, length)
    s = np.linspace(low, high, COUPLER_CURVE_SAMPLES_COUNT, endpoint=not isinstance(one, Circle))
    reached = _find_reach_point(one, other, length, s)
    if reached.all():
        yield low, high, True
        return
    if isinstance(one, Circle):
        first = int(np.argmin(reached))
        s, reached = np.append(s[first:], s[: first + 1] + 2 * np.pi), np.append(np.roll(reached, -first), False)
    change = np.flatnonzero(reached[1:] != reached[:-1])
    ends = [_find_border(one, other, length, float(s[k]), float(s[k + 1])) for k in change]
    for start, end in zip(ends[::2], ends[1::2], strict=False):
        yield start, end, False


def _find_reach_point(one: Curve, other: Curve, length: float, s: Array) -> Array:
    return np.asarray(np.isfinite(_find_partners(other, evaluate_curve(one, s), length)[1]))


def _find_border(one: Curve, other: Curve, length: float, low: float, high: float) -> float:
    """Find the end of the reached interval between two parameters of which one is reached; return the reached side."""
    inside = bool(_find_reach_point(one, other, length, np.array([low]))[0])
    for _ in range(50):
        middle = (low + high) / 2
        if bool(_find_reach_point(one, other, length, np.array([middle]))[0]) == inside:
            low = middle
        else:
            high = middle
    return low if inside else high


def _bound_parameters(one: Curve, other: Curve, length: float) -> tuple[float, float]:
    """The parameters of the first curve that can matter, a little more than those that the bar reaches."""
    if isinstance(one, Circle):
        return 0.0, 2 * np.pi
    assert isinstance(one, Line)
    between = other.centre - one.centre
    middle = float(one.direction @ between)
    if not isinstance(other, Line):
        reach = 1.01 * (length + (other.radius if isinstance(other, Circle) else 0.0))
        return middle - reach, middle + reach
    cosine = float(one.direction @ other.direction)
    sine = np.sqrt(max(1.0 - cosine**2, 0.0))
    if sine < 1.0 / COUPLER_LINE_LENGTH_MAX:
        return middle - COUPLER_LINE_LENGTH_MAX * length, middle + COUPLER_LINE_LENGTH_MAX * length
    middle = float(between @ (one.direction - cosine * other.direction)) / sine**2
    return middle - 1.01 * length / sine, middle + 1.01 * length / sine


def _ease(samples: int) -> Array:
    """From 0 to 1, close together at both ends, where a branch turns round."""
    return np.asarray((1 - np.cos(np.linspace(0, np.pi, samples))) / 2)
