"""Pairs of poses that ``path`` calls separated, and a search for ways between them through all working modes.

``python -m adversary.detours --pairs 1000 --workers 2 --log detours.jsonl`` (from ``tests/``): ten robots in turn; a
line of the log a block of pairs of one robot, so that a run that was broken off goes on (with the same code); a table
at the end; exit status 1 where a way without singularity was found.

The search knows nothing of closed forms, working modes or expressions. It grows two trees of configurations, in steps
small enough that legs go through their limits and rods through length zero: one from the start, one from all
configurations with the goal's pose that are found. Joints keep to their limits.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from adversary.case import Case
from adversary.claims.first_order import sees_least
from adversary.robot import Array, Items, State, joined, things
from adversary.run import code
from adversary.search import polished, scattered, solve

FILES = Path(__file__).resolve().parents[2] / "robots"
ROBOTS: dict[str, tuple[str, str | None, str, float]] = {
    "3prr": ("3prr_m1", None, "", 0.0),
    "3prr, sliders": ("3prr_m2", None, "guide", 0.4),
    "5-bar": ("rrrrr_m1", None, "", 0.0),
    "5-bar, elbows": ("rrrrr_m2", None, "elbow", 1.2),
    "3rrr": ("3rrr_m1", None, "", 0.0),
    "3rrr, elbows": ("3rrr_m1", None, "elbow", 1.2),
    "3rpr, slides": ("3rpr_m1", None, "slide", 0.2),
    "rprpr, slides": ("rprpr_m1", None, "slide", 0.2),
    "hexapod, slides": ("gough_stewart", "1,2,3", "slide", 0.2),
    "quattro": ("quattro", "1,4", "", 0.0),
}
"""Shipped robots: file, legs, and joints, by a part of their names, that keep so near to their zero (rad, m)."""
BLOCK = 10
"""Pairs of poses of one task."""
STEP, CLEAR, NEAR = 0.04, 0.02, 1e-3
"""Length of a step; least singular value on a way; where two configurations are one (all in characteristic lengths)."""
SMOOTH, FINE = 0.15, 0.04
"""No step is longer than this part of the least singular value, which falls by up to ten in a unit of length; nor one
of those by which a way is confirmed."""
TARGETS, STEPS = 12, 10
"""Configurations that are headed for at once, and steps towards each."""


def draft(name: str, folder: Path) -> Case:
    """A robot of the table, its file in a folder."""
    file, _, joints, room = ROBOTS[name]
    tree = ElementTree.parse(FILES / f"{file}.urdf")
    for joint in tree.getroot().findall("joint"):
        if joints and joints in joint.get("name", "") and joint.get("type") in ("revolute", "continuous", "prismatic"):
            for old in joint.findall("limit"):
                joint.remove(old)
            joint.set("type", "prismatic" if joint.get("type") == "prismatic" else "revolute")
            ElementTree.SubElement(joint, "limit", lower=str(-room), upper=str(room), effort="1", velocity="1")
    path = folder / f"{name.replace(' ', '_')}.urdf"
    tree.write(path)
    return Case(name, 0, path, np.random.default_rng(0))


def limits(case: Case) -> tuple[Array, Array]:
    """The lower and upper limits of the tree's R and P joints."""
    low, high = np.full(case.robot.scalars, -np.inf), np.full(case.robot.scalars, np.inf)
    for joint in ElementTree.parse(case.path).getroot().findall("joint"):
        limit, place = joint.find("limit"), case.robot.coordinate(joint.get("name", ""))
        if limit is not None and place is not None and joint.get("type") != "continuous":
            free = limit.get("free", "").split()
            low[place[0]] = -np.inf if "lower" in free else float(limit.get("lower", "-inf"))
            high[place[0]] = np.inf if "upper" in free else float(limit.get("upper", "inf"))
    return low, high


@dataclass
class Tree:
    """Configurations, where their joints are, how clear they are, and from which one each was reached (-1: a root)."""

    at: State
    spots: Array
    clear: Array
    before: list[int]

    def add(self, at: State, spots: Array, clear: Array, before: Sequence[int]) -> None:
        """More configurations."""
        self.at, self.spots = joined(self.at, at), np.concatenate([self.spots, spots])
        self.clear = np.concatenate([self.clear, clear])
        self.before += before

    def cut(self, number: int) -> None:
        """Take a configuration off, and all that were reached from it."""
        gone = {number}
        for k in range(number, len(self.before)):
            if k in gone or self.before[k] in gone:
                gone.add(k)
                self.spots[k] = np.inf

    def way(self, number: int) -> list[int]:
        """The numbers from one back to its root."""
        found = [number]
        while self.before[found[-1]] >= 0:
            found.append(self.before[found[-1]])
        return found


