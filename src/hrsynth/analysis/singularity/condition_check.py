"""Words, expression and rank side by side: random poses, and poses on the locus constructed from the expression.

The rank is Pinocchio's, of the relation between the platform and what is measured; words and expression know the legs
by their screws and names alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from ...batch.configuration_builder import ConfigurationBuilder
from ...constraints.condition import Condition, NamedCondition
from ...constraints.pattern import ConstraintPattern, PatternValues
from ...errors import Disagreement, UndefinedValue
from ...geometry.ranks import compute_matrix_spectra, decompose_matrices
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import is_within_limits, mark_beyond_limits
from ...kinematics.velocity_relation import ObservationModel, compute_platform_motions, compute_relation
from ...kinematics.walking import WALK_SINGULAR_VALUE_MIN_FRACTION, walk_randomly
from ...mechanism.cameras import CameraObservation
from ...progress import report
from ...records import As, Number, Recorded, Shown
from ...results import Value
from ...tolerances import (
    CLOSURE_RESIDUAL_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    PSEUDOINVERSE_CUTOFF_FRACTION,
    RANK_CUTOFF_FRACTION,
    RANK_GAP_MIN,
    RELATION_ANGLE_TOL,
    SINGULAR_POSE_DISTANCE_TOL,
    SLOPE_STEP_MAX,
)
from .batch_spectrum import SPECTRUM_CHECKED_POSES_COUNT, Quick
from .rank_descent import RANK_DESCENTS, compute_twist_rates, descend_to_rank_loss, step_from

WEAKEST_POSE_STARTS_COUNT = 8
"""Further starts, the poses of smallest singular value, of walks that cross no singularity."""

CONDITION_CHECK_CHUNK_COUNT = 250
LOCUS_POSES_COUNT = 10
"""Poses on the locus that are constructed, where there are so many."""
LOCUS_SEARCH_STARTS_COUNT = 4
"""Number of poses nearest a singularity from which the locus is searched, if the expression has no sign across it, or
none was found."""
LOCAL_MINIMUM_DECREASE_FRACTION = 1e-6
"""Fraction of its cost by which a step towards the locus must lower it: less is a minimum beside the locus."""
WeakPose = tuple[tuple[bool, float], ClosedConfiguration]
"""A pose, whether joints are beyond their limits there, and its smallest singular value."""


@dataclass(frozen=True, eq=False, repr=False)
class Agreement(Value):
    """Result of the check of the condition: number of poses, and differences between words, expression and rank.
    ``largest_angle`` is the largest angle between the platform motions that each locked leg allows by its named vectors
    and by Pinocchio's relation; ``disagreements`` counts poses at which only one of them finds a singularity."""

    points: Recorded[int]
    disagreements: Recorded[int]
    largest_angle: Recorded[float]
    smallest: Annotated[float, Number, As("smallest_singular_value")]
    """The smallest singular value of the relation met at the random poses."""
    sides: tuple[int, int]
    """Random poses with the expression positive and negative, where it has a sign."""
    on_locus: tuple[ClosedConfiguration, ...]
    searches: Recorded[int]
    """Changes of sign and weak poses from which a pose on the locus was sought."""
    within: Annotated[
        int | None, As("within_limits", optional=True), "number of random poses with all joints within their limits"
    ] = None

    positive = Shown(int, lambda self: self.sides[0])
    negative = Shown(int, lambda self: self.sides[1])
    on_locus_record = Shown(int, lambda self: len(self.on_locus), As("on_locus"))


