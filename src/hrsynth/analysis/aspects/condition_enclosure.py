"""Proofs along a path: in every interval of it all legs reach, and the condition's value is enclosed away from zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...constraints.condition import NamedCondition, compute_leg_rows
from ...geometry.balls import (
    Field,
    bound_norm_below,
    check_finite,
    check_positive,
    enclose_intervals,
    evaluate_mean_value_form,
    make_ball_jets,
)
from ...geometry.vectors import Array, cross, dot, triple
from ...solving.exhaust import SETTLED, Boxes, Exhaustion
from .leg_forms import LegForms
from .path_segments import StraightSegment, WorkingModeChange
from .vector_expressions import collect_subchains

PATH_FIRST_INTERVALS_COUNT = 4
"""Initial number of intervals of a path that is to be proved free of singularities."""
FINEST_INTERVAL = 2.0**-16
"""Smallest interval (fraction of its path) of such a proof."""

PathSegment = StraightSegment | WorkingModeChange
Leading = tuple[int, Field] | None


@dataclass(frozen=True, eq=False)
class ConditionEnclosure:
    """Value of the condition at poses: of a signed condition its expression, else the smallest singular value of its
    rows (of balls, a lower bound of it)."""

    condition: NamedCondition
    forms: LegForms

    @property
    def has_sign(self) -> bool:
        """True if the value has a sign."""
        return has_sign_change(self.condition)

    @property
    def unlimited(self) -> ConditionEnclosure:
        """Enclosure without joint limits."""
        return replace(self, forms=replace(self.forms, bounds=()))

    def raw(self, p: Field, R: Field, leading: Leading = None) -> tuple[Field, Field]:
        """Return reach margins (n, subchains) and the expression (n,) of a condition with a sign, for numbers, balls or
        jets."""
        found = self.forms.at(p, R, leading)
        names, run = _compile(self.condition.expression)
        return found.reach_margins, run(*(found.values[name] for name in names))

    def at(self, p: Field, R: Field, leading: Leading = None) -> tuple[NDArray[np.bool_], Field]:
        """Return whether all legs reach, (n,), and the value, (n,), at poses (n, 3), (n, 3, 3); NaN or not a number
        where they do not; ``leading`` as for :meth:`LegForms.at`."""
        if self.has_sign:
            reach_margins, value = self.raw(p, R, leading)
            return np.asarray(check_positive(reach_margins).all(axis=1)), value
        found = self.forms.at(p, R, leading)
        reached = np.asarray(check_positive(found.reach_margins).all(axis=1))
        if p.dtype == object:
            return reached, np.array(
                [
                    _bound_smallest_value(
                        {name: value[i : i + 1] for name, value in found.values.items()}, self.condition
                    )
                    if reached[i]
                    else 0.0
                    for i in range(len(p))
                ]
            )
        values = np.full(len(p), np.nan)
        blocks = compute_leg_rows(self.condition.pattern, found.values)
        values[reached] = np.linalg.svd(blocks[reached], compute_uv=False)[:, -1]
        return reached, values

    def bounds(self, way: PathSegment, low: Array, high: Array) -> Array:
        """Return lower bounds of |value| on intervals of a segment, (n,); 0 where reach or value is not proved. Where a
        value contains zero its mean value form is tried, which is sharper on short intervals."""
        boxes = enclose_intervals(low, high)
        sure, value = self.at(*way.at(boxes))
        found = np.where(sure, bound_norm_below(value), 0.0)
        weak = sure & (found == 0) & check_finite(value)
        if not self.has_sign or not weak.any():
            return found
        middle = (low[weak] + high[weak]) / 2
        middles, moving = (
            self.raw(*way.at(enclose_intervals(middle, middle))),
            self.raw(*way.at(make_ball_jets(boxes[weak]))),
        )
        found[weak] = bound_norm_below(evaluate_mean_value_form(middles[1], moving[1], boxes[weak] - middle))
        return found


@lru_cache(maxsize=64)
def _compile(expression: Any) -> tuple[list[str], Callable[..., Any]]:
    """Return the symbols of an expression in vectors, and the function of them, for numbers, balls and jets."""
    import sympy

    names = sorted(str(symbol) for symbol in expression.free_symbols)
    products = {"dot": dot, "cross": cross, "det": triple}
    return names, sympy.lambdify([sympy.Symbol(name) for name in names], expression, modules=[products])


def has_sign_change(condition: NamedCondition) -> bool:
    """Return True if a condition's expression is one in vectors and changes its sign across the locus."""
    import sympy

    return condition.signed and not isinstance(condition.expression, sympy.Determinant)


