"""Direction locus: a direction that only turns about one axis needs one actuated R; a constant one needs none.

    T –U̲– W   →   T –R̲– W        u stays in a plane or on a cone
    chain      →   (nothing)       u is constant: the leg is blind        (MMT 3.2, 4.1.1; over the whole motion)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...mechanism import JointType
from ..evidence import Evidence, locus
from ..rule import Proposal, Refusal, Rule
from ..state import Chain, State


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All chains of the leg."""
    notes = []
    before = state
    for chain in state.chain(leg):
        found = locus(evidence.directions(_index(evidence, chain)), 1.0)
        if found.dimension == 0:
            links = (chain.carrier, chain.bearing, *chain.slider_links)
            gone = {link for link in links if link is not None and link in state.owners}
            state = state.with_chain(chain, None, state.mechanism.changed(
                remove_links=gone, remove_joints=[chain.actuator, *([chain.roll] if chain.roll else [])]))
            notes.append("the direction is constant: the leg is blind")
        elif found.dimension == 2:
            joint = state.mechanism.joints[chain.actuator]
            turned = replace(joint, type=JointType.REVOLUTE, axes=(found.normal,))
            state = state.with_chain(chain, chain, state.mechanism.changed(joints=[turned]))
            notes.append("the direction only turns about an axis of constant direction")
    if state is before:
        yield Refusal("the direction moves in two ways")
    else:
        yield Proposal(state, "; ".join(notes))


def _index(evidence: Evidence, chain: Chain) -> int:
    for index, observation in enumerate(evidence.samples.question.observations):
        if observation.leg == chain.leg and observation.link == chain.link:
            return index
    return next(i for i, o in enumerate(evidence.samples.question.observations) if o.leg == chain.leg)


RULE = Rule("direction locus", "MMT 3.2, 4.1.1", propose)
