"""Figure of a servo run: the robot at start, end and goal, and against time the errors, the position of the platform
and the singularity distance (MMT Figs. 22-29)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.cameras import CameraObservation, NamedCamera
from ..simulation.crossings import TYPE_2
from ..simulation.outcome import ANTIPODAL, BOUNDARY, MINIMUM, MODE, SIGHT, TIME, UNDECIDED
from ..simulation.outcome import GOAL as GOAL_REACHED
from ..simulation.result import Servo
from . import palette
from .figure_format import GIVEN_LEGEND, PNG, Paper, draw_legend_within, print_figure, wrap, wrap_title
from .palette import SERIES
from .plots import in_style, make_empty_figure, make_legend_entry, require_axes_count
from .skeleton import trace_leg_outlines, trace_link_outline
from .sketch import Box, Sketch
from .view.sights import VIEW_HALF_LENGTH_FRACTION, compute_half_image, list_cameras
from .view.view import find_plane_normal

DRAWN_MOTION_TOL = 1e-9
"""Motion (metres, radians) below which a platform is drawn as not moving along a coordinate."""
DRAWN_ERROR_MIN_FRACTION = 1e-3
"""Fraction of the largest error below which a run is not drawn further."""

STYLES = ("solid", "dashed", "dashdot", "dotted", "solid", "dashed")
WIDE, TALL, LEAST_TALL, NARROW = 12.0, 7.4, 5.4, 8.0
"""Width and height of the figure, its least height, and the width below which the curves stand under the robot."""
NAMES, LEGENDS, SCALES, BELOW, PANEL, GAP = 0.95, 1.2, 0.7, 0.55, 1.15, 0.2
"""Room left of the curves, right of them, left of the robot, below both, for a curve under the robot, and between."""
SHARE, HSPACE = 0.56, 0.18
"""The robot's part of what is left of the width, and the space between two curves over the height of one."""
START, END, GOAL = ("0.72", "solid"), (SERIES[1], "solid"), (palette.get_colour("goal"), (0, (4, 2)))
"""Colour and stroke of the robot at start, end and goal."""
BASE: dict[str, Any] = {"color": "black", "marker": "s", "markersize": 4, "linestyle": ""}
LEGEND_NAME_CHARACTERS_MAX = 8
"""Letters of a name from which on a legend is printed small."""
IMAGE_TO_CURVE_HEIGHT_FRACTION = 2.2
"""Height of a camera image over that of a curve."""
DRAWN_ROTATION_DEGREES_MIN = 0.01
"""Turns below this (degrees) are not drawn."""
ENDS = {
    GOAL_REACHED: "goal",
    MODE: "other assembly mode",
    ANTIPODAL: "antipodal pose",
    MINIMUM: "local minimum",
    BOUNDARY: "limit reached",
    SIGHT: "out of view",
    TIME: "time limit",
    UNDECIDED: "undecided",
}
"""Labels of outcomes."""


