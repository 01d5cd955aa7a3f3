"""A mechanism drawn in the manner of the papers, legs as parallel rows from the base to the platform, in two ways.

The *joint graph* has boxes with the letters of joints, lines are links. The *kinematic scheme* has a symbol for each
joint (MMT Table 1, Figs. 2, 4, 13), its legs are bent at their knees. In both, motors, virtual actuators and
observed segments (thick lines) have the colours of the palette. Equal rods side by side are drawn parallel.

Every joint stands in exactly one element with ``data-joint`` (a planar parallelogram's four in one, a line each), every
link in one with ``data-link``.
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
from .symbols import WORDS, arrow, symbol

if TYPE_CHECKING:
    from ...analysis.derive import Derivation

RISE = 22.0
"""Height of a knee (pixels)."""
STRAIGHT = "PCEF"
"""What does not bend a leg."""
HEAD, BETWEEN = 30.0, 24.0
"""Height of the words above schemes side by side, and the space between these (pixels)."""


@dataclass(frozen=True)
class Scale:
    """Columns and lanes as pixels: between columns, between lanes, more between groups."""

    rows: tuple[Row, ...]
    pitch: float = 50.0
    lane: float = 34.0
    gap: float = 14.0
    left: float = 62.0
    top: float = 30.0

    def x(self, column: float) -> float:
        """The pixel of a column."""
        return self.left + self.pitch * column

    def y(self, lane: int) -> float:
        """The middle of a lane."""
        before = sum(1 for row in self.rows if row.last < lane)
        return self.top + self.lane * (lane + 0.5) + self.gap * before

    def band(self, row: Row) -> tuple[float, float]:
        """The upper and the lower end of a group."""
        return self.y(row.first) - self.lane / 2, self.y(row.last) + self.lane / 2

    def at(self, column: float, lane: int) -> svg.Place:
        """The pixel of a place in a lane."""
        return self.x(column), self.y(lane)


@dataclass(frozen=True)
class Bends(Scale):
    """Lanes bent upwards at the knees of the group's first chain: for each group (column, rise), from left to right;
    ``level`` are lanes with sliders beside a group's first chain, which are not bent."""

    knees: tuple[tuple[tuple[float, float], ...], ...] = ()
    level: frozenset[int] = frozenset()

    @classmethod
    def of(cls, drawn: Layout) -> Bends:
        """The knees of a layout."""
        first = {row.first for row in drawn.rows}
        level = frozenset(s.lane for s in drawn.spots if s.box.letter in STRAIGHT and s.lane not in first)
        knees = tuple(_knees(drawn, number) for number in range(len(drawn.rows)))
        return cls(drawn.rows, 72.0, 52.0, 18.0, top=46.0, knees=knees, level=level)

    def at(self, column: float, lane: int) -> svg.Place:
        """The pixel of a place in a lane."""
        return self.x(column), self.y(lane) - self._rise(column, lane)

    def _rise(self, column: float, lane: int) -> float:
        row = next((i for i, row in enumerate(self.rows) if row.first <= lane <= row.last), 0)
        for (x, a), (u, b) in pairwise(() if lane in self.level else self.knees[row]):
            if x <= column <= u:
                return a + (b - a) * (column - x) / (u - x)
        return 0.0


def _knees(drawn: Layout, number: int) -> tuple[tuple[float, float], ...]:
    row = drawn.rows[number]
    first = sorted((s.x, s.box.letter) for s in drawn.spots if s.row == number and s.lane == row.first)
    turns = [x for x, letter in first if letter not in STRAIGHT]
    if row.label is None or len(turns) < 3:
        return ()
    inner = turns[1:-1]
    rises = [RISE * (1 if i % 2 == 0 else -0.4) for i in range(len(inner))]
    return ((turns[0], 0.0), *zip(inner, rises, strict=True), (turns[-1], 0.0))


def graph_svg(
    mechanism: Mechanism | LegDecomposition,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    title: str | None = None,
) -> str:
    """The joint graph of a mechanism, base on the left, platform on the right.

    ``observed`` are names of links (default: those of the mechanism's observations), ``virtual`` names of joints that
    are drawn as virtual actuators.
    """
    drawn = plan(mechanism, observed=observed, virtual=virtual)
    scale = Scale(drawn.rows)
    dots = "".join(dot for net in drawn.nets for dot in _dots(net, scale))
    return _picture(
        drawn,
        scale,
        title or f"Joint graph of {drawn.mechanism.name}",
        70.0,
        12,
        _bands(drawn, scale),
        [
            _links(drawn, scale, stroke_width=1.5)
            + svg.element("path", d=dots, stroke=svg.INK, stroke_width=6, stroke_linecap="round"),
            *_boxes(drawn, scale),
            *_ends(drawn, scale, 11, 5, hatched=False),
        ],
    )


