"""The inclination of a link, as an IMU at rest on it tells: the direction of the vertical, seen from the link.

link –P–P–P– T –U̲– W –R(d)– base        (as `direction`, the link is the reference; its yaw is never seen)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array
from ..observation import Drawn
from .direction import SeenAxis


@dataclass(frozen=True, eq=False, repr=False)
class Inclination(SeenAxis):
    """The unit vector R_ℓᵀ R_0 d: ``seen_from`` is the link ℓ with the IMU, ``link`` the base, d its vertical."""

    kind = "inclination"
    words = "the direction of the base's vertical in a link: a stationary IMU on it"
    needs = ("axis?",)

    @property
    def key(self) -> tuple[str, ...]:
        return (self.leg, str(self.seen_from), self.kind)

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        """The vertical, from the frame of the link with the IMU."""
        start = X_reference[:3, 3]
        return Drawn((np.array([start, start + size * X_link[:3, :3] @ self.direction]),))


KIND = Inclination
