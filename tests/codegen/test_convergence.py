"""Steps and errors that are proved of generated programs, against arithmetic with fifty digits."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from codegen.robots import box_of, module_of
from codegen.test_points import FORMS, HALF, made
from hrsynth.analysis.branch.carried_vectors import SweptChains, Total, add_bend, build_row_product
from hrsynth.analysis.branch.loops import build_loop_system, evaluate_residuals
from hrsynth.budgets import GENERATED_NEWTON_STEPS_MAX
from hrsynth.codegen import convergence
from hrsynth.codegen.branch_cells import TubedBranch
from hrsynth.codegen.export import export
from hrsynth.codegen.rounding import RoundedNumber
from hrsynth.codegen.source import Source
from hrsynth.codegen.trace import TracedFunction
from hrsynth.geometry.vectors import Array
from hrsynth.present.text.robots import describe_export

WIDTHS = {**FORMS, **HALF}


def exactly(function: TracedFunction, q: Any, x: Any) -> dict[str, dict[tuple[int, ...], Any]]:
    """What a function stores, with fifty digits."""
    names: dict[str, Any] = {"q": q, "x": x, "sin": mpmath.sin, "cos": mpmath.cos}
    for name, text in function.statements:
        names[name] = eval(text, names)
    found: dict[str, dict[tuple[int, ...], Any]] = {}
    for array, place, value in function.stores:
        found.setdefault(array, {})[place] = names[value] if value in names else mpmath.mpf(float(value))
    return found


def closure(source: Source, q: list[Any], x: list[Any]) -> list[Any]:
    """The zero of a program's equations near x, by Newton's method."""
    x = list(x)
    for part in source.parts:
        p = len(part.unknowns)
        for _ in range(6):
            at = exactly(part.equations, q, x)
            J = mpmath.matrix(p, p)
            for place, value in at.get("J", {}).items():
                J[place] = value
            step = mpmath.lu_solve(J, mpmath.matrix([at["G"].get((i,), 0) for i in range(p)]))
            for i, k in enumerate(part.unknowns):
                x[k] -= step[i]
        assert max(abs(each) for each in step) < mpmath.mpf(10) ** -40
    return x


def points(source: Source, count: int) -> Array:
    """Motors at corners of cells, at their faces and inside."""
    rng, branch_ = np.random.default_rng(0), source.branch
    found = np.empty((0, len(branch_.motors)))
    for part in source.parts:
        cells = part.bounded
        for k in rng.permutation(len(cells))[:4]:
            cell, near = cells[k].cell, list(part.motors)
            corners = np.array(list(product(*zip(cell.lower, cell.upper, strict=True))))[:count]
            inside = rng.uniform(cell.lower, cell.upper, size=(count, len(near)))
            inside[: count // 2, 0] = cell.lower[0]
            at = np.zeros((len(corners) + count, len(branch_.motors)))
            at[:, near] = np.vstack([corners, inside])
            found = np.vstack([found, at])
    return found


def check(name: str, count: int, exact: int) -> None:
    """All points are answered in the proved number of steps, and the answers are within the proved errors."""
    robot = made(name)
    found = export(robot, "numpy", box_of(robot, WIDTHS[name]))
    bounds = found.bounds
    assert bounds is not None
    assert bounds.steps <= 5
    assert bounds.error < 3e-12
    source = Source.of(TubedBranch.of(found.proof), ())
    program: Any = module_of(found.code)
    assert bounds.steps == program.STEPS
    q = points(source, count)
    status, x, R, p = program.forward(q)
    assert set(status) == {program.OK}
    program.STEPS = 1
    assert program.UNDECIDED in program.forward(q)[0]
    units = np.array([source.branch.unit(i) for i in source.branch.passive])
    with mpmath.workdps(50):
        for k in np.random.default_rng(1).permutation(len(q))[:exact]:
            motors = [mpmath.mpf(float(each)) for each in q[k]]
            answer = [mpmath.mpf(float(each)) for each in x[k, : len(units)]]
            true = closure(source, motors, answer)
            assert max(abs(a - b) / u for a, b, u in zip(answer, true, units, strict=True)) <= bounds.joints
            at = exactly(source.platform, motors, true)
            assert max(abs(value - R[k][place]) for place, value in at["R"].items()) <= bounds.rotation
            off = max(abs(value - p[k][place]) for place, value in at["p"].items())
            assert off / robot.length <= bounds.position


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["four_bar", "3rps"])
def test_steps_and_errors_are_as_proved(name: str) -> None:
    check(name, 40, 4)


@pytest.mark.some(0, 4)
@pytest.mark.parametrize("name", sorted(WIDTHS))
def test_steps_and_errors_of_every_form(name: str) -> None:
    check(name, 400, 30)


@settings(max_examples=12, deadline=None)
@given(st.sampled_from(["rrrrr_m1", "3rps", "delta", "gough_stewart", "3prp"]), st.integers(0, 100))
def test_second_derivatives_of_loops(name: str, seed: int) -> None:
    """They are those of the first ones, by differences."""
    robot, rng = hrsynth.load(name), np.random.default_rng(seed)
    system = build_loop_system(robot, [each for each, joint in robot.joints.items() if joint.is_actuated])
    values, h = rng.uniform(-0.7, 0.7, len(system.coordinates)), 1e-5
    carrier = SweptChains(system, [values[None, i] for i in range(len(values))])
    for loop in system.loops:
        whole = [Total(np.zeros(1), 2 * (len(values),)) for _ in loop.rows]
        for bend, row in zip(whole, loop.rows, strict=True):
            add_bend(bend, build_row_product(carrier, loop, row))
        for j in loop.coordinates:
            moved = values.copy(), values.copy()
            moved[0][j] += h
            moved[1][j] -= h
            up, down = (evaluate_residuals(system, loop, list(each), loop.rows)[1] for each in moved)
            for bend, after, before in zip(whole, up, down, strict=True):
                for i in after:
                    rate = (np.asarray(after[i]) - np.asarray(before[i])) / (2 * h)
                    assert np.allclose(bend.sum[0, i, j], rate, atol=1e-8)


NUMBERS = st.floats(-4, 4).filter(lambda v: v == 0 or abs(v) > 1e-6)


@st.composite
def formulas(draw: Any, depth: int = 5) -> tuple[Any, Any, RoundedNumber]:
    """A formula's value in floats, exactly, and its bounds."""
    if depth == 0 or draw(st.booleans()):
        value, wide = draw(NUMBERS), draw(st.floats(0, 0.5))
        number = np.float64(value)
        return number, mpmath.mpf(float(number)), RoundedNumber.between(number - wide, number + wide)
    kind = draw(st.sampled_from(["+", "-", "*", "sin", "cos", "scale"]))
    a = draw(formulas(depth - 1))
    if kind in ("sin", "cos"):
        return getattr(np, kind)(a[0]), getattr(mpmath, kind)(a[1]), getattr(a[2], kind)()
    if kind == "scale":
        k = draw(NUMBERS)
        return k * a[0], mpmath.mpf(k) * a[1], k * a[2]
    b = draw(formulas(depth - 1))
    if kind == "*":
        return a[0] * b[0], a[1] * b[1], a[2] * b[2]
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2]) if kind == "+" else (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@settings(deadline=None)
@given(formulas())
def test_running_errors_hold(formula: tuple[Any, Any, RoundedNumber]) -> None:
    computed, exact, bounds = formula
    with mpmath.workdps(60):
        assert abs(mpmath.mpf(float(computed)) - exact) <= mpmath.mpf(float(bounds.error))
    assert abs(float(computed)) <= float(bounds.size) * (1 + 1e-12)
    assert float(bounds.low) - 1e-12 <= float(exact) <= float(bounds.high) + 1e-12


@pytest.mark.slow
def test_axes_that_are_parallel_but_for_rounding() -> None:
    """Loops that close to less than the program asks for are open: it says that it finds out."""
    robot, rng = made("four_bar"), np.random.default_rng(0)

    def off(axis: Array) -> Array:
        axis = axis + 1e-9 * rng.normal(size=3)
        return np.asarray(axis / np.linalg.norm(axis))

    robot = replace(
        robot, joints={name: replace(joint, axes=tuple(map(off, joint.axes))) for name, joint in robot.joints.items()}
    )
    found = export(robot, "numpy", box_of(robot, 0.05))
    assert found.bounds is not None
    assert found.bounds.others == 3
    assert "At run time the program checks that each of 3 more equations of the loops holds." in found.code
    assert "3 more equations" in describe_export(found)
    alone = replace(found.bounds, others=1)
    assert alone.more == "one more equation of the loops holds"
    program: Any = module_of(found.code)
    assert set(program.forward(np.linspace(*found.proof.proved, 50))[0]) <= {program.OK, program.UNDECIDED}


@pytest.mark.slow
def test_faces_of_cells_are_answered() -> None:
    """Where a branch fills a part of its box alone, all closed cells are answered."""
    robot = made("geared")
    found = export(robot, "numpy")
    assert found.proof.parts[0].volume_fraction < 0.9
    rng, q = np.random.default_rng(0), []
    for cell in found.proof.parts[0].cells:
        for axis, end in product(range(len(cell.low)), (cell.low, cell.high)):
            at = rng.uniform(cell.low, cell.high, (3, len(cell.low)))
            at[:, axis] = end[axis]
            q.append(at)
    program: Any = module_of(found.code)
    assert set(program.forward(np.vstack(q))[0]) == {program.OK}


def test_a_cell_without_a_bound_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where cells are not halved some have none: the program says so, and takes the usual steps."""
    monkeypatch.setattr(convergence, "BOUND_SIDE_HALVINGS_MAX", 0)
    robot = made("four_bar")
    found = export(robot, "numpy", box_of(robot, HALF["four_bar"]))
    assert found.bounds is None
    assert found.to_dict()["steps"] is found.to_dict()["error"] is None
    assert "is not proved in all cells" in found.code
    assert "not bounded in all cells" in describe_export(found)
    assert module_of(found.code).STEPS == GENERATED_NEWTON_STEPS_MAX
