"""Spatial robots with three freedoms from the literature of type synthesis, legs of up to five joints.

Translational: all R of a leg have one or two directions, each direction in one piece (the first may return at the
end), so that the leg's constraint is a couple of constant direction. Spherical: R axes through a common point, with at
most one piece of parallel R between. Zero torsion: two joints that keep a centre in a plane, then an S. And the two
modes of 3-UPU with parallel and with meeting outer axes.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement, product

from ..words import LegWord, RobotWord
from .legs import base_driven, driven, leg, robots, watched

_SLIDES = "hjk"
"""Names of a leg's P axes, one after another; more are not needed for three freedoms."""


def belongs(word: RobotWord) -> bool:
    """Every word that is in no other group."""
    return True


def translational() -> Iterator[LegWord]:
    """Legs of four or five R and P whose R have the directions a … b … a, at most two P."""
    for count in (4, 5):
        for letters in product("abP", repeat=count):
            classes = "".join(letter for letter in letters if letter != "P")
            slides = count - len(classes)
            pieces = [a for a, b in zip(classes, " " + classes, strict=False) if a != b]
            if slides > 2 or pieces not in (["a"], ["a", "b"], ["a", "b", "a"]):
                continue
            own = iter(_SLIDES)
            yield leg("-".join(f"P{next(own)}" if letter == "P" else f"R{letter}" for letter in letters))


def spherical() -> Iterator[LegWord]:
    """Legs of three to five R through the common point, up to three of them replaced by parallel ones in one piece."""
    for count in (3, 4, 5):
        for first in range(count):
            for last in range(first, min(count, first + 3) + 1):
                names = ["a" if first <= i < last else "o" for i in range(count)]
                if names.count("o") >= 2 and (last > first or first == 0):
                    yield leg("-".join(f"R{name}" for name in names))
    yield leg("Uon-Pl-Uno")


def zero_torsion() -> list[LegWord]:
    """Legs that keep the centre of an S in a plane normal to their tangent, the S on the platform or on the base."""
    planes = ("Rt-Rt", "Rt-Pl", "Rt-Pk", "Pz-Rt", "Pk-Rt", "Pr-Rt", "Pr-Pz", "Pz-Pr")
    found = [leg(f"{plane}-S") for plane in planes]
    return found + [leg(text) for text in ("S-Rt-Rt", "S-Pl-Rt")]


def words() -> Iterator[RobotWord]:
    """Three equal legs of each family, each segment observed, each of the first two joints driven; mixed zero-torsion
    robots; the Clavel leg with a Π."""
    for chain in (*translational(), *spherical()):
        for seen in watched(chain):
            yield from (RobotWord.of([each] * 3) for each in driven(seen, range(2)))
    for text in ("Rt*-Rt-Pin-Rt", "Pk*-Rt-Pin-Rt", "Pz*-Rt-Pin-Rt"):
        yield from (RobotWord.of([seen] * 3) for seen in watched(leg(text)))
    tilting = zero_torsion()
    yield from robots([base_driven(chain) for chain in tilting], 3)
    for chain in tilting:
        for seen in watched(chain):
            yield from (RobotWord.of([each] * 3) for each in driven(seen, range(2)))
    general = list(translational())
    for one, other in combinations_with_replacement([base_driven(chain) for chain in general
                                                     if len(chain.joints) == 5], 2):
        if {one.joints[0].letter, other.joints[0].letter} == {"P"}:
            yield RobotWord.of([one, one, other])
