"""A mechanism as Gepetto's extended URDF: the tree as URDF, closures and motors as YAML."""

from __future__ import annotations

import json
from dataclasses import replace

from ...geometry.vectors import pose
from ...mechanism.model import Joint, JointType, Link, Mechanism, Note
from .. import chains
from ..foreign.closures import CUT, END, WELD
from ..writer import write as write_urdf
from .plain import plain


def write(mechanism: Mechanism) -> tuple[str, str, tuple[Note, ...]]:
    """The URDF text, the YAML text and warnings; a spherical loop is a ``3d`` closure, any other one is cut through its
    joint and closed in ``6d``."""
    said = plain(mechanism, tuple(JointType), (JointType.SPHERICAL, JointType.FIXED))
    robot = said.mechanism
    links = dict(robot.links)
    joints = {name: joint for name, joint in robot.joints.items() if joint.in_tree}
    pairs, kinds = [], []
    for joint in robot.joints.values():
        if joint.in_tree:
            continue
        stem = joint.name.removesuffix(WELD)
        frames = []
        for link, suffix in zip(joint.links, (CUT, END), strict=True):
            name = stem + suffix
            if name not in links:
                links[name] = Link(name, pose(joint.point))
                joints[name] = Joint(name, JointType.FIXED, link, name, joint.point)
            frames.append(name)
        pairs.append(frames)
        kinds.append("3d" if joint.type is JointType.SPHERICAL else "6d")
    tree = replace(robot, links=links, joints=joints)
    motors = [name for joint in joints.values() if joint.actuated for name in _named(joint)]
    lines = [f"closed_loop: {json.dumps(pairs)}", f"type: {json.dumps(kinds)}", f"name_mot: {json.dumps(motors)}", ""]
    return write_urdf(tree), "\n".join(lines), said.lost


def _named(joint: Joint) -> list[str]:
    """The joints of one freedom that the URDF writes for a joint."""
    parts = chains.parts(joint.type, joint.axes)
    return [chains.part(joint.name, k + 1) for k in range(len(parts))] or [joint.name]
