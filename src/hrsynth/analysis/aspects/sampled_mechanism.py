"""Mechanism sampled at configurations: which rods, sliders and vectors of it follow from the pose, and by which
form."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ...closed_forms.legs import ClosedFormLeg, OnCrank, OnRail, SlidingRod
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


def fit_rail_rod(leg: str, tip: PlatformPoint, tips: Array, ends: Array, axis: Array) -> OnRail | None:
    """Return the rod from points (n, 3) that move along a base direction to tips (n, 3), or None if its length
    changes."""
    rods = np.linalg.norm(tips - ends, axis=1)
    paths = ends - ends[0]
    off = paths - (paths @ axis)[:, None] * axis
    if np.ptp(rods) > HIDDEN_ROBOT_RESIDUAL_TOL or np.max(np.abs(off)) > HIDDEN_ROBOT_RESIDUAL_TOL:
        return None
    return OnRail(leg, tip, centre=ends[0], axis=axis, rod=float(rods[0]))


def fit_crank_rod(leg: str, tip: PlatformPoint, tips: Array, ends: Array, on: Array, axis: Array) -> OnCrank | None:
    """Return the rod from points (n, 3) that rotate about a base axis to tips (n, 3), or None if its length changes."""
    rods = np.linalg.norm(tips - ends, axis=1)
    spokes = ends - on
    height = spokes @ axis
    spokes = spokes - height[:, None] * axis
    cranks = np.linalg.norm(spokes, axis=1)
    if (
        max(np.ptp(rods), np.ptp(cranks), np.ptp(height)) > HIDDEN_ROBOT_RESIDUAL_TOL
        or cranks[0] < HIDDEN_ROBOT_RESIDUAL_TOL
    ):
        return None
    return OnCrank(leg, tip, centre=on + height[0] * axis, axis=axis, radius=float(cranks[0]), rod=float(rods[0]))


def fit_sliding_rod(
    leg: str, tip: PlatformPoint, tips: Array, centre: Array, axis: Array | None, directions: Array
) -> SlidingRod | None:
    """Return the rod with directions (n, 3) that slides through tips (n, 3), or None if it does not."""
    D = tips - centre
    if np.max(np.linalg.norm(np.cross(D, directions), axis=1)) < HIDDEN_ROBOT_RESIDUAL_TOL:
        return SlidingRod(leg, tip, centre=centre)
    if axis is None or np.max(np.abs(directions @ axis)) > HIDDEN_ROBOT_RESIDUAL_TOL:
        return None
    aside = np.cross(axis, directions)
    offsets = np.einsum("ij,ij->i", D, aside)
    if np.ptp(offsets) > HIDDEN_ROBOT_RESIDUAL_TOL:
        return None
    return SlidingRod(leg, tip, centre=centre, axis=axis, aside=float(offsets[0]))


@dataclass(frozen=True, eq=False)
class SampledMechanism:
    """Mechanism at sampled configurations: positions of points and directions of it."""

    mechanism: Mechanism
    coordinates: PathCoordinates
    configurations: Sequence[ClosedConfiguration]
    derived: JointRules

    def values(self, feature: NamedVector) -> Array:
        return feature.value(collect_poses(self.configurations, feature.links))

    def rule(self, feature: NamedVector) -> PlatformPoint | None:
        """Return how a vector follows from the pose: read from the joints if samples agree, else fitted."""
        values, places = self.values(feature), self.coordinates.of(self.configurations)
        found = self.derived.rule(feature)
        if found is not None and np.max(np.abs(found.value(*places) - values)) < HIDDEN_ROBOT_RESIDUAL_TOL:
            return found
        return platform_point(values, *places)

    def subchains(self, leg: Leg) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
        """Yield the rods of a leg with the vectors that they carry, each equation once; else its sliding rod."""
        seen: list[tuple[Array, Array]] = []
        for tip, spot in self.tips(leg):
            for limb, end in self.rods(leg, tip, spot):
                ends, tips = self.values(end), self.values(spot)
                if all(
                    max(np.ptp(ends - a, axis=0).max(), np.max(np.abs(ends - a - tips + b))) > HIDDEN_ROBOT_RESIDUAL_TOL
                    for a, b in seen
                ):
                    seen.append((ends, tips))
                    yield limb, end
        if not seen:
            yield from self.slides(leg)

    def tips(self, leg: Leg) -> Iterator[tuple[PlatformPoint, BodyPoint]]:
        """Yield the joint centres of a leg, and the point that gives the position, that follow from the pose alone."""
        for joint in self.joints(leg):
            if self.mechanism.base not in joint.links:
                spot = self.centre(joint, joint.successor)
                rule = self.rule(spot)
                if rule is not None and (rule.follows or np.any(rule.turned)):
                    yield rule, spot
        if not self.coordinates.turning:
            motion = self.coordinates.motion
            yield (ORIGIN, BodyPoint("P", "the point", motion.link, motion.point / self.coordinates.length))

    def rods(self, leg: Leg, tip: PlatformPoint, spot: BodyPoint) -> Iterator[tuple[ClosedFormLeg, NamedVector]]:
        joints, tips = self.joints(leg), self.values(spot)
        for foot in joints:
            if self.mechanism.base not in foot.links or foot.type not in (JointType.REVOLUTE, JointType.PRISMATIC):
                continue
            first = foot.predecessor if foot.successor == self.mechanism.base else foot.successor
            axis = self.values(make_axis(self.mechanism, foot, "a"))[0]
            on = self.values(self.centre(foot, self.mechanism.base))[0]
            for joint in joints:
                if joint is foot or first not in joint.links:
                    continue
                end = self.centre(joint, first)
                ends = self.values(end)
                if foot.type is JointType.REVOLUTE:
                    found: ClosedFormLeg | None = fit_crank_rod(leg.label, tip, tips, ends, on, axis)
                else:
                    found = fit_rail_rod(leg.label, tip, tips, ends, axis)
                if found is not None:
                    # one link has both ends of the rod, so that its length is constant
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
                axis = self.values(make_axis(self.mechanism, foot, "a"))[0] if turns else None
                for slide in joints:
                    if slide.type is JointType.PRISMATIC and slide is not foot:
                        direction = make_axis(self.mechanism, slide, "p")
                        found = fit_sliding_rod(leg.label, tip, tips, centre, axis, self.values(direction))
                        if found is not None:
                            fitted = tip.fitted or not self.is_rod_form_of_slider(foot, slide, spot, found)
                            yield replace(found, fitted=fitted), direction
                            return

    def is_rod_form_of_slider(self, foot: Joint, slide: Joint, tip: BodyPoint, limb: SlidingRod) -> bool:
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
