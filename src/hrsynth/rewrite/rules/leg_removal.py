"""Leg removal: a leg that is not observed is dropped.

    base – leg – platform   →   (nothing)        the platform and the observed legs move as before        (MMT 4.2)

The twists of the platform and of all links on which observed legs end must stay the same; the leg that carries the
camera stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..evidence import Evidence
from ..rule import Match, Refusal, Rule, Stage, whole_leg
from ..state import State


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[str] | Refusal]:
    """The leg, which has no virtual chain."""
    if state.mechanism.reference in state.real.leg(leg).links:
        yield Refusal("the leg carries the camera")
        return
    observed = state.observed()
    ends = dict.fromkeys(each.attach for each in state.real.legs if each.label in observed)
    yield Match(leg, "platform and observed legs move as before without it",
                bodies=tuple(end for end in ends if end != state.mechanism.platform))


def apply(state: State, leg: str) -> State:
    """The robot without the leg's links and joints, virtual links included."""
    part, mechanism = state.real.leg(leg), state.mechanism
    links = [*part.links, *(name for name, owner in state.owners.items() if owner == leg)]
    changed = mechanism.changed(remove_links=[name for name in links if name in mechanism.links],
                                remove_joints=[name for name in part.joints if name in mechanism.joints])
    return replace(state, mechanism=changed, removed=(*state.removed, leg))


RULE = Rule("leg removal", "MMT 4.2", Stage.LEG, find, apply, whole_leg)
