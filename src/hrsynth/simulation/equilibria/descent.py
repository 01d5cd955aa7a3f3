"""Newton's method to critical points of the error on closed loops, many at once: minima, saddles of each index, maxima.

About a configuration the columns of Z span the motions of the closed loops; the step Z s + p closes them (p, normal to
Z) and solves ZᵀHZ s = −Zᵀ(∇E + H p), H the Hessian of E + μ · G: Newton's method on ∇E + DGᵀ μ = 0 beside G = 0. Along
the eigenvectors of ZᵀHZ with the k lowest eigenvalues it goes up instead, along all others down, which leads to
critical points of index k (C. J. Cerjan, W. H. Miller, J. Chem. Phys. 75, 1981). Nothing here proves anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...equations.measured_error import CriticalPointEquations, ErrorSystem
from ...geometry.vectors import Array, times
from ...results import Value

COMMAND_DIFFERENCE_STEP_MAX = 1e-7
"""Step (characteristic lengths, radians) of differences of servo commands."""
COMMAND_RATE_CUTOFF_FRACTION = 1e-10
"""Relative singular value below which such differences show no rate."""
CRITICAL_GRADIENT_TOL = 1e-11
"""Gradient of the error along the loops, and closure residual, at a critical point."""
DEPENDENT_EQUATION_TOL = 1e-13
"""Relative squared singular value of the loop equations that a closing step ignores."""
SQUARED_ERROR_ROUNDING_TOL = 1e-14
"""½ ‖e‖² below which it is rounding."""
CRITICAL_CURVATURE_TOL = 1e-7
"""Curvature of the error below which it counts as zero in the search of critical points."""
EQUILIBRIUM_START_STEPS_MAX = 80
"""Steps of one start."""
EQUILIBRIUM_COORDINATE_MAX = 50.0
"""Coordinate (characteristic lengths, radians) beyond which a start stops."""

DESCENT_STEP_MAX = 0.25
"""Largest change of a coordinate in a step (characteristic lengths, radians)."""
CRITICAL_NEWTON_STEPS_COUNT = 4
"""Newton's steps from a critical point that was found."""
RANDOM_WALK_STEP_MAX = 0.3
"""Largest change of a coordinate in a random step between starts."""


class Equations(Protocol):
    """Equations G (c, m) with derivatives DG (c, m, N), and E (c,) with its gradient (c, N)."""

    G: Any
    DG: Any
    E: Any
    slope: Any

    def bend(self, multipliers: Any) -> Any:
        """The Hessian (c, N, N) of E + μ · G."""


