"""Prismatic merge: the actuator takes the place of the real joint on the reference link.

U–P̲–S   →   U̲–P–S        A is fixed on the reference link (UPS, UPU, RPS legs)        (MMT 4.2.1)
"""

from __future__ import annotations

from collections.abc import Iterator

from ..evidence import Evidence
from ..rule import AXES, Match, Refusal, Rule, Stage, list_chain_places
from ..state import State, VirtualChain
from .joint_substitution import Substitution, apply, find_substitution


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Substitution | None] | Refusal]:
    """A joint K on the reference link."""
    if chain.before == evidence.reference:
        yield from find_substitution(state, evidence, chain)


RULE = Rule("prismatic merge", "MMT 4.2.1", Stage.JOINT, find, apply, list_chain_places, keeps=(AXES,))
