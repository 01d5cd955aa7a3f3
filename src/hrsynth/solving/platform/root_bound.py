"""Root bound of poses of a rigid body under six conditions on its points (docs/pages/proofs.md, section 8).

A pose is a point (h : M : x : y : r) of P¹⁶ with M = h R, x = h Rᵀp, y = h p, r = h |p|². Such points and their limits
are an irreducible variety X of dimension 6 and degree 40 (M. Gallet, G. Nawratil, J. Schicho, J. Geom. 106, 2015;
F. Ronga, T. Vust 1995), and a condition on a point b is one linear equation there,

    a₀ b₀ r + 2 a₀ x·b − 2 b₀ y·a − 2 aᵀM b + c h = 0,

*on a sphere* about a with a₀ = b₀ = 1, *in a plane* of normal a with a₀ = 0, an *angle* of an arrow b with a₀ = b₀ = 0.
So six conditions have at most 40 isolated poses, and 40 of them leave no curve of poses: each component of the
intersection counts its degree at least, and an isolated point its multiplicity on X (W. Fulton, Intersection theory,
12.3 and 12.4).

That lowers the bound where points with h = 0 are known. M = v uᵀ, x = μ u, y = λ v, r = 2 λ μ, with v·v = u·u = 0,
gives −2 (v·a − μ a₀)(u·b + λ b₀) for the left side: it vanishes for all conditions where each has its a on the real
line that v and μ determine, or its b on that of u and λ. Near such a point X is C⁴ × {h r = ν²} to first order, with
tangents M = s₁ n uᵀ + s₂ v mᵀ + h n mᵀ, x = μ u + ν m, y = λ v + ν n, r, where n and m are the unit vectors along the
lines: a double point. It is isolated among all solutions if the six equations leave one direction of these seven, off
the cone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from ...geometry.loci import Circle, Line, Plane, Point, Sphere
from .constrained_platform import System
from .quadrics import UNIT, convert_direction, list_normals
from .rigid import Spatial
from .roots import ROOT_ISOLATION_BITS_COUNT
from .translating import ArticulatedPlatform

RIGID_BODY_VARIETY_DEGREE_COUNT = 40
"""The degree of X: of the poses of a rigid body among 16 coordinates."""

DOUBLE_POINT_DIRECTIONS_COUNT = 7
"""Directions in which X extends at one of its double points."""


_Name = tuple[float, ...]
_Pair = tuple[_Name, _Name]


@dataclass(frozen=True)
class Bound:
    """Root bound of isolated poses, exact if that many are isolated, and its proof.

    ``law``: ``degree`` where solutions at infinity count among them, ``quadrics``, ``places`` or ``product``.
    """

    most: int
    why: str
    law: str


@dataclass(frozen=True, eq=False)
class _Condition:
    """One linear equation: a, a₀, b, b₀, c as above, a and b with the origins of base and platform at o and w.

    ``names`` are (a₀, a) and (b₀, b) in the system's own coordinates, equal for equal points."""

    names: tuple[_Name, _Name]
    a0: int
    b0: int
    a: Any
    b: Any
    squared: Any
    """ρ² of a sphere; 2 a · (what is in the plane) of a plane."""

    def moved(self, o: Any, w: Any) -> tuple[Any, Any, Any]:
        """a, b, c about other origins."""
        a, b = self.a - self.a0 * o, self.b - self.b0 * w
        c = a @ a + b @ b - self.squared if self.a0 else self.squared - 2 * self.b0 * (a @ o)
        return a, b, c


def find_least_bound(system: System, legs: Sequence[int]) -> Bound | None:
    """Return a bound of the complex poses that meet the conditions of as many legs as dof, if they are finitely many,
    and its proof; None if it is not known."""
    if sum(system.forbids[k] for k in legs) != system.freedoms:
        return None
    if isinstance(system, Spatial):
        return _bound_body(system, legs)
    return _bound_two_bodies(system, legs) if isinstance(system, ArticulatedPlatform) else None


def _bound_two_bodies(system: ArticulatedPlatform, legs: Sequence[int]) -> Bound | None:
    """Bézout for p in space and the slide's circle (degree 2): of a body's spheres all but one are planes by their
    differences, and those of the other body are linear in p then: 2 · 2 m, m the other body's conditions; without
    spheres 2 m. With a line for the slide one sphere of each body is left: 2 each."""
    sides = [[k for k in legs if system.bodies[k] == body] for body in (0, 1)]
    counts = [sum(system.forbids[k] for k in side) for side in sides]
    round_ = [any(isinstance(system.curves[k], Circle | Sphere) for k in side) for side in sides]
    if not all(counts):
        return None
    if isinstance(system.slide, Line):
        return Bound(2 ** sum(round_), "a sphere of each body, planes besides (Bézout)", "product")
    bounds = [(4 if round_[body] else 2) * counts[1 - body] for body in (0, 1) if round_[body] or not any(round_)]
    return Bound(min(bounds), "the product of degrees in space and on the circle (Bézout)", "product")


