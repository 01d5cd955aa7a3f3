"""Turns and ranks in a finite field: arithmetic modulo a prime of 31 bits, with the draws of an instance."""

from __future__ import annotations

import itertools
import math
import random
from fractions import Fraction
from typing import Any

from .motions import RZ

PRIMES = (2147482801, 2147482081)
"""Primes p < 2³¹, p ≡ 1 modulo 240: the cosines and sines of multiples of π/60 are in the field."""

Turn = tuple[int, int]
Matrix = list[list[int]]


class NotExact(Exception):
    """No closed configuration was constructed; the reason."""


class PrimeField:
    """Arithmetic modulo a prime, and the draws of one instance."""

    def __init__(self, prime: int, draws: random.Random) -> None:
        self.p, self.random = prime, draws
        root = next(
            r
            for g in itertools.count(2)
            for r in [pow(g, (prime - 1) // 240, prime)]
            if pow(r, 120, prime) == prime - 1 and pow(r, 80, prime) != 1 and pow(r, 48, prime) != 1
        )
        self.root, self.half = root, (prime + 1) // 2
        self.i = pow(root, 60, prime)

    def turn_of(self, angle: float) -> Turn:
        """A multiple of π/120 as a turn."""
        part = Fraction(angle / math.pi * 120).limit_denominator(1)
        if abs(float(part) - angle / math.pi * 120) > 1e-9:
            raise NotExact(f"an angle of {angle} rad is not a multiple of π/120")
        z, back = (pow(self.root, int(k) % 240, self.p) for k in (part, -part))
        return (z + back) * self.half % self.p, (z - back) * self.half * pow(self.i, -1, self.p) % self.p

    def any_turn(self) -> Turn:
        """A random turn, by the tangent of half of it."""
        while True:
            t = self.random.randrange(1, self.p)
            if (1 + t * t) % self.p:
                w = pow(1 + t * t, -1, self.p)
                return (1 - t * t) * w % self.p, 2 * t * w % self.p

    def sqrt(self, a: int) -> int | None:
        """A square root, or None (A. Tonelli, D. Shanks)."""
        p = self.p
        if a % p == 0:
            return 0
        if pow(a, (p - 1) // 2, p) != 1:
            return None
        odd, twos = p - 1, 0
        while odd % 2 == 0:
            odd, twos = odd // 2, twos + 1
        z = next(z for z in itertools.count(2) if pow(z, (p - 1) // 2, p) == p - 1)
        c, t, r = pow(z, odd, p), pow(a, odd, p), pow(a, (odd + 1) // 2, p)
        while t != 1:
            k = next(k for k in range(1, twos) if pow(t, 1 << k, p) == 1)
            b = pow(c, 1 << (twos - k - 1), p)
            twos, c, t, r = k, b * b % p, t * b * b % p, r * b % p
        return r

    def turn_with(self, a: int, b: int, c: int) -> Turn:
        """A turn with a cos θ + b sin θ = c; any where that asks nothing."""
        p = self.p
        if a == b == 0:
            if c:
                raise NotExact("no turns with which a leg has the orientation")
            return self.any_turn()
        size = (a * a + b * b) % p
        root = self.sqrt((size - c * c) % p) if size else None
        if root is None:
            raise NotExact("an orientation has no root in the field")
        root *= self.random.choice((1, -1))
        w = pow(size, -1, p)
        return (a * c - b * root) * w % p, (b * c + a * root) * w % p

    def turn_between(self, start: Turn, end: Turn) -> Turn:
        """The turn of a plane that brings one vector to another; any where both are zero."""
        p, size = self.p, (start[0] ** 2 + start[1] ** 2) % self.p
        if not size:
            if any(start) or any(end):
                raise NotExact("no turns with which a leg has the orientation")
            return self.any_turn()
        w = pow(size, -1, p)
        return (start[0] * end[0] + start[1] * end[1]) * w % p, (start[0] * end[1] - start[1] * end[0]) * w % p

    def matrix(self, kind: int, turn: Turn) -> Matrix:
        """The turn about x, y or z as a matrix."""
        c, s = turn
        i, j = ((1, 2), (2, 0), (0, 1))[kind]
        R = [[int(a == b) for b in range(3)] for a in range(3)]
        R[i][i] = R[j][j] = c
        R[i][j], R[j][i] = -s % self.p, s
        return R

    def times(self, A: Matrix, B: Matrix) -> Matrix:
        """A B."""
        return [
            [sum(a * b for a, b in zip(row, column, strict=True)) % self.p for column in zip(*B, strict=True)]
            for row in A
        ]

    def transposed(self, A: Matrix) -> Matrix:
        """Aᵀ."""
        return [list(row) for row in zip(*A, strict=True)]

    def constant(self, R: Any) -> Matrix:
        """A constant turn, whose entries are sines and cosines of multiples of π/60, in the field."""
        found = [[self._entry(float(x)) for x in row] for row in R]
        if self.times(found, self.transposed(found)) != self.matrix(RZ, (1, 0)):
            raise NotExact("a coupling's frame is no product of known turns")
        return found

    def _entry(self, x: float) -> int:
        angle = math.acos(max(-1.0, min(1.0, x)))
        return self.turn_of(round(angle / math.pi * 120) * math.pi / 120)[0]

    def number(self, x: float) -> int:
        """A rational number of a small denominator."""
        value = Fraction(x).limit_denominator(10**6)
        return value.numerator * pow(value.denominator, -1, self.p) % self.p

    def rank(self, rows: list[list[int]]) -> int:
        """The rank of a matrix given by its rows."""
        from flint import nmod_mat

        if not rows:
            return 0
        return int(nmod_mat(len(rows), len(rows[0]), [x for row in rows for x in row], self.p).rank())
