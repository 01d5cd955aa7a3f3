"""Platforms that a leg of R and P carries, as the checker's kind ``chain``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.loci.carrying_leg_system import CarriedCondition, CarriedPlatform, Turn
from ..analysis.modes.carrying_leg_modes import enclose_zeros, measure_joint_distances, propose_zeros
from ..geometry.vectors import Array
from ..solving.newton import SAME_ZERO_DISTANCE_TOL
from ..solving.platform.pose_conditions import AtAngle, OnPlane, OnRevolution
from ..solving.platform.quadrics import UNIT
from .closures import write_numbers
from .verify_certificate import CertificateRejection

PLATFORM = [["0", "0", "0"], ["1", "0", "0"], ["0", "1", "0"]]
"""Three points of the platform at the goal (sizes)."""
ZERO_TO_GOAL_OFFSET_RAD = 0.6
"""Rotation of the zero position of each next joint of a leg from the goal (rad)."""

Starts = list[tuple[list[complex], bool | None]]


@dataclass(frozen=True, eq=False)
class ToldChain:
    """A system without boxes and bound; about where its solutions are, and whether they are real; for the real ones
    the number of the list's mode there, None where it is none."""

    record: dict[str, Any]
    starts: Starts
    modes: list[int | None]
    home: Array
    """Coordinates (n,) of the list's own that the record is relative to."""

    @classmethod
    def of(cls, record: dict[str, Any], starts: Starts, found: Sequence[Array], home: Array) -> ToldChain:
        """With the list's modes by their coordinates (rad, sizes)."""
        slides = np.array([kind == "P" for kind, *_ in record["joints"]])
        places = [np.where(slides, np.real(start), 2.0 * np.arctan(np.real(start))) for start, real in starts if real]

        def is_at(x: Array, q: Array) -> bool:
            return bool(measure_joint_distances(slides, x, q) < SAME_ZERO_DISTANCE_TOL)

        modes = [next((k for k, x in enumerate(found) if is_at(x, q)), None) for q in places]
        return cls(record, starts, modes, home)


def write_chain(system: CarriedPlatform, found: Sequence[Array]) -> ToldChain:
    """Return a system with modes at these coordinates, the conditions of the square part first. Angles are relative to
    a configuration where no joint is at the goal, so that a half turn from there, as observed directions allow, is not
    an infinite tangent."""
    n, told, slides = len(system.freedoms_), [*system.square], np.array([each.slides for each in system.freedoms_])
    told += [each for each in system.told if each not in told and _carriers(each)]
    off = np.where(slides, 0.0, ZERO_TO_GOAL_OFFSET_RAD * np.arange(1, n + 1))
    record: dict[str, Any] = {
        "kind": "chain",
        "joints": [_joint(each, *system.transform(off, k)) for k, each in enumerate(system.freedoms_)],
        "ends": [[system.carrying]],
        "tips": [*PLATFORM],
        "reaches": [],
    }
    for each in told:
        tip, reach, arrow = _displaced_tip(each, *system.transform(off, each.joints))
        record["tips"].append(tip)
        record["reaches"].append(reach)
        record["ends"].append([min(_carriers(each)), max(_carriers(each)) + 1, arrow])
    turn, starts = np.exp(-1j * off), Starts()
    for box in enclose_zeros(system, propose_zeros(system, system.most(system.square))):
        c, s, t = box.middle[:n], box.middle[n : 2 * n], box.middle[2 * n :]
        c, s = c * turn.real - s * turn.imag, s * turn.real + c * turn.imag
        starts.append((np.where(slides, t, s / (1.0 + c)).tolist(), box.real))
    return ToldChain.of(record, starts, [x - off for x in found], off)


def _carriers(told: CarriedCondition) -> list[int]:
    """Return the joints on which a condition depends."""
    return [k for k in range(told.joints) if k not in told.idle]


def _joint(turn: Turn, R: Array, p: Array) -> list[Any]:
    """A turn or a slide, displaced, its axis of length one, and a point."""
    return ["P" if turn.slides else "R", write_numbers(_unit(R @ turn.axis)), write_numbers(_near(p + R @ turn.point))]


def _near(v: Array) -> list[Fraction]:
    return [Fraction(round(float(x) * UNIT), UNIT) for x in v]


def _unit(v: Array) -> list[Fraction]:
    """A rational vector of length exactly one near a unit vector, by its image in a plane from its opposite."""
    k = int(np.argmax(np.abs(v)))
    sign = 1 if v[k] > 0 else -1
    image = _near(np.delete(v, k) / (1.0 + abs(v[k])))
    w = sum((x * x for x in image), Fraction(1))
    found = [2 * x / w for x in image]
    found.insert(k, sign * (2 - w) / w)
    return found


def _displaced_tip(each: CarriedCondition, R: Array, p: Array) -> tuple[Any, Any, int]:
    """A tip, or an arrow, displaced, and the plane or sphere on which it is."""
    c = each.condition
    b = write_numbers(_near(p + R @ c.b))
    if isinstance(c, OnPlane):
        return b, {"plane": write_numbers([_near(c.h * c.n / (c.n @ c.n)), _near(c.n)])}, 0
    if isinstance(c, AtAngle):
        return write_numbers(_near(R @ c.c)), {"plane": write_numbers([_near(c.h * c.a), _near(c.a)])}, 1
    if isinstance(c, OnRevolution) and float(c.f[2]) == -1.0 and float(c.f[1]) == 0.0:
        return b, {"sphere": write_numbers([_near(c.o), _near(c.f[:1])])}, 0
    raise CertificateRejection(f"legs have conditions that the checker does not know: {type(c).__name__}")
