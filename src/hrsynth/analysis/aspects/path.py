"""Whether two poses lie in one aspect: joined by a certified path, separated by a proof, or undecided (theory.md 9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...batch.reach import reach
from ...constraints.condition import Condition, Named
from ...constraints.pattern import ConstraintPattern
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism import Mechanism
from ...mechanism.pose import Pose
from ...progress import tell
from ...tolerances import RANK_CUTOFF, RANK_GAP, SOLVED
from ..measured import MeasuredRobot
from ..observed import ObservedRobot
from ..singularity.agreement import smallest_of
from .answer import SAME, SEPARATED, UNDECIDED, End, PathAnswer, between
from .carriage import Place, carriages
from .crossing import Crossing
from .pattern import Pattern, pattern
from .plan import Plan, plan
from .proof import Reading, Way, enclosed, sign_of
from .region import Region
from .sources import NoChart

BUDGET = 10_000
"""Intervals that are enclosed in all before a path is given up."""
CLEAR = RANK_CUTOFF * RANK_GAP
"""Values of a condition below this may be zero."""


@dataclass(frozen=True, eq=False)
class Aspects:
    """A robot with its Type 2 condition, ready to be asked for paths between configurations."""

    setting: ObservedRobot
    motion: PlatformMotion
    structure: ConstraintPattern
    condition: Condition
    lost: tuple[str, ...]
    """Freedoms that are never seen: then every pose is singular."""

    @classmethod
    def of(cls, robot: Mechanism | ObservedRobot, observe: Sequence[str] | str | None = None, camera: str | None = None,
           *, seed: int = 0) -> Aspects:
        """The condition of a robot from random samples of its motion."""
        setting = ObservedRobot.of(robot, observe, camera, seed=seed)
        seen = MeasuredRobot.watched(setting)
        return cls(setting, setting.motion, seen.pattern, seen.condition,
                   tuple(freedom.name for freedom in seen.verdict.lost))

    about = of

    @property
    def members(self) -> list[ClosedConfiguration]:
        """The zero configuration and the samples."""
        return [self.setting.everything.start, *self.setting.configurations]

    @cached_property
    def pattern(self) -> Pattern | str:
        """The forms of legs and vectors, or why there are none."""
        if not isinstance(self.condition, Named):
            return "the condition has no named vectors"
        used = {str(symbol) for symbol in self.condition.expression.free_symbols}
        features = [f for f in self.structure.features if not sign_of(self.condition) or f.symbol in used]
        many = self.motion.translations.shape[1] + self.motion.rotations.shape[1]
        reason = (f"the {many} parts of the platform's pose that change depend on each other, {self.setting.dof} are "
                  "free: ways that move a point straight and turn about one axis do not keep to the others")
        for each in carriages(self.setting.anatomy, self.setting.samples.question, self.setting.dof, self.members):
            try:
                return pattern(self.setting.anatomy, features, each, self.members)
            except NoChart as why:
                reason = str(why)
        return reason

    def reading(self, at: ClosedConfiguration) -> Reading:
        """The condition as a function of the pose, in the working mode of a configuration; raises ``NoChart``."""
        if isinstance(self.pattern, str) or not isinstance(self.condition, Named):
            raise NoChart(str(self.pattern))
        return Reading(self.condition, self.pattern.chart(at))

    def join(self, start: ClosedConfiguration, goal: ClosedConfiguration, *, seed: int = 0, budget: int = BUDGET,
             progress: Any = None) -> PathAnswer:
        """Whether a path without Type 2 singularity joins two configurations."""
        found, scene = self.condition, self.structure.values_at([start, goal])
        values = found.expressed(scene) if found.signed else smallest_of(found.rows(scene))
        ends = [End(self.motion.pose(at.pose(self.motion.link)), at, float(value))
                for at, value in zip((start, goal), values, strict=True)]
        answer = PathAnswer(self.setting, UNDECIDED, False, tuple(end.pose for end in ends), None, 0, ends[0], ends[1],
                            "", found.signed)
        if self.lost:
            return replace(answer, reason=f"every pose is singular, never seen: {'; '.join(self.lost)}")
        if min(abs(end.value) for end in ends) < CLEAR:
            return replace(answer, reason="a pose lies on the singular locus, or too near to it to be distinguished")
        try:
            readings = [self.reading(end.configuration) for end in ends]
        except NoChart as why:
            return _pointwise(answer, str(why))
        return self._decided(answer, readings, seed, budget)

    def _decided(self, answer: PathAnswer, readings: Sequence[Reading], seed: int, budget: int) -> PathAnswer:
        """The verdict where poses decide what the legs do."""
        assert isinstance(self.pattern, Pattern)
        carriage = self.pattern.carriage
        p, R = carriage.of([answer.start.configuration, answer.goal.configuration, *self.members])
        sure, values = zip(*(enclosed(readings[i].unlimited, p[i], R[i]) for i in range(2)), strict=True)
        margin = min(map(abs, values))
        fitted = self.pattern.fitted
        forms = f", for forms that are fitted to samples: {', '.join(fitted)}" if fitted else ""
        if not all(sure) or margin == 0:
            return replace(answer, reason="at a pose reach or value cannot be enclosed away from zero")
        if readings[0].signed and values[0] * values[1] < 0:
            return replace(answer, verdict=SEPARATED, certified=not fitted, margin=margin, boxes=2, reason=(
                "the expression is enclosed with opposite signs at the two configurations: every path between them "
                f"crosses its zeros{forms}"))
        if answer.signed and answer.start.value * answer.goal.value < 0:
            return _pointwise(answer, "its sign is that of a determinant")
        for end, reading, place, turn in zip(("start", "goal"), readings, p, R, strict=False):
            beyond = reading.chart.beyond(place, turn)
            if beyond:
                return replace(answer, reason=f"at the {end} beyond its limits: joint {', '.join(beyond)}")
        found = plan((readings[0], readings[1]), Region.around(carriage, p, R), (p[0], R[0]), (p[1], R[1]), seed=seed,
                     budget=budget)
        answer = self._shown(answer, found, self.pattern)
        if not found.proved:
            return replace(answer, reason=_unproved(found, readings, budget))
        if not leads(found.ways, (p[0], R[0]), (p[1], R[1]), readings):
            return replace(answer, reason="no path was proved: what was found does not lead from pose to pose")
        return replace(answer, verdict=SAME, certified=not fitted, margin=found.margin, reason=(
            f"the condition and the reach of all legs are enclosed away from zero along the path{forms}"))

    def _shown(self, answer: PathAnswer, found: Plan, known: Pattern) -> PathAnswer:
        """The answer with a plan's ways, and the joints whose limits these keep."""
        kept = tuple(bound.joint for bound in known.bounds)
        answer = replace(answer, boxes=found.boxes, limits=kept,
                         unlimited=(*(name for name in self.setting.robot.limited if name not in kept),
                                    *self.setting.mechanism.wrists))
        if not found.ways:
            return answer
        poses = answer.start.pose, *between(answer, known.carriage, found.ways), answer.goal.pose
        return replace(answer, carriage=known.carriage, ways=found.ways, poses=poses)


