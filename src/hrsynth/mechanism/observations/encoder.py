"""Coordinate of a joint, measured by an encoder: the only kind whose chain is the real joint, actuated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ...geometry.screws import compute_point_velocity
from ...geometry.so3 import wrap_angle
from ...geometry.vectors import Array, cross, normalise_vector, transform
from ..cameras import compute_relative_pose
from ..observation import Drawn, Observation, ObservationRecord


@dataclass(frozen=True, eq=False, repr=False)
class Encoder(Observation):
    """Encoder of one coordinate of a joint: the motion of ``link`` relative to ``seen_from``, the joint's other link.

    ``axis`` is the joint's axis in the frame of ``seen_from``, shape (3,).
    """

    kind = "encoder"
    words = "the coordinate of a real joint"
    locked = "the moment about the axis of an R, the force along that of a P"
    needs = ("joint",)
    size = 1
    rank = 1
    feature_error = "y − y*, of angles without full rotations"
    joint: str
    axis: Array

    @property
    def key(self) -> tuple[str, ...]:
        return (self.joint, type(self).__name__, self.link)

    def to_dict(self) -> ObservationRecord:
        return {**super().to_dict(), "joint": self.joint}


@dataclass(frozen=True, eq=False, repr=False)
class AngleEncoder(Encoder):
    """Encoder of the angle about the axis since the zero configuration of a direction fixed in the link.

    ``mark`` is that direction in the link's frame, ``start`` the same at zero in the frame of ``seen_from``, both (3,)
    and not parallel to the axis: any normal of it for R and C, the other axis for U.
    """

    turns_only = True
    angular = True
    found_by = frozenset({"rad"})
    mark: Array
    start: Array

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        R, R_c = (compute_relative_pose(link, into, poses)[:3, :3] for link in (self.link, str(self.seen_from)))
        axis, start = R_c @ self.axis, R_c @ self.start
        return replace(super().carried_by(into, poses), axis=axis, mark=R @ self.mark, start=start)

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """Return the angle, shape (1,), in (−π, π]."""
        mark = X_reference[:3, :3].T @ X_link[:3, :3] @ self.mark
        normal = self.start - (self.axis @ self.start) * self.axis
        return np.array([np.arctan2(self.axis @ cross(normal, mark), normal @ mark)])

    def difference(self, value: Array, wanted: Array) -> Array:
        """Return the difference without full rotations: at 180 degrees the angle is π as well as −π."""
        return np.array([wrap_angle(float(value[0] - wanted[0]))])

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        return value + noise["rad"] * shocks[0, :1]

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        """Return an arc about the axis, at the link's frame, from its mark at zero to its mark now."""
        turn, R = float(self.value(X_reference, X_link)[0]), X_reference[:3, :3]
        spoke = normalise_vector(self.start - (self.axis @ self.start) * self.axis)
        turns = np.linspace(0, turn, 17)[:, None]
        arc = np.cos(turns) * spoke + np.sin(turns) * cross(self.axis, spoke)
        return Drawn((X_link[:3, 3] + size / 2 * np.vstack([np.zeros(3), arc, np.zeros(3)]) @ R.T,))

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """Return a* · (ω_ℓ − ω_c), shape (1, n); a* = (a − c m) / (1 − c²), c = a · m: dual to the axis a and the mark
        m."""
        axis, mark = X_reference[:3, :3] @ self.axis, X_link[:3, :3] @ self.mark
        cosine = float(axis @ mark)
        return ((axis - cosine * mark) / (1 - cosine**2))[None] @ (V_link[3:] - V_reference[3:])


@dataclass(frozen=True, eq=False, repr=False)
class SlideEncoder(Encoder):
    """Encoder of the displacement along the axis since the zero configuration.

    ``point`` is the joint's centre in the link's frame, ``start`` the same at zero in the frame of ``seen_from``, (3,).
    """

    dimension = 1
    found_by = frozenset({"m"})
    point: Array
    start: Array

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        X, X_c = (compute_relative_pose(link, into, poses) for link in (self.link, str(self.seen_from)))
        axis, start = X_c[:3, :3] @ self.axis, transform(X_c, self.start)
        return replace(super().carried_by(into, poses), axis=axis, point=transform(X, self.point), start=start)

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """Return the length, shape (1,), in metres."""
        arm = transform(X_link, self.point) - X_reference[:3, 3]
        return np.array([self.axis @ (X_reference[:3, :3].T @ arm - self.start)])

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        return value + noise["m"] * shocks[0, :1]

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        """Return the segment since zero."""
        return Drawn((np.array([transform(X_reference, self.start), transform(X_link, self.point)]),))

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """Return a · (velocity of the centre on one link − on the other), shape (1, n)."""
        centre = transform(X_link, self.point)
        slip = compute_point_velocity(V_link, centre - X_link[:3, 3]) - compute_point_velocity(
            V_reference, centre - X_reference[:3, 3]
        )
        return (X_reference[:3, :3] @ self.axis)[None] @ slip


KIND = Encoder
