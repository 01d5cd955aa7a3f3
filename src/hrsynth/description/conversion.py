"""Conversion between joints and couplings as a file gives them and those of a mechanism, both ways."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BadMechanism, BadRequest
from ..geometry.so3 import decompose_rotation
from ..geometry.vectors import Array, build_pose, invert_pose, normalise_vector, rotate_about_axis
from ..mechanism.model import Coupling, Joint, JointType, Mechanism
from ..mechanism.screws import split_elementary
from .chains import list_chain_joints
from .jointgraph import CouplingSpec, FrameSpec, JointGraph, JointSpec, join_names
from .tree import build_spanning_mechanism


def convert_to_joint(spec: JointSpec, poses: Mapping[str, Array], *, in_tree: bool, is_closed: bool = False) -> Joint:
    """Return a joint where its links have ``poses``; a loop closure is put in the middle of its two frames, unless it
    ``is_closed``: the frames agree to the digits of the file."""
    kind = spec.kind
    X_P, X_S = spec.frames(poses)
    axes: tuple[Array, ...] = tuple(X[:3, :3] @ axis for X, axis in zip((X_P, X_S), spec.axes, strict=False))
    if kind is JointType.UNIVERSAL and not is_closed:
        axes = axes[0], normalise_vector(axes[1] - axes[0] * float(axes[0] @ axes[1]))
    elif kind.axes == 1 and not (in_tree or is_closed):
        axes = (normalise_vector(axes[0] + X_S[:3, :3] @ spec.axes[0]),)
    is_first = in_tree or is_closed or kind.has_translation or kind is JointType.PLANAR
    point = X_P[:3, 3] if is_first else (X_P[:3, 3] + X_S[:3, 3]) / 2
    motor = None if kind is JointType.FIXED else spec.motor
    return Joint(spec.name, kind, *spec.links, point, axes, motor, spec.limits, in_tree, spec.xml, spec.line)


def move_along_joint(spec: JointSpec, q: float) -> Array:
    """Return the displacement (4, 4) of the second frame of an R or P from its first at coordinate q (m, rad)."""
    (axis,) = spec.axes
    if spec.kind is JointType.PRISMATIC:
        return build_pose(q * axis)
    return build_pose(np.zeros(3), rotate_about_axis(axis, q))


def find_joint_value(spec: JointSpec, D: Array) -> Array:
    """Return the value of a joint whose second frame is displaced by D (4, 4) from its first, as in
    :mod:`.jointmotion`."""
    if spec.kind in (JointType.SPHERICAL, JointType.FREE):
        return D
    parts = split_elementary(spec.kind, spec.axes)
    slides = [axis @ D[:3, 3] for kind, axis in parts if kind is JointType.PRISMATIC]
    turns = np.array([axis for kind, axis in parts if kind is JointType.REVOLUTE])
    return np.array([*slides, *(decompose_rotation(turns, D[:3, :3]) if len(turns) else ())])


def list_joint_specs(mechanism: Mechanism) -> list[JointSpec]:
    """Return a mechanism's joints as a file would give them: both frames at the joint's centre, parallel to the
    base's."""
    return [
        JointSpec(
            joint.name,
            joint.type,
            (
                FrameSpec(joint.predecessor, mechanism.links[joint.predecessor].inverse @ build_pose(joint.point)),
                FrameSpec(joint.successor, mechanism.links[joint.successor].inverse @ build_pose(joint.point)),
            ),
            joint.axes,
            in_tree=joint.in_tree,
        )
        for joint in mechanism.joints.values()
    ]


def compute_written_values(robot: Mechanism, poses: Mapping[str, Array]) -> dict[str, Array]:
    """Return the values of a mechanism's joints where its links have ``poses`` (4, 4), counted from its zero
    configuration, turns within half a turn, by the names under which the joints are written: one value each, but of
    balls and free joints a pose (4, 4) as well: of a ball in the frame of its successor, of a free joint in that of
    the base. Raises ``BadRequest`` if a link has no pose."""
    given = build_spanning_mechanism(robot)
    if lacking := [link for link in given.links if link not in poses]:
        raise BadRequest(f"{robot.name}: link poses of a keyframe: missing", join_names(lacking))
    values = dict[str, Array]()
    for spec in list_joint_specs(given):
        first, second = (poses[end.link] @ end.X for end in spec.ends if end.link is not None)
        value = find_joint_value(spec, invert_pose(first) @ second)
        if spec.kind is JointType.SPHERICAL:
            turned = build_pose(np.zeros(3), given.links[spec.links[1]].pose[:3, :3])
            values[spec.name] = invert_pose(turned) @ value @ turned
            value = decompose_rotation(np.eye(3), values[spec.name][:3, :3])
        elif spec.kind is JointType.FREE:
            values[spec.name] = invert_pose(poses[given.base]) @ poses[spec.links[1]]
            continue
        names = list_chain_joints(spec.name, len(value))
        values.update({name: np.array([number]) for name, number in zip(names, value, strict=True)})
    return values


def convert_couplings(graph: JointGraph, mechanism: Mechanism) -> tuple[Coupling, ...]:
    """Return the couplings of a graph. Raises ``BadMechanism`` for one that would fix a joint, or of a joint that has
    several dof or closes a loop."""
    found = []
    for gear in graph.gears:
        ends = [mechanism.joints.get(name) for name in (gear.driver, gear.driven)]
        joints = [joint for joint in ends if joint is not None and joint.in_tree and joint.type.freedoms == 1]
        if len(joints) == 2 and gear.ratio == 0:
            where = graph.file if gear.line is None else f"{graph.file}:{gear.line}"
            raise BadMechanism(
                f"{where}: coupling {gear.name!r} would fix joint {gear.driven!r}; its ratio",
                gear.ratio,
                "a ratio other than 0",
                remedy=f"Fix the joint with --freeze {gear.driven}.",
            )
        if len(joints) == 2:
            found.append(Coupling(gear.name, gear.driver, gear.driven, gear.ratio, gear.line))
        elif all(
            joint is None or joint.type is not JointType.FIXED
            for joint in (graph.joints.get(gear.driver), graph.joints.get(gear.driven))
        ):
            raise BadMechanism(
                f"{graph.file}: coupling {gear.name!r} of a joint that closes a loop, not supported",
                gear.driven,
                "one-dof joints of the spanning tree",
                remedy="Write it before another joint of its loop, which then closes the loop.",
            )
    return tuple(found)


def list_coupling_specs(mechanism: Mechanism) -> list[CouplingSpec]:
    """Return a mechanism's couplings as a file gives them."""
    return [CouplingSpec(each.name, each.driver, each.driven, each.ratio) for each in mechanism.couplings]
