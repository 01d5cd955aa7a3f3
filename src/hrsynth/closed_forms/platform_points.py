"""Vectors and links that the platform's pose alone decides. A pose is (p, R): a point of the platform, its rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.balls import Field, widen
from ..geometry.vectors import Array
from ..tolerances import HIDDEN_ROBOT_RESIDUAL_TOL, RANK_CUTOFF_FRACTION


@dataclass(frozen=True, eq=False)
class PlatformPoint:
    """A vector that the pose alone decides: ``follows`` p + R ``turned`` + ``constant``; ``fitted`` to samples, else
    read from the file's joints."""

    follows: bool
    turned: Array
    constant: Array
    fitted: bool = False

    def value(self, p: Field, R: Field) -> Field:
        """The vectors (n, 3) at poses (n, 3), (n, 3, 3); of balls, with all that the rounded numbers stand for."""
        found = (p if self.follows else 0 * p) + self.constant
        return widen(np.asarray(found + R @ self.turned if np.any(self.turned) else found), HIDDEN_ROBOT_RESIDUAL_TOL)


ORIGIN = PlatformPoint(True, np.zeros(3), np.zeros(3))
"""The point of the platform by which poses are given."""


def platform_point(values: Array, p: Array, R: Array) -> PlatformPoint | None:
    """The rule that vectors (n, 3) follow at poses (n, 3), (n, 3, 3), by least squares; None where there is none."""
    if np.max(np.abs(values - values[0])) < HIDDEN_ROBOT_RESIDUAL_TOL:
        return PlatformPoint(False, np.zeros(3), values[0], True)
    rows = np.concatenate([R, np.broadcast_to(np.eye(3), R.shape)], axis=2).reshape(-1, 6)
    for follows in (False, True):
        wanted = (values - p if follows else values).reshape(-1)
        found = np.linalg.lstsq(rows, wanted, rcond=RANK_CUTOFF_FRACTION)[0]
        if np.max(np.abs(rows @ found - wanted)) < HIDDEN_ROBOT_RESIDUAL_TOL:
            turned, constant = np.where(np.abs(found) < HIDDEN_ROBOT_RESIDUAL_TOL, 0.0, found).reshape(2, 3)
            return PlatformPoint(follows, turned, constant, True)
    return None
