"""Equilibria of the servo loop: the goal, its assembly modes, antipodal poses, and nonzero-error equilibria; which of
them are stable (docs/pages/proofs.md, section 11)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ...analysis.analysis_declaration import analysis
from ...analysis.aspects.leg_forms import LegPattern, build_leg_pattern
from ...analysis.aspects.path import CLEAR
from ...analysis.aspects.path_segments import list_path_coordinates
from ...analysis.aspects.vector_expressions import NoLegForm
from ...analysis.configuration_report import ConfigurationAnalysis
from ...analysis.measured import MeasuredRobot
from ...analysis.modes.modes import AssemblyModes, modes
from ...analysis.observation_inputs import CameraLike, Jobs, LegsLike, Seed, SensorLike
from ...analysis.observed import ObservedRobot, RobotLike
from ...analysis.pose_requests import solve_configurations
from ...constraints.condition import Condition
from ...constraints.pattern import ConstraintPattern, list_placing_links
from ...equations.carried_vectors import SweptChains
from ...equations.measured_error import ErrorSystem
from ...errors import HrsynthError, LoopClosureFailure
from ...geometry.affine import make_affine
from ...geometry.vectors import Array, compare_poses, sort_rows, transform
from ...kinematics.assembly import build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import list_joints_beyond
from ...mechanism.observations.direction import SeenAxis
from ...mechanism.pose import PoseLike, parse_pose
from ...options import option
from ...progress import report
from ...tolerances import CONTROLLER_DAMPING_MIN, CRITICAL_POINT_DISTANCE_TOL, SUBDIVISION_BOXES_MAX, VISIBLE_SINE_MIN
from ..law import Depth, FixedDirections, Law, Measures, measure_all, supposed_planes
from ..outcome import ANTIPODAL, BOUNDARY, GOAL, MODE, rest
from ..servo import require_regular, require_seen, require_sight
from .completeness import CompletenessProof
from .critical_poses import PoseToJoints, WidenedSearch, critical_poses
from .descent import CRITICAL_CURVATURE_TOL, descend, walk_at_random
from .enclosure import EnclosedPoint, enclose_points
from .equilibrium import CRITICAL, Equilibria, Equilibrium, SignedModes, stability
from .search import CountedCriticalPoint, critical_points, in_mode

ZERO_ERROR_TOL = 1e-8
"""‖e‖ below which it vanishes at a critical point; cosine below which two directions are perpendicular."""

PROVED_POSE_ROUNDS_COUNT = 3
"""Rounds in which it is tried to close the robot at the proved poses that are not in the list."""
MODE_WALKS_MAX = 4
"""Walks from an equilibrium that are tried to determine its operation mode."""
MODE_WALK_FIRST_STEP_FRACTION = 0.02
"""Step (characteristic lengths, radians) of the first of these walks."""


@analysis(
    110,
    examples=(
        "3rrr_m1 --goal x=0.02,y=0,phi=10deg",
        "quattro --observe 1,4 --goal x=0.05,y=0.1,z=-0.7 -o equilibria.png",
    ),
)
def equilibria(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    goal: Annotated[
        PoseLike | None,
        option(
            "Pose whose measured values are desired, such as x=0.02,y=0.1,z=-0.7; or mode:2 "
            "(default: the zero configuration).",
            "POSE",
        ),
    ] = None,
    depth: Depth = "exact",
    complete: Annotated[bool, option("Try to prove that the list is complete, by boxes of platform poses.")] = False,
    max_boxes: Annotated[
        int, option("Largest number of pose boxes (10,000 to 40,000 take a second).", "COUNT", low=1)
    ] = SUBDIVISION_BOXES_MAX,
    jobs: Jobs = None,
    seed: Seed = 0,
) -> Equilibria:
    """Equilibria of the servo loop and their stability: the goal, its assembly modes, antipodal poses, and
    nonzero-error equilibria.

    Parameters
    ----------
    robot
        Robot, file or name.
    observe, camera, sensor
        Observations, as for ``derive``; each kind of observation has its own error.
    goal
        Pose whose measured values are desired (m, rad, in the base frame; default: the zero configuration).
    depth
        Depth of image features that the law assumes, as for ``servo``. If it assumes one, its command is not a
        gradient, and equilibria are found, not proved.
    complete
        Try to prove that the list is complete, by subdivision of a box of platform poses (seconds to minutes).
    max_boxes
        Largest number of boxes of that subdivision.
    jobs
        Number of processes, by default one per core; the result does not depend on it.
    seed
        Seed of samples and starts.

    Returns
    -------
    Equilibria
        Equilibria with their stability, and the proof of completeness, if requested.

    Raises
    ------
    BadRequest
        Unknown name, a platform dof that is not observed, a singular goal, or a feature behind its camera.
    PoseReachFailure
        The goal is out of reach.

    Notes
    -----
    The equilibria of the law are exactly the critical points of ½ ‖e‖² on the closed loops (docs/pages/proofs.md,
    section 11). Those at which a feature is out of view are left out. They are sought from random walks on the branch
    of the zero configuration.

    Examples
    --------
    >>> hrsynth.equilibria("rrrrr_m1", goal="x=0,y=0.25").stable[0].kind
    'goal'
    """
    asked = [] if goal is None else [parse_pose(goal)]
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).printing_like(asked)
    if complete:
        setup.by_segments("subdivision")
    require_seen(setup)
    target = next(iter(solve_configurations(setup, asked)), setup.all_samples.start)
    require_regular(ConfigurationAnalysis.of(setup), "goal", target)
    search = EquilibriumSearch.of(setup, target, depth)
    require_sight(setup, search.law, "goal", target)
    report("equilibria")
    return search.answer(seed, complete=complete, max_boxes=max_boxes, jobs=jobs or os.cpu_count() or 1)


@dataclass(frozen=True, eq=False)
class EquilibriumSearch:
    """Data of a search for the equilibria of a loop."""

    setup: ObservedRobot
    goal: ClosedConfiguration
    system: ErrorSystem
    law: Law
    desired: Measures
    depth: str = "exact"

    @classmethod
    def of(cls, setup: ObservedRobot, goal: ClosedConfiguration, depth: str = "exact") -> EquilibriumSearch:
        """Prepare the search for a goal."""
        observation_model = setup.samples.observation_model
        planes = supposed_planes(depth, goal, observation_model)
        system = ErrorSystem.of(goal, observation_model, setup.configurations, planes)
        values = measure_all(goal, observation_model)[0]
        by_directions = all(isinstance(each, SeenAxis) for each in observation_model.observations)
        return cls(
            setup,
            goal,
            system,
            Law(observation_model, setup.dof, 1.0, planes),
            np.array(values) if by_directions else values,
            depth,
        )

    def answer(
        self,
        seed: int = 0,
        *,
        minima: bool = False,
        rounds: Iterable[Array] | None = None,
        complete: bool = False,
        max_boxes: int = SUBDIVISION_BOXES_MAX,
        jobs: int = 1,
    ) -> Equilibria:
        """Return the equilibria found; ``minima`` and ``rounds`` as for :func:`.critical_points`, for minima alone
        neither lists nor enclosures; ``complete``: try to prove that they are all, with at most ``max_boxes`` boxes and
        ``jobs`` processes."""
        setup, motion = self.setup, self.setup.motion
        further = None if minima or self.system.has_assumed_depths else self._further(seed)
        found = critical_points(
            self.system, setup, self.goal, seed, minima=minima, rounds=rounds, further=further, fit=self._near_mode
        )
        found = found if further is None else replace(found, unmet=further.unmet)
        isolated = self._in_mode(found.isolated)
        covers = None
        if not minima and all(each.is_segment_direction for each in setup.observed):
            covers = CompletenessProof.of(setup, self.goal, self.system, max_boxes if complete else None, jobs)
        for turn in range(PROVED_POSE_ROUNDS_COUNT):
            if covers is None:
                break
            places = [(at, each.point.q) for each in isolated if (at := self._place(each.point.q)) is not None]
            isolated += covers.find_missed([at for at, _ in places], np.array([q for _, q in places]), found.idle, turn)
        lists = [] if minima else self._lists(isolated)
        isolated += [each for one in lists for each in self._new_modes(one, isolated, found.idle)]
        report("enclosures")
        boxes: list[EnclosedPoint | None] = [None] * len(isolated)
        if not minima and not self.system.has_assumed_depths:
            # with internal coordinates fixed, curvatures of motions that are internal elsewhere are not enclosed
            whole = [k for k, each in enumerate(isolated) if len(each.point.curvatures) <= self._freedoms]
            proved = enclose_points(self.system, [isolated[k].point for k in whole], found.idle)
            for k, box in zip(whole, proved, strict=True):
                boxes[k] = box
        rests = _ways(
            [each for one, box in zip(isolated, boxes, strict=True) if (each := self.read(one, box)) is not None], self
        )
        continua = [
            each
            for one in self._in_mode(found.continua)
            if (each := self.read(one)) is not None and not (covers is not None and covers.is_isolated(each))
        ]
        measured = tuple(sorted({name for box in boxes if box for name in box.measured}))
        rests, continua = (_sort(each, motion.link, self.goal.model.length) for each in (rests, continua))
        if covers is not None:
            lists = covers.complete_signs(lists, np.array(self.desired))
        lists.sort(key=lambda each: (len(each.reversed), each.reversed))
        return Equilibria(
            setup,
            self.goal,
            motion.pose(self.goal.pose(motion.link)),
            self.desired,
            tuple(rests),
            tuple(continua),
            tuple(lists),
            measured,
            found,
            None if covers is None else covers.judge(rests),
            self.depth,
        )

    @property
    def _freedoms(self) -> int:
        """Return the number of motions that are not internal."""
        return self.setup.samples.members[0].relation.dimension

    def _further(self, seed: int) -> WidenedSearch | None:
        """Return the search for critical points over the pose; None if legs have no closed forms."""
        told = critical_poses(self.setup, self.goal, seed)
        if told is None:
            return None
        seen = self.setup.samples.members[0].relation
        return WidenedSearch(
            PoseToJoints(self.system, self.law.observation_model.observations, told[0]),
            *told[1:],
            seen.mobility - seen.dimension,
            self._near_mode,
        )

    def _lists(self, found: Sequence[CountedCriticalPoint]) -> list[SignedModes]:
        """The lists of modes of those combinations of signs at which the error was found to vanish, that of the goal
        first."""
        known: dict[tuple[str, ...], AssemblyModes | None] = {}
        for at in (self.goal, *(self._place(each.point.q) for each in found if each.point.has_zero_error)):
            if at is not None and (reversed_ := self._reversed_legs(at)) not in known:
                try:
                    known[reversed_] = modes(self.setup, at=at)
                except HrsynthError:
                    known[reversed_] = None
        return [SignedModes(*each) for each in known.items()]

    def _new_modes(
        self, given: SignedModes, found: Sequence[CountedCriticalPoint], idle: int
    ) -> list[CountedCriticalPoint]:
        """The modes of a list that are none of those that were found."""
        if given.listed is None:
            return []
        places = [each.configuration for each in given.listed.modes if each.configuration is not None]
        old = [at for each in found if each.point.has_zero_error and (at := self._place(each.point.q))]
        new = [
            at
            for at in places
            if not any(self.is_same_pose(at, each) and self._reversed_legs(each) == given.reversed for each in old)
        ]
        if not new:
            return []
        q = np.array([self.system.system.read(at.pose) for at in new])
        return [
            CountedCriticalPoint(each, 0) for each in descend(self.system, q, np.zeros(len(q), dtype=np.intp), idle)
        ]

    def _place(self, q: Array) -> ClosedConfiguration | None:
        """The robot at coordinates (N,); None where its loops do not close."""
        key = q.tobytes()
        if key not in self._known:
            try:
                self._known[key] = build_from_link_poses(
                    self.goal.model, partial(self.system.system.pose, values=q.tolist())
                )
            except LoopClosureFailure:
                self._known[key] = None
        return self._known[key]

    @cached_property
    def _known(self) -> dict[bytes, ClosedConfiguration | None]:
        """Results of :meth:`_place`."""
        return {}

    def _reversed_legs(self, at: ClosedConfiguration) -> tuple[str, ...]:
        """The legs whose direction is opposite to the desired one, as far as it is along it."""
        return tuple(
            leg for leg, c in self._cosines(measure_all(at, self.law.observation_model)[0]) if c < ZERO_ERROR_TOL - 1
        )

    def _cosines(self, values: Measures) -> list[tuple[str, float]]:
        """The legs whose directions are observed, each with the cosine of its angle with the desired one."""
        every = zip(self.law.observation_model.observations, values, self.desired, strict=True)
        return [(o.leg, float(u @ w)) for o, u, w in every if isinstance(o, SeenAxis)]

    def is_same_pose(self, at: ClosedConfiguration, other: ClosedConfiguration) -> bool:
        """Return True if the platform is at the same pose."""
        return all(
            compare_poses(at.pose(body), other.pose(body), self.goal.model.length) <= CRITICAL_POINT_DISTANCE_TOL
            for body in list_placing_links(self.setup.decomposition)
        )

    def read(self, found: CountedCriticalPoint, box: EnclosedPoint | None = None) -> Equilibrium | None:
        """A critical point as a pose of the robot; None where its loops do not close, or a camera does not see what it
        is to see."""
        motion, point = self.setup.motion, found.point
        at = self._place(point.q)
        if at is None or self.law.in_front(at) < VISIBLE_SINE_MIN:
            return None
        command = self.law.at(at, FixedDirections(self.desired)(0.0))
        if command.pull > CRITICAL_POINT_DISTANCE_TOL:
            return None
        error = command.size
        reversed_ = self._reversed_legs(at)
        across = tuple(leg for leg, c in self._cosines(command.true) if abs(c) < ZERO_ERROR_TOL)
        kind, singular, boundary = CRITICAL, None, False
        if error < ZERO_ERROR_TOL:
            kind = ANTIPODAL if reversed_ else GOAL if self.is_same_pose(at, self.goal) else MODE
        elif float(command.values[-1]) < CONTROLLER_DAMPING_MIN:
            why = rest(self.setup, at, command)
            singular, boundary = why.reason, why.name == BOUNDARY
        X = at.pose(motion.link)
        shift, turn = (np.inf, np.inf) if box is None else self._radius(box, X)
        least = CRITICAL_CURVATURE_TOL if len(point.curvatures) > self._freedoms else CRITICAL_POINT_DISTANCE_TOL
        state = stability(
            point.curvatures if box is None or box.index is None else box.signs(len(point.curvatures)), least
        )
        return Equilibrium(
            motion.pose(X),
            kind,
            state,
            error,
            tuple(map(float, point.curvatures)),
            at,
            shift,
            turn,
            box is not None and box.index is not None,
            () if box is None or singular is not None else box.rates,
            self._side(at),
            reversed_,
            across,
            singular,
            boundary,
            tuple(list_joints_beyond(at.model, at.q)),
            self._other_legs(at),
            found.met,
        )

    def _radius(self, box: EnclosedPoint, X: Array) -> tuple[float, float]:
        """Return the largest distance of the platform from its pose X (4, 4) over a box (m, rad)."""
        loops, motion = self.system.system, self.setup.motion
        forms = [
            make_affine(np.array([x]), np.zeros((1, 0)), np.array([r])) for x, r in zip(box.q, box.radius, strict=True)
        ]
        carrier, chain = SweptChains(loops, forms), loops.way(loops.body[motion.link])
        zero = loops.mechanism.links[motion.link].pose
        told = [transform(X, motion.point) / loops.length, *X[:3, :3].T]
        vectors = [
            carrier.point(chain, transform(zero, motion.point) / loops.length),
            *(carrier.direction(chain, axis) for axis in zero[:3, :3].T),
        ]
        off = [float(np.linalg.norm((each.value - at).size)) for each, at in zip(vectors, told, strict=True)]
        # |ΔR| = 2 √2 sin(θ / 2) ≥ 2 √2 θ / π
        return off[0] * loops.length, float(np.pi / np.sqrt(8) * np.linalg.norm(off[1:])) if motion.body else 0.0

    @cached_property
    def _condition(self) -> tuple[ConstraintPattern, Condition] | None:
        """The pattern of the held legs and the Type 2 condition, where that has a sign."""
        seen = MeasuredRobot.of(self.setup)
        try:
            return (seen.pattern, seen.condition) if seen.condition.signed else None
        except HrsynthError:
            return None

    def _side(self, at: ClosedConfiguration) -> str | None:
        """Return the side of the Type 2 locus on which a configuration lies, relative to the goal; None if unknown."""
        if self._condition is None:
            return None
        found, condition = self._condition
        here, home = condition.evaluate(found.values_at([at, self.goal]))
        if not min(abs(here), abs(home)) > CLEAR:
            return None
        return "goal" if here * home > 0 else "other"

    @cached_property
    def _forms(self) -> LegPattern | None:
        """Closed forms of the legs, which give their working modes; None if there are none."""
        setup = self.setup
        members = (setup.all_samples.start, *setup.configurations)
        for each in list_path_coordinates(setup.decomposition, setup.samples.observation_model, setup.dof, members):
            try:
                return build_leg_pattern(setup.decomposition, (), each, members)
            except NoLegForm:
                continue
        return None

    def _other_legs(self, at: ClosedConfiguration) -> tuple[str, ...] | None:
        """The legs that are in another working mode than at the goal; None where that is not known."""
        if self._forms is None:
            return None
        try:
            with np.errstate(invalid="ignore"):
                one, other = (self._forms.forms(each) for each in (self.goal, at))
        except NoLegForm:
            return None
        return tuple(
            dict.fromkeys(
                str(limb.label) for limb, a, b in zip(one.subchains, one.modes, other.modes, strict=True) if a != b
            )
        )

    def _in_mode(self, found: Sequence[CountedCriticalPoint]) -> list[CountedCriticalPoint]:
        """Keep those near which configurations are of the operation mode of the zero configuration."""
        if not found:
            return []
        good = self._near_mode(np.array([each.point.q for each in found]))
        return [each for each, kept in zip(found, good, strict=True) if kept]

    def _near_mode(self, q: Array) -> NDArray[np.bool_]:
        """Return True for coordinates (c, N) near which configurations are of that mode."""
        good, rng = np.zeros(len(q), dtype=bool), np.random.default_rng(0)
        # what lies nearby may be nearly singular as well: then a little farther away
        for number in range(MODE_WALKS_MAX):
            if not good.all():
                near = walk_at_random(self.system, q[~good], rng, 2, MODE_WALK_FIRST_STEP_FRACTION * 2**number)
                good[~good] = in_mode(self.system, self.setup, near)
        return good


def _ways(rests: Sequence[Equilibrium], search: EquilibriumSearch) -> list[Equilibrium]:
    """Merge equilibria at one pose with the same measured directions, with their number. Of enclosed ones, if any, the
    one in the working modes nearest to the goal's is kept (where loops are singular, coordinates are known to half
    their digits)."""
    setup = search.setup
    segments, (home,) = (
        [np.concatenate([*measure_all(at, setup.all_samples.observation_model)[0]]) for at in every]
        for every in ([each.configuration for each in rests], [search.goal])
    )
    told = np.array([_telling_values(each.configuration, search) for each in rests])
    groups: list[list[int]] = []
    for k in range(len(rests)):
        first = np.array([group[0] for group in groups], dtype=np.intp)
        own = np.flatnonzero(np.abs(told[first] - told[k]).max(axis=1, initial=0.0) < CRITICAL_POINT_DISTANCE_TOL)
        if len(own):
            groups[own[0]].append(k)
        else:
            groups.append([k])
    best = [
        min(group, key=lambda k: (not rests[k].proved, float(np.linalg.norm(segments[k] - home)))) for group in groups
    ]
    return [
        replace(rests[k], working_modes=len(group), hits=sum(rests[i].hits for i in group))
        for k, group in zip(best, groups, strict=True)
    ]


def _sort(rests: Sequence[Equilibrium], link: str, length: float) -> list[Equilibrium]:
    """Sort equilibria by kind, stable ones first, by their error and the platform's position, then by legs in other
    working modes: not by the order in which they were found."""
    kinds = (GOAL, MODE, ANTIPODAL, CRITICAL)
    named = sorted(rests, key=lambda each: (each.reversed, each.legs_in_other_mode or ()))
    poses = [each.configuration.pose(link) for each in named]
    rows = [
        [kinds.index(each.kind), not each.stable, each.error, *(X[:3, 3] / length), *X[:3, :3].ravel()]
        for each, X in zip(named, poses, strict=True)
    ]
    return [
        named[i] for i in sort_rows(np.array(rows, dtype=float).reshape(len(rows), 15), CRITICAL_POINT_DISTANCE_TOL)
    ]


def _telling_values(at: ClosedConfiguration, search: EquilibriumSearch) -> Array:
    """Return positions of the platform's links (characteristic lengths), their rotations, and all measured values."""
    poses = [at.pose(body) for body in list_placing_links(search.setup.decomposition)]
    return np.concatenate(
        [
            *(X[:3, 3] / search.goal.model.length for X in poses),
            *(X[:3, :3].ravel() for X in poses),
            *measure_all(at, search.law.observation_model)[0],
        ]
    )
