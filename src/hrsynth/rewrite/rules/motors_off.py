"""Motors off: every real actuator becomes passive.

    R̲ –  →  R –        (MMT 3.2; always)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import State, passive


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """One proposal for all legs at once."""
    mechanism = state.mechanism
    joints = [passive(joint) for joint in mechanism.joints.values() if joint.actuated]
    yield Proposal(replace(state, mechanism=mechanism.changed(joints=joints)),
                   f"{len(joints)} real motors become passive")


RULE = Rule("motors off", "MMT 3.2", propose)
