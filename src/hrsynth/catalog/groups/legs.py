"""Multisets of legs, and legs with every choice of a motor or of an observed segment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

from ..words import COMPOSITE, MOVED, LegWord, RobotWord, parse


def leg(text: str) -> LegWord:
    """The leg that ``text`` writes, as between the brackets of a word."""
    return parse(f"2({text})").legs[0]


def drive_each_joint(chain: LegWord, places: Iterable[int]) -> Iterator[LegWord]:
    """The leg with one motor, on each of these joints in turn that can have one."""
    for place in places:
        if chain.joints[place].letter in MOVED:
            yield LegWord(tuple(replace(joint, motor=i == place) for i, joint in enumerate(chain.joints)))


def base_driven(chain: LegWord) -> LegWord:
    """The leg with a motor on the first joint that can have one."""
    return next(drive_each_joint(chain, range(len(chain.joints))))


def watch_each_segment(chain: LegWord) -> Iterator[LegWord]:
    """The leg with each segment observed in turn, one of those that always turn alike."""
    last = len(chain.joints) - (1 if chain.joints[-1].letter in COMPOSITE else 2)
    seen = (
        LegWord(tuple(replace(joint, watched=i == place) for i, joint in enumerate(chain.joints))).canonical
        for place in range(last, -1, -1)
    )
    yield from dict.fromkeys(seen)


def robots(legs: Sequence[LegWord], count: int, platform: str = "") -> Iterator[RobotWord]:
    """All robots with ``count`` of these legs, alike or not."""
    for chosen in combinations_with_replacement(legs, count):
        yield RobotWord.of(list(chosen), platform=platform)


def pairs(legs: Sequence[LegWord], count: int) -> Iterator[RobotWord]:
    """All robots with ``count`` legs of at most two kinds."""
    for i, one in enumerate(legs):
        yield RobotWord.of([one] * count)
        for other in legs[i + 1 :]:
            for ones in range(1, count):
                yield RobotWord.of([one] * ones + [other] * (count - ones))
