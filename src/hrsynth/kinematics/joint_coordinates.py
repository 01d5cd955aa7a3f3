"""Coordinates of a file's joints at a closed configuration, and closed configurations by them.

They count as the file counts: from its zero, in its sense, metres and radians, turns not modulo 2π. Balls, planar and
free joints have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ..errors import BadRequest, LoopClosureFailure, PoseReachFailure
from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.pose import JointPose, format_coordinates
from ..records import OPTIONAL, Record, recorded
from ..results import Value
from ..tolerances import CLOSURE_RESIDUAL_TOL, CLOSURE_SOLVER_TOL, POINT_DISTANCE_TOL, PRINTED_POSE_TOL
from .assembly import build_from_link_poses
from .configuration import ClosedConfiguration
from .continuation import CONTINUATION_STEP_MAX, find_nearest, track
from .limits import CoordinateIntervals
from .pinocchio_model import PinocchioModel
from .platform_motion import PlatformMotion
from .tasks import LinkPoses, solve

COUNTED = (JointType.REVOLUTE, JointType.PRISMATIC, JointType.UNIVERSAL, JointType.CYLINDRICAL)
"""Return the joints that have coordinates here: a translation before a rotation, rotations in the order of the axes."""


def list_coordinate_joints(robot: Mechanism, motors: bool = False) -> list[Joint]:
    """Return the joints of a robot that have coordinates, or only its motors, in the order of the file."""
    return [each for each in robot.joints.values() if each.type in COUNTED and (each.is_actuated or not motors)]


def convert_to_file_joints(at: ClosedConfiguration) -> ClosedConfiguration | None:
    """Return a configuration in the joints that the robot's file has; None if the normal form has made one joint of
    several, and the poses of the remaining links do not fit the file's joints."""
    robot = at.model.mechanism.written or at.model.mechanism
    if all(joint.name in at.model.coordinates for joint in list_coordinate_joints(robot)):
        return at
    model = _build_model(robot, at.model.length)
    kept = tuple((link, at.pose(link)) for link in robot.links if link in at.model.mechanism.links)
    start = model.integrate(model.q0, _convert_step(at.model, at.q, model))
    q, residual = solve(model, start, LinkPoses(kept), tolerance=CLOSURE_SOLVER_TOL, iterations=100)
    return ClosedConfiguration.of(model, q) if residual <= CLOSURE_RESIDUAL_TOL else None


def collect_link_poses(at: ClosedConfiguration) -> dict[str, Array] | None:
    """Return the poses (4, 4) of the file's links in the base frame, metres; None if the file's joints do not fit."""
    filed = convert_to_file_joints(at)
    return None if filed is None else {link: filed.pose(link) for link in filed.model.mechanism.links}


def read_joints(at: ClosedConfiguration) -> dict[str, tuple[float, ...]]:
    """Return the coordinates of the joints of a robot, as its file has them, at a configuration of it or of its normal
    form; none if the file's joints do not fit."""
    own = convert_to_file_joints(at)
    if own is None:
        return {}
    model = own.model
    step = model.difference(model.q0, own.q)
    return {
        each.name: tuple(
            (
                step[list(model.coordinates[each.name])] * _list_units(each, model.length) + _compute_offset(each)
            ).tolist()
        )
        for each in list_coordinate_joints(model.mechanism)
    }


@lru_cache(maxsize=8)
def _build_model(robot: Mechanism, length: float) -> PinocchioModel:
    """Return the model of a robot as its file has it: made once for many configurations."""
    return PinocchioModel(robot, length)


def _convert_step(one: PinocchioModel, q: Array, other: PinocchioModel) -> Array:
    """Return the step (nv) from another model's zero configuration at which the R and P that it has too have the values
    of a configuration."""
    at, step = one.difference(one.q0, q), np.zeros(other.nv)
    for name, joint in one.mechanism.joints.items():
        model = other.mechanism.joints.get(name)
        if model is not None and joint.type == model.type and joint.type in COUNTED[:2]:
            zero = (_compute_offset(joint) - _compute_offset(model)) / _list_units(joint, one.length)
            step[other.coordinates[name][0]] = at[one.coordinates[name][0]] + zero[0]
    return step


