"""The certificate of a complete list of assembly modes (docs/pages/certificates.md).

The engine only proposes: which legs, which solutions. The systems are written anew in rational numbers, circles exactly
round, within one part in 2⁻⁵² of the size of those that were solved; the checker's own equations are made of them, each
solution is refined and enclosed, and the smallest bound that proves the count is looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.measured import MeasuredRobot
from ..analysis.modes.branches import Model
from ..analysis.modes.carried import CarriedPlatform
from ..analysis.modes.carried_modes import solve_carried
from ..analysis.modes.curves import Circle, Curve, Line, Plane, Point, Reach, Sphere, Surface, shifted
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.modes.planar_loops import PlanarLoop, PlanarLoops
from ..analysis.modes.planar_modes import enclosures, excluded
from ..analysis.modes.planar_reading import planar_loops
from ..analysis.modes.quadrics import UNIT, PoseSystem, Rounded, WorkingFrame, direction, spokes
from ..analysis.modes.rigid import Planar, Spatial
from ..analysis.modes.roots import Roots, is_real
from ..analysis.modes.single_loop import SingleLoop, solve_loop
from ..analysis.modes.solve import Solved, SystemModes
from ..analysis.modes.squares import TURNS, SquareSystem
from ..analysis.modes.translating import Articulated, Translating, coplanar, met_normal
from ..analysis.observed import ObservedRobot
from ..errors import NoCertificate, NotConfined, Unsolved
from ..geometry.so3 import quaternions
from ..geometry.vectors import Array, cross, rotation_about, unit
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from ..tolerances import NO_POSE_START
from .bounds import bound
from .chains import chains
from .closures import ClosedRobot, written
from .poses import regular
from .refining import Polynomial, Refining
from .verify_certificate import KINDS, NotAccepted, digest, dot, integral, rational, told, value, verify

RADIUS = Fraction(1, 1 << 80)
"""Radius of the boxes (unknowns of size one)."""
WITHIN = tuple(Fraction(1, 10 ** k) for k in range(13, 5, -1))
"""How far the tips of a pose may be from where its box puts them (sizes): the first that is proved."""


def certificate(found: AssemblyModes) -> dict[str, Any]:
    """The certificate of a list of modes, accepted by the checker; raises ``NoCertificate`` where the list is not
    complete or no bound of the checker proves the count."""
    if found.formation is not None:
        raise NoCertificate(found.setting.robot.name, "the checker knows no formations")
    about = {"robot": found.setting.robot.name, "kind": found.kind, "at": found.pose.to_dict(),
             "observed": [[o.leg, o.link if o.by_segment else o.leg] for o in found.setting.observed]}
    if found.found.complete and not found.found.solved and found.confined is not None:  # a copy: solved again
        found = modes(found.setting, at=found.goal, real=found.kind == "real", as_written=found.confined.as_written)
    robot = ClosedRobot.of(found)
    try:
        system = None if found.model is None else found.model.system
        if found.found.complete and isinstance(system, CarriedPlatform):
            try:
                return of_chain(system, found, about, robot)
            except NotAccepted as reason:
                other = solve_carried if isinstance(system, SingleLoop) else solve_loop
                return _as_chain(found, about, robot, reason, other)
        if found.found.complete and not found.found.solved:
            with suppress(NotConfined):
                return of_loops(found, about, robot)
        try:
            return of_systems(found.found, about, robot)
        except NotAccepted as reason:
            if found.found.solved or not found.found.complete:
                raise
            return _as_chain(found, about, robot, reason, solve_carried, solve_loop)
    except NotAccepted as reason:
        raise NoCertificate(found.setting.robot.name, str(reason)) from None


def of_systems(found: SystemModes, about: Mapping[str, Any], robot: ClosedRobot | None = None) -> dict[str, Any]:
    """The certificate of the modes of systems, with what they are ``about``; raises ``NotAccepted``."""
    if not found.complete:
        raise NotAccepted("the list is not proved complete")
    if not found.solved:
        raise NotAccepted("the list is complete by conditions of kinds that the checker does not know")
    proposed = [_proposed(each, robot) for each in found.solved]
    return _sealed([_system(each, robot) for each in proposed], about, robot,
                   sum(each.roots.complex if each.part.whole else sum(each.kept) for each in found.solved))


def of_loops(found: AssemblyModes, about: Mapping[str, Any], robot: ClosedRobot | None) -> dict[str, Any]:
    """The certificate of the modes of a planar mechanism from its joints; raises ``NotAccepted``, ``NotConfined``."""
    system = None if found.model is None else found.model.system
    if not isinstance(system, PlanarLoops):
        system = planar_loops(_measured(found), found.goal)
    proposed = _closings(system, found.found.complex or 0)
    return _sealed([_system(proposed, robot)], about, robot, found.found.complex or 0)


def of_chain(system: CarriedPlatform, found: AssemblyModes, about: Mapping[str, Any], robot: ClosedRobot | None
             ) -> dict[str, Any]:
    """The certificate of a platform that a leg carries, or of a single loop; raises ``NotAccepted``."""
    assert found.model is not None
    modes_, why = found.found.modes, "no joint of its loop is between its base and its platform"
    frame = WorkingFrame(system.middle.origin, system.rows, system.size, system.rows[2])
    for each in chains(system, [mode.q for mode in modes_]):
        kept = [mode is not None for mode in each.modes]
        if sum(kept) == len(modes_):
            R, p = system.moved(each.home, system.carrying)
            there = [None if k is None else system.moved(modes_[k].q, system.carrying) for k in each.modes]
            poses = [np.empty(0) if to is None else np.column_stack([to[0] @ R.T, to[1] - to[0] @ R.T @ p])
                     for to in there]
            bodies = [None if k is None else found.model.bodies(modes_[k].q) for k in each.modes]
            try:
                return _sealed([_system(_Proposed(each.record, each.starts, poses, kept, bodies, frame), robot)], about,
                               robot, found.found.complex or 0)
            except NotAccepted as reason:
                why = str(reason)
        else:
            why = f"{len(each.starts)} solutions were enclosed, {sum(kept)} of {len(modes_)} modes among them"
    raise NotAccepted(why)


def _as_chain(found: AssemblyModes, about: Mapping[str, Any], robot: ClosedRobot | None, reason: NotAccepted,
              *ways: Callable[[MeasuredRobot, ClosedConfiguration, float], tuple[Model, SystemModes]]
              ) -> dict[str, Any]:
    """Of a mechanism that is a carried platform, or one loop, besides the way in which its modes were listed; raises
    ``NotAccepted``."""
    assert found.model is not None
    for way in ways:
        with suppress(NotConfined, Unsolved, NotAccepted):
            model, listed = way(_measured(found), found.goal, found.model.system.error)
            system = model.system
            if listed.complete and listed.complex == found.found.complex and isinstance(system, CarriedPlatform):
                return of_chain(system, replace(found, model=model, found=listed), about, robot)
    raise reason


def _measured(found: AssemblyModes) -> MeasuredRobot:
    """What the list holds."""
    return MeasuredRobot.driven(found.setting) if found.kind == "real" else MeasuredRobot.watched(found.setting)


def _sealed(systems: list[dict[str, Any]], about: Mapping[str, Any], robot: ClosedRobot | None, count: int
            ) -> dict[str, Any]:
    """A record of systems that have so many complex solutions, accepted."""
    record = {"format": "hrsynth-certificate-1", "claim": "modes", **about,
              "real": sum("pose" in box for each in systems for box in each["boxes"]), "complex": count,
              "systems": systems, **({} if robot is None else {"assembly": robot.record})}
    record["sha256"] = digest(record)
    verify(record)
    return record


def again(record: dict[str, Any], robot: Mechanism) -> dict[str, Any]:
    """The certificate of the same question about a robot; raises ``NoCertificate``, and what ``modes`` raises."""
    parts: dict[str, Any] = {part: tuple(value) if part == "rpy" else value
                             for part, value in record["at"].items() if value is not None}
    at = Pose(**parts)
    real = record["kind"] == "real"
    setting = ObservedRobot.of(robot, None if real else [link for _, link in record["observed"]])
    start = setting.motion.pose(setting.everything.start.pose(setting.motion.link))
    return certificate(modes(setting, at=None if start == at else at, real=real))


@dataclass(frozen=True, eq=False)
class _Proposed:
    """A system in rational numbers without boxes and bound; about where its solutions are, and whether they are real
    (None: too far to be poses); of the real ones the poses (3, 4) as the checker is told them, whether they are modes,
    and the coordinates of the system in which they were found; its working frame."""

    record: dict[str, Any]
    starts: Sequence[tuple[Sequence[complex], bool | None]]
    poses: Sequence[Array]
    kept: Sequence[bool]
    bodies: Sequence[Mapping[str, Array] | None]
    frame: WorkingFrame


def _system(proposed: _Proposed, robot: ClosedRobot | None) -> dict[str, Any]:
    """A system with its boxes and its bound."""
    record, frame = proposed.record, proposed.frame
    equations, halves, points, legs = KINDS[record["kind"]][0](record, rational(record["tips"]))
    equations = [integral(p) for p in equations]
    if len(equations) != len(halves):
        raise NotAccepted(f"{len(equations)} equations in {len(halves)} unknowns")
    real = iter(zip(proposed.poses, proposed.kept, proposed.bodies, strict=True))
    record["boxes"], refining = [], Refining(equations)
    for start, is_real_ in [*proposed.starts, *((each, None) for each in _no_poses(equations, halves))]:
        middle, inverse = refining.box(start, bool(is_real_))
        box = {"middle": written(middle), "radius": str(RADIUS), "inverse": written(inverse)}
        pose, kept, bodies = next(real) if is_real_ else (np.empty(0), False, None)
        if kept:
            box |= _pose(record, box, points, pose)
            at = None if robot is None or bodies is None else robot.at(bodies)
            if robot is not None and at is not None:
                box["links"] = robot.links(at)
                if "places" not in record:
                    tips = [[value(p, middle)[0] / value(w, middle)[0] for p in N]
                            for N, _, w in points[:3 if record["kind"] == "chain" else len(record["tips"])]]
                    record["places"] = robot.places(record.get("bodies", [0] * len(tips)), frame, at, tips,
                                                    record.get("arrows", 0), rational(record.get("hub", ["0"] * 3)))
        elif is_real_ or (legs and is_real_ is not None):
            box["misses"] = _missed(legs, middle)
        record["boxes"].append(box)
    record["bound"] = bound(record, equations, halves)
    return record


def _missed(legs: Any, middle: Any) -> int:
    """The leg that misses most at a solution of the square part."""
    off = [max(sum(map(abs, value(p, middle))) for p in leg) for leg in legs]
    if not off or max(off) < RADIUS:
        raise NotAccepted("a solution that no leg is proved to miss")
    return off.index(max(off))


def _pose(record: dict[str, Any], box: dict[str, Any], points: Any, placed: Array) -> dict[str, Any]:
    """A real pose, and how far it puts tips from where the box does at most (sizes)."""
    m, r, tips = rational(box["middle"]), rational(box["radius"]), rational(record["tips"])
    for within in WITHIN:
        given = {"pose": written([[Fraction(float(x)) for x in row] for row in placed]), "within": str(within)}
        try:
            told(record, given, points, tips, m, r)
        except NotAccepted:
            continue
        return given
    raise NotAccepted("a pose that its box does not put where it was told")


def _proposed(solved: Solved, robot: ClosedRobot | None) -> _Proposed:
    """The solutions of a square part of a system."""
    record, starts, poses = _written(solved)
    frame = solved.part.chart.frame if isinstance(solved.part, PoseSystem) else solved.part.frame
    assert frame is not None
    return _Proposed(record, starts, poses, solved.kept,
                     [None if robot is None else robot.bodies(mode) for mode in solved.modes], _in_space(frame))


def _in_space(frame: WorkingFrame) -> WorkingFrame:
    """A frame of a plane with the plane's normal."""
    return frame if len(frame.R) == 3 else replace(frame, R=np.vstack([frame.R, cross(*frame.R)]))


