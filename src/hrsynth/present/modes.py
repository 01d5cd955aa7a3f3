"""Figure of all assembly modes: the curves that intersect there, and the robot at each mode."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..analysis.modes.modes import AssemblyModes
from ..errors import BadRequest
from ..geometry.vectors import Array
from . import palette
from .figure_format import PNG, Paper, legend_within, print_figure, settle_title, wrap
from .plots import empty_figure, entry, in_style
from .scenes import CLOSES, GOAL, NEAR, OPEN, UNKNOWN, ModesScene, Placed, scene
from .sketch import Box, Sketch

MARKS = {
    GOAL: ("*", 15.0, "given pose"),
    CLOSES: ("o", 8.0, "mode, robot can be assembled"),
    OPEN: ("X", 9.0, "mode, robot cannot be assembled"),
    UNKNOWN: ("P", 8.0, "mode, assembly not found"),
    NEAR: ("D", 7.0, "near mode"),
}
COLOURS = (
    palette.colour("goal"),
    "tab:green",
    "tab:red",
    "tab:purple",
    "tab:orange",
    "deeppink",
    "darkcyan",
    "olive",
    "navy",
    "goldenrod",
    "maroon",
    "black",
)
REACHES = ("black", "tab:brown", "tab:gray", "darkslateblue", "darkolivegreen", "teal")
MOVING = "cornflowerblue"
DPI, SHADES = 150, 160
"""Resolution; colours of the file, whose translucent surfaces would else have thousands and be large."""
MOST, FEW = 16, 6
"""Robots drawn beside the curves at most; modes up to which their platforms are drawn among the curves too."""
SIDE, LEFT, GAP, BELOW, ABOVE, TITLE = 5.2, 0.8, 0.3, 0.6, 0.3, 0.25
"""The side of the drawing of curves, and the spaces about it and above each robot (inches)."""
LEAST_CELL = 1.3
"""The least side of the drawing of a robot (inches): on narrower paper the robots stand below the curves."""


def picture(found: AssemblyModes, paper: Paper = PNG) -> bytes:
    """Draw the modes as a figure on ``paper``; the text ``Description`` of a PNG holds :func:`description` as JSON."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    drawn = drawable(found)
    whole = figure(found, drawn, paper)
    if paper.ending != ".png":
        return print_figure(whole, paper)
    paper.fit(whole)
    canvas = whole.canvas
    canvas.draw()
    texts, stream = PngInfo(), io.BytesIO()
    texts.add_text("Description", json.dumps(description(found, drawn)))
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    image.quantize(SHADES, dither=Image.Dither.NONE).save(stream, "PNG", optimize=True, pnginfo=texts, dpi=(DPI, DPI))
    return stream.getvalue()


def why_undrawn(found: AssemblyModes) -> str | None:
    """Return why there is nothing to draw: a formation, a continuous family of modes, or no mode."""
    if found.formation is not None:
        return "a formation has no platform with attachment points"
    if found.found.continuous_family is not None or not (found.modes or found.near_modes):
        return found.found.singular_solutions or "there is no mode"
    return None


def drawable(found: AssemblyModes) -> ModesScene:
    """Return the scene to draw; raise ``BadRequest`` if there is none."""
    why = why_undrawn(found)
    if why is not None:
        raise BadRequest(f"{found.setup.robot.name}: there is nothing to draw: {why}")
    return scene(found)


def description(found: AssemblyModes, drawn: ModesScene) -> dict[str, Any]:
    """Return the request and the drawn points in a few numbers, which show whether a figure is out of date."""
    return {
        "robot": found.setup.robot.name,
        "observe": list(found.setup.labels),
        "real": found.kind == "real",
        "at": str(found.pose),
        "complex": found.found.complex,
        **drawn.to_dict(),
    }


