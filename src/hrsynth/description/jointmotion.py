"""Motion of a joint: displacement between its two frames, its screws, and the closure residual of a loop.

A *value* holds a joint's coordinates: an array for R, P, U, C, E, the displacement (4, 4) itself for S and free joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import LoopClosureFailure
from ..geometry.screws import make_rotation_twist, make_translation_twist
from ..geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ..geometry.vectors import Array, build_pose, hat
from ..mechanism.model import JointType
from ..tolerances import (
    DIRECTION_SINE_TOL,
    EXACT_INCIDENCE_TOL,
    GEOMETRY_DIFFERENCE_TOL,
    INCIDENCE_TOL_MAX,
    VECTOR_LENGTH_MIN,
)
from .jointgraph import JointSpec

_MATRIX = (JointType.SPHERICAL, JointType.FREE)


def get_zero_value(joint: JointSpec) -> Array:
    """Return the value at which both frames coincide."""
    return np.eye(4) if joint.kind in _MATRIX else np.zeros(joint.kind.freedoms)


def compute_joint_pose(joint: JointSpec, value: Array) -> Array:
    """Return the pose (4, 4) of the successor's joint frame in the predecessor's, one motion after the other."""
    if joint.kind in _MATRIX:
        return value
    found = None
    for (axis, K), q in zip(joint.parts, value, strict=True):
        X = np.eye(4)
        if K is None:
            X[:3, 3] = axis * q
        else:
            X[:3, :3] += np.sin(q) * K + (1 - np.cos(q)) * (K @ K)
        found = X if found is None else found @ X
    return np.eye(4) if found is None else found


def step_along(joint: JointSpec, value: Array, step: Array, R_predecessor: Array) -> Array:
    """Return the value after a step along the screws of :func:`compute_joint_screws`."""
    if joint.kind not in _MATRIX:
        return value + step
    angular = R_predecessor.T @ step[-3:]
    shift = R_predecessor.T @ step[:3] if joint.kind is JointType.FREE else np.zeros(3)
    return build_pose(value[:3, 3] + shift, convert_vectors_to_rotations(angular) @ value[:3, :3])


def compute_joint_screws(joint: JointSpec, X_P: Array, X_S: Array) -> list[Array]:
    """Return the twists (linear at the base origin, angular) of the successor relative to the predecessor, one for each
    coordinate; ``X_P`` and ``X_S`` are the poses of the joint's two frames."""
    found = []
    for number, (axis, K) in enumerate(joint.parts):
        if joint.kind not in _MATRIX:
            axis = (X_S if joint.kind is JointType.UNIVERSAL and number == 1 else X_P)[:3, :3] @ axis
        found.append(make_translation_twist(axis) if K is None else make_rotation_twist(axis, X_S[:3, 3]))
    return found


def compute_closure_error(joint: JointSpec, X_P: Array, X_S: Array) -> tuple[Array, Array]:
    """Return the closure residual of a joint's two frames, (6 − dof,), and its derivative by the twist of the successor
    relative to the predecessor, (6 − dof, 6)."""
    gap, turn, rows = _compute_misses(joint, X_P, X_S)
    return np.concatenate([gap, turn]), rows


def _compute_misses(joint: JointSpec, X_P: Array, X_S: Array) -> tuple[Array, Array, Array]:
    """Return the distance and the rotation that the joint does not allow, and the derivative of both."""
    kind = joint.kind
    if kind is JointType.FREE:
        return np.zeros(0), np.zeros(0), np.zeros((0, 6))
    R, p = X_P[:3, :3], X_S[:3, 3]
    gap, D = R.T @ (p - X_P[:3, 3]), R.T @ X_S[:3, :3]
    gap_rows, turn_rows = np.zeros((3, 6)), np.zeros((3, 6))
    gap_rows[:, :3] = turn_rows[:, 3:] = R.T
    gap_rows[:, 3:] = -R.T @ hat(p)
    if kind in (JointType.PRISMATIC, JointType.FIXED):
        turn = convert_rotations_to_vectors(D)
    elif kind is JointType.SPHERICAL:
        turn, turn_rows = np.zeros(0), np.zeros((0, 6))
    elif kind is JointType.UNIVERSAL:
        second = D @ joint.axes[1]
        turn = np.array([joint.axes[0] @ second])
        turn_rows = (joint.axes[0] @ -hat(second) @ turn_rows)[None]
    else:
        moving, across = D @ joint.axes[0], joint.across
        turn = _bound_opposite_axis(across @ moving) if joint.axes[0] @ moving < 0 else across @ moving
        turn_rows = across @ -hat(moving) @ turn_rows
    if kind.has_translation:
        gap, gap_rows = joint.across @ gap, joint.across @ gap_rows
    elif kind is JointType.PLANAR:
        gap, gap_rows = joint.axes[:1] @ gap, joint.axes[:1] @ gap_rows
    return gap, turn, np.vstack([gap_rows, turn_rows])


def _bound_opposite_axis(turn: Array) -> Array:
    """Return the error of an axis that points the opposite way: it grows with the angle, as it does on the near
    side."""
    size = float(np.linalg.norm(turn))
    return turn * ((2 - size) / size) if size > VECTOR_LENGTH_MIN else np.array([2.0, 0.0])


def compute_closure_residual(joint: JointSpec, X_P: Array, X_S: Array, length: float) -> float:
    """Return the closure residual of a loop: the larger of the distance (divided by ``length``) and the angle (rad)."""
    gap, turn, _ = _compute_misses(joint, X_P, X_S)
    angle = float(np.linalg.norm(turn))
    if joint.kind is JointType.UNIVERSAL:
        angle = float(np.arcsin(min(angle, 1.0))) if angle > DIRECTION_SINE_TOL else 0.0
    elif joint.kind not in (JointType.PRISMATIC, JointType.FIXED):
        angle = float(np.arcsin(angle)) if angle <= 1 else float(np.pi - np.arcsin(2 - angle))
    return max(float(np.linalg.norm(gap)) / length, angle)


def require_closed(robot: str, loops: Sequence[tuple[JointSpec, Array, Array]], length: float) -> None:
    """Raise :class:`LoopClosureFailure` for the loop with the largest closure residual, if it exceeds rounding errors.
    Loops come with the poses of their two frames."""
    misses = [compute_closure_residual(joint, X_P, X_S, length) for joint, X_P, X_S in loops]
    if not all(miss <= GEOMETRY_DIFFERENCE_TOL for miss in misses):
        worst = int(np.argmax(misses))
        joint = loops[worst][0]
        where = robot if joint.line is None else f"{robot}:{joint.line}"
        raise LoopClosureFailure(
            where,
            misses[worst],
            GEOMETRY_DIFFERENCE_TOL,
            joint.name,
            f"{propose_closure_fix(misses[worst])} Run hrsynth lint to find where it closes.".strip(),
        )


def propose_closure_fix(opening: float) -> str:
    """Return the remedy for loops with a closure residual (characteristic lengths, rad); empty if it is large."""
    tolerance = 10.0 ** np.ceil(np.log10(max(opening, EXACT_INCIDENCE_TOL)))
    return f"Use --tolerance {tolerance:g} if its numbers are rounded." if tolerance < INCIDENCE_TOL_MAX else ""
