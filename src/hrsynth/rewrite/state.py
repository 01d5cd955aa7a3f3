"""State of a rewriting: the mechanism so far, and the virtual chain of each observation in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..geometry.vectors import Array
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.notation import Architecture
from ..results import Value


@dataclass(frozen=True, eq=False, repr=False)
class VirtualChain(Value):
    """The virtual chain of one observation: reference –sliders– carrier T –actuator– (bearing W –roll R(d)–) link ℓ.

    ``anchor`` is A and ``direction`` u at the zero configuration, in the base frame. ``k_joint`` names the real joint
    K before ℓ, ``before`` the link before it; ``carrier`` may be a real link that only translates.
    """

    leg: str
    link: str
    direction: Array
    anchor: Array
    k_joint: str | None
    before: str | None
    carrier: str
    sliders: tuple[str, ...]
    slider_links: tuple[str, ...]
    actuator: str
    bearing: str | None
    roll: str | None
    taken: bool = False
    spins: bool = False
    """True if the joint substitution left the actuator's axes free."""


@dataclass(frozen=True, eq=False, repr=False)
class ObservationChain(Value):
    """The virtual chain of an observation that is no direction of a segment: its own ``links`` and ``joints`` between
    the ``reference`` link and ``link``, the joints that are ``actuators``. An encoder has neither links nor joints: its
    actuator is the real joint."""

    leg: str
    link: str
    reference: str
    links: tuple[str, ...]
    joints: tuple[str, ...]
    actuators: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class State(Value):
    """A mechanism on its way from the real robot to its hidden robot."""

    real: LegDecomposition
    mechanism: Mechanism
    chains: tuple[VirtualChain, ...] = ()
    removed: tuple[str, ...] = ()
    """Labels of the legs that were dropped."""
    owners: Mapping[str, str] = field(default_factory=dict)
    """The leg of each virtual link."""
    sensors: tuple[ObservationChain, ...] = ()
    """The chains of observations that are no directions of segments: they stay as the lift makes them."""

    @property
    def actuators(self) -> set[str]:
        """The joints that the chains actuate."""
        return {chain.actuator for chain in self.chains} | {name for each in self.sensors for name in each.actuators}

    @property
    def watched(self) -> set[str]:
        """The links that sensors observe or see from."""
        return {link for each in self.sensors for link in (each.link, each.reference)}

    def chain(self, leg: str) -> tuple[VirtualChain, ...]:
        """The chains of a leg."""
        return tuple(chain for chain in self.chains if chain.leg == leg)

    def with_chain(
        self, old: VirtualChain, new: VirtualChain | None, mechanism: Mechanism, owners: Mapping[str, str] | None = None
    ) -> State:
        """The state with one chain replaced (or dropped) and another mechanism."""
        chains = tuple(c for each in self.chains for c in ((new,) if each is old else (each,)) if c is not None)
        table = {**self.owners, **(owners or {})}
        return replace(
            self, mechanism=mechanism, chains=chains, owners={k: v for k, v in table.items() if k in mechanism.links}
        )

    def observed_labels(self) -> tuple[str, ...]:
        """Labels of the legs that still have a virtual chain, and of what else is observed, in order."""
        return tuple(dict.fromkeys([*(chain.leg for chain in self.chains), *(each.leg for each in self.sensors)]))

    def decomposition(self) -> LegDecomposition:
        """The legs of the rewritten mechanism: the real ones that are left, with their virtual links."""
        mechanism = self.mechanism
        legs = []
        for leg in self.real.legs:
            if leg.label in self.removed:
                continue
            links = [n for n in leg.links if n in mechanism.links]
            links += [n for n in mechanism.links if self.owners.get(n) == leg.label]
            legs.append(replace(leg, links=tuple(links), joints=tuple(self._joints(leg, set(links)))))
        drawn = mechanism
        for chain in self.sensors:
            if chain.joints:
                drawn = self._hung(drawn, chain, legs)
        return LegDecomposition(drawn, tuple(n for n in self.real.platform if n in mechanism.links), tuple(legs))

    def _hung(self, mechanism: Mechanism, chain: ObservationChain, legs: list[Leg]) -> Mechanism:
        """Put a sensor's chain into the leg that has its link or else its reference, or make it a leg of its own; as it
        is drawn and written: what it hangs on outside of that is taken for the base."""
        for link in (chain.link, chain.reference):
            for number, leg in enumerate(legs):
                if link in leg.links:
                    own = {mechanism.base, leg.platform_link, *leg.links}
                    legs[number] = replace(leg, links=(*leg.links, *chain.links), joints=(*leg.joints, *chain.joints))
                    return _move_ends_to_base(mechanism, chain, own)
        attach = chain.reference if chain.link == mechanism.base else chain.link
        legs.append(Leg(chain.leg, chain.links, chain.joints, attach))
        return _move_ends_to_base(mechanism, chain, {mechanism.base, attach})

    def _joints(self, leg: Leg, links: set[str]) -> list[str]:
        mechanism = self.mechanism
        ends = {mechanism.base, leg.platform_link}
        names = []
        others = {n for other in self.real.legs if other.label != leg.label for n in other.links}
        others |= {n for n, owner in self.owners.items() if owner != leg.label}
        others |= {n for chain in self.sensors for n in chain.links}
        others.discard(mechanism.reference)
        for joint in mechanism.joints.values():
            touches = set(joint.links)
            alone = touches == ends and (
                joint.name in leg.joints
                or leg.takes_platform
                or any(c.leg == leg.label and c.actuator == joint.name for c in self.chains)
            )
            if alone or (touches & links and not (touches - links) & others):
                names.append(joint.name)
        return names

    def architecture(self) -> Architecture:
        """The architecture so far, in words."""
        return self.decomposition().architecture()


def _move_ends_to_base(mechanism: Mechanism, chain: ObservationChain, known: set[str]) -> Mechanism:
    """Return the state with the ends of a chain that lie on no known link moved to the base."""
    ends = [(chain.joints[0], chain.reference), (chain.joints[-1], chain.link)]
    joints = {name: mechanism.joints[name].relinked(link, mechanism.base) for name, link in ends if link not in known}
    return mechanism.changed(joints=joints.values()) if joints else mechanism


def orient_joint(joint: Joint, before: str) -> Joint:
    """The joint with ``before`` as its predecessor."""
    return joint if joint.predecessor == before else joint.turned()


def convert_ball_to_universal(joint: Joint, before: str, axes: tuple[Array, Array]) -> Joint:
    """An S made a U whose first axis is fixed in ``before``."""
    return replace(orient_joint(joint, before), type=JointType.UNIVERSAL, axes=axes, wrist=None)
