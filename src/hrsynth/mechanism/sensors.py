"""Sensors of a mechanism: the direction of a segment of a leg, its line, an encoder on a joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from ..errors import BadRequest, HrsynthError, NoSegment
from ..geometry import lines
from ..geometry.vectors import Array, find_perpendicular, freeze_array, normalise_vector
from ..tolerances import INCIDENCE_TOL, POINT_DISTANCE_TOL
from . import graphs
from .composites import WordEdge
from .legs import Leg, LegDecomposition
from .model import Joint, JointType, Mechanism
from .normal import locate_centre_pair
from .observation import Observation
from .observations.direction import Direction
from .observations.encoder import AngleEncoder, Encoder, SlideEncoder
from .observations.line import SpaceLine

Place = TypeVar("Place")
INSTEAD = "Observe another direction: --sensor direction:LINK/dx,dy,dz (in the link's frame), or <observe> in the file."
"""Remedy for a leg without a segment."""
TURNING = (JointType.REVOLUTE, JointType.CYLINDRICAL)


def choose_default_segment(decomposition: LegDecomposition, leg: Leg, last: bool = False) -> Direction:
    """Return the default segment of a leg (docs/pages/theory.md, section 2): the axis of a P that connects two moving
    links; else the last segment before the platform (of equal parallel rods the first) with a length; with ``last`` the
    last one, and ``NoSegment`` if it has none."""
    return _choose_default(decomposition, leg, last)[0]


def _choose_default(decomposition: LegDecomposition, leg: Leg, last: bool = False) -> tuple[Direction, str]:
    """Return the default segment of a leg, and the reason for it."""
    if decomposition.is_free_body(leg):
        raise NoSegment(f"leg {leg.label}: no segment to observe: the platform is free", leg.joints[0], remedy=INSTEAD)
    segments = _Segments(decomposition, leg, INCIDENCE_TOL)
    path, nodes, base = segments.path, segments.nodes, decomposition.mechanism.base
    for i, edge in enumerate(path):
        joint = segments.joint(edge)
        if joint is not None and joint.type is JointType.PRISMATIC and base not in (nodes[i], nodes[i + 1]):
            return segments.along(nodes[i], joint, i), f"the axis of the prismatic joint {joint.name}"
    if leg.takes_platform:
        return segments.binary(decomposition.mechanism.platform), "the platform is the last segment of this leg"
    if path[-1].inside:
        rod = _choose_first(segments.binary, path[-1].inside)
        return rod, "the first of the parallel rods before the platform"
    if len(nodes) < 3:
        raise NoSegment(f"leg {leg.label}: no segment to observe: it is one joint", path[-1].joints[0], remedy=INSTEAD)
    found = _choose_first(segments.at, range(len(nodes) - 2, 0, -1)[: 1 if last else None])
    short = "" if found.link == nodes[-2] else " with a length"
    return found, f"the last segment before the platform{short}"


def _choose_first(segment: Callable[[Place], Direction], places: Sequence[Place]) -> Direction:
    """Return the first of some segments with a length (links between the R of a U have none). Raises ``NoSegment`` for
    the first if none has."""
    refused: NoSegment | None = None
    for place in places:
        try:
            return segment(place)
        except NoSegment as error:
            refused = refused or error
    assert refused is not None
    raise refused


def explain_default(decomposition: LegDecomposition, seen: Observation) -> str:
    """Return the reason why a segment is observed."""
    if any(each.key == seen.key for each in decomposition.mechanism.observations):
        return "named in the file" if seen.is_segment_direction or seen.line is not None else "requested"
    try:
        default, why = _choose_default(decomposition, decomposition.leg(seen.leg))
    except HrsynthError:
        return "requested"
    return why if default.key == seen.key else "requested"


def list_default_segments(decomposition: LegDecomposition) -> dict[str, Observation]:
    """Return the segment of each leg that has one: the file's choice, else the default one."""
    table: dict[str, Observation] = {}
    given = {o.leg: o for o in reversed(decomposition.mechanism.observations) if o.is_segment_direction}
    for leg in decomposition.legs:
        if leg.label in given:
            table[leg.label] = given[leg.label]
            continue
        try:
            table[leg.label] = choose_default_segment(decomposition, leg)
        except HrsynthError:
            continue
    return table