@in_style
def draw_run(found: Servo, paper: Paper = PNG) -> bytes:
    """The run as a figure on ``paper``."""
    panels = list(_list_panels(found))
    if paper.given:
        require_axes_count(paper, len(panels))
        _draw_curves(paper.given, found, panels)
        for place in paper.given:
            if len(place.get_legend_handles_labels()[0]) > 1:
                place.legend(**GIVEN_LEGEND)
        return b""
    figure = make_empty_figure(paper.wide(WIDE), TALL)
    legs = ", ".join(found.setup.labels)
    word = "legs " if all(each.is_segment_direction for each in found.setup.observed) else ""
    title = figure.suptitle(f"{found.setup.robot.name}, {word}{legs} observed: {ENDS[found.outcome]}", va="top")
    x, y, wide, tall = _draw_robots(figure, found, wrap_title(figure, title), len(panels))
    title.set_y(1 - GAP / 2 / figure.get_figheight())
    pictures = _list_images(found)
    high = (
        IMAGE_TO_CURVE_HEIGHT_FRACTION * len(panels) / (len(panels) + IMAGE_TO_CURVE_HEIGHT_FRACTION * len(pictures))
        if pictures
        else 0.0
    )
    share = tall * high * len(pictures) / len(panels) if pictures else 0.0
    places = figure.add_gridspec(
        len(panels), 1, left=x, bottom=y + share, right=x + wide, top=y + tall, hspace=HSPACE
    ).subplots(sharex=True)
    _draw_curves(np.atleast_1d(places), found, panels)
    for place, (_, curves, _) in zip(np.atleast_1d(places), panels, strict=True):
        wrap(place.yaxis.label, place.get_window_extent().height / figure.dpi)
        if len(curves) > 1 or curves[0][0]:
            place.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), **_choose_small_font(curves))
    for number, (eye, half) in enumerate(pictures):
        part = share / len(pictures)
        side = figure.add_axes((x, y + number * part, wide, part - BELOW * 1.3 / figure.get_figheight()))
        _draw_image(side, found, eye, half)
    figure.align_ylabels()
    return print_figure(figure, paper)


def _draw_curves(places: Any, found: Servo, panels: Sequence[Panel]) -> None:
    """Draw the panels against time, each in its axes."""
    times, end = found.run.times, find_end_time(found)
    for place, (label, curves, bottom) in zip(places, panels, strict=True):
        for name, values, colour, style in curves:
            place.plot(times, values, color=colour, linestyle=style, label=name)
        place.axhline(0, color="0.6", linewidth=0.8)
        for passage in found.track.passages or ():
            place.axvline(times[passage.place], color=palette.get_colour("step4"), linewidth=0.8, linestyle="dotted")
        place.set_ylabel(label, fontsize=9)
        place.set(xlim=(0, end or 1.0), **({} if bottom is None else {"ylim": (bottom, None)}))
    places[-1].set_xlabel("time (s)" + ("" if end >= times[-1] else f"; nearly no motion until {times[-1]:.3g} s"))


def _list_images(found: Servo) -> list[tuple[NamedCamera, Array]]:
    """Return the cameras with a visible observation, and half of their image sizes."""
    every = list_cameras(found.setup)
    seen = [(eye, compute_half_image(eye)) for eye in every]
    return [(eye, half) for eye, half in seen if _list_seen_by(found, eye)]


def _list_seen_by(found: Servo, eye: NamedCamera) -> list[CameraObservation]:
    return [
        o
        for o in found.setup.observed
        if isinstance(o, CameraObservation)
        and o.image(*_collect_poses(found, o, found.target), VIEW_HALF_LENGTH_FRACTION * found.target.model.length)
        and (o.camera.name if o.camera else found.setup.mechanism.reference) == eye.name
    ]


def _collect_poses(found: Servo, seen: CameraObservation, at: ClosedConfiguration) -> tuple[Array, Array]:
    return at.pose(seen.seen_from or found.setup.mechanism.reference), at.pose(seen.link)


def _draw_image(place: Any, found: Servo, eye: NamedCamera, half: Array) -> None:
    """Draw a camera image: the paths of the observations' middles, and the observations at start, end and goal."""
    size = VIEW_HALF_LENGTH_FRACTION * found.target.model.length
    states = [(found.run.configurations[0], START), (found.settled, END), (found.target, GOAL)]
    for number, seen in enumerate(_list_seen_by(found, eye)):
        ways = [seen.image(*_collect_poses(found, seen, at), size) for at in found.run.configurations]
        middles = np.array(
            [each[0][:-1].mean(axis=0) if len(each[0]) > 2 else each[0].mean(axis=0) for each in ways if each]
        )
        place.plot(*middles.T, color=SERIES[number % 6], linestyle=STYLES[number % 6], label=seen.leg)
        for at, (colour, style) in states:
            for stroke in seen.image(*_collect_poses(found, seen, at), size):
                marker = {"marker": "o", "markersize": 5, "markerfacecolor": "none"} if len(stroke) == 1 else {}
                place.plot(*stroke.T, color=colour, linestyle=style, **marker)
    sized = eye.focal and eye.width and eye.height
    if sized:
        place.set(xlim=(-half[0], half[0]), ylim=(half[1], -half[1]))
    else:
        place.invert_yaxis()
    place.set_aspect("equal", adjustable="box" if sized else "datalim")
    place.set_xlabel(f"image of {eye.name}: x = X/Z", fontsize=9)
    place.set_ylabel("y = Y/Z", fontsize=9)
    place.legend(
        loc="center left",
        bbox_to_anchor=(1.01, 0.5),
        **_choose_small_font([(o.leg,) for o in _list_seen_by(found, eye)]),
    )


