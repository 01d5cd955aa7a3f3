"""The form of each leg and of each vector, found from the mechanism over configurations, never by names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ...constraints.named_vectors import BodyPoint, NamedVector, Segment, Tangent, axis_of, centre_of, poses_at
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Mechanism
from ...mechanism.legs import Leg, LegDecomposition
from ...tolerances import EXACT, FOLLOWED, SAME_RELATION
from .carriage import Carriage, Rigid, rigid
from .chart import Chart
from .derived import Derived
from .limbs import Limb, Sliding, on_crank, on_rail, sliding
from .limits import Bound, bounds
from .sources import Borne, Made, NoChart, Source


@dataclass(frozen=True, eq=False)
class Pattern:
    """Limbs without a working mode, the vector that each carries, and how the wanted vectors follow."""

    carriage: Carriage
    limbs: tuple[Limb, ...]
    carried: tuple[NamedVector, ...]
    vectors: Mapping[str, Source]
    points: tuple[str, ...]
    bounds: tuple[Bound, ...] = ()
    """Limits of joints that are kept."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """What was fitted to samples and not read from the joints: legs, and vectors by their symbols."""
        legs = dict.fromkeys(f"leg {limb.leg}" for limb in self.limbs if limb.fitted)
        return (*legs, *(symbol for symbol, source in self.vectors.items() if source.fitted))

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


def pattern(anatomy: LegDecomposition, features: Sequence[NamedVector], carriage: Carriage,
            configurations: Sequence[ClosedConfiguration]) -> Pattern:
    """The forms of all legs and of the wanted features; raises ``NoChart`` where one fits none."""
    sight = Sight(anatomy.mechanism, carriage, configurations, Derived.of(anatomy, carriage, configurations))
    found: list[tuple[Limb, NamedVector]] = []
    for leg in anatomy.legs:
        of_leg = list(sight.limbs(leg))
        if not of_leg:
            raise NoChart(f"leg {leg.label} is neither a rod on a crank or rail nor a rod that slides")
        found += of_leg
    limbs, carried = (tuple(part) for part in zip(*found, strict=True))
    vectors = {f.symbol: sight.source(f, carried) for f in features}
    return Pattern(carriage, limbs, carried, vectors, tuple(f.symbol for f in features if isinstance(f, BodyPoint)),
                   tuple(bounds(sight, lambda feature: sight.source(feature, carried))))


@dataclass(frozen=True, eq=False)
class Sight:
    """A mechanism seen at configurations: where points and directions of it are."""

    mechanism: Mechanism
    carriage: Carriage
    configurations: Sequence[ClosedConfiguration]
    derived: Derived

    def values(self, feature: NamedVector) -> Array:
        return feature.value(poses_at(self.configurations, feature.links))

    def rule(self, feature: NamedVector) -> Rigid | None:
        """How a vector follows from the pose: read from the joints, if that is what samples show, else fitted."""
        values, places = self.values(feature), self.carriage.of(self.configurations)
        found = self.derived.rule(feature)
        if found is not None and np.max(np.abs(found.value(*places) - values)) < FOLLOWED:
            return found
        return rigid(values, *places)

    def limbs(self, leg: Leg) -> Iterator[tuple[Limb, NamedVector]]:
        """The rods of a leg with the vectors that they carry, each equation once; else its sliding rod."""
        seen: list[tuple[Array, Array]] = []
        for tip, spot in self.tips(leg):
            for limb, end in self.rods(leg, tip, spot):
                ends, tips = self.values(end), self.values(spot)
                if all(max(np.ptp(ends - a, axis=0).max(), np.max(np.abs(ends - a - tips + b))) > FOLLOWED
                       for a, b in seen):
                    seen.append((ends, tips))
                    yield limb, end
        if not seen:
            yield from self.slides(leg)

    def tips(self, leg: Leg) -> Iterator[tuple[Rigid, BodyPoint]]:
        """Joint centres of a leg, and the point whose position is told, that the pose alone decides."""
        for joint in self.joints(leg):
            if self.mechanism.base not in joint.links:
                spot = self.centre(joint, joint.successor)
                rule = self.rule(spot)
                if rule is not None and (rule.follows or np.any(rule.turned)):
                    yield rule, spot
        if not self.carriage.turning:
            motion = self.carriage.motion
            yield (Rigid(True, np.zeros(3), np.zeros(3)),
                   BodyPoint("P", "the point", motion.link, motion.point / self.carriage.length))

    def rods(self, leg: Leg, tip: Rigid, spot: BodyPoint) -> Iterator[tuple[Limb, NamedVector]]:
        joints, tips = self.joints(leg), self.values(spot)
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
                    # one link holds the rod's two ends, so that its length is constant
                    rod = set(self.derived.holders(spot)) & set(self.derived.holders(end))
                    yield replace(found, fitted=tip.fitted or not rod), end

    def slides(self, leg: Leg) -> Iterator[tuple[Limb, NamedVector]]:
        joints = self.joints(leg)
        feet = [joint for joint in joints if self.mechanism.base in joint.links]
        for tip, spot in self.tips(leg):
            tips = self.values(spot)
            for foot in feet:
                centre = self.values(self.centre(foot, self.mechanism.base))[0]
                turns = foot.type is JointType.REVOLUTE
                axis = self.values(axis_of(self.mechanism, foot, "a"))[0] if turns else None
                for slide in joints:
                    if slide.type is JointType.PRISMATIC and slide is not foot:
                        direction = axis_of(self.mechanism, slide, "p")
                        found = sliding(leg.label, tip, tips, centre, axis, self.values(direction))
                        if found is not None:
                            fitted = tip.fitted or not self.drawn(foot, slide, spot, found)
                            yield replace(found, fitted=fitted), direction
                            return

    def drawn(self, foot: Joint, slide: Joint, tip: BodyPoint, limb: Sliding) -> bool:
        """Whether a P joint between a link that holds the foot's centre and one that holds the tip makes the form: its
        axis passes through both, or stays normal to the foot's axis."""
        centre = self.centre(foot, self.mechanism.base)
        near, far = self.derived.holders(centre), self.derived.holders(tip)
        if not any(one in near and slide.other(one) in far for one in slide.links):
            return False
        if limb.axis is None:
            arm = self.derived.zero(tip) - self.derived.zero(centre)
            return bool(np.linalg.norm(np.cross(arm, slide.axis)) <= EXACT * max(1.0, float(np.linalg.norm(arm))))
        return foot.type is JointType.REVOLUTE and bool(abs(foot.axis @ slide.axis) <= EXACT)

    def source(self, feature: NamedVector, carried: Sequence[NamedVector]) -> Source:
        """How a vector follows from pose and limbs: read from the joints where that can be, else fitted to samples."""
        found = list(self.sources(feature, carried))
        if not found:
            raise NoChart(f"{feature.symbol} ({feature.meaning}) does not follow from the pose by a known form")
        return next((each for each in found if not each.fitted), found[0])

    def sources(self, feature: NamedVector, carried: Sequence[NamedVector]) -> Iterator[Source]:
        values, rule = self.values(feature), self.rule(feature)
        if rule is not None:
            yield rule
        for i, each in enumerate(carried):
            same = self.derived.same(feature, each)
            if same:
                yield Borne(i, same, np.zeros(3))
            for sense in (1.0, -1.0):
                offset = values - sense * self.values(each)
                if np.max(np.ptp(offset, axis=0)) < FOLLOWED:
                    yield Borne(i, sense, np.where(np.abs(offset[0]) < FOLLOWED, 0.0, offset[0]), True)
        if isinstance(feature, Tangent | Segment) and self.lasting(feature):
            try:
                start, end = (self.source(part, carried) for part in (feature.start, feature.end))
                axis = self.source(feature.axis, carried) if isinstance(feature, Tangent) else None
            except NoChart:
                return
            if not any(isinstance(part, Made) for part in (start, end, axis)):
                yield Made(cast(Rigid | Borne, start), cast(Rigid | Borne, end), cast(Rigid | Borne | None, axis))

    def lasting(self, feature: Tangent | Segment) -> bool:
        """Whether the vector of which a feature is the direction keeps its length, so that it never vanishes."""
        along = self.values(feature.end) - self.values(feature.start)
        if isinstance(feature, Tangent):
            along = np.cross(self.values(feature.axis), along)
        return bool(np.ptp(np.linalg.norm(along, axis=1)) < FOLLOWED)

    def joints(self, leg: Leg) -> list[Joint]:
        return [self.mechanism.joints[name] for name in leg.joints]

    def centre(self, joint: Joint, link: str) -> BodyPoint:
        return centre_of(self.mechanism, joint, link, "P", self.carriage.length)
