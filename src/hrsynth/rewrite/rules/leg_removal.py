"""Leg removal: a leg that is not observed is dropped.

    base – leg – platform   →   (nothing)        the platform and the observed legs move as before        (MMT 4.2)

The twists of the platform, of all links on which observed legs end and of all links that sensors observe or see from
must stay the same; a leg that carries a camera or what is observed otherwise stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..evidence import Evidence
from ..rule import Match, Refusal, Rule, Stage, list_leg_place
from ..state import State


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[str] | Refusal]:
    """The leg, which has no virtual chain."""
    own = state.real.leg(leg)
    if state.mechanism.reference in own.links:
        yield Refusal("the leg carries the camera")
        return
    if state.mechanism.formation:
        yield Refusal("the joints of a formation define how its links can move")
        return
    if state.watched & set(own.links) or state.actuators & set(own.joints):
        yield Refusal("the leg carries an observed link, an observed joint or a camera")
        return
    observed = state.observed_labels()
    ends = dict.fromkeys(each.platform_link for each in state.real.legs if each.label in observed)
    bodies = dict.fromkeys((*ends, *sorted(state.watched)))
    yield Match(
        leg,
        "platform and observed legs move as before without it",
        bodies=tuple(each for each in bodies if each not in (state.mechanism.platform, state.mechanism.base)),
    )


def apply(state: State, leg: str) -> State:
    """The robot without the leg's links and joints, virtual links included."""
    part, mechanism = state.real.leg(leg), state.mechanism
    links = [*part.links, *(name for name, owner in state.owners.items() if owner == leg)]
    changed = mechanism.changed(
        remove_links=[name for name in links if name in mechanism.links],
        remove_joints=[name for name in part.joints if name in mechanism.joints],
    )
    return replace(state, mechanism=changed, removed=(*state.removed, leg))


RULE = Rule(
    "leg removal",
    "MMT 4.2",
    Stage.LEG,
    find,
    apply,
    list_leg_place,
    keeps=("the wrenches of removed legs are among those of the others",),
)
