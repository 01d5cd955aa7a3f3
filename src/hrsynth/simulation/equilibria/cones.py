"""Cones about a goal in which the error is proved to rise along every ray.

Rays x = t W w start at the goal; w runs over the faces of the cube [−1, 1]ⁿ, W = H^(−½) with H the Hessian of E at the
goal, so that E ≈ ½ t² |w|². A cone is a box of w in a face. In it E's rate along the ray is enclosed above zero from
slice to slice of t; in the first slice, from t = 0 on where it vanishes, its second derivative is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import make_affine, stack
from ...geometry.vectors import Array
from ...solving.exhaust import AGAIN, Boxes, Exhaustion
from ...tolerances import AFFINE_ROUNDING, CHAIN_ROUNDING, HIDDEN_ROBOT_RESIDUAL_TOL
from .pose_error import Number, PoseError

NARROWEST_RISING_CONE = 2.0**-7
"""Smallest half-width of a cone around a goal, in faces of the cube [-1, 1] to the n."""
SHORTEST_SLICE = 2.0**-9
"""Smallest length of a slice of such a cone, in square roots of twice the error."""
CONE_SLICES_MAX = 60_000
"""Largest number of slices of cones in the proof that the error rises along every ray from a goal."""
CONE_BATCH_COUNT = 2048
"""Cones whose next slice is tried together: those of the lowest levels."""

LONG_SLICE = 1 / 16
"""Length of a slice above which it is made shorter before its cone is cut."""
CONE_SLICE_GROWTH_FRACTION = 1.5
"""Factor by which the next slice is longer after a proved one."""


@dataclass(frozen=True, eq=False)
class ConeProver:
    """Enclosures of the error over slices of cones, with ``W`` (n, n) and Q (rows, n), the rates of e by w at the goal:
    reach margins, e (rows) and its rates along the ray."""

    error: PoseError
    W: Array
    Q: Array
    formula: BoxFormula
    jacobian: BoxFormula

    @classmethod
    def of(cls, error: PoseError, W: Array) -> ConeProver:
        """The formulas of an error, traced."""
        n = error.size

        def along(x: Sequence[Any], number: Number) -> list[Any]:
            found = error.at(x[:n], [x[n:]], number)
            return [
                *found.margins,
                *(x for each in found.seen for x in each.error),
                *(x for each in found.seen for x in each.rates[0]),
            ]

        def jacobian(x: Sequence[Any], number: Number) -> list[Any]:
            found = error.at(x, [number(column) for column in W.T], number)
            return [*found.margins, *(x for each in found.seen for rate in zip(*each.rates, strict=True) for x in rate)]

        made = trace_formula(jacobian, n)
        found = made.at([make_affine(np.zeros(1), np.zeros((1, n)), np.zeros(1))] * n)[len(error.limbs) :]
        return cls(
            error, W, np.array([each.v[0, 0] for each in found]).reshape(-1, n), trace_formula(along, 2 * n), made
        )

    def core(self) -> tuple[float, float]:
        """The radius ρ of a ball |w| ≤ ρ in which the goal is the only critical point and E rises along rays, and a
        lower bound of E's rate by t there, over t |w|².

        e = J̄ w and its rate is J w, J̄ the mean of J on the way from the goal: with |J − Q| ≤ δ and |J̄ − Q| ≤ δ̄, and
        σ, Σ the extreme singular values of Q, wᵀ J̄ᵀ J w ≥ (σ² − Σ (δ + δ̄) − δ δ̄) |w|²."""
        rho, values = 1.0, np.linalg.svd(self.Q, compute_uv=False)
        for _ in range(40):
            d, mean = self.changes(rho)
            bound = (
                values[-1] ** 2 * (1 - HIDDEN_ROBOT_RESIDUAL_TOL)
                - values[0] * (1 + HIDDEN_ROBOT_RESIDUAL_TOL) * (d + mean)
                - d * mean
            )
            if bound > 0.1 * values[-1] ** 2:
                return rho, float(bound)
            rho *= 0.8
        return 0.0, 0.0

    def changes(self, rho: float) -> tuple[float, float]:
        """δ and δ̄ of a ball |w| ≤ ρ, infinite where not all of it is reached."""
        n = self.error.size
        off = rho * np.eye(n)
        # noise ε = w / ρ: x = W w
        forms = [
            make_affine(np.zeros(1), (row @ off)[None], np.full(1, AFFINE_ROUNDING * rho * np.abs(row).sum()))
            for row in self.W
        ]
        found = self.jacobian.at(forms)
        margins, rates = found[: len(self.error.limbs)], found[len(self.error.limbs) :]
        slopes = np.array([each.v[1:, 0] for each in rates]).reshape(*self.Q.shape, n)
        shift = np.array([each.v[0, 0] for each in rates]).reshape(self.Q.shape) - self.Q
        rest = np.linalg.norm(np.abs(shift) + np.array([each.r[0] for each in rates]).reshape(self.Q.shape))
        if not (np.isfinite(slopes).all() and all(each.low[0] > 0 for each in margins)):
            return np.inf, np.inf
        linear = np.sqrt(np.linalg.norm(np.einsum("ijk,ilk->jl", slopes, slopes), 2)) * (1 + HIDDEN_ROBOT_RESIDUAL_TOL)
        return float(linear + rest), float(linear / 2 + rest)

    @cached_property
    def square(self) -> tuple[float, float]:
        """Bounds of |Q w|² / |w|²."""
        values = np.linalg.svd(self.Q, compute_uv=False)
        return float(values[-1] ** 2) * (1 - CHAIN_ROUNDING), float(values[0] ** 2) * (1 + CHAIN_ROUNDING)

    def slices(self, middle: Array, half: Array, low: Array, high: Array) -> SliceBounds:
        """E and its rate over slices low ≤ t ≤ high of cones, boxes of w (c, n), with what is of first order taken out:
        e = t (Q w + a) and its rate is Q w + b, so that E's rate by t, over t, is |Q w|² + Q w · (a + b) + a · b."""
        k, n, count = len(self.error.limbs), self.error.size, len(middle)
        # y = t w: a symbol for each axis of w and in the place of the face's one for t, then one for each product
        t, off = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        face = half == 0
        slopes = np.zeros((count, n, 2 * n))
        diagonal = np.arange(n)
        slopes[:, diagonal, diagonal] = t * half
        slopes[:, diagonal, n + diagonal] = off * half
        slopes[..., :n] += (off * middle)[..., None] * face[:, None, :]
        centre = t * middle
        rounding = AFFINE_ROUNDING * high[:, None]
        around = np.concatenate([half[:, :, None] * np.eye(n), np.zeros((count, n, n))], axis=-1)
        found = self.formula.at(
            [
                make_affine(at @ row, np.einsum("cks,k->cs", part, row), off * np.abs(row).sum())
                for at, part, off in (
                    (centre, slopes, rounding[:, 0]),
                    (middle, around, np.full(count, AFFINE_ROUNDING)),
                )
                for row in self.W
            ]
        )
        reached = np.ones(count, dtype=bool)
        for each in found[:k]:
            reached &= each.low > 0
        times = make_affine(
            t, (off * np.concatenate([face, np.zeros_like(face)], axis=1))[:, None], AFFINE_ROUNDING * t
        )
        inverse = times.inverse()
        e, rate = (stack(part) for part in (found[k : k + len(self.Q)], found[k + len(self.Q) :]))
        Qy, Qw = (
            make_affine(at @ self.Q.T, np.einsum("cks,rk->crs", part, self.Q), off * np.abs(self.Q).sum(axis=1))
            for at, part, off in (
                (centre, slopes, rounding),
                (middle, around, np.full_like(t, AFFINE_ROUNDING)),
            )
        )
        a, b = (e - Qy) * inverse, rate - Qw
        rise, twice = (Qw * (a + b) + a * b).sum(), (2.0 * (Qw * a) + a * a).sum()
        near, far = np.maximum(np.abs(middle) - half, 0.0), np.abs(middle) + half
        near, far = (near**2).sum(axis=1), (far**2).sum(axis=1)
        least, most = self.square
        return SliceBounds(
            reached,
            least * near + rise.low,
            np.maximum(low**2 * (least * near + twice.low) / 2, 0.0),
            high**2 * (most * far + twice.high) / 2,
            np.where(face, 0.0, np.abs(np.nan_to_num(rise.v[1 : n + 1], nan=0.0)).T),
        )


