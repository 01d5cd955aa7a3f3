"""All critical points of the error in a box of platform poses, or at all poses, by subdivision
(docs/pages/proofs.md)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from typing import Annotated

import numpy as np

from ...analysis.observed import ObservedRobot
from ...closed_forms.legs import ClosedFormLeg
from ...geometry.so3 import turn_about
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism import JointType
from ...records import Recorded
from ...results import Value
from ...tolerances import (
    CRITICAL_POINT_DISTANCE_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    SINGULAR_BOX_MIN_FRACTION,
    SINGULAR_FINER,
    SLIDING_ROD_LENGTH_MIN,
    SUBDIVISION_BOXES_MAX,
)
from .joint_error import JointError
from .loop_error import ForceError, LoopError, LoopSubdivision
from .points_in_planes_error import PlaneError
from .pose_error import EnclosureFailure, PoseError
from .spring_error import SpringError, SpringSubdivision
from .subdivision import CriticalBox, Subdivision
from .upu_legs import Struts

POSITION_BOX_HALF_WIDTH_FRACTION = 1.0
"""Half-width (characteristic lengths) of the box of platform positions if legs give none."""
POSITION_BOX_FRACTION = 1.25
"""Extent of the boxes of positions as a multiple of the farthest base point."""
LINEAR_PROGRAM_BOX_TOL = 1e-6
"""Margin of linear-program bounds of boxes (characteristic lengths); the programs are solved to 1e-7."""
LOCKED_PLACE_EDGE_FRACTION = 0.01
"""Longest edge of a cluster of such boxes, as a fraction of the whole, that is reported as one place."""


@dataclass(frozen=True, eq=False, repr=False)
class SubdivisionResult(Value):
    """Result of the subdivision of platform poses: all critical points of E there, in all working modes of the legs,
    except in ``open`` boxes (lower, upper corner, in coordinates about the goal), which are a fraction ``share``.
    ``bounded``: the legs cannot reach beyond the box, or arbitrarily distant poses were searched too."""

    found: tuple[CriticalBox, ...]
    open: tuple[tuple[Array, Array], ...]
    share: Annotated[float, "fraction of the space in undecided boxes"]
    boxes: Recorded[int]
    bounded: bool
    reason: str = ""
    box: tuple[Array, Array] | None = None
    """Searched box: lower and upper corner, in coordinates about the goal; None: all poses."""
    error: PoseError | None = None
    short: tuple[ClosedFormLeg, ...] = ()
    """Freely rotating sliding rods; poses at which one is shorter than ``SLIDING_ROD_LENGTH_MIN`` were not searched."""
    struts: Struts | None = None
    """Legs of a platform that translates, whose joints' own singularities and all whose rotations were searched."""
    locked: tuple[tuple[Array, Array], ...] = ()
    """Places (centre and half edges, in coordinates about the goal) at which equations of the legs may be dependent, so
    that legs lock each other; they were not searched."""
    unread: Annotated[tuple[str, ...], "legs at whose locked joints nothing was searched"] = ()
    """Spatial legs with joints whose locked poses are unknown; these were not searched."""

    loop: ForceError | None = None
    """Observed legs, if equilibria were sought by the forces of two or three. Not searched: poses at which an
    unobserved leg is stretched, or at which at least ``flat`` observed directions are at right angles to the desired
    ones."""
    spent: bool = False
    """Flag: boxes are undecided because the limit was reached."""

    @property
    def is_complete(self) -> bool:
        """Return True if these are all critical points there."""
        return not self.open and not self.reason

    def has_searched(self, at: ClosedConfiguration) -> bool:
        """Return True if a configuration's pose was searched: not if a platform that only translates has a rotation
        that is none of the ``turns``, as it can in another assembly."""
        if self.error is None or self.error.coordinates is None or self.is_turned(at):
            return False
        (p, R), k = (each[0] for each in self.error.coordinates.of([at])), self.error.shifts.shape[1]
        if any(
            limb.solve(limb.tip.value(p[None], R[None]), limb.mode)[0] < SLIDING_ROD_LENGTH_MIN**2
            for limb in self.short
        ):
            return False
        idle = () if self.loop is None else self.loop.idle
        with np.errstate(invalid="ignore"):
            margins = [limb.solve(limb.tip.value(p[None], R[None]), limb.mode)[0][0] for limb in idle]
        if any(abs(margin) < CRITICAL_POINT_DISTANCE_TOL for margin in margins):
            return False
        x = self.error.shifts.T @ (p - self.error.p)
        if self.error.turns.shape[1] == 1:
            x = np.append(x, turn_about(self.error.turns[:, 0], R @ self.error.R.T)[0])
        periods = np.where(np.arange(len(x)) < k, np.inf, 2 * np.pi)
        if any(
            np.all(_away(x, middle[: len(x)], periods) <= half[: len(x)] + HIDDEN_ROBOT_RESIDUAL_TOL)
            for middle, half in self.locked
        ):
            return False
        if self.box is None:
            return True
        return bool(np.all(self.box[0][:k] <= x[:k]) and np.all(x[:k] <= self.box[1][:k]))

    @property
    def turns(self) -> tuple[Array, ...]:
        """Rotations from the goal's at which a platform that only translates was looked at."""
        return (np.eye(3),) if self.struts is None else self.struts.turns

    def is_turned(self, at: ClosedConfiguration) -> bool:
        """Return True if a platform that only translates has another rotation than was searched."""
        error = self.error
        if error is None or error.coordinates is None or error.motion.rotations.shape[1]:
            return False
        R = error.coordinates.of([at])[1][0]
        return all(np.abs(R - turn @ error.R).max() > CRITICAL_POINT_DISTANCE_TOL for turn in self.turns)

    def place(self, at: ClosedConfiguration, u: Array) -> int | None:
        """Return the index of the critical point of a configuration with observed directions u (legs, 3); distant poses
        are compared by directions."""
        if self.error is None or self.error.coordinates is None or not self.found or self.is_turned(at):
            return None
        p, R = (each[0] for each in self.error.coordinates.of([at]))
        far = max(1.0, float(np.abs(p).max()))
        away = [
            max(
                np.abs(each.p / self.error.length - p).max() / far,
                np.abs(each.R - R).max(),
                np.abs(each.directions - u).max(),
            )
            for each in self.found
        ]
        nearest = int(np.argmin(away))
        return nearest if away[nearest] < CRITICAL_POINT_DISTANCE_TOL else None


