"""Proposal of a system to the checker: its equations in rational numbers, with approximate solutions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..solving.platform.quadrics import WorkingFrame
from ..solving.platform.roots import SolutionSet, is_real


@dataclass(frozen=True, eq=False)
class ProposedRecord:
    """System in rational numbers without boxes and bound; approximate solutions, and whether they are real (None: too
    far to be poses); for the real ones the poses (3, 4) as the checker reads them, whether they are modes, and the
    coordinates of the system in which they were found; its working frame."""

    record: dict[str, Any]
    starts: Sequence[tuple[Sequence[complex], bool | None]]
    poses: Sequence[Array]
    kept: Sequence[bool]
    bodies: Sequence[Mapping[str, Array] | None]
    frame: WorkingFrame


def starts_of(roots: SolutionSet) -> tuple[list[list[complex]], list[bool | None]]:
    """About where the solutions are, and which of them are real; None for those that are too far to be poses."""
    return (
        [[complex(v) for v in each] for each in (*roots.values, *roots.distant)],
        [*map(is_real, roots.values), *(None for _ in roots.distant)],
    )


def placed_in(X: Array, frame: WorkingFrame, d: int) -> Array:
    """A pose in working coordinates, (d, d + 1); d = 2 in a plane."""
    return np.column_stack([frame.R @ X[:3, :d], frame.point(X[:3, 3])])
