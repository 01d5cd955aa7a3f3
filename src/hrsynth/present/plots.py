"""Common parts of all plots: figures, axes over coordinates of a pose, maps of values over a plane, unreached poses."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from importlib.util import find_spec
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import BadRequest, MissingExtra
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import PlatformMotion
from ..mechanism import Mechanism
from ..mechanism.pose import ANGLES, TURNS, Grid, JointPose, Pose
from ..results import Result
from .figure_format import BESIDE, GIVEN_LEGEND, PNG, GivenFigure, Paper, draw_legend_within, print_figure
from .skeleton import trace_leg_outlines, trace_link_outline
from .sketch import Sketch, label_axis
from .view.view import find_plane_normal

STYLE = "hrsynth.present.style"
"""Style of all plots, ``style.mplstyle`` of this folder."""
FIGURE_PADDING_INCHES_MIN = 0.07
"""Left free about axes, titles and legends (inches)."""
AXIS_TICKS_MIN = 3
OWN_WIDTH, OWN_HEIGHT = 4.5, 3.5
"""A figure that an answer draws itself (inches)."""
DEGREES = " (degrees)"
"""End of the label of an angle."""
PRINTED_DECIMALS_COUNT = 6
"""Decimals of metres and degrees in words."""
Asked = ParamSpec("Asked")
Given = TypeVar("Given")

MISSING: dict[str, Any] = {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "///"}
"""Style of unreached poses."""
BEYOND: dict[str, Any] = {"facecolor": "none", "edgecolor": "black", "hatch": r"\\", "linewidth": 0}
"""Style of poses with joints beyond their limits."""
ROBOT: dict[str, Any] = {"color": "black", "alpha": 0.3, "linewidth": 1.2}
"""How a robot is drawn in a map of its poses."""


def require_matplotlib() -> None:
    """Raise ``MissingExtra`` if matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise MissingExtra("drawing", "plots")


def in_style(draw: Callable[Asked, Given]) -> Callable[Asked, Given]:
    """Decorate a function that draws: style of all plots, names unchanged, a ``$`` in them too."""

    @wraps(draw)
    def drawn(*given: Asked.args, **named: Asked.kwargs) -> Given:
        require_matplotlib()
        import matplotlib.style

        if getattr(named.get("paper"), "given", ()):  # the style of the figure that has these axes
            return draw(*given, **named)
        with matplotlib.style.context([STYLE, {"text.parse_math": False}]), warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph \d+ ")  # drawn as a box
            return draw(*given, **named)

    return drawn


