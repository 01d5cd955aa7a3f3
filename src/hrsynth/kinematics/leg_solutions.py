"""Leg solutions at a pose of the leg's end, in balls: the values that one of its joints can have there, or the proof
that it has none.

A way of a leg (:mod:`ways`) is cut at its first and its last part. What is fixed beyond the last (its centre, or two
points of its axis) lies at T at the pose. The first part keeps, of each point x that it carries, |x − A|² and, about an
axis a, a·(x − A), or, along p, what is normal to p. With one joint between them, of value q, these are *laws*

    turning: K + α cos q + β sin q = w,    sliding: K + α q + β q² = w,

and every q is known. Where all turns about a point lie between them, the first joint itself is q: the distance from
what it carries to T is known. A list is complete for every pose and geometry in the balls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from ..geometry.balls import Field, enclose_around
from ..geometry.so3 import convert_rotations_to_vectors
from ..geometry.vectors import Array, build_plane_axes, dot, invert_pose
from ..records import As, Number, Record
from ..tolerances import GEOMETRY_DIFFERENCE_TOL, REACH_BALL_RADIUS_FRACTION
from .leg_paths import MotionFactor


@dataclass(frozen=True)
class ReachFailure(Record, all_recorded=True):
    """Failure of a leg to close: the reason, and by how much it misses at least (m, or rad)."""

    words: Annotated[str, As("reason")]
    by: Annotated[float, Number]
    unit: str = "m"

    def __str__(self) -> str:
        return f"{self.words} (out of reach by {self.by:.3g} {self.unit})"


@dataclass(frozen=True, eq=False)
class LegSolutions:
    """Solutions of a path of a leg at a pose: none (``miss``), or of some joints all values, as balls, rotations modulo
    2π; those of one path in the same order."""

    miss: ReachFailure | None = None
    values: tuple[tuple[str, tuple[Any, ...]], ...] = ()


UNDECIDED = LegSolutions()
ORIGIN = np.zeros(3)


@dataclass(frozen=True, eq=False)
class LegEnd:
    """End of a path: displaced from zero by D (4, 4); every number of D is known to ``within`` (characteristic lengths,
    of ``length`` m; pure numbers). ``turns``: whether its rotation counts, else the position of its last part."""

    D: Array
    length: float
    within: float
    turns: bool = True

    def target(self, x: Array) -> Field:
        """Return balls around a point (3,) of the end."""
        size = self.length + float(np.abs(x).sum() + np.abs(self.D[:3, 3]).max())
        return enclose_around(self.D[:3, :3] @ x + self.D[:3, 3], max(self.within, REACH_BALL_RADIUS_FRACTION) * size)

    def ball(self, x: Array) -> Field:
        """Return balls around a point of the mechanism, as exact as its incidences are taken."""
        return enclose_around(x, GEOMETRY_DIFFERENCE_TOL * self.length)


def solve_path(way: Sequence[MotionFactor], end: LegEnd) -> LegSolutions:
    """Return all solutions of a path, from the base or, where the end's rotation counts, from the end."""
    turning = [part for part in way if not part.slides]
    if end.turns and len(turning) == 1 and turning[0].joint is not None:
        # one part alone rotates the end: entries of D off by w change its angle by 3w at most
        angle = float(convert_rotations_to_vectors(end.D[:3, :3]) @ turning[0].direction)
        return LegSolutions(
            None,
            (
                (
                    turning[0].joint,
                    (*enclose_around(np.array([angle]), 3 * max(end.within, REACH_BALL_RADIUS_FRACTION)),),
                ),
            ),
        )
    found = _solve_from_first(way, end)
    if end.turns and found is UNDECIDED:
        found = _solve_from_first([part.reversed() for part in way[::-1]], replace(end, D=invert_pose(end.D)))
    return found


