"""A servo run → an animation (GIF): what a camera sees that watches the legs, over what it is to see."""

from __future__ import annotations

import io

import numpy as np

from ..geometry.vectors import Array, inverse
from ..simulation.camera import Camera, Cylinder, cylinders, facing, seen
from ..simulation.mockup import rods as rods_of
from ..simulation.pictures import GREY, LegRenderer
from ..simulation.result import Servo

FRAMES, PAUSE = 50, 12
"""Pictures of the run, and how often the last one is shown on."""
MILLISECONDS = 80
"""How long each picture is shown."""
SCALE = 2
"""The picture is this much smaller than the camera's."""
ELEVATION = 0.3
"""How far down the camera looks (rad)."""
WANTED = 0.45
"""How bright what the camera is to see is beneath what it sees."""


def animation(found: Servo) -> bytes:
    """The run as GIF, at equal parts of its way; raises ``MissingExtra``, ``NotRendered``."""
    from PIL import Image

    setting, configurations = found.setting, found.run.configurations
    question = setting.samples.question
    rods = cylinders(setting.mechanism, question.observations)
    stage = LegRenderer(setting.mechanism, _camera(found), question.reference, rods)
    wanted = _lit(stage.picture(found.target.pose))
    frames = []
    for number in _moments(np.array([at.pose(setting.motion.link)[:3, 3] for at in configurations]), found.errors):
        seen = _lit(stage.picture(configurations[number].pose))
        paper = np.where(_bare(wanted)[..., None], 1.0, 1.0 - WANTED * (1.0 - wanted))
        frame = np.where(_bare(seen)[..., None], paper, seen)
        image = Image.fromarray((255 * frame).astype(np.uint8))
        frames.append(image.resize((image.width // SCALE, image.height // SCALE)).quantize(64))
    stream = io.BytesIO()
    frames[0].save(stream, "GIF", save_all=True, append_images=[*frames[1:], *[frames[-1]] * PAUSE], loop=0,
                   duration=MILLISECONDS, optimize=True)
    return stream.getvalue()


def _camera(found: Servo) -> Camera:
    """A camera that has the whole robot in its picture at both ends of the run, from above its side."""
    mechanism, reference = found.setting.mechanism, found.setting.samples.question.reference
    links = []
    for link in set(mechanism.links) - {mechanism.base}:
        X = inverse(mechanism.links[link].pose)
        links += [Cylinder(link, np.array(ends) @ X[:3, :3].T + X[:3, 3], 0.0) for ends in rods_of(mechanism, link)]
    configurations = (*found.run.configurations[:: max(1, len(found.run.configurations) // 5)], found.target)
    points = np.array([seen(links, reference, at.pose) for at in configurations])
    ahead = np.array([np.cos(ELEVATION), 0.0, -np.sin(ELEVATION)])
    return facing(points, ahead, np.array([0.0, -1.0, 0.0]))


def _moments(places: Array, errors: Array) -> list[int]:
    """Numbers of configurations that cut the way into equal parts, what moves the platform and what turns the legs
    counted alike."""
    ways = [np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
            for values in (places, errors)]
    way = sum(each / each[-1] for each in ways if each[-1] > 0) + np.linspace(0.0, 1e-6, len(places))
    return [int(i) for i in np.searchsorted(way, np.linspace(0.0, way[-1], FRAMES)).clip(0, len(places) - 1)]


def _lit(picture: Array) -> Array:
    """A picture on black, 0 to 255, as colours between 0 and 1, what is dark grey made lighter."""
    bright = picture / 255.0
    grey = (np.ptp(bright, axis=2) < 0.05) & (bright.max(axis=2) > 0.5 * GREY)
    return np.where(grey[..., None], 0.6 + 0.0 * bright, bright)


def _bare(colours: Array) -> Array:
    """Where nothing is."""
    return np.asarray(colours.max(axis=2) < 0.5 * GREY)
