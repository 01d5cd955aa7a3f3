"""A line in the image: the plane of C and the line.

    reference –U̲(C)–R(n)–P–C(d)– ℓ        U̲ turns the plane, R and P move in it, the line is the axis of C
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.screws import couple, force
from ...geometry.vectors import Array, Numbers, cross, hat, unit
from ..sights import CameraObservation, Sighting, VirtualJoint, across, apart, normalised


@dataclass(frozen=True, eq=False, repr=False)
class ImageLine(CameraObservation):
    """n = p × d/‖p × d‖, the normal of the plane of C and the line (B, d), p from C to B."""

    kind = "image_line"
    words = "the plane of C and a line: a line in the image"
    locked = "the force n at the line, the moment d × n"
    needs = ("at", "axis")
    size = 3
    angular = True
    rank = 2

    @staticmethod
    def measured(p: Array, d: Array, r: Array) -> Array:
        return normalised(cross(p, d))[0]

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        turned = normalised(cross(p, d))[1]
        return -turned @ hat(d), turned @ hat(p)

    def wrenches(self, at: Sighting) -> list[Numbers]:
        n = cross(at.B - at.C, at.d)
        return [force(n, at.B), couple(cross(at.d, n))]

    def chain(self, at: Sighting) -> tuple[VirtualJoint, ...]:
        apart(at, at.foot, 0.0, f"image_line {self.leg!r}", "a line that does not meet it")
        out = unit(at.foot - at.C)
        return across(at, np.cross(out, at.d), out, 1)


KIND = ImageLine
