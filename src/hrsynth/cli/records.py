"""What every command prints with `--json`: one object, whose type is here. `hrsynth schema COMMAND` prints the JSON
schema that is made of it, and this page shows all of them.

Lengths are metres and angles radians unless a name says otherwise (`_mm`, `_deg`). `null` stands for what is
absent or not decided. Arrays over a grid are nested in the order of its `axes`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NotRequired, TypedDict

Word = Literal["controllable", "partially controllable", "uncontrollable", "nothing to control", "rigid", "flexible"]
Number = float | None
Array = list[Any]
Twist = Annotated[list[float], "vx, vy, vz, wx, wy, wz at the platform frame's origin, base axes (m, rad)"]
Angle = Annotated[float, "the largest principal angle between two relations (rad)"]
Gap = Annotated[float, "the smallest ratio of a singular value that counts to one that does not"]


class Head(TypedDict):
    """The fields with which every object begins."""

    command: str
    version: str


class PlatformRecord(TypedDict):
    """The link that is the platform (the first body of a formation); what chose it, and why."""

    link: str
    chosen: Literal["file", "option", "guess"]
    reason: str


class OfRobot(Head):
    """The fields with which an answer about a robot begins."""

    robot: str
    platform: PlatformRecord


class LimitsLeft(TypedDict):
    """What is not looked at."""

    unlimited: Annotated[list[str], "joints whose limits are not looked at, as they are parts of other joints"]


class WrittenTo(TypedDict):
    """The file that was requested with -o."""

    file: str | None


class PoseRecord(TypedDict):
    """A pose of the platform frame in the base frame; null for free parts. `phi` is present if it was given."""

    x: Number
    y: Number
    z: Number
    rpy: Annotated[list[float] | None, "roll, pitch, yaw about fixed axes"]
    phi: NotRequired[float]


class Watched(TypedDict):
    """An observation: its label (that of a leg if it is a segment), the link and the kind; the named camera that sees
    it, and its point (m) and axis in the link's frame (null if there are none); the joint of an encoder."""

    leg: str
    link: str
    kind: str
    camera: str | None
    at: list[float] | None
    axis: list[float] | None
    joint: NotRequired[str]


class WatchedAxis(Watched):
    """An observation, and why it was chosen."""

    why: str


class FreedomRecord(TypedDict):
    """A freedom of the platform."""

    twist: Twist
    name: str


class MobilityRecord(TypedDict):
    """Freedoms of the normal form; `idle` ones move neither the platform nor a segment."""

    total: int
    idle: int


class MobilityWritten(MobilityRecord):
    """The same, also for the file as it is written; null if the file's own mechanism could not be sampled."""

    as_written: MobilityRecord | None


class MarginRecord(TypedDict):
    """The smallest singular value that counts, the largest that does not, and where the cut is."""

    counted: float
    dropped: float
    cutoff: float


class RelationsRecord(TypedDict):
    """The relations of lengths and angles on which the exact verdict rests."""

    carried: int
    kept: int
    observed: list[str]
    largest_defect_held: Number
    smallest_defect_not_held: Number


class ArchitectureRecord(TypedDict):
    """What generic geometry of the architecture sees, in exact arithmetic."""

    verdict: Word | None
    exact: bool
    rank: int | None
    instances: int
    reason: str
    proved: bool
    chance: float
    relations: RelationsRecord | None
    trivial: NotRequired[Annotated[int, "of a formation: how many unseen motions are trivial"]]


class FlexRecord(TypedDict):
    """Independent motions of some bodies of a formation while all others rest and no measured value changes."""

    links: list[str]
    count: int
    name: str


class FormationRecord(TypedDict):
    """What is not seen of a formation: trivial motions and flexes; `special` describes the line or plane that holds all
    sensed points here, but not generically."""

    bodies: list[str]
    trivial: list[str]
    flexes: list[FlexRecord]
    special: str


class NotationRecord(TypedDict):
    """The architectures; those of the hidden robot are null if every leg is blind."""

    real: str
    hidden: str | None
    real_ascii: str
    hidden_ascii: str | None
    hidden_latex: str | None


class UncheckedRecord(TypedDict):
    """The form that the rules give when no condition is checked."""

    hidden_ascii: str
    equivalent: bool
    largest_angle: Angle
    gains: list[FreedomRecord]
    loses: list[FreedomRecord]
    reason: str


class StepRecord(TypedDict):
    """A rule that was tried."""

    rule: str
    leg: str | None
    accepted: bool
    reason: str
    largest_angle: Angle | None


class CertificateRecord(TypedDict):
    """The comparison of the hidden robot with the real one."""

    samples: int
    discarded: int
    largest_angle: Angle
    smallest_gap: Gap | None
    residual: float
    passed: bool
    reason: str


