"""Errors of the package, one class per situation, with the facts as data.

Messages: a defect of a file, a request that cannot be served, a sound request without a result; each with a remedy.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple


class HrsynthError(Exception):
    """Base of all errors of this package; ``exit_status`` is the exit status of the command line."""

    exit_status = 2
    file: str | None = None
    """Robot file that caused the error, unless the message names it."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the message instead of the constructor arguments, so that workers can return errors."""
        return _restore_error, (type(self), self.args), self.__dict__

    def lines(self) -> list[str]:
        """Return one line per defect, without the program's name."""
        text = " ".join(str(self).split())
        return [text if self.file is None else f"{self.file}: {text}"]


def _restore_error(kind: type[HrsynthError], args: tuple[Any, ...]) -> HrsynthError:
    """Make an error of a class without calling its constructor."""
    return kind.__new__(kind, *args)


def warn_caller(text: str, kind: type[Warning]) -> None:
    """Warn at the line outside of this package that called it."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "hrsynth":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, kind, stacklevel=level)


class AssumedBase(UserWarning):
    """Warning that a file does not determine the base; names the link that is assumed."""


class AssumedPlatform(UserWarning):
    """Warning that a file names no platform; names the link that is assumed."""


def compose_message(problem: str, got: str | None, expected: str | None, remedy: str = "") -> str:
    """Return one line: ``problem: got X, expected Y. Remedy.``; parts that are empty are left out."""
    facts = ", ".join([f"got {got}"] * (got is not None) + [f"expected {expected}"] * bool(expected))
    text = f"{problem}: {facts}" if facts else problem
    return " ".join(f"{text.removesuffix('.')}. {remedy}".split()) if remedy else " ".join(text.split())


@dataclass(frozen=True)
class Defect:
    """Defect of a file: line, problem, the value found there, what is expected, what to do."""

    file: str
    line: int | None
    problem: str
    got: str | None = None
    expected: str | None = None
    remedy: str = ""

    def __str__(self) -> str:
        where = self.file if self.line is None else f"{self.file}:{self.line}"
        return " ".join(f"{where}: {self.text}".split())

    @property
    def text(self) -> str:
        """Message without file and line."""
        return compose_message(self.problem, self.got, self.expected, self.remedy)


class BadRobotFile(HrsynthError):
    """Robot file with defects, listed once each in the order of their lines."""

    def __init__(self, defects: Iterable[Defect]) -> None:
        self.defects = tuple(sorted(dict.fromkeys(defects), key=lambda d: (d.line is None, d.line or 0)))
        super().__init__("; ".join(map(str, self.defects)))

    def lines(self) -> list[str]:
        return [str(defect) for defect in self.defects]


def shorten_text(text: str, length: int = 200) -> str:
    """Return a text on one line, cut off at ``length`` characters."""
    line = " ".join(text.split())
    return line if len(line) <= length else line[: length - 1] + "…"


class BadRequest(HrsynthError):
    """Request that cannot be served as it is given.

    Parameters
    ----------
    problem
        Option or argument, and what is wrong with it: ``--plane z=3: the platform cannot move along z``.
    got
        Value that was given.
    expected
        Values that are possible.
    remedy
        Next step, a sentence: ``Use x, y or phi.``
    """

    def __init__(
        self, problem: str, got: object = None, expected: str | Sequence[str] | None = None, *, remedy: str = ""
    ) -> None:
        self.problem, self.got, self.remedy = problem, got, remedy
        self.expected = expected if expected is None or isinstance(expected, str) else ", ".join(expected)
        shown = None if got is None else shorten_text(repr(got))
        super().__init__(compose_message(problem, shown, self.expected, remedy))


class NoPlatform(BadRequest):
    """Analysis that needs a platform, for a robot whose file names none and has several candidates."""


class NoSegment(BadRequest):
    """Leg without a segment whose direction can be observed: one joint, or links of length zero."""


class FileTooLarge(BadRequest):
    """File larger than the limit (bytes)."""

    def __init__(self, name: str, most: int) -> None:
        self.name, self.most = name, most
        super().__init__(f"{name}: file larger than {most / 1e6:g} MB", remedy="Reduce its meshes.")


class BadMechanism(BadRequest):
    """Mechanism with contradictory parts, such as a joint of an unknown link or an axis of length zero."""


class UndefinedValue(BadRequest):
    """Observation without a value at a configuration: a camera inside the observed cylinder, or at the observed
    point."""


class NoResult(HrsynthError):
    """Sound request without a result: what was not reached, with its numbers, and the next step.

    Parameters
    ----------
    problem
        ``ROBOT: goal not met: number with unit``.
    remedy
        Next step, a sentence.
    """

    exit_status = 3

    def __init__(self, problem: str, remedy: str = "") -> None:
        self.problem, self.remedy = problem, remedy
        super().__init__(compose_message(problem, None, None, remedy))


class LoopClosureFailure(NoResult):
    """Open kinematic loops: the remaining closure residual, the loop with the largest one, and where it is open."""

    def __init__(
        self, robot: str, residual: float, tolerance: float, loop: str, cure: str = "", where: str = ""
    ) -> None:
        self.robot, self.residual, self.tolerance, self.loop = robot, residual, tolerance, loop
        super().__init__(
            f"{robot}: loop {loop!r} is open{' by ' * bool(where)}{where} at the zero configuration: "
            f"closure residual {residual:.3g} "
            f"(characteristic lengths, rad), tolerance {tolerance:.3g}",
            cure or "Correct the loop's joint origins, or give them more decimals.",
        )


class MotorsNotEnough(NoResult):
    """Platform that can move with locked motors: too few motors, or a singular zero configuration; with the joints
    that move."""

    def __init__(self, robot: str, joints: Sequence[str]) -> None:
        self.robot, self.joints = robot, tuple(joints)
        super().__init__(
            f"{robot}: with locked motors the platform can still move at the zero configuration, through "
            f"{shorten_text(', '.join(joints))}",
            "Add motors (--motors), or choose another zero configuration.",
        )


class UndecidedRank(NoResult):
    """Rank with a gap too small for a verdict."""

    def __init__(
        self, what: str, gap: float, needed: float, remedy: str = "Give more decimals, or observe other links."
    ) -> None:
        self.what, self.gap, self.needed = what, gap, needed
        super().__init__(f"{what}: rank undecided: gap {gap:.3g}, needed {needed:.3g}", remedy)


class RoundingLimitedRank(UndecidedRank):
    """Loop constraints as weak as the closure residual: with exact numbers the loops may move that way. With a wider
    ``tolerance``, if there is one, they are near geometry that does."""

    def __init__(self, robot: str, directions: int, open_by: float, tolerance: float | None = None) -> None:
        self.robot, self.directions, self.open_by, self.tolerance = robot, directions, open_by, tolerance
        NoResult.__init__(
            self,
            f"{robot}: mobility undecided: closure residual {open_by:.1g} from rounded numbers is as large as "
            f"{directions} singular value{'s' * (directions != 1)} of the loop Jacobian",
            f"Give the numbers more decimals{f', or --tolerance {tolerance:g}' if tolerance else ''}.",
        )


class UndecidedStructure(NoResult):
    """Rounded numbers that fit two structures equally well."""

    def __init__(self, robot: str, tolerance: float, one: str, other: str) -> None:
        self.robot, self.tolerance, self.one, self.other = robot, tolerance, one, other
        super().__init__(
            f"{robot}: rounded numbers fit two robots within {tolerance:.1g} (characteristic lengths, rad): "
            f"one with {one}, one with {other}",
            "Give more decimals, another --tolerance, or --as-written.",
        )


class SamplingFailure(NoResult):
    """Too few samples reached from the zero configuration in a number of random walks (``tries``)."""

    def __init__(self, robot: str, reached: int, wanted: int, tries: int) -> None:
        self.robot, self.reached, self.wanted, self.tries = robot, reached, wanted, tries
        super().__init__(
            f"{robot}: {reached} samples from {tries} random walks, {wanted} needed: the other walks came near a "
            "singularity or left the branch",
            "Start elsewhere (--at POSE, --keyframe NAME), or give the file's numbers more decimals.",
        )


class InfinitesimalMobility(NoResult):
    """Mechanism that is infinitesimally mobile at all samples: its mobility to first order exceeds its finite
    mobility."""

    def __init__(self, robot: str, allowed: int, done: int) -> None:
        self.robot, self.allowed, self.done = robot, allowed, done
        super().__init__(
            f"{robot}: infinitesimally mobile at all samples: mobility {allowed} to first order, {done} in finite "
            "motion; verdicts use first-order ranks",
            "Change the geometry, or lock the joints concerned with --freeze.",
        )


class BranchPoint(NoResult):
    """Zero configuration at which several operation modes meet, or samples from several; describes each mode with a
    pose in it."""

    def __init__(self, robot: str, what: str, modes: Iterable[str]) -> None:
        self.robot, self.what, self.modes = robot, what, tuple(modes)
        super().__init__(
            f"{robot}: {what}: " + "; ".join(f"({i}) {mode}" for i, mode in enumerate(self.modes, 1)),
            "Start in one of them (--at POSE).",
        )


class GeometryAmbiguous(NoResult):
    """Nearly special geometry: the largest deviation that would be snapped, the smallest that would not (both in
    characteristic lengths), and the ratio needed between them."""

    def __init__(self, what: str, largest: float, smallest: float, gap: float) -> None:
        super().__init__(
            f"{what}: geometry ambiguous: some are {largest:.2g} characteristic lengths apart, others "
            f"{smallest:.2g}, and the ratio is below {gap:g}",
            "Give more decimals, or use --as-written.",
        )


class NoProvedCell(NoResult):
    """Branch without a proved cell, so that no code can be generated, and the reason."""

    def __init__(self, robot: str, motors: Iterable[str], reason: str) -> None:
        super().__init__(
            f"{robot}: no code generated: no cell around the zero configuration is proved for "
            f"{', '.join(motors)}{': ' * bool(reason)}{reason}",
            "Try a smaller box (--box).",
        )


class LegMiss(NamedTuple):
    """Distance (m, rad) by which a leg alone misses a goal; ``at_least``: a lower bound."""

    leg: str
    length: float
    angle: float
    at_least: bool = False


class PoseReachFailure(NoResult):
    """Pose that the robot does not reach from ``origin``: the leg with the largest distance to it (mm, degrees), or
    None if each leg alone reaches it; the part of the path travelled (``came``, 0 to 1) and the last pose; a joint near
    its tilt limit there (``wrist``); the reason why the legs together fail (``why``), or another ``reason``."""

    def __init__(
        self,
        robot: str,
        pose: str,
        came: float,
        last: str,
        miss: LegMiss | None = None,
        origin: str = "its zero configuration",
        wrist: str | None = None,
        why: str | None = None,
        reason: str | None = None,
    ) -> None:
        self.robot, self.pose, self.came, self.last = robot, pose, came, last
        self.leg = None if miss is None else miss.leg
        self.millimetres = 0.0 if miss is None else 1e3 * miss.length
        self.degrees = 0.0 if miss is None else math.degrees(miss.angle)
        self.wrist = wrist
        self.others: tuple[PoseReachFailure, ...] = ()
        if reason is None:
            if wrist is not None:
                reason = f"joint {wrist}, which replaces several R through one point, is near its tilt limit"
            elif miss is None:
                reason = "each leg alone can close there, but " + (
                    why
                    or (
                        "the straight path to it is blocked (out of reach of all legs together, a leg at its limit, "
                        "or another working mode)"
                    )
                )
            else:
                turn = f" and {self.degrees:.3g} degrees" if self.degrees > 1e-6 else ""
                least = "at least " * miss.at_least
                reason = f"leg {miss.leg} alone misses it by {least}{self.millimetres:.4g} mm{turn}"
            part = "more than 99.9" if 0.999 < came < 1 else f"{100 * came:.3g}"
            reason += f"; from {origin} the robot gets {part} % of the path, to {last}"
        self.reason = reason
        super().__init__(f"{robot}: the pose {pose} is not reached: {self.reason}", "Choose a nearer pose.")

    @classmethod
    def of_all(cls, refused: Sequence[PoseReachFailure]) -> PoseReachFailure:
        """Return the first of several poses that are not reached; it reports one line for each."""
        refused[0].others = tuple(refused[1:])
        return refused[0]

    def lines(self) -> list[str]:
        """Return one line for this pose, and one for each of the others."""
        return super().lines() + [line for each in self.others for line in each.lines()]


class NoReachablePose(NoResult):
    """Plane or grid without a reachable pose, the reason, and a dependence between its coordinates."""

    def __init__(self, robot: str, plane: str, reason: str, dependent: str | None = None) -> None:
        reason += f"; {dependent}" if dependent else ""
        self.robot, self.plane, self.reason = robot, plane, reason
        super().__init__(f"{robot}: no pose of {plane} is reached: {reason}", "Choose other poses.")


class Disagreement(NoResult):
    """Disagreement between the singularity condition and the rank."""

    def __init__(self, robot: str, poses: int, angle: float) -> None:
        self.robot, self.poses, self.angle = robot, poses, angle
        super().__init__(
            f"{robot}: condition and rank disagree at {poses} poses (leg wrenches differ by {angle:.2g} rad)",
            "Report this as a defect of hrsynth, with the robot file.",
        )


class UnsupportedLocus(NoResult):
    """Robot whose locked legs have loci without a supported closed form."""

    def __init__(self, robot: str, reason: str) -> None:
        self.robot, self.reason = robot, reason
        super().__init__(f"{robot}: assembly modes cannot be listed: {reason}", "Observe other legs.")


class ConfirmationFailure(NoResult):
    """Architecture without an exact verdict that samples confirm, and the reason."""

    def __init__(self, robot: str, what: str) -> None:
        self.robot, self.what = robot, what
        super().__init__(f"{robot}: no confirmed verdict: {what}", "Analyse it numerically with hrsynth derive.")


class NoEquivalentRobot(NoResult):
    """No candidate passed the equivalence check; with the smallest angle between velocity relations."""

    def __init__(self, robot: str, angle: float, tolerance: float) -> None:
        self.robot, self.angle, self.tolerance = robot, angle, tolerance
        super().__init__(
            f"{robot}: no hidden robot passed the equivalence check: largest angle {angle:.3g} rad, tolerance "
            f"{tolerance:.3g} rad",
            "Start away from dead points (--at POSE), or observe other legs.",
        )


class NoCertificate(NoResult):
    """Result for which no certificate can be written, and the reason."""

    def __init__(self, robot: str, reason: str) -> None:
        self.robot, self.reason = robot, reason
        super().__init__(f"{robot}: no certificate: {reason}", "Omit --certificate.")


class InvalidCertificate(NoResult):
    """Certificate that the checker does not accept, and the reason."""

    def __init__(self, source: str, reason: str) -> None:
        self.source, self.reason = source, reason
        super().__init__(f"{source}: refused: {reason}", "Write the certificate again with hrsynth.")


class MissingExtra(NoResult):
    """Optional package that is not installed: what needs it, and the extra (or ``package``) that installs it."""

    met: ClassVar[int] = 0
    """Number of these errors so far; results computed without an optional package are not cached."""

    def __init__(self, what: str, extra: str, *, package: bool = False) -> None:
        self.what, self.extra = what, extra
        install = f"{sys.executable or 'python'} -m pip install"
        remedy = f'Run {install} "hrsynth[{extra}]", or in a checkout {install} ".[{extra}]".'
        remedy = f"Run {install} {extra}." if package else remedy
        self.reason = compose_message(f"{what} needs an optional package", None, None, remedy)
        MissingExtra.met += 1
        super().__init__(self.reason)


class ExternalSolverFailure(NoResult):
    """Solver without a result, and the reason."""

    def __init__(self, solver: str, reason: str, remedy: str = "Observe other legs.") -> None:
        self.solver, self.reason = solver, reason
        super().__init__(f"{solver}: system not solved: {reason}", remedy)


class TooLarge(NoResult):
    """System whose estimated time (s) exceeds the time limit."""

    def __init__(self, what: str, size: str, needed: float, effort: float) -> None:
        self.needed = needed
        self.reason = f"{what}, {size}, needs about {needed:g} s, more than the time limit of {effort:g} s"
        super().__init__(self.reason, "Raise --time-limit.")


class RenderFailure(NoResult):
    """Images that cannot be rendered on this machine, and the reason."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(
            f"images cannot be rendered here: {reason}",
            "Set MUJOCO_GL to egl, osmesa or glfw before mujoco is imported.",
        )


class NeedsPosix(NoResult):
    """Function that this operating system does not provide, and the missing module."""

    def __init__(self, what: str, module: str) -> None:
        self.what, self.module = what, module
        super().__init__(f"{what} needs the module {module} of POSIX systems", "Use Linux, macOS or WSL.")


class WorkersLost(NoResult):
    """Worker processes that ended before their work was done, and the reason."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{reason}, perhaps for lack of memory", "Use fewer processes (--jobs).")


class BuildInterruption(NoResult):
    """Build of the catalog, or sweep to a file, that cannot continue: the reason, and the journal of finished work."""

    def __init__(self, reason: str, kept: str | None = None, what: str = "build") -> None:
        self.reason, self.kept = reason, kept
        rest = "" if kept is None else f"; finished work is kept in {kept}"
        super().__init__(f"the {what} stopped: {reason}{rest}", "Repeat the command to continue.")


class CatalogStale(NoResult):
    """Stored catalog that differs from what would be built today, one line per difference."""

    def __init__(self, complaints: Iterable[str]) -> None:
        self.complaints = tuple(complaints)
        super().__init__("; ".join(self.complaints), "Build it again with hrsynth catalog build.")

    def lines(self) -> list[str]:
        return list(self.complaints)
