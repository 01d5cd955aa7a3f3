"""Rigid platforms under conditions on their points: the named classes, proved, against a count modulo a prime."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

import hrsynth
from analysis.modes import sections
from analysis.modes.draws import Draw, dietmaier, six_rods, spatial
from analysis.modes.laws import among
from analysis.modes.test_meant import CLASSES
from hrsynth.description import list_robots, load
from hrsynth.geometry.loci import Circle, Plane, Point, Sphere
from hrsynth.geometry.vectors import build_pose, normalise_vector, rotate_about_axis
from hrsynth.solving.platform.homotopy import make_section
from hrsynth.solving.platform.rigid import Spatial
from hrsynth.solving.platform.root_bound import compute_degree_bound, find_least_bound
from hrsynth.solving.platform.solve import SystemModes, solve
from strategies import random_rotation

Rng = np.random.Generator

MIXED = {"SSSSSS": 40, "CSSSS": 40, "EEESSS": 40, "CCSS": 32, "CEESS": 40, "CCES": 32, "LSSSS": 28, "CCC": 16}
"""Tips on spheres S, planes E, circles C and lines L, and the complex poses."""

NAMED: dict[str, tuple[Callable[[Rng], Draw], int]] = {
    **{kinds: (lambda rng, kinds=kinds: spatial(rng, kinds), count) for kinds, count in MIXED.items()},
    **{
        f"{platform} on {base}": (lambda rng, both=(platform, base): six_rods(rng, *both), count)
        for platform, base, count in CLASSES
    },
}
"""How to draw a member, and how many poses it has; in ``AABBCC on ABBCCA``, Rusin's octahedral platform, rods 1 and 2
share a ball of the platform, rods 2 and 3 one of the base."""

CURVED = {"AAABBC on ABCDEF"}
"""Classes with a curve of solutions at infinity, which the count modulo a prime does not cover."""


def check(name: str, seed: int) -> SystemModes:
    """All poses proved, the goal among them, all tips in place."""
    maker, count = NAMED[name]
    system, goal = maker(np.random.default_rng(seed))
    found = solve(system, near=False)
    assert (found.complex, found.complete) == (count, True), f"seed {seed}: {found.proof}"
    assert (count - len(found.modes)) % 2 == 0
    assert among(goal, found) < max(1e-10, 100 * max(mode.radius for mode in found.modes))
    assert max(mode.residual for mode in found.modes) < 1e-12
    return found


@pytest.mark.some(2)
@pytest.mark.parametrize("name", NAMED)
def test_named_classes_are_proved(name: str):
    check(name, 100)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("platform", "base", "count"), [("AABBCD", "ABABCD", 16), ("AABBCC", "ABABCD", 8), ("AAABCD", "ABCDDE", 8)]
)
def test_rods_that_share_balls_have_bounds_of_their_own(platform: str, base: str, count: int):
    for seed in range(3):
        found = solve(six_rods(np.random.default_rng(seed), platform, base).system, near=False)
        assert (found.complex, found.complete) == (count, True), found.proof


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("name", NAMED)
def test_named_classes_are_proved_at_twenty_instances(name: str):
    real = {len(check(name, seed).modes) for seed in range(20)}
    assert len(real) > 1


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["CCSS", "AABCDE on ABCCDE"])
def test_as_many_are_counted_modulo_a_prime(name: str):
    maker, count = NAMED[name]
    assert sections.poses(sections.rows(maker(np.random.default_rng(100)).system)) == count


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in NAMED if name not in CURVED])
def test_as_many_are_counted_modulo_a_prime_at_twenty_instances(name: str):
    maker, count = NAMED[name]
    for seed in range(20):
        assert sections.poses(sections.rows(maker(np.random.default_rng(seed)).system)) == count, f"seed {seed}"


@pytest.mark.slow
def test_poses_are_of_degree_forty():
    assert sections.degree() == 40


def test_the_kept_section_is_six_conditions_on_poses():
    """Its quadrics are those of the forms of h, M, y, x, r: they vanish on no pose at random, but on combinations."""
    assert make_section().shape == (7, 8, 8)
    assert np.linalg.matrix_rank(make_section().reshape(7, -1)) == 7


def test_all_forty_poses_of_dietmaiers_platform_are_real():
    found = solve(dietmaier())
    assert (found.complex, len(found.modes), found.complete) == (40, 40, True)
    assert all(mode.proved for mode in found.modes)
    poses = np.array([mode.pose for mode in found.modes])
    apart = np.abs(poses[:, None] - poses[None]).max(axis=(2, 3)) + np.eye(40)
    assert apart.min() > 1e-3


def test_they_move_with_the_base_whose_legs_are_counted_in_any_order():
    system = dietmaier()
    R, t = rotate_about_axis((1, 2, -1), 0.7), np.array([0.3, -1.0, 2.0])
    order = [4, 0, 5, 2, 1, 3]
    moved = Spatial(
        tuple(Sphere(R @ system.curves[k].centre + t, system.curves[k].radius) for k in order), system.tips[order]
    )
    after = solve(moved)
    assert after.complete
    for mode in solve(system).modes:
        assert among(build_pose(R @ mode.pose[:3, 3] + t, R @ mode.pose[:3, :3]), after) < 1e-6


def test_the_shipped_platform_has_twenty_eight():
    """Base and platform are symmetric hexagons: twelve solutions lie at infinity, and are enclosed there."""
    found = hrsynth.modes(load(list_robots()["gough_stewart"]), real=True).found
    assert (found.complex, found.complete) == (28, True)
    assert "12 enclosed at infinity" in found.proof


@pytest.mark.slow
@pytest.mark.parametrize("word", ["AAABBB", "AABBCD"])
def test_platforms_that_move_are_not_listed(word: str):
    """Six rods to two balls, or three rods on either side of a line: the platform turns about it."""
    system, _ = six_rods(np.random.default_rng(0), word, "ABCDEF" if word == "AAABBB" else "ABABAB")
    found = solve(system)
    assert (found.complete, found.modes) == (False, ())
    assert found.continuous_family == 1


@pytest.mark.slow
def test_a_griffis_duffy_platform_is_not_called_complete():
    """Similar hexagons with parallel sides: it moves where the rods are of equal length."""
    corners = np.array([(np.cos(a), np.sin(a), 0.0) for a in np.arange(6) * np.pi / 3])
    tips = 0.5 * corners
    radius = float(np.linalg.norm(corners[0] - (tips[0] + (0, 0, 0.8))))
    assert not solve(Spatial(tuple(Sphere(c, radius) for c in corners), tips), near=False).complete


def test_a_singular_pose_is_never_called_complete():
    """Rods at rest in their longest reach: two poses meet."""
    rng = np.random.default_rng(4)
    for _ in range(3):
        system, goal = spatial(rng, "SSSSSS")
        tips = goal[:3, 3] + system.tips @ goal[:3, :3].T
        rods = np.array([curve.centre for curve in system.curves]) - tips
        # the sixth rod goes through the axis of a twist that the first five allow
        rows = np.array([[*rod, *np.cross(tip, rod)] for rod, tip in zip(rods[:5], tips[:5], strict=True)])
        twist = np.linalg.svd(rows)[2][-1]
        v = twist[:3] + np.cross(twist[3:], tips[5])
        rod = normalise_vector(np.cross(v, rng.normal(size=3)))
        curves = (*system.curves[:5], Sphere(tips[5] + rod, 1.0))
        found = solve(replace(system, curves=curves), near=False)
        assert not found.complete
        assert among(goal, found) < 1e-4


def test_double_points_at_infinity_are_what_is_said():
    """Poses with h small, near M = v uᵀ, follow the seven directions of the tangent space, and h r = ν², to third
    order; v, u, n, m as in the code, and a pose is a turn by a large imaginary angle."""
    rng = np.random.default_rng(0)
    E, F = random_rotation(rng), random_rotation(rng)
    v, n = E[:, 0] + 1j * E[:, 1], E[:, 2]
    u, m = F[:, 0] - 1j * F[:, 1], F[:, 2]
    h, nu = 1e-4, 1e-4 * 0.3
    M = np.outer(v, u) + h * np.outer(n, m) + h * h / 4 * np.outer(v.conj(), u.conj())
    y = nu * n
    assert np.abs(M @ M.T - h * h * np.eye(3)).max() < 1e-15
    assert np.linalg.det(M / h).real == pytest.approx(1.0)
    x, r = M.T @ y / h, (y @ y) / h
    assert np.abs(M - (np.outer(v, u) + h * np.outer(n, m))).max() < h * h
    assert np.abs(x - nu * m).max() < 1e-15
    assert h * r == pytest.approx(nu * nu)


@pytest.mark.slow
def test_no_bound_is_lower_than_what_is_found():
    """Every pattern of up to three balls of two rods each on either side."""
    rng = np.random.default_rng(1)
    for platform in ("AABBCC", "AABBCD", "AABCDE"):
        for base in sorted({"".join(each) for each in permutations("AABBCD")}, key=lambda _: rng.random())[:4]:
            system, _ = six_rods(rng, platform, base)
            if len(set(zip(platform, base, strict=True))) == 6:
                found = solve(system, near=False)
                least = find_least_bound(system, range(6))
                assert least is not None
                assert found.complex is not None
                assert found.complex <= least.most, (platform, base)


@pytest.mark.slow
def test_parallel_circles_and_planes_keep_their_bounds():
    """Circles about one axis direction: the normals are one point at infinity of the base."""
    rng = np.random.default_rng(2)
    goal = build_pose(rng.normal(size=3), random_rotation(rng))
    tips = rng.normal(scale=0.6, size=(4, 3))
    at = goal[:3, 3] + tips @ goal[:3, :3].T
    n = normalise_vector(rng.normal(size=3))
    circles = tuple(Circle(p - 0.7 * normalise_vector(np.cross(n, rng.normal(size=3))), n, 0.7) for p in at[:2])
    spheres = tuple(Sphere(p + rng.normal(size=3), 1.0) for p in at[2:])
    curves = (
        *circles,
        *(replace(s, radius=float(np.linalg.norm(s.centre - p))) for s, p in zip(spheres, at[2:], strict=True)),
    )
    system = Spatial(curves, tips)
    found = solve(system, near=False)
    assert found.complex == sections.poses(sections.rows(system))
    assert among(goal, found) < 1e-9 or not found.complete


def test_a_point_at_rest_leaves_few():
    rng = np.random.default_rng(3)
    for kinds, count in (("PSSS", 8), ("PESS", 8), ("PCS", 4), ("PLE", 4)):
        for _ in range(3):
            system, goal = spatial(rng, kinds)
            assert isinstance(system.curves[0], Point)
            found = solve(system, near=False)
            assert (found.complex, found.complete) == (count, True), found.proof
            assert among(goal, found) < 1e-9


@pytest.mark.parametrize(("kinds", "count"), [("SSSSS", 40), ("CCS", 32)])
def test_an_angle_that_a_leg_keeps_is_a_condition_as_any_other(kinds: str, count: int):
    system, goal = with_angles(np.random.default_rng(0), kinds, 1)
    found = solve(system, near=False)
    assert (found.complex, found.complete) == (count, True), found.proof
    assert among(goal, found) < 1e-9


@pytest.mark.slow
def test_three_angles_leave_no_continuum():
    """They decide the turn, three spheres the place: 16 poses, and infinitely many solutions at infinity."""
    system, goal = with_angles(np.random.default_rng(0), "SSS", 3)
    found = solve(system, near=False)
    assert (found.complex, found.complete, found.continuous_family) == (16, False, None)
    assert among(goal, found) < 1e-9


def with_angles(rng: Rng, kinds: str, angles: int) -> Draw:
    """Some vectors of the platform keep their angles with directions of the base."""
    drawn = spatial(rng, kinds)
    arrows, hub = rng.normal(size=(angles, 3)), rng.normal(size=3)
    planes = tuple(Plane(hub + drawn.goal[:3, :3] @ arrow, normalise_vector(rng.normal(size=3))) for arrow in arrows)
    curves, tips = (*drawn.system.curves, *planes), np.vstack([drawn.system.tips, arrows])
    return Draw(Spatial(curves, tips, angles, hub), drawn.goal)


def test_planes_alone_leave_eight_and_double_points_count_none():
    system, _ = spatial(np.random.default_rng(5), "EEEEEE")
    assert all(isinstance(curve, Plane) for curve in system.curves)
    assert solve(system, near=False).complex == 8
    assert compute_degree_bound(system, range(6)).most == 40
