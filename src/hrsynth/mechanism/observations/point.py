"""A point in the image: the direction of the ray from C to B.

reference –U̲(C)–P–S(B)– ℓ
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...geometry.jets import Jet
from ...geometry.screws import find_normals, force
from ...geometry.vectors import Array, Numbers, dot
from ..cameras import (
    CameraObservation,
    FixedValueLocus,
    ViewGeometry,
    VirtualJoint,
    make_depth_plane,
    make_plane_locus,
    make_ray_chain,
    normalise_rates,
)
from ..images import derive_point_slope, project_point, rotate_by_noise, shift_point


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
    feature_error = "x − x*, y − y*; x = X/Z, y = Y/Z"
    found_by = frozenset({"px", "rad"})

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return normalise_rates(p)[0]

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return normalise_rates(p)[1], None

    @staticmethod
    def plane(p: Array, d: Array, r: Array) -> Array | None:
        """Return z = Z, parallel to the image plane."""
        return make_depth_plane(p[..., 2:])

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """Return the intersection of the ray with the plane."""
        return p / dot(g, p)[..., None], d

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        x, y = project_point(wanted).tolist()
        return [p[0] / p[2] - x, p[1] / p[2] - y]

    def error(self, value: Array, wanted: Array) -> Array:
        return project_point(value) - project_point(wanted)

    def error_slope(self, value: Array, wanted: Array) -> Array:
        return derive_point_slope(value)

    def in_front(self, X_reference: Array, X_link: Array) -> float:
        return self.ahead(X_reference, X_link)

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return the image point with an error, or the ray in a cone."""
        if "px" in noise:
            return shift_point(value, shocks[0], self.pixels(noise))
        return rotate_by_noise(value, shocks[0], noise["rad"])

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return [force(n, at.B) for n in find_normals(at.B - at.C)]

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        return make_ray_chain(at, f"point {self.leg!r}", at.far, True, False)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (make_plane_locus(at.B, at.C, *find_normals(at.ray)),)


KIND = ImagePoint
