"""Random platforms with their tips on random curves through a random pose: one mode is known beforehand."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hrsynth.analysis.modes.articulated import Articulated
from hrsynth.analysis.modes.curves import Circle, Curve, Line, Point
from hrsynth.analysis.modes.planar import Planar
from hrsynth.analysis.modes.spatial import Spatial
from hrsynth.analysis.modes.systems import System
from hrsynth.analysis.modes.translating import Translating
from hrsynth.mechanism.vectors import Array, pose, rotation_about, unit
from strategies import random_rotation

Rng = np.random.Generator


class Draw(NamedTuple):
    """A system, and the pose (4, 4) through which its curves were laid."""

    system: System
    goal: Array


def through(rng: Rng, kind: str, tip: Array, normal: Array | None = None) -> Curve:
    """A point P, line L or circle C through ``tip``, in the plane of ``normal`` where one is given."""
    if kind == "P":
        return Point(tip)
    drawn = unit(rng.normal(size=3))
    if kind == "L":
        along = drawn if normal is None else unit(np.cross(normal, drawn))
        return Line(tip - along * rng.normal(), along)
    axis = drawn if normal is None else normal
    spoke = unit(np.cross(axis, rng.normal(size=3)))
    radius = rng.uniform(0.3, 1.5)
    return Circle(tip - radius * spoke, axis, radius)


def planar(rng: Rng, kinds: str) -> Draw:
    X = pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(scale=0.6, size=(len(kinds), 2))
    goal = X @ pose((*rng.normal(size=2), 0.0), rotation_about((0, 0, 1), rng.uniform(-3, 3)))
    curves = [through(rng, kind, goal[:3, 3] + goal[:3, :2] @ tip, X[:3, 2])
              for kind, tip in zip(kinds, tips, strict=True)]
    return Draw(Planar(tuple(curves), tips, X), goal)


def spatial(rng: Rng, kinds: str) -> Draw:
    goal = pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(scale=0.6, size=(len(kinds), 3))
    curves = [through(rng, kind, goal[:3, 3] + goal[:3, :3] @ tip) for kind, tip in zip(kinds, tips, strict=True)]
    return Draw(Spatial(tuple(curves), tips), goal)


def translating(rng: Rng, kinds: str, in_plane: bool = False) -> Draw:
    """With ``in_plane`` the paths of p lie in one plane."""
    p, n = rng.normal(size=3), unit(rng.normal(size=3))
    tips = rng.normal(scale=0.6, size=(len(kinds), 3))
    curves = [through(rng, kind, p + tip, n if in_plane else None) for kind, tip in zip(kinds, tips, strict=True)]
    return Draw(Translating(tuple(curves), tips), pose(p))


def articulated(rng: Rng, kinds: str, parallel: tuple[int, ...] = ()) -> Draw:
    """One leg on each body; the circles ``parallel`` (0 and 1 the legs', 2 the slide) lie in parallel planes."""
    p = rng.normal(size=3)
    tips = rng.normal(scale=0.4, size=(len(kinds), 3))
    normals = [unit(rng.normal(size=3)) for _ in range(3)]
    for k in parallel:
        normals[k] = normals[parallel[0]]
    slide = Circle(rng.normal(scale=0.1, size=3), normals[2], rng.uniform(0.3, 1.5))
    at = [p + tips[0], p + slide.at(rng.uniform(-3, 3)) + tips[1]]
    curves = [through(rng, kind, tip, n if kind == "C" else None)
              for kind, tip, n in zip(kinds, at, normals, strict=False)]
    return Draw(Articulated(tuple(curves), tips, (0, 1), slide), pose(p))


class Family(NamedTuple):
    """How to draw a member, and how many complex modes each has."""

    draw: Callable[[Rng], Draw]
    count: int


FAMILIES = {
    "planar, three circles": Family(lambda rng: planar(rng, "CCC"), 6),
    "planar, two circles and a line": Family(lambda rng: planar(rng, "CLC"), 6),
    "planar, a circle and two lines": Family(lambda rng: planar(rng, "LCL"), 4),
    "planar, three lines": Family(lambda rng: planar(rng, "LLL"), 2),
    "planar, a pivot and a circle": Family(lambda rng: planar(rng, "PC"), 2),
    "planar, a pivot and a line": Family(lambda rng: planar(rng, "PL"), 2),
    "spatial, three lines": Family(lambda rng: spatial(rng, "LLL"), 8),
    "spatial, two lines and a circle": Family(lambda rng: spatial(rng, "LCL"), 12),
    "spatial, two circles and a line": Family(lambda rng: spatial(rng, "CCL"), 16),
    "spatial, three circles": Family(lambda rng: spatial(rng, "CCC"), 16),
    "two circles of one plane": Family(lambda rng: translating(rng, "CC", True), 2),
    "a circle and a line of one plane": Family(lambda rng: translating(rng, "CL", True), 2),
    "two lines of one plane": Family(lambda rng: translating(rng, "LL", True), 1),
    "two bodies, circles": Family(lambda rng: articulated(rng, "CC"), 8),
    "two bodies, first circle and slide parallel": Family(lambda rng: articulated(rng, "CC", (0, 2)), 4),
    "two bodies, second circle and slide parallel": Family(lambda rng: articulated(rng, "CC", (1, 2)), 4),
    "two bodies, circles parallel": Family(lambda rng: articulated(rng, "CC", (0, 1)), 4),
    "two bodies, a line and a circle": Family(lambda rng: articulated(rng, "LC"), 4),
    "two bodies, lines": Family(lambda rng: articulated(rng, "LL"), 2),
}
