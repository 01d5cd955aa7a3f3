"""Curves, surfaces and numbered points in a plane or in space, with equal scales, on matplotlib axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from ..analysis.freedoms import format_point
from ..geometry.vectors import Array, find_perpendicular
from ..mechanism.pose import ANGLES
from ..results import Value
from ..tolerances import DIRECTION_SINE_TOL


def label_axis(name: str) -> str:
    """Return the label of the axis of a pose coordinate, or of a joint's that has it (:func:`.plots.label_joints`)."""
    if name.endswith(")"):
        return name
    return f"{'φ' if name == 'phi' else name} (degrees)" if name in ANGLES else f"{name} (m)"


SKETCH_MARGIN_FRACTION = 0.06
"""Space about what is drawn, over its extent."""
DISTINCT_POINTS_FRACTION = 0.15
"""Distance on the page, over the extent of what is drawn, beyond which two points are clearly distinct."""
CURVE_WIDTH_MIN_FRACTION = 0.35
"""Part of its width that a curve may keep on the page to be seen well."""
SURFACE_LINES_COUNT = 12
"""Lines drawn on a surface each way."""
SPACE_LABEL_INCHES_MIN = 0.42
"""Room for scales and their names about axes in space (inches)."""
NAME_ON_AXIS, NUMBER_ON_AXIS, NAME_GAP = -21.0, -8.0, 3.0
"""The pads with which matplotlib writes a name, and numbers, on an axis in space; the room between both (points)."""
CLEAR, NEAREST = 26.0, 9.0
"""Distances (points) between numbers and marks, and between numbers and curves, that are enough."""

Box = tuple[float, float, float, float]
"""Left, bottom, width, height as parts of the figure."""


