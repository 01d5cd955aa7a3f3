"""All modes: the counts of every family, the goal among them, the geometry they satisfy, and independent paths."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from analysis.modes.draws import FAMILIES, articulated, planar, spatial, translating
from analysis.modes.laws import among, check_member, draw
from analysis.modes.newton import pose_of, real_ones, solutions
from hrsynth.geometry.loci import Circle, Curve, Line, shift_reach
from hrsynth.geometry.vectors import Array, build_pose, normalise_vector, rotate_about_axis
from hrsynth.solving.platform.constrained_platform import System
from hrsynth.solving.platform.rigid import Planar, Spatial
from hrsynth.solving.platform.solve import SystemModes, solve
from hrsynth.solving.platform.translating import ArticulatedPlatform, TranslatingPlatform
from strategies import random_rotation

ALL = sorted(FAMILIES)
MOST = {
    "planar, three circles": (47, 6),
    "spatial, three lines": (259, 8),
    "two bodies, circles": (2197, 8),
    "spatial, three circles": (1130, 12),
}
"""Seeds at which many modes are real, and how many."""


@pytest.mark.some(10)
@pytest.mark.parametrize("name", ALL)
def test_each_family_has_its_number_of_modes_and_the_goal_is_one(name: str):
    for seed in range(12):
        check_member(name, seed)


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("name", ALL)
def test_each_family_has_its_number_of_modes_at_many_instances(name: str):
    for seed in range(1_500):
        check_member(name, seed)


@pytest.mark.parametrize("name", MOST)
def test_many_modes_can_be_real(name: str):
    seed, count = MOST[name]
    modes = solve(draw(name, seed).system)
    assert len(modes.modes) == count
    apart = [np.abs(a.pose - b.pose).max() for i, a in enumerate(modes.modes) for b in modes.modes[:i]]
    assert min(apart) > 1e-3


@pytest.mark.some(7)
@pytest.mark.parametrize("name", ALL)
def test_enclosures_are_small(name: str):
    radii = [mode.radius for seed in range(20) for mode in solve(draw(name, seed).system).modes]
    assert np.median(radii) < 2e-12
    assert max(radii) < 1e-8


def check_by_newton(name: str, seed: int, starts: int) -> None:
    system = draw(name, seed).system
    modes = solve(system)
    rng = np.random.default_rng(seed)
    assert len(solutions(system, starts, rng)) == modes.complex
    found = real_ones(solutions(system, starts, rng, real=True))
    assert len(found) > 0
    for v in found:
        assert among(pose_of(system, v), modes) < 1e-6, "a pose that Newton's method finds is missing"
    assert len(found) <= len(modes.modes)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["planar, three circles", "spatial, three lines", "two bodies, circles"])
def test_newton_on_the_pose_finds_the_same_solutions(name: str):
    check_by_newton(name, 5, 400)


@pytest.mark.some(0, 5)
@pytest.mark.parametrize("seed", [100, *(pytest.param(seed, marks=pytest.mark.long) for seed in (101, 102))])
@pytest.mark.parametrize("name", ALL)
def test_newton_on_the_pose_finds_the_same_solutions_everywhere(name: str, seed: int):
    check_by_newton(name, seed, 2500)


def planar_by_sympy(centres: list[tuple[int, int]], radii: list[int], tips: list[tuple[int, int]]) -> sympy.Poly:
    """Three circles, by the pose: x and y from differences of equations, then a polynomial in T = tan(φ/2)."""
    x, y, T = sympy.symbols("x y T")
    c, s = (1 - T**2) / (1 + T**2), 2 * T / (1 + T**2)
    f = [
        sympy.expand((x + c * b - s * d - u) ** 2 + (y + s * b + c * d - v) ** 2 - r**2)
        for (u, v), r, (b, d) in zip(centres, radii, tips, strict=True)
    ]
    at = sympy.solve([sympy.expand(f[1] - f[0]), sympy.expand(f[2] - f[0])], [x, y], dict=True)[0]
    numerator = sympy.numer(sympy.together(f[0].subs(at)))
    polynomial = sympy.Poly(numerator, T)
    while polynomial.rem(sympy.Poly(1 + T**2, T)).is_zero:
        polynomial = polynomial.quo(sympy.Poly(1 + T**2, T))
    return polynomial


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("centres", "radii", "tips"),
    [
        ([(0, 0), (5, 1), (2, 6)], [2, 3, 2], [(0, 0), (3, 0), (1, 2)]),
        ([(0, 0), (4, 0), (1, 5)], [3, 2, 3], [(0, 1), (2, 0), (0, 3)]),
        ([(0, 0), (9, 1), (2, 8)], [1, 2, 1], [(0, 0), (2, 0), (1, 2)]),
    ],
)
def test_an_elimination_in_the_pose_by_sympy_agrees(centres, radii, tips):
    polynomial = planar_by_sympy(centres, radii, tips)
    curves = tuple(Circle((*c, 0), (0, 0, 1), r) for c, r in zip(centres, radii, strict=True))
    modes = solve(Planar(curves, np.array(tips, dtype=float), np.eye(4)))
    assert modes.complete
    assert modes.complex == polynomial.degree() == 6
    roots = sorted(float(root) for root in polynomial.nroots(n=30) if abs(sympy.im(root)) < 1e-20)
    assert np.allclose(sorted(np.tan(mode.q[2] / 2) for mode in modes.modes), roots, atol=1e-9)


def carried(curve: Curve, X: Array) -> Curve:
    """A curve moved by a rigid displacement X (4, 4)."""
    R, c = X[:3, :3], X[:3, :3] @ curve.centre + X[:3, 3]
    if isinstance(curve, Line):
        return Line(c, R @ curve.direction)
    assert isinstance(curve, Circle)
    return Circle(c, R @ curve.axis, curve.radius, R @ curve.start)


@pytest.mark.parametrize("name", ["spatial, three circles", "two bodies, second circle and slide parallel"])
def test_modes_move_with_the_base(name: str):
    for seed in range(5):
        rng = np.random.default_rng(1000 + seed)
        system, _ = draw(name, seed)
        X = build_pose(rng.normal(size=3), random_rotation(rng))
        curves = tuple(carried(curve, X) for curve in system.curves)
        if isinstance(system, ArticulatedPlatform):
            R = X[:3, :3]
            slide = carried(system.slide, build_pose((0, 0, 0), R))
            moved: System = ArticulatedPlatform(curves, system.tips @ R.T, system.bodies, slide)
            places = [build_pose(X[:3, :3] @ mode.pose[:3, 3] + X[:3, 3]) for mode in solve(system).modes]
        else:
            moved = Spatial(curves, system.tips)
            places = [X @ mode.pose for mode in solve(system).modes]
        after = solve(moved)
        assert after.complete
        assert after.complex == FAMILIES[name].count
        assert len(after.modes) == len(places)
        assert all(among(place, after) < 1e-8 for place in places)


def test_enclosures_hold_for_inputs_that_differ_in_the_last_bit():
    rng = np.random.default_rng(3)
    for seed in range(10):
        system, _ = spatial(np.random.default_rng(seed), "LLL")
        moved = Spatial(
            tuple(
                Line(np.nextafter(line.centre, line.centre + rng.choice([-1, 1], 3)), line.direction)
                for line in system.curves
            ),
            system.tips,
        )
        one, other = solve(system).modes, solve(moved).modes
        assert len(one) == len(other)
        pairs = zip(*(sorted(each, key=lambda m: m.parameters) for each in (one, other)), strict=True)
        for a, b in pairs:
            apart = np.abs(np.subtract(a.parameters, b.parameters)).max() / system.size
            assert apart <= 4 * (a.radius + b.radius)


@pytest.mark.parametrize("kinds", ["CCCC", "CLLL", "PCC", "LLLLL"])
def test_more_legs_than_needed_leave_the_goal_in_the_plane(kinds: str):
    system, goal = planar(np.random.default_rng(8), kinds)
    modes = solve(system)
    assert len(modes.modes) == modes.complex == 1
    assert among(goal, modes) < 1e-10


@pytest.mark.parametrize("kinds", ["CCCC", "LLLL", "PLC", "PLCL"])
def test_more_legs_than_needed_leave_the_goal_in_space(kinds: str):
    system, goal = spatial(np.random.default_rng(8), kinds)
    modes = solve(system)
    assert len(modes.modes) == 1
    assert among(goal, modes) < 1e-10


@pytest.mark.parametrize("kinds", ["CC", "CL", "LC", "LL", "PC", "CCCC"])
def test_two_paths_in_space_meet_at_the_goal_alone(kinds: str):
    for seed in range(5):
        system, goal = translating(np.random.default_rng(seed), kinds)
        modes = solve(system)
        assert len(modes.modes) == modes.complex == 1
        assert among(goal, modes) < 1e-10


def test_circles_with_centres_at_equal_height_meet_twice():
    """Two circles with horizontal axes, and centres and meeting points in one plane of symmetry: as the legs next to
    each other of a translating platform."""
    tips = np.zeros((2, 3))
    curves = (Circle((1, 0, 0), (0, 1, 0), np.sqrt(2)), Circle((0, 1, 0), (1, 0, 0), np.sqrt(2)))
    modes = solve(TranslatingPlatform(curves, tips))
    assert modes.complex == 2
    assert sorted(round(mode.pose[2, 3], 12) for mode in modes.modes) == [-1.0, 1.0]


def test_what_matches_almost_is_near_and_stationary():
    system, goal = planar(np.random.default_rng(2), "CCCC")
    curves = (system.curves[0], shift_reach(system.curves[1], 1e-3 * system.X_plane[:3, 0]), *system.curves[2:])
    modes = solve(Planar(curves, system.tips, system.X_plane))
    assert modes.modes == ()
    assert modes.complex == 0
    assert min(np.abs(each.pose - goal).max() for each in modes.near) < 0.1
    bent = Planar(curves, system.tips, system.X_plane)
    for each in modes.near:
        assert 1e-9 < each.residual <= 1e-2
        sums = [[np.sum(bent.misses(each.q + s * e) ** 2) for s in (-1e-5, 1e-5)] for e in np.eye(3)]
        slopes = [abs(up - down) / 2e-5 for down, up in sums]
        assert max(slopes) < 1e-6


def test_directions_that_no_pose_matches_leave_no_mode():
    curves = tuple(Circle((x, 0, 0), (0, 0, 1), 0.1) for x in (0, 10, 20))
    modes = solve(Planar(curves, np.array([[0, 0], [1, 0], [0, 1.0]]), np.eye(4)))
    assert modes.complete
    assert modes.complex == 6
    assert modes.modes == ()


def in_tilted_plane(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """A plane's frame, three tips, and where the tips are at some pose."""
    X = build_pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(size=(3, 2))
    goal = X @ build_pose((0.3, 0.2, 0), rotate_about_axis((0, 0, 1), 0.5))
    return X, tips, goal[:3, 3] + tips @ goal[:3, :2].T


