"""Interface of a rule: ``find`` yields the places where it applies, ``apply`` rewrites one of them.

A rule does not know the order of rules or the proof. Strategies (:mod:`.strategy`) decide when it is tried, the
equivalence check whether its result is the same robot to a camera. A rule names the side condition that fails
(``Match.unmet``); the strategy decides whether it is applied all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from .evidence import Evidence
from .state import State, VirtualChain

LOOPS = "the robot's loops have their generic rank"
AXES = "no virtual chain is singular: no observed direction lies in the plane of its actuator's axes"
"""Conditions under which several rules keep ρ at singular configurations too (docs/pages/theory.md, section 4)."""

Place = TypeVar("Place")
Found = TypeVar("Found")


class Stage(Enum):
    """Part of the robot that a rule rewrites; strategies choose the order of the stages."""

    MOTORS = "the real motors"
    LIFT = "the virtual chain of a leg, from nothing"
    DIRECTION = "the virtual actuator, by the locus of the direction"
    ANCHOR = "the sliders under the actuator, by the locus of the proximal centre"
    JOINT = "the real joint K before the observed link"
    BESIDE = "links that are joined as the observed one is"
    FORM = "the guidance of the actuator's carrier"
    LEG = "a leg that is not observed"
    ENDS = "the ends of the observed legs on the platform"


@dataclass(frozen=True, eq=False)
class Match(Generic[Found]):
    """A place where a rule applies: ``found`` is what ``apply`` needs, ``reason`` why the rewritten robot is the same
    to a camera."""

    found: Found
    reason: str
    unmet: str | None = None
    """The side condition that fails here, in words; None where it holds."""
    bodies: tuple[str, ...] = ()
    """Links, besides the platform, whose twists must not change."""


@dataclass(frozen=True)
class Refusal:
    """Reason why a rule does not apply."""

    reason: str


@dataclass(frozen=True, eq=False)
class Proposal:
    """A rewritten state, why, and the links whose twists must not change either."""

    state: State
    reason: str
    bodies: tuple[str, ...] = ()


def list_chain_places(state: State, leg: str) -> Sequence[VirtualChain]:
    """The places of a rule about virtual chains: those of the leg."""
    return state.chain(leg)


def list_leg_place(state: State, leg: str) -> Sequence[str]:
    """The only place of a rule about a leg, or about the robot (then ``leg`` is empty)."""
    return (leg,)


@dataclass(frozen=True, eq=False)
class Rule(Generic[Place, Found]):
    """Rule with its source and stage.

    ``find(state, evidence, place)`` yields matches in order of preference, or a refusal, or nothing;
    ``apply(state, found)`` returns the rewritten state. ``places(state, leg)`` are the places of a leg.
    """

    name: str
    source: str
    stage: Stage
    find: Callable[[State, Evidence, Place], Iterable[Match[Found] | Refusal]]
    apply: Callable[[State, Found], State]
    places: Callable[[State, str], Sequence[Place]]
    otherwise: str | None = None
    """Reason of the refusal if nothing is found at any place of a leg."""
    always: bool = False
    """True if the rule holds for every robot: then it must be accepted."""
    keeps: tuple[str, ...] = ()
    """Sufficient conditions, in words, under which ρ is preserved at singular configurations too (docs/pages/theory.md,
    section 4); empty if none is needed."""
    rank: int = 0
    """Order within the stage: a lower rank is tried first."""

    def proposals(
        self, state: State, evidence: Evidence, leg: str = "", *, waive: bool = False
    ) -> Iterator[Proposal | Refusal]:
        """The leg rewritten at all of its places at once, in order of preference, until a refusal; with ``waive`` side
        conditions are waived: the rule is applied unchecked."""
        silent = True
        for each in self._rewritten(state, evidence, tuple(self.places(state, leg)), (), waive):
            silent = False
            yield each
        if silent and self.otherwise is not None:
            yield Refusal(self.otherwise)

    def _rewritten(
        self, state: State, evidence: Evidence, places: Sequence[Place], done: tuple[Match[Found], ...], waive: bool
    ) -> Iterator[Proposal | Refusal]:
        """Proposals that rewrite the other ``places`` as well, after the matches that are ``done``."""
        if not places:
            if done:
                reasons = dict.fromkeys(match.reason for match in done)
                yield Proposal(state, "; ".join(reasons), tuple(body for match in done for body in match.bodies))
            return
        found = False
        for match in self.find(state, evidence, places[0]):
            found = True
            if isinstance(match, Match) and match.unmet is not None and not waive:
                match = Refusal(match.unmet)
            if isinstance(match, Refusal):
                yield match
                return
            yield from self._rewritten(self.apply(state, match.found), evidence, places[1:], (*done, match), waive)
        if not found:
            yield from self._rewritten(state, evidence, places[1:], done, waive)
