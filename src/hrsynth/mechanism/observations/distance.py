"""The distance of a point.

reference –U(C)–P̲–S(B)– ℓ
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry import components
from ...geometry.jets import Jet
from ...geometry.screws import find_normals, force
from ...geometry.vectors import Array, Numbers, normalise_vector
from ..cameras import (
    FixedValueLocus,
    MetricPoint,
    ViewGeometry,
    VirtualJoint,
    draw_circle,
    make_ray_chain,
    normalise_rates,
)
from ..observation import Drawn


@dataclass(frozen=True, eq=False, repr=False)
class PointDistance(MetricPoint):
    """‖p‖, p from C to B; its rate is u · ṗ."""

    kind = "distance"
    words = "‖CB‖"
    locked = "the force along CB"
    size = 1
    rank = 1
    images_point = False

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return np.linalg.norm(p, axis=-1, keepdims=True)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return normalise_rates(p)[0][..., None, :], None

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [components.dot(p, p).sqrt() - float(wanted[0])]

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return the ray, and arcs of the sphere at its end."""
        arcs = (
            draw_circle(0 * p, normalise_vector(across), float(np.linalg.norm(p)))
            for across in find_normals(normalise_vector(p))
        )
        near = (arc[arc @ normalise_vector(p) > np.cos(0.2) * np.linalg.norm(p)] for arc in arcs)
        return Drawn((np.array([0 * p, p]), *(np.array(sorted(arc, key=tuple)) for arc in near if len(arc) > 1)))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return ()

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return [force(at.B - at.C, at.B)]

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        return make_ray_chain(at, f"distance {self.leg!r}", None, False, True)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (FixedValueLocus(at.B, np.zeros((0, 3)), at.C, float(np.linalg.norm(at.B - at.C))),)

    def pointing(self, values: Array) -> Array | None:
        return None


KIND = PointDistance
