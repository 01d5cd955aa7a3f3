"""Both edges of a cylinder of known radius: all of its axis.

reference –U̲(C)–R̲(n)–P̲–C(d)– ℓ        as for a line in space
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.jets import Jet
from ...geometry.vectors import Array, Numbers
from ..cameras import CameraObservation, FixedValueLocus, ViewGeometry, VirtualJoint, normalise_rates, require_distance
from ..images import compare_lines, derive_line_slope, expand_line_error, shift_line
from ..observation import Drawn
from .edge import CylinderEdge, compute_edge_tangent, derive_edge_tangent, expand_edge_tangent
from .line import SpaceLine, make_line_loci, make_line_sensor_chain, make_line_wrenches


@dataclass(frozen=True, eq=False, repr=False)
class CylinderEdges(CameraObservation):
    """(n₁, n₂), the normals of both planes through C touching the cylinder of axis (B, d): d ∥ n₁ × n₂ (MMT eq. 5)."""

    kind = "edges"
    words = "both edges of a cylinder of known radius"
    locked = SpaceLine.locked
    needs = ("at", "axis", "radius")
    size = 6
    rank = 4
    feature_error = "ρ − ρ*, θ − θ* of both"
    found_by = frozenset({"px"})
    images_point = False

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return np.concatenate([compute_edge_tangent(p, d, r), compute_edge_tangent(p, d, -r)], axis=-1)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        one, other = derive_edge_tangent(p, d, r), derive_edge_tangent(p, d, -r)
        return np.concatenate([one[0], other[0]], axis=-2), np.concatenate([one[1], other[1]], axis=-2)

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [
            *expand_line_error(expand_edge_tangent(p, d, r), wanted[:3]),
            *expand_line_error(expand_edge_tangent(p, d, r * -1.0), wanted[3:]),
        ]

    def error(self, value: Array, wanted: Array) -> Array:
        pairs = ((value[..., rows], wanted[..., rows]) for rows in (slice(3), slice(3, 6)))
        return np.concatenate([compare_lines(*pair) for pair in pairs], axis=-1)

    def error_slope(self, value: Array, wanted: Array) -> Array:
        slope = np.zeros((*value.shape[:-1], 4, 6))
        slope[..., :2, :3], slope[..., 2:, 3:] = derive_line_slope(value[..., :3]), derive_line_slope(value[..., 3:])
        return slope

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return each edge through two image points near it."""
        by = self.pixels(noise)
        return np.concatenate(
            [shift_line(n, shock, by) for n, shock in zip((value[:3], value[3:]), shocks, strict=True)]
        )

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return both tangent planes."""
        both = [CylinderEdge.outline(p, d, sign * r, size) for sign in (1, -1)]
        return Drawn(both[0].lines + both[1].lines, both[0].areas + both[1].areas)

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return CylinderEdges.outline(p, d, r, size).lines

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return make_line_wrenches(at)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        radius = abs(self.radius or 0.0)
        require_distance(at, at.foot, radius, f"edges {self.leg!r}", f"more than the radius {radius:g}")
        return make_line_sensor_chain(at)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return make_line_loci(at)

    def pointing(self, values: Array) -> Array | None:
        return normalise_rates(values[:, :3] + values[:, 3:])[0]


KIND = CylinderEdges
