"""An independent path to the modes of a whole robot: close it from random starts with its measurements held.

No pose of the platform is given, no leg is taken apart, no curve is known: only loops and measured values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrsynth.analysis.modes.assembly_mode import AssemblyMode
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.analysis.observed import build_motor_model
from hrsynth.geometry.vectors import Array, invert_pose
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.tasks import solve
from hrsynth.kinematics.velocity_relation import ObservationModel
from hrsynth.mechanism import Mechanism, Observation

SAME = 1e-6
"""Distance (metres, pure numbers) at which two poses are one."""
SPREADS = (np.pi, 1.5, 0.7)
"""How far from the goal the starts are (rad, characteristic lengths)."""


@dataclass(frozen=True, eq=False)
class Held:
    """Measured values that are to stay as they are."""

    reference: str
    measured: Sequence[tuple[Observation, Array]]

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        _, _, values, rates = measure(model, q, self.reference, [o for o, _ in self.measured])
        errors = [value - wanted for value, (_, wanted) in zip(values, self.measured, strict=True)]
        return np.concatenate(errors), np.vstack(rates)


def asked(listed: AssemblyModes) -> ObservationModel:
    """What is held."""
    return build_motor_model(listed.setup) if listed.kind == "real" else listed.setup.samples.observation_model


def closings(listed: AssemblyModes, starts: int, seed: int = 0) -> list[ClosedConfiguration]:
    """Configurations with the goal's measured values, closed from random starts."""
    goal, observation_model = listed.goal, asked(listed)
    values = measure(goal.model, goal.q, observation_model.reference, observation_model.observations)[2]
    held = Held(observation_model.reference, tuple(zip(observation_model.observations, values, strict=True)))
    rng = np.random.default_rng(seed)
    found = []
    for number in range(starts):
        spread = SPREADS[number % len(SPREADS)]
        start = goal.model.integrate(goal.q, rng.uniform(-spread, spread, goal.model.nv))
        q, residual = solve(goal.model, start, held, tolerance=1e-13, iterations=40)
        if residual < 1e-11:
            found.append(ClosedConfiguration.of(goal.model, q))
    return found


def bodies_of(listed: AssemblyModes, at: ClosedConfiguration) -> dict[str, Array]:
    """The poses of the bodies on which legs end."""
    return {leg.platform_link: at.pose(leg.platform_link) for leg in listed.setup.decomposition.legs}


def other_branch(listed: AssemblyModes, at: ClosedConfiguration) -> bool:
    """Whether a body that otherwise only translates has turned: a parallelogram is crossed, or two U joints let the
    platform of a translating robot turn."""
    if listed.confined is None or listed.confined.motion not in ("translations", "bodies"):
        return False
    if listed.setup.decomposition.point is not None:
        return False
    now, goal = bodies_of(listed, at), bodies_of(listed, listed.goal)
    return any(float(np.abs(now[body][:3, :3] - goal[body][:3, :3]).max()) > SAME for body in goal)


def distance(listed: AssemblyModes, mode: AssemblyMode, at: ClosedConfiguration) -> float:
    """How far the platform's bodies are from their poses in a mode; for a platform that is a point, the point."""
    assert mode.bodies is not None
    point = listed.setup.decomposition.point
    if point is not None:
        platform = listed.setup.mechanism.platform
        X, Y = at.pose(platform), mode.bodies[platform]
        return float(np.abs((X - Y) @ np.append(point, 1.0)).max())
    return max(float(np.abs(X - mode.bodies[body]).max()) for body, X in bodies_of(listed, at).items())


@dataclass(frozen=True)
class Comparison:
    """How many closings there were, how many of them on another branch; the modes that were met; what is wrong."""

    closed: int
    elsewhere: int
    met: frozenset[int]
    missing: tuple[float, ...]
    """How far from every mode those closings are that are none."""
    closed_though_open: tuple[int, ...]
    """Modes that were met although a leg is said not to close there."""


def compared(listed: AssemblyModes, starts: int, seed: int = 0) -> Comparison:
    """The closings among the modes, and those that are not."""
    found = closings(listed, starts, seed)
    here = [at for at in found if not other_branch(listed, at)]
    met, missing = set[int](), list[float]()
    for at in here:
        apart = [distance(listed, mode, at) for mode in listed.modes]
        nearest = int(np.argmin(apart)) if apart else -1
        if nearest >= 0 and apart[nearest] < SAME:
            met.add(nearest)
        else:
            missing.append(min(apart, default=np.inf))
    return Comparison(
        len(found),
        len(found) - len(here),
        frozenset(met),
        tuple(missing),
        tuple(sorted(k for k in met if listed.modes[k].unclosed_legs)),
    )


def motor_places(mechanism: Mechanism, pose_of: dict[str, Array]) -> list[Array]:
    """The pose of each driven joint's successor in the frame of its predecessor: what an encoder feels."""
    return [
        invert_pose(pose_of[joint.predecessor]) @ pose_of[joint.successor]
        for joint in mechanism.joints.values()
        if joint.is_actuated
    ]
