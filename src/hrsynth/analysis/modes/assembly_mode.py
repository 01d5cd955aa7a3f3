"""An assembly mode of the robot, and how one of a system is read as such."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...errors import LoopsNotClosed
from ...geometry.vectors import Array, pose_difference
from ...kinematics.assembly import NOT_FOUND, Assembler, Assembly, of_links
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import OfConfiguration
from ...kinematics.leg_solutions import ReachFailure
from ...kinematics.limits import outside
from ...kinematics.tasks import FixedValuesTask
from ...kinematics.velocity_relation import ObservationModel, relation
from ...mechanism.pose import Pose
from ...records import FLAT, As, Number, Record, Recorded, Shown
from ...tolerances import CLOSED, SAME_RELATION
from ..observed import ObservedRobot
from ..singularity.condition_check import weakest
from .branches import Model
from .observation_loci import behind, opposite, sights
from .solve import SystemMode


class LegMissed(NamedTuple):
    """Why a leg of the real robot does not reach a mode, and by how much."""

    leg: str
    miss: Annotated[ReachFailure, FLAT]


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyMode(OfConfiguration, Record):
    """A pose of the platform with the measurements of the goal.

    The exact pose, of the file's decimals, is within ``shift`` (m) and ``turn`` (rad) of ``pose``, infinite if nothing
    was proved: its position and its turn, or those of the bodies on which legs end if ``enclosed`` names them;
    ``residual``: the largest distance of a tip from its curve (characteristic lengths). ``goal``: whether it is the
    pose itself from which the measurements were taken. ``reachable`` and ``assembly``: whether the whole real robot,
    including legs that are not watched, closes there within its joints' limits, as in :class:`Assembly` (the first is
    None if neither was found); ``open`` names the legs that were not closed, ``gears`` the couplings where all legs
    were, ``beyond`` the joints, ``misses`` what proves that legs cannot be closed. ``type2_distance``: the smallest
    singular value of Mᵀ there, as ``check`` gives it; None if the robot was not closed, or if there is no Mᵀ.
    """

    pose: Recorded[Pose]
    shift: float
    turn: float
    residual: Recorded[float]
    goal: Recorded[bool]
    reachable: Recorded[bool | None]
    type2_distance: Recorded[float | None]
    assembly: Annotated[str, Literal["yes", "beyond limits", "no", "not found"]] = NOT_FOUND
    unclosed_legs: Recorded[tuple[str, ...]] = ()
    beyond_limits: Recorded[tuple[str, ...]] = ()
    misses: tuple[tuple[str, ReachFailure], ...] = ()
    configuration: ClosedConfiguration | None = None
    multiplicity: Recorded[int] = 1
    proved: Recorded[bool] = False
    """Whether there is exactly one mode within the radius, for all that the file's decimals and closed loops allow."""
    rounded: Recorded[bool] = False
    """Whether that is proved for the rounded geometry alone, of which the radius then speaks."""
    match_residual: Annotated[float | None, "how well all legs fit if only some of them place it"] = None
    """How well all legs fit (characteristic lengths) where more is observed than needed and that is all that is known;
    the radius is then that of the mode, if it is one."""
    enclosed: Annotated[tuple[str, ...], As("bodies")] = ()
    length: float = 1.0
    """The robot's characteristic length (m)."""
    bodies: dict[str, Array] | None = None
    """Poses (4, 4) of the bodies on which legs end, where need be of the controlled one; of a formation of all bodies,
    moved by a trivial motion to where they are nearest to the goal's."""
    opposite: Recorded[tuple[str, ...]] = ()
    """What is seen there as the opposite value: then it is *antipodal* and no mode."""
    behind: Recorded[tuple[str, ...] | None] = None
    """What is not in front of the camera by which it is seen; None where no camera with a name sees a point."""
    open_couplings: Annotated[
        tuple[str, ...], As("open_couplings"), "couplings that were not closed where all legs were"
    ] = ()

    def __repr__(self) -> str:
        said = "the pose itself" if self.goal else f"assembled: {self.assembly}"
        return f"<{type(self).__name__}: {self.pose}, {said}>"

    @property
    def left_open(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """What was not closed there: of legs or couplings the noun and the names."""
        return tuple(each for each in (("leg", self.unclosed_legs), ("coupling", self.open_couplings)) if each[1])

    @property
    def radius(self) -> float:
        """The larger of the shift (characteristic lengths) and the turn (rad)."""
        return max(self.shift / self.length, self.turn)

    radius_record = Shown(Number, lambda self: self.radius, As("radius"), "null if it is not known")
    radius_m = Shown(Number, lambda self: self.shift if np.isfinite(self.radius) else None)
    radius_rad = Shown(Number, lambda self: self.turn if np.isfinite(self.radius) else None)
    closure_failures = Shown(list[LegMissed], lambda self: [LegMissed(*each) for each in self.misses])


def found_mode(
    setup: ObservedRobot,
    observation_model: ObservationModel,
    at: ClosedConfiguration,
    bodies: dict[str, Array],
    residual: float,
    goal: bool = False,
) -> AssemblyMode:
    """A closed configuration that was found, as a mode of which nothing is proved."""
    beyond, X = tuple(outside(at.model, at.q)), at.pose(setup.motion.link)
    found = Assembly(at, (), beyond)
    return AssemblyMode(
        setup.motion.pose(X),
        np.inf,
        np.pi,
        residual,
        goal,
        found.reachable,
        weakest(at, observation_model),
        found.verdict,
        (),
        beyond,
        (),
        at,
        length=at.model.length,
        bodies=bodies,
        behind=behind(observation_model.observations, at.pose),
    )


class ModeReader:
    """Poses of a system read as poses of the robot."""

    def __init__(
        self, setup: ObservedRobot, observation_model: ObservationModel, goal: ClosedConfiguration, made: Model
    ) -> None:
        self.question, self.motion, self.made, self.goal = observation_model, setup.motion, made, goal
        self.assembler = Assembler(setup.decomposition, goal.model.length, observation_model.reference)
        rest, self.seen = sights(setup.decomposition, observation_model, goal)
        self.measured = FixedValuesTask.at(goal.model, goal.q, observation_model.reference, rest.observations).measured

    def away(self, mode: SystemMode) -> float:
        """How far a mode is from the goal (characteristic lengths, differences of rotation matrices)."""
        return max(
            pose_difference(X, self.goal.pose(body), self.goal.model.length)
            for body, X in self.made.bodies(mode.q).items()
        )

    def read(self, mode: SystemMode, nearest: bool) -> AssemblyMode:
        """What a mode is for the robot; of all modes the ``nearest`` to the goal can be it."""
        bodies, size = self.made.bodies(mode.q), self.goal.model.length
        at_goal = nearest and self.away(mode) <= SAME_RELATION
        near = mode.near
        held = () if near else self.measured
        scale = self.made.system.size / size
        base = self.goal.model.mechanism.base
        pose = {base: self.goal.pose(base), **bodies}.__getitem__
        antipodal = opposite([each.seen for each in self.seen], self.goal, self.question.reference, pose)
        found = Assembly(self.goal)
        if antipodal:  # no mode: whether the robot can be assembled is not asked
            found = Assembly(None, platform=self.assembler.platform(bodies))
        elif self.made.closing is not None:
            at = self.made.closing(mode.q)
            found = Assembly(at, (), tuple(outside(at.model, at.q)), held=True)
        elif not at_goal or near or outside(self.goal.model, self.goal.q):
            found = self.assembler.at(bodies, held, 0.0 if near else self.doubt(mode))
        if found.configuration is not None and self.made.closing is None and (gears := self.open(found.configuration)):
            found = Assembly(None, platform=self.assembler.platform(bodies), gears=gears)
        X = (
            found.platform[self.motion.link]
            if found.platform is not None
            else self.goal.pose(self.motion.link)
            if found.configuration is None
            else found.configuration.pose(self.motion.link)
        )
        shift, turn = self.radius(mode, bodies, X)
        return AssemblyMode(
            self.motion.pose(X),
            shift,
            turn,
            mode.residual * scale,
            at_goal,
            found.reachable,
            self.distance(found.configuration),
            found.verdict,
            found.open,
            found.beyond,
            found.misses,
            found.configuration,
            mode.multiplicity,
            mode.proved,
            mode.rounded,
            mode.residual * scale if mode.match_residual else None,
            () if self.motion.link in bodies else tuple(bodies),
            size,
            bodies,
            antipodal,
            behind([each.seen for each in self.seen], pose),
            found.gears,
        )

    def distance(self, at: ClosedConfiguration | None) -> float | None:
        """The smallest singular value of Mᵀ, where there is one."""
        return None if at is None or relation(at, self.question).RI else weakest(at, self.question)

    def open(self, at: ClosedConfiguration) -> tuple[str, ...]:
        """The couplings that do not close where legs do."""
        model = self.goal.model
        if not model.mechanism.couplings:
            return ()
        try:
            whole = of_links(model, at.pose)
        except LoopsNotClosed:
            pass
        else:
            if all(
                pose_difference(whole.pose(link), at.pose(link), at.model.length) <= SAME_RELATION
                for link in at.model.mechanism.links
            ):
                return ()
        left = model.gear_errors(model.read({link: at.pose(link) for link in model.mechanism.links}.__getitem__))
        return tuple(name for name, miss in left.items() if abs(miss) > CLOSED) or tuple(left)

    def doubt(self, mode: SystemMode) -> float:
        """How far the bodies' exact poses can be from the system's (characteristic lengths, radians); 0 where nothing
        was proved of them: the told poses are meant."""
        length = self.goal.model.length
        found = max(mode.shift / length, mode.turn) + self.made.system.error / length
        return found if np.isfinite(found) else 0.0

    def radius(self, mode: SystemMode, bodies: dict[str, Array], X: Array) -> tuple[float, float]:
        """How far the exact pose can be from the pose X (4, 4) that is told (m, rad): the system's, with what its frame
        at the goal may be off, and what the told pose is from the system's; of the bodies where X is none of theirs."""
        first, error = next(iter(bodies.values())), self.made.system.error
        shift, turn = mode.shift + error, mode.turn + error / self.goal.model.length
        told = bodies.get(self.motion.link)
        if told is None:
            return shift, turn
        lever = float(np.linalg.norm(told[:3, 3] - first[:3, 3]))
        if self.made.back:  # the base's turn, as the platform sees it, is about a point of the platform
            lever += float(np.linalg.norm(told[:3, 3] - self.goal.pose(self.motion.link)[:3, 3]))
        return (
            shift + turn * lever + float(np.linalg.norm(X[:3, 3] - told[:3, 3])),
            turn + float(np.linalg.norm(X[:3, :3] - told[:3, :3])),
        )
