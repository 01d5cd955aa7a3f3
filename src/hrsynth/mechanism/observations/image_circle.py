"""A circle of known radius in the image: its conic.

    reference –U̲(C)–P̲–U̲(B)–R(d)– ℓ        as for a circle, where C is not on its axis
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import BadMechanism
from ...geometry.vectors import Array, Numbers, dot
from ..sights import CameraObservation, Sighting, VirtualJoint
from .circle import circle_chain, circle_wrenches

ROWS, COLUMNS = np.array([0, 1, 2, 1, 2, 2]), np.array([0, 1, 2, 0, 0, 1])
WEIGHTS = np.sqrt([1.0, 1, 1, 2, 2, 2])


def cone(p: Array, d: Array, r: Array) -> Array:
    """The symmetric matrix (…, 3, 3) of the cone from C over the circle: (p·d)² I − (p·d)(p dᵀ + d pᵀ) +
    (p·p − r²) d dᵀ."""
    h = dot(p, d)[..., None, None]
    return np.asarray(h**2 * np.eye(3) - h * _both(p, d) + (dot(p, p)[..., None] - r**2)[..., None] * _both(d, d) / 2)


def _both(a: Array, b: Array) -> Array:
    """a bᵀ + b aᵀ."""
    product = a[..., :, None] * b[..., None, :]
    return np.asarray(product + np.swapaxes(product, -1, -2))


def _listed(Q: Array) -> Array:
    """The six entries of symmetric matrices, their norm that of the matrix."""
    return np.asarray(Q[..., ROWS, COLUMNS] * WEIGHTS)


@dataclass(frozen=True, eq=False, repr=False)
class ImageCircle(CameraObservation):
    """The cone of rays to the circle (centre B, normal d), a symmetric matrix of norm 1, p from C to B.

    Five numbers, but three where C lies on the circle's axis, and two in its plane (a double line).
    """

    kind = "image_circle"
    words = "a circle of known radius in the image: its conic"
    locked = "as `circle`; two less where C is on its axis, three in its plane"
    needs = ("at", "axis", "radius")
    size = 6
    rank = 5

    @staticmethod
    def measured(p: Array, d: Array, r: Array) -> Array:
        entries = _listed(cone(p, d, r))
        return np.asarray(entries / np.linalg.norm(entries, axis=-1, keepdims=True))

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        h, size, entries = dot(p, d)[..., None, None], (dot(p, p)[..., None] - r**2)[..., None], _listed(cone(p, d, r))
        norm = np.linalg.norm(entries, axis=-1)[..., None, None]
        q = entries[..., None] / norm

        def rates(other: Array, own: Array, rest: Array) -> Array:
            """The derivatives by one of p and d, ``other`` being the second; ``rest`` is that of (p·p − r²) d dᵀ."""
            columns = []
            for k, e in enumerate(np.eye(3)):
                turned = other[..., k, None, None]
                columns.append(_listed(2 * h * turned * np.eye(3) - turned * _both(p, d) - h * _both(e, other)
                                       + (own[..., k, None, None] * rest if own is p else size * _both(e, d))))
            J = np.stack(columns, axis=-1)
            return np.asarray((J - q @ (np.swapaxes(q, -1, -2) @ J)) / norm)

        return rates(d, p, _both(d, d)), rates(p, d, _both(d, d))

    def wrenches(self, at: Sighting) -> list[Numbers]:
        return circle_wrenches(at)

    def chain(self, at: Sighting) -> tuple[VirtualJoint, ...]:
        if not abs(self.radius or 0.0) > 0:
            raise BadMechanism(f"image_circle {self.leg!r}: radius (m)", self.radius, "more than 0")
        return circle_chain(at, self.leg)

    def pointing(self, values: Array) -> Array | None:
        return None


KIND = ImageCircle
