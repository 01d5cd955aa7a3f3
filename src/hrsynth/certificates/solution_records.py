"""All real solutions of a robot's equations in natural coordinates, as the record of ``verify_solutions.py``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..analysis.modes.natural_modes import NaturalPlatform
from ..geometry.vectors import Array
from ..solving.linear_elimination import list_coefficients
from ..solving.quadric_solver import QuadricSolver, SolvingStep, expand
from ..solving.solution_boxes import AlgebraEvidence
from ..solving.uniqueness import evaluate_quadrics
from .closures import write_numbers

WIDER_FRACTION = 4.0
"""By how much intervals of cases are wider than their error."""
INTERVAL_RADIUS_MIN = 1e-14
"""Smallest radius of an interval of a case."""


def build_record(system: NaturalPlatform, solutions: Sequence[Array]) -> dict[str, Any]:
    """Return the system, its solutions, the goal first, and the proof that there are no others."""
    view, solver = system.view, QuadricSolver()
    boxes, _ = solver.solve(view.matrices, view.errors, view.farthest)
    assert solver.last is not None
    n = len(view.goal)
    i, j = np.triu_indices(n + 1)
    rows = system.list_pose_rows()
    spread = max(float((np.abs(rows[:, 1:]) @ box.radii).max()) for box in boxes)
    digits = int(np.clip(-np.ceil(np.log10(WIDER_FRACTION * spread)), 4, 9))
    equations = [
        [[int(i[k]), int(j[k]), write_numbers(row[k])] for k in np.flatnonzero(row)]
        for row in list_coefficients(view.matrices)
    ]
    return {
        "system": {
            "equations": equations,
            "errors": write_numbers(view.errors),
            "farthest": write_numbers(view.farthest),
            "pose": [[[int(k), write_numbers(row[k])] for k in np.flatnonzero(row)] for row in rows],
        },
        "digits": digits,
        "solutions": write_numbers(solutions),
        "proof": _write_step(solver.last, np.eye(len(view.matrices))),
    }


def _write_weights(weights: Array) -> list[list[Any]]:
    return [[int(k), write_numbers(weights[k])] for k in np.flatnonzero(weights)]


def _write_step(step: SolvingStep, given: Array) -> dict[str, Any]:
    """Return a node of the proof; ``given``: the solver's equations as sums (P, N) of the record's."""
    reduced = step.reduced
    record: dict[str, Any] = {
        "rounds": [
            [[int(k) + 1, _write_weights(row)] for k, row in zip(out, weights @ given, strict=True)]
            for out, weights in reduced.rounds
        ]
    }
    used, m = reduced.picks @ given, len(reduced.farthest)
    if step.contradictory:
        others = np.abs(reduced.table[:, 1:]) @ reduced.sizes[1:]
        worst = int(np.argmax(np.abs(reduced.table[:, 0]) / (others + reduced.errors)))
        return {**record, "kind": "none", "weights": _write_weights(used[worst])}
    if m == 0:
        return {**record, "kind": "one"}
    if step.weights is not None:
        below = np.block([[used, np.zeros((len(used), 1))], [np.zeros((1, used.shape[1])), np.ones((1, 1))]])
        cases = []
        for value, off, inner in sorted(step.cases, key=lambda case: case[0]):
            radius = WIDER_FRACTION * off + INTERVAL_RADIUS_MIN
            interval = write_numbers([value - radius, value + radius])
            cases.append({"interval": interval, "node": _write_step(inner, below)})
        weights = _write_weights(step.weights @ used)
        return {**record, "kind": "cases", "unknown": step.unknown, "weights": weights, "cases": cases}
    assert step.algebra is not None
    inverses = []
    for k, x in step.points:
        C = np.linalg.pinv(evaluate_quadrics(expand(reduced.table, m), x)[1]) @ used
        inverses.append(
            {
                "eigenvalue": k,
                "middle": write_numbers(x),
                "inverse": write_numbers(C),
            }
        )
    return {**record, "kind": "algebra", **_write_algebra(step.algebra, used), "inverses": inverses}


def _write_algebra(found: AlgebraEvidence, used: Array) -> dict[str, Any]:
    multiples = []
    for row in found.weights:
        terms = []
        for h in np.flatnonzero(row):
            for e in np.flatnonzero(used[found.quadrics[h]]):
                terms.append([int(e), found.factors[h].tolist(), write_numbers(row[h] * used[found.quadrics[h], e])])
        multiples.append(terms)

    return {
        "basis": found.basis.tolist(),
        "C": write_numbers(found.C),
        "multiples": multiples,
        "sum": write_numbers(found.sum),
        "eigenvalues": write_numbers(np.stack([found.eigenvalues.real, found.eigenvalues.imag], axis=-1)),
        "V": write_numbers(np.stack([found.V.real, found.V.imag], axis=-1)),
        "W": write_numbers(np.stack([found.W.real, found.W.imag], axis=-1)),
    }
