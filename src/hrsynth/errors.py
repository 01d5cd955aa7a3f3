"""Everything that can go wrong because of what a user gave: one class a situation, the facts as data."""

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
    """The robot file that the error is about, where its text does not say so itself."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by what it says, whatever it was made of: workers tell their errors so."""
        return _error, (type(self), self.args), self.__dict__

    def lines(self) -> list[str]:
        """One line per defect, without the program's name."""
        text = " ".join(str(self).split())
        return [text if self.file is None else f"{self.file}: {text}"]


def _error(kind: type[HrsynthError], args: tuple[Any, ...]) -> HrsynthError:
    """An error of a kind, its constructor not called."""
    return kind.__new__(kind, *args)


def warn_caller(text: str, kind: type[Warning]) -> None:
    """Warn of something at the line outside of this package from which it was asked."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "hrsynth":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, kind, stacklevel=level)


class AssumedBase(UserWarning):
    """Warning that a file leaves open which link is the base, and which is taken for it."""


class AssumedPlatform(UserWarning):
    """Warning that a file names no platform, and which link is taken for it."""


def compose_message(problem: str, got: str | None, expected: str | None, remedy: str = "") -> str:
    """Return one line: ``problem: got X, expected Y. Remedy.``; parts that are empty are left out."""
    facts = ", ".join([f"got {got}"] * (got is not None) + [f"expected {expected}"] * bool(expected))
    text = f"{problem}: {facts}" if facts else problem
    return " ".join(f"{text}. {remedy}".split()) if remedy else " ".join(text.split())


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
    """A robot file with its defects, each once, in the order of their lines."""

    def __init__(self, defects: Iterable[Defect]) -> None:
        self.defects = tuple(sorted(dict.fromkeys(defects), key=lambda d: (d.line is None, d.line or 0)))
        super().__init__("; ".join(map(str, self.defects)))

    def lines(self) -> list[str]:
        return [str(defect) for defect in self.defects]


def shorten_text(text: str, length: int = 200) -> str:
    """A text on one line, cut off at the end if it is too long."""
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
        Sentence that says what to do: ``Use x, y or phi.``
    """

    def __init__(
        self, problem: str, got: object = None, expected: str | Sequence[str] | None = None, *, remedy: str = ""
    ) -> None:
        self.problem, self.got, self.remedy = problem, got, remedy
        self.expected = expected if expected is None or isinstance(expected, str) else ", ".join(expected)
        shown = None if got is None else shorten_text(repr(got))
        super().__init__(compose_message(problem, shown, self.expected, remedy))


class NoPlatform(BadRequest):
    """A question about a platform, of a robot whose file names none and leaves several that could be."""


class NoSegment(BadRequest):
    """A leg without a segment whose direction could be observed: it is one joint, or its links have no length."""


class FileTooLarge(BadRequest):
    """A file that is larger than what is accepted: its name, and the limit in bytes."""

    def __init__(self, name: str, most: int) -> None:
        self.name, self.most = name, most
        super().__init__("a file that is too large", name, f"at most {most / 1e6:g} MB")


class BadMechanism(BadRequest):
    """A mechanism whose parts contradict each other (a joint of an unknown link, a zero axis)."""


class UndefinedValue(BadRequest):
    """A measurement that has no value at a configuration: a camera inside the cylinder, or at the point, that it
    sees."""


class NoResult(HrsynthError):
    """Sound request without a result: what was not reached, with its numbers, and the next step.

    Parameters
    ----------
    problem
        ``ROBOT: goal not met: number with unit``.
    remedy
        Sentence that says what to do next.
    """

    exit_status = 3

    def __init__(self, problem: str, remedy: str = "") -> None:
        super().__init__(compose_message(problem, None, None, remedy))


