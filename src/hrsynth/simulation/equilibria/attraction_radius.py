"""Proved attraction radius of a goal (docs/pages/proofs.md, section 14).

In cones about the goal the error E = ½‖e‖² is proved to rise along every ray until it is at least c. Then no run, along
which E falls, leaves the component of {E < c} that holds the goal; the goal is its only critical point; and all starts
within r lie in it, if E is enclosed below c there. That holds for the damped law as for the exact one. Of the exact
one a larger ball is proved, into which it leads (:mod:`.inward`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ...analysis.observed import ObservedRobot
from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import AffineForms, make_affine, stack
from ...geometry.so3 import compute_rotation_angle
from ...geometry.vectors import Array, transform
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...records import As, recorded
from ...results import Value
from ...solving.exhaust import SETTLED, Boxes, Exhaustion
from ...tolerances import AFFINE_ROUNDING, HIDDEN_ROBOT_RESIDUAL_TOL, POINT_DISTANCE_TOL, RANK_CUTOFF_FRACTION
from .cones import ConeProver, ProvedCones, prove_cones
from .inward_flow import GOAL_RAYS_COUNT, inward_radius
from .pose_error import EnclosureFailure, PoseError

PROVED_LEVEL_FRACTION = 0.95
"""Fraction of the error at which rays stop rising, up to which the proof tries that all rays rise."""
RADIUS_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3)
"""Fractions of the radius found by rays that are tried in turn as attraction radius."""
ATTRACTION_RADIUS_BOXES_MAX = 60_000
"""Largest number of boxes in the proof of an attraction radius."""

CERTIFIED, UNDECIDED = "certified", "undecided"


@dataclass(frozen=True, eq=False, repr=False)
class AttractionRadius(Value):
    """Proved attraction radius of a goal, in its working mode: every run that starts with the platform position within
    ``length`` (m) and, if the platform rotates, its rotation within ``angle`` (rad) of the goal's (both at once) ends
    at the goal.

    ``level`` is c, ``least`` a lower bound of ‖∇E‖ / |x|, x the pose relative to the goal (characteristic lengths,
    halves of tangents of half the rotation). If nothing is proved, ``reason`` gives the cause.
    """

    goal: ClosedConfiguration
    motion: PlatformMotion
    length: Annotated[float, As("radius_m")]
    angle: Annotated[float | None, As("radius_rad")]
    level: float
    least: float
    reason: str
    undamped: float = 0.0
    """Radius while the law is not damped (characteristic lengths, radians)."""
    aside: bool = False
    """Flag: positions are of another platform point than that of the printed poses."""

    @property
    def verdict(self) -> str:
        """Return certified, or undecided."""
        return CERTIFIED if self.length > 0 else UNDECIDED

    @property
    @recorded()
    def words(self) -> str:
        """Starts from which every run ends at the goal, in words."""
        if not self.length:
            return f"undecided: {self.reason}"
        return f"from anywhere {self._within(self.length, self.angle)}"

    @property
    @recorded(As("undamped"))
    def undamped_words(self) -> str | None:
        """Starts from which every run ends at the goal while the law is not damped; null if these are no more."""
        length = self.goal.model.length * self.undamped
        if length <= self.length:
            return None
        within = self._within(length, None if self.angle is None else self.undamped)
        return f"proved where the law is not damped: {within}"

    @property
    def measured(self) -> str:
        """Return the point whose position counts, if it is not that of the printed poses; else an empty text."""
        point = " ".join(f"{x:.4g}" for x in self.motion.point)
        return f"measured at the point ({point}) m of {self.motion.link}" if self.aside else ""

    def _within(self, length: float, angle: float | None) -> str:
        turn = "" if angle is None else f" and {np.degrees(angle):.2g}°"
        at = f", {self.measured}" if self.measured else ""
        return f"within {1e3 * length:.3g} mm{turn} of the goal in its working mode{at}"

    def has_start(self, X: Array) -> bool:
        """Return True if a platform pose X (4, 4) is one of those starts."""
        here = self.goal.pose(self.motion.link)
        shift = transform(X, self.motion.point) - transform(here, self.motion.point)
        return bool(
            np.linalg.norm(shift) <= self.length
            and (self.angle is None or compute_rotation_angle(X[:3, :3] @ here[:3, :3].T) <= self.angle)
        )


def prove_attraction_radius(setup: ObservedRobot, goal: ClosedConfiguration) -> AttractionRadius:
    """Return the largest attraction radius proved with the budget of boxes, for observed directions of segments."""
    try:
        if not all(each.is_segment_direction for each in setup.observed):
            raise EnclosureFailure("only directions of segments are supported")
        error = PoseError.of(setup, goal)
        if error.fitted:
            raise EnclosureFailure(f"forms are fitted to samples: {', '.join(error.fitted)}")
        if error.limits:
            raise EnclosureFailure(f"a run may stop at a joint limit: {', '.join(error.limits)}")
        proved = _proved_cones(error)
    except EnclosureFailure as why:
        return AttractionRadius(goal, setup.motion, 0.0, None, 0.0, 0.0, str(why))
    reach = _reach(proved)
    angle = reach if error.turns.shape[1] else None
    # |x| ≤ t |W| √n on the faces of the cube
    least = proved.rise / (error.size * float(np.linalg.norm(proved.prover.W, 2)) ** 2)
    reason = "forms of the legs and the error enclosed in cones about the goal"
    ball = inward_radius(error)
    aside = bool(np.linalg.norm(error.motion.point - setup.motion.point) > POINT_DISTANCE_TOL * error.length)
    return AttractionRadius(
        goal,
        error.motion,
        reach * error.length,
        angle,
        proved.level,
        least,
        reason,
        _product(ball) if error.turns.shape[1] else ball,
        aside,
    )


def _product(radius: float) -> float:
    """The largest r with r² + tan²(r / 2) ≤ ρ²: shifts and turns of at most r are in the ball."""
    low, high = 0.0, radius
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if middle**2 + np.tan(middle / 2) ** 2 <= radius**2 else (low, middle)
    return float(low)


def _proved_cones(error: PoseError) -> ProvedCones:
    """Prove cones nearly up to where E stops rising on some ray; raises ``EnclosureFailure``."""
    n = error.size
    _, rates = error.numbers(np.zeros((1, n)), np.eye(n))
    J = rates[0]
    values, V = np.linalg.eigh(J.T @ J)
    if values[0] <= RANK_CUTOFF_FRACTION * values[-1]:
        raise EnclosureFailure("the directions do not determine all platform twists at the goal")
    W = V / np.sqrt(values)
    seen = _highest(error, W)
    prover = ConeProver.of(error, W * np.sqrt(2 * seen))
    proved = prove_cones(prover, PROVED_LEVEL_FRACTION * seen)
    if not proved.level > 0:
        raise EnclosureFailure("no ball about the goal is small enough for the enclosures")
    return proved


def _highest(error: PoseError, W: Array) -> float:
    """The least E at which a ray of many stops rising, or leaves the legs' reach: seen, not proved."""
    n = error.size
    w = np.random.default_rng(0).normal(size=(GOAL_RAYS_COUNT, n))
    w /= np.linalg.norm(w, axis=1)[:, None]
    rising, before, lowest = np.ones(GOAL_RAYS_COUNT, dtype=bool), np.zeros(GOAL_RAYS_COUNT), np.inf
    for t in np.geomspace(1e-3, 3.0, 150):
        if not rising.any():
            break
        reached, E = error.levels(t * w @ W.T)
        lost = rising & ~(reached & (before < E))
        lowest = min(lowest, float(np.min(before[lost], initial=np.inf)))
        rising &= ~lost & (lowest > E)
        before = E
    return lowest if np.isfinite(lowest) else float(np.max(before))