class OperationModeRecord(TypedDict):
    """What the platform does in an operation mode."""

    dof: int
    motion: str
    mobility: int


class OtherMode(OperationModeRecord):
    """Another operation mode that was met, and a pose in it."""

    words: str
    pose: PoseRecord


class Modes(TypedDict):
    """The operation mode of the zero configuration, and others that were met."""

    operation_mode: OperationModeRecord
    other_modes: list[OtherMode]


class Derive(OfRobot, Modes):
    """The hidden robot, the trace of rules, the certificate, the verdict."""

    observed: list[Watched]
    camera: str
    notation: NotationRecord
    form: Literal["simplified", "general"]
    dof: int
    mobility: MobilityWritten
    verdict: Word
    lost: list[FreedomRecord]
    rank: int
    rank_at_zero: NotRequired[Annotated[int, "at a zero configuration that shows fewer freedoms than others do"]]
    margin: MarginRecord
    formation: NotRequired[FormationRecord]
    point_platform: bool
    has_interaction_matrix: bool
    interaction_matrix: bool
    architecture: ArchitectureRecord
    unchecked_form: UncheckedRecord | None
    steps: list[StepRecord]
    certificate: CertificateRecord
    equal_where: list[str]
    hidden_file: str | None
    report_file: str | None
    certificate_file: str | None


class LegSet(TypedDict):
    """A set of watched legs."""

    legs: list[str]
    verdict: Word
    rank: int
    lost: list[FreedomRecord]
    gap: Gap
    has_interaction_matrix: bool
    interaction_matrix: bool
    margin: MarginRecord
    rank_at_zero: NotRequired[Annotated[int, "at a zero configuration that shows fewer freedoms than others do"]]
    formation: NotRequired[FormationRecord]
    exact: bool
    architecture: ArchitectureRecord


class LegsAnswer(OfRobot, Modes):
    """Sets of watched legs, all if `complete`; `minimal` are the smallest of the best rank, all of these if
    `minimal_complete`, else one of which none can be left out."""

    architecture_ascii: str
    dof: int
    sets: list[LegSet]
    complete: bool
    watched: list[WatchedAxis]
    minimal: list[list[str]]
    minimal_complete: bool


class ClassCounts(TypedDict):
    """Zlatanov's six counts over their generic values."""

    RI: int
    RO: int
    II: int
    IO: int
    RPM: int
    IIM: int


class KindsRecord(TypedDict):
    """What one relation says at a configuration; null if a rank is not decided."""

    gap: Gap
    type1: bool | None
    type2: bool | None
    type3: bool | None
    classes: ClassCounts | None
    lost: list[FreedomRecord]


class RealKinds(KindsRecord):
    """What the motors determine."""

    rank: int


class ConstraintRecord(TypedDict):
    """Whether the loops lose rank, and the freedoms that the platform has only here."""

    singular: bool | None
    rank_lost: int | None
    gained: list[FreedomRecord]


class RedundantRecord(TypedDict):
    """Redundant constraints of a loop, named as in the file; `generic`: at generic configurations."""

    loop: str
    rows: int
    generic: bool


class DistancesRecord(TypedDict):
    """How far a configuration is from each kind of singularity (0: there), in characteristic lengths."""

    type2: Number
    type1: Number
    constraints: float
    condition: Number
    mm_per_degree: Number
    degrees_per_degree: Number


class PostureRecord(KindsRecord):
    """Everything about one configuration; ``beyond`` names the joints that are beyond their limits there,
    ``flat_wrists`` S joints made of several R whose axes nearly lie in a plane, and the angle to it (rad)."""

    pose: PoseRecord
    beyond: list[str]
    flat_wrists: dict[str, float]
    mobility: MobilityRecord
    dof: int
    rank_M: int
    condition: Number
    real: RealKinds | None
    constraint: ConstraintRecord
    redundant: list[RedundantRecord]
    distances: DistancesRecord
    formation: NotRequired[FormationRecord]


class GridAxes(TypedDict):
    """The parts of the pose that vary, in order, and their values."""

    axes: list[str]
    x: NotRequired[list[float]]
    y: NotRequired[list[float]]
    z: NotRequired[list[float]]
    phi: NotRequired[list[float]]


class FixedParts(TypedDict, total=False):
    """The parts of the pose that a grid holds fixed."""

    x: float
    y: float
    z: float
    phi: float
    rpy: list[float]


class GridRecord(GridAxes):
    """The grid: what it holds fixed, what it leaves free, the kind of singularity and the distances at each pose."""

    fixed: FixedParts
    free: list[str]
    state: Array
    type2: Array
    type1: Array
    constraints: Array
    condition: Array
    mm_per_degree: Array
    degrees_per_degree: Array


class Unreached(TypedDict):
    """A requested pose, as it was written, and why it is not reached."""

    pose: str
    reason: str