def path(robot: Mechanism | ObservedRobot, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
         start: Pose | str, goal: Pose | str, seed: int = 0, budget: int = BUDGET) -> PathAnswer:
    """Whether a path without Type 2 singularity of the hidden robot joins two poses (docs/pages/theory.md, section 9).

    Both are reached from the zero configuration in its working mode; on the way legs may pass their limits into other
    working modes (Type 1). A certificate encloses, by interval arithmetic, the condition's value away from zero, the
    reach of every leg and the limits of R and P joints all along the path, for all poses within
    ``tolerances.FOLLOWED`` of it; opposite signs of an expression at the two ends separate them. At most ``budget``
    intervals are tried. ``observe`` and ``camera`` as for ``derive``.

    Raises ``BadRequest`` for names and parts of a pose that there are not, ``PoseNotReached``.
    """
    wanted = [Pose.parse(each) if isinstance(each, str) else each for each in (start, goal)]
    aspects = Aspects.of(robot, observe, camera, seed=seed)
    samples = aspects.setting.samples
    tell("poses")
    ends = [reach(samples.start, samples.question, pose, aspects.motion) for pose in wanted]
    return aspects.join(*ends, seed=seed, budget=budget)


def leads(ways: Sequence[Way], start: Place, goal: Place, readings: Sequence[Reading]) -> bool:
    """Whether ways lead from pose to pose and from working mode to working mode without a gap."""
    here, modes = start, list(readings[0].chart.modes)
    for way in ways:
        if _gap(here, (way.p, way.R)) > SOLVED:
            return False
        here = way.end
        if isinstance(way, Crossing):
            modes[way.limb] *= -1
    return _gap(here, goal) <= SOLVED and tuple(modes) == readings[1].chart.modes


def _gap(one: Place, other: Place) -> float:
    return max(float(np.max(np.abs(a - b))) for a, b in zip(one, other, strict=True))


def _unproved(found: Plan, readings: Sequence[Reading], budget: int) -> str:
    """Why a plan decides nothing."""
    used = "the number of intervals is used up" if found.boxes >= budget else "the road map does not join the poses"
    if found.ways:
        return f"no path was proved: {used}; the path shown is proved except for its last part"
    pairs = zip(*(reading.chart.limbs for reading in readings), strict=True)
    legs = dict.fromkeys(one.leg for one, other in pairs if one.branch != other.branch)
    return f"no path was proved: {used}; leg {', '.join(legs)} is in different working modes at the two poses"


def _pointwise(answer: PathAnswer, why: str) -> PathAnswer:
    """What the two configurations alone tell: a continuous expression of opposite signs separates them."""
    ends = answer.start.value, answer.goal.value
    if answer.signed and ends[0] * ends[1] < 0:
        return replace(answer, verdict=SEPARATED, margin=min(map(abs, ends)), reason=(
            "the expression has opposite signs at the two configurations, every path between them crosses its zeros; "
            f"not certified by intervals: {why}"))
    return replace(answer, reason=f"no path can be certified: {why}")
