"""Resultants against SymPy's, the enclosures against what they must and must not prove, and bad input."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from flint import arb, ctx

from hrsynth.errors import BadRequest
from hrsynth.geometry.loci import Circle, Curve, Line, Point
from hrsynth.solving.krawczyk import enclose_zero
from hrsynth.solving.platform.polynomials import Equation, eliminate_cycle, pair
from hrsynth.solving.platform.rigid import Planar, Spatial

x, y, z = sympy.symbols("x y z")


def table(rng: np.random.Generator) -> np.ndarray:
    return np.array([[int(c) for c in row] for row in rng.integers(-9, 10, size=(3, 3))], dtype=object)


def polynomial(coefficients: np.ndarray, u: sympy.Symbol, v: sympy.Symbol) -> sympy.Expr:
    return sum(coefficients[i, j] * u**i * v**j for i in range(3) for j in range(3))


def proportional(found, wanted: sympy.Expr) -> bool:
    ours = sympy.Poly([int(c) for c in reversed(found.coeffs())], x)
    return (ours.primitive()[1] - sympy.Poly(wanted, x).primitive()[1]).is_zero or (
        ours.primitive()[1] + sympy.Poly(wanted, x).primitive()[1]
    ).is_zero


@pytest.mark.parametrize("seed", range(5))
def test_eliminants_are_resultants(seed: int):
    rng = np.random.default_rng(seed)
    f, g, h = table(rng), table(rng), table(rng)
    assert proportional(pair(f, g).polynomial, sympy.resultant(polynomial(f, x, y), polynomial(g, x, y), y))
    inner = sympy.expand(sympy.resultant(polynomial(f, x, y), polynomial(g, y, z), y))
    assert proportional(eliminate_cycle(f, g, h).polynomial, sympy.resultant(inner, polynomial(h, z, x), z))


@pytest.mark.parametrize("seed", range(5))
def test_the_other_unknowns_solve_all_equations(seed: int):
    rng = np.random.default_rng(seed)
    f, g, h = table(rng), table(rng), table(rng)
    with ctx.workprec(200):
        eliminant = eliminate_cycle(f, g, h)
        roots = eliminant.polynomial.complex_roots()
        assert len(roots) == 16
        for u, _ in roots:
            v, w = eliminant.others(u)
            for t, a, b in ((f, u, v), (g, v, w), (h, w, u)):
                value = sum(t[i, j] * a**i * b**j for i in range(3) for j in range(3))
                assert value.contains(0)
                assert float(value.rad()) < 1e-20


def circle_and_line(squared: float) -> list[Equation]:
    """x² + y² = ``squared`` and x = y."""
    one = np.array([[arb(-squared), arb(0), arb(1)], [arb(0)] * 3, [arb(1), arb(0), arb(0)]], dtype=object)
    two = np.array([[arb(0), arb(-1), arb(0)], [arb(1), arb(0), arb(0)], [arb(0)] * 3], dtype=object)
    return [Equation(one, 0, 1), Equation(two, 0, 1)]


def test_a_simple_solution_is_enclosed():
    with ctx.workprec(128):
        box = enclose_zero(circle_and_line(2.0), [arb(1.0000001), arb(0.9999999)])
        assert box is not None
        assert all(each.contains(1) and each.rad() < 1e-12 for each in box)


def test_an_enclosure_holds_for_all_coefficients_in_their_balls():
    with ctx.workprec(128):
        equations = circle_and_line(2.0)
        equations[0].table[0, 0] = arb(-2, 1e-3)
        box = enclose_zero(equations, [arb(1), arb(1)])
        assert box is not None
        assert all(each.contains(arb(1.0004).sqrt()) and each.contains(arb(0.9996).sqrt()) for each in box)


def test_no_enclosure_where_there_is_no_or_a_double_solution():
    with ctx.workprec(128):
        assert enclose_zero(circle_and_line(0.0), [arb(0), arb(0)]) is None
        assert enclose_zero(circle_and_line(0.0), [arb(1e-9), arb(1e-9)]) is None
        assert enclose_zero(circle_and_line(-1.0), [arb(1), arb(1)]) is None


@pytest.mark.parametrize("curve", [Line((0, 0, 1), (1, 2, 2)), Circle((1, 2, 3), (1, 1, 0), 0.5), Point((1, 2, 3))])
def test_points_of_a_curve_do_not_miss_it(curve: Curve):
    for value in (-2.0, 0.0, 0.7):
        assert np.linalg.norm(curve.miss(curve.at(value))) < 1e-15
        off = curve.miss(curve.at(value) + np.array([0.0, 0.0, 0.1]))
        assert 0.01 < np.linalg.norm(off) <= 0.1 + 1e-12


@pytest.mark.parametrize(
    "bad",
    [
        lambda: Circle((0, 0, 0), (0, 0, 1), 0.0),
        lambda: Circle((0, 0, 0), (0, 0, 0), 1.0),
        lambda: Line((0, 0, float("nan")), (0, 0, 1)),
        lambda: Line((0, 0), (0, 0, 1)),
        lambda: Spatial((Point((0, 0, 0)),), np.zeros((2, 3))),
        lambda: Planar((Line((0, 0, 0), (0, 0, 1)),), np.zeros((1, 2)), np.eye(4)),
    ],
)
def test_what_is_no_curve_is_refused(bad):
    with pytest.raises(BadRequest):
        bad()
