"""The kinematic scheme of a mechanism, in the manner of the papers (MMT Table 1, Figs. 2, 4, 13): legs as parallel rows
from the base to the platform, bent at their knees, with a symbol for each joint.

Motors, virtual actuators and observed segments (thick lines) have the colours of the palette. Equal rods side by side
are drawn parallel. Every joint stands in exactly one element with ``data-joint`` (a planar parallelogram's four in one,
a line each), every link in one with ``data-link``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from ...mechanism import Mechanism
from ...mechanism.legs import LegDecomposition
from . import svg
from .plan import Layout, Net, PlacedBox, Row, plan
from .symbols import WORDS, draw_arrow, draw_symbol

if TYPE_CHECKING:
    from ...analysis.derive import Derivation

KNEE_HEIGHT_PIXELS_COUNT = 22.0
"""Height of a knee (pixels)."""
STRAIGHT = "PCEF"
"""What does not bend a leg."""
PITCH, LANE, GAP = 72.0, 52.0, 18.0
"""Between columns, between lanes, and more between groups (pixels)."""
LEFT, TOP, RIGHT, BELOW = 62.0, 46.0, 76.0, 14.0
"""Room about the legs (pixels)."""
HEAD, BETWEEN = 30.0, 24.0
"""Height of the words above schemes side by side, and the space between these (pixels)."""


@dataclass(frozen=True)
class Scale:
    """Columns and lanes as pixels: between columns, between lanes, more between groups. Lanes are bent upwards at the
    ``knees`` of the group's first chain: for each group (column, rise), from left to right; ``level`` are lanes with
    sliders beside a group's first chain, which are not bent."""

    rows: tuple[Row, ...]
    knees: tuple[tuple[tuple[float, float], ...], ...]
    level: frozenset[int]

    @classmethod
    def of(cls, drawn: Layout) -> Scale:
        """The scale and the knees of a layout."""
        first = {row.first for row in drawn.rows}
        level = frozenset(s.lane for s in drawn.spots if s.box.letter in STRAIGHT and s.lane not in first)
        return cls(drawn.rows, tuple(_list_knees(drawn, number) for number in range(len(drawn.rows))), level)

    def x(self, column: float) -> float:
        """The pixel of a column."""
        return LEFT + PITCH * column

    def y(self, lane: int) -> float:
        """The middle of a lane."""
        before = sum(1 for row in self.rows if row.last < lane)
        return TOP + LANE * (lane + 0.5) + GAP * before

    def band(self, row: Row) -> tuple[float, float]:
        """The upper and the lower end of a group."""
        return self.y(row.first) - LANE / 2, self.y(row.last) + LANE / 2

    def at(self, column: float, lane: int) -> svg.Place:
        """The pixel of a place in a lane."""
        return self.x(column), self.y(lane) - self._rise(column, lane)

    def _rise(self, column: float, lane: int) -> float:
        row = next((i for i, row in enumerate(self.rows) if row.first <= lane <= row.last), 0)
        for (x, a), (u, b) in pairwise(() if lane in self.level else self.knees[row]):
            if x <= column <= u:
                return a + (b - a) * (column - x) / (u - x)
        return 0.0


def _list_knees(drawn: Layout, number: int) -> tuple[tuple[float, float], ...]:
    row = drawn.rows[number]
    first = sorted((s.x, s.box.letter) for s in drawn.spots if s.row == number and s.lane == row.first)
    turns = [x for x, letter in first if letter not in STRAIGHT]
    if row.label is None or len(turns) < 3:
        return ()
    inner = turns[1:-1]
    rises = [KNEE_HEIGHT_PIXELS_COUNT * (1 if i % 2 == 0 else -0.4) for i in range(len(inner))]
    return ((turns[0], 0.0), *zip(inner, rises, strict=True), (turns[-1], 0.0))