def _closings(system: PlanarLoops, count: int) -> _Proposed:
    """The closings of a planar mechanism, ``count`` of which fit all that is measured."""
    first, n = system.bodies[0], system.angles
    frame = WorkingFrame(system.goal.pose(first)[:3, 3], np.vstack([system.frame, system.normal]), system.size,
                         system.normal)
    still, ends = (-1, (0,) * n), list[tuple[str, Any, dict[Any, complex]]]()
    for body in system.bodies:
        X, shift = system.goal.pose(body), dict(system.shifts[body])
        shift[still] = shift.get(still, 0j) + complex(*frame.point(X[:3, 3])[:2])
        ends += [(body, end, shift) for end in (
            [(0.0, 0.0), (1.0, 0.0)] if system.point is None else [frame.vector(X[:3, :3] @ system.point)[:2]])]
    first_ends = [each for each in ends if each[0] == first]

    def carried(body: str, end: Any) -> PlanarLoop:
        return PlanarLoop({(-1, system.turns[body]): complex(*end)}, n, system.slides)

    record = {"kind": "loops", "angles": n, "slides": system.slides, "loops": [*map(_vectors, system.loops)],
              "besides": [*map(_vectors, system.besides)], "reaches": [],
              "tips": [[*written(_rounded(end)), "0"] for _, end, _ in first_ends],
              "links": [[list(system.turns[first]), _vectors(PlanarLoop(shift, n, system.slides))]
                        for _, _, shift in first_ends],
              "others": [_vectors(PlanarLoop(shift, n, system.slides)) + _vectors(carried(body, end))
                         for body, end, shift in ends if body != first]}
    boxes = enclosures(system)
    real = [box for box in boxes if box.real]
    q = [np.array([*np.arctan2(x[n:2 * n], x[:n]), *x[2 * n:]]) for x in (box.middle.real for box in real)]
    kept = [not excluded(system, box) for box in real]
    if sum(kept) + (not system.besides) * (len(boxes) - len(real)) != count:
        raise NotAccepted("the closings of the loops are not those of the list")
    poses = [np.column_stack([rotation_about((0.0, 0.0, 1.0), float(np.array(system.turns[first]) @ x[:n])),
                              frame.point(system.pose_of(first, x)[:3, 3])]) for x in q]
    return _Proposed(record, [([*map(complex, box.middle)], box.real) for box in boxes], poses, kept,
                     [system.placed(x) for x in q], frame)


