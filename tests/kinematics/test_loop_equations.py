"""The loops' equations on components: zero at zero, their derivatives, and no loop open where those chosen are met."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth import load, shipped
from hrsynth.errors import NoMotorMap
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.motor_equations import MotorEquations
from hrsynth.mechanism import Mechanism
from strategies import planar, random_rotation, transformed

DEPENDENT = {"quattro_rigid", "prrrp_parallel_point"}
NAMES = sorted(set(shipped()) - DEPENDENT)


def tilted(seed: int) -> Mechanism:
    """A planar 3-RRR of random dimensions, motors at its base, in a tilted base."""
    rng = np.random.default_rng(seed)
    return transformed(planar(["RRR"] * 3, rng, [{0}] * 3), random_rotation(rng), rng.normal(size=3))


def cases() -> list[Mechanism]:
    return [*map(load, NAMES), *map(tilted, range(3))]


def solved(found: MotorEquations, q: Array) -> Array:
    """Passive coordinates by Newton's method from zero, in small steps of the motors."""
    x = np.zeros(len(found.passive))
    for step in np.linspace(0, 1, 6)[1:]:
        for _ in range(6):
            G, J, _ = found.evaluate(step * q, x)
            x = x - np.linalg.solve(J, G)
    assert np.abs(found.evaluate(q, x)[0]).max(initial=0.0) < 1e-13
    return x


@pytest.mark.parametrize("robot", cases(), ids=lambda robot: robot.name)
def test_equations_of_loops(robot: Mechanism) -> None:
    found = MotorEquations.of(robot)
    rng = np.random.default_rng(0)
    q, x = 0.3 * rng.normal(size=len(found.motors)), 0.3 * rng.normal(size=len(found.passive))
    # closed at zero, to what the file's digits give
    assert np.abs(found.evaluate(0 * q, 0 * x)[0]).max(initial=0.0) < 1e-12
    # the derivatives are those of the equations, at configurations that are not closed as well
    _, J_x, J_q = found.evaluate(q, x)
    h = 1e-6
    for J, steps in ((J_x, [(0 * q, h * e) for e in np.eye(len(x))]), (J_q, [(h * e, 0 * x) for e in np.eye(len(q))])):
        central = [(found.evaluate(q + a, x + b)[0] - found.evaluate(q - a, x - b)[0]) / (2 * h) for a, b in steps]
        assert np.abs(J - np.array(central).T).max(initial=0.0) < 1e-8
    # where the chosen equations are met, all are
    q = 0.05 * q * robot.length
    values = found.values(q, solved(found, q))
    assert max(abs(value) for value, _ in found.equations.rows(values)) < 1e-12


@pytest.mark.parametrize("name", sorted(DEPENDENT))
def test_motors_that_do_not_determine_the_platform(name: str) -> None:
    with pytest.raises(NoMotorMap):
        MotorEquations.of(load(name))
