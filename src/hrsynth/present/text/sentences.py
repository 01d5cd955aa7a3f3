"""The plain answer in sentences, for the studio, the report and the catalog's pages: which legs to watch, what they
show, where that is lost, how wrong the platform can be, where else the loop may stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...analysis.accuracy.accuracy import Accuracy
from ...analysis.modes.assembly_mode import AssemblyMode
from ...analysis.modes.modes import AssemblyModes
from ...analysis.modes.near import degrees, distance_from
from ...analysis.observed import ObservedRobot
from ...analysis.verdict import CONTROLLABLE, Verdict
from ...geometry.vectors import Array
from ...tolerances import SAME_RELATION
from ..view.scale import CONE_TEXT, LOST
from .poses import all_of
from .tables import name_all

MOST_SETS = 4
"""Smallest sets that are told."""


def which(verdict: Verdict) -> str:
    """Which legs to watch."""
    legs = name_all("leg", verdict.legs)
    if verdict == CONTROLLABLE:
        return f"Watch {legs}."
    if not verdict.dof:
        return "The platform has no freedom: there is nothing to control."
    if not verdict.rank:
        return (
            "Watching the legs does not help: their directions do not change with the platform wherever it was tried."
        )
    lost = len(verdict.unobserved)
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


def describe_seen(verdict: Verdict, labels: Sequence[str], setup: ObservedRobot) -> str:
    """How many freedoms are seen, and what is not."""
    if (bodies := verdict.formation) is not None:
        rest = "".join(f"; {each.name}" for each in bodies.flexes) or "; nothing else"
        return (
            f"Watching {_joined(labels, things(setup))} shows {verdict.rank} of the bodies' {verdict.dof} freedoms. "
            f"Not seen: {', '.join(bodies.trivial) or 'no trivial motion'}{rest}."
        )
    unseen = verdict.named if verdict.unobserved else ""
    return shows(labels, things(setup), verdict.rank, verdict.dof, unseen)


def shows(labels: Sequence[str], what: str, rank: int, dof: int, unseen: str = "") -> str:
    """How many freedoms of a platform ``what`` is observed shows, by labels."""
    return f"Watching {_joined(labels, what)} shows {rank} of the platform's {dof} freedoms" + (
        f": not {unseen}." if unseen else "."
    )


def fewest(sets: Sequence[Sequence[str]], what: str, rank: int, dof: int) -> str:
    """Which sets are the smallest that show as much as any."""
    if not rank:
        return f"No set of {what} shows any of the {dof} freedoms."
    more = len(sets) - MOST_SETS
    told = "; ".join(_joined(each, what) for each in sets[:MOST_SETS]) + (f"; {more} more sets" if more > 0 else "")
    return f"Fewest {what} that show {rank} of {dof}: {told}."


def where_lost(condition: str) -> str:
    """Where a freedom is lost."""
    return f"Where a freedom is lost: {condition}."


def home_error(wrong: dict[str, Any]) -> str:
    """How wrong the platform can be at the zero configuration (:func:`~..view.scale.error`)."""
    if wrong[wrong["unit"]] is not None:
        return f"At home the platform is then off by about {wrong['size']} per 0.1°."
    if wrong["words"] == LOST:
        return "At the zero configuration a freedom is lost, so that the error has no bound there."
    return f"The error of the platform is then {wrong['words']}."


def usual_error(found: Accuracy) -> list[str]:
    """How far the platform may be from where the directions say, over a map; nothing where it is not off at all."""
    field = found.field
    assert field is not None
    said = [
        f"{_median(values):.2g} {unit}"
        for values, unit in ((1e3 * field.position, "mm"), (np.degrees(field.orientation), "degrees"))
        if _median(values) > 0
    ]
    what = "Directions" if found.bounds.noise is None else "Measurements"
    words = (
        f"{what} wrong by {noise_words(found)} put the platform off by up to {' and '.join(said)} "
        "(median over the map below, to first order)."
    )
    return [words] if said else []


def noise_words(found: Accuracy) -> str:
    """How wrong measurements may be, for the map."""
    return (CONE_TEXT if found.bounds.noise is None else str(found.bounds.noise)).replace("deg", "°")


def alike(found: AssemblyModes) -> str | None:
    """How many poses look the same at home, None where these are a continuum or none was found."""
    if found.found.continuous_family is not None or not found.modes:
        return None
    far = "; a run that starts far away may end at another than its goal."
    if found.near_modes:
        return f"At home {found.alike}{far}"
    count = len(found.modes)
    words = f"At home {count} pose{'s have' if count > 1 else ' has'} the same {describe_held(found.setup)}"
    return f"{words} ({all_of(found)}){far if count > 1 else '.'}"


def elsewhere(found: AssemblyModes) -> str:
    """Where else the loop may stop: the other assembly modes, as they were listed."""
    if found.found.continuous_family is not None or found.self_motions:
        return "The loop may stop anywhere on a whole curve of poses at which the legs look the same."
    others: list[AssemblyMode] = [*(mode for mode in found.modes if not mode.goal), *found.near_modes]
    return _others(found, len(others), [mode for mode in others if mode.reachable is not False])


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
    away = sorted(distance_from(found.setup.motion, found.goal, mode) for mode in met)
    near, turn = away[0]
    far = f"{_length(near)} away" if near > SAME_RELATION else f"turned by {np.degrees(turn):.2g}°"
    where = f"one other pose, {far}" if len(met) == 1 else f"{_number(len(met))} other poses, the nearest {far}"
    if found.near_modes:
        where += f" (directions that differ by no more than {degrees(found.near_modes[-1].angle)})"
    return f"The loop may stop at {where}{'' if known else ', and perhaps at others that were not found'}."


def things(setup: ObservedRobot) -> str:
    """What sets are sets of."""
    return "legs" if all(o.by_segment for o in setup.observed) else "observations"


def describe_held(setup: ObservedRobot) -> str:
    """What assembly modes have in common."""
    return "observed directions" if things(setup) == "legs" else "measurements"


def _joined(labels: Sequence[str], what: str) -> str:
    return (f"leg{'s' * (len(labels) > 1)} " if what == "legs" else "") + ", ".join(labels)


def _median(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else 0.0


def _length(metres: float) -> str:
    if metres >= 1:
        return f"{metres:.2g} m"
    return f"{100 * metres:.2g} cm" if metres >= 0.01 else f"{1e3 * metres:.2g} mm"


def _number(count: int) -> str:
    return {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}.get(count, str(count))