class Search:
    """A robot with what is observed, in which ways are sought."""

    def __init__(self, case: Case, items: Items) -> None:
        self.case, self.items, self.robot = case, items, case.robot
        self.low, self.high = limits(case)
        self.joints = things(self.robot, [(link, p, True) for link, some in self.robot.centres.items() for p in some])
        self.metric = np.where(self.robot.slides, self.robot.length, 1.0)

    def spots(self, at: State) -> Array:
        """Where all joints are on their links, (N, 3 k), so that distances are root mean squares."""
        x = self.robot.items(self.joints, self.robot.frames(at))[0] / self.robot.length
        return x.reshape(len(at), -1) / np.sqrt(x.shape[1])

    def clear(self, at: State) -> Array:
        """The least singular values of configurations that are closed and within limits, (N,); zero at others."""
        found = np.zeros(len(at))
        if len(at):
            good = (self.case.study.closed(at) < 1e-9) & ((at.theta > self.low) & (at.theta < self.high)).all(axis=1)
            found[good] = sees_least(self.case, self.items, at[good]) if good.any() else 0.0
        return found

    def towards(self, at: State, goals: Array, sizes: Array) -> State:
        """One step from each configuration towards places of the joints, loops closed again."""
        x, J = self.robot.items(self.joints, self.robot.frames(at))
        count = x.shape[1]
        unit = self.robot.length * np.sqrt(count)
        J = np.swapaxes(J, 2, 3).reshape(len(at), -1, self.robot.size) * self.metric / unit
        away = goals - x.reshape(len(at), -1) / unit
        move = np.zeros((len(at), self.robot.size))
        for k, local in enumerate(self.case.study.locals(at)):
            ahead = J[k] @ local.N
            z = np.linalg.pinv(ahead, rcond=1e-6) @ away[k]
            size = max(float(np.linalg.norm(ahead @ z)), 1e-12)
            move[k] = self.metric * (local.N @ z) * min(1.0, float(sizes[k]) / size)
        return polished(self.robot, self.robot.loops, self.robot.moved(at, move), steps=3)[0]

    def assembled(self, rng: np.random.Generator, at: State, held: bool) -> State:
        """Configurations with the platform where it is at one (``held``), or anywhere, as far as they are found."""
        robot, study = self.robot, self.case.study
        rows = robot.loops
        if held:
            (x, R), point = study.poses(at), np.zeros(3) if robot.point is None else robot.point
            axes = [(robot.platform, e, False) for e in np.eye(3) if robot.point is None]
            rows = robot.held(
                things(robot, [(robot.platform, point, True), *axes]), np.concatenate([x[0][None], R[0].T[: len(axes)]])
            )
        found = polished(robot, rows, solve(robot, rows, scattered(robot, rng, 96, at))[0])[0]
        F = robot.rows(rows, robot.frames(found), False)[0]
        found = joined(at, found[np.sqrt(np.sum(F * F, 1)) < 1e-9])
        found.theta[:] -= np.where(robot.slides[: robot.scalars], 0, 2 * np.pi * np.round(found.theta / (2 * np.pi)))
        return found[self.clear(found) > CLEAR] if held else found

    def way(self, start: State, goal: State, rng: np.random.Generator, seconds: float = 6.0) -> State | None:
        """Configurations from a start to one with a goal's pose, none near a singularity; None where none is found."""
        goals, anywhere = self.assembled(rng, goal, True), self.assembled(rng, start, False)
        if not len(goals) or not self.clear(start)[0] > CLEAR:
            return None
        trees = [Tree(at, self.spots(at), self.clear(at), [-1] * len(at)) for at in (start, goals)]
        far, until, turn = self.spots(anywhere), time.process_time() + seconds, 0
        while time.process_time() < until:
            here, there = trees[turn], trees[1 - turn]
            turn = 1 - turn
            others = rng.integers(len(there.spots), size=TARGETS)
            headed = np.where((rng.random(TARGETS) < 0.5) & np.isfinite(there.spots[others, 0]), others, -1)
            targets = np.where(headed[:, None] >= 0, there.spots[others], far[rng.integers(len(far), size=TARGETS)])
            nearest = np.array([int(np.argmin(np.sum((here.spots - each) ** 2, 1))) for each in targets])
            for _ in range(STEPS):
                at = self.towards(here.at[nearest], targets, np.minimum(STEP, SMOOTH * here.clear[nearest]))
                spots, old = self.spots(at), here.spots[nearest]
                left = np.linalg.norm(targets - spots, axis=1)
                good = (np.linalg.norm(spots - old, axis=1) < 2 * STEP) & (
                    left < np.linalg.norm(targets - old, axis=1) - 1e-4
                )
                clear = np.zeros(len(at))
                clear[good] = self.clear(at[good])
                good = clear > CLEAR
                if not good.any():
                    break
                here.add(at[good], spots[good], clear[good], nearest[good].tolist())
                targets, headed, left = targets[good], headed[good], left[good]
                nearest = len(here.spots) - len(left) + np.arange(len(left))
                for met in np.flatnonzero((headed >= 0) & (left < NEAR)):
                    ends = [here.way(int(nearest[met])), there.way(int(headed[met]))]
                    ends = ends if here is trees[0] else ends[::-1]
                    way = joined(trees[0].at[ends[0][::-1]], trees[1].at[ends[1]])
                    holds = self.holds(way)
                    if holds.all():
                        return way
                    bad = int(np.argmin(holds))  # the step at its start, the one before the trees met, or after it
                    if bad + 1 < len(ends[0]):
                        trees[0].cut(ends[0][::-1][bad + 1])
                    elif bad >= len(ends[0]):
                        trees[1].cut(ends[1][bad - len(ends[0])])
                    else:
                        here.cut(int(nearest[met]))
                    break
                if not np.isfinite(here.spots[nearest]).all():
                    break
        return None

    def holds(self, way: State) -> Array:
        """Whether small steps from each configuration of a way to the next never come near a singularity."""
        at, goals, clear = way[:-1], self.spots(way)[1:], self.clear(way[:-1])
        good, there = clear > CLEAR / 2, np.zeros(len(at), dtype=bool)
        for _ in range(400):
            there |= np.linalg.norm(self.spots(at) - goals, axis=1) < NEAR
            going = np.flatnonzero(good & ~there)
            if not good.all() or not len(going):
                break
            moved = self.towards(at[going], goals[going], np.minimum(STEP / 4, FINE * clear[going]))
            at.theta[going], at.quats[going], clear[going] = moved.theta, moved.quats, self.clear(moved)
            good = clear > CLEAR / 2
        return good & (there | ~good.all())