@dataclass(frozen=True, eq=False, repr=False)
class Sketch(Value):
    """Projection of points (3,) of the base frame: along ``axes`` (k, 3), k = 2 in a plane and 3 in space, seen from
    ``view`` (elevation and azimuth in degrees)."""

    axes: Array
    names: tuple[str, ...]
    view: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def of(cls, normal: Array | None, spots: Array, curves: Sequence[Array]) -> Sketch:
        """In the plane with this ``normal``, or in space from where the points ``spots`` (n, 3) are seen well apart and
        ``curves`` not from their edge or end."""
        if normal is None:
            return cls(np.eye(3), ("x", "y", "z"), _choose_view(spots, curves))
        flat = [i for i in range(3) if abs(float(normal[i])) < DIRECTION_SINE_TOL]
        if len(flat) == 2:
            return cls(np.eye(3)[flat], tuple("xyz"[i] for i in flat))
        first = find_perpendicular(normal, (1.0, 0.0, 0.0))
        axes = np.array([first, np.cross(normal, first)])
        return cls(axes, tuple(f"along {format_point(axis)}" for axis in axes))

    @property
    def is_flat(self) -> bool:
        """Return True if everything is in a plane."""
        return len(self.axes) == 2

    def place(self, figure: Any, box: Box, extent: Array, bare: bool = False) -> Any:
        """Axes in a box of the figure that hold the points ``extent`` (n, 3); ``bare`` without scales."""
        from matplotlib.ticker import MaxNLocator

        seen = extent @ self.axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        margin = SKETCH_MARGIN_FRACTION * float(np.max(high - low))
        if self.is_flat:
            place = figure.add_axes(box, aspect="equal")
            half = np.full(2, float(np.max(high - low)) / 2 + margin)
            limits = np.column_stack([(low + high) / 2 - half, (low + high) / 2 + half])
            place.grid(alpha=0.25)
            place.set_axisbelow(True)
        else:
            place = figure.add_axes(box, projection="3d", proj_type="ortho", computed_zorder=False)
            place.view_init(*self.view)
            place.tick_params(labelsize=8, pad=1)
            limits = np.column_stack([low - margin, high + margin])
            place.set_box_aspect(limits[:, 1] - limits[:, 0])
            for axis in (place.xaxis, place.yaxis, place.zaxis):
                axis.set_major_locator(MaxNLocator(4, prune="both"))
        for name, ends, words in zip("xyz", limits, self.names, strict=False):
            getattr(place, f"set_{name}lim")(*ends)
            getattr(place, f"set_{name}label")(label_axis(words))
        if bare:
            place.set_axis_off()
        if not self.is_flat:
            self._fill(
                place, extent if bare else np.array(list(product(*limits))), 0.0 if bare else SPACE_LABEL_INCHES_MIN
            )
        if not (self.is_flat or bare):
            _name_axes(place)
        return place

    def _fill(self, place: Any, points: Array, labels: float) -> None:
        """Zoom and shift axes in space so that ``points`` (n, 3) fill their box but for ``labels`` inches all round."""
        figure = place.figure
        whole = place.get_position()
        size = figure.get_size_inches()
        wanted = np.array([whole.width, whole.height]) * size - 2 * labels
        ranges = [end - start for start, end in (place.get_xlim(), place.get_ylim(), place.get_zlim())]
        place.set_box_aspect(ranges, zoom=float(np.min(wanted / np.ptp(self._inches(place, points), axis=0))))
        found = self._inches(place, points)
        middle = (found.min(axis=0) + found.max(axis=0)) / 2 / size
        x, y = np.array([(whole.x0 + whole.x1) / 2, (whole.y0 + whole.y1) / 2]) - middle
        place.set_position((whole.x0 + x, whole.y0 + y, whole.width, whole.height))

    def _inches(self, place: Any, points: Array) -> Array:
        """Project points (n, 3) to the page, (n, 2)."""
        place.apply_aspect()
        return self._on_page(place, points)[:, :2] / 72.0

    def stroke(self, place: Any, points: Array, **style: Any) -> None:
        """A polyline (n, 3)."""
        place.plot(*(points @ self.axes.T).T, clip_on=False, **style)

    def surface(self, place: Any, points: Array, colour: str) -> None:
        """A translucent surface (m, n, 3) with some of its own lines; in a plane the lines alone."""
        if not self.is_flat:
            place.plot_surface(
                *np.moveaxis(points, -1, 0),
                rcount=points.shape[0],
                ccount=points.shape[1],
                color=colour,
                alpha=0.16,
                linewidth=0,
                shade=False,
                clip_on=False,
                zorder=1,
            )
        for across in (points, points.swapaxes(0, 1)):
            for k in np.unique(np.linspace(0, len(across) - 1, SURFACE_LINES_COUNT).astype(int)):
                self.stroke(place, across[k], color=colour, linewidth=0.6, alpha=0.55, zorder=2)

    def numbers(
        self, place: Any, spots: Array, texts: Sequence[str], colours: Sequence[str], lines: Sequence[Array]
    ) -> None:
        """Texts beside points (n, 3), each on the side where least is in the way: points, texts, polylines."""
        from matplotlib.patheffects import withStroke

        at, near = self._on_page(place, spots), self._on_page(place, np.vstack([*map(_refine_polyline, lines), spots]))
        for each, text, colour, where in zip(at, texts, colours, _place_beside(at, near), strict=True):
            place.annotate(
                text,
                each[2:],
                xytext=where,
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=12,
                fontweight="bold",
                color=colour,
                zorder=9,
                path_effects=[withStroke(linewidth=3, foreground="white")],
            )

    def _on_page(self, place: Any, points: Array) -> Array:
        """Points (n, 3) as (n, 4): where they are on the page (points), and what ``annotate`` takes."""
        if self.is_flat:
            data = points @ self.axes.T
        else:
            seen = np.column_stack([points, np.ones(len(points))]) @ place.get_proj().T
            data = seen[:, :2] / seen[:, 3:]
        scale = 72.0 / place.figure.dpi
        return np.hstack([place.transData.transform(data) * scale, data])


