"""Summary: the legs to observe, the error of the platform with them, other poses at which the loop may stop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....analysis.modes.modes import modes
from ....analysis.observed import ObservedRobot
from ....analysis.verdict import CONTROLLABLE, Verdict
from ....errors import HrsynthError
from ...text.sentences import describe_blindness, describe_choice, describe_other_equilibria, describe_zero_error
from ...view.scale import describe_pose_error
from ..commands import format_commands
from ..request import Request
from .watch import find_smallest_sets


def answer(request: Request) -> dict[str, Any]:
    """Return three sentences about a robot at its zero configuration, for the smallest leg set of the best rank with
    the least error there."""
    setup = ObservedRobot.of(request.mechanism, "all", request.camera)
    found = [(observe_verdict_legs(setup, each), each) for each in find_smallest_sets(setup)]
    start = setup.all_samples.start
    chosen, verdict = min(found, key=lambda pair: _measure_error(describe_pose_error(pair[0], start)))
    legs = list(verdict.legs) if verdict.rank else []
    return {
        "sentences": [
            describe_choice(verdict),
            *(describe_remaining_error(chosen) if verdict == CONTROLLABLE else describe_blindness(verdict)),
        ],
        "watch": legs,
        **format_commands(request, "legs", watching=False),
    }


def observe_verdict_legs(setup: ObservedRobot, verdict: Verdict) -> ObservedRobot:
    """Return the robot with the legs of a verdict observed."""
    return replace(setup, observed=tuple(each for each in setup.observed if each.leg in verdict.legs))


def _measure_error(wrong: dict[str, Any]) -> float:
    value = wrong[wrong["unit"]]
    return np.inf if value is None else float(value)


def describe_remaining_error(setup: ObservedRobot) -> list[str]:
    """Describe the error of the platform at the zero configuration, and other poses at which the loop may stop."""
    first = describe_zero_error(describe_pose_error(setup, setup.all_samples.start))
    try:
        return [first, describe_other_equilibria(modes(setup))]
    except HrsynthError as problem:
        return [first, f"Other poses at which the loop may stop are not listed: {problem}."]
