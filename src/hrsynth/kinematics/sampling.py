"""Random closed configurations on the branch of the zero configuration (docs/pages/theory.md, section 5).

Each sample is reached from the zero configuration by steps that follow the branch (:mod:`.branch_tests`), halved until
they do, away from singularities of the loops; and the robot, led again along the poses and directions of the path,
arrives. Failures are discarded and counted. Random vectors are projected from coordinates, so that no step depends on
which basis of a space rounding gives. All samples must have one signature of the operation mode (:mod:`.branch_tests`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from ..budgets import RETRACE_ITERATIONS_MAX
from ..errors import BadMechanism, SamplingFailure, UndefinedValue
from ..geometry.ranks import compute_range_bases
from ..geometry.vectors import Array
from ..mechanism.observation import Observation
from ..results import Value
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    FEASIBLE_MOTION_MIN_FRACTION,
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
from .tasks import PoseAndValuesTask, TaskBatch, shorten_step, solve_together
from .velocity_relation import ObservationModel, VelocityRelation, compute_relation, compute_relations
from .walking import (
    HALVED,
    WALK_SINGULAR_VALUE_MIN_FRACTION,
    WALK_STEP_NORM_FRACTION,
    draw_velocity,
    is_step_on_branch,
    step_along,
)

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
class _Walker:
    """Random walk: its configuration, its last direction in (t, u̇), the configurations of its last step, the targets
    of all that it passed, the random vectors that it takes first, and the least singular value allowed."""

    here: ClosedConfiguration
    noise: Iterator[Array]
    weakest: float
    wish: Array | None = None
    passed: Sequence[ClosedConfiguration] = ()
    way: list[PoseAndValuesTask | None] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class _Stride:
    """Step in progress: the configuration reached, the joint velocity there and its (t, u̇), the part of it that is
    done and the next part, and the configurations passed."""

    here: ClosedConfiguration
    velocity: Array
    direction: Array
    came: float = 0.0
    part: float = 1.0
    passed: tuple[ClosedConfiguration, ...] = ()

    def tangent(self) -> Array:
        """Next part of it, (nv,)."""
        return self.part * shorten_step(WALK_STEP_NORM_FRACTION * self.velocity, 3 * WALK_STEP_NORM_FRACTION)

    def shortened(self) -> _Stride | None:
        """Return the step with its next part halved, which did not follow the branch; None if it would be too small."""
        return replace(self, part=self.part / 2) if self.part / 2 >= HALVED[-1] else None

    def ahead(self) -> _Stride | None:
        """Return the step with a next part that may follow the branch, which is tested before it is closed."""
        if has_steady_values_along(self.here, self.tangent()):
            return self
        shorter = self.shortened()
        return shorter and shorter.ahead()

    def on(self, basis: Array) -> Array:
        """Return its direction in a basis of (t, u̇)."""
        return np.asarray(basis.T @ self.direction)


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
        walkers = [
            _Walker(start, iter(own), WALK_SINGULAR_VALUE_MIN_FRACTION * start.kernel()[1].weakest)
            for start, own in zip(starts, noise, strict=True)
        ]
        for _ in range(SAMPLE_PATH_STEPS_COUNT):
            if self.freely:
                for walker in walkers:
                    idly = 2 * draw_velocity(walker.here, self.rng)
                    walker.here = next(
                        (there for part in HALVED if (there := step_along(walker.here, idly, part)) is not None),
                        walker.here,
                    )
            walkers = self._step(walkers)
            passed = [(walker, at) for walker in walkers for at in walker.passed]
            targets = _measure_all(observation_model.targets, [at for _, at in passed])
            for (walker, _), target in zip(passed, targets, strict=True):
                walker.way.append(target)
            walkers = [walker for walker in walkers if None not in walker.way]
        steady = [
            (at, [each for each in walker.way if each is not None])
            for walker in walkers
            if (at := close_precisely(walker.here)) is not None
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

    def _step(self, walkers: Sequence[_Walker]) -> list[_Walker]:
        """Make one step of each, in another direction if it is blocked; return those that were not blocked in all."""
        left = list(walkers)
        for _ in range(WALK_DIRECTIONS_MAX):
            if not left:
                break
            aims = self._velocities([walker.here for walker in left], [partial(self._aim, walker) for walker in left])
            ends = self._stride(
                {
                    i: _Stride(walker.here, *aim)
                    for i, (walker, aim) in enumerate(zip(left, aims, strict=True))
                    if aim is not None
                },
                [walker.weakest for walker in left],
            )
            for i, (passed, direction) in ends.items():
                left[i].here, left[i].wish, left[i].passed = passed[-1], direction, passed
            left = [walker for i, walker in enumerate(left) if i not in ends]
            for walker in left:
                walker.wish = None
        return [walker for walker in walkers if walker not in left]

    def _aim(self, walker: _Walker, basis: Array) -> Array:
        """Return the next direction, in this basis of (t, u̇): near the last one, or anywhere."""

        def noise() -> Array:
            drawn = next(walker.noise, None)
            return np.asarray(self.rng.normal(size=len(basis))) if drawn is None else drawn

        wish = noise() if walker.wish is None else walker.wish
        return np.asarray(basis.T @ (wish + 0.2 * noise() / np.sqrt(basis.shape[1])))

    def _velocities(
        self, here: Sequence[ClosedConfiguration], aims: Sequence[Callable[[Array], Array]]
    ) -> list[tuple[Array, Array] | None]:
        """Return a joint velocity without internal motion at each configuration, whose (t, u̇) is a unit vector, and
        this vector: along the projection of its aim on a basis; None if nothing moves so."""
        rows = _measure_all(self.question.rows_together, here)
        images = {i: moved @ here[i].kernel()[0] for i, moved in enumerate(rows) if moved is not None}
        found: list[tuple[Array, Array] | None] = [None] * len(here)
        for (i, image), (basis, rank) in zip(
            images.items(), compute_range_bases(list(images.values()), 1.0), strict=True
        ):
            wanted = basis @ aims[i](basis) if rank.value else np.zeros(len(image))
            norm = float(np.linalg.norm(wanted))
            if norm >= FEASIBLE_MOTION_MIN_FRACTION:
                wanted = wanted / norm
                found[i] = (
                    here[i].kernel()[0] @ np.linalg.lstsq(image, wanted, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)[0],
                    wanted,
                )
        return found

    def _stride(
        self, going: dict[int, _Stride], weakest: Sequence[float]
    ) -> dict[int, tuple[tuple[ClosedConfiguration, ...], Array]]:
        """Return the configurations to which steps along (t, u̇) lead, in parts that follow the branch, and their last
        directions; without those that come too near to a singularity of the loops."""
        ended: dict[int, tuple[tuple[ClosedConfiguration, ...], Array]] = {}
        while going:
            onward: dict[int, _Stride] = {}
            for (i, at), there in zip(going.items(), self._parts(list(going.values())), strict=True):
                came = at.came + at.part
                if there is None:
                    if (shorter := at.shortened()) is not None:
                        onward[i] = shorter
                elif there.kernel()[1].weakest >= weakest[i]:
                    passed = (*at.passed, there)
                    if came < 1:
                        onward[i] = _Stride(there, at.velocity, at.direction, came, min(2 * at.part, 1 - came), passed)
                    else:
                        ended[i] = passed, at.direction
            turned = [i for i, at in onward.items() if at.here is not going[i].here]
            moving = self._velocities([onward[i].here for i in turned], [onward[i].on for i in turned])
            for i, each in zip(turned, moving, strict=True):
                if each is None:
                    del onward[i]
                else:
                    onward[i] = replace(onward[i], velocity=each[0], direction=each[1])
            going = {i: ahead for i, at in onward.items() if (ahead := at.ahead()) is not None}
        return ended

    def _parts(self, strides: Sequence[_Stride]) -> list[ClosedConfiguration | None]:
        """Make the next part of several steps, see :func:`.walking.step_along`."""
        model, tangents = strides[0].here.model, [stride.tangent() for stride in strides]
        predicted = [model.integrate(stride.here.q, tangent) for stride, tangent in zip(strides, tangents, strict=True)]
        solved = solve_together(TaskBatch(model, None), predicted, [None] * len(strides), tolerance=CLOSURE_SOLVER_TOL)
        closed = [k for k, (_, residual) in enumerate(solved) if residual <= CLOSURE_RESIDUAL_TOL]
        found: list[ClosedConfiguration | None] = [None] * len(strides)
        for k, there in zip(closed, ClosedConfiguration.several(model, [solved[k][0] for k in closed]), strict=True):
            if is_step_on_branch(strides[k].here, tangents[k], predicted[k], there):
                found[k] = there
            elif strides[k].part == 1:
                self.beyond.append(there)
        return found


def _measure_all(
    ask: Callable[[list[ClosedConfiguration]], Iterable[X]], places: Sequence[ClosedConfiguration]
) -> list[X | None]:
    """Measure several configurations together; None at those at which a value is undefined."""
    try:
        return list(ask(list(places))) if places else []
    except UndefinedValue:
        return [None] if len(places) == 1 else [each for place in places for each in _measure_all(ask, [place])]
