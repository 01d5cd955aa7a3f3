"""The plain answer: which legs to watch, how wrong the platform can be then, and where else the loop may stop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....analysis.modes.assembly_mode import AssemblyMode
from ....analysis.modes.modes import AssemblyModes, modes
from ....analysis.modes.near import degrees, distance_from
from ....analysis.observed import ObservedRobot
from ....analysis.verdict import CONTROLLABLE, Verdict
from ....errors import HrsynthError
from ....tolerances import SAME_RELATION
from ...text.poses import all_of
from ...text.tables import name_all
from ...view.scale import LOST, error
from ..commands import lines
from ..request import Request
from .watch import smallest


def answer(request: Request) -> dict[str, Any]:
    """Three sentences about a robot at its zero configuration, of the smallest sets of legs that see most the one with
    the least error there."""
    setting = ObservedRobot.of(request.mechanism, "all", request.camera)
    found = [(watching(setting, each), each) for each in smallest(setting)]
    start = setting.everything.start
    chosen, verdict = min(found, key=lambda pair: _size(error(pair[0], start)))
    legs = list(verdict.legs) if verdict.rank else []
    return {
        "sentences": [which(verdict), *(rest(chosen) if verdict == CONTROLLABLE else blind(verdict))],
        "watch": legs,
        **lines(request, "legs", watching=False),
    }


def watching(setting: ObservedRobot, verdict: Verdict) -> ObservedRobot:
    """The robot with the legs of a verdict watched."""
    return replace(setting, observed=tuple(each for each in setting.observed if each.leg in verdict.legs))


def _size(wrong: dict[str, Any]) -> float:
    value = wrong[wrong["unit"]]
    return np.inf if value is None else float(value)


def which(verdict: Verdict) -> str:
    """The sentence that says which legs to watch."""
    legs = name_all("leg", verdict.legs)
    if verdict == CONTROLLABLE:
        return f"Watch {legs}."
    if not verdict.dof:
        return "The platform has no freedom: there is nothing to control."
    if not verdict.rank:
        return (
            "Watching the legs does not help: their directions do not change with the platform wherever it was tried."
        )
    lost = len(verdict.lost)
    return (
        f"Watching legs is not enough: even with all of them {lost} of {verdict.dof} freedoms "
        f"stay{'s' * (lost == 1)} unseen wherever it was tried: {verdict.named}."
    )


def blind(verdict: Verdict) -> list[str]:
    """What follows where a freedom is not seen."""
    if not verdict.dof:
        return []
    legs = name_all("leg", verdict.legs)
    seen = f"{legs[0].upper()}{legs[1:]} see{'s' * (len(verdict.legs) == 1)} as much as all of them together."
    return [
        seen if verdict.rank else "However well the directions are measured, they say nothing about the platform.",
        "Something else must be measured as well: the command advise lists what would do.",
    ]


def rest(setting: ObservedRobot) -> list[str]:
    """How wrong the platform can be at the zero configuration, and where else the loop may stop."""
    wrong = error(setting, setting.everything.start)
    value = wrong[wrong["unit"]]
    if value is None:
        first = (
            "At the zero configuration a freedom is lost, so that the error has no bound there."
            if wrong["words"] == LOST
            else f"The error of the platform is then {wrong['words']}."
        )
    else:
        first = f"At home the platform is then off by about {wrong['size']} per 0.1°."
    return [first, _elsewhere(setting)]


def _elsewhere(setting: ObservedRobot) -> str:
    """Where else the loop may stop: the other assembly modes, as they were listed."""
    try:
        found = modes(setting)
    except HrsynthError as problem:
        return f"Other poses at which the loop may stop could not be listed: {problem}."
    if found.found.continuum is not None or found.motions:
        return "The loop may stop anywhere on a whole curve of poses at which the legs look the same."
    others: list[AssemblyMode] = [*(mode for mode in found.modes if not mode.goal), *found.near]
    met = [mode for mode in others if mode.reachable is not False]
    return _others(found, len(others), met)


def _others(found: AssemblyModes, count: int, met: list[AssemblyMode]) -> str:
    known = found.found.complete
    if not met:
        if count:
            there = f"{_number(count)} other pose{'s' * (count > 1)}"
            words = f"The legs look the same at {there}, but the robot does not reach {'them' if count > 1 else 'it'}"
        else:
            words = (
                f"No other pose has the same directions ({all_of(found)})"
                if known
                else ("No other pose was found at which the legs look the same")
            )
        return f"{words}." if known else f"{words}; there may be others that were not found."
    away = sorted(distance_from(found.setting.motion, found.goal, mode) for mode in met)
    near, turn = away[0]
    far = f"{_length(near)} away" if near > SAME_RELATION else f"turned by {np.degrees(turn):.2g}°"
    where = f"one other pose, {far}" if len(met) == 1 else f"{_number(len(met))} other poses, the nearest {far}"
    if found.near:
        where += f" (directions that differ by no more than {degrees(found.near[-1].angle)})"
    return f"The loop may stop at {where}{'' if known else ', and perhaps at others that were not found'}."


def _length(metres: float) -> str:
    if metres >= 1:
        return f"{metres:.2g} m"
    return f"{100 * metres:.2g} cm" if metres >= 0.01 else f"{1e3 * metres:.2g} mm"


def _number(count: int) -> str:
    return {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}.get(count, str(count))
