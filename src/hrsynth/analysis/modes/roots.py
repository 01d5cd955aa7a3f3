"""All solutions of a square system: each complex one counted, each real one enclosed.

The resultant is exact, so every solution lies over one of its roots, which are isolated; a root at which the
other unknowns are rational functions of it carries exactly one. Where a denominator vanishes, another unknown is kept.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...tolerances import NEARLY_DOUBLE
from .algebra import Eliminant, cycle, height, pair, primitive, univariate, without
from .certify import Equation, Polynomial, krawczyk
from .conics import Balls, parameter
from .squares import Square

if TYPE_CHECKING:
    from flint import fmpz_poly

PRECISION = 128
"""Bits with which roots are isolated first."""

PRECISIONS = 4
"""How often the precision is doubled before another unknown is kept."""

STARTS = (0.0, 1.1, -0.9)
"""Origins of the angles (rad) that are tried until none of the solutions lies at t = ∞."""

Solution = tuple[list[Any], int]
"""Balls of all unknowns, and the multiplicity."""

LOUD = 1 << 16
"""A resultant counts as zero if changes of the input in the last bit change it by more than this part of its size."""


@dataclass(frozen=True, eq=False)
class Root:
    """A real solution: balls of the curves' parameters (m, rad), the largest radius (sizes, rad), its multiplicity.

    ``unique``: its enclosure is proved to hold exactly one; ``thick``: for the exact input, not only the rounded one;
    not ``real``: the middle of two complex ones so close to each other that rounding decides which they are.
    """

    parameters: tuple[Any, ...]
    radius: float
    multiplicity: int
    unique: bool
    thick: bool
    real: bool = True


@dataclass(frozen=True, eq=False)
class Roots:
    """All solutions of a square system; ``complex`` counts them with multiplicity, ``values`` are those of all.

    ``degree`` is that of the polynomial that was isolated, ``extraneous`` how many roots of it lie at infinity.
    ``continuum`` says that all such polynomials vanish, ``closest`` is the smallest distance between two solutions.
    """

    complex: int = 0
    real: tuple[Root, ...] = ()
    degree: int = 0
    extraneous: int = 0
    complete: bool = True
    continuum: bool = False
    closest: float = np.inf
    method: str = "exact resultant"


def solve_square(square: Square) -> Roots:
    """All solutions of a square system."""
    from flint import ctx

    if not square.unknowns:
        return Roots(1, (Root((), 0.0, 1, True, True),))
    fallback = Roots(complete=False)
    for turn in STARTS:
        equations = square.equations(turn)
        with ctx.workprec(PRECISION):
            thick = square.equations(turn, Balls)
        noisy = _perturbed(equations, thick)
        zeros = 0
        for (order, eliminant), (_, other) in zip(_eliminants(equations), _eliminants(noisy), strict=True):
            if _vanishes(eliminant.polynomial, other.polynomial):
                zeros += 1
                continue
            found = _roots(square, turn, order, eliminant, equations, thick)
            if found.complete:
                return found
            fallback = max(fallback, found, key=lambda each: each.complex)
        if zeros == max(1, len(square.unknowns)):
            return Roots(complete=False, continuum=True)
    return fallback


def _eliminants(equations: Sequence[Equation]) -> Iterator[tuple[tuple[int, ...], Eliminant]]:
    """The eliminants with each unknown kept in turn; the order of the unknowns, the kept one first."""
    tables = [equation.table for equation in equations]
    if len(tables) == 1:
        yield (0,), univariate(tables[0][:, 0])
    elif len(tables) == 2:
        f, g = tables
        yield (0, 1), pair(f, g)
        yield (1, 0), pair(f.T, g.T)
    else:
        f, g, h = tables
        yield (0, 1, 2), cycle(f, g, h)
        yield (1, 2, 0), cycle(g, h, f)
        yield (2, 0, 1), cycle(h, f, g)


def _perturbed(equations: Sequence[Equation], thick: Sequence[Equation]) -> list[Equation]:
    """The equations with each coefficient changed at random by what the rounding of the input allows."""
    rng = random.Random(0)
    found = []
    for (table, i, j), (balls, _, _) in zip(equations, thick, strict=True):
        pairs = zip(table.flat, balls.flat, strict=True)
        changes = [c + int(_spread(ball) * rng.uniform(-1.0, 1.0)) for c, ball in pairs]
        found.append(Equation(np.array(changes, dtype=object).reshape(table.shape), i, j))
    return found


def _spread(ball: Any) -> float:
    """The radius of a ball; none of an integer."""
    return 0.0 if isinstance(ball, int) else float(ball.rad())


def _vanishes(polynomial: fmpz_poly, noisy: fmpz_poly) -> bool:
    """Whether a resultant is zero, or of the size of what rounding makes of zero."""
    return not polynomial or height(polynomial - noisy) * LOUD > height(polynomial)


def _roots(square: Square, turn: float, order: tuple[int, ...], eliminant: Eliminant, equations: Sequence[Equation],
           thick: Sequence[Equation]) -> Roots:
    """The solutions over the roots of an eliminant."""
    from flint import ctx, fmpz_poly

    kept_round = square.round[order[0]]
    polynomial, extraneous = primitive(eliminant.polynomial), 0
    at_infinity = kept_round and polynomial.degree() < eliminant.bound
    if kept_round:
        polynomial, pairs = without(polynomial, fmpz_poly([1, 0, 1]))
        extraneous = 2 * pairs
    resolved = all_solutions(polynomial, lambda x, m: _over(x, m, order, eliminant, square.round))
    with ctx.workprec(PRECISION):
        real = tuple(_enclosed(square, turn, equations, thick, [v.real for v in values], m)
                     for values, m in resolved if is_real(values))
        real += tuple(_middle(square, turn, values) for values, m in resolved if almost_real(values))
    found = gathered(polynomial.degree(), resolved, real)
    return replace(found, extraneous=extraneous, complete=found.complete and not at_infinity)


def all_solutions(polynomial: fmpz_poly, over: Callable[[Any, int], list[Solution]]) -> list[Solution]:
    """The solutions ``over`` each complex root and its multiplicity, as precise as it takes to have them all."""
    from flint import ctx

    precision = PRECISION
    for _ in range(PRECISIONS):
        with ctx.workprec(precision):
            resolved = [each for x, m in _isolated(polynomial) for each in over(x, m)]
            if sum(m for _, m in resolved) == polynomial.degree():
                break
        precision *= 2
    return resolved


def gathered(degree: int, resolved: Sequence[Solution], real: tuple[Root, ...], method: str = Roots.method) -> Roots:
    """All solutions together; complete if each root has its solution and each real one is enclosed or multiple."""
    count = sum(m for _, m in resolved)
    proved = all(root.real and (root.unique or root.multiplicity > 1) for root in real)
    return Roots(count, real, degree, complete=count == degree and proved,
                 closest=_closest([values for values, _ in resolved]), method=method)


def _over(x: Any, multiplicity: int, order: tuple[int, ...], eliminant: Eliminant, half_angles: Sequence[bool]
          ) -> list[Solution]:
    """The solutions over a root, each with its multiplicity; none where they cannot be told from infinity or from each
    other."""
    one = _restored(order, (x, *eliminant.others(x)))
    if _finite(one, half_angles):
        return [(one, multiplicity)]
    found = [_restored(order, (x, *others)) for others in eliminant.several(x) or ()]
    if len(found) != multiplicity or not all(_finite(values, half_angles) for values in found):
        return []
    return [(values, 1) for values in found]


def _isolated(polynomial: fmpz_poly) -> list[tuple[Any, int]]:
    """Balls about the roots of an integer polynomial, each with one root alone, and multiplicities."""
    roots: Any = polynomial.complex_roots() if polynomial.degree() > 0 else []
    return [(x, int(m)) for x, m in roots]


def _restored(order: tuple[int, ...], values: Sequence[Any]) -> list[Any]:
    """Values in the order of the unknowns."""
    found: list[Any] = [None] * len(order)
    for place, value in zip(order, values, strict=True):
        found[place] = value
    return found


def _finite(values: Sequence[Any], half_angles: Sequence[bool]) -> bool:
    """Whether all values are finite, and none a half-angle tangent at which a circle is at infinity."""
    return all(v.is_finite() and not (half and (1 + v * v).contains(0))
               for v, half in zip(values, half_angles, strict=True))


def is_real(values: Sequence[Any]) -> bool:
    """Whether a solution is real: it is where the root is and the other unknowns are rational in it or roots of it."""
    return all(v.imag.is_zero() for v in values)


def almost_real(values: Sequence[Any]) -> bool:
    """Whether a solution is the first of a conjugate pair that nearly is one real solution."""
    size = max(abs(float(v.imag)) / (1.0 + abs(float(v.real))) for v in values)
    return 0.0 < size < NEARLY_DOUBLE / 2 and next(float(v.imag) for v in values if not v.imag.is_zero()) > 0


def _middle(square: Square, turn: float, values: Sequence[Any]) -> Root:
    """The real part of a conjugate pair, with its imaginary part for a radius."""
    assert square.frame is not None
    own = tuple(parameter(curve, square.frame, origin, v.real.mid())
                for curve, origin, v in zip(square.unknowns, square.turns(turn), values, strict=True))
    return Root(own, max(2.0 * abs(float(v.imag)) for v in values), 2, False, False, False)


def _enclosed(square: Square, turn: float, equations: Sequence[Equation], thick: Sequence[Equation],
              start: Sequence[Any], multiplicity: int) -> Root:
    """The box of a real solution: for the exact input where that can be proved, else for the rounded one."""
    assert square.frame is not None
    values, unique, wide = boxed(equations, thick, start, multiplicity)
    own = tuple(parameter(curve, square.frame, origin, t)
                for curve, origin, t in zip(square.unknowns, square.turns(turn), values, strict=True))
    radius = max(float(each.rad()) / (1.0 if half else square.frame.size)
                 for each, half in zip(own, square.round, strict=True))
    return Root(own, radius, multiplicity, unique, wide)


def boxed(equations: Sequence[Polynomial], thick: Sequence[Polynomial], start: Sequence[Any], multiplicity: int
          ) -> tuple[list[Any], bool, bool]:
    """The box about a simple solution, whether it holds exactly one, and whether it does so for the exact input."""
    if multiplicity == 1:
        box, wide = krawczyk(thick, start), True
        if box is None:
            box, wide = krawczyk(equations, start), False
        if box is not None:
            return box, True, wide
    return list(start), False, False


def _closest(solutions: Sequence[Sequence[Any]]) -> float:
    """The smallest distance between two solutions, each unknown relative to its size."""
    values = np.array([[complex(v) for v in each] for each in solutions])
    if len(values) < 2:
        return np.inf
    apart = np.abs(values[:, None] - values[None]) / (1.0 + np.abs(values))[None]
    return float((apart.max(axis=2) + np.diag([np.inf] * len(values))).min())


def nearly_double(roots: Roots) -> bool:
    """Whether two solutions coincide, or nearly: the pose is singular."""
    return roots.closest < NEARLY_DOUBLE or any(root.multiplicity > 1 for root in roots.real)
