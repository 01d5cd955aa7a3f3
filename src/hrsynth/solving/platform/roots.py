"""All solutions of a square system: each complex one counted, each real one enclosed.

The resultant is exact, so every solution lies over one of its roots, which are isolated; a root at which the
other unknowns are rational functions of it carries exactly one. Where a denominator vanishes, another unknown is kept.
"""

from __future__ import annotations

import math
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...geometry.loci import Circle, Curve
from ...tolerances import RANK_GAP_MIN, SOLUTION_DISTANCE_MAX
from ..krawczyk import Polynomial, enclose_zero
from .polynomials import (
    Eliminant,
    Equation,
    compute_height,
    divide_out,
    eliminate_cycle,
    make_primitive,
    make_univariate,
    pair,
)
from .quadrics import UNIT, Balls, Conic, Within, WorkingFrame, convert_parameter
from .square_systems import SquareSystem

if TYPE_CHECKING:
    from flint import fmpz_poly

DOUBLE_SOLUTION_DISTANCE_TOL = 1e-6
"""Distance between two solutions, in their parameters, below which the pose counts as singular."""
SHARP_ROOT = 2.0**-60
"""Relative radius of a ball above which a solution is computed with more digits."""

ROOT_ISOLATION_BITS_COUNT = 128
"""Bits with which roots are isolated first."""

PRECISION_DOUBLINGS_MAX = 4
"""Number of times that the precision is doubled before another unknown is kept."""

STARTS = (0.0, 1.1, -0.9)
"""Origins of the angles (rad) that are tried until none of the solutions lies at t = ∞."""

Solution = tuple[list[Any], int]
"""Balls of all unknowns, and the multiplicity."""


NEARLY_REAL_ROOT_TOL = 1e-2
"""Distance from real ones within which a complex solution has to be shown to be none of them for all input."""

LOUD = 1 << 16
"""A resultant counts as zero if changes of the input in the last bit change it by more than this part of its size."""


@dataclass(frozen=True, eq=False)
class RealSolution:
    """A real solution: balls of the curves' parameters (m, rad), how far each curve's point, of the exact input, can be
    from that at the middle of the parameter (m), its multiplicity.

    ``unique``: its enclosure is proved to hold exactly one; ``thick``: for the exact input, not only the rounded one;
    not ``real``: the middle of two complex ones so close to each other that rounding decides which they are.
    """

    parameters: tuple[Any, ...]
    misses: tuple[float, ...]
    multiplicity: int
    unique: bool
    thick: bool
    real: bool = True


@dataclass(frozen=True, eq=False)
class SolutionSet:
    """All solutions of a square system; ``complex`` counts them with multiplicity.

    ``degree`` is that of the polynomial that was isolated, ``extraneous`` how many roots of it lie at infinity.
    ``continuum``: all such polynomials vanish; ``closest``: the smallest distance between two solutions.
    """

    complex: int = 0
    real: tuple[RealSolution, ...] = ()
    degree: int = 0
    extraneous: int = 0
    complete: bool = True
    continuum: bool = False
    closest: float = np.inf
    method: str = "exact resultant"
    far: int = 0
    """Solutions at infinity but for rounding, which ``complex`` does not count."""
    undecided: bool = False
    """True if it is not clear which these are."""
    apart: bool = False
    """True if each complex solution is enclosed, apart from all others, for all input in the balls."""
    beyond: int = 0
    """Number of enclosed, distinct solutions at infinity."""
    values: tuple[Sequence[Any], ...] = ()
    """Balls of the unknowns of all."""
    distant: tuple[Sequence[Any], ...] = ()
    """Balls of the unknowns of the ``far`` ones."""
    turn: float = 0.0
    """Origin of the angles of circles (rad), besides each unknown's own origin."""


def solve_square(square: SquareSystem, balls: Within = Balls, farthest: float = SOLUTION_DISTANCE_MAX) -> SolutionSet:
    """All solutions of a square system: those of the rounded input counted, those of all in the balls enclosed; those
    beyond the distance ``farthest`` (sizes) are taken to be at infinity."""
    from flint import ctx

    if not square.unknowns:
        return SolutionSet(1, (RealSolution((), (), 1, True, True),))
    fallback = SolutionSet(complete=False)
    for turn in STARTS:
        equations = square.equations(turn)
        with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
            conics = square.conics(turn, balls)
            thick = square.build(conics, balls)
        noisy = _change_coefficients(equations, thick)
        zeros = 0
        for (order, eliminant), (_, second) in zip(_list_eliminants(equations), _list_eliminants(noisy), strict=True):
            if _is_zero_to_rounding(eliminant.polynomial, second.polynomial):
                zeros += 1
                continue
            roots = _solve(_SquareEncloser(balls, equations, thick, square, turn, conics), order, eliminant, farthest)
            if roots.complete:
                return replace(roots, turn=turn)
            fallback = max(fallback, roots, key=lambda roots: roots.complex)
        if zeros == max(1, len(square.unknowns)):
            return SolutionSet(complete=False, continuum=True)
    return fallback


