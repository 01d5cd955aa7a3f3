"""Tips on surfaces: points that translate, by elimination, and everything else, by msolve, which also checks the rest.

What needs msolve is skipped where it is not installed.
"""

from __future__ import annotations

import importlib.metadata
import shutil

import numpy as np
import pytest

from analysis.modes.draws import FAMILIES, MEETING, SURFACES, on_two_bodies, spatial, translating
from analysis.modes.laws import among, check_agreement, check_member, draw, needs_msolve
from hrsynth.errors import BadRequest, ExternalSolverFailure, MissingExtra
from hrsynth.geometry.loci import Circle, Plane, Reach, Sphere
from hrsynth.geometry.vectors import normalise_vector, rotate_about_axis
from hrsynth.solving.platform.constrained_platform import System
from hrsynth.solving.platform.msolve import parametrise, read, write_system
from hrsynth.solving.platform.polynomials import Quadric
from hrsynth.solving.platform.pose_coordinate_solver import list_parts
from hrsynth.solving.platform.quadrics import Balls
from hrsynth.solving.platform.rigid import Planar
from hrsynth.solving.platform.solve import solve, solve_by_msolve
from hrsynth.solving.platform.translating import ArticulatedPlatform, TranslatingPlatform
from strategies import random_rotation

SLOWEST = {
    "spatial, six spheres",
    "spatial, three planes and three spheres",
    "spatial, two circles and two spheres",
    "spatial, a line and four spheres",
    "spatial, three circles",
    "spatial, two circles and a line",
    "spatial, two lines and a circle",
}
"""Families of which msolve takes a second or more for each member."""

QUICK = sorted(set(FAMILIES | MEETING | SURFACES) - SLOWEST)


@pytest.mark.some(4)
@pytest.mark.parametrize("name", MEETING)
def test_a_point_on_surfaces_has_its_number_of_places(name: str):
    for seed in range(40):
        check_member(name, seed)


@pytest.mark.some(2, 4)
@needs_msolve
@pytest.mark.parametrize("name", [name for name in QUICK if name not in SURFACES])
def test_msolve_lists_the_same_poses(name: str):
    for seed in range(3):
        check_agreement(name, seed)


@needs_msolve
@pytest.mark.long
@pytest.mark.parametrize("name", [*FAMILIES, *MEETING])
def test_msolve_lists_the_same_poses_at_many_instances(name: str):
    for seed in range(3 if name in SLOWEST else 25):
        check_agreement(name, 1000 + seed)


@pytest.mark.some(1)
@needs_msolve
@pytest.mark.parametrize("name", [name for name in QUICK if name in SURFACES])
def test_tips_on_surfaces_have_their_number_of_poses(name: str):
    for seed in range(3):
        check_member(name, seed)


@needs_msolve
@pytest.mark.long
@pytest.mark.parametrize("name", SURFACES)
def test_tips_on_surfaces_have_their_number_of_poses_at_many_instances(name: str):
    for seed in range(3 if name in SLOWEST else 25):
        check_member(name, 1000 + seed)


@pytest.mark.some(2)
@needs_msolve
@pytest.mark.parametrize(
    "draw",
    [
        lambda rng: spatial(rng, "EEEEEEE"),
        lambda rng: spatial(rng, "PSSSS"),
        lambda rng: on_two_bodies(rng, ("SSS", "SS")),
    ],
)
def test_more_surfaces_than_needed_leave_the_goal(draw):
    system, goal = draw(np.random.default_rng(5))
    modes = solve(system)
    assert modes.complete
    assert len(modes.modes) == modes.complex == 1
    assert among(goal, modes) < 1e-10


@pytest.mark.parametrize("kinds", ["SSSS", "EEEE", "SSSSE", "CSS", "LEE"])
def test_more_surfaces_than_needed_leave_the_goal_of_a_point(kinds: str):
    system, goal = translating(np.random.default_rng(5), kinds)
    modes = solve(system)
    assert len(modes.modes) == modes.complex == 1
    assert among(goal, modes) < 1e-10


