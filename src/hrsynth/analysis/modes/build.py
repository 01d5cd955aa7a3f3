"""From tips on curves to the system whose solutions are the assembly modes, and back to the bodies of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.vectors import Array, inverse, perpendicular, pose
from .articulated import Articulated
from .curves import Reach
from .planar import Planar
from .spatial import Spatial
from .systems import System
from .tips import Confinement
from .translating import Translating


@dataclass(frozen=True, eq=False)
class Model:
    """The system of a confined platform; ``bodies`` gives the poses (4, 4) of the bodies on which legs end, in the base
    frame, at the system's coordinates; ``home`` are the coordinates of the goal itself."""

    system: System
    bodies: Callable[[Array], dict[str, Array]]
    home: Array


def model(confined: Confinement) -> Model:
    """The system for the way in which the platform moves."""
    made = {"translations": _translating, "planar": _planar, "spatial": _spatial,
            "bodies": _articulated}[confined.motion](confined)
    return replace(made, system=replace(made.system, error=confined.error, as_written=confined.as_written))


def _translating(confined: Confinement) -> Model:
    """q is the position of the first body's origin; tips are counted from there."""
    at = _poses(confined)
    p = at[confined.bodies[0]][:3, 3]
    tips = np.array([_point(at[tip.body], tip.place) - p for tip in confined.tips])

    def bodies(q: Array) -> dict[str, Array]:
        return {body: _moved(X, q - p) for body, X in at.items()}

    return Model(Translating(_curves(confined), tips), bodies, p)


def _planar(confined: Confinement) -> Model:
    """q is counted from the goal: the plane's frame lies at the first body's origin there."""
    assert confined.plane is not None
    at = _poses(confined)
    n = confined.plane
    first = perpendicular(n)
    X_plane = pose(at[confined.bodies[0]][:3, 3], np.column_stack([first, np.cross(n, first), n]))
    back = inverse(X_plane)
    tips = np.array([_point(back @ at[tip.body], tip.place)[:2] for tip in confined.tips])
    system = Planar(_curves(confined), tips, X_plane)

    def bodies(q: Array) -> dict[str, Array]:
        return {body: system.pose(q) @ back @ X for body, X in at.items()}

    return Model(system, bodies, np.zeros(3))


def _spatial(confined: Confinement) -> Model:
    """q is counted from the goal: the system's frame is the base's, moved to the first body's origin there."""
    at = _poses(confined)
    origin = pose(at[confined.bodies[0]][:3, 3])
    back = inverse(origin)
    tips = np.array([_point(back @ at[tip.body], tip.place) for tip in confined.tips])
    system = Spatial(_curves(confined), tips)

    def bodies(q: Array) -> dict[str, Array]:
        return {body: system.pose(q) @ back @ X for body, X in at.items()}

    return Model(system, bodies, np.array([*origin[:3, 3], 0.0, 0.0, 0.0]))


def _articulated(confined: Confinement) -> Model:
    """q is the first body's origin and the second's place on its circle about it."""
    assert confined.slide is not None
    at = _poses(confined)
    one, other = confined.bodies
    p, slide = at[one][:3, 3], confined.slide
    tips = np.array([_point(at[tip.body], tip.place) - at[tip.body][:3, 3] for tip in confined.tips])

    def bodies(q: Array) -> dict[str, Array]:
        first = q[:3] - p
        second = q[:3] + slide.at(float(q[3])) - at[other][:3, 3]
        return {one: _moved(at[one], first), other: _moved(at[other], second)}

    sides = tuple(confined.bodies.index(tip.body) for tip in confined.tips)
    return Model(Articulated(_curves(confined), tips, sides, slide), bodies, np.array([*p, 0.0]))


def _poses(confined: Confinement) -> dict[str, Array]:
    return {body: confined.goal.pose(body) for body in confined.bodies}


def _curves(confined: Confinement) -> tuple[Reach, ...]:
    return tuple(tip.curve for tip in confined.tips)


def _point(X: Array, place: Array) -> Array:
    """A body's point (3,) in the frame of its pose."""
    return np.asarray(X[:3, :3] @ place + X[:3, 3])


def _moved(X: Array, by: Array) -> Array:
    """A pose moved by a translation (3,)."""
    return pose(X[:3, 3] + by, X[:3, :3])
