"""Which legs must be watched: the verdict of every set of observed legs."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any

from ..mechanism.observation import labels_of
from ..mechanism.pose import PoseLike, asked_pose
from ..progress import tell
from ..results import Result
from .asked import observe as observed
from .exact import ExactVerdict, architecture
from .observed import CameraLike, LegsLike, ObservedRobot, RobotLike, SeeLike, restricted
from .question import question
from .verdict import Verdict, verdict_of

if TYPE_CHECKING:
    pass

LARGEST_COMPLETE = 10
"""Number of legs up to which all sets are tried; beyond, sets of up to three legs and the whole."""


@dataclass(frozen=True, eq=False, repr=False)
class Legs(Result, shown_as="legs"):
    """The verdict of every set of observed legs, and the smallest sets of the best rank."""

    setting: ObservedRobot
    robot: str
    architecture: str
    dof: int
    sets: tuple[Verdict, ...]
    exact: tuple[ExactVerdict, ...]
    """What generic geometry of the same architecture sees, for each of ``sets``."""
    complete: bool
    """Whether all sets were tried."""
    minimal: tuple[tuple[str, ...], ...] = field(default=())
    where: str = "the zero configuration"
    """What took the place of the zero configuration, as it was asked for."""

    def headline(self) -> str:
        """The robot and the smallest sets that see most."""
        return f"{self.robot}, {len(self.sets)} sets, smallest of the best rank: {self.smallest}"

    @property
    def smallest(self) -> str:
        """The smallest sets as text."""
        return "  ".join("{" + ", ".join(each) + "}" for each in self.minimal)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"robot": self.robot, "architecture_ascii": self.architecture, "dof": self.dof,
                "sets": [{**each.to_dict(), "exact": exact.exact, "architecture": exact.to_dict()}
                         for each, exact in zip(self.sets, self.exact, strict=True)], "complete": self.complete,
                "watched": self.setting.watched_dict(), "minimal": [list(each) for each in self.minimal],
                **self.setting.modes_dict()}


@question()
def legs(robot: RobotLike, camera: CameraLike = None, *, observe: LegsLike = None, see: SeeLike = None,
         at: PoseLike | None = None, seed: int = 0) -> Legs:
    """The verdict of every set of legs (theory.md 6), on the branch of the zero configuration, or of the pose ``at``
    (``mode:2``: a mode with all legs watched): all legs at their default segments, or those of ``observe``, labels or
    links, and what is seen with ``see``: observations count one by one.

    >>> hrsynth.legs("3rrr_m1").minimal
    (('1', '2', '3'),)
    """
    setting = observed(robot, observe, camera, see=see, at=at, seed=seed)
    anatomy = setting.anatomy
    whole = observe is None and all(each.by_segment for each in setting.observed)
    segments = setting.segments if whole else setting.observed
    labels = labels_of(segments)
    sets, exact = list[Verdict](), list[ExactVerdict]()
    generic = architecture(setting)
    complete = len(labels) <= LARGEST_COMPLETE
    for size in range(1, len(labels) + 1):
        if not complete and 3 < size < len(labels):
            continue
        for chosen in combinations(labels, size):
            samples = restricted(setting.everything, [each for each in segments if each.leg in chosen])
            sets.append(verdict_of(setting, chosen, samples))
            exact.append(generic.verdict(samples.question.observations))
            tell("sets of legs")
    best = max(each.rank for each in sets)
    smallest = min(len(each.legs) for each in sets if each.rank == best)
    minimal = tuple(each.legs for each in sets if each.rank == best and len(each.legs) == smallest)
    return Legs(setting, setting.robot.name, anatomy.architecture().ascii, setting.dof, tuple(sets), tuple(exact),
                complete, minimal, **({} if at is None else {"where": str(asked_pose(at))}))
