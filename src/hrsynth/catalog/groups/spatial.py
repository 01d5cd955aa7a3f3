"""Spatial robots with three equal legs and three dof, from the literature of type synthesis; legs have up to five
joints.

Translational: all R of a leg have one or two directions, each direction in one piece (the first may return at the
end), so that the leg's constraint is a couple of constant direction. Spherical: R axes through a common point, with at
most one piece of parallel R between. Zero torsion: two joints that keep a centre in a plane, then an S. And the two
modes of 3-UPU with parallel and with meeting outer axes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import product

from ..architecture_key import ArchitectureKey, LegKey
from .legs import drive_each_joint, list_observed_segments, parse_leg

_SLIDES = "hjk"
"""Names of a leg's P axes, one after another; three dof need no more."""
CLAVEL = "Rt*-Rt-Pin-Rt"
"""The leg of the Delta robot."""


def list_translational_legs() -> Iterator[LegKey]:
    """Legs of four or five R and P whose R have the directions a … b … a, at most two P."""
    for count in (4, 5):
        for letters in product("abP", repeat=count):
            classes = "".join(letter for letter in letters if letter != "P")
            slides = count - len(classes)
            pieces = [a for a, b in zip(classes, " " + classes, strict=False) if a != b]
            if slides > 2 or pieces not in (["a"], ["a", "b"], ["a", "b", "a"]):
                continue
            own = iter(_SLIDES)
            yield parse_leg("-".join(f"P{next(own)}" if letter == "P" else f"R{letter}" for letter in letters))


def is_translational_leg(chain: LegKey) -> bool:
    """Return True if a leg of :func:`list_translational_legs` has all translations and a rotation about each of its
    directions, without internal motion: k parallel R give k - 1 translations, at most two."""
    turning = Counter(joint.axes for joint in chain.joints if joint.letter == "R")
    return len(chain.joints) == 3 + len(turning) and max(turning.values()) <= 3


def list_spherical_legs() -> Iterator[LegKey]:
    """Legs of three to five R through the common point, up to three of them replaced by parallel ones in one piece."""
    for count in (3, 4, 5):
        for first in range(count):
            for last in range(first, min(count, first + 3) + 1):
                names = ["a" if first <= i < last else "o" for i in range(count)]
                if names.count("o") >= 2 and (last > first or first == 0):
                    yield parse_leg("-".join(f"R{name}" for name in names))
    yield parse_leg("Uon-Pl-Uno")


def list_zero_torsion_legs() -> list[LegKey]:
    """Legs that keep the centre of an S in a plane normal to their tangent, the S on the platform or on the base."""
    planes = ("Rt-Rt", "Rt-Pl", "Rt-Pk", "Pz-Rt", "Pk-Rt", "Pr-Rt", "Pr-Pz", "Pz-Pr")
    found = [parse_leg(f"{plane}-S") for plane in planes]
    return found + [parse_leg(text) for text in ("S-Rt-Rt", "S-Pl-Rt")]


def words() -> Iterator[ArchitectureKey]:
    """Three equal legs of each family, each segment observed, each of the first two joints driven; the Clavel leg with
    a Π."""
    for chain in (*list_translational_legs(), *list_spherical_legs(), *list_zero_torsion_legs()):
        for seen in list_observed_segments(chain):
            yield from (ArchitectureKey.of([each] * 3) for each in drive_each_joint(seen, range(2)))
    for text in (CLAVEL, "Pk*-Rt-Pin-Rt", "Pz*-Rt-Pin-Rt"):
        yield from (ArchitectureKey.of([seen] * 3) for seen in list_observed_segments(parse_leg(text)))
