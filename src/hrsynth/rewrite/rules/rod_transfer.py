"""Rod transfer: the rod parallel to an observed one moves to T as well.

before –S– rod b   →   T –U– rod b        the vector between the two S keeps its direction        (MMT Fig. 13)
"""

from __future__ import annotations

from collections.abc import Iterator

from ...mechanism import Joint, JointType
from ..evidence import Evidence
from ..rule import AXES, LOOPS, Match, Rule, Stage, list_chain_places
from ..state import State, VirtualChain, convert_ball_to_universal

Beside = tuple[VirtualChain, list[Joint]]
"""A chain, and the joints on the link before K of the rods beside its link."""


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Beside]]:
    """The rods beside the observed one, where the actuator has taken the place of that one's joint."""
    proximal = evidence.proximal(chain.link)
    if not chain.taken or proximal is None or chain.before is None:
        return
    rods: dict[str, Joint] = {}
    for rod in evidence.parallel_rods(chain.link):
        for joint in state.mechanism.joints_of(rod):
            if joint.other(rod) == chain.before:
                rods.setdefault(rod, joint)
    if rods:
        kept = all(proximal.has_constant_direction(joint.point - chain.anchor) for joint in rods.values())
        yield Match(
            (chain, list(rods.values())),
            f"{', '.join(map(repr, rods))} stays parallel to the observed rod",
            None if kept else "the vector between the two rods' joints changes direction",
        )


def apply(state: State, found: Beside) -> State:
    """The rods' joints moved to T, an S made a U as the actuator is one."""
    chain, joints = found
    mechanism, before = state.mechanism, str(chain.before)
    actuator = mechanism.joints[chain.actuator]
    moved = [
        convert_ball_to_universal(joint, before, (actuator.axes[0], actuator.axes[1]))
        if joint.type is JointType.SPHERICAL and actuator.type is JointType.UNIVERSAL
        else joint
        for joint in joints
    ]
    if chain.carrier != before:
        moved = [joint.relinked(before, chain.carrier) for joint in moved]
    return state.with_chain(chain, chain, mechanism.changed(joints=moved))


RULE = Rule("rod transfer", "MMT Fig. 13", Stage.BESIDE, find, apply, list_chain_places, keeps=(LOOPS, AXES))
