"""Whether loops can let a platform turn that translates wherever they keep their rank.

At a constraint singularity the loops lose rank, and the platform may turn there about an axis that its legs have in
common. It then turns with rates that every leg's joints can give its end, and these are within one space for each leg,
the span of what they can give over all samples. Where no direction is in the spaces of all legs there is no such pose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.ranks import range_basis
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked import leg_twists_together
from ..mechanism.legs import LegDecomposition
from ..tolerances import SAME_RELATION
from .locked_legs import LockedLeg


def may_turn(anatomy: LegDecomposition, held: Sequence[LockedLeg], samples: Sequence[ClosedConfiguration]) -> bool:
    """Whether the platform, one body, may turn at some pose with these legs held, as far as the turns of all legs'
    joints tell."""
    if anatomy.point is not None or any(leg.turns == 0 and not leg.spins for leg in held):
        return False
    forbidden = []
    for leg in anatomy.legs:
        twists = leg_twists_together(samples, leg, (), anatomy.mechanism.base)
        turns, _ = range_basis(np.hstack([each[3:] for each in twists]), 1.0)
        forbidden.append(np.eye(3) - turns @ turns.T)
    return bool(np.linalg.svd(np.vstack(forbidden), compute_uv=False)[2] < SAME_RELATION)
