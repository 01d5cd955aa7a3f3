"""The form of each leg and of each vector, found from the mechanism over configurations, never by names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Mechanism
from ...mechanism.legs import Anatomy, Leg
from ...mechanism.vectors import Array
from ...tolerances import FOLLOWED, SAME_RELATION
from ..singularity.features import Feature, Segment, Spot, Tangent, axis_of, centre_of, poses_at
from .carriage import Carriage, Rigid, rigid
from .chart import Chart
from .limbs import Limb, on_crank, on_rail, sliding
from .limits import Bound, bounds
from .sources import Borne, Made, NoChart, Source


@dataclass(frozen=True, eq=False)
class Pattern:
    """Limbs without a working mode, the vector that each carries, and how the wanted vectors follow."""

    carriage: Carriage
    limbs: tuple[Limb, ...]
    carried: tuple[Feature, ...]
    vectors: Mapping[str, Source]
    points: tuple[str, ...]
    bounds: tuple[Bound, ...] = ()
    """Limits of joints that are kept."""

    def chart(self, at: ClosedConfiguration) -> Chart:
        """The chart in the working mode of a configuration; raises ``NoChart`` where a leg does not follow its form."""
        p, R = self.carriage.of([at])
        limbs = []
        for limb, feature in zip(self.limbs, self.carried, strict=True):
            tip = limb.tip.value(p, R)
            actual = feature.value(poses_at([at], feature.links))
            branch = limb.branches(tip, actual)
            if not np.linalg.norm(limb.solve(tip, branch)[1] - actual) < SAME_RELATION:
                raise NoChart(f"leg {limb.leg} does not follow its form")
            limbs.append(replace(limb, branch=float(branch[0])))
        return Chart(tuple(limbs), self.vectors, self.points, self.bounds)


def pattern(anatomy: Anatomy, features: Sequence[Feature], carriage: Carriage,
            configurations: Sequence[ClosedConfiguration]) -> Pattern:
    """The forms of all legs and of the wanted features; raises ``NoChart`` where one fits none."""
    sight = Sight(anatomy.mechanism, carriage, configurations)
    found: list[tuple[Limb, Feature]] = []
    for leg in anatomy.legs:
        of_leg = list(sight.limbs(leg))
        if not of_leg:
            raise NoChart(f"leg {leg.label} is neither a rod on a crank or rail nor a rod that slides")
        found += of_leg
    limbs, carried = (tuple(part) for part in zip(*found, strict=True))
    vectors = {f.symbol: sight.source(f, carried) for f in features}
    return Pattern(carriage, limbs, carried, vectors, tuple(f.symbol for f in features if isinstance(f, Spot)),
                   tuple(bounds(sight, lambda feature: sight.source(feature, carried))))


@dataclass(frozen=True, eq=False)
class Sight:
    """A mechanism seen at configurations: where points and directions of it are."""

    mechanism: Mechanism
    carriage: Carriage
    configurations: Sequence[ClosedConfiguration]

    def values(self, feature: Feature) -> Array:
        return feature.value(poses_at(self.configurations, feature.links))

    def rule(self, values: Array) -> Rigid | None:
        return rigid(values, *self.carriage.of(self.configurations))

    def limbs(self, leg: Leg) -> Iterator[tuple[Limb, Feature]]:
        """The rods of a leg with the vectors that they carry, each equation once; else its sliding rod."""
        seen: list[tuple[Array, Array]] = []
        for tip, tips in self.tips(leg):
            for limb, end in self.rods(leg, tip, tips):
                ends = self.values(end)
                if all(max(np.ptp(ends - a, axis=0).max(), np.max(np.abs(ends - a - tips + b))) > FOLLOWED
                       for a, b in seen):
                    seen.append((ends, tips))
                    yield limb, end
        if not seen:
            yield from self.slides(leg)

    def tips(self, leg: Leg) -> Iterator[tuple[Rigid, Array]]:
        """Joint centres of a leg, and the point whose position is told, that the pose alone decides."""
        for joint in self.joints(leg):
            if self.mechanism.base not in joint.links:
                values = self.values(self.centre(joint, joint.successor))
                rule = self.rule(values)
                if rule is not None and (rule.follows or np.any(rule.turned)):
                    yield rule, values
        if not self.carriage.turning:
            yield Rigid(True, np.zeros(3), np.zeros(3)), self.carriage.of(self.configurations)[0]

    def rods(self, leg: Leg, tip: Rigid, tips: Array) -> Iterator[tuple[Limb, Feature]]:
        joints = self.joints(leg)
        for foot in joints:
            if self.mechanism.base not in foot.links or foot.type not in (JointType.REVOLUTE, JointType.PRISMATIC):
                continue
            first = foot.predecessor if foot.successor == self.mechanism.base else foot.successor
            axis = self.values(axis_of(self.mechanism, foot, "a"))[0]
            on = self.values(self.centre(foot, self.mechanism.base))[0]
            for joint in joints:
                if joint is foot or first not in joint.links:
                    continue
                end = self.centre(joint, first)
                ends = self.values(end)
                if foot.type is JointType.REVOLUTE:
                    found: Limb | None = on_crank(leg.label, tip, tips, ends, on, axis)
                else:
                    found = on_rail(leg.label, tip, tips, ends, axis)
                if found is not None:
                    yield found, end

    def slides(self, leg: Leg) -> Iterator[tuple[Limb, Feature]]:
        joints = self.joints(leg)
        feet = [joint for joint in joints if self.mechanism.base in joint.links]
        for tip, tips in self.tips(leg):
            for foot in feet:
                centre = self.values(self.centre(foot, self.mechanism.base))[0]
                turns = foot.type is JointType.REVOLUTE
                axis = self.values(axis_of(self.mechanism, foot, "a"))[0] if turns else None
                for slide in joints:
                    if slide.type is JointType.PRISMATIC and slide is not foot:
                        direction = axis_of(self.mechanism, slide, "p")
                        found = sliding(leg.label, tip, tips, centre, axis, self.values(direction))
                        if found is not None:
                            yield found, direction
                            return

    def source(self, feature: Feature, carried: Sequence[Feature]) -> Source:
        """How a vector follows from pose and limbs."""
        values = self.values(feature)
        rule = self.rule(values)
        if rule is not None:
            return rule
        for i, each in enumerate(carried):
            for sense in (1.0, -1.0):
                offset = values - sense * self.values(each)
                if np.max(np.ptp(offset, axis=0)) < FOLLOWED:
                    return Borne(i, sense, np.where(np.abs(offset[0]) < FOLLOWED, 0.0, offset[0]))
        if isinstance(feature, Tangent | Segment):
            start, end = (self.source(part, carried) for part in (feature.start, feature.end))
            axis = self.source(feature.axis, carried) if isinstance(feature, Tangent) else None
            if not any(isinstance(part, Made) for part in (start, end, axis)) and self.lasting(feature):
                return Made(cast(Rigid | Borne, start), cast(Rigid | Borne, end), cast(Rigid | Borne | None, axis))
        raise NoChart(f"{feature.symbol} ({feature.meaning}) does not follow from the pose by a known form")

    def lasting(self, feature: Tangent | Segment) -> bool:
        """Whether the vector of which a feature is the direction keeps its length, so that it never vanishes."""
        along = self.values(feature.end) - self.values(feature.start)
        if isinstance(feature, Tangent):
            along = np.cross(self.values(feature.axis), along)
        return bool(np.ptp(np.linalg.norm(along, axis=1)) < FOLLOWED)

    def joints(self, leg: Leg) -> list[Joint]:
        return [self.mechanism.joints[name] for name in leg.joints]

    def centre(self, joint: Joint, link: str) -> Spot:
        return centre_of(self.mechanism, joint, link, "P", self.carriage.length)