def test_three_spheres_that_do_not_meet_have_no_real_place():
    spheres = tuple(Sphere((x, y, 0), 0.1) for x, y in ((0, 0), (5, 0), (0, 5)))
    modes = solve(TranslatingPlatform(spheres, np.zeros((3, 3))))
    assert modes.complete
    assert (modes.complex, modes.modes) == (2, ())


def test_three_spheres_that_touch_are_singular():
    spheres = tuple(Sphere(2.0 * np.array(e), 2.0) for e in ((1, 0, 0), (-0.6, 0.8, 0), (0, -1, 0)))
    modes = solve(TranslatingPlatform(spheres, np.zeros((3, 3))))
    assert "singular" in str(modes.singular_solutions)
    assert among(np.eye(4), modes) < 1e-6


@pytest.mark.parametrize("kind", ["one plane", "one sphere", "one axis", "planes of one line"])
def test_a_continuum_of_places_is_said(kind: str):
    rng = np.random.default_rng(4)
    R, p = random_rotation(rng), rng.normal(size=3)
    along = [p + R @ np.array([0, 0, z]) for z in (-1.0, 0.3, 1.1)]
    reaches: dict[str, tuple[list[Reach], int]] = {
        "one plane": ([Plane(p + R[:, :2] @ rng.normal(size=2), R[:, 2]) for _ in range(3)], 2),
        "one sphere": ([Sphere(p, 0.8)] * 3, 2),
        "one axis": ([Sphere(c, float(np.linalg.norm(c - p - 0.7 * R[:, 0]))) for c in along], 1),
        "planes of one line": ([Plane(c, normalise_vector(np.cross(R[:, 2], rng.normal(size=3)))) for c in along], 1),
    }
    curves, dimension = reaches[kind]
    modes = solve(TranslatingPlatform(tuple(curves), np.zeros((3, 3))))
    assert (modes.continuous_family, modes.complete, modes.modes) == (dimension, False, ())


@pytest.mark.parametrize("name", ["three spheres", "a sphere and two planes"])
def test_places_move_with_the_base(name: str):
    for seed in range(5):
        system, _ = draw(name, seed)
        R, t = rotate_about_axis((1, 2, -1), 0.7), np.array([0.3, -1.0, 2.0])
        moved: list[Reach] = [
            Sphere(R @ c.centre + t, c.radius) if isinstance(c, Sphere) else Plane(R @ c.centre + t, R @ c.normal)
            for c in system.curves
        ]
        after = solve(TranslatingPlatform(tuple(moved), system.tips @ R.T))
        assert after.complete
        for mode in solve(system).modes:
            assert min(np.abs(R @ mode.q + t - other.q).max() for other in after.modes) < 1e-9


@pytest.mark.parametrize("surface", [Sphere((1, 2, 3), 0.5), Plane((1, 2, 3), (1, 1, 0))])
def test_a_tip_misses_a_surface_by_its_distance(surface: Reach):
    rng = np.random.default_rng(0)
    for tip in rng.normal(size=(20, 3)):
        off = surface.miss(tip)
        assert np.linalg.norm(surface.miss(tip - off)) < 1e-14
        assert all(
            np.linalg.norm(off) <= np.linalg.norm(tip - (each - surface.miss(each))) + 1e-12
            for each in rng.normal(size=(20, 3))
        )
    assert np.linalg.norm(surface.miss(surface.centre)) == pytest.approx(getattr(surface, "radius", 0.0))


