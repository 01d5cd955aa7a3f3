"""Leg that alone cannot bring the platform to a pose, and by how much it misses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ..errors import HrsynthError, LegMiss
from ..geometry.ranks import compute_kernel_basis
from ..geometry.vectors import Array, invert_pose, transform
from ..mechanism import JointType, Mechanism
from ..mechanism.graphs import build_adjacency, find_shortest_path
from ..mechanism.legs import Leg, LegDecomposition, decompose
from ..solving.gauss_newton import DampingFactor, Residual, descend
from ..tolerances import (
    CLOSURE_RESIDUAL_TOL,
    CLOSURE_SOLVER_TOL,
    HIDDEN_ROBOT_RESIDUAL_TOL,
    PRINTED_POSE_TOL,
    RANK_CUTOFF_FRACTION,
)
from .configuration import ClosedConfiguration
from .pinocchio_model import PinocchioModel
from .platform_motion import PlatformMotion, PoseTask
from .tasks import solve

LEG_PROGRESS_MIN_FRACTION = 1e-9
"""Smallest relative progress of a leg toward a goal over some steps; below it the leg stops."""

LEG_PATH_POINTS_COUNT = 10
"""Number of points of the path along which a leg alone is led towards a pose, so that it keeps its working mode."""
LEG_REACH_RANDOM_STARTS_COUNT = 8
"""Number of random starts from which a leg that seems to miss is led again: a stretched one does not bend by itself."""
LEG_REACH_WINDOW_COUNT = 3
"""Number of steps after which an error that hardly falls any more is final."""
LEG_REACH_EXTRAPOLATION_FRACTION = 100.0
"""Factor: so many times the gain of these steps must lead below the best error, or the start is given up."""
DAMPING = DampingFactor(start=1e-3, eased=0.2, least=1e-12, most=1e7)


def find_worst_leg(model: PinocchioModel, motion: PlatformMotion, goal: PoseTask) -> LegMiss | None:
    """Return the leg that alone misses a goal most, None if each leg reaches it: by its rods' lengths if that is more
    than these together, else by the error that a descent leaves.

    Each leg is taken with base and platform alone; the platform keeps its generic motion.
    """
    try:
        decomposition = decompose(model.mechanism)
    except HrsynthError:
        return None
    short = max(
        ((float(each[0]), most, label) for label, most, each in compute_rod_misses(decomposition, motion, [goal])),
        default=(0.0, 0.0, ""),
    )
    if short[0] > short[1]:
        return LegMiss(short[2], short[0], 0.0, True)
    misses = []
    for leg in decomposition.legs:
        error = _compute_miss(PinocchioModel(extract_leg(decomposition, leg), model.length), motion, goal)
        lengths, angles = np.split(error, [goal.lengths])
        misses.append(
            (
                float(np.linalg.norm(error)),
                LegMiss(leg.label, model.length * float(np.linalg.norm(lengths)), float(np.linalg.norm(angles))),
            )
        )
    size, worst = max(misses, key=lambda miss: miss[0])
    return worst if size > HIDDEN_ROBOT_RESIDUAL_TOL else None


def find_beyond_rods(mechanism: Mechanism, motion: PlatformMotion, goals: Sequence[PoseTask]) -> set[int]:
    """Return the indices of goals that some leg misses by its rods' lengths."""
    try:
        decomposition = decompose(mechanism)
    except HrsynthError:
        return set()
    return {
        int(i) for *_, misses in compute_rod_misses(decomposition, motion, goals) for i in np.flatnonzero(misses > 0)
    }


def compute_rod_misses(
    decomposition: LegDecomposition, motion: PlatformMotion, goals: Sequence[PoseTask]
) -> Iterator[tuple[str, float, Array]]:
    """Yield for each leg its label, the sum of its rods' lengths to the platform's point, and a lower bound (n,) of its
    distance from goals by these lengths (m); not positive if they give none.

    Centres of R, U and S joints keep their distances on each link. So along a chain of them an end is at most the sum
    of these away from the first one, and at least twice the longest less that sum: the platform's point, and if a goal
    leaves no rotation free the last centre. Of a point that may move only the distance in desired directions counts.
    """
    point = motion.position(motion.home)
    X = np.array([motion.pose_of(goal) for goal in goals]).reshape(-1, 4, 4)
    placed, turned = (
        np.array([told(goal) for goal in goals], dtype=bool)
        for told in (motion.is_placed, lambda goal: motion.turns_left(goal) == 0)
    )
    seen = np.array(
        [np.eye(3) if known else goal.directions.T @ goal.directions for goal, known in zip(goals, placed, strict=True)]
    ).reshape(-1, 3, 3)
    for label, centres in _locate_centres(decomposition, motion):
        last = transform(invert_pose(motion.home), centres[-1])
        found, lengths = np.full(len(goals), -np.inf), list[float]()
        for known, home, arm in ((np.ones_like(turned), point, motion.point), (turned, centres[-1], last)):
            rods = np.linalg.norm(np.diff([*centres, home], axis=0), axis=1)
            most, ends = float(rods.sum()), X[:, :3, 3] + X[:, :3, :3] @ arm
            lengths.append(most)
            far = np.linalg.norm((seen @ (ends - centres[0])[..., None])[..., 0], axis=1)
            missed = np.maximum(far - most, np.where(placed, 2 * rods.max() - most - far, -np.inf))
            found = np.where(known, np.maximum(found, missed - PRINTED_POSE_TOL * (1 + most)), found)
        yield label, lengths[0], found