class LoopsNotClosed(NoResult):
    """Loops are open: the residual that is left, the loop with the largest miss, and what may help, if known."""

    def __init__(self, robot: str, residual: float, tolerance: float, loop: str, cure: str = "") -> None:
        self.robot, self.residual, self.tolerance, self.loop = robot, residual, tolerance, loop
        super().__init__(
            f"{robot}: the loop {loop!r} is open at the zero configuration, residual {residual:.3g} "
            f"(characteristic lengths, radians), allowed: {tolerance:.3g}" + (f"; {cure}" if cure else "")
        )


class MotorsNotEnough(NoResult):
    """At zero the platform can move while all motors are held: too few motors, or a singular zero configuration; with
    the joints that then move."""

    def __init__(self, robot: str, joints: Sequence[str]) -> None:
        self.robot, self.joints = robot, tuple(joints)
        super().__init__(
            f"{robot}: at the zero configuration the platform can move while all motors are held, through "
            f"{shorten_text(', '.join(joints))}: its pose is not a function of the motors; add motors, "
            "or choose another zero configuration"
        )


class RankUndecided(NoResult):
    """A rank whose gap is too small for a verdict."""

    def __init__(self, what: str, gap: float, needed: float) -> None:
        self.what, self.gap, self.needed = what, gap, needed
        super().__init__(f"{what}: the singular values leave a gap of {gap:.3g}, needed: {needed:.3g}")


class RankBelowRounding(RankUndecided):
    """Loops that hold directions by no more than what was open: with exact numbers they may move that way."""

    def __init__(self, robot: str, directions: int, open_by: float) -> None:
        self.robot, self.directions, self.open_by = robot, directions, open_by
        verb = "holds" if directions == 1 else "hold"
        NoResult.__init__(
            self,
            f"{robot}: its rounded numbers leave the loops open by {open_by:.1g} (characteristic lengths, "
            f"radians), and {directions} of their constraints {verb} by no more than that: whether the loops can "
            "move that way is undecided; give more decimals",
        )


class StructureUndecided(NoResult):
    """Rounded numbers that fit one structure as well as another."""

    def __init__(self, robot: str, tolerance: float, one: str, other: str) -> None:
        self.robot, self.tolerance, self.one, self.other = robot, tolerance, one, other
        super().__init__(
            f"{robot}: the rounded numbers fit two robots to {tolerance:.1g} (characteristic "
            f"lengths, radians): one with {one}, one with {other}; give more decimals, another "
            "--tolerance, or --as-written"
        )


class NotSampled(NoResult):
    """Too few closed configurations could be reached from the zero configuration, in how many ``tries``."""

    def __init__(self, robot: str, reached: int, wanted: int, tries: int) -> None:
        self.robot, self.reached, self.wanted, self.tries = robot, reached, wanted, tries
        super().__init__(
            f"{robot}: of {tries} random walks from the zero configuration only {reached} led to a "
            f"configuration that counts, needed: {wanted}; the others came near a singularity or left the "
            "branch: start away from it (--at POSE, --keyframe NAME), or give the file's numbers more "
            "digits"
        )


class InfinitesimalMobility(NoResult):
    """A mechanism whose loops allow more motion to first order than it really has, wherever it goes."""

    def __init__(self, robot: str, allowed: int, done: int) -> None:
        self.robot, self.allowed, self.done = robot, allowed, done
        super().__init__(
            f"{robot}: shaky wherever it was tried: to first order its loops have mobility {allowed}, but "
            f"it can move on in only {done} way{'s' * (done != 1)}; no verdict is given, since all ranks "
            "here are of first order"
        )


class BranchPoint(NoResult):
    """A zero configuration at which several operation modes meet, or samples from several: what was found of each, and
    a pose in it."""

    def __init__(self, robot: str, what: str, modes: Iterable[str]) -> None:
        self.robot, self.what, self.modes = robot, what, tuple(modes)
        super().__init__(
            f"{robot}: {what}: "
            + "; ".join(f"({i}) {mode}" for i, mode in enumerate(self.modes, 1))
            + "; no verdict is given; start in one of them"
        )