class CheckAnswer(OfRobot, WrittenTo, LimitsLeft):
    """Mobility, ranks, singularities and redundant constraints at poses and over a grid."""

    characteristic_length: float
    observed: list[Watched]
    camera: str
    watched: list[WatchedAxis]
    mobility: MobilityWritten
    configurations: list[PostureRecord]
    unreached: list[Unreached]
    redundant: list[RedundantRecord]
    grid: GridRecord | None


class MeasuredRecord(TypedDict):
    """What is measured, and of what."""

    kind: Literal["directions", "observations", "motors"]
    of: list[str]


class CheckedRecord(TypedDict):
    """How words, expression and rank were compared; the other fields are present if they were."""

    points: int
    disagreements: int
    largest_angle: NotRequired[float]
    smallest_singular_value: NotRequired[Number]
    positive: NotRequired[int]
    negative: NotRequired[int]
    on_locus: NotRequired[int]
    searches: NotRequired[int]


class ExampleRecord(TypedDict):
    """A singular pose: what is lost there, and the singular value a centimetre away."""

    pose: PoseRecord
    lost: list[FreedomRecord]
    singular_value: float
    singular_value_nearby: float


class LocusField(TypedDict):
    """Tables over the plane (null: not reached); singular poses, and pieces of the curve on which they lie, if the
    condition has no sign."""

    expression: list[list[Number]]
    type2: list[list[Number]]
    type1: list[list[Number]]
    poses: list[list[float]]
    curve: list[list[list[float]]]


class LocusRecord(TypedDict):
    """Where a freedom is lost over a plane of poses."""

    axes: dict[str, list[float]]
    fixed: PoseRecord
    reached: int
    hidden: LocusField
    real: LocusField | None


class FactorRecord(TypedDict):
    """A factor of the expression, and what its vanishing means."""

    expression: str
    meaning: str


class Singular(OfRobot, WrittenTo):
    """The Type 2 condition in words and as an expression, and singular poses."""

    measured: MeasuredRecord
    dof: int
    verdict: Word
    lost: list[FreedomRecord]
    always: bool
    never: bool
    unexamined: list[str]
    words: str
    expression: str
    where: dict[str, str]
    factors: list[str]
    parts: list[FactorRecord]
    characteristic_length: float
    checked: CheckedRecord
    examples: list[ExampleRecord]
    locus: LocusRecord | None


class FurtherRecord(TypedDict):
    """A measurement that could be added. An encoder has `actuated`, and as its `axis` the word for the coordinate that
    it reads (null if there is only one); others have the `link`, and a point `at` (m) and an `axis` in its frame (null
    if there are none)."""

    kind: Literal["leg", "direction", "line", "encoder", "offered"]
    of: Annotated[str, "the leg, the link, the joint, or the words of --see"]
    leg: Annotated[str | None, "null: of a joint or a link inside the platform"]
    link: NotRequired[str]
    at: NotRequired[list[float] | None]
    axis: NotRequired[list[float] | str | None]
    actuated: NotRequired[bool]


class CureRecord(TypedDict):
    """A cheapest set of further measurements, and what is seen with it; a measurement costs 1 unless a price is
    given."""

    measurements: list[FurtherRecord]
    verdict: Word
    rank: int
    gap: Gap
    price: float
    rank_at_zero: NotRequired[Annotated[int, "at a zero configuration that shows fewer freedoms than others do"]]


class Advise(OfRobot):
    """What is missing."""

    observed: list[Watched]
    camera: str
    verdict: Word
    rank: int
    dof: int
    lost: list[FreedomRecord]
    nothing_missing: bool
    sets: list[CureRecord]
    size: int
    tried: int
    complete: bool
    undecided: int


class BranchCellRecord(TypedDict):
    """A cell of motor coordinates and its tube, (m, rad): |x - centre - slopes (q - middle)| <= radius."""

    low: list[float]
    high: list[float]
    centre: list[float]
    slopes: Annotated[Array, "one row per passive coordinate, one column per motor"]
    radius: list[float]
    weakest: Annotated[float, "a lower bound of the smallest singular value of the loops' Jacobian over the tube"]
    neighbours: Annotated[list[int], "cells with a common face, proved to hold the same closure there"]


class ToggleRecord(TypedDict):
    """Where a proof ends; the joints that were found (numerically) to move there while all motors are held."""

    motors: list[float]
    joints: list[str]
    loops: list[str]
    reason: str


class BranchPartRecord(TypedDict):
    """Motors and the passive coordinates that follow from them."""

    motors: list[str]
    passive: list[str]
    q0: list[float]
    x0: list[float]
    asked: Annotated[Array, "low and high of the requested box"]
    proved: Annotated[Array, "low and high of a box about the zero configuration in the union of the cells"]
    share: Annotated[float, "volume of all cells, as a share of the box"]
    box_share: float
    cells: list[BranchCellRecord]
    toggles: list[ToggleRecord]
    turns: Annotated[dict[str, bool], "whether the closure after a whole turn is that before it"]
    closed_to: Annotated[float, "bound of the equations left out (characteristic lengths, pure numbers)"]
    redundant: str


