"""A point in the image: the direction of the ray from C to B.

    reference –U̲(C)–P–S(B)– ℓ
"""

from __future__ import annotations

from dataclasses import dataclass

from ...geometry.screws import force, normals
from ...geometry.vectors import Array, Numbers
from ..sights import CameraObservation, Sighting, VirtualJoint, apart, gimbal, normalised


@dataclass(frozen=True, eq=False, repr=False)
class ImagePoint(CameraObservation):
    """u = p/‖p‖, p from C to B; u̇ = (I − u uᵀ) ṗ/‖p‖."""

    kind = "point"
    words = "the direction of the ray CB: a point in the image, a bearing"
    locked = "two forces at B, ⟂ CB"
    needs = ("at",)
    size = 3
    angular = True
    rank = 2

    @staticmethod
    def measured(p: Array, d: Array, r: Array) -> Array:
        return normalised(p)[0]

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return normalised(p)[1], None

    def wrenches(self, at: Sighting) -> list[Numbers]:
        return [force(n, at.B) for n in normals(at.B - at.C)]

    def chain(self, at: Sighting) -> tuple[VirtualJoint, ...]:
        apart(at, at.B, 0.0, f"point {self.leg!r}", "a point outside of it")
        return (gimbal(at.C, at.ray, at.far, actuated=True), VirtualJoint("P", at.C, (at.ray,)),
                VirtualJoint("S", at.B))


KIND = ImagePoint
