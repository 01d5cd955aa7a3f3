"""The derivation as pictures: what each accepted step found and what it left, equal steps of several legs together."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from ...analysis.derive import Derivation
from ...mechanism.legs import LegDecomposition
from ...rewrite.rules import rules
from ...rewrite.state import State
from ...rewrite.strategy import Step
from ..drawings.graph import graph_svg
from ..drawings.schematic import leg_svg

SOURCES = {rule.name: rule.source for rule in rules()}
_NAMES = re.compile(r"<title>.*?</title>|<desc>.*?</desc>|<text[^>]*>leg [^<]*</text>"
                    r'| (?:data-joint|data-link|aria-label)="[^"]*"', re.DOTALL)
"""What tells drawings of equal legs apart."""


@dataclass(frozen=True)
class StepFigure:
    """An accepted step with its drawings; ``steps`` are the numbers, from 1, of all steps that it stands for."""

    rule: str
    source: str
    steps: tuple[int, ...]
    legs: tuple[str, ...]
    """Empty where the step is about the whole robot."""
    reasons: tuple[str, ...]
    largest_angle: float | None
    before: str
    after: str


def scenes(found: Derivation) -> list[StepFigure]:
    """The accepted steps that changed the robot, in order."""
    drawn: list[StepFigure] = []
    setting = found.setting
    seen = {o.link for o in setting.observed}
    state: State | None = None
    for number, step in enumerate(found.steps, 1):
        if step.state is None:
            continue
        one = _scene(number, step, setting.anatomy if state is None else state.anatomy(), state, seen)
        alike = next((i for i, other in enumerate(drawn) if _alike(one, other)), None)
        if alike is None:
            drawn.append(one)
        else:
            drawn[alike] = _together(drawn[alike], one)
        state = step.state
    return drawn


def _scene(number: int, step: Step, before: LegDecomposition, earlier: State | None, seen: set[str]) -> StepFigure:
    assert step.state is not None
    after = step.state.anatomy()
    leg = step.leg if step.leg in before.labels and step.leg in after.labels else None
    pictures = [_picture(anatomy, leg, seen, virtual, f"{step.rule}: {word}" + (f" (leg {leg})" if leg else ""))
                for anatomy, virtual, word in ((before, _actuators(earlier), "before"),
                                               (after, _actuators(step.state), "after"))]
    return StepFigure(step.rule, SOURCES.get(step.rule, ""), (number,), (step.leg,) if step.leg else (), (step.reason,),
                 step.largest_angle, *pictures)


def _actuators(state: State | None) -> set[str]:
    return set() if state is None else {chain.actuator for chain in state.chains}


def _picture(anatomy: LegDecomposition, leg: str | None, seen: set[str], virtual: set[str], title: str) -> str:
    if leg is None:
        return graph_svg(anatomy, observed=seen, virtual=virtual, title=title)
    return leg_svg(anatomy, leg, observed=seen, virtual=virtual, title=title)


def _alike(one: StepFigure, other: StepFigure) -> bool:
    """Whether two steps of different legs look the same but for names."""
    if one.rule != other.rule or not (one.legs and other.legs):
        return False
    drawings = ((one.before, other.before), (one.after, other.after))
    return all(_NAMES.sub("", a) == _NAMES.sub("", b) for a, b in drawings)


def _together(first: StepFigure, other: StepFigure) -> StepFigure:
    angles = [angle for angle in (first.largest_angle, other.largest_angle) if angle is not None]
    return replace(first, steps=first.steps + other.steps, legs=first.legs + other.legs,
                   reasons=tuple(dict.fromkeys(first.reasons + other.reasons)), largest_angle=max(angles, default=None))