def _bound_body(system: Spatial, legs: Sequence[int]) -> Bound:
    """The least of the bounds that hold for the six conditions of some legs."""
    curves = [system.curves[k] for k in legs]
    if sorted(system.forbids[k] for k in legs) == [1, 2, 3]:
        return Bound(
            4, "two positions of a tip on its curve, for each two rotations about the line to the fixed tip", "places"
        )
    if any(isinstance(curve, Point) for curve in curves) or all(isinstance(curve, Line | Plane) for curve in curves):
        # with planes p is a linear function of R
        return Bound(8, "three quadrics of the quaternion (Bézout)", "quadrics")
    places = _bound_places(system, legs) if all(isinstance(curve, Sphere) for curve in curves) else None
    degree = compute_degree_bound(system, legs)
    return degree if places is None or degree.most < places.most else places


def _bound_places(system: Spatial, legs: Sequence[int]) -> Bound | None:
    """Rods that share balls, one after another: three leave a ball two places, and so do two besides a ball whose
    distance is known; four between two and two balls leave these two shapes, which turn about both lines."""
    balls = [
        {k: tuple(system.tips[k].tolist()) for k in legs},
        {k: tuple(system.curves[k].centre.tolist()) for k in legs},
    ]
    for side in balls:
        shared = Counter(side.values())
        three = next(([k for k in legs if side[k] == ball] for ball in shared if shared[ball] == 3), None)
        if three is None:
            continue
        if any(len({ends[k] for k in legs if k not in three}) == 2 for ends in balls):
            return Bound(
                8,
                "two places of a ball with three rods, two of a ball with two more, two turns about their line",
                "places",
            )
        return Bound(
            16, "two places of a ball with three rods, three quadrics of the quaternion for each (Bézout)", "quadrics"
        )
    for four in combinations(legs, 4):
        if (
            all(len({side[k] for k in four}) == 2 for side in balls)
            and len({(balls[0][k], balls[1][k]) for k in four}) == 4
        ):
            rest = [k for k in legs if k not in four]
            if any(len({side[k] for k in rest}) == 1 for side in balls):
                # the place of the ball that the last two rods share is a linear function of its turn about one line:
                # the other line's distance is a quadric of that turn
                return Bound(
                    8, "two shapes of four balls with four rods, a quadric of the turn about a line for each", "places"
                )
            return Bound(
                16,
                "two shapes of four balls with four rods, two forms of degrees 2 and 2 of the turns about "
                "two lines for each (Bézout)",
                "places",
            )
    return None


def compute_degree_bound(system: Spatial, legs: Sequence[int]) -> Bound:
    """40, or less by the double points that are proved to be isolated solutions, for all input in the balls."""
    from flint import ctx

    known = list[_Double]()
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        rows = list(_list_conditions(system, legs))
        for a, b in _list_covers(rows):
            known += [new for new in _prove_doubles(rows, a, b) if all(new.is_distinct_from(old) for old in known)]
    why = "six conditions on points of a rigid body (degree of the poses among 16 coordinates"
    if known:
        why += f", less 2 for each of {len(known)} isolated double points at infinity"
    return Bound(RIGID_BODY_VARIETY_DEGREE_COUNT - 2 * len(known), f"{why})", "degree")


def _list_conditions(system: Spatial, legs: Sequence[int]) -> Iterator[_Condition]:
    """The equations of some legs in working coordinates."""
    frame = system.frame
    numbers = system.balls(frame)
    for k in legs:
        reach, arrow = system.curves[k], k >= len(system.points)
        b, b0 = numbers.vector(system.tips[k] / frame.size) / UNIT, int(not arrow)
        centre = numbers.vector(frame.point(reach.centre)) / UNIT
        start = numbers.vector(frame.point(system.hub)) / UNIT if arrow else 0
        name = (b0, *system.tips[k].tolist())
        for n in list_normals(reach) if isinstance(reach, Circle | Line | Plane) else ():
            a = convert_direction(n, frame, numbers) / UNIT
            yield _Condition(((0, *n.tolist()), name), 0, b0, a, b, 2 * (a @ (centre - start)))
        if isinstance(reach, Circle | Sphere):
            rho = numbers.vector(np.array([reach.radius / frame.size]))[0] / UNIT
            yield _Condition(((1, *reach.centre.tolist()), name), 1, b0, centre, b, rho * rho)


