"""Methods that list modes by tips, and what decides among methods."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...errors import ExternalSolverFailure, HrsynthError, MissingExtra, TooLarge, UnsupportedLocus
from ...kinematics.assembly import build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.pinocchio_model import PinocchioModel
from ...mechanism.observations.encoder import Encoder
from ...mechanism.sensors import make_encoders
from ...solving.platform.pose_conditions import AtAngle
from ...solving.platform.solve import SystemModes
from ..loci.observation_loci import derive_all_loci
from ..measured import MeasuredRobot
from ..observed import ObservedRobot
from .condition_modes import PosedPlatform, bound_posed, solve_posed
from .tip_systems import Model, solve_all


def drop_couplings(
    measured: MeasuredRobot, goal: ClosedConfiguration
) -> tuple[MeasuredRobot, ClosedConfiguration] | None:
    """Return the robot without its couplings, at the same configuration, with its measured values fixed: so are joints
    that couplings join to fixed motors. It has all modes of the robot, and those at which couplings are not closed.
    None if it has no couplings, if not all dof are observed without them, or if observations are of joints that are one
    without them."""
    mechanism, setup = goal.model.mechanism, measured.setup
    if not mechanism.couplings:
        return None
    held = {
        observation.joint for observation in measured.observation_model.observations if isinstance(observation, Encoder)
    }
    ties = [{coupling.driver, coupling.driven} for coupling in mechanism.couplings]
    tied = set(held)
    while more := set().union(*(tie for tie in ties if tie & tied)) - tied:
        tied |= more
    try:
        loose = ObservedRobot.of(replace(setup.mechanism, couplings=(), observations=()))
        at = build_from_link_poses(PinocchioModel(loose.mechanism, goal.model.length), goal.pose)
    except HrsynthError:
        return None
    links, joints = loose.mechanism.links, loose.mechanism.joints
    if not tied <= joints.keys() or any(
        link not in links
        for observation in measured.observation_model.observations
        for link in (observation.link, observation.seen_from or observation.link)
    ):
        return None  # without couplings what they hold apart is one joint
    of = {name: leg.label for leg in loose.decomposition.legs for name in leg.joints}
    seen = (
        *measured.observation_model.observations,
        *(
            encoder
            for name in sorted(tied - held)
            for encoder in make_encoders(loose.mechanism, loose.mechanism.joints[name], of.get(name, ""))
        ),
    )
    uncoupled = MeasuredRobot(loose, loose.all_samples.measure(seen))
    return (
        (uncoupled, at)
        if uncoupled.rank == loose.dof and loose.decomposition.labels == setup.decomposition.labels
        else None
    )


def may_count_more(made: Model) -> bool:
    """Return True if a list is that of a part of the conditions on the pose, as the sense of an axis is known besides:
    another way may count complex modes too."""
    system = made.system
    return isinstance(system, PosedPlatform) and any(isinstance(c, AtAngle) and c.h == 1.0 for c in system.conditions)


def solve_tips(
    measured: MeasuredRobot, goal: ClosedConfiguration, exact: float, as_written: bool, time_limit: float
) -> tuple[Model, SystemModes]:
    """All modes by where the tips of the legs can be, with the goal known to ``exact`` (m)."""
    confined, seen = derive_all_loci(measured, goal)
    # a curve that was fitted to a leg's moves is not known to hold its exact tip
    fitted = confined.doubt is not None or any(tip.doubt is not None for tip in confined.tips)
    confined = replace(
        confined,
        error=np.inf
        if fitted
        else max([exact, *(sight.error(exact, goal) for sight in seen)])
        + max([*(tip.moved for tip in confined.tips), *(angle.moved for angle in confined.angles)]),
        as_written=as_written,
    )
    return solve_all(confined, time_limit=time_limit)


def bound_modes(measured: MeasuredRobot, at: ClosedConfiguration) -> int:
    """Return a root bound of the modes, complex ones too, from the degrees of the legs' conditions; the largest number
    if these are not known."""
    try:
        return bound_posed(measured, at)
    except (UnsupportedLocus, ExternalSolverFailure):
        return sys.maxsize


def count_modes(measured: MeasuredRobot, at: ClosedConfiguration) -> SystemModes:
    """List the modes with the measured values at a configuration, without near ones, and not read as poses of the
    robot's legs: as :func:`format_modes`, for many configurations of one robot that observes all its dof."""
    counted = None
    if measured.generic_pattern.motion != "oriented":
        with suppress(UnsupportedLocus, ExternalSolverFailure, TooLarge, MissingExtra):
            counted = solve_all(derive_all_loci(measured, at)[0], near=False)[1]
    if counted is not None and counted.complete:
        return counted
    try:
        return solve_posed(measured, at)[1]
    except (UnsupportedLocus, ExternalSolverFailure):
        if counted is None:
            raise
        return counted
