"""Change of a mechanism's zero configuration; all such changes are made here."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...geometry.so3 import decompose_rotation
from ...geometry.vectors import Array, build_pose, freeze_array, invert_pose, transform
from ...mechanism.model import Joint, JointType, Limits, Mechanism
from ...tolerances import EXACT_INCIDENCE_TOL, GEOMETRY_DIFFERENCE_TOL, INCIDENCE_TOL, POINT_DISTANCE_TOL
from .. import numerals, xml
from ..conversion import find_joint_value, list_coupling_specs, list_joint_specs
from ..jointgraph import ORIGIN, join_names
from .loops import SINGLE, LoopAssembly, Values

COUNTED_FROM_ZERO = {
    "safety_controller": ("soft_lower_limit", "soft_upper_limit"),
    "calibration": ("rising", "falling", "reference_position"),
}
"""Attributes of elements of a joint that are coordinates of it."""


def with_zero_at(mechanism: Mechanism, assembly: LoopAssembly, values: Values) -> Mechanism:
    """Return the mechanism with another closed configuration for its zero; the assembly's joints count from its
    zero."""
    return zeroed_at(mechanism, assembly.poses(values), assembly.singles(values))


def zeroed_at(
    mechanism: Mechanism, poses: Mapping[str, Array], known: Mapping[str, float] = MappingProxyType({})
) -> Mechanism:
    """Return the mechanism with its links, all of them, at these poses (4, 4) as its zero configuration.

    Limits, tilt limits and other coordinates of joints are shifted with it. ``known`` are coordinates of R and P there
    (m, rad); unknown angles are within half a rotation, or within their limits by full rotations.
    """
    motion = {name: poses[name] @ link.inverse for name, link in mechanism.links.items()}
    joints = []
    for joint in mechanism.joints.values():
        X, Y = (motion[link] for link in joint.links)
        axes = tuple(Z[:3, :3] @ axis for Z, axis in zip((X, Y), joint.axes, strict=False))
        wrist = None if joint.wrist is None else joint.wrist.carried(X[:3, :3], Y[:3, :3])
        moved = replace(joint, point=X[:3, :3] @ joint.point + X[:3, 3], axes=axes, wrist=wrist)
        q = np.array([known[joint.name]]) if joint.name in known else _coordinates(joint, invert_pose(X) @ Y)
        joints.append(
            _displaced(moved, X @ (ORIGIN if joint.offset is None else joint.offset) @ invert_pose(Y))
            if q is None
            else _counted_from(moved, q)
        )
    return mechanism.changed(
        links=[replace(link, pose=poses[name]) for name, link in mechanism.links.items()],
        joints=joints,
        scale=mechanism.length,
    )


def at_file_zero(mechanism: Mechanism) -> Mechanism | None:
    """Return the mechanism with the file's zero for its zero configuration; None if its loops are open there."""
    start, specs = {}, list_joint_specs(mechanism)
    for spec, joint in zip(specs, mechanism.joints.values(), strict=True):
        if joint.offset is not None and joint.offset.ndim == 1:
            start[joint.name] = -joint.offset
        elif joint.offset is not None:
            centre = build_pose(joint.point)
            start[joint.name] = find_joint_value(spec, invert_pose(centre) @ joint.offset @ centre)
    assembly = LoopAssembly(mechanism.base, specs, list_coupling_specs(mechanism), start)
    values = assembly.zero()
    return with_zero_at(mechanism, assembly, values) if assembly.worst(values)[1] <= GEOMETRY_DIFFERENCE_TOL else None


def _coordinates(joint: Joint, D: Array) -> Array | None:
    """Return the coordinates of an R, P, U or C whose successor is displaced by D (4, 4), seen from its predecessor."""
    if joint.type not in (*SINGLE, JointType.UNIVERSAL, JointType.CYLINDRICAL):
        return None
    slide = [joint.axis @ (transform(D, joint.point) - joint.point)] if joint.type.has_translation else []
    turns = np.zeros(0) if joint.type is JointType.PRISMATIC else decompose_rotation(np.array(joint.axes), D[:3, :3])
    limits = [*(each for _, each in joint.turns), *([] if joint.turns else [joint.limits]), None, None]
    return np.array([*slide, *(_within(float(angle), each) for angle, each in zip(turns, limits, strict=False))])