def solve_leg(several: Sequence[Sequence[MotionFactor]], end: LegEnd) -> LegSolutions:
    """Return the solutions of all paths of a leg together: a miss of one, or values of one joint that all of them
    share."""
    known: dict[str, tuple[Any, ...]] = {}
    for way in several if np.isfinite(end.within) else ():
        found = solve_path(way, end)
        if found.miss is not None:
            return found
        for joint, values in found.values:
            slides = any(part.slides for part in way if part.joint == joint)
            gaps = [[_bound_difference(one, other, slides) for other in values] for one in known.get(joint, ())]
            kept = tuple(one for one, row in zip(known.get(joint, ()), gaps, strict=True) if min(row) <= 0)
            if gaps and not kept:
                return LegSolutions(
                    ReachFailure(
                        f"its rods need different values of joint {joint}",
                        min(map(min, gaps)),
                        "m" if slides else "rad",
                    )
                )
            known[joint] = kept or values
    return LegSolutions(None, tuple(known.items()))


def _bound_difference(one: Any, other: Any, slides: bool) -> float:
    """Return a lower bound of the difference of two values, of rotations modulo 2π; 0 if they may be the same."""
    from flint import arb

    gap = one - other
    if not slides and gap.is_finite():
        gap -= 2 * arb.pi() * round(float(gap.mid()) / (2 * np.pi))
    return float(gap.abs_lower()) if gap.is_finite() else 0.0


def _solve_from_first(way: Sequence[MotionFactor], end: LegEnd) -> LegSolutions:
    """Return the solutions of a path from its first part."""
    if len(way) not in (2, 3) or way[-1].slides:
        return UNDECIDED
    first, last = way[0], way[-1]
    moving = way[1] if len(way) == 3 and way[1].axis is not None else None
    far = [last.point] if last.axis is None else [last.point, last.point + end.length * last.axis]
    targets = [end.target(x) for x in far]
    if len(way) == 2 or moving is not None:
        laws = [
            law
            for x, T in zip(far, targets, strict=True)
            for law in _list_invariant_laws(first, moving, last, x, T, end)
        ]
        return _solve_laws(laws, first, moving, far[0], targets[0], end)
    B = way[1].point
    rods = [_compute_square(end.ball(B) - x) for x in far]
    if first.axis is not None:
        words = f"the rod from {_name(way[1])} to {_name(last)} is {{sought}} long, not {{span}}"
        laws = [_make_distance_law(first, end.ball(B), T, rod, words) for T, rod in zip(targets, rods, strict=True)]
        # from the first part, the rod's far end must be where the U between them can bring it
        return _solve_laws(
            laws,
            None,
            first,
            B,
            targets[0],
            end,
            lambda q: _prove_tilt_failure(way[1], end.ball(far[0]), first.moved(targets[0], -q)),
        )
    if last.axis is not None:
        return UNDECIDED
    # two rods between three centres: |AB| − |BC| ≤ |AC| ≤ |AB| + |BC|
    reach, one, other = (
        _compute_root(_compute_square(v))
        for v in (targets[0] - first.point, end.ball(B) - first.point, end.ball(B) - far[0])
    )
    return LegSolutions(_prove_outside(abs(one - other), one + other, reach, _describe_distance(first, last)))