class CriticalPointProblem(Protocol):
    """Whose critical points are sought."""

    def at(self, values: Sequence[Any]) -> Equations:
        """Return the equations at values (N,) of (c,) each."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoint(Value):
    """Critical point of E: coordinates (N,) and multipliers (m,), the residuals of ∇E on the loops and of G
    (``residual``), and the eigenvalues of the Hessian along the motions of the loops, ascending, without those of
    internal motions; ``value`` is E."""

    q: Array
    multipliers: Array
    residual: float
    curvatures: Array
    value: float

    @property
    def has_zero_error(self) -> bool:
        """Return True if e = 0, as far as E = ½ ‖e‖², a difference of numbers of size one, resolves it."""
        return self.value < SQUARED_ERROR_ROUNDING_TOL


@dataclass(frozen=True, eq=False)
class Tangents:
    """The motions of the loops at configurations (c,): Z (c, N, d), Y (c, N, m) normal to them, R (c, m, m) with DGᵀ =
    Y R."""

    Z: Array
    Y: Array
    R: Array

    @classmethod
    def of(cls, DG: Array) -> Tangents:
        """Compute the tangents of DG (c, m, N)."""
        m = DG.shape[-2]
        Q, R = np.linalg.qr(np.swapaxes(DG, -1, -2), mode="complete")
        R = R[..., :m, :]
        # a row that is lost counts as a faint one
        faint = np.abs(np.diagonal(R, axis1=-2, axis2=-1)) < 1e-12
        R = R + np.where(faint, 1e-12, 0.0)[..., None] * np.eye(m)
        return cls(Q[..., m:], Q[..., :m], R)

    def closing(self, G: Array) -> Array:
        """p (c, N), normal to Z, with DG p = −G."""
        return -1.0 * times(self.Y, np.linalg.solve(np.swapaxes(self.R, -1, -2), G[..., None])[..., 0])

    def multipliers(self, slope: Array) -> Array:
        """μ (c, m) with ∇E + DGᵀ μ in the span of Z."""
        return np.asarray(-np.linalg.solve(self.R, times(np.swapaxes(self.Y, -1, -2), slope)[..., None])[..., 0])


@dataclass(frozen=True, eq=False)
class Expansion:
    """Expansion of E on the loops to second order at configurations (c,): the closing step p (c, N), multipliers μ (c,
    m), gradient (c, d) and Hessian along Z: its eigenvalues (c, d) and directions (c, N, d), the last ``idle`` of them
    those of the motions that are most nearly internal."""

    E: Array
    closing: Array
    multipliers: Array
    slope: Array
    curvatures: Array
    directions: Array
    residual: Array
    idle: int

    @property
    def freedoms(self) -> int:
        """d without internal motions."""
        return self.curvatures.shape[-1] - self.idle

    def curvatures_of(self, k: int) -> Array:
        """Return the curvatures of the k-th configuration, ascending, without those of internal motions that are
        internal there too: an arm with a redundant joint has others where it is stretched."""
        values, d = self.curvatures[k], self.freedoms
        return np.sort(np.concatenate([values[:d], values[d:][np.abs(values[d:]) > CRITICAL_CURVATURE_TOL]]))

    @classmethod
    def of(cls, system: CriticalPointProblem, q: Array, idle: int) -> Expansion:
        """Expand E at q (c, N)."""
        with np.errstate(all="ignore"):
            at = system.at(list(q.T))
            tangents = Tangents.of(at.DG)
            p, mu = tangents.closing(at.G), tangents.multipliers(np.nan_to_num(at.slope))
            H = at.bend(mu)
        Z = tangents.Z
        back = np.swapaxes(Z, -1, -2)
        # where nothing is measured there is no way to go
        lost = ~np.isfinite(H).all(axis=(-1, -2))
        H, p = np.where(lost[:, None, None], 0.0, H), np.where(lost[:, None], np.nan, p)
        flat = times(back, at.slope)
        slope = flat + times(back, times(H, p))
        values, vectors = np.linalg.eigh(back @ H @ Z)
        along = times(np.swapaxes(vectors, -1, -2), slope)
        still = np.argsort(np.argsort(np.abs(values) + np.abs(along), axis=-1), axis=-1) < idle
        order = np.argsort(np.where(still, np.inf, values), axis=-1, kind="stable")
        values, along = (np.take_along_axis(each, order, -1) for each in (values, along))
        vectors = np.take_along_axis(vectors, order[..., None, :], -1)
        return cls(
            at.E,
            p,
            mu,
            along,
            values,
            Z @ vectors,
            np.maximum(np.linalg.norm(at.G, axis=-1), np.linalg.norm(flat, axis=-1)),
            idle,
        )


def _shorten_steps(step: Array, longest: float) -> Array:
    """Steps (c, N), none of whose changes is longer."""
    size = np.abs(step).max(axis=-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, longest / np.maximum(size, longest)))


def close_loops(system: ErrorSystem, q: Array, steps: int = 12) -> Array:
    """Configurations (c, N) moved to the nearest closed ones, as far as Gauss and Newton's method does it."""
    for _ in range(steps):
        G, DG = system.closures(q)
        if np.linalg.norm(G, axis=-1).max(initial=0.0) < CRITICAL_GRADIENT_TOL:
            break
        back = np.swapaxes(DG, -1, -2)
        # all equations, of which some may depend on others: the shortest step
        gram = DG @ back
        gram += (
            DEPENDENT_EQUATION_TOL
            * np.maximum(1.0, np.trace(gram, axis1=-2, axis2=-1))[:, None, None]
            * np.eye(G.shape[-1])
        )
        q = q + _shorten_steps(times(back, -np.linalg.solve(gram, G[..., None])[..., 0]), DESCENT_STEP_MAX)
    return q


