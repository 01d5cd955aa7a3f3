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
from ...budgets import RANK_DESCENTS, WEAKEST_STARTS
from ...constraints.condition import Condition, Named
from ...constraints.pattern import ConstraintPattern, PatternValues
from ...errors import Disagreement, UndefinedValue
from ...geometry.ranks import kernel_basis
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.velocity_relation import ObservationModel, platform_motions, relation
from ...kinematics.walking import WEAKEST, random_walk
from ...mechanism.cameras import CameraObservation
from ...progress import report
from ...records import As, Number, Recorded, Shown
from ...results import Value
from ...tolerances import CLOSED, FOLLOWED, INVERTED, NUDGE, RANK_CUTOFF, RANK_GAP, SAME_RELATION, SAME_SPOT
from .batch_spectrum import SPOTS, Quick
from .rank_descent import lose, rates_of_twists, step_from

CHUNK = 250
ON_LOCUS = 10
"""Poses on the locus that are constructed, where there are so many."""
TRIES = 4
"""Number of poses nearest a singularity from which the locus is searched, if the expression has no sign across it, or
none was found."""


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

    positive = Shown(int, lambda self: self.sides[0])
    negative = Shown(int, lambda self: self.sides[1])
    on_locus_record = Shown(int, lambda self: len(self.on_locus), As("on_locus"))


