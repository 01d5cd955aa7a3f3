"""Hidden robots: the written file, read here, has the same relation between directions and platform as the real one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from adversary.case import HELD, SILENT, UNCLEAR, WRONG, Case
from adversary.claims.verdicts import generic
from adversary.robot import Array, Robot, State, things
from adversary.search import Study, polished, scattered, solve

SAME = 1e-5


def rewritten(case: Case) -> None:
    """``derive``: the verdict, and the hidden robot at zero and where small steps lead."""
    import hrsynth

    told = case.asked("hidden robot", lambda: hrsynth.derive(case.engine, case.observe()))
    if told is None:
        return
    own = generic(case, case.directions(told.setup.observed))
    if not isinstance(own, str):
        good = own == (told.dof, told.verdict.rank)
        case.say(
            "verdict",
            HELD if good else WRONG,
            "" if good else f"derive: rank {told.verdict.rank} of {told.dof}, by small steps {own}",
        )
    if told.hidden is not None:
        path = case.path.with_suffix(".hidden.urdf")
        hrsynth.save(told.hidden, path)
        judge(case, told, path)


def judge(case: Case, told: Any, path: Path) -> None:
    """Hold the relation of a hidden robot's file against the real robot's."""
    hidden = Robot.read(path)
    study = Study(hidden, case.robot.point)
    observed = told.setup.observed
    if any(o.link not in hidden.links for o in observed):
        case.say("hidden robot", UNCLEAR, "an observed link is gone")
        return
    given = [(o.link, np.asarray(o.direction, dtype=float), False) for o in observed]
    items, mine = things(hidden, given), case.directions(observed)
    if mine is None:
        case.say("hidden robot", UNCLEAR, "a measurement is no direction of a link")
        return
    walked, _ = case.walked
    generic = [relation(case.study, case.robot, mine, walked[[k]]) for k in range(min(2, len(walked)))]
    zero = relation(case.study, case.robot, mine, case.robot.zero())
    if zero is not None and any(each is not None and each.shape != zero.shape for each in generic):
        case.say("hidden robot", SILENT, "zero is a special pose, of which the certificate says nothing")
        start = []
    else:
        start = [case.robot.zero()]
    for at in (*start, *(walked[[k]] for k in range(min(2, len(walked))))):
        there = follow(case, hidden, study, items, mine, at)
        if there is None:
            case.say("hidden robot", WRONG, "it cannot follow the real one")
            return
        one, other = relation(case.study, case.robot, mine, at), relation(study, hidden, items, there)
        if one is None or other is None:
            case.say("hidden robot", UNCLEAR, "singular values near the cutoff")
            continue
        angle = (
            1.0
            if one.shape[1] != other.shape[1]
            else float(np.linalg.norm(other - one @ (one.T @ other), 2))
            if one.shape[1]
            else 0.0
        )
        case.say(
            "hidden robot",
            HELD if angle < SAME else WRONG,
            "" if angle < SAME else f"relations of dimension {one.shape[1]}, {other.shape[1]}, angle {angle:.1e}",
        )


def follow(case: Case, hidden: Robot, study: Study, items: Any, mine: Any, at: State) -> State | None:
    """The hidden robot at the platform pose and the directions of the real one, led there from zero."""
    u = case.robot.items(mine, case.robot.frames(at))[0][0]
    u0 = case.robot.items(mine, case.robot.frames(case.robot.zero()))[0][0]
    (x, R), (x0, R0) = ([each[0] for each in case.study.poses(c)] for c in (at, case.robot.zero()))
    given = [*zip(np.array(hidden.links)[items.links], items.local, strict=True)]
    point = np.zeros(3) if study.point is None else study.point
    frame = [] if study.point is not None else list(np.eye(3))
    held = things(
        hidden,
        [(str(link), v, False) for link, v in given]
        + [(hidden.platform, point, True)]
        + [(hidden.platform, e, False) for e in frame],
    )
    here = hidden.zero()
    for part in (0.0, 0.25, 0.5, 0.75, 1.0):
        values = [*(u0 + part * (u - u0)), x0 + part * (x - x0), *((R0 + part * (R - R0)).T if frame else ())]
        here, size = solve(hidden, hidden.held(held, np.array(values)), here)
    rows = hidden.held(held, np.array(values))
    if size[0] > 1e-8:  # between the two poses there may be none that it reaches
        many, size = solve(hidden, rows, scattered(hidden, case.rng, 60, here))
        if size.min() > 1e-8:
            return None
        here = many[[int(np.argmin(size))]]
    return polished(hidden, rows, here)[0]


def relation(study: Study, robot: Robot, items: Any, at: State) -> Array | None:
    """An orthonormal basis of all (t, u̇); None where its dimension is not clear."""
    local = study.locals(at)[0]
    if not local.clear:
        return None
    both = np.vstack(
        [
            local.T * (np.array([robot.length] * 3 + [1.0] * (len(local.T) - 3)))[:, None],
            np.asarray(study.rates(items, at)[0], dtype=float) @ local.N,
        ]
    )
    left, s, _ = np.linalg.svd(both, full_matrices=False)
    if np.any((s > 1e-8) & (s < 1e-5)):
        return None
    return np.asarray(left[:, s > 1e-5])
