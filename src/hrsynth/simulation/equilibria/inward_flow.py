"""Balls about a goal into which the law without damping leads from every pose in them (docs/pages/proofs.md).

With x the pose from the goal's, e the error and J its rates the law moves the platform by ẋ = −J⁺ e. With J of full
rank and e = J x − d that is −(x − J⁺ d), so that |x| falls along every run where x · J⁺ d < |x|²: then none leaves a
ball in which that holds, and all end in its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import make_affine, stack
from ...geometry.vectors import Array
from ...solving.exhaust import SETTLED, Boxes, Exhaustion
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL
from .cones import ConeProver
from .pose_error import PoseError

INWARD_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Fractions of that radius for a ball into which the flow points."""
GOAL_RAYS_COUNT = 3000
"""Rays from a goal along which the rise of the error is found, not proved."""
INWARD_BOXES, RADIUS_AT_ONCE = 30_000, 2048
"""Largest number of boxes in the proof of a ball into which the flow points, and of boxes processed together."""


@dataclass(frozen=True, eq=False)
class InwardProver:
    """Enclosures of J and e over boxes (c, n) of coordinates x of an error."""

    error: PoseError
    rates: ConeProver
    errors: BoxFormula

    @classmethod
    def of(cls, error: PoseError) -> InwardProver:
        """The formulas of an error, traced."""
        return cls(
            error,
            ConeProver.of(error, np.eye(error.size)),
            trace_formula(
                lambda x, number: [part for each in error.at(x, [], number).seen for part in each.error], error.size
            ),
        )

    def core(self, radius: float) -> float:
        """The radius of a ball, at most ``radius``, in which |J⁺ (J − J̄)| < 1, J̄ the mean of J from the goal on: as
        d = (J − J̄) x, runs lead inwards there."""
        least = np.linalg.svd(self.rates.Q, compute_uv=False)[-1] * (1 - HIDDEN_ROBOT_RESIDUAL_TOL)
        while radius > 0:
            change, mean = self.rates.changes(radius)
            if 2 * change + mean < least:
                return radius
            radius *= 0.8
        return 0.0

    def inwards(self, middle: Array, half: Array) -> NDArray[np.intp]:
        """Return ``SETTLED`` for boxes in which all legs reach, J has full rank and runs lead inwards, for the others
        the axes across which to cut them."""
        n, count = middle.shape[1], len(middle)
        x = [make_affine(middle[:, i], half[:, i, None] * np.eye(n)[i], np.zeros(count)) for i in range(n)]
        found, limbs = self.rates.jacobian.at(x), len(self.error.limbs)
        reached = np.ones(count, dtype=bool)
        for each in found[:limbs]:
            reached &= each.low > 0
        rows, X = [stack(found[k : k + n]) for k in range(limbs, len(found), n)], stack(x)
        d = stack([(row * X).sum() - e for row, e in zip(rows, self.errors.at(x), strict=True)])
        J, off = (np.stack(parts, axis=1) for parts in ([row.v[0] for row in rows], [row.spread for row in rows]))
        reached &= np.isfinite(J).all(axis=(1, 2)) & np.isfinite(off).all(axis=(1, 2)) & np.isfinite(d.size).all(axis=1)
        J, off = np.where(reached[:, None, None], J, 0.0), np.where(reached[:, None, None], off, 0.0)
        size = np.where(reached[:, None], d.size, 0.0)
        N = J.transpose(0, 2, 1) @ J
        floor = (
            HIDDEN_ROBOT_RESIDUAL_TOL * np.trace(N, axis1=1, axis2=2)[:, None, None]
            + np.where(reached, 0.0, 1.0)[:, None, None]
        )
        P = np.linalg.inv(N + floor * np.eye(n))
        # P N = 1 + F, |F| ≤ f, for all J in the box
        change = np.abs(J).transpose(0, 2, 1) @ off
        change = change + change.transpose(0, 2, 1) + off.transpose(0, 2, 1) @ off
        f = (
            np.linalg.norm(np.abs(P @ N - np.eye(n)) + np.abs(P) @ change, axis=(1, 2))
            * (1 + HIDDEN_ROBOT_RESIDUAL_TOL)
            + HIDDEN_ROBOT_RESIDUAL_TOL
        )
        to = P @ J.transpose(0, 2, 1)
        with np.errstate(invalid="ignore"):  # of boxes that are not enclosed
            centre = np.where(reached[:, None], np.nan_to_num(np.einsum("cnr,cr->cn", to, d.v[0])), 0.0)
            parts = np.nan_to_num(np.abs(np.einsum("cnr,kcr->kcn", to, d.v[1:])))
            spread = parts.sum(axis=0) + np.nan_to_num(np.einsum("cnr,cr->cn", np.abs(to), d.r))
        z = np.abs(centre) + spread
        doubt = np.linalg.norm(np.einsum("cnm,crm,cr->cn", np.abs(P), off, size), axis=1)
        doubt += f * np.linalg.norm(z, axis=1)
        along = np.sum(middle * centre + np.abs(middle) * spread + half * z, axis=1)
        near = np.linalg.norm(np.maximum(np.abs(middle) - half, 0.0), axis=1)
        doubt = doubt / np.where(f < 1, 1 - f, np.nan)
        proved = reached & (near > doubt) & (near * (near - doubt) * (1 - HIDDEN_ROBOT_RESIDUAL_TOL) > along)
        weights = np.linalg.norm(parts, axis=2).T + half * np.linalg.norm(z, axis=1)[:, None]
        weights = np.where(half > half.max(axis=1)[:, None] / 9, weights + 1e-9 * half, 0.0)
        return np.where(proved, SETTLED, np.argmax(weights, axis=1))


