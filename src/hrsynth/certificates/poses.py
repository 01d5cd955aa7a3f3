"""Six conditions on points of a rigid body, written so that as many solutions are enclosed as there can be (proofs.md,
section 10).

Where rods share balls, or tips are on circles and lines, some of the 40 solutions are multiple ones at infinity. Moved
by less than rounding, each condition with a tip of its own, they are single, far away, and no other: they are followed
there from a larger move.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from ..geometry.loci import Plane, Sphere
from ..geometry.so3 import convert_to_quaternions
from ..geometry.vectors import Array
from ..solving.newton import approach_zeros
from ..solving.platform.pose_coordinate_solver import propose_by_homotopy
from ..solving.platform.quadrics import COORDINATE_BITS_COUNT, PoseSystem
from ..solving.platform.rigid import Spatial
from .closures import write_numbers
from .refining import Polynomial, ScaledEquations
from .verify_certificate import KINDS, CertificateRejection, conditions, integral, poses, rational, reach_of

FIRST, ROUGH = Fraction(1, 4), Fraction(1, 1 << 11)
EXACT = [Fraction(1, 1 << k) for k in (12, 13, 15, 18, 22, COORDINATE_BITS_COUNT // 2)]
"""Roots of the moves: the first, from where on numbers have more digits, and those that follow."""
STEP, SHORTEST, NEAR = 0.05, 1e-4, 0.3
"""What part of the way is gone at once at most, and at least; and how far a solution may be from where it was expected,
of its distance from others."""
PERTURBED_EQUATION_DEGREE_COUNT = 3
"""Of the equations in the move."""
PERTURBED_NEWTON_STEPS_COUNT = 6
"""Newton's steps after each move."""
PERTURBATION_DIRECTIONS_MAX = 3
"""Random directions in which all is moved."""
GRAIN = 1 << 20
"""One over the grain of random directions and of roots."""

Starts = list[tuple[list[Any], bool | None]]


def regular(record: dict[str, Any], starts: Starts) -> tuple[dict[str, Any], Starts]:
    """A system of kind ``pose`` and about where its solutions are, in the checker's coordinates, with those that are
    far (None); the geometry moved within rounding where they are fewer than there can be."""
    E = np.array(rational(record["chart"]), dtype=float)
    x = np.array([each for each, _ in starts], dtype=complex).reshape(-1, 7)
    own = _coordinates(E, np.column_stack([np.ones(len(x)), x[:, :3]]) @ E.T, x[:, 3:])
    found: Starts = [(z.tolist(), real) for z, (_, real) in zip(own, starts, strict=True)]
    most = poses([{}] * 7, (), record)
    if most != 40 or most == len(found):
        return record, found
    for seed in range(PERTURBATION_DIRECTIONS_MAX):
        moved = _MovedSystem(_split(record), random.Random(seed))
        ends = _follow_infinity(moved, E, most, most - len(found))
        if ends is not None:
            return moved.at(EXACT[-1] ** 2), found + [(each, None) for each in ends]
    raise CertificateRejection(
        f"{len(found)} solutions are enclosed, but those at infinity, of {most} together, are not"
    )


def _coordinates(E: Array, e: Any, g: Any) -> Any:
    """x1 … x7 of quaternions e and g (n, 4)."""
    y, z = (np.linalg.solve(E, v.T).T for v in (e, g))
    y, z = y / y[:, :1], z / y[:, :1]
    z = z - z[:, :1] * y
    e, g = y @ E.T, z @ E.T
    kappa = (e * g).sum(axis=1) ** 2 / (e * e).sum(axis=1)
    return np.column_stack([y[:, 1:], kappa, z[:, 1:]])


def _split(record: dict[str, Any]) -> dict[str, Any]:
    """Return the system with planes and spheres alone, each with a tip of its own."""
    reaches, tips = [], []
    for tip, reach in zip(record["tips"], record["reaches"], strict=True):
        kind, (c, *rest) = reach_of(reach)
        for _, values in conditions(([{}] * 3, {}, {}), (kind, [c, *rest])):
            reaches.append({"plane" if len(values) == 3 else "sphere": [c, values]})
            tips.append(rational(tip))
    return record | {"reaches": reaches, "tips": tips}


class _MovedSystem:
    """A system, each number of which moves along a random direction."""

    def __init__(self, record: dict[str, Any], rng: random.Random) -> None:
        self.record = record
        self.along = {key: _alike(record[key], rng) for key in ("tips", "reaches")}
        for each in self.along["reaches"]:  # squared radii stay as they are
            if "sphere" in each:
                each["sphere"][1] = [Fraction(0)]

    def at(self, by: Fraction) -> dict[str, Any]:
        """The record, each number moved by so much at most."""
        tips, reaches = (_add(self.record[key], each, by) for key, each in self.along.items())
        return self.record | {
            "tips": write_numbers(tips),
            "reaches": [{kind: write_numbers(vectors)} for each in reaches for kind, vectors in each.items()],
        }


def _alike(x: Any, rng: random.Random) -> Any:
    if isinstance(x, dict):
        return {key: _alike(each, rng) for key, each in x.items()}
    return [_alike(each, rng) for each in x] if isinstance(x, list) else Fraction(rng.randint(-GRAIN, GRAIN), GRAIN)


def _add(x: Any, along: Any, by: Fraction) -> Any:
    if isinstance(x, dict):
        return {key: _add(each, along[key], by) for key, each in x.items()}
    return [_add(a, b, by) for a, b in zip(x, along, strict=True)] if isinstance(x, list) else x + by * along


