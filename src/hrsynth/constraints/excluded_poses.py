"""Poses that a named condition does not cover: those at which the platform can move as it does nowhere else.

At a constraint singularity the loops lose rank. A platform that translates, or moves in a plane, may rotate or leave
that plane there, and continue in another operation mode. Its angular velocity then lies in the space that the joints
of every leg span over all samples. There is no such pose if these spaces of all legs have no common direction, if one
leg alone keeps the platform in its plane, or if a locked leg allows no such motion. A spatial platform is
constrained by what the condition names and by nothing else, at all poses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array, cross
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked_twists import compute_twists_at_samples
from ..mechanism.legs import LegDecomposition
from ..tolerances import RELATION_ANGLE_TOL
from .condition import Condition, NamedCondition
from .locked_legs import LockedLeg
from .named_vectors import collect_poses, is_zero_everywhere
from .pattern import ConstraintPattern


def describe_excluded_poses(
    decomposition: LegDecomposition,
    pattern: ConstraintPattern,
    condition: Condition | None,
    samples: Sequence[ClosedConfiguration],
) -> tuple[str, ...]:
    """Poses to which a condition does not apply, in words; none of one that the screws of all joints give."""
    if not isinstance(condition, NamedCondition):
        return ()
    found = []
    folding = [leg.label for leg in decomposition.legs if leg.has_loops]
    if folding:
        found.append(
            f"poses at which a loop inside a leg ({', '.join(folding)}) is flat, and those beyond, at "
            "which it has another assembly mode (crossed rods), are not examined"
        )
    more: tuple[str, ...] = ()
    if pattern.motion in ("translations", "bodies") and may_turn(decomposition, pattern.legs, samples):
        more = ("turn", "turned")
    elif pattern.motion == "planar" and _may_leave_the_plane(decomposition, pattern, samples):
        more = ("leave its plane", "left it")
    if more:
        found.append(
            f"poses at which the loops lose rank, so that the platform may {more[0]} (constraint "
            f"singularities), and those at which it has {more[1]} are not examined"
        )
    return tuple(found)


def may_turn(
    decomposition: LegDecomposition, held: Sequence[LockedLeg], samples: Sequence[ClosedConfiguration]
) -> bool:
    """Return True if a platform link may rotate at some pose with these legs locked, judged by the joint axes of all
    legs."""
    if decomposition.point is not None:
        return False
    for body in dict.fromkeys(leg.platform_link for leg in decomposition.legs):
        if any(leg.body == body and leg.turns == 0 and not leg.spins for leg in held):
            continue
        forbidden = []
        for twists in _compute_leg_twists(decomposition, body, samples):
            turns, _ = compute_range_basis(twists[3:], 1.0)
            forbidden.append(np.eye(3) - turns @ turns.T)
        if np.linalg.svd(np.vstack(forbidden), compute_uv=False)[2] < RELATION_ANGLE_TOL:
            return True
    return False


def _may_leave_the_plane(
    decomposition: LegDecomposition, pattern: ConstraintPattern, samples: Sequence[ClosedConfiguration]
) -> bool:
    """Return True if no leg, locked or not, keeps the platform in its plane."""
    assert pattern.plane is not None
    if pattern.flat and any(leg.turns == 1 and not leg.virtual for leg in pattern.legs):
        return False
    normal = pattern.plane.value(collect_poses(samples[:1], pattern.plane.links))[0]
    return not any(
        is_zero_everywhere(normal @ twists[:3]) and is_zero_everywhere(cross(twists[3:].T, normal))
        for twists in _compute_leg_twists(decomposition, pattern.bodies[0], samples)
    )


def _compute_leg_twists(
    decomposition: LegDecomposition, body: str, samples: Sequence[ClosedConfiguration]
) -> list[Array]:
    """Basis (6, k) of the twists that the joints of each leg on a link can give its end, over all samples."""
    return [
        np.hstack(compute_twists_at_samples(samples, leg, (), decomposition.mechanism.base))
        for leg in decomposition.legs
        if leg.platform_link == body
    ]
