"""A branch as code for controllers: motors to passive joints and platform, and back, with all Jacobians."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from ..analysis.analysis_declaration import analysis
from ..analysis.branch.answer import BACK, BranchLimit, BranchProof
from ..analysis.branch.proof import BoxLike, Cells, MotorBox, branch, parse_box
from ..analysis.observed import CameraLike, LegsLike, ObservedRobot, RobotLike, normalise_texts, read_robot
from ..budgets import BRANCH_CELLS_MAX
from ..errors import BadRequest, HrsynthError
from ..geometry.vectors import Array
from ..mechanism.observations.direction import Direction
from ..options import option
from ..progress import report
from ..records import Recorded, Shown, Table, recorded
from ..results import Result
from ..tolerances import GENERATED_CLOSURE_TOL, GENERATED_LAST_STEP_MAX
from .branch_cells import TubedBranch
from .inverse import find_closed_inverse
from .languages import TEMPLATES, render_program
from .source import ProvedBounds, Source


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
    lang: Annotated[str, Literal["c++", "numpy"]]
    legs: Recorded[tuple[str, ...]]
    closed: bool
    """Flag: the motors of a pose are computed in closed form."""
    bounds: ProvedBounds | None
    """Newton steps that are enough, and the largest error of a result (proved); None if a cell has no bound."""
    cells: Recorded[int]
    """Number of cells in the program."""
    code: str
    free: Recorded[tuple[FreeMotor, ...]] = ()
    """Motors in no loop, with the interval (m, rad) in which the program gives results."""

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
        return f"{self.lang} of {self.proof.headline()}"

    motors = Shown(list[str], lambda self: self.proof.motors)
    passive = Shown(list[str], lambda self: self.proof.passive)
    fixed = Shown(list[str], lambda self: self.proof.fixed)
    injective_box = Shown(Table | None, lambda self: self.proof.injective_box, BACK)
    limits = Shown(list[BranchLimit], lambda self: self.proof.limits)

    @property
    @recorded()
    def inverse(self) -> Literal["closed form", "Newton's method"]:
        """Method by which the program computes the motors of a pose."""
        return "closed form" if self.closed else "Newton's method"

    @property
    @recorded()
    def steps(self) -> int | None:
        """Steps of Newton's method that are enough in each part (proved), or null."""
        return self.bounds.steps if self.bounds else None

    @property
    @recorded()
    def error(self) -> float | None:
        """Largest error of a result (rad, 1, characteristic lengths; proved), or null."""
        return self.bounds.error if self.bounds else None

    @property
    @recorded()
    def parts(self) -> list[ExportedPart]:
        """Parts of the proof, without their cells."""
        return [ExportedPart(each.motors, each.volume_fraction, each.proved) for each in self.proof.parts]


