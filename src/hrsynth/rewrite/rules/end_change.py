"""End change: the last S of an observed leg becomes U.

    T –U̲– rod –S– platform   →   T –U̲– rod –U– platform        (MMT 3.2 last remark, 4.2.2, Fig. 13)

The inner axes of the two U are parallel, and so are the outer ones. Where the actuator's axes are free, several
directions fixed in T are tried for the outer axis: whether the platform stays held depends on it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...geometry.vectors import Array, perpendicular, unit
from ...mechanism import Joint, JointType
from ..evidence import Evidence
from ..rule import Proposal, Refusal, Rule
from ..state import Chain, State, ball_to_universal
from .companion import companions

_TRIES = ((0.0, 0.0, 0.0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (0, 1, 1), (0, 1, -1), (1, 2, 3), (3, -1, 2))
"""Outer axes in the leg's own frame (u, side, u × side); zero: the axis as it is."""


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """All observed legs at once (``leg`` is ignored): one proposal for each direction of the outer axis."""
    chains = [chain for chain in state.chains if chain.taken and _ends(state, evidence, chain)]
    if not chains:
        yield Refusal("no observed leg ends in an S whose rod the actuator moves")
        return
    for trial in _TRIES:
        if any(trial) and not any(chain.spins for chain in chains):
            return
        result = state
        words = []
        for chain in chains:
            result, outer = _changed(result, evidence, chain, np.asarray(trial, dtype=float))
            words.append(f"leg {chain.leg}: {_text(outer)}")
        yield Proposal(result, "the last S becomes U, inner axes parallel, outer axes parallel to " + ", ".join(words))


def _text(axis: Array) -> str:
    return "(" + " ".join(f"{value + 0.0:.3f}" for value in axis) + ")"


def _rods(evidence: Evidence, chain: Chain) -> tuple[str, ...]:
    return (chain.link, *companions(evidence, chain.link))


def _ends(state: State, evidence: Evidence, chain: Chain) -> list[Joint]:
    """The S joints between the leg and its end on the platform."""
    leg = state.real.leg(chain.leg)
    if state.mechanism.joints[chain.actuator].type is not JointType.UNIVERSAL:
        return []
    inside = set(leg.links)
    return [j for j in state.mechanism.joints_of(leg.attach)
            if j.type is JointType.SPHERICAL and j.other(leg.attach) in inside]


def _changed(state: State, evidence: Evidence, chain: Chain, trial: Array) -> tuple[State, Array]:
    mechanism = state.mechanism
    leg = state.real.leg(chain.leg)
    actuator = mechanism.joints[chain.actuator]
    axes: tuple[Array, Array] = (actuator.axes[0], actuator.axes[1])
    joints: list[Joint] = []
    if chain.spins and trial.any():
        others = [j for rod in companions(evidence, chain.link) for j in mechanism.joints_of(rod)
                  if j.other(rod) == chain.carrier]
        side = perpendicular(chain.direction, others[0].point - chain.anchor if others else None)
        outer = unit(np.column_stack([chain.direction, side, np.cross(chain.direction, side)]) @ trial)
        axes = (outer, unit(np.cross(outer, chain.direction)))
        joints.extend(ball_to_universal(j, chain.carrier, axes) for j in (actuator, *others))
    for end in _ends(state, evidence, chain):
        joints.append(ball_to_universal(end, end.other(leg.attach), (axes[1], axes[0])))
    return state.with_chain(chain, chain, mechanism.changed(joints=joints)), axes[0]


RULE = Rule("end change", "MMT 3.2, 4.2.2", propose)
