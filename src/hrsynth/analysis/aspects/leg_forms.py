"""The form of each leg and of each vector, found from the mechanism over configurations, never by names; what a pose
decides with them: whether each leg reaches it in its working mode, whether joints are within their limits, and the
vectors that the condition names. Lengths in characteristic lengths, base axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ...closed_forms.legs import ClosedFormLeg, OnCrank, OnRail, SlidingRod
from ...closed_forms.platform_points import ORIGIN, PlatformPoint, platform_point
from ...constraints.named_vectors import BodyPoint, NamedVector, Segment, Tangent, axis_of, centre_of, poses_at
from ...geometry.balls import Field
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Mechanism
from ...mechanism.legs import Leg, LegDecomposition
from ...tolerances import EXACT, FOLLOWED, SAME_RELATION
from .joint_limits import JointLimit, bounds
from .path_segments import PathCoordinates
from .vector_expressions import (
    DerivedVector,
    JointRules,
    LegVector,
    NoLegForm,
    SimpleVector,
    VectorExpression,
    value_of,
)


def on_rail(leg: str, tip: PlatformPoint, tips: Array, ends: Array, axis: Array) -> OnRail | None:
    """The rod from points (n, 3) that move along a base direction to tips (n, 3), or None where it is no rod."""
    rods = np.linalg.norm(tips - ends, axis=1)
    paths = ends - ends[0]
    off = paths - (paths @ axis)[:, None] * axis
    if np.ptp(rods) > FOLLOWED or np.max(np.abs(off)) > FOLLOWED:
        return None
    return OnRail(leg, tip, centre=ends[0], axis=axis, rod=float(rods[0]))


def on_crank(leg: str, tip: PlatformPoint, tips: Array, ends: Array, on: Array, axis: Array) -> OnCrank | None:
    """The rod from points (n, 3) that turn about a base axis to tips (n, 3), or None where it is no rod."""
    rods = np.linalg.norm(tips - ends, axis=1)
    spokes = ends - on
    height = spokes @ axis
    spokes = spokes - height[:, None] * axis
    cranks = np.linalg.norm(spokes, axis=1)
    if max(np.ptp(rods), np.ptp(cranks), np.ptp(height)) > FOLLOWED or cranks[0] < FOLLOWED:
        return None
    return OnCrank(leg, tip, centre=on + height[0] * axis, axis=axis, radius=float(cranks[0]), rod=float(rods[0]))


def sliding(leg: str, tip: PlatformPoint, tips: Array, centre: Array, axis: Array | None, directions: Array
            ) -> SlidingRod | None:
    """The rod with directions (n, 3) that slides through tips (n, 3), or None where it does not."""
    D = tips - centre
    if np.max(np.linalg.norm(np.cross(D, directions), axis=1)) < FOLLOWED:
        return SlidingRod(leg, tip, centre=centre)
    if axis is None or np.max(np.abs(directions @ axis)) > FOLLOWED:
        return None
    aside = np.cross(axis, directions)
    offsets = np.einsum("ij,ij->i", D, aside)
    if np.ptp(offsets) > FOLLOWED:
        return None
    return SlidingRod(leg, tip, centre=centre, axis=axis, aside=float(offsets[0]))


@dataclass(frozen=True, eq=False)
class LegStates:
    """Reach margins (n, limbs + bounds) and the condition's vectors by symbol, (n, 3), at poses; points from the
    first leg's tip."""

    reach_margins: Field
    values: Mapping[str, Field]


