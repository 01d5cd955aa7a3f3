"""Lists of assembly modes: complete, assembled or not, enclosed, held against many starts on the whole robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, SILENT, UNCLEAR, WRONG, Case, apart, matrix_of
from adversary.robot import Array, Items, State, things
from adversary.search import distinct, polished, scattered, solve, split

STARTS = 120
PLACES = {"poses with the rotation of this one": "turned", "poses whose links have the rotations of this one": "bodies"}


def hidden(case: Case) -> None:
    """The modes of the hidden robot, at zero or at a pose to which small steps lead."""
    lists(case, real=False)


def real(case: Case) -> None:
    """The modes of the real robot; of four in five robots with six freedoms they take too long."""
    six = int(np.sum(np.linalg.svd(case.study.locals(case.robot.zero())[0].T, compute_uv=False) > 1e-6)) == 6
    if not six or case.rng.random() < 0.2:
        lists(case, real=True)


def lists(case: Case, real: bool) -> None:
    """The modes with the directions or motors' coordinates of one pose."""
    import hrsynth

    at = None
    walked, _ = case.walked
    if len(walked) and case.rng.random() < 0.5:
        at = case.text_of(walked[[int(case.rng.integers(len(walked)))]])
    observe = None if real else case.observe()
    told = case.asked("modes", lambda: hrsynth.modes(case.engine, observe, at=at, real=real))
    if told is not None:
        judge(case, told, at, real)


def judge(case: Case, told: Any, at: str | None, real: bool) -> None:
    """Hold one list against many starts."""
    goal = case.fitted(told.goal)
    if goal is None:
        case.say("goal", WRONG, f"the configuration at {told.pose} does not close (at={at})")
        return
    if at is not None:
        asked_of(case, "asked pose", at, told.pose)
    if told.found.continuous_family is not None:
        case.say("modes", SILENT, "a continuum")
        return
    search = Search.of(case, told, goal, real)
    if search is None:
        case.say("modes", UNCLEAR, "what is held is not known here")
        return
    if search.regular(goal)[0]:
        listed = any(apart(case, mode.pose, goal) < 1e-4 for mode in told.modes)
        text = f"{told.pose} is none of {len(told.modes)} modes told (complete: {told.found.complete}; {told.kind})"
        case.say("the pose itself", HELD if listed else WRONG, "" if listed else text)
    found = search.all()
    complete(case, told, search, found)
    for mode in told.modes:
        assembled(case, told, mode, search, found)


def asked_of(case: Case, claim: str, asked: str, told: Any) -> None:
    """Whether the pose that is told is the one that was asked for."""
    fields = dict(part.split("=") for part in asked.split(","))
    x, R = matrix_of(told)
    wrong = max(abs(float(fields[n]) - v) for n, v in zip("xyz", x, strict=True)) / case.robot.length
    if "rpy" in fields and R is not None:
        angles = [float(a) for a in fields["rpy"].split("/")]
        wrong = max(wrong, float(np.max(np.abs(R - matrix_of(_Told(x[0], x[1], x[2], tuple(angles)))[1]))))
    case.say(claim, HELD if wrong < 2e-5 else WRONG, "" if wrong < 2e-5 else f"asked {asked}, told {told}")


class _Told:
    def __init__(self, x: float, y: float, z: float, rpy: tuple[float, ...]) -> None:
        self.x, self.y, self.z, self.rpy = x, y, z, rpy


