"""All poses by way of msolve, for tips on curves or surfaces: the pose's own coordinates are the unknowns.

msolve says how many solutions there are and where; each root of its polynomial is isolated here, and each real
solution enclosed, with existence and uniqueness proved, from the equations themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from ...tolerances import BALL_ZERO, BOXES_APART, FARTHEST
from .certify import Quadric, krawczyk
from .conics import UNIT, Balls, Rounded, Within
from .msolve import Parametrisation, parametrised
from .quadrics import Chart, Moving, Whole
from .roots import (
    PRECISION,
    PRECISIONS,
    Root,
    Roots,
    Solution,
    all_solutions,
    almost_real,
    boxed,
    gathered,
    is_real,
    nearer,
    sharp,
)
from .systems import System

METHOD = "msolve's parametrisation"


def wholes(system: System, number: int = 0) -> Iterator[Whole]:
    """The choices of legs with just as many equations as freedoms, then those with too many."""
    chart = system.chart(number)
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(range(len(system.curves)), size):
            if sum(system.forbids[k] for k in legs) == system.freedoms and not system.left(legs):
                yield Whole(legs, chart, size == len(system.curves))
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(sorted(range(len(system.curves)), key=lambda k: -system.forbids[k]), size):
            given = [system.forbids[k] for k in legs]
            if sum(given) > system.freedoms > sum(given[:-1]) and not system.left(legs):
                yield Whole(legs, chart, False)


def solve_whole(part: Whole, balls: Within = Balls, farthest: float = FARTHEST) -> Roots:
    """All solutions of a choice of legs, as :func:`solve_square`, distinct ones once.

    Raises ``MissingExtra``, ``Unsolved``."""
    from flint import ctx

    equations, nonzero = part.equations(), part.chart.nonzero
    answer = parametrised(equations)
    if answer is None and nonzero is not None:
        answer, nonzero = parametrised(equations, nonzero), None
    if answer is None:
        return Roots(complete=False, continuum=True, method=METHOD)
    found = all_solutions(answer.polynomial, lambda t, m: _over(answer, nonzero, t, m))
    poses = [each for each in found if not _no_pose(nonzero, each[0])]
    chart = part.chart
    tips = chart.tips(Rounded)
    resolved, far, undecided = nearer(poses, lambda values: _distance(tips, values), farthest)
    with ctx.workprec(PRECISION):
        thick = part.equations(balls)
        real = tuple(_enclosed(chart, balls, equations, thick, values, m)
                     for values, m in resolved if is_real(values))
        real += tuple(_middle(chart, balls, values) for values, _ in resolved if almost_real(values))
        apart = all(root.real and root.thick for root in real) and _apart(chart, thick, [
            *(root.parameters for root in real), *(values for values, _ in resolved if not is_real(values))])
    extraneous = len(found) - len(poses)
    roots = gathered(answer.polynomial.degree() - extraneous - far, resolved, real, METHOD)
    return replace(roots, extraneous=extraneous, apart=apart and not far, far=far, undecided=undecided,
                   complete=roots.complete and not undecided)


def _distance(tips: Sequence[Moving], values: Sequence[Any]) -> float:
    """How far away the tips of a solution are, complex ones too (sizes)."""
    x = np.array([1.0, *(complex(v) for v in values)])
    return max(float(np.abs(np.einsum("i,ijd,j->d", x, tip.N.astype(float), x)).max()
                     / (abs(x @ tip.w.astype(float) @ x) * UNIT + 1e-300)) for tip in tips)


def _apart(chart: Chart, thick: Sequence[Any], solutions: Sequence[Sequence[Any]]) -> bool:
    """Whether all solutions, real ones in their boxes already, have boxes with one pose each, and no two the same."""
    from flint import arb

    middles, radii = [], []
    for start in solutions:
        box = start if isinstance(start[0], arb) else krawczyk(thick, start)
        if box is None or (chart.nonzero is not None and chart.nonzero.value(box).contains(0)):
            return False
        middles.append([complex(v.mid()) for v in box])
        radii.append([float(v.rad()) * (1.0 + BOXES_APART) + BOXES_APART * abs(m)
                      for v, m in zip(box, middles[-1], strict=True)])
    if not middles:
        return True
    m, r = np.array(middles), np.array(radii)
    touching = np.all(np.abs(m[:, None] - m[None]) <= r[:, None] + r[None], axis=2)
    return bool(touching.sum() == len(m))


def _over(answer: Parametrisation, nonzero: Quadric | None, t: Any, multiplicity: int) -> list[Solution]:
    """The solution over a root; none where it is not finite or it cannot be told whether it is a pose."""
    values = answer.others(t)
    if not all(sharp(v) for v in values):
        return []
    told = nonzero is None or float(nonzero.value(values).rad()) < BALL_ZERO
    return [(values, multiplicity)] if told else []


def _no_pose(nonzero: Quadric | None, values: Sequence[Any]) -> bool:
    """Whether what vanishes at no pose vanishes, to ``BALL_ZERO``, at complex coordinates."""
    from flint import ctx

    with ctx.workprec(PRECISION << PRECISIONS):
        return nonzero is not None and bool(nonzero.value(values).contains(0))


def _enclosed(chart: Chart, balls: Within, equations: Sequence[Any], thick: Sequence[Any], values: Sequence[Any],
              multiplicity: int) -> Root:
    box, unique, wide = boxed(equations, thick, [v.real for v in values])
    return Root(tuple(box), _misses(chart, balls, box), 1 if unique else multiplicity, unique, wide)


def _middle(chart: Chart, balls: Within, values: Sequence[Any]) -> Root:
    """The real part of a conjugate pair, and how far its tips are from there at most."""
    wide = [v.real + v.imag.union(-v.imag) for v in values]
    return Root(tuple(v.real.mid() for v in values), _misses(chart, balls, wide), 2, False, False, False)


def _misses(chart: Chart, balls: Within, box: Sequence[Any]) -> tuple[float, ...]:
    """How far each leg's tip, in a box, is from that in its middle (m)."""
    x = np.array([1, *box], dtype=object)
    found = []
    for tip in chart.tips(balls):
        w = (x @ tip.w @ x) * UNIT
        radii = [float(((x @ tip.N[:, :, k] @ x) / w).rad()) for k in range(tip.N.shape[2])]
        found.append(2.0 * chart.frame.size * math.hypot(*radii))
    return tuple(found)
