"""Derivation of the hidden robot: rewriting, equivalence check, verdict, and the unchecked form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np

from ..description.tree import build_spanning_mechanism
from ..errors import BadMechanism, BadRequest, NoEquivalentRobot
from ..geometry.ranks import compute_range_basis
from ..geometry.vectors import Array
from ..kinematics.equivalence import EquivalenceCheck, check_equivalence
from ..kinematics.sampling import Samples
from ..mechanism import Mechanism
from ..mechanism.legs import LegDecomposition, decompose
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.notation import Architecture
from ..mechanism.observations.direction import Direction
from ..options import option
from ..progress import report
from ..records import ANGLE, FLAT, As, Recorded, Shown, recorded
from ..results import Result, Value
from ..rewrite.evidence import Evidence
from ..rewrite.state import State
from ..rewrite.strategy import FORMS, GENERAL, OBSERVED_STAGES, Check, RewriteTrace, Step, Strategy, apply_unchecked
from ..tolerances import RELATION_ANGLE_TOL
from .analysis_declaration import analysis
from .exact import ExactVerdict
from .exact import get_architecture as exact_architecture
from .freedoms import Freedom, name_freedoms
from .observation_inputs import POINTS, BeginPose, CameraLike, LegsLike, Seed, SensorLike
from .observed import Mobility, ObservedRobot, RobotLike
from .pose_requests import observe as observed_robot
from .setup_records import MOBILITY, OPERATION_MODE, OTHER_MODES
from .verdict import Verdict, compute_verdict

if TYPE_CHECKING:
    from ..mechanism.pose import PoseLike
    from .modes.modes import AssemblyModes

REWRITE_STEP_SAMPLES_COUNT = 3
"""Configurations at which a single step is checked."""


@dataclass(frozen=True, eq=False, repr=False)
class UncheckedForm(Value):
    """Unchecked form: its architecture, its equivalence, and the dof that it gains or loses."""

    hidden: Architecture
    equivalent: Recorded[bool]
    largest_angle: Annotated[float, ANGLE]
    gains: Recorded[tuple[Freedom, ...]] = ()
    loses: Recorded[tuple[Freedom, ...]] = ()
    reason: Recorded[str] = ""

    hidden_ascii = Shown(str, lambda self: self.hidden.ascii)


class Notation(NamedTuple):
    """Architectures; those of the hidden robot are null if every leg is a constant-direction leg."""

    real: str
    hidden: str | None
    real_ascii: str
    hidden_ascii: str | None
    hidden_latex: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Derivation(Result, shown_as="derive"):
    """Derivation of a hidden robot.

    Parameters
    ----------
    robot
        Robot as read.
    setup
        Robot with observations and samples.
    form
        ``simplified`` or ``general``.
    architecture, hidden_architecture
        Architecture notation of the robot and of the hidden robot.
    hidden
        Hidden robot as a mechanism (m, rad, base coordinates), None if every leg is a constant-direction leg.
    verdict
        Controllability at generic configurations.
    exact
        Verdict for generic geometry of the same architecture.
    taken
        All steps; those of the observed legs were compared with the real robot all together.
    equivalence
        Equivalence check of the hidden robot at all samples.
    unchecked
        Unchecked form, None if it was not requested.
    """

    robot: Mechanism
    setup: Annotated[ObservedRobot, FLAT]
    form: Annotated[str, Literal["simplified", "general"]]
    architecture: Architecture
    hidden: Mechanism | None
    hidden_architecture: Architecture | None
    verdict: Verdict
    exact: Annotated[ExactVerdict, As("architecture")]
    """Verdict for generic geometry of the same architecture."""
    taken: tuple[Step, ...]
    """All steps; those of the observed legs were compared with the real robot all together."""
    equivalence: Recorded[EquivalenceCheck]
    unchecked: Annotated[UncheckedForm | None, As("unchecked_form")]

    @cached_property
    @recorded()
    def steps(self) -> tuple[Step, ...]:
        """All attempts, each compared separately with the real robot."""
        check = _check(self.setup.samples, REWRITE_STEP_SAMPLES_COUNT)
        return tuple(step.measured(check) for step in self.taken)

    @property
    @recorded()
    def equal_where(self) -> tuple[str, ...]:
        """Conditions under which ρ equals that of the real robot at a closed configuration of the branch, even a
        singular one (theory.md, section 4); elsewhere the hidden robot may have more or fewer singularities."""
        return tuple(dict.fromkeys(each for step in self.taken if step.accepted for each in step.keeps))

    @property
    @recorded()
    def dof(self) -> int:
        """The robot's dof."""
        return self.setup.dof

    @property
    def mobility(self) -> Mobility:
        """Mobility of the normal form."""
        return self.setup.mobility

    def headline(self) -> str:
        """Robot, observed legs, hidden robot and verdict."""
        legs = ", ".join(self.setup.labels)
        return (
            f"{self.robot.name} {self.architecture}, observing {legs}: "
            f"hidden robot {self.hidden_architecture or 'none'}, {self.verdict.verdict}"
        )

    def modes(self, at: PoseLike | None = None, *, real: bool = False) -> AssemblyModes:
        """Return all poses with the directions (``real``: the motor coordinates) of the pose ``at``, as
        ``hrsynth.modes`` does."""
        from .modes.modes import modes

        return modes(self.setup, at=at, real=real)

    @property
    @recorded()
    def notation(self) -> Notation:
        """Architectures; those of the hidden robot are null if every leg is a constant-direction leg."""
        real, hidden = self.architecture, self.hidden_architecture
        if hidden is None:
            return Notation(real.unicode, None, real.ascii, None, None)
        return Notation(real.unicode, hidden.unicode, real.ascii, hidden.ascii, hidden.latex)

    verdict_record = Shown(Verdict, lambda self: self.verdict, As(flat=True, without=("legs", "gap")))
    mobility_record = MOBILITY
    point_platform = Shown(bool, lambda self: self.setup.decomposition.point is not None)
    operation_mode = OPERATION_MODE
    other_modes = OTHER_MODES


