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
from ...geometry.vectors import Array, Numbers, cross, unit
from ..cameras import ViewGeometry, VirtualJoint, across, apart, normalise_rates, on_plane
from ..images import SeenLine, line_fed


def tangent(p: Array, d: Array, r: Array) -> Array:
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


def touching(p: Sequence[Jet], d: Sequence[Jet], r: Jet) -> list[Jet]:
    """Return the normal, of any length, with derivatives."""
    along = components.dot(p, d)
    foot = [a - along * b for a, b in zip(p, d, strict=True)]
    high = (components.dot(foot, foot) - r * r).sqrt()
    return [r * f + high * m * -1.0 for f, m in zip(foot, components.cross(p, d), strict=True)]


def tangent_partials(p: Array, d: Array, r: Array) -> tuple[Array, Array]:
    """Return ∂n/∂p and ∂n/∂d, (…, 3, 3): ṅ · d = −n · ḋ, ṅ · p = −n · ṗ, ṅ · n = 0."""
    n = tangent(p, d, r)
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
        return tangent(p, d, r)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        return tangent_partials(p, d, r)

    def normal(self, at: ViewGeometry) -> Numbers:
        return tangent(at.B - at.C, at.d, np.array([self.radius]))

    @staticmethod
    def meet_plane(p: Array, d: Array, r: Array) -> Array:
        return p - r * tangent(p, d, r)

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """Return the axis of the cylinder that is touched where the plane of the edge meets that of g."""
        n = tangent(p, d, r)
        foot = on_plane(n, g)
        return foot + r * n, normalise_rates(cross(foot, n))[0]

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return line_fed(touching(p, d, r), wanted)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        radius = self.radius or 0.0
        apart(at, at.foot, abs(radius), f"edge {self.leg!r}", f"more than the radius {abs(radius):g}")
        n = self.normal(at)
        return across(at, n, unit(at.foot - at.C - radius * n), 1)


KIND = CylinderEdge
