"""The Type 2 singularities of a hidden robot: the condition, checked against the rank, with poses that satisfy it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, NamedTuple

from ...constraints.condition import Condition, describe_permanent_loss
from ...constraints.excluded_poses import describe_excluded_poses
from ...constraints.pattern import ConstraintPattern
from ...errors import BadRequest
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.joint_coordinates import OfConfiguration
from ...kinematics.limits import list_joints_beyond
from ...kinematics.tasks import solve
from ...kinematics.velocity_relation import ObservationModel, compute_platform_motions, compute_relation
from ...mechanism.pose import Pose
from ...options import option
from ...progress import report
from ...records import As, Recorded, Shown, Word, recorded
from ...results import Result, Value
from ...tolerances import CLOSURE_SOLVER_TOL
from ..analysis_declaration import analysis
from ..freedoms import Freedom, name_freedoms
from ..measured import MeasuredRobot
from ..observation_inputs import POINTS, CameraLike, LegsLike, Seed, SensorLike
from ..observed import ObservedRobot, RobotLike
from ..setup_records import LIMITS_IGNORED
from ..verdict import Verdict
from .condition_check import Agreement, compare_condition, compute_smallest_value

SINGULAR_NEIGHBOUR_STEP_M = 0.01
"""Distance of the neighbours of a singular pose (m)."""

CONDITION_RANDOM_POSES_COUNT = 10_000
"""Random poses at which words, expression and rank are compared."""
SINGULARITY_EXAMPLES_COUNT = 3


@dataclass(frozen=True, eq=False, repr=False)
class Example(OfConfiguration, Value):
    """Singular pose constructed from the condition: unobserved dof, Pinocchio's smallest singular value there, and the
    largest at 1 cm distance; joints beyond their limits."""

    configuration: ClosedConfiguration
    pose: Recorded[Pose]
    unobserved: Recorded[tuple[Freedom, ...]]
    sigma: Annotated[float, As("singular_value")]
    nearby: Annotated[float, As("singular_value_nearby"), "at 1 cm distance"]
    beyond_limits: Recorded[tuple[str, ...]]


class MeasuredValues(NamedTuple):
    """Measured values, hidden or real robot."""

    kind: Literal["directions", "observations", "motors"]
    of: list[str]


class Factor(NamedTuple):
    """Factor of the expression, and the meaning of its zero."""

    expression: str
    meaning: str


class UncheckedCondition(NamedTuple):
    """Check that is omitted, since a dof is unobserved everywhere."""

    points: int
    disagreements: int


@dataclass(frozen=True, eq=False, repr=False)
class Singularity(Result, shown_as="singularities"):
    """Type 2 condition of a robot with respect to its measured values.

    Parameters
    ----------
    setup
        Robot with observations and samples.
    observation_model
        Map from configurations to measured values and their rates.
    real
        True for the real robot: the measured values are its motor coordinates.
    verdict
        Controllability at generic configurations.
    pattern
        Constraints of the locked legs on the platform.
    condition
        Condition in words and as an expression, None if a dof is unobserved everywhere.
    words
        Condition, or ``always`` with the unobserved dof.
    checked
        Comparison of words, expression and rank, None if a dof is unobserved everywhere.
    examples
        Singular poses constructed from the condition, those within joint limits first.
    """

    setup: ObservedRobot
    observation_model: ObservationModel
    real: bool
    verdict: Verdict
    pattern: ConstraintPattern
    condition: Condition | None
    """Condition, None if a dof is unobserved everywhere."""
    words: Recorded[str]
    checked: Agreement | None
    examples: Recorded[tuple[Example, ...]]

    @property
    @recorded()
    def always(self) -> bool:
        """True if a dof is unobserved everywhere: partial controllability."""
        return self.condition is None

    @cached_property
    @recorded()
    def unexamined(self) -> tuple[str, ...]:
        """Poses to which the condition does not apply, in words; none where it is computed at each pose anew."""
        return describe_excluded_poses(
            self.setup.decomposition, self.pattern, self.condition, self.setup.configurations
        )

    def headline(self) -> str:
        """The robot and the condition in words."""
        return f"{self.setup.headline()}: {self.words}"

    @property
    @recorded()
    def measured(self) -> MeasuredValues:
        """Measured values, hidden or real robot."""
        seen = self.observation_model.observations
        if not self.real and not all(o.is_segment_direction for o in seen):
            return MeasuredValues("observations", [each.leg for each in seen])
        return MeasuredValues("motors" if self.real else "directions", [getattr(o, "joint", o.link) for o in seen])

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
        """Factors of the expression, and the meaning of their zeros."""
        return [] if self.condition is None else [Factor(str(part), meaning) for part, meaning in self.condition.parts]

    characteristic_length = Shown(float, lambda self: self.setup.mechanism.length)
    checked_record = Shown(
        Agreement | UncheckedCondition,
        lambda self: UncheckedCondition(0, 0) if self.checked is None else self.checked,
        As("checked"),
    )
    limits_ignored = LIMITS_IGNORED


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
    sensor: SensorLike = None,
    real: Annotated[bool, option("Analyse the real robot with its motors instead of the hidden robot.")] = False,
    points: Annotated[
        int, option("Number of random poses at which the condition is checked.", low=1, high=10_000_000)
    ] = CONDITION_RANDOM_POSES_COUNT,
    seed: Seed = 0,
) -> Singularity:
    """Type 2 singularity condition of a robot, in words and as an expression.

    Parameters
    ----------
    robot, observe, camera, sensor
        Robot and observations, as for ``derive``.
    real
        True for the real robot with its motors instead of the hidden robot.
    points
        Number of random reachable poses at which words, expression and rank are compared.
    seed
        Seed of the random configurations.

    Returns
    -------
    Singularity
        Condition, singular poses constructed from it, and the results of the comparison.

    Raises
    ------
    BadRequest
        If the robot has no motor (``real``), or the platform cannot move.
    Disagreement
        If words, expression and rank do not agree.

    Notes
    -----
    The condition is computed from the real robot's legs and velocity relation, which is that of the exact lift
    (docs/pages/theory.md, sections 3 and 7; MMT 3.3).

    Examples
    --------
    >>> hrsynth.singularities("rrrrr_m1", points=200)
    <Singularity: rrrrr_m1, observing 1, 2: the tangents τ1, τ2 are parallel>
    """
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed, driven=real)
    measured = MeasuredRobot.of(setup, real)
    observation_model, verdict = measured.observation_model, measured.verdict
    if not verdict.dof:
        raise BadRequest(
            f"{setup.robot.name}: platform {setup.mechanism.platform!r} cannot move",
            remedy="Choose another --platform.",
        )
    report("pattern of the legs' wrenches")
    pattern = measured.pattern
    if verdict.rank < verdict.dof:
        words = describe_permanent_loss(pattern, verdict.never)
        return Singularity(setup, observation_model, real, verdict, pattern, None, words, None, ())
    found = measured.condition
    checked = compare_condition(
        setup.all_samples.start, observation_model, pattern, found, points, seed=seed, placer=setup.placer
    )
    report("singularities poses")
    examples = tuple(
        _build_example(setup, observation_model, at) for at in checked.on_locus[:SINGULARITY_EXAMPLES_COUNT]
    )
    return Singularity(setup, observation_model, real, verdict, pattern, found, found.words, checked, examples)


def _build_example(setup: ObservedRobot, observation_model: ObservationModel, at: ClosedConfiguration) -> Example:
    X = at.pose(observation_model.platform)
    lost = name_freedoms(
        compute_relation(at, observation_model).unobserved_twists, setup.decomposition, position=X[:3, 3]
    )
    nearby = max(
        (
            compute_smallest_value(other, observation_model)
            for other in find_neighbours(at, observation_model, SINGULAR_NEIGHBOUR_STEP_M)
        ),
        default=0.0,
    )
    beyond = tuple(list_joints_beyond(at.model, at.q))
    return Example(at, setup.motion.pose(X), lost, compute_smallest_value(at, observation_model), nearby, beyond)


def find_neighbours(
    at: ClosedConfiguration, observation_model: ObservationModel, distance: float
) -> list[ClosedConfiguration]:
    """Return configurations whose platform has moved by ``distance`` (m; for rotations times the characteristic
    length), to both sides in each of its dof."""
    motion = compute_platform_motions(at, observation_model)
    found = []
    for column in (*motion.T, *-motion.T):
        q, residual = solve(
            at.model, at.model.integrate(at.q, column * distance / at.model.length), tolerance=CLOSURE_SOLVER_TOL
        )
        if residual <= 10 * CLOSURE_SOLVER_TOL:
            found.append(ClosedConfiguration.of(at.model, q))
    return found
