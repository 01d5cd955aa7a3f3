"""Equilibria of a servo loop with a set of legs: the stable ones besides the goal, and the proved attraction radius of
the goal."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from ..analysis.observed import ObservedRobot
from ..errors import HrsynthError
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..records import DEG, MM, As, Number, Shown
from ..results import Value
from ..simulation.equilibria.attraction_radius import AttractionRadius, prove_attraction_radius
from ..simulation.equilibria.equilibria import EquilibriumSearch
from ..simulation.equilibria.equilibrium import CRITICAL
from ..simulation.outcome import GOAL


@dataclass(frozen=True, eq=False, repr=False)
class LoopEnds(Value):
    """Stable equilibria and proved attraction radius of a goal. ``others`` are the kinds of the stable equilibria that
    were found, without the goal and those beyond joint limits (None: not searched); there may be more. ``why`` is the
    reason for what is unknown."""

    others: Annotated[tuple[str, ...] | None, As("kinds")]
    radius: AttractionRadius | None
    why: str = ""

    @classmethod
    def of(cls, setup: ObservedRobot, goal: ClosedConfiguration, rounds: Iterable[Array] | None = None) -> LoopEnds:
        """Return those of a goal; ``rounds`` of starts as for :func:`.critical_points`."""
        try:
            found = EquilibriumSearch.of(setup, goal).answer(minima=True, rounds=rounds)
            others = tuple(sorted(each.kind for each in found.stable if each.kind != GOAL and not each.beyond_limits))
            if not all(each.is_segment_direction for each in setup.observed):
                return cls(others, None, "the attraction radius is computed for directions of segments only")
            radius = prove_attraction_radius(setup, goal)
        except HrsynthError as error:
            return cls(None, None, str(error))
        return cls(others, radius, "" if radius.length else radius.reason)

    @property
    def order(self) -> tuple[float, float]:
        """Sort key, smallest first: number of other stable equilibria, negative power of two of the radius (m)."""
        length = 0.0 if self.radius is None else self.radius.length
        return (
            math.inf if self.others is None else len(self.others),
            -math.floor(math.log2(length)) if length > 0 else math.inf,
        )

    @property
    def length(self) -> float:
        """Proved attraction radius (m), 0 where there is none."""
        return 0.0 if self.radius is None else self.radius.length

    @property
    def words(self) -> str:
        """Number of other stable equilibria, by kind."""
        if self.others is None:
            return "not searched"
        kinds = ", ".join(
            f"{count} {'nonzero error' if kind == CRITICAL else kind}" for kind, count in Counter(self.others).items()
        )
        return kinds or "none"

    stable = Shown(int | None, lambda self: None if self.others is None else len(self.others))
    radius_mm = Shown(Number, lambda self: self.length or None, As(scale=MM))
    radius_deg = Shown(Number, lambda self: self.radius.angle if self.length else None, As(scale=DEG))
    reason = Shown(str | None, lambda self: self.why or None)


def explain_smaller_set(
    best: tuple[tuple[str, ...], LoopEnds], others: Iterable[tuple[tuple[str, ...], LoopEnds]]
) -> str | None:
    """Explain in a sentence why a set ranks above the largest one that contains it; None if no such set has more stable
    equilibria or a smaller proved attraction radius."""
    legs, ends = best
    worse = [
        (each, its)
        for each, its in others
        if set(legs) < set(each) and its.others is not None and its.order > ends.order
    ]
    if not worse:
        return None
    more, its = max(worse, key=lambda pair: len(pair[0]))
    first = f"fewer legs are better here: with {', '.join(legs)} "
    if its.order[0] > ends.order[0]:
        why = "; with redundant observation, nonzero errors can balance" if CRITICAL in (its.others or ()) else ""
        return (
            f"{first}the stable equilibria found besides the goal are: {ends.words}; with {', '.join(more)}: "
            f"{its.words}{why}"
        )
    found = f"{1e3 * its.length:.3g} mm" if its.length else "undecided"
    return f"{first}the proved attraction radius is {1e3 * ends.length:.3g} mm, with {', '.join(more)} it is {found}"
