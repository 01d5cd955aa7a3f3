"""The control law against an interaction matrix from the joints' screws, and against finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hrsynth.geometry.vectors import Array, hat
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import compute_interaction
from hrsynth.kinematics.tasks import solve
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.simulation.law import Law, damped_inverses, directions
from hrsynth.tolerances import CLOSURE_SOLVER_TOL, CONTROLLER_DAMPING_MIN
from simulation.scenes import CONTROLLABLE, few_first, home, regular, setting


def pair(name: str) -> tuple[ClosedConfiguration, ClosedConfiguration]:
    found = regular(name, 1, 0.3)
    return next(found), next(found)


def law_of(name: str) -> Law:
    return Law(setting(name).samples.observation_model, setting(name).dof, 0.8)


def seen(at: ClosedConfiguration, law: Law) -> Array:
    return directions(at, law.observation_model)[0]


@pytest.mark.parametrize("name", few_first(CONTROLLABLE))
def test_the_platform_moves_as_equation_11_says(name: str):
    start, goal = pair(name)
    law = law_of(name)
    desired = seen(goal, law)
    command = law.at(start, (desired, 0 * desired))
    M = compute_interaction(start, law.observation_model)
    L = np.vstack([-hat(u) @ M[3 * i : 3 * i + 3] for i, u in enumerate(desired)])
    wanted = -law.gain * np.linalg.pinv(L) @ np.cross(seen(start, law), desired).ravel()
    moved = replace(law.observation_model, observations=(), bodies=()).rows(start) @ command.velocity
    basis = compute_relation(start, law.observation_model).twists
    assert np.linalg.norm(moved - basis @ (basis.T @ moved)) < 1e-9 * max(1, np.linalg.norm(moved))
    assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(wanted), rel=1e-6)
    rates = np.concatenate([r @ command.velocity for r in directions(start, law.observation_model)[1]])
    assert M @ wanted == pytest.approx(rates, abs=1e-7 * max(1, np.linalg.norm(moved)))


@pytest.mark.parametrize("name", ["3rpr_m1", "delta", "gough_stewart", "quattro"])
def test_the_error_falls_as_its_projection_says(name: str):
    start, goal = pair(name)
    law = law_of(name)
    model, step = start.model, 1e-6
    desired = seen(goal, law)
    command = law.at(start, (desired, 0 * desired))

    def error(sign: float) -> Array:
        q, _ = solve(model, model.integrate(start.q, sign * step * command.velocity), tolerance=CLOSURE_SOLVER_TOL)
        return np.cross(seen(ClosedConfiguration.of(model, q), law), desired).ravel()

    rate = (error(1.0) - error(-1.0)) / (2 * step)
    e = np.concatenate(command.error)
    kernel, _ = start.kernel()
    L = (
        np.vstack([-hat(u) @ r for u, r in zip(desired, directions(start, law.observation_model)[1], strict=True)])
        @ kernel
    )
    assert rate == pytest.approx(-law.gain * L @ np.linalg.pinv(L, rcond=1e-9) @ e, abs=1e-5)
    assert e @ rate < 0


@pytest.mark.parametrize("name", ["3rpr_m1", "delta", "gough_stewart"])
def test_moving_desired_directions_are_fed_forward(name: str):
    law, (start, _) = law_of(name), pair(name)
    model = start.model
    kernel, _ = start.kernel()
    velocity = kernel @ np.linspace(-0.1, 0.1, kernel.shape[1])
    u, rates = directions(start, law.observation_model)
    moving = np.array([r @ velocity for r in rates])
    command = law.at(start, (u, moving))
    assert np.array([r @ command.velocity for r in rates]) == pytest.approx(moving, abs=1e-9)
    assert model.nv == len(command.velocity)


def test_the_inverse_is_exact_where_nothing_is_weak_and_bounded_where_something_is():
    assert damped_inverses(np.array([2.0, 1.0, 2 * CONTROLLER_DAMPING_MIN])) == pytest.approx(
        [0.5, 1.0, 0.5 / CONTROLLER_DAMPING_MIN]
    )
    weak = np.geomspace(CONTROLLER_DAMPING_MIN, 1e-12, 50)
    assert np.all(damped_inverses(weak) <= 1 / CONTROLLER_DAMPING_MIN + 1e-9)
    assert damped_inverses(np.array([0.0]))[0] == 0.0


def test_a_goal_reached_commands_nothing():
    scene = home("delta")
    command = scene.law.at(scene.goal, scene.desired(0.0))
    assert (command.size, command.speed) == (pytest.approx(0, abs=1e-12), pytest.approx(0, abs=1e-9))
