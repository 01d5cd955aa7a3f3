"""A servo run → a picture: the robot at start, end and goal, and against time the errors, the platform's place, and how
far a singularity is (MMT Figs. 22-29)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..simulation.result import Servo
from ..simulation.track import TYPE_2
from ..tolerances import REST_OF_RUN, UNMOVED
from .paper import PNG, Paper, legend_within, printed, settled, wrap
from .plots import COLOURS, empty_figure, entry, pose_words, styled
from .skeleton import legs_of, outline
from .sketch import Box, Sketch
from .view.view import plane_normal

STYLES = ("solid", "dashed", "dashdot", "dotted", "solid", "dashed")
WIDE, TALL, LEAST_TALL, NARROW = 12.0, 7.4, 5.4, 8.0
"""Width and height of the picture, its least height, and the width below which the curves stand under the robot."""
NAMES, LEGENDS, SCALES, BELOW, PANEL, GAP = 0.95, 1.2, 0.7, 0.55, 1.15, 0.2
"""Room left of the curves, right of them, left of the robot, below both, for a curve under the robot, and between."""
SHARE, HSPACE = 0.56, 0.18
"""The robot's part of what is left of the width, and the space between two curves over the height of one."""
START, END, GOAL = ("0.72", "solid"), (COLOURS[1], "solid"), (COLOURS[2], (0, (4, 2)))
"""Colour and stroke of the robot at these."""
BASE: dict[str, Any] = {"color": "black", "marker": "s", "markersize": 4, "linestyle": ""}
LEAST_TURN = 0.01
"""Turns below this (degrees) are not drawn."""
ENDS = {"goal": "the goal", "mode": "another assembly mode", "antipodal": "an antipodal pose",
        "local minimum": "a local minimum", "boundary": "a boundary of the workspace", "time": "the end of its time",
        "undecided": "a place that is not decided"}
"""Endings in words."""


@styled
def picture(found: Servo, paper: Paper = PNG) -> bytes:
    """The run as a figure on ``paper``."""
    panels = list(_panels(found))
    figure = empty_figure(paper.wide(WIDE), TALL)
    legs = ", ".join(found.setting.labels)
    title = figure.suptitle(f"{found.setting.robot.name}, legs {legs} observed: ended at {ENDS[found.ended]}\n"
                            f"from {pose_words(found.start)} to {pose_words(found.goal)}", va="top")
    x, y, wide, tall = _robots(figure, found, settled(figure, title), len(panels))
    title.set_y(1 - GAP / 2 / figure.get_figheight())
    places = figure.add_gridspec(len(panels), 1, left=x, bottom=y, right=x + wide, top=y + tall,
                                 hspace=HSPACE).subplots(sharex=True)
    times = found.run.times
    for place, (label, curves, bottom) in zip(np.atleast_1d(places), panels, strict=True):
        for name, values, colour, style in curves:
            place.plot(times, values, color=colour, linestyle=style, label=name)
        place.axhline(0, color="0.6", linewidth=0.8)
        for passage in found.track.passages or ():
            place.axvline(times[passage.place], color="crimson", linewidth=0.8, linestyle="dotted")
        wrap(place.set_ylabel(label, fontsize=9), place.get_window_extent().height / figure.dpi)
        place.set(xlim=(0, until(found) or 1.0), **({} if bottom is None else {"ylim": (bottom, None)}))
        if len(curves) > 1 or curves[0][0]:
            place.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    still = "" if until(found) >= times[-1] else f"; nearly still until {times[-1]:.3g} s"
    place.set_xlabel(f"time (s){still}")
    figure.align_ylabels()
    return printed(figure, paper)


def _layout(figure: Any, entries: list[Any], above: float, panels: int) -> tuple[Box, Box]:
    """Draw the legend, make the figure as tall as is wanted below a title of this height (inches), and say where the
    robot is drawn and where the curves: beside it, or under it where the figure is narrow."""
    wide = figure.get_figwidth()
    rest = wide - SCALES - NAMES - LEGENDS
    if wide >= NARROW:
        low = legend_within(figure, entries, SCALES + SHARE * rest, loc="lower left")
        tall = max(LEAST_TALL, TALL * wide / WIDE)
        high = tall - above - 2 * GAP
        robot = (SCALES, low + BELOW, SHARE * rest, high - low - BELOW)
        curves = (wide - LEGENDS - (1 - SHARE) * rest, BELOW, (1 - SHARE) * rest, high - BELOW)
    else:
        curves = (NAMES, BELOW, wide - LEGENDS - NAMES, (PANEL + GAP) * panels - GAP)
        low = legend_within(figure, entries, wide, loc="upper center")
        side = wide - SCALES - GAP
        robot = (SCALES, BELOW + curves[3] + 2 * GAP + low + BELOW, side, side)
        tall = robot[1] + side + above + 2 * GAP
        figure.legends[0].set_bbox_to_anchor((0.5, (robot[1] - BELOW) / tall))
    figure.set_figheight(tall)
    inches = np.array([wide, tall, wide, tall])
    return tuple(np.array(robot) / inches), tuple(np.array(curves) / inches)


