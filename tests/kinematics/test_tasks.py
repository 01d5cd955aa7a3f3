"""Configurations solved in step are those that each gives alone."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.pose_requests import observe
from hrsynth.errors import UndefinedValue
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.path_tracking import track_paths
from hrsynth.kinematics.tasks import solve
from hrsynth.solving.gauss_newton import DampingFactor, Residual, descend, descend_together
from hrsynth.tolerances import CLOSURE_SOLVER_TOL, WAYPOINT_RESIDUAL_TOL
from kinematics.robots import setting_of


@pytest.mark.parametrize(
    ("robot", "sensor"),
    [("quattro", ()), ("orthoglide", ()), ("3rrr_m1", ()), ("gough_stewart", ("c=point:platform@0,0,0",))],
)
def test_together_every_way_ends_where_it_ends_alone(robot: str, sensor: tuple[str, ...]) -> None:
    """To the last digit, on the ways of samples; the loop here is the one that solves for a single configuration."""
    setup = observe(robot, camera="c=base@0,0,2/180deg,0,0", sensor=sensor, samples=3) if sensor else setting_of(robot)
    model = setup.all_samples.model
    ways = [member.way for member in setup.samples.members]
    home = setup.samples.observation_model.target(setup.all_samples.start)
    ways += [(home, *way[1:]) for way in ways]  # which are at the same place still where the second target begins
    for way, led in zip(ways, track_paths(model, ways), strict=True):
        assert not isinstance(led, UndefinedValue)
        q, residual = model.q0, 0.0
        for target in way:
            q, residual = solve(
                model,
                q,
                target,
                tolerance=CLOSURE_SOLVER_TOL if target is way[-1] else WAYPOINT_RESIDUAL_TOL,
                iterations=120,
            )
        np.testing.assert_array_equal(led[0], q)
        assert led[1] == residual <= CLOSURE_SOLVER_TOL


def test_one_that_diverges_leaves_the_others_as_they_are() -> None:
    """x² = a from several starts; of a < 0 there is no root."""
    wanted = {0: 4.0, 1: -1.0, 2: 9.0}
    damping = DampingFactor(start=1e-3, eased=0.1, least=1e-9, most=1e6)

    def system(x: Array, a: float) -> tuple[Array, Array]:
        return x * x - a, np.array([2 * x])

    def step(x: Array, at: Residual, factor: float) -> Array:
        return np.asarray(x - at.J[0] * at.error / (at.J[0] ** 2 + factor))

    def content(at: Residual) -> bool:
        return at.size < 1e-12

    starts = [np.array([3.0]), np.array([0.5]), np.array([1.0])]
    together = list(
        descend_together(
            starts,
            lambda places: [system(x, wanted[i]) for i, x in places.items()],
            lambda going: {i: step(*at) for i, at in going.items()},
            damping,
            40,
            content,
        )
    )
    for i, (start, found) in enumerate(zip(starts, together, strict=True)):
        alone = descend(start, lambda x, a=wanted[i]: system(x, a), step, damping, 40, content)
        assert (found[0], found[1].size) == (alone[0], alone[1].size)
    np.testing.assert_allclose([together[0][0][0], together[2][0][0]], [2.0, 3.0], atol=1e-12)
    assert together[1][1].size >= 1.0
