"""The distance of a point.

    reference –U(C)–P̲–S(B)– ℓ
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.screws import force
from ...geometry.vectors import Array, Numbers
from ..sights import CameraObservation, Sighting, VirtualJoint, apart, gimbal, normalised


@dataclass(frozen=True, eq=False, repr=False)
class PointDistance(CameraObservation):
    """‖p‖, p from C to B; its rate is u · ṗ."""

    kind = "distance"
    words = "‖CB‖"
    locked = "the force along CB"
    needs = ("at",)
    size = 1
    rank = 1
    dimension = 1

    @staticmethod
    def measured(p: Array, d: Array, r: Array) -> Array:
        return np.linalg.norm(p, axis=-1, keepdims=True)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return normalised(p)[0][..., None, :], None

    def wrenches(self, at: Sighting) -> list[Numbers]:
        return [force(at.B - at.C, at.B)]

    def chain(self, at: Sighting) -> tuple[VirtualJoint, ...]:
        apart(at, at.B, 0.0, f"distance {self.leg!r}", "a point outside of it")
        return gimbal(at.C, at.ray, None), VirtualJoint("P", at.C, (at.ray,), actuated=True), VirtualJoint("S", at.B)

    def pointing(self, values: Array) -> Array | None:
        return None


KIND = PointDistance