@pytest.mark.some(1)
@pytest.mark.parametrize("kind", ["equal arms", "parallel lines", "one centre"])
def test_a_continuum_is_said_and_not_listed(kind: str):
    for seed in range(4):
        X, tips, at = in_tilted_plane(np.random.default_rng(seed))
        n, e = X[:3, 2], normalise_vector(X[:3, 0] + 0.3 * X[:3, 1])
        centre = at.mean(axis=0)
        curves: dict[str, list[Curve]] = {
            "equal arms": [Circle(point + 0.7 * e, n, 0.7) for point in at],
            "parallel lines": [Line(point, e) for point in at],
            "one centre": [Circle(centre, n, float(np.linalg.norm(point - centre))) for point in at],
        }
        modes = solve(Planar(tuple(curves[kind]), tips, X))
        assert (modes.continuous_family, modes.complete, modes.modes) == (1, False, ())
        assert "continuous family of dimension 1" in str(modes.singular_solutions)


def test_other_continua():
    rng = np.random.default_rng(0)
    d, tips, X = (
        normalise_vector(rng.normal(size=3)),
        rng.normal(size=(3, 3)),
        build_pose(rng.normal(size=3), random_rotation(rng)),
    )
    lines = tuple(Line(X[:3, 3] + X[:3, :3] @ tip, d) for tip in tips)
    assert solve(Spatial(lines, tips)).continuous_family == 1
    for seed in range(3):
        assert solve(articulated(np.random.default_rng(seed), "CC", (0, 1, 2)).system).continuous_family == 1
    assert solve(planar(rng, "CC").system).continuous_family == 1
    assert solve(spatial(rng, "LL").system).continuous_family == 2
    assert solve(translating(rng, "C").system).continuous_family == 1


