"""Chains that only position the platform: coordinates of a modelling tool, not a leg.

Tools that build a tree of links position a platform by P-P-R (in a plane) or P-P-P-S (in space), and close the legs
against it. Such a chain is passive and forbids nothing that the legs allow.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism, Note
from ...tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL
from ..tree import build_spanning_mechanism, is_connected
from .loops import LoopAssembly

_PLANE = re.compile("PPR|RPP|E")
_SPACE = re.compile("PPP(S|RRR|UR|RU)|(S|RRR|UR|RU)PPP")
"""Types of the joints of such a chain, from the base or from the platform."""


def without_coordinates(mechanism: Mechanism) -> Mechanism:
    """Replace the only coordinate chain from the base to the platform: in space by a free joint, in a plane by
    nothing."""
    found = [chain for chain in _chains(mechanism) if _is_free_coordinate_chain(mechanism, chain)]
    if len(found) != 1:
        return mechanism
    (chain,) = found
    names = [joint.name for joint in chain]
    first, last = chain[0], chain[-1]
    between = {link for one, two in pairwise(chain) for link in set(one.links) & set(two.links)}
    rest = mechanism.changed(remove_joints=names, remove_links=between)
    bodies = [link for joint in (first, last) for link in joint.links if link not in between]
    in_space = sum(joint.type.freedoms for joint in chain) == 6
    if not is_connected(rest) or mobility(rest) != mobility(mechanism):
        return mechanism
    if in_space:
        rest = rest.changed(
            joints=[Joint(first.name, JointType.FREE, bodies[0], bodies[1], mechanism.links[bodies[1]].pose[:3, 3])]
        )
    note = Note(
        "merged",
        f"the joints {', '.join(names)} position the platform and constrain nothing: read as "
        + ("a free joint" if in_space else "no leg"),
    )
    return build_spanning_mechanism(replace(rest, notes=(*mechanism.notes, note)))


def mobility(mechanism: Mechanism) -> int:
    """Return the mobility at the zero configuration."""
    assembly = LoopAssembly.of(mechanism)
    return sum(joint.kind.freedoms for joint, _, _ in assembly.tree) - assembly.rank(assembly.zero()).value


def with_weighed_motors(mechanism: Mechanism) -> Mechanism:
    """Add a note if more coordinates have motors than the mobility: files put actuators on passive joints too."""
    driven = sum(joint.type.freedoms for joint in mechanism.joints.values() if joint.is_actuated)
    if driven == 0 or all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    free = mobility(mechanism)
    if driven <= free:
        return mechanism
    note = Note(
        "open",
        f"{driven} coordinates have motors, but the mobility is {free}: some motors may be on "
        "passive joints (--motors JOINTS names the motors)",
    )
    return replace(mechanism, notes=(*mechanism.notes, note))


def _chains(mechanism: Mechanism) -> list[list[Joint]]:
    """Return the passive chains from the base's body to the platform's through links with two joints."""
    bonds = graphs.build_adjacency(
        mechanism.links, (j.links for j in mechanism.joints.values() if j.type is JointType.FIXED)
    )
    base, platform = (graphs.find_component(bonds, link) for link in (mechanism.base, mechanism.platform))
    busy = {mechanism.reference, *(o.link for o in mechanism.observations)}
    busy |= {o.seen_from for o in mechanism.observations if o.seen_from is not None}
    busy |= {link for c in mechanism.couplings for link in (c.predecessor, c.successor)}
    found = []
    for start in base:
        for joint in mechanism.joints_of(start):
            chain, link = [joint], joint.other(start)
            while link not in platform | base | busy and len(mechanism.joints_of(link)) == 2:
                chain.append(next(j for j in mechanism.joints_of(link) if j is not chain[-1]))
                link = chain[-1].other(link)
            if link in platform and platform != base:
                found.append(chain)
    return found


def _is_free_coordinate_chain(mechanism: Mechanism, chain: Sequence[Joint]) -> bool:
    """Return True if joints are translations in independent directions and rotations about one point, none of them with
    a motor."""
    word = "".join(str(joint.type) for joint in chain)
    if any(joint.is_actuated for joint in chain) or not (_PLANE.fullmatch(word) or _SPACE.fullmatch(word)):
        return False
    slides = [joint.axis for joint in chain if joint.type is JointType.PRISMATIC]
    centres = np.array([joint.point for joint in chain if joint.type is not JointType.PRISMATIC])
    return (not slides or bool(np.linalg.matrix_rank(np.array(slides), DIRECTION_SINE_TOL) == len(slides))) and bool(
        np.max(np.abs(centres - centres[0])) <= POINT_DISTANCE_TOL * mechanism.length
    )
