"""Solutions at infinity of six conditions on points of a rigid body, enclosed (docs/pages/proofs.md, section 8).

With g = g' + k e and e·g = 0, x and y (:mod:`.root_bound`) are those of e and g', and r = 4 (g'·g' − κ) with
κ e·e = (e·g')². So (e, g', κ), e up to a factor and g' up to a multiple of e, are coordinates of X wherever M is not
zero, one to one, also where k grows without bound: h = e·e = 0 with κ not zero. A solution there is enclosed as any
other, and is one of the 40.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import ENDPOINT_DISTANCE_TOL, SOLUTION_DISTANCE_MAX
from ..krawczyk import Polynomial, enclose_zero
from ..newton import approach_zeros
from .polynomials import Quadric
from .quadrics import PoseSystem, Within

ENDPOINT_NEWTON_STEPS_COUNT = 8
"""Newton's steps from the end of a path."""
ENDPOINT_COORDINATES_COUNT = 3
"""Coordinates that are tried."""


class FarCondition(NamedTuple):
    """One of the six: the quadric of (e, g'), less κ times its coefficient of g·g."""

    A: Any

    def value(self, z: Sequence[Any]) -> Any:
        """The value at (e, g', κ) in the chart's coordinates, shape (9,)."""
        x = np.array(z[:8])
        return x @ self.A @ x - self.A[4, 4] * z[8]

    def slopes(self, z: Sequence[Any]) -> list[Any]:
        """The derivative by each unknown."""
        x = np.array(z[:8])
        return [*(self.A @ x + x @ self.A), -self.A[4, 4]]


class FarPose(NamedTuple):
    """κ e·e = (e·g')²; both products as quadrics of (e, g')."""

    own: Any
    normal: Any

    def value(self, z: Sequence[Any]) -> Any:
        """The value at (e, g', κ)."""
        x = np.array(z[:8])
        s = x @ self.normal @ x
        return z[8] * (x @ self.own @ x) - s * s

    def slopes(self, z: Sequence[Any]) -> list[Any]:
        """The derivative by each unknown."""
        x = np.array(z[:8])
        s, w = x @ self.normal @ x, x @ self.own @ x
        return [*(z[8] * (self.own @ x + x @ self.own) - 2 * s * (self.normal @ x + x @ self.normal)), w]


class FixedForm(NamedTuple):
    """row · z = value, which fixes a factor or a multiple."""

    row: Any
    wanted: int

    def value(self, z: Sequence[Any]) -> Any:
        """The value at z (9,)."""
        return self.row @ np.array(z) - self.wanted

    def slopes(self, z: Sequence[Any]) -> list[Any]:
        """The derivative by each unknown."""
        return list(self.row)


def count_beyond(part: PoseSystem, balls: Within, far: Array, wanted: int) -> int:
    """Count the solutions at infinity, or beyond ``SOLUTION_DISTANCE_MAX`` for all input in the balls, that are
    enclosed and distinct: near the ends ``far`` (m, 8) of paths, as (e, g). Other coordinates are tried until as many
    as ``wanted`` are."""
    most = 0
    for number in range(1, ENDPOINT_COORDINATES_COUNT + 1):
        most = max(most, _enclose_infinity(part, balls, far, np.exp(1j * number * np.arange(1, 5) ** 2)))
        if most >= wanted:
            break
    return most


def _enclose_infinity(part: PoseSystem, balls: Within, far: Array, mark: Array) -> int:
    """As :func:`count_beyond`, with e and g' fixed by mark·e = 1 and mark·g' = 0; ``mark`` (4,) has entries of length
    one."""
    from flint import acb

    study, norm = part.chart.study, part.chart.nonzero
    assert study is not None
    assert norm is not None
    rows = [np.append(mark @ half, 0.0) for half in (study[:4], study[4:])]
    quadrics = part.equations()
    rounded = _build_nine([Quadric(quadric.A.astype(float)) for quadric in quadrics], norm.A.astype(float), rows)
    thick = _build_nine(part.equations(balls), norm.A, [np.array([acb(v) for v in row], dtype=object) for row in rows])
    boxes: list[list[Any]] = []
    known: list[Array] = []
    for z in _polish(rounded, _place_starts(np.vstack([far, far.conj()]), mark, study)):
        if not np.all(np.isfinite(z)) or any(np.abs(z - point).max() < ENDPOINT_DISTANCE_TOL for point in known):
            continue
        known.append(z)
        box = enclose_zero(thick, [acb(v) for v in z.tolist()])
        if box is None or box[8].contains(0):  # κ = 0 at double points
            continue
        # |e|² is at least 1/|mark|² = 1/4, and |e·e| = |e·g'|² / |κ|
        x = np.array(box[:8])
        size = float((x @ quadrics[0].A @ x).abs_upper()) ** 2 / float(box[8].abs_lower())
        if 4.0 * size * SOLUTION_DISTANCE_MAX < 1.0 and all(_is_disjoint(box, kept) for kept in boxes):
            boxes.append(box)
    return len(boxes)


def _build_nine(quadrics: Sequence[Quadric], norm: Any, rows: Sequence[Any]) -> list[Polynomial]:
    """The nine for quadrics of which the first is e·g, with the factor and the multiple fixed by rows (9,)."""
    first, *rest = (quadric.A for quadric in quadrics)
    return [FixedForm(rows[0], 1), FixedForm(rows[1], 0), FarPose(norm, first), *map(FarCondition, rest)]


def _place_starts(far: Array, mark: Array, study: Array) -> Array:
    """(e, g', κ) in the chart's coordinates with mark·e = 1 and mark·g' = 0, shape (m, 9), of (e, g)."""
    x = far / (far[:, :4] @ mark)[:, None]
    e, g = x[:, :4], x[:, 4:]
    moved = g - e * (g @ mark)[:, None]
    kappa = (moved * moved).sum(axis=1) - (g * g).sum(axis=1)
    return np.column_stack([np.hstack([e, moved]) @ np.linalg.inv(study).T, kappa])


def _polish(equations: Sequence[Polynomial], starts: Array) -> Array:
    """Places (m, 9) after Newton's steps."""

    def evaluate(z: Array) -> tuple[Array, Array]:
        J: Array = np.array([[equation.slopes(list(point)) for equation in equations] for point in z], dtype=complex)
        F: Array = np.array([[equation.value(list(point)) for equation in equations] for point in z], dtype=complex)
        scale = np.abs(J).max(axis=2)
        return F / scale, J / scale[..., None]

    return approach_zeros(evaluate, starts, steps=ENDPOINT_NEWTON_STEPS_COUNT).x


def _is_disjoint(box: Sequence[Any], second: Sequence[Any]) -> bool:
    """Return True if two boxes are disjoint."""
    return any(not (a - b).contains(0) for a, b in zip(box, second, strict=True))
