"""Largest platform error if each direction has an error of up to its cone's half-angle (docs/pages/proofs.md, section
10).

With B_i = ψ_i² A_i A_iᵀ (A_i: from the error of direction i to the platform's), the largest error is the maximum
over unit w of E(w) = Σ √(wᵀ B_i w). One cone: √λmax(B). Two cones: exact, here. Three and more: bounds,
``three_cones``.

Upper bounds. For positive weights t of sum one, by Cauchy and Schwarz,

    E(w)² = (Σ √t_i · √(wᵀ B_i w / t_i))² ≤ Σ wᵀ B_i w / t_i ≤ λmax(Σ B_i / t_i).                               (1)

For two cones the least of these bounds is the maximum itself: it is that over the convex hull of the points (wᵀ B₁
w, wᵀ B₂ w), and on the unit sphere of ℝ³ these make up a convex set (L. Brickman, On the field of values of a matrix,
Proc. AMS 12, 1961).
"""

from __future__ import annotations

from typing import Any

from ..geometry.components import Components, build_tangents, dot, normalise, plus, scale, sqrt, times, where
from .program import Program

CONE_PAIR_GAP_TOL = 1e-14
"""Relative gap between the bounds at which a maximum over two cones is found."""
FLAT_CONE_FRACTION = 1e-20
"""Fraction of a cone's largest squared error below which its term has no derivative."""

CONE_PAIR_NEWTON_STEPS_MAX = 12
"""Steps after which the direct way to the maximum of two cones is given up."""
CONE_PAIR_STARTS_COUNT = 3
"""Starts of that way: the later ones from the end of the one before, where another maximum is larger."""
CONE_WEIGHT_EVALUATIONS_MAX = 60
"""Evaluations after which the search of two cones' weights ends."""


def compute_error_along(B: Components, w: Components) -> Any:
    """√(wᵀ B w)."""
    return compute_root(dot(w, times(B, w)))


def choose_larger(a: Any, b: Any) -> Any:
    """The larger of two numbers."""
    return where(a > b, a, b)


def clear_zero(x: Any) -> Any:
    """A number by which one may divide: itself, or 1 where it is not positive."""
    return where(x > 0.0, x, 1.0)


def trace_root(B: Components) -> Any:
    """√tr B."""
    return sqrt(B[0] + B[1] + B[2])


def compute_root(x: Any) -> Any:
    return sqrt(choose_larger(x, 0.0))


def find_largest_eigenvalue(B: Components) -> tuple[Any, list[Any]]:
    """The largest eigenvalue and its eigenvector of a symmetric matrix, without branches.

    N, the matrix without its mean and of unit spread, has the eigenvalues 2 cos(φ + 2πk/3), 2 cos 3φ = det N. Of these
    the one with the sign of det N, ±y, is apart from the others by √3 at least: y³ − 3 y = |det N| by Newton's method
    from its chord. Its eigenvector v is a column of the adjugate; the other two lie in the plane normal to v.
    """
    mean = (B[0] + B[1] + B[2]) * (1 / 3)
    x, y, z, f, g, h = B[0] - mean, B[1] - mean, B[2] - mean, B[3], B[4], B[5]
    spread = sqrt((x * x + y * y + z * z + 2.0 * (f * f + g * g + h * h)) * (1 / 6))
    x, y, z, f, g, h = N = [entry / clear_zero(spread) for entry in (x, y, z, f, g, h)]
    half = 0.5 * (x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y))
    upper, size = half >= 0.0, abs(half)
    root = 3**0.5 + (2 - 3**0.5) * size
    for _ in range(3):
        square = root * root
        root = 2.0 * (root * square + size) / (3.0 * square - 3.0)
    apart = where(upper, root, -root)
    v = _find_null_vector([x - apart, y - apart, z - apart, f, g, h])
    e, t = build_tangents(v)
    Ne = times(N, e)
    ee, et = dot(e, Ne), dot(t, Ne)
    gap = ee + 0.5 * apart  # half of ee − tt, as the trace is zero
    reach = sqrt(gap * gap + et * et)
    cosine, sine = where(gap >= 0.0, gap + reach, et), where(gap >= 0.0, et, reach - gap)
    length = sqrt(cosine * cosine + sine * sine)
    cosine = where(length > 0.0, cosine, 1.0) / clear_zero(length)
    sine = sine / clear_zero(length)
    w = [where(upper, a, b * cosine + c * sine) for a, b, c in zip(v, e, t, strict=True)]
    return mean + spread * where(upper, apart, reach - 0.5 * apart), w


