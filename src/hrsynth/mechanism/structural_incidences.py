"""Structural incidences: those that links and joints alone make hold.

A direction is fixed in a link; an R, a C or an E carries that of its axis to its other link, a P every direction, a U
each of its axes to its cross. A centre is fixed in the links of its joint, and a point on the axis of an R in both of
them. Heights along a direction pass an R or E about it and a P normal to it. Incidences between
geometry of one link in this sense hold in all configurations and operation modes; others may follow from closed loops.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from . import graphs
from .incidences import DirectionSource, Incidences
from .model import Joint, JointType, Mechanism

Kind = Literal["same", "square", "plane", "zero", "parallel", "normal", "seen"]
TURNING = (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR)
"""Joints whose axis is fixed in both links."""
LEVEL = (JointType.REVOLUTE, JointType.PLANAR)
"""Joints that keep heights along their axis."""
RIGID = (JointType.PRISMATIC, JointType.FIXED)
"""Joints that keep directions."""


@dataclass(frozen=True)
class GeometricIncidence:
    """Incidence: two directions of a class, fixed in ``links``, are the ``same``; classes are ``square`` or in a
    ``plane``; an incidence of the centres in ``terms`` (number, sign); a direction ``seen`` that is fixed in a link."""

    kind: Kind
    classes: tuple[int, ...] = ()
    terms: tuple[tuple[int, int], ...] = ()
    links: tuple[str, ...] = ()
    sight: DirectionSource | None = None

    def words(self, relations: Incidences) -> str:
        """Return the incidence as a text."""
        axes = " and ".join(relations.members(c) for c in self.classes)
        names = {number: name for name, number in relations.centres.items()}
        points = "centres of " + ", ".join(names.get(number, "a further point") for number, _ in self.terms)
        pair = len(self.terms) == 2
        match self.kind:
            case "same":
                return f"{axes}: parallel in {self.links[0]} and {self.links[1]}"
            case "square":
                return f"{axes}: perpendicular"
            case "plane":
                return f"{axes}: in one plane"
            case "zero":
                return f"{points}: {'one point' if pair else 'a parallelogram'}"
            case "parallel":
                return f"{points}: {'on a line' if pair else 'a parallelogram except for translations'} along {axes}"
            case "normal":
                return f"{points}: in a plane normal to {axes}"
            case _:
                return f"observed direction of {self.links[0]}: along its centres or axes"


def list_incidences(relations: Incidences) -> tuple[GeometricIncidence, ...]:
    """Return all incidences, one by one."""
    found = [
        GeometricIncidence("same", (c,), links=(links[0], link))
        for c, links in enumerate(relations.fixed)
        for link in dict.fromkeys(links)
        if link != links[0]
    ]
    for number, conditions in enumerate(relations.tower):
        found += [GeometricIncidence("square" if len(by) == 1 else "plane", (*by, number)) for by in conditions]
    found += [GeometricIncidence(each.kind, each.classes, each.terms) for each in relations.incidences]
    found += [
        GeometricIncidence("seen", sight.classes, links=(link,), sight=sight)
        for link, sight in zip(relations.watched, relations.sights, strict=True)
        if sight.kind != "class"
    ]
    return tuple(found)


def find_structural_incidences(
    mechanism: Mechanism, relations: Incidences, every: Iterable[GeometricIncidence]
) -> list[bool]:
    """Return the structural ones among the incidences."""
    known = _FixedGeometry(mechanism, relations)
    return [known.is_structural(tie) for tie in every]


class _FixedGeometry:
    """Directions and centres with the links in which they are fixed, and the crosses of U joints."""

    def __init__(self, mechanism: Mechanism, relations: Incidences) -> None:
        self.joints = list(mechanism.joints.values())
        self.axes = relations.axes
        self.square = {
            frozenset((number, *by))
            for number, conditions in enumerate(relations.tower)
            for by in conditions
            if len(by) == 1
        }
        number = len(relations.tower)
        self.groups = [self._joined_links(self._carriers(c)) for c in range(number)]
        """Groups of links in which one direction of each class is fixed or would be."""
        self.at_axis = [
            self._reach(groups, set(links)) for groups, links in zip(self.groups, relations.fixed, strict=True)
        ]
        """Links in which the directions of each class are fixed."""
        self.whole = [
            all(link in groups.get(links[0], links[:1]) for link in links)
            for groups, links in zip(self.groups, relations.fixed, strict=True)
        ]
        """All directions of a class are parallel by structure; else the directions are tested one by one."""
        slides = [
            [
                joint.links
                for joint in self.joints
                if joint.type is JointType.FIXED
                or (joint.type is JointType.PRISMATIC and self.axes[joint.name] == (c,))
            ]
            for c in range(number)
        ]
        self.slides = [self._joined_links(pairs) for pairs in slides]
        self.levels = [
            self._joined_links([j.links for j in self.joints if self._is_level_joint(j, c)]) for c in range(number)
        ]
        self.at = [{host} for host in relations.hosts]
        """Links in which each centre is fixed."""
        for joint in self.joints:
            if joint.name in relations.centres and joint.type is not JointType.CYLINDRICAL:
                self.at[relations.centres[joint.name]] |= {*joint.links, _name_cross(joint)}
        self._spread(relations)

    @staticmethod
    def _joined_links(pairs: Iterable[tuple[str, str]]) -> dict[str, frozenset[str]]:
        """Return all links joined to each link."""
        parts = (frozenset(part) for part in graphs.list_components(graphs.build_adjacency((), pairs)))
        return {link: part for part in parts for link in part}

    def _carriers(self, c: int) -> list[tuple[str, str]]:
        """Return pairs of links between which a direction of class c is carried."""
        pairs = []
        for joint in self.joints:
            if joint.type in RIGID or (joint.type in TURNING and self.axes[joint.name] == (c,)):
                pairs.append(joint.links)
            elif joint.type is JointType.UNIVERSAL:
                pairs += [
                    (link, _name_cross(joint))
                    for link, axis in zip(joint.links, self.axes[joint.name], strict=True)
                    if axis == c
                ]
        return pairs

    @staticmethod
    def _reach(groups: dict[str, frozenset[str]], links: set[str]) -> set[str]:
        return links.union(*(groups.get(link, ()) for link in links))

    def _is_level_joint(self, joint: Joint, c: int) -> bool:
        """Return True if a joint keeps heights along class c."""
        if joint.type is JointType.PRISMATIC:
            return self._is_square(c, *self.axes[joint.name])
        return joint.type is JointType.FIXED or (joint.type in LEVEL and self.axes[joint.name] == (c,))

    def _is_square(self, a: int, b: int) -> bool:
        """Return True if two classes are perpendicular by structure."""
        return (
            frozenset((a, b)) in self.square
            and self.whole[a]
            and self.whole[b]
            and not self.at_axis[a].isdisjoint(self.at_axis[b])
        )

    def _spread(self, relations: Incidences) -> None:
        """Add that a point on the axis of an R that is fixed in one of its links is fixed in the other."""
        on = [
            (number, joint.links)
            for each in relations.incidences
            if each.kind == "parallel" and len(each.terms) == 2
            for number, _ in each.terms
            for joint in self.joints
            if joint.type is JointType.REVOLUTE
            and self.axes[joint.name] == each.classes
            and relations.centres[joint.name] in {other for other, _ in each.terms} - {number}
        ]
        size = -1
        while size != (size := sum(map(len, self.at))):
            for number, links in on:
                if not self.at[number].isdisjoint(links):
                    self.at[number] |= set(links)

    def is_structural(self, tie: GeometricIncidence) -> bool:
        """Return True if an incidence is structural."""
        if tie.kind == "same":
            first, other = tie.links
            return other in self.groups[tie.classes[0]].get(first, ())
        if not all(self.whole[c] for c in tie.classes):
            return False
        match tie.kind:
            case "square":
                return self._is_square(*tie.classes)
            case "plane":
                together = set.intersection(*(self.at_axis[c] for c in tie.classes))
                return bool(together) or any(
                    all(self._is_square(n, c) for c in tie.classes)
                    for n in range(len(self.at_axis))
                    if n not in tie.classes
                )
            case "seen":
                return self._is_seen(tie)
        if len(tie.terms) != 2:
            return False
        one, two = (self.at[number] for number, _ in tie.terms)
        if tie.kind == "zero":
            return not one.isdisjoint(two)
        (c,) = tie.classes
        passing = self.slides[c] if tie.kind == "parallel" else self.levels[c]
        return any(
            (a == b or b in passing.get(a, ())) and not self.at_axis[c].isdisjoint({a, *passing.get(a, ())})
            for a in one
            for b in two
        )

    def _is_seen(self, tie: GeometricIncidence) -> bool:
        """Return True if all sources of an observed direction are fixed in its link."""
        assert tie.sight is not None
        (link,) = tie.links
        return all(link in self.at[number] for number in tie.sight.points) and all(
            link in self.at_axis[c] for c in tie.sight.classes
        )


def _name_cross(joint: Joint) -> str:
    """Return the name of a U joint's cross among those of links: no link has it."""
    return f"\0{joint.name}"
