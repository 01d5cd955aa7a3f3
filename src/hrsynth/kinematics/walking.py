"""Steps of a mechanism that follow its branch, halved until they do, and random walks of such steps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..errors import SamplingFailure
from ..geometry.ranks import draw_in_space
from ..geometry.vectors import Array
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL
from .branch_tests import STEP_CORRECTION_MAX_FRACTION, is_on_branch
from .configuration import ClosedConfiguration
from .tasks import shorten_step, solve

WALK_STEP_NORM_FRACTION = 0.11
"""Length of a step: the norm of (t, u̇), in characteristic lengths and radians."""
HALVED = tuple(2.0**-k for k in range(10))
"""Number of parts of a step that are tried; if the last does not follow the branch, a singularity of the loops is
ahead."""
WALK_SINGULAR_VALUE_MIN_FRACTION = 0.05
"""Fraction to which the loops' smallest singular value may fall below that of the zero configuration."""


def step_along(
    here: ClosedConfiguration, velocity: Array, part: float = 1.0, *, leaving: bool = False
) -> ClosedConfiguration | None:
    """The configuration a ``part`` of a step along ``velocity`` leads to; None where it does not close near its
    prediction, or does not follow the branch. ``leaving`` a singular configuration, any branch will do."""
    step = part * shorten_step(WALK_STEP_NORM_FRACTION * velocity, 3 * WALK_STEP_NORM_FRACTION)
    predicted = here.model.integrate(here.q, step)
    q, residual = solve(here.model, predicted, tolerance=CLOSURE_SOLVER_TOL)
    if not residual <= CLOSURE_RESIDUAL_TOL:
        return None
    there = ClosedConfiguration.of(here.model, q)
    if leaving:
        apart = float(np.linalg.norm(here.model.difference(predicted, q)))
        return there if apart <= float(np.linalg.norm(step)) / 2 else None
    return there if is_step_on_branch(here, step, predicted, there) else None


def is_step_on_branch(here: ClosedConfiguration, step: Array, predicted: Array, there: ClosedConfiguration) -> bool:
    """Return True if ``there``, where the loops close after a step, is near its prediction and follows the branch."""
    apart = float(np.linalg.norm(here.model.difference(predicted, there.q)))
    return apart <= STEP_CORRECTION_MAX_FRACTION * float(np.linalg.norm(step)) + 1e-9 and is_on_branch(
        here, step, there
    )


def draw_velocity(at: ClosedConfiguration, rng: np.random.Generator) -> Array:
    """Return a random joint velocity, internal motions included, a unit vector."""
    velocity = draw_in_space(at.kernel()[0], rng)
    return np.asarray(velocity / np.linalg.norm(velocity))


def walk_randomly(
    start: ClosedConfiguration, count: int, seed: int = 0, steps: int = 40
) -> Iterator[ClosedConfiguration]:
    """Yield ``count`` random configurations on the branch of ``start``: walks of up to ``steps`` small steps in all
    motions of the mechanism, each checked as by :func:`.sampling.sample`; one that ends early is begun again."""
    rng = np.random.default_rng(seed)
    weakest = WALK_SINGULAR_VALUE_MIN_FRACTION * start.kernel()[1].weakest
    given = failed = 0
    while given < count:
        here, velocity = start, np.zeros(start.model.nv)
        for _ in range(steps):
            kernel, _ = here.kernel()
            velocity = kernel @ (kernel.T @ (velocity + rng.normal(size=len(kernel)) / 2))
            velocity /= np.linalg.norm(velocity)
            moved = next((m for part in HALVED if (m := step_along(here, 2 * velocity, part)) is not None), None)
            if moved is None or moved.kernel()[1].weakest < weakest:
                failed += 1
                break
            here = moved
            yield here
            given += 1
            if given == count:
                return
        if failed > 10 * (given + 10):
            raise SamplingFailure(start.model.mechanism.name, given, count, given + failed)
