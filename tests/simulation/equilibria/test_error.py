"""The error on closed loops in joint coordinates: against what is measured, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.test_sensors import KINDS, arm, free_body, watched
from hrsynth.analysis.observed import ObservedRobot, build_motor_model
from hrsynth.description import load
from hrsynth.equations.measured_error import CriticalPointEquations, ErrorSystem
from hrsynth.geometry.affine import make_affine
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.mechanism.observations.direction import SeenAxis
from hrsynth.mechanism.observations.image_circle import ImageCircle
from simulation.scenes import few_first, setting

ROBOTS = few_first(
    ["3prr_m1", "3rpr_m1", "3rps", "3upu", "6pus", "delta", "gough_stewart", "quattro", "quattro_rigid", "rrrrr_m1"]
)
STEP = 1e-6


@pytest.mark.some(2)
@pytest.mark.parametrize("encoders", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_error_gradient_and_hessian(name: str, encoders: bool) -> None:
    """E is ½ Σ sin² of the angles (of encoders ½ Σ of the squared differences), G vanishes at closed configurations,
    and gradient and Hessian of E + μ · G are those of central differences; forms enclose the floats."""
    check(setting(name), encoders)


@pytest.mark.some(2)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "robot",
    ["free_body", pytest.param("arm", marks=pytest.mark.slow), pytest.param("gough_stewart", marks=pytest.mark.slow)],
)
def test_error_of_every_kind(robot: str, kind: str) -> None:
    """The same of each kind, one seen from the base and one from the platform: E is ½ Σ ‖e‖² of the errors that the
    law feeds back."""
    if (robot, kind) != ("free_body", "encoder"):
        check(
            watched(
                {"free_body": free_body, "arm": arm}[robot]() if robot in ("free_body", "arm") else load(robot), kind
            ),
            wide=1e-9 if kind == "image_circle" else 1e-5,
        )


def check(found: ObservedRobot, encoders: bool = False, wide: float = 1e-4) -> None:
    """E, its derivatives and their enclosures over a box that is so wide; with cameras where E bends least, far from
    their focal planes; of circles in the image where they are least edge-on, as their moments have digits there."""
    rng = np.random.default_rng(3)
    observation_model = build_motor_model(found) if encoders else found.samples.observation_model
    goal = found.configurations[0]
    rest = ErrorSystem.of(goal, observation_model, found.configurations)
    size, count = rest.size

    def steep(at: ClosedConfiguration) -> float:
        bend = CriticalPointEquations(rest, list(rest.system.read(at.pose)[:, None])).bend(np.zeros((1, count)))
        return float(np.nan_to_num(np.abs(bend), nan=np.inf).max())

    def edge_on(at: ClosedConfiguration) -> float:
        sights = [
            o.sighting(at.pose(observation_model.reference), at.pose(o.link))
            for o in observation_model.observations
            if isinstance(o, ImageCircle)
        ]
        return max(1 - abs(float(each.ray @ each.d)) for each in sights) if sights else steep(at)

    at = found.configurations[1] if wide == 1e-4 else min(found.configurations[1:], key=edge_on)
    q = rest.system.read(at.pose)
    for link in found.mechanism.links:
        assert rest.system.pose(link, q) == pytest.approx(at.pose(link), abs=1e-10)
    mu = rng.normal(size=(1, count))

    def equations(x: np.ndarray) -> CriticalPointEquations:
        return CriticalPointEquations(rest, list(x[None].T))

    here = equations(q)
    wanted, seen = (
        measure(each.model, each.q, observation_model.reference, observation_model.observations)[2]
        for each in (goal, at)
    )
    errors = [
        (np.cross(u, w) if isinstance(o, SeenAxis) else o.error(u, w))
        for o, u, w in zip(observation_model.observations, seen, wanted, strict=True)
    ]
    assert here.E[0] == pytest.approx(0.5 * float(np.sum(np.concatenate(errors) ** 2)), abs=1e-10, rel=1e-10)
    assert np.abs(here.G).max(initial=0.0) < 1e-10
    steps = STEP * np.eye(size)
    ahead, behind = ([equations(q + sign * each) for each in steps] for sign in (1, -1))
    slope = [(a.E + a.G @ mu[0] - b.E - b.G @ mu[0])[0] / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
    bend = [(a.pull(mu) - b.pull(mu))[0] / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
    assert here.pull(mu)[0] == pytest.approx(np.array(slope), abs=1e-7 * max(1.0, np.abs(slope).max()))
    assert here.bend(mu)[0] == pytest.approx(np.array(bend), abs=1e-7 * max(1.0, np.abs(bend).max()))
    boxes = CriticalPointEquations(rest, [make_affine(np.array([x]), np.zeros((1, 0)), np.full(1, wide)) for x in q])
    held = make_affine(mu, np.zeros((1, count, 0)), np.zeros((1, count)))
    near = equations(q + wide * rng.uniform(-1, 1, size))
    for form, value in (
        (boxes.E, near.E),
        (boxes.pull(held), near.pull(mu)),
        (boxes.bend(held), near.bend(mu)),
        (boxes.gram(), near.gram()),
    ):
        assert np.all(np.abs(form.v[0] - value) <= form.spread)
        assert float(form.spread.max()) < 0.5 * max(1.0, float(np.abs(value).max()))


@pytest.mark.parametrize("name", ROBOTS)
def test_configurations_are_read_from_poses(name: str) -> None:
    """A twin's configuration is found again from the poses of its links."""
    found = setting(name)
    for at in found.configurations[:5]:
        again = at.model.read(at.pose)
        for link in found.mechanism.links:
            assert at.model.pose(again, link) == pytest.approx(at.pose(link), abs=1e-12)
