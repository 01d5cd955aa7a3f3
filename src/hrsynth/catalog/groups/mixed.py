"""Spatial robots whose legs are not of one chain: complete for three legs that translate, for three spherical ones and
for three of zero torsion, each leg driven at the base.

Legs that translate (:func:`.spatial.translates`) are those of type synthesis by virtual chains: each leaves its end all
translations, so any three of them make a robot that translates; and the Clavel leg with a Π.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement

from ..words import RobotWord
from .legs import base_driven, leg, robots
from .spatial import CLAVEL, spherical, translates, translational, zero_torsion


def belongs(word: RobotWord) -> bool:
    """Legs of different chains, whatever is driven or observed."""
    return len({str(leg.chain) for leg in word.legs}) > 1


def words() -> Iterator[RobotWord]:
    """All sets of three legs of each family; two legs alike and one other that slide first or not, of five joints."""
    for family in ([*filter(translates, translational()), leg(CLAVEL)], spherical(), zero_torsion()):
        yield from robots([base_driven(chain) for chain in family], 3)
    general = [base_driven(chain) for chain in translational() if len(chain.joints) == 5]
    for one, other in combinations_with_replacement(general, 2):
        if {one.joints[0].letter, other.joints[0].letter} == {"P"}:
            yield RobotWord.of([one, one, other])