@dataclass(frozen=True, eq=False)
class LegForms:
    """Closed forms of all legs in their working modes, and how the condition's vectors follow from them."""

    limbs: tuple[ClosedFormLeg, ...]
    vectors: Mapping[str, VectorExpression]
    points: tuple[str, ...] = ()
    """Symbols of points; the first is where they are measured from."""
    bounds: tuple[JointLimit, ...] = ()
    """Limits of joints; each has a margin too."""

    @property
    def modes(self) -> tuple[float, ...]:
        """The working mode of each limb, ±1."""
        return tuple(limb.mode for limb in self.limbs)

    def flipped(self, limb: int) -> LegForms:
        """The same with one limb in its other working mode."""
        other = replace(self.limbs[limb], mode=-self.limbs[limb].mode)
        return replace(self, limbs=(*self.limbs[:limb], other, *self.limbs[limb + 1 :]))

    def beyond(self, p: Array, R: Array) -> tuple[str, ...]:
        """The joints that are not within their limits at one pose (3,), (3, 3)."""
        within = self.at(p[None], R[None]).reach_margins[0, len(self.limbs) :] > 0
        return tuple(bound.joint for bound, held in zip(self.bounds, within, strict=True) if not held)

    def at(self, p: Field, R: Field, leading: tuple[int, Field] | None = None) -> LegStates:
        """What poses (n, 3), (n, 3, 3) decide, for numbers or balls; of a limb that leads, what it carries is given."""
        with np.errstate(invalid="ignore"):
            solved = [(0 * p[:, 0] + 1.0, leading[1]) if leading is not None and leading[0] == number
                      else limb.solve(limb.tip.value(p, R), limb.mode) for number, limb in enumerate(self.limbs)]
            carried = [vector for _, vector in solved]
            values = {symbol: value_of(each, p, R, carried) for symbol, each in self.vectors.items()}
            within = [bound.reach_margin(lambda each: value_of(each, p, R, carried)) for bound in self.bounds]
        values.update({symbol: values[symbol] - values[self.points[0]] for symbol in self.points[::-1]})
        return LegStates(np.stack([*(margin for margin, _ in solved), *within], axis=1), values)


@dataclass(frozen=True, eq=False)
class LegPattern:
    """Closed forms without a working mode, the vector that each carries, and how the wanted vectors follow."""

    coordinates: PathCoordinates
    limbs: tuple[ClosedFormLeg, ...]
    carried: tuple[NamedVector, ...]
    vectors: Mapping[str, VectorExpression]
    points: tuple[str, ...]
    bounds: tuple[JointLimit, ...] = ()
    """Limits of joints that are kept."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """What was fitted to samples and not read from the joints: legs, and vectors by their symbols."""
        legs = dict.fromkeys(f"leg {limb.label}" for limb in self.limbs if limb.fitted)
        return (*legs, *(symbol for symbol, source in self.vectors.items() if source.fitted))

    def forms(self, at: ClosedConfiguration) -> LegForms:
        """The forms in a configuration's working mode; raises ``NoLegForm`` where a leg does not follow its form."""
        p, R = self.coordinates.of([at])
        limbs = []
        for limb, feature in zip(self.limbs, self.carried, strict=True):
            tip = limb.tip.value(p, R)
            actual = feature.value(poses_at([at], feature.links))
            mode = limb.modes(tip, actual)
            if not np.linalg.norm(limb.solve(tip, mode)[1] - actual) < SAME_RELATION:
                raise NoLegForm(f"leg {limb.label} does not follow its form")
            limbs.append(replace(limb, mode=float(mode[0])))
        return LegForms(tuple(limbs), self.vectors, self.points, self.bounds)


def pattern(anatomy: LegDecomposition, features: Sequence[NamedVector], coordinates: PathCoordinates,
            configurations: Sequence[ClosedConfiguration]) -> LegPattern:
    """The forms of all legs and of the wanted features; raises ``NoLegForm`` where one fits none."""
    rules = JointRules.of(anatomy, coordinates, configurations)
    sight = SampledMechanism(anatomy.mechanism, coordinates, configurations, rules)
    found: list[tuple[ClosedFormLeg, NamedVector]] = []
    for leg in anatomy.legs:
        of_leg = list(sight.limbs(leg))
        if not of_leg:
            raise NoLegForm(f"leg {leg.label} is neither a rod on a crank or rail nor a rod that slides")
        found += of_leg
    limbs, carried = (tuple(part) for part in zip(*found, strict=True))
    vectors = {f.symbol: sight.source(f, carried) for f in features}
    points = tuple(f.symbol for f in features if isinstance(f, BodyPoint))
    kept = tuple(bounds(sight, lambda feature: sight.source(feature, carried)))
    return LegPattern(coordinates, limbs, carried, vectors, points, kept)