@analysis(
    10,
    examples=(
        "quattro --observe 1,4",
        "quattro --observe 1,4 -o hidden.urdf --report quattro.html",
        "robot.urdf --platform plate --motors hip_1,hip_2,hip_3",
        f"gough_stewart {POINTS}",
    ),
    formations=True,
)
def derive(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    at: BeginPose = None,
    form: Annotated[
        str,
        option("simplified (by all rules) or general (sliders, all legs kept).", words=("simplified", "general")),
    ] = "simplified",
    unchecked: bool = True,
    seed: Seed = 0,
) -> Derivation:
    """Hidden robot of a robot, with its derivation, equivalence check and controllability verdict.

    Parameters
    ----------
    robot
        Mechanism, observed robot, path of a file, name of a shipped robot, or ``example:NAME``.
    observe
        Leg labels or link names; default: what the file observes, else all legs.
    camera
        Link that carries the camera (default: the base), or named cameras ``NAME=LINK@x,y,z/r,p,y`` (m, rad).
    sensor
        Other observations, ``[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius`` (m, link frame).
    at
        Pose that replaces the zero configuration, in another operation mode if necessary, or ``mode:2``, one of its
        assembly modes.
    form
        ``simplified`` (all rules) or ``general`` (sliders, all legs kept).
    unchecked
        True to also return the unchecked form.
    seed
        Seed of the random configurations.

    Returns
    -------
    Derivation
        Hidden robot (a :class:`Mechanism`, None if every leg is a constant-direction leg), steps, equivalence check at
        all samples, verdict.

    Raises
    ------
    BadRequest
        For unknown names.
    NoEquivalentRobot
        If even the exact lift fails the equivalence check.

    Notes
    -----
    MMT 3.2; docs/pages/theory.md, sections 3 to 5. An observed robot already has its observations.

    Examples
    --------
    >>> found = hrsynth.derive("3rrr_m1", [1, 2, 3])
    >>> found
    <Derivation: 3rrr_m1 3-R̲RR, observing 1, 2, 3: hidden robot 3-ΠR̲R, controllable>
    >>> found.verdict == "controllable"
    True
    """
    if form not in FORMS:
        raise BadRequest("--form", form, tuple(FORMS))
    setup = observed_robot(robot, observe, camera, sensor=sensor, at=at, seed=seed)
    decomposition, samples = setup.decomposition, setup.samples
    verdict = compute_verdict(setup, setup.labels, samples)
    exact = exact_architecture(setup).verdict(setup.observed)
    evidence = Evidence(decomposition, samples)

    for trusted in (OBSERVED_STAGES, ()):
        result = FORMS[form](RewriteTrace.of(evidence, _check(samples, REWRITE_STEP_SAMPLES_COUNT), trusted))
        hidden, certificate = _check_hidden_robot(setup, result.state, samples)
        if hidden is not None and certificate.passed and result.has_virtual_motors_only:
            break
    architecture: Architecture | None = None
    without_checks = None
    if hidden is not None:
        if not (certificate.passed and result.has_virtual_motors_only):
            result, hidden, certificate = _derive_again(setup, evidence, samples, certificate, FORMS[form])
        architecture = result.state.architecture()
        segments = all(each.is_segment_direction for each in setup.observed)
        if unchecked and form == "simplified" and architecture is not None and segments:
            report("the unchecked form")
            without_checks = _derive_unchecked(setup, evidence, samples, architecture, certificate)
    elif not certificate.passed:
        raise NoEquivalentRobot(setup.robot.name, certificate.largest_angle, RELATION_ANGLE_TOL)
    return Derivation(
        setup.robot,
        setup,
        form,
        decomposition.architecture(),
        hidden,
        architecture,
        verdict,
        exact,
        result.steps,
        certificate,
        without_checks,
    )