def _choose_small_font(named: Sequence[tuple[Any, ...]]) -> dict[str, Any]:
    """Return the style of a narrow legend for long names."""
    return (
        {"fontsize": 7, "handlelength": 1.2} if any(len(each[0]) > LEGEND_NAME_CHARACTERS_MAX for each in named) else {}
    )


def _make_layout(figure: Any, entries: list[Any], above: float, panels: int) -> tuple[Box, Box]:
    """Draw the legend, set the height of the figure below a title of height ``above`` (inches); return the boxes of the
    robot and of the curves, beside it, or below if the figure is narrow."""
    wide = figure.get_figwidth()
    rest = wide - SCALES - NAMES - LEGENDS
    if wide >= NARROW:
        low = draw_legend_within(figure, entries, SCALES + SHARE * rest, loc="lower left")
        tall = max(LEAST_TALL, TALL * wide / WIDE)
        high = tall - above - 2 * GAP
        robot = (SCALES, low + BELOW, SHARE * rest, high - low - BELOW)
        curves = (wide - LEGENDS - (1 - SHARE) * rest, BELOW, (1 - SHARE) * rest, high - BELOW)
    else:
        curves = (NAMES, BELOW, wide - LEGENDS - NAMES, (PANEL + GAP) * panels - GAP)
        low = draw_legend_within(figure, entries, wide, loc="upper center")
        side = wide - SCALES - GAP
        robot = (SCALES, BELOW + curves[3] + 2 * GAP + low + BELOW, side, side)
        tall = robot[1] + side + above + 2 * GAP
        figure.legends[0].set_bbox_to_anchor((0.5, (robot[1] - BELOW) / tall))
    figure.set_figheight(tall)
    inches = np.array([wide, tall, wide, tall])
    return tuple(np.array(robot) / inches), tuple(np.array(curves) / inches)


Curve = tuple[str, Array, str, str]
"""A curve's name, its values, colour and stroke."""
Panel = tuple[str, list[Curve], float | None]
"""A panel's name, its curves, and the lower end of its scale."""


def _list_panels(found: Servo) -> Iterator[Panel]:
    """Yield what is drawn against time: name, curves, lower end of the scale."""
    names = [f"leg {each.leg}" if each.is_segment_direction else each.leg for each in found.setup.observed]
    yield "error ‖eᵢ‖", [(name, found.errors[:, i], SERIES[i % 6], STYLES[i % 6]) for i, name in enumerate(names)], 0.0
    path, goal = found.way, found.goal_position
    moved = [
        i for i in range(3) if np.ptp(path[:, i]) > DRAWN_MOTION_TOL or abs(path[-1, i] - goal[i]) > DRAWN_MOTION_TOL
    ] or [0]
    yield "position − goal (m)", [("xyz"[i], path[:, i] - goal[i], SERIES[i], STYLES[i]) for i in moved], None
    if np.degrees(found.turns.max()) > DRAWN_ROTATION_DEGREES_MIN:
        yield "rotation from\ngoal (deg)", [("", np.degrees(found.turns), SERIES[0], "solid")], 0.0
    if np.isfinite(found.track.smallest).any():
        yield "singularity\ndistance (Mᵀ)", [("", found.track.smallest, SERIES[3], "solid")], 0.0


