"""Leg removal: a leg that is not observed is dropped.

    base – leg – platform   →   (nothing)        the platform and the observed legs move as before        (MMT 4.2)

The twists of the platform and of all links on which observed legs end must stay the same; the leg that carries the
camera stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import State


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """The leg ``leg``, which has no virtual chain."""
    part = state.real.leg(leg)
    mechanism = state.mechanism
    if mechanism.reference in part.links:
        yield Refusal("the leg carries the camera")
        return
    links = [name for name in part.links if name in mechanism.links]
    links += [name for name, owner in state.owners.items() if owner == leg and name in mechanism.links]
    joints = [name for name in part.joints if name in mechanism.joints]
    changed = mechanism.changed(remove_links=links, remove_joints=joints)
    observed = state.observed()
    ends = dict.fromkeys(each.attach for each in state.real.legs if each.label in observed)
    yield Proposal(replace(state, mechanism=changed, removed=(*state.removed, leg)),
                   "platform and observed legs move as before without it",
                   tuple(end for end in ends if end != mechanism.platform))


RULE = Rule("leg removal", "MMT 4.2", propose)
