"""Ends of the proof of a branch: toggles (in floating point), and full turns that do or do not close."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...equations.loop_parts import LoopPart
from ...geometry.vectors import Array
from ...tolerances import AFFINE_ROUNDING
from .answer import Toggle
from .cells import BranchTube, prove_all
from .growth import BranchEnd, Growth

TOGGLE_SINGULAR_VALUE_FRACTION = 0.03
"""Fraction of its value at zero at which the loops' smallest singular value ends a path at a toggle."""
TOGGLE_RATE_MIN_FRACTION = 0.05
"""Fraction of the largest rate at a toggle from which a joint counts as moving."""

TOGGLE_BISECTIONS_COUNT = 40
"""Number of bisections of the path to a toggle."""
TOGGLE_SEARCH_RANGE_FRACTION = 20.0
"""Search range of a toggle from the start of a cell, as a multiple of the distance to its middle."""
TOGGLE_SEARCH_ENDS_COUNT = 4
"""Ends of the proof that are looked into, those of the largest cells first, for each set of joints."""


def find_toggles(growth: Growth) -> tuple[Toggle, ...]:
    """The ends of a proof, one for each set of joints that can move there."""
    ends = sorted(growth.endings, key=lambda end: -end.leaf.volume)
    some = ends[:: max(1, len(ends) // (TOGGLE_SEARCH_ENDS_COUNT * len(growth.q0) * 2))]
    found: dict[tuple[str, ...], Toggle] = {}
    for toggle in _search_toggles(growth, some) if some else ():
        found.setdefault(toggle.joints, toggle)
    return tuple(found.values())


def _search_toggles(growth: Growth, ends: Sequence[BranchEnd]) -> Iterator[Toggle]:
    """Go from where cells were started through their middles and on, all together; where that ends, a loop toggles."""
    part, core = growth.part, growth.part.core
    unit = part.system.units[list(part.driven)]
    start, x0 = np.array([end.q for end in ends]), np.array([end.x for end in ends])
    if x0.shape[1] > len(core.unknowns):
        x0 = x0[:, core.places_in(part)]
    middle = np.array([(growth.grid.point(end.leaf.low) + growth.grid.point(end.leaf.high)) / 2 for end in ends])
    goal = np.clip(start + TOGGLE_SEARCH_RANGE_FRACTION * (middle - start), growth.grid.low, growth.grid.high)
    home = np.linalg.svd(part.closure(growth.q0, growth.x0)[1], compute_uv=False)[-1]
    q_, x_, parts = _follow_ways(core, start, x0, goal)
    for end, q, x, last in zip(ends, q_, growth.complete(q_, x_), parts, strict=True):
        _, strengths, rows = np.linalg.svd(part.closure(q, x)[1])
        if last == 1.0 or strengths[-1] / max(home, 1e-300) > TOGGLE_SINGULAR_VALUE_FRACTION:
            why = (
                "not tried: the limit of cells or of time was reached (use a smaller --box, or raise the limit)"
                if not end.leaf.failed
                else "undecided: smaller cells are needed"
            )
            yield Toggle(q * unit, (), (), why)
            continue
        moving = np.abs(rows[-1]) > TOGGLE_RATE_MIN_FRACTION * np.abs(rows[-1]).max()
        places = [i for i, moves in zip(part.unknowns, moving, strict=True) if moves]
        joints = tuple(dict.fromkeys(part.system.coordinates[i].joint for i in places))
        loops = tuple(loop.name for loop in part.loops if set(places).intersection(loop.coordinates))
        yield Toggle(
            q * unit, joints, loops, "a determinant vanishes: these joints can move while all motors are fixed"
        )


def _follow_ways(part: LoopPart, q: Array, x: Array, goal: Array) -> tuple[Array, Array, Array]:
    """The last closed configurations (c, n), (c, p) on the straight ways to ``goal`` that short steps reach, and their
    parts (c,) of the ways."""
    x, done, step = x.copy(), np.zeros(len(q)), np.full(len(q), 0.25)
    for _ in range(TOGGLE_BISECTIONS_COUNT):
        on = np.flatnonzero(done < 1.0)
        if not len(on):
            break
        ahead = np.minimum(1.0, done[on] + step[on])
        here, next_ = (q[on] + (goal - q)[on] * part_of[:, None] for part_of in (done[on], ahead))
        there, good = part.follow(here, x[on], next_)
        # the closure that follows must be the near one: back again must be where it came from
        back, same = part.follow(next_, there, here)
        near = np.abs(back - x[on]).max(axis=-1, initial=0.0) < AFFINE_ROUNDING**0.5
        reached = np.logical_and.reduce((good, same, near))
        done[on[reached]], x[on[reached]] = ahead[reached], there[reached]
        step[on[~reached]] /= 2
    return q + (goal - q) * done[:, None], x, done


def list_full_turns(growth: Growth) -> tuple[tuple[str, bool], ...]:
    """For each motor with a full turn whose first and last face are proved throughout: True if the closures there
    agree, angles modulo 2π; not listed if neither is proved."""
    part, found = growth.part, []
    for k, i in enumerate(part.driven):
        whole = abs(growth.grid.high[k] - growth.grid.low[k] - 2 * np.pi) < AFFINE_ROUNDING
        if part.system.coordinates[i].slides or not whole:
            continue
        first = [leaf for leaf in growth.proved if leaf.low[k] == 0]
        last = [leaf for leaf in growth.proved if leaf.high[k] == growth.whole]
        same = [
            _check_tubes_meet(growth, k, one.tube, other.tube, face)
            for one in last
            for other in first
            for face in growth.opposite(k, one, other)
            if one.tube is not None and other.tube is not None
        ]
        filled = growth.is_face_covered(k, first) and growth.is_face_covered(k, last)
        if same and filled and (False in same or all(same)):
            found.append((part.system.names[i], False not in same))
    return tuple(found)


def _check_tubes_meet(growth: Growth, k: int, one: BranchTube, other: BranchTube, face: Array) -> bool | None:
    """Return True if the closure of one tube at a point of the last face lies in another tube, a full turn before; None
    if neither is proved."""
    part = growth.part
    x, good = part.close(face[None], one.at(face)[None])
    (point,) = prove_all(part, face[None], np.zeros((1, len(face))), x) if good[0] else (None,)
    if point is None or np.any(np.abs(point.x - one.at(face)) + point.radius >= one.radius):
        return None
    before = face.copy()
    before[k] = growth.grid.low[k]
    own = [part.system.coordinates[i] for i in part.unknowns]
    angles = np.array([not each.slides for each in own])
    off = point.x - other.at(before)
    off = np.abs(off - np.where(angles, 2 * np.pi * np.round(off / (2 * np.pi)), 0.0))
    doubt = point.radius + AFFINE_ROUNDING * 100
    if np.all(off + doubt < other.radius):
        return True
    # three turns one after the other may be the same orientation with other angles
    alone = np.array(
        [sum(each.joint == mate.joint and not mate.slides for mate in part.system.coordinates) < 3 for each in own]
    )
    return False if np.any((off - doubt > other.radius) & alone) else None
