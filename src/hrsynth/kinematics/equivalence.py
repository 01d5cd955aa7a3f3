"""Equivalence check: at generic configurations a hidden robot follows the real one and has the same relation ρ.

Source: docs/pages/theory.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from ..errors import BadMechanism, UndefinedValue
from ..geometry.ranks import CLEAN, compute_largest_angle, compute_matrix_spectra
from ..geometry.vectors import Array
from ..mechanism import Mechanism
from ..records import ANGLE, GAP, Number, Recorded
from ..results import Result
from ..tolerances import CLOSURE_SOLVER_TOL, HIDDEN_ROBOT_RESIDUAL_TOL, RANK_GAP_MIN, RELATION_ANGLE_TOL
from .configuration import ClosedConfiguration
from .path_tracking import track_paths
from .pinocchio_model import PinocchioModel
from .sampling import Sample, Samples
from .tasks import LinkPoses, PoseAndValuesTask, solve
from .velocity_relation import VelocityRelation, compute_relations


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Configuration at which two relations differ; ``position`` is the platform's there (3,)."""

    real: VelocityRelation
    hidden: VelocityRelation
    position: Array


@dataclass(frozen=True, eq=False, repr=False)
class EquivalenceCheck(Result, shown_as="certificate"):
    """Equivalence check of a hidden robot: configurations, the largest angle between ρ and ρ_H, the smallest rank gap,
    the largest residual with which the hidden robot follows; ``reason`` of a failure."""

    samples: Recorded[int]
    discarded: Recorded[int]
    largest_angle: Annotated[float, ANGLE]
    smallest_gap: Annotated[float, Number, GAP]
    residual: Recorded[float]
    passed: Recorded[bool]
    reason: Recorded[str]
    mismatch: Mismatch | None = None

    def headline(self) -> str:
        """Return the verdict and the largest angle."""
        passed = "passed" if self.passed else f"failed, {self.reason}"
        return f"{passed}: largest angle {self.largest_angle:.1e} at {self.samples} configurations"


def check_equivalence(
    samples: Samples,
    hidden: Mechanism,
    *,
    count: int | None = None,
    bodies: tuple[str, ...] = (),
    complete: bool = True,
) -> EquivalenceCheck:
    """Compare ρ of the real robot's samples with ρ of ``hidden`` at the same poses and directions.

    ``bodies`` are further links whose twists must agree too. Only the first ``count`` samples are used. Each actuator
    must be the angle of one direction, and where the hidden robot is ``complete`` each direction must have its own
    actuators (a part-way rewriting is led along every second target, along all where it misses so).
    """
    members = samples.members[:count]
    observation_model = samples.observation_model
    blind = frozenset(o.link for o in observation_model.observations if o.link not in hidden.links)
    asked = replace(observation_model, bodies=bodies)
    angle = worst = 0.0
    gap = CLEAN

    def verdict(reason: str, mismatch: Mismatch | None = None) -> EquivalenceCheck:
        return EquivalenceCheck(len(members), samples.discarded, angle, gap, worst, not reason, reason, mismatch)

    try:
        model = PinocchioModel(hidden, samples.model.length)
    except BadMechanism as error:
        angle = np.pi / 2
        return verdict(str(error))
    active = model.actuated_indices()
    usual = [max(ranks) for ranks in zip(*(member.shown for member in members), strict=True)]
    kept = (
        () if all(o.is_segment_direction for o in observation_model.observations) else _list_kept_links(samples, hidden)
    )
    start = float(np.linalg.norm(model.residual(model.q0)))
    if start > HIDDEN_ROBOT_RESIDUAL_TOL:
        worst = start
        angle = np.pi / 2
        return verdict(f"not assembled at the zero configuration (loop {model.worst_loop(model.q0)[0]!r} misses)")
    ways = [
        [target if not blind else target.of(lambda o: o.link not in blind) for target in member.way]
        for member in members
    ]
    followed = _follow_ways(model, ways if complete else [way[::-2][::-1] for way in ways])
    start_target = observation_model.target(samples.start).of(lambda o: o.link not in blind)
    for denser in (1, EQUIVALENCE_PATH_PARTS_COUNT):
        missed = [i for i, led in enumerate(followed) if not _has_arrived(led)]
        again = [_insert_targets([start_target, *ways[i]], denser) for i in missed]
        for i, led in zip(missed, _follow_ways(model, again), strict=True):
            followed[i] = led
    arrived = list[Array]()
    for led in followed:
        if isinstance(led, UndefinedValue) or not _has_arrived(led):
            break
        arrived.append(led[0])
    if kept:
        arrived = [
            _place_at_real_poses(model, q, member, way[-1], kept)
            for q, member, way in zip(arrived, members, ways, strict=False)
        ]
    reached = ClosedConfiguration.several(model, arrived, HIDDEN_ROBOT_RESIDUAL_TOL)
    rows = asked.rows_together(reached, blind)
    hidden_relations = compute_relations(reached, asked, rows)
    real = [member.configuration for member in members[: len(reached)]]
    real_relations = (
        [member.relation for member in members]
        if not bodies
        else compute_relations(real, asked, asked.rows_together(real))
    )
    driven = _parametrise(
        reached, [each[asked.twist_rows :] for each in rows], observation_model.sizes, active, complete
    )
    for number, (member, led) in enumerate(zip(members, followed, strict=True)):
        if isinstance(led, UndefinedValue):
            angle = np.pi / 2
            return verdict(f"cannot follow the real robot: {led}")
        worst = max(worst, led[1])
        if not led[1] <= HIDDEN_ROBOT_RESIDUAL_TOL:
            angle = np.pi / 2
            return verdict(f"cannot follow the real robot: misses by {led[1]:.2g}")
        here = real[number].pose(observation_model.platform)[:3, 3]
        ours, theirs = real_relations[number], hidden_relations[number]
        gap = min(gap, theirs.gap, ours.gap)
        angle = max(angle, compute_largest_angle(ours.basis, theirs.basis))
        if gap < RANK_GAP_MIN:
            return verdict(f"a rank is not clear: gap {gap:.2g}", Mismatch(ours, theirs, here))
        if not angle <= RELATION_ANGLE_TOL:
            return verdict(_describe_difference(ours, theirs, angle), Mismatch(ours, theirs, here))
        if active and member.shown == usual and not driven[number]:
            angle = np.pi / 2
            return verdict("the virtual actuators do not parametrise the observed directions")
    return verdict("")


