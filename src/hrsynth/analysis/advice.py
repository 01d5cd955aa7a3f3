"""Suggestions: the cheapest sets of further observations that make a robot controllable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from math import comb
from typing import Annotated, Literal, NotRequired, TypedDict

import numpy as np

from ..description.observation_text import expand_candidates, split_offers
from ..errors import BadRequest, HrsynthError, UndecidedRank
from ..geometry import lines
from ..geometry.ranks import compute_kernel_basis, compute_largest_angle, compute_range_basis, compute_singular_values
from ..geometry.vectors import Array
from ..kinematics.sampling import Samples
from ..mechanism import Direction, Joint, JointType, Mechanism, Observation
from ..mechanism.observations import list_kinds
from ..mechanism.sensors import locate_observed_line, make_encoders, observe_segment
from ..options import OBSERVATION, option, parse_plain_number
from ..progress import report
from ..records import FLAT, GAP, OPTIONAL, As, Recorded, Shown, Word, recorded
from ..results import Result, Value
from ..tolerances import RANK_CUTOFF_FRACTION, RELATION_ANGLE_TOL
from .analysis_declaration import analysis
from .freedoms import Freedom
from .observation_inputs import CameraLike, LegsLike, Seed, SensorLike, normalise_texts
from .observed import ObservedRobot, RobotLike, read_robot
from .verdict import AT_REST, CONTROLLABLE, Verdict, compute_verdict

COST_DIFFERENCE_TOL = 1e-9
"""Relative difference below which two costs are equal."""

AXES = {JointType.UNIVERSAL: ("first", "second"), JointType.CYLINDRICAL: ("slide", "turn")}
"""The names of the coordinates of joints that have two."""


Kind = Literal["leg", "direction", "line", "encoder", "offered"]


class FurtherRecord(TypedDict):
    """Candidate observation. An encoder has `actuated`, and as its `axis` the name of the coordinate that it reads
    (null if there is only one); others have the `link`, and a point `at` (m) and an `axis` in its frame (null if there
    are none)."""

    kind: Kind
    of: Annotated[str, "leg, link, joint, or text of --sensor"]
    leg: Annotated[str | None, "null: of a joint or a link inside the platform"]
    link: NotRequired[str]
    at: NotRequired[list[float] | None]
    axis: NotRequired[list[float] | str | None]
    actuated: NotRequired[bool]


@dataclass(frozen=True, eq=False, repr=False)
class FurtherMeasurement(Value):
    """Candidate observation. ``kind`` is leg (its default segment), direction (of another link), line (position of a
    line whose direction is observed), encoder or offered (by the user); ``of`` names the leg, link or joint, or repeats
    the text of ``--sensor``. An encoder has the coordinate of the joint that it reads if there are two, and its motor,
    if any."""

    kind: Kind
    of: str
    observation: Observation
    leg: str | None
    axis: str | None = None
    actuated: bool | None = None

    @property
    def name(self) -> str:
        """The name in words: a star marks a joint with a motor."""
        star = "*" if self.actuated else ""
        which = {"first": " (first axis)", "second": " (second axis)", None: ""}
        return f"{self.of}{star}{which.get(self.axis, f' ({self.axis})')}"

    def to_dict(self) -> FurtherRecord:
        """An encoder has the coordinate that it reads, others have their link, point and axis."""
        record: FurtherRecord = {"kind": self.kind, "of": self.of, "leg": self.leg}
        if self.kind == "encoder":
            return {**record, "axis": self.axis, "actuated": bool(self.actuated)}
        seen = self.observation.to_dict()
        return {**record, "link": seen["link"], "at": seen["at"], "axis": seen["axis"]}


def list_candidates(setup: ObservedRobot, offered: Sequence[str] = ()) -> tuple[FurtherMeasurement, ...]:
    """Return all candidates: legs, directions of other links, positions of observed lines, encoders, and those of
    ``offered``, in the form of ``--sensor``."""
    more = [
        FurtherMeasurement("offered", text, each, each.leg) for text, each in zip(offered, setup.offered, strict=True)
    ]
    return (*_list_legs(setup), *_list_directions(setup), *_list_lines(setup), *_list_encoders(setup), *more)


def _list_legs(setup: ObservedRobot) -> Iterator[FurtherMeasurement]:
    for segment in setup.segments:
        if segment.leg not in setup.labels:
            yield FurtherMeasurement("leg", segment.leg, segment, segment.leg)


def _list_directions(setup: ObservedRobot) -> Iterator[FurtherMeasurement]:
    """Segments of all legs but the observed ones and those that a leg is, along the directions that the file
    names where it does; links without a direction are left out."""
    taken = {o.key for o in setup.observed} | {each.observation.key for each in _list_legs(setup)}
    named = {o.key: o for o in setup.all_legs}
    for leg in setup.decomposition.legs:
        ends = (setup.mechanism.platform,) if leg.takes_platform else ()
        for link in (*leg.links, *ends):
            if (leg.label, link) in taken:
                continue
            try:
                yield FurtherMeasurement(
                    "direction",
                    link,
                    named.get((leg.label, link)) or observe_segment(setup.decomposition, link),
                    leg.label,
                )
            except HrsynthError:
                continue


def _list_lines(setup: ObservedRobot) -> Iterator[FurtherMeasurement]:
    for seen in setup.observed:
        if isinstance(seen, Direction):
            yield FurtherMeasurement("line", seen.link, locate_observed_line(setup.decomposition, seen), seen.leg)


def _list_encoders(setup: ObservedRobot) -> Iterator[FurtherMeasurement]:
    """Encoders on all joints of the normal form, those with motors first; joints between links of an articulated
    platform are of no leg."""
    decomposition = setup.decomposition
    owner = {joint: leg.label for leg in decomposition.legs for joint in leg.joints}
    for joint in sorted(decomposition.mechanism.joints.values(), key=lambda joint: not joint.is_actuated):
        leg = owner.get(joint.name)
        for number, encoder in enumerate(make_encoders(decomposition.mechanism, joint, leg or "")):
            axis = AXES[joint.type][number] if joint.type in AXES else None
            if turned := _list_file_joints(setup, joint, number):
                yield FurtherMeasurement("encoder", " and ".join(turned), encoder, leg, None, joint.is_actuated)
            else:
                yield FurtherMeasurement("encoder", joint.name, encoder, leg, axis, joint.is_actuated)


def _list_file_joints(setup: ObservedRobot, joint: Joint, number: int) -> list[str]:
    """The joints of the file of which a joint of the normal form is made, those about its axis of this number; none
    where it is one of the file."""
    axis = joint.axes[min(number, len(joint.axes) - 1)]
    made = [setup.robot.joints[name] for name in setup.normal.made_of.get(joint.name, ())]
    return [each.name for each in made if len(each.axes) == 1 and lines.is_parallel(each.axis, axis)]


ADVICE_PROBES_COUNT = 3
"""Configurations at which all sets are tried; what sees most there is verified at all samples."""
ADVICE_SET_SIZE_MAX = 4
"""Number of observations in the largest sets that are tried."""
LARGEST_COUNT = 20000
"""Sets of one size that are tried."""
MEASURED_VALUE_ROWS_MAX = 6
"""Rows of the largest measured value."""
ADVICE_BATCH_COUNT = 2000
"""Sets that are tried at once."""


@dataclass(frozen=True, eq=False, repr=False)
class SensorSuggestion(Value):
    """Suggested set of observations, with its verdict at all samples."""

    measurements: Recorded[tuple[FurtherMeasurement, ...]]
    verdict: Verdict
    cost: Recorded[float]
    """Total cost of the set; 1 for each observation without a given cost."""

    verdict_record = Shown(Word, lambda self: self.verdict.verdict, As("verdict"))
    rank = Shown(int, lambda self: self.verdict.rank)
    gap = Shown(float, lambda self: self.verdict.gap, GAP)
    rank_at_zero = Shown(int, lambda self: self.verdict.rank_at_zero, OPTIONAL)


@dataclass(frozen=True, eq=False, repr=False)
class Advice(Result, shown_as="advise"):
    """Suggestions of further observations.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    now
        Present verdict.
    sets
        All cheapest sets of the best attainable rank (the smallest ones if all costs are equal); empty if nothing is
        missing or nothing helps.
    tried
        Number of sets that were tried.
    complete
        True if every set of this size and of all smaller ones was tried, and none was left undecided.
    undecided
        Number of sets without a clear rank gap at the samples.
    """

    setup: Annotated[ObservedRobot, FLAT]
    now: Verdict
    sets: Recorded[tuple[SensorSuggestion, ...]]
    tried: Recorded[int]
    complete: Recorded[bool]
    """True if every set of this size and of all smaller ones was tried, and none was left undecided."""
    undecided: Recorded[int] = 0
    """Sets that were promising at the probes, but whose rank has no clear gap at the samples."""

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self.setup.robot.name

    @property
    @recorded()
    def nothing_missing(self) -> bool:
        """True if the robot is controllable as it is, or has nothing to control."""
        return self.now.verdict in (CONTROLLABLE, AT_REST)

    @property
    def has_sufficient_sets(self) -> bool:
        """True if the sets make the robot controllable."""
        return bool(self.sets) and self.sets[0].verdict.verdict == CONTROLLABLE

    @property
    @recorded()
    def size(self) -> int:
        """Number of observations in the smallest set."""
        return min((len(each.measurements) for each in self.sets), default=0)

    def headline(self) -> str:
        """Robot, verdict, and number of suggested sets."""
        found = "nothing is missing" if self.nothing_missing else f"{len(self.sets)} sets of {self.size} more"
        return f"{self.setup.headline()}: {self.now.verdict}, {found}"

    verdict = Shown(Word, lambda self: self.now.verdict)
    rank = Shown(int, lambda self: self.now.rank)
    dof = Shown(int, lambda self: self.now.dof)
    unobserved = Shown(tuple[Freedom, ...], lambda self: self.now.unobserved)


@analysis(
    50,
    examples=(
        "uranesx",
        "quattro --observe 1",
        "quattro --observe 1 --candidate-sensor point:platform,inclination",
        "uranesx --candidate-sensor point:platform --cost point=3",
        "gough_stewart --camera eye=base@0.3,0.1,0 --sensor point:platform@0.1,0,0 --candidate-sensor point:platform",
    ),
)
def advise(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    candidate_sensor: Annotated[
        SensorLike,
        option(
            "What could be observed in addition, as for --sensor; without a point, such as "
            "point:plate, several points of that link; separate more by commas, or repeat.",
            "[CAMERA=]KIND:LINK[@x,y,z/dx,dy,dz/radius]",
            kind=list[str],
            group=OBSERVATION,
        ),
    ] = None,
    cost: Annotated[
        str,
        option(
            "Cost of one observation of each kind, such as encoder=0.5,point=3 (default: 1); sets of the lowest total "
            "cost are suggested. Kinds: leg, direction, line, encoder and those of --candidate-sensor.",
            "KIND=NUMBER",
        ),
    ] = "",
    most: int | None = None,
    seed: Seed = 0,
) -> Advice:
    """Smallest sets of further observations that make a robot controllable.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    candidate_sensor
        Further candidates, texts as for ``sensor``; without a point, ``point:plate``, several points of that link.
    cost
        Cost of one observation of a kind, such as ``encoder=0.5,point=3`` (default: 1).
    most
        Largest number of sets that are verified (default: all).
    seed
        Seed of the random configurations.

    Returns
    -------
    Advice
        Cheapest sets with which u̇ = 0 implies t = 0, each verified at all samples.

    Raises
    ------
    BadRequest
        For unknown names.
    UndecidedRank
        If the present rank has no clear gap.

    Notes
    -----
    Candidates: the default segment of a further leg, the direction of any other link of a leg, the position of a line
    whose direction is observed, an encoder on any joint, and ``candidate_sensor`` (theory.md 6; MMT 5.3).

    Examples
    --------
    >>> hrsynth.advise("3rrr_m1", "1,2")
    <Advice: 3rrr_m1, observing 1, 2: partially controllable, 15 sets of 1 more>
    """
    robot = read_robot(robot)
    length = (robot if isinstance(robot, Mechanism) else robot.robot).length
    offered = [
        each
        for text in normalise_texts(candidate_sensor)
        for one in split_offers(text)
        for each in expand_candidates(one, length)
    ]
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, candidate_sensor=offered or None, seed=seed)
    prices = _parse_costs(cost)
    now = compute_verdict(setup, setup.labels, setup.samples)
    if now.verdict in (CONTROLLABLE, AT_REST):
        return Advice(setup, now, (), 0, True)
    all_samples = list_candidates(setup, offered)
    samples = setup.all_samples.measure((*setup.observed, *(each.observation for each in all_samples)))
    search = Search(samples, len(setup.observed), all_samples)
    costs = [prices.get(_name_kind(each), 1.0) for each in search.useful]
    chosen, complete = search.cheapest(costs)
    report("verification")
    sets = _verify(
        setup,
        samples,
        [(tuple(search.useful[i] for i in places), sum(costs[i] for i in places)) for places in chosen[:most]],
    )
    undecided = len(chosen[:most]) - len(sets)
    best = max((each.verdict.rank for each in sets), default=now.rank)
    kept = tuple(each for each in sets if each.verdict.rank == best)
    return Advice(setup, now, kept, search.tried, complete and not undecided, undecided)


def _name_kind(measurement: FurtherMeasurement) -> str:
    """Return the kind by which a cost is given."""
    return measurement.observation.kind if measurement.kind == "offered" else measurement.kind


def _parse_costs(text: str) -> dict[str, float]:
    """Return the cost of one observation of each kind; raises ``BadRequest``."""
    allowed = sorted({"leg", "direction", "line", "encoder", *list_kinds()})
    found: dict[str, float] = {}
    for part in filter(None, text.split(",")):
        kind, _, number = part.partition("=")
        if kind not in allowed:
            raise BadRequest("--cost: kind of observation", kind, ", ".join(allowed))
        if kind in found:
            raise BadRequest(f"--cost {text}: {kind} is given twice", remedy="Omit one.")
        try:
            found[kind] = parse_plain_number(number)
        except ValueError:
            found[kind] = np.nan
        if not 0 < found[kind] < np.inf:
            raise BadRequest(f"--cost of {kind}", number, "a positive number")
    return found


def _verify(
    setup: ObservedRobot, samples: Samples, sets: Sequence[tuple[tuple[FurtherMeasurement, ...], float]]
) -> list[SensorSuggestion]:
    """Return each set with its cost and its verdict at all samples; sets whose rank has no clear gap are left out."""
    found = list[SensorSuggestion]()
    for added, cost in sets:
        watched = (*setup.observed, *(each.observation for each in added))
        try:
            verdict = compute_verdict(setup, setup.labels, samples.restrict(watched, ways=False))
            found.append(SensorSuggestion(added, verdict, cost))
        except UndecidedRank:
            continue
    return found


class Search:
    """Sets of candidates, tested on the unobserved twists.

    At each probe, N is a basis of the part of ρ in which no observed value moves. A set of rows C of N sees t there iff
    ker C ⊂ ker T, T the twist's rows: what stays lost has dimension rank [C; T] − rank C.
    """

    def __init__(self, samples: Samples, observed: int, all_samples: Sequence[FurtherMeasurement]) -> None:
        self.tried = 0
        kept: list[int] = list(range(len(all_samples)))
        rates: list[list[Array]] = []
        self._twists: list[Array] = []
        unseen: list[list[Array]] = []
        for member in samples.members[:ADVICE_PROBES_COUNT]:
            found = member.relation
            known = found.basis[found.twist_rows : found.rows_of(observed).start]
            N = compute_kernel_basis(known, 1.0)[0]
            self._twists.append(found.twist_part @ N)
            rates.append([found.basis[found.rows_of(observed + i)] for i in kept])
            unseen.append([block @ N for block in rates[-1]])
        kept = [i for i in kept if max(float(np.linalg.norm(blocks[i])) for blocks in unseen) > RANK_CUTOFF_FRACTION]
        kept = _drop_duplicates(kept, all_samples, rates)
        self.useful = tuple(all_samples[i] for i in kept)
        self._rows = [
            np.array([_extend_rows(blocks[i]) for i in kept]).reshape(
                len(kept), MEASURED_VALUE_ROWS_MAX, twist.shape[1]
            )
            for blocks, twist in zip(unseen, self._twists, strict=True)
        ]

    def count_lost(self, sets: Sequence[Sequence[int]]) -> Array:
        """Return the number of dof that stay unobserved with each set, generically: the least over the probes; shape
        (sets,)."""
        places = np.array(sets, dtype=int)
        found = []
        for rows, twist in zip(self._rows, self._twists, strict=True):
            seen = rows[places].reshape(len(places), -1, twist.shape[1])
            both = np.concatenate([seen, np.broadcast_to(twist, (len(places), *twist.shape))], axis=1)
            found.append(_compute_ranks(both) - _compute_ranks(seen))
        return np.min(found, axis=0)

    def cheapest(self, costs: Sequence[float]) -> tuple[list[tuple[int, ...]], bool]:
        """Return all cheapest sets of the rank of all candidates together, and True if all sets that could cost less
        were tried; within the limit the best there are. ``costs`` of single candidates are positive."""
        count, prices = len(self.useful), np.array(costs)
        if not count:
            return [], True
        least, now = (int(self.count_lost([places])[0]) for places in (range(count), ()))
        if least == now:
            return [], True
        best, lowest, chosen, complete = np.inf, np.inf, list[tuple[int, ...]](), True
        for size in range(1, count + 1):
            if best == least and np.sort(prices)[:size].sum() > lowest * (1 + COST_DIFFERENCE_TOL):
                return chosen, complete
            if size > ADVICE_SET_SIZE_MAX:
                break
            complete = complete and comb(count, size) <= LARGEST_COUNT
            sets = islice(combinations(range(count), size), LARGEST_COUNT)
            while batch := list(islice(sets, ADVICE_BATCH_COUNT)):
                report(f"sets of {size}")
                self.tried += len(batch)
                costs = prices[np.array(batch)].sum(axis=1)
                for each, rest, cost in zip(batch, self.count_lost(batch), costs, strict=True):
                    same = rest == best and abs(cost - lowest) <= COST_DIFFERENCE_TOL * lowest
                    if not same and (rest, cost) < (best, lowest):
                        best, lowest, chosen = int(rest), float(cost), []
                    if same or not chosen:
                        chosen.append(each)
        else:
            return chosen, complete
        return chosen, False


def _drop_duplicates(
    kept: Sequence[int], all_samples: Sequence[FurtherMeasurement], rates: Sequence[Sequence[Array]]
) -> list[int]:
    """Leave out a link's direction whose rates equal those of one before it (links joined by P joints only)."""
    spans = {
        i: [compute_range_basis(blocks[i].T, 1.0)[0] for blocks in rates]
        for i in kept
        if all_samples[i].kind in ("leg", "direction")
    }
    left: list[int] = []
    for i in kept:
        twins = (j for j in left if j in spans) if all_samples[i].kind == "direction" else ()
        if not any(
            all(compute_largest_angle(a, b) < RELATION_ANGLE_TOL for a, b in zip(spans[i], spans[j], strict=True))
            for j in twins
        ):
            left.append(i)
    return left


def _extend_rows(block: Array) -> Array:
    """The rows of a candidate, zero rows added up to those of the largest."""
    return np.vstack([block, np.zeros((MEASURED_VALUE_ROWS_MAX - len(block), block.shape[1]))])


def _compute_ranks(matrices: Array) -> Array:
    """The rank of each matrix (k, rows, columns), zero relative to one or to its largest singular value; shape (k,)."""
    return np.asarray(np.sum(compute_singular_values(matrices) > RANK_CUTOFF_FRACTION, axis=1))
