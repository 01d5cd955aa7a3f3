"""Whether a step from one closed configuration to another follows the branch it starts on (theory 9).

Components of the configuration space meet where the loops lose rank, and the smallest singular values fall there in
proportion to the distance. So a step counts as following where, along it and along its correction, mobility, tangent
space and all singular values of the loops agree: then it is short beside the distance to the next such place. This is
measured at four points, not proved between them.
"""

from __future__ import annotations

import numpy as np

from ..geometry.ranks import largest_angle
from ..geometry.vectors import Array
from ..tolerances import NUDGE
from .configuration import ClosedConfiguration

TURNED = 0.3
"""Largest principal angle (radians) between the tangent spaces at both ends of a step."""
CHANGED = 1.5
"""Largest ratio between the loops' singular values, in order, at the start of a step and along it."""
CORRECTED = 0.2
"""Longest correction, as part of the step: what ``TURNED`` lets a smooth branch bend away, with a margin."""
EVENLY = 0.2
"""Part of the weakest singular value by which its fall to a singularity may depart from an even one."""


def follows(here: ClosedConfiguration, step: Array, there: ClosedConfiguration) -> bool:
    """Whether ``there``, which the tangent ``step`` (nv,) from ``here`` was corrected to, lies beside ``here`` on its
    branch: same mobility, tangent spaces close, no sheet beside it, singular values alike half way, at the step's end
    and there."""
    kept = here.strengths
    if len(there.strengths) != len(kept):
        return False
    if not len(kept):
        return True
    return (_alike(kept, there.strengths) and _same_side(here, there)
            and largest_angle(here.kernel()[0], there.kernel()[0]) <= TURNED
            and all(_alike(kept, _values(here, part * step, len(kept))) for part in (0.5, 1.0)))


def nears(here: ClosedConfiguration, step: Array, there: ClosedConfiguration) -> bool:
    """As :func:`follows` for the end of a way, which may be a singularity or near one: the weakest singular value may
    fall to zero, evenly and without a change of its sign, while all others stay alike."""
    kept, ahead = here.strengths, there.strengths
    others = len(kept) - 1
    if not others <= len(ahead) <= len(kept):
        return False
    T, tangent = here.kernel()[0], there.kernel()[0]
    if np.linalg.norm(T - tangent @ (tangent.T @ T), 2) > np.sin(TURNED):
        return False
    w, n = here.loops.left[:, others], here.loops.right[:, others]
    middle, end = (float(w @ here.twin.jacobian(here.twin.moved(here.q, part * step)) @ n) / kept[others]
                   for part in (0.5, 1.0))
    if not (-NUDGE <= end < 1 and abs(middle - (1 + end) / 2) < EVENLY):
        return False
    if len(ahead) == len(kept) and not _alike(ahead, _values(here, step, len(kept))):
        return False
    return _alike(kept[:others], ahead[:others]) and _alike(kept[:others], _values(here, step, others))


def _same_side(here: ClosedConfiguration, there: ClosedConfiguration) -> bool:
    """Whether the determinant of the loops, in the bases of their range and corange at ``here``, keeps its sign: two
    sheets of the configuration space beside each other have opposite ones (for y (y − d) = 0, ∓d)."""
    across = here.loops.left.T @ there.twin.jacobian(there.q) @ here.loops.right
    return bool(np.linalg.slogdet(across)[0] > 0)


def _values(here: ClosedConfiguration, step: Array, count: int) -> Array:
    """The largest singular values of the loops after a step."""
    return np.asarray(np.linalg.svd(here.twin.jacobian(here.twin.moved(here.q, step)), compute_uv=False)[:count])


def _alike(one: Array, other: Array) -> bool:
    return not np.any((other > CHANGED * one) | (one > CHANGED * other))
