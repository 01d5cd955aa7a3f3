"""All assembly modes in text."""

from __future__ import annotations

from ...analysis.modes.modes import AssemblyMode, AssemblyModes
from .tables import listing

_SINCE = {"hidden": "the observed directions", "real": "the motors' coordinates"}


def modes(found: AssemblyModes, file: str | None = None) -> str:
    """The pose whose measurements are held, the count with its proof, a block for each mode."""
    setting, count = found.setting, found.found
    rows = [("robot", f"{setting.robot.name}   {setting.anatomy.architecture()}"),
            ("held", f"{_SINCE[found.kind]} at {found.pose}")]
    if found.kind == "hidden":
        rows.insert(1, ("observed", ", ".join(f"{o.leg} ({o.link})" for o in setting.observed)))
    if count.continuum is None:
        real = len(found.modes)
        rows += [("modes", f"{real} real of {count.complex} complex, "
                           + (f"proved to be all among {found.within}" if count.complete else "not proved to be all")),
                 ("proof", count.proof)]
    if count.degenerate is not None:
        rows.append(("special", count.degenerate))
    for number, mode in enumerate(found.modes, 1):
        rows += [("", ""), (f"mode {number}", f"{mode.pose}" + ("   (the pose itself)" if mode.goal else "")),
                 ("", f"enclosed to {mode.radius:.1e}, residual {mode.residual:.1e}"), *_robot(mode)]
    for number, mode in enumerate(found.near, 1):
        rows += [("", ""), (f"near {number}", f"{mode.pose}   residual {mode.residual:.2e}: almost a mode, and none"),
                 *_robot(mode)]
    if file is not None:
        rows += [("", ""), ("picture", file)]
    return listing(rows)


def _robot(mode: AssemblyMode) -> list[tuple[str, str]]:
    """What the real robot does at a mode."""
    if mode.open:
        return [("", f"the real robot does not close there: leg {', '.join(mode.open)}")]
    rows = []
    if mode.beyond:
        rows.append(("", f"the real robot closes there only beyond the limits of {', '.join(mode.beyond)}"))
    else:
        rows.append(("", "the real robot closes there"))
    if mode.type2_distance is not None:
        rows.append(("", f"smallest singular value of Mᵀ {mode.type2_distance:.3g}"))
    return rows
