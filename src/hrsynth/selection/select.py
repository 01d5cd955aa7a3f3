"""Which legs to watch for one displacement (MMT A.2): all sets, ranked by the accuracy at the goal."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..analysis.accuracy.accuracy import errors_at
from ..analysis.accuracy.cones import Cones, half_angles
from ..analysis.aspects.answer import SEPARATED
from ..analysis.aspects.path import Aspects
from ..analysis.controllability import CONTROLLABLE, verdict_of
from ..analysis.modes.modes import modes_at
from ..analysis.observed import ObservedRobot, prepare, silent
from ..analysis.posture import Examiner
from ..batch.reach import reach
from ..budgets import AXIS_SEEN
from ..errors import BadRequest, HrsynthError, PoseNotReached
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Mechanism
from ..mechanism.observation import Direction
from ..mechanism.pose import Pose
from ..results import Result
from ..simulation.camera import cylinders, placed
from ..simulation.ending import GOAL
from ..simulation.servo import servo
from .candidate import Candidate, Decision, Modes, singular_at
from .sight import Sight, camera_at, of_focal

SIZE = 4
"""Legs of the largest sets."""
RUNS = 3
"""Sets that a simulated run is to lead to the goal."""
EXAMINED = 20
"""Sets, the most accurate first, that are examined."""
BUDGET = 2_000
"""Intervals that a path's certificate may take."""
CONE = "0.1deg"
FOCAL = 800.0
"""Focal length of the camera (pixels)."""
AUTO = "auto"


@dataclass(frozen=True, eq=False, repr=False)
class Selection(Result, shown_as="select"):
    """All sets of legs up to a size for one displacement: the kept ones, those not examined, the most accurate at the
    goal before the others in both, then the discarded ones."""

    setting: ObservedRobot
    start: Pose
    goal: Pose
    candidates: tuple[Candidate, ...]
    cones: Array
    """Half-angles (rad) of all legs' cones."""
    sight: Sight | None
    left: str | None
    """Why sets were not examined, None where all were."""

    def headline(self) -> str:
        """The robot, and the set that is best."""
        best = f"best {', '.join(self.kept[0].legs)}" if self.kept else "none is kept"
        more = f", {len(self.unexamined)} not examined" if self.unexamined else ""
        return f"{self.setting.robot.name}: {len(self.candidates)} sets, {len(self.kept)} kept{more}, {best}"

    @property
    def kept(self) -> tuple[Candidate, ...]:
        """The sets that were examined and not discarded."""
        return tuple(each for each in self.candidates if each.examined and each.discarded is None)

    @property
    def unexamined(self) -> tuple[Candidate, ...]:
        """The sets of which it is not known whether they would be kept."""
        return tuple(each for each in self.candidates if not each.examined)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        best = next(iter(self.kept), None)
        eye = self.sight
        camera = None if eye is None else {"link": eye.reference, "pose": eye.camera.place.tolist(),
                                           "focal": eye.camera.focal}
        return {"from": self.start.to_dict(), "to": self.goal.to_dict(), "camera": self.setting.mechanism.reference,
                "cones": {o.leg: float(np.degrees(cone))
                          for o, cone in zip(self.setting.observed, self.cones, strict=True)},
                "sight": camera, "best": None if best is None else list(best.legs),
                "not_examined": {"count": len(self.unexamined), "reason": self.left},
                "sets": [each.to_dict() for each in self.candidates]}


