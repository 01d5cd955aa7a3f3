"""Tests of steps along a branch, and signatures that distinguish operation modes.

Components of the configuration space meet where the loops lose rank, and the smallest singular values fall there in
proportion to the distance. So a step stays on its branch if, along it and along its correction, mobility, tangent space
and all singular values of the loops agree: then it is short compared with the distance to the next such point. This is
measured at four points, not proved between them. Source: docs/pages/theory.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np

from ..geometry.ranks import compute_largest_angle, compute_singular_values
from ..geometry.vectors import Array
from ..tolerances import NONZERO_SINGULAR_VALUE_MIN, RANK_CUTOFF_FRACTION, SLOPE_STEP_MAX, ZERO_SINGULAR_VALUE_MAX
from .configuration import ClosedConfiguration
from .velocity_relation import VelocityRelation

BOUND_ROUNDING_FRACTION = 1e-3
"""Fraction of a limit that a bound reserves for rounding."""

TANGENT_ANGLE_MAX_RAD = 0.3
"""Largest principal angle (radians) between the tangent spaces at both ends of a step."""
SINGULAR_VALUE_RATIO_MAX = 1.5
"""Largest ratio between the loops' singular values, in order, at the start of a step and along it."""
STEP_CORRECTION_MAX_FRACTION = 0.2
"""Longest correction, as part of the step: the bend of a smooth branch that ``TANGENT_ANGLE_MAX_RAD`` allows, with a
margin."""
EVEN_DECREASE_TOL = 0.2
"""Part of the smallest singular value by which its fall to a singularity may differ from a linear one."""
ALL_OBSERVATION_SETS_MAX = 4
"""Number of observations up to which all sets of them are compared; beyond, single ones, pairs and all."""


def is_on_branch(here: ClosedConfiguration, step: Array, there: ClosedConfiguration) -> bool:
    """Return True if ``there``, to which the tangent ``step`` (nv,) from ``here`` was corrected, is near ``here`` on
    its branch: same mobility, tangent spaces close, no sheet beside it, singular values alike half way, at the step's
    end and there."""
    kept = here.strengths
    if len(there.strengths) != len(kept):
        return False
    if not len(kept):
        return True
    return (
        _has_similar_values(kept, there.strengths)
        and _has_same_determinant_sign(here, there)
        and is_small_principal_angle(here.kernel()[0], there.kernel()[0])
        and has_steady_values_along(here, step)
    )


def has_steady_values_along(here: ClosedConfiguration, step: Array) -> bool:
    """Return True if the loops' singular values half way along a step and at its end are like those ``here``."""
    return not len(here.strengths) or all(has_steady_values_after(here, part * step) for part in (0.5, 1.0))


def is_small_principal_angle(A: Array, B: Array) -> bool:
    """Return True if the largest principal angle is at most ``TANGENT_ANGLE_MAX_RAD``: its sine is at most the
    Frobenius norm of the outer part."""
    if A.shape == B.shape and np.linalg.norm(B - A @ (A.T @ B)) < (1 - BOUND_ROUNDING_FRACTION) * np.sin(
        TANGENT_ANGLE_MAX_RAD
    ):
        return True
    return compute_largest_angle(A, B) <= TANGENT_ANGLE_MAX_RAD


def has_steady_values_after(here: ClosedConfiguration, step: Array) -> bool:
    """Return True if the loops' singular values after a step are like those ``here``.

    With J = U S Vᵀ here, J' there, A = S⁻¹ Uᵀ J' and δ = ‖A Aᵀ − 1‖: σ'² of Uᵀ J' lies in (1 ± δ) σ², and that of J'
    exceeds it by no more than ‖J' − U Uᵀ J'‖². Singular values are computed only if these bounds do not decide.
    """
    kept, U = here.strengths, here.loops.left
    J = here.model.jacobian(here.model.integrate(here.q, step))
    within = U.T @ J
    A = within / kept[:, None]
    product = A @ A.T
    product.reshape(-1)[:: len(kept) + 1] -= 1.0
    change = float(np.linalg.norm(product))
    beyond = float(np.linalg.norm(J - U @ within)) / kept[-1]
    if change < (1 - BOUND_ROUNDING_FRACTION) * (1 - SINGULAR_VALUE_RATIO_MAX**-2) and change + beyond**2 < (
        1 - BOUND_ROUNDING_FRACTION
    ) * (SINGULAR_VALUE_RATIO_MAX**2 - 1):
        return True
    return _has_similar_values(kept, np.asarray(np.linalg.svd(J, compute_uv=False)[: len(kept)]))


