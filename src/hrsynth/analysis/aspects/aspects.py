"""Aspects of the modes with the same directions: which two lie in one aspect (docs/pages/proofs.md 9).

To lie in one aspect is an equivalence: a path from one mode to a second and one from there to a third join the first
and the third, and what separates two modes separates all that are joined to them. So few pairs are computed, first
those whose legs are in the same working modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Annotated, NamedTuple

from ...errors import PoseReachFailure
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.pose import ModeNumber, PoseLike
from ...options import option
from ...progress import report
from ...records import FLAT, As, Recorded, Shown, recorded
from ...results import Result, Value
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL
from ..analysis_declaration import analysis
from ..modes.modes import AssemblyModes, assemble_at_mode, modes
from ..observation_inputs import CameraLike, LegsLike, Seed, SensorLike
from ..observed import ObservedRobot, RobotLike
from .path import PATH_INTERVALS_MAX, PathAnswer, PathPlanner
from .vector_expressions import NoLegForm
from .verdicts import SAME, SEPARATED, UNDECIDED

if TYPE_CHECKING:
    import networkx as nx

ASPECTS_INTERVALS_MAX = 60_000
"""Largest number of intervals for all paths of the command aspects."""


@dataclass(frozen=True, eq=False, repr=False)
class ModePair(Value, all_recorded=True):
    """Verdict on two modes, by their numbers: ``answer`` is that of ``path`` (None where it was not needed), ``via``
    the modes over which the verdict follows from those of other pairs."""

    numbers: Annotated[tuple[int, int], As("modes")]
    verdict: str
    certified: bool
    reason: str
    via: tuple[int, ...] = ()
    answer: Annotated[PathAnswer | None, As("path"), "null where the verdict follows from others (`via`)"] = None


class AspectsRecord(NamedTuple):
    """Least and largest possible number of aspects of the modes, and which modes share one."""

    least: int
    most: int
    modes: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False, repr=False)
class AspectTable(Result, shown_as="aspects"):
    """Aspects of all modes with the directions at one pose.

    Parameters
    ----------
    aspects
        Path planner of the robot.
    listed
        Modes with the directions at the pose.
    places
        Configuration of the real robot at each mode (None if it was not found assembled).
    pairs
        Verdict on each two modes.
    """

    aspects: PathPlanner
    listed: Annotated[AssemblyModes, FLAT]
    places: tuple[ClosedConfiguration | None, ...]
    pairs: Recorded[tuple[ModePair, ...]]

    @property
    def setup(self) -> ObservedRobot:
        """The observed robot."""
        return self.listed.setup

    def headline(self) -> str:
        """Return the robot, the number of modes and of aspects."""
        return f"{self.listed.headline()}, aspects: {self.aspects_met}"

    def verdict(self, one: int, other: int) -> str:
        """Return the verdict on two modes by their numbers; each mode is in one aspect with itself."""
        return SAME if one == other else self._by_numbers[min(one, other), max(one, other)].verdict

    @cached_property
    def _by_numbers(self) -> dict[tuple[int, int], ModePair]:
        return {pair.numbers: pair for pair in self.pairs}

    @cached_property
    @recorded()
    def table(self) -> list[list[str]]:
        """Verdicts, mode by mode."""
        numbers = range(1, len(self.places) + 1)
        return [[self.verdict(i, j) for j in numbers] for i in numbers]

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Modes at which the robot is assembled, grouped by aspect."""
        found: list[tuple[int, ...]] = []
        for number in (k for k, at in enumerate(self.places, 1) if at is not None):
            if not any(number in group for group in found):
                found.append(
                    tuple(
                        k for k, at in enumerate(self.places, 1) if at is not None and self.verdict(number, k) == SAME
                    )
                )
        return tuple(found)

    @cached_property
    def count(self) -> tuple[int, int]:
        """Least and largest possible number of aspects among them."""
        import networkx as nx

        apart: nx.Graph = nx.Graph()
        apart.add_nodes_from(range(len(self.groups)))
        apart.add_edges_from(
            (i, j) for i, j in combinations(apart, 2) if self.verdict(self.groups[i][0], self.groups[j][0]) == SEPARATED
        )
        return max(map(len, nx.find_cliques(apart)), default=0), len(apart)

    @property
    def aspects_met(self) -> str:
        """Number of aspects, as text."""
        few, many = self.count
        return str(few) if few == many else f"{few} to {many}"

    @property
    def changes(self) -> tuple[ModePair, ...]:
        """Pairs that show that the hidden robot is cuspidal: two modes, each proved to lie within the tube for which
        the path between them is certified."""
        known = [mode.radius < HIDDEN_ROBOT_RESIDUAL_TOL and (mode.proved or mode.goal) for mode in self.listed.modes]
        return tuple(
            pair
            for pair in self.pairs
            if pair.verdict == SAME and pair.certified and all(known[k - 1] for k in pair.numbers)
        )

    @property
    @recorded()
    def cuspidal(self) -> bool | None:
        """True if two modes lie in one aspect; None if that is not shown at this pose: it may be so at others."""
        return True if self.changes else None

    aspects_shared = Shown(
        AspectsRecord, lambda self: AspectsRecord(self.count[0], self.count[1], self.groups), As("aspects")
    )