def _check_hidden_robot(
    setup: ObservedRobot, state: State, samples: Samples
) -> tuple[Mechanism | None, EquivalenceCheck]:
    """Return the hidden robot (None if every leg is a constant-direction leg) and its equivalence check at all
    samples."""
    if not state.actuators:
        return None, _check_without_legs(samples)
    report("certificate")
    hidden = build_final_robot(setup, state)
    return hidden, check_equivalence(samples, hidden)


def build_final_robot(setup: ObservedRobot, state: State) -> Mechanism:
    """The hidden robot as a file writes it: a spanning tree, names of its own, its observations; its platform turns
    where the real one does. Of a formation, whose bodies are joined now, the first one is the platform."""
    mechanism = state.mechanism
    observations = tuple(o for o in setup.observed if {o.link, o.seen_from or o.link} <= mechanism.links.keys())
    cameras = tuple(camera for camera in mechanism.cameras if camera.link in mechanism.links)
    hidden = build_spanning_mechanism(
        replace(
            mechanism,
            name=f"{setup.robot.name}_hidden",
            observations=observations,
            cameras=cameras,
            file=None,
            formation=False,
        )
    )
    return _note_rotation(hidden, turns=setup.samples.observation_model.point is None)


def _note_rotation(hidden: Mechanism, turns: bool) -> Mechanism:
    """Set on a mechanism whether its platform ``turns``, if its joints leave that open, and its observations; a segment
    in none of its legs (of a single leg the platform) becomes a direction of its link. Without a leg on the base, as in
    a formation, it stays as it is."""
    told = tuple(
        replace(o, seen_from=hidden.reference) if isinstance(o, Direction) and o.is_segment_direction else o
        for o in hidden.observations
    )
    try:
        decomposition = decompose(reduce_to_normal_form(replace(hidden, observations=told, turns=None)).mechanism)
    except BadMechanism:
        return hidden
    observations = tuple(
        own if decomposition.leg_of(own.link) else other for own, other in zip(hidden.observations, told, strict=True)
    )
    return replace(hidden, observations=observations, turns=None if turns == (decomposition.point is None) else turns)


def _check(samples: Samples, count: int | None) -> Check:
    """The check of a single step, at the first ``count`` samples (None: at all)."""
    return lambda mechanism, bodies: check_equivalence(samples, mechanism, count=count, bodies=bodies, complete=False)


