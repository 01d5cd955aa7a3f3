"""The exact lift: a virtual chain that constrains nothing measures what the camera sees.

    reference –P–P–P– T –U̲– W –R(d)– ℓ        (docs/pages/theory.md, section 3; MMT Fig. 2(b); always)

T only translates relative to the reference link, so the first axis of U̲ keeps its direction there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.vectors import Array, pose, unit
from ...mechanism import Joint, JointType, Link, Motor
from ...mechanism.observations.direction import Direction
from ..evidence import Evidence, ProximalChain, far_from
from ..rule import Match, Rule, Stage, whole_leg
from ..state import State, VirtualChain


@dataclass(frozen=True, eq=False)
class Lifting:
    """What a chain is to measure: ``link`` ℓ, its direction u, the anchor A, the part before ℓ; ``first`` is the first
    axis of U̲, ``tag`` what tells the chain's names from others."""

    tag: str
    link: str
    direction: Array
    anchor: Array
    proximal: ProximalChain | None
    first: Array


def find(state: State, evidence: Evidence, leg: str) -> Iterator[Match[tuple[str, list[Lifting]]]]:
    """One match for each leg: a chain for each of its observations."""
    links = state.mechanism.links
    found: list[Lifting] = []
    for index, observation in enumerate(evidence.samples.question.observations):
        if observation.leg != leg or not isinstance(observation, Direction):
            continue
        link = evidence.carried(observation.link)
        proximal, before = evidence.proximal(link), evidence.joints_before(link)
        u = unit(links[observation.link].pose[:3, :3] @ observation.direction)
        anchor = proximal.anchor if proximal else before[0].point if before else links[link].pose[:3, 3]
        found.append(Lifting(f"{leg}_{index}" if found else leg, link, u, anchor, proximal,
                             far_from(evidence.directions(index))))
    yield Match((leg, found), "PPP-U̲-R(d) from the reference link to the observed link constrains nothing")


def apply(state: State, found: tuple[str, list[Lifting]]) -> State:
    """The robot with these chains."""
    leg, liftings = found
    for lifting in liftings:
        state = _lifted(state, leg, lifting)
    return state


def _lifted(state: State, leg: str, lifting: Lifting) -> State:
    mechanism, anchor, proximal = state.mechanism, lifting.anchor, lifting.proximal
    e1, u = lifting.first, lifting.direction
    e2 = unit(np.cross(e1, u))
    e3 = np.cross(e1, e2)
    names = {key: mechanism.fresh(f"{key}_{lifting.tag}") for key in
             ("slide_x", "slide_y", "slide_z", "carrier", "bearing", "virtual", "roll", "guide_x", "guide_y")}
    path = [mechanism.reference, names["guide_x"], names["guide_y"], names["carrier"]]
    sliders = tuple(names[f"slide_{a}"] for a in "xyz")
    links = [Link(name, pose(anchor)) for name in (*path[1:], names["bearing"])]
    joints = [Joint(name, JointType.PRISMATIC, a, b, anchor, (axis,))
              for name, a, b, axis in zip(sliders, path, path[1:], (e1, e2, e3), strict=False)]
    joints.append(Joint(names["virtual"], JointType.UNIVERSAL, names["carrier"], names["bearing"], anchor, (e1, e2),
                        motor=Motor(names["virtual"])))
    joints.append(Joint(names["roll"], JointType.REVOLUTE, names["bearing"], lifting.link, anchor, (u,)))
    k_joint, before = (None, None) if proximal is None else (proximal.k_joint.name, proximal.before)
    chain = VirtualChain(leg, lifting.link, u, anchor, k_joint, before, names["carrier"], sliders, tuple(path[1:3]),
                         names["virtual"], names["bearing"], names["roll"])
    return replace(state, mechanism=mechanism.changed(links=links, joints=joints), chains=(*state.chains, chain),
                   owners={**state.owners, **{link.name: leg for link in links}})


RULE = Rule("lift", "MMT 3.2, Fig. 2(b)", Stage.LIFT, find, apply, whole_leg, always=True)
