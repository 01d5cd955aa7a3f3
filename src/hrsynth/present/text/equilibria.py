"""Equilibria of a servo loop in text."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from ...analysis.modes.near_modes import format_degrees, parse_measurement_bound
from ...tolerances import MEASUREMENT_BOUND
from .poses import describe_completeness
from .tables import GAP, Rows, format_camera_rows, format_head_rows, format_listing, format_table, name_all

if TYPE_CHECKING:
    from ...simulation.equilibria.equilibrium import CompletenessReport, Equilibria, Equilibrium, SignedModes

SADDLES_PRINTED_MAX = 12
"""Number of equilibria that are not stable up to which each is printed."""


def format_equilibria(found: Equilibria) -> str:
    """Return the goal, the stable equilibria, some of the others, and what is known of completeness."""
    drawn = [each for each in found.points if each.stability in ("stable", "undecided")]
    others = [each for each in found.points if each.stability not in ("stable", "undecided")]
    boxed = [each for each in found.points if each.proved]
    rows: Rows = [
        *format_head_rows(found.setup),
        *format_camera_rows(found.setup),
        ("goal", str(found.pose)),
        *([] if found.depth == "exact" else [("depth", f"{found.depth}, as the control law assumes it")]),
        *GAP,
        ("stable", format_table(_group_lines(drawn)[0], HEADS).splitlines()),
        *GAP,
    ]
    if any(each.beyond_limits for each in drawn):
        inside = [each for each in drawn if not each.beyond_limits]
        rows[-1:] = [
            (
                "",
                f"within all joint limits: {len(inside)} of these {len(drawn)}"
                + (" (the goal only)" if [each.kind for each in inside] == ["goal"] else ""),
            ),
            *GAP,
        ]
    if others:
        lines, counts = _group_lines(others)
        left = sum(counts[SADDLES_PRINTED_MAX:])
        told = format_table(lines[:SADDLES_PRINTED_MAX], HEADS).splitlines()
        rows += [("other", [*told, *([f"and {left} more (--json lists them)"] if left > 0 else [])]), *GAP]
    rows += [("enclosures", _describe_enclosed(found, boxed)), *GAP]
    rows += [("families", [f"‖e‖ = {each.error:.3g}, {each.stability}{_explain_row(each)}" for each in found.families])]
    rows += [
        (
            "all",
            [
                *(_describe_signs(each, found) for each in found.lists if _has_poses(each)),
                *_list_unmet_choices(found, [each for each in found.lists if not _has_poses(each)]),
                *_describe_completeness(found),
            ],
        )
    ]
    return format_listing(rows)


HEADS = ("kind", "‖e‖", "", "pose", "")


def _has_poses(each: SignedModes) -> bool:
    """Return True if there are poses with these legs reversed."""
    return each.listed is not None or bool(each.boxes)


def _list_unmet_choices(found: Equilibria, unmet: list[SignedModes]) -> list[str]:
    """Describe the combinations of reversed legs without any pose."""
    proved = sum(each.is_proved_empty for each in unmet)
    if not unmet:
        return []
    what = (
        f"{name_all('leg', unmet[0].reversed)} reversed"
        if len(unmet) == 1
        else f"{len(unmet)} other combinations of reversed legs"
    )
    if proved < len(unmet):
        return [f"poses with {what}: none found, not proved"]
    return [f"poses with {what}: none, proved by boxes of poses{_describe_rotations(found, unmet[0].turns)}"]


def _describe_completeness(found: Equilibria) -> list[str]:
    """Describe the proof that the list is complete, or how the list was searched."""
    if found.subdivision is None:
        return [f"the other equilibria are found, not proved to be all: {found.search.words}"]
    if not found.subdivision.complete:
        return [
            f"the other equilibria are found, not proved to be all: {found.search.words}",
            found.subdivision.reason,
            *_list_only_proved(found.subdivision),
        ]
    told, turns = found.subdivision, len(found.subdivision.result.turns)
    where = (
        "wherever the legs reach"
        if told.within is None
        else f"with each coordinate of the point within {told.within:.3g} m of that at the goal"
    )
    if told.result.struts is not None:
        where += ", while the platform translates, in "
        where += f"{'the only orientation' if turns == 1 else f'all {turns} orientations'} in which it can"
    else:
        where += _describe_rotations(found)
    where += "" if told.shorter is None else f", no rod shorter than {1e3 * told.shorter:.3g} mm"
    apart = [f"the joints of {name_all('leg', told.result.unread)} lock"] if told.result.unread else []
    if told.unstretched is not None:
        apart += [f"leg {' or '.join(told.unstretched)} is stretched or has length zero"] if told.unstretched else []
        apart += [
            "an observed direction is orthogonal to the desired one"
            if told.orthogonal_directions == 1
            else "both observed directions are orthogonal to the desired ones"
        ]
    where += f", except for poses at which {', or '.join(apart)}" if apart else ""
    lines = [
        f"all equilibria, proved by {told.result.boxes:,} boxes of poses: no other in any working mode of the legs, "
        + where
    ]
    if told.crossings:
        lines += [f"except for continuous families, at {told.crossings} points where the joints of two legs lock"]
    if told.locked:
        most = max(within for _, within in told.locked)
        lines += [
            f"except for {len(told.locked)} positions, each within {1e3 * most:.2g} mm, where legs may lock each other:"
        ]
        places = max(0, math.ceil(-math.log10(most)))
        lines += [f"  ({', '.join(f'{round(float(x), places) + 0.0:g}' for x in p)}) m" for p, _ in told.locked]
    if told.outside_searched:
        lines += [f"{told.outside_searched} of the list lie outside the searched region"]
    return [*lines, *_list_only_proved(told)]


def _list_only_proved(cover: CompletenessReport) -> list[str]:
    """Describe the critical poses that only the boxes prove, minima of E first."""
    some = sorted(cover.only_proved, key=lambda each: each.stability in ("saddle", "unstable"))
    left = len(some) - SADDLES_PRINTED_MAX
    return [
        *(
            [
                f"{len(some)} critical poses that boxes prove are not listed above: the robot was not assembled there, "
                "or the computed command does not vanish (where joints lock):"
            ]
            if some
            else []
        ),
        *(f"  {each.stability} at {each.pose}, ‖e‖ = {each.error[0]:.3g}" for each in some[:SADDLES_PRINTED_MAX]),
        *([f"  and {left} more (--json lists them)"] if left > 0 else []),
    ]


def _describe_enclosed(found: Equilibria, boxed: list[Equilibrium]) -> list[str]:
    """Describe the enclosures: number, size, proved stability."""
    if not boxed:
        return []
    wide = max(each.shift for each in boxed), max(each.turn for each in boxed)
    what = "" if not found.measured else f" with the independent equations of {', '.join(found.measured)}"
    return [
        f"{len(boxed)} of {len(found.points)} equilibria, each unique within {1e3 * wide[0]:.1g} mm and "
        f"{wide[1]:.1g} rad (proved{what}); stability proved for {sum(each.decided for each in boxed)}"
    ]


def _group_lines(rests: list[Equilibrium]) -> tuple[list[list[str]], list[int]]:
    """Return a row per equilibrium; those with equal rows share one, with their number: they differ in unobserved rods
    or other links."""
    rows = Counter(tuple(_format_line(each)) for each in rests)
    return [
        [
            *row,
            notes
            if count == 1
            else f"{notes}{'; ' * bool(notes)}{count} equilibria with different poses of other links",
        ]
        for (*row, notes), count in rows.items()
    ], list(rows.values())


def _format_line(each: Equilibrium) -> list[str]:
    notes = []
    if each.singular is not None and not each.orthogonal_legs:
        notes.append(each.singular.split(": " if each.boundary else "vanishes ")[-1])
    if each.reversed:
        notes.append(f"{name_all('leg', each.reversed)} reversed")
    if each.orthogonal_legs:
        notes.append(f"{name_all('leg', each.orthogonal_legs)} orthogonal to the desired directions")
    if each.working_modes > 1:
        notes.append(f"in {each.working_modes} working modes")
    if each.side == "other":
        notes.append("in another aspect")
    if each.legs_in_other_mode:
        notes.append(f"{name_all('leg', each.legs_in_other_mode)} in another working mode")
    if each.beyond_limits:
        notes.append(f"beyond joint limits: {', '.join(each.beyond_limits)}")
    if each.kind == "critical" and each.stable and each.error <= parse_measurement_bound(MEASUREMENT_BOUND):
        notes.append(f"near mode: directions differ by at most {format_degrees(each.error)}")
    if each.convergence_rates and each.kind == "critical":
        notes.append(
            f"convergence rates {', '.join(f'{(low + high) / 2:.3g}' for low, high in each.convergence_rates)}"
        )
    return [
        each.kind,
        f"{each.error:.3g}" if each.kind == "critical" else "0",
        each.stability,
        str(each.pose),
        "; ".join(notes),
    ]


def _describe_signs(each: SignedModes, found: Equilibria) -> str:
    what = "directions" if all(o.is_segment_direction for o in found.setup.observed) else "measurements"
    which = f"with {name_all('leg', each.reversed)} reversed" if each.reversed else f"with the desired {what}"
    if each.listed is None:
        return f"poses {which}: found, not listed"
    if each.boxes is not None and not each.listed.found.complete:
        return (
            f"poses {which}: {each.boxes}, proved to be all by boxes of poses{_describe_rotations(found, each.turns)}"
        )
    more = each.turns > 1 and each.boxes is not None
    return f"poses {which}: {each.listed.count}, {describe_completeness(each.listed)}" + (
        f"; {each.boxes} in the {each.turns} orientations in which the platform translates" if more else ""
    )


def _describe_rotations(found: Equilibria, turns: int = 1) -> str:
    """Describe the orientations that the boxes cover, of a platform that only translates; empty if it rotates."""
    if found.setup.motion.rotations.shape[1]:
        return ""
    return (
        ", in the orientation of the goal"
        if turns == 1
        else f", in the {turns} orientations in which the platform translates"
    )


def _explain_row(each: Equilibrium) -> str:
    return (
        f", {name_all('leg', each.orthogonal_legs)} orthogonal to the desired directions"
        if each.orthogonal_legs
        else ""
    )
