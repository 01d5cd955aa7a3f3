"""Multisets of legs, and legs with every choice of a motor or of an observed segment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

from ..architecture_key import COMPOSITE, MOVED, ArchitectureKey, LegKey, parse


def parse_leg(text: str) -> LegKey:
    """The leg that ``text`` writes, as between the brackets of a word."""
    return parse(f"2({text})").legs[0]


def drive_each_joint(chain: LegKey, places: Iterable[int]) -> Iterator[LegKey]:
    """The leg with one motor, on each of these joints in turn that can have one."""
    for place in places:
        if chain.joints[place].letter in MOVED:
            yield LegKey(tuple(replace(joint, motor=i == place) for i, joint in enumerate(chain.joints)))


def drive_first_joint(chain: LegKey) -> LegKey:
    """The leg with a motor on the first joint that can have one."""
    return next(drive_each_joint(chain, range(len(chain.joints))))


def list_observed_segments(chain: LegKey) -> Iterator[LegKey]:
    """Return the leg once for each segment that can be observed; of segments that always have the same orientation
    (only P joints between them) one is taken."""
    last = len(chain.joints) - (1 if chain.joints[-1].letter in COMPOSITE else 2)
    seen = (
        LegKey(tuple(replace(joint, watched=i == place) for i, joint in enumerate(chain.joints))).canonical
        for place in range(last, -1, -1)
    )
    yield from dict.fromkeys(seen)


def list_robots_with(legs: Sequence[LegKey], count: int, platform: str = "") -> Iterator[ArchitectureKey]:
    """All robots with ``count`` of these legs, alike or not."""
    for chosen in combinations_with_replacement(legs, count):
        yield ArchitectureKey.of(list(chosen), platform=platform)


def list_leg_pairs(legs: Sequence[LegKey], count: int) -> Iterator[ArchitectureKey]:
    """All robots with ``count`` legs of at most two kinds."""
    for i, one in enumerate(legs):
        yield ArchitectureKey.of([one] * count)
        for other in legs[i + 1 :]:
            for ones in range(1, count):
                yield ArchitectureKey.of([one] * ones + [other] * (count - ones))