@analysis(80, examples=("quattro --observe 1,4", "3rrr_m1 --observe 2,1,3 -o aspects.png"))
def aspects(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    at: Annotated[
        PoseLike | ClosedConfiguration | None,
        option(
            "Pose whose directions are fixed, such as x=0.02,y=0.1,z=-0.7 (default: the zero configuration).", "POSE"
        ),
    ] = None,
    seed: Seed = 0,
    budget: int = PATH_INTERVALS_MAX,
) -> AspectTable:
    """Group assembly modes by aspect: which of them are joined by a path without Type 2 singularity.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    at
        Pose whose directions are fixed (metres, radians, base frame; default: the zero configuration).
    seed
        Seed of the random samples and of the road maps.
    budget
        Largest number of intervals for one path; ``ASPECTS_INTERVALS_MAX`` for all of them.

    Returns
    -------
    AspectTable
        Modes, as of ``modes``, a verdict on each two of them, as of ``path``, and whether they show that the hidden
        robot is cuspidal. Modes at which the real robot was not found assembled are undecided.

    Raises
    ------
    BadRequest, PoseReachFailure, GeometryAmbiguous
        As for ``modes``.

    Notes
    -----
    A robot is *cuspidal* if a path without Type 2 singularity joins two of its assembly modes (Wenger & Chablat;
    proofs.md 9).

    Examples
    --------
    >>> hrsynth.aspects("rrrrr_m1").aspects_met
    '2'
    """
    listed = modes(robot, observe, camera, sensor=sensor, at=at, seed=seed)
    aspects = PathPlanner.of(listed.setup, seed=seed)
    places = tuple(_place(listed, number) for number in range(1, len(listed.modes) + 1))
    answers: dict[tuple[int, int], PathAnswer] = {}
    spent = 0
    for one, other in _sort_pairs(aspects, places):
        if spent >= ASPECTS_INTERVALS_MAX or _find_mode_chain(answers, one, other) is not None:
            continue
        start, goal = places[one - 1], places[other - 1]
        assert start is not None
        assert goal is not None
        report("paths")
        answers[one, other] = aspects.join(start, goal, seed=seed, budget=min(budget, ASPECTS_INTERVALS_MAX - spent))
        spent += answers[one, other].boxes
    return AspectTable(
        aspects,
        listed,
        places,
        tuple(_pair(listed, places, answers, numbers) for numbers in combinations(range(1, len(places) + 1), 2)),
    )


def _place(listed: AssemblyModes, number: int) -> ClosedConfiguration | None:
    try:
        return assemble_at_mode(listed, ModeNumber(number))
    except PoseReachFailure:
        return None


def _sort_pairs(aspects: PathPlanner, places: Sequence[ClosedConfiguration | None]) -> list[tuple[int, int]]:
    """Sort the pairs of assembled modes: first those that differ in the fewest working modes of legs."""
    working: dict[int, tuple[float, ...]] = {}
    for number, at in enumerate(places, 1):
        if at is not None:
            try:
                working[number] = aspects.enclosure(at).forms.modes
            except NoLegForm:
                working[number] = ()
    return sorted(
        combinations(working, 2),
        key=lambda pair: (sum(a != b for a, b in zip(*(working[number] for number in pair), strict=False)), pair),
    )


def _find_mode_chain(answers: dict[tuple[int, int], PathAnswer], one: int, other: int) -> tuple[str, list[int]] | None:
    """Return what known verdicts imply for two modes, and the modes over which: a chain of pairs in one aspect, at most
    one of which is separated instead (None if they imply nothing)."""
    import networkx as nx

    joined: nx.Graph = nx.Graph([pair for pair, answer in answers.items() if answer.verdict == SAME])
    joined.add_nodes_from((one, other))
    ways = [nx.single_source_shortest_path(joined, end) for end in (one, other)]
    if other in ways[0]:
        return SAME, ways[0][other]
    for pair, answer in answers.items():
        for a, b in (pair, pair[::-1]):
            if answer.verdict == SEPARATED and a in ways[0] and b in ways[1]:
                return SEPARATED, [*ways[0][a], *ways[1][b][::-1]]
    return None


def _pair(
    listed: AssemblyModes,
    places: Sequence[ClosedConfiguration | None],
    answers: dict[tuple[int, int], PathAnswer],
    numbers: tuple[int, int],
) -> ModePair:
    """Return the verdict on two modes."""
    answer = answers.get(numbers)
    if answer is not None and answer.verdict != UNDECIDED:
        return ModePair(numbers, answer.verdict, answer.certified, answer.reason, (), answer)
    found = _find_mode_chain(answers, *numbers)
    if found is not None:
        verdict, way = found
        certified = all(answers[min(step), max(step)].certified for step in pairwise(way))
        said = " and ".join(f"{a}, {b}" for a, b in pairwise(way))
        return ModePair(numbers, verdict, certified, f"follows from modes {said}", tuple(way[1:-1]))
    if answer is not None:
        return ModePair(numbers, UNDECIDED, False, answer.reason, (), answer)
    missing = [str(k) for k in numbers if places[k - 1] is None]
    if not missing:
        return ModePair(numbers, UNDECIDED, False, "limit of intervals for all paths reached")
    of_modes = {listed.modes[int(k) - 1].assembly for k in missing}
    return ModePair(
        numbers,
        UNDECIDED,
        False,
        f"assembly of the real robot at mode {' and '.join(missing)}: {', '.join(sorted(of_modes))}",
    )
