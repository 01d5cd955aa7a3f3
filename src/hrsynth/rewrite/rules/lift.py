"""The exact lift: a virtual chain that constrains nothing measures what the sensor sees, whatever the kind.

    reference –P–P–P– T –U̲– W –R(d)– ℓ        (docs/pages/theory.md, section 3; MMT Fig. 2(b); always)
    reference –U̲(C)–P–S(B)– ℓ, and so on        each kind has its chain (docs/pages/observations.md)
    R – → R̲ –                                  an encoder actuates its joint

Of a direction T only translates relative to the reference link, so the first axis of U̲ keeps its direction there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ...geometry.vectors import Array, build_pose
from ...mechanism import Joint, JointType, Link, Motor, Observation
from ...mechanism.cameras import CameraObservation, VirtualJoint
from ...mechanism.observations.direction import SeenAxis
from ...mechanism.observations.encoder import Encoder
from ..evidence import Evidence, ProximalChain
from ..rule import AXES, Match, Rule, Stage, list_leg_place
from ..state import ObservationChain, State, VirtualChain

SEGMENT = ("slide_x", "slide_y", "slide_z", "virtual", "roll"), ("guide_x", "guide_y", "carrier", "bearing")
"""The names of the joints and links of a direction's chain."""


@dataclass(frozen=True, eq=False)
class LiftedChain:
    """Virtual chain between ``reference`` and ``link`` for an observation with the label ``leg``. ``proximal`` is the
    part before ℓ, None unless a segment's direction is observed; ``tag`` makes the chain's names unique."""

    leg: str
    tag: str
    link: str
    reference: str
    joints: tuple[VirtualJoint, ...]
    segment: bool
    proximal: ProximalChain | None = None


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[list[LiftedChain | Encoder]]]:
    """Yield one match for each leg: a chain for each of its observations."""
    found: list[LiftedChain | Encoder] = []
    for index, observation in enumerate(evidence.samples.observation_model.observations):
        if observation.leg != leg:
            continue
        tag = f"{leg}_{index}" if found else leg
        if isinstance(observation, Encoder):
            found.append(observation)
        elif observation.is_segment_direction:
            found.append(_lift_segment(state, evidence, observation, index, tag))
        else:
            found.append(_lift_sensor(state, evidence, observation, index, tag))
    words = dict.fromkeys(
        "an encoder actuates its joint"
        if isinstance(each, Encoder)
        else "PPP-U̲-R(d) from the reference link to the observed link constrains nothing"
        if each.segment
        else "a chain of six dof from the reference link to the observed link constrains nothing"
        for each in found
    )
    yield Match(found, "; ".join(words))


def _lift_segment(state: State, evidence: Evidence, seen: Observation, index: int, tag: str) -> LiftedChain:
    """Return the chain of a direction, with the proximal centre A where the leg's joint K is."""
    assert isinstance(seen, SeenAxis)
    links, reference = state.mechanism.links, state.mechanism.reference
    link = evidence.carrier(seen.link)
    proximal, before = evidence.proximal(link), evidence.joints_before(link)
    anchor = proximal.anchor if proximal else before[0].point if before else links[link].pose[:3, 3]
    at = seen.sighting(links[reference].pose, links[seen.link].pose, evidence.far(index))
    return LiftedChain(seen.leg, tag, link, reference, seen.chain(replace(at, B=anchor)), True, proximal)


def _lift_sensor(state: State, evidence: Evidence, seen: Observation, index: int, tag: str) -> LiftedChain:
    """Return the chain of any other observation."""
    assert isinstance(seen, SeenAxis | CameraObservation)
    links, reference = state.mechanism.links, seen.seen_from or state.mechanism.reference
    at = seen.sighting(links[reference].pose, links[seen.link].pose, evidence.far(index))
    return LiftedChain(seen.leg, tag, seen.link, reference, seen.chain(at), False)


def apply(state: State, found: list[LiftedChain | Encoder]) -> State:
    """The robot with these chains, and these joints actuated."""
    for each in found:
        state = _encode(state, each) if isinstance(each, Encoder) else _lift(state, each)
    return state


def _lift(state: State, lifting: LiftedChain) -> State:
    mechanism, tag = state.mechanism, lifting.tag
    count = len(lifting.joints)
    names, between = (
        SEGMENT
        if lifting.segment
        else (
            tuple(f"sense_{number}" for number in range(1, count + 1)),
            tuple(f"sensor_{number}" for number in range(1, count)),
        )
    )
    joint_names, link_names = ([mechanism.fresh(f"{name}_{tag}") for name in each] for each in (names, between))
    path = [lifting.reference, *link_names, lifting.link]
    joints = [
        Joint(name, JointType(joint.letter), a, b, joint.at, joint.axes, Motor(name) if joint.actuated else None)
        for name, joint, a, b in zip(joint_names, lifting.joints, path, path[1:], strict=False)
    ]
    links = [Link(name, build_pose(joint.at)) for name, joint in zip(link_names, lifting.joints, strict=False)]
    changed = mechanism.changed(links=links, joints=joints)
    if not lifting.segment:
        driven = tuple(joint.name for joint in joints if joint.is_actuated)
        sensor = ObservationChain(
            lifting.leg, lifting.link, lifting.reference, tuple(link_names), tuple(joint_names), driven
        )
        return replace(state, mechanism=changed, sensors=(*state.sensors, sensor))
    turning, proximal = lifting.joints[3], lifting.proximal
    u: Array = lifting.joints[4].axes[0]
    k_joint, before = (None, None) if proximal is None else (proximal.k_joint.name, proximal.before)
    chain = VirtualChain(
        lifting.leg,
        lifting.link,
        u,
        turning.at,
        k_joint,
        before,
        link_names[2],
        tuple(joint_names[:3]),
        tuple(link_names[:2]),
        joint_names[3],
        link_names[3],
        joint_names[4],
    )
    return replace(
        state,
        mechanism=changed,
        chains=(*state.chains, chain),
        owners={**state.owners, **{link: lifting.leg for link in link_names}},
    )


def _encode(state: State, seen: Encoder) -> State:
    """The real joint with a motor; of two coordinates of one joint the second changes nothing."""
    joint = state.mechanism.joints[seen.joint]
    if joint.is_actuated:
        return state
    changed = state.mechanism.changed(joints=[replace(joint, motor=Motor(joint.name))])
    sensor = ObservationChain(seen.leg, seen.link, str(seen.seen_from), (), (), (joint.name,))
    return replace(state, mechanism=changed, sensors=(*state.sensors, sensor))


RULE = Rule("lift", "MMT 3.2, Fig. 2(b)", Stage.LIFT, find, apply, list_leg_place, always=True, keeps=(AXES,))
