"""Error maxima over a plane, line or box of poses → a picture or a table (MMT Figs. 19-21)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.accuracy.accuracy import Accuracy
from ..analysis.accuracy.field import Field
from ..analysis.accuracy.singular_search import singular_poses
from ..description.files import require_folder, write_whole
from ..errors import BadRequest
from ..geometry.vectors import Array
from .plots import axis_label, cell_edges, panels, png, tick_values

FORMATS = (".png", ".csv")
COLOURS = "cividis"
"""A scale that readers with any colour vision see in the same order."""
HIGHEST = 30.0
"""Multiple of the median error at which the scale ends."""


def writable(path: str | None, cells: str | None) -> None:
    """Raise ``BadRequest`` where there is nothing to write, or the ending of the name is no format."""
    if path is None:
        return
    if cells is None:
        raise BadRequest("only a plane or a grid is written", path, "--output together with --plane or --grid")
    if Path(path).suffix.lower() not in FORMATS:
        raise BadRequest("cannot write the errors: unknown ending", path, FORMATS)
    require_folder(path)


def write(found: Accuracy, path: str) -> None:
    """Write the errors, whole or not at all."""
    assert found.field is not None
    write_whole(path, error_map(found) if Path(path).suffix.lower() == ".png" else table(found.field))


def table(field: Field) -> Iterator[bytes]:
    """Comma-separated values: a line a pose (metres, radians), empty where it is not reached, inf where a freedom is
    lost."""
    yield ",".join((*field.grid.names, "position_mm", "orientation_deg")).encode() + b"\n"
    columns = 1e3 * field.position.ravel(), np.degrees(field.orientation.ravel())
    for place, *errors in zip(product(*(values.tolist() for _, values in field.grid.axes)),
                              *(column.tolist() for column in columns), strict=True):
        cells = [*map(repr, place), *("" if error != error else repr(error) for error in errors)]
        yield ",".join(cells).encode() + b"\n"


def error_map(found: Accuracy) -> bytes:
    """Position and orientation errors (the latter where there are any): maps with the singular locus and the border of
    what is reached drawn over for a plane, a row of maps for a box, curves for a line (PNG)."""
    field = found.field
    assert field is not None
    shown = [(1e3 * field.position, "largest position error (mm)"),
             (np.degrees(field.orientation), "largest orientation error (degrees)")]
    shown = [(values, label) for values, label in shown if np.nanmax(values, initial=0.0) > 0]
    if not shown:
        raise BadRequest("there is nothing to draw", str(field.grid.fixed), "a robot whose platform has errors")
    figure = _curves(field, shown) if field.grid.ndim == 1 else _maps(field, shown)
    legs = ", ".join(f"{o.leg} within {np.degrees(cone):.3g}°"
                     for o, cone in zip(found.setting.observed, found.cones, strict=True))
    fixed = str(field.grid.fixed).replace(",", ", ").replace("=", " = ")
    figure.suptitle(f"{found.setting.robot.name}: largest errors\nobserved legs: {legs}"
                    + (f"; {fixed} (m, rad)" if fixed else ""), fontsize=11)
    return png(figure)


def _maps(field: Field, shown: list[tuple[Array, str]]) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    (xname, xs), (yname, ys) = field.grid.axes[:2]
    pname, ps = field.grid.axes[2] if field.grid.ndim == 3 else ("", np.zeros(1))
    square = {xname, yname} <= set("xyz")
    tall = min(max(float(np.ptp(ys) / np.ptp(xs)), 0.4), 1.6) if square else 0.8
    plane = field.grid.ndim == 2
    rows, columns = (1, len(shown)) if plane else (len(shown), len(ps))
    size = 5.0 if plane else 3.0
    figure, axes = panels(rows, columns, size * columns + (1.4 * len(shown) if plane else 1.4),
                          (size * tall + 0.8) * rows + (0.5 if plane else 0.0))
    x, y = tick_values(xname, xs), tick_values(yname, ys)
    locus = False
    for number, (values, label) in enumerate(shown):
        low, high = _ends(values)
        norm = LogNorm(low, high)
        places = axes[number : number + 1] if plane else axes[number * columns : (number + 1) * columns]
        for k, place in enumerate(places):
            layer = values if plane else values[..., k]
            _map(place, x, y, layer, norm)
            _border(place, x, y, np.isnan(layer))
            if not plane and field.determinant is not None:
                locus |= _curve(place, x, y, field.determinant[..., k])
            place.set(xlabel=axis_label(xname), ylabel=axis_label(yname), xlim=cell_edges(x)[[0, -1]],
                      ylim=cell_edges(y)[[0, -1]])
            if pname:
                place.set_title(f"{axis_label(pname)}: {tick_values(pname, ps)[k]:.4g}", fontsize=10)
            if square:
                place.set_aspect("equal")
        bar = figure.colorbar(ScalarMappable(norm, COLOURS), ax=list(places), label=f"{label}, logarithmic",
                              extend="max" if np.nanmax(values) > high else "neither", shrink=0.9)
        ticks = np.geomspace(low, high, 6) if high > 1.3 * low else np.array([np.nanmin(values)])
        bar.set_ticks(list(ticks), labels=[np.format_float_positional(value, 2, fractional=False, trim="-")
                                         for value in ticks])
        bar.minorticks_off()
    locus |= plane and _locus(field, axes[: len(shown)], x, y)
    _legend(figure, field, locus)
    return figure


def _ends(values: Array) -> tuple[float, float]:
    """The ends of a logarithmic scale: the smallest error, and the largest unless that is far above the median."""
    finite = values[np.isfinite(values) & (values > 0)]
    low, high = float(finite.min()), float(min(finite.max(), HIGHEST * np.median(finite)))
    return (low, high) if high > 1.01 * low else (0.9 * low, 1.1 * low)


def _map(place: Any, x: Array, y: Array, values: Array, norm: Any) -> None:
    place.set_facecolor("0.85")
    place.patch.set(hatch="///", edgecolor="0.6")
    cells = np.ma.masked_array(np.where(np.isinf(values), norm.vmax, values), np.isnan(values)).T
    place.pcolormesh(cell_edges(x), cell_edges(y), cells, norm=norm, cmap=COLOURS)


def _border(place: Any, x: Array, y: Array, missing: Array) -> None:
    """The line between the cells that are reached and those that are not."""
    if missing.any() and not missing.all():
        place.contour(x, y, missing.T.astype(float), levels=[0.5], colors=["black"], linewidths=1.6)


def _locus(field: Field, places: Any, x: Array, y: Array) -> bool:
    """Draw where a freedom is lost, white on black; whether there is such a pose."""
    if field.determinant is not None:
        return all([_curve(place, x, y, field.determinant) for place in places])
    spots = singular_poses(field)
    for place in places if len(spots) else ():
        columns = [tick_values(name, spots[:, k]) for k, name in enumerate(field.grid.names)]
        place.plot(*columns, "o", color="white", markeredgecolor="black", markersize=3.2, markeredgewidth=0.7)
    return len(spots) > 0


def _curve(place: Any, x: Array, y: Array, determinant: Array) -> bool:
    """Draw where a determinant changes its sign, white on black; whether it does."""
    if not np.nanmin(determinant) < 0 < np.nanmax(determinant):
        return False
    for colour, width in (("black", 3.4), ("white", 1.6)):
        place.contour(x, y, np.ma.masked_invalid(determinant).T, levels=[0.0], colors=[colour], linewidths=[width])
    return True


def _curves(field: Field, shown: list[tuple[Array, str]]) -> Any:
    ((name, values),) = field.grid.axes
    x = tick_values(name, values)
    figure, axes = panels(len(shown), 1, 7.0, 3.0 * len(shown) + 1.2)
    edges = cell_edges(x)
    for place, (errors, label) in zip(axes, shown, strict=True):
        place.semilogy(x, np.where(np.isfinite(errors), errors, np.nan), ".-", color="C0")
        for k in np.flatnonzero(np.isnan(errors)):
            place.axvspan(edges[k], edges[k + 1], facecolor="0.85", edgecolor="0.6", hatch="///", linewidth=0)
        place.set(xlabel=axis_label(name), ylabel=label, xlim=(edges[0], edges[-1]))
        place.grid(alpha=0.3, which="both")
    _legend(figure, field, False)
    return figure


def _legend(figure: Any, field: Field, locus: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.patheffects import Normal, Stroke

    entries: list[Any] = []
    if locus:
        outlined = [Stroke(linewidth=3.4, foreground="black"), Normal()]
        mark = {"marker": "o", "linestyle": ""} if field.determinant is None else {"path_effects": outlined}
        entries.append(Line2D([], [], color="white", linewidth=1.6, markeredgecolor="black",
                              label="Type 2 singularities of the hidden robot", **mark))
    if not field.reached.all():
        if field.grid.ndim > 1:
            entries.append(Line2D([], [], color="black", linewidth=1.6, label="border of what is reached"))
        entries.append(Patch(facecolor="0.85", edgecolor="0.6", hatch="///", label="not reached"))
    if entries:
        columns = 3 if figure.get_figwidth() > 8 else 1
        figure.legend(handles=entries, loc="outside lower center", ncols=columns, frameon=False, fontsize=9)
