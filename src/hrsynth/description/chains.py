"""Joints with several dof in a tree of one-dof joints: N is N__1, N__2, N__3 through bare links.

| joint | chain                                   |
| ----- | --------------------------------------- |
| U     | R about axis, R about axis2             |
| S     | R about x, y, z of the first link       |
| C     | P, R along one axis                     |
| E     | P, P normal to the axis, R about it     |

A joint N whose centre is not the origin of the link that it carries ends at a bare link ``N__tip``, to which a fixed
joint of that name joins the link. Points and axes are compared at the zero configuration.
"""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import Array
from ..mechanism.model import Joint, JointType, Link, Mechanism, Motor
from ..tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL

TIP = "__tip"
BODY = "__body"
"""Suffix of the link of a chain where joints and links may not share a name (SDFormat)."""
CUT, WELD, END, SECOND = "__cut", "__weld", "__end", "__second"
"""Suffixes of the names that writers of foreign formats add for a loop N: the link that one half of the cut joint
carries, the closure in all six directions, the frame on the other link, the second point of a revolute joint."""
WHOLES = {"RR": JointType.UNIVERSAL, "RRR": JointType.SPHERICAL, "PR": JointType.CYLINDRICAL, "PPR": JointType.PLANAR}
"""Joint types that joints of these types in a row can form."""
_FIRST = re.compile(r"(?P<name>.+)__1", re.DOTALL)
_R, _P = JointType.REVOLUTE, JointType.PRISMATIC


def name_chain_joint(name: str, number: int) -> str:
    """Return the name of the ``number``-th joint (and, with BODY, of the link that it carries) of the chain of
    ``name``."""
    return f"{name}__{number}"


def list_chain_joints(name: str, count: int) -> list[str]:
    """Return the names of the joints that a joint (or its motors) is written as: its name if it is one."""
    return [name] if count <= 1 else [name_chain_joint(name, number + 1) for number in range(count)]


def require_free(name: str, joint: Joint, *taken: Container[str]) -> None:
    """Raise ``BadRequest`` if a name of a written joint is already taken."""
    if any(name in each for each in taken):
        raise BadRequest(
            f"joint {joint.name!r} is written in several parts, and one would be named {name!r}, which a link or joint "
            "of the robot already has",
            remedy="Rename that link or joint, or this joint.",
        )


def merge(mechanism: Mechanism, geared: Container[str] = ()) -> Mechanism:
    """Return the mechanism with every chain and tip merged into one joint; chains that do not fit exactly stay, as do
    those with joints that are coupled, or to be so (``geared``)."""
    links, joints = dict(mechanism.links), dict(mechanism.joints)
    busy = {mechanism.base, mechanism.platform, mechanism.reference}
    busy |= {link for o in mechanism.observations for link in (o.link, o.seen_from) if link is not None}
    busy |= {camera.link for camera in mechanism.cameras}
    busy |= mechanism.coupled_links
    degree: dict[str, int] = {}
    for joint in joints.values():
        for end in joint.links:
            degree[end] = degree.get(end, 0) + 1

    def bare(link: Link | None) -> bool:
        return link is not None and link.name not in busy and not link.xml and degree.get(link.name) == 2

    carrier = {joint.successor: name for name, joint in joints.items() if joint.in_tree}
    for name in [name for name in joints if name.endswith(TIP)]:
        fixed = joints[name]
        stem = name.removesuffix(TIP)
        if (
            fixed.type is JointType.FIXED
            and fixed.in_tree
            and fixed.predecessor == name
            and bare(links.get(name))
            and not fixed.xml
            and fixed.limits is None
            and fixed.motor is None
        ):
            last = carrier.get(name)
            if last is not None and re.fullmatch(re.escape(stem) + r"(__[123])?", last):
                joints[last] = replace(joints[last], successor=fixed.successor)
                carrier[fixed.successor] = last
                del joints[name], links[name]

    wholes: dict[str, Joint] = {}
    gone: set[str] = set()
    for match in [match for name in joints if (match := _FIRST.fullmatch(name))]:
        name = match["name"]
        chain = [joints[each] for number in (1, 2, 3) if (each := name_chain_joint(name, number)) in joints]
        if (
            name in joints
            or len(chain) < 2
            or any(joint.name in geared or joint.name in mechanism.coupled_joints for joint in chain)
            or [joint.name for joint in chain] != [name_chain_joint(name, number + 1) for number in range(len(chain))]
        ):
            continue
        between = [links.get(joint.successor) for joint in chain[:-1]]
        apart = POINT_DISTANCE_TOL * mechanism.length
        whole = recognise_chain(name, chain, between, apart, DIRECTION_SINE_TOL) if all(map(bare, between)) else None
        if whole is not None:
            for joint in chain[:-1]:
                del links[joint.successor]
            wholes[chain[0].name] = whole
            gone |= {joint.name for joint in chain[1:]}
    kept = [wholes.get(name, joint) for name, joint in joints.items() if name not in gone]
    return replace(mechanism, links=links, joints={joint.name: joint for joint in kept})


