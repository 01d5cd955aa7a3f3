"""Sets of legs for a displacement in text: a table of those that are kept, the reasons of the others."""

from __future__ import annotations

import numpy as np

from ...selection.candidate import Candidate, Modes
from ...selection.select import Selection
from .tables import listing, table


def selection(found: Selection) -> str:
    """The displacement, the table, the reasons."""
    setting = found.setting
    cones = dict.fromkeys(f"{np.degrees(cone):.4g}°" for cone in found.cones)
    angle = next(iter(cones)) if len(cones) == 1 else ", ".join(
        f"{o.leg} {np.degrees(cone):.4g}°" for o, cone in zip(setting.observed, found.cones, strict=True))
    rows = [("robot", f"{setting.robot.name}   {setting.anatomy.architecture()}"), ("from", str(found.start)),
            ("to", str(found.goal)), ("cones", f"{angle} about each direction"),
            ("sets", f"{len(found.candidates)}, kept: {len(found.kept)}, the most accurate first")]
    if found.unexamined:
        rows.append(("", f"not examined: {len(found.unexamined)} ({found.left})"))
    if found.sight is not None:
        rows.append(("camera", f"on {found.sight.reference}"))
    blocks = [listing(rows)]
    if found.kept:
        heads = ["legs", "mm", "degrees", "modes", "aspect", *(["seen"] if found.sight else []), "run"]
        blocks.append(table([_row(each, found.sight is not None) for each in found.kept], heads))
        blocks.append("mm, degrees: largest errors at the goal; modes: those of the start / of the goal, in brackets\n"
                      "those that the robot was found to take; – not asked")
    if found.unexamined:
        blocks.append(table([_row(each, found.sight is not None)[:3] for each in found.unexamined],
                            ["not examined", "mm", "degrees"]))
    discarded = [each for each in found.candidates if each.discarded is not None]
    if discarded:
        blocks.append(table([(", ".join(each.legs), str(each.discarded)) for each in discarded],
                            ("discarded", "because")))
    return "\n\n".join(blocks)


def _row(each: Candidate, sight: bool) -> list[str]:
    errors = each.errors
    assert errors is not None
    aspect = "–" if each.aspect is None else each.aspect.verdict
    seen = [] if not sight else ["–" if each.seen is None else f"{100 * min(each.seen.values()):.0f} %"]
    return [", ".join(each.legs), f"{1e3 * errors.position.largest:.4g}",
            f"{np.degrees(errors.orientation.largest):.4g}", f"{_modes(each.start_modes)} / {_modes(each.goal_modes)}",
            aspect, *seen, "–" if each.run is None else each.run.verdict]


def _modes(modes: Modes | None) -> str:
    if modes is None or modes.count is None:
        return "–"
    return f"{modes.count} ({modes.reachable})"
