"""Map of the basins of attraction with the final poses, or a table."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..simulation.equilibria.basins import LETTERS, NOT_REACHED, BasinEnd, Basins, place_of
from ..simulation.equilibria.flow import Flags, Places
from ..simulation.outcome import ANTIPODAL, BOUNDARY, GOAL, MINIMUM, MODE, SIGHT, TIME, UNDECIDED
from . import palette, plots
from .figure_format import PNG, Paper, print_figure
from .palette import SERIES
from .plots import (
    MapPlane,
    compute_cell_edges,
    convert_to_ticks,
    draw_heading,
    in_style,
    make_legend_entry,
    make_missing_entry,
    make_panels,
)
from .pose_map import PoseMap
from .runs import ENDS
from .sketch import label_axis
from .text.tables import encode_csv

DRAWN_PLANE_DISTANCE_TOL = 1e-3
"""Distance (characteristic lengths, radians) up to which the end of runs is drawn in a plane."""

SHADES = {
    GOAL: (palette.make_tint(palette.get_colour("goal"), 0.55), palette.make_tint(palette.get_colour("goal"), 0.25)),
    MODE: (
        palette.get_colour("mode"),
        palette.make_tint(palette.get_colour("mode"), 0.6),
        palette.make_tint(palette.get_colour("mode"), 0.3),
    ),
    ANTIPODAL: (SERIES[3], palette.make_tint(SERIES[3])),
    MINIMUM: (SERIES[4], palette.make_tint(SERIES[4])),
    BOUNDARY: (SERIES[1], palette.make_tint(SERIES[1])),
    SIGHT: (SERIES[5],),
    TIME: ("0.3",),
    UNDECIDED: ("0.5",),
}
"""Colours of the outcomes of each kind, the most frequent first."""
MARKS = {GOAL: "*", MODE: "o", ANTIPODAL: "X", MINIMUM: "v", BOUNDARY: "s", SIGHT: "^", UNDECIDED: "P", TIME: "d"}
BASIN_LABEL_CELLS_MIN = 3.0
"""Cells from the border of a basin at which its letter has room."""
SEEN, RING = 0.05, 26
"""Fraction of a map's width below which the proved region is not visible; diameter (points) of the ring about it."""
EQUILIBRIUM_LABEL_POINTS_COUNT = 13.0
"""Points from the mark of an end to its letter."""
DARKEST, LIGHTEST = 0.4, 0.5
"""Where a kind has more ends than shades: the darkest, as part of the first shade; the lightest, as part of what the
last one lacks of white."""
DAMPED: dict[str, Any] = {"facecolor": "none", "edgecolor": "0.25", "hatch": "....", "linewidth": 0.0}
"""Style of starts whose runs reach a singularity."""


def choose_basin_colours(ends: tuple[BasinEnd, ...]) -> list[str]:
    """A colour an end: one hue a kind, no two the same."""
    shades = {
        kind: iter(_list_shades(kind, count)) for kind, count in Counter(each.run_outcome.name for each in ends).items()
    }
    return [next(shades[each.run_outcome.name]) for each in ends]


def _list_shades(kind: str, count: int) -> list[str]:
    """So many colours of a kind: its own, or where these are too few, as many from dark to light."""
    from matplotlib.colors import to_hex, to_rgb

    given = SHADES[kind]
    if count <= len(given):
        return list(given[:count])
    first, last = (np.array(to_rgb(each)) for each in (given[0], given[-1]))
    stops = np.array([DARKEST * first, first, *[last] * (len(given) > 1), 1.0 - LIGHTEST * (1.0 - last)])
    at = np.linspace(0, len(stops) - 1, count)
    red, green, blue = (np.interp(at, range(len(stops)), part).tolist() for part in stops.T)
    return [to_hex(each) for each in zip(red, green, blue, strict=True)]


