"""Systems on poses as the checker reads them, with approximate solutions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..geometry.loci import Circle, Curve, Line, Plane, Point, Reach, Sphere, Surface, shift_reach
from ..geometry.vectors import Array
from ..solving.platform.quadrics import PoseSystem, WorkingFrame
from ..solving.platform.rigid import Planar, Spatial
from ..solving.platform.solve import SquareSolution
from ..solving.platform.square_systems import TURNS, SquareSystem
from ..solving.platform.translating import ArticulatedPlatform, TranslatingPlatform, find_met_normal, is_coplanar
from .closures import ClosedRobot, round_numbers, write_numbers
from .poses import regular
from .proposed import ProposedRecord, placed_in, starts_of
from .reach_records import point_on, reach_record
from .verify_certificate import CertificateRejection


def propose(solved: SquareSolution, robot: ClosedRobot | None) -> ProposedRecord:
    """The solutions of a square part of a system."""
    record, starts, poses = _write_system(solved)
    frame = solved.part.chart.frame if isinstance(solved.part, PoseSystem) else solved.part.frame
    assert frame is not None
    return ProposedRecord(
        record,
        starts,
        poses,
        solved.kept,
        [None if robot is None else robot.bodies(mode) for mode in solved.modes],
        frame,
    )


def _write_system(
    solved: SquareSolution,
) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
    """System in rational numbers without boxes and bound; approximate solutions, and whether they are real; the real
    ones' poses, as the checker reads them."""
    system, part, roots = solved.system, solved.part, solved.roots
    if isinstance(part, PoseSystem):
        return _pose_system(solved)
    if not part.unknowns or part.frame is None:
        raise CertificateRejection("fixed tips leave one pose: there is nothing to enclose")
    frame, turns = part.frame, part.turns(roots.turn)
    values, real = starts_of(roots)
    if isinstance(system, Planar):
        raise CertificateRejection("no equations for planar platforms")
    if isinstance(system, Spatial):
        legs = [*part.legs, *(k for k in range(len(system.curves)) if k not in part.legs)]
        origins = iter(turns)
        curves = [system.curves[k] for k in legs]
        record = {
            "kind": "spatial",
            "reaches": [
                reach_record(each, frame, 0.0 if isinstance(each, Point | Surface) else next(origins, 0.0))
                for each in curves
            ],
            "tips": write_numbers(round_numbers(system.tips[legs] / frame.size)),
            "square": len(part.legs),
        }
        return record, list(zip(values, real, strict=True)), [placed_in(mode.pose, frame, 3) for mode in solved.modes]
    assert isinstance(system, TranslatingPlatform | ArticulatedPlatform)
    if isinstance(system, TranslatingPlatform):
        record, starts = _translating(system, part, frame, turns, values)
    else:
        record, starts = _write_articulated(system, part, frame, turns, values)
    origin = _middle(part, system) if isinstance(system, ArticulatedPlatform) else frame.origin
    record |= {"kind": "shifting", "square": len(record["reaches"])}
    if not part.whole:  # then all legs are used, and what is solved first
        bodies = [0] * len(system.paths) if isinstance(system, TranslatingPlatform) else system.bodies
        paths = [shift_reach(each, frame.origin - origin) for each in system.paths]
        record["reaches"] = [*record["reaches"], *(reach_record(each, frame, 0.0) for each in paths)]
        record["bodies"] = [*record["bodies"], *bodies]
    record["tips"] = [["0"] * 3] * len(record["reaches"])
    poses = [_shift_pose(mode.pose, frame, origin) for mode in solved.modes]
    return record, list(zip(starts, real, strict=True)), poses


def _shift_pose(X: Array, frame: WorkingFrame, origin: Array) -> Array:
    """The pose of a body that does not turn, counted from an origin, in working coordinates (3, 4)."""
    return np.column_stack([np.eye(3), frame.vector(X[:3, 3] - origin)])