def _follow_infinity(moved: _MovedSystem, E: Array, most: int, count: int) -> list[list[Any]] | None:
    """About where the ``count`` solutions at infinity are (7,) after the least move; None where they are not found.

    They are power series in the root s of the move: each is predicted by the parabola through the last three. Complex
    moves lead around those that are singular."""
    floats, roots, found, gone, step = _Floats(moved), [complex(FIRST)], [_first(moved.at(FIRST**2), E)], 0.0, STEP
    if len(found[0]) != most:
        return None
    while gone < 1.0:
        next_ = min(1.0, gone + step)
        s = float(FIRST) ** (1 - next_) * float(ROUGH) ** next_ * np.exp(1j * np.sin(np.pi * next_))
        start = _predict(roots[-3:], found[-3:], s)
        x = floats.near(s * s, start)
        size = 1 + np.abs(x)
        apart = (np.abs(x[:, None] - x[None]) / size).max(axis=2) + np.diag([np.inf] * most)
        if np.all((np.abs(x - start) / size).max(axis=1) < NEAR * apart.min(axis=1)):
            gone, step, roots, found = next_, min(STEP, 1.5 * step), [*roots, s], [*found, x]
        elif step < SHORTEST:
            return None
        else:
            step /= 2
    e = np.column_stack([np.ones(most), found[-1][:, :3]]) @ E.T
    order = np.argsort(np.abs((e * e).sum(axis=1)) / (np.abs(e) ** 2).sum(axis=1))[:count]
    ends = [[each[k].astype(object) for each in found[-3:]] for k in order]
    for exact in EXACT:
        refining, s = ScaledEquations([integral(p) for p in _equations(moved.at(exact**2))]), complex(exact)
        for each in ends:
            each.append(
                np.array(refining.near(_predict(roots[-3:], each[-3:], s), PERTURBED_NEWTON_STEPS_COUNT), dtype=object)
            )
        roots.append(s)
    return [list(each[-1]) for each in ends]


def _predict(at: Sequence[complex], values: Sequence[Any], s: complex) -> Any:
    """The value at s of the polynomial through some."""
    return sum(math.prod((s - b) / (a - b) for b in at if b != a) * v for a, v in zip(at, values, strict=True))


def _equations(record: dict[str, Any]) -> list[Polynomial]:
    return list(KINDS["pose"][0](record, rational(record["tips"]))[0])


def _first(record: dict[str, Any], E: Array) -> Any:
    """All solutions of a system in general, by a homotopy."""
    curves = []
    for each in record["reaches"]:
        kind, (c, rest) = reach_of(each)
        a, b = np.array(c, dtype=float), np.array(rest, dtype=float)
        curves.append(Sphere(a, float(np.sqrt(b[0]))) if kind == "sphere" else Plane(a, b / np.linalg.norm(b)))
    system = Spatial(
        tuple(curves),
        np.array(rational(record["tips"]), dtype=float),
        record["arrows"],
        np.array(rational(record["hub"]), dtype=float),
    )
    part = PoseSystem(tuple(range(len(curves))), system.chart(0), True)
    found = propose_by_homotopy(part, None)
    assert part.chart.study is not None
    frame = part.chart.frame
    x = np.array([[1.0, *(complex(v) for v in each)] for each, _ in found.solutions]).reshape(-1, 8)
    e, g = x @ part.chart.study[:4].T, x @ part.chart.study[4:].T
    p = 2 * _product(g, e * (1, -1, -1, -1))[:, 1:] / (e * e).sum(axis=1)[:, None]
    e = _product(np.array([convert_to_quaternions(frame.R.T)]), e)
    p = frame.size * p @ frame.R + frame.origin
    return _coordinates(E, e, _product(np.column_stack([np.zeros(len(p)), p]), e) / 2)


def _product(a: Any, b: Any) -> Any:
    """Return the coordinates of quaternions (n, 4)."""
    w = a[:, :1] * b[:, :1] - (a[:, 1:] * b[:, 1:]).sum(axis=1)[:, None]
    return np.hstack([w, a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])])


class _Floats:
    """The checker's equations in floating point, polynomials of the move."""

    def __init__(self, moved: _MovedSystem) -> None:
        at = [Fraction(k, 64) for k in range(PERTURBED_EQUATION_DEGREE_COUNT + 1)]
        powers = np.linalg.inv(
            np.array([[float(x) ** k for k in range(PERTURBED_EQUATION_DEGREE_COUNT + 1)] for x in at])
        )
        self.terms = []
        for several in zip(*(_equations(moved.at(by)) for by in at), strict=True):
            exponents = sorted(set().union(*several))
            C = powers @ np.array([[float(p.get(e, 0)) for e in exponents] for p in several])
            self.terms.append((np.array(exponents), C / np.abs(C).max()))

    def near(self, by: complex, x: Any) -> Any:
        """Solutions (n, 7) near others; not finite where they are not found."""
        terms = [(e, by ** np.arange(PERTURBED_EQUATION_DEGREE_COUNT + 1) @ C) for e, C in self.terms]
        return approach_zeros(partial(self._evaluate, terms), x, steps=PERTURBED_NEWTON_STEPS_COUNT).x

    @staticmethod
    def _evaluate(terms: Sequence[Any], x: Array) -> tuple[Array, Array]:
        powers = np.stack([np.ones_like(x), x, x * x, x**3, x**4, x**5, x**6], axis=-1)
        F, J = np.zeros(x.shape, dtype=complex), np.zeros((*x.shape, x.shape[1]), dtype=complex)
        k = np.arange(x.shape[1])
        for row, (e, c) in enumerate(terms):
            F[:, row] = powers[:, k, e].prod(axis=2) @ c
            for j in k:
                down = e - (k == j)
                J[:, row, j] = powers[:, k, np.maximum(down, 0)].prod(axis=2) @ (c * e[:, j])
        scale = np.abs(J).max(axis=2) + 1e-300
        return F / scale, J / scale[:, :, None]
