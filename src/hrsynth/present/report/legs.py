"""The legs of the real robot beside those of the hidden one, equal ones together (MMT Table 1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...analysis.derive import Derivation
from ...mechanism.legs import LegDecomposition
from ..drawings.schematic import leg_svg


@dataclass(frozen=True)
class Pair:
    """Legs with the same word in both robots: their labels, words and drawings (of the first); the hidden ones None
    where the hidden robot has no such leg."""

    labels: tuple[str, ...]
    watched: bool
    real: str
    hidden: str | None
    real_drawing: str
    hidden_drawing: str | None


def actuators(found: Derivation) -> set[str]:
    """The virtual actuators of the hidden robot: all that drives it."""
    joints = found.hidden.joints.values() if found.hidden is not None else ()
    return {joint.name for joint in joints if joint.actuated}


def pairs(found: Derivation) -> list[Pair]:
    """The legs in order, each kind once."""
    setting = found.setting
    seen = {o.link for o in setting.observed}
    hidden = _hidden(found)
    kinds: dict[tuple[str, str | None, bool], Pair] = {}
    for leg in setting.anatomy.legs:
        there = hidden is not None and leg.label in hidden.labels
        word = hidden.word(hidden.leg(leg.label)).text() if hidden is not None and there else None
        key = setting.anatomy.word(leg).text(), word, leg.label in setting.labels
        if key in kinds:
            kinds[key] = replace(kinds[key], labels=(*kinds[key].labels, leg.label))
            continue
        drawing = None
        if hidden is not None and there:
            drawing = leg_svg(hidden, leg.label, observed=seen, virtual=actuators(found),
                              title=f"Leg {leg.label} of the hidden robot")
        kinds[key] = Pair((leg.label,), key[2], key[0], word,
                          leg_svg(setting.anatomy, leg.label, observed=seen,
                                  title=f"Leg {leg.label} of the real robot"), drawing)
    return list(kinds.values())


def _hidden(found: Derivation) -> LegDecomposition | None:
    """The hidden robot taken apart, with the labels of the real one."""
    if found.hidden is None:
        return None
    return next((step.state.anatomy() for step in reversed(found.steps) if step.state is not None), None)
