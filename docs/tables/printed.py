"""The tables of forms and of assembly modes that the papers print, with those that are computed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache

from hrsynth.analysis.derive import derive
from hrsynth.analysis.modes.assembly_mode import AssemblyMode
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.description import list_robots, load

from .markdown import table as markdown
from .printed_claims import CLAIMS, FORMS, Place, PrintedClaim, PrintedForm

START = "<!-- generated: printed modes -->"
HEADS = ("source", "robot", "legs", "printed x, y, z (φ = 0)", "computed x, y, z; φ", "distance", "remark")

FORMS_START = "<!-- generated: printed forms -->"
FORMS_HEADS = ("source", "real", "hidden, as printed", "robot", "legs", "derived", "as printed?")


def forms_table() -> str:
    """Return the Markdown table of printed forms, each with the derived hidden robot."""
    return markdown(FORMS_HEADS, map(form_row, FORMS))


def form_row(form: PrintedForm) -> tuple[str, ...]:
    """Return the row of one printed form."""
    found = str(derive(load(list_robots()[form.robot]), form.legs, unchecked=False).hidden_architecture)
    same = any(found in (each, f"{found.partition('-')[0]}-{each}") for each in form.hidden)
    return (
        form.source,
        form.real,
        " or ".join(form.hidden),
        f"`{form.robot}`",
        ", ".join(form.legs) if form.legs else "all",
        found,
        "yes" if same else "no",
    )


@cache
def compute_modes(claim: PrintedClaim) -> AssemblyModes:
    """Compute all modes with the directions that the claim's legs have at its desired pose."""
    return modes(load(list_robots()[claim.robot]), claim.legs, at=claim.at)


def nearest(place: Place, found: AssemblyModes) -> AssemblyMode:
    """Return the mode nearest to a printed one."""
    return min(found.modes, key=lambda mode: math.dist(place, _place(mode)))


def table() -> str:
    """Return the Markdown table of all claims: each printed pose with the nearest mode, then the modes not printed."""
    return markdown(HEADS, (row for claim in CLAIMS for row in _rows(claim)))


def _rows(claim: PrintedClaim) -> Iterator[tuple[str, ...]]:
    found = compute_modes(claim)
    head = (claim.source, f"`{claim.robot}`", ", ".join(claim.legs))
    met = []
    for each in claim.modes:
        mode = nearest(each.place, found)
        met.append(mode)
        distance = 1e3 * math.dist(each.place, _place(mode))
        yield (*head, ", ".join(f"{v:g}" for v in each.place), _write_place(mode), f"{distance:.0f} mm", each.remark)
    for mode in found.modes:
        if mode not in met:
            reached = f"; legs {', '.join(mode.unclosed_legs)} do not reach it" if mode.reachable is False else ""
            yield (*head, "–", _write_place(mode), "–", f"not printed{reached}")


def _place(mode: AssemblyMode) -> Place:
    pose = mode.pose
    assert pose.x is not None
    assert pose.y is not None
    assert pose.z is not None
    return pose.x, pose.y, pose.z


def _write_place(mode: AssemblyMode) -> str:
    """Return a position to a tenth of a millimetre and the rotation about z to a degree."""
    assert mode.pose.rpy is not None
    turn = round(math.degrees(mode.pose.rpy[2])) % 360
    return f"{', '.join(f'{round(v, 4) + 0.0:.4f}' for v in _place(mode))}; {turn}°"