def is_on_branch_at_end(here: ClosedConfiguration, step: Array, there: ClosedConfiguration) -> bool:
    """Return True if a step passes :func:`is_on_branch` at the end of a path, which may be a singularity or near one:
    the smallest singular value may fall to zero, linearly and without a change of its sign, while all others stay
    alike."""
    kept, ahead = here.strengths, there.strengths
    others = len(kept) - 1
    if not others <= len(ahead) <= len(kept):
        return False
    T, tangent = here.kernel()[0], there.kernel()[0]
    if np.linalg.norm(T - tangent @ (tangent.T @ T), 2) > np.sin(TANGENT_ANGLE_MAX_RAD):
        return False
    w, n = here.loops.left[:, others], here.loops.right[:, others]
    middle, end = (
        float(w @ here.model.jacobian(here.model.integrate(here.q, part * step)) @ n) / kept[others]
        for part in (0.5, 1.0)
    )
    if not (-SLOPE_STEP_MAX <= end < 1 and abs(middle - (1 + end) / 2) < EVEN_DECREASE_TOL):
        return False
    if len(ahead) == len(kept) and not _has_similar_values(ahead, _compute_values(here, step, len(kept))):
        return False
    return _has_similar_values(kept[:others], ahead[:others]) and _has_similar_values(
        kept[:others], _compute_values(here, step, others)
    )


def _has_same_determinant_sign(here: ClosedConfiguration, there: ClosedConfiguration) -> bool:
    """Return True if the determinant of the loops, in the bases of their range and corange at ``here``, keeps its sign:
    two sheets of the configuration space beside each other have opposite ones (for y (y − d) = 0, ∓d)."""
    across = here.loops.left.T @ there.model.jacobian(there.q) @ here.loops.right
    return bool(np.linalg.slogdet(across)[0] > 0)


def _compute_values(here: ClosedConfiguration, step: Array, count: int) -> Array:
    """The largest singular values of the loops after a step."""
    return np.asarray(np.linalg.svd(here.model.jacobian(here.model.integrate(here.q, step)), compute_uv=False)[:count])


def _has_similar_values(one: Array, other: Array) -> bool:
    return not np.any((other > SINGULAR_VALUE_RATIO_MAX * one) | (one > SINGULAR_VALUE_RATIO_MAX * other))


def rank_rotations(found: VelocityRelation) -> tuple[int, int, int]:
    """Return the rank of the angular velocities of the platform (of a formation: of all links), and its least and
    largest possible value: singular values above the cutoff, those that surely count, and all but those that surely do
    not."""
    freedoms = found.dof.value
    values = (
        np.zeros(0)
        if found.twist_rows == 3 or not freedoms
        else compute_singular_values(found.twists.reshape(-1, 6, freedoms)[:, 3:].reshape(1, -1, freedoms))
    )
    rank, least, most = (
        int(np.sum(values > zero))
        for zero in (RANK_CUTOFF_FRACTION, NONZERO_SINGULAR_VALUE_MIN, ZERO_SINGULAR_VALUE_MAX)
    )
    return rank, least, most


