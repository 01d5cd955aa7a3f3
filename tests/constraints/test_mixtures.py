"""The closed conditions of three observations against determinants of wrenches that are written down here: as
identities of polynomials, at 10,000 camera positions, and factored."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import sympy

from hrsynth.constraints.closed_conditions import ClosedForm, find_closed_form
from hrsynth.constraints.locked_legs import LockedLeg
from hrsynth.constraints.named_vectors import BodyPoint, BodyVector, CrossProduct
from hrsynth.constraints.vector_algebra import evaluate

COUNT = 10_000
KINDS = ("PPP", "PPL", "PLL", "LLL", "PPA", "PLA")
"""Points and lines in the image, and axes whose directions are seen."""


def held(kind: str, number: int, eye: str | None) -> LockedLeg:
    def point(symbol: str) -> BodyPoint:
        return BodyPoint(symbol, symbol, "platform", np.zeros(3))

    def along(symbol: str) -> BodyVector:
        return BodyVector(symbol, symbol, "platform", np.zeros(3))

    centre = None if eye is None else point(eye)
    tip = point(f"B{number}")
    if kind == "P":
        return LockedLeg(str(number), "platform", tip, along(f"r{number}"), None, False, 3, eye=centre, virtual=True)
    if kind == "L":
        plane = CrossProduct(f"n{number}", "", along("a"), along("b"))
        return LockedLeg(
            str(number), "platform", tip, None, plane, False, 2, upright=along(f"e{number}"), eye=centre, virtual=True
        )
    return LockedLeg(str(number), "platform", tip, None, None, False, 1, about=along(f"u{number}"), virtual=True)


def form_of(kinds: str, eye: str | None = "C") -> ClosedForm:
    found = find_closed_form([held(kind, number, eye) for number, kind in enumerate(kinds, 1)])
    assert found is not None
    return found


def cross(a: Any, b: Any) -> Any:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object)


def dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def exact(expression: Any, values: Mapping[str, Any]) -> Any:
    """An expression in exact arithmetic, for vectors (3,) of numbers or polynomials."""
    products = {"dot": dot, "cross": cross, "det": lambda a, b, c: dot(a, cross(b, c))}
    run = sympy.lambdify([sympy.Symbol(name) for name in values], expression, modules=[products, "math"])
    return run(*values.values())


def determinant(rows: Sequence[Any]) -> Any:
    """Of a square matrix over a ring, by the last row."""
    if len(rows) == 1:
        return rows[0][0]
    total = 0
    for column, entry in enumerate(rows[-1]):
        if entry != 0:
            minor = determinant([[*row[:column], *row[column + 1 :]] for row in rows[:-1]])
            total = total + (-1) ** (len(rows) - 1 + column) * entry * minor
    return total


def vectors(*names: str) -> tuple[Any, ...]:
    """Vectors of indeterminates over the integers."""
    _, *every = sympy.ring([f"{name}{axis}" for name in names for axis in "xyz"], sympy.ZZ)
    return tuple(np.array(every[3 * i : 3 * i + 3], dtype=object) for i in range(len(names)))


def test_three_image_points_lose_a_freedom_just_on_the_danger_cylinder() -> None:
    """Polynomial identities: (1) the wrenches' determinant is the expression times what no distance from C can make
    vanish (here the z coordinates, as the normals are p × x and p × y); (2) the expression is |n|² (ρ² − R²) over the
    distances; (3) that is what the factor is, with the centre of the circle from its own conditions."""
    b, c, x = vectors("b", "c", "x")
    zero, p = 0 * b, [-x, b - x, c - x]  # from C to the points, B1 the origin
    form = form_of("PPP")
    places = {"B1": zero, "B2": b, "B3": c, "C": x, "r1": p[0], "r2": p[1], "r3": p[2]}
    forth_back, square = exact(form.expression, places), exact(form.parts[0][0], places)
    assert forth_back == square
    n = cross(b, c)
    o = cross(n, b) * dot(c, c) - cross(n, c) * dot(b, b)  # 2 |n|² times the circumcentre
    size = dot(n, n)
    assert dot(o, b) == size * dot(b, b)
    assert dot(o, c) == size * dot(c, c)
    assert dot(o, n) == 0
    # |n|² (ρ² − R²) = |n|² (‖x_⊥ − o′‖² − ‖o′‖²), o′ = o / (2 |n|²), |n|² ‖x_⊥‖² = |n × x|²
    assert dot(cross(n, x), cross(n, x)) - dot(o, x) == square
    rows = []
    for at, ray in zip((zero, b, c), p, strict=True):
        for normal in ([0 * ray[0], ray[2], -ray[1]], [-ray[2], 0 * ray[0], ray[0]]):
            rows.append([*normal, *cross(at, np.array(normal, dtype=object))])
    assert determinant(rows) in (sign * p[0][2] * p[1][2] * p[2][2] * square for sign in (1, -1))


def test_three_image_lines_factor() -> None:
    """det [n_i, m_i; 0, e_i] = ± det(n) det(e), whatever the moments m_i: a polynomial identity."""
    n, e, m = (vectors(*(f"{s}{i}" for i in "123" for s in "nem"))[k::3] for k in range(3))
    values = {f"{s}{i}": v for s, each in (("n", n), ("e", e)) for i, v in enumerate(each, 1)}
    rows = [[*a, *b] for a, b in zip(n, m, strict=True)] + [[0, 0, 0, *v] for v in e]
    form = form_of("LLL")
    expected = exact(form.expression, values)
    assert expected == exact(form.parts[0][0], values) * exact(form.parts[1][0], values)
    assert determinant(rows) in (expected, -expected)


def test_two_image_points_and_an_axis_lose_a_freedom_in_a_plane() -> None:
    b, u, x = vectors("b", "u", "x")
    form = form_of("PPA")
    values = {"B1": 0 * b, "B2": b, "C": x, "r1": -x, "r2": b - x, "u3": u}
    assert exact(form.expression, values) in (sign * exact(form.parts[0][0], values) for sign in (1, -1))
    assert dot(cross(b, cross(u, b)), b) == 0 == dot(cross(b, cross(u, b)), cross(u, b))


def unit(v: Any) -> Any:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def geometry(kinds: str, rng: np.random.Generator, eyes: int) -> tuple[dict[str, Any], Any]:
    """Vectors (n, 3) of points and lines fixed in the platform for random camera positions, and the wrenches (n, 6, 6),
    normals by QR."""
    C = rng.normal(size=(eyes, COUNT, 3)) * 2
    values, blocks = {"C": C[0]}, []
    for number, kind in enumerate(kinds, 1):
        B, d = (np.broadcast_to(v, (COUNT, 3)) for v in (rng.normal(size=3), unit(rng.normal(size=3))))
        eye = C[(number - 1) % eyes]
        values[f"B{number}"] = B
        zero = np.zeros((COUNT, 1, 3))
        if kind == "L":
            n = unit(np.cross(B - eye, d))
            e = np.cross(d, n)
            values |= {f"n{number}": n, f"e{number}": e}
            blocks += [np.concatenate([n, np.cross(B, n)], axis=1)[:, None], np.concatenate([zero, e[:, None]], axis=2)]
            continue
        axis = unit(B - eye) if kind == "P" else d
        across = np.linalg.svd(axis[:, None])[2][:, 1:]
        values[f"{'r' if kind == 'P' else 'u'}{number}"] = axis
        blocks.append(
            np.concatenate([across, np.cross(B[:, None], across)], axis=2)
            if kind == "P"
            else np.concatenate([np.zeros_like(across), across], axis=2)
        )
    return values, np.concatenate(blocks, axis=1)


@pytest.mark.parametrize("eyes", [1, 3])
@pytest.mark.parametrize("kinds", KINDS)
def test_each_expression_is_the_wrenches_determinant(kinds: str, eyes: int) -> None:
    """At 10,000 positions of one camera, and of three: the same multiple everywhere."""
    values, wrenches = geometry(kinds, np.random.default_rng(len(kinds) + eyes), eyes)
    form = form_of(kinds, "C" if eyes == 1 else None)
    found, expected = np.abs(evaluate(form.expression, values)), np.abs(np.linalg.det(wrenches))
    factor = found.sum() / expected.sum()
    assert np.max(np.abs(found - factor * expected)) < 1e-10 * found.max()
    assert found.max() > 1e-3


def test_five_thousand_positions_on_the_danger_cylinder() -> None:
    """All on it are zeros of the expression, and singular; of those off it none."""
    rng = np.random.default_rng(4)
    values, _ = geometry("PPP", rng, 1)
    B = [values[f"B{i}"][0] for i in (1, 2, 3)]
    b, c = B[1] - B[0], B[2] - B[0]
    n = unit(np.cross(b, c))
    centre = B[0] + np.linalg.lstsq(np.array([b, c, n]), np.array([b @ b / 2, c @ c / 2, 0]), rcond=None)[0]
    R = np.linalg.norm(B[0] - centre)
    e = unit(b)
    turn, height, away = rng.uniform(0, 2 * np.pi, COUNT), rng.normal(size=COUNT) * 2, rng.uniform(0.05, 1.0, COUNT)
    rho = R * np.where(np.arange(COUNT) % 2, 1.0, 1 + np.where(rng.random(COUNT) < 0.5, -0.9 * away, away))
    C = (
        centre
        + (rho * np.cos(turn))[:, None] * e
        + (rho * np.sin(turn))[:, None] * np.cross(n, e)
        + height[:, None] * n
    )
    rays = {f"r{i}": unit(values[f"B{i}"] - C) for i in (1, 2, 3)}
    found = np.abs(evaluate(form_of("PPP").expression, {**values, "C": C, **rays}))
    across = [np.linalg.svd(ray[:, None])[2][:, 1:] for ray in rays.values()]
    wrenches = np.concatenate(
        [np.concatenate([N, np.cross(at[None, None], N)], axis=2) for N, at in zip(across, B, strict=True)], axis=1
    )
    least = np.linalg.svd(wrenches, compute_uv=False)[:, -1]
    on = np.arange(COUNT) % 2 == 1
    assert found[on].max() < 1e-12 < 1e-7 < found[~on].min()
    assert least[on].max() < 1e-12 < 1e-7 < least[~on].min()


def test_what_the_factors_of_three_lines_say() -> None:
    """A line through C that meets three lines, and feet in one plane with C: the one factor vanishes, not the other."""
    rng = np.random.default_rng(5)
    first, second = (part for part, _ in form_of("LLL").parts)
    for _ in range(100):
        C, ray = rng.normal(size=3), unit(rng.normal(size=3))
        d = unit(rng.normal(size=(3, 3)))
        on_ray = C + rng.uniform(0.5, 3, size=(3, 1)) * ray
        feet = unit(rng.normal(size=(2, 3)))
        feet = np.vstack([feet, rng.normal(size=2) @ feet])
        for places, turned, zero, other in (
            (on_ray, d, first, second),
            (C + feet, unit(np.cross(feet, rng.normal(size=(3, 3)))), second, first),
        ):
            n = unit(np.cross(places - C, turned))
            values = {
                **{f"n{i}": n[None, i - 1] for i in (1, 2, 3)},
                **{f"e{i}": np.cross(turned, n)[None, i - 1] for i in (1, 2, 3)},
            }
            assert abs(float(evaluate(zero, values)[0])) < 1e-12
            assert abs(float(evaluate(other, values)[0])) > 1e-9


DEGREES = {"PPP": [2], "PPL": [3], "PLL": [4], "LLL": [2, 3], "PPA": [1], "PLA": [1, 1]}
"""Degrees of the irreducible factors over the rationals, as a polynomial of the camera's centre."""


