"""Servo loop in time, on closed configurations: SciPy's adaptive integrator in charts of the closed loops.

A small command does not prove that a loop with constant, exact directions is at an equilibrium: near a fold of a leg,
where the law is stiff, an integrator's own errors keep the command from vanishing. So a stable equilibrium, a zero of
the velocity, is computed from the state, independent of the time limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import LoopClosureFailure, UndefinedValue
from ..geometry.vectors import Array
from ..kinematics.chart import TangentChart
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.limits import CoordinateIntervals
from ..kinematics.velocity_relation import ObservationModel
from ..progress import report
from ..results import Value
from ..tolerances import PSEUDOINVERSE_CUTOFF_FRACTION, VISIBLE_SINE_MIN
from .law import Command, Desired, Law, Sense
from .noise import NOISE_PERIOD_S

LOOP_RANK_LOSS_FRACTION = 1e-3
"""Fraction of its initial value at which the loops' smallest singular value stops a servo run."""
SERVO_CONVERGED_TOL = 1e-10
"""Norm of the error at which a servo run has reached its goal."""
EQUILIBRIUM_SPEED_TOL = 1e-8
"""Speed (characteristic lengths, radians) per error and gain below which a servo loop is at an equilibrium."""
EQUILIBRIUM_NEWTON_STEP_TOL = 1e-10
"""Newton step (characteristic lengths, radians) at which an equilibrium is found."""
EQUILIBRIUM_DISTANCE_TOL = 1e-6
"""Distance (characteristic lengths, radians) from a stable equilibrium at which a servo run has reached it."""
EQUILIBRIUM_SLOPE_STEP_MAX = 1e-4
"""Step of the differences of ẏ at an equilibrium: less than the width over which the law is damped."""
EQUILIBRIUM_NEWTON_STEP_MAX = 0.1
"""Longest Newton step (characteristic lengths, radians) to an equilibrium."""
NEUTRAL_GROWTH_RATE_TOL = 1e-6
"""Growth (per time constant) up to which a motion at an equilibrium is neutral; largest speed of no drift."""
RUN_INTEGRATOR_TOL = 1e-6
"""Relative tolerance of the integrator of a servo run."""
RUN_STRETCH_ERROR_FRACTION = 1e-2
"""Fraction of its initial error at which a segment of a servo run ends, so that the tolerance follows the error."""
RUN_STEP_MIN = 1e-9
"""Shortest step (time constants) that a blocked servo run tries."""
TANGENT_CHART_RADIUS_MAX = 0.5
"""Length of tangent chart coordinates (characteristic lengths, radians) that starts a new chart."""
RUN_ESCAPE_DISTANCE_MAX = 20.0
"""Distance (characteristic lengths) from its start at which a platform has diverged."""
RUN_EVALUATIONS_MAX = 20_000
"""Largest number of configurations evaluated by the integrator in a servo run."""

State = tuple[ClosedConfiguration, Command]

SERVED_AT, REST, POISED, LIMIT, UNSEEN, OPEN = "served", "rest", "poised", "limit", "unseen", "open"
UNMEASURED = "unmeasured"
AWAY, TIME, EFFORT, LOST = "away", "time", "effort", "lost"
EVENT_BISECTIONS_COUNT = 40
"""Bisections to the time at which a joint reaches its limit, or an observation leaves the field of view."""
EQUILIBRIUM_NEWTON_STEPS_COUNT = 8
"""Newton steps to an equilibrium."""
PERSISTENT_ERROR_FRACTION = 0.9
"""Fraction of an error left a time constant later above which an equilibrium is sought; 1 / e if it vanishes."""


@dataclass(frozen=True, eq=False, repr=False)
class Run(Value):
    """Simulated run: times (n,), the configurations and commands at them, and the reason of its end: the error vanished
    (``served``), a stable equilibrium was reached (``rest``), the command vanished where none was found (``poised``), a
    joint reached its limit (``limit``), an observation left its camera's field of view (``unseen``), the loops' rank
    falls (``open``), the platform ran away (``away``), the time ran out (``time``), the integrator used its
    ``RUN_EVALUATIONS_MAX`` configurations (``effort``), or it could not continue (``lost``)."""

    times: Array
    configurations: tuple[ClosedConfiguration, ...]
    commands: tuple[Command, ...]
    stopped: str
    joint: str | None = None
    """The joint that met its limit."""
    ahead: tuple[ClosedConfiguration, float] | None = None
    """Stable equilibrium that the run approached when its time ended, and the time constant (s) of the slowest motion
    there."""

    @property
    def last(self) -> ClosedConfiguration:
        """Final configuration."""
        return self.configurations[-1]


