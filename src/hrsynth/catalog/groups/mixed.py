"""Spatial robots whose legs are not of one chain: complete for three legs that translate, for three spherical ones and
for three of zero torsion, each leg driven at the base.

Legs that translate (:func:`.spatial.is_translating`) leave their end all translations, so any three of them make a
robot that translates; the Clavel leg with a Π is one of them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement

from ..architecture_key import ArchitectureKey
from .legs import drive_first_joint, list_robots_with, parse_leg
from .spatial import CLAVEL, is_translational_leg, list_spherical_legs, list_translational_legs, list_zero_torsion_legs


def belongs(word: ArchitectureKey) -> bool:
    """Legs of different chains, whatever is driven or observed."""
    return len({str(leg.chain) for leg in word.legs}) > 1


def words() -> Iterator[ArchitectureKey]:
    """All sets of three legs of each family; two legs alike and one other that slide first or not, of five joints."""
    translating = filter(is_translational_leg, list_translational_legs())
    for family in ([*translating, parse_leg(CLAVEL)], list_spherical_legs(), list_zero_torsion_legs()):
        yield from list_robots_with([drive_first_joint(chain) for chain in family], 3)
    general = [drive_first_joint(chain) for chain in list_translational_legs() if len(chain.joints) == 5]
    for one, other in combinations_with_replacement(general, 2):
        if {one.joints[0].letter, other.joints[0].letter} == {"P"}:
            yield ArchitectureKey.of([one, one, other])
