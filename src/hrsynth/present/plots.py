"""Results → pictures (PNG)."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.check import UNREACHABLE, Check, GridCheck
from ..analysis.posture import CONSTRAINT, UNDECIDED
from ..errors import BadRequest
from ..geometry.vectors import Array

MARKS = {"type1": ("^", "Type 1"), "type2": ("o", "Type 2"), "type3": ("D", "Type 3"),
         CONSTRAINT: ("s", "constraint singularity"), UNDECIDED: ("X", "not decided")}
FLOOR = 1e-3
"""Values below this part of the largest share one colour."""
VALUE = "smallest singular value of $M^T$"


def png(figure: Any) -> bytes:
    """The bytes of a matplotlib figure as PNG; ``savefig`` would draw it twice."""
    stream = io.BytesIO()
    figure.set_dpi(150)
    figure.canvas.print_png(stream, pil_kwargs={"compress_level": 3})
    return stream.getvalue()


def distance_map(found: Check) -> bytes:
    """The distance to Type 2 singularities over a grid: a curve for a line of poses, a colour map for a plane, one map
    for each value of the third part for a box. Raises ``BadRequest`` where Mᵀ exists nowhere."""
    grid = found.grid
    assert grid is not None
    if all(value is None for value in grid.values("type2")):
        what = "no pose of the grid is reached" if set(grid.states) == {UNREACHABLE} else "Mᵀ exists nowhere"
        raise BadRequest(f"{found.setting.robot.name}: there is nothing to draw: {what}", None,
                         "another grid, or a table (.csv)")
    figure = _curve(grid) if grid.grid.ndim == 1 else _maps(grid)
    legs = ", ".join(found.setting.labels)
    fixed = str(grid.grid.fixed).replace(",", ", ").replace("=", " = ")
    figure.suptitle(f"{found.setting.robot.name}: distance to Type 2 singularities, legs {legs} observed"
                    + (f"\n{fixed} (m, rad)" if fixed else ""), fontsize=11)
    return png(figure)


def panels(rows: int, columns: int, width: float, height: float) -> tuple[Any, Any]:
    """A figure (width, height in inches) and its axes, row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False).ravel()


def axis_label(name: str) -> str:
    """What stands at the axis of a part of a pose."""
    return "φ (degrees)" if name == "phi" else f"{name} (m)"


def tick_values(name: str, values: Array) -> Array:
    """The values of a part of a pose as they are drawn: angles in degrees."""
    return np.degrees(values) if name == "phi" else values


def _numbers(grid: GridCheck) -> Array:
    """The singular values in the grid's shape, those of singular poses zero; NaN where there is none."""
    values = [np.nan if value is None else value for value in grid.values("type2")]
    return np.array(values).reshape(grid.grid.shape)


def _scale(numbers: Array) -> tuple[float, float, Array]:
    """The ends of a logarithmic scale for values that may be zero, and places for its ticks."""
    high = float(np.nanmax(numbers)) or 1.0
    regular = numbers[numbers > FLOOR * high]
    low = float(regular.min()) if regular.size else FLOOR * high
    low = low if low < 0.9 * high else 0.5 * high
    return low, high, np.geomspace(low, high, 6)


def _states(grid: GridCheck) -> NDArray[np.str_]:
    return np.array(grid.states).reshape(grid.grid.shape)


def cell_edges(values: Array) -> Array:
    """The borders of cells around equally spaced values."""
    half = (values[1] - values[0]) / 2
    return np.append(values - half, values[-1] + half)


