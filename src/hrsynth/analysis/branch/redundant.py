"""Redundant loop equations: proof that they hold, by the group in which a loop's links move, or a bound."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...equations.joint_equations import JointLoop, LoopSystem, list_joint_parts
from ...equations.loop_parts import LoopEquation, LoopPart, evaluate_equations
from ...geometry.ranks import compute_range_basis
from ...geometry.vectors import Array
from ...mechanism import JointType
from .cells import BranchTube, stack_tubes


def list_unexplained_equations(part: LoopPart) -> tuple[LoopEquation, ...]:
    """Redundant loop equations that do not follow from the others. All displacements about a loop lie in the group of
    dimension d that its joints generate. With f dof of the cut joint, d − f independent equations close it; the others
    hold as long as these are independent."""
    found = []
    chosen = [each.of.name for block in part.blocks for each in block.equations]
    needed = {loop.name: count_independent_equations(part.system, loop) for loop in part.loops if loop.swung is None}
    for each in part.left_out:
        name = each.of.name
        if name not in needed or chosen.count(name) != needed[name]:
            found.append(each)
    return tuple(found)


def count_independent_equations(system: LoopSystem, loop: JointLoop) -> int:
    """Return the number of independent equations of a loop."""
    return group_dimension(system, loop) - JointType(system.mechanism.joints[loop.name].type).freedoms


def group_dimension(system: LoopSystem, loop: JointLoop) -> int:
    """The dimension of the Lie algebra that the twists of a loop's joints at zero generate."""
    joint = system.mechanism.joints[loop.name]
    lines = [(each.slides, each.axis, each.point) for each in (system.coordinates[i] for i in loop.coordinates)]
    lines += [(slides, axis, loop.point) for _, slides, axis in list_joint_parts(joint)]
    basis = np.zeros((6, 0))
    twists = (
        np.array(
            [[*np.zeros(3), *axis] if slides else [*axis, *np.cross(point, axis)] for slides, axis, point in lines]
        )
        .reshape(-1, 6)
        .T
    )
    while True:
        basis, rank = compute_range_basis(np.hstack([basis, twists]), 1.0)
        brackets = [_bracket(a, b) for a in basis.T for b in basis.T]
        if rank.value == 6 or not brackets:
            return rank.value
        twists = np.array(brackets).T
        if compute_range_basis(np.hstack([basis, twists]), 1.0)[1].value == rank.value:
            return rank.value


def _bracket(a: Array, b: Array) -> Array:
    """[a, b] of twists (angular velocity, velocity at the origin)."""
    return np.concatenate([np.cross(a[:3], b[:3]), np.cross(a[:3], b[3:]) + np.cross(a[3:], b[:3])])


def bound_closure_error(part: LoopPart, tubes: Sequence[BranchTube], equations: Sequence[LoopEquation]) -> float:
    """A bound, over tubes, of equations that were left out (characteristic lengths, pure numbers; of a distance how far
    it is off)."""
    if not equations or not tubes:
        return 0.0
    trial = stack_tubes(part, tubes)
    values, _ = evaluate_equations(part.system, equations, trial.forms(trial.radius))
    bound = 0.0
    for each, value in zip(equations, values, strict=True):
        size = float(np.max(value.size))
        if isinstance(each.of, JointLoop) and each.row is not None and each.row.kind == "distance":
            assert each.of.swung is not None
            centre = part.system.coordinates[each.of.chains[1][each.of.swung]].point
            size /= float(np.linalg.norm(each.of.point - centre)) * (1 - 1e-12)
        bound = max(bound, size)
    return bound
