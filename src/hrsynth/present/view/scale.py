"""How wrong the platform can be, on one scale for all robots: millimetres and degrees for 0.1° of each direction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...analysis.accuracy.measurement_bounds import MeasurementBounds
from ...analysis.accuracy.pose_errors import largest_by_ascent
from ...analysis.observed import ObservedRobot
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.observations.direction import Direction
from ...results import finite
from ..text.tables import NOT_BOUNDED, is_bounded

CONE = math.radians(0.1)
"""Half-angle of the errors of each watched direction (rad)."""
CONE_TEXT = "0.1deg"
NAMES = ("very good", "good", "fair", "poor", "very poor")
"""What the steps of the scale are called."""
STEPS = {"mm": (1.0, 3.0, 10.0, 30.0), "deg": (0.1, 0.3, 1.0, 3.0)}
"""Where one step of the scale ends and the next begins, for 0.1° of each direction."""
SIGNS = {"mm": " mm", "deg": "°"}
LOST = "a freedom is not seen: the error has no bound"


def unit_of(setup: ObservedRobot) -> str:
    """In which unit a platform's error is shown: degrees where it only turns."""
    return "mm" if setup.motion.translations.shape[1] else "deg"


def step_of(value: float | None, unit: str) -> int:
    """The step of an error on the scale; the last where it has no bound."""
    return len(NAMES) - 1 if value is None else int(np.searchsorted(STEPS[unit], value, side="right"))


def error(setup: ObservedRobot, at: ClosedConfiguration) -> dict[str, Any]:
    """What the platform can be wrong by at a configuration, found by an ascent (:func:`.largest_by_ascent`); None where
    there is no bound, or none to first order."""
    unit = unit_of(setup)
    if not all(isinstance(each, Direction) for each in setup.observed):
        return {**nothing(unit, "not given: what is watched is not a direction"), "step": None}
    metres, radians = largest_by_ascent(
        at, setup.samples.observation_model, MeasurementBounds(np.full(len(setup.observed), CONE))
    )
    if np.isfinite([metres, radians]).all() and not (is_bounded(metres, at.model.length) and is_bounded(radians)):
        return nothing(unit, NOT_BOUNDED)
    return describe_error(
        finite(1e3 * metres), finite(math.degrees(radians)), unit, bool(setup.motion.rotations.shape[1])
    )


def describe_error(mm: float | None, deg: float | None, unit: str, turns: bool) -> dict[str, Any]:
    """The record of an error of position and of orientation; the step's name is that of ``unit``, the error of
    orientation is told beside it where the platform ``turns``."""
    value = {"mm": mm, "deg": deg}[unit]
    if mm is None or deg is None:
        return {"mm": mm, "deg": deg, "unit": unit, "step": len(NAMES) - 1, "words": LOST}
    step, size = step_of(value, unit), f"{round_digits(value)}{SIGNS[unit]}"
    turned = f"{round_digits(deg)}°" if turns and unit == "mm" else ""
    return {
        "mm": mm,
        "deg": deg,
        "unit": unit,
        "step": step,
        "size": f"{size} and {turned}" if turned else size,
        "words": f"about {size} off per 0.1°: {NAMES[step]}{f'; turned by about {turned}' if turned else ''}",
    }


def nothing(unit: str, words: str) -> dict[str, Any]:
    """The record where there is no error to be told, for a reason."""
    return {"mm": None, "deg": None, "unit": unit, "step": len(NAMES) - 1, "words": words}


def scale(unit: str) -> dict[str, Any]:
    """The scale, for a legend."""
    return {"unit": unit, "edges": list(STEPS[unit]), "names": list(NAMES)}


def round_digits(value: float | None) -> str:
    """A number as one says it: two digits."""
    return "?" if value is None else f"{float(f'{value:.2g}'):g}"
