"""Source of a vector: the pose, a leg that carries it, or both; and rules read from the joints of a file: which point
or direction is fixed in several links at once, and how those that the platform carries follow from its pose.

A point is fixed in both links of a joint if it lies on the R's axis or is the centre of a U or S; a direction, if the
joint is a P, or an R or C along it. All of it is true at the zero configuration to ``EXACT``, and hence in motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from ...closed_forms.platform_points import ORIGIN, PlatformPoint
from ...constraints.named_vectors import BodyPoint, BodyVector, NamedVector
from ...geometry.balls import Field, normalise_balls
from ...geometry.lines import measure_line_distance
from ...geometry.vectors import Array, cross, dot
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import Joint, JointType, Mechanism
from ...mechanism.legs import LegDecomposition
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .path_segments import PathCoordinates


class NoLegForm(Exception):
    """Legs that do not follow from a pose: the reason, for the answer."""


@dataclass(frozen=True, eq=False)
class LegVector:
    """Vector that a subchain carries: ``sense`` · its vector + ``offset``."""

    limb: int
    sense: float
    offset: Array
    fitted: bool = False


SimpleVector = PlatformPoint | LegVector


@dataclass(frozen=True, eq=False)
class DerivedVector:
    """Unit vector from ``start`` to ``end``, or of ``axis`` × it."""

    start: SimpleVector
    end: SimpleVector
    axis: SimpleVector | None

    @property
    def fitted(self) -> bool:
        """True if one of its parts is fitted."""
        return any(part is not None and part.fitted for part in (self.start, self.end, self.axis))


@dataclass(frozen=True, eq=False)
class SightVector:
    """Vector of what a camera observes: the unit cross product of two ``parts``; or, of a centre, a point and an axis,
    the normal of the plane through the centre that touches the cylinder of this ``radius``. It has no value only where
    nothing is visible, and is enclosed nowhere near."""

    parts: tuple[VectorExpression, ...]
    radius: float | None = None

    @property
    def fitted(self) -> bool:
        """True if one of its parts is fitted."""
        return any(part.fitted for part in self.parts)

    def value(self, *parts: Field) -> Field:
        """Return the value for those of its parts."""
        if self.radius is None:
            one, other = parts
            return normalise_balls(cross(one, other))
        start, on, d = parts
        out = on - start
        foot = out - dot(out, d)[..., None] * d
        square = dot(foot, foot)[..., None]
        aside = np.sqrt(square - self.radius**2)
        return np.asarray((self.radius * foot + aside * cross(d, foot)) / square)


VectorExpression = PlatformPoint | LegVector | DerivedVector | SightVector


def evaluate_expression(each: VectorExpression, p: Field, R: Field, carried: Sequence[Field]) -> Field:
    if isinstance(each, PlatformPoint):
        return each.value(p, R)
    if isinstance(each, LegVector):
        return np.asarray(each.sense * carried[each.limb] + each.offset)
    if isinstance(each, SightVector):
        return each.value(*(evaluate_expression(part, p, R, carried) for part in each.parts))
    along = evaluate_expression(each.end, p, R, carried) - evaluate_expression(each.start, p, R, carried)
    return normalise_balls(along if each.axis is None else cross(evaluate_expression(each.axis, p, R, carried), along))


def collect_subchains(each: Any) -> set[int]:
    """Return the subchains on whose vectors an expression, or what is made of expressions, depends."""
    if isinstance(each, LegVector):
        return {each.limb}
    parts = (
        each if isinstance(each, tuple) else [getattr(each, f.name) for f in fields(each)] if is_dataclass(each) else []
    )
    return set().union(*map(collect_subchains, parts))


@dataclass(frozen=True, eq=False)
class CarriedLink:
    """Link that the pose carries: the rule of its ``anchor`` (3,) (at zero, characteristic lengths), and whether it
    rotates with the platform (True), not at all (False), or otherwise (None)."""

    rule: PlatformPoint
    anchor: Array
    turns: bool | None


@dataclass(frozen=True, eq=False)
class JointRules:
    """Rules of points and directions, read from the joints of a mechanism; ``bodies``: links that the pose carries."""

    mechanism: Mechanism
    length: float
    bodies: Mapping[str, CarriedLink]

    @classmethod
    def of(
        cls,
        decomposition: LegDecomposition,
        coordinates: PathCoordinates,
        configurations: Sequence[ClosedConfiguration],
    ) -> JointRules:
        """Return the base and the platform's links, from joint to joint. Configurations show which of these rotate;
        that the joints between them allow it follows from the joints."""
        mechanism, length, link = decomposition.mechanism, coordinates.length, coordinates.motion.link
        frame = mechanism.links[link].pose
        anchor = (frame[:3, :3] @ coordinates.motion.point + frame[:3, 3]) / length
        bodies = {mechanism.base: CarriedLink(PlatformPoint(False, np.zeros(3), np.zeros(3)), np.zeros(3), False)}
        known = cls(mechanism, length, bodies)
        bodies[link] = CarriedLink(ORIGIN, anchor, _decide_rotation(mechanism, link, coordinates, configurations))
        reached = [link]
        for one in reached:
            for joint in mechanism.joints_of(one):
                other = joint.other(one)
                if other in decomposition.platform and other not in bodies and _has_fixed_centre(joint):
                    rule = known.point(one, joint.point / length)
                    if rule is not None:
                        turns = _decide_rotation(mechanism, other, coordinates, configurations)
                        bodies[other] = CarriedLink(rule, joint.point / length, turns)
                        reached.append(other)
        return known

    def rule(self, feature: NamedVector) -> PlatformPoint | None:
        """Return the rule of a point or direction, if a link that the pose carries has it too."""
        if isinstance(feature, BodyPoint):
            x = self.zero(feature)
            rules = (self.point(link, x) for link in self.holders(feature) if link in self.bodies)
            return next((rule for rule in rules if rule is not None), None)
        if isinstance(feature, BodyVector):
            d = self.zero(feature)
            turns = [self.bodies[link].turns for link in self.holders(feature) if link in self.bodies]
            if False in turns:
                return PlatformPoint(False, np.zeros(3), d)
            if True in turns:
                return PlatformPoint(False, self._rotate(d), np.zeros(3))
        return None

    def point(self, link: str, x: Array) -> PlatformPoint | None:
        """Return the rule of a point (3,) (at zero, characteristic lengths) of a link that the pose carries."""
        body = self.bodies[link]
        arm = x - body.anchor
        if np.linalg.norm(arm) <= EXACT_INCIDENCE_TOL:
            return body.rule
        if body.turns is None:
            return None
        turned, constant = (self._rotate(arm), np.zeros(3)) if body.turns else (np.zeros(3), arm)
        return PlatformPoint(body.rule.follows, body.rule.turned + turned, body.rule.constant + constant)

    def zero(self, feature: BodyPoint | BodyVector) -> Array:
        """Return a point (characteristic lengths) or direction at the zero configuration."""
        X = self.mechanism.links[feature.link].pose
        if isinstance(feature, BodyVector):
            return np.asarray(X[:3, :3] @ feature.direction)
        return np.asarray(X[:3, :3] @ feature.place + X[:3, 3] / self.length)

    def holders(self, feature: BodyPoint | BodyVector) -> tuple[str, ...]:
        """Return the links in which a point or direction is fixed."""
        value, found = self.zero(feature), [feature.link]
        shared = self._is_fixed_point if isinstance(feature, BodyPoint) else _is_fixed_direction
        for link in found:
            for joint in self.mechanism.joints_of(link):
                if joint.other(link) not in found and shared(joint, value):
                    found.append(joint.other(link))
        return tuple(found)

    def same(self, one: NamedVector, other: NamedVector) -> float:
        """Return ±1 where two points, or directions of this sense, are the same in all configurations; else 0."""
        if (
            type(one) is not type(other)
            or not isinstance(one, BodyPoint | BodyVector)
            or not isinstance(other, BodyPoint | BodyVector)
        ):
            return 0.0
        if not set(self.holders(one)) & set(self.holders(other)):
            return 0.0
        a, b = self.zero(one), self.zero(other)
        for sense in (1.0, -1.0) if isinstance(one, BodyVector) else (1.0,):
            if np.linalg.norm(a - sense * b) <= EXACT_INCIDENCE_TOL:
                return sense
        return 0.0

    def _is_fixed_point(self, joint: Joint, x: Array) -> bool:
        if joint.type is JointType.REVOLUTE:
            return measure_line_distance(x, joint.point / self.length, joint.axis) <= EXACT_INCIDENCE_TOL
        return _has_fixed_centre(joint) and bool(np.linalg.norm(x - joint.point / self.length) <= EXACT_INCIDENCE_TOL)

    def _rotate(self, vector: Array) -> Array:
        """Return a vector at zero in the platform's frame."""
        link = next(name for name, body in self.bodies.items() if body.rule.follows)
        return np.asarray(self.mechanism.links[link].pose[:3, :3].T @ vector)


def _has_fixed_centre(joint: Joint) -> bool:
    """Return True if a joint's centre is fixed in both its links."""
    return joint.type in (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL, JointType.FIXED)


def _is_fixed_direction(joint: Joint, d: Array) -> bool:
    if joint.type in (JointType.PRISMATIC, JointType.FIXED):
        return True
    along = joint.type in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR)
    return along and bool(np.linalg.norm(np.cross(joint.axis, d)) <= EXACT_INCIDENCE_TOL)


def _decide_rotation(
    mechanism: Mechanism, link: str, coordinates: PathCoordinates, configurations: Sequence[ClosedConfiguration]
) -> bool | None:
    zero, platform = mechanism.links[link].pose[:3, :3], mechanism.links[coordinates.motion.link].pose[:3, :3]
    turns = np.array([at.pose(link)[:3, :3] @ zero.T for at in configurations])
    if np.max(np.abs(turns - np.eye(3))) < HIDDEN_ROBOT_RESIDUAL_TOL:
        return False
    with_it = np.array([at.pose(coordinates.motion.link)[:3, :3] @ platform.T for at in configurations])
    return True if coordinates.turning and np.max(np.abs(turns - with_it)) < HIDDEN_ROBOT_RESIDUAL_TOL else None
