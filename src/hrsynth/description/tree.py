"""Spanning tree of a mechanism: which joints are tree joints, which close loops."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import numpy as np

from ..errors import BadMechanism
from ..geometry.vectors import invert_pose
from ..mechanism import graphs
from ..mechanism.model import Joint, JointType, Link, Mechanism
from . import chains


def build_spanning_mechanism(mechanism: Mechanism, geared: Container[str] = ()) -> Mechanism:
    """Return the mechanism with a spanning tree of ``in_tree`` joints rooted at the base, each directed away from the
    base.

    Unchanged where that holds already. Otherwise the tree is a minimum spanning tree that prefers the tree joints of
    before, then joints with fewer dof, and actuated joints among equals; links and joints are ordered depth-first from
    the base, loops last. All geometry is expressed in the base link's frame. Tree joints that a file would hold as one
    joint, by their names, are that joint, unless couplings are to be on some of them (``geared``).

    Raises
    ------
    BadMechanism
        For a link without a joint, or a joint between two links of the tree with six dof.
    """
    mechanism = _move_to_base_frame(mechanism)
    return chains.merge(mechanism if is_spanning(mechanism) else _cut(mechanism), geared)


def _cut(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with a new spanning tree."""
    lost = set(mechanism.links) - graphs.find_component(mechanism.adjacency, mechanism.base)
    if lost:
        raise BadMechanism("link not connected to the base by joints", min(lost))
    joints = list(mechanism.joints.values())
    chosen = {
        joint.name for joint in graphs.build_spanning_forest(mechanism.links, joints, [_weigh_joint(j) for j in joints])
    }

    links: dict[str, Link] = {}
    tree: dict[str, Joint] = {}
    pending: list[tuple[str, Joint | None]] = [(mechanism.base, None)]
    while pending:
        link, carrier = pending.pop()
        links[link] = mechanism.links[link]
        if carrier is not None:
            tree[carrier.name] = carrier
        for joint in reversed(mechanism.joints_of(link)):
            if joint.name in chosen and joint.other(link) not in links:
                away = joint if joint.predecessor == link else joint.turned()
                pending.append((away.successor, replace(away, in_tree=True)))
    loops = {name: replace(joint, in_tree=False) for name, joint in mechanism.joints.items() if name not in chosen}
    for joint in loops.values():
        if joint.type is JointType.FREE:
            raise BadMechanism(f"joint {joint.name!r} closes a loop without constraining it", joint.type.value)
    return replace(mechanism, links=links, joints=tree | loops)


def is_spanning(mechanism: Mechanism) -> bool:
    """Return True if the ``in_tree`` joints are a spanning tree rooted at the base, each directed away from the
    base."""
    carriers = {joint.successor: joint for joint in mechanism.joints.values() if joint.in_tree}
    count = sum(joint.in_tree for joint in mechanism.joints.values())
    if not count == len(carriers) == len(mechanism.links) - 1 or mechanism.base in carriers:
        return False
    if any(joint.type is JointType.FREE and not joint.in_tree for joint in mechanism.joints.values()):
        return False
    return len(list_outward_joints(mechanism)) == count


def is_connected(mechanism: Mechanism) -> bool:
    """Return True if chains of joints connect every link to the base."""
    return len(graphs.find_component(mechanism.adjacency, mechanism.base)) == len(mechanism.links)


def list_outward_joints(mechanism: Mechanism) -> list[Joint]:
    """Return the tree joints of the base's tree, every joint after the one that carries its predecessor."""
    tree = [joint for joint in mechanism.joints.values() if joint.in_tree]
    return [joint for joint, _, _ in graphs.order_outward(mechanism.base, tree)]


def _weigh_joint(joint: Joint) -> tuple[bool, bool, int, bool]:
    """Return the weight of a joint in the tree; a free joint closes no loop, so it is never one."""
    is_free = joint.type is JointType.FREE
    return not is_free, not (is_free or joint.in_tree), joint.type.freedoms, not joint.is_actuated


def _move_to_base_frame(mechanism: Mechanism) -> Mechanism:
    X_WB = mechanism.links[mechanism.base].pose
    if np.array_equal(X_WB, np.eye(4)):
        return mechanism
    X_BW = invert_pose(X_WB)
    links = {name: replace(link, pose=X_BW @ link.pose) for name, link in mechanism.links.items()}
    links[mechanism.base] = replace(links[mechanism.base], pose=np.eye(4))
    joints = {
        name: replace(
            joint,
            point=X_BW[:3, :3] @ joint.point + X_BW[:3, 3],
            axes=tuple(X_BW[:3, :3] @ axis for axis in joint.axes),
            offset=X_BW @ joint.offset @ X_WB if joint.offset is not None and joint.offset.ndim == 2 else joint.offset,
        )
        for name, joint in mechanism.joints.items()
    }
    return replace(mechanism, links=links, joints=joints)  # observations are given in their links' frames
