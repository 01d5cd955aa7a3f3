"""All poses of a rigid body under six conditions on its points, proposed by a homotopy (proofs.md, section 8).

In Study's coordinates (e, g) such conditions are combinations of seventeen quadrics, so that six with random complex
coefficients (a *section*, with 40 solutions, which are kept in a file) can be moved to the wanted ones along a straight
line. Its solutions move along 40 paths, and each isolated wanted one is the end of a path: with probability one (A.
Sommese, C. Wampler, The numerical solution of systems of polynomials, 2005, 7.1), and up to rounding. So nothing is
proved here: what is found is enclosed, and counted against a bound, elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...geometry.vectors import Array, times
from ...tolerances import ENDPOINT_DISTANCE_TOL, SOLUTION_DISTANCE_MAX
from ..newton import approach_zeros, solve_squares
from .polynomials import Quadric
from .study_coordinates import list_pose_forms

SHARP_ENDPOINT_STEP_TOL = 1e-9
"""Newton step (unit vectors) at which a path endpoint is accurate."""
SINGULAR_ENDPOINT_DISTANCE_TOL = 1e-4
"""Distance (unit vectors) below which two singular endpoints are one."""
SINGULAR_ENDPOINT_VALUE_TOL = 1e-5
"""Smallest singular value of scaled quadrics below which an endpoint is singular; a tenth is the cutoff on the path."""
HOMOTOPY_ROUNDS_MAX = 3
"""Largest number of rounds of a homotopy, each on other paths."""
HOMOTOPY_PATH_STEPS_MAX = 400
"""Largest number of steps of a path."""

FIRST_STEP, SHORTEST_STEP, LAST_STEP = 0.05, 1e-12, 1e-9
"""Part of the way that is gone first, at which a path is given up, and that may be left at its end."""
NEAR_PATH, ON_PATH, EASY = 1e-2, 1e-6, 0.05
"""Newton's first step after a step of the way, its second (unit vectors), and the part of the first one allowed at
which the next step of the way is twice as long."""
POLISHES, ROUNDS = 4, 40
"""Newton's steps at each end, and at a singular one."""


@dataclass(frozen=True, eq=False)
class PathEndpoints:
    """Endpoints of the paths: at ``solutions`` (m, 7), singular ones ``multiple`` times, real or with their conjugates;
    ``infinite``: how many end at no solution, ``lost``: how many were given up. ``loose``: singular endpoints, each
    reached by one path: a continuous family of solutions ends paths anywhere. ``far``: the (e, g) (m, 8) at which paths
    that end at no solution were left."""

    solutions: Array
    multiple: tuple[int, ...]
    infinite: int
    lost: int
    loose: int
    far: Array


def make_section() -> Array:
    """The start: the equation e·g = 0 and six combinations of the forms, with coefficients of length one; shape
    (7, 8, 8)."""
    normal, quadrics = list_pose_forms()
    turns = np.array([pow(5, k + 1, 10007) for k in range(6 * len(quadrics))]) / 10007
    return np.concatenate([normal[None], np.tensordot(np.exp(2j * np.pi * turns).reshape(6, -1), quadrics, 1)])


@lru_cache(maxsize=1)
def _start() -> tuple[Array, Array]:
    """Section and its solutions (40, 8), unit vectors, computed once by monodromy."""
    x = np.load(Path(__file__).with_name("section.npy")).astype(complex)
    return make_section(), _sharpen(make_section(), x)[0]


def find_endpoints(
    quadrics: Sequence[Quadric], study: Array, resting: Sequence[int] = (), enough: int | None = None
) -> PathEndpoints:
    """The ends of all paths to seven quadrics in unknowns x; other paths are taken where some were lost and fewer than
    ``enough`` solutions found.

    ``study`` (8, 8) times (1, x) are (e, g). The first quadric is e·g = 0, the others are conditions on points, and
    ``resting`` are those three that hold one of them: with the first, they make g a linear function of e. Then three
    quadrics of e are left, and eight paths.
    """
    back = np.linalg.inv(study)
    wanted = np.array([back.T @ np.asarray(quadric.A, dtype=float) @ back for quadric in quadrics])
    wanted = wanted + wanted.transpose(0, 2, 1)
    wanted = wanted / np.abs(wanted).max(axis=(1, 2))[:, None, None]
    lift = np.vstack([np.eye(4), _solve_turning(wanted[[0, *resting]])]) if resting else np.eye(8)
    to = lift.T @ np.delete(wanted, [0, *resting] if resting else [], axis=0) @ lift
    start, x = _build_corners() if resting else _start()
    ends = _UnitEndpoints()
    for number in range(HOMOTOPY_ROUNDS_MAX):
        with np.errstate(all="ignore"):
            at = _normalise(_follow_paths(start * np.exp(1j * (1.2 + 2.0 * number)), to, x) @ lift.T)
            ends = _sort_ends(wanted, at, ends.sharp)
        if not ends.lost or len(ends.sharp) >= (enough or len(x)):
            break
    at = np.array([*ends.sharp, *ends.singular]).reshape(-1, 8) @ back.T
    multiple = (1,) * len(ends.sharp) + ends.multiple
    far = np.reshape(ends.far, (-1, 8))
    return PathEndpoints(at[:, 1:] / at[:, :1], multiple, len(far), ends.lost, ends.loose, far)


