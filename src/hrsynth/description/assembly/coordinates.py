"""Chains that only position the platform: coordinates of a modelling tool, not a leg.

Tools that build a tree of links position a platform by P-P-R (in a plane) or P-P-P-S (in space), and close the legs
against it. Such a chain is passive and forbids nothing that the legs allow.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism, Note
from ...tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL
from ..jointgraph import JointGraph, join_names
from ..numerals import format_exact
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
    return assembly.model.nv - assembly.rank(assembly.zero()).value


def _find_locks(mechanism: Mechanism, graph: JointGraph) -> Iterator[Note]:
    """Yield a note on each closure of a file that locks every joint of its loop, though a point in its place would
    not."""
    assembly = LoopAssembly.of(mechanism)
    still = assembly.find_still_joints(assembly.zero())
    for spec in graph.joints.values() if still else ():
        joint = mechanism.joints.get(spec.name)
        if spec.in_tree or joint is None or joint.type.freedoms >= JointType.SPHERICAL.freedoms:
            continue
        point = Joint(joint.name, JointType.SPHERICAL, *joint.links, joint.point, in_tree=False)
        freer = mechanism.changed(joints=[point])
        locked = LoopAssembly.of(freer).list_loop_joints(spec.name)
        if locked and still.issuperset(locked) and mobility(freer) > mobility(mechanism):
            places = [",".join(map(format_exact, end.X[:3, 3])) if end.X[:3, 3].any() else "" for end in spec.ends]
            ends = ":".join(f"{end.link}@{at}".removesuffix("@") for end, at in zip(spec.ends, places, strict=True))
            text = f"the closure {spec.name!r} locks {join_names(locked)}; a point would not (--close {ends})"
            yield Note("open", text)


def with_weighed_motors(mechanism: Mechanism, graph: JointGraph) -> Mechanism:
    """Add a note if closures lock their loops, or if more coordinates have motors than the mobility: files put
    actuators on passive joints too."""
    if all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    notes = [*_find_locks(mechanism, graph)]
    driven = sum(joint.type.freedoms for joint in mechanism.joints.values() if joint.is_actuated)
    if driven and not notes and driven > (free := mobility(mechanism)):
        text = f"{driven} coordinates have motors, but the mobility is {free}: some motors may be on "
        notes.append(Note("open", text + "passive joints (--motors JOINTS names the motors)"))
    return replace(mechanism, notes=(*mechanism.notes, *notes))


def _chains(mechanism: Mechanism) -> list[list[Joint]]:
    """Return the passive chains from the base's body to the platform's through links with two joints."""
    bonds = graphs.build_adjacency(
        mechanism.links, (j.links for j in mechanism.joints.values() if j.type is JointType.FIXED)
    )
    base, platform = (graphs.find_component(bonds, link) for link in (mechanism.base, mechanism.platform))
    busy = {mechanism.reference, *(o.link for o in mechanism.observations)}
    busy |= {o.seen_from for o in mechanism.observations if o.seen_from is not None} | mechanism.coupled_links
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
