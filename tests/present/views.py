"""Views of robots, made once a session, and what their plain data say without Pinocchio."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np

from hrsynth import load, view
from hrsynth.mechanism import Joint, JointType, Mechanism
from hrsynth.present.studio.server import StudioServer, serve_view
from hrsynth.present.view.states import ViewState
from hrsynth.present.view.view import Machine, View

WATCHED = {"gough_stewart": "1,3,5", "quattro": "1,4"}
FIVE = ("rrrrr_m1", "3rrr_m1", "gough_stewart", "quattro", "uranesx")


@cache
def seen(name: str) -> View:
    """The view of a shipped robot with its hidden robot."""
    return view(load(name), WATCHED.get(name), hidden=True)


@contextmanager
def serving(found: View) -> Iterator[StudioServer]:
    """The server of a view."""
    server = serve_view(found, open_=False)
    yield server
    server.stop()


def mechanism_of(found: View, machine: Machine) -> Mechanism:
    """The mechanism that a machine draws."""
    if machine.key == "real":
        return found.setup.mechanism
    assert found.derivation is not None
    assert found.derivation.hidden is not None
    return found.derivation.hidden


def states(found: View) -> list[ViewState]:
    """All states that the page can show."""
    return [found.home, *(state for slider in found.sliders for state in slider.states)]


def turned(place: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (…, 3) turned by the unit quaternion of a place (7,)."""
    v, w = place[3:6], place[6]
    return vectors + 2 * np.cross(v, np.cross(v, vectors) + w * vectors)


def moved(place: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (…, 3) moved by a place (7,)."""
    return turned(place, points) + place[:3]


def miss(joint: Joint, one: np.ndarray, other: np.ndarray) -> float:
    """How far two links at their places (7,) are from being joined by a joint (metres and sines of angles)."""
    apart = moved(other, joint.point) - moved(one, joint.point)
    axes = [turned(one, axis) for axis in joint.axes]
    there = [turned(other, axis) for axis in joint.axes]
    size = np.linalg.norm
    if joint.type is JointType.SPHERICAL:
        return float(size(apart))
    if joint.type is JointType.UNIVERSAL:
        return float(max(size(apart), abs(axes[0] @ there[1])))
    if joint.type is JointType.REVOLUTE:
        return float(max(size(apart), size(np.cross(axes[0], there[0]))))
    if joint.type is JointType.CYLINDRICAL:
        return float(max(size(np.cross(axes[0], apart)), size(np.cross(axes[0], there[0]))))
    if joint.type is JointType.PLANAR:
        return float(max(abs(axes[0] @ apart), size(np.cross(axes[0], there[0]))))
    assert joint.type is JointType.PRISMATIC
    same = 1 - abs(float(one[3:] @ other[3:]))
    return float(max(size(np.cross(axes[0], apart)), np.sqrt(max(0.0, 2 * same))))