@in_style
def draw_basins(found: Basins, paper: Paper = PNG) -> bytes:
    """The starts in the colours of their ends: a strip for a line, a map for a plane, one for each value of the third
    part for a box; the ends where they lie, filled in the plane and hollow beside it."""
    from matplotlib.patches import Patch
    from matplotlib.patheffects import Normal, Stroke

    figure, layers = (_strip if found.grid.ndim == 1 else _draw_maps)(found, paper)
    shades, grid, larger, drawn = choose_basin_colours(found.ends), found.grid, False, set[tuple[str, bool]]()
    for place, plane, cells, damped, level in layers:
        _draw_layer(place, plane, cells, damped, shades)
        if plane is None:
            drawn |= _draw_ends_on_line(place, found)
        else:
            drawn |= _draw_ends(place, plane, found, level)
            larger |= _draw_certified(place, plane, found, level)
    entries = [
        Patch(facecolor=shade, label=_describe_end(letter, each))
        for letter, each, shade in zip(LETTERS, found.ends, shades, strict=False)
    ]
    if found.region is not None and found.certified is not None and grid.ndim == 2:
        told = re.sub(" of ", "\nof ", found.certified.words.removeprefix("from anywhere "))
        told += " ends there" + "\n(drawn larger)" * larger
        entries.append(
            make_legend_entry(
                f"proved: every start\n{told}",
                color="white",
                linewidth=1.6,
                path_effects=[Stroke(linewidth=3.4, foreground="black"), Normal()],
            )
        )
    if found.damped.any():
        entries.append(Patch(label="run reaches a singularity", **DAMPED))
    if (found.cells == NOT_REACHED).any():
        entries.append(make_missing_entry())
    kinds = dict.fromkeys(each.run_outcome.name for each in found.ends)
    entries += [
        make_legend_entry(ENDS[kind], linestyle="", marker=MARKS[kind], color="black")
        for kind in kinds
        if {(kind, True), (kind, False)} & drawn
    ]
    if any(not inside for _, inside in drawn):
        others = " or ".join("φ" if name == "phi" else name for name in _list_shared_parts(found, 0.0))
        entries.append(
            make_legend_entry(
                f"hollow: other {others}", linestyle="", marker="o", markerfacecolor="none", color="black"
            )
        )
    if grid.ndim > 1:
        entries += MapPlane.of(grid.axes, found.setup.motion, 0.4, 1.6).robot(figure, found.setup.all_samples.start)
    plots.draw_legend(figure, entries, paper)
    word = "legs " if all(each.is_segment_direction for each in found.setup.observed) else ""
    draw_heading(
        figure,
        f"{found.setup.robot.name}, {word}{', '.join(found.setup.labels)} observed: outcome of each "
        f"start\ngoal {plots.describe_pose(found.goal)}",
        grid,
        "; starts: ",
    )
    return print_figure(figure, paper)


def _describe_end(letter: str, end: BasinEnd) -> str:
    matched = f" {end.run_outcome.matched}" if end.run_outcome.matched else ""
    return f"{letter}  {end.run_outcome.name}{matched}: {100 * end.share:.3g} %"


def _strip(found: Basins, paper: Paper) -> tuple[Any, list[Any]]:
    """The figure of a line, and its one layer, without a plane."""
    ((name, values),) = found.grid.axes
    figure, (place,) = make_panels(1, 1, 7.0, 2.4, paper)
    edges = compute_cell_edges(convert_to_ticks(name, values))
    place.set(xlabel=label_axis(name), xlim=(edges[0], edges[-1]), ylim=(0, 1), yticks=[])
    return figure, [(place, None, found.cells, found.damped, None)]


def _draw_ends_on_line(place: Any, found: Basins) -> set[tuple[str, bool]]:
    """The ends where they lie, those of the line filled: which kinds are drawn, and whether as one of the line."""
    (name,) = found.grid.names
    (low, high), drawn = place.get_xlim(), set()
    for letter, each in zip(LETTERS, found.ends, strict=False):
        here = (
            None if each.X is None else float(convert_to_ticks(name, place_of(found.setup.motion, each.X, (name,)))[0])
        )
        if here is not None and low <= here <= high:
            inside = _is_end_in_view(found, each, None)
            place.plot(
                here,
                0.5,
                MARKS[each.run_outcome.name],
                markeredgecolor="black",
                markersize=11,
                clip_on=False,
                markerfacecolor="black" if inside else "none",
            )
            place.annotate(
                letter,
                (here, 0.5),
                (0, 13),
                textcoords="offset points",
                ha="center",
                path_effects=make_outline_strokes(),
            )
            drawn.add((each.run_outcome.name, inside))
    return drawn