def _reach(proved: ProvedCones) -> float:
    """The radius (characteristic lengths, radians) within which E < c is enclosed, near the one that rays show."""
    error, W, c = proved.prover.error, proved.prover.W, proved.level
    # rays evenly about the goal, and towards where E rises fast
    w = np.random.default_rng(0).normal(size=(2 * GOAL_RAYS_COUNT, error.size))
    x = np.concatenate([w[:GOAL_RAYS_COUNT], w[GOAL_RAYS_COUNT:] @ np.linalg.inv(W)])
    x *= np.max(np.linalg.norm(W, axis=0)) / np.linalg.norm(x, axis=1)[:, None]
    low, high = np.zeros(len(x)), np.full(len(x), 2.0)
    for _ in range(40):
        middle = (low + high) / 2
        reached, E = error.levels(middle[:, None] * x)
        inside = reached & (c > E)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    seen = float(np.min(_gauge(error, low[:, None] * x)))
    errors = trace_formula(
        lambda inputs, number: [x for each in error.at(inputs, [], number).seen for x in each.error], error.size
    )
    Q = proved.prover.Q @ np.linalg.inv(W)
    radii = (share * seen for share in RADIUS_SHARES)
    return next((radius for radius in radii if _is_below(error, errors, Q, radius, c)), 0.0)


