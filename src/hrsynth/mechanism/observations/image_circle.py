"""A circle of known radius in the image: its conic.

reference –U̲(C)–P̲–U̲(B)–R(d)– ℓ        as for a circle, where C is not on its axis
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import BadMechanism
from ...geometry import components
from ...geometry.jets import Jet
from ...geometry.vectors import Array, Numbers, dot
from ..cameras import CIRCLE_POLYGON_SIDES_COUNT, CameraObservation, ViewGeometry, VirtualJoint, draw_circle
from ..images import derive_ellipse_slope, expand_ellipse_error, project_ellipse, shift_ellipse
from ..observation import Drawn
from .circle import make_circle_chain, make_circle_wrenches

ROWS, COLUMNS = np.array([0, 1, 2, 1, 2, 2]), np.array([0, 1, 2, 0, 0, 1])
WEIGHTS = np.sqrt([1.0, 1, 1, 2, 2, 2])


def compute_cone_matrix(p: Array, d: Array, r: Array) -> Array:
    """Return the symmetric matrix (…, 3, 3) of the cone from C over the circle: (p·d)² I − (p·d)(p dᵀ + d pᵀ) + (p·p −
    r²) d dᵀ."""
    h = dot(p, d)[..., None, None]
    return np.asarray(
        h**2 * np.eye(3)
        - h * _add_transposed_product(p, d)
        + (dot(p, p)[..., None] - r**2)[..., None] * _add_transposed_product(d, d) / 2
    )


def _add_transposed_product(a: Array, b: Array) -> Array:
    """Return a bᵀ + b aᵀ."""
    product = a[..., :, None] * b[..., None, :]
    return np.asarray(product + np.swapaxes(product, -1, -2))


def _list_entries(Q: Array) -> Array:
    """Return the six entries of symmetric matrices, their norm that of the matrix."""
    return np.asarray(Q[..., ROWS, COLUMNS] * WEIGHTS)


def _build_matrix(entries: Array) -> Array:
    """Return the symmetric matrices of such entries."""
    Q = np.zeros((*entries.shape[:-1], 3, 3))
    Q[..., ROWS, COLUMNS] = Q[..., COLUMNS, ROWS] = entries / WEIGHTS
    return Q


@dataclass(frozen=True, eq=False, repr=False)
class ImageCircle(CameraObservation):
    """Cone of rays to the circle (centre B, normal d), a symmetric matrix of norm 1, p from C to B.

    Five numbers, but three if C is on the circle's axis, and two in its plane (a double line).
    """

    kind = "image_circle"
    words = "a circle of known radius in the image: its conic"
    locked = "as `circle`; two less if C is on its axis, three less in its plane"
    needs = ("at", "axis", "radius")
    size = 6
    rank = 5
    whole = False
    feature_error = "centre and second moments of the ellipse"
    found_by = frozenset({"px"})

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        entries = _list_entries(compute_cone_matrix(p, d, r))
        return np.asarray(entries / np.linalg.norm(entries, axis=-1, keepdims=True))

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        h, size = dot(p, d)[..., None, None], (dot(p, p)[..., None] - r**2)[..., None]
        entries = _list_entries(compute_cone_matrix(p, d, r))
        norm = np.linalg.norm(entries, axis=-1)[..., None, None]
        q = entries[..., None] / norm

        def rates(other: Array, own: Array, rest: Array) -> Array:
            """Return the derivatives by one of p and d, ``other`` being the second; ``rest`` is that of (p·p − r²) d
            dᵀ."""
            columns = []
            for k, e in enumerate(np.eye(3)):
                turned = other[..., k, None, None]
                columns.append(
                    _list_entries(
                        2 * h * turned * np.eye(3)
                        - turned * _add_transposed_product(p, d)
                        - h * _add_transposed_product(e, other)
                        + (own[..., k, None, None] * rest if own is p else size * _add_transposed_product(e, d))
                    )
                )
            J = np.stack(columns, axis=-1)
            return np.asarray((J - q @ (np.swapaxes(q, -1, -2) @ J)) / norm)

        return rates(d, p, _add_transposed_product(d, d)), rates(p, d, _add_transposed_product(d, d))

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        h, rest = components.dot(p, d), components.dot(p, p) - r * r
        Q = [
            [rest * d[i] * d[k] - h * (p[i] * d[k] + p[k] * d[i]) + (h * h if i == k else 0.0) for k in range(3)]
            for i in range(3)
        ]
        return expand_ellipse_error(Q, _build_matrix(wanted))

    def error(self, value: Array, wanted: Array) -> Array:
        return project_ellipse(_build_matrix(value)) - project_ellipse(_build_matrix(wanted))

    def error_slope(self, value: Array, wanted: Array) -> Array:
        Q = _build_matrix(value)
        return np.stack(
            [derive_ellipse_slope(Q, np.broadcast_to(_build_matrix(e), Q.shape)) for e in np.eye(6)], axis=-1
        )

    def in_front(self, X_reference: Array, X_link: Array) -> float:
        """Return that of its point with the smallest depth, over the distance of the centre."""
        at = self.sighting(X_reference, X_link)
        reach = abs(self.radius or 0.0) * np.sqrt(max(0.0, 1 - float(at.z @ at.d) ** 2))
        return self.ahead(X_reference, X_link) - float(reach / np.linalg.norm(at.B - at.C))

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return the ellipse through five image points near it."""
        entries = _list_entries(shift_ellipse(_build_matrix(value), shocks, self.pixels(noise)))
        return np.asarray(entries / np.linalg.norm(entries))

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return the circle, and eight rays to it."""
        around = draw_circle(p, d, r)
        return Drawn((around, *(np.array([0 * p, each]) for each in around[: -1 : CIRCLE_POLYGON_SIDES_COUNT // 8])))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return (draw_circle(p, d, r),)

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return make_circle_wrenches(at)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        if not abs(self.radius or 0.0) > 0:
            raise BadMechanism(f"image_circle {self.leg!r}: radius (m)", self.radius, "more than 0")
        return make_circle_chain(at, self.leg)

    def pointing(self, values: Array) -> Array | None:
        return None


KIND = ImageCircle