@dataclass(frozen=True, eq=False, repr=False)
class Loop(Value):
    """Closed loop of a law and a robot: desired directions, constant from ``steady`` (s) on; the sensor (None: the true
    directions) and whether its error changes smoothly with the pose (``smooth``); ``moving`` is the observation model
    of all motions that count."""

    law: Law
    moving: ObservationModel
    desired: Desired
    steady: float = 0.0
    sensed: Sense | None = None
    smooth: bool = True

    def simulate(self, start: ClosedConfiguration, horizon: float) -> Run:
        """Run until it ends by itself, or ``horizon`` (s)."""
        times, found = [0.0], [(start, self._command(0.0, start))]
        stopped, left, longest = None, RUN_EVALUATIONS_MAX, np.inf
        patience, stops = (
            Patience(1 / self.law.gain, 0.0, found[0][1].size),
            CoordinateIntervals.of(start.model, start.q),
        )
        joint = None
        while stopped is None:
            stretch = _Stretch(
                self, TangentChart.around(found[-1][0], self.moving), found[-1][0], left, patience, stops
            )
            reached, states, stopped = stretch.integrate(times[-1], horizon, longest)
            left, joint = stretch.left, stretch.beyond
            times += reached
            found += states
            if stopped in (LOST, UNMEASURED) and longest * self.law.gain > RUN_STEP_MIN:
                # the step was too long for the loops to follow, or for the chart: another chart, shorter steps
                longest, stopped = min(longest, 1 / self.law.gain) / 8, None
            elif stopped == LOST and _is_loop_rank_lost(found[-1][0], start):
                stopped = OPEN
            elif stopped is None:
                longest *= 2
                if self._shift(start, found[-1][0]) > RUN_ESCAPE_DISTANCE_MAX:
                    stopped = AWAY
        ahead = self._ahead(times[-1], found[-1][0]) if stopped in (TIME, EFFORT) and self.sensed is None else None
        return Run(np.array(times), tuple(c for c, _ in found), tuple(c for _, c in found), stopped, joint, ahead)

    def _ahead(self, time: float, at: ClosedConfiguration) -> tuple[ClosedConfiguration, float] | None:
        """Return the stable equilibrium towards which the robot moves, if Newton's method finds one near, with its time
        constant."""
        if time < self.steady:
            return None
        chart = TangentChart.around(at, self.moving)

        def rate(y: Array) -> Array:
            there = chart.at(y, at.q)
            return chart.slope(there.q) @ self._command(time, there).velocity

        home = np.zeros(chart.basis.shape[1])
        try:
            found = rest_near(rate, home)
            if found is None or found.growth >= -NEUTRAL_GROWTH_RATE_TOL * self.law.gain or rate(home) @ found.y <= 0:
                return None
            return chart.at(found.y, at.q), -1 / found.growth
        except (LoopClosureFailure, UndefinedValue):
            return None

    def _shift(self, start: ClosedConfiguration, at: ClosedConfiguration) -> float:
        """Return the displacement of the platform (characteristic lengths)."""
        link = self.law.observation_model.platform
        return float(np.linalg.norm(at.pose(link)[:3, 3] - start.pose(link)[:3, 3])) / at.model.length

    def _command(self, time: float, at: ClosedConfiguration) -> Command:
        return self.law.at(at, self.desired(time), self.sensed, time)


