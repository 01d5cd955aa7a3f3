"""Polynomials of degree two in each unknown: elimination to one unknown, and enclosures of their solutions.

A *table* f, shape (3, 3), is the polynomial Σ f[i, j] xⁱ yʲ. The resultant of two quadratics in y is

    (a₂b₀ − a₀b₂)² − (a₂b₁ − a₁b₂)(a₁b₀ − a₀b₁),   and their common root   y = −(a₂b₀ − a₀b₂) / (a₂b₁ − a₁b₂),

so that every root x at which the denominators do not vanish carries exactly one solution, real if x is. At a root with
several solutions, as symmetry makes them, the quadratics are solved one by one and what fits the last is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from flint import fmpz, fmpz_poly


class Equation(NamedTuple):
    """Σ table[a, b] x_iᵃ x_jᵇ = 0; ``table`` has shape (3, 3); integers or balls."""

    table: Any
    i: int
    j: int

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return _list_powers(x[self.i]) @ self.table @ _list_powers(x[self.j])

    def slopes(self, x: Sequence[Any]) -> list[Any]:
        """The derivative by each unknown at x."""
        left, right = _list_powers(x[self.i]), _list_powers(x[self.j])
        row: list[Any] = [0.0] * len(x)
        row[self.i] = _list_slopes(x[self.i]) @ (self.table @ right)
        row[self.j] = row[self.j] + left @ self.table @ _list_slopes(x[self.j])
        return row


class Quadric(NamedTuple):
    """xᵀ A x = 0 with x = (1, x₁ … xₙ); ``A`` has shape (n + 1, n + 1); integers or balls."""

    A: Any

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        ends = np.array([1, *x], dtype=object)
        return ends @ self.A @ ends

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        ends = np.array([1, *x], dtype=object)
        return (self.A @ ends + ends @ self.A)[1:]


def _list_powers(x: Any) -> Any:
    return np.array([1, x, x * x], dtype=object)


def _list_slopes(x: Any) -> Any:
    return np.array([0, 1, 2 * x], dtype=object)


Table = Any
"""An object array of shape (3, 3): coefficients of xⁱ yʲ, integers (exact) or balls."""


@dataclass(frozen=True, eq=False)
class Eliminant:
    """The polynomial in the kept unknown, and the other unknowns at a root.

    ``bound`` is the degree that it has when no solution lies at infinity. ``others`` gives, for a ball about a root,
    the balls of the other unknowns; where a denominator may be zero these are not finite. ``several`` gives for such a
    root all that the other unknowns can be, or None where that is not known.
    """

    polynomial: fmpz_poly
    bound: int
    others: Callable[[Any], tuple[Any, ...]]
    several: Callable[[Any], list[tuple[Any, ...]] | None] = lambda x: None


def make_univariate(f: Sequence[int]) -> Eliminant:
    """f(x) = 0: nothing to eliminate."""
    from flint import fmpz_poly

    return Eliminant(fmpz_poly([int(c) for c in f]), 2, lambda x: ())


def pair(f: Table, g: Table) -> Eliminant:
    """f(x, y) = g(x, y) = 0 with y eliminated: degree 8, or 4 where one of them is free of x."""
    a, b = _collect_in_second(f), _collect_in_second(g)
    top, low, mixed = a[2] * b[1] - a[1] * b[2], a[2] * b[0] - a[0] * b[2], a[1] * b[0] - a[0] * b[1]

    def others(x: Any) -> tuple[Any, ...]:
        return (_divide(-low(x), top(x)),)

    def several(x: Any) -> list[tuple[Any, ...]] | None:
        ys = _solve_quadratic([p(x) for p in a])
        last = [p(x) for p in b]
        return None if ys is None else [(y,) for y in ys if (last[0] + y * (last[1] + y * last[2])).contains(0)]

    bound = 2 * sum(max((p.degree() for p in coefficients), default=0) for coefficients in (a, b))
    return Eliminant(low * low - top * mixed, bound, others, several)


def eliminate_cycle(f: Table, g: Table, h: Table) -> Eliminant:
    """f(x, y) = g(y, z) = h(z, x) = 0 with y and z eliminated: degree 16.

    y is eliminated from f and g, which leaves degree four in z; h = a z² + b z + c brings that down to R₁ z + R₀,
    and the product of its values at the two roots of h is the eliminant.
    """
    a, b = _collect_in_second(f), _collect_in_second(g.T)
    c0, c1, c2 = _collect_in_second(h.T)
    # 1: Res_y(f, g), of degree four in z, by the formula above
    quartic = _eliminate_third(a, b)
    # 2: modulo h = c₂ z² + c₁ z + c₀ that is (R₁ z + R₀) / c₂³
    R0, R1, leading = _reduce_quartic(quartic, (c0, c1, c2))
    # 3: c₂ (R₁ z₁ + R₀) (R₁ z₂ + R₀) at the roots of h, by z₁ + z₂ = −c₁/c₂ and z₁ z₂ = c₀/c₂; c₂³ is a factor
    norm = R1 * R1 * c0 - R1 * R0 * c1 + R0 * R0 * c2
    polynomial = norm if not norm else _divide_exactly(norm, leading)

    def others(x: Any) -> tuple[Any, ...]:
        z = _divide(-R0(x), R1(x))
        ax, bz = [p(x) for p in a], [p(z) for p in b]
        y = _divide(ax[0] * bz[2] - ax[2] * bz[0], ax[2] * bz[1] - ax[1] * bz[2])
        return y, z

    def several(x: Any) -> list[tuple[Any, ...]] | None:
        ys, zs = _solve_quadratic([p(x) for p in a]), _solve_quadratic([p(x) for p in (c0, c1, c2)])
        if ys is None or zs is None:
            return None
        return [(y, z) for y in ys for z in zs if sum(q(z) * y**k for k, q in enumerate(b)).contains(0)]

    return Eliminant(polynomial, 16, others, several)


def divide_out(polynomial: fmpz_poly, factor: fmpz_poly) -> tuple[fmpz_poly, int]:
    """The polynomial divided by a factor as often as that divides it, and how often."""
    times = 0
    while polynomial and polynomial.degree() >= factor.degree():
        quotient, rest = divmod(polynomial, factor)
        if rest:
            break
        polynomial, times = quotient, times + 1
    return polynomial, times


def make_primitive(polynomial: fmpz_poly) -> fmpz_poly:
    """The polynomial without its content."""
    from flint import fmpz_poly

    return polynomial // fmpz_poly([polynomial.content()]) if polynomial else polynomial


def compute_height(polynomial: fmpz_poly) -> fmpz:
    """The largest absolute value of a coefficient."""
    from flint import fmpz

    return max((abs(c) for c in polynomial.coeffs()), default=fmpz(0))


def _collect_in_second(table: Table) -> list[fmpz_poly]:
    """The coefficients of y⁰, y¹, y², as polynomials in x."""
    from flint import fmpz_poly

    return [fmpz_poly([int(c) for c in column]) for column in table.T]


def _eliminate_third(a: Sequence[fmpz_poly], b: Sequence[fmpz_poly]) -> list[fmpz_poly]:
    """The resultant in y of Σ aₖ(x) yᵏ and Σ bₖ(z) yᵏ: coefficients of z⁰ … z⁴, as polynomials in x."""
    from flint import fmpz_poly

    terms = [
        (a[2] * a[2], b[0] * b[0]),
        (a[0] * a[0], b[2] * b[2]),
        (-a[1] * a[2], b[0] * b[1]),
        (-a[0] * a[1], b[1] * b[2]),
        (a[0] * a[2], b[1] * b[1] - 2 * b[0] * b[2]),
        (a[1] * a[1], b[0] * b[2]),
    ]
    return [sum((p * q[k] for p, q in terms), fmpz_poly()) for k in range(5)]


def _reduce_quartic(quartic: Sequence[fmpz_poly], c: Sequence[fmpz_poly]) -> tuple[fmpz_poly, fmpz_poly, fmpz_poly]:
    """R₀, R₁ with c₂³ Σ hₖ zᵏ ≡ R₁ z + R₀ modulo c₂ z² + c₁ z + c₀, and what the norm of that is too large by: c₂³."""
    from flint import fmpz_poly

    powers = [(fmpz_poly([1]), fmpz_poly()), (fmpz_poly(), fmpz_poly([1]))]
    for _ in range(3):
        low, high = powers[-1]
        powers.append((-high * c[0], c[2] * low - high * c[1]))
    scale = [c[2] ** 3, c[2] ** 3, c[2] ** 2, c[2], fmpz_poly([1])]
    R0 = sum((h * s * low for h, s, (low, _) in zip(quartic, scale, powers, strict=True)), fmpz_poly())
    R1 = sum((h * s * high for h, s, (_, high) in zip(quartic, scale, powers, strict=True)), fmpz_poly())
    return R0, R1, c[2] ** 3


def _divide_exactly(norm: fmpz_poly, divisor: fmpz_poly) -> fmpz_poly:
    quotient, rest = divmod(norm, divisor)
    assert not rest, "a norm is divisible by the power of the leading coefficient that scaled it"
    return quotient


def _solve_quadratic(c: Sequence[Any]) -> list[Any] | None:
    """Return the two roots of c₂ y² + c₁ y + c₀ as disjoint balls; None if they cannot be separated, or are not
    finite."""
    below = c[1] * c[1] - 4 * c[2] * c[0]
    if c[2].contains(0) or below.contains(0):
        return None
    root = below.sqrt()
    return [(-c[1] + sign * root) / (2 * c[2]) for sign in (1, -1)]


def _divide(numerator: Any, denominator: Any) -> Any:
    """The quotient of two balls; not finite where the denominator may be zero."""
    return numerator / (denominator if not denominator.contains(0) else denominator * 0)
