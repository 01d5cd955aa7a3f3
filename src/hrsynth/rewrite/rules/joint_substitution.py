"""Joint substitution: the virtual actuator replaces the real joint K before the observed link.

    before –K– ℓ,  T –U̲– W –R(d)– ℓ   →   before –S– T –U̲– ℓ        (MMT Fig. 2(b))

K is R, U or S and alone moves u over its whole locus. In addition, either (i) ℓ can rotate about its direction
while every other link is fixed (the actuator's axes stay), or (ii) K is an R, or a U whose first axis keeps its
direction, and the actuator takes K's axes. Where the link before K rotates about one constant direction, an R
carries T instead of an S; where it only translates, it is T itself. Prismatic joints are never substituted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ...geometry.lines import is_parallel
from ...geometry.vectors import Array
from ...mechanism import Joint, JointType
from ..evidence import Evidence, ProximalChain
from ..rule import AXES, LOOPS, Match, Refusal, Rule, Stage, list_chain_places
from ..state import State, VirtualChain, orient_joint


@dataclass(frozen=True, eq=False)
class Substitution:
    """Substitution of K by a chain's actuator: ``own`` is K where the actuator takes its axes (None: the actuator's
    stay), ``turning`` the constant axis about which the link before K rotates (None: no single one)."""

    chain: VirtualChain
    own: Joint | None
    turning: Array | None


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Substitution | None] | Refusal]:
    """A joint K that is not on the reference link itself."""
    if chain.before != evidence.reference:
        yield from find_substitution(state, evidence, chain)


def find_substitution(
    state: State, evidence: Evidence, chain: VirtualChain
) -> Iterator[Match[Substitution | None] | Refusal]:
    """Yield the joint K of a chain that has substituted none; None if another chain of the leg has substituted it."""
    if chain.taken:
        return
    if chain.k_joint is not None and chain.k_joint not in state.mechanism.joints:
        yield Match(None, f"{chain.k_joint!r} before {chain.link!r} is already substituted")
        return
    if chain.link in state.watched:
        yield Refusal(f"{chain.link!r} carries a camera or another observation")
        return
    proximal = evidence.proximal(chain.link)
    if proximal is None or chain.k_joint is None or chain.before is None:
        yield Refusal("no single R, U or S joint stands before the observed link")
        return
    K = orient_joint(state.mechanism.joints[chain.k_joint], chain.before)
    if _has_constant_first_axis(K, state.mechanism.joints[chain.actuator], proximal):
        yield Match(Substitution(chain, K, proximal.turning_axis), f"the actuator takes the axes of {K.name!r}")
        return
    found = Substitution(chain, None, proximal.turning_axis)
    if K.type is not JointType.REVOLUTE and evidence.can_spin(chain.link, chain.direction):
        yield Match(found, f"{chain.link!r} can rotate about its own direction while all other links are fixed")
    else:
        yield Match(
            found,
            "applied without its side condition",
            unmet=f"{chain.link!r} cannot rotate about its own direction, and {K.name!r} is not an R or a U "
            "whose axes the actuator could take",
        )


def _has_constant_first_axis(K: Joint, actuator: Joint, proximal: ProximalChain) -> bool:
    """Condition (ii): K has as many axes as the direction has ways to move, the first one steady."""
    return (
        K.type is actuator.type
        and proximal.has_constant_direction(K.axis)
        and (K.type is not JointType.REVOLUTE or is_parallel(K.axis, actuator.axis))
    )


def apply(state: State, found: Substitution | None) -> State:
    """The actuator between T and ℓ in K's place, and T following the link before K at A."""
    if found is None:
        return state
    mechanism, chain = state.mechanism, found.chain
    actuator = mechanism.joints[chain.actuator]
    taken = replace(actuator, point=chain.anchor) if found.own is None else found.own
    joints = [
        replace(
            taken,
            name=actuator.name,
            motor=actuator.motor,
            predecessor=chain.carrier,
            successor=chain.link,
            in_tree=True,
            limits=None,
            turns=(),
            xml=(),
            offset=None,
        )
    ]
    if chain.carrier != chain.before:
        kind, axes = (JointType.SPHERICAL, ()) if found.turning is None else (JointType.REVOLUTE, (found.turning,))
        joints.append(
            Joint(mechanism.fresh(f"follow_{chain.leg}"), kind, str(chain.before), chain.carrier, chain.anchor, axes)
        )
    changed = mechanism.changed(
        remove_links=[chain.bearing] if chain.bearing else [], remove_joints=[str(chain.k_joint)], joints=joints
    )
    return state.with_chain(
        chain, replace(chain, taken=True, spins=found.own is None, bearing=None, roll=None), changed
    )


RULE = Rule(
    "joint substitution", "MMT 3.2, Fig. 2(b)", Stage.JOINT, find, apply, list_chain_places, keeps=(LOOPS, AXES), rank=1
)