def _list_eliminants(equations: Sequence[Equation]) -> Iterator[tuple[tuple[int, ...], Eliminant]]:
    """The eliminants with each unknown kept in turn; the order of the unknowns, the kept one first."""
    tables = [equation.table for equation in equations]
    if len(tables) == 1:
        yield (0,), make_univariate(tables[0][:, 0])
    elif len(tables) == 2:
        f, g = tables
        yield (0, 1), pair(f, g)
        yield (1, 0), pair(f.T, g.T)
    else:
        f, g, h = tables
        yield (0, 1, 2), eliminate_cycle(f, g, h)
        yield (1, 2, 0), eliminate_cycle(g, h, f)
        yield (2, 0, 1), eliminate_cycle(h, f, g)


def _change_coefficients(equations: Sequence[Equation], thick: Sequence[Equation]) -> list[Equation]:
    """The equations with each coefficient changed at random by what the rounding of the input allows."""
    rng = random.Random(0)
    changed = []
    for (table, i, j), (balls, _, _) in zip(equations, thick, strict=True):
        pairs = zip(table.flat, balls.flat, strict=True)
        changes = [c + int(_spread(ball) * rng.uniform(-1.0, 1.0)) for c, ball in pairs]
        changed.append(Equation(np.array(changes, dtype=object).reshape(table.shape), i, j))
    return changed


def _spread(ball: Any) -> float:
    """The radius of a ball; none of an integer."""
    return 0.0 if isinstance(ball, int) else float(ball.rad())


def _is_zero_to_rounding(polynomial: fmpz_poly, noisy: fmpz_poly) -> bool:
    """Return True if a resultant is zero, or of the size that rounding gives zero."""
    return not polynomial or compute_height(polynomial - noisy) * LOUD > compute_height(polynomial)


def _solve(square: _SquareEncloser, order: tuple[int, ...], eliminant: Eliminant, farthest: float) -> SolutionSet:
    """The solutions over the roots of an eliminant."""
    from flint import ctx, fmpz_poly

    half_angles = square.part.round
    kept_round = half_angles[order[0]]
    polynomial, extraneous = make_primitive(eliminant.polynomial), 0
    at_infinity = kept_round and polynomial.degree() < eliminant.bound
    if kept_round:
        polynomial, pairs = divide_out(polynomial, fmpz_poly([1, 0, 1]))
        extraneous = 2 * pairs
    roots = square.all_of(
        find_all_solutions(polynomial, lambda x, m: _solve_over(x, m, order, eliminant, half_angles)),
        polynomial.degree(),
        farthest,
    )
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        surely = all(
            square.is_proved_complex(values)
            for values in roots.values
            if DOUBLE_SOLUTION_DISTANCE_TOL / 2 <= compute_off_real(values) < NEARLY_REAL_ROOT_TOL
        )
    return replace(roots, extraneous=extraneous, complete=roots.complete and not at_infinity and surely)


def find_all_solutions(polynomial: fmpz_poly, over: Callable[[Any, int], list[Solution]]) -> list[Solution]:
    """The solutions ``over`` each complex root and its multiplicity, as precise as it takes to have them all."""
    from flint import ctx

    resolved: list[Solution] = []
    precision = ROOT_ISOLATION_BITS_COUNT
    for _ in range(PRECISION_DOUBLINGS_MAX):
        with ctx.workprec(precision):
            resolved = [solution for x, m in _find_roots(polynomial) for solution in over(x, m)]
            if sum(m for _, m in resolved) == polynomial.degree():
                break
        precision *= 2
    return resolved


def _solve_over(
    x: Any, multiplicity: int, order: tuple[int, ...], eliminant: Eliminant, half_angles: Sequence[bool]
) -> list[Solution]:
    """Return the solutions over a root, each with its multiplicity; none if they cannot be separated from infinity or
    from each other."""
    single = _restore_order(order, (x, *eliminant.others(x)))
    if _has_finite_values(single, half_angles):
        return [(single, multiplicity)]
    several = [_restore_order(order, (x, *others)) for others in eliminant.several(x) or ()]
    if len(several) != multiplicity or not all(_has_finite_values(values, half_angles) for values in several):
        return []
    return [(values, 1) for values in several]