@dataclass(frozen=True)
class Proof:
    """Proof that a segment is free of singularities: the smallest enclosed |value| on it (0 if not proved), and the
    number of intervals used."""

    proved: bool
    margin: float
    boxes: int


def prove(enclosure: ConditionEnclosure, way: PathSegment, budget: int) -> Proof:
    """Enclose reach and value along a segment by bisection with at most ``budget`` intervals.

    Stops as soon as a midpoint is out of reach or on the other side, or an interval is too short.
    """
    side, margin, boxes = 0.0, np.inf, 0

    def judge(middle: Array, half: Array) -> Boxes:
        nonlocal side, margin, boxes
        at, room = middle[:, 0], half[:, 0]
        reached, values = enclosure.at(*way.at(at))
        sides = np.sign(values)
        side = side or float(sides[0])
        if not reached.all() or np.any(sides != side) or side == 0:
            return middle, half, np.full(len(at), SETTLED - 1)
        boxes += len(at)
        bounds = enclosure.bounds(way, at - room, at + room)
        margin = float(np.min(bounds[bounds > 0], initial=margin))
        axis = np.where(bounds > 0, SETTLED, np.where(2 * room < FINEST_INTERVAL, SETTLED - 1, 0))
        return middle, half, axis

    middle = (np.arange(PATH_FIRST_INTERVALS_COUNT)[:, None] + 0.5) / PATH_FIRST_INTERVALS_COUNT
    half = np.full_like(middle, 0.5 / PATH_FIRST_INTERVALS_COUNT)
    proved = Exhaustion(judge, (middle, half), budget).run().is_settled
    return Proof(proved, margin if proved else 0.0, boxes)


def enclose_value(enclosure: ConditionEnclosure, p: Array, R: Array) -> tuple[bool, float]:
    """Return whether all poses within ``tolerances.HIDDEN_ROBOT_RESIDUAL_TOL`` of one are reached, and a bound of the
    value with its sign: the value among them that is nearest to zero (0 if zero is among them)."""
    here = StraightSegment(p, R, np.zeros(3), np.zeros(3))
    reached, values = enclosure.at(*here.at(enclose_intervals([0.0], [0.0])))
    _, middle = enclosure.at(*here.at(np.zeros(1)))
    return bool(reached[0]), float(np.sign(middle[0]) * bound_norm_below(values)[0])


def is_beyond(enclosure: ConditionEnclosure, p: Array, R: Array) -> bool:
    """Return True if a joint is proved to be beyond its limits at one pose, in any working mode of the subchains that
    the condition does not contain. Only joints whose coordinate follows from the pose and the other subchains are
    tested."""
    forms = enclosure.forms
    known = collect_subchains(tuple(forms.vectors.values()))
    forms = replace(forms, bounds=tuple(bound for bound in forms.bounds if collect_subchains(bound) <= known))
    margins = forms.at(
        *StraightSegment(p, R, np.zeros(3), np.zeros(3)).at(enclose_intervals([0.0], [0.0]))
    ).reach_margins
    return bool(check_positive(-margins[:, len(forms.subchains) :]).any())


def _bound_smallest_value(values: dict[str, Field], condition: NamedCondition) -> float:
    """Return a lower bound of the smallest singular value of rows A of balls, (d columns): with B a pseudo-inverse of
    their midpoints, σ ≥ (1 − |I − B A|) / |B|."""
    from flint import arb_mat

    A = compute_leg_rows(condition.pattern, values)[0]
    count, size = A.shape
    middle = np.array([float(getattr(x, "mid", lambda x=x: x)()) for x in A.flat]).reshape(A.shape)
    if not np.all(np.isfinite(middle)):
        return 0.0
    B = np.linalg.pinv(middle)
    inverse = arb_mat(size, count, B.ravel().tolist())
    product = inverse * arb_mat(count, size, A.ravel().tolist())
    bound = (
        1 - _enclose_frobenius_norm(product - arb_mat(size, size, np.eye(size).ravel().tolist()))
    ) / _enclose_frobenius_norm(inverse)
    return float(np.nextafter(float(bound.lower()), 0.0)) if bound > 0 else 0.0


def _enclose_frobenius_norm(matrix: Any) -> Any:
    """Return an enclosure of the largest Frobenius norm of the matrices in one of balls."""
    entries = [x.abs_upper() for x in matrix.entries()]
    return sum((x * x for x in entries[1:]), start=entries[0] * entries[0]).sqrt()