def _derive_again(
    setup: ObservedRobot, evidence: Evidence, samples: Samples, failed: EquivalenceCheck, asked: Strategy
) -> tuple[RewriteTrace, Mechanism, EquivalenceCheck]:
    """Repeat the derivation if the check at all samples fails after that at three: check every step of the requested
    form at all samples, then of the general form."""
    for run in dict.fromkeys((asked, GENERAL)):
        again = run(RewriteTrace.of(evidence, _check(samples, None)))
        hidden = build_final_robot(setup, again.state)
        certificate = check_equivalence(samples, hidden)
        if certificate.passed and again.has_virtual_motors_only:
            return again, hidden, certificate
    raise NoEquivalentRobot(setup.robot.name, failed.largest_angle, RELATION_ANGLE_TOL)


def _check_without_legs(samples: Samples) -> EquivalenceCheck:
    """Return the equivalence check of constant-direction legs: the directions do not move at all."""
    angle = max(
        float(np.linalg.norm(member.relation.rates, 2)) if member.relation.dimension else 0.0
        for member in samples.members
    )
    gap = min(member.relation.gap for member in samples.members)
    passed = angle <= RELATION_ANGLE_TOL
    reason = "u̇ vanishes: every observed direction is constant" if passed else "an observed direction moves"
    return EquivalenceCheck(len(samples.members), samples.discarded, angle, gap, 0.0, passed, reason)


def _derive_unchecked(
    setup: ObservedRobot, evidence: Evidence, samples: Samples, certified: Architecture, certificate: EquivalenceCheck
) -> UncheckedForm:
    """Apply the rules without checking their conditions, and compare what they give with the real robot.

    The ends of the legs are changed only where the hidden robot would not keep its dof otherwise (MMT 3.2).
    """
    dof = setup.dof
    planar = _is_planar(samples)
    change = dof < (3 if planar else 6) and len(samples.observation_model.observations) < len(setup.decomposition.legs)
    tried: list[tuple[EquivalenceCheck, Architecture]] = []
    for rewriting in apply_unchecked(evidence, change_ends=change):
        architecture = rewriting.state.architecture()
        if architecture == certified:
            return UncheckedForm(
                architecture, True, certificate.largest_angle, reason="it is the form that passed the equivalence check"
            )
        found = check_equivalence(samples, rewriting.state.mechanism, count=REWRITE_STEP_SAMPLES_COUNT, complete=False)
        if found.passed:
            reason = "equivalent, but not the simplest form"
            return UncheckedForm(architecture, True, found.largest_angle, reason=reason)
        tried.append((found, architecture))
    found, architecture = min(reversed(tried), key=lambda pair: pair[0].largest_angle)
    gains, loses = _compare_platform_dof(setup.decomposition, found)
    return UncheckedForm(architecture, False, found.largest_angle, gains, loses, found.reason)


def _is_planar(samples: Samples) -> bool:
    """Return True if all platform motions are those of one plane."""
    twists = np.hstack([member.relation.twists for member in samples.members])
    if twists.shape[0] == 3:
        return compute_range_basis(twists, 1.0)[1].value <= 2
    return compute_range_basis(twists[3:], 1.0)[1].value <= 1 and compute_range_basis(twists[:3], 1.0)[1].value <= 2


def _compare_platform_dof(
    decomposition: LegDecomposition, found: EquivalenceCheck
) -> tuple[tuple[Freedom, ...], tuple[Freedom, ...]]:
    """Return the platform dof that a non-equivalent robot gains and loses, at the configuration where they differ."""
    if found.mismatch is None or found.mismatch.real.twist_rows != 6:
        return (), ()
    real, hidden, position = found.mismatch.real, found.mismatch.hidden, found.mismatch.position

    def beyond(inner: Array, outer: Array) -> tuple[Freedom, ...]:
        rest = compute_range_basis(inner - outer @ (outer.T @ inner), 1.0)[0]
        return name_freedoms(rest, decomposition, position=position)

    gains, loses = beyond(hidden.twists, real.twists), beyond(real.twists, hidden.twists)
    if not gains and not loses:
        ours, theirs = real.unobserved_twists, hidden.unobserved_twists
        gains, loses = beyond(theirs, ours), beyond(ours, theirs)
    return gains, loses
