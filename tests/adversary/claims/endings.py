"""Where a servo loop ends, by another integrator and the law written again."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, SILENT, UNCLEAR, WRONG, Case, apart
from adversary.robot import Array, Items, State

REGULAR = 0.02


def endings(case: Case) -> None:
    """``servo`` from zero to a pose to which small steps lead, or back."""
    import hrsynth

    at, _ = case.walked
    if not len(at):
        return
    texts = [case.text_of(case.robot.zero()), case.text_of(at[[int(case.rng.integers(len(at)))]])]
    start, goal = texts if case.rng.random() < 0.5 else texts[::-1]
    told = case.asked("ending", lambda: hrsynth.servo(case.engine, case.observe(), start=start, goal=goal))
    if told is not None:
        judge(case, told)


def judge(case: Case, told: Any) -> None:
    """Hold an ending against an own run."""
    start = case.fitted(told.run.configurations[0])
    items = case.directions(told.setup.observed)
    if start is None or items is None:
        case.say("ending", UNCLEAR, "the start is not known here")
        return
    if told.outcome not in ("goal", "assembly mode", "antipodal"):
        case.say("ending", SILENT, told.outcome)
        return
    found = run(case, items, start, np.asarray(told.desired, dtype=float), float(told.gain))
    if found is None:
        case.say("ending", UNCLEAR, "the own run comes near a singularity")
        return
    away = apart(case, told.pose, found)
    case.say(
        "ending",
        HELD if away < 1e-4 else WRONG,
        "" if away < 1e-4 else f"{told.outcome} at {told.pose}, the own run ends {away:.1e} from there",
    )


def run(case: Case, items: Items, start: State, desired: Array, gain: float) -> State | None:
    """The end of the loop q̇ = −λ N (L U N)⁺ e, loops kept closed, by SciPy's DOP853; None near singularities."""
    from scipy.integrate import solve_ivp

    robot, m = case.robot, case.robot.scalars
    weakest = [np.inf]
    cross = np.array([[[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]] for w in desired])

    def state(y: Array) -> State:
        quats = y[m:].reshape(1, robot.balls, 4)
        return State(y[None, :m], quats / np.linalg.norm(quats, axis=-1, keepdims=True) if robot.balls else quats)

    def error(at: State) -> Array:
        return np.cross(robot.items(items, robot.frames(at))[0][0], desired).ravel()

    def rate(time: float, y: Array) -> Array:
        at = state(y)
        local = case.study.locals(at)[0]
        U = case.study.rates(items, at)[0].reshape(-1, 3, robot.size)
        rows = -np.concatenate([K @ block for K, block in zip(cross, U, strict=True)]) @ local.N
        left, s, V = np.linalg.svd(rows, full_matrices=False)
        dof = int(np.sum(np.linalg.svd(local.T, compute_uv=False) > 1e-6))
        weakest[0] = min(weakest[0], float(s[dof - 1]), local.weakest)
        if weakest[0] < REGULAR:
            return np.zeros_like(y)
        q = -gain * local.N @ (V[:dof].T @ ((left[:, :dof].T @ error(at)) / s[:dof]))
        q = q * np.where(robot.slides, robot.length, 1.0)
        F, J = robot.rows(robot.loops, robot.frames(at))
        assert J is not None
        q = q - 5.0 * np.linalg.pinv(J[0], rcond=1e-9) @ F[0]
        half = q[m:].reshape(robot.balls, 3) / 2
        quats = at.quats[0]
        w, v = quats[:, :1], quats[:, 1:]
        return np.concatenate(
            [q[:m], np.concatenate([-np.sum(v * half, 1, keepdims=True), w * half + np.cross(v, half)], 1).ravel()]
        )

    def served(time: float, y: Array) -> float:
        return float(np.linalg.norm(error(state(y)))) - 1e-6

    served.terminal = True  # type: ignore[attr-defined]
    y0 = np.concatenate([start.theta[0], start.quats[0].ravel()])
    done = solve_ivp(rate, (0.0, 60.0 / gain), y0, method="DOP853", rtol=1e-7, atol=1e-9, events=served)
    if weakest[0] < REGULAR or not len(done.t_events[0]):
        return None
    return state(done.y[:, -1])