class BranchLimitRecord(TypedDict):
    """A joint without a motor, its limits and its range in the proved cells (m, rad)."""

    joint: str
    lower: float | None
    upper: float | None
    least: Annotated[float | None, "null if its loop is cut there"]
    most: float | None
    verdict: Annotated[Literal["kept", "passed", "undecided", "not looked at"], "kept and passed are proved"]


class MotorBeyondRecord(TypedDict):
    """A motor that the proved cells take beyond its limits in the file, these, and its range in the cells (m, rad)."""

    motor: str
    lower: float | None
    upper: float | None
    least: float
    most: float


class Branch(OfRobot):
    """The branch of the zero configuration, from motors to passive joints."""

    motors: list[str]
    passive: list[str]
    held: list[str]
    box: str
    tried: int
    parts: list[BranchPartRecord]
    back: Annotated[
        Array | None,
        "low and high of a box of all motors, no two of which give the platform one pose on "
        "the branch (proved); null without a proof",
    ]
    regular: Annotated[bool, "whether the proved box has no Type 1 singularity (proved)"]
    limits: list[BranchLimitRecord]
    motors_beyond: list[MotorBeyondRecord]


class MissRecord(TypedDict):
    """Why a leg of the real robot does not reach a mode, and by how much."""

    leg: str
    reason: str
    by: Number
    unit: str


class PlaceRecord(TypedDict):
    """Where a body of a formation is."""

    link: str
    pose: PoseRecord


class ModeRecord(TypedDict):
    """An assembly mode; its radius is null if it is not known; `fits` says how well all legs fit if only some of them
    place it."""

    pose: PoseRecord
    radius: Number
    radius_m: Number
    radius_rad: Number
    bodies: list[str]
    residual: float
    goal: bool
    reachable: bool | None
    assembly: Literal["yes", "beyond limits", "no", "not found"]
    open: list[str]
    open_couplings: Annotated[list[str], "couplings that were not closed where all legs were"]
    beyond: list[str]
    reasons: list[MissRecord]
    type2_distance: Number
    multiplicity: int
    proved: bool
    rounded: bool
    fits: Number
    opposite: list[str]
    behind: list[str] | None
    places: NotRequired[
        Annotated[
            list[PlaceRecord],
            "of a formation: all bodies, moved by a trivial motion to where they are nearest to the file's",
        ]
    ]


class NearModeRecord(ModeRecord):
    """A pose that a measurement with an error does not tell from the goal; `stable` whether the difference is least
    there, so that the loop rests; `family` that it is one of a connected set."""

    angle: Annotated[float, "largest difference of a measured value (rad; lengths in characteristic lengths)"]
    distance_m: Annotated[float, "from the goal"]
    turned_rad: Annotated[float, "from the goal"]
    stable: bool | None
    family: bool


class MeantRecord(TypedDict):
    """Legs whose joint centres are taken to coincide."""

    where: str
    legs: list[str]
    defect_m: float


class SelfMotionRecord(TypedDict):
    """A motion that leaves the measurements unchanged, as far as it was followed from a pose."""

    pose: PoseRecord
    dimension: int
    links: list[str]
    followed_m: float
    followed_rad: float
    returns: bool
    goal: bool
    met: int
    beyond: Annotated[list[str], "joints that are beyond their limits somewhere on the way"]
    within_m: Annotated[float, "how far the platform went with all joints within their limits"]
    within_rad: float


class ListedModes(OfRobot, WrittenTo, LimitsLeft):
    """Assembly modes, all if `complete`; `complex` is null where no count is proved."""

    kind: Literal["hidden", "real", "formation"]
    at: PoseRecord
    within: str | None
    observed: list[Watched]
    formation: NotRequired[FormationRecord]
    complex: int | None
    complete: bool
    bound: str
    proof: str
    modes: list[ModeRecord]
    motions: list[SelfMotionRecord]
    near_modes: Annotated[list[NearModeRecord], "found, not proved to be all"]
    measurement_bound: Annotated[float, "error (rad) up to which near modes are sought"]
    antipodal: list[ModeRecord]
    degenerate: str | None
    continuum: int | None
    meant: list[MeantRecord]


class AssemblyModesRecord(ListedModes):
    """Assembly modes, and the requested certificate."""

    certificate_file: str | None


class PathEndRecord(TypedDict):
    """An end of a path, and the condition's value there."""

    pose: PoseRecord
    value: float


class CrossingRecord(TypedDict):
    """A leg that changes its working mode, and the pose of the path at which it does."""

    leg: str
    at: int


