"""What is told of a servo run: where it started, went and ended, and what was measured on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.observed import ObservedRobot
from ..geometry.so3 import angle_of
from ..geometry.vectors import Array
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.noise import Noise
from ..mechanism.pose import Pose
from ..results import Result
from .ending import Ending
from .law import Measures
from .run import Run
from .track import Track

ASIDE = 0.9
"""Part of the root mean square distance that a constant one makes up where noise holds a platform aside."""


@dataclass(frozen=True)
class Scatter:
    """How far the platform was from the pose at which it settled, over the second half of a noisy run: metres and
    radians, largest and root mean square."""

    metres: float
    radians: float
    rms_metres: float
    rms_radians: float
    mean: tuple[float, float, float]
    """Where the platform was on average."""
    offset: float
    """How far that is from the pose at which it settled (m): where noise does not average out."""

    @property
    def aside(self) -> bool:
        """Whether noise shifts the platform rather than shaking it."""
        return self.offset > ASIDE * self.rms_metres

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {
            "position_mm": 1e3 * self.metres,
            "orientation_deg": math.degrees(self.radians),
            "rms_position_mm": 1e3 * self.rms_metres,
            "rms_orientation_deg": math.degrees(self.rms_radians),
            "offset_mm": 1e3 * self.offset,
            "mean": list(self.mean),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Servo(Result, shown_as="servo"):
    """A servo run: what was asked, the run, its ending, what it passed.

    With noise the ending is that of the same loop without noise, continued from where the noisy run stopped; ``spread``
    is how far the noisy run stayed from there.
    """

    setting: ObservedRobot
    start: Pose
    goal: Pose
    desired: Measures
    gain: float
    sense: str
    noise: Noise | None
    run: Run
    track: Track
    ending: Ending
    depth: str
    settled: ClosedConfiguration
    target: ClosedConfiguration
    """The goal's configuration."""
    spread: Scatter | None = None
    notes: tuple[str, ...] = ()
    """What a bench measured, in words."""

    def headline(self) -> str:
        """The robot and where the run ended."""
        return f"{self.setting.headline()}: ended at {self.pose}, {self.ended}"

    @property
    def ended(self) -> str:
        """Where it ended: one of ``ending.ENDINGS``."""
        return self.ending.name

    @property
    def pose(self) -> Pose:
        """The pose at which it ended."""
        return self.pose_of(self.settled)

    def pose_of(self, at: ClosedConfiguration) -> Pose:
        """The platform's pose at a configuration."""
        motion = self.setting.motion
        return motion.pose(at.pose(motion.link))

    @property
    def errors(self) -> Array:
        """‖e_i‖ of the true errors, (n, k)."""
        return np.array([[np.linalg.norm(e) for e in command.error] for command in self.run.commands])

    @property
    def way(self) -> Array:
        """The platform's position, that of its point, along the run, (n, 3)."""
        motion = self.setting.motion
        return np.array([motion.position(at.pose(motion.link)) for at in self.run.configurations])

    @property
    def turns(self) -> Array:
        """How far the platform is turned away from the goal along the run (rad), (n,); of a point body zero."""
        return np.array([self._turn(at) for at in self.run.configurations])

    @property
    def goal_position(self) -> Array:
        """The position of the platform's point at the goal, (3,)."""
        motion = self.setting.motion
        return motion.position(self.target.pose(motion.link))

    @property
    def from_goal(self) -> tuple[float, float]:
        """How far the pose at which it ended is from the goal: metres, radians."""
        motion = self.setting.motion
        moved = motion.position(self.settled.pose(motion.link)) - self.goal_position
        return float(np.linalg.norm(moved)), self._turn(self.settled)

    def _turn(self, at: ClosedConfiguration) -> float:
        motion = self.setting.motion
        R = at.pose(motion.link)[:3, :3] @ self.target.pose(motion.link)[:3, :3].T
        return angle_of(R) if motion.body else 0.0

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        found = self.ending
        return {
            **self.setting.to_dict(),
            "from": self.start.to_dict(),
            "to": self.goal.to_dict(),
            "gain": self.gain,
            "depth": self.depth,
            "sense": self.sense,
            "noise": None if self.noise is None else str(self.noise),
            "ended": self.ended,
            "reason": found.reason,
            "pose": self.pose.to_dict(),
            "matched_mode": found.matched,
            "modes": None if found.modes is None else [each.to_dict() for each in found.modes.modes],
            "type2": self.track.to_dict(self.run.times.tolist()),
            "notes": list(self.notes),
            "spread": None if self.spread is None else self.spread.to_dict(),
            "unlimited": list(self.setting.unlimited),
            "times": self.run.times.tolist(),
            "error": self.errors.tolist(),
            "poses": [self.pose_of(at).to_dict() for at in self.run.configurations],
        }