def _find_roots(polynomial: fmpz_poly) -> list[tuple[Any, int]]:
    """Balls about the roots of an integer polynomial, each with one root alone, and multiplicities."""
    roots: Any = polynomial.complex_roots() if polynomial.degree() > 0 else []
    return [(x, int(m)) for x, m in roots]


def _restore_order(order: tuple[int, ...], values: Sequence[Any]) -> list[Any]:
    """Values in the order of the unknowns."""
    restored: list[Any] = [None] * len(order)
    for place, value in zip(order, values, strict=True):
        restored[place] = value
    return restored


def _has_finite_values(values: Sequence[Any], half_angles: Sequence[bool]) -> bool:
    """Return True if all values are finite and known well, and none a half-angle tangent at which a circle is at
    infinity."""
    return all(
        is_sharp(v) and not (half and (1 + v * v).contains(0)) for v, half in zip(values, half_angles, strict=True)
    )


def is_sharp(value: Any) -> bool:
    """Return True if a ball is so small that it separates solutions on both sides of a denominator's zero."""
    return bool(value.is_finite()) and float(value.rad()) <= SHARP_ROOT * (1.0 + float(abs(value.mid())))


def is_real(values: Sequence[Any]) -> bool:
    """Return True if a solution is real: it is where the root is and the other unknowns are rational in it or roots of
    it."""
    return all(v.imag.is_zero() for v in values)


def compute_off_real(values: Sequence[Any]) -> float:
    """Return the distance of a solution from real ones, relative to its unknowns."""
    return max(abs(float(v.imag)) / (1.0 + abs(float(v.real))) for v in values)


def _is_almost_real(values: Sequence[Any]) -> bool:
    """Return True if a solution is the first of a conjugate pair that nearly is one real solution."""
    first = next((float(v.imag) for v in values if not v.imag.is_zero()), 0.0)
    return compute_off_real(values) < DOUBLE_SOLUTION_DISTANCE_TOL / 2 and first > 0


