"""Prismatic merge: the actuator takes the place of the real joint on the reference link.

    U–P̲–S   →   U̲–P–S        A is fixed on the reference link (UPS, UPU, RPS legs)        (MMT 4.2.1)
"""

from __future__ import annotations

from collections.abc import Iterator

from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import State
from .takeover import proposals


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All chains of the leg whose knee is on the reference link."""
    yield from proposals(state, evidence, leg, trust, on_reference=True)


RULE = Rule("prismatic merge", "MMT 4.2.1", propose)