def observe_segment(decomposition: LegDecomposition, link: str) -> Direction:
    """Return the segment direction of any link of a leg: centre to centre, or along the axis of its P."""
    leg = decomposition.leg_of(link)
    if leg is None:
        raise BadRequest(
            f"{decomposition.mechanism.name}: link not in a leg",
            link,
            [n for each in decomposition.legs for n in each.links],
        )
    segments = _Segments(decomposition, leg)
    return segments.at(segments.nodes.index(link)) if link in segments.nodes[1:-1] else segments.binary(link)


class _Segments:
    """Directions of a leg's segments: links on its ``path``, between ``nodes``."""

    def __init__(self, decomposition: LegDecomposition, leg: Leg, least: float = POINT_DISTANCE_TOL) -> None:
        """Store the length ``least`` (characteristic lengths) up to which a segment has no direction."""
        self.least = least
        self.mechanism, self.leg, self.path = decomposition.mechanism, leg, decomposition.path(leg)
        self.nodes = [self.mechanism.base]
        for edge in self.path:
            self.nodes.append(edge.other(self.nodes[-1]))

    def at(self, place: int) -> Direction:
        """Return that of a node within the path: along the P after or before it, or between the centres of both
        edges."""
        for i in (place, place - 1):
            joint = self.joint(self.path[i])
            if joint is not None and joint.type.has_translation:
                return self.along(self.nodes[place], joint, i)
        link = self.nodes[place]
        a, b = self._centre(place - 1, link, place - 2), self._centre(place, link, place + 1)
        start, end = (
            locate_centre_pair(a, b)
            if isinstance(a, Joint) and isinstance(b, Joint)
            else (_locate_end(a, b), _locate_end(b, a))
        )
        return self._direction(link, end - start)

    def _centre(self, place: int, link: str, beyond: int) -> Joint | Array:
        """Return the end of a link at a place of the path; the point where two passive R meet (a U that is oblique or
        of rounded numbers), if the connector between them has no length. ``beyond`` is the place of the second."""
        end = self._end(self.path[place], link)
        other = self.joint(self.path[beyond]) if 0 <= beyond < len(self.path) else None
        pair = [
            each
            for each in (end, other)
            if isinstance(each, Joint) and each.type is JointType.REVOLUTE and not each.is_actuated
        ]
        if len(pair) < 2:
            return end
        meeting = lines.find_meeting_point(
            [(each.point, each.axis) for each in pair], INCIDENCE_TOL * self.mechanism.length
        )
        return end if meeting is None else meeting

    def binary(self, link: str) -> Direction:
        """Return that of a binary link: from the joint nearer to the base to the other."""
        joints = self.mechanism.joints_of(link)
        if len(joints) != 2:
            raise BadRequest(
                f"link {link!r} of leg {self.leg.label}: no direction of its own; its joints",
                len(joints),
                "2",
                remedy="Give the direction with <observe> and axis.",
            )
        own = {self.mechanism.base, *self.leg.links} - {link, self.mechanism.platform}
        distance = graphs.count_edges(self.mechanism.adjacency, self.mechanism.base, own)
        a, b = sorted(joints, key=lambda j: distance.get(j.other(link), len(self.mechanism.links)))
        for joint in (b, a):
            if joint.type.has_translation:
                return self._direction(link, joint.axis)
        start, end = locate_centre_pair(a, b)
        return self._direction(link, end - start)

    def along(self, link: str, joint: Joint, place: int) -> Direction:
        """Return that along the axis of the P or C at a place of the path, from the base side to the platform side."""
        joints, last = self.mechanism.joints, len(self.path) - 1
        before = joints[self.path[place - 1].joints[0]].point if place else joint.point
        after = (
            joints[self.path[place + 1].joints[0]].point
            if place < last
            else self.mechanism.links[self.leg.platform_link].pose[:3, 3]
        )
        backwards = float(joint.axis @ (after - before)) < -POINT_DISTANCE_TOL * self.mechanism.length
        return self._direction(link, -joint.axis if backwards else joint.axis)

    def joint(self, edge: WordEdge) -> Joint | None:
        """Return the joint that an edge is, if it is one."""
        return self.mechanism.joints[edge.joints[0]] if len(edge.joints) == 1 else None

    def _end(self, edge: WordEdge, link: str) -> Joint | Array:
        """Return the joint that the edge is, or the mean of the centres of its joints on a link."""
        joints = self.mechanism.joints
        return self.joint(edge) or np.mean([joints[n].point for n in edge.joints if link in joints[n].links], axis=0)

    def _direction(self, link: str, vector: Array) -> Direction:
        if np.linalg.norm(vector) <= self.least * self.mechanism.length:
            raise NoSegment(
                f"leg {self.leg.label}: length of the observed segment {link!r}",
                float(np.linalg.norm(vector)),
                "two different joint centres",
                remedy=INSTEAD,
            )
        return Direction(self.leg.label, link, self.mechanism.links[link].pose[:3, :3].T @ normalise_vector(vector))


