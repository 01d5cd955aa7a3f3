"""An ending is decided from the state: not from the time that is allowed, nor from the integrator's tolerance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import hrsynth.simulation.run as engine
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.simulation.outcome import BOUNDARY, TIME, UNDECIDED
from hrsynth.simulation.result import Servo
from hrsynth.simulation.run import rest_near
from hrsynth.simulation.servo import ServoTask
from simulation.far import run_between
from simulation.scenes import CONTROLLABLE, far_pairs

LASTS = (30.0, 60.0, 150.0)
"""Seconds that a run may take: by the first most have ended."""


@pytest.mark.slow
def test_a_leg_that_is_stretched_is_a_boundary_however_long_the_run_may_take() -> None:
    """It was *time* after 75 s, and *boundary* with 400 s; at the fold integrators chatter."""
    scene = ServoTask.of(
        ObservedRobot.of(load("quattro_rigid"), "1,3"),
        start="x=-0.314,y=0.319,z=-0.64",
        goal="x=0.342,y=-0.267,z=-0.812",
    )
    found = [scene.result(scene.loop().simulate(scene.start, lasts)) for lasts in (25, 75, 400)]
    assert [each.outcome for each in found] == [BOUNDARY] * 3
    assert all("an unobserved leg is at the limit of its reach" in each.run_outcome.reason for each in found)
    assert np.allclose(found[0].way[-1], found[1].way[-1], atol=1e-6)
    assert np.allclose(found[0].way[-1], found[2].way[-1], atol=1e-6)


def runs(
    name: str, start: ClosedConfiguration, goal: ClosedConfiguration, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Servo]:
    """The same run with other times and other tolerances of the integrator."""
    for lasts in LASTS:
        monkeypatch.setattr("hrsynth.simulation.servo.LASTS", 0.8 * lasts)
        yield run_between(name, start, goal)
    for tolerance in (1e-5, 1e-7):
        monkeypatch.setattr(engine, "RUN_INTEGRATOR_TOL", tolerance)
        yield run_between(name, start, goal)


def check_endings(name: str, seed: int, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for start, goal in far_pairs(name, seed, count):
        with monkeypatch.context() as patch:
            found = [each for each in runs(name, start, goal, patch) if each.outcome not in (TIME, UNDECIDED)]
        assert found
        for each in found[1:]:
            assert each.outcome == found[0].outcome
            assert ("runs away" in each.run_outcome.reason) == ("runs away" in found[0].run_outcome.reason)
            if "runs away" in each.run_outcome.reason:
                continue  # it ends nowhere
            assert np.allclose(each.way[-1], found[0].way[-1], atol=1e-5 * start.model.length)
            assert np.allclose(each.turns[-1], found[0].turns[-1], atol=1e-5)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("name", ["3rps", "rrrrr_m1", "3rpr_m1"])
def test_endings_depend_on_neither_time_nor_tolerance(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_endings(name, 0, 1, monkeypatch)


@pytest.mark.long
@pytest.mark.parametrize("name", CONTROLLABLE)
def test_more_endings_depend_on_neither_time_nor_tolerance(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_endings(name, 5, 20, monkeypatch)


def test_a_rest_is_found_where_it_is_and_told_whether_it_holds() -> None:
    """Of random linear fields, stiff ones too, whose zero and eigenvalues are known; with a line of zeros as well."""
    rng, told = np.random.default_rng(0), 0
    for number in range(60):
        n = int(rng.integers(1, 6))
        V, rest = rng.normal(size=(n, n)), 0.01 * rng.normal(size=n)
        values = -(10.0 ** rng.uniform(-1, 5, n))
        if number % 3 == 1:
            values[0] = 0.3
        if number % 3 == 2:
            values[-1] = 0.0
        A = V @ np.diag(values) @ np.linalg.inv(V)
        found = rest_near(lambda y, A=A, rest=rest: A @ (y - rest), np.zeros(n))
        if found is None:
            continue
        told += 1
        assert np.linalg.norm(A @ (found.y - rest)) <= 1e-8 * np.linalg.norm(A)
        assert found.growth == pytest.approx(values.max(), rel=1e-3, abs=1e-6 * np.abs(values).max())
    assert told > 50
    drift = rest_near(lambda y: np.array([-5.0 * y[0], 1e-3]), np.array([0.01, 0.0]))
    assert drift is None
