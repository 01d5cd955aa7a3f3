"""All critical points of the error in a box of platform poses, by subdivision (docs/pages/endings.md).

What is left open along the limits of legs is looked at again in coordinates of those legs (:mod:`.leg_chart`), in which
E is smooth there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ...analysis.observed import ObservedRobot
from ...budgets import COVER_BOXES
from ...closed_forms.legs import OnCrank, OnRail, OnRod, SlidingRod
from ...geometry.so3 import exponential
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...results import Value
from ...tolerances import COVER_REACH, MET_AGAIN, SAME_ENDING, SMALLEST_BOX
from .leg_chart import leg_charts
from .pose_error import NotEnclosed, PoseError
from .subdivision import CriticalBox, PoseBoxes, Subdivision

Modes = tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Cover(Value):
    """What subdivision says of a box of platform poses: all critical points of E in it, in some working modes, but for
    ``open`` boxes (middle, half, in coordinates), which are a ``share`` of the whole. ``bounded``: whether the legs
    cannot reach beyond the box; ``unwatched``: legs whose own limits are not looked at."""

    found: tuple[CriticalBox, ...]
    modes: tuple[Modes, ...]
    open: tuple[tuple[Array, Array], ...]
    share: float
    boxes: int
    bounded: bool
    unwatched: tuple[str, ...]
    reason: str = ""
    box: tuple[Array, Array] | None = None
    """Where it was looked: the lower and the upper corner, in coordinates about the goal."""
    error: PoseError | None = None

    @property
    def complete(self) -> bool:
        """Whether these are all critical points in the box, in these working modes."""
        return not self.open and not self.reason and not self.unwatched

    def holds(self, at: ClosedConfiguration) -> bool:
        """Whether the box holds a configuration's pose."""
        if self.box is None or self.error is None or self.error.coordinates is None:
            return False
        (p,), k = self.error.coordinates.of([at])[0], self.error.shifts.shape[1]
        x = self.error.shifts.T @ (p - self.error.p)
        return bool(np.all(self.box[0][:k] <= x) and np.all(x <= self.box[1][:k]))

    def place(self, at: ClosedConfiguration, u: Array) -> int | None:
        """Which of the critical points a configuration with observed directions u (legs, 3) is at."""
        if self.error is None or self.error.coordinates is None or not self.found:
            return None
        p, R = (each[0] for each in self.error.coordinates.of([at]))
        if not self.error.coordinates.turning:
            R = self.error.R
        away = [max(np.abs(each.p / self.error.length - p).max(), np.abs(each.R - R).max(),
                    np.abs(each.directions - u).max()) for each in self.found]
        nearest = int(np.argmin(away))
        return nearest if away[nearest] < SAME_ENDING else None


def cover(setting: ObservedRobot, goal: ClosedConfiguration, *, every_mode: bool = False, vanishing: bool = False,
          budget: int = COVER_BOXES, reach: float = COVER_REACH) -> Cover:
    """All critical points of the error to a goal that subdivision finds and proves: in the goal's working mode, or in
    every one; where legs are not limited, in a box that is ``reach`` characteristic lengths wide either way.
    ``vanishing``: those alone at which the error vanishes."""
    try:
        error = PoseError.of(setting, goal)
        if error.fitted:
            raise NotEnclosed(f"forms are fitted to samples: {', '.join(error.fitted)}")
        if error.turns.shape[1] > 1:
            raise NotEnclosed("the platform turns about more than one axis")
    except NotEnclosed as why:
        return Cover((), (), (), 1.0, 0, False, (), str(why))
    return _Covering(error, *bounds(error, reach), every_mode, vanishing, budget).answer()


