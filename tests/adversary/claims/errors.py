"""Error bounds: the largest error over all errors of the directions inside their cones, sought again."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, UNCLEAR, WRONG, Case
from adversary.claims.first_order import inverse_law
from adversary.robot import Array

PSI = 2e-3
CLOSE, MEANT = 1e-6, 1e-7
"""How near, as a part of the bound, errors must come; geometry that is special but for so much is taken for special."""


def errors(case: Case) -> None:
    """``accuracy`` at zero and at a pose near it."""
    import hrsynth

    seen = case.asked("error bound", lambda: hrsynth.accuracy(case.engine, case.observe(), cone=PSI))
    if seen is not None:
        judge(case, seen)


def judge(case: Case, told: Any) -> None:
    """Hold the bounds at the zero configuration against errors that are sought."""
    items = case.directions(told.setup.observed)
    J = None if items is None else inverse_law(case, items, case.robot.zero())
    if J is None or items is None:
        case.say("error bound", UNCLEAR, "the directions do not show the platform clearly at zero")
        return
    u = case.robot.items(items, case.robot.frames(case.robot.zero()))[0][0]
    P = np.eye(3) - u[:, :, None] * u[:, None]
    there = told.poses[0]
    for name, part, extent in (("position", J[:3], there.position), ("orientation", J[3:], there.orientation)):
        if not len(part):
            continue
        A = np.einsum("aki,kij->kaj", part.reshape(3, -1, 3), P) * told.cones[:, None, None]
        own = largest(A, case.rng)
        near = CLOSE * (extent.largest + 1e-6 * PSI) + MEANT * PSI * float(np.abs(J).max())
        over = own > extent.largest + near
        # of one cone and two the maxima are exact, else the gap says how far the bound may be above
        under = own < extent.largest * (1 - extent.gap) - near
        under |= len(u) <= 2 and own < extent.largest - near
        case.say(
            "error bound",
            WRONG if over or under else HELD,
            f"{name}: {extent.largest!r} told (gap {extent.gap:.1e}), {own!r} found" if over or under else "",
        )


def largest(A: Array, rng: np.random.Generator) -> float:
    """max Σ ‖A_kᵀ w‖ over unit w, A (k, 3, 3): many directions, then ascent from the best (a convex function)."""
    w = rng.normal(size=(3, 600))
    w /= np.linalg.norm(w, axis=0)
    for _ in range(300):
        pulls = np.einsum("kij,in->kjn", A, w)
        sizes = np.linalg.norm(pulls, axis=1)
        step = np.einsum("kij,kjn->in", A, pulls / np.maximum(sizes, 1e-300)[:, None])
        length = np.linalg.norm(step, axis=0)
        w = np.where(length > 0, step / np.maximum(length, 1e-300), w)
    return float(np.max(np.linalg.norm(np.einsum("kij,in->kjn", A, w), axis=1).sum(axis=0)))
