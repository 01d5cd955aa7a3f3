"""The plain answer of a report: what is seen, where that is lost, how many poses look alike, how far off one may be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...analysis.accuracy.accuracy import Accuracy
from ...analysis.controllability import Legs
from ...analysis.derive import Derivation
from ...analysis.observed import ObservedRobot
from ...analysis.verdict import Verdict
from ...geometry.vectors import Array
from ..text.poses import all_of
from ..text.robots import exact_cell, unseen
from .parts import CONE, Parts, Refused


def answer(found: Derivation, told: Parts) -> Iterator[str]:
    """A sentence for each question that has an answer."""
    yield describe_seen(found)
    if not isinstance(told.legs, Refused):
        yield enough(found, told.legs)
    if not isinstance(told.singularity, Refused):
        yield f"Where a freedom is lost: {told.singularity.words}."
    modes = told.modes
    if not isinstance(modes, Refused) and modes.found.continuum is None and modes.modes:
        count = len(modes.modes)
        yield (
            f"At home {modes.alike}; a run that starts far away may end at another than its goal."
            if modes.near
            else f"At home {count} pose{'s have' if count > 1 else ' has'} the same {describe_held(found.setting)} "
            f"({all_of(modes)})"
            + ("; a run that starts far away may end at another than its goal." if count > 1 else ".")
        )
    if not isinstance(told.accuracy, Refused):
        yield from errors(told.accuracy)


def describe_seen(found: Derivation) -> str:
    """How many freedoms are seen, and what is not."""
    verdict, watched = found.verdict, _legs(found.setting.labels, found.setting)
    if (bodies := verdict.formation) is not None:
        rest = "".join(f"; {each.name}" for each in bodies.flexes) or "; nothing else"
        return (
            f"Watching {watched} shows {verdict.rank} of the bodies' {found.dof} freedoms. Not seen: "
            f"{', '.join(bodies.trivial) or 'no trivial motion'}{rest}."
        )
    text = f"Watching {watched} shows {verdict.rank} of the platform's {found.dof} freedoms"
    return text + (f": not {verdict.named}" if verdict.lost else "") + "."


def enough(found: Derivation, legs: Legs) -> str:
    """Which sets of legs are the smallest that show as much as any."""
    best = max(each.rank for each in legs.sets)
    if not best:
        return f"No set of {things(found.setting)} shows any of the {found.dof} freedoms."
    sets = "; ".join(_legs(each, found.setting) for each in legs.minimal[:4])
    more = len(legs.minimal) - 4
    return (
        f"Fewest {things(found.setting)} that show {best} of {found.dof}: {sets}"
        + (f"; {more} more sets" if more > 0 else "")
        + "."
    )


def errors(found: Accuracy) -> Iterator[str]:
    """How far the platform may be from where the directions say."""
    field = found.field
    assert field is not None
    said = [
        f"{_median(values):.2g} {unit}"
        for values, unit in ((1e3 * field.position, "mm"), (np.degrees(field.orientation), "degrees"))
        if _median(values) > 0
    ]
    if said:
        what = "Directions" if found.blur.noise is None else "Measurements"
        yield (
            f"{what} wrong by {wrong(found)} put the platform off by up to {' and '.join(said)} "
            "(median over the map below, to first order)."
        )


def _median(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else 0.0


def wrong(found: Accuracy) -> str:
    """How wrong measurements may be, for the map."""
    return (CONE if found.blur.noise is None else str(found.blur.noise)).replace("deg", "°")


def things(setting: ObservedRobot) -> str:
    """What sets are sets of."""
    return "legs" if all(o.by_segment for o in setting.observed) else "observations"


def describe_held(setting: ObservedRobot) -> str:
    """What assembly modes have in common."""
    return "observed directions" if things(setting) == "legs" else "measurements"


def _legs(labels: tuple[str, ...] | list[str], setting: ObservedRobot) -> str:
    known = f"leg{'s' * (len(labels) > 1)} " if things(setting) == "legs" else ""
    return known + ", ".join(labels)


def good(found: Verdict) -> bool:
    """Whether all is seen that can be: of a formation all but its trivial motions."""
    return not found.lost and (found.rank == found.dof if found.formation is None else not found.formation.flexes)


def set_rows(found: Legs, most: int) -> Iterator[tuple[tuple[str, ...], Verdict, str, bool]]:
    """The sets of the table, ``most`` at most, those of one size that show all alike in one row; each with its verdict,
    what is known exactly, and whether it is among the smallest."""
    alike: dict[object, tuple[list[str], Verdict, str, bool]] = {}
    for each, exact in zip(found.sets[:most], found.exact, strict=False):
        cell, smallest = exact_cell(exact, each.rank), each.legs in found.minimal
        shown = (len(each.legs), each.verdict, each.rank, each.rank_at_zero, cell, smallest)
        key = each.legs if unseen(each) else shown
        alike.setdefault(key, ([], each, cell, smallest))[0].append(", ".join(each.legs))
    for sets, each, cell, smallest in alike.values():
        yield tuple(sets), each, cell, smallest
