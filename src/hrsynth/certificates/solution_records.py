"""All real solutions of a robot's equations in natural coordinates, as the record of ``verify_solutions.py``."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.modes.natural_modes import NaturalPlatform
from ..geometry.vectors import Array
from ..solving.quadric_solver import QuadricSolver, SolvingStep, expand
from ..solving.solution_boxes import AlgebraEvidence
from ..solving.uniqueness import evaluate_quadrics

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
    rows = [row for link in system.links for row in _list_pose_rows(system, link)]
    spread = max(float((np.abs(np.array(rows)[:, 1:]) @ box.radii).max()) for box in boxes)
    digits = int(np.clip(-np.ceil(np.log10(WIDER_FRACTION * spread)), 4, 9))
    equations = []
    for M in view.matrices:
        table = (M * (2 - np.eye(n + 1)))[i, j]
        used = np.flatnonzero(table)
        equations.append([[int(i[k]), int(j[k]), write_number(table[k])] for k in used])
    return {
        "system": {
            "equations": equations,
            "errors": [write_number(e) for e in view.errors],
            "farthest": [write_number(x) for x in view.farthest],
            "pose": [[[int(k), write_number(row[k])] for k in np.flatnonzero(row)] for row in rows],
        },
        "digits": digits,
        "solutions": [[write_number(v) for v in x] for x in solutions],
        "proof": _write_step(solver.last, np.eye(len(view.matrices))),
    }


def _list_pose_rows(system: NaturalPlatform, link: str) -> list[Array]:
    """Return the rows (n + 1,) of a link's point and of the images of three directions or two."""
    group, origin, _ = system.view.links[link]
    basis = system.view.groups[group][0]
    blocks = [system.view.point(link, origin), *(system.view.direction(link, column) for column in basis.T)]
    return list(np.concatenate(blocks))


def write_number(value: float) -> str:
    """Return a number as text, exactly."""
    return str(Fraction(float(value)))


def _write_weights(weights: Array) -> list[list[Any]]:
    return [[int(k), write_number(weights[k])] for k in np.flatnonzero(weights)]


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
            interval = [write_number(value - radius), write_number(value + radius)]
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
                "middle": [write_number(v) for v in x],
                "inverse": [[write_number(c) for c in row] for row in C],
            }
        )
    return {**record, "kind": "algebra", **_write_algebra(step.algebra, used), "inverses": inverses}


def _write_algebra(found: AlgebraEvidence, used: Array) -> dict[str, Any]:
    multiples = []
    for row in found.weights:
        terms = []
        for h in np.flatnonzero(row):
            for e in np.flatnonzero(used[found.quadrics[h]]):
                terms.append([int(e), found.factors[h].tolist(), write_number(row[h] * used[found.quadrics[h], e])])
        multiples.append(terms)

    def write_complex(values: Array) -> list[Any]:
        if values.ndim > 1:
            return [write_complex(row) for row in values]
        return [[write_number(value.real), write_number(value.imag)] for value in values.tolist()]

    return {
        "basis": found.basis.tolist(),
        "C": [[write_number(c) for c in row] for row in found.C],
        "multiples": multiples,
        "sum": [write_number(c) for c in found.sum],
        "eigenvalues": write_complex(found.eigenvalues),
        "V": write_complex(found.V),
        "W": write_complex(found.W),
    }