def find_end_time(found: Servo) -> float:
    """The time (s) after which nothing is left to be seen."""
    sizes = found.errors.max(axis=1)
    late = np.nonzero(sizes > DRAWN_ERROR_MIN_FRACTION * sizes.max())[0]
    return float(found.run.times[min(late[-1] + 1, len(sizes) - 1)]) if len(late) else float(found.run.times[-1])


def _draw_robots(figure: Any, found: Servo, above: float, panels: int) -> Box:
    """The robot at start, end and goal, the way of its platform, and where the other modes are; the place that is left
    for curves below a title of this height (inches)."""
    states = [(found.run.configurations[0], START), (found.settled, END), (found.target, GOAL)]
    drawn = [(list(list_strokes(found, at)), style) for at, style in states]
    ground = locate_base_centres(found)
    modes = [] if found.run_outcome.modes is None else [mode for mode in found.run_outcome.modes.modes if not mode.goal]
    others = np.array([[getattr(mode.pose, name) for name in "xyz"] for mode in modes]).reshape(-1, 3)
    path = found.way
    every = np.vstack([ground, path, *(stroke for each, _ in drawn for stroke, _ in each)])
    sketch = Sketch.of(find_plane_normal(found.setup.motion), ground, [])
    entries = [
        make_legend_entry("path of the platform", color=SERIES[0]),
        make_legend_entry("joints of the base", **BASE),
    ]
    if any(np.ptp(stroke, axis=0).any() for each, _ in drawn for stroke, _ in each):
        entries[:0] = [
            make_legend_entry("robot at the start", color=START[0]),
            make_legend_entry("robot at the end", color=END[0]),
            make_legend_entry("robot at the goal", color=GOAL[0], linestyle="dashed"),
        ]
    inside = others[np.all((others >= every.min(axis=0) - 1e-9) & (others <= every.max(axis=0) + 1e-9), axis=1)]
    marks = [
        (inside, "D", palette.get_colour("mode"), "other assembly modes of the goal"),
        (path[-1:], "o", SERIES[1], ""),
    ]
    marks += [
        (
            path[each.place][None],
            "x",
            palette.get_colour("step4"),
            "crossing a Type 2 singularity" if each.kind == TYPE_2 else "crossing a Type 1 singularity",
        )
        for each in found.track.passages or ()
    ]
    looks = [
        (points, words, {"marker": mark, "color": colour, "markerfacecolor": "none", "linestyle": ""})
        for points, mark, colour, words in marks
        if len(points)
    ]
    entries += {words: make_legend_entry(words, **look) for _, words, look in looks if words}.values()
    robot, curves = _make_layout(figure, entries, above, panels)
    place = sketch.place(figure, robot, every)
    for number, (each, (colour, style)) in enumerate(drawn):
        for stroke, platform in each:
            sketch.stroke(
                place, stroke, color=colour, linestyle=style, linewidth=2.4 if platform else 1.2, zorder=2 + number
            )
    sketch.stroke(place, ground, zorder=6, **BASE)
    sketch.stroke(place, path, color=SERIES[0], linewidth=1.6, zorder=7)
    for points, _, look in looks:
        sketch.stroke(place, points, markersize=7, markeredgewidth=1.8, zorder=8, **look)
    return curves


def list_strokes(found: Servo, at: ClosedConfiguration) -> Iterator[tuple[Array, bool]]:
    """The robot at a configuration as polylines (n, 3), and whether each is of the platform."""
    platform = found.setup.decomposition.platform
    yield from ((stroke, False) for stroke in trace_leg_outlines(at, platform))
    yield from ((trace_link_outline(at.model.mechanism, link, at.pose(link)), True) for link in platform)


def locate_base_centres(found: Servo) -> Array:
    """The centres of the base's joints, (n, 3)."""
    mechanism = found.target.model.mechanism
    return np.array([joint.point for joint in mechanism.joints_of(mechanism.base)])