def _find_null_vector(N: Components) -> list[Any]:
    """The unit null vector of a singular symmetric matrix: the adjugate's column with the largest diagonal entry."""
    x, y, z, f, g, h = N
    xx, yy, zz = y * z - h * h, x * z - g * g, x * y - f * f
    xy, xz, yz = g * h - f * z, f * h - g * y, f * g - h * x
    a, b, c = abs(xx), abs(yy), abs(zz)
    first, second = (a >= b) & (a >= c), b >= c
    w = [
        where(first, *pair)
        for pair in ((xx, where(second, xy, xz)), (xy, where(second, yy, yz)), (xz, where(second, yz, zz)))
    ]
    square = dot(w, w)
    size = sqrt(clear_zero(square))
    return [where(square > 0.0, w[0] / size, 1.0), w[1] / size, w[2] / size]


def trace_two(program: Program, forms: list[str], go: str, name: str, *, direct: bool = True) -> None:
    """Add the maximum of two cones where the flag ``go`` is positive: by Newton's method, started again where another
    maximum is larger, and by the weights of its dual where that proves nothing (or not ``direct``)."""
    w, value, open_, rest, bracket, least = (f"{name}_{part}" for part in ("w", "value", "open", "rest", "t", "least"))
    state, dual = (w, value, open_), (bracket, least, rest)

    def begin(B: Components, C: Components, go: Components, *before: Components) -> dict[str, Components]:
        """w of the largest eigenvalue of B / √tr B + C / √tr C, or of B / a + C / b at the w before."""
        a, b = (
            (compute_error_along(B, before[0]), compute_error_along(C, before[0]))
            if before
            else (trace_root(B), trace_root(C))
        )
        start = find_largest_eigenvalue(_weigh(B, C, clear_zero(a), clear_zero(b)))[1]
        if not before:
            return {w: start, value: [-1.0], open_: go}
        return {w: start, value: before[1], open_: [where(before[1][0] >= 0.0, 0.0, go[0])]}

    def unproved(go: Components, value: Components) -> dict[str, Components]:
        return {rest: [where(value[0] >= 0.0, 0.0, go[0])]}

    def chosen(value: Components, least: Components) -> dict[str, Components]:
        return {name: 2 * [where(value[0] >= 0.0, value[0], least[0])]}

    program.apply(begin, *forms, go, state=state)
    program.repeat(
        lambda *given: dict(zip(state, _take_newton_step(*given), strict=True)),
        CONE_PAIR_NEWTON_STEPS_MAX * direct,
        forms,
        state,
    )
    program.apply(unproved, go, value, state=[rest])
    program.apply(lambda value: {name: 2 * [value[0]]}, value, state=[name])
    with program.where(rest):
        for _ in range((CONE_PAIR_STARTS_COUNT - 1) * direct):
            program.apply(begin, *forms, go, *state, state=state)
            program.repeat(
                lambda *given: dict(zip(state, _take_newton_step(*given), strict=True)),
                CONE_PAIR_NEWTON_STEPS_MAX,
                forms,
                state,
            )
        program.apply(unproved, go, value)
        program.apply(lambda *given: dict(zip(dual, _bracket(*given), strict=False)), *forms, state=dual[:2])
        program.repeat(
            lambda *given: dict(zip(dual, _split_bracket(*given), strict=True)),
            CONE_WEIGHT_EVALUATIONS_MAX,
            forms,
            dual,
        )
        program.apply(chosen, value, least)


def _weigh(B: Components, C: Components, a: Any, b: Any) -> list[Any]:
    """B / a + C / b."""
    return [x / a + y / b for x, y in zip(B, C, strict=True)]


