"""Verdicts of all sets of observed legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from math import comb
from typing import Annotated, NamedTuple

from ..kinematics.sampling import Samples
from ..mechanism.observation import list_labels
from ..mechanism.pose import parse_pose
from ..progress import report
from ..records import FLAT, As, Recorded, recorded
from ..results import Result
from .analysis_declaration import analysis
from .exact import ExactVerdict, get_architecture
from .observation_inputs import BeginPose, CameraLike, LegsLike, Seed, SensorLike
from .observed import ObservedRobot, RobotLike
from .pose_requests import observe as observed
from .setup_records import OBSERVATIONS, OPERATION_MODE, OTHER_MODES
from .verdict import Verdict, compute_verdict

ALL_LEG_SETS_LEGS_MAX = 10
"""Number of legs up to which all sets are listed; beyond, sets of up to three, the smallest and the whole."""
ALL_FORMATION_SETS_MAX = 6
"""Number of observations of a formation up to which all sets are listed; beyond, single ones, the smallest sets and the
whole."""
EQUAL_SIZE_SETS_MAX = 1024
"""Number of sets of one size above which, instead of all smallest sets, one set is searched of which none can be left
out."""


class LegSet(NamedTuple):
    """Set of observed legs with its verdict."""

    verdict: Annotated[Verdict, FLAT]
    exact: bool
    architecture: ExactVerdict


@dataclass(frozen=True, eq=False, repr=False)
class Legs(Result, shown_as="legs"):
    """Verdict of every set of observed legs, and the smallest sets of the best rank.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    robot, architecture, dof
        Name, architecture notation and platform dof.
    sets
        Verdict of each set.
    exact
        Verdict of each set for generic geometry of the same architecture.
    complete
        True if all sets are listed.
    minimal, minimal_complete
        Smallest sets of the best rank; True if these are all of them.
    where
        Request that replaced the zero configuration.
    """

    setup: ObservedRobot
    robot: Recorded[str]
    architecture: Annotated[str, As("architecture_ascii")]
    dof: Recorded[int]
    sets: tuple[Verdict, ...]
    exact: tuple[ExactVerdict, ...]
    """Verdict for generic geometry of the same architecture, for each of ``sets``."""
    complete: Recorded[bool]
    """True if all sets are listed."""
    minimal: Recorded[tuple[tuple[str, ...], ...]] = field(default=())
    """The smallest sets of the best rank; none where that is 0, as in the catalog."""
    minimal_complete: Recorded[bool] = True
    """True if ``minimal`` has all smallest sets; else it has one of which none can be left out."""
    where: str = "the zero configuration"
    """Request that replaced the zero configuration."""

    def headline(self) -> str:
        """Robot and smallest sets of the best rank."""
        return f"{self.robot}, {len(self.sets)} sets, smallest of the best rank: {self.smallest}"

    @property
    def smallest(self) -> str:
        """The smallest sets as text."""
        return "  ".join("{" + ", ".join(each) + "}" for each in self.minimal) or "none, the best rank is 0"

    @property
    @recorded(As("sets"))
    def sets_record(self) -> list[LegSet]:
        """Sets, each with its verdict for generic geometry of the same architecture."""
        return [LegSet(each, exact.exact, exact) for each, exact in zip(self.sets, self.exact, strict=True)]

    observations = OBSERVATIONS
    operation_mode = OPERATION_MODE
    other_modes = OTHER_MODES


def _find_smallest_sets(
    labels: tuple[str, ...], rank: Callable[[tuple[str, ...]], int]
) -> tuple[list[tuple[str, ...]], bool]:
    """Return the smallest sets of the rank of all, and True if these are all of them. A subset never has a higher rank:
    what cannot be left out of all is in each set of that rank."""
    whole = rank(labels)

    def without(held: tuple[str, ...], label: str) -> tuple[str, ...]:
        return tuple(each for each in held if each != label)

    needed = {label for label in labels if len(labels) == 1 or rank(without(labels, label)) < whole}
    others, kept = [label for label in labels if label not in needed], labels
    for label in others:
        fewer = without(kept, label)
        if fewer and rank(fewer) == whole:
            kept = fewer
    for size in range(max(1, len(needed)), len(kept) + 1):
        more = size - len(needed)
        if comb(len(others), more) > EQUAL_SIZE_SETS_MAX:
            return [kept], False
        sets = [
            tuple(label for label in labels if label in needed or label in chosen)
            for chosen in combinations(others, more)
        ]
        if found := [each for each in sets if rank(each) == whole]:
            return found, True
    return [kept], True


@analysis(
    20,
    examples=(
        "quattro",
        "quattro --observe arm_1,arm_2,rod_3a",
        "quattro --camera platform",
        "delta --observe 1,2 --sensor inclination:rod_1a",
    ),
    formations=True,
)
def legs(
    robot: RobotLike,
    camera: CameraLike = None,
    *,
    observe: LegsLike = None,
    sensor: SensorLike = None,
    at: BeginPose = None,
    seed: Seed = 0,
) -> Legs:
    """Sets of observed legs: their verdicts, the unobserved dof, and the smallest sets of the best rank.

    Parameters
    ----------
    robot
        Mechanism, observed robot, path of a file, or name of a shipped robot.
    camera
        Link that carries the camera (default: the base), or named cameras ``NAME=LINK@x,y,z/r,p,y`` (m, rad).
    observe
        Leg labels or links of which sets are made; default: all legs at their default segments.
    sensor
        Other observations, each counted as one.
    at
        Pose on whose branch the verdicts hold, or ``mode:2``, an assembly mode with all legs observed.
    seed
        Seed of the random configurations.

    Returns
    -------
    Legs
        Verdict of every set, and ``minimal``, the smallest sets of the best rank.

    Raises
    ------
    BadRequest
        For unknown names.
    UndecidedRank
        If a rank has no clear gap.

    Notes
    -----
    A set is controllable if u̇ = 0 implies t = 0 (docs/pages/theory.md, section 6).

    Examples
    --------
    >>> hrsynth.legs("3rrr_m1").minimal
    (('1', '2', '3'),)
    """
    setup = observed(robot, observe, camera, sensor=sensor, at=at, seed=seed)
    decomposition = setup.decomposition
    whole = observe is None and all(each.is_segment_direction for each in setup.observed)
    segments = setup.all_legs if whole else setup.observed
    labels = list_labels(segments)
    sets, exact = list[Verdict](), list[ExactVerdict]()
    generic = get_architecture(setup)
    formation = setup.mechanism.formation
    complete = len(labels) <= (ALL_FORMATION_SETS_MAX if formation else ALL_LEG_SETS_LEGS_MAX)
    few = 1 if formation else 3

    def samples_of(chosen: tuple[str, ...]) -> Samples:
        return setup.all_samples.restrict([each for each in segments if each.leg in chosen], ways=False)

    def rank(chosen: tuple[str, ...]) -> int:
        return max(member.relation.rank for member in samples_of(chosen).members)

    tried = [
        chosen
        for size in range(1, len(labels) + 1)
        if complete or size <= few or size == len(labels)
        for chosen in combinations(labels, size)
    ]
    known = True
    if not complete:
        found, known = _find_smallest_sets(labels, rank)
        tried = sorted({*tried, *found}, key=lambda each: (len(each), [labels.index(label) for label in each]))
    for chosen in tried:
        samples = samples_of(chosen)
        sets.append(compute_verdict(setup, chosen, samples))
        exact.append(generic.verdict(samples.observation_model.observations))
        report("sets of legs", len(sets), len(tried))
    best = max(each.rank for each in sets)
    smallest = min(len(each.legs) for each in sets if each.rank == best)
    minimal = tuple(each.legs for each in sets if best and each.rank == best and len(each.legs) == smallest)
    return Legs(
        setup,
        setup.robot.name,
        decomposition.architecture().ascii,
        setup.dof,
        tuple(sets),
        tuple(exact),
        complete,
        minimal,
        known,
        **({} if at is None else {"where": str(parse_pose(at))}),
    )
