"""Enclosures: modes of the file's decimals in eleven more bits, against the radius that is told."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, UNCLEAR, WRONG, Case, apart, matrix_of
from adversary.claims.lists import Search
from adversary.robot import Array, Robot, State, things

ROUNDING = 4e-16
"""What the doubles of a told pose may be off by themselves (characteristic lengths, rotation matrices)."""


def enclosures(case: Case) -> None:
    """The proved modes of the hidden robot at the zero configuration, or at a whole pose of six freedoms."""
    import hrsynth

    at = None
    walked, _ = case.walked
    if len(walked) and case.rng.random() < 0.5 and case.study.locals(walked[:1])[0].T.any():
        dof = int(np.sum(np.linalg.svd(case.study.locals(walked[:1])[0].T, compute_uv=False) > 1e-6))
        if dof == 6:
            at = case.text_of(walked[[0]])
    told = case.asked("enclosure", lambda: hrsynth.modes(case.engine, case.observe(), at=at))
    if told is not None and told.found.continuous_family is None:
        judge(case, told, at)


def judge(case: Case, told: Any, asked: str | None) -> None:
    """Hold the radii of the modes that can be assembled against long doubles."""
    exact = Robot.read(case.path, np.longdouble)
    items = case.directions(told.setup.observed, exact)
    goal = exact.zero() if asked is None else asked_exactly(case, exact, told, asked)
    if items is None or goal is None:
        case.say("enclosure", UNCLEAR, "the goal is not known in long doubles")
        return
    rows = exact.held(items, exact.items(items, exact.frames(goal))[0][0])
    for mode in told.modes:
        if not (mode.proved and np.isfinite(mode.radius)) or mode.rounded or mode.configuration is None:
            continue
        near = case.fitted(mode.configuration)
        if near is None or apart(case, mode.pose, near) > 1e-5:
            continue  # told under another claim
        missed = misses(case, exact, mode, refined(exact, rows, lifted(exact, near)))
        search = Search.of(case, told, case.fitted(told.goal) or near, real=False)
        if missed and search is not None:  # another posture of the legs, with all but the same pose, may be meant
            others = search.at_pose(*matrix_of(mode.pose))
            every = (refined(exact, rows, lifted(exact, others[[k]])) for k in range(len(others)))
            missed = missed if all(misses(case, exact, mode, each) for each in every) else ""
        outcome = UNCLEAR if missed is None else WRONG if missed else HELD
        case.say("enclosure", outcome, "closed to rounding only" if missed is None else missed)


def misses(case: Case, exact: Robot, mode: Any, found: tuple[State, float] | None) -> str | None:
    """What of a mode lies outside of what is told, "" if nothing; None where no solution is known sharply enough."""
    if found is None:
        return None
    at, sharp = found
    slack, size = ROUNDING + sharp, max(case.robot.length, float(np.max(np.abs(matrix_of(mode.pose)[0]))))
    for name, (shift, turn) in distances(case, exact, mode, at).items():
        if shift > mode.shift + slack * size or turn > mode.turn + slack:
            return (
                f"{name} at {mode.pose}: within {mode.shift:.2e} m, {mode.turn:.2e} rad told, "
                f"the mode is {shift:.2e} m, {turn:.2e} rad away"
            )
    return ""


def asked_exactly(case: Case, exact: Robot, told: Any, asked: str) -> State | None:
    """The configuration with the platform exactly at the decimals asked for."""
    near = case.fitted(told.goal)
    if near is None:
        return None
    fields = dict(part.split("=") for part in asked.split(","))
    x = np.array([np.longdouble(fields[n]) for n in "xyz"])
    R = _matrix(np.array([np.longdouble(a) for a in fields["rpy"].split("/")]))
    frame = things(exact, [(exact.platform, np.zeros(3), True), *((exact.platform, e, False) for e in np.eye(3))])
    found = refined(exact, exact.held(frame, np.array([x, *R.T])), lifted(exact, near))
    return None if found is None else found[0]


def lifted(exact: Robot, at: State) -> State:
    """The same configuration in long doubles."""
    return State(at.theta.astype(np.longdouble), at.quats.astype(np.longdouble))


def refined(exact: Robot, rows: Any, at: State) -> tuple[State, float] | None:
    """Newton's steps with residuals in long doubles; with how far the solution may be from it; None where the
    equations do not vanish."""
    worth = 0.0
    for _ in range(8):
        F, J = exact.rows(rows, exact.frames(at))
        assert J is not None
        inverse = np.linalg.pinv(np.asarray(J[0], dtype=float), rcond=1e-9)
        worth = float(np.linalg.norm(inverse, 2))
        at = exact.moved(at, (-(inverse.astype(np.longdouble) @ F[0]))[None])
    F, _ = exact.rows(rows, exact.frames(at))
    size = float(np.linalg.norm(F[0].astype(float)))
    return (at, 4 * worth * max(size, 1e-19)) if worth * size < 1e-14 else None


def distances(case: Case, exact: Robot, mode: Any, at: State) -> dict[str, tuple[float, float]]:
    """How far the platform, or each body of which the radius speaks, is from where it is told to be (m, rad)."""
    R, p, _ = (each[0] for each in exact.frames(at))
    found = {}
    if mode.enclosed:
        for name in set(mode.enclosed) & set(exact.links) & set(mode.bodies or {}):
            k, X = exact.number(name), mode.bodies[name]
            found[name] = _off(p[k] - X[:3, 3], R[k] - X[:3, :3])
        return found
    k, point = exact.number(exact.platform), case.robot.point
    x, told = matrix_of(mode.pose)
    if told is None or point is not None:
        return {"the point": (_off(p[k] + R[k] @ (np.zeros(3) if point is None else point) - x, 0 * R[k])[0], 0.0)}
    return {"the platform": _off(p[k] - x, R[k] - told)}


def _off(shift: Array, turned: Array) -> tuple[float, float]:
    return float(np.linalg.norm(shift.astype(float))), float(np.linalg.norm(turned.astype(float), 2))


def _matrix(rpy: Array) -> Array:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
