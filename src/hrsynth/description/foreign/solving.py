"""From the pose a file gives to one with closed loops, away from singular poses: random pushes where it stalls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...tolerances import FIRM, NEARLY_SINGULAR, NOISE, RANK_GAP, SOLVED
from .assembly import Assembly, State

BETTER = 2.0
"""Factor by which another pose must be firmer to take the place of a nearly singular one."""
TRIES = 24
"""Random pushes and steps before the best found has to do."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A closed state, what is left open in it, and whether a random push was needed to get there."""

    state: State
    residual: float
    pushed: bool = False


def solve(assembly: Assembly, seed: int = 0, tries: int = TRIES) -> Solution:
    """Close all loops from zero; where that stalls (flat and collinear poses), from randomly pushed states too."""
    state, residual = assembly.closed(assembly.zero())
    best = Solution(state, residual)
    rng = np.random.default_rng(seed)
    for number in range(tries):
        if best.residual <= NOISE:
            break
        amplitude = (0.1, 0.3, 0.6, 1.0)[min(3, number // 6)]
        start = assembly.stepped(assembly.zero(), amplitude * rng.normal(size=assembly.size))
        state, residual = assembly.closed(start)
        if residual < best.residual:
            best = Solution(state, residual, True)
    return best


def unlocked(assembly: Assembly, state: State, seed: int = 0) -> State | None:
    """A closed state near ``state`` with fewer freedoms, or with loops that resist much more firmly, where ``state`` is
    singular or nearly so; None where it is neither, or nothing better is found."""
    here = assembly.freedom(state)
    if here.value == 0:
        return None
    rng = np.random.default_rng(seed)
    best, found, origin = replace(here, weakest=BETTER * here.weakest), None, state
    for number in range(TRIES):
        if found is not None and best.weakest > FIRM:
            break
        if number >= 3 and found is None and here.weakest > NEARLY_SINGULAR:
            break
        kernel = assembly.kernel(origin)
        step = kernel @ rng.normal(size=kernel.shape[1])
        step *= (0.3, 0.15, 0.5)[number % 3] / float(np.max(np.abs(step), initial=1e-12))
        there, residual = assembly.closed(assembly.stepped(origin, step))
        freedom = assembly.freedom(there)
        if residual > 10 * SOLVED or freedom.gap < RANK_GAP:
            continue
        firmer = freedom.weakest > best.weakest and (found is not None or here.weakest <= NEARLY_SINGULAR)
        if freedom.value < best.value or (freedom.value == best.value and firmer):
            best, found, origin = freedom, there, there
    return found
