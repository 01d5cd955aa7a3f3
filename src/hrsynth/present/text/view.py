"""The 3D view in text: what it shows, and where it is."""

from __future__ import annotations

from math import degrees

from ..view.view import View
from .tables import listing


def view(found: View, file: str | None = None) -> str:
    """What is drawn, how far the sliders go, and the page."""
    rows = [("robot", f"{found.setting.robot.name}   {found.machines[0].words}"),
            ("observed", ", ".join(f"{arrow.leg} ({arrow.link})" for arrow in found.arrows) or "nothing")]
    rows += [("hidden robot", machine.words) for machine in found.machines[1:]]
    for number, slider in enumerate(found.sliders):
        low, high = slider.values[0], slider.values[-1]
        ends = f"{degrees(low):.3g}° to {degrees(high):.3g}°" if slider.unit == "rad" else f"{low:.4g} to {high:.4g} m"
        rows.append(("" if number else "sliders", f"{slider.name}: {ends}, {len(slider.values)} closed configurations"))
    if found.ghosts:
        rows.append(("other modes", ", ".join(ghost.label for ghost in found.ghosts)))
    rows += [("note", note) for note in found.notes]
    return listing(rows if file is None else [*rows, ("page", file)])
