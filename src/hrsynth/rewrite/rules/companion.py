"""Companion: the other rod of a spatial parallelogram moves to T as well.

    before –S– rod b   →   T –U– rod b        the vector between the two balls keeps its direction        (MMT Fig. 13)
"""

from __future__ import annotations

from collections.abc import Iterator

from ...mechanism import JointType
from ...mechanism.composites import WordGraph
from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import State, ball_to_universal


def companions(evidence: Evidence, link: str) -> tuple[str, ...]:
    """The other rods of the group of equal parallel rods that holds ``link``, in the real robot."""
    mechanism = evidence.mechanism
    graph = WordGraph(mechanism, {mechanism.base, mechanism.platform}).recognise()
    for edge in graph.edges():
        if link in edge.inside and len(edge.joints) == 2 * len(edge.inside):
            return tuple(other for other in edge.inside if other != link)
    return ()


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All taken-over chains of the leg that observe one of several equal parallel rods."""
    before = state
    moved: list[str] = []
    for chain in state.chain(leg):
        proximal = evidence.proximal(chain.link)
        if not chain.taken or proximal is None or chain.before is None:
            continue
        mechanism = state.mechanism
        actuator = mechanism.joints[chain.actuator]
        joints = []
        for rod in companions(evidence, chain.link):
            near = next((j for j in mechanism.joints_of(rod) if j.other(rod) == chain.before), None)
            if near is None:
                continue
            if not (trust or proximal.keeps(near.point - chain.anchor)):
                yield Refusal("the vector between the two rods' joints changes its direction")
                return
            if near.type is JointType.SPHERICAL and actuator.type is JointType.UNIVERSAL:
                near = ball_to_universal(near, chain.before, (actuator.axes[0], actuator.axes[1]))
            if chain.carrier != chain.before:
                near = near.relinked(chain.before, chain.carrier)
            joints.append(near)
            moved.append(rod)
        if joints:
            state = state.with_chain(chain, chain, mechanism.changed(joints=joints))
    if state is not before:
        yield Proposal(state, f"{', '.join(map(repr, moved))} keeps its place beside the observed rod")


RULE = Rule("companion", "MMT Fig. 13", propose)