def robot_svg(
    mechanism: Mechanism | LegDecomposition,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    title: str | None = None,
) -> str:
    """All legs of a mechanism as chains of symbols; arguments as for :func:`graph_svg`."""
    drawn = plan(mechanism, observed=observed, virtual=virtual)
    return _scheme(drawn, title or f"Kinematic scheme of {drawn.mechanism.name}")


def leg_svg(
    mechanism: Mechanism | LegDecomposition,
    leg: str,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    title: str | None = None,
) -> str:
    """One leg as a chain of symbols; raises ``BadRequest`` where there is no such leg."""
    drawn = plan(mechanism, observed=observed, virtual=virtual, leg=leg)
    return _scheme(drawn, title or f"Leg {leg} of {drawn.mechanism.name}")


def derivation_svg(found: Derivation) -> bytes:
    """The schemes of both robots side by side, the architecture over each; the real one alone where every leg is
    blind."""
    watched = [o.link for o in found.setting.observed]
    schemes = [(f"real robot  {found.architecture}", robot_svg(found.setting.anatomy, observed=watched))]
    if found.hidden is not None:
        motors = [joint.name for joint in found.hidden.joints.values() if joint.actuated]
        schemes.append((f"hidden robot  {found.hidden_architecture}", robot_svg(found.hidden, virtual=motors)))
    x, tall, parts = 0.0, 0.0, []
    for words, scheme in schemes:
        size = re.search(r' width="([\d.]+)" height="([\d.]+)"', scheme)
        assert size is not None
        parts += [
            svg.words(words, x + 16, 20, font_weight="bold"),
            scheme.replace("<svg ", f'<svg x="{svg.number(x)}" y="{svg.number(HEAD)}" ', 1),
        ]
        x, tall = x + float(size[1]) + BETWEEN, max(tall, float(size[2]))
    return svg.picture(x - BETWEEN, HEAD + tall, f"Derivation of {found.robot.name}", found.headline(), *parts).encode()


def _scheme(drawn: Layout, name: str) -> str:
    bends = Bends.of(drawn)
    heads = "".join(_head(net, bends) for net in drawn.nets if net.link in drawn.observed)
    return _picture(
        drawn,
        bends,
        name,
        76,
        14,
        _bands(drawn, bends),
        [
            *_ends(drawn, bends, 16, 8, hatched=True),
            _links(drawn, bends, stroke_width=2, stroke_linejoin="round"),
            svg.element("path", d=heads, fill=svg.WATCHED) if heads else "",
            svg.element("g", *(_symbol(spot, bends) for spot in drawn.spots), stroke=svg.INK, stroke_width=1.6),
        ],
    )


def _picture(
    drawn: Layout, scale: Scale, name: str, right: float, below: float, bands: list[str], content: list[str]
) -> str:
    bottom = scale.band(drawn.rows[-1])[1]
    return svg.picture(scale.x(drawn.columns) + right, bottom + below, name, _describe(drawn), *bands, *content)


def _describe(drawn: Layout) -> str:
    """The drawing in words: each group's boxes in order, what is driven, what is observed."""
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


def _bands(drawn: Layout, scale: Scale) -> list[str]:
    """A pale band behind each group, with the leg's label on its left."""
    found = []
    for row in drawn.rows:
        upper, lower = scale.band(row)
        start, end = scale.x(row.start), scale.x(row.end)
        found.append(svg.element("rect", x=start, y=upper, width=end - start, height=lower - upper, fill=svg.PALE))
        if row.label is not None:
            found.append(
                svg.words(f"leg {row.label}", scale.x(0) - 12, (upper + lower) / 2 + 4, text_anchor="end", fill=svg.INK)
            )
        elif len(drawn.rows) > 1:
            found.append(svg.words("platform", end + 10, (upper + lower) / 2 + 4, fill=svg.INK))
    return found


def _links(drawn: Layout, scale: Scale, **style: object) -> str:
    plain = [_net(net, scale) for net in drawn.nets if net.link not in drawn.observed]
    seen = [_net(net, scale) for net in drawn.nets if net.link in drawn.observed]
    return svg.element("g", *plain, fill="none", stroke=svg.INK, **style) + svg.element(
        "g", *seen, fill="none", stroke=svg.WATCHED, stroke_width=4, class_="observed"
    )


