"""3T1R robots with four equal serial legs, complete for legs of R, P and U: 4-RUU, 4-PUU and their kin.

A leg is a chain of four or five R and P; its R are vertical (z) or along one horizontal direction of the leg's own (h),
its P point anywhere. Its end has all translations and the turn about z, every joint moves, and no link moves without
the end: k parallel R give k - 1 translations, at most two. The R of h are in one piece, since a turn about z between
them leaves no translation. The leg's constraint is a couple normal to z and h, or all couples normal to z where there
is no h. Neighbouring R of z and h are two joints or a U. The first joint is an R or a P on the base, with the motor.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product

from ..architecture_key import ArchitectureKey, LegKey
from .legs import drive_first_joint, list_observed_segments, parse_leg

SCHOENFLIES_LEGS_COUNT = 4


def belongs(word: ArchitectureKey) -> bool:
    """Return True if four equal legs of R, P and U rotate only about z and horizontal directions of their own."""
    axes = {axis for leg in word.legs for joint in leg.joints if joint.letter != "P" for axis in joint.axes}
    return (
        len(word.legs) == SCHOENFLIES_LEGS_COUNT
        and not word.platform
        and len({str(leg.chain) for leg in word.legs}) == 1
        and all(joint.letter in "RPU" for joint in word.legs[0].joints)
        and "z" in axes
        and axes <= set("zh")
    )


def list_sequences() -> Iterator[str]:
    """The legs' letters: z and h for an R of this direction, P."""
    for count in (4, 5):
        for letters in map("".join, product("zhP", repeat=count)):
            turning = letters.replace("P", "")
            if re.fullmatch("z*(hhh?)?z*", turning) and 1 <= turning.count("z") <= 3 and count == 3 + len(set(turning)):
                yield letters


def chains() -> Iterator[LegKey]:
    """The legs of each sequence, with and without each U that is not on the base."""
    for letters in list_sequences():
        own = iter("abc")
        plain = "-".join(f"P{next(own)}" if letter == "P" else f"R{letter}" for letter in letters)
        for text in {
            plain.replace(*one).replace(*other)
            for one in (("", ""), ("Rz-Rh", "Uzh"))
            for other in (("", ""), ("Rh-Rz", "Uhz"))
        }:
            if text[0] != "U":
                yield parse_leg(text)


def words() -> Iterator[ArchitectureKey]:
    """Four legs of each chain, each segment observed."""
    for chain in chains():
        yield from (
            ArchitectureKey.of([drive_first_joint(seen)] * SCHOENFLIES_LEGS_COUNT)
            for seen in list_observed_segments(chain)
        )