def select(robot: Mechanism, camera: str | None = None, *, start: Pose | str, goal: Pose | str, cones: Cones = CONE,
           size: int = SIZE, runs: int = RUNS, sight: str | None = None, focal: float = FOCAL,
           examine: int = EXAMINED, seconds: float | None = None, seed: int = 0,
           progress: Callable[[str], None] | None = None) -> Selection:
    """All sets of up to ``size`` legs for the displacement from ``start`` to ``goal``, ranked by the largest position
    error at the goal for ``cones`` about the directions (MMT A.2).

    A set is discarded where it does not see every freedom, where an end is singular, where a camera (``sight``: its
    pose on the link that carries it, or ``auto`` for one that sees all legs well) sees too little of a leg, where start
    and goal are proved to lie in different aspects, and where a simulated run ends elsewhere. Modes and aspects are
    asked for the ``examine`` most accurate sets, the others are neither kept nor discarded. Runs are made from the best
    set on, until ``runs`` of them ended at the goal. With ``seconds`` (deprecated: what is examined then depends on the
    machine) no further set is begun after that time.

    Raises ``BadRequest``, ``PoseNotReached`` (exit status 2).
    """
    wanted = [Pose.parse(each) if isinstance(each, str) else each for each in (start, goal)]
    if sight is None and focal != FOCAL:
        raise BadRequest("focal length without a camera", focal, "together with --sight")
    for what, value, least in (("legs of the largest sets", size, 1), ("number of runs", runs, 0),
                               ("sets that are examined", examine, 1)):
        if value < least:
            raise BadRequest(what, value, f"at least {least}")
    if seconds is not None and not seconds > 0:
        raise BadRequest("seconds", seconds, "a positive number")
    tell = progress or silent
    tell("sampling")
    setting = prepare(robot, None, camera, seed=seed)
    directions = tuple(o for o in setting.segments if isinstance(o, Direction))
    setting = replace(setting, observed=directions)
    half = half_angles(cones, directions)
    everything = setting.everything
    try:
        ends = [reach(everything.start, everything.question, pose, setting.motion) for pose in wanted]
    except PoseNotReached as error:
        error.exit_status = 2
        raise
    work = _Work(setting, ends[0], ends[1], half, _sight(setting, ends, sight, focal),
                 np.inf if seconds is None else time.monotonic() + seconds, seed, tell)
    sets = [legs for count in range(1, min(size, len(directions)) + 1) for legs in combinations(directions, count)]
    found = sorted((work.first(legs) for legs in sets), key=lambda each: each.order)
    found, left = work.examined(found, runs, examine)
    found.sort(key=lambda each: (each.discarded is not None, not each.examined,
                                 each.order if each.discarded is None else (0, 0, 0)))
    poses = [setting.motion.pose(at.pose(setting.motion.link)) for at in ends]
    return Selection(setting, poses[0], poses[1], tuple(found), half, work.sight, left)


def _sight(setting: ObservedRobot, ends: Sequence[ClosedConfiguration], text: str | None, focal: float) -> Sight | None:
    if text is None:
        return None
    rods = cylinders(setting.mechanism, setting.observed)
    reference = setting.mechanism.reference
    camera = (placed(rods, reference, [at.pose for at in ends], of_focal(focal)) if text == AUTO
              else camera_at(text, focal))
    return Sight(camera, reference, {o.leg: rod for o, rod in zip(setting.observed, rods, strict=True)})


