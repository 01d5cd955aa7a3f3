"""Random platforms with their tips on random curves through a random pose: one mode is known beforehand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hrsynth.geometry.loci import Circle, Line, Plane, Point, Reach, Sphere
from hrsynth.geometry.vectors import Array, build_pose, normalise_vector, rotate_about_axis
from hrsynth.solving.platform.rigid import Planar, Spatial
from hrsynth.solving.platform.translating import ArticulatedPlatform, TranslatingPlatform
from strategies import random_rotation

Rng = np.random.Generator


class Draw(NamedTuple):
    """A system, and the pose (4, 4) through which its curves were laid."""

    system: Any
    """A system of equations, of the kind that its maker names."""
    goal: Array


def through(rng: Rng, kind: str, tip: Array, normal: Array | None = None) -> Reach:
    """A point P, line L or circle C through ``tip``, in the plane of ``normal`` where one is given; a sphere S or a
    plane E through it."""
    if kind == "P":
        return Point(tip)
    drawn = normalise_vector(rng.normal(size=3))
    if kind == "S":
        radius = rng.uniform(0.5, 1.5)
        return Sphere(tip - radius * drawn, radius)
    if kind == "E":
        return Plane(tip + np.cross(drawn, rng.normal(size=3)), drawn)
    if kind == "L":
        along = drawn if normal is None else normalise_vector(np.cross(normal, drawn))
        return Line(tip - along * rng.normal(), along)
    axis = drawn if normal is None else normal
    spoke = normalise_vector(np.cross(axis, rng.normal(size=3)))
    radius = rng.uniform(0.3, 1.5)
    return Circle(tip - radius * spoke, axis, radius)


def planar(rng: Rng, kinds: str) -> Draw:
    X = build_pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(scale=0.6, size=(len(kinds), 2))
    goal = X @ build_pose((*rng.normal(size=2), 0.0), rotate_about_axis((0, 0, 1), rng.uniform(-3, 3)))
    curves = [
        through(rng, kind, goal[:3, 3] + goal[:3, :2] @ tip, X[:3, 2]) for kind, tip in zip(kinds, tips, strict=True)
    ]
    return Draw(Planar(tuple(curves), tips, X), goal)


def spatial(rng: Rng, kinds: str) -> Draw:
    goal = build_pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(scale=0.6, size=(len(kinds), 3))
    curves = [through(rng, kind, goal[:3, 3] + goal[:3, :3] @ tip) for kind, tip in zip(kinds, tips, strict=True)]
    return Draw(Spatial(tuple(curves), tips), goal)


def translating(rng: Rng, kinds: str, in_plane: bool = False) -> Draw:
    """With ``in_plane`` the paths of p lie in one plane."""
    p, n = rng.normal(size=3), normalise_vector(rng.normal(size=3))
    tips = rng.normal(scale=0.6, size=(len(kinds), 3))
    curves = [through(rng, kind, p + tip, n if in_plane else None) for kind, tip in zip(kinds, tips, strict=True)]
    return Draw(TranslatingPlatform(tuple(curves), tips), build_pose(p))


def articulated(rng: Rng, kinds: str, parallel: tuple[int, ...] = ()) -> Draw:
    """One leg on each body; the circles ``parallel`` (0 and 1 the legs', 2 the slide) lie in parallel planes."""
    p = rng.normal(size=3)
    tips = rng.normal(scale=0.4, size=(len(kinds), 3))
    normals = [normalise_vector(rng.normal(size=3)) for _ in range(3)]
    for k in parallel:
        normals[k] = normals[parallel[0]]
    slide = Circle(rng.normal(scale=0.1, size=3), normals[2], rng.uniform(0.3, 1.5))
    at = [p + tips[0], p + slide.at(rng.uniform(-3, 3)) + tips[1]]
    curves = [
        through(rng, kind, tip, n if kind == "C" else None) for kind, tip, n in zip(kinds, at, normals, strict=False)
    ]
    return Draw(ArticulatedPlatform(tuple(curves), tips, (0, 1), slide), build_pose(p))


def on_two_bodies(rng: Rng, kinds: tuple[str, str], straight: bool = False) -> Draw:
    """The legs of each body; the bodies translate, the second on a circle about the first, or straight."""
    p = rng.normal(size=3)
    centre, axis = rng.normal(scale=0.1, size=3), normalise_vector(rng.normal(size=3))
    slide = Line(centre, axis) if straight else Circle(centre, axis, rng.uniform(0.3, 1.5))
    bodies = tuple(body for body in (0, 1) for _ in kinds[body])
    origins = np.array([p, p + slide.at(rng.uniform(-3, 3))])[list(bodies)]
    tips = rng.normal(scale=0.4, size=(len(bodies), 3))
    curves = [
        through(rng, kind, origin + tip) for kind, origin, tip in zip(kinds[0] + kinds[1], origins, tips, strict=True)
    ]
    return Draw(ArticulatedPlatform(tuple(curves), tips, bodies, slide), build_pose(p))


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
"""Tips on points, lines and circles."""

MEETING = {
    "three spheres": Family(lambda rng: translating(rng, "SSS"), 2),
    "two spheres and a plane": Family(lambda rng: translating(rng, "SES"), 2),
    "a sphere and two planes": Family(lambda rng: translating(rng, "EES"), 2),
    "three planes": Family(lambda rng: translating(rng, "EEE"), 1),
    "a circle and a sphere": Family(lambda rng: translating(rng, "SC"), 2),
    "a circle and a plane": Family(lambda rng: translating(rng, "CE"), 2),
    "a line and a sphere": Family(lambda rng: translating(rng, "LS"), 2),
    "a line and a plane": Family(lambda rng: translating(rng, "EL"), 1),
}
"""Platforms that translate, with tips on surfaces: solved by elimination."""

SURFACES = {
    "spatial, six spheres": Family(lambda rng: spatial(rng, "SSSSSS"), 40),
    "spatial, a line and four spheres": Family(lambda rng: spatial(rng, "LSSSS"), 28),
    "spatial, two circles and two spheres": Family(lambda rng: spatial(rng, "CCSS"), 32),
    "spatial, three planes and three spheres": Family(lambda rng: spatial(rng, "EEESSS"), 40),
    "spatial, six planes": Family(lambda rng: spatial(rng, "EEEEEE"), 8),
    "spatial, a pivot and three spheres": Family(lambda rng: spatial(rng, "PSSS"), 8),
    "two bodies, four spheres": Family(lambda rng: on_two_bodies(rng, ("SS", "SS")), 8),
    "two bodies, three spheres on one": Family(lambda rng: on_two_bodies(rng, ("SSS", "S")), 4),
    "two bodies, planes and spheres": Family(lambda rng: on_two_bodies(rng, ("ES", "SE")), 8),
    "two bodies on a slide, four spheres": Family(lambda rng: on_two_bodies(rng, ("SS", "SS"), True), 4),
    "two bodies on a slide, three spheres on one": Family(lambda rng: on_two_bodies(rng, ("SSS", "S"), True), 4),
    "two bodies, a circle and two spheres": Family(lambda rng: on_two_bodies(rng, ("C", "SS")), 8),
}
"""Tips on surfaces that only msolve solves."""


def six_rods(rng: Rng, platform: str, base: str, noise: float = 0.0) -> Draw:
    """Six rods between balls; rods with the same letter share one, but for ``noise``."""
    goal = build_pose(rng.normal(size=3), random_rotation(rng))
    sides = [scale * rng.normal(size=(6, 3)) for scale in (1.0, 2.0)]
    tips, centres = (
        np.array([side["ABCDEF".index(letter)] for letter in letters]) + noise * rng.normal(size=(6, 3))
        for side, letters in zip(sides, (platform, base), strict=True)
    )
    at = goal[:3, 3] + tips @ goal[:3, :3].T
    spheres = tuple(Sphere(c, float(np.linalg.norm(tip - c))) for tip, c in zip(at, centres, strict=True))
    return Draw(Spatial(spheres, tips), goal)


DIETMAIER = (
    (
        (0, 0, 0),
        (1.107915, 0, 0),
        (0.549094, 0.756063, 0),
        (0.735077, -0.223935, 0.525991),
        (0.514188, -0.526063, -0.368418),
        (0.590473, 0.094733, -0.205018),
    ),
    (
        (0, 0, 0),
        (0.542805, 0, 0),
        (0.956919, -0.528915, 0),
        (0.665885, -0.353482, 1.402538),
        (0.478359, 1.158742, 0.107672),
        (-0.137087, -0.235121, 0.353913),
    ),
    (1, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071),
)
"""Balls of the base, of the platform, and lengths (P. Dietmaier, Advances in Robot Kinematics, 1998)."""


def dietmaier() -> Spatial:
    base, platform, lengths = DIETMAIER
    return Spatial(tuple(Sphere(a, d) for a, d in zip(base, lengths, strict=True)), np.array(platform, dtype=float))
