"""What a rule is: proposals for a leg, in order, each a new state with its reason, or a refusal with its reason."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from .evidence import Evidence
from .state import State


@dataclass(frozen=True, eq=False)
class Proposal:
    """A rewritten state; ``bodies`` are links whose twists must not change either."""

    state: State
    reason: str
    bodies: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refusal:
    """The side condition that fails."""

    reason: str


Propose = Callable[[State, Evidence, str, bool], Iterator[Proposal | Refusal]]


@dataclass(frozen=True)
class Rule:
    """A named rule: ``propose(state, evidence, leg, trust)`` yields proposals in order of preference.

    With ``trust`` side conditions are waived: the rule does what the paper's text does without looking.
    """

    name: str
    source: str
    propose: Propose
