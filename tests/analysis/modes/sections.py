"""How many poses six conditions on points of a rigid body have, counted modulo a prime: linear algebra alone.

Poses (h : M : x : y : r) of P¹⁶ are sampled modulo the prime; the quadrics that vanish on them give, with six linear
equations, a ring whose part of degree 4 and more has dimension 40. Multiplication by h, divided by that by a random
linear form, has as many eigenvalues that are not zero as there are poses (evidence: the prime may be a bad one).
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from flint import nmod_mat

from hrsynth.geometry.loci import Circle, Line, Plane, Sphere
from hrsynth.solving.platform.quadrics import list_normals
from hrsynth.solving.platform.rigid import Spatial

PRIME = 2147483629
COORDINATES, LEFT = 17, 11
"""Coordinates of a pose, and how many six linear equations leave."""

Monomial = tuple[int, ...]


def rows(system: Spatial) -> list[list[Fraction]]:
    """The equations a₀b₀ r + 2a₀ x·b − 2b₀ y·a − 2aᵀM b + c h = 0, for (h, M, x, y, r), written down by hand."""
    found = []
    for k, (reach, tip) in enumerate(zip(system.curves, system.tips, strict=True)):
        arrow = k >= len(system.points)
        b, c, hub = _exact(tip), _exact(reach.centre), _exact(system.hub)
        for n in list_normals(reach) if isinstance(reach, Circle | Line | Plane) else ():
            a = _exact(n)
            offset = [x - h * arrow for x, h in zip(c, hub, strict=True)]
            # a · (p + R b − centre) = 0, times h
            found.append([-_dot(a, offset), *(x * y for x in a for y in b), 0, 0, 0, *(x * (not arrow) for x in a), 0])
        if isinstance(reach, Circle | Sphere):
            square = _dot(c, c) + _dot(b, b) - Fraction(reach.radius) ** 2
            found.append([square, *(-2 * x * y for x in c for y in b), *(2 * x for x in b), *(-2 * x for x in c), 1])
    return found


def poses(equations: Sequence[Sequence[Any]]) -> int:
    """The number of solutions with h not zero of six linear equations, with multiplicity."""
    rng = random.Random(0)
    table = nmod_mat([[_residue(v) for v in row] for row in equations], PRIME)
    kernel, free = table.nullspace()
    assert free == LEFT
    basis = np.array([[int(kernel[i, j]) for j in range(LEFT)] for i in range(COORDINATES)], dtype=object)
    pairs = list(combinations_with_replacement(range(LEFT), 2))
    quadrics = []
    for A in _quadrics():
        B = basis.T @ (A @ basis % PRIME) % PRIME
        quadrics.append([int(B[i, j] + B[j, i] * (i != j)) for i, j in pairs])
    # functionals on polynomials of degree 4 that vanish on multiples of the quadrics
    fourth = _places(4)
    chosen = [(q, m) for q in quadrics for m in _places(2)]
    lines = []
    for q, m in rng.sample(chosen, 1300):
        line = [0] * len(fourth)
        for pair, value in zip(pairs, q, strict=True):
            line[fourth[_sorted(*pair, *m)]] += value
        lines.append(line)
    functionals = _kernel(lines)
    N = len(functionals)
    # those of degree 5: for each unknown one of degree 4, which agree on common multiples
    third = list(_places(3))
    lines = []
    for _ in range(LEFT * N + 100):
        i, j = rng.sample(range(LEFT), 2)
        m = rng.choice(third)
        line = [0] * (LEFT * N)
        for k, each in enumerate(functionals):
            line[i * N + k] += each[fourth[_sorted(j, *m)]]
            line[j * N + k] -= each[fourth[_sorted(i, *m)]]
        lines.append(line)
    fifth = _kernel(lines)
    assert len(fifth) == N

    def times(form: Sequence[int]) -> nmod_mat:
        return nmod_mat(
            [[sum(form[i] * each[i * N + k] for i in range(LEFT)) % PRIME for each in fifth] for k in range(N)], PRIME
        )

    turned = times([rng.randrange(PRIME) for _ in range(LEFT)]).inv() * times(basis[0].tolist())
    for _ in range(6):
        turned = turned * turned
    return int(turned.rank())


def degree() -> int:
    """The degree of the poses: the solutions of six random equations, with h not zero."""
    rng = random.Random(1)
    return poses([[rng.randrange(PRIME) for _ in range(COORDINATES)] for _ in range(6)])


@lru_cache(maxsize=1)
def _quadrics() -> list[Any]:
    """The quadrics (17, 17) that vanish on random poses."""
    rng = random.Random(2)
    pairs = list(combinations_with_replacement(range(COORDINATES), 2))
    points = [_pose(rng) for _ in range(len(pairs) + 20)]
    found = []
    for each in _kernel([[p[i] * p[j] for i, j in pairs] for p in points]):
        A = np.zeros((COORDINATES, COORDINATES), dtype=object)
        for (i, j), value in zip(pairs, each, strict=True):
            A[i, j] = value
        found.append(A)
    return found


def _pose(rng: random.Random) -> list[int]:
    """h, h R, h Rᵀp, h p, h |p|² with R of a random quaternion, |q|² = h, modulo the prime."""
    a, b, c, d = (rng.randrange(PRIME) for _ in range(4))
    p = [rng.randrange(PRIME) for _ in range(3)]
    h = a * a + b * b + c * c + d * d
    M = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    x = [sum(M[i][j] * p[i] for i in range(3)) for j in range(3)]
    return [v % PRIME for v in (h, *M[0], *M[1], *M[2], *x, *(h * v for v in p), h * _dot(p, p))]


def _kernel(lines: Sequence[Sequence[int]]) -> list[list[int]]:
    """A basis of the vectors that all lines annihilate."""
    basis, size = nmod_mat([[v % PRIME for v in line] for line in lines], PRIME).nullspace()
    return [[int(basis[i, k]) for i in range(basis.nrows())] for k in range(size)]


def _places(order: int) -> dict[Monomial, int]:
    return {m: k for k, m in enumerate(combinations_with_replacement(range(LEFT), order))}


def _sorted(*m: int) -> Monomial:
    return tuple(sorted(m))


def _residue(value: Any) -> int:
    exact = Fraction(value)
    return exact.numerator * pow(exact.denominator, -1, PRIME) % PRIME


def _exact(v: Any) -> list[Fraction]:
    return [Fraction(float(x)) for x in v]


def _dot(u: Sequence[Any], v: Sequence[Any]) -> Any:
    return sum(x * y for x, y in zip(u, v, strict=True))
