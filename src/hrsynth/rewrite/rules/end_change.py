"""End change: the last S of an observed leg becomes U.

    T –U̲– rod –S– platform   →   T –U̲– rod –U– platform        (MMT 3.2 last remark, 4.2.2, Fig. 13)

The inner axes of the two U are parallel, and so are the outer ones. Where the actuator's axes are free, several
directions fixed in T are tried for the outer axis: whether the platform stays held depends on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.vectors import Array, find_perpendicular, normalise_vector
from ...mechanism import Joint, JointType
from ..evidence import Evidence
from ..rule import AXES, LOOPS, Match, Refusal, Rule, Stage, list_leg_place
from ..state import State, VirtualChain, convert_ball_to_universal

OUTER_AXES = ((0.0, 0.0, 0.0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (0, 1, 1), (0, 1, -1), (1, 2, 3), (3, -1, 2))
"""Outer axes that are tried, in the leg's own frame (u, side, u × side); zero: the axis as it is."""


@dataclass(frozen=True, eq=False)
class LegEnds:
    """The S joints (``ends``) by which a chain's leg ends on a link of the platform, the joints of parallel rods on T,
    and the two axes of the U that they are to become."""

    chain: VirtualChain
    attach: str
    ends: list[Joint]
    beside: list[Joint]
    axes: tuple[Array, Array]
    turned: bool
    """True if these are not the actuator's axes: then it and the joints of the parallel rods get them as well."""

    def with_outer(self, trial: Array) -> LegEnds:
        """Return the ends with another outer axis where the actuator's axes are free."""
        if not (self.chain.spins and trial.any()):
            return self
        u = self.chain.direction
        side = find_perpendicular(u, self.beside[0].point - self.chain.anchor if self.beside else None)
        outer = normalise_vector(np.column_stack([u, side, np.cross(u, side)]) @ trial)
        return replace(self, axes=(outer, normalise_vector(np.cross(outer, u))), turned=True)


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[list[LegEnds]] | Refusal]:
    """Yield all observed legs at once: a match for each direction of the outer axis."""
    found = [
        ends
        for chain in state.chains
        if chain.taken and (ends := _classify_leg_ends(state, evidence, chain)) is not None
    ]
    if not found:
        yield Refusal("no observed leg ends in an S whose rod the actuator moves")
    elif any(each.chain.spins for each in found):
        for trial in OUTER_AXES:
            yield _match([each.with_outer(np.asarray(trial, dtype=float)) for each in found])
    else:
        yield _match(found)


def _match(found: list[LegEnds]) -> Match[list[LegEnds]]:
    axes = (" ".join(f"{value + 0.0:.3f}" for value in each.axes[0]) for each in found)
    words = ", ".join(f"leg {each.chain.leg}: ({axis})" for each, axis in zip(found, axes, strict=True))
    return Match(found, f"the last S becomes U, inner axes parallel, outer axes parallel to {words}")


def _classify_leg_ends(state: State, evidence: Evidence, chain: VirtualChain) -> LegEnds | None:
    """Return the ends of a leg; None if its actuator is no U or its ends are no S."""
    mechanism, leg = state.mechanism, state.real.leg(chain.leg)
    actuator = mechanism.joints[chain.actuator]
    ends = [
        j
        for j in mechanism.joints_of(leg.platform_link)
        if j.type is JointType.SPHERICAL and j.other(leg.platform_link) in leg.links
    ]
    if actuator.type is not JointType.UNIVERSAL or not ends:
        return None
    beside = [
        j
        for rod in evidence.parallel_rods(chain.link)
        for j in mechanism.joints_of(rod)
        if j.other(rod) == chain.carrier
    ]
    return LegEnds(chain, leg.platform_link, ends, beside, (actuator.axes[0], actuator.axes[1]), False)


def apply(state: State, found: list[LegEnds]) -> State:
    """U for S at all ends, and the actuators with the axes that were chosen."""
    for each in found:
        mechanism, (outer, inner) = state.mechanism, each.axes
        joints = [
            convert_ball_to_universal(end, end.other(each.attach), (inner, outer))
            for end in each.ends
            if mechanism.joints[end.name].type is JointType.SPHERICAL
        ]
        if each.turned:
            joints += [
                convert_ball_to_universal(joint, each.chain.carrier, each.axes)
                for joint in (mechanism.joints[each.chain.actuator], *each.beside)
            ]
        state = state.with_chain(each.chain, each.chain, mechanism.changed(joints=joints))
    return state


RULE = Rule("end change", "MMT 3.2, 4.2.2", Stage.ENDS, find, apply, list_leg_place, keeps=(LOOPS, AXES))
