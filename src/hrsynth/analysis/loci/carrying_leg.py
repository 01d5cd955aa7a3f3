"""Leg that carries a platform, and the conditions of other legs and sensors on it, read from a robot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import UnsupportedLocus
from ...geometry import lines
from ...geometry.vectors import Array, build_plane_axes, find_perpendicular, normalise_vector
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.locked_twists import carry_joint
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Direction, Joint, JointType
from ...mechanism.legs import Leg
from ...mechanism.observations.encoder import Encoder
from ...solving.platform.pose_conditions import AtAngle, PoseCondition
from ...tolerances import (
    CHAIN_ROUNDING,
    DIRECTION_SINE_TOL,
    MOVED_AXIS_LEVER_MAX,
    POINT_DISTANCE_TOL,
    RANK_GAP_MIN,
    RELATION_ANGLE_TOL,
)
from ..measured import MeasuredRobot
from .carrying_leg_system import CarriedCondition, CarriedPlatform, Turn
from .leg_conditions import OriginAndUnit, list_leg_conditions, require_rigid_platform
from .observation_loci import list_plane_conditions, separate_sights


def build_carried_platform(measured: MeasuredRobot, goal: ClosedConfiguration, error: float) -> CarriedPlatform:
    """Return the platform on the leg that gives the fewest zeros. Raises ``UnsupportedLocus`` if none carries it, or if
    the conditions of the others are not known."""
    decomposition, name = measured.setup.decomposition, measured.setup.robot.name
    body, middle = require_rigid_platform(measured, goal)
    rest, seen = separate_sights(decomposition, measured.observation_model, goal)
    platforms, reason = list[CarriedPlatform](), "no leg of R and P carries its platform"
    for leg in decomposition.legs:
        try:
            freedoms, carried = _list_carriers(measured, leg, rest, goal, middle)
            moved = 0.0
            for second in decomposition.legs:
                if second is not leg:
                    branches, off = list_leg_conditions(decomposition, second, rest, goal, middle)
                    if len(branches) > 1:
                        raise UnsupportedLocus(name, f"leg {second.label} has {len(branches)} solutions")
                    carried += [(c, len(freedoms)) for c in branches[0]]
                    moved += off
        except UnsupportedLocus as refused:
            reason = refused.reason
            continue
        carried += [(c, len(freedoms)) for c in list_plane_conditions(seen, middle, False)]
        rows, turns, alike, off = _snap_exactly(freedoms, [c for c, _ in carried])
        asked = [CarriedCondition.of(c, turns[:joints]) for c, (_, joints) in zip(alike, carried, strict=True)]
        moved += middle.size * (off + max((read.moved for read in asked), default=0.0))
        error_ = error + MOVED_AXIS_LEVER_MAX * moved + max([0.0, *(sight.error(error, goal) for sight in seen)])
        platform = CarriedPlatform(
            (), np.zeros((0, 3)), turns, tuple(asked), middle, goal.pose(body), seen=seen, error=error_, rows=rows
        )
        off_ = platform.values(platform.home, asked)[0] if asked and turns else np.zeros(0)
        if turns and np.abs(off_).max(initial=0.0) <= RELATION_ANGLE_TOL and platform.square:
            platforms.append(platform)
        else:
            reason = "the conditions of its legs do not determine isolated poses"
    if not platforms:
        raise UnsupportedLocus(name, reason)
    return min(platforms, key=lambda platform: platform.most(platform.square))


def _snap_exactly(
    freedoms: Sequence[Turn], conditions: Sequence[PoseCondition]
) -> tuple[Array, tuple[Turn, ...], list[PoseCondition], float]:
    """Turns and conditions in rows along the first axes, so that what is parallel, at right angles, in one point or on
    one axis is so exactly, as ranks want it; and how far that moves anything (sizes)."""
    moved, turns, rows = CHAIN_ROUNDING, list[Turn](), _build_rows([freedom.axis for freedom in freedoms])

    def near(v: Array, others: Iterable[Array], within: float) -> Array:
        nonlocal moved
        nearest = next((known for known in others if float(np.linalg.norm(v - known)) <= within), v)
        off = float(np.linalg.norm(nearest - v))
        moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
        return nearest

    def direction(v: Array, known: Sequence[Array] = (), within: float = POINT_DISTANCE_TOL / RANK_GAP_MIN) -> Array:
        flat = np.where(np.abs(v) <= within, 0.0, v)
        flat = np.sign(flat) if np.count_nonzero(flat) == 1 and abs(abs(flat.sum()) - 1.0) <= within else flat
        return near(near(v, [flat], within), [s * axis for axis in known for s in (1.0, -1.0)], within)

    for freedom in freedoms:
        a, o = direction(rows @ freedom.axis, [turn.axis for turn in turns], DIRECTION_SINE_TOL), rows @ freedom.point
        for k, turn in enumerate(turns if not freedom.slides else ()):
            far = float(np.linalg.norm(np.cross(turn.point - o, a)))
            at = (
                None
                if turn.slides
                else turn.point
                if far <= POINT_DISTANCE_TOL / RANK_GAP_MIN
                else lines.find_meeting_point([(o, a), (turn.point, turn.axis)], POINT_DISTANCE_TOL / RANK_GAP_MIN)
            )
            if at is not None:
                off = max(float(np.linalg.norm(np.cross(p - at, b))) for p, b in ((o, a), (turn.point, turn.axis)))
                moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
                turns[k], o = replace(turn, point=at), at
                break
        turns.append(Turn(a, o, freedom.slides))
    snapped, points, arrows = list[PoseCondition](), [turn.point for turn in turns], [turn.axis for turn in turns]
    for c in conditions:
        changes: dict[str, Any] = {}
        for name in (field for field in "bo" if hasattr(c, field)):
            changes[name] = near(rows @ getattr(c, name), points, POINT_DISTANCE_TOL / RANK_GAP_MIN)
            points.append(changes[name])
        for name in (field for field in "candmt" if hasattr(c, field)):
            changes[name] = direction(rows @ getattr(c, name), arrows)
        snapped.append(replace(c, **changes))
    return rows, tuple(turns), snapped, moved


def _build_rows(axes: Sequence[Array]) -> Array:
    """A frame (3, 3), its third row along the first axis, its second at right angles to the first other one."""
    if not axes:
        return np.eye(3)
    z = axes[0]
    second = next(
        (axis for axis in axes if np.linalg.norm(np.cross(z, axis)) > DIRECTION_SINE_TOL), find_perpendicular(z)
    )
    y = normalise_vector(np.cross(z, second))
    return np.stack([np.cross(y, z), y, z])


def list_freedoms(
    joint: Joint, at: str, goal: ClosedConfiguration, middle: OriginAndUnit, held: Sequence[str]
) -> list[Turn]:
    """Return the unlocked axes of a joint of R and P, seen from a link, none if it is ``held``. Raises
    ``UnsupportedLocus``."""
    turns = {JointType.REVOLUTE: 1, JointType.UNIVERSAL: 2, JointType.CYLINDRICAL: 1, JointType.PRISMATIC: 0}
    if joint.type not in turns or held.count(joint.name) not in (0, joint.type.freedoms):
        raise UnsupportedLocus(goal.model.mechanism.name, f"joint {joint.name} is not R or P")
    point, axes = carry_joint(goal.model.mechanism, joint, goal.pose)
    freedoms = list[Turn]()
    for axis in () if joint.name in held else axes if joint.predecessor == at else axes[::-1]:
        a, o = axis / np.linalg.norm(axis), middle.point(point)
        freedoms += [Turn(a, o, False)] * (turns[joint.type] > 0) + [Turn(a, o, True)] * joint.type.has_translation
    return freedoms


def _list_carriers(
    measured: MeasuredRobot, leg: Leg, rest: ObservationModel, goal: ClosedConfiguration, middle: OriginAndUnit
) -> tuple[tuple[Turn, ...], list[tuple[PoseCondition, int]]]:
    """Return the unlocked joints of a leg, from the base, and its observations, with the number of joints that carry
    each."""
    decomposition, mechanism = measured.setup.decomposition, measured.setup.decomposition.mechanism
    observed = [observation for observation in rest.observations if observation.leg == leg.label]
    held = [observation.joint for observation in observed if isinstance(observation, Encoder)]
    if decomposition.is_free_body(leg):
        raise UnsupportedLocus(mechanism.name, "no leg carries the platform, which is a free body")
    path, at, turns, links = decomposition.path(leg), mechanism.base, list[Turn](), {mechanism.base: 0}
    if set(leg.joints) - {name for edge in path for name in edge.joints}:
        raise UnsupportedLocus(mechanism.name, f"leg {leg.label} has loops")
    for edge in path:
        if len(edge.joints) > 1:
            raise UnsupportedLocus(mechanism.name, f"leg {leg.label} is not one of R and P")
        turns += list_freedoms(mechanism.joints[edge.joints[0]], at, goal, middle, held)
        at = edge.other(at)
        links[at] = len(turns)
    carried, none = list[tuple[PoseCondition, int]](), np.zeros(3)
    for observation in observed:
        if isinstance(observation, Encoder) and observation.joint in leg.joints:
            continue
        if (
            not isinstance(observation, Direction)
            or observation.link not in links
            or (observation.seen_from or rest.reference) != mechanism.base
        ):
            raise UnsupportedLocus(
                mechanism.name, f"the observation of leg {leg.label} is not a direction from the base"
            )
        d = goal.pose(observation.link)[:3, :3] @ observation.direction
        carried += [
            (AtAngle(leg.label, none, d, e, h), links[observation.link])
            for e, h in zip((*build_plane_axes(d), d), (0.0, 0.0, 1.0), strict=True)
            if links[observation.link]
        ]
    return tuple(turns), carried
