"""Control law on the measured values (MMT 2.3.2, eqs. 9-12), for any robot and any observations; and the desired values
in time: those of the goal at once, or along the straight path of poses.

Each kind of observation gives its error e_i and ∂e_i/∂y_i: of directions e_i = u_i × u_di and −[u_di]ₓ, L_iᵀ = −[u_di]ₓ
M_iᵀ. Then τ = −λ L^{T+} e and q̇ = J_inv τ are solved at once on the tangent space of the closed loops: with B a basis
of it and U B the rates of the values, q̇ = −λ B (L U B)⁺ e, where L stacks the ∂e_i/∂y_i. The rates of image values
need a depth, which the law may assume: ``planes``. If all platform twists are observed, this is the same velocity of
least norm; and it stays finite where Mᵀ does not exist because an observed leg is stretched (Type 1), as the motion
through such a pose is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ..errors import BadRequest, PoseReachFailure
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration, measure
from ..kinematics.continuation import lead_to
from ..kinematics.platform_motion import PlatformMotion, PoseTask
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism.cameras import CameraObservation, make_depth_plane
from ..mechanism.observations.direction import SeenAxis
from ..options import option, parse_plain_number
from ..results import Value
from ..tolerances import CONTROLLER_DAMPING_MIN, POSE_VALUE_MAX

Measures = Sequence[Array] | Array
"""The values (size,) of each observation, lengths in characteristic lengths; of directions also as (k, 3)."""
Desired = Callable[[float], tuple[Measures, Measures]]
"""Desired values and their rates at a time."""
Poses = Callable[[str], Array]
"""The pose X_BL (4, 4) of each link."""
Sense = Callable[[float, Poses, Measures], Measures]
"""Measured values at a time, given link poses and true values."""
TRAJECTORY_POSES_COUNT = 24
"""Poses between start and goal at which the values of a trajectory are taken."""
SUPPOSED = "exact, desired or constant:METRES"

Depth = Annotated[
    str,
    option(
        "Depths in images that the control law uses: exact, desired (those at the goal) or constant:METRES.", "DEPTH"
    ),
]


@dataclass(frozen=True, eq=False, repr=False)
class Command(Value):
    """Command at a configuration: joint velocities (nv,), of each observation the true error, the true value and the
    measured one, and the singular values of the rows that it inverts, as many as the platform dof, largest first."""

    velocity: Array
    error: tuple[Array, ...]
    true: tuple[Array, ...]
    seen: tuple[Array, ...]
    values: Array
    weak: Array
    """The joint velocity (nv,), of unit norm, that the measured errors show least."""
    pull: float
    """Norm of the gradient of ½ ‖e‖², e as measured, along the motions of the loops."""

    @property
    def size(self) -> float:
        """‖e‖ of the true error."""
        return float(np.linalg.norm(np.concatenate(self.error)))

    @property
    def speed(self) -> float:
        """Norm of the joint velocities (characteristic lengths, radians, seconds)."""
        return float(np.linalg.norm(self.velocity))


@dataclass(frozen=True, eq=False, repr=False)
class Law(Value):
    """Control law of one robot: ``observation_model`` has the observations, ``dof`` is the platform dof, ``gain`` is λ
    (1/s).

    ``planes`` (3,) are those in which observed image features are assumed to lie, None for a known one; None if all are
    known.
    """

    observation_model: ObservationModel
    dof: int
    gain: float
    planes: tuple[Array | None, ...] | None = None

    def at(
        self,
        configuration: ClosedConfiguration,
        desired: tuple[Measures, Measures],
        sensed: Sense | None = None,
        time: float = 0.0,
    ) -> Command:
        """Return the command at a configuration (of the joint velocities of its model)."""
        every = self.observation_model.observations
        y, exact = measure_all(configuration, self.observation_model)
        wanted, moving = desired
        true = tuple(o.error(value, w) for o, value, w in zip(every, y, wanted, strict=True))
        seen = y if sensed is None else tuple(sensed(time, configuration.pose, y))
        error = true if sensed is None else tuple(o.error(s, w) for o, s, w in zip(every, seen, wanted, strict=True))
        kernel, _ = configuration.kernel()
        rates = self._suppose(configuration, exact)
        rows = np.vstack([o.error_slope(s, w) @ r for o, s, w, r in zip(every, seen, wanted, rates, strict=True)])
        rows = rows @ kernel
        left, values, right = np.linalg.svd(rows, full_matrices=False)
        left, values, right = left[:, : self.dof], values[: self.dof], right[: self.dof]
        drift = [
            o.error_slope(w, s) @ m if m.any() else 0 * e
            for o, s, w, m, e in zip(every, seen, wanted, moving, error, strict=True)
        ]
        e = np.concatenate(error)
        asked = self.gain * e - np.concatenate(drift)
        velocity = -kernel @ (right.T @ (damped_inverses(values) * (left.T @ asked)))
        pull = float(np.linalg.norm(rows.T @ e))
        return Command(velocity, true, y, seen, values, kernel @ right[-1], pull)

    def _suppose(self, at: ClosedConfiguration, rates: Sequence[Array]) -> Sequence[Array]:
        """The rates with those that hold for the ``planes``."""
        if self.planes is None:
            return rates
        found = list(rates)
        length = at.model.length
        metric = np.repeat([length, 1.0], 3)[:, None]
        for i, (seen, plane) in enumerate(zip(self.observation_model.observations, self.planes, strict=True)):
            if plane is not None and isinstance(seen, CameraObservation):
                links = (seen.seen_from or self.observation_model.reference, seen.link)
                poses, moves = ([each(link) for link in links] for each in (at.pose, at.velocity))
                found[i] = seen.suppose_plane_rate(plane, *poses, *(metric * V for V in moves))
                found[i] = found[i] / (length ** np.broadcast_to(seen.dimension, seen.size))[:, None]
        return found

    def in_front(self, at: ClosedConfiguration) -> float:
        """The least of :meth:`Observation.in_front`."""
        return min(
            (
                o.in_front(at.pose(o.seen_from or self.observation_model.reference), at.pose(o.link))
                for o in self.observation_model.observations
            ),
            default=np.inf,
        )


def supposed_planes(
    text: str, goal: ClosedConfiguration, observation_model: ObservationModel
) -> tuple[Array | None, ...] | None:
    """The planes of what is seen in images that ``exact``, ``desired`` (those at the goal) or ``constant:0.5`` (that
    depth) means; raises ``BadRequest``."""
    word, _, number = text.partition(":")
    if text == "exact":
        return None
    try:
        depth = None if text == "desired" else parse_plain_number(number)
    except ValueError:
        depth = np.nan
    if depth is not None and not (word == "constant" and 0 < depth <= POSE_VALUE_MAX):
        raise BadRequest("--depth", text, f"{SUPPOSED} (0 to {POSE_VALUE_MAX:g})")
    found: list[Array | None] = []
    for seen in observation_model.observations:
        plane = None
        if isinstance(seen, CameraObservation):
            plane = seen.plane_at(goal.pose(seen.seen_from or observation_model.reference), goal.pose(seen.link))
        found.append(plane if plane is None or depth is None else make_depth_plane(np.array([depth])))
    if not any(plane is not None for plane in found):
        raise BadRequest(
            f"--depth {text}: no observation needs a depth",
            remedy="Omit it, or add an image feature with --sensor: point, image_line or edge.",
        )
    return tuple(found)


def damped_inverses(values: Array) -> Array:
    """The singular values (descending) of a damped pseudo-inverse: exact but where a value is below ``DAMPED``, then
    σ / (σ² + μ²), μ² growing from 0 to ``DAMPED``² as σ vanishes."""
    damping = np.maximum(CONTROLLER_DAMPING_MIN**2 - values**2, 0.0)
    return np.asarray(values / (values**2 + damping))


def measure_all(
    configuration: ClosedConfiguration, observation_model: ObservationModel
) -> tuple[tuple[Array, ...], list[Array]]:
    """Return the value (size,) and the rates (size, nv) of each observation."""
    _, _, values, rates = measure(
        configuration.model, configuration.q, observation_model.reference, observation_model.observations
    )
    return tuple(values), rates


def directions(configuration: ClosedConfiguration, observation_model: ObservationModel) -> tuple[Array, list[Array]]:
    """Return values (k, 3) and rates (3, nv) if all are directions."""
    values, rates = measure_all(configuration, observation_model)
    return np.array(values), rates


@dataclass(frozen=True, eq=False, repr=False)
class FixedDirections(Value):
    """The values of the goal from the first moment on."""

    goal: Measures

    def __call__(self, time: float) -> tuple[Measures, Measures]:
        return self.goal, [np.zeros_like(each) for each in self.goal]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Value):
    """Values through ``marks`` (n, rows) in ``duration`` (s), with zero rates at both ends, then those of the last
    mark; ``sizes`` are the rows of each observation, ``units`` marks unit vectors."""

    marks: Array
    duration: float
    sizes: tuple[int, ...]
    units: tuple[bool, ...]

    @cached_property
    def _curve(self) -> tuple[Any, Any]:
        from scipy.interpolate import CubicSpline

        curve = CubicSpline(np.linspace(0, 1, len(self.marks)), self.marks)
        return curve, curve.derivative()

    def __call__(self, time: float) -> tuple[Measures, Measures]:
        if time >= self.duration:
            return self._each(self.marks[-1]), self._each(np.zeros_like(self.marks[-1]))
        x = time / self.duration
        part = x**3 * (10 - 15 * x + 6 * x**2)
        speed = 30 * x**2 * (1 - x) ** 2 / self.duration
        curve, slope = self._curve
        values, moving = self._each(curve(part)), self._each(speed * slope(part))
        for i, unit in enumerate(self.units):
            if unit:
                size = float(np.linalg.norm(values[i]))
                values[i], moving[i] = values[i] / size, moving[i] / size
                moving[i] = moving[i] - (values[i] @ moving[i]) * values[i]
        return values, moving

    def _each(self, rows: Array) -> list[Array]:
        return np.split(rows, np.cumsum(self.sizes)[:-1])


def straight(
    start: ClosedConfiguration,
    motion: PlatformMotion,
    goal: PoseTask,
    observation_model: ObservationModel,
    duration: float,
) -> tuple[Trajectory, ClosedConfiguration]:
    """The trajectory of the values on the straight way from ``start`` to a goal of the whole pose (where parts of
    the pose depend on each other, along the poses nearest to it), and the configuration at its end; raises
    ``PoseReachFailure`` where the way is blocked."""
    X = start.pose(motion.link)
    every = observation_model.observations
    here, marks = start, [measure_all(start, observation_model)[0]]
    for fraction in np.linspace(0, 1, TRAJECTORY_POSES_COUNT + 1)[1:]:
        here, came = lead_to(here, motion, goal.towards(X, float(fraction)), last=fraction == 1)
        if not came:
            at = motion.pose(here.pose(motion.link))
            raise PoseReachFailure(
                start.model.mechanism.name,
                str(motion.pose(goal_pose(goal))),
                float(fraction),
                str(at),
                origin="the start",
            )
        # an angle goes on where it passes half a turn
        now = measure_all(here, observation_model)[0]
        marks.append(
            tuple(last + o.difference(value, last) for o, value, last in zip(every, now, marks[-1], strict=True))
        )
    units = tuple(isinstance(o, SeenAxis) for o in every)
    return Trajectory(
        np.array([np.concatenate(each) for each in marks]), duration, observation_model.sizes, units
    ), here


def goal_pose(goal: PoseTask) -> Array:
    """The platform pose (4, 4) of a goal of the whole pose."""
    X = np.eye(4)
    X[:3, :3] = goal.zero if goal.rotation is None else goal.rotation
    X[:3, 3] = goal.values - X[:3, :3] @ goal.point
    return X
