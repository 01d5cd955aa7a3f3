"""Spatial robots whose legs are not of one chain: complete for three legs that translate, for three spherical ones and
for three of zero torsion, each leg driven at the base.

Legs that translate (:func:`.spatial.translates`) leave their end all translations, so any three of them make a robot
that translates; the Clavel leg with a Π is one of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement

from ..architecture_key import ArchitectureKey
from .legs import base_driven, leg, robots
from .spatial import CLAVEL, spherical, translates, translational, zero_torsion


def belongs(word: ArchitectureKey) -> bool:
    """Legs of different chains, whatever is driven or observed."""
    return len({str(leg.chain) for leg in word.legs}) > 1


def words() -> Iterator[ArchitectureKey]:
    """All sets of three legs of each family; two legs alike and one other that slide first or not, of five joints."""
    translating = filter(translates, translational())
    for family in ([*translating, leg(CLAVEL)], spherical(), zero_torsion()):
        yield from robots([base_driven(chain) for chain in family], 3)
    general = [base_driven(chain) for chain in translational() if len(chain.joints) == 5]
    for one, other in combinations_with_replacement(general, 2):
        if {one.joints[0].letter, other.joints[0].letter} == {"P"}:
            yield ArchitectureKey.of([one, one, other])