@dataclass(frozen=True)
class Signature:
    """Signature of an operation mode: the same at all its generic configurations.

    ``turns`` is the rank of the platform's angular velocities, ``turning`` its least and largest value, as of
    :func:`rank_rotations`. ``seen`` has, for each of :func:`list_observation_sets` the observations, the least and
    largest number of platform dof that they may observe, between singular values that surely count and those that
    surely do not."""

    mobility: int
    dimension: int
    dof: int
    turns: int
    turning: tuple[int, int]
    seen: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, found: VelocityRelation) -> Signature:
        """The signature that ρ shows at one configuration."""
        turns, *turning = rank_rotations(found)
        chosen = _choose_rows(found.sizes)
        rates = found.rates * chosen[:, :, None]
        twists = np.broadcast_to(found.twist_part, (len(chosen), *found.twist_part.shape))
        lost = [compute_singular_values(each) for each in (np.concatenate([twists, rates], axis=1), rates)]
        # a set S observes dof − (rank [X; Y_S] − rank Y_S) of the platform's dof
        together, alone = (
            [np.sum(values > zero, axis=1) for zero in (NONZERO_SINGULAR_VALUE_MIN, ZERO_SINGULAR_VALUE_MAX)]
            for values in lost
        )
        dof = found.dof.value
        least, most = dof - (together[1] - alone[0]), dof - (together[0] - alone[1])
        return cls(
            found.mobility,
            found.dimension,
            dof,
            turns,
            (turning[0], turning[1]),
            tuple(zip(least.tolist(), most.tolist(), strict=True)),
        )

    def may_be_same_mode(self, other: Signature) -> bool:
        """Return True if both can be of one operation mode."""
        same = (self.mobility, self.dimension, self.dof) == (other.mobility, other.dimension, other.dof)
        return same and all(
            a[0] <= b[1] and b[0] <= a[1]
            for a, b in zip((self.turning, *self.seen), (other.turning, *other.seen), strict=True)
        )

    @property
    def motion(self) -> str:
        """Translations and other motions of the platform: 3T, 2T1R, 1T2R, 3T3R …"""
        parts = ((self.dof - self.turns, "T"), (self.turns, "R"))
        return "".join(f"{count}{letter}" for count, letter in parts if count) or "fixed"


@dataclass(frozen=True, eq=False)
class OperationMode:
    """Operation mode that was found: its signature, and one of its configurations."""

    signature: Signature
    at: ClosedConfiguration

    def beside(self, other: Signature, labels: Sequence[str]) -> str:
        """Return the platform's motion in this mode, and the number of dof that legs (``labels``, by observation)
        observe there and not in the mode of ``other``, or the other way round."""
        own, sets = self.signature, list_observation_sets(len(labels))
        text = f"{own.dof} dof ({own.motion}), mobility {own.mobility}"
        apart = [
            (places, a[0])
            for places, a, b in zip(sets, own.seen, other.seen, strict=False)
            if own.dof != other.dof or a[0] > b[1] or b[0] > a[1]
        ]
        if not apart:
            return text
        places, seen = apart[0]
        return f"{text}, legs {', '.join(labels[i] for i in places)} observe {seen} of {own.dof}"


def group_modes(found: Sequence[OperationMode]) -> list[list[OperationMode]]:
    """Group configurations whose signatures agree, the largest group first."""
    groups: list[list[OperationMode]] = []
    for each in found:
        home = next((group for group in groups if group[0].signature.may_be_same_mode(each.signature)), None)
        if home is None:
            groups.append([each])
        else:
            home.append(each)
    return sorted(groups, key=len, reverse=True)


@lru_cache(maxsize=64)
def list_observation_sets(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the sets of observations whose ranks are compared, by their indices."""
    sizes = range(1, count + 1) if count <= ALL_OBSERVATION_SETS_MAX else (1, 2, count)
    return tuple(each for size in sizes for each in combinations(range(count), size))


@lru_cache(maxsize=64)
def _choose_rows(sizes: tuple[int, ...]) -> Array:
    """Return 1 in the rows of the rates that belong to each set, (sets, rows)."""
    owner = np.repeat(np.arange(len(sizes)), sizes)
    sets = [np.isin(owner, places) for places in list_observation_sets(len(sizes))]
    return np.array(sets, dtype=float).reshape(len(sets), len(owner))
