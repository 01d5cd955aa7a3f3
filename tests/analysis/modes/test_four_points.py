"""Where a camera must be so that four image points leave a freedom: all such places, complex ones too, enclosed.

A motion that keeps the rays to B₀ … B₃ has λ_i p_i = v + ω × p_i, p_i = B_i − C. With a_i = B_i − B₀ and p = p₀ the
differences are λ_i (p + a_i) − λ₀ p = ω × a_i, so with μ_i = λ_i − λ₀ and s_i = p · a_i, as ω × is skew,

    μ_i s_j + μ_j s_i + (λ_i + λ_j) a_i · a_j = 0,        1 ≤ i ≤ j ≤ 3,

six quadrics of λ and p, whose zeros with C = B_i are none that are sought. That there are no more than are enclosed is
proved by the danger cylinders of each three of the points.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import cache
from itertools import combinations, combinations_with_replacement, product
from typing import Any

import numpy as np
import pytest
from flint import acb, arb, ctx, nmod_mat

from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.observations.point import ImagePoint
from hrsynth.solving.krawczyk import enclose_zero
from hrsynth.solving.platform.polynomials import Quadric

PRIME = (1 << 62) - 57
UNITS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
Form = dict[tuple[int, ...], int]
PAIRS = list(combinations_with_replacement(range(3), 2))
TETRAHEDRA = 20
REAL = {2: 15, 6: 5}
"""How many of the tetrahedra have so many real places, as the page says."""


def tetrahedron(seed: int) -> Array:
    """Four points (4, 3) with whole coordinates."""
    return np.random.default_rng(seed).integers(-50, 51, size=(4, 3))


def rows(points: Array) -> Any:
    """The coefficients of 1, s₁, s₂, s₃ in the six by four matrix, whole numbers (6, 4, 4); λ₀ first."""
    a = points[1:] - points[0]
    M = np.zeros((6, 4, 4), dtype=object)
    for row, (i, j) in zip(M, PAIRS, strict=True):
        for one, other in ((i, j), (j, i)):
            row[1 + one, 1 + other] += 1
            row[0, 1 + other] -= 1
            row[1 + one, 0] += int(a[i] @ a[j])
    return M


def cylinder(a: Array, b: Array, c: Array) -> Form:
    """The danger cylinder of three points, over their circumcircle: with n = u × v, u and v from one to the others,
    |n|² |y|² − (n · y)² = y · (|u|² v × n + |v|² n × u), y from there to the camera; coefficients are whole."""
    u, v = ([int(x) for x in w - a] for w in (b, c))
    n = cross(u, v)
    pole = [dot(u, u) * x + dot(v, v) * y for x, y in zip(cross(v, n), cross(n, u), strict=True)]
    total = Form()
    for i in range(3):
        for j in range(3):
            factor = (dot(n, n) if i == j else 0) - n[i] * n[j]
            for e, f in product((1, 0), repeat=2):  # (x_i − a_i) (x_j − a_j)
                key = tuple(e * (k == i) + f * (k == j) for k in range(3))
                total[key] = total.get(key, 0) + factor * (1 if e else -int(a[i])) * (1 if f else -int(a[j]))
        total[UNITS[1 + i]] = total.get(UNITS[1 + i], 0) - pole[i]
        total[UNITS[0]] = total.get(UNITS[0], 0) + pole[i] * int(a[i])
    return total


def dot(u: list[int], v: list[int]) -> int:
    return sum(x * y for x, y in zip(u, v, strict=True))


def cross(u: list[int], v: list[int]) -> list[int]:
    return [u[j] * v[k] - u[k] * v[j] for j, k in ((1, 2), (2, 0), (0, 1))]


def most(points: Array, degree: int = 5) -> int:
    """At most how many zeros the four cylinders have in common: by ranks of their multiples modulo a prime. A place
    where four points leave a freedom is one where each three of them do."""
    known = sorted((e for e in product(range(degree + 1), repeat=3) if sum(e) <= degree), key=lambda e: sum(e) < degree)
    place, edge, table = {e: k for k, e in enumerate(known)}, math.comb(degree + 2, 2), []
    for three in combinations(points, 3):
        quadric = cylinder(*three)
        for by in known:
            if sum(by) <= degree - 2:
                row = [0] * len(known)
                for e, c in quadric.items():
                    row[place[tuple(map(sum, zip(e, by, strict=True)))]] = c % PRIME
                table.append(row)
    assert nmod_mat([row[:edge] for row in table], PRIME).rank() == edge  # no zeros at infinity
    return len(known) - int(nmod_mat(table, PRIME).rank())


CHART = np.array([3, -5, 7, 11])
"""A linear form of λ that is made 1."""


def quadrics(points: Array) -> list[Quadric]:
    """The six equations in λ₁ … λ₃ and s₁ … s₃, multiplied by the chart's first coefficient."""
    found = []
    for row in rows(points):
        A = np.zeros((7, 7), dtype=object)
        for k, f in enumerate(row):  # λ_k f(s), λ₀ = (1 − Σ c_k λ_k) / c₀
            for m, c in enumerate(f):
                place = 0 if m == 0 else 3 + m
                if k:
                    A[k, place] += CHART[0] * c
                else:
                    A[0, place] += c
                    for other in (1, 2, 3):
                        A[other, place] -= CHART[other] * c
        found.append(Quadric(A))
    return found