class SampledRoadRecord(TypedDict):
    """The straight path, sampled: the smallest |value| and where, changes of its sign, the part that was reached."""

    poses: int
    least: float
    at: PoseRecord
    changes: int | None
    reached: float
    lost_from_sight: str | None


class PathRecord(TypedDict):
    """Whether a path without Type 2 singularity joins two poses."""

    observed: list[Watched]
    verdict: Literal["same aspect", "separated", "undecided"]
    certified: bool
    path: list[PoseRecord]
    crossings: list[CrossingRecord]
    point: list[float] | None
    margin: Number
    boxes: int
    value: Literal["expression", "smallest singular value"]
    start: PathEndRecord
    goal: PathEndRecord
    reason: str
    limits: list[str]
    not_considered: str
    sampled: SampledRoadRecord | None


class Path(OfRobot, PathRecord):
    """The same for a robot, and the requested certificate."""

    certificate_file: str | None


class PairRecord(TypedDict):
    """Two modes; `path` is null where the verdict follows from others (`via`)."""

    modes: list[int]
    verdict: str
    certified: bool
    reason: str
    via: list[int]
    path: PathRecord | None


class AspectsRecord(TypedDict):
    """The least and largest possible number of aspects of the modes, and which modes share one."""

    least: int
    most: int
    modes: list[list[int]]


class ExportedPart(TypedDict):
    """Motors with the passive coordinates that they alone decide: how much of the box is proved, and a box that is."""

    motors: list[str]
    share: float
    proved: Annotated[Array, "low and high of each motor (m, rad)"]


class FreeMotorRecord(TypedDict):
    """A motor in no loop, and the interval in which the program answers (m, rad)."""

    motor: str
    lower: float
    upper: float


class Exported(OfRobot, WrittenTo):
    """What the code was made of."""

    lang: Literal["c++", "numpy"]
    motors: list[str]
    passive: list[str]
    held: list[str]
    legs: list[str]
    cells: int
    inverse: Annotated[Literal["closed form", "Newton's method"], "how the program finds the motors of a pose"]
    steps: Annotated[int | None, "steps of Newton's method that are enough in each part (proved), or null"]
    error: Annotated[float | None, "how far an answer is off at most (rad, 1, characteristic lengths; proved), or null"]
    back: Annotated[
        Array | None, "low and high of motors, no two of which give the platform one pose on the branch (proved)"
    ]
    parts: list[ExportedPart]
    limits: list[BranchLimitRecord]
    free: list[FreeMotorRecord]


class AtlasAnswer(ListedModes):
    """Which modes can be reached from each other; `table` is by their numbers."""

    table: list[list[str]]
    pairs: list[PairRecord]
    aspects: AspectsRecord
    cuspidal: bool | None
    section: dict[str, Any] | None


class PassedRecord(TypedDict):
    """A singularity or limit that was passed, and when (s)."""

    kind: str
    time: float


class TrackRecord(TypedDict):
    """The smallest singular value on the way, when (s) it was met, and what was passed."""

    smallest: Number
    at: Number
    crossings: list[PassedRecord] | None


class SpreadRecord(TypedDict):
    """How far noise kept the run from where it would have ended."""

    position_mm: float
    orientation_deg: float
    rms_position_mm: float
    rms_orientation_deg: float
    offset_mm: float
    mean: list[float]


Servo = TypedDict(
    "Servo",
    {
        "command": str,
        "version": str,
        "robot": str,
        "platform": PlatformRecord,
        "file": str | None,
        "observed": list[Watched],
        "camera": str,
        "from": PoseRecord,
        "to": PoseRecord,
        "gain": float,
        "depth": str,
        "sense": Literal["exact", "edges", "pictures"],
        "noise": str | None,
        "ended": str,
        "reason": str,
        "pose": PoseRecord,
        "matched_mode": int | None,
        "modes": list[ModeRecord] | None,
        "type2": TrackRecord,
        "notes": list[str],
        "spread": SpreadRecord | None,
        "unlimited": list[str],
        "times": list[float],
        "error": list[list[float]],
        "poses": list[PoseRecord],
    },
)
Servo.__doc__ = "A servo run: where it ended, and at each time (s) the pose and the error of each direction."


class RestRecord(TypedDict):
    """A pose at which a loop rests; `curvatures` are the eigenvalues of the Hessian of ½ ‖e‖², `rates` enclose those of
    the linearised loop without damping, times −1 / gain; `side` of the Type 2 locus; `met` how many starts led to it.
    """

    pose: PoseRecord
    kind: Literal["goal", "mode", "antipodal", "critical"]
    stable: bool | None
    stability: Literal["stable", "saddle", "unstable", "undecided"]
    error: float
    curvatures: list[float]
    proved: bool
    decided: bool
    rates: list[list[float]]
    side: Literal["goal", "other"] | None
    radius_m: Number
    radius_rad: Number
    reversed: list[str]
    across: list[str]
    singular: str | None
    boundary: bool
    assembly: Literal["yes", "beyond limits"]
    beyond: list[str]
    other_legs: list[str] | None
    met: int
    ways: int