@dataclass(frozen=True, eq=False)
class _Law:
    """K + α cos q + β sin q = w (``turns``) or K + α q + β q² = w: a squared distance (m²), or a height (m)."""

    K: Any
    alpha: Any
    beta: Any
    wanted: Any
    turns: bool
    squared: bool
    words: str

    def at(self, q: Any) -> Any:
        """Left side of the law."""
        one, other = (q.cos(), q.sin()) if self.turns else (q, q * q)
        return self.K + self.alpha * one + self.beta * other

    @property
    def swing(self) -> Any:
        """Largest change of the left side by a rotation."""
        return _compute_root(self.alpha * self.alpha + self.beta * self.beta)

    def prove_miss(self, low: Any, high: Any | None) -> ReachFailure | None:
        """Return the proof that the value is outside of an interval of the left side (None: no upper bound)."""
        if self.squared:
            return _prove_outside(
                _compute_root(low),
                None if high is None else _compute_root(high),
                _compute_root(self.wanted),
                self.words,
            )
        return _prove_outside(low, high, self.wanted, self.words)

    def miss(self) -> ReachFailure | None:
        """Proof that no q is a solution, if there is one."""
        if self.turns:
            return self.prove_miss(self.K - self.swing, self.K + self.swing)
        if self.squared:
            least = self.K - self.alpha * self.alpha / 4
            return self.prove_miss(least, None if self.beta > 0 else least)
        return self.prove_miss(self.K, self.K) if self.alpha.contains(0) else None

    def roots(self) -> list[Any]:
        """Return balls that contain all q; none if every q may be a solution."""
        from flint import arb

        rest = self.wanted - self.K
        if self.turns:
            middle = arb.atan2(self.beta, self.alpha)
            if not self.swing > 0 or not middle.is_finite():
                return []
            half = _compute_arccos(rest / self.swing)
            return [middle + half, middle - half]
        if not self.beta > 0:
            return [] if self.alpha.contains(0) else [rest / self.alpha]
        half = _compute_root(self.alpha * self.alpha / 4 + rest)
        return [half - self.alpha / 2, -half - self.alpha / 2]


def _list_invariant_laws(
    first: MotionFactor, moving: MotionFactor | None, last: MotionFactor, x: Array, target: Field, end: LegEnd
) -> list[_Law]:
    """Return the laws of the first part for a point x of the last that ``moving`` moves to the target."""
    if first.axis is not None and first.slides:
        words = f"{_name(last)} would be at {{sought}} across the rail {_name(first)}, and reaches {{span}}"
        return [_make_height_law(moving, end.ball(x), normal, target, words) for normal in build_plane_axes(first.axis)]
    square = _compute_square(target - end.ball(first.point))
    laws = [_make_distance_law(moving, end.ball(x), end.ball(first.point), square, _describe_distance(first, last))]
    if first.axis is not None:
        words = f"{_name(last)} would be at {{sought}} along the axis of {_name(first)}, and reaches {{span}}"
        laws.append(_make_height_law(moving, end.ball(x), first.axis, target, words, first.point))
    return laws


def _make_distance_law(moving: MotionFactor | None, x: Field, A: Field, square: Any, words: str) -> _Law:
    """|x(q) − A|² = square."""
    from flint import arb

    if moving is None or moving.slides:
        along = arb(0) if moving is None else 2 * _compute_dot(x - A, moving.direction)
        return _Law(_compute_square(x - A), along, arb(0 if moving is None else 1), square, False, True, words)
    centre, v, w = moving.circle(x)
    C = centre - A
    return _Law(
        _compute_square(C) + _compute_square(v),
        2 * _compute_dot(C, v),
        2 * _compute_dot(C, w),
        square,
        True,
        True,
        words,
    )


def _make_height_law(
    moving: MotionFactor | None, x: Field, n: Array, target: Field, words: str, A: Array = ORIGIN
) -> _Law:
    """n·(x(q) − A) = n·(target − A)."""
    from flint import arb

    wanted = _compute_dot(target - A, n)
    if moving is None or moving.slides:
        along = 0.0 if moving is None or moving.axis is None else float(n @ moving.axis)
        return _Law(_compute_dot(x - A, n), arb(along, GEOMETRY_DIFFERENCE_TOL), arb(0), wanted, False, False, words)
    centre, v, w = moving.circle(x)
    return _Law(_compute_dot(centre - A, n), _compute_dot(v, n), _compute_dot(w, n), wanted, True, False, words)