def _draw_maps(found: Basins, paper: Paper) -> tuple[Any, list[Any]]:
    """The figure of a plane or a box, and its layers: axes, plane, cells, which are damped, value of the third part."""
    made = PoseMap.of(found.grid, found.setup.motion, paper)
    layers = [
        (place, made.plane, cells, damped, level)
        for (place, cells), (_, damped), level in zip(
            made.layers(found.cells), made.layers(found.damped), made.levels, strict=True
        )
    ]
    return made.figure, layers


def _draw_layer(place: Any, plane: MapPlane | None, cells: Places, damped: Flags, shades: list[str]) -> None:
    """Colours of starts, dots on those whose runs come to a singularity, and the letters of the basins."""
    from matplotlib.colors import ListedColormap
    from scipy.ndimage import distance_transform_edt

    values = np.where(cells == NOT_REACHED, np.nan, cells.astype(float))
    style = {"cmap": ListedColormap(shades), "vmin": -0.5, "vmax": len(shades) - 0.5}
    if plane is None:
        low, high = place.get_xlim()
        edges = np.linspace(low, high, len(cells) + 1)
        place.axvspan(low, high, zorder=0, linewidth=0, **plots.MISSING)
        place.pcolormesh(edges, [0, 1], np.ma.masked_invalid(values[None]), **style)
        if damped.any():
            place.pcolor(edges, [0, 1], np.ma.masked_where(~damped, damped.astype(float))[None], **DAMPED)
        return
    plane.cells(place, values, **style)
    if damped.any():
        corners = np.meshgrid(compute_cell_edges(plane.x), compute_cell_edges(plane.y), indexing="ij")
        middle = plane.at(*np.meshgrid(plane.x, plane.y, indexing="ij"))
        if min(damped.shape) > 1:
            place.contourf(*middle, damped.astype(float), levels=[0.5, 1.5], colors="none", hatches=["...."])
        else:
            place.pcolor(*plane.at(*corners), np.ma.masked_where(~damped, damped.astype(float)), **DAMPED)
    for number, letter in zip(range(len(shades)), LETTERS, strict=False):
        room = distance_transform_edt(np.pad(cells == number, 1))[1:-1, 1:-1]
        if room.max(initial=0.0) >= BASIN_LABEL_CELLS_MIN:
            i, j = np.unravel_index(np.argmax(room), room.shape)
            u, v = plane.at(plane.x[i], plane.y[j])
            place.text(u, v, letter, ha="center", va="center", weight="bold", path_effects=make_outline_strokes())


def _draw_certified(place: Any, plane: MapPlane, found: Basins, level: float | None) -> bool:
    """The border of what is certified, in a plane; a ring about it where it is too small to be seen: whether that is
    so."""
    if found.region is None or level is not None:
        return False
    near, inside = found.region
    u, v = plane.at(*np.meshgrid(*(convert_to_ticks(name, values) for name, values in near.axes), indexing="ij"))
    for colour, width in (("black", 3.4), ("white", 1.6)):
        place.contour(u, v, inside.astype(float), levels=[0.5], colors=[colour], linewidths=[width], zorder=4)
    small = (
        max(
            np.ptp(u[inside]) / np.ptp(plane.at(plane.x, plane.y[0])[0]),
            np.ptp(v[inside]) / np.ptp(plane.at(plane.x[0], plane.y)[1]),
        )
        < SEEN
    )
    if small:
        for colour, width in (("black", 3.4), ("white", 1.6)):
            place.plot(
                u[inside].mean(),
                v[inside].mean(),
                "o",
                markersize=RING,
                markerfacecolor="none",
                markeredgecolor=colour,
                markeredgewidth=width,
                zorder=4,
            )
    return bool(small)


