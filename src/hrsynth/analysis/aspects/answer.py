"""What is answered about two poses: a verdict, its reason, and the path as poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.steps import track
from ...mechanism.pose import Pose
from ...results import Result
from ..observed import ObservedRobot
from .carriage import Carriage
from .crossing import Crossing
from .proof import Way

SAME, SEPARATED, UNDECIDED = "same aspect", "separated", "undecided"


@dataclass(frozen=True, eq=False)
class End:
    """A pose that was asked for: the whole pose reached, its configuration, and the condition's value there."""

    pose: Pose
    configuration: ClosedConfiguration
    value: float

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"pose": self.pose.to_dict(), "value": self.value}


@dataclass(frozen=True, eq=False, repr=False)
class PathAnswer(Result, shown_as="path"):
    """``same aspect`` (with a certified path), ``separated`` or ``undecided``, and why.

    Between its poses the path moves the told ``point`` on straight lines and turns the platform about one axis;
    where a leg passes from one working mode to the other (``crossings``), its rod and its crank or carriage lead to
    the leg's limit and back. ``margin`` bounds the condition's |value| along a certified path, at the ends where
    they are separated; ``boxes`` are the intervals of all proofs tried.
    """

    setting: ObservedRobot
    verdict: str
    certified: bool
    poses: tuple[Pose, ...]
    margin: float | None
    boxes: int
    start: End
    goal: End
    reason: str
    signed: bool
    carriage: Carriage | None = None
    ways: tuple[Way, ...] = ()
    limits: tuple[str, ...] = ()
    """Joints whose limits hold all along a certified path."""
    unlimited: tuple[str, ...] = ()
    """Joints whose limits are not considered."""

    def headline(self) -> str:
        """The robot and the verdict."""
        return f"{self.setting.headline()}: {self.verdict}"

    @property
    def not_proved(self) -> str:
        """What a certificate says nothing about."""
        joints = f"limits of joints {', '.join(self.unlimited)}; " if self.unlimited else ""
        return f"{joints}collisions and constraint singularities of the loops are not considered"

    @property
    def crossings(self) -> tuple[tuple[str, int], ...]:
        """The legs that change their working mode, each with the place of its limit in ``poses``."""
        found, place = [], 0
        for way in self.ways:
            if isinstance(way, Crossing):
                found.append((way.leg, place + 1))
            place += len(_marks(way))
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        point = None if self.carriage is None else self.carriage.motion.point.tolist()
        return {"observed": [{"leg": o.leg, "link": o.link} for o in self.setting.observed],
                "verdict": self.verdict, "certified": self.certified, "path": [pose.to_dict() for pose in self.poses],
                "crossings": [{"leg": leg, "at": place} for leg, place in self.crossings], "point": point,
                "margin": self.margin, "boxes": self.boxes,
                "value": "expression" if self.signed else "smallest singular value",
                "start": self.start.to_dict(), "goal": self.goal.to_dict(), "reason": self.reason,
                "limits": list(self.limits), "not_considered": self.not_proved}


def between(answer: PathAnswer, carriage: Carriage, ways: Sequence[Way]) -> list[Pose]:
    """The platform's poses between the ways, and that at a leg's limit in the middle of a crossing."""
    motion = carriage.motion
    here = answer.start.configuration
    found = []
    for p, R in [place for way in ways for place in _marks(way)][:-1]:
        if carriage.turning:
            found.append(motion.pose(carriage.frame(p, R)))
            continue
        here = _led(here, carriage, p)
        found.append(Pose.of(here.pose(motion.link), None if answer.setting.anatomy.point is None else motion.point))
    return found


def _marks(way: Way) -> list[tuple[Array, Array]]:
    if not isinstance(way, Crossing):
        return [way.end]
    p, R, _ = way.at(np.array([0.5]))
    return [(p[0], R[0]), way.end]


def _led(here: ClosedConfiguration, carriage: Carriage, p: Array) -> ClosedConfiguration:
    """The configuration with the carriage's point at ``p``."""
    motion = carriage.motion
    directions = motion.translations.T
    goal = replace(motion.at_home(), directions=directions, values=carriage.length * directions @ p)
    return track(here, motion, goal)[0]
