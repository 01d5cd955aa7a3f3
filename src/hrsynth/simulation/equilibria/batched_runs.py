"""Batched runs of the law: Rosenbrock's method of order 2 (Shampine and Reichelt, *The MATLAB ODE suite*, 1997), each
run with its own steps, in charts about the pose at which a step begins.

The damped law is stiff where a run follows a singularity, so the method is implicit. A stretched observed leg continues
in its other working mode; a stretched unobserved leg constrains the platform (:mod:`.flow`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...geometry.vectors import Array, times
from ...progress import report
from ...results import Value
from ...tolerances import CONTROLLER_DAMPING_MIN, RUN_END_DIFFERENCE_TOL
from ..run import AWAY, EFFORT, EQUILIBRIUM_SPEED_TOL, LOST, REST, SERVED_AT, SERVO_CONVERGED_TOL, TIME
from .flow import FLOW_DAMPING_FRACTION, FLOW_SLOPE_STEP_MAX, CommandedMotion, Flags, Flow, Places

FLOW_STEP_ERROR_TOL = 3e-5
"""Error of a step (characteristic lengths, radians) of batched runs."""
FLOW_STEP_MIN = 1e-4
"""Step (time constants) at which a run without progress has a leg at the end of its reach."""
STRETCHED_LEG_MARGIN_FRACTION = 1e-2
"""Reach margin, as a fraction of that at zero, up to which a leg counts as stretched."""
REVERSED_LEG_MARGIN_FRACTION = 1e-6
"""Reach margin of a leg that slides through a fixed point, below which it reverses."""
FLOW_REFRESH_DISTANCE_MAX = 1e-2
"""Change of pose (characteristic lengths, matrix entries) after which that map is computed again."""
REACH_BOUNDARY_MARGIN_FRACTION = 1e-8
"""Reach margin, as a fraction of that at zero, at which a run slides along the limit of an unobserved leg."""
FLOW_NEWTON_ERROR_TOL = 1e-6
"""Norm of the error below which Newton's method finishes a run."""
FLOW_NEAR, FLOW_CONTRACTED, FLOW_CLEAR = 0.1, 0.125, 0.1
"""Error from which full Newton steps are tried, their contraction, and the reach margins kept (fractions of those at
zero)."""
FLOW_STEPS, FLOW_KEPT = 4_000, 4
"""Largest number of steps of batched runs, and steps that reuse the slopes of the law."""

GAMMA = 1 / (2 + np.sqrt(2))
E32 = 6 + np.sqrt(2)
RUN_STEP_MAX = 2.0
"""Time constants: a longer step of an implicit method would stay at an unstable equilibrium."""
RUN_END_NEWTON_STEPS_COUNT = 4
"""Newton steps at the end of a run whose error vanishes."""


@dataclass(frozen=True, eq=False, repr=False)
class Runs(Value):
    """State of n runs at their end: platform poses (n, 4, 4), ‖e‖ (n,), why they stopped (words of ``run``), which legs
    are in another working mode than at first and which constrain the platform, (n, legs), whether the law was damped
    along the run (``weak``, (n,)), and the time (time constants)."""

    X: Array
    size: Array
    stopped: NDArray[np.str_]
    flipped: Flags
    active: Flags
    weak: Flags
    times: Array

    def groups(self, length: float, seen: Flags) -> list[Places]:
        """Return the runs that converged, grouped by the poses and the working modes of the ``seen`` legs at the end,
        the largest group first."""
        left, found = np.flatnonzero(np.isin(self.stopped, (SERVED_AT, REST))), []
        while len(left):
            gap = np.abs(self.X[left] - self.X[left[0]])
            gap[:, :3, 3] /= length
            alike = (gap.max(axis=(1, 2)) <= RUN_END_DIFFERENCE_TOL) & (
                np.abs(self.size[left] - self.size[left[0]]) <= RUN_END_DIFFERENCE_TOL
            )
            alike &= (self.flipped[left] == self.flipped[left[0]])[:, seen].all(axis=1)
            found.append(left[alike])
            left = left[~alike]
        return sorted(found, key=lambda group: (-len(group), group[0]))


