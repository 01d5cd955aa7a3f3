"""Planar loops as the checker reads them, with approximate solutions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..analysis.modes.loci import Circle, Line, Point
from ..analysis.modes.planar_loops import PlanarLoop, PlanarLoops
from ..analysis.modes.planar_modes import enclosures, is_excluded
from ..analysis.modes.quadrics import WorkingFrame
from ..analysis.modes.solve import SquareSolution
from ..analysis.modes.square_systems import SquareSystem
from ..geometry.vectors import Array, cross, rotate_about_axis
from .closures import round_numbers, write_numbers
from .proposed import ProposedRecord, placed_in, starts_of
from .reach_records import point_on, reach_record
from .verify_certificate import CertificateRejection


def in_space(frame: WorkingFrame) -> WorkingFrame:
    """A frame of a plane with the plane's normal."""
    return frame if len(frame.R) == 3 else replace(frame, R=np.vstack([frame.R, cross(*frame.R)]))


def closings(system: PlanarLoops, count: int) -> ProposedRecord:
    """The closings of a planar mechanism, ``count`` of which fit all that is measured."""
    first, n = system.bodies[0], system.angles
    frame = WorkingFrame(
        system.goal.pose(first)[:3, 3], np.vstack([system.frame, system.normal]), system.size, system.normal
    )
    still, ends = (-1, (0,) * n), list[tuple[str, Any, dict[Any, complex]]]()
    for body in system.bodies:
        X, shift = system.goal.pose(body), dict(system.shifts[body])
        shift[still] = shift.get(still, 0j) + complex(*frame.point(X[:3, 3])[:2])
        ends += [
            (body, end, shift)
            for end in (
                [(0.0, 0.0), (1.0, 0.0)] if system.point is None else [frame.vector(X[:3, :3] @ system.point)[:2]]
            )
        ]
    first_ends = [each for each in ends if each[0] == first]

    def carried(body: str, end: Any) -> PlanarLoop:
        return PlanarLoop({(-1, system.turns[body]): complex(*end)}, n, system.slides)

    record = {
        "kind": "loops",
        "angles": n,
        "slides": system.slides,
        "loops": [*map(_vectors, system.loops)],
        "besides": [*map(_vectors, system.besides)],
        "reaches": [],
        "tips": [[*write_numbers(round_numbers(end)), "0"] for _, end, _ in first_ends],
        "links": [
            [list(system.turns[first]), _vectors(PlanarLoop(shift, n, system.slides))] for _, _, shift in first_ends
        ],
        "others": [
            _vectors(PlanarLoop(shift, n, system.slides)) + _vectors(carried(body, end))
            for body, end, shift in ends
            if body != first
        ],
    }
    boxes = enclosures(system)
    real = [box for box in boxes if box.real]
    q = [np.array([*np.arctan2(x[n : 2 * n], x[:n]), *x[2 * n :]]) for x in (box.middle.real for box in real)]
    kept = [not is_excluded(system, box) for box in real]
    if sum(kept) + (not system.besides) * (len(boxes) - len(real)) != count:
        raise CertificateRejection("the solutions of the loops are not those of the list")
    poses = [
        np.column_stack(
            [
                rotate_about_axis((0.0, 0.0, 1.0), float(np.array(system.turns[first]) @ x[:n])),
                frame.point(system.pose_of(first, x)[:3, 3]),
            ]
        )
        for x in q
    ]
    return ProposedRecord(
        record,
        [([*map(complex, box.middle)], box.real) for box in boxes],
        poses,
        kept,
        [system.body_poses(x) for x in q],
        frame,
    )


def _vectors(loop: PlanarLoop) -> list[Any]:
    """The vectors of a sum, each along a slide or none (-1), and by how much of each angle it turns."""
    return [[write_numbers(round_numbers([a.real, a.imag])), k, list(e)] for (k, e), a in loop.terms.items()]