def _build_corners() -> tuple[Array, Array]:
    """Three quadrics of e, shape (3, 4, 4), and their eight solutions (8, 4): eₖ² = cₖ² e₀²."""
    c, unit = np.exp(1j * np.arange(4)), np.eye(4)
    start = np.array([np.diag(unit[k] - c[k] ** 2 * unit[0]) for k in range(1, 4)])
    return start, _normalise(np.array([c * signs for signs in product((1.0,), *[(1.0, -1.0)] * 3)]))


def _solve_turning(quadrics: Array) -> Array:
    """G, shape (4, 4), with g = G e where quadrics (4, 8, 8) without squares of g vanish: on (e, G e) they are zero."""
    columns = [[form + form.T for form in quadrics[:, :4, 4:] @ unit.reshape(4, 4)] for unit in np.eye(16)]
    table = np.array(columns).reshape(16, -1).T
    return np.asarray(np.linalg.lstsq(table, -quadrics[:, :4, :4].ravel(), rcond=None)[0].reshape(4, 4))


def _follow_paths(start: Array, wanted: Array, x: Array) -> Array:
    """The ends of the paths from x (m, d), or how far they were followed: Runge and Kutta's steps, each corrected by
    Newton's method, all paths at once and each with steps of its own."""
    both = np.moveaxis(np.concatenate([start, wanted]), 0, 1).reshape(x.shape[1], -1)
    t, h, x = np.zeros(len(x)), np.full(len(x), FIRST_STEP), x.copy()

    def jacobians(x: Array, t: Array) -> tuple[Array, Array]:
        parts = 2.0 * (x @ both).reshape(len(x), 2, -1, x.shape[1])
        return parts[:, 0] + t[:, None, None] * (parts[:, 1] - parts[:, 0]), parts[:, 1] - parts[:, 0]

    def tangent(x: Array, t: Array) -> Array:
        J, change = jacobians(x, t)
        return _step(J, x, np.einsum("nij,nj->ni", change, x) / 2.0)

    def correction(x: Array, t: Array) -> Array:
        J, _ = jacobians(x, t)
        return _step(J, x, np.einsum("nij,nj->ni", J, x) / 2.0)

    active = np.arange(len(x))
    for _ in range(HOMOTOPY_PATH_STEPS_MAX):
        if not len(active):
            break
        at, now = x[active], t[active]
        step = np.where(1.0 - now - h[active] < LAST_STEP, 1.0 - now, h[active])
        half, then = now + step / 2.0, np.where(step >= 1.0 - now, 1.0, now + step)
        s = step[:, None]
        k1 = tangent(at, now)
        k2 = tangent(at + s / 2.0 * k1, half)
        k3 = tangent(at + s / 2.0 * k2, half)
        k4 = tangent(at + s * k3, then)
        at = _normalise(at + s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
        first = correction(at, then)
        at = at + first
        second = correction(at, then)
        first, second = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
        good = (first < NEAR_PATH) & (second < ON_PATH)
        x[active[good]], t[active[good]] = _normalise(at)[good], then[good]
        h[active] = np.where(good, np.where(first < EASY * NEAR_PATH, 2.0 * step, step), step / 2.0)
        active = active[(t[active] < 1.0) & (h[active] > SHORTEST_STEP)]
    return x


@dataclass(frozen=True, eq=False)
class _UnitEndpoints:
    """As :class:`PathEndpoints`, in unit vectors."""

    sharp: Sequence[Array] = ()
    singular: Sequence[Array] = ()
    multiple: tuple[int, ...] = ()
    far: Sequence[Array] = ()
    lost: int = 0
    loose: int = 0


def _sort_ends(wanted: Array, x: Array, known: Sequence[Array]) -> _UnitEndpoints:
    """Classify the endpoints (m, 8) of paths, with solutions that are ``known`` already."""
    left, (x, sharp) = x, _sharpen(wanted, x)
    infinite = _compute_distance(x) > SOLUTION_DISTANCE_MAX
    sharp &= ~infinite
    poses = _add_conjugates([*known, *x[sharp]])
    vague, misses, least = _sharpen_singular(wanted, left[~infinite & ~sharp])
    vague = vague[
        (misses < ENDPOINT_DISTANCE_TOL)
        & (least < SINGULAR_ENDPOINT_VALUE_TOL)
        & (_compute_distance(vague) < SOLUTION_DISTANCE_MAX)
    ]
    groups: list[list[Array]] = []
    for end in vague:
        group = next((group for group in groups if _compare_lines(end, group[0]) < SINGULAR_ENDPOINT_DISTANCE_TOL), [])
        groups += [] if group else [group]
        group.append(end)
    several = [group for group in groups if len(group) > 1]
    multiple = tuple(len(group) for group in several)
    far = left[infinite]
    lost = len(left) - len(far) - len(poses) - sum(multiple)
    singular = [_turn_real(group[0], SINGULAR_ENDPOINT_DISTANCE_TOL) for group in several]
    return _UnitEndpoints(poses, singular, multiple, tuple(far), max(0, lost), len(groups) - len(several))


def _add_conjugates(x: Sequence[Array]) -> list[Array]:
    """Distinct vectors up to factors, each with its conjugate; real ones without imaginary parts."""
    distinct: list[Array] = []
    for vector in map(_turn_real, x):
        if all(_compare_lines(vector, known) > ENDPOINT_DISTANCE_TOL for known in distinct):
            distinct += [vector] if np.isrealobj(vector) else [vector, vector.conj()]
    return distinct


def _turn_real(x: Array, flat: float = ENDPOINT_DISTANCE_TOL) -> Array:
    """A vector with its largest entry made real; real if all others are then, but for ``flat``."""
    largest = x[np.argmax(np.abs(x))]
    x = x * (abs(largest) / largest)
    return x.real if np.abs(x.imag).max() < flat else x


def _compare_lines(u: Array, v: Array) -> float:
    """Return the difference of two unit vectors, up to factors."""
    return float(np.linalg.norm(u - v * np.vdot(v, u)))


def _compute_distance(x: Array) -> Array:
    """Return how far the poses (n, 8) are away (sizes), at least."""
    e, g = x[:, :4], x[:, 4:]
    return 2.0 * np.linalg.norm(g, axis=1) * np.linalg.norm(e, axis=1) / (np.abs((e * e).sum(axis=1)) + 1e-300)


def _evaluate(quadrics: Array, x: Array, fixed: Array) -> tuple[Array, Array]:
    """The quadrics and ``fixed`` · x − 1 at x (m, 8), and their derivatives."""
    J = 2.0 * np.einsum("kij,nj->nki", quadrics, x)
    F = np.einsum("nki,ni->nk", J, x) / 2.0
    return np.column_stack([F, (fixed * x).sum(axis=1) - 1.0]), _add_border(J, fixed)


def _sharpen(quadrics: Array, x: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Unit vectors (m, 8) after a few of Newton's steps, and which (m,) are solutions."""
    ends = approach_zeros(
        partial(_evaluate, quadrics), x, x.conj(), steps=POLISHES, longest=1.0, step_tol=SHARP_ENDPOINT_STEP_TOL / 2.0
    )
    return _normalise(ends.x), ends.converged


def _sharpen_singular(quadrics: Array, x: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (m, 8) after steps that leave out what is nearly singular, what is left of the quadrics there, and
    the smallest singular values."""

    def solve(J: Array, F: Array) -> Array:
        return times(np.linalg.pinv(J, rcond=SINGULAR_ENDPOINT_VALUE_TOL / 10.0), F)

    x = _normalise(approach_zeros(partial(_evaluate, quadrics), x, x.conj(), steps=ROUNDS, solve=solve).x)
    F, J = _evaluate(quadrics, x, x.conj())
    return x, np.abs(F[:, :-1]).max(axis=1, initial=0.0), np.linalg.svd(J, compute_uv=False)[:, -1].astype(float)


def _step(J: Array, x: Array, F: Array) -> Array:
    """The solution of J d = −F, normal to x."""
    return solve_squares(_add_border(J, x.conj()), np.column_stack([-F, np.zeros(len(x))]))


def _add_border(J: Array, last: Array) -> Array:
    """J (m, n, n + 1) with a last row (m, n + 1)."""
    return np.concatenate([J, last[:, None]], axis=1)


def _normalise(x: Array) -> Array:
    return np.asarray(x / np.linalg.norm(x, axis=1, keepdims=True))