def _is_end_in_view(found: Basins, end: BasinEnd, level: float | None) -> bool:
    """Return True if a final pose lies in a plane or line; ``level`` is the third coordinate of a plane of a box."""
    assert end.X is not None
    held = _list_shared_parts(found, level)
    away = np.abs(place_of(found.setup.motion, end.X, tuple(held)) - np.array(list(held.values())))
    return bool(np.all(away <= DRAWN_PLANE_DISTANCE_TOL * found.target.model.length))


def _list_shared_parts(found: Basins, level: float | None) -> dict[str, float]:
    """The parts of a pose that all poses of a plane or line share, with their values."""
    held = {name: values[0] for name, values in found.grid.fixed.given.items() if name != "rpy"}
    return held if level is None else {**held, **dict.fromkeys(found.grid.names[2:], level)}


def make_outline_strokes() -> list[Any]:
    """Return strokes of letters that are legible on any colour."""
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=2.5, foreground="white"), Normal()]


def _draw_ends(place: Any, plane: MapPlane, found: Basins, level: float | None) -> set[tuple[str, bool]]:
    """The ends where they lie, those of the plane filled: which kinds are drawn, and whether as one of the plane."""
    motion, drawn = found.setup.motion, set()
    spots: list[tuple[float, float, str]] = []
    for letter, each in zip(LETTERS, found.ends, strict=False):
        if each.X is None:
            continue
        values = place_of(motion, each.X, plane.names)
        x, y = (float(convert_to_ticks(name, value)) for name, value in zip(plane.names, values, strict=True))
        if not (plane.x[0] <= x <= plane.x[-1] and plane.y[0] <= y <= plane.y[-1]):
            continue
        u, v = plane.spots(values[None])
        inside = _is_end_in_view(found, each, level)
        place.plot(
            u,
            v,
            MARKS[each.run_outcome.name],
            markersize=14 if each.run_outcome.name == GOAL else 8,
            zorder=5,
            markerfacecolor="black" if inside else "none",
            markeredgecolor="black",
            markeredgewidth=1.2,
        )
        spots.append((float(u[0]), float(v[0]), letter))
        drawn.add((each.run_outcome.name, inside))
    points = place.get_window_extent().width * 72 / place.figure.dpi
    wide = np.ptp(plane.at(compute_cell_edges(plane.x), plane.y[0])[0])
    marks = np.array([spot[:2] for spot in spots]).reshape(-1, 2) * points / wide
    for (x, y, letter), offset in zip(spots, place_letters(marks, EQUILIBRIUM_LABEL_POINTS_COUNT), strict=True):
        place.annotate(
            letter,
            (x, y),
            offset,
            textcoords="offset points",
            fontsize=9,
            ha="center",
            va="center",
            zorder=6,
            path_effects=make_outline_strokes(),
        )
    return drawn


def place_letters(marks: Array, distance: float) -> list[tuple[float, float]]:
    """Return the offset of the letter of each mark (n, 2): the direction farthest from other marks and letters."""
    turns = 2 * np.pi * (np.arange(16) + 0.5) / 16
    ways = distance * np.column_stack([np.cos(turns), np.sin(turns)])
    taken, found = list(marks), list[tuple[float, float]]()
    for mark in marks:
        room = [min(float(np.linalg.norm(mark + way - each)) for each in taken) for way in ways]
        way = ways[int(np.argmax(np.round(room, 6)))]
        taken.append(mark + way)
        found.append((float(way[0]), float(way[1])))
    return found


def format_basin_table(found: Basins) -> bytes:
    """Return comma-separated values: a line per start (metres, radians), the outcome, and whether the run reached a
    singularity; empty if the robot cannot start."""
    rows: list[list[Any]] = [[*found.grid.names, "end", "outcome", "damped"]]
    places, marks = found.grid.places().tolist(), found.damped.ravel()
    for place, cell, damped in zip(places, found.cells.ravel(), marks, strict=True):
        told = ["", "", ""] if cell == NOT_REACHED else [LETTERS[cell], found.ends[cell].run_outcome.name, int(damped)]
        rows.append([*map(repr, place), *told])
    return encode_csv(rows)
