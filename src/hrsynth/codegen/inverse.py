"""Motors of a pose in closed form: what each leg carries (:mod:`..closed_forms`) determines its motor's coordinate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..analysis.branch.answer import BranchProof
from ..analysis.observed import ObservedRobot, RobotLike
from ..batch.engine import Batch
from ..closed_forms.leg_reading import list_motor_forms
from ..closed_forms.legs import ClosedFormLeg
from ..closed_forms.platform_points import PlatformPoint
from ..equations.joint_equations import TreeCoordinate
from ..equations.loop_parts import split_loop_system
from ..equations.tape import Tape
from ..errors import HrsynthError
from ..geometry.components import Components, arctan2, dot, minus, plus, scale, transform_vector
from ..geometry.components import cross as cross_
from ..geometry.vectors import Array, cross, find_perpendicular
from ..geometry.vectors import invert_pose as inverted
from ..mechanism import Mechanism
from ..results import Value
from ..tolerances import GEOMETRY_DIFFERENCE_TOL
from .branch_cells import TubedBranch
from .trace import TracedFunction

READS = ("end", "bend", "direction", "length")
"""Parts of a leg that may determine a coordinate."""
INVERSE_CHECK_SAMPLES_COUNT = 64
"""Motors that closed forms must give back."""


@dataclass(frozen=True, eq=False, repr=False)
class LegMotor(Value):
    """A motor's coordinate (m, rad) by what a leg carries: how far the ``end`` B of a crank or slider, the
    ``direction`` of a rod, or the rod seen from its crank (``bend``) has turned or slid since the zero configuration,
    or how much longer the rod is (``length``)."""

    coordinate: TreeCoordinate
    form: ClosedFormLeg
    reads: str
    point: Array
    """The platform's reference point in its own frame: the form takes its place and the rotation."""
    zero: Any
    """Value at the zero configuration."""

    def read(self, position: Components, R: Components) -> tuple[Any, Any]:
        """Return the reach margin, and the vector or length that determines the coordinate, at a pose of the platform's
        frame."""
        form, p = self.form, plus(position, transform_vector(R, self.point))
        tip = plus(plus(p if form.tip.follows else [0.0] * 3, transform_vector(R, form.tip.turned)), form.tip.constant)
        margin, found = form.at(tip, lambda value: value, form.mode, R)
        if self.reads == "end":
            return margin, minus(found, self.coordinate.point)
        rod = form.along(tip, found, R)
        if self.reads == "length":
            return margin, dot(rod, minus(tip, form.centre))
        if self.reads == "direction":
            return margin, rod
        axis, spoke = self.coordinate.axis, minus(found, form.centre)
        across = find_perpendicular(axis)
        return margin, plus(scale(dot(spoke, rod), across), scale(dot(cross_(spoke, rod), axis), cross(axis, across)))

    def at(self, position: Components, R: Components) -> tuple[Any, Any]:
        """Reach margin and coordinate at a pose of the platform's frame; turns between −π and π."""
        margin, found = self.read(position, R)
        axis, zero = self.coordinate.axis, self.zero
        if self.reads == "length":
            return margin, self._filed(found - zero)
        if self.coordinate.slides:
            return margin, self._filed(dot(minus(found, zero), axis))
        arm = zero - axis * (axis @ zero)
        return margin, self._filed(arctan2(dot(cross(axis, arm), found), dot(arm, found)))

    def _filed(self, value: Any) -> Any:
        """A coordinate from the zero configuration as the file counts it."""
        return value + self.coordinate.zero if self.coordinate.zero else value


def trace_inverse(rules: Sequence[LegMotor]) -> TracedFunction:
    """S, the legs' reach margins, and Q, the motors, of rotation r (9,) and position p (3,)."""
    tape = Tape([])
    pose = [tape.load(k) for k in range(12)]
    stores = [
        (array, (k,), value)
        for k, rule in enumerate(rules)
        for array, value in zip("SQ", rule.at(pose[9:], pose[:9]), strict=True)
    ]
    return TracedFunction.of(tape, [*(f"r[{k}]" for k in range(9)), *(f"p[{k}]" for k in range(3))], stores)


