"""All poses at which a loop can rest: the goal, its modes, antipodal poses, and critical poses of the error; which of
them attract (docs/pages/theory.md, section 11)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.asked import configurations_at
from ...analysis.observed import LegsLike, ObservedRobot, RobotLike
from ...analysis.posture import ConfigurationAnalysis
from ...analysis.question import question
from ...constraints.pattern import attached
from ...errors import LoopsNotClosed
from ...geometry.vectors import Array, pose_difference
from ...kinematics.assembly import ASSEMBLED, BEYOND, of_links
from ...kinematics.branch import Signature
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.limits import outside
from ...kinematics.relation import relation
from ...mechanism.pose import Pose, PoseLike, asked_pose
from ...progress import tell
from ...results import Result
from ...tolerances import DAMPED, SAME_ENDING, SAME_RELATION, VANISHED
from ..ending import ANTIPODAL, BOUNDARY, GOAL, MODE, rest
from ..law import FixedDirections, Law, directions
from ..servo import require_regular, require_seen
from .error import RestSystem
from .search import Critical, critical_points, walked

CRITICAL = "critical"
NEARBY = 0.02
"""Step (characteristic lengths, radians) to a configuration that shows the operation mode in which a rest lies."""
STABLE, SADDLE, UNSTABLE, UNDECIDED = "stable", "saddle", "unstable", "undecided"


@dataclass(frozen=True, eq=False, repr=False)
class RestPoint:
    """A pose at which the loop rests: ``kind`` goal, mode, antipodal or critical (‖e‖ = ``error`` > 0 and no command),
    ``stability`` stable (it attracts), saddle, unstable (nothing is drawn to it) or undecided; ``curvatures`` are the
    eigenvalues of the Hessian of ½ ‖e‖² along the motions of the loops (characteristic lengths, radians), ascending.

    The rest lies within ``shift`` (m) and ``turn`` (rad) of ``pose``, infinite where it was only found. ``reversed``
    names legs whose direction is opposite to the desired one, ``across`` those at right angles to it. ``singular`` says
    why fewer velocities are seen there than at other poses, None where all are; ``boundary`` whether that is a leg's
    reach. ``assembly`` is ``beyond limits`` where joints (``beyond``) are outside their limits, else ``yes``;
    ``other_legs`` are in another working mode than at the goal (None where that is not known).
    """

    pose: Pose
    kind: str
    stability: str
    error: float
    curvatures: tuple[float, ...]
    configuration: ClosedConfiguration
    shift: float = np.inf
    turn: float = np.inf
    reversed: tuple[str, ...] = ()
    across: tuple[str, ...] = ()
    singular: str | None = None
    boundary: bool = False
    beyond: tuple[str, ...] = ()
    other_legs: tuple[str, ...] | None = None
    met: int = 0

    @property
    def proved(self) -> bool:
        """Whether it is enclosed."""
        return bool(np.isfinite(self.shift))

    @property
    def assembly(self) -> str:
        """Whether the whole robot can be there."""
        return BEYOND if self.beyond else ASSEMBLED

    @property
    def stable(self) -> bool | None:
        """Whether it attracts; None where that is not decided."""
        return None if self.stability == UNDECIDED else self.stability == STABLE

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.kind}, {self.stability}, {self.pose}>"

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line."""
        return {"pose": self.pose.to_dict(), "kind": self.kind, "stable": self.stable, "stability": self.stability,
                "error": self.error, "curvatures": list(self.curvatures), "proved": self.proved,
                "radius_m": self.shift if self.proved else None, "radius_rad": self.turn if self.proved else None,
                "reversed": list(self.reversed), "across": list(self.across), "singular": self.singular,
                "boundary": self.boundary, "assembly": self.assembly, "beyond": list(self.beyond),
                "other_legs": None if self.other_legs is None else list(self.other_legs), "met": self.met}


@dataclass(frozen=True, eq=False, repr=False)
class Endings(Result, shown_as="endings"):
    """All that was found of where the loop can rest with the directions of one pose, the goal: ``rests`` one by one,
    the goal first, then those that attract; ``continua``: one rest each of those that fill curves or surfaces.
    ``complete``: whether a computation proves that there are no others, and ``proof`` which; ``starts`` how many were
    led to rests."""

    setting: ObservedRobot
    goal: ClosedConfiguration
    pose: Pose
    desired: Array
    rests: tuple[RestPoint, ...]
    continua: tuple[RestPoint, ...]
    complete: bool
    proof: str
    starts: int

    @property
    def endings(self) -> tuple[RestPoint, ...]:
        """The rests at which all velocities are seen."""
        return tuple(each for each in self.rests if each.singular is None)

    @property
    def singular(self) -> tuple[RestPoint, ...]:
        """The rests of the damped law at which fewer are: there the law without damping is not continuous."""
        return tuple(each for each in self.rests if each.singular is not None)

    @property
    def attracting(self) -> tuple[RestPoint, ...]:
        """The rests that attract."""
        return tuple(each for each in self.rests if each.stable)

    def headline(self) -> str:
        """The robot and how many rests there are."""
        return (f"{self.setting.headline()}: {len(self.rests)} poses at which the loop to {self.pose} can rest, "
                f"{len(self.attracting)} of them attract")

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        return {"at": self.pose.to_dict(), **self.setting.to_dict(), "complex": None, "complete": self.complete,
                "proof": self.proof, "starts": self.starts, "attracting": len(self.attracting),
                "endings": [each.to_dict() for each in self.endings],
                "singular": [each.to_dict() for each in self.singular],
                "continua": [each.to_dict() for each in self.continua]}


