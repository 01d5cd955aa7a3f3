"""The joint graph in the manner of the papers: boxes with the letters of joints, legs as parallel rows, lines as links.

Grey boxes are driven by a motor, coloured ones are virtual actuators, thick coloured lines are observed segments.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ...mechanism import Mechanism
from ...mechanism.legs import LegDecomposition
from . import svg
from .plan import Layout, Net, PlacedBox, Row, plan

PITCH, LANE, GAP = 50.0, 34.0, 14.0
"""Between columns, between lanes, and more between groups (pixels)."""
LEFT, TOP, RIGHT = 62.0, 30.0, 70.0


@dataclass(frozen=True)
class Scale:
    """Columns and lanes as pixels."""

    rows: tuple[Row, ...]
    pitch: float = PITCH
    lane: float = LANE
    gap: float = GAP
    left: float = LEFT
    top: float = TOP

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


def graph_svg(mechanism: Mechanism | LegDecomposition, *, observed: Collection[str] | None = None,
              virtual: Collection[str] = (), title: str | None = None) -> str:
    """The joint graph of a mechanism, base on the left, platform on the right.

    ``observed`` are names of links (default: those of the mechanism's observations), ``virtual`` names of joints that
    are drawn as virtual actuators. Every joint stands in exactly one element with ``data-joint`` (a planar
    parallelogram's four in one, a line each), every link in one with ``data-link``.
    """
    drawn = plan(mechanism, observed=observed, virtual=virtual)
    scale = Scale(drawn.rows)
    bottom = scale.band(drawn.rows[-1])[1]
    name = title or f"Joint graph of {drawn.mechanism.name}"
    return svg.picture(scale.x(drawn.columns) + RIGHT, bottom + 12, name, described(drawn), *bands(drawn, scale),
                       _links(drawn, scale), *_boxes(drawn, scale), *ends(drawn, scale))


def described(drawn: Layout) -> str:
    """The drawing in words: each group's boxes in order, what is driven, what is observed."""
    sentences = []
    for number, row in enumerate(drawn.rows):
        own = sorted((spot for spot in drawn.spots if spot.row == number), key=lambda spot: (spot.lane, spot.x))
        of = f"Leg {row.label}" if row.label else "Joints of the platform" if len(drawn.rows) > 1 else "Joints"
        lanes: dict[int, list[str]] = {}
        for spot in own:
            lanes.setdefault(spot.lane, []).append(_said(spot))
        sentences.append(f"{of}: " + "; beside it: ".join(", ".join(each) for each in lanes.values()) + ".")
    if drawn.observed:
        sentences.append("Observed: " + ", ".join(n for n in drawn.mechanism.links if n in drawn.observed) + ".")
    return " ".join(sentences)


def _said(spot: PlacedBox) -> str:
    box = spot.box
    return box.letter + (" (virtual actuator)" if box.virtual else " (motor)" if box.driven else "")


def bands(drawn: Layout, scale: Scale) -> list[str]:
    """A pale band behind each group, with the leg's label on its left."""
    found = []
    for row in drawn.rows:
        upper, lower = scale.band(row)
        start, end = scale.x(row.start), scale.x(row.end)
        found.append(svg.element("rect", x=start, y=upper, width=end - start, height=lower - upper, fill=svg.PALE))
        if row.label is None:
            if len(drawn.rows) > 1:
                found.append(svg.words("platform", end + 10, (upper + lower) / 2 + 4, fill=svg.INK))
        else:
            found.append(svg.words(f"leg {row.label}", scale.x(0) - 12, (upper + lower) / 2 + 4, text_anchor="end",
                                   fill=svg.INK))
    return found


def _links(drawn: Layout, scale: Scale) -> str:
    plain: list[str] = []
    seen: list[str] = []
    dots: list[str] = []
    for net in drawn.nets:
        (seen if net.link in drawn.observed else plain).append(_net(net, scale))
        dots += _dots(net, scale)
    return (svg.element("g", *plain, fill="none", stroke=svg.INK, stroke_width=1.5)
            + svg.element("g", *seen, fill="none", stroke=svg.VIRTUAL, stroke_width=4, class_="observed")
            + svg.element("path", d="".join(dots), stroke=svg.INK, stroke_width=6, stroke_linecap="round"))


def _net(net: Net, scale: Scale) -> str:
    points = [[(scale.x(x), scale.y(lane)) for x, lane in way] for way in net.ways]
    if net.bar is not None:
        x, first, last = net.bar
        points.append([(scale.x(x), scale.y(first)), (scale.x(x), scale.y(last))])
    return svg.element("path", svg.title(net.link), d=svg.lines(points), data_link=net.link)


def _dots(net: Net, scale: Scale) -> list[str]:
    """Where the lines of a link meet its bar."""
    if net.bar is None:
        return []
    x = net.bar[0]
    lanes = sorted({lane for way in net.ways for column, lane in way if column == x})
    return [f"M{svg.number(scale.x(x))} {svg.number(scale.y(lane))}h0" for lane in lanes]


def _boxes(drawn: Layout, scale: Scale) -> list[str]:
    kinds: dict[str, list[str]] = {"joint": [], "motor": [], "virtual": []}
    for spot in drawn.spots:
        kind = "virtual" if spot.box.virtual else "motor" if spot.box.driven else "joint"
        kinds[kind].append(_box(spot, scale))
    fills = {"joint": ("#fff", svg.INK), "motor": (svg.MOTOR, svg.INK), "virtual": (svg.VIRTUAL, "#fff")}
    return [svg.element("g", svg.element("g", *found, stroke=fills[kind][1] if kind != "virtual" else svg.VIRTUAL),
                        fill=fills[kind][0], class_=kind)
            for kind, found in kinds.items() if found]


def _box(spot: PlacedBox, scale: Scale) -> str:
    box = spot.box
    x, y = scale.x(spot.x), scale.y(spot.lane)
    letter = "#fff" if box.virtual else svg.INK
    said = ", ".join(box.joints) + (": virtual actuator" if box.virtual else ": motor" if box.driven else "")
    return svg.element("g", svg.title(said), svg.element("rect", x=x - 12, y=y - 11, width=24, height=22, rx=2),
                       svg.words(box.letter, x, y + 5, text_anchor="middle", font_size=14, stroke="none", fill=letter,
                                 text_decoration="underline" if box.driven else None),
                       data_joint="\n".join(box.joints))


def ends(drawn: Layout, scale: Scale) -> list[str]:
    """Thick bars for the base and the platform links on which legs end, with their names."""
    found = []
    for net in drawn.nets:
        if net.bar is None or net.link not in (drawn.mechanism.base, *drawn.platform):
            continue
        x, upper, lower = scale.x(net.bar[0]), scale.y(net.bar[1]), scale.y(net.bar[2])
        colour = svg.VIRTUAL if net.link in drawn.observed else svg.INK
        found.append(svg.element("path", d=svg.lines([[(x, upper - 11), (x, lower + 11)]]), stroke=colour,
                                 stroke_width=5))
        found.append(svg.words(named(drawn, net.link), x, upper - 16, text_anchor="middle", fill=svg.INK))
    return found


def named(drawn: Layout, link: str) -> str:
    """What a bar is called: base, platform, or by its own name where the platform has several links."""
    if link == drawn.mechanism.base:
        return "base"
    return "platform" if len(drawn.platform) == 1 else link
