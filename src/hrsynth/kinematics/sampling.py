"""Random closed configurations on the component of the zero configuration (theory 3.1).

Each sample is reached from the zero configuration by small steps; every step is checked: it closes, it does not jump,
it keeps away from singularities of the loops, and the mobility stays the generic one; and the robot, led again along
the poses and directions of the way, arrives at the same configuration. What fails is discarded and counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadMechanism, NotSampled
from ..mechanism.observation import Observation
from ..mechanism.vectors import Array
from ..tolerances import CLOSED, FOLLOWED, INVERTED, PASSED_BY, RANK_GAP, SOLVED
from .configuration import ClosedConfiguration, Target, closed, limited
from .ranks import range_basis
from .relation import Question, Relation, relation
from .twin import Twin

STEP = 0.11
"""Length of a step: the norm of (t, u̇), in characteristic lengths and radians."""
SHRINK = (1.0, 0.4, 0.15)
"""What a step is shortened to where it does not close near its prediction."""
STEPS = 4
"""Steps from the zero configuration to a sample."""
EASY = 10
"""Iterations within which the robot itself must find each configuration of the way again; more are a fold nearby."""
WEAKEST = 0.05
"""Fraction to which the loops' smallest singular value may fall below that of the zero configuration."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A closed configuration, the targets passed on the way to it (the last one its own), and ρ there."""

    configuration: ClosedConfiguration
    way: tuple[Target, ...]
    relation: Relation


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of one mechanism for one question; ``discarded`` draws did not stay on the branch or came too near to a
    singularity."""

    question: Question
    twin: Twin
    start: ClosedConfiguration
    members: tuple[Sample, ...]
    discarded: int

    @property
    def mobility(self) -> int:
        """The generic mobility, idle motions included."""
        return self.members[0].relation.mobility


def draw(twin: Twin, question: Question, count: int, seed: int = 0, *, led_by: Sequence[Observation] | None = None,
         progress: Callable[[], None] | None = None) -> Samples:
    """``count`` random samples; raises ``NotSampled`` where too few can be reached.

    The robot must find its way again led by the platform's pose and the observations ``led_by`` (default: all).
    """
    leading = {o.key for o in (question.observations if led_by is None else led_by)}
    rng = np.random.default_rng(seed)
    start = ClosedConfiguration.of(twin, twin.q0)
    if relation(start, question).dimension == 0:
        raise BadMechanism(f"{twin.mechanism.name}: neither the platform nor a segment of a leg can move", None,
                           "a mechanism with at least one freedom")
    members: list[Sample] = []
    discarded = 0
    for _ in range(4 * count):
        sample = _walk(start, question, leading, rng)
        if sample is None:
            discarded += 1
            continue
        members.append(sample)
        if progress is not None:
            progress()
        if len(members) >= count:
            usual, dropped = _usual(members)
            discarded += dropped
            members = usual
            if len(members) >= count:
                break
    if len(members) < count:
        raise NotSampled(twin.mechanism.name, len(members), count)
    return Samples(question, twin, start, tuple(members), discarded)


def _usual(members: list[Sample]) -> tuple[list[Sample], int]:
    """The members whose mobility and dimensions are the generic ones: the smallest mobility, the most frequent rest."""
    smallest = min(member.relation.mobility for member in members)
    kept = [m for m in members if m.relation.mobility == smallest]
    signature = Counter((m.relation.dimension, m.relation.dof.value, m.relation.lost.shape[1]) for m in kept)
    best = max(signature, key=lambda key: (signature[key], key[0]))
    kept = [m for m in kept
            if (m.relation.dimension, m.relation.dof.value, m.relation.lost.shape[1]) == best]
    return kept, len(members) - len(kept)


def _velocity(at: ClosedConfiguration, question: Question, wish: Array | None,
              rng: np.random.Generator) -> tuple[Array, Array] | None:
    """A joint velocity without idle motion whose (t, u̇) is a unit vector: near ``wish``, or random."""
    kernel, _ = at.kernel()
    image = question.rows(at) @ kernel
    basis, rank = range_basis(image, 1.0)
    if rank.value == 0:
        return None
    wanted = basis @ (rng.normal(size=rank.value) if wish is None else basis.T @ wish
                      + 0.2 * rng.normal(size=rank.value) / np.sqrt(rank.value))
    norm = float(np.linalg.norm(wanted))
    if norm < 1e-6:
        return None
    wanted = wanted / norm
    return kernel @ np.linalg.lstsq(image, wanted, rcond=INVERTED)[0], wanted


def _walk(start: ClosedConfiguration, question: Question, leading: set[tuple[str, ...]],
          rng: np.random.Generator) -> Sample | None:
    twin = start.twin
    here, wish = start, None
    way: list[Target] = []
    weakest = WEAKEST * start.kernel()[1].weakest
    for _ in range(STEPS):
        moved = _step(here, question, wish, weakest, rng)
        if moved is None:
            return None
        here, wish = moved
        way.append(question.target(here))
    found = relation(here, question)
    led = [replace(t, measured=tuple(pair for pair in t.measured if pair[0].key in leading))
           for t in way]
    if found.gap < RANK_GAP or followed(twin, led, iterations=EASY)[1] > FOLLOWED:
        return None
    return Sample(here, tuple(way), found)


def _step(here: ClosedConfiguration, question: Question, wish: Array | None, weakest: float,
          rng: np.random.Generator) -> tuple[ClosedConfiguration, Array] | None:
    """The next configuration of a walk and the direction of the step in (t, u̇); None where it jumps or comes too near
    to a singularity of the loops."""
    for shrink in SHRINK:
        moving = _velocity(here, question, wish, rng)
        if moving is None:
            return None
        velocity, direction = moving
        there = _moved(here, shrink * velocity)
        if there is not None:
            return None if there.kernel()[1].weakest < weakest else (there, direction)
    return None


def _moved(here: ClosedConfiguration, velocity: Array) -> ClosedConfiguration | None:
    """The configuration a step along ``velocity`` leads to; None where it does not close near its prediction."""
    step = limited(STEP * velocity, 3 * STEP)
    predicted = here.twin.moved(here.q, step)
    q, residual = closed(here.twin, predicted, tolerance=SOLVED)
    if residual <= CLOSED and np.linalg.norm(q - predicted) <= 0.5 * np.linalg.norm(step) + 1e-9:
        return ClosedConfiguration.of(here.twin, q)
    return None


def wander(start: ClosedConfiguration, count: int, seed: int = 0, steps: int = 40) -> Iterator[ClosedConfiguration]:
    """``count`` random configurations on the component of ``start``: walks of up to ``steps`` small steps in the
    mechanism's own freedoms, each checked as those of :func:`draw` are; a walk that ends early is begun again."""
    rng = np.random.default_rng(seed)
    weakest = WEAKEST * start.kernel()[1].weakest
    given = failed = 0
    while given < count:
        here, velocity = start, np.zeros(start.twin.nv)
        for _ in range(steps):
            kernel, _ = here.kernel()
            velocity = kernel @ (kernel.T @ velocity + rng.normal(size=kernel.shape[1]) / 2)
            velocity /= np.linalg.norm(velocity)
            moved = next((m for shrink in SHRINK if (m := _moved(here, 2 * shrink * velocity)) is not None), None)
            if moved is None or moved.kernel()[1].weakest < weakest:
                failed += 1
                break
            here = moved
            yield here
            given += 1
            if given == count:
                return
        if failed > 10 * (given + 10):
            raise NotSampled(start.twin.mechanism.name, given, count)


def followed(twin: Twin, way: Sequence[Target], iterations: int = 120) -> tuple[Array, float]:
    """The configuration a twin reaches when it is led from its zero configuration along a way, and the residual."""
    q, residual = twin.q0, 0.0
    for target in way:
        exact = target is way[-1]
        q, residual = closed(twin, q, target, tolerance=SOLVED if exact else PASSED_BY, iterations=iterations)
    return q, residual
