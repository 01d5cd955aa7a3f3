"""Expressions against determinants of velocity equations, exactly, at random rational vectors."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pytest
import sympy

from analysis.singularity.found import found
from hrsynth.constraints.condition import NamedCondition
from hrsynth.constraints.named_vectors import Tangent
from hrsynth.constraints.vector_algebra import evaluate, load_products, make_vector
from hrsynth.geometry.screws import force

SEEDS = range(4)
Vectors = dict[str, sympy.Matrix]


def components(expression: Any) -> Any:
    """The expression as a polynomial in coordinates ``u1_x`` … of its vectors."""
    dot, cross, det = load_products()

    def expand(node: Any) -> Any:
        if isinstance(node, sympy.Symbol):
            return sympy.Matrix(sympy.symbols([f"{node.name}_{axis}" for axis in "xyz"]))
        if node.func is dot:
            return expand(node.args[0]).dot(expand(node.args[1]))
        if node.func is cross:
            return expand(node.args[0]).cross(expand(node.args[1]))
        if node.func is det:
            a, b, c = map(expand, node.args)
            return a.dot(b.cross(c))
        if node.is_Number:
            return node
        parts = [expand(argument) for argument in node.args]
        total = parts[0]
        for part in parts[1:]:
            total = total + part if node.is_Add else total**part if node.is_Pow else total * part
        return total

    return expand(expression)


def rational(rng: np.random.Generator, size: int = 3) -> sympy.Matrix:
    return sympy.Matrix([sympy.Rational(int(rng.integers(-9, 10)), int(rng.integers(1, 6))) for _ in range(size)])


def at(expression: Any, vectors: Vectors) -> Any:
    """The exact value of an expression."""
    values = {
        sympy.Symbol(f"{name}_{axis}"): value
        for name, v in vectors.items()
        for axis, value in zip("xyz", v, strict=True)
    }
    return components(expression).subs(values)


def expression(*case: str, real: bool = False) -> Any:
    condition = found(*case, real=real).condition
    assert condition is not None
    return condition.expression


def tilted(rng: np.random.Generator) -> sympy.Matrix:
    """A rational rotation; its last column is the normal of a tilted plane."""
    w, x, y, z = (sympy.Integer(int(k)) for k in rng.integers(1, 6, 4))
    size = w**2 + x**2 + y**2 + z**2
    return (
        sympy.Matrix(
            [
                [w**2 + x**2 - y**2 - z**2, 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), w**2 - x**2 + y**2 - z**2, 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), w**2 - x**2 - y**2 + z**2],
            ]
        )
        / size
    )


def hat(a: sympy.Matrix) -> sympy.Matrix:
    return sympy.Matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def in_plane(rng: np.random.Generator, R: sympy.Matrix) -> sympy.Matrix:
    return R[:, :2] * rational(rng, 2)


def planar_case(seed: int) -> tuple[sympy.Matrix, Vectors]:
    rng = np.random.default_rng(seed)
    R = tilted(rng)
    vectors = {"n": R[:, 2]}
    for i in "123":
        vectors |= {f"tau{i}": in_plane(rng, R), f"B{i}": in_plane(rng, R)}
    return R, vectors


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_planar_is_the_determinant_of_three_lines(seed: int) -> None:
    """The line through B_i along n × τ_i in the plane's own coordinates: direction, and moment about n."""
    R, vectors = planar_case(seed)
    rows = []
    for i in "123":
        along = vectors["n"].cross(vectors[f"tau{i}"])
        moment = vectors[f"B{i}"].cross(along)
        rows.append([*(R[:, :2].T * along), moment.dot(vectors["n"])])
    wanted = sympy.Matrix(rows).det()
    assert wanted != 0
    assert at(expression("3rrr_m1"), vectors) == wanted


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_planar_vanishes_for_lines_through_a_point_and_for_parallel_ones(seed: int) -> None:
    R, vectors = planar_case(seed)
    rng = np.random.default_rng(100 + seed)
    point = in_plane(rng, R)
    meeting = vectors | {f"tau{i}": vectors["n"].cross(vectors[f"B{i}"] - point) for i in "123"}
    parallel = vectors | {f"tau{i}": (k + 1) * vectors["tau1"] for k, i in enumerate("123")}
    assert at(expression("3rrr_m1"), meeting) == at(expression("3rrr_m1"), parallel) == 0
    assert at(expression("3rrr_m1"), meeting | {"tau1": vectors["n"].cross(meeting["tau1"])}) != 0


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_spatial_is_the_determinant_of_nine_velocity_equations(seed: int) -> None:
    """v + ω × B_i = λ_i τ_i in the nine unknowns v, ω, λ; one sign for all vectors."""
    rng = np.random.default_rng(seed)
    vectors = {f"{name}{i}": rational(rng) for name in ("B", "tau") for i in "123"}
    system = sympy.zeros(9, 9)
    for k, i in enumerate("123"):
        rows = slice(3 * k, 3 * k + 3)
        system[rows, :3], system[rows, 3:6] = sympy.eye(3), -hat(vectors[f"B{i}"])
        system[rows, 6 + k] = -vectors[f"tau{i}"]
    wanted = system.det()
    assert wanted != 0
    assert abs(at(expression("hexa", "1,2,3"), vectors)) == abs(wanted)


