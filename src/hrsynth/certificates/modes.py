"""The certificate of a complete list of assembly modes (docs/pages/certificates.md).

The engine only proposes: which legs, which solutions. The systems are written anew in rational numbers, circles exactly
round, within one part in 2⁻⁵² of the size of those that were solved; the checker's own equations are made of them, each
solution is refined and enclosed, and the smallest bound that proves the count is looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from ..analysis.measured import MeasuredRobot
from ..analysis.modes.modes import AssemblyModes, modes
from ..analysis.modes.natural_modes import NaturalPlatform, solve_natural
from ..analysis.observed import ObservedRobot
from ..errors import ExternalSolverFailure, NoCertificate, TooLarge, UnsupportedLocus
from ..geometry.vectors import Array
from ..kinematics.goal_error import drift
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from ..solving.platform.solve import SystemModes
from . import verify_solutions
from .bounds import bound
from .closures import ClosedRobot, write_numbers
from .proposed import ProposedRecord
from .refining import Polynomial, ScaledEquations
from .solution_records import build_record
from .system_records import propose
from .verify_certificate import KINDS, CertificateRejection, digest, integral, rational, told, value, verify
from .verify_solutions import SolutionsRejection

EXTRANEOUS_START_TOL = 1e-6
"""Residual of extraneous starts, and distance between two of them (both relative)."""

RADIUS = Fraction(1, 1 << 80)
"""Radius of the boxes (unknowns of size one)."""
WITHIN = tuple(Fraction(1, 10**k) for k in range(13, 5, -1))
"""How far the tips of a pose may be from where its box puts them (sizes): the first that is proved."""


def certificate(found: AssemblyModes) -> dict[str, Any]:
    """The certificate of a list of modes, accepted by the checker; raises ``NoCertificate`` where the list is not
    complete or no bound of the checker proves the count."""
    if found.formation is not None:
        raise NoCertificate(found.setup.robot.name, "the checker does not support formations")
    about = {
        "robot": found.setup.robot.name,
        "kind": found.kind,
        "at": found.pose.to_dict(),
        "observed": [[o.leg, o.link if o.is_segment_direction else o.leg] for o in found.setup.observed],
        "within": found.within,
    }
    if found.found.complete and not found.found.solved and found.confined is not None:  # a copy: solved again
        found = modes(found.setup, at=found.goal, real=found.kind == "real", as_written=found.confined.as_written)
    if found.found.complete and found.model is not None and isinstance(found.model.system, NaturalPlatform):
        return build_solutions_certificate(found, found.model.system, about)
    robot = ClosedRobot.of(found)
    try:
        return of_systems(found.found, about, robot)
    except CertificateRejection as reason:
        if found.found.complete and (natural := _list_again(found)) is not None:
            assert natural.model is not None
            assert isinstance(natural.model.system, NaturalPlatform)
            return build_solutions_certificate(natural, natural.model.system, about | {"within": natural.within})
        raise NoCertificate(found.setup.robot.name, str(reason)) from None


def _list_again(found: AssemblyModes) -> AssemblyModes | None:
    """Return a list in natural coordinates; None where that has not as many modes."""
    measured, goal = MeasuredRobot.of(found.setup, found.kind == "real"), found.goal
    for keeps in (False, True):
        with suppress(UnsupportedLocus, ExternalSolverFailure, TooLarge):
            error = drift(goal, None, found.setup.normal.moved)
            model, listed = solve_natural(measured, goal, error, keeps=keeps)
            if len(listed.modes) == len(found.modes) + len(found.antipodal):
                return replace(found, model=model, found=listed)
    return None


def build_solutions_certificate(
    found: AssemblyModes, system: NaturalPlatform, about: Mapping[str, Any]
) -> dict[str, Any]:
    """The certificate of a list in natural coordinates; raises ``NoCertificate``."""
    assert found.model is not None
    goal = found.model.home
    listed = sorted((mode.q for mode in found.found.modes), key=lambda x: float(np.abs(x - goal).max(initial=0.0)))
    record = {"format": "hrsynth-certificate-1", "claim": "solutions", **about, **build_record(system, listed)}
    record["sha256"] = digest(record)
    try:
        verify_solutions.verify(record)
    except SolutionsRejection as reason:
        raise NoCertificate(found.setup.robot.name, str(reason)) from None
    return record


def of_systems(found: SystemModes, about: Mapping[str, Any], robot: ClosedRobot | None = None) -> dict[str, Any]:
    """The certificate of the modes of systems, with what they are ``about``; raises ``CertificateRejection``."""
    if not found.complete:
        raise CertificateRejection("the list is not proved complete")
    if not found.solved:
        raise CertificateRejection("the list is complete by conditions of kinds that the checker does not support")
    proposed = [propose(each, robot) for each in found.solved]
    return _seal(
        [_system(each, robot) for each in proposed],
        about,
        robot,
        sum(each.roots.complex if each.part.whole else sum(each.kept) for each in found.solved),
    )


def _seal(
    systems: list[dict[str, Any]], about: Mapping[str, Any], robot: ClosedRobot | None, count: int
) -> dict[str, Any]:
    """A record of systems that have so many complex solutions, accepted."""
    record = {
        "format": "hrsynth-certificate-1",
        "claim": "modes",
        **about,
        "real": sum("pose" in box for each in systems for box in each["boxes"]),
        "complex": count,
        "systems": systems,
        **({} if robot is None else {"assembly": robot.record}),
    }
    record["sha256"] = digest(record)
    verify(record)
    return record


def again(record: dict[str, Any], robot: Mechanism) -> dict[str, Any]:
    """Return the certificate of the same claim about a robot; raises ``NoCertificate``, and what ``modes`` raises."""
    parts: dict[str, Any] = {
        part: tuple(value) if part == "rpy" else value for part, value in record["at"].items() if value is not None
    }
    at = Pose(**parts)
    real = record["kind"] == "real"
    setup = ObservedRobot.of(robot, None if real else [link for _, link in record["observed"]], driven=real)
    start = setup.motion.pose(setup.all_samples.start.pose(setup.motion.link))
    return certificate(modes(setup, at=None if start == at else at, real=real))


def _system(proposed: ProposedRecord, robot: ClosedRobot | None) -> dict[str, Any]:
    """A system with its boxes and its bound."""
    record, frame = proposed.record, proposed.frame
    equations, halves, points, legs = KINDS[record["kind"]][0](record, rational(record["tips"]))
    equations = [integral(p) for p in equations]
    if len(equations) != len(halves):
        raise CertificateRejection(f"{len(equations)} equations in {len(halves)} unknowns")
    real = iter(zip(proposed.poses, proposed.kept, proposed.bodies, strict=True))
    record["boxes"], refining = [], ScaledEquations(equations)
    for start, is_real_ in [*proposed.starts, *((each, None) for each in _no_poses(equations, halves))]:
        middle, inverse = refining.box(start, bool(is_real_))
        box = {"middle": write_numbers(middle), "radius": str(RADIUS), "inverse": write_numbers(inverse)}
        pose, kept, bodies = next(real) if is_real_ else (np.empty(0), False, None)
        if kept:
            box |= _pose(record, box, points, pose)
            at = None if robot is None or bodies is None else robot.at(bodies)
            if robot is not None and at is not None:
                box["links"] = robot.links(at)
                if "places" not in record:
                    tips = [[value(p, middle)[0] / value(w, middle)[0] for p in N] for N, _, w in points]
                    record["places"] = robot.places(
                        record.get("bodies", [0] * len(tips)),
                        frame,
                        at,
                        tips,
                        record.get("arrows", 0),
                        rational(record.get("hub", ["0"] * 3)),
                    )
        elif is_real_ or (legs and is_real_ is not None):
            box["misses"] = _worst_leg(legs, middle)
        record["boxes"].append(box)
    record["bound"] = bound(record, equations, halves)
    return record


def _worst_leg(legs: Any, middle: Any) -> int:
    """The leg that misses most at a solution of the square part."""
    off = [max(sum(map(abs, value(p, middle))) for p in leg) for leg in legs]
    if not off or max(off) < RADIUS:
        raise CertificateRejection("a solution that is not proved to miss a leg")
    return off.index(max(off))


def _pose(record: dict[str, Any], box: dict[str, Any], points: Any, placed: Array) -> dict[str, Any]:
    """A real pose, and how far it puts tips from where the box does at most (sizes)."""
    m, r, tips = rational(box["middle"]), rational(box["radius"]), rational(record["tips"])
    for within in WITHIN:
        given = {"pose": write_numbers([[Fraction(float(x)) for x in row] for row in placed]), "within": str(within)}
        try:
            told(record, given, points, tips, m, r)
        except CertificateRejection:
            continue
        return given
    raise CertificateRejection("a pose that is not where its box puts it")


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
            new = all(abs(np.subtract(x, z)).max() > EXTRANEOUS_START_TOL for z in found)
            if new and abs(np.polyval(rows[1][::-1], y)) < EXTRANEOUS_START_TOL:
                found.append(x)
    return found