def _vectors(loop: PlanarLoop) -> list[Any]:
    """The vectors of a sum, each along a slide or none (-1), and by how much of each angle it turns."""
    return [[written(_rounded([a.real, a.imag])), k, list(e)] for (k, e), a in loop.terms.items()]


def _planar(solved: Solved) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
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
        return [written(_rounded([sign * a.real, sign * a.imag])), slide,
                [int(k == angle) for k in range(1 + len(circles))]]

    def tip(k: int, sign: int = 1) -> list[Any]:
        found = [vector(centres[k], sign=sign)]
        if k in circles:
            found.append(vector(spokes_[k], angle=1 + circles.index(k), sign=sign))
        return found + ([vector(spokes_[k], slide=lines.index(k), sign=sign)] if k in lines else [])

    centres = [complex(*frame.point(each.centre)) for each in reaches]
    spokes_ = [each.radius / frame.size + 0j if isinstance(each, Circle) else complex(*(frame.R @ each.direction))
               if isinstance(each, Line) else 0j for each in reaches]
    others = [k for k in range(len(system.curves)) if k not in part.legs]
    start = next((k for k in range(len(reaches)) if k not in lines), 0)  # loops with fewer slides have lower degrees
    record = {"kind": "loops", "angles": 1 + len(circles), "slides": len(lines), "besides": [], "others": [],
              "loops": [[*tip(k), *tip(start, -1), vector(arms[start] - arms[k], angle=0)] for k in range(len(reaches))
                        if k != start],
              "links": [[[1] + [0] * len(circles), [*tip(0), vector(-arms[0], angle=0)]]] * len(tips),
              "tips": [[*written(_rounded(tips[k])), "0"] for k in (*others, *part.legs)],
              "reaches": [{kind: [[*x, "0"] for x in vectors]} for k in others
                          for kind, vectors in _reach(system.curves[k], frame, 0.0).items()]}
    values, real = _starts(solved.roots)
    starts = []
    for each in values:
        known = iter(zip(each, turns, strict=False))
        ends = [frame.point(np.asarray(reaches[k].centre, dtype=complex)) if isinstance(reaches[k], Point) else
                frame.point(_at(reaches[k], frame, turn, t)) for k in (0, 1) for t, turn in
                ([(0j, 0.0)] if isinstance(reaches[k], Point) else [next(known)])]
        z = [(x + 1j * y, x - 1j * y) for x, y in ends]
        arm = arms[1] - arms[0]
        u = (z[1][0] - z[0][0]) / arm, (z[1][1] - z[0][1]) / arm.conjugate()
        z += [(z[0][0] + u[0] * (b - arms[0]), z[0][1] + u[1] * (b - arms[0]).conjugate()) for b in arms[2:]]
        way = [((x - c) / a, (y - c.conjugate()) / a.conjugate()) if a else (0j, 0j)
               for (x, y), c, a in zip(z, centres, spokes_, strict=True)]
        both = [u, *(way[k] for k in circles)]
        starts.append([*((x + y) / 2 for x, y in both), *((x - y) / 2j for x, y in both),
                       *(sum(way[k]) / 2 for k in lines)])
    plane = np.eye(4)[[0, 1, 3]]
    poses = [plane.T[:3] @ np.vstack([_placed(mode.pose, frame, 2), [0, 0, 1]]) @ plane + np.diag([0, 0, 1.0, 0])[:3]
             for mode in solved.modes]
    return record, list(zip(starts, real, strict=True)), poses