@dataclass(frozen=True, eq=False)
class _Work:
    """What examines sets of legs between two configurations; none is begun after a point in time."""

    setting: ObservedRobot
    start: ClosedConfiguration
    goal: ClosedConfiguration
    cones: Array
    sight: Sight | None
    until: float
    seed: int
    tell: Callable[[str], None]

    @property
    def over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.until

    def watching(self, legs: Sequence[str]) -> ObservedRobot:
        """The setting with some legs watched."""
        return replace(self.setting, observed=tuple(o for o in self.setting.observed if o.leg in legs))

    def first(self, observations: Sequence[Direction]) -> Candidate:
        """What is quickly said of a set: verdict, singular ends, sight, accuracy."""
        self.tell("sets of legs")
        legs = tuple(o.leg for o in observations)
        setting = self.watching(legs)
        try:
            verdict = verdict_of(setting, legs, setting.samples)
            if verdict.verdict != CONTROLLABLE:
                lost = "; ".join(freedom.name for freedom in verdict.lost)
                return Candidate(legs, verdict.verdict, f"{verdict.verdict}, not seen: {lost}")
            examiner = Examiner(setting)
            reasons = [singular_at(name, examiner.glance(at))
                       for name, at in (("start", self.start), ("goal", self.goal))]
        except HrsynthError as error:
            return Candidate(legs, "undecided", str(error))
        cones = np.array([cone for o, cone in zip(self.setting.observed, self.cones, strict=True) if o.leg in legs])
        found = Candidate(legs, verdict.verdict, next((reason for reason in reasons if reason), None),
                          errors_at(setting, cones, self.goal))
        return self.looked(found, (self.start, self.goal))

    def looked(self, candidate: Candidate, configurations: Sequence[ClosedConfiguration]) -> Candidate:
        """The candidate with what the camera sees of its legs."""
        if self.sight is None or candidate.discarded:
            return candidate
        least = self.sight.least(configurations)
        seen = {leg: least[leg] for leg in candidate.legs}
        worst = min(seen, key=lambda leg: seen[leg])
        why = None if seen[worst] >= AXIS_SEEN else f"the camera sees {100 * seen[worst]:.0f} % of leg {worst}"
        return replace(candidate, seen=seen, discarded=why)

    def decided(self, candidate: Candidate) -> Candidate:
        """The candidate with its modes and whether start and goal lie in one aspect."""
        if candidate.discarded:
            return candidate
        setting = self.watching(candidate.legs)
        self.tell("modes")
        start_modes, goal_modes = self._modes(setting, self.start), self._modes(setting, self.goal)
        self.tell("aspects")
        try:
            answer = Aspects.about(setting).join(self.start, self.goal, seed=self.seed, budget=BUDGET,
                                                 progress=lambda: self.tell("aspects"))
            aspect = Decision(answer.verdict, answer.reason)
        except HrsynthError as error:
            aspect = Decision("undecided", str(error))
        why = f"start and goal lie in different aspects: {aspect.reason}" if aspect.verdict == SEPARATED else None
        return replace(candidate, start_modes=start_modes, goal_modes=goal_modes, aspect=aspect, discarded=why)

    @staticmethod
    def _modes(setting: ObservedRobot, at: ClosedConfiguration) -> Modes:
        try:
            return Modes.of(modes_at(setting, at))
        except HrsynthError as error:
            return Modes(None, None, False, str(error))

    def examined(self, candidates: Sequence[Candidate], runs: int, most: int) -> tuple[list[Candidate], str | None]:
        """The candidates, best first, the ``most`` first that are not discarded with their modes and aspects, and with
        simulated runs until ``runs`` of them ended at the goal; why the others were left, None where there are none."""
        found: list[Candidate] = []
        arrived = begun = 0
        left = None
        for candidate in candidates:
            if candidate.discarded:
                found.append(candidate)
                continue
            if left is None and (begun == most or self.over):
                left = f"the {begun} most accurate were" if begun == most else (
                    f"the time was over after the {begun} most accurate, on a faster machine there would be more")
            if left is not None:
                found.append(replace(candidate, examined=False))
                continue
            begun += 1
            candidate = self.decided(candidate)
            if not candidate.discarded and arrived < runs:
                self.tell("runs")
                candidate = self.ran(candidate)
                arrived += candidate.discarded is None
            found.append(candidate)
        return found, left

    def ran(self, candidate: Candidate) -> Candidate:
        """The candidate with where its simulated run ends, and what the camera sees along it."""
        motion, mechanism = self.setting.motion, self.setting.mechanism
        start, goal = (motion.pose(at.pose(motion.link)) for at in (self.start, self.goal))
        camera = None if mechanism.reference == mechanism.base else mechanism.reference
        try:
            found = servo(self.setting.robot, candidate.legs, camera, start=start, goal=goal, seed=self.seed)
        except HrsynthError as error:
            return replace(candidate, run=Decision("refused", str(error)), discarded=f"the run is refused: {error}")
        run = Decision(found.ended, found.ending.reason)
        if found.ended != GOAL:
            return replace(candidate, run=run, discarded=f"the simulated run ends in: {found.ended} ({run.reason})")
        return self.looked(replace(candidate, run=run), found.run.configurations)
