"""Observations of a robot at a configuration, drawn in space and in the image of their camera; and the cameras."""

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
from .shapes import PAGE_DIGITS_COUNT

VIEW_HALF_LENGTH_FRACTION = 0.3
"""Half-length of observations without an extent (characteristic lengths)."""
IMAGE_EXTENT_FRACTION = 1.5
"""Size of an image over the extent of the observations at the zero configuration."""
CAMERA_PYRAMID_DEPTH_FRACTION = 0.15
"""Depth of the pyramid that represents a camera (characteristic lengths)."""


@dataclass(frozen=True, eq=False, repr=False)
class ShownSight(Value):
    """Observation or (without an image) camera as drawn: in the base frame, and in the image of the camera of this
    number."""

    name: str
    drawn: Drawn
    camera: int | None = None
    image: tuple[Array, ...] = ()

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        rounded = {
            key: [np.round(each, PAGE_DIGITS_COUNT).tolist() for each in every]
            for key, every in (("lines", self.drawn.lines), ("areas", self.drawn.areas), ("image", self.image))
        }
        return {"name": self.name, "camera": self.camera, **rounded}


def list_cameras(setup: ObservedRobot) -> list[NamedCamera]:
    """Return the cameras with an observation; if unnamed, the frame of the reference link."""
    found: dict[str, NamedCamera] = {}
    for seen in setup.observed:
        if isinstance(seen, CameraObservation):
            eye = seen.camera or NamedCamera(setup.mechanism.reference, seen.seen_from or setup.mechanism.reference)
            found.setdefault(eye.name, eye)
    return list(found.values())


def compute_half_image(camera: NamedCamera) -> Array:
    """Return half the width and height of a camera's image at z = 1; 90° if it has no size."""
    if camera.focal and camera.width and camera.height:
        return np.array([camera.width, camera.height]) / (2 * camera.focal)
    return np.ones(2)


def compute_image_frames(cameras: Sequence[NamedCamera], home: Sequence[ShownSight]) -> list[Array]:
    """Return :func:`compute_half_image` of each camera; one without a size shows all its observations at the zero
    configuration."""
    found = []
    for number, camera in enumerate(cameras):
        seen = [np.abs(stroke).max() for each in home if each.camera == number for stroke in each.image]
        sized = camera.focal and camera.width and camera.height
        found.append(
            compute_half_image(camera) if sized or not seen else np.full(2, min(1.0, IMAGE_EXTENT_FRACTION * max(seen)))
        )
    return found


def list_shown_observations(setup: ObservedRobot, at: ClosedConfiguration) -> tuple[ShownSight, ...]:
    """Return all observations but directions, which are arrows on their links, and the cameras."""
    found, every, length = [], list_cameras(setup), setup.mechanism.length
    for seen in setup.observed:
        if isinstance(seen, Direction):
            continue
        poses = at.pose(seen.seen_from or setup.mechanism.reference), at.pose(seen.link)
        eye = None
        if isinstance(seen, CameraObservation):
            name = seen.camera.name if seen.camera else setup.mechanism.reference
            eye = next(i for i, each in enumerate(every) if each.name == name)
        found.append(
            ShownSight(
                seen.leg,
                seen.draw(*poses, VIEW_HALF_LENGTH_FRACTION * length),
                eye,
                tuple(seen.image(*poses, VIEW_HALF_LENGTH_FRACTION * length)),
            )
        )
    return *found, *(
        ShownSight(
            eye.name,
            _draw_camera(at.pose(eye.link) @ eye.pose, compute_half_image(eye), CAMERA_PYRAMID_DEPTH_FRACTION * length),
        )
        for eye in every
    )


def _draw_camera(X: Array, half: Array, depth: float) -> Drawn:
    """Return the pyramid of a camera at X (4, 4)."""
    corners = depth * np.array([[x * half[0], y * half[1], 1] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    R, C = X[:3, :3], X[:3, 3]
    corners = corners @ R.T + C
    return Drawn((np.vstack([corners, corners[:1]]), *(np.array([C, corner]) for corner in corners)))