def _list_covers(rows: Sequence[_Condition]) -> Iterator[tuple[_Pair, _Pair]]:
    """Two a's and two b's, not both of either at infinity, such that each condition has one of them, and all needed."""
    sides = [list(dict.fromkeys(row.names[side] for row in rows)) for side in (0, 1)]
    pairs = [[pair for pair in combinations(names, 2) if pair[0][0] or pair[1][0]] for names in sides]
    for a, b in product(*pairs):
        if {row.names[0] for row in rows if row.names[1] not in b} == set(a) and {
            row.names[1] for row in rows if row.names[0] not in a
        } == set(b):
            yield a, b


@dataclass(frozen=True, eq=False)
class _Double:
    """A double point: v on a line through o of the base, u on one through w of the platform; shapes (3,)."""

    o: Any
    v: Any
    n: Any
    w: Any
    u: Any
    m: Any

    def is_distinct_from(self, other: _Double) -> bool:
        """Return True if two of them are surely different."""
        tests = [
            *np.cross(self.v, other.v),
            *np.cross(self.u, other.u),
            other.v @ (self.o - other.o),
            other.u @ (self.w - other.w),
        ]
        return any(not test.contains(0) for test in tests)

    def is_isolated_solution(self, rows: Sequence[_Condition]) -> bool:
        """Return True if no other solution is near."""
        from flint import acb, acb_mat

        table = []
        for row in rows:
            a, b, c = row.moved(self.o, self.w)
            va, na, ub, mb = self.v @ a, self.n @ a, self.u @ b, self.m @ b
            table.append(
                [
                    -2 * na * ub,
                    -2 * va * mb,
                    2 * row.a0 * ub,
                    -2 * row.b0 * va,
                    c - 2 * na * mb,
                    2 * (row.a0 * mb - row.b0 * na),
                    acb(row.a0 * row.b0),
                ]
            )
        middles = np.array([[complex(entry) for entry in row] for row in table])
        k = int(np.argmax(np.abs(np.linalg.svd(middles)[2][-1])))
        try:
            rest = acb_mat([row[:k] + row[k + 1 :] for row in table]).solve(acb_mat([[-row[k]] for row in table]))
        except ZeroDivisionError:
            return False
        left = [rest[i, 0] for i in range(DOUBLE_POINT_DIRECTIONS_COUNT - 1)]
        h, nu, r = [*left[:k], acb(1), *left[k:]][-3:]
        return not (h * r - nu * nu).contains(0)


def _prove_doubles(rows: Sequence[_Condition], a: _Pair, b: _Pair) -> Iterator[_Double]:
    """The double points of two lines that are proved to be isolated solutions."""
    base, platform = (
        [next((row.a, row.b)[side] for row in rows if row.names[side] == name) for name in pair]
        for side, pair in enumerate((a, b))
    )
    (o, n, first), (w, m, second) = _build_line(a, base), _build_line(b, platform)
    for sign, turn in product((1, -1), repeat=2):
        # v = e₁ + i e₂, n = e₁ × e₂, but u = f₁ − i f₂, m = f₁ × f₂: R is a turn from (f₁, f₂, m) to (e₁, e₂, n)
        new = _Double(o, _combine(first, sign * n, 1), sign * n, w, _combine(second, turn * m, -1), turn * m)
        if new.is_isolated_solution(rows):
            yield new


def _build_line(names: _Pair, points: Sequence[Any]) -> tuple[Any, Any, Any]:
    """A point of the line through two, one of which may be a direction, its unit vector and one normal to that."""
    start, end = points if names[0][0] else reversed(points)
    along = end - start if names[0][0] and names[1][0] else end
    across = np.eye(3, dtype=int).astype(object)[int(np.argmin([abs(float(x)) for x in along]))]
    return start, _normalise(along), _normalise(np.cross(along, across))


def _combine(first: Any, n: Any, sign: int) -> Any:
    """first ± i n × first."""
    from flint import acb

    return np.array([acb(x, sign * y) for x, y in zip(first, np.cross(n, first), strict=True)], dtype=object)


def _normalise(v: Any) -> Any:
    return v / (v @ v).sqrt()
