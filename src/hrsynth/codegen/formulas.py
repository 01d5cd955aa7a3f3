"""The formulas of :mod:`..equations.joint_equations` on symbols of a tape: equations, poses, and the coordinates of the
joints at which loops are cut. Metres, radians, base axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..equations.joint_equations import JointLoop, LoopSystem, Swept, evaluate_residuals, rotate
from ..geometry.affine import compute_dot_forms
from ..geometry.components import arctan2
from ..geometry.vectors import build_plane_axes
from ..mechanism import Joint, JointType

Row = tuple[Any, dict[int, Any]]
"""A value and its derivatives by the coordinates that it depends on, arrays of one number or symbol."""


def list_equation_rows(system: LoopSystem, values: Sequence[Any]) -> list[Row]:
    """All equations, loop by loop, then gears; ``values`` are arrays (1,), None for those at zero."""
    found = [
        row for loop in system.loops for row in zip(*evaluate_residuals(system, loop, values, loop.rows), strict=True)
    ]
    for gear in system.gears:
        pair = [(i, rate) for i, rate in gear.slope.items() if values[i] is not None]
        terms = (system.coordinates[i].from_zero(values[i]) * rate for i, rate in pair)
        found.append((sum(terms, np.zeros(1)), dict(pair)))
    return found


def place_frame(system: LoopSystem, values: Sequence[Any], link: str) -> tuple[Any, Any, dict[int, tuple[Any, Any]]]:
    """Rotation and origin of a link's frame, and by each coordinate that moves it the velocity of its origin and its
    angular velocity, (..., 3) each."""
    way, X = system.way(system.body[link]), system.mechanism.links[link].pose
    swept = system.displacement(way, values)
    p = swept.at(X[:3, 3] / system.length)
    R = np.stack([np.broadcast_to(rotate(swept.R, X[:3, k]), (1, 3)) for k in range(3)], axis=-1)
    return (
        R,
        p,
        {i: (swept.rate(place, p), _turn(swept, place)) for place, i in enumerate(way) if values[i] is not None},
    )


def _turn(swept: Swept, place: int) -> Any:
    """The angular velocity with a coordinate."""
    return np.zeros(3) if swept.points[place] is None else swept.axes[place]


def cut(system: LoopSystem) -> list[tuple[str, JointLoop, int]]:
    """The coordinates of the cut joints that one or two axes give: name, loop, which."""
    found = []
    for loop in {loop.name: loop for loop in system.loops}.values():
        joint = system.mechanism.joints[loop.name]
        count = 0 if joint.type in (JointType.SPHERICAL, JointType.PLANAR) else joint.type.freedoms
        found += [(joint.name if count == 1 else f"{joint.name}.{k + 1}", loop, k) for k in range(count)]
    return found


def cut_coordinate(system: LoopSystem, values: Sequence[Any], loop: JointLoop, which: int) -> Row:
    """A coordinate of a cut joint (m, rad), its turn from the zero configuration between −π and π, with its
    derivatives."""
    joint: Joint = system.mechanism.joints[loop.name]
    chains = loop.chains if loop.ends == joint.links else loop.chains[::-1]
    one, other = (system.displacement(chain, values) for chain in chains)
    sides = [
        (place, i, swept, sign)
        for chain, swept, sign in zip(chains, (one, other), (-1.0, 1.0), strict=True)
        for place, i in enumerate(chain)
        if values[i] is not None
    ]
    axis = rotate(one.R, joint.axis)
    zero = 0.0 if joint.offset is None else float(joint.offset[which])
    if joint.type.has_translation and which == 0:
        # d/dq n·(B − A) = n·(v_B − v_A'), A' the point of the first body at B: n turns with that body
        A, B = one.at(loop.point), other.at(loop.point)
        return compute_dot_forms(axis, B - A) + zero, {
            i: compute_dot_forms(axis, swept.rate(place, B)) * sign for place, i, swept, sign in sides
        }
    if joint.type is JointType.UNIVERSAL:
        first, second = joint.axes
        flat = np.cross(first, second)
        if which == 1:
            # seen from the second link, the first axis turns back about the second one
            axis = rotate(other.R, second)
            start, moved, across = rotate(other.R, first), rotate(one.R, first), rotate(other.R, flat)
        else:
            start, moved, across = rotate(one.R, second), rotate(other.R, second), rotate(one.R, flat)
    else:
        normal, side = build_plane_axes(joint.axis)
        start, moved, across = rotate(one.R, normal), rotate(other.R, normal), rotate(one.R, side)
    # d(turn) = axis·(ω_B − ω_A), the other axis of a U being normal to this one
    turn = arctan2(*(np.ravel(compute_dot_forms(each, moved))[0] for each in (across, start)))
    return turn + zero if zero else turn, {
        i: compute_dot_forms(axis, _turn(swept, place)) * sign for place, i, swept, sign in sides
    }
