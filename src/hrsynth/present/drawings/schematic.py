"""Legs as chains of kinematic symbols, in the manner of the papers' figures (MMT Table 1, Figs. 2, 4, 13).

Motors are grey, virtual actuators coloured, an observed segment is a thick coloured line with an arrow; the base is
hatched. Equal rods side by side are drawn parallel.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

from ...mechanism import Mechanism
from ...mechanism.legs import LegDecomposition
from . import svg
from .graph import Scale, bands, described, named
from .plan import Layout, Net, PlacedBox, plan
from .symbols import WORDS, arrow, symbol

PITCH, LANE, GAP, RISE = 72.0, 52.0, 18.0, 22.0
"""Between columns, between lanes, more between groups, height of a knee (pixels)."""
STRAIGHT = "PCEF"
"""What does not bend a leg."""


def robot_svg(mechanism: Mechanism | LegDecomposition, *, observed: Collection[str] | None = None,
              virtual: Collection[str] = (), title: str | None = None) -> str:
    """All legs of a mechanism as chains of symbols, base on the left, platform on the right.

    Arguments and ``data-joint``, ``data-link`` as for ``graph_svg``.
    """
    drawn = plan(mechanism, observed=observed, virtual=virtual)
    return _drawing(drawn, title or f"Kinematic scheme of {drawn.mechanism.name}")


def leg_svg(mechanism: Mechanism | LegDecomposition, leg: str, *, observed: Collection[str] | None = None,
            virtual: Collection[str] = (), title: str | None = None) -> str:
    """One leg as a chain of symbols; raises ``BadRequest`` where there is no such leg."""
    drawn = plan(mechanism, observed=observed, virtual=virtual, leg=leg)
    return _drawing(drawn, title or f"Leg {leg} of {drawn.mechanism.name}")


@dataclass(frozen=True)
class _Bends:
    """Where boxes and links stand in pixels: lanes bent upwards at the knees of the group's first chain."""

    scale: Scale
    knees: tuple[tuple[tuple[float, float], ...], ...]
    """For each group (column, rise), from left to right."""
    level: frozenset[int]
    """Lanes with sliders beside a group's first chain: they are not bent."""

    @classmethod
    def of(cls, drawn: Layout) -> _Bends:
        scale = Scale(drawn.rows, PITCH, LANE, GAP, top=46.0)
        first = {row.first for row in drawn.rows}
        level = frozenset(s.lane for s in drawn.spots if s.box.letter in STRAIGHT and s.lane not in first)
        return cls(scale, tuple(_knees(drawn, number) for number in range(len(drawn.rows))), level)

    def at(self, column: float, lane: int) -> svg.Place:
        """The pixel of a place in a lane."""
        return self.scale.x(column), self.scale.y(lane) - self._rise(column, lane)

    def _rise(self, column: float, lane: int) -> float:
        row = next((i for i, row in enumerate(self.scale.rows) if row.first <= lane <= row.last), 0)
        knees = () if lane in self.level else self.knees[row]
        for (x, a), (u, b) in pairwise(knees):
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


def _drawing(drawn: Layout, name: str) -> str:
    bends = _Bends.of(drawn)
    scale = bends.scale
    bottom = scale.band(drawn.rows[-1])[1]
    return svg.picture(scale.x(drawn.columns) + 76, bottom + 14, name, described(drawn), *bands(drawn, scale),
                       *_ends(drawn, bends), _links(drawn, bends), _symbols(drawn, bends))


def _links(drawn: Layout, bends: _Bends) -> str:
    plain = [_net(net, bends) for net in drawn.nets if net.link not in drawn.observed]
    seen = [_net(net, bends) for net in drawn.nets if net.link in drawn.observed]
    heads = "".join(_head(net, bends) for net in drawn.nets if net.link in drawn.observed)
    return (svg.element("g", *plain, fill="none", stroke=svg.INK, stroke_width=2, stroke_linejoin="round")
            + svg.element("g", *seen, fill="none", stroke=svg.VIRTUAL, stroke_width=4, class_="observed")
            + (svg.element("path", d=heads, fill=svg.VIRTUAL) if heads else ""))


def _net(net: Net, bends: _Bends) -> str:
    ways = [[bends.at(x, lane) for x, lane in way] for way in net.ways]
    if net.bar is not None:
        x, first, last = net.bar
        ways.append([bends.at(x, first), bends.at(x, last)])
    return svg.element("path", svg.title(net.link), d=svg.lines(ways), data_link=net.link)


def _head(net: Net, bends: _Bends) -> str:
    """The arrow on the longest line of an observed segment, towards the platform."""
    pieces = [tuple(sorted((a, b))) for way in net.ways for a, b in pairwise(way)]
    if not pieces:
        return ""
    start, end = max(pieces, key=lambda piece: piece[1][0] - piece[0][0])
    return arrow(bends.at(*start), bends.at(*end))


def _symbols(drawn: Layout, bends: _Bends) -> str:
    return svg.element("g", *(_symbol(spot, bends) for spot in drawn.spots), stroke=svg.INK, stroke_width=1.6)


def _symbol(spot: PlacedBox, bends: _Bends) -> str:
    box = spot.box
    x, y = bends.at(spot.x, spot.lane)
    fill = svg.TINT if box.virtual else svg.MOTOR if box.driven else "#fff"
    role = ", virtual actuator" if box.virtual else ", driven by a motor" if box.driven else ""
    said = f"{WORDS[box.letter]} {', '.join(box.joints)}{role}"
    angle = _slope(spot, bends) if box.letter in STRAIGHT else 0.0
    stroke = {"stroke": svg.VIRTUAL} if box.virtual else {}
    drawing = symbol(box.letter, x, y, angle, fill, said, "\n".join(box.joints))
    kind = "virtual" if box.virtual else "motor" if box.driven else "joint"
    letter = svg.words(box.letter, x, y - 16, text_anchor="middle", stroke="none", fill=svg.VIRTUAL if box.virtual else
                       svg.INK, text_decoration="underline" if box.driven else None)
    return svg.element("g", drawing, letter, class_=kind, **stroke)


def _slope(spot: PlacedBox, bends: _Bends) -> float:
    """The angle of the leg at a box, in degrees."""
    (x, y), (u, v) = (bends.at(spot.x + d, spot.lane) for d in (-0.05, 0.05))
    return math.degrees(math.atan2(v - y, u - x))


def _ends(drawn: Layout, bends: _Bends) -> list[str]:
    """The base hatched, the platform links on which legs end as thick bars, with their names."""
    found = []
    for net in drawn.nets:
        if net.bar is None or net.link not in (drawn.mechanism.base, *drawn.platform):
            continue
        (x, upper), (_, lower) = (bends.at(net.bar[0], lane) for lane in net.bar[1:])
        upper, lower = upper - 16, lower + 16
        strokes = [[(x, upper), (x, lower)]]
        if net.link == drawn.mechanism.base:
            strokes += [[(x, y), (x - 6, y + 6)] for y in range(int(upper), int(lower), 7)]
        colour = svg.VIRTUAL if net.link in drawn.observed else svg.INK
        found.append(svg.element("path", d=svg.lines(strokes[:1]), stroke=colour, stroke_width=5))
        if strokes[1:]:
            found.append(svg.element("path", d=svg.lines(strokes[1:]), stroke=svg.INK, stroke_width=1.2))
        found.append(svg.words(named(drawn, net.link), x, upper - 8, text_anchor="middle", fill=svg.INK))
    return found
