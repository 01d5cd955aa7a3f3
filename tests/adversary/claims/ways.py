"""Paths without singularity, and poses that are called separated, followed in small steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from adversary.case import HELD, SILENT, UNCLEAR, WRONG, Case
from adversary.claims.first_order import sees_least
from adversary.claims.lists import asked_of
from adversary.drafts import turn
from adversary.robot import Array, Items, State, things
from adversary.search import polished

DENSE = 60
Place = Callable[[float], tuple[Array, Array]]
"""The point (3,) and the rotation (3, 3) at a part of a way, 0 to 1."""


def ways(case: Case) -> None:
    """``path`` from zero to a pose to which small steps lead, or to half a turn."""
    import hrsynth
    from adversary.claims.poses import half_turned

    at, _ = case.walked
    if not len(at):
        return
    start, goal = case.text_of(case.robot.zero()), case.text_of(at[[int(case.rng.integers(len(at)))]])
    if case.rng.random() < 0.3:
        goal = half_turned(case) or goal
    told = case.asked("path", lambda: hrsynth.path(case.engine, case.observe(), start=start, goal=goal, budget=3000))
    if told is not None:
        asked_of(case, "ends of a path", start, told.start.pose)
        asked_of(case, "ends of a path", goal, told.goal.pose)
        judge(case, told)


def judge(case: Case, told: Any) -> None:
    """Hold a verdict about two poses against small steps."""
    start, goal = case.fitted(told.start.configuration), case.fitted(told.goal.configuration)
    items = case.directions(told.setup.observed)
    if start is None or goal is None:
        case.say("path", WRONG, "an end does not close")
    elif items is None:
        case.say("path", UNCLEAR, "a measurement is no direction of a link")
    elif told.verdict == "same aspect" and told.certified:
        same(case, told, start, goal, items)
    elif told.verdict == "separated" and told.certified:
        separated(case, start, goal, items)
    else:
        case.say("path", SILENT, told.verdict)


def same(case: Case, told: Any, start: State, goal: State, items: Items) -> None:
    """Follow a certified path."""
    if told.crossings:
        case.say("path", UNCLEAR, "through other working modes")
        return
    at, least, motion = start, np.inf, told.coordinates.motion
    for way in told.segments:
        angle = float(np.linalg.norm(way.turn))

        def place(part: float, way: Any = way, angle: float = angle) -> tuple[Array, Array]:
            R = turn(way.turn, part * angle) @ way.R if angle > 0 else way.R
            return (way.p + part * way.shift) * told.coordinates.length, R

        followed = follow(case, at, items, motion.link, motion.point, place, told.coordinates.turning)
        if followed is None:
            case.say("path", WRONG, "the robot does not follow the certified path")
            return
        at, weakest = followed
        least = min(least, weakest)
    x, R = (each[0] for each in case.study.poses(at))
    y, S = (each[0] for each in case.study.poses(goal))
    away = float(np.max(np.abs(x - y))) / case.robot.length
    if case.robot.point is None:
        away = max(away, float(np.max(np.abs(R - S))))
    if away > 1e-6:
        case.say("path", WRONG, f"the path ends {away:.1e} from the goal")
    else:
        case.say("path", HELD if least > 1e-7 else WRONG, "" if least > 1e-7 else f"singular on the way: {least:.1e}")


def separated(case: Case, start: State, goal: State, items: Items) -> None:
    """Try the straight way between poses that are called separated."""
    point = np.zeros(3) if case.robot.point is None else case.robot.point
    (x, R), (y, S) = ([each[0] for each in case.study.poses(at)] for at in (start, goal))
    relative = S @ R.T
    angle = float(np.arccos(np.clip((np.trace(relative) - 1) / 2, -1, 1)))
    vee = np.array([relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]])
    axis = vee if angle > 1e-9 and np.linalg.norm(vee) > 1e-9 else np.array([0.0, 0.0, 1.0])

    def place(part: float) -> tuple[Array, Array]:
        return x + part * (y - x), turn(axis, part * angle) @ R

    followed = follow(case, start, items, case.robot.platform, point, place, case.robot.point is None)
    if followed is None:
        case.say("separated", UNCLEAR, "the straight way is blocked")
        return
    at, least = followed
    frames, other = case.robot.frames(at), case.robot.frames(goal)
    u, v = (case.robot.items(items, each)[0] for each in (frames, other))
    there = float(np.max(np.abs(u - v))) < 1e-6
    wrong = there and least > 1e-2
    case.say(
        "separated",
        WRONG if wrong else HELD,
        f"the straight way has no singularity, smallest value {least:.1e}" if wrong else "",
    )


def follow(
    case: Case, at: State, items: Items, link: str, point: Array, place: Place, turning: bool
) -> tuple[State, float] | None:
    """The configuration at the end of a way, and the smallest singular value of Mᵀ on it; None where it is lost."""
    robot = case.robot
    held = things(robot, [(link, point, True), *((link, e, False) for e in np.eye(3) if turning)])
    states, parts = [], np.linspace(0, 1, DENSE + 1)
    for part in parts:
        moved = reached(case, at, held, place, part, turning)
        if moved is None:
            return None
        at = moved
        states.append(at)
    values = np.concatenate([sees_least(case, items, each) for each in states])
    least = float(values.min())
    low = int(np.argmin(values))
    if least < 0.05:  # ever nearer to the smallest
        left, right, here = parts[max(low - 1, 0)], parts[min(low + 1, DENSE)], states[low]
        for _ in range(40):
            a, b = left + 0.382 * (right - left), left + 0.618 * (right - left)
            found = [reached(case, here, held, place, c, turning) for c in (a, b)]
            if found[0] is None or found[1] is None:
                break
            va, vb = (float(sees_least(case, items, each)[0]) for each in found)
            least, here = min(least, va, vb), found[0] if va < vb else found[1]
            left, right = (left, b) if va < vb else (a, right)
    return at, least


def reached(case: Case, at: State, held: Items, place: Place, part: float, turning: bool) -> State | None:
    """The configuration near ``at`` with the link where it is at this part of the way."""
    x, R = place(part)
    rows = case.robot.held(held, np.array([x, *(R.T if turning else ())]))
    moved, size = polished(case.robot, rows, at, steps=12)
    far = float(np.max(np.abs(moved.theta - at.theta), initial=0.0))
    return moved if size[0] < 1e-9 and far < 0.7 else None
