"""The error on closed loops in joint coordinates: against what is measured, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.observed import motors
from hrsynth.geometry.affine import affine
from hrsynth.kinematics.configuration import measure
from hrsynth.simulation.endings.error import RestEquations, RestSystem
from simulation.scenes import few_first, setting

ROBOTS = few_first(["3prr_m1", "3rpr_m1", "3rps", "3upu", "6pus", "delta", "gough_stewart", "quattro",
                    "quattro_rigid", "rrrrr_m1"])
STEP = 1e-6


@pytest.mark.parametrize("encoders", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_error_gradient_and_hessian(name: str, encoders: bool) -> None:
    """E is ½ Σ sin² of the angles (of encoders ½ Σ of the squared differences), G vanishes at closed configurations,
    and gradient and Hessian of E + μ · G are those of central differences; forms enclose the floats."""
    found, rng = setting(name), np.random.default_rng(3)
    question = motors(found) if encoders else found.samples.question
    goal, at = found.configurations[0], found.configurations[1]
    rest = RestSystem.of(goal, question, found.configurations)
    q, (size, count) = rest.system.read(at.pose), rest.size
    for link in found.mechanism.links:
        assert rest.system.pose(link, q) == pytest.approx(at.pose(link), abs=1e-10)
    mu = rng.normal(size=(1, count))

    def equations(x: np.ndarray) -> RestEquations:
        return RestEquations(rest, list(x[None].T))

    here = equations(q)
    wanted, seen = (measure(each.twin, each.q, question.reference, question.observations)[2] for each in (goal, at))
    errors = [(o.apart(u, w) if encoders else np.cross(u, w)) for o, u, w in zip(question.observations, seen, wanted,
                                                                              strict=True)]
    assert here.E[0] == pytest.approx(0.5 * float(np.sum(np.concatenate(errors) ** 2)), abs=1e-10)
    assert np.abs(here.G).max(initial=0.0) < 1e-10
    steps = STEP * np.eye(size)
    ahead, behind = ([equations(q + sign * each) for each in steps] for sign in (1, -1))
    slope = [(a.E + a.G @ mu[0] - b.E - b.G @ mu[0])[0] / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
    bend = [(a.pull(mu) - b.pull(mu))[0] / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
    assert here.pull(mu)[0] == pytest.approx(np.array(slope), abs=1e-7)
    assert here.bend(mu)[0] == pytest.approx(np.array(bend), abs=1e-7)
    boxes = RestEquations(rest, [affine(np.array([x]), np.zeros((1, 0)), np.full(1, 1e-4)) for x in q])
    held = affine(mu, np.zeros((1, count, 0)), np.zeros((1, count)))
    near = equations(q + 1e-4 * rng.uniform(-1, 1, size))
    for form, value in ((boxes.E, near.E), (boxes.pull(held), near.pull(mu)), (boxes.bend(held), near.bend(mu))):
        assert np.all(np.abs(form.v[0] - value) <= form.spread)
        assert float(form.spread.max()) < 0.5


@pytest.mark.parametrize("name", ROBOTS)
def test_configurations_are_read_from_poses(name: str) -> None:
    """A twin's configuration is found again from the poses of its links."""
    found = setting(name)
    for at in found.configurations[:5]:
        again = at.twin.read(at.pose)
        for link in found.mechanism.links:
            assert at.twin.pose(again, link) == pytest.approx(at.pose(link), abs=1e-12)