def recognise_chain(
    name: str, chain: Sequence[Joint], between: Sequence[Link | None], apart: float, turned: float
) -> Joint | None:
    """Return the joint that a chain forms, or None if its links, motors, limits or geometry do not fit: centres that
    are more than ``apart`` (m), axes more than ``turned`` (rad)."""
    first = chain[0]
    for number, (before, after) in enumerate(pairwise(chain), 1):
        own = name_chain_joint(name, number)
        if before.successor != after.predecessor or before.successor not in (own, own + BODY):
            return None
    if any(
        not joint.in_tree
        or np.linalg.norm(joint.point - first.point) > apart
        or joint.limits != first.limits
        or joint.is_actuated != first.is_actuated
        or (joint.xml and joint is not first)
        for joint in chain
    ):
        return None
    kind = WHOLES.get("".join(joint.type for joint in chain))
    if kind is None:
        return None
    axes = [joint.axis for joint in chain]
    match kind:
        case JointType.SPHERICAL:
            frame = None if between[0] is None else between[0].pose[:3, :3]
            same = frame is not None and np.max(np.abs(np.array(axes).T - frame)) <= turned
            axes = []
        case JointType.CYLINDRICAL:
            same = np.linalg.norm(axes[0] - axes[1]) <= turned
            axes = axes[1:]
        case _:
            gram = np.array([[a @ b for a in axes] for b in axes])
            same = np.max(np.abs(gram - np.eye(len(axes)))) <= turned
            axes = axes if kind is JointType.UNIVERSAL else axes[2:]
    if not same:
        return None
    return replace(
        first,
        name=name,
        type=kind,
        successor=chain[-1].successor,
        axes=tuple(axes),
        motor=_merge_motors(chain),
        offset=_find_offset(kind, chain),
    )


def _find_offset(kind: JointType, chain: Sequence[Joint]) -> Array | None:
    """Return the offset from which the file counts the whole joint; not kept for spherical and planar joints."""
    if kind not in (JointType.UNIVERSAL, JointType.CYLINDRICAL) or all(joint.offset is None for joint in chain):
        return None
    return np.concatenate([np.zeros(1) if joint.offset is None else joint.offset for joint in chain])


def _merge_motors(chain: Sequence[Joint]) -> Motor | None:
    motors = [joint.motor for joint in chain if joint.motor is not None]
    if not motors:
        return None
    stem = motors[0].name.removesuffix("__1")
    same = [motor.name for motor in motors] == [name_chain_joint(stem, number + 1) for number in range(len(motors))]
    fragments = list(dict.fromkeys(motor.xml for motor in motors if motor.xml is not None))
    return Motor(stem if same else motors[0].name, "".join(fragments) or None)
