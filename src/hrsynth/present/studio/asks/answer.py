"""Summary: the legs to observe, the error of the platform with them, other poses at which the loop may stop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....analysis.modes.modes import modes
from ....analysis.observed import ObservedRobot
from ....analysis.verdict import CONTROLLABLE, Verdict
from ....errors import HrsynthError
from ...text.sentences import blind, elsewhere, home_error, which
from ...view.scale import error
from ..commands import lines
from ..request import Request
from .watch import smallest


def answer(request: Request) -> dict[str, Any]:
    """Return three sentences about a robot at its zero configuration, for the smallest leg set of the best rank with
    the least error there."""
    setup = ObservedRobot.of(request.mechanism, "all", request.camera)
    found = [(watching(setup, each), each) for each in smallest(setup)]
    start = setup.all_samples.start
    chosen, verdict = min(found, key=lambda pair: _size(error(pair[0], start)))
    legs = list(verdict.legs) if verdict.rank else []
    return {
        "sentences": [which(verdict), *(rest(chosen) if verdict == CONTROLLABLE else blind(verdict))],
        "watch": legs,
        **lines(request, "legs", watching=False),
    }


def watching(setup: ObservedRobot, verdict: Verdict) -> ObservedRobot:
    """Return the robot with the legs of a verdict observed."""
    return replace(setup, observed=tuple(each for each in setup.observed if each.leg in verdict.legs))


def _size(wrong: dict[str, Any]) -> float:
    value = wrong[wrong["unit"]]
    return np.inf if value is None else float(value)


def rest(setup: ObservedRobot) -> list[str]:
    """Describe the error of the platform at the zero configuration, and other poses at which the loop may stop."""
    first = home_error(error(setup, setup.all_samples.start))
    try:
        return [first, elsewhere(modes(setup))]
    except HrsynthError as problem:
        return [first, f"Other poses at which the loop may stop are not listed: {problem}."]
