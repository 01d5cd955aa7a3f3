"""Centre locus: the virtual chain needs only as many sliders as the locus of A has dimensions.

PPP – T   →   (nothing) / P – T / PP – T        A is fixed / on a line / in a plane        (MMT 3.2)
PPP – T   →   T is the link before K             that link only translates
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...geometry.vectors import Array
from ...mechanism import Joint, JointType
from ..evidence import Evidence
from ..rule import AXES, LOOPS, Match, Rule, Stage, list_chain_places
from ..state import State, VirtualChain

Carried = tuple[VirtualChain, str | Array]
"""A chain, and the link that is to be its carrier, or the axes (n, 3) along which its own carrier is to slide."""


def find(state: State, evidence: Evidence, chain: VirtualChain) -> Iterator[Match[Carried]]:
    """Yield the locus of the chain's centre A; nothing if that is all of space, or if the part before the observed link
    is not a separate chain."""
    proximal, reference = evidence.proximal(chain.link), state.mechanism.reference
    if proximal is None or chain.before is None:
        return
    locus = proximal.anchor_locus
    if proximal.is_translating and chain.before != reference:
        yield Match((chain, chain.before), "the link before the observed one only translates: it carries the actuator")
    elif proximal.is_translating or locus.dimension == 0:
        yield Match((chain, reference), "the proximal centre is fixed")
    elif locus.dimension < 3:
        yield Match(
            (chain, locus.axes[: locus.dimension]),
            f"the proximal centre moves {'on a line' if locus.dimension == 1 else 'in a plane'}",
        )


def apply(state: State, found: Carried) -> State:
    """T is the carrier, or stands on one P or two."""
    chain, carrier = found
    return _place_on_locus(state, chain, carrier) if isinstance(carrier, str) else _add_sliders(state, chain, carrier)


def _place_on_locus(state: State, chain: VirtualChain, carrier: str) -> State:
    mechanism = state.mechanism
    actuator = mechanism.joints[chain.actuator].relinked(chain.carrier, carrier)
    changed = mechanism.changed(remove_links=[chain.carrier, *chain.slider_links], joints=[actuator])
    order = [n for n in mechanism.joints if n in changed.joints]
    changed = replace(changed, joints={n: changed.joints[n] for n in order})
    return state.with_chain(chain, replace(chain, carrier=carrier, sliders=(), slider_links=()), changed)


def _add_sliders(state: State, chain: VirtualChain, axes: Array) -> State:
    mechanism = state.mechanism
    links = chain.slider_links[: len(axes) - 1]
    path = [mechanism.reference, *links, chain.carrier]
    names = chain.sliders[: len(axes)]
    joints = [
        Joint(name, JointType.PRISMATIC, a, b, chain.anchor, (axis,))
        for name, a, b, axis in zip(names, path, path[1:], axes, strict=False)
    ]
    changed = mechanism.changed(
        remove_links=chain.slider_links[len(links) :], remove_joints=chain.sliders, joints=joints
    )
    return state.with_chain(chain, replace(chain, sliders=names, slider_links=links), changed)


RULE = Rule(
    "centre locus",
    "MMT 3.2",
    Stage.ANCHOR,
    find,
    apply,
    list_chain_places,
    otherwise="the proximal centre moves in space, or the part before the observed link is not a separate chain",
    keeps=(LOOPS, AXES),
)
