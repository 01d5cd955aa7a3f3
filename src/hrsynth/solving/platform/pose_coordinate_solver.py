"""All poses for tips on curves or surfaces, with the pose's own coordinates as unknowns.

Solutions are proposed, for a rigid body by a homotopy, else by msolve. Each is enclosed here, from the equations, with
existence and uniqueness proved.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ...geometry.loci import Point
from ...geometry.vectors import Array
from ...tolerances import BOX_SEPARATION_TOL, SOLUTION_DISTANCE_MAX
from ..krawczyk import enclose_zero
from .constrained_platform import System
from .homotopy import find_endpoints
from .infinity import count_beyond
from .modular_root_bound import combine_quadrics
from .msolve import Parametrisation, parametrise
from .polynomials import Quadric
from .quadrics import UNIT, Balls, MovingPoint, PoseParametrization, PoseSystem, RoundedConic, Within
from .root_bound import Bound
from .roots import (
    PRECISION_DOUBLINGS_MAX,
    ROOT_ISOLATION_BITS_COUNT,
    Solution,
    SolutionEncloser,
    SolutionSet,
    find_all_solutions,
    is_real,
    is_sharp,
)

BALL_ZERO = 2.0**-256
"""Radius of a ball containing zero at which its number is zero."""


@dataclass(frozen=True, eq=False)
class ProposedSolutions:
    """Solutions that a solver proposes, besides ``extraneous`` ones that are not poses; ``lost``: how many more there
    may be, ``loose`` whether those may form a continuous family; ``far``: the (e, g) (m, 8) at which paths of a
    homotopy to infinity were left."""

    solutions: tuple[Solution, ...]
    method: str
    extraneous: int = 0
    lost: int = 0
    loose: bool = False
    far: Array | None = None


def list_parts(system: System, number: int = 0) -> Iterator[PoseSystem]:
    """Yield the choices of legs with just as many equations as dof, then those with too many."""
    chart = system.chart(number)
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(range(len(system.curves)), size):
            if sum(system.forbids[k] for k in legs) == system.freedoms and not system.freedoms_left(legs):
                yield PoseSystem(legs, chart, size == len(system.curves))
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(sorted(range(len(system.curves)), key=lambda k: -system.forbids[k]), size):
            given = [system.forbids[k] for k in legs]
            if sum(given) > system.freedoms > sum(given[:-1]) and not system.freedoms_left(legs):
                yield PoseSystem(legs, chart, False)


def propose_roots(part: PoseSystem, enough: int | None) -> ProposedSolutions | None:
    """All solutions, up to rounding, ``enough`` at most; None where there seem to be infinitely many.

    Raises ``MissingExtra``, ``ExternalSolverFailure`` where msolve is needed."""
    return propose_by_msolve(part) if part.chart.study is None else propose_by_homotopy(part, enough)


def propose_by_homotopy(part: PoseSystem, enough: int | None) -> ProposedSolutions:
    """All poses of a rigid body, up to rounding, ``enough`` at most."""
    from flint import acb

    assert part.chart.study is not None
    ends = find_endpoints(part.equations(), part.chart.study, _find_fixed_tip(part), enough)
    values = [[acb(v.real, v.imag) for v in row] for row in ends.solutions.tolist()]
    return ProposedSolutions(
        tuple(zip(values, ends.multiple, strict=True)), "homotopy", ends.infinite, ends.lost, ends.loose > 0, ends.far
    )


def _find_fixed_tip(part: PoseSystem) -> tuple[int, ...]:
    """Return the indices of the three equations of a fixed tip; none if there is none."""
    counts = [3 - part.chart.reaches[k].freedoms for k in part.legs]
    first = next((k for k, leg in enumerate(part.legs) if isinstance(part.chart.reaches[leg], Point)), None)
    if first is None or sum(counts) != part.chart.count - len(part.chart.own):
        return ()
    before = len(part.chart.own) + sum(counts[:first])
    return tuple(range(before, before + 3))


def propose_by_msolve(part: PoseSystem) -> ProposedSolutions | None:
    """All solutions, distinct ones once; None where they are infinitely many.

    Raises ``MissingExtra``, ``ExternalSolverFailure``."""
    equations, nonzero = part.equations(), part.chart.nonzero
    answer = parametrise(equations)
    if answer is None and nonzero is not None:
        answer, nonzero = parametrise(equations, nonzero), None
    if answer is None:
        return None
    solutions = find_all_solutions(answer.polynomial, lambda t, m: _solve_over(answer, nonzero, t, m))
    poses = tuple(solution for solution in solutions if not _is_extraneous(nonzero, solution[0]))
    lost = answer.polynomial.degree() - len(solutions)
    return ProposedSolutions(poses, "msolve's parametrisation", len(solutions) - len(poses), lost)


def enclose_roots(
    part: PoseSystem,
    proposed: ProposedSolutions,
    most: Bound | None = None,
    balls: Within = Balls,
    farthest: float = SOLUTION_DISTANCE_MAX,
) -> SolutionSet:
    """Return the proposals for a choice of legs, as :func:`solve_square` gives it; if a degree bounds their number,
    solutions at infinity are counted too."""
    from flint import ctx

    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        thick = part.equations(balls)
    roots = _Tips(balls, part.equations(), thick, part.chart).all_of(
        proposed.solutions, len(proposed.solutions) + proposed.lost, farthest
    )
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        apart = all(root.real and root.thick for root in roots.real) and _has_separate_boxes(
            part.chart,
            thick,
            [root.parameters for root in roots.real],
            [values for values in roots.values if not is_real(values)],
        )
    if roots.far and apart:
        apart = part.chart.study is None and _has_separate_far_boxes(part, roots.distant)
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT):
        wanted = most.most - roots.complex if most is not None and most.law == "degree" and apart else 0
        away = 0
        if wanted > 0 and proposed.far is not None and np.isfinite(farthest):
            away = count_beyond(part, balls, proposed.far, wanted)
    return replace(roots, extraneous=proposed.extraneous, apart=apart, beyond=away, method=proposed.method)


@dataclass(frozen=True, eq=False)
class _Tips(SolutionEncloser):
    """Solutions in the pose's own coordinates, identified by the positions of the legs' tips."""

    chart: PoseParametrization
    method = ""

    @cached_property
    def _rounded(self) -> list[MovingPoint]:
        return self.chart.tips(RoundedConic)

    @cached_property
    def _moving(self) -> list[MovingPoint]:
        return self.chart.tips(self.balls)

    def distance(self, values: Sequence[Any]) -> float:
        x = np.array([1.0, *(complex(v) for v in values)])
        return max(
            float(
                np.abs(np.einsum("i,ijd,j->d", x, tip.N.astype(float), x)).max()
                / (abs(x @ tip.w.astype(float) @ x) * UNIT + 1e-300)
            )
            for tip in self._rounded
        )

    def parameters(self, values: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(values)

    def misses(self, own: Sequence[Any], values: Sequence[Any]) -> tuple[float, ...]:
        x = np.array([1, *values], dtype=object)
        misses = []
        for tip in self._moving:
            w = (x @ tip.w @ x) * UNIT
            radii = [float(((x @ tip.N[:, :, k] @ x) / w).rad()) for k in range(tip.N.shape[2])]
            misses.append(2.0 * self.chart.frame.size * math.hypot(*radii))
        return tuple(misses)


def _has_separate_far_boxes(part: PoseSystem, far: Sequence[Sequence[Any]]) -> bool:
    """Return True if solutions of the rounded equations beyond ``SOLUTION_DISTANCE_MAX`` are enclosed, each unknown in
    its own size, no two in one box."""
    from flint import ctx

    boxes, quadrics = list[list[Any]](), combine_quadrics(part.equations())
    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT << PRECISION_DOUBLINGS_MAX):
        for values in far:
            sizes = [2 ** max(0, math.frexp(float(abs(v).upper()))[1]) for v in values]
            D = np.diag(np.array([1, *sizes], dtype=object))
            box = enclose_zero(
                [Quadric(D @ quadric.A @ D) for quadric in quadrics],
                [v / size for v, size in zip(values, sizes, strict=True)],
            )
            if box is None:
                return False
            boxes.append([v * size for v, size in zip(box, sizes, strict=True)])
        return all(any(not (v - w).contains(0) for v, w in zip(a, b, strict=True)) for a, b in combinations(boxes, 2))


def _has_separate_boxes(
    chart: PoseParametrization, thick: Sequence[Any], real: Sequence[Sequence[Any]], values: Sequence[Sequence[Any]]
) -> bool:
    """Return True if all solutions, ``real`` ones in their boxes already, have boxes with one pose each, and no two the
    same; complex ones with their conjugates, so that none is real."""
    boxes = list(real)
    upper = [solution for solution in values if next(float(v.imag) for v in solution if not v.imag.is_zero()) > 0]
    for start in upper:
        box = enclose_zero(thick, start)
        if box is None:
            return False
        boxes += [box, [v.conjugate() for v in box]]
    if 2 * len(upper) != len(values) or not all(_is_pose(chart, box) for box in boxes):
        return False
    if not boxes:
        return True
    m = np.array([[complex(v.mid()) for v in box] for box in boxes])
    r = np.array([[float(v.rad()) for v in box] for box in boxes]) * (
        1.0 + BOX_SEPARATION_TOL
    ) + BOX_SEPARATION_TOL * np.abs(m)
    touching = np.all(np.abs(m[:, None] - m[None]) <= r[:, None] + r[None], axis=2)
    return bool(touching.sum() == len(m))


def _is_pose(chart: PoseParametrization, box: Sequence[Any]) -> bool:
    """Return True if all of a box are poses, of a rigid body nearer than ``SOLUTION_DISTANCE_MAX``: |e|² below so many
    times |e·e|."""
    if chart.nonzero is None:
        return True
    ends, least = np.array([1, *box], dtype=object), float(chart.nonzero.value(box).abs_lower())
    if chart.study is None:
        return least > 0.0
    return sum(float(abs(e).upper()) ** 2 for e in chart.study[:4].astype(int) @ ends) < SOLUTION_DISTANCE_MAX * least


def _solve_over(answer: Parametrisation, nonzero: Quadric | None, t: Any, multiplicity: int) -> list[Solution]:
    """Return the solution over a root; none if it is not finite or not known to be a pose."""
    values = answer.others(t)
    if not all(is_sharp(v) for v in values):
        return []
    is_sure = nonzero is None or float(nonzero.value(values).rad()) < BALL_ZERO
    return [(values, multiplicity)] if is_sure else []


def _is_extraneous(nonzero: Quadric | None, values: Sequence[Any]) -> bool:
    """Return True if ``nonzero`` vanishes, to ``BALL_ZERO``, at complex coordinates."""
    from flint import ctx

    with ctx.workprec(ROOT_ISOLATION_BITS_COUNT << PRECISION_DOUBLINGS_MAX):
        return nonzero is not None and bool(nonzero.value(values).contains(0))
