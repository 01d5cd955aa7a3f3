"""A set of legs that may be watched, with all that was found out about it and why it is discarded, if it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.accuracy.pose_errors import PoseErrors
from ..analysis.modes.modes import AssemblyModes
from ..analysis.posture import Posture

TYPES = {"type1": "a Type 1 singularity", "type2": "a Type 2 singularity", "type3": "a Type 3 singularity",
         "constraint": "a constraint singularity", "undecided": "too near to a singularity to be told apart from one"}


@dataclass(frozen=True)
class Modes:
    """How many assembly modes there are with the directions of a pose, in how many of them the robot was found
    assembled, and whether these are proved to be all; ``why`` they are not listed, else empty."""

    count: int | None
    reachable: int | None
    complete: bool
    why: str = ""

    @classmethod
    def of(cls, found: AssemblyModes) -> Modes:
        """Of a list of modes."""
        return cls(len(found.modes), sum(mode.reachable is True for mode in found.modes), found.found.complete)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"count": self.count, "reachable": self.reachable, "complete": self.complete, "reason": self.why or None}


@dataclass(frozen=True)
class Decision:
    """A verdict in a word, and its reason."""

    verdict: str
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"verdict": self.verdict, "reason": self.reason}


@dataclass(frozen=True, eq=False)
class Candidate:
    """What is known of a set of legs; None where it was not asked, because the set was discarded before or was not
    ``examined``: then it is neither kept nor discarded."""

    legs: tuple[str, ...]
    verdict: str
    discarded: str | None = None
    errors: PoseErrors | None = None
    seen: Mapping[str, float] | None = None
    """The least part of each of its legs that the camera sees at start and goal, after a run all along it."""
    start_modes: Modes | None = None
    goal_modes: Modes | None = None
    aspect: Decision | None = None
    run: Decision | None = None
    examined: bool = True

    @property
    def order(self) -> tuple[float, float, int]:
        """What the best set has least of: position error, orientation error, legs."""
        if self.errors is None:
            return np.inf, np.inf, len(self.legs)
        return self.errors.position.largest, self.errors.orientation.largest, len(self.legs)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        errors = self.errors
        return {"legs": list(self.legs), "verdict": self.verdict, "discarded": self.discarded,
                "examined": self.examined,
                "position_mm": errors and errors.position.to_dict(1e3)["largest"],
                "orientation_deg": errors and errors.orientation.to_dict(180 / np.pi)["largest"],
                "seen": None if self.seen is None else dict(self.seen),
                "modes": {"start": self.start_modes and self.start_modes.to_dict(),
                          "goal": self.goal_modes and self.goal_modes.to_dict()},
                "aspect": self.aspect and self.aspect.to_dict(), "run": self.run and self.run.to_dict()}


def singular_at(name: str, posture: Posture) -> str | None:
    """Why a set is discarded whose hidden robot is singular at the start or the goal, None where it is regular."""
    kind = TYPES.get(posture.hidden.state)
    return None if kind is None else f"the {name} is {kind}"
