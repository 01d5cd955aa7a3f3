"""Mobility, ranks, singularities and redundant constraints of a robot at given poses, and over a grid of poses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..batch.reach import grid_dependence, sweep
from ..errors import PlaneNotMet, PoseNotReached
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism.pose import Grid, PoseLike, asked_poses
from ..progress import tell
from ..results import Result, Value
from .asked import asked_at, require_platform
from .classes import Redundancy, list_redundant
from .observed import CameraLike, LegsLike, Mobility, ObservedRobot, RobotLike, SeeLike
from .posture import ConfigurationAnalysis, Posture
from .question import question

UNREACHABLE = "unreachable"
MEASURES = ("type2", "type1", "constraints", "condition", "mm_per_degree", "degrees_per_degree")


@dataclass(frozen=True, eq=False, repr=False)
class GridCheck(Value):
    """The postures over a grid of poses, in its order; None where a pose is not reached."""

    grid: Grid
    postures: tuple[Posture | None, ...]
    free: tuple[str, ...]
    """The parts of the pose that are neither varied nor held."""
    dependent: str | None = None
    """That parts of its poses depend on each other, where some are not reached."""

    @property
    def states(self) -> tuple[str, ...]:
        """The kind of singularity of each cell in one word, or that it is not reached or not decided."""
        return tuple(UNREACHABLE if each is None else each.hidden.state for each in self.postures)

    def values(self, measure: str) -> tuple[float | None, ...]:
        """One of ``MEASURES`` at each cell; None where the pose is not reached or the value is infinite."""
        return tuple(None if each is None else each.distances.to_dict()[measure] for each in self.postures)

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line: arrays nested in the order of ``axes``."""
        shape = self.grid.shape
        nested = {name: np.array(self.values(name), dtype=object).reshape(shape).tolist() for name in MEASURES}
        return {
            **self.grid.to_dict(),
            "free": list(self.free),
            "state": np.array(self.states, dtype=object).reshape(shape).tolist(),
            **nested,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Check(Result, shown_as="check"):
    """What is observed, the postures at the requested poses, and the loop constraints that are redundant at
    generic ones."""

    setting: ObservedRobot
    postures: tuple[Posture, ...]
    redundant: tuple[Redundancy, ...]
    grid: GridCheck | None = None
    unreached: tuple[PoseNotReached, ...] = ()
    """The poses asked for that the robot does not reach, and why."""

    @property
    def length(self) -> float:
        """The characteristic length (m) that makes lengths comparable with angles."""
        return self.setting.everything.twin.length

    @property
    def as_written(self) -> Mobility | None:
        """The mobility of the file's own links and joints, None where no samples of them can be drawn."""
        return self.setting.mobility_if_written

    def headline(self) -> str:
        """The robot, and the state of its hidden robot at each pose."""
        dof, states = self.setting.dof, list[str]()
        for each in self.postures:
            rank = each.hidden.rank
            states.append(f"{each.pose} {each.hidden.state}" + ("" if rank == dof else f", shows {rank} of {dof}"))
        states += [f"{each.pose} not reached" for each in self.unreached]
        return f"{self.setting.headline()}: {'; '.join(states)}"

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        return {
            "characteristic_length": self.length,
            **self.setting.to_dict(),
            "watched": self.setting.watched_dict(),
            "mobility": self.setting.mobility_dict(),
            "configurations": [each.to_dict() for each in self.postures],
            "unreached": [{"pose": each.pose, "reason": each.reason} for each in self.unreached],
            "redundant": [each.to_dict() for each in self.redundant],
            "grid": self.grid and self.grid.to_dict(),
            "unlimited": list(self.setting.unlimited),
        }


@question(formations=True)
def check(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    see: SeeLike = None,
    at: PoseLike | Iterable[PoseLike] = (),
    grid: Grid | str | None = None,
    seed: int = 0,
) -> Check:
    """Mobility, ranks with gaps, Type 1, 2, 3, Zlatanov's six numbers, constraint singularities and redundant
    constraints (docs/pages/theory.md, section 7) at the poses ``at`` (default: the zero configuration) and over
    ``grid``.

    Statements about the hidden robot are read from the real robot's relation with the observed directions, which is
    that of the exact lift at every closed configuration (theory.md 3), not from the form that ``derive`` gives; those
    about the real robot take its motors' coordinates as what is measured.
    Generic values are those of random samples. ``observe`` and ``camera`` are as for ``derive``.

    Of several poses, those out of reach are listed in ``unreached``. Raises ``BadRequest`` for unknown names and for
    parts of a pose that the platform cannot change, ``PoseNotReached`` if no pose is reached, ``PlaneNotMet`` if none
    of a grid is.

    >>> hrsynth.check("3rrr_m1", at=["x=0,y=0,phi=0", [0.01, 0, 0]])
    <Check: 3rrr_m1, watching 1, 2, 3: x=0,y=0,z=0,phi=0deg regular; x=0.01,y=0,z=0,phi=0deg regular>
    """
    poses = asked_poses(at)
    cells = None if grid is None else Grid.parse(grid)
    setting = ObservedRobot.of(robot, observe, camera, see=see, seed=seed).telling(poses)
    examiner = ConfigurationAnalysis.of(setting)
    start, question, motion = setting.everything.start, setting.everything.question, setting.motion
    found = asked_at(setting, poses) or [start]
    configurations = [each for each in found if isinstance(each, ClosedConfiguration)]
    unreached = tuple(each for each in found if isinstance(each, PoseNotReached))
    if not configurations:
        raise PoseNotReached.of_all(unreached)
    tell("poses")
    postures = tuple(map(examiner.examine, configurations))
    swept = None
    if cells is not None:
        require_platform(setting.robot, cells)
        places = sweep(start, question, cells, motion, setting.placer)
        dependent = None if all(places) else grid_dependence(start, motion, cells)
        if not any(places):
            raise PlaneNotMet(setting.robot.name, f"the grid {cells}", f"none of {len(places)} is", dependent)
        swept = GridCheck(
            cells,
            tuple(None if each is None else examiner.classify(each) for each in places),
            motion.free({*cells.names, *cells.fixed.given}),
            dependent,
        )
    return Check(setting, postures, list_redundant(examiner.redundant, generic=True), swept, unreached)
