"""Random closed configurations on the branch of the zero configuration (docs/pages/theory.md, section 5).

Each sample is reached from the zero configuration by steps that follow the branch (:mod:`.branch_tests`), halved until
they do, away from singularities of the loops; and the robot, led again along the poses and directions of the path,
arrives. Failures are discarded and counted. Random vectors are projected from coordinates, so that no step depends on
which basis of a space rounding gives. All samples must have one signature of the operation mode (:mod:`.branch_tests`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from ..errors import BadMechanism, SamplingFailure, UndefinedValue
from ..geometry.ranks import compute_range_bases
from ..geometry.vectors import Array
from ..mechanism.observation import Observation
from ..results import Value
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    NONZERO_SINGULAR_VALUE_MIN,
    PSEUDOINVERSE_CUTOFF_FRACTION,
    RANK_GAP_MIN,
)
from .branch_tests import OperationMode, Signature, group_modes, has_steady_values_along, rank_rotations
from .configuration import ClosedConfiguration
from .operation_modes import (
    SAMPLE_PATH_STEPS_COUNT,
    choose_firmest,
    close_precisely,
    find_other_modes,
    find_ways_out,
    identify_mode,
    is_regular,
    require_motions,
    require_one,
    walk_far,
)
from .path_tracking import track_paths
from .pinocchio_model import PinocchioModel
from .platform_motion import PlatformMotion
from .tasks import PoseAndValuesTask, TaskBatch, shorten_step, solve_together
from .velocity_relation import (
    ObservationModel,
    VelocityRelation,
    compute_relation,
    compute_relations,
    select_observations,
)
from .walking import (
    HALVED,
    WALK_SINGULAR_VALUE_MIN_FRACTION,
    WALK_STEP_NORM_FRACTION,
    draw_velocity,
    is_step_on_branch,
    step_along,
)

FEASIBLE_MOTION_MIN_FRACTION = 1e-6
"""Relative length of (t, u̇) below which a mechanism cannot move in a direction."""
RETRACE_ITERATIONS_MAX = 10
"""Iterations within which a retraced sample must close; more indicate a fold."""

X = TypeVar("X")

WALK_DIRECTIONS_MAX = 3
"""Number of directions that a walk tries before a singularity before it is given up."""


@dataclass(frozen=True, eq=False, repr=False)
class Sample(Value):
    """Closed configuration, the targets of all configurations passed on the path to it (the last one its own), and ρ
    there."""

    configuration: ClosedConfiguration
    way: tuple[PoseAndValuesTask, ...]
    relation: VelocityRelation

    @cached_property
    def shown(self) -> list[int]:
        """Number of independent values that each observation clearly shows: fewer if it is itself nearly
        singular, as a circle that is observed edge-on."""
        rows = [self.relation.basis[self.relation.rows_of(place)] for place in range(len(self.relation.sizes))]
        return [int(np.sum(np.linalg.svd(each, compute_uv=False) > NONZERO_SINGULAR_VALUE_MIN)) for each in rows]


@dataclass(frozen=True, eq=False, repr=False)
class Samples(Value):
    """Samples of one mechanism for one observation model; ``discarded`` samples did not stay on the branch or came too
    near to a singularity. ``met`` are other operation modes that steps too long would have led to."""

    observation_model: ObservationModel
    model: PinocchioModel
    start: ClosedConfiguration
    members: tuple[Sample, ...]
    discarded: int
    other_modes: tuple[OperationMode, ...] = ()
    led: bool = True
    """True if the robot finds all samples again, led along their paths: not if its zero configuration is special."""

    @cached_property
    def motion(self) -> PlatformMotion:
        """Generic motion of the platform."""
        return PlatformMotion.of([member.configuration for member in self.members], self.observation_model)

    def restrict(self, observations: Iterable[Observation], *, ways: bool = True) -> Samples:
        """Return the samples for fewer observations (all of them among the samples' own), with or without their
        ``ways``."""
        keys = [o.key for o in self.observation_model.observations]
        places = [keys.index(o.key) for o in observations]
        chosen = tuple(self.observation_model.observations[i] for i in places)
        relations = select_observations([member.relation for member in self.members], places)
        members = tuple(
            Sample(
                member.configuration,
                tuple(replace(t, measured=tuple(t.measured[i] for i in places)) for t in member.way) if ways else (),
                relation,
            )
            for member, relation in zip(self.members, relations, strict=True)
        )
        return replace(self, observation_model=replace(self.observation_model, observations=chosen), members=members)

    def measure(self, observations: tuple[Observation, ...]) -> Samples:
        """Return the samples with ρ for other observations, without paths."""
        observation_model = replace(self.observation_model, observations=observations)
        places = [member.configuration for member in self.members]
        members = tuple(Sample(at, (), compute_relation(at, observation_model)) for at in places)
        return replace(self, observation_model=observation_model, members=members)

    @property
    def mobility(self) -> int:
        """Generic mobility, internal motions included."""
        return self.members[0].relation.mobility

    @cached_property
    def signature(self) -> Signature:
        """Signature of the samples' operation mode, from one with the most rotations."""
        return Signature.of(max((member.relation for member in self.members), key=rank_rotations))


def sample(
    model: PinocchioModel,
    observation_model: ObservationModel,
    count: int,
    seed: int = 0,
    *,
    led_by: Sequence[Observation] | None = None,
) -> Samples:
    """Return ``count`` random samples of one operation mode; raises ``SamplingFailure`` if too few can be reached,
    ``BranchPoint`` if the zero configuration belongs to several.

    The robot should find its path again led by the platform's pose and the observations ``led_by`` (default: all); if
    it does not, the samples record that. Internal motions are left out of the walks if that shows what is generic.
    """
    leading = {o.key for o in (observation_model.observations if led_by is None else led_by)}
    start = ClosedConfiguration.of(model, model.q0)
    moves = compute_relation(start, observation_model).dimension > 0
    if not moves and not start.kernel()[0].shape[1]:
        raise BadMechanism(f"{model.mechanism.name}: its loops let no link move", remedy="Check its loop closures.")
    rng = np.random.default_rng(seed)
    regular = is_regular(start, rng)
    roots = [start] if regular and moves else find_ways_out(start, observation_model, rng, singular=not regular)
    for freely in (False, True):
        walks = _Walks(observation_model, leading, np.random.default_rng(seed), freely)
        members, discarded, led = walks.sample(roots, count)
        signatures = [Signature.of(member.relation) for member in members]
        if freely or not (far := walk_far(roots[0])):
            break
        probe = identify_mode(choose_firmest(far), observation_model)
        if probe is None or all(map(probe.signature.may_be_same_mode, signatures)):
            break
    require_motions([member.configuration for member in members])
    groups = group_modes(
        [OperationMode(each, member.configuration) for each, member in zip(signatures, members, strict=True)]
    )
    require_one(
        groups, observation_model, "the configurations reached differ as only those of several operation modes do"
    )
    own = groups[0][0].signature
    return Samples(
        observation_model,
        model,
        start,
        tuple(members),
        discarded,
        find_other_modes(walks.beyond, own, observation_model),
        led,
    )


@dataclass(eq=False)
class _RandomWalk:
    """Random walk: its configuration, the random vectors that it takes first, the least singular value allowed, its
    last direction in (t, u̇), the targets of all configurations that it passed, and its step in progress."""

    here: ClosedConfiguration
    noise: Iterator[Array]
    weakest: float
    wish: Array | None = None
    way: list[PoseAndValuesTask | None] = field(default_factory=list)
    passed: list[ClosedConfiguration] = field(default_factory=list)
    """Configurations passed in the step."""
    velocity: Array = field(init=False)
    """Joint velocity at the last of them, and ``direction``, its (t, u̇)."""
    direction: Array = field(init=False)
    done: float = 0.0
    """Fraction of the step that is done; ``part`` is that of the next part."""
    part: float = 1.0

    def begin(self) -> None:
        """Begin a step."""
        self.passed, self.done, self.part = [], 0.0, 1.0

    @property
    def at(self) -> ClosedConfiguration:
        """Configuration that the step has reached."""
        return self.passed[-1] if self.passed else self.here

    def tangent(self) -> Array:
        """Return the next part of the step, (nv,)."""
        return self.part * shorten_step(WALK_STEP_NORM_FRACTION * self.velocity, 3 * WALK_STEP_NORM_FRACTION)

    def can_go_on(self) -> bool:
        """Halve the next part until it may follow the branch, which is tested before it is closed; False if it gets too
        small."""
        while self.part >= HALVED[-1]:
            if has_steady_values_along(self.at, self.tangent()):
                return True
            self.part /= 2
        return False


class _Walks:
    """Random walks of one seed, in internal motions too if they go ``freely``; ``beyond`` collects closed
    configurations that too long steps came to."""

    def __init__(
        self, observation_model: ObservationModel, leading: set[tuple[str, ...]], rng: np.random.Generator, freely: bool
    ) -> None:
        self.question, self.leading, self.rng, self.freely = observation_model, leading, rng, freely
        self.beyond: list[ClosedConfiguration] = []

    def sample(self, roots: Sequence[ClosedConfiguration], count: int) -> tuple[list[Sample], int, bool]:
        """Return so many samples, the number discarded, and whether the robot finds all of them again; raises
        ``SamplingFailure``."""
        members, lonely = list[Sample](), list[Sample]()
        discarded, draws, most = 0, 0, 4 * count
        while len(members) < count and draws < most:
            last, draws = draws, min(draws + count - len(members), most)
            drawn = self.walk([roots[number % len(roots)] for number in range(last, draws)])
            discarded += draws - last - len(drawn)
            for sample, again in zip(drawn, self._finds_again(drawn), strict=True):
                (members if again else lonely).append(sample)
        if len(members) == count:
            return members, discarded + len(lonely), True
        if len(members) + len(lonely) < count:
            raise SamplingFailure(roots[0].model.mechanism.name, len(members) + len(lonely), count, draws)
        return [*members, *lonely][:count], discarded, False

    def _finds_again(self, samples: Sequence[Sample]) -> Iterator[bool]:
        """Yield True if the robot, led along the path of each sample, arrives."""
        ways = [[target.of(lambda o: o.key in self.leading) for target in sample.way] for sample in samples]
        for led in track_paths(samples[0].configuration.model, ways, RETRACE_ITERATIONS_MAX) if ways else ():
            yield not isinstance(led, UndefinedValue) and led[1] <= HIDDEN_ROBOT_RESIDUAL_TOL

    def walk(self, starts: Sequence[ClosedConfiguration]) -> list[Sample]:
        """Return the samples at the ends of random walks from these configurations, in step; without those that are
        blocked, or whose ranks are not clear."""
        observation_model = self.question
        noise = self.rng.normal(size=(len(starts), SAMPLE_PATH_STEPS_COUNT + 1, observation_model.size))
        walks = [
            _RandomWalk(start, iter(vectors), WALK_SINGULAR_VALUE_MIN_FRACTION * start.kernel()[1].weakest)
            for start, vectors in zip(starts, noise, strict=True)
        ]
        for _ in range(SAMPLE_PATH_STEPS_COUNT):
            if self.freely:
                for walk in walks:
                    idly = 2 * draw_velocity(walk.here, self.rng)
                    walk.here = next(
                        (there for part in HALVED if (there := step_along(walk.here, idly, part)) is not None),
                        walk.here,
                    )
            walks = self._step(walks)
            passed = [(walk, at) for walk in walks for at in walk.passed]
            targets = _measure_all(observation_model.targets, [at for _, at in passed])
            for (walk, _), target in zip(passed, targets, strict=True):
                walk.way.append(target)
            walks = [walk for walk in walks if None not in walk.way]
        steady = [
            (at, [each for each in walk.way if each is not None])
            for walk in walks
            if (at := close_precisely(walk.here)) is not None
        ]
        found = _measure_all(
            lambda at: compute_relations(at, observation_model, observation_model.rows_together(at)),
            [at for at, _ in steady],
        )
        return [
            Sample(at, tuple(way), each)
            for (at, way), each in zip(steady, found, strict=True)
            if each is not None and each.gap >= RANK_GAP_MIN
        ]

    def _step(self, walks: Sequence[_RandomWalk]) -> list[_RandomWalk]:
        """Make one step of each, in another direction if it is blocked; return those that were not blocked in all."""
        left = list(walks)
        for _ in range(WALK_DIRECTIONS_MAX):
            for walk in left:
                walk.begin()
            ended = self._stride(self._turn(left, self._aim))
            for walk in ended:
                walk.here, walk.wish = walk.at, walk.direction
            left = [walk for walk in left if walk not in ended]
            for walk in left:
                walk.wish = None
        return [walk for walk in walks if walk not in left]

    def _aim(self, walk: _RandomWalk, basis: Array) -> Array:
        """Return the next direction, in this basis of (t, u̇): near the last one, or anywhere."""

        def noise() -> Array:
            drawn = next(walk.noise, None)
            return np.asarray(self.rng.normal(size=len(basis))) if drawn is None else drawn

        wish = noise() if walk.wish is None else walk.wish
        return np.asarray(basis.T @ (wish + 0.2 * noise() / np.sqrt(basis.shape[1])))

    def _turn(self, walks: Sequence[_RandomWalk], aim: Callable[[_RandomWalk, Array], Array]) -> list[_RandomWalk]:
        """Give each a joint velocity without internal motion, whose (t, u̇) is a unit vector: along the projection of
        its aim on a basis; return those that can move so."""
        rows = _measure_all(self.question.rows_together, [walk.at for walk in walks])
        images = [
            (walk, moved @ walk.at.kernel()[0]) for walk, moved in zip(walks, rows, strict=True) if moved is not None
        ]
        bases = compute_range_bases([image for _, image in images], 1.0)
        turned = []
        for (walk, image), (basis, rank) in zip(images, bases, strict=True):
            wanted = basis @ aim(walk, basis) if rank.value else np.zeros(len(image))
            norm = float(np.linalg.norm(wanted))
            if norm >= FEASIBLE_MOTION_MIN_FRACTION:
                walk.direction = wanted / norm
                rates = np.linalg.lstsq(image, walk.direction, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0]
                walk.velocity = walk.at.kernel()[0] @ rates
                turned.append(walk)
        return turned

    def _stride(self, walks: Sequence[_RandomWalk]) -> list[_RandomWalk]:
        """Make a step of each along its (t, u̇), in parts that follow the branch; return those that end theirs, without
        those that come too near to a singularity of the loops."""
        ended, going = list[_RandomWalk](), list(walks)
        while going:
            halved, advanced = list[_RandomWalk](), list[_RandomWalk]()
            for walk, there in zip(going, self._parts(going), strict=True):
                if there is None:
                    walk.part /= 2
                    halved.append(walk)
                elif there.kernel()[1].weakest >= walk.weakest:
                    walk.passed.append(there)
                    walk.done += walk.part
                    walk.part = min(2 * walk.part, 1 - walk.done)
                    (advanced if walk.done < 1 else ended).append(walk)
            turned = self._turn(advanced, lambda walk, basis: basis.T @ walk.direction)
            going = [walk for walk in going if walk in halved + turned and walk.can_go_on()]
        return ended

    def _parts(self, walks: Sequence[_RandomWalk]) -> list[ClosedConfiguration | None]:
        """Make the next part of several steps, see :func:`.walking.step_along`."""
        model, tangents = walks[0].here.model, [walk.tangent() for walk in walks]
        predicted = [model.integrate(walk.at.q, tangent) for walk, tangent in zip(walks, tangents, strict=True)]
        solved = solve_together(TaskBatch(model, None), predicted, [None] * len(walks), tolerance=CLOSURE_SOLVER_TOL)
        closed = [k for k, (_, residual) in enumerate(solved) if residual <= CLOSURE_RESIDUAL_TOL]
        parts: list[ClosedConfiguration | None] = [None] * len(walks)
        for k, there in zip(closed, ClosedConfiguration.several(model, [solved[k][0] for k in closed]), strict=True):
            if is_step_on_branch(walks[k].at, tangents[k], predicted[k], there):
                parts[k] = there
            elif walks[k].part == 1:
                self.beyond.append(there)
        return parts


def _measure_all(
    ask: Callable[[list[ClosedConfiguration]], Iterable[X]], places: Sequence[ClosedConfiguration]
) -> list[X | None]:
    """Measure several configurations together; None at those at which a value is undefined."""
    try:
        return list(ask(list(places))) if places else []
    except UndefinedValue:
        return [None] if len(places) == 1 else [each for place in places for each in _measure_all(ask, [place])]