def detour(case: Case, told: Any, seconds: float = 6.0) -> State | None:
    """A way between the two poses of an answer of ``path`` that it would have to call no separation."""
    items = case.directions(told.setup.observed)
    start, goal = case.fitted(told.start.configuration), case.fitted(told.goal.configuration)
    if items is None or start is None or goal is None:
        return None
    return Search(case, items).way(start, goal, case.rng, seconds)


def attacked(task: tuple[str, int]) -> dict[str, Any]:
    """What is found of a block of pairs of one robot."""
    import hrsynth

    name, block = task
    with tempfile.TemporaryDirectory() as folder:
        case = draft(name, Path(folder))
        case.rng = rng = np.random.default_rng([list(ROBOTS).index(name), block])
        known = case.robot.zero()
        for _ in range(3):
            at, good = case.study.walk(rng, known[[int(rng.integers(len(known)))]], 6, 14, 0.06)
            known = joined(known, at[good])
        said: Counter[str] = Counter()
        wrong = []
        search = Search(case, case.directions(hrsynth.check(case.engine, ROBOTS[name][1]).setup.observed))
        anywhere = joined(known, search.assembled(rng, case.robot.zero(), False))
        while sum(said.values()) - said["refused"] < BLOCK and said["refused"] < 10 * BLOCK:
            one, other = (case.text_of(some[[int(rng.integers(len(some)))]]) for some in (known, anywhere))
            told = case.asked(
                "path",
                lambda one=one, other=other: hrsynth.path(
                    case.engine, ROBOTS[name][1], start=one, goal=other, budget=400
                ),
            )
            said["refused" if told is None else told.verdict] += 1
            if told is not None and told.verdict == "separated" and detour(case, told) is not None:
                wrong.append(f"--start {one} --goal {other}")
    return {"robot": name, "block": block, "said": said, "wrong": wrong}


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--log", type=Path, default=None)
    given = parser.parse_args(arguments)
    tasks = [(list(ROBOTS)[k % len(ROBOTS)], k // len(ROBOTS)) for k in range(-(-given.pairs // BLOCK))]
    done, now = {}, code()
    if given.log is not None and given.log.exists():
        records = map(json.loads, given.log.read_text(encoding="utf-8").splitlines())
        done = {(record["robot"], record["block"]): record for record in records if record["code"] == now}
    with ProcessPoolExecutor(given.workers) as pool:
        for record in pool.map(attacked, [task for task in tasks if task not in done]):
            done[record["robot"], record["block"]] = record
            if given.log is not None:
                with given.log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({**record, "code": now}) + "\n")
            for line in record["wrong"]:
                print("WRONG", record["robot"], line, flush=True)
    for name in ROBOTS:
        said: Counter[str] = sum((Counter(done[task]["said"]) for task in tasks if task[0] == name), Counter())
        print(f"{name}: {', '.join(f'{count} {word}' for word, count in sorted(said.items()))}")
    return 1 if any(done[task]["wrong"] for task in tasks) else 0


if __name__ == "__main__":
    sys.exit(main())
