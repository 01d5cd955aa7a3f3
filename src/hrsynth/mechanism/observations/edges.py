"""Both edges of a cylinder of known radius: all of its axis.

    reference –U̲(C)–R̲(n)–P̲–C(d)– ℓ        as for a line in space
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array, Numbers
from ..sights import CameraObservation, Sighting, VirtualJoint, apart, normalised
from .edge import tangent, tangent_partials
from .line import SpaceLine, line_chain, line_wrenches


@dataclass(frozen=True, eq=False, repr=False)
class CylinderEdges(CameraObservation):
    """(n₁, n₂), the normals of both planes through C that touch the cylinder of axis (B, d): d ∥ n₁ × n₂ (MMT eq. 5).
    """

    kind = "edges"
    words = "both edges of a cylinder of known radius"
    locked = SpaceLine.locked
    needs = ("at", "axis", "radius")
    size = 6
    rank = 4

    @staticmethod
    def measured(p: Array, d: Array, r: Array) -> Array:
        return np.concatenate([tangent(p, d, r), tangent(p, d, -r)], axis=-1)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        one, other = tangent_partials(p, d, r), tangent_partials(p, d, -r)
        return np.concatenate([one[0], other[0]], axis=-2), np.concatenate([one[1], other[1]], axis=-2)

    def wrenches(self, at: Sighting) -> list[Numbers]:
        return line_wrenches(at)

    def chain(self, at: Sighting) -> tuple[VirtualJoint, ...]:
        radius = abs(self.radius or 0.0)
        apart(at, at.foot, radius, f"edges {self.leg!r}", f"more than the radius {radius:g}")
        return line_chain(at)

    def pointing(self, values: Array) -> Array | None:
        return normalised(values[:, :3] + values[:, 3:])[0]


KIND = CylinderEdges