def _written(solved: Solved) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
    """A system in rational numbers without boxes and bound; about where its solutions are, and whether they are real;
    the real ones' poses, as the checker is told them."""
    system, part, roots = solved.system, solved.part, solved.roots
    if isinstance(part, PoseSystem):
        return _pose_system(solved)
    if not part.unknowns or part.frame is None:
        raise NotAccepted("tips at rest leave one pose: there is nothing to enclose")
    frame, turns = part.frame, part.turns(roots.turn)
    values, real = _starts(roots)
    if isinstance(system, Planar):
        return _planar(solved)
    if isinstance(system, Spatial):
        legs = [*part.legs, *(k for k in range(len(system.curves)) if k not in part.legs)]
        origins = iter(turns)
        curves = [system.curves[k] for k in legs]
        record = {"kind": "spatial",
                  "reaches": [_reach(each, frame, 0.0 if isinstance(each, Point | Surface) else
                                                         next(origins, 0.0)) for each in curves],
                  "tips": written(_rounded(system.tips[legs] / frame.size)), "square": len(part.legs)}
        return record, list(zip(values, real, strict=True)), [_placed(mode.pose, frame, 3) for mode in solved.modes]
    assert isinstance(system, Translating | Articulated)
    if isinstance(system, Translating):
        record, starts = _translating(system, part, frame, turns, values)
    else:
        record, starts = _articulated(system, part, frame, turns, values)
    origin = _middle(part, system) if isinstance(system, Articulated) else frame.origin
    record |= {"kind": "shifting", "square": len(record["reaches"])}
    if not part.whole:  # then all legs are told, and what is solved first
        bodies = [0] * len(system.paths) if isinstance(system, Translating) else system.bodies
        paths = [shifted(each, frame.origin - origin) for each in system.paths]
        record["reaches"] = [*record["reaches"], *(_reach(each, frame, 0.0) for each in paths)]
        record["bodies"] = [*record["bodies"], *bodies]
    record["tips"] = [["0"] * 3] * len(record["reaches"])
    return record, list(zip(starts, real, strict=True)), [_shifted(mode.pose, frame, origin) for mode in solved.modes]


