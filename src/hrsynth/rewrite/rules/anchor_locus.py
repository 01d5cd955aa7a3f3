"""Anchor locus: the anchor needs only as many sliders as its locus has dimensions.

    PPP – T   →   (nothing) / P – T / PP – T        A is fixed / on a line / in a plane        (MMT 3.2)
    PPP – T   →   T is the link before K             that link only translates itself
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...mechanism import Joint, JointType
from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import Chain, State


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All chains of the leg."""
    before = state
    notes = []
    for chain in state.chain(leg):
        proximal = evidence.proximal(chain.link)
        if proximal is None or chain.before is None:
            continue
        if proximal.translates:
            state = _on(state, chain, chain.before)
            notes.append("the anchor is fixed" if chain.before == state.mechanism.reference
                         else "the link before the observed one only translates: it carries the actuator")
            continue
        found = proximal.anchor_locus
        if found.dimension == 0:
            state = _on(state, chain, state.mechanism.reference)
            notes.append("the anchor is fixed")
        elif found.dimension < 3:
            state = _slid(state, chain, found.axes[: found.dimension])
            notes.append(f"the anchor moves {'on a line' if found.dimension == 1 else 'in a plane'}")
    if state is before:
        yield Refusal("the anchor moves in space, or the part before the observed link is not a chain of its own")
    else:
        yield Proposal(state, "; ".join(notes))


def _on(state: State, chain: Chain, carrier: str) -> State:
    """T becomes the link ``carrier``."""
    mechanism = state.mechanism
    actuator = mechanism.joints[chain.actuator].relinked(chain.carrier, carrier)
    changed = mechanism.changed(remove_links=[chain.carrier, *chain.slider_links], joints=[actuator])
    order = [n for n in mechanism.joints if n in changed.joints]
    changed = replace(changed, joints={n: changed.joints[n] for n in order})
    return state.with_chain(chain, replace(chain, carrier=carrier, sliders=(), slider_links=()), changed)


def _slid(state: State, chain: Chain, axes: object) -> State:
    """T on one P or two."""
    mechanism = state.mechanism
    directions = list(axes)  # type: ignore[call-overload]
    links = chain.slider_links[: len(directions) - 1]
    path = [mechanism.reference, *links, chain.carrier]
    names = chain.sliders[: len(directions)]
    joints = [Joint(name, JointType.PRISMATIC, a, b, chain.anchor, (axis,))
              for name, a, b, axis in zip(names, path, path[1:], directions, strict=False)]
    changed = mechanism.changed(remove_links=chain.slider_links[len(links):], remove_joints=chain.sliders,
                                joints=joints)
    return state.with_chain(chain, replace(chain, sliders=names, slider_links=links), changed)


RULE = Rule("anchor locus", "MMT 3.2", propose)