def _pose_system(solved: SquareSolution) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
    """As :func:`_write_system`, for tips on surfaces too, solved for in the pose's own coordinates."""
    system, part = solved.system, solved.part
    assert isinstance(part, PoseSystem)
    if not part.whole or sum(system.forbids[k] for k in part.legs) != system.freedoms:
        raise CertificateRejection("tips on surfaces, with redundant observation")
    frame, (values, real) = part.chart.frame, starts_of(solved.roots)
    if isinstance(system, Spatial) and part.chart.study is not None:
        record = {
            "kind": "pose",
            "reaches": [reach_record(system.curves[k], frame, 0.0) for k in part.legs],
            "tips": write_numbers(round_numbers(system.tips[list(part.legs)] / frame.size)),
            "arrows": sum(k >= len(system.points) for k in part.legs),
            "hub": write_numbers(round_numbers(frame.point(system.hub))),
            "chart": [[str(round(x)) for x in row] for row in part.chart.study[:4, :4]],
        }
        poses = [placed_in(mode.pose, frame, 3) for mode in solved.modes]
        return *regular(record, list(zip(values, real, strict=True))), poses
    if not isinstance(system, ArticulatedPlatform):
        raise CertificateRejection("tips on surfaces of a platform that the checker does not support")
    turn = TURNS[0]
    record = {
        "kind": "shifting",
        "reaches": [reach_record(system.paths[k], frame, turn) for k in part.legs],
        "bodies": [system.bodies[k] for k in part.legs],
        "square": len(part.legs),
        "slide": reach_record(system.slide, replace(frame, origin=np.zeros(3)), turn),
        "tips": [["0"] * 3] * len(part.legs),
    }
    c, s = math.cos(turn), math.sin(turn)
    starts = (
        values
        if isinstance(system.slide, Line)
        else [[*x[:3], (x[4] * c - x[3] * s) / (1.0 + x[3] * c + x[4] * s)] for x in values]
    )
    return (
        record,
        list(zip(starts, real, strict=True)),
        [_shift_pose(mode.pose, frame, frame.origin) for mode in solved.modes],
    )


def _translating(
    system: TranslatingPlatform,
    part: SquareSystem,
    frame: WorkingFrame,
    turns: Sequence[float],
    values: Sequence[list[complex]],
) -> tuple[dict[str, Any], list[list[complex]]]:
    """The position of the platform, of which every path is a place: a curve and what it meets, or three surfaces."""
    curve = part.unknowns[0]
    chosen: list[Reach] = [system.paths[k] for k in part.legs]
    if len(chosen) == 2:
        chosen = [curve, _meeting_surface(curve, next(each for each in chosen if each is not curve), system.size)]
    starts = [list(frame.point(point_on(curve, frame, turns[0], t[0]))) for t in values]
    return {"reaches": [reach_record(each, frame, turns[0]) for each in chosen], "bodies": [0] * len(chosen)}, starts


def _write_articulated(
    system: ArticulatedPlatform,
    part: SquareSystem,
    frame: WorkingFrame,
    turns: Sequence[float],
    values: Sequence[list[complex]],
) -> tuple[dict[str, Any], list[list[complex]]]:
    """The first body's position, counted from the middle of the two paths, and the slide's half-angle tangent."""
    middle = _middle(part, system)
    paths = [shift_reach(system.paths[k], -middle) for k in part.legs]
    bodies = [system.bodies[k] for k in part.legs]
    starts = []
    for t in values:
        tip = paths[0].at(0.0) if isinstance(paths[0], Point) else point_on(paths[0], frame, turns[0], t[0])
        slid = point_on(system.slide, frame, turns[-1 if len(t) > 1 else 0], t[-1])
        starts.append([*frame.vector(tip - slid if bodies[0] else tip), t[-1]])
    slide = reach_record(system.slide, replace(frame, origin=np.zeros(3)), turns[len(part.unknowns) - 1])
    reaches = [reach_record(each, frame, turns[0]) for each in paths]
    return {"reaches": reaches, "bodies": bodies, "slide": slide}, starts


def _middle(part: SquareSystem, system: ArticulatedPlatform) -> Array:
    one, other = (system.paths[k].centre for k in part.legs)
    return np.asarray((one + other) / 2)


def _meeting_surface(curve: Curve, other: Reach, size: float) -> Reach:
    """The surface that a curve is met with: of a curve of its plane its sphere, or a plane through it."""
    if isinstance(other, Circle) and is_coplanar(curve, other, size):
        return Sphere(other.centre, other.radius)
    return other if isinstance(other, Sphere | Plane) else Plane(other.centre, find_met_normal(curve, other))
