"""The depth of a point: its coordinate along the camera's z axis.

reference –P̲(z)–PP–S(B)– ℓ
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.jets import Jet
from ...geometry.screws import force
from ...geometry.vectors import Array, Numbers, build_plane_axes
from ..cameras import FixedValueLocus, MetricPoint, ViewGeometry, VirtualJoint, make_plane_locus
from ..observation import Drawn


@dataclass(frozen=True, eq=False, repr=False)
class PointDepth(MetricPoint):
    """z · p, p from C to B."""

    kind = "depth"
    words = "the z-coordinate of B in the camera's frame"
    locked = "the force along z at B"
    size = 1
    rank = 1
    along_z = True

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return p[..., 2:]

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return np.broadcast_to(np.eye(3)[2:], (*p.shape[:-1], 1, 3)), None

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [p[2] - float(wanted[0])]

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return a line along the camera's z axis, then across to the point."""
        foot = np.array([0, 0, p[2]])
        return Drawn((np.array([0 * p, foot, p]),))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return ()

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return [force(at.z, at.B)]

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        aside = (VirtualJoint("P", at.B, (axis,)) for axis in build_plane_axes(at.z))
        return VirtualJoint("P", at.B, (at.z,), actuated=True), *aside, VirtualJoint("S", at.B)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (make_plane_locus(at.B, at.B, at.z),)

    def pointing(self, values: Array) -> Array | None:
        return None


KIND = PointDepth
