"""A branch as code for controllers: motors to passive joints and platform with all Jacobians, proved as it runs."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from ..analysis.analysis_declaration import analysis
from ..analysis.branch.answer import BACK, BranchLimit, BranchProof
from ..analysis.branch.proof import (
    BRANCH_CELLS_MAX,
    BoxLike,
    Cells,
    MotorBox,
    TimeLimit,
    choose_shape,
    parse_box,
    prove_branch,
)
from ..analysis.observation_inputs import CameraLike, LegsLike, normalise_texts
from ..analysis.observed import ObservedRobot, RobotLike, read_robot
from ..equations.loop_parts import split_loop_system
from ..errors import BadRequest, HrsynthError
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..mechanism.observations.direction import Direction
from ..options import option
from ..progress import report
from ..records import Recorded, Shown, Table, recorded
from ..results import Result
from ..tolerances import GENERATED_LAST_STEP_MAX
from .branch_cells import GENERATED_CLOSURE_TOL, TubedBranch
from .inverse import find_closed_inverse
from .languages import TEMPLATES, render_program
from .source import Source
from .tracker import Tracker, convert_to_branch


class ExportedPart(NamedTuple):
    """Motors with the passive coordinates that they determine: proved fraction of the box, and a proved box."""

    motors: tuple[str, ...]
    volume_fraction: float
    proved: Annotated[tuple[Array, Array], Table, "low and high of each motor (m, rad)"]


class FreeMotor(NamedTuple):
    """Motor in no loop, and the interval (m, rad) in which the program gives results."""

    motor: str
    lower: float
    upper: float


@dataclass(frozen=True, eq=False, repr=False)
class ExportedCode(Result, shown_as="export"):
    """Program, its language, and the proof behind it; ``legs`` are those whose directions it gives."""

    proof: BranchProof
    lang: Annotated[str, Literal["c++", "python"]]
    legs: Recorded[tuple[str, ...]]
    jumps: Annotated[bool, "true if the program has cells, proved in advance: its motors may jump from call to call"]
    closed: bool
    """Flag: the motors of a pose are computed in closed form."""
    free: Recorded[tuple[FreeMotor, ...]]
    """Motors in no loop, with the interval (m, rad) in which the program has cells."""
    code: str

    @property
    def robot(self) -> Any:
        """The robot."""
        return self.proof.robot

    @property
    def setup(self) -> Any:
        """Setup compared besides the record."""
        return self.proof.robot

    def headline(self) -> str:
        """Return the robot and the proved fraction."""
        return f"{self.lang} of {self.proof.headline().rstrip(': ')}"

    motors = Shown(list[str], lambda self: self.proof.motors)
    passive = Shown(list[str], lambda self: self.proof.passive)
    fixed = Shown(list[str], lambda self: self.proof.fixed)
    injective_box = Shown(Table | None, lambda self: self.proof.injective_box, BACK)
    limits = Shown(list[BranchLimit], lambda self: self.proof.limits)

    @property
    @recorded()
    def inverse(self) -> Literal["closed form", "Newton's method"] | None:
        """Method by which the program computes the motors of a pose, or null where it does not."""
        if not self.jumps:
            return None
        return "closed form" if self.closed else "Newton's method"

    @property
    @recorded()
    def cells(self) -> int:
        """Number of cells in the program."""
        return sum(len(part.cells) for part in self.proof.parts)

    @property
    @recorded()
    def parts(self) -> list[ExportedPart]:
        """Parts of the proof, without their cells."""
        return [ExportedPart(each.motors, each.volume_fraction, each.proved) for each in self.proof.parts]


@analysis(
    150,
    examples=(
        "delta -o robot.hpp",
        "rrrrr_m1 --jumps --box shoulder_1=-0.1:0.1,shoulder_2=-0.1:0.1 -o five_bar.hpp",
        "robot.urdf --lang python -o robot.py",
    ),
    seeded=False,
)
def export(
    robot: RobotLike,
    lang: Annotated[
        str,
        option(
            "c++ (one header, C++17, Eigen) or python (a module for batches; implies --jumps).",
            words=tuple(TEMPLATES),
        ),
    ] = "c++",
    box: MotorBox = None,
    *,
    observe: LegsLike = None,
    camera: CameraLike = None,
    jumps: Annotated[
        bool, option("Answer for motors that jump from call to call, in cells that are proved in advance.")
    ] = False,
    max_cells: Cells = BRANCH_CELLS_MAX,
    time_limit: TimeLimit = None,
) -> ExportedCode:
    """Code for a controller: passive joints, platform pose and Jacobians, on the branch of the zero configuration.

    The program follows the motors: each call proves that its answer continues the last one. With ``jumps`` it answers
    for any motors in the cells of ``branch``, too, and computes the motors of a pose.

    Parameters
    ----------
    robot
        Robot, file or name.
    lang
        ``c++`` (one header, C++17, Eigen) or ``python`` (one module for arrays of NumPy, PyTorch or JAX, with
        ``jumps``).
    box
        Interval of each motor (m, rad), as for ``branch``; with ``jumps``.
    observe, camera
        Observed directions, as for ``derive``.
    jumps
        Answer for motors that jump from call to call, in cells that are proved in advance.
    max_cells
        Largest number of cells, as for ``branch``; with ``jumps``.
    time_limit
        Seconds after which no more cells are tried, as for ``branch``; the code may then differ from run to run.

    Returns
    -------
    ExportedCode
        Code, and the proof of its cells.

    Raises
    ------
    BadRequest
        Unknown language or name, an observation that is not a direction, or an option of cells without ``jumps``.
    NoProvedCell
        With ``jumps``: no cell of the branch is proved.

    Notes
    -----
    The same robot gives the same text on one machine. Equations: docs/pages/proofs.md.

    Examples
    --------
    >>> hrsynth.export("rrrrr_m1").jumps
    False
    """
    if lang not in TEMPLATES:
        raise BadRequest("--lang", lang, tuple(TEMPLATES))
    jumps = jumps or lang != "c++"
    if not jumps and (box is not None or max_cells != BRANCH_CELLS_MAX or time_limit is not None):
        raise BadRequest(
            "--box, --max-cells, --time-limit: only code for motors that jump has cells", remedy="Add --jumps."
        )
    given = read_robot(robot)
    directions = _list_observed_directions(given, observe, camera)
    proof = prove_branch(given, box, max_cells, time_limit, whole=True) if jumps else _read_branch(given)
    system = proof.system.in_units(proof.system.length)
    parts = split_loop_system(system)[0]
    if not parts:
        raise BadRequest(
            f"{proof.robot.name}: the motors move no kinematic loop", remedy="Choose a robot with kinematic loops."
        )
    report("code")
    branch_ = TubedBranch.of(proof, parse_box(box)) if jumps else convert_to_branch(system, parts)
    moved = proof.robot not in (given, getattr(given, "robot", None))
    legs = find_closed_inverse(proof.robot if moved else given, proof, branch_) if jumps else ()
    source = Source.of(branch_, directions, legs, Tracker.of(system, parts) if lang == "c++" else None)
    limits = {"max-cells": max_cells if max_cells != BRANCH_CELLS_MAX else None, "time-limit": time_limit}
    words = _describe_program(proof, source, lang, box, limits, normalise_texts(camera))
    free = _list_free_motors(proof, branch_) if jumps else ()
    named = tuple(each.leg for each in directions)
    return ExportedCode(proof, lang, named, jumps, bool(legs), free, render_program(source, lang, words))


def _read_branch(given: Any) -> BranchProof:
    """Return the coordinates of a branch, and no cells."""
    robot = given if isinstance(given, Mechanism) else given.robot
    robot.require_platform()
    robot.require_motors()
    motors = [name for name, joint in robot.joints.items() if joint.is_actuated]
    system, parts, held = choose_shape(robot, motors, None, whole=True)
    passive = sorted(i for part in parts for i in part.unknowns)
    driven, solved, fixed = (tuple(system.names[i] for i in places) for places in (system.driven, passive, held))
    return BranchProof(robot, system, driven, solved, fixed, (), None, False, "", 0, ())


def _list_observed_directions(robot: Any, observe: LegsLike, camera: CameraLike) -> tuple[Direction, ...]:
    """Return the observed directions, as seen from the base; by default none if a robot has no observable legs. Raises
    ``BadRequest`` if something else is observed."""
    try:
        observed = ObservedRobot.of(robot, observe, camera)
    except HrsynthError:
        if observe is not None or camera is not None:
            raise
        return ()
    observed.by_segments("export")
    links, reference = observed.robot.links, observed.normal.mechanism.reference
    if reference != observed.robot.base:
        if camera is not None:
            raise BadRequest(f"--camera {camera}: the camera moves", remedy="Observe the directions from the base.")
        return ()
    return tuple(
        each
        for each in observed.observed
        if isinstance(each, Direction) and each.link in links and each.seen_from in (None, reference)
    )


def _list_free_motors(proof: BranchProof, branch_: TubedBranch) -> tuple[FreeMotor, ...]:
    """Return the motors in no loop, with their intervals."""
    moving = {name for part in proof.parts for name in part.motors}
    return tuple(
        FreeMotor(name, float(low), float(high))
        for name, low, high in zip(proof.motors, branch_.lower, branch_.upper, strict=True)
        if name not in moving
    )


def _describe_program(
    proof: BranchProof,
    source: Source,
    lang: str,
    box: BoxLike | None,
    limits: Mapping[str, float | None],
    camera: tuple[str, ...],
) -> list[str]:
    """Return the header of the program: robot, ranges, what is proved and what is checked."""
    from ..version import __version__

    robot, branch_, jumps = proof.robot, source.branch, bool(source.parts)
    pairs = {} if box is None or isinstance(box, str) else box
    asked = box if isinstance(box, str) else ",".join(f"{name}={low}:{high}" for name, (low, high) in pairs.items())
    file = Path(robot.file).name if robot.file else robot.name
    legs = ",".join(each.leg for each in source.observed)
    words = ["hrsynth", "export", file, *robot.options, "--lang", lang]
    words += [
        word
        for name, value in (
            ("observe", legs),
            *(("camera", each) for each in camera),
            ("box", asked),
            *((name, str(value)) for name, value in limits.items() if value is not None),
        )
        if value
        for word in (f"--{name}", value)
    ]
    words += ["--jumps"] * (jumps and lang == "c++")
    held = [f"{name} = {zero:.6g}" if zero else name for name, zero in proof.fixed_at.items()]
    lines = [
        f"Made by hrsynth {__version__}: {shlex.join(words)}",
        *([f"SHA-256 of {file}: {robot.sha256}"] if robot.sha256 else []),
        f"Robot {robot.name}: {len(proof.motors)} motors, {len(proof.passive)} passive coordinates; internal, fixed"
        f"{'' if any(proof.fixed_at.values()) else ' at 0'}: {', '.join(held) or 'none'}.",
    ]
    ends = zip(branch_.lower.tolist(), branch_.upper.tolist(), strict=True)
    ranges = [f": {low!r} to {high!r}" * jumps for low, high in ends]
    places = list(branch_.motors)
    starts = (branch_.system.zero[places] * branch_.system.units[places]).tolist()
    spans = [
        span + f", {start:.6g} at the zero configuration" * bool(start)
        for span, start in zip(ranges, starts, strict=True)
    ]
    rows = zip(proof.motors, spans, branch_.motors, strict=True)
    lines.append(f"Motors in order{', with the ranges of the cells' * jumps}:")
    lines += [f"  q[{k}] {name}{span} ({branch_.unit_name(i)})" for k, (name, span, i) in enumerate(rows)]
    lines += _describe_continuation(source, source.tracker) if source.tracker else []
    lines += _describe_cells(proof, source) if jumps else []
    used = {branch_.system.coordinates[i].joint for i in (*branch_.motors, *branch_.passive)}
    if loose := [
        joint.name
        for joint in robot.joints.values()
        if joint.name in used and joint.offset is not None and joint.offset.ndim > 1
    ]:
        lines.append(
            "Spherical, planar and floating joints with coordinates from the zero configuration, not the file's zero: "
            f"{', '.join(loose)}"
        )
    lines += [f"Limits of joints without a motor, {each}" for each in proof.limits_in_words()]
    lines += [f"Limit of a motor that the box exceeds: {each}" for each in proof.motors_beyond()]
    return lines


def _describe_continuation(source: Source, tracker: Tracker) -> list[str]:
    """Return what a tracker proves at run time, and what it tests."""
    left, filed = tracker.checked_count, tracker.system.mechanism.filed  # joints with limits
    names = [*source.names(source.branch.motors), *source.names(source.branch.passive), *source.cut]
    tested, rest = [name for name in names if name in filed], [name for name in filed if name not in names]
    return [
        "Each call proves that its answer continues the last one, rounding included, or gives none (Krawczyk's",
        "condition over the step). It covers the real motion if the motors stay in the box between the two calls.",
        "The proof takes the robot's numbers as they are below: those of the file, but for rounding.",
        *[f"Tested, not proved: {left} more equations of the loops hold to {GENERATED_CLOSURE_TOL:g}."] * bool(left),
        *[f"Limits of the file are tested for: {', '.join(tested)}."] * bool(tested),
        *[f"Limits of the file are not tested for: {', '.join(rest)}."] * bool(rest),
    ]


def _describe_cells(proof: BranchProof, source: Source) -> list[str]:
    """Return where the program answers whatever the motors were before, and how."""
    branch_, lines = source.branch, list[str]()
    for part in proof.parts:
        low, high = (each.tolist() for each in part.proved)
        lines.append(
            f"{part.in_cells}, {100 * part.volume_fraction:.4g} % of the requested box; motor values outside "
            "the cells are refused. Fully covered:"
        )
        lines += [f"  {name}: {a!r} to {b!r}" for name, a, b in zip(part.motors, low, high, strict=True)]
    free = [name for name, _, _ in _list_free_motors(proof, branch_)]
    lines += [f"Motors in no loop, which only poses depend on: {', '.join(free)}."] * bool(free)
    lines.append("A result is in the cell's tube, in which the loops have one closure (proved).")
    if source.tracker:
        return lines
    left = max(len(part.closed) - len(part.rows) for part in source.parts)
    return lines + [
        f"It is given if the last step of Newton's method is at most {GENERATED_LAST_STEP_MAX:g} (rad, or "
        f"of {proof.robot.length:.6g} m,",
        "the characteristic length: mean distance of the joint centres of the file from their mean), and all loops are",
        f"closed to {GENERATED_CLOSURE_TOL:g} (cosines, or of {branch_.far:.6g} m).",
        *[f"Tested, not proved: {left} more equations of the loops hold."] * bool(left),
        "The proof takes the robot's numbers as the file has them.",
    ]
