"""One edge of a cylinder in the image: the plane through C that touches it.

reference –U̲(C)–R(n)–P–C(d)– ℓ        as for a line in the image, the axis at the radius from the plane
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import UndefinedValue
from ...geometry import components
from ...geometry.jets import Jet
from ...geometry.vectors import Array, Numbers, cross, normalise_vector
from ..cameras import (
    ViewGeometry,
    VirtualJoint,
    find_nearest_on_line,
    make_line_chain,
    normalise_rates,
    require_distance,
)
from ..images import SeenLine, expand_line_error


def compute_edge_tangent(p: Array, d: Array, r: Array) -> Array:
    """Return n with n · d = 0, n · p = r, ‖n‖ = 1: the plane of normal n through C touches the cylinder; of the two the
    one with n · (d × p) > 0. A negative r gives (with −n) the other plane. Raises ``UndefinedValue`` if C is inside."""
    f = p - np.sum(p * d, axis=-1, keepdims=True) * d
    D = np.linalg.norm(f, axis=-1, keepdims=True)
    if not np.all(np.abs(r) < D):
        raise UndefinedValue(
            "an edge of a cylinder: distance of its axis from the camera centre (m)",
            float(D.min()),
            f"more than its radius {float(np.abs(r).max()):g}",
        )
    return np.asarray((r / D) * f / D + np.sqrt(1 - (r / D) ** 2) * cross(d, f / D))


def expand_edge_tangent(p: Sequence[Jet], d: Sequence[Jet], r: Jet) -> list[Jet]:
    """Return the normal, of any length, with derivatives."""
    along = components.dot(p, d)
    foot = [a - along * b for a, b in zip(p, d, strict=True)]
    high = (components.dot(foot, foot) - r * r).sqrt()
    return [r * f + high * m * -1.0 for f, m in zip(foot, components.cross(p, d), strict=True)]


def derive_edge_tangent(p: Array, d: Array, r: Array) -> tuple[Array, Array]:
    """Return ∂n/∂p and ∂n/∂d, (…, 3, 3): ṅ · d = −n · ḋ, ṅ · p = −n · ṗ, ṅ · n = 0."""
    n = compute_edge_tangent(p, d, r)
    solved = np.linalg.inv(np.stack(np.broadcast_arrays(d, p, n), axis=-2))
    return -solved[..., 1:2] * n[..., None, :], -solved[..., 0:1] * n[..., None, :]


@dataclass(frozen=True, eq=False, repr=False)
class CylinderEdge(SeenLine):
    """Normal n of a plane through C that touches the cylinder of axis (B, d); the sign of ``radius`` selects one of the
    two (MMT eq. 3-4)."""

    kind = "edge"
    words = "an edge of a cylinder of known radius: its tangent plane through C"
    locked = "the force n at the axis, the moment d × n"
    needs = ("at", "axis", "radius")
    feature_error = "ρ − ρ*, θ − θ*"
    rational = False
    signed = True

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return compute_edge_tangent(p, d, r)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return derive_edge_tangent(p, d, r)

    def normal(self, at: ViewGeometry) -> Numbers:
        return compute_edge_tangent(at.B - at.C, at.d, np.array([self.radius]))

    @staticmethod
    def meet_plane(p: Array, d: Array, r: Array) -> Array:
        return p - r * compute_edge_tangent(p, d, r)

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """Return the axis of the cylinder that is touched where the plane of the edge meets that of g."""
        n = compute_edge_tangent(p, d, r)
        foot = find_nearest_on_line(n, g)
        return foot + r * n, normalise_rates(cross(foot, n))[0]

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return expand_line_error(expand_edge_tangent(p, d, r), wanted)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        radius = self.radius or 0.0
        require_distance(at, at.foot, abs(radius), f"edge {self.leg!r}", f"more than the radius {abs(radius):g}")
        n = self.normal(at)
        return make_line_chain(at, n, normalise_vector(at.foot - at.C - radius * n), 1)


KIND = CylinderEdge