class SignedModesRecord(TypedDict):
    """How many poses have the directions of some legs reversed, complex ones included, and how many by boxes of poses;
    null if that is not known."""

    reversed: list[str]
    modes: int | None
    complex: int | None
    boxes: int | None
    complete: bool


class LockedPlaceRecord(TypedDict):
    """A place `p` (m) of the platform's point at which legs may lock each other; nothing was searched within this
    distance of it."""

    p: list[float]
    within_m: float


class BoxedRestRecord(TypedDict):
    """A pose about which boxes prove exactly one critical point of ½‖e‖² that is not in the list, because the robot
    could not be closed there or the command as computed does not vanish, as where joints lock; `error` encloses ‖e‖;
    `pose` is that of the point alone from which boxes count if the platform's turn follows from it."""

    pose: PoseRecord
    stability: Literal["stable", "saddle", "unstable", "undecided"]
    error: list[float]


class RestCoverRecord(TypedDict):
    """What boxes of platform poses prove about a list of rests: `proved` critical poses; `open` boxes, a `share` of
    all; `within_m` of the goal, null if the legs bound the box. Left out are: sliding rods shorter than `shorter_m`
    (null if there are none); a platform that only translates, in any but one of `turns` turns, at `turned` poses of the
    list; poses at which the joints of the legs `unread` lock; and (null if these were searched) those at which one of
    the legs `unstretched` is stretched or has no length, or `across` watched directions are at right angles to the
    desired ones. `apart` of the list lie where nothing was searched. At `crossings` points of the platform rests fill
    curves, because two legs' joints lock. `alone` are the proved ones that are not in the list, `strangers` of the list
    are not among the proved ones."""

    complete: bool
    proved: int
    boxes: int
    open: int
    share: float
    within_m: Number
    shorter_m: Number
    turns: int
    turned: int
    apart: int
    crossings: int
    locked: list[LockedPlaceRecord]
    unread: list[str]
    unstretched: list[str] | None
    across: int | None
    alone: list[BoxedRestRecord]
    strangers: int
    reason: str | None


class EndingsAnswer(OfRobot, WrittenTo):
    """Poses at which a loop can rest, all in what `cover` holds if `complete`: where all velocities are seen, where
    fewer are (`singular`), and one from each family that fills a curve or surface (`continua`)."""

    at: PoseRecord
    observed: list[Watched]
    camera: str
    complex: int | None
    depth: str
    complete: bool
    cover: RestCoverRecord | None
    signs: list[SignedModesRecord]
    proof: str
    starts: int
    attracting: int
    measured: list[str]
    endings: list[RestRecord]
    singular: list[RestRecord]
    continua: list[RestRecord]


class BasinEndRecord(TypedDict):
    """Where runs end, shown by one of them; how many starts, and what share of all, end there; `pose` and `error` (‖e‖)
    are null if they do not come to rest at one pose."""

    ended: str
    reason: str
    matched_mode: int | None
    pose: PoseRecord | None
    error: Number
    starts: int
    share: float
    example: PoseRecord


class CertifiedRecord(TypedDict):
    """The distance from the goal within which every start in its working mode is proved to end there, and what share of
    the goal's basin among the starts that covers; the larger distance that holds as long as the law is not damped, if
    there is one."""

    words: str
    radius_m: float
    radius_rad: Number
    covered: float
    undamped: str | None


class BasinsAnswer(OfRobot, WrittenTo):
    """Where runs from each pose of a grid end: `cells` are numbers of `ends`, counted from 0, -1 where the robot cannot
    start; `damped` starts meet a singularity on the way. `abreast`: whether they were integrated together; `followed`
    of them were then simulated one by one instead, and of `checked` others `agreed` ended at the same pose."""

    to: PoseRecord
    observed: list[Watched]
    camera: str
    poses: str
    axes: dict[str, list[float]]
    starts: int
    ends: list[BasinEndRecord]
    cells: Array
    damped: int
    abreast: bool
    followed: int
    checked: int
    agreed: int
    certified: CertifiedRecord | None


class ConeRecord(TypedDict):
    """A watched direction, and the half-angle of the cone about it."""

    leg: str
    link: str
    cone_deg: float


class ErrorRecord(TypedDict):
    """The largest error with its direction, and the least; null where a freedom is lost. With three errors or more the
    largest is an upper bound, too large by at most ``gap`` (relative to what is attained)."""

    largest: Number
    direction: list[float] | None
    least: Number
    least_direction: list[float] | None
    anisotropy: Number
    gap: float


