"""Pinhole camera that images legs as cylinders: their edges, and the directions computed from them (MMT 2.1-2.2).

In the camera's frame x points right, y down and z ahead. An axis through P with direction u has the unit normal h of
its interpretation plane and the distance h from the camera: h h = P × u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import Array, build_pose, find_perpendicular, invert_pose, normalise_vector, transform
from ..mechanism import Mechanism
from ..mechanism.observation import Observation
from ..mechanism.observations.direction import Direction
from ..results import Value
from ..tolerances import SLOPE_STEP_MAX
from .law import Measures, Poses
from .mujoco_model import MUJOCO_ROD_RADIUS_FRACTION
from .noise import NoiseSamples

CAMERA_PLACES_COUNT = 200
"""Camera positions around the legs that are tried."""
IMAGE_USABLE_FRACTION = 0.85
"""Fraction of the image, from its centre, in which all legs must lie."""
SHORTEST, HALF = 0.05, 0.25
"""Rods shorter than this part of the robot's length are drawn with this half-length instead."""


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(Value):
    """Cylinder of an observed direction: ends in its link's frame (2, 3), the second ahead along it, radius (m)."""

    link: str
    ends: Array
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class Camera(Value):
    """Intrinsics (focal length, width and height in pixels, the centre in the middle) and the pose (4, 4) of the
    camera in the frame of the link that carries it."""

    place: Array
    focal: float = 800.0
    width: int = 640
    height: int = 480

    def project(self, X_reference: Array, poses: Poses, rod: Cylinder) -> Array:
        """Return the ends of a rod in the camera's frame, (2, 3)."""
        X = invert_pose(X_reference @ self.place) @ poses(rod.link)
        return np.asarray(rod.ends @ X[:3, :3].T + X[:3, 3])

    def pixels(self, points: Array) -> Array:
        """Return the image coordinates (n, 2) of points (n, 3) in the camera frame."""
        return self.focal * points[:, :2] / points[:, 2:] + np.array([self.width, self.height]) / 2

    def ray(self, pixel: Array) -> Array:
        """Return the ray (3,), z = 1, through an image point (2,)."""
        return np.array([*(pixel - np.array([self.width, self.height]) / 2) / self.focal, 1.0])


def edges(ends: Array, radius: float) -> tuple[Array, Array]:
    """Return the unit normals (3,) of the two camera planes tangent to a cylinder whose axis has the ends (2, 3)
    (eqs. 3-4); raises ``BadRequest`` if the camera is inside of it."""
    u = normalise_vector(ends[1] - ends[0])
    moment = np.cross(ends[0], u)
    distance = float(np.linalg.norm(moment))
    if distance <= radius:
        raise BadRequest(
            "the camera is inside a leg or looks along it: distance from its axis (m)",
            distance,
            f"more than its radius {radius:.4g}",
        )
    h = moment / distance
    sine = radius / distance
    cosine = np.sqrt(1 - sine**2)
    across = np.cross(u, h)
    return -cosine * h - sine * across, cosine * h - sine * across


def rebuilt(first: Array, second: Array) -> Array:
    """Return the direction (3,) of a cylinder from the normals of its two edges (eq. 5); singular if they coincide."""
    return normalise_vector(np.cross(first, second))


def cylinders(mechanism: Mechanism, observations: Sequence[Observation]) -> tuple[Cylinder, ...]:
    """Return the rods of observed directions, as long as the distance of their joints."""
    found = []
    for observation in observations:
        assert isinstance(observation, Direction)
        X = invert_pose(mechanism.links[observation.link].pose)
        centres = np.array([transform(X, joint.point) for joint in mechanism.joints_of(observation.link)])
        along = (centres - centres[0]) @ observation.direction
        low, high = float(along.min()), float(along.max())
        if high - low < SHORTEST * mechanism.length:
            low, high = -HALF * mechanism.length, HALF * mechanism.length
        ends = centres[0] + np.outer([low, high], observation.direction)
        found.append(Cylinder(observation.link, ends, MUJOCO_ROD_RADIUS_FRACTION * mechanism.length))
    return tuple(found)