@question()
def endings(robot: RobotLike, observe: LegsLike = None, camera: str | None = None, *, at: PoseLike, seed: int = 0
            ) -> Endings:
    """All poses at which the loop can rest that servoes the directions which are observed at ``at``: the goal, modes
    and antipodal poses, where the error vanishes, and critical poses, where it does not; which of them attract.

    ``observe`` and ``camera`` as for ``derive``. The law rests exactly at the critical points of ½ ‖e‖² on the closed
    loops (theory.md 11). These are sought from random walks on the branch of the zero configuration.

    Raises ``BadRequest`` for names that there are not, legs that do not see the platform, a singular goal;
    ``PoseNotReached`` for a pose out of reach.

    >>> hrsynth.endings("rrrrr_m1", at="x=0,y=0.25").attracting[0].kind
    'goal'
    """
    setting = ObservedRobot.of(robot, observe, camera, seed=seed).by_segments("endings")
    asked = asked_pose(at)
    setting = setting.telling([asked])
    require_seen(setting)
    (goal,) = configurations_at(setting, [asked])
    require_regular(ConfigurationAnalysis.of(setting), "goal", goal)
    tell("rests")
    return RestSearch.of(setting, goal).answer(seed)


@dataclass(frozen=True, eq=False)
class RestSearch:
    """What the rests of a loop are sought with."""

    setting: ObservedRobot
    goal: ClosedConfiguration
    system: RestSystem
    law: Law
    desired: Array

    @classmethod
    def of(cls, setting: ObservedRobot, goal: ClosedConfiguration) -> RestSearch:
        """That of a goal."""
        question = setting.samples.question
        system = RestSystem.of(goal, question, setting.configurations)
        return cls(setting, goal, system, Law(question, setting.dof, 1.0), directions(goal, question)[0])

    def answer(self, seed: int = 0, *, minima: bool = False, rounds: Iterable[Array] | None = None) -> Endings:
        """The rests that were found; ``minima`` and ``rounds`` as for :func:`.critical_points`."""
        setting = self.setting
        found = critical_points(self.system, setting, self.goal, seed, minima=minima, rounds=rounds)
        rests = [each for one in found.isolated if (each := self.read(one)) is not None]
        continua = [each for one in found.continua if (each := self.read(one)) is not None]
        order = {GOAL: 0, MODE: 1, ANTIPODAL: 2, CRITICAL: 3}
        rests.sort(key=lambda each: (order[each.kind], not each.stable, each.error))
        motion = setting.motion
        return Endings(setting, self.goal, motion.pose(self.goal.pose(motion.link)), self.desired, tuple(rests),
                       tuple(continua), False, found.words, found.starts)

    def read(self, found: Critical) -> RestPoint | None:
        """A critical point as a pose of the robot; None where its loops do not close."""
        motion, point = self.setting.motion, found.point
        try:
            at = of_links(self.goal.twin, lambda link: self.system.system.pose(link, point.q.tolist()))
        except LoopsNotClosed:
            return None
        command = self.law.at(at, FixedDirections(self.desired)(0.0))
        if command.pull > SAME_ENDING or not self._in_mode(found):
            return None
        u = command.directions
        cosines = np.sum(u * self.desired, axis=1)
        labels = [o.leg for o in self.law.question.observations]
        error = command.size
        reversed_ = tuple(label for label, c in zip(labels, cosines, strict=True) if c < -1 + VANISHED)
        across = tuple(label for label, c in zip(labels, cosines, strict=True) if abs(c) < VANISHED)
        kind, singular, boundary = CRITICAL, None, False
        if error < VANISHED:
            kind = ANTIPODAL if reversed_ else GOAL if self._at_goal(at) else MODE
        elif float(command.values[-1]) < DAMPED:
            why = rest(self.setting, at, command)
            singular, boundary = why.reason, why.name == BOUNDARY
        return RestPoint(motion.pose(at.pose(motion.link)), kind, stability(point.curvatures), error,
                         tuple(map(float, point.curvatures)), at, reversed=reversed_, across=across, singular=singular,
                         boundary=boundary, beyond=tuple(outside(at.twin, at.q)), met=found.met)

    def _in_mode(self, found: Critical) -> bool:
        """Whether configurations nearby are of the operation mode of the zero configuration."""
        q = walked(self.system, found.point.q[None], np.random.default_rng(0), 2, NEARBY)[0]
        try:
            at = of_links(self.goal.twin, lambda link: self.system.system.pose(link, q.tolist()))
        except LoopsNotClosed:
            return False
        drawn = self.setting.everything
        return drawn.signature.agrees(Signature.of(relation(at, drawn.question)))

    def _at_goal(self, at: ClosedConfiguration) -> bool:
        return all(pose_difference(at.pose(body), self.goal.pose(body), self.goal.twin.length) <= SAME_RELATION
                   for body in attached(self.setting.anatomy))


def stability(curvatures: Sequence[float] | Array) -> str:
    """What the eigenvalues of a Hessian say."""
    values = np.asarray(curvatures)
    if np.any(np.abs(values) < SAME_ENDING):
        return UNDECIDED if np.all(values > -SAME_ENDING) else SADDLE if np.any(values > SAME_ENDING) else UNDECIDED
    return STABLE if np.all(values > 0) else UNSTABLE if np.all(values < 0) else SADDLE