class Search:
    """What is held at a goal, and the configurations of the whole robot with it."""

    def __init__(self, case: Case, goal: State, measured: Items, free: Array, turned: list[str]) -> None:
        self.case, self.goal, self.free = case, goal, free
        robot = case.robot
        self.measured = measured
        value = robot.items(measured, robot.frames(goal))[0][0]
        frame = [(link, e, False) for link in turned for e in np.eye(3)[:2]]
        kept = things(robot, frame)
        also = robot.items(kept, robot.frames(goal))[0][0] if frame else np.zeros((0, 3))
        self.rows = robot.held(_both(measured, kept), np.concatenate([value, also]))
        self.exact = robot.held(measured, value)

    @classmethod
    def of(cls, case: Case, told: Any, goal: State, real: bool) -> Search | None:
        """The search that belongs to a list; None where a motor is no joint of the own tree."""
        robot = case.robot
        free = np.ones(robot.size, dtype=bool)
        place = PLACES.get(told.within or "")
        turned = [robot.platform] if place else []
        if place == "bodies":
            turned += [name for mode in told.modes[:1] for name in (mode.bodies or {}) if name in robot.links]
        if real:
            for motor in robot.motors:
                found = robot.coordinate(motor)
                if found is None:
                    return None
                free[found] = False
            return cls(case, goal, things(robot, []), free, turned)
        measured = case.directions(told.setup.observed)
        return None if measured is None else cls(case, goal, measured, free, turned)

    def all(self, count: int = STARTS) -> State:
        """Closed configurations with what is held, at different poses of the platform, each isolated and regular, no
        parallelogram crossed."""
        robot, case = self.case.robot, self.case
        starts = scattered(robot, case.rng, count, self.goal)
        starts.theta[:, ~self.free[: robot.scalars]] = self.goal.theta[:, ~self.free[: robot.scalars]]
        starts.theta[0], starts.quats[0] = self.goal.theta[0], self.goal.quats[0]
        at, size = solve(robot, self.rows, starts, self.free)
        at = at[size < 1e-8]
        at, size = polished(robot, self.rows, at, free=self.free)
        at = at[size < 1e-11]
        at = at[~self.crossed(at)] if len(at) else at
        if not len(at):
            return at
        at = at[distinct(*case.study.poses(at), robot.length)]
        return at[self.regular(at)]

    def crossed(self, at: State) -> Array:
        """Whether a parallelogram is crossed, (N,)."""
        case, robot = self.case, self.case.robot
        found = np.zeros(len(at), dtype=bool)
        zero = robot.frames(robot.zero())[0][0]
        R = robot.frames(at)[0]
        for one, other in case.bars:
            u, v = (_rod(robot.centres[name]) for name in (one, other))
            i, j = robot.number(one), robot.number(other)
            sign = 1.0 if (zero[i] @ u) @ (zero[j] @ v) > 0 else -1.0
            found |= np.linalg.norm(R[:, i] @ u - sign * R[:, j] @ v, axis=1) > 1e-5
        for one, other in case.turned:
            i, j = robot.number(one), robot.number(other)
            relative = np.swapaxes(R[:, i], 1, 2) @ R[:, j]
            found |= np.max(np.abs(relative - zero[i].T @ zero[j]), axis=(1, 2)) > 1e-5
        return found

    def regular(self, at: State) -> Array:
        """Whether what is held leaves the platform no motion of first order, clearly, (N,)."""
        robot, study = self.case.robot, self.case.study
        metric = np.where(robot.slides, robot.length, 1.0)
        J = robot.rows(self.exact, robot.frames(at))[1]
        assert J is not None
        T = study.twists(at) * metric
        found = np.zeros(len(at), dtype=bool)
        for k in range(len(at)):
            Jk, Tk = (J[k] * metric)[:, self.free], T[k][:, self.free]
            _, s, V = np.linalg.svd(Jk)
            r, clear = split(s)
            kernel = V[r:].T
            weak = float(s[r - 1]) if r else 0.0
            found[k] = clear and weak > 1e-4 and (not kernel.size or float(np.max(np.abs(Tk @ kernel))) < 1e-9)
        return found

    def at_pose(self, x: Array, R: Array | None, starts: int = 80) -> State:
        """Configurations of the whole robot with the platform at a pose and with what is held."""
        robot, case = self.case.robot, self.case
        point = np.zeros(3) if robot.point is None else robot.point
        given = [(robot.platform, point, True)]
        values = [x]
        if R is not None and robot.point is None:
            given += [(robot.platform, e, False) for e in np.eye(3)]
            values += list(R.T)
        items = _both(self.measured, things(robot, given))
        rows = robot.held(items, np.concatenate([self.exact.values, np.array(values)]))
        begin = scattered(robot, case.rng, starts, self.goal)
        begin.theta[:, ~self.free[: robot.scalars]] = self.goal.theta[:, ~self.free[: robot.scalars]]
        at, _ = solve(robot, rows, begin, self.free)
        at, size = polished(robot, self.exact, at, free=self.free)
        here, turned = case.study.poses(at)
        near = np.max(np.abs(here - x), axis=1) / robot.length < 1e-5
        if R is not None and robot.point is None:
            near &= np.max(np.abs(turned - R), axis=(1, 2)) < 1e-5
        return at[(size < 1e-11) & near & ~self.crossed(at)]


def complete(case: Case, told: Any, search: Search, found: State) -> None:
    """Whether a list that is called complete has every pose that was found."""
    kind = "real modes" if told.kind == "real" else "hidden modes"
    missing = [
        k for k in range(len(found)) if not any(apart(case, mode.pose, found[[k]]) < 1e-4 for mode in told.modes)
    ]
    if not told.found.complete:
        case.say(kind, SILENT, f"not called complete, and {'some missing' if missing else 'all there'}")
    elif missing:
        x, R = (each[missing[0]] for each in case.study.poses(found))
        case.say(
            kind,
            WRONG,
            f"{len(told.modes)} told as complete at {told.pose}, {len(found)} exist; missing {x.tolist()} {R.tolist()}",
        )
    else:
        case.say(kind, HELD)


def assembled(case: Case, told: Any, mode: Any, search: Search, found: State) -> None:
    """Whether a mode can be assembled where that is said, and cannot where that is."""
    word = getattr(mode, "assembly", None) or ("yes" if mode.reachable else "no")
    if mode.configuration is not None and word == "yes":
        at = case.fitted(mode.configuration)
        rows = case.robot.rows(search.exact, case.robot.frames(at))[0] if at is not None else np.ones((1, 1))
        away = apart(case, mode.pose, at) if at is not None else np.inf
        good = float(np.max(np.abs(rows), initial=0.0)) < 1e-6 and away < 1e-5
        off = f"{mode.pose}: does not close there, {np.max(np.abs(rows)):.1e}, pose off by {away:.1e}"
        case.say("assembled", HELD if good else WRONG, "" if good else off)
    elif word == "no" and not mode.beyond_limits:
        x, R = matrix_of(mode.pose)
        there = (
            any(apart(case, mode.pose, found[[k]]) < 1e-5 for k in range(len(found))) or len(search.at_pose(x, R)) > 0
        )
        case.say("cannot be assembled", WRONG if there else HELD, f"{mode.pose} can be" if there else "")
    else:
        case.say("assembled", SILENT, word)


def _both(one: Items, other: Items) -> Items:
    return Items(
        np.concatenate([one.links, other.links]),
        np.concatenate([one.local, other.local]),
        np.concatenate([one.point, other.point]),
    )


def _rod(centres: list[Array]) -> Array:
    """The longest difference of a link's centres, as a unit vector."""
    best = max(((a, b) for a in centres for b in centres), key=lambda pair: float(np.linalg.norm(pair[1] - pair[0])))
    return (best[1] - best[0]) / np.linalg.norm(best[1] - best[0])