def _maps(grid: GridCheck) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    (xname, xs), (yname, ys) = grid.grid.axes[:2]
    layers = grid.grid.axes[2:] or (("", np.zeros(1)),)
    pname, ps = layers[0]
    numbers, states = _numbers(grid), _states(grid)
    if grid.grid.ndim == 2:
        numbers, states = numbers[..., None], states[..., None]
    columns = min(len(ps), 4)
    rows = -(-len(ps) // columns)
    size = 3.6 if columns > 1 else 5.6
    square = {xname, yname} <= set("xyz")
    tall = min(max(float(np.ptp(ys) / np.ptp(xs)), 0.3), 2.0) if square else 0.8
    figure, axes = panels(rows, columns, size * columns + 1.4, (size * tall + 0.7) * rows + 0.8)
    low, high, ticks = _scale(numbers)
    norm = LogNorm(low, high)
    x, y = tick_values(xname, xs), tick_values(yname, ys)
    for k, place in enumerate(axes[: len(ps)]):
        _map(place, x, y, np.maximum(numbers[..., k], low), states[..., k], norm)
        place.set(xlabel=axis_label(xname), ylabel=axis_label(yname))
        if pname:
            place.set_title(f"{axis_label(pname)}: {tick_values(pname, ps)[k]:.4g}", fontsize=10)
        if square:
            place.set_aspect("equal")
    for place in axes[len(ps):]:
        place.set_visible(False)
    below = "min" if np.nanmin(numbers) < low else "neither"
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), ax=list(axes), label=f"{VALUE} (logarithmic)", extend=below)
    bar.set_ticks(list(ticks), labels=[f"{value:.2g}" for value in ticks])
    bar.minorticks_off()
    _legend(figure, set(states.ravel()))
    return figure


def _map(place: Any, x: Array, y: Array, numbers: Array, states: NDArray[np.str_], norm: Any) -> None:
    """One plane: colours, hatched grey where no pose is reached, marks on singular cells."""
    place.set_facecolor("0.85")
    place.patch.set(hatch="///", edgecolor="0.6")
    place.pcolormesh(cell_edges(x), cell_edges(y), np.ma.masked_invalid(numbers.T), norm=norm, cmap="viridis")
    blank = (states != UNREACHABLE) & ~np.isfinite(numbers)
    place.pcolormesh(cell_edges(x), cell_edges(y), np.ma.masked_where(~blank.T, blank.T), cmap="gray", vmin=0, vmax=1)
    for state, (mark, _) in MARKS.items():
        i, j = np.nonzero(states == state)
        place.scatter(x[i], y[j], marker=mark, s=26, color="red", edgecolor="white", linewidth=0.6)


def _curve(grid: GridCheck) -> Any:
    ((name, values),) = grid.grid.axes
    x, numbers, states = tick_values(name, values), _numbers(grid), _states(grid)
    figure, (place,) = panels(1, 1, 7.0, 4.6)
    low, high, ticks = _scale(numbers)
    floor = low / (high / low) ** 0.1 if np.nanmin(numbers) < low else low
    place.semilogy(x, np.where(numbers < low, np.nan, numbers), ".-", color="C0")
    place.minorticks_off()
    place.set_yticks(list(ticks), labels=[f"{value:.2g}" for value in ticks])
    edges = cell_edges(x)
    for k in np.nonzero(states == UNREACHABLE)[0]:
        place.axvspan(edges[k], edges[k + 1], facecolor="0.85", edgecolor="0.6", hatch="///", linewidth=0)
    for state, (mark, _) in MARKS.items():
        hit = states == state
        place.scatter(x[hit], np.fmax(numbers[hit], floor), marker=mark, s=36, color="red",
                      edgecolor="white", linewidth=0.6, zorder=3)
    place.set(xlabel=axis_label(name), ylabel=VALUE, xlim=(edges[0], edges[-1]))
    place.grid(alpha=0.3)
    _legend(figure, set(states))
    return figure


def _legend(figure: Any, states: set[str]) -> None:
    """What hatching and marks mean, of those that occur."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = []
    if UNREACHABLE in states:
        entries.append(Patch(facecolor="0.85", edgecolor="0.6", hatch="///", label="not reached"))
    entries += [Line2D([], [], linestyle="", marker=mark, color="red", markeredgecolor="white", label=label)
                for state, (mark, label) in MARKS.items() if state in states]
    if entries:
        figure.legend(handles=entries, loc="outside lower center", ncols=len(entries), frameon=False)