def _starts(roots: Roots) -> tuple[list[list[complex]], list[bool | None]]:
    """About where the solutions are, and which of them are real; None for those that are too far to be poses."""
    return ([[complex(v) for v in each] for each in (*roots.values, *roots.distant)],
            [*map(is_real, roots.values), *(None for _ in roots.distant)])


def _placed(X: Array, frame: WorkingFrame, d: int) -> Array:
    """A pose in working coordinates, (d, d + 1); d = 2 in a plane."""
    return np.column_stack([frame.R @ X[:3, :d], frame.point(X[:3, 3])])


def _shifted(X: Array, frame: WorkingFrame, origin: Array) -> Array:
    """The pose of a body that does not turn, counted from an origin, in working coordinates (3, 4)."""
    return np.column_stack([np.eye(3), frame.vector(X[:3, 3] - origin)])


def _pose_system(solved: Solved) -> tuple[dict[str, Any], list[tuple[list[complex], bool | None]], list[Array]]:
    """As :func:`_written`, for tips on surfaces too, solved for in the pose's own coordinates."""
    system, part = solved.system, solved.part
    assert isinstance(part, PoseSystem)
    if not part.whole or sum(system.forbids[k] for k in part.legs) != system.freedoms:
        raise NotAccepted("tips on surfaces, more than needed")
    frame, (values, real) = part.chart.frame, _starts(solved.roots)
    if isinstance(system, Spatial) and part.chart.study is not None:
        record = {"kind": "pose", "reaches": [_reach(system.curves[k], frame, 0.0) for k in part.legs],
                  "tips": written(_rounded(system.tips[list(part.legs)] / frame.size)),
                  "arrows": sum(k >= len(system.points) for k in part.legs),
                  "hub": written(_rounded(frame.point(system.hub))),
                  "chart": [[str(round(x)) for x in row] for row in part.chart.study[:4, :4]]}
        poses = [_placed(mode.pose, frame, 3) for mode in solved.modes]
        return *regular(record, list(zip(values, real, strict=True))), poses
    if not isinstance(system, Articulated):
        raise NotAccepted("tips on surfaces of another platform than the checker knows")
    turn = TURNS[0]
    record = {"kind": "shifting", "reaches": [_reach(system.paths[k], frame, turn) for k in part.legs],
              "bodies": [system.bodies[k] for k in part.legs], "square": len(part.legs),
              "slide": _reach(system.slide, replace(frame, origin=np.zeros(3)), turn),
              "tips": [["0"] * 3] * len(part.legs)}
    c, s = math.cos(turn), math.sin(turn)
    starts = values if isinstance(system.slide, Line) else [
        [*x[:3], (x[4] * c - x[3] * s) / (1.0 + x[3] * c + x[4] * s)] for x in values]
    return (record, list(zip(starts, real, strict=True)),
            [_shifted(mode.pose, frame, frame.origin) for mode in solved.modes])


