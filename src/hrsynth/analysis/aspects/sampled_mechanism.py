"""Mechanism sampled at configurations: which rods, sliders and vectors of it follow from the pose, and by which
form."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np

from ...closed_forms.leg_reading import LegReader, LegTip
from ...closed_forms.legs import ClosedFormLeg
from ...closed_forms.platform_points import ORIGIN, PlatformPoint, platform_point
from ...constraints.named_vectors import (
    BodyPoint,
    CrossProduct,
    NamedVector,
    Ray,
    Segment,
    Tangent,
    TangentNormal,
    collect_poses,
    make_axis,
    make_centre,
)
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Mechanism
from ...mechanism.legs import Leg
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .path_segments import PathCoordinates
from .vector_expressions import (
    DerivedVector,
    JointRules,
    LegVector,
    NoLegForm,
    SightVector,
    SimpleVector,
    VectorExpression,
)


@dataclass(frozen=True, eq=False)
class SampledMechanism:
    """Mechanism at sampled configurations: positions of points and directions of it."""

    mechanism: Mechanism
    coordinates: PathCoordinates
    configurations: Sequence[ClosedConfiguration]
    derived: JointRules

    @cached_property
    def frames(self) -> dict[str, Array]:
        """The poses (n, 4, 4) of all links, characteristic lengths."""
        return collect_poses(self.configurations, tuple(self.mechanism.links))

    @cached_property
    def places(self) -> tuple[Array, Array]:
        """The poses (n, 3), (n, 3, 3) of the platform."""
        return self.coordinates.of(self.configurations)

    def values(self, feature: NamedVector) -> Array:
        return feature.value(self.frames)

    def rule(self, feature: NamedVector) -> PlatformPoint | None:
        """Return how a vector follows from the pose: read from the joints if samples agree, else fitted."""
        values, places = self.values(feature), self.places
        found = self.derived.rule(feature)
        if found is not None and np.max(np.abs(found.value(*places) - values)) < HIDDEN_ROBOT_RESIDUAL_TOL:
            return found
        return platform_point(values, *places)

    def subchains(self, leg: Leg) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
        """Yield the rods of a leg with the vectors that they carry, each equation once; else its sliding rod."""
        seen: list[tuple[Array, Array]] = []
        reader = LegReader(self.mechanism, leg, self.frames, *self.places, self.coordinates.length)
        for tip, spot in self.tips(leg):
            tips = self.values(spot)
            for limb, joint, ends in reader.rods(tip):
                if all(
                    max(np.ptp(ends - a, axis=0).max(), np.max(np.abs(ends - a - tips + b))) > HIDDEN_ROBOT_RESIDUAL_TOL
                    for a, b in seen
                ):
                    seen.append((ends, tips))
                    end = self.centre(joint, limb.crank)
                    # one link has both ends of the rod, so that its length is constant
                    rod = set(self.derived.holders(spot)) & set(self.derived.holders(end))
                    yield replace(limb, fitted=limb.tip.fitted or not rod), end
        if not seen:
            yield from itertools.islice(self.slides(reader), 1)

    def tips(self, leg: Leg) -> Iterator[tuple[LegTip, BodyPoint]]:
        """Yield the joint centres of a leg, and the point that gives the position, that follow from the pose alone."""
        spots = [self.centre(j, j.successor) for j in self.joints(leg) if self.mechanism.base not in j.links]
        rules = [(self.rule(spot), spot) for spot in spots]
        if not self.coordinates.turning:
            motion = self.coordinates.motion
            spot = BodyPoint("P", "the point", motion.link, motion.point / self.coordinates.length)
            rules.append((ORIGIN, spot))
        for rule, spot in rules:
            if rule is not None and (rule.follows or np.any(rule.turned)):
                yield LegTip(np.zeros(3), lambda _, rule=rule: rule), spot  # type: ignore[misc]

    def slides(self, reader: LegReader) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
        """Yield the rods that slide along a P of a leg."""
        for tip, spot in self.tips(reader.leg):
            for slide in reader.joints:
                if slide.type is JointType.PRISMATIC:
                    direction = make_axis(self.mechanism, slide, "p")
                    for limb, foot in reader.sliding_rods(tip, self.values(direction)):
                        if foot is not slide:
                            fitted = limb.tip.fitted or not self.is_rod_form_of_slider(foot, slide, spot, limb)
                            yield replace(limb, fitted=fitted), direction

    def is_rod_form_of_slider(self, foot: Joint, slide: Joint, tip: BodyPoint, limb: ClosedFormLeg) -> bool:
        """Return True if a P joint between a link with the proximal centre and one with the tip makes the form: its
        axis passes through both, or stays normal to the proximal axis."""
        centre = self.centre(foot, self.mechanism.base)
        near, far = self.derived.holders(centre), self.derived.holders(tip)
        if not any(one in near and slide.other(one) in far for one in slide.links):
            return False
        if limb.axis is None:
            arm = self.derived.zero(tip) - self.derived.zero(centre)
            return bool(
                np.linalg.norm(np.cross(arm, slide.axis)) <= EXACT_INCIDENCE_TOL * max(1.0, float(np.linalg.norm(arm)))
            )
        return foot.type is JointType.REVOLUTE and bool(abs(foot.axis @ slide.axis) <= EXACT_INCIDENCE_TOL)

    def has_closed_inner_loops(self, leg: Leg, carried: Sequence[NamedVector]) -> bool:
        """Return True if the loops inside a leg close where its rods do: pose and subchains determine all joint centres
        in them. Other loops (a crank driven by a rocker) are not covered by the forms, and may not reach."""
        for name in leg.loop_joints(self.mechanism):
            joint = self.mechanism.joints[name]
            known = (any(self.sources(self.centre(joint, link), carried)) for link in joint.links)
            if joint.type is JointType.PRISMATIC or not any(known):
                return False
        return True

    def source(self, feature: NamedVector, carried: Sequence[NamedVector]) -> VectorExpression:
        """Return how a vector follows from pose and subchains: read from the joints where possible, else fitted to
        samples."""
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
                if np.max(np.ptp(offset, axis=0)) < HIDDEN_ROBOT_RESIDUAL_TOL:
                    yield LegVector(
                        i, sense, np.where(np.abs(offset[0]) < HIDDEN_ROBOT_RESIDUAL_TOL, 0.0, offset[0]), True
                    )
        if isinstance(feature, CrossProduct | TangentNormal):
            parts = (
                (feature.one, feature.other)
                if isinstance(feature, CrossProduct)
                else (feature.start, feature.on_axis, feature.axis)
            )
            yield SightVector(
                tuple(self.source(part, carried) for part in parts),
                feature.radius if isinstance(feature, TangentNormal) else None,
            )
        if isinstance(feature, Ray) or (isinstance(feature, Tangent | Segment) and self.has_constant_length(feature)):
            try:
                start, end = (self.source(part, carried) for part in (feature.start, feature.end))
                axis = self.source(feature.axis, carried) if isinstance(feature, Tangent) else None
            except NoLegForm:
                return
            if not any(isinstance(part, DerivedVector) for part in (start, end, axis)):
                yield DerivedVector(*cast(tuple[SimpleVector, SimpleVector, SimpleVector | None], (start, end, axis)))

    def has_constant_length(self, feature: Tangent | Segment) -> bool:
        """Return True if the vector of which a feature is the direction keeps its length, so that it never vanishes."""
        along = self.values(feature.end) - self.values(feature.start)
        if isinstance(feature, Tangent):
            along = np.cross(self.values(feature.axis), along)
        return bool(np.ptp(np.linalg.norm(along, axis=1)) < HIDDEN_ROBOT_RESIDUAL_TOL)

    def joints(self, leg: Leg) -> list[Joint]:
        return [self.mechanism.joints[name] for name in leg.joints]

    def centre(self, joint: Joint, link: str) -> BodyPoint:
        return make_centre(self.mechanism, joint, link, "P", self.coordinates.length)
