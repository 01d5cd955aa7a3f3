"""Animation of a servo run (GIF, 1280 × 720): the camera image of the observed legs over that at the goal, captions and
curves."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..analysis.observed import ObservedRobot
from ..errors import BadRequest
from ..geometry.vectors import Array, invert_pose
from ..progress import report
from ..simulation.camera import Camera, Cylinder, cylinders, facing, rods_in_frame
from ..simulation.crossings import TYPE_2
from ..simulation.mujoco_model import rods as rods_of
from ..simulation.rendered_images import LINK_GREY_FRACTION, LegRenderer
from ..simulation.result import Servo
from . import palette
from .plots import describe_pose, in_style, make_empty_figure
from .runs import DRAWN_ERROR_MIN_FRACTION, DRAWN_ROTATION_DEGREES_MIN, ENDS, find_end_time
from .text.tables import name_all

FRAMES, PAUSE = 50, 12
"""Frames of the run, and repetitions of the last one."""
FRAME_MILLISECONDS_COUNT = 80
"""Duration of a frame."""
WIDTH, HEIGHT, SIDE, DOTS = 1280, 720, 440, 100
"""Pixels of the animation, of the captions beside the camera image, and an inch."""
ANIMATION_FOCAL_WIDTH_FRACTION = 1.25
"""Focal length of the camera over the width of its image."""
CAMERA_ELEVATION_RAD = 0.3
"""Downward angle of the camera (rad)."""
DESIRED_IMAGE_BRIGHTNESS_FRACTION = 0.45
"""Brightness of the image at the goal below the present one."""
CROSSING_CAPTION_FRAMES_COUNT = 3
"""Frames during which a crossing is captioned."""
GIF_COLOURS_COUNT = 32
"""Colours of the file."""
WATCHED = np.array([int(palette.get_colour("observed")[i : i + 2], 16) / 255 for i in (1, 3, 5)])
CAPTION_LINE_CHARACTERS_MAX = 36
"""Letters of a line of words."""


@in_style
def draw_animation(found: Servo) -> bytes:
    """Draw the run as GIF, at equal parts of its path; raise ``MissingExtra``, ``RenderFailure``."""
    from PIL import Image

    setup, configurations = found.setup, found.run.configurations
    require_legs(setup)
    question = setup.samples.observation_model
    stage = LegRenderer(
        setup.mechanism, _place_camera(found), question.reference, cylinders(setup.mechanism, question.observations)
    )
    wanted = _convert_to_light(stage.picture(found.target.pose))
    paper = np.where(_find_background(wanted)[..., None], 1.0, 1.0 - DESIRED_IMAGE_BRIGHTNESS_FRACTION * (1.0 - wanted))
    sheet = Sheet(found)
    frames = list[Any]()
    moments = _choose_moments(np.array([at.pose(setup.motion.link)[:3, 3] for at in configurations]), found.errors)
    for number, words in zip(moments, list_captions(found, moments), strict=True):
        report("frames", len(frames) + 1, len(moments))
        seen = _convert_to_light(stage.picture(configurations[number].pose))
        frame = sheet.at(number, words)
        frame[:, : seen.shape[1]] = frame[:, : seen.shape[1]] * np.where(_find_background(seen)[..., None], paper, seen)
        frames.append(Image.fromarray(frame).quantize(GIF_COLOURS_COUNT, dither=Image.Dither.NONE))
    stream = io.BytesIO()
    frames[0].save(
        stream,
        "GIF",
        save_all=True,
        append_images=[*frames[1:], *[frames[-1]] * PAUSE],
        loop=0,
        duration=FRAME_MILLISECONDS_COUNT,
        optimize=True,
    )
    return stream.getvalue()


def require_legs(setup: ObservedRobot, **_: Any) -> None:
    """Raise ``BadRequest`` if others than legs are observed."""
    for each in setup.observed:
        if not each.is_segment_direction:
            raise BadRequest(
                f"{setup.robot.name}: an animation shows observed legs only",
                each.text,
                remedy="Write a figure (.png, .pdf, .svg), which shows all kinds.",
            )


def list_captions(found: Servo, moments: list[int]) -> Iterator[str]:
    """Yield a caption for each of the moments (numbers of configurations, the last one the end)."""
    sizes = found.errors.max(axis=1)
    metres, radians = found.from_goal
    passages = found.track.passages or ()
    for k, number in enumerate(moments):
        since = moments[max(0, k - CROSSING_CAPTION_FRAMES_COUNT)]
        passed = [each for each in passages if since < each.place <= number]
        if k == 0:
            yield "Start. Pale: observed legs at the goal. Bright: observed legs now."
        elif k == len(moments) - 1:
            turned = f" and {np.degrees(radians):.2g}°" if np.degrees(radians) > DRAWN_ROTATION_DEGREES_MIN else ""
            yield f"End: {ENDS[found.outcome]}. The platform is {1e3 * metres:.3g} mm{turned} from the goal."
        elif passed:
            yield (
                "Type 2 singularity crossed: at this pose a dof of the platform is unobserved."
                if passed[-1].kind == TYPE_2
                else "A leg passes a Type 1 singularity."
            )
        elif sizes[number] > DRAWN_ERROR_MIN_FRACTION * sizes.max():
            yield "The controller rotates the observed legs towards the goal directions."
        else:
            yield "The observed legs have the goal directions; the platform stops."


class Sheet:
    """Right part of each frame: title, caption, time, and curves with a mark at the present time."""

    def __init__(self, found: Servo) -> None:
        self.times = found.run.times
        figure = self.figure = make_empty_figure(WIDTH / DOTS, HEIGHT / DOTS, dpi=DOTS)
        left, wide = (WIDTH - SIDE + 30) / WIDTH, (SIDE - 60) / WIDTH
        figure.text(left, 0.945, found.setup.robot.name, fontsize=17, fontweight="bold", va="center")
        figure.text(
            left, 0.895, f"start {describe_pose(found.start)}\ngoal {describe_pose(found.goal)}", fontsize=9, va="top"
        )
        figure.text(0.015, 0.965, "camera image", fontsize=12, va="center")
        self.words = figure.text(left, 0.79, "", fontsize=14, va="top", linespacing=1.35)
        figure.text(left, 0.55, "■", fontsize=11, va="center", color=palette.get_colour("observed"))
        figure.text(
            left + 0.016, 0.55, f"observed {name_all('leg', found.setup.labels)}; pale: goal", fontsize=10, va="center"
        )
        self.marks: list[Any] = []
        for bottom, values, label in (
            (0.38, found.errors.max(axis=1), "largest direction error"),
            (0.225, 1e3 * np.linalg.norm(found.way - found.goal_position, axis=1), "distance from the goal (mm)"),
            (0.07, found.track.smallest, "singularity distance"),
        ):
            place = figure.add_axes((left + 0.025, bottom, wide - 0.025, 0.09))
            place.plot(self.times, values, color="0.35")
            place.set(xlim=(0, find_end_time(found) or 1.0), ylim=(0, None))
            place.set_title(label, loc="left", fontsize=10)
            self.marks.append((place.plot([], [], "o", color="black")[0], values))
        place.set_xlabel("time (s)")

    def at(self, number: int, words: str) -> Array:
        """Draw a frame (height, width, 3), bytes, without the camera image."""
        self.words.set_text(textwrap.fill(words, CAPTION_LINE_CHARACTERS_MAX))
        for mark, values in self.marks:
            mark.set_data([self.times[number]], [values[number]])
        self.figure.canvas.draw()
        return np.array(self.figure.canvas.buffer_rgba())[..., :3]


def _place_camera(found: Servo) -> Camera:
    """Place a camera with the whole robot in its image at both ends of the run, from above."""
    mechanism, reference = found.setup.mechanism, found.setup.samples.observation_model.reference
    links = []
    for link in set(mechanism.links) - {mechanism.base}:
        X = invert_pose(mechanism.links[link].pose)
        links += [Cylinder(link, np.array(ends) @ X[:3, :3].T + X[:3, 3], 0.0) for ends in rods_of(mechanism, link)]
    configurations = (*found.run.configurations[:: max(1, len(found.run.configurations) // 5)], found.target)
    points = np.array([rods_in_frame(links, reference, at.pose) for at in configurations])
    ahead = np.array([np.cos(CAMERA_ELEVATION_RAD), 0.0, -np.sin(CAMERA_ELEVATION_RAD)])
    wide = WIDTH - SIDE
    blank = Camera(np.eye(4), ANIMATION_FOCAL_WIDTH_FRACTION * wide, wide, HEIGHT)
    return facing(points, ahead, np.array([0.0, -1.0, 0.0]), blank)


def _choose_moments(places: Array, errors: Array) -> list[int]:
    """Return numbers of configurations that divide the run equally by motion of platform and legs."""
    ways = [
        np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(values, axis=0), axis=1))])
        for values in (places, errors)
    ]
    way = sum(each / each[-1] for each in ways if each[-1] > 0) + np.linspace(0.0, 1e-6, len(places))
    return [int(i) for i in np.searchsorted(way, np.linspace(0.0, way[-1], FRAMES)).clip(0, len(places) - 1)]


def _convert_to_light(picture: Array) -> Array:
    """Convert a rendered image, 0 to 255, to colours from 0 to 1: observed legs in theirs, dark grey lighter."""
    bright = picture / 255.0
    high, low = _find_brightest(bright), -_find_brightest(-bright)
    grey = (high - low < 0.05) & (high > 0.5 * LINK_GREY_FRACTION)
    return np.where(grey[..., None], 0.6, high[..., None] * WATCHED)


def _find_background(colours: Array) -> Array:
    """Return the mask of empty pixels."""
    return np.asarray(_find_brightest(colours) < 0.5 * LINK_GREY_FRACTION)


def _find_brightest(colours: Array) -> Array:
    """Return the largest of the three channels, faster than a reduction over a short axis."""
    return np.maximum(np.maximum(colours[..., 0], colours[..., 1]), colours[..., 2])
