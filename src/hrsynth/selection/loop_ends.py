"""Where the loop to a goal may end with a set of legs: what attracts besides the goal, and from how far around the goal
every start is proved to end there."""

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
from ..simulation.equilibria.attraction_radius import CertifiedRadius, certified_radius
from ..simulation.equilibria.equilibria import EquilibriumSearch
from ..simulation.equilibria.equilibrium import CRITICAL
from ..simulation.outcome import GOAL


@dataclass(frozen=True, eq=False, repr=False)
class LoopEnds(Value):
    """The kinds of the rests that were found to attract, the goal and those beyond limits left out (None where they
    were not sought), and the certified radius; ``why`` something is not known, else empty. That there are no other
    rests is not said: they are found from random starts."""

    others: Annotated[tuple[str, ...] | None, As("kinds")]
    radius: CertifiedRadius | None
    why: str = ""

    @classmethod
    def of(cls, setup: ObservedRobot, goal: ClosedConfiguration, rounds: Iterable[Array] | None = None) -> LoopEnds:
        """Those of a goal; ``rounds`` of starts as for :func:`.critical_points`."""
        try:
            found = EquilibriumSearch.of(setup, goal).answer(minima=True, rounds=rounds)
            others = tuple(sorted(each.kind for each in found.stable if each.kind != GOAL and not each.beyond_limits))
            if not all(each.by_segment for each in setup.observed):
                return cls(others, None, "the radius is one of directions of segments only")
            radius = certified_radius(setup, goal)
        except HrsynthError as error:
            return cls(None, None, str(error))
        return cls(others, radius, "" if radius.length else radius.reason)

    @property
    def order(self) -> tuple[float, float]:
        """What the best set has least of: poses that attract, and the radius' power of two (m), negative."""
        length = 0.0 if self.radius is None else self.radius.length
        return (
            math.inf if self.others is None else len(self.others),
            -math.floor(math.log2(length)) if length > 0 else math.inf,
        )

    @property
    def length(self) -> float:
        """The certified radius (m), 0 where there is none."""
        return 0.0 if self.radius is None else self.radius.length

    @property
    def words(self) -> str:
        """How many poses besides the goal attract, by their kinds."""
        if self.others is None:
            return "not sought"
        kinds = ", ".join(f"{count} {kind}" for kind, count in Counter(self.others).items())
        return kinds or "no other pose"

    attracting = Shown(int | None, lambda self: None if self.others is None else len(self.others))
    radius_mm = Shown(Number, lambda self: self.length or None, As(scale=MM))
    radius_deg = Shown(Number, lambda self: self.radius.angle if self.length else None, As(scale=DEG))
    reason = Shown(str | None, lambda self: self.why or None)


def fewer_are_better(
    best: tuple[tuple[str, ...], LoopEnds], others: Iterable[tuple[tuple[str, ...], LoopEnds]]
) -> str | None:
    """Why a set of legs serves better than the largest that holds all of them and more, in a sentence; None where no
    such set has more poses that attract or a smaller certified radius."""
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
        why = (
            "; the errors of more directions than there are freedoms can balance where they do not vanish"
            if CRITICAL in (its.others or ())
            else ""
        )
        return (
            f"{first}the loop was found to be drawn to {ends.words} besides the goal, with {', '.join(more)} to "
            f"{its.words}{why}"
        )
    found = f"{1e3 * its.length:.3g} mm" if its.length else "undecided"
    return f"{first}the certified radius is {1e3 * ends.length:.3g} mm, with {', '.join(more)} it is {found}"
