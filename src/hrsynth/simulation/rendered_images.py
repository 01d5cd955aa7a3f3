"""Rendered images of the legs, and directions computed from the edges that OpenCV finds in them."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

from ..description.simulator_models import load_mujoco
from ..errors import MissingExtra, RenderFailure
from ..geometry.vectors import Array, invert_pose, normalise_vector
from ..mechanism import Mechanism
from .camera import Camera, Cylinder, rebuilt
from .law import Measures, Poses
from .mujoco_model import MUJOCO_ROD_RADIUS_FRACTION, rods
from .noise import NOISE_PERIOD_S

IMAGE_OVERSAMPLING_COUNT = 3
"""Rendered pixels per pixel and direction for edge detection."""

COLOURS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]], dtype=float)
"""Colours of the observed legs, on black; the others are dark grey."""
LINK_GREY_FRACTION = 0.12
LEG_COLOUR_TOL = 60.0
"""Largest distance (of 255) of a pixel from the colours between black and a leg's to count as that leg's."""
BACKGROUND_LIGHTNESS_MAX = 8.0
"""Lightness (of 255) below which nothing is there."""
LEG_EDGE_LENGTH_FRACTION = 0.8
"""Part of a leg's length, from its middle, whose edges are used."""
EDGE_SEARCH_PIXELS_COUNT = 3.0
"""Pixels on both sides of an edge between which it is placed."""


def vision() -> Any:
    """Return the module cv2; raises ``MissingExtra`` if it is not installed."""
    try:
        import cv2
    except ImportError:
        raise MissingExtra("finding edges in images", "bench") from None
    return cv2


def drawing() -> Any:
    """Return the module mujoco; raises ``MissingExtra`` if it is not installed, ``RenderFailure`` if it was imported so
    that it draws on a screen and there is none: MuJoCo would end the process."""
    mujoco = load_mujoco("rendering images")
    on_screen = sys.platform == "linux" and mujoco.GLContext.__module__.startswith("mujoco.glfw")
    if on_screen and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RenderFailure("MuJoCo draws with GLFW and there is no screen")
    return mujoco


