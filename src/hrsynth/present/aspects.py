"""Figure of aspects: the table of pairs of modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.aspects.aspects import AspectTable
from ..analysis.aspects.verdicts import SAME, SEPARATED, UNDECIDED
from ..errors import BadRequest
from . import plots
from .figure_format import PNG, Paper, print_figure
from .modes import explain_no_figure
from .palette import PAGE, SERIES, make_tint
from .plots import in_style, make_legend_entry, make_panels

CELLS = {
    SAME: (make_tint(PAGE["good"]), "="),
    SEPARATED: (make_tint(PAGE["wrong"]), "|"),
    UNDECIDED: (PAGE["line"], "?"),
}


def explain_no_table(found: AspectTable) -> str | None:
    """Return why there is no table."""
    return explain_no_figure(found.listed)


@in_style
def draw_aspects(found: AspectTable, paper: Paper = PNG) -> bytes:
    """Draw the figure; raise ``BadRequest`` if there are no modes."""
    why = explain_no_figure(found.listed)
    if why is not None:
        raise BadRequest(f"{found.listed.setup.robot.name}: there is nothing to draw: {why}")
    figure, axes = make_panels(1, 1, 5.4, 6.6, paper, (0.6, 1.8), 3.0)
    _draw_table(axes[0], found)
    entries = [
        make_legend_entry(verdict, linestyle="", marker="s", markersize=10, color=colour, markeredgecolor="0.5")
        for verdict, (colour, _) in CELLS.items()
        if any(verdict in row for row in found.table)
    ]
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