def _list_units(joint: Joint, length: float) -> Array:
    """Units of the coordinates (m, rad)."""
    if joint.type is JointType.CYLINDRICAL:
        return np.array([length, 1.0])
    return np.full(joint.type.freedoms, length if joint.type.has_translation else 1.0)


def _compute_offset(joint: Joint) -> Array:
    """Coordinates of the file at the zero configuration."""
    return np.zeros(joint.type.freedoms) if joint.offset is None else joint.offset


@dataclass(frozen=True, eq=False, repr=False)
class JointAim(Value):
    """Desired coordinates of a model (by their ``places`` in its velocities), from ``begun`` where a path to them
    starts; characteristic lengths, radians."""

    places: NDArray[np.intp]
    begun: Array
    values: Array

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian."""
        return model.difference(model.q0, q)[self.places] - self.values, np.eye(model.nv)[self.places]

    def towards(self, X: Array, fraction: float) -> JointAim:
        """Return the task at ``fraction`` of the path; the platform's pose X (4, 4) is not used here."""
        return self if fraction == 1 else replace(self, values=self.begun + fraction * (self.values - self.begun))


@dataclass(frozen=True, eq=False, repr=False)
class JointLine(Value):
    """A straight line of independent coordinates (a joint and the number of its ``axes``) by ``reach`` (characteristic
    lengths, radians), with the configurations that small steps reach, in the file's joints, at ``fractions`` of it."""

    axes: tuple[tuple[str, int], ...]
    reach: Array
    fractions: Array
    steps: tuple[ClosedConfiguration, ...]

    def measure_weakest(self, number: int) -> float:
        """Return the smallest singular value of the line's coordinates by the motions of the mechanism at a step."""
        here = self.steps[number]
        places = [here.model.coordinates[joint][axis] for joint, axis in self.axes]
        return float(np.linalg.svd(here.kernel()[0][places], compute_uv=False).min(initial=np.inf))


def track_to_joints(
    start: ClosedConfiguration, motion: PlatformMotion, asked: JointPose, *, within_limits: bool = True
) -> tuple[ClosedConfiguration, JointLine]:
    """Return the configuration with these coordinates that small steps reach from the zero configuration ``start`` on
    its branch, all joints ``within_limits`` or not, and the line; coordinates that depend on others must agree with
    them.

    Raises ``BadRequest`` for unknown joints, their number and values beyond limits, ``PoseReachFailure`` if the path
    ends before, with the joint that stops it."""
    home, name = convert_to_file_joints(start), start.model.mechanism.name
    if home is None:
        raise PoseReachFailure(name, str(asked), 0.0, "", reason="the file's joints do not fit its normal form")
    found, line = _lead(home, motion, _convert_requested(home, asked), asked, within_limits)
    if home is start:
        return found, line
    try:
        at = build_from_link_poses(start.model, found.pose)
        turns = _convert_step(home.model, found.q, start.model) - _convert_step(start.model, at.q, start.model)
        whole = 2 * np.pi * np.round(np.round(turns, 3) / (2 * np.pi))
        return ClosedConfiguration.of(at.model, at.model.integrate(at.q, whole)), line
    except LoopClosureFailure as error:
        raise PoseReachFailure(name, str(asked), 1.0, "", reason=f"in normal form: {error}") from None


