"""What the tests of the engine share: settings and derivations, each made once, and the bridge to the oracle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from hrsynth.analysis.derive import Derivation, derive
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.tasks import PoseAndValuesTask, solve
from hrsynth.kinematics.velocity_relation import ObservationModel
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observation import Observation
from oracle import Oracle, span

ROBOTS = tuple(list_robots())


@cache
def setting_of(
    robot: str, observe: tuple[str, ...] | None = None, camera: str | None = None, samples: int = 2
) -> ObservedRobot:
    """The setting of a shipped robot with a few samples."""
    return ObservedRobot.of(load(robot), observe, camera, samples=samples)


@cache
def derived(
    robot: str, observe: tuple[str, ...] | None = None, camera: str | None = None, form: str = "simplified"
) -> Derivation:
    """The derivation of a shipped robot."""
    return derive(load(robot), observe, camera, form=form)


def state_of(model: PinocchioModel, q: Array) -> Array:
    """The oracle's state for a configuration of the twin: the poses of all links."""
    return np.array([model.pose(q, name) for name in model.mechanism.links])


def walked(model: PinocchioModel, seed: int = 0, steps: int = 4, size: float = 0.15) -> ClosedConfiguration:
    """A closed configuration some random steps away from zero."""
    rng = np.random.default_rng(seed)
    at = ClosedConfiguration.of(model, model.q0)
    for _ in range(steps):
        kernel, _ = at.kernel()
        q, _ = solve(model, model.integrate(at.q, size * kernel @ rng.normal(size=kernel.shape[1])), tolerance=1e-13)
        at = ClosedConfiguration.of(model, q)
    return at


def seen_by_oracle(oracle: Oracle, state: Array, observation_model: ObservationModel, length: float) -> Array:
    """The relation by the oracle, with zero rows for observed links that are not in its mechanism."""
    present = [o for o in observation_model.observations if o.link in oracle.mechanism.links]
    basis = oracle.relation(state, present, unit_length=length, point_only=observation_model.point is not None)
    blocks = [basis[: observation_model.twist_rows]]
    row = observation_model.twist_rows
    for each in observation_model.observations:
        if each in present:
            blocks.append(basis[row : row + 3])
            row += 3
        else:
            blocks.append(np.zeros((3, basis.shape[1])))
    return span(np.vstack(blocks)) if basis.shape[1] else np.vstack(blocks)


def led(
    mechanism: Mechanism, observation_model: ObservationModel, way: Sequence[PoseAndValuesTask]
) -> tuple[Oracle, Array]:
    """The oracle of a mechanism, led from zero along the poses and directions of a way, and the state it reaches.

    Raises ``oracle.NotAssembled`` where it cannot follow.
    """
    oracle = Oracle(mechanism)
    state = oracle.zero()
    for target in way:
        pairs: list[tuple[Observation, Array]] = [p for p in target.measured if p[0].link in mechanism.links]
        aim = target.pose
        if target.point is not None:
            assert np.linalg.norm(target.point) < 1e-12, "the platform frame lies at the point"
            aim = target.pose[:3, 3]
        state = oracle.assemble(aim, [u for _, u in pairs], state, [o for o, _ in pairs])
    return oracle, state