def _translating(system: Translating, part: SquareSystem, frame: WorkingFrame, turns: Sequence[float],
                 values: Sequence[list[complex]]) -> tuple[dict[str, Any], list[list[complex]]]:
    """The position of the platform, of which every path is a place: a curve and what it meets, or three surfaces."""
    curve = part.unknowns[0]
    chosen: list[Reach] = [system.paths[k] for k in part.legs]
    if len(chosen) == 2:
        chosen = [curve, _met(curve, next(each for each in chosen if each is not curve), system.size)]
    starts = [list(frame.point(_at(curve, frame, turns[0], t[0]))) for t in values]
    return {"reaches": [_reach(each, frame, turns[0]) for each in chosen], "bodies": [0] * len(chosen)}, starts


def _articulated(system: Articulated, part: SquareSystem, frame: WorkingFrame, turns: Sequence[float],
                 values: Sequence[list[complex]]) -> tuple[dict[str, Any], list[list[complex]]]:
    """The first body's position, counted from the middle of the two paths, and the slide's half-angle tangent."""
    middle = _middle(part, system)
    paths = [shifted(system.paths[k], -middle) for k in part.legs]
    bodies = [system.bodies[k] for k in part.legs]
    starts = []
    for t in values:
        tip = paths[0].at(0.0) if isinstance(paths[0], Point) else _at(paths[0], frame, turns[0], t[0])
        slid = _at(system.slide, frame, turns[-1 if len(t) > 1 else 0], t[-1])
        starts.append([*frame.vector(tip - slid if bodies[0] else tip), t[-1]])
    slide = _reach(system.slide, replace(frame, origin=np.zeros(3)), turns[len(part.unknowns) - 1])
    return {"reaches": [_reach(each, frame, turns[0]) for each in paths], "bodies": bodies, "slide": slide}, starts


