"""Motion of a joint: displacement between its two frames, its screws, and the closure residual of a loop.

A *value* holds a joint's coordinates: an array for R, P, U, C, E, the displacement (4, 4) itself for S and free joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import LoopsNotClosed
from ..geometry.screws import rotation, translation
from ..geometry.so3 import exponential, logarithm
from ..geometry.vectors import Array, hat, pose
from ..mechanism.model import JointType
from ..tolerances import EXACT, LARGEST_NOISE, SAME_DIRECTION, SAME_GEOMETRY, WITHOUT_DIRECTION
from .jointgraph import JointSpec

_MATRIX = (JointType.SPHERICAL, JointType.FREE)


def zero(joint: JointSpec) -> Array:
    """Return the value at which both frames coincide."""
    return np.eye(4) if joint.kind in _MATRIX else np.zeros(joint.kind.freedoms)


def displacement(joint: JointSpec, value: Array) -> Array:
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
    """Return the value after a step along the screws of :func:`screws`."""
    if joint.kind not in _MATRIX:
        return value + step
    angular = R_predecessor.T @ step[-3:]
    shift = R_predecessor.T @ step[:3] if joint.kind is JointType.FREE else np.zeros(3)
    return pose(value[:3, 3] + shift, exponential(angular) @ value[:3, :3])


def screws(joint: JointSpec, X_P: Array, X_S: Array) -> list[Array]:
    """Return the twists (linear at the base origin, angular) of the successor relative to the predecessor, one for each
    coordinate; ``X_P`` and ``X_S`` are the poses of the joint's two frames."""
    found = []
    for number, (axis, K) in enumerate(joint.parts):
        if joint.kind not in _MATRIX:
            axis = (X_S if joint.kind is JointType.UNIVERSAL and number == 1 else X_P)[:3, :3] @ axis
        found.append(translation(axis) if K is None else rotation(axis, X_S[:3, 3]))
    return found


def opening(joint: JointSpec, X_P: Array, X_S: Array) -> tuple[Array, Array]:
    """Return the closure residual of a joint's two frames, (6 − dof,), and its derivative by the twist of the successor
    relative to the predecessor, (6 − dof, 6)."""
    gap, turn, rows = _misses(joint, X_P, X_S)
    return np.concatenate([gap, turn]), rows


def _misses(joint: JointSpec, X_P: Array, X_S: Array) -> tuple[Array, Array, Array]:
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
        turn = logarithm(D)
    elif kind is JointType.SPHERICAL:
        turn, turn_rows = np.zeros(0), np.zeros((0, 6))
    elif kind is JointType.UNIVERSAL:
        second = D @ joint.axes[1]
        turn = np.array([joint.axes[0] @ second])
        turn_rows = (joint.axes[0] @ -hat(second) @ turn_rows)[None]
    else:
        moving, across = D @ joint.axes[0], joint.across
        turn = _beyond(across @ moving) if joint.axes[0] @ moving < 0 else across @ moving
        turn_rows = across @ -hat(moving) @ turn_rows
    if kind.slides:
        gap, gap_rows = joint.across @ gap, joint.across @ gap_rows
    elif kind is JointType.PLANAR:
        gap, gap_rows = joint.axes[:1] @ gap, joint.axes[:1] @ gap_rows
    return gap, turn, np.vstack([gap_rows, turn_rows])


def _beyond(turn: Array) -> Array:
    """Return the error of an axis that points the opposite way: it grows with the angle, as it does on the near
    side."""
    size = float(np.linalg.norm(turn))
    return turn * ((2 - size) / size) if size > WITHOUT_DIRECTION else np.array([2.0, 0.0])


def residual(joint: JointSpec, X_P: Array, X_S: Array, length: float) -> float:
    """Return the closure residual of a loop: the larger of the distance (divided by ``length``) and the angle (rad)."""
    gap, turn, _ = _misses(joint, X_P, X_S)
    angle = float(np.linalg.norm(turn))
    if joint.kind is JointType.UNIVERSAL:
        angle = float(np.arcsin(min(angle, 1.0))) if angle > SAME_DIRECTION else 0.0
    elif joint.kind not in (JointType.PRISMATIC, JointType.FIXED):
        angle = float(np.arcsin(angle)) if angle <= 1 else float(np.pi - np.arcsin(2 - angle))
    return max(float(np.linalg.norm(gap)) / length, angle)


def require_closed(robot: str, loops: Sequence[tuple[JointSpec, Array, Array]], length: float) -> None:
    """Raise :class:`LoopsNotClosed` for the loop with the largest closure residual, if it exceeds rounding errors.
    Loops come with the poses of their two frames."""
    misses = [residual(joint, X_P, X_S, length) for joint, X_P, X_S in loops]
    if not all(miss <= SAME_GEOMETRY for miss in misses):
        worst = int(np.argmax(misses))
        joint = loops[worst][0]
        where = robot if joint.line is None else f"{robot}:{joint.line}"
        raise LoopsNotClosed(
            where,
            misses[worst],
            SAME_GEOMETRY,
            joint.name,
            f"{cure(misses[worst])} Run hrsynth lint to find where it closes.".strip(),
        )


def cure(opening: float) -> str:
    """Return the remedy for loops with a closure residual (characteristic lengths, rad); empty if it is large."""
    tolerance = 10.0 ** np.ceil(np.log10(max(opening, EXACT)))
    return f"Use --tolerance {tolerance:g} if its numbers are rounded." if tolerance < LARGEST_NOISE else ""