def _convert_requested(home: ClosedConfiguration, asked: JointPose) -> dict[str, tuple[float, ...]]:
    """Return the coordinates by name: the requested ones, and those of motors that stay as they are."""
    robot = home.model.mechanism
    joints = {joint.name: joint for joint in list_coordinate_joints(robot, asked.motors)}
    sizes = {name: joint.type.freedoms for name, joint in joints.items()}
    if asked.motors:
        robot.require_motors()
    if not joints:
        raise BadRequest(f"{asked}: {robot.name} has no joint with coordinates", remedy="Use a pose of the platform.")
    given, units = dict(asked.values), dict(asked.units)
    if "" in given:
        flat = [x for _, part in asked.values for x in part]
        if len(flat) != sum(sizes.values()):
            allowed = f"{sum(sizes.values())}: {', '.join(joints)}"
            raise BadRequest(f"{robot.name}: number of {asked.kind}", len(flat), allowed)
        ends = np.cumsum([0, *sizes.values()])
        units = {name: units[str(i)] for name, i in zip(joints, ends, strict=False) if str(i) in units}
        given = {name: tuple(flat[i:j]) for name, i, j in zip(joints, ends, ends[1:], strict=False)}
    for name, values in given.items():
        if name not in joints:
            raise BadRequest(f"{robot.name}: unknown among its {asked.kind} with coordinates", name, [*joints])
        if len(values) != sizes[name]:
            raise BadRequest(
                f"{robot.name}: coordinates of {name}",
                "/".join(map(str, values)),
                "one number" if sizes[name] == 1 else "two numbers, as 0.1/0.2",
            )
        slides = joints[name].type.has_translation
        if units.get(name) == ("deg" if slides else "mm"):
            kind, unit = ("prismatic", "metres or mm") if slides else ("revolute", "radians or deg")
            raise BadRequest(f"{robot.name}: unit of {kind} joint {name}", units[name], unit)
        low, high = robot.filed.get(name, (-np.inf, np.inf))
        if not low - POINT_DISTANCE_TOL <= min(values) <= max(values) <= high + POINT_DISTANCE_TOL:
            told = "/".join(map(str, values))
            raise BadRequest(f"{robot.name}: {name} is beyond its limits", told, f"{low:.6g} to {high:.6g}")
    stay = {name: values for name, values in read_joints(home).items() if asked.motors and name in joints}
    return {**stay, **given}


