"""Poses by joints: the straight line of their coordinates from the zero configuration, proved piece by piece.

The line is one motor that gears turn all these joints with. Over each piece of it the loops have exactly one closure
in a tube (:mod:`.cells`), and the closure at each end of a piece lies in the tubes on both sides.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...equations.joint_equations import CouplingEquation, LoopSystem, TreeCoordinate, build_loop_system
from ...equations.loop_parts import LoopPart, split_loop_system
from ...errors import BadMechanism, BadRequest, MotorsNotEnough
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import JointLine, track_to_joints
from ...kinematics.locked_twists import set_zero
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism.pose import JointPose
from ...tolerances import PRINTED_POSE_TOL
from .cells import BranchTube, prove_all, split_cells
from .redundant import list_unexplained_equations

LINE_PIECES_COUNT = 8
"""Number of pieces of a line that are tried first."""
LINE_CUTS_COUNT = 4
"""Number of parts into which a piece that is not proved is cut."""
LINE_ROUNDS_MAX = 5
"""Number of times that pieces are tried."""
LINE_PIECES_MAX = 64
"""Largest number of pieces tried together."""


def follow_line(start: ClosedConfiguration, motion: PlatformMotion, asked: JointPose) -> ClosedConfiguration:
    """Return the configuration of :func:`.track_to_joints`, with what is proved of the line to it."""
    reached, line = track_to_joints(start, motion, asked)
    return replace(reached, line=prove_line(line))


def prove_line(line: JointLine) -> str:
    """Return ``proved``, or why not."""
    try:
        system = _combine_joints(line)
        parts, _ = split_loop_system(system)
    except (BadMechanism, BadRequest, MotorsNotEnough):
        return "found, not proved: these joints alone do not determine the platform"
    x = system.read(lambda link: np.array([step.pose(link) for step in line.steps]))
    turning = [not coordinate.slides for coordinate in system.coordinates]
    x[:, turning] = np.unwrap(x[:, turning], axis=0)
    for part in parts:
        loose = list_unexplained_equations(part)
        if loose:
            return f"found, not proved: redundant constraints of loop {loose[0].of.name} are tested at samples only"
        end = _prove_pieces(part.core, line.fractions, x[:, list(part.core.unknowns)])
        if end < 1.0:
            least = line.measure_weakest(int(np.searchsorted(line.fractions, end)))
            part_proved = f"{min(100 * end, 99.9):.3g} % of the line"
            return f"found, proved up to {part_proved} only: budget (least singular value {least:.2g})"
    return "proved"


def _combine_joints(line: JointLine) -> LoopSystem:
    """The loops with the line's joints geared to one motor, from 0 to 1; with the platform's pose where possible."""
    mechanism, joints = set_zero(line.steps[0]), [joint for joint, _ in line.axes]
    try:
        system = build_loop_system(mechanism, joints, free=True)
    except BadMechanism:  # one of the joints carries the platform itself
        system = build_loop_system(mechanism, joints)
    count, units = len(system.coordinates), line.steps[0].model.length / system.length
    gears = []
    for (joint, axis), reach in zip(line.axes, line.reach.tolist(), strict=True):
        names = sorted(at.name for at in system.coordinates if at.joint == joint)
        place = system.names.index(names[axis])
        ratio = reach * (units if system.coordinates[place].slides else 1.0)
        gears.append(CouplingEquation(joint, count, place, ratio))
    motor = TreeCoordinate("line", "line", True, np.eye(3)[0], np.zeros(3), -1, True)
    freed = (replace(coordinate, driven=False) for coordinate in system.coordinates)
    return replace(system, coordinates=(*freed, motor), gears=(*system.gears, *gears))


def _prove_pieces(part: LoopPart, fractions: Array, steps: Array) -> float:
    """Return the part of the line, from 0, over which tubes about unknowns (k, p) at ``fractions`` (k,) are proved
    without a gap."""
    pieces = [*pairwise(np.linspace(0.0, 1.0, LINE_PIECES_COUNT + 1).tolist())]
    points: dict[float, BranchTube | None] = {}
    for _ in range(LINE_ROUNDS_MAX):
        ends = sorted({end for piece in pieces for end in piece} - points.keys())
        centre, half = split_cells(*np.array(pieces).T)
        q, half = np.concatenate([centre, ends])[:, None], np.concatenate([half, np.zeros(len(ends))])[:, None]
        near = np.array([np.interp(q[:, 0], fractions, column) for column in steps.T]).T
        x, closed = part.close(q, near)
        off = np.abs(x - near).max(axis=-1, initial=0.0) * np.isin(q[:, 0], fractions)
        same = np.logical_and(closed, off < PRINTED_POSE_TOL)
        tubes = [tube if fine else None for tube, fine in zip(prove_all(part, q, half, x), same, strict=True)]
        points |= dict(zip(ends, tubes[len(pieces) :], strict=True))
        left: list[tuple[float, float]] = []
        for (low, high), tube in zip(pieces, tubes, strict=False):
            joined = (points[low], points[high])
            if tube is None or not all(point is not None and point.is_within(tube) for point in joined):
                left += pairwise(np.linspace(low, high, LINE_CUTS_COUNT + 1).tolist())
        if not left:
            return 1.0
        pieces = left[:LINE_PIECES_MAX]
        if len(left) > LINE_PIECES_MAX:
            break
    return left[0][0]
