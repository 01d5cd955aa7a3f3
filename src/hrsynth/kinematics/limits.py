"""Limits of joints, and of spherical joints that stand for several R (:mod:`.mechanism.tilt_limit`): tests of a
configuration, and the proof that every solution of a leg is beyond them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import lines
from ..geometry.balls import Field, enclose_around
from ..geometry.vectors import Array, dot
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.tilt_limit import TiltLimit
from ..tolerances import GEOMETRY_DIFFERENCE_TOL, POINT_DISTANCE_TOL, REACH_BALL_RADIUS_FRACTION
from .configuration import ClosedConfiguration
from .leg_paths import MotionFactor
from .pinocchio_model import PinocchioModel

SINGLE = (JointType.REVOLUTE, JointType.PRISMATIC)
"""Joints with one coordinate that may have limits."""
TILT_LIMIT_END_TOL_RAD = 1e-2
"""Angle (rad) from the end of a tilt limit within which it is named where a path ends."""


@dataclass(frozen=True, eq=False)
class CoordinateIntervals:
    """Limits of the coordinates of a robot that moves on from a configuration: of each coordinate with limits the
    interval (m, rad). Rotations are not counted modulo 2π along the path, but at its start: a coordinate beyond the
    limits that a whole turn brings between them is taken as that one."""

    spans: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, model: PinocchioModel, q: Array) -> CoordinateIntervals:
        """Return the intervals of a path that begins at q."""
        stops, joints, spans = model.mechanism.stops, model.mechanism.joints, dict[str, tuple[float, float]]()
        for name, value in list_limited_coordinates(model, q).items():
            joint, _, *span = stops[name]
            spans[name] = (span[0], span[1]) if joints[joint].type.has_translation else _shift_interval(value, *span)
        return cls(spans)

    def margins(self, model: PinocchioModel, q: Array) -> dict[str, float]:
        """Return the distance of each joint, and of each tilt limit, from the nearer limit (m, rad); negative beyond
        it."""
        found = {
            name: min(value - lower, upper - value)
            for name, value in list_limited_coordinates(model, q).items()
            for lower, upper in (self.spans[name],)
        }
        return found | compute_tilt_margins(model, q)


def _shift_interval(value: float, lower: float, upper: float) -> tuple[float, float]:
    """Return the interval of a rotation, shifted by the whole turns that bring it nearest to a value; by none if it
    contains it."""
    if lower - POINT_DISTANCE_TOL <= value <= upper + POINT_DISTANCE_TOL:
        return lower, upper
    turn = 2 * np.pi
    beyond = turn * np.floor((value - lower) / turn) if np.isfinite(lower) else turn * np.ceil((value - upper) / turn)
    shifts = (beyond, beyond + turn) if np.isfinite(lower) else (beyond, beyond - turn)
    shift = float(max(shifts, key=lambda shift: min(value - lower - shift, upper + shift - value)))
    return lower + shift, upper + shift


def list_limited_coordinates(model: PinocchioModel, q: Array) -> dict[str, float]:
    """Return the coordinate (m, rad) of each R or P that has limits, by the name that it has in the file."""
    step, joints = model.difference(model.q0, q), model.mechanism.joints
    return {
        name: float(step[model.coordinates[joint][place]])
        * (model.length if joints[joint].type.has_translation else 1.0)
        for name, (joint, place, *_) in model.mechanism.stops.items()
        if joint in model.coordinates and (joints[joint].type in SINGLE or joints[joint].turns)
    }


def compute_tilt_margins(model: PinocchioModel, q: Array) -> dict[str, float]:
    """Return the distance of each tilt from the nearer end of its interval (rad); negative beyond it."""
    return {
        name: _move_tilt_limit(model, q, name, wrist).margin() for name, wrist in model.mechanism.tilt_limits.items()
    }


def find_flat_tilts(model: PinocchioModel, q: Array) -> dict[str, float]:
    """Return the spherical joints that stand for several R whose axes are nearly in a plane, where they rotate in two
    ways only, and their angle from it (rad)."""
    every = {
        name: _move_tilt_limit(model, q, name, joint.wrist).flatness()
        for name, joint in model.mechanism.joints.items()
        if joint.wrist is not None
    }
    return {name: flatness for name, flatness in every.items() if flatness < TILT_LIMIT_END_TOL_RAD}


def _move_tilt_limit(model: PinocchioModel, q: Array, name: str, wrist: TiltLimit) -> TiltLimit:
    mechanism = model.mechanism
    return wrist.carried(
        *(model.pose(q, link)[:3, :3] @ mechanism.links[link].pose[:3, :3].T for link in mechanism.joints[name].links)
    )


def list_tilts_beyond(model: PinocchioModel, q: Array) -> list[str]:
    """Return the tilt limits that exclude the rotation of their joint."""
    return [name for name, margin in compute_tilt_margins(model, q).items() if margin < -POINT_DISTANCE_TOL]


def list_joints_beyond(model: PinocchioModel, q: Array, joints: Sequence[str] | None = None) -> list[str]:
    """Return the joints (default: of all), rotating or translating about one axis, whose coordinates are outside their
    limits (rotations modulo 2π), and the tilt limits that are exceeded."""
    mechanism = model.mechanism
    joints = [*mechanism.joints] if joints is None else joints
    return [name for name in list_tilts_beyond(model, q) if name in joints] + [
        name
        for name, value in list_limited_coordinates(model, q).items()
        if mechanism.stops[name].joint in joints and is_excluded(mechanism, name, value, value)
    ]


def has_limits(mechanism: Mechanism) -> bool:
    """Return True if a joint has limits."""
    return bool(mechanism.stops or mechanism.tilt_limits)


def is_within_limits(at: ClosedConfiguration) -> bool:
    """Return True if no joint is beyond its limits; without limits, always."""
    return not list_joints_beyond(at.model, at.q)


def mark_beyond_limits(configurations: Sequence[ClosedConfiguration | None]) -> NDArray[np.bool_] | None:
    """Return the mask of configurations with joints beyond their limits, false where there is none; None without
    limits."""
    first = next((at for at in configurations if at is not None), None)
    if first is None or not has_limits(first.model.mechanism):
        return None
    return np.array([at is not None and not is_within_limits(at) for at in configurations])


def is_proved_outside(model: PinocchioModel, q: Array, bodies: Iterable[str], within: float) -> bool:
    """Return True if a joint has one value only, up to whole turns, and is beyond its limits: it joins two of these
    links, whose poses are known to ``within`` (characteristic lengths, radians), or links that two parallel R join to
    them."""
    mechanism, within = model.mechanism, max(within, REACH_BALL_RADIUS_FRACTION)
    doubts = dict.fromkeys(bodies, (within * model.length, within))

    def doubt(joint: Joint, link: str) -> float:
        """Return the error of a joint's centre on a link (m)."""
        shift, turn = doubts[link]
        return shift + turn * float(np.linalg.norm(mechanism.links[link].pose[:3, 3] - joint.point))

    for link in mechanism.links.keys() - doubts.keys():
        hinges = [
            joint
            for joint in mechanism.joints_of(link)
            if joint.type is JointType.REVOLUTE and joint.other(link) in doubts
        ]
        for one, other in combinations(hinges, 2):
            apart = lines.measure_line_distance(other.point, one.point, one.axis)
            if lines.is_parallel(one.axis, other.axis) and apart > POINT_DISTANCE_TOL * model.length:
                ends = [doubt(joint, joint.other(link)) for joint in (one, other)]
                turn = 2 * sum(ends) / apart + doubts[one.other(link)][1]
                arm = float(np.linalg.norm(mechanism.links[link].pose[:3, 3] - one.point))
                doubts[link] = ends[0] + turn * arm, turn
    for name, value in list_limited_coordinates(model, q).items():
        joint = mechanism.joints[mechanism.stops[name].joint]
        if all(link in doubts for link in joint.links):
            turn = sum(doubts[link][1] for link in joint.links)
            error = (
                sum(doubt(joint, link) for link in joint.links) + turn * abs(value)
                if joint.type.has_translation
                else turn
            )
            if is_excluded(mechanism, name, value - error, value + error):
                return True
    return False


