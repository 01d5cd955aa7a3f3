"""All endings of a loop in text."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from ...analysis.modes.near import degrees, measurement_bound
from ...tolerances import MEASUREMENT_BOUND
from .poses import all_of
from .tables import GAP, Rows, camera, head, listing, name_all, table

if TYPE_CHECKING:
    from ...simulation.equilibria.equilibrium import CompletenessReport, Equilibria, Equilibrium, SignedModes

LISTED_SADDLES = 12
"""Rests that do not attract which are told one by one."""


def equilibria(found: Equilibria) -> str:
    """The goal, the rests that attract, some of those that do not, and whether that is all."""
    drawn = [each for each in found.points if each.stability in ("stable", "undecided")]
    others = [each for each in found.points if each.stability not in ("stable", "undecided")]
    boxed = [each for each in found.points if each.proved]
    rows: Rows = [
        *head(found.setup),
        *camera(found.setup),
        ("goal", str(found.pose)),
        *([] if found.depth == "exact" else [("depth", f"{found.depth}, as the law assumes it")]),
        *GAP,
        ("attract", table(_lines(drawn)[0], HEADS).splitlines()),
        *GAP,
    ]
    if any(each.beyond_limits for each in drawn):
        inside = [each for each in drawn if not each.beyond_limits]
        rows[-1:] = [
            (
                "",
                f"within all limits of joints {len(inside)} of these {len(drawn)}"
                + (": the goal alone" if [each.kind for each in inside] == ["goal"] else ""),
            ),
            *GAP,
        ]
    if others:
        lines, counts = _lines(others)
        left = sum(counts[LISTED_SADDLES:])
        told = table(lines[:LISTED_SADDLES], HEADS).splitlines()
        rows += [("do not", [*told, *([f"and {left} more (--json lists them)"] if left > 0 else [])]), *GAP]
    rows += [("enclosed", _describe_enclosed(found, boxed)), *GAP]
    rows += [("continua", [f"‖e‖ = {each.error:.3g}, {each.stability}{_why(each)}" for each in found.families])]
    rows += [
        (
            "all",
            [
                *(_signs(each, found) for each in found.lists if _are_met(each)),
                *_others(found, [each for each in found.lists if not _are_met(each)]),
                *_complete(found),
            ],
        )
    ]
    return listing(rows)


HEADS = ("kind", "‖e‖", "", "pose", "")


def _are_met(each: SignedModes) -> bool:
    """Whether there are poses with these legs reversed."""
    return each.listed is not None or bool(each.boxes)


def _others(found: Equilibria, unmet: list[SignedModes]) -> list[str]:
    """The choices of reversed legs at which no pose was met."""
    proved = sum(each.empty for each in unmet)
    if not unmet:
        return []
    what = (
        f"{name_all('leg', unmet[0].reversed)} reversed"
        if len(unmet) == 1
        else f"{len(unmet)} other choices of reversed legs"
    )
    if proved < len(unmet):
        return [f"poses with {what}: none found, not proved"]
    return [f"poses with {what}: none, proved by boxes of poses{_turned(found, unmet[0].turns)}"]


def _complete(found: Equilibria) -> list[str]:
    """Whether the list is all, or how it was sought."""
    if found.subdivision is None:
        return [f"the others are found, not proved to be all: {found.search.words}"]
    if not found.subdivision.complete:
        return [
            f"the others are found, not proved to be all: {found.search.words}",
            found.subdivision.reason,
            *_alone(found.subdivision),
        ]
    told, turns = found.subdivision, len(found.subdivision.result.turns)
    where = (
        "wherever the legs reach"
        if told.within is None
        else f"with the point within {told.within:.3g} m of the goal's either way"
    )
    if told.result.struts is not None:
        where += f", while the platform translates, in {'the one turn' if turns == 1 else f'each of the {turns} turns'}"
        where += " in which it can"
    else:
        where += _turned(found)
    where += "" if told.shorter is None else f", no rod shorter than {1e3 * told.shorter:.3g} mm"
    apart = [f"the joints of {name_all('leg', told.result.unread)} lock"] if told.result.unread else []
    if told.unstretched is not None:
        apart += [f"leg {' or '.join(told.unstretched)} is stretched or has no length"] if told.unstretched else []
        apart += [
            "a watched direction is at right angles to the desired one"
            if told.orthogonal_directions == 1
            else "both watched directions are at right angles to the desired ones"
        ]
    where += f", except for poses at which {', or '.join(apart)}" if apart else ""
    lines = [
        f"all rests, proved by {told.result.boxes:,} boxes of poses: no other in any working mode of the legs, {where}"
    ]
    if told.crossings:
        lines += [f"except for rests that fill curves, at {told.crossings} points at which the joints of two legs lock"]
    if told.locked:
        most = max(within for _, within in told.locked)
        lines += [
            f"except for {len(told.locked)} places, each within {1e3 * most:.2g} mm, at which legs may lock each other:"
        ]
        places = max(0, math.ceil(-math.log10(most)))
        lines += [f"  ({', '.join(f'{round(float(x), places) + 0.0:g}' for x in p)}) m" for p, _ in told.locked]
    if told.outside_searched:
        lines += [f"{told.outside_searched} of the list lie where nothing was searched"]
    return [*lines, *_alone(told)]


def _alone(cover: CompletenessReport) -> list[str]:
    """Critical poses that boxes alone prove, those at which E is least around first."""
    some = sorted(cover.only_proved, key=lambda each: each.stability in ("saddle", "unstable"))
    left = len(some) - LISTED_SADDLES
    return [
        *(
            [
                f"{len(some)} critical poses that boxes prove are not listed above, as the robot could not be closed "
                "there or the command as computed does not vanish (so where joints lock):"
            ]
            if some
            else []
        ),
        *(f"  {each.stability} at {each.pose}, ‖e‖ = {each.error[0]:.3g}" for each in some[:LISTED_SADDLES]),
        *([f"  and {left} more (--json lists them)"] if left > 0 else []),
    ]


def _describe_enclosed(found: Equilibria, boxed: list[Equilibrium]) -> list[str]:
    """How many are enclosed, and what that says."""
    if not boxed:
        return []
    wide = max(each.shift for each in boxed), max(each.turn for each in boxed)
    what = "the loops" if not found.measured else f"the loops, of {', '.join(found.measured)} as far as independent"
    return [
        f"{len(boxed)} of {len(found.points)}: each the only rest in a box of joint coordinates, proved for {what}",
        f"which puts it within {1e3 * wide[0]:.1g} mm and {wide[1]:.1g} rad; whether it attracts is proved for "
        f"{sum(each.decided for each in boxed)}",
    ]


def _lines(rests: list[Equilibrium]) -> tuple[list[list[str]], list[int]]:
    """A row a rest, and one, with their number, of those whose rows would be equal: rods point the other way, or other
    links stand elsewhere, as rests with the same poses and measurements are one."""
    rows = Counter(tuple(_line(each)) for each in rests)
    return [
        [*row, notes if count == 1 else f"{notes}{'; ' * bool(notes)}{count} rests, whose links stand differently"]
        for (*row, notes), count in rows.items()
    ], list(rows.values())


def _line(each: Equilibrium) -> list[str]:
    notes = []
    if each.singular is not None and not each.orthogonal_legs:
        notes.append(each.singular.split(": " if each.boundary else "vanishes ")[-1])
    if each.reversed:
        notes.append(f"{name_all('leg', each.reversed)} reversed")
    if each.orthogonal_legs:
        notes.append(f"{name_all('leg', each.orthogonal_legs)} at right angles")
    if each.working_modes > 1:
        notes.append(f"in {each.working_modes} working modes")
    if each.side == "other":
        notes.append("in another aspect")
    if each.legs_in_other_mode:
        notes.append(f"{name_all('leg', each.legs_in_other_mode)} in another working mode")
    if each.beyond_limits:
        notes.append(f"beyond the limits of {', '.join(each.beyond_limits)}")
    if each.kind == "critical" and each.stable and each.error <= measurement_bound(MEASUREMENT_BOUND):
        notes.append(f"a near mode: no direction differs by more than {degrees(each.error)}")
    if each.convergence_rates and each.kind == "critical":
        notes.append(f"rates {', '.join(f'{(low + high) / 2:.3g}' for low, high in each.convergence_rates)}")
    return [
        each.kind,
        f"{each.error:.3g}" if each.kind == "critical" else "0",
        each.stability,
        str(each.pose),
        "; ".join(notes),
    ]


def _signs(each: SignedModes, found: Equilibria) -> str:
    what = "directions" if all(o.by_segment for o in found.setup.observed) else "measurements"
    which = f"with {name_all('leg', each.reversed)} reversed" if each.reversed else f"with the desired {what}"
    if each.listed is None:
        return f"poses {which}: found, not listed"
    if each.boxes is not None and not each.listed.found.complete:
        return f"poses {which}: {each.boxes}, proved to be all by boxes of poses{_turned(found, each.turns)}"
    more = each.turns > 1 and each.boxes is not None
    return f"poses {which}: {each.listed.count}, {all_of(each.listed)}" + (
        f"; {each.boxes} in the {each.turns} turns in which the platform translates" if more else ""
    )


def _turned(found: Equilibria, turns: int = 1) -> str:
    """How a platform that only translates is turned where boxes looked; empty where it turns."""
    if found.setup.motion.rotations.shape[1]:
        return ""
    return (
        ", with the platform turned as at the goal"
        if turns == 1
        else f", in the {turns} turns in which the platform translates"
    )


def _why(each: Equilibrium) -> str:
    return (
        f", {name_all('leg', each.orthogonal_legs)} at right angles to the desired directions"
        if each.orthogonal_legs
        else ""
    )
