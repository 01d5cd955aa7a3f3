"""Report on one configuration: ranks, kinds of singularities, distances to them, redundant constraints."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Annotated, NamedTuple

import numpy as np

from ..geometry.vectors import Array
from ..kinematics.branch_tests import rank_rotations
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.joint_coordinates import OfConfiguration
from ..kinematics.limits import find_flat_tilts, list_joints_beyond
from ..kinematics.velocity_relation import VelocityRelation, compute_relation, compute_relation_of_rows
from ..mechanism.pose import Pose, PoseForm
from ..records import OPTIONAL, As, Number, Record, Recorded, Shown, recorded
from ..results import Value
from ..tolerances import CACHED_OBSERVED_ROBOTS_COUNT, RANK_GAP_MIN, WAYPOINT_RESIDUAL_TOL
from .formation import Formation, analyze_formation, describe_degeneracy
from .freedoms import Freedom, name_freedoms
from .observed import Mobility, ObservedRobot
from .singularity_indices import (
    Counts,
    Redundancy,
    Rows,
    SingularityIndices,
    compute_interaction_matrix,
    count_redundant_rows,
    find_generic_counts,
    find_generic_rows,
    find_smallest_gap,
    list_redundant,
    subtract_generic_rows,
)

UNDECIDED, REGULAR, CONSTRAINT = "undecided", "regular", "constraint"


@dataclass(frozen=True, eq=False, repr=False)
class SingularityReport(Value, all_recorded=True):
    """Singularities of one velocity relation at a configuration: observed dof, smallest rank gap, singularity indices
    (None if the gap is too small for a verdict) and unobserved dof."""

    rank: int
    gap: Annotated[float, "smallest rank gap"]
    singularity_indices: SingularityIndices | None
    unobserved: tuple[Freedom, ...] = ()

    type1 = Shown(bool | None, lambda self: self.singularity_indices and self.singularity_indices.is_type1)
    type2 = Shown(bool | None, lambda self: self.singularity_indices and self.singularity_indices.is_type2)
    type3 = Shown(bool | None, lambda self: self.singularity_indices and self.singularity_indices.is_type3)

    @property
    def state(self) -> str:
        """The kind of singularity in one word."""
        found = self.singularity_indices
        if found is None:
            return UNDECIDED
        if found.IIM > 0:
            return CONSTRAINT
        return "type3" if found.is_type3 else "type2" if found.is_type2 else "type1" if found.is_type1 else REGULAR


@dataclass(frozen=True)
class SingularityDistances(Record, all_recorded=True):
    """Singularity distances of a configuration (0: singular); lengths in characteristic lengths. ``type2`` is the
    smallest singular value of Mᵀ on the generically observed twists, ``type1`` one over the largest, ``condition`` the
    largest over the smallest; None if Mᵀ does not exist even generically. ``constraints`` is the smallest singular
    value of the loop Jacobian, relative to the largest. ``millimetres`` and ``degrees`` are the platform's motion along
    its least observable twist per degree of direction error; None if it is infinite, if Mᵀ does not exist, or if
    something other than angles is measured."""

    type2: float | None
    type1: float | None
    constraints: float
    condition: float | None
    millimetres: Annotated[float | None, As("mm_per_degree")]
    degrees: Annotated[float | None, As("degrees_per_degree")]


class Constraint(NamedTuple):
    """Constraint singularity of a configuration, with the dof that the platform has only there."""

    singular: bool | None
    rank_lost: int | None
    gained: tuple[Freedom, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ConfigurationReport(OfConfiguration, Value):
    """Report on one configuration."""

    configuration: ClosedConfiguration
    pose: Recorded[Pose]
    mobility: Recorded[Mobility]
    dof: Recorded[int]
    hidden: Annotated[SingularityReport, As(flat=True, without=("rank",))]
    real: Annotated[SingularityReport | None, "what the motors determine"]
    """The real robot with its own motors; None where it has none."""
    distances: Recorded[SingularityDistances]
    gained: tuple[Freedom, ...] = ()
    """At a constraint singularity: dof that the platform has here and not generically."""
    redundant: Recorded[tuple[Redundancy, ...]] = ()
    """Loop constraints that are redundant only here."""
    formation: Annotated[Formation | None, Formation, OPTIONAL] = None
    """For a formation: unobserved motions here; ``pose`` is that of its first link."""
    turns: int = 0
    """Rank of the platform's angular velocities."""

    rank = Shown(int, lambda self: self.hidden.rank)
    condition = Shown(Number, lambda self: self.distances.condition)

    @property
    @recorded()
    def constraint(self) -> Constraint:
        """Constraint singularity of a configuration, with the dof that the platform has only there."""
        lost = None if self.hidden.singularity_indices is None else self.hidden.singularity_indices.IIM
        return Constraint(self.constraint_singular, lost, self.gained)

    @cached_property
    @recorded()
    def beyond_limits(self) -> tuple[str, ...]:
        """The joints that are beyond their limits."""
        return tuple(list_joints_beyond(self.configuration.model, self.configuration.q))

    @cached_property
    @recorded()
    def singular_spherical_joints(self) -> dict[str, float]:
        """S joints that replace several R which are (nearly, rad) at a singularity of their own, which the S does not
        have (docs/pages/theory.md, section 1)."""
        return find_flat_tilts(self.configuration.model, self.configuration.q)

    @property
    def gap(self) -> float:
        """The smallest gap of all ranks."""
        return self.hidden.gap if self.real is None else min(self.hidden.gap, self.real.gap)

    @property
    def has_decided_ranks(self) -> bool:
        """True if every rank has a clear gap."""
        return self.gap >= RANK_GAP_MIN

    @property
    def constraint_singular(self) -> bool | None:
        """True if the loops have lost rank; None if that is not decided."""
        return None if self.hidden.singularity_indices is None else self.hidden.singularity_indices.IIM > 0


