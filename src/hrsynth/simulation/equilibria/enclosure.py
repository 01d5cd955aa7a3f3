"""Enclosures of critical points of the error: a box with exactly one, and its index.

Unknowns are the coordinates and the multipliers (q, μ), equations ∇E + DGᵀ μ = 0 and G = 0; for internal motions, as
many coordinates are fixed. With K the derivatives, [[H, DGᵀ], [DG, 0]], enclosed over the box |x − x₀| ≤ r, and Y about
K⁻¹, Krawczyk's operator −Y F(x₀) + (1 − Y K) [−r, r] inside [−r, r] proves one zero there (A. Neumaier, Interval
Methods for Systems of Equations, 1990, section 5.1). VᵀKV, V about the eigenvectors of K, then has the inertia of K
(Sylvester), which is that of H along the motions of the loops beside m positive and m negative ones; its diagonal
decides it where it outweighs the other entries of each row (Gershgorin).

The loop, linearised without damping, is ṡ = −λ (JᵀJ)⁻¹ H s along the motions of the loops, J the rates of e. The
eigenvalues μ of (JᵀJ)⁻¹ H below σ are as many as negative ones of H − σ JᵀJ along these motions where JᵀJ is positive
definite there, and the inertia of K − σ [[JᵀJ, 0], [0, 0]] gives that number: so each μ is enclosed between two σ.

The equations of the loops that are not among G hold where they follow from these (:func:`unexplained_rows`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.branch.redundant import count_independent_equations
from ...equations.measured_error import CriticalPointEquations, ErrorSystem
from ...geometry.affine import AffineForms, combine, make_affine
from ...geometry.vectors import Array
from ...results import Value
from ...solving.krawczyk import bound_contraction, bound_image
from ...tolerances import AFFINE_ROUNDING, TUBE_RADII_COUNT, TUBE_RADIUS_MIN, TUBE_WIDENING_FRACTION
from .descent import CriticalPoint, Tangents

RATE_WIDTHS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-1)
"""Distances, relative ones where an eigenvalue is above 1, at which bounds of it are tried."""


@dataclass(frozen=True, eq=False, repr=False)
class EnclosedPoint(Value):
    """Box |q − q₀| ≤ r (N,) with exactly one critical point, its internal coordinates fixed. ``index`` is the number of
    negative eigenvalues of the Hessian along the motions of the loops, the others positive; None if not proved. Loops
    ``measured`` have equations that were left out and do not follow from the others. ``rates`` enclose the eigenvalues
    of (JᵀJ)⁻¹ H, ascending: −1/λ times those of the linearised loop, without damping; empty if not proved."""

    q: Array
    radius: Array
    index: int | None
    measured: tuple[str, ...] = ()
    rates: tuple[tuple[float, float], ...] = ()

    def signs(self, count: int) -> Array:
        """The signs (count,) of the eigenvalues, ascending."""
        return np.where(np.arange(count) < (self.index or 0), -1.0, 1.0)


def enclose_points(system: ErrorSystem, points: Sequence[CriticalPoint], idle: int) -> list[EnclosedPoint | None]:
    """Boxes around critical points, None where nothing was proved; where the equations of the loops that were chosen
    are nearly dependent, with others."""
    q = np.array([each.q for each in points])
    found = _enclose(system, q, idle) if points else []
    left = [k for k, each in enumerate(found) if each is None or each.index is None]
    while left:
        # equations that are independent at one are so at others
        again = _enclose(system.select_rows_at(q[left[:1]]), q[left], idle)
        for k, each in zip(left, again, strict=True):
            found[k] = each or found[k]
        left = [k for k in left[1:] if (each := found[k]) is None or each.index is None]
    return found


def _enclose(system: ErrorSystem, q: Array, idle: int) -> list[EnclosedPoint | None]:
    """Enclose critical points about configurations (c, N) with the equations of the system."""
    size, count = system.size
    at = CriticalPointEquations(system, list(q.T))
    mu = Tangents.of(at.DG).multipliers(at.slope)
    free = _free(system, q, idle)
    # over held coordinates the identity
    known = np.concatenate([free, np.ones((len(q), count))], axis=-1)

    def evaluated(radius: Array, some: Any = slice(None)) -> tuple[AffineForms, AffineForms, CriticalPointEquations]:
        """F (c, n) and K (c, n, n) over boxes of radii (c, n) about some of the points, n = N + m."""
        middle, mult, mask = q[some], mu[some], known[some]
        forms = [make_affine(middle[:, i], np.zeros((len(middle), 0)), radius[:, i]) for i in range(size)]
        held = make_affine(mult, np.zeros((*mult.shape, 0)), radius[:, size:])
        at = CriticalPointEquations(system, forms)
        F, K = (
            AffineForms(np.zeros((1, *shape)), np.zeros(shape))
            for shape in (radius.shape, (*radius.shape, radius.shape[-1]))
        )
        bend, pull, DG = at.bend(held), at.pull(held), at.DG
        for total, part, place in (
            (F, pull, (slice(size),)),
            (F, at.G, (slice(size, None),)),
            (K, bend, (slice(size), slice(size))),
            (K, DG, (slice(size, None), slice(size))),
        ):
            total.v[(..., *place)], total.r[(..., *place)] = part.v, part.r
        back = DG.transposed()
        K.v[..., :size, size:], K.r[..., :size, size:] = back.v, back.r
        both = mask[:, :, None] * mask[:, None, :]
        held_one = (1 - mask)[..., None] * np.eye(mask.shape[-1])
        K = AffineForms(K.v * both, K.r * both)
        K.v[0] += held_one
        return AffineForms(F.v * mask, F.r * mask), K, at

    still = np.zeros(known.shape)
    with np.errstate(all="ignore"):
        F, K, _ = evaluated(still)
        Y = np.linalg.inv(K.v[0] + _lost_rank(K.v[0]))
        e = combine(Y, F).size
        radius = TUBE_WIDENING_FRACTION * e + TUBE_RADIUS_MIN
        done, found = np.zeros(len(q), dtype=bool), still.copy()
        inertia, left = np.full(len(q), -1), np.arange(len(q))
        for _ in range(TUBE_RADII_COUNT):
            _, K, _ = evaluated(radius, left)
            wanted = bound_image(e[left], bound_contraction(Y[left], K), radius)
            fits = np.all(wanted < radius, axis=-1)
            found[left[fits]], done[left[fits]] = radius[fits], True
            left, radius = left[~fits], (TUBE_WIDENING_FRACTION * np.maximum(wanted, radius))[~fits]
            if not len(left):
                break
        _, K, at = evaluated(found)
        inertia[done] = negative(K)[done]
        gram, inside = at.gram(), free[:, :, None] * free[:, None, :]
        rates = _rates(K, AffineForms(gram.v * inside, gram.r * inside), free, count)
    measured = unexplained_rows(system)
    return [
        EnclosedPoint(
            q[k], found[k, :size] * free[k], None if inertia[k] < 0 else int(inertia[k]) - count, measured, rates[k]
        )
        if done[k]
        else None
        for k in range(len(q))
    ]


def _rates(K: AffineForms, gram: AffineForms, free: Array, count: int) -> list[tuple[tuple[float, float], ...]]:
    """Enclosures of the eigenvalues of JᵀJ (c, N, N) and H along the motions of the loops; ``free`` coordinates (c, N),
    ``count`` equations of the loops and K as :func:`_enclose` has them."""
    size, freedoms = gram.r.shape[-1], int(free[0].sum()) - count
    M = AffineForms(np.zeros((len(gram.v), *K.r.shape)), np.zeros(K.r.shape))
    M.v[..., :size, :size], M.r[:, :size, :size] = gram.v, gram.r
    # with JᵀJ in the place of H
    flat = AffineForms(K.v.copy(), K.r.copy())
    flat.v[..., :size, :size], flat.r[:, :size, :size] = gram.v, gram.r
    flat.v[0, :, :size, :size] += (1 - free)[..., None] * np.eye(size)
    definite = negative(flat) == count
    about = np.array(
        [
            _eigenvalues(k[:size, :size], g, k[size:, :size], np.flatnonzero(own), freedoms)
            for k, g, own in zip(K.v[0], gram.v[0], free, strict=True)
        ]
    )
    bounds = np.full((2, *about.shape), np.nan)
    for k in range(freedoms):
        for side, sign in enumerate((-1.0, 1.0)):
            for width in RATE_WIDTHS:
                left = np.flatnonzero(definite & np.isnan(bounds[side, :, k]) & np.isfinite(about[:, k]))
                if not len(left):
                    break
                sigma = about[left, k] + sign * width * np.maximum(1.0, np.abs(about[left, k]))
                own, part = (AffineForms(each.v[:, left], each.r[left]) for each in (K, M))
                below = negative(own - part * sigma[:, None, None])
                proved = (below >= 0) & ((below - count <= k) if side == 0 else (below - count > k))
                bounds[side, left[proved], k] = sigma[proved]
    known = definite & np.isfinite(bounds).all(axis=(0, 2))
    return [
        tuple(zip(low, high, strict=True)) if good else ()
        for good, low, high in zip(known, bounds[0].tolist(), bounds[1].tolist(), strict=True)
    ]


def _eigenvalues(H: Array, gram: Array, DG: Array, free: NDArray[np.intp], count: int) -> Array:
    """Return approximate eigenvalues of gram⁻¹ H on the kernel of DG; NaN where gram is singular there."""
    from scipy.linalg import LinAlgError, eigh

    if not (np.isfinite(H).all() and np.isfinite(gram).all() and np.isfinite(DG).all()):
        return np.full(count, np.nan)
    Z = np.linalg.svd(DG[:, free])[2][len(DG) :].T if len(DG) else np.eye(len(free))
    part = np.ix_(free, free)
    try:
        values = eigh(Z.T @ H[part] @ Z, Z.T @ gram[part] @ Z, eigvals_only=True)
    except LinAlgError:
        return np.full(count, np.nan)
    return np.asarray(values) if len(values) == count else np.full(count, np.nan)


def _lost_rank(K: Array) -> Array:
    """Return the matrices that make singular matrices (c, n, n) invertible: nothing is proved of these."""
    known = np.where(np.isfinite(K), K, 0.0)
    values = np.linalg.svd(known, compute_uv=False)
    lost = ~np.isfinite(K).all(axis=(-1, -2)) | (values[..., -1] <= 1e-14 * values[..., 0])
    return np.where(lost[:, None, None], np.eye(K.shape[-1]) - K, 0.0)


def negative(K: AffineForms) -> Array:
    """The numbers (c,) of negative eigenvalues of all symmetric matrices in K (c, n, n), −1 where that was not proved:
    of VᵀKV each diagonal entry outweighs its row."""
    known = np.asarray(np.isfinite(K.size).all(axis=(-1, -2)))
    K = AffineForms(np.where(known[:, None, None], K.v, 0.0), np.where(known[:, None, None], K.r, 0.0))
    back = np.swapaxes(np.linalg.eigh((K.v[0] + np.swapaxes(K.v[0], -1, -2)) / 2)[1], -1, -2)
    # what entries share is counted once
    turned = combine(back, combine(back, K).transposed())
    D, doubt = turned.v[0], turned.spread
    scale = 1 / np.sqrt(np.abs(np.diagonal(D, axis1=-2, axis2=-1)) + 1e-300)
    D, doubt = (each * scale[..., :, None] * scale[..., None, :] for each in (D, doubt))
    diagonal = np.diagonal(D, axis1=-2, axis2=-1)
    rest = (np.abs(D) + doubt).sum(axis=-1) - np.abs(diagonal)
    proved = known & np.all(np.abs(diagonal) > rest * (1 + AFFINE_ROUNDING), axis=-1)
    return np.where(proved, (diagonal < 0).sum(axis=-1), -1)


def _free(system: ErrorSystem, q: Array, idle: int) -> Array:
    """Return 1 for coordinates (c, N) that are solved for, 0 for as many as there are internal motions: those that
    distinguish these best."""
    free = np.ones(q.shape)
    if idle and len(q):
        from scipy.linalg import qr

        for k, motions in enumerate(idle_motions(system, q, idle)):
            _, _, order = qr(motions.T, mode="economic", pivoting=True)
            free[k, order[:idle]] = 0.0
    return free


def idle_motions(system: ErrorSystem, q: Array, idle: int) -> Array:
    """Return motions of the loops (c, N, k) at configurations (c, N) with the flattest E: the internal ones."""
    at = CriticalPointEquations(system, list(q.T))
    tangents = Tangents.of(at.DG)
    Z = tangents.Z
    values, vectors = np.linalg.eigh(np.swapaxes(Z, 1, 2) @ at.bend(tangents.multipliers(at.slope)) @ Z)
    order = np.argsort(np.abs(values), axis=1)[:, None, :idle]
    return np.asarray(Z @ np.take_along_axis(vectors, order, axis=2))


def unexplained_rows(system: ErrorSystem) -> tuple[str, ...]:
    """The loops of which equations were left out that do not follow from the chosen ones."""
    chosen = [loop.name for loop, _ in system.rows]
    return tuple(
        loop.name
        for loop in system.system.loops
        if chosen.count(loop.name) < len(loop.rows)
        and chosen.count(loop.name) != count_independent_equations(system.system, loop)
    )
