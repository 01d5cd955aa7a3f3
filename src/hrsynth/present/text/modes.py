"""All assembly modes in text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
        rows += [("modes", f"{real} real of {count.complex} complex, {all_of(found)}"),
                 ("proof", count.proof)]
    for each in count.meant:
        legs = ", ".join(found.labels[k] for k in each.legs)
        rows.append(("meant", f"legs {legs} share a joint centre of the {each.where} (to {each.defect:.1e} m; "
                              "--as-written takes the numbers as they are)"))
    if count.degenerate is not None:
        rows.append(("special", count.degenerate))
    for number, mode in enumerate(found.modes, 1):
        rows += [("", ""), (f"mode {number}", f"{mode.pose}" + ("   (the pose itself)" if mode.goal else "")),
                 ("", proved(mode) if mode.fits is not None else f"{proved(mode)}, residual {mode.residual:.1e}"),
                 *at_mode(mode, found.kind)]
    for number, mode in enumerate(found.near, 1):
        rows += [("", ""), (f"near {number}", f"{mode.pose}   residual {mode.residual:.2e}: almost a mode"
                 + (", and none" if count.complete else "")),
                 *at_mode(mode, found.kind)]
    if file is not None:
        rows += [("", ""), ("picture", file)]
    return listing(rows)


def all_of(found: AssemblyModes) -> str:
    """Whether the modes are all."""
    if found.found.complete:
        fitting = sum(mode.fits is not None and not mode.goal for mode in found.modes)
        return f"proved to be all among {found.within}" + (
            f"; {fitting} of them fit{'s' * (fitting == 1)}, not proved" if fitting else "")
    return "found, not proved to be all"


def proved(mode: AssemblyMode) -> str:
    """What is proved of a mode's place."""
    within = "" if not np.isfinite(mode.radius) else f"to {mode.shift:.1e} m" + (f", {mode.turn:.1e} rad" if mode.turn
                                                                                 else "")
    known = f"known {within}" if within else "known to no radius"
    if mode.proved:
        return f"{', '.join(mode.enclosed)}{' ' if mode.enclosed else ''}enclosed {within}"
    if mode.fits is not None and mode.goal:
        return f"a mode by construction, its place not proved, {known}"
    if mode.fits is not None:
        return f"fits all legs to {mode.fits:.1e}, which does not prove it; if it is a mode, {known}"
    if mode.rounded:
        return f"not proved: enclosed {within} for the rounded geometry, not for the file's".replace("  ", " ")
    if mode.multiplicity > 1:
        return f"not proved, a multiple one {within}".rstrip()
    return f"{'a mode by construction, its place ' if mode.goal else ''}not proved, {known}"


def at_mode(mode: AssemblyMode, kind: str) -> list[tuple[str, str]]:
    """What the real robot does at a mode."""
    rows = [("", words) for words in assembly(mode)]
    if mode.type2_distance is not None:
        matrix = "Mᵀ" if kind == "hidden" else "the motors' Jacobian (motor rates by platform twist)"
        rows.append(("", f"smallest singular value of {matrix} {mode.type2_distance:.3g}"))
    return rows


def assembly(mode: AssemblyMode) -> list[str]:
    """Whether the real robot can be assembled at a mode, and why not."""
    def legs(labels: Sequence[str]) -> str:
        return f"{'legs' if len(labels) > 1 else 'leg'} {', '.join(labels)}"

    match mode.assembly:
        case "yes":
            return ["the real robot can be assembled there"]
        case "beyond limits":
            return [f"the real robot can be assembled there only beyond the limits of {', '.join(mode.beyond)}"]
        case "no":
            return [f"the real robot cannot be assembled there: {legs([leg for leg, _ in mode.misses])}",
                    *(f"leg {leg}: {miss}" for leg, miss in mode.misses)]
    where = f"beyond the limits of {', '.join(mode.beyond)}" if mode.beyond else f"without {legs(mode.open)}"
    return [f"the real robot was not found assembled there but {where}: that says nothing"]