def _gauge(error: PoseError, x: Array) -> Array:
    """The larger of shift and turn (characteristic lengths, radians) at coordinates (n, size)."""
    k = error.shifts.shape[1]
    shift, turn = np.linalg.norm(x[:, :k], axis=1), 2 * np.arctan(np.linalg.norm(x[:, k:], axis=1))
    return np.asarray(np.maximum(shift, turn))


def _highest_on(errors: BoxFormula, Q: Array, middle: Array, half: Array) -> AffineForms:
    """E over boxes (c, n) of coordinates x: with e = Q x + a it is ½ (xᵀ Qᵀ Q x + 2 Q x · a + |a|²)."""
    n, H = middle.shape[1], Q.T @ Q
    off = half[:, :, None] * np.eye(n)
    e = stack(errors.at([make_affine(middle[:, i], off[:, i], np.zeros(len(middle))) for i in range(n)]))
    extent = np.abs(middle) + half
    Qx = make_affine(middle @ Q.T, np.einsum("cks,rk->crs", off, Q), AFFINE_ROUNDING * extent @ np.abs(Q).T)
    a = e - Qx
    # xᵀ H x at the middle m: mᵀ H m + 2 (H m) · δ + δᵀ H δ
    Hm = middle @ H
    bent = np.einsum("ci,ij,cj->c", half, np.abs(H), half) + HIDDEN_ROBOT_RESIDUAL_TOL * np.sum(
        extent @ np.abs(H) * extent, axis=1
    )
    square = make_affine(np.sum(Hm * middle, axis=1), 2 * Hm * half, bent)
    return 0.5 * (square + (2.0 * (Qx * a) + a * a).sum())


def _is_below(error: PoseError, errors: BoxFormula, Q: Array, radius: float, c: float) -> bool:
    """Return True if E < c is enclosed at all poses within a radius, by boxes that are cut where it is not."""
    k, n = error.shifts.shape[1], error.size
    whole = np.where(np.arange(n) < k, radius, np.tan(min(radius, 3.0) / 2)) * (1 + HIDDEN_ROBOT_RESIDUAL_TOL)

    def inside(middle: Array, half: Array) -> NDArray[np.bool_]:
        return np.asarray(_gauge(error, np.maximum(np.abs(middle) - half, 0.0)) <= radius)

    def judge(middle: Array, half: Array) -> Boxes:
        proved = _highest_on(errors, Q, middle, half).high < c
        return middle, half, np.where(proved, SETTLED, np.argmax(half / whole, axis=1))

    start = np.zeros((1, n)), whole[None]
    return Exhaustion(judge, start, ATTRACTION_RADIUS_BOXES_MAX, concerns=inside).run().is_settled
