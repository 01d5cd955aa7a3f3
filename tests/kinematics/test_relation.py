"""Motions of the platform alone, and samples read again for other measurements."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.geometry.ranks import compute_kernel_basis, compute_largest_angle
from hrsynth.kinematics.velocity_relation import compute_platform_motions, compute_relation
from kinematics.robots import ROBOTS, setting_of


@pytest.mark.some(17)
@pytest.mark.parametrize("robot", ROBOTS)
def test_platform_motions_span_the_twists_and_nothing_idle(robot: str) -> None:
    """J q̇ = 0 and t orthonormal over all feasible twists; q̇ is normal to every q̇ with t = 0."""
    observation_model = setting_of(robot).all_samples.observation_model
    for at in setting_of(robot).configurations:
        motions = compute_platform_motions(at, observation_model)
        twists = observation_model.rows(at)[: observation_model.twist_rows]
        t = twists @ motions
        assert np.linalg.norm(at.model.jacobian(at.q) @ motions) < 1e-9
        np.testing.assert_allclose(t.T @ t, np.eye(motions.shape[1]), atol=1e-9)
        assert compute_largest_angle(t, compute_relation(at, observation_model).twists) < 1e-9
        kernel, _ = at.kernel()
        idle = kernel @ compute_kernel_basis(twists @ kernel, 1.0)[0]
        assert np.linalg.norm(idle.T @ motions) < 1e-9


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_platform_generically_does_what_it_does_at_the_samples(robot: str) -> None:
    setup = setting_of(robot)
    motion = setup.motion
    assert motion.dof == setup.dof
    for at in setup.configurations:
        twists = compute_relation(at, setup.all_samples.observation_model).twists
        found = motion.twists[: len(twists)]
        assert np.linalg.norm(twists - found @ (found.T @ twists)) < 1e-9


@pytest.mark.some(17)
@pytest.mark.parametrize("robot", ROBOTS)
def test_measured_again_the_samples_say_the_same(robot: str) -> None:
    """ρ of fewer observations, computed anew, is the projection of ρ of all."""
    setup = setting_of(robot, ("1",) if "1" in setting_of(robot).labels else None)
    again = setup.all_samples.measure(setup.observed)
    for old, new in zip(setup.samples.members, again.members, strict=True):
        assert compute_largest_angle(old.relation.basis, new.relation.basis) < 1e-9
        assert (old.relation.rank, old.relation.sizes) == (new.relation.rank, new.relation.sizes)