def proposed(points: Array, rng: np.random.Generator, count: int) -> list[Array]:
    """Zeros that Newton's method meets from random complex starts."""
    M, size = rows(points).astype(complex), float(np.abs(points).max()) ** 2
    found: list[Array] = []
    for _ in range(4000):
        chart = rng.normal(size=4) + 1j * rng.normal(size=4)
        x = np.concatenate(
            [
                rng.normal(size=4) + 1j * rng.normal(size=4),
                size * 10 ** rng.uniform(-1, 2) * (rng.normal(size=3) + 1j * rng.normal(size=3)),
            ]
        )
        for _ in range(60):
            values = np.einsum("ikm,m->ik", M, np.concatenate([[1], x[4:]]))
            F = np.concatenate([values @ x[:4], [chart @ x[:4] - 1]])
            J = np.block([[values, np.einsum("ikm,k->im", M[:, :, 1:], x[:4])], [chart[None], np.zeros((1, 3))]])
            step = np.linalg.solve(J, F)
            x = x - step
            if np.abs(step[4:]).max() < 1e-12 * size and np.abs(step[:4]).max() < 1e-12:
                break
        else:
            continue
        x[:4] /= CHART @ x[:4]
        if all(np.abs(x[4:] - y[4:]).max() > 1e-6 * size for y in found):
            found.append(x)
        if len(found) == count:
            break
    return found


@cache
def places(seed: int) -> tuple[list[Array], int]:
    """The real camera's places (3,), points of the tetrahedron left out, and the number of all complex ones; each is
    enclosed with existence and uniqueness proved, apart from the others, and there are no more."""
    points = tetrahedron(seed)
    system, boxes, real = quadrics(points), [], []
    with ctx.workprec(200):
        for x in proposed(points, np.random.default_rng(seed), most(points) + 4):
            is_real = np.abs(x.imag).max() < 1e-9 * np.abs(x).max()
            values = x[1:]
            box = enclose_zero(system, [arb(v.real) if is_real else acb(v.real, v.imag) for v in values])
            assert box is not None
            boxes.append(box)
            if is_real:
                p = np.linalg.solve((points[1:] - points[0]).astype(float), x[4:].real)
                real.append(points[0] - p)
            else:
                assert any(not v.imag.contains(0) for v in box)
        apart = [
            any(not (acb(v) - acb(w)).contains(0) for v, w in zip(one, other, strict=True))
            for one, other in combinations(boxes, 2)
        ]
    assert all(apart)
    away = [C for C in real if np.linalg.norm(points - C, axis=1).min() > 1e-6]
    assert len(real) - len(away) == 4
    assert len(boxes) - 4 == most(points)
    return away, len(boxes) - 4


def weakest(points: Array, C: Array) -> float:
    """The smallest singular value of the rates of the rays, by the observation's own law."""
    R = np.eye(4)
    R[:3, 3] = C
    X, V = np.eye(4), np.eye(6)
    rates = [ImagePoint("p", "l", at=b / 50.0).rate(R, X, np.zeros((6, 6)), V) for b in points]
    return float(np.linalg.svd(np.vstack(rates), compute_uv=False)[-1])


@pytest.mark.parametrize("seed", range(4))
def test_six_complex_places_two_to_six_of_them_real(seed: int) -> None:
    real, count = places(seed)
    assert count == 6
    assert len(real) in (2, 4, 6)
    points = tetrahedron(seed)
    for C in real:
        assert weakest(points, C / 50.0) < 1e-9
        assert weakest(points, C / 50.0 + [0.02, -0.01, 0.03]) > 1e-6


@pytest.mark.slow
def test_how_many_are_real_for_twenty_tetrahedra() -> None:
    assert [places(seed)[1] for seed in range(TETRAHEDRA)] == [6] * TETRAHEDRA
    assert Counter(len(places(seed)[0]) for seed in range(TETRAHEDRA)) == REAL
