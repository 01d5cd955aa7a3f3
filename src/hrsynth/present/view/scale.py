"""Error of the platform, on one scale for all robots: millimetres and degrees for 0.1° of each direction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...analysis.accuracy.measurement_bounds import MeasurementBounds
from ...analysis.accuracy.pose_errors import search_largest_errors
from ...analysis.observed import ObservedRobot
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.observations.direction import Direction
from ...results import drop_infinite
from ..text.tables import NOT_BOUNDED, check_bounded

CONE = math.radians(0.1)
"""Half-angle of the errors of each observed direction (rad)."""
CONE_TEXT = "0.1deg"
NAMES = ("very good", "good", "fair", "poor", "very poor")
"""Names of the steps of the scale."""
STEPS = {"mm": (1.0, 3.0, 10.0, 30.0), "deg": (0.1, 0.3, 1.0, 3.0)}
"""Limits between the steps of the scale, for 0.1° of each direction."""
SIGNS = {"mm": " mm", "deg": "°"}
LOST = "a dof is unobserved: the error is unbounded"


def choose_error_unit(setup: ObservedRobot) -> str:
    """Return the unit of a platform's error: degrees if it only rotates."""
    return "mm" if setup.motion.translations.shape[1] else "deg"


def step_of(value: float | None, unit: str) -> int:
    """Return the step of an error on the scale; the last if it is unbounded."""
    return len(NAMES) - 1 if value is None else int(np.searchsorted(STEPS[unit], value, side="right"))


def describe_pose_error(setup: ObservedRobot, at: ClosedConfiguration) -> dict[str, Any]:
    """Compute the largest error of the platform at a configuration (:func:`.search_largest_errors`), None if not
    bounded to first order."""
    unit = choose_error_unit(setup)
    if not all(isinstance(each, Direction) for each in setup.observed):
        return {**describe_no_error(unit, "unknown: an observation is not a direction"), "step": None}
    metres, radians = search_largest_errors(
        at, setup.samples.observation_model, MeasurementBounds(np.full(len(setup.observed), CONE))
    )
    if np.isfinite([metres, radians]).all() and not (check_bounded(metres, at.model.length) and check_bounded(radians)):
        return describe_no_error(unit, NOT_BOUNDED)
    return describe_error(
        drop_infinite(1e3 * metres), drop_infinite(math.degrees(radians)), unit, bool(setup.motion.rotations.shape[1])
    )


def describe_error(mm: float | None, deg: float | None, unit: str, turns: bool) -> dict[str, Any]:
    """Return the record of a position and an orientation error; the step is that of ``unit``; the orientation error is
    added if the platform ``turns``."""
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
        "words": f"error about {size} per 0.1°: {NAMES[step]}{f'; rotation about {turned}' if turned else ''}",
    }


def describe_no_error(unit: str, words: str) -> dict[str, Any]:
    """Return the record without an error, with the reason."""
    return {"mm": None, "deg": None, "unit": unit, "step": len(NAMES) - 1, "words": words}


def scale(unit: str) -> dict[str, Any]:
    """Return the scale, for a legend."""
    return {"unit": unit, "edges": list(STEPS[unit]), "names": list(NAMES)}


def round_digits(value: float | None) -> str:
    """Format a number with two digits."""
    return "?" if value is None else f"{float(f'{value:.2g}'):g}"