def are_closed(system: ErrorSystem, q: Array, within: float = CRITICAL_GRADIENT_TOL) -> NDArray[np.bool_]:
    """Return True for configurations (c, N) at which all equations of the loops hold, to a residual."""
    return np.asarray(np.linalg.norm(system.closures(q)[0], axis=-1) < within)


def walk_at_random(
    system: ErrorSystem, q: Array, rng: np.random.Generator, steps: int, longest: float = RANDOM_WALK_STEP_MAX
) -> Array:
    """Closed configurations (c, N), each led so many random steps along the loops; those that do not close stay."""
    for _ in range(steps):
        tangents = Tangents.of(CriticalPointEquations(system, list(q.T)).DG)
        way = times(tangents.Z, rng.normal(size=(len(q), tangents.Z.shape[-1])))
        there = close_loops(
            system, q + longest * rng.uniform(0.2, 1.0, (len(q), 1)) * way / np.abs(way).max(axis=-1, keepdims=True), 6
        )
        good = are_closed(system, there)
        good &= np.abs(there - q).max(axis=-1) < 2 * longest
        q = np.where(good[:, None], there, q)
    return q


def descend(
    system: CriticalPointProblem,
    q: Array,
    index: NDArray[np.intp],
    idle: int,
    farthest: float = EQUILIBRIUM_COORDINATE_MAX,
) -> list[CriticalPoint]:
    """The critical points to which starts (c, N) lead, each sought as one of an index (c,), or (−1) by Newton's method
    whatever it is; none with a coordinate beyond ``farthest``."""
    if isinstance(system, ErrorSystem) and system.has_assumed_depths:
        return find_loop_zeros(system, q, index, idle)
    found: list[CriticalPoint] = []
    for _ in range(EQUILIBRIUM_START_STEPS_MAX):
        if not len(q):
            break
        at = Expansion.of(system, q, idle)
        done = at.residual < CRITICAL_GRADIENT_TOL
        found += [
            CriticalPoint(q[k], at.multipliers[k], float(at.residual[k]), at.curvatures_of(k), float(at.E[k]))
            for k in map(int, np.flatnonzero(done))
        ]
        up = np.arange(at.curvatures.shape[-1]) < np.minimum(index, at.freedoms)[:, None]
        size = np.maximum(np.abs(at.curvatures), CRITICAL_CURVATURE_TOL)
        # near a critical point: Newton's method, whatever it is
        near = (at.residual < 1e-3) & (np.abs(at.slope / size)[:, : at.freedoms].max(axis=-1, initial=0.0) < 0.05)
        near |= index < 0
        sign = np.where(near[:, None], -np.sign(at.curvatures), np.where(up, 1.0, -1.0))
        sign[:, at.freedoms :] *= np.abs(at.curvatures[:, at.freedoms :]) > CRITICAL_CURVATURE_TOL
        step = _shorten_steps(times(at.directions, sign * at.slope / size), DESCENT_STEP_MAX)
        q = q + step + _shorten_steps(at.closing, DESCENT_STEP_MAX)
        going = ~done & np.isfinite(q).all(axis=-1) & (np.abs(q).max(axis=-1) < farthest)
        q, index = q[going], index[going]
    return found


