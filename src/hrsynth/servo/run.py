"""A servo loop in time, on closed configurations: SciPy's adaptive integrator in charts of the closed loops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import LoopsNotClosed
from ..kinematics.chart import WIDE, Chart
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.relation import Question
from ..mechanism import JointType, Mechanism
from ..mechanism.vectors import Array
from ..tolerances import AT_REST, SERVED
from .law import Command, Desired, Law, Sense
from .noise import PERIOD

SERVED_AT, REST, LIMIT, OPEN, AWAY, TIME, EFFORT = "served", "rest", "limit", "open", "away", "time", "effort"
TOLERANCE = 1e-6
"""Relative tolerance of the integrator, for coordinates of a chart as for errors at the start of a stretch."""
CLOSER = 1e-2
"""Part of its first error at which a stretch ends, so that the tolerance follows the error."""
FAR = 20.0
"""Characteristic lengths from its start at which a platform has run away."""
MOST = 20_000
"""Configurations that the integrator may ask for in a run."""
HALVINGS = 40
"""Bisections that find the moment at which a joint meets its limit."""


@dataclass(frozen=True, eq=False)
class Run:
    """What happened: times (n,), the configurations and commands at them, and why it stopped: the error vanished
    (``served``), the command did (``rest``), a joint met its limit (``limit``), the loops could not be closed further
    (``open``), the platform ran away (``away``), the time was over (``time``), or the integrator's ``MOST``
    configurations were (``effort``)."""

    times: Array
    configurations: tuple[ClosedConfiguration, ...]
    commands: tuple[Command, ...]
    stopped: str

    @property
    def last(self) -> ClosedConfiguration:
        """Where it ended."""
        return self.configurations[-1]


@dataclass(frozen=True, eq=False)
class Loop:
    """The closed loop of a law and a robot: desired directions, steady from ``steady`` (s) on; what is sensed (None:
    the true directions) and whether that changes smoothly with the pose (``smooth``); ``moving`` is the question whose
    motions are all that counts."""

    law: Law
    moving: Question
    desired: Desired
    steady: float = 0.0
    sensed: Sense | None = None
    smooth: bool = True

    def simulate(self, start: ClosedConfiguration, horizon: float) -> Run:
        """Run until it ends by itself, or ``horizon`` (s)."""
        times, found = [0.0], [(start, self._command(0.0, start))]
        stopped, left = None, MOST
        while stopped is None:
            stretch = _Stretch(self, Chart.around(found[-1][0], self.moving), found[-1][0], left)
            reached, states, stopped = stretch.integrate(times[-1], horizon)
            left = stretch.left
            times += reached
            found += states
            if stopped is None and self._shift(start, found[-1][0]) > FAR:
                stopped = AWAY
        return Run(np.array(times), tuple(c for c, _ in found), tuple(c for _, c in found), stopped)

    def _shift(self, start: ClosedConfiguration, at: ClosedConfiguration) -> float:
        """How far the platform has moved (characteristic lengths)."""
        link = self.law.question.platform
        return float(np.linalg.norm(at.pose(link)[:3, 3] - start.pose(link)[:3, 3])) / at.twin.length

    def _command(self, time: float, at: ClosedConfiguration) -> Command:
        return self.law.at(at, self.desired(time), self.sensed, time)


class _Stretch:
    """One stretch of a run, in one chart; configurations are remembered while the integrator works around them."""

    def __init__(self, loop: Loop, chart: Chart, start: ClosedConfiguration, left: int) -> None:
        self.loop, self.chart, self.near, self.left = loop, chart, start.q, left
        self.margin = clearance(start)
        self._memory: dict[tuple[float, bytes], tuple[ClosedConfiguration, Command]] = {}

    def state(self, time: float, y: Array) -> tuple[ClosedConfiguration, Command]:
        """Configuration and command at coordinates y."""
        key = (time, y.tobytes())
        if key not in self._memory:
            at = self.chart.at(y, self.near)
            self.near, self.left = at.q, self.left - 1
            self._memory[key] = at, self.loop._command(time, at)
        return self._memory[key]

    def rate(self, time: float, y: Array) -> Array:
        """ẏ."""
        at, command = self.state(time, y)
        return self.chart.slope(at.q) @ command.velocity

    def integrate(self, start: float, horizon: float
                  ) -> tuple[list[float], list[tuple[ClosedConfiguration, Command]], str | None]:
        """Times and states after ``start``, and why the run stopped (None: only the stretch is at its end)."""
        from scipy.integrate import LSODA, RK23

        loop = self.loop
        first = self.state(start, np.zeros(self.chart.basis.shape[1]))
        settling = loop.sensed is None and start >= loop.steady
        scale = min(1.0, first[1].size) if settling else 1.0
        if settling and (stopped := self._over(first[1])):
            return [], [], stopped
        until = horizon if start >= loop.steady else min(horizon, loop.steady)
        tolerances = {"rtol": TOLERANCE, "atol": TOLERANCE * scale}
        times: list[float] = []
        states: list[tuple[ClosedConfiguration, Command]] = []
        try:
            y = np.zeros(self.chart.basis.shape[1])
            solver = (LSODA(self.rate, start, y, until, **tolerances) if loop.smooth
                      else RK23(self.rate, start, y, until, max_step=PERIOD, **tolerances))
            while solver.status == "running":
                solver.step()
                if solver.status == "failed":
                    return times, states, OPEN
                time, state = float(solver.t), self.state(float(solver.t), solver.y)
                if clearance(state[0]) < min(0.0, self.margin):
                    time, state = self._at_limit(solver)
                times.append(time)
                states.append(state)
                if time < solver.t:
                    return times, states, LIMIT
                if settling and (stopped := self._over(state[1])):
                    return times, states, stopped
                if self.left <= 0:
                    return times, states, EFFORT
                if np.linalg.norm(solver.y) > WIDE or (settling and state[1].size < CLOSER * scale):
                    return times, states, None
        except LoopsNotClosed:
            return times, states, OPEN
        return times, states, TIME if until == horizon else None

    def _over(self, command: Command) -> str | None:
        """Why a run with steady, exact directions ends here, if it does."""
        if command.size <= SERVED:
            return SERVED_AT
        return REST if command.speed <= AT_REST * self.loop.law.gain * command.size else None

    def _at_limit(self, solver: Any) -> tuple[float, tuple[ClosedConfiguration, Command]]:
        """Time and state in the solver's last step at which a joint meets its limit."""
        inside, outside, curve = float(solver.t_old), float(solver.t), solver.dense_output()
        for _ in range(HALVINGS):
            middle = (inside + outside) / 2
            met = clearance(self.state(middle, curve(middle))[0]) < 0
            inside, outside = (inside, middle) if met else (middle, outside)
        return inside, self.state(inside, curve(inside))


def limited(mechanism: Mechanism) -> list[tuple[str, float, float]]:
    """The joints about or along one axis that have limits: name, lower and upper (m, rad)."""
    found = []
    for joint in mechanism.joints.values():
        if joint.limits is None or joint.type not in (JointType.REVOLUTE, JointType.PRISMATIC):
            continue
        lower, upper = joint.limits.lower, joint.limits.upper
        if lower is not None or upper is not None:
            found.append((joint.name, -np.inf if lower is None else lower, np.inf if upper is None else upper))
    return found


def margins(at: ClosedConfiguration) -> dict[str, float]:
    """How far each joint that has limits is from the nearer one (m, rad); negative beyond it."""
    twin = at.twin
    moved = twin.difference(twin.q0, at.q)
    found = {}
    for name, lower, upper in limited(twin.mechanism):
        slides = twin.mechanism.joints[name].type is JointType.PRISMATIC
        value = float(moved[twin.coordinates[name][0]]) * (twin.length if slides else 1.0)
        found[name] = min(value - lower, upper - value)
    return found


def clearance(at: ClosedConfiguration) -> float:
    """The smallest of :func:`margins`, infinite where no joint has limits."""
    return min(margins(at).values(), default=np.inf)