def planar_system(
    solved: SquareSolution,
) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
    """A platform in a plane as loops: of the first leg's tip, the platform and another leg's tip. The angles are the
    platform's and those of spokes of circles, the slides are along lines."""
    system, part = solved.system, solved.part
    assert isinstance(part, SquareSystem)
    assert part.frame is not None
    frame, turns, tips = part.frame, part.turns(solved.roots.turn), solved.system.tips / part.frame.size
    reaches = [system.curves[k] for k in part.legs]
    circles, lines = ([k for k, each in enumerate(reaches) if isinstance(each, kind)] for kind in (Circle, Line))
    arms = [complex(*tips[k]) for k in part.legs]

    def vector(a: complex, slide: int = -1, angle: int = -1, sign: int = 1) -> list[Any]:
        return [
            write_numbers(round_numbers([sign * a.real, sign * a.imag])),
            slide,
            [int(k == angle) for k in range(1 + len(circles))],
        ]

    def tip(k: int, sign: int = 1) -> list[Any]:
        found = [vector(centres[k], sign=sign)]
        if k in circles:
            found.append(vector(spokes_[k], angle=1 + circles.index(k), sign=sign))
        return found + ([vector(spokes_[k], slide=lines.index(k), sign=sign)] if k in lines else [])

    centres = [complex(*frame.point(each.centre)) for each in reaches]
    spokes_ = [
        each.radius / frame.size + 0j
        if isinstance(each, Circle)
        else complex(*(frame.R @ each.direction))
        if isinstance(each, Line)
        else 0j
        for each in reaches
    ]
    others = [k for k in range(len(system.curves)) if k not in part.legs]
    start = next((k for k in range(len(reaches)) if k not in lines), 0)  # loops with fewer slides have lower degrees
    record = {
        "kind": "loops",
        "angles": 1 + len(circles),
        "slides": len(lines),
        "besides": [],
        "others": [],
        "loops": [
            [*tip(k), *tip(start, -1), vector(arms[start] - arms[k], angle=0)]
            for k in range(len(reaches))
            if k != start
        ],
        "links": [[[1] + [0] * len(circles), [*tip(0), vector(-arms[0], angle=0)]]] * len(tips),
        "tips": [[*write_numbers(round_numbers(tips[k])), "0"] for k in (*others, *part.legs)],
        "reaches": [
            {kind: [[*x, "0"] for x in vectors]}
            for k in others
            for kind, vectors in reach_record(system.curves[k], frame, 0.0).items()
        ],
    }
    values, real = starts_of(solved.roots)
    starts = []
    for each in values:
        known = iter(zip(each, turns, strict=False))
        ends = [
            frame.point(np.asarray(reaches[k].centre, dtype=complex))
            if isinstance(reaches[k], Point)
            else frame.point(point_on(reaches[k], frame, turn, t))
            for k in (0, 1)
            for t, turn in ([(0j, 0.0)] if isinstance(reaches[k], Point) else [next(known)])
        ]
        z = [(x + 1j * y, x - 1j * y) for x, y in ends]
        arm = arms[1] - arms[0]
        u = (z[1][0] - z[0][0]) / arm, (z[1][1] - z[0][1]) / arm.conjugate()
        z += [(z[0][0] + u[0] * (b - arms[0]), z[0][1] + u[1] * (b - arms[0]).conjugate()) for b in arms[2:]]
        way = [
            ((x - c) / a, (y - c.conjugate()) / a.conjugate()) if a else (0j, 0j)
            for (x, y), c, a in zip(z, centres, spokes_, strict=True)
        ]
        both = [u, *(way[k] for k in circles)]
        starts.append(
            [*((x + y) / 2 for x, y in both), *((x - y) / 2j for x, y in both), *(sum(way[k]) / 2 for k in lines)]
        )
    plane = np.eye(4)[[0, 1, 3]]
    poses = [
        plane.T[:3] @ np.vstack([placed_in(mode.pose, frame, 2), [0, 0, 1]]) @ plane + np.diag([0, 0, 1.0, 0])[:3]
        for mode in solved.modes
    ]
    return record, list(zip(starts, real, strict=True)), poses
