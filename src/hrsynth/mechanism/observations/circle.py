"""A circle in space, as from stereo: its centre and its normal.

reference –U̲(C)–P̲–U̲(B)–R(d)– ℓ
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.jets import Jet
from ...geometry.screws import find_normals, force, make_couple
from ...geometry.vectors import Array, Numbers, freeze_array
from ..cameras import (
    CameraObservation,
    FixedValueLocus,
    ViewGeometry,
    VirtualJoint,
    draw_circle,
    make_angle_locus,
    make_plane_locus,
    make_universal,
    normalise_rates,
    require_distance,
)
from ..images import rotate_by_noise
from ..observation import Drawn


def make_circle_chain(at: ViewGeometry, leg: str) -> tuple[VirtualJoint, ...]:
    """Return U̲P̲-U̲-R: five motors, R about the normal."""
    require_distance(at, at.B, 0.0, f"circle {leg!r}", "a centre outside of it")
    return (
        make_universal(at.C, at.ray, at.far, actuated=True),
        VirtualJoint("P", at.C, (at.ray,), True),
        make_universal(at.B, at.d, None, actuated=True),
        VirtualJoint("R", at.B, (at.d,)),
    )


def make_circle_wrenches(at: ViewGeometry) -> list[Numbers]:
    """Return three forces at the centre, two moments normal to d."""
    return [force(e, at.B) for e in np.eye(3, dtype=int).astype(at.B.dtype)] + [
        make_couple(n) for n in find_normals(at.d)
    ]


@dataclass(frozen=True, eq=False, repr=False)
class SpaceCircle(CameraObservation):
    """(p, d), p from C to the centre B, d the normal."""

    kind = "circle"
    words = "a circle: its centre B and its normal d"
    locked = "three forces at the centre, two moments ⟂ the normal"
    needs = ("at", "axis")
    size = 6
    rank = 5
    dimension = freeze_array([1, 1, 1, 0, 0, 0])
    feature_error = "y − y*: of the centre, of the normal"
    found_by = frozenset({"m", "rad"})

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return np.concatenate([p, d], axis=-1)

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        one = np.broadcast_to(np.eye(3), (*p.shape, 3))
        return np.concatenate([one, 0 * one], axis=-2), np.concatenate([0 * one, one], axis=-2)

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return [a - b for a, b in zip([*p, *d], wanted.tolist(), strict=True)]

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return the centre with an error, the normal in a cone."""
        return np.concatenate(
            [value[:3] + noise.get("m", 0.0) * shocks[0], rotate_by_noise(value[3:], shocks[1], noise.get("rad", 0.0))]
        )

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return the ray to its centre, a circle about it and its normal."""
        return Drawn((np.array([0 * p, p]), draw_circle(p, d, size / 2), np.array([p, p + size / 2 * d])))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        return (draw_circle(p, d, size / 2),)

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        return make_circle_wrenches(at)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        return make_circle_chain(at, self.leg)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (make_plane_locus(at.B, at.B, *np.eye(3)), make_angle_locus(at.d, *find_normals(at.d)))

    def pointing(self, values: Array) -> Array | None:
        return normalise_rates(values[:, :3])[0]


KIND = SpaceCircle
