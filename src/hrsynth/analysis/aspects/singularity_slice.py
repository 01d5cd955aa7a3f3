"""Poses at which one leg of three cranks has its observed direction: a surface that contains all modes, the curve of
Type 2 singularities on it, and its image among the other two directions, with cusps and nodes (proofs.md, section 9).

Cranks w_k about A_k carry rods e_k to the corners T_k = A_k + w_k + e_k = T₀ + r_k, r_k = b_k exp(iφ), k = 0, 1, 2; e₀
is fixed. With n_k = w₀ × w_k and m_k = r_k × w_k the lines through T_k along w_k meet, or are parallel, where f = m₂ n₁
− m₁ n₂ = 0.

There the platform can move while all e_k are constant: with v = t i w₀, (t, ω) = (m_k, −n_k), ẇ₀ = v, ṙ_k = ω i r_k and
ẇ_k = v + ṙ_k. Let g be the rate of f in this motion. At a regular zero of (f, g) with (t, ω) ≠ 0 the map from the
surface to the directions of e₁, e₂ has a *cusp* (Whitney): three modes meet, and on a path around it two of them change
places without a singularity. At a *node* two points of the curve have the same directions. Both are regular zeros of
polynomial systems in the components of w_k and exp(iφ).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...budgets import (
    SLICE_CURVE_DISTANCE_TOL,
    SLICE_CURVE_STEP_FRACTION,
    SLICE_CURVE_STEPS_MAX,
    SLICE_GRID_STEPS_COUNT,
    SLICE_NEWTON_STEPS_MAX,
)
from ...geometry.balls import enclose_around, make_ball_jets
from ...geometry.vectors import Array
from ...records import As, Record, Recorded, Shown
from ...tolerances import CLOSURE_SOLVER_TOL, COMPLEX_STEP_MAX, HIDDEN_ROBOT_RESIDUAL_TOL, SINGULAR_POSE_DISTANCE_TOL
from ..modes.polynomials import krawczyk
from .three_cranks import ThreeCranks

Numbers = Sequence[Any] | NDArray[Any]
"""Unknowns: numbers, arrays, balls or jets. Of one point: w₀, exp(iφ), w₁, w₂, two components each."""


@dataclass(frozen=True)
class SectionPoint(Record, all_recorded=True):
    """Point of the surface: the rotation of the first crank's w₀ in the plane, that of the platform since the goal, and
    the directions of e₁, e₂ (rad). ``radius``: of the box that is proved to contain exactly one such point (rad,
    characteristic lengths), for all geometries within ``tolerances.HIDDEN_ROBOT_RESIDUAL_TOL``; None if it is not
    proved."""

    crank: float
    turn: Annotated[float, As("phi")]
    directions: tuple[float, float]
    radius: float | None


@dataclass(frozen=True, eq=False)
class SingularitySlice(Record):
    """Slice of the singularities: ``curve`` of Type 2 singularities as polylines (n, 4) of crank, rotation and two
    directions (rad), its cusps and its nodes (two points each), as far as they were found."""

    robot: ThreeCranks
    held: complex
    curve: tuple[Array, ...]
    cusps: Recorded[tuple[SectionPoint, ...]]
    nodes: Recorded[tuple[tuple[SectionPoint, SectionPoint], ...]]

    held_record = Shown(str, lambda self: self.robot.labels[0], As("fixed"))
    directions = Shown(list[str], lambda self: self.robot.labels[1:])


def _compute_cross(a: Numbers, b: Numbers) -> Any:
    """Return a × b of two vectors of the plane."""
    return a[0] * b[1] - a[1] * b[0]


def _compute_square(a: Numbers) -> Any:
    return a[0] * a[0] + a[1] * a[1]


def _rotate_quarter(factor: Any, a: Numbers) -> list[Any]:
    """Return i a."""
    return [-factor * a[1], factor * a[0]]


class _Place(NamedTuple):
    """Return the closure error of the lengths, and e_k, r_k, m_k, n_k of k = 1, 2; w_k of all, at one point."""

    lengths: list[Any]
    w: tuple[Numbers, ...]
    rods: list[list[Any]]
    r: list[list[Any]]
    m: list[Any]
    n: list[Any]

    @property
    def f(self) -> Any:
        """m₂ n₁ − m₁ n₂."""
        return self.m[1] * self.n[0] - self.m[0] * self.n[1]

    def motion(self, pick: int) -> tuple[Any, Any]:
        """Return (t, ω) = (m_k, −n_k) of a leg ``pick``, 1 or 2."""
        return self.m[pick - 1], -self.n[pick - 1]

    def rate(self, pick: int) -> Any:
        """Return g: the rate of f in that motion, ṙ_k = ω i r_k and ẇ_k = v + ṙ_k."""
        t, omega = self.motion(pick)
        v = _rotate_quarter(t, self.w[0])
        m, n = [], []
        for r, w in zip(self.r, self.w[1:], strict=True):
            turned = _rotate_quarter(omega, r)
            moved = [v[0] + turned[0], v[1] + turned[1]]
            m.append(_compute_cross(turned, w) + _compute_cross(r, moved))
            n.append(_compute_cross(v, w) + _compute_cross(self.w[0], moved))
        return m[1] * self.n[0] + self.m[1] * n[0] - m[0] * self.n[1] - self.m[0] * n[1]


@dataclass(frozen=True, eq=False)
class LockedLegSection:
    """Three cranks with the first rod fixed at the unit direction ``held``; ``number`` turns their lengths into the
    numbers that the unknowns are made of (for balls: those that contain all geometries within the tolerance)."""

    robot: ThreeCranks
    held: complex
    number: Callable[[float], Any] = float

    def place(self, x: Numbers) -> _Place:
        """Evaluate one point at unknowns (8,)."""
        robot, number = self.robot, self.number
        w, (c, s) = (x[0:2], x[4:6], x[6:8]), x[2:4]
        base = robot.feet[0] + robot.rods[0] * self.held
        r, e = [], []
        for k in (1, 2):
            b, away = robot.corners[k], base - robot.feet[k]
            turned = [c * number(b.real) - s * number(b.imag), s * number(b.real) + c * number(b.imag)]
            r.append(turned)
            e.append(
                [number(away.real) + w[0][0] + turned[0] - w[k][0], number(away.imag) + w[0][1] + turned[1] - w[k][1]]
            )
        lengths = [
            _compute_square(x[2:4]) - 1,
            *(_compute_square(w[k]) - number(robot.cranks[k]) ** 2 for k in range(3)),
            *(_compute_square(e[k]) - number(robot.rods[k + 1]) ** 2 for k in (0, 1)),
        ]
        return _Place(
            lengths,
            w,
            e,
            r,
            [_compute_cross(r[k], w[k + 1]) for k in (0, 1)],
            [_compute_cross(w[0], w[k]) for k in (1, 2)],
        )

    def curve(self, x: Numbers) -> list[Any]:
        """Return the residuals of the curve, (7,)."""
        at = self.place(x)
        return [*at.lengths, at.f]

    def cusp(self, x: Numbers, pick: int) -> list[Any]:
        """Return the residuals of a cusp, (8,)."""
        at = self.place(x)
        return [*at.lengths, at.f, at.rate(pick)]

    def node(self, x: Numbers) -> list[Any]:
        """Return the residuals of a node, (16,): the second point has the first one's rods, and so their lengths."""
        one, two = self.place(x[:8]), self.place(x[8:])
        apart = [a - b for e, h in zip(one.rods, two.rods, strict=True) for a, b in zip(e, h, strict=True)]
        return [*one.lengths, one.f, *two.lengths[:4], two.f, *apart]