class GeometryAmbiguous(NoResult):
    """Whether a special geometry is meant: the largest defect that would be accepted, the smallest that would not (both
    in sizes of the mechanism), and how far apart they must be."""

    def __init__(self, what: str, largest: float, smallest: float, gap: float) -> None:
        super().__init__(
            f"{what} are {largest:.2g} sizes of the mechanism apart, others {smallest:.2g}: not "
            f"{gap:g} times as far, so it is not clear which are meant; --as-written takes the "
            "numbers as they are"
        )


class NothingProved(NoResult):
    """A branch of which no cell at all is proved, and why: there is no function to write."""

    def __init__(self, robot: str, motors: Iterable[str], reason: str) -> None:
        super().__init__(
            f"{robot}: no code is written: around the zero configuration nothing is proved for "
            f"{', '.join(motors)}{': ' * bool(reason)}{reason}; try a smaller box (--box)"
        )


class LegMiss(NamedTuple):
    """A leg that alone misses a goal by so much (m, rad), or at least by so much."""

    leg: str
    length: float
    angle: float
    at_least: bool = False


class PoseNotReached(NoResult):
    """A pose that the robot does not reach from ``origin``: the leg that misses it most and by how much (mm, degrees;
    at least, as rods tell it), or None if each leg alone reaches it; how far the robot came (0 to 1), and to which
    pose; the ``wrist``, a joint that stands for several R, that is near the end of its turns there; ``why`` all legs
    together do not get there, if that is known; or another ``reason`` instead of these."""

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
        self.others: tuple[PoseNotReached, ...] = ()
        if reason is None:
            if wrist is not None:
                reason = f"joint {wrist}, which stands for several R through one point, is near the end of its turns"
            elif miss is None:
                reason = "each leg alone can close there, but " + (
                    why
                    or (
                        "the straight path to it is blocked (all legs together do not reach so far, a leg is at its "
                        "limit, or it is another working mode)"
                    )
                )
            else:
                turn = f" and {self.degrees:.3g} degrees" if self.degrees > 1e-6 else ""
                least = "at least " * miss.at_least
                reason = f"leg {miss.leg} alone misses it by {least}{self.millimetres:.4g} mm{turn}"
            part = "more than 99.9" if 0.999 < came < 1 else f"{100 * came:.3g}"
            reason += f"; from {origin} the robot gets {part} % of the way, to {last}"
        self.reason = reason
        super().__init__(f"{robot}: the pose {pose} is not reached: {self.reason}")

    @classmethod
    def of_all(cls, refused: Sequence[PoseNotReached]) -> PoseNotReached:
        """The first of several poses that are not reached; it reports one line for each."""
        refused[0].others = tuple(refused[1:])
        return refused[0]

    def lines(self) -> list[str]:
        """One line for this pose, and one for each of the others."""
        return super().lines() + [line for each in self.others for line in each.lines()]


class NoReachablePose(NoResult):
    """A plane or grid of poses none of which the robot reaches, and why; that their parts depend on each other."""

    def __init__(self, robot: str, plane: str, reason: str, dependent: str | None = None) -> None:
        reason += f"; {dependent}" if dependent else ""
        self.robot, self.plane, self.reason = robot, plane, reason
        super().__init__(f"{robot}: no pose of {plane} is reached: {reason}")


class Disagreement(NoResult):
    """The words, the expression and the rank do not agree about where a robot is singular."""

    def __init__(self, robot: str, poses: int, angle: float) -> None:
        self.robot, self.poses, self.angle = robot, poses, angle
        super().__init__(
            f"{robot}: the condition and the rank disagree at {poses} poses (a leg's wrenches by up to "
            f"{angle:.2g} rad); please report this as a defect of hrsynth"
        )


class UnsupportedLocus(NoResult):
    """A robot whose tips, with the directions held, move on something other than points, lines and circles."""

    def __init__(self, robot: str, reason: str) -> None:
        self.robot, self.reason = robot, reason
        super().__init__(f"{robot}: its assembly modes cannot be listed, not supported here: {reason}")