@dataclass(frozen=True, eq=False, repr=False)
class Edges(Value):
    """Directions computed from the edges of the legs in the image. Each edge is given by two image points with errors
    of up to ``pixels`` across the edge."""

    camera: Camera
    reference: str
    rods: tuple[Cylinder, ...]
    pixels: float
    shocks: NoiseSamples

    def __call__(self, time: float, poses: Poses, directions: Measures) -> Array:
        """Return the measured directions (k, 3) in the reference link's frame."""
        shock = self.shocks.at(time) * self.pixels / self.camera.focal
        found = []
        for number, rod in enumerate(self.rods):
            ends = self.camera.project(poses(self.reference), poses, rod)
            normals = [
                _move_edge(normal, ends, shock[2 * number + side])
                for side, normal in enumerate(edges(ends, rod.radius))
            ]
            found.append(self.camera.place[:3, :3] @ rebuilt(*normals))
        return np.array(found)


def _move_edge(normal: Array, ends: Array, shift: Array) -> Array:
    """Return the normal of an edge whose image is moved across itself by ``shift`` (two numbers) at the rod's ends."""
    across = normalise_vector(np.array([normal[0], normal[1], 0.0]))
    points = []
    for end, by in zip(ends, shift, strict=False):
        image = end / end[2]
        level = image - (normal @ image) / (normal @ across) * across
        points.append(level + by * across)
    found = normalise_vector(np.cross(points[0], points[1]))
    return found if found @ normal > 0 else -found


def place_camera(
    rods: Sequence[Cylinder], reference: str, poses: Sequence[Poses], blank: Camera | None = None
) -> Camera:
    """Return a camera on the reference link whose image contains all rods at all given poses. Of the positions on a
    sphere around the rods it is the one at which pixel errors change the computed directions least."""
    ends = np.array([rods_in_frame(rods, reference, X) for X in poses])
    best, found = np.inf, Camera(np.eye(4))
    for ahead in _sphere(CAMERA_PLACES_COUNT):
        camera = facing(ends, ahead, find_perpendicular(ahead), blank)
        local = (ends - camera.place[:3, 3]) @ camera.place[:3, :3]
        score = max(sensitivity(segment, rod.radius) for each in local for segment, rod in zip(each, rods, strict=True))
        if score < best:
            best, found = score, camera
    return found


def rods_in_frame(rods: Sequence[Cylinder], reference: str, poses: Poses) -> Array:
    """Return the ends of rods (rods, 2, 3) in the frame of the reference link."""
    frames = [invert_pose(poses(reference)) @ poses(rod.link) for rod in rods]
    return np.array([rod.ends @ X[:3, :3].T + X[:3, 3] for rod, X in zip(rods, frames, strict=True)])


def facing(points: Array, ahead: Array, right: Array, blank: Camera | None = None) -> Camera:
    """Return the camera that looks along ``ahead`` from the distance at which its image contains all points (…, 3)."""
    blank = Camera(np.eye(4)) if blank is None else blank
    middle = points.reshape(-1, 3).mean(axis=0)
    R = np.column_stack([right, np.cross(ahead, right), ahead])
    local = (points - middle) @ R
    half = IMAGE_USABLE_FRACTION * np.array([blank.width, blank.height]) / 2 / blank.focal
    back = float(np.max(np.abs(local[..., :2]) / half - local[..., 2:]))
    return Camera(build_pose(middle - back * ahead, R), blank.focal, blank.width, blank.height)


def sensitivity(ends: Array, radius: float) -> float:
    """Return the largest rotation (rad) of a rod's computed direction per radian of error at the ends of its two edges;
    infinite if the camera is inside the rod."""
    try:
        normals = edges(ends, radius)
    except BadRequest:
        return float("inf")
    u, total = rebuilt(*normals), 0.0
    for side, end in product(range(2), repeat=2):
        wrong = list(normals)
        wrong[side] = _move_edge(normals[side], ends, SLOPE_STEP_MAX * np.eye(2)[end])
        total += float(np.linalg.norm(rebuilt(*wrong) - u)) / SLOPE_STEP_MAX
    return total


def _sphere(count: int) -> Array:
    """Directions spread evenly over the sphere, (count, 3)."""
    steps = np.arange(count) + 0.5
    z, turn = 1 - 2 * steps / count, np.pi * (1 + np.sqrt(5)) * steps
    level = np.sqrt(1 - z**2)
    return np.column_stack([level * np.cos(turn), level * np.sin(turn), z])
