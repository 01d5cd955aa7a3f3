"""The configurations of the poses that a question names: by parts of the pose, or by the number of a mode."""

from __future__ import annotations

from collections.abc import Sequence

from ..batch.reach import reach
from ..errors import BadRequest, PoseNotReached
from ..kinematics.assembly import of_links
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.pose import ModeNumber, Pose
from .modes.modes import modes
from .observed import ObservedRobot


def configurations_at(setting: ObservedRobot, poses: Sequence[Pose | ModeNumber]) -> list[ClosedConfiguration]:
    """The robot at each of the poses. ``mode:3`` is the third mode, with the directions that are watched, of the first
    pose among these that is given by its parts (of the zero configuration where none is), as ``modes`` lists them.

    Raises ``BadRequest`` for parts of a pose that the platform cannot change and for modes that there are not,
    ``PoseNotReached`` for poses out of reach and for modes at which the robot was not found assembled.
    """
    everything, motion = setting.everything, setting.motion
    found = [None if isinstance(each, ModeNumber) else reach(everything.start, everything.question, each, motion)
             for each in poses]
    about = next((each for each in found if each is not None), everything.start)
    return [_mode(setting, each, about) if at is None and isinstance(each, ModeNumber) else at or about
            for each, at in zip(poses, found, strict=True)]


def _mode(setting: ObservedRobot, asked: ModeNumber, about: ClosedConfiguration) -> ClosedConfiguration:
    """The robot assembled at a mode, its coordinates counted from the zero configuration."""
    listed = modes(setting, at=about)
    name = setting.robot.name
    if not 1 <= asked.number <= len(listed.modes):
        count = len(listed.modes)
        raise BadRequest(f"{name}: a mode at {listed.pose}", str(asked),
                         "poses that are no continuum" if listed.found.continuum is not None else
                         f"mode:1 to mode:{count}" if count else "no mode")
    mode = listed.modes[asked.number - 1]
    at = about if mode.goal else mode.configuration
    if at is None:
        raise PoseNotReached(name, f"{asked} ({mode.pose})", 0.0, str(listed.pose), origin="the pose whose mode it is",
                             reason=f"the robot was not found assembled there without leg {', '.join(mode.open)}")
    return of_links(about.twin, at)
