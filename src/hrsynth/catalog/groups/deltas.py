"""Delta-like robots: legs with an R or P at the base, then two rods 2SS or 2US, or one rod UU or US."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement, product

from ..architecture_key import ArchitectureKey, LegKey
from .legs import list_leg_pairs, list_robots_with, parse_leg

RODS = ("2SSt", "Utn-Unt", "Utn-S")
"""Two rods apart along the tangent, and one rod whose outer axes are tangential."""
BASES = ("Rt*", "Pk*", "Pz*")
"""A tangential R, an inclined rail in the leg's plane, parallel rails."""
_ENDS = (["2SS"], ["2US"], ["U", "U"], ["U", "S"])


def belongs(word: ArchitectureKey) -> bool:
    """Return True if all legs are an R or a P and then 2SS, 2US, UU or US."""
    return all(
        leg.joints[0].letter in ("R", "P") and [joint.letter for joint in leg.joints[1:]] in _ENDS for leg in word.legs
    )


def _list_legs(bases: tuple[str, ...], rods: tuple[str, ...]) -> list[LegKey]:
    return [parse_leg(f"{base}-{rod}") for base, rod in product(bases, rods)]


def words() -> Iterator[ArchitectureKey]:
    """Two to four legs, alike or mixed; five and six of at most two kinds; rails along one and along three axes of the
    base; rods with U at their upper ends; and articulated platforms with two legs on each plate."""
    kinds = _list_legs(BASES, RODS)
    for count in (2, 3, 4):
        yield from list_robots_with(kinds, count)
    for count in (5, 6):
        yield from list_leg_pairs(kinds, count)
    for rod in (*RODS, "2USt"):
        along, across, up = (
            parse_leg(f"P{axis}*-{rod.replace('t', side)}") for axis, side in (("x", "y"), ("y", "z"), ("z", "x"))
        )
        for counts in product(range(3), repeat=3):
            if sum(counts) >= 2:
                yield ArchitectureKey.of([along] * counts[0] + [across] * counts[1] + [up] * counts[2])
        yield from (ArchitectureKey.of([along] * count) for count in range(2, 7))
    for chain in _list_legs(BASES, ("2USt",)):
        yield from (ArchitectureKey.of([chain] * count) for count in range(2, 7))
    for platform, bases in (("bar", BASES), ("slide", (*BASES, "Px*"))):
        sides = list(combinations_with_replacement(_list_legs(bases, RODS[:2]), 2))
        for left, right in combinations_with_replacement(sides, 2):
            if left == right or (left[0] == left[1] and right[0] == right[1]):
                yield ArchitectureKey.of(list(left), list(right), platform=platform)