def _middle(part: SquareSystem, system: Articulated) -> Array:
    one, other = (system.paths[k].centre for k in part.legs)
    return np.asarray((one + other) / 2)


def _met(curve: Curve, other: Reach, size: float) -> Reach:
    """The surface that a curve is met with: of a curve of its plane its sphere, or a plane through it."""
    if isinstance(other, Circle) and coplanar(curve, other, size):
        return Sphere(other.centre, other.radius)
    return other if isinstance(other, Sphere | Plane) else Plane(other.centre, met_normal(curve, other))


def _at(curve: Reach, frame: WorkingFrame, turn: float, t: complex) -> Any:
    """The point (3,) of a curve at an unknown, complex ones too."""
    assert isinstance(curve, Line | Circle)
    return curve.at(2.0 * np.arctan(t) + turn if isinstance(curve, Circle) else frame.size * t)  # type: ignore[arg-type]


def _reach(reach: Reach, frame: WorkingFrame, turn: float) -> dict[str, Any]:
    """A curve or surface in rational working coordinates (sizes)."""
    centre = _rounded(frame.point(reach.centre))
    if isinstance(reach, Sphere):
        radius = _rounded(reach.radius / frame.size)
        return {"sphere": written([centre, [radius * radius]])}
    if isinstance(reach, Circle):
        return {"circle": written([centre, *_spokes(reach, frame, turn)])}
    rest = [] if isinstance(reach, Point) else [reach.direction if isinstance(reach, Line) else reach.normal]
    exact = [[Fraction(int(x), UNIT) for x in direction(each, frame, Rounded)] for each in rest]
    return {type(reach).__name__.lower(): written([centre, *exact])}


def _spokes(circle: Circle, frame: WorkingFrame, turn: float) -> list[list[Fraction]]:
    """Two spokes of a circle, exactly normal to each other and of one length: those of a rational rotation."""
    given = spokes(circle, frame, turn, Rounded)
    a, b = ([Fraction(int(x), UNIT) for x in each] for each in given)
    if len(a) == 2 or dot(a, b) == 0 == dot(a, a) - dot(b, b):
        return [a, b]
    first, second = unit(given[0].astype(float)), unit(given[1].astype(float))
    w, x, y, z = (Fraction(round(float(c) * UNIT)) for c in quaternions(np.column_stack(
        [first, second, cross(first, second)])))
    s = _rounded(circle.radius / frame.size) / (w * w + x * x + y * y + z * z)
    return [[s * (w * w + x * x - y * y - z * z), 2 * s * (x * y + w * z), 2 * s * (x * z - w * y)],
            [2 * s * (x * y - w * z), s * (w * w - x * x + y * y - z * z), 2 * s * (y * z + w * x)]]


def _no_poses(equations: Sequence[Polynomial], halves: Sequence[bool]) -> list[list[complex]]:
    """About the solutions of two equations at which the tangent of half an angle is i or −i: they are no poses."""
    if len(halves) != 2:
        return []
    found: list[list[complex]] = []
    for k, at in ((k, at) for k in (0, 1) if halves[k] for at in (1j, -1j)):
        rows = []
        for p in equations:
            size = max(map(abs, p.values()))
            row = np.zeros(max(e[1 - k] for e in p) + 1, dtype=complex)
            for e, c in p.items():
                row[e[1 - k]] += c / size * at ** e[k]
            rows.append(row)
        for y in np.roots(rows[0][::-1]):
            x = [at, y] if k == 0 else [y, at]
            new = all(abs(np.subtract(x, z)).max() > NO_POSE_START for z in found)
            if new and abs(np.polyval(rows[1][::-1], y)) < NO_POSE_START:
                found.append(x)
    return found


def _rounded(x: Any) -> Any:
    """Numbers to one part in 2⁻⁵², as fractions."""
    if np.ndim(x) == 0:
        return Fraction(round(float(x) * UNIT), UNIT)
    return [_rounded(each) for each in x]