def draw_robot_svg(
    mechanism: Mechanism | LegDecomposition,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    title: str | None = None,
) -> str:
    """All legs of a mechanism as chains of symbols, base on the left, platform on the right.

    ``observed`` are names of links (default: those of the mechanism's observations), ``virtual`` names of joints that
    are drawn as virtual actuators.
    """
    drawn = plan(mechanism, observed=observed, virtual=virtual)
    return _draw_scheme(drawn, title or f"Kinematic scheme of {drawn.mechanism.name}")


def draw_leg_svg(
    mechanism: Mechanism | LegDecomposition,
    leg: str,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    title: str | None = None,
) -> str:
    """One leg as a chain of symbols; raises ``BadRequest`` where there is no such leg."""
    drawn = plan(mechanism, observed=observed, virtual=virtual, leg=leg)
    return _draw_scheme(drawn, title or f"Leg {leg} of {drawn.mechanism.name}")


def draw_derivation_svg(found: Derivation) -> bytes:
    """The schemes of both robots side by side, the architecture over each; the real one alone if every
    direction is constant."""
    watched = [o.link for o in found.setup.observed]
    schemes = [(f"real robot  {found.architecture}", draw_robot_svg(found.setup.decomposition, observed=watched))]
    if found.hidden is not None:
        motors = [joint.name for joint in found.hidden.joints.values() if joint.is_actuated]
        schemes.append((f"hidden robot  {found.hidden_architecture}", draw_robot_svg(found.hidden, virtual=motors)))
    x, tall, parts = 0.0, 0.0, []
    for words, scheme in schemes:
        size = re.search(r' width="([\d.]+)" height="([\d.]+)"', scheme)
        assert size is not None
        parts += [
            svg.format_words(words, x + 16, 20, font_weight="bold"),
            scheme.replace("<svg ", f'<svg x="{svg.format_coordinate(x)}" y="{svg.format_coordinate(HEAD)}" ', 1),
        ]
        x, tall = x + float(size[1]) + BETWEEN, max(tall, float(size[2]))
    return svg.format_drawing(
        x - BETWEEN, HEAD + tall, f"Derivation of {found.robot.name}", found.headline(), *parts
    ).encode()


def _draw_scheme(drawn: Layout, name: str) -> str:
    scale = Scale.of(drawn)
    heads = "".join(_draw_arrow_head(net, scale) for net in drawn.nets if net.link in drawn.observed)
    return svg.format_drawing(
        scale.x(drawn.columns) + RIGHT,
        scale.band(drawn.rows[-1])[1] + BELOW,
        name,
        _describe(drawn),
        *_draw_bands(drawn, scale),
        *_draw_ends(drawn, scale),
        _draw_links(drawn, scale),
        svg.format_element("path", d=heads, fill=svg.OBSERVED) if heads else "",
        svg.format_element("g", *(_draw_symbol(spot, scale) for spot in drawn.spots), stroke=svg.INK, stroke_width=1.6),
    )


def _describe(drawn: Layout) -> str:
    """The drawing in words: each group's boxes in order, the motors, the observed links."""
    sentences = []
    for number, row in enumerate(drawn.rows):
        own = sorted((spot for spot in drawn.spots if spot.row == number), key=lambda spot: (spot.lane, spot.x))
        of = f"Leg {row.label}" if row.label else "Joints of the platform" if len(drawn.rows) > 1 else "Joints"
        lanes: dict[int, list[str]] = {}
        for spot in own:
            kind = {"virtual": " (virtual actuator)", "motor": " (motor)", "joint": ""}[spot.box.kind]
            lanes.setdefault(spot.lane, []).append(spot.box.letter + kind)
        sentences.append(f"{of}: " + "; beside it: ".join(", ".join(each) for each in lanes.values()) + ".")
    if drawn.observed:
        sentences.append("Observed: " + ", ".join(n for n in drawn.mechanism.links if n in drawn.observed) + ".")
    return " ".join(sentences)


