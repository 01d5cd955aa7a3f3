"""A line in the image: the plane of C and the line.

reference –U̲(C)–R(n)–P–C(d)– ℓ        U̲ turns the plane, R and P move in it, the line is the axis of C
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry import components
from ...geometry.jets import Jet
from ...geometry.vectors import Array, Numbers, cross, hat, normalise_vector
from ..cameras import (
    ViewGeometry,
    VirtualJoint,
    find_nearest_on_line,
    make_line_chain,
    normalise_rates,
    require_distance,
)
from ..images import SeenLine, expand_line_error


@dataclass(frozen=True, eq=False, repr=False)
class ImageLine(SeenLine):
    """n = p × d/‖p × d‖, the normal of the plane of C and the line (B, d), p from C to B."""

    kind = "image_line"
    words = "the plane of C and a line: a line in the image"
    locked = "the force n at the line, the moment d × n"
    needs = ("at", "axis")
    feature_error = "ρ − ρ*, θ − θ*; x cos θ + y sin θ = ρ"

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        return normalise_rates(cross(p, d))[0]

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        turned = normalise_rates(cross(p, d))[1]
        return -turned @ hat(d), turned @ hat(p)

    def normal(self, at: ViewGeometry) -> Numbers:
        return cross(at.B - at.C, at.d)

    @staticmethod
    def meet_plane(p: Array, d: Array, r: Array) -> Array:
        return p

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """Return the line in which the plane of C and the line meets that of g."""
        n = normalise_rates(cross(p, d))[0]
        foot = find_nearest_on_line(n, g)
        return foot, normalise_rates(cross(n, foot))[0]

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        return expand_line_error(components.cross(p, d), wanted)

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        require_distance(at, at.foot, 0.0, f"image_line {self.leg!r}", "a line that does not meet it")
        out = normalise_vector(at.foot - at.C)
        return make_line_chain(at, np.cross(out, at.d), out, 1)


KIND = ImageLine
