"""Near modes: poses that differ from the goal by no more than the measurement bound (docs/pages/proofs.md, section 8).

Lists of modes are of the numbers as they are. Where more is observed than needed, a mode of exact dimensions is not one
of rounded ones, but its measured values differ by no more than the rounding, and the servo loop has an equilibrium
there as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from ...errors import LoopClosureFailure
from ...geometry.so3 import compute_rotation_angle
from ...geometry.vectors import Array
from ...kinematics.assembly import build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.self_motions import bodies_apart
from ...kinematics.tasks import FixedValuesTask, shorten_step, solve
from ...kinematics.velocity_relation import ObservationModel, compute_platform_motions, compute_relation
from ...options import parse_plain_number
from ...records import As, Recorded
from ...results import Value
from ...tolerances import (
    CLOSURE_SOLVER_TOL,
    GEOMETRY_DIFFERENCE_TOL,
    NEAR_POSE_DIFFERENCE_TOL,
    NONZERO_SINGULAR_VALUE_MIN,
)
from ..accuracy.measurement_bounds import require_single_angle
from ..observed import ObservedRobot
from .assembly_mode import AssemblyMode, build_mode

CONTINUOUS_FAMILY_STEP_MAX = 0.02
"""Step (characteristic lengths, radians) over which values of a near mode must stay within the bound in a family."""
CURVATURE_DIFFERENCE_STEP_MAX = 1e-4
"""Step (characteristic lengths, radians) of the differences of such a slope."""
NEAR_MODE_STEPS_MAX = 60
"""Steps from a candidate to a near mode."""


@dataclass(frozen=True, eq=False, repr=False)
class NearMode(AssemblyMode):
    """Near mode: pose whose measured values differ from the goal's by ``angle`` at most (rad; lengths in characteristic
    lengths), at ``distance`` (m) and ``turned`` (rad) from the goal's.

    ``stable``: True if the difference has an isolated minimum there, which attracts the servo loop; None if the robot
    was not assembled. ``family``: one of a continuous family of poses, not an isolated minimum.
    """

    angle: Annotated[float, "largest difference of a measured value (rad; lengths in characteristic lengths)"] = 0.0
    distance: Annotated[float, As("distance_m"), "from the goal"] = 0.0
    turned: Annotated[float, As("turned_rad"), "from the goal"] = 0.0
    stable: Recorded[bool | None] = None
    family: Recorded[bool] = False

    @property
    def differs(self) -> str:
        """Largest difference of a measured value, and the distance of the pose, as text."""
        far = (
            f"at {1e3 * self.distance:.3g} mm"
            if self.distance > NEAR_POSE_DIFFERENCE_TOL * self.length
            else (f"rotated by {np.degrees(self.turned):.3g}°")
        )
        return f"by {format_degrees(self.angle)}, {far}"


@dataclass(frozen=True, eq=False, repr=False)
class StationaryPose(Value):
    """Closed configuration at which ½‖e‖² is stationary, e being the differences of the measured values from the
    goal's. ``angle`` is the largest of them (rad). ``isolated``: a strict minimum, which attracts the servo loop.
    ``family``: the observations leave the platform a dof there, and a step along it either way keeps all
    differences within the bound."""

    configuration: ClosedConfiguration
    angle: float
    isolated: bool
    family: bool


def descend(
    start: ClosedConfiguration, observation_model: ObservationModel, held: FixedValuesTask, bound: float
) -> StationaryPose | None:
    """Return the stationary difference to which Gauss-Newton steps lead on the closed loops; None if there is none, or
    if the loops open. Where the values leave a dof, a family is a motion either way with differences up to ``bound``
    (rad)."""
    at, model = start, start.model
    error, motions, rates = _find_changes(at, held)
    for _ in range(NEAR_MODE_STEPS_MAX):
        step = motions @ np.linalg.lstsq(rates, -error, rcond=None)[0]
        q, _ = solve(model, model.integrate(at.q, shorten_step(step, 0.5)), tolerance=CLOSURE_SOLVER_TOL)
        try:
            at = ClosedConfiguration.of(model, q)
        except LoopClosureFailure:
            return None
        error, motions, rates = _find_changes(at, held)
        if float(np.abs(step).max(initial=0.0)) < GEOMETRY_DIFFERENCE_TOL:
            break
    else:
        return None
    angle, relation = _find_largest(error, held), compute_relation(at, observation_model)
    if relation.rank == relation.dof.value and relation.seen.weakest >= NONZERO_SINGULAR_VALUE_MIN:
        return StationaryPose(
            at, angle, bool(_compute_loop_rates(at, held, motions, rates).min(initial=1.0) > 0.0), False
        )
    moving = compute_platform_motions(at, observation_model)
    way = moving @ np.linalg.svd(held.error_and_jacobian(model, at.q)[1] @ moving)[2][-1]
    beside = (
        solve(model, model.integrate(at.q, step * way), tolerance=CLOSURE_SOLVER_TOL)[0]
        for step in (CONTINUOUS_FAMILY_STEP_MAX, -CONTINUOUS_FAMILY_STEP_MAX)
    )
    return StationaryPose(
        at, angle, False, all(_find_largest(held.error_and_jacobian(model, q)[0], held) <= bound for q in beside)
    )


def _find_largest(error: Array, held: FixedValuesTask) -> float:
    """Return the largest angle (rad) of the differences of fixed values, one below the other (rows,)."""
    parts = np.split(error, np.cumsum([o.size for o, _ in held.measured])[:-1])
    return 2 * float(np.arcsin(min(1.0, max((float(np.linalg.norm(part)) for part in parts), default=0.0) / 2)))


def _find_changes(at: ClosedConfiguration, held: FixedValuesTask) -> tuple[Array, Array, Array]:
    """Return the errors of the fixed values (rows,), the motions of the loops (nv, k) that change them, and their rates
    (rows, k)."""
    error, rates = held.error_and_jacobian(at.model, at.q)
    kernel = at.kernel()[0]
    _, sizes, ways = np.linalg.svd(rates @ kernel, full_matrices=False)
    motions = kernel @ ways[sizes > NONZERO_SINGULAR_VALUE_MIN].T
    return error, motions, rates @ motions


def _compute_loop_rates(at: ClosedConfiguration, held: FixedValuesTask, motions: Array, rates: Array) -> Array:
    """The eigenvalues of (JᵀJ)⁻¹ H, H the Hessian of ½ ‖e‖² along motions, J the rates of e: by differences of the
    slope, of which the part beside JᵀJ is of the size of e."""
    model = at.model
    bends = np.zeros((motions.shape[1],) * 2)
    for k, way in enumerate(motions.T):
        for sign in (1.0, -1.0):
            q, _ = solve(
                model, model.integrate(at.q, sign * CURVATURE_DIFFERENCE_STEP_MAX * way), tolerance=CLOSURE_SOLVER_TOL
            )
            J = model.jacobian(q)
            error, slopes = held.error_and_jacobian(model, q)
            carried = motions - np.linalg.pinv(J, rcond=NONZERO_SINGULAR_VALUE_MIN) @ (J @ motions)
            bends[k] += sign * (error @ slopes @ carried) / (2 * CURVATURE_DIFFERENCE_STEP_MAX)
    return np.asarray(np.sort(np.linalg.eigvals(np.linalg.solve(rates.T @ rates, (bends + bends.T) / 2)).real))


def find_near_modes(
    setup: ObservedRobot,
    goal: ClosedConfiguration,
    observation_model: ObservationModel,
    known: Sequence[AssemblyMode],
    candidates: Sequence[AssemblyMode],
    bound: float,
) -> tuple[NearMode, ...]:
    """The near modes with differences up to ``bound`` (rad) to which candidates lead, those of least difference first:
    isolated minima, none of them the goal or a ``known`` mode, and one of those that are connected."""
    held, near_modes = (
        FixedValuesTask.at(goal.model, goal.q, observation_model.reference, observation_model.observations),
        list[NearMode](),
    )
    for mode in candidates if bound else ():
        near = _make_near_mode(setup, goal, observation_model, held, mode, bound)
        if near is None or near.angle > bound:
            continue
        bodies = near.bodies or {}
        others = [
            {body: goal.pose(body) for body in bodies},
            *(known_mode.bodies or {} for known_mode in (*known, *near_modes)),
        ]
        if all(
            bodies_apart(bodies, poses, observation_model, goal.model.length) > NEAR_POSE_DIFFERENCE_TOL
            for poses in others
        ):
            near_modes.append(near)
    families = [mode for mode in near_modes if mode.family]
    return tuple(sorted((mode for mode in near_modes if mode not in families[1:]), key=lambda mode: mode.angle))


def _make_near_mode(
    setup: ObservedRobot,
    goal: ClosedConfiguration,
    observation_model: ObservationModel,
    held: FixedValuesTask,
    mode: AssemblyMode,
    bound: float,
) -> NearMode | None:
    """A candidate as a near mode; one at which the robot was not assembled as it is, its residual as the difference."""
    angle, stable, family = mode.residual, None, False
    if mode.configuration is not None:
        try:
            start = build_from_link_poses(goal.model, mode.configuration.pose)
        except LoopClosureFailure:
            return None
        least = descend(start, observation_model, held, bound)
        if least is None or not (least.isolated or least.family):
            return None
        at, angle, stable, family = least.configuration, least.angle, least.isolated or None, least.family
        mode = build_mode(
            setup, observation_model, at, {body: at.pose(body) for body in mode.bodies or {}}, mode.residual
        )
    distance, turned = measure_distance(setup.motion, goal, mode)
    return NearMode(
        **{field.name: getattr(mode, field.name) for field in fields(AssemblyMode)},
        angle=angle,
        distance=distance,
        turned=turned,
        stable=stable,
        family=family,
    )


def format_degrees(angle: float) -> str:
    """Return an angle (rad) in degrees, rounded, never as zero."""
    return f"{max(float(np.degrees(angle)), 1e-9):.1g}°"


def describe_poses_alike(modes: Sequence[AssemblyMode], near: Sequence[NearMode]) -> str:
    """Return the number of poses that a measurement with an error does not distinguish, and their kinds."""
    count = len(modes) + len(near)
    exact = sum(not mode.goal for mode in modes)
    others = [f"{exact} with the same values"] * bool(exact)
    isolated = [mode for mode in near if not mode.family]
    if len(isolated) == 1:
        others.append(f"one that differs {isolated[0].differs}")
    elif isolated:
        others.append(f"{len(isolated)} that differ by up to {format_degrees(isolated[-1].angle)}")
    others += [f"a continuous family that differs {mode.differs} at one of its poses" for mode in near if mode.family]
    return f"{count} poses look the same: {', '.join(['the goal', *others[:-1]])} and {others[-1]}"


def measure_distance(motion: PlatformMotion, goal: ClosedConfiguration, mode: AssemblyMode) -> tuple[float, float]:
    """Return the platform's distance from its pose at the goal (m, rad)."""
    home, pose = goal.pose(motion.link), mode.pose
    at = np.array([pose.x, pose.y, pose.z], dtype=float)
    return float(np.linalg.norm(at - motion.position(home))), (
        0.0 if pose.rotation is None else compute_rotation_angle(pose.rotation @ home[:3, :3].T)
    )


def parse_measurement_bound(cone: float | str) -> float:
    """Return a measurement bound (rad) as a user writes it, 0 for none; raises ``BadRequest``."""
    try:
        exact = parse_plain_number(str(cone).removesuffix("deg").strip()) == 0
    except ValueError:
        exact = False
    return 0.0 if exact else require_single_angle(cone)
