"""What holds for the modes of every random platform, whoever solves it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.modes.draws import FAMILIES, MEETING, SURFACES, Draw
from hrsynth.errors import MissingExtra
from hrsynth.geometry.vectors import Array
from hrsynth.solving.platform.constrained_platform import System
from hrsynth.solving.platform.msolve import find_executable
from hrsynth.solving.platform.solve import SystemModes, solve, solve_by_msolve

EVERY = FAMILIES | MEETING | SURFACES


def installed() -> bool:
    """Whether msolve is."""
    try:
        find_executable()
    except MissingExtra:
        return False
    return True


needs_msolve = pytest.mark.skipif(not installed(), reason="msolve is not installed (extra `solve`)")


def draw(name: str, seed: int) -> Draw:
    return EVERY[name].draw(np.random.default_rng(seed))


def among(goal: Array, modes: SystemModes) -> float:
    """How far the nearest mode is from a pose."""
    return min((float(np.abs(mode.pose - goal).max()) for mode in modes.modes), default=np.inf)


def check_member(name: str, seed: int, solver: Callable[[System], SystemModes] = solve) -> None:
    """Counted, complete, the goal among them, all tips in place."""
    system, goal = draw(name, seed)
    modes = solver(system)
    assert modes.complex == EVERY[name].count, f"seed {seed}: {modes.proof}"
    assert modes.enclosed, f"seed {seed}: {modes.proof}"
    if solver is solve:
        assert modes.complete, f"seed {seed}: {modes.proof}"
    assert modes.complete == (modes.bound != "none"), f"seed {seed}: {modes.proof}"
    assert (modes.complex - len(modes.modes)) % 2 == 0, f"seed {seed}: complex ones come in pairs"
    tolerance = max(1e-10, 100 * max((mode.radius for mode in modes.modes), default=0.0))
    assert among(goal, modes) < tolerance, f"seed {seed}: the goal is not among the modes"
    for mode in modes.modes:
        assert mode.residual < 1e-12, f"seed {seed}: a tip is off its curve by {mode.residual:.1e}"
        assert np.abs(mode.pose[:3, :3].T @ mode.pose[:3, :3] - np.eye(3)).max() < 1e-12
        assert np.linalg.det(mode.pose[:3, :3]) > 0


def check_agreement(name: str, seed: int) -> None:
    """Elimination and msolve list the same poses."""
    system, _ = draw(name, seed)
    one, other = solve(system), solve_by_msolve(system)
    assert one.complete, f"seed {seed}: {one.proof}"
    assert other.enclosed, f"seed {seed}: {other.proof}"
    assert len(one.modes) == len(other.modes), f"seed {seed}"
    for mode in one.modes:
        tolerance = max(1e-10, 100 * mode.radius, 100 * max(each.radius for each in other.modes))
        assert among(mode.pose, other) < tolerance, f"seed {seed}: a pose that msolve does not list"
