"""Π form: a carrier on a circle about a base R is the coupler of a planar parallelogram.

    {R-PP} – T   →   Π – T        A on a circle about a base R joint        (MMT Fig. 4(c))

The real link before K is one crank where it already carries T; otherwise both cranks are new.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...geometry.lines import project_to_line
from ...geometry.vectors import build_pose
from ...mechanism import Joint, JointType, Link
from ..evidence import Evidence
from ..rule import Match, Refusal, Rule, Stage, list_chain_places
from ..state import State, VirtualChain

Circling = tuple[VirtualChain, Joint]
"""Chain, and the base R about which its centre A moves on a circle."""


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Circling] | Refusal]:
    """A chain whose carrier slides on PP behind one R."""
    proximal = evidence.proximal(chain.link)
    if proximal is None or len(chain.sliders) != 2:
        return
    if proximal.single_revolute is None:
        yield Refusal("the proximal centre is not on a circle about a base R joint")
        return
    yield Match((chain, proximal.single_revolute), "the proximal centre moves on a circle about a base R joint")


def apply(state: State, found: Circling) -> State:
    """Cranks from the reference link to T in the place of the sliders: one beside the real one, or two."""
    chain, base = found
    mechanism = state.mechanism
    centre = project_to_line(chain.anchor, base.point, base.axis)
    side = np.cross(base.axis, chain.anchor - centre)
    offsets = {chain.leg: side} if chain.taken else {f"{chain.leg}_0": np.zeros(3), chain.leg: side}
    links, joints = [], []
    for tag, offset in offsets.items():
        crank = Link(mechanism.fresh(f"crank_{tag}"), build_pose(centre + offset))
        links.append(crank)
        joints.append(
            Joint(
                mechanism.fresh(f"crank_base_{tag}"),
                JointType.REVOLUTE,
                mechanism.reference,
                crank.name,
                centre + offset,
                (base.axis,),
            )
        )
        joints.append(
            Joint(
                mechanism.fresh(f"crank_tip_{tag}"),
                JointType.REVOLUTE,
                crank.name,
                chain.carrier,
                chain.anchor + offset,
                (base.axis,),
            )
        )
    changed = mechanism.changed(
        remove_links=chain.slider_links, remove_joints=chain.sliders, links=links, joints=joints
    )
    return state.with_chain(
        chain, replace(chain, sliders=(), slider_links=()), changed, {link.name: chain.leg for link in links}
    )


RULE = Rule("pi form", "MMT Fig. 4(c)", Stage.FORM, find, apply, list_chain_places, keeps=("no Π is flat",))
