"""Result of a servo run: start, path, end, and the measurements along the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from ..analysis.modes.assembly_mode import AssemblyMode
from ..analysis.observed import ObservedRobot
from ..analysis.setup_records import LIMITS_IGNORED
from ..geometry.so3 import compute_rotation_angle
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.joint_coordinates import FileCoordinates
from ..mechanism.noise import Noise
from ..mechanism.pose import Pose
from ..records import DEG, FLAT, MM, As, Record, Recorded, Shown, recorded
from ..results import Result
from .crossings import SingularityTrack, TrackRecord
from .law import Measures
from .outcome import RunOutcome
from .run import Run

BIAS_MIN_FRACTION = 0.9
"""Fraction of the root mean square distance that is constant if noise shifts a platform."""


@dataclass(frozen=True)
class Scatter(Record, all_recorded=True):
    """Distance of the platform from the pose at which it settled, over the second half of a noisy run: metres and
    radians, largest and root mean square."""

    metres: Annotated[float, As("position_mm", scale=MM)]
    radians: Annotated[float, As("orientation_deg", scale=DEG)]
    rms_metres: Annotated[float, As("rms_position_mm", scale=MM)]
    rms_radians: Annotated[float, As("rms_orientation_deg", scale=DEG)]
    mean: tuple[float, float, float]
    """Mean position of the platform (m)."""
    offset: Annotated[float, As("offset_mm", scale=MM)]
    """Distance of that from the pose at which it settled (m): noise that does not average out."""

    @property
    def has_bias(self) -> bool:
        """Return True if noise shifts the platform instead of shaking it."""
        return self.offset > BIAS_MIN_FRACTION * self.rms_metres


@dataclass(frozen=True, eq=False, repr=False)
class Servo(Result, shown_as="servo"):
    """Servo run: request, run, outcome, crossings.

    Attributes
    ----------
    start, goal, pose
        Start, goal and final pose of the platform (m, rad, in the base frame).
    desired
        Measured values at the goal.
    run
        Times (s), configurations and commands.
    outcome
        Outcome; with noise that of the same loop without noise, continued from the end of the noisy run.
    errors
        Norms of the errors of the k observations along the run, (n, k).
    way, turns
        Position (m, (n, 3)) and rotation from the goal (rad, (n,)) of the platform along the run.
    track
        Singularities along the run.
    spread
        Distance of a noisy run from the final pose; None without noise.
    """

    setup: Annotated[ObservedRobot, FLAT]
    start: Recorded[Pose]
    goal: Recorded[Pose]
    desired: Measures
    gain: Recorded[float]
    sense: Annotated[str, Literal["exact", "edges", "images"]]
    noise: Noise | None
    run: Run
    track: SingularityTrack
    run_outcome: Annotated[RunOutcome, FLAT]
    depth: Recorded[str]
    settled: ClosedConfiguration
    target: ClosedConfiguration
    """Configuration of the goal."""
    spread: Recorded[Scatter | None] = None
    notes: Recorded[tuple[str, ...]] = ()
    """Notes on what the dynamic simulation and noise changed."""

    def headline(self) -> str:
        """Return the robot, the outcome and the final pose."""
        return f"{self.setup.headline()}: {self.outcome} at {self.pose}"

    @property
    def outcome(self) -> str:
        """Return the outcome: one of ``outcome.ENDINGS``."""
        return self.run_outcome.name

    @property
    @recorded()
    def pose(self) -> Pose:
        """Final pose."""
        return self.pose_of(self.settled)

    coordinates = Shown(FileCoordinates, lambda self: FileCoordinates.of(self.settled), "joint coordinates at the end")

    def pose_of(self, at: ClosedConfiguration) -> Pose:
        """Return the platform's pose at a configuration."""
        motion = self.setup.motion
        return motion.pose(at.pose(motion.link))

    @property
    def errors(self) -> Array:
        """Norms ‖e_i‖ of the true errors, (n, k)."""
        return np.array([[np.linalg.norm(e) for e in command.error] for command in self.run.commands])

    @property
    def way(self) -> Array:
        """Position of the platform's point along the run (m), (n, 3)."""
        motion = self.setup.motion
        return np.array([motion.position(at.pose(motion.link)) for at in self.run.configurations])

    @property
    def turns(self) -> Array:
        """Rotation of the platform from the goal along the run (rad), (n,); zero for a point."""
        return np.array([self._turn(at) for at in self.run.configurations])

    @property
    def goal_position(self) -> Array:
        """Position of the platform's point at the goal (m), (3,)."""
        motion = self.setup.motion
        return motion.position(self.target.pose(motion.link))

    @property
    def from_goal(self) -> tuple[float, float]:
        """Return the distance of the final pose from the goal: metres, radians."""
        motion = self.setup.motion
        moved = motion.position(self.settled.pose(motion.link)) - self.goal_position
        return float(np.linalg.norm(moved)), self._turn(self.settled)

    def _turn(self, at: ClosedConfiguration) -> float:
        motion = self.setup.motion
        R = at.pose(motion.link)[:3, :3] @ self.target.pose(motion.link)[:3, :3].T
        return compute_rotation_angle(R) if motion.body else 0.0

    noise_record = Shown(str | None, lambda self: self.noise and str(self.noise), As("noise"))
    modes = Shown(list[AssemblyMode] | None, lambda self: self.run_outcome.modes and self.run_outcome.modes.modes)
    type2 = Shown(TrackRecord, lambda self: self.track.timed(self.run.times))
    limits_ignored = LIMITS_IGNORED
    times = Shown(list[float], lambda self: self.run.times, "times (s)")
    error = Shown(list[list[float]], lambda self: self.errors, "error of each observation at each time")
    poses = Shown(list[Pose], lambda self: [self.pose_of(at) for at in self.run.configurations])
