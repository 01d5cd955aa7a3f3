"""Newton's method on the checker's equations, far more precise than the boxes that it is for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from .verify_certificate import CertificateRejection, slope

SOLUTION_BITS_COUNT = 320
"""Bits with which solutions are refined."""
SOLUTION_NEWTON_STEPS_COUNT = 7
"""Newton's steps from about the solution."""
GRAIN = 1 << 140
"""Middles of boxes are multiples of one over this."""
DERIVATIVE_CONDITION_MAX = 1e10
"""Condition number of the derivatives above which floats do not give their inverse (the checker needs a good one
alone)."""

Polynomial = Mapping[tuple[int, ...], Any]


class ScaledEquations:
    """Equations, each over the power of two that the checker takes, and their derivatives."""

    def __init__(self, equations: Sequence[Polynomial]) -> None:
        from flint import acb, ctx, fmpq

        n = len(equations)
        scales = [Fraction(1, 2 ** max(map(abs, p.values())).bit_length()) for p in equations]
        flat = [{e: c * s for e, c in p.items()} for p, s in zip(equations, scales, strict=True)]
        self.degree = max(k for p in flat for e in p for k in e)
        with ctx.workprec(SOLUTION_BITS_COUNT):
            self.rows = [
                [
                    [
                        (acb(fmpq(c.numerator, c.denominator)), [(i, k) for i, k in enumerate(e) if k])
                        for e, c in p.items()
                    ]
                    for p in (p, *(slope(p, j) for j in range(n)))
                ]
                for p in flat
            ]

    def step(self, x: Sequence[Any], steps: int) -> tuple[list[Any], Any]:
        """x (n,) after some of Newton's steps, and the derivatives there; raises ``ZeroDivisionError``."""
        from flint import acb, acb_mat

        for left in range(steps, -1, -1):
            powers = [[acb(1), v] for v in x]
            for each in powers:
                for _ in range(1, self.degree):
                    each.append(each[-1] * each[1])
            F, *J = ([_total(row[k], powers) for row in self.rows] for k in range(len(x) + 1))
            slopes = acb_mat([list(row) for row in zip(*J, strict=True)])
            if left:
                step = slopes.solve(acb_mat(len(x), 1, F))
                x = [(v - s).mid() for v, s in zip(x, step.entries(), strict=True)]
        return list(x), slopes

    def near(self, start: Sequence[complex], steps: int) -> list[Any]:
        """A solution near a start; raises ``ZeroDivisionError``."""
        from flint import acb, ctx

        with ctx.workprec(SOLUTION_BITS_COUNT):
            return self.step([acb(z).mid() for z in start], steps)[0]

    def box(self, start: Sequence[Any], real: bool) -> tuple[Any, Any]:
        """A solution near a start, as pairs of fractions, and about the inverse of the derivatives there."""
        from flint import acb, ctx

        with ctx.workprec(SOLUTION_BITS_COUNT):
            try:
                x, J = self.step([acb(z.real) if real else acb(z).mid() for z in start], SOLUTION_NEWTON_STEPS_COUNT)
                inverse = J.inv()
            except ZeroDivisionError:
                raise CertificateRejection("a solution at which the equations are not independent") from None
            rough = np.array([[complex(v) for v in row] for row in J.table()])
            about = fraction if np.linalg.cond(rough) > DERIVATIVE_CONDITION_MAX else _float
            middle = [[fraction(v.real), Fraction(0) if real else fraction(v.imag)] for v in x]
            return middle, [[[about(v.real), about(v.imag)] for v in row] for row in inverse.table()]


def _total(terms: Any, powers: Any) -> Any:
    from flint import acb

    total = acb(0)
    for c, e in terms:
        for i, k in e:
            c = c * powers[i][k]
        total += c
    return total


def fraction(ball: Any) -> Fraction:
    """The middle of a real ball, to one over ``GRAIN``."""
    mantissa, exponent = ball.mid().man_exp()
    exact = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return Fraction(round(exact * GRAIN), GRAIN)


def _float(ball: Any) -> Fraction:
    """The middle of a real ball, to a float."""
    return Fraction(float(ball.mid()))