def compute_singularity_slice(robot: ThreeCranks, held: complex) -> SingularitySlice:
    """Compute the curve, its cusps and its nodes: from a grid of ``budgets.SLICE_GRID_STEPS_COUNT`` rotations of crank
    and platform, enclosed where Krawczyk's operator proves them."""
    leg, thick = LockedLegSection(robot, held), LockedLegSection(robot, held, _convert_to_ball)
    traces = list(_trace_pieces(leg))
    cusps: list[tuple[Array, SectionPoint]] = []
    for x in (x for trace in traces for x in _find_sign_changes(leg, trace)):
        at = leg.place(x)
        pick = 1 + int(np.argmax([np.linalg.norm(at.motion(k)) for k in (1, 2)]))
        found = _solve_by_newton(partial(leg.cusp, pick=pick), x)
        # where (t, ω) vanishes f and g do so too, which shows nothing
        if found is None or np.linalg.norm(leg.place(found).motion(pick)) < SINGULAR_POSE_DISTANCE_TOL:
            continue
        if any(np.linalg.norm(found - other) < SINGULAR_POSE_DISTANCE_TOL for other, _ in cusps):
            continue
        box = krawczyk(_list_rows(partial(thick.cusp, pick=pick), 8), list(enclose_around(found, 0.0)))
        if box is not None and all(size.contains(0) for size in thick.place(box).motion(pick)):
            box = None
        cusps.append((found, _build_point(leg, found, box)))
    nodes: list[tuple[Array, tuple[SectionPoint, SectionPoint]]] = []
    for x in _find_crossings(traces):
        found = _solve_by_newton(leg.node, x)
        if found is None or np.linalg.norm(found[:8] - found[8:]) < SINGULAR_POSE_DISTANCE_TOL:
            continue
        if any(
            min(np.linalg.norm(found - other), np.linalg.norm(np.roll(found, 8) - other)) < SINGULAR_POSE_DISTANCE_TOL
            for other, _ in nodes
        ):
            continue
        box = krawczyk(_list_rows(thick.node, 16), list(enclose_around(found, 0.0)))
        if box is not None and all(a.overlaps(b) for a, b in zip(box[:8], box[8:], strict=True)):
            box = None
        halves = (None, None) if box is None else (box[:8], box[8:])
        nodes.append((found, (_build_point(leg, found[:8], halves[0]), _build_point(leg, found[8:], halves[1]))))
    return SingularitySlice(
        robot,
        held,
        tuple(trace.shown for trace in traces),
        tuple(point for _, point in cusps),
        tuple(pair for _, pair in nodes),
    )