def is_excluded(mechanism: Mechanism, joint: str, low: float, high: float) -> bool:
    """Return True if no coordinate from ``low`` to ``high`` is within a joint's limits, rotations modulo 2π."""
    if joint not in mechanism.stops:
        return False
    stop = mechanism.stops[joint]
    lower, upper = stop.lower - POINT_DISTANCE_TOL, stop.upper + POINT_DISTANCE_TOL
    if mechanism.joints[stop.joint].type.has_translation:
        return high < lower or low > upper
    # the smallest turn 2πk that brings ``high`` to the lower limit must take ``low`` beyond the upper one
    turns = np.ceil((lower - high) / (2 * np.pi)) if np.isfinite(lower) else -np.inf
    return bool(low + 2 * np.pi * turns > upper)


def is_every_value_excluded(mechanism: Mechanism, joint: str, values: Sequence[Any]) -> bool:
    """Return True if all values of a list, as balls, are outside a joint's limits."""
    return all(
        value.is_finite() and is_excluded(mechanism, joint, float(value.lower()), float(value.upper()))
        for value in values
    )


def find_tilt_at_end(at: ClosedConfiguration) -> str | None:
    """Return the tilt limit nearest to an end of its interval, if it is there."""
    name, margin = min(compute_tilt_margins(at.model, at.q).items(), key=lambda item: item[1], default=(None, np.inf))
    return name if margin < TILT_LIMIT_END_TOL_RAD else None


