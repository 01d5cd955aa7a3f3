"""More legs than needed: what they exclude is no mode, the goal is one, and a match in floats proves nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.modes.draws import Draw, Rng, on_two_bodies, planar, spatial, translating
from hrsynth.analysis.modes.modes import modes
from hrsynth.description import list_robots, load
from hrsynth.geometry.loci import Circle, shift_reach
from hrsynth.geometry.vectors import Array, normalise_vector
from hrsynth.present.text.poses import format_modes as text
from hrsynth.solving.platform.rigid import Planar, Spatial
from hrsynth.solving.platform.solve import SystemModes, solve
from hrsynth.solving.platform.translating import TranslatingPlatform
from strategies import random_rotation

MORE: dict[str, Callable[[Rng], Draw]] = {
    **{f"planar {kinds}": lambda rng, kinds=kinds: planar(rng, kinds) for kinds in ("CCCC", "CLLL", "PCC", "PP")},
    **{f"spatial {kinds}": lambda rng, kinds=kinds: spatial(rng, kinds) for kinds in ("CCLL", "LLLL", "PLC", "PPP")},
    **{
        f"translating {kinds}": lambda rng, kinds=kinds: translating(rng, kinds) for kinds in ("CC", "LL", "SSSS", "PC")
    },
    **{
        f"two bodies {'+'.join(kinds)}": lambda rng, kinds=kinds: on_two_bodies(rng, kinds)
        for kinds in (("CC", "C"), ("LL", "CC"))
    },
}
"""Platforms with more legs than needed, through a pose that is a mode."""


def listed(modes: SystemModes, goal: Array, tolerance: float = 1e-9) -> bool:
    return any(np.abs(mode.pose - goal).max() < tolerance for mode in modes.modes)


@pytest.mark.parametrize("name", MORE)
def test_the_goal_is_not_excluded_and_all_others_are(name: str):
    """Not known as the goal it merely fits; known as such it is proved, and nothing else is listed."""
    for seed in range(3):
        system, goal = MORE[name](np.random.default_rng(seed))
        blind = solve(system, near=False)
        assert blind.complete, blind.proof
        assert listed(blind, goal)
        assert [(mode.proved, mode.match_residual) for mode in blind.modes] == [(False, True)]
        told = solve(system, near=False, goal=blind.modes[0].q)
        assert told.complete
        assert [(mode.proved, mode.match_residual) for mode in told.modes] == [(True, False)]


@pytest.mark.parametrize("name", MORE)
def test_what_may_be_the_goal_within_the_error_is_not_excluded(name: str):
    """The curves moved by as much as the input is said to be wrong: the list has the goal or is not complete; moved by
    much more, nothing is a mode."""
    error = 1e-9
    for seed in range(3):
        rng = np.random.default_rng(seed)
        system, goal = MORE[name](rng)
        moves = [normalise_vector(rng.normal(size=3)) for _ in system.curves]
        if isinstance(system, Planar):
            moves = [normalise_vector(v - system.X_plane[:3, 2] * float(system.X_plane[:3, 2] @ v)) for v in moves]
        curves = tuple(shift_reach(curve, 0.9 * error * v) for curve, v in zip(system.curves, moves, strict=True))
        near = solve(replace(system, curves=curves, error=error), near=False)
        assert not near.complete or listed(near, goal, 1e-5), near.proof
        curves = tuple(shift_reach(curve, 1e-4 * v) for curve, v in zip(system.curves, moves, strict=True))
        far = solve(replace(system, curves=curves), near=False)
        assert far.complete, far.proof
        assert far.modes == ()


def test_a_match_below_the_tolerance_that_is_none_is_excluded():
    """A leg off by 1e-10 sizes: formerly a mode, proved."""
    system, _ = planar(np.random.default_rng(2), "CCCC")
    curves = (*system.curves[:3], shift_reach(system.curves[3], 1e-10 * system.X_plane[:3, 0]))
    found = solve(Planar(curves, system.tips, system.X_plane))
    assert found.complete
    assert found.modes == ()
    assert any(each.residual < 1e-9 for each in found.near)


@pytest.mark.parametrize("name", ["planar CCCC", "spatial CCLL", "translating CC", "two bodies CC+C"])
def test_a_goal_whose_solution_is_known_too_roughly_is_a_mode_all_the_same(name: str):
    """A leg off by 1e-8 sizes, with no error told that would make it one: the goal was dropped."""
    system, X = MORE[name](np.random.default_rng(0))
    goal = solve(system, near=False).modes[0].q
    curves = (*system.curves[:-1], shift_reach(system.curves[-1], 1e-8 * system.size * np.ones(3)))
    rough = replace(system, curves=curves, error=np.inf)
    found = solve(rough, near=False, goal=goal)
    assert not found.complete
    assert listed(found, X, 1e-6)
    assert [(mode.proved, mode.match_residual) for mode in found.modes] == [(False, False)]
    assert solve(rough, near=False).modes == ()


def mirrored(rng: Rng) -> tuple[TranslatingPlatform, Array]:
    """Four circles through two points that mirror each other at a plane in which all centres and axes lie."""
    R, o = random_rotation(rng), rng.normal(size=3)
    n, height = R[:, 2], 0.7
    curves = []
    for _ in range(4):
        x, y = rng.normal(size=2)
        centre, axis = o + R @ (x, y, 0), R @ normalise_vector(np.array([-y, x, 0]))
        curves.append(Circle(centre, axis, float(np.hypot(np.hypot(x, y), height))))
    return TranslatingPlatform(tuple(curves), np.zeros((4, 3))), o + height * n


@pytest.mark.parametrize("seed", range(4))
def test_a_second_mode_by_symmetry_is_neither_proved_nor_excluded(seed: int):
    system, goal = mirrored(np.random.default_rng(seed))
    found = solve(system, goal=goal)
    assert found.complete
    assert [(mode.proved, mode.match_residual) for mode in sorted(found.modes, key=lambda mode: not mode.proved)] == [
        (True, False),
        (False, True),
    ]
    assert np.abs(next(mode.q for mode in found.modes if mode.proved) - goal).max() < 1e-12


def test_tips_at_rest_that_are_torn_apart_leave_no_mode():
    system, _ = spatial(np.random.default_rng(0), "PPP")
    curves = (*system.curves[:2], shift_reach(system.curves[2], np.array([1e-6, 2e-6, -1e-6])))
    found = solve(Spatial(curves, system.tips), near=False)
    assert found.complete
    assert found.modes == ()


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("name", "observe", "at", "expected"),
    [
        ("quattro_rigid", ("1", "2"), None, 2),
        ("delta", None, None, 2),
        ("delta", None, "x=0.05,y=0.02,z=-0.6", 1),
        ("quattro", None, None, 2),
    ],
)
def test_robots_with_more_legs_than_needed_do_not_prove_the_mirrored_mode(
    name: str, observe: tuple[str, ...] | None, at: str | None, expected: int
):
    found = modes(load(list_robots()[name]), observe, at=at)
    assert found.found.complete, found.found.proof
    assert len(found.modes) == expected
    assert (found.modes[0].goal, found.modes[0].proved, found.modes[0].match_residual) == (True, True, None)
    record = found.to_dict()["modes"]
    for mode, told in zip(found.modes[1:], record[1:], strict=True):
        assert not told["proved"]
        assert told["match_residual"] == mode.match_residual == mode.residual < 1e-12
        assert "which does not prove it" in text(found)


def test_the_pose_itself_is_a_mode_wherever_it_is_said_to_be():
    """Where its enclosure cannot be told to be its own: nothing is said against it."""
    found = modes(load(list_robots()["delta"]), at="x=0.05,y=0.02,z=-0.6")
    first = replace(found.modes[0], proved=False, match_residual=1e-15)
    said = text(replace(found, modes=(first,)))
    assert "a mode by construction, pose not proved" in said
    assert "which does not prove it" not in said.split("mode 1")[1]
