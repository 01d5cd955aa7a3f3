"""A mechanism as Gepetto's extended URDF: the tree as URDF, closures and motors as YAML."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from ....geometry.vectors import build_pose
from ....mechanism.model import Joint, JointType, Link, Mechanism
from ...chains import CUT, END, WELD
from ...file_format import Written
from ...reduction import reduce
from ..native.write import list_joint_names, write_text


def write(mechanism: Mechanism) -> Written:
    """Return the URDF text, the YAML text and warnings; a spherical loop is a ``3d`` closure, any other one is cut at
    the joint and closed in ``6d``."""
    robot, lost = reduce(mechanism, tuple(JointType), (JointType.SPHERICAL, JointType.FIXED))
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
                links[name] = Link(name, build_pose(joint.point))
                joints[name] = Joint(name, JointType.FIXED, link, name, joint.point)
            frames.append(name)
        pairs.append(frames)
        kinds.append("3d" if joint.type is JointType.SPHERICAL else "6d")
    tree = replace(robot, links=links, joints=joints)
    motors = [name for joint in joints.values() if joint.is_actuated for name in list_joint_names(joint)]
    lists: dict[str, list[Any]] = {"closed_loop": pairs, "type": kinds, "name_mot": motors}
    return Written(
        (write_text(tree), "".join(f"{key}: {_format_yaml_list(names)}" for key, names in lists.items())), lost
    )


def _format_yaml_list(names: list[Any]) -> str:
    """Return a list as one line, every name in quotation marks."""
    import yaml

    return str(yaml.safe_dump(names, default_flow_style=True, default_style='"', width=math.inf))