def _take_newton_step(
    B: Components, C: Components, w: Components, value: Components, _: Components
) -> tuple[Components, ...]:
    """A step of Newton's method on the sphere from w; where the sum is not concave, one of the ascent instead. The next
    w, the maximum where it is proved, and 1 where it goes on.

    A stationary w is an eigenvector of S = B / a + C / b, a = √(wᵀBw) and b = √(wᵀCw), to the eigenvalue a + b; it is
    the maximum if no other is larger.
    """
    Bw, Cw = times(B, w), times(C, w)
    aa, bb = dot(w, Bw), dot(w, Cw)
    sound = (aa > FLAT_CONE_FRACTION * (B[0] + B[1] + B[2])) & (bb > FLAT_CONE_FRACTION * (C[0] + C[1] + C[2]))
    a, b = sqrt(aa), sqrt(bb)
    total, S, (e, f) = a + b, _weigh(B, C, a, b), build_tangents(w)
    be, bf, ce, cf = dot(Bw, e) / a, dot(Bw, f) / a, dot(Cw, e) / b, dot(Cw, f) / b
    Se = times(S, e)
    # S − (a + b) on the tangents, then the Hessian of the sum and its gradient
    ee, ef, ff = dot(Se, e) - total, dot(Se, f), dot(times(S, f), f) - total
    hee, hef, hff = ee - be * be / a - ce * ce / b, ef - be * bf / a - ce * cf / b, ff - bf * bf / a - cf * cf / b
    ge, gf, det = be + ce, bf + cf, hee * hff - hef * hef
    onto_e, onto_f = (hef * gf - hff * ge) / det, (hef * ge - hee * gf) / det
    rising = sound & (det > 0.0) & (hee < 0.0)
    there = rising & (onto_e * ge + onto_f * gf <= CONE_PAIR_GAP_TOL * total)
    proved = there & (ee * ff >= ef * ef) & (ee <= 0.0)
    step = plus(w, plus(scale(onto_e, e), scale(onto_f, f)))
    ahead = normalise([where(rising, x, u / a + v / b) for x, u, v in zip(step, Bw, Cw, strict=True)])
    on = where(sound, where(there, 0.0, 1.0), 0.0)
    return ([where(on > 0.0, x, y) for x, y in zip(ahead, w, strict=True)], [where(proved, total, value[0])], [on])


def _bracket(B: Components, C: Components) -> tuple[Components, Components]:
    """The weight t to begin with, a bracket of it with the values of a (1 − t) − b t there, a count; no bound yet."""
    first, second = trace_root(B), trace_root(C)
    return [first / clear_zero(first + second), 0.0, 1.0, first, -second, 0.0], [float("inf")]


def _split_bracket(
    B: Components, C: Components, bracket: Components, least: Components, _: Components
) -> tuple[Components, ...]:
    """A step to the least bound (1) of two cones: at the weight t where a (1 − t) − b t changes its sign, by the rule
    of false position on a bracket; a and b are the two terms at the eigenvector. Where the largest eigenvalue is double
    there, the sign changes by a jump."""
    t, low, high, below, above, count = bracket
    t = where(t < 1e-12, 1e-12, where(t > 1 - 1e-12, 1 - 1e-12, t))
    square, w = find_largest_eigenvalue(_weigh(B, C, t, 1.0 - t))
    a, b = compute_error_along(B, w), compute_error_along(C, w)
    total, off, bound = a + b, a * (1.0 - t) - b * t, compute_root(square)
    rising = off > 0.0
    low, high = where(rising, t, low), where(rising, high, t)
    below, above = where(rising, off, below / 2), where(rising, above / 2, off)
    on = (off * off > CONE_PAIR_GAP_TOL * t * (1.0 - t) * total * total) & (high - low > 1e-15)
    fixed = a / clear_zero(total)
    straight = low + (high - low) * below / clear_zero(below - above)
    third = (fixed > low) & (fixed < high) & (count < 0.5)
    return (
        [where(third, fixed, straight), low, high, below, above, where(count > 1.5, 0.0, count + 1.0)],
        [where(bound < least[0], bound, least[0])],
        [where(on, 1.0, 0.0)],
    )
