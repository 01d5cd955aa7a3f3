"""What a joint does: the displacement between its two frames, its screws, and what is left where a loop is open.

A *value* holds a joint's coordinates: an array for R, P, U, C, E, the displacement (4, 4) itself for S and free joints.
"""

from __future__ import annotations

import numpy as np

from ...geometry.screws import rotation, translation
from ...geometry.so3 import exponential, logarithm
from ...geometry.vectors import Array, hat, perpendicular, pose, rotation_about
from ...mechanism.model import JointType
from ..draft import Edge

_MATRIX = (JointType.SPHERICAL, JointType.FREE)


def kind_of(edge: Edge) -> JointType:
    """The joint's type; readers hand over no edge without one."""
    return edge.type or JointType.FIXED


def zero(edge: Edge) -> Array:
    """The value at which both frames coincide."""
    kind = kind_of(edge)
    return np.eye(4) if kind in _MATRIX else np.zeros(kind.freedoms)


def displacement(edge: Edge, value: Array) -> Array:
    """The pose (4, 4) of the successor's joint frame in the predecessor's."""
    match kind_of(edge):
        case JointType.REVOLUTE:
            return pose(rotation=rotation_about(edge.axes[0], value[0]))
        case JointType.PRISMATIC:
            return pose(edge.axes[0] * value[0])
        case JointType.CYLINDRICAL:
            return pose(edge.axes[0] * value[0], rotation_about(edge.axes[0], value[1]))
        case JointType.UNIVERSAL:
            return pose(rotation=rotation_about(edge.axes[0], value[0]) @ rotation_about(edge.axes[1], value[1]))
        case JointType.PLANAR:
            x, y = _plane(edge)
            return pose(x * value[0] + y * value[1], rotation_about(edge.axes[0], value[2]))
        case JointType.FIXED:
            return np.eye(4)
    return value


def moved(edge: Edge, value: Array, step: Array, R_predecessor: Array) -> Array:
    """The value after a step along the screws of :func:`screws`."""
    if kind_of(edge) not in _MATRIX:
        return value + step
    angular = R_predecessor.T @ step[-3:]
    shift = R_predecessor.T @ step[:3] if kind_of(edge) is JointType.FREE else np.zeros(3)
    return pose(value[:3, 3] + shift, exponential(angular) @ value[:3, :3])


def screws(edge: Edge, X_P: Array, X_S: Array) -> list[Array]:
    """The twists (linear at the base origin, angular) of the successor relative to the predecessor, one a coordinate;
    ``X_P`` and ``X_S`` are the poses of the joint's two frames."""
    R, p = X_P[:3, :3], X_P[:3, 3]
    match kind_of(edge):
        case JointType.REVOLUTE:
            return [rotation(R @ edge.axes[0], p)]
        case JointType.PRISMATIC:
            return [translation(R @ edge.axes[0])]
        case JointType.CYLINDRICAL:
            return [translation(R @ edge.axes[0]), rotation(R @ edge.axes[0], p)]
        case JointType.UNIVERSAL:
            return [rotation(R @ edge.axes[0], p), rotation(X_S[:3, :3] @ edge.axes[1], p)]
        case JointType.PLANAR:
            return [*(translation(R @ axis) for axis in _plane(edge)), rotation(R @ edge.axes[0], X_S[:3, 3])]
        case JointType.SPHERICAL:
            return [rotation(axis, X_S[:3, 3]) for axis in np.eye(3)]
        case JointType.FREE:
            return [*(translation(axis) for axis in np.eye(3)), *(rotation(axis, X_S[:3, 3]) for axis in np.eye(3))]
    return []


def opening(edge: Edge, X_P: Array, X_S: Array) -> tuple[Array, Array]:
    """By how much a joint's two frames miss each other, (6 − freedoms,), and its derivative by the twist of the
    successor relative to the predecessor, (6 − freedoms, 6)."""
    kind = kind_of(edge)
    if kind is JointType.FREE:
        return np.zeros(0), np.zeros((0, 6))
    R, p = X_P[:3, :3], X_S[:3, 3]
    gap, D = R.T @ (p - X_P[:3, 3]), R.T @ X_S[:3, :3]
    gap_rows = np.hstack([R.T, -R.T @ hat(p)])
    turn_rows = np.hstack([np.zeros((3, 3)), R.T])
    if kind in (JointType.PRISMATIC, JointType.FIXED):
        turn, turned = logarithm(D), turn_rows
    elif kind is JointType.SPHERICAL:
        turn, turned = np.zeros(0), np.zeros((0, 6))
    elif kind is JointType.UNIVERSAL:
        second = D @ edge.axes[1]
        turn = np.array([edge.axes[0] @ second])
        turned = (edge.axes[0] @ -hat(second) @ turn_rows)[None]
    else:
        moving, across = D @ edge.axes[0], np.array(_plane(edge))
        turn = _beyond(across @ moving) if edge.axes[0] @ moving < 0 else across @ moving
        turned = across @ -hat(moving) @ turn_rows
    if kind in (JointType.PRISMATIC, JointType.CYLINDRICAL):
        across = np.array(_plane(edge))
        gap, gap_rows = across @ gap, across @ gap_rows
    elif kind is JointType.PLANAR:
        gap, gap_rows = edge.axes[:1] @ gap, edge.axes[:1] @ gap_rows
    return np.concatenate([gap, turn]), np.vstack([gap_rows, turned])


def _plane(edge: Edge) -> tuple[Array, Array]:
    x = perpendicular(edge.axes[0])
    return x, np.cross(edge.axes[0], x)


def _beyond(turn: Array) -> Array:
    """The error of an axis that points the opposite way: it grows with the angle, as it does on the near side."""
    size = float(np.linalg.norm(turn))
    return turn * ((2 - size) / size) if size > 1e-9 else np.array([2.0, 0.0])