def make_empty_figure(width: float, height: float, **style: Any) -> Any:
    """A figure of this size (inches) without axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), **style)
    FigureCanvasAgg(figure)
    return figure


def make_panels(
    rows: int,
    columns: int,
    width: float,
    height: float,
    paper: Paper = PNG,
    around: tuple[float, float] = (1.2, 1.2),
    least: float = 0.0,
) -> tuple[Any, Any]:
    """A figure and its axes, row by row: ``width``, ``height`` (inches) where the paper has room, and else narrower
    with axes of the same shape; ``around`` is what is not axes, ``least`` the width that each needs. Raise
    ``BadRequest`` if the paper has given axes of another number."""
    if paper.given:
        require_axes_count(paper, rows * columns)
        return GivenFigure(paper.given), paper.given
    wide = paper.axes(width, least * columns)
    height = around[1] + (height - around[1]) * (wide - around[0]) / (width - around[0])
    figure = make_empty_figure(wide, height, layout="constrained")
    figure.get_layout_engine().set(w_pad=FIGURE_PADDING_INCHES_MIN, h_pad=FIGURE_PADDING_INCHES_MIN)
    return figure, figure.subplots(rows, columns, squeeze=False).ravel()


def require_axes_count(paper: Paper, count: int) -> None:
    """Raise ``BadRequest`` unless a figure of so many panels fits the given axes."""
    if len(paper.given) != count:
        raise BadRequest("ax: number of axes for this figure", len(paper.given), f"{count}, one for each panel")


def convert_to_ticks(name: str, values: Array) -> Array:
    """The values of a part of a pose, or of a joint by its label, as they are drawn: angles in degrees."""
    return np.degrees(values) if name in ANGLES or name.endswith(DEGREES) else values


def label_joints(grid: Grid, robot: Mechanism) -> Grid:
    """Return a grid whose axes, if they are joints, have the labels with which they are drawn."""
    if not grid.joints:
        return grid
    units = (DEGREES if unit == "rad" else f" ({unit})" for unit in grid.list_units(robot))
    return replace(
        grid, axes=tuple((name + unit, values) for (name, values), unit in zip(grid.axes, units, strict=True))
    )


def compute_cell_edges(values: Array) -> Array:
    """The borders of cells around equally spaced values."""
    half = (values[1] - values[0]) / 2
    return np.append(values - half, values[-1] + half)


def round_ticks(low: float, high: float) -> Array:
    """Round numbers (1, 2, 5 times a power of ten) between the ends of a logarithmic scale; where these are too few,
    those of an even one."""
    from matplotlib.ticker import MaxNLocator

    powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    slack = 1e-9 * high
    for steps in ((1.0,), (1.0, 2.0, 5.0)):
        found = np.sort(np.outer(powers, steps).ravel())
        found = found[(found >= low - slack) & (found <= high + slack)]
        if len(found) >= AXIS_TICKS_MIN:
            return np.asarray(found[:: -(-len(found) // 8)])
    even = np.array(MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(low, high))
    return np.asarray(even[(even >= low - slack) & (even <= high + slack)])


def format_ticks(ticks: Array) -> list[str]:
    """Round numbers as they are written."""
    return [
        np.format_float_positional(value, 3, fractional=False, trim="-")
        if 1e-4 <= abs(value) < 1e5 or value == 0
        else f"{value:.3g}"
        for value in ticks
    ]


@dataclass(frozen=True, eq=False)
class MapPlane:
    """Two parts of a pose as the axes of a map: their names, and their values as they are drawn. In a plane of motion
    that is tilted in the base, a pose is drawn at ``shear`` (2, 2) times its two values and ``offset`` (2,), along axes
    of the plane itself."""

    names: tuple[str, str]
    x: Array
    y: Array
    tall: float
    """Height over width, 0.8 unless both parts are lengths."""
    labels: tuple[str, str]
    shear: Array
    offset: Array
    across: Array
    """The base directions (2, 3) that its axes show, where both parts are lengths."""

    @classmethod
    def of(cls, axes: Sequence[tuple[str, Array]], motion: PlatformMotion, least: float, most: float) -> MapPlane:
        """The first two axes of a grid; height over width between ``least`` and ``most``."""
        (xname, xs), (yname, ys) = axes[:2]
        made = cls(
            (xname, yname),
            convert_to_ticks(xname, xs),
            convert_to_ticks(yname, ys),
            0.8,
            *_choose_own_axes((xname, yname), motion),
        )
        if not {xname, yname} <= set("xyz"):
            return made
        u, v = made.at(*np.meshgrid(made.x, made.y, indexing="ij"))
        return replace(made, tall=min(max(float(np.ptp(v) / np.ptp(u)), least), most))

    def spots(self, values: Array) -> tuple[Array, Array]:
        """Return the positions in the map of poses whose two coordinates have ``values`` (n, 2) (m, rad)."""
        return self.at(*(convert_to_ticks(name, column) for name, column in zip(self.names, values.T, strict=True)))

    def at(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return the positions in the map of values of the two coordinates (of one shape, angles in degrees)."""
        u, v = (row[0] * x + row[1] * y + start for row, start in zip(self.shear, self.offset, strict=True))
        return u, v

    def cells(self, place: Any, values: Array, **style: Any) -> None:
        """Colours, one a cell; hatched grey where a value is not finite, white beyond the grid."""
        place.grid(False)
        corners = np.meshgrid(compute_cell_edges(self.x), compute_cell_edges(self.y), indexing="ij")
        u, v = (each[[0, -1, -1, 0], [0, 0, -1, -1]] for each in self.at(*corners))
        place.fill(u, v, linewidth=0, zorder=0, **MISSING)
        place.pcolormesh(*self.at(*corners), np.ma.masked_invalid(values), **style)

    def beyond_limits(self, place: Any, beyond: NDArray[np.bool_]) -> None:
        """Hatch the cells at which joints are beyond their limits."""
        x, y = (
            np.concatenate([e[:1], values, e[-1:]]) for values in (self.x, self.y) for e in [compute_cell_edges(values)]
        )
        if beyond.any():
            drawn = place.contourf(
                *self.at(*np.meshgrid(x, y, indexing="ij")),
                np.pad(beyond.astype(float), 1, mode="edge"),
                levels=[0.5, 1.5],
                colors="none",
                hatches=[BEYOND["hatch"]],
            )
            drawn.set(edgecolor=BEYOND["edgecolor"], linewidth=0)

    def robot(self, figure: Any, at: ClosedConfiguration) -> list[Any]:
        """Draw the robot to scale, faintly, in all maps of a figure of lengths; its entry in the legend."""
        from matplotlib.collections import LineCollection

        if not set(self.names) <= set("xyz"):
            return []
        platform = at.model.mechanism.platform
        outer = trace_link_outline(at.model.mechanism, platform, at.pose(platform))
        strokes = [each for each in (*trace_leg_outlines(at, (platform,)), outer) if np.ptp(each, axis=0).any()]
        if not strokes:
            return []
        for place in figure.axes:
            if place.get_visible() and place.get_label() != "<colorbar>":
                drawn = LineCollection([stroke @ self.across.T for stroke in strokes], zorder=1.5, **ROBOT)
                place.add_collection(drawn, autolim=False)
        return [make_legend_entry("robot at its zero pose", **ROBOT)]

    def contour(self, place: Any, values: Array, level: float, colour: str, width: float, style: str = "solid") -> None:
        """Draw where values are at a level."""
        place.contour(
            *self.at(*np.meshgrid(self.x, self.y, indexing="ij")),
            np.ma.masked_invalid(values),
            levels=[level],
            colors=[colour],
            linestyles=[style],
            linewidths=[width],
        )

    def sign_change(self, place: Any, values: Array, colour: str, width: float, style: str = "solid") -> bool:
        """Draw the sign changes of values; return True if there is one."""
        if not np.nanmin(values) < 0 < np.nanmax(values):
            return False
        self.contour(place, values, 0.0, colour, width, style)
        return True

    def finish(self, place: Any, x: Array | None = None, y: Array | None = None) -> None:
        """Name the axes, show the values from the first to the last of ``x`` and ``y``; equal scales of two lengths."""
        place.set(xlabel=label_axis(self.labels[0]), ylabel=label_axis(self.labels[1]))
        if x is not None and y is not None:
            u, v = self.at(*np.meshgrid(x[[0, -1]], y[[0, -1]], indexing="ij"))
            place.set(xlim=(u.min(), u.max()), ylim=(v.min(), v.max()))
        if set(self.names) <= set("xyz"):
            place.set_aspect("equal")


