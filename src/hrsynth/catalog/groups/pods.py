"""The n-pods: three to six legs, each with a P between a joint (or a slide) on the base and one on the platform."""

from __future__ import annotations

from collections.abc import Iterator

from ..architecture_key import ArchitectureKey
from .legs import list_robots_with, parse_leg

KINDS = tuple(map(parse_leg, ("Utn-Pl*-S", "Utn-Pl*-Unt", "Rt-Pl*-S", "S-Pl*-S", "S-Pl*-Rt", "Pr*-Pz-S", "Cr*-Pz-S")))
"""UPS, UPU (parallel outer axes), RPS, SPS, SPR, and PPS, CPS that slide along the radius."""
UNCONSTRAINED_LEG_DOF_COUNT = 6
"""Dof of a leg that constrains nothing."""


def belongs(word: ArchitectureKey) -> bool:
    """Return True if all legs have three joints, the middle one a P, and end on U, S or R, on one rigid platform."""
    return not word.platform and all(
        len(leg.joints) == 3
        and leg.joints[1].letter == "P"
        and leg.joints[2].letter in ("U", "S", "R")
        and leg.joints[0].letter in ("U", "R", "S", "P", "C")
        and "o" not in leg.joints[0].axes
        and {leg.joints[0].letter, leg.joints[2].letter} != {"R"}
        for leg in word.legs
    )


def words() -> Iterator[ArchitectureKey]:
    """Yield robots of three to six legs, alike or mixed, with positive dof by count; and all with equal legs."""
    for count in range(3, 7):
        for word in list_robots_with(KINDS, count):
            constraints = sum(max(0, UNCONSTRAINED_LEG_DOF_COUNT - each.freedoms) for each in word.legs)
            if constraints < UNCONSTRAINED_LEG_DOF_COUNT or len(set(word.legs)) == 1:
                yield word