def test_tips_on_one_line_are_refused_in_words():
    tips = np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2.0]])
    modes = solve(Spatial(tuple(Line(tip, (0.1 * k, 1, k)) for k, tip in enumerate(tips)), tips))
    assert not modes.complete
    assert "on one line" in str(modes.singular_solutions)


@pytest.mark.parametrize("kind", ["L", "C"])
def test_a_singular_pose_is_said(kind: str):
    """Normals of three curves that meet in one point: a double solution, real or not as rounding has it."""
    for seed in range(8):
        modes = singular(kind, np.random.default_rng(seed))
        assert "singular" in str(modes.singular_solutions)
        assert modes.complex == (2 if kind == "L" else 6)
        assert among(np.eye(4), modes) < 1e-6, modes.proof


@pytest.mark.parametrize("seed", range(6))
def test_a_camera_that_sees_an_equilateral_triangle_has_eight_regular_modes(seed: int):
    """Modes share parameters of the lines, exactly or but for rounding: they are told apart."""
    rng = np.random.default_rng(seed)
    R, o = (random_rotation(rng), rng.normal(size=3)) if seed else (np.eye(3), np.zeros(3))
    turns = 2 * np.pi / 3 * np.arange(3)
    tips = np.column_stack([np.cos(turns), np.sin(turns), 0 * turns])
    modes = solve(Spatial(tuple(Line(o, R @ (tip + (0, 0, 2.5))) for tip in tips), tips))
    assert (modes.complex, len(modes.modes), modes.complete, modes.singular_solutions) == (8, 8, True, None)
    assert all(mode.proved and mode.multiplicity == 1 and mode.radius < 1e-11 for mode in modes.modes)