def _choose_own_axes(names: tuple[str, str], motion: PlatformMotion) -> tuple[tuple[str, str], Array, Array, Array]:
    """The names of the axes along which a pose is drawn, and how it lies along them: the parts themselves, but for a
    plane of motion that is no coordinate plane."""
    normal = find_plane_normal(motion) if set(names) <= set("xyz") else None
    sketch = None if normal is None else Sketch.of(normal, np.zeros((1, 3)), ())
    if sketch is None or set(sketch.names) <= set("xyz"):
        return names, np.eye(2), np.zeros(2), np.eye(3)[["xyz".find(name) for name in names]]
    chosen = np.eye(3)["xyz".index(names[0])], np.eye(3)["xyz".index(names[1])]
    home = motion.position(motion.home)
    moved = motion.translations @ np.linalg.inv(np.array(chosen) @ motion.translations)
    shear = sketch.axes @ moved
    first, second = sketch.names
    return (first, second), shear, sketch.axes @ (home - moved @ np.array(chosen) @ home), sketch.axes


def remove_inner_labels(place: Any, k: int, columns: int, count: int) -> None:
    """Leave out the names and numbers of axes that stand at the map beside or below too: map ``k`` of ``count`` in
    ``columns`` has them at the left and where no map is below."""
    if k % columns:
        place.set_ylabel("")
        place.tick_params(labelleft=False)
    if k + columns < count:
        place.set_xlabel("")
        place.tick_params(labelbottom=False)