@dataclass(frozen=True, eq=False)
class LegRenderer:
    """Renderer of the robot's rods before a camera, at given link poses."""

    mechanism: Mechanism
    camera: Camera
    reference: str
    rods: tuple[Cylinder, ...]
    fineness: int = 1
    """Drawn pixels a pixel each way."""

    @cached_property
    def _links(self) -> tuple[str, ...]:
        """Drawn links: all but the base."""
        return tuple(link for link in self.mechanism.links if link != self.mechanism.base)

    @cached_property
    def _model(self) -> Any:
        camera, radius = self.camera, MUJOCO_ROD_RADIUS_FRACTION * self.mechanism.length
        root = Xml.Element("mujoco")
        fov = np.degrees(2 * np.arctan(camera.height / 2 / camera.focal))
        visual = Xml.SubElement(root, "visual")
        Xml.SubElement(
            visual,
            "global",
            offwidth=str(IMAGE_OVERSAMPLING_COUNT * camera.width),
            offheight=str(IMAGE_OVERSAMPLING_COUNT * camera.height),
        )
        Xml.SubElement(visual, "map", znear=str(0.02))
        Xml.SubElement(visual, "quality", offsamples="8")
        Xml.SubElement(visual, "headlight", ambient="1 1 1", diffuse="0 0 0", specular="0 0 0")
        world = Xml.SubElement(root, "worldbody")
        for link in self._links:
            body = Xml.SubElement(world, "body", name=link, mocap="true")
            X = invert_pose(self.mechanism.links[link].pose)
            drawn = [
                (ends @ X[:3, :3].T + X[:3, 3], LINK_GREY_FRACTION * np.ones(3))
                for ends in map(np.array, rods(self.mechanism, link))
            ]
            watched = [(rod.ends, COLOURS[i % len(COLOURS)]) for i, rod in enumerate(self.rods) if rod.link == link]
            for ends, colour in watched or drawn:
                Xml.SubElement(
                    body,
                    "geom",
                    type="cylinder",
                    size=f"{radius}",
                    contype="0",
                    conaffinity="0",
                    fromto=_text(ends),
                    rgba=_text([*colour, 1]),
                )
        Xml.SubElement(
            Xml.SubElement(world, "body", name="camera__", mocap="true"), "camera", name="camera__", fovy=str(fov)
        )
        return drawing().MjModel.from_xml_string(Xml.tostring(root, encoding="unicode"))

    @cached_property
    def _renderer(self) -> Any:
        mujoco = drawing()
        try:
            renderer = mujoco.Renderer(
                self._model, self.fineness * self.camera.height, self.fineness * self.camera.width
            )
        except (mujoco.FatalError, RuntimeError, AttributeError) as error:
            raise RenderFailure(str(error)) from None
        return mujoco.MjData(self._model), renderer

    def picture(self, poses: Poses) -> Array:
        """Return the image (height, width, 3), 0 to 255, with the links at their poses; raises ``RenderFailure``."""
        mujoco = drawing()
        data, renderer = self._renderer
        for link in self._links:
            self._put(data, link, poses(link))
        eye = poses(self.reference) @ self.camera.place
        eye[:3, :3] = eye[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        self._put(data, "camera__", eye)
        mujoco.mj_forward(self._model, data)
        renderer.update_scene(data, camera="camera__")
        fine = np.asarray(renderer.render(), dtype=float)
        return fine.reshape(self.camera.height, self.fineness, self.camera.width, self.fineness, 3).mean(axis=(1, 3))

    @cached_property
    def finer(self) -> LegRenderer:
        """Return a renderer with pixels fine enough for edge detection."""
        return replace(self, fineness=IMAGE_OVERSAMPLING_COUNT)

    def _put(self, data: Any, name: str, X: Array) -> None:
        mujoco = drawing()
        body = self._model.body(name).mocapid[0]
        data.mocap_pos[body] = X[:3, 3]
        mujoco.mju_mat2Quat(data.mocap_quat[body], np.ascontiguousarray(X[:3, :3]).ravel())


@dataclass(frozen=True, eq=False)
class RenderedImages:
    """Directions computed from rendered images, one each ``noise.NOISE_PERIOD_S``; in between their errors are
    constant."""

    stage: LegRenderer
    _held: dict[int, Array] = field(default_factory=dict)

    def __call__(self, time: float, poses: Poses, values: Measures) -> Array:
        """The measured directions (k, 3) in the reference link's frame; a leg of which too little is seen keeps its
        true one."""
        directions = np.array(values)
        sample = int(time / NOISE_PERIOD_S + 1e-9)
        if sample not in self._held:
            self._held[sample] = self._measure(poses, directions) - directions
        moved = directions + self._held[sample]
        return np.asarray(moved / np.linalg.norm(moved, axis=1, keepdims=True))

    def _measure(self, poses: Poses, directions: Array) -> Array:
        picture = self.stage.finer.picture(poses)
        found = directions.copy()
        for number in range(len(self.stage.rods)):
            cover = shade(picture, COLOURS[number % len(COLOURS)])
            normals = outlines(cover, picture.max(axis=2), self.stage.camera)
            if normals is not None:
                u = self.stage.camera.place[:3, :3] @ rebuilt(*normals)
                found[number] = u if u @ directions[number] > 0 else -u
        return found


def shade(picture: Array, colour: Array) -> Array:
    """Return the coverage of each pixel by a leg of a colour, 0 to 255, (height, width); 0 for other colours."""
    cover = picture @ colour / float(colour @ colour)
    other = np.linalg.norm(picture - cover[..., None] * colour, axis=2)
    return np.where(other < LEG_COLOUR_TOL, cover, 0.0)


def outlines(cover: Array, light: Array, camera: Camera) -> tuple[Array, Array] | None:
    """Return the unit normals of the planes of a leg's two edges, the leg on their negative side, from its coverage and
    the image's brightness; None if too little of it is in the image. Only edges beside black count: others may be those
    of a link before it."""
    cv2 = vision()
    grey = np.clip(cover, 0, 255).astype(np.uint8)
    rows, columns = np.nonzero(grey > 127)
    if len(rows) < 50:
        return None
    inside = np.column_stack([columns, rows]).astype(float)
    middle = inside.mean(axis=0)
    along = np.linalg.svd(inside - middle, full_matrices=False)[2][0]
    across = np.array([-along[1], along[0]])
    rows, columns = np.nonzero(cv2.Canny(grey, 60, 180))
    border = np.column_stack([columns, rows]).astype(float) - middle
    longest = LEG_EDGE_LENGTH_FRACTION * float(np.max(np.abs((inside - middle) @ along)))
    centre = camera.ray(middle + 0.5)
    normals = []
    for side in (1.0, -1.0):
        points = border[(np.abs(border @ along) < longest) & (side * (border @ across) > 0)] + middle
        points = _place_edge(cover, light, points, side * across)
        if len(points) < 20:
            return None
        vx, vy, x, y = cv2.fitLine(points.astype(np.float32), cv2.DIST_HUBER, 0, 0.001, 0.001).ravel()
        ends = [camera.ray(np.array([x + t * vx + 0.5, y + t * vy + 0.5])) for t in (-longest, longest)]
        normal = normalise_vector(np.cross(ends[0], ends[1]))
        normals.append(normal if normal @ centre < 0 else -normal)
    return normals[0], normals[1]


def _place_edge(cover: Array, light: Array, points: Array, outwards: Array) -> Array:
    """Edge points (n, 2) moved along the outward normal to where half of a pixel is covered; those without such a
    place, or with something else beside it, are left out."""
    cv2 = vision()
    steps = np.arange(-EDGE_SEARCH_PIXELS_COUNT, EDGE_SEARCH_PIXELS_COUNT + 0.25, 0.25)
    places = points[:, None, :] + steps[None, :, None] * outwards
    maps = places.astype(np.float32)
    values = cv2.remap(cover.astype(np.float32), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR)
    falls = (values[:, :-1] >= 127.5) & (values[:, 1:] < 127.5)
    beside = cv2.remap(light.astype(np.float32), maps[:, -1:, 0], maps[:, -1:, 1], cv2.INTER_LINEAR)[:, 0]
    kept = (falls.sum(axis=1) == 1) & (beside < BACKGROUND_LIGHTNESS_MAX)
    first = np.argmax(falls, axis=1)[kept]
    number = np.nonzero(kept)[0]
    high, low = values[number, first], values[number, first + 1]
    at = steps[first] + 0.25 * (high - 127.5) / (high - low)
    return np.asarray(points[kept] + at[:, None] * outwards)


def _text(values: object) -> str:
    return " ".join(f"{float(value):.12g}" for value in np.ravel(np.asarray(values)))