def singular(kind: str, rng: np.random.Generator) -> SystemModes:
    """The modes of a platform at the origin whose curves' normals meet in one point."""
    tips, centre = rng.normal(size=(3, 2)), np.array([0.3, -0.4])
    curves: list[Curve] = []
    for tip in tips:
        n = np.array([*normalise_vector(centre - tip), 0.0])
        at = np.array([*tip, 0.0])
        curves.append(
            Line(at, np.cross(n, (0, 0, 1)))
            if kind == "L"
            else Circle(at - n * (r := rng.uniform(0.4, 1.4)), (0, 0, 1), r)
        )
    return solve(Planar(tuple(curves), tips, np.eye(4)))


@pytest.mark.parametrize("apart", [0.0, 1e-17, 1e-16, 1e-15])
@pytest.mark.parametrize("seed", range(4))
def test_centres_that_are_one_but_for_rounding_give_no_size(seed: int, apart: float):
    """Two lines that are given by the very point in which they meet."""
    rng = np.random.default_rng(seed)
    p = rng.normal(scale=0.2, size=3)
    curves = (Line(p, rng.normal(size=3)), Line(p + apart * normalise_vector(rng.normal(size=3)), rng.normal(size=3)))
    modes = solve(TranslatingPlatform(curves, np.zeros((2, 3))))
    assert (modes.complex, len(modes.modes), modes.complete) == (1, 1, True)
    assert modes.modes[0].pose[:3, 3] == pytest.approx(p, abs=1e-14)
