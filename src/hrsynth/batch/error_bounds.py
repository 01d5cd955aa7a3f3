"""Largest errors of position and orientation from Mᵀ (docs/pages/proofs.md, section 10)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.components import Components, dot, sqrt, where
from ..geometry.vectors import Array
from ..tolerances import RANK_CUTOFF_FRACTION
from .cones import clear_zero, compute_error_along, compute_root, find_largest_eigenvalue, trace_two
from .program import Formula, Program
from .three_cones import trace_three

PARTS = ("position", "orientation")
OUTPUTS = (*PARTS, "clear")
ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class ErrorBound:
    """Largest error (n,) over all admissible errors of the directions, and a lower bound of it: equal for one cone and
    for two, and where the error has one dimension. Infinite where a twist is not observed."""

    largest: Array
    lower: Array


def bound_errors(
    M: Array, twists: Array, cones: Array, reached: NDArray[np.bool_] | None = None, *, compiled: bool = False
) -> tuple[ErrorBound, ErrorBound]:
    """Position and orientation error for Mᵀ (3 k, d, n) on ``twists`` (6, d) or (n, 6, d), and half-angles of k cones
    (rad); the position error is in the unit of the twists' linear rows. NaN where not ``reached``."""
    rows, d, n = M.shape
    there = np.ones(n, dtype=bool) if reached is None else reached
    if twists.ndim == 2 and n > 1:
        program = _build_constant_program(rows // 3, d, twists.tobytes(), cones.tobytes())
        given = np.vstack([M.reshape(rows * d, n), there])
    else:
        program = _build_program(rows // 3, d)
        turns = np.broadcast_to(twists.reshape(-1, 6 * d), (n, 6 * d)).T
        given = np.vstack([M.reshape(rows * d, n), there, turns, np.broadcast_to(cones[:, None], (len(cones), n))])
    found = program.run(given.T, OUTPUTS, compiled=compiled)
    found[:4, ~there] = np.nan
    lost = np.flatnonzero(there & ~(found[4] > 0))
    if len(lost):
        here = twists if twists.ndim == 2 else twists[lost]
        found[:4, lost] = _bound_deficient(M[..., lost].transpose(2, 0, 1), here, cones)
    return ErrorBound(found[0], found[1]), ErrorBound(found[2], found[3])


@lru_cache(maxsize=64)
def _build_program(k: int, d: int) -> Program:
    """The bounds where twists are other ones at each pose."""
    program = Program.of(M=3 * k * d, reached=1, twists=6 * d, cones=k)
    trace_bounds(program, d, lambda T, cones: (T, cones), "twists", "cones")
    return program


@lru_cache(maxsize=64)
def _build_constant_program(k: int, d: int, twists: bytes, cones: bytes) -> Program:
    """The bounds where twists and cones are the same at all poses."""
    T, half = np.frombuffer(twists), np.frombuffer(cones)
    program = Program.of(M=3 * k * d, reached=1)
    trace_bounds(
        program,
        d,
        lambda: (program.number(T), program.number(half)),
        single=[find_error_direction(part) for part in T.reshape(2, 3, d)],
    )
    return program


def is_bound_compiled(k: int, twists: Array, cones: Array) -> bool:
    """Return True if numba has compiled them already."""
    return _build_constant_program(k, twists.shape[1], twists.tobytes(), cones.tobytes()).is_compiled(OUTPUTS)


def find_error_direction(rows: Array) -> Array | None:
    """The one direction in which the error lies, where the twists (3, d), the same at all poses, leave no other; zero
    where they leave none."""
    if rows.ndim > 2:
        return None
    left, values, _ = np.linalg.svd(rows)
    if values[0] == 0:
        return np.zeros(3)
    return None if len(values) > 1 and values[1] > RANK_CUTOFF_FRACTION * values[0] else left[:, 0]


def trace_bounds(
    program: Program,
    d: int,
    constants: Callable[..., tuple[Components, Components]],
    *reads: str,
    single: Sequence[Array | None] = (None, None),
) -> None:
    """Add ``PARTS`` (upper and lower bound each) and ``clear``, where all twists are observed, at poses where
    ``reached`` is positive, for ``M``; twists (6, d) and cones (k) come from ``reads``."""

    def factor(M: Components, reached: Components) -> dict[str, Components]:
        """M = Q R by Gram and Schmidt, and where no column depends on those before it."""
        Q = [list(M[j::d]) for j in range(d)]
        R: list[list[Any]] = [[0.0] * d for _ in range(d)]
        for j in range(d):
            R[j][j] = sqrt(_sum_products(Q[j], Q[j]))
            Q[j] = [x / clear_zero(R[j][j]) for x in Q[j]]
            for i in range(j + 1, d):
                R[j][i] = _sum_products(Q[j], Q[i])
                Q[i] = [x - R[j][i] * y for x, y in zip(Q[i], Q[j], strict=True)]
        entries = [entry for row in R for entry in row]
        least, clear = RANK_CUTOFF_FRACTION * sqrt(_sum_products(entries, entries)), reached[0]
        for j in range(d):
            clear = where(R[j][j] > least, clear, 0.0)
        return {"Q": [x for column in Q for x in column], "R": entries, "clear": [clear]}

    def forms(part: int) -> Formula:
        def formula(Q: Components, R: Components, *given: Components) -> dict[str, Components]:
            """J = P Qᵀ, P = twists R⁻¹, and B_i = ψ_i² J_i J_iᵀ; where one direction is left, the error along it."""
            twists, cones = constants(*given)
            rows = [twists[(3 * part + i) * d : (3 * part + i + 1) * d] for i in range(3)]
            only = single[part]
            if only is not None:
                rows = [[dot(program.number(only), column) for column in zip(*rows, strict=True)]]
            size = len(Q) // d
            J = [[_sum_products(P, Q[i::size]) for i in range(size)] for P in (_solve_row(row, R) for row in rows)]
            blocks = [[row[i : i + 3] for row in J] for i in range(0, size, 3)]
            if only is not None:
                total = _sum_products(cones, [sqrt(dot(block[0], block[0])) for block in blocks])
                return {PARTS[part]: [total, total]}
            return {
                f"{PARTS[part]}_{i}": [cone * cone * dot(block[a], block[b]) for a, b in ENTRIES]
                for i, (cone, block) in enumerate(zip(cones, blocks, strict=True))
            }

        return formula

    program.apply(factor, "M", "reached", state=["clear"])
    for part, name in enumerate(PARTS):
        if single[part] is not None and not np.any(single[part]):
            program.apply(lambda name=name: {name: [0.0, 0.0]})
        else:
            program.apply(forms(part), "Q", "R", *reads)
    for part, name in enumerate(PARTS):
        if single[part] is None:
            trace_maximum(program, [f"{name}_{i}" for i in range(len(program.places["M"]) // d // 3)], "clear", name)


def trace_maximum(program: Program, forms: list[str], go: str, name: str) -> None:
    """Add the largest error at poses where the flag ``go`` is positive, for the forms B_i of these names: ``name`` is
    an upper bound and a lower one, the same for one cone and two."""
    if len(forms) == 1:
        program.apply(lambda B: {name: 2 * [compute_root(find_largest_eigenvalue(B)[0])]}, forms[0])
    elif len(forms) == 2:
        trace_two(program, forms, go, name)
    else:
        trace_three(program, forms, go, name)


def _sum_products(a: Components, b: Components) -> Any:
    """Σ a_i b_i."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def _solve_row(row: Components, R: Components) -> list[Any]:
    """row R⁻¹ (d)."""
    d, found = len(row), list(row)
    for j in range(d):
        for i in range(j):
            found[j] = found[j] - found[i] * R[i * d + j]
        found[j] = found[j] / R[j * d + j]
    return found


def _bound_deficient(M: Array, twists: Array, cones: Array) -> Array:
    """Return the bounds (4, n) where a twist is not observed: infinite where it moves the platform, else those of the
    observed ones; NaN where M is NaN."""
    finite = np.asarray(np.isfinite(M).all(axis=(1, 2)))
    M = np.where(finite[:, None, None], M, 0.0)
    U, s, full = np.linalg.svd(M, full_matrices=True)
    d = M.shape[2]
    values = np.zeros((len(M), d))
    values[:, : s.shape[1]] = s
    seen = values > RANK_CUTOFF_FRACTION * np.maximum(values[:, :1], 1e-300)
    found = np.full((4, len(M)), np.nan)
    for row, part in enumerate((twists[..., :3, :], twists[..., 3:, :])):
        along = np.broadcast_to(part, (len(M), 3, d)) @ full.transpose(0, 2, 1)
        gone = np.linalg.norm(along * ~seen[:, None], axis=(1, 2)) > RANK_CUTOFF_FRACTION * np.linalg.norm(
            along, axis=(1, 2)
        )
        P = along * (seen / np.where(seen, values, 1.0))[:, None]
        J = P[:, :, : s.shape[1]] @ U[:, :, : s.shape[1]].transpose(0, 2, 1)
        for number, value in enumerate(bound_map_errors(J * np.repeat(cones, 3), find_error_direction(part))):
            found[2 * row + number] = np.where(finite, np.where(gone, np.inf, value), np.nan)
    return found


def bound_map_errors(J: Array, only: Array | None) -> tuple[Array, Array]:
    """The bounds (n,) for maps J (n, 3, 3 k) of k unit balls to the platform's error, ``only`` along a direction (3,)
    where one is given."""
    blocks = J.reshape(len(J), 3, -1, 3)
    B = np.einsum("naic,nbic->niab", blocks, blocks)
    entries = np.stack([B[:, :, a, b] for a, b in ENTRIES], axis=2)
    if only is not None:
        found = np.sum([compute_error_along(entries[:, i].T, only) for i in range(entries.shape[1])], axis=0)
        return found, found
    return compute_largest_errors(list(entries.transpose(1, 2, 0)))


@lru_cache(maxsize=16)
def _build_maximum_program(k: int) -> Program:
    """The program of the maximum alone, for the entries of k forms."""
    program = Program.of(**{f"form_{i}": 6 for i in range(k)})
    program.apply(lambda: {"always": [1.0]}, state=["always"])
    trace_maximum(program, [f"form_{i}" for i in range(k)], "always", "maximum")
    return program


def compute_largest_errors(B: Sequence[Array], *, compiled: bool = False) -> tuple[Array, Array]:
    """The largest error and a lower bound of it, (n,) each, for the entries (6, n) of forms B_i."""
    upper, lower = _build_maximum_program(len(B)).run(
        np.stack([each.T for each in B], axis=1), ["maximum"], compiled=compiled
    )
    return upper, lower