def sharpen_points(system: CriticalPointProblem, points: Sequence[CriticalPoint], idle: int) -> list[CriticalPoint]:
    """Critical points after a few more of Newton's steps: where E is nearly flat, as far away, it is known where they
    are to fewer digits than ∇E."""
    if not points:
        return []
    q = np.array([each.q for each in points])
    for _ in range(CRITICAL_NEWTON_STEPS_COUNT):
        at = Expansion.of(system, q, idle)
        size = np.where(np.abs(at.curvatures) > CRITICAL_GRADIENT_TOL, at.curvatures, np.inf)
        q = q + times(at.directions, -at.slope / size) + at.closing
    at = Expansion.of(system, q, idle)
    return [
        CriticalPoint(q[k], at.multipliers[k], float(at.residual[k]), at.curvatures_of(k), float(at.E[k]))
        for k in range(len(q))
        if at.residual[k] < CRITICAL_GRADIENT_TOL
    ]


def find_loop_zeros(system: ErrorSystem, q: Array, index: NDArray[np.intp], idle: int) -> list[CriticalPoint]:
    """The zeros of J̃ᵀe along the motions of the loops, J̃ the rates that the law supposes, to which starts (c, N) lead:
    implicit steps of the loop s' = −(J̃ᵀJ̃)⁻¹ J̃ᵀe, which end where it does, or (``index`` not 0) Newton's method.
    ``curvatures`` are real parts of the eigenvalues of the loop, linearised, over −λ."""
    found: list[CriticalPoint] = []
    flows = index == 0
    for _ in range(EQUILIBRIUM_START_STEPS_MAX):
        if not len(q):
            break
        with np.errstate(all="ignore"):
            at = CriticalPointEquations(system, list(q.T))
            tangents = Tangents.of(at.DG)
            Z, back = tangents.Z, np.swapaxes(tangents.Z, -1, -2)
            E, pull, gram = at.command_terms()
            lost = np.asarray(~np.isfinite(gram).all(axis=(-1, -2)) | ~np.isfinite(pull).all(axis=-1))
            pull, gram = np.where(lost[:, None], 0.0, pull), np.where(lost[:, None, None], 0.0, gram)
            mu, p, v, M = tangents.multipliers(pull), tangents.closing(at.G), times(back, pull), back @ gram @ Z
            there = (q[:, None] + COMMAND_DIFFERENCE_STEP_MAX * back).reshape(-1, q.shape[1])
            turned = (
                CriticalPointEquations(system, list(there.T)).command_terms()[1].reshape(*back.shape) - pull[:, None]
            )
            A = back @ (
                np.swapaxes(np.nan_to_num(turned), -1, -2) / COMMAND_DIFFERENCE_STEP_MAX + at.bend(mu, error=False) @ Z
            )
        residual = np.maximum(np.linalg.norm(at.G, axis=-1), np.linalg.norm(v, axis=-1))
        done = (residual < CRITICAL_GRADIENT_TOL) & ~lost
        inverse = np.linalg.pinv(M, rcond=COMMAND_RATE_CUTOFF_FRACTION, hermitian=True)
        for k in np.flatnonzero(done):
            values = np.linalg.eigvals(inverse[k] @ A[k])
            kept = values[np.argsort(np.abs(values))[idle:]].real
            found.append(CriticalPoint(q[k], mu[k], float(residual[k]), np.sort(kept), float(E[k])))
        # steps of half a unit of time where the loop is fast, longer ones where it slows down
        slow = np.where(flows, 2 * np.minimum(1.0, np.linalg.norm(times(inverse, v), axis=-1)), 0.0)
        step = -times(np.linalg.pinv(slow[:, None, None] * M + A, rcond=COMMAND_RATE_CUTOFF_FRACTION), v)
        q = q + _shorten_steps(times(Z, step), DESCENT_STEP_MAX) + _shorten_steps(p, DESCENT_STEP_MAX)
        going = ~done & ~lost & np.isfinite(q).all(axis=-1) & (np.abs(q).max(axis=-1) < EQUILIBRIUM_COORDINATE_MAX)
        q, flows = q[going], flows[going]
    return found
