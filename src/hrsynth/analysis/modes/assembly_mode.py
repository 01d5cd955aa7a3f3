"""Assembly mode of a robot, read from the solution of a system."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from ...errors import LoopClosureFailure
from ...geometry.vectors import Array, compare_poses
from ...kinematics.assembly import NOT_FOUND, Assembler, Assembly, build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import OfConfiguration
from ...kinematics.leg_solutions import ReachFailure
from ...kinematics.limits import list_joints_beyond
from ...kinematics.tasks import FixedValuesTask
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...mechanism.pose import Pose
from ...records import FLAT, As, Number, Record, Recorded, Shown
from ...solving.platform.solve import SystemMode
from ...tolerances import CLOSURE_RESIDUAL_TOL, RELATION_ANGLE_TOL
from ..loci.observation_loci import list_behind, list_opposite, separate_sights
from ..observed import ObservedRobot
from ..singularity.condition_check import compute_smallest_value
from .tip_systems import Model


class LegReachFailure(NamedTuple):
    """Leg of the real robot that does not reach a mode: the reason, and by how much it misses."""

    leg: str
    miss: Annotated[ReachFailure, FLAT]


@dataclass(frozen=True, eq=False, repr=False)
class AssemblyMode(OfConfiguration, Record):
    """Pose of the platform with the measured values of the goal.

    Parameters

    ----------
    pose
        Pose of the platform (metres, radians, base frame).
    shift, turn
        Distance (m) and rotation (rad) of the exact pose, of the file's decimals, from ``pose`` at most; infinite if
        nothing is proved. If ``enclosed`` names links, of these.
    residual
        Largest distance of a tip from its locus (characteristic lengths).
    goal
        True if this is the pose at which the values were measured.
    reachable, assembly
        Verdict on the whole real robot, including legs that are not observed: whether it closes there within its joint
        limits, as in :class:`Assembly`; ``reachable`` is None if neither was found.
    type2_distance
        Smallest singular value of Mᵀ there, as of ``check``; None if the robot was not closed, or without Mᵀ.
    unclosed_legs, open_couplings
        Legs that were not closed; couplings that were not closed where all legs were.
    beyond_limits
        Joints beyond their limits.
    misses
        Proofs that legs cannot be closed.
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
    """True if exactly one mode is within the radius, for all that the file's decimals and closed loops allow."""
    rounded: Recorded[bool] = False
    """True if that is proved for the rounded geometry alone; the radius is then that of the rounded geometry."""
    match_residual: Annotated[float | None, "residual of all legs if only some of them determine it"] = None
    """Residual of all legs (characteristic lengths) of an unproved match, with redundant observation; the radius is
    then that of the mode, if it is one."""
    enclosed: Annotated[tuple[str, ...], As("bodies")] = ()
    length: float = 1.0
    """The robot's characteristic length (m)."""
    bodies: dict[str, Array] | None = None
    """Poses (4, 4) of the links on which legs end, and of the controlled one if needed; of a formation of all links,
    moved by a trivial motion to where they are nearest to the goal's."""
    opposite: Recorded[tuple[str, ...]] = ()
    """Observations with the opposite value there: then it is *antipodal*, not a mode."""
    behind: Recorded[tuple[str, ...] | None] = None
    """Observed points that are behind their camera; None if no named camera observes a point."""
    open_couplings: Annotated[
        tuple[str, ...], As("open_couplings"), "couplings that were not closed where all legs were"
    ] = ()

    def __repr__(self) -> str:
        said = "the pose itself" if self.goal else f"assembled: {self.assembly}"
        return f"<{type(self).__name__}: {self.pose}, {said}>"

    @property
    def left_open(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Noun and names of the legs or couplings that were not closed there."""
        return tuple(pair for pair in (("leg", self.unclosed_legs), ("coupling", self.open_couplings)) if pair[1])

    @property
    def radius(self) -> float:
        """Larger of the shift (characteristic lengths) and the rotation (rad)."""
        return max(self.shift / self.length, self.turn)

    radius_record = Shown(Number, lambda self: self.radius, As("radius"), "null if it is not known")
    radius_m = Shown(Number, lambda self: self.shift if np.isfinite(self.radius) else None)
    radius_rad = Shown(Number, lambda self: self.turn if np.isfinite(self.radius) else None)
    closure_failures = Shown(list[LegReachFailure], lambda self: [LegReachFailure(*failure) for failure in self.misses])


def build_mode(
    setup: ObservedRobot,
    observation_model: ObservationModel,
    at: ClosedConfiguration,
    bodies: dict[str, Array],
    residual: float,
    goal: bool = False,
) -> AssemblyMode:
    """Return a closed configuration that was found as a mode of which nothing is proved."""
    beyond, X = tuple(list_joints_beyond(at.model, at.q)), at.pose(setup.motion.link)
    assembly = Assembly(at, (), beyond)
    return AssemblyMode(
        setup.motion.pose(X),
        np.inf,
        np.pi,
        residual,
        goal,
        assembly.reachable,
        compute_smallest_value(at, observation_model),
        assembly.verdict,
        (),
        beyond,
        (),
        at,
        length=at.model.length,
        bodies=bodies,
        behind=list_behind(observation_model.observations, at.pose),
    )


class ModeReader:
    """Reader of a system's poses as poses of the robot."""

    def __init__(
        self, setup: ObservedRobot, observation_model: ObservationModel, goal: ClosedConfiguration, made: Model
    ) -> None:
        self.question, self.motion, self.made, self.goal = observation_model, setup.motion, made, goal
        self.assembler = Assembler(setup.decomposition, goal.model.length, observation_model.reference)
        rest, self.seen = separate_sights(setup.decomposition, observation_model, goal)
        self.measured = FixedValuesTask.at(goal.model, goal.q, observation_model.reference, rest.observations).measured

    def away(self, mode: SystemMode) -> float:
        """Return the difference of a mode and the goal (characteristic lengths, differences of rotation matrices)."""
        return max(
            compare_poses(X, self.goal.pose(body), self.goal.model.length)
            for body, X in self.made.bodies(mode.q).items()
        )

    def read(self, mode: SystemMode, nearest: bool) -> AssemblyMode:
        """Read a mode as one of the robot; of all modes the ``nearest`` to the goal can be it."""
        bodies, size = self.made.bodies(mode.q), self.goal.model.length
        at_goal = nearest and self.away(mode) <= RELATION_ANGLE_TOL
        near = mode.near
        held = () if near else self.measured
        scale = self.made.system.size / size
        base = self.goal.model.mechanism.base
        pose = {base: self.goal.pose(base), **bodies}.__getitem__
        antipodal = list_opposite([sight.seen for sight in self.seen], self.goal, self.question.reference, pose)
        assembly = Assembly(self.goal)
        if antipodal:  # not a mode: the assembly of the robot is not computed
            assembly = Assembly(None, platform=self.assembler.platform(bodies))
        elif self.made.closing is not None:
            assembly = Assembly(None, platform=self.assembler.platform(bodies))
            with suppress(LoopClosureFailure):  # whole turns at which couplings do not close
                at = self.made.closing(mode.q)
                assembly = Assembly(at, (), tuple(list_joints_beyond(at.model, at.q)), held=True)
        elif not at_goal or near or list_joints_beyond(self.goal.model, self.goal.q):
            assembly = self.assembler.at(bodies, held, 0.0 if near else self.doubt(mode))
        if (
            assembly.configuration is not None
            and self.made.closing is None
            and (gears := self.open(assembly.configuration))
        ):
            assembly = Assembly(None, platform=self.assembler.platform(bodies), gears=gears)
        X = (
            assembly.platform[self.motion.link]
            if assembly.platform is not None
            else self.goal.pose(self.motion.link)
            if assembly.configuration is None
            else assembly.configuration.pose(self.motion.link)
        )
        shift, turn = self.radius(mode, bodies, X)
        return AssemblyMode(
            self.motion.pose(X),
            shift,
            turn,
            mode.residual * scale,
            at_goal,
            assembly.reachable,
            self.distance(assembly.configuration),
            assembly.verdict,
            assembly.open,
            assembly.beyond,
            assembly.misses,
            assembly.configuration,
            mode.multiplicity,
            mode.proved,
            mode.rounded,
            mode.residual * scale if mode.match_residual else None,
            () if self.motion.link in bodies else tuple(bodies),
            size,
            bodies,
            antipodal,
            list_behind([sight.seen for sight in self.seen], pose),
            assembly.gears,
        )

    def distance(self, at: ClosedConfiguration | None) -> float | None:
        """Return the smallest singular value of Mᵀ, or None without Mᵀ."""
        return (
            None if at is None or compute_relation(at, self.question).RI else compute_smallest_value(at, self.question)
        )

    def open(self, at: ClosedConfiguration) -> tuple[str, ...]:
        """Return the couplings that do not close where legs do."""
        model = self.goal.model
        if not model.mechanism.couplings:
            return ()
        try:
            whole = build_from_link_poses(model, at.pose)
        except LoopClosureFailure:
            pass
        else:
            if all(
                compare_poses(whole.pose(link), at.pose(link), at.model.length) <= RELATION_ANGLE_TOL
                for link in at.model.mechanism.links
            ):
                return ()
        left = model.gear_errors(model.read({link: at.pose(link) for link in model.mechanism.links}.__getitem__))
        return tuple(name for name, miss in left.items() if abs(miss) > CLOSURE_RESIDUAL_TOL) or tuple(left)

    def doubt(self, mode: SystemMode) -> float:
        """Return how far the links' exact poses can be from the system's (characteristic lengths, radians); 0 if
        nothing was proved of them: the printed poses count."""
        length = self.goal.model.length
        error = max(mode.shift / length, mode.turn) + self.made.system.error / length
        return error if np.isfinite(error) else 0.0

    def radius(self, mode: SystemMode, bodies: dict[str, Array], X: Array) -> tuple[float, float]:
        """Return how far the exact pose can be from the printed pose X (4, 4) (m, rad): the system's error, that of its
        frame at the goal, and the difference of both; of the links if X is not one of theirs."""
        first, error = next(iter(bodies.values())), self.made.system.error
        shift, turn = mode.shift + error, mode.turn + error / self.goal.model.length
        known = bodies.get(self.motion.link)
        if known is None:
            return shift, turn
        lever = float(np.linalg.norm(known[:3, 3] - first[:3, 3]))
        if self.made.back:  # the base's turn, as the platform sees it, is about a point of the platform
            lever += float(np.linalg.norm(known[:3, 3] - self.goal.pose(self.motion.link)[:3, 3]))
        return (
            shift + turn * lever + float(np.linalg.norm(X[:3, 3] - known[:3, 3])),
            turn + float(np.linalg.norm(X[:3, :3] - known[:3, :3])),
        )
