"""Drawing of a robot in space: rods, plates and joints at the zero configuration, seen from one side (SVG)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..analysis.observed import ObservedRobot
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from .drawings import svg
from .palette import PAGE
from .sketch import Sketch, compute_view_axes
from .view.shapes import BASE, LEG, MOTOR, PLATFORM, ROD_RADIUS_FRACTION, Drawer
from .view.view import find_plane_normal

RAIL_HALF_LENGTH_FRACTION = 0.3
"""Half of a rail that is drawn (characteristic lengths)."""
SEEN = "seen"
"""Role of a link whose direction is observed."""
STROKES = {BASE: (PAGE["edge"], 2.0), LEG: (PAGE["soft"], 3.0), PLATFORM: (svg.INK, 3.4), SEEN: (svg.OBSERVED, 4.6)}
"""Colour and width of what a link is (pixels at the full size of a drawing)."""
FILLS = {BASE: PAGE["ground"], PLATFORM: PAGE["line"]}


@dataclass(frozen=True, eq=False)
class Mark:
    """A stroke, an area or a joint: ``kind`` line, area, dot or sleeve (a slider), its ``role``, its points (n, 3), the
    name of a joint."""

    kind: str
    role: str
    points: Array
    joint: str | None = None


@dataclass(frozen=True, eq=False)
class Portrait:
    """Marks of a drawn robot; ``normal`` (3,) is that of the plane of motion, if any."""

    name: str
    marks: tuple[Mark, ...]
    normal: Array | None

    @classmethod
    def of(cls, setup: ObservedRobot) -> Portrait:
        """An observed robot."""
        return cls.draw(
            setup.mechanism,
            setup.decomposition.platform,
            {each.link for each in setup.observed},
            find_plane_normal(setup.motion),
        )

    @classmethod
    def draw(
        cls, mechanism: Mechanism, platform: Collection[str], observed: Collection[str], normal: Array | None
    ) -> Portrait:
        """A mechanism at its zero configuration."""
        drawer = Drawer(mechanism, mechanism, platform, ROD_RADIUS_FRACTION * mechanism.length)
        way = RAIL_HALF_LENGTH_FRACTION * mechanism.length
        marks = []
        for shape in drawer.shapes({joint.name: (-way, way) for joint in drawer.sliders()}):
            role = SEEN if shape.link in observed and shape.joint is None else shape.role
            if shape.kind in ("rod", "rail"):
                marks.append(Mark("line", BASE if shape.kind == "rail" else role, shape.points))
            elif shape.kind == "plate":
                marks.append(Mark("area", role, shape.points))
            elif shape.joint is not None:
                at = shape.points if shape.kind == "slider" else shape.points.mean(axis=0)[None]
                marks.append(Mark("sleeve" if shape.kind == "slider" else "dot", role, at, shape.joint))
        return cls(mechanism.name, tuple(marks), normal)

    @cached_property
    def axes(self) -> Array:
        """Return right, up and towards the viewer, (3, 3) by rows, as in :class:`~hrsynth.present.sketch.Sketch`."""
        areas = [mark.points for mark in self.marks if mark.kind == "area"]
        spots = np.vstack([mark.points for mark in self.marks if mark.kind == "dot"] or areas)
        seen = Sketch.of(self.normal, spots, areas)
        if seen.is_flat:
            return np.vstack([seen.axes, np.cross(*seen.axes)])
        return compute_view_axes(seen.view)

    def svg(self, width: float, height: float, title: str | None = None) -> str:
        """The drawing, as large as fits; small ones (thumbnails) have thinner strokes."""
        seen = [mark.points @ self.axes.T for mark in self.marks]
        every = np.vstack(seen)
        low, high = every[:, :2].min(axis=0), every[:, :2].max(axis=0)
        thin = min(1.0, max(0.4, height / 320.0))
        room = np.array([width, height]) - 22.0 * thin
        scale = float(np.min(room / np.maximum(high - low, 1e-9)))
        middle = (low + high) / 2
        order = sorted(
            range(len(seen)),
            key=lambda i: (
                self.marks[i].kind != "area",
                float(np.mean(seen[i][:, 2])) + (0.02 if self.marks[i].kind in ("dot", "sleeve") else 0.0),
            ),
        )
        parts = []
        for i in order:
            at = (seen[i][:, :2] - middle) * [scale, -scale] + [width / 2, height / 2]
            parts.append(_draw_mark(self.marks[i], [(float(x), float(y)) for x, y in at], thin))
        return svg.format_drawing(width, height, title or f"Drawing of {self.name}", self.words(), *parts)

    def words(self) -> str:
        """The drawing in a sentence."""
        legs = sum(mark.role == SEEN for mark in self.marks)
        motors = sum(mark.role == MOTOR for mark in self.marks)
        return (
            f"{self.name} at its zero configuration, the platform dark, {motors} motors green"
            + (", the observed segments blue" if legs else "")
            + "."
        )


def _draw_mark(mark: Mark, at: list[svg.Place], thin: float) -> str:
    """A mark on the page, a pale line about strokes so that what is nearer stands out."""
    if mark.kind == "area":
        colour, wide = STROKES[mark.role]
        return svg.format_element(
            "path",
            d=svg.format_lines([at]) + "Z",
            fill=FILLS.get(mark.role, svg.EMPTY),
            stroke=colour,
            stroke_width=wide * thin,
            stroke_linejoin="round",
            fill_opacity="0.75",
        )
    if mark.kind == "line":
        colour, wide = STROKES[mark.role]
        way = svg.format_lines([at])
        return svg.format_element("path", d=way, stroke=svg.EMPTY, stroke_width=(wide + 3) * thin) + svg.format_element(
            "path", d=way, stroke=colour, stroke_width=wide * thin, stroke_linecap="round"
        )
    fill = svg.MOTOR if mark.role == MOTOR else svg.EMPTY
    if mark.kind == "sleeve":
        way = svg.format_lines([at])
        return svg.format_element("path", d=way, stroke=svg.INK, stroke_width=13 * thin) + svg.format_element(
            "path", d=way, stroke=fill, stroke_width=10 * thin
        )
    (x, y), radius = at[0], (5.5 if mark.role == MOTOR else 3.6) * thin
    return svg.format_element("circle", cx=x, cy=y, r=radius, fill=fill, stroke=svg.INK, stroke_width=1.4 * thin)