class BatchedRuns:
    """Runs on their way: poses, working modes and holding legs of all, and what is commanded there."""

    def __init__(self, flow: Flow, X: Array, farthest: float) -> None:
        n, legs = len(X), len(flow.legs)
        self.flow, self.X, self.first, self.farthest = flow, X.copy(), X, farthest
        self.flipped, self.active = np.zeros((n, legs), dtype=bool), np.zeros((n, legs), dtype=bool)
        self.times, self.steps = np.zeros(n), np.full(n, 0.05)
        self.stopped = np.full(n, "", dtype="U8")
        self.weak = np.zeros(n, dtype=bool)
        d = flow.batch.span.shape[1]
        self.slopes, self.old = np.zeros((n, d, d)), np.full(n, FLOW_KEPT)
        """∂ẏ/∂y of each run, and for how many steps it is kept."""
        self.roots = np.repeat(flow.roots(flow.batch.home[None], self.flipped[:1])[0], n, axis=0)
        self.taken = np.repeat(flow.batch.home[None], n, axis=0)

    def run(self, horizon: float) -> Runs:
        """All runs to their ends, or to the ``horizon`` (time constants)."""
        self.follow(horizon)
        size = self._at(np.arange(len(self.X))).size
        self.stopped[(self.stopped == SERVED_AT) & ~(size <= SERVO_CONVERGED_TOL)] = LOST
        return Runs(self.X, size, self.stopped, self.flipped, self.active, self.weak, self.times)

    def follow(self, horizon: float, few: int = 0) -> Self:
        """Continue the runs until at most a ``few`` have not ended."""
        live = np.flatnonzero(self.stopped == "")
        here = self._at(live)
        self.stopped[live[~here.reached]] = LOST
        for _ in range(FLOW_STEPS):
            report("run")
            kept = self.stopped[live] == ""
            live, here = live[kept], _part(here, kept)
            if len(live) <= few:
                return self
            here = self._step(live, here)
            self._arrive(live, here)
            self._end(live, here, horizon)
        self.stopped[live] = EFFORT
        return self

    def together(self, others: Sequence[BatchedRuns]) -> Self:
        """These and others of the same loop."""
        for name in [name for name, value in vars(self).items() if isinstance(value, np.ndarray)]:
            setattr(self, name, np.concatenate([getattr(each, name) for each in (self, *others)]))
        return self

    def _at(self, live: Places) -> CommandedMotion:
        return self.flow.at(self.X[live], self.flipped[live], self.active[live], self.roots[live])

    def _step(self, live: Places, here: CommandedMotion) -> CommandedMotion:
        """One step of each; where it is too long, or leaves what is reached, a shorter one is next."""
        flow, chart = self.flow, (self.X[live], self.flipped[live], self.active[live], self.roots[live])
        X, flipped, active, root = chart
        d = here.velocity.shape[1]
        h, f = self.steps[live][:, None], here.velocity

        def rate(y: Array, runs: slice | Places = slice(None)) -> tuple[Array, Flags]:
            """ẏ at one or several coordinates of each run's chart, (m n, d)."""
            X, *rest = (np.tile(each[runs], (len(y) // len(each[runs]), *[1] * (each.ndim - 1))) for each in chart)
            there = flow.at(flow.move(X, y), *rest)
            return flow.rate(y, there.moves), there.reached

        # any slopes give order 2: those of a run are kept for some steps while the law changes evenly
        anew = np.flatnonzero(self.old[live] >= FLOW_KEPT)
        if len(anew):
            ahead, met = rate(np.repeat(FLOW_SLOPE_STEP_MAX * np.eye(d), len(anew), axis=0), anew)
            slope = np.where(met[:, None], ahead - np.tile(f[anew], (d, 1)), 0.0) / FLOW_SLOPE_STEP_MAX
            self.slopes[live[anew]] = slope.reshape(d, -1, d).transpose(1, 2, 0)
            self.old[live[anew]] = 0
        J = self.slopes[live]
        W = np.linalg.inv(np.eye(d) - GAMMA * h[:, :, None] * J)

        def solved(rhs: Array) -> Array:
            return times(W, rhs)

        k1 = solved(f)
        f1, met = rate(h * k1 / 2)
        k2 = solved(f1 - k1) + k1
        y = h * k2
        Y = flow.move(X, y)
        slid = np.flatnonzero(active.any(axis=1))
        if len(slid):
            Y[slid] = self._on_wall(Y[slid], flipped[slid], active[slid])
        there = flow.at(Y, flipped, active, root)
        # a leg that slides through a fixed point keeps its direction there
        turned = np.sum(here.u * there.u, axis=2) < 0
        met &= there.reached & ~(turned & flow.pointed).any(axis=1)
        k3 = solved(flow.rate(y, there.moves) - E32 * (k2 - f1) - 2 * (k1 - f))
        error = np.max(np.abs(h / 6 * (k1 - 2 * k2 + k3)), axis=1) / FLOW_STEP_ERROR_TOL
        error = np.where(met & np.isfinite(error), error, np.inf)
        good = error <= 1
        with np.errstate(divide="ignore"):
            factor = np.where(met, np.clip(0.8 / np.cbrt(error), 0.2, 4.0), 0.25)
        done = live[good]
        self.X[done], self.times[done] = Y[good], self.times[done] + self.steps[done]
        self.steps[live] = np.minimum(self.steps[live] * factor, RUN_STEP_MAX)
        here = _merge(here, there, good)
        changed = self._cross_stretched(live, here, met)
        changed = changed | self._release(live, here, good) | self._weaken(live, here, good)
        uneven = (
            changed | (here.weakest < FLOW_DAMPING_FRACTION * CONTROLLER_DAMPING_MIN) | (~good & (self.old[live] > 0))
        )
        self.old[live] = np.where(uneven, FLOW_KEPT, self.old[live] + good)
        if changed.any():
            here = _merge(here, self._at(live), changed)
            self.stopped[live[changed & ~here.reached]] = LOST
        return here

    def _cross_stretched(self, live: Places, here: CommandedMotion, met: Flags) -> Flags:
        """Change the working mode, or what holds the platform, of runs that come no farther; which they are."""
        flow = self.flow
        margins = np.where(self.active[live], np.inf, here.margins)
        leg = np.argmin(margins, axis=1)
        least, seen = margins[np.arange(len(live)), leg], flow.seen[leg]
        short, turning = self.steps[live] < FLOW_STEP_MIN, seen & flow.points[leg]
        stuck = short & ~met & ~turning
        lost = stuck & (least > STRETCHED_LEG_MARGIN_FRACTION)
        through = np.flatnonzero((stuck & seen & ~lost) | (short & turning & (least < REVERSED_LEG_MARGIN_FRACTION)))
        if len(through):
            came = self._cross(live[through], leg[through], least[through], here.velocity[through])
            lost[through] = stuck[through] & ~came
            through = through[came]
        walled = np.flatnonzero(stuck & ~seen & ~lost)
        if len(walled):
            runs = live[walled]
            self.active[runs, leg[walled]] = True
            self.X[runs] = self._on_wall(self.X[runs], self.flipped[runs], self.active[runs])
            self.steps[runs] = 2 * FLOW_STEP_MIN
        self.stopped[live[lost]] = LOST
        changed = np.zeros_like(met)
        changed[walled] = changed[through] = True
        return changed

    def _cross(self, runs: Places, leg: Places, margin: Array, velocity: Array) -> Flags:
        """Give runs the other working mode of a leg, and move them on to where it is stretched as little again: √margin
        goes through zero at a steady pace. Runs that are on their way from there keep their mode, and are moved on to
        twice the margin, from where a step is felt. Which of them move at all."""
        flow, own = self.flow, np.arange(len(runs))
        rate = np.einsum("nd,nd->n", flow.slopes(self.X[runs], self.flipped[runs])[own, leg], velocity)
        came = rate != 0
        runs, leg, velocity, time = runs[came], leg[came], velocity[came], margin[came] / rate[came]
        through = time < 0
        self.flipped[runs[through], leg[through]] ^= True
        after = np.where((flow.points[leg] | ~through)[:, None], velocity, self._at(runs).moves)
        time = np.where(through, -2 * time, time)
        self.X[runs] = flow.move(self.X[runs], time[:, None] * (velocity + after) / np.where(through, 1, 2)[:, None])
        self.steps[runs] = np.where(flow.points[leg], self.steps[runs], 2 * FLOW_STEP_MIN)
        stretched = np.arange(len(flow.legs)) == leg[:, None]
        short = np.any(stretched & (flow.margins(self.X[runs], self.flipped[runs]) <= 0), axis=1) & ~flow.points[leg]
        runs, stretched, least = runs[short], stretched[short], margin[came][short]
        self.X[runs] = self._on_wall(self.X[runs], self.flipped[runs], stretched, least[:, None])
        return came

    def _weaken(self, live: Places, here: CommandedMotion, good: Flags) -> Flags:
        """Take S anew where it counts; which runs these are."""
        near = good & (here.weakest < FLOW_DAMPING_FRACTION * CONTROLLER_DAMPING_MIN) & (self.stopped[live] == "")
        self.weak[live[near & (here.weakest < CONTROLLER_DAMPING_MIN)]] = True
        apart = np.abs(self.X[live] - self.taken[live])
        apart[:, :3, 3] /= self.flow.batch.length
        near &= apart.max(axis=(1, 2)) > FLOW_REFRESH_DISTANCE_MAX
        runs = live[near]
        if len(runs):
            found, closed = self.flow.roots(self.X[runs], self.flipped[runs])
            self.roots[runs[closed]], self.taken[runs] = found[closed], self.X[runs]
        return near

    def _release(self, live: Places, here: CommandedMotion, good: Flags) -> Flags:
        """Let go of legs that no longer hold the platform; which runs they are of."""
        free = self.active[live] & ~here.held & good[:, None]
        some = free.any(axis=1)
        self.active[live[some]] &= ~free[some]
        self.steps[live[some]] = np.minimum(self.steps[live[some]], FLOW_STEP_MIN * 2)
        return np.asarray(some)

    def _on_wall(
        self, X: Array, flipped: Flags, active: Flags, margin: float | Array = REACH_BOUNDARY_MARGIN_FRACTION
    ) -> Array:
        """The poses next to X (n, 4, 4) where the active legs have a ``margin`` (n, 1) (two Newton steps)."""
        for _ in range(2):
            miss = np.where(active, margin - self.flow.margins(X, flipped), 0.0)
            N = np.where(active[:, :, None], self.flow.slopes(X, flipped), 0.0)
            X = self.flow.move(X, times(np.linalg.pinv(N, rcond=1e-6), miss))
        return X

    def _arrive(self, live: Places, here: CommandedMotion) -> None:
        """Take runs to where the error vanishes, by Newton's method. The undamped law is that method with short steps:
        where whole ones contract so fast that they converge (a quarter would do: Deuflhard, *Newton Methods for
        Nonlinear Problems*, section 2.1) and no leg comes near its limit, both end at the same pose."""
        firm = (here.weakest >= FLOW_DAMPING_FRACTION * CONTROLLER_DAMPING_MIN) & (here.size <= FLOW_NEAR)
        firm &= np.all(here.margins > FLOW_CLEAR, axis=1)
        some = np.flatnonzero((firm | (here.size <= FLOW_NEWTON_ERROR_TOL)) & (self.stopped[live] == ""))
        if not len(some):
            return
        runs, X, speed = live[some], self.X[live[some]], np.linalg.norm(here.velocity[some], axis=1)
        self.X[runs] = self.flow.move(X, here.velocity[some])
        there = self._at(runs)
        slow = ~(np.linalg.norm(there.velocity, axis=1) <= FLOW_CONTRACTED * speed)
        for _ in range(RUN_END_NEWTON_STEPS_COUNT - 1):
            slow |= ~np.all(there.margins > FLOW_CLEAR, axis=1)
            self.X[runs] = self.flow.move(self.X[runs], there.moves)
            there = self._at(runs)
        back = (slow | ~(there.size <= SERVO_CONVERGED_TOL)) & (here.size[some] > FLOW_NEWTON_ERROR_TOL)
        self.X[runs[back]] = X[back]
        some, runs = some[~back], runs[~back]
        self.times[runs] += np.log(np.maximum(here.size[some] / FLOW_NEWTON_ERROR_TOL, 1.0))
        self.stopped[runs] = SERVED_AT

    def _end(self, live: Places, here: CommandedMotion, horizon: float) -> None:
        """Mark the runs that are at an end."""
        speed = np.linalg.norm(here.velocity, axis=1)
        shift = np.linalg.norm(self.X[live][:, :3, 3] - self.first[live][:, :3, 3], axis=1)
        for word, at_end in (
            (REST, speed <= EQUILIBRIUM_SPEED_TOL * here.size),
            (TIME, self.times[live] >= horizon),
            (AWAY, shift > self.farthest),
        ):
            self.stopped[live[at_end & (self.stopped[live] == "")]] = word


def _part(here: CommandedMotion, kept: Flags) -> CommandedMotion:
    return CommandedMotion(*(getattr(here, name)[kept] for name in CommandedMotion.__dataclass_fields__))


def _merge(here: CommandedMotion, there: CommandedMotion, good: Flags) -> CommandedMotion:
    """Return the command at ``there`` where ``good``, else that at ``here``."""
    found = []
    for name in CommandedMotion.__dataclass_fields__:
        one, other = getattr(here, name), getattr(there, name)
        found.append(np.where(good.reshape(-1, *[1] * (one.ndim - 1)), other, one))
    return CommandedMotion(*found)
