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


class AtlasAnswer(ListedModes):
    """Which modes can be reached from each other; `table` is by their numbers."""

    table: list[list[str]]
    pairs: list[PairRecord]
    aspects: AspectsRecord
    cuspidal: bool | None
    section: dict[str, Any] | None


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


class AuditedKind(TypedDict):
    """How often a kind of disagreement occurs that is settled in this way."""

    kind: str
    settled: str
    number: int


class AuditedSight(TypedDict):
    """How many robots have this verdict, at generic dimensions with all legs watched, and need at least so many legs to
    show as much as all."""

    verdict: str
    fewest: int
    number: int


class AuditedGroup(TypedDict):
    """A group of published robots: how many were compared, and how many move as stated or further; how many of the
    stated losses of rank, and of the stated numbers of working choices of motors, agree."""

    group: str
    robots: int
    without_chain: int
    moves_as_stated: int
    moves_further: int
    not_found: int
    choices: int
    choices_agree: int
    choices_agree_in_stated: int
    choices_not_stated: int
    choices_not_compared: int
    counts: int
    counts_agree: int
    watching: list[AuditedSight]
    kinds: list[AuditedKind]


class TableDisagreementRecord(TypedDict):
    """A figure of a table that differs from what is computed, with its file and line, its kind and what settles it."""

    robot: str
    group: str
    at: str
    kind: str
    theirs: str
    ours: str
    settled: str


class NoLegChain(TypedDict):
    """A robot whose leg chain is in no table."""

    group: str
    robot: str
    chain: str


class CatalogAudit(Head):
    """Published tables compared: `rows` of them, `compared` ones, those that `agree` with everything that is stated;
    `kinds` and `settlements` in words; `file` has the records with their instances modulo primes."""

    folder: str
    rows: int
    compared: int
    agree: int
    groups: list[AuditedGroup]
    kinds: dict[str, str]
    settlements: dict[str, str]
    disagreements: list[TableDisagreementRecord]
    defects: list[str]
    without_chain: list[NoLegChain]
    file: str | None


RECORDS: dict[str, Any] = dict.fromkeys(
    ("derive", "legs", "check", "branch", "servo", "endings", "basins", "accuracy", "select", "export", "lint")
) | {
    "singular": Singular,
    "advise": Advise,
    "modes": AssemblyModesRecord,
    "atlas": AtlasAnswer,
    "path": Path,
    "view": ViewAnswer,
    "verify": Verify,
    "robots": Robots,
    "convert": Convert,
    "import": Import,
    "catalog build": CatalogBuild,
    "catalog list": CatalogList,
    "catalog show": CatalogShow,
    "catalog site": CatalogSite,
    "catalog audit": CatalogAudit,
}
"""The type of each command's record."""
