"""A line in space: its direction and its position.

reference –U̲(C)–R̲(n)–P̲–C(d)– ℓ        where it meets C: –P̲–P̲–U̲–C(d)–
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry import components
from ...geometry.jets import Jet
from ...geometry.screws import find_normals, force, make_couple
from ...geometry.vectors import Array, Numbers, build_plane_axes, cross, freeze_array, hat, normalise_vector
from ..cameras import (
    CameraObservation,
    FixedValueLocus,
    ViewGeometry,
    VirtualJoint,
    draw_line_piece,
    make_angle_locus,
    make_line_chain,
    make_plane_locus,
    make_universal,
    normalise_rates,
)
from ..images import rotate_by_noise
from ..observation import Drawn

LINE_CENTRE_DISTANCE_TOL = 1e-3
"""Distance (m) up to which an observed line counts as passing through the camera centre."""


def make_line_sensor_chain(at: ViewGeometry) -> tuple[VirtualJoint, ...]:
    """Return U̲R̲P̲-C; if the line meets C, P̲P̲-U̲-C at its point in a fixed plane."""
    away = at.foot - at.C
    if np.linalg.norm(away) > LINE_CENTRE_DISTANCE_TOL:
        return make_line_chain(at, np.cross(normalise_vector(away), at.d), normalise_vector(away), 3)
    return (
        *(VirtualJoint("P", at.B, (axis,), True) for axis in build_plane_axes(at.d)),
        make_universal(at.B, at.d, None, actuated=True),
        VirtualJoint("C", at.B, (at.d,)),
    )


@dataclass(frozen=True, eq=False, repr=False)
class SpaceLine(CameraObservation):
    """(d, h), h = p × d the moment of the line (B, d) about C (its Plücker coordinates; MMT 5.3), p from C to B.

    h replaces the unit normal of the plane of C and the line, which does not exist if the line meets C.
    """

    kind = "line"
    words = "a line in space: its direction and its position (Plücker coordinates)"
    locked = "two forces ⟂ d at the line, two moments ⟂ d"
    needs = ("at", "axis")
    size = 6
    rank = 4
    images_point = False
    dimension = freeze_array([0, 0, 0, 1, 1, 1])
    feature_error = "y − y*: of the direction, of the moment"
    found_by = frozenset({"m", "rad"})

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return np.concatenate([d, cross(p, d)], axis=-1)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        one = np.broadcast_to(np.eye(3), (*d.shape, 3))
        return np.concatenate([0 * one, -hat(d)], axis=-2), np.concatenate([one, hat(p)], axis=-2)

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [a - b for a, b in zip([*d, *components.cross(p, d)], wanted.tolist(), strict=True)]

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return its point nearest to C with an error, its direction in a cone."""
        d, h = value[:3], value[3:]
        turned = rotate_by_noise(d, shocks[1], noise.get("rad", 0.0))
        return np.concatenate([turned, cross(cross(d, h) + noise.get("m", 0.0) * shocks[0], turned)])

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return a segment of the line, and the perpendicular to it from C."""
        return Drawn((draw_line_piece(p, d, size), np.array([0 * p, p - (p @ d) * d])))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return (draw_line_piece(p, d, size),)

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return make_line_wrenches(at)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        return make_line_sensor_chain(at)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return make_line_loci(at)

    def pointing(self, values: Array) -> Array | None:
        sizes = np.linalg.norm(values[:, 3:], axis=1)
        return normalise_rates(values[:, 3:])[0] if sizes.min() > LINE_CENTRE_DISTANCE_TOL else None


def make_line_loci(at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
    """Return a point on the line, and its direction."""
    return make_plane_locus(at.B, at.B, *find_normals(at.d)), make_angle_locus(at.d, *find_normals(at.d))


def make_line_wrenches(at: ViewGeometry) -> list[Numbers]:
    """Return two forces and two moments normal to d, at the line."""
    return [wrench for n in find_normals(at.d) for wrench in (force(n, at.B), make_couple(n))]


KIND = SpaceLine
