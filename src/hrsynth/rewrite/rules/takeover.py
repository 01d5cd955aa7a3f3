"""Takeover: the actuator takes the place of the real joint K before the observed link.

    before –K– ℓ,  T –U̲– W –R(d)– ℓ   →   before –S– T –U̲– ℓ        (MMT Fig. 2(b))

K is R, U or S and, with the link before it held still, moves u over its whole locus; and either (i) ℓ can turn about
its own direction with every other link at rest (the actuator's axes stay as they are), or (ii) K is an R, or a U whose
first axis keeps its direction, and the actuator takes K's own axes. Where the link before turns about one constant
direction an R carries T instead of an S; where it only translates it is T itself. Joints that slide are never taken
over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...geometry.lines import parallel
from ...mechanism import Joint, JointType
from ..evidence import Evidence, Proximal
from ..rule import Proposal, Refusal, Rule
from ..state import Chain, State, towards


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All chains of the leg whose knee is not on the reference link itself."""
    yield from proposals(state, evidence, leg, trust, on_reference=False)


def proposals(state: State, evidence: Evidence, leg: str, trust: bool, *,
              on_reference: bool) -> Iterator[Proposal | Refusal]:
    """The takeover of knees on the reference link, or of all others."""
    before = state
    notes: list[str] = []
    for chain in state.chain(leg):
        if chain.taken or (chain.before == evidence.reference) != on_reference:
            continue
        if chain.knee is not None and chain.knee not in state.mechanism.joints:
            notes.append(f"{chain.knee!r} before {chain.link!r} is taken over already")
            continue
        result = _taken(state, evidence, chain, trust)
        if isinstance(result, Refusal):
            yield result
            return
        state, note = result
        notes.append(note)
    if state is not before:
        yield Proposal(state, "; ".join(notes))


def _taken(state: State, evidence: Evidence, chain: Chain, trust: bool) -> tuple[State, str] | Refusal:
    mechanism = state.mechanism
    proximal = evidence.proximal(chain.link)
    if proximal is None or chain.knee is None or chain.before is None:
        return Refusal("no single R, U or S joint stands before the observed link")
    knee = towards(mechanism.joints[chain.knee], chain.before)
    actuator = mechanism.joints[chain.actuator]
    if (own := _own_axes(knee, actuator, proximal)) is not None:
        taken, spins, note = own, False, f"the actuator takes the axes of {knee.name!r}"
    elif evidence.spins(chain.link, chain.direction) and knee.type is not JointType.REVOLUTE:
        taken, spins = actuator, True
        note = f"{chain.link!r} can turn about its own direction with all else at rest"
    elif trust:
        taken, spins, note = actuator, True, "done without its side condition"
    else:
        return Refusal(f"{chain.link!r} cannot turn about its own direction, and {knee.name!r} is not an R or a U "
                       "whose axes the actuator could take")
    joint = replace(taken, name=actuator.name, motor=actuator.motor, predecessor=chain.carrier, successor=chain.link,
                    point=chain.anchor if taken is actuator else taken.point, in_tree=True, limits=None, xml=())
    joints = [joint]
    if chain.carrier != chain.before:
        joints.append(_follower(state, chain, proximal))
    changed = mechanism.changed(remove_links=[chain.bearing] if chain.bearing else [],
                                remove_joints=[chain.knee], joints=joints)
    return state.with_chain(chain, replace(chain, taken=True, spins=spins, bearing=None, roll=None), changed), note


def _own_axes(knee: Joint, actuator: Joint, proximal: Proximal) -> Joint | None:
    """K itself, where condition (ii) holds: as many axes as the direction has ways to move, the first one steady."""
    if knee.type is not actuator.type or not proximal.keeps(knee.axis):
        return None
    if knee.type is JointType.REVOLUTE and not parallel(knee.axis, actuator.axis):
        return None
    return knee


def _follower(state: State, chain: Chain, proximal: Proximal) -> Joint:
    """The joint by which T follows the link before K at A."""
    name = state.mechanism.fresh(f"follow_{chain.leg}")
    axis = proximal.turning_axis
    if axis is not None:
        return Joint(name, JointType.REVOLUTE, str(chain.before), chain.carrier, chain.anchor, (axis,))
    return Joint(name, JointType.SPHERICAL, str(chain.before), chain.carrier, chain.anchor)


RULE = Rule("takeover", "MMT 3.2, Fig. 2(b)", propose)
