"""Direction locus: a direction that only rotates about one axis needs one actuated R; a constant one needs none.

T –U̲– W   →   T –R̲– W        u stays in a plane or on a cone
chain      →   (nothing)       u is constant        (MMT 3.2, 4.1.1; over the whole motion)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...geometry.vectors import Array
from ...mechanism import JointType
from ..evidence import Evidence, fit_linear_locus
from ..rule import AXES, LOOPS, Match, Rule, Stage, list_chain_places
from ..state import State, VirtualChain

Turning = tuple[VirtualChain, Array | None]
"""A chain, and the axis about which its direction turns; None for a direction that is constant."""


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Turning]]:
    """The locus of the chain's direction; nothing where that moves in two ways."""
    observations = evidence.samples.observation_model.observations
    own = [i for i, o in enumerate(observations) if o.leg == chain.leg]
    index = next((i for i in own if observations[i].link == chain.link), own[0])
    found = fit_linear_locus(evidence.directions(index), 1.0)
    if found.dimension == 0:
        yield Match((chain, None), "the direction is constant")
    elif found.dimension == 2:
        yield Match((chain, found.normal), "the direction only rotates about an axis of constant direction")


def apply(state: State, found: Turning) -> State:
    """The chain with R for U, or without the chain."""
    chain, axis = found
    mechanism = state.mechanism
    if axis is None:
        links = {chain.carrier, chain.bearing, *chain.slider_links}
        gone = [link for link in mechanism.links if link in links and link in state.owners]
        joints = [chain.actuator, *([chain.roll] if chain.roll else [])]
        return state.with_chain(chain, None, mechanism.changed(remove_links=gone, remove_joints=joints))
    turned = replace(mechanism.joints[chain.actuator], type=JointType.REVOLUTE, axes=(axis,))
    return state.with_chain(chain, chain, mechanism.changed(joints=[turned]))


RULE = Rule(
    "direction locus",
    "MMT 3.2, 4.1.1",
    Stage.DIRECTION,
    find,
    apply,
    list_chain_places,
    otherwise="the direction moves with two dof",
    keeps=(LOOPS, AXES),
)
