"""Ways from one working mode of a leg to the other: out to where its rod and its crank or rail are at their limit, and
back to the same pose; there the leg leads and the platform follows without turning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.balls import Field, widened
from ...geometry.vectors import Array, cross
from ...tolerances import FOLLOWED
from .carriage import Carriage, Place, Rigid
from .limbs import Limb, OnCrank, OnRail


@dataclass(frozen=True, eq=False)
class Turning:
    """A vector that turns about a unit ``axis`` from ``first`` by ``angle``."""

    first: Array
    axis: Array
    angle: float

    @classmethod
    def between(cls, one: Array, two: Array, axis: Array) -> Turning:
        """From a vector to another with the same part along the axis."""
        flat = one - axis * float(axis @ one)
        return cls(one, axis, float(np.arctan2(axis @ np.cross(flat, two), flat @ two - (axis @ two) * (axis @ flat))))

    def at(self, fractions: Field) -> Field:
        """The vectors (n, 3) at fractions (n,) of the turn."""
        along = self.axis * float(self.axis @ self.first)
        flat = self.first - along
        angles = fractions * self.angle
        aside = cross(self.axis, flat)
        return np.asarray(along + np.cos(angles)[:, None] * flat + np.sin(angles)[:, None] * aside)


@dataclass(frozen=True, eq=False)
class Crossing:
    """A limb's way through its limit at one pose: the foot of its rod turns about ``centre`` or moves straight from one
    working mode's place to the other's, its rod turns, the platform keeps its turn ``R``; λ from 0 to 1."""

    place: Place
    limb: int
    leg: str
    tip: Rigid
    rod: Turning
    foot: Turning | tuple[Array, Array]
    centre: Array

    @property
    def p(self) -> Array:
        """The point's position at both ends."""
        return self.place[0]

    @property
    def R(self) -> Array:
        """The platform's turn all along."""
        return self.place[1]

    @property
    def end(self) -> Place:
        """The pose at λ = 1, the same as at λ = 0."""
        return self.place

    def at(self, fractions: Field) -> tuple[Field, Field, tuple[int, Field]]:
        """Poses (n, 3), (n, 3, 3) at fractions (n,), and the leading limb with the vector that it carries."""
        if isinstance(self.foot, Turning):
            carried = self.centre + self.foot.at(fractions)
        else:
            carried = self.foot[0] + fractions[:, None] * (self.foot[1] - self.foot[0])
        carried = widened(carried, FOLLOWED)
        p = carried + self.rod.at(fractions) - (self.tip.constant + self.R @ self.tip.turned)
        R: Field = np.broadcast_to(self.R, (len(fractions), 3, 3))
        return widened(p, FOLLOWED), widened(R.astype(p.dtype), FOLLOWED), (self.limb, carried)


def crossing(carriage: Carriage, limb: Limb, number: int, place: Place) -> Crossing | None:
    """The way of limb ``number`` to its other working mode at a pose; None where it has none in the platform's motion.

    Where the platform's point moves in a plane only, the crank turns and the rod swings in that plane.
    """
    if not isinstance(limb, OnCrank | OnRail) or not (limb.tip.follows and carriage.turning):
        return None
    tip = limb.tip.value(place[0][None], place[1][None])
    ends = [limb.solve(tip, sign * limb.branch)[1][0] for sign in (1.0, -1.0)]
    rods = [tip[0] - end for end in ends]
    axis = limb.axis if isinstance(limb, OnCrank) else np.cross(*rods)
    axis = axis / max(float(np.linalg.norm(axis)), FOLLOWED)
    shifts = carriage.motion.translations
    if shifts.shape[1] < 2 or (shifts.shape[1] == 2 and np.linalg.norm(axis @ shifts) > FOLLOWED):
        return None
    rod = Turning.between(rods[0], rods[1], axis)
    if isinstance(limb, OnRail):
        return Crossing(place, number, limb.leg, limb.tip, rod, (ends[0], ends[1]), np.zeros(3))
    spokes = [end - limb.centre for end in ends]
    return Crossing(place, number, limb.leg, limb.tip, rod, Turning.between(spokes[0], spokes[1], axis), limb.centre)
