"""Special geometry that agrees to rounding only is counted as meant, or refused; known counts of six-legged pods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.modes.draws import six_rods, spatial
from analysis.modes.laws import among, needs_msolve
from hrsynth.errors import GeometryAmbiguous
from hrsynth.geometry.loci import Line
from hrsynth.geometry.vectors import Array
from hrsynth.solving.platform.overdetermined import snap_centres
from hrsynth.solving.platform.rigid import Spatial
from hrsynth.solving.platform.solve import solve
from strategies import random_rotation

CLASSES = [
    ("AAABBC", "ABCDEF", 8),
    ("AAABCD", "ABCDEF", 16),
    ("AABBCC", "ABBCCA", 16),
    ("AABBCC", "ABCDEF", 16),
    ("ABCDEF", "AAABCD", 16),
    ("AABCDE", "ABCCDE", 24),
    ("AABBCD", "ABCDEF", 32),
    ("AABCDE", "ABCDEF", 40),
]
"""Which rods share balls of the platform and of the base, and the complex modes (J.-C. Faugère, D. Lazard, Mech. Mach.
Theory 30, 1995)."""


@needs_msolve
@pytest.mark.parametrize(
    ("platform", "base", "count"),
    [case if case[2] == 8 else pytest.param(*case, marks=pytest.mark.slow) for case in CLASSES],
)
def test_balls_that_coincide_to_rounding_count_as_one(platform: str, base: str, count: int):
    system, goal = six_rods(np.random.default_rng(3), platform, base, 1e-15)
    found = solve(system)
    assert found.complex == count
    assert {frozenset(each.legs) for each in found.snapped if each.where == "platform"} == {
        frozenset(k for k in range(6) if platform[k] == letter) for letter in "ABC" if platform.count(letter) > 1
    }
    assert all(0 < each.defect < 1e-13 for each in found.snapped)
    assert among(goal, found) < 1e-10
    assert all(mode.proved for mode in found.modes)
    assert not found.complete or found.bound == "class"


@pytest.mark.long
@pytest.mark.parametrize(("platform", "base", "count"), [case for case in CLASSES if case[2] <= 16])
def test_newton_from_complex_starts_finds_as_many(platform: str, base: str, count: int):
    """At all twenty instances of the class with a curve of solutions at infinity, which is counted in no other way."""
    for seed in range(20) if count == 8 else (3,):
        system, _ = six_rods(np.random.default_rng(seed), platform, base)
        assert len(by_newton(system, 2500, np.random.default_rng(seed))) == count, f"seed {seed}"


def by_newton(system: Spatial, starts: int, rng: np.random.Generator) -> list[Array]:
    """Distinct complex poses (p, quaternion of unit square) found by Newton's method from random starts."""
    b, c = system.tips, np.array([curve.centre for curve in system.curves])
    squares = np.array([curve.radius**2 for curve in system.curves])

    def equations(v: Array) -> Array:
        p, w, u = v[:, :3], v[:, 3], v[:, 4:]
        q = (u * u).sum(axis=1)
        turned = (
            (w * w - q)[:, None, None] * b
            + 2 * (u @ b.T)[:, :, None] * u[:, None]
            + 2 * w[:, None, None] * np.cross(u[:, None], b)
        )
        away = p[:, None] + turned - c
        return np.hstack([(away * away).sum(axis=2) - squares, (w * w + q - 1)[:, None]])

    v = rng.normal(size=(starts, 7)) + 1j * rng.normal(size=(starts, 7))
    for _ in range(120):
        F = equations(v)
        J = np.stack([(equations(v + h) - equations(v - h)) / 2e-6 for h in 1e-6 * np.eye(7)], axis=2)
        step = np.linalg.solve(J + 1e-300, F[:, :, None])[:, :, 0]
        v = v - step * np.minimum(1.0, 1.0 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
    good = v[(np.abs(equations(v)).max(axis=1) < 1e-9) & (np.abs(v).max(axis=1) < 1e3)]
    found: list[Array] = []
    for each in good:
        other = np.r_[each[:3], -each[3:]]
        if not any(min(np.abs(each - known).max(), np.abs(other - known).max()) < 1e-5 for known in found):
            found.append(each)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_lines_of_one_plane_count_as_such_though_rounding_tilts_them(seed: int):
    """Four modes instead of eight: the others are at infinity (docs/pages/proofs.md, section 8)."""
    rng = np.random.default_rng(seed)
    R, G, p = random_rotation(rng), random_rotation(rng), rng.normal(size=3)
    tips = rng.normal(size=(3, 3))
    along = np.c_[rng.normal(size=(3, 2)), np.zeros(3)] @ R.T
    system = Spatial(tuple(Line(G @ tip + p, d) for tip, d in zip(tips, along, strict=True)), tips)
    found = solve(system)
    assert (found.complex, found.complete) == (4, True)
    assert "at infinity, up to rounding" in found.proof
    assert solve(replace(system, as_written=True)).complex == 8


def test_what_may_be_meant_or_not_is_refused():
    system, _ = six_rods(np.random.default_rng(1), "AABCDE", "ABCDEF")
    tips = system.tips.copy()
    tips[1] += (1e-6, 0, 0)
    tips[3] = tips[2] + (4e-5 * system.size, 0, 0)
    near = replace(system, tips=tips)
    with pytest.raises(GeometryAmbiguous) as caught:
        snap_centres(near)
    assert caught.value.exit_status == 3
    assert "--as-written" in str(caught.value)
    assert snap_centres(replace(near, as_written=True))[1] == ()


@pytest.mark.parametrize("defect", [1e-16, 1e-12, 1e-8, 1e-6])
def test_what_is_meant_is_made_exact_and_its_error_is_kept(defect: float):
    system, _ = six_rods(np.random.default_rng(1), "AABCDE", "ABCDEF")
    tips = system.tips.copy()
    tips[1] += (defect, 0, 0)
    exact, told = snap_centres(replace(system, tips=tips))
    assert np.array_equal(exact.tips[0], exact.tips[1])
    assert [each.legs for each in told] == [(0, 1)]
    assert exact.error >= told[0].defect == pytest.approx(defect, rel=0.5)


def test_what_is_far_apart_or_exact_is_left_as_it_is():
    for system in (
        six_rods(np.random.default_rng(1), "ABCDEF", "ABCDEF").system,
        six_rods(np.random.default_rng(1), "AABCDE", "ABCDEF").system,
        spatial(np.random.default_rng(0), "LLL").system,
    ):
        assert snap_centres(system) == (system, ())