@in_style
def figure(found: AssemblyModes, drawn: ModesScene, paper: Paper = PNG) -> Any:
    """Draw the matplotlib figure: the robots beside the curves, or below if the paper is narrow."""
    placed = drawn.placed[:MOST]
    columns, rows = _grid(len(placed))
    wide = paper.wide(LEFT + SIDE + GAP + columns * SIDE / rows)
    whole = empty_figure(wide, SIDE, dpi=DPI)
    above, below = ABOVE + _heading(whole, found, drawn), BELOW + _legend(whole, drawn)
    side = (wide - LEFT - GAP) / (1 + columns / rows)
    cell = side / rows
    if beside := cell >= LEAST_CELL - 1e-9:
        start, top, tall = LEFT + side + GAP, below + (side + cell * -(-len(placed) // columns)) / 2, side
    else:
        columns = int(wide / LEAST_CELL)
        side, cell = min(SIDE, wide - LEFT - GAP / 2), wide / columns
        start, top = 0.0, below + cell * -(-len(placed) // columns) - BELOW / 2
        tall = side + top - below + BELOW
    page = np.array([wide, below + tall + above])
    whole.set_figheight(page[1])
    whole._suptitle.set_y(1 - ABOVE / 2 / page[1])
    bottom = page[1] - above - side
    left = LEFT if beside else (wide - side + LEFT - GAP / 2) / 2
    lines = [trace.points for trace in drawn.traces if trace.points.ndim == 2 and not trace.moving]
    sketch = Sketch.of(drawn.normal, np.array([each.at for each in drawn.placed]), lines)
    wall = left if drawn.normal is not None else left - LEFT
    _curves(sketch, whole, _box(page, wall, bottom, left + side, page[1] - above), drawn)
    robots = np.vstack([drawn.ground, *(part for each in placed for part in (*each.platform, *each.strokes))])
    for k, each in enumerate(placed):
        row, column = divmod(k, columns)
        x, y = start + column * cell, top - (row + 1) * cell
        words = whole.text(
            (x + cell / 2) / page[0],
            (y + cell - TITLE / 2) / page[1],
            f"{each.label}  {each.words}",
            ha="center",
            va="center",
            fontsize=9 if columns < 3 else 8,
            color=_colour(k),
        )
        wrap(words, 0.95 * cell)
        _robot(
            sketch,
            sketch.place(whole, _box(page, x, y + 0.1, x + cell, y + cell - TITLE), robots, bare=True),
            drawn,
            each,
            k,
        )
    return whole


def _box(page: Array, left: float, bottom: float, right: float, top: float) -> Box:
    """A box of the page, given in inches."""
    width, height = page
    return left / width, bottom / height, (right - left) / width, (top - bottom) / height


def _grid(count: int) -> tuple[int, int]:
    """Columns and rows for this many robots."""
    columns = 1 + sum(count > most for most in (2, 6, 12))
    return columns, max(2, -(-count // columns))


def _colour(k: int) -> str:
    return COLOURS[k % len(COLOURS)]


def _curves(sketch: Sketch, whole: Any, box: Box, drawn: ModesScene) -> None:
    """Draw the curves, the platform at each mode (in a plane the robot), and the numbers."""
    few = len(drawn.placed) <= FEW
    legs = [each.strokes if few and sketch.flat else () for each in drawn.placed]
    platforms = [each.platform if few else () for each in drawn.placed]
    curves = [trace.points for trace in drawn.traces]
    spots = np.array([each.at for each in drawn.placed])
    about = [curve.reshape(-1, 3) for curve in curves] + [part for parts in (*legs, *platforms) for part in parts]
    place = sketch.place(whole, box, np.vstack([*about, spots]))
    for trace, colour in zip(drawn.traces, _colours(drawn), strict=True):
        if trace.points.ndim == 3:
            sketch.surface(place, trace.points, colour)
        else:
            sketch.stroke(place, trace.points, color=colour, linewidth=1.8, zorder=3)
    for k, each in enumerate(drawn.placed):
        for stroke in legs[k]:
            sketch.stroke(place, stroke, color=_colour(k), linewidth=0.9, alpha=0.6, marker="o", markersize=2, zorder=4)
        for ring in platforms[k]:
            sketch.stroke(place, ring, color=_colour(k), linewidth=1.8, zorder=5)
        _mark(sketch, place, each, k, 1.0)
    if any(legs):
        sketch.stroke(place, drawn.ground, color="black", marker="s", markersize=3.4, linestyle="", zorder=5)
    lines = [curve for curve in curves if curve.ndim == 2] + [ring for rings in platforms for ring in rings]
    sketch.numbers(place, spots, [each.label for each in drawn.placed], [_colour(k) for k in range(len(spots))], lines)


def _mark(sketch: Sketch, place: Any, each: Placed, k: int, scale: float) -> None:
    mark, size, _ = MARKS[each.state]
    sketch.stroke(
        place,
        each.at[None],
        color=_colour(k),
        marker=mark,
        markersize=scale * size,
        linestyle="",
        markeredgecolor="black",
        markeredgewidth=0.7,
        zorder=6,
    )


def _robot(sketch: Sketch, place: Any, drawn: ModesScene, each: Placed, k: int) -> None:
    """The robot at one mode; its platform alone where the robot does not close."""
    for stroke in each.strokes:
        sketch.stroke(place, stroke, color="0.35", linewidth=1.2, marker="o", markersize=2.4, zorder=3)
    sketch.stroke(place, drawn.ground, color="black", marker="s", markersize=3.4, linestyle="", zorder=4)
    for ring in each.platform:
        sketch.stroke(place, ring, color=_colour(k), linewidth=2.4, zorder=5)
    _mark(sketch, place, each, k, 0.8)


def _heading(whole: Any, found: AssemblyModes, drawn: ModesScene) -> float:
    """Write the title; its height (inches)."""
    setup, count = found.setup, found.found
    what = "directions of legs" if all(o.by_segment for o in setup.observed) else "values of"
    held = f"{what} {', '.join(setup.labels)}" if found.kind == "hidden" else "motor coordinates"
    many = found.count + ("" if count.complete else ", not proved to be all")
    many += f"; {len(found.near_modes)} near" if found.near_modes else ""
    many += f"; the first {MOST} drawn as robots" if len(drawn.placed) > MOST else ""
    if drawn.rest:
        many += f"\nonly these intersections of the curves match leg{'s' * (len(drawn.rest) > 1)} "
        many += ", ".join(drawn.rest) + " too"
    title = f"{setup.robot.name}   {setup.decomposition.architecture()}\nassembly modes with fixed {held}: {many}"
    return settle_title(whole, whole.suptitle(title, fontsize=12, va="top"))


def _colours(drawn: ModesScene) -> Iterator[str]:
    """A colour for each trace: one for what the platform traces, others for the reach of each leg."""
    k = 0
    for trace in drawn.traces:
        yield MOVING if trace.moving else REACHES[k % len(REACHES)]
        k += not trace.moving


def _legend(whole: Any, drawn: ModesScene) -> float:
    """Draw the legend; its height (inches)."""
    from matplotlib.patches import Patch

    entries: dict[str, Any] = {}
    for trace, colour in zip(drawn.traces, _colours(drawn), strict=True):
        entries.setdefault(
            trace.words,
            Patch(facecolor=colour, alpha=0.4, label=trace.words)
            if trace.points.ndim == 3
            else entry(trace.words, color=colour, linewidth=1.8),
        )
    for state in dict.fromkeys(each.state for each in drawn.placed):
        mark, size, words = MARKS[state]
        entries[words] = entry(
            words, linestyle="", marker=mark, markersize=0.8 * size, color="0.6", markeredgecolor="black"
        )
    if any(each.platform for each in drawn.placed):
        entries["platform"] = entry("platform (in the colour of the mode)", color=COLOURS[0], linewidth=2.4)
    entries["ground"] = entry("joints of the base", linestyle="", marker="s", color="black", markersize=3.4)
    return legend_within(whole, list(entries.values()), whole.get_figwidth(), loc="lower center")