def _draw_bands(drawn: Layout, scale: Scale) -> list[str]:
    """A pale band behind each group, with the leg's label on its left."""
    found = []
    for row in drawn.rows:
        upper, lower = scale.band(row)
        start, end = scale.x(row.start), scale.x(row.end)
        found.append(
            svg.format_element("rect", x=start, y=upper, width=end - start, height=lower - upper, fill=svg.PALE)
        )
        if row.label is not None:
            found.append(
                svg.format_words(
                    f"leg {row.label}", scale.x(0) - 12, (upper + lower) / 2 + 4, text_anchor="end", fill=svg.INK
                )
            )
        elif len(drawn.rows) > 1:
            found.append(svg.format_words("platform", end + 10, (upper + lower) / 2 + 4, fill=svg.INK))
    return found


def _draw_links(drawn: Layout, scale: Scale) -> str:
    plain = [_draw_net(net, scale) for net in drawn.nets if net.link not in drawn.observed]
    seen = [_draw_net(net, scale) for net in drawn.nets if net.link in drawn.observed]
    return svg.format_element(
        "g", *plain, fill="none", stroke=svg.INK, stroke_width=2, stroke_linejoin="round"
    ) + svg.format_element("g", *seen, fill="none", stroke=svg.OBSERVED, stroke_width=4, class_="observed")


def _draw_net(net: Net, scale: Scale) -> str:
    ways = [[scale.at(x, lane) for x, lane in way] for way in net.ways]
    if net.bar is not None:
        x, first, last = net.bar
        ways.append([scale.at(x, first), scale.at(x, last)])
    return svg.format_element("path", svg.format_title(net.link), d=svg.format_lines(ways), data_link=net.link)


def _draw_arrow_head(net: Net, scale: Scale) -> str:
    """The arrow on the longest line of an observed segment, towards the platform."""
    pieces = [tuple(sorted((a, b))) for way in net.ways for a, b in pairwise(way)]
    if not pieces:
        return ""
    start, end = max(pieces, key=lambda piece: piece[1][0] - piece[0][0])
    return draw_arrow(scale.at(*start), scale.at(*end))


def _draw_symbol(spot: PlacedBox, scale: Scale) -> str:
    box, (x, y) = spot.box, scale.at(spot.x, spot.lane)
    role = {"virtual": ", virtual actuator", "motor": ", driven by a motor", "joint": ""}[box.kind]
    angle = 0.0
    if box.letter in STRAIGHT:
        (a, b), (c, d) = (scale.at(spot.x + side, spot.lane) for side in (-0.05, 0.05))
        angle = math.degrees(math.atan2(d - b, c - a))
    drawing = draw_symbol(
        box.letter,
        x,
        y,
        angle,
        svg.FILLS[box.kind],
        f"{WORDS[box.letter]} {', '.join(box.joints)}{role}",
        "\n".join(box.joints),
    )
    letter = svg.format_words(
        box.letter,
        x,
        y - 16,
        text_anchor="middle",
        stroke="none",
        fill=svg.STROKES[box.kind],
        text_decoration="underline" if box.driven else None,
    )
    return svg.format_element("g", drawing, letter, class_=box.kind, stroke=svg.STROKES[box.kind])


def _draw_ends(drawn: Layout, scale: Scale) -> list[str]:
    """The base (hatched) and the platform links on which legs end as thick bars, with their names."""
    found = []
    base = drawn.mechanism.base
    for net in drawn.nets:
        if net.bar is None or net.link not in (base, *drawn.platform):
            continue
        (x, upper), (_, lower) = (scale.at(net.bar[0], lane) for lane in net.bar[1:])
        upper, lower = upper - 16, lower + 16
        colour = svg.OBSERVED if net.link in drawn.observed else svg.INK
        found.append(
            svg.format_element("path", d=svg.format_lines([[(x, upper), (x, lower)]]), stroke=colour, stroke_width=5)
        )
        if net.link == base:
            strokes = [[(x, y), (x - 6, y + 6)] for y in range(int(upper), int(lower), 7)]
            found.append(svg.format_element("path", d=svg.format_lines(strokes), stroke=svg.INK, stroke_width=1.2))
        name = "base" if net.link == base else "platform" if len(drawn.platform) == 1 else net.link
        found.append(svg.format_words(name, x, upper - 8, text_anchor="middle", fill=svg.INK))
    return found
