"""Π form: a carrier on a circle about a base R is the coupler of a planar parallelogram.

    {R-PP} – T   →   Π – T        A on a circle about a base R joint        (MMT Fig. 4(c))

The real link before K is one crank where it already carries T; otherwise both cranks are new.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...geometry.lines import foot
from ...geometry.vectors import pose
from ...mechanism import Joint, JointType, Link
from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import State


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All chains of the leg whose carrier slides on PP behind one R."""
    before = state
    for chain in state.chain(leg):
        proximal = evidence.proximal(chain.link)
        if proximal is None or len(chain.sliders) != 2:
            continue
        base = proximal.single_revolute
        if base is None:
            yield Refusal("the anchor is not on a circle about a base R joint")
            return
        mechanism = state.mechanism
        reference = mechanism.reference
        centre = foot(chain.anchor, base.point, base.axis)
        side = np.cross(base.axis, chain.anchor - centre)
        offsets = [side] if chain.taken else [np.zeros(3), side]
        links, joints = [], []
        for number, offset in enumerate(offsets):
            tag = f"{chain.leg}" if number == len(offsets) - 1 else f"{chain.leg}_0"
            crank = mechanism.fresh(f"crank_{tag}")
            links.append(Link(crank, pose(centre + offset)))
            joints.append(Joint(mechanism.fresh(f"crank_base_{tag}"), JointType.REVOLUTE, reference, crank,
                                centre + offset, (base.axis,)))
            joints.append(Joint(mechanism.fresh(f"crank_tip_{tag}"), JointType.REVOLUTE, crank, chain.carrier,
                                chain.anchor + offset, (base.axis,)))
        changed = mechanism.changed(remove_links=chain.slider_links, remove_joints=chain.sliders, links=links,
                                    joints=joints)
        state = state.with_chain(chain, replace(chain, sliders=(), slider_links=()), changed,
                                 {link.name: chain.leg for link in links})
    if state is not before:
        yield Proposal(state, "the anchor moves on a circle about a base R joint")


RULE = Rule("pi form", "MMT Fig. 4(c)", propose)
