"""Cones about a goal in which the error is proved to rise along every ray.

Rays x = t W w start at the goal; w runs over the faces of the cube [−1, 1]ⁿ, W = H^(−½) with H the Hessian of E at the
goal, so that E ≈ ½ t² |w|². A cone is a box of w in a face. In it E's rate along the ray is enclosed above zero from
slice to slice of t; in the first slice, from t = 0 on where it vanishes, its second derivative is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...batch.enclosures import BoxFormula, trace_formula
from ...budgets import CONE_BATCH_COUNT, CONE_SLICES_MAX
from ...geometry.affine import make_affine, stack
from ...geometry.vectors import Array
from ...tolerances import (
    AFFINE_ROUNDING,
    CHAIN_ROUNDING,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    NARROWEST_RISING_CONE,
    SHORTEST_SLICE,
)
from .pose_error import Number, PoseError

LONG_SLICE = 1 / 16
"""Length of a slice above which it is made shorter before its cone is cut."""
CONE_SLICE_GROWTH_FRACTION = 1.5
"""Factor by which the next slice is longer after a proved one."""


@dataclass(eq=False)
class RisingCones:
    """Cones: ``face`` (c,) is the axis of w that is ``sign`` 1; ``middle``, ``half`` (c, n) of w, 0 on that axis; up to
    which ``t`` (c,) the error is proved to rise, a lower bound ``level`` of E there, the ``step`` that is tried next,
    a lower bound ``rise`` of E's rate by t, over t, in all slices."""

    middle: Array
    half: Array
    t: Array
    step: Array
    level: Array
    rise: Array

    @classmethod
    def all(cls, n: int, core: float, rise: float) -> RisingCones:
        """Return the cones of the 2 n faces of the cube, outside a ``core`` |w| ≤ ρ proved with this ``rise``."""
        eye = np.eye(n)
        middle = np.concatenate([eye, -eye])
        half = np.concatenate([1 - eye, 1 - eye])
        count = 2 * n
        t = np.full(count, core / np.sqrt(n))
        return cls(middle, half, t, t, rise * t**2 / 2, np.full(count, rise))

    def __len__(self) -> int:
        return len(self.t)

    def kept(self, which: Any) -> RisingCones:
        """Some of them."""
        return RisingCones(*(each[which] for each in self._parts))

    def joined(self, other: RisingCones) -> RisingCones:
        """These and others."""
        return RisingCones(*(np.concatenate(pair) for pair in zip(self._parts, other._parts, strict=True)))

    @property
    def _parts(self) -> tuple[Array, ...]:
        return self.middle, self.half, self.t, self.step, self.level, self.rise

    def halved(self, axis: NDArray[np.int64]) -> RisingCones:
        """Each cut in two across an axis (c,) of w."""
        found = self.joined(self)
        found.middle, found.half = cut(self.middle, self.half, axis)
        return found


def cut(middle: Array, half: Array, axis: NDArray[np.int64]) -> tuple[Array, Array]:
    """Boxes (c, n) cut in two across an axis (c,) each: first all lower halves, then the upper ones."""
    rows = np.arange(len(middle))
    size = half.copy()
    size[rows, axis] /= 2
    shift = np.zeros_like(middle)
    shift[rows, axis] = size[rows, axis]
    return np.concatenate([middle - shift, middle + shift]), np.concatenate([size, size])