Curve = tuple[str, Array, str, str]
"""A curve's name, its values, colour and stroke."""


def _panels(found: Servo) -> Iterator[tuple[str, list[Curve], float | None]]:
    """What is drawn against time: its name, its curves, the lower end of its scale."""
    yield r"error $\|e_i\|$", [(f"leg {observation.leg}", found.errors[:, i], COLOURS[i % 6], STYLES[i % 6])
                               for i, observation in enumerate(found.setting.observed)], 0.0
    path, goal = found.way, found.goal_position
    moved = [i for i in range(3) if np.ptp(path[:, i]) > UNMOVED or abs(path[-1, i] - goal[i]) > UNMOVED] or [0]
    yield "position − goal (m)", [("xyz"[i], path[:, i] - goal[i], COLOURS[i], STYLES[i]) for i in moved], None
    if np.degrees(found.turns.max()) > LEAST_TURN:
        yield "turn from goal\n(degrees)", [("", np.degrees(found.turns), COLOURS[0], "solid")], 0.0
    if np.isfinite(found.track.smallest).any():
        yield "distance to the\nsingularity ($M^T$)", [("", found.track.smallest, COLOURS[3], "solid")], 0.0


def until(found: Servo) -> float:
    """The time (s) after which nothing is left to be seen."""
    sizes = found.errors.max(axis=1)
    late = np.nonzero(sizes > REST_OF_RUN * sizes.max())[0]
    return float(found.run.times[min(late[-1] + 1, len(sizes) - 1)]) if len(late) else float(found.run.times[-1])


def _robots(figure: Any, found: Servo, above: float, panels: int) -> Box:
    """The robot at start, end and goal, the way of its platform, and where the other modes are; the place that is left
    for curves below a title of this height (inches)."""
    states = [(found.run.configurations[0], START), (found.settled, END), (found.target, GOAL)]
    drawn = [(list(strokes(found, at)), style) for at, style in states]
    ground = ground_of(found)
    modes = [] if found.ending.modes is None else [mode for mode in found.ending.modes.modes if not mode.goal]
    others = np.array([[getattr(mode.pose, name) for name in "xyz"] for mode in modes]).reshape(-1, 3)
    path = found.way
    every = np.vstack([ground, path, *(stroke for each, _ in drawn for stroke, _ in each)])
    sketch = sketch_of(found, every)
    entries = [entry("robot at the start", color=START[0]), entry("robot where it ended", color=END[0]),
               entry("robot at the goal", color=GOAL[0], linestyle="dashed"),
               entry("way of the platform", color=COLOURS[0]), entry("joints of the base", **BASE)]
    inside = others[np.all((others >= every.min(axis=0) - 1e-9) & (others <= every.max(axis=0) + 1e-9), axis=1)]
    marks = [(inside, "D", COLOURS[3], "other modes of the goal"), (path[-1:], "o", COLOURS[1], "")]
    marks += [(path[each.place][None], "x", "crimson", "crossing a singularity" if each.kind == TYPE_2 else
               "crossing a limit") for each in found.track.passages or ()]
    looks = [(points, words, {"marker": mark, "color": colour, "markerfacecolor": "none", "linestyle": ""})
             for points, mark, colour, words in marks if len(points)]
    entries += {words: entry(words, **look) for _, words, look in looks if words}.values()
    robot, curves = _layout(figure, entries, above, panels)
    place = sketch.place(figure, robot, every)
    for number, (each, (colour, style)) in enumerate(drawn):
        for stroke, platform in each:
            sketch.stroke(place, stroke, color=colour, linestyle=style, linewidth=2.4 if platform else 1.2,
                          zorder=2 + number)
    sketch.stroke(place, ground, zorder=6, **BASE)
    sketch.stroke(place, path, color=COLOURS[0], linewidth=1.6, zorder=7)
    for points, _, look in looks:
        sketch.stroke(place, points, markersize=7, markeredgewidth=1.8, zorder=8, **look)
    return curves


def strokes(found: Servo, at: ClosedConfiguration) -> Iterator[tuple[Array, bool]]:
    """The robot at a configuration as polylines (n, 3), and whether each is of the platform."""
    platform = found.setting.anatomy.platform
    yield from ((stroke, False) for stroke in legs_of(at, platform))
    yield from ((outline(at.twin.mechanism, link, at.pose(link)), True) for link in platform)


def ground_of(found: Servo) -> Array:
    """The centres of the base's joints, (n, 3)."""
    mechanism = found.target.twin.mechanism
    return np.array([joint.point for joint in mechanism.joints_of(mechanism.base)])


def sketch_of(found: Servo, every: Array) -> Sketch:
    """How the run is seen."""
    return Sketch.of(plane_normal(found.setting.motion), ground_of(found), [])