def _solve_laws(
    laws: Sequence[_Law],
    first: MotionFactor | None,
    moving: MotionFactor | None,
    x: Array,
    target: Field,
    end: LegEnd,
    more: Callable[[Any], list[ReachFailure]] = lambda q: [],
) -> LegSolutions:
    """Return all values of the moving part by laws that are met together and not refused by ``more``, and of the first
    part's joint with each."""
    misses = [miss for law in laws if (miss := law.miss()) is not None]
    if misses:
        return LegSolutions(max(misses, key=lambda miss: miss.by))
    lists = [roots for law in laws if (roots := law.roots())]
    if moving is None or not lists:
        return UNDECIDED
    sharpest = min(lists, key=lambda roots: max(float(root.rad()) for root in roots))
    failed = [
        [miss for law in laws if (miss := law.prove_miss(law.at(q), law.at(q))) is not None]
        + _prove_tilt_failure(first, moving.moved(end.ball(x), q), target)
        + more(q)
        for q in sharpest
    ]
    values = tuple(q for q, missed in zip(sharpest, failed, strict=True) if not missed)
    if not values:
        worst = [max(missed, key=lambda miss: miss.by) for missed in failed]
        return LegSolutions(min(worst, key=lambda miss: miss.by))
    found = [] if moving.joint is None else [(moving.joint, values)]
    if first is not None and first.joint is not None:
        found.append(
            (first.joint, tuple(_find_carrying_value(first, moving.moved(end.ball(x), q), target) for q in values))
        )
    return LegSolutions(None, tuple(found))


def _prove_tilt_failure(first: MotionFactor | None, x: Field, target: Field) -> list[ReachFailure]:
    """Return the proof that a U cannot bring x to the target: a rotation about its second axis must give x the target's
    height along the first."""
    if first is None or first.pair is None:
        return []
    outer, inner = first.pair
    words = f"its far end would be at {{sought}} along the first axis of {_name(first)}, and reaches {{span}}"
    miss = _make_height_law(MotionFactor(False, first.point, inner, ()), x, outer, target, words).miss()
    return [] if miss is None else [miss]


def _find_carrying_value(first: MotionFactor, x: Field, target: Field) -> Any:
    """Return the value with which a part brings x to the target."""
    from flint import arb

    if first.slides:
        return _compute_dot(target - x, first.direction)
    _, v, w = first.circle(x)
    sine, cosine = _compute_dot(w, target - first.point), _compute_dot(v, target - first.point)
    # a ball across atan2's cut would be a whole turn
    return arb.atan2(sine, cosine) if cosine > 0 else arb.pi() + arb.atan2(-sine, -cosine)


def _prove_outside(low: Any, high: Any | None, wanted: Any, words: str) -> ReachFailure | None:
    """Return the proof that a ball is outside of an interval between balls; ``words`` have places for both."""
    by = max(float((low - wanted).lower()), -1.0 if high is None else float((wanted - high).lower()))
    if not by > 0:
        return None
    least, most, sought = (None if x is None else f"{float(x.mid()):.4g}" for x in (low, high, wanted))
    span = f"at least {least}" if most is None else least if most == least else f"{least} to {most}"
    return ReachFailure(words.format(sought=f"{sought} m", span=f"{span} m"), by)


def _describe_distance(one: MotionFactor, other: MotionFactor) -> str:
    return f"{_name(other)} would be {{sought}} from {_name(one)}, and reaches {{span}}"


def _name(part: MotionFactor) -> str:
    return part.joints[0] if part.joints else "its end"


def _compute_dot(a: Field, b: Field) -> Any:
    return dot(a, b).item()


def _compute_square(v: Field) -> Any:
    return _compute_dot(v, v)


def _compute_root(x: Any) -> Any:
    """Return √ of the part of a ball that is not negative."""
    from flint import arb

    low, high = (max(arb(0), each).sqrt() for each in (x.lower(), x.upper()))
    return low.union(high)


def _compute_arccos(x: Any) -> Any:
    """Return arccos of the part of a ball within [−1, 1]."""
    from flint import arb

    low, high = (min(arb(1), max(arb(-1), each)).acos() for each in (x.lower(), x.upper()))
    return low.union(high)
