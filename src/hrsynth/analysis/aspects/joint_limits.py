"""Joint limits: the coordinates of R and P joints as functions of the pose, with a margin that is positive within."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from ...constraints.named_vectors import make_axis
from ...geometry.balls import Field
from ...geometry.so3 import wrap_angle
from ...geometry.vectors import Array, cross, dot
from ...mechanism import Joint, JointType
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, RELATION_ANGLE_TOL, ROTATION_LEVER_MIN_FRACTION
from .sampled_mechanism import SampledMechanism
from .vector_expressions import NoLegForm, VectorExpression

Value = Callable[[VectorExpression], Field]


@dataclass(frozen=True, eq=False)
class LinkVector:
    """Vector fixed in a link: from one source to another, or one source alone."""

    end: VectorExpression
    start: VectorExpression | None = None

    def value(self, of: Value) -> Field:
        return of(self.end) if self.start is None else np.asarray(of(self.end) - of(self.start))


@dataclass(frozen=True, eq=False)
class TurnLimit:
    """Limit of an R joint: its angle, from ``one`` in its predecessor to ``two`` in its successor about ``axis``,
    differs from ``middle`` by less than ``half``. ``size`` is the product of the two vectors' parts normal to the
    axis."""

    joint: str
    axis: VectorExpression
    one: LinkVector
    two: LinkVector
    middle: float
    half: float
    size: float

    def reach_margin(self, of: Value) -> Field:
        """size (cos(angle − middle) − cos half), (n,)."""
        cosine, sine = _turn_between(self.one.value(of), self.two.value(of), of(self.axis))
        along = cosine * float(np.cos(self.middle)) + sine * float(np.sin(self.middle))
        return np.asarray(along - self.size * (float(np.cos(self.half)) + HIDDEN_ROBOT_RESIDUAL_TOL))


@dataclass(frozen=True, eq=False)
class SlideLimit:
    """Limit of a P joint: its shift along ``axis``, from a point of its predecessor to one of its successor
    (characteristic lengths): |shift − middle| < half."""

    joint: str
    axis: VectorExpression
    arm: LinkVector
    middle: float
    half: float

    def reach_margin(self, of: Value) -> Field:
        """half² − (shift − middle)², (n,)."""
        shift = dot(self.arm.value(of), of(self.axis)) - self.middle
        return np.asarray(self.half**2 - shift * shift)


JointLimit = TurnLimit | SlideLimit


def list_joint_limits(sight: SampledMechanism, source: Callable[..., VectorExpression]) -> Iterator[JointLimit]:
    """Yield the limits of joints whose coordinate follows from the pose."""
    for name, (lower, upper) in sight.mechanism.joint_ranges.items():
        if not -np.inf < lower < upper < np.inf:
            continue
        joint = sight.mechanism.joints[name]
        found = _bound(sight, source, joint, (lower + upper) / 2, (upper - lower) / 2)
        if found is not None:
            yield found


def _bound(
    sight: SampledMechanism, source: Callable[..., VectorExpression], joint: Joint, middle: float, half: float
) -> JointLimit | None:
    model = sight.configurations[0].model
    (place,) = model.coordinates[joint.name] if joint.type.freedoms == 1 else (None,)
    if place is None:
        return None
    coordinates = np.array([model.difference(model.q0, at.q)[place] for at in sight.configurations])
    known = _Known(sight, source)
    axis = known.source(make_axis(sight.mechanism, joint, "a"))
    if axis is None:
        return None
    along = sight.values(make_axis(sight.mechanism, joint, "a"))
    if joint.type is JointType.PRISMATIC:
        for (one, start), (two, end) in product(known.points(joint.predecessor), known.points(joint.successor)):
            offsets = np.einsum("ij,ij->i", two - one, along) - coordinates
            if np.ptp(offsets) < RELATION_ANGLE_TOL:
                length = sight.coordinates.length
                shift = middle / length + float(offsets[0])
                return SlideLimit(joint.name, axis, LinkVector(end, start), shift, half / length)
    elif joint.type is JointType.REVOLUTE and half < np.pi:
        for (one, first), (two, second) in product(known.arms(joint.predecessor), known.arms(joint.successor)):
            cosine, sine = _turn_between(one, two, along)
            offsets = [wrap_angle(float(x)) for x in np.arctan2(sine, cosine) - coordinates]
            size = np.hypot(cosine, sine)
            apart = [wrap_angle(x - offsets[0]) for x in offsets]
            if (
                np.max(np.abs(apart)) < RELATION_ANGLE_TOL
                and np.ptp(size) < HIDDEN_ROBOT_RESIDUAL_TOL < ROTATION_LEVER_MIN_FRACTION**2 < size[0]
            ):
                return TurnLimit(joint.name, axis, first, second, middle + offsets[0], half, float(size[0]))
    return None


@dataclass(frozen=True, eq=False)
class _Known:
    """Points and vectors of links that follow from the pose, with their values at the sampled configurations."""

    sight: SampledMechanism
    of: Callable[..., VectorExpression]

    def source(self, feature: object) -> VectorExpression | None:
        try:
            return self.of(feature)
        except NoLegForm:
            return None

    def points(self, link: str) -> list[tuple[Array, VectorExpression]]:
        spots = [self.sight.centre(joint, link) for joint in self.sight.mechanism.joints_of(link)]
        return [(self.sight.values(spot), found) for spot in spots if (found := self.source(spot)) is not None]

    def arms(self, link: str) -> Iterator[tuple[Array, LinkVector]]:
        for (one, start), (two, end) in combinations(self.points(link), 2):
            yield two - one, LinkVector(end, start)
        for joint in self.sight.mechanism.joints_of(link):
            if joint.type is JointType.PRISMATIC:
                axis = make_axis(self.sight.mechanism, joint, "p")
                found = self.source(axis)
                if found is not None:
                    yield self.sight.values(axis), LinkVector(found)


def _turn_between(one: Field, two: Field, axis: Field) -> tuple[Field, Field]:
    """Return cosine and sine of the rotation from a vector to another about a unit axis, times their parts normal to
    it."""
    return (np.asarray(dot(one, two) - dot(one, axis) * dot(two, axis)), dot(axis, cross(one, two)))
