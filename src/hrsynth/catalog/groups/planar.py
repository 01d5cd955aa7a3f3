"""Planar robots, complete: the seven chains of three joints R and P, with every motor and every observed segment.

Three legs on a rigid platform give it three dof, two legs that end on one R give a point two. Special
geometry: the rails of all legs that begin with a P are parallel. Parallelograms take the place of P or R joints, with
every motor where the legs are equal; else each leg is driven at the base, as are four legs, one more than the dof.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from ..architecture_key import ArchitectureKey, LegKey
from ..geometry import planar as belongs
from .legs import base_driven, drive_each_joint, leg, robots, watch_each_segment

__all__ = ["belongs", "chains", "words"]

_OWN = "hj"
"""Names of the P axes of a leg that are not along its line."""


def chains(rail: str = "h") -> Iterator[LegKey]:
    """The seven chains of R and P; a P between two R lies along the line of their centres, a first P along ``rail``."""
    for letters in product("RP", repeat=3):
        if letters == ("P", "P", "P"):
            continue
        own = iter([rail, *(name for name in _OWN if name != rail)] if letters[0] == "P" else _OWN)
        names = ["z" if letter == "R" else "l" if letters == ("R", "P", "R") else next(own) for letter in letters]
        yield leg("-".join(map("".join, zip(letters, names, strict=True))))


def with_parallelograms() -> Iterator[LegKey]:
    """Chains of three R, P and Π, with an R, a Π, and a joint of another kind or R or P besides."""
    for letters in product(("R", "P", "Pi"), repeat=3):
        if "R" in letters and "Pi" in letters:
            own = iter(_OWN)
            yield leg("-".join(f"P{next(own)}" if letter == "P" else f"{letter}z" for letter in letters))


def _kinds(rail: str, motors: int, tip: str = "RP") -> list[LegKey]:
    """Chains with each motor on the first ``motors`` joints and each segment observed; with the rail x only those that
    begin with a P."""
    return [
        moved
        for chain in chains(rail)
        if chain.joints[-1].letter in tip and (rail == "h" or chain.joints[0].letter == "P")
        for seen in watch_each_segment(chain)
        for moved in drive_each_joint(seen, range(motors))
    ]


def words() -> Iterator[ArchitectureKey]:
    """Yield robots with three and with two dof, of general geometry and with parallel rails, and with one leg more than
    dof."""
    for rail in ("h", "x"):
        yield from robots(_kinds(rail, 3), 3)
        yield from robots(_kinds(rail, 2, tip="R"), 2, "point")
    for chain in with_parallelograms():
        for seen in watch_each_segment(chain):
            for moved in drive_each_joint(seen, range(3)):
                yield ArchitectureKey.of([moved] * 3)
                if chain.joints[-1].letter == "R":
                    yield ArchitectureKey.of([moved] * 2, platform="point")
    simple, mixed = (
        [base_driven(seen) for chain in kinds for seen in watch_each_segment(chain)]
        for kinds in (chains(), [*chains(), *with_parallelograms()])
    )
    yield from robots(simple, 4)
    yield from robots(mixed, 3)
    yield from robots([each for each in mixed if each.joints[-1].letter == "R"], 2, "point")
