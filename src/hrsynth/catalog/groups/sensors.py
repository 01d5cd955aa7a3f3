"""Robots with cameras on the base that observe the platform, or with an IMU: known architectures, each with several
sets of sensors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from ..architecture_key import ArchitectureKey, parse, parse_observations

ROBOTS = (
    "6(Utn-Pl*-S)",
    "3(Rt-Pl*-S)",
    "3(Pk*-Rt-S)",
    "3(Utn-Pl*-Unt)",
    "3(Rt*-2SSt)",
    "4(Rt*-2SSt)",
    "3(Rz*-Rz-Rz)",
    "6(Rt*-Utn-S)",
)
"""Six dof, pods with fewer, deltas with three and four, a planar robot, rods on cranks."""
SEEN = (
    "point",
    "2point",
    "3point",
    "3point'",
    "4point",
    "2image_line",
    "3image_line",
    "2point+image_line",
    "point+2image_line",
    "point+line",
    "inclination",
    "inclination+point",
    "inclination+2point",
    "position",
    "2depth+2point",
    "circle",
)
"""One camera, or with ' a camera each."""


def words() -> Iterator[ArchitectureKey]:
    """Each robot with each set."""
    for robot, seen in product(ROBOTS, SEEN):
        yield replace(parse(robot), seen=parse_observations(seen))