def agreement(
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

    Raises ``Disagreement`` if the rank, the rows behind the words and the expression do not agree. Poses near
    constraint singularities, where no rank is certain, and those at which a leg blocks a platform dof are left out.
    """
    wrong = positive = negative = met = 0
    angle, smallest = 0.0, np.inf
    walk: list[ClosedConfiguration] = []
    signs: list[float] = []
    sizes: list[tuple[float, float]] = []
    low: list[tuple[float, ClosedConfiguration]] = []
    parts: list[tuple[float, ClosedConfiguration]] = []
    quick = Quick.of(placer, observation_model)
    walks = random_walk(start, count, seed) if quick is None else quick.placer.random_walk(count, seed)
    for number, drawn in enumerate(_chunks(walks)):
        chunk = _measurable(drawn, observation_model)
        if not chunk:
            continue
        here = pattern.values_at(chunk)
        if quick is None:
            ranks, apart = _weakest(here, observation_model, condition)
        else:
            ranks, _ = quick.spectrum(chunk, spectrum, seed + number)
            apart = _weakest(pattern.values_at(chunk[:: CHUNK // SPOTS]), observation_model, condition)[1]
        matrices = condition.rows(here)
        spectra, values = np.linalg.svd(matrices, compute_uv=False), condition.evaluate(here)
        rows, others = spectra[:, -1].astype(float), spectra[:, :-1].prod(axis=1)
        angle = max(angle, apart)
        smallest = min(smallest, float(ranks.min()))
        # the expression is of the size of all singular values' product
        scaled: Array = np.abs(values) / np.clip(others, INVERTED, 1.0)
        wrong += int(np.sum(_differ(ranks, rows, scaled)))
        positive, negative = positive + int(np.sum(values > 0)), negative + int(np.sum(values < 0))
        met += len(chunk)
        if condition.signed:
            walk += chunk
            signs += list(np.sign(values))
            sizes += zip(np.abs(values), spectra.prod(axis=1), strict=True)
        low = sorted([*low, *zip(ranks.tolist(), chunk, strict=True)], key=_size)[:TRIES]
        parts.append(min(zip(ranks.tolist(), chunk, strict=True), key=_size))
        report("random poses")
    on_locus: list[ClosedConfiguration] = []
    if all(leg.tip.link == leg.body for leg in pattern.legs):
        wrong += _out_of_proportion(np.array(sizes))
    loops = WEAKEST * start.kernel()[1].weakest
    freedoms = max(relation(at, observation_model).dof.value for at in [start, *(at for _, at in low)])
    others = [pair for pair in sorted(parts, key=_size) if all(pair[1] is not at for _, at in low)][:WEAKEST_STARTS]
    searches = 0
    for starts in (
        []
        if condition.never
        else [
            _crossings(walk, signs, pattern, condition),
            _descents(low, observation_model, pattern, condition),
            _descents(others, observation_model, pattern, condition),
        ]
    ):
        for at in starts:
            searches += 1
            if (
                at is None
                or _beside(at, observation_model, loops, freedoms)
                or _is_known(at, on_locus, observation_model)
            ):
                continue
            sigma = float(_weakest(pattern.values_at([at]), observation_model, condition)[0][0])
            if sigma > RANK_CUTOFF:
                wrong += 1
            on_locus.append(at)
            if len(on_locus) == ON_LOCUS:
                break
        if on_locus:
            break
    report("poses nearest a singularity")
    for _, weak in [*low, *others][:RANK_DESCENTS]:
        at = lose(weak, observation_model)
        if at is not None and not _beside(at, observation_model, loops, freedoms):
            wrong += _is_missed(at, observation_model, pattern, condition)
    found = Agreement(met, wrong, angle, smallest, (positive, negative), tuple(on_locus), searches)
    if wrong or angle > RANK_CUTOFF * RANK_GAP:
        raise Disagreement(start.model.mechanism.name, wrong, angle)
    return found


def weakest(at: ClosedConfiguration, observation_model: ObservationModel) -> float:
    """The smallest singular value of Mᵀ on an orthonormal basis of the platform's twists (characteristic lengths)."""
    return float(_relations([at], observation_model)[0][0])


def spectrum(configurations: Sequence[ClosedConfiguration], observation_model: ObservationModel) -> tuple[Array, Array]:
    """The smallest and the largest singular value of Mᵀ at each configuration, (n,) each (characteristic lengths)."""
    smallest, parts = _relations(configurations, observation_model)
    return smallest, np.array([part[2] for part in parts])


def _measurable(chunk: list[ClosedConfiguration], observation_model: ObservationModel) -> list[ClosedConfiguration]:
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


def _beside(at: ClosedConfiguration, observation_model: ObservationModel, loops: float, freedoms: int) -> bool:
    """Return True if no rank is certain at a configuration, or the platform itself has fewer dof there."""
    return (
        not _has_values(at, observation_model)
        or at.kernel()[1].weakest < loops
        or relation(at, observation_model).dof.value < freedoms
    )


def _is_missed(
    at: ClosedConfiguration, observation_model: ObservationModel, pattern: ConstraintPattern, condition: Condition
) -> bool:
    """Return True if the rows behind the words clearly keep their rank where the relation loses its own."""
    try:
        rows = condition.rows(pattern.values_at([at]))
    except UndefinedValue:
        return False
    return bool(_differ(_relations([at], observation_model)[0], smallest_of(rows))[0])


def smallest_of(rows: Array) -> Array:
    """The smallest singular value of each of many matrices, (n,)."""
    return np.asarray(np.linalg.svd(rows, compute_uv=False)[:, -1], dtype=float)


def _out_of_proportion(sizes: Array) -> int:
    """Return the number of poses at which a signed expression is not the same multiple of the rows' volume as
    elsewhere; for tips that are fixed in the platform."""
    if len(sizes) == 0:
        return 0
    values, volumes = sizes.T
    factor = float(values.sum() / volumes.sum()) if volumes.sum() > 0 else 0.0
    return int(np.sum(np.abs(values - factor * volumes) > SAME_RELATION * values.max()))


def _chunks(configurations: Iterator[ClosedConfiguration]) -> Iterator[list[ClosedConfiguration]]:
    chunk: list[ClosedConfiguration] = []
    for at in configurations:
        chunk.append(at)
        if len(chunk) == CHUNK:
            yield chunk
            chunk = []
    if chunk:
        yield chunk


def _differ(*measures: Array) -> Array:
    """Mask of the poses at which one measure is zero and another is clearly not."""
    table = np.array(measures)
    return (table.min(axis=0) < RANK_CUTOFF) & (table.max(axis=0) > RANK_CUTOFF * RANK_GAP)


def _relations(
    chunk: Sequence[ClosedConfiguration], observation_model: ObservationModel, bodies: tuple[str, ...] = ()
) -> tuple[Array, list[tuple[Array, Array, float]]]:
    """Smallest singular value of Mᵀ at each configuration; for each the measured rates and the twists of ``bodies`` for
    a basis of the platform's motions, (m, k) and (6 bodies, k), and the largest singular value."""
    sigma, parts = [], []
    for at in chunk:
        found = relation(at, replace(observation_model, bodies=bodies))
        M, _ = rates_of_twists(found)
        values = np.linalg.svd(M, compute_uv=False) if M.shape[1] else np.zeros(1)
        sigma.append(float(values[-1]) if M.shape[1] <= len(M) else 0.0)
        parts.append((rates := found.rates, found.basis[found.twist_rows + len(rates) :], float(values[0])))
    return np.array(sigma), parts


def _weakest(here: PatternValues, observation_model: ObservationModel, condition: Condition) -> tuple[Array, float]:
    """Smallest singular values by Pinocchio, and the largest angle between the motions that a locked leg allows by its
    named vectors and by Pinocchio."""
    named = isinstance(condition, Named)
    sigma, parts = _relations(here.configurations, observation_model, here.pattern.bodies if named else ())
    labels = np.repeat([o.leg for o in observation_model.observations], observation_model.sizes)
    angle = 0.0
    for leg in here.pattern.legs if named else ():
        for (rates, twists, _), block in zip(parts, here.allowances(leg), strict=True):
            held, _ = kernel_basis(rates[np.isin(labels, leg.held_by)], 1.0)
            angle = max(angle, float(np.linalg.norm(block @ twists @ held, 2)))
    return sigma, angle


def _crossings(
    walk: Sequence[ClosedConfiguration], signs: Sequence[float], pattern: ConstraintPattern, condition: Condition
) -> Iterator[ClosedConfiguration | None]:
    """Zeros of the expression between neighbours of a walk at which it has different signs, None where one is not
    found."""
    from scipy.optimize import brentq

    for (one, a), (two, b) in pairwise(zip(walk, signs, strict=True)):
        if a * b >= 0:
            continue
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
        if root.residual <= CLOSED:
            found = _sharpen(ClosedConfiguration.of(model, root.q), step, pattern, condition)
            yield found if abs(float(condition.evaluate(pattern.values_at([found]))[0])) <= FOLLOWED else None


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

    here, slope = value(0.0), (value(NUDGE) - value(-NUDGE)) / (2 * NUDGE)
    if slope == 0.0 or abs(here / slope) > NUDGE:
        return at
    return ClosedConfiguration.of(at.model, at.model.integrate(at.q, -here / slope * motion))


def _descents(
    low: Sequence[tuple[float, ClosedConfiguration]],
    observation_model: ObservationModel,
    pattern: ConstraintPattern,
    condition: Condition,
) -> Iterator[ClosedConfiguration | None]:
    """Zeros of the rows searched from poses near a singularity: rows(q) x = 0 with |x| = 1; None where one is not
    found."""
    for _, start in low:
        yield descend(start, observation_model, pattern, condition)


def _size(pair: tuple[float, ClosedConfiguration]) -> float:
    return pair[0]


def _is_known(
    at: ClosedConfiguration, others: Sequence[ClosedConfiguration], observation_model: ObservationModel
) -> bool:
    """Return True if a configuration's platform pose is one of others'."""
    X = at.pose(observation_model.platform)
    return any(np.linalg.norm(X - other.pose(observation_model.platform)) <= SAME_SPOT for other in others)


def descend(
    start: ClosedConfiguration, observation_model: ObservationModel, pattern: ConstraintPattern, condition: Condition
) -> ClosedConfiguration | None:
    """Return a pose on the locus near ``start``: least squares in the platform's motions and the unobserved one; None
    if there is none near."""
    from scipy.optimize import least_squares

    here = start
    for _ in range(4):
        motion = platform_motions(here, observation_model)
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
            if at.residual > CLOSED or rows.shape[1] != len(x):
                return np.ones(shape[0] + 1)
            return np.append(rows @ x, x @ x - 1.0)

        limits = np.concatenate([np.full(count, 0.3), np.full(len(x0), 2.0)])
        fit = least_squares(
            residuals,
            np.concatenate([np.zeros(count), x0]),
            bounds=(-limits, limits),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=60,
        )
        there = reached(fit.x[:count])
        if there.residual > CLOSED:
            return None
        here = ClosedConfiguration.of(there.model, there.q)
        if np.linalg.norm(fit.fun) < FOLLOWED:
            return here
    return None