def compare_condition(
    start: ClosedConfiguration,
    observation_model: ObservationModel,
    pattern: ConstraintPattern,
    condition: Condition,
    count: int,
    *,
    seed: int = 0,
    placer: ConfigurationBuilder | None = None,
) -> Agreement:
    """Compare at ``count`` random reachable poses, at poses on the locus, and at the ends of descents of the rank.
    Poses on the locus are sought within joint limits first, and beyond them where none is found.

    Raises ``Disagreement`` if the rank, the rows behind the words and the expression do not agree. Poses near
    constraint singularities, where no rank is certain, and those at which a leg blocks a platform dof are left out.
    """
    wrong = positive = negative = met = 0
    angle, smallest = 0.0, np.inf
    walk: list[ClosedConfiguration] = []
    signs: list[float] = []
    sizes: list[tuple[float, float]] = []
    low: list[WeakPose] = []
    parts: list[WeakPose] = []
    within: int | None = None
    quick = Quick.of(placer, observation_model)
    walks = walk_randomly(start, count, seed) if quick is None else quick.placer.random_walk(count, seed)
    for number, drawn in enumerate(_split_chunks(walks)):
        chunk = _select_measurable(drawn, observation_model)
        if not chunk:
            continue
        here = pattern.values_at(chunk)
        if quick is None:
            ranks, apart = _verify_smallest_values(here, observation_model, condition)
        else:
            ranks, _ = quick.spectrum(chunk, compute_spectrum, seed + number)
            apart = _verify_smallest_values(
                pattern.values_at(chunk[:: CONDITION_CHECK_CHUNK_COUNT // SPECTRUM_CHECKED_POSES_COUNT]),
                observation_model,
                condition,
            )[1]
        matrices = condition.rows(here)
        spectra, values = np.linalg.svd(matrices, compute_uv=False), condition.evaluate(here, matrices)
        rows, others = spectra[:, -1].astype(float), spectra[:, :-1].prod(axis=1)
        angle = max(angle, apart)
        smallest = min(smallest, float(ranks.min()))
        # the expression is of the size of all singular values' product
        scaled: Array = np.abs(values) / np.clip(others, PSEUDOINVERSE_CUTOFF_FRACTION, 1.0)
        wrong += int(np.sum(_differ(ranks, rows, scaled)))
        positive, negative = positive + int(np.sum(values > 0)), negative + int(np.sum(values < 0))
        met += len(chunk)
        if condition.signed:
            walk += chunk
            signs += list(np.sign(values))
            sizes += zip(np.abs(values), spectra.prod(axis=1), strict=True)
        beyond = mark_beyond_limits(chunk)
        if beyond is not None:
            within = (within or 0) + int(np.sum(~beyond))
        outside = [False] * len(chunk) if beyond is None else beyond.tolist()
        weak = list(zip(zip(outside, ranks.tolist(), strict=True), chunk, strict=True))
        low = sorted([*low, *weak], key=_measure_pair)[:LOCUS_SEARCH_STARTS_COUNT]
        parts.append(min(weak, key=_measure_pair))
        report("random poses")
    on_locus: list[ClosedConfiguration] = []
    if all(leg.tip.link == leg.body for leg in pattern.legs):
        wrong += _count_disproportionate(np.array(sizes))
    loops = WALK_SINGULAR_VALUE_MIN_FRACTION * start.kernel()[1].weakest
    freedoms = max(compute_relation(at, observation_model).dof.value for at in [start, *(at for _, at in low)])
    others = [pair for pair in sorted(parts, key=_measure_pair) if all(pair[1] is not at for _, at in low)][
        :WEAKEST_POSE_STARTS_COUNT
    ]
    searches = 0
    for starts in (
        []
        if condition.never
        else [
            _find_crossings(walk, signs, pattern, condition),
            _search_zeros(low, observation_model, pattern, condition),
            _search_zeros(others, observation_model, pattern, condition),
        ]
    ):
        new: list[ClosedConfiguration] = []
        for at in starts:
            searches += 1
            if (
                at is None
                or _is_undecided_place(at, observation_model, loops, freedoms)
                or _is_known(at, [*on_locus, *new], observation_model)
            ):
                continue
            sigma = float(_verify_smallest_values(pattern.values_at([at]), observation_model, condition)[0][0])
            if sigma > RANK_CUTOFF_FRACTION:
                wrong += 1
            new.append(at)
            if len(new) == LOCUS_POSES_COUNT:
                break
        on_locus += new
        if any(map(is_within_limits, new)):
            break
    on_locus.sort(key=is_within_limits, reverse=True)
    report("poses nearest a singularity")
    for _, near in [*low, *others][:RANK_DESCENTS]:
        at = descend_to_rank_loss(near, observation_model)
        if at is not None and not _is_undecided_place(at, observation_model, loops, freedoms):
            wrong += _is_missed(at, observation_model, pattern, condition)
    found = Agreement(met, wrong, angle, smallest, (positive, negative), tuple(on_locus), searches, within)
    if wrong or angle > RANK_CUTOFF_FRACTION * RANK_GAP_MIN:
        raise Disagreement(start.model.mechanism.name, wrong, angle)
    return found


def compute_smallest_value(at: ClosedConfiguration, observation_model: ObservationModel) -> float:
    """The smallest singular value of Mᵀ on an orthonormal basis of the platform's twists (characteristic lengths)."""
    return float(_compute_relations([at], observation_model)[0][0])


def compute_spectrum(
    configurations: Sequence[ClosedConfiguration], observation_model: ObservationModel
) -> tuple[Array, Array]:
    """The smallest and the largest singular value of Mᵀ at each configuration, (n,) each (characteristic lengths)."""
    smallest, parts = _compute_relations(configurations, observation_model)
    return smallest, np.array([part[2] for part in parts])


def _select_measurable(
    chunk: list[ClosedConfiguration], observation_model: ObservationModel
) -> list[ClosedConfiguration]:
    """Return those at which everything has a value: no camera is within a cylinder."""
    if not any(isinstance(o, CameraObservation) and o.radius is not None for o in observation_model.observations):
        return chunk
    return [at for at in chunk if _has_values(at, observation_model)]


def _has_values(at: ClosedConfiguration, observation_model: ObservationModel) -> bool:
    try:
        observation_model.rows(at)
    except UndefinedValue:
        return False
    return True


def _is_undecided_place(
    at: ClosedConfiguration, observation_model: ObservationModel, loops: float, freedoms: int
) -> bool:
    """Return True if no rank is certain at a configuration, or the platform itself has fewer dof there."""
    return (
        not _has_values(at, observation_model)
        or at.kernel()[1].weakest < loops
        or compute_relation(at, observation_model).dof.value < freedoms
    )


def _is_missed(
    at: ClosedConfiguration, observation_model: ObservationModel, pattern: ConstraintPattern, condition: Condition
) -> bool:
    """Return True if the rows behind the words clearly keep their rank where the relation loses its own."""
    try:
        rows = condition.rows(pattern.values_at([at]))
    except UndefinedValue:
        return False
    return bool(_differ(_compute_relations([at], observation_model)[0], compute_smallest_values(rows))[0])


def compute_smallest_values(rows: Array) -> Array:
    """The smallest singular value of each of many matrices, (n,)."""
    return np.asarray(np.linalg.svd(rows, compute_uv=False)[:, -1], dtype=float)


def _count_disproportionate(sizes: Array) -> int:
    """Return the number of poses at which a signed expression is not the same multiple of the rows' volume as
    elsewhere; for tips that are fixed in the platform."""
    if len(sizes) == 0:
        return 0
    values, volumes = sizes.T
    factor = float(values.sum() / volumes.sum()) if volumes.sum() > 0 else 0.0
    return int(np.sum(np.abs(values - factor * volumes) > RELATION_ANGLE_TOL * values.max()))


def _split_chunks(configurations: Iterator[ClosedConfiguration]) -> Iterator[list[ClosedConfiguration]]:
    chunk: list[ClosedConfiguration] = []
    for at in configurations:
        chunk.append(at)
        if len(chunk) == CONDITION_CHECK_CHUNK_COUNT:
            yield chunk
            chunk = []
    if chunk:
        yield chunk


def _differ(*measures: Array) -> Array:
    """Mask of the poses at which one measure is zero and another is clearly not."""
    table = np.array(measures)
    return (table.min(axis=0) < RANK_CUTOFF_FRACTION) & (table.max(axis=0) > RANK_CUTOFF_FRACTION * RANK_GAP_MIN)


def _compute_relations(
    chunk: Sequence[ClosedConfiguration], observation_model: ObservationModel, bodies: tuple[str, ...] = ()
) -> tuple[Array, list[tuple[Array, Array, float]]]:
    """Smallest singular value of Mᵀ at each configuration; for each the measured rates and the twists of ``bodies`` for
    a basis of the platform's motions, (m, k) and (6 bodies, k), and the largest singular value."""
    sigma, parts = [], []
    for at in chunk:
        found = compute_relation(at, replace(observation_model, bodies=bodies))
        M, _ = compute_twist_rates(found)
        values = np.linalg.svd(M, compute_uv=False) if M.shape[1] else np.zeros(1)
        sigma.append(float(values[-1]) if M.shape[1] <= len(M) else 0.0)
        parts.append((rates := found.rates, found.basis[found.twist_rows + len(rates) :], float(values[0])))
    return np.array(sigma), parts


def _verify_smallest_values(
    here: PatternValues, observation_model: ObservationModel, condition: Condition
) -> tuple[Array, float]:
    """Smallest singular values by Pinocchio, and the largest angle between the motions that a locked leg allows by its
    named vectors and by Pinocchio."""
    named = isinstance(condition, NamedCondition)
    sigma, parts = _compute_relations(here.configurations, observation_model, here.pattern.bodies if named else ())
    labels = np.repeat([o.leg for o in observation_model.observations], observation_model.sizes)
    angle = 0.0
    for leg in here.pattern.legs if named else ():
        locked = np.isin(labels, leg.held_by)
        spectra = compute_matrix_spectra([rates[locked] for rates, _, _ in parts], 1.0)
        products = [
            block @ twists @ spectrum.kernel
            for (_, twists, _), block, spectrum in zip(parts, here.allowances(leg), spectra, strict=True)
        ]
        angle = max(angle, *(s[0] for _, s, _ in decompose_matrices(products) if len(s)), 0.0)
    return sigma, angle


def _find_crossings(
    walk: Sequence[ClosedConfiguration], signs: Sequence[float], pattern: ConstraintPattern, condition: Condition
) -> Iterator[ClosedConfiguration | None]:
    """Zeros of the expression between neighbours of a walk at which it has different signs, those between neighbours
    within joint limits first; None where one is not found."""
    from scipy.optimize import brentq

    pairs = [(before, after) for (before, a), (after, b) in pairwise(zip(walk, signs, strict=True)) if a * b < 0]
    for one, two in sorted(pairs, key=lambda pair: not all(map(is_within_limits, pair))):
        model = one.model
        step = model.difference(one.q, two.q)
        if np.linalg.norm(step) > 1.0:
            continue

        def there(fraction: float, one: ClosedConfiguration = one, step: Array = step) -> ClosedConfiguration:
            return step_from(one, fraction * step)

        def value(fraction: float, there: Callable[[float], ClosedConfiguration] = there) -> float:
            return float(condition.evaluate(pattern.values_at([there(fraction)]))[0])

        if value(0.0) * value(1.0) >= 0:
            yield None
            continue
        root = there(float(brentq(value, 0.0, 1.0, xtol=1e-15, rtol=1e-14)))
        if root.residual <= CLOSURE_RESIDUAL_TOL:
            found = _sharpen(ClosedConfiguration.of(model, root.q), step, pattern, condition)
            yield (
                found
                if abs(float(condition.evaluate(pattern.values_at([found]))[0])) <= HIDDEN_ROBOT_RESIDUAL_TOL
                else None
            )


def _sharpen(
    at: ClosedConfiguration, step: Array, pattern: ConstraintPattern, condition: Condition
) -> ClosedConfiguration:
    """A last Newton step along the mechanism's own motion, too short to need closing again."""
    kernel, _ = at.kernel()
    motion = kernel @ (kernel.T @ step)
    motion /= np.linalg.norm(motion)

    def value(size: float) -> float:
        q = at.model.integrate(at.q, size * motion)
        return float(condition.evaluate(pattern.values_at([ClosedConfiguration(at.model, q, at.residual)]))[0])

    here, slope = value(0.0), (value(SLOPE_STEP_MAX) - value(-SLOPE_STEP_MAX)) / (2 * SLOPE_STEP_MAX)
    if slope == 0.0 or abs(here / slope) > SLOPE_STEP_MAX:
        return at
    return ClosedConfiguration.of(at.model, at.model.integrate(at.q, -here / slope * motion))


def _search_zeros(
    low: Sequence[WeakPose],
    observation_model: ObservationModel,
    pattern: ConstraintPattern,
    condition: Condition,
) -> Iterator[ClosedConfiguration | None]:
    """Zeros of the rows searched from poses near a singularity: rows(q) x = 0 with |x| = 1; None where one is not
    found."""
    for _, start in low:
        yield descend(start, observation_model, pattern, condition)


def _measure_pair(pair: WeakPose) -> tuple[bool, float]:
    return pair[0]


def _is_known(
    at: ClosedConfiguration, others: Sequence[ClosedConfiguration], observation_model: ObservationModel
) -> bool:
    """Return True if a configuration's platform pose is one of others'."""
    X = at.pose(observation_model.platform)
    return any(
        np.linalg.norm(X - other.pose(observation_model.platform)) <= SINGULAR_POSE_DISTANCE_TOL for other in others
    )


def descend(
    start: ClosedConfiguration, observation_model: ObservationModel, pattern: ConstraintPattern, condition: Condition
) -> ClosedConfiguration | None:
    """Return a pose on the locus near ``start``: least squares in the platform's motions and the unobserved one; None
    if there is none near."""
    from scipy.optimize import least_squares

    here, before = start, np.inf
    for _ in range(4):
        motion = compute_platform_motions(here, observation_model)
        count = motion.shape[1]
        start_rows = condition.rows(pattern.values_at([here]))[0]
        shape, x0 = start_rows.shape, np.linalg.svd(start_rows)[2][-1]

        def reached(s: Array, here: ClosedConfiguration = here, motion: Array = motion) -> ClosedConfiguration:
            return step_from(here, motion @ s)

        def residuals(
            z: Array,
            count: int = count,
            shape: tuple[int, ...] = shape,
            reached: Callable[[Array], ClosedConfiguration] = reached,
        ) -> Array:
            at = reached(z[:count])
            x = z[count:]
            try:
                rows = condition.rows(pattern.values_at([at]))[0]
            except UndefinedValue:
                return np.ones(shape[0] + 1)
            if at.residual > CLOSURE_RESIDUAL_TOL or rows.shape[1] != len(x):
                return np.ones(shape[0] + 1)
            return np.append(rows @ x, x @ x - 1.0)

        limits = np.concatenate([np.full(count, 0.3), np.full(len(x0), 2.0)])
        fit = least_squares(
            residuals,
            np.concatenate([np.zeros(count), x0]),
            bounds=(-limits, limits),
            xtol=1e-15,
            ftol=LOCAL_MINIMUM_DECREASE_FRACTION,  # costs that end at zero fall by more
            gtol=1e-15,
            max_nfev=60,
        )
        there = reached(fit.x[:count])
        if there.residual > CLOSURE_RESIDUAL_TOL:
            return None
        here = ClosedConfiguration.of(there.model, there.q)
        if np.linalg.norm(fit.fun) < HIDDEN_ROBOT_RESIDUAL_TOL:
            return here
        if fit.cost > before / 2:
            return None
        before = fit.cost
    return None
