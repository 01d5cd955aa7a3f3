"""Residuals of all loops by Pinocchio's constraint models, and their Jacobian in one product.

Let r be an axis of the first frame of a loop, p1 and p2 the points of its frames. The rows of a ball, whose residual is
r·(p2 − p1), are what the forces (r, p2 × r) do on the screws of the joints between the frames; those of a weld belong
to the forces (r, p1 × r) and the torques (0, r). All components are differences of two products of numbers of
placements, read where Pinocchio keeps them; the placement of the world has the numbers 1 and 0. Pinocchio's
``getConstraintsJacobian`` gives the same rows in twice the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..geometry.vectors import Array

Places = NDArray[np.intp]
PLACEMENT_NUMBERS_COUNT = 12
"""Numbers of a placement: three axes, then the point."""
_AXES, _POINT = np.arange(9).reshape(3, 3), np.arange(9, 12)
_ONE, _ZERO = 0, 1
"""Index where a placement has them; where that of the world has a 1 and a 0."""
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def read_numbers(placements: Sequence[pin.SE3]) -> Array:
    """The numbers of a vector of placements, (k, 12), in Pinocchio's memory: they change with it, and live as long."""
    first, last = placements[0].rotation, placements[len(placements) - 1].translation
    shape = len(placements), PLACEMENT_NUMBERS_COUNT
    found = np.lib.stride_tricks.as_strided(first, shape, (PLACEMENT_NUMBERS_COUNT * first.itemsize, first.itemsize))
    assert np.shares_memory(found[-1, 9:], last), "Pinocchio hands out copies (pinocchio.sharedMemory)"
    return found


class LoopRows:
    """Rows of loops between two frames of a model, spherical or not; ``supports`` (nv,) marks what moves a body."""

    def __init__(
        self, model: pin.Model, data: pin.Data, loops: Sequence[tuple[int, int, bool]], supports: Callable[[int], Array]
    ) -> None:
        self._model, self._data = model, data
        self.sizes = tuple(3 if ball else 6 for _, _, ball in loops)
        self._constraints: list[tuple[Any, Any]] = []
        blocks: list[tuple[int, int, bool]] = []
        signs = np.zeros((sum(self.sizes), model.nv))
        for (first, second, ball), size in zip(loops, self.sizes, strict=True):
            near, far = model.frames[first], model.frames[second]
            rows = slice(3 * len(blocks), 3 * len(blocks) + size)
            signs[rows] = supports(far.parentJoint) - supports(near.parentJoint)
            blocks += [(first, second, False)] if ball else [(first, first, False), (first, first, True)]
            kind = pin.PointAnchorConstraintModel if ball else pin.FrameAnchorConstraintModel
            constraint = kind(model, near.parentJoint, near.placement, far.parentJoint, far.placement)
            self._constraints.append((constraint, constraint.createData()))
        self._residuals = [each.constraint_position_error for _, each in self._constraints]
        starts, ends, turns = np.array(blocks, dtype=np.intp).reshape(-1, 3, 1, 1).swapaxes(0, 1)
        axes = PLACEMENT_NUMBERS_COUNT * starts + _AXES
        p = PLACEMENT_NUMBERS_COUNT * ends + _POINT + 0 * _AXES
        moving = np.array([axes, p[..., _NEXT], p[..., _LAST], axes[..., _LAST], axes[..., _NEXT]])
        zero, one = np.full_like(axes, _ZERO), np.full_like(axes, _ONE)
        forces = np.where(turns, np.array([zero, axes, zero, one, zero]), moving)
        forces = np.ascontiguousarray(forces.transpose(0, 3, 1, 2).reshape(5, 3, -1))
        numbers = read_numbers(data.oMf).reshape(-1)
        self.jacobian = _prepare_product(numbers.take, forces, data.J.reshape(6, model.nv), signs)
        """Derivatives of the residuals at the present placements, (rows, nv)."""

    def residual(self) -> Array:
        """Return the residuals at the present placements."""
        for constraint, state in self._constraints:
            constraint.calc(self._model, self._data, state)
        return np.concatenate([np.zeros(0), *self._residuals])


def _prepare_product(take: Callable[..., Array], forces: Places, screws: Array, signs: Array) -> Callable[[], Array]:
    """Return the work of the forces at these places on the screws that move a loop's far end (sign 1) or its near end
    (−1). Constants of all calls are bound here: to look them up would take a tenth of the time."""
    parts = np.empty(forces.shape)
    left, right = parts[1:3], parts[3:]
    moments, less = left
    dot, multiply, subtract = parts[:2].reshape(6, -1).T.dot, np.multiply, np.subtract

    def product() -> Array:
        take(forces, None, parts, "clip")
        multiply(left, right, left)
        subtract(moments, less, moments)
        J: Array = dot(screws)
        J *= signs
        return J

    return product
