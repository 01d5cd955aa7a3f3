"""Visibility of the legs in a camera: the fraction of each that lies in the image and is not hidden (MMT A.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import BadRequest
from ..geometry.vectors import Array, build_pose
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.pose import Pose
from ..results import Value
from ..simulation.camera import Camera, Cylinder

Flags = NDArray[np.bool_]
LEG_AXIS_POINTS_COUNT = 101
"""Points of a leg's axis that are looked at."""


@dataclass(frozen=True, eq=False, repr=False)
class CameraView(Value):
    """A camera carried by ``reference``, and the rods of all legs by their labels: those of the default segments."""

    camera: Camera
    reference: str
    rods: Mapping[str, Cylinder]

    def visible_parts(self, at: ClosedConfiguration) -> dict[str, float]:
        """Fraction (0 to 1) of each rod's axis that lies in the image and is not hidden by another rod."""
        X = at.pose(self.reference)
        ends = {leg: self.camera.project(X, at.pose, rod) for leg, rod in self.rods.items()}
        found = {}
        for leg, (first, last) in ends.items():
            points = first + np.linspace(0.0, 1.0, LEG_AXIS_POINTS_COUNT)[:, None] * (last - first)
            clear = self._in_picture(points)
            for other, segment in ends.items():
                if other != leg:
                    clear &= ~find_hidden_points(points, segment, self.rods[other].radius)
            found[leg] = float(clear.mean())
        return found

    def least(self, configurations: Sequence[ClosedConfiguration]) -> dict[str, float]:
        """The least part of each rod that is seen at some configurations."""
        found = [self.visible_parts(at) for at in configurations]
        return {leg: min(each[leg] for each in found) for leg in self.rods}

    def _in_picture(self, points: Array) -> Flags:
        """Mask (n,) of the points (n, 3) in the camera frame that lie in the image."""
        ahead = points[:, 2] > 0
        pixels = self.camera.pixels(np.where(ahead[:, None], points, 1.0))
        inside = np.all((pixels >= 0) & (pixels <= [self.camera.width, self.camera.height]), axis=1)
        return np.asarray(ahead & inside, dtype=bool)


def find_hidden_points(points: Array, segment: Array, radius: float) -> Flags:
    """Mask (n,) of the points (n, 3) that a cylinder about a segment (2, 3) hides from the origin: the ray to the point
    passes the segment nearer than ``radius``, before the point."""
    a, d = segment[0], segment[1] - segment[0]
    length = float(d @ d)
    square = np.sum(points * points, axis=1)
    along, across = points @ d, points @ a
    start = float(a @ d)
    level = square * length - along**2
    safe = np.where(level > 0, level, 1.0)
    s = np.where(level > 1e-12 * square * length, np.clip((across * length - along * start) / safe, 0.0, 1.0), 0.0)
    t = (s * along - start) / length
    t = np.clip(t, 0.0, 1.0)
    s = np.clip((across + t * along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    apart = np.linalg.norm(s[:, None] * points - (a + t[:, None] * d), axis=1)
    before = (1 - s) * np.sqrt(square) > radius
    return np.asarray((apart < radius) & before, dtype=bool)


def parse_camera_pose(text: str, focal: float) -> Camera:
    """Camera at a pose in the frame of the link that carries it: x right, y down, z ahead; 640 by 480 pixels, focal
    length in pixels. Raises ``BadRequest``."""
    blank = make_camera(focal)
    wanted = Pose.parse(text)
    if None in (wanted.x, wanted.y, wanted.z) or wanted.rotation is None:
        raise BadRequest(f"--visible-from {text}: the pose is incomplete", remedy="Give x, y, z and rpy, or auto.")
    return replace(
        blank, place=build_pose([float(wanted.x or 0), float(wanted.y or 0), float(wanted.z or 0)], wanted.rotation)
    )


def make_camera(focal: float) -> Camera:
    """A camera of a focal length in pixels, not placed; raises ``BadRequest``."""
    if not 0 < focal < np.inf:
        raise BadRequest("--focal (pixels)", focal, "a positive number")
    return Camera(np.eye(4), focal)