def inward_radius(error: PoseError, seed: int = 0) -> float:
    """The radius of a ball |x| ≤ ρ that is proved, as large a part of the one that rays show as boxes allow; 0 if none
    is."""
    prover, seen = InwardProver.of(error), _seen_radius(error, seed)
    core = prover.core(seen)
    larger = [share * seen for share in INWARD_SHARES if 0 < core < share * seen]
    return max(takewhile(partial(_is_inward, prover), larger), default=core)


def _is_inward(prover: InwardProver, radius: float) -> bool:
    """Return True if runs lead inwards all over the ball outside its core, by boxes that are cut where that is not
    proved."""
    core, n = prover.core(radius), prover.error.size

    def inside(middle: Array, half: Array) -> NDArray[np.bool_]:
        near, far = np.maximum(np.abs(middle) - half, 0.0), np.abs(middle) + half
        return (np.linalg.norm(near, axis=1) <= radius) & (np.linalg.norm(far, axis=1) > core)

    def judge(middle: Array, half: Array) -> Boxes:
        parts = (slice(k, k + RADIUS_AT_ONCE) for k in range(0, len(middle), RADIUS_AT_ONCE))
        return middle, half, np.concatenate([prover.inwards(middle[part], half[part]) for part in parts])

    start = np.zeros((1, n)), np.full((1, n), radius)
    return Exhaustion(judge, start, INWARD_BOXES, concerns=inside).run().is_settled


def _seen_radius(error: PoseError, seed: int) -> float:
    """Return the largest radius at which rays from the goal show that runs lead inwards (not proved)."""
    n = error.size
    w = np.random.default_rng(seed).normal(size=(GOAL_RAYS_COUNT, n))
    w /= np.linalg.norm(w, axis=1)[:, None]
    last = 0.0
    for t in np.geomspace(1e-2, 3.0, 80):
        (e, J), (reached, _) = error.numbers(t * w, np.eye(n)), error.levels(t * w)
        N = J.transpose(0, 2, 1) @ J
        if not (reached.all() and np.isfinite(N).all() and np.all(np.linalg.det(N) > 0)):
            break
        if not np.all(np.einsum("ni,ni->n", w, np.linalg.solve(N, (e[:, None] @ J).transpose(0, 2, 1))[..., 0]) > 0):
            break
        last = float(t)
    return last
