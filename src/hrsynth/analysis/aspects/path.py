"""Whether two poses lie in one aspect: joined by a certified path, separated by a proof, or undecided (theory 5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.parts import PlatformMotion
from ...kinematics.reach import reach
from ...mechanism import Mechanism
from ...mechanism.pose import Pose
from ...tolerances import RANK_CUTOFF, RANK_GAP
from ..controllability import verdict_of
from ..setting import Setting, prepare
from ..singularity.agreement import smallest_of
from ..singularity.condition import Condition, Named, condition
from ..singularity.structure import Structure, recognise
from .answer import SAME, SEPARATED, UNDECIDED, End, PathAnswer, between
from .carriage import carriages
from .itinerary import itinerary
from .pattern import NoChart, Pattern, pattern
from .plan import Region, plan
from .proof import Reading, enclosed, sign_of

BUDGET = 20_000
"""Intervals that are enclosed in all before a path is given up."""
CLEAR = RANK_CUTOFF * RANK_GAP
"""Values of a condition below this may be zero."""


@dataclass(frozen=True, eq=False)
class Aspects:
    """A robot with its Type 2 condition, ready to be asked for paths between configurations."""

    setting: Setting
    motion: PlatformMotion
    structure: Structure
    condition: Condition
    lost: tuple[str, ...]
    """Freedoms that are never seen: then every pose is singular."""

    @classmethod
    def of(cls, robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
           seed: int = 0) -> Aspects:
        """The condition of a robot from random samples of its motion."""
        setting = prepare(robot, observe, camera, seed=seed)
        samples = setting.samples
        members = [member.configuration for member in samples.members]
        structure = recognise(setting.anatomy, samples.question, members)
        verdict = verdict_of(setting, tuple(dict.fromkeys(o.leg for o in setting.observed)), samples)
        motion = PlatformMotion.of([samples.start, *members], samples.question)
        return cls(setting, motion, structure, condition(structure, samples.question),
                   tuple(freedom.name for freedom in verdict.lost))

    @property
    def members(self) -> list[ClosedConfiguration]:
        """The zero configuration and the samples."""
        samples = self.setting.samples
        return [samples.start, *(member.configuration for member in samples.members)]

    @cached_property
    def pattern(self) -> Pattern | str:
        """The forms of legs and vectors, or why there are none."""
        if not isinstance(self.condition, Named):
            return "the condition has no named vectors"
        used = {str(symbol) for symbol in self.condition.expression.free_symbols}
        features = [f for f in self.structure.features if not sign_of(self.condition) or f.symbol in used]
        reason = "the platform's pose has parts that depend on each other"
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
             progress: Callable[[], None] | None = None) -> PathAnswer:
        """Whether a path without Type 2 singularity joins two configurations."""
        found, scene = self.condition, self.structure.scene([start, goal])
        values = found.expressed(scene) if found.signed else smallest_of(found.rows(scene))
        ends = [End(self.motion.pose(at.pose(self.motion.link)), at, float(value))
                for at, value in zip((start, goal), values, strict=True)]
        answer = PathAnswer(self.setting, UNDECIDED, False, tuple(end.pose for end in ends), None, 0, ends[0], ends[1],
                            "", found.signed)
        if self.lost:
            return replace(answer, reason=f"every pose is singular, never seen: {'; '.join(self.lost)}")
        if min(abs(end.value) for end in ends) < CLEAR:
            return replace(answer, reason="a pose lies on the singular locus, or too near to it to be told apart")
        try:
            readings = [self.reading(end.configuration) for end in ends]
        except NoChart as why:
            return _pointwise(answer, str(why))
        return self._decided(answer, readings, seed, budget, progress)

    def _decided(self, answer: PathAnswer, readings: Sequence[Reading], seed: int, budget: int,
                 progress: Callable[[], None] | None) -> PathAnswer:
        """The verdict where poses decide what the legs do."""
        assert isinstance(self.pattern, Pattern)
        carriage = self.pattern.carriage
        p, R = carriage.of([answer.start.configuration, answer.goal.configuration, *self.members])
        sure, bounds = zip(*(enclosed(readings[i], p[i], R[i]) for i in range(2)), strict=True)
        margin = min(map(abs, bounds))
        if not all(sure) or margin == 0:
            return replace(answer, reason="at a pose reach or value cannot be enclosed away from zero")
        if readings[0].signed and bounds[0] * bounds[1] < 0:
            return replace(answer, verdict=SEPARATED, certified=True, margin=margin, boxes=2, reason=(
                "the expression is enclosed with opposite signs at the two configurations: every path between them "
                "crosses its zeros"))
        if answer.signed and answer.start.value * answer.goal.value < 0:
            return _pointwise(answer, "its sign is that of a determinant")
        modes = [reading.chart.modes for reading in readings]
        region, places = Region.around(carriage, p, R), ((p[0], R[0]), (p[1], R[1]))
        if modes[0] == modes[1]:
            found = plan(readings[0], region, *places, seed=seed, budget=budget, progress=progress)
        else:
            legs = dict.fromkeys(limb.leg for limb, a, b in zip(self.pattern.limbs, *modes, strict=True) if a != b)
            through = itinerary((readings[0], readings[1]), region, *places, seed=seed, budget=budget,
                                progress=progress)
            if through is None:
                return replace(answer, reason=(f"no path was proved: leg {', '.join(legs)} is in different working "
                                               "modes at the two poses"))
            found = through
        answer = replace(answer, carriage=carriage, ways=found.ways, boxes=found.boxes,
                         poses=(answer.start.pose, *between(answer, carriage, found.ways), answer.goal.pose))
        if not found.proved:
            used = ("the intervals allowed are used up" if found.boxes >= budget
                    else "the road map does not join the poses")
            return replace(answer, reason=f"no path was proved: {used}; the path shown is proved but for its last part")
        return replace(answer, verdict=SAME, certified=True, margin=found.margin, reason=(
            "the condition and the reach of all legs are enclosed away from zero along the path"))


def path(robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
         start: Pose | str, goal: Pose | str, seed: int = 0, budget: int = BUDGET,
         progress: Callable[[str], None] | None = None) -> PathAnswer:
    """Whether a path without Type 2 singularity of the hidden robot joins two poses (theory 5, aspects).

    Both are reached from the zero configuration in its working mode. A certificate encloses, by interval arithmetic,
    the condition's value away from zero and the reach of every leg all along the path, for all poses within
    ``tolerances.FOLLOWED`` of it; opposite signs of an expression at the two ends separate them. At most ``budget``
    intervals are tried. ``observe`` and ``camera`` as for ``derive``.

    Raises ``BadRequest`` for names and parts of a pose that there are not, ``PoseNotReached``.
    """
    wanted = [Pose.parse(each) if isinstance(each, str) else each for each in (start, goal)]

    def tell(text: str) -> None:
        if progress is not None:
            progress(text)

    tell("sampling")
    aspects = Aspects.of(robot, observe, camera, seed=seed)
    samples = aspects.setting.samples
    tell("poses")
    ends = [reach(samples.start, samples.question, pose, aspects.motion) for pose in wanted]
    return aspects.join(*ends, seed=seed, budget=budget, progress=lambda: tell("road map"))


def _pointwise(answer: PathAnswer, why: str) -> PathAnswer:
    """What the two configurations alone tell: a continuous expression of opposite signs separates them."""
    ends = answer.start.value, answer.goal.value
    if answer.signed and ends[0] * ends[1] < 0:
        return replace(answer, verdict=SEPARATED, margin=min(map(abs, ends)), reason=(
            "the expression has opposite signs at the two configurations, every path between them crosses its zeros; "
            f"not certified by intervals: {why}"))
    return replace(answer, reason=f"no path can be certified: {why}")