@dataclass(frozen=True, eq=False)
class SampledMechanism:
    """A mechanism seen at configurations: where points and directions of it are."""

    mechanism: Mechanism
    coordinates: PathCoordinates
    configurations: Sequence[ClosedConfiguration]
    derived: JointRules

    def values(self, feature: NamedVector) -> Array:
        return feature.value(poses_at(self.configurations, feature.links))

    def rule(self, feature: NamedVector) -> PlatformPoint | None:
        """How a vector follows from the pose: read from the joints, if that is what samples show, else fitted."""
        values, places = self.values(feature), self.coordinates.of(self.configurations)
        found = self.derived.rule(feature)
        if found is not None and np.max(np.abs(found.value(*places) - values)) < FOLLOWED:
            return found
        return platform_point(values, *places)

    def limbs(self, leg: Leg) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
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

    def tips(self, leg: Leg) -> Iterator[tuple[PlatformPoint, BodyPoint]]:
        """Joint centres of a leg, and the point whose position is told, that the pose alone decides."""
        for joint in self.joints(leg):
            if self.mechanism.base not in joint.links:
                spot = self.centre(joint, joint.successor)
                rule = self.rule(spot)
                if rule is not None and (rule.follows or np.any(rule.turned)):
                    yield rule, spot
        if not self.coordinates.turning:
            motion = self.coordinates.motion
            yield (ORIGIN,
                   BodyPoint("P", "the point", motion.link, motion.point / self.coordinates.length))

    def rods(self, leg: Leg, tip: PlatformPoint, spot: BodyPoint) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
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
                    found: ClosedFormLeg | None = on_crank(leg.label, tip, tips, ends, on, axis)
                else:
                    found = on_rail(leg.label, tip, tips, ends, axis)
                if found is not None:
                    # one link holds the rod's two ends, so that its length is constant
                    rod = set(self.derived.holders(spot)) & set(self.derived.holders(end))
                    yield replace(found, fitted=tip.fitted or not rod), end

    def slides(self, leg: Leg) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
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

    def drawn(self, foot: Joint, slide: Joint, tip: BodyPoint, limb: SlidingRod) -> bool:
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

    def source(self, feature: NamedVector, carried: Sequence[NamedVector]) -> VectorExpression:
        """How a vector follows from pose and limbs: read from the joints where that can be, else fitted to samples."""
        found = list(self.sources(feature, carried))
        if not found:
            raise NoLegForm(f"{feature.symbol} ({feature.meaning}) does not follow from the pose by a known form")
        return next((each for each in found if not each.fitted), found[0])

    def sources(self, feature: NamedVector, carried: Sequence[NamedVector]) -> Iterator[VectorExpression]:
        values, rule = self.values(feature), self.rule(feature)
        if rule is not None:
            yield rule
        for i, each in enumerate(carried):
            same = self.derived.same(feature, each)
            if same:
                yield LegVector(i, same, np.zeros(3))
            for sense in (1.0, -1.0):
                offset = values - sense * self.values(each)
                if np.max(np.ptp(offset, axis=0)) < FOLLOWED:
                    yield LegVector(i, sense, np.where(np.abs(offset[0]) < FOLLOWED, 0.0, offset[0]), True)
        if isinstance(feature, Tangent | Segment) and self.lasting(feature):
            try:
                start, end = (self.source(part, carried) for part in (feature.start, feature.end))
                axis = self.source(feature.axis, carried) if isinstance(feature, Tangent) else None
            except NoLegForm:
                return
            if not any(isinstance(part, DerivedVector) for part in (start, end, axis)):
                yield DerivedVector(*cast(tuple[SimpleVector, SimpleVector, SimpleVector | None], (start, end, axis)))

    def lasting(self, feature: Tangent | Segment) -> bool:
        """Whether the vector of which a feature is the direction keeps its length, so that it never vanishes."""
        along = self.values(feature.end) - self.values(feature.start)
        if isinstance(feature, Tangent):
            along = np.cross(self.values(feature.axis), along)
        return bool(np.ptp(np.linalg.norm(along, axis=1)) < FOLLOWED)

    def joints(self, leg: Leg) -> list[Joint]:
        return [self.mechanism.joints[name] for name in leg.joints]

    def centre(self, joint: Joint, link: str) -> BodyPoint:
        return centre_of(self.mechanism, joint, link, "P", self.coordinates.length)
