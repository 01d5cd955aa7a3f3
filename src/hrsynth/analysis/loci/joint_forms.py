"""Closed configurations of a platform that a leg carries: root bound by ranks modulo a prime, and all of them proposed
by linear algebra (docs/pages/proofs.md, section 8).

A turn is that of the quaternion y + z a with (y : z) in a projective line, but for w = y² + z² a·a = 0; a slide is
z / y, w = y. Conditions on the joints are forms of a degree in each line. With W the product of all w, I_t the
multiples of the conditions in the degrees t and S all forms: if Wᵏ S lies in Wᵏ⁺¹ S + I_t, then each function of the
closing is, modulo the conditions, one of the degrees t less those of Wᵏ, so there are at most
D = dim (Wᵏ S + I_t) - dim I_t closings, multiple ones counted so often. Forms are known by their values at random
points modulo the prime, as in :mod:`.pose_bound`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from ...geometry.ranks import decompose_matrix
from ...geometry.vectors import Array, hat
from ...solving.platform.pose_bound import PRIME, QUATERNION_POWERS_MAX, reduce_mod
from ...tolerances import FORM_PIVOT_MIN_FRACTION

if TYPE_CHECKING:
    from .carrying_leg_system import CarriedCondition, CarriedPlatform, Turn

JOINT_FORMS_MAX = 750
"""Largest number of forms of conditions on a leg's joints."""


@dataclass(frozen=True, eq=False)
class ClosureCount:
    """At most ``most`` closings, from forms of the degrees ``t`` times Wᵏ."""

    most: int
    t: tuple[int, ...]
    k: int


def _list_steps(freedoms: Sequence[Turn]) -> list[int]:
    """The degrees of w."""
    return [1 if freedom.slides else 2 for freedom in freedoms]


def _list_degrees(system: CarriedPlatform, chosen: Sequence[CarriedCondition]) -> list[list[int]]:
    return [[carried.degree(k, f) for k, f in enumerate(system.freedoms_)] for carried in chosen]


def count_closures(system: CarriedPlatform, chosen: Sequence[CarriedCondition]) -> ClosureCount | None:
    """D of some conditions, as many as joints; None where there are infinitely many, or the forms would be too many."""
    steps, degrees = _list_steps(system.freedoms_), _list_degrees(system, chosen)
    # from these degrees on, were all zeros isolated, there are as many functionals as zeros
    t = [max(2 * by, -(-sum(column) // by) * by) for by, column in zip(steps, zip(*degrees, strict=True), strict=True)]
    joint = 0
    while prod(d + 1 for d in t) <= JOINT_FORMS_MAX:
        dimensions = _compute_dimensions(system, chosen, degrees, steps, t)
        for k, (dimension, next_) in enumerate(pairwise(dimensions)):
            if dimension == next_:
                return ClosureCount(dimension, tuple(t), k)
        t[joint % len(t)] += steps[joint % len(t)]
        joint += 1
    return None


def find_closures(system: CarriedPlatform, chosen: Sequence[CarriedCondition], counted: ClosureCount) -> Array:
    """All closings q (n, joints), complex, to rounding: functionals on exp(i m q) and powers of slides that vanish on
    the multiples of the conditions, on which the multiplication by exp(i q), or by a slide, has them as eigenvalues."""
    from scipy.linalg import qr

    freedoms, t = system.freedoms_, counted.t
    steps = np.array(_list_steps(freedoms))
    sizes, rows = [d + 1 for d in t], []
    for carried, degrees in zip(chosen, _list_degrees(system, chosen), strict=True):
        coefficients = _compute_coefficients(system, carried, degrees)
        for first in product(*(range(d - e + 1) for d, e in zip(t, degrees, strict=True))):
            row = np.zeros(sizes, dtype=complex)
            row[tuple(slice(f, f + e + 1) for f, e in zip(first, degrees, strict=True))] = coefficients
            rows.append(row.ravel())
    matrix = np.array(rows)
    Q, upper, _ = qr(matrix.conj().T, pivoting=True)
    pivots = np.abs(np.diag(upper))
    kernel = Q[:, int(np.sum(pivots > FORM_PIVOT_MIN_FRACTION * pivots[0])) :]
    lower = _place_within(sizes, steps, counted.k, np.zeros(len(t), dtype=int))
    space = decompose_matrix(kernel[lower])[0][:, : counted.most]
    place = {index: i for i, index in enumerate(lower)}
    home = [place[i] for i in _place_within(sizes, steps, counted.k + 1, np.zeros(len(t), dtype=int))]
    moved = [
        [place[i] for i in _place_within(sizes, steps, counted.k + 1, shift)] for shift in np.eye(len(t), dtype=int)
    ]
    by = np.array([np.linalg.lstsq(space[home], space[places], rcond=None)[0] for places in moved])
    _, X = np.linalg.eig(np.einsum("kij,k->ij", by, np.random.default_rng(1).normal(size=len(t))))
    eigenvalues = np.einsum("ij,kjl,li->ik", np.linalg.inv(X), by, X)
    slides = np.array([freedom.slides for freedom in freedoms])
    with np.errstate(all="ignore"):
        return np.asarray(np.where(slides, eigenvalues, -1j * np.log(eigenvalues)))


def _compute_coefficients(system: CarriedPlatform, carried: CarriedCondition, degrees: Sequence[int]) -> Array:
    """Return the value at exp(i m q), |m| up to half the degree, and at powers of slides; one axis a joint."""
    nodes = [
        np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1)) if f.slides else 2 * np.pi * np.arange(d + 1) / (d + 1)
        for f, d in zip(system.freedoms_, degrees, strict=True)
    ]
    grid = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1)
    values = system.values(grid, [carried])[0][..., 0].astype(complex)
    for k, (freedom, at, d) in enumerate(zip(system.freedoms_, nodes, degrees, strict=True)):
        basis = (
            at[:, None] ** np.arange(d + 1) if freedom.slides else np.exp(1j * np.outer(at, np.arange(d + 1) - d / 2))
        )
        values = np.moveaxis(np.tensordot(np.linalg.inv(basis), values, (1, k)), 0, k)
    return np.asarray(values / np.abs(values).max())