class SampledRecord(TypedDict):
    """True errors that were tried."""

    samples: int
    position_mm: float
    orientation_deg: float
    ended_at: list[float]
    not_found: int
    smallest_singular_value: Number
    singular_value_at_pose: Number


class ErrorsRecord(TypedDict):
    """The errors at a pose."""

    pose: PoseRecord
    position_mm: ErrorRecord
    orientation_deg: ErrorRecord
    beyond: list[str]
    sampled: SampledRecord | None


class SpotCheck(TypedDict):
    """Random poses of the grid computed in another way, and the largest difference."""

    poses: int
    difference: float


class ErrorRangeRecord(TypedDict):
    """The least and the largest of the errors that the first order bounds, how many are larger, how many infinite."""

    least: Number
    largest: Number
    loose: int
    infinite: int


class SweptRecord(TypedDict):
    """Poses whose errors are in the file, how many of them are reached, and how many were there before from an
    interrupted sweep."""

    poses: int
    reached: int
    before: int
    position_mm: ErrorRangeRecord
    orientation_deg: ErrorRangeRecord


class AccuracyAnswer(OfRobot, WrittenTo, LimitsLeft):
    """The largest errors at poses; for a plane or grid also its axes and a table of each error, or what was swept to a
    file. ``noise``: by unit (px, m, rad), of observations that are not directions; ``exact``: those without errors."""

    observed: list[Watched]
    camera: str
    cones: list[ConeRecord]
    noise: dict[str, float]
    exact: list[str]
    poses: list[ErrorsRecord]
    axes: NotRequired[list[str]]
    x: NotRequired[list[float]]
    y: NotRequired[list[float]]
    z: NotRequired[list[float]]
    phi: NotRequired[list[float]]
    fixed: NotRequired[FixedParts]
    reached: NotRequired[Array]
    position_mm: NotRequired[Array]
    orientation_deg: NotRequired[Array]
    gap: NotRequired[float]
    checked: NotRequired[SpotCheck | None]
    swept: NotRequired[SweptRecord]


class CountRecord(TypedDict):
    """How many modes there are, and how many the robot was found to reach."""

    count: int | None
    reachable: int | None
    complete: bool
    reason: str | None


class EndCounts(TypedDict):
    """The modes of the two ends; null if they were not requested."""

    start: CountRecord | None
    goal: CountRecord | None


class DecisionRecord(TypedDict):
    """A verdict and why."""

    verdict: str
    reason: str


class LoopEndsRecord(TypedDict):
    """The rests other than the goal that were found to attract, how many and their kinds, and the certified radius;
    null for what is not known, with the reason."""

    attracting: int | None
    kinds: list[str] | None
    radius_mm: float | None
    radius_deg: float | None
    reason: str | None


class CandidateRecord(TypedDict):
    """A set of legs; null for what was not computed. Each error is an upper bound, too large by at most its gap
    (relative to what is attained)."""

    legs: list[str]
    verdict: Word
    discarded: str | None
    examined: bool
    position_mm: Number
    position_gap: Number
    orientation_deg: Number
    orientation_gap: Number
    seen: dict[str, float] | None
    modes: EndCounts
    aspect: DecisionRecord | None
    endings: LoopEndsRecord | None
    run: DecisionRecord | None


class UnexaminedRecord(TypedDict):
    """How many sets were not examined, and why."""

    count: int
    reason: str | None


Select = TypedDict(
    "Select",
    {
        "command": str,
        "version": str,
        "robot": str,
        "platform": PlatformRecord,
        "from": PoseRecord,
        "to": PoseRecord,
        "camera": str,
        "cones": dict[str, float],
        "noise": dict[str, float],
        "sight": dict[str, Any] | None,
        "best": list[str] | None,
        "fewer": str | None,
        "not_examined": UnexaminedRecord,
        "unlimited": list[str],
        "sets": list[CandidateRecord],
    },
)
Select.__doc__ = "The sets for a displacement, ranked; the cones by leg in degrees, noise by its unit (px, m, rad)."


class SliderRecord(TypedDict):
    """A slider: its values, the one at zero, and the distance to a singularity at each."""

    name: str
    unit: str
    values: list[float]
    home: int
    distances: list[Number]


class ShownMode(TypedDict):
    """An assembly mode that is drawn."""

    label: str
    pose: PoseRecord
    reachable: bool | None


class ViewAnswer(OfRobot, WrittenTo):
    """What a 3D view shows."""

    observed: list[Watched]
    camera: str
    dof: int
    shown: dict[str, str]
    distance: Number
    largest_distance: Number
    sliders: list[SliderRecord]
    modes: list[ShownMode]
    notes: list[str]