@analysis(
    150,
    examples=(
        "rrrrr_m1 --box shoulder_1=-0.1:0.1,shoulder_2=-0.1:0.1 -o five_bar.hpp",
        "robot.urdf --lang numpy -o robot.py",
    ),
    seeded=False,
)
def export(
    robot: RobotLike,
    lang: Annotated[
        str, option("c++ (one header, C++17, Eigen) or numpy (one module).", words=("c++", "numpy"))
    ] = "c++",
    box: MotorBox = None,
    *,
    observe: LegsLike = None,
    camera: CameraLike = None,
    max_cells: Cells = BRANCH_CELLS_MAX,
) -> ExportedCode:
    """Code for a controller: forward and inverse kinematics and Jacobians, on the branch of the zero configuration.

    The program computes the passive joints and the platform's pose from the motors' coordinates, their Jacobians, the
    motors for a pose, and the interaction matrix of the observed directions.

    Parameters
    ----------
    robot
        Robot, file or name.
    lang
        ``c++`` (one header, C++17, Eigen) or ``numpy`` (one module).
    box
        Interval of each motor (m, rad), as for ``branch``.
    observe, camera
        Observed directions, as for ``derive``.
    max_cells
        Largest number of cells, as for ``branch``.

    Returns
    -------
    ExportedCode
        Code, proof and proved bounds.

    Raises
    ------
    BadRequest
        Unknown language or name, or an observation that is not a direction.
    NoProvedCell
        No cell of the branch is proved.

    Notes
    -----
    The program returns results where :func:`.format_branch` proves the branch and refuses other motor values. The same
    robot gives the same text on one machine. Equations: docs/pages/proofs.md.

    Examples
    --------
    >>> hrsynth.export("rrrrr_m1", "numpy", {"shoulder_1": (-0.05, 0.05), "shoulder_2": (-0.05, 0.05)}).lang
    'numpy'
    """
    if lang not in TEMPLATES:
        raise BadRequest("--lang", lang, tuple(TEMPLATES))
    given = read_robot(robot)
    watched = _list_observed_directions(given, observe, camera)
    proof = branch(given, box, max_cells=max_cells)
    if not proof.parts:
        raise BadRequest(
            f"{proof.robot.name}: the motors move no kinematic loop", remedy="Choose a robot with kinematic loops."
        )
    report("code")
    branch_ = TubedBranch.of(proof, parse_box(box))
    moved = proof.robot not in (given, getattr(given, "robot", None))
    source = Source.of(branch_, watched, find_closed_inverse(proof.robot if moved else given, proof, branch_))
    code = render_program(source, lang, _describe_program(proof, source, lang, box, max_cells, normalise_texts(camera)))
    return ExportedCode(
        proof,
        lang,
        tuple(each.leg for each in watched),
        bool(source.legs),
        source.bounds,
        sum(len(part.bounded) for part in source.parts),
        code,
        _list_free_motors(proof, branch_),
    )


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
    proof: BranchProof, source: Source, lang: str, box: BoxLike | None, max_cells: int, camera: tuple[str, ...]
) -> list[str]:
    """Return the header of the program: robot, ranges, what is proved and what is checked."""
    from ..version import __version__

    robot, branch_ = proof.robot, source.branch
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
            ("max-cells", "" if max_cells == BRANCH_CELLS_MAX else str(max_cells)),
        )
        if value
        for word in (f"--{name}", value)
    ]
    held = [f"{name} = {zero:.6g}" if zero else name for name, zero in proof.fixed_at.items()]
    lines = [
        f"Made by hrsynth {__version__}: {shlex.join(words)}",
        *([f"SHA-256 of {file}: {robot.sha256}"] if robot.sha256 else []),
        f"Robot {robot.name}: {len(proof.motors)} motors, {len(proof.passive)} passive coordinates; internal, fixed"
        f"{'' if any(proof.fixed_at.values()) else ' at 0'}: {', '.join(held) or 'none'}.",
        "Motors in order; values outside these ranges are refused:",
    ]
    rows = zip(proof.motors, branch_.lower.tolist(), branch_.upper.tolist(), branch_.motors, strict=True)
    lines += [
        f"  q[{k}] {name}: {low!r} to {high!r} {branch_.unit_name(i)}" for k, (name, low, high, i) in enumerate(rows)
    ]
    for part in proof.parts:
        low, high = (each.tolist() for each in part.proved)
        lines.append(
            f"{part.in_cells}, {100 * part.volume_fraction:.4g} % of the requested box; motor values outside "
            "the cells are refused. Fully covered:"
        )
        lines += [f"  {name}: {a!r} to {b!r}" for name, a, b in zip(part.motors, low, high, strict=True)]
    free = [name for name, _, _ in _list_free_motors(proof, branch_)]
    lines += [f"Motors in no loop, which only poses depend on: {', '.join(free)}."] * bool(free)
    lines += [
        f"A result is given if the last step of Newton's method is at most {GENERATED_LAST_STEP_MAX:g} (rad, or "
        f"of {robot.length:.6g} m,",
        "the characteristic length: mean distance of the joint centres of the file from their mean), all loops are",
        f"closed to {GENERATED_CLOSURE_TOL:g} (cosines, or of {branch_.far:.6g} m), and the joints are in the cell's "
        "tube, in which the loops have one closure (proved).",
        *_describe_bounds(source),
        "The proof takes the robot's numbers as the file has them.",
    ]
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


def _describe_bounds(source: Source) -> list[str]:
    """Return the proved bounds of Newton's method in it."""
    if source.bounds is None:
        return ["The number of steps and the error of results is not proved in all cells."]
    bounds = source.bounds
    return [
        f"{bounds.steps} steps of Newton's method are enough in each part, and a result is within "
        f"{bounds.joints:.2g} (rad, or of that length) of the",
        f"closure (the joints solved for), the platform within {bounds.rotation:.2g} and {bounds.position:.2g}:",
        "proved, rounding in double precision included.",
    ] + [f"At run time the program checks that {bounds.more}."] * (bounds.others > 0)
