"""What all plots share: figures, axes over parts of a pose, maps of values over a plane, what is not reached."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..mechanism.pose import Pose

MISSING: dict[str, Any] = {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "///"}
"""How what is not reached is drawn."""


def png(figure: Any) -> bytes:
    """The bytes of a matplotlib figure as PNG; ``savefig`` would draw it twice."""
    stream = io.BytesIO()
    figure.set_dpi(150)
    figure.canvas.print_png(stream, pil_kwargs={"compress_level": 3})
    return stream.getvalue()


def empty_figure(width: float, height: float, **style: Any) -> Any:
    """A figure of this size (inches) without axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), **style)
    FigureCanvasAgg(figure)
    return figure


def panels(rows: int, columns: int, width: float, height: float) -> tuple[Any, Any]:
    """A figure (width, height in inches) and its axes, row by row."""
    figure = empty_figure(width, height, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False).ravel()


def axis_label(name: str) -> str:
    """What stands at the axis of a part of a pose."""
    return "φ (degrees)" if name == "phi" else f"{name} (m)"


def tick_values(name: str, values: Array) -> Array:
    """The values of a part of a pose as they are drawn: angles in degrees."""
    return np.degrees(values) if name == "phi" else values


def cell_edges(values: Array) -> Array:
    """The borders of cells around equally spaced values."""
    half = (values[1] - values[0]) / 2
    return np.append(values - half, values[-1] + half)


@dataclass(frozen=True, eq=False)
class MapPlane:
    """Two parts of a pose as the axes of a map: their names, and their values as they are drawn."""

    names: tuple[str, str]
    x: Array
    y: Array
    tall: float
    """Height over width, 0.8 unless both parts are lengths."""

    @classmethod
    def of(cls, axes: Sequence[tuple[str, Array]], least: float, most: float) -> MapPlane:
        """The first two axes of a grid; height over width between ``least`` and ``most``."""
        (xname, xs), (yname, ys) = axes[:2]
        tall = min(max(float(np.ptp(ys) / np.ptp(xs)), least), most) if {xname, yname} <= set("xyz") else 0.8
        return cls((xname, yname), tick_values(xname, xs), tick_values(yname, ys), tall)

    def cells(self, place: Any, values: Array, **style: Any) -> None:
        """Colours, one a cell; hatched grey where a value is not finite."""
        place.set_facecolor(MISSING["facecolor"])
        place.patch.set(hatch=MISSING["hatch"], edgecolor=MISSING["edgecolor"])
        place.pcolormesh(cell_edges(self.x), cell_edges(self.y), np.ma.masked_invalid(values.T), **style)

    def sign_change(self, place: Any, values: Array, colour: str, width: float, style: str = "solid") -> bool:
        """Draw where values change their sign; whether they do."""
        if not np.nanmin(values) < 0 < np.nanmax(values):
            return False
        place.contour(self.x, self.y, np.ma.masked_invalid(values).T, levels=[0.0], colors=[colour], linestyles=[style],
                      linewidths=[width])
        return True

    def finish(self, place: Any, **limits: Any) -> None:
        """Name the axes; equal scales of two lengths."""
        place.set(xlabel=axis_label(self.names[0]), ylabel=axis_label(self.names[1]), **limits)
        if set(self.names) <= set("xyz"):
            place.set_aspect("equal")


def layer_title(place: Any, name: str, value: float) -> None:
    """The value of the third part of a pose over a map."""
    place.set_title(f"{axis_label(name)}: {value:.4g}", fontsize=10)


def along(place: Any, name: str, x: Array, missing: Array, label: str, which: str = "major") -> None:
    """Finish a curve over one part of a pose: names, grey where nothing is reached."""
    edges = cell_edges(x)
    for k in np.flatnonzero(missing):
        place.axvspan(edges[k], edges[k + 1], linewidth=0, **MISSING)
    place.set(xlabel=axis_label(name), ylabel=label, xlim=(edges[0], edges[-1]))
    place.grid(alpha=0.3, which=which)


def heading(figure: Any, text: str, fixed: Pose, before: str = "\n") -> None:
    """The title, and after it what the plot holds fixed."""
    words = str(fixed).replace(",", ", ").replace("=", " = ")
    figure.suptitle(text + (f"{before}{words} (m, rad)" if words else ""), fontsize=11)


def entry(label: str, **style: Any) -> Any:
    """A mark or line in a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def missing_entry() -> Any:
    """What is not reached, in a legend."""
    from matplotlib.patches import Patch

    return Patch(label="not reached", **MISSING)


def legend(figure: Any, entries: Sequence[Any], columns: int, **style: Any) -> None:
    """The legend below, where there is something to explain."""
    if entries:
        figure.legend(handles=entries, loc="outside lower center", ncols=columns, frameon=False, **style)