@dataclass(frozen=True, eq=False)
class SolutionEncloser(ABC):
    """Enclosures of the solutions of a choice of legs: its equations, of the rounded input and of the exact one."""

    balls: Within
    equations: Sequence[Polynomial]
    thick: Sequence[Polynomial]
    method: ClassVar[str]

    @abstractmethod
    def distance(self, values: Sequence[Any]) -> float:
        """Return the distance of the points of a solution, complex ones too (sizes)."""

    @abstractmethod
    def parameters(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """Return balls of the values at a root, for balls of the unknowns."""

    @abstractmethod
    def misses(self, own: Sequence[Any], values: Sequence[Any]) -> tuple[float, ...]:
        """Return how far the points at balls of the parameters ``own`` and of the unknowns are from those at the middle
        (m)."""

    def all_of(self, solutions: Sequence[Solution], degree: int, farthest: float) -> SolutionSet:
        """All solutions together, the real ones enclosed, without those beyond ``farthest`` (sizes); complete if each
        root of ``degree`` has its solution and each real one is enclosed or multiple."""
        from flint import ctx

        resolved, far, undecided = _select_nearer(solutions, self.distance, farthest)
        with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
            real = tuple(self._enclose([v.real for v in values], m) for values, m in resolved if is_real(values))
            real += tuple(self._middle(values) for values, _ in resolved if _is_almost_real(values))
        count, values = sum(m for _, m in resolved), tuple(values for values, _ in resolved)
        near = set(map(id, values))
        distant = tuple(values for values, _ in solutions if id(values) not in near)
        proved = all(root.real and (root.unique or root.multiplicity > 1) for root in real)
        return SolutionSet(
            count,
            real,
            degree - far,
            complete=count == degree - far and proved and not undecided,
            closest=_measure_closest(values),
            method=self.method,
            far=far,
            undecided=undecided,
            values=values,
            distant=distant,
        )

    def _enclose(self, start: Sequence[Any], multiplicity: int) -> RealSolution:
        """The box of a real solution: for the exact input where that can be proved, else for the rounded one."""
        for equations in (self.thick, self.equations):
            box = enclose_zero(equations, start)
            if box is not None:
                parameters = self.parameters(box)
                return RealSolution(parameters, self.misses(parameters, box), 1, True, equations is self.thick)
        parameters = self.parameters(start)
        return RealSolution(parameters, self.misses(parameters, start), multiplicity, False, False)

    def _middle(self, values: Sequence[Any]) -> RealSolution:
        """The real part of a conjugate pair, and how far its points are from there at most."""
        parameters = self.parameters([v.real.mid() for v in values])
        wide = [v.real + v.imag.union(-v.imag) for v in values]
        return RealSolution(parameters, self.misses(parameters, wide), 2, False, False, False)


@dataclass(frozen=True, eq=False)
class _SquareEncloser(SolutionEncloser):
    """A square system with circles counted from ``turn``."""

    part: SquareSystem
    turn: float
    conics: Sequence[Conic]
    """The unknowns' curves in balls."""
    method = "exact resultant"

    def is_proved_complex(self, values: Sequence[Any]) -> bool:
        """Return True if a complex solution is proved to be no real one for all input in the balls."""
        box = enclose_zero(self.thick, values)
        return box is not None and any(not v.imag.contains(0) for v in box)

    @property
    def frame(self) -> WorkingFrame:
        """The working frame."""
        assert self.part.frame is not None
        return self.part.frame

    @cached_property
    def _radii(self) -> list[list[float]]:
        """Return, for each unknown's curve, how far the exact coefficients of t⁰, t¹, t² can be from the rounded ones
        (m)."""
        return [
            [
                math.hypot(*(float(ball.rad()) for ball in row if not isinstance(ball, int))) * self.frame.size / UNIT
                for row in path.N
            ]
            for path in self.conics
        ]

    def distance(self, values: Sequence[Any]) -> float:
        distances = []
        for curve, t in zip(self.part.unknowns, values, strict=True):
            z = complex(t)
            distances.append(abs(z) if not isinstance(curve, Circle) else max(1.0, abs(z)) ** 2 / abs(1.0 + z * z))
        return max(distances)

    def parameters(self, values: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(
            convert_parameter(curve, self.frame, origin, t)
            for curve, origin, t in zip(self.part.unknowns, self.part.turns(self.turn), values, strict=True)
        )

    def misses(self, own: Sequence[Any], values: Sequence[Any]) -> tuple[float, ...]:
        if self.part.exact is not None:
            return tuple(
                self._miss(*item)
                for item in zip(self.part.unknowns, own, values, self.part.exact(self.balls), strict=True)
            )
        misses = []
        for curve, s, t, (r0, r1, r2) in zip(self.part.unknowns, own, values, self._radii, strict=True):
            ball, size = float(s.rad()), abs(float(t.mid())) + float(t.rad())
            moved, w = (ball * curve.radius, 1.0 + size * size) if isinstance(curve, Circle) else (ball, 1.0)
            misses.append(moved + (r0 + size * (r1 + size * r2)) / w)
        return tuple(misses)

    def _miss(self, curve: Curve, s: Any, t: Any, path: Conic) -> float:
        """As above, for a point that is none of the curve's own."""
        centre, powers = self.frame.point(curve.at(float(s.mid()))), np.array([1, t, t * t], dtype=object)
        w = (powers @ path.w) * UNIT
        return self.frame.size * math.hypot(
            *(float((x / w - c).abs_upper()) for x, c in zip(powers @ path.N, centre.tolist(), strict=True))
        )


def _select_nearer(
    solutions: Sequence[Solution], distance: Callable[[Sequence[Any]], float], farthest: float
) -> tuple[list[Solution], int, bool]:
    """The solutions within a distance (sizes), which are not at infinity but for rounding, how many are beyond, and
    whether that is not clear; ``distance`` gives that of a solution (sizes)."""
    if not np.isfinite(farthest):
        return list(solutions), 0, False
    placed = [(distance(values), (values, m)) for values, m in solutions]
    beyond = [(size, m) for size, (_, m) in placed if size > farthest]
    near = [(size, solution) for size, solution in placed if size <= farthest]
    nearest_beyond = min((size for size, _ in beyond), default=np.inf)
    if max((size for size, _ in near), default=0.0) * RANK_GAP_MIN > nearest_beyond:
        return list(solutions), 0, True
    return [solution for _, solution in near], sum(m for _, m in beyond), False


def _measure_closest(solutions: Sequence[Sequence[Any]]) -> float:
    """The smallest distance between two solutions, each unknown relative to its size."""
    values = np.array([[complex(v) for v in solution] for solution in solutions])
    if len(values) < 2:
        return np.inf
    apart = np.abs(values[:, None] - values[None]) / (1.0 + np.abs(values))[None]
    return float((apart.max(axis=2) + np.diag([np.inf] * len(values))).min())


def has_nearly_double_solution(roots: SolutionSet) -> bool:
    """Return True if two solutions coincide, or nearly: the pose is singular."""
    return roots.closest < DOUBLE_SOLUTION_DISTANCE_TOL or any(root.multiplicity > 1 for root in roots.real)
