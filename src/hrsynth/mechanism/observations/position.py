"""A point with its depth, as from stereo or of a sphere of known radius: all of B.

reference –U̲(C)–P̲–S(B)– ℓ
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.jets import Jet
from ...geometry.screws import force
from ...geometry.vectors import Array, Numbers
from ..cameras import (
    FixedValueLocus,
    MetricPoint,
    ViewGeometry,
    VirtualJoint,
    draw_line_piece,
    make_plane_locus,
    make_ray_chain,
    normalise_rates,
)
from ..observation import Drawn


@dataclass(frozen=True, eq=False, repr=False)
class PointPosition(MetricPoint):
    """p, from C to B, in the camera's frame."""

    kind = "position"
    words = "the point B itself: a point with depth, stereo, a sphere of known radius"
    locked = "three forces at B"
    size = 3
    rank = 3

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return p

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return np.broadcast_to(np.eye(3), (*p.shape, 3)), None

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [a - b for a, b in zip(p, wanted.tolist(), strict=True)]

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return the ray, and a cross of the camera's axes at its end."""
        return Drawn((np.array([0 * p, p]), *(draw_line_piece(p, e, size / 4) for e in np.eye(3))))

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return [force(e, at.B) for e in np.eye(3, dtype=int).astype(at.B.dtype)]

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        return make_ray_chain(at, f"position {self.leg!r}", at.far, True, True)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (make_plane_locus(at.B, at.B, *np.eye(3)),)

    def pointing(self, values: Array) -> Array | None:
        return normalise_rates(values)[0]


KIND = PointPosition