@pytest.mark.parametrize(
    "family",
    ["two bodies, planes and spheres", "three spheres", "two bodies, circles", "planar, two circles and a line"],
)
def test_the_goal_satisfies_the_quadrics(family: str):
    system, goal = draw(family, 3)
    for part in list_parts(system, number=2):
        x = coordinates(system, part.chart, goal)
        values = [float(each.value(x)) for each in part.equations()]
        scales = [float(np.abs(each.A).sum()) for each in part.equations()]
        assert max(abs(v) / s for v, s in zip(values, scales, strict=True)) < 1e-14
        assert np.abs(system.pose(part.place(x)) - goal).max() < 1e-12
        assert len(part.equations(Balls)) == part.chart.count


def coordinates(system: System, chart, goal: np.ndarray) -> list[float]:
    """A pose in a chart, by least squares on what the chart makes of coordinates."""
    from scipy.optimize import least_squares

    own = [Quadric(A) for A in chart.own]

    def errors(x):
        away = (system.pose(chart.place(x)) - goal).ravel()
        return np.concatenate([away, [float(each.value(x)) for each in own], system.misses(chart.place(x)).ravel()])

    found = min(
        (
            least_squares(errors, np.random.default_rng(k).normal(size=chart.count), xtol=1e-15, ftol=1e-15, gtol=1e-15)
            for k in range(6)
        ),
        key=lambda each: each.cost,
    )
    return list(found.x)


def test_msolve_is_asked_and_read_in_its_own_words():
    circle = Quadric(np.array([[-2, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=object))
    line = Quadric(np.array([[0, 3, -3], [0, 0, 0], [0, 0, 0]], dtype=object))
    assert write_system([circle, line]) == "a,b\n0\n-2+1*a^2+1*b^2,\n1*a-1*b\n"
    assert write_system([line], circle).splitlines()[-1] == "-2*z+1*z*a^2+1*z*b^2-1"
    assert read("[1, 2, -1, []]:", 2) is None
    answer = read("[-1]:", 2)
    assert answer is not None
    assert answer.polynomial.degree() == 0
    answer = read("[0, [0, 2, 2, ['a','b'], [0, 1], [1, [[2, [-1, 0, 1]], [1, [0, 2]], [[[1, [0, -2]], 1]]]]]]:", 2)
    assert answer is not None
    assert sorted(float(answer.others(root.real)[0]) for root, _ in answer.polynomial.complex_roots()) == [1.0, 1.0]


@needs_msolve
def test_msolve_stops_in_time():
    part = next(list_parts(spatial(np.random.default_rng(0), "SSSSSS").system))
    with pytest.raises(ExternalSolverFailure, match="no answer within"):
        parametrise(part.equations(), timeout=0.05)


def test_without_msolve_the_extra_is_named(monkeypatch):
    def absent(name: str):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "files", absent)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MissingExtra) as caught:
        solve(on_two_bodies(np.random.default_rng(0), ("SS", "SS")).system)
    assert caught.value.exit_status == 3
    (line,) = caught.value.lines()
    assert 'pip install "hrsynth[solve]"' in line
    assert solve(translating(np.random.default_rng(0), "SSS").system).complete


def test_too_few_surfaces_leave_a_continuum():
    rng = np.random.default_rng(0)
    assert solve(spatial(rng, "SSSS").system).continuous_family == 2
    assert solve(translating(rng, "SE").system).continuous_family == 1
    assert solve(on_two_bodies(rng, ("SSSS", "")).system).continuous_family == 1
    assert solve_by_msolve(spatial(rng, "LL").system).continuous_family == 2


@pytest.mark.parametrize(
    "bad",
    [
        lambda: Sphere((0, 0, 0), -1.0),
        lambda: Plane((0, 0, 0), (0, 0, 0)),
        lambda: Planar((Sphere((0, 0, 0), 1.0),), np.zeros((1, 2)), np.eye(4)),
        lambda: ArticulatedPlatform(
            (Sphere((0, 0, 0), 1.0),), np.zeros((1, 3)), (2,), Circle((0, 0, 0), (0, 0, 1), 1.0)
        ),
    ],
)
def test_what_is_no_surface_is_refused(bad):
    with pytest.raises(BadRequest):
        bad()
