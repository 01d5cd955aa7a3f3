"""Layout of a drawing: legs as parallel rows from the base on the left to the platform on the right.

Links have columns, ears have lanes: a box stands in its ear's lane between the columns of its two links, a link is
the line between its boxes, with a bar across the lanes where it has more than two. What is in no leg and not in the
platform makes the whole mechanism one group.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ...errors import HrsynthError
from ...mechanism import Mechanism
from ...mechanism.legs import LegDecomposition, decompose
from .boxes import Box, Ear, list_boxes, split_ears

Point = tuple[float, int]
"""Column and lane."""
COLUMN_BAR_DISTANCE_MAX = 0.4
"""How far bars of one column stand apart at most (columns)."""


@dataclass(frozen=True)
class PlacedBox:
    """A box, where it stands, and the group that it belongs to."""

    box: Box
    x: float
    lane: int
    row: int


@dataclass(frozen=True)
class Net:
    """A link: lines through (column, lane) points within a lane, and a bar (column, first lane, last lane) or None."""

    link: str
    ways: tuple[tuple[Point, ...], ...]
    bar: tuple[float, int, int] | None
    row: int
    """The group of its first line."""


@dataclass(frozen=True)
class Row:
    """A group: a leg's label (None: the platform's own joints, or all), its lanes and columns."""

    label: str | None
    first: int
    last: int
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Layout:
    """A drawing in columns and lanes; ``observed`` are links, ``platform`` all links of an articulated platform."""

    mechanism: Mechanism
    spots: tuple[PlacedBox, ...]
    nets: tuple[Net, ...]
    rows: tuple[Row, ...]
    observed: frozenset[str]
    platform: tuple[str, ...]

    @property
    def columns(self) -> float:
        """The last column."""
        return max((row.end for row in self.rows), default=1.0)

    @property
    def lanes(self) -> int:
        """The number of lanes."""
        return self.rows[-1].last + 1 if self.rows else 1


@dataclass(frozen=True)
class _LegBoxes:
    label: str | None
    ears: tuple[Ear, ...]


def plan(
    mechanism: Mechanism | LegDecomposition,
    *,
    observed: Collection[str] | None = None,
    virtual: Collection[str] = (),
    leg: str | None = None,
) -> Layout:
    """The plan of a mechanism, or of one that is already taken apart; of one ``leg`` by its label.

    ``observed`` are names of links (default: those of the mechanism's observations), ``virtual`` names of joints.
    Raises ``BadRequest`` for a leg that is not there.
    """
    decomposition = mechanism if isinstance(mechanism, LegDecomposition) else _decompose_legs(mechanism)
    whole = mechanism.mechanism if isinstance(mechanism, LegDecomposition) else mechanism
    seen = (o.link for o in whole.observations if o.is_segment_direction) if observed is None else observed
    links = frozenset(seen)
    boxes = sorted(list_boxes(whole, links, virtual), key=lambda box: links.isdisjoint((box.tail, box.head)))
    groups, platform = _group_legs(whole, decomposition, boxes)
    if leg is not None:
        chosen = (decomposition or decompose(whole)).leg(leg)
        own = [box for box in boxes if set(box.joints) <= set(chosen.joints)]
        groups, platform = (
            [_LegBoxes(leg, tuple(split_ears(own, (whole.base, chosen.platform_link))))],
            (chosen.platform_link,),
        )
    columns = _choose_columns(groups, whole.base)
    ends = {group.ears[0].links[-1] for group in groups if group.ears}
    spots, ways, rows = _place_groups(groups, columns)
    return Layout(whole, tuple(spots), tuple(_list_nets(whole, ends, ways, columns)), tuple(rows), links, platform)


def _decompose_legs(mechanism: Mechanism) -> LegDecomposition | None:
    try:
        return decompose(mechanism)
    except HrsynthError:
        return None


def _group_legs(
    mechanism: Mechanism, decomposition: LegDecomposition | None, boxes: list[Box]
) -> tuple[list[_LegBoxes], tuple[str, ...]]:
    """The legs in the order of what they end on, the platform's own joints after those of the first end."""
    ends = (mechanism.base, mechanism.platform)
    all_samples = [_LegBoxes(None, tuple(split_ears(boxes, ends)))]
    if decomposition is None:
        return all_samples, (mechanism.platform,)
    of_leg = {name: leg.label for leg in decomposition.legs for name in leg.joints}
    members: dict[str | None, list[Box]] = {}
    for box in boxes:
        members.setdefault(of_leg.get(box.joints[0]), []).append(box)
    platform = set(decomposition.platform)
    inner = members.pop(None, [])
    if any(not {box.tail, box.head, *box.inside} <= platform for box in inner):
        return all_samples, (mechanism.platform,)
    attached = tuple(dict.fromkeys(leg.platform_link for leg in decomposition.legs))
    groups: list[_LegBoxes] = []
    for attach in attached:
        groups += [
            _LegBoxes(leg.label, tuple(split_ears(members.get(leg.label, ()), (mechanism.base, attach))))
            for leg in decomposition.legs
            if leg.platform_link == attach
        ]
        if attach == attached[0] and inner:
            groups.append(_LegBoxes(None, tuple(split_ears(inner, attached))))
    return groups, decomposition.platform


def _choose_columns(groups: Sequence[_LegBoxes], base: str) -> dict[str, int]:
    """A column for each link, such that every box has its two links in different ones: longest ways from the left."""
    import networkx as nx

    after: nx.DiGraph[str] = nx.DiGraph()
    after.add_node(base)
    column: dict[str, int] = {base: 0}
    for group in sorted(groups, key=lambda group: group.label is None):
        for ear in group.ears:
            first, last = ear.links[0], ear.links[-1]
            turned = last in column and column[last] < column.get(first, 0)
            nx.add_path(after, ear.links[::-1] if turned else ear.links)
            column = {link: i for i, links in enumerate(nx.topological_generations(after)) for link in links}
    return column


_Way = tuple[str, tuple[Point, ...], int]
"""A link, the points of its line within a lane, the group."""


def _place_groups(
    groups: Sequence[_LegBoxes], columns: dict[str, int]
) -> tuple[list[PlacedBox], list[_Way], list[Row]]:
    spots: list[PlacedBox] = []
    ways: list[_Way] = []
    rows: list[Row] = []
    shared = _list_shared_links(ear for group in groups for ear in group.ears)
    top = 0
    for number, group in enumerate(groups):
        lanes: list[list[tuple[int, int]]] = []
        for ear in group.ears:
            ends = sorted((columns[ear.links[0]], columns[ear.links[-1]]))
            lane = _find_free_lane(lanes, ends[0], ends[1])
            xs = _place_boxes(ear, columns, shared)
            spots += [PlacedBox(box, x, top + lane, number) for box, x in zip(ear.boxes, xs, strict=True)]
            ways += _draw_ways(ear, xs, columns, shared, top + lane, number)
        touched = [columns[link] for ear in group.ears for link in ear.links] or [0]
        rows.append(Row(group.label, top, top + max(len(lanes), 1) - 1, min(touched), max(touched)))
        top += max(len(lanes), 1)
    return spots, ways, rows


def _list_shared_links(found: Iterable[Ear]) -> set[str]:
    """The links that have a place of their own: ends of ears."""
    return {link for ear in found for link in ((ear.links[0],) if ear.open else (ear.links[0], ear.links[-1]))}


def _find_free_lane(lanes: list[list[tuple[int, int]]], start: int, end: int) -> int:
    """The first lane in which nothing stands from one place to another; it is taken."""
    for lane, taken in enumerate(lanes):
        if all(end < a or b < start for a, b in taken):
            taken.append((start, end))
            return lane
    lanes.append([(start, end)])
    return len(lanes) - 1


def _place_boxes(ear: Ear, columns: dict[str, int], shared: set[str]) -> list[float]:
    """The columns of the boxes, as evenly as half columns allow between links that have a place of their own."""
    fixed = [i for i, link in enumerate(ear.links) if link in shared or i in (0, len(ear.links) - 1)]
    xs: list[float] = []
    for i, j in pairwise(fixed):
        start, end = sorted((columns[ear.links[i]], columns[ear.links[j]]))
        found = [start + int((k + 0.5) * (end - start) / (j - i)) + 0.5 for k in range(j - i)]
        xs += found if start == columns[ear.links[i]] else found[::-1]
    return xs


def _draw_ways(ear: Ear, xs: list[float], columns: dict[str, int], shared: set[str], lane: int, row: int) -> list[_Way]:
    """The line of each link of an ear: from the box before it, through its own place, to the box after it."""
    found: list[_Way] = []
    for i, link in enumerate(ear.links):
        points = [(xs[i - 1], lane)] if i else []
        if link in shared or not 0 < i < len(ear.links) - 1:
            points.append((float(columns[link]), lane))
        points += [(xs[i], lane)] if i < len(xs) else []
        found.append((link, tuple(points), row))
    return found


def _list_nets(
    mechanism: Mechanism, platform: Collection[str], ways: list[_Way], columns: dict[str, int]
) -> Iterable[Net]:
    table: dict[str, list[_Way]] = {}
    for way in ways:
        table.setdefault(way[0], []).append(way)
    bars = {
        link: _bound_lanes(own)
        for link, own in table.items()
        if len(own) > 1 or link == mechanism.base or link in platform
    }
    places = _place_bars(bars, columns)
    for link in mechanism.links:
        if link in table:
            at = float(columns[link])
            moved = tuple(
                tuple((places.get(link, at) if x == at else x, lane) for x, lane in points)
                for _, points, _ in table[link]
            )
            yield Net(link, moved, (places[link], *bars[link]) if link in bars else None, table[link][0][2])


def _bound_lanes(ways: list[_Way]) -> tuple[int, int]:
    """The first and the last lane of a link."""
    lanes = [points[0][1] for _, points, _ in ways]
    return min(lanes), max(lanes)


def _place_bars(bars: dict[str, tuple[int, int]], columns: dict[str, int]) -> dict[str, float]:
    """Place the bars: in their columns, those that share lanes beside each other."""
    places: dict[str, float] = {}
    for column in sorted({columns[link] for link in bars}):
        tracks: list[list[tuple[int, int]]] = []
        track = {link: _find_free_lane(tracks, *bars[link]) for link in bars if columns[link] == column}
        step = COLUMN_BAR_DISTANCE_MAX / max(len(tracks) - 1, 1)
        places |= {
            link: column + step * number - (COLUMN_BAR_DISTANCE_MAX / 2 if len(tracks) > 1 else 0.0)
            for link, number in track.items()
        }
    return places