class ShippedRobot(TypedDict):
    """A robot; for a shipped one also what it is, where it is described and with which dimensions."""

    name: str
    file: str
    architecture_ascii: NotRequired[str]
    dof: NotRequired[int]
    section: NotRequired[str]
    dimensions: NotRequired[str]


class Robots(Head):
    """The robots that come with the package."""

    robots: list[ShippedRobot]


class Convert(OfRobot):
    """A robot that was written in another dialect, and what was lost."""

    file: str
    files: list[str]
    links: int
    joints: int
    warnings: list[str]


class Import(OfRobot):
    """A robot that was read with answers or guesses and written, and the command that does the same without
    questions."""

    file: str
    repeat: str
    links: int
    joints: int
    base: str
    motors: list[str]
    observed: dict[str, str]
    notes: list[str]
    warnings: list[str]


class Verify(Head):
    """A certificate that was accepted, and what it proves."""

    robot: NotRequired[str]
    platform: NotRequired[PlatformRecord]
    file: str
    accepted: bool
    proved: str


class MotorChoiceRecord(TypedDict):
    """A choice of motors of a published robot: the joints driven in each leg, from 1, and the freedoms they see."""

    joints: list[list[int]]
    rank: int


class Entry(TypedDict, total=False):
    """An architecture of the catalog; a refused one has only its word, group, notation and the reason."""

    word: str
    group: str
    notation: str
    refused: str
    base_motors: bool
    choices: list[MotorChoiceRecord]
    condition: str
    confirmed: int
    cure: str
    dof: int
    driven: bool
    exact: bool
    fewest: int
    hidden: str
    idle: int
    instances: int
    legs: int
    lost: list[str]
    minimal: list[list[str]]
    mobility: int
    modes_bound: int
    modes_legs: list[str]
    modes_proof: str
    modes_seen: int
    motion: str
    motor_rank: int
    motors: int
    rank: int
    see: Annotated[str, "what is seen of the platform instead of legs"]
    steps: list[str]
    verdict: Word
    attempt: int | None


class CatalogList(Head):
    """The architectures that fit, among all of these groups."""

    total: int
    groups: list[str]
    entries: list[Entry]


class SmallestSetRecord(TypedDict):
    """A smallest set of legs and its hidden robot; what went wrong where none was derived."""

    legs: list[str]
    hidden: str | None
    problem: str | None
    near: Annotated[int | None, "near modes found, where the entry counts the modes of this set"]


class CatalogShow(Head, WrittenTo):
    """One architecture, drawn and in full; `smallest` is empty where nothing is observed or no geometry is at hand."""

    entry: Entry
    drawing: list[str]
    note: str | None
    smallest: list[SmallestSetRecord]


class BuiltGroup(TypedDict):
    """A group: how many words it has, how many were made now and before; its file is null until it is complete."""

    group: str
    words: int
    now: int
    before: int
    file: str | None


class CatalogBuild(Head):
    """What a build made, or with --check what is stale."""

    groups: NotRequired[list[BuiltGroup]]
    stale: NotRequired[list[str]]


class Differing(TypedDict):
    """A derivation that does not end in what the catalog says."""

    word: str
    derived: str


class CatalogSite(Head):
    """What a site holds, and where it starts."""

    index: str
    architectures: int
    pages: int
    now: int
    differ: list[Differing]


class FindingRecord(TypedDict):
    """What a rule found; `line` is null if it concerns the whole file, `fix` says what to do about it, and `mends`
    whether --fix does so."""

    rule: str
    severity: Literal["error", "warning", "note"]
    file: str
    line: int | None
    message: str
    fix: str | None
    mends: bool


class LintCounts(TypedDict):
    """How many findings are of each severity."""

    error: int
    warning: int
    note: int


class UnreadRecord(TypedDict):
    """A file that could not be opened, or is no document, and why."""

    file: str
    line: int | None
    message: str


class LintAnswer(Head, WrittenTo):
    """What is wrong, doubtful or lost in files; `mended` is what --fix did, `file` where the result is written."""

    files: list[str]
    findings: list[FindingRecord]
    counts: LintCounts
    mended: list[FindingRecord]
    unread: list[UnreadRecord]


RECORDS: dict[str, Any] = dict.fromkeys(("derive", "legs", "check", "modes", "atlas", "path", "singular", "advise")) | {
    "branch": Branch,
    "servo": Servo,
    "endings": EndingsAnswer,
    "basins": BasinsAnswer,
    "accuracy": AccuracyAnswer,
    "select": Select,
    "export": Exported,
    "view": ViewAnswer,
    "verify": Verify,
    "robots": Robots,
    "convert": Convert,
    "import": Import,
    "lint": LintAnswer,
    "catalog build": CatalogBuild,
    "catalog list": CatalogList,
    "catalog show": CatalogShow,
    "catalog site": CatalogSite,
}
"""The type of each command's record."""
