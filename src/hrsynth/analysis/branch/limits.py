"""Limits of joints without a motor over a proved branch.

Over a cell |q − q_c| ≤ h the closure lies in the tube |x − x_c − S (q − q_c)| ≤ r. Each coordinate is at most
x_c + |S| h + r, and at the corner where x_c + |S| h is attained at least x_c + |S| h − r; likewise below.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...mechanism import Mechanism
from ...tolerances import AFFINE_ROUNDING
from .answer import KEPT, OPEN, PASSED, UNSEEN, BranchLimit, BranchPart


def list_branch_limits(
    robot: Mechanism, motors: Sequence[str], parts: Sequence[BranchPart], held: Sequence[str]
) -> Iterator[BranchLimit]:
    """Return the limits of all joints without a motor, in the order of the file, with their verdicts over the proved
    cells."""
    for name in robot.joints:
        if name in robot.tilt_limits:
            yield BranchLimit(name, None, None, None, None, UNSEEN)
        if name in motors or name not in robot.filed:
            continue
        lower, upper = robot.filed[name]
        part = next((each for each in parts if name in each.passive and each.cells), None)
        if part is not None:
            k = part.passive.index(name)
            x = np.array([cell.centre[k] for cell in part.cells])
            swing = np.array([np.abs(cell.slopes[k]) @ (cell.high - cell.low) / 2 for cell in part.cells])
            r = np.array([cell.radius[k] for cell in part.cells])
            r = r + AFFINE_ROUNDING * (np.abs(x) + swing + r)
            least, most = float((x - swing - r).min()), float((x + swing + r).max())
            passed = (x - swing + r).min() < lower or (x + swing - r).max() > upper
            verdict = KEPT if lower <= least and most <= upper else PASSED if passed else OPEN
            bounded = np.isfinite(least)
            yield BranchLimit(name, lower, upper, least if bounded else None, most if bounded else None, verdict)
        elif name in held:
            offset = robot.joints[name].offset
            at = 0.0 if offset is None else float(offset[0])
            yield BranchLimit(name, lower, upper, at, at, KEPT if lower <= at <= upper else PASSED)
        else:
            yield BranchLimit(name, lower, upper, None, None, UNSEEN)
