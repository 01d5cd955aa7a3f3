"""Configurations of requested poses: by parts of the pose, by joint coordinates, or by the number of an assembly
mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..batch.pose_continuation import track_to_pose
from ..errors import BadRequest, HrsynthError, PoseReachFailure
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked_twists import set_zero
from ..mechanism.model import Mechanism
from ..mechanism.pose import AskedPose, JointPose, ModeNumber, Pose, PoseLike, parse_pose
from ..options import require_range
from ..results import with_spelling
from ..tolerances import PRINTED_POSE_TOL
from .branch.joint_line import follow_line
from .observation_inputs import CameraLike, LegsLike, SensorLike
from .observed import GENERIC_SAMPLES_COUNT, ObservedRobot, RobotLike, read_robot

if TYPE_CHECKING:
    from .modes.modes import AssemblyModes


@with_spelling
def observe(
    robot: RobotLike,
    legs: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    at: PoseLike | None = None,
    samples: int = GENERIC_SAMPLES_COUNT,
    seed: int = 0,
) -> ObservedRobot:
    """Robot with observations, its normal form and samples of its motion: the starting point of every analysis.

    Parameters
    ----------
    robot
        Mechanism, path of a file, name of a shipped robot, or ``example:NAME``.
    legs
        Leg labels or link names (a list, or text with commas); ``["all"]``: all legs; None: what the file observes,
        else all legs at their default segments.
    camera
        Link that carries the camera; ``NAME=LINK@x,y,z/r,p,y`` is a named one in the link frame (x right, y down, z
        ahead; m, rad or ``deg``).
    sensor
        Other observations, ``[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius`` (:mod:`hrsynth.mechanism.observations`), which
        replace all legs if ``legs`` is None.
    at
        Pose that replaces the zero configuration: on the same branch if possible, else in another operation mode that
        was found; coordinates of motors or joints (``motors:0.1,0.2``); or ``mode:2``, an assembly mode at which
        ``modes`` found the robot assembled.
    samples
        Number of samples.
    seed
        Seed of the random configurations.

    Returns
    -------
    ObservedRobot
        Robot that every analysis accepts.

    Raises
    ------
    BadRequest
        For unknown labels, links, parts of a pose and modes.
    PoseReachFailure
        If the pose is not reached.

    Examples
    --------
    >>> robot = hrsynth.observe("3rrr_m1", [1, 2])
    >>> robot
    <ObservedRobot: 3rrr_m1, observing 1, 2>
    >>> hrsynth.derive(robot).verdict == "controllable"
    False
    """
    robot = read_robot(robot)
    require_range("seed", seed, "an integer", 0)
    if at is None:
        return ObservedRobot.of(robot, legs, camera, sensor=sensor, samples=samples, seed=seed)
    if isinstance(robot, ObservedRobot):
        raise BadRequest(
            f"{robot.headline()}: the observations are given twice",
            str(at),
            remedy="Omit them: an observed robot already has its own.",
        )
    require_platform(robot, at)
    asked = parse_pose(at)
    if isinstance(asked, Pose):
        start = _start_at(ObservedRobot.of(robot, seed=seed), asked)
    else:
        (start,) = solve_configurations(ObservedRobot.of(robot, legs, camera, sensor=sensor, seed=seed), [asked])
    return ObservedRobot.of(
        replace(set_zero(start), file=robot.file), legs, camera, sensor=sensor, samples=samples, seed=seed
    )


def require_platform(robot: Mechanism, where: object) -> None:
    """Raise ``BadRequest`` for a pose or grid ``where`` of a formation: it would be that of its first link, the others
    staying."""
    if robot.formation:
        raise BadRequest(
            f"--at {where}: {robot.name} is a formation ({', '.join(robot.bodies)}), without one platform",
            remedy="Omit it, or choose a platform with --platform LINK.",
        )


def _start_at(setup: ObservedRobot, wanted: Pose) -> ClosedConfiguration:
    """The configuration at a pose, on the branch of the zero configuration or in another operation mode."""
    drawn = setup.all_samples
    refused: HrsynthError | None = None
    for start in (drawn.start, *(mode.at for mode in drawn.other_modes)):
        try:
            return track_to_pose(start, drawn.observation_model, wanted)
        except (BadRequest, PoseReachFailure) as error:
            refused = refused or error
    assert refused is not None
    raise refused


def solve_configurations(
    setup: ObservedRobot, poses: Sequence[AskedPose], by_modes: bool = False
) -> list[ClosedConfiguration]:
    """Return the robot at each of the poses, or the error why it does not get there. ``mode:3`` is the third assembly
    mode of the first pose among these that is given by its parts (without one, of the zero configuration), as ``modes``
    lists them; with ``by_modes`` of the first that is reached, and a pose that small steps do not reach is then
    searched among its modes. Raises ``BadRequest`` for parts of a pose that the platform cannot change and for modes
    that do not exist."""
    found = solve_requested_poses(setup, poses, by_modes)
    for each in found:
        if isinstance(each, PoseReachFailure):
            raise each
    return [each for each in found if isinstance(each, ClosedConfiguration)]


def solve_requested_poses(
    setup: ObservedRobot, poses: Sequence[AskedPose], by_modes: bool = False
) -> list[ClosedConfiguration | PoseReachFailure]:
    """Return the robot at each of the poses, or the error why it does not get there. ``mode:3`` is the third assembly
    mode of the first pose among these that is given by its parts (without one, of the zero configuration), as ``modes``
    lists them; with ``by_modes`` of the first that is reached, and a pose that small steps do not reach is then
    searched among its modes. Raises ``BadRequest`` for parts of a pose that the platform cannot change and for modes
    that do not exist."""
    if not poses:
        return []
    require_platform(setup.robot, poses[0])
    all_samples, motion = setup.all_samples, setup.motion
    found: dict[AskedPose, ClosedConfiguration | PoseReachFailure] = {}
    for each in poses:
        if not isinstance(each, ModeNumber):
            try:
                if isinstance(each, JointPose):
                    found[each] = follow_line(all_samples.start, motion, each)
                else:
                    found[each] = track_to_pose(all_samples.start, all_samples.observation_model, each, motion)
            except PoseReachFailure as error:
                found[each] = error
    reached = [at for at in found.values() if isinstance(at, ClosedConfiguration)]
    about = next(iter(reached if by_modes else found.values()), all_samples.start)
    unreached = {each: at for each, at in found.items() if isinstance(at, PoseReachFailure) and isinstance(each, Pose)}
    if isinstance(about, PoseReachFailure):
        reason = f"it is an assembly mode of {about.pose}, which is not reached"
        return [
            found.get(each) or PoseReachFailure(about.robot, str(each), 0.0, about.last, reason=reason)
            for each in poses
        ]
    if len(found) < len(set(poses)) or (by_modes and unreached):
        from .modes.modes import assemble_at_mode, modes

        listed = modes(setup, at=about)
        for each in poses:
            try:
                if isinstance(each, ModeNumber):
                    found[each] = assemble_at_mode(listed, each)
                elif by_modes and isinstance(each, Pose) and each in unreached:
                    found[each] = _choose_assembled_mode(listed, each, unreached[each])
            except PoseReachFailure as error:
                found[each] = error
    return [found[each] for each in poses]


def _choose_assembled_mode(listed: AssemblyModes, pose: Pose, refused: PoseReachFailure) -> ClosedConfiguration:
    """The robot at the one mode with this pose at which it was found assembled; raises ``refused`` if there is none."""
    from .modes.modes import assemble_at_mode

    motion, model = listed.setup.motion, listed.goal.model
    wanted = motion.goal(pose, listed.setup.robot.name)
    met = [
        number
        for number, mode in enumerate(listed.modes, 1)
        if mode.configuration is not None
        and mode.reachable
        and wanted.is_met(mode.configuration.pose(motion.link), PRINTED_POSE_TOL * max(1.0, model.length))
    ]
    if len(met) != 1:
        raise refused
    return assemble_at_mode(listed, ModeNumber(met[0]))
