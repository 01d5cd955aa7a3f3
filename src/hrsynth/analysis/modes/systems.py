"""What the solver asks of a platform whose tips lie on curves.

A system knows its poses, q, how far the tips of a pose miss their curves, and its *squares*: the choices of legs that
give as many equations as unknowns. All curves are in one frame, the base frame; ``tips`` are in the platform's frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from ...errors import BadRequest
from ...mechanism.vectors import Array
from .curves import Curve
from .squares import Square


class System(Protocol):
    """What the solver asks of a system."""

    @property
    def curves(self) -> tuple[Curve, ...]: ...
    @property
    def size(self) -> float:
        """What residuals are divided by (m)."""
    @property
    def missing(self) -> int:
        """Freedoms that too few legs leave: the dimension of the continuum, 0 where there are legs enough."""
    def squares(self) -> Iterator[Square]:
        """The choices of legs, best first."""
    def misses(self, q: Array) -> Array:
        """What separates each tip from its curve at a pose; shape (legs, 3), metres."""
    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""


def alike(curves: Sequence[Curve], tips: Array, dimension: int) -> None:
    """Raises ``BadRequest`` unless there is a tip (dimension,) for each curve."""
    if np.shape(tips) != (len(curves), dimension) or not np.all(np.isfinite(tips)):
        raise BadRequest("tips of a platform", list(np.shape(tips)), f"{len(curves)} by {dimension} finite numbers")
