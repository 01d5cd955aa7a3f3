"""Poses that were checked."""

from __future__ import annotations

from collections import Counter

from ...analysis.check import Check
from ...analysis.posture import CONSTRAINT, REGULAR, UNDECIDED, Kinds, Posture
from ...tolerances import NOISE, RANK_GAP
from .tables import listing

_STATES = {REGULAR: "regular", "type1": "Type 1 singularity", "type2": "Type 2 singularity",
           "type3": "Type 3 singularity (Type 1 and 2 at once)", CONSTRAINT: "constraint singularity",
           UNDECIDED: "not decided"}


def check(found: Check) -> str:
    """What is observed, a block for each pose, then redundant constraints and the grid in numbers."""
    anatomy = found.setting.anatomy
    rows = [("robot", f"{found.setting.robot.name}   {anatomy.architecture()}"),
            ("observed", ", ".join(f"{o.leg} ({o.link})" for o in found.setting.observed)),
            ("lengths in", f"{found.length:.4g} m (the characteristic length), angles in radians")]
    if found.setting.mechanism.reference != found.setting.mechanism.base:
        rows.insert(2, ("camera on", found.setting.mechanism.reference))
    for posture in found.postures:
        rows += [("", ""), ("pose", str(posture.pose)), *_posture(posture)]
    redundant = [f"the loop cut at {each.loop}: {each.rows} of its constraints" for each in found.redundant]
    redundant = redundant or ["no constraint"]
    rows += [("", ""), *[("redundant" if i == 0 else "", text) for i, text in enumerate(redundant)]]
    if found.grid is not None:
        counts = Counter(found.grid.states)
        axes = zip(found.grid.grid.shape, found.grid.grid.names, strict=True)
        size = " × ".join(f"{count} {name}" for count, name in axes)
        rows.append(("grid", f"{size}: " + ", ".join(f"{counts[state]} {state}" for state in sorted(counts))))
    return listing(rows)


def _posture(posture: Posture) -> list[tuple[str, str]]:
    mobility, far = posture.mobility, posture.distances
    rows = [("mobility", f"{mobility.total}, of which {mobility.idle} idle; the platform has {_freedoms(posture.dof)}"),
            *_kinds("hidden robot", f"the directions show {posture.hidden.rank} of {posture.dof}", posture.hidden)]
    if far.condition is not None and far.type2 is not None and far.type1 is not None:
        rows += [("", f"singular values of Mᵀ {far.type2:.3g} to {1 / far.type1:.3g}, condition {far.condition:.3g}"),
                 ("", f"one degree of error in the directions, to first order: {_small(far.millimetres)} mm and "
                      f"{_small(far.degrees)} degrees along the weakest freedom that they show")]
        if far.condition > 1 / NOISE:
            rows.append(("", f"nearly singular: dimensions known to {NOISE:g} cannot tell it from a singularity"))
    elif far.type2 is None:
        rows.append(("", "there is no interaction matrix: observed links move while the platform rests"))
    if posture.real is None:
        rows.append(("real robot", "has no motors"))
    else:
        rows += _kinds("real robot", f"the motors determine {posture.real.rank} of {posture.dof}", posture.real)
    if posture.constraint_singular:
        rows += [("loops", "lose rank here, the platform has"), *[("", freedom.name) for freedom in posture.gained]]
    rows += [("redundant here", f"the loop cut at {each.loop}: {each.rows} more of its constraints")
             for each in posture.redundant]
    return [*rows, ("loops' margin", f"{far.constraints:.3g} (weakest singular value, as part of the largest)")]


def _kinds(name: str, what: str, kinds: Kinds) -> list[tuple[str, str]]:
    head = f"{what}: {_STATES[kinds.state]} (smallest rank gap {kinds.gap:.1e}, needed {RANK_GAP:.0e})"
    if kinds.classes is None:
        return [(name, head)]
    counts = "  ".join(f"{key} {value}" for key, value in kinds.classes.to_dict().items())
    return [(name, head), ("", f"over the generic values: {counts}"),
            *[("not seen" if name == "hidden robot" else "not held", freedom.name) for freedom in kinds.lost]]


def _small(value: float | None) -> str:
    return "no limit" if value is None else f"{0.0 if value < 1e-9 else value:.3g}"


def _freedoms(count: int) -> str:
    return "one freedom" if count == 1 else f"{count} freedoms"