EQUIVALENCE_PATH_PARTS_COUNT = 8
"""Number of parts between two targets of a path, for a robot that misses one of them."""
Led = tuple[Array, float] | UndefinedValue
"""Configuration to which a robot was led, and its residual; or the observation without a value along the path."""


def _follow_ways(model: PinocchioModel, ways: Sequence[Sequence[PoseAndValuesTask]]) -> list[Led]:
    return list(track_paths(model, ways)) if ways else []


def _insert_targets(way: Sequence[PoseAndValuesTask], parts: int) -> list[PoseAndValuesTask]:
    """Return a path after its first target, with so many parts between two targets."""
    return [one.between(other, part / parts) for one, other in pairwise(way) for part in range(1, parts + 1)]


def _has_arrived(led: Led) -> bool:
    return not isinstance(led, UndefinedValue) and led[1] <= HIDDEN_ROBOT_RESIDUAL_TOL


def _list_kept_links(samples: Samples, hidden: Mechanism) -> tuple[str, ...]:
    """Return the links that a hidden robot keeps with all their joints: their poses do not follow from the platform's
    pose and the observed values."""
    real = samples.model.mechanism
    same = {
        name
        for name, joint in real.joints.items()
        if name in hidden.joints and (hidden.joints[name].type, hidden.joints[name].links) == (joint.type, joint.links)
    }
    return tuple(
        link
        for link in real.links
        if link in hidden.links and link != real.base and all(joint.name in same for joint in real.joints_of(link))
    )


def _place_at_real_poses(
    model: PinocchioModel, q: Array, member: Sample, target: PoseAndValuesTask, kept: tuple[str, ...]
) -> Array:
    """Return the configuration with the kept links where the real robot has them too, if it is found from one
    without."""
    poses = tuple((link, member.configuration.pose(link)) for link in kept)
    found, residual = solve(model, q, LinkPoses(poses, target), tolerance=CLOSURE_SOLVER_TOL)
    return found if residual <= HIDDEN_ROBOT_RESIDUAL_TOL else q


def _describe_difference(ours: VelocityRelation, theirs: VelocityRelation, angle: float) -> str:
    if theirs.dimension != ours.dimension:
        return f"dim ρ becomes {theirs.dimension} instead of {ours.dimension}"
    return f"ρ turns by {angle:.2g} rad"


def _parametrise(
    at: Sequence[ClosedConfiguration], rows: Sequence[Array], sizes: Sequence[int], active: list[int], complete: bool
) -> list[bool]:
    """Return True if, at each configuration, each actuator's rate follows from the rate of one observation alone, and
    (``complete``) each observation's rate from those of its own actuators; ``rows`` are those of the observations."""
    kernels = [each.kernel()[0] for each in at]
    measured = [moved @ kernel for moved, kernel in zip(rows, kernels, strict=True)]
    motors = [kernel[active] for kernel in kernels]
    explained = [np.zeros(len(active), dtype=bool) for _ in at]
    found = [True] * len(at)
    start = 0
    for size in sizes if active else ():
        seen = [each[start : start + size] for each in measured]
        start += size
        own = [
            np.linalg.norm(motor @ unseen.kernel, axis=1) <= RELATION_ANGLE_TOL
            for motor, unseen in zip(motors, compute_matrix_spectra(seen, 1.0), strict=True)
        ]
        explained = [before | here for before, here in zip(explained, own, strict=True)]
        if complete:
            locked = compute_matrix_spectra([motor[here] for motor, here in zip(motors, own, strict=True)], 1.0)
            found = [
                good and bool(np.linalg.norm(here @ each.kernel) <= RELATION_ANGLE_TOL)
                for good, here, each in zip(found, seen, locked, strict=True)
            ]
    return [good and bool(each.all()) for good, each in zip(found, explained, strict=True)]