def is_tilt_excluded(
    way: Sequence[MotionFactor], values: Mapping[str, Sequence[Any]], D: Array, within: float, alone: bool
) -> bool:
    """Return True if the tilt limit on a path is exceeded in all solutions, as balls: of every other part that rotates
    all ``values`` are known, in one order if the path is ``alone``, and it ends displaced by D (4, 4), each number
    known to ``within``."""
    parts = [part for part in way if not part.slides]
    places = [i for i, part in enumerate(parts) if part.limit is not None]
    if len(places) != 1 or any(part.joint not in values for part in parts if part.limit is None):
        return False
    before, wrist, after = parts[: places[0]], parts[places[0]].limit, parts[places[0] + 1 :]
    assert wrist is not None
    end = enclose_around(D[:3, :3], max(within, REACH_BALL_RADIUS_FRACTION))
    lists = [values[str(part.joint)] for part in (*before, *after)]
    closures = zip(*lists, strict=True) if alone and lists else product(*lists)
    return all(
        _is_beyond_tilt_limit(wrist, _enclose_tilt_cosine(wrist, before, after, turns, end)) for turns in closures
    )


def _enclose_tilt_cosine(
    wrist: TiltLimit, before: Sequence[MotionFactor], after: Sequence[MotionFactor], turns: Sequence[Any], end: Field
) -> Any:
    """Return E_1 … E_k first · D E_n⁻¹ … E_l⁻¹ last, for the parts before and after the tilted joint rotated by
    ``turns``."""
    first, last = (enclose_around(axis, GEOMETRY_DIFFERENCE_TOL) for axis in (wrist.first, wrist.last))
    for part, q in reversed(list(zip(before, turns, strict=False))):
        first = part.rotated(first, q)
    for part, q in zip(after, turns[len(before) :], strict=True):
        last = part.rotated(last, -q)
    return dot(first, dot(end, last))[()]


def _is_beyond_tilt_limit(wrist: TiltLimit, cosine: Any) -> bool:
    """Return True if a tilt limit is exceeded, by a ball of the cosine."""
    return bool(
        (wrist.upper is not None and cosine < np.cos(wrist.upper) - POINT_DISTANCE_TOL)
        or (wrist.lower is not None and cosine > np.cos(wrist.lower) + POINT_DISTANCE_TOL)
    )
