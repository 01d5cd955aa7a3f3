"""Completeness of a list of equilibria: proved by boxes of platform poses (:mod:`.cover`)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...analysis.observed import ObservedRobot
from ...equations.measured_error import ErrorSystem
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.locked_twists import compute_leg_twists
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism.pose import Pose
from ...progress import report_part
from ...results import Value
from ...tolerances import SLIDING_ROD_LENGTH_MIN
from ..law import directions
from .critical_poses import CriticalPoses, PoseToJoints
from .descent import descend, sharpen_points
from .equilibrium import (
    SADDLE,
    STABLE,
    UNDECIDED,
    UNSTABLE,
    CompletenessReport,
    Equilibrium,
    ProvedCriticalPoint,
    SignedModes,
)
from .exhaustive_search import POSITION_BOX_HALF_WIDTH_FRACTION, SubdivisionResult, cover
from .search import CountedCriticalPoint
from .subdivision import CriticalBox

ZERO_ERROR_BOXES_MAX = 80_000
"""Largest number of boxes of poses of three dof in the proof of all zeros of the error; with more dof only on
request."""
REVERSED_LEG_CHOICES_MAX = 64
"""Largest number of choices of reversed legs reported one by one."""

CLOSURE_START_COORDINATES_MAX = 3000
"""Coordinates that are scattered where the robot is to be closed at proved poses, at most."""


@dataclass(frozen=True, eq=False, repr=False)
class CompletenessProof(Value):
    """Boxes of platform poses: those at which the error vanishes, and all critical points (None if not requested)."""

    system: ErrorSystem
    setup: ObservedRobot
    vanishing: SubdivisionResult
    every: SubdivisionResult | None

    @property
    def observation_model(self) -> ObservationModel:
        """Observation model of the loop."""
        return self.setup.samples.observation_model

    @classmethod
    def of(
        cls, setup: ObservedRobot, goal: ClosedConfiguration, system: ErrorSystem, boxes: int | None, jobs: int
    ) -> CompletenessProof:
        """Subdivide the poses of a goal; for all critical points into ``boxes`` at most, if given, by ``jobs``
        processes."""
        with report_part("poses with zero error"):
            found = cover(setup, goal, vanishing=True, budget=boxes or ZERO_ERROR_BOXES_MAX, jobs=jobs)
        if boxes is None:
            return cls(system, setup, found, None)
        with report_part("all equilibria"):
            return cls(system, setup, found, cover(setup, goal, budget=boxes, jobs=jobs))

    def find_missed(
        self, known: Sequence[ClosedConfiguration], q: Array, idle: int, turn: int = 0
    ) -> list[CountedCriticalPoint]:
        """The proved critical points that none of the configurations (with coordinates q (c, N)) is at, as far as the
        robot is closed there, from these and (of each ``turn`` but the first) from coordinates scattered about them."""
        found: list[CountedCriticalPoint] = []
        if turn:
            some = np.resize(q, (min(CLOSURE_START_COORDINATES_MAX, 10 * len(q)), q.shape[1]))
            q = np.concatenate([q, some + np.random.default_rng(turn).normal(size=some.shape)])
        seen = [directions(at, self.observation_model)[0] for at in known]
        for each in (self.vanishing, self.every):
            if each is None or each.error is None or each.error.coordinates is None or not known:
                continue
            met = {each.place(at, u) for at, u in zip(known, seen, strict=True)}
            left = [box for k, box in enumerate(each.found) if k not in met]
            if left:
                falling = np.array([box.falling or 0 for box in left])
                poses = CriticalPoses(
                    np.array([box.p for box in left]),
                    np.array([box.R for box in left]),
                    np.array([box.directions for box in left]),
                    falling,
                    0 * falling,
                )
                start, done = PoseToJoints(self.system, self.observation_model.observations, each.error)(poses, q)
                points = descend(self.system, start[done], falling[done], idle, np.inf)
                found += [CountedCriticalPoint(point, 0) for point in sharpen_points(self.system, points, idle)]
        return found

    def complete_signs(self, lists: Sequence[SignedModes], desired: Array) -> list[SignedModes]:
        """The lists of modes with what boxes prove, and those of all other choices of signs."""
        labels = [each.leg for each in self.observation_model.observations]
        if 2 ** len(labels) > REVERSED_LEG_CHOICES_MAX:
            return list(lists)
        known = self.vanishing
        counts: Counter[tuple[str, ...]] | None = None
        if known.is_complete and known.bounded and not known.locked:
            counts = Counter(
                tuple(leg for leg, u, w in zip(labels, each.directions, desired, strict=True) if u @ w < 0)
                for each in known.found
            )
        met = {each.reversed: each for each in lists}
        every = [
            tuple(leg for leg, sign in zip(labels, signs, strict=True) if sign)
            for signs in product((False, True), repeat=len(labels))
        ]
        return [
            SignedModes(
                each,
                met[each].listed if each in met else None,
                None if counts is None else counts[each],
                len(known.turns),
            )
            for each in sorted(every, key=lambda each: each not in met)
        ]

    def is_isolated(self, rest: Equilibrium) -> bool:
        """Return True if boxes prove that an equilibrium is isolated, though E is nearly flat there."""
        told, u = self.every, directions(rest.configuration, self.observation_model)[0]
        return told is not None and told.place(rest.configuration, u) is not None

    def judge(self, rests: Sequence[Equilibrium]) -> CompletenessReport | None:
        """Compare the equilibria with the critical points that boxes prove; None without boxes."""
        if self.every is None:
            return None
        told = self.every
        places = [
            told.place(each.configuration, directions(each.configuration, self.observation_model)[0]) for each in rests
        ]
        held = [
            told.has_searched(each.configuration)
            and (told.loop is None or len(each.orthogonal_legs) < told.loop.flat)
            and not self._is_leg_locked(told.unread, each.configuration)
            for each, place in zip(rests, places, strict=True)
            if place is None
        ]
        within = None if told.bounded or told.error is None else POSITION_BOX_HALF_WIDTH_FRACTION * told.error.length
        shorter = SLIDING_ROD_LENGTH_MIN * told.error.length if told.short and told.error is not None else None
        alone = tuple(self._alone(told, each) for k, each in enumerate(told.found) if k not in places)
        return CompletenessReport(
            told,
            alone,
            sum(held),
            within,
            shorter,
            sum(told.is_turned(each.configuration) for each in rests),
            len(held) - sum(held),
        )

    def _is_leg_locked(self, labels: Sequence[str], at: ClosedConfiguration) -> bool:
        """Return True if the joints of a leg lock: they move its end in fewer directions than at the zero
        configuration."""
        start, base = self.setup.all_samples.start, self.setup.mechanism.base
        return any(
            compute_leg_twists(at, leg, (), base).shape[1] < compute_leg_twists(start, leg, (), base).shape[1]
            for leg in self.setup.decomposition.legs
            if leg.label in labels
        )

    def _alone(self, told: SubdivisionResult, box: CriticalBox) -> ProvedCriticalPoint:
        """Return a critical point that is no equilibrium of the list."""
        error = told.error
        assert error is not None
        seen = error.coordinates
        assert seen is not None
        X, motion = seen.frame(box.p / seen.length, box.R if seen.turning else np.eye(3)), self.setup.motion
        pose = motion.pose(X) if seen.turning else Pose.of(X, seen.motion.point)
        state = {None: UNDECIDED, 0: STABLE, error.size: UNSTABLE}.get(box.falling, SADDLE)
        return ProvedCriticalPoint(pose, state, box.error)
