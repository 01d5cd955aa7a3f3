"""An independent count of the poses that observations of a rigid body leave: a Gröbner basis modulo a prime.

A random pose, random points, axes and cameras with coordinates modulo the prime give values that have a solution.
Unknowns are Cayley's three parameters of the turn R = N/w and what planes leave of the position; nothing is enclosed,
and nothing of the engine is used. The dimension of the quotient ring counts solutions with their multiplicity.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import product
from typing import Any

import sympy

PRIME = 32003
X, Y, Z, INVERSE = sympy.symbols("x y z t")
FREE = sympy.symbols("s1 s2 s3")

Vector = list[Any]


def dot(u: Sequence[Any], v: Sequence[Any]) -> Any:
    return sum(a * b for a, b in zip(u, v, strict=True))


def cross(u: Sequence[Any], v: Sequence[Any]) -> Vector:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def cayley(c: Sequence[Any]) -> tuple[Any, list[Vector]]:
    """w and N = w R of a turn by c."""
    square, x = dot(c, c), [[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]]
    N = [[(1 - square) * int(i == j) + 2 * c[i] * c[j] + 2 * x[i][j] for j in range(3)] for i in range(3)]
    return 1 + square, N


def across(u: Sequence[int], rng: random.Random) -> list[Vector]:
    """Two random vectors normal to one."""
    return [cross(u, [rng.randrange(PRIME) for _ in range(3)]) for _ in range(2)]


def normals(kind: str, ray: Vector, axis: Vector, ahead: Vector, rng: random.Random) -> list[Vector]:
    """The normals of planes in which a kind holds what it sees, with the ray to it and its axis."""
    match kind:
        case "point":
            return across(ray, rng)
        case "position":
            return [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        case "depth":
            return [ahead]
        case "image_line":
            return [cross(ray, axis)]
    return across(axis, rng)


def held(kinds: Sequence[str], rng: random.Random, cameras: bool) -> tuple[list[Any], list[Any], list[Any]]:
    """Planes n · (R b + p) = h as (n, b, h), angles n · R d = 0 as (n, d), spheres |R b + p − c|² = f as (b, c, f)."""

    def some() -> Vector:
        return [rng.randrange(1, PRIME) for _ in range(3)]

    w, N = cayley(some())
    R = [[value * pow(w, -1, PRIME) % PRIME for value in row] for row in N]
    p, eye, ahead = some(), some(), some()
    planes, angles, spheres = list[Any](), list[Any](), list[Any]()
    for kind in kinds:
        b, d, c, z = some(), some(), *((some(), some()) if cameras else (eye, ahead))
        B = [(dot(row, b) + shift) % PRIME for row, shift in zip(R, p, strict=True)]
        turned, ray = [dot(row, d) % PRIME for row in R], [u - v for u, v in zip(B, c, strict=True)]
        if kind == "distance":
            spheres.append((b, c, dot(ray, ray) % PRIME))
            continue
        found = normals(kind, ray, turned, z, rng)
        if kind != "direction":
            planes += [(n, b, dot(n, B) % PRIME) for n in found]
        if kind in ("image_line", "line", "direction"):
            angles += [(n, d) for n in found]
    return planes, angles, spheres


def count(kinds: Sequence[str], seed: int, cameras: bool = False) -> int:
    """How many complex poses there are, at a random instance, by one camera or one for each."""
    planes, angles, spheres = held(kinds, random.Random(seed), cameras)
    w, N = cayley((X, Y, Z))

    def turned(b: Sequence[int]) -> Vector:
        return [dot(row, b) for row in N]

    # w p from planes, and free coordinates where they are fewer than three
    rng = random.Random(seed + 1)
    first, rest = planes[:3], planes[3:]
    rows = [n for n, _, _ in first] + [[rng.randrange(PRIME) for _ in range(3)] for _ in range(3 - len(first))]
    right = [h * w - dot(n, turned(b)) for n, b, h in first] + [w * s for s in FREE[: 3 - len(first)]]
    back = sympy.Matrix(rows).inv_mod(PRIME)
    wp = [sympy.expand(dot(list(back.row(k)), right)) for k in range(3)]
    equations = [dot(n, turned(b)) + dot(n, wp) - h * w for n, b, h in rest] + [dot(n, turned(d)) for n, d in angles]
    for b, c, f in spheres:
        v = [u + s - e * w for u, s, e in zip(turned(b), wp, c, strict=True)]
        equations.append(dot(v, v) - f * w * w)
    unknowns = (INVERSE, *FREE[: 3 - len(first)], X, Y, Z)
    basis = sympy.groebner([*map(sympy.expand, equations), INVERSE * w - 1], *unknowns, modulus=PRIME, order="grevlex")
    leading = [sympy.Poly(each, *unknowns, modulus=PRIME).monoms(order="grevlex")[0] for each in basis.exprs]
    tops = [min(m[k] for m in leading if sum(m) == m[k] and m[k]) for k in range(len(unknowns))]
    return sum(
        not any(all(a >= b for a, b in zip(e, m, strict=True)) for m in leading) for e in product(*map(range, tops))
    )
