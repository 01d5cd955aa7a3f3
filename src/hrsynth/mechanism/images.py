"""Image features of a servo loop: coordinates x = X/Z, y = Y/Z of points, ρ and θ of lines, centre and second moments
of ellipses (Chaumette and Hutchinson, *Visual servo control I*, 2006; Espiau, Chaumette and Rives, 1992), each with its
derivative by the measured value; and noise of images.

The image plane is z = 1 of the camera's frame; noise is in units of it, or in radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.jets import Jet, turn
from ..geometry.screws import force, make_couple
from ..geometry.so3 import wrap_angle
from ..geometry.vectors import Array, Numbers, cross, normalise_vector
from .cameras import CameraObservation, FixedValueLocus, ViewGeometry, draw_line_piece, make_line_locus, make_line_plane
from .observation import Drawn

IMAGE_LINE_HALF_WIDTH_FRACTION = 1.0
"""Distance of the two points that define a line in the image, on each side of the one nearest to the image centre: at
the edges of an image of 90°."""
TURNS = 2 * np.pi * np.arange(5) / 5
"""Angles of the five points on an ellipse that define its conic."""


def project_point(u: Array) -> Array:
    """Return x = X/Z, y = Y/Z of rays u (…, 3)."""
    return np.asarray(u[..., :2] / u[..., 2:])


def derive_point_slope(u: Array) -> Array:
    """Return ∂(x, y)/∂u, (…, 2, 3)."""
    slope = np.zeros((*u.shape[:-1], 2, 3))
    slope[..., 0, 0] = slope[..., 1, 1] = 1 / u[..., 2]
    slope[..., 2] = -u[..., :2] / u[..., 2:] ** 2
    return slope


def project_line(n: Array) -> Array:
    """Return ρ, θ of the line x cos θ + y sin θ = ρ in the plane of normal n (…, 3) through C."""
    return np.stack([-n[..., 2] / np.hypot(n[..., 0], n[..., 1]), np.arctan2(n[..., 1], n[..., 0])], axis=-1)


def derive_line_slope(n: Array) -> Array:
    """Return ∂(ρ, θ)/∂n, (…, 2, 3)."""
    size = np.hypot(n[..., 0], n[..., 1])
    slope = np.zeros((*n.shape[:-1], 2, 3))
    slope[..., 0, :2] = n[..., 2:] * n[..., :2] / size[..., None] ** 3
    slope[..., 0, 2] = -1 / size
    slope[..., 1, 0], slope[..., 1, 1] = -n[..., 1] / size**2, n[..., 0] / size**2
    return slope


def compare_lines(n: Array, wanted: Array) -> Array:
    """Return the difference of ρ and θ, that of θ without full rotations."""
    found = project_line(n) - project_line(wanted)
    return np.array([found[0], wrap_angle(float(found[1]))])


def expand_line_error(n: Sequence[Jet], wanted: Array) -> list[Jet]:
    """Return the difference with derivatives, n of any length."""
    rho, theta = project_line(wanted).tolist()
    c, s = float(np.cos(theta)), float(np.sin(theta))
    size = (n[0] * n[0] + n[1] * n[1]).sqrt()
    return [n[2] / size * -1.0 - rho, turn(n[1] * c - n[0] * s, n[0] * c + n[1] * s)]


def project_ellipse(Q: Array) -> Array:
    """Return centre x, y and moments n₂₀, n₁₁, n₀₂ of the ellipse (x, y, 1) Q (x, y, 1)ᵀ = 0, Q (…, 3, 3) symmetric:
    second moments over the area, a quarter of k A⁻¹ for (x − c)ᵀ A (x − c) = k."""
    centre, spread, _, _ = _decompose_ellipse(Q)
    return np.concatenate([centre, spread[..., (0, 0, 1), (0, 1, 1)]], axis=-1)


def expand_ellipse_error(Q: Sequence[Sequence[Jet]], wanted: Array) -> list[Jet]:
    """Return their difference from those of a desired Q (3, 3), with derivatives."""
    (a, b, x), (_, c, y), (_, _, z) = Q
    size = a * c - b * b
    centre = [(b * y - c * x) / size, (b * x - a * y) / size]
    k = (x * centre[0] + y * centre[1] + z) / size * -0.25
    told = [*centre, k * c, k * b * -1.0, k * a]
    return [each - w for each, w in zip(told, project_ellipse(wanted).tolist(), strict=True)]


def derive_ellipse_slope(Q: Array, along: Array) -> Array:
    """Return the rates (…, 5) of these where Q changes at the rate ``along`` (…, 3, 3)."""
    centre, _, inverse, k = _decompose_ellipse(Q)
    A, b = along[..., :2, :2], along[..., :2, 2]
    moved = np.einsum("...ij,...j->...i", A, centre)
    shift = -np.einsum("...ij,...j->...i", inverse, moved + b)
    growth = -np.sum(centre * (moved + 2 * b), axis=-1) - along[..., 2, 2]
    spread = (growth[..., None, None] * inverse - k[..., None, None] * (inverse @ A @ inverse)) / 4
    return np.concatenate([shift, spread[..., (0, 0, 1), (0, 1, 1)]], axis=-1)


def _decompose_ellipse(Q: Array) -> tuple[Array, Array, Array, Array]:
    """Return centre (…, 2), moments (…, 2, 2), A⁻¹ and k."""
    inverse = np.asarray(np.linalg.inv(Q[..., :2, :2]), dtype=np.float64)
    b = Q[..., :2, 2]
    centre = np.asarray(-np.einsum("...ij,...j->...i", inverse, b))
    k = np.asarray(-np.sum(b * centre, axis=-1) - Q[..., 2, 2])
    return centre, np.asarray(k[..., None, None] * inverse / 4), inverse, k


def rotate_by_noise(u: Array, shock: Array, angle: float) -> Array:
    """Return a unit vector (3,) inside a cone of half-angle ``angle`` about u; the noise sample ``shock`` (3,) lies in
    the unit ball."""
    across = shock - (shock @ u) * u
    return normalise_vector(u + np.tan(angle) * across)


def shift_point(u: Array, shock: Array, by: float) -> Array:
    """Return the ray (3,) of an image point with an error of up to ``by``."""
    return normalise_vector([*(project_point(u) + by * shock[:2]), 1.0])


def shift_line(n: Array, shock: Array, by: float) -> Array:
    """Return the normal (3,) of a line in the image through two points with errors of up to ``by`` across it."""
    across = normalise_vector(n[:2])
    nearest, along = -n[2] / np.hypot(*n[:2]) * across, np.array([-across[1], across[0]])
    one, other = (
        np.array([*(nearest + side * IMAGE_LINE_HALF_WIDTH_FRACTION * along + by * error * across), 1.0])
        for side, error in ((-1, shock[0]), (1, shock[1]))
    )
    found = normalise_vector(cross(one, other))
    return found if found @ n > 0 else -found


def shift_ellipse(Q: Array, shocks: Array, by: float) -> Array:
    """Return the conic (3, 3), of unknown size, through five points of an ellipse with errors of up to ``by``;
    ``shocks`` (2, 3)."""
    centre, spread, _, _ = _decompose_ellipse(Q)
    points = centre + 2 * np.column_stack([np.cos(TURNS), np.sin(TURNS)]) @ np.linalg.cholesky(spread).T
    normals = (points - centre) @ np.linalg.inv(spread)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    x, y = (points + by * shocks.ravel()[:5, None] * normals).T
    a = np.linalg.svd(np.column_stack([x * x, y * y, np.ones(5), 2 * y, 2 * x, 2 * x * y]))[2][-1]
    found = np.array([[a[0], a[5], a[4]], [a[5], a[1], a[3]], [a[4], a[3], a[2]]])
    return np.asarray(found if np.sum(found * Q) > 0 else -found)


@dataclass(frozen=True, eq=False, repr=False)
class SeenLine(CameraObservation):
    """Measurement of the unit normal n of a plane through C that meets a straight line or a cylinder: a line in the
    image."""

    size = 3
    angular = True
    rank = 2
    found_by = frozenset({"px"})
    images_point = False

    def normal(self, at: ViewGeometry) -> Numbers:
        """Return the normal of the plane, of any length."""
        raise NotImplementedError

    @staticmethod
    def meet_plane(p: Array, d: Array, r: Array) -> Array:
        """Return a point of the line of direction d in which the plane meets the observed geometry."""
        raise NotImplementedError

    @classmethod
    def plane(cls, p: Array, d: Array, r: Array) -> Array | None:
        """Return the plane through that line, normal to the plane of C and it."""
        return make_line_plane(cls.meet_plane(p, d, r), d)

    @classmethod
    def outline(cls, p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return a segment of that line, and its plane with C."""
        piece = draw_line_piece(cls.meet_plane(p, d, np.array([r])), d, size)
        return Drawn((piece,), (np.vstack([0 * p, piece]),))

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        n = self.normal(at)
        return [force(n, at.B), make_couple(cross(at.d, n))]

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return make_line_locus(at, self.normal(at))

    def error(self, value: Array, wanted: Array) -> Array:
        return compare_lines(value, wanted)

    def error_slope(self, value: Array, wanted: Array) -> Array:
        return derive_line_slope(value)

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return the line through two image points near it."""
        return shift_line(value, shocks[0], self.pixels(noise))

    @classmethod
    def polylines(cls, p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return cls.outline(p, d, r, size).lines