def _net(net: Net, scale: Scale) -> str:
    ways = [[scale.at(x, lane) for x, lane in way] for way in net.ways]
    if net.bar is not None:
        x, first, last = net.bar
        ways.append([scale.at(x, first), scale.at(x, last)])
    return svg.element("path", svg.title(net.link), d=svg.lines(ways), data_link=net.link)


def _dots(net: Net, scale: Scale) -> list[str]:
    """Where the lines of a link meet its bar."""
    x = None if net.bar is None else net.bar[0]
    lanes = sorted({lane for way in net.ways for column, lane in way if column == x})
    return [f"M{svg.number(scale.x(x))} {svg.number(scale.y(lane))}h0" for lane in lanes if x is not None]


def _head(net: Net, scale: Scale) -> str:
    """The arrow on the longest line of an observed segment, towards the platform."""
    pieces = [tuple(sorted((a, b))) for way in net.ways for a, b in pairwise(way)]
    if not pieces:
        return ""
    start, end = max(pieces, key=lambda piece: piece[1][0] - piece[0][0])
    return arrow(scale.at(*start), scale.at(*end))


def _boxes(drawn: Layout, scale: Scale) -> list[str]:
    found = []
    for kind, fill, stroke in (
        ("joint", svg.EMPTY, svg.INK),
        ("motor", svg.FILLS["motor"], svg.MOTOR),
        ("virtual", svg.VIRTUAL, svg.VIRTUAL),
    ):
        boxes = [_box(spot, scale) for spot in drawn.spots if spot.box.kind == kind]
        if boxes:
            found.append(svg.element("g", svg.element("g", *boxes, stroke=stroke), fill=fill, class_=kind))
    return found


def _box(spot: PlacedBox, scale: Scale) -> str:
    box, (x, y) = spot.box, scale.at(spot.x, spot.lane)
    said = ", ".join(box.joints) + {"virtual": ": virtual actuator", "motor": ": motor", "joint": ""}[box.kind]
    return svg.element(
        "g",
        svg.title(said),
        svg.element("rect", x=x - 12, y=y - 11, width=24, height=22, rx=2),
        svg.words(
            box.letter,
            x,
            y + 5,
            text_anchor="middle",
            font_size=14,
            stroke="none",
            fill=svg.EMPTY if box.virtual else svg.INK,
            text_decoration="underline" if box.driven else None,
        ),
        data_joint="\n".join(box.joints),
    )


def _symbol(spot: PlacedBox, bends: Bends) -> str:
    box, (x, y) = spot.box, bends.at(spot.x, spot.lane)
    role = {"virtual": ", virtual actuator", "motor": ", driven by a motor", "joint": ""}[box.kind]
    angle = 0.0
    if box.letter in STRAIGHT:
        (a, b), (c, d) = (bends.at(spot.x + side, spot.lane) for side in (-0.05, 0.05))
        angle = math.degrees(math.atan2(d - b, c - a))
    drawing = symbol(
        box.letter,
        x,
        y,
        angle,
        svg.FILLS[box.kind],
        f"{WORDS[box.letter]} {', '.join(box.joints)}{role}",
        "\n".join(box.joints),
    )
    letter = svg.words(
        box.letter,
        x,
        y - 16,
        text_anchor="middle",
        stroke="none",
        fill=svg.STROKES[box.kind],
        text_decoration="underline" if box.driven else None,
    )
    return svg.element("g", drawing, letter, class_=box.kind, stroke=svg.STROKES[box.kind])


def _ends(drawn: Layout, scale: Scale, over: float, above: float, *, hatched: bool) -> list[str]:
    """The base (hatched or not) and the platform links on which legs end as thick bars, with their names."""
    found = []
    base = drawn.mechanism.base
    for net in drawn.nets:
        if net.bar is None or net.link not in (base, *drawn.platform):
            continue
        (x, upper), (_, lower) = (scale.at(net.bar[0], lane) for lane in net.bar[1:])
        upper, lower = upper - over, lower + over
        colour = svg.WATCHED if net.link in drawn.observed else svg.INK
        found.append(svg.element("path", d=svg.lines([[(x, upper), (x, lower)]]), stroke=colour, stroke_width=5))
        if hatched and net.link == base:
            strokes = [[(x, y), (x - 6, y + 6)] for y in range(int(upper), int(lower), 7)]
            found.append(svg.element("path", d=svg.lines(strokes), stroke=svg.INK, stroke_width=1.2))
        name = "base" if net.link == base else "platform" if len(drawn.platform) == 1 else net.link
        found.append(svg.words(name, x, upper - above, text_anchor="middle", fill=svg.INK))
    return found
