"""Modes that are searched for: each is one, and where a list is complete the search finds nothing else."""

from __future__ import annotations

import shutil
from functools import cache

import numpy as np
import pytest

import hrsynth
from analysis.modes.closings import other_branch
from analysis.modes.test_robots import check_modes, robot_of
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.mode_search import search
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.entry import build_mechanism
from hrsynth.constraints.pattern import list_leg_ends
from hrsynth.description import list_robots, load
from hrsynth.mechanism import Mechanism
from hrsynth.solving.platform.msolve import PACKAGE

LISTED = [
    ("3rrr_m1", None, False),
    ("3rps", None, False),
    ("gough_stewart", "1,3,5", False),
    ("quattro", "1,4", False),
    ("delta", None, True),
]
WORDS = ["(Pk*-Rt-S)+(Rt*-Rt-S)+(S-Rt*-Rt)", "3(Ra!-Ra*-Ph-Rb-Ra)", "3(Ph*-Rz-Piz)"]
"""Robots of which no system of equations is known."""


@cache
def robot(name: str) -> Mechanism:
    return load(list_robots()[name]) if name in list_robots() else build_mechanism(parse(name), 0)


def check_agreement(listed: AssemblyModes) -> None:
    """What is searched for is in the complete list, but for closings on another branch (crossed parallelograms, turns
    of a platform that only translates)."""
    assert listed.found.complete
    measured = MeasuredRobot.of(listed.setup, listed.kind == "real")
    found = search(listed.goal, measured.observation_model, list_leg_ends(listed.setup.decomposition))
    assert found.loose == 0
    for mode in found.modes:
        if not other_branch(listed, mode.configuration):
            assert (
                min(
                    max(np.abs(X - each.bodies[body]).max() for body, X in mode.bodies.items())
                    for each in listed.modes
                    if each.bodies
                )
                < 1e-6
            )
    assert sum(mode.met for mode in found.modes) == found.closed + 1


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe", "real"), LISTED)
def test_a_search_finds_only_what_a_complete_list_has(name: str, observe: str | None, real: bool):
    check_agreement(hrsynth.modes(robot(name), observe, real=real))


@pytest.mark.some(0, 5)
@pytest.mark.parametrize("kind", ["planar", "pod", "delta"])
@pytest.mark.parametrize("seed", range(200, 206))
def test_a_search_finds_only_what_a_complete_list_of_a_random_robot_has(kind: str, seed: int):
    mechanism, real = robot_of(kind, seed)
    listed = hrsynth.modes(mechanism, real=real)
    if listed.found.complete and listed.found.continuous_family is None:
        check_agreement(listed)


@pytest.mark.slow
@pytest.mark.parametrize("word", WORDS)
def test_a_robot_without_a_list_has_modes_that_are_found(word: str):
    observed = hrsynth.observe(robot(word))
    at = observed.configurations[3]
    listed = hrsynth.modes(observed, at=at)
    if listed.found.complete:  # in natural coordinates, unless the time is short
        assert listed.found.bound == "combinations"
        check_agreement(listed)
    found = hrsynth.modes(observed, at=at, time_limit=1.0)
    assert (found.found.complex, found.found.complete, found.found.bound) == (None, False, "none")
    assert found.found.proof.startswith("found from ")
    assert found.to_dict()["complex"] is None
    assert all(np.isinf(mode.radius) and not mode.proved for mode in found.modes)
    check_modes(found)


def test_a_platform_that_is_a_point_has_modes_at_points():
    """However its body, of which only the point counts, is turned."""
    mechanism, real = robot_of("planar, a point", 6)
    listed = hrsynth.modes(mechanism, real=real)
    measured = MeasuredRobot.of(listed.setup, real)
    bodies = list_leg_ends(listed.setup.decomposition)
    found = search(listed.goal, measured.observation_model, bodies)
    assert listed.found.complete
    assert len(found.modes) == len(listed.modes) == 2


@pytest.mark.slow
def test_poses_that_the_measurements_leave_free_are_told_and_not_listed():
    """Watched legs that see all freedoms at a generic pose, at a zero pose where they do not: it moves in two ways."""
    found = hrsynth.modes(robot("3(Ra-Rb*-Ph-Rb-Pj)"))
    (motion,) = found.self_motions
    assert (motion.goal, motion.dimension, found.found.continuous_family) == (True, 2, 2)
    assert "platform" in motion.links
    assert not {o.link for o in found.setup.observed} & set(motion.links)
    assert found.modes == ()


@pytest.mark.slow
def test_without_the_solver_the_modes_are_found_and_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    """Where the time is too short for natural coordinates, which need none."""
    import importlib.metadata

    def absent(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "files", absent)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    listed = hrsynth.modes(robot("quattro"), real=True)
    assert (listed.found.complete, listed.found.bound, len(listed.modes)) == (True, "combinations", 4)
    found = hrsynth.modes(robot("quattro"), real=True, time_limit=3.0)
    assert not found.found.complete
    assert len(found.modes) > 1
    assert 'pip install "hrsynth[solve]"' in found.found.proof
    assert PACKAGE not in found.found.proof


@pytest.mark.slow
def test_what_was_found_is_drawn(tmp_path):
    from hrsynth.present.modes import draw_modes, require_scene

    found = hrsynth.modes(robot(WORDS[2]))
    assert len(require_scene(found).placed) == len(found.modes) > 1
    assert draw_modes(found).startswith(b"\x89PNG")
