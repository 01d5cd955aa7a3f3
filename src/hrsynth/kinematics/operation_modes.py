"""Operation mode of samples, and the mechanisms that have none (docs/pages/theory.md, section 5).

A zero configuration may be a branch point, or one at which nothing moves to first order; loops may be infinitesimally
mobile. Refusals report what was found.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import BadMechanism, BranchPoint, InfinitesimalMobility, SamplingFailure, UndefinedValue
from ..geometry.ranks import compute_kernel_basis, compute_largest_angle
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    EXACT_INCIDENCE_TOL,
    NONZERO_SINGULAR_VALUE_MIN,
    RANK_GAP_MIN,
    SLOPE_STEP_MAX,
)
from .branch_tests import OperationMode, Signature, group_modes
from .configuration import ClosedConfiguration
from .tasks import TaskBatch, solve, solve_together
from .velocity_relation import ObservationModel, compute_relation
from .walking import HALVED, draw_velocity, step_along, walk_randomly

SINGULAR_POSE_RESIDUAL_TOL = 1e-15
"""Closure residual of singular poses that are needed to full precision."""
TANGENT_ROTATION_TOL = 1e-10
"""Turn (radians) of the tangent space that the residual of a sample may cause."""
FIRST_ORDER_STEP_MIN_FRACTION = 0.5
"""Fraction of a small first-order step that must remain after closing; less is no finite motion."""
FIRST_ORDER_STEP_MAX = 0.01
"""Length of such a step (characteristic lengths, radians)."""

MODE_CANDIDATES_MAX = 40
"""Largest number of configurations beyond a singularity that are tested for another operation mode."""
MODE_CONFIRMED_MAX = 6
"""Largest number of those that are confirmed by walks from there."""
MODE_WALK_STEPS_COUNT = 16
"""Number of steps of such a walk."""
BRANCH_SEARCH_STEPS_COUNT = 24
"""Number of steps in random directions by which the branches at a singular zero configuration are sought."""
INFINITESIMAL_SAMPLES_COUNT = 3
"""Number of samples at which a mechanism must be infinitesimally mobile to be reported so."""
REFUSAL_LINKS_PRINTED_MAX = 6
"""Largest number of links that a refusal names."""
SAMPLE_PATH_STEPS_COUNT = 4
"""Number of steps from the zero configuration to a sample."""


def find_other_modes(
    beyond: Sequence[ClosedConfiguration], own: Signature, observation_model: ObservationModel
) -> tuple[OperationMode, ...]:
    """Return the operation modes other than one's own to which configurations belong, each confirmed by walks from
    there."""
    some = beyond[:: max(1, len(beyond) // MODE_CANDIDATES_MAX)]
    strange = [
        at for at in some if (each := identify_mode(at, observation_model)) and not each.signature.may_be_same_mode(own)
    ]
    found = group_modes(
        [
            each
            for at in strange[:MODE_CONFIRMED_MAX]
            if (far := walk_far(at, MODE_WALK_STEPS_COUNT))
            and (each := identify_mode(choose_firmest(far), observation_model))
        ]
    )
    return tuple(group[0] for group in found if not group[0].signature.may_be_same_mode(own))


def identify_mode(at: ClosedConfiguration, observation_model: ObservationModel) -> OperationMode | None:
    """Return the operation mode of a configuration; None if its ranks are not clear, as near a singularity."""
    if (steady := close_precisely(at)) is None or steady.kernel()[1].dropped > EXACT_INCIDENCE_TOL:
        return None
    try:
        found = compute_relation(steady, observation_model)
    except UndefinedValue:
        return None
    return OperationMode(Signature.of(found), at) if found.gap >= RANK_GAP_MIN else None


def find_ways_out(
    start: ClosedConfiguration, observation_model: ObservationModel, rng: np.random.Generator, *, singular: bool
) -> list[ClosedConfiguration]:
    """Return configurations near a ``singular`` zero configuration, or near one at which nothing observed moves to
    first order (a dead centre); raises ``BranchPoint`` if they are not of one mode, ``BadMechanism`` if nothing
    observed moves there either."""
    found = [
        each
        for _ in range(BRANCH_SEARCH_STEPS_COUNT)
        if (beside := step_along(start, draw_velocity(start, rng), leaving=singular)) is not None
        and (each := identify_mode(beside, observation_model)) is not None
    ]
    if not found:
        raise SamplingFailure(start.model.mechanism.name, 0, 1, BRANCH_SEARCH_STEPS_COUNT)
    if all(each.signature.dimension == 0 for each in found):
        _refuse_unmoved([each.at for each in found])
    groups = group_modes(found)
    require_one(
        groups,
        observation_model,
        "several operation modes meet at the zero configuration (its loops have mobility "
        f"{start.kernel()[0].shape[1]} there)",
    )
    return [each.at for each in found]


def _refuse_unmoved(found: Sequence[ClosedConfiguration]) -> None:
    """Raise ``BadMechanism`` that names the links that do move."""
    mechanism = found[0].model.mechanism
    moving = [
        link
        for link in mechanism.links
        if any(np.abs(at.velocity(link) @ at.kernel()[0]).max() > NONZERO_SINGULAR_VALUE_MIN for at in found)
    ]
    named = ", ".join(moving[:REFUSAL_LINKS_PRINTED_MAX]) + (
        f" and {len(moving) - REFUSAL_LINKS_PRINTED_MAX} more" if moving[REFUSAL_LINKS_PRINTED_MAX:] else ""
    )
    raise BadMechanism(
        f"{mechanism.name}: neither the platform nor an observed segment moves, but other links do "
        f"({named}; mobility {found[0].kernel()[0].shape[1]})",
        remedy="Observe a link that moves, with --observe LINK.",
    )


def require_motions(found: Sequence[ClosedConfiguration]) -> None:
    """Raise ``InfinitesimalMobility`` if ker A is larger than the tangent space of the closed configurations, at all
    samples: so if loops repeat each other to first order and not beyond (docs/pages/theory.md, section 1)."""
    done = 0
    for at in sorted(found, key=lambda each: -each.kernel()[1].weakest)[:INFINITESIMAL_SAMPLES_COUNT]:
        mobility = at.kernel()[0].shape[1]
        if (ways := count_ways(at)) is None or ways == mobility:
            return
        done = max(done, ways)
    if found:
        raise InfinitesimalMobility(found[0].model.mechanism.name, found[0].kernel()[0].shape[1], done)


def count_ways(at: ClosedConfiguration) -> int | None:
    """Return the number of independent ways in which small steps along ker A lead to closed configurations; None if one
    does not close. If no constraint is redundant that is the mobility."""
    model, (kernel, rank) = at.model, at.kernel()
    if rank.value == len(model.residual(at.q)):
        return kernel.shape[1]
    predicted = [model.integrate(at.q, FIRST_ORDER_STEP_MAX * each) for each in kernel.T]
    closed = solve_together(TaskBatch(model, None), predicted, [None] * len(predicted), tolerance=CLOSURE_SOLVER_TOL)
    if any(residual > CLOSURE_RESIDUAL_TOL for _, residual in closed):
        return None
    steps = np.array([kernel.T @ model.difference(at.q, q) for q, _ in closed]) / FIRST_ORDER_STEP_MAX
    return int(np.sum(np.linalg.svd(steps, compute_uv=False) > FIRST_ORDER_STEP_MIN_FRACTION))


def require_one(groups: Sequence[Sequence[OperationMode]], observation_model: ObservationModel, what: str) -> None:
    if len(groups) > 1:
        first, at = groups[0][0].signature, groups[0][0].at
        others = [groups[1][0].signature, *[first] * (len(groups) - 1)]
        raise BranchPoint(
            at.model.mechanism.name,
            what,
            [
                group[0].beside(other, [o.leg for o in observation_model.observations])
                for group, other in zip(groups, others, strict=True)
            ],
        )


def walk_far(start: ClosedConfiguration, steps: int = SAMPLE_PATH_STEPS_COUNT) -> list[ClosedConfiguration]:
    """Return the configurations of two random walks in all motions of the mechanism, the second half of each."""
    try:
        walk = list(walk_randomly(start, 2 * steps, steps=steps))
    except SamplingFailure:
        return []
    return [at for number, at in enumerate(walk) if number % steps >= steps // 2]


def choose_firmest(found: Sequence[ClosedConfiguration]) -> ClosedConfiguration:
    """The configuration farthest from a singularity of the loops."""
    return max(found, key=lambda at: at.kernel()[1].weakest)


def close_precisely(here: ClosedConfiguration) -> ClosedConfiguration | None:
    """Return the configuration with its loops closed so well that T_qC does not rotate by the residual; None if numbers
    do not allow that, near a singularity."""
    if here.residual <= TANGENT_ROTATION_TOL * here.kernel()[1].weakest ** 2:
        return here
    model = here.model
    here = ClosedConfiguration.of(model, solve(model, here.q, tolerance=SINGULAR_POSE_RESIDUAL_TOL, iterations=5)[0])
    aside, _ = compute_kernel_basis(model.jacobian(model.integrate(here.q, SLOPE_STEP_MAX * here.loops.right[:, -1])))
    turn = (
        compute_largest_angle(here.kernel()[0], aside) / SLOPE_STEP_MAX
    )  # radians for each unit of the least mobile direction
    return (
        here
        if turn * max(here.residual, SINGULAR_POSE_RESIDUAL_TOL) / here.strengths[-1] <= TANGENT_ROTATION_TOL
        else None
    )


def is_regular(start: ClosedConfiguration, rng: np.random.Generator) -> bool:
    """Return True if some step from a configuration, however short, follows its branch: not so where branches meet."""
    velocity = draw_velocity(start, rng)
    return any(step_along(start, velocity, part) is not None for part in (*HALVED[::3], 1e-4, 1e-5))