def _locate_centres(decomposition: LegDecomposition, motion: PlatformMotion) -> Iterator[tuple[str, Array]]:
    """Return, for legs with such chains, the centres (n, 3) of the joints from the base to the platform."""
    mechanism = decomposition.mechanism
    centred = (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL)
    for leg in decomposition.legs:
        within = {mechanism.base, *decomposition.platform, motion.link, *leg.links}
        bonds = {
            frozenset(joint.links): joint
            for joint in mechanism.joints.values()
            if joint.type in centred and within.issuperset(joint.links)
        }
        try:
            links = find_shortest_path(build_adjacency(within, bonds), mechanism.base, motion.link)
        except KeyError:
            continue
        yield leg.label, np.array([bonds[frozenset(pair)].point for pair in pairwise(links)])


def extract_leg(decomposition: LegDecomposition, leg: Leg) -> Mechanism:
    """Return one leg with base and platform, without the other legs."""
    mechanism = decomposition.mechanism
    kept = {mechanism.base, *decomposition.platform, *leg.links}
    others = [name for other in decomposition.legs if other is not leg for name in other.joints]
    return mechanism.changed(
        remove_links=set(mechanism.links) - kept, remove_joints=others, observations=(), camera=None
    )


def _compute_miss(model: PinocchioModel, motion: PlatformMotion, goal: PoseTask) -> Array:
    """Return the error of a goal that is left when the leg comes as near as its loops and the platform's motion allow:
    from zero, else from its nearest configuration."""
    at = ClosedConfiguration.of(model, model.q0, HIDDEN_ROBOT_RESIDUAL_TOL)
    X, manner = at.pose(motion.link), motion.manner()
    for number in range(1, LEG_PATH_POINTS_COUNT + 1):
        at = _approach(
            at, goal.towards(X, number / LEG_PATH_POINTS_COUNT), manner, 200 if number == LEG_PATH_POINTS_COUNT else 10
        )
    least = goal.error_and_jacobian(model, at.q)[0]
    rng = np.random.default_rng(0)
    for _ in range(LEG_REACH_RANDOM_STARTS_COUNT):
        if np.linalg.norm(least) <= HIDDEN_ROBOT_RESIDUAL_TOL:
            break
        q, residual = solve(
            model, model.integrate(at.q, rng.uniform(-1, 1, model.nv)), manner, tolerance=CLOSURE_SOLVER_TOL
        )
        if residual <= CLOSURE_RESIDUAL_TOL:
            found = _approach(ClosedConfiguration.of(model, q), goal, manner, 200, float(np.linalg.norm(least)))
            least = min(
                least, goal.error_and_jacobian(model, found.q)[0], key=lambda error: float(np.linalg.norm(error))
            )
    return least


def _approach(
    at: ClosedConfiguration, goal: PoseTask, manner: PoseTask, iterations: int, known: float = np.inf
) -> ClosedConfiguration:
    """Minimise a goal's error with the loops closed and ``manner`` kept: damped Gauss-Newton in the tangent space;
    given up if the error will not fall below the one that is ``known``."""
    model = at.model

    def tangent(at: ClosedConfiguration) -> tuple[ClosedConfiguration, Array]:
        return at, compute_kernel_basis(
            np.vstack([model.jacobian(at.q), manner.error_and_jacobian(model, at.q)[1]]), 1.0
        )[0]

    def evaluate(here: tuple[ClosedConfiguration, Array]) -> tuple[Array, Array]:
        error, rows = goal.error_and_jacobian(model, here[0].q)
        return error, rows @ here[1]

    def advance(
        here: tuple[ClosedConfiguration, Array], left: Residual, factor: float
    ) -> tuple[ClosedConfiguration, Array] | None:
        damped = np.vstack([left.J, np.sqrt(factor) * np.eye(left.J.shape[1])])
        wanted = np.append(-left.error, np.zeros(left.J.shape[1]))
        step = here[1] @ np.linalg.lstsq(damped, wanted, rcond=None)[0]
        q, residual = solve(model, model.integrate(here[0].q, step), manner, tolerance=CLOSURE_SOLVER_TOL)
        return tangent(ClosedConfiguration.of(model, q)) if residual <= CLOSURE_RESIDUAL_TOL else None

    sizes: list[float] = []

    def content(left: Residual) -> bool:
        if not sizes or left.size < sizes[-1]:
            sizes.append(left.size)
        # far from a goal out of reach the steps become short, as J does not contain how its rows rotate
        won = sizes[-1 - LEG_REACH_WINDOW_COUNT] - left.size if len(sizes) > LEG_REACH_WINDOW_COUNT else np.inf
        return (
            won <= LEG_PROGRESS_MIN_FRACTION * left.size
            or left.size - known > LEG_REACH_EXTRAPOLATION_FRACTION * won
            or left.size <= CLOSURE_SOLVER_TOL
            or bool(np.linalg.norm(left.J.T @ left.error) <= RANK_CUTOFF_FRACTION * left.size)
        )

    return descend(tangent(at), evaluate, advance, DAMPING, iterations, content)[0][0]
