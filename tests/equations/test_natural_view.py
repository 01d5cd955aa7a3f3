"""The equations of natural coordinates hold in all configurations of a robot with the same measured values."""

from __future__ import annotations

import numpy as np
import pytest

import hrsynth
from analysis.modes.closings import closings
from analysis.modes.test_sighted import ROBOTS as SEEN
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.analysis.modes.natural_modes import NaturalPlatform, solve_natural
from hrsynth.equations.natural_view import NaturalView, read_natural_view
from hrsynth.geometry.vectors import Array, invert_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.tasks import solve as close
from hrsynth.solving.uniqueness import evaluate_quadrics
from kinematics.robots import ROBOTS
from strategies import planar, pods


def value_at(view: NaturalView, goal: ClosedConfiguration, at: ClosedConfiguration) -> Array:
    """The unknowns (n,) at a closed configuration, from the poses of the links alone."""
    x, length = np.full(len(view.goal), np.nan), goal.model.length
    for link, (group, origin, places) in view.links.items():
        X = at.pose(link) @ invert_pose(goal.pose(link))
        basis, images = view.groups[group]
        if images is not None:
            for column, each in zip(basis.T, images, strict=True):
                x[each] = X[:3, :3] @ column
        if places is not None:
            x[places] = X[:3, :3] @ origin + X[:3, 3] / length
    return x


def check(listed: AssemblyModes, starts: int) -> int:
    """Check the equations and the bounds where random starts close the robot; the number of these."""
    measured, goal = MeasuredRobot.of(listed.setup, listed.kind == "real"), listed.goal
    view = read_natural_view(goal, measured.observation_model.observations, goal.model.mechanism.base, (), (), 1e-12)
    assert np.abs(evaluate_quadrics(view.matrices, view.goal)[0]).max() < 1e-9
    found = closings(listed, starts)
    for at in found:
        x = value_at(view, goal, at)
        assert np.all(np.isfinite(x))
        assert np.abs(evaluate_quadrics(view.matrices, x)[0]).max() < 1e-9
        assert np.all(np.abs(x) <= view.farthest)
    return len(found)


@pytest.mark.some(3)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robots_satisfy_them(name: str, real: bool):
    listed = hrsynth.modes(name, real=real, cone=0)
    assert check(listed, 12) > 0 or listed.found.continuous_family is not None


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(4))
def test_random_robots_satisfy_them(seed: int):
    rng = np.random.default_rng(seed)
    for robot in (planar(("RPR", "RRR", "PRR"), rng, [(0,)] * 3), pods(("RPS",) * 3, rng), pods(("UPS",) * 6, rng)):
        for real in (False, True):
            assert check(hrsynth.modes(robot, real=real, cone=0), 9) >= 0


def test_held_slides_keep_their_length_at_another_pose():
    """A held slide is one place of two links, wherever the goal is."""
    listed = hrsynth.modes("gough_stewart", real=True, at="x=0.03,y=-0.02,z=0.33,rpy=0.1/0/0", cone=0)
    assert check(listed, 12) > 0


def test_an_equation_holds_what_a_joint_holds():
    """Without one of them the equations at the goal have a motion: none is idle."""
    setup = hrsynth.observe("3rrr_m1")
    measured = MeasuredRobot.of(setup)
    system = solve_natural(measured, setup.all_samples.start)[0].system
    assert isinstance(system, NaturalPlatform)
    _, J = evaluate_quadrics(system.view.matrices, system.view.goal)
    assert np.linalg.svd(J, compute_uv=False)[-1] > 1e-3
    some = read_natural_view(setup.all_samples.start, measured.observation_model.observations[:2], "base", (), (), 0.0)
    _, J = evaluate_quadrics(some.matrices, some.goal)
    assert np.linalg.svd(J, compute_uv=False)[-1] < 1e-9


@pytest.mark.parametrize("name", ["seen from the base", "cameras on both"])
def test_errors_bound_what_an_inexact_goal_changes(name: str):
    """Read at a configuration beside the goal, the equations miss at the goal's modes by less than their errors."""
    setup, rng = SEEN[name](), np.random.default_rng(0)
    listed, model = hrsynth.modes(setup, at=setup.configurations[0], cone=0), setup.samples.observation_model
    goal, length = listed.goal, listed.goal.model.length
    J = goal.model.jacobian(goal.q)
    free = np.linalg.svd(J)[2][np.linalg.matrix_rank(J, tol=1e-6) :]
    step = 1e-7 * free.T @ free @ rng.normal(size=goal.model.nv)
    beside = ClosedConfiguration.of(
        goal.model, close(goal.model, goal.model.integrate(goal.q, step), tolerance=1e-15)[0]
    )
    places = np.array([[*goal.pose(link)[:3, 3], 1.0] for link in goal.model.mechanism.links])
    moves = [beside.pose(link) @ invert_pose(goal.pose(link)) - np.eye(4) for link in goal.model.mechanism.links]
    far = max(float(np.linalg.norm((places @ D.T)[:, :3], axis=1).max()) for D in moves)
    error = max(far, *(length * float(np.linalg.norm(D[:3, :3], 2)) for D in moves))
    view = read_natural_view(beside, model.observations, model.reference, (), (), error)
    seen = [mode.configuration for mode in listed.modes if mode.configuration is not None]
    assert len(seen) > 1
    for at in seen:
        values = np.abs(evaluate_quadrics(view.matrices, value_at(view, beside, at))[0])
        assert np.all(values <= view.errors)