def _locate_end(of: Joint | Array, seen_from: Joint | Array) -> Array:
    """Return a centre; of an R the point of its axis nearest to the other."""
    if not isinstance(of, Joint):
        return of
    if of.type is not JointType.REVOLUTE:
        return of.point
    return lines.project_to_line(seen_from.point if isinstance(seen_from, Joint) else seen_from, of.point, of.axis)


def make_encoders(mechanism: Mechanism, joint: Joint, leg: str = "") -> tuple[Encoder, ...]:
    """Return an encoder for each coordinate of an R, P, C (translation, rotation) or U (first, second axis); none for
    other types."""
    if joint.type is JointType.UNIVERSAL:
        return tuple(_make_angle_encoder(mechanism, each, leg, each.axes[1]) for each in (joint, joint.turned()))
    found: list[Encoder] = []
    if joint.type.has_translation:
        found.append(_make_slide_encoder(mechanism, joint, leg))
    if joint.type in TURNING:
        found.append(_make_angle_encoder(mechanism, joint, leg, find_perpendicular(joint.axis)))
    return tuple(found)


def _make_angle_encoder(mechanism: Mechanism, joint: Joint, leg: str, mark: Array) -> AngleEncoder:
    """Return the encoder of the angle about the first axis, fixed in the predecessor, of a direction ``mark`` fixed in
    the successor."""
    before, after = (mechanism.links[link].pose[:3, :3].T for link in joint.links)
    return AngleEncoder(
        leg,
        joint.successor,
        joint.name,
        freeze_array(before @ joint.axis),
        freeze_array(after @ mark),
        freeze_array(before @ mark),
        seen_from=joint.predecessor,
    )


def _make_slide_encoder(mechanism: Mechanism, joint: Joint, leg: str) -> SlideEncoder:
    before, after = (mechanism.links[link].pose for link in joint.links)
    return SlideEncoder(
        leg,
        joint.successor,
        joint.name,
        freeze_array(before[:3, :3].T @ joint.axis),
        freeze_array(after[:3, :3].T @ (joint.point - after[:3, 3])),
        freeze_array(before[:3, :3].T @ (joint.point - before[:3, 3])),
        seen_from=joint.predecessor,
    )


def locate_observed_line(decomposition: LegDecomposition, seen: Direction) -> SpaceLine:
    """Return the line whose direction is ``seen``: the one through the segment's first centre (that of a joint that
    does not translate, if there is one; docs/pages/theory.md, section 2)."""
    mechanism = decomposition.mechanism
    link = mechanism.links[seen.link]
    joints = sorted(mechanism.joints_of(seen.link), key=lambda joint: joint.type.has_translation)
    centre = locate_centre_pair(*joints)[0] if len(joints) == 2 else joints[0].point
    return SpaceLine(
        seen.leg,
        seen.link,
        at=link.pose[:3, :3].T @ (centre - link.pose[:3, 3]),
        axis=seen.direction,
        seen_from=seen.seen_from,
    )
