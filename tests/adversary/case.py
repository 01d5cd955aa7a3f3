"""A robot under attack: its file, the engine's mechanism, the own reading of it; and what a check says of a claim."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from adversary.drafts import turn
from adversary.robot import Array, Items, Robot, State, things
from adversary.search import Study, polished, scattered, solve

HELD, WRONG, UNCLEAR, REFUSED, SILENT = "held", "wrong", "unclear", "refused", "silent"
"""A claim that the search confirms; that it refutes; that it cannot judge; no answer with a reason; no claim made."""


@dataclass(frozen=True)
class Said:
    """What was found of one claim."""

    claim: str
    outcome: str
    detail: str = ""


@dataclass
class Case:
    """One random robot. ``bars``: pairs of links that are the equal bars of a parallelogram; ``turned``: pairs that one
    keeps from turning against each other."""

    kind: str
    seed: int
    path: Path
    rng: np.random.Generator
    bars: Sequence[tuple[str, str]] = ()
    turned: Sequence[tuple[str, str]] = ()
    found: list[Said] = field(default_factory=list)
    enough: Sequence[Sequence[str]] = ()
    """The smallest sets of legs that see all, where that is known."""

    @cached_property
    def engine(self) -> Any:
        """The mechanism as the engine reads it."""
        import hrsynth

        return hrsynth.load(self.path)

    @cached_property
    def robot(self) -> Robot:
        """The robot as read here."""
        return Robot.read(self.path)

    @cached_property
    def study(self) -> Study:
        """The robot under study."""
        return Study(self.robot, self.robot.point)

    @cached_property
    def walked(self) -> tuple[State, Array]:
        """Configurations to which small steps lead from zero, those that stayed on one sheet; how far the zero
        configuration's own ranks are clear."""
        at, good = self.study.walk(np.random.default_rng(self.seed), self.robot.zero(), 6, 14, 0.05)
        return at[good], good

    def observe(self) -> list[str] | None:
        """The legs that are watched: all of them (None), or some, at times so many as are needed."""
        count = len(self.robot.motors)
        if count < 3 or self.rng.random() < 0.4:
            return None
        if self.enough and self.rng.random() < 0.8:
            return list(self.enough[int(self.rng.integers(len(self.enough)))])
        some = 1 + self.rng.permutation(count)[: int(self.rng.integers((count + 1) // 2, count + 1))]
        return sorted(map(str, some))

    def say(self, claim: str, outcome: str, detail: str = "") -> None:
        """Note what was found of a claim."""
        self.found.append(Said(claim, outcome, detail))

    def asked(self, claim: str, question: Callable[[], Any]) -> Any:
        """The engine's answer; None where it refuses with a reason. Anything else that it raises is wrong."""
        from hrsynth.errors import HrsynthError

        try:
            return question()
        except HrsynthError as error:
            text = " ".join(error.lines()).replace(str(self.path), "")
            reason = re.sub(r"[-+]?\d[\d.e+-]*|'[^']*'|\"[^\"]*\"", "#", text)
            self.say(claim, REFUSED, f"{type(error).__name__}: {reason[-90:]}")
        except Exception as error:
            import traceback

            last = traceback.extract_tb(error.__traceback__)[-1]
            self.say(claim, WRONG, f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})")
        return None

    def directions(self, observed: Sequence[Any], robot: Robot | None = None) -> Items | None:
        """The observed directions as vectors fixed in links of the own reading; None where a link is not there, or the
        measurement is no direction."""
        given = []
        for each in observed:
            if type(each).__name__ != "Direction" or each.link not in self.robot.links or each.seen_from is not None:
                return None
            given.append((each.link, np.asarray(each.direction, dtype=float), False))
        return things(robot or self.robot, given)

    def fitted(self, configuration: Any) -> State | None:
        """The own configuration in which all links lie as in the engine's; None if there is none."""
        robot = self.robot
        names = [name for name in configuration.model.mechanism.links if name in robot.links and name != robot.links[0]]
        given, values = [], []
        for name in names:
            X = np.asarray(configuration.pose(name))
            given += [(name, np.zeros(3), True), *((name, e, False) for e in np.eye(3)[:2])]
            values += [X[:3, 3], X[:3, 0], X[:3, 1]]
        rows = robot.held(things(robot, given), np.array(values))
        first = aligned(robot, {name: configuration.pose(name) for name in names})
        at, residual = solve(robot, rows, first)
        if not residual.min() < 1e-7:  # links between three R that the engine takes for one S: anywhere
            starts = scattered(robot, self.rng, 96, first)
            for joint in robot.tree:
                if joint.kind in "RP" and {joint.before, joint.after} <= {robot.links[0], *names}:
                    starts.theta[:, joint.place] = first.theta[0, joint.place]
            at, residual = solve(robot, rows, starts)
        best = int(np.argmin(residual))
        if not residual[best] < 1e-7:
            return None
        at, residual = polished(robot, robot.loops, at[[best]])
        return at if residual[0] < 1e-9 else None  # the engine closes loops to 1e-10

    def text_of(self, at: State) -> str:
        """The platform's whole pose of a configuration as a user writes it."""
        x, R = (each[0] for each in self.study.poses(at))
        place = ",".join(f"{name}={float(v)!r}" for name, v in zip("xyz", x, strict=True))
        return place if self.robot.point is not None else f"{place},rpy={'/'.join(repr(float(a)) for a in rpy_of(R))}"


def aligned(robot: Robot, known: dict[str, Array]) -> State:
    """Coordinates read off from the poses (4, 4) of links, joint by joint from the base outward; of two R through a
    link that is not known the first turns the second one's axis to where the link after it has it."""
    at, ball, known = robot.zero(), 0, dict(known)
    for joint in reversed(robot.tree):
        if joint.kind == "F" and joint.after in known and joint.before not in known:
            X = np.eye(4)
            X[:3, :3] = known[joint.after][:3, :3] @ joint.R.T
            X[:3, 3] = known[joint.after][:3, 3] - X[:3, :3] @ joint.p
            known[joint.before] = X
    frames = {robot.links[0]: (np.eye(3), np.zeros(3))}
    after = {joint.before: joint for joint in robot.tree}
    for joint in robot.tree:
        R, p = frames[joint.before]
        R, p = R @ joint.R, R @ joint.p + p
        X = known.get(joint.after)
        if joint.kind == "R":
            pairs = [] if X is None else list(zip(R.T, X[:3, :3].T, strict=True))
            follows = after.get(joint.after)
            if X is None and follows is not None and follows.kind == "R" and follows.after in known:
                pairs = [(R @ follows.R @ follows.axis, known[follows.after][:3, :3] @ follows.axis)]
            a = R @ joint.axis
            sine = sum(float(a @ np.cross(u, v)) for u, v in pairs)
            cosine = sum(float(u @ v - (a @ u) * (a @ v)) for u, v in pairs)
            at.theta[0, joint.place] = np.arctan2(sine, cosine)
            R = R @ turn(joint.axis, float(at.theta[0, joint.place]))
        elif joint.kind == "P" and X is not None:
            at.theta[0, joint.place] = (R @ joint.axis) @ (X[:3, 3] - p)
            p = p + R @ joint.axis * at.theta[0, joint.place]
        elif joint.kind == "S":
            if X is not None:
                at.quats[0, ball] = quaternion(R.T @ X[:3, :3])
                R = X[:3, :3]
            ball += 1
        frames[joint.after] = (R, p) if X is None else (X[:3, :3], X[:3, 3])
    return at


def quaternion(R: Array) -> Array:
    """A unit quaternion (w, x, y, z) of a rotation, half turns included."""
    K = np.array([[1 + np.trace(R), R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]], *[[0.0] * 4] * 3])
    K[1:, 0] = K[0, 1:]
    K[1:, 1:] = R + R.T + (1 - np.trace(R)) * np.eye(3)
    best = K[int(np.argmax(np.diag(K)))]
    return best / np.linalg.norm(best)


def rpy_of(R: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw about fixed axes."""
    return (
        float(np.arctan2(R[2, 1], R[2, 2])),
        float(np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))),
        float(np.arctan2(R[1, 0], R[0, 0])),
    )


def matrix_of(pose: Any) -> tuple[Array, Array | None]:
    """Position (3,) and rotation (3, 3) of a pose that the engine tells (None of a point)."""
    x = np.array([pose.x, pose.y, pose.z], dtype=float)
    if pose.rpy is None:
        return x, None
    (cr, cp, cy), (sr, sp, sy) = np.cos(pose.rpy), np.sin(pose.rpy)
    return x, np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def apart(case: Case, pose: Any, at: State) -> float:
    """How far a told pose is from the platform's at a configuration: characteristic lengths, rotation matrices."""
    x, R = matrix_of(pose)
    here, turned = (each[0] for each in case.study.poses(at))
    away = float(np.max(np.abs(x - here))) / case.robot.length
    return away if R is None or case.robot.point is not None else max(away, float(np.max(np.abs(R - turned))))
