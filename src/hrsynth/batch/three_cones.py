"""Bounds of the largest error for three cones and more.

E(w) = Σ √(wᵀ B_i w) is sought over unit w. Any w gives a lower bound; the ascent w ← Σ B_i w / √(wᵀ B_i w),
normalised, never makes E smaller (E is convex). Any weights t give the upper bound (1) of ``cones``, √λmax(Σ B_i /
t_i). The least of the upper bounds is the maximum of the concave

    F(Z) = Σ √tr(B_i Z)   over Z ⪰ 0 of trace one,                                                               (2)

of which E is the part Z = w wᵀ of rank one. So each round takes the weights t_i = √tr(B_i Z) / F(Z), at which (1) is
the best for this Z, and goes from Z towards w wᵀ, w the eigenvector of (1), which is where F rises most (Frank and
Wolfe), as far as F rises. It ends where the bounds meet; where the maximum of (2) has a higher rank than one they do
not, and both are reported: the maximum lies between.
"""

from __future__ import annotations

from typing import Any

from ..geometry.components import Components, dot, scale, sqrt, times, where
from .cones import choose_larger, clear_zero, compute_error_along, find_largest_eigenvalue, trace_root
from .program import Program

CONE_SET_GAP_TOL = 1e-10
"""Relative gap between the bounds at which a maximum over three or more cones is found."""

CONE_ASCENT_STEPS_COUNT = 10
"""Steps of the ascent from each of its starts; four times as many follow from the best end."""
CONE_BOUND_ROUNDS_MAX = 30
"""Rounds in which the upper bound is lowered."""
CONE_ROUND_BISECTIONS_COUNT = 10
"""Halvings with which the way of a round is found."""


def trace_three(program: Program, forms: list[str], go: str, name: str) -> None:
    """Add the upper and the lower bound ``name`` at poses where the flag ``go`` is positive."""
    k = len(forms)
    w, best, terms, upper, open_ = (f"{name}_{part}" for part in ("w", "best", "terms", "upper", "open"))

    def start(*given: Components) -> dict[str, Components]:
        B, (on,) = given[:k], given[k:]
        return {
            w: find_largest_eigenvalue(weigh(B, [1.0 / clear_zero(trace_root(each)) for each in B]))[1],
            best: [1.0, 0.0, 0.0, -1.0],
            open_: on,
        }

    def compare(*given: Components) -> dict[str, Components]:
        """Keep the better end with its E."""
        B, here, before = given[:k], given[k], given[k + 1]
        total = sum(compute_error_along(each, here) for each in B)
        return {best: [where(total > before[3], x, y) for x, y in zip([*here, total], before, strict=True)]}

    def ascend(*given: Components) -> dict[str, Components]:
        return {w: _take_ascent_step(given[:k], given[k]), open_: given[k + 1]}

    def primal(*given: Components) -> dict[str, Components]:
        B, here = given[:k], given[k]
        return {terms: [compute_error_along(each, here[:3]) for each in B], upper: [float("inf")]}

    def round_(*given: Components) -> dict[str, Components]:
        made = _round(given[:k], given[k][3], *given[k + 1 :])
        return dict(zip((terms, upper, open_), made, strict=True))

    with program.where(go):
        program.apply(start, *forms, go, state=(w, best, open_))
        for axis in (None, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]):
            if axis is not None:
                program.apply(lambda axis=axis: {w: axis})
            program.repeat(ascend, CONE_ASCENT_STEPS_COUNT, forms, (w, open_))
            program.apply(compare, *forms, w, best)
        program.apply(lambda best: {w: best[:3]}, best)
        program.repeat(ascend, 4 * CONE_ASCENT_STEPS_COUNT, forms, (w, open_))
        program.apply(compare, *forms, w, best)
        program.apply(primal, *forms, w, state=(terms, upper))
        program.repeat(round_, CONE_BOUND_ROUNDS_MAX, (*forms, best), (terms, upper, open_))
        program.apply(lambda upper, best: {name: [choose_larger(upper[0], best[3]), best[3]]}, upper, best)


def weigh(B: tuple[Components, ...], weights: Components) -> list[Any]:
    """Σ weight_i B_i."""
    return [sum(weight * form[j] for weight, form in zip(weights, B, strict=True)) for j in range(6)]


def _take_ascent_step(B: tuple[Components, ...], w: Components) -> list[Any]:
    """One step, w ← Σ B_i w / √(wᵀ B_i w), normalised."""
    pull: Any = [0.0, 0.0, 0.0]
    for form in B:
        gain = compute_error_along(form, w)
        share = where(gain > 0.0, 1.0, 0.0) / clear_zero(gain)
        pull = [x + y for x, y in zip(pull, scale(share, times(form, w)), strict=True)]
    size = sqrt(dot(pull, pull))
    return [where(size > 0.0, x / clear_zero(size), y) for x, y in zip(pull, w, strict=True)]


def _round(
    B: tuple[Components, ...], lower: Any, terms: Components, upper: Components, _: Components
) -> tuple[Components, Components, Components]:
    """One round: √tr(B_i Z) of the next Z, the least upper bound so far, 1 where it may become smaller yet."""
    floor = 1e-12 * sum(terms) + 1e-300
    roots = [choose_larger(term, floor) for term in terms]
    total = sum(roots)
    square, w = find_largest_eigenvalue(weigh(B, [total / root for root in roots]))
    bound = sqrt(choose_larger(square, 0.0))
    bound = where(bound < upper[0], bound, upper[0])
    here = [root * root for root in roots]
    rise = [dot(w, times(form, w)) - before for form, before in zip(B, here, strict=True)]
    share = _find_best_fraction(here, rise)
    return (
        [sqrt(choose_larger(before + share * more, 0.0)) for before, more in zip(here, rise, strict=True)],
        [bound],
        [where(bound > lower * (1 + CONE_SET_GAP_TOL), 1.0, 0.0)],
    )


def _find_best_fraction(here: Components, rise: Components) -> Any:
    """The γ of [0, 1] that makes Σ √(here + γ rise) largest, by halving: its slope falls."""
    low: Any = 0.0
    for halving in range(1, CONE_ROUND_BISECTIONS_COUNT + 1):
        middle = low + 0.5**halving
        slope = sum(more / sqrt(before + middle * more) for before, more in zip(here, rise, strict=True))
        low = where(slope > 0.0, middle, low)
    return low
