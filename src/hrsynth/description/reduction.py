"""Reduction to the joints of a format: other tree joints become chains, other loops are cut at the joint.

A loop N that a format cannot express becomes the tree joint N, which carries a link N__cut of no size, and a rigid
closure N__weld between that link and the successor.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from ..errors import BadRequest
from ..geometry.vectors import build_pose
from ..mechanism.model import Joint, JointType, Link, Mechanism, Motor, Note
from ..mechanism.screws import split_elementary
from . import chains
from .chains import CUT, WELD
from .tree import build_spanning_mechanism


def reduce(
    mechanism: Mechanism,
    tree: Collection[JointType],
    loops: Collection[JointType],
    driven: Collection[JointType] = (),
    body: str = "",
) -> tuple[Mechanism, tuple[Note, ...]]:
    """Return the mechanism with tree joints of types ``tree`` and loops of types ``loops`` (with a motor: ``driven``)
    only, and the losses. ``body`` is a suffix of the names of links in between.

    Raises ``BadRequest`` if a link in between would get a name that is taken.
    """
    given = build_spanning_mechanism(
        mechanism if JointType.FREE in tree else mechanism.changed(remove_joints=mechanism.idle)
    )
    links, joints = dict(given.links), {}

    def link(name: str, joint: Joint) -> str:
        chains.require_free(name, joint, links, given.joints)
        links[name] = Link(name, build_pose(joint.point))
        return name

    def put(joint: Joint) -> None:
        if joint.type in tree:
            joints[joint.name] = joint
            return
        parts = split_elementary(joint.type, joint.axes)
        before = joint.predecessor
        for number, (kind, direction) in enumerate(parts, 1):
            name = chains.name_chain_joint(joint.name, number)
            chains.require_free(name, joint, given.joints)
            after = joint.successor if number == len(parts) else link(name + body, joint)
            motor = None if joint.motor is None else Motor(chains.name_chain_joint(joint.motor.name, number))
            joints[name] = Joint(name, kind, before, after, joint.point, (direction,), motor, joint.limits)
            before = after

    for joint in given.joints.values():
        if joint.in_tree:
            put(joint)
    for joint in given.joints.values():
        if joint.in_tree:
            continue
        if joint.type in (driven if joint.is_actuated else loops):
            joints[joint.name] = joint
            continue
        name = link(joint.name + CUT, joint)
        put(replace(joint, successor=name, in_tree=True))
        chains.require_free(joint.name + WELD, joint, given.joints)
        weld = Joint(joint.name + WELD, JointType.FIXED, name, joint.successor, joint.point, in_tree=False)
        joints[weld.name] = weld
    return replace(given, links=links, joints=joints), ()


def require_free_world(robot: Mechanism, world: str, dialect: str) -> None:
    """Raise ``BadRequest`` if a link has the name that a format reserves for the base."""
    if world in robot.links and robot.base != world:
        raise BadRequest(f"{robot.name}: {dialect} reserves this name for the base", world, "another link name")
