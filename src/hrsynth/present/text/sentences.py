"""Summary in sentences for the studio, the report and the pages of the catalog: legs to observe, rank, singularities,
error of the platform, other poses at which the loop may stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...analysis.accuracy.accuracy import Accuracy
from ...analysis.modes.assembly_mode import AssemblyMode
from ...analysis.modes.modes import AssemblyModes
from ...analysis.modes.near_modes import format_degrees, measure_distance
from ...analysis.observed import ObservedRobot
from ...analysis.verdict import CONTROLLABLE, Verdict
from ...geometry.vectors import Array
from ...tolerances import RELATION_ANGLE_TOL
from ..view.scale import CONE_TEXT, LOST
from .poses import describe_completeness
from .tables import name_all

SMALLEST_SETS_PRINTED_MAX = 4
"""Largest number of smallest sets that are listed."""


def describe_choice(verdict: Verdict) -> str:
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


def describe_blindness(verdict: Verdict) -> list[str]:
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
            f"Observing {_join_labels(labels, name_set_members(setup))} shows {verdict.rank} of the "
            f"{verdict.dof} dof of the links. Unobserved: {', '.join(bodies.trivial) or 'no trivial motion'}{rest}."
        )
    unseen = verdict.named if verdict.unobserved else ""
    return describe_observation(labels, name_set_members(setup), verdict.rank, verdict.dof, unseen)


def describe_observation(labels: Sequence[str], what: str, rank: int, dof: int, unseen: str = "") -> str:
    """Describe the number of platform dof that the observations with these labels show."""
    return f"Observing {_join_labels(labels, what)} shows {rank} of {dof} platform dof" + (
        f"; unobserved: {unseen}." if unseen else "."
    )


def describe_smallest_sets(sets: Sequence[Sequence[str]], what: str, rank: int, dof: int) -> str:
    """List the smallest sets of the best rank."""
    if not rank:
        return f"No set of {what} shows any of the {dof} dof."
    more = len(sets) - SMALLEST_SETS_PRINTED_MAX
    told = "; ".join(_join_labels(each, what) for each in sets[:SMALLEST_SETS_PRINTED_MAX]) + (
        f"; {more} more sets" if more > 0 else ""
    )
    return f"Smallest sets of {what} that show {rank} of {dof} dof: {told}."


def describe_locus(condition: str) -> str:
    """State the condition of Type 2 singularities."""
    return f"Type 2 singularities: {condition}."


def describe_zero_error(wrong: dict[str, Any]) -> str:
    """Describe the error of the platform at the zero configuration (:func:`~..view.scale.describe_pose_error`)."""
    if wrong[wrong["unit"]] is not None:
        return f"At the zero configuration, 0.1° of direction error moves the platform by about {wrong['size']}."
    if wrong["words"] == LOST:
        return "The zero configuration is a Type 2 singularity, where the error is unbounded."
    return f"The error of the platform is {wrong['words']}."


def describe_map_error(found: Accuracy) -> list[str]:
    """Describe the median error of the platform over a map; nothing if there is none."""
    field = found.field
    assert field is not None
    said = [
        f"{_compute_median(values):.2g} {unit}"
        for values, unit in ((1e3 * field.position, "mm"), (np.degrees(field.orientation), "deg"))
        if _compute_median(values) > 0
    ]
    what = "Directions" if found.bounds.noise is None else "Measurements"
    words = (
        f"{what[:-1]} errors of {describe_noise(found)} move the platform by up to {' and '.join(said)} "
        "(median over the map below, to first order)."
    )
    return [words] if said else []


def describe_noise(found: Accuracy) -> str:
    """Format the measurement errors of the map."""
    return (CONE_TEXT if found.bounds.noise is None else str(found.bounds.noise)).replace("deg", "°")


def describe_similar_poses(found: AssemblyModes) -> str | None:
    """Describe the number of poses that look the same as the zero configuration; None if a family or none was found."""
    if found.found.continuous_family is not None or not found.modes:
        return None
    far = "; a run that starts far away may end at another pose than its goal."
    if found.near_modes:
        return f"At the zero configuration, {found.alike}{far}"
    count = len(found.modes)
    what = f"pose{'s have' if count > 1 else ' has'} the same {describe_held(found.setup)}"
    words = f"At the zero configuration, {count} {what}"
    return f"{words} ({describe_completeness(found)}){far if count > 1 else '.'}"


def describe_other_equilibria(found: AssemblyModes) -> str:
    """Describe the other poses at which the loop may stop: the assembly modes that were listed."""
    if found.found.continuous_family is not None or found.self_motions:
        return "The loop may stop anywhere on a curve of poses at which the legs look the same."
    others: list[AssemblyMode] = [*(mode for mode in found.modes if not mode.goal), *found.near_modes]
    return _describe_others(found, len(others), [mode for mode in others if mode.reachable is not False])


def _describe_others(found: AssemblyModes, count: int, met: list[AssemblyMode]) -> str:
    known = found.found.complete
    if not met:
        if count:
            there = f"{_format_count(count)} other pose{'s' * (count > 1)}"
            words = f"The legs look the same at {there}, but the robot does not reach {'them' if count > 1 else 'it'}"
        else:
            words = (
                f"No other pose has the same directions ({describe_completeness(found)})"
                if known
                else ("No other pose was found at which the legs look the same")
            )
        return f"{words}." if known else f"{words}; others are not excluded."
    away = sorted(measure_distance(found.setup.motion, found.goal, mode) for mode in met)
    near, turn = away[0]
    far = f"{_format_length(near)} away" if near > RELATION_ANGLE_TOL else f"rotated by {np.degrees(turn):.2g}°"
    where = f"one other pose, {far}" if len(met) == 1 else f"{_format_count(len(met))} other poses, the nearest {far}"
    if found.near_modes:
        where += f" (directions that differ by no more than {format_degrees(found.near_modes[-1].angle)})"
    return f"The loop may stop at {where}{'' if known else ', others are not excluded'}."


def name_set_members(setup: ObservedRobot) -> str:
    """Return "legs", or "observations" if others than legs are observed."""
    return "legs" if all(o.is_segment_direction for o in setup.observed) else "observations"


def describe_held(setup: ObservedRobot) -> str:
    """Name the fixed values of assembly modes."""
    return "observed directions" if name_set_members(setup) == "legs" else "measurements"


def _join_labels(labels: Sequence[str], what: str) -> str:
    return (f"leg{'s' * (len(labels) > 1)} " if what == "legs" else "") + ", ".join(labels)


def _compute_median(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else 0.0


def _format_length(metres: float) -> str:
    if metres >= 1:
        return f"{metres:.2g} m"
    return f"{100 * metres:.2g} cm" if metres >= 0.01 else f"{1e3 * metres:.2g} mm"


def _format_count(count: int) -> str:
    return {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}.get(count, str(count))
