"""Paths of a leg from the base to its end as screws at the zero configuration: the end's displacement is the product of
the joints' displacements, E_1(q_1) … E_n(q_n).

A leg with inner loops has several paths; each alone is a weaker condition than the leg, so what a path excludes the leg
excludes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from ..geometry.balls import Field
from ..geometry.lines import find_common_perpendicular, measure_line_distance
from ..geometry.vectors import Array, cross, dot, transform
from ..mechanism import Joint, JointType
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.screws import split_elementary
from ..mechanism.tilt_limit import TiltLimit
from ..tolerances import GEOMETRY_DIFFERENCE_TOL

LEG_PATHS_MAX = 16
"""Largest number of paths of one leg."""
AXIS_CROSSING_SINE_MIN = 1e-2
"""Least sine of the angle between two axes whose intersection is taken as known."""


@dataclass(frozen=True, eq=False)
class MotionFactor:
    """A turn about ``axis`` through ``point`` (R), a shift along ``axis`` (P), or turns about several axes through
    ``point`` (``axis`` None: S, U, axes that meet), which are taken for any turn about it. ``joints`` are those it is
    made of; ``pair`` are the two axes, from the base, where it has no more; ``limit`` is the tilt limit of one S."""

    slides: bool
    point: Array
    axis: Array | None
    joints: tuple[str, ...]
    pair: tuple[Array, Array] | None = None
    limit: TiltLimit | None = None

    @property
    def direction(self) -> Field:
        """Axis, to be multiplied by balls."""
        assert self.axis is not None
        return self.axis.astype(object)

    @property
    def joint(self) -> str | None:
        """Joint whose coordinate is the part's, if it is one R or P."""
        return self.joints[0] if self.axis is not None and len(self.joints) == 1 else None

    def circle(self, x: Field) -> tuple[Field, Field, Field]:
        """Return the circle of a point about the axis: x(q) = centre + v cos q + w sin q (Rodrigues)."""
        axis = self.direction
        arm = x - self.point
        along = dot(arm, axis) * axis
        v = arm - along
        return self.point + along, v, cross(axis, v)

    def moved(self, x: Field, q: Any) -> Field:
        """Return the point moved by the part with value q."""
        if self.slides:
            return np.asarray(x + np.asarray(self.direction * q))
        centre, v, w = self.circle(x)
        return np.asarray(centre + v * q.cos() + w * q.sin())

    def rotated(self, vector: Field, q: Any) -> Field:
        """Return a vector rotated with the part by q."""
        return replace(self, point=np.zeros(3)).moved(vector, q)

    def reversed(self) -> MotionFactor:
        """Return the part from its other side: the same coordinate, the opposite motion."""
        pair = None if self.pair is None else (self.pair[1], self.pair[0])
        limit = None if self.limit is None else self.limit.turned()
        return replace(self, axis=None if self.axis is None else -self.axis, pair=pair, limit=limit)


def list_leg_paths(decomposition: LegDecomposition, leg: Leg) -> Iterator[tuple[MotionFactor, ...]]:
    """Yield the paths from the base to the link on which a leg ends, up to ``LEG_PATHS_MAX``, without those through a
    free joint; if the platform is a point, any rotation about it is their last part."""
    mechanism = decomposition.mechanism
    frame, point = mechanism.links[mechanism.platform].pose, decomposition.point
    last = () if point is None else (MotionFactor(False, transform(frame, point), None, ()),)
    joints = [mechanism.joints[name] for name in leg.joints]

    def onward(link: str, been: tuple[str, ...], parts: tuple[MotionFactor, ...]) -> Iterator[tuple[MotionFactor, ...]]:
        if link == leg.platform_link:
            yield parts
            return
        for joint in joints:
            if link in joint.links and joint.other(link) not in been and joint.type is not JointType.FREE:
                beyond = joint.other(link)
                if beyond == leg.platform_link or beyond in leg.links:
                    yield from onward(beyond, (*been, beyond), (*parts, *_split_joint(joint, link)))

    for way in islice(onward(mechanism.base, (mechanism.base,), ()), LEG_PATHS_MAX):
        yield gather_parts((*way, *last), GEOMETRY_DIFFERENCE_TOL * mechanism.length)


def _split_joint(joint: Joint, near: str) -> list[MotionFactor]:
    """Return a joint as parts, from one of its links."""
    seen = joint if joint.predecessor == near else joint.turned()
    point, name = np.asarray(seen.point), (joint.name,)
    one = (*name, "") if joint.type.freedoms > 1 else name
    if joint.type is JointType.SPHERICAL:
        limit = seen.wrist if seen.wrist is not None and seen.wrist.is_limiting else None
        return [MotionFactor(False, point, None, name, limit=limit)]
    return [
        MotionFactor(kind is JointType.PRISMATIC, point, axis, one)
        for kind, axis in split_elementary(joint.type, seen.axes)
    ]


def gather_parts(parts: tuple[MotionFactor, ...], tolerance: float) -> tuple[MotionFactor, ...]:
    """Join neighbouring parts that rotate about one point or one axis; ``tolerance`` in metres, by which axes may miss
    each other."""
    found: list[MotionFactor] = []
    for part in parts:
        merged = _merge(found[-1], part, tolerance) if found else None
        if merged is None:
            found.append(part)
        else:
            found[-1] = merged
    return tuple(found)


def _merge(one: MotionFactor, other: MotionFactor, tolerance: float) -> MotionFactor | None:
    joints = tuple(dict.fromkeys((*one.joints, *other.joints)))
    if one.slides or other.slides:
        return None
    if one.axis is not None and other.axis is not None:
        near, far = find_common_perpendicular(one.point, one.axis, other.point, other.axis)
        if np.linalg.norm(far - near) > tolerance:
            return None
        sine = np.linalg.norm(cross(one.axis, other.axis))
        if sine > AXIS_CROSSING_SINE_MIN:
            return MotionFactor(False, 0.5 * (near + far), None, joints, (one.axis, other.axis))
        return MotionFactor(False, one.point, one.axis, (*joints, "")) if sine <= GEOMETRY_DIFFERENCE_TOL else None
    wrist, turn = (one, other) if one.axis is None else (other, one)
    apart = (
        np.linalg.norm(wrist.point - turn.point)
        if turn.axis is None
        else measure_line_distance(wrist.point, turn.point, turn.axis)
    )
    return MotionFactor(False, wrist.point, None, joints) if apart <= tolerance else None