def find_closed_inverse(robot: RobotLike, proof: BranchProof, branch: TubedBranch) -> tuple[LegMotor, ...]:
    """A closed form for each motor, in the working mode of the zero configuration; none where a leg has none, or where
    the working mode is not proved to be the same in all cells (no Type 1 singularity in the box that they fill)."""
    if not proof.regular or any(part.volume_fraction > part.box_fraction for part in proof.parts):
        return ()
    try:
        observed = ObservedRobot.of(robot).by_segments("export")
        batch = observed.batch
    except HrsynthError:
        return ()
    if batch is None:
        return ()
    q, X = _sample_motors(proof, branch)
    found = []
    mechanism = branch.system.mechanism
    legs = {leg: batch.legs[leg.label] for leg in observed.decomposition.legs}
    for k, i in enumerate(branch.motors):
        coordinate = branch.system.coordinates[i]
        forms = list_motor_forms(
            mechanism, legs, mechanism.joints[coordinate.joint], partial(_locate_on_platform, batch, mechanism)
        )
        rules = (_find_rule(coordinate, form, reads, batch, X, q[:, k]) for form in forms for reads in READS)
        rule = next((each for each in rules if each is not None), None)
        if rule is None:
            return ()
        found.append(rule)
    return tuple(found)


def _sample_motors(proof: BranchProof, branch: TubedBranch) -> tuple[Array, Array]:
    """Motors (n, m) in the proved box, zero first, and the poses (n, 4, 4) of the platform's frame on the branch."""
    low, high = proof.proved
    system = proof.system
    q = np.random.default_rng(0).uniform(low, high, (INVERSE_CHECK_SAMPLES_COUNT, len(low)))
    place = {name: i for i, name in enumerate(system.names)}
    values = np.tile(system.zero * system.units, (INVERSE_CHECK_SAMPLES_COUNT, 1))
    q[0] = values[0, [place[name] for name in proof.motors]]
    values[:, [place[name] for name in proof.motors]] = q
    for part, loops in zip(proof.parts, split_loop_system(system)[0], strict=True):
        near = [cell.at(row) for row in values[:, loops.driven] if (cell := part.find(row)) is not None]
        units = system.units[list(loops.unknowns)]
        values[:, loops.unknowns] = (
            units * loops.close(values[:, loops.driven] / system.units[list(loops.driven)], np.array(near) / units)[0]
        )
    values /= system.units
    return q, np.array([system.pose(system.mechanism.platform, row.tolist()) for row in values])


def _locate_on_platform(batch: Batch, mechanism: Mechanism, place: Array) -> PlatformPoint:
    """A point that is fixed in the platform's link, by its place at zero."""
    X = mechanism.links[mechanism.platform].pose
    return PlatformPoint(True, (inverted(X) @ np.append(place, 1.0))[:3] - batch.coordinates.point, np.zeros(3))


def _find_rule(
    coordinate: TreeCoordinate, form: ClosedFormLeg, reads: str, batch: Batch, X: Array, q: Array
) -> LegMotor | None:
    """The closed form of a coordinate that gives motors q (n,), the first of them zero, but for whole turns, at their
    poses (n, 4, 4)."""
    position, R = list(X[:, :3, 3].T), list(X[:, :3, :3].reshape(-1, 9).T)
    rule = LegMotor(coordinate, form, reads, batch.coordinates.point, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        at_zero = rule.read([x[0] for x in position], [x[0] for x in R])[1]
        rule = replace(rule, zero=np.asarray(at_zero, dtype=float))
        margin, found = rule.at(position, R)
        off = found - q
        if not coordinate.slides:  # the program finds the turn that lies in the box
            off = off - 2 * np.pi * np.round(off / (2 * np.pi))
        if not (np.all(np.asarray(margin) > 0) and np.all(np.abs(off) <= GEOMETRY_DIFFERENCE_TOL)):
            return None
    return rule