def _name_axes(place: Any) -> None:
    """Move the names of axes in space to just beyond their scales: matplotlib has them farther off the larger a robot
    is drawn. Names and numbers are off the axis one way, in proportion to their pads from where these are on it."""
    axes, middles = (place.xaxis, place.yaxis, place.zaxis), []
    for pad in (NAME_ON_AXIS, 0.0):
        for axis in axes:
            axis.labelpad = pad
        place.figure.draw_without_rendering()
        middles.append([_locate_middle(axis.label) for axis in axes])
    for axis, at, there in zip(axes, *middles, strict=True):
        away = (there - at) / -NAME_ON_AXIS
        ticks = axis.get_major_ticks()
        sizes = [text.get_window_extent().size for text in (axis.label, *(tick.label1 for tick in ticks))]
        step = float(np.linalg.norm(away))
        half = np.abs(away) / step @ (sizes[0] + np.max(sizes[1:], axis=0)) / 2
        clear = (half + NAME_GAP * place.figure.dpi / 72) / step
        axis.labelpad = NAME_ON_AXIS - NUMBER_ON_AXIS + ticks[0].get_pad() + clear


def _locate_middle(text: Any) -> Array:
    return np.asarray(text.get_window_extent().corners().mean(axis=0))


def _place_beside(at: Array, curves: Array) -> Iterator[tuple[float, float]]:
    """An offset (points) for the text of each of the places ``at``."""
    taken = [*at[:, :2]]
    turns = np.radians(np.arange(0, 360, 30) + 45.0)
    around = np.column_stack([np.cos(turns), np.sin(turns)])
    offsets = np.vstack([14.0 * around, 19.0 * around])
    for own in range(len(at)):

        def room(offset: Array, own: int = own) -> float:
            text = at[own, :2] + offset
            others = min(
                (float(np.linalg.norm(text - each)) for k, each in enumerate(taken) if k != own), default=CLEAR
            )
            curve = float(np.min(np.linalg.norm(curves[:, :2] - text, axis=1), initial=NEAREST))
            return 2.0 * min(others, CLEAR) / CLEAR + curve / NEAREST - 0.002 * float(np.linalg.norm(offset))

        best = max(offsets, key=room)
        taken.append(at[own, :2] + best)
        yield float(best[0]), float(best[1])


def _refine_polyline(line: Array) -> Array:
    """A polyline (n, 3) with places between its corners, some two hundred in all."""
    parts = np.linspace(0.0, 1.0, max(2, 200 // len(line)))[:, None, None]
    return np.asarray(((1 - parts) * line[:-1] + parts * line[1:]).reshape(-1, 3))


def _choose_view(spots: Array, curves: Sequence[Array]) -> tuple[float, float]:
    """The elevation and azimuth nearest to the usual ones from which points (n, 3) are well apart on the page, and
    curves open."""
    size = float(np.max(np.ptp(spots, axis=0), initial=0.0)) or 1.0
    shapes = [(curve - curve.mean(axis=0), *_spread(curve - curve.mean(axis=0))) for curve in curves]

    def worth(view: tuple[float, float]) -> float:
        page = compute_view_axes(view)[:2].T
        least = min(
            (float(np.linalg.norm(a - b)) for a, b in combinations(spots @ page / size, 2)),
            default=DISTINCT_POINTS_FRACTION,
        )
        closed = min(
            (float(np.linalg.svd(v @ page, compute_uv=False)[k]) / spread for v, k, spread in shapes),
            default=CURVE_WIDTH_MIN_FRACTION,
        )
        return (
            min(least, DISTINCT_POINTS_FRACTION)
            + 0.5 * min(closed, CURVE_WIDTH_MIN_FRACTION)
            - 1e-4 * (abs(view[0] - 22.0) + abs(view[1] + 55.0))
        )

    return max(product((22.0, 15.0, 30.0, 38.0), np.arange(-145.0, 31.0, 10.0).tolist()), key=worth)


def compute_view_axes(view: tuple[float, float]) -> Array:
    """Return right, up and towards the viewer (3, 3) by rows, seen from elevation and azimuth (degrees)."""
    up, turn = np.radians(view)
    eye = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    return np.array([right, np.cross(eye, right), eye])


def _spread(v: Array) -> tuple[int, float]:
    """Return the index of the singular value of a curve about its middle that measures its opening, the first of a line
    and the second of others, and its value in space."""
    values = np.linalg.svd(v, compute_uv=False)
    k = int(values[1] > 1e-6 * values[0])
    return k, float(values[k])