def proved_all_over(
    whole: Array,
    inside: Callable[[Array, Array], NDArray[np.bool_]],
    judge: Callable[[Array, Array], tuple[NDArray[np.bool_], NDArray[np.int64]]],
    most: int,
) -> tuple[bool, int]:
    """Return True if something is proved at all points of a region in the box |x| ≤ ``whole`` (n,); with the number of
    boxes.

    ``inside`` selects the boxes (c, n) that meet the region, ``judge`` those in which it is proved and the axis across
    which the others are cut. With more than ``most`` boxes it is not proved.
    """
    middle, half, boxes = np.zeros((1, len(whole))), whole[None], 0
    while True:
        kept = inside(middle, half)
        middle, half = middle[kept], half[kept]
        boxes += len(middle)
        if not len(middle) or boxes > most:
            return not len(middle), boxes
        proved, axis = judge(middle, half)
        middle, half = cut(middle[~proved], half[~proved], axis[~proved])


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

    def slices(self, cones: RisingCones, low: Array, high: Array) -> SliceBounds:
        """E and its rate over slices of cones, with what is of first order taken out: e = t (Q w + a) and its rate is
        Q w + b, so that E's rate by t, over t, is |Q w|² + Q w · (a + b) + a · b."""
        k, n, count = len(self.error.limbs), self.error.size, len(cones)
        # y = t w: a symbol for each axis of w and in the place of the face's one for t, then one for each product
        t, off = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        face = cones.half == 0
        slopes = np.zeros((count, n, 2 * n))
        diagonal = np.arange(n)
        slopes[:, diagonal, diagonal] = t * cones.half
        slopes[:, diagonal, n + diagonal] = off * cones.half
        slopes[..., :n] += (off * cones.middle)[..., None] * face[:, None, :]
        centre = t * cones.middle
        rounding = AFFINE_ROUNDING * high[:, None]
        around = np.concatenate([cones.half[:, :, None] * np.eye(n), np.zeros((count, n, n))], axis=-1)
        found = self.formula.at(
            [
                make_affine(middle @ row, np.einsum("cks,k->cs", part, row), off * np.abs(row).sum())
                for middle, part, off in (
                    (centre, slopes, rounding[:, 0]),
                    (cones.middle, around, np.full(count, AFFINE_ROUNDING)),
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
            make_affine(middle @ self.Q.T, np.einsum("cks,rk->crs", part, self.Q), off * np.abs(self.Q).sum(axis=1))
            for middle, part, off in (
                (centre, slopes, rounding),
                (cones.middle, around, np.full_like(t, AFFINE_ROUNDING)),
            )
        )
        a, b = (e - Qy) * inverse, rate - Qw
        rise, twice = (Qw * (a + b) + a * b).sum(), (2.0 * (Qw * a) + a * a).sum()
        near, far = np.maximum(np.abs(cones.middle) - cones.half, 0.0), np.abs(cones.middle) + cones.half
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
    """Cones that fill a region about the goal, in which E rises along every ray; on its boundary E ≥ ``level``."""

    prover: ConeProver
    cones: RisingCones
    level: float
    boxes: int

    @property
    def rise(self) -> float:
        """A lower bound of E's rate by t, over t."""
        return float(np.min(self.cones.rise))


def prove_cones(prover: ConeProver, wanted: float) -> ProvedCones:
    """The cones proved to as high a level as the budget of boxes allows, at most to ``wanted``."""
    core, rise = prover.core()
    cones, boxes = RisingCones.all(prover.error.size, core, rise), 0
    target = wanted
    while boxes < CONE_SLICES_MAX:
        todo = np.flatnonzero(cones.level < target)
        if not len(todo):
            break
        # those that hold all others up first
        todo = todo[np.argsort(cones.level[todo], kind="stable")[:CONE_BATCH_COUNT]]
        rest = np.ones(len(cones), dtype=bool)
        rest[todo] = False
        part, others = cones.kept(todo), cones.kept(rest)
        boxes += len(part)
        tried = part.t + part.step
        bounds = prover.slices(part, part.t, tried)
        proved, weights = bounds.reached & (bounds.rise > 0), bounds.weights + part.half * SHORTEST_SLICE
        part.t = np.where(proved, tried, part.t)
        part.rise = np.where(proved, np.minimum(part.rise, bounds.rise), part.rise)
        if proved.any():
            front = prover.slices(part.kept(proved), tried[proved], tried[proved]).low
            part.level[proved] = np.maximum(part.level[proved], np.nan_to_num(front, nan=0.0))
        across = np.argmax(np.where(part.half > NARROWEST_RISING_CONE, weights, -1.0), axis=1)
        narrow = ~np.any(part.half > NARROWEST_RISING_CONE, axis=1)
        shorter = ~proved & (part.step > np.where(narrow, SHORTEST_SLICE, LONG_SLICE))
        part.step = np.where(proved, CONE_SLICE_GROWTH_FRACTION * part.step, part.step / np.where(shorter, 2, 1))
        cut = ~proved & ~shorter
        if cut.any():
            # a cone that cannot be cut is as far as it goes: nothing need go higher
            target = min(target, float(np.min(part.level[cut & narrow], initial=np.inf)))
            fresh = part.kept(cut & ~narrow).halved(across[cut & ~narrow])
            fresh.step *= 2
            part = part.kept(~cut | narrow).joined(fresh)
        cones = others.joined(part)
    return ProvedCones(prover, cones, float(min(target, np.min(cones.level))), boxes)