class NotConfirmed(NoResult):
    """An architecture without an exact verdict that closed configurations confirm, and why."""

    def __init__(self, robot: str, what: str) -> None:
        self.robot, self.what = robot, what
        super().__init__(f"{robot}: no confirmed verdict: {what}")


class NoEquivalentRobot(NoResult):
    """No hidden robot passed the certificate: the best angle seen."""

    def __init__(self, robot: str, angle: float, tolerance: float) -> None:
        self.robot, self.angle, self.tolerance = robot, angle, tolerance
        super().__init__(
            f"{robot}: no hidden robot passed the certificate, largest angle {angle:.3g}, allowed: {tolerance:.3g}"
        )


class NoCertificate(NoResult):
    """A list of modes, or a verdict, for which there is no certificate, and why."""

    def __init__(self, robot: str, reason: str) -> None:
        self.robot, self.reason = robot, reason
        super().__init__(f"{robot}: no certificate: {reason}")


class CertificateRefused(NoResult):
    """A certificate that the checker does not accept: which, and why."""

    def __init__(self, source: str, reason: str) -> None:
        self.source, self.reason = source, reason
        super().__init__(f"{source}: refused: {reason}")


class MissingExtra(NoResult):
    """Something that needs an optional package which is not installed: what, and the extra that installs it."""

    met: ClassVar[int] = 0
    """How often that happened: an answer that goes on without a package is not remembered."""

    def __init__(self, what: str, extra: str) -> None:
        self.what, self.extra = what, extra
        self.reason = (
            f"{what} needs an optional package: {sys.executable or 'python'} -m pip install "
            f'"hrsynth[{extra}]", in a checkout -m pip install ".[{extra}]"'
        )
        MissingExtra.met += 1
        super().__init__(self.reason)


class SystemNotSolved(NoResult):
    """An external solver that gave no answer: which, and why."""

    def __init__(self, solver: str, reason: str) -> None:
        self.solver, self.reason = solver, reason
        super().__init__(f"{solver} did not solve the system: {reason}")


class TooLarge(NoResult):
    """A system that needs more effort than is allowed: what, how large it is, the estimated time in seconds, and the
    limit."""

    def __init__(self, what: str, size: str, needed: float, effort: float) -> None:
        self.needed = needed
        self.reason = f"{what}, {size}, needs about {needed:g} s, more than the effort of {effort:g} s"
        super().__init__(self.reason)


class NotRendered(NoResult):
    """Pictures that cannot be rendered on this machine, and why."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"pictures cannot be rendered here: {reason} (MUJOCO_GL chooses between egl, osmesa and glfw)")


class NeedsPosix(NoResult):
    """Something that this operating system does not offer: what needs it, and the module that is missing."""

    def __init__(self, what: str, module: str) -> None:
        self.what, self.module = what, module
        super().__init__(f"{what} needs a POSIX system: this Python has no module {module}")


class WorkersLost(NoResult):
    """Processes that share work and ended before it was done, and why."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{reason}: it may have run out of memory; fewer processes (--jobs) need less")


class BuildStopped(NoResult):
    """A build of the catalog, or a sweep to a file, that cannot continue: why, and the journal that keeps what was
    done, if any."""

    def __init__(self, reason: str, kept: str | None = None, what: str = "build") -> None:
        self.reason, self.kept = reason, kept
        rest = "" if kept is None else f"; what was built is kept in {kept}; the same command continues"
        super().__init__(f"the {what} stopped: {reason}{rest}")


class CatalogStale(NoResult):
    """A stored catalog that differs from what would be built today: what differs, one line each."""

    def __init__(self, complaints: Iterable[str]) -> None:
        self.complaints = tuple(complaints)
        super().__init__("; ".join(self.complaints))

    def lines(self) -> list[str]:
        return list(self.complaints)