@dataclass(frozen=True, eq=False, repr=False)
class ConfigurationAnalysis(Value):
    """Setup with its generic values, to which single configurations are compared."""

    setup: ObservedRobot

    @classmethod
    def of(cls, setup: ObservedRobot) -> ConfigurationAnalysis:
        """Return the analysis of an observed robot: its generic values are computed once."""
        return _build_analysis(setup, setup.form)

    @cached_property
    def usual(self) -> Counts:
        """The generic counts of the observed directions."""
        return find_generic_counts([Counts.of(member.relation) for member in self.setup.samples.members])

    @cached_property
    def usual_real(self) -> Counts:
        """The generic counts of the motors."""
        return find_generic_counts([Counts.of(self._real(at)) for at in self.setup.configurations])

    @cached_property
    def redundant(self) -> Rows:
        """The redundant rows of each loop in general."""
        return find_generic_rows(self.setup.configurations)

    @cached_property
    def _is_always_degenerate(self) -> bool:
        """True if all observed points of a formation lie in a line or plane at every configuration."""
        return all(describe_degeneracy(at, self.setup.samples.observation_model) for at in self.setup.configurations)

    def _real(self, at: ClosedConfiguration) -> VelocityRelation:
        return compute_relation_of_rows(
            at, self.setup.samples.observation_model, np.eye(at.model.nv)[at.model.actuated_indices()]
        )

    def classify(self, at: ClosedConfiguration) -> ConfigurationReport:
        """Report without names: no dof, no redundant constraints."""
        setup = self.setup
        found = compute_relation(at, setup.samples.observation_model)
        told = compute_relation(
            at, replace(setup.all_samples.observation_model, observations=setup.internal_motion_invariants)
        )
        real = self._kinds(self._real(at), self.usual_real) if at.model.actuated_indices() else None
        mobility = Mobility(found.mobility, found.mobility - told.dimension)
        return ConfigurationReport(
            at,
            setup.motion.pose(at.pose(setup.motion.link)),
            mobility,
            found.dof.value,
            self._kinds(found, self.usual),
            real,
            self._distances(at, found),
            turns=rank_rotations(found)[0],
        )

    def examine(self, at: ClosedConfiguration) -> ConfigurationReport:
        """Return the full report on a configuration."""
        posture = self.classify(at)
        hidden, real = posture.hidden, posture.real
        found = compute_relation(at, self.setup.samples.observation_model)
        if self.setup.mechanism.formation:
            here = analyze_formation(at, self.setup.samples.observation_model, found, self.setup.decomposition)
            if (
                special := describe_degeneracy(at, self.setup.samples.observation_model)
            ) and not self._is_always_degenerate:
                here = replace(here, special=special)
            extra = subtract_generic_rows(count_redundant_rows(at), self.redundant)
            return replace(
                posture,
                formation=here if hidden.singularity_indices else None,
                redundant=list_redundant(extra, generic=False),
            )
        hidden = replace(
            hidden, unobserved=self._name_freedoms(at, found.unobserved_twists) if hidden.singularity_indices else ()
        )
        if real is not None and real.singularity_indices:
            real = replace(real, unobserved=self._name_freedoms(at, self._real(at).unobserved_twists))
        extra = subtract_generic_rows(count_redundant_rows(at), self.redundant)
        gained = self._name_freedoms(at, self._gained_twists(found)) if posture.constraint_singular else ()
        return replace(posture, hidden=hidden, real=real, gained=gained, redundant=list_redundant(extra, generic=False))

    @staticmethod
    def _kinds(found: VelocityRelation, usual: Counts) -> SingularityReport:
        gap = find_smallest_gap(found)
        return SingularityReport(
            found.rank, gap, SingularityIndices.of(Counts.of(found), usual) if gap >= RANK_GAP_MIN else None
        )

    def _distances(self, at: ClosedConfiguration, found: VelocityRelation) -> SingularityDistances:
        constraints = 0.0 if found.mobility > self.usual.mobility else at.kernel()[1].weakest
        M = compute_interaction_matrix(found)
        if M is None or self.usual.unexplained:
            reached = None if self.usual.unexplained else 0.0
            return SingularityDistances(None, reached, constraints, None, None, None)
        rank = max(0, found.dof.value - self.usual.unseen)  # a platform may have fewer dof here than are unseen
        _, values, right = np.linalg.svd(M, full_matrices=False)
        largest = float(values[0]) if rank else 0.0
        if not rank or found.rank < rank:
            return SingularityDistances(0.0, 1 / largest if largest else None, constraints, None, None, None)
        weakest = float(values[rank - 1])
        moved = found.twists @ right[rank - 1] / weakest
        if found.twist_rows > 6 or not all(each.angular for each in self.setup.observed):
            return SingularityDistances(weakest, 1 / largest, constraints, largest / weakest, None, None)
        return SingularityDistances(
            weakest,
            1 / largest,
            constraints,
            largest / weakest,
            1e3 * at.model.length * float(np.linalg.norm(moved[:3])) * float(np.radians(1)),
            float(np.linalg.norm(moved[3:])),
        )

    def _gained_twists(self, found: VelocityRelation) -> Array:
        """The platform's twists that it has only here; all of them where the general ones change from pose to pose."""
        if found.dof.value <= self.usual.dof:
            return np.zeros((found.twist_rows, 0))
        usual = self.setup.motion.twists[: found.twist_rows]
        if usual.shape[1] != self.usual.dof:
            return found.twists
        beside = np.linalg.svd(found.twists - usual @ (usual.T @ found.twists), full_matrices=False)[0]
        return np.asarray(beside[:, : found.dof.value - self.usual.dof])

    def _name_freedoms(self, at: ClosedConfiguration, twists: Array) -> tuple[Freedom, ...]:
        """Name twists (3 or 6, k) in characteristic lengths."""
        setup = self.setup
        start = setup.all_samples.start
        at_zero = (
            at.model is start.model
            and np.max(np.abs(at.q - start.q), initial=0.0) < WAYPOINT_RESIDUAL_TOL * WAYPOINT_RESIDUAL_TOL
        )
        position = None if at_zero else at.pose(self.setup.motion.link)[:3, 3]
        return name_freedoms(twists, setup.decomposition, setup.labels, position)


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def _build_analysis(setup: ObservedRobot, form: PoseForm) -> ConfigurationAnalysis:
    """Return one value for equal setups that print poses in one ``form``."""
    return ConfigurationAnalysis(setup)
