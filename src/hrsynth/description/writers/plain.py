"""A mechanism in the joints that a dialect has: other tree joints become chains, other loops are cut through the joint.

A loop N that a dialect cannot say becomes the tree joint N, which carries a link N__cut of no size, and a rigid closure
N__weld between that link and the successor.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import networkx as nx
import numpy as np

from ...errors import BadRequest
from ...geometry.vectors import pose
from ...mechanism.model import Joint, JointType, Link, Mechanism, Motor, Note
from ...mechanism.observation import Direction
from .. import chains
from ..foreign.closures import CUT, WELD
from ..numerals import axis
from ..tree import spanning


@dataclass(frozen=True, eq=False)
class Plain:
    """The mechanism that can be said, and what is lost."""

    mechanism: Mechanism
    lost: tuple[Note, ...]


def plain(mechanism: Mechanism, tree: Collection[JointType], loops: Collection[JointType],
          driven: Collection[JointType] = (), content: bool = True) -> Plain:
    """The mechanism with tree joints of types ``tree`` and loops of types ``loops`` (with a motor: ``driven``) only.

    ``content`` says whether the dialect keeps what links hold besides. Raises ``BadRequest`` where a link in between
    would take the name of another.
    """
    given = spanning(_held(mechanism) if JointType.FREE not in tree else mechanism)
    links, joints = dict(given.links), {}

    def link(name: str, joint: Joint) -> str:
        if name in links or name in given.joints:
            raise BadRequest(f"a link in between of joint {joint.name!r} would take the name of another part", name)
        links[name] = Link(name, pose(joint.point))
        return name

    def put(joint: Joint) -> None:
        parts = () if joint.type in tree else _parts(joint)
        if not parts:
            joints[joint.name] = joint
            return
        before = joint.predecessor
        for number, (kind, direction) in enumerate(parts, 1):
            name = chains.part(joint.name, number)
            after = joint.successor if number == len(parts) else link(name, joint)
            motor = None if joint.motor is None else Motor(chains.part(joint.motor.name, number))
            axes = (direction,) * JointType(kind).axes
            joints[name] = Joint(name, kind, before, after, joint.point, axes, motor, joint.limits)
            before = after

    for joint in given.joints.values():
        if joint.in_tree:
            put(joint)
    for joint in given.joints.values():
        if joint.in_tree:
            continue
        if joint.type in (driven if joint.actuated else loops):
            joints[joint.name] = joint
            continue
        name = link(joint.name + CUT, joint)
        put(replace(joint, successor=name, in_tree=True))
        weld = Joint(joint.name + WELD, JointType.FIXED, name, joint.successor, joint.point, in_tree=False)
        joints[weld.name] = weld
    lost = _lost(given, content)
    return Plain(replace(given, links=links, joints=joints, couplings=given.couplings), tuple(lost))


def _held(mechanism: Mechanism) -> Mechanism:
    """Without the free joints of links that other joints hold: they say nothing."""
    for joint in [each for each in mechanism.joints.values() if each.type is JointType.FREE]:
        rest = mechanism.changed(remove_joints=[joint.name])
        graph: nx.Graph[str] = nx.Graph()
        graph.add_nodes_from(rest.links)
        graph.add_edges_from(each.links for each in rest.joints.values())
        mechanism = rest if nx.is_connected(graph) else mechanism
    return mechanism


def _parts(joint: Joint) -> list[tuple[JointType, np.ndarray]]:
    if joint.type is JointType.FREE:
        return [*((JointType.PRISMATIC, e) for e in np.eye(3)), *((JointType.REVOLUTE, e) for e in np.eye(3))]
    return chains.parts(joint.type, joint.axes)


def _lost(mechanism: Mechanism, content: bool) -> list[Note]:
    found = []
    other = [o.leg for o in mechanism.observations if type(o) is not Direction]
    if other:
        found.append(Note("warning", "observations that are no directions are not written: legs " + ", ".join(other)))
    if not content and (mechanism.xml or any(link.xml for link in mechanism.links.values())
                        or any(joint.xml for joint in mechanism.joints.values())):
        found.append(Note("warning", "geometry, inertia and other content of links and joints is not written"))
    return found


def observed(mechanism: Mechanism) -> tuple[tuple[str, str, str], ...]:
    """Leg, link and direction of each observed direction, as text."""
    return tuple((o.leg, o.link, axis(o.direction)) for o in mechanism.observations if isinstance(o, Direction))


def rotation_quaternion(R: np.ndarray) -> tuple[float, float, float, float]:
    """The quaternion w, x, y, z of a rotation (3, 3), w not negative: the eigenvector of Bar-Itzhack's matrix."""
    K = np.array([
        [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
        [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
        [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]]])
    x, y, z, w = np.linalg.eigh(K)[1][:, 3]
    sign = -1.0 if w < 0 else 1.0
    return sign * w, sign * x, sign * y, sign * z