def _convert_to_ball(value: float) -> Any:
    from flint import arb

    return arb(float(value), HIDDEN_ROBOT_RESIDUAL_TOL)


class _Trace(NamedTuple):
    """Piece of the curve: unknowns (n, 8), and crank, rotation and directions (n, 4)."""

    unknowns: Array
    shown: Array


def solve_sheet(robot: ThreeCranks, held: complex, crank: Array, turn: Array, sides: tuple[int, int]) -> Array:
    """Return unknowns (8, ...) where the first crank and the platform have these rotations (rad) and the other cranks
    are on these sides of the lines to their tips; NaN out of reach."""
    w, rotation = [robot.cranks[0] * np.exp(1j * crank)], np.exp(1j * turn)
    for k, side in zip((1, 2), sides, strict=True):
        D = robot.feet[0] + robot.rods[0] * held + w[0] + robot.corners[k] * rotation - robot.feet[k]
        far = np.abs(D) ** 2
        share = (far + robot.cranks[k] ** 2 - robot.rods[k] ** 2) / 2
        with np.errstate(invalid="ignore", divide="ignore"):
            w.append(D * (share + 1j * side * np.sqrt(robot.cranks[k] ** 2 * far - share**2)) / far)
    return np.array([part for z in (w[0], rotation, w[1], w[2]) for part in (z.real, z.imag)])


def _trace_pieces(leg: LockedLegSection) -> Iterator[_Trace]:
    """Trace the pieces of f = 0: each from a point where f changes its sign on one of the four sheets."""
    ticks = np.linspace(-np.pi, np.pi, SLICE_GRID_STEPS_COUNT + 1)
    crank, turn = np.meshgrid(ticks, ticks, indexing="ij")
    known = np.zeros((0, 8))
    for one, other in product((1, -1), repeat=2):
        x = solve_sheet(leg.robot, leg.held, crank, turn, (one, other))
        signs = np.sign(leg.place(x).f)
        here = (signs[1:, 1:] * signs[:-1, 1:] < 0) | (signs[1:, 1:] * signs[1:, :-1] < 0)
        for seed in x[:, 1:, 1:][:, here].T:
            if len(known) and np.min(np.linalg.norm(known - seed, axis=1)) < SLICE_CURVE_DISTANCE_TOL:
                continue
            start = _solve_by_newton(leg.curve, seed, HIDDEN_ROBOT_RESIDUAL_TOL)
            if start is None or (
                len(known) and np.min(np.linalg.norm(known - start, axis=1)) < SLICE_CURVE_DISTANCE_TOL
            ):
                continue
            unknowns = _follow_curve(leg, start)
            known = np.vstack([known, unknowns])
            yield _Trace(unknowns, np.column_stack(_list_angles(leg, unknowns.T)))


def _follow_curve(leg: LockedLegSection, start: Array) -> Array:
    """Trace points (n, 8) of a piece of the curve until it closes; in both directions if it ends."""
    ways = []
    for sense in (1.0, -1.0):
        here, way, tangent = start, [start], sense * np.linalg.svd(_compute_jacobian(leg.curve, start))[2][-1]
        while len(way) < SLICE_CURVE_STEPS_MAX:
            found = _solve_by_newton(leg.curve, here + SLICE_CURVE_STEP_FRACTION * tangent, HIDDEN_ROBOT_RESIDUAL_TOL)
            if found is None or np.linalg.norm(found - here) > 2 * SLICE_CURVE_STEP_FRACTION:
                break
            ahead = np.linalg.svd(_compute_jacobian(leg.curve, found))[2][-1]
            here, tangent = found, ahead * np.sign(ahead @ tangent)
            way.append(here)
            if len(way) > 3 and np.linalg.norm(here - start) < SLICE_CURVE_STEP_FRACTION:
                return np.array([*way, start])
        ways.append(way)
    return np.array([*ways[1][:0:-1], *ways[0]])


