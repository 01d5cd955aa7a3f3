"""The interaction matrix at a configuration, by singular values of the own Jacobians."""

from __future__ import annotations

import numpy as np

from adversary.case import Case
from adversary.robot import Array, Items, State
from adversary.search import split


def inverse_law(case: Case, items: Items, at: State) -> Array | None:
    """J (6, 3 k): the twist (m, rad; of a point body its velocity) of least squares for rates of the directions; None
    where they do not show it, or where singular values do not say so clearly."""
    local = case.study.locals(at)[0]
    U = np.asarray(case.study.rates(items, at)[0], dtype=float)
    dof, seen, clear = local.sees(U)
    if not clear or seen < dof:
        return None
    U = U @ local.N
    s = np.linalg.svd(U, compute_uv=False)
    kept, clear = split(s)
    J = local.T @ np.linalg.pinv(U, rcond=float(s[kept - 1] / s[0]) * 0.5)
    return J * np.array([case.robot.length] * 3 + [1.0] * (len(J) - 3))[:, None] if clear else None


def sees_least(case: Case, items: Items, at: State) -> Array:
    """The smallest singular value of Mᵀ on the feasible twists at each configuration, (N,); M A = U N (T N)⁺. Zero
    where the platform moves with all directions held: such a motion can differ by idle ones that turn a direction."""
    found = []
    for local, rates in zip(case.study.locals(at), case.study.rates(items, at), strict=True):
        _, s, V = np.linalg.svd(local.T, full_matrices=False)
        dof = int(np.sum(s > 1e-7))
        U = np.asarray(rates, dtype=float) @ local.N
        _, shown, held = np.linalg.svd(U)
        still = local.T @ held[int(np.sum(shown > 1e-7)) :].T
        if still.size and float(np.linalg.norm(still, 2)) > 1e-6:
            found.append(0.0)
            continue
        M = U @ V[:dof].T / s[:dof]
        found.append(float(np.linalg.svd(M, compute_uv=False)[dof - 1]) if dof and len(M) >= dof else 0.0)
    return np.array(found)
