"""The configurations of the poses that a question names: by parts of the pose, or by the number of a mode."""

from __future__ import annotations

from collections.abc import Sequence

from ..batch.reach import reach
from ..errors import BadRequest, PoseNotReached
from ..kinematics.assembly import of_links
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.pose import ModeNumber, Pose
from .modes.modes import AssemblyModes, modes
from .observed import ObservedRobot


def configurations_at(setting: ObservedRobot, poses: Sequence[Pose | ModeNumber]) -> list[ClosedConfiguration]:
    """The robot at each of the poses. ``mode:3`` is the third mode, with the directions that are watched, of the first
    pose among these that is given by its parts (of the zero configuration where none is), as ``modes`` lists them.

    Raises ``BadRequest`` for parts of a pose that the platform cannot change and for modes that there are not,
    ``PoseNotReached`` for poses out of reach and for modes at which the robot was not found assembled.
    """
    everything, motion = setting.everything, setting.motion
    reached = {each: reach(everything.start, everything.question, each, motion)
               for each in poses if isinstance(each, Pose)}
    about = next(iter(reached.values()), everything.start)
    listed = modes(setting, at=about) if any(isinstance(each, ModeNumber) for each in poses) else None
    return [reached[each] if isinstance(each, Pose) else _assembled(listed, each, about) for each in poses]


def _assembled(listed: AssemblyModes | None, asked: ModeNumber, about: ClosedConfiguration) -> ClosedConfiguration:
    """The robot assembled at a mode of those at a configuration, its coordinates counted from the zero configuration.
    """
    assert listed is not None
    name, count = listed.setting.robot.name, len(listed.modes)
    if not 1 <= asked.number <= count:
        raise BadRequest(f"{name}: a mode at {listed.pose}", str(asked),
                         "poses that are no continuum" if listed.found.continuum is not None else
                         f"mode:1 to mode:{count}" if count else "no mode")
    mode = listed.modes[asked.number - 1]
    at = about if mode.goal else mode.configuration
    if at is None:
        raise PoseNotReached(name, f"{asked} ({mode.pose})", 0.0, str(listed.pose), reason="the robot was not found "
                             f"assembled there without leg {', '.join(mode.open)}")
    return of_links(about.twin, at)
