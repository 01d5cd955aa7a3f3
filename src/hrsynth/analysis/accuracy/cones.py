"""Cones of observation errors: half-angles as a user writes them, one for all directions or one a leg."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...errors import BadRequest
from ...geometry.vectors import Array
from ...mechanism import Observation
from ...tolerances import NARROWEST_CONE

EXAMPLE = "0.1deg, 0.002 (radians), or one for each leg such as 1=0.1deg,2=0.2deg"
ALLOWED = "more than 0 and less than 90deg"

Cones = float | str | Mapping[str, float | str] | Mapping[int, float | str]
"""One half-angle (rad) for all observed directions, one for each leg or link, or either as text."""


def half_angles(cones: Cones, observed: Sequence[Observation]) -> Array:
    """The half-angle (rad) of each observation's cone, (k,); raises ``BadRequest`` where one is missing, is of nothing
    that is observed, or is not between 0 and 90 degrees."""
    given = _parsed(cones) if isinstance(cones, str) else cones
    if not isinstance(given, Mapping):
        return np.full(len(observed), _checked(float(given), given))
    given = {str(name): _angle(value) if isinstance(value, str) else value for name, value in given.items()}
    names = {name for o in observed for name in (o.leg, o.link)}
    unknown = [name for name in given if name not in names]
    if unknown:
        raise BadRequest("a cone for something that is not observed", unknown[0],
                         "legs " + ", ".join(dict.fromkeys(o.leg for o in observed)))
    found = []
    for o in observed:
        value = given.get(o.link, given.get(o.leg))
        if value is None:
            raise BadRequest(f"leg {o.leg} has no cone", str(cones), EXAMPLE)
        found.append(_checked(value, value))
    return np.array(found)


def _parsed(text: str) -> float | dict[str, float]:
    fields = [field.strip() for field in text.split(",")]
    if len(fields) == 1 and "=" not in fields[0]:
        return _angle(fields[0])
    found: dict[str, float] = {}
    for field in fields:
        name, equals, value = (piece.strip() for piece in field.partition("="))
        if not equals:
            raise BadRequest("cones: not leg=angle", field, EXAMPLE)
        if name in found:
            raise BadRequest("cones: leg given twice", name, "once")
        found[name] = _angle(value)
    return found


def _angle(text: str) -> float:
    digits = text.removesuffix("deg").strip()
    try:
        value = float(digits)
    except ValueError:
        raise BadRequest("cone: not a number", text, EXAMPLE) from None
    return _checked(value if digits == text else math.radians(value), text)


def _checked(value: float, shown: object) -> float:
    if not 0 < value < math.pi / 2:
        raise BadRequest("half-angle of a cone", shown, ALLOWED)
    if value < NARROWEST_CONE:
        raise BadRequest("half-angle of a cone", shown, f"at least {NARROWEST_CONE:g} (radians)")
    return value