@pytest.mark.parametrize("seed", SEEDS)
def test_spatial_vanishes_where_four_planes_meet(seed: int) -> None:
    """A point of the plane of the tips, and τ_i normal to the line from it to B_i: it lies in all four planes."""
    rng = np.random.default_rng(seed)
    tips = {f"B{i}": rational(rng) for i in "123"}
    a, b = (sympy.Rational(int(k), 7) for k in rng.integers(1, 6, 2))
    point = tips["B1"] + a * (tips["B2"] - tips["B1"]) + b * (tips["B3"] - tips["B1"])
    lines = {f"tau{i}": (tips[f"B{i}"] - point).cross(rational(rng)) for i in "123"}
    assert at(expression("hexa", "1,2,3"), tips | lines) == 0
    assert at(expression("hexa", "1,2,3"), tips | lines | {"tau1": tips["B1"] - point}) != 0


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", SEEDS)
def test_two_bodies_are_the_determinant_of_six_velocity_equations(seed: int) -> None:
    """v = λ1 τ1 and v + μ e = λ2 τ4 in the six unknowns v, μ, λ."""
    rng = np.random.default_rng(seed)
    vectors = {name: rational(rng) for name in ("tau1", "tau4", "e")}
    system = sympy.zeros(6, 6)
    system[:3, :3] = system[3:, :3] = sympy.eye(3)
    system[3:, 3] = vectors["e"]
    system[:3, 4], system[3:, 5] = -vectors["tau1"], -vectors["tau4"]
    assert system.det() != 0
    assert abs(at(expression("quattro", "1,4"), vectors)) == abs(system.det())
    flat = vectors | {"e": 2 * vectors["tau1"] - 3 * vectors["tau4"]}
    assert at(expression("quattro", "1,4"), flat) == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_resting_tip_is_a_determinant_of_four_velocity_equations(seed: int) -> None:
    """v(B1) = 0 and v(B2) = λ τ2 in the unknowns v (of the plane), ω and λ."""
    R, vectors = planar_case(seed)
    E = R[:, :2].T
    arms = [E * vectors["n"].cross(vectors[f"B{i}"]) for i in "12"]
    system = sympy.zeros(4, 4)
    system[:2, :2] = system[2:, :2] = sympy.eye(2)
    system[:2, 2], system[2:, 2] = arms
    system[2:, 3] = -E * vectors["tau2"]
    assert abs(at(expression("rrrrr_m1", real=True), vectors)) == abs(system.det()) != 0


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("case", "legs"), [(("delta",), "123"), (("quattro_rigid",), "1234"), (("delta", "1,2"), "12")]
)
def test_translations_vanish_exactly_where_some_translation_is_allowed(case: tuple[str, ...], legs: str) -> None:
    """τ_i × v = 0 for all legs has a solution exactly where the expression is zero."""
    rng = np.random.default_rng(0)
    for bent in (None, *legs):
        first = rational(rng)
        vectors = {f"tau{i}": rational(rng) if i == bent else (int(i) + 1) * first for i in legs}
        rank = sympy.Matrix.vstack(*(hat(v) for v in vectors.values())).rank()
        assert rank == (2 if bent is None else 3)
        assert (at(expression(*case), vectors) == 0) is (rank < 3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_three_rods_leave_a_translation_where_they_are_parallel_to_a_plane(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = {f"r{i}": rational(rng) for i in "123"}
    flat = vectors | {"r3": vectors["r1"] - 2 * vectors["r2"]}
    for values, rank in ((vectors, 3), (flat, 2)):
        rows = sympy.Matrix.hstack(*values.values()).T
        assert rows.rank() == rank
        assert at(expression("delta", real=True), values) == rows.det()


def test_six_lines_of_a_complex_are_dependent_wrenches() -> None:
    answer = found("gough_stewart", real=True)
    members = [member.configuration for member in answer.setup.samples.members]
    scene = answer.pattern.values_at(members)
    values = scene.values
    for k, value in enumerate(answer.condition.evaluate(scene)):
        wrenches = [force(values[f"p{i}"][k], values[f"B{i}"][k]) for i in range(1, 7)]
        assert value == pytest.approx(np.linalg.det(wrenches), rel=1e-9)
        assert abs(value) > 1e-6


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("case", "real"),
    [
        (("3rrr_m1",), False),
        (("hexa", "1,2,3"), False),
        (("delta",), False),
        (("quattro", "1,4"), False),
        (("delta",), True),
        (("rrrrr_m1",), True),
    ],
)
def test_numbers_and_polynomials_are_the_same(case: tuple[str, ...], real: bool) -> None:
    formula = expression(*case, real=real)
    rng = np.random.default_rng(1)
    exact = [{str(name): rational(rng) for name in formula.free_symbols} for _ in range(5)]
    values = {name: np.array([[float(x) for x in each[name]] for each in exact]) for name in exact[0]}
    np.testing.assert_allclose(evaluate(formula, values), [float(at(formula, each)) for each in exact], rtol=1e-12)


def test_a_triple_product_has_the_sign_of_its_order() -> None:
    _, _, det = load_products()
    names = ("a", "b", "c")
    values = {name: np.random.default_rng(2).normal(size=(1, 3)) for name in names}
    for order in permutations(names):
        wanted = np.linalg.det(np.vstack([values[name] for name in order]))
        assert evaluate(det(*map(make_vector, order)), values)[0] == pytest.approx(wanted)


@pytest.mark.some(1)
@pytest.mark.parametrize("case", [("3rrr_m1",), ("hexa", "1,2,3"), ("quattro", "1,4")])
def test_the_length_of_a_crank_is_a_factor_and_nothing_more(case: tuple[str, ...]) -> None:
    """Identity: with ℓ_i τ_i in the place of τ_i the expression is ℓ_1 ℓ_2 … times itself, so that dividing each
    crank's tangent by its length splits off exactly the factors that are listed."""
    formula = expression(*case)
    tangents = [symbol for symbol in formula.free_symbols if symbol.name.startswith("tau")]
    lengths = {tangent: sympy.Symbol(f"length_{tangent}") for tangent in tangents}
    polynomial = sympy.expand(components(formula))
    longer = polynomial.subs(
        {
            sympy.Symbol(f"{t}_{axis}"): length * sympy.Symbol(f"{t}_{axis}")
            for t, length in lengths.items()
            for axis in "xyz"
        },
        simultaneous=True,
    )
    assert sympy.expand(longer - sympy.prod(lengths.values()) * polynomial) == 0
    assert len(found(*case).condition.factors) == len(tangents)


@pytest.mark.some(1)
@pytest.mark.parametrize("case", [("3rrr_m1",), ("hexa", "1,2,3"), ("quattro", "1,4"), ("rrrrr_m1",), ("delta",)])
def test_the_factors_that_were_split_off_never_vanish(case: tuple[str, ...]) -> None:
    """|a × (Q − P)| is the same at all poses: the length of a crank."""
    answer = found(*case)
    assert isinstance(answer.condition, NamedCondition)
    members = [member.configuration for member in answer.setup.samples.members]
    poses = answer.pattern.values_at(members)._poses
    for leg in answer.pattern.legs:
        assert isinstance(leg.line, Tangent)
        axis, arm = leg.line.axis.value(poses), leg.line.end.value(poses) - leg.line.start.value(poses)
        sizes = np.linalg.norm(np.cross(axis, arm), axis=1)
        np.testing.assert_allclose(sizes, sizes[0], rtol=1e-9)
        assert sizes[0] > 0.01
