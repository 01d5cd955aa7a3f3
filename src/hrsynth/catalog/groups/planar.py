"""Planar robots, complete: the seven chains of three joints R and P, with every motor and every observed segment.

Three legs on a rigid platform give it three dof, two legs that end on one R give a point two. Special
geometry: the rails of all legs that begin with a P are parallel. Parallelograms take the place of P or R joints, with
every motor where the legs are equal; else each leg is driven at the base, as are four legs, one more than the dof.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from ..architecture_key import ArchitectureKey, LegKey
from ..geometry import is_planar_key as belongs
from .legs import drive_each_joint, drive_first_joint, list_observed_segments, list_robots_with, parse_leg

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
        yield parse_leg("-".join(map("".join, zip(letters, names, strict=True))))


def list_parallelogram_chains() -> Iterator[LegKey]:
    """Chains of three R, P and Π, with an R, a Π, and a joint of another kind or R or P besides."""
    for letters in product(("R", "P", "Pi"), repeat=3):
        if "R" in letters and "Pi" in letters:
            own = iter(_OWN)
            yield parse_leg("-".join(f"P{next(own)}" if letter == "P" else f"{letter}z" for letter in letters))


def _list_kinds(rail: str, motors: int, tip: str = "RP") -> list[LegKey]:
    """Chains with each motor on the first ``motors`` joints and each segment observed; with the rail x only those that
    begin with a P."""
    return [
        moved
        for chain in chains(rail)
        if chain.joints[-1].letter in tip and (rail == "h" or chain.joints[0].letter == "P")
        for seen in list_observed_segments(chain)
        for moved in drive_each_joint(seen, range(motors))
    ]


def words() -> Iterator[ArchitectureKey]:
    """Yield robots with three and with two dof, of general geometry and with parallel rails, and with one leg more than
    dof."""
    for rail in ("h", "x"):
        yield from list_robots_with(_list_kinds(rail, 3), 3)
        yield from list_robots_with(_list_kinds(rail, 2, tip="R"), 2, "point")
    for chain in list_parallelogram_chains():
        for seen in list_observed_segments(chain):
            for moved in drive_each_joint(seen, range(3)):
                yield ArchitectureKey.of([moved] * 3)
                if chain.joints[-1].letter == "R":
                    yield ArchitectureKey.of([moved] * 2, platform="point")
    simple, mixed = (
        [drive_first_joint(seen) for chain in kinds for seen in list_observed_segments(chain)]
        for kinds in (chains(), [*chains(), *list_parallelogram_chains()])
    )
    yield from list_robots_with(simple, 4)
    yield from list_robots_with(mixed, 3)
    yield from list_robots_with([each for each in mixed if each.joints[-1].letter == "R"], 2, "point")
