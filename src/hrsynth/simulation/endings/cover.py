"""All critical points of the error in a box of platform poses, or at all poses, by subdivision
(docs/pages/endings.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...analysis.observed import ObservedRobot
from ...budgets import COVER_BOXES
from ...closed_forms.legs import ClosedFormLeg, OnCrank, OnRail, SlidingRod
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...results import Value
from ...tolerances import COVER_REACH, FOLLOWED, SAME_ENDING, SHORTEST_ROD, SMALLEST_BOX
from .joint_error import JointError
from .pose_error import NotEnclosed, PoseError
from .subdivision import CriticalBox, Subdivision


@dataclass(frozen=True, eq=False, repr=False)
class Cover(Value):
    """What subdivision says of platform poses: all critical points of E there, in all working modes of the legs, but
    for ``open`` boxes (lower, upper corner, in coordinates about the goal), which are a ``share``. ``bounded``: whether
    the legs cannot reach beyond the box, or poses however far away were looked at too."""

    found: tuple[CriticalBox, ...]
    open: tuple[tuple[Array, Array], ...]
    share: float
    boxes: int
    bounded: bool
    reason: str = ""
    box: tuple[Array, Array] | None = None
    """Where it was looked: the lower and the upper corner, in coordinates about the goal; None: everywhere."""
    error: PoseError | None = None
    short: tuple[ClosedFormLeg, ...] = ()
    """Rods that slide and turn as they like: where one is shorter than ``SHORTEST_ROD`` it was not looked."""

    @property
    def complete(self) -> bool:
        """Whether these are all critical points there."""
        return not self.open and not self.reason

    def holds(self, at: ClosedConfiguration) -> bool:
        """Whether a configuration's pose was looked at: not where a platform that only translates is turned otherwise
        than at the goal, as it can be in another assembly."""
        if self.error is None or self.error.coordinates is None or self.turned(at):
            return False
        (p, R), k = (each[0] for each in self.error.coordinates.of([at])), self.error.shifts.shape[1]
        if any(limb.solve(limb.tip.value(p[None], R[None]), limb.mode)[0] < SHORTEST_ROD**2 for limb in self.short):
            return False
        if self.box is None:
            return True
        x = self.error.shifts.T @ (p - self.error.p)
        return bool(np.all(self.box[0][:k] <= x) and np.all(x <= self.box[1][:k]))

    def turned(self, at: ClosedConfiguration) -> bool:
        """Whether a platform that only translates is turned otherwise than at the goal."""
        error = self.error
        if error is None or error.coordinates is None or error.motion.rotations.shape[1]:
            return False
        return bool(np.abs(error.coordinates.of([at])[1][0] - error.R).max() > SAME_ENDING)

    def place(self, at: ClosedConfiguration, u: Array) -> int | None:
        """Which of the critical points a configuration with observed directions u (legs, 3) is at."""
        if self.error is None or self.error.coordinates is None or not self.found:
            return None
        p, R = (each[0] for each in self.error.coordinates.of([at]))
        if not self.error.coordinates.turning:
            R = self.error.R
        if self.turned(at):
            return None
        away = [max(np.abs(each.p / self.error.length - p).max(), np.abs(each.R - R).max(),
                    np.abs(each.directions - u).max()) for each in self.found]
        nearest = int(np.argmin(away))
        return nearest if away[nearest] < SAME_ENDING else None


def cover(setting: ObservedRobot, goal: ClosedConfiguration, *, vanishing: bool = False, budget: int = COVER_BOXES,
          reach: float = COVER_REACH) -> Cover:
    """All critical points of the error to a goal that subdivision finds and proves, in every working mode: wherever
    legs reach, however far away where all rods slide in a plane, otherwise in a box that is ``reach`` characteristic
    lengths wide either way. ``vanishing``: those alone at which the error vanishes."""
    try:
        error = PoseError.of(setting, goal)
        if error.fitted:
            raise NotEnclosed(f"forms are fitted to samples: {', '.join(error.fitted)}")
        if error.turns.shape[1] > 1:
            raise NotEnclosed("the platform turns about more than one axis")
    except NotEnclosed as why:
        return Cover((), (), 1.0, 0, False, str(why))
    (low, high, bounded), whole = bounds(error, reach), JointError.of(error)
    charts = (whole,) if bounded else whole.charts
    parts = [Subdivision(each, *each.box(low, high, reach), vanishing) for each in charts]
    found: list[CriticalBox] = []
    for part in parts:
        part.run(budget // len(parts))
        for zero in part.zeros():
            if not any(_same(zero, other, part.error) for other in found):
                found.append(zero)
    if vanishing:
        found = [each for each in found if each.error[0] == 0.0]
    left: list[tuple[Array, Array]] = []
    for part in (each for each in parts if each.left):
        corners = part.error.spanned(*map(np.array, zip(*part.left, strict=True)))
        left += zip(*(each[:, : error.size] for each in corners), strict=True)
    found = [replace(each, directions=each.directions * own) for own in error.mirrors for each in found]
    return Cover(tuple(found), tuple(left), sum(each.share for each in parts) / len(parts),
                 sum(each.boxes for each in parts), bounded or len(charts) > 1, "",
                 (low, high) if len(charts) == 1 else None, error,
                 tuple(each for i, each in enumerate(error.limbs)
                       if i not in whole.joints and isinstance(each, SlidingRod)))


def bounds(error: PoseError, reach: float) -> tuple[Array, Array, bool]:
    """The box of coordinates that the legs can reach, and whether it is all of it: a rod's tip is no farther from its
    crank's centre or its rail than its length and the crank's."""
    from scipy.optimize import linprog

    k = error.shifts.shape[1]
    rows, limits = [], []
    for limb in error.limbs:
        if not isinstance(limb, OnCrank | OnRail):
            continue
        away = limb.rod + (limb.radius if isinstance(limb, OnCrank) else 0.0) + float(np.linalg.norm(limb.tip.turned))
        ways = np.eye(3) if isinstance(limb, OnCrank) else np.linalg.svd(limb.axis[None])[2][1:]
        offset = error.p + limb.tip.constant - limb.centre
        for way in (*ways, *-ways):
            rows.append(way @ error.shifts)
            limits.append(away - way @ offset)
    bounds, bounded = [], True
    for axis in np.eye(k):
        for sign in (1.0, -1.0):
            found = linprog(sign * axis, A_ub=np.array(rows), b_ub=limits, bounds=(None, None)) if rows else None
            reached = found is not None and found.status == 0
            bounded &= reached
            bounds.append(sign * found.fun - sign * SMALLEST_BOX if found is not None and reached else -sign * reach)
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    turns = np.ones(error.turns.shape[1])
    return np.concatenate([low, -turns]), np.concatenate([high, turns]), bounded


def _same(one: CriticalBox, other: CriticalBox, error: JointError) -> bool:
    """Whether two enclosed zeros are at one pose with the same directions: enclosures of what is watched meet."""
    watched = {each.limb for each in error.error.seen}
    own = [*range(error.error.size), *(k for k, i in enumerate(error.joints, error.error.size) if i in watched)]
    away, periods = np.abs(one.x - other.x)[own], error.periods[own]
    turns = np.isfinite(periods)
    away[turns] %= periods[turns]
    away[turns] = np.minimum(away[turns], periods[turns] - away[turns])
    return bool(np.all(away <= (one.radius + other.radius)[own] + FOLLOWED))
