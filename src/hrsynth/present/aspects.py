"""Figure of aspects: the table of modes, and of three rods on cranks the curve of Type 2 singularities, in the plane of
two directions and on the surface of poses with the third direction fixed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.aspects.aspects import AspectTable
from ..analysis.aspects.singularity_slice import SingularitySlice
from ..analysis.aspects.three_cranks import CrankPlace, count_modes
from ..analysis.aspects.verdicts import SAME, SEPARATED, UNDECIDED
from ..errors import BadRequest
from ..geometry.vectors import Array
from . import plots
from .figure_format import PNG, Paper, print_figure
from .modes import explain_no_figure
from .palette import MEANINGS, PAGE, SERIES, make_tint
from .plots import compute_cell_edges, in_style, make_legend_entry, make_panels

CELLS = {
    SAME: (make_tint(PAGE["good"]), "="),
    SEPARATED: (make_tint(PAGE["wrong"]), "|"),
    UNDECIDED: (PAGE["line"], "?"),
}
CURVE, CUSP, NODE = "black", SERIES[1], SERIES[2]
STAR = {"color": MEANINGS["goal"][1], "markeredgecolor": "black"}
"""Marker of the goal."""
SHADES = ("white", *(make_tint(SERIES[0], share) for share in (0.1, 0.22, 0.4)))
"""Colours of no mode, two, four, six."""
ASPECT_PANEL_WIDTH_MIN = 3.0
"""The least width (inches) of one of several drawings."""
COUNTED, PLACES = 161, 480
"""Directions per side for which modes are counted, and samples of the first corner for that."""


@dataclass(frozen=True, eq=False)
class DrawnSection:
    """Drawn section: the curve and the modes, or the reason for its absence."""

    found: tuple[SingularitySlice, dict[int, CrankPlace]] | None
    reason: str | None

    def to_dict(self) -> dict[str, Any]:
        """Return the section, or the reason for its absence."""
        return {"reason": self.reason} if self.found is None else self.found[0].to_dict()


def compute_section(found: AspectTable, seed: int) -> DrawnSection:
    """Return the section with the first observed leg fixed."""
    made = found.section
    return DrawnSection(None, made) if isinstance(made, str) else DrawnSection(made, None)


def explain_no_table(found: AspectTable) -> str | None:
    """Return why there is no table."""
    return explain_no_figure(found.listed)


@in_style
def draw_aspects(found: AspectTable, drawn: DrawnSection, paper: Paper = PNG) -> bytes:
    """Draw the figure; raise ``BadRequest`` if there are no modes."""
    why = explain_no_figure(found.listed)
    if why is not None:
        raise BadRequest(f"{found.listed.setup.robot.name}: there is nothing to draw: {why}")
    count = 1 if drawn.found is None else 3
    columns = paper.columns(count, ASPECT_PANEL_WIDTH_MIN)
    rows = -(-count // columns)
    figure, axes = make_panels(
        rows, columns, 5.4 * columns, 5.4 * rows + 1.2, paper, (0.6 * columns, 0.6 * rows + 1.2), ASPECT_PANEL_WIDTH_MIN
    )
    for place in axes[count:]:
        place.set_visible(False)
    _draw_table(axes[0], found)
    entries = [
        make_legend_entry(verdict, linestyle="", marker="s", markersize=10, color=colour, markeredgecolor="0.5")
        for verdict, (colour, _) in CELLS.items()
        if any(verdict in row for row in found.table)
    ]
    if drawn.found is not None:
        entries += _draw_curves(axes[1:3], found, *drawn.found)
    plots.draw_legend(figure, entries, paper)
    seen = ", ".join(found.listed.setup.labels)
    told = ", cuspidal" if found.cuspidal else ""
    figure.suptitle(
        f"{found.listed.setup.robot.name}, legs {seen} observed\n{found.listed.count}, "
        f"aspects: {found.aspects_met}{told}"
    )
    return print_figure(figure, paper)


def _choose_colour(found: AspectTable, number: int) -> str:
    """One colour for all modes of an aspect."""
    groups = [k for k, group in enumerate(found.groups) if number in group]
    return SERIES[groups[0] % len(SERIES)] if groups else "0.6"


def _draw_table(place: Any, found: AspectTable) -> None:
    size = len(found.table)
    for i, row in enumerate(found.table):
        for j, verdict in enumerate(row):
            colour, sign = CELLS[verdict]
            place.fill([j, j + 1, j + 1, j], [i, i, i + 1, i + 1], facecolor=colour, edgecolor="white", linewidth=1.5)
            if size <= 20:
                place.text(j + 0.5, i + 0.5, sign, ha="center", va="center", color="0.35")
    for axis, name in ((place.xaxis, "x"), (place.yaxis, "y")):
        axis.set_ticks(np.arange(size) + 0.5, [str(k + 1) for k in range(size)])
        for k, label in enumerate(axis.get_ticklabels()):
            label.set(color=_choose_colour(found, k + 1), fontweight="bold")
        place.tick_params(axis=name, length=0)
    place.set(xlim=(0, size), ylim=(size, 0), aspect="equal", title="pairs of modes")
    place.set_frame_on(False)


def _draw_curves(axes: Any, found: AspectTable, drawn: SingularitySlice, modes: dict[int, CrankPlace]) -> list[Any]:
    """Both views of the section, all angles counted from the goal's; the entries of the legend."""
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch
    from matplotlib.ticker import MultipleLocator

    goal = next(iter(modes.values()))
    first, second = np.angle(goal.rods[1:])
    crank = float(np.angle(goal.cranks[0]))
    labels = drawn.robot.labels
    there, here = axes
    ticks = np.linspace(-np.pi, np.pi, COUNTED)
    counts = count_modes(drawn.robot, drawn.held, ticks + first, ticks + second, PLACES)
    there.pcolormesh(
        compute_cell_edges(np.degrees(ticks)),
        compute_cell_edges(np.degrees(ticks)),
        counts.T,
        cmap=ListedColormap(SHADES),
        norm=BoundaryNorm([-1, 1, 3, 5, 7], 4),
        rasterized=True,
    )
    for piece in drawn.curve:
        _draw_broken_line(there, piece[:, 2] - first, piece[:, 3] - second)
        _draw_broken_line(here, piece[:, 0] - crank, piece[:, 1])
    for points, colour, mark in ((drawn.cusps, CUSP, "o"), ([a for a, _ in drawn.nodes], NODE, "s")):
        for point in points:
            style = {
                "marker": mark,
                "color": colour,
                "markersize": 5,
                "markerfacecolor": colour if point.radius is not None else "white",
            }
            one, other = point.directions
            there.plot(*_list_degree_ticks(one - first, other - second), zorder=4, **style)
            if mark == "o":
                here.plot(*_list_degree_ticks(point.crank - crank, point.turn), zorder=4, **style)
    there.plot(0, 0, "*", **STAR, markersize=15, zorder=5)
    for number, at in modes.items():
        x, y = _list_degree_ticks(float(np.angle(at.cranks[0])) - crank, at.turn)
        here.plot(
            x,
            y,
            "o",
            color=_choose_colour(found, number),
            markeredgecolor="black",
            markersize=13,
            zorder=5,
            clip_on=False,
        )
        here.text(x, y, str(number), ha="center", va="center", color="white", fontsize=9, fontweight="bold", zorder=6)
    there.set(
        xlabel=f"direction of leg {labels[1]} (deg from the goal)",
        ylabel=f"direction of leg {labels[2]} (deg from the goal)",
        title=f"directions, leg {labels[0]} fixed",
    )
    here.set(
        xlabel=f"crank {labels[0]} (deg from the goal)",
        ylabel="φ (deg from the goal)",
        title=f"poses, leg {labels[0]} fixed",
    )
    for place, used in ((there, counts > 0), (here, np.ones((COUNTED, COUNTED), dtype=bool))):
        shown = [np.degrees(ticks[np.flatnonzero(used.any(axis=axis))[[0, -1]]]) for axis in (1, 0)]
        place.set(xlim=shown[0], ylim=shown[1], box_aspect=1)
        place.xaxis.set_major_locator(MultipleLocator(30 if np.ptp(shown[0]) < 240 else 60))
        place.yaxis.set_major_locator(MultipleLocator(30 if np.ptp(shown[1]) < 240 else 60))
    kinds = [
        make_legend_entry("Type 2 singularities", color=CURVE, linewidth=1.2),
        make_legend_entry("directions of the goal", linestyle="", marker="*", markersize=11, **STAR),
    ]
    nodes = [place for place, _ in drawn.nodes]
    for points, colour, mark, name in ((drawn.cusps, CUSP, "o", "cusp"), (nodes, NODE, "s", "node")):
        for proved, words in ((True, f"{name}, enclosed"), (False, f"{name}, numerical")):
            if any((point.radius is not None) == proved for point in points):
                kinds.append(
                    make_legend_entry(
                        words, linestyle="", marker=mark, color=colour, markerfacecolor=colour if proved else "white"
                    )
                )
    return [
        *kinds,
        *(
            Patch(facecolor=shade, edgecolor="0.6", label=f"{number} modes")
            for shade, number in zip(SHADES, (0, 2, 4, 6), strict=True)
            if np.any(counts == number)
        ),
    ]


def _list_degree_ticks(*angles: float) -> tuple[float, ...]:
    """Angles (rad) as degrees from −180 to 180."""
    return tuple(float(np.degrees((angle + np.pi) % (2 * np.pi) - np.pi)) for angle in angles)


def _draw_broken_line(place: Any, x: Array, y: Array) -> None:
    """A line of angles (rad), broken where it passes ±180 degrees."""
    flat = np.degrees((np.column_stack([x, y]) + np.pi) % (2 * np.pi) - np.pi)
    flat[1:][np.max(np.abs(np.diff(flat, axis=0)), axis=1) > 180] = np.nan
    place.plot(*flat.T, color=CURVE, linewidth=1.2, zorder=3)
