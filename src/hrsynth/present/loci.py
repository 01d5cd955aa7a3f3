"""The locus of singular poses over a plane → a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.singularity.locus import Locus, SingularityMap
from ..analysis.singularity.singular import Singularity
from ..description.files import require_folder, write_whole
from ..errors import BadRequest
from ..geometry.vectors import Array
from .plots import axis_label, cell_edges, panels, png, tick_values

COLOURS = {"hidden robot": ("crimson", "solid", "o"), "real robot": ("royalblue", "dashed", "s")}
FLOOR = 1e-6
"""Singular values below this share the darkest grey."""
NEAR_TYPE_1 = 0.5
"""Fraction of its median to which the distance to Type 1 falls at a boundary of that kind."""


def locus_map(found: Singularity, drawn: Locus) -> bytes:
    """Type 2 loci of the hidden and the real robot over a plane, the Type 1 boundary and what is not reached (PNG)."""
    (xname, xs), (yname, ys) = drawn.grid.axes
    x, y = tick_values(xname, xs), tick_values(yname, ys)
    square = {xname, yname} <= set("xyz")
    tall = min(max(float(np.ptp(ys) / np.ptp(xs)), 0.4), 1.6) if square else 0.8
    figure, (place,) = panels(1, 1, 7.2, 6.0 * tall + 1.6)
    reached = np.isfinite(drawn.hidden.type2)
    place.set_facecolor("0.85")
    place.patch.set(hatch="///", edgecolor="0.6")
    shade = np.log10(np.maximum(drawn.hidden.type2, FLOOR))
    shown = np.ma.masked_invalid(np.where(reached, shade, np.nan)).T
    place.pcolormesh(cell_edges(x), cell_edges(y), shown, cmap="Greys_r",
                     vmin=np.nanmin(shade), vmax=np.nanmax(shade) + 1.0)
    _boundary(place, x, y, drawn)
    for name, field in (("real robot", drawn.real), ("hidden robot", drawn.hidden)):
        if field is not None:
            _field(place, x, y, field, xname, yname, name)
    place.set(xlabel=axis_label(xname), ylabel=axis_label(yname), xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    if square:
        place.set_aspect("equal")
    _legend(figure, drawn)
    legs = ", ".join(found.setting.labels)
    fixed = str(drawn.grid.fixed).replace(",", ", ").replace("=", " = ")
    figure.suptitle(f"{found.setting.robot.name}: Type 2 singularities, legs {legs} observed"
                    + (f"\n{fixed} (m, rad)" if fixed else ""), fontsize=11)
    return png(figure)


def writable(path: str | None, plane: str | None) -> None:
    """Raise ``BadRequest`` where a plane has no file to be drawn in, or the file's ending is no format."""
    if path is None and plane is not None:
        raise BadRequest("a plane of poses is drawn", plane, "--plane together with --output FILE.png")
    if path is not None and Path(path).suffix.lower() != ".png":
        raise BadRequest("cannot draw the locus: unknown ending", path, ".png")
    if path is not None:
        require_folder(path)


def write(found: Singularity, drawn: Locus, path: str) -> None:
    """Draw the locus in a file, whole or not at all."""
    write_whole(path, locus_map(found, drawn))


def _field(place: Any, x: Array, y: Array, field: SingularityMap, xname: str, yname: str, name: str) -> None:
    colour, style, mark = COLOURS[name]
    if field.signed and np.nanmin(field.value) < 0 < np.nanmax(field.value):
        place.contour(x, y, np.ma.masked_invalid(field.value).T, levels=[0.0], colors=[colour], linestyles=[style],
                      linewidths=2.0)
    for spot in field.spots:
        place.plot(tick_values(xname, spot[:1]), tick_values(yname, spot[1:]), mark, color=colour,
                   markeredgecolor="white", markersize=9)


def _boundary(place: Any, x: Array, y: Array, drawn: Locus) -> None:
    """The reached poses at the border, those near a Type 1 singularity in orange."""
    reached = np.isfinite(drawn.hidden.type2)
    padded = np.pad(reached, 1)
    inside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    border = reached & ~inside
    near = np.zeros_like(reached)
    for field in (drawn.hidden, drawn.real):
        if field is not None:
            padded = np.pad(np.where(reached, field.type1, np.inf), 2, constant_values=np.inf)
            around = [padded[i : i + reached.shape[0], j : j + reached.shape[1]] for i in range(5) for j in range(5)]
            near |= np.min(around, axis=0) < NEAR_TYPE_1 * np.nanmedian(field.type1)
    for cells, colour in ((border & near, "darkorange"), (border & ~near, "black")):
        i, j = np.nonzero(cells)
        place.scatter(x[i], y[j], s=9, color=colour, marker="o", linewidth=0)


def _legend(figure: Any, drawn: Locus) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = []
    for name, field in (("hidden robot", drawn.hidden), ("real robot", drawn.real)):
        if field is None:
            continue
        colour, style, mark = COLOURS[name]
        curve = field.signed
        met = len(field.spots) > 0 or (curve and np.nanmin(field.value) < 0 < np.nanmax(field.value))
        empty = "" if met else " (none here)"
        shape: dict[str, Any] = {"linestyle": style} if curve else {"linestyle": "", "marker": mark}
        entries.append(Line2D([], [], color=colour, linewidth=2.0, label=f"{name}: Type 2{empty}", **shape))
    entries += [Line2D([], [], linestyle="", marker="o", markersize=4, color="darkorange", label="Type 1 boundary"),
                Line2D([], [], linestyle="", marker="o", markersize=4, color="black", label="other limit of reach"),
                Patch(facecolor="0.85", edgecolor="0.6", hatch="///", label="not reached")]
    figure.legend(handles=entries, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