def _lead(
    home: ClosedConfiguration,
    motion: PlatformMotion,
    wanted: Mapping[str, tuple[float, ...]],
    asked: JointPose,
    within_limits: bool,
) -> tuple[ClosedConfiguration, JointLine]:
    """Follow steps from the zero configuration to coordinates, as many of them at a time as are independent."""
    from scipy.linalg import qr

    model, robot = home.model, home.model.mechanism
    joints = [robot.joints[name] for name in wanted]
    axes = [(joint.name, axis) for joint in joints for axis in range(joint.type.freedoms)]
    places = np.array([i for joint in joints for i in model.coordinates[joint.name]])
    values = np.concatenate(
        [(wanted[each.name] - _compute_offset(each)) / _list_units(each, model.length) for each in joints]
    )
    rows = np.eye(model.nv)[places] @ home.kernel()[0]
    rank = compute_range_basis(rows, 1.0)[1].value
    strengths_at_zero = np.linalg.svd(rows, compute_uv=False)[:rank]
    free = np.sort(qr(rows.T, mode="r", pivoting=True)[1][:rank])
    at_zero = model.difference(model.q0, home.q)
    every = np.array([i for joint in list_coordinate_joints(robot) for i in model.coordinates[joint.name]])
    rest = JointAim(every, at_zero[every], at_zero[every])
    stops = CoordinateIntervals.of(model, home.q)
    before, here, came = stops.margins(model, home.q), home, 0.0

    def past(at: ClosedConfiguration) -> dict[str, float]:
        """Return the joints that are farther beyond their limits than they were, and by how much."""
        margins = stops.margins(model, at.q).items() if within_limits else ()
        return {joint: margin for joint, margin in margins if margin < min(before[joint], 0.0) - POINT_DISTANCE_TOL}

    def refuse(stopped: str) -> PoseReachFailure:
        told = read_joints(here)
        last = ",".join(f"{joint}={format_coordinates(told[joint])}" for joint in wanted)
        way = f"; the robot follows {100 * came:.3g} % of the path from its zero configuration, to {last}" * (came < 1)
        return PoseReachFailure(robot.name, str(asked), came, f"{asked.kind}:{last}", reason=stopped + way)

    goal, steps = values[free], [(0.0, home)]
    pieces = max(1, int(np.ceil(np.linalg.norm(goal - at_zero[places[free]]) / CONTINUATION_STEP_MAX)))
    for number, ends in enumerate(pairwise(np.linspace(at_zero[places[free]], goal, pieces + 1))):
        there, part = track(here, motion, JointAim(places[free], *ends), home=rest)
        if over := past(there):
            raise refuse(f"{min(over, key=lambda joint: over[joint])} is at its limit")
        here, came = there, (number + part) / pieces
        steps.append((came, here))
        if part < 1:
            sides, strengths, _ = np.linalg.svd(np.eye(model.nv)[places[free]] @ here.kernel()[0])
            held, least = axes[free[np.argmax(np.abs(sides[:, -1]))]][0], strengths.min()
            if len(here.strengths) and here.strengths[-1] * strengths_at_zero.min() < least * home.strengths[-1]:
                raise refuse(f"the loops lose rank ahead (smallest singular value {here.strengths[-1]:.2g})")
            raise refuse(f"a singularity lies ahead, at which {held} stops (least singular value {least:.2g})")
    missed = np.abs(model.difference(model.q0, here.q)[places] - values)
    if missed.max() > PRINTED_POSE_TOL:
        joint = axes[int(np.argmax(missed))][0]
        value = format_coordinates(read_joints(here)[joint])
        raise refuse(f"with the other coordinates fixed {joint} is {value}")
    there = find_nearest(here, JointAim(places[free], goal, goal), rest)
    steps[-1] = 1.0, here if past(there) else there
    fractions, passed = zip(*steps, strict=True)
    line = JointLine(tuple(axes[i] for i in free), goal - at_zero[places[free]], np.array(fractions), passed)
    return passed[-1], line


Told = dict[str, float | tuple[float, ...]]
"""Coordinates by joint: a number, or one for each axis."""


@dataclass(frozen=True, repr=False)
class FileCoordinates(Record, all_recorded=True):
    """Coordinates of the file's joints at a configuration (m, rad), relative to its zero: of the actuated ones
    (``motors``) and of the others."""

    motors: Told
    joints: Told
    line: Annotated[
        str | None,
        OPTIONAL,
        "of a pose by motors or joints: proved if their straight line from zero leads here with one continuation",
    ] = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self.motors)} motors, {len(self.joints)} other joints>"

    @classmethod
    def of(cls, at: ClosedConfiguration) -> FileCoordinates:
        """Return those at a configuration."""
        robot = at.model.mechanism.written or at.model.mechanism
        found = {name: each[0] if len(each) == 1 else each for name, each in read_joints(at).items()}
        driven = {name: value for name, value in found.items() if robot.joints[name].is_actuated}
        return cls(driven, {name: value for name, value in found.items() if name not in driven}, at.line)


class OfConfiguration:
    """Result with a configuration, and the coordinates of its joints."""

    configuration: ClosedConfiguration | None

    @property
    @recorded()
    def coordinates(self) -> FileCoordinates | None:
        """Coordinates of the file's joints; None without a configuration."""
        return None if self.configuration is None else FileCoordinates.of(self.configuration)

    @property
    def link_poses(self) -> dict[str, Array] | None:
        """Poses (4, 4) of the file's links in the base frame, metres; None without a configuration, or if the file's
        joints do not fit it."""
        return None if self.configuration is None else collect_link_poses(self.configuration)
