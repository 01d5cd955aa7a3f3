"""Pose accuracy: error maxima at poses, or over a plane, line or box of poses (MMT A.1)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

from ...errors import BadRequest
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.pose import AskedPose, Grid, PoseLike, convert_to_pose, parse_poses
from ...options import option
from ...progress import report
from ...records import DEG, FLAT, As, Shown, recorded
from ...results import Result
from ...tolerances import FIRST_ORDER_POSE_ERROR_MAX
from ..analysis_declaration import analysis
from ..observation_inputs import POSES, CameraLike, LegsLike, NoiseLike, Seed, SensorLike
from ..observed import ObservedRobot, RobotLike
from ..pose_requests import solve_configurations
from ..setup_records import LIMITS_IGNORED
from ..verdict import compute_verdict
from .error_map import ErrorMap, Mapper
from .measurement_bounds import IN_SIGHT, Cones, MeasurementBounds, find_invisible
from .nonlinear_check import NonlinearCheck, sample_true_errors
from .pose_errors import PoseErrors, compute_error_maxima
from .swept import SweptErrors, require_file, sweep_to

ERROR_FIELD_CELLS_MAX = 10_000_000
"""Largest number of grid cells with errors in memory: 160 MB."""
ERROR_SWEEP_CELLS_MAX = 10_000_000_000
"""Largest number of grid cells with errors in a file: 160 GB and some hours."""

LARGEST_ERROR_POSES_COUNT = 3
"""Poses of a grid, those of the largest errors, at which the linear law is checked by samples."""


class Cone(NamedTuple):
    """An observed direction and the half-angle of the cone about it."""

    leg: str
    link: str
    cone_deg: Annotated[float, As(scale=DEG)]


class SampledErrors(NamedTuple):
    """Errors at a pose."""

    errors: Annotated[PoseErrors, FLAT]
    sampled: NonlinearCheck | None


@dataclass(frozen=True, eq=False, repr=False)
class Accuracy(Result, shown_as="accuracy"):
    """Error maxima at poses or over a grid, for given measurement bounds.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    bounds
        Measurement bounds of the observations.
    poses
        Errors at single poses (m, rad).
    sampled
        Nonlinear check of each pose, None if it was not requested.
    field
        Errors over a grid, None without one.
    swept
        File to which a grid was written, None without one.
    """

    setup: Annotated[ObservedRobot, FLAT]
    bounds: MeasurementBounds
    poses: tuple[PoseErrors, ...]
    sampled: tuple[NonlinearCheck | None, ...]
    field: Annotated[ErrorMap | None, FLAT]
    swept: Annotated[SweptErrors | None, FLAT] = None
    """Content of the file to which a grid was written."""

    @property
    def cones(self) -> Array:
        """Half-angles (k,) of the observed directions (rad), 0 for observations that are not directions."""
        return self.bounds.cones

    def headline(self) -> str:
        """The robot, and the largest errors at each pose or of the grid."""
        limit = FIRST_ORDER_POSE_ERROR_MAX * self.setup.all_samples.model.length
        worst = [
            (
                f"{1e3 * each.position.largest:.3g} mm"
                if each.position.largest <= limit
                else "not bounded to first order"
            )
            + f" at {each.pose}"
            for each in self.poses
        ]
        reached = ([] if self.field is None else [self.field.reached.sum()]) + (
            [] if self.swept is None else [self.swept.tally.reached]
        )
        grid = [f"{count} poses of a grid" for count in reached]
        return f"{self.setup.headline()}: {'; '.join(worst + grid)}"

    @property
    @recorded(As("cones"))
    def cones_record(self) -> list[Cone]:
        """The cones about directions that have one."""
        pairs = zip(self.setup.observed, self.cones, strict=True)
        return [Cone(o.leg, o.link, cone) for o, cone in pairs if cone]

    @property
    @recorded(As("poses"))
    def poses_record(self) -> list[SampledErrors]:
        """The errors at single poses."""
        return [SampledErrors(*each) for each in zip(self.poses, self.sampled, strict=True)]

    noise = Shown(
        dict[str, float],
        lambda self: self.bounds.amounts,
        "by unit (px, m, rad), of observations that are not directions",
    )
    exact = Shown(list[str], lambda self: self.bounds.exact(self.setup.observed), "observations without errors")
    limits_ignored = LIMITS_IGNORED


@analysis(
    130,
    examples=(
        "delta --cone 0.1deg --at x=0.1",
        "delta --cone 0.1deg --plane z=-0.6 -o map.png",
    ),
)
def accuracy(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    cone: Annotated[
        Cones | None,
        option(
            "Half-angle of the cone about each observed direction, such as 0.1deg; or one per leg: 1=0.1deg,2=0.2deg.",
            "ANGLE",
        ),
    ] = None,
    noise: NoiseLike = None,
    at: Annotated[
        PoseLike | Iterable[PoseLike],
        option(f"A pose, such as x=0.02,y=0.1,z=-0.7; {POSES}", "POSE", kind=list[str]),
    ] = (),
    plane: Annotated[
        PoseLike | None, option("Plane of poses, such as z=-0.7; only reachable poses count.", "PART=VALUE")
    ] = None,
    grid: Annotated[
        Grid | str | None,
        option(
            "A line, plane or box of poses, such as x=-0.3:0.3:21,y=0 (from:to:count) or motors:NAME=-0.5:0.5:21.",
            "GRID",
        ),
    ] = None,
    steps: Annotated[int | None, option("Poses along each side of the plane.", low=5, high=300)] = None,
    nonlinear: Annotated[
        int,
        option(
            "Try this many errors (at least the worst to first order) at each pose; on a "
            "plane or grid, at its worst poses.",
            "COUNT",
            low=0,
        ),
    ] = 0,
    into: str | Path | None = None,
    seed: Seed = 0,
) -> Accuracy:
    """Largest pose error of the platform for given errors of the observations.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    cone
        Half-angle of the cones about the directions (rad, or text with ``deg``), for all or one per leg.
    noise
        Largest errors of other observations (also of directions without a cone), such as ``0.3px,1mm,0.1deg``.
    at, plane, grid, steps
        Poses (m, rad, base coordinates): single ones; a plane, as far as it is reached, with ``steps`` poses a side; or
        a grid. Default: the zero configuration. Free parts of a grid keep their values at the zero configuration if
        every leg is a known subproblem.
    nonlinear
        Number of errors that are tried without linearisation at each single pose, or at the worst poses of a grid.
    into
        File .npy to which the errors (m, rad) of a plane or grid of any size are written part by part; the same call
        continues an interrupted sweep.
    seed
        Seed of the random configurations.

    Returns
    -------
    Accuracy
        Position (m) and orientation error (rad) at poses or over the grid. Poses of a grid at which something observed
        is not in front of its camera are left out.

    Raises
    ------
    BadRequest
        For unknown names, invalid cones, unobserved platform dof (the error is infinite at every pose), or something
        observed behind its camera.
    PoseReachFailure, NoReachablePose
        If a pose, or all of a grid, is not reached.

    Notes
    -----
    First order (docs/pages/proofs.md, section 10; MMT A.1): max over unit w of Σ ψ_i ‖(J_i P_i)ᵀ w‖, J = M^{T+}. The
    platform converges where ``servo`` does.

    Examples
    --------
    >>> hrsynth.accuracy("3rrr_m1", cone="0.1deg", at="x=0,y=0,phi=0")
    <Accuracy: 3rrr_m1, observing 1, 2, 3: 0.414 mm at x=0,y=0,z=0,phi=0deg>
    """
    wanted: list[AskedPose] = parse_poses(at)
    if plane is not None and grid is not None:
        raise BadRequest(f"--plane {plane}: cannot be combined with --grid {grid}", remedy="Omit one.")
    if steps is not None and plane is None:
        raise BadRequest(f"--steps {steps}: applies to a plane only", remedy="Give --plane, or omit --steps.")
    if nonlinear < 0:
        raise BadRequest("--samples", nonlinear, "0 or more")
    if into is not None:
        require_file(into)
        if plane is None and grid is None:
            raise BadRequest(
                f"{into}: only errors over a plane or grid can be written", remedy="Add --plane or --grid."
            )
        if nonlinear and not wanted:
            raise BadRequest(
                f"--samples {nonlinear}: cannot be combined with an array file", remedy="Use single poses (--at)."
            )
    held = None if plane is None else convert_to_pose(plane)
    cells = None if grid is None else Grid.parse(grid, ERROR_FIELD_CELLS_MAX if into is None else ERROR_SWEEP_CELLS_MAX)
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed).printing_like(wanted)
    blur = MeasurementBounds.of(cone, noise, setup.observed)
    require_full_observation(setup)
    mapper = Mapper(setup, blur)
    field = swept = None
    if held is not None:
        cells = mapper.plane(held, steps)
    if cells is not None and into is not None:
        swept = sweep_to(into, mapper, cells, seed)
    elif cells is not None:
        field = mapper.over(cells, seed)
    if field is not None and nonlinear and not wanted:
        wanted = [*field.worst(LARGEST_ERROR_POSES_COUNT)]
    start, motion = setup.all_samples.start, setup.motion
    configurations = solve_configurations(setup, wanted)
    if not configurations and field is None and swept is None:
        configurations = [start]
    report("errors")
    poses = tuple(compute_errors_at(setup, blur, each) for each in configurations)
    true = tuple(
        sample_true_errors(each, mapper.observation_model, motion, blur, errors, nonlinear, seed) if nonlinear else None
        for each, errors in zip(configurations, poses, strict=True)
    )
    return Accuracy(setup, blur, poses, true, field, swept)


def compute_errors_at(setup: ObservedRobot, blur: MeasurementBounds, at: ClosedConfiguration) -> PoseErrors:
    """Return the error maxima at a closed configuration; raises ``BadRequest`` if something observed is behind its
    camera."""
    motion, observation_model = setup.motion, setup.samples.observation_model
    pose, lost = motion.pose(at.pose(motion.link)), find_invisible(at, observation_model)
    if lost is not None:
        raise BadRequest(f"{setup.robot.name}: {lost.text} is not in front of its camera at {pose}", remedy=IN_SIGHT)
    return compute_error_maxima(at, observation_model, blur, pose)


def require_full_observation(setup: ObservedRobot, otherwise: str = "the error is infinite at every pose, ") -> None:
    """Raise ``BadRequest`` unless all platform dof are observed; ``otherwise`` begins its message."""
    verdict = compute_verdict(setup, setup.labels, setup.samples)
    if verdict.unobserved:
        what, cure = (
            ("the legs do", "legs")
            if all(each.is_segment_direction for each in setup.observed)
            else ("what is observed does", "observations")
        )
        raise BadRequest(
            f"{setup.robot.name}: {otherwise}{what} not determine {verdict.named}",
            ", ".join(setup.labels),
            remedy=f"Choose {cure} that make it controllable (hrsynth legs, hrsynth advise).",
        )
