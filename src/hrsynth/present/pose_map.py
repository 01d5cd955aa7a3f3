"""A figure of maps: values over a plane of poses, or over a box, which has a map for each value of its third part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array
from ..kinematics.platform_motion import PlatformMotion
from ..mechanism.pose import Grid
from . import plots
from .figure_format import Paper
from .plots import MapPlane, compute_cell_edges, convert_to_ticks, format_ticks, make_panels, round_ticks

POSE_MAP_COLUMNS_MAX = 4
"""Maps beside each other at most."""
SIDE, SMALL = 5.4, 3.4
"""Width (inches) of a map of a plane, and of one of a box."""
LEAST_SIDE, LEAST_SMALL = 4.4, 2.4
"""The least width of these, where several stand beside each other."""
BAR, BELOW, ABOVE = 1.5, 0.8, 0.6
"""Room for the scale of colours, below each map, and for the title (inches)."""
SHORTEST, TALLEST = 0.4, 1.6
"""Height over width of a map."""


@dataclass(frozen=True, eq=False)
class PoseMap:
    """Maps of one or several quantities: their axes by quantity and by value of the third part, and these values (None:
    there is no third part)."""

    figure: Any
    plane: MapPlane
    maps: tuple[tuple[Any, ...], ...]
    levels: tuple[float | None, ...]

    @classmethod
    def of(cls, grid: Grid, motion: PlatformMotion, paper: Paper, quantities: int = 1) -> PoseMap:
        """Empty maps over a grid with two or three parts, with all that stands at their axes. The maps of a plane have
        a scale each, those of a box one for each quantity."""
        plane = MapPlane.of(grid.axes, motion, SHORTEST, TALLEST)
        name, values = (*grid.axes, ("", np.zeros(1)))[2]
        count = len(values) if name else quantities
        side, least = (SMALL, LEAST_SMALL) if name else (SIDE, LEAST_SIDE)
        columns = count if paper.given else paper.columns(min(count, POSE_MAP_COLUMNS_MAX), least)
        each = -(-count // columns)
        rows, bars = (quantities * each, 1) if name else (each, columns)
        figure, axes = make_panels(
            rows,
            columns,
            side * columns + BAR * bars,
            (side * plane.tall + BELOW) * rows + ABOVE,
            paper,
            (BAR * bars + 0.2 * columns, BELOW * rows + ABOVE),
            least if columns > 1 else 0.0,
        )
        table = np.reshape(axes, (quantities if name else 1, -1))
        for row in table:
            for k, place in enumerate(row):
                place.set_visible(k < count)
                plane.finish(place, compute_cell_edges(plane.x), compute_cell_edges(plane.y))
                if name and k < count:
                    plots.remove_inner_labels(place, k, columns, count)
                    plots.draw_layer_title(place, name, convert_to_ticks(name, values)[k])
        maps = table[:, :count] if name else table[0, :count, None]
        return cls(figure, plane, tuple(map(tuple, maps)), tuple(map(float, values)) if name else (None,))

    def layers(self, values: Any, quantity: int = 0) -> Iterator[tuple[Any, Any]]:
        """The axes of a quantity, each with its part of ``values`` (over the grid)."""
        parts = np.moveaxis(np.asarray(values).reshape(len(self.plane.x), len(self.plane.y), -1), -1, 0)
        return zip(self.maps[quantity], parts, strict=True)

    def mark_beyond(self, beyond: NDArray[np.bool_] | None) -> None:
        """Hatch the poses with joints beyond their limits in all maps; nothing without limits."""
        for quantity in range(len(self.maps)) if beyond is not None else ():
            for place, layer in self.layers(beyond, quantity):
                self.plane.beyond_limits(place, layer)

    def scale(self, norm: Any, colours: str, label: str, extend: str, quantity: int = 0) -> None:
        """The logarithmic scale of the colours of a quantity."""
        from matplotlib.cm import ScalarMappable

        ticks: Array = round_ticks(norm.vmin, norm.vmax)
        bar = self.figure.colorbar(
            ScalarMappable(norm, colours),
            ax=list(self.maps[quantity]),
            label=f"{label}, logarithmic",
            extend=extend,
            shrink=0.9,
        )
        bar.set_ticks(list(ticks), labels=format_ticks(ticks))
        bar.minorticks_off()