def _list_angles(leg: LockedLegSection, x: Array) -> list[Array]:
    """Return crank, rotation and two directions (rad) at unknowns (8, ...)."""
    one, two = leg.place(x).rods
    return [np.arctan2(v[1], v[0]) for v in (x[0:2], x[2:4], one, two)]


def _find_sign_changes(leg: LockedLegSection, trace: _Trace) -> Iterator[Array]:
    """Yield points between which the rate of f in the remaining motion changes its sign."""
    for pick in (1, 2):
        g = leg.place(trace.unknowns.T).rate(pick)
        yield from trace.unknowns[np.flatnonzero(np.sign(g[1:]) != np.sign(g[:-1]))]


def _find_crossings(traces: Sequence[_Trace]) -> Iterator[Array]:
    """Yield pairs of points, (16,), near which images of pieces cross each other."""
    parts = [np.hstack([t.shown[:-1, 2:], t.shown[1:, 2:], t.unknowns[:-1]]) for t in traces]
    segments = np.vstack(parts) if parts else np.zeros((0, 12))
    start, step, places = segments[:, :2], segments[:, 2:4] - segments[:, :2], segments[:, 4:]
    step[np.max(np.abs(step), axis=1) > np.pi] = np.nan
    for i in range(len(segments) - 1):
        away, other = start[i + 1 :] - start[i], step[i + 1 :]
        with np.errstate(invalid="ignore", divide="ignore"):
            across = _compute_cross(step[i], other.T)
            here, there = _compute_cross(away.T, other.T) / across, _compute_cross(away.T, step[i]) / across
        for j in np.flatnonzero((here >= 0) & (here <= 1) & (there >= 0) & (there <= 1)) + i + 1:
            if np.linalg.norm(places[j] - places[i]) > SLICE_CURVE_DISTANCE_TOL:
                yield np.concatenate([places[i], places[j]])


def _solve_by_newton(
    system: Callable[[Numbers], list[Any]], x: Array, enough: float = CLOSURE_SOLVER_TOL
) -> Array | None:
    """Return a zero near unknowns (n,), the nearest if there are more unknowns than equations; None if there is
    none."""
    for _ in range(SLICE_NEWTON_STEPS_MAX):
        step = np.linalg.lstsq(_compute_jacobian(system, x), np.array(system(x), dtype=float))[0]
        x = x - step
        size = np.linalg.norm(step)
        if size < enough:
            return x
        if not size < 1.0:
            return None
    return None


def _compute_jacobian(system: Callable[[Numbers], list[Any]], x: Array) -> Array:
    """Return the Jacobian by complex steps: the system is polynomial."""
    return np.array(system(x[:, None] + COMPLEX_STEP_MAX * 1j * np.eye(len(x)))).imag / COMPLEX_STEP_MAX


@dataclass(eq=False)
class _System:
    """Rows of a system for Krawczyk's operator: values, and slopes by jets, computed once for each box."""

    system: Callable[[Numbers], list[Any]]
    count: int
    known: tuple[Any, list[Any]] | None = None

    def slopes(self, x: Sequence[Any]) -> list[list[Any]]:
        """Return the Jacobian at balls x (n,)."""
        if self.known is None or self.known[0] is not x:
            columns = []
            for i in range(self.count):
                y: list[Any] = list(x)
                y[i] = make_ball_jets(np.array([x[i]], dtype=object))[0]
                columns.append([value[1] if hasattr(value, "prec") else 0 * x[i] for value in self.system(y)])
            self.known = x, [list(row) for row in zip(*columns, strict=True)]
        return self.known[1]


class _Row(NamedTuple):
    """One equation of a system."""

    whole: _System
    number: int

    def value(self, x: Sequence[Any]) -> Any:
        """Return the value at balls x."""
        return self.whole.system(x)[self.number]

    def slopes(self, x: Sequence[Any]) -> Sequence[Any]:
        """Return the derivative by each unknown."""
        return self.whole.slopes(x)[self.number]


def _list_rows(system: Callable[[Numbers], list[Any]], count: int) -> list[_Row]:
    whole = _System(system, count)
    return [_Row(whole, number) for number in range(count)]


def _build_point(leg: LockedLegSection, x: Array, box: Sequence[Any] | None) -> SectionPoint:
    """Return a point by its unknowns, and the box that was proved."""
    angles = [float(angle) for angle in _list_angles(leg, x)]
    radius = None if box is None else max(float(abs(ball - float(v)).upper()) for ball, v in zip(box, x, strict=True))
    return SectionPoint(angles[0], angles[1], (angles[2], angles[3]), radius)
