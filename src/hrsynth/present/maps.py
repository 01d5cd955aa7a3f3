"""Figures and tables over poses: singularity distance, Type 2 locus, errors (MMT Figs. 19-21)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.check import MEASURES, UNREACHABLE
from ..analysis.configuration_report import CONSTRAINT, UNDECIDED
from ..analysis.singularity.locus import Locus
from ..errors import BadRequest
from ..geometry.vectors import Array
from . import palette, plots
from .figure_format import PNG, Paper, print_figure
from .plots import (
    MapPlane,
    convert_to_ticks,
    draw_heading,
    format_ticks,
    in_style,
    label_curve,
    label_joints,
    list_limit_entries,
    make_legend_entry,
    make_missing_entry,
    make_panels,
    round_ticks,
)
from .pose_map import PoseMap
from .text.tables import encode_csv

if TYPE_CHECKING:
    from ..analysis.accuracy.accuracy import Accuracy
    from ..analysis.accuracy.error_map import ErrorMap as ErrorField
    from ..analysis.check import Check
    from ..analysis.observed import ObservedRobot
    from ..analysis.singularity.locus import SingularityMap
    from ..analysis.singularity.singularities import Singularity
    from ..kinematics.platform_motion import PlatformMotion
    from ..mechanism.pose import Grid, Pose

MAP_DISTANCE_FLOOR_FRACTION = 1e-3
"""Fraction of the largest singularity distance on a map below which the colour is constant."""
DARKEST_SINGULAR_VALUE_MAX = 1e-6
"""Singular value below which the grey behind a locus is darkest."""

MARKS = {
    "type1": ("^", "Type 1"),
    "type2": ("o", "Type 2"),
    "type3": ("D", "Type 3"),
    CONSTRAINT: ("s", "constraint singularity"),
    UNDECIDED: ("X", "undecided"),
}
"""Markers of singular poses by state."""
VALUE = "smallest singular value of Mᵀ"
LOCI = {
    "hidden robot": (palette.get_colour("actuator"), "solid", "o"),
    "real robot": (palette.PAGE["ink"], "dashed", "s"),
}
SHADED_DECADES_MIN = 2.0
"""Decades of the distance that the shades of a locus map span at least: nothing is black far from a singularity."""
TYPE_1_BOUNDARY_FRACTION = 0.5
"""Fraction of its median below which the Type 1 distance marks a boundary of that kind."""
ERRORS = "cividis"
"""Colour scale with the same order for any colour vision."""
STROKES = (("black", 3.4), ("white", 1.6))
"""Colours and widths of a line that is visible on any colour, drawn over each other."""
ERROR_SCALE_END_FRACTION = 30.0
"""End of the scale, as a multiple of the median error."""


@in_style
def draw_distance_map(found: Check, paper: Paper = PNG) -> bytes:
    """Draw the Type 2 distance over a grid: a curve for a line of poses, a colour map for a plane, several for a box.

    Raise ``BadRequest`` if Mᵀ exists nowhere."""
    grid = found.grid
    assert grid is not None
    if all(value is None for value in grid.values("type2")):
        raise BadRequest(
            f"{found.setup.robot.name}: there is nothing to draw: Mᵀ exists nowhere",
            remedy="Choose another grid, or write a table (.csv).",
        )
    numbers = np.array([np.nan if value is None else value for value in grid.values("type2")]).reshape(grid.grid.shape)
    states, axes = np.array(grid.states).reshape(grid.grid.shape), label_joints(grid.grid, found.setup.robot)
    figure = (
        _draw_distance_curve(axes, numbers, states, grid.beyond, paper)
        if axes.ndim == 1
        else _draw_distance_maps(axes, numbers, states, grid.beyond, found.setup.motion, paper)
    )
    entries = [make_missing_entry()] if UNREACHABLE in grid.states else []
    entries += list_limit_entries(grid.beyond)
    entries += _draw_robot(figure, axes, found.setup)
    entries += [
        make_legend_entry(label, linestyle="", marker=mark, color=palette.get_colour("step4"), markeredgecolor="white")
        for state, (mark, label) in MARKS.items()
        if state in grid.states
    ]
    plots.draw_legend(figure, entries, paper)
    draw_heading(
        figure,
        f"{found.setup.robot.name}: Type 2 distance, legs {', '.join(found.setup.labels)} observed",
        grid.grid,
    )
    return print_figure(figure, paper)


def _draw_robot(figure: Any, grid: Grid, setup: ObservedRobot) -> list[Any]:
    """Draw the robot in the maps of a grid; return its entry in the legend."""
    return (
        [] if grid.ndim == 1 else MapPlane.of(grid.axes, setup.motion, 0.3, 2.0).robot(figure, setup.all_samples.start)
    )


def _draw_distance_maps(
    grid: Grid,
    numbers: Array,
    states: NDArray[np.str_],
    beyond: NDArray[np.bool_] | None,
    motion: PlatformMotion,
    paper: Paper,
) -> Any:
    from matplotlib.colors import LogNorm

    made = PoseMap.of(grid, motion, paper)
    low, high, _ = _scale(numbers)
    norm = LogNorm(low, high)
    for (place, distances), (_, state) in zip(made.layers(numbers), made.layers(states), strict=True):
        _draw_distances(place, made.plane, np.maximum(distances, low), state, norm)
    made.mark_beyond(beyond)
    made.scale(norm, "viridis", VALUE, "min" if np.nanmin(numbers) < low else "neither")
    return made.figure


def _draw_distances(place: Any, plane: MapPlane, numbers: Array, states: NDArray[np.str_], norm: Any) -> None:
    """Draw one plane: colours, white without Mᵀ, markers on singular cells."""
    plane.cells(place, numbers, norm=norm, cmap="viridis")
    blank = (states != UNREACHABLE) & ~np.isfinite(numbers)
    plane.cells(place, np.where(blank, 1.0, np.nan), cmap="gray", vmin=0, vmax=1)
    for state, (mark, _) in MARKS.items():
        i, j = np.nonzero(states == state)
        place.scatter(
            *plane.at(plane.x[i], plane.y[j]),
            marker=mark,
            s=26,
            color=palette.get_colour("step4"),
            edgecolor="white",
            linewidth=0.6,
        )


def _draw_distance_curve(
    grid: Grid, numbers: Array, states: NDArray[np.str_], beyond: NDArray[np.bool_] | None, paper: Paper
) -> Any:
    ((name, values),) = grid.axes
    x = convert_to_ticks(name, values)
    figure, (place,) = make_panels(1, 1, 7.0, 4.6, paper)
    low, high, ticks = _scale(numbers)
    floor = low / (high / low) ** 0.1 if np.nanmin(numbers) < low else low
    place.semilogy(x, np.where(numbers < low, np.nan, numbers), ".-", color="C0")
    place.minorticks_off()
    place.set_yticks(list(ticks), labels=format_ticks(ticks))
    for state, (mark, _) in MARKS.items():
        hit = states == state
        place.scatter(
            x[hit],
            np.fmax(numbers[hit], floor),
            marker=mark,
            s=36,
            color=palette.get_colour("step4"),
            edgecolor="white",
            linewidth=0.6,
            zorder=3,
        )
    label_curve(place, name, x, states == UNREACHABLE, VALUE, beyond)
    return figure


def _scale(numbers: Array) -> tuple[float, float, Array]:
    """Return the ends and ticks of a logarithmic scale for values that may be zero."""
    high = float(np.nanmax(numbers)) or 1.0
    regular = numbers[numbers > MAP_DISTANCE_FLOOR_FRACTION * high]
    low = float(regular.min()) if regular.size else MAP_DISTANCE_FLOOR_FRACTION * high
    low = low if low < 0.9 * high else 0.5 * high
    return low, high, round_ticks(low, high)


def check_table(found: Check) -> bytes:
    """Return comma-separated values: a line per pose (metres, radians), its state, and the values there."""
    assert found.grid is not None
    grid = found.grid
    poses = grid.grid.requests_at(np.ndindex(grid.grid.shape))
    given = [*poses[0].given]
    columns = {measure: grid.values(measure) for measure in MEASURES}
    if grid.beyond is not None:
        columns["beyond_limits"] = tuple(grid.beyond.ravel().tolist())
    rows: list[list[Any]] = [[*given, "state", *columns]]
    for i, (pose, state) in enumerate(zip(poses, grid.states, strict=True)):
        values = ["/".join(map(repr, pose.given[name])) for name in given]
        rows.append([*values, state, *("" if column[i] is None else repr(column[i]) for column in columns.values())])
    return encode_csv(rows)


def require_plane(
    setup: ObservedRobot, plane: Pose | str | None = None, grid: Grid | str | None = None, **_: Any
) -> None:
    """Raise the error of the plane, or the reason why there is no locus."""
    from ..analysis.singularity.locus import require_plane

    require_plane(setup, plane, grid)


def compute_singular_locus(
    found: Singularity, plane: Pose | str | None, grid: Grid | str | None, steps: int, seed: int
) -> Locus:
    """Compute the Type 2 locus over a plane of poses, or over a grid."""
    from ..analysis.singularity.locus import compute_locus

    return compute_locus(found.setup, plane=plane, grid=grid, steps=steps, seed=seed)


@in_style
def draw_locus_map(found: Singularity, drawn: Locus, paper: Paper = PNG) -> bytes:
    """Draw the Type 2 loci of the hidden and the real robot over a plane, the Type 1 boundary and unreached poses."""
    from matplotlib.patches import Patch

    plane = MapPlane.of(label_joints(drawn.grid, found.setup.robot).axes, found.setup.motion, 0.4, 1.6)
    figure, (place,) = make_panels(1, 1, 7.2, 6.0 * plane.tall + 1.6, paper)
    shaded = drawn.real if found.real and drawn.real is not None else drawn.hidden
    shade = np.log10(np.maximum(shaded.type2, DARKEST_SINGULAR_VALUE_MAX))
    plane.cells(
        place,
        np.where(np.isfinite(shaded.type2), shade, np.nan),
        cmap="Greys_r",
        vmin=min(np.nanmin(shade), np.nanmax(shade) - SHADED_DECADES_MIN),
        vmax=np.nanmax(shade) + 1.0,
    )
    borders = _draw_boundary(place, plane, drawn)
    entries: list[Any] = []
    for name, field in (("real robot", drawn.real), ("hidden robot", drawn.hidden)):
        if field is not None:
            entries.insert(0, _draw_locus_curve(place, plane, field, name))
    plane.finish(place, plane.x, plane.y)
    entries += [
        Patch(facecolor="0.5", label="darker: closer to Type 2" + " (real)" * (shaded is drawn.real)),
        *borders,
        *list_limit_entries(drawn.beyond),
    ]
    if drawn.beyond is not None:
        plane.beyond_limits(place, drawn.beyond)
    if not np.isfinite(drawn.hidden.type2).all():
        entries.append(make_missing_entry())
    entries += plane.robot(figure, found.setup.all_samples.start)
    plots.draw_legend(figure, entries, paper)
    draw_heading(
        figure,
        f"{found.setup.robot.name}: Type 2 singularities, legs {', '.join(found.setup.labels)} observed",
        drawn.grid,
    )
    return print_figure(figure, paper)


def _draw_locus_curve(place: Any, plane: MapPlane, field: SingularityMap, name: str) -> Any:
    """Draw the Type 2 locus, as a curve or as points; return its entry in the legend."""
    colour, style, mark = LOCI[name]
    met = field.signed and plane.sign_change(place, field.value, colour, 2.0, style)
    if len(field.spots):
        place.plot(*plane.spots(field.spots), mark, color=colour, markeredgecolor="white", markersize=9)
    if len(field.curve):
        _draw_pieces(place, plane, field.curve, colors=colour, linewidths=2.0, linestyles=style)
    shape = {"linestyle": style} if field.signed or len(field.curve) else {"linestyle": "", "marker": mark}
    met = met or bool(len(field.spots) or len(field.curve))
    never = " (never)" if field.everywhere else " (never where examined)"
    lacking = "" if met else never if field.never else " (none found)"
    return make_legend_entry(f"{name}: Type 2{lacking}", color=colour, linewidth=2.0, **shape)


def _draw_boundary(place: Any, plane: MapPlane, drawn: Locus) -> list[Any]:
    """Draw the boundary of the reached poses, coloured near a Type 1 singularity, of motors and joints near a Type 2
    singularity of the real robot; return the entries of the legend."""
    reached = np.isfinite(drawn.hidden.type2)
    padded = np.pad(reached, 1, mode="edge")
    inside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    border = reached & ~inside
    near = np.zeros_like(reached)
    joints, real = bool(drawn.grid.joints), drawn.real
    kind = "Type 2 boundary of the real robot" if joints else "Type 1 boundary"
    distances = [] if joints else [drawn.hidden.type1]
    distances += [] if real is None else [real.type2 if joints else real.type1]
    for distance in distances:
        padded = np.pad(np.where(reached, distance, np.inf), 2, constant_values=np.inf)
        around = [padded[i : i + reached.shape[0], j : j + reached.shape[1]] for i in range(5) for j in range(5)]
        near |= np.min(around, axis=0) < TYPE_1_BOUNDARY_FRACTION * np.nanmedian(distance)
    entries = []
    for cells, colour, words in (
        (border & near, palette.SERIES[1], kind),
        (border & ~near, "black", "other workspace boundary"),
    ):
        i, j = np.nonzero(cells)
        if len(i):
            place.scatter(*plane.at(plane.x[i], plane.y[j]), s=9, color=colour, marker="o", linewidth=0)
            entries.append(make_legend_entry(words, linestyle="", marker="o", markersize=4, color=colour))
    return entries


@in_style
def draw_error_map(found: Accuracy, paper: Paper = PNG) -> bytes:
    """Draw position and orientation errors: maps with the Type 2 locus and the workspace boundary for a plane, a row of
    maps for a box, curves for a line."""
    field = found.field
    assert field is not None
    shown = [
        (1e3 * field.position, "largest position error (mm)"),
        (np.degrees(field.orientation), "largest orientation error (deg)"),
    ]
    shown = [(values, label) for values, label in shown if np.nanmax(values, initial=0.0) > 0]
    if not shown:
        raise BadRequest("there is nothing to draw: the platform has no error", remedy="Choose another robot or grid.")
    axes = label_joints(field.grid, found.setup.robot)
    figure, locus = (
        _draw_error_curves(field, axes, shown, paper)
        if field.grid.ndim == 1
        else _draw_error_maps(field, axes, shown, found.setup.motion, paper)
    )
    plots.draw_legend(figure, _list_error_entries(field, locus) + _draw_robot(figure, axes, found.setup), paper)
    legs = ", ".join(f"{o.leg} {found.bounds.words(i, o)}" for i, o in enumerate(found.setup.observed))
    what = "observed legs" if all(o.is_segment_direction for o in found.setup.observed) else "observed"
    draw_heading(figure, f"{found.setup.robot.name}: largest errors\n{what}: {legs}", field.grid, "; ")
    return print_figure(figure, paper)


def _draw_error_maps(
    field: ErrorField, grid: Grid, shown: list[tuple[Array, str]], motion: PlatformMotion, paper: Paper
) -> tuple[Any, bool]:
    """Return the figure, and whether a Type 2 singularity is in it."""
    from matplotlib.colors import LogNorm

    made = PoseMap.of(grid, motion, paper, len(shown))
    plane, flat, locus = made.plane, field.grid.ndim == 2, False
    for number, (values, label) in enumerate(shown):
        low, high = _choose_scale_ends(values)
        norm = LogNorm(low, high)
        for k, (place, layer) in enumerate(made.layers(values, number)):
            plane.cells(place, np.where(np.isinf(layer), high, layer), norm=norm, cmap=ERRORS)
            missing = np.isnan(layer)
            if missing.any() and not missing.all():
                plane.contour(place, missing.astype(float), 0.5, "black", 1.6)
            if not flat and field.determinant is not None:
                locus |= _draw_loss(place, plane, field.determinant[..., k])
        made.scale(norm, ERRORS, label, "max" if np.nanmax(values) > high else "neither", number)
    made.mark_beyond(field.beyond)
    return made.figure, (flat and _locus(field, [place for (place,) in made.maps], plane)) or locus


def _choose_scale_ends(values: Array, highest: float = ERROR_SCALE_END_FRACTION) -> tuple[float, float]:
    """Return the ends of a logarithmic scale: the smallest error, and the largest unless it is far above the median."""
    finite = values[np.isfinite(values) & (values > 0)]
    low, high = float(finite.min()), float(min(finite.max(), highest * np.median(finite)))
    return (low, high) if high > 1.01 * low else (0.9 * low, 1.1 * low)


def _locus(field: ErrorField, places: Any, plane: MapPlane) -> bool:
    """Draw the Type 2 locus, white on black; return True if there is one."""
    from ..analysis.accuracy.singular_search import find_singular_poses

    if field.determinant is not None:
        return all([_draw_loss(place, plane, field.determinant) for place in places])
    if field.curve is not None:
        for place, (colour, width) in product(places, STROKES):
            _draw_pieces(place, plane, field.curve, colors=colour, linewidths=width)
        return len(field.curve) > 0
    spots = find_singular_poses(field)
    for place in places if len(spots) else ():
        place.plot(
            *plane.spots(spots), "o", color="white", markeredgecolor="black", markersize=3.2, markeredgewidth=0.7
        )
    return len(spots) > 0


def _draw_loss(place: Any, plane: MapPlane, determinant: Array) -> bool:
    """Draw the sign changes of a determinant, white on black; return True if there is one."""
    return all([plane.sign_change(place, determinant, colour, width) for colour, width in STROKES])


def _draw_pieces(place: Any, plane: MapPlane, curve: Array, **style: Any) -> None:
    """Draw pieces (k, 2, 2) of a curve."""
    from matplotlib.collections import LineCollection

    pieces = np.stack(plane.spots(curve.reshape(-1, 2)), axis=-1).reshape(curve.shape)
    place.add_collection(LineCollection(list(pieces), **style))


def _draw_error_curves(field: ErrorField, grid: Grid, shown: list[tuple[Array, str]], paper: Paper) -> tuple[Any, bool]:
    ((name, values),) = grid.axes
    x = convert_to_ticks(name, values)
    figure, axes = make_panels(len(shown), 1, 7.0, 3.0 * len(shown) + 1.2, paper)
    for place, (errors, label) in zip(axes, shown, strict=True):
        place.semilogy(x, np.where(np.isfinite(errors), errors, np.nan), ".-", color="C0")
        place.minorticks_off()
        ticks = round_ticks(*_choose_scale_ends(np.where(np.isfinite(errors), errors, np.nan), np.inf))
        place.set_yticks(list(ticks), labels=format_ticks(ticks))
        label_curve(place, name, x, np.isnan(errors), label, field.beyond)
    return figure, False


def _list_error_entries(field: ErrorField, locus: bool) -> list[Any]:
    """Return the legend entries of white lines or points, black lines and hatching."""
    from matplotlib.patheffects import Normal, Stroke

    entries = list_limit_entries(field.beyond)
    if locus:
        outlined = [Stroke(linewidth=3.4, foreground="black"), Normal()]
        spots = field.determinant is None and field.curve is None
        mark = {"marker": "o", "linestyle": ""} if spots else {"path_effects": outlined}
        entries.append(
            make_legend_entry(
                "Type 2 singularities of the hidden robot",
                color="white",
                linewidth=1.6,
                markeredgecolor="black",
                **mark,
            )
        )
    elif field.grid.ndim > 2 and field.determinant is None:
        entries.append(make_legend_entry("Type 2 singularities are not drawn", linestyle=""))
    if not field.reached.all():
        if field.grid.ndim > 1:
            entries.append(make_legend_entry("workspace boundary", color="black", linewidth=1.6))
        entries.append(make_missing_entry())
    return entries


def format_error_table(found: Accuracy) -> Iterator[bytes]:
    """Yield comma-separated values: a line per pose (metres, radians), empty if not reached, inf at Type 2
    singularities."""
    field = found.field
    assert field is not None
    columns = [1e3 * field.position.ravel(), np.degrees(field.orientation.ravel())]
    names = [*field.grid.names, "position_mm", "orientation_deg"]
    if field.beyond is not None:
        names, columns = [*names, "beyond_limits"], [*columns, field.beyond.ravel()]
    yield ",".join(names).encode() + b"\n"
    for place, *errors in zip(
        product(*(values.tolist() for _, values in field.grid.axes)),
        *(column.tolist() for column in columns),
        strict=True,
    ):
        cells = [*map(repr, place), *("" if error != error else repr(error) for error in errors)]
        yield ",".join(cells).encode() + b"\n"
