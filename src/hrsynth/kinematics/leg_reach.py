"""Which leg alone cannot bring the platform to a pose, and by how much it misses."""

from __future__ import annotations

import numpy as np

from ..errors import HrsynthError
from ..geometry.gauss_newton import Damping, Residual, descend
from ..geometry.ranks import kernel_basis
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..mechanism.legs import Leg, LegDecomposition, decompose
from ..tolerances import CLOSED, FOLLOWED, NO_NEARER, RANK_CUTOFF, SOLVED
from .configuration import ClosedConfiguration
from .pinocchio_model import PinocchioModel
from .platform_motion import Goal, PlatformMotion
from .tasks import solve

WAY = 10
"""Points of the way at which a leg alone is led towards a pose, so that it keeps its working mode."""
ASIDE = 8
"""Random starts from which a leg that seems to miss is led again: a stretched one does not bend by itself."""
SETTLED = 3
"""Steps over which an error that hardly falls any more is what is left."""
HOPELESS = 100.0
"""So many times what these steps win must lead below what is reached already, or the start is given up."""
DAMPING = Damping(start=1e-3, eased=0.2, least=1e-12, most=1e7)


def worst_leg(twin: PinocchioModel, motion: PlatformMotion, goal: Goal) -> tuple[str | None, float, float]:
    """The leg that alone misses a goal most, with the miss in metres and in radians; None where each leg reaches it.

    Each leg is taken with base and platform alone; the platform keeps to what it generically does.
    """
    try:
        anatomy = decompose(twin.mechanism)
    except HrsynthError:
        return None, 0.0, 0.0
    misses = []
    for leg in anatomy.legs:
        error = _miss(PinocchioModel(alone(anatomy, leg), twin.length), motion, goal)
        lengths, angles = np.split(error, [goal.lengths])
        misses.append((float(np.linalg.norm(error)), leg.label, twin.length * float(np.linalg.norm(lengths)),
                       float(np.linalg.norm(angles))))
    size, label, lengths_missed, angle = max(misses, key=lambda miss: miss[0])
    return (label, lengths_missed, angle) if size > FOLLOWED else (None, 0.0, 0.0)


def alone(anatomy: LegDecomposition, leg: Leg) -> Mechanism:
    """One leg with base and platform, the other legs taken away."""
    mechanism = anatomy.mechanism
    kept = {mechanism.base, *anatomy.platform, *leg.links}
    others = [name for other in anatomy.legs if other is not leg for name in other.joints]
    return mechanism.changed(remove_links=set(mechanism.links) - kept, remove_joints=others, observations=(),
                             camera=None)


def _miss(twin: PinocchioModel, motion: PlatformMotion, goal: Goal) -> Array:
    """The error of a goal that is left when the leg comes as near as its loops and the platform's manner allow: from
    zero, else from wherever it comes nearest."""
    at = ClosedConfiguration.of(twin, twin.q0, FOLLOWED)
    X, manner = at.pose(motion.link), motion.manner()
    for number in range(1, WAY + 1):
        at = _approached(at, goal.towards(X, number / WAY), manner, 200 if number == WAY else 10)
    least = goal.rows(twin, at.q)[0]
    rng = np.random.default_rng(0)
    for _ in range(ASIDE):
        if np.linalg.norm(least) <= FOLLOWED:
            break
        q, residual = solve(twin, twin.moved(at.q, rng.uniform(-1, 1, twin.nv)), manner, tolerance=SOLVED)
        if residual <= CLOSED:
            found = _approached(ClosedConfiguration.of(twin, q), goal, manner, 200, float(np.linalg.norm(least)))
            least = min(least, goal.rows(twin, found.q)[0], key=lambda error: float(np.linalg.norm(error)))
    return least


def _approached(at: ClosedConfiguration, goal: Goal, manner: Goal, iterations: int, known: float = np.inf
                ) -> ClosedConfiguration:
    """Minimise a goal's error with the loops closed and ``manner`` kept: damped Gauss-Newton in the tangent space;
    given up where the error will not fall below the one that is ``known``."""
    twin = at.twin

    def tangent(at: ClosedConfiguration) -> tuple[ClosedConfiguration, Array]:
        return at, kernel_basis(np.vstack([twin.jacobian(at.q), manner.rows(twin, at.q)[1]]), 1.0)[0]

    def evaluate(here: tuple[ClosedConfiguration, Array]) -> tuple[Array, Array]:
        error, rows = goal.rows(twin, here[0].q)
        return error, rows @ here[1]

    def advance(here: tuple[ClosedConfiguration, Array], left: Residual, factor: float
                ) -> tuple[ClosedConfiguration, Array] | None:
        damped = np.vstack([left.J, np.sqrt(factor) * np.eye(left.J.shape[1])])
        wanted = np.append(-left.error, np.zeros(left.J.shape[1]))
        step = here[1] @ np.linalg.lstsq(damped, wanted, rcond=None)[0]
        q, residual = solve(twin, twin.moved(here[0].q, step), manner, tolerance=SOLVED)
        return tangent(ClosedConfiguration.of(twin, q)) if residual <= CLOSED else None

    sizes: list[float] = []

    def content(left: Residual) -> bool:
        if not sizes or left.size < sizes[-1]:
            sizes.append(left.size)
        # far from a goal out of reach the steps become short, as J does not tell how its rows turn
        won = sizes[-1 - SETTLED] - left.size if len(sizes) > SETTLED else np.inf
        return won <= NO_NEARER * left.size or left.size - known > HOPELESS * won or left.size <= SOLVED or bool(
            np.linalg.norm(left.J.T @ left.error) <= RANK_CUTOFF * left.size)

    return descend(tangent(at), evaluate, advance, DAMPING, iterations, content)[0][0]