@dataclass(frozen=True, eq=False)
class SliceBounds:
    """Bounds over slices (c,): all legs reach, a lower bound of E's rate by t, over t, bounds of E, and the change of
    the rate across the axes of w (c, n)."""

    reached: NDArray[np.bool_]
    rise: Array
    low: Array
    high: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class ProvedCones:
    """Cones that fill a region about the goal, in which E rises along every ray, ``rise`` a lower bound of its rate by
    t, over t; on the region's boundary E ≥ ``level``."""

    prover: ConeProver
    rise: float
    level: float


def prove_cones(prover: ConeProver, wanted: float) -> ProvedCones:
    """The cones proved to as high a level as the budget of boxes allows, at most to ``wanted``.

    They begin outside a core |w| ≤ ρ, on the 2 n faces of the cube. Of each is known up to which t the error is proved
    to rise, the step that is tried next, and a lower bound of E at t.
    """
    (core, rise), eye, target = prover.core(), np.eye(prover.error.size), wanted
    t = np.full(2 * len(eye), core / np.sqrt(len(eye)))

    def judge(middle: Array, half: Array, t: Array, step: Array, level: Array) -> Boxes:
        nonlocal rise, target
        tried = t + step
        bounds = prover.slices(middle, half, t, tried)
        proved, weights = bounds.reached & (bounds.rise > 0), bounds.weights + half * SHORTEST_SLICE
        rise = float(np.min(bounds.rise[proved], initial=rise))
        if proved.any():
            front = prover.slices(middle[proved], half[proved], tried[proved], tried[proved]).low
            level[proved] = np.maximum(level[proved], np.nan_to_num(front, nan=0.0))
        narrow = ~np.any(half > NARROWEST_RISING_CONE, axis=1)
        shorter = ~proved & (step > np.where(narrow, SHORTEST_SLICE, LONG_SLICE))
        step = np.where(proved, CONE_SLICE_GROWTH_FRACTION * step, step / np.where(shorter, 2, 1))
        # a cone that cannot be cut is as far as it goes: nothing need go higher
        target = float(np.min(level[~proved & ~shorter & narrow], initial=target))
        cut = ~proved & ~shorter & ~narrow
        across = np.argmax(np.where(half > NARROWEST_RISING_CONE, weights, -1.0), axis=1)
        t, step = np.where(proved, tried, t), np.where(cut, 2 * step, step)
        return middle, half, t, step, level, np.where(cut, across, AGAIN)

    cones = Exhaustion(
        judge,
        (np.concatenate([eye, -eye]), np.concatenate([1 - eye, 1 - eye]), t, t, rise * t**2 / 2),
        CONE_SLICES_MAX,
        CONE_BATCH_COUNT,
        # those that hold all others up first
        urgency=lambda *cones: cones[-1],
        concerns=lambda *cones: np.asarray(cones[-1] < target),
    ).run()
    return ProvedCones(prover, rise, float(np.min(cones.waiting[-1], initial=target)))
