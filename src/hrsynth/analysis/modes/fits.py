"""Which solutions of a square part fit the legs that it leaves out, where more is observed than needed (theory 10).

A solution is *excluded* where the tips of its enclosure are off what a leg can reach, in ball arithmetic. That it is a
mode is proved only of the goal, at which all tips fit by construction: a match in floats proves nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ...geometry.vectors import Array
from ...tolerances import TIP_ROUNDING
from .conics import UNIT, Conic
from .curves import length
from .quadrics import conditions
from .roots import PRECISION
from .systems import System


def rounded(system: System, at: Array) -> float:
    """How far a tip that floats put at ``at`` (3,) can be from that of the exact input at the same pose (m)."""
    return system.error + TIP_ROUNDING * (system.size + length(at))


def off(system: System, k: int, at: Array, shift: float, turn: float) -> float:
    """How far the exact tip of a leg is from ``at`` (3,) at most (m), at a pose enclosed to ``shift`` and ``turn``."""
    return shift + turn * length(system.tips[k]) + rounded(system, at)


def meets(system: System, q: Array, goal: Array, shift: float, turn: float) -> bool:
    """Whether the exact pose about ``q`` can be that about ``goal``: all its tips can."""
    return all(length(one - other) <= off(system, k, one, shift, turn) + rounded(system, other)
               for k, (one, other) in enumerate(zip(system.reached(q), system.reached(goal), strict=True)))


def excluded(system: System, q: Array, shift: float, turn: float) -> bool:
    """Whether no pose within ``shift`` and ``turn`` of q, one of which is exact, fits all legs: a condition on a tip is
    not zero anywhere in the ball that holds it. The worst legs are tried first."""
    from flint import ctx

    at, frame = system.reached(q), system.frame
    numbers = system.balls(frame)
    misses = np.linalg.norm(system.off(at), axis=1)
    with ctx.workprec(PRECISION):
        for k in np.argsort(-misses).tolist():
            radius = off(system, k, at[k], shift, turn)
            if misses[k] <= radius:
                return False
            place = numbers.vector(frame.point(at[k]), radius / frame.size * UNIT)
            tip = Conic(place, place @ place, 1)
            if any(not form.contains(0) for form in conditions(tip, system.curves[k], frame, numbers)):
                return True
    return False


def torn(system: System, places: Mapping[int, tuple[Array, float]]) -> bool:
    """Whether tips of a rigid platform, at ``places`` (3,) known to a distance (m), are farther apart or nearer than
    they are on it: no pose brings them there."""
    from flint import ctx

    frame = system.frame
    numbers = system.balls(frame)
    with ctx.workprec(PRECISION):
        tips = {k: (numbers.vector(frame.point(at), (miss + rounded(system, at)) / frame.size * UNIT),
                    numbers.vector(system.tips[k] / frame.size)) for k, (at, miss) in places.items()}
        arms = [(at - to, b - c) for (at, b), (to, c) in combinations(tips.values(), 2)]
        return any(not (arm @ arm - own @ own).contains(0) for arm, own in arms)


def words(goal: bool, fitting: Sequence[float], out: int, open_: int) -> str:
    """What the legs say of all solutions: whether one is the goal, the residuals of those that fit, how many are
    excluded and how many are not decided."""
    parts = ["one is the goal, at which all legs fit by construction"] if goal else []
    if fitting:
        parts.append(f"{len(fitting)} fit{'s' * (len(fitting) == 1)} all legs to {max(fitting):.1e} of the robot's "
                     "size, which does not prove it")
    parts.append(f"{out} excluded by the legs in interval arithmetic" if out else "none excluded")
    if open_:
        parts.append(f"{open_} neither excluded nor found to fit")
    return ", ".join(parts)
