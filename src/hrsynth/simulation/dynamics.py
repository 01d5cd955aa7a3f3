"""Dynamic simulation: the same controller drives a model of the robot in MuJoCo (MMT 5.1.1).

The directions are read from the simulated bodies, the motors' coordinates from their encoders. At each sample the
model of the robot takes the motors' coordinates, and the speeds that the law commands are held until the next.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.observed import ObservedRobot, build_motor_model
from ..description.simulator_models import load_mujoco
from ..errors import BadRequest, LoopClosureFailure
from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..kinematics.chart import TangentChart
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked_twists import set_zero
from ..kinematics.velocity_relation import compute_relation
from ..mechanism import Mechanism
from ..progress import report
from .law import Command, Measures, Poses
from .mujoco_model import MUJOCO_STEP_S, coordinates, mockup
from .run import OPEN, SERVED_AT, TIME, Loop, Run

DYNAMICS_SETTLED_ERROR_TOL = 1e-6
"""‖e‖ at which the dynamic simulation has settled."""
DYNAMICS_STEADY_CHANGE_FRACTION = 1e-3
"""Relative change of the error per time constant below which the dynamic simulation has settled."""

CONTROL_PERIOD_S = 0.01
"""Seconds between two commands."""


@dataclass(frozen=True, eq=False)
class DynamicSimulation:
    """MuJoCo model that starts at a configuration of a robot."""

    setup: ObservedRobot
    start: ClosedConfiguration

    @classmethod
    def of(cls, setup: ObservedRobot, start: ClosedConfiguration) -> DynamicSimulation:
        """Build the dynamic simulation; raises ``MissingExtra``, and ``BadRequest`` if the motors do not determine the
        robot's motion."""
        load_mujoco("the dynamic simulation")
        observation_model = build_motor_model(setup)
        if compute_relation(start, observation_model).unobserved_twists.shape[1]:
            raise BadRequest(
                f"{setup.robot.name}: its motors do not determine the platform's motion",
                str(setup.motion.pose(start.pose(setup.motion.link))),
                remedy="Omit --dynamics, or use a robot whose motors do.",
            )
        return cls(setup, start)

    @cached_property
    def mechanism(self) -> Mechanism:
        """Robot with the start as its zero configuration."""
        return set_zero(self.start)

    @cached_property
    def _model(self) -> Any:
        return load_mujoco("the dynamic simulation").MjModel.from_xml_string(mockup(self.mechanism))

    @cached_property
    def _names(self) -> list[str]:
        return [
            name for joint in self.mechanism.joints.values() if joint.is_actuated for name, _, _ in coordinates(joint)
        ]

    def run(self, loop: Loop, horizon: float) -> tuple[Run, Array]:
        """Run until the error is below ``DYNAMICS_SETTLED_ERROR_TOL`` or ``horizon`` (s); also the displacement of the
        platform since the start, as simulated, (4, 4)."""
        mujoco = load_mujoco("the dynamic simulation")
        model, data = self._model, mujoco.MjData(self._model)
        motors = [model.actuator(name).id for name in self._names]
        places = [int(model.joint(name).qposadr[0]) for name in self._names]
        mujoco.mj_kinematics(model, data)
        robot_model = self.start.model
        driven = robot_model.actuated_indices()
        scale = np.array(
            [
                robot_model.length if model.joint(name).type[0] == mujoco.mjtJoint.mjJNT_SLIDE else 1.0
                for name in self._names
            ]
        )
        at, time, stopped = self.start, 0.0, TIME
        times: list[float] = []
        states: list[tuple[ClosedConfiguration, Command]] = []
        while time < horizon:
            report(f"run of the MuJoCo model, {time:.1f} s of {horizon:.3g} s at most")
            at_now = read_encoders(self.start, at, driven, data.qpos[places] / scale)
            if at_now is None:
                stopped = OPEN
                break
            at = at_now
            command = self._command(loop, time, at, data)
            times.append(time)
            states.append((at, command))
            if loop.sensed is None and time >= loop.steady and self._is_settled(loop, [c for _, c in states]):
                stopped = SERVED_AT
                break
            data.ctrl[motors] = command.velocity[driven] * scale
            mujoco.mj_step(model, data, nstep=round(CONTROL_PERIOD_S / MUJOCO_STEP_S))
            mujoco.mj_kinematics(model, data)
            time += CONTROL_PERIOD_S
        run = Run(np.array(times), tuple(c for c, _ in states), tuple(c for _, c in states), stopped)
        return run, displacement(data, self.setup.motion.link)

    def _is_settled(self, loop: Loop, commands: list[Command]) -> bool:
        """Return True if the error vanishes, or has been constant for a time constant 1 / λ."""
        now, back = commands[-1].size, round(1 / (loop.law.gain * CONTROL_PERIOD_S))
        if now < DYNAMICS_SETTLED_ERROR_TOL:
            return True
        return len(commands) > back and abs(now - commands[-1 - back].size) < DYNAMICS_STEADY_CHANGE_FRACTION * now

    def _command(self, loop: Loop, time: float, at: ClosedConfiguration, data: Any) -> Command:
        """Return the command of the law for the directions of the simulated bodies."""
        observation_model, start = loop.law.observation_model, self.start
        reference = observation_model.reference

        def pose(link: str) -> Array:
            moved = np.eye(4) if link == self.mechanism.base else displacement(data, link)
            return moved @ start.pose(link)

        seen = np.array([each.value(pose(reference), pose(each.link)) for each in observation_model.observations])

        def sensed(time: float, poses: Poses, values: Measures) -> Measures:
            return seen if loop.sensed is None else loop.sensed(time, pose, seen)

        command = loop.law.at(at, loop.desired(time), sensed, time)
        wanted = loop.desired(time)[0]
        true = tuple(o.error(s, w) for o, s, w in zip(observation_model.observations, seen, wanted, strict=True))
        return replace(command, error=true, true=tuple(seen))


def read_encoders(
    start: ClosedConfiguration, at: ClosedConfiguration, places: list[int], moved: Array
) -> ClosedConfiguration | None:
    """Return the configuration next to ``at`` with these motor displacements since the start; None if there is none.
    Displacements that coupled motors cannot have are projected out."""
    free, _ = compute_range_basis(at.kernel()[0][places], 1.0)
    chart = TangentChart(start, np.eye(at.model.nv)[:, places] @ free)
    try:
        return chart.at(free.T @ moved, at.q, iterations=30)
    except LoopClosureFailure:
        return None


def displacement(data: Any, link: str) -> Array:
    """Return the displacement (4, 4) of a simulated body since the start."""
    body = data.body(link)
    X = np.eye(4)
    X[:3, :3] = body.xmat.reshape(3, 3)
    X[:3, 3] = body.xpos
    return X
