"""Drawings of a derivation: legs of the real and of the hidden robot (MMT Table 1), and the robot before and after each
accepted step. Drawings that are equal but for names are shown once."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace

from ...analysis.derive import Derivation
from ...mechanism.legs import LegDecomposition
from ...rewrite.rules import list_rules
from ...rewrite.strategy import Step
from ..drawings.schematic import draw_leg_svg, draw_robot_svg

SOURCES = {rule.name: rule.source for rule in list_rules()}
_NAMES = re.compile(
    r"<title>.*?</title>|<desc>.*?</desc>|<text[^>]*>leg [^<]*</text>"
    r'| (?:data-joint|data-link|aria-label)="[^"]*"',
    re.DOTALL,
)
"""Differences between drawings of equal legs."""


@dataclass(frozen=True)
class LegPair:
    """Legs with the same architecture in both robots: labels, architectures and drawings of the first; None for the
    hidden ones if the hidden robot has no such leg."""

    labels: tuple[str, ...]
    watched: bool
    real: str
    hidden: str | None
    real_drawing: str
    hidden_drawing: str | None


def list_virtual_actuators(found: Derivation) -> set[str]:
    """Return the virtual actuators of the hidden robot."""
    joints = found.hidden.joints.values() if found.hidden is not None else ()
    return {joint.name for joint in joints if joint.is_actuated}


def list_leg_figures(found: Derivation) -> list[LegPair]:
    """Return the legs in order, each kind once."""
    real, seen = found.setup.decomposition, {o.link for o in found.setup.observed}
    states = [step.state for step in found.steps if step.state is not None]
    hidden = states[-1].decomposition() if states and found.hidden is not None else None
    kinds: dict[tuple[str, str | None, bool], LegPair] = {}
    for leg in real.legs:
        other = None if hidden is None or leg.label not in hidden.labels else hidden.leg(leg.label)
        word = hidden.word(other).text() if hidden is not None and other is not None else None
        key = real.word(leg).text(), word, leg.label in found.setup.labels
        if key in kinds:
            kinds[key] = replace(kinds[key], labels=(*kinds[key].labels, leg.label))
            continue
        drawing = None
        if hidden is not None and other is not None:
            drawing = draw_leg_svg(
                hidden,
                leg.label,
                observed=seen,
                virtual=list_virtual_actuators(found),
                title=f"Leg {leg.label} of the hidden robot",
            )
        kinds[key] = LegPair(
            (leg.label,),
            key[2],
            key[0],
            word,
            draw_leg_svg(real, leg.label, observed=seen, title=f"Leg {leg.label} of the real robot"),
            drawing,
        )
    return list(kinds.values())


@dataclass(frozen=True)
class StepFigure:
    """Accepted step with its drawings; ``steps`` are the numbers, from 1, of all steps that it represents."""

    rule: str
    source: str
    steps: tuple[int, ...]
    legs: tuple[str, ...]
    """Empty if the step changes the whole robot."""
    reasons: tuple[str, ...]
    largest_angle: float | None
    before: str
    after: str

    def is_like(self, other: StepFigure) -> bool:
        """Return True if two steps of different legs look the same but for names."""
        drawings = ((self.before, other.before), (self.after, other.after))
        return (
            self.rule == other.rule
            and bool(self.legs and other.legs)
            and all(_NAMES.sub("", a) == _NAMES.sub("", b) for a, b in drawings)
        )

    def together(self, other: StepFigure) -> StepFigure:
        """Return this figure, which represents another one too."""
        angles = [angle for angle in (self.largest_angle, other.largest_angle) if angle is not None]
        return replace(
            self,
            steps=self.steps + other.steps,
            legs=self.legs + other.legs,
            reasons=tuple(dict.fromkeys(self.reasons + other.reasons)),
            largest_angle=max(angles, default=None),
        )


def step_figures(found: Derivation) -> list[StepFigure]:
    """Return the accepted steps that changed the robot, in order."""
    drawn: list[StepFigure] = []
    seen, decomposition = {o.link for o in found.setup.observed}, found.setup.decomposition
    virtual: set[str] = set()
    for number, step in enumerate(found.steps, 1):
        if step.state is None:
            continue
        after, then = step.state.decomposition(), step.state.actuators
        leg = step.leg if step.leg in decomposition.labels and step.leg in after.labels else None
        one = StepFigure(
            step.rule,
            SOURCES.get(step.rule, ""),
            (number,),
            (step.leg,) if step.leg else (),
            (step.reason,),
            step.largest_angle,
            _draw_step(step, "before", decomposition, leg, seen, virtual),
            _draw_step(step, "after", after, leg, seen, then),
        )
        alike = next((i for i, other in enumerate(drawn) if one.is_like(other)), None)
        if alike is None:
            drawn.append(one)
        else:
            drawn[alike] = drawn[alike].together(one)
        decomposition, virtual = after, then
    return drawn


def _draw_step(
    step: Step,
    word: str,
    decomposition: LegDecomposition,
    leg: str | None,
    seen: Collection[str],
    virtual: Collection[str],
) -> str:
    title = f"{step.rule}: {word}" + (f" (leg {leg})" if leg else "")
    if leg is None:
        return draw_robot_svg(decomposition, observed=seen, virtual=virtual, title=title)
    return draw_leg_svg(decomposition, leg, observed=seen, virtual=virtual, title=title)
