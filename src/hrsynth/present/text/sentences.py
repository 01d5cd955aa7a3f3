"""Summary in sentences for the studio, the report and the pages of the catalog: legs to observe, rank, singularities,
error of the platform, other poses at which the loop may stop."""

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
"""Largest number of smallest sets that are listed."""


def which(verdict: Verdict) -> str:
    """Name the legs to observe."""
    legs = name_all("leg", verdict.legs)
    if verdict == CONTROLLABLE:
        return f"Observe {legs}."
    if not verdict.dof:
        return "The platform cannot move: there is nothing to control."
    if not verdict.rank:
        return "Observing the legs is useless: their directions do not change with the platform at any sample."
    lost = len(verdict.unobserved)
    return (
        f"Observing legs is not enough: even with all of them {lost} of {verdict.dof} dof "
        f"{'is' if lost == 1 else 'are'} unobserved at all samples: {verdict.named}."
    )


def blind(verdict: Verdict) -> list[str]:
    """Describe what to do if a dof is unobserved."""
    if not verdict.dof:
        return []
    legs = name_all("leg", verdict.legs)
    seen = f"{legs[0].upper()}{legs[1:]} show{'s' * (len(verdict.legs) == 1)} as many dof as all legs together."
    return [
        seen if verdict.rank else "However accurate the directions are, they do not depend on the platform.",
        "Another sensor is needed: the command advise lists suggestions.",
    ]


def describe_seen(verdict: Verdict, labels: Sequence[str], setup: ObservedRobot) -> str:
    """Describe the observed and the unobserved dof."""
    if (bodies := verdict.formation) is not None:
        rest = "".join(f"; {each.name}" for each in bodies.flexes) or "; nothing else"
        return (
            f"Observing {_joined(labels, things(setup))} shows {verdict.rank} of the {verdict.dof} dof of the links. "
            f"Unobserved: {', '.join(bodies.trivial) or 'no trivial motion'}{rest}."
        )
    unseen = verdict.named if verdict.unobserved else ""
    return shows(labels, things(setup), verdict.rank, verdict.dof, unseen)


def shows(labels: Sequence[str], what: str, rank: int, dof: int, unseen: str = "") -> str:
    """Describe the number of platform dof that the observations with these labels show."""
    return f"Observing {_joined(labels, what)} shows {rank} of {dof} platform dof" + (
        f"; unobserved: {unseen}." if unseen else "."
    )


def fewest(sets: Sequence[Sequence[str]], what: str, rank: int, dof: int) -> str:
    """List the smallest sets of the best rank."""
    if not rank:
        return f"No set of {what} shows any of the {dof} dof."
    more = len(sets) - MOST_SETS
    told = "; ".join(_joined(each, what) for each in sets[:MOST_SETS]) + (f"; {more} more sets" if more > 0 else "")
    return f"Smallest sets of {what} that show {rank} of {dof} dof: {told}."


def where_lost(condition: str) -> str:
    """State the condition of Type 2 singularities."""
    return f"Type 2 singularities: {condition}."


def home_error(wrong: dict[str, Any]) -> str:
    """Describe the error of the platform at the zero configuration (:func:`~..view.scale.error`)."""
    if wrong[wrong["unit"]] is not None:
        return f"At the zero configuration, 0.1° of direction error moves the platform by about {wrong['size']}."
    if wrong["words"] == LOST:
        return "The zero configuration is a Type 2 singularity, where the error is unbounded."
    return f"The error of the platform is {wrong['words']}."


def usual_error(found: Accuracy) -> list[str]:
    """Describe the median error of the platform over a map; nothing if there is none."""
    field = found.field
    assert field is not None
    said = [
        f"{_median(values):.2g} {unit}"
        for values, unit in ((1e3 * field.position, "mm"), (np.degrees(field.orientation), "deg"))
        if _median(values) > 0
    ]
    what = "Directions" if found.bounds.noise is None else "Measurements"
    words = (
        f"{what[:-1]} errors of {noise_words(found)} move the platform by up to {' and '.join(said)} "
        "(median over the map below, to first order)."
    )
    return [words] if said else []


def noise_words(found: Accuracy) -> str:
    """Format the measurement errors of the map."""
    return (CONE_TEXT if found.bounds.noise is None else str(found.bounds.noise)).replace("deg", "°")


def alike(found: AssemblyModes) -> str | None:
    """Describe the number of poses that look the same as the zero configuration; None if a family or none was found."""
    if found.found.continuous_family is not None or not found.modes:
        return None
    far = "; a run that starts far away may end at another pose than its goal."
    if found.near_modes:
        return f"At the zero configuration, {found.alike}{far}"
    count = len(found.modes)
    what = f"pose{'s have' if count > 1 else ' has'} the same {describe_held(found.setup)}"
    words = f"At the zero configuration, {count} {what}"
    return f"{words} ({all_of(found)}){far if count > 1 else '.'}"


def elsewhere(found: AssemblyModes) -> str:
    """Describe the other poses at which the loop may stop: the assembly modes that were listed."""
    if found.found.continuous_family is not None or found.self_motions:
        return "The loop may stop anywhere on a curve of poses at which the legs look the same."
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
        return f"{words}." if known else f"{words}; others are not excluded."
    away = sorted(distance_from(found.setup.motion, found.goal, mode) for mode in met)
    near, turn = away[0]
    far = f"{_length(near)} away" if near > SAME_RELATION else f"rotated by {np.degrees(turn):.2g}°"
    where = f"one other pose, {far}" if len(met) == 1 else f"{_number(len(met))} other poses, the nearest {far}"
    if found.near_modes:
        where += f" (directions that differ by no more than {degrees(found.near_modes[-1].angle)})"
    return f"The loop may stop at {where}{'' if known else ', others are not excluded'}."


def things(setup: ObservedRobot) -> str:
    """Return "legs", or "observations" if others than legs are observed."""
    return "legs" if all(o.by_segment for o in setup.observed) else "observations"


def describe_held(setup: ObservedRobot) -> str:
    """Name the fixed values of assembly modes."""
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
