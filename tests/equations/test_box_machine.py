"""Boxes through compiled code: the numbers of the arrays to the last bit, and enclosures of what balls say."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.equations import box_machine
from hrsynth.equations.box_formula import BoxFormula, trace_formula
from hrsynth.geometry.affine import AffineForms, enclose_sines, make_affine, stack
from hrsynth.geometry.components import cosine, sine, sqrt

flint = pytest.importorskip("flint")
INPUTS = 9
OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: b - a,
    "*": lambda a, b: a * b,
    "/": lambda a, _: 1.0 / a,
    "sqrt": lambda a, _: sqrt(a),
    "sin": lambda a, _: sine(a),
    "cos": lambda a, _: cosine(a),
}


def leaves(draw: Callable[..., Any], y: list[Any], number: Callable[[float], Any]) -> list[Any]:
    """Some expressions of inputs and a robot's numbers, drawn."""
    moving = list(y)
    known = [number(draw(st.floats(-3, 3))), number(0.3), draw(st.floats(-2, 2))]
    for _ in range(draw(st.integers(1, 12))):
        a, b = draw(st.sampled_from(moving)), draw(st.sampled_from(moving + known))
        kind = draw(st.sampled_from(sorted(OPERATIONS)))
        moving.append(OPERATIONS[kind](a, b))
        if not hasattr(moving[-1], "tape"):  # a product with zero, or a difference of equals
            moving.pop()
    return [*moving[-4:], known[0], 0.75]


def boxes(rng: np.random.Generator, count: int, bend: bool) -> list[AffineForms]:
    """Forms about random places: narrow, wide and of no width; the first may have the symbol of its bend."""
    half = rng.uniform(0, 1, (count, INPUTS)) * rng.choice([0.0, 1e-8, 0.01, 1.0], (count, 1))
    eye = np.eye(INPUTS + bend)[:INPUTS]
    return [
        make_affine(
            rng.uniform(-4, 4, count),
            half[:, i, None] * eye[i],
            1e-15 * half[:, i],
            INPUTS + 1 if bend and not i else None,
        )
        for i in range(INPUTS)
    ]


def same(one: AffineForms, other: AffineForms) -> bool:
    """Whether two forms have the same numbers, to the last bit."""
    return np.array_equal(one.v, other.v, equal_nan=True) and np.array_equal(one.r, other.r, equal_nan=True)


@settings(deadline=None)
@given(st.data(), st.integers(0, 1000), st.booleans(), st.sampled_from([2, 3, 16, 37]))
def test_compiled_code_gives_the_numbers_of_arrays(data: st.DataObject, seed: int, bend: bool, count: int) -> None:
    pytest.importorskip("numba")
    formula = trace_formula(lambda y, number: leaves(data.draw, y, number), INPUTS)
    forms = boxes(np.random.default_rng(seed), count, bend)
    one, other = stack(formula._rows(forms)), formula.machine.run(forms)
    assert same(one, other)


def test_small_work_stays_in_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    monkeypatch.setattr(box_machine.Work, "done", 0)
    formula = trace_formula(lambda y, number: [y[0] * y[1] + number(0.7), y[2]], INPUTS)
    forms = boxes(np.random.default_rng(0), 50, bend=False)
    monkeypatch.setattr(box_machine.MachineCode, "run", lambda *_: pytest.fail("compiled"))
    plain = formula.together(forms)
    monkeypatch.undo()
    monkeypatch.setattr(box_machine.Work, "done", 1e12)
    monkeypatch.setattr(BoxFormula, "_rows", lambda *_: pytest.fail("not compiled"))
    for each in (formula.together(forms), stack(formula.at(forms))):
        assert same(each, plain)


@settings(deadline=None)
@given(
    st.one_of(
        st.floats(-10, 10),
        st.floats(-1e6, 1e6),
        st.floats(-1e15, 1e15),
        st.builds(lambda k, off: k * math.pi / 4 + off, st.integers(-100_000, 100_000), st.floats(-1e-9, 1e-9)),
    )
)
def test_sines_are_those_of_balls(x: float) -> None:
    found, balls = enclose_sines(np.array([x])), flint.arb(x).sin_cos()
    for value, ball in zip(found, balls, strict=True):
        assert abs(flint.arb(float(value[0])) - ball) < 2.0**-50


@pytest.mark.parametrize("x", [np.nan, np.inf])
def test_sines_of_what_is_no_angle_warn_of_nothing(x: float) -> None:
    with np.errstate(all="raise"):
        found = enclose_sines(np.array([x]))
    assert all(each.shape == (1,) for each in found)


@settings(deadline=None)
@given(st.integers(0, 1000))
def test_forms_hold_what_balls_say(seed: int) -> None:
    """A formula with all operations, at random places of boxes, in numbers of 200 bits."""

    def formula(y: list[Any], number: Callable[[float], Any]) -> list[Any]:
        return [
            sine(y[0]) * cosine(y[1]) - y[2] / 3.0,
            1.0 / (y[0] * y[0] + 0.5),
            sqrt(y[1] * y[1] + 0.25) * number(0.3),
        ]

    rng = np.random.default_rng(seed)
    forms = boxes(rng, 20, bend=False)
    found = trace_formula(formula, INPUTS, off=0.0).together(forms)
    noise = rng.uniform(-1, 1, (20, INPUTS))
    before, flint.ctx.prec = flint.ctx.prec, 200
    try:
        for k in range(20):
            a, b, c, *_ = (
                flint.arb(float(each.v[0, k]))
                + sum(
                    (flint.arb(float(s)) * float(e) for s, e in zip(each.v[1:, k], noise[k], strict=True)), flint.arb(0)
                )
                for each in forms
            )
            exact = [a.sin() * b.cos() - c / 3, 1 / (a * a + 0.5), (b * b + 0.25).sqrt() * 0.3]
            for j, value in enumerate(exact):
                low, high = (float(getattr(found[..., j], side)[k]) for side in ("low", "high"))
                if math.isfinite(low) and math.isfinite(high):
                    assert low <= value <= high, (k, j)
    finally:
        flint.ctx.prec = before
