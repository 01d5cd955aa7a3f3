"""Another closed configuration as a mechanism's zero pose."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...geometry.so3 import quaternions
from ...geometry.vectors import inverse, unit
from ...mechanism.model import Joint, JointType, Mechanism
from ...tolerances import EXACT, NOISE
from .. import numerals, xml
from ..jointgraph import comma_list
from ..jointmotion import zero
from .loops import LoopAssembly, Values

SINGLE = (JointType.REVOLUTE, JointType.PRISMATIC)
COUNTED_FROM_ZERO = {"safety_controller": ("soft_lower_limit", "soft_upper_limit"),
                     "calibration": ("rising", "falling", "reference_position")}
"""Attributes of elements of a joint that are coordinates of it."""


def with_zero_at(mechanism: Mechanism, assembly: LoopAssembly, values: Values) -> Mechanism:
    """The same mechanism with another closed configuration for its zero."""
    poses = assembly.poses(values)
    motion = {name: poses[name] @ inverse(link.pose) for name, link in mechanism.links.items()}
    joints = {}
    for joint in mechanism.joints.values():
        X, Y = (motion[link] for link in joint.links)
        axes = tuple(Z[:3, :3] @ axis for Z, axis in zip((X, Y), joint.axes, strict=False))
        joints[joint.name] = replace(joint, point=X[:3, :3] @ joint.point + X[:3, 3], axes=axes)
    links = {name: replace(link, pose=poses[name]) for name, link in mechanism.links.items()}
    return replace(mechanism, links=links, joints=with_limits(joints, assembly, values))


def with_limits(joints: Mapping[str, Joint], assembly: LoopAssembly, values: Values) -> dict[str, Joint]:
    """The joints with the limits of R and P, and what else of them the file counts from zero, from where ``values`` put
    them."""
    found = dict(joints)
    told = {spec.name: float(values[spec.name][0]) * assembly.unit(spec) for spec, _, _ in assembly.tree
            if spec.kind in SINGLE}
    told |= closing(assembly, values)
    for name, q in told.items():
        joint = joints[name]
        limits = joint.limits
        if q:
            if limits is not None:
                lower, upper = (None if bound is None else bound - q for bound in (limits.lower, limits.upper))
                limits = replace(limits, lower=lower, upper=upper)
            found[joint.name] = replace(joint, limits=limits, xml=tuple(_recount(each, q) for each in joint.xml))
    return found


def closing(assembly: LoopAssembly, values: Values) -> dict[str, float]:
    """How far from their zero (m, rad) ``values`` put the R and P at which loops are closed: that of a closure is where
    all tree joints are at zero, that of a joint of the file's tree where its two frames meet."""
    there = {spec.name: zero(spec) for spec, _, _ in assembly.tree}
    now, then = assembly.scaled_poses(values), assembly.scaled_poses(there)
    found = {}
    for spec in assembly.loops:
        if spec.kind not in SINGLE:
            continue
        X, Y = spec.frames(now)
        X_0, Y_0 = spec.frames(then)
        D, D_0 = inverse(X) @ Y, np.eye(4) if spec.in_tree else inverse(X_0) @ Y_0
        axis = unit(spec.axes[0])
        if spec.kind is JointType.PRISMATIC:
            found[spec.name] = float(axis @ (D[:3, 3] - D_0[:3, 3])) * assembly.length
        else:
            turn = quaternions(D[:3, :3] @ D_0[:3, :3].T)
            found[spec.name] = 2 * math.atan2(float(axis @ turn[1:]), float(turn[0]))
    return {name: q for name, q in found.items() if abs(q) > EXACT}


def _recount(fragment: str, q: float) -> str:
    """A kept element of a joint with what it counts from zero counted from q."""
    if not fragment.startswith(tuple(f"<{tag}" for tag in COUNTED_FROM_ZERO)):
        return fragment
    element = xml.parse_fragment(fragment)
    count_from(element, q)
    return xml.canonical(element)


def count_from(element: xml.Element, q: float) -> None:
    """Count coordinates in an element of a joint from q; what is no number stays."""
    for key in COUNTED_FROM_ZERO.get(str(element.tag), ()):
        try:
            value = float(element.get(key, ""))
        except ValueError:
            continue
        if math.isfinite(value):
            element.set(key, numerals.exact(value - q))


def moves(assembly: LoopAssembly, values: Values) -> str:
    """The coordinates that differ from zero, in words."""
    found = []
    for joint, _, _ in assembly.tree:
        value = values[joint.name]
        for number, q in enumerate(value if value.ndim == 1 else value[:3, :3][[2, 0, 1], [1, 2, 0]]):
            if abs(q) > NOISE:
                suffix = f"[{number}]" if value.size > 1 else ""
                found.append(f"{joint.name}{suffix} = {q * assembly.unit(joint):.6g}")
    return comma_list(found)