def _place_within(sizes: Sequence[int], steps: Array, k: int, shift: Array) -> list[int]:
    """The places of the forms of degrees less those of Wᵏ, each moved by what is multiplied: of turns around the
    middle, of slides from zero."""
    start = np.where(steps == 2, k, 0) + shift
    size = np.array(sizes) - k * steps
    return [int(np.ravel_multi_index(tuple(start + at), sizes)) for at in np.ndindex(*size)]


def _compute_dimensions(
    system: CarriedPlatform,
    chosen: Sequence[CarriedCondition],
    degrees: Sequence[Sequence[int]],
    least: Sequence[int],
    t: Sequence[int],
) -> list[int]:
    """dim (Wᵏ S + I_t) - dim I_t for k = 0, 1, …"""
    from flint import nmod_mat

    count = prod(d + 1 for d in t)
    points = np.random.default_rng(0).integers(1, PRIME, size=(2, len(t), count)).astype(object)
    axes = [reduce_mod(freedom.axis) for freedom in system.freedoms_]
    w = [
        y if freedom.slides else (y * y + z * z * (a @ a)) % PRIME
        for freedom, a, y, z in zip(system.freedoms_, axes, *points, strict=True)
    ]
    moves = [_move(freedom, a, y, z, v) for freedom, a, y, z, v in zip(system.freedoms_, axes, *points, w, strict=True)]
    rows = []
    for carried, row in zip(chosen, degrees, strict=True):
        value = _evaluate(system, carried, moves)
        for v, d, by in zip(w, row, least, strict=True):
            value = value * _raise_power(v, d // by) % PRIME
        rows.append(_evaluate_monomials(points, [d - e for d, e in zip(t, row, strict=True)]) * value % PRIME)
    kernel, size = nmod_mat(np.vstack(rows).tolist(), PRIME).nullspace()
    columns = np.array([[int(v) for v in row[:size]] for row in kernel.table()], dtype=object).reshape(count, size)
    dimensions = []
    for k in range(QUATERNION_POWERS_MAX + 1):
        left = [d - k * by for d, by in zip(t, least, strict=True)]
        if min(left) < 0:
            break
        dimensions.append(
            (nmod_mat(_evaluate_monomials(points, left).tolist(), PRIME) * nmod_mat(columns.tolist(), PRIME)).rank()
        )
        for v in w:
            columns = columns * v[:, None] % PRIME
    return dimensions


def _move(freedom: Turn, a: Any, y: Any, z: Any, w: Any) -> tuple[Any, Any]:
    """The turns (n, 3, 3) and the displacements (n, 3) at points modulo the prime."""
    inverse = np.array([pow(int(v), -1, PRIME) for v in w], dtype=object)
    unit = np.eye(3, dtype=int).astype(object)
    if freedom.slides:
        return np.broadcast_to(unit, (len(y), 3, 3)), np.multiply.outer(z * inverse % PRIME, a) % PRIME
    along = np.multiply.outer(a, a) % PRIME
    across = reduce_mod(hat(freedom.axis))
    squares, both = y * y - z * z * (a @ a) % PRIME, 2 * y * z
    turn = (squares[:, None, None] * unit + (2 * z * z)[:, None, None] * along + both[:, None, None] * across) % PRIME
    turn = turn * inverse[:, None, None] % PRIME
    o = reduce_mod(freedom.point)
    return turn, (o - turn @ o) % PRIME


def _evaluate(system: CarriedPlatform, carried: CarriedCondition, moves: Sequence[tuple[Any, Any]]) -> Any:
    """Return the values of a condition (n,), without joints that leave it unchanged."""
    count = len(moves[0][0])
    x, d = (np.broadcast_to(reduce_mod(v), (count, 3)) for v in (carried.condition.b, carried.condition.c))
    for k in range(carried.joints - 1, -1, -1):
        if k not in carried.idle:
            turn, shift = moves[k]
            x = (np.sum(turn * x[:, None, :], axis=2) + shift) % PRIME
            d = np.sum(turn * d[:, None, :], axis=2) % PRIME
    return carried.condition.value(x, d, reduce_mod) % PRIME


def _evaluate_monomials(points: Array, t: Sequence[int]) -> Any:
    """All of the degrees; shape (forms, points)."""
    monomials = [np.ones(points.shape[2], dtype=int).astype(object)]
    for y, z, d in zip(*points, t, strict=True):
        powers = [_raise_power(y, d - e) * _raise_power(z, e) % PRIME for e in range(d + 1)]
        monomials = [monomial * power % PRIME for monomial, power in product(monomials, powers)]
    return np.array(monomials, dtype=object)


def _raise_power(v: Any, e: int) -> Any:
    total = v * 0 + 1
    for _ in range(e):
        total = total * v % PRIME
    return total
