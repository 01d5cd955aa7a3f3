"""The exact lift: a virtual chain that constrains nothing measures what the camera sees.

    reference –P–P–P– T –U̲– W –R(d)– ℓ        (theory 2; MMT Fig. 2(b); always)

T only translates relative to the reference link, so the first axis of U̲ keeps its direction there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...geometry.vectors import pose, unit
from ...mechanism import Joint, JointType, Link, Motor
from ...mechanism.observation import Direction
from ..evidence import Evidence, far_from
from ..rule import Proposal, Refusal, Rule
from ..state import Chain, State


def propose(state: State, evidence: Evidence, leg: str, trust: bool) -> Iterator[Proposal | Refusal]:
    """One proposal for each leg: a chain for each of its observations."""
    for index, observation in enumerate(evidence.samples.question.observations):
        if observation.leg == leg and isinstance(observation, Direction):
            state = _lifted(state, evidence, index, observation)
    yield Proposal(state, "PPP-U̲-R(d) from the reference link to the observed link constrains nothing")


def _lifted(state: State, evidence: Evidence, index: int, observation: Direction) -> State:
    mechanism = state.mechanism
    link = _carried(evidence, observation)
    u = unit(mechanism.links[observation.link].pose[:3, :3] @ observation.direction)
    proximal = evidence.proximal(link)
    if proximal is not None:
        anchor = proximal.anchor
    else:
        knees = evidence.knees(link)
        anchor = knees[0].point if knees else mechanism.links[link].pose[:3, 3]
    e1 = far_from(evidence.directions(index))
    e2 = unit(np.cross(e1, u))
    e3 = np.cross(e1, e2)
    tag = observation.leg if sum(c.leg == observation.leg for c in state.chains) == 0 else f"{observation.leg}_{index}"
    names = {key: mechanism.fresh(f"{key}_{tag}") for key in
             ("slide_x", "slide_y", "slide_z", "carrier", "bearing", "virtual", "roll", "guide_x", "guide_y")}
    frame = pose(anchor)
    reference = mechanism.reference
    path = [reference, names["guide_x"], names["guide_y"], names["carrier"]]
    sliders = tuple(names[f"slide_{a}"] for a in "xyz")
    links = [Link(name, frame) for name in (*path[1:], names["bearing"])]
    joints = [Joint(name, JointType.PRISMATIC, a, b, anchor, (axis,))
              for name, a, b, axis in zip(sliders, path, path[1:], (e1, e2, e3), strict=False)]
    joints.append(Joint(names["virtual"], JointType.UNIVERSAL, names["carrier"], names["bearing"], anchor, (e1, e2),
                        motor=Motor(names["virtual"])))
    joints.append(Joint(names["roll"], JointType.REVOLUTE, names["bearing"], link, anchor, (u,)))
    chain = Chain(observation.leg, link, u, anchor, None if proximal is None else proximal.knee.name,
                  None if proximal is None else proximal.before, names["carrier"], sliders, tuple(path[1:3]),
                  names["virtual"], names["bearing"], names["roll"])
    owners = {each.name: observation.leg for each in links}
    return State(state.real, mechanism.changed(links=links, joints=joints), (*state.chains, chain), state.removed,
                 {**state.owners, **owners})


def _carried(evidence: Evidence, observation: Direction) -> str:
    """The observation moved towards the reference link over P joints (same direction)."""
    link = observation.link
    seen = {link}
    while True:
        knees = evidence.knees(link)
        if len(knees) != 1 or knees[0].type is not JointType.PRISMATIC:
            return link
        before = knees[0].other(link)
        if before in seen or before == evidence.reference:
            return link
        seen.add(before)
        link = before


RULE = Rule("lift", "MMT 3.2, Fig. 2(b)", propose)
