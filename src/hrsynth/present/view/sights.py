"""What sensors see of a robot at a configuration: each kind of observation draws itself, in space and in the picture of
its camera; and the cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.observed import ObservedRobot
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.cameras import CameraObservation, NamedCamera
from ...mechanism.observation import Drawn
from ...mechanism.observations.direction import Direction
from ...results import Value
from .shapes import PAGE_DIGITS

REACH = 0.3
"""Half-length of what has none of its own (characteristic lengths)."""
ROOM = 1.5
"""How much more a picture shows than what is at home in it."""
CASE = 0.15
"""Depth of the pyramid that is drawn of a camera (characteristic lengths)."""


@dataclass(frozen=True, eq=False, repr=False)
class ShownSight(Value):
    """An observation or (without a picture) a camera as it is drawn: in the base frame, and in the picture of the
    camera of this number."""

    name: str
    drawn: Drawn
    camera: int | None = None
    image: tuple[Array, ...] = ()

    def scene(self) -> dict[str, Any]:
        """What the page is given."""
        rounded = {
            key: [np.round(each, PAGE_DIGITS).tolist() for each in every]
            for key, every in (("lines", self.drawn.lines), ("areas", self.drawn.areas), ("image", self.image))
        }
        return {"name": self.name, "camera": self.camera, **rounded}


def eyes(setup: ObservedRobot) -> list[NamedCamera]:
    """The cameras by which something is seen; where none is named, the reference link's frame."""
    found: dict[str, NamedCamera] = {}
    for seen in setup.observed:
        if isinstance(seen, CameraObservation):
            eye = seen.camera or NamedCamera(setup.mechanism.reference, seen.seen_from or setup.mechanism.reference)
            found.setdefault(eye.name, eye)
    return list(found.values())


def half_picture(camera: NamedCamera) -> Array:
    """Half the width and the height of a camera's picture at z = 1; of one without a size that of 90°."""
    if camera.focal and camera.width and camera.height:
        return np.array([camera.width, camera.height]) / (2 * camera.focal)
    return np.ones(2)


def frames(cameras: Sequence[NamedCamera], home: Sequence[ShownSight]) -> list[Array]:
    """:func:`half_picture` of each, but of a camera without a size what shows all that it sees at home."""
    found = []
    for number, camera in enumerate(cameras):
        seen = [np.abs(stroke).max() for each in home if each.camera == number for stroke in each.image]
        sized = camera.focal and camera.width and camera.height
        found.append(half_picture(camera) if sized or not seen else np.full(2, min(1.0, ROOM * max(seen))))
    return found


def shown_sights(setup: ObservedRobot, at: ClosedConfiguration) -> tuple[ShownSight, ...]:
    """All that is observed but directions, which are arrows on their links, and the cameras."""
    found, every, length = [], eyes(setup), setup.mechanism.length
    for seen in setup.observed:
        if isinstance(seen, Direction):
            continue
        poses = at.pose(seen.seen_from or setup.mechanism.reference), at.pose(seen.link)
        eye = None
        if isinstance(seen, CameraObservation):
            name = seen.camera.name if seen.camera else setup.mechanism.reference
            eye = next(i for i, each in enumerate(every) if each.name == name)
        found.append(
            ShownSight(seen.leg, seen.draw(*poses, REACH * length), eye, tuple(seen.image(*poses, REACH * length)))
        )
    return *found, *(
        ShownSight(eye.name, _case(at.pose(eye.link) @ eye.pose, half_picture(eye), CASE * length)) for eye in every
    )


def _case(X: Array, half: Array, depth: float) -> Drawn:
    """The pyramid of a camera at X (4, 4)."""
    corners = depth * np.array([[x * half[0], y * half[1], 1] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    R, C = X[:3, :3], X[:3, 3]
    corners = corners @ R.T + C
    return Drawn((np.vstack([corners, corners[:1]]), *(np.array([C, corner]) for corner in corners)))
