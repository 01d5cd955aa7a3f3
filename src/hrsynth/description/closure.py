"""A loop is closed when the frames of its two ends agree in all that its joint does not leave free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import LoopsNotClosed
from ..geometry.vectors import Array
from ..mechanism.model import JointType
from ..tolerances import SAME_DIRECTION, SAME_GEOMETRY


@dataclass(frozen=True, eq=False)
class LoopEnds:
    """A loop as a file gives it: the poses (4, 4) of its frames in the base frame, on the predecessor and on the
    successor, and its axes: the first in the predecessor's loop frame, the second (U only) in the successor's."""

    name: str
    type: JointType
    X_predecessor: Array
    X_successor: Array
    axes: tuple[Array, ...]
    line: int | None = None

    @property
    def point(self) -> Array:
        """The joint's centre, fixed in the predecessor; shape (3,), in the base frame."""
        return self.X_predecessor[:3, 3]

    @property
    def directions(self) -> tuple[Array, ...]:
        """The joint's axes in the base frame, each as fixed in its own link."""
        frames = (self.X_predecessor, self.X_successor)
        return tuple(X[:3, :3] @ axis for X, axis in zip(frames, self.axes, strict=False))


def residual(loop: LoopEnds, length: float) -> float:
    """By how much a loop misses: the larger of the gap (divided by ``length``) and the angle (radians)."""
    gap = loop.X_successor[:3, 3] - loop.X_predecessor[:3, 3]
    R_p, R_s = loop.X_predecessor[:3, :3], loop.X_successor[:3, :3]
    angle = 0.0
    match loop.type:
        case JointType.REVOLUTE | JointType.CYLINDRICAL | JointType.PLANAR:
            a, b = R_p @ loop.axes[0], R_s @ loop.axes[0]
            angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
        case JointType.PRISMATIC | JointType.FIXED:
            R = R_p.T @ R_s
            sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
            angle = float(np.arctan2(sine, np.trace(R) - 1.0))
        case JointType.UNIVERSAL:
            a, b = loop.directions
            angle = abs(float(np.arcsin(np.clip(a @ b, -1.0, 1.0))))
            angle = angle if angle > SAME_DIRECTION else 0.0
    if loop.type in (JointType.PRISMATIC, JointType.CYLINDRICAL):
        along = R_p @ loop.axes[0]
        gap = gap - along * float(along @ gap)
    elif loop.type is JointType.PLANAR:
        gap = np.array([float((R_p @ loop.axes[0]) @ gap)])
    return max(float(np.linalg.norm(gap)) / length, angle)


def require_closed(robot: str, loops: list[LoopEnds], length: float, tolerance: float = SAME_GEOMETRY) -> None:
    """Raise :class:`LoopsNotClosed` for the loop that misses most, where one misses by more than ``tolerance``."""
    if not loops:
        return
    misses = [residual(loop, length) for loop in loops]
    worst = int(np.argmax(misses))
    if not misses[worst] <= tolerance:
        where = robot if loops[worst].line is None else f"{robot}:{loops[worst].line}"
        raise LoopsNotClosed(where, misses[worst], tolerance, loops[worst].name)
