"""Closure residual of a joint: the distances and angles of its two frames that it does not allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import LoopClosureFailure
from ..geometry.so3 import convert_rotations_to_vectors, find_smallest_rotations
from ..geometry.vectors import Array, cross, find_perpendicular, invert_pose
from ..mechanism.model import JointType
from ..tolerances import EXACT_INCIDENCE_TOL, GEOMETRY_DIFFERENCE_TOL, INCIDENCE_TOL_MAX
from .jointgraph import JointSpec


def compute_closure_errors(joints: Sequence[JointSpec], D: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Return the closure residuals of joints (rows,), 6 − dof of each, their derivatives (rows, 6) by the twist of the
    joint's second frame relative to its first, in the first, and the number of the joint (rows,).

    ``D`` (k, 4, 4) are the poses of the second frames in the first. Residuals are along the wrenches that a joint
    transmits. Angles are those of the smallest rotation that brings the second frame where the joint allows it to be.
    """
    R, p = D[:, :3, :3], D[:, :3, 3]
    of = np.repeat(np.arange(len(joints)), [6 - joint.kind.freedoms for joint in joints])
    wrenches = np.concatenate([np.zeros((0, 6)), *(joint.wrenches for joint in joints)])
    turns, aligned, wanted = np.zeros_like(p), list[int](), list[Array]()
    for number, joint in enumerate(joints):
        if joint.kind is JointType.UNIVERSAL:
            wanted.append(find_perpendicular(joint.axes[0], R[number] @ joint.axes[1]))
            wrenches[np.searchsorted(of, number, "right") - 1, 3:] = cross(joint.axes[0], wanted[-1])
        elif joint.kind in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR):
            wanted.append(joint.axes[0])
        elif joint.kind in (JointType.PRISMATIC, JointType.FIXED):
            turns[number] = convert_rotations_to_vectors(R[number])
        aligned += [number] * (len(wanted) - len(aligned))
    if aligned:
        axes = np.array([joints[number].axes[-1] for number in aligned])
        turns[aligned] = find_smallest_rotations(np.array(wanted), (R[aligned] @ axes[..., None])[..., 0])
    forces, couples = wrenches[:, :3], wrenches[:, 3:]
    moments = couples + cross(p[of], forces)
    return np.sum(forces * p[of] + couples * turns[of], axis=1), np.hstack([forces, moments]), of


def compute_closure_residual(joint: JointSpec, X_P: Array, X_S: Array, length: float) -> float:
    """Return the closure residual of two frames: the larger of the distance (divided by ``length``) and the angle
    (rad)."""
    errors, rows, _ = compute_closure_errors([joint], (invert_pose(X_P) @ X_S)[None])
    forces = rows[:, :3].any(axis=1)
    return max(float(np.linalg.norm(errors[forces])) / length, float(np.linalg.norm(errors[~forces])))


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