def draw_layer_title(place: Any, name: str, value: float) -> None:
    """The value of the third part of a pose over a map."""
    place.set_title(f"{label_axis(name)}: {value:.4g}", fontsize=10)


def label_curve(
    place: Any, name: str, x: Array, missing: Array, label: str, beyond: NDArray[np.bool_] | None = None
) -> None:
    """Finish a curve over one part of a pose: names, grey where nothing is reached, hatched beyond joint limits."""
    edges = compute_cell_edges(x)
    for k in [] if beyond is None else np.flatnonzero(beyond):
        place.axvspan(edges[k], edges[k + 1], **BEYOND)
    for k in np.flatnonzero(missing):
        place.axvspan(edges[k], edges[k + 1], linewidth=0, **MISSING)
    place.set(xlabel=label_axis(name), ylabel=label, xlim=(edges[0], edges[-1]))
    place.grid()


def draw_heading(figure: Any, text: str, grid: Grid, before: str = "\n") -> None:
    """Set the title, followed by the coordinates that a grid keeps, angles in degrees."""
    words = grid.fixed_text if {*TURNS} & {*grid.names} else describe_pose(grid.fixed)
    figure.suptitle(text + (f"{before}{words}" if words else ""))


def describe_pose(pose: Pose | JointPose) -> str:
    """Format a pose with its units, angles in degrees."""
    if isinstance(pose, JointPose):
        return str(pose)
    told = Pose.parse(pose.shown) if pose.shown else pose
    return ", ".join(_describe_fixed_parts(name, values) for name, values in told.given.items())


def _describe_fixed_parts(name: str, values: Sequence[float]) -> str:
    if name in "xyz":
        return f"{name} = {round(values[0], PRINTED_DECIMALS_COUNT) + 0.0:.4g} m"
    turned = "/".join(f"{value:.4g}" for value in np.round(np.degrees(values), PRINTED_DECIMALS_COUNT) + 0.0)
    return f"{'φ' if name == 'phi' else name} = {turned}°"


def make_legend_entry(label: str, **style: Any) -> Any:
    """A mark or line in a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def list_limit_entries(beyond: NDArray[np.bool_] | None) -> list[Any]:
    """Return the legend entry of poses with joints beyond their limits, if there are any."""
    from matplotlib.patches import Patch

    return [] if beyond is None or not beyond.any() else [Patch(label="beyond joint limits", **BEYOND)]


def make_missing_entry() -> Any:
    """Return the legend entry of unreached poses."""
    from matplotlib.patches import Patch

    return Patch(label="not reached", **MISSING)


def draw_legend(figure: Any, entries: Sequence[Any], paper: Paper) -> None:
    """The legend beside the axes, or below where the paper is narrow, where there is something to explain."""
    if not entries:
        return
    if paper.given:
        paper.given[0].legend(handles=entries, **GIVEN_LEGEND)
        return
    wide = figure.get_figwidth()
    if wide + BESIDE <= paper.room + 1e-9:
        figure.set_figwidth(wide + BESIDE)
        figure.legend(handles=entries, loc="outside right center", labelspacing=0.8)
    else:
        tall = draw_legend_within(figure, list(entries), wide, loc="outside lower center")
        figure.set_figheight(figure.get_figheight() + tall)


@in_style
def draw_own_figure(found: Result, paper: Paper = PNG) -> bytes:
    """The figure that an answer draws itself."""
    figure, (place,) = make_panels(1, 1, OWN_WIDTH, OWN_HEIGHT, paper)
    found.plot(place)
    return print_figure(figure, paper)