def _within(angle: float, limits: Limits | None) -> float:
    """Return an angle, with full rotations added that bring it within the limits if needed."""
    lower = -np.inf if limits is None or limits.lower is None else limits.lower
    upper = np.inf if limits is None or limits.upper is None else limits.upper
    turns = [angle + 2 * np.pi * k for k in (0, 1, -1)]
    return min(turns, key=lambda each: max(lower - each, each - upper, POINT_DISTANCE_TOL))


def _counted_from(joint: Joint, q: Array) -> Joint:
    """Return a joint that counts from its coordinates q (m, rad), its geometry unchanged."""
    q = np.where(np.abs(q) > EXACT_INCIDENCE_TOL, q, 0.0)
    if not q.any():
        return joint
    offset = q if joint.offset is None else q + joint.offset
    moved = replace(
        joint,
        offset=freeze_array(offset) if np.abs(offset).max() > EXACT_INCIDENCE_TOL else None,
        turns=tuple(
            (name, _shifted(limits, float(angle))) for (name, limits), angle in zip(joint.turns, q, strict=False)
        ),
    )
    return (
        moved
        if len(q) > 1
        else replace(
            moved,
            limits=_shifted(joint.limits, float(q[0])),
            xml=tuple(_recount(each, float(q[0])) for each in joint.xml),
        )
    )


def _displaced(joint: Joint, F: Array) -> Joint:
    """Return a joint whose successor has to be displaced by F (4, 4) to be where the file counts from."""
    return replace(joint, offset=freeze_array(F) if np.abs(F - np.eye(4)).max() > EXACT_INCIDENCE_TOL else None)


def _shifted(limits: Limits | None, q: float) -> Limits | None:
    """Return limits counted from q."""
    if limits is None:
        return None
    lower, upper = (None if bound is None else bound - q for bound in (limits.lower, limits.upper))
    return replace(limits, lower=lower, upper=upper)


def with_offsets(joints: Mapping[str, Joint], assembly: LoopAssembly, values: Values) -> dict[str, Joint]:
    """Return the joints of a file at ``values``, with limits and other coordinates counted from there."""
    found, X, q = dict(joints), assembly.poses(values), assembly.coordinates(values)
    for spec, _, _ in assembly.tree:
        if spec.kind in (*SINGLE, JointType.UNIVERSAL, JointType.CYLINDRICAL):
            found[spec.name] = _counted_from(joints[spec.name], q[spec.name])
        else:
            X_P, X_S = spec.frames(X)
            found[spec.name] = _displaced(joints[spec.name], X_P @ invert_pose(X_S))
    for name, shift in assembly.closing(values).items():
        found[name] = _counted_from(joints[name], np.array([shift]))
    return found


def _recount(fragment: str, q: float) -> str:
    """Return a kept element of a joint with its coordinates counted from q."""
    if not fragment.startswith(tuple(f"<{tag}" for tag in COUNTED_FROM_ZERO)):
        return fragment
    element = xml.parse_fragment(fragment)
    count_from(element, q)
    return xml.format_canonical(element)


def count_from(element: xml.Element, q: float) -> None:
    """Count coordinates in an element of a joint from q; attributes that are not numbers stay."""
    for key in COUNTED_FROM_ZERO.get(str(element.tag), ()):
        try:
            value = float(element.get(key, ""))
        except ValueError:
            continue
        if math.isfinite(value):
            element.set(key, numerals.format_exact(value - q))


def moves(assembly: LoopAssembly, values: Values) -> str:
    """Return the coordinates that differ from zero as a text."""
    return join_names(
        f"{name}[{number}] = {each:.6g}" if len(q) > 1 else f"{name} = {each:.6g}"
        for name, q in assembly.coordinates(values).items()
        for number, each in enumerate(q)
        if abs(each) > INCIDENCE_TOL
    )