class _Covering:
    """One question of :func:`cover`, in the charts of the platform's turn and in all working modes."""

    def __init__(self, error: PoseError, low: Array, high: Array, bounded: bool, every_mode: bool, vanishing: bool,
                 budget: int) -> None:
        self.error, self.low, self.high, self.bounded = error, low, high, bounded
        self.every_mode, self.vanishing, self.budget = every_mode, vanishing, budget
        self.seen = {each.limb for each in error.seen}
        own = tuple(limb.mode for limb in error.limbs)
        choices = [(mode, -mode) if every_mode and i in self.seen and isinstance(limb, OnRod) else (mode,)
                   for i, (limb, mode) in enumerate(zip(error.limbs, own, strict=True))]
        self.modes: tuple[Modes, ...] = tuple(product(*choices))
        self.found: list[CriticalBox] = []
        self.boxes = 0

    def answer(self) -> Cover:
        """All charts of the pose, then those of legs for what is left open there."""
        charts, volume, left = _charts(self.error), 0.0, list[tuple[Array, Array]]()
        for place, R in enumerate(charts):
            open_: dict[Modes, PoseBoxes] = {}
            exhausted = False
            for modes in self.modes:
                part = Subdivision.of(self.error.elsewhere(self.error.p, R, modes), self.low, self.high, self.vanishing)
                exhausted |= not self._run(part, (place,), self.budget // len(self.modes))
                open_[modes] = part.left_poses()
            if self.every_mode and not exhausted:
                for limb in range(len(self.error.limbs)):
                    open_ = self._at_limits(limb, (place, R), open_)
            for boxes in open_.values():
                left += zip(boxes.middle, boxes.half, strict=True)
                volume += float(np.prod(2 * boxes.half / (self.high - self.low), axis=1).sum())
        share = volume / (len(self.modes) * len(charts))
        self._mirror()
        unwatched = tuple(limb.label for i, limb in enumerate(self.error.limbs)
                          if i not in self.seen and isinstance(limb, OnRod) and not self.vanishing)
        return Cover(tuple(self.found), self.modes, tuple(left), share, self.boxes,
                     self.bounded, unwatched, "", (self.low, self.high), self.error)

    def _mirror(self) -> None:
        """A rod that slides through a base point has its direction either way at a pose, and E is the same: the found
        critical points with all choices of that."""
        error = self.error
        both = [(k, each.limb) for k, each in enumerate(error.seen) if each.limb is not None
                and isinstance(leg := error.limbs[each.limb], SlidingRod) and (leg.axis is None or leg.aside == 0)]
        if not self.every_mode or not both:
            return
        found, modes = self.found, self.modes
        self.found, self.modes = [], ()
        for signs in product((1.0, -1.0), repeat=len(both)):
            change = np.ones(len(error.limbs))
            turned = np.ones((len(error.seen), 1))
            for (k, limb), sign in zip(both, signs, strict=True):
                change[limb], turned[k] = sign, sign
            self.modes += tuple(tuple((np.array(each) * change).tolist()) for each in modes)
            self.found += [replace(each, modes=tuple((np.array(each.modes) * change).tolist()),
                                   directions=each.directions * turned) for each in found]

    def _run(self, part: Subdivision, chart: tuple[int, ...], budget: int) -> bool:
        """Whether the budget was enough; what is found is kept."""
        part.run(budget)
        self.boxes += part.boxes
        for each in (replace(zero, chart=chart) for zero in part.zeros()):
            if each.modes in self.modes and not any(_same(each, other, self.error.length) for other in self.found):
                self.found.append(each)
        return part.boxes < budget

    def _at_limits(self, number: int, turn: tuple[int, Array], open_: dict[Modes, PoseBoxes]) -> dict[Modes, PoseBoxes]:
        """What of the open boxes of poses is open in a limb's coordinates too."""
        limb = self.error.limbs[number]
        count = sum(len(each.middle) for each in open_.values())
        if not count or number not in self.seen or not isinstance(limb, OnRod):
            return open_
        tip = self.error.p + limb.tip.constant + self.error.R @ limb.tip.turned
        carried = np.array(limb.at(tip, lambda value: value, limb.mode)[1], dtype=float)
        room = 2 * (limb.rod + float(np.linalg.norm(self.high - self.low)) + float(np.linalg.norm(limb.tip.turned)))
        charts = list(leg_charts(number, limb, self.error.shifts, carried, tip, room))
        if not charts:
            return open_
        k, kept = self.error.shifts.shape[1], dict[Modes, PoseBoxes]()
        for own in {modes[:number] + modes[number + 1 :] for modes in self.modes}:
            both = [modes for modes in self.modes if modes[:number] + modes[number + 1 :] == own]
            asked = PoseBoxes(*(np.concatenate([getattr(open_[modes], name) for modes in both])
                                for name in ("middle", "half")))
            still = [np.zeros((0, self.error.size))] * 2
            for i, (chart, half) in enumerate(charts if len(asked.middle) else []):
                error = replace(self.error.elsewhere(self.error.p, turn[1], both[0]), held=chart)
                part = Subdivision.of(error, np.concatenate([-half, self.low[k:]]),
                                      np.concatenate([half, self.high[k:]]), within=asked)
                self._run(part, (turn[0], number, i), self.budget)
                rest = part.left_poses()
                still = [np.concatenate(pair) for pair in zip(still, (rest.middle, rest.half), strict=True)]
            for modes in both:
                kept[modes] = open_[modes].some(open_[modes].meet(PoseBoxes(*still)))
        return kept


def _charts(error: PoseError) -> list[Array]:
    """Rotations from which a quarter of a turn either way reaches all."""
    if not error.turns.shape[1]:
        return [error.R]
    return [error.R, exponential(np.pi * error.turns[:, 0]) @ error.R]


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


def _same(one: CriticalBox, other: CriticalBox, length: float) -> bool:
    """Whether two enclosed zeros are one: the first lies where the second is the only one; of two charts, they are so
    near that they lie in both such boxes."""
    if one.modes != other.modes:
        return False
    if one.chart == other.chart:
        return bool(np.all(np.abs(one.x - other.x) + one.radius < other.half))
    away = (np.linalg.norm(one.p - other.p) / length, np.abs(one.R - other.R).max(),
            np.abs(one.directions - other.directions).max())
    return bool(max(away) < MET_AGAIN)
