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
    found, reason = list[CarriedPlatform](), "no leg of R and P carries its platform"
    for leg in decomposition.legs:
        try:
            freedoms, told = _list_carriers(measured, leg, rest, goal, middle)
            moved = 0.0
            for other in decomposition.legs:
                if other is not leg:
                    branches, off = list_leg_conditions(decomposition, other, rest, goal, middle)
                    if len(branches) > 1:
                        raise UnsupportedLocus(name, f"leg {other.label} has {len(branches)} solutions")
                    told += [(c, len(freedoms)) for c in branches[0]]
                    moved += off
        except UnsupportedLocus as refused:
            reason = refused.reason
            continue
        told += [(c, len(freedoms)) for c in list_plane_conditions(seen, middle, False)]
        rows, turns, alike, off = _snap_exactly(freedoms, [c for c, _ in told])
        asked = [CarriedCondition.of(c, turns[:joints]) for c, (_, joints) in zip(alike, told, strict=True)]
        moved += middle.size * (off + max((each.moved for each in asked), default=0.0))
        error_ = error + MOVED_AXIS_LEVER_MAX * moved + max([0.0, *(sight.error(error, goal) for sight in seen)])
        each = CarriedPlatform(
            (), np.zeros((0, 3)), turns, tuple(asked), middle, goal.pose(body), seen=seen, error=error_, rows=rows
        )
        off_ = each.values(each.home, asked)[0] if asked and turns else np.zeros(0)
        if turns and np.abs(off_).max(initial=0.0) <= RELATION_ANGLE_TOL and each.square:
            found.append(each)
        else:
            reason = "the conditions of its legs do not determine isolated poses"
    if not found:
        raise UnsupportedLocus(name, reason)
    return min(found, key=lambda each: each.most(each.square))


def _snap_exactly(
    freedoms: Sequence[Turn], conditions: Sequence[PoseCondition]
) -> tuple[Array, tuple[Turn, ...], list[PoseCondition], float]:
    """Turns and conditions in rows along the first axes, so that what is parallel, at right angles, in one point or on
    one axis is so exactly, as ranks want it; and how far that moves anything (sizes)."""
    moved, turns, rows = CHAIN_ROUNDING, list[Turn](), _build_rows([each.axis for each in freedoms])

    def near(v: Array, others: Iterable[Array], within: float) -> Array:
        nonlocal moved
        found = next((other for other in others if float(np.linalg.norm(v - other)) <= within), v)
        off = float(np.linalg.norm(found - v))
        moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
        return found

    def direction(v: Array, known: Sequence[Array] = (), within: float = POINT_DISTANCE_TOL / RANK_GAP_MIN) -> Array:
        flat = np.where(np.abs(v) <= within, 0.0, v)
        flat = np.sign(flat) if np.count_nonzero(flat) == 1 and abs(abs(flat.sum()) - 1.0) <= within else flat
        return near(near(v, [flat], within), [s * other for other in known for s in (1.0, -1.0)], within)

    for each in freedoms:
        a, o = direction(rows @ each.axis, [other.axis for other in turns], DIRECTION_SINE_TOL), rows @ each.point
        for k, other in enumerate(turns if not each.slides else ()):
            far = float(np.linalg.norm(np.cross(other.point - o, a)))
            at = (
                None
                if other.slides
                else other.point
                if far <= POINT_DISTANCE_TOL / RANK_GAP_MIN
                else lines.find_meeting_point([(o, a), (other.point, other.axis)], POINT_DISTANCE_TOL / RANK_GAP_MIN)
            )
            if at is not None:
                off = max(float(np.linalg.norm(np.cross(p - at, b))) for p, b in ((o, a), (other.point, other.axis)))
                moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
                turns[k], o = replace(other, point=at), at
                break
        turns.append(Turn(a, o, each.slides))
    found, points, arrows = list[PoseCondition](), [each.point for each in turns], [each.axis for each in turns]
    for c in conditions:
        told: dict[str, Any] = {}
        for name in (each for each in "bo" if hasattr(c, each)):
            told[name] = near(rows @ getattr(c, name), points, POINT_DISTANCE_TOL / RANK_GAP_MIN)
            points.append(told[name])
        for name in (each for each in "candmt" if hasattr(c, each)):
            told[name] = direction(rows @ getattr(c, name), arrows)
        found.append(replace(c, **told))
    return rows, tuple(turns), found, moved


def _build_rows(axes: Sequence[Array]) -> Array:
    """A frame (3, 3), its third row along the first axis, its second at right angles to the first other one."""
    if not axes:
        return np.eye(3)
    z = axes[0]
    other = next(
        (each for each in axes if np.linalg.norm(np.cross(z, each)) > DIRECTION_SINE_TOL), find_perpendicular(z)
    )
    y = normalise_vector(np.cross(z, other))
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
    found = list[Turn]()
    for axis in () if joint.name in held else axes if joint.predecessor == at else axes[::-1]:
        a, o = axis / np.linalg.norm(axis), middle.point(point)
        found += [Turn(a, o, False)] * (turns[joint.type] > 0) + [Turn(a, o, True)] * joint.type.has_translation
    return found


def _list_carriers(
    measured: MeasuredRobot, leg: Leg, rest: ObservationModel, goal: ClosedConfiguration, middle: OriginAndUnit
) -> tuple[tuple[Turn, ...], list[tuple[PoseCondition, int]]]:
    """Return the unlocked joints of a leg, from the base, and its observations, with the number of joints that carry
    each."""
    decomposition, mechanism = measured.setup.decomposition, measured.setup.decomposition.mechanism
    own = [each for each in rest.observations if each.leg == leg.label]
    held = [each.joint for each in own if isinstance(each, Encoder)]
    if decomposition.is_free_body(leg):
        raise UnsupportedLocus(mechanism.name, "no leg carries the platform, which is a free body")
    path, at, found, links = decomposition.path(leg), mechanism.base, list[Turn](), {mechanism.base: 0}
    if set(leg.joints) - {name for edge in path for name in edge.joints}:
        raise UnsupportedLocus(mechanism.name, f"leg {leg.label} has loops")
    for edge in path:
        if len(edge.joints) > 1:
            raise UnsupportedLocus(mechanism.name, f"leg {leg.label} is not one of R and P")
        found += list_freedoms(mechanism.joints[edge.joints[0]], at, goal, middle, held)
        at = edge.other(at)
        links[at] = len(found)
    told, none = list[tuple[PoseCondition, int]](), np.zeros(3)
    for each in own:
        if isinstance(each, Encoder) and each.joint in leg.joints:
            continue
        if (
            not isinstance(each, Direction)
            or each.link not in links
            or (each.seen_from or rest.reference) != mechanism.base
        ):
            raise UnsupportedLocus(
                mechanism.name, f"the observation of leg {leg.label} is not a direction from the base"
            )
        d = goal.pose(each.link)[:3, :3] @ each.direction
        told += [
            (AtAngle(leg.label, none, d, e, h), links[each.link])
            for e, h in zip((*build_plane_axes(d), d), (0.0, 0.0, 1.0), strict=True)
            if links[each.link]
        ]
    return tuple(found), told
