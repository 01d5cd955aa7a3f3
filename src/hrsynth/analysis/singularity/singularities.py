"""The Type 2 singularities of a hidden robot: the condition, checked against the rank, with poses that satisfy it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, NamedTuple

from ...budgets import NEIGHBOUR_STEP
from ...constraints.condition import Condition, always
from ...constraints.excluded_poses import unexamined_poses
from ...constraints.pattern import ConstraintPattern
from ...errors import BadRequest
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import OfConfiguration
from ...kinematics.tasks import solve
from ...kinematics.velocity_relation import ObservationModel, platform_motions, relation
from ...mechanism.pose import Pose
from ...options import option
from ...progress import report
from ...records import As, Recorded, Shown, Word, recorded
from ...results import Result, Value
from ...tolerances import SOLVED
from ..analysis_declaration import analysis
from ..freedoms import Freedom, name_freedoms
from ..measured import MeasuredRobot
from ..observed import POINTS, CameraLike, LegsLike, ObservedRobot, RobotLike, Seed, SeeLike
from ..verdict import Verdict
from .condition_check import Agreement, agreement, weakest

RANDOM_POSES = 10_000
"""Random poses at which words, expression and rank are compared."""
EXAMPLES = 3


@dataclass(frozen=True, eq=False, repr=False)
class Example(OfConfiguration, Value):
    """A singular pose constructed from the condition: the freedoms lost there, Pinocchio's smallest singular value
    there, and the largest a centimetre away."""

    configuration: ClosedConfiguration
    pose: Recorded[Pose]
    unobserved: Recorded[tuple[Freedom, ...]]
    sigma: Annotated[float, As("singular_value")]
    nearby: Annotated[float, As("singular_value_nearby"), "a centimetre away"]


class Measured(NamedTuple):
    """What is measured, and of what."""

    kind: Literal["directions", "observations", "motors"]
    of: list[str]


class Factor(NamedTuple):
    """A factor of the expression, and what its vanishing means."""

    expression: str
    meaning: str


class Unchecked(NamedTuple):
    """Where a freedom is lost everywhere, there is no condition to compare."""

    points: int
    disagreements: int


@dataclass(frozen=True, eq=False, repr=False)
class Singularity(Result, shown_as="singularities"):
    """Where a robot loses a freedom of its platform with respect to what is measured: what is observed, or its own
    motors."""

    setup: ObservedRobot
    observation_model: ObservationModel
    real: bool
    verdict: Verdict
    pattern: ConstraintPattern
    condition: Condition | None
    """None where a freedom is lost everywhere."""
    words: Recorded[str]
    checked: Agreement | None
    examples: Recorded[tuple[Example, ...]]

    @property
    @recorded()
    def always(self) -> bool:
        """Whether a freedom is lost everywhere: partial controllability."""
        return self.condition is None

    @cached_property
    @recorded()
    def unexamined(self) -> tuple[str, ...]:
        """Poses to which the condition does not apply, in words; none where it is computed at each pose anew."""
        return unexamined_poses(self.setup.decomposition, self.pattern, self.condition, self.setup.configurations)

    def headline(self) -> str:
        """The robot and the condition in words."""
        return f"{self.setup.headline()}: {self.words}"

    @property
    @recorded()
    def measured(self) -> Measured:
        """What is measured, and of what."""
        seen = self.observation_model.observations
        if not self.real and not all(o.by_segment for o in seen):
            return Measured("observations", [each.leg for each in seen])
        return Measured("motors" if self.real else "directions", [getattr(o, "joint", o.link) for o in seen])

    dof = Shown(int, lambda self: self.verdict.dof)
    verdict_record = Shown(Word, lambda self: self.verdict.verdict, As("verdict"))
    unobserved = Shown(tuple[Freedom, ...], lambda self: self.verdict.unobserved)
    never = Shown(bool, lambda self: self.condition is not None and self.condition.never)
    expression = Shown(str, lambda self: "0" if self.condition is None else str(self.condition.expression))
    where = Shown(dict[str, str], lambda self: {} if self.condition is None else self.condition.where)
    factors = Shown(list[str], lambda self: [] if self.condition is None else self.condition.factors)

    @property
    @recorded()
    def parts(self) -> list[Factor]:
        """The factors of the expression, and what it means that they vanish."""
        return [] if self.condition is None else [Factor(str(part), meaning) for part, meaning in self.condition.parts]

    characteristic_length = Shown(float, lambda self: self.setup.mechanism.length)
    checked_record = Shown(
        Agreement | Unchecked, lambda self: Unchecked(0, 0) if self.checked is None else self.checked, As("checked")
    )


@analysis(
    40,
    examples=(
        "quattro --observe 1,4",
        "quattro --observe 1,4 --plane z=-0.7,phi=0 -o locus.png",
        f"gough_stewart {POINTS}",
    ),
)
def singularities(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SeeLike = None,
    real: Annotated[bool, option("Ask about the real robot with its own motors instead of the hidden one.")] = False,
    points: Annotated[
        int, option("Number of random poses at which the condition is checked.", low=1, high=10_000_000)
    ] = RANDOM_POSES,
    seed: Seed = 0,
) -> Singularity:
    """Where a freedom of the platform is lost: the Type 2 condition in words, as an expression and drawn.

    The Type 2 condition of the hidden robot (``real``: of the real robot with its own motors), theory.md 7; MMT 3.3.

    It is computed from the real robot's legs and relation, which are those of the exact lift (theory.md 3).
    Words, expression and rank are compared at ``points`` random reachable poses and at singular poses constructed from
    the expression; raises ``Disagreement`` if they do not agree, ``BadRequest`` if a robot has no motor, or a platform
    that rests while segments of its legs move.

    >>> hrsynth.singularities("rrrrr_m1", points=200)
    <Singularity: rrrrr_m1, watching 1, 2: the tangents τ1, τ2 are parallel>
    """
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed, driven=real)
    measured = MeasuredRobot.of(setup, real)
    observation_model, verdict = measured.observation_model, measured.verdict
    if not verdict.dof:
        raise BadRequest(
            f"{setup.robot.name}: the platform has no freedom to lose",
            setup.mechanism.platform,
            "a platform that can move",
        )
    report("pattern of the legs' wrenches")
    pattern = measured.pattern
    if verdict.rank < verdict.dof:
        words = always(pattern, verdict.never)
        return Singularity(setup, observation_model, real, verdict, pattern, None, words, None, ())
    found = measured.condition
    checked = agreement(
        setup.all_samples.start, observation_model, pattern, found, points, seed=seed, placer=setup.placer
    )
    report("singularities poses")
    examples = tuple(_example(setup, observation_model, at) for at in checked.on_locus[:EXAMPLES])
    return Singularity(setup, observation_model, real, verdict, pattern, found, found.words, checked, examples)


def _example(setup: ObservedRobot, observation_model: ObservationModel, at: ClosedConfiguration) -> Example:
    X = at.pose(observation_model.platform)
    lost = name_freedoms(relation(at, observation_model).unobserved_twists, setup.decomposition, position=X[:3, 3])
    nearby = max(
        (weakest(other, observation_model) for other in neighbours(at, observation_model, NEIGHBOUR_STEP)), default=0.0
    )
    return Example(at, setup.motion.pose(X), lost, weakest(at, observation_model), nearby)


def neighbours(
    at: ClosedConfiguration, observation_model: ObservationModel, distance: float
) -> list[ClosedConfiguration]:
    """Configurations whose platform is ``distance`` (m; of its turn, times the characteristic length) away, to both
    sides in each of its freedoms."""
    motion = platform_motions(at, observation_model)
    found = []
    for column in (*motion.T, *-motion.T):
        q, residual = solve(at.model, at.model.integrate(at.q, column * distance / at.model.length), tolerance=SOLVED)
        if residual <= 10 * SOLVED:
            found.append(ClosedConfiguration.of(at.model, q))
    return found