class _Stretch:
    """One stretch of a run, in one chart; configurations are remembered while the integrator works around them."""

    def __init__(
        self,
        loop: Loop,
        chart: TangentChart,
        start: ClosedConfiguration,
        left: int,
        patience: Patience,
        stops: CoordinateIntervals,
    ) -> None:
        self.loop, self.chart, self.near, self.left, self.patience = loop, chart, start.q, left, patience
        self.stops = stops
        self.least = {name: min(0.0, margin) for name, margin in stops.margins(start.model, start.q).items()}
        """The least margin of each joint: of one that is beyond its limit, how far it is."""
        self.beyond: str | None = None
        self._memory: dict[tuple[float, bytes], State] = {}

    def state(self, time: float, y: Array) -> State:
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

    def integrate(self, start: float, horizon: float, longest: float) -> tuple[list[float], list[State], str | None]:
        """Times and states after ``start``, in steps of up to ``longest`` (s), and why the run stopped (None: only the
        stretch is at its end)."""
        from scipy.integrate import LSODA, RK23

        loop = self.loop
        first = self.state(start, np.zeros(self.chart.basis.shape[1]))
        settling = loop.sensed is None and start >= loop.steady
        scale = min(1.0, first[1].size) if settling else 1.0
        if settling and (end := self._end(start, np.zeros(self.chart.basis.shape[1]), first)):
            return ([], [], end[0]) if end[1] is first else ([start], [end[1]], end[0])
        until = horizon if start >= loop.steady else min(horizon, loop.steady)
        tolerances = {"rtol": RUN_INTEGRATOR_TOL, "atol": RUN_INTEGRATOR_TOL * scale}
        times: list[float] = []
        states: list[State] = []
        try:
            y = np.zeros(self.chart.basis.shape[1])
            solver = (
                LSODA(self.rate, start, y, until, max_step=longest, **tolerances)
                if loop.smooth
                else RK23(self.rate, start, y, until, max_step=min(NOISE_PERIOD_S, longest), **tolerances)
            )
            while solver.status == "running":
                report("run")
                solver.step()
                if solver.status == "failed":
                    return times, states, LOST
                time, state = float(solver.t), self.state(float(solver.t), solver.y)
                met = self._stop_reason(state[0])
                if met:
                    time, state = self._at_limit(solver)
                times.append(time)
                states.append(state)
                if met:
                    return times, states, met
                if settling and (end := self._end(time, solver.y, state)):
                    states[-1] = end[1]
                    return times, states, end[0]
                if self.left <= 0:
                    return times, states, EFFORT
                if np.linalg.norm(solver.y) > TANGENT_CHART_RADIUS_MAX or (
                    settling and state[1].size < RUN_STRETCH_ERROR_FRACTION * scale
                ):
                    return times, states, None
        except LoopClosureFailure:
            return times, states, LOST
        except UndefinedValue:
            return times, states, UNMEASURED
        return times, states, TIME if until == horizon else None

    def _end(self, time: float, y: Array, state: State) -> tuple[str, State] | None:
        """Return the reason for which a run with constant, exact directions ends at y (n,), if it does, and its final
        state."""
        command = state[1]
        if command.size <= SERVO_CONVERGED_TOL:
            return SERVED_AT, state
        poised = command.speed <= EQUILIBRIUM_SPEED_TOL * self.loop.law.gain * command.size
        if (poised or self.patience.is_search_due(time, command.size)) and (rest := self._rest(time, y)):
            return SERVED_AT if rest[1].size <= SERVO_CONVERGED_TOL else REST, rest
        return (POISED, state) if poised else None

    def _rest(self, time: float, y: Array) -> State | None:
        """Return the stable equilibrium that a run at y (n,) has reached; None if it is still moving."""
        found = rest_near(lambda y: self.rate(time, y), y)
        if (
            found is None
            or np.linalg.norm(found.y - y) > EQUILIBRIUM_DISTANCE_TOL
            or found.growth > NEUTRAL_GROWTH_RATE_TOL * self.loop.law.gain
        ):
            return None
        return self.state(time, found.y)

    def _stop_reason(self, at: ClosedConfiguration) -> str | None:
        """Return the reason for which a run ends at a configuration: a joint beyond its limit, an observation out of
        view."""
        past = {name: margin - self.least[name] for name, margin in self.stops.margins(at.model, at.q).items()}
        first = min(past, key=past.__getitem__, default=None)
        if first is not None and past[first] < 0:
            self.beyond = first
            return LIMIT
        return UNSEEN if self.loop.law.in_front(at) < VISIBLE_SINE_MIN else None

    def _at_limit(self, solver: Any) -> tuple[float, State]:
        """Time and state in the solver's last step up to which nothing ends the run."""
        inside, outside, curve = float(solver.t_old), float(solver.t), solver.dense_output()
        for _ in range(EVENT_BISECTIONS_COUNT):
            middle = (inside + outside) / 2
            met = self._stop_reason(self.state(middle, curve(middle))[0]) is not None
            inside, outside = (inside, middle) if met else (middle, outside)
        return inside, self.state(inside, curve(inside))


def _is_loop_rank_lost(at: ClosedConfiguration, start: ClosedConfiguration) -> bool:
    """Return True if the loops lose their rank at a configuration."""
    return at.kernel()[1].weakest < LOOP_RANK_LOSS_FRACTION * start.kernel()[1].weakest


@dataclass(frozen=True, eq=False, repr=False)
class Standstill(Value):
    """A zero y (n,) of ẏ, and the largest growth of a motion about it (1/s)."""

    y: Array
    growth: float


class Patience:
    """Timer of the search for an equilibrium: once a time constant, while the error persists."""

    def __init__(self, constant: float, time: float, size: float) -> None:
        self.constant, self._time, self._size = constant, time, size

    def is_search_due(self, time: float, size: float) -> bool:
        """Return True if it is time to search."""
        if time - self._time < self.constant:
            return False
        persists = size > PERSISTENT_ERROR_FRACTION * self._size
        self._time, self._size = time, size
        return persists


def rest_near(rate: Callable[[Array], Array], y: Array) -> Standstill | None:
    """Return the equilibrium next to y (n,) by Newton's method on ẏ = rate(y); None if none was found near."""
    try:
        for _ in range(EQUILIBRIUM_NEWTON_STEPS_COUNT):
            steps = EQUILIBRIUM_SLOPE_STEP_MAX * np.eye(len(y))
            J = np.array([(rate(y + each) - rate(y - each)) / (2 * EQUILIBRIUM_SLOPE_STEP_MAX) for each in steps]).T
            here = rate(y)
            step = np.asarray(np.linalg.lstsq(J, -here, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0], dtype=float)
            size = float(np.linalg.norm(step))
            # where J is singular, a velocity outside of its range goes on for ever
            if not size <= EQUILIBRIUM_NEWTON_STEP_MAX or np.linalg.norm(here + J @ step) > NEUTRAL_GROWTH_RATE_TOL:
                return None
            y = y + step
            if size <= EQUILIBRIUM_NEWTON_STEP_TOL:
                return Standstill(y, float(np.linalg.eigvals(J).real.max()))
    except LoopClosureFailure:
        return None
    return None
