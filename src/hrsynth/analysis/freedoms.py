"""Names of platform dof: translations first, then rotations about lines of the robot, then screws."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.ranks import compute_kernel_basis, compute_range_basis, compute_space_basis
from ..geometry.vectors import Array, cross, normalise_vector, orient_axis
from ..mechanism import JointType
from ..mechanism.legs import LegDecomposition
from ..records import As
from ..results import Value
from ..tolerances import NAMED_TWIST_TOL

_AXES = "xyz"


@dataclass(frozen=True, eq=False, repr=False)
class Freedom(Value, all_recorded=True):
    """A twist (vx, vy, vz, wx, wy, wz) at the platform frame's origin, base axes (m, rad), with its name."""

    twist: Annotated[
        Array, list[float], As(digits=12), "vx, vy, vz, wx, wy, wz at the platform frame's origin, base axes (m, rad)"
    ]
    name: str


def name_freedoms(
    twists: Array, decomposition: LegDecomposition, labels: tuple[str, ...] | None = None, position: Array | None = None
) -> tuple[Freedom, ...]:
    """Named twists that span the columns of ``twists`` (6, k), or (3, k) of a point body, in characteristic lengths of
    the mechanism, at the zero configuration.

    ``labels`` are the legs whose tips are tried as points of rotation axes (default: all). With ``position`` the twists
    belong to another configuration, with the platform's origin there: lines of the robot are not named then.
    """
    if twists.shape[1] == 0:
        return ()
    twists = compute_range_basis(_scale_twists(twists, decomposition.mechanism.length))[0]
    found: list[Freedom] = []
    free, _ = compute_kernel_basis(twists[3:], 1.0)
    translations = compute_range_basis(twists[:3] @ free, 1.0)[0] if free.shape[1] else np.zeros((3, 0))
    for direction in name_directions(translations, decomposition):
        twist = np.concatenate([direction, np.zeros(3)])
        found.append(Freedom(twist, f"translation along {name_direction(direction, decomposition)}"))
    for point, direction, name in _list_lines(decomposition, labels) if position is None else ():
        if len(found) == twists.shape[1]:
            break
        twist = _build_rotation(decomposition, point, direction)
        if _is_in_span(twist, twists) and not _is_spanned(twist, found):
            found.append(Freedom(twist, f"rotation about {name}"))
    for column in twists.T:
        if len(found) == twists.shape[1]:
            break
        rest = _remove_twist(column, found)
        if np.linalg.norm(rest[3:]) > NAMED_TWIST_TOL and not _is_spanned(rest, found):
            twist = rest / (rest[3:] @ orient_axis(normalise_vector(rest[3:])))
            origin = (
                decomposition.mechanism.links[decomposition.mechanism.platform].pose[:3, 3]
                if position is None
                else position
            )
            found.append(Freedom(twist, _describe_screw(origin, twist)))
    return tuple(found)


def format_point(point: Iterable[float]) -> str:
    """A point or a vector in words: ``(0.1 0 -0.7)``."""
    return "(" + " ".join(f"{0.0 if abs(value) < 1e-9 else value:.4g}" for value in point) + ")"


def _scale_twists(twists: Array, length: float) -> Array:
    """Twists (6 or 3, k) in lengths of ``length`` metres as (6, k) in metres and radians."""
    found = np.zeros((6, twists.shape[1]))
    found[: len(twists)] = twists
    found[:3] *= length
    return found


def _is_in_span(twist: Array, span: Array) -> bool:
    unit_twist = twist / np.linalg.norm(twist)
    return bool(np.linalg.norm(unit_twist - span @ (span.T @ unit_twist)) < NAMED_TWIST_TOL)


def _remove_twist(twist: Array, found: list[Freedom]) -> Array:
    if not found:
        return twist
    basis = compute_range_basis(np.column_stack([f.twist for f in found]))[0]
    return twist - basis @ (basis.T @ twist)


def _is_spanned(twist: Array, found: list[Freedom]) -> bool:
    return bool(np.linalg.norm(_remove_twist(twist / np.linalg.norm(twist), found)) < NAMED_TWIST_TOL)