def cover(
    setup: ObservedRobot,
    goal: ClosedConfiguration,
    *,
    vanishing: bool = False,
    budget: int = SUBDIVISION_BOXES_MAX,
    reach: float = POSITION_BOX_HALF_WIDTH_FRACTION,
    jobs: int = 1,
) -> SubdivisionResult:
    """All critical points of the error to a goal that subdivision finds and proves, in every working mode: wherever
    legs reach, however far away where all rods slide in a plane, otherwise in a box that is ``reach`` characteristic
    lengths wide either way. ``vanishing``: those alone at which the error vanishes. Many boxes are shared by so many
    processes (``jobs``)."""
    try:
        error, families, struts = _families(setup, goal, vanishing)
    except EnclosureFailure as why:
        return SubdivisionResult((), (), 1.0, 0, False, str(why))
    low, high, bounded = reachable_box(error, reach)
    charts, endless = [each.list_charts(bounded) for each in families], len(families[0].charts) > 1
    loop = next((each for each in families if isinstance(each, ForceError)), None)
    parts = [
        [_boxes(each, low, high, reach, vanishing or loop not in (None, each)) for each in some] for some in charts
    ]
    every = [part for some in parts for part in some]
    # the small ones first: what they do not use is left for the others
    for k, part in enumerate(reversed(every)):
        part.run((budget - sum(each.boxes for each in every)) // (len(every) - k), k, len(every), jobs)
    _cut_long(every, (high - low)[: error.size], budget, jobs)
    found: list[CriticalBox] = []
    for family, some in zip(families, parts, strict=True):
        own: list[CriticalBox] = []
        for zero in (
            zero
            for each in some
            for zero in each.zeros()
            if zero.error[0] == 0.0 or not each.vanishing or family.square is not None
        ):
            if not any(_is_same_zero(zero, other, family) for other in own):
                own.append(zero)
        own = [_on_line(each, family.error, error) if len(each.x) < error.size else each for each in own]
        found += [
            each
            for each in own
            if not isinstance(loop, LoopError) or not any(_is_same_rod_zero(each, other, loop) for other in found)
        ]
    left, lost = (
        [corners for part in every for corners in _corners(part.error, boxes(part), error.size)]
        for boxes in (lambda part: part.left, lambda part: part.lost)
    )
    locked, left = _places(join_boxes(lost), left, (high - low)[: error.size])
    meeting = [
        each
        for each in found
        if each.error[0] > 0
        and sum(isinstance(family, PlaneError) and family.has_rotation(each.R) for family in families) > 1
    ]
    near = SINGULAR_BOX_MIN_FRACTION * (high - low)[: error.size]
    locked += [(each.x[: error.size], np.maximum(each.radius[: error.size], near)) for each in meeting]
    found = [each for each in found if each not in meeting]
    found = [replace(each, directions=each.directions * own) for own in error.mirrors for each in found]
    free = [each for i, each in enumerate(error.limbs) if i not in families[0].joints]
    return SubdivisionResult(
        tuple(found),
        tuple(left),
        sum(each.share for each in every) / len(every),
        sum(each.boxes for each in every),
        bounded or endless,
        "",
        None if endless and not bounded else (low, high),
        error,
        () if isinstance(loop, SpringError) or any(each.short for each in charts[0]) else tuple(free),
        struts,
        tuple(locked),
        () if struts is not None else legs_that_may_lock(setup),
        loop,
        any(each.spent for each in every),
    )


def _families(
    setup: ObservedRobot, goal: ClosedConfiguration, vanishing: bool
) -> tuple[PoseError, list[JointError], Struts | None]:
    """The error, and all that boxes are to look at: the parts of which the closures are made up; raises
    ``EnclosureFailure``."""
    try:
        error = PoseError.of(setup, goal)
    except EnclosureFailure as why:
        try:
            planes = PlaneError.families(setup, goal)
        except EnclosureFailure:
            raise why from None
        return _read(planes[0].error), [*planes], None
    _read(error)
    if error.turns.shape[1] > 1:
        if vanishing:
            raise EnclosureFailure("the platform rotates about more than one axis")
        return error, [SpringError.about(error)], None
    struts = Struts.of(setup, goal, error)
    if struts is not None:
        return error, [*struts.whole(), *([] if vanishing else struts.locked_errors())], struts
    families: list[JointError] = [JointError.of(error)]
    # in a plane what is at right angles to the desired directions does not fill curves
    if not vanishing and error.size > 2:
        with suppress(EnclosureFailure):
            loop = LoopError.about(error)
            families += [*(replace(families[0], square=k) for k in range(2) if loop.flat > 1), loop]
    return error, families, None


def _read(error: PoseError) -> PoseError:
    """An error whose forms are read from joints; raises ``EnclosureFailure`` where they are not."""
    if error.fitted:
        raise EnclosureFailure(f"forms are fitted to samples: {', '.join(error.fitted)}")
    return error


def _boxes(error: JointError, low: Array, high: Array, reach: float, vanishing: bool) -> Subdivision:
    """All of a chart; those of poses far away begin beyond the places where rods have no length."""
    ends = np.abs(error.ends).max(initial=0.0)
    if ends:
        reach = max(reach, POSITION_BOX_FRACTION * float(ends))
        low, high = np.full(3, -reach), np.full(3, reach)
    corners = error.box(low, high, reach)
    if isinstance(error, ForceError):
        kind = LoopSubdivision if isinstance(error, LoopError) else SpringSubdivision
        return kind(error, *corners)
    return Subdivision(error, *corners, vanishing)


def _corners(error: JointError, boxes: Sequence[tuple[Array, Array]], size: int) -> Iterator[tuple[Array, Array]]:
    """The corners of boxes, in coordinates of the pose about the goal; boundless in a chart of fewer."""
    if not boxes:
        return
    low, high = error.enclose_chart(*map(np.array, zip(*boxes, strict=True)))
    if error.error.size < size:
        low, high = np.full((len(boxes), size), -np.inf), np.full((len(boxes), size), np.inf)
    yield from zip(low[:, :size], high[:, :size], strict=True)


def _cut_long(every: Sequence[Subdivision], whole: Array, budget: int, jobs: int) -> None:
    """Subdivide undecided boxes that together are larger than one place, more finely step by step."""
    for finer in SINGULAR_FINER:
        own = [list(_corners(each.error, each.lost, len(whole))) for each in every]
        long = [
            (low, high)
            for low, high in join_boxes(chain(*own))
            if np.isfinite(high - low).all() and np.any(high - low > LOCKED_PLACE_EDGE_FRACTION * whole)
        ]
        for each, boxes in zip(every, own, strict=True):
            chosen = [any(np.all((a <= low) & (high <= b)) for a, b in long) for low, high in boxes]
            left = budget - sum(other.boxes for other in every)
            if any(chosen) and left > 0:
                each.cut_lost(chosen, finer, left, jobs)


def _places(
    places: Sequence[tuple[Array, Array]], left: Sequence[tuple[Array, Array]], whole: Array
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Return places (corners) where equations may be dependent, as centres and half edges, each with the smallest of
    the undecided boxes about it; and the other undecided boxes: also those that are long, or unbounded, and cannot be
    described by a point."""
    locked, long = list[tuple[Array, Array]](), list[tuple[Array, Array]]()
    low, high = (np.array([each[k] for each in left]).reshape(-1, len(whole)) for k in range(2))
    near = SINGULAR_BOX_MIN_FRACTION * whole
    smallest, taken = np.all(high - low <= near, axis=1), np.zeros(len(left), dtype=bool)
    for a, b in places:
        beside = np.zeros(len(left), dtype=bool)
        while np.any(new := smallest & ~beside & ~taken & np.all((low <= b + near) & (a - near <= high), axis=1)):
            a, b, beside = np.minimum(a, low[new].min(axis=0)), np.maximum(b, high[new].max(axis=0)), beside | new
        if np.all(b - a <= LOCKED_PLACE_EDGE_FRACTION * whole):
            locked.append(((a + b) / 2, (b - a) / 2))
            taken |= beside
        else:
            long.append((a, b))
    return locked, [each for each, is_taken in zip(left, taken, strict=True) if not is_taken] + long


def join_boxes(boxes: Iterable[Sequence[Array]]) -> list[tuple[Array, Array]]:
    """The corners of a box about each group of boxes (lower, upper corner) that are nearly together; those without an
    end are one group by themselves."""
    groups, endless = list[tuple[Array, Array]](), list[tuple[Array, Array]]()
    for low, high in boxes:
        room = 3 * (high - low)
        if not np.isfinite(room).all():
            endless.append((low, high))
            continue
        while near := [k for k, (a, b) in enumerate(groups) if np.all((a <= high + room) & (low <= b + room))]:
            low, high = (
                np.min([low, *(groups[k][0] for k in near)], axis=0),
                np.max([high, *(groups[k][1] for k in near)], axis=0),
            )
            groups = [each for k, each in enumerate(groups) if k not in near]
        groups.append((low, high))
    if endless:
        low, high = map(np.array, zip(*endless, strict=True))
        groups.append((low.min(axis=0), high.max(axis=0)))
    return groups


def legs_that_may_lock(setup: ObservedRobot) -> tuple[str, ...]:
    """Return the legs whose joints may lock where their closed forms are regular: those with U joints, or with parallel
    rods; for R and P in a plane, and one rod between S joints, the forms are complete."""
    joints = setup.mechanism.joints
    return tuple(
        leg.label
        for leg in setup.decomposition.legs
        if leg.has_loops or any(joints[name].type is JointType.UNIVERSAL for name in leg.joints)
    )


def _on_line(zero: CriticalBox, line: PoseError, error: PoseError) -> CriticalBox:
    """A critical point of a line, where a rod lies along its leg's outer axes, among all: its coordinates about the
    goal. E falls in one direction more, in which the joints turn the rod off the line."""
    return replace(
        zero,
        x=error.shifts.T @ (line.p + line.shifts @ zero.x - error.p),
        radius=np.abs(error.shifts.T @ line.shifts) @ zero.radius + HIDDEN_ROBOT_RESIDUAL_TOL,
        falling=None if zero.falling is None else zero.falling + 1,
    )


def reachable_box(error: PoseError, reach: float) -> tuple[Array, Array, bool]:
    """The box of coordinates that the legs can reach, and whether it is all of it."""
    from scipy.optimize import linprog

    k = error.shifts.shape[1]
    rows, limits = [], []
    for limb in error.limbs:
        if limb.reach is None or limb.joint is None:
            continue
        away = limb.reach + float(np.linalg.norm(limb.tip.turned))
        ways = np.linalg.svd(limb.joint.axis[None])[2][1:] if limb.joint.start is None else np.eye(3)
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
            bounds.append(
                sign * found.fun - sign * LINEAR_PROGRAM_BOX_TOL if found is not None and reached else -sign * reach
            )
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    turns = np.ones(error.turns.shape[1])
    return np.concatenate([low, -turns]), np.concatenate([high, turns]), bounded


def _is_same_rod_zero(one: CriticalBox, other: CriticalBox, loop: LoopError) -> bool:
    """Return True if two enclosed zeros are at one pose with the same directions of two rods."""
    return _has_common_values(one, other, loop, list(range(loop.error.size))) and bool(
        np.abs(one.directions - other.directions).max() < CRITICAL_POINT_DISTANCE_TOL
    )


def _is_same_zero(one: CriticalBox, other: CriticalBox, error: JointError) -> bool:
    """Return True if two enclosed zeros are at one pose with the same directions, or opposite ones: enclosures of the
    observed directions meet; rotations that differ by half a turn count as equal."""
    watched = {each.limb for each in error.error.seen}
    own = [*range(error.error.size), *(k for k, i in enumerate(error.joints, error.error.size) if i in watched)]
    apart = np.linalg.norm(np.cross(one.directions, other.directions), axis=1).max(initial=0.0)
    turned = float(np.abs(one.R - other.R).max())
    return _has_common_values(one, other, error, own) and max(apart, turned) < CRITICAL_POINT_DISTANCE_TOL


def _has_common_values(one: CriticalBox, other: CriticalBox, error: JointError, own: list[int]) -> bool:
    """Return True if enclosures of two zeros meet in some of the coordinates, up to periods."""
    away = _away(one.x[own], other.x[own], error.periods[own])
    return bool(np.all(away <= one.radius[own] + other.radius[own] + HIDDEN_ROBOT_RESIDUAL_TOL))


def _away(one: Array, other: Array, periods: Array) -> Array:
    """Return the distance of coordinates (n,) from others, up to periods."""
    away, turns = np.abs(one - other), np.isfinite(periods)
    away[turns] %= periods[turns]
    away[turns] = np.minimum(away[turns], periods[turns] - away[turns])
    return away