@pytest.mark.parametrize("kinds", KINDS)
def test_what_factors_over_the_rationals(kinds: str) -> None:
    """At random rational points and lines: a factor of the expression for all would be one here, where the degree is
    the same. Each image point brings a factor z − B_z, as its normals are p × x and p × y."""
    numbers = random.Random(KINDS.index(kinds))
    ring, *C = sympy.ring("x,y,z", sympy.ZZ)
    for _ in range(3):
        rows, extra = [], []
        for kind in kinds:
            B, d = ([ring(numbers.randint(-99, 99)) for _ in range(3)] for _ in range(2))
            p = [a - b for a, b in zip(B, C, strict=True)]
            if kind == "L":
                n = cross(p, d)
                rows += [[*n, *cross(B, n)], [ring(0)] * 3 + list(cross(d, n))]
                continue
            along = p if kind == "P" else d
            for normal in ([ring(0), along[2], -along[1]], [-along[2], ring(0), along[0]]):
                rows.append([*normal, *cross(B, normal)] if kind == "P" else [ring(0)] * 3 + normal)
            extra += [p[2]] if kind == "P" else []
        polynomial = determinant(rows)
        for each in extra:
            polynomial = polynomial.exquo(each)
        factors = polynomial.factor_list()[1]
        degrees = [max(map(sum, factor.itermonoms())) for factor, power in factors for _ in range(power)]
        assert sorted(degrees) == DEGREES[kinds]