def name_directions(basis: Array, decomposition: LegDecomposition) -> list[Array]:
    """Directions that span ``basis`` (3, k): base axes first, then P axes of the robot, then those normal to these."""
    candidates = [*np.eye(3)]
    candidates += [j.axis for j in decomposition.mechanism.joints.values() if j.type is JointType.PRISMATIC]
    chosen: list[Array] = []
    for candidate in candidates:
        inside = basis @ (basis.T @ candidate)
        if len(chosen) < basis.shape[1] and np.linalg.norm(inside - candidate) < NAMED_TWIST_TOL:
            stacked = np.column_stack([*chosen, candidate])
            if np.linalg.matrix_rank(stacked, tol=NAMED_TWIST_TOL) == len(chosen) + 1:
                chosen.append(orient_axis(normalise_vector(candidate)))
    onto = compute_range_basis(np.column_stack(chosen), 1.0)[0] if chosen else np.zeros((3, 0))
    rest = compute_space_basis(basis - onto @ (onto.T @ basis), 1.0)
    return [*chosen, *(orient_axis(normalise_vector(each)) for each in rest.T)]


def name_direction(direction: Array, decomposition: LegDecomposition) -> str:
    for i in range(3):
        if abs(abs(direction[i]) - 1) < NAMED_TWIST_TOL:
            return _AXES[i]
    along = [
        j.name
        for j in decomposition.mechanism.joints.values()
        if j.type is JointType.PRISMATIC and np.linalg.norm(cross(j.axis, direction)) < NAMED_TWIST_TOL
    ]
    return f"{format_point(direction)}, the axis of {along[0]}" if along else format_point(direction)


def _list_tips(decomposition: LegDecomposition, labels: tuple[str, ...] | None) -> list[tuple[str, Array]]:
    """The centre of each leg's joints on the platform, by label."""
    tips = []
    for leg in decomposition.legs:
        if labels is None or leg.label in labels:
            joints = [j for j in decomposition.mechanism.joints_of(leg.platform_link) if j.name in leg.joints]
            if joints:
                tips.append((leg.label, np.mean([j.point for j in joints], axis=0)))
    return tips


def _list_lines(decomposition: LegDecomposition, labels: tuple[str, ...] | None) -> list[tuple[Array, Array, str]]:
    """Lines (point, direction, name) that an engineer would name."""
    mechanism = decomposition.mechanism
    origin = mechanism.links[mechanism.platform].pose[:3, 3]
    tips = _list_tips(decomposition, labels)
    lines: list[tuple[Array, Array, str]] = []
    for i, (a, p) in enumerate(tips):
        for b, q in tips[i + 1 :]:
            if np.linalg.norm(q - p) > NAMED_TWIST_TOL:
                lines.append((p, normalise_vector(q - p), f"the line B{a} B{b}"))
    for axis, name in zip(np.eye(3), _AXES, strict=True):
        lines.append((origin, axis, f"the platform's {name} axis"))
    for joint in mechanism.joints.values():
        if joint.type in (JointType.REVOLUTE, JointType.CYLINDRICAL):
            lines.append((joint.point, joint.axis, f"the axis of {joint.name}"))
        if joint.type is JointType.UNIVERSAL:
            for axis, order in zip(joint.axes, ("first", "second"), strict=True):
                lines.append((joint.point, axis, f"the {order} axis of {joint.name}"))
    for a, p in tips:
        for axis, name in zip(np.eye(3), _AXES, strict=True):
            lines.append((p, axis, f"the line through B{a} along {name}"))
    return lines


def _build_rotation(decomposition: LegDecomposition, point: Array, direction: Array) -> Array:
    origin = decomposition.mechanism.links[decomposition.mechanism.platform].pose[:3, 3]
    return np.concatenate([cross(direction, origin - point), direction])


def _describe_screw(origin: Array, twist: Array) -> str:
    """The screw of a twist with unit angular part at ``origin``: its axis and pitch (m/rad)."""
    v, w = twist[:3], twist[3:]
    point = origin + cross(w, v)
    pitch = float(w @ v)
    kind = "rotation" if abs(pitch) < NAMED_TWIST_TOL else f"screw motion of pitch {pitch:.4g} m/rad"
    return f"{kind} about the line through {format_point(point)} along {format_point(w)}"
